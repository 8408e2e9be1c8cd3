"""Voltage and charge: closed forms of the sphere and of the flat disc, tables of an independent solver, and laws that hold everywhere."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import jn_zeros

import femmembrane as fm
from femmembrane.accuracy.shooting import Guess, shoot
from femmembrane.potential import potential_of
from femmembrane.potential.family import Family
from femmembrane.scene.variation import Parameter
from femmembrane.solve.banded import band_product
from femmembrane.solve.controls import PressureControl, VolumeControl
from femmembrane.solve.minimize import minimize
from femmembrane.solve.pull_in import moduli
from femmembrane.views.report import report
from tests.cases import OGDEN, effect

DISC = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), degree=6)
SPHERE = fm.Scene(material=fm.NeoHookean(), mesh=fm.sphere(8), degree=4)
PHI = np.sqrt(0.1)


def under(scene, **electric):
    return scene.replace(electric=fm.Electric(**electric))


def ball(stretch):
    """Volume of the sphere of that radius."""
    return 4 * np.pi / 3 * stretch**3


@pytest.mark.parametrize("point", effect("voltage_0.1_neo"), ids=lambda p: f"height {p['center_height']:.2f}")
def test_reference(point):
    """A spectral Ritz solver by others (data/effects.json)."""
    eq = fm.equilibrium(under(DISC, voltage=PHI), center_height=point["center_height"])
    for quantity in ("pressure", "volume", "energy"):
        assert getattr(eq, quantity) == pytest.approx(point[quantity], rel=2e-9), quantity


@pytest.mark.parametrize("point", effect("voltage_0.15_dipole_above"), ids=lambda p: f"height {p['center_height']:.2f}")
def test_reference_with_a_dipole(point):
    scene = under(DISC, voltage=np.sqrt(0.15)).replace(material=OGDEN, sources=[fm.Dipole(100, 6.0)], susceptibility=2.5)
    eq = fm.equilibrium(scene, center_height=point["center_height"])
    for quantity in ("pressure", "volume", "energy"):
        assert getattr(eq, quantity) == pytest.approx(point[quantity], rel=1e-9), quantity


@pytest.mark.parametrize(
    ("height", "pressure", "eigenvalues"),
    [
        (0.5, 0.698949591, (5.114740428, 11.022444333, 16.819536635)),
        (1.0, 1.291522161, (4.228757675, 14.074485120, 23.683370590)),
    ],
)
def test_azimuthal_eigenvalues(height, pressure, eigenvalues):
    """A spectral Galerkin solver with forms of its own, to 2e-8: phi^2 = 0.1, waves n = 1, 2, 3."""
    eq = fm.equilibrium(under(DISC, voltage=PHI), center_height=height)
    assert eq.pressure == pytest.approx(pressure, rel=1e-9)
    assert [eq.verdict(azimuthal=n).smallest_eigenvalue for n in (1, 2, 3)] == pytest.approx(eigenvalues, rel=5e-8)


def test_operations():
    """A scene without voltage has the operations that it had (test_shapes.py); a voltage costs one exponential and what goes with it."""
    plain = potential_of(DISC).operations
    assert potential_of(under(DISC, voltage=0.0)) is potential_of(DISC)
    assert plain < potential_of(under(DISC, voltage=PHI)).operations <= plain + 15


@pytest.mark.parametrize("stretch", [1.2, 1.345270266, 1.5])
@pytest.mark.parametrize("electric", [{"voltage": PHI}, {"frozen_charge": 0.7}, {"total_charge": 0.7 * 4 * np.pi}], ids=str)
def test_sphere(stretch, electric):
    """P = 2 (1/l - l^-7 - phi^2 l); a charge q for each reference area has phi = q/l^4."""
    eq = fm.equilibrium(under(SPHERE, **electric), volume=ball(stretch))
    square = 0.1 if "voltage" in electric else 0.49 * stretch**-8
    assert eq.pressure == pytest.approx(2 * (1 / stretch - stretch**-7 - square * stretch), rel=1e-9)
    assert eq.electric_field == pytest.approx(np.sqrt(square) * stretch**2, rel=1e-5)
    capacitance = 4 * np.pi * stretch**4
    if "frozen_charge" in electric:
        assert np.isnan(eq.voltage)
        assert eq.electric_energy == pytest.approx(4 * np.pi * 0.49 / 2 * stretch**-4, rel=1e-9)
    else:
        assert (eq.voltage, eq.capacitance) == pytest.approx((np.sqrt(square), capacitance), rel=1e-9)
        sign = -1 if "voltage" in electric else 1
        assert eq.electric_energy == pytest.approx(sign * square * capacitance / 2, rel=1e-9)
    assert eq.charge == pytest.approx(np.sqrt(square) * capacitance, rel=1e-9)


def test_limit_and_pear_of_a_sphere():
    """phi^2 = 0.1: limit point phi^2 = 7 l^-8 - l^-2, onset of the pear at l = (3/phi^2)^(1/8)."""
    branch = fm.trace(under(SPHERE, voltage=PHI), start=ball(1.2), until={"volume": ball(1.6)})
    limit = next(point for point in branch.special_points if point.kind == "limit_point")
    assert (limit.volume, limit.pressure) == pytest.approx((ball(1.345270266), 0.966815462), rel=1e-8)
    pear = (3 / 0.1) ** (1 / 8)
    before, after = (
        fm.equilibrium(under(SPHERE, voltage=PHI), volume=ball(pear * k), solver="newton").verdict("volume") for k in (0.99, 1.01)
    )
    assert before.stable is True
    assert after.stable is False
    at = fm.equilibrium(under(SPHERE, voltage=PHI), volume=ball(pear), solver="newton")
    assert at.pressure == pytest.approx(0.899392049, rel=1e-8)
    assert at.verdict("volume").smallest_eigenvalue == pytest.approx(0, abs=1e-6)


def test_fold_of_the_disc():
    """phi^2 = 0.1: P = 1.313627680 at V = 1.877006, by an independent Ritz solver."""
    branch = fm.trace(under(DISC, voltage=PHI), start=1.5, until={"volume": 2.2})
    limit = next(point for point in branch.special_points if point.kind == "limit_point")
    assert limit.pressure == pytest.approx(1.313627680, rel=1e-9)
    assert limit.volume == pytest.approx(1.877006, rel=3e-6)
    assert float(limit.equilibrium.profile([0.0])["stretch_1"][0]) == pytest.approx(1.778048, rel=3e-6)


def test_energy_along_a_branch():
    """dE/dV = P, and at one volume dE/dphi = -Q."""
    h = 1e-4
    a, b = (fm.equilibrium(under(DISC, voltage=PHI), volume=1.5 + k * h) for k in (-1, 1))
    eq = fm.equilibrium(under(DISC, voltage=PHI), volume=1.5)
    assert (b.energy - a.energy) / (2 * h) == pytest.approx(eq.pressure, rel=1e-7)
    a, b = (fm.equilibrium(under(DISC, voltage=PHI + k * h), volume=1.5) for k in (-1, 1))
    assert (b.energy - a.energy) / (2 * h) == pytest.approx(-eq.charge, rel=1e-7)
    assert eq.charge == pytest.approx(PHI * eq.capacitance, rel=1e-14)
    bare = fm.equilibrium(under(DISC, voltage=0.0), volume=1.5)  # electrodes without voltage have a capacitance
    near = fm.equilibrium(under(DISC, voltage=1e-6), volume=1.5)
    assert (bare.voltage, bare.charge) == (0, 0)
    assert bare.capacitance == pytest.approx(near.capacitance, rel=1e-9)


@pytest.mark.parametrize("electric", [{"voltage": PHI}, {"frozen_charge": 0.5}], ids=str)
def test_shooting(electric):
    """The strong form has the same response: shooting agrees with the elements."""
    scene = under(DISC, **electric)
    eq = fm.equilibrium(scene, center_height=0.8)
    found = shoot(scene, center_height=0.8, guess=Guess.of(eq))
    assert (found.pressure, found.volume) == pytest.approx((eq.pressure, eq.volume), rel=1e-9)


def test_stresses():
    """Total stress is the mechanical one less the square of the true field; T/R0 = 0 to round-off here."""
    shape = fm.equilibrium(under(DISC, voltage=PHI).replace(radius_to_thickness=1e30), volume=1.5).profile()
    square = 0.1 * (shape["stretch_1"] * shape["stretch_2"]) ** 2
    assert shape["electric_field"] ** 2 == pytest.approx(square, rel=1e-12)
    for k in ("1", "2"):
        assert shape[f"total_stress_{k}"] == pytest.approx(shape[f"mechanical_stress_{k}"] - square, abs=1e-12)


def charged(scene, x, pressure=0.0):
    """Gradient of E_Q - P V, and the whole of its second derivatives."""
    evaluation = potential_of(scene).evaluate(x, pressure)
    kd = potential_of(scene).space.half_bandwidth
    whole = np.stack([band_product(evaluation.band, kd, column) for column in np.eye(x.size)], axis=1)
    return -evaluation.unbalanced, whole + np.outer(evaluation.spring, evaluation.spring)


@pytest.mark.parametrize("tension_field", [False, True])
def test_derivatives_of_a_total_charge(tension_field):
    """By central differences of energy and gradient, at a state that is no equilibrium, wrinkled on the outside."""
    scene = under(DISC, total_charge=0.8).replace(mesh=fm.disc(3), degree=3, tension_field=tension_field)
    space = potential_of(scene).space
    r = space.interpolation_points()
    x = space.interpolate(-0.35 * r * (1 - r**2), 0.5 * (1 - r**4))
    gradient, second = charged(scene, x, 0.3)
    h, direction = 1e-5, np.random.default_rng(1).standard_normal(x.size)
    a, b = (potential_of(scene).evaluate(x + k * h * direction, 0.3) for k in (1, -1))
    slope = (a.energy - 0.3 * a.volume - b.energy + 0.3 * b.volume) / (2 * h)
    assert gradient @ direction == pytest.approx(slope, rel=1e-7)
    assert second @ direction == pytest.approx((b.unbalanced - a.unbalanced) / (2 * h), rel=1e-5, abs=1e-5)


def test_a_total_charge_passes_the_limit_of_the_voltage():
    """A sphere has l^6 = 1 + q^2 at P = 0, and the largest voltage, pull-in, at q^2 = 3: nothing happens to the charge there."""
    for q in (0.5, np.sqrt(3), 3.0):
        stretch = 1.001 * (1 + q**2) ** (1 / 6)
        eq = fm.equilibrium(under(SPHERE, total_charge=4 * np.pi * q), volume=ball(stretch), solver="newton")
        assert eq.pressure == pytest.approx(2 * (1 / stretch - (1 + q**2) / stretch**7), rel=1e-7)
        assert eq.voltage == pytest.approx(q / stretch**4, rel=1e-8)


@pytest.mark.parametrize("q", [0.8, 3.0])
def test_held_by_its_charge_or_its_voltage(q):
    """Beyond the limit point of the voltage a held charge takes one negative direction away, breathing; pears stay (q^2 > 3)."""
    stretch = (1 + q**2) ** (1 / 6) * 1.02
    eq = fm.equilibrium(under(SPHERE, total_charge=4 * np.pi * q), volume=ball(stretch), solver="newton")
    other = fm.equilibrium(under(SPHERE, voltage=eq.voltage), volume=eq.volume, solver="newton")
    assert other.pressure == pytest.approx(eq.pressure, rel=1e-8)
    counts = [found.potential.evaluate(found.state, found.pressure).negative for found in (eq, other)]
    assert counts[0] == counts[1] - (q > 1)
    assert eq.verdict("pressure").stable is (q < 1)
    for control in ("pressure", "volume"):
        smallest = other.verdict(control).smallest_eigenvalue
        assert eq.verdict(control, electric="voltage").smallest_eigenvalue == pytest.approx(smallest, rel=1e-6)
        smallest = eq.verdict(control).smallest_eigenvalue
        assert other.verdict(control, electric="charge").smallest_eigenvalue == pytest.approx(smallest, rel=1e-6)
    assert "the voltage held" in other.verdict("pressure").reason
    # at n = 0 the operator of waves is the same one
    assert eq.frequencies(count=1)[0].eigenvalue == pytest.approx(eq.verdict("pressure").smallest_eigenvalue, rel=1e-6)


def test_verdicts_of_a_charged_sphere():
    """The breathing mode is the softest of those with l = 0: its eigenvalue is dP/dl l^2 .../..., negative beyond (7 (1 + q^2))^(1/6)."""
    limit = (7 * 1.49) ** (1 / 6)
    for electric in ({"total_charge": 0.7 * 4 * np.pi}, {"frozen_charge": 0.7}):
        branch = fm.trace(under(SPHERE, **electric), start=ball(0.97 * limit), until={"volume": ball(1.03 * limit)})
        point = next(p for p in branch.special_points if p.kind == "limit_point")
        assert point.volume == pytest.approx(ball(limit), rel=1e-7)
        assert [branch[k].verdict("pressure").stable for k in (0, -1)] == [True, False]
        assert all(branch[k].verdict("volume").stable for k in (0, -1))


def test_electrodes_on_a_part():
    """Elements end where electrodes do: eight of degree 6 have all digits. Tension goes on there, and the stretch along it does not."""
    part = {"voltage": 0.4, "start": 0.0, "stop": 0.53}
    coarse, fine = (fm.equilibrium(under(DISC, **part).replace(mesh=fm.disc(n)), volume=1.2) for n in (8, 24))
    assert coarse.pressure == pytest.approx(fine.pressure, rel=1e-11)
    assert coarse.capacitance == pytest.approx(fine.capacitance, rel=1e-11)
    assert not under(DISC, voltage=0.4, start=0.0, stop=1.0).element_ends
    for degree, accuracy in ((6, 5e-5), (2, 2e-4)):  # of low degree slopes are recovered from each side alone
        eq = fm.equilibrium(under(DISC, **part).replace(degree=degree), volume=1.2)
        shape = eq.profile([0.53 - 1e-9, 0.53 + 1e-9])
        tension = shape["total_stress_1"] / shape["stretch_1"]
        assert tension[0] == pytest.approx(tension[1], rel=1e-3 if degree == 2 else 5e-4)
        assert shape["stretch_1"] == pytest.approx([1.307774, 1.124646], rel=accuracy)  # of the finest of these meshes
        assert shape["electric_field"][1] == 0


def test_flat_disc_under_tension():
    """Transverse modes of a disc stretched to p: omega^2 = j_nm^2 (1 - p^-6 - phi^2 p^2), whose zero is the loss of tension."""
    p = 2.0
    scene = DISC.replace(prestretch=p)
    for phi in (0.0, 0.3, 0.49):
        eq = fm.equilibrium(under(scene, voltage=phi), pressure=0.0)
        assert eq.volume == 0
        for n in (0, 1, 2):
            exact = jn_zeros(n, 1)[0] ** 2 * (1 - p**-6 - phi**2 * p**2)
            assert min(abs(mode.eigenvalue / exact - 1) for mode in eq.frequencies(azimuthal=n)) < 1e-8
    with pytest.raises(fm.SolveError, match="compressive") as error:
        fm.equilibrium(under(scene, voltage=0.5), volume=0.0)
    assert error.value.status is fm.Status.LEGENDRE_FAILURE


def test_fold_curve_over_the_voltage():
    """The limit point of a sphere over phi: phi^2 = 7 l^-8 - l^-2."""
    branch = fm.trace(under(SPHERE, voltage=0.2), start=ball(1.2), until={"volume": ball(1.5)})
    limit = next(point for point in branch.special_points if point.kind == "limit_point")
    curve = fm.fold_curve(under(SPHERE, voltage=0.2), start=limit, parameter="electric.voltage", bounds=(0.1, 0.45))
    assert len(curve) > 3
    stretch = np.cbrt(np.array(curve.volume) * 3 / (4 * np.pi))
    assert np.array(curve.values) ** 2 == pytest.approx(7 * stretch**-8 - stretch**-2, rel=1e-6)


@pytest.mark.parametrize("direction", [1, -1])
def test_fold_curve_over_a_total_charge(direction):
    """The limit point of a sphere over Q = 4 pi q: l^6 = 7 (1 + q^2), down to q = 0 and through q^2 = 3, where all pears are neutral."""
    scene, limit = under(SPHERE, total_charge=4 * np.pi * 0.7), (7 * 1.49) ** (1 / 6)
    branch = fm.trace(scene, start=ball(0.97 * limit), until={"volume": ball(1.03 * limit)})
    (start,) = branch.special_points
    bounds = (0.0, 4 * np.pi * 2.5)
    curve = fm.fold_curve(scene, start=start, parameter="electric.total_charge", bounds=bounds, direction=direction)
    q = np.array(curve.values) / (4 * np.pi)
    assert curve.values[-1] == bounds[direction > 0]
    assert np.cbrt(np.array(curve.volume) * 3 / (4 * np.pi)) == pytest.approx((7 * (1 + q**2)) ** (1 / 6), rel=1e-9)


@pytest.mark.parametrize("tension_field", [False, True])
@pytest.mark.parametrize(
    ("number", "value"),
    [("electric.total_charge", 0.3), ("material.jm", 30.0), ("membrane.prestretch", 1.05), ("material.poisson_ratio", 0.3)],
)
def test_third_derivatives_of_a_total_charge(number, value, tension_field):
    """What a fold curve needs, by central differences of the quadratic form; electrodes on a part."""
    material = fm.Hooke(0.3) if number == "material.poisson_ratio" else fm.Gent(30.0)
    scene = DISC.replace(material=material, mesh=fm.disc(4), degree=3, tension_field=tension_field, prestretch=1.01)
    scene = under(scene, total_charge=0.3, start=0.2, stop=0.53)
    parameter = Parameter(scene, number)
    family = Family(scene, parameter.vary, scene_at=parameter.scene_at)
    r = family.space.interpolation_points()
    rise = 0.2 if number == "material.poisson_ratio" else 0.5
    x = family.space.interpolate((-0.3 if tension_field else -0.05) * r * (1 - r**2), rise * (1 - r**4))
    mode, direction = np.random.default_rng(1).standard_normal((2, x.size))

    def form(step, pressure, change):
        at = family.evaluate(x + step * direction, 0.4 + pressure, value + change)
        return at.inner(mode, mode) - 2 * 0.3 * (at.volume_gradient @ mode)

    found, h = family.fold_derivatives(x, 0.4, value, mode, 0.3), 1e-6
    slopes = [(form(*(h * step)) - form(*(-h * step))) / (2 * h) for step in np.eye(3)]
    assert (found.cubic @ direction, found.cubic_pressure, found.cubic_number) == pytest.approx(slopes, rel=2e-6)


@pytest.mark.parametrize("tension_field", [False, True])
@pytest.mark.parametrize("charge", [1e-12, 0.8])
def test_ipopt_with_a_total_charge(charge, tension_field):
    """The voltage as an unknown with the charge as its equation: IPOPT ends where Newton's method does, also without a charge."""
    scene = under(DISC, total_charge=charge).replace(mesh=fm.disc(8), degree=4, tension_field=tension_field)
    exact, potential = fm.equilibrium(scene, volume=0.9, solver="newton"), potential_of(scene)
    for control, factor in ((VolumeControl(0.9), 1.0), (PressureControl(exact.pressure), 1.0), (VolumeControl(0.9), 0.0)):
        x, pressure, iterations, status = minimize(potential, control, 1.05 * exact.state, exact.pressure, magnetic=factor)
        assert status == "Solve_Succeeded"
        assert 0 < iterations < 10
        wanted = exact if factor else fm.equilibrium(under(scene, voltage=0.0), volume=0.9)
        assert pressure == pytest.approx(wanted.pressure, rel=1e-8)
        assert x == pytest.approx(wanted.state, abs=1e-8)
    assert fm.equilibrium(scene, volume=0.9, solver="ipopt").voltage == pytest.approx(exact.voltage, rel=1e-9)


