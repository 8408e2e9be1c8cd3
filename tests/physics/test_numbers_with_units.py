"""Numbers with a unit: factors by hand, what is refused."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import femmembrane as fm
from femmembrane.errors import InputError, as_meant
from femmembrane.physics.units import EXAMPLES, has_unit, in_unit


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("5 kPa", "Pa", 5000.0),
        ("5kPa", "Pa", 5000.0),
        ("  -1.2e1 mbar ", "Pa", -1200.0),
        ("0.4 MPa", "Pa", 4e5),
        ("2 bar", "Pa", 2e5),
        ("3 hPa", "Pa", 300.0),
        ("1 mmHg", "Pa", 133.322387415),
        ("1 psi", "Pa", 6894.757293168361),
        ("2 cmH2O", "Pa", 196.133),
        ("1 atm", "Pa", 101325.0),
        ("0.4 N/mm^2", "Pa", 4e5),
        ("0.4 N/mm2", "Pa", 4e5),
        ("4 N mm^-2", "Pa", 4e6),
        ("20 mm", "m", 0.02),
        ("1.2 mm", "m", 0.0012),
        ("7 \N{MICRO SIGN}m", "m", 7e-6),
        ("7 um", "m", 7e-6),
        ("1 in", "m", 0.0254),
        ("3 ml", "m^3", 3e-6),
        ("3 mL", "m^3", 3e-6),
        ("2 cm\N{SUPERSCRIPT THREE}", "m^3", 2e-6),
        ("1.1 g/cm^3", "kg/m^3", 1100.0),
        ("960 kg/m^3", "kg/m^3", 960.0),
        ("50 mT", "T", 0.05),
        ("10 kA/m", "A/m", 1e4),
        ("0.5 A m^2", "A m^2", 0.5),
        ("0.5 A*m\N{SUPERSCRIPT TWO}", "A m^2", 0.5),
        ("3 J/T", "A m^2", 3.0),
        ("150 mA", "A", 0.15),
        ("2 mN", "N", 0.002),
        ("2 N m", "J", 2.0),
    ],
)
def test_factors_by_hand(text, unit, value):
    """To the last bit: what stands in the file is what a person would have written in SI units."""
    assert has_unit(text)
    assert in_unit("key", text, unit) == (value, unit)


@settings(deadline=None)
@given(st.integers(-(10**6), 10**6), st.sampled_from(["m", "k", "u", "M", "c"]))
def test_prefixes_are_powers_of_ten(number, prefix):
    power = {"m": -3, "k": 3, "u": -6, "M": 6, "c": -2}[prefix]
    assert in_unit("key", f"{number} {prefix}m", "m")[0] == float(f"{number}e{power}")


@pytest.mark.parametrize("text", ["1 - 0.4*R**2", "0.5", "kPa", "", "where(R < 0.5, 1, 2)", "2*R", "1e400", "5 kPa " + " " * 200])
def test_what_is_no_number_with_a_unit(text):
    assert not has_unit(text)
    with pytest.raises(InputError, match="a pressure or modulus such as"):
        in_unit("key", text, "Pa")


@pytest.mark.parametrize("text", ["5 kPas", "5 qPa", "5 mmmHg", "5 Pa//m", "5 Pa/", "5 m^0", "5 m^^2", "5 kkPa", "3 R", "5 min"])
def test_an_unknown_unit_is_named(text):
    with pytest.raises(InputError, match="no unit known here") as caught:
        in_unit("run.stop", text, "Pa")
    assert caught.value.key == "run.stop"


def test_another_kind_is_refused_with_what_is_allowed():
    with pytest.raises(InputError, match=r'a length such as "20 mm" is allowed'):
        in_unit("key", "5 kPa", "m")
    with pytest.raises(InputError, match=r"a flux density .* or a magnetic field .* is allowed"):
        in_unit("key", "5 kPa", "T", "A/m")


@pytest.mark.parametrize("unit", EXAMPLES)
def test_examples_are_what_they_are_examples_of(unit):
    for text in EXAMPLES[unit].split('"')[1::2]:
        assert in_unit("key", text, unit)[1] == unit


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("12,5 mm", "write 12.5 mm:"),
        ("12,5", "write 12.5:"),
        ("1,000 mm", "write 1.000 mm or 1000 mm:"),
        ("1.234,5 mm", "write 1234.5 mm:"),
        ("1,234.5 mm", "write 1234.5 mm:"),
        ("1 000 mm", "write 1000 mm:"),
        ("1'000'000 Pa", "write 1000000 Pa:"),
        ("-2,5e-3 m", "write -2.5e-3 m:"),
        ("\N{MINUS SIGN}3 mm", "write -3 mm"),
        ("25", "leave the quotes out"),
        ("1 inch", "write in"),
        ("2 mil", "write 1e-3 in"),
        ("5 millimetres", "write mm"),
        ("5 MM", "write mm"),
        ("5 mm.", "write mm"),
        ("0,500 mm", "write 0.500 mm:"),
        ("2 ft^3", "write 1728 in^3"),
        ("2 mil^2", "write 0.000001 in^2"),
        ("2 inch^2", "write in^2"),
        ("2 microns2", "write um^2"),
    ],
)
def test_a_number_written_otherwise_is_understood_and_refused(text, meant):
    with pytest.raises(InputError) as error:
        fm.Scene.from_dict({"material": {"model": "neo-hookean"}, "scales": {"radius": text, "thickness": 1e-4, "shear_modulus": 1e5}})
    assert error.value.key == "scales.radius"
    assert meant in error.value.allowed


@pytest.mark.parametrize("text", ["", "mm", "neo-hookean", "1 - 0.4*R**2", "1,2,3", "25 mm", "1.5 kPa", "1.2.3", "v1,5"])
def test_other_texts_are_not_taken_for_numbers(text):
    assert as_meant(text) == ""


def test_a_name_that_looks_like_a_number_is_a_name():
    with pytest.raises(InputError) as error:
        fm.Scene.from_dict({"material": {"model": "25"}})
    assert "quotes" not in str(error.value)
