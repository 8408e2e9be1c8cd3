"""Banded linear algebra for the matrices of one meridian, bordered by one row and one column."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kernels import kernels
from ..kernels.bordered import BorderedFactor as BorderedFactor
from ..kernels.interface import Array, Factor

if TYPE_CHECKING:
    from ..potential import Evaluation


class BandFactor:
    """Factors of a symmetric band matrix in LAPACK general storage, shape (3 kd + 1, n)."""

    _factor: Factor

    def __init__(self, band: Array) -> None:
        self._factor = kernels().factor(band)

    @classmethod
    def of(cls, evaluation: Evaluation) -> BandFactor:
        """Factors of E'' - P V'' at a state, what a spring adds to the band included."""
        new = object.__new__(cls)
        new._factor = evaluation.factors()
        return new

    def solve(self, right: Array) -> Array:
        """Solution for one or several right-hand sides, shape (n,) or (n, k)."""
        return self._factor.solve(right)

    def determinant_sign(self) -> int:
        """Sign of the determinant."""
        return self._factor.determinant_sign()


def negative_among(evaluation: Evaluation, constraint: Array | None = None) -> int:
    """Number of negative eigenvalues of E'' - P V'' at a state, restricted to ``constraint . x = 0`` if one is given."""
    if constraint is None:
        return evaluation.negative
    kd, constraint = evaluation.potential.space.half_bandwidth, evaluation.reduced(constraint)
    if evaluation.spring is None:
        return negative_directions(evaluation.band, kd, constraint)
    spring = evaluation.reduced(evaluation.spring)
    return bordered_count(evaluation.band, kd, np.column_stack([spring, constraint]), np.array([-1.0, 0.0]))


def bordered_count(band: Array, half_bandwidth: int, borders: Array, corners: Array) -> int:
    """Number of negative directions of K with borders: springs a a^T/c with a corner -c < 0, and rigid constraints with a corner 0.

    By Haynsworth's additivity: the inertia of K and of the dense complement of the borders, less one of each border's own.
    """
    schur = np.diag(corners) - borders.T @ BandFactor(band).solve(np.asfortranarray(borders))
    own = int((corners <= 0).sum())
    return negative_directions(band, half_bandwidth) + int((np.linalg.eigvalsh((schur + schur.T) / 2) < 0).sum()) - own


class WideBorder:
    """Solver for K with k borders, [K, B; C^T, D], through [K, b; b^T, 0]. It is regular wherever the whole matrix is, even where K is
    singular.

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

    def determinant_sign(self) -> int:
        """Sign of the determinant over that of [K, b; b^T, 0], up to one that depends on k alone."""
        return int(np.linalg.slogdet(self._matrix)[0])

    def solve(self, f: Array | None, h: list[float]) -> tuple[Array, Array]:
        """(x, y) for the right-hand side (f, h); None stands for f = 0."""
        first, slack = (np.zeros(len(self._basis)), 0.0) if f is None else self._deflated.solve(f, 0.0)
        small = np.linalg.solve(self._matrix, np.concatenate([[-slack], h - self._rows @ first]))
        return first + self._basis @ small, small[1:]


def band_product(band: Array, half_bandwidth: int, x: Array) -> Array:
    """Symmetric band matrix in LAPACK general storage times a vector."""
    return kernels().product(band, half_bandwidth, x)


def band_inner(band: Array, half_bandwidth: int, x: Array, y: Array) -> float:
    """x . A y with a symmetric band matrix in LAPACK general storage."""
    return kernels().inner(band, half_bandwidth, x, y)


def negative_directions(band: Array, half_bandwidth: int, constraint: Array | None = None, compliance: float = 0.0) -> int:
    """Number of negative eigenvalues of K, of K restricted to ``constraint . x = 0``, or of K + constraint constraint^T/compliance.

    The count is exact, by inertia. A constraint is one more border with corner -compliance <= 0, which adds one negative direction of its
    own.

    Parameters
    ----------
    band : ndarray, shape (3 kd + 1, n)
        LAPACK general band storage.
    half_bandwidth : int
    constraint : ndarray, shape (n,), optional
    compliance : float
        0 for a rigid constraint; a soft one, such as an enclosed gas, is a spring.
    """
    return kernels().inertia(band, half_bandwidth, constraint, compliance)