def test_a_charge_beyond_all_bounds_is_a_number_that_is_none():
    """Outside the domain of the energy a charge has no voltage, and a search goes on from there."""
    scene = under(DISC, total_charge=3.0, start=0.2, stop=0.6).replace(mesh=fm.disc(8), degree=4, tension_field=True)
    with pytest.raises(fm.SolveError, match="no equilibrium was found"):
        fm.equilibrium(scene, volume=0.9, solver="newton")


def test_units():
    """eps = 4.7 eps0, Phi = 5 kV, T = 0.5 mm, mu = 45 kPa: phi^2 = 0.0924771."""
    scales = fm.Scales(radius=0.05, thickness=5e-4, shear_modulus=45e3)
    scene = DISC.replace(scales=scales)
    eq = fm.equilibrium(under(scene, voltage=5e3, relative_permittivity=4.7, breakdown=5e7), volume=1.0)
    assert eq.voltage**2 == pytest.approx(0.0924771, rel=1e-6)
    same = fm.equilibrium(under(DISC, voltage=eq.voltage), volume=1.0)
    assert same.pressure == pytest.approx(eq.pressure, rel=1e-12)
    charge = eq.charge * 0.05**2 * np.sqrt(4.7 * 8.8541878e-12 * 45e3)
    held = fm.equilibrium(under(scene, total_charge=charge, relative_permittivity=4.7), volume=1.0)
    assert (held.pressure, held.voltage) == pytest.approx((eq.pressure, eq.voltage), rel=1e-7)
    thickness = 5e-4 / np.exp(np.log(eq.profile()["stretch_1"] * eq.profile()["stretch_2"]))
    assert eq.breakdown_ratio == pytest.approx((5e3 / thickness).max() / 5e7, rel=0.02)  # at a node, not at a quadrature point


