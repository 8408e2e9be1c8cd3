"""Bordered Newton corrector: one code path for every control, on exact banded derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import Status
from ..potential import Array, Evaluation, Potential
from .banded import BandFactor, BorderedFactor, CompiledBorder
from .controls import ArcLengthControl, Control

if TYPE_CHECKING:
    from .._native import Elements

#: relative size of the Newton correction at which a state counts as converged
TOLERANCE = 1e-10
#: relative residual that a state must show whose own correction was not computed
RESIDUAL = 1e-12
#: largest force of a correction of P, relative to those that meet at a node: a guess may have the right shape and a wrong P
PRESSURE = 1e-9


@dataclass(slots=True)
class NewtonResult:
    """Where the corrector ended.

    ``correction`` is the relative size of the Newton correction at x by ``bordered``, the last factors, at x or one correction before;
    ``residual`` and ``gap`` are evaluated at x.
    """

    x: Array
    pressure: float
    evaluation: Evaluation
    bordered: BorderedFactor | CompiledBorder | None
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
        ``status`` is CONVERGED only if the correction at x, relative to the size of u and of w, is below the tolerance: computed, or
        foretold from two corrections in quadratic convergence and confirmed by the residual at x and its correction by the factors before.
    """
    elements = None if damped else potential.elements
    if elements is not None:
        return _compiled(elements, potential, control, x, pressure, magnetic, tolerance, max_iterations)
    evaluation = potential.evaluate(x, pressure, magnetic)
    previous, iteration = np.inf, 0
    while True:
        equations = Equations(potential, control, x, pressure, evaluation)
        if not equations.finite:
            return NewtonResult(x, pressure, evaluation, None, iteration, np.inf, np.inf, equations.gap, Status.NOT_CONVERGED)
        dx, dp = equations.newton_step()
        size = relative_size(potential, dx, x)
        close, previously_close = size <= tolerance, previous <= tolerance
        done = close and (equations.on_control or previously_close)  # good enough, but the load that was asked for is to be met exactly
        done = done and equations.balanced(dp)
        stalled = not np.isfinite(size) or (not damped and size > 0.5 * previous and size > 1e3 * tolerance)
        if done or stalled or iteration == max_iterations:
            return equations.result(iteration, size, Status.CONVERGED if done else Status.NOT_CONVERGED)
        length = _damping(equations, dx, dp, size, magnetic) if damped else 1.0
        x, pressure = x + length * dx, pressure + length * dp
        evaluation = potential.evaluate(x, pressure, magnetic)
        iteration += 1
        # quadratic convergence, c_next = (c/c_previous)^2 c, spares the last factorisation; the residual at x and the correction that the
        # factors at hand make of it (next to a limit point a small residual may be far from the solution) have the last word
        foretold = size * (min(size, 1.0) if previous in (0.0, np.inf) else (size / previous) ** 2) if length == 1 else np.inf
        if foretold <= tolerance / 10:
            last = Equations(potential, control, x, pressure, evaluation, equations.bordered)
            if last.finite and (left := relative_size(potential, last.newton_step()[0], x)) <= tolerance / 10:
                result = last.result(iteration, left, Status.CONVERGED)
                if result.residual <= RESIDUAL:
                    return result
        previous = size


def _compiled(
    elements: Elements,
    potential: Potential,
    control: Control,
    x: Array,
    pressure: float,
    magnetic: float,
    tolerance: float,
    max_iterations: int,
) -> NewtonResult:
    """:func:`correct`, undamped, in the compiled half."""
    gradients, densities = potential.results()
    x, parameters = x.copy(), np.array([pressure, magnetic], dtype=float)
    numbers = control.numbers(potential.space)
    converged, pressure, elastic, field_energy, volume, iterations, correction, residual, gap, border = elements.correct(
        numbers, x, parameters, tolerance, RESIDUAL, max_iterations, gradients, densities
    )
    evaluation = potential.evaluation(x, (elastic, field_energy, volume), gradients, densities, magnetic)
    bordered = None if border is None else CompiledBorder(border)
    status = Status.CONVERGED if converged else Status.NOT_CONVERGED
    return NewtonResult(x, pressure, evaluation, bordered, iterations, correction, residual, gap, status)


class Equations:
    """Residuals and bordered factors at one state."""

    def __init__(
        self,
        potential: Potential,
        control: Control,
        x: Array,
        pressure: float,
        evaluation: Evaluation,
        bordered: BorderedFactor | CompiledBorder | None = None,
    ) -> None:
        self.potential, self.control, self.x, self.pressure, self.evaluation = potential, control, x, pressure, evaluation
        self.force = evaluation.gradient - pressure * evaluation.volume_gradient
        self.gap, row, corner = control.equation(potential.space, x, pressure, evaluation)
        self.finite = bool(np.isfinite(self.force).all() and np.isfinite(evaluation.stiffness_density).all())
        if bordered is None and self.finite:
            bordered = BorderedFactor(BandFactor(evaluation.band), -evaluation.volume_gradient, row, corner)
        self.bordered = bordered

    @property
    def on_control(self) -> bool:
        """Whether the control is met to round-off of its own terms; nobody asked for a particular arc length."""
        if isinstance(self.control, ArcLengthControl):
            return True
        _, row, corner = self.control.equation(self.potential.space, self.x, self.pressure, self.evaluation)
        return bool(abs(self.gap) <= 1e-14 * (abs(row @ self.x) + abs(corner * self.pressure)))

    def balanced(self, dp: float) -> bool:
        """Whether a correction of P changes no force."""
        scale = max(self.potential.force_scale(self.evaluation, self.pressure))
        return bool(abs(dp) * np.abs(self.evaluation.volume_gradient).max(initial=0.0) <= PRESSURE * scale)

    def newton_step(self) -> tuple[Array, float]:
        return self._factored.solve(-self.force, -self.gap)

    def result(self, iterations: int, correction: float, status: Status) -> NewtonResult:
        residual = relative_residual(self.potential, self.force, self.evaluation, self.pressure)
        return NewtonResult(self.x, self.pressure, self.evaluation, self.bordered, iterations, correction, residual, self.gap, status)

    @property
    def _factored(self) -> BorderedFactor | CompiledBorder:
        if self.bordered is None:
            raise ArithmeticError("no factors where the energy is undefined")
        return self.bordered

    def simplified_step(self, force: Array, gap: float) -> Array:
        """The correction that the factors here give for residuals elsewhere."""
        return self._factored.solve(-force, -gap)[0]


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
    change, size = np.abs(dx), np.abs(x)
    largest = 0.0
    for index in potential.space.fields:
        c = float(change[index].max(initial=0.0))  # NaN propagates
        if not c < np.inf:
            return np.inf
        if c > 0:
            largest = max(largest, c / max(float(size[index].max()), c))
    return largest


def relative_residual(potential: Potential, residual: Array, evaluation: Evaluation, pressure: float) -> float:
    """Out-of-balance force over the forces that meet at a node, the larger of the two components."""
    scales = potential.force_scale(evaluation, pressure)
    parts = [
        0.0 if s == 0 else float(np.abs(residual[index]).max(initial=0.0)) / s
        for index, s in zip(potential.space.fields, scales, strict=True)
    ]
    return max(parts) if all(np.isfinite(parts)) else np.inf
