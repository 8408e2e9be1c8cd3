"""The total potential: exact derivatives, the vectorised kernel, and terms that are off."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import casadi as ca
import numpy as np
import pytest

import femmembrane as fm
from femmembrane.potential import Potential, potential_of
from femmembrane.potential.replay import vectorise
from femmembrane.solve.guess import spherical_dome
from femmembrane.solve.minimize import nlp_functions
from tests.cases import OGDEN, disc_scene

SCENES = {
    "neo-hookean": disc_scene(fm.NeoHookean(), elements=6),
    "ogden": disc_scene(OGDEN, elements=6, degree=3),
    "dipole": disc_scene(OGDEN, (600.0, -3.25), elements=6),
    "tension field": disc_scene(OGDEN, (600.0, -3.25), elements=6).replace(tension_field=True),
    "two dipoles": disc_scene(OGDEN, (200.0, 5.0), elements=6).replace(sources=[fm.Dipole(200, 5.0), fm.Dipole(90, -3.0, orientation=-1)]),
}


def dense(potential: Potential, band: np.ndarray) -> np.ndarray:
    kd, n = potential.space.half_bandwidth, potential.space.n_free
    full = np.zeros((n, n))
    for i in range(n):
        for j in range(max(0, i - kd), min(n, i + kd + 1)):
            full[i, j] = band[2 * kd + i - j, j]
    return full


def somewhere(potential: Potential, seed: int = 0) -> np.ndarray:
    """No equilibrium: a dome with every unknown disturbed."""
    x = spherical_dome(potential, 2.0)
    return x + 0.01 * np.random.default_rng(seed).normal(size=x.size)


# --- derivatives, term by term


@pytest.mark.parametrize("term", ["elastic_energy", "magnetic_energy", "volume"])
@pytest.mark.parametrize("name", SCENES)
def test_gradient_of_every_term(name, term):
    """Against central differences of the value: error O(h^2)."""
    potential = potential_of(SCENES[name])
    x, h = somewhere(potential), 1e-5
    found = gradient_of(potential, x, term)
    for k in range(x.size):
        step = np.zeros_like(x)
        step[k] = h
        high, low = (getattr(potential.evaluate(x + s, 0.0), term) for s in (step, -step))
        assert (high - low) / (2 * h) == pytest.approx(found[k], abs=1e-6 * (1 + np.abs(found).max()))


def gradient_of(potential, x, term):
    evaluation = potential.evaluate(x, 0.0)
    if term == "volume":
        return evaluation.volume_gradient
    elastic = potential.evaluate(x, 0.0, 0.0).gradient  # the factor turns the magnetic energy off
    return elastic if term == "elastic_energy" else evaluation.gradient - elastic


@pytest.mark.parametrize("pressure", [0.0, 1.7])
@pytest.mark.parametrize("magnetic", [0.0, 1.0])
@pytest.mark.parametrize("name", SCENES)
def test_hessian_of_every_term(name, magnetic, pressure):
    potential = potential_of(SCENES[name])
    x, h = somewhere(potential), 1e-5
    found = dense(potential, potential.evaluate(x, pressure, magnetic).band)
    assert np.array_equal(found, found.T) or np.abs(found - found.T).max() < 1e-13 * np.abs(found).max()
    numeric = np.zeros_like(found)
    for k in range(x.size):
        step = np.zeros_like(x)
        step[k] = h
        high, low = (potential.evaluate(x + s, pressure, magnetic) for s in (step, -step))
        numeric[:, k] = (high.gradient - low.gradient - pressure * (high.volume_gradient - low.volume_gradient)) / (2 * h)
    assert np.abs(found - numeric).max() < 1e-7 * np.abs(found).max()


def test_magnetic_factor_scales_the_magnetic_energy():
    potential = potential_of(SCENES["dipole"])
    x = somewhere(potential)
    one, half = potential.evaluate(x, 0.0), potential.evaluate(x, 0.0, 0.5)
    assert half.magnetic_energy == pytest.approx(one.magnetic_energy / 2, rel=1e-14)
    assert half.elastic_energy == one.elastic_energy


def test_undeformed_membrane_stores_nothing():
    potential = potential_of(SCENES["ogden"])
    rest = potential.evaluate(np.zeros(potential.space.n_free), 0.0)
    assert (rest.elastic_energy, rest.volume) == (0.0, 0.0)
    assert np.abs(rest.gradient).max() == 0
    w = np.arange(potential.space.n_free)[potential.space.fields[1]]
    # the flat unloaded disc has no transverse stiffness
    assert np.abs(dense(potential, rest.band)[np.ix_(w, w)]).max() == 0


def test_homogeneous_stretch():
    """u = 0.2 R (rim released in thought): E = pi W(log 1.2, log 1.2); a cone of height c over the rim: V = pi c/3."""
    potential = potential_of(disc_scene(OGDEN, elements=6))
    space = potential.space
    s = space.interpolation_points()
    cone = space.interpolate(np.zeros_like(s), 0.7 * (1 - s))
    assert potential.evaluate(cone, 0.0).volume == pytest.approx(np.pi * 0.7 / 3, rel=1e-13)
    slanted = np.log(np.hypot(1, 0.7))
    assert potential.evaluate(cone, 0.0).elastic_energy == pytest.approx(np.pi * OGDEN.energy(slanted, 0.0), rel=1e-12)


def test_magnetic_energy_of_the_flat_disc():
    """-pi chi M Int (r^2 + 4 h^2)/(r^2 + h^2)^4 r dr = -pi chi M [ (1/2)(1/h^4 - 1/a^2)/2 + (1/2)(1/h^6 - 1/a^3) h^2 ], a = 1 + h^2."""
    strength, h = 200.0, 3.0
    potential = potential_of(disc_scene(OGDEN, (strength, h), elements=16, degree=4))
    a = 1 + h**2
    integral = (1 / h**4 - 1 / a**2) / 4 + 3 * h**2 * (1 / h**6 - 1 / a**3) / 6
    found = potential.evaluate(np.zeros(potential.space.n_free), 0.0).magnetic_energy
    assert found == pytest.approx(-np.pi * 2.5 * strength * integral, rel=1e-12)


def test_outside_the_domain_of_the_energy():
    """A radius past the axis has no strain: NaN, and nothing is raised or printed."""
    potential = potential_of(SCENES["ogden"])
    x = np.zeros(potential.space.n_free)
    x[potential.space.fields[0]] = -2.0
    evaluation = potential.evaluate(x, 1.0)
    assert np.isnan(evaluation.energy)
    assert np.isnan(evaluation.gradient).all()


@pytest.mark.parametrize("name", SCENES)
def test_response_and_field_energy(name):
    """The pointwise laws that other rooms ask for are the ones in the kernel."""
    potential = potential_of(SCENES[name])
    e1, e2, h = np.array([0.1, 0.8]), np.array([0.3, -0.1]), 1e-6
    found = potential.response(e1, e2)
    stress = potential.scene.material.stress
    assert found[:2] == pytest.approx(np.array(stress(e1, e2)))
    by_e1, by_e2 = ((np.array(stress(e1 + a, e2 + b)) - np.array(stress(e1 - a, e2 - b))) / (2 * h) for a, b in ((h, 0), (0, h)))
    assert found[2:] == pytest.approx(np.array([by_e1[0], by_e2[0], by_e2[1]]), rel=1e-7)
    field = potential.field_energy(np.array([0.4, 1.0]), np.array([0.2, 0.9]))
    assert field.shape == (6, 2)
    if not potential.sources:
        assert not field.any()
    else:
        up, down = (potential.field_energy(np.array([0.4, 1.0]), np.array([0.2, 0.9]) + d) for d in (h, -h))
        assert field[2] == pytest.approx((up[0] - down[0]) / (2 * h), rel=1e-7)
        assert field[5] == pytest.approx((up[2] - down[2]) / (2 * h), rel=1e-7)


# --- the kernel


@pytest.mark.parametrize("name", SCENES)
def test_vectorised_kernel_is_the_point_function(name):
    potential = potential_of(SCENES[name])
    function, data = potential.point_function, potential.point_data
    local = potential.space.at_quadrature(somewhere(potential)).reshape(4, -1)
    found = potential._point.replay(local, np.array([1.3, 0.8]))
    for k in (0, 7, data.shape[1] - 1):
        assert found[:, k] == pytest.approx(np.array(function(data[:, k], local[:, k], [1.3, 0.8])).ravel(), rel=1e-14, abs=1e-300)


@pytest.mark.parametrize("elements", [341, 342, 700])
def test_kernel_in_blocks_is_the_kernel_in_one(elements):
    """1023, 1026 and 2100 points of degree 2: without, with a nearly empty, and with several blocks of 1024."""
    potential = Potential(disc_scene(dipole=(200.0, 6.5), elements=elements))
    n = potential.n_points
    assert n == 3 * elements
    local = potential.space.at_quadrature(somewhere_smooth(potential)).reshape(4, n)
    parameters = np.array([1.3, 1.0])
    whole = vectorise(potential.point_function, n)(potential.point_data.T, local.T, parameters)
    assert np.array_equal(potential._point.replay(local, parameters), np.array(whole).T)
    assert (potential._point._replay.n_blocks > 1) == (n > 1024)


def somewhere_smooth(potential):
    return spherical_dome(potential, 2.0)


def test_evaluations_do_not_share_memory():
    """The kernel's buffers are reused: a record of one state must survive the next call."""
    potential = potential_of(SCENES["dipole"])
    first = potential.evaluate(somewhere(potential), 1.0)
    kept = [np.array(a) for a in (first.gradient, first.volume_gradient, first.band, first.stress, first.force_density)]
    potential.evaluate(somewhere(potential, 1), 2.0)
    for before, now in zip(kept, (first.gradient, first.volume_gradient, first.band, first.stress, first.force_density), strict=True):
        assert np.array_equal(before, now)


