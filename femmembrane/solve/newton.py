"""Bordered Newton corrector: one code path for every control, on exact banded derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import Status
from ..potential import Array, Evaluation, Potential
from .banded import BandFactor, BorderedFactor
from .controls import Control

#: relative size of the Newton correction at which a state counts as converged
TOLERANCE = 1e-10


@dataclass(slots=True)
class NewtonResult:
    """Where the corrector ended; ``correction`` is the relative size of the last Newton correction, which was not applied."""

    x: Array
    pressure: float
    evaluation: Evaluation
    factor: BandFactor | None
    iterations: int
    correction: float
    residual: float
    gap: float
    status: Status


def correct(
    potential: Potential,
    control: Control,
    x: Array,
    pressure: float,
    *,
    magnetic: float = 1.0,
    damped: bool = False,
    tolerance: float = TOLERANCE,
    max_iterations: int = 12,
) -> NewtonResult:
    """Solve E' - P V' = 0 together with a control, from a guess.

    Parameters
    ----------
    potential, control : Potential, Control
    x, pressure : ndarray, float
        Guess.
    magnetic : float
        Factor on the magnetic energy, for continuation in the strength.
    damped : bool
        Halve steps until the simplified correction shrinks (Deuflhard's natural monotonicity test): for cold starts. Undamped, a
        correction that does not shrink ends the solve at once, so that the caller can take a smaller step.

    Returns
    -------
    NewtonResult
        ``status`` is CONVERGED only if the last correction, relative to the size of u and of w, is below the tolerance.
    """
    evaluation = potential.evaluate(x, pressure, magnetic)
    previous, iteration = np.inf, 0
    while True:
        equations = Equations(potential, control, x, pressure, evaluation)
        if not equations.finite:
            return NewtonResult(x, pressure, evaluation, None, iteration, np.inf, np.inf, equations.gap, Status.NOT_CONVERGED)
        dx, dp = equations.newton_step()
        size = relative_size(potential, dx, x)
        done = size <= tolerance
        stalled = not np.isfinite(size) or (not damped and size > 0.5 * previous and size > 1e3 * tolerance)
        if done or stalled or iteration == max_iterations:
            status = Status.CONVERGED if done else Status.NOT_CONVERGED
            residual = relative_residual(potential, equations.force, evaluation, pressure)
            return NewtonResult(x, pressure, evaluation, equations.factor, iteration, size, residual, equations.gap, status)
        length = _damping(equations, dx, dp, size, magnetic) if damped else 1.0
        x, pressure = x + length * dx, pressure + length * dp
        evaluation = potential.evaluate(x, pressure, magnetic)
        previous, iteration = size, iteration + 1


class Equations:
    """Residuals and bordered factors at one state."""

    def __init__(self, potential: Potential, control: Control, x: Array, pressure: float, evaluation: Evaluation) -> None:
        self.potential, self.control, self.x, self.pressure = potential, control, x, pressure
        self.force = evaluation.gradient - pressure * evaluation.volume_gradient
        self.gap, row, corner = control.equation(potential.space, x, pressure, evaluation)
        self.finite = bool(np.isfinite(self.force).all() and np.isfinite(evaluation.band).all())
        if self.finite:
            self.factor = BandFactor(evaluation.band, potential.space.half_bandwidth)
            self._bordered = BorderedFactor(self.factor, -evaluation.volume_gradient, row, corner)

    def newton_step(self) -> tuple[Array, float]:
        return self._bordered.solve(-self.force, -self.gap)

    def simplified_step(self, force: Array, gap: float) -> Array:
        """The correction that the factors here give for residuals elsewhere."""
        return self._bordered.solve(-force, -gap)[0]


def _damping(equations: Equations, dx: Array, dp: float, size: float, magnetic: float) -> float:
    """Largest step length 1, 1/2, 1/4, ... after which the simplified correction has shrunk."""
    potential, length = equations.potential, 1.0
    while length > 1e-4:
        x, pressure = equations.x + length * dx, equations.pressure + length * dp
        new = potential.evaluate(x, pressure, magnetic)
        force = new.gradient - pressure * new.volume_gradient
        if np.isfinite(force).all():
            gap = equations.control.equation(potential.space, x, pressure, new)[0]
            if relative_size(potential, equations.simplified_step(force, gap), equations.x) <= (1 - length / 2) * size:
                break
        length /= 2
    return length


def relative_size(potential: Potential, dx: Array, x: Array) -> float:
    """Largest change of u and of w, each relative to its own size: on a nearly flat membrane u is of order w^2."""
    sizes = [0.0]
    for index in potential.space.fields:
        change = float(np.abs(dx[index]).max(initial=0.0))
        if change > 0:
            sizes.append(change / max(float(np.abs(x[index]).max()), change))
    return max(sizes) if bool(np.isfinite(dx).all()) else float(np.inf)


def relative_residual(potential: Potential, residual: Array, evaluation: Evaluation, pressure: float) -> float:
    """Out-of-balance force over the forces that meet at a node, the larger of the two components."""
    scales = potential.force_scale(evaluation, pressure)
    parts = [float(np.abs(residual[index]).max(initial=0.0)) / s for index, s in zip(potential.space.fields, scales, strict=True) if s > 0]
    return max(parts, default=0.0)
