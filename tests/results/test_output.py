"""Tables, NetCDF files and the folder of a run: what is written is what was computed, whole or not at all."""

from __future__ import annotations

import csv
import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from femmembrane import files
from femmembrane.discretization.meridian import disc
from femmembrane.errors import InputError, Status
from femmembrane.kernels import kernels
from femmembrane.physics.loads import Weight
from femmembrane.physics.magnetics import Dipole
from femmembrane.physics.materials import NeoHookean
from femmembrane.results import output, store, table
from femmembrane.results.branch import Branch
from femmembrane.results.special_point import SpecialPoint
from femmembrane.results.verdict import Verdict
from femmembrane.scene import Analysis, Scene
from femmembrane.verbs import inflate

VOLUMES = [1.0, 2.0, 4.0]
PLAIN = Scene(NeoHookean(), mesh=disc(8))
BOTH = Analysis(stability=("volume", "pressure"))  # in the other order: columns keep theirs


@pytest.fixture(scope="module")
def plain() -> Branch:
    return inflate(PLAIN, volumes=VOLUMES)


@pytest.fixture(scope="module")
def judged() -> Branch:
    """Verdicts asked for, a source, and special points as a search would leave them."""
    scene = PLAIN.replace(sources=[Dipole(strength=100, height=6.5)], susceptibility=2.5, analysis=BOTH, title="Über")
    branch = inflate(scene, volumes=VOLUMES)
    point = SpecialPoint("limit_point", branch[1].volume, branch[1].pressure, branch[1].center_height, 1e-9, branch[1])
    return dataclasses.replace(branch, special_points=(point,))


def read_csv(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def empty(branch: Branch) -> Branch:
    return dataclasses.replace(branch[:0], status=Status.NOT_CONVERGED, message="nothing was reached", special_points=None)


# --- tables


def test_only_asked_for_columns(plain: Branch) -> None:
    assert table.columns(plain) == ["step", "volume", "pressure", "center_height", "elastic_energy", "residual", "iterations", "seconds"]


def test_all_columns_in_order(judged: Branch) -> None:
    scene = judged.scene.replace(analysis=Analysis(("volume", "pressure"), (1, 3)))
    assert ",".join(table.columns(dataclasses.replace(judged, scene=scene))) == (
        "step,volume,pressure,center_height,elastic_energy,magnetic_energy,lambda_pressure,lambda_volume,verdict_pressure,"
        "verdict_volume,lambda_n1,lambda_n3,residual,iterations,seconds"
    )


def test_one_control_alone(judged: Branch) -> None:
    branch = dataclasses.replace(judged, scene=judged.scene.replace(analysis=Analysis(("volume",))))
    names = table.columns(branch)
    assert "lambda_volume" in names
    assert "verdict_volume" in names
    assert not any("pressure" in name for name in names if name != "pressure")


def test_csv_keeps_every_bit(judged: Branch, tmp_path: Path) -> None:
    table.write_csv(judged, tmp_path / "branch.csv")
    rows = read_csv(tmp_path / "branch.csv")
    assert list(rows[0]) == table.columns(judged)
    for step, (row, equilibrium) in enumerate(zip(rows, judged, strict=True)):
        assert int(row["step"]) == step
        assert int(row["iterations"]) == equilibrium.iterations
        for name in ("volume", "pressure", "center_height", "elastic_energy", "magnetic_energy", "residual", "seconds"):
            assert float(row[name]) == getattr(equilibrium, name)
        for control in ("pressure", "volume"):
            verdict = equilibrium.verdict(control)
            assert float(row[f"lambda_{control}"]) == verdict.smallest_eigenvalue
            assert row[f"verdict_{control}"] == {True: "stable", False: "unstable", None: "marginal"}[verdict.stable]


def test_verdicts_are_not_all_alike(judged: Branch) -> None:
    # neo-Hookean disc: limit point at V = 2.797 without source (reference/disc.json), a weak far dipole shifts it little
    assert [row[table.columns(judged).index("verdict_pressure")] for row in table.rows(judged)] == ["stable", "stable", "unstable"]


def test_dataframe(judged: Branch) -> None:
    pandas = pytest.importorskip("pandas")
    frame = table.to_dataframe(judged)
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame.columns) == table.columns(judged)
    assert frame["pressure"].tolist() == [e.pressure for e in judged]


