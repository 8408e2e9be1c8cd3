"""Loads over numbers beside rigid bodies: plates that close, magnets that come with their bodies, and other numbers of scenes in contact.

References for the neo-Hookean disc under a frictionless plate: nine digits of another shooting code (tests/solve/test_contact.py).
"""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.potential import ContactFamily
from femmembrane.scene.variation import Parameter
from femmembrane.verbs.number_trace import NumberTraceRequest, NumberTraceRun

NH = fm.NeoHookean()
HEIGHT = "obstacle.0.height"
#: (P, V, deformed radius of contact) with the plate at 0.5
AT_03 = (1.309893716, 1.054478791, 0.3)


def scene(elements=32, **more):
    return fm.Scene(**{"material": NH, "mesh": fm.disc(elements), **more})


def plate(height, elements=32, **more):
    return scene(elements, obstacles=[fm.Plane(height=height)], **more)


def kinds(branch):
    return [(p.kind, p.equilibrium.number(branch.over)) for p in branch.special_points]


@pytest.fixture(scope="module")
def closing():
    """The plate comes down at the volume that has a contact of radius 0.3 when it stands at 0.5."""
    held = {"volume": AT_03[1]}
    return fm.trace(plate(0.6, 12, degree=3), over=HEIGHT, hold=held, until={HEIGHT: 0.5}, max_steps=60)


def test_a_plate_that_closes_touches_at_the_height_of_the_free_membrane(closing):
    free = fm.equilibrium(scene(12, degree=3), volume=AT_03[1])
    ((kind, height),) = kinds(closing)
    assert kind == "touch"
    assert height == pytest.approx(free.center_height, rel=1e-8)  # the height is stationary as a node comes on: 1e-12 in the volume
    assert closing.special_points[0].pressure == pytest.approx(free.pressure, rel=1e-8)
    before = [eq.pressure for eq in closing if eq.number(HEIGHT) > height]
    assert before == pytest.approx([free.pressure] * len(before), rel=1e-10)


def test_it_ends_at_the_nine_digits_of_the_shooting_code(closing):
    last = closing[-1]
    assert last.scene.obstacles[0].height == 0.5
    assert last.pressure == pytest.approx(AT_03[0], abs=3e-6)
    assert last.contact.radius == pytest.approx(AT_03[2], abs=3e-6)
    own = fm.equilibrium(plate(0.5, 12, degree=3), volume=AT_03[1])
    assert last.pressure == pytest.approx(own.pressure, rel=1e-11)
    assert last.contact.force == pytest.approx(own.contact.force, rel=1e-9)


def test_a_plate_that_opens_lets_go_where_it_touched(closing):
    opening = fm.trace(closing[-1].scene, start=closing[-1], over=HEIGHT, hold={"volume": AT_03[1]}, until={HEIGHT: 0.6})
    ((kind, height),) = kinds(opening)
    assert kind == "release"
    assert height == pytest.approx(kinds(closing)[0][1], rel=1e-7)
    assert not opening[-1].contact.touching


def test_a_trace_goes_on_where_it_was_interrupted(closing):
    held = {"volume": AT_03[1]}
    part = fm.trace(closing[0].scene, over=HEIGHT, hold=held, until={HEIGHT: 0.5}, max_steps=len(closing) - 4)
    whole = fm.trace(closing[0].scene, start=part, over=HEIGHT, hold=held, until={HEIGHT: 0.5}, max_steps=60)
    assert [eq.pressure for eq in whole] == pytest.approx([eq.pressure for eq in closing], rel=1e-10)


@pytest.mark.parametrize("solver", ["ipopt", "newton"])
def test_from_value_to_value(solver):
    heights = [0.7, 0.53]
    branch = fm.vary(plate(0.8, 16), over=HEIGHT, values=heights, hold={"volume": AT_03[1]}, solver=solver)
    for height, eq in zip(heights, branch, strict=True):
        assert eq.pressure == pytest.approx(fm.equilibrium(plate(height, 16), volume=AT_03[1]).pressure, rel=1e-10)


