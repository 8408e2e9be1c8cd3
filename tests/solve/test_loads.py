"""Loads besides the pressure: a liquid that fills the membrane, and the weight of the membrane."""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.accuracy.collocation import collocate
from femmembrane.accuracy.shooting import shoot
from femmembrane.accuracy.strong_form import Guess
from femmembrane.kernels import in_numpy
from femmembrane.potential import Family, Potential, potential_of
from femmembrane.scene.variation import Parameter, names
from femmembrane.solve.banded import band_product
from femmembrane.solve.guess import spherical_dome
from femmembrane.solve.minimize import nlp_functions
from femmembrane.stability.azimuthal_operator import azimuthal_operator
from tests.cases import OGDEN, disc_scene

LOADS = {"hydrostatic": fm.Hydrostatic(0.4), "weight": fm.Weight(0.3)}
BOTH = tuple(LOADS.values())


def loaded(*loads, elements=8, degree=4, dipole=None):
    return disc_scene(OGDEN, dipole, elements=elements, degree=degree).replace(loads=loads)


@pytest.fixture(scope="module")
def equilibrium():
    return fm.equilibrium(loaded(*BOTH, elements=16, degree=6), volume=3.0)


# --- energies


def test_energies_of_a_cone():
    """eta = c (1 - r): gamma Int eta dV = pi gamma c^2/12, and w Int eta R dS = pi w c/3."""
    c = 0.7
    for load, expected in ((fm.Hydrostatic(2.0), np.pi * 2.0 * c**2 / 12), (fm.Weight(2.0), np.pi * 2.0 * c / 3)):
        potential = potential_of(loaded(load))
        s = potential.space.interpolation_points()
        found = potential.evaluate(potential.space.interpolate(0 * s, c * (1 - s)), 0.0)
        assert found.load_energy == pytest.approx(expected, rel=1e-13)
        assert found.energy == found.elastic_energy + found.load_energy


@pytest.mark.parametrize("name", LOADS)
def test_derivatives(name):
    """Gradient and Hessian against central differences; the factor on sources scales loads, too."""
    potential = potential_of(loaded(LOADS[name], elements=3, degree=2))
    x, h = spherical_dome(potential, 2.0), 1e-5
    e, off = potential.evaluate(x, 0.0), potential.evaluate(x, 0.0, 0.0)
    assert off.load_energy == 0
    assert potential.evaluate(x, 0.0, 0.5).load_energy == pytest.approx(e.load_energy / 2)
    kd = potential.space.half_bandwidth
    for k in range(x.size):
        step = h * (np.arange(x.size) == k)
        high, low = potential.evaluate(x + step, 0.0), potential.evaluate(x - step, 0.0)
        assert (high.load_energy - low.load_energy) / (2 * h) == pytest.approx((e.gradient - off.gradient)[k], abs=1e-8)
        for j in range(max(0, k - kd), min(x.size, k + kd + 1)):
            assert (high.gradient[j] - low.gradient[j]) / (2 * h) == pytest.approx(
                e.band[2 * kd + j - k, k], abs=1e-6 * np.abs(e.band).max()
            )


def test_the_optimiser_sees_the_same_energy():
    potential = potential_of(loaded(*BOTH, elements=3, degree=2))
    x = spherical_dome(potential, 2.0)
    value = float(nlp_functions(potential).value(x, [0.0, 1.0, 1.0, 1.0, 1.0, 1.0]))
    assert value == pytest.approx(potential.evaluate(x, 0.0).energy, rel=1e-13)


# --- equilibria


def test_forces_at_the_rim_hold_everything(equilibrium):
    """Vertical balance of the whole membrane: 2 pi W_1 (-eta'/lambda_1) = pi P - gamma V - pi w."""
    end = {name: values[-1] for name, values in equilibrium.profile().items()}
    space, x = potential_of(equilibrium.scene).space, equilibrium.state
    u_s, w_s = (slope[-1] for slope in space.recovered_slopes(x, space.node_parameters()))
    sine = -w_s / np.hypot(1 + u_s, w_s)
    force = 2 * np.pi * end["mechanical_stress_1"] / end["stretch_1"] * sine
    expected = np.pi * equilibrium.pressure - 0.4 * equilibrium.volume - np.pi * 0.3
    assert force == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("method", [shoot, collocate])
