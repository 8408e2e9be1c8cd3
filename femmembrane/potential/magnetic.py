"""The energy of a magnetised sheet at a point, where it is more than that of a weak field: as a function of position and slopes.

The laws of :mod:`..physics.magnetisation` come with their derivatives. An energy that uses one is written as its Taylor series of second
order about the point, in symbols that are replaced after it was differentiated: exact, and nothing is differentiated through an iteration.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from ..physics.magnetics import Source, field_intensity, magnetic_field
from ..physics.magnetisation import Law, Magnetisation, langevin
from .nearby import Nearby


@dataclass
class _Symbols:
    """Symbols that stand for expressions until all is differentiated."""

    symbols: list[ca.SX] = field(default_factory=list)
    stand_for: list[ca.SX] = field(default_factory=list)

    def of(self, expression: Any) -> ca.SX:
        self.symbols.append(ca.SX.sym(f"known_{len(self.symbols)}"))
        self.stand_for.append(ca.SX(expression))
        return self.symbols[-1]

    def series(self, law: tuple[Any, Any, Any], argument: ca.SX) -> ca.SX:
        """A function of one argument by its value and first two derivatives."""
        value, slope, curvature = (self.of(part) for part in law)
        change = argument - self.of(argument)
        return value + change * (slope + curvature / 2 * change)

    def series_of_two(self, law: Law, tangential: ca.SX, normal: ca.SX) -> ca.SX:
        known = {name: self.of(part) for name, part in vars(law).items()}
        t, n = tangential - self.of(tangential), normal - self.of(normal)
        first = known["value"] + known["by_tangential"] * t + known["by_normal"] * n
        return first + known["by_tangential_twice"] / 2 * t**2 + known["by_both"] * t * n + known["by_normal_twice"] / 2 * n**2

    def replaced(self, expressions: Sequence[ca.SX]) -> list[ca.SX]:
        if not self.symbols:
            return list(expressions)
        found: list[ca.SX] = ca.substitute(list(expressions), self.symbols, self.stand_for)
        return found


def point_energy(
    magnetisation: Magnetisation,
    sources: Sequence[Source],
    position: tuple[ca.SX, ca.SX],
    slopes: tuple[ca.SX, ca.SX],
    rates: tuple[Any, Any],
    remanence: Any,
    local: ca.SX,
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Energy per reference area, in units of mu T where the thickness is 1, with gradient and Hessian.

    Parameters
    ----------
    position : (rho, eta)
    slopes : (rho_x, eta_x)
    rates : (dS/dx, R)
        Of the reference meridian.
    remanence : expression
        m_0 at the point; unused without.
    local : SX
        What is differentiated by.
    """
    h = magnetic_field(sources, *position)
    square = slopes[0] ** 2 + slopes[1] ** 2
    along, across = h[0] * slopes[0] + h[1] * slopes[1], h[1] * slopes[0] - h[0] * slopes[1]
    parts = _Parts(
        intensity=field_intensity(sources, *position),
        tangential=along**2 / square + h[2] ** 2,
        normal_squared=across**2 / square,
        normal=lambda: across / np.sqrt(square),
        carried=lambda: along / rates[0],
        rotated=lambda: along / np.sqrt(square),
        area=lambda: np.sqrt(square) / rates[0] * position[0] / rates[1],
    )
    known = _Symbols()
    density = _density(magnetisation, parts, remanence, known)
    second, first = ca.hessian(density, local)
    value, gradient, hessian = known.replaced([density, first, second])
    return value, gradient, hessian


@dataclass(frozen=True)
class _Parts:
    """What the energy is a function of; the last four only where they are asked for."""

    intensity: Any
    tangential: Any
    normal_squared: Any
    normal: Callable[[], Any]
    carried: Callable[[], Any]  # h.x_S = lambda_1 h_t
    rotated: Callable[[], Any]  # h.(R E_1)
    area: Callable[[], Any]  # lambda_1 lambda_2


def _density(m: Magnetisation, parts: _Parts, remanence: Any, known: _Symbols) -> ca.SX:
    if not m.normal:
        induced = _induced(m, parts, None, known)
        if m.remanence is None:
            return induced
        return induced - remanence * (parts.carried() if m.transport == "deformed" else parts.rotated())
    residual = remanence / parts.area() if m.transport == "deformed" else remanence
    induced = _induced(m, parts, residual, known) - residual * parts.normal()
    return induced + residual**2 / 2 if m.demagnetization else induced


