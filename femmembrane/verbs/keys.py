"""A scene with some of its keys changed, by their places in a scene file."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from ..errors import InputError


def set_key(tables: Mapping[str, Any], key: str, value: Any) -> dict[str, Any]:
    """The tables of a scene with one value changed or added; what was given stays as it is.

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
    if not isinstance(key, str) or not all(key.split(".")):
        raise InputError("key", key, "the place of a value in a scene file is allowed, such as mesh.elements or source.0.strength")
    changed = copy.deepcopy(dict(tables))
    place: Any = changed
    *path, last = key.split(".")
    for depth, name in enumerate(path):
        if isinstance(place, dict) and not name.isdigit():
            place = place.setdefault(name, {})
        else:
            place = place[_index(place, key, depth)]
    if isinstance(place, dict) and not last.isdigit():
        place[last] = value
    else:
        place[_index(place, key, len(path))] = value
    return changed


def _index(place: Any, key: str, depth: int) -> int:
    """The place in a list that a part of a key means."""
    names = key.split(".")
    owner, name = ".".join(names[:depth]) or "the scene", names[depth]
    if not isinstance(place, list):
        what = f"{owner} is no list in this scene, so that there is no {name} in it" if name.isdigit() else f"{owner} has no keys below it"
        raise InputError("key", key, f"{what}; keys such as mesh.elements and source.0.strength are allowed")
    if not name.isdigit() or int(name) >= len(place):
        raise InputError("key", key, f"{owner} is a list with the places 0 to {len(place) - 1}: {owner}.0 is the first")
    return int(name)
