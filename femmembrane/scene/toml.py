"""Scenes to and from tables: what a scene file holds.

A scene file has one table for each part; the keys of a table are the arguments of a class, or attributes of :class:`.Scene`::

    title                        Scene.title
    units                        "si" or "scaled": what numbers without a unit are (:mod:`.laboratory`, which comes before this)
    [material]  model, ...       a class of MATERIALS and its arguments
                name             or a real material by name, :func:`~femmembrane.material`
    [membrane]                   attributes of Scene, listed in SCENE_KEYS
    [[source]]  kind, ...        a class of SOURCES and its arguments
    [[load]]    kind, ...        a class of LOADS and its arguments
    [[obstacle]] kind, ...       a class of OBSTACLES and its arguments; of a mould also file, from the folder of the scene
    [mesh]      shape, ...       a class of SHAPES and its arguments; degree is an attribute of Scene
                file, ...        or a mesh file and what else FILE_KEYS lists; the scene keeps its points
    [electric]                   Electric
    [effects]                    attributes of Scene that are on or off
    [output]                     vtu: whether a run writes surfaces
    [run]                        Run
    [analysis]                   Analysis
    [scales]                     Scales
    [chamber]                    Chamber

A model, kind or shape with a colon is a part of one's own, :mod:`.own`.
A new model, source, load or shape is a line in its registry; a new key of a table is a line in SCENE_KEYS or a field of its class.
Values are checked where the objects are made, so that files and Python code meet the same errors, named by their key in a file.
"""

from __future__ import annotations

import dataclasses
import re
import tomllib
from collections.abc import Mapping
from dataclasses import fields
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import choice, number, sequence
from ..discretization.curve import Curve
from ..discretization.meridian import Disc, Meridian
from ..discretization.mesh_files import read_meridian
from ..discretization.shapes import Annulus, Cap, Sphere, Torus, Tube
from ..errors import InputError, unknown_name
from ..physics.along import Along
from ..physics.chamber import Chamber
from ..physics.electric import Electric
from ..physics.hooke import Hooke
from ..physics.invariant import ArrudaBoyce, ExtendedTube, Fung, Gent, LopezPamies, Yeoh
from ..physics.invariants import GentGent, Polynomial, VerondaWestmann
from ..physics.loads import HubForce, Hydrostatic, Weight
from ..physics.magnetics import Dipole
from ..physics.magnets import Magnet
from ..physics.materials import MooneyRivlin, NeoHookean, Ogden, Varga
from ..physics.named import material
from ..physics.obstacles import Ball, Cylinder, Mould, Plane
from ..physics.scales import Scales
from ..physics.sources import Loop, Solenoid, Uniform, Wire
from ..physics.tabulated import Tabulated
from .analysis import Analysis
from .own import Parts, described, function_name, is_own
from .run import Run

if TYPE_CHECKING:
    from .value import Scene

