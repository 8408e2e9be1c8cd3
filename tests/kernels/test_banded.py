"""Banded linear algebra against dense."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import null_space

from femmembrane.kernels import in_numpy, numpy_kernels
from femmembrane.solve.banded import BandFactor, BorderedFactor, band_product, negative_directions

seeds = st.integers(0, 10**6)


def to_band(matrix: np.ndarray, kd: int) -> np.ndarray:
    n = len(matrix)
    band = np.zeros((3 * kd + 1, n), order="F")
    for i in range(n):
        for j in range(max(0, i - kd), min(n, i + kd + 1)):
            band[2 * kd + i - j, j] = matrix[i, j]
    return band


def random_matrix(seed: int, n: int, kd: int, shift: float = 0.0) -> np.ndarray:
    a = np.random.default_rng(seed).normal(size=(n, n))
    a = a + a.T
    a[np.abs(np.subtract.outer(np.arange(n), np.arange(n))) > kd] = 0
    return a + shift * np.eye(n)


def bordered(matrix, column, row, corner):
    return np.block([[matrix, column[:, None]], [row[None, :], np.array([[corner]])]])


def relative_error(found, exact):
    return np.abs(np.append(*found) - exact).max() / np.abs(exact).max()


@given(seeds, st.integers(1, 5), st.floats(-2, 2))
@settings(max_examples=50, deadline=None)
def test_bordered_solve(seed, kd, corner):
    n, rng = 25, np.random.default_rng(seed)
    matrix = random_matrix(seed, n, kd)
    column, row = rng.normal(size=(2, n))
    full = bordered(matrix, column, row, corner)
    exact = rng.normal(size=n + 1)
    found = BorderedFactor(BandFactor(to_band(matrix, kd)), column, row, corner).solve(full[:n] @ exact, full[n] @ exact)
    # backward stable: the error follows from the condition of the bordered matrix
    assert relative_error(found, exact) < 1e-13 * np.linalg.cond(full)


@given(seeds, st.sampled_from([0.0, 1e-16, 1e-14, 1e-12, 1e-9, 1e-6, 1e-3, 1.0]))
@settings(max_examples=80, deadline=None)
def test_bordered_solve_at_a_singular_matrix(seed, distance):
    """As at a limit point: K singular to within ``distance`` while the bordered matrix is well conditioned keeps 12 digits."""
    n, kd, rng = 25, 3, np.random.default_rng(seed)
    matrix = random_matrix(seed, n, kd)
    values, vectors = np.linalg.eigh(matrix)
    k = int(np.argmin(np.abs(values)))
    matrix = matrix + (distance - values[k]) * np.eye(n)
    mode = vectors[:, k]
    column, row = mode + 0.3 * rng.normal(size=(2, n))
    full = bordered(matrix, column, row, 0.5)
    exact = rng.normal(size=n + 1)
    found = BorderedFactor(BandFactor(to_band(matrix, kd)), column, row, 0.5).solve(full[:n] @ exact, full[n] @ exact)
    assert relative_error(found, exact) < 1e-14 * max(np.linalg.cond(full), 100)


@pytest.mark.parametrize("zero", [0, 7, 19])
def test_bordered_solve_at_an_exactly_singular_matrix(zero):
    """A pivot that is exactly zero: a decoupled unknown without stiffness."""
    n, kd, rng = 20, 3, np.random.default_rng(zero)
    matrix = random_matrix(1, n, kd, shift=8.0)
    matrix[zero, :] = matrix[:, zero] = 0
    assert np.linalg.matrix_rank(matrix) == n - 1
    column, row = rng.normal(size=(2, n))
    full = bordered(matrix, column, row, 0.0)
    exact = rng.normal(size=n + 1)
    found = BorderedFactor(BandFactor(to_band(matrix, kd)), column, row, 0.0).solve(full[:n] @ exact, full[n] @ exact)
    assert relative_error(found, exact) < 1e-12


def test_several_right_hand_sides():
    matrix = random_matrix(3, 20, 2, shift=5.0)
    right = np.random.default_rng(3).normal(size=(20, 4))
    assert matrix @ BandFactor(to_band(matrix, 2)).solve(right) == pytest.approx(right, abs=1e-11)


@given(seeds, st.integers(1, 6))
@settings(max_examples=30, deadline=None)
def test_product(seed, kd):
    matrix, x = random_matrix(seed, 15, kd), np.random.default_rng(seed).normal(size=15)
    assert band_product(to_band(matrix, kd), kd, x) == pytest.approx(matrix @ x, abs=1e-12)


def counted(matrix: np.ndarray, constraint: np.ndarray | None = None) -> int:
    if constraint is not None:
        basis = null_space(constraint[None, :])
        matrix = basis.T @ matrix @ basis
    return int((np.linalg.eigvalsh(matrix) < 0).sum())


@given(seeds, st.integers(1, 5), st.floats(-3, 12), st.booleans())
@settings(max_examples=150, deadline=None)
def test_negative_directions(seed, kd, shift, constrained):
    """Any inertia, from none to nearly all negative, so that no number of pins is enough at once."""
    n = 30
    matrix = random_matrix(seed, n, kd, shift)
    constraint = np.random.default_rng(seed + 1).normal(size=n) if constrained else None
    assert negative_directions(to_band(matrix, kd), kd, constraint) == counted(matrix, constraint)


@pytest.mark.parametrize("constrained", [False, True])
@pytest.mark.parametrize("negative", [0, 1, 3, 5, 20, 70, 150, 297])
def test_more_negative_directions_than_pins(negative, constrained):
    """Decoupled blocks whose count is known, in a matrix large enough for 4, 16 and 64 pins to fail."""
    n, kd = 300, 3
    matrix = 0.01 * random_matrix(0, n, kd)
    where = np.random.default_rng(2).permutation(n)[:negative]
    matrix += np.diag(np.where(np.isin(np.arange(n), where), -1.0, 1.0))
    constraint = np.random.default_rng(3).normal(size=n) if constrained else None
    found = negative_directions(to_band(matrix, kd), kd, constraint)
    assert found == counted(matrix, constraint)
    assert constrained or found == negative


@pytest.mark.parametrize("constrained", [False, True])
def test_sparse_fallback(constrained, monkeypatch):
    """When no pins leave a positive definite rest, a sparse factorisation counts; forced here by pinning nothing."""
    monkeypatch.setattr(numpy_kernels, "_spread", lambda n, count: np.zeros(0, dtype=int))
    for seed in range(20):
        n, kd = 40, 3
        matrix = random_matrix(seed, n, kd, shift=seed / 4 - 2)
        constraint = np.random.default_rng(seed).normal(size=n) if constrained else None
        with in_numpy():
            assert negative_directions(to_band(matrix, kd), kd, constraint) == counted(matrix, constraint)


@pytest.mark.parametrize("constrained", [False, True])
@pytest.mark.parametrize("scale", [1e-4, 1e-9, 1e-12])
def test_count_does_not_depend_on_units(scale, constrained):
    """Every second unknown in other units (as u and w of a nearly flat membrane are): a congruence leaves the inertia alone."""
    n, kd = 40, 3
    units = np.where(np.arange(n) % 2, scale, 1.0)
    for seed in range(20):
        matrix = random_matrix(seed, n, kd, shift=seed / 2)
        constraint = np.random.default_rng(seed).normal(size=n) if constrained else None
        expected = counted(matrix, constraint)
        scaled = None if constraint is None else constraint * units
        assert negative_directions(to_band(matrix * np.outer(units, units), kd), kd, scaled) == expected
