"""No answer hangs on the unit of length: the same balloon from a file in another unit is the same balloon.

Its points times a have P/a, V a^3, heights times a, energies times a^2 and eigenvalues over a^2; a dipole's strength goes as a^6 (M is
mu0 D^2/(R0^6 mu)), the susceptibility as before.
"""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm

UNITS = (1e-6, 1e-3, 25.0, 1e3, 1e6)


def points(a: float, cells: int = 12) -> fm.Curve:
    """An egg, clamped at no end, on the axis at both."""
    angles = np.linspace(0, np.pi, 2 * cells + 1)
    R = np.sin(np.minimum(angles, np.pi - angles))
    Z = np.cos(angles) * (1 + 0.1 * np.cos(angles))
    lines = [[2 * k, 2 * k + 2, 2 * k + 1] for k in range(cells)]
    return fm.meridian_from_points(a * np.column_stack([R, Z]), lines)


def bowl(a: float, cells: int = 12) -> fm.Curve:
    """A dome over a clamped rim."""
    s = np.linspace(0, 1, 2 * cells + 1)
    lines = [[2 * k, 2 * k + 2, 2 * k + 1] for k in range(cells)]
    return fm.meridian_from_points(a * np.column_stack([s, 0.4 * (1 - s**2)]), lines)


def balloon(a: float) -> fm.Scene:
    return fm.Scene(material=fm.MooneyRivlin(0.1), mesh=points(a))


def magnetic(a: float) -> fm.Scene:
    return fm.Scene(material=fm.NeoHookean(), mesh=bowl(a), sources=[fm.Dipole(2.0 * a**6, 4.0 * a)], susceptibility=1.0)


@pytest.mark.parametrize("a", UNITS)
@pytest.mark.parametrize("scene", [balloon, magnetic])
def test_every_control(scene, a: float) -> None:
    volume = 1.5 * abs(float(fm.equilibrium(scene(1.0), pressure=0.01).volume))
    for solver in ("ipopt", "newton"):
        one, other = (fm.equilibrium(scene(b), volume=volume * b**3, solver=solver) for b in (1.0, a))
        assert (other.pressure * a, other.center_height / a, other.energy / a**2) == pytest.approx(
            (one.pressure, one.center_height, one.energy), rel=1e-9
        )
        for n in (0, 1, 2):
            verdicts = [eq.verdict("volume") if n == 0 else eq.verdict(azimuthal=n) for eq in (one, other)]
            assert verdicts[0].stable is verdicts[1].stable
            assert verdicts[1].smallest_eigenvalue * a**2 == pytest.approx(verdicts[0].smallest_eigenvalue, rel=1e-6, abs=1e-7)
    at = fm.equilibrium(scene(a), pressure=one.pressure / a, solver="newton")
    assert at.pressure * a == pytest.approx(one.pressure, rel=1e-12)


@pytest.mark.parametrize("a", [1e-6, 25.0])
def test_all_states_at_a_pressure(a: float) -> None:
    one, other = (fm.equilibria(balloon(b), pressure=1.17 / b, max_steps=150) for b in (1.0, a))
    assert len(one) == len(other) == 3
    assert [eq.volume / a**3 for eq in other] == pytest.approx([eq.volume for eq in one], rel=1e-8)


@pytest.mark.parametrize("a", UNITS)
@pytest.mark.parametrize("scene", [balloon, magnetic])
def test_points_of_a_branch_correspond_one_to_one(scene, a: float) -> None:
    first = float(fm.equilibrium(scene(1.0), pressure=0.2).volume)
    one, other = (fm.trace(scene(b), start=first * b**3, until={"volume": 4 * first * b**3}) for b in (1.0, a))
    assert one.status is other.status is fm.Status.CONVERGED
    assert len(one) == len(other)
    assert other.column("volume") / a**3 == pytest.approx(one.column("volume"), rel=1e-7)
    assert other.column("pressure") * a == pytest.approx(one.column("pressure"), rel=1e-7)
    assert [p.kind for p in other.special_points] == [p.kind for p in one.special_points]
    for p, q in zip(one.special_points, other.special_points, strict=True):
        assert (q.volume / a**3, q.pressure * a) == pytest.approx((p.volume, p.pressure), rel=1e-8)


def test_a_cap_that_is_nearly_a_sphere_has_all_its_states() -> None:
    """Height 40 over a rim of 1: a balloon of radius 20, with as many states at the same P R as the sphere."""
    for scene, size in ((fm.Scene(material=fm.MooneyRivlin(0.1), mesh=fm.sphere(24)), 1.0),
                        (fm.Scene(material=fm.MooneyRivlin(0.1), mesh=fm.cap(40.0, 48, ratio=0.05)), 20.0125)):  # fmt: skip
        assert len(fm.equilibria(scene, pressure=1.2 / size)) == 3
