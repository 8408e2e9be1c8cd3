"""What is prescribed while an equilibrium is sought.

An equilibrium of E - P V has the n + 1 unknowns (x, P). The balance of forces E' - P V' = 0 gives n equations, and a control gives the last
one, N(x, P) = 0. The same bordered Newton corrector solves every control.

:data:`CONTROLS` is the only list of what can be prescribed. It knows the equation of a control, its value in a state, and whether a
minimiser can hold it. A new control is a line of that table, its equation, and a cold start in :mod:`.start`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

import numpy as np

from ..checks import choice, convert
from ..discretization.space import Space
from ..errors import InputError
from ..potential import Array, Evaluation, Potential
from ..quantities import heading
from ..scene.run import MINIMISED, PRESCRIBED


class Control(Protocol):
    """One scalar equation N(x, P) = 0 beside equilibrium, written as (quantity in the state) - (value to be held)."""

    def equation(self, space: Space, x: Array, pressure: float, evaluation: Evaluation) -> tuple[float, Array, float]:
        """N, dN/dx (shape (n_free,)) and dN/dP.

        Parameters
        ----------
        space : Space
        x : ndarray, shape (n_free,)
            Displacement coefficients of the state.
        pressure : float
        evaluation : Evaluation
            Of the potential in this state.
        """


@dataclass(frozen=True)
class VolumeControl:
    """V = volume; the pressure is the multiplier."""

    volume: float

    def equation(self, space: Space, x: Array, pressure: float, evaluation: Evaluation) -> tuple[float, Array, float]:
        return evaluation.volume - self.volume, evaluation.volume_gradient, 0.0


@dataclass(frozen=True)
class PressureControl:
    """P = pressure."""

    pressure: float

    def equation(self, space: Space, x: Array, pressure: float, evaluation: Evaluation) -> tuple[float, Array, float]:
        return pressure - self.pressure, np.zeros_like(x), 1.0


@dataclass(frozen=True)
class CenterHeightControl:
    """Height of the pole = height; a root of the equations, not a minimiser."""

    height: float

    def equation(self, space: Space, x: Array, pressure: float, evaluation: Evaluation) -> tuple[float, Array, float]:
        row = np.zeros(space.n_free)
        row[space.pole] = 1.0
        height = space.center_height(x) + evaluation.potential.pole_rise(evaluation.factor)
        return height - self.height, row, 0.0


@dataclass(frozen=True)
class Gas:
    """A fixed amount of ideal gas at constant temperature: P = amount/(V + chamber) - atmosphere.

    Its potential is -amount log((V + chamber)/chamber) + atmosphere V in place of -P V.

    Parameters
    ----------
    amount : float
        (P + atmosphere)(V + chamber) > 0, constant, in units of mu T R0^2.
    chamber : float
        Volume of the gas behind the flat membrane over R0^3, > 0.
    atmosphere : float
        Outside pressure >= 0 in units of mu T/R0.

    Raises
    ------
    InputError
        For values outside these ranges.
    """

    name: ClassVar[str] = "gas"
    words: ClassVar[str] = "amount of gas"
    minimised: ClassVar[bool] = False
    odd: ClassVar[bool] = False

    amount: float
    chamber: float
    atmosphere: float = 0.0

    def __post_init__(self) -> None:
        convert(self, "gas.amount", "a finite number > 0 is allowed", above=0)
        convert(self, "gas.chamber", "a finite number > 0 is allowed", above=0)
        convert(self, "gas.atmosphere", "a finite number >= 0 is allowed", least=0)

    def pressure(self, volume: float) -> float:
        """Pressure over the atmosphere at a volume of the membrane.

        Parameters
        ----------
        volume : float
            Over R0^3.
        """
        return self.amount / (volume + self.chamber) - self.atmosphere

    def compliance(self, volume: float) -> float:
        """-dV/dP at constant amount.

        Parameters
        ----------
        volume : float
            Over R0^3.
        """
        return (volume + self.chamber) ** 2 / self.amount

    def at(self, amount: float) -> Gas:
        """Another amount of the gas, in the same chamber.

        Parameters
        ----------
        amount : float
            In units of mu T R0^2.
        """
        return replace(self, amount=amount)

    def value(self, space: Space, x: Array, pressure: float, volume: float) -> float:
        """The amount of gas that holds a state: (P + atmosphere)(V + chamber)."""
        return (pressure + self.atmosphere) * (volume + self.chamber)

    def rate(self, space: Space, pressure: float, evaluation: Evaluation, dx: Array, dp: float) -> float:
        """Derivative of the amount along a direction (dx, dP)."""
        total, absolute = evaluation.volume + self.chamber, pressure + self.atmosphere
        return dp * total + absolute * float(evaluation.volume_gradient @ dx)

    def rest(self, space: Space) -> float:
        """The amount that holds the undeformed membrane.

        Parameters
        ----------
        space : Space
        """
        return self.atmosphere * (space.reference_volume + self.chamber)

    def unit(self, space: Space) -> float:
        """What an amount is compared with.

        Parameters
        ----------
        space : Space
        """
        return (space.units["pressure"] + self.atmosphere) * (space.units["volume"] + self.chamber)

    def refusal(self, pressure: float, volume: float) -> str:
        """Why no amount of the gas holds a state with this pressure and volume; empty where one does.

        Parameters
        ----------
        pressure, volume : float
            Of the state.
        """
        if (pressure + self.atmosphere) * (volume + self.chamber) > 0 and volume > -self.chamber:
            return ""
        return "the start does not compress the gas (P + atmosphere <= 0); start at a larger volume"

    def equation(self, space: Space, x: Array, pressure: float, evaluation: Evaluation) -> tuple[float, Array, float]:
        absolute, total = pressure + self.atmosphere, evaluation.volume + self.chamber
        return absolute * total - self.amount, absolute * evaluation.volume_gradient, total


@dataclass(frozen=True)
class GasOver(Gas):
    """A fixed amount of gas of which the chamber or the atmosphere is the number that changes.

    Parameters
    ----------
    varies : {"chamber", "atmosphere"}
        Which of them; further parameters as for :class:`Gas`.
    """

    varies: str = "chamber"

    def over(self, number: float) -> Gas:
        """The gas at a value of the number.

        Parameters
        ----------
        number : float
        """
        return replace(self, chamber=number) if self.varies == "chamber" else replace(self, atmosphere=number)

    def number_rate(self, pressure: float, volume: float) -> float:
        """Derivative of the equation with respect to the number.

        Parameters
        ----------
        pressure, volume : float
            Of the state.
        """
        return pressure + self.atmosphere if self.varies == "chamber" else volume + self.chamber


def check_height(key: str, potential: Potential) -> None:
    """Raise InputError where the height of the first point of the meridian is held, and cannot be prescribed."""
    if potential.space.pole == potential.space.n_free:
        raise InputError(
            key, "a height", f"the first end of this {potential.scene.mesh.shape} is held along the axis; prescribe a volume or a pressure"
        )


def at_number(control: Control, number: float) -> Control:
    """A control at a value of the number of a family: only that of a gas may change with it.

    Parameters
    ----------
    control : Control
    number : float
    """
    return control.over(number) if isinstance(control, GasOver) else control


def is_held(held: Controlled, state_value: float, value: float, space: Space) -> bool:
    """Whether a state has a value of what is held already, within round-off: at a fold no steps lead from one to the other."""
    return abs(state_value - value) <= 1e-11 * (held.unit(space) + abs(value))


@dataclass(slots=True, eq=False)
class ArcLengthControl:
    """Pseudo-arc length: <tangent, (x, P) - (prediction)> = 0. ``dual`` is the tangent with the inner product already applied."""

    dual: Array
    dual_pressure: float
    prediction: Array
    predicted_pressure: float

    def equation(self, space: Space, x: Array, pressure: float, evaluation: Evaluation) -> tuple[float, Array, float]:
        value = self.dual.dot(x - self.prediction) + self.dual_pressure * (pressure - self.predicted_pressure)
        return float(value), self.dual, self.dual_pressure


@dataclass(slots=True, eq=False)
class CarriedArcLength(ArcLengthControl):
    """The same for displacements on another mesh: ``dual`` is of these, and ``offset`` what it is of the prediction."""

    offset: float = 0.0

    def equation(self, space: Space, x: Array, pressure: float, evaluation: Evaluation) -> tuple[float, Array, float]:
        value = self.dual.dot(x) - self.offset + self.dual_pressure * (pressure - self.predicted_pressure)
        return float(value), self.dual, self.dual_pressure


class Controlled(Protocol):
    """A number that a control holds and a branch is followed in: one of :data:`CONTROLS`, or the amount of a :class:`Gas`.

    A run from load to load, and the walk along a branch under it, know what is prescribed by this alone.
    """

    @property
    def name(self) -> str:
        """Public name."""

    @property
    def words(self) -> str:
        """The name as sentences have it."""

    @property
    def minimised(self) -> bool:
        """Whether a minimiser can hold it; other controls take Newton's method."""

    @property
    def odd(self) -> bool:
        """Whether the mirror image of a membrane that is flat at rest has the opposite value."""

    def at(self, load: float, /) -> Control:
        """The control that holds the number at a load."""

    def value(self, space: Space, x: Array, pressure: float, volume: float) -> float:
        """The number in a state.

        Parameters
        ----------
        space : Space
        x : ndarray, shape (n_free,)
            Displacement coefficients of the state.
        pressure, volume : float
        """

    def rate(self, space: Space, pressure: float, evaluation: Evaluation, dx: Array, dp: float) -> float:
        """Derivative of the number along a direction.

        Parameters
        ----------
        space : Space
        pressure : float
        evaluation : Evaluation
            Of the potential in the state.
        dx : ndarray, shape (n_free,)
        dp : float
            The direction (dx, dP).
        """

    def rest(self, space: Space, /) -> float:
        """The number in the undeformed membrane.

        Parameters
        ----------
        space : Space
        """

    def unit(self, space: Space, /) -> float:
        """What the number is compared with.

        Parameters
        ----------
        space : Space
        """

    def refusal(self, pressure: float, volume: float) -> str:
        """Why no load of the control holds a state with this pressure and volume; empty where one does.

        Parameters
        ----------
        pressure, volume : float
            Of the state.
        """


