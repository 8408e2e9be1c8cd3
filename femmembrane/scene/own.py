"""Parts of a scene that somebody wrote in Python: materials, sources, loads, obstacles and shapes that no registry knows.

In tables such a part has the name ``module:Class``, with its arguments beside it, or ``module:object``. A module is imported only for a
scene file that a user names. Tables from a data file import nothing: there the parts come from a scene that is given beside the file.

A part that no module holds by its name (a class of a script, a function in the place of an object) has no form in scene files. Records of
a run name its class after a colon, ``:Class``, with a note.
"""

from __future__ import annotations

import importlib
import inspect
import sys
import uuid
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..physics.units import has_unit

if TYPE_CHECKING:
    from .value import Scene

#: beside the name of a part in records
NOTE = "given in Python; it has no form in scene files"
_NAME = "name_in_files"
#: this process
_PROCESS = uuid.uuid4().hex


class MissingPartError(InputError):
    """A part of one's own in tables that import nothing."""


class Parts:
    """Where parts of one's own come from: nowhere."""

    def part(self, path: str, selector: str, table: Mapping[str, Any]) -> Any:
        """The part that a table with a colon in its name describes.

        Raises
        ------
        InputError
            When it cannot be had.
        """
        advice = "a data file imports nothing: give the scene that has it, as load(path, scene=scene) or --scene FILE"
        more = "in Python Scene.from_toml and from_dict(..., own=True) import it"
        raise MissingPartError(f"{path}.{selector}", table[selector], f"it is no part of the package, and {advice}; {more}")

    def factor(self, key: str, value: str) -> Any:
        """The function along the meridian that a record names."""
        table, _, name = key.rpartition(".")
        return self.part(table, name, {name: value})


class Imported(Parts):
    """Parts imported from modules on the path of Python or in the folder of a scene file."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def part(self, path: str, selector: str, table: Mapping[str, Any]) -> Any:
        key, name = f"{path}.{selector}", str(table[selector])
        module, _, inside = name.partition(":")
        if not module:
            raise InputError(key, name, f"it was {NOTE}; module:Class is allowed")
        made = _found(key, name, self._imported(key, name, module), inside)
        if callable(made) and not isinstance(made, type):
            advice = f"an object made of it is allowed, such as {inside}_material = femmembrane.StrainEnergy({inside}) in that module"
            raise InputError(key, name, f"it is a function; {advice}")
        rest = _without(table, selector)
        if isinstance(made, type):
            return _made(path, made, rest)
        for other in rest:
            raise InputError(f"{path}.{other}", rest[other], f"not allowed: {name} is an object, which has its numbers; leave it out")
        with suppress(AttributeError, TypeError):  # an object without room for it is described by its class
            object.__setattr__(made, _NAME, name)
        return made

    def _imported(self, key: str, name: str, module: str) -> Any:
        folder = str(self.folder.resolve())
        if folder not in sys.path:  # it stays: processes that are started later look there too
            sys.path.append(folder)
        try:
            found = importlib.import_module(module)
        except Exception as error:  # there is nothing that a module of somebody's own could not raise
            reason = f"{type(error).__name__}: {error}"
            allowed = f"module:Class is allowed, of a module in the folder of the scene file or on the path of Python ({reason})"
            raise InputError(key, name, allowed) from error
        top = module.partition(".")[0]
        beside = any((self.folder / end).exists() for end in (f"{top}.py", f"{top}/__init__.py"))
        origin = getattr(found, "__file__", None)
        if beside and not (origin and Path(origin).resolve().is_relative_to(folder)):
            raise InputError(key, name, f"Python has another module {top}, of {origin}, in place of that beside the scene; rename one")
        return found


class Given(Parts):
    """Parts taken from a scene, place by place; with other numbers where a table has others."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def part(self, path: str, selector: str, table: Mapping[str, Any]) -> Any:
        home, _, place = path.rstrip("]").partition("[")
        if home in ("material", "mesh"):
            there = [getattr(self.scene, home)]
        else:
            there = list(getattr(self.scene, {"source": "sources", "load": "loads", "obstacle": "obstacles"}[home]))
        value = there[int(place or 0)] if int(place or 0) < len(there) else None
        own = {} if value is None else described(selector, value)
        if own.get(selector) != table[selector]:
            raise InputError("scene", value, f"the scene has another {path} than the tables, which have {table[selector]}")
        rest, numbers = _without(table, selector), _without(own, selector)
        return value if rest == numbers else _made(path, type(value), rest)

    def factor(self, key: str, value: str) -> Any:
        factor = getattr(self.scene, key.rsplit(".", 1)[1])
        given = getattr(factor, "given", factor)
        if function_name(given) != value:
            raise InputError("scene", given, f"the scene has another {key} than the tables, which have {value}")
        return given


