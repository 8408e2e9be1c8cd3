"""The table of controls: value, rate, equation and rest of each agree with one another."""

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.potential import potential_of
from femmembrane.scene.run import MINIMISED, PRESCRIBED
from femmembrane.solve.controls import CONTROLS, control_kind
from femmembrane.solve.start import cold_start

SCENE = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(elements=4))
ALL = {**CONTROLS, "gas": fm.Gas(amount=3.0, chamber=1.0, atmosphere=0.5)}


@pytest.fixture(scope="module")
def state():
    return fm.equilibrium(SCENE, volume=2.0, solver="newton")


@pytest.mark.parametrize("name", ALL)
def test_value_rate_and_equation_agree(name, state):
    """N(x, P) is the value minus the load, and its derivative along a direction is the rate."""
    controlled, potential = ALL[name], potential_of(SCENE)
    space, evaluation = potential.space, potential.evaluate(state.state, state.pressure)
    value = controlled.value(space, state.state, state.pressure, evaluation.volume)
    control = controlled.at(value + 0.25)
    gap, row, border = control.equation(space, state.state, state.pressure, evaluation)
    assert gap == pytest.approx(-0.25, rel=1e-12)
    direction = np.cos(np.arange(space.n_free))
    rate = controlled.rate(space, state.pressure, evaluation, direction, 0.7)
    assert rate == pytest.approx(row @ direction + 0.7 * border, rel=1e-12)


@pytest.mark.parametrize("name", CONTROLS)
def test_an_equilibrium_has_the_value_under_the_public_name(name, state):
    kind = CONTROLS[name]
    assert kind.value(potential_of(SCENE).space, state.state, state.pressure, state.volume) == pytest.approx(
        getattr(state, name), rel=1e-14
    )
    assert name in potential_of(SCENE).space.units
    assert kind.rest(potential_of(SCENE).space) == 0  # the flat disc


@pytest.mark.parametrize("name", ALL)
def test_cold_starts_hold_what_is_asked(name, state):
    potential, held = potential_of(SCENE), ALL[name]
    load = held.value(potential.space, state.state, state.pressure, state.volume)
    assert cold_start(potential, held, load).value_of(held) == pytest.approx(load, rel=1e-10)


def test_the_word_of_scene_files_is_known_beside_the_public_name(state):
    assert control_kind("height") is control_kind("center_height") is CONTROLS["center_height"]
    assert state.error_estimate("height") is state.error_estimate("center_height")
    assert state.error_estimate("height").control == "center_height"
    for wrong in ("Height", 3, None, ["height"]):
        with pytest.raises(fm.InputError, match="known: center_height, pressure, volume"):
            control_kind(wrong)


def test_scenes_and_solvers_know_the_same_controls():
    assert set(PRESCRIBED.values()) == set(CONTROLS)
    assert [name for name, kind in CONTROLS.items() if kind.minimised] == list(MINIMISED)
    assert fm.Run(control="height", values=(1.0,)).quantity == "center_height"
    assert not fm.Run(control="height", values=(1.0,)).minimised
    assert fm.Run(control="arc-length", start=1.0, until={"volume": 2.0}).quantity is None
