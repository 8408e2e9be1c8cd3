"""Branches over a number of the scene at a held control: their folds against traces of one scene, their points against its equilibria."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.errors import SolveError
from femmembrane.potential import Family, potential_of
from femmembrane.scene.variation import Parameter, names
from femmembrane.solve.continuation import StepControl, Tracer, trace_points
from femmembrane.solve.controls import CenterHeightControl, Control, Gas, PressureControl, VolumeControl
from femmembrane.solve.newton import relative_residual
from femmembrane.solve.number_curve import NUMBER, TURN, ControlledProblem, NumberPoint, first_controlled
from femmembrane.solve.segment import Located, Segment
from femmembrane.solve.special_points import branch_point
from femmembrane.solve.state import Predictor
from tests.cases import OGDEN, disc_scene
from tests.solve.test_switching import sphere

SCENE = disc_scene(OGDEN, (200.0, 6.5), elements=16)
STRENGTH = Parameter(SCENE, "source.0.strength")
BOUNDS = (50.0, 3000.0)


@cache
def family() -> Family:
    return Family(SCENE, STRENGTH.vary)


@cache
def start(volume: float) -> fm.Equilibrium:
    return fm.equilibrium(SCENE, volume=volume, solver="newton")


def branch(control: Control, volume: float, direction: int = 1, most: int = 80) -> list[Segment[NumberPoint]]:
    """Segments of the branch through an equilibrium at a volume, up to a bound of the number."""
    problem = ControlledProblem(family(), control, BOUNDS[1] - BOUNDS[0], BOUNDS)
    eq, steps = start(volume), StepControl()
    point = first_controlled(problem, eq.state, eq.pressure, STRENGTH.value, direction)
    segments: list[Segment[NumberPoint]] = []
    for _, new in zip(range(most), trace_points(problem, point, Tracer(Predictor(), steps.first, steps)), strict=False):
        segments.append(Segment(problem, point, new))
        point = new
        if point.number in BOUNDS:
            break
    return segments


def out_of_balance(point: NumberPoint) -> float:
    """Relative residual of a point in the potential of its own scene, built without the family."""
    potential, state = potential_of(STRENGTH.scene_at(point.number)), point.state
    evaluation = potential.evaluate(state.x, state.pressure)
    return relative_residual(potential, evaluation.gradient - state.pressure * evaluation.volume_gradient, evaluation, state.pressure)


@pytest.mark.parametrize("name", names(SCENE))
def test_the_derivative_with_respect_to_the_number(name: str) -> None:
    parameter = Parameter(SCENE, name)
    members, m = Family(SCENE, parameter.vary), parameter.value
    x = start(49.0).state

    def force(number: float) -> np.ndarray:
        evaluation = members.evaluate(x, 1.7, number)
        return evaluation.gradient - 1.7 * evaluation.volume_gradient

    h = 1e-4 * abs(m)
    expected = (force(m + h) - force(m - h)) / (2 * h)
    np.testing.assert_allclose(members.number_derivative(x, 1.7, m), expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(("held", "volume", "kind"), [("pressure", 49.0, "limit_point"), ("volume", 80.0, "volume_fold")])
def test_where_the_number_turns_the_held_quantity_turns_at_that_number(held: str, volume: float, kind: str) -> None:
    """On the surface of all (x, P, m) both are points at which the equations at a fixed number are singular under the control."""
    control = PressureControl(start(volume).pressure) if held == "pressure" else VolumeControl(volume)
    segments = branch(control, volume)
    (turn,) = [turn for segment in segments for turn in segment.folds(TURN)]
    scene = STRENGTH.scene_at(turn.point.number)
    points = fm.trace(scene, start=0.5, until={"center_height": 6.0}).special_points or ()
    fold = min((p for p in points if p.kind == kind), key=lambda p: abs(p.volume - turn.point.state.volume))
    assert getattr(fold, held) == pytest.approx(turn.point.value(held), rel=1e-10)
    assert fold.volume == pytest.approx(turn.point.state.volume, rel=1e-9)
    assert turn.error < 1e-10
    assert kind not in segments[0].problem.folds
    # the branch comes back to where it set out from on its other sheet, and ends exactly on a bound
    assert segments[-1].b.number == BOUNDS[0]
    (other,) = [point for segment in segments for point in segment.crossings(NUMBER, STRENGTH.value)]
    assert other.number == STRENGTH.value
    assert out_of_balance(other) < 1e-10
    assert abs(other.value("center_height") - start(volume).center_height) > 0.01


def test_every_control_is_held_and_every_point_is_an_equilibrium_of_its_own_scene() -> None:
    eq = start(20.0)
    gas = Gas(1.0, chamber=5.0)
    controls = {
        "pressure": PressureControl(eq.pressure),
        "volume": VolumeControl(20.0),
        "center_height": CenterHeightControl(eq.center_height),
        "gas": gas.at(eq.pressure * (20.0 + gas.chamber)),
    }
    for name, control in controls.items():
        for direction in (1, -1):
            end = branch(control, 20.0, direction)[-1].b
            assert end.number in BOUNDS
            held = end.state.value_of(control) - control.amount if isinstance(control, Gas) else end.value(name) - getattr(eq, name)
            assert held == pytest.approx(0.0, abs=1e-10)
            assert out_of_balance(end) < 1e-10


def test_another_branch_crosses_where_it_does_in_the_scene_of_that_number() -> None:
    """Balloons that hold V = 25 lose their round shape at some modulus; for that modulus pears branch off at V = 25."""
    balloon = sphere()
    modulus = Parameter(balloon, "material.mu.0")
    low, high = 0.96 * modulus.value, 1.04 * modulus.value
    problem = ControlledProblem(Family(balloon, modulus.vary), VolumeControl(25.0), high - low, (low, high))
    eq = fm.trace(balloon, start=20.0, until={"volume": 25.0}, special_points=False)[-1]
    point = first_controlled(problem, eq.state, eq.pressure, modulus.value, -1)
    found: list[Located[NumberPoint]] = []
    for _, new in zip(range(30), trace_points(problem, point, Tracer(Predictor(), 0.02, StepControl(largest=0.1))), strict=False):
        crossing = branch_point(Segment(problem, point, new))
        found += [crossing] if crossing else []
        point = new
        if point.number == low:
            break
    (met,) = found
    assert met.kind == "branch_point"
    scene = modulus.scene_at(met.point.number)
    pears = [p for p in fm.trace(scene, start=20.0, until={"volume": 30.0}).special_points or () if p.kind == "branch_point"]
    assert [p.volume for p in pears] == pytest.approx([25.0], rel=1e-6)
    assert met.error < 1e-5


def test_a_quantity_takes_a_value_along_the_branch() -> None:
    segments = branch(PressureControl(start(49.0).pressure), 49.0)
    (met,) = [point for segment in segments for point in segment.crossings("volume", 52.0)]
    assert met.state.volume == pytest.approx(52.0, rel=1e-13)
    own = fm.equilibrium(STRENGTH.scene_at(met.number), volume=52.0, solver="newton")
    assert own.pressure == pytest.approx(start(49.0).pressure, rel=1e-8)


def test_a_start_that_is_no_equilibrium_is_refused() -> None:
    eq = start(49.0)
    problem = ControlledProblem(family(), PressureControl(40.0 * eq.pressure), 1000.0, BOUNDS)
    with pytest.raises(SolveError, match="not near an equilibrium"):
        first_controlled(problem, eq.state, eq.pressure, STRENGTH.value, 1)