def test_special_points_csv(judged: Branch, tmp_path: Path) -> None:
    path = tmp_path / "special_points.csv"
    table.write_special_points_csv(judged, path)
    (row,) = read_csv(path)
    assert list(row) == ["kind", "volume", "pressure", "center_height", "error"]
    assert row["kind"] == "limit_point"
    assert float(row["pressure"]) == judged[1].pressure
    assert float(row["error"]) == 1e-9


# --- NetCDF


def test_round_trip_to_the_last_bit(judged: Branch, tmp_path: Path) -> None:
    store.save(judged, tmp_path / "branch.nc")
    loaded = store.load(tmp_path / "branch.nc")
    assert loaded.scene == judged.scene
    assert (loaded.status, loaded.message, dict(loaded.timings)) == (judged.status, judged.message, dict(judged.timings))
    assert loaded.special_points is not None
    assert judged.special_points is not None
    pairs = [*zip(judged, loaded, strict=True), (judged.special_points[0].equilibrium, loaded.special_points[0].equilibrium)]
    for ours, theirs in pairs:
        assert ours.state.tobytes() == theirs.state.tobytes()
        assert not theirs.state.flags.writeable
        for name in (f.name for f in dataclasses.fields(ours) if f.name not in ("scene", "state", "_answers")):
            assert getattr(ours, name) == getattr(theirs, name), name
        assert all(np.array_equal(ours.profile()[key], theirs.profile()[key]) for key in ours.profile())
    for name in ("kind", "volume", "pressure", "center_height", "error"):
        assert getattr(loaded.special_points[0], name) == getattr(judged.special_points[0], name)


def test_verdicts_come_back(judged: Branch, tmp_path: Path) -> None:
    """To the last bit, modes included; an eigenvalue computed anew from another starting vector would differ in its last digits."""
    store.save(judged, tmp_path / "branch.nc")
    loaded = store.load(tmp_path / "branch.nc")
    assert list(table.rows(loaded)) == list(table.rows(judged))
    for ours, theirs in zip(judged, loaded, strict=True):
        for control in ("pressure", "volume"):
            a, b = ours.verdict(control), theirs.verdict(control)
            for name in ("stable", "smallest_eigenvalue", "error", "control", "azimuthal", "negative_directions", "reason"):
                assert getattr(a, name) == getattr(b, name), name
            assert a.mode is not None
            assert b.mode is not None
            assert a.mode.keys() == b.mode.keys()
            assert all(np.array_equal(a.mode[key], b.mode[key]) for key in a.mode)
            assert a.coefficients is not None
            assert b.coefficients is not None
            assert np.array_equal(a.coefficients, b.coefficients)


def test_verdict_without_a_mode(judged: Branch, tmp_path: Path) -> None:
    """Where the Legendre-Hadamard condition fails there is neither eigenvalue nor mode."""
    first = dataclasses.replace(judged[0], _answers={})
    nothing = {"smallest_eigenvalue": np.nan, "negative_directions": None, "coefficients": None, "_shape": None}
    short_wave = dataclasses.replace(judged[0].verdict("volume"), stable=False, reason="why", **nothing)
    first._answers["verdict", "volume", 0] = short_wave
    for others in ((), judged.equilibria[1:]):
        store.save(dataclasses.replace(judged, equilibria=(first, *others)), tmp_path / "branch.nc")
        back = store.load(tmp_path / "branch.nc")[0].verdict("volume")
        assert (back.stable, back.negative_directions, back.mode, back.coefficients, back.reason) == (False, None, None, None, "why")
        assert np.isnan(back.smallest_eigenvalue)


def test_azimuthal_verdicts_come_back(judged: Branch, tmp_path: Path) -> None:
    """Modes around the axis have one more component and coefficients of their own number."""
    scene = judged.scene.replace(analysis=Analysis(azimuthal_modes=(2,)))
    nodes, equilibria = judged[0].profile()["r"], []
    for k, equilibrium in enumerate(judged):
        shape = {"r": nodes, "u": nodes + k, "w": nodes, "c": -nodes}
        coefficients = np.arange(40.0) + k
        verdict = Verdict(k < 2, 1.5 - k, 1e-9, None, 2, int(k == 2), f"reason {k}", coefficients, lambda _, shape=shape: shape)
        equilibria.append(dataclasses.replace(equilibrium, scene=scene, _answers={("verdict", None, 2): verdict}))
    branch = dataclasses.replace(judged, scene=scene, equilibria=tuple(equilibria))
    store.save(branch, tmp_path / "branch.nc")
    loaded = store.load(tmp_path / "branch.nc")
    assert list(table.rows(loaded)) == list(table.rows(branch))
    for ours, theirs in zip(branch, loaded, strict=True):
        a, b = ours.verdict(azimuthal=2), theirs.verdict(azimuthal=2)
        assert (a.stable, a.reason, a.negative_directions, a.azimuthal) == (b.stable, b.reason, b.negative_directions, b.azimuthal)
        assert a.mode is not None
        assert b.mode is not None
        assert all(np.array_equal(a.mode[key], b.mode[key]) for key in a.mode | b.mode)
        assert np.array_equal(a.coefficients, b.coefficients)


