"""Tables that were meant otherwise: what is suspected, and what is said of it."""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.errors import InputError

SCALES = fm.Scales(radius=0.025, thickness=3e-4, shear_modulus=3.3e5)
HEIGHTS = np.array([0.2, 0.35, 0.5, 0.65, 0.8, 0.95])


@pytest.fixture(scope="module")
def scene():
    return fm.Scene(material=fm.MooneyRivlin(ratio=0.1), mesh=fm.disc(4), degree=4, scales=SCALES)


@pytest.fixture(scope="module")
def table(scene):
    """Heights in mm and pressures in kPa as the scene has them."""
    found = [fm.equilibrium(scene, center_height=float(h)) for h in HEIGHTS]
    return {"pole_height_mm": 25 * HEIGHTS, "pressure_kPa": np.array([SCALES.to_si("pressure", eq.pressure) for eq in found]) / 1e3}


def fitted(scene, table):
    return fm.fit(scene, table, ["scales.shear_modulus"], noise="1 %", intervals="linear", starts=1)


def test_a_good_table_raises_no_suspicion(scene, table):
    found = fitted(scene, table)
    assert found.notes == ()
    assert found.values["scales.shear_modulus"] == pytest.approx(3.3e5, rel=1e-6)


@pytest.mark.parametrize(
    ("meant", "said"),
    [
        (
            lambda h, p: {"pole_height_mm": p, "pressure_kPa": h},
            "'pole_height_mm' and 'pressure_kPa' are exchanged: are these columns swapped?",
        ),
        (lambda h, p: {"pole_height_cm": h, "pressure_kPa": p}, "'pole_height_cm' is in mm in place of cm: is its unit right?"),
        (lambda h, p: {"pole_height_mm": h, "pressure_kPa": p + 101.325}, "are these absolute pressures?"),
    ],
)
def test_another_reading_that_is_far_closer_is_named(scene, table, meant, said):
    found = fitted(scene, meant(*table.values()))
    assert found.notes[-1].startswith("data: the fit misses the pressures by ")
    assert said in found.notes[-1]


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("pole_height_kPa,pressure_kPa\n1,1", "a length such as \"20 mm\" is allowed; its unit is read as 'kPa'"),
        ("pole_height_mm,pressure_kpaa\n1,1", "'kpaa' is no unit known here; g, m,"),
        ("pole_height_inch,pressure_kPa\n1,1", "'inch' is no unit known here; write in"),
        ("pole_height_mm (cm),pressure_kPa\n1,1", "it names two units, 'mm' and 'cm'"),
        ('pole_height_um,pressure_Pa\n"3,870",1', "write 3.870 or 3870"),
        ("pole_height_mm,pressure_kPa\n3 mm,1", "a number alone is allowed: its unit stands in the header, as in center_height_mm"),
        ("pole_height,pressure\nmm,kPa\n3,1", "write each behind the name of its column"),
        ("pole_height_mm;pressure_kPa\n3,1;1,0", "pandas.read_csv('x.csv', sep=';', decimal=',') reads such a table"),
    ],
)
def test_what_a_table_says_otherwise_is_named(scene, tmp_path, lines, said):
    (tmp_path / "x.csv").write_text(lines + "\n")
    with pytest.raises(InputError) as error:
        fitted(scene, tmp_path / "x.csv")
    assert said in str(error.value)
    assert "1 kPa" not in str(error.value)
    assert "1 cm'" not in str(error.value)
