"""Modes in space: files that open elsewhere and hold the mode, and pictures that show it."""

from __future__ import annotations

import dataclasses
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.errors import InputError
from femmembrane.views.modes import SHOWN, render_mode, write_mode_vtk
from femmembrane.views.vtk import SECTORS, Revolution
from tests.cases import disc_scene

pyvista = pytest.importorskip("pyvista")

FRAMES = 8


@cache
def membrane() -> fm.Equilibrium:
    return fm.equilibrium(disc_scene(dipole=(600, -3.5), elements=12), center_height=0.3)


@cache
def vibration(n: int) -> fm.Vibration:
    return membrane().frequencies(azimuthal=n, count=1)[0]


def surfaces(folder: Path) -> list[pyvista.UnstructuredGrid]:
    return [pyvista.read(path) for path in sorted(folder.glob("*.vtu"))]


@pytest.fixture(scope="module")
def tipping(tmp_path_factory: pytest.TempPathFactory) -> list[pyvista.UnstructuredGrid]:
    path = tmp_path_factory.mktemp("mode") / "tipping.pvd"
    files = fm.write_mode_vtk(membrane(), vibration(1), path, frames=FRAMES)
    assert files[-1] == path
    assert len(files) == FRAMES + 1
    reader = pyvista.get_reader(path)
    assert reader.time_values == list(range(FRAMES))
    return surfaces(path.parent / "tipping")


