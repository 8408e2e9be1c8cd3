"""The potential of scenes before rigid bodies that differ in one number, which may be one of a body, or of a magnet that brings its own.

On a set of held nodes the positions x and the number m obey R = E' - P V' - sum force_i n_i = 0 and gap_i(x, m) = 0. A held node goes with
its body: dx/dm has the normal part -n dgap/dm, the *shift*, whatever the membrane does. What is left for the tangential displacements is ::

    T^T K T dy + T^T (dR/dm + K shift - sum force_i dn_i/dm) dm - T^T V' dP = 0,        dx = T dy + shift dm

with K the second derivatives of E - P V, since the curvature of a body has no part along its normal. A number that moves an end carries the
nodes at fixed unknowns, which is one more change of gaps and normals.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..kernels import kernels
from ..kernels.interface import Array
from ..physics.loads import over_projection
from ..physics.obstacles import Obstacle, rows_of
from ..scene.variation import Parameter
from .contact import ACROSS, ContactEvaluation, ContactPotential, Held
from .evaluation import Evaluation
from .family import Family, FoldDerivatives
from .following import Borders, Mask
from .of_scene import potential_of
from .potential import Potential

if TYPE_CHECKING:
    from types import SimpleNamespace

    from ..scene import Scene

#: change of a number, over its size and over that of the membrane, from which the rates of the numbers of a profile are taken: these are
#: linear in most numbers
_STEPS = (2.0**-8, 2.0**-16)
#: weights of the values at one and two steps on either side, and on one side alone
_CENTRAL = {1: 8 / 12, -1: -8 / 12, 2: -1 / 12, -2: 1 / 12}
_ONE_SIDED = {0: -25 / 12, 1: 48 / 12, 2: -36 / 12, 3: 16 / 12, 4: -3 / 12}
#: values of the number whose bodies are kept
_KEPT = 8

Rows = tuple[Array, Array]


class ContactFamily(ContactPotential, Family):
    """The potential of scenes before bodies that differ in a number, built once for all its values.

    Parameters
    ----------
    parameter : Parameter
    root, borders
        The family on the mesh of the scene, and the ends of elements that stand at borders of contact here.
    """

    def __init__(self, parameter: Parameter, root: ContactFamily | None = None, borders: Borders = ()) -> None:
        self._root = self._like = root  # type: ignore[assignment]  # of this class
        self.parameter, self._here = parameter, borders

        def vary(number: Any) -> SimpleNamespace:
            parts: SimpleNamespace = parameter.vary(number)
            parts.borders = borders
            return parts

        Family.__init__(self, parameter.scene, vary, scene_at=parameter.scene_at, even=parameter.even)
        self.obstacles = parameter.scene.bodies
        self._moved = {}
        self._known: dict[float, tuple[tuple[Obstacle, ...], list[Rows]]] = {} if root is None else root._known

    @property
    def borders(self) -> Borders:  # type: ignore[override]
        return self._here

    @property
    def given(self) -> float:
        return self.parameter.value

    def _on(self, borders: Borders) -> ContactFamily:  # type: ignore[override]  # the one of its kind
        return ContactFamily(self.parameter, self, borders)

    def holding(self, held: Mask) -> HeldFamily:
        return HeldFamily(self, held)

    def member(self, number: float) -> Potential:
        """The potential of the scene that has a value of the number, on the mesh of the scene."""
        return potential_of(self._scene_at(number))

    def scene_at(self, number: float) -> Scene:
        return self._scene_at(number)  # a member is shared by scenes with other scales and analyses, and its own scene has none

    def by_itself(self, factor: float) -> tuple[Potential, float]:
        return self.member(factor), 1.0

    def takes(self, number: float) -> bool:
        try:
            self._scene_at(number)
        except InputError:
            return False
        return True

    def home(self, evaluation: Evaluation, pressure: float) -> Evaluation:
        scene = self._scene_at(evaluation.factor).bordered(evaluation.potential.borders)
        return potential_of(scene).evaluate(evaluation.x, pressure)

    def edge_load(self, evaluation: Evaluation, eta: float) -> float:
        return float(over_projection(self._vary(evaluation.factor).loads, np.array(eta))[0]) if self.loads else 0.0

    # --- bodies and nodes at a value of the number

    def bodies_at(self, factor: float) -> tuple[Obstacle, ...]:
        return self._profiles(factor)[0] if self.parameter.shapes else self.obstacles

    def rest_at(self, factor: float) -> tuple[Array, Array]:
        R, Z = self._rest
        if self._way is None:
            return R, Z
        u, w = (factor - self._way.at) * self._carrier
        return R + u, Z + w

    @property
    def _carrier(self) -> Array:
        """How the number moves the nodes at fixed unknowns, shape (2, n)."""
        if self._way is None:
            return np.zeros((2, self.nodes.size))
        found: Array = self._way.unit.at(self.space.mesh, self.parameters)[[0, 2]]
        return found

    def _profiles(self, number: float) -> tuple[tuple[Obstacle, ...], list[Rows]]:
        """The bodies at a value, and the rates of the rows of their profiles."""
        known = self._known.pop(number, None)
        if known is None:
            bodies = self.parameter.bodies_at(number)
            known = bodies, self._rates(number, bodies)
        self._known[number] = known
        if len(self._known) > _KEPT:
            self._known.pop(next(iter(self._known)), None)
        return known

    def _rates(self, number: float, bodies: tuple[Obstacle, ...]) -> list[Rows]:
        for size in (max(abs(number), self.space.unit), abs(number)):
            for step in (share * size for share in _STEPS if size):
                for sign, weights in ((1.0, _CENTRAL), (1.0, _ONE_SIDED), (-1.0, _ONE_SIDED)):
                    found = self._difference(number, bodies, sign * step, weights)
                    if found is not None:
                        return found
        raise InputError(self.parameter.name, number, "a value around which the body keeps its kind of profile is allowed")

    def _difference(self, number: float, bodies: tuple[Obstacle, ...], step: float, weights: dict[int, float]) -> list[Rows] | None:
        """Rates from values at a few steps; None where a body does not exist there, or has another number of pieces."""
        rates = [tuple(np.zeros_like(part) for part in body.table) for body in bodies]
        try:
            for k, weight in weights.items():
                for body, rows in zip(self.parameter.bodies_at(number + k * step), rates, strict=True):
                    for part, row in zip(rows_of(body.pieces()), rows, strict=True):
                        if part.shape != row.shape:
                            return None
                        row += weight / step * np.where(np.isfinite(part), part, 0.0)
        except InputError:
            return None
        return rates  # type: ignore[return-value]  # two rows each

    # --- how the number moves what bodies hold

    def drift(self, evaluation: ContactEvaluation) -> Array:
        """Rates of gap and normal of :attr:`nodes` with the number at fixed unknowns, in the motions that they have, shape (3, n)."""
        factor, gaps = evaluation.factor, evaluation.gaps
        rho, eta = self.positions(evaluation.x, factor)
        found = np.zeros((3, rho.size))
        bodies = self.bodies_at(factor)
        if self.parameter.shapes:
            each = [body.drift(rho, eta, rates) for body, rates in zip(bodies, self._profiles(factor)[1], strict=True)]
            found += np.choose(gaps.body, each)
        touches = [body.touch(rho, eta) for body in bodies]
        a, b, curvature = (np.choose(gaps.body, [getattr(t, name) for t in touches]) for name in ("n_rho", "n_eta", "curvature"))
        if self._way is not None:
            u, w = self._carrier
            along = curvature * (w * a - u * b)
            found += np.stack([a * u + b * w, -b * along, a * along])
        (iu, iw), n = self.place, self.space.n_free
        for first, second, across in ((iu, iw, a), (iw, iu, b)):
            alone = (first < n) & (second == n)
            found[0] = np.where(alone, found[0] / np.maximum(np.abs(across), ACROSS), found[0])
            found[1:, alone] = 0.0
        return found

    def advance(self, evaluation: Evaluation) -> float:
        if not isinstance(evaluation, ContactEvaluation):
            return 0.0
        return float(np.abs(self.drift(evaluation)[0]).max(initial=0.0)) / self.space.unit

    def number_rates(self, evaluation: Evaluation, pressure: float) -> tuple[Array, Array | None]:
        """Derivative of the balance of the tangential displacements with respect to the number, and the shift of held nodes."""
        if not isinstance(evaluation, ContactEvaluation):
            return super().number_rates(evaluation, pressure)
        n, held, gaps = self.space.n_free, evaluation.held, evaluation.gaps
        force = np.append(self.number_derivative(evaluation.x, pressure, evaluation.factor), 0.0)
        shift = np.zeros(n + 1)
        if held.any() and (self.parameter.shapes or self._way is not None):
            iu, iw = (k[held] for k in self.place)
            rate, a, b = self.drift(evaluation)[:, held]
            shift[iu] = -gaps.n_rho[held] * rate
            shift[iw] = -gaps.n_eta[held] * rate
            shift[n] = 0.0
            force[:-1] += self._stiff(evaluation.raw, shift[:-1])
            work = evaluation.forces[held]
            np.subtract.at(force, iu, work * a)
            np.subtract.at(force, iw, work * b)
        return evaluation.reduction.projected(force[:-1]), shift[:-1]

    def fold_rates(self, evaluation: Evaluation, pressure: float, mode: Array, q: float) -> tuple[FoldDerivatives, Array | None]:
        """Derivatives of the form of the tangential displacements, for a mode that bodies leave.

        A held node goes along its body: with the tangential displacement a of a node its position has the second derivative -k n a^2, k the
        curvature of the body. So the form is v . (E'' - P V'') v - sum k a^2 n . (E' - P V') - 2 q V' . v.
        """
        if not isinstance(evaluation, ContactEvaluation):
            return super().fold_rates(evaluation, pressure, mode, q)
        raw, gaps, n = evaluation.raw, evaluation.gaps, self.space.n_free
        force, shift = self.number_rates(evaluation, pressure)
        t = self.fold_derivatives(raw.x, pressure, evaluation.factor, mode, q)
        iu, iw = self.place
        bent = evaluation.held & (iu < n) & (iw < n) & (gaps.curvature != 0)
        iu, iw, a, b, k = iu[bent], iw[bent], gaps.n_rho[bent], gaps.n_eta[bent], gaps.curvature[bent]
        along = -mode[iu] * b + mode[iw] * a

        def normal(v: Array) -> Array:
            return a * v[iu] + b * v[iw]

        inward = np.zeros(n)
        inward[iu], inward[iw] = k * along**2 * a, k * along**2 * b
        row = t.cubic - self._stiff(raw, inward)
        turned = 2 * k * along * (q * normal(raw.volume_gradient) - normal(self._stiff(raw, mode)))
        row[iu] -= turned * b
        row[iw] += turned * a
        pressed = t.cubic_pressure + float(inward @ raw.volume_gradient)
        if self.parameter.shapes or self._way is not None:
            number = self._form_rate(evaluation, pressure, evaluation.reduced(mode), q, np.zeros(n) if shift is None else shift)
        else:
            number = t.cubic_number - float(inward @ self.number_derivative(raw.x, pressure, evaluation.factor))
        return FoldDerivatives(evaluation.reduction.projected(row), pressed, number, force), shift

    def _stiff(self, raw: Evaluation, v: Array) -> Array:
        """(E'' - P V'') v, without what bodies take."""
        own = kernels().product(raw.band, self.space.half_bandwidth, v)
        return own if raw.spring is None else own + raw.spring * float(raw.spring @ v)

    def _form_rate(self, evaluation: ContactEvaluation, pressure: float, reduced: Array, q: float, shift: Array) -> float:
        """Derivative of that form with respect to the number while held nodes go with their bodies."""
        number, held = evaluation.factor, self.holding(evaluation.held)
        step = _STEPS[0] * max(abs(number), self.space.unit)
        found = 0.0
        for j, weight in _CENTRAL.items():
            at = number + j * step
            there = held.evaluate(held.placed(evaluation.x + j * step * shift, at), pressure, at)
            mode = there.expanded(reduced)
            found += weight / step * (there.inner(mode, mode) - 2 * q * float(there.volume_gradient @ mode))
        return found

    def number_derivative(self, x: Array, pressure: float, number: float) -> Array:
        if self.parameter.name.startswith("obstacle."):
            return np.zeros(self.space.n_free)
        return super().number_derivative(x, pressure, number)


class HeldFamily(Held, ContactFamily):
    """The potentials of such scenes on a fixed set of held nodes."""

    base: ContactFamily

    def __init__(self, base: ContactFamily, held: Mask) -> None:
        Held.__init__(self, base, held)

    def number_derivative(self, x: Array, pressure: float, number: float) -> Array:
        return self.base.number_derivative(x, pressure, number)

    def fold_derivatives(self, x: Array, pressure: float, number: float, mode: Array, q: float) -> FoldDerivatives:
        return self.base.fold_derivatives(x, pressure, number, mode, q)

    def holding(self, held: Mask) -> HeldFamily:
        return self.base.holding(held)

    def volume_derivative(self, x: Array, number: float) -> float:
        return self.base.volume_derivative(x, number)
