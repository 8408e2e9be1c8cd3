"""Magnetised sheets beyond the weak field: self-field, saturation, remanence.

With h the field of the sources (strengths included), h_t its part in the surface, h_n its part along the normal, and m the magnetisation of
the sheet, all in units of sqrt(mu/mu0), a thin sheet has per reference area, in units of mu T and to leading order in T/R0, the energy ::

    D = min over the induced part of m of      U*(induced) - m.h + [m_n^2/2]

The bracket is the **self-field** (``demagnetization``): the normal flux density is continuous across a thin sheet, so that inside
H_n = h_n - m_n. The tangential field is continuous, H_t = h_t. Without the bracket (the weak field of the paper) H = h.

========================  ==================================================================================================
linear                    -chi/2 (h_t^2 + h_n^2/(1 + chi)), without self-field -chi/2 |h|^2
saturation                -(Ms^2/(3 chi)) log(sinh x/x), x = 3 chi |H|/Ms (Langevin 1905). With self-field H_n is the root of
                          H_n + m_n(H) = h_n, and -(h_n - H_n)^2/2 is added: the minimum above, exactly
remanence                 -m_0.h beside the induced part, which then feels h_n - m_0n. With self-field, m_0n^2/2 is added
========================  ==================================================================================================

The self-field screens a normal remanence as it screens a normal field: the minimum above leaves no choice. With a susceptibility and
self-field the remanence so becomes -m_0 h_n/(1 + chi).

The remanence m_0 is carried by the sheet: along the normal, positive to where the pressure pushes, or along the meridian from its first
end. Both ways of carrying it are in the literature:

==========  ========================  =======================  ==========================================================
transport   normal                    meridional               m
==========  ========================  =======================  ==========================================================
deformed    -m_0 h_n/(l1 l2)          -m_0 l1 h_t              F m_0 (R. Zhao, Y. Kim, S. A. Chester, P. Sharma, X. Zhao,
                                                               J. Mech. Phys. Solids 124, 2019)
rotated     -m_0 h_n                  -m_0 h_t                 R m_0, with R the rotation in F = R U (D. Mukherjee,
                                                               M. Rambausek, K. Danas, J. Mech. Phys. Solids 151, 2021)
==========  ========================  =======================  ==========================================================

Of a sheet whose energy depends on h_n the couple on the magnetisation turns the sheet: the slope of the meridian enters, and with it the
forces, the Legendre-Hadamard condition and the second variation. The formulas here take NumPy arrays and CasADi symbols alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from .along import Along
from .magnetics import Source, acting_sources, field_intensity, magnetic_energy_density

DIRECTIONS = ("normal", "meridional")
TRANSPORTS = ("deformed", "rotated")

#: below this x^2 the logarithm of sinh x/x is its Taylor series, c_k = 2^(2k) B_2k/(2k (2k)!): 16 terms are round-off there
_CUT = 1.0
_SERIES = (
    *(0.16666666666666666, -0.005555555555555556, 0.0003527336860670194, -2.6455026455026456e-05),
    *(2.1377799155576935e-06, -1.803670234005331e-07, 1.5661391322766983e-08, -1.3884130493737299e-09),
    *(1.2504359176004997e-10, -1.1402575602296091e-11, 1.0502923908637557e-12, -9.754877841593701e-14),
    *(9.123468230859098e-15, -8.5837197618956095e-16, 8.117318009727789e-17, -7.710527514116273e-18),
)
#: Newton steps for the normal field inside a saturated sheet: 4e-12 of it for chi from 1e-3 to 1e6
_STEPS = 10


@dataclass(frozen=True)
class Magnetisation:
    """How a sheet is magnetised, where it is more than a susceptibility in a weak field.

    Attributes
    ----------
    susceptibility : float
        chi >= 0; a CasADi symbol in a family of scenes.
    demagnetization : bool
    saturation : float or None
        mu0 Ms/sqrt(mu mu0).
    remanence : float, Along or None
        m_0 in units of sqrt(mu/mu0), as a flux density in units of sqrt(mu mu0).
    direction, transport : str
        Of the remanence.
    """

    susceptibility: Any
    demagnetization: bool
    saturation: Any
    remanence: Any
    direction: str
    transport: str

    @classmethod
    def of(cls, scene: Any) -> Self | None:
        """That of a scene; None in a weak field, or where nothing is magnetised."""
        soft = _acts(scene.susceptibility)
        hard = _acts(scene.remanence)
        if not (hard or (soft and (scene.demagnetization or scene.saturation is not None))):
            return None
        return cls(
            scene.susceptibility if soft else 0.0,
            bool(scene.demagnetization),
            scene.saturation if soft else None,
            scene.remanence if hard else None,
            scene.remanence_direction or "normal",
            scene.remanence_transport or "deformed",
        )

    @property
    def tilts(self) -> bool:
        """Whether the energy depends on the slope of the meridian; without it depends on the position alone, as in a weak field."""
        return self.demagnetization or self.remanence is not None

    @property
    def relaxes(self) -> bool:
        """Whether relaxing the strain energy alone relaxes the whole: the rest depends on the position, or is linear in F."""
        carried = self.remanence is None or (self.direction, self.transport) == ("meridional", "deformed")
        return carried and not self.demagnetization

    @property
    def normal(self) -> bool:
        """Whether there is a remanence along the normal."""
        return self.remanence is not None and self.direction == "normal"

    @property
    def turns(self) -> bool:
        """Whether a sphere is the same when its material has turned under its shape."""
        return self.remanence is None or (self.normal and not isinstance(self.remanence, Along))

    @property
    def meridional(self) -> bool:
        """Whether there is a remanence along the meridian: in an axial field such a sheet has a cone at its pole."""
        return self.remanence is not None and self.direction == "meridional"

    def soft(self, tangential: Any, normal: Any) -> Law:
        """Energy of the induced magnetisation in a field with |h_t|^2 and h_n, with its derivatives.

        Parameters
        ----------
        tangential, normal : float, ndarray or CasADi symbol
            |h_t|^2 and h_n; of a sheet with self-field and a normal remanence h_n - m_0n.
        """
        chi = self.susceptibility
        if self.saturation is None:
            inside = chi / (1 + chi) if self.demagnetization else chi
            value = -(chi * tangential + inside * normal**2) / 2
            return Law(value, -chi / 2, -inside * normal, 0.0, 0.0, -inside)
        if not self.demagnetization:
            value, slope, curvature = langevin(tangential + normal**2, chi, self.saturation)
            return Law(value, slope, 2 * normal * slope, curvature, 2 * normal * curvature, 2 * slope + 4 * normal**2 * curvature)
        H = self._inside(tangential, normal)
        value, slope, curvature = langevin(tangential + H**2, chi, self.saturation)
        m, d = -2 * slope, -2 * curvature  # mu and its derivative with respect to the square of H
        q = 1 + m + 2 * H**2 * d
        return Law(value - (m * H) ** 2 / 2, slope, -m * H, -d / 2 * (1 + m) / q, -d * H / q, -(m + 2 * H**2 * d) / q)

    def _inside(self, tangential: Any, normal: Any) -> Any:
        """H_n inside a saturated sheet: the root of H_n (1 + mu(|H|^2)) = h_n, by Newton's method from that of the linear law."""
        H = normal / (1 + self.susceptibility)
        for _ in range(_STEPS):
            _, slope, curvature = langevin(tangential + H**2, self.susceptibility, self.saturation)
            H = H - (H * (1 - 2 * slope) - normal) / (1 - 2 * slope - 4 * H**2 * curvature)
        return H

    def moments(self, h_t: Any, h_n: Any, around: Any, stretches: tuple[Any, Any], remanence: Any) -> tuple[Any, ...]:
        """Magnetisation and field inside at points of a meridian, and what stretching does to the energy at fixed rotation.

        Parameters
        ----------
        h_t, h_n, around : ndarray
            Parts of the field along the meridian, along the normal and around the axis.
        stretches : (ndarray, ndarray)
            lambda_1, lambda_2.
        remanence : ndarray
            m_0 at the points.

        Returns
        -------
        m_t, m_theta, m_n, H_n, d_1, d_2 : ndarray
            d_i = lambda_i dD/dlambda_i at fixed h.
        """
        l1, l2 = stretches
        carried = self.transport == "deformed"
        m0t = m0n = 0.0 * h_n
        if self.remanence is not None and self.normal:
            m0n = remanence / (l1 * l2) if carried else remanence + m0n
        elif self.remanence is not None:
            m0t = remanence * l1 if carried else remanence + m0t
        law = self.soft(h_t**2 + around**2, h_n - m0n if self.demagnetization else h_n)
        mu = -2 * law.by_tangential
        m_t, m_theta, m_n = mu * h_t + m0t, mu * around, m0n - law.by_normal
        H_n = h_n - m_n if self.demagnetization else h_n
        d1, d2 = (m0n * H_n - m0t * h_t, m0n * H_n) if carried else (0.0 * H_n, 0.0 * H_n)
        return m_t, m_theta, m_n, H_n, d1, d2


