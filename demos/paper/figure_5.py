"""Figure 5: a strong dipole below, M = 600, and the pole near the plane of the rim: pressure against volume.

As the pole rises from below the rim, the volume at first falls and then rises while the pressure falls, as the paper says: the pressure of
the states with the pole deep below is the highest. In detail, from a pole height of 1 downwards: with h = -3.5 pressure and volume turn
sharply near pole heights of 0.2 and 0.12, where the volume falls, rises and falls again. With h = -3.25 the meridional stress turns
compressive near a pole height of 0.32; a membrane has no resistance to that, the problem is ill-posed (Legendre's condition fails), and
the trace ends there and says so; the place depends on the mesh. Below a pole height of about 0.24 there are equilibria again.

The paper finds that its matrix of Legendre's condition is positive definite in all cases; between those two heights it is not. The paper
speaks of negative volumes, its text does not say at which h: here there are none with h = -3.25 and -3.5, and there are with h = -3.75.
Most of the states with a pole below a height of 0.3 are unstable to few waves around the axis: they tip, or wrinkle.

    python demos/paper/figure_5.py                 picture, curves and special points in out/figure-5, 8 seconds
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import paper
from paper import Result, Row

import femmembrane as fm
from femmembrane.results.table import write_csv, write_special_points_csv
from femmembrane.views import plots

STRENGTH = 600.0
LOWEST = -0.6
#: pressure and volume where the names of the curves stand, and pole height and pressure
NAMES = {-3.25: ((0.5, 4.35), (-0.35, 4.75)), -3.5: ((-0.12, 3.2), (-0.59, 2.85)), -3.75: ((-0.2, 1.35), (-0.55, 1.6))}


def falling(height: float) -> fm.Branch:
    """From pole height 1 downwards, as far as it goes."""
    of = paper.scene(STRENGTH, height)
    first = fm.equilibrium(of, center_height=1.0)
    return fm.trace(of, start=first, until={"center_height": LOWEST}, direction=-1, steps=paper.STEPS, throw=False)


def lower(start: fm.Equilibrium) -> fm.Branch:
    """The part at h = -3.25 below the gap: from a state at h = -3.5 with the pole below the rim, while the dipole is brought closer."""
    for height in np.linspace(-3.5, -3.25, 6)[1:]:
        start = fm.equilibrium(paper.scene(STRENGTH, float(height)), center_height=LOWEST, start=start)
    return fm.trace(start.scene, start=start, until={"center_height": 0.5}, direction=-1, steps=paper.STEPS, throw=False)


def draw(branches: list[fm.Branch], path: Path) -> None:
    figure, (left, right) = plots.new_figure((12.0, 6.2), widths=(1, 1))
    for branch in branches:
        paper.draw_curve(left, branch)
        paper.draw_curve(right, branch, across="center_height")
    for height, places in NAMES.items():
        for axes, place in zip((left, right), places, strict=True):
            axes.annotate(f"h = {height:g}", place, fontsize=11)
    left.set(xlim=(-0.3, 1.1), ylim=(0.8, 5.1))
    right.set(xlim=(LOWEST - 0.02, 1.0), ylim=(0.8, 5.1))
    paper.shared_legend(figure, (left,), 3)
    plots.save_figure(figure, path)


def make(out: Path) -> Result:
    below = {height: falling(height) for height in (-3.5, -3.25, -3.75)}
    rest = lower(below[-3.5][-1])
    branches = {**{f"h{height:g}": branch for height, branch in below.items()}, "h-3.25-lower": rest}
    for name, branch in branches.items():
        write_csv(branch, out / f"{name}.csv")
        write_special_points_csv(branch, out / f"{name}-special-points.csv")
    draw(list(branches.values()), out / "figure-5.png")
    least = {h: min(eq.volume for b in branches.values() for eq in b if b.scene.sources[0].height == h) for h in below}  # type: ignore[attr-defined]
    v, p = (below[-3.5].column(name)[::-1] for name in ("volume", "pressure"))  # while the pole rises
    falls = v[1] < v[0] and v[-1] > v[0] and p[-1] < p[0]
    rows = [
        Row("5", "V falls, then rises, P falls while the pole rises, M = 600, h = -3.5", "yes", "yes" if falls else "no", shown=True),
        *(Row("5", f"negative V, M = 600, h = {h:g} (paper: for some h)", "yes", "yes" if low < 0 else "no") for h, low in least.items()),
        Row("5", "Legendre's condition holds everywhere, h = -3.5", "yes", "yes" if not below[-3.5].message else "no"),
        Row("5", "Legendre's condition holds everywhere, h = -3.25", "yes", "yes" if not below[-3.25].message else "no", shown=True),
    ]
    paper.write_rows(rows, out / "figure-5.csv")
    check(below, rest, least)
    return Result((out / "figure-5.png",), tuple(rows))


def check(below: dict[float, fm.Branch], rest: fm.Branch, least: dict[float, float]) -> None:
    points = below[-3.5].special_points or ()
    assert [p.kind for p in points] == ["limit_point"] * 2 + ["volume_fold"] + ["limit_point"] * 2 + ["volume_fold"] * 2
    # the first two by an independent spectral Ritz solver, the folds recorded on 2026-11-22
    np.testing.assert_allclose([p.pressure for p in points[:2]], [2.1378358, 1.8151937], atol=2e-6)
    folds = [p for p in points if p.kind == "volume_fold"][:2]
    np.testing.assert_allclose([p.center_height for p in folds], [0.20753, 0.06665], atol=1e-5)
    assert below[-3.25].status is rest.status is fm.Status.LEGENDRE_FAILURE
    assert 0.31 < below[-3.25][-1].center_height < 0.34
    assert 0.22 < rest[-1].center_height < 0.24
    assert least[-3.75] < -0.2
    assert min(least[-3.5], least[-3.25]) > 0.05


if __name__ == "__main__":
    paper.main("figure-5", __doc__, make)
