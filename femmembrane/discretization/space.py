"""Finite-element space on a meridian, as plain arrays.

scikit-fem supplies elements, degrees of freedom, quadrature and the map from the reference element; what leaves this room is NumPy
only. Unknowns are the coefficients of the displacement (u, w), numbered along the meridian and interleaved. So every matrix of the problem
is banded with half bandwidth 2 degree + 1. The unknowns of a closed curve are numbered as if it were folded flat, which doubles the
bandwidth. Points are numbered quadrature point first, element second: with arrays of shape (rows * n_quadrature, n_elements) gathering,
evaluating and assembling are one matrix product each.
"""

from __future__ import annotations

import copy
from functools import lru_cache
from itertools import combinations_with_replacement
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from ..physics.magnetisation import seen_by
from ..threads import cached_property
from .elements import gauss_points, lagrange, lobatto, second_derivatives, shape_functions
from .lift import Lift
from .meridian import Array, Meridian
from .numbering import Numbering

#: pairs (i, j) of the local variables (u, u_x, w, w_x) in the order of Hessian entries
HESSIAN_PAIRS: tuple[tuple[int, int], ...] = tuple(combinations_with_replacement(range(4), 2))

#: deviation of a mesh from its mirror image, relative to its size, that counts as zero
_MIRRORED = 1e-6
#: highest degree at which slopes are recovered from the Gauss points
_RECOVERED = 3


