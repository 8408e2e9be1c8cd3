"""Hooke's law in plane stress: closed forms, its thickness, its tension field, and membranes."""

from __future__ import annotations

from decimal import Decimal, getcontext

import casadi as ca
import numpy as np
import pytest

import femmembrane as fm
from femmembrane.accuracy.shooting import shoot
from femmembrane.accuracy.strong_form import Guess
from femmembrane.physics.tension_field import TensionField, cauchy_stress
from femmembrane.potential import Potential
from femmembrane.potential.expressions import casadi_answers_numpy
from tests.cases import disc_scene

getcontext().prec = 60
D = Decimal
NU = [-0.4, 0.0, 0.3, 0.5]
RUBBER = fm.Hooke(0.3)
ratios = pytest.mark.parametrize("nu", NU)


def definition(nu, e1, e2):
    """W with 60 digits."""
    nu, E1, E2 = D(nu), ((2 * D(e1)).exp() - 1) / 2, ((2 * D(e2)).exp() - 1) / 2
    return E1 * E1 + E2 * E2 + nu / (1 - nu) * (E1 + E2) ** 2


@ratios
@pytest.mark.parametrize("size", [1e-12, 1e-8, 1e-4, 0.01, 0.15])
def test_digits(nu, size):
    material, h = fm.Hooke(nu), D("1e-18")
    for e1, e2 in ((size, 0.8 * size), (0.3 * size, size)):
        assert abs(D(float(material.energy(e1, e2))) / definition(nu, e1, e2) - 1) < D("2e-14")
        for s, (a, b) in zip(material.stress(e1, e2), ((e1, e2), (e2, e1)), strict=True):
            slope = (definition(nu, D(a) + h, b) - definition(nu, D(a) - h, b)) / (2 * h)
            assert abs(D(float(s)) / slope - 1) < D("2e-14")


@ratios
def test_rest_is_that_of_plane_stress(nu):
    """Lame's 2 mu and the plane-stress modulus 2 mu nu/(1 - nu); with nu = 1/2 that of every incompressible material."""
    material = fm.Hooke(nu)
    assert np.ravel([material.energy(0.0, 0.0), *material.stress(0.0, 0.0)]) == pytest.approx([0, 0, 0], abs=1e-16)
    own, mixed = 2 / (1 - nu), 2 * nu / (1 - nu)
    assert np.ravel(material.tangent(0.0, 0.0)) == pytest.approx([own, mixed, own], rel=1e-14)


@ratios
@pytest.mark.parametrize("relaxed", [False, True])
@pytest.mark.parametrize("point", [(0.1, 0.05), (0.12, -0.2), (-0.1, 0.15), (0.0, 0.1), (-0.1, -0.2)])
def test_derivatives(nu, relaxed, point):
    """Tangent and CasADi's derivatives; relaxed ones too, as no point lies on the border of a zone."""
    material = TensionField(fm.Hooke(nu)) if relaxed else fm.Hooke(nu)
    e = ca.SX.sym("e", 2)
    with casadi_answers_numpy():
        rows = [material.energy(e[0], e[1]), *material.stress(e[0], e[1]), *material.tangent(e[0], e[1])]
        hessian, gradient = ca.hessian(rows[0], e)
    found = np.array(ca.Function("f", [e], [ca.vertcat(*rows, gradient, hessian[0, 0], hessian[0, 1], hessian[1, 1])])(point)).ravel()
    expected = np.ravel([material.energy(*point), *material.stress(*point), *material.tangent(*point)])
    assert found[:6] == pytest.approx(expected, rel=1e-13, abs=1e-15)
    assert found[6:] == pytest.approx(expected[1:], rel=1e-12, abs=1e-14)


