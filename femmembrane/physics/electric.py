"""Voltage and charge on a membrane whose faces carry compliant electrodes: an ideal dielectric.

Per reference area, in units of mu T, with J = lambda_1 lambda_2 and the thickness t over T::

    voltage         -phi^2/2 J^2/t                                  phi^2 = eps (Phi/T)^2/mu
    total charge    +Q^2/(2 C),  C = Int J^2/t dA                   Q = Q_phys/(R0^2 sqrt(eps mu)) = phi C
    frozen charge   +q^2/2 t/J^2                                    q = q_phys/sqrt(eps mu), per reference area

The true field is J phi/t, or q/J, in units of sqrt(mu/eps). A total charge sits on electrodes that conduct,
so that one voltage, Q/C, belongs to it; a frozen charge is sprayed and moves with the material. All that is local depends on the two
stretches alone: the term changes the response of the material, by the Maxwell stress of the field squared in both directions
(:mod:`.response`).

Sources: R. A. Toupin, J. Rational Mech. Anal. 5 (1956); Z. Suo, Acta Mech. Solida Sin. 23 (2010), for ideal dielectric elastomers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import number, store
from ..errors import InputError

Array = NDArray[np.float64]

#: what may act on the electrodes, one at a time, with the words of messages
LOADS: Mapping[str, str] = {"voltage": "voltage", "total_charge": "total charge", "frozen_charge": "frozen charge"}


@dataclass(frozen=True)
class ElectricScales:
    """Scales with the permittivity of a dielectric: they also convert :data:`~femmembrane.quantities.ELECTRIC_UNITS`.

    Parameters
    ----------
    scales : Scales
    electric : Mapping[str, float]
        V, C, F and V/m of the unit of each of these kinds.
    """

    scales: Any
    electric: Mapping[str, float]

    def converts(self, quantity: str) -> bool:
        """Whether a quantity is electric, or one of :class:`~femmembrane.Scales`."""
        return quantity in self.electric or bool(self.scales.converts(quantity))

    def to_si(self, quantity: str, value: Any) -> Any:
        """A non-dimensional value in SI units; see :meth:`.Scales.to_si`."""
        if quantity in self.electric:
            return self.electric[quantity] * value
        return self.scales.to_si(quantity, value)


@dataclass(frozen=True)
class Electric:
    """A voltage or a charge on the faces of a membrane.

    Exactly one of the first three is given. Without ``relative_permittivity`` they are the numbers phi, Q and q of the top of this module.
    With it, in a scene with scales, they are in V, C and C/m^2, and ``breakdown`` in V/m.

    Parameters
    ----------
    voltage : float, optional
        phi = (Phi/T) sqrt(eps/mu) >= 0.
    total_charge : float, optional
        Q >= 0, the charge of conducting electrodes.
    frozen_charge : float, optional
        q >= 0, charge per reference area that moves with the material.
    start, stop : float, optional
        Places along the meridian between which the electrodes are (``from`` and ``to`` in a scene file): the reference radius of a flat
        shape, the arc length of any other. Left out: its ends. Elements end there.
    breakdown : float, optional
        Field > 0 at which the material fails, for comparison.
    relative_permittivity : float, optional
        Permittivity over that of free space, >= 1.

    Raises
    ------
    InputError
        For none or several of voltage, total charge and frozen charge, a negative one, or places in the wrong order.

    Examples
    --------
    >>> import femmembrane as fm
    >>> plain = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16))
    >>> for phi in (0.0, 0.3):
    ...     print(f"{fm.equilibrium(plain.replace(electric=fm.Electric(voltage=phi)), volume=1.5).pressure:.4f}")
    1.5841
    1.2700
    """

    voltage: float | None = None
    total_charge: float | None = None
    frozen_charge: float | None = None
    start: float | None = None
    stop: float | None = None
    breakdown: float | None = None
    relative_permittivity: float | None = None

    def __post_init__(self) -> None:
        given = [name for name in LOADS if getattr(self, name) is not None]
        if not given:
            raise InputError("electric.voltage", None, "missing; one of voltage, total_charge and frozen_charge is allowed")
        if len(given) > 1:
            advice = f"not together with {given[0]}: one of voltage, total_charge and frozen_charge is allowed on one electrode"
            raise InputError(f"electric.{given[1]}", getattr(self, given[1]), advice)
        name = given[0]
        allowed = "a finite number >= 0 is allowed (its sense changes nothing)"
        values: dict[str, Any] = {name: number(f"electric.{name}", getattr(self, name), allowed, least=0)}
        for end in ("start", "stop"):
            if getattr(self, end) is not None:
                values[end] = number(
                    f"electric.{_KEYS[end]}", getattr(self, end), "a place along the meridian, a finite number, is allowed"
                )
        if self.breakdown is not None:
            values["breakdown"] = number("electric.breakdown", self.breakdown, "a finite number > 0 is allowed (a field)", above=0)
        if self.relative_permittivity is not None:
            values["relative_permittivity"] = number(
                "electric.relative_permittivity", self.relative_permittivity, "a finite number >= 1 is allowed", least=1
            )
        store(self, **values)
        if self.start is not None and self.stop is not None and not self.start < self.stop:
            raise InputError("electric.to", self.stop, f"a place beyond electric.from = {self.start:.6g} is allowed")

    @property
    def load(self) -> str:
        """What is given: the name of one of the first three parameters."""
        return next(name for name in LOADS if getattr(self, name) is not None)

    @property
    def ends(self) -> tuple[float, ...]:
        """Places where electrodes end within the membrane."""
        return tuple(place for place in (self.start, self.stop) if place is not None)

    def check(self, first: float, last: float) -> None:
        """Refuse electrodes that do not lie on a meridian.

        Parameters
        ----------
        first, last : float
            Places of its ends.

        Raises
        ------
        InputError
        """
        for end in ("start", "stop"):
            place = getattr(self, end)
            if place is not None and not first <= place <= last:
                advice = f"a place on the meridian is allowed: from {first:.6g} to {last:.6g}"
                raise InputError(f"electric.{_KEYS[end]}", place, advice)
        if (self.start is not None and self.start == last) or (self.stop is not None and self.stop == first):
            end = "start" if self.start == last else "stop"
            raise InputError(f"electric.{_KEYS[end]}", getattr(self, end), "the electrode would have no width")
        width = (last if self.stop is None else self.stop) - (first if self.start is None else self.start)
        if width < _NARROW * (last - first):
            end = "start" if self.stop is None else "stop"
            advice = f"the electrode would be {width:.2g} wide; {_NARROW:g} of the length of the meridian, or more, is allowed"
            raise InputError(f"electric.{_KEYS[end]}", getattr(self, end), advice)

    def covers(self, s: Array) -> Array:
        """1 on the electrodes, 0 elsewhere; their first end belongs to them, and their last one does not.

        Parameters
        ----------
        s : ndarray
            Places along the meridian.
        """
        low = -math.inf if self.start is None else self.start
        high = math.inf if self.stop is None else self.stop
        return ((s >= low) & (s < high)).astype(float)

    def units(self, scales: Any) -> dict[str, float]:
        """SI units of voltage, charges and field for a scene with scales.

        Parameters
        ----------
        scales : Scales or None

        Raises
        ------
        InputError
            Without scales, or for units beyond the range of a float.
        """
        if scales is None:
            allowed = "allowed in a scene with scales (radius, thickness, shear_modulus), which turn volts into numbers"
            raise InputError("electric.relative_permittivity", self.relative_permittivity, allowed)
        from scipy.constants import epsilon_0

        permittivity = epsilon_0 * float(self.relative_permittivity or 1.0)
        strength = math.sqrt(scales.shear_modulus / permittivity)
        density = math.sqrt(scales.shear_modulus * permittivity)
        units = {
            "voltage": strength * scales.thickness,
            "total_charge": density * scales.radius * scales.radius,
            "frozen_charge": density,
            "breakdown": strength,
        }
        for name, unit in units.items():
            if not 0 < unit < math.inf:
                advice = f"the unit of electric.{name} would be {unit:g}; radius and thickness in m and shear_modulus in Pa are allowed"
                raise InputError("scales", scales, advice)
        return units

    def converter(self, scales: Any) -> Any:
        """What turns numbers of a scene into SI units; None without scales.

        Parameters
        ----------
        scales : Scales or None
            Those of the scene; volts need a ``relative_permittivity`` as well.
        """
        if scales is None or self.relative_permittivity is None:
            return scales
        units = self.units(scales)
        voltage, charge = units["voltage"], units["total_charge"]
        return ElectricScales(
            scales, {"voltage": voltage, "charge": charge, "capacitance": charge / voltage, "electric_field": units["breakdown"]}
        )

    def plain(self, scales: Any) -> Electric:
        """The same as numbers without units.

        Parameters
        ----------
        scales : Scales or None
            Those of the scene; only units ask for them.
        """
        if self.relative_permittivity is None:
            return self
        units = self.units(scales)
        changes = {name: getattr(self, name) / unit for name, unit in units.items() if getattr(self, name) is not None}
        return replace(self, relative_permittivity=None, **changes)


#: width of an electrode over the length of the meridian that no element can have
_NARROW = 1e-9
_KEYS = {"start": "from", "stop": "to"}
