"""Shooting and collocation: what they refuse, what they say when they fail, and scenes beyond the paper's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import femmembrane as fm
from femmembrane.accuracy.collocation import collocate
from femmembrane.accuracy.shooting import shoot, shoot_as_published
from femmembrane.accuracy.strong_form import SINGULAR, Guess, StrongForm
from tests.cases import OGDEN, disc_scene

METHODS = (shoot, shoot_as_published, collocate)
SCENE = disc_scene(dipole=(200, 6.5), elements=8, degree=6)


@pytest.fixture(scope="module")
def near():
    return Guess.of(fm.equilibrium(SCENE, volume=2.0, solver="newton"))


@pytest.mark.parametrize("method", METHODS)
def test_tension_field_is_refused(method, near):
    with pytest.raises(fm.InputError, match=r"effects.tension_field = True: false is allowed"):
        method(SCENE.replace(tension_field=True), guess=near, volume=2.0)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("controls", [{}, {"volume": 2.0, "pressure": 1.0}])
def test_one_control_is_needed(method, near, controls):
    with pytest.raises(fm.InputError, match="exactly one of volume, pressure and center_height"):
        method(SCENE, guess=near, **controls)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("value", [0.0, -1e-6, 0.2, "small", True, np.nan])
def test_tolerance(method, near, value):
    with pytest.raises(fm.InputError, match="tolerance"):
        method(SCENE, guess=near, volume=2.0, tolerance=value)


@pytest.mark.parametrize("load", [np.nan, np.inf, "2", True])
def test_load(near, load):
    with pytest.raises(fm.InputError, match="volume"):
        shoot(SCENE, guess=near, volume=load)


def test_guess():
    with pytest.raises(fm.InputError, match=r"guess.stretch = 0: a finite number > 0"):
        Guess(1.0, 0.5, 0)
    with pytest.raises(fm.InputError, match=r"guess.profile"):
        Guess(1.0, 0.5, 1.1, {"r": [0, 1]})
    with pytest.raises(fm.InputError, match=r"guess.profile = None: missing"):
        collocate(SCENE, guess=Guess(1.0, 0.5, 1.1), volume=2.0)


@pytest.mark.parametrize("r", [[0, 1], [0.1, 0.5, 1], [0, 0.5, 0.5, 1], [0, 0.5, 0.9]])
def test_radii_of_a_guess(r):
    guess = Guess(1.0, 0.5, 1.1, {"r": r, "rho": r, "eta": np.zeros(len(r))})
    with pytest.raises(fm.InputError, match="increasing radii from 0 to 1"):
        collocate(SCENE, guess=guess, volume=2.0)


@pytest.mark.parametrize("method", METHODS)
def test_failure_is_said(method, near):
    """A neo-Hookean membrane holds no pressure above its limit point, 1.9 or so: no method may claim to have found that state."""
    limits = {"max_nodes": 500} if method is collocate else {"max_iterations": 2}
    found = method(disc_scene(fm.NeoHookean()), guess=near, pressure=9.0, **limits)
    assert not found.converged
    assert found.residual > 1e-4
    assert found.message


@pytest.mark.parametrize("method", [shoot, shoot_as_published])
def test_a_guess_outside_the_domain(method, near):
    """The pole in the dipole itself: the shot cannot even begin, nothing is found, and that is said."""
    found = method(SCENE, guess=Guess(1.0, 6.5, 1.2), center_height=6.5, max_iterations=3)
    assert not found.converged
    assert found.residual == np.inf
    with pytest.raises(fm.InputError, match="nothing was found"):
        found.profile()


def test_profile_is_refused_outside(near):
    found = collocate(SCENE, guess=near, volume=2.0)
    with pytest.raises(fm.InputError, match=r"radii in \[0, 1\]"):
        found.profile([0.5, 1.1])


@pytest.mark.parametrize("method", [shoot, collocate])
def test_profile_from_pole_to_rim(method, near):
    """Smooth at the pole, where the height is even and its curvature follows from the balance of forces; clamped at the rim."""
    found = method(SCENE, guess=near, volume=2.0, tolerance=1e-9)
    at = found.profile([0.0, 1e-5, 2e-5, 1e-3, 1.0])
    assert at["eta"][0] == pytest.approx(found.center_height, rel=1e-9)
    assert np.ptp(at["eta"][:3]) < 1e-8
    assert at["stretch_1"][0] == pytest.approx(at["stretch_2"][0], rel=1e-9)
    assert (at["rho"][-1], at["eta"][-1]) == pytest.approx((1, 0), abs=1e-8)
    with_elements = fm.equilibrium(SCENE.replace(mesh=fm.disc(elements=16), degree=8), volume=2.0, solver="newton")
    r = np.linspace(0, 1, 33)
    for name in ("rho", "eta", "stretch_1", "stretch_2"):
        assert found.profile(r)[name] == pytest.approx(with_elements.profile(r)[name], abs=1e-8), name


def test_guess_beyond(near):
    """Linear in everything: a guess taken as far beyond itself as zero steps is itself."""
    other = Guess(near.pressure - 0.1, near.center_height - 0.2, near.stretch - 0.3, near.profile)
    beyond = near.beyond(other)
    assert (beyond.pressure, beyond.center_height) == pytest.approx((near.pressure + 0.1, near.center_height + 0.2))
    assert beyond.stretch == pytest.approx(near.stretch + 0.3)
    assert np.array_equal(beyond.profile["rho"], near.profile["rho"])
    assert near.beyond(other, 0.0).pressure == near.pressure


class MooneyRivlin:
    """W = sum over the stretches of c_1 (lambda^2 - 1)/2 + c_2 (lambda^-2 - 1)/2 with c_1 + c_2 = 1: not a class of the package."""

    def __init__(self, c2):
        self.c1, self.c2 = 1 - c2, c2

    def energy(self, e1, e2):
        return sum(self.c1 * np.expm1(2 * e) + self.c2 * np.expm1(-2 * e) for e in (e1, e2, -e1 - e2)) / 2

    def stress(self, e1, e2):
        one, two, three = (self.c1 * np.exp(2 * e) - self.c2 * np.exp(-2 * e) for e in (e1, e2, -e1 - e2))
        return one - three, two - three

    def tangent(self, e1, e2):
        one, two, three = (2 * self.c1 * np.exp(2 * e) + 2 * self.c2 * np.exp(-2 * e) for e in (e1, e2, -e1 - e2))
        return one + three, three, two + three


def test_any_material_and_several_sources():
    """A material of one's own beside two opposed dipoles: shooting, collocation and elements agree, and dE/dV = P along the branch."""
    sources = [fm.Dipole(150, 5.0), fm.Dipole(80, -3.5, orientation=-1)]
    scene = fm.Scene(material=MooneyRivlin(0.1), sources=sources, susceptibility=1.5, mesh=fm.disc(elements=12), degree=7)
    elements = fm.equilibrium(scene, volume=3.0, solver="newton")
    guess = Guess.of(elements)
    found = [method(scene, guess=guess, volume=3.0, tolerance=1e-9) for method in (shoot, collocate)]
    for one in found:
        for quantity in ("pressure", "center_height", "elastic_energy", "magnetic_energy"):
            assert getattr(one, quantity) == pytest.approx(getattr(elements, quantity), rel=1e-8), quantity
    low, high = (shoot(scene, guess=guess, volume=v) for v in (2.999, 3.001))
    rise = high.elastic_energy + high.magnetic_energy - low.elastic_energy - low.magnetic_energy
    assert rise / 0.002 == pytest.approx(elements.pressure, rel=1e-6)


