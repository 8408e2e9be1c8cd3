"""What a verdict costs beside the equilibrium it is about.

Equilibria of the three-term Ogden disc below a dipole (M = 200, h = 6.5) on 64 quadratic elements, V = 0.5 to 75, by the warm-started
Newton corrector; then a verdict on each of them against every class of perturbations:

    cold    nothing known but the state
    warm    started from the mode of the equilibrium before, as a run does when its scene asks for verdicts

Every verdict is proved by inertia to rest on the smallest eigenvalue. The stresses and moduli along the membrane that n = 1, 2, 3 share
are computed once a state and counted with n = 1.

    python demos/verdict_cost.py            60 equilibria, a few seconds
    python demos/verdict_cost.py --quick    12 equilibria

Times are medians in one process after imports. On a shared machine they scatter by tens of per cent: compare rows with each other.
Source of the scene: Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), table 1 and figure 4.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.stability.checked_verdict import checked_verdict

SCENE = fm.Scene(
    material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
    sources=[fm.Dipole(strength=200, height=6.5)],
    susceptibility=2.5,
    mesh=fm.disc(elements=64),
)
#: name, control and number of waves of each class of perturbations, in the order in which a run asks
CLASSES = (("pressure", "pressure", 0), ("volume", "volume", 0), ("n = 1", None, 1), ("n = 2", None, 2), ("n = 3", None, 3))
LABELS = {
    "equilibrium": "Newton step to the next volume",
    "pressure": "verdict under pressure control",
    "volume": "verdict under volume control",
}


def verdicts(branch: fm.Branch, warm: bool) -> tuple[dict[str, float], dict[str, list[fm.Verdict]]]:
    """Median milliseconds and the verdicts of each class."""
    times: dict[str, list[float]] = {name: [] for name, _, _ in CLASSES}
    found: dict[str, list[fm.Verdict]] = {name: [] for name, _, _ in CLASSES}
    for eq in branch:
        # a solver hands its last evaluation on
        evaluation = eq.potential.evaluate(eq.state, eq.pressure)
        for name, control, n in CLASSES:
            guess = found[name][-1].coefficients if warm and found[name] else None
            clock = time.perf_counter()
            verdict = checked_verdict(eq.potential, eq.state, eq.pressure, evaluation, control, n, guess=guess)
            times[name].append(1e3 * (time.perf_counter() - clock))
            found[name].append(verdict)
    return {name: statistics.median(values) for name, values in times.items()}, found


def write(rows: Sequence[tuple[str, float, float]], path: Path) -> None:
    write_csv(path, ("what", "warm_ms", "cold_ms"), rows)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="12 equilibria instead of 60")
    parser.add_argument("--out", type=Path, default=Path("out/verdict_cost"), help="folder for the table")
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)

    volumes = np.linspace(0.5, 75, 12 if asked.quick else 60)
    verdicts(fm.inflate(SCENE, volumes=volumes[:2], solver="newton"), warm=True)  # first-call costs are not counted
    branch = fm.inflate(SCENE, volumes=volumes, solver="newton")
    step = 1e3 * statistics.median(branch.column("seconds").tolist()[1:])
    warm, found = verdicts(branch, warm=True)
    cold, again = verdicts(branch, warm=False)
    rows = [("equilibrium", step, float("nan")), *((name, warm[name], cold[name]) for name, _, _ in CLASSES)]
    write(rows, asked.out / "verdict_cost.csv")

    print(f"{len(branch)} equilibria on 64 quadratic elements      {'warm ms':>9} {'cold ms':>9} {'warm / equilibrium':>20}")
    for name, quick, slow in rows:
        label = LABELS.get(name, f"verdict, {name} wave{'s' if name != 'n = 1' else ''} around the axis")
        print(f"  {label:<42} {quick:>9.2f} {'' if np.isnan(slow) else f'{slow:.2f}':>9} {quick / step:>20.2f}")

    for name, _, _ in CLASSES:
        values = np.array([[v.smallest_eigenvalue for v in run[name]] for run in (found, again)])
        np.testing.assert_allclose(values[0], values[1], rtol=1e-8, atol=1e-9)  # warm or cold, the same verdict
        assert all(a.stable is b.stable for a, b in zip(found[name], again[name], strict=True))
    # whatever the machine: an axisymmetric verdict is a handful of equilibria; waves around the axis, which are not compiled, some dozens
    assert all(warm[name] < (100 if n else 10) * step for name, _, n in CLASSES), (warm, step)


if __name__ == "__main__":
    main(sys.argv[1:])
