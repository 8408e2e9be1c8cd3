"""Voltage and charge: next to pull-in, on a part of the membrane, and where all tension is lost at once."""

from __future__ import annotations

import numpy as np

import femmembrane as fm

from .registry import Family, Number, Stop, settled

FAMILY = Family(10, "electric")

DISC = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), degree=4)
SPHERE = fm.Scene(material=fm.NeoHookean(), mesh=fm.sphere(8), degree=4)
#: pull-in of a neo-Hookean sphere at P = 0: l = 4^(1/6)
PULL_IN = np.sqrt(0.75 * 4 ** (-1 / 3))
NEAR_LIMIT = "two states merge there"
NEAR = "the limit point lies at P -> 0, where all stress vanishes"


def under(scene: fm.Scene, **electric: float) -> fm.Scene:
    return scene.replace(electric=fm.Electric(**electric))


def ball(stretch: float) -> float:
    return 4 * np.pi / 3 * stretch**3


def largest_square(pressure: float) -> float:
    """Largest phi^2 of a sphere at a pressure: that of phi^2 = (2/l - 2/l^7 - P)/(2 l)."""
    stretch = np.linspace(1.0, 2.0, 200001)
    return float(((2 / stretch - 2 / stretch**7 - pressure) / (2 * stretch)).max())


@FAMILY.case("disc, voltage 1e-12", "phi^2 = 1e-24 beside strains of order one", Number(1.06687357, rel=1e-6))
def tiny_voltage() -> float:
    return settled(fm.equilibrium(under(DISC, voltage=1e-12), volume=1.0)).pressure


@FAMILY.case("charge 1e-12", "nothing may be divided by the voltage", Number((1.06687357, 1.0), rel=1e-6))
def tiny_charge() -> tuple[float, float]:
    eq = settled(fm.equilibrium(under(DISC, total_charge=1e-12), volume=1.0))
    return eq.pressure, eq.voltage * eq.capacitance / 1e-12


@FAMILY.case("sphere just below pull-in, P > 0", NEAR, Number(0.02, rel=1e-6), 0.97)
@FAMILY.case("sphere just above pull-in", NEAR, Stop(fm.Status.NOT_CONVERGED, "no equilibrium was found"), 1.05)
def at_pull_in(share: float) -> float:
    return settled(fm.equilibrium(under(SPHERE, voltage=share * PULL_IN), pressure=0.02)).pressure


@FAMILY.case("a ten-thousandth below the largest voltage", NEAR_LIMIT, Number(1.0, rel=1e-6), 1 - 1e-4)
@FAMILY.case("a ten-thousandth above the largest voltage", NEAR_LIMIT, Stop(fm.Status.NOT_CONVERGED, "no equilibrium was found"), 1 + 1e-4)
def next_to_the_limit(share: float) -> float:
    phi = share * np.sqrt(largest_square(0.5))
    eq = settled(fm.equilibrium(under(SPHERE, voltage=phi), pressure=0.5))
    stretch = np.cbrt(eq.volume * 3 / (4 * np.pi))
    return (2 / stretch - 2 / stretch**7 - 0.5) / (2 * stretch) / phi**2


@FAMILY.case(
    "tension field, no slack state any more",
    "beyond phi^2 = 0.4725 a slack film has no width",
    Stop(fm.Status.NO_EQUILIBRIUM, "voltage could not be turned on"),
)
def slack_beyond_pull_in() -> fm.Equilibrium:
    return fm.equilibrium(under(DISC.replace(tension_field=True), voltage=0.75), volume=0.1)


@FAMILY.case("sphere, charge through the limit of the voltage", "the voltage turns, the charge does not", Number((1.0, 1.0, 1.0), rel=1e-6))
def charged() -> tuple[float, ...]:
    found = []
    for q in (1.0, np.sqrt(3.0), 2.5):
        stretch = 1.01 * (1 + q * q) ** (1 / 6)
        eq = fm.equilibrium(under(SPHERE, total_charge=4 * np.pi * q), volume=ball(stretch), solver="newton")
        found.append(eq.voltage / (q / stretch**4))
    return tuple(found)


@FAMILY.case("pull-in in a patch", "a ring of electrode thins, the rest does not", Number((1.573874, 1.216440), rel=1e-5))
def patch() -> tuple[float, float]:
    scene = under(DISC.replace(degree=6, mesh=fm.disc(24)), voltage=0.4, start=0.2, stop=0.53)
    branch = fm.trace(scene, start=1.2, until={"volume": 1.8})
    limit = next(point for point in branch.special_points if point.kind == "limit_point")
    return limit.volume, limit.pressure


@FAMILY.case("stretched disc beyond the loss of tension", "compressed everywhere at once", Stop(fm.Status.LEGENDRE_FAILURE, "compressive"))
def lost() -> fm.Equilibrium:
    return fm.equilibrium(under(DISC.replace(prestretch=2.0), voltage=0.5), volume=0.0)


@FAMILY.case("disc without stretch, any voltage, V = 0", "every voltage compresses it", Stop(fm.Status.LEGENDRE_FAILURE, "compressive"))
def compressed_at_rest() -> fm.Equilibrium:
    return fm.equilibrium(under(DISC, voltage=1e-3), volume=0.0)


@FAMILY.case("Ogden's rubber, tension and no stiffness", "in-plane moduli go before the tension", Stop(fm.Status.PULLED_IN, "no stiffness"))
def pulled() -> fm.Branch:
    scene = under(DISC.replace(material=fm.Ogden.treloar(), mesh=fm.disc(12)), voltage=np.sqrt(0.1))
    return fm.trace(scene, start=1.5, until={"volume": 40.0}, max_steps=80)
