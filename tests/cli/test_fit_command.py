"""``femmembrane fit``: the files that it leaves, what it refuses, and its exit codes."""

from __future__ import annotations

import csv
import os
import sys
from pathlib import Path

import pytest

import femmembrane as fm
from femmembrane.cli import BAD_INPUT, DONE, main

DEMOS = Path(__file__).parents[2] / "demos"
FILES = {"fitted.toml", "fit.csv", "residuals.csv", "fit.png", "report.html"}


def command(out: Path, *more: str, data: str = "", parameters: tuple[str, ...] = ("material.c10", "material.c01")) -> int:
    table = data or str(DEMOS / "bulge-test.csv")
    words = ["fit", str(DEMOS / "bulge-test.toml"), table, "--parameters", *parameters, "--out", str(out)]
    return main([*words, "--set", "mesh.elements=8", "--set", "mesh.degree=4", *more])


def test_the_demo_of_a_bulge_test(tmp_path):
    """The moduli that the synthetic table was made with lie in their intervals; the scene that is left holds them."""
    assert command(tmp_path / "out", "--noise", "pressure=1 %", "center_height=0.1 mm") == DONE
    assert {path.name for path in (tmp_path / "out").iterdir()} == FILES
    with (tmp_path / "out" / "fit.csv").open(encoding="utf-8", newline="") as file:
        rows = {row["parameter"]: row for row in csv.DictReader(file)}
    for name, truth in (("material.c10", 160e3), ("material.c01", 12e3)):
        assert rows[name]["unit"] == "Pa"
        assert float(rows[name]["low"]) < truth < float(rows[name]["high"])
    fitted = fm.Scene.from_toml(tmp_path / "out" / "fitted.toml")
    moduli = [float(rows[name]["value"]) for name in ("material.c10", "material.c01")]
    assert fitted.scales.shear_modulus == pytest.approx(2 * sum(moduli), rel=1e-12)
    assert fitted.material.ratio == pytest.approx(moduli[1] / moduli[0], rel=1e-12)
    # the weight of the sheet in kg/m^3 is what it was
    assert fitted.scales.to_si("weight", fitted.loads[0].weight) == pytest.approx(960.0, rel=1e-9)
    with (tmp_path / "out" / "residuals.csv").open(encoding="utf-8", newline="") as file:
        assert len(list(csv.DictReader(file))) == 16


def test_models_and_a_test_of_another_scene(tmp_path):
    strip = tmp_path / "strip.csv"
    mu = 344e3
    strip.write_text(
        "stretch,uniaxial_stress_MPa\n" + "".join(f"{s},{mu * (s - s**-2) / 1e6}\n" for s in (1.2, 1.6, 2.2, 3.0)), encoding="utf-8"
    )
    other = f"{DEMOS / 'bulge-test.toml'}={strip}"
    assert command(tmp_path / "out", other, "--noise", "1 %", "--compare", "--starts", "1", parameters=("scales.shear_modulus",)) == DONE
    assert {path.name for path in (tmp_path / "out").iterdir()} == {*FILES, "models.csv"}
    with (tmp_path / "out" / "models.csv").open(encoding="utf-8", newline="") as file:
        assert {row["model"] for row in csv.DictReader(file)} >= {"neo-hookean", "gent", "ogden-3"}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace("kPa", "MPa"), "pressures are about 1000 times what this sheet holds"),
        (lambda text: text.replace(",", ";"), "separates its columns by semicolons"),
        (lambda text: text.replace("_kPa", ""), "has no unit"),
    ],
)
def test_bad_tables_leave_nothing(change, message, tmp_path, capsys):
    table = tmp_path / "bulge.csv"
    table.write_text(change((DEMOS / "bulge-test.csv").read_text(encoding="utf-8")), encoding="utf-8")
    assert command(tmp_path / "out", data=str(table)) == BAD_INPUT
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_unknown_numbers_and_noise(tmp_path, capsys):
    assert command(tmp_path / "out", parameters=("material.c20",)) == BAD_INPUT
    assert "unknown" in capsys.readouterr().err
    assert command(tmp_path / "out", "--noise", "pressure=much") == BAD_INPUT
    assert "noise['pressure']" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(os.name != "posix", reason="a link in the way")
def test_a_link_in_the_way_is_no_result(tmp_path, capsys):
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    out.mkdir()
    elsewhere.write_text("mine", encoding="utf-8")
    (out / "fitted.toml").symlink_to(elsewhere)
    assert command(out) == BAD_INPUT
    assert elsewhere.read_text(encoding="utf-8") == "mine"
    assert "fitted.toml" in capsys.readouterr().err


def test_what_is_suspected_of_a_table_is_said(tmp_path, capsys, monkeypatch):
    """Exchanged columns have a fit; the table on a terminal says what is suspected, and in a pipe a line on stderr does."""
    columns = {"pole_height_mm": [5.0, 8.75, 12.5, 16.25, 20.0], "pressure_kPa": [0.4014, 1.7147, 3.6509, 5.5543, 7.0278]}
    (tmp_path / "scene.toml").write_text(
        '[material]\nmodel = "mooney-rivlin"\nratio = 0.1\n[mesh]\nelements = 4\ndegree = 4\n'
        '[scales]\nradius = "25 mm"\nthickness = "0.3 mm"\nshear_modulus = "0.33 MPa"\n'
    )
    swapped = zip(columns, reversed(columns.values()), strict=True)
    names, values = zip(*swapped, strict=True)
    lines = [",".join(names), *(",".join(map(str, row)) for row in zip(*values, strict=True))]
    (tmp_path / "data.csv").write_text("\n".join(lines) + "\n")
    words = ["fit", str(tmp_path / "scene.toml"), str(tmp_path / "data.csv"), "--parameters", "scales.shear_modulus"]
    words += ["--starts", "1", "--intervals", "linear", "--out", str(tmp_path / "out")]
    assert main(words) == DONE
    said = capsys.readouterr()
    assert said.err.count("are these columns swapped?") == 1
    assert "swapped" not in said.out
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    assert main(words) == DONE
    said = capsys.readouterr()
    assert said.out.count("are these columns swapped?") == 1
    assert "swapped" not in said.err
