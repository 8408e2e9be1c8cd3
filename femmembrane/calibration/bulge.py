"""What a scene predicts at held heights or volumes, with its derivatives by the numbers that are fitted.

At a held quantity equilibrium is R(x, P; m) = 0, N(x, P) = t, and with it::

    [K  -V'] [dx]   [-dR/dm]
    [N'  . ] [dP] = [-dN/dm + dt]

One factorisation gives the derivatives by all numbers m and by t, and R has exact derivatives (:mod:`~femmembrane.potential.numbered`). A
held height makes a limit point in the pressure an ordinary point. The potential is built once, for all values of the numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..discretization.space import Space, space_of_scene
from ..errors import InputError, SolveError, Status
from ..potential import Numbered, Potential, potential_of
from ..scene.variation import Numbers, Parameter, names
from ..solve.banded import BandFactor, BorderedFactor
from ..solve.controls import CONTROLS
from ..solve.load_path import LoadPath
from ..solve.newton import correct
from .laws import Law

if TYPE_CHECKING:
    from ..scene import Scene

Array = NDArray[np.float64]

#: relative step of differences of closed forms: errors of 1e-10 from curvature and of 1e-11 from round-off
_STEP = 1e-5
#: numbers that move the ends of the membrane
_MOVERS = ("mesh.", "membrane.prestretch")


@dataclass(frozen=True, eq=False)
class States:
    """Equilibria at held targets, with derivatives by the numbers and, last, by the target.

    Attributes
    ----------
    scene : Scene
    targets, pressure, volume, height : ndarray, shape (m,)
        In units of the package, by the shear modulus of the scene at the start.
    x : ndarray, shape (m, n)
    raw_pressure : ndarray, shape (m,)
        In units of the shear modulus of the state itself.
    dx : ndarray, shape (m, n, p + 1)
    d_raw_pressure, d_pressure, d_volume, d_height : ndarray, shape (m, p + 1)
    space : Space
    moved : tuple of (float, Space) pairs for each number
        Weights and spaces of neighbouring scenes, for numbers that move an end.
    """

    scene: Scene
    targets: Array
    x: Array
    raw_pressure: Array
    pressure: Array
    volume: Array
    height: Array
    dx: Array
    d_raw_pressure: Array
    d_pressure: Array
    d_volume: Array
    d_height: Array
    space: Space
    moved: tuple[Any, ...] = field(repr=False)


class Bulge:
    """Predictions of one scene, warm from one set of numbers to the next.

    Parameters
    ----------
    law : Law
    scene : Scene
        Of this test.
    held : {"center_height", "volume"}
    """

    def __init__(self, law: Law, scene: Scene, held: str) -> None:
        if scene.obstacles:
            allowed = "a scene without obstacles is allowed in a fit: its predictions have no derivatives while the border of contact moves"
            raise InputError("obstacle", scene.obstacles[0], allowed)
        self.law, self.scene, self.held = law, scene, held
        self.control = CONTROLS[held]
        self.why = ""
        self._last: tuple[Array, States] | None = None
        own = law.split(law.start, scene)[1]
        known = set(names(own))
        self._own = tuple(n for n in names(own) if n.startswith("material."))
        self._own += tuple(n for n in (*law.names, *law.beside_modulus(own)) if n in known and not n.startswith("material."))
        self._own = tuple(dict.fromkeys(self._own))
        self._numbered = Numbered(Numbers(own, self._own)) if self._own else None

    def states(self, values: Array, targets: Array) -> States | None:
        """The equilibria at targets; None where a number or a state does not exist, and :attr:`why` says so."""
        try:
            factor, scene = self.law.split(values, self.scene)
            with np.errstate(all="ignore"):
                found = self._warm(scene, values, targets) or self._cold(scene, targets)
                states = self._with_derivatives(scene, factor, values, targets, found)
        except (InputError, SolveError, ArithmeticError) as error:
            self.why = str(error)
            return None
        self._last = values.copy(), states
        return states

    def _numbers(self, scene: Scene) -> list[float]:
        return [_value(scene, name) for name in self._own]

    def _warm(self, scene: Scene, values: Array, targets: Array) -> list[Any] | None:
        """From the states before, along their derivatives."""
        if self._last is None or len(self._last[1].targets) != len(targets):
            return None
        potential: Potential = potential_of(scene) if self._numbered is None else self._numbered.at(self._numbers(scene))
        before, last = self._last
        found = []
        for i, target in enumerate(targets):
            step = np.append(values - before, target - last.targets[i])
            moved = float(np.abs(last.dx[i] @ step).max(initial=0.0)) < 0.5
            x = last.x[i] + last.dx[i] @ step if moved else last.x[i]
            pressure = last.raw_pressure[i] + (float(last.d_raw_pressure[i] @ step) if moved else 0.0)
            result = correct(potential, self.control.at(float(target)), x, pressure)
            if result.status is not Status.CONVERGED:
                return None
            found.append(result)
        return found

    def _cold(self, scene: Scene, targets: Array) -> list[Any]:
        """One after the other, from the smallest."""
        path = LoadPath(potential_of(scene), self.control, "newton")
        found: list[Any] = [None] * len(targets)
        for i in np.argsort(targets):
            found[i] = path.to(float(targets[i]), False)[0]
        return found

    def _with_derivatives(self, scene: Scene, factor: float, values: Array, targets: Array, found: Sequence[Any]) -> States:
        mix, d_factor, moved = self._mixed(scene, factor, values)
        space, m, p = space_of_scene(scene), len(targets), len(values)
        own = None if self._numbered is None else self._numbers(scene)
        x = np.stack([state.x for state in found])
        raw, volume, height = np.array([s.pressure for s in found]), np.empty(m), np.empty(m)
        dx, d_raw, d_volume = np.zeros((m, space.n_free, p + 1)), np.zeros((m, p + 1)), np.zeros((m, p + 1))
        d_height = np.zeros((m, p + 1))
        has_pole = space.pole < space.n_free
        for i, state in enumerate(found):
            evaluation = state.evaluation
            potential = evaluation.potential
            volume[i], height[i] = evaluation.volume, potential.space.center_height(x[i]) + potential.pole_rise(evaluation.factor)
            _, row, corner = self.control.at(float(targets[i])).equation(potential.space, x[i], raw[i], evaluation)
            border = BorderedFactor(BandFactor.of(evaluation), -evaluation.volume_gradient, row, corner)
            if self._numbered is None or own is None or not mix.any():
                force, by_volume, by_height = np.zeros((space.n_free, p)), np.zeros(p), np.zeros(p)
            else:
                rates = self._numbered.derivatives(x[i], float(raw[i]), own)
                force, by_volume, by_height = rates.force @ mix, rates.volume @ mix, rates.height @ mix
            for k in range(p):
                if mix[:, k].any():
                    gap = by_height[k] if self.held == "center_height" else by_volume[k]
                    dx[i, :, k], d_raw[i, k] = border.solve(-np.ascontiguousarray(force[:, k]), -float(gap))
            dx[i, :, p], d_raw[i, p] = border.solve(np.zeros(space.n_free), 1.0)
            d_volume[i] = evaluation.volume_gradient @ dx[i] + np.append(by_volume, 0.0)
            d_height[i] = np.append(by_height, 0.0) + (dx[i, space.pole] if has_pole else 0.0)
        if not np.isfinite(d_raw).all():
            raise ArithmeticError("the derivatives are no numbers there")
        d_pressure = factor * d_raw
        d_pressure[:, :p] += raw[:, None] * d_factor
        return States(
            scene, targets.copy(), x, raw, factor * raw, volume, height, dx, d_raw, d_pressure, d_volume, d_height, space, tuple(moved)
        )

    def _mixed(self, scene: Scene, factor: float, values: Array) -> tuple[Array, Array, list[Any]]:
        """Derivatives of the numbers of the potential and of the unit of stress by those of the fit: closed forms of a few numbers."""
        mix, d_factor, moved = np.zeros((len(self._own), len(values))), np.zeros(len(values)), []
        own = np.array(self._numbers(scene))
        for k in range(len(values)):
            sides = neighbours(values, k, lambda beside: self.law.split(beside, self.scene))
            d_factor[k] = sum(weight * (side[0] - factor) for weight, side in sides)
            if self._own:
                mix[:, k] = sum(weight * (np.array(self._numbers(side[1])) - own) for weight, side in sides)
                mix[np.abs(mix[:, k]) * abs(values[k]) < 1e-10 * np.abs(own), k] = 0.0  # round-off of what does not change
            shifts = self.law.names[k].startswith(_MOVERS)
            moved.append(tuple((weight, space_of_scene(side[1])) for weight, side in sides) if shifts else ())
        return mix, d_factor, moved


def _value(scene: Scene, name: str) -> float:
    """A number that the scene certainly has."""
    table, _, rest = name.partition(".")
    if table != "material":
        return Parameter(scene, name).value
    key, _, index = rest.partition(".")
    number: Any = getattr(scene.material, key)
    return float(number[int(index)] if index else number)


def neighbours(values: Array, k: int, at: Callable[[Array], Any]) -> list[tuple[float, Any]]:
    """What a function answers beside number k, with weights that give the derivative of differences; at a bound on one side of it.

    Raises
    ------
    ArithmeticError
        For a number that stands alone.
    """
    step, sides = _STEP * (abs(values[k]) or 1.0), []
    for distance in (step, -step, 2 * step, -2 * step):
        beside = values.copy()
        beside[k] = values[k] + distance
        try:
            sides.append((distance, at(beside)))
        except InputError:
            continue
        if len(sides) == 2:
            break
    if len(sides) < 2:
        raise ArithmeticError(f"no scene has a number beside {values[k]:.6g}")
    weights = _weights(sides[0][0], sides[1][0])
    return [(weight, side) for weight, (_, side) in zip(weights, sides, strict=True)]


def _weights(a: float, b: float) -> tuple[float, float]:
    """Of differences f(a) - f(0) and f(b) - f(0) in the derivative at 0, exact for parabolas."""
    return -b / (a * (a - b)), a / (b * (a - b))


def meridian_at(states: States, i: int, s: Array) -> tuple[Array, Array, Array]:
    """Points (rho, eta) of state i at places s, shape (2, len(s)), their derivatives, (2, len(s), p + 1), and slopes by s, (2, len(s))."""
    space = states.space
    R, Z = space.mesh.position(s)
    dR, dZ = space.mesh.tangent(s)
    u, du, w, dw = space.displacement(states.x[i], s)
    columns = [space.evaluate(states.dx[i, :, k], s) for k in range(states.dx.shape[2])]
    derivatives = np.stack([np.stack([c[0] for c in columns], axis=-1), np.stack([c[2] for c in columns], axis=-1)])
    for k, sides in enumerate(states.moved):
        for weight, beside in sides:
            v = beside.displacement(states.x[i], s)
            derivatives[0, :, k] += weight * (v[0] - u)
            derivatives[1, :, k] += weight * (v[2] - w)
    return np.stack([R + u, Z + w]), derivatives, np.stack([dR + du, dZ + dw])


def pole_stretch(states: States, i: int) -> tuple[float, Array]:
    """Meridional stretch at the first end of the meridian, and its derivatives."""
    space = states.space
    s = space.mesh.breakpoints()[:1]
    dR, dZ = (float(v[0]) for v in space.mesh.tangent(s))
    _, du, _, dw = (float(v[0]) for v in space.displacement(states.x[i], s))
    columns = [space.evaluate(states.dx[i, :, k], s) for k in range(states.dx.shape[2])]
    slopes = np.array([[float(c[1][0]), float(c[3][0])] for c in columns])
    for k, sides in enumerate(states.moved):
        for weight, beside in sides:
            v = beside.displacement(states.x[i], s)
            slopes[k] += weight * np.array([float(v[1][0]) - du, float(v[3][0]) - dw])
    along = np.array([dR + du, dZ + dw])
    size, rest = math.hypot(*along), math.hypot(dR, dZ)
    return size / rest, slopes @ along / (size * rest)
