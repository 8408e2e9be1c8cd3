"""A fit as a figure and as a page: data with the fitted curve and its band, residuals, numbers with intervals, and what data determine."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html import escape
from itertools import pairwise
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from ..files import replace_file
from ..quantities import QUANTITIES, axis_label, words
from ..results.fit import percent
from .backend import title_text
from .figures import save_figure, shown_figure
from .html import page_of, pairs, table
from .svg import inline_svg

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..results.fit import Fit, FittedColumn

_BLUE, _RED = "#0072b2", "#d55e00"
#: points of a curve between two states, and columns of data that one figure has room for
_PARTS, _MOST_PANELS = 12, 6
_PROFILE = ("r", "z", "profile")


def plot_fit(fit: Fit, path: str | PathLike[str] | None = None) -> Figure:
    """One panel for each measured column with its residuals below, also written to ``path`` if given.

    Raises
    ------
    InputError
        For a file that cannot be written.
    """
    shown = fit.columns[:_MOST_PANELS]
    figure = shown_figure((max(5.2, 4.2 * len(shown)), 5.4))
    panels = figure.subplots(2, len(shown), sharex="col", squeeze=False, height_ratios=[3.0, 1.2])
    title = title_text(fit.scene.title) or _title(fit)
    figure.suptitle(title, fontsize=11, wrap=True, parse_math=False)
    for k, column in enumerate(shown):
        _draw(panels[0, k], column, len(fit.columns) > 1)
        _draw_residuals(panels[1, k], column)
    panels[0, 0].legend(fontsize=9, framealpha=0.9, edgecolor="none")
    return save_figure(figure, path)


def _title(fit: Fit) -> str:
    parts = []
    for name, value in fit.values.items():
        error, unit = fit.standard_errors[name], f" {fit.units[name]}" if fit.units[name] else ""
        size = abs(error / value) if value else np.inf
        spread = f" ± {percent(size)}" if size < 10 else ""
        parts.append(f"{name.removeprefix('material.')} = {value:.4g}{unit}{spread}")
    return ", ".join(parts)


def _draw(axes: Axes, column: FittedColumn, several: bool) -> None:
    x, order = column.held, np.argsort(column.held, kind="stable")
    line: dict[str, Any] = {"color": _BLUE, "linewidth": 1.8, "zorder": 2}
    if column.quantity in _PROFILE:
        axes.plot(x, column.predicted, "_", color=_BLUE, markersize=8, label="fitted")
    else:
        places, first = np.unique(x[order], return_index=True)
        at = order[first]
        fine, curve = _curve(places, column.predicted[at], column.slope[at])
        band = np.interp(fine, places, column.band[at])
        known = np.isfinite(band)
        axes.fill_between(
            fine[known], (curve - band)[known], (curve + band)[known], color=_BLUE, alpha=0.25, linewidth=0, label="95 % band"
        )
        axes.plot(fine, curve, label="fitted", **line)
    look: dict[str, Any] = {"fmt": "o", "color": "#222222", "markersize": 4, "elinewidth": 1.0, "zorder": 3}
    spread = column.held_deviation if column.held_deviation.any() else None
    axes.errorbar(column.held_measured, column.measured, yerr=column.deviation, xerr=spread, label="measured", **look)
    axes.set_ylabel(_named(column.quantity, column.header))
    if several:
        axes.set_title(column.test.rpartition("/")[2], fontsize=9)
    axes.grid(color="0.9", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)


def _curve(x: np.ndarray, y: np.ndarray, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Through all states along their slopes, which are exact."""
    from scipy.interpolate import CubicHermiteSpline

    if len(x) < 2:
        return x, y
    fine = np.unique(np.concatenate([np.linspace(a, b, _PARTS) for a, b in pairwise(x)]))
    return fine, CubicHermiteSpline(x, y, slope)(fine)


def _named(quantity: str, header: str) -> str:
    """Text at an axis for a column, in the unit that its header ends in: ``pole_height_mm`` is a pole height in mm."""
    unit = re.fullmatch(r"[a-z_]+?_((?:[munµ]|[kM]|c|d|h)?(?:m[23]?|Pa|l|bar)|psi|mmHg)|[^(\[]*[(\[](.+)[)\]]\s*", header.strip())
    if header == quantity or unit is None or quantity not in QUANTITIES:
        return axis_label(quantity) if header == quantity else header
    return f"{words(quantity)} in {unit[1] or unit[2]}"


def _draw_residuals(axes: Axes, column: FittedColumn) -> None:
    axes.axhspan(-1.96, 1.96, color="0.93", zorder=0, linewidth=0)
    axes.axhline(0.0, color="0.4", linewidth=0.8, zorder=1)
    axes.plot(column.held, -column.residual, "o", color=_RED, markersize=4, zorder=2)
    top = max(3.0, 1.1 * float(np.abs(column.residual).max(initial=0.0)))
    axes.set_ylim(-top, top)
    axes.set_xlabel(_named(column.against, column.against_header))
    axes.set_ylabel("residual/sd")
    axes.spines[["top", "right"]].set_visible(False)


def write_fit_report(fit: Fit, path: str | PathLike[str]) -> None:
    """Write the page of a fit, one file without links to a network.

    Raises
    ------
    InputError
        For a file that cannot be written.
    """
    svg, colors = inline_svg(plot_fit(fit), "measured and fitted, residuals below", "fit")
    title = fit.scene.title or "Fitted numbers"
    bodies = "\n".join(f"<section>\n<h2>{escape(name)}</h2>\n{body}\n</section>" for name, body in _sections(fit, svg))
    page = page_of(title, f"<p>{escape(fit.verdict)}</p>", bodies, colors)
    with replace_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8", errors="backslashreplace")


def _sections(fit: Fit, svg: str) -> Iterator[tuple[str, str]]:
    rows = []
    for name in fit.parameters:
        value, error, (low, high) = fit.values[name], fit.standard_errors[name], fit.intervals[name]
        relative = percent(error / abs(value)) if value and error < 10 * abs(value) else "not determined"
        kind = "profile likelihood" if name in fit.profiled else "linearised"
        rows.append([f"{name}{f' ({fit.units[name]})' if fit.units[name] else ''}", value, relative, low, high, kind])
    yield "Numbers", table(["number", "value", "standard error", "from", "to", "95 % interval"], rows)
    yield "Data and fit", f"<figure>{svg}</figure>"
    if len(fit.parameters) > 1:
        cells = [[name, *map(float, row)] for name, row in zip(fit.parameters, fit.correlation.matrix, strict=True)]
        yield "Correlation", table(["", *fit.parameters], cells)
    facts: list[tuple[str, Any]] = [
        ("verdict", fit.verdict),
        ("sum of squares over variances", fit.chi_square),
        ("degrees of freedom", fit.freedom),
        ("determined combinations", fit.combinations),
        ("status", fit.status),
        *((f"noise of {name}, estimated", value) for name, value in fit.noise.items()),
        *(("note", note) for note in fit.notes),
    ]
    yield "How far to trust it", pairs(facts)
    cells = [list(row) for row in fit._rows()]
    yield "Residuals", table(["test", "row", "state", "column", "held", "measured", "predicted", "deviation", "residual"], cells[:200])