@pytest.mark.parametrize("searched", [False, True])
def test_round_trip_of_little(plain: Branch, tmp_path: Path, searched: bool) -> None:
    """No sources, no verdicts, no special points found; and no equilibria at all."""
    for name, branch in (("plain", plain), ("empty", empty(plain))):
        branch = dataclasses.replace(branch, special_points=() if searched else None)
        store.save(branch, tmp_path / f"{name}.nc")
        loaded = store.load(tmp_path / f"{name}.nc")
        assert len(loaded) == len(branch)
        assert loaded.special_points == branch.special_points
        assert (loaded.status, loaded.message) == (branch.status, branch.message)
        assert [e.state.tobytes() for e in loaded] == [e.state.tobytes() for e in branch]
        assert all(e.magnetic_energy == 0 for e in loaded)


def test_file_explains_itself(judged: Branch, tmp_path: Path) -> None:
    """Any NetCDF reader finds dimensions, meanings and the scene, and xarray opens the file without a word."""
    xarray = pytest.importorskip("xarray")
    store.save(judged, tmp_path / "branch.nc")
    with xarray.open_dataset(tmp_path / "branch.nc", engine="h5netcdf") as dataset:
        assert dataset.sizes["step"] == 3
        assert dataset.sizes["node"] == judged[0].profile()["r"].size
        assert all({"long_name", "units"} <= set(variable.attrs) for variable in dataset.variables.values())
        assert dataset.attrs["format"] == 1
        assert dataset.attrs["title"] == "Über"
        assert "femmembrane_version" in dataset.attrs
        assert store.scene_from_text(dataset.attrs["scene"]) == judged.scene
        assert dataset["verdict_pressure"].values.tolist() == ["stable", "stable", "unstable"]
        np.testing.assert_array_equal(dataset["eta"].values, [e.profile()["eta"] for e in judged])


def test_only_asked_for_variables(plain: Branch) -> None:
    names = set(map(str, store.to_xarray(plain).variables))
    assert not any(name.startswith(("lambda_", "verdict_", "special_", "magnetic")) for name in names)


