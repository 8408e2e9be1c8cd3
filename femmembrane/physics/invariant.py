"""Strain energies of the first invariant alone, W = f(J) with J = I_1 - 3 and f'(0) = 1/2 (shear modulus 1).

With p_i = expm1(2 e_i), J is a product form without cancellation (:class:`.materials.Ogden`), and ::

    dJ/de_1 = 2 (p_1 - p_3)        s_i = f' dJ/de_i        d(s_i)/d(e_j) = f'' dJ/de_i dJ/de_j + f' d^2 J/(de_i de_j)

The Baker-Ericksen inequality (1954), (s_1 - s_2)/(lambda_1 - lambda_2) > 0, means f'(J) > 0 at every J >= 0. Every class below demands it.
(The extended tube adds a term of Ogden's, which satisfies it by itself.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import SMALLEST, between, convert, number, store
from ..errors import InputError
from .materials import NeoHookean, Ogden

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


@dataclass(frozen=True)
class LopezPamies(InvariantMaterial):
    """Lopez-Pamies' strain energy with one or two terms (Lopez-Pamies, C. R. Mecanique 338, 2010).

    W = sum_k mu_k 3^(1 - alpha_k)/(2 alpha_k) (I_1^alpha_k - 3^alpha_k) with mu_1 + mu_2 = 1, the shear modulus.

    Parameters
    ----------
    alpha1 : float
        Exponent of the first term, not 0; 1 is neo-Hookean.
    alpha2 : float
        Exponent of the second term, not 0.
    share : float
        mu_2/(mu_1 + mu_2), at least 0 and below 1. Left out: 0, and the first term is alone.

    Raises
    ------
    InputError
        For an exponent of 0, or a share outside its bounds: with a negative modulus the stress would not grow with the stretch.

    Examples
    --------
    Half of the modulus with an exponent of 3 stiffens the rubber at equal stretches of 2:

    >>> from math import log
    >>> import femmembrane as fm
    >>> [round(float(fm.LopezPamies(1.0, 3.0, share).stress(log(2), log(2))[0]), 4) for share in (0.0, 0.5)]
    [3.9375, 16.1884]
    """

    alpha1: float
    alpha2: float = 1.0
    share: float = 0.0

    def __post_init__(self) -> None:
        for name in ("alpha1", "alpha2"):
            convert(self, f"material.{name}", "a finite number other than 0 is allowed")
            if getattr(self, name) == 0:
                raise InputError(f"material.{name}", 0.0, "a finite number other than 0 is allowed")
        check_share(self, "the second term's part of the shear modulus")

    def function(self, J: Any) -> tuple[Any, Any, Any]:
        log = np.log1p(J / 3)
        value = slope = curvature = 0.0
        for mu, alpha in ((1 - self.share, self.alpha1), (self.share, self.alpha2)):
            rise = mu / 2 * np.exp((alpha - 1) * log)
            value = value + 1.5 * mu / alpha * np.expm1(alpha * log)
            slope, curvature = slope + rise, curvature + (alpha - 1) / 3 * rise
        return value, slope, curvature * np.exp(-log)


@dataclass(frozen=True)
class _TubeChains(InvariantMaterial):
    """Chains between the links of an extended tube; ``square`` is delta^2. They lock at J = 1/delta^2."""

    square: Any

    def function(self, J: Any) -> tuple[Any, Any, Any]:
        x = self.square
        log = np.log1p(-x * J)
        room = np.exp(-log)  # 1/(1 - x J), and NaN beyond locking
        half = 0.5 / (1 - 2 * x)
        rise = 1 - 2 * x + x * x * J
        return half * ((1 - x) * J * room + log), half * rise * room**2, half * x * (2 - 3 * x + x * x * J) * room**3


#: 2 (sum of the 1/lambda_i - 3), at strains multiplied by beta
_TUBE = Ogden((-2.0,), (-1.0,))


@dataclass(frozen=True)
class ExtendedTube:
    """Extended-tube strain energy: chains of finite length in tubes that entanglements make (Kaliske and Heinrich 1999).

    W = G_c/2 ((1 - delta^2) J/(1 - delta^2 J) + log(1 - delta^2 J)) + 2 G_e/beta^2 sum_i (lambda_i^-beta - 1) with J = I_1 - 3; Rubber
    Chem. Technol. 72 (1999). The shear modulus is (1 - 2 delta^2) G_c + G_e = 1.

    Parameters
    ----------
    beta : float
        Release of the tubes, 0 < beta <= 1.
    delta : float
        Inextensibility of the chains, at least 0, with 2 delta^2 < 1. The material locks at J = 1/delta^2, and W is NaN beyond.
    share : float
        G_e, the part of the entanglements in the shear modulus: at least 0 and below 1.

    Raises
    ------
    InputError
        For numbers outside these bounds.

    Examples
    --------
    >>> import femmembrane as fm
    >>> tube = fm.ExtendedTube(beta=0.3, delta=0.1, share=0.5)
    >>> round(float(tube.energy(0.5, 0.5)), 4)
    1.452
    """

    beta: float
    delta: float
    share: float

    def __post_init__(self) -> None:
        store(self, beta=between("material.beta", self.beta, 0, 1, "a number > 0, and 1 at most, is allowed"))
        if self.beta < SMALLEST:
            raise InputError("material.beta", self.beta, "a number > 0, and 1 at most, is allowed")
        convert(self, "material.delta", "a number >= 0 is allowed", least=0)
        if not 2 * self.delta**2 < 1:
            allowed = "a number >= 0 and < sqrt(1/2) is allowed: the chains have no stiffness at rest otherwise"
            raise InputError("material.delta", self.delta, allowed)
        check_share(self, "the entanglements' part of the shear modulus")

    def energy(self, e1: Any, e2: Any) -> Any:
        chains, beta = self._chains.energy(e1, e2), self.beta
        return (1 - self.share) * chains + self.share / beta**2 * _TUBE.energy(beta * e1, beta * e2)

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        chains, beta = self._chains.stress(e1, e2), self.beta
        tube = _TUBE.stress(beta * e1, beta * e2)
        s1, s2 = ((1 - self.share) * c + self.share / beta * t for c, t in zip(chains, tube, strict=True))
        return s1, s2

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        chains, beta = self._chains.tangent(e1, e2), self.beta
        tube = _TUBE.tangent(beta * e1, beta * e2)
        s11, s12, s22 = ((1 - self.share) * c + self.share * t for c, t in zip(chains, tube, strict=True))
        return s11, s12, s22

    @property
    def _chains(self) -> _TubeChains:
        return _TubeChains(self.delta * self.delta)


def check_share(material: Any, meaning: str) -> None:
    """Turn the attribute ``share`` of a material into a float of at least 0 and below 1."""
    share = number("material.share", material.share, f"a number >= 0 and < 1 is allowed: {meaning}", least=0)
    if not share < 1:
        raise InputError("material.share", share, f"a number >= 0 and < 1 is allowed: {meaning}")
    store(material, share=share)
