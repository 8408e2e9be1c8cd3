"""The relaxed energy: what it is for any material, that it is off when it is off, and taut states that do not notice it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import femmembrane as fm
from femmembrane.physics.tension_field import TensionField, natural_strains
from femmembrane.potential import Potential, potential_of
from femmembrane.solve.banded import band_product
from femmembrane.stability.azimuthal_operator import azimuthal_operator
from femmembrane.verbs.folds import fold_curve
from tests.cases import OGDEN, disc_scene
from tests.potential.test_potential import census, dense
from tests.stability.test_azimuthal import _response, _surface_energies

strains = st.floats(-1.0, 1.5)


@st.composite
def materials(draw):
    """Ogden's material with one to three terms of either sign, exponents up to 6, shear modulus 1."""
    alpha = draw(st.lists(st.floats(0.3, 6.0), min_size=1, max_size=3))
    signs = draw(st.lists(st.sampled_from((1, -1)), min_size=len(alpha), max_size=len(alpha)))
    shares = draw(st.lists(st.floats(0.05, 1.0), min_size=len(alpha), max_size=len(alpha)))
    alpha = [s * a for s, a in zip(signs, alpha, strict=True)]
    return fm.Ogden(tuple(2 * share / sum(shares) / a for share, a in zip(shares, alpha, strict=True)), tuple(alpha))


def minimum_over_widths(material: fm.Ogden, e1: float, e2: float) -> float:
    """The relaxed energy by its definition: the least energy of stretches no smaller than those given, by a search of its own."""
    a, b = (np.linspace(e, max(e, 0.0, -e / 2) + 2.0, 4001) for e in (e1, e2))
    edges = [material.energy(e1, b), material.energy(a, e2)]
    inside = 0.0 if e1 <= 0 and e2 <= 0 else np.inf
    return float(min(edges[0].min(), edges[1].min(), inside))


# --- what the relaxed energy is


@given(materials(), strains, strains)
def test_it_is_the_least_energy_of_a_wrinkled_sheet(material, e1, e2):
    """A wrinkled sheet is stretched further than it looks, along its wrinkles' crests: wider at no cost."""
    relaxed = TensionField(material).energy(e1, e2)
    assert relaxed == pytest.approx(minimum_over_widths(material, e1, e2), rel=1e-5, abs=2e-6)
    assert 0 <= relaxed <= material.energy(e1, e2)


@given(materials(), strains, strains)
def test_zones(material, e1, e2):
    """Stress in the directions that are taut and in no other; the plain stresses decide where the sheet is taut."""
    s1, s2 = TensionField(material).stress(e1, e2)
    plain1, plain2 = material.stress(e1, e2)
    assume(min(abs(e1 + e2 / 2), abs(e2 + e1 / 2)) > 1e-9)
    if plain1 >= 0 and plain2 >= 0:
        assert (s1, s2) == (plain1, plain2)
    elif max(e1, e2) <= 0:
        assert (s1, s2) == (0, 0)
    else:
        tension, none = (s1, s2) if e1 > e2 else (s2, s1)
        assert none == 0
        assert tension == pytest.approx(material.stress(max(e1, e2), -max(e1, e2) / 2)[0], rel=1e-12)


@pytest.mark.parametrize("stretch", [1.0, 1.001, 1.2, 2.0, 5.0])
def test_simple_tension_of_the_neo_hookean_sheet(stretch):
    """w = (l^2 + 2/l - 3)/2, l w' = l^2 - 1/l, l (l w')' = 2 l^2 + 1/l: closed forms, at any width below the natural one."""
    relaxed, e1 = TensionField(fm.NeoHookean()), np.log(stretch)
    for e2 in (-0.5 * e1 - 1e-3, -0.5 * e1 - 0.7):
        assert relaxed.energy(e1, e2) == pytest.approx((stretch**2 + 2 / stretch - 3) / 2, rel=1e-12, abs=1e-15)
        assert relaxed.stress(e1, e2)[0] == pytest.approx(stretch**2 - 1 / stretch, rel=1e-12)
        assert relaxed.tangent(e1, e2) == (pytest.approx(2 * stretch**2 + 1 / stretch, rel=1e-12), 0, 0)
        assert relaxed.stress(e2, e1)[1] == relaxed.stress(e1, e2)[0]
        assert relaxed.tangent(e2, e1)[2] == relaxed.tangent(e1, e2)[0]


