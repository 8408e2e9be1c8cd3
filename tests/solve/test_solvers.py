"""Every problem with every solver, and what a minimiser may not call converged."""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.potential import potential_of
from femmembrane.solve.controls import CenterHeightControl, PressureControl, VolumeControl
from femmembrane.solve.guess import spherical_dome
from femmembrane.solve.minimize import is_minimum, minimize_and_verify
from femmembrane.solve.newton import correct
from tests.cases import CONTROLS, OGDEN, POINTS, PROBLEMS, SOLVERS, disc_scene

#: printing of any kind fails these tests
pytestmark = pytest.mark.usefixtures("silent")

NAMES = [problem.name for problem in PROBLEMS]


@pytest.mark.parametrize("problem", PROBLEMS, ids=NAMES)
def test_solvers_agree(problem):
    one, other = (problem.solve(solver) for solver in SOLVERS)
    for name in ("pressure", "volume", "elastic_energy", "magnetic_energy"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-9), name


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("problem", PROBLEMS, ids=NAMES)
def test_what_converged_means(problem, solver):
    """Forces balance and the control holds, recomputed from the state alone; and the state is a minimum."""
    eq = problem.solve(solver)
    assert eq.status is fm.Status.CONVERGED
    evaluation = eq.potential.evaluate(eq.state, eq.pressure)
    force = evaluation.gradient - eq.pressure * evaluation.volume_gradient
    for scale, index in zip(eq.potential.force_scale(evaluation, eq.pressure), eq.potential.space.fields, strict=True):
        assert np.abs(force[index]).max() < 1e-9 * scale
    assert getattr(eq, problem.control) == pytest.approx(problem.point.expected[problem.control], rel=1e-9)
    assert evaluation.elastic_energy == eq.elastic_energy
    assert evaluation.volume == eq.volume
    control = VolumeControl(eq.volume) if problem.control == "volume" else PressureControl(eq.pressure)
    assert is_minimum(eq.potential, control, evaluation)


def test_state_is_read_only():
    eq = PROBLEMS[0].solve("newton")
    with pytest.raises(ValueError):
        eq.state[0] = 1.0


# --- a minimiser that is started badly

SADDLES = [p for p in POINTS if not p.is_minimum("pressure") and p.is_minimum("volume")]


@pytest.mark.parametrize("point", SADDLES, ids=[p.name for p in SADDLES])
def test_from_a_saddle(point):
    """Under pressure control these states balance forces without being minima: IPOPT stays and is caught, or leaves for a minimum."""
    saddle = fm.equilibrium(point.scene, volume=point.expected["volume"], solver="newton")
    control = PressureControl(saddle.pressure)
    result = minimize_and_verify(potential_of(point.scene), control, saddle.state, saddle.pressure)
    if result.status is fm.Status.CONVERGED:
        assert is_minimum(potential_of(point.scene), control, result.evaluation)
        assert abs(result.evaluation.volume - saddle.volume) > 1e-3 * saddle.volume
    else:
        assert result.status in (fm.Status.NOT_A_MINIMUM, fm.Status.NOT_CONVERGED)


def test_saddle_is_named():
    """The neo-Hookean disc at pole height 2, exactly at its saddle: the gradient is zero, so that IPOPT stays."""
    point = next(p for p in POINTS if p.name == "neo_hookean_disc-2")
    saddle = fm.equilibrium(point.scene, volume=point.expected["volume"], solver="newton")
    result = minimize_and_verify(potential_of(point.scene), PressureControl(saddle.pressure), saddle.state, saddle.pressure)
    assert result.status is fm.Status.NOT_A_MINIMUM
    with pytest.raises(fm.SolveError):
        fm.equilibrium(point.scene, pressure=saddle.pressure, start=saddle, solver="ipopt")


def test_corrector_follows_what_a_minimiser_cannot_hold():
    """Past the limit point (V = 2.80 neo-Hookean) only the corrector accepts a state at its pressure."""
    scene = disc_scene(fm.NeoHookean(), elements=16)
    saddle = fm.equilibrium(scene, volume=7.0)
    again = fm.equilibrium(scene, pressure=0.999 * saddle.pressure, start=saddle, solver="newton")
    assert again.volume > saddle.volume
    with pytest.raises(fm.SolveError):
        fm.equilibrium(scene, pressure=0.999 * saddle.pressure, start=saddle, solver="ipopt")


