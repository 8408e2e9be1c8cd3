"""Error estimates beside true errors: against the reference tables (data/README.md), and where no estimate can be given."""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.results.error_estimate import ESTIMATED, from_numbers
from femmembrane.stability import verdict
from tests.cases import LIMIT_POINTS, OGDEN, POINTS, disc_scene

#: elements by degree, coarse enough that true errors stand far above the reference's own
MESHES = {1: 64, 2: 18, 3: 8}
ENERGIES = ("elastic_energy", "magnetic_energy", "energy")
EIGENVALUES = ("lambda_pressure", "lambda_volume")
AT_VOLUME = [p for p in POINTS if p.is_minimum("volume")]
AT_PRESSURE = [p for p in POINTS if p.is_minimum("pressure")]
BY_NAME = {p.name: p for p in (*POINTS, *LIMIT_POINTS)}


#: what no table has: it is compared with finer meshes below
LOCAL = ("displacement", "stress_first", "stress_last")
#: energies that no case of the tables has
ELSEWHERE = ("load_energy", "electric_energy")


@cache
def solved(name: str, control: str, degree: int, elements: int) -> fm.Equilibrium:
    """A tabulated state at its tabulated load on a coarse mesh."""
    point = BY_NAME[name]
    scene = point.scene.replace(mesh=fm.disc(elements=elements), degree=degree)
    start = fm.equilibrium(scene, volume=0.999 * point.expected["volume"], solver="newton")
    return fm.equilibrium(scene, **{control: point.expected[control]}, start=start, solver="newton")


def expected(name: str, quantity: str) -> float:
    table = BY_NAME[name].expected
    return table["elastic_energy"] + table["magnetic_energy"] if quantity == "energy" else table[quantity]


def effectivities(name: str, control: str, degree: int, elements: int, floor: float) -> dict[str, float]:
    """Estimated over true error of every quantity whose true error is above a floor (relative).

    That of the total energy is left out where those of its parts cancel to a hundredth.
    """
    estimate = solved(name, control, degree, elements).error_estimate(control)
    assert estimate.reason == ""
    found: dict[str, float] = {}
    parts = sum(abs(getattr(estimate, q).value - expected(name, q)) for q in ENERGIES[:2])
    for quantity in ESTIMATED:
        if quantity in (control, "center_height", *LOCAL, *ELSEWHERE) or (
            quantity == "magnetic_energy" and not BY_NAME[name].scene.sources
        ):
            continue
        part = getattr(estimate, quantity)
        true = part.value - expected(name, quantity)
        if abs(true) > max(floor * abs(expected(name, quantity)), 0.01 * parts if quantity == "energy" else 0.0):
            found[quantity] = part.error / true
    return found


def names(points):
    return [p.name for p in points]


@pytest.mark.parametrize("degree", MESHES)
@pytest.mark.parametrize("name", names(AT_VOLUME))
def test_effectivity_at_a_volume(name, degree):
    """The reference is exact to 1e-11 in P and energies and 1e-10 in eigenvalues; one element of degree 3 errs by 1e-9 somewhere."""
    found = effectivities(name, "volume", degree, MESHES[degree], 1e-9)
    assert {"pressure", "elastic_energy", *EIGENVALUES} <= set(found)
    assert all(0.5 < value < 2 for value in found.values()), found


@pytest.mark.parametrize("degree", MESHES)
@pytest.mark.parametrize("name", names(AT_PRESSURE))
def test_effectivity_at_a_pressure(name, degree):
    found = effectivities(name, "pressure", degree, MESHES[degree], 1e-9)
    assert {"volume", "elastic_energy", *EIGENVALUES} <= set(found)
    assert all(0.5 < value < 2 for value in found.values()), found


@pytest.mark.parametrize("name", ["neo_hookean_disc-3", "ogden_disc-2", "dipole_above-4.5", "dipole_below-0.3", "dipole_below-2"])
def test_effectivity_at_the_highest_degree(name):
    """Two elements of degree 8 against four."""
    found = effectivities(name, "volume", 8, 2, 1e-9)
    assert {"pressure", "elastic_energy", *EIGENVALUES} <= set(found)
    assert all(0.5 < value < 2 for value in found.values()), found
    assert "halved elements of degree 8" in solved(name, "volume", 8, 2).error_estimate().method


