"""Reference meridians: the curve s -> (R, Z) that is revolved, and how its ends are held.

A meridian is divided into elements at :meth:`Meridian.breakpoints`; everything else (kinematics, energies, mass) is written for a
general curve, so a new shape is a new class here and nothing more.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

Array = NDArray[np.float64]


class Meridian(Hashable, Protocol):
    """What the discretisation asks of a reference shape."""

    @property
    def elements(self) -> int:
        """Number of elements."""

    @property
    def shape(self) -> str:
        """Name in scene files."""

    def breakpoints(self) -> Array:
        """Element ends along s, increasing, shape (elements + 1,)."""

    def position(self, s: Array) -> tuple[Array, Array]:
        """(R, Z) at s, in units of R0."""

    def tangent(self, s: Array) -> tuple[Array, Array]:
        """(dR/ds, dZ/ds) at s."""

    def refined(self) -> Self:
        """The same shape with every element halved."""

    def supports(self) -> tuple[frozenset[str], frozenset[str]]:
        """Displacements held at the first and last point: subsets of {"u", "w"}."""


@dataclass(frozen=True)
class Disc:
    """Flat disc of unit radius, pole on the axis and clamped rim: R = s, Z = 0, 0 <= s <= 1.

    ::

        z |
          |  pole: u = 0, w free          rim: u = w = 0
          o===================================o---> r
          s = 0                             s = 1

    Parameters
    ----------
    elements : int
        Number of elements along the radius, all of the same size.

    Raises
    ------
    InputError
        When elements is not a positive integer.
    """

    elements: int = 64

    def __post_init__(self) -> None:
        if isinstance(self.elements, bool) or not isinstance(self.elements, (int, np.integer)) or self.elements < 1:
            raise InputError("mesh.elements", self.elements, "a whole number >= 1 is allowed")
        object.__setattr__(self, "elements", int(self.elements))

    @property
    def shape(self) -> str:
        return "disc"

    def breakpoints(self) -> Array:
        return np.linspace(0.0, 1.0, self.elements + 1)

    def position(self, s: Array) -> tuple[Array, Array]:
        return s, np.zeros_like(s)

    def tangent(self, s: Array) -> tuple[Array, Array]:
        return np.ones_like(s), np.zeros_like(s)

    def refined(self) -> Self:
        return replace(self, elements=2 * self.elements)

    def supports(self) -> tuple[frozenset[str], frozenset[str]]:
        return frozenset({"u"}), frozenset({"u", "w"})


def disc(elements: int = 64) -> Disc:
    """Mesh of the flat, clamped disc with ``elements`` equal elements along the radius; see :class:`Disc`."""
    return Disc(elements=elements)
