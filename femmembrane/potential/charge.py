"""A total charge on conducting electrodes: the one term of the potential that is not local.

The energy is W - phi^2 C/2 + Q phi, stationary in the voltage phi, so that phi = Q/C. With s = phi^2 and the gradient c of the capacitance
C(x, s) at a fixed voltage (which s changes in a tension field alone, through the width of its wrinkles)::

    E_Q' = E_phi'          E_Q'' = E_phi'' + a a^T,      a = c phi/sqrt(C + 2 s dC/ds)

Equilibria are those under the voltage Q/C, and the charge stiffens them by a spring. So the potential is evaluated at that voltage, and the
spring goes beside the band (:class:`.potential.Evaluation`). Nothing is divided by phi: a charge 0 is as good as any other.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from ..kernels.interface import Array
from ..threads import cached_property
from .expressions import BUILDING
from .replay import Replay

if TYPE_CHECKING:
    from .potential import Potential

#: relative change of phi^2 below which the voltage of a charge is known, and most steps to it
_CLOSE, _STEPS = 1e-15, 50
#: phi^2 that is none, and still has all its digits
_LEAST = 1e-200


class Charged:
    """The electrodes of a potential."""

    def __init__(self, potential: Potential) -> None:
        self._potential = potential

    @cached_property
    @BUILDING
    def _kernel(self) -> Replay:
        """C, dC/ds, its derivative with respect to the number of a family, and c at the points."""
        (data, local, parameters), terms = self._potential.symbols, self._potential.terms
        capacitance = -2 * ca.substitute(terms["electric"], parameters[2], 1.0)  # of a fixed width
        if self._potential.scene.tension_field:
            capacitance = -2 * terms["electric"] / parameters[2]
        slopes = [ca.jacobian(capacitance, parameters[k]) for k in (2, 1)]
        rows = [capacitance, *slopes, -2 * ca.jacobian(terms["gradient"], parameters[2])]
        return Replay(
            ca.Function("capacitance", [data, local, parameters], [ca.densify(ca.vertcat(*rows))], {"cse": True}),
            self._potential.point_data,
        )

    @property
    def total(self) -> float:
        """Q."""
        return math.sqrt(self._potential.charge_squared(1.0))

    def _rows(self, x: Array, square: float, factor: float) -> Array:
        return self._kernel(self._potential.space.at_quadrature(x), np.array([0.0, factor, square]))

    def _solved(self, x: Array, factor: float) -> tuple[float, Array]:
        """phi^2 at a state, and the rows of the kernel there."""
        whole = self._potential.charge_squared(factor)
        least = _LEAST
        rows = self._rows(x, least, factor)
        for _ in range(_STEPS):
            capacitance = float(rows[0].sum())
            square = whole / capacitance**2
            if not self._potential.scene.tension_field or not math.isfinite(square):
                return square, rows
            new = self._rows(x, max(square, least), factor)
            slope, there = float(new[1].sum()), float(new[0].sum())
            # Newton's method for s C(s)^2 = Q^2
            better = square - (square * there**2 - whole) / (there**2 + 2 * square * there * slope)
            rows = self._rows(x, max(better, least), factor)
            if not abs(better * float(rows[0].sum()) ** 2 - whole) > _CLOSE * whole or abs(better - square) <= _CLOSE * square:
                return better, rows
        return math.nan, rows

    def square(self, x: Array, factor: float = 1.0) -> float:
        """phi^2 at a state."""
        return self._solved(x, factor)[0]

    def at(self, x: Array, factor: float) -> tuple[float, Array]:
        """phi^2 at a state, and the spring."""
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):  # outside the domain of the energy the answer is NaN
            square, rows = self._solved(x, factor)
            space = self._potential.space
            gradient = space.assemble_vector(rows[3:].reshape(-1, space.n_elements))
            stiffness = float(rows[0].sum()) + 2 * square * float(rows[1].sum())
            return square, gradient * math.sqrt(square / stiffness) if square / stiffness >= 0 else gradient * math.nan

    def energy(self, x: Array, factor: float) -> float:
        """Q^2/(2 C), with the 2 pi."""
        square, rows = self._solved(x, factor)
        return square * float(rows[0].sum()) / 2

    def number_derivative(self, x: Array, number: float) -> Array:
        """Derivative of E_Q' with respect to the number of a family, through the voltage Q/C alone, shape (n_free,)."""
        h = 1e-4 * abs(number) + 1e-8
        square, rows = self._solved(x, number)
        change = (math.sqrt(self._potential.charge_squared(number + h)) - math.sqrt(self._potential.charge_squared(number - h))) / (2 * h)
        space = self._potential.space
        gradient = space.assemble_vector(rows[3:].reshape(-1, space.n_elements))
        change = math.sqrt(square) * change - square * float(rows[2].sum())
        return -gradient * change / (float(rows[0].sum()) + 2 * square * float(rows[1].sum()))

    def spread(self, x: Array, charge: Array, capacitance: Array) -> Array:
        """Derivatives of E_Q' with respect to several numbers through the voltage Q/C alone, shape (n_free, m).

        Parameters
        ----------
        x : ndarray, shape (n_free,)
        charge, capacitance : ndarray, shape (m,)
            Derivatives of Q, and of C at a fixed state and voltage.
        """
        square, rows = self._solved(x, 1.0)
        space = self._potential.space
        gradient = space.assemble_vector(rows[3:].reshape(-1, space.n_elements))
        change = math.sqrt(square) * charge - square * capacitance
        return -np.outer(gradient, change) / (float(rows[0].sum()) + 2 * square * float(rows[1].sum()))
