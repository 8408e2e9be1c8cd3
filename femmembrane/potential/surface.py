"""The potential of a surface that is no longer one of revolution, as a Taylor series about one that is.

A point of the surface lies at x = (rho + a, c, eta + b) in the directions (e_r, e_theta, e_z) of its material angle. With x the parameter
along a reference element and A = dx/dx, B = dx/dtheta its tangents in the same directions ::

    C_11 = A.A/J^2,    C_12 = A.B/(J R),    C_22 = B.B/R^2,    J = |(R_x, Z_x)|
    L = t J R [W(e_1, e_2) + m(r, z)] + (g(z) - P z) (A x B)_z,      r^2 = (rho + a)^2 + c^2

with the logarithms e_1, e_2 of the principal stretches. An isotropic W is an analytic function of two numbers, also where e_1 = e_2::

    h = (e_1 + e_2)/2 = log(det C)/4,        y = sinh^2(e_1 - e_2) = ((C_11 - C_22)^2 + 4 C_12^2)/(4 det C)

About a surface of revolution W and m enter by their Taylor coefficients alone, which do not depend on theta. So one expression serves every
scene, and derivatives of the fourth order along a direction are exact.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from ..kernels.interface import Array
from ..physics.kinematics import hencky_strains
from ..physics.loads import over_projection, over_reference
from ..physics.magnetics import Source
from ..physics.magnetisation import position_energy_density
from ..physics.response import response_of
from ..threads import cached_property
from .expressions import BUILDING, casadi_answers_numpy
from .replay import at_points

if TYPE_CHECKING:
    from .potential import Potential

#: order of the series
ORDER = 4
#: difference of the logarithmic strains below which W is interpolated in y, at so many places: with the nearest singularity at y = -1 the
#: error of the interpolant is that of round-off
_CLOSE, _PLACES = 0.2, 8
#: operations of the second derivatives of a field from which on more derivatives are differences
_LONG = 500
#: distance between places for differences, over that from the sources, and weights of the places from -3 to 3
_STEP = 0.01
_FIRST = (-1 / 60, 3 / 20, -3 / 4, 0.0, 3 / 4, -3 / 20, 1 / 60)
_SECOND = (1 / 90, -3 / 20, 3 / 2, -49 / 18, 3 / 2, -3 / 20, 1 / 90)
#: exponents of the Taylor coefficients of a function of two numbers
EXPONENTS = tuple((i, k - i) for k in range(ORDER + 1) for i in range(k, -1, -1))
#: local variables: the position, A and B, each in (e_r, e_theta, e_z)
N_LOCAL = 9
_DATA = ("R", "J", "area", "inside", "pressure")


def refusal(potential: Potential) -> str:
    """Why the states beyond an onset of a scene are not computed; empty where they are."""
    scene = potential.scene
    if scene.tension_field:
        return "the relaxed energy has no third derivatives on the borders of wrinkled zones"
    if potential.tilts:
        return "the magnetic energy depends on the slope of the membrane, and its derivatives beyond the second are not known"
    if potential.charged is not None:
        return "a total charge couples all points of the membrane"
    if potential.space.lids and potential.space.spreads:
        return "the lid across an end that moves in its plane does not stay flat"
    if getattr(scene, "bending", False):
        return "the stiffness of bending is known to second order only"
    if getattr(scene, "bodies", ()):
        return "the membrane may touch an obstacle"
    return ""


class SurfaceSeries:
    """Taylor series of a potential about one axisymmetric state, at its quadrature points.

    Parameters
    ----------
    potential : Potential
        Of a scene whose magnetic energy does not depend on the slope, and without a tension field.
    x : ndarray, shape (n_free,)
    pressure : float
    """

    def __init__(self, potential: Potential, x: Array, pressure: float) -> None:
        space = potential.space
        self.space = space
        u, u_x, w, w_x = space.displacement_at_quadrature(x)
        J = np.hypot(space.R_x, space.Z_x)
        thickness, modulus = (1.0, 1.0) if potential.sheet is None else potential.sheet.factors(space.R, space.Z, space.s)
        area = space.weights * space.R * J * thickness
        strains = hencky_strains(space.R, space.R_x, space.Z_x, u, u_x, w_x)
        square = potential.local_square(x, space.R, space.Z, space.s)
        response = expansions(potential).response(*strains, square) * modulus
        rho, eta = space.R + u, space.Z + w
        position, projected = expansions(potential).position(rho, eta)
        shape = space.R.shape
        columns = (space.R, J, area, space.weights * space.side, np.full(shape, pressure))
        self._data = np.concatenate([np.stack(columns), response, position, projected]).reshape(-1, space.R.size)
        zero = np.zeros(shape)
        self._state = np.stack([rho, zero, eta, space.R_x + u_x, zero, space.Z_x + w_x, zero, rho, zero]).reshape(N_LOCAL, -1)

    def along(self, direction: Array) -> tuple[Array, Array, Array]:
        """Derivatives along a direction at the points of k meridians.

        Parameters
        ----------
        direction : ndarray, shape (9, k, n_quadrature, n_elements)
            Of the local variables.

        Returns
        -------
        fourth : ndarray, shape (k, n_quadrature, n_elements)
            d^4 L/dt^4, weights included.
        third : ndarray, shape (9, k, n_quadrature, n_elements)
            d^2/dt^2 of the gradient of L.
        volume : ndarray, shape (k, n_quadrature, n_elements)
            d^2/dt^2 of the density of the volume.
        """
        shape = direction.shape[1:]
        k = shape[0]
        data, state = (np.tile(part, (1, k)) for part in (self._data, self._state))
        found = at_points(derivatives_along(), *data, *state, *direction.reshape(N_LOCAL, -1))
        return found[0].reshape(shape), found[2:].reshape(N_LOCAL, *shape), found[1].reshape(shape)


class Expansions:
    """Taylor coefficients of the response of a membrane, and of its energy of position, as functions of the state at a point."""

    def __init__(self, potential: Potential) -> None:
        self._potential = potential

    def response(self, e1: Array, e2: Array, square: Array | None) -> Array:
        """Coefficients of W in (h, y) by :data:`EXPONENTS`, per thickness and in units of the modulus, shape (15, ...)."""
        difference = e1 - e2
        h, y, close = (e1 + e2) / 2, np.sinh(difference) ** 2, np.abs(difference) < _CLOSE
        found = np.empty((len(EXPONENTS), *e1.shape))
        more = [] if square is None else [square]
        if not close.all():
            found[:, ~close] = at_points(self._apart, *(part[~close] for part in (h, y, *more)))
        if close.any():
            places, weights = _interpolation(y[close])
            apart = np.arcsinh(np.sqrt(places))
            repeated = (np.repeat(part[close], _PLACES) for part in (h, *more))
            first, *others = repeated
            rows = at_points(self._along_mean, first, np.tile(apart, int(close.sum())), *others).reshape(ORDER + 1, -1, _PLACES)
            found[:, close] = [np.einsum("pk,pk->p", rows[i], weights[j]) for i, j in EXPONENTS]
        return found

    def position(self, rho: Array, eta: Array) -> tuple[Array, Array]:
        """Coefficients of m in (r, z) by :data:`EXPONENTS`, and of g in z, shapes (15, ...) and (5, ...)."""
        found = at_points(self._position, rho, eta).reshape(-1, *rho.shape)
        position, projected = found[: len(EXPONENTS)], found[len(EXPONENTS) :]
        if self._long:
            position = self._from_second_derivatives(rho, eta)
        return position, projected

    @property
    def _long(self) -> bool:
        """Whether formulas of the fourth derivatives would be too long, or a source has its derivatives written out up to the second."""
        sources = self._potential.sources
        return any(type(source).jet is not Source.jet for source in sources) or bool(sources and self._potential.field_operations > _LONG)

    def _from_second_derivatives(self, rho: Array, eta: Array) -> Array:
        """The coefficients of m with differences of its exact second derivatives, of the sixth order in a part of the distance to the
        sources; m is even in the radius."""
        potential = self._potential
        away = [source.singular_squared(rho, eta) for source in potential.sources]
        step = _STEP * np.minimum(np.sqrt(np.min(away, axis=0)), potential.space.size)
        at = {}
        for k in range(-3, 4):
            for i, j in ((k, 0), (0, k)):
                r = rho + i * step
                found = potential.field_energy(np.abs(r), eta + j * step).reshape(6, *rho.shape)
                at[i, j] = (found, found[3], np.sign(r) * found[4], found[5])

        def differences(part: int, along: int) -> tuple[Array, Array]:
            """First and second derivative of a second derivative (rr, rz or zz) along r or z."""
            f = [at[(k, 0) if along == 0 else (0, k)][part] for k in range(-3, 4)]
            first = sum(c * v for c, v in zip(_FIRST, f, strict=True)) / step
            second = sum(c * v for c, v in zip(_SECOND, f, strict=True)) / step**2
            return np.asarray(first), np.asarray(second)

        here = at[0, 0][0]
        known = {(0, 0): here[0], (1, 0): here[1], (0, 1): here[2], (2, 0): here[3] / 2, (1, 1): here[4], (0, 2): here[5] / 2}
        (rrr, rrrr), (rrz, rrzz) = differences(1, 0), differences(1, 1)
        (rzz, _), (zzz, zzzz) = differences(3, 0), differences(3, 1)
        rrrz, rzzz = differences(2, 0)[1], differences(2, 1)[1]
        known |= {(3, 0): rrr / 6, (2, 1): rrz / 2, (1, 2): rzz / 2, (0, 3): zzz / 6}
        known |= {(4, 0): rrrr / 24, (3, 1): rrrz / 6, (2, 2): rrzz / 4, (1, 3): rzzz / 6, (0, 4): zzzz / 24}
        return np.stack([known[pair] for pair in EXPONENTS])

    @cached_property
    def _apart(self) -> ca.Function:
        """(h, y) -> the coefficients, where the stretches differ."""

        def rows(z: ca.SX, energy: Callable[[Any, Any], Any]) -> list[ca.SX]:
            D = np.arcsinh(np.sqrt(z[1]))
            return taylor(energy(z[0] + D / 2, z[0] - D / 2), z[0], z[1])

        return self._response_in(rows)

    @cached_property
    def _along_mean(self) -> ca.Function:
        """(h, e_1 - e_2) -> the coefficients in h alone."""

        def rows(z: ca.SX, energy: Callable[[Any, Any], Any]) -> list[ca.SX]:
            found = [energy(z[0] + z[1] / 2, z[0] - z[1] / 2)]
            for k in range(ORDER):
                found.append(ca.gradient(found[-1], z)[0] / (k + 1))
            return found

        return self._response_in(rows)

    @BUILDING
    def _response_in(self, rows: Callable[[ca.SX, Callable[[Any, Any], Any]], list[ca.SX]]) -> ca.Function:
        scene = self._potential.scene
        z = ca.SX.sym("z", 2 if self._potential.electric is None else 3)
        with casadi_answers_numpy():
            response: Any = response_of(scene, None if self._potential.electric is None else z[2])

            def energy(e1: Any, e2: Any) -> Any:
                return response.energy(e1, e2) + (0.0 if scene.electricity is None else response.electric_energy(e1, e2))

            return _rows([z], rows(z, energy))

    @cached_property
    @BUILDING
    def _position(self) -> ca.Function:
        potential, y = self._potential, ca.SX.sym("y", 2)
        with casadi_answers_numpy():
            density = over_reference(potential.loads, y[0], y[1]) + ca.SX(0)
            if potential.sources and not self._long:
                scene = potential.scene
                density += position_energy_density(potential.sources, scene.susceptibility or 0.0, scene.saturation, y[0], y[1])
            rows = taylor(density, y[0], y[1])
            g, factor = ca.SX(over_projection(potential.loads, y[1])[0]), 1.0
            for k in range(ORDER + 1):
                rows.append(g / factor)
                g, factor = ca.gradient(g, y)[1], factor * (k + 1)
        return _rows([y], rows)


@lru_cache(maxsize=8)
def expansions(potential: Potential) -> Expansions:
    """Of a potential, remembered."""
    return Expansions(potential)


def _interpolation(y: Array) -> tuple[Array, Array]:
    """Chebyshev's places of y between 0 and sinh^2 of :data:`_CLOSE`, and the weights with which values there make Taylor coefficients.

    Shapes (n,) and (5, points, n).
    """
    half = np.sinh(_CLOSE) ** 2 / 2
    nodes = np.cos(np.pi * (np.arange(_PLACES) + 0.5) / _PLACES)
    inverse = np.linalg.inv(np.polynomial.chebyshev.chebvander(nodes, _PLACES - 1))
    t, weights, scale = y / half - 1, [], 1.0
    for k in range(ORDER + 1):
        derived = np.polynomial.chebyshev.chebder(np.eye(_PLACES), k)
        weights.append(np.polynomial.chebyshev.chebval(t, derived).T @ inverse / scale)
        scale *= (k + 1) * half
    return half * (1 + nodes), np.stack(weights)


def taylor(function: ca.SX, first: ca.SX, second: ca.SX) -> list[ca.SX]:
    """Taylor coefficients of a function of two symbols in the order of :data:`EXPONENTS`."""
    both = ca.vertcat(first, second)
    known = {(0, 0): function}
    for i, j in EXPONENTS[1:]:
        before = (i - 1, j) if i else (i, j - 1)
        known[i, j] = ca.gradient(known[before], both)[0 if i else 1] / (i or j)
    return [known[pair] for pair in EXPONENTS]


def _polynomial(coefficients: list[ca.SX], first: ca.SX, second: ca.SX) -> ca.SX:
    total = ca.SX(0)
    for c, (i, j) in zip(coefficients, EXPONENTS, strict=True):
        total += c * first**i * second**j
    return total


def _rows(symbols: list[ca.SX], rows: list[ca.SX]) -> ca.Function:
    return ca.Function("rows", symbols, [ca.densify(ca.vertcat(*rows))], {"cse": True})


@lru_cache(maxsize=1)
@BUILDING
def derivatives_along() -> ca.Function:
    """(data, state, direction) -> d^4 L, d^2 of the density of the volume, d^2 of the gradient of L, all along the direction."""
    n, k = len(_DATA), len(EXPONENTS)
    size = n + 2 * k + ORDER + 1
    z = ca.SX.sym("z", size + 2 * N_LOCAL)
    data, state, direction = z[:size], z[size : size + N_LOCAL], z[size + N_LOCAL :]
    R, J, area, inside, pressure = (data[i] for i in range(n))
    of_strain, of_place = ([data[i] for i in range(start, start + k)] for start in (n, n + k))
    projected = [data[i] for i in range(n + 2 * k, size)]
    y = ca.SX.sym("y", N_LOCAL)
    h, square = invariants(y, R, J)
    h0, square0 = (ca.substitute(part, y, state) for part in (h, square))
    r, r0 = ca.sqrt(y[0] ** 2 + y[1] ** 2), state[0]
    volume = inside * y[2] * (y[3] * y[7] - y[4] * y[6])
    height = y[2] - state[2]
    g = sum((c * height**i for i, c in enumerate(projected)), ca.SX(0))
    L = area * (_polynomial(of_strain, h - h0, square - square0) + _polynomial(of_place, r - r0, height))
    L += inside * g * (y[3] * y[7] - y[4] * y[6]) - pressure * volume

    def along(function: ca.SX, times: int) -> ca.SX:
        for _ in range(times):
            function = ca.jtimes(function, y, direction)
        return function

    rows = [along(L, 4), along(volume, 2), along(ca.gradient(L, y), 2)]
    return _rows([z], ca.substitute(rows, [y], [state]))


def invariants(y: ca.SX, R: ca.SX, J: ca.SX) -> tuple[ca.SX, ca.SX]:
    """h and y of the local variables."""
    A, B = y[3:6] / J, y[6:9] / R
    C11, C12, C22 = ca.dot(A, A), ca.dot(A, B), ca.dot(B, B)
    determinant = C11 * C22 - C12**2
    return ca.log(determinant) / 4, ((C11 - C22) ** 2 + 4 * C12**2) / (4 * determinant)
