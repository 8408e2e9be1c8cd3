"""The potential of scenes that differ in one number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from ..errors import InputError
from ..kernels.interface import Array
from ..physics.response import squared
from ..threads import cached_property
from .expressions import BUILDING, casadi_answers_numpy
from .potential import Potential, require_elements
from .replay import Replay

if TYPE_CHECKING:
    from ..scene import Scene


@dataclass(slots=True)
class FoldDerivatives:
    """Derivatives that a fold followed in a number of the scene needs, for a mode (v, q) of displacement and pressure.

    ``cubic``, ``cubic_pressure`` and ``cubic_number`` differentiate the quadratic form v.(E'' - P V'') v - 2 q V'.v with respect to x
    (shape (n_free,)), P and the number. ``force_number`` differentiates E' - P V' with respect to the number, shape (n_free,).
    """

    cubic: Array
    cubic_pressure: float
    cubic_number: float
    force_number: Array


class Family(Potential):
    """The potential of scenes that differ in one number, built once for all its values.

    It is a :class:`Potential` whose factor, third argument of :meth:`evaluate`, is the number.

    Parameters
    ----------
    scene : Scene
        Any member of the family.
    vary : callable
        The parts of the member at a value of the number, a CasADi symbol here: an object with the attributes of a scene.
    """

    @BUILDING
    def __init__(self, scene: Scene, vary: Callable[[Any], Any], quadrature: int | None = None) -> None:
        require_elements(scene)
        number = ca.SX.sym("number")
        with casadi_answers_numpy():
            super().__init__(vary(number), quadrature)
        self.electric = self.scene.electricity  # of the family: with the number as a symbol, or another than that of the scene below
        self._vary = vary
        self.scene, self.sources, self.loads = scene, scene.sources, scene.loads
        slot = self.symbols[2][1]
        names = list(self.terms)
        old, new = ca.vertcat(slot, number), ca.vertcat(1.0, slot)
        self.terms = {name: ca.substitute(self.terms[name], old, new) for name in names}

    def square(self, x: Array, factor: float = 1.0) -> float | None:
        if self.electric is None:
            return None
        return super().square(x, factor) if self.charged is not None else float(squared(self._vary(factor).electricity))

    def charge_squared(self, factor: float) -> float:
        return float(self._vary(factor).electricity.total_charge) ** 2

    @cached_property
    @BUILDING
    def _fold_kernel(self) -> Replay:
        t, (data, local, parameters) = self.terms, self.symbols
        mode, q = ca.SX.sym("mode", 4), ca.SX.sym("q")
        force = t["gradient"] - parameters[0] * t["volume_gradient"]
        form = ca.dot(mode, ca.jtimes(force, local, mode)) - 2 * q * ca.dot(t["volume_gradient"], mode)
        rows = [ca.gradient(form, local), ca.gradient(form, parameters), ca.jacobian(force, parameters[1])]
        symbols = [data, ca.vertcat(local, mode), ca.vertcat(parameters, q)]
        return Replay(ca.Function("fold", symbols, [ca.densify(ca.vertcat(*rows))], {"cse": True}), self.point_data)

    @cached_property
    @BUILDING
    def _number_kernel(self) -> Replay:
        t, (data, local, parameters) = self.terms, self.symbols
        rows = ca.jacobian(t["gradient"], parameters[1])  # the volume knows no number
        return Replay(ca.Function("number", [data, local, parameters], [ca.densify(rows)], {"cse": True}), self.point_data)

    def number_derivative(self, x: Array, pressure: float, number: float) -> Array:
        """Derivative of E' - P V' with respect to the number, shape (n_free,)."""
        more = [] if self.charged is None else [self.charged.square(x, number)]
        rows = self._number_kernel(self.space.at_quadrature(x), np.array([pressure, number, *more]))
        own = self.space.assemble_vector(rows.reshape(-1, self.space.n_elements))
        return own if self.charged is None else own + self.charged.number_derivative(x, number)

    def fold_derivatives(self, x: Array, pressure: float, number: float, mode: Array, q: float) -> FoldDerivatives:
        """Third derivatives contracted twice with a mode (v, q), and derivatives with respect to the number."""
        if self.charged is not None:
            allowed = "a voltage is allowed, whose folds are local: a total charge couples all points of the membrane"
            raise InputError("electric.total_charge", self.charged.total, allowed)
        space, ne = self.space, self.space.n_elements
        local = np.concatenate([space.at_quadrature(x), space.at_quadrature(mode)])
        out = self._fold_kernel(local, np.array([pressure, number, q]))
        cubic, force = (space.assemble_vector(rows.reshape(-1, ne)) for rows in (out[:4], out[6:]))
        return FoldDerivatives(cubic, float(out[4].sum()), float(out[5].sum()), force)
