"""Physical scales: conversions by hand and there and back, what a scene makes of them, and what it writes in Pa."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.constants import mu_0

import femmembrane as fm
from femmembrane.errors import InputError
from femmembrane.physics.scales import UNITS

#: R0 = 5 cm, T = 50 um, mu = 0.4 MPa: R0/T = 1000, mu T/R0 = 400 Pa, R0^3 = 1.25e-4 m^3, mu T R0^2 = 0.05 J
RUBBER = fm.Scales(radius=0.05, thickness=5e-5, shear_modulus=4e5)
#: with mu0 = 4e-7 pi (true to 1e-9): M = 1e-7 m^2/(4 pi R0^6 mu) = 1e-7 144/(4 pi 6.25e-3) for m = 12 A m^2
MOMENT, STRENGTH = 12.0, 1.8334649444186344e-4
MAGNET = fm.Scales(radius=0.05, thickness=5e-5, shear_modulus=4e5, dipole_moment=MOMENT)
LINEAR = sorted(UNITS.keys() - {"dipole_strength"})


# --- conversions


@pytest.mark.parametrize(
    ("quantity", "si", "unit"),
    [
        ("length", 0.05, "m"),
        ("volume", 1.25e-4, "m^3"),
        ("pressure", 400.0, "Pa"),
        ("stress", 4e5, "Pa"),
        ("energy", 0.05, "J"),
    ],
)
def test_units_by_hand(quantity, si, unit):
    assert RUBBER.to_si(quantity, 3.0) == pytest.approx(3 * si, rel=1e-14)
    assert RUBBER.from_si(quantity, -3 * si) == pytest.approx(-3.0, rel=1e-14)
    assert RUBBER.units(quantity) == unit


def test_strength_by_hand():
    assert MAGNET.strength == pytest.approx(STRENGTH, rel=1e-9)
    assert MAGNET.from_si("dipole_strength", [0.0, 12.0, 24.0]) == pytest.approx([0.0, STRENGTH, 4 * STRENGTH], rel=1e-9)
    # M = 200: m^2 = 200 4 pi 6.25e-3/1e-7 = 1e8 pi/2
    assert RUBBER.to_si("dipole_strength", 200) == pytest.approx(1e4 * math.sqrt(math.pi / 2), rel=1e-9)
    assert RUBBER.units("dipole_strength") == "A m^2"
    assert RUBBER.radius_to_thickness == pytest.approx(1000, rel=1e-15)


@pytest.mark.parametrize("height", [0.8, -6.5])
def test_strength_gives_the_field_of_the_moment(height):
    """On its axis, a distance d away, a moment m has the field H = 2 m/(4 pi d^3), and |h|^2 = mu0 H^2/mu."""
    field = 2 * MOMENT / (4 * math.pi * (abs(height) * 0.05) ** 3)
    assert fm.Dipole(MAGNET.strength, height).intensity(0.0, 0.0) == pytest.approx(mu_0 * field**2 / 4e5, rel=1e-13)


def test_energy_is_pressure_times_volume_and_stress_times_volume_of_material():
    assert RUBBER.to_si("pressure", 1.0) * RUBBER.to_si("volume", 1.0) == pytest.approx(RUBBER.to_si("energy", 1.0), rel=1e-14)
    assert RUBBER.to_si("stress", 1.0) * 0.05**2 * 5e-5 == pytest.approx(RUBBER.to_si("energy", 1.0), rel=1e-14)


decades = st.tuples(st.floats(1, 10), st.integers(-9, 9)).map(lambda pair: pair[0] * 10.0 ** pair[1])
any_scales = st.builds(fm.Scales, radius=decades, thickness=decades, shear_modulus=decades)


@given(scales=any_scales, quantity=st.sampled_from(LINEAR), value=decades, sign=st.sampled_from([1, -1]))
def test_there_and_back(scales, quantity, value, sign):
    assert scales.from_si(quantity, scales.to_si(quantity, sign * value)) == pytest.approx(sign * value, rel=1e-15)
    assert scales.to_si(quantity, scales.from_si(quantity, sign * value)) == pytest.approx(sign * value, rel=1e-15)


@given(scales=any_scales, value=decades)
def test_strength_and_moment_there_and_back(scales, value):
    assert scales.from_si("dipole_strength", scales.to_si("dipole_strength", value)) == pytest.approx(value, rel=2e-15)
    assert scales.to_si("dipole_strength", scales.from_si("dipole_strength", value)) == pytest.approx(value, rel=2e-15)


@given(scales=any_scales, factor=decades, moment=decades)
def test_a_strength_is_the_square_of_the_moment(scales, factor, moment):
    one, other = (scales.from_si("dipole_strength", m) for m in (moment, factor * moment))
    assert other == pytest.approx(factor**2 * one, rel=2e-15)


def test_arrays_and_numbers():
    values = np.array([[1, 2], [3, 4]])
    np.testing.assert_allclose(RUBBER.to_si("pressure", values), 400.0 * values, rtol=1e-15)
    np.testing.assert_allclose(RUBBER.from_si("stress", [4e5, -2e5]), [1.0, -0.5], rtol=1e-15)
    for value in (2, 2.0, np.float32(2), np.array(2.0)):
        assert type(RUBBER.to_si("pressure", value)) is float
    assert math.isnan(RUBBER.to_si("stress", math.nan))


def test_scales_are_plain_numbers():
    scales = fm.Scales(1, np.float32(0.5), np.int64(2), dipole_moment=3)
    assert (scales.radius, scales.thickness, scales.shear_modulus, scales.dipole_moment) == (1.0, 0.5, 2.0, 3.0)
    assert all(type(v) is float for v in (scales.radius, scales.thickness, scales.shear_modulus, scales.dipole_moment))
    assert hash(scales) == hash(fm.Scales(1.0, 0.5, 2.0, 3.0))


GIVEN = {"radius": 0.05, "thickness": 5e-5, "shear_modulus": 4e5}


@pytest.mark.parametrize("value", [0, -1.0, math.nan, math.inf, True, np.True_, "0.05", 10**400, [1.0], 1j])
@pytest.mark.parametrize("name", ["radius", "thickness", "shear_modulus", "dipole_moment"])
def test_refused_numbers(name, value):
    with pytest.raises(InputError, match="a finite number > 0 is allowed") as caught:
        fm.Scales(**{**GIVEN, name: value})
    assert caught.value.key == f"scales.{name}"


@pytest.mark.parametrize("name", ["radius", "thickness", "shear_modulus"])
def test_none_is_no_scale(name):
    with pytest.raises(InputError, match=rf"scales\.{name} = None"):
        fm.Scales(**{**GIVEN, name: None})


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"radius": 1e150}, "volume"),
        ({"radius": 1e-120}, "volume"),
        ({"thickness": 1e-300, "shear_modulus": 1e-30}, "pressure|energy"),
        ({"radius": 1e50, "thickness": 1e-270, "shear_modulus": 1e200}, "radius over thickness"),
        ({"dipole_moment": 1e200}, "strength of dipole_moment"),
        ({"dipole_moment": 1e-200}, "strength of dipole_moment"),
    ],
)
def test_units_beyond_floats_are_refused(change, what):
    with pytest.raises(InputError, match=rf"scales = Scales.*({what}).* would be (0|inf)"):
        fm.Scales(**{**GIVEN, **change})


@pytest.mark.parametrize("convert", [RUBBER.to_si, RUBBER.from_si])
def test_refused_values(convert):
    with pytest.raises(InputError, match=r"quantity = 'presure'.*did you mean 'pressure'"):
        convert("presure", 1.0)
    with pytest.raises(InputError, match="quantity = 3: unknown"):
        convert(3, 1.0)
    for value in ("1", None, True, [True], [1.0, "2"], [[1.0], [2.0, 3.0]], 1j):
        with pytest.raises(InputError, match=r"value = .*a number or an array of numbers"):
            convert("pressure", value)
    for value in (-1.0, [1.0, -1.0], math.nan):
        with pytest.raises(InputError, match=r"value = .*>= 0 is allowed.*orientation"):
            convert("dipole_strength", value)


def test_refused_unit():
    with pytest.raises(InputError, match=r"quantity = 'lenght'.*did you mean 'length'"):
        RUBBER.units("lenght")
    with pytest.raises(InputError, match=r"scales\.dipole_moment = None"):
        RUBBER.strength  # noqa: B018
