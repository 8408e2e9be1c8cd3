"""Meridians from mesh files and from points: read, written, checked, embedded in scenes."""

from __future__ import annotations

import runpy
import shutil
import sys
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import femmembrane as fm
from femmembrane.cli import main
from femmembrane.discretization.mesh_files import FORMATS

NEO_HOOKEAN = fm.NeoHookean()
MESHES = Path(__file__).parents[2] / "meshes"

#: built-in shapes, a volume, and the first end of their curve
SHAPES = {
    "disc": (fm.disc(12), 1.0, "clamped"),
    "annulus": (fm.annulus(0.3, 12), 1.0, "hub"),
    "cap": (fm.cap(0.5, 12), 1.5, "clamped"),
    "bowl": (fm.cap(-0.5, 12), 1.5, "clamped"),
    "sphere": (fm.sphere(12), 8.0, "clamped"),
    "tube": (fm.cylinder(3.0, 12, top="hub"), 14.0, "hub"),
    "torus": (fm.torus(3.0, 12), 90.0, "clamped"),
}


def shuffled(curve: fm.Curve, seed: int = 0, backwards: bool = False) -> fm.Curve:
    """The same curve from points and cells in random order, cells in random (or all in the other) direction."""
    rng = np.random.default_rng(seed)
    points = np.array(curve.points[:-1] if curve.closed else curve.points)
    step = 2 if curve.curved else 1
    start = np.arange(0, len(curve.points) - 1, step)
    cells = np.stack([start, (start + step) % len(points), *([start + 1] if curve.curved else [])], axis=1)
    turned = np.ones(len(cells), dtype=bool) if backwards else rng.random(len(cells)) < 0.5
    cells[turned] = cells[turned][:, [1, 0, *range(2, cells.shape[1])]]
    new = rng.permutation(len(points))
    mixed = np.empty_like(points)
    mixed[new] = points
    order = rng.permutation(len(cells))
    return fm.meridian_from_points(mixed, new[cells][order], first=curve.first, last=curve.last)


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("curved", [True, False])
@pytest.mark.parametrize("name", SHAPES)
def test_reading_back_changes_nothing(name: str, curved: bool, suffix: str, tmp_path: Path) -> None:
    mesh, _, first = SHAPES[name]
    fm.write_meridian(mesh, tmp_path / f"a{suffix}", curved=curved)
    curve = fm.read_meridian(tmp_path / f"a{suffix}", first=first)
    assert (curve.curved, curve.elements, curve.closed) == (curved, 12, name == "torus")
    fm.write_meridian(curve, tmp_path / f"b{suffix}")
    assert fm.read_meridian(tmp_path / f"b{suffix}", first=first) == curve
    assert fm.Curve(points=curve.points, curved=curved, first=first) == curve


@pytest.mark.parametrize("name", SHAPES)
def test_order_of_nodes_and_cells_plays_no_part(name: str) -> None:
    """The same curve, to the last bit, and so the same of everything."""
    mesh, _, first = SHAPES[name]
    s = np.append(
        np.stack([mesh.breakpoints()[:-1], (mesh.breakpoints()[:-1] + mesh.breakpoints()[1:]) / 2], axis=1), mesh.breakpoints()[-1]
    )
    points = np.stack(mesh.position(s), axis=1)
    if name == "torus":
        points[-1] = points[0]
    curve = fm.Curve(points=points, curved=True, first=first)
    assert fm.Curve(points=points[::-1], curved=True, first=first) == curve
    for seed in range(3):
        assert shuffled(curve, seed) == curve
    assert shuffled(curve, backwards=True) == curve


