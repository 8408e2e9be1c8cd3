"""How a command ends: its exit code, and one line on stderr that says why."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, TextIO

from cyclopts import Parameter

from ..errors import InputError, NotWrittenError, Status, printable

DONE, BAD_INPUT, NOT_CONVERGED, NOT_WRITTEN, INTERRUPTED = 0, 2, 3, 4, 130


#: characters that a message has at most: the middle of a longer one is left out
_LONGEST = 900


def fail(code: int, message: str) -> int:
    line = " ".join(message.split())
    if len(line) > _LONGEST:
        line = f"{line[: _LONGEST * 3 // 4]} ... {line[-_LONGEST // 4 :]}"
    try:
        _write(sys.stderr, f"femmembrane: {line}\n")
        sys.stderr.flush()
    except OSError:  # nobody can be told; the exit code stays
        drop(sys.stderr)
    return code


def say(text: str) -> None:
    """Write to standard output."""
    _write(sys.stdout, text)


#: --table of the commands that have a table
Table = Annotated[bool, Parameter(name="--table", negative=(), help="Print the table in a pipe as well; on a terminal it always is.")]


def succeed(head: str, written: Sequence[Path], *, table: str = "", asked: bool = False, hint: str = "") -> int:
    """Say what was computed and written, on standard output: one line in a pipe. A terminal also gets the table, and a line for each file.

    Parameters
    ----------
    head
        What was computed, in a few words.
    written
        The files.
    table
        What was found, on lines of its own.
    asked
        Whether the table is printed in a pipe too.
    hint
        What to do next, for a terminal.
    """
    terminal = sys.stdout.isatty()
    head = ", ".join(filter(None, [head, "written:"]))
    if table and (terminal or asked):
        say(f"{table}\n")
    if terminal:
        say("\n".join([head, *(f"  {path}" for path in written)]) + "\n")
    else:
        say(" ".join([head, *map(str, written)]) + "\n")
    if hint and terminal:
        say(f"{hint}\n")
    return DONE


def _write(stream: TextIO, text: str) -> None:
    """Write text to a terminal. Text that may come from files and options goes no other way."""
    encoding = getattr(stream, "encoding", None) or "utf-8"
    stream.write(printable(text).encode(encoding, "backslashreplace").decode(encoding))


def open_streams() -> None:
    """Streams that were closed before the process started lead nowhere. A file that is opened later cannot take their place.

    A character that the output cannot encode is written as an escape.
    """
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        if getattr(sys, name) is not None:
            continue
        try:
            os.fstat(number)
        except OSError:
            nowhere = os.open(os.devnull, os.O_RDWR)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
        setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115  # as long as the process
    if reconfigure := getattr(sys.stdout, "reconfigure", None):
        reconfigure(errors="backslashreplace")


def drop(stream: TextIO) -> None:
    """Drop what a stream still holds: Python would complain again when it flushes at its end."""
    try:
        number = stream.fileno()
    except (OSError, ValueError):  # a stream of Python alone
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, number)
    os.close(nowhere)


def refused(error: BaseException) -> bool:
    """Whether an error says that the system refused to write, rather than that something is wrong with the data."""
    return isinstance(error.__cause__ if isinstance(error, InputError) else error, OSError)


def no_room(error: OSError) -> bool:
    """Whether an error says that there is no room for what was to be written."""
    return isinstance(error, NotWrittenError) or error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def explain(status: Status, message: str) -> str:
    what = message or str(status)
    return what if status.advice.lower() in what.lower() else f"{what.rstrip('.')}; {status.advice}"


def count(number: int, one: str = "equilibrium", many: str = "equilibria") -> str:
    return f"{number} {one if number == 1 else many}"


def not_written(error: Exception, out: Path) -> str:
    if isinstance(error, InputError):
        text = error.allowed if refused(error) else str(error)
    else:
        text = getattr(error, "strerror", None) or str(error)
    return f"results could not be written to {out} ({text})"
