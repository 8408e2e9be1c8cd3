"""Matplotlib without windows, in any surroundings."""

from __future__ import annotations

import importlib
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

#: characters of a title that are drawn
_TITLE = 120


def load() -> None:
    """Import Matplotlib, also where ``MPLBACKEND`` names a backend that does not exist.

    A notebook hands its backend on to every process that it starts. Matplotlib refuses to be imported when it cannot find this backend.
    Figures of this package are drawn to files, for which no backend is needed.
    """
    try:
        importlib.import_module("matplotlib")
    except ValueError:
        name = os.environ.pop("MPLBACKEND", None)
        if name is None:
            raise
        try:
            importlib.import_module("matplotlib")
        finally:
            os.environ["MPLBACKEND"] = name


def title_text(text: str) -> str:
    """A title on one line, short enough to leave room for a picture; it is to be drawn with ``parse_math=False``."""
    line = " ".join(text.split())
    return line if len(line) <= _TITLE else line[: _TITLE - 1] + "…"


@contextmanager
def drawing() -> Iterator[None]:
    """While a figure is written: a character that no font has is drawn as a box, without a word."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from", category=UserWarning)
        warnings.filterwarnings("ignore", message="Matplotlib currently does not support", category=UserWarning)
        yield
