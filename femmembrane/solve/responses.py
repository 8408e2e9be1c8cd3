"""What a membrane answers at held values, as a function of several numbers of its scene, with its Jacobian: for fits.

The equilibria at the held values are kept between calls. A call predicts them with the derivatives of the last one, corrects them by
Newton's method, and takes the derivatives with the factors there. Nothing is built when numbers change, and no records are made.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..checks import choice
from ..discretization.meridian import LEAST_LENGTH
from ..discretization.space import Space
from ..errors import SolveError, Status
from ..physics.kinematics import meridional_strain
from ..potential import Array, Evaluation, Numbered, NumberedMember, potential_of
from ..scene import Scene
from ..scene.variation import Numbers
from .controls import CONTROLS
from .load_path import LoadPath
from .newton import correct
from .sensitivity import Rates, held_rates, refuse_fold, solved
from .state import distance

#: what a state has at a point of the meridian
AT_POINTS = ("rho", "eta", "stretch_1", "stretch_2")
#: shortest part of the way to other numbers, and longest step in units of the membrane
_SHORTEST, _FAR = 1 / 256, 0.3

#: a quantity of a state by its name, or one at a point of the meridian with the parameter of that
Asked = str | tuple[str, float]


@dataclass(frozen=True, eq=False)
class Response:
    """Answers at all held values.

    Attributes
    ----------
    values : ndarray, shape (n_points, n_quantities)
    jacobian : ndarray, shape (n_points, n_quantities, n_numbers)
    """

    values: Array
    jacobian: Array


@dataclass(slots=True, eq=False)
class _Known:
    """The equilibrium at one held value, at the numbers of the last call."""

    x: Array
    pressure: float
    dx: Array
    dp: Array


class Responses:
    """The answers of a scene at held values as a function of numbers.

    Parameters
    ----------
    scene : Scene
        Where the numbers start.
    held : {"pressure", "volume", "center_height"}
    loads : array_like
        Held values, in any order. With the height or the volume held, limit points of the pressure are no obstacle.
    names : sequence of str
        Numbers of the scene as in :mod:`femmembrane.scene.variation`. They are independent: none takes others with it, and moduli of
        Ogden's material may have any sum. Answers are then in units in which these moduli are given.
    of : sequence of str or of (str, float)
        ``pressure``, ``volume``, ``center_height``; or one of ``rho``, ``eta``, ``stretch_1``, ``stretch_2`` with the parameter of a point
        of the meridian, the reference radius of a disc: ``("stretch_2", 0.0)`` is the stretch at the pole.

    Raises
    ------
    InputError
        For unknown names.
    SolveError
        Where a held value is not reached at the numbers of the scene.
    """

    def __init__(self, scene: Scene, held: str, loads: ArrayLike, names: Sequence[str], of: Sequence[Asked] = ("pressure",)) -> None:
        choice("held", held, CONTROLS)
        self.numbers = Numbers(scene, tuple(names))
        self.held, self.loads, self.of = CONTROLS[held], np.asarray(loads, dtype=float).ravel(), tuple(of)
        for asked in self.of:
            if isinstance(asked, str):
                choice("of", asked, tuple(CONTROLS))
            else:
                choice("of", asked[0], AT_POINTS)
        self._numbered = Numbered(self.numbers)
        self._at = np.array(self.numbers.values)
        places = sorted({asked[1] for asked in self.of if not isinstance(asked, str)})
        self._points = _Points(self._numbered, np.array(places)) if places else None
        self._known = self._first(scene)

    def _first(self, scene: Scene) -> list[_Known]:
        """The equilibria at the numbers of the scene: from load to load, on either side of rest from the smallest one on."""
        potential, found = potential_of(scene), {}
        rest = self.held.rest(potential.space)
        for sign in (1.0, -1.0):
            path = LoadPath(potential, self.held, "newton")
            for load in sorted(
                {float(v) for v in self.loads if (v - rest) * sign > 0 or (v == rest and sign > 0)}, key=lambda v: abs(v - rest)
            ):
                state = path.to(load, False)[0]
                found[load] = state.x, state.pressure
        nothing = np.zeros((potential.space.n_free, len(self.numbers.names))), np.zeros(len(self.numbers.names))
        return [_Known(*found[float(load)], *nothing) for load in self.loads]

    def __call__(self, values: ArrayLike) -> Response:
        """The answers at values of the numbers.

        Parameters
        ----------
        values : array_like, shape (n_numbers,)
            They are not checked: values that no scene can take give what the formulas make of them.

        Raises
        ------
        SolveError
            Where an equilibrium is not reached, with status NOT_CONVERGED; the last ones that were found are kept.
        """
        aim = np.asarray(values, dtype=float).ravel()
        member = self._numbered.at(aim.tolist())
        known, answers, jacobian = [], [], []
        for load, old in zip(self.loads, self._known, strict=True):
            new, evaluation = self._followed(float(load), old, member, aim)
            rates = self._rates(evaluation, new.pressure, float(load), member)
            new.dx, new.dp = rates.x, rates.pressure
            known.append(new)
            own = self._answers(evaluation, new.pressure, rates, member)
            answers.append([value for value, _ in own])
            jacobian.append([row for _, row in own])
        self._at, self._known = aim, known
        return Response(np.array(answers), np.array(jacobian))

    def _followed(self, load: float, old: _Known, member: NumberedMember, aim: Array) -> tuple[_Known, Evaluation]:
        """The equilibrium at other numbers: in one step, or in as many as it takes."""
        here, done, step = self._at, 0.0, 1.0
        way, control, state = aim - here, self.held.at(load), old
        while True:
            whole = done + step >= 1.0
            there = member if whole else self._numbered.at((here + (done + step) * way).tolist())
            change = (1.0 - done if whole else step) * way
            result = correct(there, control, state.x + state.dx @ change, state.pressure + float(state.dp @ change))
            near = result.status is Status.CONVERGED and (not change.any() or distance(there, result.x, state.x) <= _FAR)
            if near and whole:
                return _Known(result.x, result.pressure, state.dx, state.dp), result.evaluation
            if near:
                rates = self._rates(result.evaluation, result.pressure, load, there)
                state, done = _Known(result.x, result.pressure, rates.x, rates.pressure), done + step
                continue
            step /= 2
            if step < _SHORTEST:
                names = dict(zip(self.numbers.names, aim.tolist(), strict=True))
                message = f"the equilibrium at {self.held.words} {load:.6g} could not be followed to {names}"
                raise SolveError(message, status=Status.NOT_CONVERGED)

    def _rates(self, evaluation: Evaluation, pressure: float, load: float, member: NumberedMember) -> Rates:
        control = self.held.at(load)
        _, row, corner = control.equation(member.space, evaluation.x, pressure, evaluation)
        border = evaluation.border(row, corner)
        refuse_fold(evaluation, border, control)
        own = self._numbered.derivatives(evaluation.x, pressure, member.values)
        return solved(border, evaluation, held_rates(control, pressure, own.volume, own.height), own)

    def _answers(self, evaluation: Evaluation, pressure: float, rates: Rates, member: NumberedMember) -> list[tuple[float, Array]]:
        x, points = evaluation.x, self._points
        of_state = {
            "pressure": (pressure, rates.pressure),
            "volume": (evaluation.volume, rates.volume),
            "center_height": (member.space.center_height(x) + member.pole_rise(1.0), rates.height),
        }
        at_points = {} if points is None else points.answers(x, rates.x, member)
        return [of_state[asked] if isinstance(asked, str) else at_points[asked] for asked in self.of]


class _Points:
    """Positions and stretches at points of the meridian, which are linear in x but for one formula."""

    def __init__(self, numbered: Numbered, s: Array) -> None:
        space = numbered.space
        self._numbered, self.s = numbered, s
        self._rest = _linear(space, np.zeros(space.n_free), s)
        columns = [_linear(space, unit, s) - self._rest for unit in np.eye(space.n_free)]
        self._matrix = np.stack(columns, axis=-1)
        (self.R, self.Z), (self.R_s, self.Z_s) = space.mesh.position(s), space.mesh.tangent(s)
        self._pole = np.abs(self.R) <= LEAST_LENGTH * space.size

    def answers(self, x: Array, dx: Array, member: NumberedMember) -> dict[tuple[str, float], tuple[float, Array]]:
        own = self._rest + self._matrix @ x
        rates = self._matrix @ dx
        lifted = self._numbered.lift_at(self.s, member.values)
        if lifted is not None:
            own = own + lifted[0]
            rates[..., lifted[2]] += lifted[1]
        u, u_s, w, w_s = own
        du, du_s, dw, dw_s = rates
        pole, R_s, Z_s = self._pole, self.R_s, self.Z_s
        stretch_1 = np.exp(meridional_strain(R_s, Z_s, u_s, w_s))
        size = (R_s**2 + Z_s**2) * stretch_1
        d1 = ((R_s + u_s)[:, None] * du_s + (Z_s + w_s)[:, None] * dw_s) / size[:, None]
        radius = np.where(pole, R_s, self.R)
        stretch_2 = 1 + np.where(pole, u_s, u) / radius
        d2 = np.where(pole[:, None], du_s, du) / radius[:, None]
        columns = {"rho": (self.R + u, du), "eta": (self.Z + w, dw), "stretch_1": (stretch_1, d1), "stretch_2": (stretch_2, d2)}
        return {(name, float(s)): (float(v[k]), d[k]) for name, (v, d) in columns.items() for k, s in enumerate(self.s)}


def _linear(space: Space, x: Array, s: Array) -> Array:
    """(u, u_s, w, w_s) at parameters s, slopes recovered, shape (4, n)."""
    u, _, w, _ = space.displacement(x, s)
    u_s, w_s = space.recovered_slopes(x, s)
    return np.stack([u, u_s, w, w_s])
