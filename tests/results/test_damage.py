"""Damaged files, links and pipes in the place of files, killed commands: words and exit code 2, or the right result; nothing else."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import sqlite3
import stat
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane import files, origin
from femmembrane.cli import main
from femmembrane.errors import InputError
from femmembrane.results import checkpoint, netcdf, output
from femmembrane.results.finished_scenes import FinishedScenes
from tests.damage import damaged

OLD = Path(__file__).parents[1] / "data" / "branch-0.1.0.nc"
SCENE = """
[material]
model = "neo-hookean"
[mesh]
elements = 4
[run]
values = [0.5, 1.0, 1.5]
"""
SWEEP = ("--over", "mesh.elements=4,5", "--quantity", "run", "--workers", "1")
COMMANDS = {"run": ("run",), "sweep": ("sweep", *SWEEP), "convergence": ("convergence", "--degrees", "1,2", "--elements", "4,8")}


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def old():
    return fm.load(OLD)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A folder that a run has completed."""
    folder = tmp_path_factory.mktemp("done")
    (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
    assert main(["run", str(folder / "scene.toml"), "--out", str(folder / "out")]) == 0
    return folder / "out"


@pytest.fixture(scope="module")
def unfinished(done):
    """What a run left behind that was cut after two of three equilibria."""
    kept = []
    fm.run(fm.Scene.from_toml(done.parent / "scene.toml"), on_checkpoint=kept.append)
    checkpoints = checkpoint.Checkpoints(done.parent, kept[1])
    checkpoints.save()
    return checkpoints.path.read_bytes()


def said(capfd):
    out, err = capfd.readouterr()
    assert not out or "written:" in out  # what a command that succeeded says
    assert err.count("\n") == 1
    assert err.startswith("femmembrane: ")
    assert len(err) < 1000
    assert err.isprintable() or err[:-1].isprintable()
    return err


# --- links, pipes, devices, folders


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("kind", ["link", "dangling link", "hard link", "pipe", "folder", "text of others"])
def test_a_lock_is_a_file_of_our_own(command, kind, scene, tmp_path, capfd):
    out, precious = tmp_path / "o", tmp_path / "precious.txt"
    out.mkdir()
    precious.write_text("precious", encoding="utf-8")
    made = {
        "link": lambda path: path.symlink_to("../precious.txt"),
        "dangling link": lambda path: path.symlink_to("../nothing.txt"),
        "hard link": lambda path: path.hardlink_to(precious),
        "pipe": os.mkfifo,
        "folder": Path.mkdir,
        "text of others": lambda path: path.write_text("mine", encoding="utf-8"),
    }
    made[kind](out / ".lock")
    name, *options = COMMANDS[command]
    assert main([name, str(scene), "--out", str(out), *options]) == 2
    assert ".lock in it" in said(capfd)
    assert precious.read_text(encoding="utf-8") == "precious"
    assert not (tmp_path / "nothing.txt").exists()
    assert [path.name for path in out.iterdir()] == [".lock"]


def test_surfaces_are_neither_written_nor_removed_elsewhere(scene, tmp_path, capfd, old):
    out, other = tmp_path / "o", tmp_path / "other"
    out.mkdir()
    other.mkdir()
    (other / "membrane_0007.vtu").write_text("mine", encoding="utf-8")
    (out / "membrane").symlink_to(other)
    assert main(["run", str(scene), "--out", str(out)]) == 2
    assert "a link, where a folder" in said(capfd)
    for write in (old.to_vtk, lambda path: output.write_run(old, path.parent)):
        with pytest.raises(InputError, match="a link, where a folder"):
            write(out / "membrane.pvd")
    assert [(p.name, p.read_text(encoding="utf-8")) for p in other.iterdir()] == [("membrane_0007.vtu", "mine")]


@pytest.mark.parametrize("kind", ["link", "dangling link", "pipe", "device", "folder"])
def test_nothing_but_a_regular_file_is_replaced(kind, scene, done, tmp_path, capfd, monkeypatch, old):
    precious, out = tmp_path / "precious.txt", tmp_path / "o"
    precious.write_text("precious", encoding="utf-8")
    out.mkdir()

    def put(path):
        made = {
            "link": lambda: path.symlink_to(precious),
            "dangling link": lambda: path.symlink_to(tmp_path / "nothing"),
            "pipe": lambda: os.mkfifo(path),
            "device": lambda: os.mknod(path, 0o600 | stat.S_IFCHR, os.makedev(1, 3)),
            "folder": path.mkdir,
        }
        try:
            made[kind]()
        except PermissionError:
            pytest.skip("devices are made by root alone")
        return path

    def kept(path, facts):
        after = path.lstat()
        return (after.st_mode, after.st_ino) == (facts.st_mode, facts.st_ino) and precious.read_text(encoding="utf-8") == "precious"

    for command in (
        ["report", str(done), "--out", "x.html"],
        ["export", str(done), "--to", "csv", "--out", "x.csv"],
        ["export", str(done), "--to", "xdmf", "--out", "x.xdmf"],
        ["export", str(done), "--to", "stl", "--out", "x.stl"],
    ):
        path = put(tmp_path / command[-1])
        facts = path.lstat()
        assert main([*command[:-1], str(path)]) == 2
        assert "which no file replaces" in said(capfd)
        assert kept(path, facts)
    for write in (old.save, old.plot, old.scene.to_toml):
        path = put(tmp_path / f"{write.__name__}.png")
        facts = path.lstat()
        with pytest.raises(InputError, match="which no file replaces"):
            write(path)
        assert kept(path, facts)
    monkeypatch.setattr("femmembrane.verbs.run", None)  # a run is refused before anything is computed
    path = put(out / "branch.csv")
    facts = path.lstat()
    assert main(["run", str(scene), "--out", str(out)]) == 2
    assert "branch.csv in it is a" in said(capfd)
    assert kept(path, facts)


def test_a_folder_in_the_place_of_a_result_is_refused_before_anything_is_computed(scene, tmp_path, capfd, monkeypatch):
    (tmp_path / "o" / "branch.nc").mkdir(parents=True)
    monkeypatch.setattr("femmembrane.verbs.run", None)
    assert main(["run", str(scene), "--out", str(tmp_path / "o")]) == 2
    assert "branch.nc in it is a folder" in said(capfd)


def test_pipes_are_no_input(tmp_path, capfd):
    pipe, out = tmp_path / "pipe.nc", tmp_path / "o"
    os.mkfifo(pipe)
    out.mkdir()
    os.mkfifo(out / "branch.nc")
    os.mkfifo(out / "checkpoint.nc")
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    for words in (
        ["run", str(pipe), "--out", str(tmp_path / "new")],
        ["run", str(tmp_path / "scene.toml"), "--resume", "--out", str(out)],
        ["report", str(out)],
        ["export", str(pipe), "--to", "csv"],
    ):
        assert main(words) == 2
        said(capfd)
    with pytest.raises(InputError, match="a pipe"):
        fm.load(pipe)
    with pytest.raises(InputError, match="a pipe"):
        fm.Sweep.load(pipe)
    assert not (tmp_path / "new").exists()


def test_nothing_outside_of_a_file_is_read(tmp_path):
    """Files without a seal, as anybody may write them: a variable that is a link, one whose values are elsewhere, one that is too large."""
    import h5py

    secret = tmp_path / "secret.bin"
    secret.write_bytes(np.ones(3).tobytes())
    for name, spoil, why in (
        ("link", lambda file: file.__setitem__("pressure", h5py.ExternalLink("other.nc", "pressure")), "is a link"),
        ("soft", lambda file: file.__setitem__("pressure", h5py.SoftLink("/volume")), "is a link"),
        ("storage", lambda file: file.create_dataset("pressure", (3,), "f8", external=[(str(secret), 0, 24)]), "in another file"),
        ("large", lambda file: file.create_dataset("pressure", (10**12,), "f8", chunks=(10**6,)), "larger than it can hold"),
    ):
        path = tmp_path / f"{name}.nc"
        shutil.copy(OLD, path)
        with h5py.File(path, "r+") as file:
            del file["pressure"]
            spoil(file)
        with pytest.raises(ValueError, match=why):
            netcdf.parsed(path.read_bytes())


# --- damage


def test_a_sealed_file_opens_as_any_other(tmp_path, old):
    """The digest stands behind what HDF5 reads."""
    import xarray

    old.save(tmp_path / "branch.nc")
    content = (tmp_path / "branch.nc").read_bytes()
    assert content.splitlines()[-1].startswith(files.SEAL.encode())
    with xarray.open_dataset(tmp_path / "branch.nc", engine="h5netcdf") as dataset:
        assert dataset.sizes["step"] == 3


def refused(path, read, contents):
    for content in contents:
        path.write_bytes(content)
        with pytest.raises(InputError):
            read(path)


@pytest.mark.parametrize("count", [300, pytest.param(5000, marks=pytest.mark.slow)])
def test_no_damaged_branch_is_read(count, tmp_path, done):
    refused(tmp_path / "branch.nc", fm.load, damaged((done / "branch.nc").read_bytes(), 1, count))


@pytest.mark.parametrize("content", [b"", b"text", None])
def test_a_run_whose_branch_is_damaged_is_not_said_to_be_done(content, tmp_path, done, capfd):
    out = tmp_path / "o"
    shutil.copytree(done, out)
    branch = out / "branch.nc"
    branch.write_bytes(branch.read_bytes()[:-1000] if content is None else content)
    assert main(["run", str(done.parent / "scene.toml"), "--resume", "--out", str(out)]) == 2
    assert "a NetCDF file written by femmembrane is needed" in said(capfd)


def test_what_was_changed_on_purpose_is_refused_as_well(tmp_path, done):
    """A variable taken out, a number changed: by a program that leaves a file in good order."""
    import h5py

    for k, change in enumerate((lambda file: file.__delitem__("elastic_energy"), lambda file: file["pressure"].__setitem__(0, 2.0))):
        path = tmp_path / f"{k}.nc"
        shutil.copy(done / "branch.nc", path)
        with h5py.File(path, "r+") as file:
            change(file)
        with pytest.raises(InputError, match="damaged or changed"):
            fm.load(path)


@pytest.mark.parametrize("count", [4, pytest.param(400, marks=pytest.mark.slow)])
def test_damaged_files_of_earlier_versions_are_read_or_refused(count, tmp_path, monkeypatch):
    """Nothing vouches for their numbers, but nothing else than an InputError comes of them, and none takes for ever."""
    monkeypatch.setattr(netcdf, "_PATIENCE", 20.0)
    path = tmp_path / "branch.nc"
    for content in damaged(OLD.read_bytes(), 2, count):
        path.write_bytes(content)
        try:
            branch = fm.load(path)
        except InputError:
            continue
        assert all(np.isfinite(eq.state).all() for eq in branch)


def test_an_old_file_without_a_variable_is_refused(tmp_path):
    import h5py

    path = tmp_path / "branch.nc"
    shutil.copy(OLD, path)
    with h5py.File(path, "r+") as file:
        del file["magnetic_energy"]  # which would read as 0
    with pytest.raises(InputError, match="complete file"):
        fm.load(path)


@pytest.mark.parametrize("count", [40, pytest.param(3000, marks=pytest.mark.slow)])
def test_a_damaged_checkpoint_is_refused(count, scene, tmp_path, unfinished, capfd):
    out = tmp_path / "o"
    out.mkdir()
    for content in damaged(unfinished, 3, count):
        (out / "checkpoint.nc").write_bytes(content)
        assert main(["run", str(scene), "--out", str(out), "--resume"]) == 2
        assert "without --resume the run starts over" in said(capfd)
    (out / "checkpoint.nc").write_bytes(unfinished)
    assert main(["run", str(scene), "--out", str(out), "--resume"]) == 0


@pytest.mark.parametrize("count", [60, pytest.param(1000, marks=pytest.mark.slow)])
def test_a_damaged_record_is_refused(count, scene, tmp_path, done, capfd):
    out = tmp_path / "o"
    shutil.copytree(done, out)
    whole = (done / "run.json").read_bytes()
    for content in damaged(whole, 4, count):
        if _same_json(content, whole):
            continue
        (out / "run.json").write_bytes(content)
        for words in (["run", str(scene), "--resume", "--out", str(out)], ["report", str(out)]):
            assert main(words) == 2, content
            assert "run.json" in said(capfd)


def _same_json(one, other):
    try:
        return json.loads(one.decode()) == json.loads(other.decode())
    except ValueError:
        return False


@pytest.mark.parametrize(
    "record",
    [
        [],
        {"status": "converged"},
        {"scene": 3, "status": "converged", "message": "", "equilibria": 3},
        {"scene": {}, "status": "gone", "message": "", "equilibria": 3},
        {"scene": {}, "status": "converged", "message": "", "equilibria": 3, "versions": []},
        {"scene": {}, "status": "converged", "message": "", "equilibria": 3, "timings": {"solve": "x"}},
    ],
)
def test_a_record_of_another_kind_is_refused(record, tmp_path, done, capfd):
    shutil.copytree(done, tmp_path / "o")
    (tmp_path / "o" / "run.json").write_text(json.dumps(record), encoding="utf-8")
    assert main(["report", str(tmp_path / "o")]) == 2
    assert "run.json of a run is needed" in said(capfd)


def test_a_broken_row_of_a_sweep_is_computed_again(scene, tmp_path):
    words = ["sweep", str(scene), "--out", str(tmp_path / "o"), *SWEEP]
    assert main(words) == 0
    before = fm.Sweep.load(tmp_path / "o" / "sweep.nc").to_xarray()
    with closing(sqlite3.connect(tmp_path / "o" / "scenes.sqlite")) as database:
        (key, row), *_ = database.execute("SELECT key, row FROM scene").fetchall()
    for broken in (row.replace("1", "2", 1), row[:-3], "", row.encode(), "{}", "[" * 10_000):
        with closing(sqlite3.connect(tmp_path / "o" / "scenes.sqlite")) as database, database:
            database.execute("UPDATE scene SET row = ? WHERE key = ?", (broken, key))
        with FinishedScenes(tmp_path / "o" / "scenes.sqlite") as kept:
            assert kept.get(key) is None
    assert main(words) == 0
    after = fm.Sweep.load(tmp_path / "o" / "sweep.nc").to_xarray()
    assert after.drop_vars("seconds").equals(before.drop_vars("seconds"))


@pytest.mark.parametrize("count", [25, pytest.param(1000, marks=pytest.mark.slow)])
def test_a_damaged_store_of_a_sweep_is_refused_or_mended(count, scene, tmp_path, capfd):
    words = ["sweep", str(scene), "--out", str(tmp_path / "o"), *SWEEP]
    assert main(words) == 0
    path = tmp_path / "o" / "scenes.sqlite"
    right, whole = fm.Sweep.load(tmp_path / "o" / "sweep.nc").to_xarray(), path.read_bytes()
    for content in damaged(whole, 5, count):
        for other in path.parent.glob("scenes.sqlite-*"):
            other.unlink()
        path.write_bytes(content)
        code = main(words)
        assert code in (0, 2)
        if code:
            said(capfd)
        else:
            found = fm.Sweep.load(tmp_path / "o" / "sweep.nc").to_xarray()
            assert found.drop_vars("seconds").equals(right.drop_vars("seconds"))


@pytest.mark.parametrize("count", [200, pytest.param(2000, marks=pytest.mark.slow)])
def test_damaged_scene_files_and_odd_options(count, tmp_path, capfd):
    """What still is a scene is one; all else is refused in a line, without a trace in the file system."""
    scene, text = tmp_path / "scene.toml", SCENE.replace("values", "solver = 'newton'\nvalues").encode()
    odd = [
        "--out",
        "",
        "\0",
        "--set",
        "mesh.elements=\x1b[31m",
        "--sets",
        "-1",
        "--resume=maybe",
        "\udcff",
        "--help=x",
        "a" * 5000,
        "--set",
    ]
    chance = random.Random(6)
    for content in damaged(text, 6, count):
        scene.write_bytes(content)
        options = chance.sample(odd, chance.randrange(3))
        if not options and _runs(scene):
            continue
        code = main(["run", str(scene), "--out", str(tmp_path / "o"), *options])
        assert code in (0, 2, 3)
        if code == 2:
            assert not (tmp_path / "o").exists(), options
            said(capfd)
        else:
            capfd.readouterr()
            shutil.rmtree(tmp_path / "o", ignore_errors=True)


def _runs(scene):
    try:
        fm.Scene.from_toml(scene)
    except InputError:
        return False
    return True


# --- manners


def test_bad_input_leaves_no_folder(scene, tmp_path, capfd):
    for words in (
        ["sweep", "--over", "mesh.elements=0,1", "--quantity", "run"],
        ["sweep", "--over", "mesh.elements=4,5", "--quantity", "tipping"],
        ["convergence", "--degrees", "99"],
        ["run", "--set", "run.values=[nan]"],
    ):
        assert main([words[0], str(scene), "--out", str(tmp_path / "a" / "b"), *words[1:]]) == 2
        said(capfd)
        assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]


