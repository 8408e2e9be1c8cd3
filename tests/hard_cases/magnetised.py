"""Sheets with a self-field, a saturation or a remanence at the ends of their ranges, and states that are not there."""

from __future__ import annotations

from typing import Any

import numpy as np

import femmembrane as fm

from ..cases import OGDEN, disc_scene
from .registry import Family, Number, Stop, settled

FAMILY = Family(11, "magnetised")

ABOVE = disc_scene(OGDEN, (200.0, 6.5))
#: P at V = 1 without a source: the Ogden disc with 64 quadratic elements (recorded on 2026-11-24)
PLAIN = 1.1044440
NORMAL = {"susceptibility": None, "remanence_direction": "normal"}


@FAMILY.case("chi = 1e-9, self-field", "the self-field is 1e-9 of what is 1e-9", Number(PLAIN, rel=1e-7), {"susceptibility": 1e-9})
@FAMILY.case("saturation 1e-6", "x = 1e6 and more: no overflow", Number(PLAIN, rel=1e-5), {"saturation": 1e-6, "demagnetization": False})
@FAMILY.case(
    "saturation 1e-6, chi 1e6", "the field inside by Newton's method", Number(PLAIN, rel=1e-5), {"saturation": 1e-6, "susceptibility": 1e6}
)
@FAMILY.case(
    "remanence 1e-9 beside M = 1e6", "forces are 1e-6 of others", Number(PLAIN, rel=1e-6), {**NORMAL, "remanence": 1e-9}, 1e6, -3.5
)
def as_if_there_were_no_field(more: dict[str, Any], strength: float = 200.0, height: float = 6.5) -> float:
    scene = ABOVE.replace(**{"demagnetization": True, **more}, sources=[fm.Dipole(strength, height)])
    return settled(fm.equilibrium(scene, volume=1.0)).pressure


@FAMILY.case("saturation 1e6", "x = 1e-6: log(sinh x/x) without cancellation", Number(0.0, abs=1e-11), False)
@FAMILY.case("saturation 1e6, self-field", "and the field inside as by the linear law", Number(0.0, abs=1e-11), True)
def as_a_linear_law(demagnetization: bool) -> float:
    scene = ABOVE.replace(demagnetization=demagnetization)
    one, other = (settled(fm.equilibrium(s, volume=1.0)).pressure for s in (scene, scene.replace(saturation=1e6)))
    return other / one - 1


@FAMILY.case("chi = 1e6 and 1e7, self-field", "no normal field is left inside: chi M alone counts", Number(0.0, abs=1e-5))
def as_chi_grows() -> float:
    pair = [
        settled(fm.equilibrium(ABOVE.replace(susceptibility=chi, sources=[fm.Dipole(500 / chi, 6.5)], demagnetization=True), volume=1.0))
        for chi in (1e6, 1e7)
    ]
    return pair[0].pressure / pair[1].pressure - 1


@FAMILY.case(
    "flat in a normal field, self-field", "the field turns the flat sheet: compressed at rest", Stop(fm.Status.NOT_A_MINIMUM), 1e-9
)
@FAMILY.case("nearly flat in a normal field", "the same", Stop(fm.Status.NOT_A_MINIMUM), 1e-3)
def flat_in_a_normal_field(volume: float) -> fm.Equilibrium:
    scene = ABOVE.replace(sources=[fm.Uniform(0.1)], demagnetization=True)
    return settled(fm.equilibrium(scene, volume=volume))


@FAMILY.case("tube along the field, self-field", "on edge to it: the field pulls nowhere", Number(0.0, abs=1e-12))
def on_edge_to_the_field() -> float:
    tube = fm.Scene(material=OGDEN, mesh=fm.cylinder(2.0, 16), degree=3, susceptibility=2.5, demagnetization=True)
    potential = settled(fm.equilibrium(tube.replace(sources=[fm.Uniform(0.1)]), volume=8.0)).potential
    return float(np.abs(potential.evaluate(np.zeros(potential.space.n_free), 0.0).gradient).max())