@pytest.mark.parametrize("name", SHAPES)
def test_a_file_gives_the_answer_of_the_built_in_shape(name: str, tmp_path: Path) -> None:
    """Flat and straight shapes to round-off; round ones as closely as parabolas are circles, at the third power of the cells or better."""
    mesh, volume, first = SHAPES[name]
    scene = fm.Scene(material=NEO_HOOKEAN, mesh=mesh)
    expected = fm.equilibrium(scene, volume=volume)
    misses = []
    for cells in (12, 24):
        fm.write_meridian(mesh.with_elements(cells), tmp_path / "a.vtu")
        curve = fm.read_meridian(tmp_path / "a.vtu", first=first)
        fine = fm.equilibrium(scene.replace(mesh=mesh.with_elements(cells)), volume=volume)
        eq = fm.equilibrium(scene.replace(mesh=curve), volume=volume)
        misses.append(abs(eq.pressure / fine.pressure - 1))
        for n in (1, 2):
            assert eq.verdict(azimuthal=n).stable == fine.verdict(azimuthal=n).stable
    if name in ("disc", "annulus", "tube"):
        assert max(misses) < 1e-11
    else:
        assert misses[1] < misses[0] / 8
        assert misses[1] < 1e-4
    assert expected.status is fm.Status.CONVERGED


def test_divisions_refine_the_elements_and_not_the_shape() -> None:
    curve = fm.read_meridian(MESHES / "cone.vtu", first="hub")
    assert (curve.elements, curve.refined().elements, curve.with_elements(48).divisions) == (16, 32, 3)
    s = np.linspace(0, curve.breakpoints()[-1], 13)
    for fine in (curve.refined(), curve.with_elements(48)):
        assert np.array_equal(fine.position(s), curve.position(s))
    assert np.hypot(*curve.tangent(s)) == pytest.approx(np.ones(13), rel=1e-14)
    with pytest.raises(fm.InputError, match="a multiple of the 16 cells"):
        curve.with_elements(20)


# --- the files that are shipped


def test_generated_files_are_those_shipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["generate.py", "--out", str(tmp_path)])
    made = runpy.run_path(str(MESHES / "generate.py"), run_name="__main__")["MERIDIANS"]
    listed = (MESHES / "README.md").read_text(encoding="utf-8")
    shipped = {path.name for path in MESHES.iterdir() if path.suffix in FORMATS}
    assert shipped == set(made)
    for name in made:
        assert f"| {name} |" in listed
        assert fm.read_meridian(MESHES / name) == fm.read_meridian(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "ends", "volume"),
    [("torus.vtu", {}, 70.0), ("bellows.msh", {"first": "hub"}, 19.0), ("egg.vtk", {}, 7.0), ("cone.vtu", {"first": "hub"}, 1.5)],
)
def test_shipped_files_solve(name: str, ends: dict[str, str], volume: float) -> None:
    """A membrane in each is inflated and stable; the egg's sharper end is under less tension than its middle."""
    eq = fm.equilibrium(fm.Scene(material=NEO_HOOKEAN, mesh=fm.read_meridian(MESHES / name, **ends)), volume=volume)
    assert eq.residual < 1e-10
    assert eq.pressure > 0
    assert eq.verdict("volume").stable


# --- scenes

SCENE = """
[material]
model = "neo-hookean"
[mesh]
file = "shapes/torus.vtu"
divisions = 2
degree = 1
[run]
control = "volume"
values = [70.0]
"""


def test_a_scene_finds_its_file_and_a_result_needs_none(tmp_path: Path) -> None:
    """The path starts from the folder of the scene; the saved branch holds the points."""
    (tmp_path / "shapes").mkdir()
    shutil.copy(MESHES / "torus.vtu", tmp_path / "shapes")
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    scene = fm.Scene.from_toml(tmp_path / "scene.toml")
    assert scene.mesh == fm.read_meridian(MESHES / "torus.vtu", divisions=2)
    assert (scene.mesh.elements, scene.degree) == (96, 1)
    assert main(["run", str(tmp_path / "scene.toml"), "--out", str(tmp_path / "out")]) == 0
    shutil.rmtree(tmp_path / "shapes")
    loaded = fm.load(tmp_path / "out" / "branch.nc")
    assert loaded.scene == scene
    assert loaded[0].potential.evaluate(loaded[0].state, loaded[0].pressure).volume == pytest.approx(70.0, rel=1e-12)
    scene.to_toml(tmp_path / "whole.toml")
    assert fm.Scene.from_toml(tmp_path / "whole.toml") == scene