MATERIALS: dict[str, Any] = {
    "arruda-boyce": ArrudaBoyce,
    "extended-tube": ExtendedTube,
    "fung": Fung,
    "gent": Gent,
    "gent-gent": GentGent,
    "hooke": Hooke,
    "lopez-pamies": LopezPamies,
    "mooney-rivlin": MooneyRivlin,
    "neo-hookean": NeoHookean,
    "ogden": Ogden,
    "polynomial": Polynomial,
    "varga": Varga,
    "veronda-westmann": VerondaWestmann,
    "yeoh": Yeoh,
}
SOURCES: dict[str, Any] = {
    "dipole": Dipole,
    "loop": Loop,
    "magnet": Magnet,
    "solenoid": Solenoid,
    "tabulated": Tabulated,
    "uniform": Uniform,
    "wire": Wire,
}
LOADS: dict[str, Any] = {"hub-force": HubForce, "hydrostatic": Hydrostatic, "weight": Weight}
OBSTACLES: dict[str, Any] = {"ball": Ball, "cylinder": Cylinder, "mould": Mould, "plane": Plane}
SHAPES: dict[str, Any] = {
    "disc": Disc,
    "annulus": Annulus,
    "cap": Cap,
    "sphere": Sphere,
    "cylinder": Tube,
    "torus": Torus,
    "curve": Curve,
}
#: keys of [mesh] beside the file that holds the meridian
FILE_KEYS = ("group", "divisions", "first", "last", "accuracy")
SCENE_KEYS: dict[str, tuple[str, ...]] = {
    "membrane": (
        *("susceptibility", "radius_to_thickness", "thickness", "modulus", "prestretch"),
        *("saturation", "remanence", "remanence_direction", "remanence_transport"),
    ),
    "mesh": ("degree", "follow_borders"),
    "effects": ("tension_field", "demagnetization", "bending", "squeezed"),
    "output": ("vtu",),
}
#: attributes of Scene that may be functions along the meridian
_ALONG = ("thickness", "modulus", "remanence")
#: arguments of Electric whose keys are words that Python keeps for itself, or stand beside one
ELECTRIC_KEYS = {"start": "from", "stop": "to"}
#: largest size of a scene file, enough for a million elements by their radii; a stream without end is refused
MAX_BYTES = 2**25
#: other sources of an argument without a default, for the message when it is missing
_OTHERWISE = {
    (Dipole, "strength"): "give it, or scales.dipole_moment in A m^2, from which it follows",
    (Magnet, "strength"): "give it, or the remanence in T beside a table [scales]",
    (Scales, "shear_modulus"): "give it in Pa, or the moduli of [material] in Pa (or its name), from which it follows",
}
#: keys of a table from which an argument of its class follows
_INSTEAD: dict[Any, tuple[str, ...]] = {Magnet: ("remanence",)}


