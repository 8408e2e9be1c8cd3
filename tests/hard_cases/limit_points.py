"""Loads next to, at and beyond limit points, folds and cusps."""

from __future__ import annotations

from functools import cache

import numpy as np

import femmembrane as fm

from ..cases import OGDEN, disc_scene
from .registry import Exit, Family, Number, Stop, reached, run_file, settled

FAMILY = Family(2, "limit points")

#: the first limit point of the Ogden disc and the volume fold with M = 200, h = 6.5 (tests/data/disc.json)
LIMIT, VOLUME_FOLD = 1.899084863, 82.74807
SCENE, ABOVE = disc_scene(OGDEN), disc_scene(OGDEN, (200.0, 6.5))


@cache
def special(scene: fm.Scene, kind: str) -> fm.SpecialPoint:
    """The first special point of a kind beyond V = 0.5, of this mesh."""
    branch = fm.trace(scene, start=0.5, until={"center_height": 4.9 if scene is ABOVE else 1.3})
    return next(p for p in branch.special_points if p.kind == kind)


BEFORE = "steps in P cannot come so close: two states are {} of V apart"


def beside(eq: fm.Equilibrium, share: float) -> tuple[float, float]:
    """P recomputed at the volume of a state, which is regular there, over the limit, in units of the share; and the side (-1 before it).

    Recomputed it is good to some 3e-14.
    """
    limit = special(SCENE, "limit_point")
    again = settled(fm.equilibrium(SCENE, volume=eq.volume))
    return (again.pressure / limit.pressure - 1) / share, float(np.sign(settled(eq).volume - limit.volume))


@FAMILY.case("P = limit (1 - 1e-12), steps", BEFORE.format("1e-6"), Number((-1.0, -1.0), rel=1e-1), 1e-12, (1.0,))
@FAMILY.case("P = limit (1 - 1e-8), steps", BEFORE.format("1e-4"), Number((-1.0, -1.0), rel=1e-4), 1e-8, (1.0,))
@FAMILY.case("P = limit (1 - 1e-8), cold", BEFORE.format("1e-4"), Number((-1.0, -1.0), rel=1e-4), 1e-8, ())
@FAMILY.case("P = limit (1 - 1e-6), cold", "a long step passes over both", Number((-1.0, -1.0), rel=1e-6), 1e-6, ())
def just_before(share: float, first: tuple[float, ...]) -> tuple[float, float]:
    run = reached(fm.pressurize(SCENE, pressures=[*first, special(SCENE, "limit_point").pressure * (1 - share)]))
    if run[-1].verdict("pressure").smallest_eigenvalue <= 0:
        raise AssertionError("not the stable one")
    return beside(run[-1], share)


@FAMILY.case("P = limit (1 - 1e-8), from beyond", "the saddle side, by the corrector", Number((-1.0, 1.0), rel=1e-4))
def just_before_from_beyond() -> tuple[float, float]:
    far = fm.equilibrium(SCENE, volume=5.0)
    target = special(SCENE, "limit_point").pressure * (1 - 1e-8)
    return beside(fm.equilibrium(SCENE, pressure=target, start=far, solver="newton"), 1e-8)


@FAMILY.case("trace until P = limit (1 - 1e-8)", "met twice within one step", Number((-1.0, -1.0), rel=1e-4))
def traced_to_just_before() -> tuple[float, float]:
    target = special(SCENE, "limit_point").pressure * (1 - 1e-8)
    return beside(reached(fm.trace(SCENE, start=1.0, until={"pressure": target}))[-1], 1e-8)


@FAMILY.case("all equilibria, P = limit (1 - 1e-8)", "two are 3e-4 of V apart", Number((3, 0)), 1 - 1e-8)
@FAMILY.case("all equilibria, P = limit", "two are one, marginal", Number((2, 1)), 1.0)
@FAMILY.case("all equilibria, P = limit (1 + 1e-8)", "and none", Number((1, 0)), 1 + 1e-8)
def all_there(factor: float) -> tuple[int, int]:
    """How many, and how many of them are marginal."""
    found = fm.equilibria(SCENE, pressure=special(SCENE, "limit_point").pressure * factor)
    return len(found), sum(settled(eq).verdict("pressure").stable is None for eq in found)


@FAMILY.case(
    "P = limit, cold", "the Hessian is singular; the last digit of P leaves V and the eigenvalue to 3e-5", Number((2.411698, 0.0), abs=3e-5)
)
def at_the_limit() -> tuple[float, float]:
    eq = settled(fm.equilibrium(SCENE, pressure=special(SCENE, "limit_point").pressure))
    if eq.verdict("pressure").stable is False:
        raise AssertionError("a saddle")
    return eq.volume, eq.verdict("pressure").smallest_eigenvalue


