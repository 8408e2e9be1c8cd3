"""Numbers of a scene as loads, where they are at their ends or act on nothing, and what cannot be one."""

from __future__ import annotations

from typing import Any

import numpy as np

import femmembrane as fm

from ..cases import OGDEN, disc_scene
from .registry import Exit, Family, Number, Stop, reached, run_file, settled

FAMILY = Family(12, "loads")

#: a weak magnet above the unloaded disc
MAGNET = disc_scene(OGDEN, (1.0, 2.0), elements=16)
PLAIN = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16))
PLACED = PLAIN.replace(mesh=fm.disc(16, rim={"kind": "clamped", "radius": 1.2}))
UNIFORM = PLAIN.replace(sources=[fm.Uniform(0.1)], susceptibility=1.0)
HEIGHT, STRENGTH, STRETCH, RADIUS = "source.0.height", "source.0.strength", "membrane.prestretch", "mesh.rim.radius"
POLE, VOLUME = {"center_height": 0.3}, {"volume": 0.5}


@FAMILY.case("magnet led to 1e-2 from the pole", "its field is not resolved there", Stop(fm.Status.DIPOLE_CONTACT), POLE, 0.31)
@FAMILY.case("magnet led through the held pole", "no equilibrium leads through a source", Stop(fm.Status.DIPOLE_CONTACT), POLE, -2.0)
@FAMILY.case(
    "magnet led to a disc of held volume", "the disc snaps onto it first", Stop(fm.Status.NO_EQUILIBRIUM, "turns back"), VOLUME, 0.01
)
@FAMILY.case("magnet led through a disc of held volume", "the same", Stop(fm.Status.NO_EQUILIBRIUM, "turns back"), VOLUME, -2.0)
def magnet_led_to(hold: dict[str, float], height: float) -> fm.Branch:
    return fm.vary(MAGNET, HEIGHT, [2.0, height], hold=hold)


@FAMILY.case("trace of a magnet through the held pole", "the same by arc length", Stop(fm.Status.DIPOLE_CONTACT), POLE)
@FAMILY.case("trace of a magnet through a disc of held volume", "past the fold, into the magnet", Stop(fm.Status.DIPOLE_CONTACT), VOLUME)
def magnet_traced_through(hold: dict[str, float]) -> fm.Branch:
    return fm.trace(MAGNET, over=HEIGHT, hold=hold, until={HEIGHT: -2.0})


@FAMILY.case("strength at chi = 0", "the load has no influence", Stop("over", "changes no force"), STRENGTH, [1.0, 2.0])
@FAMILY.case("height at chi = 0", "the load has no influence", Stop("over", "changes no force"), HEIGHT, [2.0, 1.0])
def without_influence(number: str, values: list[float]) -> fm.Branch:
    return fm.vary(MAGNET.replace(susceptibility=0.0), number, values, hold=VOLUME)


@FAMILY.case("strength of a uniform field", "it pulls nowhere", Stop("over", "changes no force"), STRENGTH)
@FAMILY.case("height of a uniform field", "it has none", Stop("over", "unknown"), HEIGHT)
def in_a_uniform_field(number: str) -> fm.Branch:
    return fm.trace(UNIFORM, over=number, hold=VOLUME, until={number: 0.2})


@FAMILY.case("trace from a fold in the number", "the number is stationary at the start", Number((1.0, 1.0)), 1)
@FAMILY.case("trace from a fold, the other way", "and there the other half", Number((1.0, 1.0)), -1)
def trace_from_a_fold(direction: int) -> tuple[float, float]:
    """Both halves lead from the fold to larger heights."""
    fold = _fold()
    top = fold.equilibrium.number(HEIGHT)
    branch = fm.trace(fold.equilibrium.scene, over=HEIGHT, hold=VOLUME, start=fold, until={HEIGHT: top + 0.1}, direction=direction)
    reached(branch)
    return float(branch[-1].number(HEIGHT) == top + 0.1), float((np.diff(branch.column(HEIGHT)) > 0).all())


@FAMILY.case(
    "steps from a fold in the number", "no step in the load leaves it", Stop(fm.Status.STEP_UNDERFLOW, "fm.trace follows it round")
)
def steps_from_a_fold() -> fm.Branch:
    fold = _fold()
    top = fold.equilibrium.number(HEIGHT)
    return fm.vary(fold.equilibrium.scene, HEIGHT, [top, top + 0.1], hold=VOLUME, start=fold.equilibrium)


@FAMILY.case("steps from a fold away from the branch", "nothing lies on that side", Stop(fm.Status.NO_EQUILIBRIUM))
def steps_off_a_fold() -> fm.Branch:
    fold = _fold()
    top = fold.equilibrium.number(HEIGHT)
    return fm.vary(fold.equilibrium.scene, HEIGHT, [top, top - 0.1], hold=VOLUME, start=fold.equilibrium)


def _fold() -> Any:
    branch = fm.trace(MAGNET, over=HEIGHT, hold=VOLUME, until={HEIGHT: 1.0}, max_steps=30)
    return next(p for p in branch.special_points or () if p.kind == "number_fold")