@pytest.mark.parametrize(
    ("electric", "key"),
    [
        ({}, "electric.voltage"),
        ({"voltage": 0.3, "total_charge": 1.0}, "electric.total_charge"),
        ({"voltage": -0.3}, "electric.voltage"),
        ({"voltage": "high"}, "electric.voltage"),
        ({"voltage": np.nan}, "electric.voltage"),
        ({"voltage": 0.3, "from": 0.5, "to": 0.4}, "electric.to"),
        ({"voltage": 0.3, "to": 1.5}, "electric.to"),
        ({"voltage": 0.3, "from": -0.1}, "electric.from"),
        ({"voltage": 0.3, "from": 1.0}, "electric.from"),
        ({"voltage": 0.3, "from": 0.5, "to": 0.5 + 1e-13}, "electric.to"),
        ({"total_charge": 0.3, "from": 1 - 1e-13}, "electric.from"),
        ({"voltage": 0.3, "breakdown": 0.0}, "electric.breakdown"),
        ({"voltage": 0.3, "relative_permittivity": -4.7}, "electric.relative_permittivity"),
        ({"voltage": 5e3, "relative_permittivity": 4.7}, "electric.relative_permittivity"),
        ({"voltage": 0.3, "voltages": 1}, "electric.voltages"),
    ],
    ids=str,
)
def test_bad_input(electric, key):
    with pytest.raises(fm.InputError) as error:
        fm.Scene.from_dict({**DISC.to_dict(), "electric": electric})
    assert error.value.key == key


