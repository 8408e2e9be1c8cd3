"""A branch is a curve: it lies on a finer trace of itself, special points lie on it, and snaps are level."""

from __future__ import annotations

import copy
import dataclasses
import pickle
from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.results.curve import CLOSE

DEMOS = Path(__file__).parents[2] / "demos"
OGDEN = fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0))
SCENE = fm.Scene(material=OGDEN, mesh=fm.disc(16))
PLACES = ("volume", "pressure", "center_height")


def drawn(branch: fm.Branch, names: tuple[str, ...] = PLACES) -> np.ndarray:
    lines = branch.curve.lines(names)
    return np.concatenate([lines[id(piece)] for run in branch.curve.runs for piece in run])


def distance(points: np.ndarray, line: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """From points to a polygon, each quantity relative to its scale."""
    p, a, b = points[:, None] / scale, line[None, :-1] / scale, line[None, 1:] / scale
    along = b - a
    square = np.maximum((along**2).sum(axis=2), 1e-300)
    share = np.clip(((p - a) * along).sum(axis=2) / square, 0, 1)
    return np.linalg.norm(p - a - share[..., None] * along, axis=2).min(axis=1)


@pytest.mark.parametrize("count", [8, 25])
def test_the_curve_lies_on_a_branch_traced_ten_times_finer(count: int) -> None:
    """Drawn from few equilibria: also where they pass the limit point in one step."""
    coarse = fm.inflate(SCENE, volumes=np.linspace(0.5, 40.0, count), solver="newton")
    fine = fm.inflate(SCENE, volumes=np.geomspace(0.5, 40.0, 10 * count), solver="newton")
    points = np.stack([fine.volume, fine.pressure, fine.center_height], axis=1)
    off = distance(points, drawn(coarse), np.ptp(points, axis=0))
    assert off.max() < 10 * CLOSE  # the middle of an arc is measured; corners of the drawn polygon add as much
    corners = distance(points, np.stack([coarse.volume, coarse.pressure, coarse.center_height], axis=1), np.ptp(points, axis=0))
    assert corners.max() > 10 * off.max()


def test_the_peak_of_the_main_picture() -> None:
    """The limit point of the README's scene is P = 1.8946 (its trace); straight lines between the 60 steps ended at 1.861."""
    scene = fm.Scene.from_toml(DEMOS / "dipole-above.toml")
    branch = fm.inflate(scene, volumes=scene.run.loads()[:4], solver="newton")
    axes = branch.plot()
    line = np.concatenate([line.get_xydata() for line in axes.lines if line.get_label().startswith("stable")])
    limit = fm.trace(scene, start=2.0, until={"volume": 3.0}).special_points[0]
    assert branch.pressure.max() < 1.87
    assert line[:, 1].max() == pytest.approx(limit.pressure, abs=1e-4)
    assert axes.lines[0].get_xydata()[-1] == pytest.approx((limit.volume, limit.pressure), rel=1e-2)  # the style changes there


def test_special_points_lie_on_the_curve() -> None:
    branch = fm.trace(SCENE, start=0.5, until={"volume": 40.0}, steps=fm.StepControl(first=0.3, deviation=0.05, turn=1.0))
    points = {tuple(getattr(p, name) for name in PLACES) for p in branch.special_points}
    assert {p.kind for p in branch.special_points} == {"limit_point"}
    assert points <= {tuple(row) for row in drawn(branch).tolist()}
    assert {tuple(getattr(e, name) for name in PLACES) for e in branch} <= {tuple(row) for row in drawn(branch).tolist()}


def test_tangents_are_the_derivatives() -> None:
    """dP/dV along the curve against the difference of two equilibria close by, and at the pole dh/dV."""
    branch = fm.inflate(SCENE, volumes=[1.0 - 1e-4, 1.0, 1.0 + 1e-4], solver="newton")
    _, middle, _ = [piece.a.node.direction for piece in (*branch.curve.runs[0], branch.curve.runs[0][-1])]
    before, _, after = branch
    volume, pressure, height = middle.rates
    assert pressure / volume == pytest.approx((after.pressure - before.pressure) / 2e-4, rel=1e-6)
    assert height / volume == pytest.approx((after.center_height - before.center_height) / 2e-4, rel=1e-6)


def test_snaps_are_level() -> None:
    """At the pressure of the limit point the arrow leads to the state that a run to this pressure finds."""
    branch = fm.pressurize(SCENE, pressures=[1.0, 1.7, 2.2, 2.6], at_limit="jump")
    (jump,) = branch.jumps
    (arrow,) = branch.plot().texts
    assert arrow.xyann == (jump.limit.volume, jump.limit.pressure)
    assert arrow.xy[1] == pytest.approx(jump.limit.pressure, abs=1e-12)
    there = fm.equilibrium(SCENE, pressure=jump.limit.pressure, start=branch[-1], solver="newton")
    assert arrow.xy[0] == pytest.approx(there.volume, rel=1e-6)
    assert [p.held for p in branch.jumps] == ["pressure"]
    assert [(j.index, j.landing.volume) for j in branch[1:].jumps] == [(1, branch[2].volume)]


def test_a_saved_branch_is_drawn_the_same(tmp_path: Path) -> None:
    branch = fm.pressurize(SCENE, pressures=[1.0, 1.7, 2.2, 2.6], at_limit="jump")
    branch.save(tmp_path / "branch.nc")
    again = fm.load(tmp_path / "branch.nc")
    assert again.jumps[0].held == "pressure"
    np.testing.assert_array_equal(drawn(again), drawn(branch))


def test_a_gap_that_nothing_is_known_of_is_drawn_as_one() -> None:
    """The second state is none of this scene: no curve is made up between them."""
    branch = fm.inflate(SCENE, volumes=[1.0, 30.0], solver="newton")
    other = fm.equilibrium(SCENE.replace(material=fm.NeoHookean()), volume=30.0)
    wrong = dataclasses.replace(other, scene=SCENE, _answers={})
    broken = dataclasses.replace(branch, equilibria=(branch[0], wrong))
    assert [piece.resolved for run in broken.curve.runs for piece in run] == [False]
    assert "not resolved between steps" in [line.get_label() for line in broken.plot().lines]
    with pytest.raises(fm.InputError, match="not resolved"):
        broken.at(pressure=(branch[0].pressure + wrong.pressure) / 2)


@pytest.mark.parametrize("place", PLACES)
def test_states_between(place: str) -> None:
    """An interpolated state has the value that was asked for, and is near the one that is solved for."""
    branch = fm.inflate(SCENE, volumes=np.linspace(0.5, 2.0, 7), solver="newton")
    value = (getattr(branch[2], place) + getattr(branch[3], place)) / 2
    between, solved = (branch.at(**{place: value}, refine=refine) for refine in (False, True))
    assert getattr(between, place) == pytest.approx(value, rel=1e-12)
    assert getattr(solved, place) == pytest.approx(value, rel=1e-12)
    assert (between.status, solved.status) == (fm.Status.INTERPOLATED, fm.Status.CONVERGED)
    assert solved.residual < 1e-12 < between.residual < 1e-3
    for name in PLACES:
        assert getattr(between, name) == pytest.approx(getattr(solved, name), rel=1e-3)
    assert branch.at(**{place: getattr(branch[3], place)}) is branch[3]


def test_a_run_too_coarse_for_cubics_is_followed() -> None:
    """From V = 0.1 to 60 in one step: the peak between them is found, by arc length, and is that of a trace."""
    branch = fm.inflate(SCENE, volumes=[0.1, 60.0], solver="newton")
    limit = fm.trace(SCENE, start=2.0, until={"volume": 4.0}).special_points[0]
    points = drawn(branch)
    assert points[:, 1].max() == pytest.approx(limit.pressure, rel=1e-3)
    assert branch.curve.added > 5
    assert len(branch) == 2  # what is computed for the drawing is no step


def test_through_the_flat_membrane_at_rest() -> None:
    """P = 3.3367 V^3 there: the curve is level where it passes, and odd."""
    branch = fm.inflate(fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16)), volumes=[-0.4, 0.0, 0.4], solver="newton")
    for volume in (-0.1, 0.1):
        between, solved = (branch.at(volume=volume, refine=refine) for refine in (False, True))
        assert solved.pressure == pytest.approx(3.3367 * volume**3, rel=0.02)
        assert between.pressure == pytest.approx(solved.pressure, abs=1e-3 * branch[-1].pressure)


