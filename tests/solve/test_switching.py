"""Branches that cross others: switching at branch points, and where asymmetry leaves none."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.potential import Potential, potential_of
from femmembrane.solve import switching
from femmembrane.solve.branch import BranchProblem, oriented_point
from femmembrane.solve.continuation import BranchPoint
from femmembrane.solve.segment import Located, Segment
from femmembrane.solve.switching import crossing_at, leave
from femmembrane.verbs.state_records import restore
from tests.cases import OGDEN, disc_scene

TRELOAR = fm.Ogden.treloar()
BALL = 4 * np.pi / 3


@cache
def sphere(elements: int = 16, degree: int = 3, material: fm.Ogden = TRELOAR) -> fm.Scene:
    return fm.Scene(material=material, mesh=fm.sphere(elements), degree=degree)


@cache
def round_balloon() -> fm.Branch:
    return fm.trace(sphere(), until={"volume": 75.0})


def branch_points(branch: fm.Branch) -> list[fm.SpecialPoint]:
    return [p for p in branch.special_points or () if p.kind == "branch_point"]


def tension(stretch: float) -> float:
    """Force by present length in an inflated sphere of Treloar's material: T = sum mu (l^(a-2) - l^(-2 a-2))."""
    return sum(m * (stretch ** (a - 2) - stretch ** (-2 * a - 2)) for m, a in zip(TRELOAR.mu, TRELOAR.alpha, strict=True))


def test_the_pears_are_found_at_a_volume() -> None:
    """Between the two stretches at which the tension is stationary the sphere is a saddle, and two pears, mirror images, are minima.

    E = 38.50491 and P = 0.909708 against 38.66432: computed by an independent shooting code.
    """
    found = fm.equilibria(sphere(), volume=40.0)
    assert list(found.energies) == pytest.approx([38.50491, 38.50491, 38.66432], rel=3e-7)
    assert [eq.pressure for eq in found][:2] == pytest.approx([0.909708] * 2, rel=1e-6)
    assert [eq.verdict("volume").word for eq in found] == ["stable", "stable", "unstable"]
    assert found[0].energy == pytest.approx(found[1].energy, rel=1e-12)
    assert "2 branch point(s) at which the other branch was followed" in found.searched


def test_branch_points_lie_where_the_tension_is_stationary() -> None:
    points = branch_points(round_balloon())
    assert [p.volume for p in points] == pytest.approx([23.3019, 69.0740], rel=1e-5)
    for point in points:
        stretch, h = (point.volume / BALL) ** (1 / 3), 1e-4
        assert (tension(stretch + h) - tension(stretch - h)) / (2 * h) == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("direction", [1, -1])
def test_the_other_branch_is_traced_from_a_branch_point(direction: int) -> None:
    """It sets out at the branch point, meets the sphere again at the second one, and goes on as its mirror image until it closes."""
    first, second = branch_points(round_balloon())
    branch = fm.trace(sphere(), start=first, direction=direction)
    assert branch.status is fm.Status.CLOSED
    assert "came back to the branch point" in branch.message
    assert branch[0].volume == first.volume
    assert branch[-1].volume == pytest.approx(first.volume, rel=1e-5)
    assert [p.volume for p in branch_points(branch)] == pytest.approx([second.volume, first.volume], rel=2e-5)
    for point in branch_points(branch):
        assert abs(point.volume / (first.volume if abs(point.volume - first.volume) < 1 else second.volume) - 1) <= 2 * point.error + 1e-9
    # none of it but the ends is a sphere, whose pole lies at the stretch
    away = [abs(eq.center_height / (eq.volume / BALL) ** (1 / 3) - 1) for eq in branch[1:-1]]
    assert sum(a < 1e-3 for a in away) <= 2
    rises = branch[2].center_height > (branch[2].volume / BALL) ** (1 / 3)
    assert rises == (direction == 1)


def test_both_halves_of_a_pitchfork_are_mirror_images() -> None:
    first = branch_points(round_balloon())[0]
    up, down = (fm.trace(sphere(), start=first, direction=d, until={"volume": 40.0})[-1] for d in (1, -1))
    assert up.energy == pytest.approx(down.energy, rel=1e-11)
    assert up.center_height > down.center_height + 1.0
    assert up.verdict("volume").stable
    assert up.pressure == pytest.approx(0.909708, rel=1e-6)


