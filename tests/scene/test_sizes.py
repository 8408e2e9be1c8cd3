"""Numbers, counts and texts of any size: refused in words before anything is built, or answered rightly; never a traceback or a warning."""

from __future__ import annotations

import itertools
import os
import threading
from fractions import Fraction

import numpy as np
import pytest

import femmembrane as fm
from femmembrane import memory
from femmembrane.checks import LARGEST, number
from femmembrane.cli import main
from femmembrane.errors import FemmembraneError, InputError
from femmembrane.scene import MAX_STEPS, MAX_TEXT, MAX_WAVES, Scene, read_tables
from femmembrane.scene.keys import MAX_SCENES, set_key, values_of
from femmembrane.verbs.arguments import check_max_steps
from femmembrane.verbs.sweep import plan_sweep
from tests.cases import disc_scene

GIB = 2**30


def tables(**parts):
    return {
        "material": {"model": "mooney-rivlin", "ratio": 0.1},
        "mesh": {"shape": "disc", "elements": 4},
        "run": {"control": "volume", "values": [0.3], "solver": "newton"},
        **parts,
    }


MAGNETIC = {"membrane": {"susceptibility": 1.0}}
LOOP = tables(**MAGNETIC, source=[{"kind": "loop", "strength": 2.0, "height": 4.0, "radius": 0.5}])
DIPOLE = tables(**MAGNETIC, source=[{"kind": "dipole", "strength": 2.0, "height": 4.0}])
#: a scene and the places of numbers in it
PLACES = [
    (tables(), "material.ratio"),
    (tables(), "mesh.ratio"),
    (tables(), "run.values.0"),
    (tables(run={"control": "pressure", "start": 0.5, "stop": 1.0, "steps": 2, "solver": "newton"}), "run.stop"),
    (tables(run={"control": "arc-length", "start": 0.3, "until": {"volume": 0.6}, "max_steps": 30}), "run.until.volume"),
    (tables(material={"model": "yeoh", "c2": 0.1, "c3": 0.01}), "material.c2"),
    (tables(material={"model": "gent", "jm": 30.0}), "material.jm"),
    (tables(material={"model": "ogden", "mu": [1.0], "alpha": [2.0]}), "material.alpha.0"),
    (DIPOLE, "source.0.strength"),
    (DIPOLE, "source.0.height"),
    (DIPOLE, "membrane.susceptibility"),
    (LOOP, "source.0.radius"),
    (tables(load=[{"kind": "weight", "weight": 0.1}]), "load.0.weight"),
    (tables(mesh={"shape": "cap", "height": 0.5, "elements": 4}), "mesh.height"),
    (tables(mesh={"shape": "cylinder", "length": 2.0, "elements": 4}), "mesh.length"),
    (tables(mesh={"shape": "curve", "points": [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]]}), "mesh.points.1.0"),
    (tables(analysis={"azimuthal_modes": [1]}), "analysis.azimuthal_modes.0"),
    (tables(scales={"radius": 0.1, "thickness": 1e-3, "shear_modulus": 1e5}), "scales.radius"),
]
BIG = [10**25, 10**400, -(10**400), 10**5000, 1e308, -1e308, 1e200, float("inf"), float("nan")]
SMALL = [0, -0.0, 5e-324, -5e-324, 1e-308, 1e-100]
ODD = [True, np.bool_(True), np.float32(3), np.int64(3), np.float64("nan"), Fraction(1, 3), "1", None, [], {}, 1j, object()]


@pytest.mark.parametrize(("scene", "place"), PLACES, ids=[place for _, place in PLACES])
def test_any_number_is_answered_or_refused(scene, place, silent):
    for value in (*BIG, *SMALL, *ODD):
        try:
            made = Scene.from_dict(set_key(scene, place, value))
            assert Scene.from_dict(made.to_dict()) == made
            fm.run(made)
        except FemmembraneError as error:
            assert len(str(error)) < 400  # noqa: PT017  # whether there is one hangs on the value


@pytest.mark.parametrize("value", [-0.0, 1e-101, -5e-324, Fraction(0), np.float32(0)])
def test_what_is_zero_to_round_off_is_zero(value):
    assert str(number("key", value, "a number is allowed")) == "0.0"