def test_singular_terms_are_those_of_the_equations():
    """The regular part stays bounded at the pole along the regular solution, and tends to its value there."""
    form = StrongForm(SCENE)
    state = (np.array([0.7]), np.array([1.2]), np.array([1.6]))
    at_pole = form.regular(np.zeros(1), form.pole(1e-12, *state) * np.array([[1], [1], [0], [0]]), 1.6)[:, 0]
    assert at_pole[:3] == pytest.approx(0, abs=1e-15)
    assert at_pole[3] != 0
    for r in (1e-2, 1e-3):
        near = form.regular(np.array([r]), form.pole(r, *state), 1.6)[:, 0]
        assert near[3] == pytest.approx(at_pole[3], rel=10 * r**2)
        assert near[:3] == pytest.approx(at_pole[:3], abs=10 * r)
    assert np.linalg.matrix_power(SINGULAR, 2)[2, 2] == 4


def test_series_at_the_pole():
    """Integrated from closer to the pole, the equations meet the series; what it leaves out is of fourth order in the radius."""
    form = StrongForm(disc_scene(OGDEN, (200, 6.5)))
    state = (np.array([0.7]), np.array([1.2]), np.array([1.6]))
    errors = []
    for r in (0.1, 0.05):
        path = solve_ivp(lambda r, y: form.rates(r, y, 1.6), (1e-4, r), form.pole(1e-4, *state)[:, 0], "DOP853", rtol=1e-12, atol=1e-15)
        errors.append(np.abs(path.y[:, -1] - form.pole(r, *state)[:, 0])[[0, 1, 2]].max())
    assert 3.5 < np.log2(errors[0] / errors[1]) < 4.5
