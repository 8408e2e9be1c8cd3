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
#: most iterations of a damped solve
_PATIENT = 20
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
        patient = partial(once, damped=True, max_iterations=_PATIENT)
        return settled_zones(once, patient, control, potential, x, pressure)
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
    equations = Equations(potential, control, np.ascontiguousarray(x, dtype=float), pressure, magnetic)
    previous, iteration, unbalance = math.inf, 0, math.inf
    while equations.finite:
        dx, dp, size = equations.newton_step()
        # good enough, but the load that was asked for is to be met exactly
        done = size <= tolerance and (previous <= tolerance or equations.on_control) and equations.balanced(dp)
        done = done or (0.5 * previous < size <= SOFT and equations.at_round_off)
        stalled = not size < math.inf or (not damped and size > 0.5 * previous and size > 1e3 * tolerance)
        if stalled and size <= 100 * SOFT and not done:
            before, unbalance = unbalance, equations.residual
            # along a soft direction corrections are round-off, while the forces are balanced or still come into balance
            stalled = unbalance > max(1e-2 * before, NEARLY_BALANCED * potential.space.slenderness)
        if done or stalled or iteration == max_iterations:
            return equations.result(iteration, size, Status.CONVERGED if done else Status.NOT_CONVERGED)
        length = _damping(equations, dx, dp, size) if damped else 1.0
        if length != 1:
            dx, dp = length * dx, length * dp
        equations.stand_at(equations.x + dx, equations.pressure + dp)
        iteration += 1
        # quadratic convergence, c_next = (c/c_previous)^2 c, spares the last factorisation; the residual at x has the last word, together
        # with its correction by the factors at hand: next to a limit point a state with a small residual may be far from the solution
        foretold = size * ((size / previous) ** 2 if 0 < previous < math.inf else min(size, 1.0))
        if foretold <= tolerance / 10 and length == 1 and equations.finite and (left := equations.simplified_size()) <= tolerance / 10:
            result = equations.result(iteration, left, Status.CONVERGED)
            if result.residual <= RESIDUAL:
                return result
        previous = size
    gap = equations.gap
    return NewtonResult(
        equations.x, equations.pressure, equations.evaluation, None, iteration, math.inf, math.inf, gap, Status.NOT_CONVERGED
    )


class Equations:
    """Residuals at the state where a corrector stands, and bordered factors there or at the state before.

    Attributes
    ----------
    gap : float
        Error of the equation of the control.
    finite : bool
        Whether there are numbers to go on with.
    """

    __slots__ = (
        *("potential", "control", "x", "pressure", "magnetic", "evaluation", "bordered", "gap", "finite"),
        *("_row", "_corner", "_round_off", "_least"),
    )

    def __init__(self, potential: Potential, control: Control, x: Array, pressure: float, magnetic: float = 1.0) -> None:
        self.potential, self.control, self.magnetic = potential, control, magnetic
        self._round_off: float = potential.space.volume_round_off if isinstance(control, VolumeControl) else 0.0
        self._least = least_displaced(potential)
        self.bordered: Border | None = None
        self.stand_at(x, pressure)

    def stand_at(self, x: Array, pressure: float) -> None:
        """Go to another state; the factors stay those of the state before."""
        potential = self.potential
        self.x = x = potential.placed(x, self.magnetic)
        self.pressure = pressure
        self.evaluation = evaluation = potential.evaluate(x, pressure, self.magnetic)
        self.gap, self._row, self._corner = self.control.equation(potential.space, x, pressure, evaluation)
        self.finite = evaluation.finite and abs(pressure) < _ABSURD

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
        return self.evaluation.force_scale(self.pressure)

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

    def newton_step(self) -> tuple[Array, float, float]:
        """The correction of x and P by factors at this state, and its :meth:`size`."""
        # next to rest a gap of round-off would move the membrane by more than it is displaced
        gap = self.gap if abs(self.gap) > self._round_off else 0.0
        self.bordered, dx, dp, change, size = self.evaluation.step(self._row, self._corner, gap)
        return dx, dp, self.size(change, size)

    def simplified_size(self) -> float:
        """The :meth:`size` of the correction by the factors of the state before."""
        gap = self.gap if abs(self.gap) > self._round_off else 0.0
        largest, dx = self.evaluation.elements.largest, self.simplified_step(self.evaluation.unbalanced, gap)
        return self.size(largest(dx), largest(self.x))

    def size(self, change: tuple[float, float], size: tuple[float, float]) -> float:
        """A correction relative to the displacement, less a component of it that is zero but for round-off and in balance to round-off.

        Parameters
        ----------
        change, size : tuple of float
            Largest entries of both, along u and along w.
        """
        if self._least is not None:
            size = max(size[0], self._least[0]), max(size[1], self._least[1])
        worst = _relative(change, size)
        if TOLERANCE < worst < math.inf and min(size) <= (small := NEGLIGIBLE * max(*size, *change)):
            negligible = [0 < c <= small and s <= small for c, s in zip(change, size, strict=True)]
            if any(negligible):
                kept = [0.0 if n and r <= RESIDUAL else c for n, r, c in zip(negligible, self.residuals(), change, strict=True)]
                return _relative((kept[0], kept[1]), size)
        return worst

    def result(self, iterations: int, correction: float, status: Status) -> NewtonResult:
        return NewtonResult(self.x, self.pressure, self.evaluation, self.bordered, iterations, correction, self.residual, self.gap, status)

    def simplified_step(self, unbalanced: Array, gap: float) -> Array:
        """The correction that the factors at hand give for residuals elsewhere."""
        if self.bordered is None:
            raise ArithmeticError("no factors where the energy is undefined")
        return self.bordered.solve(unbalanced, -gap)[0]


def _damping(equations: Equations, dx: Array, dp: float, size: float) -> float:
    """Largest step length 1, 1/2, 1/4, ... after which the simplified correction has shrunk."""
    potential, length = equations.potential, 1.0
    # both corrections in the units of the first, which may be larger than the displacement itself
    units = [max(pair) for pair in zip(displaced(potential, equations.x), potential.largest(dx), strict=True)]
    # a component that is zero but for round-off, as along a tube that widens alone, has no size of its own
    units = [unit if unit > NEGLIGIBLE * max(units) else max(units) for unit in units]
    while length > 1e-4:
        x, pressure = potential.placed(equations.x + length * dx, equations.magnetic), equations.pressure + length * dp
        new = potential.evaluate(x, pressure, equations.magnetic)
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
    (u, w), least = potential.largest(x), least_displaced(potential)
    return (u, w) if least is None else (max(u, least[0]), max(w, least[1]))


def least_displaced(potential: Potential) -> tuple[float, float] | None:
    """The displacements u and w that the places of the ends make; None where they make none.

    Forces of a material with stress at rest are round-off of the membrane's own size.
    """
    space = potential.space
    if not potential.strained and space.lift is None:
        return None
    u, w = (0.0, 0.0) if space.lift is None else space.lift_size
    if potential.prestressed:
        u, w = max(u, space.unit), w if potential.level else max(w, space.unit)
    return u, w


def _relative(change: tuple[float, float], size: tuple[float, float]) -> float:
    """The larger of two changes relative to the sizes, or to themselves where they are larger; infinite where one is no number."""
    (du, dw), (u, w) = change, size
    a = du / u if du < u else (1.0 if 0 < du < math.inf else du)
    b = dw / w if dw < w else (1.0 if 0 < dw < math.inf else dw)
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