@dataclass(frozen=True)
class ControlKind:
    """A quantity that can be prescribed.

    Parameters
    ----------
    name : str
        Public name: argument of the verbs, attribute of an equilibrium, column of a branch, key of :attr:`.Space.units`.
    at : callable
        The control that holds it at a load.
    value : callable
        Its value in a state: (space, x, pressure, volume) -> float.
    rate : callable
        Its derivative along a direction: (space, pressure, evaluation, dx, dP) -> float.
    rest : callable
        Its value in the undeformed membrane: space -> float.
    """

    name: str
    at: Callable[[float], Control]
    value: Callable[[Space, Array, float, float], float]
    rate: Callable[[Space, float, Evaluation, Array, float], float]
    rest: Callable[[Space], float]

    @property
    def symbol(self) -> str:
        """How messages and tables write it."""
        return heading(self.name)

    @property
    def words(self) -> str:
        """The name as sentences have it."""
        return self.name.replace("_", " ")

    @property
    def minimised(self) -> bool:
        """Whether a minimiser can hold it; other controls take Newton's method."""
        return self.name in MINIMISED

    @property
    def odd(self) -> bool:
        """Volume, pressure and height of a flat membrane change their signs with it."""
        return True

    def unit(self, space: Space, /) -> float:
        """What it is compared with."""
        return space.units[self.name]

    def refusal(self, pressure: float, volume: float) -> str:
        """Every state has a volume, a pressure and a height."""
        return ""


