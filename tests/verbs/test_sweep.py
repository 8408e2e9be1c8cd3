"""Sweeps: rows against single computations, the same rows in any process, resumption, failures, maps and the command."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from multiprocessing import active_children
from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.cli import main
from femmembrane.errors import InputError
from femmembrane.results.finished_scenes import FinishedScenes
from femmembrane.scene.keys import set_all, set_key, values_of
from femmembrane.verbs import parallel
from femmembrane.verbs.sweep import KEPT
from femmembrane.verbs.sweep_rows import COMPUTED, UNEXPECTED, Options, Row, compute
from tests.cases import disc_scene

STRENGTH, HEIGHT = "source.0.strength", "source.0.height"
TRACE = fm.Run(control="arc-length", start=3.0, until={"center_height": 0.3})
#: from V = 3 down, below a dipole; the last scene has no state at the start
OVER = {STRENGTH: [100, 300], HEIGHT: [-3.5, -3.0]}


def below(elements=8, **changes):
    return disc_scene(dipole=(200.0, -3.5), elements=elements).replace(run=TRACE, title="Below", **changes)


@pytest.fixture(scope="module")
def serial():
    return fm.sweep(below(), OVER, direction=-1, workers=1)


def same(a, b):
    return a.to_xarray().drop_vars("seconds").identical(b.to_xarray().drop_vars("seconds"))


# --- keys


def test_one_key_is_set_and_the_rest_stays():
    tables = below().to_dict()
    before = below().to_dict()
    assert fm.Scene.from_dict(set_key(tables, STRENGTH, 300.0)).sources == (fm.Dipole(300.0, -3.5),)
    assert set_key(tables, "run.until.center_height", 1.0)["run"]["until"] == {"center_height": 1.0}
    assert fm.Scene.from_dict(set_key(tables, "effects.tension_field", True)).tension_field
    assert tables == before


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("source.0.strenght", "did you mean 'strength'"),
        ("mesh.elemnts", "did you mean 'elements'"),
        ("sorce.0.strength", "did you mean 'source'"),
        ("source.1.strength", "places 0 to 0"),
        ("source.strength", "source.0 is the first"),
        ("title.x", "no keys below it"),
        ("mesh..elements", "place of a value"),
    ],
)
def test_unknown_keys_are_refused_with_a_valid_name(key, said):
    with pytest.raises(InputError, match=said):
        fm.sweep(below(), {key: [1.0]}, workers=1)


def test_values_on_the_command_line():
    key, values = values_of("--over", "source.0.height=-6:-3:4")
    assert (key, values) == (HEIGHT, (-6.0, -5.0, -4.0, -3.0))
    assert values_of("--over", "mesh.elements=16,32") == ("mesh.elements", (16, 32))
    assert values_of("--over", "effects.tension_field=true,false")[1] == (True, False)
    assert values_of("--over", "run.at_limit=stop,jump")[1] == ("stop", "jump")
    for text in ("source.0.height", "=1", "a=1:2", "a=1:2:x", "a=1:1:3", "a=1:2:1", "a=nan:1:3"):
        with pytest.raises(InputError):
            values_of("--over", text)


def test_values_in_place_of_those_of_a_file():
    tables = below().to_dict()
    texts = ["mesh.elements = 7", "run.until={volume=10}", "title=a = b", "run.max_steps=9", f"{STRENGTH}=50", "material.mu=[1, 2"]
    found = set_all("--set", tables, texts)
    assert (found["mesh"]["elements"], found["title"], found["source"][0]["strength"]) == (7, "a = b", 50)
    assert found["run"]["until"] == {"volume": 10}
    assert found["material"]["mu"] == "[1, 2"  # which the scene refuses by its own name
    assert set_all("--set", tables, ["title=1\nmesh=2", "run.start=" + "1" * 5000])["title"] == "1\nmesh=2"
    assert tables == below().to_dict()
    for text, said in (
        ("mesh.elements", "KEY=VALUE"),
        ("mesh.elements=", "KEY=VALUE"),
        ("=1", "KEY=VALUE"),
        ("mesh.elements.x=1", "no keys below it"),
        ("source.1.height=1", "places 0 to 0"),
        ("load.0.weight=1", "there is no load"),
    ):
        with pytest.raises(InputError, match=said) as error:
            set_all("--set", tables, [text])
        assert error.value.key == "--set"
    with pytest.raises(InputError, match="each key once"):
        set_all("--set", tables, ["title=a", "title=b"])


@pytest.mark.parametrize(
    ("over", "options", "key"),
    [
        ({}, {}, "over"),
        ({STRENGTH: []}, {}, "over"),
        ({STRENGTH: [1.0, 1]}, {}, "over"),
        ({STRENGTH: [1.0, "a"]}, {}, "over"),
        ({STRENGTH: 5.0}, {}, "over"),
        ({HEIGHT: [-3.0, 0.0]}, {}, "source.height"),
        (OVER, {"quantity": "brunch"}, "quantity"),
        (OVER, {"quantity": "equilibria"}, "quantity"),
        (OVER, {"pressure": 1.0}, "pressure"),
        (OVER, {"direction": 2}, "direction"),
        (OVER, {"quantity": "run", "direction": -1}, "direction"),
        ({"run.control": ["arc-length", "volume"]}, {}, "run"),
        (OVER, {"workers": 0}, "workers"),
        (OVER, {"workers": 2, "scheduler": "tcp://127.0.0.1:1"}, "workers"),
        (OVER, {"scheduler": 5}, "scheduler"),
    ],
)
def test_what_cannot_be_swept_is_refused_before_anything_is_computed(over, options, key, monkeypatch):
    monkeypatch.setattr(parallel, "compute", None)
    with pytest.raises(InputError) as error:
        fm.sweep(below(), over, **({"workers": 1} | options if "scheduler" not in options else options))
    assert error.value.key.startswith(key)


# --- rows


def test_a_branch_is_that_of_a_trace(serial):
    data = serial.to_xarray()
    assert dict(data.sizes)[STRENGTH] == dict(data.sizes)[HEIGHT] == 2
    for strength in OVER[STRENGTH]:
        for height in OVER[HEIGHT]:
            cell = data.sel({STRENGTH: strength, HEIGHT: height})
            scene = disc_scene(dipole=(float(strength), height), elements=8)
            branch = fm.trace(scene, start=3.0, until={"center_height": 0.3}, direction=-1)
            folds = [p for p in branch.special_points if p.kind == "limit_point"]
            assert cell["limit_pressure"].values[: len(folds)].tolist() == [p.pressure for p in folds]
            assert cell["pressure"].values[: len(branch)].tolist() == branch.column("pressure").tolist()
            assert np.isnan(cell["pressure"].values[len(branch) :]).all()
            assert (int(cell["limit_points"]), int(cell["steps"])) == (len(folds), len(branch))
            assert (str(cell["status"].values), str(cell["message"].values)) == (branch.status, branch.message)


def test_equilibria_at_a_pressure_with_their_stability():
    scene = below().replace(run=None, analysis=fm.Analysis(azimuthal_modes=(1,)))
    row = fm.sweep(scene, {STRENGTH: [50.0]}, quantity="equilibria", pressure=1.8, workers=1).to_xarray().isel({STRENGTH: 0})
    found = fm.equilibria(disc_scene(dipole=(50.0, -3.5), elements=8), pressure=1.8)
    assert row["state_volume"].values.tolist() == [eq.volume for eq in found]
    stable = [bool(eq.verdict("pressure").stable and eq.verdict(azimuthal=1).stable) for eq in found]
    assert row["state_stable"].values.tolist() == stable
    assert (int(row["equilibria"]), int(row["stable_equilibria"])) == (len(found), sum(stable))


def test_the_first_tipping_is_that_of_a_whole_trace():
    run = fm.Run(control="arc-length", start=2.0, until={"center_height": 0.25})
    row = compute(disc_scene(dipole=(600.0, -3.5), elements=16).replace(run=run), "tipping", Options(direction=-1))
    scene = disc_scene(dipole=(600.0, -3.5), elements=16).replace(analysis=fm.Analysis(azimuthal_modes=(1,)))
    branch = fm.trace(scene, start=2.0, until={"center_height": 0.25}, direction=-1)
    onset = next(p for p in branch.special_points if p.kind == "azimuthal_onset")
    assert row.values["outcome"] == "onset"
    assert row.values["onset_center_height"] == pytest.approx(onset.center_height, rel=1e-12)
    assert row.values["onset_center_height"] == pytest.approx(0.312, abs=1e-3)  # demos/tipping.py locates it by another way
    assert row.values["upright_at_start"] == 1.0


def test_wrinkling_sets_in_where_the_smallest_stress_is_zero():
    run = fm.Run(control="arc-length", start=2.0, until={"center_height": 0.15})
    scene = disc_scene(dipole=(600.0, -3.5), elements=16).replace(run=run)
    row = compute(scene, "wrinkling", Options(direction=-1))
    assert (row.status, row.values["outcome"]) == ("converged", "onset")
    near = fm.equilibrium(scene.replace(run=None), center_height=row.values["onset_center_height"] + 0.01)
    smallest = []
    for shift in (1e-4, 0.0, -1e-4):
        eq = fm.equilibrium(scene.replace(run=None), center_height=row.values["onset_center_height"] + shift, start=near)
        smallest.append(min(eq.profile()[f"mechanical_stress_{k}"].min() for k in (1, 2)))
    assert smallest[0] > 0 > smallest[2]
    assert abs(smallest[1]) < 1e-2 * abs(smallest[2])


def test_a_run_has_no_special_points_and_wrinkles_on_request():
    run = fm.Run(control="volume", values=(1.0, 5.0))
    scene = below().replace(run=run, analysis=fm.Analysis(wrinkling="mechanical"))
    data = fm.sweep(scene, {"mesh.elements": [8, 16]}, quantity="run", workers=1).to_xarray()
    assert data["volume"].values == pytest.approx(np.array([[1.0, 5.0]] * 2), rel=1e-12)
    assert "limit_points" not in data
    assert data["largest_wrinkled_fraction"].values.tolist() == [0.0, 0.0]
    assert data["mesh.elements"].dtype.kind == "i"


# --- failures


def test_a_failing_scene_is_a_row_with_its_reason():
    found = fm.sweep(
        below().replace(run=fm.Run(control="arc-length", start=0.5, until={"volume": 2.0})), {STRENGTH: [100.0, 3000.0]}, workers=1
    )
    data = found.to_xarray()
    assert data["has_result"].values.tolist() == [True, False]
    assert found.failed == 1
    assert data["status"].values.tolist() == ["converged", "no equilibrium"]
    assert "sources could not be turned on" in str(data["message"].values[1])
    assert "1 no equilibrium" in str(found)


def test_an_unexpected_error_is_a_row_that_is_tried_again(tmp_path, monkeypatch):
    def fails(scene, options):
        if scene.sources[0].strength == 300:
            raise ZeroDivisionError("a fault of the code")
        return Row("converged", "", {"steps": 1})

    monkeypatch.setitem(COMPUTED, "branch", fails)
    found = fm.sweep(below(), {STRENGTH: [100, 300, 500]}, workers=1, out=tmp_path).to_xarray()
    assert found["status"].values.tolist() == ["converged", UNEXPECTED, "converged"]
    assert found["message"].values[1] == "ZeroDivisionError: a fault of the code"
    monkeypatch.setitem(COMPUTED, "branch", lambda scene, options: Row("converged", "", {"steps": 2}))
    again = fm.sweep(below(), {STRENGTH: [100, 300, 500]}, workers=1, out=tmp_path).to_xarray()
    assert again["steps"].values.tolist() == [1, 2, 1]


# --- kept scenes


def test_an_interrupted_sweep_goes_on(serial, tmp_path, monkeypatch):
    def stop(done, total, failed):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fm.sweep(below(), OVER, direction=-1, workers=1, out=tmp_path, on_scene=stop)
    seen = []
    resumed = fm.sweep(below(), OVER, direction=-1, workers=1, out=tmp_path, on_scene=lambda *counts: seen.append(counts[:2]))
    assert seen == [(2, 4), (3, 4), (4, 4)]
    assert same(resumed, serial)
    # all are kept, also for another grid with another title and another spelling of a number, and nothing at all is computed
    monkeypatch.setattr(parallel, "compute", None)
    part = fm.sweep(below().replace(title="other"), {STRENGTH: [300.0]}, direction=-1, out=tmp_path)
    assert float(part.to_xarray()["limit_pressure"][0, 0]) == float(serial.to_xarray()["limit_pressure"][1, 0, 0])


def test_what_a_row_depends_on_is_in_its_key(tmp_path, monkeypatch):
    calls = []
    monkeypatch.setitem(COMPUTED, "branch", lambda scene, options: calls.append(1) or Row("converged", "", {"steps": 1}))
    monkeypatch.setitem(COMPUTED, "tipping", COMPUTED["branch"])

    def again(scene, **options):
        calls.clear()
        fm.sweep(scene, {STRENGTH: [100]}, workers=1, out=tmp_path, **options)
        return len(calls)

    assert again(below()) == 1
    assert again(below()) == 0
    assert again(below(), direction=-1) == 1
    assert again(below(), quantity="tipping") == 1
    assert again(below(elements=9)) == 1
    monkeypatch.setattr(fm, "__version__", "0.0.0")
    assert again(below()) == 1


def test_a_folder_belongs_to_one_sweep_at_a_time(tmp_path):
    with FinishedScenes(tmp_path / "scenes.sqlite") as kept:
        kept.put("a", {"x": np.array([0.1, np.nan])})
        assert kept.get("a")["x"][0] == 0.1
        assert kept.get("b") is None
        with pytest.raises(InputError, match="one sweep at a time"):
            fm.sweep(below(), OVER, workers=1, out=tmp_path)
    (tmp_path / "scenes.sqlite").write_bytes(b"not a database, but long enough to be looked at" * 100)
    with pytest.raises(InputError, match="not a database"):
        fm.sweep(below(), OVER, workers=1, out=tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="folder"):
        FinishedScenes(tmp_path / "file" / "scenes.sqlite")


def test_no_more_scenes_are_under_way_than_there_is_room_for(monkeypatch):
    taken, finished = [], []
    monkeypatch.setattr(parallel, "compute", lambda scene, quantity, options: Row("converged", "", {}))

    def tasks():
        for k in range(50):
            taken.append(k)
            assert len(taken) - len(finished) <= 4
            yield str(k), None, "branch", Options()

    with ThreadPoolExecutor(2) as executor:
        for key, _ in parallel._drive(executor, tasks(), {}, lambda: 4):
            finished.append(key)
    assert sorted(finished, key=int) == [str(k) for k in range(50)]


def test_a_plan_counts_and_times(tmp_path):
    plan = fm.plan_sweep(below(), OVER, direction=-1, workers=2, out=tmp_path)
    assert (plan.scenes, plan.kept, plan.timed, plan.workers) == (4, 0, 4, 2)
    assert plan.seconds == pytest.approx(2 * plan.seconds_each)
    assert "4 scenes, 0 of them finished" in str(plan)
    assert not list(tmp_path.iterdir())  # a dry run makes nothing


# --- the same rows in any process


def wide():
    return {STRENGTH: np.linspace(60.0, 300.0, 6), HEIGHT: [-4.0, -3.5]}


@pytest.fixture(scope="module")
def plain():
    return fm.sweep(below(), wide(), direction=-1, workers=1)


def test_processes_one_of_which_is_killed(plain):
    killed = []

    def kill(done, total, failed):
        if done == 1:
            killed.extend(active_children()[:1])
            os.kill(killed[0].pid, signal.SIGKILL)

    found = fm.sweep(below(), wide(), direction=-1, workers=2, on_scene=kill)
    assert killed
    assert same(found, plain)


def test_processes_are_started_for_what_is_left(plain, monkeypatch):
    counts = []
    monkeypatch.setattr("femmembrane.verbs.sweep._ALONE", 0.0)
    monkeypatch.setattr(parallel, "cores", lambda: 2)
    monkeypatch.setattr(parallel, "on_cores", lambda tasks, workers: counts.append(workers) or parallel.here(tasks))
    assert same(fm.sweep(below(), wide(), direction=-1), plain)
    assert counts == [2]
    counts.clear()
    monkeypatch.setattr("femmembrane.verbs.sweep._ALONE", 1e9)
    fm.sweep(below(), {STRENGTH: [100.0]}, direction=-1)
    assert counts == []


def test_a_cluster_of_which_a_worker_is_killed(plain):
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": ":0", "silence_logs": 50}
    with distributed.LocalCluster(**options) as cluster:
        pids = [nanny.pid for nanny in cluster.workers.values()]
        seen = []

        def kill(done, total, failed):
            seen.append(done)
            if done == 1:
                os.kill(pids[0], signal.SIGKILL)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(fm, "__version__", "0.0.0")
            with pytest.raises(InputError, match="its workers have femmembrane"):
                fm.sweep(below(), wide(), direction=-1, scheduler=cluster.scheduler_address)
        found = fm.sweep(below(), wide(), direction=-1, scheduler=cluster.scheduler_address, on_scene=kill)
    assert seen == list(range(13))
    assert same(found, plain)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="looks for processes in /proc")
def test_a_sweep_that_is_killed_leaves_no_process_and_goes_on(tmp_path):
    below().to_toml(tmp_path / "scene.toml")
    ways = ["--over", f"{STRENGTH}=60:300:40", "--direction", "-1", "--workers", "2", "--out", str(tmp_path / "out")]
    started = subprocess.Popen([sys.executable, "-m", "femmembrane", "sweep", str(tmp_path / "scene.toml"), *ways])
    kept = tmp_path / "out" / f"{KEPT}-wal"
    until(lambda: kept.exists() and kept.stat().st_size > 40_000)
    processes = Path(f"/proc/{started.pid}/task/{started.pid}/children").read_text().split()
    assert len(processes) >= 2
    started.kill()
    started.wait()
    until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in processes))
    with FinishedScenes(tmp_path / "out" / KEPT):
        pass
    with closing(sqlite3.connect(tmp_path / "out" / KEPT)) as file:
        (count,) = file.execute("SELECT count(*) FROM scene").fetchone()
    assert count >= 1


def until(holds, seconds=60.0):
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_a_script_without_a_guard_is_told_so(tmp_path):
    script = tmp_path / "script.py"
    lines = [
        "import femmembrane as fm",
        "run = fm.Run(control='volume', values=(1.0,))",
        "scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(elements=4), run=run)",
        "fm.sweep(scene, {'mesh.degree': [1, 2]}, quantity='run', workers=2)",
    ]
    script.write_text("\n".join(lines))
    ended = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=120, check=False)
    assert ended.returncode != 0
    assert "no process could be started; a script must call this below if __name__" in ended.stderr


def test_a_scheduler_that_is_not_there():
    pytest.importorskip("distributed")
    with pytest.raises(InputError, match="address of a running Dask scheduler"):
        fm.sweep(below(), OVER, scheduler="nonsense://x")


# --- files, pictures, command


def test_a_sweep_comes_back_from_its_file(serial, tmp_path):
    serial.save(tmp_path / "sweep.nc")
    loaded = fm.Sweep.load(tmp_path / "sweep.nc")
    assert loaded.to_xarray().identical(serial.to_xarray())
    assert (loaded.scene, loaded.quantity, str(loaded)) == (serial.scene, serial.quantity, str(serial))
    assert all("long_name" in variable.attrs for variable in serial.to_xarray().data_vars.values())
    fm.trace(below(), start=0.5, max_steps=2).save(tmp_path / "branch.nc")
    for name in ("branch.nc", "none.nc"):
        with pytest.raises(InputError, match="a sweep written by femmembrane"):
            fm.Sweep.load(tmp_path / name)


def test_a_map_names_its_axes_and_hatches_what_is_no_value(tmp_path):
    run = fm.Run(control="arc-length", start=0.5, until={"volume": 2.0})
    found = fm.sweep(below().replace(run=run), {STRENGTH: [100.0, 3000.0], HEIGHT: [-3.5, -4.0]}, workers=1)
    figure = found.plot(tmp_path / "map.png", show=["limit_points", "pressure.0"])
    panel = figure.axes[0]
    assert panel.get_xlabel() == "dipole strength M = μ₀D²/(R₀⁶μ)"
    assert panel.get_ylabel() == "height of the source h/R₀"
    hatched = [c for c in panel.collections if c.get_hatch()]
    statuses = set(found.to_xarray()["status"].values.ravel()) - {"converged"}
    assert statuses
    assert len(hatched) == len(statuses)
    (legend,) = figure.legends
    texts = {t.get_text() for t in legend.get_texts()}
    assert all(any(text.startswith(status) for text in texts) for status in statuses)
    assert (tmp_path / "map.png").stat().st_size > 10_000
    for show in (["limit_presure.0"], ["limit_pressure"], ["limit_pressure.1"], ["steps.0"], ["status"]):
        with pytest.raises(InputError):
            found.plot(show=show)


def test_one_key_is_a_curve_and_three_are_refused(tmp_path, serial):
    run = fm.Run(control="volume", values=(1.0, 2.0))
    scene = below().replace(run=run)
    curve = fm.sweep(scene, {"run.solver": ["ipopt", "newton"]}, quantity="run", workers=1)
    (axes,) = curve.plot(show=["pressure.1"]).axes
    assert axes.get_ylabel() == "step 2: pressure P = pR₀/(μT)"
    assert [t.get_text() for t in axes.get_xticklabels()] == ["ipopt", "newton"]
    three = fm.sweep(scene, {STRENGTH: [100], HEIGHT: [-4.0], "mesh.degree": [1, 2]}, quantity="run", workers=1)
    with pytest.raises(InputError, match="two keys"):
        three.plot()


def test_the_command(tmp_path, capfd):
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    below().to_toml(scene)
    words = [
        "sweep",
        str(scene),
        "--over",
        f"{STRENGTH}=100:300:2",
        "--over",
        f"{HEIGHT}=-3.5,-3",
        "--direction",
        "-1",
        "--workers",
        "1",
        "--out",
        str(out),
    ]
    assert main([*words, "--dry-run"]) == 0
    assert "4 scenes, 0 of them finished" in capfd.readouterr().out
    assert not out.exists()
    assert main(words) == 0
    said = capfd.readouterr()
    assert "written:" in said.out
    assert said.err == ""
    assert {p.name for p in out.iterdir()} == {"scenes.sqlite", "sweep.nc", "sweep.png"}
    assert fm.Sweep.load(out / "sweep.nc").to_xarray()["limit_points"].shape == (2, 2)
    assert main([*words, "--dry-run"]) == 0
    assert "nothing to compute" in capfd.readouterr().out
    assert main([*words, "--over", f"{HEIGHT}=-5"]) == 2
    assert "each key once" in capfd.readouterr().err
    with closing(sqlite3.connect(out / "scenes.sqlite")) as file:
        assert file.execute("SELECT count(*) FROM scene").fetchone() == (4,)


def test_a_sweep_without_one_result(tmp_path, capfd):
    scene = tmp_path / "scene.toml"
    below().replace(run=fm.Run(control="arc-length", start=0.5, until={"volume": 2.0})).to_toml(scene)
    code = main(
        [
            "sweep",
            str(scene),
            "--over",
            f"{STRENGTH}=3000,4000",
            "--over",
            f"{HEIGHT}=-2.5",
            "--workers",
            "1",
            "--out",
            str(tmp_path / "out"),
        ]
    )
    assert code == 3
    assert "no scene has a result" in capfd.readouterr().err
