"""Banded linear algebra (LAPACK, or compiled) for the matrices of one meridian, bordered by one row and one column."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.linalg import blas, lapack
from scipy.sparse.linalg import splu

from ..native import native
from ..potential import Array

if TYPE_CHECKING:
    from .._native import Border, Factor


class BandFactor:
    """Factors of a symmetric band matrix in LAPACK general storage, shape (3 kd + 1, n).

    L U with partial pivoting; compiled, L D L^T, which takes a third of the time, wherever its pivots grow little, and L U elsewhere.
    """

    def __init__(self, band: Array) -> None:
        self.kd = (band.shape[0] - 1) // 3
        self._compiled: Factor | None = None
        module = native()
        if module is not None:
            self._compiled = module.Factor(np.ascontiguousarray(band.T), band.shape[1], self.kd)
            return
        self._lu, self._pivots, info = lapack.dgbtrf(band, self.kd, self.kd)
        if info > 0:  # an exact zero pivot: perturbed at round-off, as inverse iteration does; the bordered solve stays well defined
            diagonal = self._lu[2 * self.kd]
            diagonal[diagonal == 0] = np.finfo(float).eps * (np.abs(band).max() or 1.0)

    def solve(self, right: Array) -> Array:
        """Solution for one or several right-hand sides, shape (n,) or (n, k)."""
        if self._compiled is not None:
            x: Array = np.array(right, dtype=float, order="F")
            self._compiled.solve(x.T)
            return x
        solution, _ = lapack.dgbtrs(self._lu, self.kd, self.kd, right, self._pivots)
        return solution

    def determinant_sign(self) -> int:
        """Sign of the determinant."""
        if self._compiled is not None:
            return self._compiled.determinant_sign()
        swaps = int((self._pivots != np.arange(len(self._pivots))).sum())
        negative = int((self._lu[2 * self.kd] < 0).sum())
        return 1 if (swaps + negative) % 2 == 0 else -1


class BorderedFactor:
    """Solver for a symmetric band matrix K with one border::

        [ K   column ] [ x ]   [ f ]
        [ row^T   d  ] [ y ] = [ g ]

    Mixed block elimination (Govaerts and Pryce, 1993): backward stable even where K itself is singular, as it is at a limit point, at
    the price of one further solve with the factors of K.
    """

    def __init__(self, factor: BandFactor, column: Array, row: Array, corner: float) -> None:
        self._factor, self._column, self._row, self._corner = factor, column, row, corner
        borders = np.empty((len(row), 2), order="F")
        borders[:, 0], borders[:, 1] = row, column
        borders = factor.solve(borders)
        self._v, self._w = borders[:, 0], borders[:, 1]
        self._delta_v = corner - self._v @ column
        self._delta_w = corner - row @ self._w

    def solve(self, f: Array, g: float) -> tuple[Array, float]:
        first = (g - self._v @ f) / self._delta_v
        rest = self._factor.solve(f - first * self._column)
        second = (g - self._corner * first - self._row @ rest) / self._delta_w
        return rest - second * self._w, float(first + second)


class WideBorder:
    """Solver for K with k borders, [K, B; C^T, D], through [K, b; b^T, 0]: regular wherever the whole matrix is, however singular K.

    With x = K_b^-1-part of (f - B y, t), t = b.x is one more unknown and the multiplier of b must vanish: k + 1 dense equations.
    """

    def __init__(self, deflated: BorderedFactor, columns: list[Array], rows: list[Array], corner: Array) -> None:
        zero = np.zeros_like(columns[0])
        self._deflated, self._rows = deflated, np.stack(rows)
        null, gap = deflated.solve(zero, 1.0)
        solved = [deflated.solve(-column, 0.0) for column in columns]
        self._basis = np.stack([null, *(s[0] for s in solved)], axis=1)
        self._matrix = np.empty((len(rows) + 1, len(columns) + 1))
        self._matrix[0] = [gap, *(s[1] for s in solved)]
        self._matrix[1:] = self._rows @ self._basis
        self._matrix[1:, 1:] += corner

    def solve(self, f: Array | None, h: list[float]) -> tuple[Array, Array]:
        """(x, y) for the right-hand side (f, h); None stands for f = 0."""
        first, slack = (np.zeros(len(self._basis)), 0.0) if f is None else self._deflated.solve(f, 0.0)
        small = np.linalg.solve(self._matrix, np.concatenate([[-slack], h - self._rows @ first]))
        return first + self._basis @ small, small[1:]


class CompiledBorder:
    """:class:`BorderedFactor` of the compiled corrector."""

    def __init__(self, border: Border) -> None:
        self._border = border

    def solve(self, f: Array, g: float) -> tuple[Array, float]:
        x = np.empty_like(f)
        return x, self._border.solve(f, g, x)


def band_product(band: Array, half_bandwidth: int, x: Array) -> Array:
    """Symmetric band matrix in LAPACK general storage times a vector."""
    module = native()
    if module is None:
        return blas.dsbmv(half_bandwidth, 1.0, band[half_bandwidth : 2 * half_bandwidth + 1], x)
    y = np.empty(len(x))
    module.product(np.ascontiguousarray(band.T), len(x), half_bandwidth, np.ascontiguousarray(x), y)
    return y


def band_inner(band: Array, half_bandwidth: int, x: Array, y: Array) -> float:
    """x . A y with a symmetric band matrix in LAPACK general storage."""
    module = native()
    if module is None:
        with np.errstate(over="ignore", invalid="ignore"):  # a prediction may be absurd; whoever asked sees it by the size
            return float(x @ band_product(band, half_bandwidth, y))
    return float(module.inner(np.ascontiguousarray(band.T), len(x), half_bandwidth, np.ascontiguousarray(x), np.ascontiguousarray(y)))


def negative_directions(band: Array, half_bandwidth: int, constraint: Array | None = None, compliance: float = 0.0) -> int:
    """Number of negative eigenvalues of K, of K restricted to ``constraint . x = 0``, or of K + constraint constraint^T/compliance.

    An exact count, not a partial spectrum. Compiled, the pivots of an L D L^T without pivoting are counted where their signs are beyond
    doubt. Else a few unknowns are pinned until the rest is positive definite (Cholesky), and the count is
    that of the Schur complement on the pinned ones (Haynsworth's inertia additivity, a block L D L^T). A constraint is one more border
    with corner -compliance <= 0; it carries one negative direction of its own.

    Parameters
    ----------
    band : ndarray, shape (3 kd + 1, n)
        LAPACK general band storage.
    half_bandwidth : int
    constraint : ndarray, shape (n,), optional
    compliance : float
        0 for a rigid constraint; a soft one, such as an enclosed gas, is a spring.
    """
    n, kd = band.shape[1], half_bandwidth
    module = native()
    if module is not None:
        counted = module.inertia(np.ascontiguousarray(band.T), None, constraint, n, kd, compliance, 0.0)
        if counted >= 0:
            return int(counted)
    upper = band[kd : 2 * kd + 1]
    borders = np.zeros((n, 0)) if constraint is None else constraint[:, None]
    # under a constraint one direction of K itself is usually negative already: pinning at once saves a factorisation that fails
    for count in (0, 4, 16, 64, 256, 1024) if constraint is None else (4, 16, 64, 256, 1024):
        pins = _spread(n, count)
        pinned = _pin(upper, count)
        factor, info = lapack.dpbtrf(pinned)
        if info == 0:
            coupling = _columns(band, kd, count)
            corner = coupling[pins].copy()
            coupling[pins] = 0.0
            free = borders.copy()
            free[pins] = 0.0
            right = np.concatenate([coupling, free], axis=1)
            if right.shape[1] == 0:
                return 0
            schur = -right.T @ lapack.dpbtrs(factor, right)[0]
            k = len(pins)
            schur[:k, :k] += corner
            schur[:k, k:] += borders[pins]
            schur[k:, :k] += borders[pins].T
            schur[k:, k:] -= compliance
            size = np.abs(np.diag(schur))
            unit = 1 / np.sqrt(np.where(size > 0, size, 1.0))  # a congruence: u and w of a nearly flat membrane differ by many decades
            schur *= np.outer(unit, unit)
            zero = -np.finfo(float).eps * len(schur)  # directions without stiffness, of the flat unloaded disc, are not negative ones
            return int((np.linalg.eigvalsh(schur) < zero).sum()) - borders.shape[1]
        if count >= n:
            break
    return _sparse_count(band, kd, constraint, compliance)


@lru_cache(maxsize=64)
def _spread(n: int, count: int) -> np.ndarray:
    """Unknowns to pin, spread evenly; the first ones belong to the pole.

    Many are pinned in pairs of neighbours, u and w of one node: evenly spaced ones may all be of one kind, and leave the other free.
    """
    if count <= 4:
        return np.unique(np.linspace(0, n - 1, 2 * count + 1)[:-1:2].astype(int)) if count else np.zeros(0, dtype=int)
    first = np.linspace(0, n - 1, count + 1)[:-1:2].astype(int)
    return np.unique(np.clip(np.concatenate([first, first + 1]), 0, n - 1))


@lru_cache(maxsize=64)
def _couplings(n: int, kd: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows i and columns j of the entries within the band of the columns of the pins, and which pin each belongs to."""
    pins = _spread(n, count)
    i = pins + np.arange(-kd, kd + 1)[:, None]
    inside = (i >= 0) & (i < n)
    which = np.broadcast_to(np.arange(len(pins)), i.shape)[inside]
    return i[inside], pins[which], which


def _pin(upper: Array, count: int) -> Array:
    """Upper band storage with the rows and columns of the pins replaced by those of the identity."""
    if not count:
        return upper
    pinned, kd, n = upper.copy(order="F"), upper.shape[0] - 1, upper.shape[1]
    i, j, _ = _couplings(n, kd, count)
    low, high = np.minimum(i, j), np.maximum(i, j)
    pinned[kd + low - high, high] = 0.0
    pinned[kd, _spread(n, count)] = 1.0
    return pinned


def _columns(band: Array, kd: int, count: int) -> Array:
    """Dense columns of a band matrix at the pins."""
    n = band.shape[1]
    i, j, which = _couplings(n, kd, count)
    dense = np.zeros((n, len(_spread(n, count))))
    dense[i, which] = band[2 * kd + i - j, j]
    return dense


def _sparse_count(band: Array, kd: int, constraint: Array | None, compliance: float) -> int:
    """Count by sparse L D L^T without pivoting, for matrices with very many negative directions."""
    n = band.shape[1]
    matrix = sparse.dia_array((band[kd:], np.arange(kd, -kd - 1, -1)), shape=(n, n)).tocsc()
    try:
        lu = splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:  # exactly singular: directions without stiffness, such as those of the flat unloaded disc, are not negative ones
        nudge = np.finfo(float).eps * np.abs(band).max() * sparse.eye_array(n, format="csc")
        lu = splu(matrix + nudge, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    count = int((lu.U.diagonal() < 0).sum())
    if constraint is None:
        return count
    return count + int(-compliance - constraint @ lu.solve(constraint) < 0) - 1
