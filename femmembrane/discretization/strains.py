"""Strains of a state at any points of a meridian."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..physics.kinematics import meridional_strain
from .meridian import LEAST_LENGTH, Array
from .space import Space


@dataclass(frozen=True, eq=False, slots=True)
class Strained:
    """Points of a meridian in a state, all arrays of shape (n,).

    Attributes
    ----------
    R, Z : ndarray
        Reference positions.
    rho, eta : ndarray
        Deformed positions.
    reference, slopes : (ndarray, ndarray)
        (R_s, Z_s), and (u_s, w_s) as :meth:`.Space.recovered_slopes` has them.
    strains : (ndarray, ndarray)
        Hencky strains (e_1, e_2), on the axis their limits.
    """

    R: Array
    Z: Array
    rho: Array
    eta: Array
    reference: tuple[Array, Array]
    slopes: tuple[Array, Array]
    strains: tuple[Array, Array]


def strained_at(space: Space, x: Array, s: Array) -> Strained:
    """The points of a state at parameters s of the meridian."""
    u, own, w, _ = space.displacement(x, s)
    u_s, w_s = space.recovered_slopes(x, s)
    (R, Z), (R_s, Z_s) = space.mesh.position(s), space.mesh.tangent(s)
    pole = np.abs(R) <= LEAST_LENGTH * space.size  # there u/R is the limit u_s/R_s
    u_s = np.where(
        pole & (u_s / np.where(pole, R_s, 1.0) <= -1), own, u_s
    )  # a recovered slope overshoots where a few elements hold a drawn-out pole
    e1 = meridional_strain(R_s, Z_s, u_s, w_s)
    hoop = np.where(pole, u_s, u) / np.where(pole, R_s, R)
    e2 = np.log1p(np.where(hoop > -1, hoop, np.nan))  # on a coarse mesh the radius may be negative between quadrature points
    return Strained(R, Z, R + u, Z + w, (R_s, Z_s), (u_s, w_s), (e1, e2))
