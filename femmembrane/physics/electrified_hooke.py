"""Hooke's law under a voltage or a frozen charge: the field also presses the sheet thin, and the thickness follows from both.

In three dimensions Hooke's law with Green strains is W(E_1, E_2) + (E_3 - E_3')^2/(2 k), with the energy W and the thickness strain
E_3' = -kappa (E_1 + E_2) of plane stress, kappa = nu/(1 - nu) and k = (1 - 2 nu)/(2 (1 - nu)) in units of the shear modulus. A capacitor
with the thickness lambda_3 = sqrt(1 + 2 E_3) and the area J = lambda_1 lambda_2 has J/lambda_3, which is J^2 over the volume ratio
J lambda_3. So per thickness ::

    voltage         h = -psi^2/2 J/lambda_3,     g = dh/dE_3 =  psi^2/2 J/lambda_3^3
    frozen charge   h =  q^2/2 lambda_3/J,       g = dh/dE_3 =  q^2/2 /(J lambda_3)

Nothing acts across the sheet but the field: E_3 = E_3' - k g. By the envelope theorem the effective stress is the derivative at fixed E_3::

    s_i = dW/de_i - kappa g lambda_i^2 +- h         (+ voltage, - charge: dh/de_i)

The root next to E_3' is the stable one. There is none where the field exceeds what the thickness withstands (1 < 3 k g/lambda_3^2 for a
voltage): the sheet pulls in across, and the answers are NaN. At nu = 1/2 k is 0. For small strains that is the Maxwell stress of an
incompressible sheet, half of it along the sheet, half by what is pressed out of the thickness.

Sources: R. A. Toupin, J. Rational Mech. Anal. 5 (1956), for elastic dielectrics; X. Zhao, W. Hong and Z. Suo, Phys. Rev. B 76 (2007), for
pull-in across the thickness.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .electrified import Electrified

#: Newton steps to the thickness: they approach it from one side
_STEPS = 8
#: correction of the thickness strain that counts as none
_CONVERGED = 1e-10


@dataclass(frozen=True, eq=False)
class ElectrifiedHooke(Electrified):
    """The response of :class:`~.hooke.Hooke` under a field, with the thickness in balance."""

    @property
    def _constants(self) -> tuple[float, float]:
        """kappa and k."""
        nu = self.material.poisson_ratio  # type: ignore[attr-defined]
        return nu / (1 - nu), (1 - 2 * nu) / (2 * (1 - nu))

    @property
    def _charged(self) -> bool:
        return not (isinstance(self.charge, float) and self.charge == 0)

    def _pressing(self, J: Any, thin: Any) -> Any:
        """g, from the square ``thin`` of the thickness ratio."""
        if self._charged:
            return self.charge / 2 / (J * np.sqrt(thin))
        return self.voltage / 2 * J / (thin * np.sqrt(thin))

    def _thickness(self, e1: Any, e2: Any) -> tuple[Any, Any, Any, Any, Any]:
        """lambda_1^2, lambda_2^2, J, lambda_3^2 and g; NaN where no thickness withstands the field."""
        kappa, k = self._constants
        q1, q2, J = np.exp(2 * e1), np.exp(2 * e2), np.exp(e1 + e2)
        free = 1 - kappa * (np.expm1(2 * e1) + np.expm1(2 * e2))
        power = 1 if self._charged else 3
        with np.errstate(invalid="ignore", divide="ignore"):
            thin, g = free, self._pressing(J, free)
            if not (isinstance(k, float) and k == 0):  # it may be a symbol
                for _ in range(_STEPS):
                    thin = thin - (thin - free + 2 * k * g) / (1 - power * k * g / thin)
                    g = self._pressing(J, thin)
                off = thin - free + 2 * k * g
                held = (power * k * g < thin) * (off * off <= (_CONVERGED * thin) ** 2)
                thin = thin * np.sqrt(2.0 * held - 1)  # 1, or NaN
        return q1, q2, J, thin, g

    def _field_energy(self, J: Any, thin: Any) -> Any:
        """h."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.charge / 2 * np.sqrt(thin) / J if self._charged else -self.voltage / 2 * J / np.sqrt(thin)

    def energy(self, e1: Any, e2: Any) -> Any:
        g = self._thickness(e1, e2)[4]
        return self.material.energy(e1, e2) + self._constants[1] / 2 * g * g

    def electric_energy(self, e1: Any, e2: Any) -> Any:
        _, _, J, thin, _ = self._thickness(e1, e2)
        return self._field_energy(J, thin)

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        s1, s2 = self.mechanical_force(e1, e2)
        _, _, J, thin, _ = self._thickness(e1, e2)
        maxwell = np.fabs(self._field_energy(J, thin))
        return s1 - maxwell, s2 - maxwell

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        kappa, k = self._constants
        d11, d12, d22 = self.material.tangent(e1, e2)
        q1, q2, J, thin, g = self._thickness(e1, e2)
        h, sense, power = np.fabs(self._field_energy(J, thin)), -1 if self._charged else 1, 1 if self._charged else 3
        share = 1 / (1 - power * k * g / thin)
        # dE_3/de_j over lambda_3^2, then relative rates of g and of |h|
        rate1, rate2 = (-(kappa * q + sense * k * g) * share / thin for q in (q1, q2))
        g1, g2 = (g * (sense - power * rate) for rate in (rate1, rate2))
        h1, h2 = (h * (sense - sense * rate) for rate in (rate1, rate2))
        return d11 - kappa * q1 * (g1 + 2 * g) - h1, d12 - kappa * q1 * g2 - h2, d22 - kappa * q2 * (g2 + 2 * g) - h2

    def mechanical_force(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        """dW/de_i of the material alone at the thickness in balance."""
        s1, s2 = self.material.stress(e1, e2)
        q1, q2, _, _, g = self._thickness(e1, e2)
        kappa = self._constants[0]
        return s1 - kappa * g * q1, s2 - kappa * g * q2

    def mechanical_stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        s1, s2 = self.mechanical_force(e1, e2)
        volume = self.volume_ratio(e1, e2)
        return s1 / volume, s2 / volume

    def volume_ratio(self, e1: Any, e2: Any) -> Any:
        """lambda_1 lambda_2 lambda_3."""
        _, _, J, thin, _ = self._thickness(e1, e2)
        with np.errstate(invalid="ignore"):
            return J * np.sqrt(thin)

    def field_squared(self, e1: Any, e2: Any) -> Any:
        _, _, J, thin, _ = self._thickness(e1, e2)
        return self.charge / (J * J) if self._charged else self.voltage / thin
