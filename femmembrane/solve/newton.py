"""Bordered Newton corrector: one code path for every control, on exact banded derivatives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..errors import Status
from ..kernels.interface import Border
from ..potential import Array, Evaluation, Potential
from .active_set import settled
from .controls import ArcLengthControl, Control, VolumeControl
from .zone_borders import settled_zones

#: relative size of the Newton correction at which a state counts as converged
TOLERANCE = 1e-10
#: relative residual that a state must show whose own correction was not computed
RESIDUAL = 1e-12
#: residual that is round-off, for a membrane as wide as it is long, and the largest correction that may remain with it; round-off decides
#: corrections along very soft directions, such as the shift of a bulge in a long tube
ROUND_OFF, SOFT = 2e-14, 1e-4
#: residual from which on corrections along a soft direction go on, since one of them may end in balance
NEARLY_BALANCED = 1e4 * ROUND_OFF
#: a component of the displacement that is this small beside the other may be round-off of a zero
NEGLIGIBLE = 1e-12
_EPSILON = float(np.finfo(float).eps)
_LEAST = float(np.finfo(float).tiny)
#: pressure of a trial step from which on products are no numbers: the trial is refused
_ABSURD = 1e150
#: largest force of a correction of P, relative to the forces that meet at a node: a guess may have the right shape and a wrong P
PRESSURE = 1e-9


@dataclass(slots=True)
class NewtonResult:
    """Where the corrector ended.

    ``x`` is on the mesh of the scene, ``evaluation.x`` on that which follows borders where there are any, with ``bordered``.
    ``correction`` is the relative size of the Newton correction at x by ``bordered``, the last factors, at x or one correction before;
    ``residual`` and ``gap`` are evaluated at x.
    """

    x: Array
    pressure: float
    evaluation: Evaluation
    bordered: Border | None
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
    if not potential.unsettled:
        return _corrected(potential, control, x, pressure, magnetic, damped, tolerance, max_iterations)
    once = partial(_corrected, magnetic=magnetic, damped=damped, tolerance=tolerance, max_iterations=max_iterations)
    if not potential.obstacles:
        return settled_zones(once, control, potential, x, pressure)
    return settled(once, control, potential, x, pressure, magnetic)


def _corrected(
    potential: Potential,
    control: Control,
    x: Array,
    pressure: float,
    magnetic: float,
    damped: bool,
    tolerance: float,
    max_iterations: int,
) -> NewtonResult:
    """:func:`correct` on a potential that is smooth: that of a membrane without bodies, or on a set of nodes that bodies hold."""
    x = potential.placed(np.ascontiguousarray(x, dtype=float))
    evaluation = potential.evaluate(x, pressure, magnetic)
    previous, iteration, unbalance = np.inf, 0, np.inf
    while True:
        equations = Equations(potential, control, x, pressure, evaluation)
        if not equations.finite:
            return NewtonResult(x, pressure, evaluation, None, iteration, np.inf, np.inf, equations.gap, Status.NOT_CONVERGED)
        dx, dp = equations.newton_step()
        size = equations.size()
        close, previously_close = size <= tolerance, previous <= tolerance
        done = close and (equations.on_control or previously_close)  # good enough, but the load that was asked for is to be met exactly
        done = (done and equations.balanced(dp)) or (0.5 * previous < size <= SOFT and equations.at_round_off)
        stalled = not size < np.inf or (not damped and size > 0.5 * previous and size > 1e3 * tolerance)
        if stalled and size <= 100 * SOFT and not done:
            before, unbalance = unbalance, equations.residual
            # along a soft direction corrections are round-off, while the forces are balanced or still come into balance
            stalled = unbalance > max(1e-2 * before, NEARLY_BALANCED * potential.space.slenderness)
        if done or stalled or iteration == max_iterations:
            return equations.result(iteration, size, Status.CONVERGED if done else Status.NOT_CONVERGED)
        length = _damping(equations, dx, dp, size, magnetic) if damped else 1.0
        x, pressure = (x + dx, pressure + dp) if length == 1 else (x + length * dx, pressure + length * dp)
        x = potential.placed(x)
        evaluation = potential.evaluate(x, pressure, magnetic)
        iteration += 1
        # quadratic convergence, c_next = (c/c_previous)^2 c, spares the last factorisation; the residual at x has the last word, together
        # with its correction by the factors at hand: next to a limit point a state with a small residual may be far from the solution
        foretold = size * (min(size, 1.0) if previous in (0.0, np.inf) else (size / previous) ** 2) if length == 1 else np.inf
        if foretold <= tolerance / 10:
            last = Equations(potential, control, x, pressure, evaluation, equations.bordered)
            if last.finite and (left := last.correction()) <= tolerance / 10:
                result = last.result(iteration, left, Status.CONVERGED)
                if result.residual <= RESIDUAL:
                    return result
        previous = size


class Equations:
    """Residuals and bordered factors at one state."""

    __slots__ = (
        *("potential", "control", "x", "pressure", "evaluation", "bordered"),
        *("gap", "finite", "_row", "_corner", "_round_off", "_scales", "_change", "_size"),
    )

    def __init__(
        self,
        potential: Potential,
        control: Control,
        x: Array,
        pressure: float,
        evaluation: Evaluation,
        bordered: Border | None = None,
    ) -> None:
        self.potential, self.control, self.x, self.pressure, self.evaluation = potential, control, x, pressure, evaluation
        self.gap, self._row, self._corner = control.equation(potential.space, x, pressure, evaluation)
        self._round_off: float = potential.space.volume_round_off if isinstance(control, VolumeControl) else 0.0
        self.finite = evaluation.finite and abs(pressure) < _ABSURD
        self.bordered = bordered
        self._scales: tuple[float, float] | None = None

    @property
    def on_control(self) -> bool:
        """Whether the control is met to round-off of its own terms. Arc length always counts as met: its value is nobody's target."""
        if isinstance(self.control, ArcLengthControl):
            return True
        terms = float(abs(self._row @ self.x) + abs(self._corner * self.pressure))
        return bool(abs(self.gap) <= max(1e-14 * self.potential.space.slenderness * terms, self._round_off))

    @property
    def at_round_off(self) -> bool:
        """Whether corrections are round-off: forces balance as far as positions are known, and the control is met."""
        return self.residual <= ROUND_OFF * self.potential.space.slenderness and self.on_control

    @property
    def scales(self) -> tuple[float, float]:
        """The forces that meet at a node, largest along u and along w."""
        if self._scales is None:
            self._scales = self.evaluation.force_scale(self.pressure)
        return self._scales

    @property
    def residual(self) -> float:
        """The larger of :meth:`residuals`; infinite where it is no number."""
        worst = max(self.residuals())
        return worst if worst < np.inf else np.inf

    def residuals(self) -> tuple[float, float]:
        return residuals_over(self.evaluation.elements.largest(self.evaluation.unbalanced), self.scales)

    def balanced(self, dp: float) -> bool:
        """Whether a correction of P changes no force."""
        return abs(dp) * max(self.evaluation.elements.largest(self.evaluation.volume_gradient)) <= PRESSURE * max(self.scales)

    def newton_step(self) -> tuple[Array, float]:
        """:func:`relative_size` of a correction, without a component that is zero and in balance to round-off."""
        gap = self.gap if abs(self.gap) > self._round_off else 0.0  # next to rest it would move the membrane by more than it is displaced
        if self.bordered is None:
            self.bordered, dx, dp, self._change, size = self.evaluation.step(self._row, self._corner, gap)
            self._size = with_lift(self.potential, size)
            return dx, dp
        largest = self.evaluation.elements.largest
        dx, dp = self.bordered.solve(self.evaluation.unbalanced, -gap)
        self._change, self._size = largest(dx), with_lift(self.potential, largest(self.x))
        return dx, dp

    def size(self) -> float:
        """:func:`relative_size` of the correction, less that of a component which is zero but for round-off and in balance to round-off."""
        change, size = self._change, self._size
        worst = _relative(change, size)
        small = NEGLIGIBLE * max(*size, *change)
        if TOLERANCE < worst < math.inf and (max(change[0], size[0]) <= small or max(change[1], size[1]) <= small):
            negligible = [0 < c <= small and s <= small for c, s in zip(change, size, strict=True)]
            if any(negligible):
                kept = [0.0 if n and r <= RESIDUAL else c for n, r, c in zip(negligible, self.residuals(), change, strict=True)]
                return _relative((kept[0], kept[1]), size)
        return worst

    def correction(self) -> float:
        """:meth:`size` of the correction there."""
        self.newton_step()
        return self.size()

    def result(self, iterations: int, correction: float, status: Status) -> NewtonResult:
        return NewtonResult(self.x, self.pressure, self.evaluation, self.bordered, iterations, correction, self.residual, self.gap, status)

    @property
    def _factored(self) -> Border:
        if self.bordered is None:
            raise ArithmeticError("no factors where the energy is undefined")
        return self.bordered

    def simplified_step(self, unbalanced: Array, gap: float) -> Array:
        """The correction that the factors here give for residuals elsewhere."""
        return self._factored.solve(unbalanced, -gap)[0]


