"""Very large loads, exponents, meshes and element ratios, and very small ones."""

from __future__ import annotations

import numpy as np

import femmembrane as fm
from femmembrane.accuracy.shooting import shoot
from femmembrane.accuracy.strong_form import Guess

from ..cases import OGDEN, disc_scene
from .registry import Exit, Family, Number, Stop, reached, run_file, settled

FAMILY = Family(5, "size")

NH = fm.NeoHookean()
#: P at V = 1 of the Ogden disc: 8 elements of degree 8 and 64 quadratic ones agree (recorded on 2026-11-24)
AT_ONE = 1.10444404


@FAMILY.case("V = 1e5, Ogden", "stretches of 40 with exponent 5", Number(163.04, rel=1e-4), OGDEN, 1e5)
def far_out(material: object, volume: float) -> float:
    """Recorded on 2026-11-24; 64 quadratic elements."""
    return settled(fm.equilibrium(disc_scene(material), volume=volume)).pressure


@FAMILY.case("V = 1e5, neo-Hookean", "the pole thins to 1e-4 of T", Number(1.0, rel=2e-3), 1e5, 64, 2)
@FAMILY.case("V = 1e12, neo-Hookean", "and to 1e-9", Number(1.0, rel=1e-2), 1e12, 64, 4)
def thin_pole(volume: float, elements: int, degree: int) -> float:
    """P over the P of a mesh graded for it, as far as degree 8 resolves it."""
    eq = settled(fm.equilibrium(disc_scene(NH, elements=elements, degree=degree), volume=volume))
    graded = fm.Scene(material=NH, mesh=fm.disc(elements=32, ratio=1e-3), degree=8)
    return eq.pressure / settled(fm.equilibrium(graded, volume=volume)).pressure


STEEP = "lambda^20 and its Hessian over 30 orders"


@FAMILY.case("exponent 20, V = 1e4", STEEP, Number(1.0, rel=1e-4), 20.0, 1e4)
@FAMILY.case("exponent -20, V = 1", STEEP, Number(1.0, rel=1e-4), -20.0, 1.0)
@FAMILY.case("exponent -20, V = 1e4", STEEP, Number(1.0, rel=5e-2), -20.0, 1e4)
@FAMILY.case("exponent 20, V = 1e-6", "the cubic law knows no exponent", Number(1.0, rel=1e-9), 20.0, 1e-6)
def steep(exponent: float, volume: float) -> float:
    """P on 32 elements of degree 4 over that on 64 of degree 6."""
    material = fm.Ogden(mu=(2 / exponent,), alpha=(exponent,))
    coarse, fine = (settled(fm.equilibrium(disc_scene(material, elements=n, degree=p), volume=volume)) for n, p in ((32, 4), (64, 6)))
    return coarse.pressure / fine.pressure


LOCKING = "the pole at {} of J_m, where the energy has no bound"


@FAMILY.case("Gent, J_m = 2, V = 2.45", LOCKING.format("97 %"), Number((1.0, 1.0), rel=1e-9), 2.0, 0.96, {"volume": 2.45})
@FAMILY.case("Gent, J_m = 10, V = 8", LOCKING.format("97 %"), Number((1.0, 1.0), rel=1e-9), 10.0, 0.96, {"volume": 8.0})
@FAMILY.case("Gent, J_m = 30, V = 25", LOCKING.format("95 %"), Number((1.0, 1.0), rel=1e-9), 30.0, 0.85, {"volume": 25.0})
@FAMILY.case("Gent, J_m = 2, P = 100", LOCKING.format("99 %"), Number((1.0, 1.0), rel=1e-9), 2.0, 0.98, {"pressure": 100.0})
@FAMILY.case("Gent, J_m = 30, P = 100", LOCKING.format("99 %"), Number((1.0, 1.0), rel=1e-9), 30.0, 0.98, {"pressure": 100.0})
def locking(jm: float, share: float, load: dict[str, float]) -> tuple[float, float]:
    """P and V over the values by shooting; somewhere I_1 - 3 is above this share of J_m."""
    scene = disc_scene(fm.Gent(jm), elements=16, degree=6)
    eq = settled(fm.equilibrium(scene, **load))
    found = shoot(scene, guess=Guess.of(eq), **load)
    profile = eq.profile()
    stretched = 2 * NH.energy(np.log(profile["stretch_1"]), np.log(profile["stretch_2"])).max()
    if not (found.converged and stretched > share * jm):
        raise AssertionError(f"shooting: {found.message!r}; {stretched / jm:.3g} of J_m")
    return eq.pressure / found.pressure, eq.volume / found.volume


BEYOND = "no membrane is that large"


@FAMILY.case("Gent, J_m = 2, V = 3", BEYOND, Stop(fm.Status.STEP_UNDERFLOW, r"beyond 2\.5"), 2.0, 3.0)
@FAMILY.case("Gent, J_m = 5, V = 1000", BEYOND, Stop(fm.Status.STEP_UNDERFLOW, r"beyond 4\.6"), 5.0, 1e3)
@FAMILY.case("Gent, J_m = 30, V = 10000", BEYOND, Stop(fm.Status.STEP_UNDERFLOW, r"beyond 26\.7"), 30.0, 1e4)
def beyond_locking(jm: float, volume: float) -> fm.Equilibrium:
    """The message says how far it came: as far as the chains reach."""
    return settled(fm.equilibrium(disc_scene(fm.Gent(jm), elements=16, degree=6), volume=volume))


HUGE = "would overflow on the way"


