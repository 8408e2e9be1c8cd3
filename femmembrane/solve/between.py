"""Between two neighbouring equilibria of one branch: the cubic through both with their exact tangents, and how far the branch is from it.

The cubic of Hermite has the unknowns (x, P), the volume, the pressure and the height of the pole as functions of one parameter, the arc
length of :mod:`.branch`. Its error falls with the fourth power of the distance of the equilibria. One correction in the middle measures it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from ..errors import SolveError, Status
from ..potential import Array, Evaluation, Potential
from .banded import BandFactor, BorderedFactor
from .bare import moderate
from .branch import BranchProblem, corrected
from .continuation import StepControl, Tracer, trace_points
from .controls import CONTROLS
from .start import start_at_volume
from .state import Predictor, State, hermite, joined, rests_flat

if TYPE_CHECKING:
    from ..potential.contact import ContactPotential

#: what a node knows of its place, in this order
QUANTITIES = ("volume", "pressure", "center_height")
#: cosine between the tangent and the row that fixes its length, below which it is found once more with itself as the row
_ASLANT = 1e-3
#: share of a moderate inflation that is next to none
_SLIGHTLY = 1e-3
#: steps along a branch that is only to be found again: what lies between them is interpolated, and measured
_STRIDES, _MOST_STRIDES = StepControl(deviation=5e-3, turn=0.5), 200
#: shares of an arc at which its bend is looked at
_LOOKED_AT = (0.25, 0.5, 0.75)


@dataclass(frozen=True, eq=False, slots=True)
class Direction:
    """The unit tangent of a branch in (x, P), up to its sign, and the derivatives of volume, pressure and height along it."""

    tangent: Array
    rates: Array

    def toward(self, sign: float) -> Direction:
        """The same one, or the opposite one for a negative sign."""
        return self if sign >= 0 else Direction(-self.tangent, -self.rates)


def direction_at(potential: Potential, x: Array, pressure: float, evaluation: Evaluation | None = None) -> Direction | None:
    """The direction of the branch at an equilibrium, on the mesh of the scene; None where it has none, as at a branch point.

    Parameters
    ----------
    potential, x, pressure : Potential, ndarray, float
        The equilibrium.
    evaluation : Evaluation, optional
        That of the equilibrium, with the nodes held that bodies hold along the branch. Left out: those that they hold there.
    """
    if not x.any() and potential.flat:
        return _from_rest(potential) if rests_flat(potential) else None
    evaluation = potential.evaluate(x, pressure) if evaluation is None else evaluation
    border = evaluation.volume_gradient
    size = float(np.linalg.norm(border))
    if not (evaluation.finite and size > 0):
        return None
    problem, factor = BranchProblem(potential), BandFactor.of(evaluation)
    # dV and dP vanish together at a cusp only: one of two sums of them is a row that no other tangent is orthogonal to
    row, end = border / size, 1.0
    with np.errstate(all="ignore"):
        for _ in range(2):
            solved = joined(*BorderedFactor(factor, -border, row, end).solve(np.zeros_like(x), 1.0))
            length = problem.norm(solved)
            if not 0 < length < math.inf:
                return None
            tangent = solved / length
            if 1 / (float(np.linalg.norm(solved)) * math.hypot(float(np.linalg.norm(row)), end)) > _ASLANT:
                break
            dual = problem.dual(tangent)
            row, end = dual[:-1], float(dual[-1])
    rates = rates_along(potential, pressure, evaluation, tangent)
    if not potential.obstacles:
        return Direction(tangent, rates)
    carried = joined(evaluation.carried(tangent[:-1]), float(tangent[-1]))
    length = BranchProblem(potential.root).norm(carried)
    return Direction(carried / length, rates / length)


def directions_beside(potential: ContactPotential, x: Array, pressure: float) -> tuple[Direction | None, Direction | None]:
    """The directions of the branch where a body is touched without a force: of the side that does not touch it, and of that which does."""
    free, held = potential.beside(x, pressure)
    return direction_at(potential, x, pressure, free), direction_at(potential, x, pressure, held)


def _from_rest(potential: Potential) -> Direction | None:
    """The direction at the flat membrane at rest, which has no stiffness: that to a slightly inflated one, with P of third order."""
    try:
        state = start_at_volume(potential, _SLIGHTLY * moderate(potential))
    except SolveError:
        return None
    length = BranchProblem(potential).norm(joined(state.x, 0.0))
    rates = np.array([state.volume, 0.0, potential.space.center_height(state.x) - potential.space.first_height]) / length
    return Direction(joined(state.x, 0.0) / length, rates)


def rates_along(potential: Potential, pressure: float, evaluation: Evaluation, tangent: Array) -> Array:
    """Derivatives of the :data:`QUANTITIES` along a direction in (x, P)."""
    along = tangent[:-1], float(tangent[-1])
    return np.array([CONTROLS[name].rate(potential.space, pressure, evaluation, *along) for name in QUANTITIES])


@dataclass(frozen=True, eq=False, slots=True)
class Node:
    """A point of a branch that a cubic goes through.

    Attributes
    ----------
    z : ndarray
        Its unknowns (x, P) on the mesh of the scene.
    places : ndarray
    direction : Direction or None
        Where that is known; at a corner that of the branch up to it.
    beyond : Direction or None
        At a corner: the direction of the branch beyond it.
    corner : bool
        Whether the branch has a corner here, as where contact begins or ends.
    """

    z: Array
    places: Array
    direction: Direction | None
    beyond: Direction | None = None
    corner: bool = False

    @property
    def onward(self) -> Direction | None:
        """The direction of the branch that leaves here."""
        return self.beyond if self.corner else self.direction


@dataclass(frozen=True, eq=False, slots=True)
class Arc:
    """The cubic between two neighbouring nodes, over an arc length.

    Attributes
    ----------
    a, b : Node
    length : float
    slopes, rates : tuple of ndarray
        Derivatives with respect to arc length at both ends, of (x, P) and of the :data:`QUANTITIES`.
    resolved : bool
        Whether the branch is known to be as close as was asked for, or nothing speaks against it.
    """

    a: Node
    b: Node
    length: float
    slopes: tuple[Array, Array]
    rates: tuple[Array, Array]
    resolved: bool = True

    def unknowns(self, share: float) -> Array:
        """(x, P) at a share of the arc."""
        return hermite(self.a.z, self.slopes[0], self.b.z, self.slopes[1], share, self.length)

    def places(self, shares: Array) -> Array:
        """Volume, pressure and height at shares of the arc, shape (n, 3)."""
        return cubic(self.a.places, self.rates[0], self.b.places, self.rates[1], shares, self.length)

    def straightened(self) -> Arc:
        """A straight line between the ends, of which nothing more is known."""
        chord, rise = (self.b.z - self.a.z) / self.length, (self.b.places - self.a.places) / self.length
        return Arc(self.a, self.b, self.length, (chord, chord), (rise, rise), resolved=False)


def cubic(a: Array, slope_a: Array, b: Array, slope_b: Array, shares: Array, length: float) -> Array:
    """The cubic with given values and slopes at both ends, at shares of the length between them, shape (n, m)."""
    t = np.asarray(shares, dtype=float)[:, None]
    back = t - 1
    at_a = (1 + 2 * t) * back * back
    return at_a * a + (1 - at_a) * b + length * (t * back * back * slope_a + t * t * back * slope_b)  # type: ignore[no-any-return]


def arc_between(problem: BranchProblem, a: Node, b: Node) -> Arc:
    """The arc from one node to the next.

    Both tangents point the way that the chord goes. Where one of them is not known the arc is a parabola, where both are it is straight.
    """
    chord, rise = b.z - a.z, b.places - a.places
    dual = problem.dual(chord)
    distance = max(math.sqrt(max(float(dual @ chord), 0.0)), 1e-300)
    ends = (a.onward, b.direction)
    first, last = (None if end is None else end.toward(float(dual @ end.tangent)) for end in ends)
    if first is not None and last is not None:
        half = math.acos(min(max(float(problem.dual(first.tangent) @ last.tangent), -1.0), 1.0)) / 2
        length = distance * (half / math.sin(half) if half else 1.0)  # of the circle through both points with these tangents
        return Arc(a, b, length, (first.tangent, last.tangent), (first.rates, last.rates))
    mean, climb = chord / distance, rise / distance
    if first is not None:
        return Arc(a, b, distance, (first.tangent, 2 * mean - first.tangent), (first.rates, 2 * climb - first.rates))
    if last is not None:
        return Arc(a, b, distance, (2 * mean - last.tangent, last.tangent), (2 * climb - last.rates, last.rates))
    return Arc(a, b, distance, (mean, mean), (climb, climb))


def chord_between(a: Node, b: Node, scale: Array) -> Arc:
    """The straight line from one node to the next; its length is that of the way between their places, each relative to its scale."""
    length = max(float(np.linalg.norm((b.places - a.places) / scale)), 1e-300)
    chord, rise = (b.z - a.z) / length, (b.places - a.places) / length
    return Arc(a, b, length, (chord, chord), (rise, rise))


def rounded(arcs: Sequence[Arc]) -> list[Arc]:
    """Arcs one after the other, where nodes without a tangent take that of the parabola through them and their neighbours."""
    arcs = list(arcs)
    for k in range(len(arcs) - 1):
        before, after = arcs[k], arcs[k + 1]
        apart = before.b is not after.a or before.b.direction is not None or before.b.corner
        if apart or not min(before.length, after.length) > 0:
            continue
        share = before.length / (before.length + after.length)
        slope, rate = (
            (1 - share) * (middle - first) / before.length + share * (last - middle) / after.length
            for first, middle, last in ((before.a.z, before.b.z, after.b.z), (before.a.places, before.b.places, after.b.places))
        )
        arcs[k] = Arc(before.a, before.b, before.length, (before.slopes[0], slope), (before.rates[0], rate), before.resolved)
        arcs[k + 1] = Arc(after.a, after.b, after.length, (slope, after.slopes[1]), (rate, after.rates[1]), after.resolved)
    return arcs


def across(problem: BranchProblem, arc: Arc, share: float) -> State | None:
    """The equilibrium across an arc at a share of it; None where none is found close to it."""
    guess = arc.unknowns(share)
    if not np.isfinite(guess).all():
        return None
    chord = arc.b.z - arc.a.z
    result = corrected(problem.potential, guess, problem.dual(chord / max(problem.norm(chord), 1e-300)))
    if result.bordered is None or result.status is not Status.CONVERGED:
        return None
    off = problem.norm(joined(result.x - guess[:-1], result.pressure - float(guess[-1])))
    return State.of(result) if off <= arc.length / 2 else None


def followed(problem: BranchProblem, arc: Arc) -> list[State]:
    """Equilibria on the way from one end of an arc to the other, by arc length; none where the branch does not lead there."""
    potential, steps = problem.potential, _STRIDES
    if arc.a.onward is None or arc.b.direction is None:
        return []
    x, pressure = arc.a.z[:-1], float(arc.a.z[-1])
    start = State(x, pressure, potential.evaluate(x, pressure), 0, 0.0, 0.0, 0.0)
    end = problem.dual(arc.b.direction.tangent)
    for tangent in (arc.slopes[0], -arc.slopes[0]):
        point, found = problem.point(start, tangent), list[State]()
        tracer = Tracer(Predictor(), min(steps.first, arc.length / 8), steps)
        try:
            for new in islice(trace_points(problem, point, tracer), _MOST_STRIDES):
                before, after = float(end @ (point.z - arc.b.z)), float(end @ (new.z - arc.b.z))
                if before * after <= 0:
                    share = before / (before - after) if before != after else 0.0
                    miss = problem.norm(point.z + share * (new.z - point.z) - arc.b.z)
                    if miss < 0.2 * problem.norm(new.z - point.z):
                        return found
                found.append(new.state)
                point = new
        except SolveError:
            continue
    return []


def bend(arc: Arc, scale: Array) -> float:
    """Largest distance between an arc and its chord, relative to a scale of each quantity."""
    shares = np.array(_LOOKED_AT)
    straight = arc.a.places + shares[:, None] * (arc.b.places - arc.a.places)
    return float((np.abs(arc.places(shares) - straight) / scale).max())
