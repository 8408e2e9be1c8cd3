"""Cylinder and ring magnets around the axis, magnetised along it, by their exact fields.

A uniformly magnetised cylinder has the field of two discs of magnetic charge, its end faces. One has the charge m, the other -m, where m is
the magnetisation in units of sqrt(mu/mu0). A ring is a cylinder without a smaller one. Let a be the radius of a disc, (r, z) the position
from its middle, b^2 = (a + r)^2 + z^2, and K, E the complete elliptic integrals of the parameter k^2 = 4 a r/b^2. Define T by
E = K (1 - k^2/2 - k^4 T). Then a disc of charge 1 has ::

    h_r = 8 a^2 r K T/(pi b^3),      h_z: see _disc

The derivative of its field along the axis is the field of a loop of current at its edge. Of that field one more derivative is needed.
Divergence and curl vanish, which gives all others. Sums are written without cancellation near the axis, far away and next to the edge.

Sources: J. D. Jackson, Classical Electrodynamics, 3rd ed. (1999), section 5.10 (charges); N. Derby and S. Olbert, Am. J. Phys. 78 (2010)
(cylinders by one integral of the third kind); R. Bulirsch, Numer. Math. 13 (1969) (the integral by the arithmetic-geometric mean).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..checks import number, only, store, switch
from ..errors import InputError
from .magnetics import Array, Source, check_source
from .obstacles import Cylinder
from .outline import Outline
from .scales import Scales

#: steps of the arithmetic-geometric mean: round-off at distances from an edge down to 1e-6 of the radius
_STEPS = 7
#: keeps quotients numbers where a factor beside them is 0
_TINY = 1e-150


class Jet(NamedTuple):
    """An axisymmetric field (h_r, h_z) without curl with its first and second derivatives; h_z_r = h_r_z and so on."""

    h_r: Any
    h_z: Any
    h_r_r: Any
    h_r_z: Any
    h_z_z: Any
    h_r_rr: Any
    h_r_rz: Any
    h_r_zz: Any
    h_z_zz: Any


@dataclass(frozen=True, init=False)
class Magnet(Source):
    """Cylinder or ring magnet around the axis, magnetised along it uniformly, by its exact field.

    It is a body: a membrane that comes to it is in contact, and its branch ends there, unless ``body`` lets it go on.

    Parameters
    ----------
    height : float
        Signed height of its middle over the plane of the rim, in units of R0.
    radius, length : float
        > 0, in units of R0.
    strength : float
        M >= 0: the strength of a dipole with the same moment. The magnetisation of the magnet, in units of sqrt(mu/mu0), is
        4 sqrt(M)/((radius^2 - inner_radius^2) length), see :attr:`magnetization`.
    inner_radius : float
        Of a ring, >= 0 and less than the radius; 0 for a cylinder.
    orientation : {1, -1}
        Sense of the magnetisation; matters only beside another source.
    body : bool
        Whether the membrane goes on against it, as against a cylinder with a coating of a tenth of the smaller of its radius and half its
        length. Otherwise a branch ends where the membrane comes to the magnet.
    remanence : float, optional
        B_r in T, in place of the strength; a catalogue has it (1.28 to 1.32 T for neodymium N42).
    scales : Scales, optional
        Size and stiffness of the membrane, needed with a remanence.

    Raises
    ------
    InputError
        For numbers that are not of this kind, for both or none of strength and remanence, and for a remanence without scales. A scene
        refuses a magnet that its membrane pierces at rest.

    Examples
    --------
    A disc magnet of 10 mm by 5 mm next to a membrane of silicone rubber with a diameter of 25 mm:

    >>> import femmembrane as fm
    >>> scales = fm.Scales(radius=12.5e-3, thickness=0.5e-3, shear_modulus=45e3)
    >>> magnet = fm.Magnet(height=-0.6, radius=0.4, length=0.4, remanence=1.3, scales=scales)
    >>> print(f"M = {magnet.strength:.4f}, {scales.to_si('remanence', magnet.magnetization):.2f} T")
    M = 0.0077, 1.30 T
    """

    height: float
    radius: float
    length: float
    strength: float
    inner_radius: float = 0.0
    orientation: int = 1
    body: bool = field(default=False, metadata={"quiet": True})

    refusal = ("height", "the membrane meets the magnet at rest; move it off")

    def __init__(
        self,
        height: float,
        radius: float,
        length: float,
        strength: float | None = None,
        *,
        inner_radius: float = 0.0,
        orientation: int = 1,
        body: bool = False,
        remanence: float | None = None,
        scales: Scales | None = None,
    ) -> None:
        store(self, height=height, radius=radius, length=length, inner_radius=inner_radius, orientation=orientation)
        given = {"strength": strength, "remanence": remanence}
        name, _ = only("source.strength", given, "one of strength and remanence (in T, with scales) is allowed")
        store(self, strength=strength if name == "strength" else 0.0)
        check_source(self)
        allowed = "a finite number >= 0 and less than the radius is allowed (in units of R0)"
        inner = number("source.inner_radius", inner_radius, allowed, least=0.0)
        if inner >= self.radius:
            raise InputError("source.inner_radius", inner_radius, allowed)
        store(self, inner_radius=inner, body=switch("source.body", body))
        if self.body and self._is_ring:
            raise InputError("source.body", True, "false is allowed for a ring: contact is computed with cylinders")
        if remanence is not None:
            if not isinstance(scales, Scales):
                advice = "scales are needed beside a remanence in T (a table [scales] in a scene file); or give the strength"
                raise InputError("source.scales", scales, advice)
            magnetization = scales.from_si("remanence", number("source.remanence", remanence, "a number >= 0 is allowed (in T)", least=0.0))
            store(self, strength=(magnetization * self._moment) ** 2)
            check_source(self)

    @property
    def obstacle(self) -> Cylinder | None:
        """What the membrane cannot enter; None without a body. Next to the edges themselves the field is infinite."""
        if not self.body:
            return None
        coat = 0.1 * min(self.radius, self.length / 2)
        return Cylinder(self.height, self.radius + coat, self.length + 2 * coat, rounding=coat)

    @property
    def magnetization(self) -> Any:
        """Its magnetisation over sqrt(mu/mu0); the remanence over sqrt(mu mu0) is the same number."""
        return np.sqrt(self.strength) / self._moment

    @property
    def _moment(self) -> Any:
        """sqrt(M) of a magnet of magnetisation 1."""
        return (self.radius**2 - self.inner_radius**2) * self.length / 4

    @property
    def circles(self) -> tuple[tuple[float, float], ...]:  # type: ignore[override]  # read only here, and there
        radii = (self.radius, self.inner_radius) if self._is_ring else (self.radius,)
        return tuple((a, end) for a in radii for end in self._ends)

    def field(self, rho: Any, eta: Any) -> tuple[Any, Any, Any]:
        """See :meth:`.Source.field`. Inside the magnet it is not a number: no membrane is there."""
        amplitude = self._outside(rho, eta)
        faces = [(sign, _disc(a, rho, eta - end)) for sign, a, end in self._faces]
        return (
            amplitude * rho * sum(sign * face.radial for sign, face in faces),
            amplitude * sum(sign * face.axial for sign, face in faces),
            0.0,
        )

    def jet(self, rho: Any, eta: Any) -> Jet:
        """See :meth:`.Source.jet`."""
        amplitude = self._outside(rho, eta)
        radial = axial = radial_r = 0.0  # h_r/r, h_z and the derivative of h_r/r
        loop_r = loop_z = loop_rz = loop_zz = 0.0  # h_r_z/r, h_z_z and their derivatives along the axis, the second over r
        for sign, a, end in self._faces:
            disc = _disc(a, rho, eta - end)
            edge = _edge(a, rho, eta - end, disc)
            radial, axial, radial_r = radial + sign * disc.radial, axial + sign * disc.axial, radial_r + sign * edge.radial_r
            loop_r, loop_z = loop_r - sign * edge.radial, loop_z - sign * edge.axial
            loop_rz, loop_zz = loop_rz - sign * edge.radial_z, loop_zz - sign * edge.axial_z
        parts = (
            rho * radial,
            axial,
            -loop_z - radial,
            rho * loop_r,
            loop_z,
            -rho * loop_rz - radial_r,
            -loop_zz - loop_r,
            rho * loop_rz,
            loop_zz,
        )
        return Jet(*(amplitude * part for part in parts))

    def distance_squared(self, rho: Any, eta: Any) -> Any:
        """See :meth:`.Source.distance_squared`: from the body, 0 inside it; infinite with ``body``, since contact goes on there."""
        if self.body:
            return np.full(np.broadcast(rho, eta).shape, np.inf)
        across = np.maximum(np.maximum(rho - self.radius, self.inner_radius - rho), 0.0)
        along = np.maximum(np.abs(eta - self.height) - self.length / 2, 0.0)
        return across**2 + along**2

    def singular_squared(self, rho: Any, eta: Any) -> Any:
        """See :meth:`.Source.singular_squared`: the edges."""
        return Source.distance_squared(self, rho, eta)

    def passed(self, before: float, after: float) -> bool:
        if self._is_ring:
            return False
        return any((before - end) * (after - end) <= 0 for end in self._ends)

    def meets(self, rho: Array, eta: Array) -> bool:
        """See :meth:`.Source.meets`: whether one of the pieces has a point of the body."""
        (bottom, top), first = self._ends, np.zeros(len(rho) - 1)
        last = first + 1
        for value, low, high in ((rho, self.inner_radius, self.radius), (eta, bottom, top)):
            step = np.diff(value)
            still = step == 0
            with np.errstate(divide="ignore", invalid="ignore"):
                ends = np.sort([(low - value[:-1]) / step, (high - value[:-1]) / step], axis=0)
            within = (low <= value[:-1]) & (value[:-1] <= high)
            enter, leave = (np.where(still, np.where(within, v, -v), e) for v, e in ((-np.inf, ends[0]), (np.inf, ends[1])))
            first, last = np.maximum(first, enter), np.minimum(last, leave)
        return bool((first <= last).any())

    def outline(self) -> Outline:
        """The body, with an arrow along the magnetisation."""
        (bottom, top), inner, outer = self._ends, self.inner_radius, self.radius
        corners = ((inner, bottom), (outer, bottom), (outer, top), (inner, top))
        kind = "ring magnet" if self._is_ring else "magnet"
        return Outline(f"{kind} at height {self.height:g}", corners + corners[:1] * self._is_ring, self.orientation)

    @property
    def _is_ring(self) -> bool:
        return not (isinstance(self.inner_radius, float) and self.inner_radius == 0)  # a symbol may become any number

    @property
    def _ends(self) -> tuple[Any, Any]:
        return self.height - self.length / 2, self.height + self.length / 2

    @property
    def _faces(self) -> list[tuple[int, Any, Any]]:
        """Charge, radius and height of the discs: a ring is a cylinder without another."""
        bottom, top = self._ends
        radii = [(1, self.radius)] + [(-1, self.inner_radius)] * self._is_ring
        return [(side * sign, a, end) for sign, a in radii for side, end in ((1, top), (-1, bottom))]

    def _outside(self, rho: Any, eta: Any) -> Any:
        """The magnetisation with its sense; not a number inside the body."""
        bottom, top = self._ends
        inside = (rho <= self.radius) * (eta >= bottom) * (eta <= top)
        if self._is_ring:
            inside = inside * (rho >= self.inner_radius)
        with np.errstate(invalid="ignore"):
            return self.orientation * self.magnetization * np.sqrt(1.0 - 2 * inside)


class _Disc(NamedTuple):
    """Field of a disc of charge 1, h_r over r and h_z, and what its derivatives need.

    These are K and T, and their derivatives with respect to k^2, the first over K.
    """

    radial: Any
    axial: Any
    K: Any
    T: Any
    K_k: Any
    T_k: Any


class _Edge(NamedTuple):
    """Field of the loop at the edge of a disc, minus the derivative of the disc's along the axis, and more derivatives.

    ``radial`` is h_r/r, ``radial_z`` its derivative along the axis, and ``radial_r`` the derivative of the disc's h_r/r along the radius.
    """

    radial: Any
    axial: Any
    radial_z: Any
    axial_z: Any
    radial_r: Any


def _disc(a: Any, r: Any, z: Any) -> _Disc:
    """Field of a disc of charge 1 and radius a at (r, z) from its middle.

    Outside its cylinder, r > a, with g = (r - a)/(r + a), ::

        h_z = (z/b) a/(pi (r + a)) Int (g sin^2 x - cos^2 x)/((cos^2 x + g^2 sin^2 x) D) dx,    D^2 = 1 - k^2 sin^2 x

    over a quarter of the circle, and inside, with t = |z|/b and up to the sign of z, ::

        h_z = (1 - 2 t K/pi)/4 + (a^2 - r^2) t/(2 pi b^2) Int sin^2 x/((cos^2 x + t^2 sin^2 x) D) dx

    Bulirsch's algorithm changes the numerator c cos^2 x + s sin^2 x step by step along with the means x and y. Its first step is done by
    hand, and c x + s takes the place of s. Then no sum has terms that cancel.
    """
    square = (a + r) ** 2 + z**2
    b = np.sqrt(square)
    k2, kc2 = 4 * a * r / square, ((a - r) ** 2 + z**2) / square
    kc = np.sqrt(kc2)
    x, y = (1 + kc) / 2, np.sqrt(kc)
    # outside and inside of the cylinder: which of the two integrals is taken
    outside = 1.0 * (r > a)
    inside = 1.0 - outside
    upper = 1.0 - 2.0 * (z < 0)
    t = upper * z / b + _TINY
    gap = outside * (r - a) + inside * a
    g = gap / (r + a)
    p = outside * (g + kc / g) / 2 + inside * (t + kc / t) / 2
    c = outside * a / gap + inside / (2 * t)
    s = outside * k2 * r / (4 * x * gap) + inside * (0.5 + x / (2 * t))
    u = 1 / (4 * x)  # difference of the means over k^2
    T, less, weight = u * u, k2 * u, 1.0
    # logarithmic derivatives of the means by k^2, and the derivatives of u and T
    x_k, y_k = -1 / (4 * kc * x), -1 / (4 * kc2)
    u_k = -u * x_k
    dT = 2 * u * u_k
    for _ in range(_STEPS - 1):
        mean = (x + y) / 2
        x_k, y_k = (x * x_k + y * y_k) / (2 * mean), (x_k + y_k) / 2
        f = k2 * u / (4 * mean)
        u, u_k = u * f, (u**2 + 2 * k2 * u * u_k) / (4 * mean) - u * f * x_k
        half, less = k2 * u, less + k2 * u
        s, c = (s * (1 + mean / p) - c * half * (1 + x / p)) / 2, (s + c * (p - x)) / (2 * p)
        p = (p + x * y / p) / 2
        x, y = mean, np.sqrt(x * y)
        weight *= 2
        T, dT = T + weight * u**2, dT + weight * 2 * u * u_k
    K = math.pi / (2 * x)
    third = s / (x * (x + p))
    beyond = z / b * a / (2 * (r + a)) * third
    above = ((a + r) ** 2 / (square * (1 + t)) - less) / x + (a**2 - r**2) / square * third
    radial = 8 / math.pi * a**2 * K * T / (square * b)
    return _Disc(radial, outside * beyond + inside * upper * above / 4, K, T, -x_k, dT)


def _edge(a: Any, r: Any, z: Any, disc: _Disc) -> _Edge:
    """Derivatives of the field of a disc at (r, z) from its middle, by the loop at its edge."""
    _, _, K, T, dK, dT = disc
    square, q = (a + r) ** 2 + z**2, (a - r) ** 2 + z**2
    k2, ring = 4 * a * r / square, (a - r) * (a + r)
    v, w = ring + z**2, ring - z**2
    k2_z, k2_r = -2 * k2 * z / square, (4 * a - 2 * k2 * (a + r)) / square
    # h_r = F 8 r z U/b^2,  h_z = F N;  F_z is a logarithmic derivative
    F = a**2 * K / (math.pi * np.sqrt(square) * q)
    F_z = dK * k2_z - z / square - 2 * z / q
    U = 0.25 - (1 - k2 / 2) * T
    U_z = (T / 2 - (1 - k2 / 2) * dT) * k2_z
    e = 8 * r**2 / square**2
    N = v / square - e * T * w
    N_z = 2 * z / square * (1 - v / square) - e * (dT * k2_z * w - 2 * z * T - 4 * z * T * w / square)
    return _Edge(
        8 * F * z * U / square,
        F * N,
        8 * F / square * (U * (1 + z * F_z - 2 * z**2 / square) + z * U_z),
        F * (F_z * N + N_z),
        disc.radial * (dK * k2_r + dT * k2_r / T - 3 * (a + r) / square),
    )