def test_scene_files():
    for scene in (
        under(DISC, voltage=0.3, start=0.1, stop=0.6, breakdown=2.0),
        under(SPHERE, total_charge=1.5),
        under(DISC, frozen_charge=0.2),
        under(DISC, voltage=0.0),
    ):
        assert fm.Scene.from_dict(scene.to_dict()) == scene
    assert DISC.replace(electric=fm.Electric(voltage=0.3, start=0.1)).to_dict()["electric"] == {"voltage": 0.3, "from": 0.1}


def test_columns_and_files(tmp_path):
    """What is electric is written where something is electric, and read back."""
    branch = fm.inflate(under(DISC, voltage=PHI, breakdown=2.0), volumes=[1.0, 1.5])
    frame = branch.to_dataframe()
    assert {"electric_energy", "voltage", "charge", "capacitance", "electric_field", "breakdown_ratio"} <= set(frame)
    assert frame["voltage"].tolist() == pytest.approx([PHI, PHI])
    branch.save(tmp_path / "branch.nc")
    again = fm.load(tmp_path / "branch.nc")
    assert again[1].electric_energy == branch[1].electric_energy
    assert again[1].charge == branch[1].charge
    assert not {"electric_energy", "voltage"} & set(fm.inflate(DISC, volumes=[1.0]).to_dataframe())
    assert not {"voltage", "capacitance"} & set(fm.inflate(under(DISC, frozen_charge=0.2), volumes=[1.0]).to_dataframe())


