"""Lines in mesh files as other programs write them.

========================  ==========================================================================================================
suffix                    what is read
========================  ==========================================================================================================
.vtu, .vtp                VTK's XML: lines, polylines, parabolas; ascii, base64 or raw; plain, or packed by zlib, lzma or lz4
.vtk                      VTK's older format, ascii or binary: unstructured grids and PolyData, as of version 5 and before
.msh                      Gmsh 2.2, 4.0 and 4.1, ascii or binary, with physical groups
.xdmf                     XDMF 2 and 3 with numbers in the file, in HDF5 or in binary files beside it; of a time series the first step
.inp                      Abaqus: nodes, line elements and sets of elements
========================  ==========================================================================================================

Files may come from any program. They are read by code of this package, in Python, for two reasons: a damaged file can end no process, and
nothing is unpacked before it is known to fit (:data:`MOST_NUMBERS`). The readers for whole meshes that exist promise neither. A reader
answers with :class:`Lines` or raises :class:`UnreadableError` with a reason; what else it meets in a damaged file is caught by
:func:`read_lines`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: sizes beyond which a file is refused: of the file itself in bytes, and of any list of numbers in it
MOST_BYTES, MOST_NUMBERS = 2**28, 2 * 10**7
#: readers by suffix: a module here with a function ``read(path)``
READERS = {".vtu": "vtk_xml", ".msh": "gmsh", ".vtk": "vtk_legacy", ".xdmf": "xdmf", ".vtp": "vtk_xml", ".inp": "abaqus"}


class UnreadableError(Exception):
    """Why a file cannot be read."""

    def __init__(self, reason: str) -> None:
        super().__init__(printable(reason))


def printable(text: str) -> str:
    """A text from a file without control characters, which could move the cursor of a terminal, or worse."""
    return "".join(c if c.isprintable() else "?" for c in text)


@dataclass
class Lines:
    """Line cells of a mesh file.

    Attributes
    ----------
    points : ndarray, shape (n, 2 or 3)
    cells : dict of int to list of (ndarray of int, frozenset of str)
        By the number of points of a cell, 2 or 3, the ends before the point inside: blocks of cells with the groups they belong to.
    others : set of str
        Kinds of cells that are no lines.
    groups : set of str
        Names (of those without one: numbers) of all groups of lines.
    """

    points: Array
    cells: dict[int, list[tuple[NDArray[np.int64], frozenset[str]]]] = field(default_factory=dict)
    others: set[str] = field(default_factory=set)
    groups: set[str] = field(default_factory=set)

    def add(self, cells: Any, groups: Iterable[str] = ()) -> None:
        """Add cells of two or three points each."""
        block = np.asarray(cells, dtype=np.int64)
        if not block.size:
            return
        names = frozenset(printable(name) for name in groups)
        self.cells.setdefault(block.shape[1], []).append((block, names))
        self.groups |= names

    def add_polyline(self, points: NDArray[Any], groups: Iterable[str] = ()) -> None:
        """Add the cells of a polyline."""
        self.add(np.stack([points[:-1], points[1:]], axis=1), groups)


def read_lines(path: Path) -> Lines:
    """The lines of a mesh file.

    Raises
    ------
    UnreadableError
        With a reason in words.
    """
    size = path.stat().st_size
    if size > MOST_BYTES:
        raise UnreadableError(f"the file has {size} bytes, {MOST_BYTES} are allowed")
    read: Callable[[Path], Lines] = import_module(f".{READERS[path.suffix.lower()]}", __name__).read
    try:
        with np.errstate(all="ignore"):
            lines = read(path)
        _check(lines)
        return lines
    except UnreadableError:
        raise
    except Exception as error:  # a damaged file contradicts itself in more ways than can be foreseen
        reason = " ".join(str(error).split())
        raise UnreadableError(f"it is damaged, or no such file: {reason[:120] or type(error).__name__}") from None


def _check(lines: Lines) -> None:
    if lines.points.ndim != 2 or lines.points.shape[1] not in (2, 3):
        raise UnreadableError("points of two or three coordinates are allowed")
    for blocks in lines.cells.values():
        for cells, _ in blocks:
            if cells.min() < 0 or cells.max() >= len(lines.points):
                raise UnreadableError("a line has a point that is not in the file")


def count(value: Any, what: str, most: int = MOST_NUMBERS) -> int:
    """A number of things, declared in a file; UnreadableError if it is no number or too large."""
    try:
        number = int(value)
    except (TypeError, ValueError, OverflowError):
        raise UnreadableError(f"the number of {what} is missing") from None
    if not 0 <= number <= most:
        raise UnreadableError(f"it declares {number} {what}, 0 to {most} are allowed")
    return number


def numbers(words: Any, what: str) -> Array:
    """Numbers from their texts."""
    try:
        return np.array(words, dtype=np.float64)
    except ValueError:
        raise UnreadableError(f"{what} are no numbers") from None


def whole(values: Any, what: str) -> NDArray[np.int64]:
    """Numbers as whole ones."""
    array = np.asarray(values)
    if array.dtype.kind == "f" and not (np.isfinite(array).all() and (np.abs(array) < 2**53).all() and (array == np.floor(array)).all()):
        raise UnreadableError(f"{what} are no whole numbers")
    return array.astype(np.int64)


def runs(connectivity: Any, offsets: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Points of cells one after the other, and where each cell starts, from the places where they end."""
    points, ends = whole(connectivity, "points of cells"), whole(offsets, "ends of cells")
    starts = np.concatenate([[0], ends])
    if (np.diff(starts) < 0).any() or starts[-1] != len(points):
        raise UnreadableError("cells do not fit the list of their points")
    return points, starts
