"""Estimated errors of the numbers of an equilibrium."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from ..quantities import PLACES, words
from ..solve.controls import CONTROLS, control_kind
from . import door


@dataclass(frozen=True)
class Deviation:
    """A number and the estimate of its error.

    Attributes
    ----------
    value : float
        As computed.
    error : float
        Signed: the value minus the number on the finer space. It is 0 for what is held, and NaN where there is no estimate.
    scale : float
        Divisor of the relative error.
    """

    value: float
    error: float
    scale: float

    @property
    def absolute(self) -> float:
        """Size of the error."""
        return abs(self.error)

    @property
    def relative(self) -> float:
        """Size of the error over the scale: over the size of the value, or for the total energy over the sizes of its parts together."""
        if self.error == 0 or np.isnan(self.error):
            return self.error + 0.0
        return abs(self.error) / self.scale if self.scale else np.inf


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated discretisation errors of one equilibrium.

    Attributes
    ----------
    control : {"volume", "pressure", "center_height"}
        What is held while the space is refined: its own error is 0.
    pressure, volume, center_height, elastic_energy, magnetic_energy, load_energy, electric_energy, energy : Deviation
        ``energy`` is all of them together. Energies that the scene does not have are 0.
    lambda_pressure, lambda_volume : Deviation
        Smallest eigenvalues of the second variation under pressure and volume control.
    displacement : Deviation
        Root mean square over the reference area of the displacement, and of its error, over R0.
    stress_first, stress_last : Deviation
        Meridional Cauchy stress at the first end (the pole of a disc) and at the last (its rim), over mu.
    method : str
        What was compared.
    reason : str
        Why errors are NaN; empty when there is an estimate of all of them.
    """

    control: str
    pressure: Deviation
    volume: Deviation
    center_height: Deviation
    elastic_energy: Deviation
    magnetic_energy: Deviation
    load_energy: Deviation
    electric_energy: Deviation
    energy: Deviation
    lambda_pressure: Deviation
    lambda_volume: Deviation
    displacement: Deviation
    stress_first: Deviation
    stress_last: Deviation
    method: str
    reason: str = ""

    @property
    def shown(self) -> tuple[str, ...]:
        """The quantities that tables show: those of loads and of a voltage or charge where there is such an energy."""
        return tuple(name for name in ESTIMATED if name not in _PARTS[2:] or abs(getattr(self, name).value) > 0)

    def _repr_html_(self) -> str:
        """A table of values and errors, for notebooks."""
        return door.error_estimate_html(self)

    def __str__(self) -> str:
        lines = [f"at the same {CONTROLS[self.control].words}; {self.method}", f"{'':<16}{'value':>16}{'error':>12}{'relative':>12}"]
        for name in self.shown:
            d: Deviation = getattr(self, name)
            lines.append(f"{words(name):<16}{d.value:>16.9g}{d.error:>12.2e}{d.relative:>12.2e}")
        return "\n".join(lines + ([self.reason] if self.reason else []))


@dataclass(frozen=True)
class PlaceEstimate:
    """Estimated discretisation errors of the place of a special point.

    Attributes
    ----------
    pressure, volume, center_height : Deviation
    method : str
        What was compared.
    reason : str
        Why errors are NaN; empty when there is an estimate.
    """

    pressure: Deviation
    volume: Deviation
    center_height: Deviation
    method: str
    reason: str = ""

    def __str__(self) -> str:
        lines = [self.method, f"{'':<16}{'value':>16}{'error':>12}{'relative':>12}"]
        for name in PLACES:
            d: Deviation = getattr(self, name)
            lines.append(f"{words(name):<16}{d.value:>16.9g}{d.error:>12.2e}{d.relative:>12.2e}")
        return "\n".join(lines + ([self.reason] if self.reason else []))


def place_from_numbers(values: Mapping[str, float], better: Mapping[str, float] | None, method: str, reason: str) -> PlaceEstimate:
    """The record of values and of those of a finer space, by name; None: without an estimate."""
    errors = dict.fromkeys(values, np.nan) if better is None else {name: value - better[name] for name, value in values.items()}
    return PlaceEstimate(
        **{name: Deviation(values[name], errors[name], abs(values[name])) for name in PLACES}, method=method, reason=reason
    )


#: the parts of the energy
_PARTS = ("elastic_energy", "magnetic_energy", "load_energy", "electric_energy")
#: the quantities of an estimate, in its order
ESTIMATED = tuple(f.name for f in fields(ErrorEstimate) if f.type == "Deviation")


def from_numbers(control: str, values: Mapping[str, float], errors: Mapping[str, float], method: str, reason: str) -> ErrorEstimate:
    """The record of values and errors by name."""
    values, errors = ({name: numbers.get(name, np.nan) for name in ESTIMATED} for numbers in (values, errors))  # older files have fewer
    scales = {name: abs(value) for name, value in values.items()}
    scales["energy"] = float(np.nansum([scales[name] for name in _PARTS]))
    parts = {name: Deviation(values[name], errors[name], scales[name]) for name in ESTIMATED}
    return ErrorEstimate(control_kind(control).name, **parts, method=method, reason=reason)
