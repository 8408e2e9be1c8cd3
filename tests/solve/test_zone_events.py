"""Zones of a tension field that open and close along a branch, against shooting from the pole (:mod:`tests.shooting`)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.special import ellipe, ellipk

import femmembrane as fm
from femmembrane.results.table import special_point_columns, special_point_rows

from ..cases import OGDEN, SUSCEPTIBILITY, disc_scene
from ..shooting import START, Membrane, _miss
from ..verification.test_relaxed_states import pillow


@dataclass(frozen=True)
class Recorded:
    """A state in which a zone has no width, by shooting, recorded on 2026-11-28."""

    center_height: float
    stretch: float
    pressure: float
    volume: float
    radius: float


#: the disc above a dipole of M = 400, h = -3.75: the wrinkles that come and go as its pole goes down
OPENS = Recorded(-0.06457902778850508, 1.0105066331555568, 1.0044212174383782, 0.14697878645905937, 0.319613511)
CLOSES = Recorded(-0.49364534218413963, 1.0382360371917225, 1.2860120813168887, -0.3750560436027731, 0.423118866)


def zero_width(membrane: Membrane, center_height: float, stretch: float, pressure: float, near: float) -> tuple[np.ndarray, float, float]:
    """The state of a taut disc whose least excess over natural width is zero, by Newton's method; its radius there, and its volume."""
    u = np.array([center_height, stretch, pressure])

    def misses(u):
        y, _, (piece,) = membrane.shoot(*u)
        found = minimize_scalar(lambda r: membrane.excess(r, piece(r)), bounds=(near - 0.05, near + 0.05), method="bounded")
        h = 1e-3  # a parabola is closer to the least value than a search can come
        low, middle, high = (membrane.excess(r, piece(r)) for r in (found.x - h, found.x, found.x + h))
        curved = high - 2 * middle + low
        shift = (low - high) / (2 * curved)
        return np.array([*_miss(membrane, y), middle - shift**2 * curved / 2]), found.x + h * shift, float(y[4])

    for _ in range(12):
        miss, radius, volume = misses(u)
        if np.abs(miss).max() < 1e-12:
            break
        steps = 1e-6 * np.maximum(np.abs(u), 0.1)
        jacobian = [(misses(u + d * e)[0] - misses(u - d * e)[0]) / (2 * d) for d, e in zip(steps, np.eye(3), strict=True)]
        u = u + np.linalg.solve(np.transpose(jacobian), -miss)
    return u, radius, volume


def test_what_was_recorded_is_found_by_shooting():
    taut = Membrane(OGDEN.mu, OGDEN.alpha, SUSCEPTIBILITY, 400.0, -3.75, tension_field=False)
    u, radius, volume = zero_width(taut, OPENS.center_height, OPENS.stretch, OPENS.pressure, OPENS.radius)
    assert START < radius < 1
    np.testing.assert_allclose(u, [OPENS.center_height, OPENS.stretch, OPENS.pressure], rtol=1e-11)
    assert (radius, volume) == pytest.approx((OPENS.radius, OPENS.volume), rel=1e-8)


def wrinkling(elements: int, degree: int, **more: object) -> fm.Scene:
    return disc_scene(OGDEN, (400.0, -3.75), elements, degree).replace(tension_field=True, **more)


@cache
def lowered(elements: int, degree: int, follow: bool) -> fm.Branch:
    return fm.trace(wrinkling(elements, degree, follow_borders=follow), start=0.5, direction=-1, until={"center_height": -0.55})


def changes(branch: fm.Branch) -> list[fm.SpecialPoint]:
    return [point for point in branch.special_points or () if point.zone is not None]


def test_a_zone_opens_and_closes_inside():
    """On elements that follow borders, one of which ends at the place: to twelve digits."""
    opens, closes = changes(lowered(16, 6, True))
    for point, kind, expected in ((opens, "zone_opens", OPENS), (closes, "zone_closes", CLOSES)):
        assert point.kind == kind
        assert point.zone.kind == "radial"
        assert point.zone.place == "inside"
        assert point.pressure == pytest.approx(expected.pressure, rel=2e-12)
        assert point.volume == pytest.approx(expected.volume, rel=1e-10)
        assert point.center_height == pytest.approx(expected.center_height, rel=1e-7)  # of a pole on this mesh
        assert point.zone.reference_radius == pytest.approx(expected.radius, abs=2e-6)
        assert point.error < 1e-10
        assert point.equilibrium.zones("mechanical").fraction("radial") < 1e-3
    assert opens.zone.radius < opens.zone.reference_radius


