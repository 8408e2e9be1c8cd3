"""A scene with some of its keys changed, by their places in a scene file."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ..checks import LARGEST
from ..errors import InputError

#: most scenes of a sweep: each is checked and has a key before the first is computed
MAX_SCENES = 10**5
#: names in a key
_DEPTH = 20


def set_key(tables: Mapping[str, Any], key: str, value: Any) -> dict[str, Any]:
    """The tables of a scene with one value changed or added; the given tables do not change.

    Parameters
    ----------
    tables : mapping
        As in a scene file (:meth:`Scene.to_dict`).
    key : str
        Tables, places in lists (from 0) and names, joined by dots: ``mesh.elements``, ``source.0.strength``, ``run.until.center_height``.
    value : object
        Not checked here, and nor is the last name: ``Scene.from_dict`` does both.

    Raises
    ------
    InputError
        For a key that leads nowhere.
    """
    if not isinstance(key, str) or not all(key.split(".")) or key.count(".") >= _DEPTH:
        raise InputError("key", key, "the place of a value in a scene file is allowed, such as mesh.elements or source.0.strength")
    changed = dict(tables)
    place: Any = changed
    *path, last = key.split(".")
    for depth, name in enumerate(path):
        where = name if isinstance(place, dict) else _index(place, key, depth)
        if name in ("source", "load") and place is changed and name not in place:  # other names are refused with the nearest one, there
            raise InputError("key", key, f"there is no {name} whose keys could be set; the whole list is allowed, under {name}")
        inner = copy.copy(place.get(where, {}) if isinstance(place, dict) else place[where])  # what is not on the way is shared
        place[where] = inner
        place = inner
    place[last if isinstance(place, dict) else _index(place, key, len(path))] = value
    return changed


def values_of(option: str, text: str) -> tuple[str, tuple[Any, ...]]:
    """A key and its values from KEY=START:STOP:COUNT or KEY=V1,V2,... A value that is no TOML counts as a text.

    Raises
    ------
    InputError
        Naming the option, for anything else.
    """
    key, equals, values = text.partition("=")
    allowed = "KEY=START:STOP:COUNT or KEY=V1,V2,... is allowed, such as source.0.strength=50:1000:40 or mesh.elements=16,32,64"
    if not (key and equals and values):
        raise InputError(option, text, allowed)
    if ":" not in values:
        return key, tuple(_value(word.strip()) for word in values.split(","))
    try:
        start, stop, count = values.split(":")
        ends, number = (float(start), float(stop)), int(count)
    except ValueError:
        raise InputError(option, text, allowed) from None
    if max(abs(end) for end in ends) > LARGEST or not np.isfinite(ends).all() or number < 1 or (number > 1) == (ends[0] == ends[1]):
        raise InputError(option, text, f"START:STOP:COUNT takes two different numbers of a size up to {LARGEST:g} and a whole number >= 2")
    if number > MAX_SCENES:
        raise InputError(option, text, f"{number} values; a sweep of up to {MAX_SCENES} scenes is allowed")
    return key, tuple(np.linspace(*ends, number).tolist())


def set_all(option: str, tables: Mapping[str, Any], texts: Iterable[str]) -> dict[str, Any]:
    """The tables of a scene with values changed or added by texts KEY=VALUE, one after the other. A value that is no TOML counts as a text.

    Raises
    ------
    InputError
        Naming the option, for another text, a key that leads nowhere, or one that is set twice.
    """
    changed, seen = dict(tables), set()
    for text in texts:
        key, _, value = (part.strip() for part in text.partition("="))
        if not (key and value):
            raise InputError(option, text, "KEY=VALUE is allowed, such as mesh.elements=128 or 'run.until={volume=10}'")
        if key in seen:
            raise InputError(option, text, f"{key} is set already; each key once is allowed")
        seen.add(key)
        try:
            changed = set_key(changed, key, _value(value))
        except InputError as error:
            raise InputError(option, text, error.allowed) from None
    return changed


def _value(word: str) -> Any:
    try:
        found = tomllib.loads(f"value = {word}")
    except (ValueError, RecursionError):  # ValueError: no TOML, or a whole number of thousands of digits
        return word
    return found["value"] if len(found) == 1 else word  # more than one: a text of several lines


def _index(place: Any, key: str, depth: int) -> int:
    """The place in a list that a part of a key stands for."""
    names = key.split(".")
    owner, name = ".".join(names[:depth]) or "the scene", names[depth]
    if not isinstance(place, list):
        raise InputError("key", key, f"{owner} has no keys below it; keys such as mesh.elements and source.0.strength are allowed")
    if not name.isdigit() or int(name) >= len(place):
        raise InputError("key", key, f"{owner} is a list with the places 0 to {len(place) - 1}: {owner}.0 is the first")
    return int(name)
