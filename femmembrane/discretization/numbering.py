"""A meridian cut into elements: what holds its ends, what closes its volume, and how its unknowns are numbered."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import skfem
from numpy.typing import ArrayLike, NDArray
from skfem.quadrature import get_quadrature

from ..errors import InputError
from ..threads import cached_property
from .elements import line_element, lobatto, meridian_order
from .lift import lift_of
from .meridian import LEAST_LENGTH, Array, Meridian, extent, side
from .supports import as_support, floats, free_rotations

#: displacement along the axis, over the size of a membrane under tension, that is told from none
_SMALL = 1e-5


class Numbering:
    """A meridian of elements of one degree: what holds it, where its quadrature points are, and how its unknowns are numbered.

    A membrane that nothing holds along the axis is held there at one node, ``pin``: a rigid motion costs no energy, and would leave the
    equations without a single solution. The forces of that support are zero at an equilibrium.

    Parameters
    ----------
    mesh : Meridian
    degree : int
    quadrature : int, optional
        Polynomial degree integrated exactly; default 2 degree + 1. With 0 the points are both ends of each element: there a state is looked
        at, and nothing is integrated well.
    anchored : frozenset of {"along", "shift", "tilt"}
        Rigid motions that something outside, such as a magnetic source, sees: along the axis, across it, and about a diameter. They are
        not free, and nothing is pinned for them.
    ends : tuple of float
        Places along the meridian at which elements end beside the breakpoints of the mesh: where the sheet has a jump.

    prestretch : float
        How far the held ends are carried from where they rest, see :mod:`.lift`.

    Attributes
    ----------
    lift : Lift or None
        The displacement that carries the held ends to their places; the unknowns are what there is beside it.
    strained : bool
        Whether the places of the ends strain the membrane, so that it is under tension, or compressed, without any load.
    breaks : list of int
        The ends of elements at which ``ends`` are, where slopes may jump.
    closed : bool
        Whether the last node is the first one.
    size : float
        Largest radius of the meridian, or its height if that is larger.
    side : {1, -1}
        Whether the inside of the membrane is on the right of the meridian or on its left (:func:`.meridian.side`).
    lids : bool
        Whether flat lids across the ends close the volume; else every end is a pole or in the plane Z = 0, which closes it.
    wall : (ndarray, ndarray) or None
        Where an end slides along a wall: a function of the meridian, and its slope along the reference element, that is the squared
        radius of the wall at such an end and zero at others. The volume then has the further term pi [wall w] of the ends.
    on_axis : ndarray of bool, shape (2,)
        Whether each end is on the axis.
    spreads : bool
        Whether an end off the axis can move in its plane.
    free_ends : list of {0, -1}
        The ends that nothing holds, the first or the last.
    axis_nodes : list of int
        Nodes, counted along the meridian, that are on the axis or the rim of a rigid disc across it.
    hubs : list of {0, -1}
        The ends that are rims of rigid discs, the first or the last.
    edges : list of {0, -1}
        The ends off the axis.
    nodes : ndarray of int, shape (degree n_elements + 1,)
        Number of each node in the order of the unknowns, along the meridian.
    loose : bool
        Whether something outside alone holds the membrane along the axis.
    pin : int or None
        Node held along the axis, counted along the meridian: ``widest`` or none.
    widest : int
        Of the ends of elements that of the largest radius, and of these the nearest to the middle.
    rotations : (bool, bool)
        Whether a shift across the axis, and a tilt, are rigid motions.
    points : ndarray, shape (n_quadrature,)
        Quadrature points of the reference element.
    n_elements, n_quadrature, n_free, half_bandwidth : int
    R, R_x, Z, Z_x : ndarray, shape (n_quadrature, n_elements)
        Reference meridian at the quadrature points; _x is the derivative along the reference element [0, 1].
    radial : bool
        Whether the parameter of the meridian is its radius.
    lengths : ndarray, shape (n_elements,)
        Arc length of each element at rest.
    unit : float
        Length by which everything of this membrane is measured, so that no answer hangs on the unit of its lengths: its largest radius,
        or its arc length where that is smaller, of a closed curve its arc length over 2 pi. It is 1 for a disc, a sphere, and a torus.
    slenderness : float
        Size of the meridian over ``unit``, at least 1: what digits positions lose beside displacements.
    weights : ndarray, shape (n_quadrature, n_elements)
        2 pi times the quadrature weight on the reference element.
    """

    def __init__(
        self,
        mesh: Meridian,
        degree: int,
        quadrature: int | None = None,
        anchored: frozenset[str] = frozenset(),
        ends: tuple[float, ...] = (),
        prestretch: float = 1.0,
    ) -> None:
        self.mesh, self.degree, self.anchored, self.side = mesh, degree, anchored, side(mesh)
        self.ends: Array = with_ends(mesh.breakpoints(), ends)
        self.breaks: list[int] = [int(k) for k in np.flatnonzero(np.isin(self.ends[1:-1], ends)) + 1] if ends else []
        self.sizes: Array = np.diff(self.ends)
        line = skfem.MeshLine(self.ends)
        element = line_element(degree)
        local, n_nodes = meridian_order(line, element)
        points, weights = _at_ends() if quadrature == 0 else _quadrature(degree, quadrature or 2 * degree + 1)
        self.n_elements, self.n_quadrature = line.nelements, points.shape[1]
        self.points: Array = points[0]
        self._quadrature: Array = weights
        self.lift = lift_of(mesh, prestretch)
        self.strained = self.lift is not None and not self.lift.rigid
        self._place(self.ends, line)
        self.radial = bool((self.s == self.R).all())

        span = float(self.lengths.sum()) / (1 if mesh.supports() else 2 * np.pi)
        self._support(n_nodes)
        self.unit = min(float(mesh.position(self.ends)[0].max()), span)
        if self.strained:  # by the larger of what it is at rest and what it is drawn out to
            drawn = float(weights @ np.hypot(self.lifted[1], self.lifted[3]) @ np.ones(self.n_elements))
            self.unit = max(self.unit, min(float(self._lifted_ends[0].max()), drawn))
        self.slenderness = max(1.0, extent(*self._lifted_ends) / self.unit)
        self._number(self.nodes[local])

    def _place(self, ends: Array, line: skfem.MeshLine | None = None) -> None:
        """Put the ends of elements at places along the meridian."""
        mesh, self.ends, self.sizes = self.mesh, ends, np.diff(ends)
        mapping = (line or skfem.MeshLine(ends)).mapping()
        self.s: Array = np.ascontiguousarray(mapping.F(self.points[None])[0].T)
        self.R, self.Z = (np.ascontiguousarray(c) for c in mesh.position(self.s))
        self.R_x, self.Z_x = (np.ascontiguousarray(c * self.sizes) for c in mesh.tangent(self.s))
        self.lengths: Array = self._quadrature @ np.hypot(self.R_x, self.Z_x)
        self.weights: Array = np.repeat(2 * np.pi * self._quadrature[:, None], self.n_elements, axis=1)

    def _support(self, n_nodes: int) -> None:
        """Find what holds the ends, what closes the volume there, and how rigid motions are kept out."""
        self.supports = tuple(as_support(held) for held in self.mesh.supports())
        self.closed = not self.supports
        R, Z = self.mesh.position(self.ends[[0, -1]])
        size = self.size = extent(*self.mesh.position(self.ends))
        self.on_axis = on_axis = np.abs(R) <= LEAST_LENGTH * size
        self.axis_nodes = [] if self.closed else [k * (n_nodes - 1) for k in (0, 1) if on_axis[k] or self.supports[k].rigid]
        self.hubs = [-k for k, support in enumerate(self.supports) if support.rigid]
        self.edges = [-k for k, _ in enumerate(self.supports) if not on_axis[k]]
        self.nodes: NDArray[np.int64] = _folded(n_nodes) if self.closed else np.arange(n_nodes)
        self.n_nodes = n_nodes - int(self.closed)
        adrift = floats(self.supports)
        if self.lift is not None:
            Z = Z + self.lift.at(self.mesh, self.ends[[0, -1]])[2]
        level = np.abs(Z) <= LEAST_LENGTH * size
        in_plane = [pole or ("w" in end.held and at_zero) for pole, end, at_zero in zip(on_axis, self.supports, level, strict=False)]
        self.loose = adrift and "along" in self.anchored
        self.lids = adrift or not all(in_plane)
        shift, tilt = free_rotations(self.supports, np.where(on_axis, 0.0, R), Z)
        self.rotations = (shift and "shift" not in self.anchored, tilt and "tilt" not in self.anchored)
        radius = self.mesh.position(self.ends)[0]  # coefficients of nodes inside an element need not be values
        if not radius.max() > 0:
            raise InputError("mesh.elements", self.n_elements, "a meridian from pole to pole needs 2 or more elements")
        middle = np.abs(np.arange(radius.size) - (radius.size - 1) / 2)
        self.widest = self.degree * int(np.lexsort((middle, -np.round(radius / radius.max(), 9)))[0])
        self.pin = self.widest if adrift and not self.loose else None
        off_axis = [end for end, pole in zip(self.supports, on_axis, strict=False) if not pole]
        self.spreads = any("u" not in end.held for end in off_axis)
        walls = [(R[k] if end.radius is None else end.radius) ** 2 if end.wall else 0.0 for k, end in enumerate(self.supports)]
        self.wall = self.between(walls) if any(walls) else None
        self.free_ends = [-k for k, end in enumerate(self.supports) if not end.held]

    @cached_property
    def units(self) -> dict[str, float]:
        """Natural units of pressures, volumes and heights of this membrane, in the units of R0."""
        return {"pressure": 1 / self.unit, "volume": self.unit**3, "center_height": self.unit}

    def between(self, at_ends: list[float]) -> tuple[Array, Array]:
        """A linear function of the meridian and its slope along the reference element, from values at its ends."""
        slope = (at_ends[1] - at_ends[0]) / (self.ends[-1] - self.ends[0])
        return at_ends[0] + slope * (self.s - self.ends[0]), np.broadcast_to(slope * self.sizes, self.s.shape)

    def _number(self, local: NDArray[np.int64]) -> None:
        free = np.ones((self.n_nodes, 2), dtype=bool)
        for node, support in zip(self.nodes[[0, -1]], self.supports, strict=False):
            free[node] &= ["u" not in support.held, "w" not in support.held]
        if self.pin is not None:
            free[self.nodes[self.pin], 1] = False
        self.n_free = int(free.sum())
        # one spare slot past the end stands for everything that is held at zero
        numbers: NDArray[np.int64] = np.full((self.n_nodes, 2), self.n_free, dtype=np.int64)
        numbers[free] = np.arange(self.n_free)
        self.numbers = numbers
        self.gather = np.concatenate([numbers[local, 0], numbers[local, 1]])
        self.half_bandwidth = band_of(self.gather, self.n_free) if self.closed else min(2 * self.degree + 1, max(self.n_free - 1, 0))
        self.fields = tuple(_as_slice(np.sort(column[column < self.n_free])) for column in numbers.T)
        self.pole = int(numbers[self.nodes[0], 1])
        self.first_height = float(self._lifted_ends[1, 0])

    @property
    def notes(self) -> tuple[str, ...]:
        """In words, what is done about motions of the membrane as a whole that the supports leave."""
        R, Z = (round(float(c[0]), 9) + 0.0 for c in self.mesh.position(self.ends[[self.widest // self.degree]]))
        where = f"the circle r = {R:.4g}, z = {Z:.4g}"
        notes = []
        if self.loose:
            notes.append("nothing but the sources holds the membrane along the axis")
        if self.pin is not None:
            notes.append(f"nothing holds the membrane along the axis: {where} is kept at its height, without any force")
        if any(self.rotations):
            moves = " and ".join(name for name, free in zip(("shifts", "tilts"), self.rotations, strict=True) if free)
            notes.append(f"{moves} across the axis cost no energy: they are left out of verdicts on n = 1")
        return tuple(notes)

    @cached_property
    def _end_positions(self) -> Array:
        return np.stack(self.mesh.position(self.ends))

    @cached_property
    def _lifted_ends(self) -> Array:
        """Where the ends of the elements are while all unknowns are zero."""
        return self._end_positions if self.lift is None else self._end_positions + self.lift.at(self.mesh, self.ends)[::2]

    @cached_property
    def lift_size(self) -> tuple[float, float]:
        """Largest displacements across and along the axis that the places of the ends make of themselves, without any unknown.

        Tension holds the membrane across its plane, where a displacement passes through zero as any other number: one that is smaller than
        a small part of the membrane has no size of its own.
        """
        if self.lift is None or not self.strained:
            return 0.0, 0.0
        u, _, w, _ = self.lift.at(self.mesh, self.ends)
        return float(np.abs(u).max()), max(float(np.abs(w).max()), _SMALL * self.unit)

    @cached_property
    def lift_mean(self) -> float:
        """Root mean square over the reference area, in units of the membrane's own size, of the displacements in :attr:`lift_size`."""
        if self.lift is None or not self.strained:
            return 0.0
        u, _, w, _ = self.lift.at(self.mesh, self.s)
        return float(np.sqrt((self.area_weights * (u**2 + w**2)).sum() / self.reference_area)) / self.unit

    @cached_property
    def lifted(self) -> tuple[Array, Array, Array, Array]:
        """(rho, rho_x, eta, eta_x) at the quadrature points while all unknowns are zero."""
        if self.lift is None:
            return self.R, self.R_x, self.Z, self.Z_x
        u, u_s, w, w_s = self.lift.at(self.mesh, self.s)
        return self.R + u, self.R_x + u_s * self.sizes, self.Z + w, self.Z_x + w_s * self.sizes

    @cached_property
    def _axis(self) -> list[tuple[int, float]]:
        """Unknown and height at rest of each of :attr:`axis_nodes`."""
        s = self.node_parameters()[self.axis_nodes]
        heights = self.mesh.position(s)[1] + (0.0 if self.lift is None else self.lift.at(self.mesh, s)[2])
        return list(zip(self.numbers[self.nodes[self.axis_nodes], 1].tolist(), heights.tolist(), strict=True))

    @cached_property
    def area_weights(self) -> Array:
        """Weights of the integral over the reference area, with the 2 pi, shape (n_quadrature, n_elements)."""
        area: Array = self.weights * self.R * np.hypot(self.R_x, self.Z_x)
        return area

    @cached_property
    def reference_area(self) -> float:
        """Area of the membrane at rest, over R0^2."""
        return float(self.area_weights.sum())

    @cached_property
    def reference_volume(self) -> float:
        """Volume that the membrane encloses while all unknowns are zero, over R0^3."""
        return self.side * float((self.weights * self._volume_density).sum()) + 0.0

    @cached_property
    def volume_round_off(self) -> float:
        """Round-off of volumes next to the volume at rest, which is a sum of larger parts."""
        return 4 * float(np.finfo(float).eps * (self.weights * np.abs(self._volume_density)).sum())

    @property
    def _volume_density(self) -> Array:
        rho, rho_x, eta, eta_x = self.lifted
        return -(rho**2) * eta_x / 2 if self.lids else rho * rho_x * eta

    @cached_property
    def center(self) -> float:
        """Height of the middle between the first and the last end."""
        return float(self._end_positions[1, [0, -1]].mean())

    @cached_property
    def spins(self) -> bool:
        """Whether the reference surface is a whole sphere: turned about any diameter it is the same."""
        if self.closed or not self.on_axis.all():
            return False
        height = self.Z - self.center
        radius = np.hypot(self.R, height)
        off = np.abs(radius / radius.max() - 1).max()
        across = np.abs(self.R * self.R_x + height * self.Z_x) / (radius * np.hypot(self.R_x, self.Z_x))
        return bool(max(off, across.max()) < 1e-9)

    def interpolation_points(self) -> Array:
        """Parameters s of degree + 1 points in each element, ends included, shape (degree + 1, n_elements)."""
        points = self.ends[:-1] + lobatto(self.degree)[:, None] * self.sizes
        points[0], points[-1] = self.ends[:-1], self.ends[1:]  # neighbours share their end, and the last end belongs to the meridian
        return points

    def node_parameters(self) -> Array:
        """Parameters s of the nodes along the meridian: element ends and degree - 1 points between, shape (degree n_elements + 1,)."""
        points = self.interpolation_points()
        return np.append(points[:-1].T.ravel(), points[-1, -1])

    def locate(self, s: ArrayLike) -> tuple[NDArray[np.int64], Array]:
        """Element and reference coordinate of parameters s."""
        s = np.asarray(s, dtype=float)
        element = np.clip(np.searchsorted(self.ends, s, side="right") - 1, 0, self.n_elements - 1)
        return element, (s - self.ends[element]) / self.sizes[element]


