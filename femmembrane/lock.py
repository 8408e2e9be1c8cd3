"""One run at a time in a folder."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from .errors import InputError
from .files import lock, own_file

NAME = ".lock"
#: how the text in a lock begins; a file with another text is not ours
_HOLDER = b"process "


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a folder. The system lets go of it when the process ends, even after a kill.

    On file systems that know no locks nothing is held.

    Raises
    ------
    InputError
        When another run holds it, with the number of its process, or when its lock is no file of ours: a link, a pipe, a text.
    """
    path = folder / NAME
    descriptor = _hold(path)
    try:
        yield
    finally:
        if sys.platform == "win32":  # which removes no file that is open
            os.close(descriptor)
        with suppress(OSError):
            path.unlink(missing_ok=True)
        if sys.platform != "win32":
            os.close(descriptor)


def _hold(path: Path) -> int:
    while True:
        descriptor = own_file(path)
        try:
            free = lock(descriptor)
            os.lseek(descriptor, 0, os.SEEK_SET)
            text = os.read(descriptor, 200).strip(b"\0")  # as a file may be after the power failed
            if text and not text.startswith(_HOLDER):
                raise InputError(
                    "--out", str(path.parent), f"{path.name} in it belongs to something else; remove it, or choose another folder"
                )
            if free is False:
                holder = text.decode("utf-8", "replace").strip() or "another process"
                raise InputError("--out", str(path.parent), f"{holder} is writing to it; a folder of its own is allowed")
            if _is(descriptor, path):
                _sign(descriptor)
                return descriptor
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)  # its last holder removed it in between


def _sign(descriptor: int) -> None:
    with suppress(OSError):  # a full disk: held all the same, by nobody in particular
        os.ftruncate(descriptor, 0)
        os.lseek(descriptor, 0, os.SEEK_SET)
        os.write(descriptor, f"process {os.getpid()} on {platform.node()}, since {_now()},".encode())


def _is(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.lstat())
    except FileNotFoundError:
        return False


def _now() -> str:
    return datetime.now().astimezone().isoformat(" ", "seconds")
