"""Compression and slackness: where the plain membrane is ill-posed and a tension field has nothing to hold."""

from __future__ import annotations

import numpy as np

import femmembrane as fm

from ..cases import OGDEN, disc_scene
from ..verification.test_relaxed_states import pillow
from .registry import Family, Number, Stop, settled

FAMILY = Family(4, "slack")

#: below this dipole the plain membrane is compressed along its meridian at pole heights 0.235 to 0.32
STRONG = (600.0, -3.25)
COMPRESSED = "compression at r = 0.54 to 0.74: states depend on the mesh"
NAMED = Stop(fm.Status.LEGENDRE_FAILURE, "compressive at r")


@FAMILY.case("pole from 1 to 0.3, plain, 32 elements", COMPRESSED, NAMED, 32, 2, 0.3)
@FAMILY.case("pole from 1 to 0.2, plain, 64 elements", "regular there, but not on the way", NAMED, 64, 2, 0.2)
@FAMILY.case("pole from 1 to 0.26, plain, 16 of degree 4", COMPRESSED, NAMED, 16, 4, 0.26)
def through_compression(elements: int, degree: int, height: float) -> fm.Branch:
    scene = disc_scene(OGDEN, STRONG, elements, degree)
    return fm.run(scene.replace(run=fm.Run(control="height", values=(1.0, height))))


@FAMILY.case("V: 1, 0.2, plain, 32 elements", "a fold of the mesh: V = 0.211, 0.228 on two", NAMED, 32, 2)
@FAMILY.case("V: 1, 0.2, plain, 16 of degree 4", "a fold of the mesh: V = 0.221", NAMED, 16, 4)
def down_in_volume(elements: int, degree: int) -> fm.Branch:
    return fm.inflate(disc_scene(OGDEN, STRONG, elements, degree), volumes=[1.0, 0.2], throw=False)


@FAMILY.case("trace down, plain", COMPRESSED, NAMED)
def traced_into_compression() -> fm.Branch:
    return fm.trace(disc_scene(OGDEN, STRONG, 32, 4), start=2.1, until={"center_height": 0.1}, direction=-1)


@FAMILY.case("trace down, tension field", "the meridian folds on a circle", Stop(fm.Status.SLACK, r"vanishes at r = 0\.7"))
def traced_to_the_slack_circle() -> fm.Branch:
    return fm.trace(disc_scene(OGDEN, STRONG).replace(tension_field=True), start=2.1, until={"center_height": 0.1}, direction=-1)


#: by shooting (tests/verification/test_relaxed_states.py): V/(2 pi), pole height and radius where the tension of the meridian vanishes
SLACK_AT = (0.0345, 0.3211, 0.731)


@FAMILY.case("where the slack circle opens, 256 elements", "approached at order 1", Number(SLACK_AT, rel=0.1), 256)
def slack_circle(elements: int) -> tuple[float, float, float]:
    scene = disc_scene(OGDEN, STRONG, elements).replace(tension_field=True)
    branch = fm.trace(scene, start=fm.equilibrium(scene, center_height=0.36), until={"center_height": 0.1}, direction=-1)
    if branch.status is not fm.Status.SLACK:
        raise AssertionError(str(branch.status))
    last = branch[-1]
    profile = last.profile(np.linspace(0.5, 0.9, 401))
    return last.volume / (2 * np.pi), last.center_height, float(profile["r"][np.argmin(profile["mechanical_stress_1"])])


@FAMILY.case("tension field above the slack circle", "zone borders lie inside elements", Number((3.234037, 0.262481), rel=2e-4), 64)
@FAMILY.case("the same, 256 elements", "mesh-independent until it opens", Number((3.234037, 0.262481), rel=5e-6), 256)
def above_the_slack_circle(elements: int) -> tuple[float, float]:
    """P and V at a pole height of 0.34; recorded on 2026-11-24 with 1024 elements, see tests/verification/test_relaxed_states.py."""
    eq = settled(fm.equilibrium(disc_scene(OGDEN, STRONG, elements).replace(tension_field=True), center_height=0.34))
    return eq.pressure, eq.volume


SLACK = Stop(fm.Status.SLACK, "tension vanishes|no tension")


@FAMILY.case("pole at 0.2, tension field, cold", "beyond the fold of the meridian", SLACK, {"center_height": 0.2})
@FAMILY.case("V = 0.2, tension field, cold", "beyond the fold of the meridian", SLACK, {"volume": 0.2})
def beyond_the_slack_circle(load: dict[str, float]) -> fm.Equilibrium:
    return settled(fm.equilibrium(disc_scene(OGDEN, STRONG, 32).replace(tension_field=True), **load))


