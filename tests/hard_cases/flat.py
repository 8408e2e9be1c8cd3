"""Flat and nearly flat membranes: no stiffness across the plane, displacements of very different sizes."""

from __future__ import annotations

import femmembrane as fm

from ..cases import OGDEN, disc_scene
from .registry import Exit, Family, Number, Stop, reached, run_file, settled

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


NH = disc_scene(fm.NeoHookean(), elements=32)
WHY_CUBIC = "u is V of w; energies go with V^4"


@FAMILY.case("V = 1e-30", WHY_CUBIC, Number(CUBIC, rel=1e-6), 1e-30)
@FAMILY.case("V = 1e-12", WHY_CUBIC, Number(CUBIC, rel=1e-6), 1e-12)
@FAMILY.case("V = 1e-9", WHY_CUBIC, Number(CUBIC, rel=1e-6), 1e-9)
@FAMILY.case("V = -1e-9", WHY_CUBIC, Number(CUBIC, rel=1e-6), -1e-9)
@FAMILY.case("V = 1e-6", WHY_CUBIC, Number(CUBIC, rel=1e-6), 1e-6)
@FAMILY.case("V = 1e-3", "the cubic law within 2e-6 only", Number(CUBIC, rel=3e-6), 1e-3)
def cubic_law(volume: float) -> float:
    """P/V^3 = 3.336717 of the neo-Hookean disc, from a cold start."""
    eq = settled(fm.equilibrium(disc_scene(fm.NeoHookean(), elements=64, degree=4), volume=volume))
    return eq.pressure / eq.volume**3


@FAMILY.case("P = 1e-27", "V = 6.7e-10: the slope dV/dP is 2e17", Number(CUBIC, rel=1e-6), 1e-27)
@FAMILY.case("P = -1e-12", "V = -6.7e-5, the dome below", Number(CUBIC, rel=1e-6), -1e-12)
def cubic_law_by_pressure(pressure: float) -> float:
    eq = settled(fm.equilibrium(disc_scene(fm.NeoHookean(), elements=64, degree=4), pressure=pressure))
    return eq.pressure / eq.volume**3


@FAMILY.case("gas, amount 1e-9", "nearly no gas: P = amount/(1 + V), V = 6.7e-4", Number((1e-9, CUBIC), rel=3e-6), 1e-9)
def little_gas(amount: float) -> tuple[float, float]:
    eq = settled(fm.equilibrium(disc_scene(fm.NeoHookean(), elements=64), gas=fm.Gas(amount=amount, chamber=1.0)))
    return eq.pressure * (1 + eq.volume), eq.pressure / eq.volume**3


@FAMILY.case("gas at the pressure of the atmosphere", "the state is the flat one exactly", Number((0.0, 0.0)))
def gas_at_rest() -> tuple[float, float]:
    eq = settled(fm.equilibrium(NH, gas=fm.Gas(amount=1.0, chamber=1.0, atmosphere=1.0)))
    return eq.pressure, eq.volume


@FAMILY.case("zero load, no source", "the Hessian is singular", Number((0.0, 0.0, 0.0)))
def flat_at_rest() -> tuple[float, ...]:
    eq = settled(fm.equilibrium(NH, volume=0.0))
    return eq.pressure, eq.center_height, eq.energy


@FAMILY.case("zero load, zero susceptibility", "a source without effect", Number((0.0, 0.0)), {"susceptibility": 0.0})
@FAMILY.case(
    "zero load, two dipoles that cancel",
    "sources without a field",
    Number((0.0, 0.0)),
    {"sources": [fm.Dipole(200, 4), fm.Dipole(200, 4, orientation=-1)]},
)
def flat_with_sources(change: dict[str, object]) -> tuple[float, float]:
    eq = settled(fm.equilibrium(disc_scene(OGDEN, (200.0, 4.0), elements=16).replace(**change), pressure=0.0))
    return eq.volume, eq.energy


@FAMILY.case("zero load, verdicts", "neither stable nor unstable", Number((0.0, 0.0, 0.0), abs=1e-30))
def flat_verdicts() -> tuple[float, ...]:
    eq = fm.equilibrium(NH, volume=0.0)
    verdicts = eq.verdict("pressure"), eq.verdict("volume"), eq.verdict(azimuthal=50)
    if [v.stable for v in verdicts] != [None] * 3:
        raise AssertionError("not marginal")
    return tuple(v.smallest_eigenvalue for v in verdicts)