def test_one_of_several_crossings() -> None:
    branch = fm.inflate(SCENE, volumes=np.linspace(0.5, 40.0, 20), solver="newton")
    found = [branch.at(pressure=1.53, refine=True, crossing=k) for k in range(3)]
    assert [round(eq.pressure, 12) for eq in found] == [1.53] * 3
    assert found[0].volume < 2.5 < found[1].volume < 22 < found[2].volume  # the two limit points lie between
    assert branch.at(pressure=1.53, crossing=-1).volume == pytest.approx(found[2].volume, rel=1e-3)
    with pytest.raises(fm.InputError, match=r"3 time\(s\)"):
        branch.at(pressure=1.53, crossing=3)
    with pytest.raises(fm.InputError, match=r"from 0\.5 to 40"):
        branch.at(volume=50.0)
    with pytest.raises(fm.InputError, match="exactly one"):
        branch.at()


def test_resampled() -> None:
    """Even in arc length, with both ends, and with both sides of a snap."""
    branch = fm.pressurize(SCENE, pressures=[1.0, 1.7, 2.2, 2.6], at_limit="jump")
    (jump,) = branch.jumps
    for refine in (False, True):
        even = branch.resample(20, refine=refine)
        assert len(even) == 20
        assert (even[0], even[-1]) == (branch[0], branch[-1])
        k = even.jumps[0].index
        assert even[k - 1].pressure == jump.limit.pressure
        assert even[k].pressure == pytest.approx(jump.limit.pressure, abs=1e-12)
        assert {str(eq.status) for eq in even} == ({"converged"} if refine else {"converged", "interpolated"})
        assert max(eq.residual for eq in even) < (1e-10 if refine else 1e-3)
    with pytest.raises(fm.InputError, match="4 or more"):
        branch.resample(3)


