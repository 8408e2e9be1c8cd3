"""What exists and what is asked of it: one frozen value, to and from TOML.

A scene file has one table for each part; the keys of a table are the arguments of a class, or attributes of :class:`Scene`::

    title                        Scene.title
    [material]  model, ...       a class of MATERIALS and its arguments
    [membrane]                   attributes of Scene, listed in SCENE_KEYS
    [[source]]  kind, ...        a class of SOURCES and its arguments
    [[load]]    kind, ...        a class of LOADS and its arguments
    [mesh]      shape, ...       a class of SHAPES and its arguments; degree is an attribute of Scene
                file, ...        or a mesh file and what else FILE_KEYS lists; the scene keeps its points
    [effects]                    attributes of Scene that are on or off
    [run]                        Run
    [analysis]                   Analysis
    [scales]                     Scales

A new model, source, load or shape is a line in its registry; a new key of a table is a line in SCENE_KEYS or a field of its class.
Values are checked where the objects are made, so that files and Python code meet the same errors, named by their key in a file.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import re
import tomllib
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from os import PathLike
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from .discretization.meridian import Disc, Meridian, disc
from .discretization.mesh_files import Curve, read_meridian
from .discretization.shapes import Annulus, Cap, Cylinder, Sphere, Torus
from .discretization.supports import as_support, floats
from .errors import InputError, unknown_name
from .memory import SMALL, require
from .physics.checks import number
from .physics.invariant import ArrudaBoyce, Fung, Gent, Yeoh
from .physics.loads import HubForce, Hydrostatic, Load, Weight, on_hubs
from .physics.magnetics import Dipole, Source, distance_to_polyline
from .physics.materials import Material, MooneyRivlin, NeoHookean, Ogden, Varga
from .physics.scales import AGREEMENT, Scales
from .physics.sources import Loop, Solenoid, Uniform, Wire
from .physics.tabulated import Tabulated

MATERIALS: dict[str, Any] = {
    "arruda-boyce": ArrudaBoyce,
    "fung": Fung,
    "gent": Gent,
    "mooney-rivlin": MooneyRivlin,
    "neo-hookean": NeoHookean,
    "ogden": Ogden,
    "varga": Varga,
    "yeoh": Yeoh,
}
SOURCES: dict[str, Any] = {
    "dipole": Dipole,
    "loop": Loop,
    "solenoid": Solenoid,
    "tabulated": Tabulated,
    "uniform": Uniform,
    "wire": Wire,
}
LOADS: dict[str, Any] = {"hub-force": HubForce, "hydrostatic": Hydrostatic, "weight": Weight}
SHAPES: dict[str, Any] = {
    "disc": Disc,
    "annulus": Annulus,
    "cap": Cap,
    "sphere": Sphere,
    "cylinder": Cylinder,
    "torus": Torus,
    "curve": Curve,
}
#: keys of [mesh] beside the file that holds the meridian
FILE_KEYS = ("group", "divisions", "first", "last")
CONTROLS = ("volume", "pressure", "height", "arc-length")
AT_LIMIT = ("stop", "jump")
SOLVERS = ("ipopt", "newton")
VERDICTS = ("pressure", "volume")
WRINKLING = ("total", "mechanical")
QUANTITIES = ("volume", "pressure", "center_height")
SCENE_KEYS: dict[str, tuple[str, ...]] = {
    "membrane": ("susceptibility", "radius_to_thickness"),
    "mesh": ("degree",),
    "effects": ("tension_field",),
}

#: where else an argument without a default may come from, for the message when it is missing
_OTHERWISE = {(Dipole, "strength"): "give it, or scales.dipole_moment in A m^2, from which it follows"}

MAX_DEGREE = 8
#: size of a scene file: a million elements by their radii; what goes on for ever is none
MAX_BYTES = 2**25
#: waves around the axis; a thousand times finer than a mesh resolves
MAX_WAVES = 10**6
#: characters of a title
MAX_TEXT = 1000
#: equilibria of a run, which has to keep them all
MAX_STEPS = 10**6
#: bytes that a computation takes for each element and degree at least, measured on 20000 elements: by Newton's method, and by IPOPT
_BYTES, _BYTES_MINIMISED = 5000, 14000
#: bytes that every equilibrium takes beside its state and profiles, and how many numbers these have at a node
_BYTES_STEP, _PROFILES = 2000, 10
#: sources, loads, verdicts, wave numbers
_MAX_ITEMS = 10**4
_FINITE = "a finite number is allowed"
_DEGREE = 2
_RADIUS_TO_THICKNESS = 1000.0
_MAX_STEPS = 400


class Target(Mapping[str, float]):
    """Where a branch ends: a mapping of one quantity to one value, hashable."""

    def __init__(self, quantity: str, value: float) -> None:
        self._item = (quantity, value)

    def __getitem__(self, key: str) -> float:
        if key != self._item[0]:
            raise KeyError(key)
        return self._item[1]

    def __iter__(self) -> Iterator[str]:
        return iter(self._item[:1])

    def __len__(self) -> int:
        return 1

    def __hash__(self) -> int:
        return hash(self._item)

    def __repr__(self) -> str:
        return repr(dict(self))


@dataclass(frozen=True)
class Run:
    """The equilibria that are asked for.

    Parameters
    ----------
    control : {"volume", "pressure", "height", "arc-length"}
        What is prescribed at each equilibrium.
    start, stop : float, optional
        First and last load; with arc length, ``start`` is the volume of the first equilibrium and ``stop`` is not used.
    steps : int, optional
        Number of equilibria from start to stop, both included (one: start alone).
    values : sequence of float, optional
        The loads one by one, in place of start, stop and steps.
    until : mapping of one quantity to its value, optional
        Where an arc-length run ends: one of ``volume``, ``pressure``, ``center_height``.
    max_steps : int
        Most steps of an arc-length run.
    direction : {1, -1}
        Whether an arc-length run sets out to larger or to smaller volumes.
    solver : {"ipopt", "newton"}
        Who solves under volume and pressure control; a height and arc length always take the bordered Newton corrector.
    at_limit : {"stop", "jump"}
        Under volume and pressure control, where the branch turns back before a load, or loses its stability at a branch point: end there,
        or snap to the next stable state.

    Raises
    ------
    InputError
        For a value outside these sets, and for keys that do not go together.
    """

    control: str = "volume"
    start: float | None = None
    stop: float | None = None
    steps: int | None = None
    values: tuple[float, ...] | None = None
    until: Mapping[str, float] | None = None
    max_steps: int = _MAX_STEPS
    direction: int = 1
    solver: str = "ipopt"
    at_limit: str = "stop"

    def __post_init__(self) -> None:
        _choice("run.control", self.control, CONTROLS)
        self._check_keys()
        _choice("run.solver", self.solver, SOLVERS)
        _choice("run.at_limit", self.at_limit, AT_LIMIT)
        _convert(
            self,
            start=_optional(_finite, "run.start", self.start),
            stop=_optional(_finite, "run.stop", self.stop),
            steps=None if self.steps is None else _whole("run.steps", self.steps, most=MAX_STEPS),
            values=_optional(_loads, "run.values", self.values),
            until=_optional(_target, "run.until", self.until),
            max_steps=_whole("run.max_steps", self.max_steps, most=MAX_STEPS),
        )

    def loads(self) -> NDArray[np.float64]:
        """The prescribed volumes or pressures, shape (number of equilibria,)."""
        if self.values is not None:
            return np.array(self.values)
        if self.start is None or self.stop is None or self.steps is None:
            raise InputError(
                "run.control", self.control, "its loads are found on the way; only volume and pressure control have a list of loads"
            )
        return np.linspace(self.start, self.stop, self.steps)

    def _check_keys(self) -> None:
        by_length = self.control == "arc-length"
        needed: tuple[str, ...] = (
            ("start", "until") if by_length else ("values",) if self.values is not None else ("start", "stop", "steps")
        )
        advice = (
            "arc-length control takes start and until" if by_length else f"{self.control} control takes start, stop and steps, or values"
        )
        for name in ("start", "stop", "steps", "values", "until"):
            value = getattr(self, name)
            if value is not None and name not in needed:
                beside = ", not together with run.values" if needed == ("values",) and name != "until" else ""
                raise InputError(f"run.{name}", value, advice + beside)
        for name in needed:
            if getattr(self, name) is None:
                raise InputError(f"run.{name}", None, f"missing; {advice}")
        if self.max_steps != _MAX_STEPS and not by_length:
            raise InputError("run.max_steps", self.max_steps, f"only arc-length control takes it; {advice}")
        if isinstance(self.direction, bool) or self.direction not in (1, -1):
            raise InputError("run.direction", self.direction, "1 (towards larger volumes) or -1 is allowed")
        if self.direction != 1 and not by_length:
            raise InputError("run.direction", self.direction, f"only arc-length control takes it; {advice}")


@dataclass(frozen=True)
class Analysis:
    """Questions asked of every equilibrium; only what is asked for is computed.

    Parameters
    ----------
    stability : sequence of {"pressure", "volume"}
        Controls under which the verdict on axisymmetric perturbations is given.
    azimuthal_modes : sequence of int
        Circumferential wave numbers n >= 1 for which the verdict is given.
    wrinkling : {"total", "mechanical"}, optional
        The principal stresses whose signs divide the membrane into taut and wrinkled zones; left out: no zones are looked for.
    error_estimates : bool
        Whether discretisation errors are estimated, by solving again in a finer space.

    Raises
    ------
    InputError
        For a value outside these sets or given twice.
    """

    stability: tuple[str, ...] = ()
    azimuthal_modes: tuple[int, ...] = ()
    wrinkling: str | None = None
    error_estimates: bool = False

    def __post_init__(self) -> None:
        stability = _sequence("analysis.stability", self.stability, 'a list is allowed, of "pressure" and "volume"')
        modes = _sequence("analysis.azimuthal_modes", self.azimuthal_modes, "a list of whole numbers >= 1 is allowed")
        for k, name in enumerate(stability):
            _choice(f"analysis.stability[{k}]", name, VERDICTS)
        modes = tuple(_whole(f"analysis.azimuthal_modes[{k}]", n, most=MAX_WAVES) for k, n in enumerate(modes))
        _unique("analysis.stability", stability)
        _unique("analysis.azimuthal_modes", modes)
        if self.wrinkling is not None:
            _choice("analysis.wrinkling", self.wrinkling, WRINKLING)
        estimates = _switch("analysis.error_estimates", self.error_estimates)
        _convert(self, stability=stability, azimuthal_modes=modes, error_estimates=estimates)


@dataclass(frozen=True)
class Scene:
    """A membrane, its surroundings, its mesh and what is asked of it; hashable, never changed once made.

    Parameters
    ----------
    material : Material
        Strain energy: :class:`~femmembrane.physics.materials.Ogden`, ``NeoHookean``, or an object with their methods.
    mesh : Meridian
        Reference meridian and its elements.
    degree : int
        Polynomial degree of the elements, 1 to 8; left out: 2, or as chosen with a mesh for an accuracy (None until then).
    sources : sequence of Source
        Magnetic sources around the axis; none: nothing magnetic is built.
    susceptibility : float, optional
        Magnetic susceptibility chi >= 0 of the membrane; required as soon as there is a source.
    radius_to_thickness : float, optional
        R0/T > 0; enters the total stresses only. Left out: that of the scales, or 1000 without scales.
    tension_field : bool
        Whether the membrane wrinkles rather than carry compression (:mod:`~femmembrane.physics.tension_field`).
    title : str
    run : Run, optional
        Equilibria that :func:`femmembrane.run` computes.
    analysis : Analysis
    scales : Scales, optional
        Physical size and stiffness: stresses and pressures are then given in Pa as well. They change no equilibrium.
    loads : sequence of Load
        Loads besides the pressure, such as ``Hydrostatic(gamma=...)``; none: nothing of them is built.

    Raises
    ------
    InputError
        For a value that cannot be used, named by its key in a scene file (``mesh.elements``), and for scales that contradict
        ``radius_to_thickness`` or hold the moment of no dipole.
    """

    material: Material
    mesh: Meridian = field(default_factory=disc)
    degree: int = None  # type: ignore[assignment]  # an int as soon as the scene has elements
    sources: tuple[Source, ...] = ()
    susceptibility: float | None = None
    radius_to_thickness: float = None  # type: ignore[assignment]  # a float as soon as the scene is made
    tension_field: bool = False
    title: str = ""
    run: Run | None = None
    analysis: Analysis = field(default_factory=Analysis)
    scales: Scales | None = None
    loads: tuple[Load, ...] = ()

    def __post_init__(self) -> None:
        _require("material", self.material, ("energy", "stress"), "a material is allowed, such as Ogden(mu=..., alpha=...)")
        _require("mesh", self.mesh, ("breakpoints", "position", "tangent", "supports"), "a mesh is allowed, such as disc(elements=64)")
        _require("run", self.run, () if self.run is None else ("loads",), "a Run is allowed")
        _require("analysis", self.analysis, ("stability", "azimuthal_modes", "wrinkling"), "an Analysis is allowed")
        sources = _sequence("source", self.sources, "a list of sources is allowed, such as [Dipole(strength=..., height=...)]")
        loads = _sequence("load", self.loads, "a list of loads is allowed, such as [Weight(weight=...)]")
        for k, load in enumerate(loads):
            _require(
                _item_path("load", k, len(loads)),
                load,
                ("over_reference", "over_projection", "on_hubs", "sees", "acts"),
                "a load is allowed, such as Weight(weight=...)",
            )
        scales = "Scales(radius=..., thickness=..., shear_modulus=...) is allowed"
        _require("scales", self.scales, () if self.scales is None else ("to_si", "fits"), scales)
        _convert(
            self,
            degree=_degree("mesh.degree", self.degree, self.open),
            sources=sources,
            loads=loads,
            susceptibility=_optional(_susceptibility, "membrane.susceptibility", self.susceptibility),
            radius_to_thickness=_ratio("membrane.radius_to_thickness", self.radius_to_thickness, self.scales),
            tension_field=_switch("effects.tension_field", self.tension_field),
            title=_text("title", self.title),
        )
        self._check_size()
        self._check_sources()
        self._check_hubs()

    def _check_size(self) -> None:
        """Refuse what there is no room for, before any of it is built."""
        if self.open:
            return
        count, degree = self.mesh.elements, self.degree
        run = self.run
        minimised = run is not None and run.solver == "ipopt" and run.control in ("volume", "pressure")
        each = degree * (_BYTES_MINIMISED if minimised else _BYTES)
        if count * each > SMALL:
            require("mesh.elements", count, each, f"elements of degree {degree}")
        steps = 0 if run is None else len(run.values or ()) or run.steps or 0
        kept = 8 * (_PROFILES + 2) * count * degree + _BYTES_STEP
        if steps * kept > SMALL:
            require("run.steps" if run is not None and run.values is None else "run.values", steps, kept, "equilibria on this mesh")

    def _check_sources(self) -> None:
        R, Z = self.mesh.position(self.mesh.breakpoints())
        for k, source in enumerate(self.sources):
            path = _item_path("source", k, len(self.sources))
            allowed = "a source is allowed, such as Dipole(strength=..., height=...), or an object of a class derived from Source"
            _require(path, source, ("field", "intensity", "distance_squared", "passed", "circles", "sees", "refusal"), allowed)
            # the axis is met at the ends of a meridian only: its breakpoints are enough; circles may lie between them
            with np.errstate(all="ignore"):
                finite = all(np.all(np.isfinite(component)) for component in source.field(R, Z))
            touched = any(distance_to_polyline(R, Z, circle) < 1e-9 for circle in source.circles)
            if touched or not finite:
                name, reason = source.refusal
                if not touched and _too_far(source):
                    reason = "the source is too far away for its field to be a number; move it"
                raise InputError(f"{path}.{name}", getattr(source, name, source), reason)
        if self.sources and self.susceptibility is None:
            raise InputError(
                "membrane.susceptibility", None, "missing; there is a source, so give membrane.susceptibility (2.5 in the paper)"
            )
        if self.scales is not None and not self.scales.fits(self.sources):
            raise InputError(
                "scales.dipole_moment",
                self.scales.dipole_moment,
                f"no dipole of the scene has its strength, {self.scales.strength:.12g}, so it would do nothing; leave it out, or give a "
                "dipole this strength (in a scene file: leave the strength of the dipole out)",
            )

    def _check_hubs(self) -> None:
        """Every force on a hub has its hub, and is held."""
        supports = [as_support(held) for held in self.mesh.supports()]
        forces = on_hubs(self.loads, [end.rigid for end in supports])
        if floats(supports) and sum(forces) and not any("along" in load.sees for load in self.loads if load.acts):
            advice = "nothing holds the membrane against it along the axis; hold an end, or let the forces on its two hubs add up to 0"
            raise InputError("load.force", sum(forces), advice)

    @property
    def open(self) -> bool:
        """Whether the elements are still to be chosen, for the accuracy that is asked for: nothing can be computed before."""
        return bool(getattr(self.mesh, "open", False))

    def replace(self, **changes: Any) -> Self:
        """The same scene with some attributes changed, checked anew.

        With new scales ``radius_to_thickness`` follows them; a mesh that is still to be chosen drops the degree.
        """
        known = [f.name for f in fields(self)]
        for name, value in changes.items():
            if name not in known:
                raise InputError(name, value, unknown_name(name, name, known).allowed)
        if changes.get("scales") is not None:
            changes.setdefault("radius_to_thickness", None)
        if getattr(changes.get("mesh"), "open", False):
            changes.setdefault("degree", None)
        return dataclasses.replace(self, **changes)

    def to_dict(self) -> dict[str, Any]:
        """The scene as nested dictionaries of plain values: the tables of a scene file.

        Raises
        ------
        InputError
            When a material, source or mesh has no name in scene files.
        """
        tables: dict[str, Any] = {
            "title": self.title,
            "material": _describe("material", "model", MATERIALS, self.material),
            **{table: {name: getattr(self, name) for name in names} for table, names in SCENE_KEYS.items() if table != "mesh"},
            "source": [_describe("source", "kind", SOURCES, source) for source in self.sources],
            "load": [_describe("load", "kind", LOADS, load) for load in self.loads],
            "mesh": {**_describe("mesh", "shape", SHAPES, self.mesh), **{name: getattr(self, name) for name in SCENE_KEYS["mesh"]}},
            "run": _arguments(self.run) if self.run else {},
            "analysis": {name: value for name, value in _arguments(self.analysis).items() if value is not False},
            "scales": _arguments(self.scales) if self.scales else {},
        }
        tables["effects"] = {name: True for name, on in tables["effects"].items() if on}
        if self.scales:  # which hold it already
            del tables["membrane"]["radius_to_thickness"]
        if self.run and self.run.control != "arc-length":
            del tables["run"]["max_steps"]
        if self.run and self.run.direction == 1:
            del tables["run"]["direction"]
        plain: dict[str, Any] = _plain(tables)
        return {name: table for name, table in plain.items() if table not in ("", {}, [])}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], folder: str | PathLike[str] = ".") -> Self:
        """The scene that the tables of a scene file describe.

        Parameters
        ----------
        data : mapping
        folder : path
            Where the path of a mesh file starts from.

        Raises
        ------
        InputError
            For an unknown table or key (with the nearest valid name), a missing one, or a value that cannot be used.
        """
        if not isinstance(data, Mapping):
            raise InputError("scene", data, "a mapping of the tables of a scene file is allowed")
        _refuse_unknown("", data, ("title", *_known_keys()))
        tables = {name: _table(name, data.get(name, {})) for name in _known_keys() if name not in ("source", "load")}
        arguments = {name: tables[table][name] for table, names in SCENE_KEYS.items() for name in names if name in tables[table]}
        for table in SCENE_KEYS.keys() - {"mesh"}:
            _refuse_unknown(table, tables[table], SCENE_KEYS[table])
        scales = _build("scales", Scales, tables["scales"]) if "scales" in data else None
        return cls(
            material=_build_one_of("material", "model", MATERIALS, tables["material"]),
            sources=_build_list("source", SOURCES, data.get("source", ()), scales),
            loads=_build_list("load", LOADS, data.get("load", ())),
            mesh=_build_mesh(tables["mesh"], Path(folder)),
            run=_build("run", Run, tables["run"]) if "run" in data else None,
            analysis=_build("analysis", Analysis, tables["analysis"]),
            title=data.get("title", ""),
            scales=scales,
            **arguments,
        )

    @classmethod
    def from_toml(cls, path: str | PathLike[str]) -> Self:
        """Read a scene file.

        Raises
        ------
        InputError
            When the file cannot be read, is no TOML (with the line), or does not describe a scene.
        """
        return cls.from_dict(read_tables(path), Path(path).parent)

    def to_toml(self, path: str | PathLike[str]) -> None:
        """Write a scene file that :meth:`from_toml` reads back to an equal scene.

        Raises
        ------
        InputError
            When a material, source or mesh has no name in scene files, or the file cannot be written.
        """
        import tomli_w

        from .files import replace_file

        text = tomli_w.dumps(self.to_dict())
        with replace_file(path) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")


# --- reading and writing tables


def read_tables(path: str | PathLike[str]) -> dict[str, Any]:
    """The tables of a scene file as they stand, unchecked: what :meth:`Scene.from_dict` takes.

    Raises
    ------
    InputError
        When the file cannot be read or is no TOML (with the line).
    """
    from .files import read_bytes

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
    """What stands in the line that a parser complains about."""
    found = re.search(r"at line (\d+)", reason)
    line = text.replace("\r\n", "\n").split("\n")[int(found[1]) - 1].strip() if found else ""
    shown = "".join(c if c.isprintable() else "?" for c in line[:60]) + ("..." if len(line) > 60 else "")
    return f": {shown}" if shown else ""


def _known_keys() -> dict[str, set[str]]:
    """Keys of every table."""

    def arguments(*classes: Any) -> set[str]:
        return {f.name for c in classes for f in fields(c)}

    keys = {table: set(names) for table, names in SCENE_KEYS.items()}
    keys["material"] = {"model"} | arguments(*MATERIALS.values())
    keys["source"] = {"kind"} | arguments(*SOURCES.values())
    keys["load"] = {"kind"} | arguments(*LOADS.values())
    keys["mesh"] |= {"shape", "file", *FILE_KEYS} | arguments(*SHAPES.values())
    return keys | {"run": arguments(Run), "analysis": arguments(Analysis), "scales": arguments(Scales)}


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
    """The object of a class from a table with its arguments; ``beside`` are further keys of the table that others read."""
    names = tuple(f.name for f in fields(cls))
    _refuse_unknown(path, table, (*beside, *names))
    for f in fields(cls):
        if f.name not in table and f.default is f.default_factory is dataclasses.MISSING:
            raise InputError(f"{path}.{f.name}", None, "missing; " + _OTHERWISE.get((cls, f.name), "it has no default"))
    return cls(**{name: table[name] for name in names if name in table})


def _build_one_of(path: str, selector: str, registry: Mapping[str, Any], table: Mapping[str, Any], beside: tuple[str, ...] = ()) -> Any:
    """The object of the class that a table names by its key ``selector``."""
    if selector not in table:
        raise InputError(f"{path}.{selector}", None, "missing; known: " + ", ".join(sorted(registry)))
    _choice(f"{path}.{selector}", table[selector], registry)
    return _build(path, registry[table[selector]], table, (selector, *beside))


def _build_mesh(table: Mapping[str, Any], folder: Path) -> Meridian:
    if "file" not in table:
        mesh: Meridian = _build_one_of("mesh", "shape", SHAPES, {"shape": "disc", **table}, beside=SCENE_KEYS["mesh"])
        return mesh
    _refuse_unknown("mesh", table, ("file", *FILE_KEYS, *SCENE_KEYS["mesh"]))
    if not isinstance(table["file"], str):
        raise InputError("mesh.file", table["file"], "the path of a mesh file is allowed, from the folder of the scene")
    return read_meridian(folder / table["file"], **{name: table[name] for name in FILE_KEYS if name in table})


def _build_list(name: str, registry: Mapping[str, Any], tables: Any, scales: Scales | None = None) -> tuple[Any, ...]:
    if isinstance(tables, Mapping):
        raise InputError(name, tables, f"a list of tables is allowed: write [[{name}]], one for each {name}")
    tables = _sequence(name, tables, f"a list of tables is allowed: [[{name}]], one for each {name}")
    items = []
    for k, table in enumerate(tables):
        path = _item_path(name, k, len(tables))
        if not isinstance(table, Mapping):
            raise InputError(path, table, f"a table is allowed: [[{name}]] with its keys below")
        if table.get("kind") == "dipole" and scales is not None and scales.dipole_moment is not None:
            table = {"strength": scales.strength, **table}  # only in place of one that is left out
        try:
            items.append(_build_one_of(path, "kind", registry, table))
        except InputError as error:  # it does not know its place in the list
            raise InputError(re.sub(rf"^{name}(?=\.)", path, error.key), error.value, error.allowed) from None
    return tuple(items)


def _too_far(source: Source) -> bool:
    """Whether a field that is not finite is that of a source beyond the range of numbers, not of one on the membrane."""
    height = getattr(source, "height", 0.0)
    return isinstance(height, float) and abs(height) > 1


def _item_path(name: str, index: int, count: int) -> str:
    return name if count == 1 else f"{name}[{index}]"


def _describe(path: str, selector: str, registry: Mapping[str, Any], value: Any) -> dict[str, Any]:
    for name, cls in registry.items():
        if type(value) is cls:
            return {selector: name, **_arguments(value)}
    raise InputError(f"{path}.{selector}", value, "it has no name in scene files; known: " + ", ".join(sorted(registry)))


def _arguments(value: Any) -> dict[str, Any]:
    return {f.name: getattr(value, f.name) for f in fields(value)}


def _plain(value: Any) -> Any:
    """Lists, dictionaries and Python numbers only; what is not given is left out, for TOML has no null."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items() if item is not None and item != ()}
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value


