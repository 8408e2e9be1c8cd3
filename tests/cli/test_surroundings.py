"""Whatever surrounds a command: closed streams, full ones, names that are no UTF-8, backends that are not there, forked processes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import femmembrane as fm
from femmembrane.cli import main
from femmembrane.results import output
from femmembrane.views import plots
from femmembrane.views.backend import title_text
from tests.cases import disc_scene

posix = pytest.mark.skipif(sys.platform == "win32", reason="POSIX only")
linux = pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no full device to write to")
MISSING = "module://no_such_package.backend_inline"


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.toml"
    disc_scene(elements=4).replace(run=fm.Run(values=(0.5,), solver="newton")).to_toml(path)
    return path


def command(*words, shell="", **environment):
    """The command with redirections of a shell."""
    line = ["sh", "-c", f'exec "$@" {shell}', "sh", sys.executable, "-m", "femmembrane", *map(os.fsencode, words)]
    return subprocess.run(line, capture_output=True, text=True, env={**os.environ, **environment}, check=False)


@posix
def test_closed_streams_change_nothing(scene, tmp_path):
    assert command("run", scene, "--out", tmp_path / "out", shell="<&- >&- 2>&-").returncode == 0
    # a result that took the place of a closed stream would hold what is said on it
    assert len(fm.load(tmp_path / "out" / "branch.nc")) == 1
    assert json.loads((tmp_path / "out" / "run.json").read_text())["status"] == "converged"


@posix
@pytest.mark.parametrize("stream", ["2>&-", "2>/dev/full"])
@linux
def test_an_error_that_nobody_hears_keeps_its_exit_code(tmp_path, stream):
    done = command("run", tmp_path / "none.toml", "--out", tmp_path / "out", shell=stream)
    assert (done.returncode, done.stderr) == (2, "")


@linux
@pytest.mark.parametrize("word", ["scenes", "--help"])
def test_a_full_output_is_exit_code_4(word):
    done = command(word, shell=">/dev/full")
    assert done.returncode == 4
    assert done.stderr == "femmembrane: results could not be written (No space left on device); make room\n"


@posix
def test_a_page_without_room_is_exit_code_4(scene, tmp_path):
    import resource

    assert main(["run", str(scene), "--out", str(tmp_path / "out")]) == 0
    done = subprocess.run(
        [sys.executable, "-m", "femmembrane", "report", str(tmp_path / "out")],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000)),
    )
    assert done.returncode == 4
    assert "make room" in done.stderr
    assert not (tmp_path / "out" / "report.html").exists()


@posix
@pytest.mark.skipif(sys.platform == "darwin", reason="names are UTF-8 there")
def test_names_that_are_no_utf_8(scene, tmp_path, capfd):
    out = tmp_path / os.fsdecode(b"out\xff")
    assert main(["run", str(scene), "--out", str(out), "--report"]) == 0
    assert str(out) in json.loads((out / "run.json").read_text(encoding="utf-8"))["command"]  # as Python names it
    assert "out\\udcff" in (out / "report.html").read_text(encoding="utf-8")
    assert main(["export", str(out), "--to", "vtu"]) == 0
    assert main(["run", str(scene), "--set", os.fsdecode(b"title=\xff"), "--out", str(tmp_path / "none")]) == 2
    assert "UTF-8" in capfd.readouterr().err
    assert not (tmp_path / "none").exists()


def test_the_backend_of_a_notebook_is_not_needed(scene, tmp_path):
    done = command("run", scene, "--out", tmp_path / "out", MPLBACKEND=MISSING)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out" / "pressure-volume.png").exists()


@pytest.mark.parametrize("drawn", ["plot_pressure_volume(branch, path)", "plot_profiles(branch, path)"])
def test_a_picture_needs_no_backend(scene, tmp_path, drawn):
    lines = [
        "import os, sys, femmembrane as fm",
        "from femmembrane.views.plots import *",
        "scene, path = sys.argv[1:]",
        "branch = fm.run(fm.Scene.from_toml(scene))",
        drawn,
        f"assert os.environ['MPLBACKEND'] == {MISSING!r}",
    ]
    picture = tmp_path / "picture.png"
    environment = {**os.environ, "MPLBACKEND": MISSING}
    subprocess.run([sys.executable, "-c", "\n".join(lines), str(scene), str(picture)], check=True, env=environment)
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_an_input_error_while_results_are_written_is_no_full_disk(scene, tmp_path, monkeypatch, capfd):
    def refuse(*_):
        raise fm.InputError("mesh.elements", 0, "a whole number >= 1 is allowed")

    monkeypatch.setattr(output, "write_csv", refuse)
    assert main(["run", str(scene), "--out", str(tmp_path / "out")]) == 2
    error = capfd.readouterr().err
    assert "mesh.elements = 0: a whole number" in error
    assert "room" not in error


@pytest.mark.parametrize("title", ["x " * 400, "$a_b^{", "\\$5", "漢字 \N{GRINNING FACE}", "two\nlines\tand a tab"])
def test_any_title_is_drawn_as_it_stands(title, tmp_path):
    branch = fm.inflate(disc_scene(elements=4).replace(title=title), volumes=[0.5], solver="newton")
    figure = plots.plot_pressure_volume(branch, tmp_path / "picture.png")
    shown = figure.axes[0].get_title()
    assert shown == title_text(title)
    assert shown == " ".join(title.split()) or (len(shown) <= 120 and shown.endswith("…"))
    branch.save(tmp_path / "branch.nc")
    assert fm.load(tmp_path / "branch.nc").scene.title == title


def test_a_folder_of_fonts_that_cannot_be_made_is_no_matter_for_a_message(scene, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "femmembrane", "run", str(scene), "--out", str(tmp_path / "out")],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "MPLCONFIGDIR": str(scene)},
    )
    assert (done.returncode, done.stderr) == (0, "")