def _flat_law(eq: fm.Equilibrium) -> float:
    """P over that of the stretched flat membrane: N = 1 - p^-6 and V = pi P p^4/(8 N)."""
    p = float(eq.scene.prestretch)
    return float(eq.pressure / (8 * (1 - p**-6) * eq.volume / (np.pi * p**4)))


@FAMILY.case("pre-stretch 1e3, steps at P = 1e-6", "a membrane a thousand times its size", Number(1.0, rel=1e-5), {"pressure": 1e-6})
@FAMILY.case("pre-stretch 1e3, steps at V = 0.5", "a volume of 5e-10 of its radius cubed", Number(1.0, rel=1e-5), VOLUME)
def stretched_a_thousandfold(hold: dict[str, float]) -> float:
    return _flat_law(settled(reached(fm.vary(PLAIN, STRETCH, [1.0, 1e3], hold=hold))[-1]))


@FAMILY.case("pre-stretch 1e3, trace at P = 1e-6", "the same by arc length", Number(1.0, rel=1e-5), {"pressure": 1e-6})
@FAMILY.case("pre-stretch 1e3, trace at V = 0.5", "the same by arc length", Number(1.0, rel=1e-5), VOLUME)
def traced_a_thousandfold(hold: dict[str, float]) -> float:
    return _flat_law(settled(reached(fm.trace(PLAIN, over=STRETCH, hold=hold, until={STRETCH: 1e3}))[-1]))


@FAMILY.case("pre-stretch 1 + 1e-9", "strains of the lift are 1e-9 beside others", Number(0.0, abs=1e-8), VOLUME)
@FAMILY.case("pre-stretch 1 + 1e-9, P = 1e-3", "and of the size of others", Number(0.0, abs=1e-6), {"pressure": 1e-3})
def stretched_by_next_to_nothing(hold: dict[str, float]) -> float:
    before, after = reached(fm.vary(PLAIN, STRETCH, [1.0, 1 + 1e-9], hold=hold))
    return abs(after.center_height / before.center_height - 1)


@FAMILY.case("held quantity that is the load", "nothing would be held", Stop("hold", "load already"), HEIGHT, {HEIGHT: 1.0})
@FAMILY.case("nothing held", "the state is not determined", Stop("hold", "missing"), HEIGHT, None)
@FAMILY.case("two quantities held", "too much", Stop("hold", "one quantity"), HEIGHT, {**VOLUME, "pressure": 1.0})
@FAMILY.case("a load as the number", "other verbs follow it", Stop("over", "no number of the scene"), "volume", {"pressure": 1.0})
@FAMILY.case("a number that is none", "elements are whole", Stop("over", "unknown"), "mesh.elements", VOLUME)
@FAMILY.case("a misspelt number", "the nearest is named", Stop("over", "did you mean 'source.0.height'"), "source.0.hight", VOLUME)
@FAMILY.case("the place of an end that has none", "rim = clamped rests where it is", Stop("over", "unknown"), RADIUS, VOLUME)
@FAMILY.case("gas without a chamber", "no volume for it", Stop("hold", "no chamber"), HEIGHT, {"gas": 1.0})
def cannot_be(number: Any, hold: Any) -> fm.Branch:
    return fm.vary(MAGNET, number, [2.0, 1.0], hold=hold)


@FAMILY.case("pre-stretch without a held end", "nothing stretches it", Stop("membrane.prestretch", "no edge is held"))
def stretched_by_nothing() -> fm.Scene:
    return PLAIN.replace(mesh=fm.annulus(0.3, elements=8, inner="free", outer="free"), prestretch=1.2)


@FAMILY.case("pre-stretch without a held end, as load", "no number of that scene", Stop("over", "no number to vary"))
def stretched_by_nothing_as_load() -> fm.Branch:
    scene = PLAIN.replace(mesh=fm.annulus(0.3, elements=8, inner="free", outer="free"))
    return fm.vary(scene, STRETCH, [1.2], hold={"pressure": 0.0})


@FAMILY.case("radius of the rim led across the axis", "a radius is positive", Stop("mesh.rim.radius", "> 0"), -0.2)
@FAMILY.case("radius of the rim led to the axis", "a radius is positive", Stop("mesh.rim.radius", "> 0"), 0.0)
def radius_led_to(radius: float) -> fm.Branch:
    return fm.vary(PLACED, RADIUS, [1.2, radius], hold={"pressure": 1.0})


@FAMILY.case("trace of the radius across the axis", "wrinkles come long before", Stop(fm.Status.NOT_RESOLVED), -0.2)
def radius_traced_to(radius: float) -> fm.Branch:
    return fm.trace(PLACED, over=RADIUS, hold={"pressure": 1.0}, until={RADIUS: radius})


@FAMILY.case("command, a run that holds its load", "nothing would be held", Exit(2, "load already"))
def command_that_holds_its_load() -> Any:
    run = '[run]\ncontrol = "source.0.height"\nhold = {"source.0.height" = 1.0}\nvalues = [2.0]\n'
    return run_file(
        '[material]\nmodel = "neo-hookean"\n[mesh]\nelements = 8\n[[source]]\nkind = "dipole"\nstrength = 1.0\nheight = 2.0\n' + run
    )
