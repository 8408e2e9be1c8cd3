"""Unknowns of perturbations with n waves around the axis: their supports, their numbering along the meridian, and their shapes.

They are the coefficients of (a, c, b) at the nodes, see :mod:`.second_variation`. What ends on the axis allow depends on n = 0, 1, or more.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..discretization.harmonics import AROUND, RADIAL, supports_of_waves
from ..discretization.numbering import band_of
from ..discretization.space import Space
from ..potential import Array
from ..threads import cached_property
from .second_variation import PAIRS, SLOPED_PAIRS, VALUES


class WaveUnknowns:
    """Supports, numbering, tables and mass: they depend on the space and on min(n, 2) alone."""

    def __init__(self, space: Space, kind: int) -> None:
        degree, n_elements = space.degree, space.n_elements
        n_local = degree + 1
        nodes = space.nodes[degree * np.arange(n_elements) + np.arange(n_local)[:, None]]
        free, opposite = supports_of_waves(space, kind)
        self.n_free = int(free.sum())
        self.numbers: NDArray[np.int64] = np.full((space.n_nodes, 3), self.n_free, dtype=np.int64)
        self.numbers[free] = np.arange(self.n_free)
        self.numbers[opposite, AROUND] = self.numbers[opposite, RADIAL]
        #: local row of c and element where c = -a on the axis
        self.flips = [(n_local, 0) if node == 0 else (2 * n_local - 1, n_elements - 1) for node in opposite]
        self.gather = np.concatenate([self.numbers[nodes, k] for k in range(3)])
        open_curve = min((3 if kind else 2) * degree + (2 if kind else 1), max(self.n_free - 1, 0))
        self.half_bandwidth = band_of(self.gather, self.n_free) if space.closed else open_curve
        self._tabulate(space)
        self._area, self._mass = space.area_weights, self._assembled_mass(space.area_weights)
        points = (space.interpolation_points()[:, 0] - space.ends[0]) / space.sizes[0]
        self.node_values = space.shape_functions(points)[0]

    def mass(self, bulk: Array) -> Array:
        """Mass matrix of a membrane with these weights of its bulk at the quadrature points, in band storage."""
        return self._mass if bulk is self._area else self._assembled_mass(bulk)

    def _assembled_mass(self, bulk: Array) -> Array:
        zero = np.zeros_like(bulk)
        mass = self.assemble(np.stack([bulk if i == j and i in VALUES else zero for i, j in PAIRS]))
        mass.flags.writeable = False
        return mass

    def _tabulate(self, space: Space) -> None:
        n_local = space.degree + 1
        rows = np.zeros((6, space.n_quadrature, 3 * n_local))
        for field in range(3):
            columns = slice(field * n_local, (field + 1) * n_local)
            rows[2 * field, :, columns] = space.table[: space.n_quadrature, :n_local]
            rows[2 * field + 1, :, columns] = space.table[space.n_quadrature : 2 * space.n_quadrature, :n_local]
        self._values = space.table[: space.n_quadrature, :n_local]
        self._slopes = space.table[space.n_quadrature : 2 * space.n_quadrature, :n_local]
        self._rows = rows
        self._table = self._products(PAIRS)
        kd, depth = self.half_bandwidth, 3 * self.half_bandwidth + 1
        row, column = np.broadcast_arrays(self.gather[:, None, :], self.gather[None, :, :])
        inside = (row < self.n_free) & (column < self.n_free)
        self._band_index = np.where(inside, column * depth + 2 * kd + row - column, self.n_free * depth).ravel()

    def _products(self, pairs: tuple[tuple[int, int], ...]) -> Array:
        rows, outer = self._rows, []
        for i, j in pairs:
            product = np.einsum("qa,qb->abq", rows[i], rows[j])
            outer.append(product if i == j else product + product.transpose(1, 0, 2))
        return np.ascontiguousarray(np.stack(outer, axis=2).reshape(rows.shape[2] ** 2, -1))

    @cached_property
    def _sloped_table(self) -> Array:
        return self._products(SLOPED_PAIRS)

    def assemble(self, density: Array) -> Array:
        """Integrate second derivatives in the order of :func:`pairs_of`, shape (18 or 19, n_quadrature, n_elements), to a band matrix."""
        table = self._table if len(density) == len(PAIRS) else self._sloped_table
        n_elements, n_local = density.shape[-1], self.gather.shape[0]
        local = (table @ density.reshape(-1, n_elements)).reshape(n_local, n_local, n_elements)
        for row, element in self.flips:
            local[row, :, element] *= -1
            local[:, row, element] *= -1
        depth = 3 * self.half_bandwidth + 1
        flat: Array = np.bincount(self._band_index, local.ravel(), self.n_free * depth + 1)  # type: ignore[assignment]  # weighted: floats
        return flat[:-1].reshape(self.n_free, depth).T

    def integrate(self, density: Array, slopes: Array | None = None) -> Array:
        """Integrate densities of (a, c, b), shape (3, n_quadrature, n_elements), against the shape functions, and of their slopes."""
        local = np.concatenate([self._values.T @ part for part in density])
        if slopes is not None:
            local += np.concatenate([self._slopes.T @ part for part in slopes])
        for row, element in self.flips:
            local[row, element] *= -1
        total: Array = np.bincount(self.gather.ravel(), local.ravel(), self.n_free + 1)  # type: ignore[assignment]  # weighted: floats
        return total[: self.n_free]

    def local(self, mode: Array) -> Array:
        """Coefficients of (a, c, b) in each element, shape (3 (degree + 1), n_elements)."""
        local = np.append(mode, 0.0)[self.gather]
        for row, element in self.flips:
            local[row, element] *= -1
        return local


@lru_cache(maxsize=32)
def wave_unknowns(space: Space, kind: int) -> WaveUnknowns:
    """The unknowns of n waves in a space, ``kind`` = min(n, 2), remembered."""
    return WaveUnknowns(space, kind)


def azimuthal_shape(space: Space, n: int, mode: Array) -> dict[str, Array]:
    """A mode at the nodes along the meridian: r (reference radius), u (radial), c (circumferential), w (vertical)."""
    layout = wave_unknowns(space, min(n, 2))
    nodes = layout.node_values @ layout.local(mode).reshape(3, space.degree + 1, -1)
    a, c, b = np.concatenate([nodes[:, :-1].transpose(0, 2, 1).reshape(3, -1), nodes[:, -1, -1:]], axis=1)
    return {"r": space.mesh.position(space.node_parameters())[0], "u": a, "c": c, "w": b}


def mode_in(space: Space, n: int, mode: Array, onto: Space) -> Array:
    """Coefficients in another space of the interpolant of a mode."""
    kind = min(n, 2)
    source, target = wave_unknowns(space, kind), wave_unknowns(onto, kind)
    points = onto.interpolation_points()
    element, xi = space.locate(points.ravel())
    fields = source.local(mode).reshape(3, space.degree + 1, -1)[:, :, element]
    values = np.einsum("qa,faq->fq", space.shape_functions(xi)[0], fields).reshape(3, *points.shape)
    local = np.concatenate(onto.from_values @ values)
    for row, at in target.flips:
        local[row, at] *= -1
    coefficients = np.zeros(target.n_free + 1)
    coefficients[target.gather] = local
    return coefficients[:-1]
