"""Lines in VTK's XML files (.vtu and .vtp), docs.vtk.org, "VTK XML Formats"."""

from __future__ import annotations

import base64
import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from . import MOST_NUMBERS, Lines, UnreadableError, count, numbers
from .cells import add_polylines, add_vtk_cells
from .unpack import unpack

_TYPES = {
    **{f"Int{bits}": f"i{bits // 8}" for bits in (8, 16, 32, 64)},
    **{f"UInt{bits}": f"u{bits // 8}" for bits in (8, 16, 32, 64)},
    "Float32": "f4",
    "Float64": "f8",
}
_OTHERS = {"Verts": "vertex", "Strips": "triangle", "Polys": "polygon"}


def read(path: Path) -> Lines:
    """The lines of a .vtu or .vtp file."""
    reader = _Reader(path.read_bytes())
    kind = reader.root.get("type", "")
    grid = reader.root.find(kind) if kind in ("UnstructuredGrid", "PolyData") else None
    if grid is None:
        raise UnreadableError(f"it holds {kind[:40] or 'nothing'}; UnstructuredGrid and PolyData are allowed")
    lines = Lines(np.zeros((0, 3)))
    points, first = [lines.points], 0
    for piece in grid.findall("Piece"):
        own = _unstructured(reader, piece) if kind == "UnstructuredGrid" else _polydata(reader, piece)
        points.append(own.points)
        lines.others |= own.others
        for blocks in own.cells.values():
            for cells, _ in blocks:
                lines.add(np.where(cells < len(own.points), cells + first, -1))
        first += len(own.points)
    lines.points = np.concatenate(points)
    return lines


def _points(reader: _Reader, piece: Any) -> NDArray[np.float64]:
    n = count(piece.get("NumberOfPoints"), "points")
    if not n:
        return np.zeros((0, 3))
    return reader.array(piece.find("Points/DataArray"), 3 * n, "points").astype(np.float64).reshape(n, 3)


def _unstructured(reader: _Reader, piece: Any) -> Lines:
    lines = Lines(_points(reader, piece))
    n = count(piece.get("NumberOfCells"), "cells")
    if n:
        arrays = {array.get("Name"): array for array in piece.findall("Cells/DataArray")}
        ends, kinds = (reader.array(arrays.get(name), n, name) for name in ("offsets", "types"))
        used = count(ends[-1], "points of cells")
        add_vtk_cells(lines, reader.array(arrays.get("connectivity"), used, "connectivity"), ends, kinds)
    return lines


def _polydata(reader: _Reader, piece: Any) -> Lines:
    lines = Lines(_points(reader, piece))
    lines.others = {_OTHERS[kind] for kind in _OTHERS if count(piece.get(f"NumberOf{kind}", 0), kind)}
    n = count(piece.get("NumberOfLines", 0), "lines")
    if n:
        arrays = {array.get("Name"): array for array in piece.findall("Lines/DataArray")}
        ends = reader.array(arrays.get("offsets"), n, "offsets")
        used = count(ends[-1], "points of lines")
        add_polylines(lines, reader.array(arrays.get("connectivity"), used, "connectivity"), ends)
    return lines


