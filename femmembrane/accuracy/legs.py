"""Reference meridians for the strong form: the legs on which its equations are integrated, and an uneven sheet along them.

A leg sets out from an end of the meridian. There is one leg, from the first end to the last, unless the last end is a pole as well: then
there are two, from both poles, which meet halfway. So an equation is singular only where its leg begins.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import NDArray

from ..discretization.curve import Curve
from ..discretization.meridian import LEAST_LENGTH, Meridian, extent, side
from ..errors import InputError
from ..physics.sheet import Sheet

Array = NDArray[np.float64]

#: degrees that are tried for the polynomial of an uneven sheet, and how well it must fit
_DEGREES, _FIT = (16, 32, 64, 128), 1e-12


@dataclass(frozen=True)
class Leg:
    """A part of a meridian, from one of its ends.

    Attributes
    ----------
    mesh : Meridian
    start, length : float
        Where it begins along the meridian, and how long it is.
    direction : int
        1 where it runs as the meridian does, else -1.
    pole : bool
        Whether it begins at a pole.
    pushes : int
        1 where the pressure pushes to its left, else -1.
    """

    mesh: Meridian
    start: float
    length: float
    direction: int
    pole: bool
    pushes: int

    def along(self, x: Any) -> Any:
        """Parameters s of the meridian at distances x from the beginning."""
        return self.start + self.direction * x

    def reference(self, x: Any) -> tuple[Any, Any, Any]:
        """(R, cos Phi, Phi) at distances x: the radius, and the angle of the leg to the plane of the rim."""
        s = np.asarray(self.along(x))
        R, (R_s, Z_s) = self.mesh.position(s)[0], self.mesh.tangent(s)
        return R, self.direction * R_s, np.arctan2(self.direction * Z_s, self.direction * R_s)

    def own(self, s: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Distances from the beginning of parameters s, and which of them lie on this leg; the middle belongs to one leg only."""
        x = self.direction * (s - self.start)
        return x, x <= self.length if self.direction > 0 else x < self.length


def legs_of(mesh: Meridian) -> tuple[Leg, ...]:
    """The legs of a meridian.

    Raises
    ------
    InputError
        For a meridian with kinks: the cells of a file are taken as such.
    """
    if isinstance(mesh, Curve):
        allowed = "a disc, annulus, cap, sphere, cylinder or torus is allowed: cells of a file meet in kinks, where the strong form ends"
        raise InputError("mesh.shape", mesh.shape, allowed)
    first, last = (float(s) for s in mesh.breakpoints()[[0, -1]])
    R, Z = mesh.position(np.linspace(first, last, 65))
    near = LEAST_LENGTH * extent(R, Z)
    poles = bool(mesh.supports()) and R[0] <= near, bool(mesh.supports()) and R[-1] <= near
    if not poles[1]:
        return (Leg(mesh, first, last - first, 1, poles[0], side(mesh)),)
    half = (last - first) / 2
    return Leg(mesh, first, half, 1, poles[0], side(mesh)), Leg(mesh, last, half, -1, True, -side(mesh))


class Unevenness:
    """Thickness t and modulus m along a meridian, with the slope of log(t m) from a polynomial that fits it to round-off.

    Raises
    ------
    InputError
        For a sheet that no polynomial fits, such as one from a table, which has kinks.
    """

    def __init__(self, sheet: Sheet, mesh: Meridian) -> None:
        first, last = (float(s) for s in mesh.breakpoints()[[0, -1]])
        self.sheet, self.mesh = sheet, mesh

        def logarithm(s: Array) -> Array:
            thickness, modulus = self.factors(s)
            return np.broadcast_to(np.log(thickness * modulus), s.shape)

        probes = first + (last - first) * (np.arange(200) + 0.5) / 200
        for degree in _DEGREES:
            fit = Chebyshev.interpolate(logarithm, degree, domain=[first, last])
            if np.abs(fit(probes) - logarithm(probes)).max() <= _FIT:
                self._slope = fit.deriv()
                return
        name = "thickness" if sheet.thickness is not None else "modulus"
        allowed = "a smooth expression or function is allowed here: kinks and jumps end the strong form"
        raise InputError(f"membrane.{name}", getattr(sheet, name).given, allowed)

    def factors(self, s: Any) -> tuple[Any, Any]:
        """(t, m) at parameters s."""
        s = np.asarray(s, dtype=float)
        R, Z = self.mesh.position(s)
        return self.sheet.factors(R, Z, s)

    def slope(self, s: Any) -> Any:
        """The derivative of log(t m) along the meridian."""
        return self._slope(s)

    def curvature(self, s: float) -> float:
        """The second derivative of log(t m) along the meridian."""
        return float(self._slope.deriv()(s))