# --- checks of single values, each returning the value in its one true type


def _convert(target: Any, **values: Any) -> None:
    for name, value in values.items():
        object.__setattr__(target, name, value)


def _optional(check: Any, key: str, value: Any) -> Any:
    return None if value is None else check(key, value)


def _finite(key: str, value: Any) -> float:
    return number(key, value, _FINITE)


def _whole(key: str, value: Any, *, most: int | None = None) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1 or (most is not None and value > most):
        raise InputError(key, value, "a whole number >= 1 is allowed" if most is None else f"a whole number from 1 to {most} is allowed")
    return int(value)


def _degree(key: str, value: Any, mesh_open: bool) -> int | None:
    if mesh_open and value is not None:
        raise InputError(key, value, "not allowed together with mesh.accuracy, for which the degree is chosen; leave one out")
    return None if mesh_open else _DEGREE if value is None else _whole(key, value, most=MAX_DEGREE)


def _ratio(key: str, value: Any, scales: Scales | None) -> float:
    """R0/T as given, or as it follows from the scales."""
    if value is None:
        return _RADIUS_TO_THICKNESS if scales is None else scales.radius_to_thickness
    ratio = number(key, value, "a finite number > 0 is allowed (R0 over the reference thickness)", above=0)
    if scales is None:
        return ratio
    if not math.isclose(ratio, scales.radius_to_thickness, rel_tol=AGREEMENT):
        follows = f"scales.radius / scales.thickness = {scales.radius_to_thickness:.12g}"
        advice = "leave radius_to_thickness out, and it follows from the scales (Scene.replace does so when it is given other scales)"
        raise InputError(key, value, f"it contradicts {follows}; {advice}")
    return scales.radius_to_thickness