@pytest.mark.parametrize(("degree", "meshes"), [(2, (16, 64)), (3, (8, 24)), (4, (8, 16))])
def test_order_of_an_event(degree, meshes):
    """That of an energy, 2 p, on elements that follow borders; that of a strain on others."""
    errors = [abs(changes(lowered(n, degree, True))[0].pressure / OPENS.pressure - 1) for n in meshes]
    assert np.log(errors[0] / errors[1]) / np.log(meshes[1] / meshes[0]) > 2 * degree - 0.5
    assert abs(changes(lowered(meshes[1], degree, False))[0].pressure / OPENS.pressure - 1) > 3 * errors[1]


def test_elements_as_they_are():
    """A branch on the mesh of the scene has its events on that mesh."""
    points = changes(lowered(16, 6, False))
    assert [point.kind for point in points] == ["zone_opens", "zone_closes"]
    for point, expected in zip(points, (OPENS, CLOSES), strict=True):
        assert point.pressure == pytest.approx(expected.pressure, rel=1e-8)
        assert point.equilibrium.scene.borders == ()


def test_arc_length_steps_over_events():
    """Steps stay long where zones open and close, as on the branch of a plain membrane."""
    plain = fm.trace(
        wrinkling(16, 6).replace(tension_field=False), start=0.5, direction=-1, until={"center_height": -0.55}, ill_posed="mark"
    )
    assert len(lowered(16, 6, True)) < 1.3 * len(plain)


def test_at_a_rim():
    """The wrinkles of a pillow go away at its rim, which slides: where they end the hoop strain there is the natural one."""
    points = [changes(fm.trace(pillow(n, 5).replace(follow_borders=True), start=0.8, until={"volume": 2.0}))[0] for n in (8, 16)]
    for point in points:
        assert (point.kind, point.zone.place, point.zone.kind) == ("zone_closes", "rim", "radial")
        assert point.zone.reference_radius == 1.0
    assert points[0].pressure == pytest.approx(points[1].pressure, rel=1e-8)
    profile = points[1].equilibrium.profile([1.0])
    assert profile["stretch_2"][0] ** 2 * profile["stretch_1"][0] == pytest.approx(1, abs=1e-6)
    assert profile["rho"][0] == pytest.approx(points[1].zone.radius, rel=1e-12)


def test_over_a_number_and_back():
    """The strength at which the last wrinkle goes, from stronger dipoles and from weaker ones."""
    scene = wrinkling(16, 4)
    start = fm.equilibrium(scene, volume=0.1)
    down = fm.trace(scene, over="source.0.strength", hold={"volume": 0.1}, start=start, until={"source.0.strength": 250.0}, direction=-1)
    up = fm.trace(down[-1].scene, over="source.0.strength", hold={"volume": 0.1}, start=down[-1], until={"source.0.strength": 400.0})
    (closes,), (opens,) = changes(down), changes(up)
    assert (closes.kind, opens.kind) == ("zone_closes", "zone_opens")
    assert closes.number == pytest.approx(opens.number, rel=1e-10)


@pytest.mark.parametrize(("elements", "degree"), [(8, 4), (16, 4), (8, 6), (64, 2)])
def test_zones_that_finer_elements_do_not_have_are_not_listed(elements, degree):
    """A cap above a dipole wrinkles once, near its rim. Coarse meshes show up to four more events, most of them at ends of elements."""
    scene = wrinkling(8, degree).replace(mesh=fm.cap(0.3, elements))
    branch = fm.trace(scene, start=1.0854, direction=-1, until={"center_height": -0.9}, max_steps=80)
    (opens,) = changes(branch)
    assert (opens.kind, opens.zone.kind, opens.zone.place) == ("zone_opens", "radial", "inside")
    assert opens.pressure == pytest.approx(0.785738, rel=2e-4)  # that of elements that follow borders, and of 64 of degree 4
    assert opens.zone.reference_radius == pytest.approx(0.9742, abs=6e-3)


