"""Lines in XDMF files, xdmf.org/index.php/XDMF_Model_and_Format, as dolfinx, meshio and ParaView write them."""

from __future__ import annotations

import math
import stat
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from . import MOST_NUMBERS, Lines, UnreadableError, count, numbers, whole

_KINDS = {("float", 4): "f4", ("float", 8): "f8", ("int", 4): "i4", ("int", 8): "i8", ("uint", 4): "u4", ("uint", 8): "u8"} | {
    (kind, size): f"{letter}{size}" for kind, letter in (("char", "i"), ("uchar", "u")) for size in (1,)
}
#: cells of a mixed topology by their codes, with the number of their points; 0: it follows the code
_SIZES = {1: 0, 2: 0, 3: 0, 4: 3, 5: 4, 6: 4, 7: 5, 8: 6, 9: 8, 0x22: 3, 0x24: 6, 0x25: 8, 0x23: 9, 0x26: 10}
_NAMES = {1: "vertex", 3: "polygon", 4: "triangle", 5: "quad", 6: "tetra", 0x24: "triangle6", 0x25: "quad8", 0x23: "quad9"}


def read(path: Path) -> Lines:
    """The lines of an .xdmf file."""
    data = path.read_bytes()
    if b"<!ENTITY" in data:
        raise UnreadableError("it defines entities, which no mesh needs")
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise UnreadableError(f"it is no XML: {error}") from None
    if root.tag != "Xdmf" or (domain := root.find("Domain")) is None:
        raise UnreadableError("it is no XDMF file: Xdmf and Domain are missing")
    grids = list(_grids(domain))
    if not grids:
        raise UnreadableError("it has no grid")
    lines = Lines(np.zeros((0, 3)))
    read_before: dict[str, tuple[int, int]] = {}
    points, total = [lines.points], 0
    for grid in grids:
        topology, geometry = (_part(root, grid, name) for name in ("Topology", "Geometry"))
        if topology is None or geometry is None:
            continue
        # grids over one set of points, such as a mesh and its parts, share them
        key = ElementTree.tostring(geometry, encoding="unicode").strip()
        if key not in read_before:
            points.append(_points(path, geometry))
            read_before[key] = total, len(points[-1])
            total += len(points[-1])
        first, many = read_before[key]
        own = Lines(lines.points)
        _add_cells(own, path, topology)
        lines.others |= own.others
        name = [grid.get("Name", "")] if len(grids) > 1 and grid.get("Name") else []
        for blocks in own.cells.values():
            for cells, _ in blocks:
                lines.add(np.where(cells < many, cells + first, -1), name)
    lines.points = np.concatenate(points)
    return lines


def _grids(parent: Any) -> Any:
    """Grids with cells; of a series in time the first."""
    for grid in parent.findall("Grid"):
        kind = grid.get("GridType", "Uniform").lower()
        if kind == "uniform":
            yield grid
        else:
            found = list(_grids(grid))
            yield from found[:1] if grid.get("CollectionType", "").lower() == "temporal" else found


def _part(root: Any, grid: Any, name: str) -> Any:
    """The topology or geometry of a grid: its own, or the one of a mesh that it includes from the same file."""
    if (own := grid.find(name)) is not None:
        return own
    for element in grid:
        if element.tag.rpartition("}")[2] == "include":
            if element.get("href"):
                raise UnreadableError("it includes another file, which is not read")
            return next((g.find(name) for g in root.iter("Grid") if g.find(name) is not None), None)
    return None