@FAMILY.case("last pole height slack, tension field", "nothing comes after it to stop at", SLACK)
def last_load_slack() -> fm.Branch:
    scene = disc_scene(OGDEN, STRONG, 32).replace(tension_field=True)
    return fm.run(scene.replace(run=fm.Run(control="height", values=(0.5, 0.3417))))


@FAMILY.case("taut, with and without tension field", "off means off: to the last bit", Number((0.0, 0.0)))
def taut() -> tuple[float, float]:
    plain, relaxed = (
        settled(fm.equilibrium(disc_scene(OGDEN, (200.0, 6.5)).replace(tension_field=on), volume=30.0)) for on in (False, True)
    )
    return relaxed.pressure - plain.pressure, float(np.abs(relaxed.state - plain.state).max())


@FAMILY.case("50 waves, compressed state", "no eigenvalue has a meaning", Number((1.0, 1.0)))
def waves_in_compression() -> tuple[float, float]:
    """Unstable for short waves, said so, without a number."""
    verdict = fm.equilibrium(disc_scene(OGDEN, (400.0, -3.25), 32), center_height=-0.1).verdict(azimuthal=50)
    return float(verdict.stable is False), float(np.isnan(verdict.smallest_eigenvalue) and "short" in verdict.reason)


#: what wrinkles do below this dipole: tests/accuracy/test_borders.py and tests/solve/test_zone_events.py, by shooting
WRINKLES = (400.0, -3.75)
BORDERS, VOLUME, PRESSURE = (0.2137303397757, 0.611444042248), -0.11434457467706287, 1.2176228677685645
OPENS, CLOSES = 1.0044212174383782, 1.2860120813168887


def following(elements: int, degree: int) -> fm.Scene:
    return disc_scene(OGDEN, WRINKLES, elements, degree).replace(tension_field=True, follow_borders=True)


@FAMILY.case("a border within 1e-9 of an end, 8 of degree 6", "nothing is left to move", Number(PRESSURE, rel=1e-10), 1e-9)
@FAMILY.case("a border on an end, 8 of degree 6", "an element of no length", Number(PRESSURE, rel=1e-10), 0.0)
def border_at_an_end(miss: float) -> float:
    inner, outer = BORDERS
    ends = (0.0, 0.1, inner + miss, 0.35, 0.5, outer - miss, 0.75, 0.9, 1.0)
    scene = following(8, 6).replace(mesh=fm.disc(radii=ends))
    return settled(fm.equilibrium(scene, volume=VOLUME, start=fm.equilibrium(scene, center_height=-0.3))).pressure


@FAMILY.case("a trace over two zone events, 8 of degree 6", "no zone has a width there", Number((OPENS, CLOSES), rel=1e-10), 8, 6)
@FAMILY.case("the same, 4 of degree 4", "the zone is smaller than an element", Number((OPENS, CLOSES), rel=2e-4), 4, 4)
@FAMILY.case("the same, 16 of degree 1", "strains are wrong by as much as they are", Number((OPENS, CLOSES), rel=3e-3), 16, 1)
def over_zone_events(elements: int, degree: int) -> tuple[float, float]:
    branch = fm.trace(following(elements, degree), start=0.5, direction=-1, until={"center_height": -0.55}, max_steps=60)
    if branch.status is not fm.Status.CONVERGED:
        raise AssertionError(str(branch.status))
    opens, closes = (point for point in branch.special_points or () if point.zone)
    return opens.pressure, closes.pressure


@FAMILY.case("wrinkles up to the slack circle, following", "the mesh folds before the membrane", Stop(fm.Status.SLACK, "tension vanishes"))
def followed_to_the_slack_circle() -> fm.Branch:
    scene = disc_scene(OGDEN, STRONG, 16, 4).replace(tension_field=True, follow_borders=True)
    return fm.trace(scene, start=2.1, until={"center_height": 0.1}, direction=-1, max_steps=60)


@FAMILY.case("a pillow at P = 1e-6, following", "the taut zone at its pole closes: a Mylar balloon", Number((0.7627600232, 1.0), rel=1e-9))
def wholly_wrinkled() -> tuple[float, float]:
    """The radius of the rim, 3e-7 above that of the balloon, and the part that is wrinkled, to 1e-2 of it."""
    scene = pillow(12, 5).replace(follow_borders=True)
    eq = fm.equilibrium(scene, volume=0.7)
    for pressure in (1e-2, 1e-4, 1e-6):
        eq = fm.equilibrium(scene, pressure=pressure, start=eq)
        if not eq.residual < 1e-5:  # stresses are 1e-6 of the modulus
            raise AssertionError(f"forces are out of balance by {eq.residual:.2g}")
    return float(eq.profile([1.0])["rho"][0]), round(eq.zones("mechanical").fraction("radial"), 2)
