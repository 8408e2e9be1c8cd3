"""Pseudo-arc-length continuation: whole branches, stable or not, through limit points and folds.

Arc length is measured in the mesh-independent inner product of :func:`.state.inner` (mean square displacement over the reference area plus
squared pressure, both in units of the membrane's own size), so that a step means the same on every mesh and in every unit of length.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ..errors import SolveError, Status
from ..potential import Array, Potential
from .banded import BorderedFactor, band_product
from .controls import CONTROLS, ArcLengthControl, Controlled
from .newton import TOLERANCE, correct
from .state import Predictor, State, inner

#: steps so many times the smallest that turn on the spot in a tension field have met a corner
CORNER = 100.0
#: smallest step relative to the arc length so far
ROUND_OFF = 1e-14
#: times the error of a point that a prediction from the points before may miss
_BOTH_ENDS = 10.0


@dataclass(frozen=True)
class StepControl:
    """How long the steps along a branch are.

    Parameters
    ----------
    first, smallest, largest : float
        Arc length of the first step, and bounds on the length of all steps.
    deviation : float
        Distance between prediction and corrected point that steps aim at, relative to the step.
    turn : float
        Largest angle between neighbouring tangents, in radians.
    """

    first: float = 0.02
    smallest: float = 1e-7
    largest: float = 0.5
    deviation: float = 5e-4
    turn: float = 0.35


@dataclass(slots=True)
class BranchPoint:
    """A point of a branch with its unit tangent and the rates of volume, pressure and pole height along it."""

    state: State
    sigma: float
    tangent: Array
    tangent_pressure: float
    dual: Array
    dual_pressure: float

    def rate(self, quantity: str, potential: Potential) -> float:
        """Derivative of volume, pressure or center_height with respect to arc length: zero at a fold in that quantity."""
        return self.rate_of(CONTROLS[quantity], potential)

    def rate_of(self, controlled: Controlled, potential: Potential) -> float:
        """Derivative of a controlled number, such as the amount of a gas, with respect to arc length."""
        return controlled.rate(potential.space, self.state.pressure, self.state.evaluation, self.tangent, self.tangent_pressure)


@dataclass(slots=True)
class Tracer:
    """Where a trace stands: everything that its next step depends on."""

    path: Predictor
    step: float
    control: StepControl = field(default_factory=StepControl)


def first_point(potential: Potential, state: State, direction: int) -> BranchPoint:
    """The point of a state with its tangent, oriented towards larger volume for direction +1."""
    border = state.evaluation.volume_gradient
    tangent, tp = BorderedFactor(state.factor, -border, border, 0.0).solve(np.zeros_like(state.x), 1.0)
    return unit_point(potential, state, 0.0, direction * tangent, direction * tp)


def trace_points(potential: Potential, point: BranchPoint, tracer: Tracer) -> Iterator[BranchPoint]:
    """Points of the branch beyond ``point``, one a step, for as long as the caller asks.

    Raises
    ------
    SolveError
        With status STEP_UNDERFLOW when no step of the smallest length converges.
    """
    control = tracer.control
    if not tracer.path.sigma:
        tracer.path.append(point.sigma, point.state.x, point.state.pressure, point.tangent, point.tangent_pressure)
    while True:
        spent = 0
        while True:
            new, iterations, quality = _attempt(potential, point, tracer)
            spent += iterations
            if new is not None:
                break
            tracer.step /= 2
            if tracer.step < max(control.smallest, ROUND_OFF * abs(point.sigma)):  # no shorter one could be told from none
                raise SolveError(
                    f"no step longer than {control.smallest:g} converges from V = {point.state.volume:.9g}, P = {point.state.pressure:.9g}",
                    status=Status.STEP_UNDERFLOW,
                )
        new.state.iterations = spent
        tracer.path.append(new.sigma, new.state.x, new.state.pressure, new.tangent, new.tangent_pressure)
        tracer.step = min(max(tracer.step * min(max(quality, 0.5), 2.0), control.smallest), control.largest)
        point = new
        yield new


def _attempt(potential: Potential, point: BranchPoint, tracer: Tracer) -> tuple[BranchPoint | None, int, float]:
    """One step of the current length: the new point or None, iterations, and the factor for the next step."""
    control, step = tracer.control, tracer.step
    x, p = tracer.path.predict(point.sigma + step)
    result = correct(potential, ArcLengthControl(point.dual, point.dual_pressure, x, p), x, p)
    if result.status is not Status.CONVERGED:
        return None, result.iterations, 0.5
    miss = math.sqrt(max(_square(potential, result.x - x, result.pressure - p), 0.0)) / step
    if result.correction > TOLERANCE:  # along a soft direction both ends of the step are known so well only: that says nothing about it
        known = result.correction * math.sqrt(max(_square(potential, result.x, result.pressure), 0.0))
        miss = max(miss - _BOTH_ENDS * known / step, 0.0)
    state = State.of(result)
    if potential.passed_source(point.state.x, state.x):
        return None, result.iterations, 0.5
    # the border of this control is the tangent before: the corrector's last factors give the new one for a back-substitution
    new = unit_point(potential, state, point.sigma, *result.bordered.solve(np.zeros_like(state.x), 1.0)) if result.bordered else None
    if new is None:
        return None, result.iterations, 0.5
    cosine = float(point.dual @ new.tangent + point.dual_pressure * new.tangent_pressure)
    angle = math.acos(min(max(cosine, -1.0), 1.0))
    chord = math.sqrt(_square(potential, state.x - point.state.x, state.pressure - point.state.pressure))
    # where the border of a wrinkled zone passes a point the branch has a corner, which no shorter step makes round
    corner = potential.scene.tension_field and step <= CORNER * control.smallest and chord <= 2 * step and cosine > 0
    if not corner and (angle > 2 * control.turn or miss > 50 * control.deviation):
        return None, result.iterations, 0.5
    half = angle / 2
    new.sigma = point.sigma + chord * (half / math.sin(half) if half else 1.0)  # of the circle through both points with these tangents
    quality = min((control.deviation / max(miss, 1e-12)) ** 0.25, control.turn / max(angle, 1e-12))
    return new, result.iterations, quality


def oriented_point(potential: Potential, state: State, sigma: float, tangent: Array, tangent_pressure: float) -> BranchPoint:
    """The point of a state whose unit tangent is known."""
    return BranchPoint(state, sigma, tangent, tangent_pressure, *_dual(potential, tangent, tangent_pressure))


def tangent_at(potential: Potential, state: State, neighbour: BranchPoint) -> BranchPoint:
    """Unit tangent at a state, oriented like that of a neighbouring point."""
    bordered = BorderedFactor(state.factor, -state.evaluation.volume_gradient, neighbour.dual, neighbour.dual_pressure)
    tangent, tp = bordered.solve(np.zeros_like(state.x), 1.0)
    return unit_point(potential, state, neighbour.sigma, tangent, tp)


def unit_point(potential: Potential, state: State, sigma: float, tangent: Array, tp: float) -> BranchPoint:
    """The point of a state whose tangent is known up to its length."""
    size = math.sqrt(_square(potential, tangent, tp))
    return oriented_point(potential, state, sigma, tangent / size, tp / size)


def _dual(potential: Potential, tangent: Array, tangent_pressure: float) -> tuple[Array, float]:
    """What is multiplied with (x, P) in the inner product of :func:`.state.inner` with a tangent."""
    square = potential.space.unit**2
    weighed = band_product(potential.mass, potential.space.half_bandwidth, tangent)
    return weighed / (potential.area * square), tangent_pressure * square


def _square(potential: Potential, dx: Array, dp: float) -> float:
    return inner(potential, dx, dp, dx, dp)
