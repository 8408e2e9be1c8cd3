"""What must hold whatever the mesh: symmetries, identities and limits (theory: energy E, volume V, pressure P = dE/dV on a branch)."""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm

from ..cases import OGDEN, SOLVERS, disc_scene

ABOVE, BELOW = (200.0, 6.5), (600.0, -3.5)


def slopes(scene: fm.Scene, center: float, step: float, **load) -> float:
    """Central difference quotient of the energy over the volume minus the pressure between."""
    low, mid, high = fm.inflate(scene, volumes=[center - step, center, center + step], solver="newton", **load)
    return (high.energy - low.energy) / (high.volume - low.volume) - mid.pressure


@pytest.mark.parametrize("dipole", [None, ABOVE, BELOW])
def test_pressure_is_the_slope_of_energy(dipole):
    """The error of a central quotient is P'' h^2/6: order 2, to be seen on steps well above round-off."""
    scene = disc_scene(dipole=dipole, elements=16)
    errors = np.array([slopes(scene, 2.0, h) for h in (0.4, 0.2, 0.1)])
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(2, abs=0.15)
    # Richardson's extrapolation of the last two removes it
    assert abs(4 * errors[2] - errors[1]) / 3 < 1e-4


def test_pressure_is_the_slope_of_energy_along_a_run():
    run = fm.inflate(disc_scene(dipole=ABOVE, elements=32), volumes=np.linspace(0.5, 75, 150))
    V, E, P = run.column("volume"), run.column("elastic_energy") + run.column("magnetic_energy"), run.column("pressure")
    # trapezoidal rule against the gain of energy: h^2/12 (P'(75) - P'(0.5)) is 0.04 here (P' = 2.4 at V = 0.5), of 124
    work = np.sum((P[1:] + P[:-1]) / 2 * np.diff(V))
    correction = (V[1] - V[0]) ** 2 / 12 * (_slope(V, P, 0) - _slope(V, P, -1))
    assert work + correction == pytest.approx(E[-1] - E[0], abs=0.02)


def _slope(V, P, end):
    i = [0, 1, 2] if end == 0 else [-1, -2, -3]
    return np.polyval(np.polyder(np.polyfit(V[i], P[i], 2)), V[end])


@pytest.mark.parametrize("solver", SOLVERS)
def test_mirror_image_without_a_source(solver):
    scene = disc_scene(elements=16)
    for volume in (0.3, 5.0):
        up, down = (fm.equilibrium(scene, volume=v, solver=solver) for v in (volume, -volume))
        assert_mirrored(up, down, 1e-13)
        assert down.verdict("pressure").smallest_eigenvalue == pytest.approx(up.verdict("pressure").smallest_eigenvalue, rel=1e-9)


@pytest.mark.parametrize("pressure", [0.9, 1.7])
def test_mirror_image_under_pressure_control(pressure):
    scene = disc_scene(elements=16)
    up, down = (fm.equilibrium(scene, pressure=p) for p in (pressure, -pressure))
    assert_mirrored(up, down, 1e-12)


@pytest.mark.parametrize(("dipole", "volume"), [(BELOW, 1.0), (BELOW, 0.3), ((400.0, -3.75), -0.25), (ABOVE, 20.0)])
@pytest.mark.parametrize("solver", SOLVERS)
def test_mirrored_source_mirrors_everything(solver, dipole, volume):
    """A source below and a volume against the same source above and the opposite volume, each from cold."""
    strength, height = dipole
    here = fm.equilibrium(disc_scene(dipole=dipole, elements=16), volume=volume, solver=solver)
    there = fm.equilibrium(disc_scene(dipole=(strength, -height), elements=16), volume=-volume, solver=solver)
    # small volumes may be reached along another path, hence to the solver's tolerance
    assert_mirrored(here, there, 1e-9)


@pytest.mark.parametrize(("dipole", "pressure"), [(BELOW, 1.9), (ABOVE, 1.5)])
def test_mirrored_source_under_pressure_control(dipole, pressure):
    strength, height = dipole
    here = fm.equilibrium(disc_scene(dipole=dipole, elements=16), pressure=pressure)
    there = fm.equilibrium(disc_scene(dipole=(strength, -height), elements=16), pressure=-pressure)
    assert_mirrored(here, there, 1e-9)


def assert_mirrored(up: fm.Equilibrium, down: fm.Equilibrium, tolerance: float) -> None:
    assert down.pressure == pytest.approx(-up.pressure, rel=tolerance)
    assert down.volume == pytest.approx(-up.volume, rel=tolerance)
    assert down.elastic_energy == pytest.approx(up.elastic_energy, rel=tolerance)
    assert down.magnetic_energy == pytest.approx(up.magnetic_energy, rel=tolerance)
    one, other = up.profile(), down.profile()
    size = np.abs(one["eta"]).max()
    assert np.abs(other["rho"] - one["rho"]).max() <= tolerance
    assert np.abs(other["eta"] + one["eta"]).max() <= tolerance * size


@pytest.mark.parametrize("material", [fm.NeoHookean(), OGDEN], ids=["neo-hookean", "ogden"])
@pytest.mark.parametrize("solver", SOLVERS)
def test_flat_limit(material, solver):
    """P/V^3 -> 3.3367: on a nearly flat membrane w ~ V, the tension ~ V^2, hence P ~ V^3, the same for every material of shear modulus 1.

    3.33670 at V = 1.6e-3 is the value of an independent solver; constancy below is the statement itself.
    """
    volumes = [1e-9, 1e-8, 1e-6, 1e-5, 1e-4, 1.6e-3]
    run = fm.inflate(disc_scene(material), volumes=volumes, solver=solver)
    ratio = run.column("pressure") / run.column("volume") ** 3
    assert ratio[-1] == pytest.approx(3.33670, abs=1e-5)
    assert np.ptp(ratio[:-1]) < 1e-6 * ratio[0]
    # energy is P dV = P V/4
    assert run.column("elastic_energy") == pytest.approx(run.column("pressure") * volumes / 4, rel=1e-5)


