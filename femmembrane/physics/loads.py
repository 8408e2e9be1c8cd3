"""Work of the inflating pressure, and loads besides it.

A load is conservative and does not depend on the angle around the axis: its energy, in units of mu T R0^2, is a function f of the position
per reference area and a function g of the height per area projected onto the plane of the rim::

    E = Int f(rho, eta) R dS + Int g(eta) rho d rho,      both with the 2 pi

where an area counts as positive as the volume over it does, so that g acts like the pressure -g'(eta), and a function of the heights of
rigid hubs. A new load is a class here with one of these, and a line in the registry of scenes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from ..checks import convert, is_number
from ..errors import InputError


def volume_density(rho: Any, rho_s: Any, eta: Any) -> Any:
    """Integrand of the enclosed volume over 2 pi: V = 2 pi Int rho rho_s eta ds, signed (paper eq. 17).

    It is that between the membrane and the plane z = 0, where every end is a pole or stays in that plane; with the other sign where the
    inside is on the left of the meridian (:func:`~femmembrane.discretization.meridian.side`).
    """
    return rho * rho_s * eta


def lidded_volume_density(rho: Any, eta_s: Any) -> Any:
    """Integrand over 2 pi of the volume between the membrane and flat lids across its ends, wherever these are.

    By parts 2 pi Int rho rho_s eta ds + pi [-rho^2 eta] = -pi Int rho^2 eta_s ds; a shift along the axis changes nothing of it. The force
    of the pressure on a lid, pi rho^2 P, acts on the end, along the axis.
    """
    return -(rho**2) * eta_s / 2


def wall_density(wall: Any, wall_s: Any, w: Any, w_s: Any) -> Any:
    """Integrand over 2 pi of pi [wall w]: what takes the lid of an end that slides along a wall back to where the end was at rest."""
    return (wall * w_s + wall_s * w) / 2


def hub_density(forces: tuple[Any, Any], hub: Any, hub_s: Any, z: Any, z_s: Any) -> Any:
    """Integrand of -F_0 z_0 - F_1 z_1, the energy of forces along the axis on the first and the last end, at the heights z_0 and z_1.

    ``hub`` is linear along the meridian, from -1 to 0: then F_0 z_0 + F_1 z_1 = Int d/ds [(F_0 hub + F_1 (hub + 1)) z] ds.
    """
    first, last = forces
    return -(first * hub + last * (hub + 1)) * z_s - (first + last) * hub_s * z


class Load:
    """A load besides the pressure: no load at all, unless a method says otherwise."""

    #: motions of the membrane as a whole on which it works, alone or beside the pressure: "along" the axis, a "shift" across it, and a
    #: "tilt" about a diameter; what pulls down pulls alike wherever the membrane is shifted to
    sees: frozenset[str] = frozenset({"along", "tilt"})

    @property
    def acts(self) -> bool:
        """Whether there is anything to build."""
        return True

    def over_reference(self, rho: Any, eta: Any) -> Any:
        """f(rho, eta): energy per reference area."""
        return 0.0

    def over_projection(self, eta: Any) -> tuple[Any, Any, Any]:
        """(g, g', g'') at a height: energy per projected area with its derivatives."""
        return 0.0, 0.0, 0.0

    def on_hubs(self, hubs: Sequence[bool]) -> tuple[Any, Any]:
        """Force along the axis on the first and the last end; ``hubs`` tells which of them are rigid hubs."""
        return 0.0, 0.0


@dataclass(frozen=True)
class Hydrostatic(Load):
    """A liquid inside the membrane: under a disc or a dome, in a bowl, always with its weight downwards.

    P is the pressure at the height of the rim, and P - gamma eta that at the height eta: E = gamma Int eta dV. Inside is what the reference
    shape encloses, and below where it is flat (:mod:`~femmembrane.discretization.meridian`).

    Parameters
    ----------
    gamma : float
        rho g R0^2/(mu T), rho the density of the liquid less that of what is outside; negative where the liquid is lighter.

    Raises
    ------
    InputError
        For a number that is not finite.
    """

    gamma: float

    def __post_init__(self) -> None:
        convert(self, "load.gamma", "a finite number is allowed (density times gravity, times R0^2/(mu T))")

    @property
    def acts(self) -> bool:
        return not (is_number(self.gamma) and self.gamma == 0)  # a symbol acts

    def over_projection(self, eta: Any) -> tuple[Any, Any, Any]:
        return self.gamma / 2 * eta**2, self.gamma * eta, self.gamma


@dataclass(frozen=True)
class Weight(Load):
    """The weight of the membrane itself: E = w Int eta R dS.

    Parameters
    ----------
    weight : float
        w = rho_m g R0/mu, rho_m the mass density of the membrane; it pulls downwards, against the axis, when positive.

    Raises
    ------
    InputError
        For a number that is not finite.
    """

    weight: float

    def __post_init__(self) -> None:
        convert(self, "load.weight", "a finite number is allowed (mass density times gravity, times R0/mu)")

    @property
    def acts(self) -> bool:
        return not (is_number(self.weight) and self.weight == 0)

    def over_reference(self, rho: Any, eta: Any) -> Any:
        return self.weight * eta


@dataclass(frozen=True)
class HubForce(Load):
    """A force along the axis on a rigid hub, dead: E = -F times the height of the hub.

    Parameters
    ----------
    force : float
        F over mu T R0; it lifts the hub, along the axis, when positive.
    hub : {"first", "last"}, optional
        Which hub of two, as the meridian runs (of a cylinder the first is its top); left out: the only one.

    Raises
    ------
    InputError
        For a number that is not finite and for another word; a scene refuses it where the shape has no such hub.
    """

    force: float
    hub: str | None = None

    sees = frozenset()

    def __post_init__(self) -> None:
        convert(self, "load.force", "a finite number is allowed (over mu T R0; positive lifts the hub)")
        if self.hub is not None and (not isinstance(self.hub, str) or self.hub not in _HUBS):
            raise InputError("load.hub", self.hub, "'first' or 'last' is allowed, or nothing where there is one hub")

    @property
    def acts(self) -> bool:
        return not (is_number(self.force) and self.force == 0)

    def on_hubs(self, hubs: Sequence[bool]) -> tuple[Any, Any]:
        """As :meth:`Load.on_hubs`; InputError where the hub is missing, or which of two is meant."""
        places = [k for k, is_hub in enumerate(hubs) if is_hub and self.hub in (None, _HUBS[k])]
        if not places:
            raise InputError("load.hub", self.hub, 'there is no such hub; a shape with an end that is a hub is allowed (inner = "hub")')
        if len(places) > 1:
            raise InputError("load.hub", None, "missing; there are two hubs: 'first' or 'last' is allowed")
        return (self.force, 0.0) if places == [0] else (0.0, self.force)


#: names of the ends of a meridian
_HUBS = ("first", "last")


def on_hubs(loads: Iterable[Load], hubs: Sequence[bool]) -> tuple[Any, Any]:
    """Sums of the forces on the first and the last end."""
    forces = [load.on_hubs(hubs) for load in loads if type(load).on_hubs is not Load.on_hubs]
    return sum(f[0] for f in forces), sum(f[1] for f in forces)


def over_reference(loads: Iterable[Load], rho: Any, eta: Any) -> Any:
    """Sum of f of all loads."""
    return sum(load.over_reference(rho, eta) for load in loads)


def over_projection(loads: Iterable[Load], eta: Any) -> tuple[Any, Any, Any]:
    """Sums of (g, g', g'') of all loads."""
    parts = [load.over_projection(eta) for load in loads]
    return sum(p[0] for p in parts), sum(p[1] for p in parts), sum(p[2] for p in parts)
