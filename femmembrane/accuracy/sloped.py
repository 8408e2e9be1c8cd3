"""A magnetic energy D that depends on the slope, for the strong form: as a function of the position and of the angle phi of the meridian.

It turns the tension of the meridian out of its direction. With Q = D_phi/lambda_1 across it, and gradients at fixed phi, the balance is ::

    (r W_1)' - r Q phi' = W_2 cos phi + r m_t,           r W_1 phi' + (r Q)' = -W_2 sin phi + r m_n - P rho lambda_1

so that e_1' and phi' follow from two linear equations. With h_t = h.t and h_n = h.nu one has dh_t/dphi = h_n and dh_n/dphi = -h_t.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..physics.along import Along
from ..physics.magnetics import Source, magnetic_field
from ..physics.magnetisation import Law, Magnetisation

Array = NDArray[np.float64]

#: imaginary step of the derivatives of the field
_STEP = 1e-30


@dataclass(frozen=True)
class Pull:
    """D and its derivatives at points: ``turning`` is D_phi, ``stiffness`` D_phiphi, ``along`` the change of D_phi along the meridian."""

    value: Array
    rho: Array
    eta: Array
    turning: Array
    stiffness: Array
    along: Array


def is_strong(magnetisation: Magnetisation) -> bool:
    """Whether the strong form has this energy: one that stretches do not change, and smooth at h_t = 0."""
    if magnetisation.remanence is None:
        return True
    return magnetisation.normal and magnetisation.transport == "rotated" and not isinstance(magnetisation.remanence, Along)


def pull(magnetisation: Magnetisation, sources: Sequence[Source], rho: Any, eta: Any, cos: Any, sin: Any) -> Pull:
    """The energy at points of the meridian with the directions (cos phi, sin phi)."""
    rho, eta = np.asarray(rho, dtype=float), np.asarray(eta, dtype=float)
    h = np.array([np.broadcast_to(part, rho.shape) for part in magnetic_field(sources, rho, eta)])
    by_rho, by_eta = (_changes(sources, *place) for place in ((rho + 1j * _STEP, eta + 0j), (rho + 0j, eta + 1j * _STEP)))
    t, n = (cos, sin), (-sin, cos)

    def part(of: Array, direction: tuple[Any, Any]) -> Array:
        found: Array = of[0] * direction[0] + of[1] * direction[1]
        return found

    h_t, h_n = part(h, t), part(h, n)
    law = _law(magnetisation, h_t**2 + h[2] ** 2, h_n)
    t_turn, n_turn = 2 * h_t * h_n, -h_t
    gradient, turned = [], []
    for change in (by_rho, by_eta):
        along, across = part(change, t), part(change, n)
        of_t = 2 * (h_t * along + h[2] * change[2])
        gradient.append(law.by_tangential * of_t + law.by_normal * across)
        turned.append(
            (law.by_tangential_twice * of_t + law.by_both * across) * t_turn
            + (law.by_both * of_t + law.by_normal_twice * across) * n_turn
            + law.by_tangential * 2 * (along * h_n + h_t * across)
            - law.by_normal * along
        )
    stiffness = (
        law.by_tangential_twice * t_turn**2
        + 2 * law.by_both * t_turn * n_turn
        + law.by_normal_twice * n_turn**2
        + law.by_tangential * 2 * (h_n**2 - h_t**2)
        - law.by_normal * h_n
    )
    turning = law.by_tangential * t_turn + law.by_normal * n_turn
    return Pull(law.value, gradient[0], gradient[1], turning, stiffness, turned[0] * cos + turned[1] * sin)


def _changes(sources: Sequence[Source], rho: Any, eta: Any) -> Array:
    return np.array([np.broadcast_to(np.imag(part) / _STEP, np.shape(rho)) for part in magnetic_field(sources, rho, eta)])


def _law(magnetisation: Magnetisation, tangential: Any, normal: Any) -> Law:
    residual = magnetisation.remanence or 0.0
    screened = residual if magnetisation.demagnetization else 0.0
    law = magnetisation.soft(tangential, normal - screened)
    value = law.value - residual * normal + screened**2 / 2
    return Law(value, law.by_tangential, law.by_normal - residual, law.by_tangential_twice, law.by_both, law.by_normal_twice)
