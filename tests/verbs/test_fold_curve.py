"""Fold curves against independent traces, their cusps from both sheets, derivatives, order under refinement, and refusals."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.errors import InputError, SolveError, Status
from femmembrane.potential import Family, potential_of
from femmembrane.results.folds import FoldCurve
from femmembrane.scene.variation import Parameter, names
from femmembrane.solve.banded import BandFactor, BorderedFactor, WideBorder, band_product
from femmembrane.solve.continuation import StepControl
from femmembrane.solve.segment import Segment
from femmembrane.verbs.folds import fold_curve
from tests.cases import OGDEN, disc_scene

STRENGTH = "source.0.strength"


@cache
def above(strength: float = 200.0, elements: int = 32) -> fm.Branch:
    """The branch with the dipole above, up to past its magnetic limit point."""
    return fm.trace(disc_scene(OGDEN, (strength, 6.5), elements), start=0.5, until={"center_height": 5.2})


@cache
def below(elements: int = 32) -> fm.Branch:
    """The branch with a strong dipole below, whose folds at low volume come in pairs."""
    return fm.trace(disc_scene(OGDEN, (600.0, -3.5), elements), start=2.1, until={"center_height": 0.05}, direction=-1)


@cache
def plain(elements: int = 16) -> fm.Branch:
    """The branch without a source: a maximum of the pressure, then a minimum."""
    return fm.trace(disc_scene(OGDEN, None, elements), start=0.5, until={"center_height": 4.0})


def folds(branch: fm.Branch, kind: str) -> list[fm.SpecialPoint]:
    return [p for p in branch.special_points or () if p.kind == kind]


@cache
def magnetic(direction: int = 1) -> FoldCurve:
    start = folds(above(), "limit_point")[2]
    return fold_curve(start.equilibrium.scene, start=start, parameter=STRENGTH, bounds=(50.0, 1000.0), direction=direction)


# --- derivatives


@pytest.mark.parametrize("name", names(disc_scene(OGDEN, (200.0, 6.5))))
def test_derivatives_agree_with_central_differences(name):
    scene = disc_scene(OGDEN, (200.0, 6.5), 8)
    parameter = Parameter(scene, name)
    family, number = Family(scene, parameter.vary), parameter.value
    space, rng = potential_of(scene).space, np.random.default_rng(1)
    s = space.interpolation_points()
    x = space.interpolate(0.3 * s * (1 - s), 1 - s**2)
    mode, other = (space.interpolate(a * s * (1 - s), b * (1 - s**2)) for a, b in rng.normal(size=(2, 2)))
    pressure, q = 1.7, 0.4

    def force(m):
        e = family.evaluate(x, pressure, m)
        return e.gradient - pressure * e.volume_gradient

    def form(x, pressure, m):
        e = family.evaluate(x, pressure, m)
        return mode @ band_product(e.band, space.half_bandwidth, mode) - 2 * q * e.volume_gradient @ mode

    def central(f, h):
        return (f(h) - f(-h)) / (2 * h)

    got = family.fold_derivatives(x, pressure, number, mode, q)
    h = 1e-5
    assert got.cubic @ other == pytest.approx(central(lambda t: form(x + t * other, pressure, number), h), rel=1e-6)
    assert got.cubic_pressure == pytest.approx(central(lambda t: form(x, pressure + t, number), h), rel=1e-6)
    k = 1e-4 * abs(number)
    assert got.cubic_number == pytest.approx(central(lambda t: form(x, pressure, number + t), k), rel=1e-5)
    np.testing.assert_allclose(got.force_number, central(lambda t: force(number + t), k), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("name", names(disc_scene(OGDEN, (200.0, 6.5))))
def test_the_family_is_the_potential_of_each_member(name):
    scene = disc_scene(OGDEN, (200.0, 6.5), 8)
    parameter = Parameter(scene, name)
    family = Family(scene, parameter.vary)
    member = parameter.scene_at(1.02 * parameter.value)
    assert Parameter(member, name).value == pytest.approx(1.02 * parameter.value, rel=1e-15)
    space = potential_of(scene).space
    s = space.interpolation_points()
    x = space.interpolate(0.3 * s * (1 - s), 1 - s**2)
    ours, theirs = family.evaluate(x, 1.7, 1.02 * parameter.value), potential_of(member).evaluate(x, 1.7)
    np.testing.assert_allclose(ours.gradient, theirs.gradient, atol=1e-12)
    np.testing.assert_allclose(ours.band, theirs.band, atol=1e-10)
    assert (ours.energy, ours.volume) == pytest.approx((theirs.energy, theirs.volume), rel=1e-13)


def test_wide_border_solves_what_a_dense_solver_solves_with_a_singular_block():
    rng, n = np.random.default_rng(2), 12
    diagonal = np.arange(n) - 3.0  # singular: one zero
    band = np.zeros((4, n), order="F")
    band[2] = diagonal
    b, f = rng.normal(size=n), rng.normal(size=n)
    columns, rows, corner, h = rng.normal(size=(2, n)), rng.normal(size=(2, n)), rng.normal(size=(2, 2)), [0.3, -1.2]
    border = WideBorder(BorderedFactor(BandFactor(band), b, b, 0.0), list(columns), list(rows), corner)
    x, y = border.solve(f, h)
    dense = np.block([[np.diag(diagonal), columns.T], [rows, corner]])
    np.testing.assert_allclose(np.concatenate([x, y]), np.linalg.solve(dense, [*f, *h]), rtol=1e-9, atol=1e-11)


# --- limit points and volume folds against independent traces


@pytest.mark.parametrize(("kind", "index"), [("limit_point", 0), ("limit_point", 1), ("limit_point", 2), ("volume_fold", 0)])
@pytest.mark.parametrize(("strength", "direction"), [(100.0, -1), (500.0, 1)])
def test_every_fold_agrees_with_a_trace_at_another_strength(kind, index, strength, direction):
    start = folds(above(), kind)[index]
    scene = start.equilibrium.scene
    bounds = (strength, 1000.0) if direction < 0 else (50.0, strength)
    curve = fold_curve(scene, start=start, parameter=STRENGTH, bounds=bounds, direction=direction)
    assert curve.values[-1] == strength
    assert curve.equilibria[-1].scene.sources[0].strength == strength
    expected = folds(above(strength), kind)[index]
    # what is stationary at the fold is known to the corrector's tolerance; the rest moves along the branch with its location
    assert curve.pressure[-1] == pytest.approx(expected.pressure, rel=1e-10 if kind == "limit_point" else 1e-9)
    assert curve.volume[-1] == pytest.approx(expected.volume, rel=1e-8)
    assert curve.center_height[-1] == pytest.approx(expected.center_height, rel=1e-8)


def test_inner_points_of_the_magnetic_limit_point_agree_with_traces():
    curve = magnetic()
    assert curve.status is Status.CONVERGED
    assert not curve.message
    assert (curve.values[0], curve.values[-1]) == (200.0, 1000.0)
    assert (np.diff(curve.values) > 0).all()
    for k in (4, 7):
        expected = folds(above(float(curve.values[k])), "limit_point")[2]
        assert curve.pressure[k] == pytest.approx(expected.pressure, rel=1e-10)
        assert curve.volume[k] == pytest.approx(expected.volume, rel=1e-8)
    assert max(eq.residual for eq in curve.equilibria) < 1e-10


def test_the_magnetic_energy_may_vanish_at_a_bound():
    start = folds(above(), "limit_point")[0]
    ends = [
        fold_curve(start.equilibrium.scene, start=start, parameter=name, bounds=(0.0, 300.0), direction=-1)
        for name in (STRENGTH, "membrane.susceptibility")
    ]
    expected = folds(plain(32), "limit_point")[0]
    for curve in ends:
        assert (curve.values[-1], curve.pressure[-1]) == (0.0, pytest.approx(expected.pressure, rel=1e-10))


def test_strength_and_susceptibility_act_through_their_product():
    start = folds(above(), "limit_point")[2]
    scene = start.equilibrium.scene
    strength = fold_curve(scene, start=start, parameter=STRENGTH, bounds=(50.0, 300.0))
    susceptibility = fold_curve(scene, start=start, parameter="membrane.susceptibility", bounds=(1.0, 2.5 * 300 / 200))
    assert strength.pressure[-1] == pytest.approx(susceptibility.pressure[-1], rel=1e-10)
    assert strength.volume[-1] == pytest.approx(susceptibility.volume[-1], rel=1e-8)


# --- cusps


def test_two_limit_points_of_the_material_merge_and_the_curve_passes():
    # as the second Ogden term grows, the fall of the pressure after its maximum disappears
    high, low = folds(plain(), "limit_point")
    scene, bounds = high.equilibrium.scene, (0.002, 0.03)
    from_high, from_low = (fold_curve(scene, start=p, parameter="material.mu.1", bounds=bounds, max_steps=60) for p in (high, low))
    (cusp,), (other,) = from_high.cusps, from_low.cusps
    assert (cusp.kind, other.kind) == ("cusp", "cusp")
    assert cusp.value == pytest.approx(other.value, rel=1e-9)
    assert cusp.pressure == pytest.approx(other.pressure, rel=1e-9)
    assert cusp.error < 1e-9
    assert cusp.value > from_high.values.max()
    # through the cusp each comes back on the other's sheet
    at_start = fold_curve(scene, start=low, parameter="material.mu.1", bounds=(0.002, 0.03), direction=-1)
    assert from_high.values[-1] == 0.002
    assert from_high.pressure[-1] == pytest.approx(at_start.pressure[-1], rel=1e-9)
    # before it a trace finds both, beyond it none
    for share, count in ((0.99, 2), (1.01, 0)):
        branch = fm.trace(Parameter(scene, "material.mu.1").scene_at(share * cusp.value), start=0.5, until={"center_height": 4.0})
        assert len(folds(branch, "limit_point")) == count


@pytest.mark.parametrize(
    ("kind", "volumes", "parameter", "bounds", "expected"),
    [
        # recorded on 2026-11-22 with 64 elements: the number at the cusp
        ("limit_point", (1.7119, 0.5813), STRENGTH, (595, 1000), 875.9078),
        ("limit_point", (0.2098, 0.3063), STRENGTH, (400, 605), 471.8615),
        ("volume_fold", (0.2093, 0.3234), STRENGTH, (300, 605), 331.6762),
        ("limit_point", (0.2098, 0.3063), "source.0.height", (-4.0, -3.49), -3.655748),
    ],
)
def test_pairs_of_folds_below_a_dipole_merge(kind, volumes, parameter, bounds, expected):
    first, second = (min(folds(below(), kind), key=lambda p: abs(p.volume - v)) for v in volumes)
    scene, direction = first.equilibrium.scene, (1 if volumes[0] > 1 else -1)
    curves = [
        fold_curve(scene, start=p, parameter=parameter, bounds=bounds, direction=direction, steps=StepControl()) for p in (first, second)
    ]
    ends = [c.cusps for c in curves]
    assert [len(e) for e in ends] == [1, 1]
    (a,), (b,) = ends
    assert a.kind == b.kind == "cusp"
    assert a.value == pytest.approx(expected, rel=2e-6)
    assert (a.value, a.pressure, a.volume) == pytest.approx((b.value, b.pressure, b.volume), rel=1e-8)
    # started on one sheet, a curve comes back through the other's start
    back = curves[0]
    own = Parameter(scene, parameter).value
    passed = np.flatnonzero((back.values[:-1] - own) * (back.values[1:] - own) < 0)
    assert len(passed) >= 1


def test_a_limit_point_and_a_volume_fold_meet_and_both_curves_pass():
    # far inside the compressed region: an equation of this mesh, not of a membrane, but one on which the two systems must agree
    scene = disc_scene(OGDEN, (60.0, -2.5), 16)
    points = fm.trace(scene, start=0.5, until={"center_height": -1.2}, direction=-1, ill_posed="mark").special_points
    met = []
    for kind in ("volume_fold", "limit_point"):
        start = [p for p in points if p.kind == kind][-1]
        arguments = {"parameter": "source.0.height", "bounds": (-4.5, -0.5), "max_steps": 140, "ill_posed": "mark", "throw": False}
        curve = fold_curve(scene, start=start, **arguments, steps=StepControl(largest=0.5, deviation=2e-3))
        (meeting,) = [c for c in curve.cusps if c.kind == "branch_point"]
        met.append((meeting.value, meeting.pressure, meeting.volume, meeting.center_height))
    assert met[0] == pytest.approx(met[1], rel=1e-9)


# --- accuracy


def test_folds_and_cusps_converge_at_order_four():
    values, steps = [], set()
    for elements in (16, 32, 64):
        start = folds(below(elements), "limit_point")[0]
        curve = fold_curve(start.equilibrium.scene, start=start, parameter=STRENGTH, bounds=(599.0, 890.0), steps=StepControl())
        values.append((curve.cusps[0].value, curve.cusps[0].pressure, curve.pressure[-1]))
        steps.add(len(curve))
    assert len(steps) == 1  # arc length means the same on every mesh
    exact = (875.907743634, 2.34367814188, None)  # recorded on 2026-11-22 with 1024 elements
    for k in (0, 1):
        errors = np.abs(np.array([v[k] for v in values]) - exact[k]) / exact[k]
        np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 4.0, atol=0.4)
        assert errors[-1] < 2e-7
    ends = [v[2] for v in values]
    assert np.log2((ends[0] - ends[1]) / (ends[1] - ends[2])) == pytest.approx(4.0, abs=0.4)


# --- the record


def test_record_table_and_text():
    curve = magnetic()
    assert len(curve) == len(curve.equilibria) == len(curve.values)
    table = curve.to_dataframe()
    assert list(table.columns) == [STRENGTH, "pressure", "volume", "center_height"]
    assert table[STRENGTH].to_list() == curve.values.tolist()
    assert all(eq.scene.sources[0].strength == m for eq, m in zip(curve.equilibria, curve.values, strict=True))
    text = str(curve)
    assert "limit point (dP = 0)" in text
    assert len(text.splitlines()) == 2 + len(curve)
    with pytest.raises(ValueError, match="read-only"):
        curve.values[0] = 1.0


def test_each_equilibrium_is_marginal_under_pressure_in_its_own_scene():
    for eq in magnetic().equilibria[::4]:
        assert abs(eq.verdict("pressure").smallest_eigenvalue) < 1e-7


def test_plot_is_written_and_names_its_axes(tmp_path, silent):
    start = folds(plain(), "limit_point")[0]
    curve = fold_curve(start.equilibrium.scene, start=start, parameter="material.mu.1", bounds=(0.002, 0.03))
    figure = curve.plot(tmp_path / "folds.png")
    assert (tmp_path / "folds.png").stat().st_size > 10_000
    assert figure.axes[-1].get_xlabel() == "modulus of term 2 over the shear modulus, μ2/μ"
    assert any("cusp" in t.get_text() for t in figure.axes[0].get_legend().get_texts())
    assert "P = pR₀/(μT)" in figure.axes[0].get_ylabel()


def test_step_limit_keeps_what_was_computed():
    start = folds(above(), "limit_point")[2]
    arguments = {"start": start, "parameter": STRENGTH, "bounds": (50.0, 1000.0), "max_steps": 2}
    with pytest.raises(SolveError, match="2 steps") as caught:
        fold_curve(start.equilibrium.scene, **arguments)
    assert caught.value.status is Status.STEP_LIMIT
    curve = fold_curve(start.equilibrium.scene, **arguments, throw=False)
    assert len(curve) == len(caught.value.result) == 3
    assert curve.message in str(curve)


def test_compressive_stress_ends_the_curve():
    start = folds(below(), "volume_fold")[0]
    curve = fold_curve(start.equilibrium.scene, start=start, parameter=STRENGTH, bounds=(590.0, 1000.0), throw=False)
    assert curve.status is Status.LEGENDRE_FAILURE
    assert "compressive" in curve.message
    assert curve.equilibria[-1].status is Status.LEGENDRE_FAILURE


def test_a_closed_curve_is_recognised():
    # a circle through (0, 0, 1) with unit speed, in a plain inner product
    problem = SimpleNamespace(norm=np.linalg.norm)

    def at(angle):
        tangent = np.array([0.0, np.cos(angle), -np.sin(angle)])
        return SimpleNamespace(z=np.array([0.0, np.sin(angle), np.cos(angle)]), tangent=tangent, dual=tangent, sigma=angle)

    start, angles = at(0.0), np.arange(0.0, 7.0, 0.3)
    passed = [Segment(problem, at(a), at(b)).passes(start) for a, b in pairwise(angles)]
    assert np.flatnonzero(passed).tolist() == [20]  # 6.0 to 6.3, around 2 pi


# --- refusals


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"parameter": "source.0.strenght"}, "did you mean 'source.0.strength'"),
        ({"parameter": "source.1.strength"}, "unknown"),
        ({"parameter": "source.0.orientation"}, "unknown"),
        ({"bounds": (300.0, 400.0)}, "around 200"),
        ({"bounds": (50.0, 200.0)}, "room in direction"),
        ({"bounds": (400.0, 50.0)}, "smallest and largest"),
        ({"bounds": (50.0, np.nan)}, "finite"),
        ({"bounds": 3.0}, "two finite numbers"),
        ({"bounds": (-1.0, 400.0)}, "source.strength"),
        ({"direction": 0}, "direction"),
        ({"max_steps": 0}, "max_steps"),
        ({"ill_posed": "stpo"}, "did you mean 'stop'"),
        ({"start": 3.0}, "special point"),
        ({"parameter": "material.mu.1", "bounds": (0.001, 1.0)}, "between 0 and 0.4"),
    ],
)
def test_refusals_say_what_is_allowed(changes, message):
    start = folds(above(), "limit_point")[2]
    arguments = {"start": start, "parameter": STRENGTH, "bounds": (50.0, 1000.0), **changes}
    with pytest.raises(InputError, match=message):
        fold_curve(start.equilibrium.scene, **arguments)


def test_starts_that_are_no_fold_here_are_refused():
    start = folds(above(), "limit_point")[2]
    scene = start.equilibrium.scene
    arguments = {"parameter": STRENGTH, "bounds": (50.0, 1000.0)}
    with pytest.raises(InputError, match="kind"):
        fold_curve(scene, start=replace(start, kind="height_fold"), **arguments)
    with pytest.raises(InputError, match="unknowns"):
        fold_curve(scene.replace(mesh=fm.disc(elements=8)), start=start, **arguments)
    eq = above()[len(above()) // 3]
    with pytest.raises(SolveError, match="not near a limit_point"):
        fold_curve(scene, start=replace(start, equilibrium=eq, pressure=eq.pressure), **arguments)
    with pytest.raises(InputError, match=r"vary material\.alpha\.0"):
        fold_curve(scene.replace(material=fm.Ogden((1.0,), (2.0,))), start=start, parameter="material.mu.0", bounds=(0.5, 2.0))


def test_steps_can_be_chosen():
    start = folds(above(), "limit_point")[2]
    arguments = {"start": start, "parameter": STRENGTH, "bounds": (50.0, 1000.0)}
    coarse = fold_curve(start.equilibrium.scene, **arguments, steps=StepControl(largest=0.5, deviation=2e-3))
    assert len(coarse) < len(magnetic())
    assert coarse.pressure[-1] == pytest.approx(magnetic().pressure[-1], rel=1e-9)


def test_verdicts_along_a_curve_are_those_of_each_points_own_scene():
    start = folds(above(elements=16), "limit_point")[2]
    asked = start.equilibrium.scene.replace(analysis=fm.Analysis(azimuthal_modes=(1,)))
    end = fold_curve(asked, start=start, parameter=STRENGTH, bounds=(50.0, 400.0)).equilibria[-1]
    alone = fm.equilibrium(end.scene.replace(analysis=fm.Analysis()), volume=end.volume, start=end, solver="newton")
    assert end.number(STRENGTH) == 400.0
    expected = alone.verdict(azimuthal=1).smallest_eigenvalue
    assert end.verdict(azimuthal=1).smallest_eigenvalue == pytest.approx(expected, rel=1e-9)
