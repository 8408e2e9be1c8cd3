"""Hooke's law for finite displacements: a linear law between Green strains and their stresses (Kirchhoff 1852), in plane stress.

With E_i = (lambda_i^2 - 1)/2 and Poisson's ratio nu, in units of the shear modulus (Timoshenko and Woinowsky-Krieger, Theory of Plates and
Shells, 1959, for the law at small strains)::

    W = E_1^2 + E_2^2 + nu/(1 - nu) (E_1 + E_2)^2           dW/dE_1 = 2 (E_1 + nu E_2)/(1 - nu)

The material is compressible. Its thickness follows from sigma_33 = 0, which is E_3 = -nu/(1 - nu) (E_1 + E_2), and the volume changes by
lambda_1 lambda_2 lambda_3. In simple tension E_2 = E_3 = -nu E_1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import number, store
from ..errors import InputError

if TYPE_CHECKING:
    from .electrified_hooke import ElectrifiedHooke


@dataclass(frozen=True)
class Hooke:
    """Hooke's law with Green strains in plane stress, for strains that are small beside 1 (Kirchhoff 1852).

    W = E_1^2 + E_2^2 + nu/(1 - nu) (E_1 + E_2)^2 with E_i = (lambda_i^2 - 1)/2, also known as the Saint Venant-Kirchhoff material. It is
    compressible: its thickness follows from the condition that no stress acts across. A positive Poisson's ratio makes it thinner until,
    at E_1 + E_2 = (1 - nu)/(2 nu), nothing is left. There the material ends, and W is NaN beyond; so is the natural width in simple
    tension, which would be 0 at E_1 = 1/(2 nu).

    It is unstable in strong compression, as linear laws are: where E_1 + E_2 < -(1 - nu)/2 the Baker-Ericksen inequality fails. Mechanical
    stresses in profiles are those of Cauchy, lambda_i dW/dlambda_i over the volume ratio; magnetic energy and weight count per reference
    volume.

    Parameters
    ----------
    poisson_ratio : float
        nu, above -1 and at most 1/2.

    Raises
    ------
    InputError
        For a number outside these bounds.

    Examples
    --------
    Equal stretches of 1.1, E = 0.105: the stress per reference thickness is lambda^2 2 (1 + nu)/(1 - nu) E.

    >>> from math import log
    >>> import femmembrane as fm
    >>> round(float(fm.Hooke(poisson_ratio=0.3).stress(log(1.1), log(1.1))[0]), 6)
    0.4719
    """

    poisson_ratio: float

    def __post_init__(self) -> None:
        key, allowed = "material.poisson_ratio", "a number above -1, and 0.5 at most, is allowed (0.5 keeps the volume at small strains)"
        ratio = number(key, self.poisson_ratio, allowed, above=-1)
        if ratio > 0.5:
            raise InputError(key, ratio, allowed)
        store(self, poisson_ratio=ratio)

    def energy(self, e1: Any, e2: Any) -> Any:
        E1, E2, coupling, inside = self._at(e1, e2)
        return inside * (E1 * E1 + E2 * E2 + coupling * (E1 + E2) ** 2)

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        E1, E2, coupling, inside = self._at(e1, e2)
        both = coupling * (E1 + E2)
        return inside * (2 * (1 + 2 * E1) * (E1 + both)), inside * (2 * (1 + 2 * E2) * (E2 + both))

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        E1, E2, coupling, inside = self._at(e1, e2)
        both, q1, q2 = coupling * (E1 + E2), inside * (1 + 2 * E1), inside * (1 + 2 * E2)
        own = 2 * (1 + coupling)
        return q1 * (4 * (E1 + both) + q1 * own), 2 * coupling * q1 * q2, q2 * (4 * (E2 + both) + q2 * own)

    def natural_width(self, e: Any) -> tuple[Any, Any]:
        """Strain across a strip in simple tension, from E_2 = -nu E_1, and its slope.

        Parameters
        ----------
        e : float, ndarray or CasADi symbol
            Logarithmic strain along the strip; NaN is the answer where the width would be 0 or less.
        """
        nu, twice = self.poisson_ratio, np.expm1(2 * e)  # 2 E_1
        with np.errstate(invalid="ignore", divide="ignore"):
            log = np.log1p(-nu * twice)
        return 0.5 * log, -nu * (1 + twice) * np.exp(-log)

    def volume_ratio(self, e1: Any, e2: Any) -> Any:
        """lambda_1 lambda_2 lambda_3 with the thickness of plane stress.

        Parameters
        ----------
        e1, e2 : float, ndarray or CasADi symbol
            Logarithmic strains.
        """
        E1, E2, coupling, inside = self._at(e1, e2)
        return inside * np.exp(e1 + e2) * np.sqrt(np.fabs(1 - 2 * coupling * (E1 + E2)))

    def electrified(self, voltage: Any, charge: Any) -> ElectrifiedHooke:
        """Its response under a field, which presses it thin.

        Parameters
        ----------
        voltage, charge : float, ndarray or CasADi symbol
            As in :class:`~.electrified.Electrified`.
        """
        from .electrified_hooke import ElectrifiedHooke

        return ElectrifiedHooke(self, voltage, charge)

    def _at(self, e1: Any, e2: Any) -> tuple[Any, Any, Any, Any]:
        """Green strains, nu/(1 - nu), and 1 where the sheet has a thickness, else NaN."""
        E1, E2 = np.expm1(2 * e1) / 2, np.expm1(2 * e2) / 2
        coupling = self.poisson_ratio / (1 - self.poisson_ratio)
        with np.errstate(invalid="ignore"):
            inside = np.sqrt(2.0 * (2 * coupling * (E1 + E2) < 1) - 1)
        return E1, E2, coupling, inside