def test_no_zone_of_a_state_that_is_slack_on_finer_elements():
    """Next to the end of a branch that becomes slack, eight elements of degree 6 show a zone in which no tension is left."""
    scene = wrinkling(8, 6).replace(mesh=fm.cap(0.3, 8), sources=[fm.Dipole(600.0, -3.25)])
    branch = fm.trace(scene, start=1.0854, direction=-1, until={"center_height": -0.9}, max_steps=80)
    assert branch.status is fm.Status.SLACK
    assert [point.zone.kind for point in changes(branch)] == ["radial"]


def test_a_scene_without_a_tension_field_has_none():
    branch = fm.trace(wrinkling(8, 2).replace(tension_field=False), start=0.5, direction=-1, max_steps=5)
    assert not changes(branch)
    assert special_point_columns(branch) == ["kind", "volume", "pressure", "center_height", "error"]


def test_files_and_tables_keep_them(tmp_path: Path):
    branch = lowered(16, 6, True)
    branch.save(tmp_path / "branch.nc")
    again = fm.load(tmp_path / "branch.nc")
    assert [p.zone for p in again.special_points] == [p.zone for p in branch.special_points]
    for point, other in zip(changes(branch), changes(again), strict=True):
        assert other.equilibrium.scene == point.equilibrium.scene
        assert np.array_equal(other.equilibrium.state, point.equilibrium.state)
    rows = [dict(zip(special_point_columns(branch), row, strict=True)) for row in special_point_rows(branch)]
    opens = next(row for row in rows if row["kind"] == "zone_opens")
    assert (opens["changing_zone_kind"], opens["changing_zone_place"]) == ("radial", "inside")
    limit = next(row for row in rows if row["kind"] == "limit_point")
    assert limit["changing_zone_kind"] == ""
    assert "zone=ZoneChange(kind='radial'" in repr(changes(branch)[0])


def test_of_an_annulus():
    """Wrinkles that open near the rim go away near the hole; meshes agree to eight digits, and steps stay few."""
    found = []
    for elements in (12, 16):
        scene = wrinkling(8, 4).replace(mesh=fm.annulus(0.2, elements=elements), degree=5, follow_borders=True)
        branch = fm.trace(scene, start=0.5, direction=-1, until={"volume": -0.4}, max_steps=60)
        assert branch.status is fm.Status.CONVERGED
        assert len(branch) < 30
        found.append(changes(branch))
    assert [p.kind for p in found[1]] == ["zone_opens", "zone_closes"]
    assert found[1][0].zone.reference_radius == pytest.approx(0.617, abs=1e-3)
    assert found[1][1].zone.reference_radius == pytest.approx(0.285, abs=1e-3)
    for coarse, fine in zip(*found, strict=True):
        assert coarse.pressure == pytest.approx(fine.pressure, rel=1e-8)


def test_up_to_a_slack_circle():
    """Elements that follow come as close to it as elements that do not, and the trace ends there by its name."""
    scene = disc_scene(OGDEN, (600.0, -3.25), 16, 4).replace(tension_field=True, follow_borders=True)
    branch = fm.trace(scene, start=2.1, direction=-1, until={"center_height": 0.1}, max_steps=60)
    assert branch.status is fm.Status.SLACK
    assert branch[-1].center_height < 0.34  # by shooting it opens at 0.3211
    (opens,) = changes(branch)
    assert opens.zone.reference_radius == pytest.approx(0.8224, abs=1e-3)


def test_the_mylar_balloon():
    """As the pressure of a pillow goes to zero its sheet does not stretch, and all but its pole is wrinkled (Paulsen 1994, Mladenov 2001).

    The radius of its rim is then sqrt(2)/K(1/sqrt 2) = 0.76276 of that of the flat sheets.
    """
    scene, radii = pillow(12, 5).replace(follow_borders=True), []
    eq = fm.equilibrium(scene, volume=0.7)
    for pressure in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        eq = fm.equilibrium(scene, pressure=pressure, start=eq)
        radii.append(float(eq.profile([1.0])["rho"][0]))
    limit = math.sqrt(2) / ellipk(0.5)
    assert limit == pytest.approx(0.76276, abs=1e-5)
    a, b, c = radii[-3:]
    assert c - (c - b) ** 2 / (c - 2 * b + a) == pytest.approx(limit, abs=2e-8)  # Aitken's extrapolation
    assert eq.center_height == pytest.approx(limit * math.sqrt(2) * (ellipe(0.5) - ellipk(0.5) / 2), abs=3e-5)
    assert len(eq.zones("mechanical")) == 2
    assert eq.zones("mechanical").fraction("radial") > 0.997
