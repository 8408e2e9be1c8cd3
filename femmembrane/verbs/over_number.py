"""What runs over a number of the scene share: the number, what is held meanwhile, and the scene of every state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..checks import number
from ..errors import InputError, unknown_name
from ..potential import ContactFamily, Family, Potential
from ..scene import Scene
from ..scene.run import GAS, PRESCRIBED
from ..scene.variation import Parameter, names
from ..solve.continuation import BranchPoint
from ..solve.controls import CONTROLS, Control, Controlled, Gas, GasOver
from ..solve.state import State

#: the quantities that can be held, by the words that users have for them
HELD = {**{name: name for name in CONTROLS}, **PRESCRIBED, GAS: GAS}

#: a number that no membrane notices, in place of 0 where all derivatives vanish: a large one may leave a tension field no state
_SLIGHT = 1e-3


@dataclass(frozen=True)
class Hold:
    """What is held while a number of the scene changes.

    Attributes
    ----------
    name : str
        Public name of the quantity.
    value : float
    over : str
        The number that changes, which may be one of the chamber of a gas.
    """

    name: str
    value: float
    over: str = ""

    @classmethod
    def checked(cls, hold: Any, over: str) -> Hold:
        """What the argument ``hold`` of a verb says.

        Raises
        ------
        InputError
            When it is missing, holds nothing that can be held, or more than one quantity.
        """
        known = ", ".join(dict.fromkeys(HELD.values()))
        if not isinstance(hold, Mapping) or len(hold) != 1:
            allowed = f"one quantity and its value are allowed, such as {{'pressure': 0.0}}; known: {known}"
            raise InputError("hold", hold, f"missing; over a number {allowed}" if hold is None else allowed)
        ((name, value),) = hold.items()
        if name == over:
            raise InputError("hold", name, f"it is the load already; hold another quantity: {known}")
        if isinstance(name, str) and "." in name:
            raise InputError("hold", name, f"a number of the scene is held anyway; one of these is allowed: {known}")
        if name not in HELD:
            raise unknown_name("hold", name, dict.fromkeys(HELD.values()))
        return cls(HELD[name], number(f"hold.{name}", value, above=0.0 if name == GAS else -math.inf), over)

    def controlled(self, scene: Scene) -> Controlled:
        """The quantity."""
        if self.name != GAS:
            return CONTROLS[self.name]
        gas = gas_of(scene, "hold")
        part, _, varies = self.over.partition(".")
        if part != "chamber":
            return gas
        return GasOver(gas.amount, gas.chamber, gas.atmosphere, {"volume": "chamber"}.get(varies, varies))

    def control(self, scene: Scene) -> Control:
        """The control that holds it."""
        return self.controlled(scene).at(self.value)


#: no pressure
AT_REST = Hold("pressure", 0.0)


def checked_number(key: str, scene: Scene, over: Any) -> Parameter:
    """The number of a scene with a name.

    Raises
    ------
    InputError
        For a name that the scene does not have.
    """
    if over in HELD:
        allowed = ", ".join(names(scene)) or "(this scene has none)"
        raise InputError(key, over, f"no number of the scene; inflate, pressurize and trace follow it as it is. Numbers: {allowed}")
    try:
        return Parameter(scene, over)
    except InputError as error:
        raise InputError(key, error.value, error.allowed) from None


def family_of(parameter: Parameter) -> Family:
    """The potential of the scenes that differ in a number."""
    if parameter.scene.bodies:
        return ContactFamily(parameter)
    return Family(parameter.scene, parameter.vary, scene_at=parameter.scene_at, even=parameter.even)


def gas_of(scene: Scene, key: str) -> Gas:
    """An amount of gas in the chamber of a scene.

    Raises
    ------
    InputError
        When the scene has no chamber.
    """
    if scene.chamber is None:
        raise InputError(key, GAS, "the scene has no chamber of gas; give chamber=fm.Chamber(volume=...), in a scene file [chamber] volume")
    return Gas(1.0, scene.chamber.volume, scene.chamber.atmosphere)


class OverNumber:
    """Of a run over a number: the family answers for all scenes, and a state knows its number as the factor of its evaluation."""

    family: Family
    parameter: Parameter

    @property
    def over(self) -> str:
        """Name of the number."""
        return self.parameter.name

    def own(self, state: State) -> State:
        return replace(state, evaluation=self.family.home(state.evaluation, state.pressure))

    def scene_of(self, state: State) -> Scene:
        own = state.evaluation.potential
        return self.family.scene_at(state.evaluation.factor).bordered(own.borders)

    def potential_at(self, point: BranchPoint) -> Potential:
        return self.family.member(point.state.evaluation.factor)

    def refuse_idle(self, state: State) -> None:
        """Raise InputError for a number that changes no force on the membrane."""
        # a chamber acts on the gas, and a flat sheet that is stretched stays flat
        if self.parameter.name.startswith("chamber.") or self.family.moves or self.parameter.shapes:
            return
        family, value = self.family, state.evaluation.factor
        if self.parameter.even:  # at 0 all derivatives vanish
            value = value or _SLIGHT
        if not np.any(family.number_derivative(state.x, state.pressure, value)):
            raise InputError("over", self.parameter.name, "it changes no force on this membrane, so that nothing would happen")
