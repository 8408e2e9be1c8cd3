"""Cylinder and ring magnets: quadrature of loops, closed forms, derivatives, digits, bodies in the way, and what a catalogue gives."""

from __future__ import annotations

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest
from scipy.constants import mu_0

import femmembrane as fm
from femmembrane.accuracy.shooting import shoot
from femmembrane.accuracy.strong_form import Guess
from femmembrane.physics.magnetics import magnetic_energy_density
from femmembrane.physics.sources import loop_field
from femmembrane.potential import Family, Potential, potential_of
from femmembrane.potential.expressions import casadi_answers_numpy
from femmembrane.potential.nearby import Nearby
from femmembrane.scene.variation import Parameter, names
from femmembrane.solve.guess import spherical_dome
from femmembrane.stability.azimuthal_operator import azimuthal_operator
from tests.cases import OGDEN, disc_scene

CYLINDER = fm.Magnet(height=0.3, radius=0.5, length=0.8, strength=4.0)
RING = fm.Magnet(height=0.3, radius=0.5, length=0.8, strength=4.0, inner_radius=0.2, orientation=-1)
both = pytest.mark.parametrize("magnet", [CYLINDER, RING], ids=["cylinder", "ring"])
SCALES = fm.Scales(radius=12.5e-3, thickness=0.5e-3, shear_modulus=45e3)


def unit(radius, length, **more):
    """A magnet of magnetisation 1 about the origin."""
    area = radius**2 - more.get("inner_radius", 0.0) ** 2
    return fm.Magnet(0.0, radius, length, (area * length / 4) ** 2, **more)


def wall(a, length, rho, z):
    """A sheet of current 1 on a cylinder: its loops, of strength (a^2/4)^2 a length, by Gauss' rule on panels that shrink towards z."""
    nearest, steps = np.clip(z, -length / 2, length / 2), 0.5 ** np.arange(40)
    ends = np.concatenate([nearest + (length / 2 - nearest) * steps, [nearest], (nearest - (length / 2 + nearest) * steps)[::-1]])[::-1]
    nodes, weights = np.polynomial.legendre.leggauss(24)
    half = np.diff(ends) / 2
    t = (ends[:-1] + half)[:, None] + half[:, None] * nodes
    return np.array([(half[:, None] * weights * a**2 / 4 * part).sum() for part in loop_field(a, rho, z - t)])


# --- fields


@pytest.mark.parametrize(
    ("rho", "z"),
    [(0.3, 0.9), (1.2, 0.2), (0.52, 0.45), (0.5, 0.6), (0.49, 0.41), (0.6, 0.4), (0.6, 0.0), (1e-3, -0.7), (3.0, 4.0), (0.505, 0.1)],
)
def test_field_is_that_of_the_currents_around_it(rho, z):
    """Quadrature of loops over the wall; of a ring over both walls."""
    outer, inner = wall(0.5, 0.8, rho, z), wall(0.2, 0.8, rho, z)
    assert unit(0.5, 0.8).field(rho, z)[:2] == pytest.approx(outer, rel=0, abs=1e-12 * np.linalg.norm(outer))
    found = unit(0.5, 0.8, inner_radius=0.2).field(rho, z)[:2]
    assert found == pytest.approx(outer - inner, rel=0, abs=1e-12 * np.linalg.norm(outer))


def test_field_in_the_hole_of_a_ring():
    assert unit(0.5, 0.8, inner_radius=0.2).field(0.1, 0.1)[:2] == pytest.approx(
        wall(0.5, 0.8, 0.1, 0.1) - wall(0.2, 0.8, 0.1, 0.1), abs=1e-13
    )


