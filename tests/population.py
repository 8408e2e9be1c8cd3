"""A population of random scenes, each with a state that certainly exists: what the search for a first state is measured by.

Everything about a member follows from its seed. Its scene is plain data, the tables of a scene file; how strong its sources and loads are, and
which load is asked for, follows from a walk (:mod:`.walker`) along a path of small steps from a state that certainly exists. What the walk
found is recorded in data/population.json, so that asking need not walk again. ::

    python -m tests.population ask --first 0 --count 200        # ask, print what was not answered, and the table
    python -m tests.population record --first 0 --count 1000    # walk, and write the record
"""

from __future__ import annotations

import argparse
import json
import math
import random
import re
import signal
import sys
import time
import warnings
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import femmembrane as fm
from femmembrane.potential import Potential
from tests.walker import Spot, Walker

RECORD = Path(__file__).parent / "data" / "population.json"
#: pressure or volume on a finer mesh may differ by this part from that of a state that counts as resolved
RESOLVED = 1e-3
#: an answer that moves by more than this on a finer mesh is none
UNRESOLVED = 3e-2
#: seconds after which a question counts as not answered
PATIENCE = 60
#: what a message may not claim of a state that exists
CLAIMS = re.compile(
    r"no tension holds|there is no equilibrium|no equilibrium exists|turned back|no stable state (exists|was met beyond)|nothing holds"
)


class Dice(random.Random):
    """Draws that depend on nothing but ``random()``, whose sequence is the same in every version of Python."""

    def between(self, low: float, high: float) -> float:
        return low + (high - low) * self.random()

    def log(self, low: float, high: float) -> float:
        return float(f"{math.exp(self.between(math.log(low), math.log(high))):.6g}")

    def number(self, low: float, high: float) -> float:
        return float(f"{self.between(low, high):.6g}")

    def whole(self, low: int, high: int) -> int:
        return low + int((high - low + 1) * self.random())

    def one_of(self, values: Sequence[Any]) -> Any:
        return values[int(len(values) * self.random())]

    def chance(self, share: float) -> bool:
        return self.random() < share


# --- scenes -------------------------------------------------------------------------------------------------------------------------


@dataclass
class Draft:
    """A scene before the walk: tables of a scene file, its family, and what the walk is to do."""

    seed: int
    family: str
    tables: dict[str, Any]
    unit: float
    direction: int
    task: str
    share: float
    steps: int
    everted: bool
    gas: tuple[float, float]

    def scene(self, factor: float = 1.0) -> fm.Scene:
        """The scene with sources and loads at a part of their strength."""
        return fm.Scene.from_dict(scaled_loads(self.tables, factor))


def scaled_loads(tables: dict[str, Any], factor: float) -> dict[str, Any]:
    changed = json.loads(json.dumps(tables))
    for item in (*changed.get("source", ()), *changed.get("load", ())):
        for name in ("strength", "gamma", "weight", "force"):
            if name in item:
                item[name] *= factor
    return changed


def draft(seed: int) -> Draft:
    """The scene of a seed, and what is to be asked of it; InputError never."""
    dice = Dice(seed)
    family = _family(dice)
    mesh, unit = _MESHES[family](dice)
    tables: dict[str, Any] = {"material": _material(dice), "mesh": mesh}
    if dice.chance(0.15):
        tables["effects"] = {"tension_field": True}
    bare = fm.Scene.from_dict(tables)
    tables |= _loads(dice, bare, unit) if dice.chance(0.35) else {}
    if dice.chance(0.35):
        tables |= _sources(dice, bare, unit)
    surrounded = "load" in tables or "source" in tables
    task = "branch"
    if dice.chance(0.12):
        task = dice.one_of(["zero pressure", "zero volume"]) if surrounded else "faint"
    everted = dice.chance(0.25) and not surrounded
    return Draft(
        seed=seed,
        family=family,
        tables=tables,
        unit=unit,
        direction=1 if dice.chance(0.8) else -1,
        task=task,
        share=dice.random(),
        steps=int(dice.log(2, 80)),
        everted=everted,
        gas=(dice.log(0.2, 5), dice.log(0.1, 3)),
    )


_FAMILIES = {
    "disc": 12,
    "annulus": 10,
    "cap": 12,
    "round cap": 4,
    "sphere": 6,
    "tube": 18,
    "torus": 9,
    "spheroid": 9,
    "curve": 12,
    "other unit": 12,
}


def _family(dice: Dice) -> str:
    place = dice.random() * sum(_FAMILIES.values())
    for name, share in _FAMILIES.items():
        place -= share
        if place < 0:
            return name
    return "disc"


