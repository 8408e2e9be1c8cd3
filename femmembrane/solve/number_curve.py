"""Curves along which a number of the scene changes: roots z = (x, P, m) of equilibrium and one more equation.

With R = E' - P V' and a number m a curve is R(x, P, m) = 0, g(x, P, m) = 0. Where g is that of a control, N(x, P) = 0, it is a branch of
equilibria over the number (:class:`ControlledProblem`); where g vanishes at a fold it is a curve of folds (:mod:`.fold_curve`).
Arc length is measured by

    mean of |u|^2 over the reference area + P^2 + (m/scale)^2,

the inner product of :mod:`.state` with the number in units of ``scale``: the same on every mesh.

K is singular along a curve of limit points and at single points of others, so no system is ever solved with it: all of them, of whatever
border, are reduced to [K, b; b^T, 0] with a mode b of K, which is regular, and a dense matrix of three or four rows. The mode is renewed at
every point. Cost is linear in the elements.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from scipy.optimize import brentq

from ..errors import InputError, SolveError, Status
from ..potential import Array, ContactFamily, Evaluation, Family, Potential
from ..potential.contact_family import HeldFamily
from .active_set import settled
from .banded import BandFactor, BorderedFactor, WideBorder, band_product
from .bare import moderate
from .branch import AT_CROSSING, FOLDS, BranchProblem
from .continuation import BranchPoint, CurveProblem, Followed, StepControl, Tracer, trace_points
from .controls import CONTROLS, Control, GasOver, PressureControl, at_number
from .newton import TOLERANCE, NewtonResult, relative_residual, relative_size
from .search import FAR, Limit
from .segment import Located, Segment
from .special_points import branch_point
from .state import Predictor, State
from .stepping import control_rate
from .wellposed import ill_posed

#: name of the number among the quantities of a curve, and of a point at which it is stationary among the folds
NUMBER, TURN = "number", "number_fold"
_MAX_ITERATIONS = 12
#: rate of the volume, in units of the membrane, that is told from zero
_STATIONARY = 1e-8
#: bounds of a number that may have any value
ANY = (-math.inf, math.inf)
#: smallest change of the number, relative to its scale, that is told from round-off: a curve that approaches a value hardly moves in it
_RESOLUTION = 1e-13


@dataclass(frozen=True, eq=False)
class Borders:
    """Reference modes of unit length, as rows: ``deflation`` of K, and ``mode`` (with its pressure) of the matrix singular at a fold."""

    deflation: Array
    mode: Array
    mode_pressure: float


@dataclass(slots=True)
class NumberPoint(BranchPoint):
    """A point of a curve in (x, P, m)."""

    borders: Borders

    @property
    def number(self) -> float:
        return float(self.z[-1])

    def value(self, quantity: Followed) -> float:
        return self.number if quantity == NUMBER else BranchPoint.value(self, self._here(quantity))

    def rate(self, quantity: Followed) -> float:
        """Derivative with respect to arc length; a number that moves an end, or is one of a chamber, has a share of its own in it."""
        if quantity == NUMBER:
            return float(self.tangent[-1])
        evaluation, here = self.state.evaluation, self._here(quantity)
        control = (CONTROLS[here] if isinstance(here, str) else here).at(1.0)
        rate, family = BranchPoint.rate(self, here), evaluation.potential
        if not isinstance(family, Family):
            return rate
        return rate + control_rate(family, control, evaluation.x, self.state.pressure, evaluation) * float(self.tangent[-1])

    def _here(self, quantity: Followed) -> Followed:
        """A quantity at the number of this point: the gas may be in a chamber that changes."""
        return quantity.over(self.number) if isinstance(quantity, GasOver) else quantity


class Equations:
    """R and g at one (x, P, m), with what one Newton step needs.

    :meth:`linearise` of a subclass sets ``gap``, the value of g, ``gap_row``, its derivatives, ``force_number``, that of R with respect to
    the number, and ``shift``, the displacement with the number of nodes that bodies hold. Beside bodies x, R and K are those on the mesh
    that follows borders of contact, of displacements that the bodies leave; rows and modes are on the mesh of the scene.

    Parameters
    ----------
    problem : NumberProblem
    z : ndarray
        (x, P, m).
    borders : Borders
    family : Family, optional
        That on a set of held nodes; left out: that of the problem.
    """

    gap: float
    gap_row: Array
    force_number: Array
    shift: Array | None = None

    def __init__(self, problem: NumberProblem, z: Array, borders: Borders, family: Family | None = None) -> None:
        self.problem, self.z, self.borders, self.family = problem, z, borders, family or problem.family
        self.x, self.pressure, self.number = z[:-2], float(z[-2]), float(z[-1])
        self.evaluation = self.family.evaluate(self.x, self.pressure, self.number)
        self.force = self.evaluation.gradient - self.pressure * self.evaluation.volume_gradient
        self.finite = bool(np.isfinite(self.force).all() and np.isfinite(self.evaluation.stiffness_density).all())

    def factorise(self) -> None:
        """Factors of [K, b; b^T, 0], the null vector that they give, and g with all derivatives."""
        self.factor = BandFactor.of(self.evaluation)
        deflation = self.evaluation.row(self.borders.deflation)
        self.deflated = BorderedFactor(self.factor, deflation, deflation, 0.0)
        self.null, self.null_gap = self.deflated.solve(np.zeros_like(self.force), 1.0)
        self.linearise()

    def linearise(self) -> None:
        raise NotImplementedError

    def let_go(self) -> None:
        """Let the borders of contact move with the state from here on: corrections leave them in their places, and rates do not."""

    def jacobian(self, row: Array) -> WideBorder:
        """Of (R, g, row . z) with respect to (x, P, m), without what bodies do to x."""
        rows = [self.gap_row, row]
        if self.shift is not None:
            rows = [np.append(r[:-1], r[-1] + r[:-2] @ self.shift) for r in rows]
        corner = np.stack([r[-2:] for r in rows])
        return WideBorder(self.deflated, [-self.evaluation.volume_gradient, self.force_number], [r[:-2] for r in rows], corner)

    def whole(self, dx: Array, rest: Array) -> Array:
        """A solution of :meth:`jacobian` with what bodies do to x."""
        return np.concatenate([dx if self.shift is None else dx + rest[1] * self.shift, rest])

    def carried(self, z: Array) -> Array:
        """(x, P, m) with x on the mesh of the scene."""
        x = self.evaluation.carried(z[:-2])
        return z if x is z[:-2] else np.concatenate([x, z[-2:]])

    def row(self, row: Array) -> Array:
        """A row on the mesh of the scene as one of z."""
        own = self.evaluation.row(row[:-2])
        return np.concatenate([own, row[-2:]])

    def renewed(self) -> Borders:
        """Borders made from the null vectors here: one step of inverse iteration each."""
        deflation = self.problem.unit_mode(self.evaluation.carried(self.null), 0.0)[0]
        return Borders(deflation, deflation, 0.0)


#: the last equation of a point: its value and its derivatives with respect to (x, P, m)
_Closing = Callable[[Equations], tuple[float, Array]]


class NumberProblem(CurveProblem[NumberPoint]):
    """Equilibria of a family of scenes with one more equation.

    Parameters
    ----------
    family : Family
    scale : float
        Unit of the number in arc length.
    bounds : (float, float)
        Smallest and largest value of the number: values beyond may not exist, such as a negative strength. A step that would pass a bound
        ends exactly on it.
    """

    folds: Mapping[str, str] = {TURN: NUMBER}
    resolution = _RESOLUTION

    def __init__(self, family: Family, scale: float, bounds: tuple[float, float]) -> None:
        self.potential = self.family = family
        self.cornered = family.unsettled
        self._branch = BranchProblem(family)
        self.moving = self._branch.moving
        self.scale, self.bounds = scale, bounds

    @property
    def units(self) -> Mapping[str, float]:
        return {**self.family.space.units, NUMBER: self.scale}

    def dual(self, z: Array) -> Array:
        return np.append(self._branch.dual(z[:-1]), z[-1] / self.scale**2)

    def unit_mode(self, v: Array, q: float) -> tuple[Array, float]:
        """A mode of displacement and pressure of unit length, as a row."""
        family = self.family
        weighed = band_product(family.mass, family.space.half_bandwidth, v) / (family.area * family.space.unit**2)
        size = np.sqrt(v @ weighed + q * q)
        return weighed / size, q / float(size)

    def mirrored(self, point: NumberPoint) -> bool:
        return self.family.even and point.number == 0

    def predict(self, path: Predictor, point: NumberPoint, step: float) -> tuple[float, Array, Array]:
        guess = path.predict(point.sigma + step, self.moving > 0)
        low, high = self.bounds
        if low < guess[-1] < high:
            return step, guess, point.dual
        bound = low if guess[-1] <= low else high
        if (point.number - bound) * (guess[-1] - bound) < 0:
            step = brentq(lambda s: path.predict(point.sigma + s, self.moving > 0)[-1] - bound, 0.0, step, xtol=1e-15)
            guess = path.predict(point.sigma + step, self.moving > 0)
        guess[-1] = bound
        return step, guess, self.number_row

    @property
    def number_row(self) -> Array:
        """The row that takes the number out of z."""
        row = np.zeros(self.family.space.n_free + 2)
        row[-1] = 1.0
        return row

    def resolve(self, guess: Array, row: Array, near: NumberPoint) -> NumberPoint:
        for tolerance in (TOLERANCE, AT_CROSSING):
            point = self._in_plane(guess, row, near, tolerance)[0]
            if point is not None:
                return point
        raise SolveError("the curve between two neighbouring points could not be resolved", status=Status.NOT_CONVERGED)

    def correct(self, guess: Array, row: Array, near: NumberPoint) -> tuple[NumberPoint | None, int]:
        return self._in_plane(guess, row, near, TOLERANCE)

    def _in_plane(self, guess: Array, row: Array, near: NumberPoint, tolerance: float) -> tuple[NumberPoint | None, int]:
        point, iterations = self._newton(guess, near.borders, _hyperplane(row, guess), near.dual, tolerance)
        if point is not None and not row[:-1].any():
            point.z[-1] = guess[-1]
        return point, iterations

    def hold(self, quantity: Followed, value: float, near: NumberPoint) -> NumberPoint | None:
        if quantity == NUMBER:
            guess = near.z.copy()
            guess[-1] = value
            return self.correct(guess, self.number_row, near)[0]
        control = (CONTROLS[quantity] if isinstance(quantity, str) else quantity).at(value)
        return self._newton(near.z, near.borders, lambda equations: _controlled(equations, control), near.dual)[0]

    def determinant_sign(self, point: NumberPoint) -> int:
        """Of the derivatives of R, g and the arc length: det [K, b; b^T, 0] = -(b . K^-1 b) det K, and the dense part of the border."""
        equations = self._there(point.state.evaluation, point.z, point.borders)
        equations.factorise()
        equations.let_go()
        deflated = equations.factor.determinant_sign() * (1 if equations.null_gap > 0 else -1)  # the gap is -1/(b . K^-1 b)
        return deflated * equations.jacobian(equations.row(point.dual)).determinant_sign()

    def _there(self, evaluation: Evaluation, z: Array, borders: Borders) -> Equations:
        """The equations at a state, on the set of held nodes that it has."""
        if not self.family.unsettled:
            return self.at(z, borders)
        return self.at(np.concatenate([evaluation.x, z[-2:]]), borders, cast("Family", evaluation.potential))

    def first(self, x: Array, pressure: float, number: float, direction: int) -> NumberPoint | None:
        """The point next to a guess at the same value of the number, oriented towards larger ones for direction +1."""
        guess = np.concatenate([x, [pressure, number]])
        row = self.number_row
        return self._newton(guess, self.first_borders(guess), _hyperplane(row, guess), direction * row)[0]

    def first_at_turn(self, x: Array, pressure: float, number: float, direction: int) -> NumberPoint | None:
        """The point next to a guess at which the number may be stationary, in the plane across the softest displacement."""
        guess = np.concatenate([x, [pressure, number]])
        borders = self.first_borders(guess)
        row = np.concatenate([borders.deflation, [0.0, 0.0]])
        point = self._newton(guess, borders, _hyperplane(row, guess), direction * row)[0]
        if point is None or abs(point.rate("volume")) <= _STATIONARY * self.units["volume"] or point.rate("volume") * direction > 0:
            return point
        return replace(point, tangent=-point.tangent, dual=-point.dual)

    def first_borders(self, z: Array, sweeps: int = 6) -> Borders:
        """The mode of K closest to zero, by inverse iteration from the shape of the volume gradient."""
        equations = self._at_start(z)
        gradient = equations.evaluation.volume_gradient
        factor, mode = BandFactor.of(equations.evaluation), gradient
        for _ in range(sweeps):
            mode = factor.solve(self.unit_mode(mode, 0.0)[0])
        deflation = self.unit_mode(mode, 0.0)[0]
        return Borders(deflation, deflation, 0.0)

    def _at_start(self, z: Array) -> Equations:
        family = self.family
        if isinstance(family, ContactFamily):
            held = family.holding(family.pressed(z[:-2], float(z[-2]), float(z[-1])))
            family, z = held, np.concatenate([held.placed(z[:-2], float(z[-1])), z[-2:]])
        equations = Equations(self, z, Borders(np.zeros(0), np.zeros(0), 0.0), family)
        if not equations.finite:
            raise SolveError("the start lies outside the domain of the energy", status=Status.NOT_CONVERGED)
        return equations

    def place(self, point: NumberPoint) -> str:
        return f"{point.number:.9g} (V = {point.state.volume:.6g}, P = {point.state.pressure + 0.0:.6g})"

    def settled(self, z: Array) -> Array:
        """A corrected guess, with what is known exactly put in."""
        return z

    @abstractmethod
    def at(self, z: Array, borders: Borders, family: Family | None = None) -> Equations:
        """The equations at one (x, P, m), on a set of held nodes where a family on one is given."""

    def _newton(
        self, z: Array, borders: Borders, closing: _Closing, orientation: Array, tolerance: float = TOLERANCE
    ) -> tuple[NumberPoint | None, int]:
        """Newton's method for R, g and a last equation; None when it does not converge.

        The tangent is that of the curve, oriented so that the row ``orientation`` is positive on it.
        """
        if not self.family.unsettled:
            found = self._on_set(self.family, z, borders, closing, tolerance)
        else:
            found = self._in_contact(z, borders, closing, tolerance)
        if found.last is None:
            return None, found.iterations
        return self._point(found, orientation), found.iterations

    def _on_set(self, family: Family, z: Array, borders: Borders, closing: _Closing, tolerance: float, patient: bool = False) -> _Corrected:
        """Newton's method on a family that is smooth; with patience corrections need not shrink from the first one on."""
        previous = np.inf
        for iteration in range(_MAX_ITERATIONS + 1):
            if isinstance(family, HeldFamily):
                z = np.concatenate([family.placed(z[:-2], float(z[-1])), z[-2:]])
            equations = self.at(z, borders, family)
            if not equations.finite:
                return _Corrected(iteration)
            equations.factorise()
            try:
                gap, row = closing(equations)
                jacobian = equations.jacobian(row)
                change = equations.whole(*jacobian.solve(-equations.force, [-equations.gap, -gap]))
            except np.linalg.LinAlgError:
                return _Corrected(iteration)
            size = max(
                relative_size(self.family, change[:-2], z[:-2]),
                abs(change[-2]) / (self.family.space.units["pressure"] + abs(z[-2])),
                abs(change[-1]) / max(self.scale, abs(z[-1])),
            )
            if size <= tolerance:
                return _Corrected(iteration, equations, row, float(size))
            if not np.isfinite(size) or (size > (2.0 if patient else 0.5) * previous and size > 1e3 * tolerance):
                return _Corrected(iteration)
            previous = size
            z = self.settled(z + change)
        return _Corrected(_MAX_ITERATIONS)

    def _in_contact(self, z: Array, borders: Borders, closing: _Closing, tolerance: float) -> _Corrected:
        """Newton's method on the sets of held nodes, and with the ends of elements, to which the active set leads."""
        known: dict[int, _Corrected] = {}
        number = float(z[-1])

        def once(potential: Potential, *, control: Control, x: Array, pressure: float, damped: bool = False) -> NewtonResult:
            nonlocal number
            guess, on = np.concatenate([x, [pressure, number]]), cast("Family", potential)
            found = self._on_set(on, guess, borders, closing, tolerance, patient=damped)
            last = found.last
            if last is None:
                evaluation = potential.evaluate(x, pressure, number)
                return NewtonResult(x, pressure, evaluation, None, found.iterations, np.inf, np.inf, np.inf, Status.NOT_CONVERGED)
            number, known[id(last.evaluation)] = last.number, found
            given = last.x, last.pressure, last.evaluation, None, found.iterations, found.correction
            return NewtonResult(*given, 0.0, 0.0, Status.CONVERGED)

        try:
            result = settled(once, cast("Control", None), self.family, z[:-2], float(z[-2]), number)
        except InputError:  # the corrector went to values that a body cannot have
            return _Corrected(_MAX_ITERATIONS)
        if result.status is not Status.CONVERGED:
            return _Corrected(result.iterations)
        return replace(known[id(result.evaluation)], iterations=result.iterations)

    def _point(self, found: _Corrected, orientation: Array) -> NumberPoint:
        equations, row = cast("Equations", found.last), cast("Array", found.row)
        equations.let_go()
        evaluation, pressure = equations.evaluation, equations.pressure
        residual = relative_residual(equations.family, equations.force, evaluation, pressure)
        z = equations.carried(equations.z)
        state = State(z[:-2], pressure, evaluation, found.iterations, found.correction, residual, gap=0.0, _factor=equations.factor)
        own = equations.whole(*equations.jacobian(row).solve(None, [0.0, 1.0]))
        tangent = equations.carried(own)
        length = self.norm(tangent)
        if orientation @ tangent < 0:
            length = -length
        tangent, own = tangent / length, own / length
        there = own if self.family.unsettled else None
        return NumberPoint(state, z, tangent, self.dual(tangent), 0.0, equations.renewed(), own=there)