def test_numbers_of_any_type_give_the_same_scene():
    for value in (2, np.int64(2), np.float32(2), Fraction(2)):
        made = Scene.from_dict(set_key(DIPOLE, "source.0.strength", value))
        assert made == Scene.from_dict(DIPOLE)
        assert type(made.sources[0].strength) is float


def test_a_limit_is_named():
    with pytest.raises(InputError, match=r"of a size up to 1e\+30"):
        fm.MooneyRivlin(2 * LARGEST)
    assert fm.MooneyRivlin(LARGEST).ratio == LARGEST


# --- memory and counts


@pytest.fixture
def six_gib(monkeypatch):
    monkeypatch.setattr(memory, "available", lambda: 6 * GIB)


def test_a_mesh_without_room_is_refused_with_what_there_is_room_for(six_gib):
    with pytest.raises(InputError, match=r"mesh.elements = 10000000: .* 6 GiB are there: up to 644245 elements of degree 2") as caught:
        fm.Scene(fm.NeoHookean(), mesh=fm.disc(10**7))
    assert caught.value.value == 10**7
    assert fm.Scene(fm.NeoHookean(), mesh=fm.disc(644_245)).mesh.elements == 644_245  # 6 GiB / (2 x 5000)


def test_steps_without_room_are_refused(six_gib):
    with pytest.raises(InputError, match=r"run.steps = 1000000: .* equilibria on this mesh are allowed"):
        disc_scene(elements=64).replace(run=fm.Run(start=0.1, stop=1.0, steps=10**6))


def test_bad_input_leaves_no_folder(six_gib, tmp_path, capfd):
    path = tmp_path / "scene.toml"
    disc_scene(elements=4).replace(run=fm.Run(values=(0.5,))).to_toml(path)
    assert main(["run", str(path), "--set", "mesh.elements=10000000", "--out", str(tmp_path / "out")]) == 2
    assert "are there" in capfd.readouterr().err
    assert not (tmp_path / "out").exists()


def test_limits_of_the_process_are_seen():
    resource = pytest.importorskip("resource")
    if memory.available() is None:
        pytest.skip("nobody knows here")
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (2**40, before[1]))
    try:
        ((_, left),) = memory._limits()
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)
    assert 0 < 2**40 - left < 2**38  # what the process has already