@given(materials(), strains, strains)
def test_stress_and_tangent_are_derivatives(material, e1, e2):
    """Against central differences, away from the borders of the zones, where the tangent jumps."""
    assume(min(abs(e1), abs(e2), abs(e1 + e2 / 2), abs(e2 + e1 / 2)) > 1e-4)
    relaxed, h = TensionField(material), 1e-5
    steps = ((h, 0.0), (0.0, h))
    scale = 1 + material.energy(abs(e1) + 0.1, abs(e2) + 0.1) * 36  # size of the second derivatives of exponents up to 6
    tangent = relaxed.tangent(e1, e2)
    for k, (d1, d2) in enumerate(steps):
        rise = relaxed.energy(e1 + d1, e2 + d2) - relaxed.energy(e1 - d1, e2 - d2)
        assert rise / (2 * h) == pytest.approx(relaxed.stress(e1, e2)[k], abs=1e-7 * scale)
        high, low = relaxed.stress(e1 + d1, e2 + d2), relaxed.stress(e1 - d1, e2 - d2)
        for j in range(2):
            assert (high[j] - low[j]) / (2 * h) == pytest.approx(tangent[j + k], abs=1e-7 * scale)


@given(materials(), st.floats(0.01, 1.5), st.sampled_from((1, -1)))
def test_once_continuously_differentiable(material, e, side):
    """Across the border to hoop wrinkles energy and stress are continuous, to first and second order in the distance."""
    relaxed, border, d = TensionField(material), -e / 2, 1e-6
    inside, outside = border + d, border - d
    stiffness = max(map(abs, material.tangent(e, border)))
    assert abs(relaxed.energy(e, inside) - relaxed.energy(e, outside)) <= 2 * stiffness * d**2 + 1e-15 * relaxed.energy(e, border)
    for one, other in zip(relaxed.stress(e, inside), relaxed.stress(e, outside), strict=True):
        assert abs(one - other) <= 4 * stiffness * d
    # at rest all four zones meet
    assert relaxed.energy(side * d, -side * d) <= 4 * d**2
    assert max(np.abs(relaxed.stress(side * d, -side * d))) <= 4 * d


@settings(max_examples=300, deadline=None)
@given(st.sampled_from([OGDEN, fm.NeoHookean(), fm.Ogden((1.0, 0.5), (1.0, 2.0))]), st.data())
def test_rank_one_convex(material, data):
    """Along any line F + t a b^T of deformation gradients the relaxed energy is convex, as a membrane's must be; the plain one is not."""
    entries = st.floats(-1.5, 1.5)
    F = np.array(data.draw(st.lists(entries, min_size=6, max_size=6))).reshape(3, 2)
    a, b = (np.array(data.draw(st.lists(entries, min_size=k, max_size=k))) for k in (3, 2))

    def energy(t: float) -> float:
        singular = np.linalg.svd(F + t * np.outer(a, b), compute_uv=False)
        assume(singular.min() > 1e-3)
        return TensionField(material).energy(*np.log(singular))

    left, middle, right = (energy(t) for t in (-0.5, 0.0, 0.5))
    assert middle <= (left + right) / 2 + 1e-12 * (1 + left + right)


def test_the_plain_energy_is_not_rank_one_convex():
    """A sheet of width 0.9 folded in a zigzag of two slopes of natural length costs less than its average, which is compressed."""
    compressed, folded = fm.NeoHookean().energy(np.log(0.9), 0.0), fm.NeoHookean().energy(0.0, 0.0)
    assert folded < compressed
    assert TensionField(fm.NeoHookean()).energy(np.log(0.9), 0.0) == 0


def test_outside_the_domain_is_not_slack():
    for relaxed in (TensionField(fm.NeoHookean()), TensionField(OGDEN)):
        assert np.isnan(relaxed.energy(0.1, np.nan))
        assert np.isnan(relaxed.energy(np.nan, 0.1))
        assert np.isnan(relaxed.stress(0.1, np.nan)).any()
    potential = potential_of(disc_scene(elements=4).replace(tension_field=True))
    s = potential.space.interpolation_points()
    assert np.isnan(potential.evaluate(potential.space.interpolate(-8 * s * (1 - s), 0 * s), 0.0).elastic_energy)  # rho < 0


@given(materials(), strains, strains)
@settings(max_examples=30, deadline=None)
def test_casadi_says_the_same(material, e1, e2):
    relaxed = TensionField(material)
    potential = potential_of(disc_scene(material, elements=1).replace(tension_field=True))
    found = potential.response(np.array([e1]), np.array([e2])).ravel()
    expected = [*relaxed.stress(e1, e2), *relaxed.tangent(e1, e2)]
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-13)


