"""Points of a mesh that are meant to be the same, and points that are meant to lie on the axis.

Programs write coordinates with 16 digits, with 7, or with fewer. So some points agree to round-off only: the two ends of a ring, the ends
of segments that were drawn one by one, a pole at R = sin(pi). Points are made equal if they agree to :data:`.meridian.ROUND_OFF` of the
size of the mesh and are close in comparison with the cells there. Each function also says in words what it changed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .meridian import LEAST_LENGTH, ROUND_OFF, Array, extent

Cells = NDArray[np.int64]

#: points closer than this part of the length of a cell are close in comparison with it
_SHARE = 0.1


def mended(points: Array, step: int) -> tuple[Array, tuple[str, ...]]:
    """The points of one curve. Its ends are closed, and points are put on the axis and on the plane Z = 0, where they lie there to
    round-off.

    ``step`` is the number of points that a cell takes, 2 where it has one inside. Points are (R, Z), shape (n, 2).
    """
    points, remarks = points.copy(), []
    lengths = np.hypot(*(points[step::step] - points[:-step:step]).T)
    size = extent(*points.T)
    if not (len(lengths) and np.isfinite(points).all()):
        return points, ()
    near = np.minimum(ROUND_OFF * size, _SHARE * lengths[[0, -1]])
    gap = float(np.hypot(*(points[-1] - points[0])))
    on_axis = np.abs(points[[0, -1], 0]) <= near
    if len(lengths) > 2 and gap <= near.min() and not on_axis.any():
        if gap:
            points[-1] = points[0]
            remarks.append(f"the ends of the curve, {gap:.1e} apart, were joined: it is closed")
        return points, tuple(remarks)
    if len(lengths) > 2 and gap <= _SHARE * lengths[[0, -1]].min() and not on_axis.any():
        middle = (points[0] + points[-1]) / 2  # the same whichever way the curve runs
        where = f"r = {middle[0]:.4g}, z = {middle[1]:.4g}"
        remarks.append(f"the two ends, at {where}, are {gap:.1e} apart and were left so; for a closed curve let them coincide")
    for end, limit, pole in zip((0, -1), near, on_axis, strict=True):
        R, Z = points[end].tolist()
        if pole and R:
            points[end, 0] = 0.0
            remarks.append(f"the end at z = {Z:.4g}, {abs(R):.1e} from the axis, was put on it: it is a pole")
        if 0 < abs(Z) <= limit and np.ptp(points[:, 1]) > limit:
            points[end, 1] = 0.0
            remarks.append(f"the end at r = {R:.4g}, {abs(Z):.1e} from the plane z = 0, was put on it")
    return points, tuple(remarks)


def merged(points: Array, cells: Cells) -> tuple[Cells, tuple[str, ...]]:
    """The cells, each once, with points that are meant to be the same made one.

    Points that agree to round-off of double precision are one. Loose ends are points at which a single cell ends. They are joined where
    they agree to round-off of single precision. Other points are not: in a strongly graded mesh two points of one element may be as close.
    """
    used = np.unique(cells)
    if not np.isfinite(points[used]).all():
        return cells, ()
    size = extent(*points[used].T)
    lengths = np.hypot(*(points[cells[:, 1]] - points[cells[:, 0]]).T)
    if not (lengths > LEAST_LENGTH * size).all():  # the curve will be refused, with the number of the cell
        return cells, ()
    number = np.arange(len(points))
    number[used] = used[_groups(points[used], LEAST_LENGTH * size)]
    joined, remarks = int((number[used] != used).sum()), []
    cells = number[cells]
    cells, lengths, twice = _once(cells, lengths)
    nodes, counts = np.unique(cells[:, :2], return_counts=True)
    loose = nodes[counts == 1]
    at_loose = np.isin(cells[:, :2], loose)
    shortest = np.full(len(points), np.inf)
    np.minimum.at(shortest, cells[:, :2], lengths[:, None])
    reach = ROUND_OFF * size
    apart = 0.0
    if at_loose.any():
        found = loose[_groups(points[loose], reach)]
        distance = np.hypot(*(points[loose] - points[found]).T)
        same = (found != loose) & (distance <= _SHARE * np.minimum(shortest[loose], shortest[found]))
        number = np.arange(len(points))
        number[loose[same]] = found[same]
        together = number[cells[:, :2]]
        if (together[:, 0] != together[:, 1]).all():
            cells, joined = number[cells], joined + int(same.sum())
            apart = float(distance[same].max(initial=0.0))
    if joined:
        points_were = "1 point was" if joined == 1 else f"{joined} points were"
        remarks.append(f"{points_were} merged with others at the same place" + (f" (up to {apart:.1e} apart)" if apart else ""))
    if twice:
        cells_were = "1 cell that is listed more than once was" if twice == 1 else f"{twice} cells that are listed more than once were"
        remarks.append(f"{cells_were} taken once")
    return cells, tuple(remarks)


def _once(cells: Cells, lengths: Array) -> tuple[Cells, Array, int]:
    """Cells without repetitions; a cell counts as repeated in either direction."""
    turned = np.concatenate([np.sort(cells[:, :2], axis=1), cells[:, 2:]], axis=1)
    _, first = np.unique(turned, axis=0, return_index=True)
    first.sort()
    return cells[first], lengths[first], len(cells) - len(first)


def _groups(points: Array, distance: float) -> NDArray[np.int64]:
    """For each point the first point that lies within a distance of it, or is reached in a chain of such steps."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n = len(points)
    rows = np.arange(n)
    starts = []
    origin = points.min(axis=0)
    # two points that are closer than the distance share a square of twice that size in one of four lattices, half a square apart
    for offset in ((0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)):
        square = np.floor((points - origin) / (2 * distance) + np.array(offset))
        _, first, inverse = np.unique(square, axis=0, return_index=True, return_inverse=True)
        starts.append(first[inverse.ravel()])
    graph = coo_array((np.ones(4 * n, dtype=bool), (np.tile(rows, 4), np.concatenate(starts))), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    _, first = np.unique(label, return_index=True)
    result: NDArray[np.int64] = first[label]
    return result
