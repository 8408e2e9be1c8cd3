"""The potential of scenes that differ in several numbers: built once, for all values of them, with exact derivatives.

The numbers m are further parameters of the point expressions. One pass over the points gives the derivatives of the forces E' - P V' and of
the volume with respect to all of them, so that ten numbers cost little more than one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from ..discretization.lift import Moving
from ..errors import InputError
from ..kernels.interface import Array, Elements
from ..physics.magnetisation import Magnetisation
from ..threads import cached_property
from .evaluation import Evaluation
from .expressions import BUILDING, casadi_answers_numpy
from .of_scene import potential_of, require_elements
from .potential import Potential
from .replay import Replay

if TYPE_CHECKING:
    from ..scene.variation import Numbers

#: energies that a potential is the sum of, by the names of their terms
ENERGIES = ("elastic", "magnetic", "load", "electric")


@dataclass(slots=True)
class NumberDerivatives:
    """Derivatives at fixed (x, P) with respect to m numbers: of E' - P V', shape (n_free, m), and of the volume and the height of the pole.

    Attributes
    ----------
    force : ndarray, shape (n_free, m)
    volume, height : ndarray, shape (m,)
    """

    force: Array
    volume: Array
    height: Array


@dataclass(slots=True)
class FormDerivatives:
    """Derivatives of v.(E'' - P V'') v - 2 q V'.v for a fixed mode (v, q).

    Attributes
    ----------
    state : ndarray, shape (n_free,)
        With respect to x.
    pressure : float
    numbers : ndarray, shape (m,)
    """

    state: Array
    pressure: float
    numbers: Array


class Numbered(Potential):
    """The potential of scenes that differ in several numbers.

    Parameters
    ----------
    numbers : Numbers
        At most one of them may move an end of the membrane.
    """

    @BUILDING
    def __init__(self, numbers: Numbers) -> None:
        scene = numbers.scene
        require_elements(scene)
        self.numbers, self.values = numbers, numbers.values
        own = [ca.SX.sym("number") for _ in numbers.names]
        with casadi_answers_numpy():
            member = numbers.vary(own)
            super().__init__(member)
        self._way: Moving | None = getattr(member, "lifted", None)
        self.electric = self.scene.electricity
        self.scene, self.sources, self.loads = scene, scene.sources, scene.loads
        self.magnetisation = Magnetisation.of(scene) if scene.sources else None
        data, local, parameters = self.symbols
        self._own, self._given = ca.vertcat(ca.SX(0, 1), *own), parameters
        self.symbols = data, local, ca.vertcat(parameters, *own)

    def at(self, values: Sequence[float]) -> NumberedMember:
        """The potential at values of the numbers; nothing is built for it. They are not checked.

        Raises
        ------
        InputError
            With a total charge, which is not local.
        """
        if self.charged is not None:
            raise InputError("electric.total_charge", self.charged.total, "a voltage is allowed here: a total charge couples all points")
        return NumberedMember(self, tuple(float(value) for value in values))

    def pole_rise_at(self, values: Sequence[float]) -> float:
        """How far the pole stands above its place in the space while all unknowns are zero."""
        k = self._mover
        return 0.0 if self._way is None or k is None else self._way.unit.axial[0] * (values[k] - self._way.at)

    @cached_property
    def _mover(self) -> int | None:
        """Which number moves an end of the membrane; None where none does."""
        return next((k for k, parameter in enumerate(self.numbers.parameters) if parameter.moves), None)

    def charge_squared(self, factor: float) -> float:
        return float(getattr(self.scene.electricity, "total_charge", None) or 0.0) ** 2

    def _parameters(self, x: Array, pressure: float, values: Sequence[float]) -> Array:
        square = [] if self.charged is None else [self._square(x)]
        return np.array([pressure, 1.0, *square, *values])

    def _square(self, x: Array) -> float:
        return float(potential_of(self.scene).square(x) or 0.0)

    @cached_property
    @BUILDING
    def _number_kernel(self) -> Replay:
        t, pressure = self.terms, self._given[0]
        rows = [ca.jacobian(t["gradient"] - pressure * t["volume_gradient"], self._own), ca.jacobian(t["volume"], self._own)]
        if self.charged is not None:  # of the capacitance, and of the gradient of it
            capacitance = -2 * t["electric"] / self._given[2]
            rows.append(ca.jacobian(capacitance, self._own))
        columns = [ca.vertcat(*(row[:, k] for row in rows)) for k in range(len(self.numbers.names))]
        return self._replay("numbers", columns)

    def _replay(self, name: str, rows: Sequence[Any], more: Sequence[Any] = ()) -> Replay:
        data, local, parameters = self.symbols
        symbols = [data, ca.vertcat(local, *more[:1]), ca.vertcat(parameters, *more[1:])]
        return Replay(ca.Function(name, symbols, [ca.densify(ca.vertcat(*rows))], {"cse": True}), self.point_data)

    def derivatives(self, x: Array, pressure: float, values: Sequence[float] | None = None) -> NumberDerivatives:
        """Derivatives of the forces, of the volume and of the height of the pole with respect to all numbers.

        Parameters
        ----------
        x : ndarray, shape (n_free,)
        pressure : float
        values : sequence of float, optional
            Of the numbers; default: those of the scene.
        """
        values = self.values if values is None else values
        count, space = len(self.numbers.names), self.space
        if not count:
            return NumberDerivatives(np.zeros((space.n_free, 0)), np.zeros(0), np.zeros(0))
        out = self._number_kernel(space.at_quadrature(x), self._parameters(x, pressure, values))
        out = out.reshape(count, -1, self.n_points)
        force = np.stack([space.assemble_vector(rows[:4].reshape(-1, space.n_elements)) for rows in out], axis=1)
        if self.charged is not None:
            force = force + self._by_charge(x, out[:, 5].sum(axis=1))
        volume, height = np.zeros(count), np.zeros(count)
        if self._way is not None and (k := self._mover) is not None:
            volume[k], height[k] = float(out[k, 4].sum()), self._way.unit.axial[0]
        return NumberDerivatives(force, volume, height)

    def _by_charge(self, x: Array, capacitance: Array) -> Array:
        """What the voltage Q/C that a total charge has adds to the derivatives of the forces, shape (n_free, m)."""
        charged = potential_of(self.scene).charged
        if charged is None:
            return np.zeros((self.space.n_free, len(capacitance)))
        parameters = self.numbers.parameters
        own = np.array([1 / p.unit if p.name == "electric.total_charge" else 0.0 for p in parameters])
        return charged.spread(x, own, capacitance)

    @cached_property
    @BUILDING
    def _energy_kernel(self) -> Replay:
        local = self.symbols[1]
        whole = [self.terms[name] for name in ENERGIES if name in self.terms]
        return self._replay("energies", [row for term in whole for row in (ca.gradient(term, local), ca.gradient(term, self._own))])

    def energy_derivatives(self, x: Array, pressure: float) -> dict[str, tuple[Array, Array]]:
        """Derivatives of each energy with respect to x and to the numbers of the scene, without a total charge."""
        count, space, found = len(self.numbers.names), self.space, {}
        out = self._energy_kernel(space.at_quadrature(x), self._parameters(x, pressure, self.values))
        known = [name for name in ENERGIES if name in self.terms]
        for name, rows in zip(known, out.reshape(len(known), 4 + count, -1), strict=True):
            found[name] = space.assemble_vector(rows[:4].reshape(-1, space.n_elements)), rows[4:].sum(axis=1)
        return found

    @cached_property
    @BUILDING
    def _form_kernel(self) -> Replay:
        t, (_, local, parameters) = self.terms, self.symbols
        mode, q = ca.SX.sym("mode", 4), ca.SX.sym("q")
        force = t["gradient"] - parameters[0] * t["volume_gradient"]
        form = ca.dot(mode, ca.jtimes(force, local, mode)) - 2 * q * ca.dot(t["volume_gradient"], mode)
        rows = [ca.gradient(form, local), ca.gradient(form, self._given[0]), ca.gradient(form, self._own)]
        return self._replay("form", rows, (mode, q))

    def form_derivatives(self, x: Array, pressure: float, mode: Array, q: float) -> FormDerivatives:
        """Third derivatives contracted twice with a mode (v, q), at the numbers of the scene, without a total charge."""
        space = self.space
        local = np.concatenate([space.at_quadrature(x), space.at_quadrature(mode)])
        out = self._form_kernel(local, np.append(self._parameters(x, pressure, self.values), q))
        return FormDerivatives(
            space.assemble_vector(out[:4].reshape(-1, space.n_elements)), float(out[4].sum()), np.asarray(out[5:].sum(axis=1))
        )


class NumberedMember(Potential):
    """The potential at values of the numbers: the functions of :class:`Numbered`, called with them."""

    def __init__(self, family: Numbered, values: tuple[float, ...]) -> None:
        self.family, self.values, self.scene = family, values, family.scene
        own = ("sources", "loads", "space", "magnetisation", "sheet", "level", "symbols", "point_data", "n_points", "electric")
        for name in (*own, "strained", "flat", "terms"):
            self.__dict__[name] = getattr(family, name)

    @property
    def elements(self) -> Elements:
        return self.family.elements

    @property
    def bulk(self) -> Array:  # type: ignore[override]
        """That of all members."""
        return self.family.bulk

    @property
    def mass(self) -> Array:  # type: ignore[override]
        """That of all members."""
        return self.family.mass

    @property
    def area(self) -> float:  # type: ignore[override]
        """That of all members."""
        return self.family.area

    def pole_rise(self, factor: float) -> float:
        return self.family.pole_rise_at(self.values)

    def evaluate(self, x: Array, pressure: float, magnetic: float = 1.0, slot: float | None = None) -> Evaluation:
        elements, x = self.elements, np.ascontiguousarray(x, dtype=float)
        return Evaluation(x, elements.evaluate(x, pressure, magnetic, *self.values), self, elements, magnetic)
