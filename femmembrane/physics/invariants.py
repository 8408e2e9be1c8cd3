"""Strain energies of both invariants, W = f(J, K) with J = I_1 - 3, K = I_2 - 3 and f_J + f_K = 1/2 at rest (shear modulus 1).

J and K are product forms without cancellation (:class:`.materials.Ogden`). With subscripts of f for its derivatives::

    s_i = f_J dJ/de_i + f_K dK/de_i

The Baker-Ericksen inequality (1954) means f_J + lambda_k^2 f_K > 0 for each of the three stretches (Rivlin, Phil. Trans. R. Soc. A 241,
1948, for the stresses). Every class below demands it at every stretch.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ..checks import convert, number, store
from ..errors import InputError
from .invariant import check_share
from .materials import NeoHookean, Ogden

_HALF_J, _HALF_K = NeoHookean(), Ogden((-1.0,), (-2.0,))


class InvariantsMaterial:
    """What the classes below share: from f to stress and tangent."""

    def function(self, J: Any, K: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
        """(f, f_J, f_K, f_JJ, f_JK, f_KK) at J, K >= 0.

        Parameters
        ----------
        J, K : float, ndarray or CasADi symbol
            I_1 - 3 and I_2 - 3.
        """
        raise NotImplementedError

    def energy(self, e1: Any, e2: Any) -> Any:
        return self._at(e1, e2)[0]

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        _, f_J, f_K, *_ = self._at(e1, e2)
        j, k = _HALF_J.stress(e1, e2), _HALF_K.stress(e1, e2)
        return 2 * (f_J * j[0] + f_K * k[0]), 2 * (f_J * j[1] + f_K * k[1])

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        _, f_J, f_K, f_JJ, f_JK, f_KK = self._at(e1, e2)
        j, k = _HALF_J.stress(e1, e2), _HALF_K.stress(e1, e2)
        pairs = zip(((0, 0), (0, 1), (1, 1)), _HALF_J.tangent(e1, e2), _HALF_K.tangent(e1, e2), strict=True)
        s11, s12, s22 = (
            2 * (f_J * jj + f_K * kk) + 4 * (f_JJ * (j[a] * j[b]) + f_JK * (j[a] * k[b] + j[b] * k[a]) + f_KK * (k[a] * k[b]))
            for (a, b), jj, kk in pairs
        )
        return s11, s12, s22

    def _at(self, e1: Any, e2: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
        with np.errstate(all="ignore"):  # the answer is NaN beyond locking, and infinite beyond the range of a float
            return self.function(2 * _HALF_J.energy(e1, e2), 2 * _HALF_K.energy(e1, e2))


@dataclass(frozen=True)
class GentGent(InvariantsMaterial):
    """Gent-Gent strain energy: Gent's term and a logarithm of the second invariant (Pucci and Saccomandi, Rubber Chem. Technol. 75, 2002).

    W = -(1 - b) J_m/2 log(1 - J/J_m) + 3 b/2 log(I_2/3) with J = I_1 - 3 and the share b of the second term.

    Parameters
    ----------
    jm : float
        J_m > 0: the material locks at J = J_m, and W is NaN beyond.
    share : float
        The logarithm's part b of the shear modulus, at least 0 and below 1; with 0 it is Gent's material.

    Raises
    ------
    InputError
        For numbers outside these bounds.

    Examples
    --------
    Equal stretches of 2 in both directions: the second term softens the rubber.

    >>> from math import log
    >>> import femmembrane as fm
    >>> [round(float(fm.GentGent(77.0, share).stress(log(2), log(2))[0]), 4) for share in (0.0, 0.3)]
    [4.2146, 3.8093]
    """

    jm: float
    share: float

    def __post_init__(self) -> None:
        convert(self, "material.jm", "a finite number > 0 is allowed: the membrane locks at I1 - 3 = J_m, which is 0 at rest", above=0)
        check_share(self, "the part of the shear modulus that the logarithm of I2 has")

    def function(self, J: Any, K: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
        log, gent, second = np.log1p(-J / self.jm), 1 - self.share, self.share / 2
        room, fall = np.exp(-log), 1 / (1 + K / 3)
        value = 3 * second * np.log1p(K / 3) - gent * self.jm / 2 * log
        return value, gent / 2 * room, second * fall, gent / (2 * self.jm) * room**2, 0.0, -second / 3 * fall**2


#: the powers of J and K that a coefficient multiplies
_POWERS = {f"c{i}{k}": (i, k) for i, k in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3))}


@dataclass(frozen=True)
class Polynomial(InvariantsMaterial):
    """Polynomial strain energy W = sum of c_ik J^i K^k with J = I_1 - 3, K = I_2 - 3 (Rivlin and Saunders 1951).

    Phil. Trans. R. Soc. A 243 (1951). With c10, c01 and c11 it is the Mooney-Rivlin material of three terms, with c20 and c02 as well that
    of five, with all that of nine.

    Parameters
    ----------
    c10, c01, c20, c11, c02, c30, c21, c12, c03 : float
        Coefficients in units of the shear modulus; 2 (c10 + c01) = 1. Negative ones are allowed as long as the stress grows with the
        stretch at every stretch (Baker-Ericksen). That is looked up at 40 000 pairs of stretches up to e^20, and closer where it is nearest
        to failing.

    Raises
    ------
    InputError
        For coefficients whose sum shows another shear modulus, and for unstable ones (with the stretches where they are).

    Examples
    --------
    >>> import femmembrane as fm
    >>> rubber = fm.Polynomial(c10=0.45, c01=0.05, c20=-0.002, c11=0.001, c30=0.00005)
    >>> round(float(rubber.energy(0.5, 0.5)), 4)
    1.4144
    """

    c10: float = 0.5
    c01: float = 0.0
    c20: float = 0.0
    c11: float = 0.0
    c02: float = 0.0
    c30: float = 0.0
    c21: float = 0.0
    c12: float = 0.0
    c03: float = 0.0

    def __post_init__(self) -> None:
        for f in fields(self):
            convert(self, f"material.{f.name}", "a finite number is allowed (in units of the shear modulus)")
        twice = 2 * (self.c10 + self.c01)
        if not abs(twice - 1) <= 1e-6:
            advice = f"; divide all coefficients by {twice:.9g}" if twice > 0 else ""
            allowed = f"2 (c10 + c01) = 1 is needed (shear modulus 1), not {twice:.9g}{advice}"
            raise InputError("material.c10", self.c10, allowed)
        negative = [f.name for f in fields(self) if getattr(self, f.name) < 0]
        if negative and (place := self._softest()) is not None:
            allowed = (
                "the stress does not grow with the stretch (Baker-Ericksen) at every stretch with this negative number: not at stretches "
                f"of {place[0]:.4g} and {place[1]:.4g}"
            )
            raise InputError(f"material.{negative[0]}", getattr(self, negative[0]), allowed)

    def numbers_with(self, name: str, value: Any) -> dict[str, Any]:
        """All numbers that change where one is varied: the sum of c10 and c01 stays.

        Parameters
        ----------
        name : str
        value : float or CasADi symbol
        """
        other = {"c10": "c01", "c01": "c10"}.get(name)
        return {name: value} if other is None else {name: value, other: 0.5 - value}

    def function(self, J: Any, K: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
        return (
            J * (self.c10 + J * (self.c20 + J * self.c30) + K * (self.c11 + J * self.c21 + K * self.c12))
            + K * (self.c01 + K * (self.c02 + K * self.c03)),
            *self._slopes(J, K),
            2 * self.c20 + 6 * self.c30 * J + 2 * self.c21 * K,
            self.c11 + 2 * self.c21 * J + 2 * self.c12 * K,
            2 * self.c02 + 2 * self.c12 * J + 6 * self.c03 * K,
        )

    def _slopes(self, J: Any, K: Any) -> tuple[Any, Any]:
        f_J = self.c10 + J * (2 * self.c20 + 3 * J * self.c30) + K * (self.c11 + 2 * J * self.c21 + K * self.c12)
        f_K = self.c01 + K * (2 * self.c02 + 3 * K * self.c03) + J * (self.c11 + J * self.c21 + 2 * K * self.c12)
        return f_J, f_K

    def _softest(self) -> tuple[float, float] | None:
        """Stretches at which the inequality fails; None where none were found."""
        sizes = object.__new__(Polynomial)
        store(sizes, **{f.name: abs(getattr(self, f.name)) for f in fields(self)})
        # where the greatest stretch is e^20 the highest power that a coefficient has rules alone
        radius, angle = np.geomspace(1e-2, 20, 160), np.linspace(-np.pi, np.pi, 241)
        for _ in range(4):
            r, a = np.meshgrid(radius, angle)
            e1, e2 = r * np.cos(a), r * np.sin(a)
            squares = np.exp(2 * np.array([e1, e2, -e1 - e2]))
            J, K, square = np.maximum(squares.sum(0) - 3, 0), np.maximum((1 / squares).sum(0) - 3, 0), squares[2]
            (f_J, f_K), (size_J, size_K) = self._slopes(J, K), sizes._slopes(J, K)
            share = (f_J + square * f_K) / (size_J + square * size_K)
            failed = share <= 0
            row, column = np.unravel_index(np.argmin(np.where(failed, r, np.inf) if failed.any() else share), share.shape)
            if failed.any():  # the nearest to rest
                return float(np.exp(e1[row, column])), float(np.exp(e2[row, column]))
            steps = radius[1] / radius[0], angle[1] - angle[0]
            radius = r[row, column] * np.geomspace(1 / steps[0], steps[0], 21)
            angle = a[row, column] + np.linspace(-steps[1], steps[1], 21)
        return None


#: the least rate b at which exp(b J) > lambda^2/2 at every stretch: the largest log(lambda^2/2)/(lambda^2 + 2/lambda - 3)
LEAST_RATE = 0.35754


@dataclass(frozen=True)
class VerondaWestmann(InvariantsMaterial):
    """Strain energy of soft tissue W = (exp(b J) - 1)/b - K/2 with J = I_1 - 3, K = I_2 - 3 (Veronda and Westmann, J. Biomech. 3, 1970).

    Parameters
    ----------
    b : float
        Rate of stiffening, above 0.35754. The Baker-Ericksen inequality asks for exp(b J) > lambda^2/2 for every stretch lambda. At one
        lambda J is least in simple tension, where it is lambda^2 + 2/lambda - 3. So b must exceed the largest value of
        log(lambda^2/2)/(lambda^2 + 2/lambda - 3). Computed, it is 0.357531, at lambda = 1.8286.

    Raises
    ------
    InputError
        For a smaller b: the second term, which softens, wins at some stretch.
    """

    b: float

    def __post_init__(self) -> None:
        reason = "the stress does not grow with the stretch (Baker-Ericksen) at every stretch otherwise"
        allowed = f"a finite number > {LEAST_RATE} is allowed: {reason}"
        store(self, b=number("material.b", self.b, allowed, above=LEAST_RATE))

    def function(self, J: Any, K: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
        slope = np.exp(self.b * J)
        return np.expm1(self.b * J) / self.b - K / 2, slope, -0.5, self.b * slope, 0.0, 0.0
