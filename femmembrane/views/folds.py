"""Fold curves: pressure and volume of the fold against the number that changes."""

from __future__ import annotations

from itertools import pairwise
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..checks import choice
from ..quantities import PLACES, axis_label, key_label
from ..results.folds import FOLD_NAMES, FoldCurve
from .backend import load, title_text
from .figures import save_axes, save_figure, shown_figure
from .journal import layout

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

#: points of the drawn line from one point of the curve to the next, and distance at which two points are one
_PARTS, _SAME = 12, 1e-9
_MARKERS = {"cusp": ("D", "cusp: two of them merge"), "branch_point": ("s", "branch point: limit point meets volume fold")}


def plot_fold_curve(
    curve: FoldCurve, path: str | PathLike[str] | None = None, *, ax: Axes | None = None, y: str = "pressure"
) -> Figure | Axes:
    """Pressure and volume of the fold against the number, or one of its quantities on given axes.

    Raises
    ------
    InputError
        For a file that cannot be written, and an unknown quantity.
    """
    choice("y", y, PLACES)
    if ax is not None:
        _draw(ax, curve, y)
        ax.set(xlabel=key_label(curve.parameter), ylabel=f"at the fold: {axis_label(y)}")
        ax.legend(fontsize=9, framealpha=0.9, edgecolor="none")
        return save_axes(ax, path)
    load()
    figure = shown_figure(layout((6.4, 6.0), 1)[0])
    panels = figure.subplots(2, 1, sharex=True)
    title = curve.equilibria[0].scene.title if curve.equilibria else ""
    heading = title_text(title) or FOLD_NAMES[curve.kind][0].upper() + FOLD_NAMES[curve.kind][1:]
    figure.suptitle(heading, fontsize=11, wrap=True, parse_math=False)
    for axes, name in zip(panels, ("pressure", "volume"), strict=True):
        _draw(axes, curve, name)
        axes.set_ylabel(f"at the fold: {axis_label(name)}")
    panels[-1].set_xlabel(key_label(curve.parameter))
    panels[0].legend(fontsize=9, framealpha=0.9, edgecolor="none")
    return save_figure(figure, path)


def _line(curve: FoldCurve, name: str) -> Array:
    """The curve through all points and cusps, smooth in between: cubics over the length of the chords in all quantities together."""
    from scipy.interpolate import CubicSpline

    names = ("pressure", "volume", "center_height")
    points = np.stack([curve.values, *(getattr(curve, n) for n in names)], axis=1)
    scale = np.maximum(np.ptp(points, axis=0), 1e-300)
    for cusp in curve.cusps:
        points = _with(points, np.array([cusp.value, *(getattr(cusp, n) for n in names)]), scale)
    keep = np.concatenate([[True], np.linalg.norm(np.diff(points, axis=0) / scale, axis=1) > _SAME])
    points = points[keep]
    shown = points[:, [0, 1 + names.index(name)]]
    if len(points) < 3:
        return shown
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points / scale, axis=0), axis=1))])
    fine = np.concatenate([*(np.linspace(a, b, _PARTS, endpoint=False) for a, b in pairwise(at)), at[-1:]])
    smooth = CubicSpline(at, shown, bc_type="periodic" if curve.closed and np.array_equal(shown[0], shown[-1]) else "not-a-knot")
    line: Array = smooth(fine)
    return line


def _with(points: Array, point: Array, scale: Array) -> Array:
    """Points with one more between the two neighbours for which it is the smallest detour."""
    if len(points) < 2:
        return points
    a, b = points[:-1] / scale, points[1:] / scale
    detour = np.linalg.norm(point / scale - a, axis=1) + np.linalg.norm(point / scale - b, axis=1) - np.linalg.norm(b - a, axis=1)
    return np.insert(points, int(np.argmin(detour)) + 1, point, axis=0)


def _draw(axes: Axes, curve: FoldCurve, name: str) -> None:
    axes.plot(*_line(curve, name).T, "-", color="#0072b2", linewidth=1.8, zorder=2, label=FOLD_NAMES[curve.kind])
    axes.plot(curve.values, getattr(curve, name), ".", color="#0072b2", markersize=4, zorder=2)
    for kind, (marker, text) in _MARKERS.items():
        places = np.array([[c.value, getattr(c, name)] for c in curve.cusps if c.kind == kind]).reshape(-1, 2)
        if len(places):
            look: dict[str, Any] = {"markersize": 7, "markerfacecolor": "white", "markeredgecolor": "black", "zorder": 3}
            axes.plot(*places.T, marker, label=text, **look)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="0.9", linewidth=0.6)