def test_natural_strains_of_arrays_and_numbers_agree():
    e = np.random.default_rng(0).uniform(-1, 1, (2, 50))
    whole = np.array(natural_strains(*e))
    for k in range(50):
        np.testing.assert_array_equal(whole[:, k], natural_strains(*e[:, k].tolist()))


def test_hessian_of_a_wrinkled_state():
    """Against central differences of the gradient, and the gradient of the energy: some points wrinkled, none near a border."""
    potential, x = wrinkled_state(disc_scene(OGDEN, (600.0, -3.25), elements=6).replace(tension_field=True))
    evaluation, h = potential.evaluate(x, 1.7), 1e-6
    wrinkled = evaluation.stress[1] == 0
    assert 0 < wrinkled.sum() < wrinkled.size
    found, numeric = dense(potential, evaluation.band), np.empty((x.size, x.size))
    for k in range(x.size):
        high, low = (potential.evaluate(x + s * h * np.eye(x.size)[k], 1.7) for s in (1, -1))
        force = evaluation.gradient[k] - 1.7 * evaluation.volume_gradient[k]
        assert (high.energy - low.energy - 1.7 * (high.volume - low.volume)) / (2 * h) == pytest.approx(force, abs=1e-7)
        numeric[:, k] = (high.gradient - low.gradient - 1.7 * (high.volume_gradient - low.volume_gradient)) / (2 * h)
    assert np.abs(found - numeric).max() < 1e-7 * np.abs(found).max()


# --- off means off, and taut states are plain


def test_off_builds_nothing():
    """No comparison in the kernel without it; with it a few more operations, and no further call of an exponential."""
    plain = disc_scene(OGDEN, (600.0, -3.25), elements=4)
    off, on = census(plain), census(plain.replace(tension_field=True))
    assert not {"OP_LE", "OP_LT", "OP_FMIN", "OP_FMAX", "OP_IF_ELSE_ZERO"} & off.keys()
    assert {"OP_LE", "OP_LT"} & on.keys()
    exponentials = ("OP_EXP", "OP_EXPM1", "OP_LOG1P", "OP_LOG")
    assert [on.get(name, 0) for name in exponentials] == [off.get(name, 0) for name in exponentials]
    # recorded on 2026-11-24: 340 and 369
    assert 0 < Potential(plain.replace(tension_field=True)).operations - Potential(plain).operations <= 30


TAUT = [((200.0, 6.5), np.linspace(0.5, 75, 30)), ((400.0, -3.75), np.linspace(0.5, 0.2, 7)), (None, np.linspace(0.01, 40, 20))]


@pytest.mark.parametrize(("dipole", "volumes"), TAUT)
def test_taut_states_are_unchanged_to_the_last_bit(dipole, volumes):
    plain = disc_scene(OGDEN, dipole, elements=24).replace(analysis=fm.Analysis(stability=("pressure", "volume"), azimuthal_modes=(1, 3)))
    runs = [fm.inflate(scene, volumes=volumes, solver="newton") for scene in (plain, plain.replace(tension_field=True))]
    for one, other in zip(*runs, strict=True):
        np.testing.assert_array_equal(one.state, other.state)
        for name in ("pressure", "volume", "elastic_energy", "magnetic_energy", "residual", "iterations", "status"):
            assert getattr(one, name) == getattr(other, name), name
        for control, n in (("pressure", 0), ("volume", 0), (None, 1), (None, 3)):
            assert one.verdict(control, azimuthal=n).smallest_eigenvalue == other.verdict(control, azimuthal=n).smallest_eigenvalue
        for key, values in one.profile().items():
            np.testing.assert_array_equal(values, other.profile()[key])
        ours, theirs = (eq.potential.evaluate(one.state, one.pressure) for eq in (one, other))
        for name in ("gradient", "volume_gradient", "band", "stress"):
            np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))


@pytest.mark.parametrize(("dipole", "volumes"), TAUT)
def test_the_minimiser_finds_the_same_taut_states(dipole, volumes):
    """Its trial points may lie in other zones, so that it comes by another way: to round-off of the solve."""
    plain = disc_scene(OGDEN, dipole, elements=24)
    for one, other in zip(*(fm.inflate(scene, volumes=volumes) for scene in (plain, plain.replace(tension_field=True))), strict=True):
        assert other.pressure == pytest.approx(one.pressure, rel=1e-11)
        np.testing.assert_allclose(other.state, one.state, rtol=0, atol=1e-11 * np.abs(one.state).max())