def test_loading_does_not_solve(judged: Branch, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from femmembrane.potential import potential

    store.save(judged, tmp_path / "branch.nc")

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("a potential was evaluated")

    monkeypatch.setattr(potential.Potential, "evaluate", refuse)
    assert len(store.load(tmp_path / "branch.nc")) == 3


def test_foreign_files(plain: Branch, tmp_path: Path) -> None:
    import xarray

    (tmp_path / "text.nc").write_text("not a NetCDF file")
    xarray.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    later = store.to_xarray(plain).assign_attrs(format=99)
    later.to_netcdf(tmp_path / "later.nc", engine="h5netcdf")
    store.to_xarray(plain).drop_vars("state").to_netcdf(tmp_path / "cut.nc", engine="h5netcdf")
    for name in ("missing.nc", "text.nc", "other.nc", "later.nc", "cut.nc"):
        with pytest.raises(InputError, match=r"femmembrane|format 1"):
            store.load(tmp_path / name)


# --- files


def test_a_failed_writer_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "result.txt"
    path.write_text("old")

    def write() -> None:
        with files.replace_file(path) as temporary:
            temporary.write_text("ne")
            raise RuntimeError("midway")

    with pytest.raises(RuntimeError, match="midway"):
        write()
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["result.txt"]


def test_replaced_in_one_step(tmp_path: Path) -> None:
    path = tmp_path / "result.txt"
    path.write_text("old")
    with files.replace_file(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
        assert temporary.parent == path.parent
        assert temporary.suffix == path.suffix
    assert path.read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == ["result.txt"]


def test_every_writer_is_atomic(judged: Branch, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disc fills up while a file takes its place: all files of the run before are still whole."""
    output.write_run(judged, tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("os.replace", fail)
        for writer, name in ((table.write_csv, "branch.csv"), (store.save, "branch.nc")):
            with pytest.raises(OSError, match="No space"):
                writer(judged, tmp_path / name)
        with pytest.raises(OSError, match="No space"):
            judged.plot(tmp_path / "pressure-volume.png")
        with pytest.raises(OSError, match="No space"):
            judged.to_vtk(tmp_path / "membrane.pvd")
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_missing_folder(plain: Branch, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="writable folder"):
        plain.save(tmp_path / "nowhere" / "branch.nc")


# --- the folder of a run


def test_run_folder(judged: Branch, tmp_path: Path) -> None:
    written = output.write_run(judged, tmp_path / "a" / "b", command=["femmembrane", "run"])
    names = ["branch.csv", "special_points.csv", "run.json", "branch.nc", "pressure-volume.png", "membrane.pvd"]
    assert [path.name for path in written] == names
    assert sorted(p.name for p in (tmp_path / "a" / "b").iterdir()) == sorted([*names, "membrane"])
    assert len(list((tmp_path / "a" / "b" / "membrane").iterdir())) == len(judged)
    facts = json.loads((tmp_path / "a" / "b" / "run.json").read_text(encoding="utf-8"))
    assert facts["compiled"] == (kernels().name == "compiled")
    assert Scene.from_dict(facts["scene"]) == judged.scene
    assert facts["equilibria"] == 3
    assert facts["status"] == "converged"
    assert facts["command"] == ["femmembrane", "run"]
    assert facts["versions"].keys() == {"femmembrane", "python", "numpy", "scipy", "scikit-fem", "casadi"}
    assert facts["versions"]["numpy"] == np.__version__
    assert facts["timings"] == dict(judged.timings)


def test_empty_branch(judged: Branch, tmp_path: Path) -> None:
    """Nothing of a longer run before it stays in the folder."""
    output.write_run(judged, tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    output.write_run(empty(judged), tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir() if p.is_file()) == ["branch.csv", "notes.txt", "run.json"]
    assert list((tmp_path / "membrane").iterdir()) == []
    assert (tmp_path / "branch.csv").read_text().splitlines() == [",".join(table.columns(judged))]
    assert json.loads((tmp_path / "run.json").read_text())["message"] == "nothing was reached"


def test_searched_without_find(plain: Branch, tmp_path: Path) -> None:
    output.write_run(dataclasses.replace(plain, special_points=()), tmp_path)
    assert (tmp_path / "special_points.csv").read_text() == "kind,volume,pressure,center_height,error\n"
    output.write_run(plain, tmp_path)
    assert not (tmp_path / "special_points.csv").exists()


def test_unwritable_folder(plain: Branch, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(InputError, match="--out") as error:
            output.write_run(plain, folder)
        assert error.value.key == "--out"


@pytest.mark.skipif(sys.platform != "linux", reason="/proc is a folder that nobody writes to")
def test_read_only_folder(plain: Branch) -> None:
    with pytest.raises(InputError, match="--out"):
        output.write_run(plain, "/proc")


def test_every_column_of_the_table_can_be_asked_for():
    scene = PLAIN.replace(loads=[Weight(0.01)], analysis=BOTH)
    branch = inflate(scene, volumes=[0.5, 1.0])
    names = table.columns(branch)
    assert "load_energy" in names
    for name, column in zip(names, zip(*table.rows(branch), strict=True), strict=True):
        assert branch.column(name).tolist() == list(column)
    assert branch.column("status").tolist() == [Status.CONVERGED.value] * 2


def test_surfaces_are_left_out_where_the_scene_says_so_and_packed_where_not(tmp_path):
    scene = Scene(material=NeoHookean(), mesh=disc(8))
    output.write_run(inflate(scene, volumes=[0.5, 1.0]), tmp_path)
    surfaces = sorted((tmp_path / "membrane").glob("*.vtu"))
    assert len(surfaces) == 2
    assert b"vtkZLibDataCompressor" in surfaces[0].read_bytes()[:400]

    bare = scene.replace(vtu=False)
    assert Scene.from_dict(bare.to_dict()) == bare
    assert "output" not in scene.to_dict()
    names = {path.name for path in output.write_run(inflate(bare, volumes=[0.5, 1.0]), tmp_path)}
    assert "branch.nc" in names
    assert "membrane.pvd" not in names
    assert not list(tmp_path.rglob("*.vtu"))  # those of the run before are gone as well
    assert not store.load(tmp_path).scene.vtu
    with pytest.raises(InputError, match=r"output\.vtu"):
        Scene.from_dict({**scene.to_dict(), "output": {"vtu": "no"}})
