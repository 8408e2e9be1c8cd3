"""Where the ends of a meridian are held, when not where they rest: the displacement that carries the membrane there.

An end that is held may have a place of its own, and a pre-stretch p gives every held end one: p times its radius where the membrane is
flat, p times its height where it is a tube. The unknowns are the displacement beyond a smooth one, the *lift*, that has the prescribed
values at the ends::

    u0 = c(s) R,    w0 = d(s),        c, d linear along the meridian, constant where one end alone is held

so that all unknowns are zero in a disc, an annulus or a tube that is stretched uniformly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .meridian import LEAST_LENGTH, Meridian, extent
from .supports import Support, as_support

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lift:
    """Values of c and d at the first and the last end, and the parameters of these."""

    radial: tuple[float, float]
    axial: tuple[float, float]
    ends: tuple[float, float]

    @property
    def rigid(self) -> bool:
        """Whether it moves the membrane along the axis as a whole, and strains nothing."""
        return not any(self.radial) and self.axial[0] == self.axial[1]

    def at(self, mesh: Meridian, s: Array) -> Array:
        """(u0, u0_s, w0, w0_s) at parameters s, shape (4, *s.shape)."""
        first, last = self.ends
        share = (s - first) / (last - first)
        R, R_s = mesh.position(s)[0], mesh.tangent(s)[0]
        (c0, c1), (d0, d1) = self.radial, self.axial
        c, c_s = c0 + (c1 - c0) * share, (c1 - c0) / (last - first)
        slope = np.full_like(share, (d1 - d0) / (last - first))
        return np.stack([c * R, c * R_s + c_s * R, d0 + (d1 - d0) * share, slope])


@dataclass(frozen=True)
class Moving:
    """The lift of all values of a number m that moves an end: ``rest`` + ``share`` times ``unit``.

    Attributes
    ----------
    share : Any
        m minus the value at which the end is where it rests; a symbol, where m is one.
    at : float
        The value of m in the scene with which the space was built.
    rest, unit : Lift or None, Lift
        The part that stays, and what m adds for each unit.
    sliding : (float, float)
        1 at an end of radius m that slides along a wall of this radius, else 0.
    wall : Any
        What m adds to the squared radius of that wall in the space.
    """

    share: Any
    at: float
    rest: Lift | None
    unit: Lift
    sliding: tuple[float, float] = (0.0, 0.0)
    wall: Any = 0.0

    @classmethod
    def between(cls, share: Any, at: float, rest: Lift | None, lift: Lift, size: float) -> Moving:
        """The lift that is ``rest`` at the share 0 and ``lift`` at the share ``size``."""
        radial, axial = (0.0, 0.0), (0.0, 0.0)
        if rest is not None:
            radial, axial = rest.radial, rest.axial

        def rates(to: tuple[float, float], start: tuple[float, float]) -> tuple[float, float]:
            return (to[0] - start[0]) / size, (to[1] - start[1]) / size

        return cls(share, at, rest, Lift(rates(lift.radial, radial), rates(lift.axial, axial), lift.ends))


def lift_of(mesh: Meridian, prestretch: float) -> Lift | None:
    """The lift of a meridian with a pre-stretch; None where every held end is where it rests.

    Raises
    ------
    InputError
        For a place of an end that is not held in that direction, and for a pre-stretch without a held end, with a place of one, or of a
        shape that is neither flat nor a tube.
    """
    supports = [as_support(held) for held in mesh.supports()]
    placed = any(end.placed for end in supports)
    if not placed and prestretch == 1:
        return None
    ends = mesh.breakpoints()[[0, -1]]
    R, Z = mesh.position(ends)
    if prestretch != 1:
        if placed:
            raise InputError("membrane.prestretch", prestretch, "not together with places of the ends, which say how far it is stretched")
        supports = _stretched(mesh, supports, R, Z, prestretch)
    radial = [_radial(end, float(R[k])) for k, end in enumerate(supports)]
    axial = [end.height - float(Z[k]) if end.height is not None else 0.0 if "w" in end.held else None for k, end in enumerate(supports)]
    lift = Lift(_pair(radial), _pair(axial), (float(ends[0]), float(ends[1])))
    return lift if any((*lift.radial, *lift.axial)) else None


def _radial(end: Support, R: float) -> float | None:
    """Relative displacement of an end across the axis; None where it is not held there."""
    if "u" not in end.held or R == 0:
        return None
    return 0.0 if end.radius is None else (end.radius - R) / R


def _pair(values: Sequence[float | None]) -> tuple[float, float]:
    """Values at both ends; what one end leaves open follows the other."""
    first, last = values
    known = first if first is not None else last if last is not None else 0.0
    return (known if first is None else first), (known if last is None else last)


def _stretched(mesh: Meridian, supports: list[Support], R: Array, Z: Array, prestretch: float) -> list[Support]:
    """The supports with the places that a pre-stretch gives them."""
    everywhere = mesh.position(mesh.breakpoints())
    near = LEAST_LENGTH * extent(*everywhere)
    if supports and np.ptp(everywhere[1]) <= near:
        if not any("u" in end.held and not end.rigid and r > near for end, r in zip(supports, R, strict=True)):
            raise InputError("membrane.prestretch", prestretch, "no edge is held across the axis, so that nothing stretches the membrane")
        return [
            end.at(radius=prestretch * r) if "u" in end.held and not end.rigid and r > near else end
            for end, r in zip(supports, R.tolist(), strict=True)
        ]
    if supports and np.ptp(everywhere[0]) <= near:
        if not all("w" in end.held for end in supports):
            raise InputError("membrane.prestretch", prestretch, "both ends of a tube must be held along the axis for it to be stretched")
        return [end.at(height=prestretch * z) for end, z in zip(supports, Z.tolist(), strict=True)]
    advice = 'flat shapes and tubes are allowed; of others give an end its place, such as rim = {kind = "clamped", radius = 1.2}'
    raise InputError("membrane.prestretch", prestretch, advice)