@pytest.mark.parametrize("name", ["ogden_disc-2", "dipole_above-0.5", "dipole_below-4"])
def test_at_a_height_both_pressure_and_volume_err(name):
    height = BY_NAME[name].expected["center_height"]
    coarse = solved(name, "volume", 2, 18)
    eq = fm.equilibrium(coarse.scene, center_height=height, start=coarse)
    estimate = eq.error_estimate("height")
    assert estimate.center_height.error == 0
    for quantity in ("pressure", "volume", "elastic_energy"):
        part = getattr(estimate, quantity)
        assert part.error / (part.value - expected(name, quantity)) == pytest.approx(1, abs=0.1), quantity


def test_beyond_a_volume_fold():
    """Pole height 5 above the fold of the dipole above, unstable under volume control; 5.1e-5 in V with 64 elements (2026-11-22)."""
    point = BY_NAME["dipole_above-5"]
    scene = point.scene.replace(mesh=fm.disc(elements=32))
    eq = fm.equilibrium(scene, center_height=5.0, start=fm.equilibrium(scene, volume=75.0, solver="newton"))
    estimate = eq.error_estimate("height")
    assert estimate.reason == ""
    for quantity in ("pressure", "volume", "elastic_energy"):
        part = getattr(estimate, quantity)
        assert 0.5 < part.error / (part.value - expected(point.name, quantity)) < 2, quantity


# --- what the record says


def test_record():
    eq = solved("dipole_above-1", "volume", 2, 18)
    estimate = eq.error_estimate()
    assert estimate is eq.error_estimate()
    assert estimate is not eq.error_estimate("pressure")
    assert (estimate.control, estimate.reason) == ("volume", "")
    assert estimate.method == "hierarchical: against the same load on elements of degree 3"
    assert estimate.volume == fm.Deviation(eq.volume, 0.0, abs(eq.volume))
    assert estimate.pressure.value == eq.pressure
    assert estimate.pressure.absolute == abs(estimate.pressure.error)
    assert estimate.pressure.relative == pytest.approx(abs(estimate.pressure.error / eq.pressure), rel=1e-15)
    assert estimate.energy.error == pytest.approx(estimate.elastic_energy.error + estimate.magnetic_energy.error, rel=1e-6)
    assert estimate.energy.scale == abs(eq.elastic_energy) + abs(eq.magnetic_energy)
    assert str(estimate).splitlines()[0] == "at the same volume; " + estimate.method
    assert len(str(estimate).splitlines()) == 2 + len(estimate.shown)
    with pytest.raises(dataclasses.FrozenInstanceError):
        estimate.control = "pressure"


def test_without_a_source_the_magnetic_error_is_none():
    part = solved("ogden_disc-2", "volume", 2, 18).error_estimate().magnetic_energy
    assert (part.error, part.relative) == (0.0, 0.0)


def test_flat_unloaded_disc():
    """Exact on every mesh, and without stiffness."""
    estimate = fm.equilibrium(disc_scene(OGDEN, elements=4), pressure=0.0).error_estimate()
    assert all(getattr(estimate, quantity).relative == 0 for quantity in ESTIMATED)


@pytest.mark.parametrize("control", ["gas", "presure", 3, None])
def test_unknown_control(control):
    with pytest.raises(fm.InputError, match="control"):
        solved("ogden_disc-2", "volume", 2, 18).error_estimate(control)


# --- next to folds


@pytest.fixture(scope="module")
def limit_point():
    branch = fm.trace(disc_scene(OGDEN, elements=8), start=1.0, until={"volume": 5.0})
    (point,) = (p for p in branch.special_points if p.kind == "limit_point")
    return point.equilibrium


@pytest.mark.parametrize("offset", [-1.0, -0.1, -0.02, 0.02, 0.1, 1.0])
def test_near_a_limit_point(limit_point, offset):
    """V at a pressure errs by a large part of the distance to the limit point, and is estimated all the same."""
    eq = fm.equilibrium(limit_point.scene, volume=limit_point.volume + offset, start=limit_point, solver="newton")
    fine = fm.equilibrium(disc_scene(OGDEN, elements=12, degree=6), volume=eq.volume, solver="newton")
    exact = fm.equilibrium(fine.scene, pressure=eq.pressure, start=fine, solver="newton")
    assert (exact.volume - limit_point.volume) * offset > 0
    estimate = eq.error_estimate("pressure")
    assert estimate.reason == ""
    assert estimate.volume.error / (eq.volume - exact.volume) == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("offset", [-1e-3, 1e-3])
