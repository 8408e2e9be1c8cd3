"""Taut and wrinkled zones of an equilibrium.

Their kinds are told apart in :mod:`femmembrane.stability.zones`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..checks import choice
from . import door

#: kinds of zones; the place of a kind is its number
KINDS = ("taut", "radial", "circumferential", "double")
#: what is told of a zone that opens or closes; columns have these names after ``changing_zone_``
ZONE_CHANGES = ("kind", "place", "reference_radius", "radius")


@dataclass(frozen=True)
class Zone:
    """A part of the membrane between two circles, throughout which the principal stresses keep their signs.

    Attributes
    ----------
    kind : {"taut", "radial", "circumferential", "double"}
        The directions in which the stress is compressive.
    r, rho : (float, float)
        Reference and deformed radii over R0 at its start and end, seen from the pole.
    area_fraction, deformed_area_fraction : float
        Its share of the reference area and of the deformed area.
    s : (float, float)
        Parameters of the meridian at its start and end; for a disc, the reference radii.
    """

    kind: str
    r: tuple[float, float]
    rho: tuple[float, float]
    area_fraction: float
    deformed_area_fraction: float
    s: tuple[float, float] = field(repr=False)

    def __str__(self) -> str:
        (r0, r1), (rho0, rho1) = self.r, self.rho
        where = f"r = {r0:<7.4g} to {r1:<7.4g} rho = {rho0:<7.4g} to {rho1:<7.4g}"
        return f"{self.kind:<16}{where}{self.area_fraction:>8.2%} of the area ({self.deformed_area_fraction:.2%} deformed)"


@dataclass(frozen=True)
class Zones(Sequence[Zone]):
    """The zones of an equilibrium, from the pole to the rim; together they are the whole membrane.

    Attributes
    ----------
    criterion : {"total", "mechanical"}
        The stresses that decide.
    zones : tuple of Zone
        One or more; neighbours are of different kinds.
    """

    criterion: str
    zones: tuple[Zone, ...]

    def __len__(self) -> int:
        return len(self.zones)

    @overload
    def __getitem__(self, index: int) -> Zone: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Zone, ...]: ...

    def __getitem__(self, index: int | slice) -> Zone | tuple[Zone, ...]:
        return self.zones[index]

    def __iter__(self) -> Iterator[Zone]:
        return iter(self.zones)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kind of each zone."""
        return tuple(zone.kind for zone in self)

    @property
    def borders(self) -> tuple[float, ...]:
        """Reference radii at which one zone ends and the next begins."""
        return tuple(zone.r[1] for zone in self.zones[:-1])

    def fraction(self, kind: str) -> float:
        """Share of the reference area that is of a kind.

        Parameters
        ----------
        kind : {"taut", "radial", "circumferential", "double"}

        Raises
        ------
        InputError
            For an unknown kind.
        """
        choice("kind", kind, KINDS)
        return float(sum(zone.area_fraction for zone in self if zone.kind == kind))

    def numbers(self, s: ArrayLike) -> NDArray[np.int64]:
        """Kinds at points of the meridian as numbers, from 0 (taut) to 3 (double). A border belongs to the zone outside it.

        Parameters
        ----------
        s : array_like
            Parameters of the meridian; for a disc, reference radii.
        """
        kinds = np.array([KINDS.index(kind) for kind in self.kinds])
        return kinds[np.searchsorted([zone.s[1] for zone in self.zones[:-1]], s, side="right")]

    @property
    def summary(self) -> str:
        """In a few words: taut, or each kind of wrinkles with its part of the reference area."""
        found = [f"{kind} {100 * self.fraction(kind):.3g}%" for kind in KINDS[1:] if kind in self.kinds]
        return ", ".join(found) or "taut"

    def _repr_html_(self) -> str:
        """A table of the zones, for notebooks."""
        return door.zones_html(self)

    def __str__(self) -> str:
        return "\n".join([f"zones by the signs of the {self.criterion} stresses", *(f"  {zone}" for zone in self)])


@dataclass(frozen=True)
class ZoneChange:
    """Where along the meridian a zone of a tension field appears or vanishes.

    Attributes
    ----------
    kind : {"taut", "radial", "circumferential", "double"}
        Of the zone. A taut zone that closes lets two zones of wrinkles merge.
    place : {"pole", "rim", "inside"}
        At an end of the meridian on the axis, at another end, or between them.
    reference_radius, radius : float
        Reference and deformed radius there, over R0.
    """

    kind: str
    place: str
    reference_radius: float
    radius: float

    def __str__(self) -> str:
        where = "at the pole" if self.place == "pole" else f"at r = {self.reference_radius:.4g}"
        return f"{self.kind}, {'at the rim, ' if self.place == 'rim' else ''}{where}"


@dataclass(frozen=True, eq=False)
class ZonesAlong:
    """Zones along a branch.

    Attributes
    ----------
    steps : ndarray
        Place of each state along the branch. Whole numbers are equilibria; states between lie on a straight line from one to the next.
    zones : tuple of Zones
    snaps : frozenset of int
        Positions in ``steps`` of the equilibria that the membrane snapped to.
    """

    steps: NDArray[np.float64]
    zones: tuple[Zones, ...]
    snaps: frozenset[int]