def read_tables(path: str | PathLike[str]) -> dict[str, Any]:
    """The tables of a scene file as they stand, unchecked: what :meth:`Scene.from_dict` takes.

    Raises
    ------
    InputError
        When the file cannot be read or is no TOML (with the line).
    """
    from ..files import read_bytes

    path = Path(path)
    try:
        data = read_bytes(path, MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            raise InputError("scene", str(path), f"larger than {MAX_BYTES} bytes; the path of a scene file (TOML) is allowed")
        text = data.decode("utf-8-sig")
    except (OSError, ValueError) as error:  # ValueError: not UTF-8, or a null character in the path
        if isinstance(error, UnicodeDecodeError):
            line = error.object.count(b"\n", 0, error.start) + 1
            raise InputError("scene", str(path), f"not UTF-8 text (line {line}); a scene file (TOML, UTF-8) is allowed") from None
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError("scene", str(path), f"cannot be read ({reason}); the path of a scene file (TOML) is allowed") from None
    try:
        return tomllib.loads(text.replace("\r\n", "\n"))
    except RecursionError:
        raise InputError("scene", str(path), "not a scene file: nested too deeply") from None
    except ValueError as error:
        where = f"at line {text.rstrip().count(chr(10)) + 1}, the end of the file"
        reason = re.sub("at end of document", where, str(error))
        raise InputError("scene", str(path), f"not valid TOML: {reason}{_line(text, reason)}") from None


def _line(text: str, reason: str) -> str:
    """The text of the line that a parser complains about."""
    found = re.search(r"at line (\d+)", reason)
    line = text.replace("\r\n", "\n").split("\n")[int(found[1]) - 1].strip() if found else ""
    shown = "".join(c if c.isprintable() else "?" for c in line[:60]) + ("..." if len(line) > 60 else "")
    return f": {shown}" if shown else ""


def scene_arguments(data: Mapping[str, Any], folder: Path, own: Parts) -> dict[str, Any]:
    """The arguments of :class:`.Scene` from the tables of a scene file.

    Parameters
    ----------
    data : mapping
    folder : Path
        Where the path of a mesh file starts from.
    own : Parts
        Where parts of one's own come from.

    Raises
    ------
    InputError
        For an unknown table or key (with the nearest valid name), a missing one, or a value that cannot be used.
    """
    if not isinstance(data, Mapping):
        raise InputError("scene", data, "a mapping of the tables of a scene file is allowed")
    _refuse_unknown("", data, ("title", "units", *_known_keys()))
    tables = {name: _table(name, data.get(name, {})) for name in _known_keys() if name not in ("source", "load", "obstacle")}
    arguments = {name: tables[table][name] for table, names in SCENE_KEYS.items() for name in names if name in tables[table]}
    for table in SCENE_KEYS.keys() - {"mesh"}:
        _refuse_unknown(table, tables[table], SCENE_KEYS[table])
    for name in _ALONG:
        if str(arguments.get(name, "")).startswith(":"):
            arguments[name] = own.factor(f"membrane.{name}", arguments[name])
    scales = _scales(tables) if "scales" in data else None
    return dict(
        material=material_of(tables["material"], own),
        sources=_build_list("source", SOURCES, data.get("source", ()), own, scales),
        loads=_build_list("load", LOADS, data.get("load", ()), own),
        obstacles=_build_list("obstacle", OBSTACLES, _with_points(data.get("obstacle", ()), folder), own),
        mesh=_build_mesh(tables["mesh"], folder, own),
        run=_build("run", Run, tables["run"]) if "run" in data else None,
        analysis=_build("analysis", Analysis, tables["analysis"]),
        title=data.get("title", ""),
        scales=scales,
        chamber=_build("chamber", Chamber, tables["chamber"]) if "chamber" in data else None,
        electric=_electric(tables["electric"]) if "electric" in data else None,
        **arguments,
    )


def _scales(tables: Mapping[str, Any]) -> Scales:
    if "shear_modulus" not in tables["scales"] and (advice := modulus_of_own(tables["material"])):
        raise InputError("scales.shear_modulus", None, f"missing; {advice}")
    made: Scales = _build("scales", Scales, tables["scales"])
    return made


def modulus_of_own(material: Any) -> str:
    """Where the shear modulus of a material of one's own stands, which no argument of its class can be; empty for one of the package."""
    if not isinstance(material, Mapping) or not is_own(material.get("model")):
        return ""
    beside = "" if "mu" not in material else ", in place of mu in [material]"
    return f"a material of one's own is over its shear modulus: give that here as shear_modulus in Pa{beside}"


def tables_of(scene: Scene, record: bool = False) -> dict[str, Any]:
    """A scene as the tables of a scene file, with plain values only; for a record with parts that have no form in such files as well.

    Raises
    ------
    InputError
        When a part has no form in scene files, and the tables are not for a record.
    """
    tables: dict[str, Any] = {
        "title": scene.title,
        "material": _describe_material(scene.material, record),
        **{table: {name: getattr(scene, name) for name in names} for table, names in SCENE_KEYS.items() if table != "mesh"},
        "source": [_describe("source", "kind", SOURCES, source, record) for source in scene.sources],
        "load": [_describe("load", "kind", LOADS, load, record) for load in scene.loads],
        "obstacle": [_describe("obstacle", "kind", OBSTACLES, body, record) for body in scene.obstacles],
        "mesh": {
            **_describe("mesh", "shape", SHAPES, scene.mesh, record),
            "degree": scene.degree,
            **({} if scene.follow_borders is None else {"follow_borders": scene.follow_borders}),
        },
        "run": _arguments(scene.run) if scene.run else {},
        "analysis": {name: value for name, value in _arguments(scene.analysis).items() if value is not False},
        "scales": _arguments(scene.scales) if scene.scales else {},
        "chamber": _arguments(scene.chamber) if scene.chamber else {},
        "electric": {} if scene.electric is None else {ELECTRIC_KEYS.get(k, k): v for k, v in _arguments(scene.electric).items()},
    }
    for name in _ALONG:
        given = getattr(getattr(scene, name), "given", None)
        if callable(given) and record:
            tables["membrane"][name] = function_name(given)
        elif callable(given):
            raise InputError(
                f"membrane.{name}", getattr(scene, name).given, "a function has no name in scene files; an expression or a table has"
            )
    tables["effects"] = {name: True for name, on in tables["effects"].items() if on}
    if scene.vtu:  # as in files that are older than the key
        del tables["output"]
    if scene.prestretch == 1:
        del tables["membrane"]["prestretch"]
    if scene.scales:  # which hold it already
        del tables["membrane"]["radius_to_thickness"]
    if scene.run and scene.run.control != "arc-length":
        del tables["run"]["max_steps"]
    plain: dict[str, Any] = _plain(tables)
    return {name: table for name, table in plain.items() if table not in ("", {}, [])}


def _known_keys() -> dict[str, set[str]]:
    """Keys of every table."""

    def arguments(*classes: Any) -> set[str]:
        return {f.name for c in classes for f in fields(c)}

    keys = {table: set(names) for table, names in SCENE_KEYS.items()}
    keys["material"] = {"model", "name"} | arguments(*MATERIALS.values())
    keys["source"] = {"kind", "remanence"} | arguments(*SOURCES.values())
    keys["load"] = {"kind"} | arguments(*LOADS.values())
    keys["obstacle"] = {"kind", "file", "unit"} | arguments(*OBSTACLES.values())
    keys["mesh"] |= {"shape", "file", "unit", *FILE_KEYS} | arguments(*SHAPES.values())
    keys["electric"] = {ELECTRIC_KEYS.get(name, name) for name in arguments(Electric)}
    return keys | {"run": arguments(Run), "analysis": arguments(Analysis), "scales": arguments(Scales), "chamber": arguments(Chamber)}


def _electric(table: Mapping[str, Any]) -> Electric:
    _refuse_unknown("electric", table, tuple(sorted(_known_keys()["electric"])))
    names = {key: name for name, key in ELECTRIC_KEYS.items()}
    return Electric(**{names.get(key, key): value for key, value in table.items()})


def _refuse_unknown(path: str, table: Mapping[str, Any], known: tuple[str, ...]) -> None:
    for name, value in table.items():
        if name not in known:
            key = f"{path}.{name}" if path else str(name)
            homes = [f"[{home}]" for home, keys in sorted(_known_keys().items()) if name in keys and home != path.split("[")[0]]
            hint = f"; {name} belongs in {' or '.join(homes)}" if homes else ""
            raise InputError(key, value, unknown_name(key, name, known).allowed + hint)


def _table(name: str, value: Any) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise InputError(name, value, f"a table is allowed: [{name}] with its keys below")
    return value


def _build(path: str, cls: Any, table: Mapping[str, Any], beside: tuple[str, ...] = ()) -> Any:
    """The object of a class from a table with its arguments. ``beside`` are further keys of the table, which are read elsewhere."""
    names = tuple(f.name for f in fields(cls))
    _refuse_unknown(path, table, (*beside, *names, *_INSTEAD.get(cls, ())))
    for f in fields(cls):
        if f.name not in table and f.default is f.default_factory is dataclasses.MISSING:
            raise InputError(f"{path}.{f.name}", None, "missing; " + _OTHERWISE.get((cls, f.name), "it has no default"))
    return cls(**{name: table[name] for name in names if name in table})


def _build_one_of(
    path: str, selector: str, registry: Mapping[str, Any], table: Mapping[str, Any], own: Parts | None, beside: tuple[str, ...] = ()
) -> Any:
    """The object of the class that a table names by its key ``selector``."""
    if selector not in table:
        raise InputError(f"{path}.{selector}", None, "missing; known: " + ", ".join(sorted(registry)))
    if own is not None and is_own(table[selector]):
        return own.part(path, selector, {name: value for name, value in table.items() if name not in beside})
    choice(f"{path}.{selector}", table[selector], registry)
    return _build(path, registry[table[selector]], table, (selector, *beside))


def material_of(table: Mapping[str, Any], own: Parts | None = None) -> Any:
    """The material that a table [material] describes."""
    if "name" not in table:
        return _build_one_of("material", "model", MATERIALS, table, own)
    for key in table.keys() - {"name"}:
        raise InputError(f"material.{key}", table[key], "not allowed beside material.name, which says all of the material; leave one out")
    return material(table["name"])


def _describe_material(value: Any, record: bool) -> dict[str, Any]:
    name = getattr(value, "named", None)
    return _describe("material", "model", MATERIALS, value, record) if name is None else {"name": name}


def _build_mesh(table: Mapping[str, Any], folder: Path, own: Parts) -> Meridian:
    if "file" not in table:
        mesh: Meridian = _build_one_of("mesh", "shape", SHAPES, {"shape": "disc", **table}, own, beside=SCENE_KEYS["mesh"])
        return mesh
    _refuse_unknown("mesh", table, ("file", "unit", *FILE_KEYS, *SCENE_KEYS["mesh"]))
    if not isinstance(table["file"], str):
        raise InputError("mesh.file", table["file"], "the path of a mesh file is allowed, from the folder of the scene")
    curve = read_meridian(folder / table["file"], **{name: table[name] for name in FILE_KEYS if name in table})
    unit = _unit_of_file("mesh", table)
    return curve if unit == 1 else dataclasses.replace(curve, points=tuple((unit * r, unit * z) for r, z in curve.points))


def _unit_of_file(path: str, table: Mapping[str, Any]) -> float:
    """The unit of the lengths in a file, over R0."""
    allowed = 'a unit of length such as "mm", or the length of the unit over R0, is allowed'
    return number(f"{path}.unit", table.get("unit", 1), allowed, above=0)


def _build_list(name: str, registry: Mapping[str, Any], tables: Any, own: Parts, scales: Scales | None = None) -> tuple[Any, ...]:
    if isinstance(tables, Mapping):
        raise InputError(name, tables, f"a list of tables is allowed: write [[{name}]], one for each {name}")
    tables = sequence(name, tables, f"a list of tables is allowed: [[{name}]], one for each {name}")
    items = []
    for k, table in enumerate(tables):
        path = item_path(name, k, len(tables))
        if not isinstance(table, Mapping):
            raise InputError(path, table, f"a table is allowed: [[{name}]] with its keys below")
        if table.get("kind") == "dipole" and scales is not None and scales.dipole_moment is not None:
            table = {"strength": scales.strength, **table}  # only in place of one that is left out
        try:
            if table.get("kind") == "magnet" and "remanence" in table:
                table = _with_strength(table, scales)
            items.append(_build_one_of(path, "kind", registry, table, own))
        except InputError as error:  # it does not know its place in the list
            raise InputError(re.sub(rf"^{name}(?=\.)", path, error.key), error.value, error.allowed) from None
    return tuple(items)


def _with_points(tables: Any, folder: Path) -> Any:
    """The tables of obstacles with the points of moulds that are in files."""
    if not isinstance(tables, (list, tuple)):
        return tables
    found = []
    for k, table in enumerate(tables):
        if isinstance(table, Mapping) and table.get("kind") == "mould" and "file" in table:
            path = item_path("obstacle", k, len(tables))
            key = f"{path}.file"
            if not isinstance(table["file"], str):
                raise InputError(key, table["file"], "the path of a text file is allowed, from the folder of the scene")
            if "points" in table:
                raise InputError(key, table["file"], "not allowed beside points; leave one out")
            unit = _unit_of_file(path, table)
            rest = {name: value for name, value in table.items() if name not in ("file", "unit")}
            table = rest | {"points": [[unit * rho, unit * z] for rho, z in Mould.from_file(folder / table["file"]).points]}
        found.append(table)
    return found


def _with_strength(table: Mapping[str, Any], scales: Scales | None) -> dict[str, Any]:
    """The table of a magnet with the strength that follows from its remanence."""
    rest = {name: value for name, value in table.items() if name not in ("kind", "remanence")}
    _build("source", Magnet, {"strength": 0.0} | rest)  # everything else is checked first
    magnet = Magnet(**rest, remanence=table["remanence"], scales=scales)
    return {"kind": "magnet", **rest, "strength": magnet.strength}


def item_path(name: str, index: int, count: int) -> str:
    """Name of one entry of a list of tables in messages: ``source``, or ``source[2]`` where there are several."""
    return name if count == 1 else f"{name}[{index}]"


def _describe(path: str, selector: str, registry: Mapping[str, Any], value: Any, record: bool) -> dict[str, Any]:
    for name, cls in registry.items():
        if type(value) is cls:
            return {selector: name, **_arguments(value)}
    found = described(selector, value)
    if not (record or found[selector].partition(":")[0]):
        advice = "known, beside module:Class of a module of your own: " + ", ".join(sorted(registry))
        raise InputError(f"{path}.{selector}", value, f"it has no name in scene files; {advice}")
    return found


def _arguments(value: Any) -> dict[str, Any]:
    found = {f.name: getattr(value, f.name) for f in fields(value)}
    quiet = {f.name for f in fields(value) if f.metadata.get("quiet") and found[f.name] == f.default}  # newer than files that lack it
    return {name: part for name, part in found.items() if name not in quiet}


def _plain(value: Any) -> Any:
    """Lists, dictionaries and Python numbers only. None is left out, since TOML has no null."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items() if item is not None and item != ()}
    if isinstance(value, Along):
        return _plain(value.given)
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value