def test_a_state_beyond_a_fold_is_not_compared(offset):
    """V errs by 0.433 left of the least pressure and by -0.446 right of it: Newton finds the left one from both sides."""
    scene = disc_scene(OGDEN, elements=8)
    branch = fm.trace(scene, start=21.0, until={"volume": 24.0})
    (point,) = (p.equilibrium for p in branch.special_points if p.kind == "limit_point")
    eq = fm.equilibrium(scene, volume=point.volume + offset, start=point, solver="newton")
    fine = fm.equilibrium(disc_scene(OGDEN, elements=12, degree=6), volume=22.172742 + np.sign(offset) * 0.4, solver="newton")
    exact = fm.equilibrium(fine.scene, pressure=eq.pressure, start=fine, solver="newton")
    assert eq.volume - exact.volume == pytest.approx({-1e-3: 0.4326, 1e-3: -0.4458}[offset], abs=1e-3)
    estimate = eq.error_estimate("pressure")
    if estimate.reason:  # none is better than one of the other side
        assert np.isnan(estimate.volume.error)
    else:
        assert estimate.volume.error / (eq.volume - exact.volume) == pytest.approx(1, abs=0.1)


def test_at_a_limit_point_there_is_no_volume_to_compare(limit_point):
    """Its pressure lies above the limit point of the continuum (1.899084863, data/disc.json): no equilibrium has it."""
    assert limit_point.pressure > 1.899084863
    estimate = limit_point.error_estimate("pressure")
    assert "no equilibrium near at this pressure" in estimate.reason
    assert np.isnan([getattr(estimate, q).error for q in ESTIMATED]).all()
    assert np.isnan(estimate.volume.relative)
    at_volume = limit_point.error_estimate("volume")
    assert at_volume.pressure.error == pytest.approx(limit_point.pressure - 1.899084863, rel=0.05)


def test_at_a_volume_fold_pressure_is_regular():
    scene = disc_scene(OGDEN, (200.0, 6.5), elements=16)
    branch = fm.trace(scene, start=75.0, until={"center_height": 5.0})
    (fold,) = (p.equilibrium for p in branch.special_points if p.kind == "volume_fold")
    at_volume = fold.error_estimate("volume")  # on which side of the finer space's fold it lies is a matter of round-off
    assert bool(at_volume.reason) == np.isnan(at_volume.pressure.error)
    assert fold.error_estimate("pressure").reason == ""
    assert fold.error_estimate("height").reason == ""


# --- wrinkles, slack and compression


@cache
def wrinkled(strength: float, height: float, pole: float, elements: int, degree: int) -> fm.Equilibrium:
    """Partly wrinkled states of the paper's scenes, as a tension field."""
    scene = disc_scene(OGDEN, (strength, height), elements, degree).replace(tension_field=True)
    return fm.equilibrium(scene, center_height=pole)


@pytest.mark.parametrize(("degree", "elements"), [(1, 16), (2, 16), (4, 15), (8, 5)])
@pytest.mark.parametrize("scene", [(400, -3.25, -0.1), (400, -3.75, -0.3)])
def test_wrinkled_tension_field(scene, degree, elements):
    """Borders of zones inside elements: rough, but not blind. The true errors are those against 1000 quadratic elements."""
    fine, eq = wrinkled(*scene, 1000, 2), wrinkled(*scene, elements, degree)
    estimate = eq.error_estimate("height")
    assert "quartered elements" in estimate.method
    assert "rough" in estimate.method
    for quantity in ("pressure", "volume"):
        part = getattr(estimate, quantity)
        assert 0.5 < part.error / (part.value - getattr(fine, quantity)) < 2, quantity


def test_taut_tension_field_is_estimated_like_the_plain_membrane():
    eq = solved("dipole_above-1", "volume", 2, 18)
    relaxed = fm.equilibrium(eq.scene.replace(tension_field=True), volume=eq.volume, solver="newton").error_estimate()
    assert relaxed.method == eq.error_estimate().method
    assert relaxed.pressure.error == pytest.approx(eq.error_estimate().pressure.error, rel=1e-6)


@pytest.mark.parametrize(("tension_field", "word"), [(False, "compressive"), (True, "slack")])
def test_where_states_depend_on_the_mesh_there_is_no_estimate(tension_field, word):
    """M = 600, h = -3.25: compressed along the meridian at pole heights 0.24 to 0.32, slack at 0.337 as a tension field."""
    scene = disc_scene(OGDEN, (600, -3.25)).replace(tension_field=tension_field)
    branch = fm.trace(scene, start=2.0, until={"center_height": 0.2}, direction=-1)
    assert branch.status.ill_posed
    estimate = branch[-1].error_estimate()
    assert word in estimate.reason
    assert np.isnan([getattr(estimate, q).error for q in ESTIMATED]).all()
    assert estimate.pressure.value == branch[-1].pressure


