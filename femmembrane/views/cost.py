"""Work against precision: error against milliseconds, each degree and each method with its own marker and line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from os import PathLike
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import choice
from ..errors import InputError
from ..quantities import axis_label, heading
from .backend import title_text
from .figures import fitting_columns, new_figure, save_axes, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..results.cost import Cost, Measurement

_HEADINGS = {"warm": "a neighbouring state is known (next load step)", "cold": "cold start"}
#: marker of each degree and its shade on a map whose lightness falls, so that they differ in grey as well
_MARKERS = {1: "o", 2: "s", 3: "v", 4: "^", 5: "<", 6: "D", 7: ">", 8: "p"}
_METHODS: dict[str, tuple[str, Any, str]] = {
    "shooting": ("x", (0, (1, 1.2)), "shooting, Newton"),
    "collocation": ("+", (0, (4, 1.2, 1, 1.2)), "collocation"),
    "published": ("*", (0, (1, 3)), "shooting as published"),
}
_DARK = "#222222"
#: letters of a title in an inch
_LETTERS = 13.0


def plot_cost(study: Cost, path: str | PathLike[str] | None = None, *, ax: Axes | None = None, start: str | None = None) -> Figure | Axes:
    """Relative error against wall time of one equilibrium, one panel for each kind of start. A broad line joins the solves that no other
    solve beats.

    Newton solid with filled markers, IPOPT dashed with open ones. Curves end where they meet the error of the reference, at the
    edge of a grey band.

    Parameters
    ----------
    study : Cost
        With one or more solves that converged.
    path : path, optional
        Picture to write; the suffix chooses the format.
    ax : matplotlib Axes, optional
        Where to draw one kind of start.
    start : {"warm", "cold"}, optional
        The only kind that is drawn.

    Raises
    ------
    InputError
        Without solves that converged, for an unknown kind of start, or for a file that cannot be written.
    """
    solves = [line for line in study.select(what="solve") if line.converged]
    kinds = _HEADINGS if start is None else (choice("start", start, _HEADINGS),)
    starts = [kind for kind in kinds if any(line.start == kind for line in solves)]
    if not starts:
        raise InputError("study", "no solves", "a study with one or more converged solves is needed")
    if ax is None:
        figure, row = new_figure((4.9 * len(starts) + 1.2, 5.2), widths=[1.0] * len(starts))
    panels: Any = np.atleast_1d(row) if ax is None else [ax]
    floor = study.reference.error
    for axes, kind in zip(panels, starts, strict=False):
        _draw(axes, [line for line in solves if line.start == kind], floor)
        axes.set_title(_HEADINGS[kind], fontsize=10)
        axes.set_xlabel(axis_label("milliseconds"))
        axes.set_ylabel(f"relative error of the {study.quantity}" if axes is panels[0] else "")
        axes.sharey(panels[0])
    bottom = 0.25 * floor
    panels[0].set_ylim(bottom, 3 * max(max(line.error for line in solves), floor))
    for axes in panels:
        axes.axhspan(bottom, floor, color="0.85", linewidth=0, zorder=0, label="below the error of the reference")
    if ax is not None:
        ax.legend(fontsize=8.5, framealpha=0.9, edgecolor="none", handlelength=3.4)
        return save_axes(ax, path)
    entries = {label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    look: dict[str, Any] = {
        "ncols": min(4 if len(starts) > 1 else 2, fitting_columns(figure)),
        "frameon": False,
        "fontsize": 8.5,
        "handlelength": 3.4,
    }
    figure.legend(list(entries.values()), list(entries), loc="outside lower center", **look)
    title = f"{title_text(study.scene.title)}, " if study.scene.title else ""
    said = fill(study.sentence, int(_LETTERS * figure.get_figwidth()))
    figure.suptitle(f"{title}{heading(study.control)} = {study.load:.6g}\n{said}".rstrip(), fontsize=10, wrap=True, parse_math=False)
    return save_figure(figure, path)


def _draw(axes: Axes, lines: Sequence[Measurement], floor: float) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(color="0.92", linewidth=0.6)
    front = sorted((line for line in lines if line.front), key=lambda line: line.milliseconds)
    axes.plot(
        *_places(front, floor),
        "-",
        color="#f0c040",
        linewidth=9,
        alpha=0.75,
        solid_capstyle="round",
        zorder=1,
        label="nothing is better in both",
    )
    for label, own, style in _series(lines):
        axes.plot(*_places(_above(own, floor), floor), label=label, zorder=3, **style)
    _tick_times(axes)


def _tick_times(axes: Axes) -> None:
    """Plain numbers: 1, 2, 5 in every decade where there are few."""
    from matplotlib.ticker import LogLocator, NullFormatter

    low, high = axes.get_xlim()
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 100 * low else (1.0,)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def _above(lines: Sequence[Measurement], floor: float) -> list[Measurement]:
    """A curve down to where it first meets the error of the reference. Finer meshes only take longer from there on."""
    for k, line in enumerate(lines):
        if line.error <= floor:
            return list(lines[: k + 1])
    return list(lines)


def _places(lines: Sequence[Measurement], floor: float) -> tuple[list[float], list[float]]:
    return [line.milliseconds for line in lines], [max(line.error, floor) for line in lines]


def _series(lines: Sequence[Measurement]) -> Iterator[tuple[str, list[Measurement], dict[str, Any]]]:
    """Label, lines and look of each curve, finite elements first."""
    from matplotlib import colormaps

    degrees = sorted({line.degree for line in lines if line.degree})
    solvers: tuple[tuple[str, Any, str], ...] = (("newton", "-", "Newton"), ("ipopt", (0, (4, 2)), "IPOPT"))
    for solver, dashes, name in solvers:
        for degree in degrees:
            own = [line for line in lines if (line.method, line.degree) == (solver, degree)]
            color = colormaps["viridis"](0.85 - 0.85 * (degree - 1) / 7)
            look = {"marker": _MARKERS[degree], "linestyle": dashes, "color": color, "linewidth": 1.3, "markersize": 6}
            if solver == "ipopt":
                look |= {"markerfacecolor": "white", "linewidth": 1.0, "markersize": 5}
            if own:
                yield f"degree {degree}, {name}", own, look
    for method, (marker, dashes, label) in _METHODS.items():
        own = [line for line in lines if line.method == method]
        if own:
            yield label, own, {"marker": marker, "linestyle": dashes, "color": _DARK, "linewidth": 1.3, "markersize": 8}
