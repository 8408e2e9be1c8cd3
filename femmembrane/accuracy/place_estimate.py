"""Errors of the places of special points, estimated by locating them again in a finer space.

The branch of the finer space is met in planes across the branch, at a few small steps along its tangent (:func:`.finer_space.met_across` in
one of them). A special point is where a function along the branch is zero: dP of a limit point, dV and dh of folds, the smallest
eigenvalue of an azimuthal onset. The secant method finds its zero in the finer space.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..discretization.space import transferred
from ..errors import Status
from ..potential import Array, Potential, potential_of
from ..results.error_estimate import PlaceEstimate, place_from_numbers
from ..scene import Scene
from ..solve.banded import BorderedFactor
from ..solve.branch import BranchProblem, corrected, tangent_at, unit_point
from ..solve.continuation import BranchPoint
from ..solve.newton import NewtonResult
from ..solve.state import State, joined
from ..solve.wellposed import ill_posed
from ..stability.azimuthal import azimuthal_verdict
from ..stability.spectrum import SpectrumError
from .error_estimate import finer_space

#: first step along the branch, over the size of the state, and the step at which the secant method has arrived
_STEP, _ARRIVED = 1e-3, 1e-9
#: most secant steps
_MOST = 12


def estimate_place(potential: Potential, x: Array, pressure: float, kind: str, azimuthal: int) -> PlaceEstimate:
    """Estimate the errors of P, V and the height of a special point.

    Parameters
    ----------
    potential : Potential
    x, pressure : ndarray, shape (n_free,), float
        Its state.
    kind : str
        limit_point, volume_fold, height_fold or azimuthal_onset; points of other kinds have no estimate.
    azimuthal : int
        The waves of an onset.
    """
    evaluation = potential.evaluate(x, pressure)
    values = _numbers(potential, x, pressure, evaluation.volume)
    scene, method = finer_space(potential, evaluation, pressure)
    method = method.replace("against the same load", "the point located again")
    if kind not in _ZERO:
        return place_from_numbers(values, None, method, f"not estimated: a {kind.replace('_', ' ')} is not located again")
    if (bad := ill_posed(potential, evaluation)) is not None:
        return place_from_numbers(values, None, method, f"not estimated: {bad}, and what a mesh finds depends on the mesh")
    finer = _Finer(potential_of(scene), potential, _with_tangent(potential, State(x, pressure, evaluation, 0, 0.0, 0.0, 0.0), kind))
    try:
        found = finer.located(_ZERO[kind], azimuthal)
    except SpectrumError as error:
        return place_from_numbers(values, None, method, f"not estimated: {error}")
    if found is None:
        return place_from_numbers(values, None, method, "not estimated: the finer space has no such point near by")
    state = found.state
    return place_from_numbers(values, _numbers(finer.onto, state.x, state.pressure, state.evaluation.volume), method, "")


def estimate_place_in(scene: Scene, potential: Potential, x: Array, pressure: float, kind: str, azimuthal: int) -> dict[str, float] | None:
    """P, V and the height of a special point located again on the mesh of a scene; None where it is not found there.

    Parameters
    ----------
    scene : Scene
        On a finer mesh.
    potential, x, pressure, kind, azimuthal
        As for :func:`estimate_place`.
    """
    if kind not in _ZERO:
        return None
    evaluation = potential.evaluate(x, pressure)
    point = _with_tangent(potential, State(x, pressure, evaluation, 0, 0.0, 0.0, 0.0), kind)
    finer = _Finer(potential_of(scene), potential, point)
    try:
        found = finer.located(_ZERO[kind], azimuthal)
    except SpectrumError:
        return None
    return None if found is None else _numbers(finer.onto, found.state.x, found.state.pressure, found.state.evaluation.volume)


def _numbers(potential: Potential, x: Array, pressure: float, volume: float) -> dict[str, float]:
    return {"pressure": float(pressure), "volume": float(volume), "center_height": potential.space.center_height(x)}


def _with_tangent(potential: Potential, state: State, kind: str) -> BranchPoint:
    """The point of a state with its tangent, regular at the fold that it is."""
    gradient, nothing = state.evaluation.volume_gradient, np.zeros_like(state.x)
    border = (nothing, 1.0) if kind == "volume_fold" else (gradient, 0.0)
    tangent = joined(*BorderedFactor(state.factor, -gradient, *border).solve(nothing, 1.0))
    return unit_point(potential, state, 0.0, tangent)


@dataclass
class _Finer:
    """The branch of a finer space beside a point of a branch."""

    onto: Potential
    potential: Potential
    point: BranchPoint

    def located(self, zero: Callable[[Potential, BranchPoint, int], float], azimuthal: int) -> BranchPoint | None:
        """Where a function along the branch of the finer space is zero."""
        size = BranchProblem(self.potential).norm(self.point.z) or 1.0
        a, b = 0.0, _STEP * size
        at = self.met(a)
        value_a = None if at is None else zero(self.onto, at, azimuthal)
        for _ in range(_MOST):
            at = self.met(b)
            if at is None or value_a is None or abs(b) > size:
                return None
            value_b = zero(self.onto, at, azimuthal)
            if abs(b - a) <= _ARRIVED * size or value_b == 0:
                return at
            if value_b == value_a:
                return None
            a, b, value_a = b, b - value_b * (b - a) / (value_b - value_a), value_b
        return None

    def met(self, along: float) -> BranchPoint | None:
        """Where the branch crosses the plane across the tangent at a distance along it."""
        tangent = self.point.tangent
        z = self.point.z + along * tangent
        start, direction = (transferred(self.potential.space, y, self.onto.space) for y in (z[:-1], tangent[:-1]))
        row = BranchProblem(self.onto).dual(joined(direction, float(tangent[-1])))
        result: NewtonResult = corrected(self.onto, joined(start, float(z[-1])), row)
        if result.status is not Status.CONVERGED:
            return None
        near = BranchPoint(State.of(result), joined(result.x, result.pressure), joined(direction, float(tangent[-1])), row, 0.0)
        return tangent_at(self.onto, State.of(result), near)


def _waves(potential: Potential, point: BranchPoint, n: int) -> float:
    return float(azimuthal_verdict(potential, point.state.x, point.state.pressure, n).smallest_eigenvalue)


def _height(potential: Potential, point: BranchPoint, _: int) -> float:
    pole = potential.space.pole
    return float(point.tangent[pole]) if pole < potential.space.n_free else np.nan


#: what is zero at a special point, along its branch
_ZERO: dict[str, Callable[[Potential, BranchPoint, int], float]] = {
    "limit_point": lambda potential, point, _: float(point.tangent[-1]),
    "volume_fold": lambda potential, point, _: float(point.state.evaluation.volume_gradient @ point.tangent[:-1]),
    "height_fold": _height,
    "azimuthal_onset": _waves,
}