def test_a_mesh_too_coarse_for_an_estimate():
    """One linear element is a cone, 38 high at V = 40: the membrane is a dome less than 4 high (data/disc.json)."""
    estimate = fm.equilibrium(disc_scene(OGDEN, elements=1, degree=1), volume=40.0, solver="newton").error_estimate()
    assert estimate.reason == "not estimated: the finer space has no equilibrium near at this volume"


def test_an_eigenvalue_that_cannot_be_proved_costs_its_own_error_only(monkeypatch):
    from femmembrane.accuracy import error_estimate as module
    from femmembrane.stability.spectrum import SpectrumError

    def fails(potential, evaluation, control, guess=None):
        if control == "volume":
            raise SpectrumError("no proof")
        return verdict.axisymmetric_verdict(potential, evaluation, control, guess)

    eq = fm.equilibrium(disc_scene(OGDEN, elements=8), volume=1.0)
    monkeypatch.setattr(module, "axisymmetric_verdict", fails)
    estimate = eq.error_estimate()
    assert "under volume control" in estimate.reason
    assert np.isnan(estimate.lambda_volume.error)
    assert np.isfinite([estimate.lambda_pressure.error, estimate.pressure.error]).all()


# --- tables and files


RUNS = {
    "volume": (fm.Run(control="volume", values=(1.0, 2.0)), ("pressure", "energy")),
    "pressure": (fm.Run(control="pressure", values=(1.0, 1.5)), ("volume", "energy")),
    "height": (fm.Run(control="height", values=(0.5, 1.0)), ("pressure", "volume", "energy")),
    "arc-length": (fm.Run(control="arc-length", start=1.0, until={"volume": 1.2}), ("pressure", "energy")),
}


def asked(control: str, **analysis: bool) -> fm.Scene:
    scene = disc_scene(OGDEN, (200.0, 6.5), elements=8)
    return scene.replace(run=RUNS[control][0], analysis=fm.Analysis(**analysis))


@pytest.mark.parametrize("control", RUNS)
def test_columns(control, tmp_path):
    branch = fm.run(asked(control, error_estimates=True))
    frame, free = branch.to_dataframe(), RUNS[control][1]
    columns = list(frame.columns)
    before = columns.index("residual")
    assert columns[before - len(free) : before] == [f"error_{name}" for name in free]
    held = control if control in ("pressure", "height") else "volume"
    for name in free:
        expected = [getattr(eq.error_estimate(held), name).relative for eq in branch]
        assert 1e-7 < min(expected) < max(expected) < 1e-3
        assert frame[f"error_{name}"].tolist() == expected == branch.column(f"error_{name}").tolist()


def errors_of(equilibrium):
    """The estimates that an equilibrium remembers."""
    return {key: answer for key, answer in equilibrium._answers.items() if key[0] == "errors"}


@pytest.mark.parametrize("control", RUNS)
def test_round_trip(control, tmp_path, monkeypatch):
    """To the last bit, words included, without solving again."""
    branch = fm.run(asked(control, error_estimates=True))
    branch.save(tmp_path / "branch.nc")
    written = [errors_of(eq) for eq in branch]
    monkeypatch.setattr("femmembrane.accuracy.error_estimate.estimate_errors", None)
    loaded = fm.load(tmp_path / "branch.nc")
    assert loaded.scene == branch.scene
    assert [errors_of(eq) for eq in loaded] == written
    for name in RUNS[control][1]:
        np.testing.assert_array_equal(loaded.column(f"error_{name}"), branch.column(f"error_{name}"))


def test_file_explains_itself(tmp_path):
    dataset = fm.run(asked("height", error_estimates=True)).to_xarray()
    assert dataset["error_pressure"].attrs["long_name"] == "estimated error of the pressure, relative"
    assert list(dataset["estimated"].values) == list(ESTIMATED)
    assert all(v.attrs["long_name"] != name for name, v in dataset.variables.items() if "err" in str(name) or name == "estimated")