def _damping(equations: Equations, dx: Array, dp: float, size: float, magnetic: float) -> float:
    """Largest step length 1, 1/2, 1/4, ... after which the simplified correction has shrunk."""
    potential, length = equations.potential, 1.0
    # both corrections in the units of the first, which may be larger than the displacement itself
    units = [max(pair) for pair in zip(displaced(potential, equations.x), potential.largest(dx), strict=True)]
    # a component that is zero but for round-off, as along a tube that widens alone, has no size of its own
    units = [unit if unit > NEGLIGIBLE * max(units) else max(units) for unit in units]
    while length > 1e-4:
        x, pressure = potential.placed(equations.x + length * dx), equations.pressure + length * dp
        new = potential.evaluate(x, pressure, magnetic)
        unbalanced = new.unbalanced
        if max(potential.largest(unbalanced)) < np.inf:
            gap = equations.control.equation(potential.space, x, pressure, new)[0]
            left = potential.largest(equations.simplified_step(unbalanced, gap))
            if max(c / unit if c else 0.0 for c, unit in zip(left, units, strict=True)) <= (1 - length / 2) * size:
                break
        length /= 2
    return length


def relative_size(potential: Potential, dx: Array, x: Array) -> float:
    """Largest change of u and of w, each relative to its own size: on a nearly flat membrane u is of order w^2."""
    return _relative(potential.largest(dx), displaced(potential, x))


