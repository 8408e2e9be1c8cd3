"""Dipoles next to the membrane, far away, weak, strong, on both sides: the energy has no lower bound at a source."""

from __future__ import annotations

import femmembrane as fm

from ..cases import OGDEN, disc_scene
from .registry import Exit, Family, Number, Stop, reached, run_file, settled

FAMILY = Family(3, "dipole")

TORN = "sources could not be turned on to their full strength"
#: P at V = 1 without a source: the Ogden disc with 64 quadratic elements (recorded on 2026-11-24)
PLAIN = 1.1044440


@FAMILY.case("h = 0", "the source lies on the membrane", Stop("source.height", "lies on the membrane"), 200.0, 0.0)
@FAMILY.case("h = 1e-200", "its field overflows there", Stop("source.height", "lies on the membrane"), 200.0, 1e-200)
@FAMILY.case("M = 200, h = 0.05", "within the dome", Stop(fm.Status.NO_EQUILIBRIUM, TORN), 200.0, 0.05)
@FAMILY.case("M = 200, h = -0.05", "just below the disc", Stop(fm.Status.NO_EQUILIBRIUM, TORN), 200.0, -0.05)
@FAMILY.case("M = 200, h = 0.3", "at the top of the dome", Stop(fm.Status.DIPOLE_CONTACT, TORN), 200.0, 0.3)
@FAMILY.case("M = 1e6, h = -3.5", "nothing can hold the membrane", Stop(fm.Status.NO_EQUILIBRIUM, TORN), 1e6, -3.5)
@FAMILY.case("M = 1e300, h = 6.5", "energies would overflow", Stop("source.strength"), 1e300, 6.5)
def too_near_or_too_strong(strength: float, height: float) -> fm.Equilibrium:
    return settled(fm.equilibrium(disc_scene(OGDEN, (strength, height)), volume=0.5))


@FAMILY.case("M = 1e-12, h = 6.5", "the source is below round-off", Number(PLAIN, rel=1e-7), 1e-12, 6.5)
@FAMILY.case("M = 1e-300, h = -3.5", "and below underflow", Number(PLAIN, rel=1e-7), 1e-300, -3.5)
@FAMILY.case("M = 200, h = 1e6", "forces of 1e-47", Number(PLAIN, rel=1e-7), 200.0, 1e6)
@FAMILY.case("M = 200 twice, opposite, h = 4", "fields cancel, energies do not add", Number(PLAIN, rel=1e-7), 200.0, 4.0, -1)
def as_if_there_were_none(strength: float, height: float, other: int = 0) -> float:
    sources = [fm.Dipole(strength, height)] + ([fm.Dipole(strength, height, orientation=other)] if other else [])
    return settled(fm.equilibrium(disc_scene(OGDEN).replace(sources=sources), volume=1.0)).pressure


@FAMILY.case("two dipoles of 50 at h = 4", "superpose as fields: as one of 200", Number(0.0, abs=1e-12), [(50, 4.0, 1), (50, 4.0, 1)])
@FAMILY.case("one dipole upside down", "a single one does not feel its sign", Number(0.0, abs=1e-12), [(200, 4.0, -1)])
def as_one_dipole(dipoles: list[tuple[float, float, int]]) -> float:
    one = settled(fm.equilibrium(disc_scene(OGDEN, (200.0, 4.0)), volume=1.0))
    scene = one.scene.replace(sources=[fm.Dipole(m, h, orientation=o) for m, h, o in dipoles])
    return settled(fm.equilibrium(scene, volume=1.0)).pressure / one.pressure - 1


@FAMILY.case("dipoles at h = 4 and -4", "pulled both ways: mirror images", Number(0.0, abs=1e-9), 1)
@FAMILY.case("dipoles at h = 4 and -4, opposite", "pulled both ways: mirror images", Number(0.0, abs=1e-9), -1)
def on_both_sides(orientation: int) -> float:
    scene = disc_scene(OGDEN).replace(sources=[fm.Dipole(50, 4), fm.Dipole(50, -4, orientation=orientation)])
    up, down = (settled(fm.equilibrium(scene, volume=v)).pressure for v in (0.7, -0.7))
    return up / down + 1


CLOSE = Stop(fm.Status.DIPOLE_CONTACT, "source")


