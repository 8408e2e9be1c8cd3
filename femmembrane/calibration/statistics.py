"""What data say about numbers: standard errors, intervals, and which combinations they determine.

With the Jacobian J of residuals over their deviations the covariance is (J^T J)^-1, exact for a prediction that is linear in the numbers
and normal errors; with deviations estimated from m - p residuals quantiles are Student's. Where the prediction is curved, an interval is
the set of values at which the least sum of squares over all other numbers exceeds the minimum by the square of that quantile: profile
likelihood (Venzon and Moolgavkar 1988).

A number on a bound has no smooth minimum there. Intervals that a bound cuts are those of the linear problem without it, and all others
are then linearised too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ..errors import SolveError
from .laws import Law
from .least_squares import Estimate, Problem

Array = NDArray[np.float64]

#: relative standard error up to which a number counts as determined: its 95 % interval is within half its value
DETERMINED = 0.25
#: relative departure of the profile at the ends of a linearised interval from which on it is followed, and to which its end is found
_CURVED, _CLOSE = 0.05, 0.01
#: how far a profile is followed, in half widths of the linearised interval, and in how many steps
_FARTHEST, _MOST_STEPS = 6.0, 12


@dataclass(frozen=True, eq=False)
class Spread:
    """Covariance of the numbers, linearised.

    Attributes
    ----------
    covariance : ndarray, shape (p, p)
    errors : ndarray, shape (p,)
        Standard errors; infinite for what no row depends on.
    correlation : ndarray, shape (p, p)
    singular_values : ndarray, shape (p,)
        Of the Jacobian by logarithms of the numbers: 1/standard error of each combination.
    combinations : ndarray, shape (p, p)
        As rows the exponents of each combination, the best determined first.
    """

    covariance: Array
    errors: Array
    correlation: Array
    singular_values: Array
    combinations: Array


def spread_of(jacobian: Array, values: Array) -> Spread:
    """The covariance that belongs to a Jacobian of residuals over their deviations."""
    size = np.sqrt((jacobian * jacobian).sum(axis=0))
    seen = size > 0
    scaled = jacobian / np.where(seen, size, 1.0)
    _, s, vt = np.linalg.svd(scaled, full_matrices=False)
    s = np.concatenate([s, np.zeros(len(values) - len(s))])
    vt = vt if len(vt) == len(values) else np.linalg.svd(scaled)[2]
    inverse = np.where(s > 1e-13 * max(float(s[0]), 1e-300), 1 / np.maximum(s, 1e-300), 1e150)
    root = (vt.T * inverse) / np.where(seen, size, 1.0)[:, None]
    with np.errstate(all="ignore"):
        covariance = root @ root.T
        errors = np.sqrt(np.diag(covariance))
        errors = np.where(errors > 1e100, np.inf, errors)
        bounded = np.where(np.isfinite(errors), errors, 1.0)
        correlation = np.where(np.isfinite(errors)[:, None] & np.isfinite(errors)[None, :], covariance / np.outer(bounded, bounded), 0.0)
    np.fill_diagonal(correlation, 1.0)
    _, t, w = np.linalg.svd(jacobian * np.abs(values), full_matrices=True)
    t = np.concatenate([t, np.zeros(len(values) - len(t))])[: len(values)]
    return Spread(covariance, errors, np.clip(correlation, -1.0, 1.0), t, w)


def quantile(level: float, freedom: int, unknown: bool) -> float:
    """Half width of an interval in standard errors."""
    if unknown:
        return float(stats.t.ppf(0.5 + level / 2, max(freedom, 1)))
    return float(stats.norm.ppf(0.5 + level / 2))


def linear_intervals(problem: Problem, estimate: Estimate, spread: Spread, half: float) -> Array:
    """Intervals of the linearised problem, cut at bounds, shape (p, 2)."""
    law, values = problem.law, estimate.point.values
    centre = values
    if estimate.on_bound:
        J = estimate.point.jacobian
        size = np.maximum(np.sqrt((J * J).sum(axis=0)), 1e-300)
        centre = values - np.linalg.lstsq(J / size, estimate.point.residuals, rcond=1e-13)[0] / size
    found = np.stack([centre - half * spread.errors, centre + half * spread.errors], axis=1)
    low, high = value_bounds(law)
    return np.clip(found, low[:, None], high[:, None])


def value_bounds(law: Law) -> tuple[Array, Array]:
    """Bounds of the values, those of their sign included."""
    low = np.array([(0.0 if c.sign > 0 else -math.inf) if c.logarithmic else c.low for c in law.coordinates])
    high = np.array([(0.0 if c.sign < 0 else math.inf) if c.logarithmic else c.high for c in law.coordinates])
    return low, high


def profile_intervals(
    problem: Problem, estimate: Estimate, spread: Spread, half: float, linear: Array, which: Sequence[int]
) -> tuple[Array, list[int]]:
    """Intervals by profile likelihood of those numbers whose linearised ones are not good enough, and which these are.

    The values at which the prediction breaks off, or beyond 12 standard errors, are infinite ends.
    """
    followed: list[int] = []
    found = linear.copy()
    if cut_by_bound(problem.law, linear):
        return found, followed
    for k in which:
        if k in estimate.on_bound or not np.isfinite(spread.errors[k]) or problem.law.has_edge(k):
            continue
        sides = [Side(problem, estimate, spread, k, sign, half) for sign in (-1.0, 1.0)]
        heights = [side.height(half) for side in sides]
        if all(abs(height - 1) < _CURVED for height in heights):
            continue
        followed.append(k)
        low, high = (side.end(height) for side, height in zip(sides, heights, strict=True))
        found[k] = low, high
    problem.at(estimate.point.values)
    return found, followed


def cut_by_bound(law: Law, linear: Array) -> bool:
    """Whether a bound cuts an interval: the least sum of squares over all other numbers has kinks within them then."""
    pairs = zip(law.coordinates, linear, strict=True)
    return any(not c.logarithmic and (low <= c.low or high >= c.high) for c, (low, high) in pairs)


class Side:
    """One side of the profile of a number."""

    def __init__(self, problem: Problem, estimate: Estimate, spread: Spread, k: int, sign: float, half: float) -> None:
        self.problem, self.estimate, self.k, self.sign, self.half = problem, estimate, k, sign, half
        self.error = float(spread.errors[k])
        self.direction = spread.covariance[:, k] / spread.covariance[k, k]
        self.last = estimate.point.values, 0.0
        self.low, self.high = (float(b[k]) for b in value_bounds(problem.law))

    def value(self, distance: float) -> float:
        return float(self.estimate.point.values[self.k] + self.sign * distance * self.error)

    def height(self, distance: float) -> float:
        """Root of the sum of squares above its minimum, over the quantile: 1 at the end of the interval, distance/quantile where linear.

        Infinite beyond a bound, and where nothing is found.
        """
        value = self.value(distance)
        if not self.low < value < self.high:
            return math.inf
        law = self.problem.law
        values, _ = self.last
        start = values + self.direction * (value - values[self.k])
        low, high = value_bounds(law)
        if not ((start > low) & (start < high)).all():
            start = values.copy()
        start[self.k] = value
        try:
            if len(start) == 1:
                point = self.problem.at(start)
                if point is None:
                    return math.inf
                cost = float(point.residuals @ point.residuals)
            else:
                found = self.problem.minimise(start, (self.k,), max_evaluations=25, tolerance=1e-4)
                cost, start = found.cost, found.point.values
        except SolveError:
            return math.inf
        self.last = start, distance
        return math.sqrt(max(cost - self.estimate.cost, 0.0)) / self.half

    def end(self, first: float) -> float:
        """Where the profile reaches the quantile; ``first`` is its height at the linearised end."""
        known, distance, height = [(0.0, 0.0)], self.half, first
        beyond = math.inf
        for _ in range(_MOST_STEPS):
            if abs(height - 1) < _CLOSE:
                return self.value(distance)
            if height > 1:
                beyond = min(beyond, distance)
            if height < math.inf:
                known = sorted([*known, (height, distance)])
            if height < 1 and distance >= _FARTHEST * self.half:
                return self.low if self.sign < 0 else self.high
            distance = self._next(known, beyond)
            height = self.height(distance)
        return self.value(distance)

    def _next(self, known: list[tuple[float, float]], beyond: float) -> float:
        """The next distance, by a line or a parabola through what is known."""
        least = max(d for h, d in known if h < 1)
        near = sorted(known, key=lambda pair: abs(pair[0] - 1))[:3]
        if len(near) == 1:  # nothing was found beyond the bound
            return min((least + min(beyond, 2 * self.half)) / 2, 0.98 * beyond)
        guess = 0.0
        for i, (h, d) in enumerate(near):
            weight = d
            for j, (other, _) in enumerate(near):
                if i != j:
                    weight *= (1 - other) / (h - other) if h != other else 1.0
            guess += weight
        top = min(beyond, 2.5 * least + self.half)
        return guess if least < guess < top else (least + top) / 2


# --- which combinations are determined


@dataclass(frozen=True)
class Combination:
    """A product of powers of numbers.

    Attributes
    ----------
    name : str
    error : float
        Relative standard error.
    """

    name: str
    error: float


def relative_error(spread: Spread, exponents: Array) -> float:
    """Relative standard error of the product of powers of the numbers."""
    along = spread.combinations @ exponents
    along = np.where(np.abs(along) < 1e-9 * np.abs(exponents).max(initial=1e-300), 0.0, along)
    with np.errstate(all="ignore"):
        parts = np.where(along == 0, 0.0, along / spread.singular_values)
    found = float(np.sqrt((parts * parts).sum()))
    return found if math.isfinite(found) else math.inf


def determined_combinations(law: Law, values: Array, spread: Spread) -> list[Combination]:
    """The combinations of the numbers that are determined where not all numbers are, in words."""
    count = int((spread.singular_values > 1 / DETERMINED).sum())
    short = [short_name(name) for name in law.names]
    with np.errstate(all="ignore"):
        errors = spread.errors / np.abs(values)
    alone = [k for k in range(len(values)) if errors[k] <= DETERMINED]
    found = [Combination(short[k], float(errors[k])) for k in alone]
    rest = [k for k in range(len(values)) if k not in alone]
    left = count - len(alone)
    if left > 0 and len(rest) >= 2:
        best = []
        for i, k in enumerate(rest):
            for j in rest[i + 1 :]:
                for exponent in (1.0, -1.0, 0.5, 2.0):
                    powers = np.zeros(len(values))
                    powers[k], powers[j] = 1.0, exponent
                    best.append((relative_error(spread, powers), abs(exponent) != 1, _product(short, powers)))
        good = sorted(c for c in best if c[0] <= DETERMINED)
        if good:
            plain = [c for c in good if c[0] < 3 * good[0][0] and not c[1]]
            error, _, name = (plain or good)[0]
            found.append(Combination(name, error))
            left -= 1
    if left > 0 and law.by_moduli and not any(c.name == "mu" for c in found):
        error = modulus_error(law, values, spread)
        if error <= DETERMINED and not any(abs(c.error - error) < 1e-3 * error for c in found):
            found.insert(0, Combination("the shear modulus at rest", error))
    if not found and count:
        powers = spread.combinations[0] / np.abs(spread.combinations[0]).max()
        powers = np.where(np.abs(powers) < 0.05, 0.0, np.round(powers, 2))
        error = relative_error(spread, powers)
        if error <= DETERMINED:
            found.append(Combination(_product(short, powers), error))
    return found


def modulus_error(law: Law, values: Array, spread: Spread) -> float:
    """Relative standard error of the shear modulus at rest that follows from moduli."""
    own = law.shear_modulus(values)
    powers = np.zeros(len(values))
    for k, value in enumerate(values):
        moved = values.copy()
        moved[k] = value * (1 + 1e-6)
        try:
            powers[k] = (law.shear_modulus(moved) / own - 1) / 1e-6
        except ValueError:
            return math.inf
    powers[np.abs(powers) < 1e-8] = 0.0
    return relative_error(spread, powers)


def short_name(name: str) -> str:
    """A number without the table that it stands in, where that is the material."""
    return name.removeprefix("material.")


def _product(names: Sequence[str], powers: Array) -> str:
    parts = []
    for name, power in zip(names, powers, strict=True):
        if power:
            parts.append(name if power == 1 else f"{name}^{power:g}")
    return " ".join(parts)
