"""The reference tables with 64 elements of degree 2 (data/README.md says where the numbers come from).

Volume control at the listed volumes and pressure control at the listed pressures, wherever the state is a minimum under that control.
"""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm

from ..cases import LIMIT_POINTS, POINTS, PROBLEMS, SCENES

LISTED = [p for p in PROBLEMS if p.point.profile]

#: listed points that are the first minimum at their pressure on the branch through the moderately inflated membrane, read off the
#: tables: a state between the flat membrane and the first limit point, or a pressure that the branch before does not reach in a minimum
FIRST_AT_THEIR_PRESSURE = {
    "neo_hookean_disc": (0.1, 0.5, 1.0),
    "ogden_disc": (0.1, 0.5, 1.0, 5.0),
    "dipole_above": (0.3, 0.5, 1.0, 4.7),
    "dipole_below": (0.5, 3.0, 4.0),
}


def names(cases):
    return [case.name for case in cases]


def test_registry_holds_every_minimum():
    """Counted in the tables by hand, scene by scene: 30 points, 28 minima under volume, 3 + 6 + 7 + 3 under pressure control."""
    assert len(POINTS) == 30
    assert len(LIMIT_POINTS) == 9
    assert sum(p.control == "volume" for p in PROBLEMS) == 28 + len(LIMIT_POINTS)
    assert sum(p.control == "pressure" for p in PROBLEMS) == 19


@pytest.mark.parametrize("problem", PROBLEMS, ids=names(PROBLEMS))
def test_state(problem):
    eq, expected = problem.solve("ipopt"), problem.point.expected
    assert eq.status is fm.Status.CONVERGED
    assert eq.pressure == pytest.approx(expected["pressure"], rel=1e-6)
    assert eq.volume == pytest.approx(expected["volume"], rel=1e-6)
    assert eq.elastic_energy == pytest.approx(expected["elastic_energy"], rel=1e-6)
    assert eq.center_height == pytest.approx(expected["center_height"], rel=1e-5)


#: where 1e-6 is missed, and what holds instead (1.37e-6 recorded on 2026-11-22). A soft state (lambda_pressure 3.2) near the dipole
#: amplifies the discretisation error of order 4; no quadrature changes it, 128 elements leave 8.8e-8. Of the whole energy it is 1.3e-8.
MISSED = {"dipole_above-4.7-pressure": 1.5e-6}


@pytest.mark.parametrize("problem", PROBLEMS, ids=names(PROBLEMS))
def test_magnetic_energy(problem):
    eq, expected = problem.solve("ipopt"), problem.point.expected["magnetic_energy"]
    if problem.point.scene.sources:
        assert eq.magnetic_energy == pytest.approx(expected, rel=MISSED.get(problem.name, 1e-6))
    else:
        assert eq.magnetic_energy == 0.0


def test_magnetic_energy_that_is_missed_converges():
    """The one miss above is the mesh's: with 128 elements 1e-6 is met tenfold."""
    point = next(p.point for p in PROBLEMS if p.name in MISSED)
    scene = point.scene.replace(mesh=fm.disc(elements=128))
    start = fm.equilibrium(scene, volume=point.expected["volume"])
    eq = fm.equilibrium(scene, pressure=point.expected["pressure"], start=start)
    assert eq.magnetic_energy == pytest.approx(point.expected["magnetic_energy"], rel=1e-7)


@pytest.mark.parametrize("problem", PROBLEMS, ids=names(PROBLEMS))
def test_smallest_eigenvalues(problem):
    eq, expected = problem.solve("ipopt"), problem.point.expected
    for control in ("pressure", "volume"):
        verdict = eq.verdict(control)
        if problem.point.kind == "limit_point" and control == "pressure":  # zero there, so relative to the one under volume control
            assert abs(verdict.smallest_eigenvalue) < 1e-4 * expected["lambda_volume"]
        else:
            assert verdict.smallest_eigenvalue == pytest.approx(expected[f"lambda_{control}"], rel=1e-4)
            assert verdict.stable is (expected[f"lambda_{control}"] > 0)


@pytest.mark.parametrize("key", ["rho", "eta", "stretch_1", "stretch_2"])
@pytest.mark.parametrize("problem", LISTED, ids=names(LISTED))
def test_profile(problem, key):
    expected = problem.point.profile
    assert problem.solve("ipopt").profile(expected["r"])[key] == pytest.approx(np.array(expected[key]), rel=1e-5)


@pytest.mark.parametrize("problem", LISTED, ids=names(LISTED))
def test_stresses(problem):
    expected = problem.point.profile
    profile = problem.solve("ipopt").profile(expected["r"])
    for key in (f"{kind}_stress_{k}" for kind in ("mechanical", "total") for k in (1, 2)):
        assert profile[key] == pytest.approx(np.array(expected[key]), rel=1e-5), key


@pytest.mark.parametrize("problem", PROBLEMS, ids=names(PROBLEMS))
def test_accuracy_is_not_the_solver_s(problem):
    """The control holds and forces balance to round-off, so that what is left is the discretisation."""
    eq = problem.solve("ipopt")
    assert getattr(eq, problem.control) == pytest.approx(problem.point.expected[problem.control], rel=1e-10)
    assert eq.residual < 1e-9


@pytest.mark.parametrize("name", SCENES)
def test_first_minimum_at_a_pressure(name):
    """Without a start the first minimum on the branch is returned: the listed one, or one that comes before it."""
    for point in (p for p in POINTS if p.scene_name == name and p.is_minimum("pressure")):
        eq = fm.equilibrium(point.scene, pressure=point.expected["pressure"])
        assert eq.verdict("pressure").stable is True
        if round(point.expected["center_height"], 6) in FIRST_AT_THEIR_PRESSURE[name]:
            assert eq.volume == pytest.approx(point.expected["volume"], rel=1e-6)
        else:
            assert 0 < eq.volume < point.expected["volume"]


UNSTABLE = [p for p in POINTS if not p.is_minimum("pressure")]


@pytest.mark.parametrize("point", UNSTABLE, ids=names(UNSTABLE))
def test_unstable_states_by_their_height(point):
    """Height control needs no minimum: beyond a limit point and beyond a volume fold alike."""
    eq = fm.equilibrium(point.scene, center_height=point.expected["center_height"], start=_inflated(point))
    # beyond the volume fold of the dipole above the volume changes fast with the height: 5.1e-5 at pole height 5, recorded on 2026-11-22
    assert eq.volume == pytest.approx(point.expected["volume"], rel=1e-4)
    assert eq.verdict("pressure").stable is False
    assert eq.verdict("volume").stable is point.is_minimum("volume")


BEYOND_A_FOLD = [p for p in POINTS if not p.is_minimum("volume")]


@pytest.mark.parametrize("point", BEYOND_A_FOLD, ids=names(BEYOND_A_FOLD))
def test_minimiser_does_not_hold_an_unstable_state(point):
    """Not even when it is started there and asked for the very same volume."""
    eq = fm.equilibrium(point.scene, center_height=point.expected["center_height"], start=_inflated(point))
    with pytest.raises(fm.SolveError):
        fm.equilibrium(point.scene, volume=eq.volume, start=eq, solver="ipopt")
    with pytest.raises(fm.SolveError):
        fm.equilibrium(point.scene, volume=0.999 * eq.volume, start=eq, solver="ipopt")


def _inflated(point):
    volume = min(point.expected["volume"], 75.0)
    return fm.equilibrium(point.scene, volume=volume, solver="newton")
