"""Special points of a branch, solved as equations: where the branch turns in pressure, volume or pole height.

Between two points of a branch the Hermite cubic through them, with their tangents, predicts any point; a corrector in the hyperplane across
it puts the point on the branch. A fold is the root of the rate of its quantity along the branch, found by Brent's method on points that are
each converged: the rate itself, not the step, decides when it is found.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from ..errors import SolveError, Status
from ..potential import Potential
from .continuation import BranchPoint, tangent_at, unit_point
from .controls import CONTROLS, ArcLengthControl
from .newton import TOLERANCE, correct
from .state import State, flat_state, hermite, rests_flat
from .wellposed import ill_posed

#: the folds looked for: their name and the quantity that is stationary
FOLDS = {"limit_point": "pressure", "volume_fold": "volume", "height_fold": "center_height"}

#: tolerance at which a point is put on a prescribed value
_EXACT = 1e-13
#: the least that does: next to a crossing of branches no correction falls below round-off over the distance to it
_AT_CROSSING = 1e-7
#: a fold that lies this close to a value, relative to its size and one unit, lies on it
ON_FOLD = 1e-13


@dataclass(slots=True)
class Located:
    """A special point with the estimated error of its position, relative to the size of volume, pressure and pole height and one unit of
    each (:attr:`.Space.units`)."""

    kind: str
    point: BranchPoint
    error: float


class Segment:
    """The branch between two neighbouring points.

    Parameters
    ----------
    potential, a, b : Potential, BranchPoint, BranchPoint
    leaving : bool
        Whether the first point is a crossing at which the branch was entered: there its own rates and its inertia are round-off, so that
        nothing is looked for before the second point but given values.
    """

    def __init__(self, potential: Potential, a: BranchPoint, b: BranchPoint, *, leaving: bool = False) -> None:
        self.potential, self.a, self.b, self.leaving = potential, a, b, leaving
        self.length = b.sigma - a.sigma
        self._known = {0.0: a, 1.0: b}
        self._folds: dict[str, list[tuple[float, Located]]] = {}

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
        dual_pressure = (1 - share) * self.a.dual_pressure + share * self.b.dual_pressure
        control = ArcLengthControl(dual, dual_pressure, z[:-1], float(z[-1]))
        # as good as round-off lets it be: the pressure of a fold is the last digit that tells its two sides apart
        for tolerance in (_EXACT, TOLERANCE, _AT_CROSSING):
            result = correct(self.potential, control, z[:-1], float(z[-1]), tolerance=tolerance)
            if result.status is Status.CONVERGED:
                break
        if result.status is not Status.CONVERGED:
            raise SolveError("the branch between two neighbouring points could not be resolved", status=result.status)
        point = tangent_at(self.potential, State.of(result), self.a)
        point.sigma = self.a.sigma + share * self.length
        self._known[share] = point
        return point

    def value(self, quantity: str, point: BranchPoint) -> float:
        """Volume, pressure or pole height of a point."""
        return point.state.value_of(CONTROLS[quantity])

    def folds(self, kind: str) -> list[Located]:
        """All folds of a kind on the segment: sign changes of the rate, also those that the cubic through the ends shows in pairs."""
        return [fold for _, fold in self._folds_at(kind)]

    def _folds_at(self, kind: str) -> list[tuple[float, Located]]:
        """The folds of a kind with their shares of the segment, located once."""
        if self.leaving:
            return []
        if kind not in self._folds:
            quantity = FOLDS[kind]
            shares = self._brackets(quantity)
            rates = [self.at(s).rate(quantity, self.potential) for s in shares]
            self._folds[kind] = [
                self._fold(kind, lo, hi)
                for lo, hi, r0, r1 in zip(shares, shares[1:], rates, rates[1:], strict=False)
                if r0 * r1 < 0 or (r0 == 0 and lo == 0.0 and r1 != 0)
            ]
        return self._folds[kind]

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

    def _fold(self, kind: str, low: float, high: float) -> tuple[float, Located]:
        quantity = FOLDS[kind]
        return self._root(kind, lambda point: point.rate(quantity, self.potential), low, high)

    def root(self, kind: str, function: Callable[[BranchPoint], float], low: float, high: float) -> Located:
        """The point between two shares of the segment where a function of the point changes sign."""
        return self._root(kind, function, low, high)[1]

    def _root(self, kind: str, function: Callable[[BranchPoint], float], low: float, high: float) -> tuple[float, Located]:
        try:
            share = brentq(lambda s: function(self.at(s)), low, high, xtol=1e-14, rtol=8.9e-16, maxiter=60)
        except SolveError:  # another branch crosses at the fold, as where a branch of pears ends on that of the spheres
            low, high = self.narrowed(function, low, high)
            return low, Located(kind, self.at(low), (high - low) * self.length + self.spread(low, high))
        point = self.at(share)
        h = 1e-3 * (high - low)
        near = self.at(share + h if share + h < high else share - h)
        slope = (function(near) - function(point)) / (near.sigma - point.sigma)
        offset = abs(function(point) / slope) + point.state.correction
        units = self.potential.space.units
        moved = max(abs(point.rate(q, self.potential)) * offset / (units[q] + abs(self.value(q, point))) for q in FOLDS.values())
        return share, Located(kind, point, float(moved + point.state.correction))

    def narrowed(self, function: Callable[[BranchPoint], float], low: float, high: float) -> tuple[float, float]:
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
        """How far two points are apart, relative to one unit and the size, in volume, pressure and pole height, with the errors of both."""
        a, b = self.at(low), self.at(high)
        units = self.potential.space.units
        apart = max(abs(self.value(q, a) - self.value(q, b)) / (units[q] + abs(self.value(q, a))) for q in FOLDS.values())
        return float(apart + a.state.correction + b.state.correction)

    def crossings(self, quantity: str, value: float) -> list[BranchPoint]:
        """The points at which a quantity takes a value, in order, each corrected under that control; the first end does not count.

        A fold in the quantity between the ends may lie on either side of the value, or on it, within round-off: then it is the point.
        """
        kind = next(k for k, q in FOLDS.items() if q == quantity)
        shares = [0.0, *(share for share, _ in self._folds_at(kind)), 1.0]
        ends = [self.value(quantity, self.at(s)) - value for s in shares]
        least = ON_FOLD * (self.potential.space.units[quantity] + abs(value))
        ends = [ends[0], *(0.0 if abs(e) <= least else e for e in ends[1:-1]), ends[-1]]
        return [
            self.at(high) if b == 0 and high != 1.0 else self._crossing(quantity, value, low, high)
            for low, high, a, b in zip(shares, shares[1:], ends, ends[1:], strict=False)
            if b == 0 or a * b < 0
        ]

    def _crossing(self, quantity: str, value: float, low: float, high: float) -> BranchPoint:
        if value == 0 and self._through_flat:
            a, b = self.value(quantity, self.a), self.value(quantity, self.b)
            return replace(self.a, state=flat_state(self.potential), sigma=self.a.sigma + self.length * a / (a - b))
        share = brentq(lambda s: self.value(quantity, self.at(s)) - value, low, high, xtol=1e-14, rtol=8.9e-16, disp=False)
        point = self.at(share)
        pressure = value if quantity == "pressure" else point.state.pressure
        exact = correct(self.potential, CONTROLS[quantity].at(value), point.state.x, pressure, tolerance=_EXACT)
        if exact.status is not Status.CONVERGED:  # so close to a fold that the control is singular
            return point
        moved = tangent_at(self.potential, State.of(exact), point)
        moved.sigma = point.sigma
        # next to a fold the corrector may have ended on its other side
        return moved if moved.rate(quantity, self.potential) * point.rate(quantity, self.potential) > 0 else point

    @property
    def _through_flat(self) -> bool:
        """Whether the segment leads to the mirror side of the flat membrane at rest, which no corrector finds."""
        mirrored = all(self.value(q, self.a) * self.value(q, self.b) < 0 for q in FOLDS.values())
        return mirrored and self.potential.flat and rests_flat(self.potential)


def branches_crossing(segment: Segment) -> int:
    """The least number of other branches that cross on a segment.

    A limit point changes the number of negative eigenvalues of K by one, and so does a crossing. Where the equations are ill-posed the
    number is that of the mesh's own short waves, and no more than its parity is looked at.
    """
    if segment.leaving:
        return 0
    turns = len(segment.folds("limit_point"))
    before, after = (point.state.evaluation.negative for point in (segment.a, segment.b))
    if before == after and turns % 2 == 0:  # asked first, for whether a state is ill-posed may need finer meshes
        return 0
    if any(ill_posed(segment.potential, point.state.evaluation) for point in (segment.a, segment.b)):
        signs = [point.state.factor.determinant_sign() for point in (segment.a, segment.b)]
        return int((signs[0] != signs[1]) != (turns % 2 == 1))
    surplus = abs(after - before) - turns
    return surplus if surplus > 0 else surplus % 2


def branch_points(segment: Segment, depth: int = 12) -> list[Located]:
    """The points of a segment where other branches cross, as many as could be located; several are told apart by halving the segment."""
    number = branches_crossing(segment)
    if number < 2 or not depth:
        found = branch_point(segment) if number % 2 else None
        return [] if found is None else [found]
    try:
        middle = segment.at(0.5)
    except SolveError:
        return []
    halves = Segment(segment.potential, segment.a, middle), Segment(segment.potential, middle, segment.b)
    return [point for half in halves for point in branch_points(half, depth - 1)]


def branch_point(segment: Segment) -> Located | None:
    """The point where another branch crosses: the bordered matrix of the arc-length system is singular, though no quantity turns.

    Bisection on the sign of its determinant, which a fold does not change; None when that sign does not change either.
    """
    if _bordered_sign(segment.a) * _bordered_sign(segment.b) > 0:
        return None
    low, high = segment.narrowed(_bordered_sign, 0.0, 1.0)
    point, a, b = segment.at(low), segment.a, segment.b
    # at the crossing itself the equations have two tangents; that of this branch is known from its points on both sides
    tangent = (1 - low) * a.tangent + low * b.tangent
    pressure = (1 - low) * a.tangent_pressure + low * b.tangent_pressure
    point = unit_point(segment.potential, point.state, point.sigma, tangent, pressure)
    return Located("branch_point", point, (high - low) * segment.length + segment.spread(low, high))


def _bordered_sign(point: BranchPoint) -> int:
    """Sign of det [K, -V'; tangent^T, tangent_P] = det K (tangent_P + tangent^T K^-1 V')."""
    evaluation = point.state.evaluation
    solved = point.state.factor.solve(evaluation.volume_gradient)
    return point.state.factor.determinant_sign() * (1 if point.dual_pressure + point.dual @ solved > 0 else -1)
