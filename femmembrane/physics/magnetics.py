"""Magnetic sources on the axis and the energy of a weakly magnetisable membrane in their field.

Fields are in units of D/R0^3 with D^2 = mu R0^6/mu0, so that |h|^2 is in units of the shear modulus and a source of strength
M = mu0 D^2/(R0^6 mu) contributes sqrt(M) times its unit field. Several sources superpose as fields::

    energy density = - chi/2 |sum_i h_i|^2        per reference area, in units of mu T    (paper eqs. 28-29, 33)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any, Protocol

from ..errors import InputError
from .outline import Outline


class Source(Protocol):
    """A coaxial magnetic source: everything the rest of the code asks of it."""

    def field(self, rho: Any, eta: Any) -> tuple[Any, Any]:
        """Magnetic field (h_rho, h_z) at the deformed point (rho, eta), in units of sqrt(mu/mu0)."""

    def intensity(self, rho: Any, eta: Any) -> Any:
        """|h|^2 of this source alone: written out, it costs half of squaring the components."""

    def distance_squared(self, rho: Any, eta: Any) -> Any:
        """Squared distance from the source, where the field is singular."""

    def passed(self, before: float, after: float) -> bool:
        """Whether a point on the axis that moved between two heights went through the source."""


@dataclass(frozen=True)
class Dipole:
    """Point dipole on the axis with its moment along the axis.

    Parameters
    ----------
    strength : float
        M = mu0 D^2/(R0^6 mu) >= 0, with D = m/(4 pi) for a physical moment m (paper eq. 33).
    height : float
        Signed height over the plane of the rim, in units of R0; negative below.
    orientation : {1, -1}
        Sense of the moment; matters only beside another source.

    Raises
    ------
    InputError
        For a negative or non-finite strength, a non-finite height, or an orientation other than 1 and -1.
    """

    strength: float
    height: float
    orientation: int = 1

    def __post_init__(self) -> None:
        if not (is_number(self.strength) and self.strength >= 0):
            raise InputError("source.strength", self.strength, "a finite number >= 0 is allowed")
        if not is_number(self.height):
            raise InputError("source.height", self.height, "a finite number is allowed (in units of R0; negative is below)")
        if isinstance(self.orientation, bool) or self.orientation not in (1, -1):
            raise InputError("source.orientation", self.orientation, "1 or -1 is allowed")

    def field(self, rho: Any, eta: Any) -> tuple[Any, Any]:
        z = eta - self.height
        inverse = 1 / (rho**2 + z**2)
        amplitude = self.orientation * math.sqrt(self.strength) * inverse**2 * inverse**0.5
        return 3 * z * rho * amplitude, (2 * z**2 - rho**2) * amplitude

    def intensity(self, rho: Any, eta: Any) -> Any:
        """M (rho^2 + 4 z^2)/(rho^2 + z^2)^4 with z = eta - height (paper eq. 33)."""
        z2 = (eta - self.height) ** 2
        square = rho**2 + z2
        return self.strength * (square + 3 * z2) / (square**2) ** 2

    def distance_squared(self, rho: Any, eta: Any) -> Any:
        """Squared distance from the source, where the field is singular."""
        return rho**2 + (eta - self.height) ** 2

    def passed(self, before: float, after: float) -> bool:
        return (before - self.height) * (after - self.height) <= 0

    def outline(self) -> Outline:
        """A point with an arrow along its moment."""
        return Outline(f"dipole at height {self.height:g}", ((0.0, self.height),), self.orientation)


def magnetic_field(sources: Sequence[Source], rho: Any, eta: Any) -> tuple[Any, Any]:
    """Sum (h_rho, h_z) of the fields of all sources at (rho, eta)."""
    fields = [source.field(rho, eta) for source in sources]
    return sum(f[0] for f in fields), sum(f[1] for f in fields)


def magnetic_energy_density(sources: Sequence[Source], susceptibility: float, rho: Any, eta: Any) -> Any:
    """-chi/2 |h|^2 per reference area, in units of mu T."""
    if len(sources) == 1:
        return -susceptibility / 2 * sources[0].intensity(rho, eta)
    h_rho, h_z = magnetic_field(sources, rho, eta)
    return -susceptibility / 2 * (h_rho**2 + h_z**2)


def is_number(value: object) -> bool:
    """Whether a value is a finite number, NumPy's included; truth values are none."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(float(value))
    except OverflowError:  # a whole number that no float can hold
        return False
