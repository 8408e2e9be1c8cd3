"""Displacements with harmonics around the axis: Fourier finite elements on a meridian.

A surface with n-fold symmetry about the axis that is symmetric in the plane theta = 0 is ::

    u = (sum_j a_j cos(j n theta), sum_j c_j sin(j n theta), sum_j b_j cos(j n theta)),       j = 0 ... K,  c_0 = 0

in (e_r, e_theta, e_z), with functions a_j, c_j, b_j of the meridian. What each harmonic may do at the ends is what a perturbation with j n
waves may do there (:func:`supports_of_waves`). Unknowns are interleaved node by node, so that matrices stay banded, 3 K + 2 times as wide.
Perturbations that are odd in the mirror have sines for cosines and the reverse, and of those without waves the torsion c_0 alone.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .meridian import Array
from .numbering import band_of
from .space import Space

#: local variables at a point: the position, its slope along the element, its slope around the axis, each in (e_r, e_theta, e_z)
N_LOCAL = 9
#: pairs of local variables in the order of second derivatives
LOCAL_PAIRS: tuple[tuple[int, int], ...] = tuple((i, j) for i in range(N_LOCAL) for j in range(i, N_LOCAL))
#: angles in half a wave for each harmonic, and the least number of them
_ANGLES, _LEAST_ANGLES = 3, 6
#: the fields a (radial), c (around the axis) and b (vertical)
RADIAL, AROUND, VERTICAL = range(3)


def supports_of_waves(space: Space, kind: int) -> tuple[NDArray[np.bool_], list[int]]:
    """Free fields (a, c, b) of each node for ``kind`` = min(n, 2) waves, and the nodes on the axis at which c = -a.

    A support that holds u holds both in-plane displacements. On the axis a smooth vector field has no in-plane part at n = 0, a
    constant in-plane part at n = 1, and vanishes for larger n. Rigid motions that the supports leave cost nothing and are no perturbations.
    One node is held against them, and no other motion is lost.
    """
    free = np.ones((space.n_nodes, 3), dtype=bool)
    opposite = []
    for node, support, on_axis in zip(space.nodes[[0, -1]].tolist(), space.supports, space.on_axis.tolist(), strict=False):
        in_plane, vertical = "u" not in support.held, "w" not in support.held
        if on_axis:
            rigid = kind == 1 and vertical  # a pole that is held vertically is a fixed point
            free[node] = [rigid, False, kind == 0 and vertical]
            opposite += [node] if rigid else []
        else:
            free[node] = [in_plane, in_plane, vertical] if kind == 0 or not support.rigid else False
    pinned = space.nodes[space.widest]
    if kind == 0:
        free[:, AROUND] = False
        if space.pin is not None:
            free[pinned, VERTICAL] = False
    if kind == 1:  # at this radius a shift is seen in c, a tilt in b
        shift, tilt = space.rotations
        free[pinned, AROUND] &= not shift
        free[pinned, VERTICAL] &= not tilt
    return free, opposite


class Harmonics:
    """Harmonics 0, n, 2n ... K n of the displacement in a space.

    Parameters
    ----------
    space : Space
    waves : int
        n >= 1.
    order : int
        K >= 1.
    odd : bool
        Whether these are the perturbations that a mirror in the plane theta = 0 turns round.

    Attributes
    ----------
    n_free, half_bandwidth : int
    fields : list of (int, int)
        Harmonic j and field (a, c or b) of each function of the meridian.
    angles : ndarray, shape (n_angles,)
        n theta of the angles at which integrands are evaluated, in half a wave: the trapezoidal rule.
    numbers : ndarray of int, shape (n_nodes, n_fields)
        Unknown of each node; n_free stands for what is held.
    """

    def __init__(self, space: Space, waves: int, order: int, odd: bool = False) -> None:
        self.space, self.waves, self.order, self.odd = space, waves, order, odd
        self.fields = [(j, f) for j in range(order + 1) for f in (RADIAL, AROUND, VERTICAL) if j or (f == AROUND) == odd]
        n_angles = max(_ANGLES * order, _LEAST_ANGLES)
        self.angles: Array = np.pi * (np.arange(n_angles) + 0.5) / n_angles
        self._number()
        self._tabulate()

    def _number(self) -> None:
        space, n_local = self.space, self.space.degree + 1
        local = space.nodes[space.degree * np.arange(space.n_elements) + np.arange(n_local)[:, None]]
        free = np.zeros((space.n_nodes, len(self.fields)), dtype=bool)
        held = {kind: supports_of_waves(space, kind) for kind in range(3)}
        for column, (j, field) in enumerate(self.fields):
            free[:, column] = held[min(j * self.waves, 2)][0][:, field]
            if not j and self.odd:
                free[:, column] = self._may_turn()
        self.n_free = int(free.sum())
        self.numbers: NDArray[np.int64] = np.full(free.shape, self.n_free, dtype=np.int64)
        self.numbers[free] = np.arange(self.n_free)
        self._flips: list[tuple[int, int]] = []
        if self.waves == 1:  # of odd ones c = a, which no sign is needed for
            radial, around = self.fields.index((1, RADIAL)), self.fields.index((1, AROUND))
            for node in held[1][1]:
                self.numbers[node, around] = self.numbers[node, radial]
                if not self.odd:
                    self._flips.append((around * n_local, 0) if node == 0 else (around * n_local + n_local - 1, space.n_elements - 1))
        self.gather = np.concatenate([self.numbers[local, column] for column in range(len(self.fields))])
        self.half_bandwidth = band_of(self.gather, self.n_free)
        #: unknown of a coefficient without waves, by its number in the space
        self.without_waves: NDArray[np.int64] = np.empty(space.n_free, dtype=np.int64)
        for column in () if self.odd else (RADIAL, 1):
            own, known = space.numbers[:, column], self.numbers[:, column]
            self.without_waves[own[own < space.n_free]] = known[own < space.n_free]

    def _may_turn(self) -> NDArray[np.bool_]:
        """The nodes that may turn about the axis without waves: none on the axis or where both displacements in the plane are held."""
        space = self.space
        free = np.ones(space.n_nodes, dtype=bool)
        for node, support, on_axis in zip(space.nodes[[0, -1]].tolist(), space.supports, space.on_axis.tolist(), strict=False):
            free[node] = not on_axis and "u" not in support.held
        if all("u" not in support.held for support in space.supports):  # nothing resists a turn of the whole
            free[space.nodes[space.widest]] = False
        return free

    def _tabulate(self) -> None:
        space, n = self.space, self.waves
        n_local, n_fields, n_angles = space.degree + 1, len(self.fields), self.angles.size
        self.values = space.table[: space.n_quadrature, :n_local]
        self.slopes = space.table[space.n_quadrature : 2 * space.n_quadrature, :n_local]
        turn = np.zeros((N_LOCAL, n_angles, n_fields, 2))  # of the local variables by value and slope of each field
        for column, (j, field) in enumerate(self.fields):
            cos, sin, m = np.cos(j * self.angles), np.sin(j * self.angles), j * n
            if self.odd:  # the derivatives of sin and cos have the signs of those of cos and -sin
                cos, sin, m = sin, cos, -m
            turn[field, :, column, 0] = turn[3 + field, :, column, 1] = sin if field == AROUND else cos
            if field == RADIAL:
                turn[6, :, column, 0], turn[7, :, column, 0] = -m * sin, cos
            elif field == AROUND:
                turn[6, :, column, 0], turn[7, :, column, 0] = -sin, m * cos
            else:
                turn[8, :, column, 0] = -m * sin
        self._turn = turn.reshape(N_LOCAL * n_angles, 2 * n_fields)
        self._turn_back = np.ascontiguousarray(self._turn.T) / n_angles
        self._pairs = self._pair_map(turn.reshape(N_LOCAL, n_angles, -1))
        products = [np.einsum("qa,qb->qab", first, second) for first in (self.values, self.slopes) for second in (self.values, self.slopes)]
        self._products = np.stack(products).transpose(1, 0, 2, 3).reshape(-1, n_local**2)  # by point and kind of pair
        kd, depth = self.half_bandwidth, 3 * self.half_bandwidth + 1
        row, across = np.broadcast_arrays(self.gather[:, None, :], self.gather[None, :, :])
        inside = (row < self.n_free) & (across < self.n_free)
        index = np.where(inside, across * depth + 2 * kd + row - across, self.n_free * depth)
        # in the order of :meth:`band`: field, field, element, node, node
        index = index.reshape(n_fields, n_local, n_fields, n_local, -1).transpose(0, 2, 4, 1, 3)
        self._band_index = np.ascontiguousarray(index).ravel()
        signs = np.ones((n_fields * n_local, space.n_elements))
        for place in self._flips:
            signs[place] = -1.0
        self._signs = signs if self._flips else None
        if self._signs is not None:
            both = self._signs[:, None, :] * self._signs[None, :, :]
            self._pair_signs = both.reshape(n_fields, n_local, n_fields, n_local, -1).transpose(0, 2, 4, 1, 3).reshape(-1, n_local**2)

    def _pair_map(self, turn: Array) -> sparse.csr_matrix:
        """From second derivatives at the angles to those by values and slopes of the fields, averaged over the angles."""
        n_angles, size = turn.shape[1:]
        rows, columns, entries = [], [], []
        rank = np.arange(size * size).reshape(size, size)
        for p, (i, j) in enumerate(LOCAL_PAIRS):
            product = np.einsum("tk,tl->tkl", turn[i], turn[j])
            product = product if i == j else product + product.transpose(0, 2, 1)
            where = np.nonzero(product)
            rows.append(rank[where[1], where[2]])
            columns.append(p * n_angles + where[0])
            entries.append(product[where] / n_angles)
        shape = (size * size, len(LOCAL_PAIRS) * n_angles)
        return sparse.csr_matrix((np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))), shape=shape)

    def local(self, x: Array) -> Array:
        """Coefficients in the elements, shape (n_fields, degree + 1, n_elements)."""
        found = np.append(x, 0.0)[self.gather]
        if self._signs is not None:
            found *= self._signs
        return found.reshape(len(self.fields), -1, self.space.n_elements)

    def at_points(self, x: Array) -> Array:
        """What the unknowns add to the local variables, shape (9, n_angles, n_quadrature, n_elements)."""
        local, space = self.local(x), self.space
        both = np.stack([self.values @ local, self.slopes @ local], axis=1)
        return (self._turn @ both.reshape(2 * len(self.fields), -1)).reshape(N_LOCAL, -1, *space.R.shape)

    def vector(self, density: Array) -> Array:
        """Integrate derivatives by the local variables, shape (9, n_angles, n_quadrature, n_elements), averaged over the angles."""
        space = self.space
        both = (self._turn_back @ density.reshape(self._turn.shape[0], -1)).reshape(len(self.fields), 2, *space.R.shape)
        local = (self.values.T @ both[:, 0] + self.slopes.T @ both[:, 1]).reshape(-1, space.n_elements)
        if self._signs is not None:
            local *= self._signs
        total: Array = np.bincount(self.gather.ravel(), local.ravel(), self.n_free + 1)  # type: ignore[assignment]  # weighted: floats
        return total[: self.n_free]

    def band(self, density: Array) -> Array:
        """Integrate second derivatives, shape (45, n_angles, n_quadrature, n_elements) in the order of :data:`LOCAL_PAIRS`, in LAPACK
        general band storage, shape (3 kd + 1, n_free)."""
        space, n_fields = self.space, len(self.fields)
        pairs = self._pairs @ density.reshape(self._pairs.shape[1], -1)
        pairs = pairs.reshape(n_fields, 2, n_fields, 2, space.n_quadrature, space.n_elements).transpose(0, 2, 5, 4, 1, 3)
        local = pairs.reshape(n_fields * n_fields * space.n_elements, -1) @ self._products
        if self._signs is not None:
            local *= self._pair_signs
        depth = 3 * self.half_bandwidth + 1
        flat: Array = np.bincount(self._band_index, local.ravel(), self.n_free * depth + 1)  # type: ignore[assignment]  # weighted: floats
        return flat[:-1].reshape(self.n_free, depth).T

    def mass(self, bulk: Array) -> Array:
        """Mass matrix, averaged over the angles, in band storage; ``bulk`` as in :meth:`.Space.mass_band`."""
        density = np.zeros((len(LOCAL_PAIRS), self.angles.size, *bulk.shape))
        for k in range(3):
            density[LOCAL_PAIRS.index((k, k))] = bulk
        return self.band(density)

    def lifted(self, x: Array) -> Array:
        """Unknowns of a displacement without waves."""
        found = np.zeros(self.n_free)
        found[self.without_waves] = x
        return found

    def carried(self, x: Array, onto: Harmonics) -> Array:
        """The unknowns in another number of harmonics: those beyond it are left out, new ones are zero."""
        found = np.zeros(onto.n_free + 1)
        for column, field in enumerate(self.fields):
            if field in onto.fields:
                own, other = self.numbers[:, column], onto.numbers[:, onto.fields.index(field)]
                known = own < self.n_free
                found[other[known]] = x[own[known]]
        return found[:-1]

    def of_mode(self, j: int, numbers: NDArray[np.int64], mode: Array) -> Array:
        """Unknowns of a perturbation with j n waves, from the numbers of its coefficients (a, c, b) at the nodes."""
        found, own = np.zeros(self.n_free + 1), np.append(mode, 0.0)
        for column, (harmonic, field) in enumerate(self.fields):
            if harmonic == j:
                free = self.numbers[:, column] < self.n_free
                if field == AROUND and self._flips:  # c = -a shares the unknown of a
                    free = free & (self.numbers[:, column] != self.numbers[:, column - 1])
                found[self.numbers[free, column]] = own[numbers[free, field]]
        return found[:-1]

    def turned(self, x: Array, odd: Harmonics) -> Array:
        """The odd perturbation that turns a state with waves about the axis: its derivative with respect to theta."""
        found = np.zeros(odd.n_free + 1)
        for column, (j, field) in enumerate(self.fields):
            if (j, field) in odd.fields:
                own, other = self.numbers[:, column], odd.numbers[:, odd.fields.index((j, field))]
                free = (own < self.n_free) & (other < odd.n_free)
                if field == AROUND and self._flips:  # c = -a there, and both have become j n a
                    free &= own != self.numbers[:, column - 1]
                found[other[free]] = j * self.waves * (1.0 if field == AROUND else -1.0) * x[own[free]]
        return found[:-1]

    def sizes(self, x: Array) -> Array:
        """Root mean square of each harmonic over the reference area, shape (K + 1,); of the last ones the error of K follows."""
        local, area = self.local(x), self.space.area_weights
        values = self.values @ local
        found = np.zeros(self.order + 1)
        for column, (j, _) in enumerate(self.fields):
            found[j] += float((area * values[column] ** 2).sum()) * (1.0 if j == 0 else 0.5)
        return np.sqrt(found / area.sum())


@lru_cache(maxsize=32)
def harmonics_of(space: Space, waves: int, order: int, odd: bool = False) -> Harmonics:
    """Of a space, built once."""
    return Harmonics(space, waves, order, odd)
