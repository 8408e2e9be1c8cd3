"""A solved state and the memory of a path that predicts the next one."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from ..errors import Status
from ..potential import Array, Evaluation, Potential
from .banded import BandFactor, band_inner
from .controls import Controlled, PressureControl
from .newton import NewtonResult, correct


@dataclass(slots=True)
class State:
    """An equilibrium as the solvers see it: unknowns, and the evaluation there.

    ``x`` is on the mesh of the scene, ``evaluation.x`` on that which follows borders of contact where there are any.
    ``correction`` is the relative size of the Newton correction at x, ``gap`` the error of the control equation there.
    """

    x: Array
    pressure: float
    evaluation: Evaluation
    iterations: int
    correction: float
    residual: float
    gap: float
    status: Status = Status.CONVERGED
    _factor: BandFactor | None = None

    @classmethod
    def of(cls, result: NewtonResult, extra_iterations: int = 0) -> State:
        """The state of a converged Newton result."""
        if result.status is not Status.CONVERGED:
            raise ValueError("only a converged result is a state")
        iterations = result.iterations + extra_iterations
        return cls(result.x, result.pressure, result.evaluation, iterations, result.correction, result.residual, result.gap)

    @property
    def factor(self) -> BandFactor:
        """Factors of K at x, computed when first asked for."""
        if self._factor is None:
            self._factor = BandFactor.of(self.evaluation)
        return self._factor

    @property
    def volume(self) -> float:
        return self.evaluation.volume

    def value_of(self, controlled: Controlled) -> float:
        """The number that a control holds, in this state."""
        potential = self.evaluation.potential
        value = controlled.value(potential.space, self.x, self.pressure, self.volume)
        return value + potential.pole_rise(self.evaluation.factor) if controlled.name == "center_height" else value


def rests_flat(potential: Potential) -> bool:
    """Whether the undeformed membrane is an equilibrium without load, and has no stiffness there: nothing pulls at it.

    A membrane that is held where it does not rest, or that has stress there, is stretched or compressed without load. Its states there are
    ordinary ones.
    """
    if potential.strained:
        return False
    return not potential.surrounded or not potential.evaluate(np.zeros(potential.space.n_free), 0.0).gradient.any()


def at_rest(potential: Potential, held: Controlled, load: float) -> bool:
    """Whether the membrane at rest is an equilibrium at a load: one without stiffness, which no path leaves or passes."""
    return load == held.rest(potential.space) and rests_flat(potential)


def flat_state(potential: Potential, magnetic: float = 1.0) -> State:
    """The membrane at rest: an equilibrium, and where it is flat one without stiffness, which no path leaves or passes.

    Where sources or loads pull at it, only without them: ``magnetic=0.0``.
    """
    return State.of(correct(potential, PressureControl(0.0), np.zeros(potential.space.n_free), 0.0, magnetic=magnetic))


def inner(potential: Potential, x: Array, p: float, y: Array, q: float) -> float:
    """Mesh-independent inner product of (x, P) and (y, Q), in units of the membrane's own size: mean over the reference area of the
    displacements, plus P Q."""
    space = potential.space
    square = space.unit**2
    return band_inner(potential.mass, space.half_bandwidth, x, y) / (potential.area * square) + p * q * square


def distance(potential: Potential, x: Array, y: Array) -> float:
    """Root mean square of the difference of two displacements over the reference area, in units of the membrane's own size."""
    d, space = x - y, potential.space
    return math.sqrt(max(band_inner(potential.mass, space.half_bandwidth, d, d), 0.0) / (potential.area * space.unit**2))


def displacement(potential: Potential, x: Array) -> float:
    """Root mean square of a displacement, or of that which the places of the ends make where it is larger, in units as :func:`distance`."""
    own = distance(potential, x, np.zeros_like(x))
    return own if potential.space.lift is None else max(own, potential.space.lift_mean)


@dataclass(slots=True)
class Predictor:
    """The last two points of a path z(sigma) with their derivatives: predicts by cubic Hermite extrapolation."""

    sigma: list[float] = field(default_factory=list)
    point: list[Array] = field(default_factory=list)
    slope: list[Array] = field(default_factory=list)

    def append(self, sigma: float, z: Array, slope: Array) -> None:
        self.sigma = [*self.sigma[-1:], sigma]
        self.point = [*self.point[-1:], z]
        self.slope = [*self.slope[-1:], slope]

    def predict(self, sigma: float, moving: bool = False) -> Array:
        """z at sigma: a cubic through the last two points, or the tangent at the only one.

        Where ends of elements move along the branch, slopes are those of one mesh and points are on many. The cubic would magnify the
        difference some ten times. A parabola from the last point has the slopes alone.
        """
        if len(self.sigma) == 1:
            return self.point[0] + (sigma - self.sigma[0]) * self.slope[0]
        h = self.sigma[1] - self.sigma[0]
        if moving:
            ahead = sigma - self.sigma[1]
            bent: Array = (ahead**2 / (2 * h)) * (self.slope[1] - self.slope[0])
            return self.point[1] + ahead * self.slope[1] + bent
        return hermite(self.point[0], self.slope[0], self.point[1], self.slope[1], (sigma - self.sigma[0]) / h, h)


#: numbers or vectors
Values = TypeVar("Values", float, Array)


def joined(x: Array, last: float) -> Array:
    """(x, last) as one vector."""
    z = np.empty(len(x) + 1)
    z[:-1], z[-1] = x, last
    return z


def hermite(a: Values, slope_a: Values, b: Values, slope_b: Values, t: float, length: float = 1.0) -> Values:
    """Cubic with values and slopes, per unit of a length, at t = 0 and t = 1; extrapolates beyond."""
    back = t - 1
    at_a = (1 + 2 * t) * back * back
    z = at_a * a
    z += (length * t * back * back) * slope_a
    z += (1 - at_a) * b
    z += (length * t * t * back) * slope_b
    return z