@pytest.mark.parametrize("name", SCENES)
def test_optimiser_sees_the_same_potential(name):
    """The CasADi functions handed to IPOPT against the evaluation in NumPy, with scales that are not 1."""
    potential = potential_of(SCENES[name])
    x, pressure, lam_f, lam_g = somewhere(potential), 1.3, 0.7, -0.4
    su, sw, objective, volume = 0.3, 2.0, 5.0, 3.0
    scales = np.empty_like(x)
    scales[potential.space.fields[0]], scales[potential.space.fields[1]] = su, sw
    p, y, nlp = [pressure, 0.9, su, sw, objective, volume], x / scales, nlp_functions(potential)
    multiplier = pressure - lam_g / lam_f * objective / volume
    e = potential.evaluate(x, multiplier, 0.9)
    assert float(nlp.value(y, p)) == pytest.approx((e.energy - pressure * e.volume) / objective, rel=1e-12)
    gradient = np.array(nlp.gradient(y, p)[1]).ravel()
    assert gradient == pytest.approx(scales * (e.gradient - pressure * e.volume_gradient) / objective, rel=1e-9, abs=1e-12)
    assert float(nlp.volume(y, p)) == pytest.approx(e.volume / volume, rel=1e-12)
    assert np.array(nlp.volume_gradient(y, p)[1]).ravel() == pytest.approx(scales * e.volume_gradient / volume, rel=1e-10, abs=1e-13)
    upper = np.array(ca.DM(nlp.hessian(y, p, lam_f, lam_g)))
    expected = lam_f / objective * np.outer(scales, scales) * dense(potential, e.band)
    assert np.abs(upper - np.triu(expected)).max() < 1e-11 * np.abs(expected).max()