@pytest.mark.parametrize("z", [0.4 + 1e-9, 0.4001, 0.5, 1.0, -0.7, 10.0, 1e3])
@pytest.mark.parametrize("a", [0.5, 0.01])
def test_on_the_axis(a, z):
    """(z+/s+ - z-/s-)/2 with s^2 = z^2 + a^2; a^2/(2 s (s + |z|)) is (1 - |z|/s)/2 without cancellation."""
    h_rho, h_z, _ = unit(a, 0.8).field(0.0, z)
    faces = [np.hypot(v, a) for v in (abs(z) - 0.4, abs(z) + 0.4)]
    discs = [a**2 / (2 * s * (s + v)) for s, v in zip(faces, (abs(z) - 0.4, abs(z) + 0.4), strict=True)]
    assert h_rho == 0
    assert h_z == pytest.approx(discs[0] - discs[1], rel=2e-15 * max(2.0, abs(z)))


@both
def test_far_away_it_is_a_dipole_of_the_same_strength(magnet):
    """Relative error of order (size/distance)^2."""
    angle, errors = np.array([0.0, 0.4, 1.1, math.pi / 2]), []
    for distance in (20.0, 40.0):
        rho, eta = distance * np.sin(angle), 0.3 + distance * np.cos(angle)
        expected = np.array(fm.Dipole(4.0, 0.3, magnet.orientation).field(rho, eta)[:2])
        errors.append(np.abs(np.array(magnet.field(rho, eta)[:2]) - expected).max() / np.abs(expected).max())
    assert errors[1] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)


@pytest.mark.parametrize("angle", [0.0, 1e-4, 0.01, 0.5, 1.5, math.pi / 2])
def test_a_tiny_magnet_keeps_its_digits(angle):
    """A thousandth of the distance in size: a dipole to 1e-6, by its next multipole to 1e-12, where ends cancel to a part in 10^10.

    For a = 1e-3 and l = 2 a c the potential is D (P1/d^2 + q P3/d^4), q = l^2/4 - 3 a^2/4, which vanishes for l = sqrt(3) a.
    """
    a, d = 1e-3, 3.0
    magnet = fm.Magnet(0.0, a, math.sqrt(3) * a, 9.0)
    point = d * math.sin(angle), d * math.cos(angle)
    expected = np.array(fm.Dipole(9.0, 0.0).field(*point)[:2])
    assert magnet.field(*point)[:2] == pytest.approx(expected, rel=0, abs=2e-12 * np.linalg.norm(expected))


@pytest.mark.parametrize("distance", [1e-2, 1e-4, 1e-6])
def test_next_to_an_edge(distance):
    """h_r = log(8 a/d)/(2 pi) - 1/pi up to d log d, above as beside the edge; h_z jumps by the angle over 2 pi around it.

    The logarithm is that of the mean of a loop's field along a wall (Jackson 1999, section 5.5, K for k -> 1), far of the other end.
    """
    magnet = unit(0.5, 1000.0)
    angle = np.array([-0.4, 0.0, 0.9, 2.0, 3.0])
    h_rho, h_z, _ = magnet.field(0.5 + distance * np.cos(angle), 500.0 + distance * np.sin(angle))
    far = 12 * distance * (1 + math.log(1 / distance))
    assert h_rho == pytest.approx((np.log(8 * 0.5 / distance) - 2) / (2 * np.pi) * np.ones(5), abs=far)
    assert h_z == pytest.approx((angle - 0.0) / (2 * np.pi), abs=far)


@both
@pytest.mark.parametrize("point", [(0.23, 0.9), (1e-5, 1.0), (0.51, 0.72), (0.5, 0.75), (2.0, 0.3), (0.7, -0.1)])
def test_derivatives(magnet, point):
    """Those written out against those of the formula, by CasADi: values, gradients and Hessians of |h|^2."""
    y = ca.SX.sym("y", 2)
    with casadi_answers_numpy():
        near = Nearby([magnet], y[0], y[1])
        rows = []
        for energy, place in ((near.sources[0].intensity(y[0], y[1]), near.placed), (magnet.intensity(y[0], y[1]), lambda *parts: parts)):
            hessian, gradient = ca.hessian(energy, y)
            rows.append(ca.Function("f", [y], list(place(energy, gradient, hessian)), {"cse": True}))
    written, formula = ([np.array(part) for part in f(point)] for f in rows)
    for one, other in zip(written, formula, strict=True):
        assert np.abs(one - other).max() <= 1e-11 * np.abs(other).max()
    assert rows[0].n_instructions() < 1800
    assert float(written[0].item()) == pytest.approx(magnet.intensity(*point), rel=1e-14)


