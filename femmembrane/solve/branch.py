"""Branches of equilibria of one scene: the curve E' - P V' = 0 of (x, P).

Arc length is measured in the mesh-independent inner product of :attr:`.Potential.arc_band`: mean square displacement over the reference
area plus squared pressure, both in units of the membrane's own size.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..errors import SolveError, Status
from ..potential import Array, Potential
from .banded import BorderedFactor, band_inner, band_product
from .continuation import BranchPoint, CurveProblem, Followed
from .controls import CONTROLS, ArcLengthControl
from .newton import TOLERANCE, NewtonResult, correct
from .state import State, flat_state, joined, rests_flat

#: the folds looked for: their name and the quantity that is stationary
FOLDS = {"limit_point": "pressure", "volume_fold": "volume", "height_fold": "center_height"}

#: see :attr:`.CurveProblem.moving`: of borders of contact, and of zones, where errors are smaller for higher degrees
_CONTACT, _ZONES = 0.02, 0.2
#: tolerance at which a point is put on a prescribed value
_EXACT = 1e-13
#: the loosest tolerance: next to a crossing of branches no correction falls below round-off over the distance to it
AT_CROSSING = 1e-7


class BranchProblem(CurveProblem[BranchPoint]):
    """The branches of a potential."""

    folds = FOLDS

    def __init__(self, potential: Potential) -> None:
        self.potential, self.cornered = potential, potential.scene.tension_field or bool(potential.obstacles)
        if potential.follows:
            self.moving = _CONTACT if potential.obstacles else max(0.25, _ZONES / (potential.space.degree + 1))
        self._band, self._half_bandwidth = potential.arc_band, potential.space.half_bandwidth

    @property
    def units(self) -> Mapping[str, float]:
        return self.potential.space.units

    def dual(self, z: Array) -> Array:
        return band_product(self._band, self._half_bandwidth, z)

    def norm(self, z: Array) -> float:
        return math.sqrt(max(band_inner(self._band, self._half_bandwidth, z, z), 0.0))

    def correct(self, guess: Array, row: Array, near: BranchPoint) -> tuple[BranchPoint | None, int]:
        result = corrected(self.potential, guess, row)
        if result.status is not Status.CONVERGED or result.bordered is None:
            return None, result.iterations
        # the border is the tangent before: the corrector's last factors give the new one for a back-substitution
        tangent = joined(*result.bordered.solve(np.zeros(len(result.x)), 1.0))
        return self.unit_point(State.of(result), tangent), result.iterations

    def unit_point(self, state: State, tangent: Array, sigma: float = 0.0) -> BranchPoint:
        """The point of a state whose tangent is known up to its length."""
        if not self.potential.follows:
            return self.point(state, tangent / self.norm(tangent), sigma)
        carried = joined(state.evaluation.carried(tangent[:-1]), float(tangent[-1]))
        length = self.norm(carried)
        return replace(self.point(state, carried / length, sigma), own=tangent / length)

    def point(self, state: State, tangent: Array, sigma: float = 0.0) -> BranchPoint:
        """The point of a state whose unit tangent is known."""
        own = state.evaluation.brought(tangent) if self.potential.follows else None
        return BranchPoint(state, joined(state.x, state.pressure), tangent, self.dual(tangent), sigma, own=own)

    def resolve(self, guess: Array, row: Array, near: BranchPoint) -> BranchPoint:
        # as good as round-off lets it be: the pressure of a fold is the last digit that tells its two sides apart
        for tolerance in (_EXACT, TOLERANCE, AT_CROSSING):
            result = corrected(self.potential, guess, row, tolerance)
            if result.status is Status.CONVERGED:
                return tangent_at(self.potential, State.of(result), near)
        raise SolveError("the branch between two neighbouring points could not be resolved", status=result.status)

    def hold(self, quantity: Followed, value: float, near: BranchPoint) -> BranchPoint | None:
        pressure = value if quantity == "pressure" else near.state.pressure
        result = correct(
            self.potential,
            (CONTROLS[quantity] if isinstance(quantity, str) else quantity).at(value),
            near.state.x,
            pressure,
            tolerance=_EXACT,
        )
        return tangent_at(self.potential, State.of(result), near) if result.status is Status.CONVERGED else None

    def determinant_sign(self, point: BranchPoint) -> int:
        """Of [K, -V'; tangent^T, tangent_P], whose determinant is det K (tangent_P + tangent^T K^-1 V')."""
        factor, row = point.state.factor, point.dual
        solved = factor.solve(point.state.evaluation.volume_gradient)
        return factor.determinant_sign() * (1 if row[-1] + point.state.evaluation.row(row[:-1]) @ solved > 0 else -1)

    def stays(self, quantity: Followed, point: BranchPoint) -> bool:
        return quantity == "center_height" and point.state.evaluation.holds(self.potential.space.pole)

    def forbids(self, before: BranchPoint, after: BranchPoint) -> bool:
        return self.potential.passed_source(before.state.x, after.state.x)

    def rest_between(self, a: BranchPoint, b: BranchPoint) -> BranchPoint | None:
        """The flat membrane at rest, where the points lie on mirror images of one branch."""
        rest = {q: CONTROLS[q].rest(self.potential.space) for q in FOLDS.values()}
        mirrored = all((a.value(q) - rest[q]) * (b.value(q) - rest[q]) < 0 for q in FOLDS.values())
        if not (mirrored and self.potential.flat and rests_flat(self.potential)):
            return None
        state = flat_state(self.potential)
        return replace(a, state=state, z=joined(state.x, state.pressure))


def first_point(potential: Potential, state: State, direction: int) -> BranchPoint:
    """The point of a state with its tangent, oriented towards larger volume for direction +1."""
    border = state.evaluation.volume_gradient
    tangent = joined(*BorderedFactor(state.factor, -border, border, 0.0).solve(np.zeros_like(state.x), 1.0))
    return unit_point(potential, state, 0.0, direction * tangent)


def oriented_point(potential: Potential, state: State, sigma: float, tangent: Array) -> BranchPoint:
    """The point of a state whose unit tangent is known."""
    return BranchProblem(potential).point(state, tangent, sigma)


def tangent_at(potential: Potential, state: State, neighbour: BranchPoint) -> BranchPoint:
    """Unit tangent at a state, oriented like that of a neighbouring point."""
    row = neighbour.dual
    bordered = BorderedFactor(state.factor, -state.evaluation.volume_gradient, state.evaluation.row(row[:-1]), float(row[-1]))
    return unit_point(potential, state, neighbour.sigma, joined(*bordered.solve(np.zeros_like(state.x), 1.0)))


def unit_point(potential: Potential, state: State, sigma: float, tangent: Array) -> BranchPoint:
    """The point of a state whose tangent is known up to its length."""
    return BranchProblem(potential).unit_point(state, tangent, sigma)


def corrected(potential: Potential, guess: Array, row: Array, tolerance: float = TOLERANCE) -> NewtonResult:
    """Where the corrector ends in the hyperplane row . (z - guess) = 0."""
    x, pressure = guess[:-1], float(guess[-1])
    return correct(potential, ArcLengthControl(row[:-1], float(row[-1]), x, pressure), x, pressure, tolerance=tolerance)
