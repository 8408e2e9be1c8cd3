"""The command line: exit codes, messages, silence in a pipe, and what happens when a computation ends early."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import types
from pathlib import Path

import pytest

import femmembrane
from femmembrane import cli
from femmembrane.errors import SolveError, Status
from femmembrane.results.branch import Branch
from femmembrane.results.equilibrium import Equilibrium
from femmembrane.scene import Scene

ROOT = Path(__file__).parents[2]
DEMO = ROOT / "demos" / "dipole-above.toml"


def command(*arguments, cwd=ROOT):
    """What a shell sees of ``python -m femmembrane``: nothing here is a terminal."""
    paths = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    return subprocess.run(
        [sys.executable, "-W", "error", "-m", "femmembrane", *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": paths},
        timeout=60,
        check=False,
    )


def is_one_message(text):
    return text.startswith("femmembrane: ") and text.endswith("\n") and text.count("\n") == 1


# --- as a shell sees it

BROKEN = [
    ("elements = 64", "elements = -64", "mesh.elements = -64"),
    ("elements = 64", "element = 64", "did you mean 'elements'"),
    ("height = 6.5", "height = 0.0", "source.height = 0.0"),
    ("susceptibility = 2.5", "", "membrane.susceptibility"),
    ('model = "ogden"', 'model = "ogdan"', "did you mean 'ogden'"),
    ("steps = 60", "steps = 0", "run.steps = 0"),
    ("stop = 75.0", "", "run.stop"),
    ('stability = ["pressure", "volume"]', "wrinkling = 1", "analysis.wrinkling"),
    ("[run]", "[run", "line 2"),
    ("[run]", "[runs]", "did you mean 'run'"),
]


@pytest.mark.parametrize(("old", "new", "told"), BROKEN, ids=[new or f"no {old}" for _, (old, new, _) in enumerate(BROKEN)])
def test_broken_scene(tmp_path, capsys, old, new, told):
    text = DEMO.read_text(encoding="utf-8")
    assert old in text
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(text.replace(old, new), encoding="utf-8")
    assert cli.main(["run", str(scene), "--out", str(out)]) == cli.BAD_INPUT
    said = capsys.readouterr()
    assert said.out == ""
    assert is_one_message(said.err)
    assert told in said.err
    assert not out.exists()


def test_broken_scene_from_a_shell(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(DEMO.read_text(encoding="utf-8").replace("degree = 2", "degree = 9"), encoding="utf-8")
    done = command("run", scene, "--out", tmp_path / "out")
    assert (done.returncode, done.stdout) == (2, "")
    assert is_one_message(done.stderr)
    assert "mesh.degree = 9" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["run"], "SCENE"),
        (["run", DEMO], "--out"),
        (["run", DEMO, "--out"], "--out"),
        (["run", DEMO, "--out", "x", "--fast"], "--fast"),
        (["run", DEMO, "another.toml", "--out", "x"], "another.toml"),
        (["rum", DEMO], 'Did you mean "run"'),
        (["run", "none.toml", "--out", "x"], "No such file"),
        (["run", ".", "--out", "x"], "directory"),
    ],
    ids=["no scene", "no out", "empty out", "unknown option", "two scenes", "unknown command", "no file", "folder"],
)
def test_bad_arguments(arguments, told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main([str(a) for a in arguments]) == cli.BAD_INPUT
    said = capsys.readouterr()
    assert said.out == ""
    assert is_one_message(said.err)
    assert told in said.err
    assert not any(tmp_path.iterdir())


def test_bad_arguments_from_a_shell():
    done = command("run", DEMO, "--out", "x", "--fast")
    assert (done.returncode, done.stdout) == (2, "")
    assert is_one_message(done.stderr)
    assert "--fast" in done.stderr


def test_scene_without_run(tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text('[material]\nmodel = "neo-hookean"\n', encoding="utf-8")
    assert cli.main(["run", str(scene), "--out", str(tmp_path / "out")]) == cli.BAD_INPUT
    assert "[run] with control" in capsys.readouterr().err


def test_out_is_a_file(tmp_path, capsys):
    file = tmp_path / "file"
    file.write_text("mine", encoding="utf-8")
    for out in (file, file / "below", "a\0b"):
        assert cli.main(["run", str(DEMO), "--out", str(out)]) == cli.BAD_INPUT
        said = capsys.readouterr()
        assert is_one_message(said.err)
        assert "--out = " in said.err
    assert file.read_text(encoding="utf-8") == "mine"


def test_out_cannot_be_written(tmp_path, capsys, monkeypatch):
    def refuse(*args, **keys):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.TemporaryFile", refuse)  # permissions do not stop an administrator
    assert cli.main(["run", str(DEMO), "--out", str(tmp_path)]) == cli.BAD_INPUT
    assert "Permission denied" in capsys.readouterr().err


def test_version_and_help():
    version, help_text, bare = command("--version"), command("--help"), command()
    assert (version.returncode, version.stdout, version.stderr) == (0, femmembrane.__version__ + "\n", "")
    assert (help_text.returncode, help_text.stderr) == (0, "")
    assert "run" in help_text.stdout
    assert bare.stdout == help_text.stdout
    assert bare.returncode == 0
    run_help = command("run", "--help")
    assert run_help.returncode == 0
    assert "--out" in run_help.stdout
    assert "SCENE" in run_help.stdout


def test_help_imports_nothing_heavy():
    heavy = ("numpy", "scipy", "casadi", "skfem", "matplotlib", "pyvista", "vtk", "xarray", "pandas", "meshio", "h5netcdf", "h5py")
    code = (
        f"import sys; from femmembrane.cli import main; main(['--help']); sys.stderr.write(repr([m for m in {heavy} if m in sys.modules]))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.stderr == "[]"


# --- with a stand-in for the computation


@pytest.fixture
def stand_in(monkeypatch):
    """Replace the verb and the writer; returns the list of branches that were written."""
    written = []

    def write_run(branch, directory, *, command=None, units="scaled"):
        assert command == f"femmembrane run {DEMO} --out {directory}"
        written.append(branch)
        return [Path(directory) / "branch.csv"]

    def install(run, write=write_run):
        def observed(scene, on_step, on_checkpoint, unfinished):
            return run(scene, on_step)

        monkeypatch.setitem(sys.modules, "femmembrane.verbs", types.SimpleNamespace(run=observed))
        from femmembrane.results import output

        monkeypatch.setattr(output, "write_run", write)
        return written

    return install


def equilibrium(scene, volume):
    return Equilibrium(1.5, volume, 0.5, 1.0, -1.0, 1e-14, 3, Status.CONVERGED, scene.replace(analysis=type(scene.analysis)()), None)


def steps(scene, on_step, count):
    found = tuple(equilibrium(scene, 0.5 + k) for k in range(count))
    for k, new in enumerate(found):
        on_step(k, 60, new)
    return found


def main(tmp_path):
    return cli.main(["run", str(DEMO), "--out", str(tmp_path)])


def test_done_in_a_pipe_says_what_was_written(stand_in, tmp_path, capsys):
    written = stand_in(lambda scene, on_step: Branch(scene, steps(scene, on_step, 3)))
    assert main(tmp_path) == cli.DONE
    assert capsys.readouterr() == (f"3 equilibria, written: {tmp_path}/branch.csv\n", "")
    assert len(written) == 1
    assert written[0].scene == Scene.from_toml(DEMO)


def test_summary_on_a_terminal(stand_in, tmp_path, capsys, monkeypatch):
    stand_in(lambda scene, on_step: Branch(scene, steps(scene, on_step, 3)))
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert main(tmp_path) == cli.DONE
    assert capsys.readouterr() == (f"3 equilibria, written:\n  {tmp_path}/branch.csv\n", "")


def test_progress_on_a_terminal(stand_in, tmp_path, capsys, monkeypatch):
    plain = tmp_path / "plain.toml"
    Scene.from_toml(DEMO).replace(analysis=type(Scene.from_toml(DEMO).analysis)()).to_toml(plain)
    stand_in(lambda scene, on_step: Branch(scene, steps(scene, on_step, 3)), write=lambda *a, **k: [])
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")
    assert cli.main(["run", str(plain), "--out", str(tmp_path)]) == cli.DONE
    said = capsys.readouterr()
    assert said.out == "3 equilibria, written:\n"
    assert "3/60" in said.err
    assert "P = 1.5" in said.err


def test_progress_by_arc_length_promises_no_end(stand_in, tmp_path, capsys, monkeypatch):
    """How many steps there will be is not known; how far there is to go is."""
    traced = tmp_path / "traced.toml"
    scene = Scene.from_toml(DEMO).replace(analysis=type(Scene.from_toml(DEMO).analysis)())
    scene.replace(run=type(scene.run)(control="arc-length", start=0.5, until={"center_height": 5.2})).to_toml(traced)
    stand_in(lambda scene, on_step: Branch(scene, steps(scene, on_step, 3)), write=lambda *a, **k: [])
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")
    assert cli.main(["run", str(traced), "--out", str(tmp_path)]) == cli.DONE
    said = capsys.readouterr().err
    assert "step 3, pole height 0.5 until 5.2" in said
    assert "3/60" not in said


def test_not_converged_keeps_what_was_computed(stand_in, tmp_path, capsys):
    written = stand_in(lambda scene, on_step: Branch(scene, steps(scene, on_step, 2), Status.STEP_UNDERFLOW, "volume 3 was not reached"))
    assert main(tmp_path) == cli.NOT_CONVERGED
    said = capsys.readouterr()
    assert said.out == ""
    assert is_one_message(said.err)
    assert "volume 3 was not reached" in said.err
    assert Status.STEP_UNDERFLOW.advice in said.err
    assert "2 equilibria" in said.err
    assert [len(b) for b in written] == [2]


def test_advice_is_given_once(stand_in, tmp_path, capsys):
    advice = Status.NOT_CONVERGED.advice
    message = f"volume 3 was not reached. {advice[0].upper()}{advice[1:]}."
    stand_in(lambda scene, on_step: Branch(scene, steps(scene, on_step, 1), Status.NOT_CONVERGED, message))
    assert main(tmp_path) == cli.NOT_CONVERGED
    said = capsys.readouterr().err
    assert said.lower().count(advice) == 1
    assert "1 equilibrium," in said
    assert ".." not in said.replace(str(tmp_path), "")


def test_solve_error_keeps_what_was_computed(stand_in, tmp_path, capsys):
    def run(scene, on_step):
        steps(scene, on_step, 2)
        raise SolveError("lost", status=Status.DIPOLE_CONTACT)

    written = stand_in(run)
    assert main(tmp_path) == cli.NOT_CONVERGED
    assert Status.DIPOLE_CONTACT.advice in capsys.readouterr().err
    assert [(len(b), b.status, b.message) for b in written] == [(2, Status.DIPOLE_CONTACT, "lost")]


def interrupt():
    os.kill(os.getpid(), signal.SIGINT)


def swallowed_interrupt():
    with contextlib.suppress(KeyboardInterrupt):
        interrupt()


@pytest.mark.parametrize("how", [interrupt, swallowed_interrupt], ids=["raised", "swallowed by the solver"])
def test_interrupt_keeps_what_was_computed(stand_in, tmp_path, capsys, how):
    def run(scene, on_step):
        found = steps(scene, on_step, 2)
        how()
        return Branch(scene, found, Status.NOT_CONVERGED, "stopped by the user")

    written = stand_in(run)
    assert main(tmp_path) == cli.INTERRUPTED
    said = capsys.readouterr()
    assert said.out == ""
    assert is_one_message(said.err)
    assert "interrupted" in said.err
    assert "2 equilibria" in said.err
    assert [(len(b), b.message) for b in written] == [(2, "interrupted")]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_interrupt_before_the_first_equilibrium(stand_in, tmp_path, capsys):
    written = stand_in(lambda scene, on_step: interrupt())
    assert main(tmp_path) == cli.INTERRUPTED
    assert "nothing was written" in capsys.readouterr().err
    assert written == []


def test_interrupt_while_writing_waits_for_the_files(stand_in, tmp_path, capsys):
    ended = []

    def write(branch, directory, *, command=None, units="scaled"):
        interrupt()
        ended.append(branch)
        return []

    stand_in(lambda scene, on_step: Branch(scene, steps(scene, on_step, 2)), write)
    assert main(tmp_path) == cli.INTERRUPTED
    assert len(ended) == 1
    assert "2 equilibria" in capsys.readouterr().err


def test_a_second_interrupt_while_writing_says_what_is_there(stand_in, tmp_path, capfd):
    """The first one is acknowledged at once."""

    def write(branch, directory, *, command=None, units="scaled"):
        interrupt()
        interrupt()
        return []

    stand_in(lambda scene, on_step: Branch(scene, steps(scene, on_step, 2)), write)
    assert main(tmp_path) == cli.INTERRUPTED
    said = capfd.readouterr().err
    assert "finished first" in said
    assert "some are missing" in said
    assert "nothing was written" not in said


def test_disk_full(stand_in, tmp_path, capsys):
    def write(branch, directory, *, command=None, units="scaled"):
        raise OSError(28, "No space left on device")

    stand_in(lambda scene, on_step: Branch(scene, steps(scene, on_step, 2)), write)
    assert main(tmp_path) == cli.NOT_WRITTEN
    said = capsys.readouterr()
    assert is_one_message(said.err)
    assert "No space left on device" in said.err
