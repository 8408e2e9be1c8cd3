"""Lines in input files of Abaqus (.inp): *NODE, *ELEMENT of line elements, *NSET is left out, *ELSET names groups."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from . import Lines, UnreadableError, count, numbers, whole

#: beginnings of the names of elements on a line, with two points and with three
_TWO = ("B21", "B31", "B23", "B33", "T2D2", "T3D2", "SAX1", "MAX1", "MGAX1", "R2D2", "RAX2", "RB2D2", "RB3D2", "CONN2D2", "CONN3D2", "S1")
_THREE = ("B22", "B32", "T2D3", "T3D3", "SAX2", "MAX2", "MGAX2")


def read(path: Path) -> Lines:
    """The lines of a .inp file."""
    nodes: list[list[str]] = []
    elements: list[tuple[str, list[list[str]]]] = []
    members: dict[str, set[int]] = {}
    body: list[list[str]] = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        words = [word.strip() for word in line.split(",")]
        if line.startswith("**") or not line.strip():
            continue
        if not line.startswith("*"):
            body.append([word for word in words if word])
            continue
        name, options = words[0].upper(), {key.strip().upper(): value.strip() for key, _, value in (w.partition("=") for w in words[1:])}
        if name == "*INCLUDE":
            raise UnreadableError("it includes another file; one file is read, which holds all")
        body = []
        if name == "*NODE":
            body = nodes
        elif name == "*ELEMENT":
            elements.append((options.get("TYPE", "").upper(), body))
            if options.get("ELSET"):
                members.setdefault(options["ELSET"], set())
                elements[-1] = (elements[-1][0] + "\n" + options["ELSET"], body)
        elif name == "*ELSET" and options.get("ELSET"):
            members.setdefault(options["ELSET"], set())
            elements.append((f"*\n{options['ELSET']}" + ("\nGENERATE" if "GENERATE" in options else ""), body))
    return _lines(nodes, elements, members)


def _lines(nodes: list[list[str]], elements: list[tuple[str, list[list[str]]]], members: dict[str, set[int]]) -> Lines:
    if not nodes:
        raise UnreadableError("its nodes (*NODE) are missing")
    rows = numbers([(row + ["0"] * 4)[:4] for row in nodes], "nodes")
    tags = whole(rows[:, 0], "numbers of nodes")
    order = np.argsort(tags, kind="stable")
    lines = Lines(rows[:, 1:])
    cells: dict[int, list[NDArray[np.int64]]] = {2: [], 3: []}
    for head, body in elements:
        kind, _, name = head.partition("\n")
        if kind == "*":
            _add_members(members, name, body)
            continue
        size = 2 if kind.startswith(_TWO) else 3 if kind.startswith(_THREE) else 0
        if not size:
            if body:
                lines.others.add(kind[:40] or "elements without a type")
            continue
        table = whole(numbers([row[: 1 + size] for row in body], "elements"), "elements").reshape(-1, 1 + size)
        if name:
            members[name] |= set(table[:, 0].tolist())
        cells[size].append(table)
    for size, tables in cells.items():
        if tables:
            _add(lines, np.concatenate(tables), tags[order], order, members, size)
    return lines


def _add_members(members: dict[str, set[int]], head: str, body: list[list[str]]) -> None:
    name, _, generate = head.partition("\n")
    for row in body:
        if generate:
            first, last, *step = (int(v) for v in row[:3])
            count(last - first, "members of a set")
            members[name] |= set(range(first, last + 1, *step))
        else:
            for word in row:
                members[name] |= {int(word)} if word.isdigit() else members.get(word, set())


def _add(
    lines: Lines, table: NDArray[np.int64], tags: NDArray[np.int64], order: NDArray[np.int64], members: dict[str, set[int]], size: int
) -> None:
    place = np.minimum(np.searchsorted(tags, table[:, 1:]), len(tags) - 1)
    if (tags[place] != table[:, 1:]).any():
        raise UnreadableError("an element has a node that is not in the file")
    nodes = order[place]
    if size == 3:
        nodes = _inner_last(lines.points, nodes)
    groups = [frozenset(name for name, numbers_ in members.items() if element in numbers_) for element in table[:, 0].tolist()]
    for group in set(groups):
        lines.add(nodes[[g == group for g in groups]], group)


def _inner_last(points: NDArray[np.float64], nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cells with the point inside last: programs write it second or third, so it is the one that sees the others in opposite directions."""
    corners = points[nodes]
    seen = [((corners[:, (k + 1) % 3] - corners[:, k]) * (corners[:, (k + 2) % 3] - corners[:, k])).sum(axis=1) for k in range(3)]
    inner = np.argmin(seen, axis=0)
    rows = np.arange(len(nodes))
    inside = nodes[rows, inner]
    nodes = nodes.copy()
    nodes[rows, inner], nodes[rows, 2] = nodes[:, 2], inside
    return nodes
