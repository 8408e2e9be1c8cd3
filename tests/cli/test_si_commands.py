"""Scene files in SI units on the command line: values, pictures, sweeps."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest

import femmembrane as fm
from femmembrane.cli import main

#: R0 = 20 mm, T = 0.3 mm, mu = 0.4 MPa: mu T/R0 = 6000 Pa, R0^3 = 8 ml
FILE = """
units = "si"
[material]
model = "neo-hookean"
mu = "0.4 MPa"
[scales]
radius = "20 mm"
thickness = 3e-4
[mesh]
elements = 6
[run]
control = "pressure"
start = 1000
stop = "3 kPa"
steps = 3
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "scene.toml").write_text(FILE, encoding="utf-8")
    return tmp_path / "scene.toml"


def rows(file: Path) -> list[dict[str, str]]:
    with file.open(encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


def test_a_run_in_si_units(path, tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr("femmembrane.views.plots.plot_pressure_volume", lambda branch, file=None, *, units: asked.append(units))
    out = tmp_path / "out"
    assert main(["run", str(path), "--out", str(out), "--set", "run.stop=40 mbar", "--report"]) == 0
    assert [float(row["pressure_pa"]) for row in rows(out / "branch.csv")] == pytest.approx([1000, 2500, 4000], rel=1e-12)
    assert [float(row["pressure"]) for row in rows(out / "branch.csv")] == pytest.approx([1 / 6, 2.5 / 6, 4 / 6], rel=1e-12)
    assert asked == ["si"]
    assert "pressure p in kPa" in (out / "report.html").read_text(encoding="utf-8")
    assert fm.load(out / "branch.nc").scene == fm.Scene.from_dict({**fm.load(out / "branch.nc").scene.to_dict()})
    assert main(["run", str(path), "--out", str(out), "--units", "scaled"]) == 0
    assert asked == ["si", "scaled"]
    assert main(["report", str(out)]) == 0
    assert "kPa" not in (out / "report.html").read_text(encoding="utf-8")
    assert main(["report", str(out), "--units", "si"]) == 0
    assert "kPa" in (out / "report.html").read_text(encoding="utf-8")


def test_values_of_a_sweep_are_meant_as_in_the_file(path, tmp_path):
    out = tmp_path / "out"
    words = ["sweep", str(path), "--over", "run.stop=2000,3000", "--quantity", "run", "--workers", "1", "--out", str(out)]
    assert main(words) == 0
    sweep = fm.Sweep.load(out / "sweep.nc")
    assert sweep.over["run.stop"] == pytest.approx((2 / 6, 3 / 6), rel=1e-14)
    assert sweep.to_xarray()["pressure_pa"].values[:, -1] == pytest.approx([2000, 3000], rel=1e-12)


def test_a_pressure_in_pascals_without_units_is_remarked_on(path, tmp_path, capfd):
    path.write_text(
        FILE.replace('units = "si"', "").replace('stop = "3 kPa"', "stop = 5000").replace("start = 1000", "start = 0.1"), encoding="utf-8"
    )
    assert main(["run", str(path), "--out", str(tmp_path / "out"), "--set", "run.values=[0.1, 5000]", "--set", "run.control=volume"]) == 2
    capfd.readouterr()
    main(["run", str(path), "--out", str(tmp_path / "out")])
    first = capfd.readouterr().err.splitlines()[0]
    assert first.startswith("femmembrane: run.stop = 5000 is P = 5000, that is 30 MPa: over 100 times")
    notes = json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))["notes"]
    assert notes == [first.removeprefix("femmembrane: ")]


def test_si_units_need_scales(path, tmp_path, capfd):
    path.write_text(re.sub(r'units = "si"|mu = .*|\[scales\](?s:.*?)(?=\[mesh\])', "", FILE).replace('"3 kPa"', "2.0"), encoding="utf-8")
    for command in (["run"], ["sweep", "--over", "mesh.degree=1,2", "--quantity", "run"]):
        assert main([command[0], str(path), *command[1:], "--out", str(tmp_path / "out"), "--units", "si"]) == 2
        assert "units = 'si': the scene has no [scales]" in capfd.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("extra", [[], ["--dry-run"]])
@pytest.mark.parametrize("units", ["si", "scaled"])
def test_errors_of_a_sweep_show_its_values_as_given(path, tmp_path, capfd, extra, units):
    path.write_text(FILE.replace('"si"', f'"{units}"').replace("3e-4", '"0.3 mm"').replace("1000", '"1 kPa"'), encoding="utf-8")
    words = [
        "--over",
        "mesh.inner_radius=5 mm,50 mm",
        "--set",
        "mesh.shape=annulus",
        "--set",
        "mesh.inner_radius=4 mm",
        "--quantity",
        "run",
    ]
    assert main(["sweep", str(path), *words, "--out", str(tmp_path / "out"), *extra]) == 2
    assert "mesh.inner_radius = '50 mm': a number between 0 and 1" in capfd.readouterr().err


def test_the_line_of_a_trace_names_its_first_limit_point_in_its_unit(path, tmp_path, capsys):
    """The limit point of the neo-Hookean disc, P = 1.879 at V = 2.80 (also in test_success), times 6 kPa."""
    text = FILE.partition("[run]")[0] + '[run]\ncontrol = "arc-length"\nstart = "8 ml"\nuntil = {volume = "32 ml"}\n'
    path.write_text(text, encoding="utf-8")
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    said = re.search(r" equilibria, 1 special point \(first limit point at p = ([\d.]+) kPa\), written: ", capsys.readouterr().out)
    assert said is not None
    assert float(said[1]) == pytest.approx(6 * 1.879, abs=0.01)


def test_the_line_of_a_trace_over_a_number_names_where_that_turns(path, tmp_path, capsys):
    """The height of the pole ends the trace behind the limit point in the height of the magnet."""
    text = FILE.partition("[mesh]")[0].replace("20 mm", "25 mm").replace("3e-4", "5e-4")
    text += '[[source]]\nkind = "magnet"\nremanence = "1.2 T"\nradius = "8 mm"\nlength = "20 mm"\nheight = "30 mm"\n'
    text += '[membrane]\nsusceptibility = 0.5\n[mesh]\nelements = 8\n[run]\ncontrol = "arc-length"\nover = "source.0.height"\n'
    text += 'hold = {pressure = "5 kPa"}\nuntil = {center_height = "13.45 mm"}\ndirection = -1\n'
    path.write_text(text, encoding="utf-8")
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    said = re.search(r" equilibria, 1 special point \(source\.0\.height turns at ([\d.]+) mm\), written: ", capsys.readouterr().out)
    (point,) = rows(tmp_path / "out" / "special_points.csv")
    assert said is not None
    assert float(said[1]) == pytest.approx(25 * float(point["source.0.height"]), rel=1e-3)
    assert float(point["pressure_pa"]) == pytest.approx(5000.0, rel=1e-12)
