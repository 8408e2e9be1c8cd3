"""How an equilibrium moves when numbers of its scene change while a quantity is held.

With R = E' - P V' = 0 and N(x, P, m) = 0, the equation of a control, the derivatives with respect to m numbers are the solutions of

    [ K    -V' ] [ dx/dm ]     [ R_m ]
    [ N_x  N_P ] [ dP/dm ] = - [ N_m ]

with the factors of the last Newton step: one back-substitution for each number. The matrix is regular beyond limit points as well, wherever
the control is no fold. A fold is itself such an equation: N vanishes where K, or K with the border -V', has a null vector v, and as the
matrix is symmetric N = v.(E'' - P V'')v - 2 q V'.v has the derivatives of this form at fixed v and q (Govaerts 2000). So positions of limit
points have the same kind of derivatives, without a difference quotient.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..errors import InputError, SolveError, Status
from ..kernels.interface import Border
from ..potential import Array, Evaluation, NumberDerivatives, Numbered
from ..scene import Scene
from ..scene.variation import Numbers, Scale, parameter_of
from ..threads import cached_property
from .banded import BandFactor
from .controls import CONTROLS, Control, Gas, GasOver
from .state import inner

#: movement for a change of what is held by its unit, in units of the membrane, from which on the state is at a fold of it
_AT_FOLD = 1e9
#: sweeps of inverse iteration for the null vector at a fold that was located before
_SWEEPS = 4
#: folds that have an equation of their own
FOLDS = ("limit_point", "volume_fold")


@dataclass(frozen=True, eq=False)
class Rates:
    """Derivatives of a state with respect to numbers of the scene.

    Attributes
    ----------
    x : ndarray, shape (n_free, m)
        Of the coefficients.
    pressure, volume, height : ndarray, shape (m,)
        The height is that of the pole.
    borders : ndarray, shape (k, m), optional
        Of the places of ends of elements that follow borders of contact; the coefficients belong to nodes that move with these.
    """

    x: Array
    pressure: Array
    volume: Array
    height: Array
    borders: Array | None = None


class Sensitive:
    """The derivatives of a scene's equations with respect to numbers by their names.

    A number of a material may take others with it, as :meth:`.Parameter.scene_at` says.

    Parameters
    ----------
    scene : Scene
    names : sequence of str
    """

    def __init__(self, scene: Scene, names: Sequence[str]) -> None:
        self.scene, self.names = scene, tuple(names)
        self.parameters = tuple(parameter_of(scene, name) for name in self.names)
        self._rates = [parameter.rates() for parameter in self.parameters]

    @cached_property
    def _groups(self) -> list[tuple[Numbered, Array]]:
        own = list(dict.fromkeys(name for rate in self._rates for name in rate))
        movers = [parameter.name for parameter in Numbers(self.scene, tuple(own)).parameters if parameter.moves]
        # the places of two ends have no expression in common
        groups = [[name for name in own if name not in movers[1:]], *([name] for name in movers[1:])]
        return [(Numbered(Numbers(self.scene, tuple(group))), mixed(self._rates, group)) for group in groups]

    def equations(self, x: Array, pressure: float) -> NumberDerivatives:
        """Derivatives of E' - P V', of the volume and of the height of the pole at fixed (x, P)."""
        parts = [(numbered.derivatives(x, pressure), mix) for numbered, mix in self._groups]
        force, volume, height = (
            sum((getattr(own, name) @ mix for own, mix in parts[1:]), getattr(parts[0][0], name) @ parts[0][1])
            for name in ("force", "volume", "height")
        )
        return NumberDerivatives(force, volume, height)

    def energies(self, x: Array, pressure: float) -> dict[str, tuple[Array, Array]]:
        """Derivatives of each energy that the scene has with respect to x, and to the numbers at a fixed state."""
        found: dict[str, tuple[Array, Array]] = {}
        for numbered, mix in self._groups:
            for name, (state, numbers) in numbered.energy_derivatives(x, pressure).items():
                found[name] = state, found.get(name, (state, 0.0))[1] + numbers @ mix
        return found

    def form(self, x: Array, pressure: float, mode: Array, q: float) -> tuple[Array, float, Array]:
        """Derivatives of v.(E'' - P V'')v - 2 q V'.v for a fixed mode (v, q) with respect to x, P and the numbers."""
        state, by_pressure, numbers = np.zeros_like(x), 0.0, np.zeros(len(self.names))
        for numbered, mix in self._groups:
            found = numbered.form_derivatives(x, pressure, mode, q)
            state, by_pressure, numbers = found.state, found.pressure, numbers + found.numbers @ mix
        return state, by_pressure, numbers

    def through(self, name: str) -> Array:
        """How a number of the scene changes with each of the numbers asked for."""
        return np.array([rate.get(name, 0.0) for rate in self._rates])

    def held_rates(self, control: Control, pressure: float, volume: float) -> Array:
        """Derivatives of the equation of a control through the chamber of a gas, and through the unit of a held value."""
        rates = np.zeros(len(self.names))
        if isinstance(control, Gas):
            for name, varies in (("chamber.volume", "chamber"), ("chamber.atmosphere", "atmosphere")):
                gas = GasOver(control.amount, control.chamber, control.atmosphere, varies)
                rates += gas.number_rate(pressure, volume) * self.through(name)
        kind, load = ("gas", control.amount) if isinstance(control, Gas) else (held_name(control), pressure)
        for k, parameter in enumerate(self.parameters):
            if isinstance(parameter, Scale):
                rates[k] += parameter.power(kind) * load / parameter.value
        return rates

    def at_control(self, evaluation: Evaluation, pressure: float, control: Control) -> Rates:
        """How an equilibrium of the scene moves with the numbers under a control.

        Raises
        ------
        SolveError
            At a fold of what is held.
        """
        potential, x = evaluation.potential, evaluation.x
        _, row, corner = control.equation(potential.space, x, pressure, evaluation)
        own = self.equations(x, pressure)
        held = held_rates(control, pressure, own.volume, own.height) + self.held_rates(control, pressure, evaluation.volume)
        border = evaluation.border(row, corner)
        refuse_fold(evaluation, *border.solve(np.zeros_like(x), 1.0), control)
        return solved(border, evaluation, held, own)

    def at_fold(self, evaluation: Evaluation, pressure: float, kind: str) -> Rates:
        """How a limit point or a volume fold of the scene moves with the numbers.

        Raises
        ------
        SolveError
            Where two folds meet.
        """
        x = evaluation.x
        mode, q = null_vector(evaluation, kind)
        row, corner, numbers = self.form(x, pressure, mode, q)
        own = self.equations(x, pressure)
        border = evaluation.border(np.ascontiguousarray(row), corner)
        return solved(border, evaluation, numbers, own)