def test_what_it_costs():
    """Operations at a point beside those of the membrane, 243: of a cylinder 917, of a ring 1734 (recorded on 2026-11-28)."""
    far, far_ring = fm.Magnet(3.0, 0.5, 0.8, 4.0), fm.Magnet(3.0, 0.5, 0.8, 4.0, inner_radius=0.2)
    costs = [Potential(disc_scene(OGDEN, elements=2).replace(sources=s)).operations for s in ((), (far,), (far_ring,))]
    assert costs[1] - costs[0] < 1000
    assert costs[2] - costs[0] < 1850
    assert Potential(disc_scene(OGDEN, (200.0, 6.5), elements=2)).operations == costs[0] + 97


# --- what a catalogue gives


def test_strength_follows_from_the_remanence():
    """M = (m/m_0)^2 with the moment m = B_r/mu0 pi a^2 l of the magnet, as for a dipole."""
    moment = 1.3 / mu_0 * math.pi * 5e-3**2 * 5e-3
    magnet = fm.Magnet(-0.6, 0.4, 0.4, remanence=1.3, scales=SCALES)
    assert magnet.strength == pytest.approx(SCALES.from_si("dipole_strength", moment), rel=1e-14)
    assert SCALES.to_si("remanence", magnet.magnetization) == pytest.approx(1.3, rel=1e-14)
    assert SCALES.to_si("magnetization", magnet.magnetization) == pytest.approx(1.3 / mu_0, rel=1e-14)
    ring = fm.Magnet(-0.6, 0.4, 0.4, remanence=1.3, scales=SCALES, inner_radius=0.2)
    assert ring.strength == pytest.approx(magnet.strength * 0.75**2, rel=1e-14)


def test_scene_files(tmp_path):
    scene = disc_scene(OGDEN, elements=4).replace(sources=[fm.Magnet(3.0, 0.5, 0.8, 4.0), fm.Magnet(-3.0, 0.5, 0.8, 1.0, inner_radius=0.2)])
    scene.to_toml(tmp_path / "scene.toml")
    assert fm.Scene.from_toml(tmp_path / "scene.toml") == scene
    table = {"kind": "magnet", "height": 3.0, "radius": 0.4, "length": 0.4, "remanence": 1.3}
    tables = {"material": {"model": "varga"}, "membrane": {"susceptibility": 1.0}, "source": [table]}
    scales = {"radius": 12.5e-3, "thickness": 0.5e-3, "shear_modulus": 45e3}
    read = fm.Scene.from_dict({**tables, "scales": scales})
    assert read.sources == (fm.Magnet(3.0, 0.4, 0.4, remanence=1.3, scales=SCALES),)
    assert fm.Scene.from_dict(read.to_dict()) == read
    for change, message in (
        ({}, r"source.scales = None: scales are needed beside a remanence in T"),
        ({"strength": 1.0}, r"one of strength and remanence"),
        ({"remanense": 1.0}, r"source.remanense = 1.0: unknown; did you mean 'remanence'"),
    ):
        with pytest.raises(fm.InputError, match=message):
            fm.Scene.from_dict({**tables, "source": [table | change]})
    with pytest.raises(fm.InputError, match=r"source.strength = None: missing; give it, or the remanence in T"):
        fm.Scene.from_dict({**tables, "source": [{k: v for k, v in table.items() if k != "remanence"}]})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"radius": 0.0}, r"source.radius = 0.0: a finite number > 0"),
        ({"length": -1.0}, r"source.length = -1.0"),
        ({"strength": -1.0}, r"source.strength = -1.0"),
        ({"height": math.nan}, r"source.height = nan"),
        ({"inner_radius": 0.5}, r"source.inner_radius = 0.5: .*less than the radius"),
        ({"inner_radius": -0.1}, r"source.inner_radius = -0.1"),
        ({"orientation": 0}, r"source.orientation = 0"),
        ({"strength": None}, r"source.strength = \[\]: one of strength and remanence"),
        ({"remanence": 1.0}, r"source.strength = \['remanence', 'strength'\]: one of strength and remanence"),
        ({"strength": None, "remanence": 1.0}, r"source.scales = None: scales are needed"),
        ({"strength": None, "remanence": -1.0, "scales": SCALES}, r"source.remanence = -1.0: a number >= 0"),
        ({"strength": None, "remanence": "1.3 T", "scales": SCALES}, r"source.remanence = '1.3 T'"),
        ({"strength": True}, r"source.strength = True"),
    ],
)
def test_unusable_numbers(change, message):
    with pytest.raises(fm.InputError, match=message):
        fm.Magnet(**({"height": 3.0, "radius": 0.5, "length": 0.8, "strength": 4.0} | change))


