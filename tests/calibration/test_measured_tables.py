"""Tables of measurements: what is read out of them, and what is refused with its row and column."""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.calibration.tables import read_table
from femmembrane.errors import InputError

SCALES = fm.Scales(radius=0.025, thickness=5e-4, shear_modulus=3e5)
SCENE = fm.Scene(material=fm.Gent(60.0), mesh=fm.disc(8), degree=4, scales=SCALES)
NAMES = ["material.mu", "material.jm"]
HEIGHTS = (2.0, 5.0, 8.0, 11.0, 14.0, 17.0, 20.0, 23.0, 26.0)


def pressures() -> list[float]:
    """In kPa, of the sheet as it is in the scene."""
    if not _KNOWN:
        found = [fm.equilibrium(SCENE, center_height=h / 25).pressure for h in HEIGHTS]
        _KNOWN.extend(round(float(SCALES.to_si("pressure", p)) / 1e3, 5) for p in found)
    return _KNOWN


_KNOWN: list[float] = []


def text(header: str = "pole_height_mm,pressure_kPa") -> list[str]:
    return [header, *(f"{h},{p}" for h, p in zip(HEIGHTS, pressures(), strict=True))]


def fit(lines: list[str], tmp_path, **more):
    path = tmp_path / "bulge.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return fm.fit(SCENE, path, NAMES, noise="1 %", starts=1, intervals="linear", **more)


HEADERS = [
    ("pole_height_mm", "pressure_kPa"),
    ("Pole height [mm]", "Pressure (kPa)"),
    ("pole height / mm", "p_kPa"),
    ("center_height_mm", "pressure_kpa"),
]


@pytest.mark.parametrize("headers", HEADERS)
def test_headers_have_their_units_behind_them(headers):
    """25 mm are the radius, and 6 kPa the pressure of mu T/R0 = 300 kPa/50."""
    table = read_table({headers[0]: [25.0], headers[1]: [6.0]}, SCALES)
    assert table.columns["center_height"] == pytest.approx([1.0], rel=1e-12)
    assert table.columns["pressure"] == pytest.approx([1.0], rel=1e-12)


def test_deviations_and_ratios_and_columns_of_a_run():
    given = {"pole_stretch_%": [120.0], "pressure_mbar": [60.0], "pressure_sd_mbar": [0.6], "step": [3], "elastic_energy": [2.0]}
    table = read_table(given, SCALES)
    assert table.columns["pole_stretch"] == pytest.approx([1.2], rel=1e-12)
    assert (table.columns["pressure"], table.deviations["pressure"]) == (pytest.approx([1.0]), pytest.approx([0.01]))
    assert set(table.columns) == {"pole_stretch", "pressure"}


def test_the_table_of_a_branch_is_data():
    """Its columns in SI units stand beside those of the package, and are the same quantity."""
    branch = fm.inflate(SCENE, volumes=[0.5, 1.0])
    pandas_table = read_table(branch.to_dataframe(), SCALES)
    assert pandas_table.columns["pressure"] == pytest.approx(branch.column("pressure"), rel=1e-12)


def test_data_frames_and_mappings_and_files_are_the_same(tmp_path):
    pandas = pytest.importorskip("pandas")
    columns = {"pole_height_mm": list(HEIGHTS), "pressure_kPa": pressures()}
    found = [
        fit(text(), tmp_path).values,
        fm.fit(SCENE, columns, NAMES, noise="1 %", starts=1, intervals="linear").values,
        fm.fit(SCENE, pandas.DataFrame(columns), NAMES, noise="1 %", starts=1, intervals="linear").values,
    ]
    assert found[0] == found[1] == found[2]
    assert found[0]["material.mu"] == pytest.approx(3e5, rel=1e-4)
    assert found[0]["material.jm"] == pytest.approx(60.0, rel=5e-3)


def changed(place: int, line: str) -> list[str]:
    lines = text()
    lines[place] = line
    return lines


