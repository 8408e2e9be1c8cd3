"""The compiled half, if there is one.

The extension module ``femmembrane._native`` (sources in ``compiled/``) does what the package does in NumPy: point functions, assembly, band
factors and eigenvalue iterations, with the same formulas. It knows no scene, and decides nothing. It is built on installation where a C
compiler is found; without it, or with ``FEMMEMBRANE_COMPILED=0`` in the environment, everything runs in NumPy and gives the same answers to
round-off.
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

#: environment variable that switches the compiled half off
SWITCH = "FEMMEMBRANE_COMPILED"
#: what the sources in ``compiled/`` answer; raised there and here when arguments or answers change
INTERFACE = 2


def _load() -> ModuleType | None:
    if os.environ.get(SWITCH, "1") == "0":
        return None
    try:
        module = importlib.import_module("femmembrane._native")
    except ImportError:
        return None
    # one that an earlier state of the sources left behind is as good as none
    return module if getattr(module, "INTERFACE", 0) == INTERFACE else None


_module = _load()


def native() -> ModuleType | None:
    """The extension module, or None where the package runs in NumPy alone."""
    return _module


@contextmanager
def in_numpy() -> Iterator[None]:
    """Leave the compiled half aside for a while, to compare; all threads of the process see it."""
    global _module
    before, _module = _module, None
    try:
        yield
    finally:
        _module = before
