"""Branches through limit points, folds and sharp turns, followed by arc length, and one that ends where a membrane cannot go.

(a) M = 200, h = 6.5 (dipole above): through the third limit point and the volume fold to a pole height of 5.2, close below the dipole.
(b) M = 600, h = -3.5 (below): deflated from a pole height of 1 to -0.5. Near pole heights 0.2 and 0.12 pressure and volume turn sharply:
    the volume falls, rises and falls again.
(c) M = 600, h = -3.25 (below): deflated from a pole height of 1 until the meridional stress turns compressive. A membrane has no resistance
    to that, the problem is ill-posed beyond (Legendre's condition fails), and the trace says so instead of going on. The place depends
    on the mesh: pole heights of about 0.337, 0.334, 0.330 on 64, 128, 256 elements.

    python demos/branches.py                    pictures and tables in out/branches, 8 seconds

Sources: material and scenes from Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), table 1 and figures 4 and 5. Limit points
and fold of (a) and the first two limit points of (b) from an independent spectral Ritz solver; the volumes of the folds of (b) were
recorded with this package on 2026-11-22 and change by less than 1e-6 from 64 to 256 elements.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import femmembrane as fm
from femmembrane.results.table import write_csv, write_special_points_csv
from femmembrane.views import plots

STEPS = fm.StepControl(largest=0.06, turn=0.07)  # shorter than accuracy needs, for smooth curves


def scene(strength: float, height: float, title: str) -> fm.Scene:
    return fm.Scene(
        material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
        sources=[fm.Dipole(strength=strength, height=height)],
        susceptibility=2.5,
        mesh=fm.disc(elements=64),
        analysis=fm.Analysis(stability=("pressure", "volume")),
        title=title,
    )


def rising() -> fm.Branch:
    return fm.trace(scene(200, 6.5, "Dipole above, M = 200, h = 6.5"), start=0.1, until={"center_height": 5.2}, steps=STEPS)


def falling(height: float) -> fm.Branch:
    """From pole height 1 towards -0.5, as far as it goes."""
    below = scene(600, height, f"Dipole below, M = 600, h = {height:g}, deflated from pole height 1")
    first = fm.equilibrium(below, center_height=1.0)
    return fm.trace(below, start=first, until={"center_height": -0.5}, direction=-1, steps=STEPS, throw=False)


def show(branch: fm.Branch) -> None:
    print(f"\n{branch.scene.title}: {len(branch)} equilibria, {branch.status}")
    if branch.message:
        print(f"  {branch.message}")
    print(f"  {'':<12} {'V':>10} {'V/(2 pi)':>10} {'P':>10} {'pole':>9} {'error':>7}")
    for p in branch.special_points or ():
        name = p.kind.replace("_", " ")
        print(f"  {name:<12} {p.volume:>10.6g} {p.volume / (2 * np.pi):>10.6f} {p.pressure:>10.7g} {p.center_height:>9.5f} {p.error:>7.0e}")


def draw_rising(branch: fm.Branch, path: Path) -> None:
    figure, axes = plots.new_figure((7.2, 5.0), title=branch.scene.title)
    plots.draw_branch(axes, branch, dots=False)
    axes.set(xlim=(0, 90), ylim=(-0.05, 2.1))
    plots.draw_legend(axes, "among axisymmetric shapes:", loc="lower left", bbox_to_anchor=(0.06, 0.03))
    zoom(axes, branch, "around the fold", (0.64, 0.24, 0.34, 0.32), (81.4, 83.1), (1.918, 1.937))
    plots.save_figure(figure, path)


def zoom(axes: Any, branch: fm.Branch, title: str, box: Sequence[float], across: Sequence[float], up: Sequence[float]) -> None:
    """A part of the plot of pressure against volume, enlarged, in a box given in fractions of the axes."""
    inset = axes.inset_axes(box)
    plots.draw_branch(inset, branch, dots=False)
    inset.set(xlim=across, ylim=up, xlabel="", ylabel="")
    inset.set_title(title, fontsize=9)
    inset.locator_params(nbins=3)
    inset.tick_params(labelsize=8)


def draw_falling(branch: fm.Branch, path: Path) -> None:
    """Against volume, where the branch turns, and against pole height, along which it runs on."""
    figure, (left, right) = plots.new_figure((10.0, 4.8), title=branch.scene.title, widths=(1, 1))
    plots.draw_branch(left, branch, dots=False)
    plots.draw_branch(right, branch, across="center_height", dots=False)
    plots.draw_legend(right, "among axisymmetric shapes:", loc="upper right")
    if branch.special_points:
        zoom(left, branch, "the turns", (0.28, 0.56, 0.28, 0.36), (0.19, 0.34), (1.95, 2.12))
        zoom(left, branch, "the first of them", (0.70, 0.56, 0.28, 0.36), (0.2086, 0.2122), (2.078, 2.0915))
    plots.save_figure(figure, path)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/branches"), help="folder for pictures and tables")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)
    branches = {"above": rising(), "below-3.5": falling(-3.5), "below-3.25": falling(-3.25)}
    for name, branch in branches.items():
        show(branch)
        write_csv(branch, out / f"{name}.csv")
        write_special_points_csv(branch, out / f"{name}-special-points.csv")
        draw = draw_rising if name == "above" else draw_falling
        draw(branch, out / f"{name}.png")
    check(**{name.split("-")[-1]: branch for name, branch in branches.items()})


def check(**branches: fm.Branch) -> None:
    above, turns, ends = branches["above"], branches["3.5"], branches["3.25"]
    points = above.special_points or ()
    assert [p.kind for p in points] == ["limit_point"] * 3 + ["volume_fold"]
    np.testing.assert_allclose([p.pressure for p in points], [1.894595, 1.485627, 1.933882, 1.930890], atol=2e-6)
    np.testing.assert_allclose([p.volume for p in points], [2.42233, 22.28724, 82.46970, 82.74807], rtol=1e-6)
    assert above.status is fm.Status.CONVERGED

    points = turns.special_points or ()
    assert [p.kind for p in points] == ["limit_point"] * 2 + ["volume_fold"] + ["limit_point"] * 2 + ["volume_fold"]
    np.testing.assert_allclose([p.pressure for p in points[:2]], [2.1378358, 1.8151937], atol=2e-6)
    folds = [p for p in points if p.kind == "volume_fold"]
    np.testing.assert_allclose([p.volume / (2 * np.pi) for p in folds], [0.033314, 0.051470], atol=1e-6)
    np.testing.assert_allclose([p.center_height for p in folds], [0.20753, 0.06665], atol=1e-5)
    assert abs(turns[-1].center_height + 0.5) < 1e-9

    assert ends.status is fm.Status.LEGENDRE_FAILURE
    assert 0.32 < ends[-1].center_height < 0.34
    assert not ends.special_points


if __name__ == "__main__":
    main(sys.argv[1:])