def is_own(name: Any) -> bool:
    """Whether a name in tables is that of a part of one's own."""
    return isinstance(name, str) and ":" in name


def parts_from(own: bool | Scene, folder: Path) -> Parts:
    """Where parts come from: modules (True), nowhere (False) or a scene."""
    if isinstance(own, bool):
        return Imported(folder) if own else Parts()
    return Given(own)


def described(selector: str, value: Any) -> dict[str, Any]:
    """The table of a part of one's own: its name and arguments; the name of its class after a colon where it has no form in files."""
    if hasattr(value, _NAME):
        return {selector: getattr(value, _NAME)}
    cls = type(value)
    arguments = _numbers(value)
    if arguments is None:
        return {selector: f":{cls.__qualname__}", "note": NOTE}
    module = sys.modules.get(cls.__module__)
    named = cls.__module__ not in ("__main__", "__mp_main__") and _within(module, cls.__qualname__) is cls
    name = {selector: f"{cls.__module__}:{cls.__qualname__}"} if named else {selector: f":{cls.__qualname__}", "note": NOTE}
    return {**name, **arguments}


def function_name(function: Any) -> str:
    """What stands for a function along the meridian in records."""
    return f":{getattr(function, '__qualname__', type(function).__qualname__)}"


def own_identity(scene: Scene) -> list[str]:
    """What tells the parts of one's own apart beside their names and numbers: the text of their modules. A function, whose numbers nobody
    knows, is like none in another process.
    """
    factors = (getattr(factor, "given", None) for factor in (scene.thickness, scene.modulus, scene.remanence))
    functions = [factor for factor in factors if callable(factor)]
    return [
        _text_of(part)
        for part in (scene.material, *scene.sources, *scene.loads, *scene.obstacles, scene.mesh, *functions)
        if _foreign(part)
    ]


def _foreign(part: Any) -> bool:
    return hasattr(part, _NAME) or not type(part).__module__.startswith("femmembrane.") or _numbers(part) is None


def _text_of(part: Any) -> str:
    named: str | None = getattr(part, _NAME, None)
    module = sys.modules.get(named.partition(":")[0] if named else type(part).__module__)
    with suppress(OSError, TypeError):
        if module is not None and (named or _numbers(part) is not None):
            return inspect.getsource(module)
    return f"{_PROCESS} {id(part)}"


def _without(table: Mapping[str, Any], selector: str) -> dict[str, Any]:
    return {name: _tuples(value) for name, value in table.items() if name not in (selector, "note")}


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, (list, tuple)) else value


def _found(key: str, name: str, module: Any, inside: str) -> Any:
    found = _within(module, inside)
    if found is None:
        known = sorted(n for n, v in vars(module).items() if isinstance(v, type) and v.__module__ == module.__name__)
        raise InputError(key, name, f"its module has no {inside}; classes there: {', '.join(known) or 'none'}")
    return found


def _within(module: Any, inside: str) -> Any:
    for part in inside.split("."):
        module = getattr(module, part, None)
    return module


def _made(path: str, cls: type, arguments: Mapping[str, Any]) -> Any:
    known = _names(cls)
    for name in arguments:
        if name not in known:
            allowed = f"unknown; arguments of {cls.__name__}: {', '.join(known) or 'none'}"
            if path == "material" and has_unit(arguments[name]):
                allowed += "; the shear modulus in Pa is shear_modulus in [scales], and all else of a material is over it"
            raise InputError(f"{path}.{name}", arguments[name], allowed)
    try:
        return cls(**arguments)
    except TypeError as error:  # an argument is missing
        raise InputError(path, dict(arguments), f"the arguments of {cls.__name__} are needed ({error})") from error


def _names(cls: type) -> list[str]:
    if is_dataclass(cls):
        return [f.name for f in fields(cls) if f.init]
    return list(inspect.signature(cls).parameters)


def _numbers(value: Any) -> dict[str, Any] | None:
    """The arguments of a part, if they are numbers and texts."""
    try:
        found = {name: getattr(value, name) for name in _names(type(value))}
    except (AttributeError, ValueError, TypeError):  # arguments that it does not keep
        return None
    return {name: _tuples(part) for name, part in found.items() if part is not None} if all(map(_is_plain, found.values())) else None


def _is_plain(value: Any) -> bool:
    if isinstance(value, (list, tuple)):
        return all(map(_is_plain, value))
    return value is None or isinstance(value, (bool, int, float, str, np.generic))