def test_independent_methods_agree(method, equilibrium):
    more = {"tolerance": 1e-9} if method is collocate else {}
    found = method(equilibrium.scene, volume=3.0, guess=Guess.of(equilibrium), **more)
    assert found.converged
    assert equilibrium.pressure == pytest.approx(found.pressure, rel=1e-8)
    assert equilibrium.center_height == pytest.approx(found.center_height, rel=1e-8)
    assert abs(equilibrium.pressure - fm.equilibrium(loaded(), volume=3.0).pressure) > 0.1  # the loads are felt


def test_loads_beside_a_dipole():
    scene = loaded(*BOTH, elements=16, dipole=(200, 4.0))
    eq = fm.equilibrium(scene, volume=2.0)
    found = shoot(scene, volume=2.0, guess=Guess.of(eq))
    assert found.converged
    assert (eq.pressure, eq.magnetic_energy) == pytest.approx((found.pressure, found.magnetic_energy), rel=1e-8)


def test_pressure_is_the_slope_of_the_energy():
    scene, h = loaded(*BOTH), 1e-3
    low, middle, high = (fm.equilibrium(scene, volume=2.0 + k * h) for k in (-1, 0, 1))
    assert (high.energy - low.energy) / (2 * h) == pytest.approx(middle.pressure, rel=1e-6)


def test_a_membrane_sags_under_its_weight():
    """Without pressure, and as far up as down under the opposite weight."""
    down, up = (fm.equilibrium(loaded(fm.Weight(w)), pressure=0.0) for w in (0.2, -0.2))
    assert down.center_height < -0.1
    assert (up.volume, up.center_height) == pytest.approx((-down.volume, -down.center_height), rel=1e-9)
    assert down.verdict("pressure").stable is True
    found = shoot(down.scene, pressure=0.0, guess=Guess.of(down))
    assert found.volume == pytest.approx(down.volume, rel=1e-8)


def test_a_heavy_liquid_flattens_the_top():
    """The more liquid weighs, the lower the pole at the same volume and the higher the pressure at the rim."""
    states = [fm.equilibrium(loaded(fm.Hydrostatic(gamma)), volume=4.0) for gamma in (0.0, 0.3, 0.6)]
    heights, pressures = ([getattr(eq, name) for eq in states] for name in ("center_height", "pressure"))
    assert heights == sorted(heights, reverse=True)
    assert pressures == sorted(pressures)
    local = states[2].profile()["total_stress_1"] - states[2].profile()["mechanical_stress_1"]
    assert local == pytest.approx(-(states[2].pressure - 0.6 * states[2].profile()["eta"]) / 1000, abs=1e-12)


# --- a force on a hub


def pulled(*loads, mesh=None, **rest):
    return fm.Scene(material=fm.NeoHookean(), mesh=mesh or fm.annulus(0.3, 6), degree=3, loads=loads, **rest)


