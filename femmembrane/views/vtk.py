"""The deformed membrane as a surface of revolution, and as VTU files for ParaView.

A meridian of n nodes is turned about the axis in equal sectors. Points are numbered ring by ring, a node on the axis being one point::

              o  pole (one point)          triangles around the pole, quadrilaterals elsewhere; their normals point
             /|\\                           the way the pressure pushes (up where the membrane is flat)
            o-o-o  ring of node 1
           /  |  \\                         line: the meridian itself, at angle 0
          o---o---o  ring of node 2
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from ..discretization.meridian import LEAST_LENGTH
from ..errors import InputError
from ..files import refuse_no_folder, replace_file
from ..quantities import PROFILE, in_si, quantity, si_values
from ..results.analyses import asked

if TYPE_CHECKING:
    from ..results.equilibrium import Equilibrium

Array = NDArray[np.float64]
_Number = TypeVar("_Number", np.float64, np.int32)

#: profile quantities that a file shows as point data, in this order; those in SI units only when the scene has scales,
#: and the electric field only when it has electrodes
FIELDS = (*PROFILE, *(in_si(name) for name in PROFILE if quantity(name).si), "electric_field", in_si("electric_field"))
SECTORS = 48


@dataclass(frozen=True)
class Revolution:
    """How a meridian becomes a surface.

    Attributes
    ----------
    node : ndarray of int, shape (n_points,)
        Node of the meridian that each point comes from.
    cosine, sine : ndarray, shape (n_points,)
        Of the angle of each point.
    triangles, quads, line : ndarray of int32, shape (n_cells, 3), (n_cells, 4), (n_cells, 2)
    """

    node: NDArray[np.int64]
    cosine: Array
    sine: Array
    triangles: NDArray[np.int32]
    quads: NDArray[np.int32]
    line: NDArray[np.int32]

    @classmethod
    def of(cls, r: Array, sectors: int = SECTORS, closed: bool = False, side: int = 1) -> Revolution:
        """Revolve nodes at the reference radii r; a node with r = 0 lies on the axis, and the last one of a closed curve is the first.

        With ``side`` = -1 the inside is on the left of the meridian (:func:`~femmembrane.discretization.meridian.side`).
        """
        copies = np.where(r > LEAST_LENGTH * np.max(r), sectors, 1)
        if closed:
            copies[-1] = 0
        first = np.cumsum(copies) - copies
        turn = np.arange(sectors)
        point = first[:, None] + np.where(copies[:, None] == 1, 0, turn)
        if closed:
            point[-1] = point[0]
        a, b = point[:-1], point[1:]
        cells = np.stack([a, b, np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)], axis=2).reshape(-1, 4).astype(np.int32)
        inner, outer = cells[:, 0] == cells[:, 3], cells[:, 1] == cells[:, 2]
        angle = 2 * np.pi * np.concatenate([turn[:n] for n in copies]) / sectors
        triangles = np.concatenate([cells[inner & ~outer][:, :3], cells[outer & ~inner][:, [0, 1, 3]]])
        quads = cells[~inner & ~outer]
        if side < 0:
            triangles, quads = triangles[:, ::-1], quads[:, ::-1]
        return cls(
            node=np.repeat(np.arange(r.size), copies),
            cosine=np.cos(angle),
            sine=np.sin(angle),
            triangles=triangles,
            quads=quads,
            line=np.stack([point[:-1, 0], point[1:, 0]], axis=1).astype(np.int32),
        )

    @classmethod
    def of_membrane(cls, equilibrium: Equilibrium, r: Array, sectors: int = SECTORS) -> Revolution:
        """Revolve nodes of a membrane, so that the normals point the way the pressure pushes."""
        space = equilibrium.potential.space
        return cls.of(r, sectors, space.closed, space.side)

    def vectors(self, radial: Array, vertical: Array) -> Array:
        """Vectors (or positions) at the points from their components at the nodes, shape (n_points, 3)."""
        radial = radial[self.node]
        return np.stack([radial * self.cosine, radial * self.sine, vertical[self.node]], axis=1)

    def scalars(self, values: NDArray[_Number]) -> NDArray[_Number]:
        """Values at the points from values at the nodes."""
        return values[self.node]


def write_vtk(branch: Sequence[Equilibrium], path: str | PathLike[str]) -> list[Path]:
    """Write one VTU file an equilibrium and the PVD file that strings them together for ParaView.

    The VTU files go to a folder beside ``path``, named like it. Time is the step number; volume and pressure are cell data. When the
    scene asks for wrinkling, ``zone`` is 0 at taut points, 1, 2, 3 where wrinkles run along meridians, along circles, both ways.
    VTU files of a longer branch written to the same place before are removed.

    Returns
    -------
    list of Path
        The VTU files and, last, the PVD file.

    Raises
    ------
    InputError
        When the name does not end in ``.pvd`` or the folder cannot be written to.
    """
    return write_collection(path, len(branch), lambda step, file: write_surface(branch[step], smooth_profile(branch[step]), file))


def write_collection(path: str | PathLike[str], count: int, write_one: Callable[[int, Path], None]) -> list[Path]:
    """Write numbered VTU files to a folder beside a PVD file, and the PVD file last. Files of an earlier, longer collection are removed.

    Raises
    ------
    InputError
        When the name does not end in ``.pvd`` or the folder cannot be written to.
    """
    path = Path(path)
    if path.suffix != ".pvd":
        raise InputError("path", str(path), "a name that ends in .pvd is needed; the surfaces go to a folder beside it")
    files = [_surface_file(path, number) for number in range(count)]
    refuse_no_folder(path.with_suffix(""))
    if files:
        _make_folder(files[0].parent)
    for number, file in enumerate(files):
        write_one(number, file)
    remove_surfaces(path, keep=len(files))
    with replace_file(path) as temporary:
        temporary.write_text(_collection(path, files), encoding="utf-8")
    return [*files, path]


def remove_surfaces(path: Path, keep: int = 0) -> None:
    """Remove the VTU files that belong to a PVD file, except the first few."""
    folder = path.with_suffix("")
    if folder.is_symlink():  # whatever is there belongs to somebody else
        return
    for file in folder.glob("*.vtu"):
        number = re.fullmatch(re.escape(path.stem) + r"_(\d{4,})\.vtu", file.name)
        if number and int(number[1]) >= keep:
            file.unlink()


def spread(equilibrium: Equilibrium, count: int) -> Array:
    """So many places along the meridian, spread like its nodes, so that layers show: for any number of nodes."""
    nodes = equilibrium.potential.space.node_parameters()
    return np.interp(np.linspace(0, nodes.size - 1, count), np.arange(nodes.size), nodes)


def smooth_profile(equilibrium: Equilibrium, points: int = 0, most: int | None = None) -> dict[str, Array]:
    """The profile at the nodes. A value that is not defined on the axis (0/0) is taken from the node beside it.

    With fewer nodes than ``points`` it is taken at that many places instead, so that the curvature of long elements shows; with more than
    ``most``, at ``most`` places that are spread like the nodes.
    """
    found = equilibrium.profile()
    if most is not None and found["r"].size > most:
        found = equilibrium.profile(spread(equilibrium, most))
    if found["r"].size < points:
        s = equilibrium.potential.space.node_parameters()
        found = equilibrium.profile(np.linspace(s[0], s[-1], points))
    return finite_at_ends(found)


def finite_at_ends(found: Mapping[str, Array]) -> dict[str, Array]:
    """A profile in which a value that is not defined on the axis (0/0) is that of the place beside it."""
    profile = {key: np.array(values, dtype=np.float64) for key, values in found.items()}
    for values in profile.values():
        for end, beside in ((0, 1), (-1, -2)):
            if values.size > 1 and not np.isfinite(values[end]):
                values[end] = values[beside]
    return profile


def shown_length(equilibrium: Equilibrium) -> float:
    """Length of R0 in a file: 1, or its length in m where the scene has scales."""
    scales = equilibrium.scene.scales
    return 1.0 if scales is None else scales.to_si("length", 1.0)


def write_surface(equilibrium: Equilibrium, profile: Mapping[str, Array], file: Path) -> None:
    """Write the surface of one equilibrium as a VTU file."""
    import meshio

    revolution = Revolution.of_membrane(equilibrium, profile["r"])
    cells = [(kind, c) for kind, c in (("triangle", revolution.triangles), ("quad", revolution.quads), ("line", revolution.line)) if len(c)]
    loads = {"pressure": equilibrium.pressure, "volume": equilibrium.volume}
    if (scales := equilibrium.scene.scales) is not None:
        loads |= si_values(loads, scales)
    mesh = meshio.Mesh(
        shown_length(equilibrium) * revolution.vectors(profile["rho"], profile["eta"]),
        cells,
        point_data=surface_data(equilibrium, profile, revolution),
        cell_data={name: [np.full(len(c), load) for _, c in cells] for name, load in loads.items()},
    )
    with replace_file(file) as temporary:
        mesh.write(temporary, file_format="vtu")


def surface_data(equilibrium: Equilibrium, profile: Mapping[str, Array], revolution: Revolution) -> dict[str, NDArray[Any]]:
    """Point data of a surface: displacement, stretches and stresses, and the zone if the scene asks for wrinkling."""
    parameters = equilibrium.potential.space.node_parameters()
    R, Z = equilibrium.scene.mesh.position(parameters)
    moved = revolution.vectors(profile["rho"] - R, profile["eta"] - Z)
    data: dict[str, NDArray[Any]] = {"displacement": shown_length(equilibrium) * moved}
    data |= {name: revolution.scalars(profile[name]) for name in FIELDS if name in profile}
    for analysis in asked(equilibrium.scene):
        data |= {name: revolution.scalars(values) for name, values in analysis.at_nodes(equilibrium).items()}
    return data


def _surface_file(path: Path, step: int) -> Path:
    return path.with_suffix("") / f"{path.stem}_{step:04d}.vtu"


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError("path", str(folder), f"an existing, writable folder around it is needed ({error.strerror})") from error


def _collection(path: Path, files: list[Path]) -> str:
    names = [quoteattr(file.relative_to(path.parent).as_posix()) for file in files]
    entries = "".join(f'    <DataSet timestep="{step}" part="0" file={name}/>\n' for step, name in enumerate(names))
    return f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n{entries}  </Collection>\n</VTKFile>\n'