@pytest.mark.parametrize("evil", ["\x1b]0;owned\x07", "\x9b31m", "\r", "\x7f"])
def test_no_escape_sequence_reaches_the_terminal(evil, tmp_path, capfd, monkeypatch):
    scene = tmp_path / "scene.toml"
    quoted = json.dumps(evil + "x", ensure_ascii=True)
    monkeypatch.chdir(tmp_path)
    for text in (f"{quoted} = 1\n", f"[mesh]\n{quoted} = 1\n", f"[material]\nmodel = {quoted}\n", f"title = {quoted}{SCENE}load = 3\n"):
        scene.write_text(text, encoding="utf-8")
        assert main(["run", str(scene), "--out", "o"]) == 2
        said(capfd)
    for words in (["run", evil, "--out", "o"], [evil], ["run", str(scene), f"--{evil}"], ["report", evil], ["new", f"no/{evil}"]):
        assert main(words) == 2
        said(capfd)
    with pytest.raises(InputError) as error:
        fm.Scene.from_dict({evil: 1})
    assert str(error.value).isprintable()


def test_what_a_killed_command_left_is_removed_by_the_next(tmp_path, done):
    """But not what a living one is writing, nor anything else."""
    shutil.copytree(done, tmp_path / "o")
    left, alive = tmp_path / "o" / ".femmembrane-0123456789abcdef.vtu", tmp_path / "o" / ".femmembrane-fedcba9876543210.vtu"
    mine = tmp_path / "o" / ".femmembrane-notes.txt"
    left.touch()
    mine.touch()
    with files.claimed(alive):
        assert main(["export", str(tmp_path / "o"), "--to", "vtu"]) == 0
        assert not left.exists()
        assert alive.exists()
    assert mine.exists()
    assert main(["report", str(tmp_path / "o")]) == 0
    assert not alive.exists()