def test_from_the_pear_back_to_the_sphere() -> None:
    """A branch point found on the pears leads to the sphere, from which they came."""
    first = branch_points(round_balloon())[0]
    pears = fm.trace(sphere(), start=first)
    there = branch_points(pears)[0]
    round_again = fm.trace(sphere(), start=there, until={"volume": 80.0})
    sphere_there = fm.equilibrium(sphere(), volume=80.0)
    assert round_again[-1].energy == pytest.approx(sphere_there.energy, rel=1e-12)
    assert fm.trace(sphere(), start=there, direction=-1, until={"volume": 50.0})[-1].verdict("volume").stable is False


def test_a_switched_branch_is_kept_as_any_other(tmp_path) -> None:
    """Its start comes back from a file, and so does half of it, to be continued to the last bit and to the end of the loop."""
    round_balloon().save(tmp_path / "round.nc")
    first = branch_points(fm.load(tmp_path / "round.nc"))[0]
    whole = fm.trace(sphere(), start=first)
    fm.trace(sphere(), start=first, max_steps=5).save(tmp_path / "half.nc")
    rest = fm.trace(sphere(), start=fm.load(tmp_path / "half.nc"))
    assert [eq.state.tobytes() for eq in rest] == [eq.state.tobytes() for eq in whole]
    assert (rest.status, rest.message) == (whole.status, whole.message)
    assert rest.plot().lines


@cache
def tube() -> fm.Scene:
    return fm.Scene(material=TRELOAR, mesh=fm.cylinder(10.0, 64), degree=3)


@pytest.mark.parametrize("direction", [1, -1])
def test_off_centre_bulges_of_a_tube(direction: int) -> None:
    """Clamped Treloar tube of length 10, V = 160: 85.80817 off the middle against 85.85812 in it, from an independent shooting code."""
    middle = fm.trace(tube(), start=110.0, until={"volume": 160.0})
    assert middle[-1].energy == pytest.approx(85.85812, rel=5e-7)
    aside = fm.trace(tube(), start=branch_points(middle)[0], direction=direction, until={"volume": 160.0})[-1]
    assert aside.energy == pytest.approx(85.80817, rel=5e-7)
    assert aside.verdict("volume").stable
    s = np.linspace(0.0, 10.0, 11)
    assert (aside.profile(s)["rho"][2] > aside.profile(s)["rho"][8]) == (direction == -1)


@pytest.mark.slow
def test_off_centre_bulges_of_a_tube_are_found() -> None:
    found = fm.equilibria(tube(), volume=160.0)
    assert list(found.energies) == pytest.approx([85.80817, 85.80817, 85.85812], rel=5e-7)
    assert [eq.verdict("volume").word for eq in found] == ["stable", "stable", "unstable"]


def test_an_asymmetry_leaves_no_branch_point_but_all_three_bulges() -> None:
    """A weak dipole beyond one end breaks the pitchfork: the bulge drifts off the middle, and the other two form a branch of their own."""
    scene = fm.Scene(material=TRELOAR, sources=[fm.Dipole(0.1, 9.0)], susceptibility=1.0, mesh=fm.cylinder(10.0, 24), degree=4)
    found = fm.equilibria(scene, volume=160.0, max_steps=120)
    assert [eq.verdict("volume").word for eq in found] == ["stable", "stable", "unstable"]
    assert found.energies[1] - found.energies[0] == pytest.approx(4.4e-4, rel=0.1)  # twice the dipole's share in one of them
    traced = fm.trace(scene, start=80.0, until={"volume": 160.0})
    assert traced.status is fm.Status.CONVERGED
    assert not branch_points(traced)
    assert traced[-1].energy == pytest.approx(found.energies[0], rel=1e-9)


def test_two_equal_dipoles_keep_the_pitchfork_of_a_sphere() -> None:
    sources = [fm.Dipole(200.0, 6.0), fm.Dipole(200.0, -6.0)]
    scene = fm.Scene(material=TRELOAR, sources=sources, susceptibility=1.0, mesh=fm.sphere(16), degree=3)
    found = fm.equilibria(scene, volume=40.0, max_steps=80)
    assert found.energies[0] == pytest.approx(found.energies[1], rel=1e-11)
    assert found[0].pressure == pytest.approx(found[1].pressure, rel=1e-9)
    assert found.energies[2] > found.energies[1] + 0.1


