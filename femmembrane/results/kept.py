"""Finished scenes of a sweep on disk: one SQLite file, in which a scene is whole or not at all.

The file is open to one process at a time. A process that is killed loses no scene that it had put there.
"""

from __future__ import annotations

import json
import sqlite3
from os import PathLike
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from ..errors import InputError

_ALLOWED = "a folder that one sweep at a time may write to is needed"


class Kept:
    """Values by key, as JSON texts; arrays become lists, and numbers come back to the last bit.

    Parameters
    ----------
    path : path
        The file, made with its folder when there is none.

    Raises
    ------
    InputError
        When it cannot be made or written to, is not such a file, or belongs to another process at the moment.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        self.path = Path(path)
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = sqlite3.connect(self.path, timeout=0.2, isolation_level=None)
        except (OSError, ValueError, sqlite3.Error) as error:
            raise InputError("out", str(self.path.parent), f"{_ALLOWED} ({error})") from None
        try:
            self._file.execute("PRAGMA locking_mode = EXCLUSIVE")
            self._file.execute("PRAGMA journal_mode = WAL")
            self._file.execute("PRAGMA synchronous = NORMAL")
            self._file.execute("CREATE TABLE IF NOT EXISTS scene (key TEXT PRIMARY KEY, row TEXT NOT NULL) WITHOUT ROWID")
            self._file.execute("PRAGMA user_version = 1")  # writes, and so takes the lock
        except sqlite3.Error as error:
            self._file.close()
            raise InputError("out", str(self.path.parent), f"{_ALLOWED} ({self.path.name}: {error})") from None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        self._file.close()

    def get(self, key: str) -> dict[str, Any] | None:
        """The value of a key, or None."""
        found = self._file.execute("SELECT row FROM scene WHERE key = ?", (key,)).fetchone()
        return None if found is None else json.loads(found[0])

    def put(self, key: str, value: dict[str, Any]) -> None:
        """Keep a value.

        Raises
        ------
        InputError
            When it cannot be written; what was kept before is still there.
        """
        text = json.dumps(value, default=_plain)
        try:
            self._file.execute("INSERT OR REPLACE INTO scene VALUES (?, ?)", (key, text))
        except sqlite3.Error as error:
            raise InputError("out", str(self.path.parent), f"a folder with room for the results is needed ({error})") from None


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else str(value)
