"""Elements that end at the borders of wrinkled zones, against shooting that stops and starts at each border (:mod:`tests.shooting`)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.discretization.meridian import assigned_ends
from femmembrane.discretization.space import space_of

from ..cases import OGDEN, SUSCEPTIBILITY, disc_scene
from ..shooting import Membrane, solve
from ..verification.test_orders import fitted_order
from ..verification.test_relaxed_states import pillow

DIPOLE = (400.0, -3.75)


@dataclass(frozen=True)
class Recorded:
    """A state by shooting, recorded on 2026-11-28."""

    pressure: float
    volume: float
    elastic_energy: float
    magnetic_energy: float
    stretch: float
    borders: tuple[float, ...]


#: by pole height: the disc above a dipole of M = 400, h = -3.75
DISC = {
    -0.1: Recorded(
        1.035609936305551, 0.11464924921565135, 0.009303329335645495, -1.8926657624888357, 1.011726450165, (0.2394222072401, 0.44528067255)
    ),
    -0.2: Recorded(
        1.1301487500402876,
        0.008835337668247853,
        0.01853230625653278,
        -2.0165998005930734,
        1.015465382636,
        (0.2022102963161, 0.5707725926176),
    ),
    -0.3: Recorded(
        1.2176228677685645, -0.11434457467706287, 0.03595467937899757, -2.17892238334747, 1.020814283769, (0.2137303397757, 0.611444042248)
    ),
    -0.45: Recorded(
        1.2861354888152312,
        -0.3171858627229949,
        0.09188380729758953,
        -2.4905357121266305,
        1.033592740666,
        (0.3131308797245, 0.5391892603586),
    ),
}
#: the same of a neo-Hookean pillow
PILLOW = {
    0.48: Recorded(0.08941275509248164, 0.6331128512948422, 0.0010097382956507823, 0.0, 1.012908547691, (0.50207798532597,)),
    0.55: Recorded(0.5966877250173888, 0.7567982924298319, 0.044175822614360864, 0.0, 1.075217873448, (0.76626375542197,)),
    0.65: Recorded(1.2496561147634881, 0.9987874048154447, 0.27677740636204556, 0.0, 1.20319541972, (0.93939902653096,)),
}


def test_what_was_recorded_is_found_by_shooting():
    height, known = -0.3, DISC[-0.3]
    found = solve(Membrane(OGDEN.mu, OGDEN.alpha, SUSCEPTIBILITY, *DIPOLE), height, known.stretch, known.pressure)
    assert found.miss < 1e-11
    for name in ("pressure", "volume", "elastic_energy", "magnetic_energy", "borders"):
        assert getattr(found, name) == pytest.approx(getattr(known, name), rel=1e-9), name


def wrinkling(elements: int, degree: int) -> fm.Scene:
    return disc_scene(OGDEN, DIPOLE, elements, degree).replace(tension_field=True)


@cache
def at_volume(elements: int, degree: int, height: float) -> fm.Equilibrium:
    """The state with the volume that shooting finds at a pole height."""
    scene = wrinkling(elements, degree)
    near = fm.equilibrium(scene, center_height=height)
    return fm.equilibrium(scene, volume=DISC[height].volume, start=near, solver="newton")


@pytest.mark.parametrize(("degree", "meshes"), [(1, (16, 32, 64)), (2, (16, 32, 64)), (3, (8, 16, 32)), (4, (4, 8, 16))])
def test_order_of_the_method(degree, meshes):
    """Orders 2, 4, 6 and 8 at the same volume, in the pressure, the energies and the radii of the borders."""
    expected, errors = DISC[-0.1], []
    for elements in meshes:
        eq = at_volume(elements, degree, -0.1).on_borders()
        assert eq.scene.mesh.elements == elements
        zones = eq.zones("mechanical")
        assert zones.kinds == ("taut", "radial", "taut")
        numbers = [getattr(eq, name) / getattr(expected, name) - 1 for name in ("pressure", "elastic_energy", "magnetic_energy")]
        errors.append(np.abs([*numbers, *np.subtract(zones.borders, expected.borders)]))
    for column in np.array(errors).T:
        assert fitted_order(column) > 2 * degree - {1: 0.2, 2: 0.3, 3: 0.6, 4: 1.0}[degree]
    assert errors[-1].max() < {1: 2e-3, 2: 1e-6, 3: 1e-8, 4: 1e-9}[degree]


@pytest.mark.parametrize("height", [-0.1, -0.2, -0.3, -0.45])
def test_ten_digits_with_sixteen_elements_of_degree_six(height):
    expected, eq = DISC[height], at_volume(16, 6, height)
    on = eq.on_borders()
    assert on.pressure == pytest.approx(expected.pressure, rel=1e-11)
    assert on.elastic_energy == pytest.approx(expected.elastic_energy, rel=1e-10)
    np.testing.assert_allclose(on.zones("mechanical").borders, expected.borders, atol=2e-8)
    assert abs(eq.pressure / expected.pressure - 1) > 1e-8  # with borders inside elements
    assert on.volume == pytest.approx(expected.volume, rel=1e-12)
    # the borders are ends of elements, and who is there stays there
    assert set(on.zones("mechanical").borders) <= set(on.potential.space.ends)
    assert on.on_borders() is on


@pytest.mark.parametrize(("elements", "degree"), [(16, 1), (32, 2), (8, 3), (8, 4)])
def test_errors_are_estimated_as_for_a_smooth_problem(elements, degree):
    expected, on = DISC[-0.3], at_volume(elements, degree, -0.3).on_borders()
    estimate = on.error_estimate()
    assert "quartered" not in estimate.method
    assert estimate.reason == ""
    for name in ("pressure", "elastic_energy", "magnetic_energy"):
        assert getattr(estimate, name).error == pytest.approx(getattr(on, name) - getattr(expected, name), rel=0.2, abs=1e-11), name
    assert "quartered" in at_volume(elements, degree, -0.3).error_estimate().method


@pytest.mark.parametrize("height", [0.48, 0.55, 0.65])
def test_pillow(height):
    """One border, from the middle of the sheet nearly to its rim."""
    scene, expected = pillow(12, 5), PILLOW[height]
    eq = fm.equilibrium(scene, center_height=height, start=fm.equilibrium(scene, volume=0.8)).on_borders("center_height")
    assert eq.center_height == pytest.approx(height, rel=1e-12)
    assert eq.pressure == pytest.approx(expected.pressure, rel=2e-8)
    np.testing.assert_allclose(eq.zones("mechanical").borders, expected.borders, atol=1e-9)


def test_a_zone_thinner_than_an_element():
    """Where wrinkles have just begun, two borders are moved into what was one element."""
    eq = at_height(8, 4, -0.065)
    on = eq.on_borders("center_height")
    inner, outer = on.zones("mechanical").borders
    assert 0.01 < outer - inner < 0.03  # a sixth of an element
    finer = at_height(16, 6, -0.065).on_borders("center_height")
    np.testing.assert_allclose((inner, outer), finer.zones("mechanical").borders, atol=(outer - inner) / 20)
    assert on.pressure == pytest.approx(finer.pressure, rel=2e-5)


def at_height(elements: int, degree: int, height: float) -> fm.Equilibrium:
    return fm.equilibrium(wrinkling(elements, degree), center_height=height)


def test_where_there_is_no_border_nothing_is_done():
    taut = at_height(8, 4, 0.1)
    assert taut.on_borders() is taut


def test_as_many_elements_as_zones_are_enough_and_fewer_are_refused():
    on = at_height(3, 6, -0.3).on_borders("center_height")
    assert on.pressure == pytest.approx(DISC[-0.3].pressure, rel=5e-6)
    np.testing.assert_allclose(on.potential.space.ends[1:-1], DISC[-0.3].borders, atol=1e-5)
    with pytest.raises(fm.InputError, match="the membrane has 3 zones where this mesh has 2 elements"):
        at_height(2, 6, -0.3).on_borders("center_height")


def test_what_has_no_borders_is_refused():
    plain = fm.equilibrium(disc_scene(OGDEN, DIPOLE, 8), volume=0.3)
    with pytest.raises(fm.InputError, match=r"effects\.tension_field"):
        plain.on_borders()
    with pytest.raises(fm.InputError, match="control"):
        at_height(8, 4, 0.1).on_borders("arc-length")


def test_a_slack_membrane_is_refused():
    scene = disc_scene(OGDEN, (600.0, -3.25), 32).replace(tension_field=True)
    ended = fm.trace(scene, start=0.8, direction=-1, special_points=False)
    with pytest.raises(fm.SolveError, match="slack"):
        ended[-1].on_borders()


def test_the_nearest_ends_are_moved():
    ends = np.linspace(0.0, 1.0, 6)
    assert assigned_ends(ends, np.array([0.45])) == ((2, 0.45),)
    # two places nearest to one end: both get one, by the smaller way in all
    assert assigned_ends(ends, np.array([0.39, 0.42])) == ((2, 0.39), (3, 0.42))
    assert assigned_ends(ends, np.array([0.35, 0.39])) == ((1, 0.35), (2, 0.39))
    # ends that have to stay do so
    assert assigned_ends(ends, np.array([0.41, 0.42]), stay=(2,)) == ((3, 0.41), (4, 0.42))
    with pytest.raises(fm.InputError, match="4 zones where this mesh has 3 elements"):
        assigned_ends(ends, np.array([0.41, 0.42, 0.43]), stay=(2,))


def test_the_others_are_carried_along():
    """Between two ends that stay or are moved elements keep their proportions."""
    space = space_of(fm.disc(5, ratio=2.0), 2)
    moved = space.with_moved(((2, 0.45),))
    assert moved.ends[2] == 0.45
    np.testing.assert_allclose(moved.ends[1] / 0.45, space.ends[1] / space.ends[2], rtol=1e-14)
    np.testing.assert_allclose((1 - moved.ends[3:]) / 0.55, (1 - space.ends[3:]) / (1 - space.ends[2]), rtol=1e-14)