JUMP = r"limit point is P = 1\.89908.* would jump to V = 74\.54"


@FAMILY.case("P = limit, steps", "neither held nor passed", Stop(fm.Status.NO_EQUILIBRIUM, JUMP), 1.0)
@FAMILY.case("P = limit (1 + 1e-8), steps", "the nearest state is 72 away in V", Stop(fm.Status.NO_EQUILIBRIUM, JUMP), 1 + 1e-8)
def just_beyond(factor: float) -> fm.Branch:
    return fm.pressurize(SCENE, pressures=[1.0, special(SCENE, "limit_point").pressure * factor])


@FAMILY.case("P = limit (1 + 1e-8), jump", "lands there", Number((74.5403, LIMIT), rel=1e-5))
def jump_beyond() -> tuple[float, float]:
    run = fm.pressurize(SCENE, pressures=[1.0, special(SCENE, "limit_point").pressure * (1 + 1e-8)], at_limit="jump")
    return settled(run[-1]).volume, run.jumps[0].limit.pressure


DOWN = r"limit point is P = 1\.49098"


@FAMILY.case("P: 1.7 inflated, 0", "flat is an equilibrium, but not of this branch", Stop(fm.Status.NO_EQUILIBRIUM, DOWN), 0.0)
@FAMILY.case("P: 1.7 inflated, -1", "and its mirror image is not either", Stop(fm.Status.NO_EQUILIBRIUM, DOWN), -1.0)
def down_from_the_inflated_branch(pressure: float) -> fm.Branch:
    return fm.pressurize(SCENE, pressures=[pressure], start=fm.equilibrium(SCENE, volume=54.0))


@FAMILY.case("V = fold (1 - 1e-8), steps", "next to the last volume fold", Number((1.0, 1.0), rel=1e-6), 1 - 1e-8, (80.0,))
@FAMILY.case("V = fold (1 - 1e-8), cold", "turning the dipole on runs along the fold", Number((1.0, 1.0), rel=1e-6), 1 - 1e-8, ())
def before_the_volume_fold(factor: float, first: tuple[float, ...]) -> tuple[float, float]:
    fold = special(ABOVE, "volume_fold")
    eq = settled(reached(fm.inflate(ABOVE, volumes=[*first, fold.volume * factor]))[-1])
    if not (eq.center_height < fold.center_height and eq.verdict("volume").stable):
        raise AssertionError("not the stable one")
    return eq.volume / (fold.volume * factor), fold.volume / VOLUME_FOLD


FOLD = r"volume fold is P = 1\.93089.*V = 82\.748"


@FAMILY.case("V = fold (1 + 1e-8), steps", "no equilibrium anywhere", Stop(fm.Status.NO_EQUILIBRIUM, FOLD), 1e-8, (80.0,))
@FAMILY.case("V = 83, steps", "beyond the last volume fold", Stop(fm.Status.NO_EQUILIBRIUM, FOLD), 83 / VOLUME_FOLD - 1, (82.0,))
@FAMILY.case("V = 83, cold", "the dipole tears it off half-way", Stop(fm.Status.NO_EQUILIBRIUM, FOLD), 83 / VOLUME_FOLD - 1, ())
@FAMILY.case("V: 80, 1e4", "a step of 125 times the volume", Stop(fm.Status.NO_EQUILIBRIUM, FOLD), 1e4 / VOLUME_FOLD - 1, (80.0,))
def beyond_the_volume_fold(share: float, first: tuple[float, ...]) -> fm.Branch:
    return fm.inflate(ABOVE, volumes=[*first, special(ABOVE, "volume_fold").volume * (1 + share)])


@FAMILY.case("all equilibria, V = 83", "there are none", Number(0))
def none_there() -> int:
    return len(fm.equilibria(disc_scene(OGDEN, (200.0, 6.5), 32), volume=83.0))


@FAMILY.case("trace until V = 83", "never reached: runs into the dipole", Stop(fm.Status.DIPOLE_CONTACT))
def never_reached() -> fm.Branch:
    return fm.trace(ABOVE, start=0.5, until={"volume": 83.0}, max_steps=1000)


@FAMILY.case("heights 4.75, 4.85", "control by height through the volume fold", Number((1.0, 0.0)))
def through_the_volume_fold() -> tuple[float, float]:
    """Whether each is stable under volume control."""
    run = reached(fm.run(ABOVE.replace(run=fm.Run(control="height", values=(4.75, 4.85)))))
    return tuple(float(eq.verdict("volume").stable) for eq in run)