def _elements(dice: Dice, low: int = 8, high: int = 40) -> dict[str, Any]:
    degree = dice.one_of([2, 2, 2, 3, 4])
    return {"elements": max(low // 2 if degree > 2 else low, int(dice.log(low, high) * 2 / degree)), "degree": degree}


def _disc(dice: Dice) -> tuple[dict[str, Any], float]:
    return {"shape": "disc", **_elements(dice, 12, 64), "ratio": dice.one_of([1.0, 1.0, dice.log(0.3, 3)])}, 1.0


def _annulus(dice: Dice) -> tuple[dict[str, Any], float]:
    ends = dice.one_of(
        [
            ("hub", "clamped"),
            ("hub", "clamped"),
            ("clamped", "clamped"),
            ("hub", "radial"),
            ("free", "clamped"),
            ("axial", "clamped"),
            ("clamped", "hub"),
            ("radial", "clamped"),
        ]
    )
    return {"shape": "annulus", "inner_radius": dice.number(0.08, 0.85), **_elements(dice), "inner": ends[0], "outer": ends[1]}, 1.0


def _cap(dice: Dice) -> tuple[dict[str, Any], float]:
    height = dice.one_of([0.0, dice.log(0.01, 3), dice.log(0.1, 2), dice.log(0.1, 2)])
    rim = dice.one_of(["clamped", "clamped", "radial", "mirror", "axial", "hub"])
    return {"shape": "cap", "height": height * (-1 if dice.chance(0.3) else 1), **_elements(dice, 12, 48), "rim": rim}, 1.0


def _round_cap(dice: Dice) -> tuple[dict[str, Any], float]:
    height = dice.log(5, 60) * (-1 if dice.chance(0.3) else 1)
    # the rim is small beside the sphere: elements become small towards it
    return {"shape": "cap", "height": height, "elements": dice.whole(24, 48), "degree": 3, "ratio": dice.number(0.02, 0.1)}, 1.0


def _sphere(dice: Dice) -> tuple[dict[str, Any], float]:
    return {"shape": "sphere", **_elements(dice, 8, 32)}, 1.0


def _tube(dice: Dice) -> tuple[dict[str, Any], float]:
    length = dice.log(0.3, 25)
    words = ["clamped", "clamped", "hub", "hub", "mirror", "radial", "axial", "free"]
    top, bottom = dice.one_of(words), dice.one_of(words)
    if top == bottom == "axial":  # two walls and nothing that holds the tube along the axis: a tube of its first length
        bottom = "clamped"
    size = _elements(dice, 12, 40)
    size["elements"] = max(size["elements"], int(2 * length))
    return {"shape": "cylinder", "length": length, **size, "top": top, "bottom": bottom}, 1.0


def _torus(dice: Dice) -> tuple[dict[str, Any], float]:
    aspect = dice.one_of([1 + dice.log(1e-4, 0.1), 1 + dice.log(0.1, 10), 1 + dice.log(0.1, 10), dice.log(10, 1e4)])
    return {"shape": "torus", "aspect": float(f"{aspect:.8g}"), **_elements(dice, 12, 32)}, 1.0


def _points(cells: int, curved: bool, curve: Any, unit: float, closed: bool = False) -> dict[str, Any]:
    """Points on a curve, a function of t from 0 to 1; of curved cells with one inside."""
    t = np.linspace(0, 1, (2 if curved else 1) * cells + 1)
    points = [[float(f"{unit * r:.12g}"), float(f"{unit * z:.12g}")] for r, z in (curve(float(v)) for v in t)]
    if closed:
        points[-1] = list(points[0])
    return {"shape": "curve", "points": points, "curved": curved}


def _spheroid_curve(slenderness: float) -> Any:
    # exactly 0 at both poles
    return lambda t: (math.sin(math.pi * min(t, 1 - t)), slenderness * math.cos(math.pi * t))


def _spheroid(dice: Dice) -> tuple[dict[str, Any], float]:
    unit = dice.one_of([1.0, dice.log(0.1, 20)])
    cells, curved = dice.whole(10, 24), dice.chance(0.7)
    mesh = _points(cells, curved, _spheroid_curve(dice.log(0.3, 4)), unit)
    return mesh | {"degree": dice.one_of([2, 2, 3]), "divisions": 1 if cells > 14 else 2}, unit


def _curve(dice: Dice, unit: float = 1.0) -> tuple[dict[str, Any], float]:
    """Cones, barrels, bowls, closed rings and domes, some upside down."""
    kind = dice.one_of(["cone", "barrel", "waist", "bowl", "ring", "dome", "drop"])
    flip = -1 if dice.chance(0.4) else 1
    a, b = dice.number(0.3, 2), dice.number(0.2, 0.9)
    shapes = {
        "cone": lambda t: (b + (1 - b) * t, flip * a * (1 - t)),
        "barrel": lambda t: (1 + b / 2 * math.sin(math.pi * t), flip * a * (0.5 - t)),
        "waist": lambda t: (1 - b / 2 * math.sin(math.pi * t), flip * a * (0.5 - t)),
        "bowl": lambda t: (math.sin(math.pi / 2 * t), -a * math.cos(math.pi / 2 * t) if t < 1 else 0.0),
        "dome": lambda t: (t, flip * a * (1 - t**2)),
        "ring": lambda t: (1.5 + a + math.sin(2 * math.pi * t), flip * a * math.cos(2 * math.pi * t)),
        "drop": lambda t: (math.sin(math.pi * min(t, 1 - t)) * (1 + b / 2 * (2 * t - 1)), flip * a * math.cos(math.pi * t)),
    }
    mesh = _points(dice.whole(12, 28), dice.chance(0.7), shapes[kind], unit, closed=kind == "ring")
    words = {"cone": ("clamped", "hub"), "barrel": ("clamped", "hub"), "waist": ("clamped", "hub")}.get(kind, ("clamped",))
    mesh |= {"degree": dice.one_of([2, 2, 3]), "first": dice.one_of(words), "last": "clamped"}
    if kind in ("dome", "bowl") and dice.chance(0.3):
        mesh["last"] = "radial"
    return mesh, unit


def _other_unit(dice: Dice) -> tuple[dict[str, Any], float]:
    unit = dice.one_of([1e-3, 0.01, 25.0, 1e3, dice.log(1e-3, 1e3)])
    if dice.chance(0.5):
        return _curve(dice, unit)
    kind = dice.one_of(["sphere", "disc", "tube", "torus"])
    length, aspect = dice.log(1, 6), 1 + dice.log(0.2, 3)
    shapes = {
        "sphere": _spheroid_curve(1.0),
        "disc": lambda t: (t, 0.0),
        "tube": lambda t: (1.0, length * (0.5 - t)),
        "torus": lambda t: (aspect + math.sin(2 * math.pi * t), math.cos(2 * math.pi * t)),
    }
    mesh = _points(dice.whole(14, 28), True, shapes[kind], unit, closed=kind == "torus")
    ends = dice.one_of([("clamped", "clamped"), ("hub", "clamped"), ("radial", "radial")]) if kind == "tube" else ("clamped", "clamped")
    return mesh | {"degree": 2, "first": ends[0], "last": ends[1]}, unit


_MESHES = {
    "disc": _disc,
    "annulus": _annulus,
    "cap": _cap,
    "round cap": _round_cap,
    "sphere": _sphere,
    "tube": _tube,
    "torus": _torus,
    "spheroid": _spheroid,
    "curve": _curve,
    "other unit": _other_unit,
}


def _material(dice: Dice) -> dict[str, Any]:
    return dice.one_of(
        [
            {"model": "neo-hookean"},
            {"model": "mooney-rivlin", "ratio": dice.log(0.02, 1)},
            {"model": "mooney-rivlin", "ratio": dice.log(0.02, 1)},
            {"model": "ogden", "mu": [1.4910, 0.0029, -0.0236], "alpha": [1.3, 5.0, -2.0]},
            {"model": "ogden", "mu": list(fm.Ogden.treloar().mu), "alpha": list(fm.Ogden.treloar().alpha)},
            {"model": "varga"},
            {"model": "yeoh", "c2": dice.log(0.003, 0.3), "c3": dice.one_of([0.0, dice.log(1e-4, 0.01)])},
            {"model": "gent", "jm": dice.log(1, 100)},
            {"model": "arruda-boyce", "links": dice.log(3, 50)},
            {"model": "fung", "b": dice.log(0.01, 0.5)},
        ]
    )


def _loads(dice: Dice, bare: fm.Scene, unit: float) -> dict[str, Any]:
    """A weight, a liquid, a force on a hub, as the scene can take them; E = w Int eta R dS, so that w is over a length."""
    sign = 1 if dice.chance(0.75) else -1
    weight = {"kind": "weight", "weight": sign * dice.log(1e-3, 0.3) / unit}
    liquid = {"kind": "hydrostatic", "gamma": sign * dice.log(0.01, 1) / unit**2}
    force = {"kind": "hub-force", "force": sign * dice.log(0.02, 3) * unit}
    if dice.chance(0.5):
        force["hub"] = dice.one_of(["first", "last"])
    if Potential(bare).space.pin is not None:  # nothing holds it along the axis: two hubs may be pulled apart, and nothing else
        pair = [force | {"hub": "first"}, force | {"hub": "last", "force": -force["force"]}]
        return {"load": pair} if [end.rigid for end in Potential(bare).space.supports] == [True, True] else {}
    for choice in sorted([[weight], [liquid], [force], [liquid, weight]], key=lambda _: dice.random()):
        tables = bare.to_dict() | {"load": choice}
        try:
            Potential(fm.Scene.from_dict(tables))
        except fm.InputError:
            continue
        return {"load": choice}
    return {}


def _sources(dice: Dice, bare: fm.Scene, unit: float) -> dict[str, Any]:
    """One or two sources off the membrane; their energy density is at most a part of the modulus on the membrane at rest."""
    s = np.linspace(*bare.mesh.breakpoints()[[0, -1]], 200)
    R, Z = bare.mesh.position(s)
    size, high, low = float(R.max()), float(Z.max()), float(Z.min())
    floats = Potential(bare).space.pin is not None
    above = high + size * dice.log(0.6, 4)
    below = low - size * dice.log(0.6, 4)
    at = float(f"{dice.one_of([above, below]):.6g}")
    middle = float(f"{(high + low) / 2:.6g}")
    dipole = {"kind": "dipole", "height": at}
    loop = {"kind": "loop", "height": at, "radius": float(f"{size * dice.log(0.3, 2):.6g}")}
    around = {"kind": "loop", "height": middle, "radius": float(f"{size * dice.log(1.5, 3):.6g}")}
    coil = {"kind": "solenoid", "height": at, "radius": loop["radius"], "length": float(f"{size * dice.log(0.1, 0.8):.6g}")}
    wire, uniform = {"kind": "wire"}, {"kind": "uniform"}
    choices = [[dipole], [dipole], [loop], [coil], [dipole, uniform], [around]]
    if R.min() > 0.05 * size:
        choices += [[wire], [wire], [wire]]
    if floats:
        choices = [[wire]] if R.min() > 0.05 * size else []
    if not choices:
        return {}
    chosen = [dict(source) for source in dice.one_of(choices)]
    chi, energy = dice.log(0.1, 3), dice.log(0.02, 1.5)
    scene = {"membrane": {"susceptibility": chi}}
    for source in chosen:
        unit_source = {"dipole": fm.Dipole, "loop": fm.Loop, "solenoid": fm.Solenoid, "wire": fm.Wire, "uniform": fm.Uniform}[
            source["kind"]
        ](strength=1.0, **{k: v for k, v in source.items() if k != "kind"})
        most = float(np.max(unit_source.intensity(R, Z)))
        source["strength"] = float(f"{2 * energy / (chi * most * len(chosen)):.6g}")
    return scene | {"source": chosen}


# --- the walk -----------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Member:
    """A scene with a load at which a state certainly exists.

    ``minimum`` names the controls under which that state is a minimum, ``exact`` the quantity that was asked to be exactly zero.
    """

    seed: int
    family: str
    factor: float
    volume: float
    pressure: float
    center_height: float
    minimum: tuple[str, ...]
    pole: bool
    exact: str = ""
    gas: tuple[float, float, float] | None = None
    walked: int = 0

    @property
    def draft(self) -> Draft:
        return draft(self.seed)

    @property
    def scene(self) -> fm.Scene:
        return self.draft.scene(self.factor)

    def questions(self) -> Iterator[tuple[str, Any, str]]:
        """(keyword of fm.equilibrium, its value, solver)."""
        for control in ("volume", "pressure"):
            load = getattr(self, control)
            for solver in ("ipopt", "newton"):
                if solver == "newton" or control in self.minimum:
                    yield control, load, solver
                    if load == 0 and self.exact == control:
                        yield control, -0.0, solver
        if self.pole:
            yield "center_height", self.center_height, "newton"
        if self.gas is not None:
            yield "gas", fm.Gas(*self.gas), "newton"


class NoTruthError(Exception):
    """The walk of a draft met no state that can be asked for; the reason is the text."""


def walk(seed: int) -> Member:
    """Find a state of the scene of a seed by a walk.

    Raises
    ------
    NoTruthError
    """
    plan = draft(seed)
    scene = plan.scene()
    walker = Walker(Potential(scene))
    spot = _first(plan, walker)
    factor = 1.0
    if walker.potential.surrounded:
        strongest = walker.turn_on(spot)
        # away from the fold at which the state may have ended
        factor = 1.0 if strongest.factor == 1 else float(f"{0.8 * strongest.factor:.3g}")
        if factor < 0.01:
            raise NoTruthError("sources or loads could not be turned on")
        spot = walker.turn_on(spot, factor)
        scene = plan.scene(factor)
        walker = Walker(Potential(scene))
        found = walker.newton(spot.x, spot.pressure, 1.0, walker.at_volume(spot.volume), damped=True, most=30)
        if found is None:
            raise NoTruthError("the weaker scene was not solved")
        spot = found
    spots = list(_tour(plan, walker, spot))
    place = min(int(plan.share * len(spots)), len(spots) - 1) if plan.task == "branch" else len(spots) - 1
    finer = Walker(Potential(_finer(scene)))
    while True:
        chosen = _polished(plan, walker, spots[place])
        if chosen is not None and _resolved(walker, finer, chosen):
            break
        if place == 0 or plan.task != "branch":
            raise NoTruthError("no state was resolved by the mesh")
        place //= 2
    return _member(plan, walker, chosen, factor, len(spots))


def _first(plan: Draft, walker: Walker) -> Spot:
    """A state without sources and loads, moderately inflated."""
    flat = walker.potential.flat
    tension_field = walker.potential.scene.tension_field
    rest = walker.rest
    for amplitude in (0.25, 0.12, 0.5, 0.06, 0.9):
        shapes = [side * amplitude * walker.size * _outward(walker) for side in (1, -1)]
        volumes = [float(walker.evaluate(x, 0.0, 0.0).volume) for x in shapes]
        larger = 0 if abs(volumes[0]) >= abs(volumes[1]) else 1
        if abs(rest) < 1e-9 * walker.size**3:
            larger = 0 if plan.direction > 0 else 1
        spot = walker.from_foundation(shapes[larger])
        if spot is None or not walker.is_minimum(spot, "volume"):
            continue
        if not walker.taut(spot, 1e-3 if tension_field else 1e-4):
            continue
        if plan.everted and not flat and _mirrors(walker):
            spot = _mirrored(walker, spot)
        return spot
    raise NoTruthError("nothing was inflated")


def _outward(walker: Walker) -> Any:
    """Unit normal, falling off to the ends that are held."""
    space = walker.space
    s = space.interpolation_points()
    tangent = np.stack(space.mesh.tangent(s))
    tangent = tangent / np.hypot(*tangent)
    length = space.ends[-1] - space.ends[0]
    along = (s - space.ends[0]) / length
    fall = np.ones_like(s)
    for support, to_end, pole in zip(space.supports, (along, 1 - along), space.on_axis, strict=False):
        if not pole and support.held:
            fall = fall * np.sin(np.pi / 2 * np.minimum(1.0, to_end / 0.5))
    # towards the axis no farther than it is away
    R = space.mesh.position(s)[0]
    fall = fall * (1 - np.maximum(tangent[1], 0.0) * (1 - np.tanh(R / walker.size)))
    return space.interpolate(-tangent[1] * fall, tangent[0] * fall)


def _mirrors(walker: Walker) -> bool:
    """Whether the image of a state in the plane z = 0 is a state: the ends are a pole and a rim in that plane."""
    space = walker.space
    if len(space.supports) != 2 or not space.on_axis[0] or space.on_axis[1] or space.lids:
        return False
    return bool(abs(space.mesh.position(space.ends[-1:])[1][0]) < 1e-12 * walker.size)


def _mirrored(walker: Walker, spot: Spot) -> Spot:
    space = walker.space
    s = space.interpolation_points()
    u, _, w, _ = space.evaluate(spot.x, s.ravel())
    x = space.interpolate(u.reshape(s.shape), -w.reshape(s.shape) - 2 * space.mesh.position(s)[1])
    image = walker.newton(x, -spot.pressure, spot.factor, walker.at_volume(-spot.volume), damped=True, most=30)
    if image is None:
        raise NoTruthError("the mirror image was not solved")
    return image


def _tour(plan: Draft, walker: Walker, start: Spot) -> Iterator[Spot]:
    """States along the branch, as the draft says."""
    if plan.task == "faint":
        spot, excess = start, start.volume - walker.rest
        last = excess * 10 ** -(2 + 5 * plan.share)
        yield start
        while abs(excess) > abs(last):
            excess = math.copysign(max(abs(excess) / 2, abs(last)), excess)
            x = spot.x * (excess / (spot.volume - walker.rest)) if not walker.potential.flat else spot.x
            guess = [(x, spot.pressure), (spot.x, spot.pressure)]
            solved = (walker.newton(y, p, 1.0, walker.at_volume(walker.rest + excess), damped=True, most=40) for y, p in guess)
            new = next((s for s in solved if s is not None), None)
            if new is None or not walker.taut(new):
                return
            spot = new
            yield new
        return
    direction = plan.direction if abs(walker.rest) < 1e-9 * walker.size**3 else int(math.copysign(1, start.volume))
    if plan.task != "branch":
        direction = -direction if plan.task == "zero volume" else _towards_zero(walker, start)
    elif walker.potential.surrounded and plan.share < 0.3:
        direction = -direction
    yield start
    quantity = {"zero pressure": "pressure", "zero volume": "volume"}.get(plan.task)
    before, largest = start, 1e4 * walker.size**3
    for spot in walker.branch(start, direction, 80 if quantity else plan.steps):
        if not walker.clear(spot) or abs(spot.volume) > largest or not walker.taut(spot):
            return
        if quantity and getattr(before, quantity) * getattr(spot, quantity) < 0:
            control = walker.at_pressure(0.0) if quantity == "pressure" else walker.at_volume(0.0)
            new = walker.newton(before.x, before.pressure, 1.0, control, damped=True, most=40)
            if new is not None and walker.taut(new):
                yield new
            return
        yield spot
        before = spot


def _towards_zero(walker: Walker, start: Spot) -> int:
    points = [next(iter(walker.branch(start, d, 1)), None) for d in (1, -1)]
    pressures = [abs(p.pressure) if p is not None else math.inf for p in points]
    return 1 if pressures[0] < pressures[1] else -1


def _polished(plan: Draft, walker: Walker, spot: Spot) -> Spot | None:
    """The state at a load of few digits where its branch is regular: the load is a number that someone may have typed."""
    if plan.task == "branch":
        for digits in (4, 8):
            volume = float(f"{spot.volume:.{digits}g}")
            new = walker.newton(spot.x, spot.pressure, spot.factor, walker.at_volume(volume), most=10)
            if new is not None and walker.rms(new.x - spot.x) < 0.02 * walker.size:
                spot = new
                break
    return spot if walker.residual(spot) < 1e-8 and walker.taut(spot) else None


def _finer(scene: fm.Scene) -> fm.Scene:
    mesh: Any = scene.mesh
    return scene.replace(mesh=mesh.with_elements(2 * mesh.elements))


def _resolved(walker: Walker, finer: Walker, spot: Spot) -> bool:
    """Whether the state is there on a mesh of half the size, with about the same pressure at its volume, or volume at its pressure."""
    for control in (finer.at_volume(spot.volume), finer.at_pressure(spot.pressure)):
        other = walker.moved_to(spot, finer, control)
        if other is not None:
            change = abs(other.pressure - spot.pressure) / max(abs(spot.pressure), 1e-9 / walker.size)
            size = abs(other.volume - spot.volume) / max(abs(spot.volume - walker.rest), 1e-12 * walker.size**3)
            small = abs(spot.pressure) * walker.size < 1e-3 and abs(other.pressure - spot.pressure) * walker.size < 1e-5
            return (change < RESOLVED or small) and size < RESOLVED and finer.taut(other)
    return False


def _member(plan: Draft, walker: Walker, spot: Spot, factor: float, walked: int) -> Member:
    minimum = tuple(c for c in ("volume", "pressure") if walker.is_minimum(spot, c))
    exact = {"zero pressure": "pressure", "zero volume": "volume"}.get(plan.task, "") if walked > 1 else ""
    volume, pressure = spot.volume, spot.pressure
    if exact == "volume" and abs(volume) < 1e-9 * walker.size**3:
        volume = 0.0
    elif exact == "pressure" and abs(pressure) < 1e-9 / walker.size:
        pressure = 0.0
    else:
        exact = ""
    if plan.task == "branch" and abs(float(f"{volume:.8g}") - volume) <= 1e-13 * abs(volume):
        volume = float(f"{volume:.8g}")
    gas = None
    if plan.share < 0.5 and plan.task == "branch":
        chamber = max(0.0, -volume) + plan.gas[0] * walker.size**3
        atmosphere = max(0.0, -pressure) + plan.gas[1] / walker.size
        gas = ((pressure + atmosphere) * (volume + chamber), chamber, atmosphere)
    pole = bool(walker.space.on_axis.size and walker.space.on_axis[0] and walker.space.pole < walker.n) and not walker.space.lids
    return Member(plan.seed, plan.family, factor, volume, pressure, walker.space.center_height(spot.x), minimum, pole, exact, gas, walked)


# --- asking -------------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Answer:
    """How a question was answered: right, wrong, refused, crashed, warned, or not in time."""

    member: Member
    control: str
    load: Any
    solver: str
    verdict: str
    text: str
    iterations: int = 0
    seconds: float = 0.0
    other: bool = False

    @property
    def good(self) -> bool:
        return self.verdict == "answered"

    def snippet(self) -> str:
        """Code that asks again."""
        tables = scaled_loads(self.member.draft.tables, self.member.factor)
        scene = f"population.member({self.member.seed}).scene" if "points" in tables["mesh"] else f"fm.Scene.from_dict({tables})"
        solver = "" if self.control in ("center_height", "gas") else f", solver={self.solver!r}"
        load = f"fm.{self.load}" if self.control == "gas" else repr(self.load)
        return f"fm.equilibrium({scene}, {self.control}={load}{solver})"


class _LateError(Exception):
    pass


def _ring(*_: Any) -> None:
    raise _LateError


def ask(member: Member) -> list[Answer]:
    """Every question of a member, cold, with what came of it."""
    return [_ask(member, *question) for question in member.questions()]


def _ask(member: Member, control: str, load: Any, solver: str) -> Answer:
    clock = time.perf_counter()
    old = signal.signal(signal.SIGALRM, _ring)
    signal.alarm(PATIENCE)
    eq, verdict, text = None, "", ""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            how = {} if control in ("center_height", "gas") else {"solver": solver}
            eq = fm.equilibrium(member.scene, **{control: load}, **how)
        except fm.SolveError as error:
            verdict, text = "refused", f"[{error.status.name}] {error}"
            if CLAIMS.search(str(error)):
                verdict = "wrong: false claim"
        except _LateError:
            verdict, text = "late", f"more than {PATIENCE} s"
        except Warning as warning:
            verdict, text = "warned", f"{type(warning).__name__}: {warning}"
        except Exception as error:
            verdict, text = "crashed", f"{type(error).__name__}: {str(error)[:200]}"
        finally:
            signal.alarm(0)
            signal.signal(signal.SIGALRM, old)
    seconds = time.perf_counter() - clock
    if eq is None:
        return Answer(member, control, load, solver, verdict, text, seconds=seconds)
    verdict, text, other = judge(member, control, load, solver, eq)
    return Answer(member, control, load, solver, verdict, text, eq.iterations, seconds, other)


def judge(member: Member, control: str, load: Any, solver: str, eq: fm.Equilibrium) -> tuple[str, str, bool]:
    """(verdict, text, whether it is another state than that of the walk) of an equilibrium that was returned."""
    scene = member.scene
    walker = Walker(Potential(scene))
    spot = Spot(np.array(eq.state), eq.pressure, 1.0, walker.evaluate(np.array(eq.state), eq.pressure, 1.0))
    size = walker.size
    found = f"V = {eq.volume:.9g}, P = {eq.pressure:.9g} where V = {member.volume:.9g}, P = {member.pressure:.9g} exists"
    if eq.status is not fm.Status.CONVERGED:
        return "refused", f"a state with status {eq.status.name} ({found})", True
    residual = walker.residual(spot)
    if not residual < 1e-8:
        return "wrong: residual", f"{residual:.1e} ({found})", True
    held = {"volume": (eq.volume, size**3), "pressure": (eq.pressure, 1 / size), "center_height": (eq.center_height, size)}
    if control == "gas":
        error = abs(load.pressure(eq.volume) - eq.pressure) / (abs(eq.pressure) + load.atmosphere)
    else:
        error = abs(held[control][0] - load) / (abs(load) + 1e-3 * held[control][1])
    if not error < 1e-8:
        return "wrong: another load", f"by {error:.1e} ({found})", True
    excess = abs(member.volume - walker.rest)
    near = abs(eq.volume - member.volume) <= 1e-5 * excess + 1e-9 * size**3
    near = near and abs(eq.pressure - member.pressure) * size <= 1e-5 * (abs(member.pressure) * size + 1e-6)
    near = near and abs(eq.center_height - member.center_height) <= 1e-5 * (abs(member.center_height) + size)
    if near:
        return "answered", found, False
    if not walker.taut(spot, -1e-8):
        return "wrong: compressed", f"though converged ({found})", True
    if solver == "ipopt" and control in ("volume", "pressure") and not walker.is_minimum(spot, control):
        return "wrong: no minimum", found, True
    finer = Walker(Potential(_finer(scene)))
    equation = {
        "volume": finer.at_volume(eq.volume),
        "pressure": finer.at_pressure(eq.pressure),
        "center_height": finer.at_height(eq.center_height),
        "gas": finer.at_gas(load.amount, load.chamber, load.atmosphere) if control == "gas" else None,
    }[control]
    there = walker.moved_to(spot, finer, equation)
    if there is None:
        return "wrong: unresolved", f"not there on a finer mesh ({found})", True
    change = abs(there.pressure - eq.pressure) / (abs(eq.pressure) + 1e-6 / size)
    change = max(change, abs(there.volume - eq.volume) / (abs(eq.volume - walker.rest) + 1e-6 * size**3))
    if change > UNRESOLVED:
        return "wrong: unresolved", f"moves by {change:.1e} on a finer mesh ({found})", True
    return "answered", found, True


# --- record and report --------------------------------------------------------------------------------------------------------------


@cache
def recorded(path: Path = RECORD) -> dict[int, Member]:
    """Members by their seeds, as the record has them; seeds without a truth are left out."""
    members = {}
    for row in json.loads(path.read_text(encoding="utf-8")) if path.exists() else []:
        row["minimum"] = tuple(row["minimum"])
        row["gas"] = tuple(row["gas"]) if row.get("gas") else None
        members[row["seed"]] = Member(**row)
    return members


def member(seed: int) -> Member:
    """The member of a seed, from the record or by walking."""
    known = recorded()
    return known[seed] if seed in known else walk(seed)


def record(members: Sequence[Member], path: Path = RECORD) -> None:
    rows = [json.dumps({k: v for k, v in asdict(m).items() if v not in ("", None)}) for m in members]
    path.write_text("[\n" + ",\n".join(rows) + "\n]\n", encoding="utf-8")


@dataclass
class Report:
    """Answers, counted."""

    answers: list[Answer] = field(default_factory=list)

    def table(self) -> str:
        lines = [
            f"{'family':<14}{'scenes':>7}{'asked':>7}{'answered':>9}{'refused':>8}{'wrong':>7}{'crashed':>8}{'its':>6}{'its 95%':>8}{'ms':>7}{'ms 95%':>8}"
        ]
        groups: dict[str, list[Answer]] = defaultdict(list)
        for answer in self.answers:
            groups[answer.member.family].append(answer)
        for name, group in [*groups.items(), ("all", self.answers)]:
            kinds = Counter(a.verdict.split(":")[0] for a in group)
            its, ms = ([getattr(a, key) for a in group if a.good] or [0] for key in ("iterations", "seconds"))
            crashed = kinds["crashed"] + kinds["warned"] + kinds["late"]
            lines.append(
                f"{name:<14}{len({a.member.seed for a in group}):>7}{len(group):>7}{kinds['answered']:>9}{kinds['refused']:>8}{kinds['wrong']:>7}"
                f"{crashed:>8}{np.median(its):>6.0f}{np.percentile(its, 95):>8.0f}{1e3 * np.median(ms):>7.0f}{1e3 * np.percentile(ms, 95):>8.0f}"
            )
        return "\n".join(lines)

    @property
    def share(self) -> float:
        """Of the questions, those that were answered."""
        return sum(a.good for a in self.answers) / max(len(self.answers), 1)

    @property
    def whole(self) -> float:
        """Of the scenes, those of which every question was answered."""
        failed = {a.member.seed for a in self.answers if not a.good}
        return 1 - len(failed) / max(len({a.member.seed for a in self.answers}), 1)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.population")
    parser.add_argument("what", choices=["ask", "record", "walk"])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--out", type=Path, default=None, help="record: where to write; ask: a JSON file of what failed")
    asked = parser.parse_args(arguments)
    seeds = range(asked.first, asked.first + asked.count)
    report, members, lost = Report(), [], Counter()
    for seed in seeds:
        try:
            if asked.what == "ask":
                if RECORD.exists() and seed not in recorded():
                    continue
                one = member(seed)
            else:
                one = walk(seed)
        except NoTruthError as reason:
            lost[draft(seed).family, str(reason)] += 1
            print(f"seed {seed}: no truth, {reason} ({draft(seed).family})", file=sys.stderr)
            continue
        members.append(one)
        if asked.what == "walk":
            print(one)
        if asked.what == "ask":
            answers = ask(one)
            report.answers += answers
            for answer in answers:
                if not answer.good:
                    print(f"# seed {seed} ({one.family}) {answer.verdict}: {answer.text}\n{answer.snippet()}\n", flush=True)
    if asked.what == "record":
        record(members, asked.out or RECORD)
    if asked.what == "ask":
        print(report.table())
        print(f"questions answered {report.share:.2%}, scenes answered in everything {report.whole:.2%}")
    for (family, reason), count in sorted(lost.items()):
        print(f"no truth: {family}: {reason}: {count}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
