"""Rigid bodies where contact begins, ends, is everywhere, or meets a limit point; and bodies that move."""

from __future__ import annotations

import numpy as np

import femmembrane as fm

from .registry import Family, Number, Stop, reached, settled

FAMILY = Family(13, "contact")

NH = fm.NeoHookean()
HEIGHT = "obstacle.0.height"
#: first touch of a plate at 0.5, and P and V with a contact of radius 0.3: nine digits of a shooting code
TOUCH, AT_03 = (0.900638437, 0.888015530), (1.309893716, 1.054478791)


def plate(height: float = 0.5, elements: int = 32, **more: object) -> fm.Scene:
    return fm.Scene(material=NH, mesh=fm.disc(elements), obstacles=[fm.Plane(height=height)], **more)  # type: ignore[arg-type]


def event(branch: fm.Branch, kind: str) -> fm.SpecialPoint:
    return next(point for point in branch.special_points or () if point.kind == kind)


@FAMILY.case("P and force at the touch itself", "the pole is held by no force", Number((TOUCH[0], 0.0), abs=1e-7))
def at_touch() -> tuple[float, float]:
    eq = settled(fm.equilibrium(plate(elements=64), volume=TOUCH[1]))
    return eq.pressure, eq.contact.force


@FAMILY.case("10 elements", "two of them in contact", Number(AT_03[0], abs=2e-4), 10)
@FAMILY.case("100 elements", "the border inside an element", Number(AT_03[0], abs=5e-8), 100)
def elements(count: int) -> float:
    return settled(fm.equilibrium(plate(elements=count), volume=AT_03[1])).pressure


@FAMILY.case("a plate 1e-12 from rest, P/V^3", "touched where w^3 is 1e-36", Number(3.3367, rel=1e-3))
def next_to_rest() -> float:
    touch = event(reached(fm.trace(plate(1e-12, 16), start=1e-12, until={"volume": 2.2e-12})), "touch")
    return touch.pressure / touch.volume**3


@FAMILY.case("a plate at the height of the limit point", "a fold in a corner of the branch", Number(1.0, abs=1e-9))
def at_limit() -> float:
    bare = fm.trace(fm.Scene(material=NH, mesh=fm.disc(32)), start=1.0, until={"volume": 4.0})
    limit = event(bare, "limit_point")
    branch = reached(fm.trace(plate(limit.center_height), start=1.0, until={"volume": 6.0}))
    return event(branch, "touch").pressure / limit.pressure


@FAMILY.case("release under falling pressure, P over that of the touch", "the same corner from the other side", Number(1.0, abs=1e-9))
def release() -> float:
    down = reached(fm.trace(plate(), start=1.0, direction=-1, until={"volume": 0.6}))
    up = reached(fm.trace(plate(), start=0.6, until={"volume": 1.0}))
    return event(down, "release").pressure / event(up, "touch").pressure


@FAMILY.case("a ball in a ball, area", "every node is held, and no border is left", Number(4 * np.pi * 1.2**2, rel=1e-3))
def everywhere() -> float:
    half = np.pi / 16
    turn = half + 2 * half * np.arange(8)
    corners = 1.2 / np.cos(half) * np.stack([np.sin(turn), np.cos(turn)], axis=1)
    mould = fm.Mould([(0.0, 1.2), *map(tuple, corners.tolist()), (0.0, -1.2)], rounding=1.2)
    scene = fm.Scene(material=NH, mesh=fm.sphere(24), obstacles=[mould])
    return settled(fm.equilibrium(scene, pressure=3.0)).contact.area


@FAMILY.case("a plate before a dipole, pole height", "the dipole pulls and the plate holds", Number(0.25, abs=1e-12))
def with_dipole() -> float:
    scene = plate(0.25, sources=[fm.Dipole(strength=2.0, height=2.0)], susceptibility=1.0)
    return settled(fm.equilibrium(scene, pressure=0.3)).center_height


@FAMILY.case("a plate that closes on a disc, P", "nothing moves before the touch, and then all at once", Number(AT_03[0], abs=5e-5))
def closing() -> float:
    branch = fm.trace(plate(0.6, 16), over=HEIGHT, hold={"volume": AT_03[1]}, until={HEIGHT: 0.5}, max_steps=80)
    return reached(branch)[-1].pressure


@FAMILY.case("a plate through the rim", "there is no such scene", Stop(fm.Status.NO_EQUILIBRIUM, "last value"))
def through_the_rim() -> fm.Branch:
    return fm.trace(plate(0.3, 8), over=HEIGHT, hold={"pressure": -1.0}, until={HEIGHT: -0.5}, max_steps=80)
