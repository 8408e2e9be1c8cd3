"""Figures that follow a style of Matplotlib, such as those for the two widths of a journal.

``matplotlib.style.use("femmembrane.views.column")`` (88 mm) and ``"femmembrane.views.page"`` (180 mm) hold for all figures of the package.
Its pictures are laid out for Matplotlib's usual sizes. Under another style text, lines and markers have the sizes of that style relative to
the usual ones, and the figure has the width of the style.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: what is left of a size under a style, beside the usual size
_USUAL = {"font.size": 10.0, "lines.linewidth": 1.5, "lines.markersize": 6.0}
_USUAL_SIZE = (6.4, 4.8)
#: inches that a panel needs, and that a legend takes below panels that are lower than usual
_PANEL, _LEGEND = 1.7, 0.5
#: what marks an artist that has its size
_FITTED = "_femmembrane_fitted"


def layout(size: tuple[float, float], panels: int) -> tuple[tuple[float, float], int]:
    """Size in inches of a figure that is usually so large, and how many panels stand in a row: all of them, unless a style is narrow."""
    from matplotlib import rcParams

    width = float(rcParams["figure.figsize"][0])
    if tuple(rcParams["figure.figsize"]) == _USUAL_SIZE:
        return size, panels
    row = min(panels, max(int(width / _PANEL), 1))
    rows = ceil(panels / row)
    each = size[1] / (size[0] / panels) * width / row
    return (width, rows * min(each, width) + (_LEGEND if panels > 1 else 0.0)), row


def fit(figure: Figure) -> None:
    """Give what was drawn since the last time the sizes of the style. Under the usual style nothing changes."""
    from matplotlib import rcParams

    sizes: Mapping[str, Any] = rcParams  # type: ignore[assignment]  # its keys are literals
    text, line, marker = (float(sizes[name]) / usual for name, usual in _USUAL.items())
    if (text, line, marker) == (1.0, 1.0, 1.0):
        return
    for axes in figure.axes:
        for drawn in axes.lines:
            _once(drawn, lambda it: (it.set_linewidth(line * it.get_linewidth()), it.set_markersize(marker * it.get_markersize())))
        for words in (*axes.texts, axes.title):
            _once(words, lambda it: it.set_fontsize(text * it.get_fontsize()))
    for words in (*figure.texts, *([figure._suptitle] if figure._suptitle else [])):  # type: ignore[attr-defined]  # no other way to it
        _once(words, lambda it: it.set_fontsize(text * it.get_fontsize()))
    for legend in (*figure.legends, *(axes.get_legend() for axes in figure.axes)):
        if legend is not None:
            _fit_legend(figure, legend, text)


def _fit_legend(figure: Figure, legend: Any, text: float) -> None:
    """Words smaller, and lines as they are drawn."""
    drawn = {line.get_label(): line for axes in figure.axes for line in axes.lines}
    for words in (*legend.get_texts(), legend.get_title()):
        _once(words, lambda it: it.set_fontsize(text * it.get_fontsize()))
    for handle, words in zip(legend.legend_handles, legend.get_texts(), strict=True):
        like = drawn.get(words.get_text())
        if like is not None and hasattr(handle, "set_markersize"):
            handle.set_linewidth(like.get_linewidth())
            handle.set_markersize(like.get_markersize())


def _once(artist: Any, change: Any) -> None:
    if not hasattr(artist, _FITTED):
        change(artist)
        setattr(artist, _FITTED, True)