@ratios
@pytest.mark.parametrize("stretch", [0.95, 1.1, 1.2])
def test_uniaxial_tension_and_equibiaxial_stretch(nu, stretch):
    """S = 2 (1 + nu) E alone, and 2 (1 + nu)/(1 - nu) E both ways; Cauchy stresses through the volume ratio."""
    material, e, E = fm.Hooke(nu), np.log(stretch), (stretch**2 - 1) / 2
    across = np.log(1 - 2 * nu * E) / 2
    assert material.natural_width(e)[0] == pytest.approx(across, rel=1e-13, abs=1e-16)
    assert material.volume_ratio(e, across) == pytest.approx(stretch * (1 - 2 * nu * E), rel=1e-13)
    s1, s2 = material.stress(e, across)
    assert (s1, s2) == pytest.approx((stretch**2 * 2 * (1 + nu) * E, 0), rel=1e-12, abs=1e-15)
    both = stretch**2 * 2 * (1 + nu) / (1 - nu) * E
    assert material.stress(e, e) == pytest.approx((both, both), rel=1e-13)
    thickness = np.sqrt(1 - 4 * nu / (1 - nu) * E)
    assert cauchy_stress(material, e, e) == pytest.approx((both / (stretch**2 * thickness),) * 2, rel=1e-13)
    if stretch > 1:  # wrinkled, the stress of simple tension
        relaxed = cauchy_stress(TensionField(material), e, across - 0.1)
        assert relaxed == pytest.approx((stretch * 2 * (1 + nu) * E / (1 - 2 * nu * E), 0), rel=1e-12)
        assert relaxed[1] == 0


def test_slope_of_the_natural_width():
    for e in (0.05, 0.3):
        high, low = (RUBBER.natural_width(e + h)[0] for h in (1e-6, -1e-6))
        assert RUBBER.natural_width(e)[1] == pytest.approx((high - low) / 2e-6, rel=1e-8)


def test_an_auxetic_sheet_wrinkles_while_it_is_stretched_both_ways():
    """With nu < 0 the natural width is larger than at rest; the smaller of two stretches wrinkles, and never both."""
    material = fm.Hooke(-0.5)
    relaxed = TensionField(material)
    across = material.natural_width(0.2)[0]
    assert across > 0.05
    assert relaxed.energy(0.2, 0.03) == pytest.approx(float(material.energy(0.2, across)), rel=1e-14)
    assert relaxed.stress(0.2, 0.03)[1] == 0
    assert relaxed.stress(0.2, 0.03)[0] > 0


def test_where_the_sheet_has_no_thickness_nothing_is_a_number():
    """E_1 + E_2 = (1 - nu)/(2 nu): 7/6 for nu = 0.3. The natural width ends at E_1 = 1/(2 nu) = 5/3."""
    inside, beyond = (np.log(1 + 2 * E) / 2 for E in (7 / 12 - 1e-9, 7 / 12 + 1e-9))
    assert np.isfinite(RUBBER.energy(inside, inside))
    assert RUBBER.volume_ratio(inside, inside) == pytest.approx(0, abs=1e-3)
    assert np.isnan([RUBBER.energy(beyond, beyond), *RUBBER.stress(beyond, beyond), *RUBBER.tangent(beyond, beyond)]).all()
    width = np.log(1 + 2 * (5 / 3 + 1e-9)) / 2
    assert np.isnan(RUBBER.natural_width(width)[0])
    relaxed = TensionField(RUBBER)
    assert np.isnan([relaxed.energy(width, -1.0), *relaxed.stress(width, -1.0)]).all()


@pytest.mark.parametrize("value", [-1.0, 0.51, "0.3", float("nan")])
def test_impossible_ratios_are_refused(value):
    with pytest.raises(fm.InputError, match=r"material.poisson_ratio = .*above -1, and 0.5 at most"):
        fm.Hooke(value)


# --- membranes


@ratios
def test_scene_files(nu, tmp_path):
    scene = fm.Scene(material=fm.Hooke(nu), mesh=fm.disc(4))
    scene.to_toml(tmp_path / "scene.toml")
    assert fm.Scene.from_toml(tmp_path / "scene.toml") == scene


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_balloon(nu):
    """A sphere at the stretch l: P = 2 (1 + nu)/(1 - nu) (l - 1/l), from P dV = dE; Cauchy stress P l/2 over the thickness l_3."""
    scene = fm.Scene(material=fm.Hooke(nu), mesh=fm.sphere(12), degree=4)
    stretch = 1.2
    eq = fm.equilibrium(scene, volume=4 / 3 * np.pi * stretch**3, solver="newton")
    assert eq.pressure == pytest.approx(2 * (1 + nu) / (1 - nu) * (stretch - 1 / stretch), rel=1e-9)
    thickness = np.sqrt(1 - 2 * nu / (1 - nu) * (stretch**2 - 1))
    assert eq.profile()["mechanical_stress_1"] == pytest.approx(eq.pressure * stretch / (2 * thickness), rel=2e-5)


