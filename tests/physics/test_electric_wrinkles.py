"""The tension field under voltage and charge: closed forms, differences of its own energy, and states that it holds."""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.physics.response import response_of
from femmembrane.physics.tension_field import natural_strains
from femmembrane.potential import potential_of
from tests.cases import OGDEN

DISC = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8), degree=4, tension_field=True)
STRAINS = np.random.default_rng(3).uniform(-0.5, 0.7, (2, 300))


def relaxed(square, material=None, charge=False):
    electric = fm.Electric(frozen_charge=1.0) if charge else fm.Electric(voltage=1.0)
    return response_of(DISC.replace(material=material or fm.NeoHookean(), electric=electric), square)


def test_natural_width():
    """neo-Hookean: m = -e/2 - log(1 - psi^2 l^2)/4, up to its end at psi l = 1, and -e/2 + log(1 + q^2)/4 under a frozen charge."""
    e = np.linspace(-0.3, 1.0, 14)
    width, exists = relaxed(0.09).width(e)
    assert exists.all()
    assert width == pytest.approx(-e / 2 - np.log1p(-0.09 * np.exp(2 * e)) / 4, rel=1e-12, abs=1e-14)
    assert not relaxed(0.09).width(np.array([np.log(1 / 0.3) + 0.01]))[1].any()
    width, exists = relaxed(0.5, charge=True).width(e)
    assert exists.all()
    assert width == pytest.approx(-e / 2 + np.log1p(0.5) / 4, abs=1e-13)


def test_slack_strain():
    """s = v at equal strains: exists up to the pull-in phi^2 = 3/4 4^(-1/3) = 0.4724703937; under a frozen charge always, l^6 = 1 + q^2."""
    for square, found in ((0.3, True), (0.47, True), (0.475, False), (2.0, False)):
        e, exists = relaxed(square).slack_strain()
        assert bool(exists) is found
        if found:
            stretch = np.exp(e)
            assert stretch**2 - stretch**-4 == pytest.approx(square * stretch**4, rel=1e-12)
        slack = np.stack(relaxed(square).stress(np.array([-0.2]), np.array([-0.3])))
        assert np.isnan(slack).all() if not found else (slack == 0).all()
    e, exists = relaxed(2.0, charge=True).slack_strain()
    assert exists
    assert np.exp(6 * e) == pytest.approx(3.0, rel=1e-12)


@pytest.mark.parametrize("charge", [False, True], ids=["voltage", "charge"])
@pytest.mark.parametrize("material", [fm.NeoHookean(), OGDEN, fm.MooneyRivlin(0.2), fm.Gent(30.0)], ids=lambda m: type(m).__name__)
def test_differences(material, charge):
    """Stress is the derivative of the energy everywhere, and the tangent that of stress but on the borders of zones."""
    response, (e1, e2), h = relaxed(0.1, material, charge), STRAINS, 1e-6

    def whole(a, b):
        return response.energy(a, b) + response.electric_energy(a, b)

    slopes = [(whole(e1 + h, e2) - whole(e1 - h, e2)) / (2 * h), (whole(e1, e2 + h) - whole(e1, e2 - h)) / (2 * h)]
    assert np.stack(response.stress(e1, e2)) == pytest.approx(np.stack(slopes), abs=1e-8)
    left, right = response.stress(e1 - h, e2), response.stress(e1 + h, e2)
    below, above = response.stress(e1, e2 - h), response.stress(e1, e2 + h)
    slopes = [(right[0] - left[0]) / (2 * h), (above[0] - below[0]) / (2 * h), (above[1] - below[1]) / (2 * h)]
    off = np.abs(np.stack(response.tangent(e1, e2)) - np.stack(slopes))
    assert (off < 1e-7).mean() > 0.99


def test_without_field_it_is_the_plain_one():
    e1, e2 = STRAINS
    assert np.stack(relaxed(0.0).natural(e1, e2)) == pytest.approx(np.stack(natural_strains(e1, e2)), abs=1e-15)


