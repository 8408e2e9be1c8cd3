"""Fold curves: pressure and volume of the fold against the number that changes."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from ..quantities import axis_label, key_label
from ..results.folds import FOLD_NAMES, FoldCurve
from .backend import title_text
from .figures import save_figure, shown_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MARKERS = {"cusp": ("D", "cusp: two of them merge"), "branch_point": ("s", "branch point: limit point meets volume fold")}


def plot_fold_curve(curve: FoldCurve, path: str | PathLike[str] | None = None) -> Figure:
    """Pressure and volume of the fold against the number, also written to ``path`` if given.

    Raises
    ------
    InputError
        For a file that cannot be written.
    """
    figure = shown_figure((6.4, 6.0))
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


def _draw(axes: Axes, curve: FoldCurve, name: str) -> None:
    axes.plot(curve.values, getattr(curve, name), "-", color="#0072b2", linewidth=1.8, zorder=2, label=FOLD_NAMES[curve.kind])
    axes.plot(curve.values, getattr(curve, name), ".", color="#0072b2", markersize=4, zorder=2)
    for kind, (marker, text) in _MARKERS.items():
        places = np.array([[c.value, getattr(c, name)] for c in curve.cusps if c.kind == kind]).reshape(-1, 2)
        if len(places):
            look: dict[str, Any] = {"markersize": 7, "markerfacecolor": "white", "markeredgecolor": "black", "zorder": 3}
            axes.plot(*places.T, marker, label=text, **look)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="0.9", linewidth=0.6)
