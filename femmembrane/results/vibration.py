"""Natural modes of an equilibrium."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Vibration:
    """One natural mode of an equilibrium.

    Attributes
    ----------
    eigenvalue : float
        lambda of K phi = lambda M phi, in units of mu/(rho_m R0^2) with rho_m the mass density.
    error : float
        Bound on the algebraic error of the eigenvalue.
    azimuthal : int
        Number of waves around the axis.
    control : str or None
        "pressure" or "volume", what is held during the motion; None for azimuthal modes, which do not change the volume.
    coefficients : ndarray
        Coefficients of the mode on the free degrees of freedom, normalised in the mass of the reference area. The largest is positive.
    """

    eigenvalue: float
    error: float
    azimuthal: int
    control: str | None
    coefficients: Array = field(repr=False)
    _shape: Callable[[Array], Mapping[str, Array]] = field(repr=False)

    @property
    def omega(self) -> float:
        """Angular frequency in units of sqrt(mu/(rho_m R0^2)); 0 in an unstable direction, in which the membrane departs."""
        return float(np.sqrt(max(self.eigenvalue, 0.0)))

    @property
    def growth_rate(self) -> float:
        """Rate of departure in the units of omega; 0 where the membrane oscillates."""
        return float(np.sqrt(max(-self.eigenvalue, 0.0)))

    @property
    def mode(self) -> Mapping[str, Array]:
        """The shape at the nodes: r (reference radius), u, w, and c around the axis for azimuthal modes.

        The displacement at the angle theta is (u cos(n theta), c sin(n theta), w cos(n theta)) in (e_rho, e_theta, e_z).
        """
        return self._shape(self.coefficients)
