"""How a command ends: its exit code, and one line on stderr that says why."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TextIO

from ..errors import InputError, Status, printable

DONE, BAD_INPUT, NOT_CONVERGED, NOT_WRITTEN, INTERRUPTED = 0, 2, 3, 4, 130


#: characters that a message has at most: the middle of a longer one is left out
_LONGEST = 900


def fail(code: int, message: str) -> int:
    line = " ".join(message.split())
    if len(line) > _LONGEST:
        line = f"{line[: _LONGEST * 3 // 4]} ... {line[-_LONGEST // 4 :]}"
    _write(sys.stderr, f"femmembrane: {line}\n")
    return code


def say(text: str) -> None:
    """Write to standard output."""
    _write(sys.stdout, text)


def _write(stream: TextIO, text: str) -> None:
    """The one way in which text that may come from files and options goes to a terminal."""
    encoding = getattr(stream, "encoding", None) or "utf-8"
    stream.write(printable(text).encode(encoding, "backslashreplace").decode(encoding))


def explain(status: Status, message: str) -> str:
    what = message or str(status)
    return what if status.advice.lower() in what.lower() else f"{what.rstrip('.')}; {status.advice}"


def count(number: int) -> str:
    return f"{number} equilibrium" if number == 1 else f"{number} equilibria"


def not_written(error: Exception, out: Path) -> str:
    text = error.allowed if isinstance(error, InputError) else getattr(error, "strerror", None) or str(error)
    return f"results could not be written to {out} ({text})"
