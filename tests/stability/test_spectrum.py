"""Smallest eigenvalue of the second variation against a dense eigensolver, on real states and from bad guesses."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.linalg import eigh, null_space

import femmembrane as fm
from femmembrane.solve.banded import negative_directions
from femmembrane.stability.spectrum import smallest_eigenvalue
from femmembrane.stability.verdict import axisymmetric_verdict
from tests.cases import CONTROLS, POINTS
from tests.kernels.test_banded import random_matrix, to_band
from tests.potential.test_potential import dense

BY_NAME = {point.name: point for point in POINTS}
#: stable under both controls, unstable under pressure alone, unstable under both, and a nearly flat membrane
STATES = (
    "neo_hookean_disc-1",
    "neo_hookean_disc-4",
    "ogden_disc-2",
    "dipole_above-4.7",
    "dipole_above-4.9",
    "dipole_above-5",
    "dipole_below-0.3",
    "dipole_below-1",
    "ogden_disc-0.1",
)


@cache
def pencil(name: str):
    """Potential, evaluation and dense spectra (all eigenvalues with modes) under both controls of a state with 24 elements."""
    point = BY_NAME[name]
    scene = point.scene.replace(mesh=fm.disc(elements=24))
    start = fm.equilibrium(scene, volume=min(point.expected["volume"], 75.0), solver="newton")
    eq = fm.equilibrium(scene, center_height=point.expected["center_height"], start=start)
    potential = eq.potential
    evaluation = potential.evaluate(eq.state, eq.pressure)
    K, M = dense(potential, evaluation.band), dense(potential, potential.mass)
    spectra = {"pressure": eigh(K, M)}
    basis = null_space(evaluation.volume_gradient[None, :])
    values, modes = eigh(basis.T @ K @ basis, basis.T @ M @ basis)
    spectra["volume"] = values, basis @ modes
    return potential, evaluation, M, spectra


def solve(name, control, guess=None):
    potential, evaluation, _, _ = pencil(name)
    constraint = evaluation.volume_gradient if control == "volume" else None
    return smallest_eigenvalue(evaluation.band, potential.mass, potential.space.half_bandwidth, constraint, guess)


def assert_is_smallest(found, name, control):
    _, evaluation, M, spectra = pencil(name)
    values, modes = spectra[control]
    # the dense solver's own error is of the order of round-off of the largest eigenvalue
    assert found.value == pytest.approx(values[0], rel=1e-8, abs=1e-13 * values[-1])
    assert found.negative == (values < 0).sum()
    assert abs(found.mode @ M @ modes[:, 0]) == pytest.approx(1, abs=1e-6)
    assert found.error < 1e-6 * abs(values[0])
    if control == "volume":
        gradient = evaluation.volume_gradient
        assert abs(found.mode @ gradient) < 1e-9 * np.linalg.norm(gradient) * np.linalg.norm(found.mode)


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("name", STATES)
def test_against_dense(name, control):
    assert_is_smallest(solve(name, control), name, control)


def test_states_cover_all_inertias():
    """Numbers of negative directions (pressure, volume): stable, unstable under pressure alone, unstable under both."""
    assert {tuple(int((pencil(name)[3][c][0] < 0).sum()) for c in CONTROLS) for name in STATES} == {(0, 0), (1, 0), (1, 1)}


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("name", STATES)
@pytest.mark.parametrize("kind", ["second mode", "orthogonal", "highest mode", "noise", "constraint", "one unknown"])
def test_bad_guess_gives_no_wrong_answer(kind, name, control):
    potential, evaluation, M, spectra = pencil(name)
    modes = spectra[control][1]
    noise = np.random.default_rng(0).normal(size=modes.shape[0])
    guess = {
        "second mode": modes[:, 1],
        # no component of the mode that is sought: Rayleigh quotient iteration alone would never find it
        "orthogonal": noise - modes[:, 0] * (modes[:, 0] @ M @ noise),
        "highest mode": modes[:, -1],
        "noise": noise,
        "constraint": evaluation.volume_gradient,
        "one unknown": np.eye(len(noise))[potential.space.n_free // 2],
    }[kind]
    assert_is_smallest(solve(name, control, guess), name, control)


@pytest.mark.parametrize("control", CONTROLS)
def test_good_guess_gives_the_same_answer(control):
    for name in STATES:
        cold = solve(name, control)
        warm = solve(name, control, cold.mode)
        assert warm.value == pytest.approx(cold.value, rel=1e-9)


@pytest.mark.parametrize("constrained", [False, True])
@pytest.mark.parametrize("seed", range(12))
def test_random_pencils(seed, constrained):
    """Matrices without the structure of a membrane, many directions negative."""
    n, kd = 40, 3
    K, M = random_matrix(seed, n, kd), random_matrix(seed + 100, n, kd) * 0.05 + np.eye(n)
    constraint = np.random.default_rng(seed + 50).normal(size=n) if constrained else None
    basis = np.eye(n) if constraint is None else null_space(constraint[None, :])
    values = eigh(basis.T @ K @ basis, basis.T @ M @ basis, eigvals_only=True)
    found = smallest_eigenvalue(to_band(K, kd), to_band(M, kd), kd, constraint)
    assert found.value == pytest.approx(values[0], rel=1e-9)
    assert found.negative == (values < 0).sum()


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("name", STATES)
def test_verdict_says_what_the_spectrum_says(name, control):
    potential, evaluation, _, spectra = pencil(name)
    verdict = axisymmetric_verdict(potential, evaluation, control)
    values = spectra[control][0]
    assert verdict.stable is bool(values[0] > 0)
    assert (verdict.control, verdict.azimuthal) == (control, 0)
    assert ("stable: energy rises" if values[0] > 0 else f"falls in {(values < 0).sum()} direction") in verdict.reason
    constraint = evaluation.volume_gradient if control == "volume" else None
    assert negative_directions(evaluation.band, potential.space.half_bandwidth, constraint) == (values < 0).sum()


def test_volume_control_is_never_the_less_stable_one():
    """A constraint raises the smallest eigenvalue (Rayleigh), and removes at most one negative direction (Cauchy)."""
    for name in STATES:
        free, held = (pencil(name)[3][control][0] for control in CONTROLS)
        assert held[0] >= free[0]
        assert (free < 0).sum() - 1 <= (held < 0).sum() <= (free < 0).sum()


def test_compression_has_no_eigenvalue():
    """Where the meridional stress is compressive the spectrum runs to minus infinity under refinement: a reason, not a number."""
    potential, _, _, _ = pencil("ogden_disc-2")
    space = potential.space
    s = space.interpolation_points()
    # lambda_1 = 1 + 0.3 (1 - 2 r) falls below 1 for r > 1/2 while lambda_2 = 1 + 0.3 (1 - r) stays above: compression near the rim
    pushed = potential.evaluate(space.interpolate(0.3 * s * (1 - s), np.zeros_like(s)), 0.0)
    for control in CONTROLS:
        verdict = axisymmetric_verdict(potential, pushed, control)
        assert verdict.stable is False
        assert np.isnan(verdict.smallest_eigenvalue)
        assert "short-wave" in verdict.reason
    # where it fails is read off the Hencky strains: e_2 = -2 e_1 is zero meridional stress
    r = np.linspace(0.01, 1, 2000)
    compressed = r[np.array(potential.scene.material.stress(np.log(1 + 0.3 * (1 - 2 * r)), np.log(1 + 0.3 * (1 - r))))[0] < 0]
    assert f"r in [{compressed.min():.1g}" in verdict.reason
    assert "1]" in verdict.reason or "0.99" in verdict.reason