# --- what is refused


def _write(path: Path, points: Any, cells: Any, kind: str = "line") -> Path:
    meshio.Mesh(np.column_stack([np.asarray(points, dtype=float), np.zeros(len(points))]), [(kind, np.asarray(cells))]).write(path)
    return path


LINE = [(0, 1), (1, 2), (2, 3)]
BAD_FILES = {
    "a branch": ([(0, 0), (1, 0), (2, 0), (1, 1)], [(0, 1), (1, 2), (1, 3)], "cells 0, 1, 2 meet in one point"),
    "two curves": ([(0, 0), (1, 0), (2, 1), (3, 1)], [(0, 1), (2, 3)], "cell 1 is not joined to cell 0"),
    "a negative radius": ([(0, 0), (1, 0), (-0.1, 1), (1, 1)], LINE, "cell 2 has the point (-0.1, 1)"),
    "a pole inside": ([(1, 0), (0, 0), (1, 1), (2, 1)], LINE, "cell 1 touches the axis at (0, 0)"),
    "a closed curve on the axis": ([(0, 0), (1, 0), (1, 1)], [(0, 1), (1, 2), (2, 0)], "touches the axis"),
    "no length": ([(0, 0), (1, 0), (1, 0), (2, 0)], LINE, "cell 1 has no length, at (1, 0)"),
    "one node twice": ([(0, 0), (1, 0), (2, 0), (3, 0)], [(0, 1), (1, 1), (1, 2)], "cell 1 has no length"),
    "not a number": ([(0, 0), (1, np.nan), (2, 0), (3, 0)], LINE, "cell 1 has the point (1, nan)"),
    "infinite": ([(0, 0), (1, 0), (np.inf, 0), (3, 0)], LINE, "finite numbers"),
    "a knot": ([(1, 0), (2, 0), (2, 1), (1, 0)], [(0, 1), (1, 2)], None),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_curves_name_the_cell(name: str, tmp_path: Path) -> None:
    points, cells, text = BAD_FILES[name]
    path = _write(tmp_path / "a.vtu", points, cells)
    if text is None:  # an unused point is no harm
        assert fm.read_meridian(path).elements == 2
        return
    with pytest.raises(fm.InputError) as caught:
        fm.read_meridian(path)
    assert caught.value.key == "mesh.file"
    assert text in str(caught.value)


def test_bad_files(tmp_path: Path, silent: None) -> None:
    _write(tmp_path / "triangles.vtu", [(0, 0), (1, 0), (1, 1)], [(0, 1, 2)], "triangle")
    _write(tmp_path / "back.vtu", [(0, 0), (1, 0), (0.9, 0)], [(0, 1, 2)], "line3")
    meshio.Mesh(np.array([[0, 0, 0], [1, 0.5, 1.0]]), [("line", np.array([(0, 1)]))]).write(tmp_path / "space.vtu")
    (tmp_path / "text.vtu").write_text("no mesh", encoding="utf-8")
    (tmp_path / "text.msh").write_text("no mesh", encoding="utf-8")
    for name, text in {
        "missing.vtu": "there is no such file",
        "a.stl": "ends in .vtu, .msh, .vtk, .xdmf",
        "triangles.vtu": "line cells of one kind are allowed, line or line3; cells in the file: triangle",
        "space.vtu": "a third coordinate that is not zero",
        "text.vtu": "cannot be read as a mesh",
        "text.msh": "cannot be read as a mesh",
        "back.vtu": "cell 0 has its inner point too near to one end",
    }.items():
        with pytest.raises(fm.InputError) as caught:
            fm.read_meridian(tmp_path / name)
        assert caught.value.key == "mesh.file", name
        assert text in str(caught.value), name
    with pytest.raises(fm.InputError, match=r"\.xdmf"):
        fm.write_meridian(fm.sphere(8), tmp_path / "a.txt")
    with pytest.raises(fm.InputError, match="existing, writable folder"):
        fm.write_meridian(fm.sphere(8), tmp_path / "none" / "a.vtu")


@pytest.mark.parametrize(
    ("mesh", "key", "text"),
    [
        ({"file": "torus.vtu", "elements": 4}, "mesh.elements", "known"),
        ({"file": 3}, "mesh.file", "path of a mesh file"),
        ({"file": "torus.vtu", "divisions": 0}, "mesh.divisions", ">= 1"),
        ({"file": "cone.vtu", "first": "glue"}, "mesh.first", "known: axial, clamped"),
        ({"shape": "curve", "points": [[0, 0]]}, "mesh.points", "two or more points"),
        ({"shape": "curve", "points": [[0, 0], [1, "a"]]}, "mesh.points", "points (R, Z)"),
        ({"shape": "curve", "points": [[0, 0], [True, 0]]}, "mesh.points", "of two numbers"),
        ({"shape": "curve", "points": [[0, 0], [1, 0]], "curved": True}, "mesh.points", "an odd number"),
        ({"shape": "curve", "points": [[0, 0], [1, 0]], "curved": 1}, "mesh.curved", "true or false"),
        ({"shape": "curve", "points": [[1, 0], [2, 0], [1, 0]]}, "mesh.points", "three or more cells"),
        ({"shape": "curve", "points": [[1, 0], [2, 0], [2, 1], [2, 0], [3, 0]]}, "mesh.points", "the curve meets itself at (2, 0)"),
    ],
)
def test_bad_scenes(mesh: dict[str, Any], key: str, text: str) -> None:
    with pytest.raises(fm.InputError) as caught:
        fm.Scene.from_dict({"material": {"model": "neo-hookean"}, "mesh": mesh}, MESHES)
    assert caught.value.key == key
    assert text in str(caught.value)


def test_a_curve_is_checked_and_directed_when_it_is_made() -> None:
    """The rules by which a curve runs, one by one."""
    assert fm.Curve(points=[(1, 0), (0, 0.5)]).points[0] == (0.0, 0.5)  # from the pole
    assert fm.Curve(points=[(1, -2), (1, 2)]).points[0] == (1.0, 2.0)  # a tube from the top
    assert fm.Curve(points=[(2, 0), (1, 0.5)]).points[0] == (1.0, 0.5)  # a ring from inside
    assert fm.Curve(points=[(0, -1), (1, 0), (0, 1)]).points[0] == (0.0, 1.0)  # between two poles so that the volume is positive
    ring = fm.Curve(points=[(1, 0), (2, -1), (3, 0), (2, 1), (1, 0)])
    assert ring.points == ((2.0, 1.0), (3.0, 0.0), (2.0, -1.0), (1.0, 0.0), (2.0, 1.0))


@pytest.mark.parametrize("size", [1e300, 1e200, 1e-200, 1e-320, 0.0])
def test_points_whose_squares_are_no_numbers_are_refused(size):
    with pytest.raises(fm.InputError, match=r"mesh\.points"):
        fm.meridian_from_points([(0.0, 0.0), (size, 0.0)])


def test_a_polygon_is_called_one():
    """Straight cells that turn where they meet have a remark, with the largest angle; straight lines and arcs have none."""
    arc = np.linspace(0, np.pi / 2, 9)
    points = [(0.0, 1.0), *((float(np.sin(a)), float(np.cos(a))) for a in arc[1:-1]), (1.0, 0.0)]
    polygon = fm.meridian_from_points(points)
    (note,) = polygon.remarks
    assert note.startswith("a polygon of 8 straight cells, which turns by up to 11 degrees where they meet")  # 90/8 degrees
    assert fm.inflate(fm.Scene(fm.NeoHookean(), polygon), volumes=[2.5]).notes == (f"mesh: {note}",)
    assert fm.meridian_from_points([(0.3, 0.0), (0.6, 0.0), (1.0, 0.0)]).remarks == ()
    assert fm.meridian_from_points(points, [(0, 2, 1), (2, 4, 3), (4, 6, 5), (6, 8, 7)]).remarks == ()