BAD = {
    "repeated row": (
        lambda: [*text()[:6], text()[3], *text()[6:]],
        r"bulge.csv, line 7, column 'pole_height_mm' = 8.0: row 7 repeats row 4",
    ),
    "negative": (lambda: changed(4, "11,-3"), r"line 5, column 'pressure_kPa' = -3.0: a number >= 0"),
    "NaN": (lambda: changed(4, "11,nan"), r"line 5, column 'pressure_kPa' = 'nan': a finite number"),
    "empty cell": (lambda: changed(4, "11,"), r"line 5, column 'pressure_kPa' = '': nothing was measured"),
    "words": (lambda: changed(4, "11,high"), r"line 5, column 'pressure_kPa' = 'high'"),
    "semicolons": (lambda: [line.replace(",", ";") for line in text()], "line 1 separates its columns by semicolons; commas"),
    "decimal commas and semicolons": (
        lambda: [line.replace(",", ";").replace(".", ",") for line in text()],
        "semicolons, and line 2 has decimal commas",
    ),
    "tabs": (lambda: [line.replace(",", "\t") for line in text()], "by tabs"),
    "blanks": (lambda: [line.replace(",", " ") for line in text()], "by blanks"),
    "decimal commas": (lambda: changed(2, "5,0,0,9"), "line 3 has 4 values for 2 columns; a number with a decimal comma counts as two"),
    "decimal commas in quotes": (lambda: changed(2, '"5,0",0.9'), r"line 3, column 'pole_height_mm' = '5,0': it has a decimal comma"),
    "no units": (lambda: text("pole_height,pressure"), "'pole_height' has no unit; center_height_mm is allowed"),
    "one unit": (lambda: text("pole_height_mm,pressure"), "'pressure' has no unit, while 'pole_height_mm' has one"),
    "no header": (lambda: text()[1:], "line 1 holds numbers; the first line must name its columns"),
    "misspelt": (lambda: text("pole_height_mm,presure_kPa"), "'presure_kPa' is unknown; did you mean 'pressure'"),
    "another kind of unit": (lambda: text("pole_height_kPa,pressure_kPa"), "column 'pole_height_kPa': a length"),
    "an unknown unit": (lambda: text("pole_height_mm,pressure_kPs"), "'kPs' is no unit known here"),
    "kPa that are Pa": (
        lambda: text("pole_height_mm,pressure_MPa"),
        "column 'pressure_MPa' = .* pressures are about 1000 times what this sheet",
    ),
    "Pa that are kPa": (lambda: text("pole_height_mm,pressure_Pa"), "pressures are about 1000 times less than this sheet holds"),
    "mm that are m": (lambda: text("pole_height_m,pressure_kPa"), "column 'pole_height_m' = 14.0: these are about 1000 times the size"),
    "mm that are um": (lambda: text("pole_height_um,pressure_kPa"), "about 1000 times less than a test of this membrane reaches"),
    "pressure at rest": (lambda: changed(1, "0,1"), r"line 2, column 'pole_height_mm' = 0.0: a flat membrane bears no pressure"),
    "one row": (lambda: text()[:2], "data = '1 rows': they give 1 predicted numbers for 2 parameters"),
    "nothing to predict": (lambda: [line.split(",")[0] for line in text()], "two of pressure, center_height, volume and pole_stretch"),
    "nothing": (lambda: [""], "the file is empty"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_tables_are_refused_by_row_and_column(case, tmp_path):
    lines, message = BAD[case]
    with pytest.raises(fm.InputError, match=message):
        fit(lines(), tmp_path)


def test_unsorted_rows_and_rows_at_rest_are_said(tmp_path):
    lines = text()
    plain = fit(lines, tmp_path)
    shuffled = fit([lines[0], "0,0", lines[5], lines[2], lines[1], *lines[6:], *lines[3:5]], tmp_path)
    assert shuffled.values == pytest.approx(plain.values, rel=1e-7)
    assert any("line 4, column 'pole_height_mm': it falls below the row before" in note for note in shuffled.notes)
    assert any("rows at rest" in note for note in shuffled.notes)


def test_units_of_columns_without_one_may_be_said():
    si = {"center_height": [h / 1e3 for h in HEIGHTS], "pressure": [1e3 * p for p in pressures()]}
    found = fm.fit(SCENE, si, NAMES, noise="1 %", starts=1, intervals="linear", units="si")
    assert found.values["material.mu"] == pytest.approx(3e5, rel=1e-4)


def test_bad_mappings():
    for data, message in (
        ({"center_height": [0.1, 0.2], "pressure": [0.1]}, "column 'pressure' has 1 rows and 'center_height' has 2"),
        ({"center_height": [0.1, "a"], "pressure": [0.1, 0.2]}, r"data, row 2, column 'center_height' = 'a'"),
        ({"center_height": 0.1, "pressure": 0.1}, "a list of numbers is allowed"),
        ({}, "columns such as"),
        ([], "one test or more"),
        (3, "a mapping of columns, a DataFrame or the path"),
        ("nowhere.csv", "the file cannot be read"),
        ({"stretch": [1.2], "nominal_stress": [0.4]}, "which test it is must be said"),
        ({"stretch": [0.8], "uniaxial_stress": [0.4]}, "a stress with the sign of stretch - 1"),
        ({"pole_stretch": [150.0], "pressure": [0.4]}, "in percent"),
        ({"center_height": [0.3], "pressure": [0.4], "pressure_sd": [-0.1]}, "a standard deviation >= 0"),
        ({"center_height_mm": [0.3], "pressure_kPa": [0.4]}, "the scene has no scales"),
    ):
        with pytest.raises(fm.InputError, match=message):
            fm.fit(SCENE.replace(scales=None), data, ["material.mu"])


def test_profile_rows_of_one_state_have_one_pressure():
    data = {"state": [1, 1], "pressure": [0.5, 0.6], "r": [0.1, 0.2], "z": [0.3, 0.3]}
    with pytest.raises(fm.InputError, match=r"row 2, column 'pressure' = 0.6: rows of one state have one pressure: 0.5 as in row 1"):
        fm.fit(SCENE.replace(scales=None), data, ["material.mu"])


def test_numbers_that_a_fit_may_change():
    one = SCENE.replace(material=fm.Ogden((1.25,), (1.6,)))
    data = {"pole_height_mm": list(HEIGHTS), "pressure_kPa": pressures()}
    for scene, names, message in (
        (SCENE, ["material.jn"], "did you mean 'material.jm'"),
        (SCENE, [], "a list of names"),
        (SCENE, ["material.jm", "material.jm"], "every name once"),
        (SCENE, ["scales.shear_modulus", "membrane.modulus"], "the same number"),
        (one, ["scales.shear_modulus", "material.mu.0"], "the same number"),
    ):
        with pytest.raises(fm.InputError, match=message):
            fm.fit(scene, data, names)


def test_noise_is_said_by_column():
    data = {"pole_height_mm": list(HEIGHTS), "pressure_kPa": pressures()}
    for noise, message in (({"presure": 0.1}, "columns of the table are allowed"), ("-1 %", "noise"), ({"pressure": "3 mm"}, "noise")):
        with pytest.raises(fm.InputError, match=message):
            fm.fit(SCENE, data, NAMES, noise=noise)
    with_unit = fm.fit(SCENE, data, NAMES, noise={"pressure": "0.05 kPa"}, starts=1, intervals="linear")
    plain = fm.fit(SCENE, data, NAMES, noise=0.05, starts=1, intervals="linear")
    assert with_unit.standard_errors == pytest.approx(plain.standard_errors, rel=1e-9)
    assert np.isfinite(list(plain.standard_errors.values())).all()


@pytest.mark.parametrize("word", ["nan", "NA", "n/a", "inf"])
def test_what_was_not_measured_is_no_unit(tmp_path, word):
    path = tmp_path / "test.csv"
    path.write_text(f"center_height_mm,pressure_kPa\n0.5,{word}\n")
    with pytest.raises(InputError, match="leave the row out") as error:
        read_table(path, SCALES)
    assert "units" not in str(error.value)
