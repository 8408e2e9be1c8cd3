"""Labels beside lines: each stands where it covers no line, no marker and no other label."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: what tells a label from other words in a picture
_LABEL = "femmembrane label"
#: directions in which a label may stand beside its place, the first ones preferred, and distances in points
_WAYS = ((1, 1), (-1, 1), (1, 0), (-1, 0), (1, -1), (-1, -1), (0, 1), (0, -1))
_DISTANCES = (5.0, 2.5, 9.0, 15.0)
#: points that lines keep from a label
_CLEAR = 1.5


def add_label(axes: Axes, text: str, place: Any, *, way: tuple[int, int] = (1, 1), size: float = 9.0) -> None:
    """A label beside a place. It goes the way that is asked for, unless it would cover something: see :func:`settle`."""
    axes.annotate(text, place, xytext=(0, 0), textcoords="offset points", fontsize=size, zorder=5, gid=f"{_LABEL} {way[0]} {way[1]}")
    _put(axes.texts[-1], way, _DISTANCES[0])


def settle(figure: Figure) -> None:
    """Move the labels of a figure to where they cover nothing, or as little as can be."""
    if not any(_labels(axes) for axes in figure.axes):
        return
    figure.draw_without_rendering()
    for axes in figure.axes:
        taken = [text.get_window_extent() for text in axes.texts if not _is_label(text) and text.get_text()]
        for text in _labels(axes):
            taken.append(_settled(axes, text, taken))


def covered(axes: Axes, box: Any) -> int:
    """How many lines of the axes, markers included, enter a box of pixels."""
    return sum(meets(path, box) for path in _paths(axes))


def meets(path: Any, box: Any) -> bool:
    """Whether a path enters a box. Ends that are not finite cut it."""
    points = path.vertices
    pieces = np.split(points, np.flatnonzero(~np.isfinite(points).all(axis=1)))
    parts = [piece[np.isfinite(piece).all(axis=1)] for piece in pieces]
    return any(box.count_contains(part) > 0 or (len(part) > 1 and type(path)(part).intersects_bbox(box, filled=False)) for part in parts)


def _paths(axes: Axes) -> Iterator[Any]:
    for line in axes.lines:
        if line.get_visible() and np.size(line.get_xdata()) and line.get_transform() == axes.transData:
            yield line.get_transform().transform_path(line.get_path())


def _is_label(text: Any) -> bool:
    return str(text.get_gid() or "").startswith(_LABEL)


def _labels(axes: Axes) -> list[Any]:
    return [text for text in axes.texts if _is_label(text)]


def _settled(axes: Axes, text: Any, taken: list[Any]) -> Any:
    """Put a label where it covers least, and answer its box."""
    wished = tuple(int(part) for part in text.get_gid().split()[-2:])
    ways = [wished, *(way for way in _WAYS if way != wished)]
    clear, inside = _CLEAR * axes.get_figure(root=True).dpi / 72, axes.get_window_extent()  # type: ignore[union-attr]  # they are drawn
    best: tuple[int, float, tuple[int, ...]] | None = None
    for distance in _DISTANCES:
        for way in ways:
            _put(text, way, distance)
            box = text.get_window_extent()
            out = not (inside.contains(*box.p0) and inside.contains(*box.p1))
            cost = 10 * covered(axes, box.padded(clear)) + 10 * sum(box.overlaps(other) for other in taken) + 10 * out
            if best is None or cost < best[0]:
                best = (cost, distance, way)
            if cost == 0:
                return box
    _, distance, way = best  # type: ignore[misc]  # there are ways
    _put(text, way, distance)
    return text.get_window_extent()


def _put(text: Any, way: tuple[int, ...], distance: float) -> None:
    text.xyann = (way[0] * distance, way[1] * distance)
    text.set_horizontalalignment(("center", "left", "right")[way[0]])
    text.set_verticalalignment(("center", "bottom", "top")[way[1]])
