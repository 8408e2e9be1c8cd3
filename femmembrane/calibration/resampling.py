"""Fits to data sets that might have been measured: the parametric bootstrap (Efron 1979), and what intervals cover.

A data set is the prediction at given numbers plus normal errors with the deviations of the measurements. Each is fitted from those numbers
on, with the potential and the states at hand.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import SolveError, Status
from .least_squares import Estimate, Problem
from .statistics import Side, Spread, cut_by_bound, linear_intervals, quantile, spread_of

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Refit:
    """One fit to a data set that was drawn.

    Attributes
    ----------
    estimate : Estimate
    spread : Spread
    intervals : ndarray, shape (p, 2)
        Linearised, at 95 %.
    """

    estimate: Estimate
    spread: Spread
    intervals: Array


def inside(problem: Problem, refit: Refit, truth: Array) -> NDArray[np.bool_]:
    """Which intervals by profile likelihood hold the truth, while the problem has the data of the fit; linearised ones of what has none."""
    half = quantile(0.95, problem.freedom, problem.has_unknown)
    found = (refit.intervals[:, 0] <= truth) & (truth <= refit.intervals[:, 1])
    if cut_by_bound(problem.law, refit.intervals):
        return found
    for k, value in enumerate(refit.estimate.point.values):
        if k not in refit.estimate.on_bound and not problem.law.has_edge(k) and value != truth[k]:
            side = Side(problem, refit.estimate, refit.spread, k, float(np.sign(truth[k] - value)), half)
            found[k] = side.height(abs(truth[k] - value) / float(refit.spread.errors[k])) <= 1
    return found


def refits(problem: Problem, values: Array, count: int, seed: int) -> Iterator[Refit | None]:
    """Fits to data sets drawn around the predictions at some numbers; None for one without a fit.

    The measured numbers of the problem are those of the last data set afterwards.

    Raises
    ------
    SolveError
        When there is no prediction at the numbers.
    """
    rng = np.random.default_rng(seed)
    point = problem.at(values)
    if point is None:
        raise SolveError(problem.why, status=Status.NOT_CONVERGED)
    predictions = [value.copy() for found in point.predictions for value, _ in found]
    deviations = [block.deviation.copy() for _, block in problem.blocks]
    targets = [test.targets.copy() for test in problem.tests]
    half = quantile(0.95, problem.freedom, problem.has_unknown)
    for _ in range(count):
        for test, own in zip(problem.tests, targets, strict=True):
            test.targets = own.copy()
        for (_, block), value, deviation in zip(problem.blocks, predictions, deviations, strict=True):
            block.measured = value + deviation * rng.normal(size=len(value))
            block.deviation = deviation
        problem.fresh()
        try:
            estimate = problem.on_bounds(problem.reweighted(problem.minimise(values)))
        except SolveError:
            yield None
            continue
        spread = spread_of(estimate.point.jacobian, estimate.point.values)
        yield Refit(estimate, spread, linear_intervals(problem, estimate, spread, half))
