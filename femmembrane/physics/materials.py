"""Strain energies of incompressible isotropic membranes.

A material is a function of the two in-plane logarithmic strains e_i = log lambda_i, in units of the ground-state shear modulus::

    W(e_1, e_2),      lambda_i dW/dlambda_i = dW/de_i       the principal mechanical (Cauchy) stresses

At rest it must have W = 0 and dW/de = 0. Its shear modulus must be 1, so that W = 2 (e_1^2 + e_1 e_2 + e_2^2) to second order.

Sources: R. W. Ogden, Proc. R. Soc. Lond. A 326 (1972); H. Hencky, Z. techn. Phys. 9 (1928) for the strains; M. Baker and J. L. Ericksen,
J. Wash. Acad. Sci. 44 (1954) for the inequality that the numbers must meet.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from ..checks import choice, convert, number, store
from ..errors import InputError


class Material(Protocol):
    """What the potential asks of a strain energy; works on NumPy arrays and CasADi symbols alike."""

    def energy(self, e1: Any, e2: Any) -> Any:
        """W(e_1, e_2) in units of mu.

        Parameters
        ----------
        e1, e2 : float, ndarray or CasADi symbol
            Logarithmic strains, meridional and circumferential.
        """

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        """(dW/de_1, dW/de_2) = (lambda_1 W_1, lambda_2 W_2) in units of mu.

        Parameters
        ----------
        e1, e2 : float, ndarray or CasADi symbol
            Logarithmic strains, meridional and circumferential.
        """

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        """Second derivatives (W_11, W_12, W_22) with respect to e_1 and e_2. Closed forms save half the cost of the potential.

        Parameters
        ----------
        e1, e2 : float, ndarray or CasADi symbol
            Logarithmic strains, meridional and circumferential.
        """


#: factors of a term of Ogden's: the package's own, and that of other programs
CONVENTIONS = ("mu/alpha", "2mu/alpha^2")


@dataclass(frozen=True)
class Ogden:
    """Ogden's strain energy with any number of terms (Ogden 1972; paper eq. 41).

    W = sum_k mu_k/alpha_k (lambda_1^alpha_k + lambda_2^alpha_k + (lambda_1 lambda_2)^-alpha_k - 3)

    Parameters
    ----------
    mu, alpha : tuple of float
        Moduli (in units of the shear modulus) and exponents; each mu_k alpha_k > 0 and their sum is 2.
    convention : {"mu/alpha", "2mu/alpha^2"}
        Factor of a term. Other programs write 2 mu_k/alpha_k^2 for mu_k/alpha_k (Abaqus, for example): then each mu_k > 0 and their sum is
        1. Such moduli are converted, mu_k to 2 mu_k/alpha_k, and the material remembers nothing of it.

    Raises
    ------
    InputError
        When the lengths differ, a product is not positive, or the products do not sum to 2.

    Examples
    --------
    Equal stretches of 2 in both directions, in rubber with two terms, and the same rubber as other programs write it:

    >>> from math import log
    >>> import femmembrane as fm
    >>> rubber = fm.Ogden(mu=(1.4, -0.1), alpha=(1.3, -1.8))
    >>> round(float(rubber.stress(log(2), log(2))[0]), 4)
    4.4001
    >>> same = fm.Ogden(mu=(0.91, 0.09), alpha=(1.3, -1.8), convention="2mu/alpha^2")
    >>> [round(mu, 12) for mu in same.mu], same.convention
    ([1.4, -0.1], 'mu/alpha')
    """

    mu: tuple[float, ...]
    alpha: tuple[float, ...]
    convention: str = field(default=CONVENTIONS[0], repr=False, kw_only=True, metadata={"quiet": True})

    def __post_init__(self) -> None:
        for key in ("mu", "alpha"):
            object.__setattr__(self, key, _numbers(f"material.{key}", getattr(self, key)))
        choice("material.convention", self.convention, CONVENTIONS)
        if len(self.mu) != len(self.alpha):
            raise InputError("material.alpha", self.alpha, f"as many exponents as moduli are allowed ({len(self.mu)} in material.mu)")
        if 0 in self.alpha:
            raise InputError("material.alpha", self.alpha, "exponents other than 0 are allowed")
        (self._check_own if self.convention == CONVENTIONS[0] else self._check_other)()
        if self.convention != CONVENTIONS[0]:
            moduli = tuple(2 * m / a for m, a in zip(self.mu, self.alpha, strict=True))
            store(self, mu=moduli, convention=CONVENTIONS[0])

    def _check_own(self) -> None:
        """Each mu alpha > 0, and their sum 2."""
        products = [m * a for m, a in zip(self.mu, self.alpha, strict=True)]
        other = f'convention = "{CONVENTIONS[1]}"'
        for k, product in enumerate(products):
            if not product > 0:
                hint = ""
                if all(m > 0 for m in self.mu):  # the other convention asks for just that
                    hint = f"; where the terms are 2 mu/alpha^2 (Abaqus and others), say {other}"
                raise InputError(
                    f"material.mu[{k}]",
                    self.mu[k],
                    f"mu alpha > 0 is required of every term; mu must have the sign of alpha = {self.alpha[k]!r}{hint}",
                )
        total = sum(products) / 2
        if not abs(total - 1) <= 5e-7:
            hint = f"divide mu by {total:.9g}"
            if abs(sum(self.mu) - 1) <= 5e-7:
                hint = f"the sum of mu is 1, as where the terms are 2 mu/alpha^2 (Abaqus and others): say {other}, or {hint}"
            raise InputError(
                "material.mu", self.mu, f"the sum of mu alpha must be 2 (shear modulus 1), not {2 * total:.9g}; {hint}{_in_pa(total)}"
            )

    def _check_other(self) -> None:
        """Each mu > 0, and their sum 1."""
        for k, modulus in enumerate(self.mu):
            if not modulus > 0:
                allowed = f'mu > 0 is required of every term in the convention "{self.convention}"'
                raise InputError(f"material.mu[{k}]", modulus, allowed)
        total = sum(self.mu)
        if not abs(total - 1) <= 5e-7:
            allowed = f'the sum of mu must be 1 (the shear modulus) in the convention "{self.convention}", not {total:.9g}'
            raise InputError("material.mu", self.mu, f"{allowed}; divide mu by {total:.9g}{_in_pa(total)}")

    @classmethod
    def treloar(cls) -> Ogden:
        """Three terms fitted to Treloar's vulcanised rubber: Ogden, Proc. R. Soc. Lond. A 326 (1972).

        mu = (6.3, 0.012, -0.1) kg/cm^2 with alpha = (1.3, 5, -2): a shear modulus of 4.225 kg/cm^2 (0.414 MPa), the unit here. Its full
        record is ``material_data("treloar-ogden")``.
        """
        return cls(tuple(m / 4.225 for m in (6.3, 0.012, -0.1)), (1.3, 5.0, -2.0))

    def energy(self, e1: Any, e2: Any) -> Any:
        # p + q + r cancels to second order in the strain; with (1 + p)(1 + q)(1 + r) = 1 the product form keeps all digits
        total = 0.0
        for mu, alpha in zip(self.mu, self.alpha, strict=True):
            p, q, r = _powers(alpha, e1, e2)
            last = 1 / ((1 + p) * (1 + q)) if alpha > 0 else 1 + r  # the same, from what does not tend to 0 in tension
            total = total + mu / alpha * (p * p + p * q + q * q + p * q * (p + q)) * last
        return total

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        s1 = s2 = 0.0
        for mu, alpha in zip(self.mu, self.alpha, strict=True):
            p, q, r = _powers(alpha, e1, e2)
            s1, s2 = s1 + mu * (p - r), s2 + mu * (q - r)
        return s1, s2

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        s11 = s12 = s22 = 0.0
        for mu, alpha in zip(self.mu, self.alpha, strict=True):
            p, q, r = _powers(alpha, e1, e2)
            m = mu * alpha
            s11, s12, s22 = s11 + m * (2 + p + r), s12 + m * (1 + r), s22 + m * (2 + q + r)
        return s11, s12, s22


class OgdenForm:
    """Ogden's material with terms that follow from fewer numbers; these may be symbols."""

    def terms(self) -> tuple[tuple[Any, ...], tuple[float, ...]]:
        """Moduli and exponents."""
        raise NotImplementedError

    def _ogden(self) -> Ogden:
        form = object.__new__(Ogden)  # not checked again
        for key, values in zip(("mu", "alpha"), self.terms(), strict=True):
            object.__setattr__(form, key, values)
        return form

    def energy(self, e1: Any, e2: Any) -> Any:
        return self._ogden().energy(e1, e2)

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        return self._ogden().stress(e1, e2)

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        return self._ogden().tangent(e1, e2)