@dataclass(frozen=True)
class Law:
    """An energy as a function of |h_t|^2 and h_n, with its first and second derivatives."""

    value: Any
    by_tangential: Any
    by_normal: Any
    by_tangential_twice: Any
    by_both: Any
    by_normal_twice: Any


def langevin(square: Any, susceptibility: Any, saturation: Any) -> tuple[Any, Any, Any]:
    """-(Ms^2/(3 chi)) log(sinh x/x), x^2 = 9 chi^2 |H|^2/Ms^2, and its first two derivatives with respect to |H|^2.

    Only squares enter, and nothing cancels at any x.

    Parameters
    ----------
    square : float, ndarray or CasADi symbol
        |H|^2.
    susceptibility, saturation : float or CasADi symbol
        chi, and mu0 Ms/sqrt(mu mu0).

    Examples
    --------
    For small fields -chi |H|^2/2, for large ones -Ms |H|:

    >>> [round(float(langevin(H**2, 2.5, 3.0)[0]), 6) for H in (1e-3, 1e3)]
    [-1e-06, -2990.279466]
    """
    k = 9 * susceptibility**2 / saturation**2
    value, slope, curvature = _log_sinhc(k * square)
    c = saturation**2 / (3 * susceptibility)
    return -c * value, -3 * susceptibility * slope, -3 * susceptibility * k * curvature


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def _log_sinhc(y: Any) -> tuple[Any, Any, Any]:
    """log(sinh x/x) with y = x^2, and its first two derivatives with respect to y.

    Written with products of truth values. Both branches are evaluated everywhere, each at an argument that it allows.
    """
    small = y < _CUT
    a = small * y
    b = small + (1 - small) * y
    series = [_horner([c * _falling(k, d) for k, c in enumerate(_SERIES, 1) if k >= d], a) for d in (1, 2)]
    x = np.sqrt(b)
    less = -np.expm1(-2 * x)  # 1 - exp(-2x)
    coth = (2 - less) / less
    L = coth - 1 / x
    large = (x + np.log(less) - np.log(2 * x), L / (2 * x), ((1 / b - (coth**2 - 1)) - L / x) / (4 * b))
    short = (a * _horner(list(_SERIES), a), *series)
    value, slope, curvature = (small * p + (1 - small) * q for p, q in zip(short, large, strict=True))
    return value, slope, curvature