class Space(Numbering):
    """Displacements (u, w) of one degree on one meridian: their values from coefficients, and integrals against their shape functions.

    Parameters and further attributes: see :class:`.numbering.Numbering`.

    Attributes
    ----------
    nodal : bool
        Whether all coefficients are values at :meth:`.Numbering.interpolation_points`, for degrees from 3 on too.
    table : ndarray, shape (4 n_quadrature, 2 (degree + 1))
        (u, u_x, w, w_x) at the quadrature points of an element from its coefficients.
    reach : float
        How far a component of the displacement may be from zero at quadrature points and nodes, over the largest of its coefficients.
    highest : ndarray, shape (n_quadrature,)
        The Legendre polynomial of the highest degree that the quadrature points of an element tell apart, at these.
    """

    def __init__(
        self,
        mesh: Meridian,
        degree: int,
        quadrature: int | None = None,
        anchored: frozenset[str] = frozenset(),
        ends: tuple[float, ...] = (),
        prestretch: float = 1.0,
        nodal: bool = False,
    ) -> None:
        super().__init__(mesh, degree, quadrature, anchored, ends, prestretch)
        self.nodal = nodal and degree > 2  # up to degree 2 the coefficients are values at the nodes anyway
        self._tabulate()

    def _tabulate(self) -> None:
        value, slope = self.shape_functions(self.points)
        self.highest = np.polynomial.legendre.legval(2 * self.points - 1, np.eye(self.n_quadrature)[-1])
        zero = np.zeros_like(value)
        blocks = [[value, zero], [slope, zero], [zero, value], [zero, slope]]
        self.table = np.block(blocks)
        self._magnitudes = np.abs(self.table)
        self.reach = max(1.0, float(np.abs(value).sum(axis=1).max()))
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
        self._known_ends: dict[int, tuple[int, int, float, float]] = {}
        self._gather_two = np.concatenate([self._gather_flat, self._gather_flat + self.n_free + 1])

    def with_moved(self, places: tuple[tuple[int, float], ...], *, alone: bool = False) -> Space:
        """The same space with some ends of elements at other places along the meridian, and those between carried along.

        The numbering stays. Ends that are not :attr:`movable` stay as well.

        Parameters
        ----------
        places : tuple of (int, float)
            Numbers of ends and their places.
        alone : bool
            Whether all others stay, as nodes do that a body holds one by one.
        """
        moved: Space = copy.copy(self)
        for name in [name for name in vars(moved) if isinstance(getattr(type(moved), name, None), cached_property)]:
            del moved.__dict__[name]
        known = dict(enumerate(self.ends.tolist()))
        index = [*range(self.ends.size)] if alone else sorted({k for k, _ in places}.union(np.flatnonzero(~self.movable).tolist()))
        known.update(places)
        at = np.array([known[k] for k in index])
        ends = np.interp(self.ends, self.ends[index], at)
        ends[index] = at
        moved._place(ends)
        moved._known_ends = {}
        return moved

    @cached_property
    def movable(self) -> NDArray[np.bool_]:
        """Which ends of elements can be moved: inside the meridian, and where it is smooth."""
        found = np.zeros(self.n_elements + 1, dtype=bool)
        if self.n_elements > 1:
            kinks = self.ends_of_elements[3][: self.n_elements - 1]
            found[1:-1] = kinks < 1e-6
            found[self.breaks] = False
        return found

    def shape_functions(self, xi: Array) -> tuple[Array, Array]:
        """Values and slopes of the shape functions at points xi of the reference element, each of shape (len(xi), degree + 1)."""
        value, slope = shape_functions(self.degree, xi)
        if not self.nodal:
            return value, slope
        return value @ self._at_nodes, slope @ self._at_nodes

    def second_derivatives(self, xi: Array) -> Array:
        """Second derivatives of the shape functions at points xi of the reference element, shape (len(xi), degree + 1)."""
        second = second_derivatives(self.degree, xi)
        return second @ self._at_nodes if self.nodal else second

    @property
    def _at_nodes(self) -> Array:
        """Coefficients of the hierarchical functions in those that are 1 at one node."""
        return np.asarray(np.linalg.inv(shape_functions(self.degree, lobatto(self.degree))[0]))

    def center_height(self, x: Array) -> float:
        """Height of the first point of the meridian, the pole of a disc."""
        return float(self.first_height + (x[self.pole] if self.pole < self.n_free else 0.0))

    def end_position(self, x: Array, k: int) -> tuple[float, float]:
        """Deformed position (rho, eta) of the k-th end of elements, whose coefficients are its displacement."""
        i, j, R, Z = self._known_ends.get(k) or self._end(k)
        return R + float(x[i]) if i < self.n_free else R, Z + float(x[j]) if j < self.n_free else Z

    def _end(self, k: int) -> tuple[int, int, float, float]:
        """Unknowns and position while all unknowns are zero of an end of elements, looked up once."""
        at = k % (self.n_elements + 1)
        i, j = self.numbers[self.nodes[self.degree * at]]
        R, Z = self._lifted_ends[:, at]
        return self._known_ends.setdefault(k, (int(i), int(j), float(R), float(Z)))

    def axis_heights(self, x: Array) -> list[float]:
        """Heights of the nodes on the axis and of rigid discs across it."""
        n = self.n_free
        return [height + float(x[k]) if k < n else height for k, height in self._axis]

    def extend(self, x: Array) -> Array:
        """Free coefficients with the zero of the supports appended, so that ``extend(x)[numbers]`` covers all nodes."""
        extended = np.empty(self.n_free + 1)
        extended[:-1], extended[-1] = x, 0.0
        return extended

    def displacement(self, x: Array, s: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """(u, u_s, w, w_s) of a state at parameters s, the lift included; :meth:`evaluate` gives what the unknowns add to it."""
        own = self.evaluate(x, s)
        if self.lift is None:
            return own
        u, u_s, w, w_s = (a + b for a, b in zip(own, self.lift.at(self.mesh, np.asarray(s, dtype=float)), strict=True))
        return u, u_s, w, w_s

    def displacement_at_quadrature(self, x: Array) -> Array:
        """(u, u_x, w, w_x) of a state at the quadrature points, the lift included, shape (4, n_quadrature, n_elements)."""
        own: Array = self.at_quadrature(x).reshape(4, *self.s.shape)
        return own if self.lift is None else own + self.lifting

    @cached_property
    def lifting(self) -> Array:
        """(u, u_x, w, w_x) of the lift at the quadrature points, shape (4, n_quadrature, n_elements)."""
        return self.lifting_of(self.lift)

    def lifting_of(self, lift: Lift | None) -> Array:
        """The same of any lift of this meridian."""
        if lift is None:
            return np.zeros((4, *self.s.shape))
        values = lift.at(self.mesh, self.s)
        values[1::2] *= self.sizes
        return values

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

    def mass_band(self, area: Array | None = None) -> Array:
        """Mass matrix Int phi.phi 2 pi R dS of the reference area, or of what ``area`` has at the points, in band storage."""
        area = self.area_weights if area is None else area
        density = np.zeros((len(HESSIAN_PAIRS), *area.shape))
        density[HESSIAN_PAIRS.index((0, 0))] = density[HESSIAN_PAIRS.index((2, 2))] = area
        return self.assemble_band(density.reshape(-1, self.n_elements))

    def interpolate(self, u: Array, w: Array) -> Array:
        """Free coefficients of the interpolant of displacements (u, w) given at :meth:`interpolation_points`. Where the membrane is pinned
        along the axis, the rigid motion that would move the pin is taken out.
        """
        inverse = self.from_values
        x = np.zeros(self.n_free + 1)
        if self.pin is not None:
            w = w - self._at_pin(w)
        x[self.gather] = np.concatenate([inverse @ u, inverse @ w])
        return x[: self.n_free]

    def mirrored(self, x: Array) -> list[Array]:
        """Coefficients of the mirror image across the middle of the meridian, in a list; the list is empty if the mesh is not symmetric."""
        s = self.interpolation_points()
        R, Z = self.mesh.position(s)
        low, size = float(Z.min() + Z.max()), float(max(np.ptp(R), np.ptp(Z)))
        if np.abs(R - R[::-1, ::-1]).max() > _MIRRORED * size or np.abs(Z + Z[::-1, ::-1] - low).max() > _MIRRORED * size:
            return []
        u, _, w, _ = (values.reshape(s.shape)[::-1, ::-1] for values in self.displacement(x, s.ravel()))
        u0, _, w0, _ = (0.0, 0.0, 0.0, 0.0) if self.lift is None else self.lift.at(self.mesh, s)
        return [self.interpolate(u - u0, -w - w0)]

    def _at_pin(self, w: Array) -> float:
        """Value of the interpolant at the node that is held along the axis."""
        element = cast(int, self.pin) // self.degree
        return float(w[0, element] if element < self.n_elements else w[-1, -1])

    @cached_property
    def from_values(self) -> Array:
        """Local coefficients from values at the interpolation points of an element."""
        values = self.shape_functions(lobatto(self.degree))[0]
        return np.linalg.inv(values).astype(np.float64, copy=False)

    def evaluate(self, x: Array, s: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """(u, u_s, w, w_s) at parameters s, slopes with respect to s. At an element end the element that starts there gives the slopes."""
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
        own = (value @ u)[0, 1:], u_s, (value @ w)[0, 1:], w_s
        if self.lift is None:
            return own
        u, u_s, w, w_s = (a + b for a, b in zip(own, self.lift.at(self.mesh, self.ends[1:-1]), strict=True))
        return u, u_s, w, w_s

    def kinks(self, x: Array) -> Array:
        """Jumps of the deformed meridian's slope, relative to the smaller of both sides: where elements meet, then at the poles.

        The slope is taken with respect to arc length at rest: a vector as long as the meridional stretch. At a pole it is compared with its
        mirror image. A kink at rest counts only as far as it has grown, and where the sheet or its electrodes have ends the
        direction alone.

        Returns
        -------
        ndarray, shape (n_elements - 1 + number of poles,)
            At the reference radii :attr:`kink_radii`.
        """
        at_rest, slopes, per_length, rest_kinks, poles = self.ends_of_elements
        y = slopes @ self.extend(x).take(self.gather)
        y *= per_length
        y += at_rest
        along, up = y[:2], y[2:]  # at both ends of each element
        size = np.hypot(along, up)
        size += 1e-300
        jumps = np.empty(rest_kinks.size)
        inner = self.n_elements - 1
        np.hypot(along[1, :-1] - along[0, 1:], up[1, :-1] - up[0, 1:], out=jumps[:inner])
        jumps[:inner] /= np.minimum(size[1, :-1], size[0, 1:])
        for k in self.breaks:  # the stretch may jump there, and the direction not
            before, after = y[1::2, k - 1] / size[1, k - 1], y[::2, k] / size[0, k]
            jumps[k - 1] = np.hypot(*(before - after))
        for k, end in enumerate(poles):
            jumps[inner + k] = 2 * abs(up[end]) / size[end]
        jumps -= rest_kinks
        return jumps

    @cached_property
    def kink_radii(self) -> Array:
        """Reference radii of :meth:`kinks`."""
        return np.append(self._end_positions[0, 1:-1], np.zeros(int(self.on_axis.sum())))

    @cached_property
    def ends_of_elements(self) -> tuple[Array, Array, Array, Array, list[tuple[int, int]]]:
        """Components along and up of the tangents at both ends of each element at rest, each of shape (2, n_elements), slopes of the shape
        functions there, the factor that relates them to arc length, the kinks at rest and which ends are poles."""
        inside = 1e-9 * self.sizes  # the tangent of a curve with a corner has two values there
        R_s, Z_s = self.mesh.tangent(np.stack([self.ends[:-1] + inside, self.ends[1:] - inside]))
        length = np.hypot(R_s, Z_s)
        at_rest = (R_s + 1j * Z_s) / length
        poles = [(k, -k) for k in (0, 1) if self.on_axis[k]]
        turned = [2 * abs(at_rest[end].imag) for end in poles]
        rest_kinks = np.append(np.abs(at_rest[1, :-1] - at_rest[0, 1:]), turned)
        if self.lift is not None:
            _, u_s, _, w_s = self.lift.at(self.mesh, np.stack([self.ends[:-1], self.ends[1:]]))
            at_rest = at_rest + (u_s + 1j * w_s) / length
        slope = self.shape_functions(np.array([0.0, 1.0]))[1]
        none = np.zeros_like(slope)
        slopes, per_length = np.block([[slope, none], [none, slope]]), np.tile(1 / (length * self.sizes), (2, 1))
        return np.concatenate([at_rest.real, at_rest.imag]), slopes, per_length, rest_kinks, poles

    def recovered_slopes(self, x: Array, s: ArrayLike) -> tuple[Array, Array]:
        """(u_s, w_s) at parameters s; for low degrees continuous and one order better than the derivative of the solution.

        The slope of a finite-element solution of degree p is superconvergent at the p Gauss points of an element. A polynomial through the
        points of two neighbours gives the slope at the end they share. A polynomial through the ends and the Gauss points of an element
        gives the rest. From degree 4 on the slopes themselves are the better ones at pole and rim (measured), and are returned as they are.
        """
        element, xi = self.locate(s)
        if self.n_elements == 1 or self.degree > _RECOVERED:
            _, u_s, _, w_s = self.displacement(x, s)
            return u_s, w_s
        gauss = gauss_points(self.degree)
        ends, size = self.ends, self.sizes
        n_local = self.degree + 1
        slope = self.shape_functions(gauss)[1]
        coefficients = self.extend(x)[self.gather]
        at_gauss = np.stack([slope @ coefficients[:n_local], slope @ coefficients[n_local:]]) / size  # (2, degree, n_elements)
        # at an end the polynomial through the points of the elements beside it; the first and the last end take the nearest two
        left = np.clip(np.arange(self.n_elements + 1) - 1, 0, self.n_elements - 2)
        unit = size[left]
        points = np.concatenate([gauss[:, None] * np.ones_like(unit), 1 + gauss[:, None] * size[left + 1] / unit])
        weights = lagrange(points, (ends - ends[left]) / unit)
        at_ends = np.einsum("gn,fgn->fn", weights, np.concatenate([at_gauss[:, :, left], at_gauss[:, :, left + 1]], axis=1))
        first, last = at_ends[:, :-1], at_ends[:, 1:]
        if self.breaks:  # there the membrane itself may have two slopes
            first, last = first.copy(), last.copy()
            alone = lagrange(gauss[:, None] * np.ones(2), np.array([0.0, 1.0]))
            for k in self.breaks:
                first[:, k], last[:, k - 1] = at_gauss[:, :, k] @ alone[:, 0], at_gauss[:, :, k - 1] @ alone[:, 1]
        nodes = np.concatenate([[0.0], gauss, [1.0]])
        values = np.concatenate([first[:, None], at_gauss, last[:, None]], axis=1)[:, :, element]
        u_s, w_s = np.einsum("gn,fgn->fn", lagrange(np.repeat(nodes[:, None], xi.size, axis=1), xi), values)
        if self.lift is not None:
            lift = self.lift.at(self.mesh, np.asarray(s, dtype=float))
            u_s, w_s = u_s + lift[1], w_s + lift[3]
        return u_s, w_s


def transferred(space: Space, x: Array, onto: Space) -> Array:
    """Free coefficients in another space of the interpolant of the displacement with free coefficients x."""
    points = onto.interpolation_points()
    u, _, w, _ = space.evaluate(x, points.ravel())
    return onto.interpolate(u.reshape(points.shape), w.reshape(points.shape))


@lru_cache(maxsize=32)
def space_of(
    mesh: Meridian,
    degree: int,
    anchored: frozenset[str] = frozenset(),
    ends: tuple[float, ...] = (),
    prestretch: float = 1.0,
    nodal: bool = False,
) -> Space:
    """The space of a mesh and a degree, built once."""
    return Space(mesh, degree, anchored=anchored, ends=ends, prestretch=prestretch, nodal=nodal)


@lru_cache(maxsize=8)
def looked_at(mesh: Meridian, degree: int, anchored: frozenset[str], ends: tuple[float, ...], prestretch: float, nodal: bool) -> Space:
    """The space whose points are both ends of each element, built once."""
    return Space(mesh, degree, 0, anchored, ends, prestretch, nodal)


def space_of_scene(scene: Any) -> Space:
    """The space of a scene, built once."""
    borders = scene.borders, scene.follows, bool(scene.bodies)
    return moved_space_of(scene.mesh, scene.degree, anchored(scene), scene.element_ends, scene.prestretch, *borders)


@lru_cache(maxsize=32)
def moved_space_of(
    mesh: Meridian,
    degree: int,
    anchored: frozenset[str],
    ends: tuple[float, ...],
    prestretch: float,
    borders: tuple[tuple[int, float], ...],
    nodal: bool,
    alone: bool,
) -> Space:
    """The space of a mesh and a degree with some ends of elements elsewhere, see :meth:`Space.with_moved`."""
    space = space_of(mesh, degree, anchored, ends, prestretch, nodal)
    return space.with_moved(borders, alone=alone) if borders else space


def anchored(scene: Any) -> frozenset[str]:
    """Directions in which the place of the membrane matters to the sources and loads of a scene that do something."""
    return seen_by(scene).union(*(load.sees for load in scene.loads if load.acts))


def _sum_by(index: NDArray[np.int64], values: Array, length: int) -> Array:
    total: Array = np.bincount(index, values.ravel(), length)  # type: ignore[assignment]  # with weights the counts are floats
    return total
