"""Special points of a branch, solved as equations: where the branch turns in pressure, volume or pole height.

Between two points of a branch the Hermite cubic through them, with their tangents, predicts any point; a corrector in the hyperplane across
it puts the point on the branch. A fold is the root of the rate of its quantity along the branch, found by Brent's method on points that are
each converged: the rate itself, not the step, decides when it is found.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from ..errors import SolveError, Status
from ..potential import Potential
from .continuation import BranchPoint, tangent_at
from .controls import ArcLengthControl, CenterHeightControl, Control, PressureControl, VolumeControl
from .newton import correct
from .state import State, hermite

#: the folds looked for: their name and the quantity that is stationary
FOLDS = {"limit_point": "pressure", "volume_fold": "volume", "height_fold": "center_height"}

_CONTROLS: dict[str, Callable[[float], Control]] = {
    "pressure": PressureControl,
    "volume": VolumeControl,
    "center_height": CenterHeightControl,
}
#: tolerance at which a point is put on a prescribed value
_EXACT = 1e-13


@dataclass(slots=True)
class Located:
    """A special point with the estimated error of its position, relative to (1 + size) of volume, pressure and pole height."""

    kind: str
    point: BranchPoint
    error: float


class Segment:
    """The branch between two neighbouring points."""

    def __init__(self, potential: Potential, a: BranchPoint, b: BranchPoint) -> None:
        self.potential, self.a, self.b = potential, a, b
        self.length = b.sigma - a.sigma
        self._known = {0.0: a, 1.0: b}

    def at(self, share: float) -> BranchPoint:
        """The point of the branch at a share of the arc length between the ends.

        Raises
        ------
        SolveError
            When the corrector does not converge there.
        """
        if share in self._known:
            return self._known[share]
        ends = [np.append(p.state.x, p.state.pressure) for p in (self.a, self.b)]
        slopes = [np.append(p.tangent, p.tangent_pressure) * self.length for p in (self.a, self.b)]
        z = hermite(ends[0], slopes[0], ends[1], slopes[1], share)
        dual = (1 - share) * self.a.dual + share * self.b.dual
        dual_pressure = (1 - share) * self.a.tangent_pressure + share * self.b.tangent_pressure
        result = correct(self.potential, ArcLengthControl(dual, dual_pressure, z[:-1], float(z[-1])), z[:-1], float(z[-1]))
        if result.status is not Status.CONVERGED:
            raise SolveError("the branch between two neighbouring points could not be resolved", status=result.status)
        point = tangent_at(self.potential, State.of(result), self.a)
        point.sigma = self.a.sigma + share * self.length
        self._known[share] = point
        return point

    def value(self, quantity: str, point: BranchPoint) -> float:
        """Volume, pressure or pole height of a point."""
        if quantity == "center_height":
            return self.potential.space.center_height(point.state.x)
        return point.state.pressure if quantity == "pressure" else point.state.volume

    def folds(self, kind: str) -> list[Located]:
        """All folds of a kind on the segment: sign changes of the rate, also those that the cubic through the ends shows in pairs."""
        quantity = FOLDS[kind]
        shares = self._brackets(quantity)
        rates = [self.at(s).rate(quantity, self.potential) for s in shares]
        return [
            self._fold(kind, lo, hi)
            for lo, hi, r0, r1 in zip(shares, shares[1:], rates, rates[1:], strict=False)
            if r0 * r1 < 0 or (r0 == 0 and lo == 0.0 and r1 != 0)
        ]

    def _brackets(self, quantity: str) -> list[float]:
        """0, 1, and between them the extremum of the rate where the cubic says that the rate changes sign twice."""
        r0, r1 = (p.rate(quantity, self.potential) * self.length for p in (self.a, self.b))
        rise = self.value(quantity, self.b) - self.value(quantity, self.a)
        # rate of the cubic: r0 (1 - t)(1 - 3t) + r1 t (3t - 2) + 6 rise t (1 - t)
        a2, a1 = 3 * (r0 + r1 - 2 * rise), -4 * r0 - 2 * r1 + 6 * rise
        top = -a1 / (2 * a2) if a2 else 0.5
        if r0 * r1 > 0 and 0.02 < top < 0.98 and (r0 + top * (a1 + top * a2)) * r0 < 0.02 * r0 * r0:
            return [0.0, float(top), 1.0]
        return [0.0, 1.0]

    def _fold(self, kind: str, low: float, high: float) -> Located:
        quantity = FOLDS[kind]
        return self.root(kind, lambda point: point.rate(quantity, self.potential), low, high)

    def root(self, kind: str, function: Callable[[BranchPoint], float], low: float, high: float) -> Located:
        """The point between two shares of the segment where a function of the point changes sign."""
        share = brentq(lambda s: function(self.at(s)), low, high, xtol=1e-14, rtol=8.9e-16, maxiter=60)
        point = self.at(share)
        h = 1e-3 * (high - low)
        near = self.at(share + h if share + h < high else share - h)
        slope = (function(near) - function(point)) / (near.sigma - point.sigma)
        offset = abs(function(point) / slope) + point.state.correction
        moved = max(abs(point.rate(q, self.potential)) * offset / (1 + abs(self.value(q, point))) for q in FOLDS.values())
        return Located(kind, point, float(moved + point.state.correction))

    def crosses(self, quantity: str, value: float) -> bool:
        """Whether the quantity takes the value on the segment, its first point left out."""
        a, b = self.value(quantity, self.a) - value, self.value(quantity, self.b) - value
        return b == 0 or a * b < 0

    def crossing(self, quantity: str, value: float) -> BranchPoint:
        """The point at which a quantity takes a value, exactly: corrected under that control."""
        share = brentq(lambda s: self.value(quantity, self.at(s)) - value, 0.0, 1.0, xtol=1e-10)
        point = self.at(share)
        pressure = value if quantity == "pressure" else point.state.pressure
        exact = correct(self.potential, _CONTROLS[quantity](value), point.state.x, pressure, tolerance=_EXACT)
        if exact.status is Status.CONVERGED:  # singular only where the fold in this very quantity lies on the value
            sigma = point.sigma
            point = tangent_at(self.potential, State.of(exact), point)
            point.sigma = sigma
        return point


def branch_point(segment: Segment) -> Located | None:
    """The point where another branch crosses: the bordered matrix of the arc-length system is singular, though no quantity turns.

    Bisection on the sign of its determinant, which a fold does not change; None when that sign does not change either.
    """
    low, high = 0.0, 1.0
    signs = [_bordered_sign(segment.at(s)) for s in (low, high)]
    if signs[0] * signs[1] > 0:
        return None
    while high - low > 1e-9:
        middle = (low + high) / 2
        try:
            sign = _bordered_sign(segment.at(middle))
        except SolveError:  # next to the crossing the equations are all but singular: what is known is the bracket
            break
        low, high = (middle, high) if sign == signs[0] else (low, middle)
    return Located("branch_point", segment.at(low), (high - low) * segment.length)


def _bordered_sign(point: BranchPoint) -> int:
    """Sign of det [K, -V'; tangent^T, tangent_P] = det K (tangent_P + tangent^T K^-1 V')."""
    evaluation = point.state.evaluation
    solved = point.state.factor.solve(evaluation.volume_gradient)
    return parity(point) * (1 if point.tangent_pressure + point.dual @ solved > 0 else -1)


def parity(point: BranchPoint) -> int:
    """Sign of det K: flips at every point where an odd number of eigenvalues of K changes sign."""
    return point.state.factor.determinant_sign()