def test_traced_branches_are_the_same_where_they_are_taut():
    """M = 400, h = -3.75 from V = 0.5 to a pole height of 0: a limit point on the way, no wrinkles."""
    plain = disc_scene(OGDEN, (400.0, -3.75), elements=24)
    one, other = (fm.trace(scene, direction=-1, until={"center_height": 0.0}) for scene in (plain, plain.replace(tension_field=True)))
    assert len(one) == len(other)
    np.testing.assert_array_equal(one.column("pressure"), other.column("pressure"))
    assert [p.pressure for p in one.special_points] == [p.pressure for p in other.special_points]


# --- the second variation around the axis


def wrinkled_state(scene: fm.Scene):
    """Pulled in beyond half radius and lifted: hoop wrinkles there, taut at pole and rim; no equilibrium."""
    potential = potential_of(scene)
    s = potential.space.interpolation_points()
    return potential, potential.space.interpolate(0.4 * s * (1 - s) - 2.6 * s**3 * (1 - s), 1.2 * (1 - s))


@pytest.mark.parametrize("n", [0, 1, 2, 5])
def test_second_differences_of_the_relaxed_surface_energy(n):
    """The form with n waves against the finite surface in three dimensions, whose principal stretches follow from its metric."""
    potential, x = wrinkled_state(disc_scene(elements=6).replace(tension_field=True))
    r = azimuthal_operator(potential, x, 0.0, n).response
    assert {bool(v) for v in (r.s2 == 0).ravel()} == {True, False}
    assert (r.s1 > 0).all()
    operator = azimuthal_operator(potential, x, 0.0, n)
    mode = np.random.default_rng(n).standard_normal(operator.band.shape[1])
    form = mode @ band_product(operator.band, operator.half_bandwidth, mode)
    step = 3e-6  # no point crosses from one zone to another
    e = [_surface_energies(potential, x, mode, n, k * step)[0] for k in (-2, -1, 0, 1, 2)]
    second = (-e[0] + 16 * e[1] - 30 * e[2] + 16 * e[3] - e[4]) / (12 * step**2)
    assert second * (1 if n == 0 else 2) == pytest.approx(form, rel=1e-5)


def test_shear_modulus_of_wrinkled_sheets_keeps_its_digits():
    """A = s_1/(l_1^2 - l_2^2) for hoop wrinkles, however close the stretches: at rest the zones meet."""
    potential = potential_of(disc_scene(elements=4).replace(tension_field=True))
    e1 = np.logspace(-12, -1, 23)
    e2 = -0.7 * e1
    found = _response(potential, e1, e2)
    np.testing.assert_allclose(found.A, OGDEN.stress(e1, -e1 / 2)[0] / (np.exp(2 * e2) * np.expm1(2 * (e1 - e2))), rtol=1e-12)
    slack = _response(potential, -e1, -e1)
    assert not slack.A.any()


# --- a number of the scene varied


def test_a_taut_limit_point_is_followed_like_that_of_the_plain_membrane():
    plain = disc_scene(OGDEN, (400.0, -3.75), elements=24)
    curves = []
    for scene in (plain, plain.replace(tension_field=True)):
        start = fm.trace(scene, direction=-1, until={"center_height": 0.1}).special_points[0]
        curves.append(fold_curve(scene, start=start, parameter="source.0.strength", bounds=(400.0, 450.0)))
    np.testing.assert_allclose(curves[1].pressure, curves[0].pressure, rtol=1e-13)


def test_a_limit_point_with_wrinkles_is_followed_as_far_as_its_derivatives_go():
    """The form that vanishes at a fold jumps where the border of a zone passes a point of the mesh: said, with what to do instead."""
    scene = disc_scene(OGDEN, (400.0, -3.75), elements=24).replace(tension_field=True)
    branch = fm.trace(scene, direction=-1, until={"center_height": -0.5})
    start = [point for point in branch.special_points if point.kind == "limit_point"][-1]
    assert (start.equilibrium.profile()["mechanical_stress_2"] == 0).sum() > 5
    with pytest.raises(fm.SolveError, match="no third derivatives, which this needs: trace at each value instead") as caught:
        fold_curve(scene, start=start, parameter="source.0.strength", bounds=(400.0, 450.0))
    assert len(caught.value.result) >= 1