def _falling(k: int, times: int) -> int:
    return k if times == 1 else k * (k - 1)


def _horner(coefficients: list[float], y: Any) -> Any:
    total: Any = coefficients[-1]
    for c in reversed(coefficients[:-1]):
        total = c + y * total
    return total


def position_energy_density(sources: Sequence[Source], susceptibility: Any, saturation: Any, rho: Any, eta: Any) -> Any:
    """Energy per reference area of a sheet without self-field and remanence, in units of mu T: a function of the position."""
    if saturation is None:
        return magnetic_energy_density(sources, susceptibility, rho, eta)
    return langevin(field_intensity(sources, rho, eta), susceptibility, saturation)[0]


def _acts(value: Any) -> bool:
    """Whether a number, a factor along the meridian or a symbol is there and not 0."""
    return value is not None and not (isinstance(value, (int, float)) and value == 0)


def sources_that_act(scene: Any) -> tuple[Source, ...]:
    """The sources of a scene that do something to its membrane."""
    return acting_sources(scene.sources, _acts(scene.susceptibility) or _acts(scene.remanence))


def seen_by(scene: Any) -> frozenset[str]:
    """Motions of the whole membrane that its sources notice; with a dependence on slopes every field notices a tilt."""
    sources = sources_that_act(scene)
    magnetisation = Magnetisation.of(scene)
    tilted = {"tilt"} if sources and magnetisation is not None and magnetisation.tilts else set()
    return frozenset(tilted).union(*(source.sees for source in sources))


def remanence_column(magnetisation: Magnetisation | None, R: Any, Z: Any, s: Any, side: int) -> Any:
    """The remanence at points of the meridian; None where there is none.

    A normal one points to where the pressure pushes: ``side`` is 1 where that is the side of the normal (-Z', R'), else -1.
    """
    if magnetisation is None or magnetisation.remanence is None:
        return None
    given = magnetisation.remanence
    values = np.array(given.at(R, Z, s)) if isinstance(given, Along) else given + 0.0 * s
    return side * values if magnetisation.normal else values
