"""How good estimated errors are, over the population of random scenes: the estimate over the true error of each number.

Every member has its state at its volume on a coarse mesh of its own shape. What is true is the same state on quartered elements of three
degrees more, whose own error is its distance to halved ones. Its branch is then followed to a limit point, a fold or an onset of a wave
around the axis, which is located on such a mesh again. Errors near to those of the reference, and to round-off, do not count. ::

    python -m tests.promises --estimates --count 200
"""

from __future__ import annotations

import sys
import warnings
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import femmembrane as fm
from femmembrane.accuracy.adapt import trial_mesh
from femmembrane.accuracy.place_estimate import estimate_place_in
from femmembrane.discretization.space import transferred
from femmembrane.potential import potential_of
from femmembrane.results.equilibrium import recorded
from femmembrane.solve.controls import CONTROLS
from femmembrane.solve.finer_space import solved_in
from femmembrane.solve.state import distance
from tests import population

#: estimates over true errors within these bounds are good
GOOD = (0.5, 2.0)
#: true errors below this many errors of the reference, and below this part of a number, say nothing
CLEAR, ROUND_OFF = 20.0, 3e-11
#: elements of the coarse meshes
ELEMENTS = 8
#: numbers of a state
NUMBERS = ("pressure", "elastic_energy", "magnetic_energy", "load_energy", "electric_energy", "energy")
OTHERS = ("lambda_pressure", "lambda_volume", "stress_first", "stress_last")


@dataclass(frozen=True)
class Ratio:
    """The estimate over the true error of one number of one member."""

    seed: int
    family: str
    number: str
    ratio: float


def of_state(member: population.Member) -> Iterator[Ratio]:
    """Those of the numbers of the state of a member; nothing where it is not found, or has no estimate."""
    scene = _coarse(member)
    eq = fm.equilibrium(scene, volume=member.volume, solver="newton")
    estimate = eq.error_estimate()
    if estimate.reason or eq.status.ill_posed:
        return
    better, best = (_again(eq, refined) for refined in (1, 2))
    if better is None or best is None:
        return
    known, middle, exact = (_numbers(one) for one in (eq, better, best))
    for name, value in known.items():
        true, floor = value - exact[name], abs(middle[name] - exact[name])
        size = max(abs(value), 1e-3 * abs(eq.elastic_energy) if "energy" in name else 0.0)
        if abs(true) > max(CLEAR * floor, ROUND_OFF * size):
            yield Ratio(member.seed, member.family, name, getattr(estimate, name).error / true)
    space = best.potential.space
    true = space.unit * distance(best.potential, best.state, transferred(eq.potential.space, eq.state, space))
    if true > ROUND_OFF * estimate.displacement.value:
        yield Ratio(member.seed, member.family, "displacement", estimate.displacement.error / true)


def _coarse(member: population.Member) -> fm.Scene:
    """The scene of a member on a coarse mesh of a low degree."""
    return member.scene.replace(mesh=trial_mesh(member.scene.mesh, ELEMENTS), degree=2 + member.seed % 3)


def _again(eq: fm.Equilibrium, refined: int) -> fm.Equilibrium | None:
    """The state at the same volume on elements divided so often."""
    finer = _finer(eq.scene, refined)
    potential = potential_of(finer)
    found = solved_in(potential, CONTROLS["volume"].at(eq.volume), eq.potential, eq.state, eq.pressure, damped=True)
    if found.status is not fm.Status.CONVERGED:
        return None
    return recorded(finer, potential, found.x, found.pressure, found.evaluation, found.status)


def _finer(scene: fm.Scene, refined: int) -> fm.Scene:
    mesh = scene.mesh
    for _ in range(refined):
        mesh = mesh.refined()
    return scene.replace(mesh=mesh, degree=min(8, scene.degree + 3))


def _numbers(eq: fm.Equilibrium) -> dict[str, float]:
    numbers = {name: float(getattr(eq, name)) for name in NUMBERS}
    for control in ("pressure", "volume"):
        numbers[f"lambda_{control}"] = eq.verdict(control).smallest_eigenvalue
    ends = eq.potential.space.ends
    first, last = eq.profile(ends[[0, -1]])["mechanical_stress_1"]
    return {**numbers, "stress_first": float(first), "stress_last": float(last)}


def of_places(member: population.Member) -> Iterator[Ratio]:
    """Those of P, V and the height of the special points that a short trace from the state of a member meets."""
    scene = _coarse(member).replace(analysis=fm.Analysis(azimuthal_modes=() if member.scene.bodies else (1,)))
    eq = fm.equilibrium(scene, volume=member.volume, solver="newton")
    branch = fm.trace(scene, start=eq, max_steps=40)
    for point in branch.special_points or ():
        estimate, own = point.error_estimate(), point.equilibrium
        if estimate.reason:
            continue
        asked = (own.potential, own.state, own.pressure, str(point.kind), point.azimuthal)
        middle, exact = (estimate_place_in(_finer(own.scene, refined), *asked) for refined in (1, 2))
        if middle is None or exact is None:
            continue
        for name in ("pressure", "volume", "center_height"):
            value = getattr(estimate, name).value
            true, floor = value - exact[name], abs(middle[name] - exact[name])
            if abs(true) > max(CLEAR * floor, ROUND_OFF * max(abs(value), own.potential.space.units[name])):
                yield Ratio(member.seed, member.family, f"{point.kind} {name}", getattr(estimate, name).error / true)


def ratios(members: Sequence[population.Member], places: bool = True) -> list[Ratio]:
    """All of them; a member that cannot be solved on so coarse a mesh has none."""
    found: list[Ratio] = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for member in members:
            for part in (of_state, of_places) if places else (of_state,):
                try:
                    found += list(part(member))
                except fm.SolveError:
                    continue
    return found


def good(ratio: Ratio) -> bool:
    """Whether an estimate is good to a factor of two."""
    return GOOD[0] <= ratio.ratio <= GOOD[1]


def table(found: Sequence[Ratio]) -> Iterator[str]:
    """A line for each number: how many, the share that is good, the median and the extremes; then what is off, by family."""
    by_number: dict[str, list[Ratio]] = defaultdict(list)
    for ratio in found:
        by_number[ratio.number].append(ratio)
    yield f"{'number':<28} {'count':>5} {'good':>7} {'5 %':>8} {'median':>8} {'95 %':>8}"
    for number, own in sorted(by_number.items()):
        values = np.array([ratio.ratio for ratio in own])
        low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
        yield f"{number:<28} {len(own):>5} {np.mean([good(r) for r in own]):>7.1%} {low:>8.2f} {middle:>8.2f} {high:>8.2f}"
    total = np.mean([good(ratio) for ratio in found]) if found else 0.0
    yield f"{'all':<28} {len(found):>5} {total:>7.1%}"
    off: dict[str, Any] = Counter(ratio.family for ratio in found if not good(ratio))
    yield "off: " + (", ".join(f"{family} {count}" for family, count in off.most_common()) or "none")
    for ratio in sorted((r for r in found if not good(r)), key=lambda r: -abs(np.log(abs(r.ratio) + 1e-300)))[:20]:
        yield f"  {ratio.seed:>5} {ratio.family:<12} {ratio.number:<28} {ratio.ratio:>10.3g}"


def study(members: Sequence[population.Member]) -> None:
    """Print the table."""
    for line in table(ratios(members)):
        sys.stdout.write(line + "\n")