def test_columns_in_si_units(tmp_path):
    """V, C, F and V/m where the scene has scales and a permittivity: Q = C U, and E = U over the thickness that is left."""
    scene = DISC.replace(scales=fm.Scales(radius=0.05, thickness=5e-4, shear_modulus=45e3))
    volts = under(scene, voltage=5e3, relative_permittivity=4.7, breakdown=5e7)
    branch = fm.vary(volts, "electric.voltage", [5e3, 2.5e3, 0.0], hold={"volume": 1.0})
    frame = branch.to_dataframe()
    assert frame["voltage_v"].tolist() == pytest.approx([5e3, 2.5e3, 0.0])
    np.testing.assert_allclose(frame["capacitance_f"], 8.8541878e-12 * 4.7 * 0.05**2 / 5e-4 * frame["capacitance"], rtol=1e-7)
    np.testing.assert_allclose(frame["charge_c"], frame["voltage_v"] * frame["capacitance_f"], rtol=1e-12)
    np.testing.assert_allclose(frame["breakdown_ratio"], frame["electric_field_v_per_m"] / 5e7, rtol=1e-12)
    assert frame["electric_field_v_per_m"][0] == pytest.approx(frame["electric_field"][0] / frame["voltage"][0] * 5e3 / 5e-4, rel=1e-12)
    assert frame["charge_c"][2] == frame["electric_field"][2] == frame["breakdown_ratio"][2] == 0
    assert "charge in µC" in str(branch)
    branch.save(tmp_path / "branch.nc")
    again = fm.load(tmp_path / "branch.nc")
    assert again.to_dataframe().equals(frame)
    variables = branch.to_xarray()
    assert (variables["voltage_v"].attrs["units"], variables["electric_field_v_per_m"].dims) == ("V", ("step",))
    assert variables["electric_field_profile"].dims == ("step", "node")
    assert branch[0].profile()["electric_field_v_per_m"].max() == pytest.approx(frame["electric_field_v_per_m"][0], rel=0.02)
    axes = branch.plot(x="voltage", y="charge", units="si")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("voltage in kV", "charge in µC")
    page = report(branch, units="si")
    assert "Voltage and charge" in page
    assert "0 of the breakdown field" in page
    numbers = fm.inflate(under(scene, voltage=0.3), volumes=[1.0])  # without a permittivity nobody knows the volts
    assert not {"voltage_v", "charge_c"} & set(numbers.to_dataframe())
    assert numbers.plot(x="voltage", y="pressure", units="si").get_xlabel().startswith("voltage φ")


