"""What a command line has that one does not think of: scenes to start from, completion, and where they are when installed."""

from __future__ import annotations

import errno
import os
import re
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest

from femmembrane.cli import main, scenes
from femmembrane.scene import Scene

ROOT = Path(__file__).parents[2]


def test_scenes_are_listed_with_their_titles(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenes"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == sorted(path.stem for path in (ROOT / "demos").glob("*.toml"))
    assert "dipole-above    Dipole above the membrane" in lines


def test_a_scene_is_run_by_its_name(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there is no such file; of an installed package, which stands in no source tree, the scenes that it brought along."""
    folder = tmp_path / "share" / "femmembrane" / "scenes"
    folder.mkdir(parents=True)
    (folder / "small.toml").write_text('[material]\nmodel = "neo-hookean"\n[mesh]\nelements = 4\n[run]\nvalues = [1.0]\n', encoding="utf-8")
    files = [metadata.PackagePath(name) for name in ("femmembrane/scene/value.py", "../share/femmembrane/scenes/small.toml")]
    for file in files:
        file.dist = SimpleNamespace(locate_file=lambda path: tmp_path / "lib" / path)
    monkeypatch.setattr(metadata, "files", lambda name: files)
    monkeypatch.setattr(scenes, "_TREE", tmp_path)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lib").mkdir()
    assert main(["run", "small", "--out", "out"]) == 0
    assert main(["run", "smal", "--out", "out"]) == 2
    assert "did you mean 'small'" in capsys.readouterr().err


def test_the_wheel_has_the_scenes_where_they_are_looked_for() -> None:
    """Whichever of the two builds it."""
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    wheel = tools.get("hatch", {}).get("build", {}).get("targets", {}).get("wheel", {})
    data = tools.get("setuptools", {}).get("data-files", {})
    assert wheel.get("sources") == {"demos": "femmembrane/scenes"} or data.get("share/femmembrane/scenes") == ["demos/*.toml"]


def test_the_wheel_has_the_mesh_files_of_its_scenes() -> None:
    """Where they are looked for, from the folder of the scene."""
    data = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["data-files"]
    brought = {(Path(place) / file.name).as_posix() for place, patterns in data.items() for glob in patterns for file in ROOT.glob(glob)}
    tables = [tomllib.loads(path.read_text(encoding="utf-8")) for path in (ROOT / "demos").glob("*.toml")]
    files = [table["mesh"]["file"] for table in tables if "file" in table.get("mesh", {})]
    assert files
    for file in files:
        assert os.path.normpath(f"share/femmembrane/scenes/{file}").replace(os.sep, "/") in brought


def test_a_new_scene(tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """It reads as it stands, and with every comment that offers a key taken at its word; a file that is there is left alone."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "my-first_dome"]) == 0
    scene = Scene.from_toml("my-first_dome.toml")
    assert scene.title == "My first dome"
    assert scene.run is not None
    text = Path("my-first_dome.toml").read_text(encoding="utf-8")
    whole = re.sub(r"^# (?=\[|[a-z_]+ = )", "", text.replace('model = "neo-hookean"\n', ""), flags=re.MULTILINE)
    everything = Scene.from_dict(tomllib.loads(whole))
    assert everything.sources
    assert everything.tension_field
    assert everything.analysis.error_estimates
    assert main(["new", "my-first_dome.toml"]) == 2
    assert "is there already" in capfd.readouterr().err
    assert Path("my-first_dome.toml").read_text(encoding="utf-8") == text
    assert main(["new", "nowhere/dome"]) == 2


def test_completion_is_written(tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """A script that bash reads, with every command in it."""
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in ("XDG_DATA_HOME", "BASH_COMPLETION_USER_DIR"):
        monkeypatch.delenv(name, raising=False)
    assert main(["--install-completion", "--shell", "bash"]) == 0
    script = Path(re.search(r"written: (.+)", capfd.readouterr().out)[1])  # type: ignore[index]
    assert script.is_relative_to(tmp_path)
    text = script.read_text(encoding="utf-8")
    assert all(name in text for name in ("run", "report", "view", "export", "scenes", "convergence"))
    subprocess.run(["bash", "-n", str(script)], check=True, timeout=20)


def test_help_is_quick() -> None:
    """No module that is slow to import; what there is, cyclopts and lazy_loader apart, is ours."""
    code = "import sys; import cyclopts, lazy_loader; before = set(sys.modules); import femmembrane.cli; print(*set(sys.modules) - before)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    roots = {name.split(".")[0] for name in done.stdout.split()}
    assert roots - set(sys.stdlib_module_names) == {"femmembrane"}
    rooms = {name.split(".")[1] for name in done.stdout.split() if name.startswith("femmembrane.")}
    assert rooms == {"cli", "errors"}


def test_a_reader_that_has_seen_enough_is_no_error() -> None:
    process = subprocess.Popen([sys.executable, "-m", "femmembrane", "scenes"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.close()
    assert process.stderr.read() == b""
    process.stderr.close()
    assert process.wait() == 0


@pytest.mark.parametrize(
    "error",
    [
        MemoryError(),
        RuntimeError("std::bad_alloc"),
        OSError(errno.ENOMEM, "Cannot allocate memory"),
        ImportError("some.so: failed to map segment from shared object"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_no_memory_is_one_line(
    error: Exception, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def run_out(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("femmembrane.verbs.run", run_out)
    assert main(["run", "neo-hookean", "--out", str(tmp_path / "out")]) == 4
    said = capfd.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert said.err.startswith("femmembrane: there is too little memory (")
    assert not (tmp_path / "out").exists()


def test_a_limit_below_what_the_libraries_take_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before they are imported: an OpenBLAS without memory ends the process, and a solver without memory may never come back."""
    monkeypatch.setattr("femmembrane.memory._limits", lambda: iter([("addresses", 2**28)]))
    assert main(["run", "neo-hookean", "--out", str(tmp_path / "out")]) == 4
    assert "0.42 GiB of addresses at least, and a limit of this process leaves 0.25 GiB" in capfd.readouterr().err
    monkeypatch.setattr("femmembrane.memory._limits", lambda: iter([("addresses", 2**30), ("data", 2**29)]))
    assert main(["run", "neo-hookean", "--set", "run.values=[1.0]", "--out", str(tmp_path / "out")]) == 0


def test_other_errors_are_not_called_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("something else")

    monkeypatch.setattr("femmembrane.verbs.run", fail)
    with pytest.raises(RuntimeError, match="something else"):
        main(["run", "neo-hookean", "--out", str(tmp_path / "out")])
