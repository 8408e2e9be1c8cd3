"""Distances between states on different meshes, and the round-off of what is compared."""

from __future__ import annotations

import numpy as np

from ..discretization.space import Space
from ..potential import Array

#: round-off of an eigenvalue, whose matrices have large entries that cancel; recorded on 2026-11-24: up to 3e-13 with 64 elements of degree
#: 4
EIGENVALUE_ROUND_OFF = 256 * np.finfo(float).eps


#: quadrature points in each piece common to two meshes: exact for products of degree 8
_POINTS = 10


def profile_norms(space: Space, x: Array, other: Space | None = None, y: Array | None = None) -> tuple[float, float]:
    """L2 and H1 norms over the reference area of (rho, eta), or of the difference to another state on another mesh of the same meridian.

    Integrated piece by piece between the element ends of both meshes, where the difference is a polynomial.
    """
    ends = space.ends if other is None else np.union1d(space.ends, other.ends)
    points, weights = np.polynomial.legendre.leggauss(_POINTS)
    size = np.diff(ends)
    s = (ends[:-1, None] + size[:, None] * (points + 1) / 2).ravel()
    (R, Z), (R_s, Z_s) = space.mesh.position(s), space.mesh.tangent(s)
    if other is None or y is None:
        u, u_s, w, w_s = space.displacement(x, s)
        u, w, u_s, w_s = u + R, w + Z, u_s + R_s, w_s + Z_s
    else:
        u, u_s, w, w_s = (a - b for a, b in zip(space.evaluate(x, s), other.evaluate(y, s), strict=True))
    slope = np.hypot(R_s, Z_s)
    area = 2 * np.pi * R * slope * (size[:, None] * weights / 2).ravel()
    plain, derivative = float(area @ (u**2 + w**2)), float(area @ ((u_s**2 + w_s**2) / slope**2))
    return float(np.sqrt(plain)), float(np.sqrt(plain + derivative))
