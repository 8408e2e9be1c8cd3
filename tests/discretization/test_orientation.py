"""Which side of a membrane is inside: the same for a shape and its mirror image, however its meridian runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.discretization.meridian import side
from femmembrane.potential import potential_of

NEO_HOOKEAN = fm.NeoHookean()


def curve(points: Any, **ends: str) -> fm.Curve:
    return fm.meridian_from_points(np.asarray(points, dtype=float), **ends)


def arc(start: float, stop: float, elements: int = 12) -> np.ndarray:
    """Points of a circle of unit radius, from one angle at the upper pole to another."""
    s = np.linspace(start, stop, elements + 1)
    points = np.stack([np.sin(s), np.cos(s)], axis=1)
    points[np.abs(points) < 1e-15] = 0.0
    return points


S = np.linspace(0.0, 1.0, 13)
EGG = np.stack([(1 - 0.2 * np.cos(np.pi * S)) * np.sin(np.pi * S), 1.4 * np.cos(np.pi * S)], axis=1)
BELLOWS = np.stack([1 - 0.1 * np.sin(4 * np.pi * S) ** 2, 2 - 4 * S], axis=1)
DROP = np.stack([3 + np.sin(2 * np.pi * S) * (1 + 0.2 * np.cos(2 * np.pi * S)), np.cos(2 * np.pi * S)], axis=1)
SHARE = np.linspace(0.3, 1.0, 9)
#: points, how the first and last of them are held, and by how much more than at rest the membrane is inflated
SHAPES: dict[str, tuple[np.ndarray, tuple[str, str], float]] = {
    "dome": (arc(0.0, np.pi / 2), ("clamped", "clamped"), 1.5),
    "vessel": (arc(np.pi / 2, np.pi), ("clamped", "clamped"), 1.5),
    "shallow bowl": (arc(0.7 * np.pi, np.pi) - [0.0, np.cos(0.7 * np.pi)], ("clamped", "clamped"), 1.0),
    "cone": (np.stack([SHARE, 0.4 * (1 - SHARE)], axis=1), ("hub", "clamped"), 1.0),
    "cone between walls": (np.stack([SHARE, 0.4 * (1 - SHARE)], axis=1), ("axial", "radial"), 1.0),
    "steep cone": (np.stack([SHARE, 2.0 * (1 - SHARE)], axis=1), ("hub", "clamped"), 1.0),
    "cone of 45 degrees": (np.stack([SHARE, 1 - SHARE], axis=1), ("clamped", "clamped"), 1.0),
    "bellows": (BELLOWS, ("hub", "clamped"), 6.0),
    "tube": (np.stack([np.ones(9), 1.5 - 3 * np.linspace(0, 1, 9)], axis=1), ("free", "clamped"), 4.0),
    "egg": (EGG, ("clamped", "clamped"), 3.0),
    "drop around the axis": (DROP, ("clamped", "clamped"), 30.0),
}


def mirrored(name: str, turned: bool = False) -> tuple[fm.Curve, fm.Curve]:
    """A shape and its mirror image, given in either direction, with the same ends held."""
    points, (first, last), _ = SHAPES[name]
    upright = curve(points, **_ends(points, first, last))
    other = points[::-1] * [1.0, -1.0] if turned else points * [1.0, -1.0]
    return upright, curve(other, **_ends(other, *((last, first) if turned else (first, last))))


def _ends(points: np.ndarray, first: str, last: str) -> dict[str, str]:
    """The words for the ends by the order that a curve brings its points into."""
    kept = np.array_equal(curve(points).points[0], points[0])
    return {"first": first, "last": last} if kept else {"first": last, "last": first}


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_and_its_mirror_image_are_inflated_alike(name: str, turned: bool) -> None:
    """P and V are the same and positive, heights are mirrored; eigenvalues at n = 0 to 2 are the same."""
    found = []
    for mesh in mirrored(name, turned):
        scene = fm.Scene(material=NEO_HOOKEAN, mesh=mesh, degree=2)
        rest = potential_of(scene).space.reference_volume
        assert rest > 0
        found.append(fm.equilibrium(scene, volume=rest + SHAPES[name][2], solver="newton"))
    up, down = found
    assert up.pressure > 0
    assert down.pressure == pytest.approx(up.pressure, rel=1e-9)
    assert down.elastic_energy == pytest.approx(up.elastic_energy, rel=1e-9)
    # the one that nothing holds along the axis is kept at some height
    heights = [np.unique(np.round(eq.profile()["eta"], 9)) for eq in found]
    heights = [eta - (eta[0] + eta[-1]) / 2 for eta in heights]
    assert heights[1] == pytest.approx(-heights[0][::-1], abs=1e-7)
    for question in ({"control": "pressure"}, {"control": "volume"}, {"azimuthal": 1}, {"azimuthal": 2}):
        values = [eq.verdict(**question).smallest_eigenvalue for eq in found]
        assert values[1] == pytest.approx(values[0], rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("name", ["dome", "vessel", "shallow bowl", "cap"])
def test_loads_and_sources_are_mirrored(name: str) -> None:
    """Gravity upwards, and the dipole on the other side: gamma, w and the height of the dipole change their signs, V and P do not."""
    volume = 2.5
    meshes = (fm.cap(0.6, 12), fm.cap(-0.6, 12)) if name == "cap" else mirrored(name)
    found = []
    for mesh, sign in zip(meshes, (1, -1), strict=True):
        loads = [fm.Hydrostatic(0.15 * sign), fm.Weight(0.1 * sign)]
        dipole = [fm.Dipole(20.0, 4.5 * sign)]
        scene = fm.Scene(material=NEO_HOOKEAN, mesh=mesh, degree=3, loads=loads, sources=dipole, susceptibility=1.0)
        found.append(fm.equilibrium(scene, volume=volume, solver="newton"))
    up, down = found
    for quantity in ("pressure", "load_energy", "magnetic_energy", "elastic_energy"):
        assert getattr(down, quantity) == pytest.approx(getattr(up, quantity), rel=1e-8)
    assert down.center_height == pytest.approx(-up.center_height, rel=1e-8)
    assert down.verdict(azimuthal=1).smallest_eigenvalue == pytest.approx(up.verdict(azimuthal=1).smallest_eigenvalue, rel=1e-6)
    stresses = [eq.profile()["total_stress_2"] for eq in found]
    assert stresses[1] == pytest.approx(stresses[0], rel=1e-6, abs=1e-7)


def _pull_of_the_rim(eq: fm.Equilibrium) -> float:
    """Force along the axis with which the rim holds the membrane up, 2 pi W_1 (eta'/lambda_1) R at the last point."""
    space = eq.potential.space
    s = space.ends[[-1]]
    u_s, w_s = space.recovered_slopes(eq.state, space.node_parameters())
    (R_s, Z_s), R = space.mesh.tangent(s), space.mesh.position(s)[0]
    along, up = R_s[0] + u_s[-1], Z_s[0] + w_s[-1]
    end = {name: values[-1] for name, values in eq.profile().items()}
    return float(2 * np.pi * R[0] * end["mechanical_stress_1"] / end["stretch_1"] * up / np.hypot(along, up))


@pytest.mark.parametrize("height", [0.8, -0.8])
def test_a_liquid_is_heavy_in_a_dome_and_in_a_bowl(height: float) -> None:
    """Balance along the axis: a rim holds a bowl with pi P + gamma V, and holds a dome down with pi P - gamma V; the pole sinks."""
    scene = fm.Scene(material=NEO_HOOKEAN, mesh=fm.cap(height, 24), degree=4)
    gamma, plain = 0.3, fm.equilibrium(scene, volume=3.0)
    eq = fm.equilibrium(scene.replace(loads=[fm.Hydrostatic(gamma)]), volume=3.0)
    assert eq.center_height < plain.center_height
    expected = -np.pi * eq.pressure + gamma * eq.volume if height > 0 else np.pi * eq.pressure + gamma * eq.volume
    assert _pull_of_the_rim(eq) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("noise", [0.0, 1e-17, -1e-17, 1e-9, -1e-9])
def test_of_a_flat_shape_inside_is_below_whatever_round_off_says(noise: float) -> None:
    """A disc and a ring from points that are not quite in a plane; beyond round-off the shape decides."""
    for r in (np.linspace(0, 1, 9), np.linspace(0.3, 1, 9)):
        mesh = curve(np.stack([r, noise * (1 - r)], axis=1))
        assert side(mesh) == 1
    assert side(curve(np.stack([r, -1e-4 * (1 - r)], axis=1))) == -1
    assert (side(fm.cap(-1e-9)), side(fm.cap(-1e-3)), side(fm.cap(1e-3)), side(fm.disc(4))) == (1, -1, 1, 1)


@pytest.mark.parametrize("height", [0.7, -0.7])
def test_surfaces_face_the_way_the_pressure_pushes(height: float, tmp_path: Path) -> None:
    """The divergence theorem over the triangles of an exported surface gives V, and not -V."""
    import meshio

    eq = fm.equilibrium(fm.Scene(material=NEO_HOOKEAN, mesh=fm.cap(height, 12)), volume=2.0)
    fm.export(eq, tmp_path / "a.stl")
    mesh = meshio.read(tmp_path / "a.stl")
    a, b, c = (mesh.points[mesh.cells_dict["triangle"][:, k]].astype(float) for k in range(3))
    assert float((np.cross(b - a, c - a)[:, 2] / 2 * (a + b + c)[:, 2] / 3).sum()) == pytest.approx(2.0, rel=2e-2)


def test_results_of_other_signs_are_refused(tmp_path: Path) -> None:
    """Files of versions that counted a bowl as negative lack the attribute that says how volumes count."""
    for height, refused in ((-0.5, True), (0.5, False)):
        branch = fm.inflate(fm.Scene(material=NEO_HOOKEAN, mesh=fm.cap(height, 8)), volumes=[1.5])
        branch.save(tmp_path / "a.nc")
        assert fm.load(tmp_path / "a.nc")[0].volume == branch[0].volume
        old = branch.to_xarray()
        del old.attrs["inside"]
        old.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
        if refused:
            with pytest.raises(fm.InputError, match="whose inside is above it as negative"):
                fm.load(tmp_path / "a.nc")
        else:
            assert fm.load(tmp_path / "a.nc")[0].volume == branch[0].volume