def test_states_below_and_above_the_middle_of_two_equal_dipoles_come_in_pairs() -> None:
    scene = fm.Scene(material=TRELOAR, sources=[fm.Dipole(5.0, 4.0), fm.Dipole(5.0, -4.0)], susceptibility=2.5, mesh=fm.disc(16))
    found = fm.equilibria(scene, pressure=0.0, max_steps=120)
    heights = sorted(eq.center_height for eq in found)
    assert len(heights) >= 4
    assert heights == pytest.approx([-h for h in reversed(heights)], rel=1e-7)


# --- runs


def test_a_run_into_pears_says_so() -> None:
    for seek in (lambda: fm.inflate(sphere(), volumes=[10.0, 40.0]), lambda: fm.equilibrium(sphere(), volume=40.0)):
        with pytest.raises(fm.SolveError, match=r"branch point P = 1\.1055\d*, V = 23\.301.* would go to V = 40, P = 0\.909708") as raised:
            seek()
        assert raised.value.status is fm.Status.NOT_A_MINIMUM


def test_a_run_jumps_to_the_pear_and_back_to_the_sphere() -> None:
    branch = fm.inflate(sphere(), volumes=[10.0, 20.0, 24.0, 40.0, 60.0, 80.0], at_limit="jump")
    assert branch.status is fm.Status.CONVERGED
    assert all(eq.verdict("volume").stable for eq in branch)
    assert branch[3].energy == pytest.approx(38.50491, rel=3e-7)
    assert branch[-1].center_height == pytest.approx((80 / BALL) ** (1 / 3), rel=1e-5)
    first = branch.jumps[0]
    assert (first.index, first.limit.kind) == (2, "branch_point")
    assert first.limit.volume == pytest.approx(23.30189, rel=1e-6)


def test_a_cold_start_jumps_as_well() -> None:
    branch = fm.inflate(sphere(), volumes=[40.0, 45.0], at_limit="jump")
    assert branch[0].energy == pytest.approx(38.50491, rel=3e-7)
    assert [(j.index, j.limit.kind) for j in branch.jumps] == [(0, "branch_point")]


def test_a_scene_file_jumps(tmp_path) -> None:
    run = fm.Run(control="volume", values=(20.0, 40.0), at_limit="jump")
    sphere().replace(run=run).to_toml(tmp_path / "balloon.toml")
    branch = fm.run(fm.Scene.from_toml(tmp_path / "balloon.toml"))
    assert branch[-1].energy == pytest.approx(38.50491, rel=3e-7)
    branch.save(tmp_path / "run.nc")
    kept = fm.load(tmp_path / "run.nc").jumps[0].limit
    assert kept.kind == "branch_point"
    onto = fm.trace(sphere(), start=kept, until={"volume": 40.0})
    assert onto[-1].energy == pytest.approx(branch[-1].energy, rel=1e-11)


def test_newton_follows_the_saddle() -> None:
    branch = fm.inflate(sphere(), volumes=[20.0, 40.0], solver="newton", at_limit="jump")
    assert not branch.jumps
    assert branch[-1].energy == pytest.approx(38.66432, rel=3e-7)


@pytest.mark.parametrize("excess", [1e-3, 1e-2, 0.1])
@pytest.mark.parametrize(("elements", "degree"), [(16, 3), (23, 4)])
def test_no_run_slips_onto_the_pear_unnoticed(elements: int, degree: int, excess: float) -> None:
    """Just past the branch point the pear is near enough for a minimiser to end there, on some meshes and steps."""
    branch = fm.inflate(sphere(elements, degree), volumes=[15.0, 23.3019 + excess], at_limit="jump")
    assert [j.limit.kind for j in branch.jumps] == ["branch_point"]


# --- the equations


def pitchfork() -> tuple[Potential, BranchPoint]:
    """The first branch point of the sphere with the tangent of the spheres."""
    point = branch_points(round_balloon())[0]
    potential = potential_of(sphere())
    state = restore(potential, point.equilibrium)
    return potential, oriented_point(potential, state, 0.0, point.tangent)


