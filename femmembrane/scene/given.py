"""Errors about converted numbers, with the numbers as the user wrote them.

Numbers in the units of a laboratory are converted before a scene is built. So its checks see numbers in the units of the package. The key
of an error is its path in the tables, and what stands there is what the user wrote.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from ..checks import is_number
from ..errors import InputError
from ..physics.units import has_unit
from .keys import set_key


@contextmanager
def shown_as_given(data: Any, over: Iterable[tuple[str, Any, Any]] = ()) -> Iterator[None]:
    """Let errors about converted numbers show them as they stand in the tables of a scene file.

    Parameters
    ----------
    data : mapping
        Tables in the units of a laboratory.
    over : iterable of (str, object, object), optional
        Values that take the place of those in the tables, one scene for each: their key, as given, and converted.
    """
    try:
        yield
    except InputError as error:
        for key, one, value in over:
            if _same(value, error.value):
                data = set_key(data, key, one)
        given = _given(data, error.key)
        if given is None or not _is_measured(given, data.get("units") == "si") or _same(given, error.value):
            raise
        # bounds in the message are those of the converted number; the number of a list is another one, such as its sum
        converted = f" (converted: {error.value:.6g})" if is_number(error.value) and not isinstance(given, (list, tuple)) else ""
        raise InputError(error.key, given, error.allowed + converted) from None


def _given(data: Any, key: str) -> Any:
    """What stands at the key of an error, such as ``run.values[0]``; None where nothing does. A single source has no number in its key."""
    for name in re.findall(r"[^.\[\]]+", key):
        if isinstance(data, (list, tuple)) and not name.isdigit() and len(data) == 1:
            data = data[0]
        if isinstance(data, Mapping):
            data = data.get(name)
        elif isinstance(data, (list, tuple)) and name.isdigit() and int(name) < len(data):
            data = data[int(name)]
        else:
            return None
    return data


def _is_measured(given: Any, si: bool) -> bool:
    if isinstance(given, (list, tuple)):
        return any(_is_measured(one, si) for one in given)
    return has_unit(given) or (si and is_number(given))


def _same(given: Any, value: Any) -> bool:
    if isinstance(given, (list, tuple)) and isinstance(value, (list, tuple)):
        return len(given) == len(value) and all(map(_same, given, value))
    return bool(type(given) is type(value) or (is_number(given) and is_number(value))) and bool(given == value)
