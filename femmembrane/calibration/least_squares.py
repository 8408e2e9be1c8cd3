"""Weighted least squares over several tests, with errors in all coordinates.

A state of a test has a place t on its branch (height, volume or stretch). Where t is known, a residual is (f(t, m) - y)/sigma. Where t has
an error of its own it is one more unknown, and its measurement one more residual: total least squares. t is eliminated state by state, so
that the solver sees the numbers m alone::

    S(m) = sum over states of  min over t of  sum_j ((f_j(t, m) - y_j)/sigma_j)^2

With a = df/dt/sigma at the minimum the residuals w are orthogonal to a, and (I - a a^T/a.a) df/dm/sigma is their Jacobian but for terms of
second order in w; the gradient of S is exact (Golub and Pereyra 1973, in the form of Kaufman 1975). For one response beside t this is the
effective variance sigma_y^2 + (dy/dt)^2 sigma_t^2 (Orear 1982), taken at the adjusted point.

Deviations that nobody knows are estimated for each column from its residuals, and weights follow them until both agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..errors import SolveError, Status
from .laws import Law
from .measured import Block, Measured, check_sizes, check_units, iterate, set_deviation

Array = NDArray[np.float64]

#: a state is adjusted when it moves by less than this part of its standard deviation
_ADJUSTED = 1e-3
_MAX_ADJUSTMENTS = 12
#: relative change of an unknown deviation at which it is known
_LEVEL = 5e-3
#: seed of the starts beside the first
_SEED = 20
#: part of its standard error by which a coordinate may be inside a bound and still stand on it
_ON_BOUND = 0.02


@dataclass(eq=False)
class Point:
    """Residuals over their deviations at one set of numbers, with the Jacobian, in the order of the blocks."""

    values: Array
    residuals: Array
    jacobian: Array
    predictions: list[list[tuple[Array, Array]]] = field(repr=False)


@dataclass(eq=False)
class Estimate:
    """Where a fit ended.

    Attributes
    ----------
    point : Point
    on_bound : tuple of int
        Numbers that stand on a bound of what is allowed.
    converged : bool
    message : str
    evaluations : int
    """

    point: Point
    on_bound: tuple[int, ...]
    converged: bool
    message: str
    evaluations: int

    @property
    def cost(self) -> float:
        return float(self.point.residuals @ self.point.residuals)


class Problem:
    """All tests of a fit as one function of the numbers.

    Parameters
    ----------
    law : Law
    tests : sequence of Measured
    """

    def __init__(self, law: Law, tests: Sequence[Measured]) -> None:
        self.law, self.tests = law, tests
        self.evaluations = 0
        self.why = ""
        self.blocks: list[tuple[Measured, Block]] = list(iterate(tests))
        self.slices: list[slice] = []
        start = 0
        for _, block in self.blocks:
            self.slices.append(slice(start, start + len(block.measured)))
            start += len(block.measured)
        self.count = start
        self.free_states = sum(test.count for test in tests if test.latent)
        self._known: Point | None = None

    def fresh(self) -> None:
        """Forget what was computed: weights or data have changed."""
        self._known = None

    @property
    def has_unknown(self) -> bool:
        """Whether some deviation is estimated from residuals."""
        return any(block.noise.unknown for _, block in self.blocks)

    def at(self, values: Array) -> Point | None:
        """Residuals and Jacobian by the values; None where no scene or state exists."""
        if self._known is not None and np.array_equal(self._known.values, values):
            return self._known
        self.evaluations += 1
        residuals, jacobian = np.empty(self.count), np.empty((self.count, len(values)))
        predictions: list[list[tuple[Array, Array]]] = []
        place = 0
        for test in self.tests:
            found = self._adjusted(test, values)
            if found is None:
                self.why = test.predictor.why
                return None
            predictions.append(found)
            w, J, a, state = _stacked(test, found)
            if test.latent:
                total = np.bincount(state, a * a, minlength=test.count)
                for k in range(J.shape[1]):
                    J[:, k] -= a * (np.bincount(state, a * J[:, k], minlength=test.count) / total)[state]
            rows = slice(place, place + len(w))
            residuals[rows], jacobian[rows] = w, J
            place += len(w)
        if not (np.isfinite(residuals).all() and np.isfinite(jacobian).all()):
            return None
        self._known = Point(values.copy(), residuals, jacobian, predictions)
        return self._known

    def _adjusted(self, test: Measured, values: Array) -> list[tuple[Array, Array]] | None:
        """Predictions at the places of the states that suit their measurements best."""
        found = test.predict(values)
        if found is None or not test.latent:
            return found
        kept, size = test.targets.copy(), np.abs(test.targets) + 1e-12
        for _ in range(_MAX_ADJUSTMENTS):
            w, _, a, state = _stacked(test, found)
            total = np.bincount(state, a * a, minlength=test.count)
            step = -np.bincount(state, a * w, minlength=test.count) / np.maximum(total, 1e-300)
            if (np.abs(step) * np.sqrt(total) < _ADJUSTED).all():
                return found
            before = test.targets
            test.targets = before + np.clip(step, -0.3 * size, 0.3 * size)
            found = test.predict(values)
            if found is None:
                test.targets = kept
                return None
        return found

    # --- the solver

    def minimise(self, start: Array, fixed: Sequence[int] = (), max_evaluations: int = 60, tolerance: float = 1e-9) -> Estimate:
        """The least squares from one start, with some numbers fixed; the tolerance is that of the sum of squares.

        Raises
        ------
        SolveError
            When the start itself has no prediction.
        """
        law, before = self.law, self.evaluations
        moving = [k for k in range(len(start)) if k not in fixed]
        low, high = law.bounds
        x0 = law.to_coordinates(start)
        inside = _strictly_inside(x0, low, high)
        x0[moving] = inside[moving]

        def values_of(x: Array) -> Array:
            full = x0.copy()
            full[moving] = x
            return law.from_coordinates(full)

        def residuals(x: Array) -> Array:
            point = self.at(values_of(x))
            return np.full(self.count, np.nan) if point is None else point.residuals

        def jacobian(x: Array) -> Array:
            values = values_of(x)
            point = self.at(values)
            if point is None:  # the solver asks where it found residuals
                raise ArithmeticError(self.why)
            matrix: Array = (point.jacobian @ law.slopes(values))[:, moving]
            return matrix

        if not np.isfinite(residuals(x0[moving])).all():
            raise SolveError(f"the start has no prediction for all rows: {self.why}", status=Status.NOT_CONVERGED)
        found = least_squares(
            residuals,
            x0[moving],
            jac=jacobian,
            bounds=(low[moving], high[moving]),
            x_scale="jac",
            ftol=tolerance,
            xtol=1e-9,
            gtol=1e-12,
            max_nfev=max_evaluations,
        )
        point = self.at(values_of(found.x))
        if point is None:
            raise SolveError(self.why, status=Status.NOT_CONVERGED)
        return Estimate(
            point,
            (),
            found.status > 0,
            "" if found.status > 0 else f"{max_evaluations} evaluations did not suffice",
            self.evaluations - before,
        )

    def on_bounds(self, estimate: Estimate, fixed: Sequence[int] = ()) -> Estimate:
        """The estimate with numbers that lean on a bound put onto it."""
        law, point = self.law, estimate.point
        x, (low, high) = law.to_coordinates(point.values), law.bounds
        J = point.jacobian @ law.slopes(point.values)
        gradient = J.T @ point.residuals
        sizes = 1 / np.maximum(np.sqrt((J * J).sum(axis=0)), 1e-300)
        leaning = []
        for k in range(len(x)):
            if k in fixed:
                continue
            for bound, outward in ((low[k], gradient[k] > 0), (high[k], gradient[k] < 0)):
                if np.isfinite(bound) and outward and abs(x[k] - bound) < _ON_BOUND * sizes[k]:
                    leaning.append((k, bound))
        if not leaning:
            return estimate
        for k, bound in leaning:
            x[k] = bound
        held = tuple(k for k, _ in leaning)
        values = law.from_coordinates(x)
        if len(held) + len(fixed) == len(x):
            at = self.at(values)
            return estimate if at is None else Estimate(at, held, estimate.converged, estimate.message, estimate.evaluations)
        again = self.minimise(values, (*fixed, *held))
        return Estimate(again.point, held, again.converged, again.message, estimate.evaluations + again.evaluations)

    # --- the whole fit

    def estimate(self, starts: int) -> Estimate:
        """The best of several starts, with all weights in agreement with it."""
        first = self._first_start()
        best: Estimate | None = None
        failure: SolveError | None = None
        for start in self._starts(first, starts):
            try:
                found = self.minimise(start)
            except SolveError as error:
                failure = failure or error
                continue
            if best is None or found.cost < 0.999 * best.cost:
                best = found
        if best is None:
            raise failure or SolveError("no start has a prediction", status=Status.NOT_CONVERGED)
        return self.on_bounds(self.reweighted(best))

    def _first_start(self) -> Array:
        """The numbers of the scene, with moduli by which predictions are as large as the data."""
        law = self.law
        values = law.from_coordinates(_strictly_inside(law.to_coordinates(law.start), *law.bounds))
        check_sizes(self.tests)
        point = self.at(values)
        if point is None:
            return values
        check_units(self.tests, point.predictions)
        moduli = [k for k, name in enumerate(law.names) if law.is_modulus(name)]
        ratios = [
            block.measured / value
            for test, found in zip(self.tests, point.predictions, strict=True)
            for block, (value, _) in zip(test.blocks, found, strict=True)
            if block.name == "pressure" or block.name.endswith("stress")
        ]
        ratio = float(np.median(np.concatenate(ratios))) if ratios else 1.0
        if moduli and np.isfinite(ratio) and ratio > 0 and not 0.8 < ratio < 1.25:
            values = values.copy()
            values[moduli] *= ratio
        return values

    def _starts(self, first: Array, count: int) -> list[Array]:
        """The first start and others around it: moduli and exponents by factors of about 1.5."""
        law, rng = self.law, np.random.default_rng(_SEED)
        starts = [first]
        x = law.to_coordinates(first)
        for _ in range(count - 1):
            move = rng.normal(0.0, 0.4, len(x))
            other = np.array(
                [v + m if c.logarithmic else v + m * (abs(v) or 0.0) for v, m, c in zip(x, move, law.coordinates, strict=True)]
            )
            starts.append(law.from_coordinates(_strictly_inside(other, *law.bounds)))
        return starts

    def reweighted(self, estimate: Estimate) -> Estimate:
        """The fit with deviations that follow predictions and residuals, until they stay."""
        relative = any(block.noise.relative for _, block in self.blocks)
        if not (relative or self.has_unknown):
            return estimate
        for _ in range(12):
            moved = self._set_deviations(estimate.point)
            self.fresh()
            if moved < _LEVEL:
                break
            alone = self.has_unknown and not relative and len(self.blocks) == 1 and not self.free_states
            if alone:  # one level common to all residuals moves no minimum
                point = self.at(estimate.point.values)
                estimate = estimate if point is None else replace(estimate, point=point)
            else:
                estimate = self.minimise(estimate.point.values)
        point = self.at(estimate.point.values)
        if point is None:
            raise SolveError(self.why, status=Status.NOT_CONVERGED)
        return Estimate(point, estimate.on_bound, estimate.converged, estimate.message, estimate.evaluations)

    def _set_deviations(self, point: Point) -> float:
        """New deviations; the largest relative change of one."""
        leverage = self._leverage(point)
        predictions = [value for found in point.predictions for value, _ in found]
        moved = 0.0
        for (_, block), rows, predicted in zip(self.blocks, self.slices, predictions, strict=True):
            before = block.deviation
            if block.noise.unknown:
                spare = max(len(block.measured) - float(leverage[rows].sum()), 0.5)
                square = float(point.residuals[rows] @ point.residuals[rows]) / spare
                size = float(np.abs(block.measured).max(initial=0.0)) or 1.0
                block.level = max(float(before[0]) * np.sqrt(square), 1e-9 * size)
            set_deviation(block, predicted)
            moved = max(moved, float(np.abs(block.deviation / before - 1).max(initial=0.0)))
        return moved

    def _leverage(self, point: Point) -> Array:
        """How much of each residual the numbers, and the places of states, take up."""
        own = _row_space(point.jacobian)
        leverage: Array = (own * own).sum(axis=1)
        place = 0
        for test, found in zip(self.tests, point.predictions, strict=True):
            _, _, a, state = _stacked(test, found)
            if test.latent:
                total = np.bincount(state, a * a, minlength=test.count)
                leverage[place : place + len(a)] += a * a / total[state]
            place += len(a)
        return leverage

    @property
    def freedom(self) -> int:
        """Measured numbers less what is adjusted to them."""
        return self.count - self.free_states - len(self.law.names)


def _stacked(test: Measured, found: list[tuple[Array, Array]]) -> tuple[Array, Array, Array, NDArray[np.int64]]:
    """Residuals, derivatives by the numbers and by the places, all over their deviations, and states."""
    w = np.concatenate([(value - block.measured) / block.deviation for block, (value, _) in zip(test.blocks, found, strict=True)])
    D = np.concatenate([d / block.deviation[:, None] for block, (_, d) in zip(test.blocks, found, strict=True)])
    return w, D[:, :-1].copy(), D[:, -1], np.concatenate([block.state for block in test.blocks])


def _row_space(J: Array) -> Array:
    """An orthonormal basis of the columns, those without any length left out."""
    u, s, _ = np.linalg.svd(J / np.maximum(np.sqrt((J * J).sum(axis=0)), 1e-300), full_matrices=False)
    kept: Array = u[:, s > 1e-12 * s[0]]
    return kept


def _strictly_inside(x: Array, low: Array, high: Array) -> Array:
    """Coordinates that stand on a bound moved inside: the solver starts there."""
    room = np.where(np.isfinite(high - low), high - low, np.maximum(1.0, np.abs(x)))
    return np.minimum(np.maximum(x, low + 1e-6 * room), high - 1e-6 * room)
