"""Kernels in NumPy and LAPACK."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import blas, lapack
from scipy.sparse.linalg import splu

from ..discretization.space import HESSIAN_PAIRS, Space
from .bordered import BorderedFactor
from .interface import N_FORCE, N_STIFFNESS, N_SUMS, Answer, Array, Border, Pencil, PointFunction, Rayleigh, Step


class NumpyKernels:
    """The implementation that is always there."""

    name = "NumPy"

    def elements(self, space: Space, point: PointFunction) -> NumpyElements:
        return NumpyElements(space, point)

    def factor(self, band: Array) -> NumpyFactor:
        return NumpyFactor(band)

    def product(self, band: Array, half_bandwidth: int, x: Array) -> Array:
        return blas.dsbmv(half_bandwidth, 1.0, band[half_bandwidth : 2 * half_bandwidth + 1], x)

    def inner(self, band: Array, half_bandwidth: int, x: Array, y: Array) -> float:
        with np.errstate(over="ignore", invalid="ignore"):  # a prediction may be absurd; the caller sees it by the size
            return float(x @ self.product(band, half_bandwidth, y))

    def inertia(self, band: Array, half_bandwidth: int, constraint: Array | None, compliance: float) -> int:
        """A few unknowns are pinned until the rest is positive definite (Cholesky). The negative eigenvalues are then counted in the Schur
        complement on the pinned unknowns (Haynsworth's inertia additivity, a block L D L^T).
        """
        return _pinned_count(band, half_bandwidth, constraint, compliance)

    def rayleigh(self, pencil: Pencil, guess: Array, tolerances: Rayleigh) -> tuple[float, Array, float] | None:
        found = pencil.rayleigh(guess)
        return None if found is None or pencil.below(*found[:2]) > 0 else found


class NumpyElements:
    """Elements by matrix products over all of them, and sums over the unknowns that they share."""

    name = NumpyKernels.name

    def __init__(self, space: Space, point: PointFunction) -> None:
        self._space, self._point = space, point
        self._force_shape = (2, 4 * space.n_quadrature, space.n_elements)

    def at_quadrature(self, x: Array) -> Array:
        return self._space.at_quadrature(x)

    def evaluate(self, x: Array, pressure: float, factor: float, *more: float) -> Answer:
        out = self._point.replay(self._space.at_quadrature(x), np.array([pressure, factor, *more]))
        densities = out[N_SUMS:]
        with np.errstate(invalid="ignore", over="ignore"):  # outside the domain of the energy the answer is NaN, which the caller judges
            elastic, magnetic, volume = out[:N_SUMS].sum(axis=1).tolist()
            gradients = self._space.assemble_vectors(densities[:N_FORCE].reshape(self._force_shape))
            forces = np.concatenate([gradients, [pressure * gradients[1] - gradients[0]]])
        finite = bool(np.isfinite(gradients).all() and np.isfinite(densities[N_FORCE : N_FORCE + N_STIFFNESS]).all())
        return elastic, magnetic, volume, finite, forces, densities

    def assemble(self, densities: Array) -> Array:
        stiffness = densities[N_FORCE : N_FORCE + N_STIFFNESS]
        with np.errstate(invalid="ignore"):
            return self._space.assemble_band(stiffness.reshape(-1, self._space.n_elements))

    def border(self, densities: Array, volume_gradient: Array, row: Array, corner: float) -> Border:
        return BorderedFactor(NumpyFactor(self.assemble(densities)), -volume_gradient, row, corner)

    def step(self, densities: Array, forces: Array, row: Array, corner: float, gap: float, x: Array) -> Step:
        border = self.border(densities, forces[1], row, corner)
        dx, dp = border.solve(forces[2], -gap)
        return border, dx, dp, self.largest(dx), self.largest(x)

    def largest(self, x: Array) -> tuple[float, float]:
        u, w = (float(np.abs(x[index]).max(initial=0.0)) for index in self._space.fields)
        return u if u < np.inf else np.inf, w if w < np.inf else np.inf

    def force_scale(self, densities: Array, pressure: float) -> tuple[float, float]:
        density = np.abs(densities[:N_FORCE]).reshape(self._force_shape)
        return self.largest(self._space.assemble_magnitude(density[0] + abs(pressure) * density[1]))

    def kinks(self, space: Space, x: Array) -> Array:
        return space.kinks(x)

    def form_parts(self, densities: Array, x: Array, weights: Array) -> tuple[float, float]:
        shape = self._space.s.shape
        local = self._space.at_quadrature(x).reshape(4, *shape)
        return form_parts(densities[N_FORCE : N_FORCE + N_STIFFNESS].reshape(-1, *shape), HESSIAN_PAIRS, local, weights)


def form_parts(density: Array, pairs: tuple[tuple[int, int], ...], local: Array, weights: Array) -> tuple[float, float]:
    """:meth:`.interface.Elements.form_parts` for local variables of any number.

    Parameters
    ----------
    density : ndarray, shape (len(pairs), n_quadrature, n_elements)
        Second derivatives with respect to pairs of local variables, times the weights of the integral.
    pairs : tuple of (int, int)
    local : ndarray, shape (n_variables, n_quadrature, n_elements)
    weights : ndarray, shape (n_quadrature,)
    """
    first, second, times = _indices(pairs)
    products = local.take(first, axis=0)
    products *= local.take(second, axis=0)
    products *= density
    weighed = np.abs(weights @ np.tensordot(times, products, 1)).sum()
    return float(weighed), float(times @ np.abs(products).sum(axis=(1, 2)))


@lru_cache(maxsize=8)
def _indices(pairs: tuple[tuple[int, int], ...]) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """First and second of each pair, and how often it counts in a quadratic form."""
    first, second = np.array(pairs).T
    return first, second, np.where(first == second, 1.0, 2.0)


class NumpyFactor:
    """L U with partial pivoting (LAPACK)."""

    def __init__(self, band: Array) -> None:
        self._kd = (band.shape[0] - 1) // 3
        self._lu, self._pivots, info = lapack.dgbtrf(band, self._kd, self._kd)
        if info > 0:  # an exact zero pivot: perturbed at round-off, as inverse iteration does; the bordered solve stays well defined
            diagonal = self._lu[2 * self._kd]
            diagonal[diagonal == 0] = np.finfo(float).eps * (np.abs(band).max() or 1.0)

    def solve(self, right: Array) -> Array:
        solution, _ = lapack.dgbtrs(self._lu, self._kd, self._kd, right, self._pivots)
        return solution

    def determinant_sign(self) -> int:
        swaps = int((self._pivots != np.arange(len(self._pivots))).sum())
        negative = int((self._lu[2 * self._kd] < 0).sum())
        return 1 if (swaps + negative) % 2 == 0 else -1


def _pinned_count(band: Array, kd: int, constraint: Array | None, compliance: float) -> int:
    """Number of negative directions by pinning; a constraint is one more border with corner -compliance <= 0."""
    n = band.shape[1]
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
    """Unknowns to pin, spread evenly. The first of them belong to the pole.

    Many unknowns are pinned in pairs, u and w of one node: evenly spaced unknowns may all be of one kind, and leave the other kind free.
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
    """Upper band storage with the rows and columns of the pins replaced by rows and columns of the identity."""
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
    except RuntimeError:  # exactly singular: directions without stiffness, as the flat unloaded disc has them, are not negative
        nudge = np.finfo(float).eps * (np.abs(band).max() or 1.0) * sparse.eye_array(n, format="csc")
        lu = splu(matrix + nudge, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    count = int((lu.U.diagonal() < 0).sum())
    if constraint is None:
        return count
    return count + int(-compliance - constraint @ lu.solve(constraint) < 0) - 1
