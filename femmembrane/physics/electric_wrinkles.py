"""Tension field under voltage or frozen charge: wrinkles where the *effective* stress, less that of Maxwell, would be compressive.

The natural width of a strip now depends on the field. It is m(e) with ::

    s_2(e, m) = v + f,      d_22 - 2 v + 2 f > 0          (s, d of the material; v, f see :mod:`.electrified`)

the first one above the width without field, -e/2 where the volume stays, and the slack membrane has the strain e_0 with
s(e_0, e_0) = v + f. The natural strains are n_1 = max(e_1, m(max(e_2, e_0))), n_2 = max(e_2, m(max(e_1, e_0))); where one is natural, the
stress along the other has the tangent d_11 - d_12^2/d_22. For neo-Hookean material m = -e/2 - log(1 - psi^2 exp(2 e))/4.

This relaxation is local: the energy of a voltage has no lower bound. A natural width ceases to exist where the voltage pulls a strip wide;
a slack membrane does above a voltage of its own (phi^2 = 0.4725 for neo-Hookean material). There is no number there: the answers are NaN.

Sources: A. C. Pipkin, IMA J. Appl. Math. 36 (1986), for the relaxation; P. Greaney, M. Meere and G. Zurlo, J. Mech. Phys. Solids 122
(2019), for wrinkles of dielectric films.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .electrified import Electrified
from .tension_field import natural_width

#: Newton steps to a natural width and to the slack strain; they converge to round-off short of the ends of both
_STEPS, _SLACK_STEPS = 6, 8
#: correction of a natural strain that counts as none
_CONVERGED = 1e-8


@dataclass(frozen=True, eq=False)
class ElectricTensionField:
    """The relaxed response; itself a :class:`~.materials.Material`.

    Parameters
    ----------
    taut : Electrified
        The response of the membrane where it is taut.
    """

    taut: Electrified

    def slack_strain(self) -> tuple[Any, Any]:
        """e_0, and whether there is one."""
        with np.errstate(all="ignore"):  # where there is none Newton's method may go anywhere
            return self._slack_strain()

    def _slack_strain(self) -> tuple[Any, Any]:
        e: Any = self.taut.voltage * 0.0 + self.taut.charge * 0.0
        for _ in range(_SLACK_STEPS):
            stress, d11, d12 = self._along(e)
            slope = d11 + d12
            e = e - (slope > 0) * stress / (slope + (slope == 0))
        stress, d11, d12 = self._along(e)
        slope = d11 + d12
        return e, (slope > 0) * (stress * stress <= (_CONVERGED * slope) ** 2)

    def _along(self, e: Any) -> tuple[Any, Any, Any]:
        d11, d12, _ = self.taut.tangent(e, e)
        return self.taut.stress(e, e)[0], d11, d12

    def width(self, e: Any) -> tuple[Any, Any]:
        """m(e), and whether there is one."""
        with np.errstate(all="ignore"):
            return self._width(e)

    def _width(self, e: Any) -> tuple[Any, Any]:
        m = natural_width(self.taut.material)(e)[0]
        for _ in range(_STEPS):
            slope = self.taut.tangent(e, m)[2]
            m = m - self.taut.stress(e, m)[1] / (slope + (slope == 0))
        stress, slope = self.taut.stress(e, m)[1], self.taut.tangent(e, m)[2]
        return m, (slope > 0) * (stress * stress <= (_CONVERGED * slope) ** 2)

    def natural(self, e1: Any, e2: Any) -> tuple[Any, Any, Any, Any]:
        """Natural strains (n_1, n_2), and whether the membrane is taut along each direction."""
        slack, known = self.slack_strain()
        long1, long2 = e1 >= slack, e2 >= slack
        a1, a2 = long1 * e1 + (1 - long1) * slack, long2 * e2 + (1 - long2) * slack
        least1, exists1 = self.width(a2)
        least2, exists2 = self.width(a1)
        # beyond the end of the natural widths a membrane that is in tension across is taut, and no other has a state
        taut1 = exists1 * (e1 >= least1) + (1 - exists1) * (self.taut.stress(e1, a2)[0] >= 0)
        taut2 = exists2 * (e2 >= least2) + (1 - exists2) * (self.taut.stress(a1, e2)[1] >= 0)
        free = (1 - taut1) * (1 - taut2)
        least1, least2 = least1 + free * (slack - least1), least2 + free * (slack - least2)
        lost1 = (1 - taut1) * (1 - exists1) + free * (1 - known)
        lost2 = (1 - taut2) * (1 - exists2) + free * (1 - known)
        with np.errstate(invalid="ignore"):
            known1, known2 = (
                np.sqrt(1.0 - 2 * (lost1 > 0)),
                np.sqrt(1.0 - 2 * (lost2 > 0)),
            )  # 1, or NaN for CasADi too, which takes 0/0 for 0
        return known1 * (taut1 * e1 + (1 - taut1) * least1), known2 * (taut2 * e2 + (1 - taut2) * least2), taut1, taut2

    def beyond(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        """Strains beyond natural width, (g_1, g_2): they have the signs that decide where the membrane is taut."""
        slack, _ = self.slack_strain()
        return e1 - self.width(np.maximum(e2, slack))[0], e2 - self.width(np.maximum(e1, slack))[0]

    def energy(self, e1: Any, e2: Any) -> Any:
        """The strain energy: the electric one is reported apart."""
        n1, n2, _, _ = self.natural(e1, e2)
        return self.taut.energy(n1, n2)

    def electric_energy(self, e1: Any, e2: Any) -> Any:
        n1, n2, _, _ = self.natural(e1, e2)
        return self.taut.electric_energy(n1, n2)

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        n1, n2, taut1, taut2 = self.natural(e1, e2)
        s1, s2 = self.taut.stress(n1, n2)
        return taut1 * s1, taut2 * s2  # at natural width the stress across is zero: here exactly

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        n1, n2, taut1, taut2 = self.natural(e1, e2)
        d11, d12, d22 = self.taut.tangent(n1, n2)
        along1 = d11 - (1 - taut2) * d12 * d12 / (d22 + taut2 * (d22 == 0))
        along2 = d22 - (1 - taut1) * d12 * d12 / (d11 + taut1 * (d11 == 0))
        return taut1 * along1, taut1 * taut2 * d12, taut2 * along2

    def volume_ratio(self, e1: Any, e2: Any) -> Any:
        """Volume ratio at natural strains: 1 unless the response says otherwise."""
        own = getattr(self.taut, "volume_ratio", None)
        return 1.0 if own is None else own(*self.natural(e1, e2)[:2])

    def mechanical_stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        """Stresses of the material alone: across wrinkles it balances the field."""
        n1, n2, _, _ = self.natural(e1, e2)
        return self.taut.mechanical_stress(n1, n2)

    def field_squared(self, e1: Any, e2: Any) -> Any:
        """Square of the true field, over the modulus."""
        n1, n2, _, _ = self.natural(e1, e2)
        return self.taut.field_squared(n1, n2)