def test_half_a_period_later_it_tips_the_other_way(tipping: list[pyvista.UnstructuredGrid]) -> None:
    """With one wave the motion half a period later is the same, turned by half a turn about the axis."""
    node = Revolution.of(membrane().profile()["r"]).node
    first, later = (np.asarray(tipping[k].points, dtype=float) for k in (0, FRAMES // 2))
    opposite = np.concatenate([np.roll(np.flatnonzero(node == k), SECTORS // 2) for k in range(node.max() + 1)])
    opposite[0] = 0
    np.testing.assert_allclose(later[opposite] * [-1, -1, 1], first, atol=1e-12)
    np.testing.assert_allclose(tipping[0]["displacement"], -tipping[FRAMES // 2]["displacement"], atol=1e-12)
    assert np.abs(tipping[FRAMES // 4]["displacement"]).max() < 1e-12


def test_the_middle_of_the_motion_is_the_equilibrium(tipping: list[pyvista.UnstructuredGrid]) -> None:
    profile = membrane().profile()
    rest = Revolution.of(profile["r"]).vectors(profile["rho"], profile["eta"])
    for grid in tipping:
        np.testing.assert_allclose(np.asarray(grid.points) - grid["displacement"], rest, atol=1e-12)


def test_the_rim_does_not_move(tipping: list[pyvista.UnstructuredGrid]) -> None:
    rim = Revolution.of(membrane().profile()["r"]).node == 24
    for grid in tipping:
        assert np.abs(grid["displacement"][rim]).max() == 0


def test_default_amplitude(tipping: list[pyvista.UnstructuredGrid]) -> None:
    """Half the size of a shallow membrane is the radius of its rim."""
    largest = np.linalg.norm(tipping[0]["displacement"], axis=1).max()
    assert largest == pytest.approx(SHOWN, rel=1e-9)


@pytest.mark.parametrize("n", [0, 1, 2, 5])
def test_displacements_are_those_of_the_mode(n: int, tmp_path: Path) -> None:
    """Written out in Cartesian components at every point; the pole moves along the axis (n = 0), sideways (n = 1), or not at all."""
    write_mode_vtk(membrane(), vibration(n), tmp_path / "mode.pvd", frames=2, amplitude=0.02)
    grid = surfaces(tmp_path / "mode")[0]
    mode, sectors = vibration(n).mode, max(SECTORS, 12 * n)
    assert grid.n_points == 1 + 24 * sectors
    expected = [(mode["u"][0], 0.0, mode["w"][0])]
    for k in range(1, 25):
        for theta in 2 * np.pi * np.arange(sectors) / sectors:
            u, w = mode["u"][k] * np.cos(n * theta), mode["w"][k] * np.cos(n * theta)
            c = mode["c"][k] * np.sin(n * theta) if n else 0.0
            expected.append((u * np.cos(theta) - c * np.sin(theta), u * np.sin(theta) + c * np.cos(theta), w))
    np.testing.assert_allclose(grid["displacement"], 0.02 * np.array(expected), atol=1e-13)
    pole = np.abs(grid["displacement"][0]) > 1e-6
    assert pole.tolist() == {0: [False, False, True], 1: [True, False, False]}.get(n, [False] * 3)


def test_the_displacement_is_smooth_across_the_axis(tipping: list[pyvista.UnstructuredGrid]) -> None:
    """At n = 1 the first ring moves as the pole does, up to the distance from it squared: c = -u there."""
    moved = tipping[0]["displacement"]
    np.testing.assert_allclose(moved[1 : 1 + SECTORS, :2], np.broadcast_to(moved[0, :2], (SECTORS, 2)), atol=0.01 * np.abs(moved).max())


def test_a_verdict_s_mode_is_written_as_well(tmp_path: Path, tipping: list[pyvista.UnstructuredGrid]) -> None:
    write_mode_vtk(membrane(), membrane().verdict(azimuthal=1), tmp_path / "mode.pvd", frames=2)
    np.testing.assert_allclose(surfaces(tmp_path / "mode")[0]["displacement"], tipping[0]["displacement"], atol=1e-7)


def test_frames_of_a_longer_animation_are_removed(tmp_path: Path) -> None:
    path = tmp_path / "mode.pvd"
    for frames in (5, 3):
        write_mode_vtk(membrane(), vibration(0), path, frames=frames)
    assert len(surfaces(tmp_path / "mode")) == 3
    assert sorted(p.name for p in tmp_path.iterdir()) == ["mode", "mode.pvd"]


def test_picture(tmp_path: Path, silent: None) -> None:
    from matplotlib.image import imread

    path = tmp_path / "mode.png"
    fm.render_mode(membrane(), vibration(1), path, size=(600, 280))
    image = imread(path)[..., :3]
    assert image.shape == (280, 600, 3)
    # the equilibrium on the left is of one pale colour; on the right one side has gone up (red) and the other down (blue)
    left, right = image[:200, :300], image[:200, 300:]
    red, blue = (lambda part, k=k: (part[..., k] - part[..., 2 - k] > 0.3).sum() for k in (0, 2))
    assert red(left) + blue(left) == 0
    assert red(right) > 300
    assert blue(right) > 300


# what is refused


@pytest.mark.parametrize(
    ("key", "asked"),
    [("path", {"path": "mode.vtu"}), ("frames", {"frames": 1}), ("frames", {"frames": 2.5}), ("amplitude", {"amplitude": np.nan})],
)
def test_refusals(key: str, asked: dict[str, object], tmp_path: Path) -> None:
    given = {"path": "mode.pvd", **asked}
    with pytest.raises(InputError) as caught:
        write_mode_vtk(membrane(), vibration(1), tmp_path / given.pop("path"), **given)
    assert caught.value.key == key
    assert list(tmp_path.iterdir()) == []


def test_modes_that_cannot_be_shown(tmp_path: Path) -> None:
    without = dataclasses.replace(membrane().verdict(azimuthal=1), coefficients=None, reason="short-wave unstable")
    with pytest.raises(InputError, match="short-wave unstable"):
        render_mode(membrane(), without, tmp_path / "mode.png")
    other = fm.equilibrium(disc_scene(elements=8), center_height=0.5)
    with pytest.raises(InputError, match="nodes"):
        write_mode_vtk(other, vibration(1), tmp_path / "mode.pvd")
    with pytest.raises(InputError, match="folder"):
        render_mode(membrane(), vibration(1), tmp_path / "missing" / "mode.png")