def test_iron_in_rubber():
    """Maxwell Garnett (1904): 3 f for few grains whose susceptibility is large, that of the grains where nothing else is left."""
    assert fm.maxwell_garnett(30.0, math.inf) == pytest.approx(0.9 / 0.7, rel=1e-15)
    assert fm.maxwell_garnett(1e-6, 1e6) == pytest.approx(3e-8, rel=1e-5)
    assert (fm.maxwell_garnett(0, 5), fm.maxwell_garnett(100, 5)) == (0, pytest.approx(5))
    assert fm.maxwell_garnett(20.0, 0.01) == pytest.approx(0.2 * 0.01, rel=0.01)  # weak grains do not feel each other
    for percent in (0.0, 3.0, 45.6, 100.0):
        assert fm.iron_content(fm.maxwell_garnett(percent)) == pytest.approx(percent, rel=1e-13)
    assert fm.iron_content(2.5, math.inf) == pytest.approx(100 * 2.5 / 5.5)
    for call, message in (
        (lambda: fm.maxwell_garnett(120), "percent = 120: a number from 0 to 100"),
        (lambda: fm.maxwell_garnett(100, math.inf), "percent = 100: less than 100"),
        (lambda: fm.maxwell_garnett(30, 0), "grains = 0: a number > 0"),
        (lambda: fm.iron_content(2000), "susceptibility = 2000: a finite number from 0 to that of the grains, 1000"),
        (lambda: fm.iron_content(math.nan), "susceptibility = nan"),
    ):
        with pytest.raises(fm.InputError, match=message):
            call()


# --- a body


def test_distances_from_the_body():
    rho, eta = np.array([0.1, 0.3, 0.8, 0.3, 0.8]), np.array([0.0, 0.0, 0.0, 1.0, 1.1])
    assert CYLINDER.distance_squared(rho, eta) == pytest.approx([0, 0, 0.09, 0.09, 0.25])
    assert RING.distance_squared(rho, eta) == pytest.approx([0.01, 0, 0.09, 0.09, 0.25])
    assert CYLINDER.singular_squared(rho, eta)[2] == pytest.approx(0.09 + 0.01)
    assert np.isnan(CYLINDER.field(rho, eta)[1]).tolist() == [True, True, False, False, False]
    assert np.isnan(RING.field(rho, eta)[1]).tolist() == [False, True, False, False, False]
    # with a body of its own it is an obstacle, on which a branch goes on, and nothing that ends it
    held_off = dataclasses.replace(CYLINDER, body=True)
    assert np.isinf(held_off.distance_squared(rho, eta)).all()
    assert held_off.singular_squared(rho, eta)[2] == pytest.approx(0.09 + 0.01)


