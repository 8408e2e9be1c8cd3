"""Random scenes, each from its seed alone: all shapes, supports, materials, sources and loads, in many units, some upside down.

A scene is plain data, the tables of a scene file. Which of its states is asked for is said in a :class:`Draft` too.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import femmembrane as fm
from femmembrane.potential import Potential


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


@dataclass
class Draft:
    """A scene before the walk, and what the walk is to do.

    Attributes
    ----------
    seed, family, tables
        The tables are those of a scene file.
    unit : float
        Length that is of the order of the membrane's size where points are given.
    direction : {1, -1}
        Whether a flat membrane is lifted or lowered.
    task : str
        "branch": some state along it; "zero pressure", "zero volume": where it is exactly zero; "faint": next to rest.
    share, steps : float, int
        Of how many steps along the branch which one is asked for.
    everted : bool
        Whether the walk begins at the image in the plane of the rim, where there is one.
    gas : (float, float)
        Chamber and atmosphere in the size of the membrane.
    """

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
    """The scene of a seed, and what is to be asked of it."""
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
        steps=int(dice.log(2, 150)),
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
    rim = dice.one_of(["clamped", "clamped", "radial", "mirror", "clamped", "hub"])  # nothing would hold it in a pipe
    return {"shape": "cap", "height": height * (-1 if dice.chance(0.3) else 1), **_elements(dice, 12, 48), "rim": rim}, 1.0


def _round_cap(dice: Dice) -> tuple[dict[str, Any], float]:
    height = dice.log(5, 60) * (-1 if dice.chance(0.3) else 1)
    # the rim is small beside the sphere: elements become small towards it
    return {"shape": "cap", "height": height, "elements": dice.whole(24, 48), "degree": 3, "ratio": dice.number(0.02, 0.1)}, 1.0


def _sphere(dice: Dice) -> tuple[dict[str, Any], float]:
    return {"shape": "sphere", **_elements(dice, 8, 32)}, 1.0


def _tube(dice: Dice) -> tuple[dict[str, Any], float]:
    length = dice.log(0.3, 30)
    words = ["clamped", "clamped", "hub", "hub", "mirror", "radial", "axial", "free"]
    top, bottom = dice.one_of(words), dice.one_of(words)
    ends = {top, bottom}
    if "axial" in ends and not ends & {"clamped", "mirror", "radial"}:  # nothing holds it in its pipe; in two pipes it keeps its length
        top, bottom = ("clamped", bottom) if top == "axial" != bottom else (top, "clamped")
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
