"""Compression and slackness: where the plain membrane is ill-posed and a tension field has nothing to hold."""

from __future__ import annotations

import numpy as np

import femmembrane as fm

from ..cases import OGDEN, disc_scene
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
