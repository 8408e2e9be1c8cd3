"""One registry of problems, built from the reference tables, to be crossed with every solver.

A point of a scene is an equilibrium that an independent solver has tabulated (data/README.md). It becomes one problem for each control
under which it is a minimum: that is where a minimiser and the Newton corrector must both find it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

import femmembrane as fm

SOLVERS = ("ipopt", "newton")
CONTROLS = ("pressure", "volume")

#: Table 1 of the paper
OGDEN = fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0))
SUSCEPTIBILITY = 2.5

_TABLES = json.loads((Path(__file__).parent / "data" / "disc.json").read_text(encoding="utf-8"))

_EFFECTS = {table["name"]: table for table in json.loads((Path(__file__).parent / "data" / "effects.json").read_text(encoding="utf-8"))}


def effect(name: str) -> list[dict[str, float]]:
    """The points of one table of data/effects.json."""
    return list(_EFFECTS[name]["points"])


def disc_scene(material: Any = OGDEN, dipole: tuple[float, float] | None = None, elements: int = 64, degree: int = 2) -> fm.Scene:
    """The clamped disc with the paper's susceptibility; ``dipole`` is (strength, height)."""
    return fm.Scene(
        material=material,
        sources=[] if dipole is None else [fm.Dipole(*dipole)],
        susceptibility=SUSCEPTIBILITY,
        mesh=fm.disc(elements=elements),
        degree=degree,
    )


def _scene_of(table: Mapping[str, Any]) -> fm.Scene:
    mu, alpha = tuple(table["material"]["mu"]), tuple(table["material"]["alpha"])
    material = fm.NeoHookean() if (mu, alpha) == ((1.0,), (2.0,)) else fm.Ogden(mu, alpha)
    scene = disc_scene(material, None if table["height"] is None else (table["strength"], table["height"]))
    return scene.replace(susceptibility=table["susceptibility"], radius_to_thickness=table["thickness_ratio"])


SCENES: Mapping[str, fm.Scene] = MappingProxyType({table["name"]: _scene_of(table) for table in _TABLES})
#: limit points and volume folds of each scene, along the branch
SPECIAL_POINTS: Mapping[str, list[dict[str, Any]]] = MappingProxyType({table["name"]: table["special_points"] for table in _TABLES})


@dataclass(frozen=True, eq=False)
class Point:
    """A tabulated equilibrium; ``profile`` is empty for limit points."""

    scene_name: str
    expected: Mapping[str, Any]
    kind: str = "point"

    @property
    def name(self) -> str:
        return f"{self.scene_name}-{self.expected['center_height']:.4g}"

    @property
    def scene(self) -> fm.Scene:
        return SCENES[self.scene_name]

    @property
    def profile(self) -> Mapping[str, Any]:
        return self.expected.get("profile", {})

    def is_minimum(self, control: str) -> bool:
        """Whether a minimiser holds it under this control; at a limit point pressure control is marginal and counts as no."""
        return self.expected[f"lambda_{control}"] > 1e-6


@dataclass(frozen=True, eq=False)
class Problem:
    """A point that is asked for under one control, from an equilibrium some way off, so that every solver has work to do."""

    point: Point
    control: str

    @property
    def name(self) -> str:
        return f"{self.point.name}-{self.control}"

    def solve(self, solver: str) -> fm.Equilibrium:
        return _solve(self, solver)


@cache
def _solve(problem: Problem, solver: str) -> fm.Equilibrium:
    # a pressure has several minima: the start, at nearly the volume of the tabulated one, says which is meant
    start = _neighbour(problem.point, solver)
    load = problem.point.expected[problem.control]
    return fm.equilibrium(problem.point.scene, **{problem.control: load}, start=start, solver=solver)


@cache
def _neighbour(point: Point, solver: str) -> fm.Equilibrium:
    return fm.equilibrium(point.scene, volume=0.98 * point.expected["volume"], solver=solver)


POINTS = tuple(Point(table["name"], point) for table in _TABLES for point in table["points"])
LIMIT_POINTS = tuple(
    Point(table["name"], point, point["kind"]) for table in _TABLES for point in table["special_points"] if point["kind"] == "limit_point"
)
PROBLEMS = tuple(Problem(point, control) for point in (*POINTS, *LIMIT_POINTS) for control in CONTROLS if point.is_minimum(control))
