"""Second variation against perturbations with n waves around the axis: wobbling, tipping sideways, wrinkling.

::

    u = (a cos n theta, c sin n theta, b cos n theta)        in (e_rho, e_theta, e_z),   a, c, b functions of the meridian

Each n decouples from all others, so three functions on the meridian and one banded matrix describe a perturbation of the whole surface.
With t the unit tangent of the deformed meridian, nu its normal, ' = d/dS along the reference meridian, and
e = -(n a + c)/R, f = -n b/R, q = (a + n c)/R, the displacement gradient has the components (t, theta, nu)::

    g1 = (t.(a', b'), c', nu.(a', b')),        g2 = (t.(e, f), q, nu.(e, f))

and the quadratic form is, per reference area,

    W_11 g1t^2 + 2 W_12 g1t g2th + W_22 g2th^2 + A (g1th^2 + g2t^2) + 2 B g1th g2t + W_1/l1 g1nu^2 + W_2/l2 g2nu^2
    + m_rr a^2 + 2 m_rz a b + m_zz b^2 + m_r/rho c^2                                  (m: energy density of sources, loads)

with A = (l1 W_1 - l2 W_2)/(l1^2 - l2^2), B = (l2 W_1 - l1 W_2)/(l1^2 - l2^2), minus P times the second variation of the enclosed volume,
2 Int eta (a a_x + c c_x + n (a c)_x) + rho_x (a b + n b c) + rho a_x b dx. Where an end moves in its plane, the lid that closes the volume
there counts too: by parts -Int eta_x (a^2 + 2 n a c + c^2) + rho (2 a b_x + n c b_x + n b c_x) - n rho_x b c dx, and at a free edge, whose
lid is a film that its edge makes harmonic, b (r/rho)^n cos n theta to first order, further [n rho a b] of the two ends. A load g(eta) over
the projected area adds the first form with g for eta in its first term and g' before the others, and g'' rho rho_x b^2.

A magnetic energy that depends on the slope (:mod:`..physics.magnetisation`) adds two forms of its second derivatives, in the even variables
(a, b, a', b', q) and in the odd ones (c, c', e, f): they do not mix, and do not know n.

Integrals over theta are normalised as for n = 0, 2 pi instead of pi, so that n = 0 is the axisymmetric operator entry by entry; eigenvalues
do not depend on it. c plays no part at n = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..discretization.space import Space
from ..physics.kinematics import hencky_strains
from ..physics.loads import Load, over_projection
from ..physics.response import response_of
from ..potential import Array, Potential

#: difference of the logarithmic stretches below which (s_1 - s_2)/(e_1 - e_2) is integrated rather than divided out; both ways are
#: accurate to about 1e-12 there (round-off/d for the quotient, (5 d/2)^4/270 for two Gauss points and the exponent 5)
EQUAL_STRETCH = 1e-3

#: local variables (a, a_x, c, c_x, b, b_x); pairs (c_x, b_x), (a_x, c_x) and (b, b_x) never meet
_A, _AX, _C, _CX, _B, _BX = range(6)
VALUES = (_A, _C, _B)
PAIRS = (
    (_A, _A),
    (_A, _AX),
    (_A, _C),
    (_A, _CX),
    (_A, _B),
    (_A, _BX),
    (_AX, _AX),
    (_AX, _C),
    (_AX, _B),
    (_AX, _BX),
    (_C, _C),
    (_C, _CX),
    (_C, _B),
    (_C, _BX),
    (_CX, _CX),
    (_CX, _B),
    (_B, _B),
    (_BX, _BX),
)
#: the pairs where an energy depends on the slope
SLOPED_PAIRS = (*PAIRS, (_B, _BX))


@dataclass(frozen=True, eq=False)
class LocalResponse:
    """Stretches, stresses, tangent moduli and magnetic derivatives at points of a deformed meridian.

    Attributes
    ----------
    rho, eta, rho_x, eta_x : deformed position and slopes
    t_rho, t_z : unit tangent
    s1, s2 : principal stresses that the energy feels: mechanical ones l_i W_i, less that of Maxwell under a voltage
    W11, W12, W22 : second derivatives of the strain energy with respect to the stretches
    N1, N2 : W_1/l1 and W_2/l2, the stiffness of rotation out of the surface
    A, B : in-plane shear moduli, continuous through l1 = l2
    field : ndarray, shape (6, ...)
        m, m_rho, m_eta, m_rho_rho, m_rho_eta, m_eta_eta of the energy density of sources and loads.
    sloped : tuple of two ndarrays, shapes (5, 5, ...) and (4, 4, ...), or None
        Second derivatives of an energy density of sources that depends on the slope, see :func:`~.potential.magnetic.wave_function`.
    """

    rho: Array
    eta: Array
    rho_x: Array
    eta_x: Array
    t_rho: Array
    t_z: Array
    s1: Array
    s2: Array
    W11: Array
    W12: Array
    W22: Array
    N1: Array
    N2: Array
    A: Array
    B: Array
    field: Array
    sloped: tuple[Array, Array] | None = None


def local_response(
    potential: Potential,
    meridian: tuple[Array, ...],
    displacement: tuple[Array, ...],
    s: Array | None = None,
    square: Array | None = None,
) -> LocalResponse:
    """Response at points (R, R_x, Z, Z_x) of the reference meridian displaced by (u, u_x, w, w_x); R > 0 and any shape.

    Of an uneven sheet, which asks for the places ``s`` of the points (default their radii), stresses and moduli are forces per length:
    times thickness and modulus. ``square`` is the local square of voltage or charge, with one of them.
    """
    R, R_x, Z, Z_x = meridian
    u, u_x, w, w_x = displacement
    shape = R.shape
    rho, eta, rho_x, eta_x = R + u, Z + w, R_x + u_x, Z_x + w_x
    e1, e2 = hencky_strains(R, R_x, Z_x, u, u_x, w_x)
    places = R if s is None else s
    s1, s2, d11, d12, d22 = potential.response(e1, e2, square).reshape(5, *shape)
    l1, l2 = np.exp(e1), np.exp(e2)
    slope = np.hypot(rho_x, eta_x)
    # l1^2 - l2^2 = 2 l1 l2 sinh d for d = e1 - e2
    d = e1 - e2
    A = _stress_quotient(potential, e1, e2, s1 - s2, d, square) * _over_sinh(d) / (2 * l1 * l2)
    B = ((l1**2 + l2**2) / 2 * A - (s1 + s2) / 2) / (l1 * l2)
    field = potential.field_energy(rho, eta).reshape(6, *shape)
    sloped = _sloped(potential, (R, R_x, Z, Z_x), (rho, eta, rho_x, eta_x), s)
    if potential.sheet is not None:
        thickness, modulus = potential.sheet.factors(R, Z, places)
        force = thickness * modulus
        s1, s2, d11, d12, d22, A, B = (part * force for part in (s1, s2, d11, d12, d22, A, B))
        field = field * thickness
        sloped = None if sloped is None else (sloped[0] * thickness, sloped[1] * thickness)
    return LocalResponse(
        rho=rho,
        eta=eta,
        rho_x=rho_x,
        eta_x=eta_x,
        t_rho=rho_x / slope,
        t_z=eta_x / slope,
        s1=s1,
        s2=s2,
        W11=(d11 - s1) / l1**2,
        W12=d12 / (l1 * l2),
        W22=(d22 - s2) / l2**2,
        N1=s1 / l1**2,
        N2=s2 / l2**2,
        A=A,
        B=B,
        field=field,
        sloped=sloped,
    )


def _sloped(potential: Potential, meridian: tuple[Array, ...], deformed: tuple[Array, ...], s: Array | None) -> tuple[Array, Array] | None:
    if not potential.tilts:
        return None
    (R, R_x, Z, Z_x), (rho, eta, rho_x, eta_x) = meridian, deformed
    J = np.hypot(R_x, Z_x)
    found: Any = potential.wave_energy(rho, eta, (rho_x / J, eta_x / J), R, Z, R if s is None else s)
    even, odd = np.zeros((5, 5, *R.shape)), np.zeros((4, 4, *R.shape))
    pairs = [(block, i, j) for block in (even, odd) for i in range(len(block)) for j in range(i, len(block))]
    for (block, i, j), row in zip(pairs, found, strict=True):
        block[i, j] = block[j, i] = row.reshape(R.shape)
    return even, odd


def _over_sinh(d: Array) -> Array:
    """d/sinh d."""
    safe = np.where(d == 0, 1.0, d)
    return np.where(d == 0, 1.0, safe / np.sinh(safe))


def _stress_quotient(potential: Potential, e1: Array, e2: Array, difference: Array, d: Array, square: Array | None) -> Array:
    """(s_1 - s_2)/(e_1 - e_2), continuous through equal stretches.

    For an isotropic material the difference g is odd in d at fixed mean strain, so g/d = Int_0^1 g'(t d) dt has an even integrand, and
    one evaluation at t = 1/sqrt 3 is a Gauss rule of two points.
    """
    close = np.abs(d) < EQUAL_STRETCH
    if potential.scene.tension_field:  # where one stress is gone, the difference is odd but not smooth, and has no digits to lose
        _, _, taut1, taut2 = response_of(potential.scene, square).natural(e1, e2)  # type: ignore[attr-defined]
        close &= taut1 == taut2
    quotient: Array = difference / np.where(close, 1.0, d)
    if close.any():
        mean, half = (e1 + e2)[close] / 2, d[close] / np.sqrt(12)
        _, _, d11, d12, d22 = potential.response(mean + half, mean - half, None if square is None else square[close])
        quotient[close] = (d11 - 2 * d12 + d22) / 2
    return quotient


@lru_cache(maxsize=4)
def response_at_quadrature(potential: Potential, state: bytes) -> LocalResponse:
    """Remembered for the other n of the same state."""
    space = potential.space
    x = np.frombuffer(state)
    displacement = space.displacement_at_quadrature(x)
    square = potential.local_square(x, space.R, space.Z, space.s)
    return local_response(potential, (space.R, space.R_x, space.Z, space.Z_x), tuple(displacement), space.s, square)


def second_variation(space: Space, r: LocalResponse, loads: Sequence[Load], pressure: float, n: int) -> list[Array]:
    """Second derivatives of the quadratic form at the points, times the weights, in the order of PAIRS or SLOPED_PAIRS."""
    J = np.hypot(space.R_x, space.Z_x)
    area = space.weights * space.R * J
    xx, xo, oo = area / J**2, area / (J * space.R), area / space.R**2  # of two slopes, a slope and a value, two values
    inside = space.weights * space.side
    g, g_z, g_zz = (part * inside for part in over_projection(loads, r.eta))
    t, z = r.t_rho, r.t_z
    A, B, N1, N2 = r.A, r.B, r.N1, r.N2
    along, out, across = A * t**2 + N2 * z**2, A * z**2 + N2 * t**2, (A - N2) * t * z  # of e, of f, mixed
    _, m_r, _, m_rr, m_rz, m_zz = r.field
    entries = {
        (_A, _A): (r.W22 + n**2 * along) * oo + m_rr * area,
        (_A, _AX): r.W12 * t * xo,
        (_A, _C): n * (r.W22 + along) * oo,
        (_A, _CX): -n * B * t * xo,
        (_A, _B): n**2 * across * oo + m_rz * area,
        (_A, _BX): r.W12 * z * xo,
        (_AX, _AX): (r.W11 * t**2 + N1 * z**2) * xx,
        (_AX, _C): n * r.W12 * t * xo,
        (_AX, _BX): (r.W11 - N1) * t * z * xx,
        (_C, _C): (n**2 * r.W22 + along) * oo + m_r / r.rho * area,
        (_C, _CX): -B * t * xo,
        (_C, _B): n * across * oo,
        (_C, _BX): n * r.W12 * z * xo,
        (_CX, _CX): A * xx,
        (_CX, _B): -n * B * z * xo,
        (_B, _B): n**2 * out * oo + m_zz * area + g_zz * r.rho * r.rho_x,
        (_BX, _BX): (r.W11 * z**2 + N1 * t**2) * xx,
    }
    parts = [_volume_density(space, r, -pressure * inside, n)]
    if loads:
        parts.append(_projected_density(r, g, g_z, n))
    if r.sloped is not None:
        parts.append(_sloped_density(space, r.sloped, n))
    for pair, part in (item for added in parts for item in added.items()):
        entries[pair] = entries[pair] + part if pair in entries else part
    return [entries.get(pair, np.zeros_like(area)) for pair in (PAIRS if r.sloped is None else SLOPED_PAIRS)]


def pairs_of(density: Array) -> tuple[tuple[int, int], ...]:
    """The pairs that the rows of :func:`second_variation` belong to."""
    return PAIRS if len(density) == len(PAIRS) else SLOPED_PAIRS


def _sloped_density(space: Space, sloped: tuple[Array, Array], n: int) -> dict[tuple[int, int], Array]:
    """Second derivatives of an energy that depends on the slope, times the weights, by the chain rule for its local variables."""
    J = np.hypot(space.R_x, space.Z_x)
    area = space.weights * space.R * J
    one, by_J, by_R = np.ones_like(J), 1 / J, 1 / space.R
    even = ({_A: one}, {_B: one}, {_AX: by_J}, {_BX: by_J}, {_A: by_R, _C: n * by_R})
    odd = ({_C: one}, {_CX: by_J}, {_A: -n * by_R, _C: -by_R}, {_B: -n * by_R})
    entries: dict[tuple[int, int], Array] = {}
    for block, variables in zip(sloped, (even, odd), strict=True):
        for i, first in enumerate(variables):
            for j, second in enumerate(variables):
                for u, du in first.items():
                    for v, dv in second.items():
                        if u <= v:
                            entries[u, v] = entries.get((u, v), 0.0) + block[i, j] * du * dv * area
    return entries


def _volume_density(space: Space, r: LocalResponse, work: Array, n: int) -> dict[tuple[int, int], Array]:
    """Second derivatives of the enclosed volume over 2 pi, times ``work``."""
    if space.lids and (n == 0 or space.spreads):
        return {
            (_A, _A): -work * r.eta_x,
            (_A, _C): -n * work * r.eta_x,
            (_A, _BX): -work * r.rho,
            (_C, _C): -work * r.eta_x,
            (_C, _B): n / 2 * work * r.rho_x,
            (_C, _BX): -n / 2 * work * r.rho,
            (_CX, _B): -n / 2 * work * r.rho,
        }
    return _projected_density(r, work * r.eta, work, n)


def _projected_density(r: LocalResponse, g: Array, g_z: Array, n: int) -> dict[tuple[int, int], Array]:
    """Second derivatives of an energy g(eta) over the projected area, from weighted g and g' at the points; the terms with g'' are left
    out.
    """
    return {
        (_A, _AX): g,
        (_A, _CX): n * g,
        (_A, _B): g_z * r.rho_x,
        (_AX, _C): n * g,
        (_AX, _B): g_z * r.rho,
        (_C, _CX): g,
        (_C, _B): n * g_z * r.rho_x,
    }