def _pole_rate(space: Space, pressure: float, evaluation: Evaluation, dx: Array, dp: float) -> float:
    return float(dx[space.pole]) if space.pole < dx.size else 0.0


#: every quantity that can be prescribed, by its public name
CONTROLS: Mapping[str, ControlKind] = {
    kind.name: kind
    for kind in (
        ControlKind(
            "volume",
            VolumeControl,
            value=lambda space, x, pressure, volume: volume,
            rate=lambda space, pressure, evaluation, dx, dp: float(evaluation.volume_gradient @ dx),
            rest=lambda space: space.reference_volume,
        ),
        ControlKind(
            "pressure",
            PressureControl,
            value=lambda space, x, pressure, volume: pressure,
            rate=lambda space, pressure, evaluation, dx, dp: dp,
            rest=lambda space: 0.0,
        ),
        ControlKind(
            "center_height",
            CenterHeightControl,
            value=lambda space, x, pressure, volume: space.center_height(x),
            rate=_pole_rate,
            rest=lambda space: space.first_height,
        ),
    )
}


def control_kind(name: str) -> ControlKind:
    """The control with a public name, or with the word that [run] has for it (``height``).

    Parameters
    ----------
    name : str

    Raises
    ------
    InputError
        For an unknown name.
    """
    known = PRESCRIBED.get(name, name) if isinstance(name, str) else name
    return CONTROLS[choice("control", known, CONTROLS)]