@dataclass(frozen=True, eq=False, slots=True)
class _Corrected:
    """Where Newton's method ended: the last equations with the row of the last one, None where it did not converge."""

    iterations: int
    last: Equations | None = None
    row: Array | None = None
    correction: float = math.inf


def _hyperplane(row: Array, guess: Array) -> _Closing:
    """row . (z - guess) = 0."""
    return lambda equations: (float(row @ (equations.carried(equations.z) - guess)), equations.row(row))


def _controlled(equations: Equations, control: Control) -> tuple[float, Array]:
    """Value and derivatives of a control with respect to (x, P, m)."""
    state = equations.x, equations.pressure, equations.evaluation.raw
    control = at_number(control, equations.number)
    gap, row, corner = control.equation(equations.family.space, *state)
    rate = control_rate(equations.family, control, equations.x, equations.pressure, equations.evaluation)
    return gap, np.concatenate([row, [corner, rate]])


class ControlledProblem(NumberProblem):
    """Branches of equilibria over the number while a control is held: pressure, volume, height of the pole, or a gas.

    Parameters
    ----------
    control : Control
        N(x, P) = 0; further parameters as for :class:`NumberProblem`.
    """

    #: a membrane that a far source has all but left alone is soft, and rates of what hardly moves are round-off
    resolution = 1e-9

    def __init__(self, family: Family, control: Control, scale: float, bounds: tuple[float, float] = ANY) -> None:
        super().__init__(family, scale, bounds)
        self.control = control
        # what is held turns nowhere
        self.folds = {TURN: NUMBER, **{kind: q for kind, q in FOLDS.items() if type(control) is not CONTROLS[q].at}}

    def at(self, z: Array, borders: Borders, family: Family | None = None) -> Equations:
        return _Controlled(self, z, borders, family)

    def settled(self, z: Array) -> Array:
        if isinstance(self.control, PressureControl):
            z[-2] = self.control.pressure
        return z

    def predict(self, path: Predictor, point: NumberPoint, step: float) -> tuple[float, Array, Array]:
        """As of any curve; a step towards values that no scene has ends on the last value that one has."""
        aim = float(path.predict(point.sigma + step, self.moving > 0)[-1])
        if min(self.bounds) < aim < max(self.bounds) and np.isfinite(aim) and not self.family.takes(aim):
            last = self.family.last_value(point.number, aim)
            self.bounds = (last, self.bounds[1]) if aim < last else (self.bounds[0], last)
        return super().predict(path, point, step)

    def forbids(self, before: NumberPoint, after: NumberPoint) -> bool:
        if not self.family.takes(after.number):  # the corrector went beyond the last value that a scene has
            return True
        return self.family.came_through_source(after.number, after.state.x, before.number, before.state.x)


