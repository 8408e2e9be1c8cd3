"""Lines in files of Gmsh 2.2, 4.0 and 4.1 (.msh), gmsh.info/doc/texinfo, "MSH file format"."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import MOST_NUMBERS, Lines, UnreadableError, count, numbers, whole

_LINE, _PARABOLA = 1, 8
#: points of the elements of Gmsh by their numbers
_SIZES = {
    **dict(enumerate([2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13, 9, 10, 12, 15, 15, 21, 4, 5, 6, 20, 35, 56], 1)),
    36: 16,
    37: 25,
    92: 64,
    93: 125,
}
_NAMES = {15: "vertex", 2: "triangle", 9: "triangle6", 3: "quad", 16: "quad8", 10: "quad9", 4: "tetra", 11: "tetra10", 5: "hexahedron"}


def read(path: Path) -> Lines:
    """The lines of a .msh file."""
    return _Reader(path.read_bytes()).lines()


class _Reader:
    def __init__(self, data: bytes) -> None:
        self.data, self.place, self.read = data, 0, 0
        self.numbers: NDArray[np.float64] = np.zeros(0)
        self.tags: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self.points: NDArray[np.float64] | None = None
        self.names: dict[int, str] = {}
        self.of_curve: dict[int, list[int]] = {}
        self.found: list[tuple[NDArray[np.int64], frozenset[int]]] = []
        self.others: set[str] = set()
        head = re.match(rb"\s*\$MeshFormat\s+(\d+)(?:\.(\d+))?\S* +([01]) +(\d+)[ \t\r]*\n", data)
        if head is None:
            raise UnreadableError("it is no file of Gmsh of version 2 or 4: the section $MeshFormat is missing")
        self.version = int(head[1]), int(head[2] or 0)
        if self.version not in ((2, 0), (2, 1), (2, 2), (4, 0), (4, 1)):
            raise UnreadableError(f"it is of version {self.version[0]}.{self.version[1]} of Gmsh's format; 2.2, 4.0 and 4.1 are allowed")
        self.binary, self.place = head[3] == b"1", head.end()
        self.size = "u8" if head[4] == b"8" else "u4"
        self.order = "<"
        if self.binary:
            one = data[self.place : self.place + 4]
            if one not in (b"\1\0\0\0", b"\0\0\0\1"):
                raise UnreadableError("its section $MeshFormat is damaged")
            self.order, self.place = "<" if one == b"\1\0\0\0" else ">", self.place + 4
        self._end("MeshFormat")

    def lines(self) -> Lines:
        known = {
            "Entities": self._read_entities,
            **({"PartitionedEntities": self._read_parts} if self.version == (4, 1) else {}),
            "Nodes": self._read_nodes,
            "Elements": self._read_elements,
        }
        section = re.compile(rb"\s*\$(\w+)[ \t\r]*\n")
        while (found := section.match(self.data, self.place)) is not None:
            name, self.place = found[1].decode("latin-1"), found.end()
            if name == "PhysicalNames":
                self._read_names()
            elif name in known:
                if not self.binary:
                    self.numbers, self.read = numbers(self._text(name).split(), f"values of ${name}"), 0
                known[name]()
            else:
                stop = self.data.find(f"$End{name}".encode(), self.place)
                self.place = len(self.data) if stop < 0 else stop
            self._end(name)
        if self.data[self.place :].strip():
            raise UnreadableError("something stands between its sections")
        if self.points is None:
            raise UnreadableError("its section $Nodes is missing")
        return self._result()

    def _result(self) -> Lines:
        lines = Lines(self.points if self.points is not None else np.zeros((0, 3)), others=self.others)
        order = np.argsort(self.tags, kind="stable")
        sorted_tags = self.tags[order]
        for nodes, groups in self.found:
            if not nodes.size:
                continue
            place = np.minimum(np.searchsorted(sorted_tags, nodes), max(len(sorted_tags) - 1, 0))
            if not len(sorted_tags) or (sorted_tags[place] != nodes).any():
                raise UnreadableError("an element has a node that is not in the file")
            lines.add(order[place], {self.names.get(tag, str(tag)) for tag in groups})
        return lines

    # --- sections

    def _read_names(self) -> None:
        for dimension, tag, label in re.findall(rb"^\s*(\d+)\s+(-?\d+)\s+\"([^\"\n]*)\"", self._text("PhysicalNames"), re.MULTILINE):
            if dimension == b"1":
                self.names[abs(int(tag))] = label.decode("utf-8", "replace")

    def _read_entities(self) -> None:
        self._read_geometry(parts=False)

    def _read_parts(self) -> None:
        """Entities with a parent: parts of a mesh that was divided for several processors, with their groups."""
        self._values(self.size, 1)
        self._values("i4", 2 * count(self._values(self.size, 1)[0], "ghosts"))
        self._read_geometry(parts=True)

    def _read_geometry(self, parts: bool) -> None:
        counts = [count(n, "entities") for n in self._values(self.size, 4)]
        for dimension, many in enumerate(counts):
            for _ in range(many):
                (tag,) = self._values("i4", 1)
                if parts:
                    self._values("i4", 2)
                    self._values("i4", count(self._values(self.size, 1)[0], "parts of a mesh"))
                self._values("f8", 3 if dimension == 0 and self.version == (4, 1) else 6)
                groups = self._values("i4", count(self._values(self.size, 1)[0], "groups of an entity"))
                if dimension == 1:
                    self.of_curve[int(tag)] = [abs(int(g)) for g in groups]
                if dimension:
                    self._values("i4", count(self._values(self.size, 1)[0], "entities around an entity"))

    def _read_nodes(self) -> None:
        if self.version[0] == 2:
            n = count(self._first(), "nodes")
            if self.binary:
                table = self._records([("tag", "i4"), ("x", "f8", 3)], n)
                self.tags, self.points = table["tag"].astype(np.int64), table["x"].astype(np.float64)
            else:
                rows = self._values("f8", 4 * n).reshape(n, 4)
                self.tags, self.points = whole(rows[:, 0], "numbers of nodes"), rows[:, 1:]
            return
        blocks, total = (count(v, "nodes") for v in self._values(self.size, 4 if self.version == (4, 1) else 2)[:2])
        tags, points = [np.zeros(0, dtype=np.int64)], [np.zeros((0, 3))]
        for _ in range(blocks):
            first, second, parametric = self._values("i4", 3).tolist()
            n = count(self._values(self.size, 1)[0], "nodes")
            width = 3 + (max(first if self.version == (4, 1) else second, 0) if parametric else 0)
            if self.version == (4, 1):
                tags.append(whole(self._values(self.size, n), "numbers of nodes"))
                points.append(self._values("f8", width * n).reshape(n, width)[:, :3])
            elif self.binary:
                table = self._records([("tag", "i4"), ("x", "f8", width)], n)
                tags.append(table["tag"].astype(np.int64))
                points.append(table["x"][:, :3].astype(np.float64))
            else:
                rows = self._values("f8", (1 + width) * n).reshape(n, 1 + width)
                tags.append(whole(rows[:, 0], "numbers of nodes"))
                points.append(rows[:, 1:4])
        self.tags, self.points = np.concatenate(tags), np.concatenate(points)
        if len(self.tags) != total:
            raise UnreadableError(f"it has {len(self.tags)} nodes where {total} are declared")

    def _read_elements(self) -> None:
        if self.version[0] == 2:
            total = count(self._first(), "elements")
            if not self.binary:
                self._keep_single(total)
                return
            read = 0
            while read < total:
                read += self._keep_many()
            return
        blocks = count(self._values(self.size, 4 if self.version == (4, 1) else 2)[0], "blocks of elements")
        for _ in range(blocks):
            first, second, kind = self._values("i4", 3).tolist()
            n = count(self._values(self.size, 1)[0], "elements")
            dimension, entity = (first, second) if self.version == (4, 1) else (second, first)
            width = 1 + self._width(kind)
            count(width * n, "numbers of elements")
            rows = whole(self._values(self.size if self.version == (4, 1) else "i4", width * n), "nodes").reshape(n, width)
            self._keep(kind, rows[:, 1:], self.of_curve.get(entity, []) if dimension == 1 else [])

    def _keep_many(self) -> int:
        """Elements of one kind in a binary file of version 2; returns how many."""
        kind, many, tags = self._values("i4", 3).tolist()
        if many < 1:
            raise UnreadableError("a block of elements is empty")
        count(tags, "tags of an element", 1000)
        rows = self._values("i4", count(many * (1 + tags + self._width(kind)), "numbers of elements")).reshape(many, -1)
        groups = np.abs(rows[:, 1]) if tags else np.zeros(many, dtype=np.int64)
        for group in np.unique(groups).tolist():
            self._keep(kind, rows[groups == group, 1 + tags :], [group] if group else [])
        return many

    def _keep_single(self, total: int) -> None:
        """Elements of a file of version 2 in text, each with its number, its kind, its tags and its nodes."""
        values, place = whole(self.numbers[self.read :], "elements").tolist(), 0
        rows: dict[tuple[int, int], list[list[int]]] = {}
        for _ in range(total):
            if place + 3 > len(values):
                raise UnreadableError("a section ends before its last number")
            kind, tags = values[place + 1], count(values[place + 2], "tags of an element", 1000)
            first = place + 3 + tags
            group = abs(values[place + 3]) if tags and place + 3 < len(values) else 0
            place = first + self._width(kind)
            if place > len(values):
                raise UnreadableError("a section ends before its last number")
            rows.setdefault((kind, group), []).append(values[first:place])
        for (kind, group), nodes in rows.items():
            self._keep(kind, np.array(nodes, dtype=np.int64), [group] if group else [])

    def _width(self, kind: int) -> int:
        if kind not in _SIZES:
            raise UnreadableError(f"it has elements of the unknown type {kind}")
        return _SIZES[kind]

    def _keep(self, kind: int, nodes: NDArray[Any], groups: list[int]) -> None:
        if kind in (_LINE, _PARABOLA):
            self.found.append((nodes.astype(np.int64), frozenset(groups)))
        elif len(nodes):
            self.others.add(_NAMES.get(kind, f"type {kind} of Gmsh"))

    # --- numbers

    def _text(self, name: str) -> bytes:
        """What stands in a section of text."""
        stop = self.data.find(f"$End{name}".encode(), self.place)
        if stop < 0:
            raise UnreadableError(f"its section ${name} does not end")
        text = self.data[self.place : stop]
        self.place = stop
        return text

    def _first(self) -> Any:
        """The number with which a section of version 2 begins, a text in binary files, too."""
        if not self.binary:
            return self._values("f8", 1)[0]
        found = re.compile(rb"\s*(\d+)[ \t\r]*\n").match(self.data, self.place)
        if found is None:
            raise UnreadableError("a section without its size")
        self.place = found.end()
        return found[1]

    def _values(self, kind: str, size: int) -> NDArray[Any]:
        if size > MOST_NUMBERS:
            raise UnreadableError(f"it declares {size} numbers, {MOST_NUMBERS} are allowed")
        if self.binary:
            return self._records(kind, size)
        found = self.numbers[self.read : self.read + size]
        self.read += size
        if len(found) < size:
            raise UnreadableError("a section ends before its last number")
        return found if kind == "f8" else whole(found, "values")

    def _records(self, kind: Any, size: int) -> NDArray[Any]:
        dtype = np.dtype(kind).newbyteorder(self.order)  # type: ignore[arg-type]  # one of "<", ">"
        end = self.place + size * dtype.itemsize
        if end > len(self.data):
            raise UnreadableError("a section ends before its last number")
        found = np.frombuffer(self.data[self.place : end], dtype)
        self.place = end
        return found

    def _end(self, name: str) -> None:
        found = re.compile(rb"\s*\$End(\w+)").match(self.data, self.place)
        if found is None or found[1].decode("latin-1") != name:
            raise UnreadableError(f"its section ${name[:40]} does not end where it should")
        self.place = found.end()
