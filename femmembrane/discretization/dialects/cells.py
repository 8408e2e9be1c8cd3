"""Kinds of cells by the numbers that VTK gives them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import Lines, UnreadableError, runs

_VERTEX, _POLY_VERTEX, _LINE, _POLYLINE, _PARABOLA = 1, 2, 3, 4, 21
_NAMES = {
    1: "vertex",
    2: "vertex",
    5: "triangle",
    6: "triangle",
    7: "polygon",
    8: "quad",
    9: "quad",
    10: "tetra",
    12: "hexahedron",
    13: "wedge",
    14: "pyramid",
    22: "triangle6",
    23: "quad8",
    24: "tetra10",
    28: "quad9",
    35: "line4",
}


def add_vtk_cells(lines: Lines, connectivity: Any, ends: Any, kinds: Any) -> None:
    """Sort the cells of an unstructured grid by their kinds."""
    points, starts = runs(connectivity, ends)
    kinds = np.asarray(kinds, dtype=np.int64)
    if len(kinds) != len(starts) - 1:
        raise UnreadableError(f"it has {len(starts) - 1} cells and the kinds of {len(kinds)}")
    for kind, size in ((_LINE, 2), (_PARABOLA, 3)):
        chosen = np.flatnonzero(kinds == kind)
        if (np.diff(starts)[chosen] != size).any():
            raise UnreadableError(f"a line has {size} points, and cells do not fit the list of their points")
        lines.add(points[starts[chosen][:, None] + np.arange(size)])
    for k in np.flatnonzero(kinds == _POLYLINE):
        lines.add_polyline(points[starts[k] : starts[k + 1]])
    lines.others |= {_NAMES.get(kind, f"kind {kind} of VTK") for kind in set(kinds.tolist()) - {_LINE, _POLYLINE, _PARABOLA}}


def add_polylines(lines: Lines, connectivity: Any, ends: Any) -> None:
    """Add the lines of PolyData."""
    points, starts = runs(connectivity, ends)
    sizes = np.diff(starts)
    pairs: NDArray[np.bool_] = sizes == 2
    lines.add(points[starts[:-1][pairs][:, None] + np.arange(2)])
    for k in np.flatnonzero(sizes > 2):
        lines.add_polyline(points[starts[k] : starts[k + 1]])
