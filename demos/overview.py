"""One picture of what the package does: a whole branch with its stability, and the membrane in space.

A three-term Ogden disc (susceptibility 2.5) is inflated below a dipole of strength M = 200 at height h = 6.5. Its branch is followed by arc
length from V = 0.1 past three limit points (dP = 0) and a fold of the volume (dV = 0) to a pole height of 5.2, close below the dipole:
every rubber balloon has the first two limit points; the third and the fold come from the pull of the dipole. On the right the membrane at
V = 75, as seen from the side.

    python demos/overview.py                    picture and tables in out/overview, 6 seconds

Sources: material and scene from Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), table 1 and figure 4. The special points
asserted at the end come from an independent spectral Ritz solver, converged to more digits than are given.
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
from femmembrane.views import picture, plots

#: inches of the picture, width and height: 1600 by 760 pixels
SIZE = (10.0, 4.75)

SCENE = fm.Scene(
    material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
    sources=[fm.Dipole(strength=200, height=6.5)],
    susceptibility=2.5,
    mesh=fm.disc(elements=64),
    analysis=fm.Analysis(stability=("pressure", "volume")),
)


def draw(branch: fm.Branch, inflated: fm.Equilibrium, folder: Path, path: Path) -> None:
    """Both panels in one picture."""
    from matplotlib import rc_context

    with rc_context({"font.family": "STIXGeneral", "mathtext.fontset": "stix", "font.size": 12, "axes.labelsize": 13}):
        figure, (left, right) = plots.new_figure(SIZE, widths=(1.28, 1.0))
        draw_curve(left, branch, inflated)
        draw_membrane(figure, right, inflated, folder)
        plots.save_figure(figure, path)


def draw_curve(axes: Any, branch: fm.Branch, inflated: fm.Equilibrium) -> None:
    plots.draw_branch(axes, branch, dots=False)
    axes.plot(inflated.volume, inflated.pressure, "*", color="black", markersize=12, zorder=5, label="shown on the right")
    axes.set_xlabel(r"enclosed volume  $V / R_0^{\,3}$")
    axes.set_ylabel(r"pressure  $P = p R_0 / (\mu T)$")
    axes.set_xlim(0, 90)
    axes.set_ylim(0, 2.05)
    axes.set_title(r"Equilibria of a disc below a dipole, $M = 200$, $h = 6.5\,R_0$", fontsize=13, loc="left")
    plots.draw_legend(
        axes, "among axisymmetric shapes:", fontsize=9, title_fontsize=9, loc="lower left", bbox_to_anchor=(0.13, 0.02), labelspacing=0.3
    )
    inset = axes.inset_axes((0.60, 0.485, 0.36, 0.225))
    plots.draw_branch(inset, branch, dots=False)
    inset.set(xlim=(81.95, 83.0), ylim=(1.9225, 1.936), xlabel="", ylabel="", xticks=(82, 82.5, 83), yticks=(1.925, 1.93, 1.935))
    inset.tick_params(labelsize=10)
    zoom = axes.indicate_inset_zoom(inset, edgecolor="0.5")
    for line, shown in zip(zoom.connectors, (False, False, False, True), strict=True):  # the others would cross the curve
        line.set_visible(shown)


def draw_membrane(figure: Any, axes: Any, inflated: fm.Equilibrium, folder: Path) -> None:
    """The rendered surface, its own colour scale cut off, with one in the typeface of the figure."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.image import imread

    picture.render(inflated, folder / "membrane.png", quantity="stretch_2", size=(1400, 1300))
    image = imread(folder / "membrane.png")[..., :3]
    image = image[:, : int(0.84 * image.shape[1])]
    coloured = np.ptp(image, axis=2) > 0.1  # the rest of the scale is grey
    rows, columns = np.flatnonzero(coloured.any(axis=1)), np.flatnonzero(coloured.any(axis=0))
    axes.imshow(image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1], interpolation="antialiased")
    axes.set_axis_off()
    axes.set_title(rf"The membrane at $V = {inflated.volume:g}\,R_0^{{\,3}}$, dipole above it", fontsize=13, loc="left")
    stretch = inflated.profile()["stretch_2"]
    scale = ScalarMappable(Normalize(stretch.min(), stretch.max()), "viridis")
    bar = figure.colorbar(scale, ax=axes, shrink=0.62, aspect=18, pad=0.03)
    bar.set_label(r"circumferential stretch $\lambda_2$")
    bar.outline.set_visible(False)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/overview"), help="folder for picture and tables")
    parser.add_argument("--picture", type=Path, help="write the picture to this file as well")
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)

    branch = fm.trace(SCENE, start=0.1, until={"center_height": 5.2}, steps=fm.StepControl(largest=0.06, turn=0.1))
    inflated = fm.equilibrium(SCENE, volume=75.0)
    write_csv(branch, asked.out / "branch.csv")
    write_special_points_csv(branch, asked.out / "special_points.csv")
    for path in filter(None, (asked.out / "overview.png", asked.picture)):
        draw(branch, inflated, asked.out, path)

    print(f"{len(branch)} equilibria from V = {branch[0].volume:g} to pole height {branch[-1].center_height:g}")
    print(f"{'':<12} {'V':>10} {'P':>10} {'pole':>8} {'error':>8}")
    for p in branch.special_points or ():
        print(f"{p.kind.replace('_', ' '):<12} {p.volume:>10.6g} {p.pressure:>10.7g} {p.center_height:>8.5g} {p.error:>8.0e}")

    points = branch.special_points or ()
    assert [p.kind for p in points] == ["limit_point"] * 3 + ["volume_fold"]
    np.testing.assert_allclose([p.pressure for p in points], [1.894595, 1.485627, 1.933883, 1.930891], atol=2e-6)
    np.testing.assert_allclose([p.volume for p in points], [2.42233, 22.28724, 82.46971, 82.74808], rtol=1e-5)
    assert abs(branch[-1].center_height - 5.2) < 1e-9
    assert (branch[-1].verdict("pressure").word, branch[-1].verdict("volume").word) == ("unstable", "unstable")
    assert inflated.verdict("pressure").stable


if __name__ == "__main__":
    main(sys.argv[1:])
