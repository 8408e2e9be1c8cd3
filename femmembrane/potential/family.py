"""The potential of scenes that differ in one number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from ..discretization.lift import Moving
from ..discretization.space import space_of_scene
from ..errors import InputError
from ..kernels.interface import Array, Elements
from ..physics.magnetics import swept
from ..physics.magnetisation import Magnetisation, sources_that_act
from ..physics.response import squared
from ..threads import cached_property
from .charge import Charged
from .evaluation import Evaluation
from .expressions import BUILDING, casadi_answers_numpy
from .of_scene import potential_of, require_elements
from .potential import Potential
from .replay import Replay

if TYPE_CHECKING:
    from ..scene import Scene


#: members that a family keeps: neighbours on a curve ask for the same ones
_KEPT = 8
#: distance of two values, relative to the larger one, at which they are not told apart any more
ROUND_OFF = 1e-15


@dataclass(slots=True)
class FoldDerivatives:
    """Derivatives that a fold followed in a number of the scene needs, for a mode (v, q) of displacement and pressure.

    ``cubic``, ``cubic_pressure`` and ``cubic_number`` differentiate the quadratic form v.(E'' - P V'') v - 2 q V'.v with respect to x
    (shape (n_free,)), P and the number. ``force_number`` differentiates E' - P V' with respect to the number, shape (n_free,).
    """

    cubic: Array
    cubic_pressure: float
    cubic_number: float
    force_number: Array


class Family(Potential):
    """The potential of scenes that differ in one number, built once for all its values.

    It is a :class:`Potential` whose factor, third argument of :meth:`evaluate`, is the number.

    Parameters
    ----------
    scene : Scene
        Any member of the family.
    vary : callable
        The parts of the member at a value of the number, a CasADi symbol here: an object with the attributes of a scene.
    scene_at : callable, optional
        The member itself, a checked scene, for whoever asks for the potential of one.
    even : bool
        Whether a number and its negative are the same scene.
    """

    @BUILDING
    def __init__(
        self,
        scene: Scene,
        vary: Callable[[Any], Any],
        quadrature: int | None = None,
        *,
        scene_at: Callable[[float], Scene] | None = None,
        even: bool = False,
    ) -> None:
        require_elements(scene)
        self.even = even
        self._scene_at = scene_at or (lambda number: scene)
        self._members: dict[float, Member] = {}
        number = ca.SX.sym("number")
        with casadi_answers_numpy():
            member = vary(number)
            super().__init__(member, quadrature)
        self._way: Moving | None = getattr(member, "lifted", None)
        self.electric = self.scene.electricity  # of the family: with the number as a symbol, or another than that of the scene below
        self._vary = vary
        if scene.electric is not None and self.electric is not None and scene.electricity is None:  # the member with 0 says nothing of it
            scene = scene.replace(electric=replace(scene.electric, **{scene.electric.load: 1.0}))
        self.scene, self.sources, self.loads = scene, scene.sources, scene.loads
        self.magnetisation = Magnetisation.of(scene) if scene.sources else None
        if self._like is not None:  # whose terms know the number
            return
        slot = self.symbols[2][1]
        names = list(self.terms)
        old, new = ca.vertcat(slot, number), ca.vertcat(1.0, slot)
        self.terms = {name: ca.substitute(self.terms[name], old, new) for name in names}

    def square(self, x: Array, factor: float = 1.0) -> float | None:
        if self.electric is None:
            return None
        return super().square(x, factor) if self.charged is not None else float(squared(self._vary(factor).electricity))

    def charge_squared(self, factor: float) -> float:
        return float(self._vary(factor).electricity.total_charge) ** 2

    @property
    def moves(self) -> bool:
        """Whether the number moves an end of the membrane."""
        return self._way is not None

    def pole_rise(self, factor: float) -> float:
        return 0.0 if self._way is None else self.pole_rate * (factor - self._way.at)

    @property
    def pole_rate(self) -> float:
        """Derivative of the height of the pole, at fixed unknowns, with respect to the number."""
        return 0.0 if self._way is None else self._way.unit.axial[0]

    def member(self, number: float) -> Potential:
        """The potential of the scene that has a value of the number. Nothing is built for it; the last ones are kept.

        Raises
        ------
        InputError
            For a value that the scene cannot take.
        """
        known = self._members.pop(number, None)
        if known is None:
            known = Member(self, self._scene_at(number), number)
        self._members[number] = known
        if len(self._members) > _KEPT:
            self._members.pop(next(iter(self._members)), None)
        return known

    def scene_at(self, number: float) -> Scene:
        """The scene that has a value of the number, with all that was asked of the scene given: scales, analyses, and its title.

        Raises
        ------
        InputError
            For a value that the scene cannot take.
        """
        return self.member(number).scene

    def takes(self, number: float) -> bool:
        """Whether there is a scene with a value of the number."""
        try:
            self.member(number)
        except InputError:
            return False
        return True

    def last_value(self, before: float, beyond: float) -> float:
        """The last value that the scene can take on the way from one that it can to one that it cannot take."""
        if before * beyond < 0 and not self.takes(-ROUND_OFF * before) and self.takes(0.0):
            return 0.0
        while abs(beyond - before) > ROUND_OFF * max(abs(before), abs(beyond)):
            middle = (before + beyond) / 2
            if middle in (before, beyond):
                break
            before, beyond = (middle, beyond) if self.takes(middle) else (before, middle)
        return before

    def home(self, evaluation: Evaluation, pressure: float) -> Evaluation:
        """A state of the family as one of its own scene."""
        return self.member(evaluation.factor).evaluate(evaluation.x, pressure)

    def came_through_source(self, number: float, x: Array, before: float, x_before: Array) -> bool:
        """Whether the membrane went through a source on the way from a state of another member, where that source stood elsewhere.

        What counts is the way relative to the source.
        """
        here, there = self.member(number), self.member(before)
        if not here.sources or len(here.sources) != len(there.sources):
            return False
        meridians = there._meridian(x_before), here._meridian(x)
        heights = list(zip(here.space.axis_heights(x_before), here.space.axis_heights(x), strict=True))
        for source, old in zip(here.sources, there.sources, strict=True):
            rise = getattr(source, "height", 0.0) - getattr(old, "height", 0.0)
            if any(source.passed(start + rise, end) for start, end in heights):
                return True
            for circle, place in zip(source.circles, old.circles, strict=True):
                if swept(meridians[0] + (np.array(circle) - np.array(place))[:, None], meridians[1], circle):
                    return True
        return False

    @cached_property
    @BUILDING
    def _fold_kernel(self) -> Replay:
        if isinstance(self._like, Family):
            return Replay(self._like._fold_kernel.function, self.point_data)
        t, (data, local, parameters) = self.terms, self.symbols
        mode, q = ca.SX.sym("mode", 4), ca.SX.sym("q")
        force = t["gradient"] - parameters[0] * t["volume_gradient"]
        form = ca.dot(mode, ca.jtimes(force, local, mode)) - 2 * q * ca.dot(t["volume_gradient"], mode)
        rows = [ca.gradient(form, local), ca.gradient(form, parameters), ca.jacobian(force, parameters[1])]
        symbols = [data, ca.vertcat(local, mode), ca.vertcat(parameters, q)]
        return Replay(ca.Function("fold", symbols, [ca.densify(ca.vertcat(*rows))], {"cse": True}), self.point_data)

    @cached_property
    @BUILDING
    def _number_kernel(self) -> Replay:
        if isinstance(self._like, Family):
            return Replay(self._like._number_kernel.function, self.point_data)
        t, (data, local, parameters) = self.terms, self.symbols
        force = ca.jacobian(t["gradient"] - parameters[0] * t["volume_gradient"], parameters[1])
        rows = ca.vertcat(force, ca.jacobian(t["volume"], parameters[1]))
        return Replay(ca.Function("number", [data, local, parameters], [ca.densify(rows)], {"cse": True}), self.point_data)

    def number_derivative(self, x: Array, pressure: float, number: float) -> Array:
        """Derivative of E' - P V' with respect to the number, shape (n_free,)."""
        rows = self._number_rows(x, pressure, number)[:4]
        own = self.space.assemble_vector(rows.reshape(-1, self.space.n_elements))
        return own if self.charged is None else own + self.charged.number_derivative(x, number)

    def advance(self, evaluation: Evaluation) -> float:
        """How far bodies come to a membrane at a state for each unit of the number, over the size of the membrane."""
        return 0.0

    def number_rates(self, evaluation: Evaluation, pressure: float) -> tuple[Array, Array | None]:
        """:meth:`number_derivative` at a state, and how bodies that hold nodes move these with the number; None where none does."""
        return self.number_derivative(evaluation.x, pressure, evaluation.factor), None

    def _number_rows(self, x: Array, pressure: float, number: float) -> Array:
        more = [] if self.charged is None else [self.charged.square(x, number)]
        return self._number_kernel(self.space.at_quadrature(x), np.array([pressure, number, *more]))

    def volume_derivative(self, x: Array, number: float) -> float:
        """Derivative of the volume with respect to the number: zero unless that moves the ends of the membrane."""
        if not self.moves:
            return 0.0
        return float(self._number_rows(x, 0.0, number)[4].sum())

    def fold_rates(self, evaluation: Evaluation, pressure: float, mode: Array, q: float) -> tuple[FoldDerivatives, Array | None]:
        """:meth:`fold_derivatives` at a state, and how bodies that hold nodes move these with the number; None where none does."""
        return self.fold_derivatives(evaluation.x, pressure, evaluation.factor, mode, q), None

    def fold_derivatives(self, x: Array, pressure: float, number: float, mode: Array, q: float) -> FoldDerivatives:
        """Third derivatives contracted twice with a mode (v, q), and derivatives with respect to the number."""
        if self.charged is not None:
            return FoldDerivatives(
                *self.charged.fold_derivatives(x, pressure, number, mode, q), self.number_derivative(x, pressure, number)
            )
        space, ne = self.space, self.space.n_elements
        local = np.concatenate([space.at_quadrature(x), space.at_quadrature(mode)])
        out = self._fold_kernel(local, np.array([pressure, number, q]))
        cubic, force = (space.assemble_vector(rows.reshape(-1, ne)) for rows in (out[:4], out[6:]))
        return FoldDerivatives(cubic, float(out[4].sum()), float(out[5].sum()), force)


class Member(Potential):
    """The potential of one scene of a family: the functions of the family, called with the number that this scene has.

    Parameters
    ----------
    family : Family
    scene : Scene
    number : float
    """

    def __init__(self, family: Family, scene: Scene, number: float) -> None:
        self.scene, self.number = scene, number
        self.family = family
        self.sources = sources_that_act(scene)
        self.loads = tuple(load for load in scene.loads if load.acts)
        self.space = space_of_scene(scene) if family.moves else family.space
        self.magnetisation = Magnetisation.of(scene) if self.sources else None
        for name in ("sheet", "level", "symbols", "point_data", "n_points", "bulk", "mass", "area", "rigid"):
            self.__dict__[name] = getattr(family, name)
        self.strained = self.space.strained or self.prestressed
        self.flat = self.level and not self.strained

    @cached_property
    @BUILDING
    def terms(self) -> dict[str, ca.SX]:  # type: ignore[override]
        """Those of the family at the number."""
        slot = self.symbols[2][1]
        return {name: ca.substitute(term, slot, self.number) for name, term in self.family.terms.items()}

    @property
    def elements(self) -> Elements:
        return self.family.elements

    def evaluate(self, x: Array, pressure: float, magnetic: float = 1.0, slot: float | None = None) -> Evaluation:
        """As :meth:`.Potential.evaluate`; with weaker sources it is the scene's own potential that answers."""
        if magnetic != 1.0:
            return potential_of(self.scene).evaluate(x, pressure, magnetic)
        return super().evaluate(x, pressure, magnetic, self.number)

    @property
    def charged(self) -> Charged | None:
        """Those of the family, which know the number."""
        return self.family.charged

    def square(self, x: Array, factor: float = 1.0) -> float | None:
        return self.family.square(x, self.number) if factor == 1.0 else potential_of(self.scene).square(x, factor)

    def electric_energy(self, x: Array, factor: float = 1.0) -> float:
        return self.family.electric_energy(x, self.number) if factor == 1.0 else potential_of(self.scene).electric_energy(x, factor)