def test_a_pole_goes_through_a_cylinder_and_through_the_hole_of_a_ring():
    for before, after, met in ((-0.2, 0.8, True), (0.8, 0.3, True), (0.8, 0.71, False), (-1.0, -0.2, False)):
        assert CYLINDER.passed(before, after) is CYLINDER.passed(after, before) is met
        assert not RING.passed(before, after)


@pytest.mark.parametrize(
    ("height", "more", "met"),
    [
        (0.0, {}, True),
        (0.399, {}, True),
        (-0.4, {}, True),
        (0.401, {}, False),
        (0.0, {"radius": 1.4, "inner_radius": 1.1}, False),
        (0.0, {"radius": 1.4, "inner_radius": 0.999}, True),
        (0.0, {"radius": 1e-6, "length": 1e-6}, True),
        (0.0, {"radius": 0.3, "inner_radius": 0.29, "length": 0.01}, True),
    ],
)
def test_a_magnet_in_the_membrane_is_refused(height, more, met):
    magnet = fm.Magnet(**({"height": height, "radius": 0.5, "length": 0.8, "strength": 1.0} | more))
    scene = disc_scene(OGDEN, elements=2)
    if not met:
        assert scene.replace(sources=[magnet]).sources
        return
    with pytest.raises(fm.InputError, match=rf"source.height = {height}: the membrane meets the magnet at rest; move it off"):
        scene.replace(sources=[magnet])


def test_a_curved_membrane_around_a_magnet():
    """A magnet in a sphere is allowed, one that reaches through it is not."""
    scene = disc_scene(OGDEN, elements=4).replace(mesh=fm.sphere(4))
    assert scene.replace(sources=[fm.Magnet(0.0, 0.3, 1.8, 1.0)]).sources
    with pytest.raises(fm.InputError, match="the membrane meets the magnet at rest"):
        scene.replace(sources=[fm.Magnet(0.0, 0.3, 2.1, 1.0)])
    with pytest.raises(fm.InputError, match="the membrane meets the magnet at rest"):
        scene.replace(sources=[fm.Magnet(0.5, 0.9, 0.1, 1.0)])


# --- membranes


def magnetic_scene(*sources, elements=16, degree=5):
    return disc_scene(OGDEN, elements=elements, degree=degree).replace(sources=sources)


def test_a_cylinder_is_a_solenoid_from_outside():
    """Another formula for the same field: at this distance a stack of loops is exact to round-off."""
    magnet, solenoid = (
        fm.equilibrium(magnetic_scene(source, elements=8, degree=3), center_height=1.2)
        for source in (fm.Magnet(2.5, 0.6, 0.8, 0.5), fm.Solenoid(0.5, 2.5, 0.6, 0.8, loops=16))
    )
    assert magnet.pressure == pytest.approx(solenoid.pressure, rel=1e-11)
    assert magnet.magnetic_energy == pytest.approx(solenoid.magnetic_energy, rel=1e-11)
    values = [eq.verdict(azimuthal=1).smallest_eigenvalue for eq in (magnet, solenoid)]
    assert values[0] == pytest.approx(values[1], rel=1e-8)
    plain = fm.equilibrium(magnetic_scene(elements=8, degree=3), center_height=1.2)
    assert abs(magnet.pressure - plain.pressure) > 1e-2


@pytest.mark.slow
@pytest.mark.parametrize("more", [{}, {"inner_radius": 0.4}], ids=["cylinder", "ring"])
def test_shooting_agrees(more):
    scene = magnetic_scene(fm.Magnet(2.5, 0.6, 0.8, 0.5, **more))
    eq = fm.equilibrium(scene, center_height=1.2)
    found = shoot(scene, center_height=1.2, guess=Guess.of(eq))
    assert found.converged
    assert (eq.pressure, eq.volume) == pytest.approx((found.pressure, found.volume), rel=1e-8)
    assert eq.magnetic_energy == pytest.approx(found.magnetic_energy, rel=1e-8)


