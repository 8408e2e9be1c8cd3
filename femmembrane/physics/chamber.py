"""The chamber of gas behind the membrane: an ideal gas (Clapeyron 1834) at constant temperature."""

from __future__ import annotations

from dataclasses import dataclass

from ..checks import convert


@dataclass(frozen=True)
class Chamber:
    """What holds an enclosed amount of ideal gas besides the membrane: a dead volume, and the atmosphere outside.

    An amount N = (P + atmosphere)(V + volume) of gas, in units of mu T R0^2, is kept at constant temperature.

    Parameters
    ----------
    volume : float
        Volume of the gas behind the flat membrane over R0^3, > 0.
    atmosphere : float
        Outside pressure >= 0 in units of mu T/R0.

    Raises
    ------
    InputError
        For values outside these ranges.
    """

    volume: float
    atmosphere: float = 0.0

    def __post_init__(self) -> None:
        convert(self, "chamber.volume", "a finite number > 0 is allowed (over R0^3)", above=0)
        convert(self, "chamber.atmosphere", "a finite number >= 0 is allowed (in units of mu T/R0)", least=0)

    def amount(self, pressure: float, volume: float) -> float:
        """The amount of gas that holds a state.

        Parameters
        ----------
        pressure, volume : float
            Of the membrane.
        """
        return (pressure + self.atmosphere) * (volume + self.volume)
