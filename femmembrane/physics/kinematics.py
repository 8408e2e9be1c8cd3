"""Stretches of an axisymmetric membrane.

The meridian is a curve s -> (R, Z), displaced by (u, w) to (rho, eta) = (R + u, Z + w). With any parameter s, and _s = d/ds::

    lambda_1 = |(rho_s, eta_s)| / |(R_s, Z_s)|        meridional
    lambda_2 = rho / R                                circumferential
    lambda_3 = 1 / (lambda_1 lambda_2)                thickness (where a material does not change its volume)

Everything is written in logarithmic strains e_i = log lambda_i (Hencky 1928), from displacements and through log1p. So strains far below
round-off of 1 keep their relative accuracy; a nearly flat membrane has strains of order V^2. Axisymmetric membranes: A. E. Green and
J. E. Adkins, Large Elastic Deformations (1960).
"""

from __future__ import annotations

from typing import Any

import numpy as np

#: a solver may try a state with points beyond the axis or on each other: its strains are infinite or NaN, and the solver steps back
_anywhere = np.errstate(divide="ignore", invalid="ignore", over="ignore")


@_anywhere
def hencky_strains(R: Any, R_s: Any, Z_s: Any, u: Any, u_s: Any, w_s: Any) -> tuple[Any, Any]:
    """Logarithmic strains (e_1, e_2), meridional and circumferential.

    Parameters
    ----------
    R, R_s, Z_s : reference radius and slopes of the reference meridian.
    u, u_s, w_s : radial displacement and slopes of the displacement.
    """
    return meridional_strain(R_s, Z_s, u_s, w_s), np.log1p(u / R)


@_anywhere
def meridional_strain(R_s: Any, Z_s: Any, u_s: Any, w_s: Any) -> Any:
    """e_1 = log lambda_1 from the slopes alone; defined at the pole, where u/R is not."""
    green = (2 * (R_s * u_s + Z_s * w_s) + u_s**2 + w_s**2) / (R_s**2 + Z_s**2)
    return np.log1p(green) / 2
