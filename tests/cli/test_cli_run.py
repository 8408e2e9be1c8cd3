"""``femmembrane run`` from scene file to files, as a user types it."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from femmembrane.cli import main

HEAD = """
title = "small"
[material]
model = "ogden"
mu = [1.4910, 0.0029, -0.0236]
alpha = [1.3, 5.0, -2.0]
[membrane]
susceptibility = 2.5
[mesh]
elements = 16
"""


def scene_file(folder: Path, rest: str) -> Path:
    path = folder / "scene.toml"
    path.write_text(HEAD + rest, encoding="utf-8")
    return path


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_volume_run_writes_every_file(tmp_path, capfd):
    """The README's job on a small mesh and few steps: exit code 0, and in a pipe what was written."""
    run = '[[source]]\nkind = "dipole"\nstrength = 200\nheight = 6.5\n[run]\nstart = 0.5\nstop = 75.0\nsteps = 6\n'
    path = scene_file(tmp_path, run + '[analysis]\nstability = ["pressure", "volume"]\n')
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    said = capfd.readouterr()
    assert "written:" in said.out
    assert said.err == ""
    out = tmp_path / "out"
    rows = table(out / "branch.csv")
    expected = "step volume pressure center_height elastic_energy magnetic_energy lambda_pressure lambda_volume verdict_pressure"
    assert list(rows[0]) == [*expected.split(), "verdict_volume", "residual", "iterations", "seconds"]
    assert [float(row["volume"]) for row in rows] == pytest.approx([0.5, 15.4, 30.3, 45.2, 60.1, 75.0])
    assert [row["verdict_pressure"] for row in rows] == ["stable", "unstable", "stable", "stable", "stable", "stable"]
    assert {row["verdict_volume"] for row in rows} == {"stable"}
    assert max(float(row["residual"]) for row in rows) < 1e-10
    assert json.loads((out / "run.json").read_text(encoding="utf-8"))["status"] == "converged"
    assert (out / "pressure-volume.png").stat().st_size > 5_000
    assert (out / "membrane.pvd").is_file()
    assert len(list((out / "membrane").glob("*.vtu"))) == 6
    assert not (out / "special_points.csv").exists()


def test_arc_length_run_writes_special_points(tmp_path):
    run = '[run]\ncontrol = "arc-length"\nstart = 0.5\nuntil = {center_height = 3.2}\n[analysis]\nazimuthal_modes = [1]\n'
    assert main(["run", str(scene_file(tmp_path, run)), "--out", str(tmp_path / "out")]) == 0
    points = table(tmp_path / "out" / "special_points.csv")
    assert list(points[0]) == ["kind", "volume", "pressure", "center_height", "error", "azimuthal"]
    assert [float(p["pressure"]) for p in points] == pytest.approx([1.899084863, 1.490989189], rel=1e-5)
    rows = table(tmp_path / "out" / "branch.csv")
    assert float(rows[-1]["center_height"]) == pytest.approx(3.2, rel=1e-12)
    assert "lambda_n1" in rows[0]
    assert "lambda_pressure" not in rows[0]
    assert "magnetic_energy" not in rows[0]


def test_limit_point_is_exit_code_3_with_what_was_computed(tmp_path, capfd):
    run = '[run]\ncontrol = "pressure"\nvalues = [1.7, 1.8, 1.95]\n'
    assert main(["run", str(scene_file(tmp_path, run)), "--out", str(tmp_path / "out")]) == 3
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert "limit point is P = 1.8990" in err
    assert "2 equilibria" in err
    assert [float(r["pressure"]) for r in table(tmp_path / "out" / "branch.csv")] == [1.7, 1.8]
    assert json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))["status"] == "no equilibrium"


@pytest.mark.parametrize("words", [["run"], ["convergence"], ["cost"], ["sweep", "--over", "mesh.degree=1,2"]])
def test_set_is_refused_with_the_nearest_name_by_every_command(words, tmp_path, capfd):
    assert main([*words, "neo-hookean", "--out", str(tmp_path), "--set", "mesh.elemnts=8"]) == 2
    assert "mesh.elemnts = 8: unknown; did you mean 'elements'?" in capfd.readouterr().err


def test_set_takes_the_place_of_what_the_file_has(tmp_path):
    """And is part of the command that the record keeps."""
    run = 'run={control="volume",values=[0.5,1],solver="newton"}'
    assert main(["run", "neo-hookean", "--set", "mesh.elements=4", "--set", run, "--set", "title=Small one", "--out", str(tmp_path)]) == 0
    facts = json.loads((tmp_path / "run.json").read_text(encoding="utf-8"))
    assert (facts["scene"]["mesh"]["elements"], facts["scene"]["title"], facts["equilibria"]) == (4, "Small one", 2)
    assert f"--set mesh.elements=4 --set '{run}' --set 'title=Small one'" in facts["command"]


def test_jump_goes_on(tmp_path):
    run = '[run]\ncontrol = "pressure"\nvalues = [1.8, 1.95]\nat_limit = "jump"\n'
    assert main(["run", str(scene_file(tmp_path, run)), "--out", str(tmp_path / "out")]) == 0
    assert [float(r["volume"]) for r in table(tmp_path / "out" / "branch.csv")] == pytest.approx([1.773, 79.69], rel=1e-3)


def test_as_a_command_in_a_pipe(tmp_path):
    """A real process: the module runs and says what it wrote, warnings would be errors."""
    path = scene_file(tmp_path, "[run]\nvalues = [1.0]\n")
    command = [sys.executable, "-W", "error", "-m", "femmembrane", "run", str(path), "--out", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, "PYTHONWARNINGS": "error"}, timeout=300)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(f"1 equilibrium, written: {tmp_path}/out/branch.csv ")
    assert done.stdout.count("\n") == 1
    assert len(table(tmp_path / "out" / "branch.csv")) == 1