class _Controlled(Equations):
    problem: ControlledProblem

    def linearise(self) -> None:
        self.gap, self.gap_row = _controlled(self, self.problem.control)
        self.force_number, self.shift = self.family.number_rates(self.evaluation, self.pressure)


def beyond_turn(
    problem: ControlledProblem,
    point: NumberPoint,
    number: float,
    stable: Callable[[State], bool],
    *,
    any_before: bool,
    beside: Callable[[Located[NumberPoint]], State | None],
    max_steps: int = 300,
) -> Limit:
    """Follow a branch from the last point before a number that was not reached by steps in the number itself.

    Where it turns back the next stable state is looked for beside it, then farther along it.

    Parameters
    ----------
    problem, point : ControlledProblem, NumberPoint
        Where it sets out, oriented towards the number.
    number : float
    stable : callable
        Whether a state is a minimum under the control.
    any_before : bool
        Whether a state before the turn will do that is none.
    beside : callable
        The stable state that the membrane goes to from a turn, at the number; None where none was met.
    """
    family, fold, last = problem.family, None, point.state
    far = FAR * moderate(family.member(point.number) if family.unsettled else family)
    points = trace_points(problem, point, Tracer(Predictor(), StepControl().first))
    for _ in range(max_steps):
        try:
            new = next(points)
        except SolveError:
            break
        segment = Segment(problem, point, new)
        if ill_posed(family.member(new.number), new.state.evaluation) is not None:
            return Limit(fold, None, new.state, last)
        last = new.state
        if fold is None:
            found = [*segment.folds(TURN), *filter(None, [None if any_before else branch_point(segment)])]
            fold = min(found, key=lambda located: located.point.sigma, default=None)
            if fold is not None and fold.kind == TURN and not any(m.sigma < fold.point.sigma for m in segment.crossings(NUMBER, number)):
                landing = beside(fold)
                if landing is not None:
                    return Limit(fold, landing, last=fold.point.state)
        for met in segment.crossings(NUMBER, number):
            before = fold is None or met.sigma < fold.point.sigma
            if met is not (fold and fold.point) and ((before and any_before) or stable(met.state)):
                return Limit(None if before else fold, met.state, last=met.state)
        if new.number in problem.bounds or abs(new.state.volume) > far:
            break
        point = new
    return Limit(fold, None, last=last)


def first_controlled(problem: ControlledProblem, x: Array, pressure: float, number: float, direction: int) -> NumberPoint:
    """The equilibrium next to a guess at the same value of the number, oriented towards larger ones for direction +1.

    Where the branch turns in the number it is oriented towards larger volumes.

    Raises
    ------
    SolveError
        When there is none next to it.
    """
    point = problem.first(x, pressure, number, direction) or problem.first_at_turn(x, pressure, number, direction)
    if point is None:
        raise SolveError("the start is not near an equilibrium of this scene under the control", status=Status.NOT_CONVERGED)
    return point
