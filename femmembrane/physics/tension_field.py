"""Tension field: the strain energy of a membrane that wrinkles rather than carry compression (Pipkin 1986, Steigmann 1990).

A strip of an isotropic incompressible material in simple tension has the natural width lambda^(-1/2). A membrane narrower than that
wrinkles across at no cost, and its mean energy is the energy of simple tension. A membrane with both stretches below 1 is slack. With
Hencky strains, and x+ the positive part of x, all of this is the energy at the *natural strains*::

    n_1 = max(e_1, -e_2+/2),   n_2 = max(e_2, -e_1+/2)            W*(e_1, e_2) = W(n_1, n_2)

    taut             n_1 = e_1,    n_2 = e_2        W
    hoop wrinkled    n_1 = e_1,    n_2 = -e_1/2     stress along the meridian alone
    meridian wrinkled n_1 = -e_2/2, n_2 = e_2       stress around the axis alone
    slack            n_1 = n_2 = 0                  no energy, no stress

A compressible material answers its own natural width, of which the package asks ``natural_width(e)``, the strain across and its slope. Then
that stands for -e/2 above.

W* is the relaxation (quasiconvex envelope) of W where the Baker-Ericksen inequalities hold. A term of the potential that depends on the
position alone, like the magnetic energy, passes through the relaxation unchanged. So W* relaxes the whole potential at a given pressure. W*
is once continuously differentiable; its second derivatives jump across the borders of the zones. Nothing is smoothed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .materials import Material

Width = Callable[[Any], tuple[Any, Any]]


@dataclass(frozen=True)
class TensionField:
    """The relaxed energy W* of a material; itself a :class:`~.materials.Material`.

    In a taut membrane it gives the numbers of the material, to the last bit.

    Parameters
    ----------
    material : Material
        Any isotropic strain energy.
    """

    material: Material

    def natural(self, e1: Any, e2: Any) -> tuple[Any, Any, Any, Any]:
        """See :func:`natural_strains`."""
        return natural_strains(e1, e2, self.width)

    def beyond(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        """Strains beyond natural width, (g_1, g_2): they have the signs that decide where the membrane is taut."""
        return e1 - self.width(np.maximum(e2, 0))[0], e2 - self.width(np.maximum(e1, 0))[0]

    def energy(self, e1: Any, e2: Any) -> Any:
        n1, n2, _, _ = self.natural(e1, e2)
        return self.material.energy(n1, n2)

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        n1, n2, taut1, taut2 = self.natural(e1, e2)
        s1, s2 = self.material.stress(n1, n2)
        return taut1 * s1, taut2 * s2  # at natural width the stress across is zero: here exactly

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        n1, n2, taut1, taut2 = self.natural(e1, e2)
        s11, s12, s22 = self.material.tangent(n1, n2)
        across1, across2 = self.width(n2)[1], self.width(n1)[1]
        # in simple tension d(s_1)/d(e_1) = s_11 + s_12 dn_2/de_1, which is s_11 - s_12/2 where the volume stays
        return taut1 * (s11 + (1 - taut2) * s12 * across2), taut1 * taut2 * s12, taut2 * (s22 + (1 - taut1) * s12 * across1)

    def volume_ratio(self, e1: Any, e2: Any) -> Any:
        """Volume ratio at natural strains: 1 unless the material says otherwise."""
        own = getattr(self.material, "volume_ratio", None)
        return 1.0 if own is None else own(*self.natural(e1, e2)[:2])

    @property
    def width(self) -> Width:
        return natural_width(self.material)


def natural_width(material: Material) -> Width:
    """Strain across a strip of a material in simple tension, and its slope, as a function of the strain along it."""
    own: Width = getattr(material, "natural_width", _incompressible)
    return own


def _incompressible(e: Any) -> tuple[Any, Any]:
    return -0.5 * e, -0.5


def natural_strains(e1: Any, e2: Any, width: Width = _incompressible) -> tuple[Any, Any, Any, Any]:
    """Natural strains (n_1, n_2), and whether the membrane is taut along each direction.

    It is written with products of truth values, not with minima and maxima, so that a NaN stays a NaN: a state outside the domain of the
    energy must not pass for a slack state.
    """
    least1, least2 = (e2 > 0) * width(e2)[0], (e1 > 0) * width(e1)[0]
    taut1, taut2 = e1 >= least1, e2 >= least2
    return taut1 * e1 + (1 - taut1) * least1, taut2 * e2 + (1 - taut2) * least2, taut1, taut2


def cauchy_stress(law: Material, e1: Any, e2: Any) -> tuple[Any, Any]:
    """Principal Cauchy stresses: lambda_i dW/dlambda_i over the volume ratio, which is 1 unless the law says otherwise."""
    s1, s2 = law.stress(e1, e2)
    ratio = getattr(law, "volume_ratio", None)
    if ratio is None:
        return s1, s2
    volume = ratio(e1, e2)
    return s1 / volume, s2 / volume
