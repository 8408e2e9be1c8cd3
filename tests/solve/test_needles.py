"""States that the mesh makes: needles are refused, approximations however coarse are not.

A disc of Varga's material has no state higher than 1.13009 at the pole, where P tends to 1.7413338 and V to 2.30281: shooting from the pole
(tests/shooting.py) with stretches there up to 1e4. On that way P has its maximum 1.82363 and V its maximum 2.32783, and the pole is never
higher. At P = 1.76 two states exist. The needles of meshes go on.
"""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.errors import Status
from tests.cases import OGDEN, disc_scene
from tests.shooting import Membrane, solve

VARGA = Membrane(mu=(2.0,), alpha=(1.0,), tension_field=False)
#: pole height, pressure and volume that the branch tends to
HIGHEST, LAST_PRESSURE, LAST_VOLUME = 1.13009, 1.7413338, 2.30281
MESHES = [(8, 1), (64, 1), (4, 2), (16, 2), (64, 2), (32, 3), (16, 4), (4, 8)]


def varga(elements: int = 64, degree: int = 2) -> fm.Scene:
    return fm.Scene(fm.Varga(), mesh=fm.disc(elements), degree=degree)


@pytest.mark.parametrize(("elements", "degree"), MESHES)
def test_a_needle_is_not_resolved(elements, degree):
    with pytest.raises(fm.SolveError, match=r"height 1.2 was not reached: the mesh does not resolve the membrane") as error:
        fm.equilibrium(varga(elements, degree), center_height=1.2)
    assert error.value.status is Status.NOT_RESOLVED
    assert Status.NOT_RESOLVED.advice in str(error.value)


@pytest.mark.parametrize(("height", "rel"), [(0.5, 1e-6), (1.0, 1e-6), (1.1, 1e-5), (1.127, 3e-4)])
def test_what_exists_is_resolved(height, rel):
    eq = fm.equilibrium(varga(), center_height=height)
    found = solve(VARGA, height, float(eq.profile(r=[0.0])["stretch_1"][0]), eq.pressure)
    assert found.miss < 1e-9
    assert (eq.pressure, eq.volume) == pytest.approx((found.pressure, found.volume), rel=rel)
    assert eq.status is Status.CONVERGED


@pytest.mark.parametrize(("elements", "degree"), [(64, 2), (32, 3), (16, 8)])
def test_a_trace_ends_where_the_branch_does(elements, degree):
    branch = fm.trace(varga(elements, degree), start=0.3, until={"center_height": 1.2}, throw=False)
    assert branch.status is Status.NOT_RESOLVED
    assert branch[-1].center_height == pytest.approx(HIGHEST, abs=1e-3)
    assert branch[-1].pressure == pytest.approx(LAST_PRESSURE, abs=1e-3)
    assert branch[-1].volume == pytest.approx(LAST_VOLUME, abs=3e-3)
    assert {p.kind for p in branch.special_points} == {"limit_point", "volume_fold"}
    assert "at r = 0" in branch.message or "at r = 0." in branch.message


def test_all_states_at_a_pressure():
    """Two exist; the needles are counted."""
    found = fm.equilibria(varga(), pressure=1.76)
    assert len(found) == 2
    assert "that the mesh does not resolve" in found.searched
    for eq in found:
        exact = solve(VARGA, eq.center_height, float(eq.profile(r=[0.0])["stretch_1"][0]), eq.pressure)
        assert (exact.pressure, exact.volume) == pytest.approx((1.76, eq.volume), rel=1e-6)


def test_runs_keep_what_is_resolved():
    run = fm.Run(control="height", values=(0.9, 1.1, 1.2))
    branch = fm.run(varga().replace(run=run))
    assert len(branch) == 2
    assert branch.status is Status.NOT_RESOLVED