@pytest.mark.parametrize("material", [fm.NeoHookean(), OGDEN], ids=["neo-hookean", "ogden"])
def test_flat_limit_from_cold(material):
    """Each volume on its own, and the same law under pressure control."""
    scene = disc_scene(material)
    for volume in (1e-9, 1e-4):
        eq = fm.equilibrium(scene, volume=volume)
        assert eq.pressure / eq.volume**3 == pytest.approx(3.3367, rel=1e-5)
        again = fm.equilibrium(scene, pressure=eq.pressure)
        assert again.volume == pytest.approx(volume, rel=1e-6)


@pytest.mark.parametrize("control", ["pressure", "volume"])
@pytest.mark.parametrize("volume", [1e-9, 1e-8, 1e-6, 1e-5])
def test_flat_limit_of_the_eigenvalues(volume, control):
    """lambda ~ V^2: the transverse stiffness is the tension. The constant is taken at V = 1e-4, where nothing is near round-off."""
    scene = disc_scene(elements=16)
    small, reference = (fm.equilibrium(scene, volume=v, solver="newton") for v in (volume, 1e-4))
    assert small.verdict(control).stable is True
    expected = reference.verdict(control).smallest_eigenvalue * (volume / 1e-4) ** 2
    assert small.verdict(control).smallest_eigenvalue == pytest.approx(expected, rel=1e-4)


def test_splitting_a_source_changes_nothing():
    """Two dipoles at one place add as fields: (sqrt(a) + sqrt(b))^2 = M."""
    strength, height = 200.0, 6.5
    first = 0.3**2 * strength
    second = 0.7**2 * strength
    whole = disc_scene(dipole=(strength, height), elements=16)
    parts = whole.replace(sources=[fm.Dipole(first, height), fm.Dipole(second, height)])
    assert_same(fm.equilibrium(whole, volume=40.0), fm.equilibrium(parts, volume=40.0), 1e-11)


def test_opposite_sources_cancel():
    plain = disc_scene(elements=16)
    both = plain.replace(sources=[fm.Dipole(200, 6.5), fm.Dipole(200, 6.5, orientation=-1)])
    assert_same(fm.equilibrium(plain, volume=2.0), fm.equilibrium(both, volume=2.0), 1e-11)


def test_orientation_of_a_single_source_is_not_felt():
    one = disc_scene(dipole=ABOVE, elements=16)
    other = one.replace(sources=[fm.Dipole(*ABOVE, orientation=-1)])
    assert_same(fm.equilibrium(one, volume=40.0), fm.equilibrium(other, volume=40.0), 1e-14)


@pytest.mark.parametrize("change", ["strength", "susceptibility", "second source"])
def test_nothing_added_changes_nothing(change):
    if change == "second source":
        plain = disc_scene(dipole=ABOVE, elements=16)
        more = plain.replace(sources=[fm.Dipole(*ABOVE), fm.Dipole(0.0, 3.0)])
    else:
        plain = disc_scene(elements=16)
        more = disc_scene(dipole=(0.0, 6.5) if change == "strength" else ABOVE, elements=16)
        more = more.replace(susceptibility=0.0) if change == "susceptibility" else more
    for volume in (2.0, 20.0):
        assert_same(fm.equilibrium(plain, volume=volume), fm.equilibrium(more, volume=volume), 1e-11)


def assert_same(one: fm.Equilibrium, other: fm.Equilibrium, tolerance: float) -> None:
    assert other.pressure == pytest.approx(one.pressure, rel=tolerance)
    assert other.volume == pytest.approx(one.volume, rel=tolerance)
    assert other.elastic_energy == pytest.approx(one.elastic_energy, rel=tolerance)
    assert other.magnetic_energy == pytest.approx(one.magnetic_energy, rel=tolerance, abs=1e-15)
    assert other.state == pytest.approx(one.state, rel=tolerance, abs=tolerance)


@pytest.mark.parametrize("solver", SOLVERS)
def test_repeated_runs_are_identical(solver):
    scene = disc_scene(dipole=BELOW, elements=16)

    def once():
        run = fm.inflate(scene, volumes=np.linspace(0.5, 6, 8), solver=solver)
        # analysis included: the eigensolver starts from fixed numbers
        return [(eq.pressure, eq.volume, eq.energy, *eq.state, *eq.verdict("volume").mode["w"]) for eq in run]

    assert once() == once()


def test_repeated_runs_are_identical_from_cold():
    """Also when the potential is built anew."""
    from femmembrane.potential import of_scene

    scene = disc_scene(dipole=BELOW, elements=16)
    first = fm.equilibrium(scene, volume=6.0)
    of_scene._potential_of.cache_clear()
    second = fm.equilibrium(scene, volume=6.0)
    assert first.potential is not None
    assert (first.pressure, first.energy) == (second.pressure, second.energy)
    assert np.array_equal(first.state, second.state)


def test_the_path_does_not_matter():
    """One equilibrium at a volume below the limit of the dipole, whether reached by small steps, in one, or from above."""
    scene = disc_scene(dipole=ABOVE, elements=16)
    cold = fm.equilibrium(scene, volume=30.0)
    small = fm.inflate(scene, volumes=np.linspace(0.5, 30, 40))[-1]
    above = fm.inflate(scene, volumes=[60.0, 30.0])[-1]
    for other in (small, above):
        assert_same(cold, other, 1e-9)
