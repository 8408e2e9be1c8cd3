"""Where a field takes the stiffness of a sheet in its plane: the other half of the Legendre-Hadamard condition.

Without field an energy that obeys the inequalities asked of materials has it wherever the sheet is in tension. A voltage subtracts from the
moduli as well. With D_ij the second derivatives of the effective energy in the stretches, A and B its shear moduli
(:mod:`..stability.second_variation`), the acoustic tensor in the plane is positive for every direction where ::

    D_11 > 0,   D_22 > 0,   A > 0,   sqrt(D_11 D_22) + A > |D_12 + B|

(J. K. Knowles and E. Sternberg, J. Elasticity 8, 1978). Axisymmetric shapes ask for the first alone; in a tension field it is that of the
relaxed energy, which ends before a natural width does. Neo-Hookean sheets always lose their tension first.
"""

from __future__ import annotations

import numpy as np

from ..physics.kinematics import hencky_strains
from ..potential import Array, Evaluation, Potential


def pulled_in(potential: Potential, evaluation: Evaluation) -> Array:
    """Reference radii of the quadrature points at which no stiffness is left along the meridian; none without a voltage."""
    electric = potential.electric
    if electric is None or electric.frozen_charge is not None or _judged_together(potential):
        return np.zeros(0)
    least = evaluation.once("least stiffness", _least)
    return np.zeros(0) if least > 0 else potential.space.R[_moduli(evaluation)[0] <= 0]


def shears_in(potential: Potential, evaluation: Evaluation) -> Array:
    """Reference radii at which waves around the axis meet no stiffness in the plane; none without a voltage, and where a stress is
    compressive or equal strains leave nothing to divide by.
    """
    electric = potential.electric
    if electric is None or electric.frozen_charge is not None or potential.scene.tension_field or _judged_together(potential):
        return np.zeros(0)
    d11, d22, mixed, shear = _moduli(evaluation)
    with np.errstate(invalid="ignore"):
        lost = ~((d11 > 0) & (d22 > 0) & (np.sqrt(np.abs(d11 * d22)) + shear > np.abs(mixed)))
    return potential.space.R[lost]


def _judged_together(potential: Potential) -> bool:
    """Whether a magnetic energy that depends on the slope has a say: then :func:`.wellposed.supporting` asks for all moduli at once. What a
    tension field allows of such energies is linear in the slopes, and leaves the moduli as they are.
    """
    return potential.tilts and not potential.scene.tension_field


def _least(evaluation: Evaluation) -> float:
    return float(_moduli(evaluation)[0].min())


def _moduli(evaluation: Evaluation) -> tuple[Array, Array, Array, Array]:
    """:func:`moduli` at the quadrature points."""
    potential, space = evaluation.potential, evaluation.potential.space
    u, u_x, _, w_x = space.displacement_at_quadrature(evaluation.x)
    e1, e2 = hencky_strains(space.R, space.R_x, space.Z_x, u, u_x, w_x)
    square = potential.local_square(evaluation.x, space.R, space.Z, space.s, evaluation.factor)
    return moduli(potential, e1, e2, square)


def moduli(potential: Potential, e1: Array, e2: Array, square: Array | None) -> tuple[Array, Array, Array, Array]:
    """l1^2 D_11, l2^2 D_22, l1 l2 (D_12 + B) and l1 l2 A at strains."""
    s1, s2, d11, d12, d22 = potential.response(e1, e2, square).reshape(5, *e1.shape)
    d = e1 - e2
    close = np.abs(d) < 1e-3
    # at equal stretches the quotient of differences is a derivative
    quotient = np.where(close, (d11 - 2 * d12 + d22) / 2, (s1 - s2) / np.where(close, 1.0, d))
    shear = quotient * np.where(close, 1.0, d / np.sinh(np.where(close, 1.0, d))) / 2
    return d11 - s1, d22 - s2, d12 + np.cosh(d) * shear - (s1 + s2) / 2, shear
