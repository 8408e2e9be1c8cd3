"""The paper's tests of Legendre and Jacobi, as printed and corrected: a cross-check of the verdicts, by ordinary differential equations.

Let F(y, y', r) be the integrand of the energy minus P times the volume of a disc, with y = (rho, eta) and ' = d/dr. A state is a minimum
under pressure control among axisymmetric perturbations if two conditions hold: F_y'y' is positive definite (Legendre, paper eq. 40), and no
point of (0, 1] is conjugate to the pole (Jacobi, paper eqs. 42-45). At a conjugate point det U = 0. The columns of U are the perturbations
that satisfy the equation of the second variation and the conditions at the pole. Both forms are integrated with a momentum V, so that no
coefficient has to be differentiated::

    F_y'y' U' + H U = V,        V' = F_yy' U' + F_yy U

==========  ===================  =====================================================
form        H                    at the pole
==========  ===================  =====================================================
printed     F_yy'                U = 0, U' = 1: the pole is pinned
corrected   F_y'y = (F_yy')^T    rho column (r, 0), eta column (0, 1): eta free, slope 0
==========  ===================  =====================================================

The two differ because F_yy' is not symmetric (F_rho,eta' - F_eta,rho' = W_12 eta'/lambda_1 + P rho), and because the pole is free to move
along the axis. F_y'y' vanishes at the pole, and the printed conditions have no solution there: an eta column that starts at the radius e
with (0, e) and slope 1 is e (1 + log(r/e)) near the pole. So the printed answer depends on where the integration starts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np
from scipy.integrate import solve_ivp

from ..checks import choice
from ..discretization.meridian import Disc, disc
from ..errors import InputError, SolveError, Status
from ..physics.loads import over_projection
from ..potential import Array, Potential, potential_of
from ..solve.controls import CenterHeightControl, PressureControl, VolumeControl
from ..solve.finer_space import solved_in
from ..threads import one_thread
from .second_variation import LocalResponse, local_response

if TYPE_CHECKING:
    from ..results.equilibrium import Equilibrium

FORMS = ("corrected", "printed")

#: coefficients are sampled on a state of this degree, with Chebyshev polynomials of order _SAMPLES - 1 in each element
_SMOOTH_DEGREE, _SMOOTH_ELEMENTS, _SAMPLES = 8, 16, 16


@dataclass(frozen=True)
class LegendreTest:
    """Positive definiteness of P = F_y'y'/2 (paper eq. 40); P/r is judged, since P itself vanishes at the pole.

    Attributes
    ----------
    satisfied : bool
    smallest_eigenvalue, smallest_determinant : float
        Of P/r over the quadrature points.
    where : float
        Reference radius of the smallest eigenvalue.
    """

    satisfied: bool
    smallest_eigenvalue: float
    smallest_determinant: float
    where: float


@dataclass(frozen=True, eq=False)
class JacobiTest:
    """Zeros of det U (paper eq. 42).

    Attributes
    ----------
    form : {"corrected", "printed"}
    conjugate_points : ndarray
        Reference radii in (0, 1] at which det U = 0. In the corrected form their number is the number of negative eigenvalues of the second
        variation under pressure control.
    r, det : ndarray
        The curve det U(r), as integrated.
    conclusion : str
        "stable" without conjugate points; with them "unstable" (corrected) or, in the paper's word, "unclear" (printed). Where Legendre's
        condition fails it is "short-wave unstable", and nothing is integrated.
    """

    form: str
    conjugate_points: Array
    r: Array
    det: Array
    conclusion: str


def legendre_test(equilibrium: Equilibrium) -> LegendreTest:
    """Legendre's necessary condition for a minimum: meridional stress and modulus are positive everywhere.

    The eigenvalues of F_y'y'/r are W_11 along the meridian and W_1/lambda_1 across it (paper eq. 40).

    Parameters
    ----------
    equilibrium : Equilibrium

    Returns
    -------
    LegendreTest
    """
    potential = equilibrium.potential
    space = potential.space
    displacement = space.displacement_at_quadrature(equilibrium.state)
    square = potential.local_square(equilibrium.state, space.R, space.Z, space.s)
    response = local_response(potential, (space.R, space.R_x, space.Z, space.Z_x), tuple(displacement), space.s, square)
    along, mixed, across = _slope_moduli(response)
    smallest = (along + across - np.hypot(along - across, 2 * mixed)) / 4 if response.sloped is not None else np.minimum(along, across) / 2
    at = int(np.argmin(smallest))
    value = float(smallest.ravel()[at])
    return LegendreTest(value > 0, value, float((along * across - mixed**2).min() / 4), float(space.R.ravel()[at]))


def _slope_moduli(p: LocalResponse) -> tuple[Array, Array, Array]:
    """F_y'y'/r along the meridian, mixed, and across it."""
    if p.sloped is None:
        return p.W11, np.zeros_like(p.W11), p.N1
    (aa, ab), (_, bb) = p.sloped[0][2:4, 2:4]
    t, z = p.t_rho, p.t_z
    turned = t**2 * aa + 2 * t * z * ab + z**2 * bb, (t**2 - z**2) * ab + t * z * (bb - aa), z**2 * aa - 2 * t * z * ab + t**2 * bb
    return p.W11 + turned[0], turned[1], p.N1 + turned[2]


@one_thread
def jacobi_test(equilibrium: Equilibrium, form: str = "corrected", *, start: float = 1e-4) -> JacobiTest:
    """Jacobi's condition for a minimum under pressure control (paper eqs. 42-45).

    Parameters
    ----------
    equilibrium : Equilibrium
        Of a disc. Below degree 6 the state is first solved again on elements of degree 8, whose slopes are smooth. In a wrinkled tension
        field the coefficients jump inside elements, and conjugate points are good to three digits.
    form : {"corrected", "printed"}
    start : float
        Radius at which the integration starts.

    Returns
    -------
    JacobiTest

    Raises
    ------
    InputError
        For an unknown form, a start outside (0, 0.01], or a membrane that is no disc.
    SolveError
        When the integration fails.
    """
    choice("form", form, FORMS)
    if not 0 < start <= 0.01:
        raise InputError("start", start, "a radius in (0, 0.01] is allowed")
    if equilibrium.scene.bodies:
        raise InputError("obstacle", equilibrium.scene.bodies[0].label(), "none is allowed: the test is written for a free membrane")
    if equilibrium.scene.mesh.shape != "disc":
        raise InputError("mesh.shape", equilibrium.scene.mesh.shape, '"disc" is allowed: the test is written for a pole and a clamped rim')
    if not legendre_test(equilibrium).satisfied:
        nothing = np.zeros(0)
        return JacobiTest(form, nothing, nothing, nothing, "short-wave unstable")
    conjugate, r, det = _integrate(_Coefficients(*_smooth(equilibrium)), form, start)
    word = "stable" if not conjugate.size else "unstable" if form == "corrected" else "unclear"
    return JacobiTest(form, conjugate, r, det, word)


def _smooth(equilibrium: Equilibrium) -> tuple[Potential, Array, float]:
    """The same equilibrium on elements of high degree."""
    scene, old = equilibrium.scene, equilibrium.potential
    if scene.degree >= 6:
        return old, equilibrium.state, equilibrium.pressure
    smooth = disc(_SMOOTH_ELEMENTS, rim=cast(Disc, scene.mesh).rim)
    potential = potential_of(scene.replace(mesh=smooth, degree=_SMOOTH_DEGREE))
    volume, pressure, height = equilibrium.volume, equilibrium.pressure, equilibrium.center_height
    # at a fold in one quantity another quantity still tells neighbouring equilibria apart
    for control in (CenterHeightControl(height), VolumeControl(volume), PressureControl(pressure)):
        result = solved_in(potential, control, old, equilibrium.state, pressure)
        if result.status is Status.CONVERGED:
            return potential, result.x, result.pressure
    raise SolveError("the state could not be solved again on elements of high degree", status=result.status)


class _Coefficients:
    """Second derivatives of F along the radius, from Chebyshev interpolants in each element."""

    def __init__(self, potential: Potential, x: Array, pressure: float) -> None:
        self.ends, self.pressure, self.loads = potential.space.ends, pressure, potential.loads
        angle = np.pi * (np.arange(_SAMPLES) + 0.5) / _SAMPLES
        size = np.diff(self.ends)
        s = self.ends[:-1, None] + size[:, None] * (1 + np.cos(angle)) / 2
        mesh, displacement = potential.space.mesh, potential.space.displacement(x, s.ravel())
        (R, Z), (R_s, Z_s) = mesh.position(s.ravel()), mesh.tangent(s.ravel())
        square = potential.local_square(x, R, Z, s.ravel())
        samples = self._regular(local_response(potential, (R, R_s, Z, Z_s), displacement, s.ravel(), square)).reshape(-1, *s.shape)
        transform = 2 / _SAMPLES * np.cos(np.arange(_SAMPLES)[:, None] * angle)
        transform[0] /= 2
        self._series = np.einsum("kp,cep->ekc", transform, samples)
        self._order = np.arange(_SAMPLES)

    @staticmethod
    def _regular(p: LocalResponse) -> Array:
        """Quantities that stay smooth up to the pole."""
        t, z = p.t_rho, p.t_z
        slopes = [p.W11 * t**2 + p.N1 * z**2, (p.W11 - p.N1) * t * z, p.W11 * z**2 + p.N1 * t**2]
        values = [p.W12 * t, p.W12 * z, p.W22, *p.field[3:]]
        if p.sloped is None:
            return np.stack([*slopes, *values, p.rho, p.eta, p.rho_x])
        H = p.sloped[0]  # of (a, b, a', b', q = a/r)
        slopes = [own + more for own, more in zip(slopes, (H[2, 2], H[2, 3], H[3, 3]), strict=True)]
        more = (H[2, 4], H[3, 4], H[4, 4], H[0, 0], H[0, 1], H[1, 1])
        values = [own + part for own, part in zip(values, more, strict=True)]
        return np.stack([*slopes, *values, p.rho, p.eta, p.rho_x, H[0, 2], H[0, 3], H[1, 2], H[1, 3], H[0, 4], H[1, 4]])

    def at(self, element: int, r: float) -> tuple[Array, Array, Array]:
        """F_y'y', F_yy' and F_yy at a radius of an element."""
        low, high = self.ends[element : element + 2]
        angle = np.arccos(np.clip((2 * r - low - high) / (high - low), -1, 1))
        p1, p2, p3, g1, g2, w22, m1, m2, m3, rho, eta, rho_s, *more = (np.cos(self._order * angle) @ self._series[element]).tolist()
        g, g_z, g_zz = over_projection(self.loads, eta)
        P = self.pressure - g_z
        slopes = r * np.array([[p1, p2], [p2, p3]])
        mixed = np.array([[g1 - self.pressure * eta + g, g2], [-P * rho, 0.0]])
        values = np.array([[w22 / r + r * m1, r * m2 - P * rho_s], [r * m2 - P * rho_s, r * m3 + g_zz * rho * rho_s]])
        if more:  # of an energy that depends on the slope
            mixed += r * np.array(more[:4]).reshape(2, 2)
            values += np.array([[2 * more[4], more[5]], [more[5], 0.0]])
        return slopes, mixed, values


