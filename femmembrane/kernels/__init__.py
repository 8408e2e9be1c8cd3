"""Kernels in two implementations: NumPy with LAPACK, and C where a compiler was found on installation. Kernels know no scene and decide
nothing. They evaluate, assemble, factor and multiply, and tolerances are handed to them. Iterations and decisions are written once, in
Python, over the interface of :mod:`.interface`. This module alone chooses the implementation. Without the extension module
``femmembrane._native`` (sources in ``compiled/``), or with ``FEMMEMBRANE_COMPILED=0`` in the environment, everything runs in NumPy and
gives the same answers to round-off.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

from .compiled_kernels import CompiledKernels
from .interface import Kernels
from .numpy_kernels import NumpyKernels

#: environment variable that switches the compiled implementation off
SWITCH = "FEMMEMBRANE_COMPILED"


def _choose() -> Kernels:
    numpy_kernels = NumpyKernels()
    return numpy_kernels if os.environ.get(SWITCH, "1") == "0" else CompiledKernels.load(numpy_kernels) or numpy_kernels


_active = _choose()


def kernels() -> Kernels:
    """The implementation in use."""
    return _active


@contextmanager
def in_numpy() -> Iterator[None]:
    """Compute in NumPy for a while, to compare; all threads of the process see it."""
    global _active
    before, _active = _active, NumpyKernels()
    try:
        yield
    finally:
        _active = before