def test_pulled_in():
    """Ogden's rubber loses its stiffness in the plane while it is in tension: a status of its own, and no eigenvalue."""
    scene = under(DISC, voltage=PHI).replace(material=fm.Ogden.treloar(), mesh=fm.disc(12), degree=4)
    branch = fm.trace(scene, start=1.5, until={"volume": 40.0}, max_steps=80)
    assert branch.status is fm.Status.PULLED_IN
    assert "no stiffness along the meridian" in branch.message
    assert min(branch[-1].profile()["total_stress_1"]) > 0


@pytest.mark.parametrize("square", [0.02, 0.1, 0.2, 0.4])
def test_stiffness_in_the_plane(square):
    """The condition in closed form against the acoustic tensor of 400 directions, at homogeneous strains of the material."""
    scene = under(DISC, voltage=np.sqrt(square)).replace(material=fm.Ogden.treloar())
    rng = np.random.default_rng(2)
    angles = np.linspace(0, np.pi, 400)
    for e1, e2 in rng.uniform(-0.1, 1.4, (40, 2)):
        d11, d22, mixed, shear = moduli(potential_of(scene), *(np.array([e]) for e in (e1, e2)), np.array([square]))
        closed = bool((d11 > 0) & (d22 > 0) & (shear > 0) & (np.sqrt(np.abs(d11 * d22)) + shear > np.abs(mixed)))
        tensor = np.array(
            [
                [d11 * np.cos(angles) ** 2 + shear * np.sin(angles) ** 2, mixed * np.cos(angles) * np.sin(angles)],
                [mixed * np.cos(angles) * np.sin(angles), d22 * np.sin(angles) ** 2 + shear * np.cos(angles) ** 2],
            ]
        )
        scanned = np.linalg.eigvalsh(tensor.transpose(2, 0, 1)).min()
        assert closed == (scanned > 0) or abs(scanned) < 1e-3 * shear


