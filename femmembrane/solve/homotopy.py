"""From a state that certainly exists to a wanted state, by arc length in what holds or pulls the membrane.

Every equilibrium is a root of R(x, P) = E' - P V' and of a control N(x, P). Two families of problems lead to it, each with a number t
that is 0 where a state is known and 1 where it is wanted:

* :class:`Held`: dead forces hold a guess in its place, and fade out, R - (1 - t) R_0 = 0, N - (1 - t) N_0 = 0 with the residuals R_0, N_0
  of the guess. At t = 0 the guess is an equilibrium, whatever it is. One whole step from there is Newton's method.
* :class:`Fields`: sources and loads are turned on, with the factor t on their energy.

The path of (x, P, t) is followed by arc length, so that it may turn back in t, for a bounded number of steps. Where the path leads depends
on the guess. Its last point is solved as an equilibrium, whatever the guess.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..errors import Status
from ..potential import Array, Evaluation, Potential
from .banded import BandFactor, BorderedFactor, WideBorder, band_product
from .controls import Control
from .newton import NewtonResult, correct, relative_size
from .state import State, distance

#: largest number of steps along a path, and of corrections in a step
MAX_STEPS, _MAX_CORRECTIONS = 150, 8
#: first and smallest step, in the arc length of (displacement over its size at first, t)
_FIRST, _SMALLEST = 0.1, 1e-5
#: correction at which a point of the path is good enough to go on from; and largest change by the corrector, over the step
_CLOSE, _MISS = 1e-7, 0.3


@dataclass(slots=True)
class Residual:
    """Residuals of force and control at one (x, P, t), with the derivatives that a Newton step needs beside the stiffness."""

    evaluation: Evaluation
    force: Array
    gap: float
    row: Array
    corner: float
    force_t: Array
    gap_t: float

    @property
    def finite(self) -> bool:
        return bool(np.isfinite(self.force).all() and np.isfinite(self.evaluation.stiffness_density).all())


class Family(Protocol):
    """Problems that t leads from one to the other."""

    potential: Potential

    def at(self, x: Array, pressure: float, t: float) -> Residual:
        """Residuals at (x, P, t)."""

    def solve(self, x: Array, pressure: float) -> NewtonResult:
        """The problem at t = 1, from a guess next to its solution."""


class Held:
    """Dead forces that hold a guess fade out; ``magnetic`` is the factor on sources and loads throughout."""

    def __init__(self, potential: Potential, control: Control, x: Array, pressure: float, magnetic: float = 1.0) -> None:
        self.potential, self.control, self.magnetic = potential, control, magnetic
        self._force, self._gap = np.zeros_like(x), 0.0
        start = self.at(x, pressure, 0.0)
        self._force, self._gap = start.force, start.gap

    def at(self, x: Array, pressure: float, t: float) -> Residual:
        evaluation = self.potential.evaluate(x, pressure, self.magnetic)
        force = evaluation.gradient - pressure * evaluation.volume_gradient - (1 - t) * self._force
        gap, row, corner = self.control.equation(self.potential.space, x, pressure, evaluation)
        return Residual(evaluation, force, gap - (1 - t) * self._gap, row, corner, self._force, self._gap)

    def solve(self, x: Array, pressure: float) -> NewtonResult:
        return correct(self.potential, self.control, x, pressure, magnetic=self.magnetic, damped=True)


class Fields:
    """Sources and loads are turned on under one control."""

    def __init__(self, potential: Potential, control: Control) -> None:
        self.potential, self.control = potential, control

    def at(self, x: Array, pressure: float, t: float) -> Residual:
        evaluation = self.potential.evaluate(x, pressure, t)
        gap, row, corner = self.control.equation(self.potential.space, x, pressure, evaluation)
        force = evaluation.gradient - pressure * evaluation.volume_gradient
        return Residual(evaluation, force, gap, row, corner, self.potential.factor_derivative(evaluation, pressure, t), 0.0)

    def solve(self, x: Array, pressure: float) -> NewtonResult:
        return correct(self.potential, self.control, x, pressure, damped=True)


@dataclass(slots=True)
class _Point:
    """A point of the path with its unit tangent, all as (x, P, t), and the tangent as a row."""

    z: Array
    tangent: Array
    dual: Array


def follow_homotopy(family: Family, x: Array, pressure: float, *, accept: Callable[[State], bool] | None = None) -> State | None:
    """The state at t = 1 at the end of the path through (x, P) at t = 0; None where it is not met within the bounds.

    Parameters
    ----------
    family : Held or Fields
    x, pressure : ndarray, float
        The solution at t = 0.
    accept : callable, optional
        Which states will do; the path goes on beyond others, and may come back to t = 1.
    """
    path = _Path(family, x)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # a trial step may be absurd: it is refused by its result
        point = path.first(np.concatenate([x, [pressure, 0.0]]))
        step = _FIRST
        for _ in range(MAX_STEPS):
            if point is None or step < _SMALLEST:
                return None
            new, quality = path.attempt(point, step)
            if new is not None and (point.z[-1] - 1) * (new.z[-1] - 1) <= 0:
                state = path.landing(point, new)
                if state is None:
                    new, quality = None, 0.25
                elif accept is None or accept(state):
                    return state
            if new is not None:
                point = new
            step = step * quality
    return None


class _Path:
    """The steps of one path, in an arc length of displacements over the size of the first ones."""

    def __init__(self, family: Family, x: Array) -> None:
        self.family, self.potential = family, family.potential
        self._size = distance(self.potential, x, np.zeros_like(x)) or 1.0
        self._iterations = 0

    def first(self, z: Array) -> _Point | None:
        """The start with its tangent towards larger t."""
        row = np.zeros_like(z)
        row[-1] = 1.0
        here = self.family.at(z[:-2], z[-2], 0.0)
        return self._with_tangent(z, here, row) if here.finite else None

    def attempt(self, point: _Point, step: float) -> tuple[_Point | None, float]:
        """The point one step further, or None; and the factor for the next step."""
        guess = point.z + step * point.tangent
        z, previous = guess, np.inf
        for iteration in range(_MAX_CORRECTIONS):
            here = self.family.at(z[:-2], z[-2], z[-1])
            if not here.finite:
                return None, 0.25
            dz = self._solve(here, point.dual, [-here.gap, -float(point.dual @ (z - guess))])
            if dz is None:
                return None, 0.5
            size = max(relative_size(self.potential, dz[:-2], z[:-2]), abs(dz[-1]))
            z = z + dz
            if size <= _CLOSE:
                return self._judged(point, guess, z, step, iteration)
            if not size < np.inf or size > 2 * previous:
                return None, 0.5
            previous = size
        return None, 0.5

    def _judged(self, point: _Point, guess: Array, z: Array, step: float, iterations: int) -> tuple[_Point | None, float]:
        miss = self._length(z - guess) / step
        if miss > _MISS or self.potential.passed_source(point.z[:-2], z[:-2]):
            return None, 0.5
        here = self.family.at(z[:-2], z[-2], z[-1])
        new = self._with_tangent(z, here, point.dual) if here.finite else None
        if new is None or point.dual @ new.tangent < 0.5:
            return None, 0.5
        return new, 2.0 if miss < _MISS / 4 and iterations < 4 else 1.0

    def landing(self, a: _Point, b: _Point) -> State | None:
        """The state at t = 1 between two points of the path."""
        share = (1 - a.z[-1]) / (b.z[-1] - a.z[-1]) if b.z[-1] != a.z[-1] else 1.0
        z = a.z + share * (b.z - a.z)
        result = self.family.solve(z[:-2], float(z[-2]))
        reach = self._length(np.append((b.z - a.z)[:-1], 0.0))
        moved = distance(self.potential, result.x, z[:-2]) / self._size
        if result.status is not Status.CONVERGED or moved > reach + 1e-9:
            return None
        return State.of(result)

    def _with_tangent(self, z: Array, here: Residual, row: Array) -> _Point | None:
        tangent = self._solve(here, row, [0.0, 1.0], at_rest=True)
        if tangent is None:
            return None
        tangent = tangent / self._length(tangent)
        return _Point(z, tangent, self._dual(tangent))

    def _solve(self, here: Residual, row: Array, right: list[float], *, at_rest: bool = False) -> Array | None:
        """The Newton step for (R, N, row . (x, P, t)) with what the last two are to change by; ``at_rest`` leaves R as it is."""
        border = here.evaluation.volume_gradient
        deflated = BorderedFactor(BandFactor.of(here.evaluation), border, border, 0.0)
        corner = np.array([[here.corner, here.gap_t], [row[-2], row[-1]]])
        try:
            wide = WideBorder(deflated, [-border, here.force_t], [here.row, row[:-2]], corner)
            dx, rest = wide.solve(None if at_rest else -here.force, right)
        except np.linalg.LinAlgError:
            return None
        dz = np.concatenate([dx, rest])
        return dz if np.isfinite(dz).all() else None

    def _dual(self, z: Array) -> Array:
        potential = self.potential
        weighed = band_product(potential.mass, potential.space.half_bandwidth, z[:-2])
        return np.concatenate([weighed / (potential.area * (potential.space.unit * self._size) ** 2), [0.0, z[-1]]])

    def _length(self, z: Array) -> float:
        return math.sqrt(max(float(self._dual(z) @ z), 0.0))