def _susceptibility(key: str, value: Any) -> float:
    return number(key, value, "a finite number >= 0 is allowed (2.5 in the paper)", least=0)


def _switch(key: str, value: Any) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(key, value, "true or false is allowed")
    return bool(value)


def _text(key: str, value: Any) -> str:
    if not isinstance(value, str) or not _encodes(value):
        raise InputError(key, value, "a text (UTF-8) is allowed")
    if len(value) > MAX_TEXT:
        raise InputError(key, value, f"a text of up to {MAX_TEXT} characters is allowed; this one has {len(value)}")
    if not all(c in "\t\n" or unicodedata.category(c) != "Cc" for c in value):
        raise InputError(key, value, "a text without control characters is allowed (tabs and ends of lines are none)")
    return value


def _encodes(text: str) -> bool:
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


def _sequence(key: str, values: Any, allowed: str, most: int = _MAX_ITEMS) -> tuple[Any, ...]:
    if isinstance(values, (str, bytes, Mapping)):
        raise InputError(key, values, allowed)
    try:
        items = tuple(itertools.islice(values, most + 1))
    except TypeError:
        raise InputError(key, values, allowed) from None
    if len(items) > most:
        raise InputError(key, f"more than {most} entries", f"up to {most} are allowed")
    return items


def _loads(key: str, values: Any) -> tuple[float, ...]:
    allowed = "a list of one or more finite numbers is allowed"
    given = _sequence(key, values, allowed, MAX_STEPS)
    result = tuple(number(f"{key}[{k}]", value, _FINITE) for k, value in enumerate(given))
    if not result:
        raise InputError(key, values, allowed)
    return result


def _target(key: str, value: Any) -> Target:
    if not isinstance(value, Mapping) or len(value) != 1:
        raise InputError(
            key, value, "one quantity and its value are allowed, such as {center_height = 5.0}; known: " + ", ".join(QUANTITIES)
        )
    ((quantity, end),) = value.items()
    _choice(key, quantity, QUANTITIES)
    return Target(quantity, number(f"{key}.{quantity}", end, _FINITE))


def _choice(key: str, value: Any, known: Any) -> None:
    if not isinstance(value, str) or value not in known:
        raise unknown_name(key, value, known)


def _unique(key: str, values: tuple[Any, ...]) -> None:
    if len(set(values)) < len(values):
        raise InputError(key, list(values), "each entry once is allowed")


def _require(key: str, value: Any, names: tuple[str, ...], allowed: str) -> None:
    # a class in place of its object (NeoHookean for NeoHookean()) has the methods, but nothing to call them on
    if isinstance(value, type) or not all(hasattr(value, name) for name in names):
        raise InputError(key, value, allowed)
