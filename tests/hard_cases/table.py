"""The table of hard cases in README.md beside this file: how it is printed, and how it is compared with what comes out now."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from .registry import Case, Outcome

README = Path(__file__).with_name("README.md")
BEGIN, END = "<!-- hard cases: printed by python -m tests.hard_cases --write -->", "<!-- end of hard cases -->"
HEADING = "| case | why it is hard | must come out | came out | s |\n|---|---|---|---|---:|"


def row(case: Case, outcome: Outcome) -> str:
    """One line of the table."""
    came = f"FAILED: {outcome.fault}" if outcome.fault else outcome.shown
    cells = (case.name + (" (slow)" if case.slow else ""), case.why, str(case.expected), came)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + f" | {outcome.seconds:.2g} |"


def table(cases: Sequence[Case], outcomes: Mapping[Case, Outcome], readme: str) -> str:
    """The whole table, one heading a family. A case without an outcome keeps its line of the README."""
    old = {_start(line): line for line in readme.split(BEGIN)[1].split(END)[0].splitlines()}
    lines, family = [], None
    for case in cases:
        if case.family is not family:
            family = case.family
            lines += ["", f"**{family.number}. {family.name}**", "", HEADING]
        new = row(case, outcomes.get(case, Outcome("", "", 0.0)))
        lines.append(new if case in outcomes else old.get(_start(new), new))
    return "\n".join(lines[1:])


def _start(line: str) -> tuple[str, ...]:
    """What the registry says of a case: its first three cells."""
    return tuple(re.split(r"(?<!\\)\|", line)[1:4])


def replaced(readme: str, new: str) -> str:
    """The README with a new table between its markers."""
    before, rest = readme.split(BEGIN)
    return f"{before}{BEGIN}\n\n{new}\n\n{END}{rest.split(END)[1]}"


def printed(readme: str) -> list[list[str]]:
    """The cells of every case in the README, times left out."""
    lines = readme.split(BEGIN)[1].split(END)[0].splitlines()
    rows = [re.split(r"(?<!\\)\|", line)[1:-2] for line in lines if line.startswith("| ") and not line.startswith("| case |")]
    return [[cell.strip() for cell in cells] for cells in rows]


def differences(readme: str, cases: Sequence[Case], outcomes: Mapping[Case, Outcome]) -> list[str]:
    """What in the README's table is not what the registry says, or for the cases that have an outcome not what came out."""
    old = printed(readme)
    new = [printed(f"{BEGIN}\n{row(case, outcomes.get(case, Outcome('', '', 0.0)))}\n{END}")[0] for case in cases]
    if [cells[:3] for cells in old] != [cells[:3] for cells in new]:
        known, now = ({tuple(cells[:3]) for cells in rows} for rows in (old, new))
        return [f"not in the registry: {c}" for c in known - now] + [f"not in the README: {c}" for c in now - known] or ["another order"]
    pairs = zip(cases, old, new, strict=True)
    return [f"{case.id}: {a[3]!r} in the README, {b[3]!r} now" for case, a, b in pairs if case in outcomes and not _same(a[3], b[3])]


def _same(a: str, b: str) -> bool:
    """Whether two texts differ at most in the last digits of their numbers, which another machine rounds differently."""
    number = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
    if number.sub("#", a) != number.sub("#", b):
        return False
    return all(abs(float(x) - float(y)) <= 2e-3 * abs(float(x)) + 1e-12 for x, y in zip(number.findall(a), number.findall(b), strict=True))
