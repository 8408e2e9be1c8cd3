"""How files are opened: only regular ones, never through a link when they are written, and with a digest where damage would pass unseen.

Until it is whole, a file has a name that nobody else can guess (:func:`claimed`). It is locked meanwhile: so the leftovers of a killed
process can be told from a file that a living process is still writing (:func:`remove_leftovers`).

A sealed file ends in a digest of all that stands before it (:func:`sealed`). HDF5 ignores what follows its data, so that every reader of
NetCDF opens such a file as any other.
"""

from __future__ import annotations

import csv
import errno
import hashlib
import hmac
import os
import re
import secrets
import stat
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import InputError

#: words that a sealed file has in its attributes, and before the digest at its end
SEAL = "femmembrane seal, BLAKE2b-256:"
_DIGITS = 64
_LEFTOVER = re.compile(r"\.femmembrane-[0-9a-f]{16}(\..*)?")
#: seconds after which a file of unknown owner counts as left behind, where the system has no locks that say so
_OLD = 86400.0
#: what is no regular file
_KINDS = {
    stat.S_IFLNK: "a link",
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}
_READ = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
_OWN = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)


def read_bytes(path: str | os.PathLike[str], most: int = -1) -> bytes:
    """The content of a file, or its first ``most`` bytes. A pipe is refused, since it may never end.

    Raises
    ------
    OSError
        When it cannot be read or is a pipe or a socket.
    ValueError
        For a path that no system allows.
    """
    descriptor = os.open(path, _READ)
    with os.fdopen(descriptor, "rb") as file:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode):
            raise OSError(errno.EINVAL, "a pipe, not a file")
        return file.read(most)


def temporary_name(path: Path) -> Path:
    """A name in the folder of a path, with its suffix, that nobody can guess."""
    return path.with_name(f".femmembrane-{secrets.token_hex(8)}{path.suffix}")


@contextmanager
def claimed(path: Path) -> Iterator[None]:
    """Make an empty file, and hold it so that :func:`remove_leftovers` of another process lets it be.

    Raises
    ------
    OSError
        When there is something by this name, a link included, or none can be made.
    """
    descriptor = os.open(path, _OWN | os.O_EXCL, 0o666)
    try:
        if sys.platform == "win32":  # which does not rename a file that is open
            os.close(descriptor)
            descriptor = -1
        else:
            lock(descriptor)
        yield
    finally:
        if descriptor >= 0:
            os.close(descriptor)


@contextmanager
def replace_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Write a file whole or not at all.

    Yields the name of a temporary file in the same folder, with the same suffix. When the block ends well it takes the place of ``path``
    in one step; when the block raises, ``path`` stays as it was and the temporary file is gone.

    Raises
    ------
    InputError
        When the folder does not exist or cannot be written to, or when a link, a pipe, a device or a folder has the name: none is replaced.
    """
    path = Path(path)
    if not path.name or "\0" in str(path):
        raise InputError("path", str(path), "the name of a file in an existing, writable folder is needed")
    _refuse_irregular(path)
    temporary = temporary_name(path)
    try:
        with claimed(temporary):
            yield temporary
            _refuse_irregular(path)  # it may have come in between
            os.replace(temporary, path)
    except (FileNotFoundError, NotADirectoryError, IsADirectoryError, PermissionError) as error:
        raise InputError("path", str(path), f"a file in an existing, writable folder is needed ({error.strerror})") from error
    finally:
        if temporary.parent.is_dir():
            temporary.unlink(missing_ok=True)


def _refuse_irregular(path: Path) -> None:
    if what := strange(path):
        raise InputError("path", str(path), f"it is {what}, which no file replaces; another name is allowed")


def write_csv(path: str | os.PathLike[str], header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a table of comma-separated values under a header line, whole or not at all.

    Numbers are written so that they read back to the last bit; None is an empty cell.

    Raises
    ------
    InputError
        As :func:`replace_file`.
    """
    with replace_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)


def remove_leftovers(folder: Path) -> None:
    """Remove the unfinished files of killed processes from a folder. Files that are being written stay."""
    with suppress(OSError):
        for entry in list(os.scandir(folder)):
            if _LEFTOVER.fullmatch(entry.name) and entry.is_file(follow_symlinks=False):
                with suppress(OSError):
                    if _abandoned(entry.path):
                        os.unlink(entry.path)


