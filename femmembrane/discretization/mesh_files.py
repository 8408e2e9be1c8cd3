"""Meridians in mesh files.

A file (see :mod:`.dialects`) holds line cells in any order and direction with points (R, Z) as (x, y) where every z is zero, else as (x, z)
where every y is; cells of other kinds, and points that no cell uses, are left out. Lines of one physical group are chosen by its name.
What is read is one curve (:mod:`.curve`).
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, unknown_name
from .curve import Curve, ordered_curve
from .dialects import READERS, Lines, UnreadableError, read_lines
from .meridian import ROUND_OFF, Array, Asked, Meridian
from .supports import Held

#: kinds of files that are written, and read as well, by their suffix; with the format that meshio is to write
FORMATS = {".vtu": "vtu", ".msh": "gmsh", ".vtk": "vtk", ".xdmf": "xdmf"}


def read_meridian(
    path: str | PathLike[str],
    *,
    group: str | int | None = None,
    divisions: int = 1,
    first: Held = "clamped",
    last: Held = "clamped",
    accuracy: Asked | None = None,
) -> Curve:
    """A meridian from a mesh file (.vtu, .msh, .vtk, .xdmf, .vtp, .inp), see :mod:`.dialects`.

    Parameters
    ----------
    path : path
    group : str or int, optional
        The physical group of the meridian: its name, or its number where it has no name. In .msh it is a physical curve, in .inp a set of
        elements, in .xdmf one of several grids. Left out: all lines of the file.
    divisions, first, last, accuracy
        As for :class:`Curve`.

    Returns
    -------
    Curve

    Raises
    ------
    InputError
        When the file cannot be read, or holds no meridian. The message names the cell.
    """
    path = Path(path)
    if path.suffix.lower() not in READERS:
        raise InputError("mesh.file", str(path), "the name of a mesh file is allowed, which ends in " + ", ".join(READERS))
    if not path.is_file():
        raise InputError("mesh.file", str(path), "there is no such file; the path of a mesh file is allowed (from the folder of the scene)")
    if group is not None and (isinstance(group, bool) or not isinstance(group, (str, int))):
        raise InputError("mesh.group", group, "the name of a group of lines is allowed")
    try:
        lines = read_lines(path)
    except UnreadableError as error:
        raise InputError("mesh.file", str(path), f"cannot be read as a mesh: {error}") from None
    except OSError as error:
        raise InputError("mesh.file", str(path), f"cannot be read ({error.strerror or error})") from None
    cells = _chosen(str(path), lines, group)
    try:
        return ordered_curve(*_in_plane(lines.points, cells), divisions=divisions, first=first, last=last, accuracy=accuracy)
    except InputError as error:
        if error.key != "mesh.points":
            raise
        advice = "; [mesh] group chooses one of its groups: " + _listed(lines.groups) if group is None and lines.groups else ""
        raise InputError("mesh.file", str(path), error.allowed + advice) from None


def _chosen(path: str, lines: Lines, group: str | int | None) -> NDArray[np.int64]:
    """The cells of a group, or all."""
    if group is not None and str(group) not in lines.groups:
        if not lines.groups:
            raise InputError("mesh.group", group, "the file has no groups of lines; leave it out")
        raise unknown_name("mesh.group", str(group), lines.groups)
    kinds = {}
    for size, blocks in lines.cells.items():
        chosen = [cells for cells, groups in blocks if group is None or str(group) in groups]
        if chosen:
            kinds[size] = np.concatenate(chosen)
    if len(kinds) != 1:
        found = ", ".join(sorted({2: "line", 3: "line3"}[size] for size in kinds) + sorted(lines.others)) or "none"
        advice = ""
        if not kinds and any(name.startswith(("triangle", "quad", "polygon")) for name in lines.others):
            advice = "; of a surface of revolution save its meridian alone, the curve in which it meets the half plane y = 0, x >= 0"
        elif len(kinds) > 1 and lines.groups:
            advice = "; [mesh] group chooses one of its groups: " + _listed(lines.groups)
        allowed = f"line cells of one kind are allowed, line or line3; cells in the file: {found}{advice}"
        raise InputError("mesh.file", path, allowed)
    return next(iter(kinds.values()))


def _listed(names: set[str]) -> str:
    shown = sorted(names)
    return ", ".join(shown[:20]) + (" and more" if len(shown) > 20 else "")


def _in_plane(points: Array, cells: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """The points that cells use as (R, Z), and the cells by their new numbers."""
    used, inverse = np.unique(cells, return_inverse=True)
    points, cells = points[used], inverse.reshape(cells.shape)
    if points.shape[1] == 2:
        return points, cells
    size = np.nanmax(np.abs(points), initial=0.0)
    flat = np.abs(points).max(axis=0) <= ROUND_OFF * size
    if not (flat[2] or flat[1]) and np.isfinite(points).all():
        what = "points (R, Z, 0) or (R, 0, Z) are allowed: a third coordinate that is not zero is no meridian's"
        raise InputError("mesh.points", "points", what)
    return points[:, [0, 1] if flat[2] or not flat[1] else [0, 2]], cells


def write_meridian(mesh: Meridian, path: str | PathLike[str], *, curved: bool = True) -> None:
    """Write a meridian as a mesh file (.vtu, .msh, .vtk, .xdmf) with a cell for each of its elements.

    Parameters
    ----------
    mesh : Meridian
        Reading the file back gives the same curve to the last bit, if the mesh is a curve from points that is not divided.
    path : path
    curved : bool
        Whether to write cells with a point inside, half-way along s. A curve from points keeps the cells it has.

    Raises
    ------
    InputError
        For another suffix, or a file that cannot be written.
    """
    import meshio

    path = Path(path)
    if path.suffix.lower() not in FORMATS:
        raise InputError("path", str(path), "a name that ends in one of these is allowed: " + ", ".join(FORMATS))
    if isinstance(mesh, Curve) and mesh.divisions == 1:
        curved, points = mesh.curved, np.array(mesh.points)
    else:
        ends = mesh.breakpoints()
        s = ends if not curved else np.append(np.stack([ends[:-1], (ends[:-1] + ends[1:]) / 2], axis=1).ravel(), ends[-1])
        points = np.stack(mesh.position(s), axis=1)
    closed = not mesh.supports()
    step = 2 if curved else 1
    first = np.arange(0, len(points) - 1, step)
    last = first + step
    if closed:
        points, last = points[:-1], last % (len(points) - 1)
    cells = np.stack([first, last, first + 1], axis=1) if curved else np.stack([first, last], axis=1)
    flat = meshio.Mesh(np.column_stack([points, np.zeros(len(points))]), [("line3" if curved else "line", cells)])
    try:
        meshio.write(path, flat, file_format=FORMATS[path.suffix.lower()])
    except OSError as error:
        raise InputError("path", str(path), f"a file in an existing, writable folder is needed ({error.strerror or error})") from error
