"""Which short waves of any direction a sheet carries whose energy depends on its slope: the acoustic tensor of Legendre and Hadamard.

Waves with the direction m in the reference sheet and the amplitude z cost z.K(m) z, with K(m) the second derivatives of the density with
respect to the displacement gradient, twice multiplied by m. In the frame (t, theta, nu) of the deformed sheet and with M_i = m_i/lambda_i,
the strain energy alone has K_nunu = s_1 M_1^2 + s_2 M_2^2, and no coupling of nu to t and theta. A magnetic energy couples them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..potential import Array, Evaluation
from ..solve.wellposed import supporting
from .second_variation import LocalResponse, response_at_quadrature

#: directions of waves that are neither along the meridian nor around the axis
_OBLIQUE = np.linspace(0, np.pi / 2, 17)[1:-1]


def supporting_all(evaluation: Evaluation) -> Array:
    """The stresses that hold a sheet against short waves, shape (2, n_points), see :func:`~.solve.wellposed.supporting`; the second against
    all waves but those along the meridian.

    Where an energy depends on the slope, that is the least of what is left of K_nunu when the amplitudes in the sheet give way, over M_2^2.
    """
    stresses = supporting(evaluation)
    potential = evaluation.potential
    if not potential.tilts:
        return stresses
    response = response_at_quadrature(potential, np.asarray(evaluation.x, dtype=float).tobytes())
    thickness = potential.bulk / potential.space.area_weights
    space = potential.space
    l1 = np.hypot(response.rho_x, response.eta_x) / np.hypot(space.R_x, space.Z_x)
    stretches = l1, response.rho / space.R
    gradient = _gradient_moduli(response)
    hoop = _left(gradient, stretches, np.pi / 2)
    for angle in _OBLIQUE:  # where the meridian is not held, waves close to it tell nothing new
        left = _left(gradient, stretches, angle) / np.sin(angle) ** 2
        hoop = np.minimum(hoop, np.where(stresses[0].reshape(hoop.shape) > 0, left, hoop))
    return np.stack([stresses[0], (hoop / thickness).ravel()])


def elliptic_in_plane(evaluation: Evaluation) -> NDArray[np.bool_]:
    """Whether the sheet has stiffness in its plane against waves of every direction, where an energy depends on the slope."""
    space = evaluation.potential.space
    r = response_at_quadrature(evaluation.potential, np.asarray(evaluation.x, dtype=float).tobytes())
    moduli = _gradient_moduli(r)
    stretches = np.hypot(r.rho_x, r.eta_x) / np.hypot(space.R_x, space.Z_x), r.rho / space.R
    positive = np.ones(r.rho.shape, dtype=bool)
    for angle in (0.0, *_OBLIQUE, np.pi / 2):
        K = _acoustic(moduli, stretches, angle)
        positive &= (K[0, 0] > 0) & (K[0, 0] * K[1, 1] > K[0, 1] ** 2)
    return positive


def _gradient_moduli(r: LocalResponse) -> Array:
    """Second derivatives with respect to (g1t, g1th, g1nu, g2t, g2th, g2nu), shape (6, 6, ...)."""
    moduli = np.zeros((6, 6, *r.rho.shape))
    for i, j, value in (
        *((0, 0, r.W11), (0, 4, r.W12), (4, 0, r.W12), (4, 4, r.W22)),
        *((1, 1, r.A), (3, 3, r.A), (1, 3, r.B), (3, 1, r.B)),
        *((2, 2, r.N1), (5, 5, r.N2)),
    ):
        moduli[i, j] = value
    even, odd = r.sloped if r.sloped is not None else (np.zeros((5, 5, 1)), np.zeros((4, 4, 1)))
    t, z = r.t_rho, r.t_z
    one, zero = np.ones_like(t), np.zeros_like(t)
    # a' and b' from g1t and g1nu, q is g2th; c' is g1th, e and f from g2t and g2nu
    turn = np.array([[t, -z], [z, t]])
    to_even = np.zeros((3, 3, *t.shape))
    to_even[:2, :2], to_even[2, 2] = turn, one
    to_odd = np.zeros((3, 3, *t.shape))
    to_odd[0, 0], to_odd[1:, 1:] = one, turn
    for block, matrix, places in ((even[2:, 2:], to_even, (0, 2, 4)), (odd[1:, 1:], to_odd, (1, 3, 5))):
        added = np.einsum("ia...,ij...,jb...->ab...", matrix, block + zero, matrix)
        for k, row in enumerate(places):
            for m, column in enumerate(places):
                moduli[row, column] += added[k, m]
    return moduli


def _acoustic(moduli: Array, stretches: tuple[Array, Array], angle: float) -> Array:
    """K(m) at M = (cos, sin) of an angle, shape (3, 3, ...)."""
    m = np.array([np.cos(angle) * stretches[0], np.sin(angle) * stretches[1]])
    blocks = moduli.reshape(2, 3, 2, 3, *moduli.shape[2:])
    K: Array = np.einsum("a...,aibj...,b...->ij...", m, blocks, m)
    return K


def _left(moduli: Array, stretches: tuple[Array, Array], angle: float) -> Array:
    """What is left of K_nunu at M = (cos, sin) of an angle; negative too where the sheet is not elliptic in itself."""
    K = _acoustic(moduli, stretches, angle)
    determinant = K[0, 0] * K[1, 1] - K[0, 1] ** 2
    elliptic = (K[0, 0] > 0) & (determinant > 0)
    coupled = K[1, 1] * K[0, 2] ** 2 - 2 * K[0, 1] * K[0, 2] * K[1, 2] + K[0, 0] * K[1, 2] ** 2
    left: Array = np.where(elliptic, K[2, 2] - coupled / np.where(elliptic, determinant, 1.0), -np.abs(K[2, 2]))
    return left
