"""Branches by arc length: folds, restarts, ends, and what may not pass silently."""

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.potential import potential_of
from femmembrane.solve.branch import BranchProblem
from femmembrane.solve.segment import Segment
from femmembrane.solve.state import inner
from tests.cases import OGDEN, SCENES, SPECIAL_POINTS, disc_scene

#: name of a scene in tests/data/disc.json -> where a trace starts (a volume) and which pole height it reaches
TRACES = {"neo_hookean_disc": (0.5, 4.0), "ogden_disc": (0.5, 5.0), "dipole_above": (0.5, 5.2), "dipole_below": (0.42, 4.0)}


def traced(name: str, elements: int = 64, degree: int = 2) -> fm.Branch:
    start, height = TRACES[name]
    scene = SCENES[name].replace(mesh=fm.disc(elements=elements), degree=degree)
    return fm.trace(scene, start=start, until={"center_height": height})


@pytest.mark.parametrize("name", TRACES)
def test_special_points(name):
    """Every limit point and volume fold of the reference, each once, in order; nothing else is found.

    P and V to 1e-6; the pole height of a fold is the quantity that moves fastest there: 2.5e-6 at worst with 64 quadratic elements
    (dipole_above's volume fold, measured on 2026-11-22), below 1e-6 with 128.
    """
    branch = traced(name)
    expected = SPECIAL_POINTS[name]
    assert [p.kind for p in branch.special_points] == [p["kind"] for p in expected]
    for found, exact in zip(branch.special_points, expected, strict=True):
        assert found.pressure == pytest.approx(exact["pressure"], rel=1e-6)
        assert found.volume == pytest.approx(exact["volume"], rel=1e-6)
        assert found.center_height == pytest.approx(exact["center_height"], rel=3e-6)
        assert found.error < 1e-8
        assert found.equilibrium.residual < 1e-10


def test_special_points_converge():
    """At order 4 (P2) in V of the volume fold, over 64, 128, 256 elements."""
    exact = SPECIAL_POINTS["dipole_above"][-1]
    errors = []
    for elements in (64, 128, 256):
        fold = traced("dipole_above", elements).special_points[-1]
        errors.append(abs(fold.volume / exact["volume"] - 1))
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all(np.abs(orders - 4) < 0.3), (errors, orders)
    assert errors[0] < 2e-7


def test_steps_do_not_depend_on_the_mesh():
    """The same arc length means the same number of steps on every mesh."""
    counts = [len(traced("dipole_above", elements)) for elements in (16, 64, 256)]
    assert max(counts) - min(counts) <= 0.02 * min(counts), counts


def test_until_is_met_exactly():
    scene = disc_scene(OGDEN, elements=16)
    assert fm.trace(scene, start=0.5, until={"center_height": 2.0})[-1].center_height == pytest.approx(2.0, rel=1e-14, abs=0)
    assert fm.trace(scene, start=0.5, until={"volume": 7.0})[-1].volume == pytest.approx(7.0, rel=1e-13, abs=0)
    assert fm.trace(scene, start=0.5, until={"pressure": 1.6})[-1].pressure == 1.6
    first = fm.trace(scene, start=0.5, until={"volume": 7.0, "pressure": 1.6})
    assert first[-1].pressure == 1.6  # met before the volume


@pytest.mark.parametrize("mesh", [fm.disc(elements=6), fm.cylinder(0.4, elements=6)])
def test_arc_length_is_measured_in_one_band(mesh):
    """The inner product of (x, P) is that of displacements over the area plus the pressures, in units of a membrane of any size."""
    potential, random = potential_of(fm.Scene(material=OGDEN, mesh=mesh, degree=3)), np.random.default_rng(1)
    problem, (a, b) = BranchProblem(potential), random.standard_normal((2, potential.space.n_free + 1))
    expected = inner(potential, a[:-1], a[-1], b[:-1], b[-1])
    assert problem.dual(a) @ b == pytest.approx(expected, rel=1e-12)
    assert problem.norm(a) ** 2 == pytest.approx(inner(potential, a[:-1], a[-1], a[:-1], a[-1]), rel=1e-12)


def test_points_between_two_equilibria_are_foretold(monkeypatch):
    """Folds and the end, to round-off those of Brent's method alone, after two thirds of the corrections or fewer."""
    resolve, spent = BranchProblem.resolve, []

    def counted(*args):
        spent.append(args)
        return resolve(*args)

    monkeypatch.setattr(BranchProblem, "resolve", counted)
    scene = disc_scene(OGDEN, (200.0, 6.5), elements=16)
    found = fm.trace(scene, start=0.5, until={"volume": 60.0})
    few = len(spent)
    monkeypatch.setattr(Segment, "_by_secants", lambda *_: None)
    monkeypatch.setattr(Segment, "_share_of", lambda *_: None)
    expected = fm.trace(scene, start=0.5, until={"volume": 60.0})
    assert 0 < 3 * few <= 2 * (len(spent) - few)
    assert [p.kind for p in found.special_points] == [p.kind for p in expected.special_points] != []
    for a, b in zip([*found.special_points, found[-1]], [*expected.special_points, expected[-1]], strict=True):
        assert (a.volume, a.pressure, a.center_height) == pytest.approx((b.volume, b.pressure, b.center_height), rel=1e-11)


