"""Pseudo-arc-length continuation: curves of equilibria, stable or not, followed through limit points and folds.

A curve is the set of roots z of a system with one equation fewer than unknowns. Along a branch of one scene z is (x, P); along a branch
of a larger system a number of the scene is one more unknown. A :class:`CurveProblem` knows what z is, measures it and corrects predictions
onto the curve. The steps (:func:`trace_points`) and what lies between two points (:class:`.segment.Segment`) are the same for all curves.

Arc length is measured in a mesh-independent inner product of z, so that a step means the same on every mesh and in every unit of length.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Generic, TypeAlias, TypeVar, cast

from ..errors import SolveError, Status
from ..potential import Array, Potential
from .contact import coarse_at_edge
from .controls import CONTROLS, Controlled
from .newton import TOLERANCE
from .state import Predictor, State

if TYPE_CHECKING:
    from ..potential.contact import ContactEvaluation

#: steps so many times the smallest that turn on the spot have met a corner
CORNER = 100.0
#: smallest step relative to the arc length so far
ROUND_OFF = 1e-14
#: times the error of a point that a prediction from the points before may miss
_BOTH_ENDS = 10.0
#: how far a point may be from its prediction, relative to its size, where other nodes are held by bodies, or other ends of elements stand
#: at borders: the errors of the mesh change at once there, and no shorter step makes that less
_REGROUPED = 1e-3


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


#: what is looked at along a curve: one of its quantities by name, or a controlled number that is none of them, such as the amount of a gas
Followed: TypeAlias = str | Controlled


@dataclass(slots=True)
class BranchPoint:
    """A point of a curve of equilibria.

    Attributes
    ----------
    state : State
        The equilibrium.
    z : ndarray
        All unknowns: (x, P), and the number where one of the scene is unknown.
    tangent, dual : ndarray
        Unit derivative of z with respect to arc length, and the inner product with it as a row.
    sigma : float
        Arc length.
    own : ndarray or None
        The tangent on the mesh of the state, where that follows borders of contact.
    """

    state: State
    z: Array
    tangent: Array
    dual: Array
    sigma: float
    own: Array | None = field(default=None, kw_only=True)
    #: values and rates that were asked for, as two segments ask for those of the point between them
    _values: dict[Followed, float] = field(default_factory=dict, init=False, repr=False, compare=False)
    _rates: dict[Followed, float] = field(default_factory=dict, init=False, repr=False, compare=False)

    def value(self, quantity: Followed) -> float:
        """A quantity of the curve: volume, pressure or center_height by its name, or the amount of a gas."""
        if quantity not in self._values:
            self._values[quantity] = self.state.value_of(CONTROLS[quantity] if isinstance(quantity, str) else quantity)
        return self._values[quantity]

    def rate(self, quantity: Followed) -> float:
        """Derivative of a quantity with respect to arc length: zero at a fold in that quantity."""
        if quantity not in self._rates:
            self._rates[quantity] = self.rate_of(CONTROLS[quantity] if isinstance(quantity, str) else quantity)
        return self._rates[quantity]

    def rate_of(self, controlled: Controlled) -> float:
        """Derivative of a controlled number, such as the amount of a gas, with respect to arc length."""
        state, n = self.state, len(self.state.x)
        space, tangent = state.evaluation.potential.space, self.tangent if self.own is None else self.own
        return controlled.rate(space, state.pressure, state.evaluation.raw, tangent[:n], float(tangent[n]))


Point = TypeVar("Point", bound=BranchPoint)


class CurveProblem(ABC, Generic[Point]):
    """A system with one equation fewer than unknowns z, the roots of which form a curve.

    Attributes
    ----------
    potential : Potential
    folds : mapping of str to str
        Kinds of folds of the curve, and the quantity that is stationary at each.
    units : mapping of str to float
        Quantities of the curve with their units: an error is judged relative to the quantity and one unit.
    cornered : bool
        Whether the curve may have corners, which no shorter step makes round.
    moving : float
        What a prediction misses, relative to the step, since the errors of a mesh change while its ends follow borders.
    resolution : float
        Smallest change of a quantity, relative to its size, that is told from round-off; a fold within less is none.
    """

    potential: Potential
    folds: Mapping[str, str]
    cornered: bool = False
    moving: float = 0.0
    resolution: float = 0.0

    @property
    @abstractmethod
    def units(self) -> Mapping[str, float]: ...

    @abstractmethod
    def dual(self, z: Array) -> Array:
        """The mesh-independent inner product with z, as a row."""

    def unit(self, quantity: Followed) -> float:
        """The unit of a quantity."""
        return self.units[quantity] if isinstance(quantity, str) else quantity.unit(self.potential.space)

    def norm(self, z: Array) -> float:
        """Length of z in that inner product."""
        return math.sqrt(max(float(self.dual(z) @ z), 0.0))

    def predict(self, path: Predictor, point: Point, step: float) -> tuple[float, Array, Array]:
        """Length of the next step, what the path predicts there, and the row of the hyperplane through it in which it is corrected."""
        return step, path.predict(point.sigma + step), point.dual

    @abstractmethod
    def correct(self, guess: Array, row: Array, near: Point) -> tuple[Point | None, int]:
        """The point of the curve in the hyperplane row . (z - guess) = 0, oriented like a point near by, and the iterations spent.

        None where the corrector does not converge.
        """

    @abstractmethod
    def resolve(self, guess: Array, row: Array, near: Point) -> Point:
        """As :meth:`correct`, as exactly as round-off lets it be.

        Raises
        ------
        SolveError
            Where the corrector does not converge.
        """

    @abstractmethod
    def hold(self, quantity: Followed, value: float, near: Point) -> Point | None:
        """The point at which a quantity has a value exactly, corrected from one near by; None where that is singular."""

    @abstractmethod
    def determinant_sign(self, point: Point) -> int:
        """Sign of the determinant of the arc-length system, up to one factor: another curve crosses where it changes, and no fold does."""

    def forbids(self, before: Point, after: Point) -> bool:
        """Whether no curve leads from one point to the other, though a step did."""
        return False

    def mirrored(self, point: Point) -> bool:
        """Whether the curve is symmetric about a point, where quantities are stationary and nothing turns."""
        return False

    def rest_between(self, a: Point, b: Point) -> Point | None:
        """The state at rest if it lies between two points and no corrector finds it."""
        return None

    def stays(self, quantity: Followed, point: Point) -> bool:
        """Whether a quantity cannot change at a point, so that its rate of zero is no fold."""
        return False

    def place(self, point: Point) -> str:
        """Where a point is, for messages."""
        return f"V = {point.state.volume:.9g}, P = {point.state.pressure:.9g}"


@dataclass(slots=True)
class Tracer:
    """Where a trace stands: everything that its next step depends on.

    Attributes
    ----------
    path : Predictor
    step : float
    control : StepControl
    known : float
        Relative size of the last correction of the point from which the next step sets out.
    """

    path: Predictor
    step: float
    control: StepControl = field(default_factory=StepControl)
    known: float = 0.0


def trace_points(problem: CurveProblem[Point], point: Point, tracer: Tracer) -> Iterator[Point]:
    """Points of the curve beyond ``point``, one a step, for as long as the caller asks.

    Raises
    ------
    SolveError
        With status STEP_UNDERFLOW when no step of the smallest length converges.
    """
    control, path = tracer.control, tracer.path
    if not path.sigma:
        path.append(point.sigma, point.z, point.tangent)
        tracer.known = point.state.correction
    while True:
        spent = 0
        while True:
            new, iterations, quality = _attempt(problem, point, tracer)
            spent += iterations
            if new is not None:
                break
            tracer.step /= 2
            if tracer.step < max(control.smallest, ROUND_OFF * abs(point.sigma)):  # no shorter one could be told from none
                message = f"no step longer than {control.smallest:g} converges from {problem.place(point)}"
                if reason := coarse_at_edge(point.state.evaluation):
                    raise SolveError(f"{message}: {reason}", status=Status.NOT_RESOLVED)
                near = coarse_at_edge(point.state.evaluation, edges="near")
                raise SolveError(f"{message}; {near}" if near else message, status=Status.STEP_UNDERFLOW)
        new.state.iterations = spent
        tracer.known = new.state.correction
        path.append(new.sigma, new.z, new.tangent)
        tracer.step = min(max(tracer.step * min(max(quality, 0.5), 2.0), control.smallest), control.largest)
        point = new
        yield new


def _attempt(problem: CurveProblem[Point], point: Point, tracer: Tracer) -> tuple[Point | None, int, float]:
    """One step of the current length: the new point or None, iterations, and the factor for the next step."""
    control = tracer.control
    step, guess, row = problem.predict(tracer.path, point, tracer.step)
    new, iterations = problem.correct(guess, row, point)
    if new is None or problem.forbids(point, new):
        return None, iterations, 0.5
    length = max(step, control.smallest)
    miss = problem.norm(new.z - guess) / length
    known = max(tracer.known, new.state.correction)
    if known > TOLERANCE:  # along a soft direction both ends of the step are known so well only: that says nothing about it
        miss = max(miss - _BOTH_ENDS * known * problem.norm(new.z) / length, 0.0)
    if new.own is not None:
        jump = 0.0 if _held_by(point) == _held_by(new) else _REGROUPED * problem.norm(new.z) / length
        miss = max(miss - problem.moving - jump, 0.0)
    cosine = float(point.dual @ new.tangent)
    angle = math.acos(min(max(cosine, -1.0), 1.0))
    chord = problem.norm(new.z - point.z)
    # where the border of a wrinkled zone passes a point the branch has a corner
    corner = problem.cornered and step <= CORNER * control.smallest and chord <= 2 * step and cosine > 0
    if not corner and (angle > 2 * control.turn or miss > 50 * control.deviation):
        return None, iterations, 0.5
    half = angle / 2
    new.sigma = point.sigma + chord * (half / math.sin(half) if half else 1.0)  # of the circle through both points with these tangents
    return new, iterations, min((control.deviation / max(miss, 1e-12)) ** 0.25, control.turn / max(angle, 1e-12))


def _held_by(point: BranchPoint) -> tuple[bytes, tuple[int, ...]]:
    """The nodes that bodies hold, and the ends of elements that stand at borders of contact."""
    evaluation = point.state.evaluation
    held = cast("ContactEvaluation", evaluation).held.tobytes() if evaluation.potential.obstacles else b""
    return held, tuple(end for end, _ in evaluation.potential.borders)
