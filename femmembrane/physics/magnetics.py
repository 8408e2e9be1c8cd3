"""Magnetic sources around the axis and the energy of a weakly magnetisable membrane in their field.

Fields are in units of D/R0^3 with D^2 = mu R0^6/mu0. So |h|^2 is in units of the shear modulus, and a source of strength
M = mu0 D^2/(R0^6 mu) contributes sqrt(M) times its unit field. The fields of several sources add up::

    energy density = - chi/2 |sum_i h_i|^2        per reference area, in units of mu T    (paper eqs. 28-29, 33)

"The paper" is here and elsewhere P. Saxena, N. H. Reddy and S. P. Pradhan, Int. J. Non-Linear Mech. 116 (2019).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import FINITE, convert, sign, store
from ..errors import InputError
from .outline import Outline

Array = NDArray[np.float64]

#: a strength enters once, and grows with the sixth power of a small radius when it follows from a moment in A m^2
_STRONGEST = 1e100


class Source:
    """A magnetic source whose field is the same all around the axis, with everything that the rest of the code asks of it.

    A source of your own derives from this class and needs :meth:`field` alone. All other methods answer for a field that is smooth
    everywhere.
    """

    #: (radius, height) of circles around the axis on which the field is singular
    circles: tuple[tuple[float, float], ...] = ()
    #: motions of the whole membrane that change the intensity: "along" the axis, a "shift" across it, a "tilt" about a diameter; a motion
    #: counts if it changes the intensity beside another source
    sees: frozenset[str] = frozenset({"along", "shift", "tilt"})
    #: argument and advice for a field that is not finite on the undeformed membrane
    refusal = ("height", "the source lies on the membrane, where its field is singular; move it off")

    def field(self, rho: Any, eta: Any) -> tuple[Any, Any, Any]:
        """Magnetic field (h_rho, h_z, h_theta) at a deformed point, in units of sqrt(mu/mu0).

        Parameters
        ----------
        rho, eta : float, ndarray or CasADi symbol
            Radius and height of the point, over R0.
        """
        raise NotImplementedError

    def intensity(self, rho: Any, eta: Any) -> Any:
        """|h|^2 of this source alone. A source whose |h|^2 can be written out overrides this, and saves the squares of the components.

        Parameters
        ----------
        rho, eta : float, ndarray or CasADi symbol
            Radius and height of the point, over R0.
        """
        h_rho, h_z, h_theta = components(self, rho, eta)
        return h_rho**2 + h_z**2 + h_theta**2

    def jet(self, rho: Any, eta: Any) -> Any:
        """The field with its first and second derivatives (:class:`.Jet`), for a source without h_theta that has them written out.

        None, the default, leaves it to CasADi to differentiate :meth:`field`.

        Parameters
        ----------
        rho, eta : float, ndarray or CasADi symbol
            Radius and height of the point, over R0.
        """
        return None

    def distance_squared(self, rho: Any, eta: Any) -> Any:
        """Squared distance from the nearest point that a membrane cannot pass, singular or of a body; infinite where there is none.

        Parameters
        ----------
        rho, eta : ndarray
            Radii and heights of points, over R0.
        """
        found = np.full(np.shape(rho), np.inf)
        for a, h in self.circles:
            found = np.minimum(found, (rho - a) ** 2 + (eta - h) ** 2)
        return found

    def singular_squared(self, rho: Any, eta: Any) -> Any:
        """Squared distance from the nearest point where the field is singular: what a mesh must resolve.

        Parameters
        ----------
        rho, eta : ndarray
            Radii and heights of points, over R0.
        """
        return self.distance_squared(rho, eta)

    def meets(self, rho: Array, eta: Array) -> bool:
        """Whether a meridian of straight pieces, shape (n,) each, meets the source.

        Parameters
        ----------
        rho, eta : ndarray
            Radii and heights of the ends of the pieces, over R0.
        """
        return any(distance_to_polyline(rho, eta, circle) < 1e-9 for circle in self.circles)

    def inside(self, rho: Array, eta: Array) -> NDArray[np.bool_]:
        """Which points are in a body that the membrane is free to enter in a computation, and not in a laboratory.

        Parameters
        ----------
        rho, eta : ndarray
            Radii and heights of points, over R0.
        """
        return np.zeros(np.shape(rho), dtype=bool)

    def passed(self, before: float, after: float) -> bool:
        """Whether a point on the axis that moved between two heights went through the source.

        Parameters
        ----------
        before, after : float
            Heights over R0.
        """
        return False


#: a point that a solver tries may lie on the source, where the field is infinite: the solver sees that and steps back
_anywhere = np.errstate(divide="ignore", invalid="ignore", over="ignore")


@dataclass(frozen=True)
class Dipole(Source):
    """Point dipole on the axis with its moment along the axis (Saxena et al. 2019, eq. 33).

    Parameters
    ----------
    strength : float
        M = mu0 D^2/(R0^6 mu) >= 0, with D = m/(4 pi) for a physical moment m (paper eq. 33).
    height : float
        Signed height over the plane of the rim, in units of R0; negative below.
    orientation : {1, -1}
        Sense of the moment; matters beside another source, or to a remanence.

    Raises
    ------
    InputError
        For a negative or non-finite strength, a non-finite height, or an orientation other than 1 and -1.

    Examples
    --------
    A dipole above a membrane that is not inflated draws it up:

    >>> import femmembrane as fm
    >>> dipole = fm.Dipole(strength=20.0, height=2.5)
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), sources=[dipole], susceptibility=1.0)
    >>> print(f"{fm.equilibrium(scene, pressure=0.0).center_height:.4f}")
    0.5635
    """

    strength: float
    height: float
    orientation: int = 1

    def __post_init__(self) -> None:
        check_source(self)

    @_anywhere
    def field(self, rho: Any, eta: Any) -> tuple[Any, Any, Any]:
        z = eta - self.height
        inverse = 1 / (rho**2 + z**2)
        amplitude = self.orientation * root(self.strength) * inverse**2 * inverse**0.5
        return 3 * z * rho * amplitude, (2 * z**2 - rho**2) * amplitude, 0.0

    @_anywhere
    def intensity(self, rho: Any, eta: Any) -> Any:
        """M (rho^2 + 4 z^2)/(rho^2 + z^2)^4 with z = eta - height (paper eq. 33)."""
        z2 = (eta - self.height) ** 2
        square = rho**2 + z2
        return self.strength * (square + 3 * z2) / (square**2) ** 2

    def distance_squared(self, rho: Any, eta: Any) -> Any:
        """Squared distance from the source, where the field is singular."""
        return rho**2 + (eta - self.height) ** 2

    def passed(self, before: float, after: float) -> bool:
        return (before - self.height) * (after - self.height) <= 0

    def outline(self) -> Outline:
        """A point with an arrow along its moment."""
        return Outline(f"dipole at height {self.height:g}", ((0.0, self.height),), self.orientation)


def root(strength: Any) -> Any:
    """The square root of a strength, a number or a symbol."""
    return math.sqrt(strength) if isinstance(strength, (int, float)) else np.sqrt(strength)


def check_source(source: Any) -> None:
    """Check those of the shared arguments (strength, height, radius, length, orientation) that a source has.

    Parameters
    ----------
    source : Source

    Raises
    ------
    InputError
    """
    lengths = "a finite number > 0 is allowed (in units of R0)"
    rules: dict[str, tuple[str, dict[str, float]]] = {
        "strength": ("a finite number >= 0 is allowed", {"least": 0.0, "most": _STRONGEST}),
        "height": (FINITE + " (in units of R0; negative is below)", {}),
        "radius": (lengths, {"above": 0.0}),
        "length": (lengths, {"above": 0.0}),
    }
    for name, (allowed, bounds) in rules.items():
        if hasattr(source, name):
            convert(source, f"source.{name}", allowed, **bounds)
    if hasattr(source, "orientation"):
        store(source, orientation=sign("source.orientation", source.orientation))


def acting_sources(sources: Sequence[Source], magnetic: bool) -> tuple[Source, ...]:
    """The sources that do something: without strength a source does nothing, and none acts on a membrane that is not magnetic."""
    return tuple(s for s in sources if getattr(s, "strength", 1.0) != 0) if magnetic else ()


def components(source: Source, rho: Any, eta: Any) -> tuple[Any, Any, Any]:
    """The field of a source, which may be somebody's own.

    Raises
    ------
    InputError
        For an answer that is not three components.
    """
    found = source.field(rho, eta)
    parts = tuple(found) if hasattr(found, "__iter__") else (found,)
    if len(parts) != 3:
        allowed = f"field(rho, eta) answers three components (h_rho, h_z, h_theta); this one answers {len(parts)}"
        raise InputError("source", type(source).__name__, allowed)
    h_rho, h_z, h_theta = parts
    return h_rho, h_z, h_theta


def magnetic_field(sources: Sequence[Source], rho: Any, eta: Any) -> tuple[Any, Any, Any]:
    """Sum (h_rho, h_z, h_theta) of the fields of all sources at (rho, eta)."""
    fields = [components(source, rho, eta) for source in sources]
    return sum(f[0] for f in fields), sum(f[1] for f in fields), sum(f[2] for f in fields)


def magnetic_energy_density(sources: Sequence[Source], susceptibility: Any, rho: Any, eta: Any) -> Any:
    """-chi/2 |h|^2 per reference area, in units of mu T."""
    return -0.5 * susceptibility * field_intensity(sources, rho, eta)


def field_intensity(sources: Sequence[Source], rho: Any, eta: Any) -> Any:
    """|h|^2 of all sources together."""
    if len(sources) == 1:
        return sources[0].intensity(rho, eta)
    h_rho, h_z, h_theta = magnetic_field(sources, rho, eta)
    return h_rho**2 + h_z**2 + h_theta**2


def swept(before: Array, after: Array, circle: tuple[float, float]) -> bool:
    """Whether a meridian that moved between two polylines, shape (2, n) each, went through a circle around the axis.

    The circle was passed if it lies in the region between the polylines: then one of the quadrilaterals winds around it.
    """
    corners = np.stack([before[:, :-1], before[:, 1:], after[:, 1:], after[:, :-1]]) - np.array(circle)[:, None]
    x, y = corners[:, 0], corners[:, 1]
    angle = np.arctan2(x * np.roll(y, -1, 0) - y * np.roll(x, -1, 0), x * np.roll(x, -1, 0) + y * np.roll(y, -1, 0))
    return bool((np.abs(angle.sum(axis=0)) > math.pi).any())


def distance_to_polyline(rho: Array, eta: Array, circle: tuple[float, float]) -> float:
    """Smallest distance of a point of the half-plane (a circle around the axis) from a meridian of straight pieces, shape (n,) each."""
    points = np.stack([rho, eta])
    along = np.diff(points)  # before the points are moved: far from the circle neighbours would round to one point
    ends = points - np.array(circle)[:, None]
    share = np.clip(-(ends[:, :-1] * along).sum(axis=0) / (along**2).sum(axis=0), 0, 1)
    return float(np.hypot(*(ends[:, :-1] + share * along)).min())