def test_columns_as_arrays() -> None:
    branch = fm.inflate(SCENE, volumes=[0.5, 1.0], solver="newton")
    for name in (*PLACES, "elastic_energy", "magnetic_energy"):
        np.testing.assert_array_equal(getattr(branch, name), [getattr(eq, name) for eq in branch])


def test_the_folder_of_a_run_is_loaded(tmp_path: Path) -> None:
    branch = fm.inflate(SCENE, volumes=[0.5, 1.0], solver="newton")
    branch.save(tmp_path / "branch.nc")
    assert len(fm.load(tmp_path)) == 2
    (tmp_path / "empty").mkdir()
    with pytest.raises(fm.InputError, match=r"no branch\.nc in this folder"):
        fm.load(tmp_path / "empty")


def test_over_a_number_slopes_come_from_neighbours() -> None:
    """Seven equilibria and the fold, with slopes of parabolas: four times nearer to a fine trace than straight lines."""
    height = "source.0.height"
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8), sources=[fm.Dipole(strength=20.0, height=4.0)], susceptibility=1.0)
    asked = {"over": height, "hold": {"pressure": 0.0}, "until": {height: 2.0, "center_height": 1.5}}
    coarse = fm.trace(scene, **asked, steps=fm.StepControl(first=0.3, deviation=0.05, turn=1.0))
    fine = fm.trace(scene, **asked)
    names = (height, "center_height")
    points = np.stack([fine.column(name) for name in names], axis=1)
    scale = np.ptp(points, axis=0)
    known = [(p.equilibrium.number(height), p.center_height) for p in coarse.special_points or ()]
    steps = np.stack([coarse.column(name) for name in names], axis=1)
    corners = np.array(sorted([*steps.tolist(), *known], key=lambda point: point[1]))
    line = drawn(coarse, names)
    assert len(coarse) < len(fine) / 4
    assert {tuple(p) for p in corners.tolist()} <= {tuple(p) for p in line.tolist()}
    assert distance(points, line, scale).max() < distance(points, corners, scale).max() / 4
    assert coarse.curve.added == 0
    assert coarse.plot(y="volume").get_xlabel() == "height of the source h/R₀"
    for between in (lambda: coarse.at(volume=1.0), lambda: coarse.resample(5)):
        with pytest.raises(fm.InputError, match="branches of one scene are allowed"):
            between()
    flat = dataclasses.replace(coarse, equilibria=(coarse[0],) * 3, special_points=None)
    assert flat.plot().lines  # points alone


def test_states_between_have_the_electric_energy() -> None:
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8), electric=fm.Electric(voltage=0.2))
    branch = fm.inflate(scene, volumes=[0.5, 1.0, 1.5], solver="newton")
    solved = fm.equilibrium(scene, volume=1.2)
    assert solved.electric_energy < 0
    for refine in (False, True):
        assert branch.at(volume=1.2, refine=refine).electric_energy == pytest.approx(solved.electric_energy, rel=1e-4)


def test_a_branch_that_was_drawn_goes_to_other_processes() -> None:
    branch = fm.trace(SCENE, start=0.5, until={"center_height": 1.0})
    between = branch.at(volume=0.8)
    for copied in (pickle.loads(pickle.dumps(branch)), copy.deepcopy(branch)):
        assert copied.at(volume=0.8).pressure == between.pressure


def test_an_equilibrium_that_was_asked_for_contact_is_copied() -> None:
    eq = fm.equilibrium(fm.Scene(fm.NeoHookean(), fm.disc(12), obstacles=[fm.Plane(0.5, "below")]), volume=1.2)
    assert eq.contact is not None
    copied = pickle.loads(pickle.dumps(eq)).contact
    assert (copied.radius, copied.force) == (eq.contact.radius, eq.contact.force)