@pytest.mark.parametrize("count", [2, pytest.param(60, marks=pytest.mark.slow)])
def test_killed_exports_leave_whole_files(count, tmp_path, done):
    out = tmp_path / "o"
    shutil.copytree(done, out)
    words = [sys.executable, "-m", "femmembrane", "export", str(out), "--to", "pvd"]
    places = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    chance = random.Random(7)
    for _ in range(count):
        process = subprocess.Popen(words, env=places)
        time.sleep(chance.uniform(0.3, 2.0))
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert main(["export", str(out), "--to", "pvd"]) == 0
    assert not list(out.rglob(".*"))


# --- checkpoints


def test_a_run_that_goes_on_elsewhere_says_so(scene, tmp_path, unfinished, capfd, monkeypatch):
    (tmp_path / "o").mkdir()
    (tmp_path / "o" / "checkpoint.nc").write_bytes(unfinished)
    here = origin.origin()
    monkeypatch.setattr(checkpoint, "origin", lambda: {**here, "processor": "another one"})
    assert main(["run", str(scene), "--resume", "--out", str(tmp_path / "o")]) == 0
    remark = said(capfd)
    assert f"begun with processor {here['processor']}"[:60] in remark
    assert "resumed with processor another one: points may differ by round-off" in remark
    assert "another one" in json.loads((tmp_path / "o" / "run.json").read_text(encoding="utf-8"))["notes"][0]
    assert "another one" in fm.load(tmp_path / "o" / "branch.nc").notes[0]


