"""Runs whose elements follow the borders of wrinkled zones: ``follow_borders``."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm

from ..cases import OGDEN, disc_scene
from .test_borders import DIPOLE, DISC

#: volumes of recorded states, and one at which the membrane is taut
VOLUMES = [0.5, *(DISC[height].volume for height in (-0.1, -0.2, -0.3))]


def following(elements: int = 12, degree: int = 5, **more: object) -> fm.Scene:
    return disc_scene(OGDEN, DIPOLE, elements, degree).replace(tension_field=True, follow_borders=True, **more)


@cache
def inflated() -> fm.Branch:
    return fm.inflate(following(), volumes=VOLUMES)


def test_each_equilibrium_has_its_own_elements():
    """Against shooting (:mod:`.test_borders`): the volume as asked, the pressure to ten digits."""
    branch = inflated()
    assert branch[0].scene == branch.scene  # taut: nothing to follow
    for eq, height in zip(branch[1:], (-0.1, -0.2, -0.3), strict=True):
        assert eq.scene.mesh.elements == 12
        assert set(eq.zones("mechanical").borders) <= set(eq.potential.space.ends)
        assert eq.volume == pytest.approx(DISC[height].volume, rel=1e-11)
        assert eq.pressure == pytest.approx(DISC[height].pressure, rel=1e-10)
        assert abs(eq.error_estimate().pressure.error) < 1e-10
    assert len({eq.scene.borders for eq in branch}) == 4


def test_a_scene_without_a_tension_field_has_no_zones_to_follow():
    plain = disc_scene(OGDEN, DIPOLE, 12, 2)
    one, other = (fm.inflate(scene, volumes=VOLUMES[:2], solver="newton") for scene in (plain, plain.replace(follow_borders=True)))
    assert np.array_equal(one.pressure, other.pressure)
    assert other[-1].potential is one[-1].potential


def test_files_keep_the_elements(tmp_path: Path):
    branch = inflated()
    branch.save(tmp_path / "branch.nc")
    again = fm.load(tmp_path / "branch.nc")
    for eq, loaded in zip(branch, again, strict=True):
        assert loaded.scene == eq.scene
        assert np.array_equal(loaded.state, eq.state)
        assert loaded.zones("mechanical").borders == eq.zones("mechanical").borders
        assert np.array_equal(loaded.of_branch.state, eq.of_branch.state)
    radii = branch.to_xarray()["r"]
    assert radii.dims == ("step", "node")
    for row, eq in zip(radii.values, branch, strict=True):
        assert np.array_equal(row, eq.profile()["r"])


def test_the_key_of_a_scene_file():
    scene = following()
    assert scene.to_dict()["mesh"]["follow_borders"] is True
    assert fm.Scene.from_dict(scene.to_dict()) == scene
    assert "follow_borders" not in scene.replace(follow_borders=None).to_dict()["mesh"]
    with pytest.raises(fm.InputError, match=r"mesh\.follow_borders"):
        scene.replace(follow_borders=1)


def test_a_run_goes_on_to_the_bit_where_it_was_interrupted():
    scene = following(8, 3, run=fm.Run(control="volume", values=tuple(VOLUMES), solver="newton"))
    kept: list[fm.Branch] = []
    whole = fm.run(scene, on_checkpoint=kept.append)
    part = next(branch for branch in kept if len(branch) == 3)
    again = fm.run(scene, unfinished=part)
    assert np.array_equal(again.pressure, whole.pressure)
    assert np.array_equal(again[-1].state, whole[-1].state)
    assert again[-1].scene == whole[-1].scene


def test_a_branch_is_followed_on_its_borders():
    """By arc length, with longer steps than where borders pass through elements; it goes on to the bit."""
    scene = following(16, 6)
    asked = {"start": 0.5, "until": {"center_height": -0.45}, "direction": -1}
    plain, branch = (fm.trace(each, **asked) for each in (scene.replace(follow_borders=False), scene))
    assert branch.status is fm.Status.CONVERGED
    assert len(branch) < 0.5 * len(plain)
    assert branch[-1].center_height == pytest.approx(-0.45, rel=1e-12)
    assert branch[-1].pressure == pytest.approx(DISC[-0.45].pressure, rel=1e-8)  # the height of a pole is less exact than a volume
    wrinkled = [eq for eq in branch if len(eq.zones("mechanical")) > 1]
    assert len(wrinkled) > 2
    assert all(set(eq.zones("mechanical").borders) <= set(eq.potential.space.ends) for eq in wrinkled)
    half = fm.trace(scene, start=0.5, direction=-1, max_steps=len(branch) - 3)
    again = fm.trace(scene, start=half, until={"center_height": -0.45})
    assert np.array_equal(again[-1].state, branch[-1].state)
    assert again[-1].scene == branch[-1].scene
    assert branch.at(volume=0.02, refine=True).volume == pytest.approx(0.02, rel=1e-12)


def test_a_run_over_a_number():
    """The strength of the dipole, at a held volume; the state at 410 is the one that is found there directly."""
    start = inflated()[2]
    branch = fm.vary(following(), "source.0.strength", [400.0, 410.0], hold={"volume": VOLUMES[2]}, start=start)
    assert branch[0].pressure == pytest.approx(start.pressure, rel=1e-11)
    direct = fm.inflate(branch[1].scene.replace(mesh=fm.disc(16)), volumes=[VOLUMES[2]])
    assert branch[1].pressure == pytest.approx(direct[0].pressure, rel=1e-9)
    assert branch[0].zones("mechanical").borders != branch[1].zones("mechanical").borders


def test_surfaces_have_the_nodes_of_their_own_elements(tmp_path: Path):
    eq = inflated()[1]
    assert set(eq.zones("mechanical").borders) <= set(eq.profile()["r"])
    inflated().to_vtk(tmp_path / "surfaces.pvd")
    assert len(list(tmp_path.rglob("*.vt*"))) >= len(inflated())


def test_an_accuracy_is_kept_with_high_degrees():
    """Few elements for ten digits; with borders inside elements 1e-8 took hundreds."""
    scene = following().replace(mesh=fm.disc(accuracy=1e-9))
    eq = fm.equilibrium(scene, volume=DISC[-0.1].volume)
    assert eq.pressure == pytest.approx(DISC[-0.1].pressure, rel=1e-9)
    assert eq.scene.degree > 4
    assert eq.scene.mesh.elements < 24
    assert eq.scene.mesh.accuracy == 1e-9


def test_a_search_follows_zones_too():
    found = fm.equilibria(following(8, 3), volume=DISC[-0.1].volume, max_steps=120)
    eq = next(eq for eq in found if abs(eq.center_height + 0.1) < 1e-3)
    assert eq.pressure == pytest.approx(DISC[-0.1].pressure, rel=5e-7)
    assert set(eq.zones("mechanical").borders) <= set(eq.potential.space.ends)