def mixed(rates: Sequence[dict[str, float]], group: Sequence[str]) -> Array:
    """How numbers of a group change with each of the numbers asked for, shape (group, m)."""
    return np.array([[rate.get(name, 0.0) for rate in rates] for name in group]).reshape(len(group), len(rates))


def held_rates(control: Control, pressure: float, volume: Array, height: Array) -> Array:
    """Derivatives of the equation of a control with respect to numbers that move an end, at fixed (x, P)."""
    if isinstance(control, CONTROLS["center_height"].at):  # type: ignore[arg-type]
        return height
    if isinstance(control, CONTROLS["volume"].at):  # type: ignore[arg-type]
        return volume
    atmosphere = getattr(control, "atmosphere", None)
    return np.zeros_like(volume) if atmosphere is None else (pressure + atmosphere) * volume


def refuse_fold(evaluation: Evaluation, dx: Array, dp: float, control: Control) -> None:
    """Refuse a state that has no derivative at the held quantity, as it is stationary there. (dx, dp) belong to a unit of that quantity."""
    space, name = evaluation.potential.space, held_name(control)
    unit = space.units.get(name, 1.0)
    square = inner(evaluation.potential, dx, dp, dx, dp)
    if not square * unit**2 < _AT_FOLD**2:
        held = name.replace("_", " ")
        message = f"the {held} is stationary at this equilibrium (a fold), so that nothing there has a derivative at a held {held}"
        raise SolveError(message, status=Status.NOT_CONVERGED)


def held_name(control: Control) -> str:
    return next((name for name, kind in CONTROLS.items() if type(control) is kind.at), "amount of gas")


def solved(border: Border, evaluation: Evaluation, held: Array, own: NumberDerivatives) -> Rates:
    """The derivatives of a state from factors, and from those of the equations at a fixed state; one back-substitution a number."""
    columns = [border.solve(-np.ascontiguousarray(own.force[:, k]), -float(held[k])) for k in range(len(held))]
    dx = np.stack([column for column, _ in columns], axis=1) if columns else own.force
    dp = np.array([float(p) for _, p in columns])
    if not (np.isfinite(dx).all() and np.isfinite(dp).all()):
        raise SolveError("the equations are singular at this equilibrium, which has no derivative", status=Status.NOT_CONVERGED)
    space = evaluation.potential.space
    pole = dx[space.pole] if space.pole < space.n_free else 0.0
    return Rates(dx, dp, evaluation.volume_gradient @ dx + own.volume, pole + own.height)


def null_vector(evaluation: Evaluation, kind: str) -> tuple[Array, float]:
    """The null vector (v, q) at a fold of a kind, of unit length in v.

    At a limit point K v = 0, by inverse iteration. At a volume fold K is regular, and K v = q V'.
    """
    factor, mode, q = BandFactor.of(evaluation), evaluation.volume_gradient, 0.0
    for _ in range(_SWEEPS if kind == "limit_point" else 1):
        mode = factor.solve(mode)
        size = float(np.linalg.norm(mode))
        mode, q = mode / size, 1 / size
    return mode, 0.0 if kind == "limit_point" else q


def differentiated(function: Callable[[float], Array], step: float, *, sided: bool = False) -> Array:
    """Derivative at 0 of an explicit formula, by central differences extrapolated to step 0; one-sided where a side has no values.

    With ``sided`` it is one-sided, and only values at 0 and at positive steps are asked for.
    """
    if sided:
        return _on_side(function, step, 1.0)
    try:
        slopes = [(function(h) - function(-h)) / (2 * h) for h in (step, step / 2, step / 4)]
    except InputError:
        return _on_side(function, step, _side(function, step))
    return _extrapolated(slopes, (4, 16))


def _on_side(function: Callable[[float], Array], step: float, sign: float) -> Array:
    here = function(0.0)
    slopes = [(function(sign * step / 2**k) - here) / (sign * step / 2**k) for k in range(5)]
    return _extrapolated(slopes, (2, 4, 8, 16))


def _extrapolated(slopes: list[Array], powers: Sequence[int]) -> Array:
    for power in powers:
        slopes = [(power * b - a) / (power - 1) for a, b in pairwise(slopes)]
    return slopes[0]


def _side(function: Callable[[float], Array], step: float) -> float:
    try:
        function(step)
    except InputError:
        return -1.0
    return 1.0
