"""Lines in VTK's older files (.vtk), docs.vtk.org, "Simple Legacy Formats", of versions up to 5.1."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import Lines, UnreadableError, count, numbers
from .cells import add_polylines, add_vtk_cells

_TYPES = {
    "bit": "u1",
    "char": "i1",
    "unsigned_char": "u1",
    "vtktypeint8": "i1",
    "vtktypeuint8": "u1",
    "short": "i2",
    "unsigned_short": "u2",
    "int": "i4",
    "vtktypeint32": "i4",
    "vtktypeuint32": "u4",
    "unsigned_int": "u4",
    "long": "i8",
    "unsigned_long": "u8",
    "vtkidtype": "i8",
    "vtktypeint64": "i8",
    "vtktypeuint64": "u8",
    "float": "f4",
    "double": "f8",
}
_OTHERS = {"VERTICES": "vertex", "POLYGONS": "polygon", "TRIANGLE_STRIPS": "triangle"}


def read(path: Path) -> Lines:
    """The lines of a .vtk file."""
    data = path.read_bytes()
    head = re.match(rb"# vtk DataFile Version (\d+)\.(\d+)[^\n]*\n[^\n]*\n\s*(ASCII|BINARY)\s+", data)
    if head is None:
        raise UnreadableError("it is no VTK file: the first line, a title and ASCII or BINARY are missing")
    return _Reader(data, head.end(), head[3] == b"BINARY", int(head[1]) >= 5).lines()


class _Reader:
    def __init__(self, data: bytes, place: int, binary: bool, offsets: bool) -> None:
        self.data, self.place, self.binary, self.offsets = data, place, binary, offsets
        self.points: NDArray[np.float64] | None = None
        self.cells: tuple[Any, Any] | None = None
        self.kinds: Any = None
        self.polylines: list[tuple[Any, Any]] = []
        self.others: set[str] = set()

    def lines(self) -> Lines:
        if self._word() != "DATASET":
            raise UnreadableError("the word DATASET is missing")
        kind = self._word()
        if kind not in ("UNSTRUCTURED_GRID", "POLYDATA"):
            raise UnreadableError(f"it holds {kind[:40]}; UNSTRUCTURED_GRID and POLYDATA are allowed")
        while (word := self._word()) not in ("", "CELL_DATA", "POINT_DATA"):
            self._section(word)
        if self.points is None:
            raise UnreadableError("its points are missing")
        lines = Lines(self.points, others=self.others)
        if self.cells is not None:
            if self.kinds is None:
                raise UnreadableError("the kinds of its cells are missing")
            add_vtk_cells(lines, *self.cells, self.kinds)
        for cells in self.polylines:
            add_polylines(lines, *cells)
        return lines

    def _section(self, word: str) -> None:
        if word == "POINTS":
            n = count(self._word(), "points")
            self.points = self._array(3 * n, self._word()).astype(np.float64).reshape(n, 3)
        elif word == "CELLS":
            self.cells = self._runs()
        elif word == "CELL_TYPES":
            self.kinds = self._array(count(self._word(), "cells"), "int")
        elif word == "LINES":
            self.polylines.append(self._runs())
        elif word in _OTHERS:
            if len(self._runs()[1]):
                self.others.add(_OTHERS[word])
        elif word == "METADATA":
            end = re.compile(rb"\n[ \t\r]*\n").search(self.data, self.place)
            self.place = len(self.data) if end is None else end.end()
        elif word == "FIELD":
            self._word()
            for _ in range(count(self._word(), "fields", 10**4)):
                self._field()
        else:
            raise UnreadableError(f"the word {word[:40]} is not understood")

    def _field(self) -> None:
        while (name := self._word()) == "METADATA":
            self._section(name)
        width, length = count(self._word(), "numbers"), count(self._word(), "numbers")
        kind = self._word()
        if kind == "string":
            for _ in range(count(width * length, "texts")):
                self._skip_text()
            return
        self._array(count(width * length, "numbers"), kind)

    def _skip_text(self) -> None:
        """Pass over a text: a line; in binary files its length goes before it, in 1, 2, 4 or 8 bytes by the first two bits."""
        if not self.binary:
            end = self.data.find(b"\n", self.place)
            self.place = len(self.data) if end < 0 else end + 1
            return
        head = self.data[self.place : self.place + 1]
        if not head:
            raise UnreadableError("it ends before the texts that it declares")
        width = (8, 4, 2, 1)[head[0] >> 6]
        length = int.from_bytes(self.data[self.place : self.place + width], "big") & ((1 << (8 * width - 2)) - 1)
        self.place = min(self.place + width + length, len(self.data))

    def _runs(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """Points of cells, and where each cell ends."""
        n, size = count(self._word(), "cells"), count(self._word(), "points of cells")
        if self.offsets:
            found = []
            for word, length in (("OFFSETS", n), ("CONNECTIVITY", size)):
                if self._word() != word:
                    raise UnreadableError(f"the word {word} is missing")
                found.append(self._array(length, self._word()))
            return found[1], found[0][1:]
        flat = self._array(size, "int").astype(np.int64)
        ends, place = np.empty(n, dtype=np.int64), 0
        for k in range(n):
            length = int(flat[place]) if place < size else -1
            if length < 0:
                raise UnreadableError("cells do not fit the list of their points")
            place += 1 + length
            ends[k] = place
        if place != size:
            raise UnreadableError("cells do not fit the list of their points")
        heads = np.concatenate([[0], ends[:-1]]) if n else ends
        return np.delete(flat, heads), ends - np.arange(1, n + 1)

    def _word(self) -> str:
        found = re.compile(rb"\s*(\S*)[ \t\r]*\n?").match(self.data, self.place)
        if found is None:
            return ""
        self.place = found.end()
        return found[1].decode("latin-1")

    def _array(self, size: int, kind: str) -> NDArray[Any]:
        if kind.lower() not in _TYPES:
            raise UnreadableError(f"numbers of type {kind[:40]} are not known")
        if self.binary:
            dtype = np.dtype(">" + _TYPES[kind.lower()])
            end = self.place + size * dtype.itemsize
            if end > len(self.data):
                raise UnreadableError(f"it ends before the {size} numbers that it declares")
            found: NDArray[Any] = np.frombuffer(self.data[self.place : end], dtype)
            self.place = end
            return found
        *words, rest = [*self.data[self.place :].split(None, size), b""][: size + 1]
        if len(words) < size:
            raise UnreadableError(f"it ends before the {size} numbers that it declares")
        self.place = len(self.data) - len(rest)
        return numbers(words, "values")
