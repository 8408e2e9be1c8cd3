"""Strain energies of the first invariant alone, W = f(J) with J = I_1 - 3 and f'(0) = 1/2 (shear modulus 1).

With p_i = expm1(2 e_i), J is a product form without cancellation (:class:`.materials.Ogden`), and ::

    dJ/de_1 = 2 (p_1 - p_3)        s_i = f' dJ/de_i        d(s_i)/d(e_j) = f'' dJ/de_i dJ/de_j + f' d^2 J/(de_i de_j)

The Baker-Ericksen inequality (1954), (s_1 - s_2)/(lambda_1 - lambda_2) > 0, means f'(J) > 0 at every J >= 0. Every class below demands it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import convert
from ..errors import InputError
from .materials import NeoHookean

_DOUBLE = NeoHookean()  # J/2, with its derivatives


class InvariantMaterial:
    """What the classes below share: from f to stress and tangent."""

    def function(self, J: Any) -> tuple[Any, Any, Any]:
        """(f, f', f'') at J >= 0.

        Parameters
        ----------
        J : float, ndarray or CasADi symbol
            I_1 - 3.
        """
        raise NotImplementedError

    def energy(self, e1: Any, e2: Any) -> Any:
        return self._at(e1, e2)[0]

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        _, slope, _ = self._at(e1, e2)
        s1, s2 = _DOUBLE.stress(e1, e2)
        return 2 * slope * s1, 2 * slope * s2

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        _, slope, curvature = self._at(e1, e2)
        s1, s2 = _DOUBLE.stress(e1, e2)
        t11, t12, t22 = _DOUBLE.tangent(e1, e2)
        a, b = 2 * slope, 4 * curvature
        return a * t11 + b * s1 * s1, a * t12 + b * s1 * s2, a * t22 + b * s2 * s2

    def _at(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        with np.errstate(all="ignore"):  # the answer is NaN beyond locking, and infinite beyond the range of a float
            return self.function(2 * _DOUBLE.energy(e1, e2))


@dataclass(frozen=True)
class Yeoh(InvariantMaterial):
    """Yeoh's strain energy W = J/2 + c_2 J^2 + c_3 J^3 with J = I_1 - 3 (Yeoh, Rubber Chem. Technol. 66, 1993).

    Parameters
    ----------
    c2, c3 : float
        In units of the shear modulus. f' = 1/2 + 2 c_2 J + 3 c_3 J^2 must be positive at every J >= 0. So c_3 must not be negative. c_2 may
        be negative (softening) as long as 2 c_2^2 < 3 c_3.

    Raises
    ------
    InputError
        For numbers that break this, or are not finite.
    """

    c2: float
    c3: float = 0.0

    def __post_init__(self) -> None:
        for name in ("c2", "c3"):
            convert(self, f"material.{name}", "a finite number is allowed (in units of the shear modulus)")
        reason = "the stress does not grow with the stretch (Baker-Ericksen) at every stretch otherwise"
        if self.c3 < 0:
            raise InputError("material.c3", self.c3, f"a number >= 0 is allowed: {reason}")
        if self.c2 < 0 and not 2 * self.c2**2 < 3 * self.c3:
            least = math.sqrt(1.5 * self.c3)
            raise InputError("material.c2", self.c2, f"a number >= 0, or > -sqrt(1.5 c3) = {-least:.6g}, is allowed: {reason}")

    def function(self, J: Any) -> tuple[Any, Any, Any]:
        c2, c3 = self.c2, self.c3
        return J * (0.5 + J * (c2 + J * c3)), 0.5 + J * (2 * c2 + 3 * c3 * J), 2 * c2 + 6 * c3 * J


@dataclass(frozen=True)
class Gent(InvariantMaterial):
    """Gent's strain energy W = -J_m/2 log(1 - J/J_m) (Gent, Rubber Chem. Technol. 69, 1996).

    The material locks at J = I_1 - 3 = J_m, and W is NaN beyond.

    Parameters
    ----------
    jm : float
        J_m > 0. Rubber has 30 to 100, soft tissue 0.4 to 5; the material tends to neo-Hookean as J_m grows.

    Raises
    ------
    InputError
        For a number that is not positive: the membrane would be locked at rest.

    Examples
    --------
    Strains of 0.5 cost more as the material comes closer to locking, and are impossible beyond:

    >>> import femmembrane as fm
    >>> [round(float(fm.Gent(jm).energy(0.5, 0.5)), 4) for jm in (1e6, 30.0, 3.0, 2.0)]
    [1.286, 1.3444, 2.9205, nan]
    """

    jm: float

    def __post_init__(self) -> None:
        reason = "the membrane locks at I1 - 3 = J_m, which is 0 at rest (neo-hookean never locks)"
        convert(self, "material.jm", f"a finite number > 0 is allowed: {reason}", above=0)

    def function(self, J: Any) -> tuple[Any, Any, Any]:
        log = np.log1p(-J / self.jm)
        # 1/(1 - J/J_m) through the logarithm: NaN beyond locking, where the quotient is a number without meaning
        slope = np.exp(-log) / 2
        return -self.jm / 2 * log, slope, 2 * slope * slope / self.jm


#: Arruda and Boyce (1993), eq. 18: the series of the inverse Langevin function to five terms
_CHAIN = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)


@dataclass(frozen=True)
class ArrudaBoyce(InvariantMaterial):
    """Eight-chain model of Arruda and Boyce (J. Mech. Phys. Solids 41, 1993): the five-term series of the inverse Langevin function.

    W = mu' sum_i C_i/N^(i-1) (I_1^i - 3^i) with C = (1/2, 1/20, 11/1050, 19/7000, 519/673750); mu' makes the shear modulus 1. The series of
    five terms stiffens, but does not lock.

    Parameters
    ----------
    links : float
        Links N > 1 of a chain. At rest a chain is as long as sqrt(N) of its links; the material tends to neo-Hookean as N grows.

    Raises
    ------
    InputError
        For a number that is not above 1: such a chain would be longer than its links at rest.
    """

    links: float

    def __post_init__(self) -> None:
        reason = "a chain of N links has sqrt(N) times its length at rest when it is straight"
        convert(self, "material.links", f"a finite number > 1 is allowed: {reason}", above=1)

    def function(self, J: Any) -> tuple[Any, Any, Any]:
        # in powers of J = I_1 - 3 all coefficients are positive, and nothing cancels
        share = [c / self.links**k for k, c in enumerate(_CHAIN)]
        powers = [sum(share[i - 1] * math.comb(i, k) * 3 ** (i - k) for i in range(k, 6)) for k in range(1, 6)]
        a = [p / (2 * powers[0]) for p in powers]
        value = slope = curvature = 0.0
        for k in range(5, 0, -1):  # Horner's rule
            value, slope = J * (a[k - 1] + value), k * a[k - 1] + J * slope
            curvature = k * (k - 1) * a[k - 1] + J * curvature if k > 1 else curvature
        return value, slope, curvature


@dataclass(frozen=True)
class Fung(InvariantMaterial):
    """Fung's exponential strain energy in its isotropic form, W = (exp(b J) - 1)/(2 b) with J = I_1 - 3 (Fung 1967, Demiray 1972).

    Parameters
    ----------
    b : float
        Rate of stiffening b > 0; the material tends to neo-Hookean as b falls to 0.

    Raises
    ------
    InputError
        For a number that is not positive: with b < 0 the energy is bounded, and no large stretch has any stress.
    """

    b: float

    def __post_init__(self) -> None:
        reason = "below 0 the stress dies out at large stretches, and 0 is neo-hookean"
        convert(self, "material.b", f"a finite number > 0 is allowed: {reason}", above=0)

    def function(self, J: Any) -> tuple[Any, Any, Any]:
        slope = np.exp(self.b * J) / 2
        return np.expm1(self.b * J) / (2 * self.b), slope, self.b * slope