def test_limits_of_a_control_group_are_seen(tmp_path):
    inner = tmp_path / "outer" / "inner"
    inner.mkdir(parents=True)
    for folder, most in ((inner, "max"), (inner.parent, str(4 * GIB))):
        (folder / "memory.max").write_text(f"{most}\n")
        (folder / "memory.current").write_text(f"{GIB}\n")
        (folder / "memory.stat").write_text(f"anon 1\ninactive_file {GIB // 2}\n")
    assert list(memory._group(tmp_path, "/outer/inner", *memory._FILES[""])) == [3 * GIB + GIB // 2]


@pytest.mark.parametrize("steps", [10**12, 10**30, 10**400, MAX_STEPS + 1])
def test_too_many_steps_are_refused(steps):
    with pytest.raises(InputError, match="whole number from 1 to 1000000"):
        fm.Run(start=0.1, stop=1.0, steps=steps)
    with pytest.raises(InputError, match="whole number from 1 to 1000000"):
        fm.Run(control="arc-length", start=0.1, until={"volume": 1.0}, max_steps=steps)
    with pytest.raises(InputError, match="whole number from 1 to 1000000"):
        check_max_steps(steps)


def test_values_that_do_not_end_are_refused():
    with pytest.raises(InputError, match="up to 1000000 are allowed"):
        fm.Run(values=itertools.count(1.0))
    with pytest.raises(InputError, match="allowed"):
        fm.Scene(fm.NeoHookean(), sources=itertools.repeat(fm.Uniform(1.0)), susceptibility=1.0)


@pytest.mark.parametrize("count", [10**9, 10**12, MAX_SCENES + 1])
def test_a_sweep_of_too_many_values_is_refused(count):
    with pytest.raises(InputError, match=f"{count} values; a sweep of up to {MAX_SCENES} scenes"):
        values_of("--over", f"run.start=1:2:{count}")


def test_a_grid_of_too_many_scenes_is_refused():
    scene = Scene.from_dict(DIPOLE)
    grid = {"source.0.strength": np.linspace(1, 2, 1000), "source.0.height": np.linspace(3, 4, 1000)}
    with pytest.raises(InputError, match="1000 x 1000 values are 1000000 scenes; up to 100000"):
        plan_sweep(scene, grid, quantity="run")
    with pytest.raises(InputError, match="more than 100000 values"):
        plan_sweep(scene, {"source.0.height": itertools.count(3.0)}, quantity="run")


@pytest.mark.parametrize("workers", [0, 10**11, 10**400])
def test_too_many_processes_are_refused(workers):
    with pytest.raises(InputError, match="a whole number from 1 to"):
        plan_sweep(Scene.from_dict(DIPOLE), {"source.0.height": [3.0, 4.0]}, quantity="run", workers=workers)


def test_processes_without_room_are_refused(six_gib):
    with pytest.raises(InputError, match="up to 61 more processes"):
        plan_sweep(Scene.from_dict(DIPOLE), {"source.0.height": [3.0, 4.0]}, quantity="run", workers=500 if os.name != "nt" else 61)


def test_too_many_waves_are_refused():
    with pytest.raises(InputError, match=f"from 1 to {MAX_WAVES}"):
        fm.Analysis(azimuthal_modes=[10**200])
    eq = fm.equilibrium(disc_scene(elements=4), volume=1.0)
    with pytest.raises(InputError, match=f"from 0 to {MAX_WAVES}"):
        eq.verdict(azimuthal=10**200)
    assert eq.verdict(azimuthal=MAX_WAVES).stable  # under tension short waves cost most


# --- texts and tables


@pytest.mark.parametrize("title", ["a\0b", "a\x1b[2Jb", "\x07", "\x9b31m", "x" * (MAX_TEXT + 1)])
def test_a_title_that_cannot_be_kept_or_shown_is_refused(title):
    with pytest.raises(InputError, match="characters"):
        disc_scene(elements=4).replace(title=title)


def test_a_long_title_costs_nothing():
    with pytest.raises(InputError, match="up to 1000 characters is allowed; this one has 50000"):
        disc_scene(elements=4).replace(title="y " * 25_000)


@pytest.mark.parametrize("text", ["x = " + "[" * 1000 + "]" * 1000, "material" + ".a" * 1000 + " = 1", "[" + "a." * 1000 + "b]"])
def test_a_thousand_levels_are_refused(tmp_path, text):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        Scene.from_dict(read_tables(path))
    assert len(str(caught.value)) < 400


def test_a_key_of_a_thousand_levels_is_refused():
    with pytest.raises(InputError, match="the place of a value"):
        set_key(tables(), "a." * 1000 + "b", 1)


# --- threads and forks


def test_threads_that_build_at_once_find_the_same():
    alone = [fm.equilibrium(disc_scene(elements=5 + k, dipole=(1.0, 6.5)), volume=1.0).pressure for k in range(6)]
    found: dict[int, float] = {}

    def work(k):
        # another susceptibility, so that nothing is shared with what was built before
        scene = disc_scene(elements=5 + k, dipole=(1.0, 6.5)).replace(susceptibility=2.5 + 1e-9 * (k + 1))
        found[k] = fm.equilibrium(scene, volume=1.0).pressure

    threads = [threading.Thread(target=work, args=(k,)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [found[k] for k in range(6)] == pytest.approx(alone, rel=1e-7)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork.*:DeprecationWarning")
def test_a_process_forked_while_threads_compute_computes_too():
    import signal
    import time

    scene = disc_scene(elements=24)
    expected = fm.inflate(scene, volumes=[0.5, 1.0])[-1].pressure
    stop = threading.Event()

    def work():
        while not stop.is_set():
            fm.inflate(scene, volumes=[0.5, 1.0])

    threads = [threading.Thread(target=work) for _ in range(2)]
    for thread in threads:
        thread.start()
    ends = []
    try:
        for _ in range(4):
            child = os.fork()
            if not child:
                code = 1
                try:
                    code = int(fm.inflate(scene, volumes=[0.5, 1.0])[-1].pressure != expected)
                finally:
                    os._exit(code)
            for _ in range(600):
                ended, status = os.waitpid(child, os.WNOHANG)
                if ended:
                    break
                time.sleep(0.05)
            else:
                os.kill(child, signal.SIGKILL)
                _, status = os.waitpid(child, 0)
            ends.append(status)
    finally:
        stop.set()
        for thread in threads:
            thread.join()
    assert ends == [0] * 4
