"""What is prescribed while an equilibrium is sought.

An equilibrium of E - P V has the n + 1 unknowns (x, P); the out-of-balance force E' - P V' = 0 gives n equations and a control the last
one, N(x, P) = 0. Every control is solved by the same bordered Newton corrector.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..checks import convert
from ..discretization.space import Space
from ..potential import Array, Evaluation


class Control(Protocol):
    """One scalar equation N(x, P) = 0 beside equilibrium, written as (what is held) - (its value)."""

    def equation(self, space: Space, x: Array, pressure: float, evaluation: Evaluation) -> tuple[float, Array, float]:
        """N, dN/dx (shape (n_free,)) and dN/dP."""


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
        return space.center_height(x) - self.height, self._row(space), 0.0

    def _row(self, space: Space) -> Array:
        row = np.zeros(space.n_free)
        row[space.pole] = 1.0
        return row


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

    amount: float
    chamber: float
    atmosphere: float = 0.0

    def __post_init__(self) -> None:
        convert(self, "gas.amount", "a finite number > 0 is allowed", above=0)
        convert(self, "gas.chamber", "a finite number > 0 is allowed", above=0)
        convert(self, "gas.atmosphere", "a finite number >= 0 is allowed", least=0)

    def pressure(self, volume: float) -> float:
        """Pressure over the atmosphere at a volume of the membrane."""
        return self.amount / (volume + self.chamber) - self.atmosphere

    def compliance(self, volume: float) -> float:
        """-dV/dP at constant amount."""
        return (volume + self.chamber) ** 2 / self.amount

    def equation(self, space: Space, x: Array, pressure: float, evaluation: Evaluation) -> tuple[float, Array, float]:
        absolute, total = pressure + self.atmosphere, evaluation.volume + self.chamber
        return absolute * total - self.amount, absolute * evaluation.volume_gradient, total


@dataclass(frozen=True, eq=False)
class ArcLengthControl:
    """Pseudo-arc length: <tangent, (x, P) - (prediction)> = 0, the inner product already applied to the tangent (its dual)."""

    dual: Array
    dual_pressure: float
    prediction: Array
    predicted_pressure: float

    def equation(self, space: Space, x: Array, pressure: float, evaluation: Evaluation) -> tuple[float, Array, float]:
        value = self.dual @ (x - self.prediction) + self.dual_pressure * (pressure - self.predicted_pressure)
        return float(value), self.dual, self.dual_pressure