def test_a_branch_is_an_iterator_while_it_runs():
    """Stopped by the loop that looks at it; the same points as the whole trace."""
    scene = disc_scene(OGDEN, elements=16)
    seen = []
    for eq in fm.trace_iter(scene, start=0.5):
        seen.append(eq)
        if eq.pressure < seen[max(len(seen) - 2, 0)].pressure:  # past the first limit point
            break
    whole = fm.trace(scene, start=0.5, until={"volume": seen[-1].volume + 1.0})
    assert [eq.pressure for eq in seen] == [eq.pressure for eq in whole[: len(seen)]]
    assert len(list(fm.trace_iter(scene, start=0.5, max_steps=5))) == 6


def test_direction_and_start():
    scene = disc_scene(OGDEN, elements=16)
    there = fm.trace(scene, start=0.5, until={"volume": 4.0})
    back = fm.trace(scene, start=there[-1], until={"volume": 0.5}, direction=-1)
    assert back[-1].pressure == pytest.approx(there[0].pressure, rel=1e-9)
    assert [p.kind for p in back.special_points] == ["limit_point"]
    assert back.special_points[0].volume == pytest.approx(there.special_points[0].volume, rel=1e-9)


def test_a_continued_trace_is_the_uninterrupted_one_to_the_last_bit(tmp_path):
    scene = disc_scene(OGDEN, (200.0, 6.5), elements=16)
    whole = fm.trace(scene, start=0.5, until={"volume": 30.0})
    half = fm.trace(scene, start=0.5, until={"volume": 30.0}, max_steps=8, throw=False)
    assert half.status is fm.Status.STEP_LIMIT
    half.save(tmp_path / "half.nc")
    for earlier in (half, fm.load(tmp_path / "half.nc")):
        rest = fm.trace(scene, start=earlier, until={"volume": 30.0})
        assert len(rest) == len(whole)
        for one, other in zip(whole, rest, strict=True):
            assert one.pressure == other.pressure
            assert one.state.tobytes() == other.state.tobytes()
        assert [p.volume for p in rest.special_points] == [p.volume for p in whole.special_points]


def test_trace_through_sharp_turns_below_a_strong_dipole():
    """M = 600, h = -3.5 down to pole height -0.5: V/(2 pi) has local extremes 0.0333 and 0.0514 (recorded on 2026-11-22)."""
    scene = disc_scene(OGDEN, (600.0, -3.5), elements=64)
    branch = fm.trace(scene, start=fm.equilibrium(scene, center_height=1.0), until={"center_height": -0.5}, direction=-1)
    folds = [p.volume / (2 * np.pi) for p in branch.special_points if p.kind == "volume_fold"]
    assert folds == pytest.approx([0.0333, 0.0514], abs=1e-4)
    assert sum(p.kind == "limit_point" for p in branch.special_points) == 4
    assert branch[-1].center_height == pytest.approx(-0.5, rel=1e-12)


def test_trace_stops_where_the_legendre_condition_fails():
    """M = 600, h = -3.25: compression sets in near pole height 0.32 at r of about 0.74 (0.323 under refinement, recorded on 2026-11-22)."""
    scene = disc_scene(OGDEN, (600.0, -3.25), elements=32, degree=4)
    branch = fm.trace(scene, start=2.1, until={"center_height": 0.0}, direction=-1, throw=False)
    assert branch.status is fm.Status.LEGENDRE_FAILURE
    assert "compressive at r" in branch.message
    last = branch[-1]
    assert last.status is fm.Status.LEGENDRE_FAILURE
    assert 0.30 < last.center_height < 0.335
    # states depend on the mesh there: none is found on finer elements, which could confirm what this mesh shows
    assert last.verdict("volume").stable is None
    assert last.verdict("volume").reason.startswith("not confirmed: short-wave unstable")
    assert np.isnan(last.verdict("volume").smallest_eigenvalue)
    assert all(eq.status is fm.Status.CONVERGED for eq in branch[:-1])
    with pytest.raises(fm.SolveError, match="Legendre") as raised:
        fm.trace(scene, start=2.1, until={"center_height": 0.0}, direction=-1, throw=True)
    assert len(raised.value.result) == len(branch)


def test_compression_can_be_marked_instead():
    """At pole heights from 0.32 to 0.235; what 16 quadratic elements show from 0.353 on, 16 of degree 3 and 4 do not."""
    scene = disc_scene(OGDEN, (600.0, -3.25), elements=16)
    branch = fm.trace(scene, start=fm.equilibrium(scene, center_height=0.4), direction=-1, max_steps=30, ill_posed="mark", throw=False)
    marks = [eq.status is fm.Status.LEGENDRE_FAILURE for eq in branch]
    assert any(marks)
    assert all(eq.center_height < 0.33 for eq, mark in zip(branch, marks, strict=True) if mark)


