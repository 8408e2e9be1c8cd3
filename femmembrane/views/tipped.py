"""Membranes with waves around the axis: their surfaces, files for ParaView, and diagrams of their branches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import unknown_name
from ..files import replace_file
from ..quantities import PLACES, axis_label
from ..results.curve import slopes_of
from ..results.tipped import TippedBranch, TippedEquilibrium, TippedPoint
from ..solve.between import cubic
from .branch_lines import MARKERS
from .picture import Surface, polydata
from .plots import new_figure, save_figure
from .surroundings import Box
from .vtk import Revolution, write_collection
from .zones import new_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

#: what the colour of a state with waves shows
COLOR = "wave_size"
_LINE, _GREY = "#d55e00", "#777777"
#: words and look of a line by its verdict at a held volume: stable, not stable, not asked for
_LOOKS: dict[bool | None, tuple[str, dict[str, Any]]] = {
    True: ("stable at a held volume", {"color": _LINE, "linewidth": 1.8}),
    False: ("unstable at a held volume or not known", {"color": _LINE, "linewidth": 1.0, "linestyle": "--"}),
    None: ("stability not tested", {"color": _GREY, "linewidth": 1.4}),
}
#: columns that are drawn along cubics, and those of them that change their sign with the direction in which the membrane leans
_SMOOTH = (*PLACES, "amplitude", "shift", "energy", "elastic_energy", "magnetic_energy", "load_energy", "electric_energy")
_ODD = ("amplitude", "shift")
#: corners of the line between two points of the branch
_CORNERS = 24


def surface_at(equilibrium: TippedEquilibrium, angles: Array) -> dict[str, Array]:
    """theta, x, y, z at the nodes of the meridian and at angles, each of shape (n_nodes, n_angles)."""
    moved, (R, Z) = equilibrium.tipped.shape(equilibrium.state, angles)
    radial, around, height = R[:, None] + moved[0], moved[1], Z[:, None] + moved[2]
    cos, sin = np.cos(angles), np.sin(angles)
    theta = np.broadcast_to(angles, radial.shape)
    return {"theta": theta, "x": radial * cos - around * sin, "y": radial * sin + around * cos, "z": height}


def write_tipped_vtk(branch: Sequence[TippedEquilibrium], path: str | PathLike[str]) -> list[Path]:
    """Write one VTU file for each equilibrium and the PVD file that strings them together; see :meth:`.TippedBranch.to_vtk`."""
    return write_collection(path, len(branch), lambda step, file: _write_surface(branch[step], file))


def _write_surface(equilibrium: TippedEquilibrium, file: Path, sectors: int = 96) -> None:
    import meshio

    space = equilibrium.potential.space
    R, Z = space.mesh.position(space.node_parameters())
    revolution = Revolution.of(R, sectors, space.closed, space.side)
    found = equilibrium.surface(sectors)
    points = np.stack([found[name][revolution.node, _columns(revolution, sectors)] for name in ("x", "y", "z")], axis=1)
    cells = [(kind, c) for kind, c in (("triangle", revolution.triangles), ("quad", revolution.quads)) if len(c)]
    loads = {"pressure": equilibrium.pressure, "volume": equilibrium.volume}
    data = {"displacement": points - revolution.vectors(R, Z)}
    mesh = meshio.Mesh(points, cells, point_data=data, cell_data={n: [np.full(len(c), v) for _, c in cells] for n, v in loads.items()})
    with replace_file(file) as temporary:
        mesh.write(temporary, file_format="vtu")


@dataclass(frozen=True, eq=False)
class WavySurface(Surface):
    """A state with waves around the axis as a surface; its colour shows how far they move each point.

    Attributes
    ----------
    places : ndarray, shape (n_points, 3)
    """

    places: Array = field(default_factory=lambda: np.zeros((0, 3)))

    @classmethod
    def of_tipped(cls, equilibrium: TippedEquilibrium, sectors: int) -> WavySurface:
        """The surface at the nodes of the meridian and so many angles."""
        space = equilibrium.potential.space
        R, _ = space.mesh.position(space.node_parameters())
        found, revolution = equilibrium.surface(sectors), Revolution.of(R, sectors, space.closed, space.side)
        moved = equilibrium.tipped.shape(equilibrium.state, 2 * np.pi * np.arange(sectors) / sectors)[0]
        waves = np.sqrt(((moved - moved.mean(axis=2, keepdims=True)) ** 2).sum(axis=0))
        at = revolution.node, _columns(revolution, sectors)
        places = np.stack([found[name][at] for name in ("x", "y", "z")], axis=1)
        rho = np.hypot(found["x"], found["y"]).max(axis=1)
        return cls(equilibrium, COLOR, rho, found["z"].mean(axis=1), revolution, waves[at], places)  # type: ignore[arg-type]

    @property
    def points(self) -> Array:
        return self.places

    @property
    def scalars(self) -> Array:
        return self.values

    @property
    def range(self) -> tuple[float, float]:
        """From 0 to the largest value, apart by as much as is worth a colour."""
        return 0.0, max(float(self.values.max()), 1e-6 * float(self.rho.max()))

    @property
    def circles(self) -> list[tuple[int, float]]:
        """Only where the membrane is held on circles: others are none."""
        return []

    @property
    def normals(self) -> Array:
        mesh = polydata(self.revolution, self.places)
        found = mesh.compute_normals(cell_normals=False, split_vertices=False, consistent_normals=False, auto_orient_normals=False)
        return np.asarray(found.point_data["Normals"], dtype=np.float64)

    @property
    def box(self) -> Box:
        return Box(float(self.rho.max()), float(self.places[:, 2].min()), float(self.places[:, 2].max()))


def _columns(revolution: Revolution, sectors: int) -> NDArray[np.int64]:
    """Number of the angle of each point."""
    turns = np.rint(np.arctan2(revolution.sine, revolution.cosine) / (2 * np.pi) * sectors)
    return np.mod(turns.astype(np.int64), sectors)


def plot_tipped(branch: TippedBranch, path: str | PathLike[str] | None, ax: Axes | None, x: str, y: str, label: str) -> Any:
    """One column of a branch with waves against another; see :meth:`.TippedBranch.plot`."""
    points = _points(branch)
    lines = _lines(branch, points, (x, y))
    if ax is None:
        _, ax = new_figure((6.4, 4.6), title=branch.scene.title)
        ax.set(xlabel=axis_label(x), ylabel=axis_label(y))
    n = branch[0].waves
    name = label or f"{n} wave{'s' if n > 1 else ''} around the axis"
    for stable, line in lines:
        what, look = _LOOKS[stable]
        ax.plot(*line.T, label=new_label(ax, f"{name}, {what}"), **look)
    for point in branch.special_points or ():
        marker, named = MARKERS[point.kind]
        place = [
            next(row for special, row in zip(points, column, strict=True) if special[1] is point)
            for column in _values(branch, points, (x, y)).T
        ]
        ax.plot(*place, marker, markersize=7, markerfacecolor="white", markeredgecolor="black", label=new_label(ax, named), zorder=4)
    ax.legend(fontsize=8)
    whole = ax.get_figure(root=True)
    if whole is not None:
        save_figure(whole, path)  # type: ignore[arg-type]
    return ax


def _points(branch: TippedBranch) -> list[tuple[int, TippedPoint | None]]:
    """The equilibria by their steps, and the special points between them, each where the way over it is the smallest detour."""
    place = np.array([[getattr(eq, name) for name in PLACES] for eq in branch])
    scale = np.where(np.ptp(place, axis=0) > 0, np.ptp(place, axis=0), 1.0)
    direct = np.linalg.norm(np.diff(place, axis=0) / scale, axis=1)
    found: list[tuple[float, int, TippedPoint | None]] = [(float(step), step, None) for step in range(len(branch))]
    for point in branch.special_points or ():
        ways = np.linalg.norm((place - [getattr(point, name) for name in PLACES]) / scale, axis=1)
        if len(direct):
            k = int(np.argmin(ways[:-1] + ways[1:] - direct))
            found.append((k + ways[k] / max(ways[k] + ways[k + 1], 1e-300), k, point))
    return [(step, point) for _, step, point in sorted(found, key=lambda item: item[0])]


def _values(branch: TippedBranch, points: Sequence[tuple[int, TippedPoint | None]], names: Sequence[str]) -> Array:
    """Columns of the branch at its equilibria and special points, shape (n, len(names))."""
    columns = []
    for name in names:
        column = branch.column(name)
        if column.dtype.kind not in "fiu":
            raise unknown_name("column", name, [known for known in branch.columns if not known.startswith("verdict")])
        between = [step + 0.5 if name == "step" else getattr(point.equilibrium, name) if point else column[step] for step, point in points]
        columns.append(
            np.array([column[step] if point is None else v for (step, point), v in zip(points, between, strict=True)], dtype=float)
        )
    return np.stack(columns, axis=1)


def _lines(branch: TippedBranch, points: Sequence[tuple[int, TippedPoint | None]], names: Sequence[str]) -> list[tuple[bool | None, Array]]:
    """The branch as lines, each with its verdict at a held volume: stable or not; None where that was not asked for.

    Lines follow cubics over an arc length, with the slopes of parabolas through three neighbours. At the onset the membrane may lean to
    either side: the branch goes on to its mirror image, in which volume, pressure and energy are the same.
    """
    ends, place = _values(branch, points, names), _values(branch, points, (*PLACES, "amplitude"))
    scale = np.where(np.ptp(place, axis=0) > 0, np.ptp(place, axis=0), 1.0)
    lengths = np.linalg.norm(np.diff(place, axis=0) / scale, axis=1)
    tested = "volume" in branch.scene.analysis.stability
    words = [None if point else branch[step].verdict("volume").word if tested else "" for step, point in points]
    kinds = [None if not tested else all(word == "stable" for word in pair if word is not None) for pair in pairwise(words)]
    slopes = np.stack(
        [_slopes(values, lengths, name, branch[0].amplitude == 0) for values, name in zip(ends.T, names, strict=True)], axis=1
    )
    found: list[tuple[bool | None, Array]] = []
    for k, kind in enumerate(kinds):
        line = cubic(ends[k], slopes[k], ends[k + 1], slopes[k + 1], np.linspace(0, 1, _CORNERS), lengths[k])
        if any(name not in _SMOOTH for name in names):
            line = ends[k : k + 2]
        if found and found[-1][0] == kind:
            line = np.concatenate([found.pop()[1], line[1:]])
        found.append((kind, line))
    return found


def _slopes(values: Array, lengths: Array, name: str, from_onset: bool) -> Array:
    if not from_onset or len(lengths) < 2:
        return slopes_of(values, lengths)
    mirrored = 2 * values[0] - values[1] if name in _ODD else values[1]
    return slopes_of(np.concatenate([[mirrored], values]), np.concatenate([lengths[:1], lengths]))[1:]