# --- off means off


def census(scene: fm.Scene) -> dict[str, int]:
    """How many instructions of each kind one point costs."""
    function = Potential(scene).point_function
    names = {getattr(ca, name): name for name in dir(ca) if name.startswith("OP_")}
    count: dict[str, int] = {}
    for k in range(function.n_instructions()):
        name = names[function.instruction_id(k)]
        count[name] = count.get(name, 0) + 1
    return count


def constants(scene: fm.Scene) -> set[float]:
    """Absolute values of the numbers written into the kernel."""
    function = Potential(scene).point_function
    where = [k for k in range(function.n_instructions()) if function.instruction_id(k) == ca.OP_CONST]
    return {abs(float(function.instruction_constant(k))) for k in where}


@pytest.mark.parametrize("material", [fm.NeoHookean(), OGDEN], ids=["neo-hookean", "ogden"])
def test_without_a_source_the_kernel_holds_no_dipole(material):
    """Not multiplied by zero: absent. No division by a distance, no height of a source among the constants, far fewer instructions."""
    height = 6.4321
    plain, magnetic = (disc_scene(material, dipole, elements=4) for dipole in (None, (200.0, height)))
    without, within = census(plain), census(magnetic)
    divisions = ("OP_DIV", "OP_INV")
    assert sum(within.get(name, 0) - without.get(name, 0) for name in divisions) >= 1
    assert height in constants(magnetic)
    # the material's numbers and small integers of the strains: as many with another susceptibility, for it is not there
    assert constants(plain) == constants(plain.replace(susceptibility=3.21))
    assert without == census(plain.replace(susceptibility=None))
    # recorded on 2026-11-22: 167 and 293 operations without a source, 80 or more for the dipole
    assert Potential(plain).operations < {"NeoHookean": 185, "Ogden": 315}[type(material).__name__]
    assert Potential(magnetic).operations - Potential(plain).operations > 50


