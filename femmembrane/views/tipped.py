"""Membranes with waves around the axis: their surfaces, files for ParaView, and diagrams of their branches."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..files import replace_file
from ..quantities import axis_label
from ..results.tipped import TippedBranch, TippedEquilibrium
from .branch_lines import MARKERS
from .plots import new_figure, save_figure
from .vtk import Revolution, write_collection

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

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
    column = np.mod(np.rint(np.arctan2(revolution.sine, revolution.cosine) / (2 * np.pi) * sectors).astype(int), sectors)
    points = np.stack([found[name][revolution.node, column] for name in ("x", "y", "z")], axis=1)
    cells = [(kind, c) for kind, c in (("triangle", revolution.triangles), ("quad", revolution.quads)) if len(c)]
    loads = {"pressure": equilibrium.pressure, "volume": equilibrium.volume}
    data = {"displacement": points - revolution.vectors(R, Z)}
    mesh = meshio.Mesh(points, cells, point_data=data, cell_data={n: [np.full(len(c), v) for _, c in cells] for n, v in loads.items()})
    with replace_file(file) as temporary:
        mesh.write(temporary, file_format="vtu")


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
