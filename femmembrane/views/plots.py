"""Whole figures of a branch: pressure against volume with its verdicts, deformed meridians, and wrinkling zones.

``plot_...`` make a whole figure; ``draw_...`` draw onto given axes, for figures of one's own. This module has all that such figures need:
frames and styles from :mod:`.figures`, branches from :mod:`.branch_lines`, meridians from :mod:`.meridians`.
"""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..quantities import Units, axis_label, caption
from .branch_lines import MARKERS, after, answer, draw_branch
from .figures import (
    AMONG,
    BOTH,
    MARGINAL,
    PLAIN,
    SOLID,
    UNSTABLE,
    VOLUME_ONLY,
    Style,
    draw_legend,
    legend_below,
    legend_entries,
    new_figure,
    save_axes,
    save_figure,
    show_in_notebooks,
    tell_apart,
    verdict_style,
)
from .labels import add_label
from .meridians import draw_profile, draw_surroundings
from .zones import fill_zones

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..results.branch import Branch

#: inches that a picture needs for a legend beside it
_WIDE = 5.0

__all__ = [
    "BOTH",
    "MARGINAL",
    "MARKERS",
    "PLAIN",
    "UNSTABLE",
    "VOLUME_ONLY",
    "Style",
    "add_label",
    "after",
    "answer",
    "draw_branch",
    "draw_legend",
    "draw_profile",
    "draw_surroundings",
    "draw_zones",
    "legend_entries",
    "new_figure",
    "plot_branch",
    "plot_pressure_volume",
    "plot_profiles",
    "plot_zones",
    "save_figure",
    "tell_apart",
    "verdict_style",
]


def plot_pressure_volume(branch: Branch, path: str | PathLike[str] | None = None, *, units: str = "scaled") -> Figure:
    """Pressure against volume, or over a number what answers to it.

    Line styles tell the verdicts that the scene asked for, markers the special points found.

    Parameters
    ----------
    branch : Branch
        With one or more equilibria.
    path : path, optional
        Picture to write; the suffix chooses the format.
    units : {"scaled", "si"}
        In units of the package, or in SI units by the scales of the scene.

    Raises
    ------
    InputError
        For an empty branch, a file that cannot be written, or SI units of a scene without scales.
    """
    _require_equilibria(branch)
    figure, axes = new_figure((6.4, 4.6), title=branch.scene.title)
    draw_branch(axes, branch, across=branch.over or "volume", up=answer(branch), units=units)
    draw_legend(axes, _heading(branch))
    return save_figure(figure, path)


def plot_branch(
    branch: Branch,
    path: str | PathLike[str] | None = None,
    *,
    ax: Axes | None = None,
    x: str | None = None,
    y: str | None = None,
    label: str | None = None,
    units: str = "scaled",
) -> Axes:
    """One quantity of a branch against another, on axes of its own or onto given ones; see :meth:`.Branch.plot`.

    Raises
    ------
    InputError
        For an empty branch, an unknown quantity, a file that cannot be written, or SI units of a scene without scales.
    """
    _require_equilibria(branch)
    if ax is None:
        figure, ax = new_figure((6.4, 4.6), title=branch.scene.title if label is None else "")
        show_in_notebooks(ax, figure)
    across = (branch.over or "volume") if x is None else x
    draw_branch(ax, branch, across=across, up=answer(branch) if y is None else y, label=label, units=units)
    draw_legend(ax, _heading(branch) if label is None else None)
    return save_axes(ax, path)


def _heading(branch: Branch) -> str | None:
    """Verdicts under a control are about axisymmetric shapes alone."""
    return AMONG if branch.scene.analysis.stability else None


