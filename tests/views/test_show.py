"""The membrane in space as a person asks for it: pictures and movies without a display, and what fills a window."""

from __future__ import annotations

import dataclasses
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.cli import main
from femmembrane.physics.outline import Outline
from femmembrane.results.zones import KINDS
from femmembrane.views import movie, picture, surroundings, viewer
from tests.cases import disc_scene

pyvista = pytest.importorskip("pyvista")

SMALL = (240, 180)


@cache
def branch() -> fm.Branch:
    scene = disc_scene(dipole=(150, 4.5), elements=8).replace(analysis=fm.Analysis(("volume",), wrinkling="total"))
    return fm.inflate(scene, volumes=[0.5, 2.0, 5.0])


def frames(path: Path) -> list[np.ndarray]:
    from PIL import Image

    with Image.open(path) as image:
        found = []
        for k in range(image.n_frames):
            image.seek(k)
            found.append(np.asarray(image.convert("RGB")))
    return found


def test_movie_of_a_branch(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """One frame a step; the membrane grows, while the dipole, the key and the white around them stay where they are, to the last bit."""
    fm.view(branch(), movie=tmp_path / "a.gif", size=SMALL)
    first, _, last = found = frames(tmp_path / "a.gif")
    assert {frame.shape for frame in found} == {(180, 240, 3)}
    assert (first[-1] == 255).all()
    key = np.s_[30:, 180:]
    assert (first[key] == last[key]).all()
    assert (first[key] < 200).any()
    ink = [(frame[30:, :180].min(axis=2) < 200).sum() for frame in found]
    assert ink[0] < ink[1] < ink[2]
    assert capfd.readouterr() == ("", "")


def test_a_mode_moves_and_comes_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewer, "_PERIOD", 10)
    fm.view(branch(), mode=1, step=0, movie=tmp_path / "a.gif", size=SMALL)
    found = frames(tmp_path / "a.gif")
    assert len(found) == 10
    apart = [np.abs(found[0].astype(int) - found[k]).mean() for k in (1, 5, -1)]
    assert apart[1] > 2 * max(apart[0], apart[2])