def test_a_small_magnet_is_felt_as_a_dipole():
    """Difference of order radius^2 in P."""
    dipole = fm.equilibrium(magnetic_scene(fm.Dipole(200.0, 4.0)), volume=2.0).pressure
    sizes = [fm.equilibrium(magnetic_scene(fm.Magnet(4.0, r, r, 200.0)), volume=2.0).pressure - dipole for r in (0.1, 0.05, 1e-4)]
    assert sizes[0] / sizes[1] == pytest.approx(4, rel=0.05)
    assert abs(sizes[2]) < 1e-6 * dipole


@pytest.mark.parametrize("elements", [12, 32])
def test_a_membrane_stops_at_a_magnet(elements):
    """The pole comes to the face at height 1.3, on any mesh; its field there is smooth, and no mesh needs to resolve it."""
    scene = magnetic_scene(fm.Magnet(1.5, 0.4, 0.4, 0.01), elements=elements, degree=3)
    branch = fm.trace(scene, start=0.3, until={"center_height": 5.0}, throw=False)
    assert branch.status is fm.Status.DIPOLE_CONTACT
    assert 1.299 < branch[-1].center_height < 1.3
    assert "came within 0.001 of a source" in branch.message


def test_no_state_lies_behind_a_magnet():
    """A height of the pole within the body, from a state before it."""
    scene = magnetic_scene(fm.Magnet(1.5, 0.4, 0.4, 0.01), elements=8, degree=3)
    with pytest.raises(fm.SolveError) as raised:
        fm.equilibrium(scene, center_height=1.6, start=fm.equilibrium(scene, center_height=1.0))
    assert raised.value.status is fm.Status.DIPOLE_CONTACT


def test_a_membrane_bulges_into_a_ring():
    """Through the hole, where it would be contact with a cylinder of the same size, until it touches the wall."""
    hole = magnetic_scene(fm.Magnet(0.9, 2.0, 0.4, 0.01, inner_radius=1.5), elements=16, degree=3)
    eq = fm.equilibrium(hole, center_height=1.2)
    assert eq.verdict("volume").stable
    branch = fm.trace(hole, start=eq, until={"volume": 100.0}, throw=False)
    assert branch.status is fm.Status.DIPOLE_CONTACT
    assert branch[-1].profile()["rho"].max() == pytest.approx(1.5, abs=2e-3)


@pytest.mark.parametrize("name", [f"source.0.{n}" for n in ("height", "radius", "length", "strength", "inner_radius")])
def test_every_number_can_be_followed(name):
    scene = magnetic_scene(fm.Magnet(3.0, 1.2, 0.5, 20.0, inner_radius=0.4), elements=4, degree=2)
    assert name in names(scene)
    parameter = Parameter(scene, name)
    value = 1.1 * parameter.value
    family, member = Family(scene, parameter.vary), Potential(parameter.scene_at(value))
    x = 0.01 * np.random.default_rng(0).normal(size=family.space.n_free)
    one, other = family.evaluate(x, 1.0, value), member.evaluate(x, 1.0)
    assert one.magnetic_energy == pytest.approx(other.magnetic_energy, rel=1e-12)
    assert one.gradient == pytest.approx(other.gradient, rel=1e-10, abs=1e-12)
    d = 1e-5 * value
    difference = (family.evaluate(x, 1.0, value + d).gradient - family.evaluate(x, 1.0, value - d).gradient) / (2 * d)
    assert family.number_derivative(x, 1.0, value) == pytest.approx(difference, rel=1e-6, abs=1e-8 * np.abs(difference).max())


