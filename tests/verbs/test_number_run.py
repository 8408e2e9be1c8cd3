"""Runs from value to value of a number of the scene: each state against that of its own scene, snaps, ends, and what is refused."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.errors import InputError, SolveError, Status
from tests.cases import OGDEN, disc_scene
from tests.verbs.test_number_trace import HEIGHT, STRENGTH, scene

#: a magnet below holds a balloon back, whose largest pressure without it is 1.899
BELOW = disc_scene(OGDEN, (600.0, -3.5), elements=16)


@cache
def held_back() -> fm.Equilibrium:
    return fm.equilibrium(BELOW, volume=1.2)


@pytest.mark.parametrize("hold", [{"pressure": 0.0}, {"volume": 0.4}, {"center_height": 0.2}])
def test_every_state_is_that_of_its_own_scene(hold: dict[str, float]) -> None:
    branch = fm.vary(scene(), HEIGHT, [4.0, 3.2, 2.8], hold=hold)
    assert branch.column(HEIGHT).tolist() == [4.0, 3.2, 2.8]
    assert (branch.over, dict(branch.hold)) == (HEIGHT, hold)
    for eq in branch:
        alone = fm.equilibrium(eq.scene, **hold)
        np.testing.assert_allclose(alone.state, eq.state, rtol=1e-7, atol=1e-10)
        assert alone.pressure == pytest.approx(eq.pressure, rel=1e-8, abs=1e-11)
        assert eq.residual < 1e-10


def test_it_ends_where_the_trace_turns() -> None:
    branch = fm.vary(scene(), HEIGHT, [3.0, 2.5, 2.4], hold={"pressure": 0.0}, throw=False)
    assert len(branch) == 2
    assert branch.status is Status.NO_EQUILIBRIUM
    traced = fm.trace(scene(), over=HEIGHT, hold={"pressure": 0.0}, until={HEIGHT: 2.0, "center_height": 1.0})
    (turn,) = [p for p in traced.special_points or () if p.kind == "number_fold"]
    assert f"the last value is {HEIGHT} = {turn.equilibrium.number(HEIGHT):.9g}" in branch.message
    with pytest.raises(SolveError, match="was not reached"):
        fm.vary(scene(), HEIGHT, [3.0, 2.4], hold={"pressure": 0.0})


def test_a_balloon_snaps_when_the_magnet_that_held_it_back_leaves_and_stays_when_it_returns(tmp_path: Path) -> None:
    """At P = 2 the small balloon ends at a limit point of the scene with that height; the large one is there with the magnet or without."""
    heights = [-3.5, -3.75, -4.0, -4.5, -4.0, -3.5]
    branch = fm.vary(BELOW, HEIGHT, heights, hold={"pressure": 2.0}, start=held_back(), at_limit="jump")
    (jump,) = branch.jumps
    assert jump.index == 2
    assert jump.limit is not None
    assert jump.limit.kind == "number_fold"
    assert -4.0 < jump.limit.equilibrium.number(HEIGHT) < -3.75
    own = fm.trace(jump.limit.equilibrium.scene, start=1.0, until={"volume": 4.0})
    assert min(abs(p.pressure - 2.0) for p in own.special_points or () if p.kind == "limit_point") < 1e-9
    volumes = branch.column("volume")
    assert volumes[1] < 2.0 < 80.0 < volumes[2]
    assert volumes[4] == pytest.approx(volumes[2], rel=1e-9)
    assert volumes[5] > 80.0
    large = fm.equilibrium(BELOW, pressure=2.0, start=branch[-1])
    assert large.volume == pytest.approx(volumes[5], rel=1e-9)
    branch.save(tmp_path / "branch.nc")
    again = fm.load(tmp_path / "branch.nc")
    assert again.jumps[0].limit is not None
    assert again.jumps[0].limit.equilibrium.scene == jump.limit.equilibrium.scene
    axes = again.plot()
    assert "snap" in [text.get_text() for text in axes.get_legend().get_texts()]


def test_a_balloon_that_may_not_snap_is_told_where_it_would_go() -> None:
    branch = fm.vary(BELOW, HEIGHT, [-3.75, -4.0], hold={"pressure": 2.0}, start=held_back(), throw=False)
    assert branch.status is Status.NO_EQUILIBRIUM
    assert "the membrane would jump to V = 84.6" in branch.message


def test_a_magnet_that_comes_close_meets_the_membrane() -> None:
    """Led through a membrane whose pole is held in its way, it stops at the pole."""
    branch = fm.vary(scene(strength=1e-4), HEIGHT, np.linspace(1.0, -0.9, 21), hold={"center_height": 0.3}, throw=False)
    assert branch.status is Status.DIPOLE_CONTACT
    assert branch[-1].scene.sources[0].height > 0.3


def test_what_is_refused() -> None:
    with pytest.raises(InputError, match=r"source\.strength"):
        fm.vary(scene(), STRENGTH, [1.0, -1.0], hold={"pressure": 0.0})
    with pytest.raises(InputError, match="changes no force"):
        fm.vary(scene(susceptibility=0.0), STRENGTH, [1.0, 2.0], hold={"volume": 0.5})
    with pytest.raises(InputError, match="it is the load already"):
        fm.vary(scene(), STRENGTH, [1.0, 2.0], hold={STRENGTH: 0.5})
    with pytest.raises(InputError, match="did you mean"):
        fm.vary(scene(), "source.0.strenght", [1.0, 2.0], hold={"volume": 0.5})
    with pytest.raises(InputError, match="values"):
        fm.vary(scene(), STRENGTH, ["a"], hold={"volume": 0.5})
    uniform = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8), sources=[fm.Uniform(strength=1.0)], susceptibility=1.0)
    with pytest.raises(InputError, match=r"known: .*source\.0\.strength"):
        fm.vary(uniform, HEIGHT, [1.0, 2.0], hold={"volume": 0.5})
    with pytest.raises(InputError, match="changes no force"):
        fm.vary(uniform, STRENGTH, [1.0, 2.0], hold={"volume": 0.5})


# --- scene files


def test_a_scene_file_names_the_number(tmp_path: Path) -> None:
    by_values = scene(run=fm.Run(control=HEIGHT, hold={"pressure": 0.0}, start=4.0, stop=3.0, steps=3))
    by_length = scene(run=fm.Run(control="arc-length", over=HEIGHT, hold={"pressure": 0.0}, until={HEIGHT: 3.0}))
    for asked in (by_values, by_length):
        asked.to_toml(tmp_path / "scene.toml")
        assert fm.Scene.from_toml(tmp_path / "scene.toml") == asked
        branch = fm.run(asked)
        assert branch.status is Status.CONVERGED
        assert (branch.over, dict(branch.hold)) == (HEIGHT, {"pressure": 0.0})
        assert branch.column(HEIGHT)[[0, -1]].tolist() == [4.0, 3.0]
    assert fm.run(by_values).column(HEIGHT).tolist() == [4.0, 3.5, 3.0]
    assert fm.Run(control=HEIGHT, hold={"height": 0.2}, values=(4.0,)).hold == {"center_height": 0.2}


@pytest.mark.parametrize("control", ["loads", "arc-length"])
def test_an_interrupted_run_goes_on_to_the_last_bit(control: str, tmp_path: Path) -> None:
    asked = scene(run=fm.Run(control="arc-length", over=HEIGHT, hold={"pressure": 0.0}, until={HEIGHT: 3.0}))
    if control == "loads":
        asked = scene(run=fm.Run(control=HEIGHT, hold={"pressure": 0.0}, start=4.0, stop=2.5, steps=6))
    kept: list[fm.Branch] = []

    def keep(branch: fm.Branch) -> None:
        if len(branch) == 4:
            branch.save(tmp_path / "kept.nc")
            kept.append(branch)

    whole = fm.run(asked, on_checkpoint=keep)
    assert len(kept) == 1
    again = fm.run(asked, unfinished=fm.load(tmp_path / "kept.nc"))
    for name in (HEIGHT, "volume", "pressure", "elastic_energy"):
        assert (again.column(name) == whole.column(name)).all()


@pytest.mark.parametrize(
    ("run", "message"),
    [
        ({"control": HEIGHT, "values": (1.0,)}, r"run\.hold.*missing"),
        ({"control": HEIGHT, "hold": {HEIGHT: 1.0}, "values": (1.0,)}, "it is the load already"),
        ({"control": HEIGHT, "hold": {"presure": 1.0}, "values": (1.0,)}, "did you mean 'pressure'"),
        ({"control": HEIGHT, "hold": {"gas": 1.0}, "values": (1.0,)}, r"chamber\.volume"),
        ({"control": "source.0.hight", "hold": {"pressure": 0.0}, "values": (1.0,)}, "did you mean 'source.0.height'"),
        ({"control": "arc-length", "over": "source.1.height", "hold": {"pressure": 0.0}, "until": {"volume": 1.0}}, r"run\.over"),
        ({"control": "arc-length", "over": "volume", "hold": {"pressure": 0.0}, "until": {"volume": 1.0}}, r"run\.over"),
        ({"control": "volume", "over": HEIGHT, "values": (1.0,)}, r"run\.over"),
        ({"control": "volume", "hold": {"pressure": 0.0}, "values": (1.0,)}, r"run\.hold"),
        ({"control": HEIGHT, "hold": {"pressure": 0.0}, "until": {HEIGHT: 1.0}, "values": (1.0,)}, r"run\.until"),
    ],
)
def test_what_a_scene_file_may_not_ask(run: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        scene(run=fm.Run(**run))  # type: ignore[arg-type]
