"""Beside bodies: tension fields, total charges, bending in verdicts, and meshes that are chosen for an accuracy.

References: shooting for a wrinkled disc under a plate (tests/contact_shooting.py), the voltage that a charge makes, finer elements.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.potential import potential_of
from femmembrane.solve import active_set
from femmembrane.solve.controls import PressureControl, VolumeControl
from femmembrane.solve.minimize import minimize

from ..contact_scenes import asking, contact_scene
from ..contact_shooting import WrinkledPlate, tube_on_a_rod, wrinkled_under_plate
from .test_contact import AT_05, BODIES, NH, once, plate


@cache
def known() -> WrinkledPlate:
    """Contact up to the deformed radius 0.2, wrinkles from the reference radius 0.900098 on."""
    return wrinkled_under_plate(0.55, 0.2, (0.75, 1.1))


def sliding(elements: int, degree: int, **more: object) -> fm.Scene:
    """A disc whose rim slides, under a plate."""
    return fm.Scene(
        material=NH, mesh=fm.cap(0.0, elements, rim="radial"), degree=degree, tension_field=True, obstacles=[fm.Plane(0.55)], **more
    )


def test_contact_and_wrinkles_together():
    """Pressure, radius of contact and border of the wrinkles; the force is pi a^2 P. Wrinkles end inside an element: errors are of second
    order, whatever the degree.
    """
    eq = fm.equilibrium(sliding(32, 2), volume=known().volume)
    assert eq.pressure == pytest.approx(known().pressure, abs=2e-5)
    assert eq.contact.radius == pytest.approx(0.2, abs=1e-5)
    assert eq.contact.reference_radius == pytest.approx(known().reference_radius, abs=1e-5)
    assert eq.contact.force == pytest.approx(np.pi * eq.contact.radius**2 * eq.pressure, rel=1e-9)
    zones = eq.zones("mechanical")
    assert zones.kinds == ("taut", "radial")
    assert zones.borders[0] == pytest.approx(known().wrinkled_from, abs=1e-3)
    for verdict in (eq.verdict("pressure"), eq.verdict("volume"), eq.verdict(azimuthal=2)):
        assert verdict.stable


@pytest.mark.parametrize(("degree", "elements", "within"), [(2, 16, 5e-6), (2, 32, 5e-7), (4, 12, 2e-10)])
def test_elements_that_follow_both_borders_keep_the_order(degree, elements, within):
    scene = sliding(elements, degree, follow_borders=True)
    eq = fm.equilibrium(scene, volume=known().volume)
    assert eq.pressure == pytest.approx(known().pressure, abs=within)
    assert eq.contact.radius == pytest.approx(0.2, abs=4 * within)
    assert eq.contact.reference_radius == pytest.approx(known().reference_radius, abs=4 * within)
    assert eq.zones("mechanical").borders[0] == pytest.approx(known().wrinkled_from, abs=4 * within)
    assert eq.contact.zones[0].followed


@pytest.mark.parametrize(("degree", "elements", "follow", "within"), [(2, 24, None, 2e-4), (2, 24, True, 4e-6), (4, 16, True, 1e-10)])
def test_a_wrinkled_tube_lies_on_a_rod(degree, elements, follow, within):
    """Contact within the wrinkles: there the pressure of contact is -P, and the mean of the wrinkles is on the rod."""
    known = tube_on_a_rod(0.7, -0.5, (1.6, 0.3))
    rod = fm.Cylinder(height=0.0, radius=0.7, length=1.6, rounding=0.3)
    scene = fm.Scene(material=NH, mesh=fm.cylinder(length=2.0, elements=elements), degree=degree, prestretch=1.5, obstacles=[rod])
    eq = fm.equilibrium(scene.replace(tension_field=True, follow_borders=follow), pressure=-0.5)
    assert eq.volume == pytest.approx(known.volume, abs=within)
    (zone,) = eq.contact.zones
    assert zone.followed
    assert (zone.start, zone.stop) == pytest.approx((1 - known.contact, 1 + known.contact), abs=within)
    assert zone.normal_force == pytest.approx(0.5 * 2 * np.pi * 0.7 * 2 * known.contact * known.stretch, rel=3 * within)
    assert eq.contact.pressure([1.0]) == pytest.approx(0.5, rel=1e-2 if degree == 2 else 1e-8)
    zones = eq.zones("mechanical")
    assert zones.kinds == ("taut", "radial", "taut")
    assert zones.zones[1].s == pytest.approx((1 - known.wrinkled, 1 + known.wrinkled), abs=4 * within if follow else 1e-2)


def test_minimiser_and_corrector_agree_on_a_tension_field():
    agree(sliding(24, 2), known().volume)


def agree(scene: fm.Scene, volume: float) -> None:
    """IPOPT with inequalities finds what the sets of held nodes end with, on the mesh of the scene; with both the branch is the same."""
    eq = fm.equilibrium(scene, volume=volume)
    assert eq.contact.touching
    potential = potential_of(scene)
    for control in (VolumeControl(volume), PressureControl(eq.pressure)):
        start = eq.potential.carried(eq.state)
        found, pressure, _, status = minimize(potential, control, start, eq.pressure)
        assert status == "Solve_Succeeded"
        result = active_set._on_mesh(once(control), control, potential, start, eq.pressure, 1.0)
        energy = potential.evaluate(found, pressure).energy - pressure * potential.evaluate(found, pressure).volume
        own = result.evaluation.energy - result.pressure * result.evaluation.volume
        assert energy == pytest.approx(own, rel=1e-9)
        assert pressure == pytest.approx(result.pressure, rel=1e-7)
    by = [fm.equilibrium(scene, volume=volume, solver=solver) for solver in ("ipopt", "newton")]
    assert by[0].pressure == pytest.approx(by[1].pressure, rel=1e-9)
    assert by[0].contact.radius == pytest.approx(by[1].contact.radius, rel=1e-9)


def test_a_branch_passes_a_touch_with_wrinkles():
    branch = fm.trace(sliding(24, 2), start=0.7, until={"volume": known().volume})
    assert [point.kind for point in branch.special_points if point.kind == "touch"] == ["touch"]
    assert branch[-1].pressure == pytest.approx(fm.equilibrium(sliding(24, 2), volume=known().volume).pressure, rel=1e-9)


def test_a_total_charge_in_contact_is_that_of_its_voltage():
    """The state, and the eigenvalues of waves around the axis; the charge stiffens the others."""
    charged = plate(elements=24, electric=fm.Electric(total_charge=2.0))
    eq = fm.equilibrium(charged, volume=1.2)
    voltage = eq.potential.electric_quantities(eq.state)["voltage"]
    same = fm.equilibrium(charged.replace(electric=fm.Electric(voltage=voltage)), volume=1.2)
    assert eq.contact.touching
    assert eq.pressure == pytest.approx(same.pressure, rel=1e-10)
    assert eq.contact.radius == pytest.approx(same.contact.radius, rel=1e-10)
    assert eq.verdict(azimuthal=2).smallest_eigenvalue == pytest.approx(same.verdict(azimuthal=2).smallest_eigenvalue, rel=1e-9)
    for control in ("pressure", "volume"):
        assert eq.verdict(control).smallest_eigenvalue > same.verdict(control).smallest_eigenvalue
    operator = eq.verdict(control="pressure", azimuthal=0).smallest_eigenvalue
    assert eq.frequencies(count=1)[0].eigenvalue == pytest.approx(operator, rel=1e-9)


def test_the_second_variation_of_a_charge_in_contact_is_that_of_its_energy():
    """The slope of P along the branch, dP/dV = 1/(V' . K^-1 V'), against central differences."""
    scene = plate(elements=24, electric=fm.Electric(total_charge=2.0))
    low, eq, high = (fm.equilibrium(scene, volume=v) for v in (1.1999, 1.2, 1.2001))
    evaluation = eq.potential.evaluate(eq.state, eq.pressure)
    slope = 1 / (evaluation.volume_gradient @ evaluation.factors().solve(evaluation.volume_gradient))
    assert (high.pressure - low.pressure) / 2e-4 == pytest.approx(slope, rel=2e-4)


def test_minimiser_and_corrector_agree_on_a_total_charge():
    agree(plate(elements=24, electric=fm.Electric(total_charge=2.0)), 1.2)


def test_a_branch_with_a_total_charge_touches():
    branch = fm.trace(plate(elements=16, electric=fm.Electric(total_charge=1.0)), start=0.7, until={"volume": 1.2})
    assert [point.kind for point in branch.special_points] == ["touch"]
    assert branch[-1].pressure == pytest.approx(fm.equilibrium(branch.scene, volume=1.2).pressure, rel=1e-9)


@pytest.mark.parametrize("name", ["plane", "ball"])
def test_bending_in_verdicts_beside_a_body(name):
    """Elements of degree 2, 4 and 6 agree: the contact holds the slope at its border, as an end that is held does. A thinner sheet is
    softer, and the limit is the membrane's.
    """

    def eigenvalues(elements, degree, ratio):
        scene = fm.Scene(
            material=NH,
            mesh=fm.disc(elements),
            degree=degree,
            obstacles=[BODIES[name]],
            bending=ratio is not None,
            radius_to_thickness=ratio,
        )
        eq = fm.equilibrium(scene, volume=1.2)
        asked = ({"control": "pressure"}, {"control": "volume"}, {"azimuthal": 1}, {"azimuthal": 3})
        return np.array([eq.verdict(**kind).smallest_eigenvalue for kind in asked])

    best = eigenvalues(24, 6, 50.0)
    np.testing.assert_allclose(eigenvalues(24, 4, 50.0), best, rtol=2e-3)
    np.testing.assert_allclose(eigenvalues(48, 2, 50.0), best, rtol=1e-2)
    bare, thin = eigenvalues(24, 4, None), eigenvalues(24, 4, 1000.0)
    assert (bare < thin).all()
    assert (thin < best).all()
    np.testing.assert_allclose(thin, bare, rtol=5e-3)


@pytest.mark.parametrize("name", [pytest.param("plane", marks=pytest.mark.slow), "ball"])
def test_a_border_of_contact_holds_the_slope_of_a_thin_sheet(name):
    """With bending a slope falls to that of the body over the length d = sqrt(D/N) of a boundary layer, as at an end that is held. To first
    order in d, which is T/R0 times a number, each adds 2 pi rho N phi^2 d to an eigenvalue, where phi is the turn of the mode, at a border
    of contact less that of the membrane on the body. Here d^2 = l1 W_11 l3^2/(12 W_1) (T/R0)^2.
    """
    a = {"plane": 0.358, "ball": 0.139}[name]  # about where contact ends
    radii = [0, a / 2, *np.linspace(a - 0.03, a + 0.09, 13), *np.linspace(a + 0.15, 0.88, 6), *np.linspace(0.9, 1.0, 11)]
    scene = fm.Scene(material=NH, mesh=fm.disc(radii=radii), degree=4, obstacles=[BODIES[name]])
    bare = fm.equilibrium(scene, volume=1.2)
    found = bare.verdict("pressure")
    space = bare.potential.space

    def turn(s):
        (_, u_s, _, w_s), (_, a_s, _, b_s) = space.displacement(bare.state, s), space.evaluate(found.coefficients, s)
        return ((1 + u_s) * b_s - w_s * a_s) / ((1 + u_s) ** 2 + w_s**2)

    def of_layer(outside, inside):
        s = np.array([outside])
        u, u_s, _, w_s = space.displacement(bare.state, s)
        l1, l2 = np.hypot(1 + u_s, w_s), 1 + u / s
        w_1, w_11, l3 = l1 - 1 / (l1**3 * l2**2), 1 + 3 / (l1**4 * l2**2), 1 / (l1 * l2)
        phi = turn(s) - (0.0 if inside is None else turn(np.array([inside])))
        return float((2 * np.pi * s * w_1 * phi**2 * np.sqrt(l1 * w_11 * l3**2 / (12 * w_1)))[0])

    border = bare.contact.zones[0].stop
    expected = of_layer(border + 1e-9, border - 1e-9) + of_layer(1 - 1e-9, None)
    slopes = []
    for ratio in (50.0, 100.0):
        eq = fm.equilibrium(scene.replace(bending=True, radius_to_thickness=ratio), volume=1.2)
        slopes.append(ratio * (eq.verdict("pressure").smallest_eigenvalue - found.smallest_eigenvalue))
    assert 2 * slopes[1] - slopes[0] == pytest.approx(expected, rel=5e-3)


def test_the_worst_waves_of_a_compressed_membrane_beside_a_ball():
    scene = fm.Scene(material=NH, mesh=fm.disc(24), obstacles=[BODIES["ball"]], bending=True, radius_to_thickness=50.0)
    eq = fm.equilibrium(scene, volume=1.2)
    worst = eq.verdict(azimuthal="all")
    assert worst.smallest_eigenvalue == min(eq.verdict(azimuthal=n).smallest_eigenvalue for n in range(1, 8))


@pytest.mark.parametrize("accuracy", [1e-3, 1e-5, 1e-7])
def test_a_mesh_for_an_accuracy_under_a_plate(accuracy):
    scene = fm.Scene(material=NH, mesh=fm.disc(accuracy=accuracy), obstacles=[fm.Plane(0.5)])
    eq = fm.equilibrium(scene, volume=AT_05[1])
    assert eq.pressure == pytest.approx(AT_05[0], rel=accuracy)
    assert eq.contact.zones[0].followed
    assert eq.scene.mesh.elements < 10


@pytest.mark.parametrize("seed", [pytest.param(seed, marks=[] if seed in (5, 17) else pytest.mark.slow) for seed in range(30)])
def test_promises_are_kept_in_contact(seed):
    """Against halved elements of two degrees more."""
    accuracy = 1e-6
    scene, volume = contact_scene(seed)
    eq = fm.equilibrium(asking(scene, accuracy), volume=volume, solver="newton")
    assert eq.contact.touching
    mesh = eq.scene.mesh
    finer = eq.scene.replace(mesh=mesh.on_ends(mesh.breakpoints()).refined(), degree=eq.scene.degree + 2)
    best = fm.equilibrium(finer, volume=volume, start=replace(eq, scene=finer, state=_carried(eq, finer), _answers={}), solver="newton")
    assert eq.pressure == pytest.approx(best.pressure, rel=accuracy)
    assert eq.energy == pytest.approx(best.energy, rel=accuracy)


def _carried(eq: fm.Equilibrium, scene: fm.Scene) -> np.ndarray:
    from femmembrane.solve.finer_space import transferred

    return transferred(eq.potential.space, eq.state, potential_of(scene).space)


def test_files_keep_both_borders(tmp_path):
    scene = sliding(12, 3, follow_borders=True)
    branch = fm.inflate(scene, volumes=[0.7, known().volume])
    assert branch[-1].on_branch.contact.radius == pytest.approx(0.2, abs=1e-3)
    branch.save(tmp_path / "branch.nc")
    again = fm.load(tmp_path / "branch.nc")
    for eq, loaded in zip(branch, again, strict=True):
        assert loaded.scene == eq.scene
        assert np.array_equal(loaded.state, eq.state)
        assert loaded.contact.touching == eq.contact.touching
    for name in ("pressure", "contact_radius", "contact_force"):
        np.testing.assert_array_equal(again.column(name), branch.column(name))
    assert again[-1].zones("mechanical").borders == branch[-1].zones("mechanical").borders
    assert again[-1].of_branch.contact.radius == branch[-1].of_branch.contact.radius


def test_outside_the_domain_of_the_energy_no_node_is_sure_of_its_force(monkeypatch):
    """A force scale that is infinite, as one outside the domain is, meets normals that are zero without a product of the two."""
    potential = potential_of(fm.Scene(material=NH, mesh=fm.disc(4), degree=2, obstacles=[fm.Plane(0.3)]))
    raw = potential.evaluate(np.zeros(potential.space.n_free), 0.0)
    for scale in ((np.inf, np.inf), (np.nan, 1.0)):
        monkeypatch.setattr(type(raw), "force_scale", lambda self, pressure, scale=scale: scale)
        judged = potential.judged(raw, potential.gaps(raw.x), 0.0)
        assert not judged.any()
