"""Point expressions that scenes of one structure share: built once, with symbols in the place of the scenes' numbers.

Two scenes have the same structure where they differ only in numbers that the formulas take as symbols: strength or height of a source,
number of a load, susceptibility, number of a material. A number that is 0 belongs to the structure, as terms may be missing with it. Whole
numbers, exponents of Ogden's material and whatever else Python decides by belong to it as well.

A template is a CasADi function of the symbols of a point and the numbers. Called with the numbers of a scene it gives the expressions of
that scene, with constants folded. It follows from the structure alone. So a scene has the same expressions whichever scenes came before.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import lru_cache
from types import FunctionType, SimpleNamespace
from typing import Any, NamedTuple

import casadi as ca

from ..physics.along import Along
from ..physics.loads import on_hubs
from ..physics.materials import Ogden
from ..physics.tabulated import Tabulated

#: numbers by which Python decides, or from which more was computed when the object was made
_FIXED: dict[type, frozenset[str]] = {
    Ogden: frozenset({"alpha"}),
    Tabulated: frozenset({"rho", "z", "h_rho", "h_z", "tolerance"}),
}
#: attributes of a scene that enter as columns of data, through the sources and loads that act, or not at all
_ELSEWHERE = frozenset(
    {
        *("mesh", "degree", "element_ends", "prestretch", "thickness", "modulus", "sources", "loads"),
        *(
            "obstacles",
            "bodies",
            "borders",
            "title",
            "run",
            "analysis",
            "scales",
            "radius_to_thickness",
            "chamber",
            "electric",
            "bending",
            "squeezed",
        ),
    }
)
_PACKAGE = __name__.partition(".")[0] + "."

Symbols = tuple[ca.SX, ca.SX, ca.SX]
Terms = dict[str, ca.SX]


class _Number:
    """Stands in a structure where a scene has a number."""


class _Whole(NamedTuple):
    """An object in a structure: its class and its attributes, each a structure."""

    kind: Any
    names: tuple[str, ...]
    parts: tuple[Any, ...]


class _Frame(NamedTuple):
    """What point expressions ask of a space and of the columns of data."""

    columns: tuple[str, ...]
    lids: bool
    side: int
    hubs: tuple[bool, ...] | None


class _ForeignError(Exception):
    """An object of a class that the package does not know."""


def expressions_of(
    build: Callable[..., tuple[Symbols, Terms]],
    scene: Any,
    sources: Sequence[Any],
    loads: Sequence[Any],
    columns: tuple[str, ...],
    space: Any,
    forces: tuple[Any, Any] | None,
) -> tuple[Symbols, Terms]:
    """What ``build``, :func:`.expressions.point_expressions`, answers for a scene, by the template of its structure.

    A scene with a material, source or load of one's own has no template, and is built by itself. To be used under
    :data:`.expressions.BUILDING`.
    """
    hubs = None if forces is None else tuple(bool(end.rigid) for end in space.supports)
    numbers: list[Any] = []
    try:
        attributes = {f.name for f in dataclasses.fields(scene)} if dataclasses.is_dataclass(scene) else set(vars(scene))
        members = {name: getattr(scene, name) for name in sorted((attributes | {"electricity"}) - _ELSEWHERE)}
        parts = SimpleNamespace(**members), tuple(sources), tuple(loads)
        structure = tuple(_structure(part, numbers) for part in parts)
        hash(structure)
    except (_ForeignError, TypeError):  # a TypeError: something in it has no hash
        return build(scene, sources, loads, columns, space, forces)
    found = _template(build, structure, len(numbers), _Frame(columns, bool(space.lids), space.side, hubs))
    if found is None:
        return build(scene, sources, loads, columns, space, forces)
    function, names = found
    data, local, parameters = (ca.SX.sym(function.name_in(k), function.size1_in(k)) for k in range(3))
    terms = function.call([data, local, parameters, ca.vertcat(ca.SX(0, 1), *numbers)])
    return (data, local, parameters), dict(zip(names, terms, strict=True))


def _structure(value: Any, numbers: list[Any], fixed: bool = False) -> Any:
    """The structure of an object; the numbers in it are added to a list."""
    if isinstance(value, ca.SX) or (isinstance(value, float) and value != 0 and not fixed):
        numbers.append(value)
        return _Number
    if value is None or isinstance(value, (bool, int, float, str, frozenset, FunctionType, Along)):
        return value  # a factor along the meridian enters as a column of data
    kind = type(value)
    if kind is tuple:
        return _Whole(tuple, (), tuple(_structure(part, numbers, fixed) for part in value))
    if kind is not SimpleNamespace and not (dataclasses.is_dataclass(value) and kind.__module__.startswith(_PACKAGE)):
        raise _ForeignError
    names, own = tuple(vars(value)), _FIXED.get(kind, frozenset())
    known = {f.name for f in dataclasses.fields(value)} if dataclasses.is_dataclass(value) else set(names)
    parts = (_structure(part, numbers, fixed or name in own or name not in known) for name, part in vars(value).items())
    return _Whole(kind, names, tuple(parts))


def _built(structure: Any, numbers: list[ca.SX]) -> Any:
    """An object of a structure with the next symbols of a list as its numbers. It is not checked, and formulas alone may use it."""
    if structure is _Number:
        return numbers.pop(0)
    if not isinstance(structure, _Whole):
        return structure
    parts = [_built(part, numbers) for part in structure.parts]
    if structure.kind is tuple:
        return tuple(parts)
    made = structure.kind.__new__(structure.kind)
    for name, part in zip(structure.names, parts, strict=True):
        object.__setattr__(made, name, part)
    return made


@lru_cache(maxsize=64)
def _template(
    build: Callable[..., tuple[Symbols, Terms]], structure: tuple[Any, ...], count: int, frame: _Frame
) -> tuple[ca.Function, tuple[str, ...]] | None:
    """(data, local, parameters, numbers) -> terms, with the names of the terms; None where the formulas take no symbols."""
    numbers = ca.SX.sym("numbers", count)
    left = [numbers[k] for k in range(count)]
    scene, sources, loads = (_built(part, left) for part in structure)
    space = SimpleNamespace(lids=frame.lids, side=frame.side)
    try:
        forces = None if frame.hubs is None else on_hubs(loads, frame.hubs)
        symbols, terms = build(scene, sources, loads, frame.columns, space, forces)
    except Exception:  # whatever a formula raises that wants a number: the scene itself is built then, and answers for its errors
        return None
    names = ["data", "local", "parameters", "numbers"]
    return ca.Function("template", [*symbols, numbers], list(terms.values()), names, list(terms), {"cse": True}), tuple(terms)