@pytest.mark.parametrize("electric", [{"voltage": 0.4}, {"total_charge": 0.5}, {"frozen_charge": 0.4}], ids=str)
@pytest.mark.parametrize("tension_field", [False, True])
def test_uneven_sheet_with_everything(electric, tension_field):
    """Energy and gradient agree on an uneven sheet with electrodes on a part, beside a dipole and a weight; so does stiffness."""
    scene = under(DISC, **electric, start=0.2, stop=0.7).replace(
        mesh=fm.disc(4),
        degree=3,
        thickness="1 - 0.4*R**2",
        modulus="1 + 0.3*R",
        sources=[fm.Dipole(100, 6.0)],
        susceptibility=2.5,
        loads=[fm.Weight(weight=0.2)],
        tension_field=tension_field,
    )
    potential = potential_of(scene)
    r = potential.space.interpolation_points()
    x = potential.space.interpolate(-0.2 * r * (1 - r**2), 0.6 * (1 - r**4))
    evaluation, h = potential.evaluate(x, 0.3), 1e-6
    direction = np.random.default_rng(4).standard_normal(x.size)
    a, b = (potential.evaluate(x + k * h * direction, 0.3) for k in (1, -1))
    slope = (a.energy - 0.3 * a.volume - b.energy + 0.3 * b.volume) / (2 * h)
    assert -evaluation.unbalanced @ direction == pytest.approx(slope, rel=1e-6)
    other = np.random.default_rng(5).standard_normal(x.size)
    change = (b.unbalanced - a.unbalanced) @ other / (2 * h)
    assert evaluation.inner(direction, other) == pytest.approx(change, rel=1e-5)
    assert evaluation.electric_energy != 0
    assert evaluation.load_energy != 0


def test_charge_in_a_gas():
    """With a gas as well two borders stiffen the membrane: each class is stiffer than the one before."""
    gas = fm.Gas(amount=6.0, chamber=3.0, atmosphere=1.0)
    eq = fm.equilibrium(under(DISC, total_charge=0.8), gas=gas)
    found = [eq.verdict(c, electric=e).smallest_eigenvalue for c in ("pressure", "gas", "volume") for e in ("voltage", "charge")]
    assert found[0] < found[1] < found[3] < found[5] + 1e-9
    assert found[0] < found[2] < found[4] + 1e-9