def test_command(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """From a saved branch to a picture of one step; the zones are those of the equilibrium."""
    branch().save(tmp_path / "branch.nc")
    assert main(["view", str(tmp_path), "--step", "0", "--color", "zone", "--screenshot", str(tmp_path / "a.png")]) == 0
    from matplotlib.image import imread

    image = imread(tmp_path / "a.png")[..., :3]
    assert image.shape == (900, 1200, 3)
    assert 0.1 < (image[100:, :900].min(axis=2) < 0.9).mean() < 0.9
    assert capfd.readouterr() == (f"written: {tmp_path / 'a.png'}\n", "")


def test_zones_are_coloured_between_their_borders() -> None:
    surface = picture.Surface.of(branch()[0], "zone")
    zones = branch()[0].zones()
    assert zones.kinds == ("double", "radial", "taut")
    changes = np.flatnonzero(np.diff(surface.values)) + 1
    profile = branch()[0].profile(list(zones.borders))
    np.testing.assert_allclose(surface.rho[changes], profile["rho"], atol=1e-14)
    assert [KINDS[int(value)] for value in surface.values[[0, changes[0], -1]]] == list(zones.kinds)


def test_colours_are_ordered_in_grey() -> None:
    """The luma of the zones falls from the taut zone on. The luma of the map of quantities falls too."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgb

    grey = [np.dot(to_rgb(color), (0.299, 0.587, 0.114)) for color in picture.zone_colors()]
    assert np.diff(grey).max() < -0.15
    assert np.diff(colormaps[picture._MAP](np.linspace(0, 1, 50))[:, :3] @ (0.299, 0.587, 0.114)).min() > 0


def test_window() -> None:
    """The slider takes the membrane to a step, under the camera and colours of all."""
    with picture.new_plotter(SMALL) as plotter:
        viewer.open_steps(plotter, list(branch()), "stretch_1", 2)
        (slider,) = getattr(plotter, "widgets", plotter).slider_widgets  # before pyvista 0.48 the plotter held them itself
        camera, limits = plotter.camera_position, plotter.actors["membrane"].mapper.scalar_range
        slider.GetRepresentation().SetValue(0.0)
        slider.InvokeEvent("InteractionEvent")
        assert plotter.actors["membrane"].bounds[5] == pytest.approx(branch()[0].center_height, abs=1e-6)
        assert plotter.camera_position == camera
        assert plotter.actors["membrane"].mapper.scalar_range == limits
        assert "step 0/2" in plotter.actors["caption"].input


class Stranger:
    """A source that says how it looks (or not), and has no field to speak of."""

    def __init__(self, *points: tuple[float, float], moment: int = 0) -> None:
        if points:
            self.outline = lambda: Outline("stranger", points, moment)


def test_any_source_is_drawn_as_it_says() -> None:
    """A ring, a rod without ends and a coil stand where they say; one far away and one that does not say are named."""
    box = surroundings.Box(1.0, 0.0, 2.0)
    kinds = {
        "ring": (Stranger((0.5, 3.0)), (0.5, 3.0, 3.0)),
        "rod": (Stranger((0.0, -np.inf), (0.0, np.inf)), (0.0, -0.6, 2.6)),
        "coil": (Stranger((0.4, -1.0), (0.4, -2.0), moment=1), (0.4, -2.0, -1.0)),
    }
    for source, (radius, low, high) in kinds.values():
        with picture.new_plotter(SMALL) as plotter:
            drawn = np.concatenate(picture.draw_surroundings(plotter, SimpleNamespace(sources=[source]), box))
        assert np.hypot(*drawn.T[:2]).max() == pytest.approx(radius, abs=0.05)
        assert (drawn[:, 2].min(), drawn[:, 2].max()) == pytest.approx((low, high), abs=0.05)
    around = surroundings.surroundings(SimpleNamespace(sources=[Stranger(), Stranger((0.0, 9.0))]), box)
    assert around == surroundings.Surroundings((), ("stranger", "stranger"))
    dipole = surroundings.surroundings(branch().scene, box)
    assert dipole.near == (Outline("dipole at height 4.5", ((0.0, 4.5),), 1),)


def test_clamped_ends_are_those_of_the_supports() -> None:
    assert surroundings.clamped_ends(branch()[0], 17) == [(16, 1.0, 0.0)]
    balloon = fm.Scene(fm.NeoHookean(), fm.sphere(elements=4))
    assert surroundings.clamped_ends(fm.equilibrium(balloon, volume=5.0), 17) == []
    tube = fm.Scene(fm.NeoHookean(), fm.cylinder(elements=4, length=2.0, top="hub"))
    ends = surroundings.clamped_ends(fm.equilibrium(tube, volume=7.0), 17)
    assert [end for end, _, _ in ends] == [16]


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"color": "zones"}, "did you mean 'zone'"),
        ({"color": "total_stress_1_pa"}, "color"),
        ({"step": 3}, "from -3 to 2"),
        ({"movie": "a.avi"}, r"\.gif or \.mp4"),
        ({"screenshot": "a.gif"}, r"\.png"),
        ({}, "no display"),
    ],
)
def test_refusals(asked: dict[str, object], told: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(fm.InputError, match=told):
        fm.view(branch(), **asked)
    assert not list(tmp_path.iterdir())


def test_mp4_needs_a_writer(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(movie, "find_spec", lambda name: None)
    with pytest.raises(fm.InputError, match=r'pip install "imageio\[ffmpeg\]"'):
        fm.view(branch(), movie=tmp_path / "a.mp4")


def test_nothing_to_show(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(fm.InputError, match="one or more equilibria"):
        fm.view(dataclasses.replace(branch(), equilibria=()))
    assert main(["view", str(tmp_path / "none")]) == 2
    assert "folder of a run" in capfd.readouterr().err


def test_a_movie_tells_of_its_frames_and_moves_one_mesh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The cells of the surface are built once, however many frames there are."""
    told: list[tuple[int, int]] = []
    built: list[int] = []
    original = picture.polydata
    monkeypatch.setattr(picture, "polydata", lambda *a: built.append(1) or original(*a))
    fm.view(branch(), movie=tmp_path / "a.gif", size=SMALL, on_frame=lambda number, total: told.append((number, total)))
    assert told == [(k + 1, len(branch())) for k in range(len(branch()))]
    assert len(built) == 1
    told.clear()
    fm.view(branch(), mode=0, step=0, movie=tmp_path / "b.gif", size=SMALL, on_frame=lambda number, total: told.append((number, total)))
    assert told[-1] == (30, 30)


def test_frames_are_as_large_as_asked_and_white_outside(tmp_path: Path) -> None:
    """A frame is the mean of a finer picture: edges are smooth, the paper stays white."""
    with picture.new_plotter(SMALL, frames=True) as plotter:
        surface = picture.Surface.of(branch()[-1], "stretch_2")
        picture.draw_surface(plotter, surface, surface.range, surface.box.size)
        picture.aim(plotter, surface.points)
        found = picture.frame(plotter)
    assert found.shape == (SMALL[1], SMALL[0], 3)
    assert (found[0] == 255).all()
    assert (found.min(axis=2) < 200).mean() > 0.05


def test_normals_of_a_sphere_point_along_the_radius() -> None:
    sphere = fm.equilibrium(fm.Scene(material=fm.MooneyRivlin(ratio=0.1), mesh=fm.sphere(elements=16)), pressure=0.3)
    surface = picture.Surface.of(sphere, "stretch_1")
    centred = surface.points - [0, 0, surface.points[:, 2].mean()]
    radial = centred / np.linalg.norm(centred, axis=1)[:, None]
    assert np.abs((surface.normals * radial).sum(axis=1)).min() > 0.99


@pytest.mark.parametrize(("limits", "digits"), [((0.0, 7.65), 3), ((0.993, 1.004), 4), ((1.0, 1.00002), 7), ((2.0, 2.0), 3)])
def test_numbers_at_a_scale_differ(limits: tuple[float, float], digits: int) -> None:
    assert picture._digits(limits) == digits


def test_words_at_the_top_have_room() -> None:
    """Nothing that is drawn is higher than the margin and the words leave, and the rest of the picture is filled."""
    points = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (0.0, 4.0)])
    for words in (0.0, 0.07):
        with picture.new_plotter((400, 400)) as plotter:
            picture.aim(plotter, points, margin=0.11, words=words)
            camera = plotter.camera
            height = (points - np.array(camera.focal_point)) @ np.array(camera.up) / (2 * camera.parallel_scale) + 0.5
        assert height.min() == pytest.approx(0.11)
        assert height.max() == pytest.approx(1 - 0.11 - words)


@pytest.mark.parametrize(
    "body",
    [fm.Plane(0.5), fm.Ball(0.9, 0.4), fm.Cylinder(0.5, 0.9, 0.3), fm.Mould(points=[(1.2, 0.1), (0.6, 0.5), (0.6, 1.0)])],
    ids=["plane", "ball", "cylinder", "mould"],
)
def test_a_rigid_body_is_drawn(body: object, tmp_path: Path) -> None:
    """A grey body, whatever it is: pixels change beside the picture without it."""
    scene = fm.Scene(fm.NeoHookean(), mesh=fm.disc(8))
    bare, beside = (fm.inflate(s, volumes=[0.3]) for s in (scene, scene.replace(obstacles=[body])))
    seen = []
    for k, found in enumerate((bare, beside)):
        fm.view(found, screenshot=tmp_path / f"{k}.png", size=SMALL)
        seen.append(pyvista.read_texture(tmp_path / f"{k}.png").to_array())
    assert (seen[0] != seen[1]).any(axis=-1).mean() > 0.02
