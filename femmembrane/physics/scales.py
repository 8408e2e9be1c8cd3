"""Physical scales of a membrane: between the non-dimensional quantities of a scene and SI units.

=====================  ====================  =========
quantity               unit                  SI
=====================  ====================  =========
``length``             R0                    m
``volume``             R0^3                  m^3
``pressure``           mu T/R0               Pa
``stress``             mu                    Pa
``energy``             mu T R0^2             J
``force``              mu T R0               N
``area``               R0^2                  m^2
``field``              sqrt(mu/mu0)          A/m
``weight``             mu/(g R0)             kg/m^3
``gamma``              mu T/(g R0^2)         kg/m^3
``dipole_strength``    see below             A m^2
``remanence``          sqrt(mu mu0)          T
``magnetization``      sqrt(mu/mu0)          A/m
``wire_strength``      see below             A
``uniform_strength``   see below             T
=====================  ====================  =========

``weight`` and ``gamma`` are the numbers of the loads ``Weight`` and ``Hydrostatic``: densities, with the standard gravity g.

A dipole of the physical moment m has the strength M = mu0 D^2/(R0^6 mu) with D = m/(4 pi) (paper eq. 33). So M = (m/m_0)^2 with
m_0 = 4 pi R0^3 sqrt(mu/mu0). A wire with the current I has M = (I/I_0)^2 with I_0 = 2 pi R0 sqrt(mu/mu0), and a uniform flux
density B has M = (B/B_0)^2 with B_0 = sqrt(mu mu0).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from ..checks import as_float, choice, is_number
from ..errors import InputError
from ..quantities import SI_UNITS
from .magnetics import Dipole
from .units import has_unit, in_unit

#: strengths are squares of what is measured
SQUARED = ("dipole_strength", "wire_strength", "uniform_strength")
#: kinds whose units must be numbers in every scene; others when they are asked for
_ALWAYS = ("length", "volume", "pressure", "stress", "energy")
#: relative difference up to which two numbers that say the same thing agree
AGREEMENT = 1e-9

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scales:
    """The physical size, thickness and stiffness of a membrane (units of Saxena et al. 2019, eq. 33).

    Parameters
    ----------
    radius : float or str
        R0 in m, or with its unit: "25 mm". So are the others.
    thickness : float or str
        Reference thickness T in m.
    shear_modulus : float or str
        Ground-state shear modulus mu in Pa.
    dipole_moment : float or str, optional
        Magnetic moment m > 0 of a dipole in A m^2; its sense is the orientation of the dipole.

    Raises
    ------
    InputError
        For a value that is not a finite number > 0, and when a unit that follows from them is beyond the range of a float.

    Examples
    --------
    A membrane of rubber with a radius of 10 cm and a thickness of 1 mm; the unit of pressure is mu T/R0:

    >>> import femmembrane as fm
    >>> scales = fm.Scales(radius=0.1, thickness=1e-3, shear_modulus=4e5)
    >>> round(scales.to_si("pressure", 1.5), 1), round(scales.from_si("length", 0.05), 3)
    (6000.0, 0.5)
    """

    radius: float
    thickness: float
    shear_modulus: float
    dipole_moment: float | None = None

    def __post_init__(self) -> None:
        unit = {"radius": "m", "thickness": "m", "shear_modulus": "Pa", "dipole_moment": "A m^2"}
        for name in (f.name for f in fields(self)):
            value = getattr(self, name)
            if name == "dipole_moment" and value is None:
                continue
            if has_unit(value):
                value = in_unit(f"scales.{name}", value, unit[name])[0]
            if not (is_number(value) and as_float(value) > 0):  # of any size: what follows from them is what counts
                raise InputError(f"scales.{name}", value, f"a finite number > 0 is allowed (in {unit[name]})")
            object.__setattr__(self, name, float(value))
        for quantity in _ALWAYS:
            self._unit(quantity)
        self._in_range("radius over thickness", self.radius_to_thickness)
        if self.dipole_moment is not None:
            ratio = self.dipole_moment / self._unit("dipole_strength")
            self._in_range("the strength of dipole_moment", ratio * ratio)

    @property
    def radius_to_thickness(self) -> float:
        """R0/T."""
        return self.radius / self.thickness

    @property
    def strength(self) -> float:
        """Strength M of a dipole with the moment ``dipole_moment``.

        Raises
        ------
        InputError
            When no moment is given.
        """
        if self.dipole_moment is None:
            raise InputError("scales.dipole_moment", None, "missing; give the moment of the dipole in A m^2, and its strength follows")
        return self.from_si("dipole_strength", self.dipole_moment)

    @staticmethod
    def units(quantity: str) -> str:
        """The SI unit of a quantity.

        Parameters
        ----------
        quantity : str
            One of the table of this module.

        Raises
        ------
        InputError
            For an unknown quantity.
        """
        _check_quantity(quantity)
        return SI_UNITS[quantity]

    @overload
    def to_si(self, quantity: str, value: float) -> float: ...

    @overload
    def to_si(self, quantity: str, value: NDArray[Any] | Sequence[Any]) -> Array: ...

    def to_si(self, quantity: str, value: Any) -> float | Array:
        """A non-dimensional value in SI units. A dipole strength becomes a moment.

        Parameters
        ----------
        quantity : str
            One of the table of this module.
        value : float or array_like
            In the units of the package; volumes and energies with the 2 pi.

        Returns
        -------
        float or ndarray
            In ``units(quantity)``, of the shape of ``value``.

        Raises
        ------
        InputError
            For an unknown quantity, a value that is no number or too large for a float in SI units, or a negative dipole strength.
        """
        given = _values(quantity, value, value)
        with np.errstate(over="ignore"):
            return _converted(value, given, (np.sqrt(given) if quantity in SQUARED else given) * self._unit(quantity))

    @overload
    def from_si(self, quantity: str, value: float | str) -> float: ...

    @overload
    def from_si(self, quantity: str, value: NDArray[Any] | Sequence[Any]) -> Array: ...

    def from_si(self, quantity: str, value: Any) -> float | Array:
        """A value in SI units as a non-dimensional number: the inverse of :meth:`to_si`.

        Parameters
        ----------
        quantity : str
            One of the table of this module.
        value : float, array_like or str
            In ``units(quantity)``; for a dipole strength, the moment. A text has its unit with it: "5 kPa", "20 mm".

        Returns
        -------
        float or ndarray
            In the units of the package, of the shape of ``value``.

        Raises
        ------
        InputError
            For an unknown quantity, a value that is no number or too large for a float without its unit, a unit of another kind, or a
            negative moment (the sense of a moment is the orientation of its dipole).
        """
        _check_quantity(quantity)
        given = _values(quantity, value, in_unit("value", value, SI_UNITS[quantity])[0] if has_unit(value) else value)
        with np.errstate(over="ignore"):
            ratio = given / self._unit(quantity)
            return _converted(value, given, ratio * ratio if quantity in SQUARED else ratio)

    def converts(self, quantity: str) -> bool:
        """Whether a quantity is one of the table of this module.

        Parameters
        ----------
        quantity : str
        """
        return quantity in SI_UNITS

    def fits(self, sources: Iterable[Any]) -> bool:
        """Whether one of the sources has the moment ``dipole_moment``, to 1e-9 of its strength; true where no moment is given.

        Parameters
        ----------
        sources : iterable of Source
        """
        if self.dipole_moment is None:
            return True
        strengths = [source.strength for source in sources if isinstance(source, Dipole)]
        return any(math.isclose(strength, self.strength, rel_tol=AGREEMENT) for strength in strengths)

    def _unit(self, quantity: str) -> float:
        R, T, mu = self.radius, self.thickness, self.shear_modulus
        if quantity in _ALWAYS:
            unit = {"length": R, "volume": R * R * R, "pressure": mu * T / R, "stress": mu, "energy": mu * T * R * R}[quantity]
        else:
            from scipy.constants import g, mu_0  # here, so that reading a scene without them need not wait for it

            field = math.sqrt(mu / mu_0)
            unit = {
                "force": mu * T * R,
                "area": R * R,
                "field": field,
                "weight": mu / g / R,
                "gamma": mu * T / R / g / R,
                "dipole_strength": 4 * math.pi * R * R * R * field,
                "wire_strength": 2 * math.pi * R * field,
                "uniform_strength": mu_0 * field,
                "remanence": mu_0 * field,
                "magnetization": field,
            }[quantity]
        return self._in_range(f"the unit of {quantity}", unit)

    def _in_range(self, what: str, number: float) -> float:
        if not 0 < number < math.inf:
            raise InputError("scales", self, f"{what} would be {number:g}; radius and thickness in m and shear_modulus in Pa are allowed")
        return number


def _check_quantity(quantity: Any) -> None:
    choice("quantity", quantity, SI_UNITS)


def _values(quantity: str, value: Any, measured: Any) -> Array:
    """Numbers as an array; ``value`` is what the user wrote, for errors."""
    _check_quantity(quantity)
    try:
        array = np.asarray(measured)
    except ValueError:  # rows of different lengths
        raise InputError("value", value, "a number or an array of numbers is allowed") from None
    if array.dtype.kind not in "iuf":
        raise InputError("value", value, "a number or an array of numbers is allowed")
    if quantity in SQUARED and not (array >= 0).all():
        raise InputError(
            "value", value, "a strength, moment, current or flux density >= 0 is allowed; its sense is the orientation of the source"
        )
    return array.astype(np.float64)


def _converted(value: Any, given: Array, result: Any) -> float | Array:
    if (np.isinf(result) & np.isfinite(given)).any():
        raise InputError("value", value, "a value is allowed that a float can hold in the other unit as well")
    return result if np.ndim(result) else float(result)