@pytest.mark.parametrize("elements", [16, 64])
def test_cold_minimiser_beside_a_dipole(elements):
    """A dome of V = 75 under the dipole above: IPOPT runs into the singularity (E = -1e15 and below), which may not pass as converged."""
    scene = disc_scene(OGDEN, (200.0, 6.5), elements=elements)
    potential = potential_of(scene)
    result = minimize_and_verify(potential, VolumeControl(75.0), spherical_dome(potential, 75.0), 0.0)
    if result.status is fm.Status.CONVERGED:  # then it must be the state that is found with care
        careful = fm.equilibrium(scene, volume=75.0)
        assert result.evaluation.energy == pytest.approx(careful.energy, rel=1e-8)
    # the public verb finds it (pole height between 4.4 and 4.5 in the reference tables, V = 76.04 at 4.5)
    eq = fm.equilibrium(scene, volume=75.0)
    assert 4.4 < eq.center_height < 4.5
    assert eq.magnetic_energy > -2


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("seed", range(3))
def test_from_noise(control, seed):
    """From a guess that is no membrane at all, a result is either refused or a true minimum that balances forces."""
    potential = potential_of(disc_scene(OGDEN, (600.0, -3.5), elements=8))
    rng = np.random.default_rng(seed)
    x = spherical_dome(potential, 1.0) + 0.2 * rng.normal(size=potential.space.n_free)
    wanted = VolumeControl(1.0) if control == "volume" else PressureControl(1.9)
    result = minimize_and_verify(potential, wanted, x, 1.0)
    if result.status is fm.Status.CONVERGED:
        assert result.residual < 1e-9
        assert abs(result.gap) < 1e-9
        assert is_minimum(potential, wanted, result.evaluation)
        assert result.evaluation.magnetic_energy > -50


def test_minimiser_answers_to_its_own_controls_only():
    potential = potential_of(disc_scene(elements=8))
    with pytest.raises(TypeError, match="volume or pressure"):
        minimize_and_verify(potential, CenterHeightControl(0.5), spherical_dome(potential, 1.0), 0.0)


def test_pressure_beyond_every_minimum():
    """The neo-Hookean disc bears P = 1.8792 at the most (its limit point): beyond, there is no stable state to find."""
    scene = disc_scene(fm.NeoHookean(), elements=16)
    with pytest.raises(fm.SolveError) as caught:
        fm.equilibrium(scene, pressure=1.95)
    assert caught.value.status is fm.Status.NO_EQUILIBRIUM
    assert fm.equilibrium(scene, pressure=1.875).verdict("pressure").stable is True


@pytest.mark.parametrize("solver", SOLVERS)
def test_load_past_the_limit_is_not_invented(solver):
    """A run that cannot go on says so and keeps what it has; the last state lies before the limit point (P = 1.8792)."""
    scene = disc_scene(fm.NeoHookean(), elements=16)
    run = fm.pressurize(scene, pressures=[0.5, 1.5, 1.85, 1.9], solver=solver, throw=False)
    assert len(run) == 3
    assert run.status is not fm.Status.CONVERGED
    assert run.message
    assert [eq.verdict("pressure").stable for eq in run] == [True] * 3


# --- the corrector


@pytest.mark.parametrize("height", [0.4, 1.0])
def test_corrector_converges_quadratically(height):
    """From a state nearby: 1e-3, 1e-6 or so, 1e-12; at most five iterations."""
    potential = potential_of(disc_scene(OGDEN, elements=16))
    near = fm.equilibrium(potential.scene, center_height=height)
    result = correct(potential, CenterHeightControl(1.02 * height), near.state, near.pressure)
    assert result.status is fm.Status.CONVERGED
    assert result.iterations <= 5


def test_volume_pressure_and_height_control_meet():
    scene = disc_scene(OGDEN, (600.0, -3.5), elements=16)
    by_volume = fm.equilibrium(scene, volume=1.2)
    by_height = fm.equilibrium(scene, center_height=by_volume.center_height)
    by_pressure = fm.equilibrium(scene, pressure=by_volume.pressure, start=by_height)
    for other in (by_height, by_pressure):
        assert other.state == pytest.approx(by_volume.state, rel=1e-8, abs=1e-9)


