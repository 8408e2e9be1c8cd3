"""What lies between two neighbouring points of a curve: any point, folds, values of a quantity, and roots of functions.

The Hermite cubic through both points, with their tangents, predicts any point; a corrector in the hyperplane across it puts the point on
the curve. A fold is the root of the rate of its quantity along the curve, found by Brent's method on points that are each converged: the
rate itself, not the step, decides when it is found.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic

import numpy as np
from scipy.optimize import brentq

from ..errors import SolveError, Status
from ..potential import Array
from .continuation import CurveProblem, Followed, Point
from .state import hermite

#: a fold that lies this close to a value, relative to its size and one unit, lies on it
ON_FOLD = 1e-13
#: correction of a share of a segment that is round-off, with what a quantity is known by
_SHARE = 1e-11
#: correction that is round-off in any case
_ROUND_OFF = 1e-14


@dataclass(slots=True)
class Located(Generic[Point]):
    """A special point with the estimated error of its position, relative to the size of the curve's quantities and one unit of each
    (:attr:`.CurveProblem.units`)."""

    kind: str
    point: Point
    error: float


class Segment(Generic[Point]):
    """The curve between two neighbouring points.

    Parameters
    ----------
    problem, a, b : CurveProblem, BranchPoint, BranchPoint
    leaving : bool
        Whether the first point is a crossing at which the branch was entered: there its own rates and its inertia are round-off, so that
        nothing is looked for before the second point but given values.
    """

    def __init__(self, problem: CurveProblem[Point], a: Point, b: Point, *, leaving: bool = False) -> None:
        self.problem, self.a, self.b, self.leaving = problem, a, b, leaving
        self.length = b.sigma - a.sigma
        self._known = {0.0: a, 1.0: b}
        self._folds: dict[Followed, list[tuple[float, Located[Point]]]] = {}

    def at(self, share: float) -> Point:
        """The point of the curve at a share of the arc length between the ends.

        Raises
        ------
        SolveError
            When the corrector does not converge there.
        """
        if share not in self._known:
            a, b = self.a, self.b
            row = (1 - share) * a.dual + share * b.dual
            point = self.problem.resolve(self._predicted(share), row, a)
            if not np.isfinite(point.tangent).all():  # nothing holds a membrane that is slack all over: the curve has no direction there
                raise SolveError("the curve has no tangent between two neighbouring points", status=Status.NOT_CONVERGED)
            point.sigma = a.sigma + share * self.length
            self._known[share] = point
        return self._known[share]

    def folds(self, kind: str) -> list[Located[Point]]:
        """All folds of a kind on the segment: sign changes of the rate, also those that the cubic through the ends shows in pairs."""
        return [fold for _, fold in self._folds_in(self.problem.folds[kind])]

    def _folds_in(self, quantity: Followed) -> list[tuple[float, Located[Point]]]:
        """The folds in a quantity with their shares of the segment, located once."""
        if quantity not in self._folds:
            self._folds[quantity] = self._look_for_folds(quantity)
        return self._folds[quantity]

    def _look_for_folds(self, quantity: Followed) -> list[tuple[float, Located[Point]]]:
        a, b, stays = self.a, self.b, self.problem.stays
        if self.leaving or stays(quantity, a) or stays(quantity, b):
            return []
        r0, r1 = a.rate(quantity), b.rate(quantity)
        shares, rates, guess = [0.0, 1.0], [r0, r1], None
        if r0 * r1 > 0:
            if (top := self._extremum(quantity, r0, r1)) is None:
                return []
            shares, rates = [0.0, top, 1.0], [r0, self.at(top).rate(quantity), r1]
        elif r0 * r1 < 0:
            guess = self._turn(quantity, r0, r1)
        kind = next((k for k, q in self.problem.folds.items() if q == quantity), "")
        found = [
            self._root(kind, lambda point: point.rate(quantity), lo, hi, guess)
            for lo, hi, r0, r1 in zip(shares, shares[1:], rates, rates[1:], strict=False)
            if r0 * r1 < 0 or (r0 == 0 and lo == 0.0 and r1 != 0 and not self.problem.mirrored(a))
        ]
        return [fold for fold in found if self._turns(quantity, fold[1])]

    def _turns(self, quantity: Followed, located: Located[Point]) -> bool:
        """Whether a quantity moves between the ends and a fold by more than its error; else the signs of its rates are round-off."""
        fold = located.point
        before, after = self.a.value(quantity), self.b.value(quantity)
        moved = max(abs(fold.value(quantity) - value) for value in (before, after))
        known = max(self.problem.resolution, located.error if self.problem.resolution else 0.0)
        return moved >= known * max(self.problem.unit(quantity), abs(before))

    def _extremum(self, quantity: Followed, r0: float, r1: float) -> float | None:
        """The share at which the rate, of one sign at both ends, is extreme, where the cubic says that it changes sign twice between."""
        a2, a1, r0 = self._rate_of_cubic(quantity, r0, r1)
        top = -a1 / (2 * a2) if a2 else 0.5
        return float(top) if 0.02 < top < 0.98 and (r0 + top * (a1 + top * a2)) * r0 < 0.02 * r0 * r0 else None

    def _turn(self, quantity: Followed, r0: float, r1: float) -> tuple[float, float] | None:
        """The share at which the rate of the cubic, of opposite signs at both ends, passes zero, and its slope there."""
        a2, a1, r0 = self._rate_of_cubic(quantity, r0, r1)
        discriminant = a1 * a1 - 4 * a2 * r0
        if not (discriminant > 0 and a2):
            return None
        slope = math.copysign(math.sqrt(discriminant), r1)  # a rate that is negative first rises through zero
        share = -2 * r0 / (a1 + slope) if a1 * slope > 0 else (slope - a1) / (2 * a2)  # whichever does not cancel
        return share, slope / self.length

    def _rate_of_cubic(self, quantity: Followed, r0: float, r1: float) -> tuple[float, float, float]:
        """Coefficients of t^2, t and 1 of the derivative of the cubic through the ends."""
        r0, r1 = r0 * self.length, r1 * self.length
        rise = self.b.value(quantity) - self.a.value(quantity)
        # r0 (1 - t)(1 - 3t) + r1 t (3t - 2) + 6 rise t (1 - t)
        return 3 * (r0 + r1 - 2 * rise), -4 * r0 - 2 * r1 + 6 * rise, r0

    def root(
        self, kind: str, function: Callable[[Point], float], low: float, high: float, guess: tuple[float, float] | None = None
    ) -> Located[Point]:
        """The point between two shares of the segment where a function of the point changes sign. ``guess`` is a share close to it and the
        slope of the function there, where they are known."""
        return self._root(kind, function, low, high, guess)[1]

    def _root(
        self, kind: str, function: Callable[[Point], float], low: float, high: float, guess: tuple[float, float] | None = None
    ) -> tuple[float, Located[Point]]:
        """The root with its share. ``guess`` is a share close to it and the slope of the function there, where they are known."""
        try:
            share = None if guess is None else self._by_secants(function, low, high, *guess)
            if share is None:
                share = brentq(lambda s: function(self.at(s)), low, high, xtol=1e-14, rtol=8.9e-16, maxiter=60, disp=False)
        except SolveError:  # another branch crosses at the fold, as where a branch of pears ends on that of the spheres
            low, high = self.narrowed(function, low, high)
            return low, Located(kind, self.at(low), (high - low) * self.length + self.spread(low, high))
        point = self.at(share)
        h = 1e-3 * (high - low)
        near = share + h if share + h < high else share - h
        # from shares, since arc lengths of a long curve are too coarse to differ on a short segment
        run = (near - share) * self.length
        slope = (function(self.at(near)) - function(point)) / run if run else 0.0
        offset = (abs(function(point) / slope) if slope else self.length) + point.state.correction
        moved = max(abs(point.rate(q)) * offset / (unit + abs(point.value(q))) for q, unit in self.problem.units.items())
        return share, Located(kind, point, float(moved + point.state.correction))

    def _by_secants(self, function: Callable[[Point], float], low: float, high: float, share: float, slope: float) -> float | None:
        """The root next to a share, from where a few secants lead; None where they do not."""
        before, value_before, last = share, math.nan, math.inf
        for _ in range(7):
            if not low < share < high:
                return None
            value = function(self.at(share))
            if share != before:
                slope = (value - value_before) / (share - before)
            step = value / slope if slope else math.inf
            # the last steps are as long as round-off of the function makes them
            if abs(step) <= _ROUND_OFF or last / 4 < abs(step) <= _SHARE:
                return share
            before, value_before, last = share, value, abs(step)
            share -= step
        return None

    def narrowed(self, function: Callable[[Point], float], low: float, high: float) -> tuple[float, float]:
        """The shares between which a function of the point changes sign, by bisection as far as points can be resolved."""
        sign = function(self.at(low)) > 0
        while high - low > 1e-9:
            middle = (low + high) / 2
            try:
                same = (function(self.at(middle)) > 0) == sign
            except SolveError:  # next to a crossing the equations are all but singular: what is known is the bracket
                break
            low, high = (middle, high) if same else (low, middle)
        return low, high

    def spread(self, low: float, high: float) -> float:
        """How far two points are apart, relative to one unit and the size, in every quantity of the curve, with the errors of both."""
        a, b = self.at(low), self.at(high)
        apart = max(abs(a.value(q) - b.value(q)) / (unit + abs(a.value(q))) for q, unit in self.problem.units.items())
        return float(apart + a.state.correction + b.state.correction)

    def crossings(self, quantity: Followed, value: float) -> list[Point]:
        """The points at which a quantity takes a value, in order, each corrected under that control; the first end does not count.

        A fold in the quantity between the ends may lie on either side of the value, or on it, within round-off: then it is the point.
        """
        folds = self._folds_in(quantity)
        if not folds and (self.a.value(quantity) - value) * (self.b.value(quantity) - value) > 0:
            return []
        shares = [0.0, *(share for share, _ in folds), 1.0]
        ends = [self.at(s).value(quantity) - value for s in shares]
        least = ON_FOLD * (self.problem.unit(quantity) + abs(value))
        ends = [ends[0], *(0.0 if abs(e) <= least else e for e in ends[1:-1]), ends[-1]]
        return [
            self.at(high) if b == 0 and high != 1.0 else self._crossing(quantity, value, low, high)
            for low, high, a, b in zip(shares, shares[1:], ends, ends[1:], strict=False)
            if b == 0 or a * b < 0
        ]

    def _crossing(self, quantity: Followed, value: float, low: float, high: float) -> Point:
        if value == 0 and (rest := self.problem.rest_between(self.a, self.b)) is not None:
            a, b = self.a.value(quantity), self.b.value(quantity)
            rest.sigma = self.a.sigma + self.length * (a / (a - b) if a != b else high)
            return rest
        share = self._share_of(quantity, value, low, high)
        if share is None:
            share = brentq(lambda s: self.at(s).value(quantity) - value, low, high, xtol=1e-14, rtol=8.9e-16, disp=False)
        point = self.at(share)
        held = self.problem.hold(quantity, value, point)
        if held is None:  # so close to a fold that the control is singular
            return point
        held.sigma = point.sigma
        # next to a fold the corrector may have ended on its other side
        return held if held.rate(quantity) * point.rate(quantity) > 0 else point

    def _share_of(self, quantity: Followed, value: float, low: float, high: float) -> float | None:
        """Where a quantity takes a value between two shares, by Newton's method from the inverse cubic; None where it leads out."""
        ends = [self.at(s) for s in (low, high)]
        before, after = (point.value(quantity) - value for point in ends)
        slopes = [point.rate(quantity) * self.length for point in ends]
        if not slopes[0] * slopes[1] > 0:
            return None
        share: float = hermite(low, 1 / slopes[0], high, 1 / slopes[1], before / (before - after), after - before)
        for _ in range(5):
            if not low < share < high:
                return None
            point = self.at(share)
            slope = point.rate(quantity) * self.length
            if not slope * slopes[0] > 0:
                return None
            step = (point.value(quantity) - value) / slope
            if abs(step) <= _SHARE:
                return share
            share -= step
        return None

    def passes(self, start: Point) -> bool:
        """Whether the curve comes back to its first point here."""
        before, after = start.dual @ (self.a.z - start.z), start.dual @ (self.b.z - start.z)
        if self.a.sigma == start.sigma or not before < 0 <= after:
            return False
        guess = self._predicted(float(before / (before - after)))
        return self.problem.norm(guess - start.z) < 0.05 * self.length

    def _predicted(self, share: float) -> Array:
        """What the cubic through both ends predicts."""
        a, b = self.a, self.b
        return hermite(a.z, a.tangent, b.z, b.tangent, share, self.length)