def test_the_crossing_of_pears_is_a_pitchfork() -> None:
    potential, known = pitchfork()
    crossing = crossing_at(potential, known)
    assert crossing.pitchfork
    assert crossing.other.tangent[-1] == pytest.approx(0.0, abs=1e-6)
    assert known.dual @ crossing.known.tangent == pytest.approx(1.0, abs=1e-3)
    for direction in (1, -1):
        new = leave(potential, crossing, direction, 0.02)
        assert crossing.side(potential, new) == direction


def test_the_equation_of_a_transcritical_crossing(monkeypatch) -> None:
    """a = 0 leaves the branch along g and 2 b alpha + c beta = 0: with b = 1, c = 1/2 the second branch runs along g/4 - phi."""
    potential, known = pitchfork()
    plain = crossing_at(potential, known)
    answers = iter([(0.0, 1.0), (1.0, 1.0), (0.5, 1.0)])
    monkeypatch.setattr(switching, "_second", lambda *_: next(answers))
    crossing = crossing_at(potential, known)
    assert not crossing.pitchfork
    # of the sphere's own pitchfork phi is the other branch, g the known one
    expected = -0.25 * plain.known.tangent + plain.other.tangent
    mixed = max(expected, -0.25 * plain.known.tangent - plain.other.tangent, key=lambda v: abs(v @ crossing.other.dual))
    assert abs(mixed @ crossing.other.tangent) == pytest.approx(np.linalg.norm(mixed) * np.linalg.norm(crossing.other.tangent), rel=1e-6)
    assert crossing.other.rate("volume") > 0


@pytest.mark.parametrize("kind", ["limit_point", "azimuthal_onset"])
def test_other_special_points_as_starts(kind: str) -> None:
    scene = disc_scene(OGDEN, elements=16)
    branch = fm.trace(scene, start=0.5, until={"volume": 5.0})
    point = branch.special_points[0]
    assert point.kind == "limit_point"
    if kind == "limit_point":
        assert fm.trace(scene, start=point, until={"volume": 5.0})[-1].pressure == pytest.approx(branch[-1].pressure, rel=1e-9)
        return
    onset = fm.SpecialPoint(kind, point.volume, point.pressure, point.center_height, 0.0, point.equilibrium, azimuthal=2)
    with pytest.raises(fm.InputError, match=r"2 wave.*not computed"):
        fm.trace(scene, start=onset)


def test_a_branch_point_of_another_scene_is_refused() -> None:
    first = branch_points(round_balloon())[0]
    with pytest.raises(fm.InputError):
        fm.trace(sphere(12), start=first)
    with pytest.raises(fm.InputError, match="out of balance"):
        fm.trace(sphere().replace(material=fm.Ogden(mu=(2.0,), alpha=(1.0,))), start=first)


def test_a_first_segment_looks_for_nothing_at_its_crossing() -> None:
    potential, known = pitchfork()
    crossing = crossing_at(potential, known)
    segment = Segment(BranchProblem(potential), crossing.half(1), leave(potential, crossing, 1, 0.02), leaving=True)
    found: list[Located[BranchPoint]] = [fold for kind in ("limit_point", "volume_fold", "height_fold") for fold in segment.folds(kind)]
    assert found == []


def test_all_states_of_a_sphere_with_a_small_hole() -> None:
    """A cap 40 times as high as its rim is wide is nearly a sphere of radius 20.0125: its pears differ in energy, and no branch crosses.

    The energies of the closed sphere are 38.50491 and 38.66432 times the square of the radius at 40 times its cube.
    """
    radius = (40.0**2 + 1) / 80
    found = fm.equilibria(fm.Scene(material=TRELOAR, mesh=fm.cap(40.0, 24), degree=3), volume=40 * radius**3, max_steps=40)
    assert [eq.verdict("volume").word for eq in found] == ["stable", "stable", "unstable"]
    scaled = [energy / radius**2 for energy in found.energies]
    assert scaled == pytest.approx([38.50491, 38.50491, 38.66432], rel=2e-3)
    assert scaled[0] < 38.50491 + 0.01 < scaled[1] + 0.01