def test_analysis_is_no_saving(tmp_path, monkeypatch, old):
    """Twenty seconds of error estimates, a tenth of a second of writing: the next checkpoint is due after two seconds, not four hundred."""
    clock = [0.0]
    monkeypatch.setattr(checkpoint.time, "perf_counter", lambda: clock[0])
    analysed = []

    def read(step, equilibrium):
        analysed.append(equilibrium)
        clock[0] += 10.0

    def save(branch, path, facts):
        clock[0] += 0.1

    monkeypatch.setattr(checkpoint, "reader", lambda scene, name: read)
    monkeypatch.setattr(checkpoint, "columns", lambda branch: ["error_pressure"])
    monkeypatch.setattr(checkpoint, "save", save)
    checkpoints = checkpoint.Checkpoints(tmp_path)
    checkpoints(old[:2])
    assert checkpoints._due == pytest.approx(20.1 + 2.0)
    checkpoints(old[:3])
    assert analysed == list(old)  # each once


def test_a_checkpoint_is_taken_without_a_copy(old):
    """It keeps to the equilibria there were, while the list goes on growing."""
    from femmembrane.results.branch import SoFar

    first, second, third = old
    growing = [first, second]
    taken = SoFar(growing)
    growing.append(third)
    assert list(taken) == [first, second]
    assert (taken[-1], taken[:], taken[5:]) == (second, (first, second), ())
    with pytest.raises(IndexError):
        taken[2]


# --- warnings of NumPy, which are errors here


def test_points_without_strains_are_no_matter_for_a_warning(tmp_path):
    """On the axis lambda_2 = 0, so that e_2 = -inf; beyond it there is none. Where a dipole is, its intensity is no number."""
    from femmembrane.physics.kinematics import hencky_strains

    e1, e2 = hencky_strains(np.ones(3), 1.0, 0.0, np.array([0.0, -1.0, -2.0]), np.array([0.0, -1.0, 0.0]), 0.0)
    assert e1.tolist() == [0.0, -np.inf, 0.0]
    assert e2[:2].tolist() == [0.0, -np.inf]
    assert np.isnan(e2[2])
    assert not np.isfinite(fm.Dipole(strength=1.0, height=2.0).intensity(np.zeros(1), np.full(1, 2.0))).any()
    for text in ("", "\n\n", "rho,z,h_rho,h_z\n"):
        (tmp_path / "field.csv").write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match="no points"):
            fm.Tabulated.from_csv(tmp_path / "field.csv")
