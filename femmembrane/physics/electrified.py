"""The response of a material under the field of a voltage, or of a frozen charge.

Per thickness and in units of the local modulus, with the field at rest psi = phi/t and the frozen charge q both over its root::

    v = psi^2 J^2,  f = q^2/J^2,     energy W - v/2 + f/2,     stress s_i - v - f,     tangent d_ij - 2 v + 2 f   (11, 12 and 22)

These effective stresses decide what the stresses of the material decide elsewhere: the Legendre-Hadamard condition and wrinkling (Zhao and
Suo 2007, for the moduli).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .materials import Material


@dataclass(frozen=True, eq=False)
class Electrified:
    """The response of a material under a field; itself a :class:`~.materials.Material`.

    Parameters
    ----------
    material : Material
    voltage, charge : float, ndarray or CasADi symbol
        psi^2 and q^2 at the points.
    """

    material: Material
    voltage: Any
    charge: Any

    def _maxwell(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        """v and f, of which one is 0."""
        if isinstance(self.charge, float) and self.charge == 0:
            return self.voltage * np.exp(2 * (e1 + e2)), 0.0
        return 0.0, self.charge * np.exp(-2 * (e1 + e2))

    def energy(self, e1: Any, e2: Any) -> Any:
        """The strain energy: the electric one is reported apart."""
        return self.material.energy(e1, e2)

    def electric_energy(self, e1: Any, e2: Any) -> Any:
        v, f = self._maxwell(e1, e2)
        return (f - v) / 2

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        s1, s2 = self.material.stress(e1, e2)
        v, f = self._maxwell(e1, e2)
        return s1 - (v + f), s2 - (v + f)

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        s11, s12, s22 = self.material.tangent(e1, e2)
        v, f = self._maxwell(e1, e2)
        both = 2 * (f - v)
        return s11 + both, s12 + both, s22 + both

    def mechanical_stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        """Cauchy stresses of the material alone."""
        return self.material.stress(e1, e2)

    def field_squared(self, e1: Any, e2: Any) -> Any:
        """Square of the true field, over the modulus."""
        v, f = self._maxwell(e1, e2)
        return v + f
