"""Every demo runs as its user would run it, and finds the numbers that it states."""

from __future__ import annotations

import csv
import runpy
import sys
from pathlib import Path

import pytest

from femmembrane.cli import main
from femmembrane.scene import Scene

DEMOS = Path(__file__).parents[1] / "demos"
#: options that make a demo quick enough for every test run; without an entry it is run whole
QUICK = {"timings.py": ["--quick"], "verdict_cost.py": ["--quick"], "cost.py": ["--quick", "--growth"]}


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
    assert capfd.readouterr() == ("", "")
    assert {"branch.csv", "branch.nc", "membrane.pvd", "pressure-volume.png", "run.json"} <= {p.name for p in (tmp_path / "out").iterdir()}


def test_every_demo_is_listed() -> None:
    """The table of demos/README.md names each script and scene file."""
    listed = (DEMOS / "README.md").read_text(encoding="utf-8")
    missing = [path.name for path in (*DEMOS.glob("*.py"), *DEMOS.glob("*.toml")) if f"| {path.name} |" not in listed]
    assert not missing