@pytest.mark.parametrize(
    ("mesh", "hub", "place"),
    [
        (fm.annulus(0.3, 3), None, 0),
        (fm.annulus(0.3, 3, inner="clamped", outer="hub"), "last", -1),
        (fm.cylinder(2.0, 3, top="hub"), "first", 0),
        (fm.cylinder(2.0, 3, bottom="hub"), None, -1),
    ],
)
def test_energy_of_a_force_on_a_hub(mesh, hub, place):
    """E = -F (height of the hub): its slope is -F with respect to that height and 0 to anything else; the factor on loads scales it."""
    potential = potential_of(pulled(fm.HubForce(0.7, hub), mesh=mesh))
    space = potential.space
    s = space.interpolation_points()
    x = space.interpolate(0.01 * np.sin(s), 0.05 * np.cos(s))
    e, off = potential.evaluate(x, 0.0), potential.evaluate(x, 0.0, 0.0)
    height = space.end_position(x, place)[1]
    assert e.load_energy == pytest.approx(-0.7 * height, abs=1e-14)
    assert potential.evaluate(x, 0.0, 0.5).load_energy == pytest.approx(e.load_energy / 2, abs=1e-14)
    expected = np.zeros(space.n_free)
    expected[space.numbers[space.nodes[place], 1]] = -0.7
    assert e.gradient - off.gradient == pytest.approx(expected, abs=1e-12 * np.abs(e.gradient).max())
    assert e.band == pytest.approx(off.band, abs=1e-12 * np.abs(e.band).max())
    value = float(nlp_functions(potential).value(x, [0.0, 1.0, 1.0, 1.0, 1.0, 1.0]))
    assert value == pytest.approx(e.energy, rel=1e-12)


def test_a_pulled_hub():
    """Both solvers, both halves of the evaluation, the error estimate, and the work theorem dE_elastic/dF = F dz/dF."""
    scene = pulled(fm.HubForce(0.8))
    eq, other = (fm.equilibrium(scene, pressure=0.0, solver=solver) for solver in ("newton", "ipopt"))
    assert other.center_height == pytest.approx(eq.center_height, rel=1e-9)
    assert eq.load_energy == pytest.approx(-0.8 * eq.center_height, rel=1e-12)
    assert eq.verdict("pressure").stable is True
    compiled = eq.potential.evaluate(eq.state, 0.0)
    with in_numpy():
        numpy = eq.potential.evaluate(eq.state, 0.0)
    assert compiled.gradient == pytest.approx(numpy.gradient, abs=1e-13)
    down = fm.equilibrium(pulled(fm.HubForce(-0.8)), pressure=0.0)
    assert down.center_height == pytest.approx(-eq.center_height, rel=1e-9)
    h = 1e-4
    low, high = (fm.equilibrium(pulled(fm.HubForce(0.8 + d)), pressure=0.0, solver="newton") for d in (-h, h))
    work = 0.8 * (high.center_height - low.center_height)
    assert high.elastic_energy - low.elastic_energy == pytest.approx(work, rel=1e-5)
    truth = fm.equilibrium(scene.replace(mesh=fm.annulus(0.3, 12), degree=6), pressure=0.0, solver="newton")
    assert eq.energy - truth.energy > 0  # an equilibrium held by its loads is a minimum, and the finer space goes lower
    estimate = fm.equilibrium(scene, volume=eq.volume).error_estimate()
    finer = fm.equilibrium(truth.scene, volume=eq.volume, solver="newton")
    assert estimate.pressure.error == pytest.approx(eq.pressure - finer.pressure, rel=0.3)


def test_a_closed_tube_in_a_testing_machine():
    """Pulled at both lids, it floats as without forces; alone they are refused, nothing holds against them."""
    mesh = fm.cylinder(2.0, 6, top="hub", bottom="hub")
    both = pulled(fm.HubForce(0.5, "first"), fm.HubForce(-0.5, "last"), mesh=mesh)
    potential = potential_of(both)
    assert potential.space.pin is not None
    eq = fm.equilibrium(both, volume=7.0)
    half = pulled(fm.HubForce(0.5, "first"), mesh=fm.cylinder(1.0, 3, top="hub", bottom="mirror"))
    found = fm.equilibrium(half, volume=3.5)
    assert found.pressure == pytest.approx(eq.pressure, rel=1e-8)
    with pytest.raises(fm.InputError, match=r"load.force = 0.5: nothing holds the membrane against it"):
        pulled(fm.HubForce(0.5, "first"), mesh=mesh)