def test_wrinkles_are_a_local_minimum():
    """No strain between the given ones and natural ones has less energy; the stress across wrinkles is that of the field."""
    response, (e1, e2) = relaxed(0.15), STRAINS
    n1, n2, taut1, taut2 = response.natural(e1, e2)
    taken = response.energy(e1, e2) + response.electric_energy(e1, e2)
    for share in np.linspace(0, 1, 7):
        a, b = e1 + share * (n1 - e1), e2 + share * (n2 - e2)
        assert (response.taut.energy(a, b) + response.taut.electric_energy(a, b) >= taken - 1e-14).all()
    wrinkled = (taut1 == 1) & (taut2 == 0)
    assert wrinkled.any()
    mechanical = response.mechanical_stress(e1, e2)[1][wrinkled]
    assert mechanical == pytest.approx(response.field_squared(e1, e2)[wrinkled], rel=1e-10)


@pytest.mark.parametrize("material", [fm.NeoHookean(), fm.Ogden.treloar(), fm.Hooke(0.3)], ids=lambda m: type(m).__name__)
@pytest.mark.parametrize("tension_field", [False, True])
def test_the_potential_has_the_same_response(material, tension_field):
    """What elements compute is what formulas say, where there is no state, and so no number, as well."""
    scene = DISC.replace(material=material, electric=fm.Electric(voltage=1.0), tension_field=tension_field)
    scale = 0.3 if isinstance(material, fm.Hooke) else 1.0
    e1, e2 = scale * STRAINS
    lost = 0
    for square in (0.02, 0.4, 0.8, 3.0):
        response = response_of(scene, np.full_like(e1, square))
        expected = np.stack([*response.stress(e1, e2), *response.tangent(e1, e2)])
        found = potential_of(scene).response(e1, e2, np.full_like(e1, square))
        np.testing.assert_allclose(found[:2], expected[:2], rtol=1e-9, atol=1e-12)
        lost += int(np.isnan(found[0]).sum())
    assert bool(lost) == (tension_field or isinstance(material, fm.Hooke))


def test_branch():
    """Along a relaxed branch dE/dV = P, and at one volume dE/dphi = -Q with the capacitance of the wrinkled width."""
    scene = DISC.replace(electric=fm.Electric(voltage=0.3))
    at, h = 0.3, 1e-4
    eq = fm.equilibrium(scene, volume=at)
    assert "radial" in {zone.kind for zone in eq.zones("mechanical")}
    a, b = (fm.equilibrium(scene, volume=at + k * h) for k in (-1, 1))
    assert (b.energy - a.energy) / (2 * h) == pytest.approx(eq.pressure, rel=1e-5)
    a, b = (fm.equilibrium(scene.replace(electric=fm.Electric(voltage=0.3 + k * h)), volume=at) for k in (-1, 1))
    assert (b.energy - a.energy) / (2 * h) == pytest.approx(-eq.charge, rel=1e-6)
    held = fm.equilibrium(scene.replace(electric=fm.Electric(total_charge=eq.charge)), volume=at)
    assert (held.pressure, held.voltage) == pytest.approx((eq.pressure, 0.3), rel=1e-7)
    assert all(eq.verdict(azimuthal=n).stable for n in (1, 2))


def test_cold_start_under_a_high_voltage():
    """Much of the film is wrinkled there; the same state as along the branch over the voltage."""
    scene = DISC.replace(mesh=fm.disc(12), electric=fm.Electric(voltage=0.0))
    phi = np.sqrt(0.38)
    branch = fm.trace(scene, over="electric.voltage", hold={"volume": 0.9}, until={"electric.voltage": phi}, max_steps=100)
    cold = fm.equilibrium(scene.replace(electric=fm.Electric(voltage=phi)), volume=0.9)
    assert cold.pressure == pytest.approx(branch[-1].pressure, rel=1e-8)
    assert cold.verdict("pressure").stable


@pytest.mark.parametrize("electric", [{"voltage": 0.5}, {"total_charge": 1.5}], ids=str)
@pytest.mark.parametrize("tension_field", [False, True])
def test_rate_of_the_forces_while_a_voltage_is_turned_on(electric, tension_field):
    """By central differences; it is no difference of the whole where forces are not linear in the squared voltage."""
    scene = DISC.replace(electric=fm.Electric(**electric), tension_field=tension_field)
    potential, h = potential_of(scene), 1e-4
    r = potential.space.interpolation_points()
    x = potential.space.interpolate(-0.35 * r * (1 - r**2), 0.3 * (1 - r**4))
    a, at, b = (potential.evaluate(x, 0.3, 0.6 + k * h) for k in (-1, 0, 1))
    found = potential.factor_derivative(at, 0.3, 0.6)
    np.testing.assert_allclose(found, (b.gradient - a.gradient) / (2 * h), rtol=0, atol=1e-4 * np.abs(found).max())
