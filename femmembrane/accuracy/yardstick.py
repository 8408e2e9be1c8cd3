"""What errors of a run are compared with, and the estimated error of a state by that measure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from ..discretization.meridian import Accuracy, Asked
from ..discretization.space import transferred
from ..errors import Status
from ..potential import Array, Evaluation, Potential, potential_of
from ..results.equilibrium import Equilibrium
from ..scene import Scene
from ..solve.branch import first_point
from ..solve.finer_space import met_across, moved
from ..solve.newton import NewtonResult
from ..solve.state import State
from ..solve.wellposed import ill_posed, stress_scale
from ..stability.spectrum import SpectrumError
from ..stability.verdict import axisymmetric_verdict
from .error_estimate import finer_space, same_state

#: states of the trial run whose errors are estimated
STATES = 12
#: smallest pressure over the largest one that still counts by itself
_LEAST_PRESSURE = 0.01


@dataclass(frozen=True)
class Yardstick:
    """What errors are compared with: the accuracies asked for, and the sizes below which errors are no longer relative.

    Errors of a quantity for which less is asked count less: all are scaled to the tightest accuracy.
    """

    asked: Accuracy
    pressure: float = 0.0
    eigenvalues: float = 0.0

    def worst(self, errors: Mapping[str, float]) -> float:
        """The largest of the errors of what is asked, scaled."""
        return max(error * self.asked.tightest / self.asked[name] for name, error in errors.items())


def relative_error(potential: Potential, x: Array, pressure: float, controls: Sequence[str], yardstick: Yardstick) -> float:
    """The largest of the estimated relative errors of what is asked, under the control for which it is smallest; NaN without one."""
    evaluation = potential.evaluate(x, pressure)
    if ill_posed(potential, evaluation) is not None:
        return np.nan
    finer = potential_of(finer_space(potential, evaluation, pressure)[0])
    errors = []
    for control in can_hold(controls, potential):
        better = same_state(finer, potential, x, pressure, evaluation, control)[0]
        if better is not None:
            errors.append(yardstick.worst(_errors(potential, x, pressure, evaluation, finer, better, yardstick)))
    return min(errors, default=np.nan)


def error_across(potential: Potential, state: State, scale: float) -> float:
    """Estimated relative error of P next to folds of volume and height: the distance to the branch of a finer space there."""
    finer = potential_of(finer_space(potential, state.evaluation, state.pressure)[0])
    met = met_across(finer, potential, first_point(potential, state, 1))
    return abs(met.pressure - state.pressure) / max(abs(state.pressure), scale) if met.status is Status.CONVERGED else np.nan


def _errors(
    potential: Potential, x: Array, pressure: float, evaluation: Evaluation, finer: Potential, better: NewtonResult, yardstick: Yardstick
) -> dict[str, float]:
    """Relative errors of what is asked."""
    errors = {}
    if "pressure" in yardstick.asked:
        sizes = max(abs(pressure), yardstick.pressure), evaluation.energy_size
        changes = abs(pressure - better.pressure), abs(evaluation.energy - better.evaluation.energy)
        errors["pressure"] = max(c / size if size else 0.0 for c, size in zip(changes, sizes, strict=True))
    if "profile" in yardstick.asked:
        errors["profile"] = moved(finer, better.x, transferred(potential.space, x, finer.space))
    if "eigenvalues" in yardstick.asked:
        try:
            pairs = [_eigenvalues(potential, evaluation), _eigenvalues(better.evaluation.potential, better.evaluation)]
        except SpectrumError:
            return {**errors, "eigenvalues": np.inf}
        values = np.maximum(np.abs(pairs[1]), yardstick.eigenvalues)
        errors["eigenvalues"] = float(np.max(np.abs(pairs[0] - pairs[1]) / np.where(values > 0, values, 1.0)))
    return errors


def _eigenvalues(potential: Potential, evaluation: Evaluation) -> Array:
    """The smallest axisymmetric eigenvalues under pressure and volume control."""
    verdicts = [axisymmetric_verdict(potential, evaluation, control) for control in ("pressure", "volume")]
    return np.array([verdict.smallest_eigenvalue for verdict in verdicts])


def yardstick_of(equilibria: Sequence[Equilibrium], asked: Accuracy) -> Yardstick:
    """What the errors of a run are compared with."""
    largest = 0.0
    if "eigenvalues" in asked:
        found = [_eigenvalues_of(eq) for eq in (equilibria[k] for k in spread([eq.volume for eq in equilibria]))]
        largest = max((float(np.abs(pair).max()) for pair in found if pair is not None), default=0.0)
    return Yardstick(asked, _least_pressure_of(equilibria), _LEAST_PRESSURE * largest)


def _eigenvalues_of(eq: Equilibrium) -> Array | None:
    try:
        return _eigenvalues(eq.potential, eq.potential.evaluate(eq.state, eq.pressure))
    except SpectrumError:
        return None


def _least_pressure_of(equilibria: Iterable[Equilibrium]) -> float:
    """The pressure below which errors of a run are relative to this one."""
    largest = max(abs(eq.pressure) for eq in equilibria)
    return least_pressure(largest, max(stress_scale(eq.potential.evaluate(eq.state, eq.pressure)) for eq in equilibria))


def least_pressure(largest: float, stress: float) -> float:
    """The pressure below which errors are relative to this one. Where a run holds little pressure against other loads, the stress that
    they make stands in place of its largest one.
    """
    return _LEAST_PRESSURE * max(largest, _LEAST_PRESSURE * stress)


def controls_of(control: str) -> tuple[str, ...]:
    """What is held while errors are estimated, for a kind of run."""
    return {"center_height": ("center_height",), "arc-length": ("volume", "center_height")}.get(control, ("volume",))


def can_hold(controls: Sequence[str], potential: Potential) -> tuple[str, ...]:
    """Those that can be held: no control moves a first end that is held along the axis."""
    return tuple(name for name in controls if name != "center_height" or potential.space.pole < potential.space.n_free)


def accuracy_of(scene: Scene) -> Asked:
    return cast(Asked, scene.mesh.accuracy)  # type: ignore[attr-defined]  # an open mesh has one


def spread(loads: ArrayLike) -> list[int]:
    """Positions of some of a list of loads: the first, the last, the extreme ones and a few between."""
    loads = np.asarray(loads, dtype=float)
    n = loads.size
    if not n:
        return []
    even = np.linspace(0, n - 1, min(n, STATES)).round().astype(int).tolist()
    return sorted({*even, int(np.argmin(loads)), int(np.argmax(loads))})