def _integrate(coefficients: _Coefficients, form: str, start: float) -> tuple[Array, Array, Array]:
    """Zeros of det U, and the curve det U(r)."""
    printed = form == "printed"
    slopes, mixed, _ = coefficients.at(0, start)
    U = start * np.eye(2) if printed else np.diag([start, 1.0])
    slope = np.eye(2) if printed else np.diag([1.0, 0.0])
    state = np.concatenate([U, slopes @ slope + (mixed if printed else mixed.T) @ U])
    zeros, radii, values = [], [], []
    logarithm = 0.0
    for element, (low, high) in enumerate(zip(coefficients.ends[:-1], coefficients.ends[1:], strict=True)):
        # columns grow parallel: orthogonal ones with the same span have the same zeros, and their scale is kept apart
        Q, T = np.linalg.qr(state)
        flip = np.sign(np.diag(T))
        logarithm += float(np.log(np.abs(np.diag(T))).sum())

        def rates(r: float, y: Array, element: int = element) -> Array:
            U, V = y.reshape(2, 2, 2)
            slopes, mixed, values = coefficients.at(element, r)
            U_r = np.linalg.solve(slopes, V - (mixed if printed else mixed.T) @ U)
            return np.concatenate([U_r, mixed @ U_r + values @ U]).ravel()

        span = (max(float(low), start), float(high))
        found = solve_ivp(
            rates, span, (Q * flip).ravel(), "DOP853", events=_determinant, rtol=1e-9, atol=1e-12, max_step=(span[1] - span[0]) / 4
        )  # two zeros in one step would go unnoticed
        if not found.success:
            raise SolveError(f"Jacobi's equation could not be integrated beyond r = {found.t[-1]:.6g}", status=Status.NOT_CONVERGED)
        zeros += found.t_events[0].tolist()
        radii.append(found.t)
        values.append(_determinant(0.0, found.y) * np.exp(logarithm))
        state = found.y[:, -1].reshape(4, 2)
    return np.array(zeros), np.concatenate(radii), np.concatenate(values)


def _determinant(r: float, y: Array) -> Array:
    return y[0] * y[3] - y[1] * y[2]