@FAMILY.case("all equilibria at V = 0", "mirror images and starts all lead to the flat state", Number((1, 0.0)))
def all_at_zero() -> tuple[float, float]:
    found = fm.equilibria(disc_scene(OGDEN, elements=16), volume=0.0)
    return len(found), settled(found[0]).pressure


@FAMILY.case("tension field, V = 1e-9", "stresses are 1e-18 of the modulus", Number(CUBIC, rel=1e-4))
def flat_tension_field() -> float:
    eq = settled(fm.equilibrium(disc_scene(OGDEN, elements=16).replace(tension_field=True), volume=1e-9))
    return eq.pressure / eq.volume**3


@FAMILY.case("accuracy 1e-6 at V = 1e-6", "errors relative to energies of 1e-25", Number(CUBIC, rel=1e-6))
def flat_accuracy() -> float:
    eq = settled(fm.equilibrium(fm.Scene(material=OGDEN, mesh=fm.disc(accuracy=1e-6)), volume=1e-6))
    return eq.pressure / eq.volume**3


MIRRORED = "passes the state without stiffness"


@FAMILY.case("P: 1, -1", MIRRORED + ", where dV/dP is infinite", Number((1.0, 1.0), rel=1e-9), "pressure", (1.0, -1.0))
@FAMILY.case("P: 1, 1e-9, -1", MIRRORED + " from next to it", Number((1.0, 1.0), rel=1e-9), "pressure", (1.0, 1e-9, -1.0))
@FAMILY.case("P: 1, 0, 0, -1", "starts there as well", Number((1.0, 1.0), rel=1e-9), "pressure", (1.0, 0.0, 0.0, -1.0))
@FAMILY.case("V: 1, -1", MIRRORED, Number((1.0, 1.0), rel=1e-9), "volume", (1.0, -1.0))
@FAMILY.case("V: 1, 1e-9, -1", MIRRORED + " from next to it", Number((1.0, 1.0), rel=1e-9), "volume", (1.0, 1e-9, -1.0))
@FAMILY.case("heights: 1, -1", MIRRORED, Number((1.0, 1.0), rel=1e-9), "height", (1.0, -1.0))
def to_the_mirror_image(control: str, values: tuple[float, ...]) -> tuple[float, float]:
    """V and P of the last state over V and P of the first, signs reversed."""
    run = reached(fm.run(NH.replace(run=fm.Run(control=control, values=values))))
    return -run[-1].volume / run[0].volume, -run[-1].pressure / run[0].pressure


@FAMILY.case("trace from V = 0.5 to -0.5", MIRRORED + " by arc length", Number((-0.5, 0), abs=1e-12), {"volume": -0.5})
@FAMILY.case("trace from V = 0.5 until P = 0", "ends on it", Number((0.0, 0)), {"pressure": 0.0})
@FAMILY.case("trace from V = 0.5 until the pole is at 0", "ends on it", Number((0.0, 0)), {"center_height": 0.0})
def traced_down(until: dict[str, float]) -> tuple[float, int]:
    branch = reached(fm.trace(NH, start=0.5, until=until, direction=-1))
    return branch[-1].volume, len(branch.special_points)


@FAMILY.case("trace from V = 0", "no path leaves a state without stiffness", Stop("start", "small volume"))
def trace_from_flat() -> fm.Branch:
    return fm.trace(NH, start=0.0)


@FAMILY.case("trace from the flat equilibrium", "the same, found before", Stop(fm.Status.STEP_UNDERFLOW, "from V = 0, P = -?0"))
def trace_from_flat_equilibrium() -> fm.Branch:
    return fm.trace(NH, start=fm.equilibrium(NH, volume=0.0))


@FAMILY.case("command, V = -1, 0, 1", "a load of a list is the flat membrane", Exit(0), "values = [-1.0, 0.0, 1.0]")
@FAMILY.case("command, P = 1, -1", MIRRORED, Exit(0), 'control = "pressure"\nvalues = [1.0, -1.0]')
def command_through_zero(run: str) -> object:
    return run_file(SCENE + run + "\n")


