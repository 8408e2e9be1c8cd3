"""Work of the inflating pressure, and loads besides it.

A load is conservative and does not depend on the angle around the axis. Its energy, in units of mu T R0^2, has up to three parts: a
function f of the position, per reference area; a function g of the height, per area projected onto the plane of the rim; and a function of
the heights of rigid hubs::

    E = Int f(rho, eta) R dS + Int g(eta) rho d rho + E_hubs,      the integrals with the 2 pi

A projected area has the sign of the volume over it, so that g acts like the pressure -g'(eta). A new load is a class here with one of these
parts, and a line in the registry of scenes.

Volume and work of the pressure: Saxena et al. (2019), eq. 17. That such pressures have a potential: M. J. Sewell, Arch. Rational Mech.
Anal. 23 (1967); K. Schweizerhof and E. Ramm, Comput. Struct. 18 (1984).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from ..checks import convert, is_number
from ..errors import InputError


def volume_density(rho: Any, rho_s: Any, eta: Any) -> Any:
    """Integrand of the enclosed volume over 2 pi: V = 2 pi Int rho rho_s eta ds, signed (paper eq. 17).

    It counts the volume between the membrane and the plane z = 0, for a membrane whose ends are poles or stay in that plane. Its sign turns
    where the inside is on the left of the meridian (:func:`~femmembrane.discretization.meridian.side`).
    """
    return rho * rho_s * eta


def lidded_volume_density(rho: Any, eta_s: Any) -> Any:
    """Integrand over 2 pi of the volume between the membrane and flat lids across its ends, wherever these are.

    By parts 2 pi Int rho rho_s eta ds + pi [-rho^2 eta] = -pi Int rho^2 eta_s ds, which a shift along the axis does not change. The force
    of the pressure on a lid, pi rho^2 P, acts on the end, along the axis.
    """
    return -(rho**2) * eta_s / 2


def wall_density(wall: Any, wall_s: Any, w: Any, w_s: Any) -> Any:
    """Integrand over 2 pi of pi [wall w].

    An end that slides along a wall carries its lid with it. This term moves the lid back to where the end was at rest.
    """
    return (wall * w_s + wall_s * w) / 2


def hub_density(forces: tuple[Any, Any], hub: Any, hub_s: Any, z: Any, z_s: Any) -> Any:
    """Integrand of -F_0 z_0 - F_1 z_1, the energy of forces along the axis on the first and the last end, at the heights z_0 and z_1.

    ``hub`` is linear along the meridian, from -1 to 0: then F_0 z_0 + F_1 z_1 = Int d/ds [(F_0 hub + F_1 (hub + 1)) z] ds.
    """
    first, last = forces
    return -(first * hub + last * (hub + 1)) * z_s - (first + last) * hub_s * z


class Load:
    """A load besides the pressure. A load of your own derives from this class and overrides one of its methods."""

    #: motions of the whole membrane on which the load does work, alone or beside the pressure: "along" the axis, a "shift" across it, a
    #: "tilt" about a diameter; a weight does none in a shift, since it pulls alike everywhere
    sees: frozenset[str] = frozenset({"along", "tilt"})

    @property
    def acts(self) -> bool:
        """Whether there is anything to build."""
        return True

    def over_reference(self, rho: Any, eta: Any) -> Any:
        """f(rho, eta): energy per reference area.

        Parameters
        ----------
        rho, eta : ndarray or CasADi symbol
            Radius and height of the point, over R0.
        """
        return 0.0

    def over_projection(self, eta: Any) -> tuple[Any, Any, Any]:
        """(g, g', g'') at a height: energy per projected area with its derivatives.

        Parameters
        ----------
        eta : ndarray or CasADi symbol
            Height of the point, over R0.
        """
        return 0.0, 0.0, 0.0

    def on_hubs(self, hubs: Sequence[bool]) -> tuple[Any, Any]:
        """Force along the axis on the first and the last end.

        Parameters
        ----------
        hubs : sequence of bool
            Which of the ends are rigid hubs.
        """
        return 0.0, 0.0


@dataclass(frozen=True)
class Hydrostatic(Load):
    """A liquid inside the membrane: under a disc or a dome, in a bowl, always with its weight downwards.

    The pressure is P at the height of the rim and P - gamma eta at the height eta, so that E = gamma Int eta dV. Inside is the space that
    the reference shape encloses; of a flat shape it is below (:mod:`~femmembrane.discretization.meridian`).

    Parameters
    ----------
    gamma : float
        rho g R0^2/(mu T), where rho is the density inside minus the density outside. It is negative for a light liquid or gas.

    Raises
    ------
    InputError
        For a number that is not finite.

    Examples
    --------
    A disc carries a bulge of volume 1 against the weight of a liquid below it:

    >>> import femmembrane as fm
    >>> plain = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16))
    >>> filled = plain.replace(loads=[fm.Hydrostatic(gamma=0.5)])
    >>> for scene in (plain, filled):
    ...     print(f"{fm.equilibrium(scene, volume=1.0).pressure:.4f}")
    1.0669
    1.2519
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
        w = rho_m g R0/mu, with rho_m the mass density of the membrane. A positive weight pulls downwards, against the axis.

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
    """A dead force along the axis on a rigid hub: E = -F times the height of the hub.

    Parameters
    ----------
    force : float
        F over mu T R0; it lifts the hub, along the axis, when positive.
    hub : {"first", "last"}, optional
        Which of two hubs, as the meridian runs; the first hub of a cylinder is its top. Left out: the only hub.

    Raises
    ------
    InputError
        For a number that is not finite, and for another word. A scene refuses the load where its shape has no such hub.
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
        """The force on the end that is the hub, and 0 on the other end.

        Parameters
        ----------
        hubs : sequence of bool
            Which of the ends are rigid hubs.

        Raises
        ------
        InputError
            Where there is no such hub, or there are two and ``hub`` is left out.
        """
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
