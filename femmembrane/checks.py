"""Checks of single values, for arguments and for keys of scene files; each check is written once.

A check returns the value in its one true type, or raises :class:`.InputError` with the key and what is allowed. NumPy's numbers count as
numbers, and truth values do not.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping
from numbers import Real
from typing import Any

import numpy as np

from .errors import InputError, unknown_name

#: largest size of a number in a scene: its powers, as in the field of a dipole, are still finite, and no physical number comes near it
LARGEST = 1e30
#: smaller numbers are 0 to round-off, even where their third root counts
SMALLEST = 1e-100
#: entries of a list of sources, loads, verdicts or wave numbers
MAX_ITEMS = 10**4
FINITE = "a finite number is allowed"


def as_float(value: object) -> float:
    """A value as a float; NaN for anything but a number (truth values included), and infinity for numbers beyond the range of a float."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return math.nan
    try:
        return float(value)
    except OverflowError:  # a whole number that no float can hold
        return math.inf


def is_number(value: object) -> bool:
    """Whether a value is a finite number, NumPy's included. Truth values are not."""
    return math.isfinite(as_float(value))


def is_whole(value: object, least: int = 1, most: int | None = None) -> bool:
    """Whether a value is a whole number between two bounds, both included. 4.0 is not."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        return False
    return bool(least <= value and (most is None or value <= most))


def number(
    key: str, value: object, allowed: str = FINITE, *, least: float = -math.inf, above: float = -math.inf, most: float = LARGEST
) -> float:
    """A finite number of any type as a float. A number that is 0 to round-off, -0 included, becomes 0.

    Parameters
    ----------
    key : str
        Its name, for the error.
    value : object
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


def between(key: str, value: object, low: float, high: float, allowed: str = "", *, ends: bool = True) -> float:
    """A number between two bounds as a float.

    Parameters
    ----------
    key : str
    value : object
    low, high : float
    allowed : str
        What is allowed, for the error; left out: it is made of the bounds.
    ends : bool
        Whether the bounds themselves are allowed.

    Raises
    ------
    InputError
    """
    found = as_float(value)
    if not math.isfinite(found) or not (low <= found <= high if ends else low < found < high):
        raise InputError(key, value, allowed or f"a number from {low:g} to {high:g} is allowed")
    return found


def whole(key: str, value: Any, allowed: str = "", *, least: int = 1, most: int | None = None) -> int:
    """A whole number as an int.

    Parameters
    ----------
    key : str
    value : object
    allowed : str
        What is allowed, for the error; left out: it is made of the bounds.
    least, most : int
        Bounds, both included.

    Raises
    ------
    InputError
    """
    if not is_whole(value, least, most):
        bounds = f">= {least}" if most is None else f"from {least} to {most}"
        raise InputError(key, value, allowed or f"a whole number {bounds} is allowed")
    return int(value)


def switch(key: str, value: Any, allowed: str = "true or false is allowed") -> bool:
    """A truth value as a bool.

    Raises
    ------
    InputError
    """
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(key, value, allowed)
    return bool(value)


def sign(key: str, value: Any, allowed: str = "1 or -1 is allowed") -> int:
    """A direction or orientation, 1 or -1, as an int.

    Raises
    ------
    InputError
    """
    if as_float(value) not in (1.0, -1.0):
        raise InputError(key, value, allowed)
    return int(value)


def choice(key: str, value: Any, known: Iterable[str]) -> str:
    """A name out of a closed set.

    Raises
    ------
    InputError
        With the nearest name of the set.
    """
    names = list(known)
    if not isinstance(value, str) or value not in names:
        raise unknown_name(key, value, names)
    return value


def only(owner: str, given: Mapping[str, Any], allowed: str) -> tuple[str, Any]:
    """The name and value of the one argument that is given, out of several that exclude each other.

    Parameters
    ----------
    owner : str
        Who asks for it, for the error.
    given : mapping
        The arguments by their names; one that is None is not given.
    allowed : str
        What is allowed, for the error.

    Raises
    ------
    InputError
    """
    found = {name: value for name, value in given.items() if value is not None}
    if len(found) != 1:
        raise InputError(owner, sorted(found), allowed)
    return next(iter(found.items()))


def sequence(key: str, values: Any, allowed: str, most: int = MAX_ITEMS) -> tuple[Any, ...]:
    """The entries of a list or another iterable as a tuple. Texts and mappings are refused.

    Parameters
    ----------
    key : str
    values : iterable
    allowed : str
        What is allowed, for the error.
    most : int
        Number of entries; an iterable that goes on for ever is not read further.

    Raises
    ------
    InputError
    """
    if isinstance(values, (str, bytes, Mapping)):
        raise InputError(key, values, allowed)
    try:
        items = tuple(itertools.islice(values, most + 1))
    except TypeError:
        raise InputError(key, values, allowed) from None
    if len(items) > most:
        raise InputError(key, f"more than {most} entries", f"up to {most} are allowed")
    return items


def store(target: Any, **values: Any) -> None:
    """Put checked values in the place of attributes of a frozen object."""
    for name, value in values.items():
        object.__setattr__(target, name, value)


def convert(target: Any, key: str, allowed: str, *, least: float = -math.inf, above: float = -math.inf, most: float = LARGEST) -> None:
    """Turn an attribute of a frozen object, the last part of its key, into a float as :func:`number` does."""
    name = key.rpartition(".")[2]
    store(target, **{name: number(key, getattr(target, name), allowed, least=least, above=above, most=most)})
