"""Derivatives with respect to numbers of the scene while a membrane lies on bodies, against solving again at neighbouring values.

The values solved again are extrapolated to step 0, and their doubt is below what is asked for. Ends of elements follow the borders of
contact in all of them unless it is said.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.scene.variation import Parameter, parameter_of

from ..contact_shooting import under_plate

NH = fm.NeoHookean()
OF = ("pressure", "volume", "center_height", "energy", "contact_radius", "contact_reference_radius", "contact_force", "contact_area")
HEIGHT = "obstacle.0.height"


def scene(elements=16, **more):
    return fm.Scene(**{"material": NH, "mesh": fm.disc(elements), **more})


def extrapolated(answer, step):
    """Derivative at 0 and how far it is to be trusted."""
    slopes = [(answer(h) - answer(-h)) / (2 * h) for h in (step, step / 2, step / 4)]
    fourth = [(4 * b - a) / 3 for a, b in pairwise(slopes)]
    best = (16 * fourth[1] - fourth[0]) / 15
    return best, np.abs(best - fourth[1])


def again(eq, name, hold, answer, share=3e-4):
    """Derivative of an answer by solving again."""
    parameter = parameter_of(eq.scene, name)
    bare = eq.scene.bordered(())

    def at(t):
        number = parameter_of(bare, name)
        return answer(fm.equilibrium(number.scene_at(number.value + t), **hold, start=eq, solver="newton"))

    return extrapolated(at, share * abs(parameter.value))


def values(eq):
    return np.array([getattr(eq.contact, name[8:]) if name.startswith("contact_") else getattr(eq, name) for name in OF])


BALL = scene(obstacles=[fm.Ball(1.0, 0.5)])
PLATES = [fm.Plane(1.2), fm.Plane(-1.25, side="above")]
CASES = {
    "radius of a ball": (BALL, "obstacle.0.radius", {"volume": 1.1}),
    "height of a ball": (BALL, HEIGHT, {"pressure": 1.4}),
    "edge of a cylinder": (scene(32, obstacles=[fm.Cylinder(0.8, 0.3, 0.5, rounding=0.2)]), "obstacle.0.rounding", {"volume": 1.2}),
    "prestretch": (scene(obstacles=[fm.Ball(1.0, 0.5)], prestretch=1.2), "membrane.prestretch", {"volume": 1.8}),
    "place of the rim": (
        scene(mesh=fm.disc(16, rim={"kind": "clamped", "radius": 1.1}), obstacles=[fm.Plane(0.5)]),
        "mesh.rim.radius",
        {"pressure": 1.6},
    ),
    "material": (scene(material=fm.MooneyRivlin(0.1), obstacles=[fm.Ball(1.0, 0.5)]), "material.ratio", {"volume": 1.1}),
    "two plates": (scene(mesh=fm.sphere(32), obstacles=PLATES), "obstacle.1.height", {"volume": 11.0}),
    "mesh that stays": (scene(obstacles=[fm.Plane(0.5)], follow_borders=False), HEIGHT, {"volume": 1.1}),
    "total charge": (scene(obstacles=[fm.Plane(0.5)], electric=fm.Electric(total_charge=0.5)), HEIGHT, {"volume": 1.1}),
}


@pytest.mark.parametrize("name", CASES)
def test_state_and_contact(name):
    own, to, hold = CASES[name]
    eq = fm.equilibrium(own, **hold)
    assert eq.contact.touching
    assert bool(eq.scene.borders) is (name != "mesh that stays")
    mine = eq.sensitivity(OF, to, held=next(iter(hold)))
    expected, doubt = again(eq, to, hold, values, 1e-5 if name == "mesh that stays" else 3e-4)
    kept = list(range(len(OF))) if name != "mesh that stays" else [0, 1, 2, 3, 6]  # radii are those of nodes
    size = np.abs(values(eq)) / abs(eq.number(to))
    assert np.array([mine[q] for q in OF])[kept] == pytest.approx(expected[kept], rel=1e-7, abs=1e-8 * size.max())
    assert (doubt[kept] <= 1e-7 * (np.abs(expected) + size)[kept]).all()


def test_numbers_of_a_magnet_and_its_body():
    magnet = fm.Magnet(height=0.9, radius=0.4, length=0.5, strength=1e-3, body=True)
    eq = fm.equilibrium(scene(64, sources=[magnet], susceptibility=0.5), volume=1.4)
    to = ["source.0.height", "source.0.radius", "source.0.strength"]
    mine = eq.sensitivity("pressure", to, held="volume")
    for name in to:
        expected, _ = again(eq, name, {"volume": 1.4}, lambda changed: changed.pressure, 1e-4)
        assert mine[name] == pytest.approx(expected, rel=1e-6)


def test_the_plate_of_the_shooting_code():
    """P and V of the disc under a plate over its height H and the radius a of contact: at a held volume dP/dH = P_H - P_a V_H/V_a."""
    height, radius, guess = 0.5, 0.3, (1.2, 1.3)

    def shot(h, a):
        found = under_plate(h, a, guess)
        return np.array([found.pressure, found.volume])

    by_height = extrapolated(lambda t: shot(height + t, radius), 2e-3)[0]
    by_radius = extrapolated(lambda t: shot(height, radius + t), 2e-3)[0]
    radius_rate = -by_height[1] / by_radius[1]
    eq = fm.equilibrium(scene(24, degree=4, obstacles=[fm.Plane(height)]), volume=float(shot(height, radius)[1]))
    found = eq.sensitivity(["pressure", "contact_radius"], HEIGHT, held="volume")
    assert found["pressure"] == pytest.approx(by_height[0] + by_radius[0] * radius_rate, rel=1e-6)
    assert found["contact_radius"] == pytest.approx(radius_rate, rel=1e-6)


@pytest.mark.parametrize("against", [{"control": "pressure"}, {"control": "volume"}, {"azimuthal": 1}, {"azimuthal": 3}])
def test_eigenvalues(against):
    eq = fm.equilibrium(BALL, volume=1.2)
    mine = eq.sensitivity("eigenvalue", "obstacle.0.radius", held="volume", **against)
    hold = {"volume": 1.2}
    expected, _ = again(eq, "obstacle.0.radius", hold, lambda changed: changed.verdict(**against).smallest_eigenvalue, 1e-3)
    assert mine == pytest.approx(expected, rel=1e-7)


def test_profiles_on_both_sides_of_the_border():
    """The border sweeps over places next to it: there they are differentiated on their own side."""
    eq = fm.equilibrium(BALL, volume=1.1)
    border = eq.contact.reference_radius
    r, of = np.array([0.05, border - 1e-4, border + 1e-4, 0.6]), ["rho", "eta", "stretch_1", "mechanical_stress_2"]
    mine = eq.sensitivity(of, "obstacle.0.radius", held="volume", r=r)

    def rows(changed):
        profile = changed.profile(r)
        return np.stack([profile[name] for name in of])

    expected, _ = again(eq, "obstacle.0.radius", {"volume": 1.1}, rows, 3e-5)
    assert np.stack([mine[name] for name in of]) == pytest.approx(expected, rel=1e-6, abs=1e-8)
    at, behind = (eq.sensitivity("stretch_1", "obstacle.0.radius", held="volume", r=[border + beside])[0] for beside in (0.0, 1e-9))
    assert at == pytest.approx(behind, rel=1e-6)


def test_an_enclosed_gas():
    own = scene(obstacles=[fm.Plane(0.5)], chamber=fm.Chamber(volume=2.0, atmosphere=1.0))
    eq = fm.equilibrium(own, volume=1.1)
    at_volume, stiffness = (eq.sensitivity("pressure", HEIGHT, held="volume"), rise(own, 1.1))
    # P + A = n/(V + C): with dP = P_H dH + P_V dV and (P + A) dV + (V + C) dP = 0
    slope = -(eq.pressure + 1.0) / (1.1 + 2.0)
    assert eq.sensitivity("pressure", HEIGHT, held="gas") == pytest.approx(at_volume * slope / (slope - stiffness), rel=1e-7)
    assert eq.sensitivity("gas_amount", HEIGHT, held="volume") == pytest.approx(at_volume * 3.1, rel=1e-12)


def rise(own, volume):
    """dP/dV of a scene."""
    return extrapolated(lambda t: fm.equilibrium(own, volume=volume + t).pressure, 1e-3)[0]


def test_scales_in_si_units():
    """At a held volume the force over mu T R0 and the radius of contact stay while the thickness changes."""
    scales = fm.Scales(radius=0.02, thickness=3e-4, shear_modulus=4e5)
    eq = fm.equilibrium(scene(obstacles=[fm.Plane(0.5)], scales=scales), volume=1.1)
    found = eq.sensitivity(["contact_force_n", "contact_radius_m", "contact_radius"], ["scales.thickness", HEIGHT], held="volume")
    assert found["contact_force_n"]["scales.thickness"] == pytest.approx(4e5 * 0.02 * eq.contact.force, rel=1e-9)
    assert abs(found["contact_radius"]["scales.thickness"]) < 1e-10
    assert found["contact_radius_m"][HEIGHT] == pytest.approx(0.02 * found["contact_radius"][HEIGHT], rel=1e-12)


def test_nothing_has_a_derivative_at_a_touch():
    """One-sided derivatives differ there: on the free side that of the height of the plate is zero, on the other it is not."""
    plate = scene(obstacles=[fm.Plane(0.5)])
    branch = fm.trace(plate, start=0.6, until={"volume": 1.0})
    touch = next(p.equilibrium for p in branch.special_points if p.kind == "touch")
    with pytest.raises(fm.SolveError, match="touched without a force"):
        touch.sensitivity("pressure", HEIGHT)
    free = [eq for eq in branch if not eq.contact.touching][-1]
    assert free.sensitivity("pressure", HEIGHT) == 0
    assert branch[-1].sensitivity("pressure", HEIGHT) < -0.1
    with pytest.raises(fm.InputError, match="a body is touched"):
        free.sensitivity("contact_force", HEIGHT)


def test_a_limit_point_in_contact():
    """Its pressure exactly; its volume and radius to the error of the mesh, as the rates of its curve are."""

    own = scene(degree=3, obstacles=[fm.Plane(1.0)])

    def limit(changed):
        branch = fm.trace(changed, start=2.7, until={"volume": 6.5}, max_steps=300)
        return [p for p in branch.special_points if p.kind == "limit_point"][-1]

    point = limit(own)
    assert point.equilibrium.contact.touching
    mine = point.sensitivity(["pressure", "volume", "contact_radius"], HEIGHT)

    def answer(t):
        found = limit(Parameter(own, HEIGHT).scene_at(1.0 + t))
        return np.array([found.pressure, found.volume, found.equilibrium.contact.radius])

    expected = (answer(2e-3) - answer(-2e-3)) / 4e-3
    assert mine["pressure"] == pytest.approx(expected[0], rel=1e-5)
    assert (mine["volume"], mine["contact_radius"]) == pytest.approx(tuple(expected[1:]), rel=5e-4)


def test_a_whole_branch():
    rates = fm.inflate(scene(obstacles=[fm.Plane(0.5)]), volumes=[0.5, 1.0, 1.1, 1.2]).sensitivity("pressure", HEIGHT, held="volume")
    assert rates[0] == 0
    assert (rates[1:] < 0).all()