def test_a_change_of_inertia_that_is_not_explained_is_reported(monkeypatch):
    """With the search for folds switched off, the trace over a limit point may not end as if nothing had been there."""
    monkeypatch.setattr(Segment, "folds", lambda self, kind: [])
    branch = fm.trace(disc_scene(OGDEN, elements=16), start=1.0, until={"volume": 5.0}, throw=False)
    assert branch.status is fm.Status.UNEXPLAINED_INERTIA
    assert "inertia" in branch.message
    assert "V = " in branch.message


def test_azimuthal_onsets():
    """Below M = 600 at h = -3.5 modes n = 1, 2, 3 lose stability one after the other: n = 1 before pole height 0.3, where the reference
    value is -0.4922; pole heights 0.31200, 0.27851, 0.25269 recorded on 2026-11-22."""
    scene = disc_scene(OGDEN, (600.0, -3.5), elements=32).replace(analysis=fm.Analysis(azimuthal_modes=(1, 2, 3)))
    branch = fm.trace(scene, start=fm.equilibrium(scene, center_height=0.4), until={"center_height": 0.24}, direction=-1)
    onsets = {p.azimuthal: p for p in branch.special_points if p.kind == "azimuthal_onset"}
    assert {n: p.center_height for n, p in onsets.items()} == pytest.approx({1: 0.31200, 2: 0.27851, 3: 0.25269}, abs=2e-5)
    for n, point in onsets.items():
        assert point.equilibrium.verdict(azimuthal=n).stable is None
    assert branch[-1].verdict(azimuthal=1).stable is False


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({"until": {"hight": 1.0}}, "until"),
        ({"until": {"volume": float("nan")}}, "until.volume"),
        ({"direction": 0}, "direction"),
        ({"max_steps": 0}, "max_steps"),
        ({"start": "0.5"}, "start"),
        ({"ill_posed": "ignore"}, "ill_posed"),
    ],
)
def test_bad_arguments_are_named(arguments, key):
    with pytest.raises(fm.InputError) as raised:
        fm.trace(disc_scene(OGDEN, elements=4), **arguments)
    assert raised.value.key == key


def test_a_trace_that_sets_out_the_wrong_way_says_so():
    """It left the volume that it was to end at behind; the advice is right."""
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8))
    wrong = fm.trace(scene, start=1.0, until={"volume": 0.5}, max_steps=5, special_points=False)
    assert "it set out from volume 1, away from 0.5: direction = -1 sets out the other way" in wrong.message
    right = fm.trace(scene, start=1.0, until={"volume": 0.5}, max_steps=50, special_points=False, direction=-1)
    assert (right.status, right[-1].volume) == (fm.Status.CONVERGED, pytest.approx(0.5, rel=1e-12))
    short = fm.trace(scene, start=1.0, until={"volume": 50.0}, max_steps=5, special_points=False)
    assert "direction" not in short.message


def test_an_equilibrium_beyond_the_limit_point_names_it():
    """As a run by pressures does. The limit point of the neo-Hookean disc is P = 1.8786 (reference/disc.json: 1.8792 with 16 elements)."""
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16))
    limit = fm.trace(scene, start=2.0, until={"volume": 4.0}).special_points[0]
    for pressure in (5.0, -5.0):
        with pytest.raises(fm.SolveError, match=f"the limit point is P = {np.copysign(limit.pressure, pressure):.6g}"):
            fm.equilibrium(scene, pressure=pressure)


def test_a_value_out_of_reach_is_said_in_its_unit_and_with_the_maximum_before_it():
    """By hand: mu T/R0 = 8 kPa, R0^3 = 15.625 ml. The pressure of a neo-Hookean disc falls to 0 behind its limit point."""
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8), scales=fm.Scales(radius=0.025, thickness=5e-4, shear_modulus=4e5))
    until = {"pressure": 7.5}
    branch = fm.trace(scene, start=1.0, until=until, max_steps=40)
    top = branch.special_points[0]
    said = f"without meeting pressure 7.5 (60 kPa); the pressure has a maximum of {top.pressure:.6g} ({8 * top.pressure:.4g} kPa)"
    assert branch.message == f"40 steps were made {said} at a limit point, and falls since"
    assert "the pressure has a maximum near" in fm.trace(scene, start=1.0, until=until, max_steps=40, special_points=False).message
    short = fm.trace(scene.replace(scales=None), start=1.0, until=until, max_steps=3)
    assert short.message == "3 steps were made without meeting pressure 7.5"
    one_ahead = fm.trace(scene, start=1.0, until={**until, "volume": 1e3}, max_steps=40)
    assert "maximum" not in one_ahead.message
