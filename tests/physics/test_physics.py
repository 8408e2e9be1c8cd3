"""Formulas: strain energies, strains, the dipole's field, stresses."""

from __future__ import annotations

from decimal import Decimal, getcontext

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import femmembrane as fm
from femmembrane.physics.kinematics import hencky_strains
from femmembrane.physics.magnetics import magnetic_energy_density, magnetic_field
from femmembrane.physics.stress import total_stress
from tests.cases import OGDEN

MATERIALS = [fm.NeoHookean(), OGDEN, fm.Ogden((0.5, 1.0), (2.0, 1.0))]
strains = st.floats(-0.5, 1.5)
radii, heights = st.floats(0.05, 3), st.floats(-3, 3)

getcontext().prec = 60


def terms(material):
    return zip(*((1.0,), (2.0,)) if isinstance(material, fm.NeoHookean) else (material.mu, material.alpha), strict=True)


def exact_energy(material, e1, e2):
    """The definition W = sum mu/alpha (l1^alpha + l2^alpha + (l1 l2)^-alpha - 3) with 60 digits."""
    e1, e2 = Decimal(e1), Decimal(e2)
    return sum(
        Decimal(mu) / Decimal(a) * ((Decimal(a) * e1).exp() + (Decimal(a) * e2).exp() + (-Decimal(a) * (e1 + e2)).exp() - 3)
        for mu, a in terms(material)
    )


def exact_stress(material, e1, e2):
    e1, e2 = Decimal(e1), Decimal(e2)
    return sum(Decimal(mu) * ((Decimal(a) * e1).exp() - (-Decimal(a) * (e1 + e2)).exp()) for mu, a in terms(material))


# --- strain energy


@pytest.mark.parametrize("material", MATERIALS)
def test_rest(material):
    assert material.energy(0.0, 0.0) == 0
    assert material.stress(0.0, 0.0) == (0, 0)


@pytest.mark.parametrize("material", MATERIALS)
def test_shear_modulus_is_one(material):
    """W = 2 (e1^2 + e1 e2 + e2^2) to second order: 2 e^2 with one strain or two opposite ones, 6 e^2 with two equal ones."""
    h = 1e-5
    assert material.energy(h, 0.0) == pytest.approx(2 * h**2, rel=1e-4)
    assert material.energy(h, h) == pytest.approx(6 * h**2, rel=1e-4)
    assert material.energy(h, -h) == pytest.approx(2 * h**2, rel=1e-4)


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e-3, 0.1, 0.5, 1.0, 1.6, 2.2])
def test_energy_keeps_its_digits(material, size):
    """Against the definition with 60 digits, from strains far below round-off of 1 to stretches of 9."""
    for e1, e2 in ((size, 0.8 * size), (size, -0.4 * size), (0.3 * size, size)):
        exact = exact_energy(material, e1, e2)
        assert abs(Decimal(float(material.energy(e1, e2))) / exact - 1) < Decimal("1e-13")


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e-3, 0.1, 0.5, 1.0, 1.6, 2.2])
def test_stress_keeps_its_digits(material, size):
    for e1, e2 in ((size, 0.8 * size), (size, 0.1 * size), (0.3 * size, size)):
        s1, s2 = material.stress(e1, e2)
        for s, exact in ((s1, exact_stress(material, e1, e2)), (s2, exact_stress(material, e2, e1))):
            assert abs(Decimal(float(s)) / exact - 1) < Decimal("1e-13")


@given(strains, strains)
def test_stress_is_the_slope_of_energy(e1, e2):
    h = 1e-5
    for material in MATERIALS:
        s1, s2 = material.stress(e1, e2)
        scale = 1 + abs(s1) + abs(s2)
        assert (material.energy(e1 + h, e2) - material.energy(e1 - h, e2)) / (2 * h) == pytest.approx(s1, abs=1e-7 * scale**2)
        assert (material.energy(e1, e2 + h) - material.energy(e1, e2 - h)) / (2 * h) == pytest.approx(s2, abs=1e-7 * scale**2)


@given(strains, strains)
def test_energy_is_symmetric_and_not_negative(e1, e2):
    for material in MATERIALS:
        energy = material.energy(e1, e2)
        assert energy >= 0
        assert material.energy(e2, e1) == pytest.approx(energy, rel=1e-12, abs=1e-15)


@given(strains, strains)
def test_neo_hookean_is_ogden_with_one_term(e1, e2):
    l1, l2 = np.exp(e1), np.exp(e2)
    assert fm.NeoHookean().energy(e1, e2) == pytest.approx((l1**2 + l2**2 + 1 / (l1 * l2) ** 2 - 3) / 2, rel=1e-9, abs=1e-12)
    assert fm.NeoHookean().stress(e1, e2) == fm.Ogden((1.0,), (2.0,)).stress(e1, e2)


def test_stress_derivative_by_casadi():
    """The closed-form stress is CasADi's own derivative of the energy."""
    from femmembrane.potential.expressions import ca, casadi_answers_numpy

    with casadi_answers_numpy():
        e = ca.SX.sym("e", 2)
        for material in MATERIALS:
            difference = ca.vertcat(*material.stress(e[0], e[1])) - ca.gradient(material.energy(e[0], e[1]), e)
            function = ca.Function("difference", [e], [difference])
            for point in ([0.1, 0.2], [0.9, -0.3], [1.5, 1.2], [-0.2, -0.4]):
                assert np.abs(np.array(function(point))).max() < 1e-12 * (1 + max(np.abs(material.stress(*point))))