@pytest.mark.parametrize(("nu", "b0"), [(0.2, 1.6827), (0.3, 1.7244), (0.4, 1.7769)])
def test_henckys_membrane(nu, b0):
    """Small deflections of a clamped disc: w_0 = (p a/(E h))^(1/3) sum of a_2n (Hencky 1915, corrected by Fichter, NASA TP-3658, 1997)."""
    terms = (1.0, 1 / 2, 5 / 9, 55 / 72, 7 / 6, 205 / 108, 17051 / 5292, 2864485 / 508032)
    shape = sum(a / b0 ** (3 * n + 1) for n, a in enumerate(terms))
    pressure = 1e-6
    eq = fm.equilibrium(disc_scene(fm.Hooke(nu), elements=24, degree=4), pressure=pressure, solver="newton")
    assert eq.center_height == pytest.approx(shape * (pressure / (2 * (1 + nu))) ** (1 / 3), rel=3e-4)


def test_half_is_incompressible_at_small_strains():
    plain, hooke = (fm.equilibrium(disc_scene(m, elements=16, degree=4), volume=1e-4) for m in (fm.NeoHookean(), fm.Hooke(0.5)))
    assert hooke.pressure == pytest.approx(plain.pressure, rel=1e-6)


def test_shooting_agrees():
    scene = disc_scene(RUBBER, elements=16, degree=6)
    eq = fm.equilibrium(scene, center_height=0.5)
    found = shoot(scene, center_height=0.5, guess=Guess.of(eq))
    assert found.converged
    assert (eq.pressure, eq.volume) == pytest.approx((found.pressure, found.volume), rel=1e-9)


def test_verdicts_and_zones_know_the_natural_width():
    """A tube pulled along and sucked in wrinkles around its waist where a hoop is narrower than natural, and nowhere else."""
    scene = fm.Scene(material=RUBBER, mesh=fm.cylinder(elements=12, length=3.0), prestretch=1.2, tension_field=True, degree=3)
    eq = fm.equilibrium(scene, pressure=-0.02, solver="newton")
    profile = eq.profile()
    wrinkled = profile["stretch_2"] < np.exp(RUBBER.natural_width(np.log(profile["stretch_1"]))[0])
    assert 0 < wrinkled.sum() < wrinkled.size
    assert (profile["mechanical_stress_2"] == 0)[wrinkled].all()
    assert (profile["mechanical_stress_2"] > 0)[~wrinkled].all()
    zones = eq.zones("mechanical")
    assert zones.kinds == ("taut", "radial", "taut")
    assert eq.verdict("pressure").stable


def test_a_balloon_breathes():
    """Uniform radial motion: W'' - 2 l P = 2 (1 + nu)/(1 - nu) (l^2 + 1) is among the eigenvalues for n = 0 at constant pressure."""
    nu, stretch = 0.3, 1.1
    scene = fm.Scene(material=fm.Hooke(nu), mesh=fm.sphere(10), degree=4)
    eq = fm.equilibrium(scene, volume=4 / 3 * np.pi * stretch**3, solver="newton")
    found = [mode.eigenvalue for mode in eq.frequencies(azimuthal=0, count=6, control="pressure")]
    expected = 2 * (1 + nu) / (1 - nu) * (stretch**2 + 1)
    assert min(abs(value / expected - 1) for value in found) < 1e-6


@pytest.mark.parametrize("relaxed", [False, True])
def test_pressure_is_the_slope_of_the_energy(relaxed):
    """dE/dV = P, wrinkled or not."""
    mesh = fm.cylinder(elements=12, length=3.0)
    scene = fm.Scene(material=RUBBER, mesh=mesh, prestretch=1.2, tension_field=relaxed, degree=3)
    middle = fm.equilibrium(scene, pressure=-0.02 if relaxed else 0.1, solver="newton")
    h = 1e-4
    low, high = (fm.equilibrium(scene, volume=middle.volume + d, solver="newton", start=middle) for d in (-h, h))
    assert (high.energy - low.energy) / (2 * h) == pytest.approx(middle.pressure, rel=1e-5)


def test_nobody_else_pays():
    """Recorded on 2026-11-28, before there were compressible materials: 156 operations, 186 with a tension field."""
    scene = disc_scene(fm.NeoHookean(), elements=2)
    assert (Potential(scene).operations, Potential(scene.replace(tension_field=True)).operations) == (156, 186)
