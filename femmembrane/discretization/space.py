"""Finite-element space on a meridian, as plain arrays.

scikit-fem supplies elements, degrees of freedom, quadrature and the map from the reference element; what leaves this module is NumPy
only. Unknowns are the coefficients of the displacement (u, w), numbered along the meridian and interleaved, so that every matrix of the
problem is banded with half bandwidth 2 degree + 1; those of a closed curve are numbered as if it were folded flat, which doubles the
bandwidth. Points are numbered quadrature point first, element second: with arrays of shape
(rows * n_quadrature, n_elements) gathering, evaluating and assembling are one matrix product each.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations_with_replacement
from typing import Any, cast

import numpy as np
import skfem
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from skfem.element import ElementLineP1, ElementLineP2, ElementLinePp
from skfem.quadrature import get_quadrature

from ..errors import InputError
from ..physics.magnetics import acting_sources
from ..threads import cached_property
from .meridian import LEAST_LENGTH, Array, Meridian, extent, side
from .supports import as_support, floats, free_rotations

#: pairs (i, j) of the local variables (u, u_x, w, w_x) in the order of Hessian entries
HESSIAN_PAIRS: tuple[tuple[int, int], ...] = tuple(combinations_with_replacement(range(4), 2))

#: deviation of a mesh from its mirror image, relative to its size, that counts as none
_MIRRORED = 1e-6
#: highest degree at which slopes are recovered from the Gauss points
_RECOVERED = 3


class Space:
    """Displacements (u, w) of one degree on one meridian.

    A membrane that nothing holds along the axis is held there at one node, ``pin``: a rigid motion costs no energy, and would leave the
    equations without a single solution. The forces of that support are zero at an equilibrium.

    Parameters
    ----------
    mesh : Meridian
    degree : int
    quadrature : int, optional
        Polynomial degree integrated exactly; default 2 degree + 1.
    anchored : frozenset of {"along", "shift", "tilt"}
        Rigid motions that something outside, such as a magnetic source, sees: along the axis, across it, and about a diameter. They are
        not free, and nothing is pinned for them.

    Attributes
    ----------
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
    highest : ndarray, shape (n_quadrature,)
        The Legendre polynomial of the highest degree that the quadrature points of an element tell apart, at these.
    slenderness : float
        Size of the meridian over ``unit``, at least 1: what digits positions lose beside displacements.
    weights : ndarray, shape (n_quadrature, n_elements)
        2 pi times the quadrature weight on the reference element.
    """

    def __init__(self, mesh: Meridian, degree: int, quadrature: int | None = None, anchored: frozenset[str] = frozenset()) -> None:
        self.mesh, self.degree, self.anchored, self.side = mesh, degree, anchored, side(mesh)
        self.ends: Array = mesh.breakpoints()
        self.sizes: Array = np.diff(self.ends)
        line = skfem.MeshLine(self.ends)
        element = _line_element(degree)
        local, n_nodes = _meridian_order(line, element)
        points, weights = get_quadrature(element, 2 * degree + 1 if quadrature is None else quadrature)
        self.n_elements, self.n_quadrature = line.nelements, points.shape[1]
        mapping = line.mapping()
        self.s: Array = np.ascontiguousarray(mapping.F(points)[0].T)
        self.R, self.Z = (np.ascontiguousarray(c) for c in mesh.position(self.s))
        self.R_x, self.Z_x = (np.ascontiguousarray(c * self.sizes) for c in mesh.tangent(self.s))
        self.radial = bool((self.s == self.R).all())
        self.lengths: Array = weights @ np.hypot(self.R_x, self.Z_x)
        self.weights: Array = np.repeat(2 * np.pi * weights[:, None], self.n_elements, axis=1)

        span = float(self.lengths.sum()) / (1 if mesh.supports() else 2 * np.pi)
        self._support(n_nodes)
        self.unit = min(float(mesh.position(self.ends)[0].max()), span)
        self.slenderness = max(1.0, extent(*mesh.position(self.ends)) / self.unit)
        self._number(self.nodes[local])
        self._tabulate(points)

    def _support(self, n_nodes: int) -> None:
        """What holds the ends, what closes the volume there, and what is done about rigid motions."""
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
        level = np.abs(Z) <= LEAST_LENGTH * size
        in_plane = [pole or ("w" in end.held and at_zero) for pole, end, at_zero in zip(on_axis, self.supports, level, strict=False)]
        self.loose = adrift and "along" in self.anchored
        self.lids = adrift or not all(in_plane)
        shift, tilt = free_rotations(self.supports, np.where(on_axis, 0.0, R), Z)
        self.rotations = (shift and "shift" not in self.anchored, tilt and "tilt" not in self.anchored)
        radius = self.mesh.position(self.ends)[0]  # coefficients of nodes inside an element may be no values there
        if not radius.max() > 0:
            raise InputError("mesh.elements", self.n_elements, "a meridian from pole to pole needs 2 or more elements")
        middle = np.abs(np.arange(radius.size) - (radius.size - 1) / 2)
        self.widest = self.degree * int(np.lexsort((middle, -np.round(radius / radius.max(), 9)))[0])
        self.pin = self.widest if adrift and not self.loose else None
        off_axis = [end for end, pole in zip(self.supports, on_axis, strict=False) if not pole]
        self.spreads = any("u" not in end.held for end in off_axis)
        walls = [R[k] ** 2 if end.wall else 0.0 for k, end in enumerate(self.supports)]
        self.wall = self.between(walls) if any(walls) else None
        self.free_ends = [-k for k, end in enumerate(self.supports) if not end.held]

    @property
    def units(self) -> dict[str, float]:
        """What pressures, volumes and heights of this membrane are measured by, in those of R0."""
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
        # one spare slot past the end stands for all that is held at zero
        numbers: NDArray[np.int64] = np.full((self.n_nodes, 2), self.n_free, dtype=np.int64)
        numbers[free] = np.arange(self.n_free)
        self.numbers = numbers
        self.gather = np.concatenate([numbers[local, 0], numbers[local, 1]])
        self.half_bandwidth = band_of(self.gather, self.n_free) if self.closed else min(2 * self.degree + 1, max(self.n_free - 1, 0))
        self.fields = tuple(_as_slice(np.sort(column[column < self.n_free])) for column in numbers.T)
        self.pole = int(numbers[self.nodes[0], 1])
        self.first_height = float(self.mesh.position(self.ends[:1])[1][0])

    def _tabulate(self, points: Array) -> None:
        value, slope = self.shape_functions(points[0])
        self.highest = np.polynomial.legendre.legval(2 * points[0] - 1, np.eye(self.n_quadrature)[-1])
        zero = np.zeros_like(value)
        blocks = [[value, zero], [slope, zero], [zero, value], [zero, slope]]
        self.table = np.block(blocks)
        self._magnitudes = np.abs(self.table)
        rows = self.table.reshape(4, self.n_quadrature, -1)
        outer = []
        for i, j in HESSIAN_PAIRS:
            product = np.einsum("qa,qb->abq", rows[i], rows[j])
            outer.append(product if i == j else product + product.transpose(1, 0, 2))
        n_local = rows.shape[2]
        self._hessian_table = np.ascontiguousarray(np.stack(outer, axis=2).reshape(n_local**2, -1))
        # position of each local entry in LAPACK band storage, column by column: A[i, j] at [2 kd + i - j, j]
        kd, depth = self.half_bandwidth, 3 * self.half_bandwidth + 1
        row, column = np.broadcast_arrays(self.gather[:, None, :], self.gather[None, :, :])
        spare = self.n_free * depth
        flat = np.where((row < self.n_free) & (column < self.n_free), column * depth + 2 * kd + row - column, spare)
        self._band_index = flat.reshape(n_local**2, -1).ravel()
        self._gather_flat = self.gather.ravel()
        self._gather_two = np.concatenate([self._gather_flat, self._gather_flat + self.n_free + 1])

    def shape_functions(self, xi: Array) -> tuple[Array, Array]:
        """Values and slopes of the shape functions at points xi of the reference element, each of shape (len(xi), degree + 1)."""
        element = _line_element(self.degree)  # a new one: ElementLinePp remembers its values by the number of points alone
        table = [element.lbasis(np.asarray(xi)[None, :], k) for k in _local_order(self.degree)]
        value = np.stack([t[0] for t in table], axis=1)
        slope = np.stack([t[1][0] for t in table], axis=1)
        return value, slope

    def center_height(self, x: Array) -> float:
        """Height of the first point of the meridian, the pole of a disc."""
        return float(self.first_height + (x[self.pole] if self.pole < self.n_free else 0.0))

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

    def end_position(self, x: Array, k: int) -> tuple[float, float]:
        """Deformed position (rho, eta) of the k-th end of elements, whose coefficients are its displacement."""
        k %= self.n_elements + 1
        u, w = (float(x[i]) if i < self.n_free else 0.0 for i in self.numbers[self.nodes[self.degree * k]])
        R, Z = self._end_positions[:, k]
        return float(R + u), float(Z + w)

    def axis_heights(self, x: Array) -> list[float]:
        """Heights of the nodes on the axis and of rigid discs across it."""
        return [height + (float(x[k]) if k < self.n_free else 0.0) for k, height in self._axis]

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

    @cached_property
    def _axis(self) -> list[tuple[int, float]]:
        """Unknown and height at rest of each of :attr:`axis_nodes`."""
        heights = self.mesh.position(self.node_parameters()[self.axis_nodes])[1]
        return list(zip(self.numbers[self.nodes[self.axis_nodes], 1].tolist(), heights.tolist(), strict=True))

    @cached_property
    def reference_volume(self) -> float:
        """Volume that the membrane encloses at rest, over R0^3."""
        return self.side * float((self.weights * self._volume_density).sum()) + 0.0

    @cached_property
    def volume_round_off(self) -> float:
        """What volumes next to that at rest are known to: round-off of the parts that it is the sum of."""
        return 4 * float(np.finfo(float).eps * (self.weights * np.abs(self._volume_density)).sum())

    @property
    def _volume_density(self) -> Array:
        return -(self.R**2) * self.Z_x / 2 if self.lids else self.R * self.R_x * self.Z

    def extend(self, x: Array) -> Array:
        """Free coefficients with the zero of the supports appended, so that ``extend(x)[numbers]`` covers all nodes."""
        extended = np.empty(self.n_free + 1)
        extended[:-1], extended[-1] = x, 0.0
        return extended

    def at_quadrature(self, x: Array) -> Array:
        """(u, u_x, w, w_x) at the quadrature points, shape (4 n_quadrature, n_elements)."""
        return self.table @ self.extend(x)[self.gather]

    def assemble_vector(self, density: Array) -> Array:
        """Integrate derivatives with respect to (u, u_x, w, w_x), shape (4 n_quadrature, n_elements), against the shape functions."""
        return _sum_by(self._gather_flat, self.table.T @ density, self.n_free + 1)[: self.n_free]

    def assemble_vectors(self, density: Array) -> Array:
        """As :meth:`assemble_vector` for one or two densities at once, shape (k, 4 n_quadrature, n_elements); returns shape (k, n_free)."""
        k = len(density)
        local = self.table.T @ density
        total = _sum_by(self._gather_two[: local.size], local, k * (self.n_free + 1))
        return total.reshape(k, -1)[:, :-1]

    def assemble_magnitude(self, density: Array) -> Array:
        """As :meth:`assemble_vector` for a density >= 0, with no cancellation between shape functions or elements."""
        return _sum_by(self._gather_flat, self._magnitudes.T @ density, self.n_free + 1)[: self.n_free]

    def assemble_band(self, density: Array) -> Array:
        """Integrate second derivatives, shape (10 n_quadrature, n_elements) in the order of HESSIAN_PAIRS.

        Returns
        -------
        ndarray, shape (3 kd + 1, n_free), Fortran order
            LAPACK general band storage with room for the fill of pivoting.
        """
        depth = 3 * self.half_bandwidth + 1
        flat = _sum_by(self._band_index, self._hessian_table @ density, self.n_free * depth + 1)
        return flat[:-1].reshape(self.n_free, depth).T

    def evaluation_matrix(self) -> sparse.csc_matrix:
        """The map from free coefficients to (u, u_x, w, w_x) at all points, shape (4 n_points, n_free)."""
        n_rows, n_local = self.table.shape
        rows = np.arange(n_rows * self.n_elements).reshape(n_rows, self.n_elements)
        r = np.broadcast_to(rows[:, None, :], (n_rows, n_local, self.n_elements))
        c = np.broadcast_to(self.gather[None], r.shape)
        v = np.broadcast_to(self.table[:, :, None], r.shape)
        keep = (c < self.n_free) & (v != 0)
        return sparse.csc_matrix((v[keep], (r[keep], c[keep])), shape=(rows.size, self.n_free))

    def hessian_matrix(self) -> tuple[NDArray[np.int64], NDArray[np.int64], sparse.csc_matrix]:
        """Assembly of the upper triangle as a linear map of the second derivatives at all points.

        Returns
        -------
        rows, columns : ndarray of int, shape (nnz,)
            Pattern of the upper triangle, in column-major order.
        matrix : sparse, shape (nnz, 10 n_points)
        """
        n_local = self.gather.shape[0]
        i, j = (a.ravel() for a in np.broadcast_arrays(self.gather[:, None, :], self.gather[None, :, :]))
        keep = (i < self.n_free) & (j < self.n_free) & (i <= j)
        pattern, slot = np.unique(j[keep] * self.n_free + i[keep], return_inverse=True)
        local, element = (a.ravel()[keep] for a in np.indices((n_local**2, self.n_elements)))
        points = np.arange(self._hessian_table.shape[1]) * self.n_elements
        v = self._hessian_table[local]
        r = np.broadcast_to(slot[:, None], v.shape)
        c = points[None, :] + element[:, None]
        nonzero = v != 0
        matrix = sparse.csc_matrix((v[nonzero], (r[nonzero], c[nonzero])), shape=(pattern.size, 10 * self.s.size))
        return pattern % self.n_free, pattern // self.n_free, matrix

    def mass_band(self) -> Array:
        """Mass matrix Int phi.phi 2 pi R dS of the reference area, in band storage."""
        area = self.weights * self.R * np.hypot(self.R_x, self.Z_x)
        density = np.zeros((len(HESSIAN_PAIRS), *area.shape))
        density[HESSIAN_PAIRS.index((0, 0))] = density[HESSIAN_PAIRS.index((2, 2))] = area
        return self.assemble_band(density.reshape(-1, self.n_elements))

    def interpolate(self, u: Array, w: Array) -> Array:
        """Free coefficients of the interpolant of displacements given at :meth:`interpolation_points`, both of that shape.

        Where the membrane is pinned along the axis, less the rigid motion that takes the pin away from its place.
        """
        inverse = self.from_values
        x = np.zeros(self.n_free + 1)
        if self.pin is not None:
            w = w - self._at_pin(w)
        x[self.gather] = np.concatenate([inverse @ u, inverse @ w])
        return x[: self.n_free]

    def mirrored(self, x: Array) -> list[Array]:
        """Coefficients of the mirror image across the middle of the meridian, in a list; none where the mesh is not its own image."""
        s = self.interpolation_points()
        R, Z = self.mesh.position(s)
        low, size = float(Z.min() + Z.max()), float(max(np.ptp(R), np.ptp(Z)))
        if np.abs(R - R[::-1, ::-1]).max() > _MIRRORED * size or np.abs(Z + Z[::-1, ::-1] - low).max() > _MIRRORED * size:
            return []
        u, _, w, _ = (values.reshape(s.shape)[::-1, ::-1] for values in self.evaluate(x, s.ravel()))
        return [self.interpolate(u, -w)]

    def _at_pin(self, w: Array) -> float:
        """What the interpolant of values at the interpolation points is at the node that is held along the axis."""
        element = cast(int, self.pin) // self.degree
        return float(w[0, element] if element < self.n_elements else w[-1, -1])

    @cached_property
    def from_values(self) -> Array:
        """Local coefficients from values at the interpolation points of an element."""
        values = self.shape_functions(_lobatto(self.degree))[0]
        return np.linalg.inv(values).astype(np.float64, copy=False)

    def interpolation_points(self) -> Array:
        """Parameters s of degree + 1 points in each element, ends included, shape (degree + 1, n_elements)."""
        points = self.ends[:-1] + _lobatto(self.degree)[:, None] * self.sizes
        points[0], points[-1] = self.ends[:-1], self.ends[1:]  # neighbours share their end, and the last one is that of the meridian
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

    def evaluate(self, x: Array, s: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """(u, u_s, w, w_s) at parameters s, slopes with respect to s; at an element end those of the element that starts there."""
        element, xi = self.locate(s)
        value, slope = self.shape_functions(xi)
        coefficients = self.extend(x)[self.gather[:, element]]
        n_local = self.degree + 1
        size = self.sizes[element]
        u, w = (np.einsum("qa,aq->q", value, c) for c in (coefficients[:n_local], coefficients[n_local:]))
        u_s, w_s = (np.einsum("qa,aq->q", slope, c) / size for c in (coefficients[:n_local], coefficients[n_local:]))
        return u, u_s, w, w_s

    def at_inner_ends(self, x: Array) -> tuple[Array, Array, Array, Array]:
        """(u, u_s, w, w_s) where two elements meet, each of shape (n_elements - 1,): slopes, which jump there, as the mean of both."""
        value, slope = self.shape_functions(np.array([0.0, 1.0]))
        u, w = np.split(self.extend(x)[self.gather], 2)
        u_s, w_s = ((lambda both: (both[1, :-1] + both[0, 1:]) / 2)(slope @ c / self.sizes) for c in (u, w))
        return (value @ u)[0, 1:], u_s, (value @ w)[0, 1:], w_s

    def kinks(self, x: Array) -> Array:
        """Jumps of the deformed meridian's slope, relative to the smaller of both sides: where elements meet, then at the poles.

        The slope is that with respect to arc length at rest, a vector as long as the meridional stretch. At a pole it is compared with its
        mirror image. What is kinked at rest counts only as far as it is more kinked now.

        Returns
        -------
        ndarray, shape (n_elements - 1 + number of poles,)
            At the reference radii :attr:`kink_radii`.
        """
        at_rest, slope, per_length, rest_kinks, poles = self._ends_of_elements
        local, n = self.extend(x)[self.gather], self.degree + 1
        y = (slope @ (local[:n] + 1j * local[n:])) * per_length + at_rest
        size = np.abs(y)
        jumps = np.empty(rest_kinks.size)
        inner = self.n_elements - 1
        np.divide(np.abs(y[1, :-1] - y[0, 1:]), np.minimum(size[1, :-1], size[0, 1:]) + 1e-300, out=jumps[:inner])
        for k, end in enumerate(poles):
            jumps[inner + k] = 2 * abs(y[end].imag) / (size[end] + 1e-300)
        jumps -= rest_kinks
        return jumps

    @cached_property
    def kink_radii(self) -> Array:
        """Reference radii of :meth:`kinks`."""
        return np.append(self._end_positions[0, 1:-1], np.zeros(int(self.on_axis.sum())))

    @cached_property
    def _ends_of_elements(self) -> tuple[Array, Array, Array, Array, list[tuple[int, int]]]:
        """Complex tangents at both ends of each element at rest, slopes of the shape functions there, the factor that relates them to arc
        length, the kinks at rest and which ends are poles."""
        inside = 1e-9 * self.sizes  # the tangent of a curve with a corner has two values there
        R_s, Z_s = self.mesh.tangent(np.stack([self.ends[:-1] + inside, self.ends[1:] - inside]))
        length = np.hypot(R_s, Z_s)
        at_rest = (R_s + 1j * Z_s) / length
        poles = [(k, -k) for k in (0, 1) if self.on_axis[k]]
        turned = [2 * abs(at_rest[end].imag) for end in poles]
        rest_kinks = np.append(np.abs(at_rest[1, :-1] - at_rest[0, 1:]), turned)
        return at_rest, self.shape_functions(np.array([0.0, 1.0]))[1], 1 / (length * self.sizes), rest_kinks, poles

    def recovered_slopes(self, x: Array, s: ArrayLike) -> tuple[Array, Array]:
        """(u_s, w_s) at parameters s; for low degrees continuous and one order better than the derivative of the solution.

        The slope of a finite-element solution of degree p is superconvergent at the p Gauss points of an element. A polynomial through
        those of two neighbours gives the slope at the end they share, one through the ends and the Gauss points of an element the rest.
        From degree 4 on the slopes themselves are the better ones at pole and rim (measured), and are returned as they are.
        """
        element, xi = self.locate(s)
        if self.n_elements == 1 or self.degree > _RECOVERED:
            _, u_s, _, w_s = self.evaluate(x, s)
            return u_s, w_s
        gauss = (np.polynomial.legendre.leggauss(self.degree)[0] + 1) / 2
        ends, size = self.ends, self.sizes
        n_local = self.degree + 1
        slope = self.shape_functions(gauss)[1]
        coefficients = self.extend(x)[self.gather]
        at_gauss = np.stack([slope @ coefficients[:n_local], slope @ coefficients[n_local:]]) / size  # (2, degree, n_elements)
        # at an end the polynomial through the points of the elements beside it; the first and the last end take the nearest two
        left = np.clip(np.arange(self.n_elements + 1) - 1, 0, self.n_elements - 2)
        unit = size[left]
        points = np.concatenate([gauss[:, None] * np.ones_like(unit), 1 + gauss[:, None] * size[left + 1] / unit])
        weights = _lagrange(points, (ends - ends[left]) / unit)
        at_ends = np.einsum("gn,fgn->fn", weights, np.concatenate([at_gauss[:, :, left], at_gauss[:, :, left + 1]], axis=1))
        nodes = np.concatenate([[0.0], gauss, [1.0]])
        values = np.concatenate([at_ends[:, None, :-1], at_gauss, at_ends[:, None, 1:]], axis=1)[:, :, element]
        u_s, w_s = np.einsum("gn,fgn->fn", _lagrange(np.repeat(nodes[:, None], xi.size, axis=1), xi), values)
        return u_s, w_s


@lru_cache(maxsize=32)
def space_of(mesh: Meridian, degree: int, anchored: frozenset[str] = frozenset()) -> Space:
    """The space of a mesh and a degree, built once."""
    return Space(mesh, degree, anchored=anchored)


def space_of_scene(scene: Any) -> Space:
    """The space of a scene, built once."""
    return space_of(scene.mesh, scene.degree, anchored(scene))


def anchored(scene: Any) -> frozenset[str]:
    """In which directions something outside the membrane of a scene sees where it is: a source or load, unless it does nothing."""
    acting = [*acting_sources(scene.sources, scene.susceptibility), *(load for load in scene.loads if load.acts)]
    return frozenset().union(*(part.sees for part in acting))


def band_of(gather: NDArray[np.int64], n_free: int) -> int:
    """Half bandwidth that the unknowns of the elements, one column each, leave; those numbered ``n_free`` are none."""
    inside = gather < n_free
    low, high = np.where(inside, gather, n_free).min(axis=0), np.where(inside, gather, -1).max(axis=0)
    return int((high - low).max(initial=0))


def _folded(n_nodes: int) -> NDArray[np.int64]:
    """Numbers of the nodes of a closed curve, the last one the first again, so that neighbours differ by two at most."""
    k = np.arange(n_nodes)
    n = n_nodes - 1
    return np.where(2 * k <= n, np.maximum(2 * k - 1, 0), 2 * (n - k))


def _sum_by(index: NDArray[np.int64], values: Array, length: int) -> Array:
    total: Array = np.bincount(index, values.ravel(), length)  # type: ignore[assignment]  # with weights the counts are floats
    return total


def _as_slice(index: NDArray[np.int64]) -> slice | NDArray[np.int64]:
    """The same selection as a slice where the numbers are evenly spaced: a view instead of a copy."""
    if index.size > 2 and (np.diff(index) == index[1] - index[0]).all():
        return slice(int(index[0]), int(index[-1]) + 1, int(index[1] - index[0]))
    return index


def _lagrange(points: Array, at: Array) -> Array:
    """Lagrange polynomials through points (m, n), each column at its own place (n,), shape (m, n)."""
    result = np.ones_like(points)
    for i in range(len(points)):
        for j in range(len(points)):
            if j != i:
                result[i] *= (at - points[j]) / (points[i] - points[j])
    return result


def _line_element(degree: int) -> skfem.Element:
    special = {1: ElementLineP1, 2: ElementLineP2}
    return special[degree]() if degree in special else ElementLinePp(degree)


def _local_order(degree: int) -> list[int]:
    """scikit-fem numbers the two ends first; along the meridian the second end comes last."""
    return [0, *range(2, degree + 1), 1]


def _meridian_order(line: skfem.MeshLine, element: skfem.Element) -> tuple[NDArray[np.int64], int]:
    """Scalar node numbers of each element, increasing along the meridian, shape (degree + 1, n_elements), and their number."""
    dofs = skfem.Dofs(line, element).element_dofs
    flat = dofs[_local_order(dofs.shape[0] - 1)].T.ravel()
    _, first = np.unique(flat, return_index=True)
    rank = np.empty(first.size, dtype=np.int64)
    rank[flat[np.sort(first)]] = np.arange(first.size)
    return rank[flat].reshape(line.nelements, -1).T, first.size


def _lobatto(degree: int) -> Array:
    """Chebyshev-Lobatto points on [0, 1], ends included."""
    return (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2
