"""Membranes with waves around the axis: their surfaces, files for ParaView, and diagrams of their branches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..files import replace_file
from ..quantities import axis_label
from ..results.tipped import TippedBranch, TippedEquilibrium
from .branch_lines import MARKERS
from .picture import Surface, polydata
from .plots import new_figure, save_figure
from .surroundings import Box
from .vtk import Revolution, write_collection

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

#: what the colour of a state with waves shows
COLOR = "wave_size"
_LINE, _GREY = "#d55e00", "#777777"


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
    across, up = branch.column(x), branch.column(y)
    if ax is None:
        _, ax = new_figure((6.4, 4.6), title=branch.scene.title)
        ax.set(xlabel=axis_label(x), ylabel=axis_label(y))
    n = branch[0].waves
    name = label or f"{n} wave{'s' if n > 1 else ''} around the axis"
    if "volume" in branch.scene.analysis.stability:
        stable = branch.column("verdict_volume") == "stable"
        ax.plot(across, up, "--", color=_LINE, linewidth=1.0, label=f"{name}, unstable at a held volume or not known")
        ax.plot(np.where(stable, across, np.nan), up, color=_LINE, linewidth=1.8, label=f"{name}, stable at a held volume")
    else:
        ax.plot(across, up, color=_GREY, linewidth=1.4, label=f"{name}, stability not tested")
    for point in branch.special_points or ():
        marker, named = MARKERS[point.kind]
        place = [getattr(point.equilibrium, q) for q in (x, y)] if "step" not in (x, y) and not (x + y).count("verdict") else None
        if place is not None:
            ax.plot(*place, marker, markersize=7, markerfacecolor="white", markeredgecolor="black", label=named, zorder=4)
    ax.legend(fontsize=8)
    whole = ax.get_figure(root=True)
    if whole is not None:
        save_figure(whole, path)  # type: ignore[arg-type]
    return ax
