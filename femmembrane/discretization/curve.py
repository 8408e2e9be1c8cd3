"""Meridians through given points.

Cells between the points come in any order and direction; those of three points are arcs of parabolas. Points that agree to round-off are
one (:mod:`.merging`). What they make is one curve, put in an order of its own, so that the order in which they come plays no part:

* a closed curve, and one with a pole at both ends, starts at its top and runs so that the enclosed volume is on its right;
* with one pole it starts there;
* else it starts at the end nearer to the axis, or, where its ends differ more in height than in radius, at the upper one.

Which side is inside follows from the shape and not from this order (:func:`.meridian.side`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..checks import store, switch
from ..errors import InputError
from .merging import mended, merged
from .meridian import (
    LEAST_LENGTH,
    ROUND_OFF,
    Array,
    Asked,
    check_accuracy,
    check_elements,
    checked_ends,
    extent,
    halved,
    is_open,
    refuse_open,
)
from .supports import POLE, Held, Support, checked_end, support_of

#: size of a curve beyond which squares and cubes of it are no numbers any more, and below the inverse of which they are zero
_LARGEST = 1e60
#: angle in radians between cells that are one curve for the eye and for stresses
_SMOOTH = 1e-3
#: points and weights for the length of a curved cell
_GAUSS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True, kw_only=True)
class Curve:
    """A meridian through given points, one cell after the other. Their unit of length is R0.

    Parameters
    ----------
    points : sequence of (R, Z)
        The ends of the cells: n + 1 points for n straight cells. Between the ends of a curved cell stands the point inside it: 2 n + 1
        points for n cells. A closed curve ends with the point with which it starts. The module says in which direction points are kept, and
        from which point a closed curve starts.
    curved : bool
        Whether cells have a point inside and are arcs of parabolas. Otherwise they are straight.
    divisions : int
        Number of elements that a cell is divided into.
    first, last : str or mapping
        How the ends are held and, if not where they rest, where, see :mod:`.supports`; an end on the axis is a pole, and a closed curve
        has none.
    repaired : sequence of str
        In words, what was done about points that agree to round-off only. What is done here is added; no number depends on it.

    ends : sequence of float, optional
        Ends of the elements along the curve, in place of ``divisions``; every end of a cell is among them.
    accuracy : float, optional
        Relative accuracy, 1e-12 to 0.1, for which a verb is to choose elements and degree; in place of ``divisions``.
    estimated : float, optional
        The relative error that was estimated when the mesh was chosen. Such a mesh has ``accuracy`` and ``ends`` as well.

    Raises
    ------
    InputError
        For points that are no meridian, named by the number of the cell.
    """

    points: tuple[tuple[float, float], ...]
    curved: bool = False
    divisions: int = 1
    first: Held = "clamped"
    last: Held = "clamped"
    repaired: tuple[str, ...] = field(default=(), compare=False)
    ends: tuple[float, ...] | None = None
    accuracy: Asked | None = None
    estimated: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", _points(self.points))
        object.__setattr__(self, "repaired", _remarks(self.repaired))
        store(self, curved=switch("mesh.curved", self.curved))
        try:
            object.__setattr__(self, "divisions", check_elements(self.divisions))
        except InputError as error:
            raise InputError("mesh.divisions", self.divisions, error.allowed) from None
        for name in ("first", "last"):
            store(self, **{name: checked_end(f"mesh.{name}", getattr(self, name))})
        size = extent(*np.array(self.points).T)
        if np.isfinite(size) and not 1 / _LARGEST <= size <= _LARGEST:
            raise InputError("mesh.points", f"a size of {size:.3g}", f"a size from {1 / _LARGEST:.0e} to {_LARGEST:.0e} is allowed")
        points, remarks = mended(np.array(self.points), 2 if self.curved else 1)
        object.__setattr__(self, "points", _tuples(points))
        object.__setattr__(self, "repaired", tuple(dict.fromkeys((*self.repaired, *remarks))))  # a file may say it already
        _check_curve(self)
        object.__setattr__(self, "points", _tuples(_directed(np.array(self.points), self.curved)))
        check_accuracy(self, "ends", given=self.divisions != 1)
        if self.ends is not None:
            object.__setattr__(self, "ends", self._checked_ends())

    def _checked_ends(self) -> tuple[float, ...]:
        if self.divisions != 1:
            raise InputError("mesh.divisions", self.divisions, "not allowed together with mesh.ends, which say all; leave one out")
        cells = self._cell_ends()
        ends = np.array(checked_ends("mesh.ends", self.ends, 0.0, float(cells[-1]), ("the first end", "the last end")))
        for cell in cells:
            k = int(np.abs(ends - cell).argmin())
            if abs(ends[k] - cell) > LEAST_LENGTH * cells[-1]:
                raise InputError("mesh.ends", float(ends[k]), f"the end of a cell at {cell:.9g} must be among them")
            ends[k] = cell
        return tuple(ends.tolist())

    @property
    def open(self) -> bool:
        """Whether the elements are still to be chosen."""
        return is_open(self)

    @property
    def shape(self) -> str:
        return "curve"

    @property
    def remarks(self) -> tuple[str, ...]:
        """What was done about the points, and what a polygon means for stresses."""
        turn = self._largest_turn()
        if self.curved or turn < _SMOOTH:
            return self.repaired
        polygon = f"a polygon of {self._n_cells} straight cells, which turns by up to {math.degrees(turn):.2g} degrees where they meet"
        advice = "stresses across the meridian jump there; cells with a point inside are arcs, and smoother"
        return (*self.repaired, f"{polygon}: {advice}")

    def _largest_turn(self) -> float:
        """The largest angle between neighbouring cells, for straight ones."""
        a, _, b = self._nodes
        along = (b - a) @ np.array([1.0, 1.0j])
        after = np.append(along[1:], along[:1] if self.closed else along[-1:])
        return float(np.abs(np.angle(after / along)).max())

    @property
    def closed(self) -> bool:
        """Whether the last point is the first one."""
        return self.points[0] == self.points[-1]

    @property
    def elements(self) -> int:
        return self.divisions * self._n_cells if self.ends is None else len(self.ends) - 1

    @property
    def _n_cells(self) -> int:
        return (len(self.points) - 1) // (2 if self.curved else 1)

    @property
    def _nodes(self) -> tuple[Array, Array, Array]:
        """Start, point inside (half-way in a straight cell) and end of each cell, each of shape (cells, 2)."""
        points = np.array(self.points)
        if self.curved:
            return points[:-1:2], points[1::2], points[2::2]
        return points[:-1], (points[:-1] + points[1:]) / 2, points[1:]

    def _cell_ends(self) -> Array:
        """Arc length of the curve at the ends of its cells."""
        a, m, b = self._nodes
        if not self.curved:
            return np.concatenate([[0.0], np.cumsum(np.hypot(*(b - a).T))])
        t = (_GAUSS[0] + 1)[:, None, None] / 2
        slope = (4 * t - 3) * a + (4 - 8 * t) * m + (4 * t - 1) * b
        return np.concatenate([[0.0], np.cumsum(_GAUSS[1] @ np.hypot(slope[..., 0], slope[..., 1]) / 2)])

    def corners(self) -> Array:
        """Places at which elements must end: the ends of the cells."""
        return self._cell_ends()

    def breakpoints(self) -> Array:
        if self.ends is not None:
            return np.array(self.ends)
        ends = self._cell_ends()
        return np.interp(np.arange(self.elements + 1) / self.divisions, np.arange(ends.size), ends)

    def _locate(self, s: Array) -> tuple[NDArray[np.int64], Array, Array]:
        ends = self._cell_ends()
        cell = np.clip(np.searchsorted(ends, s, side="right") - 1, 0, ends.size - 2)
        size = np.diff(ends)[cell]
        return cell, (s - ends[cell]) / size, size

    def position(self, s: Array) -> tuple[Array, Array]:
        s = np.asarray(s, dtype=float)
        cell, t, _ = self._locate(s)
        a, m, b = (p[cell] for p in self._nodes)
        t = t[..., None]
        # written from the nearer end, so that both ends are met exactly
        bulge = 4 * (m - (a + b) / 2) if self.curved else 0.0
        point = np.where(t < 0.5, a + t * (b - a), b + (t - 1) * (b - a)) + t * (1 - t) * bulge
        return point[..., 0], point[..., 1]

    def tangent(self, s: Array) -> tuple[Array, Array]:
        s = np.asarray(s, dtype=float)
        cell, t, size = self._locate(s)
        a, m, b = (p[cell] for p in self._nodes)
        slope = b - a + (4 * (1 - 2 * t[..., None]) * (m - (a + b) / 2) if self.curved else 0.0)
        return slope[..., 0] / size, slope[..., 1] / size

    def on_ends(self, ends: Sequence[float] | Array, accuracy: Asked | None = None, estimated: float | None = None) -> Self:
        return replace(self, divisions=1, ends=tuple(float(s) for s in ends), accuracy=accuracy, estimated=estimated)

    def refined(self) -> Self:
        """The same curve with every element divided in two.

        Raises
        ------
        InputError
            For a mesh whose elements are still to be chosen.
        """
        refuse_open(self)
        if self.ends is None:
            return replace(self, divisions=2 * self.divisions)
        return self.on_ends(halved(self.breakpoints()))

    def with_elements(self, elements: int) -> Self:
        """The same curve with another number of elements, a multiple of that of its cells.

        Raises
        ------
        InputError
        """
        if elements % self._n_cells:
            raise InputError("elements", elements, f"a multiple of the {self._n_cells} cells of the curve is allowed")
        return replace(self, divisions=elements // self._n_cells, ends=None, accuracy=None, estimated=None)

    def supports(self) -> tuple[Support, Support] | tuple[()]:
        if self.closed:
            return ()
        first, last = (
            POLE if point[0] == 0 else support_of(end)
            for point, end in zip((self.points[0], self.points[-1]), (self.first, self.last), strict=True)
        )
        return first, last


def meridian_from_points(
    points: ArrayLike,
    cells: ArrayLike | None = None,
    *,
    divisions: int = 1,
    first: Held = "clamped",
    last: Held = "clamped",
    accuracy: Asked | None = None,
) -> Curve:
    """A meridian from points and the cells between them, brought into the order that the module describes.

    Parameters
    ----------
    points : array_like, shape (n, 2)
        (R, Z) in units of R0.
    cells : array_like of int, shape (m, 2) or (m, 3), optional
        Positions of the two ends of each cell, and of the point inside. Default: straight cells through the points, in their order.
    divisions, first, last, accuracy
        As for :class:`Curve`.

    Returns
    -------
    Curve

    Raises
    ------
    InputError
        As for :class:`Curve`, and for cells that are no single curve.
    """
    array = _array(points)
    if cells is None:
        return Curve(points=_tuples(array), divisions=divisions, first=first, last=last, accuracy=accuracy)
    return ordered_curve(array, np.asarray(cells), divisions=divisions, first=first, last=last, accuracy=accuracy)


def _array(points: Any) -> Array:
    try:
        array = np.asarray(points, dtype=float)
    except (TypeError, ValueError, OverflowError):
        array = np.zeros(0)
    if array.ndim != 2 or array.shape[1] != 2 or len(array) < 2:
        raise InputError("mesh.points", points, "two or more points (R, Z) are allowed")
    return array


def _points(points: Any) -> tuple[tuple[float, float], ...]:
    if (
        isinstance(points, tuple)
        and all(isinstance(p, tuple) and len(p) == 2 and all(type(c) is float for c in p) for p in points)
        and len(points) > 1
    ):
        return points
    rows = _array(points)
    if any(isinstance(c, (bool, str)) or not isinstance(c, Real) for point in points for c in point):
        raise InputError("mesh.points", points, "points (R, Z) of two numbers are allowed")
    return tuple((float(R), float(Z)) for R, Z in rows.tolist())


def _remarks(remarks: Any) -> tuple[str, ...]:
    if isinstance(remarks, str) or not isinstance(remarks, Sequence) or not all(isinstance(text, str) for text in remarks):
        raise InputError("mesh.repaired", remarks, "a list of texts is allowed, as a program wrote it; leave it out")
    return tuple(remarks)


def _refuse(cell: int, what: str) -> InputError:
    return InputError("mesh.points", f"cell {cell}", what)


def _check_curve(curve: Curve) -> None:
    """Raise InputError unless points in order are a meridian."""
    points, step = np.array(curve.points), 2 if curve.curved else 1
    if curve.curved and len(points) % 2 == 0:
        raise InputError("mesh.points", f"{len(points)} points", "an odd number of points is allowed for curved cells")
    size = extent(*points.T)
    for k, (R, Z) in enumerate(points):
        if not (math.isfinite(R) and math.isfinite(Z)):
            cell = min(k // step, curve._n_cells - 1)
            raise _refuse(cell, f"cell {cell} has the point ({R:g}, {Z:g}); finite numbers are allowed")
    for k, (R, Z) in enumerate(points):
        cell = min(k // step, curve._n_cells - 1)
        if R < 0:
            raise _refuse(cell, f"cell {cell} has the point ({R:g}, {Z:g}); radii >= 0 are allowed")
        inside = 0 < k < len(points) - 1
        if (inside or curve.closed) and LEAST_LENGTH * size >= R:
            raise _refuse(cell, f"cell {cell} touches the axis at ({R:g}, {Z:g}) inside the curve; only ends may (poles)")
        if not inside and 0 < R <= LEAST_LENGTH * size:
            raise _refuse(cell, f"cell {cell} ends at R = {R:g}; 0 is allowed (a pole), or a radius that is no round-off")
    if curve.closed and curve._n_cells < 3:
        raise InputError("mesh.points", f"{curve._n_cells} cells", "three or more cells are allowed in a closed curve")
    a, m, b = curve._nodes
    for cell in range(curve._n_cells):
        length = float(np.hypot(*(b[cell] - a[cell])))
        if not length > LEAST_LENGTH * size:
            raise _refuse(cell, f"cell {cell} has no length, at ({a[cell][0]:g}, {a[cell][1]:g})")
        # the slope of a parabola must not turn back: its ends and its middle point say all
        off = float(np.dot(m[cell] - (a[cell] + b[cell]) / 2, b[cell] - a[cell])) / length**2
        if abs(off) >= 0.25:
            raise _refuse(cell, f"cell {cell} has its inner point too near to one end: it runs back on itself")
    keys = {point: k for k, point in enumerate(curve.points[: -1 if curve.closed else None])}
    if len(keys) < len(curve.points) - int(curve.closed):
        k = next(k for k, point in enumerate(curve.points) if keys[point] != k)
        raise _refuse(min(k // step, curve._n_cells - 1), f"the curve meets itself at ({curve.points[k][0]:g}, {curve.points[k][1]:g})")


def ordered_curve(points: Array, cells: NDArray[Any], **rest: Any) -> Curve:
    """The curve of points and cells in any order."""
    if (
        cells.ndim != 2
        or cells.shape[1] not in (2, 3)
        or not len(cells)
        or cells.dtype.kind not in "iu"
        or cells.min() < 0
        or cells.max() >= len(points)
    ):
        raise InputError("mesh.points", "cells", "cells of two or three existing points each are allowed")
    cells, remarks = merged(points, cells)
    chain = _chain(cells.tolist())
    ordered = points[[place for cell, forward in chain for place in _run(cells[cell].tolist(), forward)[:-1]]]
    end = points[_run(cells[chain[-1][0]].tolist(), chain[-1][1])[-1]]
    ordered = np.concatenate([ordered, end[None]])
    return Curve(points=_tuples(ordered), curved=cells.shape[1] == 3, repaired=remarks, **rest)


def _tuples(points: Array) -> tuple[tuple[float, float], ...]:
    return tuple((R, Z) for R, Z in points.tolist())


def _run(cell: list[int], forward: bool) -> list[int]:
    """Points of a cell along the curve."""
    a, b, *inside = cell
    return [a, *inside, b] if forward else [b, *inside, a]


def _chain(cells: Sequence[Sequence[int]]) -> list[tuple[int, bool]]:
    """Cells in the order of the curve, and whether each runs along it; InputError for what is not one curve."""
    at: dict[int, list[int]] = {}
    for k, cell in enumerate(cells):
        if cell[0] == cell[1]:
            raise _refuse(k, f"cell {k} has no length: it starts and ends at the same point")
        for node in cell[:2]:
            at.setdefault(node, []).append(k)
    branch = next(((node, owners) for node, owners in at.items() if len(owners) > 2), None)
    if branch is not None:
        raise _refuse(branch[1][2], f"cells {', '.join(map(str, branch[1]))} meet in one point: a meridian has no branches")
    ends = [node for node, owners in at.items() if len(owners) == 1]
    node = ends[0] if ends else cells[0][0]
    chain: list[tuple[int, bool]] = []
    used: set[int] = set()
    while following := [k for k in at[node] if k not in used]:
        k = following[0]
        forward = cells[k][0] == node
        chain.append((k, forward))
        used.add(k)
        node = cells[k][1 if forward else 0]
    if len(used) < len(cells):
        left = min(set(range(len(cells))) - used)
        raise _refuse(left, f"cell {left} is not joined to cell {chain[0][0]}: one curve is allowed")
    return chain


def _directed(points: Array, curved: bool) -> Array:
    """Points in the order that the module describes."""
    step = 2 if curved else 1
    if (points[0] == points[-1]).all():
        if _volume(points) < 0:
            points = points[::-1]
        ends = points[:-1:step]
        highest = ends[:, 1] >= ends[:, 1].max() - ROUND_OFF * extent(*points.T)  # of a flat top the outer end, whatever round-off says
        top = int(np.argmax(np.where(highest, ends[:, 0], -np.inf))) * step
        return np.concatenate([points[top:-1], points[: top + 1]])
    poles = points[[0, -1], 0] == 0
    (R0, Z0), (R1, Z1) = points[[0, -1]]
    if poles.all():
        backwards = _volume(points) < 0
    elif poles.any():
        backwards = bool(poles[1])
    elif abs(R1 - R0) >= (1 - ROUND_OFF) * abs(Z1 - Z0):  # so that a cone of 45 degrees is one whatever round-off says
        backwards = R1 < R0
    else:
        backwards = Z1 > Z0
    return points[::-1] if backwards else points


def _volume(points: Array) -> float:
    """Enclosed volume over pi of the polygon through the points, positive if it lies on the right of the curve.

    The square of the largest radius is taken off where the curve is closed: it adds nothing but round-off.
    """
    R, Z = points.T
    square = (R[1:] ** 2 + R[1:] * R[:-1] + R[:-1] ** 2) / 3
    return float(-np.sum((square - (R.max() ** 2 if (points[0] == points[-1]).all() else 0.0)) * np.diff(Z)))