@pytest.mark.parametrize(
    ("mesh", "load", "message"),
    [
        (fm.disc(4), fm.HubForce(1.0), r"load.hub = None: there is no such hub"),
        (fm.torus(3, 4), fm.HubForce(1.0), r"load.hub = None: there is no such hub"),
        (fm.annulus(0.3, 4), fm.HubForce(1.0, "last"), r"load.hub = 'last': there is no such hub"),
        (fm.cylinder(2.0, 4, top="hub", bottom="hub"), fm.HubForce(1.0), r"load.hub = None: missing; there are two hubs"),
    ],
)
def test_a_force_on_no_hub(mesh, load, message):
    with pytest.raises(fm.InputError, match=message):
        pulled(load, mesh=mesh)


def test_a_force_that_is_none():
    with pytest.raises(fm.InputError, match=r"load.force = nan: a finite number"):
        fm.HubForce(float("nan"))
    with pytest.raises(fm.InputError, match=r"load.hub = 'top': 'first' or 'last'"):
        fm.HubForce(1.0, "top")
    plain = Potential(pulled())
    assert Potential(pulled(fm.HubForce(0.0))).operations == plain.operations
    assert 0 < Potential(pulled(fm.HubForce(0.3))).operations - plain.operations < 20
    with_weight, with_both = (Potential(pulled(*loads)) for loads in ([fm.Weight(0.3)], [fm.Weight(0.3), fm.HubForce(0.0)]))
    assert with_both.operations == with_weight.operations
    assert len(with_weight.point_data) == len(plain.point_data)


def test_a_force_in_files(tmp_path):
    scene = pulled(fm.HubForce(0.4), fm.Weight(0.1))
    scene.to_toml(tmp_path / "scene.toml")
    assert fm.Scene.from_toml(tmp_path / "scene.toml") == scene
    branch = fm.inflate(scene, volumes=[0.5, 1.0])
    branch.save(tmp_path / "branch.nc")
    assert [eq.load_energy for eq in fm.load(tmp_path / "branch.nc")] == [eq.load_energy for eq in branch]
    assert branch.to_dataframe()["load_energy"].tolist() == [eq.load_energy for eq in branch]
    parameter = Parameter(scene, "load.0.force")
    family, member = Family(scene, parameter.vary), Potential(parameter.scene_at(0.7))
    x = branch[0].state
    one, other = family.evaluate(x, 1.0, 0.7), member.evaluate(x, 1.0)
    assert one.energy == pytest.approx(other.energy, rel=1e-13)
    assert one.gradient == pytest.approx(other.gradient, rel=1e-12, abs=1e-14)


# --- stability


def test_waves_around_the_axis():
    """n = 0 is the axisymmetric operator; at n = 1 a sideways translation does no work, away from the rim."""
    eq = fm.equilibrium(loaded(*BOTH, elements=32, degree=2), volume=3.0)
    potential, x, pressure = potential_of(eq.scene), eq.state, eq.pressure
    band = potential.evaluate(x, pressure).band
    np.testing.assert_allclose(azimuthal_operator(potential, x, pressure, 0).band, band, rtol=0, atol=1e-12 * np.abs(band).max())
    operator = azimuthal_operator(potential, x, pressure, 1)
    mode = np.zeros(operator.band.shape[1] + 1)
    for k, value in enumerate((1.0, -1.0, 0.0)):
        mode[operator.numbering[:, k]] = value
    mode[operator.numbering[0, 0]] = 1.0  # c = -a shares the unknown of a on the axis
    away = operator.numbering[: -potential.space.degree - 1]
    rows = np.unique(away[away < mode.size - 1])
    product = band_product(operator.band, operator.half_bandwidth, mode[:-1])
    assert np.abs(product[rows]).max() < 1e-10 * np.abs(operator.band).max()


def test_the_corrected_test_of_jacobi_counts_negative_directions():
    """With both loads, on both sides of the limit point of the pressure."""
    scene = loaded(*BOTH, elements=16, degree=6)
    for volume in (1.5, 8.0):
        eq = fm.equilibrium(scene, volume=volume)
        count = eq.verdict("pressure").negative_directions
        assert fm.jacobi_test(eq).conjugate_points.size == count
    assert count == 1


# --- off means off, files


