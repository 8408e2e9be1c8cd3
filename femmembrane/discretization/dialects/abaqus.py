"""Lines in input files of Abaqus (.inp): *NODE, and *ELEMENT of line elements. *ELSET names groups; *NSET is ignored."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from . import MOST_NUMBERS, Lines, UnreadableError, numbers, whole

#: beginnings of the names of elements on a line, with two points and with three
_TWO = ("B21", "B31", "B23", "B33", "T2D2", "T3D2", "SAX1", "MAX1", "MGAX1", "R2D2", "RAX2", "RB2D2", "RB3D2", "CONN2D2", "CONN3D2", "S1")
_THREE = ("B22", "B32", "T2D3", "T3D3", "SAX2", "MAX2", "MGAX2")


#: keywords that make or move nodes and elements without listing them
_MAKERS = ("*NGEN", "*NFILL", "*NCOPY", "*NMAP", "*ELGEN", "*ELCOPY", "*SYSTEM")
#: numbers of elements from, to, by steps of
_Range = tuple[int, int, int]


@dataclass
class _Part:
    """The lines between *PART and *END PART, where numbers of nodes and elements start anew, or the lines outside of all parts."""

    nodes: list[list[str]] = field(default_factory=list)
    blocks: list[tuple[str, str, list[list[str]]]] = field(default_factory=list)
    sets: list[tuple[str, bool, list[list[str]]]] = field(default_factory=list)


def read(path: Path) -> Lines:
    """The lines of a .inp file."""
    lines = Lines(np.zeros((0, 3)))
    points, first = [lines.points], 0
    parts = _split(path.read_text(encoding="utf-8-sig", errors="replace"))
    if not any(part.nodes for part in parts):
        raise UnreadableError("its nodes (*NODE) are missing")
    for part in parts:
        own = _lines(part)
        points.append(own.points)
        lines.others |= own.others
        for blocks in own.cells.values():
            for cells, groups in blocks:
                lines.add(cells + first, groups)
        first += len(own.points)
    lines.points = np.concatenate(points)
    return lines


def _split(text: str) -> list[_Part]:
    """The parts of a file; the first one is what stands outside of them."""
    parts = {"": _Part()}
    of_instance: dict[str, str] = {}
    here, body, moved = parts[""], list[list[str]](), list[list[str]]()
    for line in text.splitlines():
        words = [word.strip() for word in line.split(",")]
        if line.startswith("**") or not line.strip():
            continue
        if not line.startswith("*"):
            body.append([word for word in words if word])
            continue
        name, options = words[0].upper(), {key.strip().upper(): value.strip() for key, _, value in (w.partition("=") for w in words[1:])}
        if name == "*INCLUDE" or (name in ("*NODE", "*ELEMENT", "*ELSET") and "INPUT" in options):
            raise UnreadableError("it includes another file; one file is read, which holds all")
        if name in _MAKERS or (name == "*NODE" and options.get("SYSTEM", "R").upper() != "R"):
            raise UnreadableError(f"it makes or moves nodes or elements ({words[0][:40]}); a file that lists all, in place, is read")
        body = []
        if name == "*PART":
            here = parts.setdefault(options.get("NAME", "").upper(), _Part())
        elif name == "*END PART":
            here = parts[""]
        elif name == "*INSTANCE":
            part = options.get("PART", "").upper()
            if part in of_instance.values():
                raise UnreadableError("a part has two instances; one of each is read")
            of_instance[options.get("NAME", "").upper()] = part
            body = moved
        elif name == "*NODE":
            body = here.nodes
        elif name == "*ELEMENT":
            here.blocks.append((options.get("TYPE", "").upper(), options.get("ELSET", ""), body))
        elif name == "*ELSET":
            owner = (
                parts.get(of_instance[options["INSTANCE"].upper()], here) if options.get("INSTANCE", "").upper() in of_instance else here
            )
            owner.sets.append((options.get("ELSET", ""), "GENERATE" in options, body))
    if moved:
        raise UnreadableError("an instance of a part is moved, or has nodes of its own; a part that is drawn in its place is read")
    return list(parts.values())


def _lines(part: _Part) -> Lines:
    if not part.nodes:
        if any(body for _, _, body in part.blocks):
            raise UnreadableError("the nodes (*NODE) of its elements are missing")
        return Lines(np.zeros((0, 3)))
    rows = numbers([(row + ["0"] * 4)[:4] for row in part.nodes], "nodes")
    lines = Lines(rows[:, 1:])
    tables, members = _elements(lines, part.blocks)
    for name, generate, body in part.sets:
        _add_members(members.setdefault(name, []), members, generate, body)
    tags = whole(rows[:, 0], "numbers of nodes")
    for size, found in tables.items():
        if found:
            _add(lines, tags, np.concatenate(found), members, size)
    return lines


def _elements(
    lines: Lines, blocks: list[tuple[str, str, list[list[str]]]]
) -> tuple[dict[int, list[NDArray[np.int64]]], dict[str, list[_Range]]]:
    """Tables of lines by their size, each row an element and its nodes, and which elements the sets named with them have."""
    tables: dict[int, list[NDArray[np.int64]]] = {2: [], 3: []}
    members: dict[str, list[_Range]] = {}
    for kind, name, body in blocks:
        size = 2 if kind.startswith(_TWO) else 3 if kind.startswith(_THREE) else 0
        if size and body:
            body = _whole_rows(body, 1 + size)
            tables[size].append(whole(numbers([row[: 1 + size] for row in body], "elements"), "elements").reshape(-1, 1 + size))
            if name:
                members.setdefault(name, []).extend((n, n, 1) for n in tables[size][-1][:, 0].tolist())
        elif body:
            lines.others.add(kind[:40] or "elements without a type")
    return tables, members


def _whole_rows(body: list[list[str]], width: int) -> list[list[str]]:
    """Rows of full length: a row that is too short goes on in the next line."""
    rows: list[list[str]] = []
    for row in body:
        if rows and len(rows[-1]) < width:
            rows[-1] = rows[-1] + row
        else:
            rows.append(row)
    return rows


def _add_members(own: list[_Range], members: dict[str, list[_Range]], generate: bool, body: list[list[str]]) -> None:
    for row in body:
        if generate:
            first, last, step = (int(word) for word in [*row, "1"][:3])
            own.append((first, last, max(step, 1)))
        else:
            for word in row:
                own.extend([(int(word), int(word), 1)] if word.isdigit() else members.get(word, []))
        if len(own) > MOST_NUMBERS:
            raise UnreadableError(f"a set has more than {MOST_NUMBERS} members")


def _add(lines: Lines, tags: NDArray[np.int64], table: NDArray[np.int64], members: dict[str, list[_Range]], size: int) -> None:
    """Add elements of one size, those of the same sets together."""
    order = np.argsort(tags, kind="stable")
    place = np.minimum(np.searchsorted(tags[order], table[:, 1:]), len(tags) - 1)
    nodes = order[place]
    if (tags[nodes] != table[:, 1:]).any():
        raise UnreadableError("an element has a node that is not in the file")
    if size == 3:
        nodes = _inner_last(lines.points, nodes)
    elements = table[:, 0]
    of_element: list[list[str]] = [[] for _ in elements]
    for name, ranges in members.items():
        single = np.array([first for first, last, _ in ranges if first == last], dtype=np.int64)
        belongs = np.isin(elements, single)
        for first, last, step in ranges:
            if first != last:
                belongs |= (elements >= first) & (elements <= last) & ((elements - first) % step == 0)
        for k in np.flatnonzero(belongs).tolist():
            of_element[k].append(name)
    rows: dict[frozenset[str], list[int]] = {}
    for k, names in enumerate(of_element):
        rows.setdefault(frozenset(names), []).append(k)
    for groups, chosen in rows.items():
        lines.add(nodes[chosen], groups)


def _inner_last(points: NDArray[np.float64], nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cells with the point inside last. Programs write it second or third; seen from it, the two ends lie in opposite directions."""
    corners = points[nodes]
    seen = [((corners[:, (k + 1) % 3] - corners[:, k]) * (corners[:, (k + 2) % 3] - corners[:, k])).sum(axis=1) for k in range(3)]
    inner = np.argmin(seen, axis=0)
    rows = np.arange(len(nodes))
    inside = nodes[rows, inner]
    nodes = nodes.copy()
    nodes[rows, inner], nodes[rows, 2] = nodes[:, 2], inside
    return nodes
