"""Whether meshes that are chosen for an accuracy keep their promise, over the population of random scenes.

Every member is asked for its state at its volume on a mesh of its own shape that is still to be chosen. The reference is the same state on
halved elements of two degrees more. Its own error is its distance to the state on halved elements of one degree more. ::

    python -m tests.promises --count 500 --accuracy 1e-6
    python -m tests.promises --count 200 --estimates
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections import Counter
from dataclasses import dataclass, fields, replace
from typing import Any

import femmembrane as fm
from femmembrane.potential import potential_of
from femmembrane.solve.controls import CONTROLS
from femmembrane.solve.finer_space import solved_in
from tests import estimates, population

#: part of the sizes of elastic and magnetic energy, and of the stress over the size, that stands for a pressure that is smaller
SMALL = 1e-2


@dataclass(frozen=True)
class Outcome:
    """What came of one member: how often the promised error is exceeded (1 is just kept), or why nothing was promised."""

    seed: int
    family: str
    verdict: str
    ratio: float = 0.0
    floor: float = 0.0
    text: str = ""


def asking(mesh: Any, accuracy: float) -> Any:
    """The shape of a mesh, with its elements still to be chosen."""
    plain = {"elements": None, "ratio": 1.0, "radii": None, "ends": None, "divisions": 1, "estimated": None, "accuracy": accuracy}
    return replace(mesh, **{f.name: plain[f.name] for f in fields(mesh) if f.name in plain})


def promised(member: population.Member, accuracy: float) -> Outcome:
    """Ask one member, and compare with the reference."""
    scene = member.scene
    scene = scene.replace(mesh=asking(scene.mesh, accuracy), degree=None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            eq = fm.equilibrium(scene, volume=member.volume, solver="newton")
        except fm.SolveError as error:
            return Outcome(member.seed, member.family, f"refused: {error.status.value}", text=str(error)[:200])
        except Exception as error:
            return Outcome(member.seed, member.family, "crashed", text=f"{type(error).__name__}: {error}"[:200])
        mesh = eq.scene.mesh
        halved = mesh.on_ends(mesh.breakpoints()).refined()
        finer = [potential_of(eq.scene.replace(mesh=halved, degree=min(8, eq.scene.degree + more))) for more in (1, 2)]
        held = CONTROLS["volume"].at(member.volume)
        better, best = (solved_in(potential, held, eq.potential, eq.state, eq.pressure, damped=True) for potential in finer)
    if not (better.status is best.status is fm.Status.CONVERGED):
        return Outcome(member.seed, member.family, "no reference", text="the finer meshes have no such state")
    unit = eq.potential.space.unit
    error, floor = (_distance(one, best, unit) for one in (eq, better))
    if floor > 0.3 * accuracy:
        return Outcome(member.seed, member.family, "no reference", error / accuracy, floor, f"its own error is {floor:.1e}")
    verdict = "kept" if error <= accuracy else "missed" if error <= 3 * accuracy else "missed by more than 3"
    return Outcome(member.seed, member.family, verdict, error / accuracy, floor, f"{mesh.elements} elements of degree {eq.scene.degree}")


def _distance(one: Any, best: Any, unit: float) -> float:
    """The larger relative error of the pressure and of the energy."""
    energy = one.energy if isinstance(one, fm.Equilibrium) else one.evaluation.energy
    size = abs(best.evaluation.elastic_energy) + abs(best.evaluation.magnetic_energy)
    least = SMALL * SMALL * size / unit**3
    pressure = abs(one.pressure - best.pressure) / max(abs(best.pressure), least)
    return float(max(pressure, abs(energy - best.evaluation.energy) / size))


def main() -> None:
    """Print a table of verdicts and a line for each member that did not keep its promise."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--accuracy", type=float, default=1e-6)
    parser.add_argument("--estimates", action="store_true", help="how good estimated errors are, in place of promises")
    options = parser.parse_args()
    members = list(population.recorded().values())[options.first : options.first + options.count]
    if options.estimates:
        estimates.study(members)
        return
    outcomes = []
    for member in members:
        outcome = promised(member, options.accuracy)
        outcomes.append(outcome)
        if outcome.verdict != "kept":
            sys.stdout.write(f"{outcome.seed:5d} {outcome.family:12s} {outcome.verdict:30s} {outcome.ratio:9.2g} {outcome.text}\n")
            sys.stdout.flush()
    counts = Counter(outcome.verdict for outcome in outcomes)
    for verdict, count in counts.most_common():
        sys.stdout.write(f"{verdict:30s} {count:5d} {count / len(outcomes):7.1%}\n")


if __name__ == "__main__":
    main()