def test_no_load_costs_nothing():
    plain = Potential(loaded())
    assert Potential(loaded(fm.Hydrostatic(0.0), fm.Weight(0.0))).operations == plain.operations
    assert Potential(loaded(fm.Hydrostatic(0.0))).loads == ()
    assert plain.point_function.numel_out(0) == 23
    # recorded on 2026-11-24: 4 operations more for the weight, 21 for the liquid
    assert 0 < Potential(loaded(fm.Weight(0.3))).operations - plain.operations < 10
    assert 0 < Potential(loaded(fm.Hydrostatic(0.3))).operations - plain.operations < 40


def test_files(tmp_path):
    scene = loaded(*BOTH)
    scene.to_toml(tmp_path / "scene.toml")
    assert fm.Scene.from_toml(tmp_path / "scene.toml") == scene
    branch = fm.inflate(scene, volumes=[1.0, 2.0])
    branch.save(tmp_path / "branch.nc")
    again = fm.load(tmp_path / "branch.nc")
    assert [eq.load_energy for eq in again] == [eq.load_energy for eq in branch]
    assert branch.to_dataframe()["load_energy"].tolist() == [eq.load_energy for eq in branch]
    assert "load_energy" not in fm.inflate(loaded(), volumes=[1.0]).to_dataframe()


def test_a_load_can_be_followed():
    scene = loaded(fm.Weight(0.3), fm.Hydrostatic(0.4), elements=4, degree=2)
    assert {"load.0.weight", "load.1.gamma"} <= set(names(scene))
    parameter = Parameter(scene, "load.1.gamma")
    family, member = Family(scene, parameter.vary), Potential(parameter.scene_at(0.7))
    x = spherical_dome(family, 1.0)
    one, other = family.evaluate(x, 1.0, 0.7), member.evaluate(x, 1.0)
    assert one.energy == pytest.approx(other.energy, rel=1e-13)
    assert one.gradient == pytest.approx(other.gradient, rel=1e-12, abs=1e-14)
    assert parameter.value == 0.4


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ([{"kind": "hydrostatic"}], r"load.gamma = None: missing"),
        ([{"kind": "weight", "weight": "1"}], r"load.weight = '1': a finite number"),
        ([{"kind": "weight", "weight": 1.0}, {"kind": "hydrostatic", "gamma": True}], r"load\[1\].gamma = True"),
        ([{"kind": "wait", "weight": 1.0}], r"load.kind = 'wait': unknown; did you mean 'weight'"),
        ({"kind": "weight", "weight": 1.0}, r"write \[\[load\]\], one for each load"),
    ],
)
def test_tables(tables, message):
    with pytest.raises(fm.InputError, match=message):
        fm.Scene.from_dict({"material": {"model": "varga"}, "load": tables})


def test_no_load():
    with pytest.raises(fm.InputError, match=r"load = <class .*a load is allowed"):
        loaded(fm.Weight)


def test_a_membrane_that_sags_at_no_pressure_does_not_pass_the_flat_state() -> None:
    """A liquid lighter than what is outside lifts the membrane: the flat state is in equilibrium but unstable, no state leads to it."""
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(elements=8), loads=[fm.Hydrostatic(-1.0)])
    down = fm.pressurize(scene, pressures=[0.3, 0.0, -0.01])
    assert [eq.verdict("pressure").stable for eq in down] == [True] * 3
    assert down[1].volume == pytest.approx(fm.equilibrium(scene, pressure=1e-6).volume, rel=1e-4)
    assert 0 < down[2].volume < down[1].volume
    assert fm.equilibrium(scene, pressure=0.0).volume == pytest.approx(down[1].volume, rel=1e-9)
    with pytest.raises(fm.SolveError, match="limit point"):
        fm.pressurize(scene, pressures=[0.3, -0.1])
    on = fm.pressurize(scene, pressures=[0.0, 0.01], start=down[1])
    assert on[0].volume == pytest.approx(down[1].volume, rel=1e-9)
    assert on[1].volume > on[0].volume