@pytest.mark.parametrize("material", [fm.NeoHookean(), OGDEN], ids=["neo-hookean", "ogden"])
def test_zero_susceptibility_is_no_source(material):
    plain = disc_scene(material, elements=4)
    weak = disc_scene(material, (200.0, 6.5), elements=4).replace(susceptibility=0.0)
    assert census(weak) == census(plain)
    assert Potential(weak).sources == ()


@pytest.mark.parametrize("material", [fm.NeoHookean(), OGDEN], ids=["neo-hookean", "ogden"])
def test_no_source_does_not_read_the_magnetic_factor(material):
    """The second parameter has no influence where nothing magnetic is built: no instruction depends on it."""
    for scene, expected in ((disc_scene(material, elements=4), False), (disc_scene(material, (200.0, 6.5), elements=4), True)):
        function = Potential(scene).point_function
        depends = np.array(ca.DM(function.jac_sparsity(0, 2), 1))[:, 1].any()
        assert bool(depends) is expected
        reads = [
            function.instruction_input(k)
            for k in range(function.n_instructions())
            if function.instruction_id(k) == ca.OP_INPUT and list(function.instruction_input(k)) == [2, 1]
        ]
        assert bool(reads) is expected


def test_flat_disc_reads_no_height_of_the_reference():
    assert Potential(disc_scene(elements=4)).point_data.shape[0] == 3


def test_potential_is_built_once_per_physics():
    scene = disc_scene(elements=6)
    same = scene.replace(title="another", analysis=fm.Analysis(stability=["volume"]), radius_to_thickness=50.0)
    assert potential_of(scene) is potential_of(same)
    assert potential_of(scene) is not potential_of(scene.replace(degree=3))


def test_threads_share_a_potential() -> None:
    """What one thread is answered does not change under the hands of another (CasADi lets them run at the same time)."""
    potential = potential_of(fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(elements=200), loads=[fm.Weight(0.1)]))
    s = potential.space.interpolation_points()
    states = [potential.space.interpolate(0.0 * s, k * (1 - s**2)) for k in (0.1, 0.3)]
    expected = [potential.load_energy(x) for x in states]
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda k: {potential.load_energy(states[k]) for _ in range(100)}, (0, 1)))
    assert found == [{value} for value in expected]
