"""Traces over a number of the scene: folds against those of one scene, ends, files, restarts, and what is refused."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.errors import InputError, Status

HEIGHT, STRENGTH = "source.0.height", "source.0.strength"


def scene(strength: float = 20.0, height: float = 4.0, susceptibility: float = 1.0, **more: object) -> fm.Scene:
    sources = [fm.Dipole(strength=strength, height=height)]
    return fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), sources=sources, susceptibility=susceptibility, **more)


@cache
def approach() -> fm.Branch:
    """A magnet led towards the unloaded membrane, and away from it where the branch turns."""
    return fm.trace(scene(), over=HEIGHT, hold={"pressure": 0.0}, until={HEIGHT: 2.0, "center_height": 1.5})


def test_the_membrane_snaps_where_the_pressure_of_that_scene_is_stationary_at_zero() -> None:
    """At a held pressure the number turns where K is singular: a limit point of the scene with that number, at that pressure."""
    branch = approach()
    (turn,) = [p for p in branch.special_points or () if p.kind == "number_fold"]
    own = fm.trace(turn.equilibrium.scene, start=0.1, until={"volume": 1.2})
    assert min(abs(p.pressure) for p in own.special_points or () if p.kind == "limit_point") < 1e-10
    assert turn.pressure == 0.0
    assert turn.error < 1e-9
    heights = branch.column(HEIGHT)
    assert turn.equilibrium.number(HEIGHT) < heights.min() + 1e-3
    assert branch.status is Status.CONVERGED
    assert branch[-1].center_height == pytest.approx(1.5, abs=1e-12)


def test_every_point_is_an_equilibrium_of_its_own_scene() -> None:
    for eq in [*approach()[::5], *(p.equilibrium for p in approach().special_points or ())]:
        assert eq.pressure == 0.0
        again = fm.equilibrium(eq.scene, volume=eq.volume, start=eq, solver="newton")
        assert again.pressure == pytest.approx(0.0, abs=1e-10)
        assert again.center_height == pytest.approx(eq.center_height, rel=1e-8)


def test_verdicts_change_where_the_number_turns() -> None:
    asked = scene(analysis=fm.Analysis(stability=("pressure", "volume")))
    branch = fm.trace(asked, over=HEIGHT, hold={"pressure": 0.0}, until={HEIGHT: 2.0, "center_height": 1.0})
    words = list(branch.column("verdict_pressure"))
    turn = words.index("unstable")
    assert set(words[:turn]) == {"stable"}
    assert set(words[turn:]) == {"unstable"}
    heights = branch.column(HEIGHT)
    assert heights[turn - 1 : turn + 1].min() == heights.min()
    assert set(branch.column("verdict_volume")[: turn + 1]) == {"stable"}


def test_a_strength_that_vanishes_is_the_last_one(tmp_path: Path) -> None:
    branch = fm.trace(scene(), over=STRENGTH, hold={"volume": 0.5}, direction=-1)
    assert branch.status is Status.NO_EQUILIBRIUM
    assert "last value" in branch.message
    assert branch[-1].scene.sources[0].strength == 0.0
    plain = fm.equilibrium(fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16)), volume=0.5)
    assert branch[-1].pressure == pytest.approx(plain.pressure, rel=1e-9)


def test_the_number_is_a_column_of_tables_and_files(tmp_path: Path) -> None:
    branch = approach()
    branch.save(tmp_path / "branch.nc")
    again = fm.load(tmp_path / "branch.nc")
    assert again.over == HEIGHT
    assert again.hold == {"pressure": 0.0}
    for column in (HEIGHT, "volume", "center_height"):
        assert (again.column(column) == branch.column(column)).all()
    assert [eq.scene for eq in again] == [eq.scene for eq in branch]
    assert [p.equilibrium.scene for p in again.special_points or ()] == [p.equilibrium.scene for p in branch.special_points or ()]
    assert list(branch.to_dataframe().columns)[:3] == ["step", HEIGHT, "volume"]
    assert HEIGHT in str(branch).splitlines()[0]
    axes = again.plot()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("height of the source h/R₀", "pole height η(0)/R₀")
    assert "limit point in the number" in [text.get_text() for text in axes.get_legend().get_texts()]


def test_an_interrupted_trace_goes_on_to_the_last_bit(tmp_path: Path) -> None:
    asked = {"over": HEIGHT, "hold": {"pressure": 0.0}, "until": {HEIGHT: 2.0, "center_height": 1.5}}
    part = fm.trace(scene(), **asked, max_steps=12)
    part.save(tmp_path / "part.nc")
    whole = fm.trace(scene(), **asked, start=fm.load(tmp_path / "part.nc"))
    assert (whole.column("volume") == approach().column("volume")).all()
    assert (whole.column(HEIGHT) == approach().column(HEIGHT)).all()
    assert [p.volume for p in whole.special_points or ()] == [p.volume for p in approach().special_points or ()]
    with pytest.raises(InputError, match="a branch of this scene"):
        fm.trace(scene(), over=STRENGTH, hold={"pressure": 0.0}, start=part)
    with pytest.raises(InputError, match="a branch of this scene"):
        fm.trace(scene(), start=part)


def test_a_trace_may_start_on_a_fold_in_the_number() -> None:
    (turn,) = [p for p in approach().special_points or () if p.kind == "number_fold"]
    height = turn.equilibrium.number(HEIGHT)
    for direction in (1, -1):
        branch = fm.trace(turn.equilibrium.scene, over=HEIGHT, hold={"pressure": 0.0}, start=turn, direction=direction, max_steps=5)
        assert len(branch) == 6
        assert (branch.column(HEIGHT)[1:] > height).all()
        assert (branch[-1].volume - turn.volume) * direction > 0


def test_what_is_held_may_be_another_value_than_at_the_start() -> None:
    start = fm.equilibrium(scene(), volume=1.0)
    branch = fm.trace(scene(), over=STRENGTH, hold={"center_height": 0.3}, start=start, until={STRENGTH: 30.0})
    np.testing.assert_allclose(branch.column("center_height"), 0.3, rtol=1e-12)
    assert branch.column(STRENGTH)[[0, -1]].tolist() == [20.0, 30.0]
    assert (np.diff(branch.column("pressure")) < 0).all()  # the stronger magnet needs less help


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"over": "source.0.hight", "hold": {"pressure": 0.0}}, "did you mean 'source.0.height'"),
        ({"over": "pressure", "hold": {"volume": 1.0}}, "no number of the scene"),
        ({"over": 3, "hold": {"volume": 1.0}}, "unknown"),
        ({"over": HEIGHT}, "hold.*missing"),
        ({"hold": {"pressure": 0.0}}, "over.*unknown"),
        ({"over": HEIGHT, "hold": {HEIGHT: 0.0}}, "it is the load already"),
        ({"over": HEIGHT, "hold": {STRENGTH: 1.0}}, "held anyway"),
        ({"over": HEIGHT, "hold": {"presure": 1.0}}, "did you mean 'pressure'"),
        ({"over": HEIGHT, "hold": {"pressure": 0.0, "volume": 1.0}}, "one quantity"),
        ({"over": HEIGHT, "hold": {"pressure": "low"}}, "hold.pressure"),
        ({"over": HEIGHT, "hold": {"pressure": 0.0}, "until": {"pressure": 1.0}}, "it is held"),
        ({"over": HEIGHT, "hold": {"pressure": 0.0}, "until": {"center_hight": 1.0}}, "did you mean 'center_height'"),
        ({"over": HEIGHT, "hold": {"pressure": 0.0}, "direction": 2}, "towards larger source.0.height"),
    ],
)
def test_what_is_refused(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        fm.trace(scene(), **arguments)  # type: ignore[arg-type]


def test_a_number_without_influence_is_refused() -> None:
    with pytest.raises(InputError, match="changes no force"):
        fm.trace(scene(susceptibility=0.0), over=STRENGTH, hold={"volume": 0.5})


def test_a_trace_ends_where_the_number_has_lost_its_influence() -> None:
    """A magnet that goes away leaves a flat disc, which has no stiffness: the force falls with a power of the distance, and so does V."""
    branch = fm.trace(scene(height=6.0), over=HEIGHT, hold={"pressure": 0.0}, until={"center_height": 1.5})
    assert branch.status is Status.NO_EQUILIBRIUM
    assert "the number has no influence any more: the membrane comes to rest; try direction=-1" in branch.message
    assert len(branch) < 100
    assert branch.special_points == ()
    heights, volumes = branch.column(HEIGHT)[-2:], branch.column("volume")[-2:]
    # a flat disc resists with w^3, and a far dipole pulls with d|H|^2/dh ~ h^-7: V ~ h^(-7/3)
    assert np.diff(np.log(volumes))[0] / np.diff(np.log(heights))[0] == pytest.approx(-7 / 3, abs=0.02)
    back = fm.trace(scene(height=6.0), over=HEIGHT, hold={"pressure": 0.0}, until={"center_height": 0.5}, direction=-1)
    assert back.status is Status.CONVERGED


def test_values_of_the_number_and_of_the_height_on_the_way_to_rest_are_met() -> None:
    far = fm.trace(scene(height=6.0), over=HEIGHT, hold={"pressure": 0.0}, until={HEIGHT: 1200.0})
    low = fm.trace(scene(height=6.0), over=HEIGHT, hold={"pressure": 0.0}, until={"center_height": 1.5e-5})
    for branch in (far, low):
        assert branch.status is Status.CONVERGED
        assert branch.special_points == ()
    assert low[-1].center_height == pytest.approx(1.5e-5, rel=1e-9)


def test_a_number_fold_says_its_number() -> None:
    (turn,) = [p for p in approach().special_points or () if p.kind == "number_fold"]
    assert turn.number == turn.equilibrium.number(HEIGHT)
    assert f"kind='number_fold', {HEIGHT}={turn.number!r}, volume=" in repr(turn)
    assert "pressure=0.0" in repr(turn)


def test_a_strength_that_falls_to_nothing_ends_the_trace_and_raises_nothing() -> None:
    """The flat disc resists with w^3, so that the strength is stationary at 0 along the curve, and a corrector may step beyond."""
    branch = fm.trace(scene(height=6.0), over=STRENGTH, hold={"pressure": 0.0}, until={"center_height": 1.0}, direction=-1)
    assert branch.status in (Status.STEP_UNDERFLOW, Status.NO_EQUILIBRIUM)
    assert 0 <= branch[-1].number(STRENGTH) < 1e-9
    assert branch.special_points == ()