def test_off_means_off(monkeypatch, tmp_path):
    """Nothing is solved again, and nothing of it is in any output."""
    monkeypatch.setattr("femmembrane.accuracy.error_estimate.estimate_errors", None)
    branch = fm.run(asked("volume"))
    branch.save(tmp_path / "branch.nc")
    assert not [name for name in branch.to_dataframe().columns if "error" in name]
    assert not [name for name in branch.to_xarray().variables if "error" in str(name) or name == "estimated"]
    assert all(not errors_of(eq) for eq in branch)
    assert "error_estimates" not in branch.scene.to_dict().get("analysis", {})
    with pytest.raises(fm.InputError, match="error_pressure"):
        branch.column("error_pressure")


def test_a_branch_without_equilibria_keeps_its_columns():
    branch = fm.run(asked("volume", error_estimates=True))[:0]
    assert "error_pressure" in branch.to_dataframe().columns
    assert branch.to_xarray()["error_estimate"].shape == (0, len(ESTIMATED))


@pytest.mark.parametrize(
    ("scene", "volume"),
    [
        (disc_scene(OGDEN, (200, 6.5), elements=12, degree=2), 20.0),
        (fm.Scene(material=fm.NeoHookean(), mesh=fm.cap(0.5, 10), degree=2), 1.5),
        (fm.Scene(material=OGDEN, mesh=fm.annulus(0.3, 10), degree=3), 1.0),
        (fm.Scene(material=OGDEN, mesh=fm.cylinder(3.0, 12, top="hub"), degree=2), 12.0),
        (fm.Scene(material=OGDEN, mesh=fm.disc(10), degree=2, thickness="1 - 0.4*R**2"), 2.0),
    ],
)
def test_profiles_and_stresses_at_the_ends(scene, volume):
    """Against elements of a sixteenth of the error: the norm of the error of the shape, and the stresses at pole and rim."""
    eq = fm.equilibrium(scene, volume=volume, solver="newton")
    estimate = eq.error_estimate()
    best = fm.equilibrium(scene.replace(mesh=scene.mesh.refined().refined(), degree=scene.degree + 2), volume=volume, solver="newton")
    s = np.linspace(*eq.potential.space.ends[[0, -1]], 400)[1:-1]
    mine, theirs = eq.profile(s), best.profile(s)
    off = np.hypot(mine["rho"] - theirs["rho"], mine["eta"] - theirs["eta"])
    rms = np.sqrt((off**2 * mine["r"]).sum() / mine["r"].sum())
    assert estimate.displacement.error == pytest.approx(rms, rel=0.3)
    for k, name in ((0, "stress_first"), (-1, "stress_last")):
        true = eq.profile()["mechanical_stress_1"][k] - best.profile()["mechanical_stress_1"][k]
        assert 0.5 * abs(true) < abs(getattr(estimate, name).error) < 2 * abs(true)


def test_an_older_file_has_fewer_estimates():
    """What it lacks is not known, and nothing else is lost."""
    values = {name: 1.0 for name in ESTIMATED if name not in LOCAL}
    estimate = from_numbers("volume", values, dict.fromkeys(values, 1e-3), "compared", "")
    assert estimate.pressure.relative == 1e-3
    assert np.isnan([estimate.displacement.value, estimate.stress_last.error]).all()


def test_the_total_energy_is_compared_with_all_its_parts():
    loaded = fm.Scene(fm.NeoHookean(), fm.disc(8), degree=2, loads=[fm.Weight(0.4)], electric=fm.Electric(voltage=0.3))
    eq = fm.equilibrium(loaded, volume=1.0)
    estimate = eq.error_estimate()
    parts = [eq.elastic_energy, eq.load_energy, eq.electric_energy]
    assert estimate.energy.scale == pytest.approx(sum(abs(part) for part in parts))
    finer = fm.equilibrium(loaded.replace(mesh=fm.disc(32), degree=4), volume=1.0)
    for name in ("load_energy", "electric_energy", "energy"):
        assert getattr(estimate, name).error == pytest.approx(getattr(eq, name) - getattr(finer, name), rel=0.2)
    assert set(ELSEWHERE) <= set(estimate.shown)
    assert not set(ELSEWHERE) & set(fm.equilibrium(fm.Scene(fm.NeoHookean(), fm.disc(8)), volume=1.0).error_estimate().shown)


def test_a_height_that_nothing_moves_is_not_held():
    tube = fm.equilibrium(fm.Scene(fm.NeoHookean(), fm.cylinder(3.0, 8)), volume=11.0)
    with pytest.raises(fm.InputError, match="held along the axis"):
        tube.error_estimate("height")