def test_an_exponent_below_one_ends_too():
    """Ogden with alpha = 0.9: the branch ends at V = 2.23558 (256 elements of degree 2, 64 of degree 4 and 128 graded ones of degree 4)."""
    scene = fm.Scene(fm.Ogden(mu=(2 / 0.9,), alpha=(0.9,)), mesh=fm.disc(64), degree=2)
    branch = fm.trace(scene, start=0.3, until={"center_height": 1.2}, throw=False)
    assert branch.status is Status.NOT_RESOLVED
    assert branch.column("volume").max() == pytest.approx(2.23558, rel=3e-4)
    assert branch[-1].center_height == pytest.approx(1.0657, abs=1e-3)


def test_no_error_is_estimated_for_a_needle():
    """It is looked at as a stranger's file might bring it."""
    from femmembrane.accuracy.error_estimate import estimate_errors
    from femmembrane.potential import potential_of
    from femmembrane.solve.controls import CenterHeightControl
    from femmembrane.solve.newton import correct

    potential = potential_of(varga(8, 1))
    eq = fm.equilibrium(varga(8, 1), center_height=1.15)
    result = correct(potential, CenterHeightControl(1.2), eq.state, eq.pressure)
    assert result.status is Status.CONVERGED
    estimate = estimate_errors(potential, result.x, result.pressure, "height", {c: eq.verdict(c) for c in ("pressure", "volume")})
    assert np.isnan(estimate.pressure.error)
    assert "not resolve" in estimate.reason


#: volumes to which the plainest meshes go: 15 per cent off in P at V = 40 on four straight elements
@pytest.mark.parametrize(("elements", "degree"), [(4, 1), (8, 1), (32, 1), (2, 2), (4, 2), (64, 2), (2, 4), (8, 4), (2, 8), (8, 8)])
@pytest.mark.parametrize("material", [fm.NeoHookean(), OGDEN, fm.MooneyRivlin(0.1), fm.Yeoh(0.1, 0.01)], ids=str)
def test_coarse_meshes_are_not_refused(material, elements, degree):
    branch = fm.inflate(fm.Scene(material, mesh=fm.disc(elements), degree=degree), volumes=[0.1, 1.0, 5.0, 20.0, 40.0], solver="newton")
    assert len(branch) == 5
    assert branch.status is Status.CONVERGED


@pytest.mark.parametrize(
    "mesh", [fm.cap(0.5, 8), fm.sphere(8), fm.cylinder(2.0, 8), fm.torus(2.0, 8), fm.annulus(0.3, 8)], ids=lambda m: m.shape
)
@pytest.mark.parametrize("degree", [1, 3])
def test_other_shapes_are_not_refused(mesh, degree):
    scene = fm.Scene(fm.MooneyRivlin(0.1), mesh=mesh, degree=degree)
    rest = fm.equilibrium(scene, pressure=0.3).volume
    assert fm.inflate(scene, volumes=[1.2 * rest, 2.0 * rest], solver="newton").status is Status.CONVERGED


def test_the_tip_below_a_dipole_is_no_needle():
    """Drawn out to an edge at the pole (M = 200, h = 6.5), which small elements make round: the P of 64 elements holds to 1e-5."""
    scene = disc_scene(OGDEN, (200.0, 6.5))
    branch = fm.trace(scene, start=70.0, until={"center_height": 5.38}, throw=False)
    assert branch.status is Status.CONVERGED
    assert branch[-1].error_estimate("volume").pressure.relative < 1e-5


def test_kinks():
    """Of a cone on two straight elements: the half angle counts twice at the pole, and a bend at r = 1/2."""
    from femmembrane.potential import potential_of

    space = potential_of(fm.Scene(fm.NeoHookean(), mesh=fm.disc(2), degree=1)).space
    x = np.zeros(space.n_free)
    x[space.pole] = 1.0
    low = space.numbers[space.nodes[1], 1]
    x[low] = 0.5
    assert space.kinks(x) == pytest.approx([0.0, 2 / np.sqrt(2)], abs=1e-12)  # slope (1, -1): straight, and its mirror image at the pole
    x[low] = 0.0
    # slopes (1, -2) and (1, 0), the shorter one is 1; at the pole twice the sine 2/sqrt(5)
    assert space.kinks(x) == pytest.approx([2.0, 4 / np.sqrt(5)], abs=1e-12)
    assert space.kink_radii == pytest.approx([0.5, 0.0])