def test_third_derivatives_along_a_mode():
    """What following a fold needs, through the derivatives that are written out: against differences."""
    scene = magnetic_scene(fm.Magnet(2.0, 0.5, 0.5, 5.0), elements=4, degree=2)
    family = Family(scene, Parameter(scene, "source.0.height").vary)
    rng = np.random.default_rng(0)
    x, v, w = (0.05 * rng.normal(size=family.space.n_free) for _ in range(3))
    cubic = family.fold_derivatives(x, 1.0, 2.0, v, 0.0).cubic @ w
    e = 1e-3

    def gradient(y):
        found = family.evaluate(y, 1.0, 2.0)
        return found.gradient - found.volume_gradient

    def second(y):
        return v @ (gradient(y + e * v) - gradient(y - e * v)) / (2 * e)

    assert cubic == pytest.approx((second(x + e * w) - second(x - e * w)) / (2 * e), rel=1e-3)


def test_waves_around_the_axis_feel_the_second_derivatives():
    """At n = 0 the operator is the axisymmetric one, entry by entry."""
    potential = potential_of(magnetic_scene(fm.Magnet(3.0, 0.5, 0.8, 20.0), elements=4, degree=2))
    x = spherical_dome(potential, 1.0)
    band = potential.evaluate(x, 1.3).band
    np.testing.assert_allclose(azimuthal_operator(potential, x, 1.3, 0).band, band, rtol=0, atol=1e-11 * np.abs(band).max())


def test_beside_another_magnet():
    """Energies of fields that add up; two opposite magnets in one place are none."""
    rho, eta = np.array([0.3, 0.9]), np.array([1.1, 1.5])
    other = fm.Magnet(0.3, 0.5, 0.8, 4.0, orientation=-1)
    assert magnetic_energy_density([CYLINDER, other], 2.5, rho, eta) == pytest.approx([0, 0], abs=1e-28)
    below, above = (fm.Magnet(h, 0.5, 0.8, 4.0) for h in (-2.0, 2.0))
    scene = magnetic_scene(below, above, fm.Dipole(1.0, 3.5), elements=4, degree=2)
    total = sum(np.array(s.field(0.4, 0.1)) for s in scene.sources)
    assert potential_of(scene).field_energy(np.array([0.4]), np.array([0.1]))[0] == pytest.approx(-2.5 / 2 * (total**2).sum(), rel=1e-13)


def test_outline():
    """A solid of revolution: of a ring a closed line, of a cylinder one from axis to axis."""
    assert np.array(RING.outline().points) == pytest.approx(np.array([(0.2, -0.1), (0.5, -0.1), (0.5, 0.7), (0.2, 0.7), (0.2, -0.1)]))
    assert np.array(CYLINDER.outline().points) == pytest.approx(np.array([(0.0, -0.1), (0.5, -0.1), (0.5, 0.7), (0.0, 0.7)]))
    assert CYLINDER.outline().moment == -RING.outline().moment == 1


@pytest.mark.parametrize(
    "effects",
    [{"demagnetization": True}, {"demagnetization": True, "saturation": 3.0}, {"remanence": 0.2, "remanence_direction": "normal"}],
    ids=["self-field", "saturation", "remanence"],
)
def test_a_magnetised_sheet_feels_the_derivatives_that_are_written_out(effects):
    """As beside a stack of loops, whose field CasADi differentiates; verdicts too."""
    magnet, solenoid = (
        fm.equilibrium(magnetic_scene(source, elements=4, degree=4).replace(**effects), center_height=0.8)
        for source in (fm.Magnet(2.5, 0.6, 0.8, 0.5), fm.Solenoid(0.5, 2.5, 0.6, 0.8, loops=16))
    )
    assert magnet.pressure == pytest.approx(solenoid.pressure, rel=1e-12)
    values = [eq.verdict(azimuthal=1).smallest_eigenvalue for eq in (magnet, solenoid)]
    assert values[0] == pytest.approx(values[1], rel=1e-10)