def test_failure_is_reported_whole():
    """No convergence: finite iterations, status, no exception."""
    potential = potential_of(disc_scene(elements=8))
    result = correct(potential, VolumeControl(50.0), spherical_dome(potential, 1.0), 0.0, max_iterations=2)
    assert result.status is fm.Status.NOT_CONVERGED
    outside = np.zeros(potential.space.n_free)
    outside[potential.space.fields[0]] = -2.0
    assert correct(potential, VolumeControl(1.0), outside, 0.0).status is fm.Status.NOT_CONVERGED


@pytest.mark.parametrize("volume", [1e-12, 1e-9, 1e-3, 0.1, 3.0])
def test_dome_is_a_sphere_down_to_the_smallest_volumes(volume):
    """Of a flat dome of height H the radial displacement is 2 H^2 (s - s^3)/3 to first order: far below round-off of the radius."""
    potential = potential_of(disc_scene(fm.NeoHookean(), elements=16, degree=4))
    s = np.linspace(0.1, 0.9, 9)
    u, _, w, _ = potential.space.evaluate(spherical_dome(potential, volume), s)
    height = 2 * np.sinh(np.arcsinh(3 * volume / np.pi) / 3)
    radius = (1 + height**2) / (2 * height)
    if volume < 1e-6:
        np.testing.assert_allclose(u, 2 * height**2 * (s - s**3) / 3, rtol=1e-6)
        np.testing.assert_allclose(w, height * (1 - s**2), rtol=1e-6)
    else:
        np.testing.assert_allclose((s + u) ** 2 + (w - height + radius) ** 2, radius**2, rtol=1e-6)
        np.testing.assert_allclose(s + u, radius * np.sin(2 * np.arctan(height) * s), rtol=1e-6)


@pytest.mark.parametrize("damped", [True, False])
def test_nearly_flat_cold_starts_take_a_handful_of_iterations(damped):
    """From the dome Newton converges at once at any small volume, whatever its last digits (40 iterations and failures recorded before)."""
    potential = potential_of(disc_scene(fm.NeoHookean()))
    for volume in 10 ** np.random.default_rng(0).uniform(-10, -6, 40):
        result = correct(potential, VolumeControl(volume), spherical_dome(potential, volume), 0.0, magnetic=0.0, damped=damped)
        assert result.status is fm.Status.CONVERGED
        assert result.iterations <= 6


@pytest.mark.parametrize("height", [-0.1, -0.4])
def test_a_low_pole_above_a_strong_dipole_is_reached_from_the_inflated_side(height):
    """M = 400, h = -3.25: turned on over the deflated membrane, the dipole would tear it down before its full strength."""
    eq = fm.equilibrium(disc_scene(OGDEN, (400.0, -3.25), elements=24), center_height=height)
    assert eq.status is fm.Status.CONVERGED
    assert eq.center_height == pytest.approx(height, abs=1e-12)
    assert eq.volume > 0


def test_where_neither_side_leads_the_first_reason_is_given():
    with pytest.raises(fm.SolveError, match=r"at V = -0\.5"):
        fm.equilibrium(disc_scene(OGDEN, (600.0, -1.2), elements=16), center_height=-0.3)


@pytest.mark.parametrize(
    "verb",
    [
        lambda scene: fm.inflate(scene, volumes=[1.0]),
        lambda scene: fm.pressurize(scene, pressures=[1.0]),
        lambda scene: fm.equilibrium(scene, volume=1.0),
        lambda scene: fm.trace(scene, start=0.5, until={"volume": 1.0}),
        lambda scene: fm.equilibria(scene, volume=1.0),
        lambda scene: fm.convergence(scene, volume=1.0),
        lambda scene: fm.cost(scene, volume=1.0),
        lambda scene: fm.fold_curve(scene, start=1.0, parameter="x", bounds=(0.0, 1.0)),
        fm.run,
    ],
)
def test_the_path_of_a_scene_is_no_scene(verb):
    with pytest.raises(fm.InputError, match=r"scene = 'x\.toml': a Scene is allowed"):
        verb("x.toml")
