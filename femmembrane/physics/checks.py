"""Checks of single values."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

from ..errors import InputError

#: largest size of a number in a scene: its powers, as in the field of a dipole, are still numbers, and nothing physical comes near
LARGEST = 1e30
#: what is smaller is 0 to round-off, also where its third root counts
SMALLEST = 1e-100


def as_float(value: object) -> float:
    """A value as a float; NaN for what is no number, as truth values are none, and infinity for what no float can hold."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return math.nan
    try:
        return float(value)
    except OverflowError:  # a whole number that no float can hold
        return math.inf


def is_number(value: object) -> bool:
    """Whether a value is a finite number, NumPy's included; truth values are none."""
    return math.isfinite(as_float(value))


def number(key: str, value: object, allowed: str, *, least: float = -math.inf, above: float = -math.inf, most: float = LARGEST) -> float:
    """A finite number as a float, whatever type it comes in; one that is 0 to round-off, -0 included, is 0.

    Parameters
    ----------
    key : str
        Its name, for the error.
    allowed : str
        What is allowed, for the error.
    least, above : float
        Bounds from below, with and without themselves.
    most : float
        Bound of its size.

    Raises
    ------
    InputError
    """
    found = as_float(value)
    if 0 < abs(found) < SMALLEST:
        found, allowed = 0.0, f"{allowed}; less than {SMALLEST:g} counts as 0"
    if not (found >= least and found > above and math.isfinite(found)):
        raise InputError(key, value, allowed)
    if abs(found) > most:
        raise InputError(key, value, f"{allowed}, of a size up to {most:g}")
    return found + 0.0


def convert(target: Any, key: str, allowed: str, *, least: float = -math.inf, above: float = -math.inf, most: float = LARGEST) -> None:
    """Turn an attribute of a frozen object, the last part of its key, into a float as :func:`number` does."""
    name = key.rpartition(".")[2]
    object.__setattr__(target, name, number(key, getattr(target, name), allowed, least=least, above=above, most=most))