def _points(path: Path, geometry: Any) -> NDArray[np.float64]:
    kind = (geometry.get("GeometryType") or geometry.get("Type") or "XYZ").upper()
    if kind not in ("XY", "XYZ"):
        raise UnreadableError(f"its geometry is of type {kind[:40]}; XY and XYZ are allowed")
    width = len(kind)
    flat = _item(path, geometry.find("DataItem")).astype(np.float64).ravel()
    if flat.size % width:
        raise UnreadableError("its coordinates are no points")
    points = np.zeros((flat.size // width, 3))
    points[:, :width] = flat.reshape(-1, width)
    return points


def _add_cells(lines: Lines, path: Path, topology: Any) -> None:
    kind = (topology.get("TopologyType") or topology.get("Type") or "").lower()
    if kind == "polyvertex":
        return
    flat = whole(_item(path, topology.find("DataItem")), "points of cells").ravel()
    if kind in ("polyline", "edge_3"):
        size = count(topology.get("NodesPerElement", 3 if kind == "edge_3" else 2), "points of a cell", 10**6)
        if size < 2 or flat.size % size or (kind == "edge_3" and size != 3):
            raise UnreadableError("its lines do not fit the list of their points")
        cells = flat.reshape(-1, size)
        if kind == "edge_3":
            lines.add(cells)
        else:
            for k in range(size - 1):
                lines.add(cells[:, k : k + 2])
    elif kind == "mixed":
        _add_mixed(lines, flat)
    else:
        lines.others.add(kind[:40] or "cells without a kind")


def _add_mixed(lines: Lines, flat: NDArray[np.int64]) -> None:
    pairs, threes, place = [], [], 0
    values = flat.tolist()
    while place < len(values):
        code, size = values[place], _SIZES.get(values[place], -1)
        place += 1
        if size < 0:
            raise UnreadableError(f"its cells have the unknown code {code}")
        if not size:
            size, place = (values[place] if place < len(values) else -1), place + 1
        if size < 1 or place + size > len(values):
            raise UnreadableError("cells do not fit the list of their points")
        cell = values[place : place + size]
        place += size
        if code == 2:
            pairs += [cell[k : k + 2] for k in range(size - 1)]
        elif code == 0x22:
            threes.append(cell)
        else:
            lines.others.add(_NAMES.get(code, f"code {code} of XDMF"))
    for cells in (pairs, threes):
        lines.add(np.array(cells, dtype=np.int64))


def _item(path: Path, item: Any) -> NDArray[Any]:
    """The numbers of a DataItem."""
    if item is None:
        raise UnreadableError("an item with numbers is missing")
    if item.get("Reference") or item.get("ItemType", "Uniform").lower() != "uniform":
        raise UnreadableError("its numbers are given by a reference or a function; items that hold them are allowed")
    shape = [count(n, "numbers") for n in item.get("Dimensions", "").split()]
    size = count(math.prod(shape), "numbers") if shape else None
    form = item.get("Format", "XML").upper()
    kind = _KINDS.get(
        ((item.get("NumberType") or item.get("DataType") or "Float").lower(), int(count(item.get("Precision", 4), "bytes of a number", 8)))
    )
    text = (item.text or "").strip()
    if form == "XML":
        found: NDArray[Any] = numbers(text.split(), "values")
    elif form == "HDF":
        found = _from_hdf5(path, text)
    elif form == "BINARY":
        if kind is None or size is None:
            raise UnreadableError("an item of numbers in a binary file says neither their type nor how many they are")
        order = ">" if item.get("Endian", "").lower() == "big" else "<"
        with _beside(path, text).open("rb") as file:
            file.seek(count(item.get("Seek", 0), "bytes before an array"))
            found = np.frombuffer(file.read(size * np.dtype(kind).itemsize), order + kind)
    else:
        raise UnreadableError(f"an item of numbers is in the format {form[:40]}")
    if size is not None and found.size != size:
        raise UnreadableError(f"an item has {found.size} numbers where {size} are declared")
    return found


def _beside(path: Path, name: str) -> Path:
    """A file in the folder of another, or below."""
    folder = path.resolve().parent
    inside = Path(name)
    if not name or "\0" in name or inside.is_absolute() or not (target := (folder / inside).resolve()).is_relative_to(folder):
        raise UnreadableError(f"its numbers are in {name[:80]!r}; files in its own folder are allowed")
    try:
        regular = stat.S_ISREG(target.stat().st_mode)
    except OSError:
        raise UnreadableError(f"the file {name[:80]!r} beside it, which holds its numbers, is missing") from None
    if not regular:
        raise UnreadableError(f"{name[:80]!r}, which is to hold its numbers, is no plain file")
    return target


def _from_hdf5(path: Path, text: str) -> NDArray[Any]:
    import h5py

    name, _, place = text.rpartition(":")
    with h5py.File(_beside(path, name), "r") as file:
        item: Any = file
        for key in (k for k in place.split("/") if k):
            if not isinstance(item, h5py.Group) or not isinstance(item.get(key, getlink=True), h5py.HardLink):
                raise UnreadableError(f"{name[:80]!r} has no data {place[:80]!r} of its own")
            item = item[key]
        if not isinstance(item, h5py.Dataset) or item.external or item.is_virtual or item.dtype.kind not in "iuf":
            raise UnreadableError(f"{place[:80]!r} in {name[:80]!r} are no numbers of that file")
        if item.size is None or item.size > MOST_NUMBERS:
            raise UnreadableError(f"{place[:80]!r} in {name[:80]!r} are {item.size} numbers, {MOST_NUMBERS} are allowed")
        found: NDArray[Any] = item[()]
        return found