@FAMILY.case("P = 0, M = 1e-12 above", "the dipole alone bulges the disc by 2.6e-6", Number(0.0, abs=1e-4), 1e-12, 6.5)
@FAMILY.case("P = 0, M = 1e-6 below", "and by -1e-3", Number(0.0, abs=2e-3), 1e-6, -3.5)
def weak_pull(strength: float, height: float) -> float:
    """The pull scales as M, so that V scales as M^(1/3): V(M)/V(8 M) - 1/2."""
    one, eight = (settled(fm.equilibrium(disc_scene(OGDEN, (m, height)), pressure=0.0)) for m in (strength, 8 * strength))
    if one.volume * height < 0 or one.verdict("pressure").stable is not True:
        raise AssertionError("not the bulge towards the dipole")
    return one.volume / eight.volume - 0.5


@FAMILY.case("P = 0, M = 200 at h = 4 and -4", "the dipole alone bulges the disc", Number(0.0, abs=1e-9))
def pull_from_either_side() -> float:
    above, below = (settled(fm.equilibrium(disc_scene(OGDEN, (200.0, h)), pressure=0.0)) for h in (4.0, -4.0))
    return above.volume + below.volume if above.volume > 0.5 else float("nan")


STRETCHED = "flat under tension is a state as any other"


def drum(prestretch: float) -> fm.Scene:
    return NH.replace(prestretch=prestretch)


@FAMILY.case("pre-stretch 1 + 1e-9, P = 0", "a tension of 6e-9, and no stiffness beside it", Number(1.0, rel=1e-6), 1 + 1e-9)
@FAMILY.case("pre-stretch 1.5, P = 0", STRETCHED, Number(1.0, rel=1e-6), 1.5)
@FAMILY.case("pre-stretch 1000, P = 0", "a rim of 1000 R0", Number(1.0, rel=1e-6), 1e3)
def rings(prestretch: float) -> float:
    """Squared frequency over its closed form j^2 (1 - p^-6)."""
    tension = 6e-9 if prestretch < 1 + 1e-6 else 1 - prestretch**-6
    eq = settled(fm.equilibrium(drum(prestretch), pressure=0.0))
    return eq.frequencies(count=1)[0].eigenvalue / (2.404825557695773**2 * tension)


@FAMILY.case("pre-stretch 1 + 1e-9, V = 0.001", "the tension adds 8 T V/pi = 1.5e-11 to P", Number(1.0, rel=1e-2), 1e-3)
@FAMILY.case("pre-stretch 1 + 1e-9, V = -1", "nothing of the pre-stretch is left", Number(1.0, rel=1e-7), -1.0)
def hardly_stretched(volume: float) -> float:
    """P over that of the disc without pre-stretch."""
    both = [settled(fm.equilibrium(scene, volume=volume)).pressure for scene in (drum(1 + 1e-9), NH)]
    return both[0] / both[1]


@FAMILY.case("pre-stretch 1000, limit point", "V = 2e9, P = 2e-3: a half sphere of a soap film", Number((2.0, 2.0944), rel=1e-4))
def far_stretched() -> tuple[float, float]:
    (peak,) = fm.trace(drum(1e3), until={"volume": 5e9}).special_points
    return peak.pressure * 1e3, peak.volume / 1e9


@FAMILY.case("pre-stretch 1 + 1e-9, V: 1, 0, -1", STRETCHED, Number((0.0, 1.0), abs=1e-9), 1 + 1e-9)
@FAMILY.case("pre-stretch 1000, V: 1e9, 0, -1e9", STRETCHED, Number((0.0, 1.0), abs=1e-9), 1e3)
def through_tension(prestretch: float) -> tuple[float, float]:
    """V in the middle, and P of the last state over P of the first, sign reversed."""
    far = prestretch**3
    run = reached(fm.inflate(drum(prestretch), volumes=[far, 0.0, -far]))
    return run[1].volume / far, -run[2].pressure / run[0].pressure


@FAMILY.case("pre-stretch 0.8, V = 0", "flat it is compressed", Stop(fm.Status.LEGENDRE_FAILURE, "stress is compressive"))
def pushed_together() -> fm.Equilibrium:
    return fm.equilibrium(drum(0.8), volume=0.0, solver="ipopt")


@FAMILY.case("pre-stretch 0.8, a trace to V = 2", "domes are taut from V = 0.3 on", Number(2.0, rel=1e-9))
def domes_of_a_loose_disc() -> float:
    return reached(fm.trace(drum(0.8), until={"volume": 2.0}))[-1].volume
