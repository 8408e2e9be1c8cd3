"""Currents and uniform fields: coaxial loops and solenoids, a straight wire on the axis. Magnets stand in :mod:`.magnets`.

A loop or solenoid of strength M has the moment of a dipole of that strength, and so its far field. Let a be the radius in units of R0 and I
the current. The moment I pi (a R0)^2 of a loop then gives M = mu0 (I a^2/(4 R0))^2/(R0^2 mu), and the field at its centre is 2 sqrt(M)/a^3.

Fields: J. D. Jackson, Classical Electrodynamics, 3rd ed. (1999), sections 5.2 and 5.5. The integrals of the loop: Bulirsch (1969).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import store, whole
from .magnetics import Array, Source, check_source, root
from .outline import Outline

#: steps of the arithmetic-geometric mean: round-off at distances from the wire down to 1e-6 of its radius
_STEPS = 6


@dataclass(frozen=True)
class Loop(Source):
    """Circular loop of current around the axis (Jackson 1999, section 5.5).

    Parameters
    ----------
    strength : float
        M >= 0: the strength of a dipole with the same moment.
    height : float
        Signed height of its plane over the plane of the rim, in units of R0.
    radius : float
        a > 0, in units of R0.
    orientation : {1, -1}
        Sense of the current; matters only beside another source.

    Raises
    ------
    InputError
        For a negative strength, a radius that is not positive, another orientation, or numbers that are not finite.

    Examples
    --------
    The field (h_rho, h_z, h_theta) at the centre, where h_z = 2 sqrt(M)/a^3:

    >>> import femmembrane as fm
    >>> [round(float(h), 4) for h in fm.Loop(strength=4.0, height=0.0, radius=0.5).field(0.0, 0.0)]
    [0.0, 32.0, 0.0]
    """

    strength: float
    height: float
    radius: float
    orientation: int = 1

    def __post_init__(self) -> None:
        check_source(self)

    @property
    def circles(self) -> tuple[tuple[float, float], ...]:  # type: ignore[override]  # read only here, and there
        return ((self.radius, self.height),)

    def field(self, rho: Any, eta: Any) -> tuple[Any, Any, Any]:
        amplitude = self.orientation * root(self.strength)
        h_rho, h_z = loop_field(self.radius, rho, eta - self.height)
        return amplitude * h_rho, amplitude * h_z, 0.0

    def outline(self) -> Outline:
        """A ring with an arrow along its moment."""
        return Outline(f"loop at height {self.height:g}", ((self.radius, self.height),), self.orientation)


@dataclass(frozen=True)
class Solenoid(Source):
    """Thin coaxial solenoid, a sheet of current around a cylinder. It is hollow; a magnet has a body (:class:`.Magnet`).

    The sheet is a stack of loops (Jackson 1999, section 5.5) at Gauss points. At a distance of the order of its length the field is exact
    to round-off. At the distance d from the wall its relative error is about exp(-2 loops d/b), with b the larger of d and half the length.
    A membrane that comes closer to the wall than length/loops feels single loops.

    Parameters
    ----------
    strength : float
        M >= 0: the strength of a dipole with the same moment.
    height : float
        Signed height of its middle, in units of R0.
    radius, length : float
        > 0, in units of R0.
    orientation : {1, -1}
        Sense of the current; matters only beside another source.
    loops : int
        1 to 64; every one costs as much as a :class:`Loop`.

    Raises
    ------
    InputError
        As for :class:`Loop`, and for another number of loops.
    """

    strength: float
    height: float
    radius: float
    length: float
    orientation: int = 1
    loops: int = 8

    def __post_init__(self) -> None:
        check_source(self)
        store(self, loops=whole("source.loops", self.loops, most=64))

    @property
    def circles(self) -> tuple[tuple[float, float], ...]:  # type: ignore[override]  # read only here, and there
        points, _ = np.polynomial.legendre.leggauss(self.loops)
        return tuple((self.radius, self.height + self.length / 2 * x) for x in points)

    def field(self, rho: Any, eta: Any) -> tuple[Any, Any, Any]:
        amplitude = self.orientation * root(self.strength)
        points, weights = np.polynomial.legendre.leggauss(self.loops)
        h_rho = h_z = 0.0
        for x, w in zip(points.tolist(), weights.tolist(), strict=True):
            one = loop_field(self.radius, rho, eta - self.height - self.length / 2 * x)
            h_rho, h_z = h_rho + w / 2 * one[0], h_z + w / 2 * one[1]
        return amplitude * h_rho, amplitude * h_z, 0.0

    def distance_squared(self, rho: Any, eta: Any) -> Any:
        """Squared distance from the wall, where the field jumps."""
        beyond = np.maximum(np.abs(eta - self.height) - self.length / 2, 0.0)
        return (rho - self.radius) ** 2 + beyond**2

    def inside(self, rho: Array, eta: Array) -> NDArray[np.bool_]:
        """See :meth:`.Source.inside`: within its wall, where a solenoid that is wound on a core has no room."""
        return (rho <= self.radius) & (np.abs(eta - self.height) <= self.length / 2)

    def outline(self) -> Outline:
        """The wall, with an arrow along the moment."""
        ends = tuple((self.radius, self.height + side * self.length / 2) for side in (-1, 1))
        return Outline(f"solenoid at height {self.height:g}", ends, self.orientation)


@dataclass(frozen=True)
class Wire(Source):
    """Straight wire on the axis: h_theta = I/(2 pi rho), everything else 0 (Biot and Savart; Jackson 1999, section 5.2).

    Parameters
    ----------
    strength : float
        M = mu0 (I/(2 pi R0))^2/mu >= 0: |h|^2 = M/rho^2.
    orientation : {1, -1}
        Sense of the current; matters only beside another wire.

    Raises
    ------
    InputError
        For a negative strength or another orientation; a scene refuses a wire through a membrane that meets the axis.
    """

    strength: float
    orientation: int = 1

    sees = frozenset({"shift", "tilt"})
    refusal = (
        "kind",
        "the wire runs along the axis, where its field is singular, and pierces the pole; a membrane without a pole is allowed",
    )

    def __post_init__(self) -> None:
        check_source(self)

    def field(self, rho: Any, eta: Any) -> tuple[Any, Any, Any]:
        return 0.0, 0.0, self.orientation * root(self.strength) / rho

    def intensity(self, rho: Any, eta: Any) -> Any:
        return self.strength / rho**2

    def distance_squared(self, rho: Any, eta: Any) -> Any:
        return rho**2 + 0 * eta

    def outline(self) -> Outline:
        """The axis as far as the picture goes."""
        return Outline("wire", ((0.0, -math.inf), (0.0, math.inf)))


@dataclass(frozen=True)
class Uniform(Source):
    """Uniform field along the axis. Alone it exerts no force on a weakly magnetised membrane. It does beside another source, on a sheet
    with self-field and on a remanence.

    Parameters
    ----------
    strength : float
        M = mu0 h_z^2/mu >= 0.
    orientation : {1, -1}

    Raises
    ------
    InputError
        For a negative strength or another orientation.
    """

    strength: float
    orientation: int = 1

    sees = frozenset()

    def __post_init__(self) -> None:
        check_source(self)

    def field(self, rho: Any, eta: Any) -> tuple[Any, Any, Any]:
        return 0 * rho, self.orientation * root(self.strength) + 0 * rho, 0.0


def loop_field(a: Any, rho: Any, z: Any) -> tuple[Any, Any]:
    """(h_rho, h_z) of a loop of radius a and strength 1 at (rho, z) from its centre; h_z = 2/(a^2 + z^2)^(3/2) on the axis.

    With b^2 = (a + rho)^2 + z^2, k^2 = 4 a rho/b^2 and D = 1 - k^2 sin^2 the integrals over a quarter of the circle are ::

        h_rho = (4/pi) z k^2 J/(a b^3),     h_z = (4/pi) (a I - rho k^2 J)/(a b^3),     I = Int D^(-3/2),   k^2 J = -Int cos 2x D^(-3/2)

    Both come by Bulirsch's algorithm (Numer. Math. 13, 1969). The first step for J is done by hand and takes out the factor k^2: near the
    axis and far away the algorithm would compute it as a difference of nearly equal numbers.
    """
    square = (a + rho) ** 2 + z**2
    k2 = 4 * a * rho / square
    kc2 = ((a - rho) ** 2 + z**2) / square
    kc = np.sqrt(kc2)
    mean, product = 1 + kc, kc  # arithmetic-geometric mean
    c_i, s_i = 1 + 1 / kc2, 2 * mean / kc
    c_j, s_j = 1 / kc2, 2 / (kc * mean)
    for _ in range(_STEPS):
        g = 2 * np.sqrt(product)
        product = g * mean
        c_i, s_i = c_i + s_i / mean, 2 * (s_i + c_i * g)
        c_j, s_j = c_j + s_j / mean, 2 * (s_j + c_j * g)
        mean = mean + g
    amplitude = 1 / (a * square * np.sqrt(square) * mean**2)  # 2/(a b^3), and 1/(2 mean^2) of the integrals over pi/2
    i, kj = s_i + c_i * mean, k2 * (s_j + c_j * mean)
    return amplitude * z * kj, amplitude * (a * i - rho * kj)
