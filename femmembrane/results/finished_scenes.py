"""Finished scenes of a sweep on disk: one SQLite file, in which a scene is whole or not at all.

The file is open to one process at a time. A killed process loses no scene that it had stored. Each row carries a digest of itself and its
key; a row whose bytes have changed does not count.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from os import PathLike
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from ..errors import InputError
from ..files import refuse_strange

_ALLOWED = "a folder that one sweep at a time may write to is needed"
#: what SQLite writes beside its file
_BESIDE = ("", "-wal", "-journal", "-shm")


class FinishedScenes:
    """Values by key, as JSON texts; arrays become lists, and numbers come back to the last bit.

    Parameters
    ----------
    path : path
        The file, made with its folder when there is none.

    Raises
    ------
    InputError
        When it cannot be made or written to, is not such a file or damaged, is a link, or belongs to another process at the moment.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        self.path = Path(path)
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            for end in _BESIDE:  # SQLite itself follows links
                refuse_strange(self.path.with_name(self.path.name + end))
            self._file = sqlite3.connect(self.path, timeout=0.2, isolation_level=None)
        except InputError:
            raise
        except (OSError, ValueError, sqlite3.Error) as error:
            raise InputError("out", str(self.path.parent), f"{_ALLOWED} ({error})") from None
        try:
            self._file.execute("PRAGMA locking_mode = EXCLUSIVE")
            self._file.execute("PRAGMA journal_mode = WAL")
            self._file.execute("PRAGMA synchronous = NORMAL")
            self._file.execute("CREATE TABLE IF NOT EXISTS scene (key TEXT PRIMARY KEY, row TEXT NOT NULL) WITHOUT ROWID")
            self._file.execute("PRAGMA user_version = 1")  # writes, and so takes the lock
            found = self._file.execute("PRAGMA quick_check(1)").fetchall()
            self._file.execute("SELECT key, row FROM scene LIMIT 1").fetchall()
        except (sqlite3.Error, ValueError) as error:  # ValueError: something that should be text is not
            found = [(error,)]
        if found != [("ok",)]:
            self._file.close()
            lost = "" if "locked" in str(found) else "; without that file all scenes are computed again"
            raise InputError("out", str(self.path.parent), f"{_ALLOWED} ({self.path.name}: {found[0][0]}){lost}")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        self._file.close()

    def get(self, key: str) -> dict[str, Any] | None:
        """The value of a key; None without a value, and for a value that has changed since it was stored."""
        try:
            found = self._file.execute("SELECT row FROM scene WHERE key = ?", (key,)).fetchone()
            digest, text = found[0].split(" ", 1) if found else ("", "")
            value = json.loads(text) if digest == _digest(key, text) else None
        except (sqlite3.DatabaseError, AttributeError, TypeError, ValueError, RecursionError):
            return None
        return value if isinstance(value, dict) else None

    def put(self, key: str, value: dict[str, Any]) -> None:
        """Keep a value.

        Raises
        ------
        InputError
            When it cannot be written; what was kept before is still there.
        """
        text = json.dumps(value, default=_plain)
        try:
            self._file.execute("INSERT OR REPLACE INTO scene VALUES (?, ?)", (key, f"{_digest(key, text)} {text}"))
        except sqlite3.Error as error:
            raise InputError("out", str(self.path.parent), f"a folder with room for the results is needed ({error})") from None


def _digest(key: str, text: str) -> str:
    return hashlib.blake2b(f"{key} {text}".encode(), digest_size=16).hexdigest()


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else str(value)