@dataclass(frozen=True)
class NeoHookean(OgdenForm):
    """Neo-Hookean strain energy W = (lambda_1^2 + lambda_2^2 + lambda_3^2 - 3)/2 (Treloar 1943).

    It is Ogden's energy with one term, mu = 1 and alpha = 2.

    Examples
    --------
    Equal stretches of 2 in both directions: lambda^2 - lambda^-4 = 4 - 1/16.

    >>> from math import log
    >>> import femmembrane as fm
    >>> round(float(fm.NeoHookean().stress(log(2), log(2))[0]), 4)
    3.9375
    """

    def terms(self) -> tuple[tuple[Any, ...], tuple[float, ...]]:
        return (1.0,), (2.0,)


@dataclass(frozen=True)
class Varga(OgdenForm):
    """Varga's strain energy W = 2 (lambda_1 + lambda_2 + lambda_3 - 3) (Varga 1966): Ogden's with one term, mu = 2 and alpha = 1."""

    def terms(self) -> tuple[tuple[Any, ...], tuple[float, ...]]:
        return (2.0,), (1.0,)


@dataclass(frozen=True)
class MooneyRivlin(OgdenForm):
    """Mooney-Rivlin strain energy W = C_1 (I_1 - 3) + C_2 (I_2 - 3) (Mooney 1940, Rivlin 1948).

    Here 2 (C_1 + C_2) = 1, and I_2 is the sum of the lambda_i^-2.

    Parameters
    ----------
    ratio : float
        C_2/C_1 >= 0; 0 is neo-Hookean. The Baker-Ericksen inequality C_1 + C_2 lambda_3^2 > 0 must hold at every lambda_3. A negative ratio
        breaks it at some stretch.

    Raises
    ------
    InputError
        For a negative ratio.
    """

    ratio: float

    def __post_init__(self) -> None:
        reason = "the stress does not grow with the stretch (Baker-Ericksen) at every stretch otherwise"
        convert(self, "material.ratio", f"a finite number C2/C1 >= 0 is allowed: {reason}", least=0)

    def terms(self) -> tuple[tuple[Any, ...], tuple[float, ...]]:
        twice = 1 / (1 + self.ratio)  # 2 C_1
        return (twice, -twice * self.ratio), (2.0, -2.0)


def _powers(alpha: float, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
    """lambda_i^alpha - 1 for the three principal stretches."""
    return np.expm1(alpha * e1), np.expm1(alpha * e2), np.expm1(-alpha * (e1 + e2))


def _in_pa(modulus: float) -> str:
    """What to do with moduli that are likely to be in Pa: a shear modulus of a few units is none."""
    return f", which is the shear modulus in Pa if mu is in Pa (scales.shear_modulus = {modulus:.9g})" if modulus > 100 else ""


def _numbers(key: str, values: Any) -> tuple[float, ...]:
    allowed = "a list of one or more finite numbers is allowed"
    try:
        given = () if isinstance(values, (str, bytes)) else tuple(values)  # a text is a sequence as well
    except TypeError:
        given = ()
    if not given:
        raise InputError(key, values, allowed)
    try:
        return tuple(number(key, value, allowed) for value in given)
    except InputError as error:
        raise InputError(key, values, error.allowed) from None