CASES = {
    "radius of a ball": (scene(obstacles=[fm.Ball(1.0, 0.5)]), "obstacle.0.radius", {"volume": 1.1}),
    "height of a ball": (scene(obstacles=[fm.Ball(1.0, 0.5)]), "obstacle.0.height", {"pressure": 1.2}),
    "edge of a cylinder": (scene(obstacles=[fm.Cylinder(0.8, 0.3, 0.5, rounding=0.2)]), "obstacle.0.rounding", {"volume": 1.2}),
    "prestretch": (plate(0.5, prestretch=1.3), "membrane.prestretch", {"volume": 2.0}),
    "place of the rim": (
        scene(mesh=fm.disc(32, rim={"kind": "clamped", "radius": 1.2}), obstacles=[fm.Ball(1.0, 0.5)]),
        "mesh.rim.radius",
        {"volume": 1.5},
    ),
    "material": (scene(material=fm.MooneyRivlin(0.1), obstacles=[fm.Ball(1.0, 0.5)]), "material.ratio", {"volume": 1.1}),
    "magnet": (
        scene(64, sources=[fm.Magnet(height=0.9, radius=0.4, length=0.5, strength=1e-3, body=True)], susceptibility=0.5),
        "source.0.height",
        {"volume": 1.4},
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_rates_along_the_curve(name):
    """Against differences of whole solves. Ends of elements follow the border in these, which the rates leave to the error of the mesh."""
    own, over, hold = CASES[name]
    eq, parameter = fm.equilibrium(own, **hold), Parameter(own, over)
    assert eq.contact.touching
    value = parameter.value
    run = NumberTraceRun(own, NumberTraceRequest.over_number(own, eq, {over: 1.05 * value}, over=over, hold=hold))
    assert isinstance(run.family, ContactFamily)
    point, step, follows = run.first(eq), 1e-3 * value, "volume" if "pressure" in hold else "pressure"
    one, two = (fm.equilibrium(parameter.scene_at(value + side * step), **hold) for side in (1.0, -1.0))
    difference = (getattr(one, follows) - getattr(two, follows)) / (2 * step)
    assert point.rate(follows) / point.rate("number") == pytest.approx(difference, rel=1e-3)
    assert abs(point.rate(next(iter(hold)))) < 1e-10


def test_a_number_that_moves_the_nodes_beside_a_curved_body():
    """The border of contact is where whole solves have it, though the unknowns are zero at another place for another prestretch."""
    before = scene(16, prestretch=1.2, obstacles=[fm.Ball(1.0, 0.5)])
    stretched = fm.trace(before, over="membrane.prestretch", hold={"volume": 1.6}, until={"membrane.prestretch": 1.24}, max_steps=40)
    assert stretched[-1].number("membrane.prestretch") == 1.24
    for eq in stretched:
        assert eq.scene.borders
        assert eq.pressure == pytest.approx(fm.equilibrium(eq.scene.bordered(()), volume=1.6).pressure, rel=1e-10)


def test_the_distance_at_which_a_membrane_jumps_onto_a_magnet():
    """At the turn of the branch over the distance the branch over the volume has its limit point at the pressure that was held."""

    def before(height):
        magnet = fm.Magnet(height=height, radius=0.4, length=0.5, strength=4.0, body=True)
        return scene(16, sources=[magnet], susceptibility=0.5)

    far = fm.equilibrium(before(2.5), pressure=0.3)
    over = "source.0.height"
    branch = fm.trace(before(2.5), start=far, over=over, hold={"pressure": 0.3}, until={"center_height": 0.9}, direction=-1)
    ((kind, distance),) = kinds(branch)
    assert kind == "number_fold"
    there = fm.trace(before(distance), start=0.5, until={"volume": 1.0})
    limits = [p.pressure for p in there.special_points if p.kind == "limit_point"]
    assert min(abs(p - 0.3) for p in limits) < 1e-9


def test_the_last_value_is_that_of_the_last_scene():
    """A plate cannot go through the membrane at rest, though the one that is inflated away from it leaves room."""
    branch = fm.trace(plate(0.3, 8), over=HEIGHT, hold={"pressure": -1.0}, until={HEIGHT: -0.5}, max_steps=80)
    assert branch.status.name == "NO_EQUILIBRIUM"
    assert abs(branch[-1].number(HEIGHT)) < 1e-6
    assert branch[-1].volume == pytest.approx(branch[0].volume, rel=1e-12)


def test_a_ball_between_plates_is_compressed_at_the_centre_of_contact_alone():
    """Half a ball of stretch 1.02 at a fixed volume. Flattening compresses its cap, which the plate holds flat; its border is in tension.

    The least eigenvalue against waves around the axis changes smoothly there: a stress that vanishes brings none of its own.
    """
    stretch = 1.02
    ball = scene(mesh=fm.cap(height=1.0, elements=12, rim="mirror"), degree=4, obstacles=[fm.Plane(1.01 * stretch)])
    volume = 2 * np.pi / 3 * stretch**3
    heights = np.array([1.005, 0.95, 0.85, 0.74, 0.71, 0.68, 0.607, 0.602, 0.5]) * stretch
    branch = fm.vary(ball, over=HEIGHT, values=heights, hold={"volume": volume}, solver="newton")
    assert len(branch) == len(heights)
    assert branch[-1].scene.squeezed
    pole = np.array([eq.profile([0.0])["mechanical_stress_2"][0] for eq in branch])
    assert (pole[3:6] < -0.01).all()
    assert (pole[[0, 1, 2, -1]] > 0.01).all()
    for eq in branch[1:]:
        assert eq.status is fm.Status.CONVERGED
        assert eq.profile([eq.contact.reference_radius])["mechanical_stress_2"][0] > 0.05
    values = [eq.verdict(azimuthal=4).smallest_eigenvalue for eq in branch]
    assert (np.diff(values[1:]) > 0).all()


def test_steps_stay_long_where_slopes_and_points_are_of_different_meshes():
    """On few elements slopes miss the chords by some thousandths: a cubic magnified that until no step was short enough."""
    rubber = fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0))
    own = plate(0.9, 12, material=rubber, degree=3)
    branch = fm.trace(own, over=HEIGHT, hold={"volume": 1.0}, until={HEIGHT: 0.45}, max_steps=25)
    assert branch.status == "converged"
    assert branch[-1].pressure == pytest.approx(fm.equilibrium(plate(0.45, 12, material=rubber, degree=3), volume=1.0).pressure, rel=1e-9)


