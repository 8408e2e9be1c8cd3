"""What commands say when all went well: one line in a pipe, with the files; tables on a terminal, or where they are asked for."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from femmembrane.cli import main

SCENE = """
[material]
model = "neo-hookean"
[mesh]
elements = 4
[run]
control = "arc-length"
start = 0.5
until = {volume = 4.0}
"""
DATA = "center_height,pressure\n0.3,0.9\n0.5,1.4\n0.7,1.7\n0.9,1.85\n"
#: of each command: its words after the name, a part of its line, and the head of its table
COMMANDS = {
    "run": ("scene.toml --out run", " equilibria, 1 special point (first limit point at P = 1.88), written: run/branch.csv ", ""),
    "sweep": ("scene.toml --over mesh.degree=1,2 --workers 1 --out sweep", "2 scenes (2 converged), written: ", "scenes over mesh.degree"),
    "convergence": ("scene.toml --degrees 2 --elements 2,4 --out study", "2 meshes, written: ", "reference"),
    "fit": ("scene.toml data.csv --parameters material.mu --out fit", "material.mu = ", "95 % interval"),
    "export": ("run --to vtu", "written: run/export.vtu", ""),
    "new": ("mine", "written: mine.toml", ""),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("success")
    (found / "scene.toml").write_text(SCENE)
    (found / "data.csv").write_text(DATA)
    return found


def test_success_is_one_line_in_a_pipe(folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(folder)
    for command, (words, part, _) in COMMANDS.items():
        assert main([command, *words.split()]) == 0, capfd.readouterr()
        said = capfd.readouterr()
        assert (said.out.count("\n"), said.out[-1], said.err) == (1, "\n", ""), command
        assert part in said.out, command
        files = said.out.split("written: ")[1].split()
        assert files, command
        assert all((folder / file).exists() for file in files), command


@pytest.mark.parametrize("way", ["--table", "terminal"])
def test_tables_are_on_terminals_and_where_they_are_asked_for(
    way: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    for command in ("sweep", "convergence"):
        words, part, table = COMMANDS[command]
        if way == "terminal":
            monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
        assert main([command, *words.split(), *([way] if way != "terminal" else [])]) == 0
        said = capsys.readouterr().out
        assert table in said
        assert part.strip() in said
        assert said.index(table) < said.index(part.strip())  # the line on what was written comes last
