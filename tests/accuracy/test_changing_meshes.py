"""Runs along which the mesh changes: where one mesh would be large, or would not keep the accuracy."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.accuracy import along

from ..cases import OGDEN, disc_scene

ACCURACY = 1e-6
#: above a strong dipole the pole is drawn down through sharp turns towards it, to a boundary layer at the pole
BELOW = disc_scene(OGDEN, (600.0, -3.5)).replace(mesh=fm.disc(accuracy=ACCURACY))
ASKED = {"start": 0.5, "direction": -1}
END = {"center_height": -2.6}


@cache
def changed() -> tuple[fm.Branch, list[fm.Branch]]:
    kept: list[fm.Branch] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(along, "_MOST_OF_ONE", 6)
        return fm.trace(BELOW, **ASKED, until=END, on_checkpoint=kept.append), kept


@cache
def fine() -> fm.Branch:
    """The same branch on one mesh that is fine everywhere, graded to the pole."""
    return fm.trace(BELOW.replace(mesh=fm.disc(64, ratio=60.0), degree=5), **ASKED, until=END)


def test_each_equilibrium_is_on_a_mesh_that_keeps_the_accuracy():
    branch, _ = changed()
    assert branch.status is fm.Status.CONVERGED
    assert branch.mesh_changes
    elements = branch.column("elements")
    assert elements[0] < 8 < 15 < elements[-1]
    assert elements.mean() < elements.max() / 2
    assert (branch.column("degree") <= 4).all()
    assert {eq.scene.mesh.accuracy for eq in branch} == {ACCURACY}
    least = 0.01 * np.abs(branch.pressure).max()  # below which errors are not relative
    for eq in branch[:: len(branch) // 12]:
        error = min(abs(eq.error_estimate(c).pressure.error) for c in ("volume", "center_height"))
        assert error < ACCURACY * max(abs(eq.pressure), least)
    assert f"changed {np.count_nonzero(np.diff(elements))} times along the branch for accuracy 1e-06" in str(branch)


def test_special_points_are_those_of_one_fine_mesh():
    branch, best = changed()[0], fine()
    assert [p.kind for p in branch.special_points] == [p.kind for p in best.special_points]
    assert len(best.special_points) >= 6
    for point, other in zip(branch.special_points, best.special_points, strict=True):
        assert point.pressure == pytest.approx(other.pressure, rel=ACCURACY)
    assert branch[-1].center_height == pytest.approx(-2.6, rel=1e-12)


def test_a_trace_goes_on_to_the_bit_where_it_was_interrupted(tmp_path: Path):
    branch, kept = changed()
    places = np.flatnonzero(np.diff(branch.column("elements"))) + 1  # the first records on another mesh
    parts = [next(b for b in kept if len(b) == at) for at in (int(places[-2]), int(places[-1]) + 1)]
    parts[1].save(tmp_path / "part.nc")
    for part in (parts[0], fm.load(tmp_path / "part.nc")):
        again = fm.trace(BELOW, start=part, until=END)
        assert np.array_equal(again.pressure, branch.pressure)
        assert [eq.scene for eq in again] == [eq.scene for eq in branch]
        assert [p.pressure for p in again.special_points] == [p.pressure for p in branch.special_points]


def test_files_keep_every_mesh(tmp_path: Path):
    branch, _ = changed()
    branch.save(tmp_path / "branch.nc")
    again = fm.load(tmp_path / "branch.nc")
    for eq, loaded in zip(branch, again, strict=True):
        assert loaded.scene == eq.scene
        assert np.array_equal(loaded.state, eq.state)
    for point, loaded in zip(branch.special_points, again.special_points, strict=True):
        assert loaded.equilibrium.scene == point.equilibrium.scene
        assert np.array_equal(loaded.equilibrium.state, point.equilibrium.state)
    assert np.array_equal(again.column("elements"), branch.column("elements"))
    radii = again.to_xarray()["r"].values
    assert np.array_equal(radii[0][~np.isnan(radii[0])], branch[0].profile()["r"])


def test_modes_of_verdicts_are_kept(tmp_path: Path, monkeypatch):
    monkeypatch.setattr(along, "_MOST_OF_ONE", 3)
    branch = fm.trace(BELOW.replace(analysis=fm.Analysis(("pressure",), azimuthal_modes=(1,))), **ASKED, until={"center_height": 0.1})
    places = np.flatnonzero(np.diff(branch.column("elements")))
    assert places.size
    branch.save(tmp_path / "branch.nc")
    for eq, loaded in zip(branch, fm.load(tmp_path / "branch.nc"), strict=True):
        for asked in ({"control": "pressure"}, {"azimuthal": 1}):
            one, other = eq.verdict(**asked), loaded.verdict(**asked)
            assert np.array_equal(one.smallest_eigenvalue, other.smallest_eigenvalue, equal_nan=True)
            assert all(np.array_equal(values, other.mode[key]) for key, values in (one.mode or {}).items())


def test_the_curve_and_what_lies_between(tmp_path: Path):
    branch = changed()[0]
    assert len(branch.curve.runs) == 1
    first = int(np.flatnonzero(np.diff(branch.column("elements")))[1])
    a, b = branch[first], branch[first + 1]
    assert a.scene.mesh != b.scene.mesh
    height = (a.center_height + b.center_height) / 2
    between = branch.at(center_height=height, refine=True)
    assert between.scene == b.scene
    direct = fm.trace(BELOW.replace(mesh=fm.disc(64, ratio=60.0), degree=5), **ASKED, until={"center_height": height})[-1]
    assert between.pressure == pytest.approx(direct.pressure, rel=ACCURACY)
    assert len(branch.resample(20)) == 20
    part = branch[first - 1 : first + 3]
    part.to_vtk(tmp_path / "surfaces.pvd")
    part.plot(tmp_path / "branch.png")
    assert (tmp_path / "branch.png").stat().st_size > 0


def test_loads_beyond_those_that_were_tried():
    """A trial stops at the fold V = 82.7; the loads before it that no trial had were missed by 4e-7 on the mesh of the others."""
    scene = disc_scene(OGDEN, (200.0, 6.5)).replace(mesh=fm.disc(accuracy=1e-8))
    run = fm.Run(control="volume", start=0.5, stop=300.0, steps=30, solver="newton")
    kept: list[fm.Branch] = []
    branch = fm.run(scene.replace(run=run), on_checkpoint=kept.append)
    assert branch.mesh_changes
    assert branch.status is fm.Status.NO_EQUILIBRIUM
    best = fm.inflate(scene.replace(mesh=fm.disc(40), degree=8), volumes=branch.volume, solver="newton")
    assert np.abs(branch.pressure / best.pressure - 1).max() < 1e-8
    again = fm.run(scene.replace(run=run), unfinished=kept[-2])
    assert np.array_equal(again.pressure, branch.pressure)
    assert [eq.scene for eq in again] == [eq.scene for eq in branch]


def test_one_mesh_where_it_is_small():
    """A disc as any other keeps one mesh, and has no column for it."""
    branch = fm.trace(disc_scene(OGDEN, (200.0, 6.5)).replace(mesh=fm.disc(accuracy=1e-6)), start=0.5, until={"center_height": 5.2})
    assert not branch.mesh_changes
    assert len({id(eq.scene.mesh) for eq in branch}) == 1
    assert "elements" not in branch.to_dataframe().columns
    assert (branch.column("elements") == branch.scene.mesh.elements).all()


def test_what_needs_no_mesh_of_its_own_is_said(monkeypatch):
    """An end that no mesh reaches is named, with the last state that keeps the accuracy."""
    monkeypatch.setattr(along, "_MOST_OF_ONE", 6)
    monkeypatch.setattr(along, "_MOST_ALONG", 12)
    branch = fm.trace(BELOW, **ASKED, until=END)
    assert branch.status is fm.Status.ACCURACY_NOT_MET
    assert "is not met by 12 elements" in branch.message
    assert f"it is kept up to V = {branch[-1].volume:.6g}" in branch.message