def plot_profiles(
    branch: Branch, path: str | PathLike[str] | None = None, count: int = 6, *, zones: bool | None = None, units: str = "scaled"
) -> Figure:
    """Deformed meridians of some equilibria, evenly spread along the branch, with the magnetic sources.

    Parameters
    ----------
    branch : Branch
        With one or more equilibria.
    path : path, optional
        Picture to write; the suffix chooses the format.
    count : int
        Number of meridians, first and last equilibrium included.
    zones : bool, optional
        Mark the wrinkled parts; by default when the scene asks for wrinkling.
    units : {"scaled", "si"}
        In units of the package, or in SI units by the scales of the scene.

    Raises
    ------
    InputError
        For an empty branch, a count below 1, or a file that cannot be written.
    """
    _require_equilibria(branch)
    if count < 1:
        raise InputError("count", count, "a whole number >= 1 is allowed")
    shown = [branch[int(k)] for k in np.unique(np.linspace(len(branch) - 1, 0, min(count, len(branch))).round().astype(int))]
    chosen = Units.of(units, branch.scene.converter)
    figure, axes = new_figure((6.4, 5.6), title=branch.scene.title)
    from matplotlib import colormaps

    # lightness falls along the map, so that neighbours differ in grey as well
    colors = colormaps["viridis"](np.linspace(0.85, 0.0, max(len(shown), 2)))
    for equilibrium, color in zip(shown, colors, strict=False):
        named = caption(equilibrium.volume, equilibrium.pressure, ",  ", chosen)
        draw_profile(axes, equilibrium, Style(named, SOLID, color), zones=zones, units=chosen)
    draw_surroundings(axes, shown, chosen)
    handles, labels = legend_entries(axes)
    if figure.get_size_inches()[0] < _WIDE:
        legend_below(figure, handles, labels)
    else:
        axes.set_anchor("W")  # the legend stands on the right
        look: dict[str, Any] = {"bbox_to_anchor": (1.01, 0.5), "frameon": False, "fontsize": 9, "handlelength": 3.2}
        axes.legend(handles[::-1], labels[::-1], loc="center left", **look)
    return save_figure(figure, path)


def plot_zones(branch: Branch, path: str | PathLike[str] | None = None, *, units: str = "scaled") -> Figure:
    """Taut and wrinkled zones: reference radius (of a curved meridian: arc length) against volume, or the step where that is not monotone.

    Parameters
    ----------
    branch : Branch
        With one or more equilibria; the criterion is its scene's ("total" if that asks for none).
    path : path, optional
        Picture to write; the suffix chooses the format.
    units : {"scaled", "si"}
        In units of the package, or in SI units by the scales of the scene.

    Raises
    ------
    InputError
        For an empty branch, a file that cannot be written, or SI units of a scene without scales.
    """
    _require_equilibria(branch)
    figure, axes = new_figure((6.4, 4.2), title=branch.scene.title)
    handles = draw_zones(axes, branch, units=units)
    legend_below(figure, handles, [handle.get_label() for handle in handles], 2, handlelength=3.0, handleheight=1.8)
    return save_figure(figure, path)


def draw_zones(axes: Axes, branch: Branch, *, units: str = "scaled") -> list[Any]:
    """The zones of a branch on labelled axes, as in :func:`plot_zones`; handles for a legend."""
    chosen = Units.of(units, branch.scene.converter)
    volume = chosen.factor("volume") * np.array([equilibrium.volume for equilibrium in branch])
    steps = np.diff(volume)
    monotone = steps.size > 0 and bool((steps > 0).all() or (steps < 0).all())
    handles = fill_zones(axes, branch, volume if monotone else np.arange(volume.size, dtype=float), chosen.factor("r"))
    axes.set_xlabel(axis_label("volume" if monotone else "step", chosen))
    flat = "s" not in branch[0].profile()
    axes.set_ylabel(axis_label("r" if flat else "s", chosen))
    axes.margins(0)
    return list(handles)


def _require_equilibria(branch: Branch) -> None:
    if not len(branch):
        raise InputError("branch", "no equilibria", "a branch with one or more equilibria is needed")
