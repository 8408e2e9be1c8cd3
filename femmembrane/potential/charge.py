"""A total charge on conducting electrodes: the one term of the potential that is not local.

The energy is W - phi^2 C/2 + Q phi, stationary in the voltage phi, so that phi = Q/C. With s = phi^2 and the gradient c of the capacitance
C(x, s) at a fixed voltage (which s changes through the width of wrinkles, and the thickness of a compressible sheet)::

    E_Q' = E_phi'          E_Q'' = E_phi'' + a a^T,      a = c phi/sqrt(C + 2 s dC/ds)

Equilibria are those under the voltage Q/C, and the charge stiffens them by a spring. So the potential is evaluated at that voltage, and the
spring goes beside the band (:class:`.potential.Evaluation`). Nothing is divided by phi: a charge 0 is as good as any other.

Third derivatives, for curves of folds, are those of the energy with the voltage as one more unknown, L(x, phi) = W - phi^2 C/2 + Q phi.
With phi_x = -phi c/(C + 2 s dC/ds) from L_phi = 0, and a mode v extended by its voltage nu = phi_x . v::

    v.E_Q'' v = (v, nu).L'' (v, nu),      d(v.E_Q'' v) = [d/dx + phi_x d/dphi] (v, nu).L'' (v, nu)    at fixed (v, nu)

since (v, nu).L'' (v, nu) is stationary in nu. The same holds for the derivative with respect to a number, with phi_m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
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
#: phi that is none where third derivatives divide by its sixth power
_LEAST_PHI = 1e-20


@dataclass(frozen=True)
class VoltageRates:
    """The voltage phi of a charge, its derivatives with respect to the state and to the number of a family, and the gradient c of C."""

    phi: float
    state: Array
    number: float
    gradient: Array


class Charged:
    """The electrodes of a potential."""

    def __init__(self, potential: Potential) -> None:
        self._potential = potential

    @property
    def _fixed(self) -> bool:
        """Whether the capacitance of a state depends on its strains alone: no voltage changes the width of wrinkles, nor the thickness."""
        scene = self._potential.scene
        return not (scene.tension_field or hasattr(scene.material, "electrified"))

    @cached_property
    @BUILDING
    def expressions(self) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Densities of C, dC/ds and c at a point."""
        terms, square = self._potential.terms, self._potential.symbols[2][2]
        capacitance = -2 * (ca.substitute(terms["electric"], square, 1.0) if self._fixed else terms["electric"] / square)
        return capacitance, ca.jacobian(capacitance, square), -2 * ca.jacobian(terms["gradient"], square)

    @cached_property
    @BUILDING
    def _kernel(self) -> Replay:
        """C, dC/ds, its derivative with respect to the number of a family, and c at the points."""
        like = self._potential._like
        if like is not None and like.charged is not None:
            known = like.charged._kernel
            return Replay(known.function, self._potential.point_data, known.vectors)
        data, local, parameters = self._potential.symbols
        capacitance, slope, gradient = self.expressions
        rows = [capacitance, slope, ca.jacobian(capacitance, parameters[1]), gradient]
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
        """phi^2 at a state, and the rows of the kernel there; NaN or infinite outside the domain of the energy."""
        with np.errstate(all="ignore"):
            square, rows = self._found(x, factor)
        return float(square), rows

    def _found(self, x: Array, factor: float) -> tuple[np.float64 | float, Array]:
        whole = self._potential.charge_squared(factor)
        least = _LEAST
        rows = self._rows(x, least, factor)
        for _ in range(_STEPS):
            capacitance = rows[0].sum()  # as all below a number of NumPy, which overflows to infinity
            square = whole / capacitance**2
            if self._fixed or not math.isfinite(square):
                return square, rows
            new = self._rows(x, max(square, least), factor)
            slope, there = new[1].sum(), new[0].sum()
            # Newton's method for s C(s)^2 = Q^2
            better = square - (square * there**2 - whole) / (there**2 + 2 * square * there * slope)
            rows = self._rows(x, max(better, least), factor)
            if not abs(better * rows[0].sum() ** 2 - whole) > _CLOSE * whole or abs(better - square) <= _CLOSE * square:
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

    def rates(self, x: Array, number: float) -> VoltageRates:
        """The voltage of a charge, and how it changes with the state and with the number of a family."""
        square, rows = self._solved(x, number)
        phi, space = math.sqrt(square) if square >= 0 else math.nan, self._potential.space
        stiffness = float(rows[0].sum()) + 2 * square * float(rows[1].sum())
        gradient = space.assemble_vector(rows[3:].reshape(-1, space.n_elements))
        change = self._charge_rate(number) - phi * float(rows[2].sum())
        return VoltageRates(phi, -phi / stiffness * gradient, change / stiffness, gradient)

    def _charge_rate(self, number: float) -> float:
        """Derivative of Q with respect to the number, which Q is proportional to or does not depend on."""
        h = 1e-4 * abs(number) or 1e-8  # Q has a sense where it is the number itself, but its square does not tell it
        after, before = (math.sqrt(self._potential.charge_squared(number + k * h)) for k in (1, -1))
        return (after - before) / (2 * h)

    def number_derivative(self, x: Array, number: float) -> Array:
        """Derivative of E_Q' with respect to the number of a family, through the voltage Q/C alone, shape (n_free,)."""
        rates = self.rates(x, number)
        return -rates.phi * rates.number * rates.gradient

    @cached_property
    @BUILDING
    def _fold_kernel(self) -> Replay:
        """Derivatives of (v, nu).L'' (v, nu) - v.P V'' v - 2 q V'.v with respect to (x, P, number, phi)."""
        (data, local, parameters), t = self._potential.symbols, self._potential.terms
        mode, nu, q, phi = ca.SX.sym("mode", 4), ca.SX.sym("nu"), ca.SX.sym("q"), ca.SX.sym("phi")
        pressure, number, square = parameters[0], parameters[1], parameters[2]
        capacitance, slope, gradient = self.expressions
        force = t["gradient"] - pressure * t["volume_gradient"]
        mixed, own = -phi * gradient, -capacitance - 2 * square * slope  # L_x phi, L_phi phi
        form = ca.dot(mode, ca.jtimes(force, local, mode)) - 2 * q * ca.dot(t["volume_gradient"], mode)
        form = ca.substitute(form + 2 * nu * ca.dot(mode, mixed) + nu * nu * own, square, phi * phi)
        rows = [ca.gradient(form, part) for part in (local, pressure, number, phi)]
        symbols = [data, ca.vertcat(local, mode), ca.vertcat(pressure, number, phi, nu, q)]
        return Replay(ca.Function("charged_fold", symbols, [ca.densify(ca.vertcat(*rows))], {"cse": True}), self._potential.point_data)

    def fold_derivatives(self, x: Array, pressure: float, number: float, mode: Array, q: float) -> tuple[Array, float, float]:
        """Derivatives of v.(E_Q'' - P V'') v - 2 q V'.v with respect to x, P and the number of a family, for a mode (v, q)."""
        space, rates = self._potential.space, self.rates(x, number)
        local = np.concatenate([space.at_quadrature(x), space.at_quadrature(mode)])
        rows = self._fold_kernel(local, np.array([pressure, number, max(rates.phi, _LEAST_PHI), float(rates.state @ mode), q]))
        through = float(rows[6].sum())
        cubic = space.assemble_vector(rows[:4].reshape(-1, space.n_elements)) + through * rates.state
        return cubic, float(rows[4].sum()), float(rows[5].sum()) + through * rates.number

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
