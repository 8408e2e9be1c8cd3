"""A branch for other programs: surfaces as VTU, PVD, XDMF, STL and OBJ, meridians as CSV.

=======  ==================================================================  ==========================
suffix   what is in the file                                                 read by
=======  ==================================================================  ==========================
.pvd     all equilibria: a collection of VTU files in a folder beside it     ParaView
.xdmf    all equilibria, the numbers in an HDF5 file beside it               ParaView, VisIt, meshio
.vtu     one equilibrium with stretches and stresses                         ParaView, PyVista, meshio
.stl     one equilibrium as triangles, nothing but its shape                 CAD, printing
.obj     one equilibrium as triangles and quadrilaterals                     Blender and its like
.csv     the deformed meridians with stretches and stresses, of all          anything
         equilibria or of one
=======  ==================================================================  ==========================

Lengths are in units of R0, or in m where the scene has scales; a .csv then has both. Normals point the way the pressure pushes.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np

from ..errors import InputError, unknown_name
from ..files import remove_leftovers, replace_file, write_csv
from ..quantities import in_si, si_values
from .surroundings import place_of
from .vtk import FIELDS, Array, Revolution, shown_length, smooth_profile, surface_data, write_surface, write_vtk

if TYPE_CHECKING:
    from ..results.branch import Branch
    from ..results.equilibrium import Equilibrium

#: codes of XDMF's mixed topology
_TRIANGLE, _QUAD = 4, 5


def export(shown: Branch | Equilibrium, path: str | PathLike[str], *, step: int | None = None) -> list[Path]:
    """Write a branch, or one equilibrium, in the format that the suffix names.

    Parameters
    ----------
    shown : Branch or Equilibrium
    path : path
        Ends in one of ``.pvd``, ``.xdmf``, ``.vtu``, ``.stl``, ``.obj``, ``.csv``.
    step : int, optional
        The equilibrium to write; negative steps count from the end. Default: the last for ``.vtu``, ``.stl`` and ``.obj``, all for
        ``.csv``.

    Returns
    -------
    list of Path
        The files that were written. The last is the file to open.

    Raises
    ------
    InputError
        For an empty branch, another suffix, a step that does not exist, a step for a format that holds all of them, and a file that cannot
        be written.
    """
    suffix = Path(path).suffix.lower()
    check_format(suffix)
    for folder in (Path(path).parent, *([Path(path).with_suffix("")] if suffix == ".pvd" else [])):
        remove_leftovers(folder)
    branch = list(shown) if isinstance(shown, Sequence) else [shown]
    if not branch:
        raise InputError("branch", "no equilibria", "a branch with one or more equilibria is needed")
    place = place_of(step, len(branch))
    if suffix in _OF_ALL:
        if step is not None:
            raise InputError("step", step, f"not allowed with {suffix}, which holds all equilibria; .vtu, .stl and .obj hold one")
        return _OF_ALL[suffix](branch, Path(path))
    if suffix == ".csv":
        numbers = range(len(branch)) if step is None else [place]
        return _write_csv([(k, branch[k]) for k in numbers], Path(path))
    _OF_ONE[suffix](branch[place], Path(path))
    return [Path(path)]


def check_format(suffix: str) -> None:
    """Raise InputError for a suffix, with its dot, that names no format."""
    if suffix not in FORMATS:
        raise unknown_name("format", suffix.lstrip("."), [known.lstrip(".") for known in FORMATS])


def _write_csv(shown: Sequence[tuple[int, Equilibrium]], path: Path) -> list[Path]:
    """One line a node: step, loads, and the profile."""
    names = [name for name in ("r", "rho", "eta", *FIELDS) if name in shown[0][1].profile()]
    scales = shown[0][1].scene.scales
    in_m = [] if scales is None else ["r", "rho", "eta"]
    columns = [*names, *map(in_si, in_m)]

    def rows() -> Iterator[list[Any]]:
        for number, equilibrium in shown:
            profile = dict(equilibrium.profile())
            if scales is not None:
                profile |= si_values({name: profile[name] for name in in_m}, scales)
            for node in zip(*(profile[name].tolist() for name in columns), strict=True):
                yield [number, equilibrium.volume, equilibrium.pressure, *node]

    write_csv(path, ["step", "volume", "pressure", *columns], rows())
    return [path]


def _write_vtu(equilibrium: Equilibrium, path: Path) -> None:
    write_surface(equilibrium, smooth_profile(equilibrium), path)


def _write_stl(equilibrium: Equilibrium, path: Path) -> None:
    import meshio

    points, revolution = _surface(equilibrium)
    halves = [revolution.quads[:, [0, 1, 2]], revolution.quads[:, [0, 2, 3]]]
    mesh = meshio.Mesh(points, [("triangle", np.concatenate([revolution.triangles, *halves]))])
    with replace_file(path) as temporary:
        mesh.write(temporary, file_format="stl", binary=True)


def _write_obj(equilibrium: Equilibrium, path: Path) -> None:
    # meshio writes the time of day into the file, so that the same run would not give the same bytes
    points, revolution = _surface(equilibrium)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    lines += [
        "f " + " ".join(str(point + 1) for point in cell) for cells in (revolution.triangles, revolution.quads) for cell in cells.tolist()
    ]
    with replace_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _surface(equilibrium: Equilibrium) -> tuple[Array, Revolution]:
    profile = smooth_profile(equilibrium)
    revolution = Revolution.of_membrane(equilibrium, profile["r"])
    return shown_length(equilibrium) * revolution.vectors(profile["rho"], profile["eta"]), revolution


def _write_pvd(branch: Sequence[Equilibrium], path: Path) -> list[Path]:
    return write_vtk(branch, path)


def _write_xdmf(branch: Sequence[Equilibrium], path: Path) -> list[Path]:
    """A collection in time, one grid an equilibrium: common cells, own points and point data.

    The writer of meshio has the points of one mesh for all times, and puts its HDF5 file into the working directory.
    """
    import h5py

    numbers, grids = path.with_suffix(".h5"), []
    image = io.BytesIO()  # HDF5 itself does not survive a full disk
    with h5py.File(image, "w") as file:
        revolution = Revolution.of_membrane(branch[0], smooth_profile(branch[0])["r"])
        mixed = [
            np.insert(cells, 0, code, axis=1).ravel() for code, cells in ((_TRIANGLE, revolution.triangles), (_QUAD, revolution.quads))
        ]
        file["cells"] = np.concatenate(mixed)
        count = len(revolution.triangles) + len(revolution.quads)
        topology = f'<Topology TopologyType="Mixed" NumberOfElements="{count}">{_item(numbers, file, "cells")}</Topology>'
        for step, equilibrium in enumerate(branch):
            profile = smooth_profile(equilibrium)
            points = shown_length(equilibrium) * revolution.vectors(profile["rho"], profile["eta"])
            data = {"points": points, **surface_data(equilibrium, profile, revolution)}
            for name, values in data.items():
                file.create_dataset(f"{step}/{name}", data=values, compression="gzip", compression_opts=1, shuffle=True)
            grids.append(_grid(numbers, file, f"{step}", topology, data, in_time=len(branch) > 1))
    with replace_file(numbers) as temporary:
        temporary.write_bytes(image.getvalue())
    head, foot = '<?xml version="1.0"?>\n<Xdmf Version="3.0"><Domain>\n', "\n</Domain></Xdmf>\n"
    text = grids[0]
    if len(grids) > 1:  # meshio reads one grid as a mesh, several as its TimeSeriesReader
        text = '<Grid Name="steps" GridType="Collection" CollectionType="Temporal">\n' + "\n".join(grids) + "\n</Grid>"
    with replace_file(path) as temporary:
        temporary.write_text(head + text + foot, encoding="utf-8")
    return [numbers, path]


def _grid(numbers: Path, file: Mapping[str, Array], step: str, topology: str, data: Mapping[str, Array], in_time: bool) -> str:
    parts = [topology, f'<Geometry GeometryType="XYZ">{_item(numbers, file, f"{step}/points")}</Geometry>']
    for name, values in data.items():
        if name != "points":
            kind = "Vector" if values.ndim > 1 else "Scalar"
            item = _item(numbers, file, f"{step}/{name}")
            parts.append(f'<Attribute Name={quoteattr(name)} AttributeType="{kind}" Center="Node">{item}</Attribute>')
    time = f'<Time Value="{step}"/>\n' if in_time else ""
    return f'<Grid Name="step {step}" GridType="Uniform">{time}' + "\n".join(parts) + "\n</Grid>"


def _item(numbers: Path, file: Mapping[str, Array], name: str) -> str:
    values = file[name]
    kind = "Float" if values.dtype.kind == "f" else "Int"
    size = " ".join(str(length) for length in values.shape)
    text = f"{numbers.name}:/{name}".replace("&", "&amp;").replace("<", "&lt;")
    return f'<DataItem Format="HDF" NumberType="{kind}" Precision="{values.dtype.itemsize}" Dimensions="{size}">{text}</DataItem>'


_OF_ALL: dict[str, Callable[[Sequence[Equilibrium], Path], list[Path]]] = {".pvd": _write_pvd, ".xdmf": _write_xdmf}
_OF_ONE: dict[str, Callable[[Equilibrium, Path], None]] = {".vtu": _write_vtu, ".stl": _write_stl, ".obj": _write_obj}
#: suffixes of all formats
FORMATS = (*_OF_ALL, *_OF_ONE, ".csv")