def _induced(m: Magnetisation, parts: _Parts, residual: Any, known: _Symbols) -> ca.SX:
    """Energy of the induced magnetisation beside a remanence along the normal, or None."""
    chi = m.susceptibility
    if m.saturation is None and not m.demagnetization:
        return -0.5 * chi * parts.intensity
    if m.saturation is None:  # without a remanence there is no root for the normal part
        square = parts.normal_squared if residual is None else (parts.normal() - residual) ** 2
        return -0.5 * (chi * parts.tangential + chi / (1 + chi) * square)
    if not m.demagnetization:
        return known.series(langevin(parts.intensity, chi, m.saturation), parts.intensity)
    normal = parts.normal() - (0.0 if residual is None else residual)
    law = m.soft(parts.tangential, normal)
    return known.series_of_two(law, parts.tangential, normal)


#: perturbations of (x, x_S, x_2) at theta = 0: even ones (a, b, a', b', q), odd ones (c, c', e, f); see :mod:`..stability.second_variation`
N_EVEN, N_ODD = 5, 4


def wave_function(magnetisation: Magnetisation, sources: Sequence[Source]) -> ca.Function:
    """(rho, eta, rho', eta', R, m_0) -> second derivatives with respect to the even perturbations, then to the odd ones.

    The sheet is the surface x(S, theta) with x_S and x_2 = x_theta/R. At theta = 0 it is perturbed to ::

        x = (rho + a, c, eta + b),     x_S = (rho' + a', c', eta' + b'),     x_2 = (e, rho/R + q, f)

    An energy of the position and these two vectors is even under a reflection in the plane theta = 0, so that the two kinds do not mix. The
    upper triangles are listed row by row.
    """
    y, state = ca.SX.sym("y", N_EVEN + N_ODD), ca.SX.sym("state", 6)
    a, b, a_S, b_S, q, c, c_S, e, f = ca.vertsplit(y)
    rho, eta, rho_S, eta_S, R, remanence = ca.vertsplit(state)
    x, height = rho + a, eta + b
    radius = np.sqrt(x**2 + c**2)
    near = Nearby(sources, radius, height)
    h_r, h_z, h_theta = magnetic_field(near.sources, radius, height)
    h = ca.vertcat((h_r * x - h_theta * c) / radius, (h_r * c + h_theta * x) / radius, h_z)
    x1, x2 = ca.vertcat(rho_S + a_S, c_S, eta_S + b_S), ca.vertcat(e, rho / R + q, f)
    normal = ca.cross(x1, x2)
    square, across, tangential = ca.dot(normal, normal), ca.dot(h, normal), ca.cross(h, normal)
    parts = _Parts(
        intensity=ca.dot(h, h),
        tangential=ca.dot(tangential, tangential) / square,
        normal_squared=across**2 / square,
        normal=lambda: across / np.sqrt(square),
        carried=lambda: ca.dot(h, x1),
        rotated=lambda: ca.dot(h, _rotated(x1, x2, square)),
        area=lambda: np.sqrt(square),
    )
    known = _Symbols()
    density = _density(magnetisation, parts, remanence, known)
    second = near.placed(*known.replaced([ca.hessian(density, y)[0]]))[0]
    first, last = range(N_EVEN), range(N_EVEN, N_EVEN + N_ODD)
    rows = [second[i, j] for kind in (first, last) for i in kind for j in kind if i <= j]
    at_zero = ca.substitute([ca.vertcat(*rows)], [y], [ca.SX.zeros(N_EVEN + N_ODD)])[0]
    return ca.Function("waves", [state], [ca.densify(at_zero)], {"cse": True})


def _rotated(x1: ca.SX, x2: ca.SX, square: ca.SX) -> ca.SX:
    """R E_1 with R the rotation in F = R U, of a surface with the tangent vectors F E_1 and F E_2."""
    area = np.sqrt(square)
    C11, C12, C22 = ca.dot(x1, x1), ca.dot(x1, x2), ca.dot(x2, x2)
    return ((C22 + area) * x1 - C12 * x2) / (area * np.sqrt(C11 + C22 + 2 * area))
