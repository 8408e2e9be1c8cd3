"""How a command ends: its exit code, and one line on stderr that says why."""

from __future__ import annotations

import sys
from pathlib import Path

from ..errors import InputError, Status

DONE, BAD_INPUT, NOT_CONVERGED, NOT_WRITTEN, INTERRUPTED = 0, 2, 3, 4, 130


def fail(code: int, message: str) -> int:
    line = " ".join(message.split())
    sys.stderr.write(f"femmembrane: {line}\n")
    return code


def explain(status: Status, message: str) -> str:
    what = message or str(status)
    return what if status.advice.lower() in what.lower() else f"{what.rstrip('.')}; {status.advice}"


def count(number: int) -> str:
    return f"{number} equilibrium" if number == 1 else f"{number} equilibria"


def not_written(error: Exception, out: Path) -> str:
    text = error.allowed if isinstance(error, InputError) else getattr(error, "strerror", None) or str(error)
    return f"results could not be written to {out} ({text})"
