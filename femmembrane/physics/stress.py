"""Principal Cauchy stresses of the membrane, in units of the shear modulus (Saxena et al. 2019, eqs. 46-56).

The mechanical stresses lambda_i W_i are what the strain energy feels. The total stresses contain the inflating pressure through the
thickness and the stresses of Maxwell and of magnetisation as well::

    s_11 = lambda_1 W_1 - P T/R0 + chi (h_t^2 - h_n^2) + (h_t^2 - h_n^2 - h_theta^2)/2
    s_22 = lambda_2 W_2 - P T/R0 + chi (h_theta^2 - h_n^2) + (h_theta^2 - h_t^2 - h_n^2)/2

Here (h_t, h_n, h_theta) are the components of the field of all sources together: along the meridian, along the normal and around the axis.
The magnetic terms are the diagonal of chi (h x h - h_n^2 1) + h x h - |h|^2/2 1; the paper has the case h_theta = 0. Where h_t h_theta is
not 0 there is a magnetic shear (chi + 1) h_t h_theta as well, and the two stresses are not principal.

**Beyond the weak field** (:mod:`.magnetisation`) let m be the magnetisation, H = h and B = h + m; with self-field instead H_n = h_n - m_n
and B_n = h_n. Across the faces of a thin sheet the tangential H, the normal B and the traction are continuous. So the Maxwell stress of the
field outside acts through the thickness. With d_i = lambda_i dD/dlambda_i at fixed field and rotation (of a remanence that is deformed) ::

    s_nn = -P T/R0 + (h_n^2 - h_t^2 - h_theta^2)/2
    s_11 = lambda_1 W_1 + d_1 + s_nn + B_t H_t - B_n H_n,       s_22 = lambda_2 W_2 + d_2 + s_nn + B_theta H_theta - B_n H_n

Without self-field and remanence these are the lines above. In a normal field a soft sheet with self-field has h_n m_n *more* than the air
beside it, the Lorentz pull of the currents at its edge. Without self-field it has chi h_n^2 *less*. The two differ in the first order of
chi: in a weak field the normal flux density is not taken for continuous.
"""

from __future__ import annotations

from typing import Any

from .magnetisation import Magnetisation


def total_stress(
    mechanical: tuple[Any, Any],
    pressure: Any,
    radius_to_thickness: float,
    field: tuple[Any, Any, Any],
    tangent: tuple[Any, Any],
    susceptibility: float,
) -> tuple[Any, Any]:
    """Total principal stresses (s_11, s_22).

    Parameters
    ----------
    mechanical : (lambda_1 W_1, lambda_2 W_2)
    pressure : P = p R0/(mu T) at the point
    radius_to_thickness : R0/T
    field : (h_rho, h_z, h_theta) in units of sqrt(mu/mu0), strengths included
    tangent : unit tangent (t_rho, t_z) of the deformed meridian
    susceptibility : chi
    """
    h_t = field[0] * tangent[0] + field[1] * tangent[1]
    h_n = field[1] * tangent[0] - field[0] * tangent[1]
    through = pressure / radius_to_thickness
    around = field[2] ** 2
    s11 = mechanical[0] - through + (susceptibility + 0.5) * (h_t**2 - h_n**2) - around / 2
    s22 = mechanical[1] - through - (h_t**2 + h_n**2) / 2 - susceptibility * h_n**2 + (susceptibility + 0.5) * around
    return s11, s22


def magnetised_stress(
    mechanical: tuple[Any, Any],
    pressure: Any,
    radius_to_thickness: float,
    field: tuple[Any, Any, Any],
    tangent: tuple[Any, Any],
    stretches: tuple[Any, Any],
    magnetisation: Magnetisation,
    remanence: Any,
) -> tuple[Any, Any]:
    """Total principal stresses (s_11, s_22) beyond the weak field.

    Parameters
    ----------
    mechanical, pressure, radius_to_thickness, field, tangent : as in :func:`total_stress`
    stretches : (lambda_1, lambda_2)
    magnetisation : Magnetisation
    remanence : ndarray
        m_0 at the points.
    """
    h_t = field[0] * tangent[0] + field[1] * tangent[1]
    h_n = field[1] * tangent[0] - field[0] * tangent[1]
    around = field[2]
    m_t, m_theta, m_n, H_n, d1, d2 = magnetisation.moments(h_t, h_n, around, stretches, remanence)
    through = (h_n**2 - h_t**2 - around**2) / 2 - (H_n + m_n) * H_n - pressure / radius_to_thickness
    return mechanical[0] + d1 + through + (h_t + m_t) * h_t, mechanical[1] + d2 + through + (around + m_theta) * around
