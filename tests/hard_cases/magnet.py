"""Magnets with a body: next to the membrane, tiny, huge, thin, far away, pierced at rest, and led through it."""

from __future__ import annotations

import numpy as np

import femmembrane as fm

from ..cases import OGDEN, disc_scene
from .registry import Exit, Family, Number, Stop, run_file, settled

FAMILY = Family(12, "magnet")

MEETS = Stop("source.height", "meets the magnet at rest")
CONTACT = Stop(fm.Status.DIPOLE_CONTACT, "source")


def beside(*magnets: fm.Magnet, **more: object) -> fm.Scene:
    return disc_scene(OGDEN, elements=16, degree=3).replace(sources=magnets, **more)


@FAMILY.case("face in the plane of the rim", "touches without overlap", MEETS, -0.2, 0.4, 0.0)
@FAMILY.case("a needle of 1e-9 through the membrane", "lies between all points of a mesh", MEETS, 0.0, 1e-9, 0.0)
@FAMILY.case("a ring of 0.01 through the membrane", "lies between two nodes", MEETS, 0.0, 0.505, 0.495)
@FAMILY.case("the rim stretched into a ring", "free at R0, pierced where the membrane rests", MEETS, 0.0, 1.6, 1.2, 1.3)
def pierced_at_rest(height: float, radius: float, inner: float, stretch: float = 1.0) -> fm.Scene:
    return beside(fm.Magnet(height, radius, 0.4, 1.0, inner_radius=inner), prestretch=stretch)


@FAMILY.case("trace into the face", "its field is finite there", CONTACT, 1.5, 0.4, 0.0)
@FAMILY.case("trace into a needle", "thinner than an element", CONTACT, 1.5, 1e-3, 0.0)
@FAMILY.case("trace into the wall of a ring", "the pole is free in its hole", CONTACT, 0.9, 2.0, 1.5)
def led_into_it(height: float, radius: float, inner: float) -> fm.Branch:
    return fm.trace(beside(fm.Magnet(height, radius, 0.4, 1e-3, inner_radius=inner)), start=0.3, until={"volume": 200.0})


@FAMILY.case("pole in the body, from below", "its field is not a number there", CONTACT, 1.6, True)
@FAMILY.case("pole beyond the body, from below", "a step may jump across", CONTACT, 2.5, True)
@FAMILY.case("pole in the body, cold", "everything is tried", CONTACT, 1.6, False, slow=True)
@FAMILY.case("pole beyond the body, cold", "the magnet is inside the dome", Number(1.51704360, rel=1e-7), 2.5, False, slow=True)
def beyond(height: float, from_below: bool) -> float:
    """Recorded on 2026-11-28."""
    scene = beside(fm.Magnet(1.5, 0.4, 0.4, 0.01))
    start = fm.equilibrium(scene, center_height=1.2) if from_below else None
    return settled(fm.equilibrium(scene, center_height=height, start=start)).pressure


@FAMILY.case("radius and length 1e-6, M = 200", "its ends cancel to 13 digits", Number(0.0, abs=1e-7), 1e-6, 1e-6, 4.0)
@FAMILY.case("length 1e-6 of a radius of 1e-3", "a disc of charge and its opposite", Number(0.0, abs=1e-6), 1e-3, 1e-6, 4.0)
def as_a_dipole(radius: float, length: float, height: float) -> float:
    one, other = (
        settled(fm.equilibrium(beside(source), volume=1.0)).pressure  # type: ignore[arg-type]
        for source in (fm.Magnet(height, radius, length, 200.0), fm.Dipole(200.0, height))
    )
    return one / other - 1


@FAMILY.case("radius 1e6", "its edges are out of sight", Number(1.0, rel=1e-6))
def wide() -> float:
    """Next to a face so wide the field is that of a loop of current at its edge, in its middle: m l/(2 a)."""
    magnet = fm.Magnet(-3.0, 1e6, 0.4, 1.0)
    return float(magnet.field(0.5, 0.0)[1] / (magnet.magnetization * 0.4 / (2 * 1e6)))


@FAMILY.case("length 1e6, radius 1e-4", "a magnetic charge, the other one out of sight", Number(0.0, abs=1e-8))
def long() -> float:
    """pi a^2 m at the distance d: h = m a^2 d/(4 |d|^3), up to (a/d)^2."""
    magnet, d = fm.Magnet(-2.0 - 5e5, 1e-4, 1e6, 1.0), np.array([0.5, 2.3])
    h = np.array(magnet.field(0.5, 0.3)[:2]) / magnet.magnetization
    return float(np.abs(h * 4e8 * np.hypot(*d) ** 3 / d - 1).max())


COMMAND = """
[material]
model = "neo-hookean"
[membrane]
susceptibility = 2.5
[[source]]
kind = "magnet"
radius = 0.4
length = 0.4
"""


@FAMILY.case("command, remanence without scales", "T are no units of the scene", Exit(2, "source.scales"), "height = 3.0\nremanence = 1.3")
@FAMILY.case("command, neither", "no strength follows", Exit(2, "source.strength"), "height = 3.0")
@FAMILY.case("command, pierced at rest", "the body is in the way", Exit(2, "source.height"), "height = 0.1\nstrength = 1.0")
def command(rest: str) -> object:
    return run_file(f"{COMMAND}{rest}\n[run]\nvalues = [0.5]\n")
