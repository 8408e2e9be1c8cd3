"""How an equilibrium moves with numbers of its scene beside rigid bodies: on its set of held nodes, with the borders of contact.

An equilibrium on a mesh whose ends b follow the borders of contact is a root of ::

    T^T R(x, P, b, m) = 0,    gap_i(x, b, m) = 0 at held nodes,    N(x, P, b, m) = 0,    F(x, P, b, m) = 0

with F the forces across the borders (:func:`.active_set.border_forces`). The first three at fixed b have the factors of the last Newton
step. One back-substitution gives a column (dx, dP) for each number, for each border, and for the held quantity, with the motion of held
nodes from :meth:`.ContactFamily.number_rates`. F along these columns is an explicit formula, whose derivatives leave a system as small as
the number of borders. Nothing is solved again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import cast

import numpy as np

from ..errors import SolveError, Status
from ..kernels.interface import Border
from ..potential import Array, ContactFamily, Evaluation
from ..potential.contact import ContactEvaluation, ContactPotential
from ..potential.following import Borders
from ..scene import Scene
from ..scene.variation import Parameter, Scale
from ..threads import cached_property
from .active_set import border_forces
from .controls import CONTROLS, Control
from .fold_curve import FoldProblem, first_fold
from .sensitivity import Rates, Sensitive, differentiated, mixed, refuse_fold
from .state import inner
from .stepping import control_rate

#: steps of differences of explicit formulas: of a number or the membrane, and of a border in shares of an element
_STEP, _SHARE = 2e-3, 2e-2


@dataclass(frozen=True, eq=False)
class _Column:
    """A change of the state at fixed borders but one, with what it makes of volume, height of the pole, and forces across borders."""

    x: Array
    pressure: float
    volume: float
    height: float
    across: Array


class BesideBodies(Sensitive):
    """As :class:`.Sensitive`, of a scene with bodies on the mesh that it gives: equilibria on meshes with borders share it."""

    @cached_property
    def _families(self) -> dict[str, ContactFamily]:
        return {name: ContactFamily(Parameter(self.scene, name)) for weights in self._weights for name in weights}

    @property
    def _weights(self) -> list[dict[str, float]]:
        """How numbers of the scene change with those asked for. Numbers that go with one of a material do so in its family."""
        pairs = zip(self.parameters, self._rates, strict=True)
        return [rates if isinstance(p, Scale) else {p.name: 1.0} for p, rates in pairs]

    def at_control(self, evaluation: Evaluation, pressure: float, control: Control) -> Rates:
        state = _Linear(cast(ContactEvaluation, evaluation), pressure, control)
        numbers = [state.by_number(family) for family in self._families.values()]
        total, borders, load = state.with_borders(numbers)
        refuse_fold(evaluation, load.x, load.pressure, control)
        mix = mixed(self._weights, list(self._families))
        held = self.held_rates(control, pressure, evaluation.volume)

        def mixture(name: str) -> Array:
            columns = np.array([getattr(column, name) for column in total]).T
            found: Array = columns @ mix - np.multiply.outer(np.asarray(getattr(load, name)), held)
            return found

        moved = borders[:, :-1] @ mix - np.outer(borders[:, -1], held)
        return Rates(mixture("x"), mixture("pressure"), mixture("volume"), mixture("height"), moved)

    def at_fold(self, evaluation: Evaluation, pressure: float, kind: str) -> Rates:
        """As :meth:`.Sensitive.at_fold`. Along its curve the fold moves with the rates of :class:`.FoldProblem`; the rest of its motion is
        that of the equilibrium under the control that is stationary at the other kind of folds.
        """
        own = cast(ContactEvaluation, evaluation)
        held = "volume" if kind == "limit_point" else "pressure"
        value = evaluation.volume if held == "volume" else pressure
        control = CONTROLS[held].at(value)
        rates = self.at_control(evaluation, pressure, control)
        state = _Linear(own, pressure, control)
        _, borders, load = state.with_borders([])
        along = {name: self._fold_rate(family, own, pressure, kind, held) for name, family in self._families.items()}
        own_rates = np.array([along[name] for name in self._families]) @ mixed(self._weights, list(self._families))

        def moved(rate: Array, by_load: Array | float) -> Array:
            found: Array = rate + np.multiply.outer(np.asarray(by_load), own_rates)
            return found

        return Rates(
            moved(rates.x, load.x),
            moved(rates.pressure, load.pressure),
            moved(rates.volume, load.volume),
            moved(rates.height, load.height),
            moved(cast(Array, rates.borders), borders[:, -1]),
        )

    @staticmethod
    def _fold_rate(family: ContactFamily, evaluation: ContactEvaluation, pressure: float, kind: str, held: str) -> float:
        number = family.parameter.value
        problem = FoldProblem(family, kind, abs(number) or 1.0, (-np.inf, np.inf))
        point = first_fold(problem, evaluation.carried(evaluation.x), pressure, number, 1)
        return point.rate(held) / point.rate("number")

    def placed(self, evaluation: Evaluation, k: int, t: float, x: Array, borders: Borders) -> Array:
        """A state with its held nodes moved onto the bodies, after number k has changed by t."""
        own, parameter = cast(ContactEvaluation, evaluation), self.parameters[k]
        if isinstance(parameter, Scale):
            return cast(ContactPotential, own.potential).bordered(borders).holding(own.held).placed(x, own.factor)
        return self._families[parameter.name].bordered(borders).holding(own.held).placed(x, parameter.value + t)


class _Linear:
    """The linear equations of an equilibrium on its set of held nodes."""

    def __init__(self, evaluation: ContactEvaluation, pressure: float, control: Control) -> None:
        self.evaluation, self.pressure, self.control = evaluation, pressure, control
        self.potential = cast(ContactPotential, evaluation.potential)
        if evaluation.touched() is not None:
            message = "a body is touched without a force there: the membrane moves in one way onto it and in another one off it, so that "
            raise SolveError(message + "nothing has a derivative", status=Status.NOT_CONVERGED)
        _, self.row, corner = control.equation(self.potential.space, evaluation.x, pressure, evaluation.raw)
        self.border: Border = evaluation.border(evaluation.reduction.projected(self.row), corner)

    def with_borders(self, numbers: list[_Column]) -> tuple[list[_Column], Array, _Column]:
        """Columns with the borders moving, how these move, shape (k, m + 1), and the last one, of a unit of the held quantity."""
        own = [self.by_border(j) for j in range(len(self.potential.borders))]
        given = [*numbers, self.by_load()]
        if not own:
            return given[:-1], np.zeros((0, len(given))), given[-1]
        across = np.array([column.across for column in own]).T
        moved = -np.linalg.solve(across, np.array([column.across for column in given]).T)
        found = [
            _Column(
                column.x + sum(m * c.x for m, c in zip(by, own, strict=True)),
                column.pressure + sum(m * c.pressure for m, c in zip(by, own, strict=True)),
                column.volume + sum(m * c.volume for m, c in zip(by, own, strict=True)),
                column.height + sum(m * c.height for m, c in zip(by, own, strict=True)),
                np.zeros(len(own)),
            )
            for column, by in zip(given, moved.T, strict=True)
        ]
        return found[:-1], moved, found[-1]

    def by_number(self, family: ContactFamily) -> _Column:
        """With a number at fixed borders."""
        own, x, value = self.evaluation, self.evaluation.x, family.parameter.value
        there = family.bordered(self.potential.borders).holding(own.held)
        here = there.evaluate(x, self.pressure, value)
        force, shift = there.number_rates(here, self.pressure)
        shift = np.zeros_like(x) if shift is None else shift
        held = control_rate(there, self.control, x, self.pressure, here) + float(self.row @ shift)
        dx, dp = self.border.solve(-force, -held)
        dx = dx + shift

        def across(t: float) -> Array:
            moved = there.evaluate(there.placed(x + t * dx, value + t), self.pressure + t * dp, value + t)
            return border_forces(cast(ContactEvaluation, moved), self.pressure + t * dp)

        step = self._step(dx, dp, abs(value) or 1.0)
        return self._column(dx, dp, there.volume_derivative(x, value), there.pole_rate, across, step)

    def by_load(self) -> _Column:
        """With the held quantity at fixed borders."""
        own = self.evaluation
        dx, dp = self.border.solve(np.zeros_like(own.x), 1.0)
        there = self.potential.holding(own.held)

        def across(t: float) -> Array:
            moved = there.evaluate(there.placed(own.x + t * dx, own.factor), self.pressure + t * dp, own.factor)
            return border_forces(cast(ContactEvaluation, moved), self.pressure + t * dp)

        return self._column(dx, dp, 0.0, 0.0, across, self._step(dx, dp, np.inf))

    def by_border(self, j: int) -> _Column:
        """With the place of one border: nodes between ends of elements go with these, and held nodes stay on the bodies."""
        own, potential, space = self.evaluation, self.potential, self.potential.space
        end, place = potential.borders[j]
        step = _SHARE * float(np.diff(space.ends)[end - 1 : end + 1].min())

        def at(t: float, x: Array, dp: float) -> ContactEvaluation:
            borders = (*potential.borders[:j], (end, place + t), *potential.borders[j + 1 :])
            there = potential.bordered(borders).holding(own.held)
            return cast(ContactEvaluation, there.evaluate(there.placed(x, own.factor), self.pressure + dp, own.factor))

        def equations(t: float) -> Array:
            moved = at(t, own.x, 0.0)
            force = moved.reduced(moved.gradient - self.pressure * moved.volume_gradient)
            gap = self.control.equation(moved.potential.space, moved.x, self.pressure, moved.raw)[0]
            return np.concatenate([moved.x, force, [moved.volume, gap]])

        found = differentiated(equations, step)
        n = own.x.size
        shift, force, (volume, held) = found[:n], own.expanded(found[n : 2 * n]), found[2 * n :]
        dx, dp = self.border.solve(-force, -float(held))
        dx = dx + shift
        volume -= float(own.raw.volume_gradient @ shift)  # of the shape of the mesh alone

        def across(t: float) -> Array:
            return border_forces(at(t, own.x + t * dx, t * dp), self.pressure + t * dp)

        return self._column(dx, dp, float(volume), 0.0, across, min(step, self._step(dx, dp, np.inf)))

    def _column(self, dx: Array, dp: float, volume: float, height: float, across: Callable[[float], Array], step: float) -> _Column:
        own, space = self.evaluation, self.potential.space
        forces = differentiated(across, step) if self.potential.borders else np.zeros(0)
        pole = float(dx[space.pole]) if space.pole < space.n_free else 0.0
        return _Column(dx, float(dp), float(own.raw.volume_gradient @ dx) + volume, pole + height, forces)

    def _step(self, dx: Array, dp: float, size: float) -> float:
        """A step that moves neither a number of a size nor the membrane far."""
        move = float(np.sqrt(inner(self.potential, dx, dp, dx, dp)))
        return _STEP * min(size, 1 / move if move else np.inf, 1e6)


@lru_cache(maxsize=16)
def sensitive(scene: Scene, names: tuple[str, ...]) -> Sensitive:
    """:class:`.Sensitive`, built once for a scene and its names; for all places of borders of contact."""
    return BesideBodies(scene.bordered(()), names) if scene.bodies else Sensitive(scene, names)