@FAMILY.case("V = 1e300", HUGE, Stop("volume"), {"volume": 1e300})
@FAMILY.case("P = 1e300", HUGE, Stop("pressure"), {"pressure": 1e300})
@FAMILY.case("pole at 1e300", HUGE, Stop("center_height"), {"center_height": 1e300})
@FAMILY.case("V = infinity", "no number at all", Stop("volume"), {"volume": float("inf")})
@FAMILY.case("P = NaN", "no number at all", Stop("pressure"), {"pressure": float("nan")})
def huge(load: dict[str, float]) -> fm.Equilibrium:
    return settled(fm.equilibrium(disc_scene(OGDEN, elements=16), **load))


@FAMILY.case("one linear element", "one unknown", Number(2.00867893, rel=1e-8), 1, 1)
@FAMILY.case("one quadratic element", "three unknowns", Number(1.12033709, rel=1e-8), 1, 2)
@FAMILY.case("one element of degree 8", "an element is a spectral method", Number(AT_ONE, rel=1e-8), 1, 8)
@FAMILY.case("two linear elements", "a cone on a cone", Number(1.22158793, rel=1e-8), 2, 1)
@FAMILY.case("100 elements of degree 8", "conditioned like 3e8", Number(AT_ONE, rel=5e-9), 100, 8)
def few_elements(elements: int, degree: int) -> float:
    """P at V = 1. Of a cone by hand: stretches sqrt(1 + H^2) and 1, V = pi H/3, P = dW/dV; the others recorded on 2026-11-24."""
    return settled(fm.equilibrium(disc_scene(OGDEN, elements=elements, degree=degree), volume=1.0)).pressure


@FAMILY.case("one linear element, by the corrector and traced", "the volume alone fixes the shape, not P", Number((0.0, 0.0), abs=1e-13))
def cone() -> tuple[float, ...]:
    """P over the P of a cone by hand, 3 H (1 - (1 + H^2)^-2) at V = pi H/3, less one."""
    scene = disc_scene(NH, elements=1, degree=1)
    found = [fm.equilibrium(scene, volume=1.0, solver="newton"), reached(fm.trace(scene, start=0.5, until={"volume": 2.0}))[-1]]
    heights = [3 * eq.volume / np.pi for eq in found]
    return tuple(settled(eq).pressure / (3 * h * (1 - (1 + h * h) ** -2)) - 1 for eq, h in zip(found, heights, strict=True))


@FAMILY.case("one linear element, two waves around the axis", "no unknown has any", Stop("mesh.elements", "two, or degree 2"), 1)
def no_waves(elements: int) -> object:
    return fm.equilibrium(disc_scene(OGDEN, elements=elements, degree=1), volume=1.0).verdict(azimuthal=2)


RATIO = "sizes and stiffnesses differ by {} orders"


@FAMILY.case("size ratio 1e6, degree 2", RATIO.format(6), Number(AT_ONE, rel=1e-3), 1e6, 2)
@FAMILY.case("size ratio 1e6, degree 8", RATIO.format(6), Number(AT_ONE, rel=5e-9), 1e6, 8)
@FAMILY.case("size ratio 1e-6, degree 2", RATIO.format(6), Number(AT_ONE, rel=1e-4), 1e-6, 2)
@FAMILY.case("size ratio 1e-6, degree 8", RATIO.format(6), Number(AT_ONE, rel=5e-9), 1e-6, 8)
def graded(ratio: float, degree: int) -> float:
    scene = fm.Scene(material=OGDEN, mesh=fm.disc(elements=32, ratio=ratio), degree=degree)
    eq = settled(fm.equilibrium(scene, volume=1.0))
    if any(eq.verdict(c).stable is not True for c in ("pressure", "volume")) or eq.verdict(azimuthal=1).stable is not True:
        raise AssertionError("not stable")
    return eq.pressure


@FAMILY.case("degree 8, drawn-out pole", "curvature of the pole at height 5.2 by M = 200", Number(1.0, rel=1e-3), 4)
@FAMILY.case("degree 8, drawn-out pole, 16 elements", "the same", Number(1.0, rel=1e-5), 16)
def drawn_out(elements: int) -> float:
    eq, fine = (settled(fm.equilibrium(disc_scene(OGDEN, (200.0, 6.5), n, 8), center_height=5.2)) for n in (elements, 64))
    return eq.pressure / fine.pressure


MANY = "round-off grows with the elements"


@FAMILY.case("5000 elements", MANY, Number(1.0, rel=1e-11), 5_000)
@FAMILY.case("1000000 elements", MANY, Number(1.0, rel=1e-9), 1_000_000, slow=True)
def many_elements(elements: int) -> float:
    """P over the P of 32 elements of degree 8, at V = 30 under a dipole."""
    eq, fine = (
        settled(fm.equilibrium(disc_scene(OGDEN, (200.0, 6.5), n, p), volume=30.0, solver="newton")) for n, p in ((elements, 2), (32, 8))
    )
    return eq.pressure / fine.pressure


SCENE = """
[material]
model = "neo-hookean"
[mesh]
elements = {}
degree = {}
[run]
values = [1.0]
"""


@FAMILY.case("command, one linear element", "pictures of three points", Exit(0), 1, 1)
@FAMILY.case("command, degree 9", "is not offered", Exit(2, "degree"), 4, 9)
@FAMILY.case("command, no elements", "is no mesh", Exit(2, "elements"), 0, 2)
def command(elements: int, degree: int) -> object:
    return run_file(SCENE.format(elements, degree))