def _abandoned(path: str) -> bool:
    if sys.platform == "win32":
        return time.time() - os.stat(path).st_mtime > _OLD
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        held = lock(descriptor)
        return held is True or (held is None and time.time() - os.fstat(descriptor).st_mtime > _OLD)
    finally:
        os.close(descriptor)


def lock(descriptor: int) -> bool | None:
    """Lock a file until it is closed. Answers whether that succeeded, or None on a file system without locks."""
    try:
        if sys.platform == "win32":
            import msvcrt

            # one byte far behind the text, so that others can read who holds the file
            os.lseek(descriptor, 1 << 30, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    except OSError:
        return None
    return True


def own_file(path: Path) -> int:
    """The descriptor of a file that is written in place; the file is made if it does not exist.

    Raises
    ------
    InputError
        When something else has its name: a link, a pipe, a folder, or a file with a second name elsewhere, which would change with it.
    """
    refuse_strange(path)
    try:
        descriptor = os.open(path, _OWN, 0o644)
    except OSError as error:
        raise _unusable(path, error.strerror or str(error)) from None
    facts = os.fstat(descriptor)
    if not stat.S_ISREG(facts.st_mode) or facts.st_nlink > 1:  # it changed in between
        os.close(descriptor)
        raise _unusable(path, "no regular file")
    return descriptor


def refuse_strange(path: Path) -> None:
    """Refuse to write in place to anything but a regular file with one name. The file need not exist yet.

    Raises
    ------
    InputError
        As :func:`own_file`.
    """
    try:
        facts = path.lstat()
    except OSError:
        return
    if not stat.S_ISREG(facts.st_mode):
        raise _unusable(path, strange(path) or "no regular file")
    if facts.st_nlink > 1:
        raise _unusable(path, "it has a second name elsewhere")


def _unusable(path: Path, reason: str) -> InputError:
    return InputError("--out", str(path.parent), f"{path.name} in it cannot be used ({reason}); remove it, or choose another folder")


def refuse_obstacles(folder: Path, names: Iterable[str], folders: Iterable[str] = ()) -> None:
    """Refuse a folder in which results could not take their places.

    Raises
    ------
    InputError
        When a directory, a link, a pipe or a device has the name of a file, or anything but a directory that of a directory.
    """
    for name in names:
        if what := strange(folder / name):
            raise InputError("--out", str(folder), f"{name} in it is {what}, where a file is to be written; remove it, or choose another")
    for name in folders:
        refuse_no_folder(folder / name, "--out")


def strange(path: Path) -> str:
    """What stands in the place of a file, in words such as "a link"; empty for a regular file, and where there is nothing."""
    try:
        mode = path.lstat().st_mode
    except OSError:
        return ""
    return "" if stat.S_ISREG(mode) else _KINDS.get(stat.S_IFMT(mode), "no regular file")


def refuse_no_folder(path: Path, key: str = "path") -> None:
    """Refuse anything but a folder in the place of a folder of results, also a link to one: nothing is written or removed elsewhere.

    Raises
    ------
    InputError
        When there is such a thing.
    """
    if path.is_symlink() or (os.path.lexists(path) and not path.is_dir()):
        what = "a link" if path.is_symlink() else "no folder"
        raise InputError(key, str(path), f"{what}, where a folder of results is to be written; remove it, or choose another place")


def sealed(content: bytes | memoryview) -> bytes:
    """Content with a digest of it at its end."""
    return b"".join([content, _line(_digest(content))])


def unsealed(content: bytes) -> tuple[bytes, bool]:
    """The content of a file without its seal, and whether it had one.

    Raises
    ------
    ValueError
        When the content is not what was sealed.
    """
    line = len(_line(""))
    body, end = content[: -line - _DIGITS], content[-line - _DIGITS :]
    if len(end) == line + _DIGITS and hmac.compare_digest(end, _line(_digest(body))):
        return body, True
    if SEAL.encode() in content:
        raise ValueError("it was damaged or changed after it was written")
    return content, False


def _digest(content: bytes | memoryview) -> str:
    return hashlib.blake2b(content, digest_size=_DIGITS // 2).hexdigest()


def _line(digest: str) -> bytes:
    return f"\n{SEAL} {digest}\n".encode()