# --- kinematics


@given(st.floats(0.1, 2), st.floats(-0.5, 2), st.floats(-0.5, 2), st.floats(-2, 2))
def test_strains_are_logarithms_of_stretches(R, u, u_s, w_s):
    u = u * R
    e1, e2 = hencky_strains(R, 1.0, 0.0, u, u_s, w_s)
    assert np.exp(e1) == pytest.approx(np.hypot(1 + u_s, w_s), rel=1e-12)
    assert np.exp(e2) == pytest.approx((R + u) / R, rel=1e-12)


def test_small_strains_keep_their_digits():
    """w_s = 1e-9 strains by 5e-19, far below round-off of 1."""
    e1, e2 = hencky_strains(0.5, 1.0, 0.0, 1e-19, 0.0, 1e-9)
    assert e1 == pytest.approx(5e-19, rel=1e-12)
    assert e2 == pytest.approx(2e-19, rel=1e-12)


# --- magnetics


@given(radii, heights)
def test_field_strength_is_the_published_expression(rho, eta):
    """|h|^2 = M (rho^2 + 4 z^2)/(rho^2 + z^2)^4 with z = eta - h."""
    strength, height = 3.0, 4.0
    h = fm.Dipole(strength, height).field(rho, eta)
    z = eta - height
    expected = strength * (rho**2 + 4 * z**2) / (rho**2 + z**2) ** 4
    assert h[0] ** 2 + h[1] ** 2 == pytest.approx(expected, rel=1e-12)
    density = magnetic_energy_density([fm.Dipole(strength, height)], 2.5, rho, eta)
    assert density == pytest.approx(-2.5 / 2 * expected, rel=1e-12)


@given(radii, heights)
def test_field_is_free_of_divergence_and_curl(rho, eta):
    """div h = (rho h_rho),rho/rho + h_z,z = 0 and curl h = h_rho,z - h_z,rho = 0, by central differences."""
    source, d = fm.Dipole(1.0, 4.0), 1e-4
    scale = np.hypot(*source.field(rho, eta)[:2]) / np.sqrt(source.distance_squared(rho, eta))
    right, left, up, down = (source.field(rho + i * d, eta + j * d) for i, j in ((1, 0), (-1, 0), (0, 1), (0, -1)))
    divergence = ((rho + d) * right[0] - (rho - d) * left[0]) / (2 * d * rho) + (up[1] - down[1]) / (2 * d)
    curl = (up[0] - down[0]) / (2 * d) - (right[1] - left[1]) / (2 * d)
    assert abs(divergence) < 1e-5 * scale / min(rho, 1)
    assert abs(curl) < 1e-5 * scale


def test_field_on_the_axis():
    """2 sqrt(M)/|z|^3, along the moment."""
    assert fm.Dipole(4.0, 3.0).field(0.0, 1.0) == (0.0, pytest.approx(2 * 2 / 8), 0.0)
    assert fm.Dipole(4.0, 3.0, orientation=-1).field(0.0, 1.0)[1] == pytest.approx(-0.5)


def test_fields_superpose():
    one, other = fm.Dipole(4.0, 3.0), fm.Dipole(1.0, -2.0, orientation=-1)
    total = magnetic_field([one, other], 0.3, 0.4)
    assert total == pytest.approx(np.add(one.field(0.3, 0.4), other.field(0.3, 0.4)))
    assert magnetic_field([], 0.3, 0.4) == (0, 0, 0)


# --- total stress


def test_total_stress_by_hand():
    """h along the tangent: (chi + 1/2) h^2 and -h^2/2; along the normal: -(chi + 1/2) h^2 twice; less P T/R0.

    Around the axis the two directions change places: -h^2/2 and (chi + 1/2) h^2.
    """
    tangent = (0.6, 0.8)
    along, across, around = (0.6 * 2, 0.8 * 2, 0.0), (-0.8 * 2, 0.6 * 2, 0.0), (0.0, 0.0, 2.0)
    assert total_stress((1.0, 2.0), 3.0, 1000.0, along, tangent, 2.5) == pytest.approx((1 - 0.003 + 3 * 4, 2 - 0.003 - 2))
    assert total_stress((1.0, 2.0), 3.0, 1000.0, across, tangent, 2.5) == pytest.approx((1 - 0.003 - 3 * 4, 2 - 0.003 - 2 - 10))
    assert total_stress((1.0, 2.0), 3.0, 1000.0, around, tangent, 2.5) == pytest.approx((1 - 0.003 - 2, 2 - 0.003 + 3 * 4))


def test_total_stress_is_that_of_maxwell_and_the_magnetisation():
    """The diagonal of chi (h h - h_n^2) + h h - |h|^2/2, for a field with all three components."""
    t, nu, chi = np.array([0.6, 0.8, 0.0]), np.array([-0.8, 0.6, 0.0]), 2.5
    h = np.array([0.7, -1.1, 0.4])  # rho, z, theta
    stress = chi * (np.outer(h, h) - (h @ nu) ** 2 * np.eye(3)) + np.outer(h, h) - h @ h / 2 * np.eye(3)
    found = total_stress((0.0, 0.0), 0.0, 1.0, tuple(h), (0.6, 0.8), chi)
    assert found == pytest.approx((t @ stress @ t, stress[2, 2]))
