"""Strain energies with stress at rest: the same membranes as those that are stretched, in other units, and closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.accuracy.shooting import shoot
from femmembrane.accuracy.strong_form import Guess
from tests.cases import disc_scene

P = 1.5
#: tension of a neo-Hookean sheet that is stretched by P in both directions
TENSION = P**2 - P**-4


def neo_hookean(a, b):
    return (a**2 + b**2 + 1 / (a * b) ** 2 - 3) / 2


TENSE = fm.StrainEnergy(lambda a, b: neo_hookean(P * a, P * b), prestressed=True)
DISC = disc_scene(TENSE, elements=16, degree=4)


@pytest.mark.parametrize("solver", ["newton", "ipopt"])
@pytest.mark.parametrize("control", ["volume", "pressure", "center_height"])
def test_flat_is_a_state(control, solver):
    eq = fm.equilibrium(DISC, solver=solver, **{control: 0.0})
    assert (eq.pressure, eq.volume, eq.center_height) == (0, 0, 0)
    assert eq.verdict("pressure").stable


def test_frequencies_of_a_flat_drum():
    """A membrane under the tension tau has the eigenvalues j_nm^2 tau across its plane; in it those for n = 1 lie among them."""
    eq = fm.equilibrium(DISC, volume=0.0)
    assert eq.frequencies(azimuthal=0)[0].eigenvalue == pytest.approx(2.404825557695773**2 * TENSION, rel=1e-9)
    found = [mode.eigenvalue for mode in eq.frequencies(azimuthal=1, count=4)]
    assert min(abs(value / (3.8317059702075125**2 * TENSION) - 1) for value in found) < 1e-6


def test_small_pressures_bend_it_as_a_drum():
    """eta = P (1 - r^2)/(4 tau), so V = pi P/(8 tau), down to the smallest."""
    for pressure in (1e-9, 1e-4):
        eq = fm.equilibrium(DISC, pressure=pressure, solver="newton")
        assert eq.center_height == pytest.approx(pressure / (4 * TENSION), rel=1e-7)
        assert eq.volume == pytest.approx(np.pi * pressure / (8 * TENSION), rel=1e-7)


def test_the_same_disc_stretched():
    """Lengths in units of p R0 and the thickness T/p^2: P grows by p^3, V falls by it."""
    stretched = disc_scene(fm.NeoHookean(), elements=16, degree=4).replace(prestretch=P)
    for volume in (0.05, 0.5, 2.0):
        one, other = fm.equilibrium(DISC, volume=volume), fm.equilibrium(stretched, volume=volume * P**3)
        assert one.pressure == pytest.approx(P**3 * other.pressure, rel=1e-9)


def test_shooting_agrees():
    eq = fm.equilibrium(disc_scene(TENSE, elements=16, degree=6), center_height=0.4)
    found = shoot(DISC, center_height=0.4, guess=Guess.of(eq))
    assert found.converged
    assert (eq.pressure, eq.volume) == pytest.approx((found.pressure, found.volume), rel=1e-9)


def test_runs_and_traces_pass_through_flat():
    branch = fm.pressurize(DISC, pressures=np.linspace(-0.2, 0.2, 5))
    assert branch.column("volume") == pytest.approx(-branch.column("volume")[::-1], rel=1e-9, abs=1e-15)
    branch = fm.trace(DISC, start=-0.2, until={"volume": 0.3})
    assert not branch.special_points
    assert branch[-1].volume == pytest.approx(0.3)


def test_a_balloon_that_is_tense_at_rest():
    """P = 2 p^3 (1/l - 1/l^7) at p times less than the stretch l; where it rests, l = p, that is 2 tau."""
    balloon = fm.Scene(material=TENSE, mesh=fm.sphere(12), degree=3)
    for stretch in (1.2, P):
        eq = fm.equilibrium(balloon, volume=4 / 3 * np.pi * (stretch / P) ** 3, solver="newton")
        assert eq.pressure == pytest.approx(2 * P**3 * (1 / stretch - stretch**-7), rel=1e-7)


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda a, b: neo_hookean(0.9 * a, 0.9 * b), r"a tension is allowed at rest, not the stress -0.714"),
        (lambda a, b: a + b, r"it must be stiff in its plane at rest"),
        (lambda a, b: neo_hookean(P * a, P * b) + (a - 1) ** 3, r"symmetric"),
    ],
)
def test_refused(function, message):
    with pytest.raises(fm.InputError, match=message):
        fm.StrainEnergy(function, prestressed=True)


def test_advice():
    with pytest.raises(fm.InputError, match=r"must be 0 at rest, not 0.84.*; say prestressed=True"):
        fm.StrainEnergy(TENSE.function)
    with pytest.raises(fm.InputError, match=r"material.prestressed = 1"):
        fm.StrainEnergy(TENSE.function, prestressed=1)
    with pytest.raises(fm.InputError, match=r"effects.tension_field = True: false is allowed with a pre-stressed strain energy"):
        DISC.replace(tension_field=True)
