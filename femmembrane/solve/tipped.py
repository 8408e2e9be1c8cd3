"""Branches of a membrane that is no longer one of revolution: they set out at an azimuthal onset.

The unknowns are (x, P) with x the displacement by harmonics around the axis. Arc length, steps and folds are those of all curves
(:mod:`.continuation`). The first state off the axisymmetric branch is looked for at a prescribed part of the mode that sets in.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..errors import SolveError, Status
from ..kernels.bordered import BorderedFactor
from ..potential import Array
from ..potential.tipped import TippedEvaluation, TippedPotential
from .banded import BandFactor, band_product
from .branch import FOLDS
from .continuation import BranchPoint, CurveProblem, Followed
from .newton import RESIDUAL, ROUND_OFF, TOLERANCE
from .state import joined

#: most corrections of a state
_ITERATIONS = 10
#: compressive stress that is round-off of none, over the shear modulus
_COMPRESSED = 1e-9
#: how often the first step off the axisymmetric branch is halved
_HALVINGS = 8


@dataclass(slots=True)
class TippedState:
    """An equilibrium with waves: unknowns, and the evaluation there; further attributes as those of :class:`.state.State`."""

    x: Array
    pressure: float
    evaluation: TippedEvaluation
    iterations: int
    correction: float
    residual: float
    status: Status = Status.CONVERGED

    @property
    def volume(self) -> float:
        return self.evaluation.volume


class TippedPoint(BranchPoint):
    """A point of such a branch."""

    state: TippedState  # type: ignore[assignment]

    def value(self, quantity: Followed) -> float:
        state, potential = self.state, self.state.evaluation.potential
        if quantity == "center_height":
            return potential.space.center_height(state.x[potential.harmonics.without_waves])
        return state.volume if quantity == "volume" else state.pressure

    def rate(self, quantity: Followed) -> float:
        state, potential = self.state, self.state.evaluation.potential
        if quantity == "center_height":
            own = self.tangent[:-1][potential.harmonics.without_waves]
            return float(own[potential.space.pole]) if potential.space.pole < own.size else 0.0
        return float(state.evaluation.volume_gradient @ self.tangent[:-1] if quantity == "volume" else self.tangent[-1])


class TippedProblem(CurveProblem[TippedPoint]):
    """The branches of a potential by harmonics."""

    folds = FOLDS

    def __init__(self, tipped: TippedPotential) -> None:
        self.tipped, self.potential = tipped, tipped.axisymmetric
        self._square = tipped.space.unit**2
        self._over = tipped.axisymmetric.area * self._square

    @property
    def units(self) -> Mapping[str, float]:
        return self.potential.space.units

    def dual(self, z: Array) -> Array:
        weighed = band_product(self.tipped.mass, self.tipped.harmonics.half_bandwidth, z[:-1])
        return joined(weighed / self._over, float(z[-1]) * self._square)

    def correct(self, guess: Array, row: Array, near: BranchPoint) -> tuple[TippedPoint | None, int]:
        state, factor = self._newton(guess, row, float(row @ guess), TOLERANCE)
        if state.status is not Status.CONVERGED or factor is None:
            return None, state.iterations
        return self._point(state, joined(*factor.solve(np.zeros_like(state.x), 1.0))), state.iterations

    def resolve(self, guess: Array, row: Array, near: BranchPoint) -> TippedPoint:
        state, factor = self._newton(guess, row, float(row @ guess), RESIDUAL)
        if state.status is not Status.CONVERGED or factor is None:
            raise SolveError("the branch between two neighbouring points could not be resolved", status=state.status)
        return self._tangent(state, near)

    def hold(self, quantity: Followed, value: float, near: BranchPoint) -> TippedPoint | None:
        z = near.z.copy()
        if quantity == "pressure":
            z[-1] = value
        state, factor = self._newton(z, None, value, RESIDUAL, quantity)
        return self._tangent(state, near) if state.status is Status.CONVERGED and factor is not None else None

    def determinant_sign(self, point: TippedPoint) -> int:
        factor, row = BandFactor(point.state.evaluation.band), point.dual
        solved = factor.solve(point.state.evaluation.volume_gradient)
        return factor.determinant_sign() * (1 if row[-1] + row[:-1] @ solved > 0 else -1)

    def forbids(self, before: BranchPoint, after: BranchPoint) -> bool:
        own = self.tipped.harmonics.without_waves
        return self.potential.passed_source(before.state.x[own], after.state.x[own])

    def part(self, z: Array, other: Array) -> float:
        """Inner product of the parts of two displacements that have waves."""
        waves = z[:-1].copy()
        waves[self.tipped.harmonics.without_waves] = 0.0
        return float(self.dual(joined(waves, 0.0)) @ other)

    def _point(self, state: TippedState, tangent: Array, sigma: float = 0.0) -> TippedPoint:
        tangent = tangent / self.norm(tangent)
        return TippedPoint(state, joined(state.x, state.pressure), tangent, self.dual(tangent), sigma)  # type: ignore[arg-type]

    def _tangent(self, state: TippedState, near: BranchPoint) -> TippedPoint:
        row = near.dual
        factor = BorderedFactor(_factor(state.evaluation), -state.evaluation.volume_gradient, row[:-1], float(row[-1]))
        return self._point(state, joined(*factor.solve(np.zeros_like(state.x), 1.0)), near.sigma)

    def _newton(
        self, z: Array, row: Array | None, value: float, tolerance: float, held: Followed = ""
    ) -> tuple[TippedState, BorderedFactor | None]:
        """Corrections until the last one is small; in the hyperplane ``row`` . z = value, or with a quantity held."""
        x, pressure = z[:-1].copy(), float(z[-1])
        before, size, iteration = np.inf, np.inf, 0
        while True:
            evaluation = self.tipped.evaluate(x, pressure)
            state = TippedState(x, pressure, evaluation, iteration, size, np.inf, Status.NOT_CONVERGED)
            if not evaluation.finite:
                return state, None
            border, corner, gap = self._control(evaluation, pressure, row, value, held)
            state.residual, force = _balance(evaluation, pressure)
            factor = BorderedFactor(_factor(evaluation), -evaluation.volume_gradient, border, corner)
            dx, dp = factor.solve(force, -gap)
            size = float(np.abs(dx).max() / np.abs(x).max())
            if not size < np.inf:
                return state, None
            state.correction = size
            if size <= tolerance or (size <= math.sqrt(TOLERANCE) and size > 0.5 * before and state.residual <= ROUND_OFF):
                state.status = Status.CONVERGED
                return state, factor
            if row is not None and iteration and 0.0 < before < np.inf and size * (size / before) ** 2 <= tolerance / 10:
                last = self._foretold(state, row, value, factor, dx, dp)
                if last is not None:
                    return last, factor
            if iteration == _ITERATIONS or (iteration > 1 and size > 0.5 * before and size > TOLERANCE):
                return state, None
            x, pressure, before, iteration = x + dx, pressure + dp, size, iteration + 1

    def _foretold(self, state: TippedState, row: Array, value: float, factor: BorderedFactor, dx: Array, dp: float) -> TippedState | None:
        """The state after a correction that quadratic convergence says to be the last, if its forces are balanced. It spares factors."""
        x, pressure = state.x + dx, state.pressure + dp
        evaluation = self.tipped.evaluate(x, pressure)
        if not evaluation.finite:
            return None
        residual, force = _balance(evaluation, pressure)
        gap = float(row[:-1] @ x + row[-1] * pressure) - value
        left = float(np.abs(factor.solve(force, -gap)[0]).max() / np.abs(x).max())
        if residual > RESIDUAL or left > TOLERANCE / 10:
            return None
        return TippedState(x, pressure, evaluation, state.iterations + 1, left, residual)

    def _control(
        self, evaluation: TippedEvaluation, pressure: float, row: Array | None, value: float, held: Followed
    ) -> tuple[Array, float, float]:
        """Row, corner and error of the equation beside equilibrium."""
        if row is not None:
            return row[:-1], float(row[-1]), float(row[:-1] @ evaluation.x + row[-1] * pressure) - value
        if held == "volume":
            return evaluation.volume_gradient, 0.0, evaluation.volume - value
        border = np.zeros_like(evaluation.x)
        if held == "pressure":
            return border, 1.0, pressure - value
        own, space = self.tipped.harmonics.without_waves, self.tipped.space
        border[own[space.pole]] = 1.0
        return border, 0.0, space.center_height(evaluation.x[own]) - value

    def onset(self, x: Array, pressure: float, mode: Array) -> TippedPoint:
        """The axisymmetric state at an onset, with the mode as the direction of the branch."""
        z = self.tipped.harmonics.lifted(x)
        state = TippedState(z, pressure, self.tipped.evaluate(z, pressure), 0, 0.0, 0.0)
        return self._point(state, joined(mode, 0.0))

    def leave(self, onset: TippedPoint, step: float) -> TippedPoint:
        """The first state with waves, a step away from an onset or less.

        Raises
        ------
        SolveError
            Where no step leads to one.
        """
        for _ in range(_HALVINGS):
            guess = onset.z + step * onset.tangent
            new, _ = self.correct(guess, onset.dual, onset)
            if new is not None and self.norm(new.z - guess) <= 0.5 * step:
                new.sigma = onset.sigma + step
                if onset.dual @ new.tangent < 0:
                    new.tangent, new.dual = -new.tangent, -new.dual
                return new
            step /= 2
        message = f"no step off the axisymmetric branch converges at the onset {self.place(onset)}"
        raise SolveError(message, status=Status.STEP_UNDERFLOW)

    def carried(self, point: TippedPoint, onto: TippedProblem) -> TippedPoint:
        """A point in a problem with another number of harmonics, corrected there.

        Raises
        ------
        SolveError
            Where the corrector does not converge.
        """
        own, other = self.tipped.harmonics, onto.tipped.harmonics
        z, dual = (joined(own.carried(part[:-1], other), float(part[-1])) for part in (point.z, point.tangent))
        row = onto.dual(dual)
        rough = TippedPoint(point.state, z, dual, row, point.sigma)  # type: ignore[arg-type]
        new = onto.resolve(z, row, rough)
        new.sigma = point.sigma
        return new


def _balance(evaluation: TippedEvaluation, pressure: float) -> tuple[float, Array]:
    """Largest force out of balance relative to the largest force, and P V' - E'."""
    pushed = pressure * evaluation.volume_gradient
    force = pushed - evaluation.gradient
    return float(np.abs(force).max() / (np.abs(evaluation.gradient).max() + np.abs(pushed).max())), force


def _factor(evaluation: TippedEvaluation) -> BandFactor:
    return BandFactor(evaluation.band)


def compressed(tipped: TippedPotential, x: Array) -> str | None:
    """Where the sheet is compressed, in words; None where it is under tension all over.

    Under compression ever shorter waves have ever lower energies (the Legendre-Hadamard condition), and no state with waves is one.
    """
    least, where = tipped.least_stress(x)
    if least >= -_COMPRESSED:
        return None
    s, angle = where
    return f"the smaller principal stress is {least:.3g} at r = {s:.4g}, theta = {np.degrees(angle):.0f} degrees"
