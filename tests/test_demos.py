"""Every demo runs as its user would run it, and finds the numbers that it states."""

from __future__ import annotations

import csv
import importlib
import re
import runpy
import sys
from pathlib import Path

import pytest

from femmembrane.cli import main
from femmembrane.scene import Scene

DEMOS = Path(__file__).parents[1] / "demos"
#: options that make a demo quick enough for every test run; without an entry it is run whole
QUICK = {
    "timings.py": ["--quick"],
    "plates.py": ["--quick"],
    "magnet-contact.py": ["--quick", "--no-movie"],
    "sweep.py": ["--quick"],
    "verdict_cost.py": ["--quick"],
    "wrinkle_numbers.py": ["--quick"],
    "fit_coverage.py": ["--quick"],
    "cost.py": ["--quick", "--growth"],
}


@pytest.mark.parametrize("script", sorted(path.name for path in DEMOS.glob("*.py")))
def test_script(script: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """It runs without a warning, states something, and writes to its folder and nowhere else."""
    elsewhere, out = tmp_path / "elsewhere", tmp_path / "out"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    monkeypatch.setattr(sys, "argv", [script, "--out", str(out), *QUICK.get(script, [])])
    runpy.run_path(str(DEMOS / script), run_name="__main__")
    printed = capsys.readouterr()
    assert len(printed.out.splitlines()) >= 2
    assert printed.err == ""
    assert not list(elsewhere.iterdir())
    for table in out.glob("*.csv"):
        with table.open(newline="", encoding="utf-8") as file:
            assert len({len(row) for row in csv.reader(file)}) == 1, table
    for picture in out.glob("*.png"):
        assert picture.stat().st_size > 10_000, picture


def test_gallery(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Every figure of the paper, each with its own checks, on one page that needs nothing beside it, and the table of demos/paper."""
    monkeypatch.syspath_prepend(str(DEMOS / "paper"))
    gallery = importlib.import_module("gallery")
    readme = tmp_path / "README.md"
    current = (DEMOS / "paper" / "README.md").read_text(encoding="utf-8")
    readme.write_text(current, encoding="utf-8")
    gallery.main(["--out", str(tmp_path / "out"), "--readme", str(readme)])
    assert capsys.readouterr().err == ""
    assert readme.read_text(encoding="utf-8") == current
    assert current.count("\n| 6a |") == 1
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert [f"figure-{n}" for n in range(3, 11)] == re.findall(r'<h2 id="([^"]*)">', page)
    assert set(re.findall(r'src="([^,]*),', page)) == {"data:image/png;base64"}
    assert page.count("<img") == len(list((tmp_path / "out").glob("*/*.png"))) == 9


def test_figure_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """A figure is a script of its own."""
    monkeypatch.syspath_prepend(str(DEMOS / "paper"))
    monkeypatch.setattr(sys, "argv", ["figure_7.py", "--out", str(tmp_path / "out")])
    runpy.run_path(str(DEMOS / "paper" / "figure_7.py"), run_name="__main__")
    assert "wrinkled part shrinks as V rises" in capsys.readouterr().out
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"figure-7.csv", "figure-7.png"}


def test_self_field(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The largest pressures and the equilibria at one pressure, without and with the self-field."""
    monkeypatch.syspath_prepend(str(DEMOS / "paper"))
    monkeypatch.setattr(sys, "argv", ["self_field.py", "--quick", "--out", str(tmp_path / "out")])
    runpy.run_path(str(DEMOS / "paper" / "self_field.py"), run_name="__main__")
    assert "largest P, M = 200, h = 6.5" in capsys.readouterr().out


@pytest.mark.parametrize("scene", sorted(path.name for path in DEMOS.glob("*.toml")))
def test_scene_file(scene: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """It reads, says what to compute, and (on a coarse mesh) the command computes it without a word."""
    read = Scene.from_toml(DEMOS / scene)
    assert read.run is not None
    assert read.title
    coarse = tmp_path / scene
    text = (DEMOS / scene).read_text(encoding="utf-8").replace("elements = 64", "elements = 16")
    coarse.write_text(text.replace('file = "..', f'file = "{DEMOS.parent.as_posix()}'), encoding="utf-8")  # from where the copy is
    assert main(["run", str(coarse), "--out", str(tmp_path / "out")]) == 0
    said = capfd.readouterr()
    assert "written:" in said.out
    assert said.err == ""
    assert {"branch.csv", "branch.nc", "membrane.pvd", "pressure-volume.png", "run.json"} <= {p.name for p in (tmp_path / "out").iterdir()}


def test_every_demo_is_listed() -> None:
    """The table of demos/README.md names each script and scene file."""
    listed = (DEMOS / "README.md").read_text(encoding="utf-8")
    demos = [*DEMOS.glob("*.py"), *DEMOS.glob("*.toml"), *DEMOS.glob("paper/figure_*.py"), DEMOS / "paper" / "gallery.py"]
    missing = [path.name for path in demos if f"| {path.relative_to(DEMOS).as_posix()} |" not in listed]
    assert not missing
