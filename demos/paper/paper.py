"""What the figures have in common: the paper's material and scenes, and tables of its numbers beside ours.

Paper: P. Saxena, N. H. Reddy & S. P. Pradhan, Magnetoelastic deformation of a circular membrane: wrinkling and limit point instabilities,
Int. J. Non-Linear Mech. 116 (2019), abbreviated "the paper" here. Its table 1 gives the parameters.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.views import plots

MATERIAL = fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0))
#: numbers of waves around the axis that are tried
WAVES = (1, 2, 3)
#: steps of a trace, short enough for smooth curves
STEPS = fm.StepControl(largest=0.15, turn=0.15)
TIPPING = "unstable to 1, 2 or 3 waves around the axis"


def scene(strength: float, height: float, wrinkling: str | None = None, stability: Sequence[str] = ("pressure", "volume")) -> fm.Scene:
    """A disc of the paper's material and a dipole (none for strength 0)."""
    return fm.Scene(
        material=MATERIAL,
        sources=[fm.Dipole(strength=strength, height=height)] if strength else [],
        susceptibility=2.5 if strength else None,
        mesh=fm.disc(elements=16),
        degree=4,
        analysis=fm.Analysis(stability=stability, wrinkling=wrinkling),
    )


@dataclass(frozen=True)
class Row:
    """One number or statement of the paper beside ours.

    Attributes
    ----------
    figure, what : str
    paper, here : float or str
        Two numbers or two words.
    as_printed : float, optional
        The number by the paper's equations (60) as they are printed, see :mod:`printed_equations`.
    shown : bool
        Also in the short table of README.md beside this file.
    """

    figure: str
    what: str
    paper: float | str
    here: float | str
    as_printed: float | None = None
    shown: bool = False

    def cells(self) -> list[str]:
        paper = self.paper if isinstance(self.paper, str) else f"{self.paper:.10g}"
        here = self.here if isinstance(self.here, str) else f"{self.here:.4f}"
        printed = "" if self.as_printed is None else f"{self.as_printed:.3f}"
        return [self.figure, self.what, paper, here, self.difference(), printed]

    def difference(self) -> str:
        """Relative, or in a word."""
        if isinstance(self.paper, str) or isinstance(self.here, str):
            return "same" if self.paper == self.here else "decided" if self.paper in ("unclear", "uncertain") else "differs"
        return f"{round(self.here / self.paper - 1, 3) + 0.0:+.1%}"


HEADER = ("figure", "what is shown", "paper", "here", "difference", "by (60) as printed")


@dataclass(frozen=True)
class Result:
    """What a figure gives: pictures in its folder, and rows."""

    pictures: tuple[Path, ...]
    rows: tuple[Row, ...]


def write_rows(rows: Sequence[Row], path: Path) -> None:
    write_csv(path, HEADER, (row.cells() for row in rows))


def show(rows: Sequence[Row]) -> None:
    table = [HEADER, *(row.cells() for row in rows)]
    widths = [max(len(cells[k]) for cells in table) for k in range(len(HEADER))]
    for cells in table:
        texts = [c.ljust(w) if k < 2 else c.rjust(w) for k, (c, w) in enumerate(zip(cells, widths, strict=True))]
        print("  ".join(texts).rstrip())


def main(name: str, doc: str | None, make: Callable[[Path], Result]) -> None:
    """The command line of one figure."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out") / name, help="folder for pictures and table")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    show(make(out).rows)


# --- states and verdicts


def at_heights(of: fm.Scene, heights: Sequence[float], start: fm.Equilibrium | None = None) -> list[fm.Equilibrium]:
    """Equilibria at heights of the pole, each found from the one before."""
    found: list[fm.Equilibrium] = []
    for height in heights:
        found.append(fm.equilibrium(of, center_height=height, start=found[-1] if found else start))
    return found


def at_pressures(branch: fm.Branch, pressures: Sequence[float]) -> list[fm.Equilibrium]:
    """Equilibria at pressures, met one after the other while a branch is walked along.

    Where the branch never reaches a pressure after the place of the one before, an AssertionError names it.
    """
    found, k = [], 0
    p = branch.column("pressure")
    for pressure in pressures:
        crossing = next((j for j in range(k, len(p) - 1) if (p[j] - pressure) * (p[j + 1] - pressure) <= 0), None)
        if crossing is None:
            raise AssertionError(f"P = {pressure} is not met after a pole height of {branch[k].center_height:.3g}")
        k = crossing
        t = (pressure - p[k]) / (p[k + 1] - p[k])
        height = (1 - t) * branch[k].center_height + t * branch[k + 1].center_height
        near = fm.equilibrium(branch.scene, center_height=height, start=branch[k])
        found.append(fm.equilibrium(branch.scene, pressure=pressure, start=near, solver="newton"))
    return found


def tips(eq: fm.Equilibrium) -> bool:
    """Whether some number of waves around the axis, of those tried, makes it unstable."""
    return any(eq.verdict(azimuthal=n).stable is False for n in WAVES)


def verdict_words(eq: fm.Equilibrium) -> str:
    """What a state is stable against, in few words."""
    held = "stable" if eq.verdict("pressure").stable else "at held V only" if eq.verdict("volume").stable else "unstable"
    return held + (", tips" if tips(eq) else "")


# --- pictures


def draw_curve(axes: Any, branch: fm.Branch, across: str = "volume", up: str = "pressure") -> None:
    """A branch with its verdicts, and a grey band behind the part that is unstable to waves around the axis."""
    plots.draw_branch(axes, branch, across=across, up=up, dots=False)
    sampled = [*branch[::2], branch[-1]]  # verdicts against waves cost more than the curve
    band = [(getattr(eq, across), getattr(eq, up)) if tips(eq) else (np.nan, np.nan) for eq in sampled]
    if np.isfinite(band).any():
        label = None if TIPPING in axes.get_legend_handles_labels()[1] else TIPPING
        axes.plot(*np.array(band).T, color="0.8", linewidth=9, solid_capstyle="butt", zorder=1, label=label)


def draw_plain(axes: Any, branch: fm.Branch, across: str = "volume") -> None:
    """The disc without a dipole, thin."""
    style = plots.Style("M = 0", (0, (8, 2, 1.5, 2)), "#777777", 1.0)
    plots.draw_branch(axes, branch, across=across, style=style, dots=False, special_points=False)


def draw_halves(axes: Any, shown: Sequence[fm.Equilibrium], styles: Sequence[plots.Style]) -> None:
    """Deformed meridians from the axis to the rim, with their wrinkled zones if the scene asks for them."""
    for eq, style in zip(shown, styles, strict=True):
        plots.draw_profile(axes, eq, style)
    plots.draw_surroundings(axes, shown)
    axes.set_xlim(left=0)


def shared_legend(figure: Any, panels: Sequence[Any], columns: int, *, dipole: bool = False) -> None:
    """One legend below all panels; a dipole is named where it is seen."""
    named = dict(pair[::-1] for axes in panels for pair in zip(*plots.legend_entries(axes), strict=True))
    order = [style.label for style in (plots.BOTH, plots.VOLUME_ONLY, plots.UNSTABLE, plots.MARGINAL)]
    labels = [label for label in order if label in named] + [label for label in named if label not in order and "dipole" not in label]
    handles = [named[label] for label in labels]
    if dipole:
        labels.append("dipole")
        handles.append(next(handle for label, handle in named.items() if label.startswith("dipole")))
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, frameon=False, fontsize=10, handlelength=3.2)