class _Reader:
    """The text of a file as a tree, and its arrays, which may be in an appendix."""

    def __init__(self, data: bytes) -> None:
        text, self.appendix = _split(data)
        if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
            raise UnreadableError("it defines entities, which no mesh needs")
        try:
            self.root = ElementTree.fromstring(text)
        except (ElementTree.ParseError, ValueError, LookupError) as error:
            raise UnreadableError(f"it is no XML: {error}") from None
        if self.root.tag != "VTKFile":
            raise UnreadableError("it is no VTKFile")
        self.order = ">" if self.root.get("byte_order") == "BigEndian" else "<"
        self.header = np.dtype(self.order + ("u8" if self.root.get("header_type") == "UInt64" else "u4"))
        self.packer = self.root.get("compressor", "")
        appended = self.root.find("AppendedData")
        self.raw = appended is not None and appended.get("encoding") == "raw"
        if appended is not None and not self.raw:
            self.appendix = (appended.text or "").strip().removeprefix("_").encode()

    def array(self, element: Any, size: int, what: str) -> NDArray[Any]:
        """An array of a given number of entries."""
        if element is None:
            raise UnreadableError(f"its {what} are missing")
        if element.get("type") not in _TYPES:
            raise UnreadableError(f"its {what} are of type {str(element.get('type'))[:40]}")
        kind, form = np.dtype(self.order + _TYPES[element.get("type")]), element.get("format", "ascii")
        if form == "ascii":
            found: NDArray[Any] = numbers((element.text or "").split(), what)
        elif form == "binary":
            found = np.frombuffer(self._decoded("".join((element.text or "").split()).encode(), size * kind.itemsize), kind)
        elif form == "appended":
            offset = count(element.get("offset"), "bytes before an array", len(self.appendix))
            data = self.appendix[offset:]
            found = np.frombuffer((self._raw if self.raw else self._decoded)(data, size * kind.itemsize), kind)
        else:
            raise UnreadableError(f"its {what} are in the format {form[:40]}")
        if len(found) != size:
            raise UnreadableError(f"its {what} are {len(found)} numbers where {size} are declared")
        return found

    def _raw(self, data: bytes, size: int) -> bytes:
        head = self.header.itemsize
        if not self.packer:
            self._check(int(np.frombuffer(data, self.header, 1)[0]), size)
            return data[head : head + size]
        blocks = count(np.frombuffer(data, self.header, 1)[0], "packed blocks", len(data) // head)
        lengths = np.frombuffer(data, self.header, blocks + 3).tolist()
        return self._unpacked(data[head * (blocks + 3) :], lengths, size)

    def _decoded(self, text: bytes, size: int) -> bytes:
        """As :meth:`_raw`, from base64. The head of packed data is encoded by itself; the head of plain data need not be."""
        head = self.header.itemsize
        first = _decode(text, head)
        if not self.packer:
            self._check(int(np.frombuffer(first, self.header, 1)[0]), size)
            separate = text[_letters(head) - 1 : _letters(head)] == b"="
            return _decode(text[_letters(head) :], size) if separate else _decode(text, head + size)[head:]
        blocks = count(np.frombuffer(first, self.header, 1)[0], "packed blocks", len(text) // head)
        lengths = np.frombuffer(_decode(text, head * (blocks + 3)), self.header).tolist()
        return self._unpacked(_decode(text[_letters(head * (blocks + 3)) :], sum(lengths[3:])), lengths, size)

    def _unpacked(self, data: bytes, lengths: list[int], size: int) -> bytes:
        blocks, full, last, *packed = lengths
        sizes = [full] * blocks
        if blocks and last:
            sizes[-1] = last
        self._check(sum(sizes), size)
        parts, place = [], 0
        for length, unpacked in zip(packed, sizes, strict=True):
            parts.append(unpack(data[place : place + length], self.packer, unpacked))
            place += length
        return b"".join(parts)

    def _check(self, found: int, size: int) -> None:
        if found > 8 * MOST_NUMBERS:
            raise UnreadableError(f"an array unpacks to {found} bytes, {8 * MOST_NUMBERS} are allowed")
        if found != size:
            raise UnreadableError(f"an array has {found} bytes where {size} are declared")


def _split(data: bytes) -> tuple[bytes, bytes]:
    """The XML of a file, and what is appended to it as bytes, which no parser may see."""
    start = data.find(b"<AppendedData")
    head = data.find(b">", start)
    if start < 0 or head < 0 or b'"raw"' not in data[start:head]:
        return data, b""
    mark = data.find(b"_", head)
    end = data.rfind(b"</AppendedData>")
    if mark < 0 or end < mark:
        raise UnreadableError("its appended data do not end")
    return data[: head + 1] + data[end:], data[mark + 1 : end]


def _letters(size: int) -> int:
    """Letters of base64 that bytes take."""
    return 4 * math.ceil(size / 3)


def _decode(text: bytes, size: int) -> bytes:
    """The first bytes of base64."""
    piece = text[: _letters(size)]
    try:
        found = base64.b64decode(piece, validate=True)[:size]
    except ValueError:
        raise UnreadableError("an array is no base64") from None
    if len(found) < size:
        raise UnreadableError(f"an array ends after {len(found)} bytes of {size}")
    return found
