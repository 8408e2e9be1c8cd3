"""A run from value to value of a number of the scene, while a quantity is held."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..errors import Status
from ..potential import potential_of
from ..results.branch import Branch
from ..results.equilibrium import Equilibrium
from ..scene import Scene
from ..solve.controls import CONTROLS, Control, Controlled, Gas, GasOver
from ..solve.number_path import NumberPath
from ..solve.state import State
from .arguments import kind_of
from .load_run import LoadRequest, LoadRun, checked_loads
from .over_number import AT_REST, Hold, OverNumber, checked_number, family_of
from .running import End
from .state_records import OnStep, restore, resume


@dataclass(frozen=True, eq=False)
class NumberRequest(LoadRequest):
    """Equilibria at values of a number of the scene, in the order given.

    Attributes
    ----------
    over : str
        Name of the number.
    hold : Hold
        What is held.
    """

    over: str = ""
    hold: Hold = AT_REST

    @classmethod
    def checked(
        cls,
        scene: Scene,
        values: ArrayLike,
        *,
        over: Any,
        hold: Any,
        key: str = "over",
        values_key: str = "values",
        start: Equilibrium | None = None,
        solver: str = "ipopt",
        at_limit: str = "stop",
        throw: bool = False,
    ) -> Self:
        """The request that the arguments of :func:`femmembrane.vary` make, or InputError."""
        parameter = checked_number(key, scene, over)
        held = Hold.checked(hold, parameter.name)
        loads = checked_loads(values_key, values, scene, parameter.name)
        for value in loads.tolist():
            parameter.scene_at(value)
        return cls(held.controlled(scene), loads, start, solver, at_limit, throw, over=parameter.name, hold=held)

    @property
    def mesh_changes(self) -> bool:
        return False

    def prepared(self, scene: Scene, on_step: OnStep | None) -> LoadRun:
        return NumberRun(scene, self, on_step)


class NumberRun(OverNumber, LoadRun):
    """A run over a number under way."""

    request: NumberRequest
    path: NumberPath

    def __init__(self, scene: Scene, request: NumberRequest, on_step: OnStep | None = None) -> None:
        self.parameter = checked_number("over", scene, request.over)
        self.family = family_of(self.parameter)
        super().__init__(scene, request, on_step, self.family)

    def new_path(self) -> NumberPath:
        request, loads = self.request, self.request.loads
        scale = float(np.ptp(loads)) or abs(float(loads[0])) or abs(self.parameter.value)
        held: Controlled = request.hold.controlled(self.scene)
        return NumberPath(self.family, request.over, held, request.hold.value, request.solver, scale)

    def set_out(self, start: Equilibrium) -> None:
        number = checked_number("start", start.scene, self.request.over).value
        self.path.set_out(resume(potential_of(self.parameter.scene_at(number)), start), number)

    def step(self) -> End | None:
        first = self.path.state is None
        end = super().step()
        if first and self.path.state is not None:
            self.refuse_idle(self.path.state)
        return end

    def restored(self, last: Equilibrium, load: float) -> State:
        return restore(self.family, last, load)

    @property
    def control(self) -> Control:
        return self.gas or CONTROLS[self.request.hold.name].at(self.request.hold.value)

    @property
    def gas(self) -> Gas | None:
        control = self.path.control(self.path.load)
        if isinstance(control, GasOver):
            return Gas(control.amount, control.chamber, control.atmosphere)
        return control if isinstance(control, Gas) else None

    @property
    def kind(self) -> str:
        return kind_of(self.request.over)

    @property
    def words(self) -> str:
        return self.request.over

    def result(self, status: Status, message: str, found: Sequence[Equilibrium] | None = None) -> Branch:
        hold: Mapping[str, float] = {self.request.hold.name: self.request.hold.value}
        return replace(super().result(status, message, found), over=self.request.over, hold=hold)
