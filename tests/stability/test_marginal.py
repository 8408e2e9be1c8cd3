"""Marginal states: an eigenvalue counts as zero within its error, discretisation included."""

import numpy as np
import pytest

import femmembrane as fm
from tests.cases import OGDEN, disc_scene


@pytest.fixture(scope="module")
def limit_points():
    branch = fm.trace(disc_scene(OGDEN, elements=64), start=1.0, until={"volume": 30.0})
    return [point.equilibrium for point in branch.special_points if point.kind == "limit_point"]


def test_limit_points_are_marginal_under_pressure_and_stable_under_volume(limit_points):
    """At dP = 0 the smallest eigenvalue under pressure control vanishes; under volume control tests/data/disc.json has it."""
    assert len(limit_points) == 2
    for eq, under_volume in zip(limit_points, (10.073688557, 7.075426334), strict=True):
        verdict = eq.verdict("pressure")
        assert verdict.stable is None
        assert abs(verdict.smallest_eigenvalue) < verdict.error < 1e-5
        assert eq.verdict("volume").stable is True
        assert eq.verdict("volume").smallest_eigenvalue == pytest.approx(under_volume, rel=1e-4)


def test_just_beside_a_limit_point_the_sign_is_believed(limit_points):
    """The eigenvalue falls by 4.4 per unit of volume there (recorded on 2026-11-22): 1e-4 is 1000 times its error."""
    scene = limit_points[0].scene
    for step, stable in ((-1e-4, True), (1e-4, False)):
        eq = fm.equilibrium(scene, volume=limit_points[0].volume + step, solver="newton")
        assert eq.verdict("pressure").stable is stable


@pytest.mark.parametrize("step", [-2e-3, 2e-3])
def test_the_error_of_a_small_eigenvalue_holds_that_of_the_mesh(limit_points, step):
    """8.9e-3 and -8.9e-3, which the mesh resolves well: they are off by 1.6e-7, and their algebraic error is 2e-11."""
    eq = fm.equilibrium(limit_points[0].scene, volume=limit_points[0].volume + step, solver="newton")
    verdict = eq.verdict("pressure")
    exact = fm.equilibrium(disc_scene(OGDEN, elements=16, degree=6), volume=eq.volume, solver="newton").verdict("pressure")
    assert abs(exact.smallest_eigenvalue) == pytest.approx(8.86e-3, rel=1e-2)
    assert 1e-8 < abs(verdict.smallest_eigenvalue - exact.smallest_eigenvalue) < verdict.error < 1e-5


def test_flat_unloaded_disc_is_marginal():
    """Its transverse stiffness is zero: neither stable nor unstable, under any control."""
    eq = fm.equilibrium(disc_scene(OGDEN, elements=8), pressure=0.0)
    assert eq.volume == 0.0
    for verdict in (eq.verdict("pressure"), eq.verdict("volume"), eq.verdict(azimuthal=2)):
        assert verdict.stable is None
        assert not np.isnan(verdict.smallest_eigenvalue)


def test_gas_lies_between_pressure_and_volume_control():
    """An enclosed gas stiffens the second variation by V' V'^T/compliance: 0 for a huge chamber, rigid for a tiny one."""
    scene = disc_scene(OGDEN, elements=32)
    eq = fm.equilibrium(scene, volume=5.0)
    loose, stiff = eq.verdict("pressure").smallest_eigenvalue, eq.verdict("volume").smallest_eigenvalue
    between = []
    for chamber in (1e7, 10.0, 1e-3):
        gas = fm.Gas(amount=(eq.pressure + 1.0) * (eq.volume + chamber), chamber=chamber, atmosphere=1.0)
        assert gas.pressure(eq.volume) == pytest.approx(eq.pressure, rel=1e-9)
        between.append(eq.verdict("gas", gas=gas).smallest_eigenvalue)
    assert loose < between[0] < between[1] < between[2] < stiff
    assert between[0] == pytest.approx(loose, abs=1e-4)


def test_gas_control_finds_its_own_pressure():
    scene = disc_scene(OGDEN, elements=32)
    eq = fm.equilibrium(scene, gas=fm.Gas(amount=3.0, chamber=1.0))
    assert eq.pressure * (eq.volume + 1.0) == pytest.approx(3.0, rel=1e-12)
    assert eq.verdict("gas").control == "gas"
    with pytest.raises(fm.InputError, match="gas"):
        fm.equilibrium(scene, volume=1.0).verdict("gas")


def test_a_tension_field_that_is_slack_all_over_is_marginal():
    """Its relaxed energy, nowhere below zero, is zero there and for every other shape that is nowhere longer than the sheet."""
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), degree=3, prestretch=0.9, tension_field=True)
    eq = fm.equilibrium(scene, volume=0.2)
    assert (eq.energy, eq.pressure) == (0.0, 0.0)
    for verdict in (eq.verdict("volume"), eq.verdict("pressure"), eq.verdict(azimuthal=1), eq.verdict(azimuthal=2)):
        assert verdict.stable is None
        assert "slack all over" in verdict.reason
        assert "its shape is not determined" in verdict.reason
    for waves in (0, 1):
        with pytest.raises(fm.SolveError, match="slack all over") as caught:
            eq.frequencies(azimuthal=waves)
        assert caught.value.status is fm.Status.SLACK