def with_ends(breakpoints: Array, further: tuple[float, ...]) -> Array:
    """Element ends with further ones between them; one that is an end already, to round-off, makes no element of its own."""
    first, last = breakpoints[0], breakpoints[-1]
    near = LEAST_LENGTH * (last - first) + 1e-9 * np.diff(breakpoints).min()
    new = [s for s in sorted(set(further)) if first < s < last and np.abs(breakpoints - s).min() > near]
    return np.sort(np.append(breakpoints, new)) if new else breakpoints


def band_of(gather: NDArray[np.int64], n_free: int) -> int:
    """Half bandwidth of the unknowns of the elements, one column each. The number ``n_free`` stands for no unknown."""
    inside = gather < n_free
    low, high = np.where(inside, gather, n_free).min(axis=0), np.where(inside, gather, -1).max(axis=0)
    return int((high - low).max(initial=0))


@lru_cache(maxsize=64)
def _quadrature(degree: int, exact: int) -> tuple[Array, Array]:
    """Points and weights on the reference element, found once."""
    points, weights = get_quadrature(line_element(degree), exact)
    points.flags.writeable = weights.flags.writeable = False
    return points, weights


def _at_ends() -> tuple[Array, Array]:
    """Both ends of the reference element, and weights."""
    return np.array([[0.0, 1.0]]), np.array([0.5, 0.5])


def _folded(n_nodes: int) -> NDArray[np.int64]:
    """Numbers of the nodes of a closed curve, the last one the first again, so that neighbours differ by two at most."""
    k = np.arange(n_nodes)
    n = n_nodes - 1
    return np.where(2 * k <= n, np.maximum(2 * k - 1, 0), 2 * (n - k))


def _as_slice(index: NDArray[np.int64]) -> slice | NDArray[np.int64]:
    """The same selection as a slice where the numbers are evenly spaced: a view instead of a copy."""
    if index.size > 2 and (np.diff(index) == index[1] - index[0]).all():
        return slice(int(index[0]), int(index[-1]) + 1, int(index[1] - index[0]))
    return index
