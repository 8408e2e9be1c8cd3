"""Whether the memory has room for a computation, before anything is built.

A system may promise memory that it does not have, and end a process that uses too much without a word. So the least memory of a mesh, a run
or a sweep is estimated first, and compared with what this process may still have.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from .errors import InputError

#: bytes up to which nobody asks
SMALL = 2**28
#: what the smallest computation takes in addresses and in data (``VmPeak`` 480 MB and ``VmData`` 300 MB, measured on Linux, one thread):
#: with less the numerical libraries end the process, or never come back
_LEAST = {"addresses": 430 * 2**20, "data": 280 * 2**20}
#: how libraries say that they got no memory, where they do not raise MemoryError
_WORDS = ("bad_alloc", "cannot allocate memory", "failed to map segment", "unable to allocate")


def available() -> int | None:
    """Bytes that this process may still have: of the machine, of its control group and of its own limits; None where nobody knows."""
    known = [*_machine(), *_groups(), *(left for _, left in _limits())]
    return max(min(known), 0) if known else None


def require(key: str, count: int, each: int, what: str) -> None:
    """Raise InputError with the number that is allowed, unless there is room for ``count`` items of ``each`` bytes.

    Parameters
    ----------
    key : str
        Argument that says how many.
    count, each : int
        How many, and the bytes that each takes at least.
    what : str
        What they are, in the plural.
    """
    free = available()
    if free is not None and count * each > free:
        needed = f"{_size(count * each)} of memory at least are needed and {_size(free)} are there"
        raise InputError(key, count, f"{needed}: up to {free // each} {what} are allowed")


def require_libraries() -> None:
    """Raise MemoryError where a limit of the process leaves no room for the numerical libraries.

    Raises
    ------
    MemoryError
        With the limit and what is needed.
    """
    for kind, left in _limits():
        if left < _LEAST[kind]:
            raise MemoryError(
                f"a computation takes {_size(_LEAST[kind])} of {kind} at least, and a limit of this process leaves {_size(left)}"
            )


def ran_out(error: BaseException | None) -> bool:
    """Whether an error, or the one that led to it, says that there was no memory."""
    while error is not None:
        if isinstance(error, MemoryError) or any(words in str(error).lower() for words in _WORDS):
            return True
        error = error.__cause__ or error.__context__
    return False


def _size(number: int) -> str:
    return f"{number / 2**30:.3g} GiB"


def _machine() -> Iterator[int]:
    with suppress(OSError, ValueError, KeyError):
        lines = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text().splitlines())
        yield 1024 * sum(int(lines[name].split()[0]) for name in ("MemAvailable", "SwapFree"))


def _groups() -> Iterator[int]:
    """Of the control groups that the process is in, and of the groups around these."""
    with suppress(OSError, ValueError):
        for line in Path("/proc/self/cgroup").read_text().splitlines():
            _, controllers, name = line.split(":", 2)
            if controllers in ("", "memory"):
                yield from _group(Path("/sys/fs/cgroup") / controllers, name, *_FILES[controllers])


#: files with the limit and the use of a group, and the line of ``memory.stat`` with what it gives back when asked: of version 2 and 1
_FILES = {
    "": ("memory.max", "memory.current", "inactive_file"),
    "memory": ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
}


def _group(root: Path, name: str, limit: str, use: str, spare: str) -> Iterator[int]:
    folder = root / name.lstrip("/")
    if not folder.is_dir():  # in a container its own group may be the root
        folder = root
    for place in (folder, *folder.parents):
        with suppress(OSError, ValueError):  # "max" is no number: no limit
            most = int((place / limit).read_text())
            back = next((int(line.split()[1]) for line in (place / "memory.stat").read_text().splitlines() if line.startswith(spare)), 0)
            yield most - int((place / use).read_text()) + back
        if place == root:
            return


def _limits() -> Iterator[tuple[str, int]]:
    """What is limited of the process itself, as the shell's ``ulimit`` does, and the bytes of it that are left."""
    if sys.platform == "win32":
        return
    import resource

    with suppress(OSError, ValueError, IndexError):
        size, *_, data, _ = (int(word) * resource.getpagesize() for word in Path("/proc/self/statm").read_text().split())
        used: Any
        for name, kind, used in (("addresses", resource.RLIMIT_AS, size), ("data", resource.RLIMIT_DATA, data)):
            most = resource.getrlimit(kind)[0]
            if most != resource.RLIM_INFINITY:
                yield name, most - used
