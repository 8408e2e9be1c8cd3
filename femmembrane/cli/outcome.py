"""How a command ends: its exit code, and one line on stderr that says why."""

from __future__ import annotations

import sys

from ..errors import Status

DONE, BAD_INPUT, NOT_CONVERGED, INTERRUPTED = 0, 2, 3, 130


def fail(code: int, message: str) -> int:
    line = " ".join(message.split())
    sys.stderr.write(f"femmembrane: {line}\n")
    return code


def explain(status: Status, message: str) -> str:
    what = message or str(status)
    return what if status.advice.lower() in what.lower() else f"{what.rstrip('.')}; {status.advice}"


def count(number: int) -> str:
    return f"{number} equilibrium" if number == 1 else f"{number} equilibria"