def test_each_equilibrium_has_the_scales_and_the_analyses_of_the_scene_given():
    """By hand: mu T/R0 = 8 kPa, mu T R0 = 5 N, R0 = 25 mm; total stresses know R0/T = 50."""
    scales = fm.Scales(radius=0.025, thickness=5e-4, shear_modulus=4e5)
    asked = fm.Analysis(stability=("pressure",))
    before = plate(0.5, 8, scales=scales, analysis=asked, title="plate", sources=[fm.Dipole(1e-4, 2.0)], susceptibility=0.5)
    traced = fm.trace(before, over=HEIGHT, hold={"pressure": 0.8}, until={HEIGHT: 0.3})
    assert [point.kind for point in traced.special_points][:1] == ["touch"]
    for branch in (traced, fm.vary(before, HEIGHT, [0.5, 0.3], hold={"pressure": 0.8})):
        for name, unit in (("pressure_pa", 8e3), ("volume_m3", 0.025**3), ("contact_force_n", 5.0), ("contact_radius_m", 0.025)):
            scaled = branch.column(name.rpartition("_")[0])  # a free membrane has no radius of contact
            np.testing.assert_allclose(branch.column(name), unit * scaled, rtol=1e-12, equal_nan=True)
            assert np.isfinite(scaled[-1])
        for eq in (branch[-1], *(point.equilibrium for point in branch.special_points or ())):
            number = eq.number(HEIGHT)
            assert eq.scene.replace(run=None, obstacles=before.obstacles) == before
            assert eq.scene.obstacles == (fm.Plane(number),)
        own = fm.equilibrium(plate(0.3, 8, scales=scales, sources=before.sources, susceptibility=0.5), pressure=0.8, start=branch[-1])
        assert branch[-1].profile()["total_stress_1"] == pytest.approx(own.profile()["total_stress_1"], rel=1e-6)
