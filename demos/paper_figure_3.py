"""Figure 3 of the paper: profiles of the inflated neo-Hookean disc at pole heights 1, 2 and 3, without magnets.

The paper prints the pressures 1.84, 1.585 and 1.1975 and compares the shapes with Verron & Marckmann, Thin-Walled Structures 41 (2003).
The second and third state lie behind the limit point (P = 1.879, pole height 1.174): they are stable under volume control only.

    python demos/paper_figure_3.py              picture and table in out/paper_figure_3, 2 seconds

Sources: the printed pressures from Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), figure 3. Ours, 1.839932, 1.583269 and
1.195292, were found by an independent spectral Ritz solver too; the difference from the third is the error of 64 quadratic elements.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import femmembrane as fm
from femmembrane.views import plots

SCENE = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(elements=64))
PAPER = {1.0: 1.84, 2.0: 1.585, 3.0: 1.1975}
#: solid, dashed, dotted; dark enough to print
LOOKS = (("-", "#0072b2"), ((0, (5, 2)), "#d55e00"), ((0, (1, 1.4)), "#222222"))


def draw(states: Sequence[fm.Equilibrium], path: Path) -> None:
    figure, axes = plots.new_figure((6.4, 5.0), title="Neo-Hookean disc at pole heights 1, 2 and 3")
    for eq, (dashes, color), paper in zip(states, LOOKS, PAPER.values(), strict=True):
        plots.draw_profile(axes, eq, plots.Style("", dashes, color))
        text = f"P = {eq.pressure:.4f} (paper: {paper:g})"
        axes.annotate(text, (0, eq.center_height), (0, -22), textcoords="offset points", ha="center", va="top", fontsize=9)
    plots.draw_surroundings(axes, states)
    plots.save_figure(figure, path)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/paper_figure_3"), help="folder for picture and table")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    states = [fm.equilibrium(SCENE, center_height=height) for height in PAPER]
    rows = [(height, paper, eq.pressure, eq.pressure - paper) for (height, paper), eq in zip(PAPER.items(), states, strict=True)]
    with (out / "figure-3.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([("center_height", "pressure_paper", "pressure", "difference"), *rows])
    draw(states, out / "figure-3.png")

    print(f"{'pole height':>11} {'P, paper':>9} {'P, ours':>10} {'difference':>11}  {'under pressure':<14}  under volume")
    for (height, paper, ours, difference), eq in zip(rows, states, strict=True):
        words = f"{eq.verdict('pressure').word:<14}  {eq.verdict('volume').word}"
        print(f"{height:>11g} {paper:>9.4f} {ours:>10.6f} {difference:>+11.6f}  {words}")

    np.testing.assert_allclose([eq.pressure for eq in states], [1.839932, 1.583269, 1.195292], atol=3e-6)
    np.testing.assert_allclose([eq.pressure for eq in states], list(PAPER.values()), rtol=2e-3)
    assert [eq.verdict("pressure").stable for eq in states] == [True, False, False]
    assert all(eq.verdict("volume").stable for eq in states)


if __name__ == "__main__":
    main(sys.argv[1:])
