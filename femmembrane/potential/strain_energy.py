"""Strain energies of one's own."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ..checks import store, switch
from ..errors import InputError
from .expressions import BUILDING, casadi_answers_numpy, point_rows
from .replay import at_points


@dataclass(frozen=True)
class StrainEnergy:
    """A strain energy of your own; it has no name in scene files.

    Stress and tangent are the exact derivatives by CasADi. They keep the digits that the function keeps. A function that subtracts numbers
    of order one leaves round-off of 1e-16 mu in the stress, which is too coarse for a nearly flat membrane alone (strains below 1e-8).

    Parameters
    ----------
    function : callable
        W(lambda_1, lambda_2) of an isotropic incompressible membrane, in units of the shear modulus. It may use arithmetic and NumPy's
        ufuncs, which act on arrays and CasADi symbols alike; ``np.where`` does not.
    prestressed : bool
        Whether there may be stress at rest. Then it must be a tension, W need not be 0 there, and mu is what the function is in units of. A
        flat membrane of it has stiffness at rest.

    Raises
    ------
    InputError
        For a function that does not accept symbols, is not 0 and free of stress at rest, is not symmetric in the two stretches, or has a
        shear modulus other than 1. For a pre-stressed one that is compressed at rest, or has no stiffness in its plane there.

    Examples
    --------
    >>> import femmembrane as fm
    >>> own = fm.StrainEnergy(lambda l1, l2: (l1**2 + l2**2 + 1 / (l1 * l2) ** 2 - 3) / 2)  # neo-Hookean
    >>> print(f"{fm.equilibrium(fm.Scene(material=own, mesh=fm.disc(16)), volume=1.0).pressure:.4f}")
    1.0669

    A sheet that was stretched by 1.5 and then clamped, with lengths and thickness as they were then: the tension at rest is p^2 - p^-4.

    >>> stretched = lambda l1, l2, p=1.5: own.function(p * l1, p * l2)
    >>> tense = fm.StrainEnergy(stretched, prestressed=True)
    >>> round(float(tense.stress(0.0, 0.0)[0]), 4)
    2.0525
    """

    function: Callable[[Any, Any], Any]
    prestressed: bool = False

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise InputError("material.function", self.function, "a function of the stretches (lambda_1, lambda_2) is allowed")
        if (count := _stretches(self.function)) not in (2, None):
            counted = f"a function of two stretches (lambda_1, lambda_2) is needed, and it takes {count} argument{'s'[: count != 1]}"
            hint = "; the third stretch is 1/(lambda_1 lambda_2), for the material is incompressible" if count == 3 else ""
            raise InputError("material.function", self.function, counted + hint)
        try:
            rest, there, mirrored = at_points(_derivatives(self.function), np.array([0, 0.2, 0.1]), np.array([0, 0.1, 0.2])).T
        except Exception as error:  # whatever a stranger's function raises
            what = f"it must accept symbols ({type(error).__name__}: {error}); use arithmetic and NumPy's ufuncs"
            raise InputError("material.function", self.function, what) from error
        store(self, prestressed=switch("material.prestressed", self.prestressed))
        if not self.prestressed and not np.allclose(rest[:3], 0, atol=1e-10):
            found = ", ".join(f"{v:.6g}" for v in rest[:3])
            hint = "; say prestressed=True where the membrane is under tension at rest" if rest[1] > 0 else ""
            raise InputError("material.function", self.function, f"W and both stresses must be 0 at rest, not {found}{hint}")
        if not np.allclose(there, mirrored[[0, 2, 1, 5, 4, 3]], rtol=1e-8):
            raise InputError("material.function", self.function, "it must be symmetric in the two stretches (isotropic)")
        if self.prestressed:
            self._check_tension(rest)
        elif not np.allclose(rest[3:], [4, 2, 4], rtol=1e-6):
            what = f"the shear modulus must be 1, not {rest[4] / 2:.9g}; divide W by it (W = 2 (e1^2 + e1 e2 + e2^2) at small log strains)"
            raise InputError("material.function", self.function, what)

    def _check_tension(self, rest: Any) -> None:
        _, s, _, s11, s12, _ = rest
        if not s >= 0:
            raise InputError("material.function", self.function, f"a tension is allowed at rest, not the stress {s:.6g}")
        if not s11 - s > abs(s12):  # second derivatives with respect to the stretches
            what = f"it must be stiff in its plane at rest, not W_11 = {s11 - s:.6g} with W_12 = {s12:.6g}"
            raise InputError("material.function", self.function, what)

    def energy(self, e1: Any, e2: Any) -> Any:
        return self.function(np.exp(e1), np.exp(e2))

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        s1, s2 = self._rows(e1, e2)[1:3]
        return s1, s2

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        s11, s12, s22 = self._rows(e1, e2)[3:]
        return s11, s12, s22

    def _rows(self, e1: Any, e2: Any) -> list[Any]:
        function = _derivatives(self.function)
        if isinstance(e1, ca.SX) or isinstance(e2, ca.SX):
            return list(ca.vertsplit(function(ca.vertcat(e1, e2))))
        e1, e2 = np.broadcast_arrays(np.asarray(e1, dtype=float), np.asarray(e2, dtype=float))
        return [row.reshape(e1.shape) for row in at_points(function, e1, e2)]


def _stretches(function: Callable[..., Any]) -> int | None:
    """How many arguments a function needs that cannot be called with two; 2 where it can, None where nobody knows."""
    try:
        signature = inspect.signature(function)
    except (ValueError, TypeError):  # of a ufunc, or written in C
        return None
    try:
        signature.bind(None, None)
    except TypeError:
        kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
        placed = [p for p in signature.parameters.values() if p.kind in kinds]
        needed = [p for p in placed if p.default is p.empty]
        return None if len(placed) == 2 else len(needed) if len(needed) > 2 else len(placed)
    return 2


@lru_cache(maxsize=64)
@BUILDING
def _derivatives(function: Callable[[Any, Any], Any]) -> ca.Function:
    """(e_1, e_2) -> W, s_1, s_2, and the second derivatives with respect to the Hencky strains."""
    e = ca.SX.sym("e", 2)
    with casadi_answers_numpy():
        energy = function(np.exp(e[0]), np.exp(e[1]))
    hessian, gradient = ca.hessian(energy, e)
    return point_rows([e], [energy, gradient, hessian[0, 0], hessian[0, 1], hessian[1, 1]])
