"""Flat and nearly flat membranes: no stiffness across the plane, displacements of very different sizes."""

from __future__ import annotations

import femmembrane as fm

from ..cases import OGDEN, disc_scene
from .registry import Exit, Family, Number, Stop, run_file, settled

FAMILY = Family(1, "flat")

#: P/V^3 of a neo-Hookean disc as V -> 0 (tests/verification/test_orders.py)
CUBIC = 3.336717

SCENE = """
[material]
model = "neo-hookean"
[mesh]
elements = 16
[run]
"""


@FAMILY.case("V = 1e-9", "u is 1e-9 of w, energies are 1e-36", Number(CUBIC, rel=1e-6), 1e-9)
def cubic_law(volume: float) -> float:
    """P = 3.336717 V^3 of the neo-Hookean disc, from a cold start."""
    eq = settled(fm.equilibrium(disc_scene(fm.NeoHookean(), elements=64, degree=4), volume=volume))
    return eq.pressure / eq.volume**3


@FAMILY.case("zero load, no source", "the Hessian is singular", Number((0.0, 0.0, 0.0)))
def flat_at_rest() -> tuple[float, ...]:
    eq = settled(fm.equilibrium(disc_scene(OGDEN, elements=16), volume=0.0))
    return eq.pressure, eq.center_height, eq.energy


@FAMILY.case("trace from V = 0", "no path leaves a state without stiffness", Stop("start", "small volume"))
def trace_from_flat() -> fm.Branch:
    return fm.trace(disc_scene(OGDEN, elements=16), start=0.0)


@FAMILY.case("command, V = -1 to 1 through 0", "a load of a list is the flat membrane", Exit(0))
def command_through_zero() -> object:
    return run_file(SCENE + "values = [-1.0, 0.0, 1.0]\n")