@FAMILY.case("pole 0.01 below the dipole", "a spike that no such mesh resolves", CLOSE, 6.49)
@FAMILY.case("pole 0.1 below the dipole", "P = -31, -38 on two meshes", CLOSE, 6.4)
@FAMILY.case("pole at the dipole", "infinite energy", CLOSE, 6.5)
@FAMILY.case("pole beyond the dipole", "behind a wall of energy", CLOSE, 7.0)
def pole_next_to_the_dipole(height: float) -> fm.Equilibrium:
    return settled(fm.equilibrium(disc_scene(OGDEN, (200.0, 6.5)), center_height=height))


@FAMILY.case("trace into the dipole", "E falls without bound", CLOSE)
def traced_into_the_dipole() -> fm.Branch:
    return fm.trace(disc_scene(OGDEN, (200.0, 6.5)), start=0.5, max_steps=1000)


@FAMILY.case("trace into a dipole below, 4 linear elements", "a recovered slope overshoots in the spike", Number(1.0), 1, False)
@FAMILY.case("the same, tension field, degree 3", "a radius below zero between the points of an element", Number(1.0), 3, True)
def traced_into_the_dipole_below(degree: int, tension_field: bool) -> float:
    """Whether it ends in contact; all that is known of its states can be asked."""
    scene = disc_scene(fm.NeoHookean(), (200.0, -3.5), 4, degree).replace(tension_field=tension_field)
    branch = fm.trace(scene, start=0.5, direction=-1, throw=False)
    branch.to_xarray()
    return float(branch.status is fm.Status.DIPOLE_CONTACT)


@FAMILY.case("trace down past M = 0.1, h = -0.5", "a weak dipole just below", CLOSE)
def traced_around_a_weak_dipole() -> fm.Branch:
    return fm.trace(disc_scene(OGDEN, (0.1, -0.5)), start=2.0, direction=-1, max_steps=1000)


@FAMILY.case("V = 75, cold", "a dome of V = 75 lies next to the dipole", Number((1.8793842, 4.4708), rel=1e-5), 75.0)
@FAMILY.case("V = 1000, cold", "the dipole is inside", Number((8.1011869, 9.9818), rel=1e-5), 1000.0)
def inflated_past_the_dipole(volume: float) -> tuple[float, float]:
    """Recorded on 2026-11-24 with 64 quadratic elements; the first within 5e-8 of 8 elements of degree 8."""
    eq = settled(fm.equilibrium(disc_scene(OGDEN, (200.0, 6.5)), volume=volume))
    return eq.pressure, eq.center_height


@FAMILY.case("jump at P = 1.95, M = 200", "beyond the limit point lies the dipole alone", Stop(fm.Status.NO_EQUILIBRIUM, "limit point"))
def jump_into_the_dipole() -> fm.Branch:
    return fm.pressurize(disc_scene(OGDEN, (200.0, 6.5), 32), pressures=[1.8, 1.95], at_limit="jump", throw=False)


@FAMILY.case("V: 75, 60, 30 with IPOPT", "a minimiser prefers E = -1e15", Number(0.0, abs=1e-11))
def minimiser_beside_the_dipole() -> float:
    scene, volumes = disc_scene(OGDEN, (200.0, 6.5)), [75.0, 60.0, 30.0]
    runs = [reached(fm.inflate(scene, volumes=volumes, solver=solver)) for solver in ("ipopt", "newton")]
    return max(abs(a.pressure / b.pressure - 1) for a, b in zip(*runs, strict=True))


@FAMILY.case("50 waves around the axis, M = 600", "eigenvalues 200 times the smallest", Number((1.0, 1.0)), 50)
@FAMILY.case("1000 waves around the axis, M = 600", "and 50000 times", Number((1.0, 1.0)), 1000)
def many_waves(n: int) -> tuple[float, float]:
    """Stable, and stiffer than with one wave fewer."""
    eq = fm.equilibrium(disc_scene(OGDEN, (600.0, -3.5)), center_height=0.5)
    fewer, verdict = (settled(eq).verdict(azimuthal=k) for k in (n - 1, n))
    return float(verdict.stable is True), float(verdict.smallest_eigenvalue > fewer.smallest_eigenvalue)


COMMAND = """
[material]
model = "neo-hookean"
[membrane]
susceptibility = 2.5
[[source]]
kind = "dipole"
strength = 200
"""


@FAMILY.case("command, h = 0", "the source lies on the membrane", Exit(2, "source.height"), "height = 0.0", "values = [1.0]")
@FAMILY.case("command, h = 0.3", "the source lies in the dome", Exit(3, TORN), "height = 0.3", "values = [0.5]")
def command(height: str, run: str) -> object:
    return run_file(f"{COMMAND}{height}\n[run]\n{run}\n")