@FAMILY.case("error estimates at the volume fold", "V has no derivative by P to err with", Number(1.0, rel=0.3))
def estimate_at_the_fold() -> float:
    """Estimated over true error in V at the pressure of the fold (a mesh of 256 elements of degree 4 is the truth)."""
    eq = special(ABOVE, "volume_fold").equilibrium
    fine = fm.equilibrium(disc_scene(OGDEN, (200.0, 6.5), 128, 4), center_height=eq.center_height)
    exact = fm.equilibrium(fine.scene, pressure=eq.pressure, start=fine, solver="newton")
    return abs(eq.error_estimate("pressure").volume.error / (eq.volume - settled(exact).volume))


@FAMILY.case("error estimates at the limit point", "no finer mesh has a state at this P", Number((1.0, 1.0)))
def estimate_at_the_limit() -> tuple[float, float]:
    """NaN with a reason, not a number."""
    estimate = special(SCENE, "limit_point").equilibrium.error_estimate("pressure")
    return float(np.isnan(estimate.volume.error)), float("no equilibrium near" in str(estimate))


LOW_LIMITS, LOW_FOLDS = ("limit_point", (1.7119, 0.5813), 1), ("volume_fold", (0.2093, 0.3234), -1)


@FAMILY.case("cusp at M = 875.9077", "two limit points at low volume merge (h = -3.5)", Number(875.9077, rel=2e-6), *LOW_LIMITS)
@FAMILY.case("cusp at M = 331.6762", "two volume folds merge (h = -3.5)", Number(331.6762, rel=2e-6), *LOW_FOLDS)
def cusp(kind: str, volumes: tuple[float, float], direction: int) -> float:
    """Recorded on 2026-11-22 with 64 elements; here from both sheets."""
    scene = disc_scene(OGDEN, (600.0, -3.5), 32)
    branch = fm.trace(scene, start=2.1, until={"center_height": 0.05}, direction=-1)
    points = [min((p for p in branch.special_points if p.kind == kind), key=lambda p: abs(p.volume - v)) for v in volumes]
    bounds = (595.0, 1000.0) if direction > 0 else (300.0, 605.0)
    one, other = (
        fm.fold_curve(scene, start=p, parameter="source.0.strength", bounds=bounds, direction=direction).cusps[0].value for p in points
    )
    return one if abs(one / other - 1) < 1e-8 else float("nan")


COMMAND = """
[material]
model = "ogden"
mu = [1.4910, 0.0029, -0.0236]
alpha = [1.3, 5.0, -2.0]
[membrane]
susceptibility = 2.5
[mesh]
elements = 32
[run]
"""
SOURCE = '[[source]]\nkind = "dipole"\nstrength = 200\nheight = 6.5\n'


BEYOND = 'control = "pressure"\nvalues = [1.8, 1.95]\n'
FAR = "values = [82.0, 83.0]\n" + SOURCE
SHORT = 'control = "arc-length"\nstart = 0.5\nuntil = {volume = 5.0}\nmax_steps = 1\n'


@FAMILY.case("command, P = 1.8, 1.95", "beyond the limit point", Exit(3, r"limit point is P = 1\.899.*would jump"), BEYOND)
@FAMILY.case("command, P = 1.8, 1.95, jump", "beyond the limit point", Exit(0), BEYOND + 'at_limit = "jump"\n')
@FAMILY.case("command, V = 82, 83", "beyond the volume fold", Exit(3, r"volume fold is .*V = 82\.7"), FAR)
@FAMILY.case("command, max_steps = 1", "a branch that is cut off", Exit(3, "1 steps were made"), SHORT)
def command(run: str) -> object:
    return run_file(COMMAND + run)


ORDERS = "loads in any order"


@FAMILY.case("V: 75, 0.5, 75, 75, 30", ORDERS, Number(0.0, abs=1e-11))
def any_order() -> float:
    """Largest difference in P, relative, from one load at a time."""
    volumes = [75.0, 0.5, 75.0, 75.0, 30.0]
    run = reached(fm.inflate(ABOVE, volumes=volumes))
    return max(abs(eq.pressure / fm.equilibrium(ABOVE, volume=v).pressure - 1) for eq, v in zip(run, volumes, strict=True))


@FAMILY.case("V: 0.5, 1e4", "one step of 20000 times the volume", Number(1.0, rel=1e-9))
def one_huge_step() -> float:
    run = reached(fm.inflate(SCENE, volumes=[0.5, 1e4]))
    return run[-1].pressure / fm.equilibrium(SCENE, volume=1e4).pressure
