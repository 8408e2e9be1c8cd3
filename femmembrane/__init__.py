"""Axisymmetric hyperelastic membranes in a magnetic field: equilibria by energy minimisation, and their stability.

The public names stand in ``__init__.pyi``. They are imported when they are first used, so that ``femmembrane --help`` need not wait for the
numerics.
"""

from typing import Any

import lazy_loader

__version__ = "0.1.0"

_imported, _, _names = lazy_loader.attach_stub(__name__, __file__)
__all__ = ["__version__", *_names]


def __getattr__(name: str) -> Any:
    if name not in _names:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from .threads import WHOLE

    with WHOLE:  # a process that is forked in the middle of an import could never finish the import
        value = _imported(name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