def displaced(potential: Potential, x: Array) -> tuple[float, float]:
    """Largest displacements u and w of a state, or those that the places of the ends make of themselves where these are larger."""
    return with_lift(potential, potential.largest(x))


def with_lift(potential: Potential, size: tuple[float, float]) -> tuple[float, float]:
    """Largest unknowns u and w, or the displacements that the places of the ends make where these are larger.

    Forces of a material with stress at rest are round-off of the membrane's own size.
    """
    if not potential.strained and potential.space.lift is None:
        return size
    space, (u, w) = potential.space, size
    u0, w0 = (0.0, 0.0) if space.lift is None else space.lift_size
    if potential.prestressed:
        u0, w0 = max(u0, space.unit), w0 if potential.level else max(w0, space.unit)
    return max(u, u0), max(w, w0)


def _relative(change: tuple[float, float], size: tuple[float, float]) -> float:
    """The larger of two changes relative to the sizes, or to themselves where they are larger; infinite where one is no number."""
    (du, dw), (u, w) = change, size
    if du == math.inf or dw == math.inf:
        return math.inf
    a = (du / u if du < u else 1.0) if du else 0.0
    b = (dw / w if dw < w else 1.0) if dw else 0.0
    return a if a > b else b


def residuals_over(size: tuple[float, float], scales: tuple[float, float]) -> tuple[float, float]:
    """Out-of-balance forces along u and along w over the forces that meet at a node."""
    # a component without forces along it holds round-off of the other component
    least = max(_EPSILON * max(scales), _LEAST)  # a slack membrane has no forces at all: what is out of balance is then infinitely large
    (u, w), (scale_u, scale_w) = size, scales
    return u / max(scale_u, least) if u else 0.0, w / max(scale_w, least) if w else 0.0


def relative_residual(potential: Potential, residual: Array, evaluation: Evaluation, pressure: float) -> float:
    """The larger out-of-balance force over the forces that meet at a node; infinite where it is no number."""
    worst = max(residuals_over(potential.largest(residual), potential.force_scale(evaluation, pressure)))
    return worst if worst < np.inf else np.inf
