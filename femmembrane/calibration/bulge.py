"""What a scene predicts at held heights or volumes, with its derivatives by the numbers that are fitted.

At a held quantity equilibrium is R(x, P; m) = 0, N(x, P) = t, and with it::

    [K  -V'] [dx]   [-dR/dm]
    [N'  . ] [dP] = [-dN/dm + dt]

One factorisation gives the derivatives by all numbers m and by t. R is explicit: its derivatives by m come from the forces of two
neighbouring scenes in the same shape, by central differences, without another solution. A held height makes a limit point in the pressure
an ordinary point.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, SolveError, Status
from ..potential import Potential, potential_of
from ..solve.banded import BandFactor, BorderedFactor
from ..solve.controls import CONTROLS
from ..solve.load_path import LoadPath
from ..solve.newton import correct
from .laws import Law

if TYPE_CHECKING:
    from ..scene import Scene

Array = NDArray[np.float64]

#: relative step of the differences of explicit forces: errors of 1e-10 from curvature and of 1e-11 from round-off
_STEP = 1e-5


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
    potential : Potential
    moved : tuple of (Potential, Potential, float) or None for each number
        Potentials of the neighbouring scenes; None where a number changes the unit of stress alone.
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
    potential: Potential
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
        self.law, self.scene, self.held = law, scene, held
        self.control = CONTROLS[held]
        self.why = ""
        self._last: tuple[Array, States] | None = None

    def states(self, values: Array, targets: Array) -> States | None:
        """The equilibria at targets; None where a number or a state does not exist, and :attr:`why` says so."""
        try:
            factor, scene = self.law.split(values, self.scene)
            potential = potential_of(scene)
            with np.errstate(all="ignore"):
                found = self._warm(potential, values, targets) or self._cold(potential, targets)
                states = self._with_derivatives(potential, scene, factor, values, targets, found)
        except (InputError, SolveError, ArithmeticError) as error:
            self.why = str(error)
            return None
        self._last = values.copy(), states
        return states

    def _warm(self, potential: Potential, values: Array, targets: Array) -> list[Any] | None:
        """From the states before, along their derivatives."""
        if self._last is None or len(self._last[1].targets) != len(targets):
            return None
        before, last = self._last
        if last.x.shape[1] != potential.space.n_free:
            return None
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

    def _cold(self, potential: Potential, targets: Array) -> list[Any]:
        order = np.argsort(targets)
        path = LoadPath(potential, self.control, "newton")
        found: list[Any] = [None] * len(targets)
        for i in order:
            found[i] = path.to(float(targets[i]), False)[0]
        return found

    def _neighbours(self, potential: Potential, values: Array) -> tuple[list[Any], Array]:
        """Potentials beside each number, and the derivative of the logarithm of the unit of stress by it."""
        moved: list[Any] = []
        d_factor = np.zeros(len(values))
        for k, value in enumerate(values):
            step = _STEP * (abs(value) if value else 1.0)
            sides = []
            for direction in (1, -1):
                beside = values.copy()
                beside[k] = value + direction * step
                try:
                    sides.append((direction * step, *self.law.split(beside, self.scene)))
                except InputError:
                    continue
            if not sides:
                raise ArithmeticError(f"{self.law.names[k]} = {value:.6g} stands alone: no scene has a number beside it")
            if len(sides) == 1:  # at a bound: a one-sided difference, as accurate, of a second one beyond
                beside = values.copy()
                beside[k] = value + 2 * sides[0][0]
                sides.append((2 * sides[0][0], *self.law.split(beside, self.scene)))
            own = self.law.split(values, self.scene)[0]
            weights = _weights(sides[0][0], sides[1][0])
            d_factor[k] = sum(w * (side[1] - own) for w, side in zip(weights, sides, strict=True))
            potentials = [potential_of(side[2]) for side in sides]
            moved.append(None if all(p is potential for p in potentials) else tuple(zip(weights, potentials, strict=True)))
        return moved, d_factor

    def _with_derivatives(
        self, potential: Potential, scene: Scene, factor: float, values: Array, targets: Array, found: Sequence[Any]
    ) -> States:
        moved, d_factor = self._neighbours(potential, values)
        space, m, p = potential.space, len(targets), len(values)
        x = np.stack([state.x for state in found])
        raw, volume, height = np.array([s.pressure for s in found]), np.empty(m), np.empty(m)
        dx, d_raw, d_volume = np.zeros((m, space.n_free, p + 1)), np.zeros((m, p + 1)), np.zeros((m, p + 1))
        d_height = np.zeros((m, p + 1))
        has_pole = space.pole < space.n_free
        for i, state in enumerate(found):
            evaluation = state.evaluation
            volume[i], height[i] = evaluation.volume, space.center_height(x[i])
            _, row, corner = self.control.at(float(targets[i])).equation(space, x[i], raw[i], evaluation)
            border = BorderedFactor(BandFactor.of(evaluation), -evaluation.volume_gradient, row, corner)
            for k in range(p + 1):
                if k < p and moved[k] is None:
                    continue
                force, own_volume, own_height = np.zeros(space.n_free), 0.0, 0.0
                if k < p:
                    for weight, beside in moved[k]:
                        at = beside.evaluate(x[i], raw[i])
                        force += weight * (at.unbalanced - evaluation.unbalanced)
                        own_volume += weight * (at.volume - evaluation.volume)
                        own_height += weight * (beside.space.center_height(x[i]) - height[i])
                gap = 1.0 if k == p else -(own_height if self.held == "center_height" else own_volume)
                dx[i, :, k], d_raw[i, k] = border.solve(force, gap)
                d_volume[i, k] = own_volume + float(evaluation.volume_gradient @ dx[i, :, k])
                d_height[i, k] = own_height + (float(dx[i, space.pole, k]) if has_pole else 0.0)
        if not np.isfinite(d_raw).all():
            raise ArithmeticError("the derivatives are no numbers there")
        d_pressure = factor * d_raw
        d_pressure[:, :p] += raw[:, None] * d_factor
        return States(scene, targets.copy(), x, raw, factor * raw, volume, height, dx, d_raw, d_pressure, d_volume, d_height, potential, tuple(moved))


def _weights(a: float, b: float) -> tuple[float, float]:
    """Of differences f(a) - f(0) and f(b) - f(0) in the derivative at 0, exact for parabolas."""
    return -b / (a * (a - b)), a / (b * (a - b))


def meridian_at(states: States, i: int, s: Array) -> tuple[Array, Array, Array]:
    """Points (rho, eta) of state i at places s, shape (2, len(s)), their derivatives, (2, len(s), p + 1), and slopes by s, (2, len(s))."""
    space = states.potential.space
    R, Z = space.mesh.position(s)
    dR, dZ = space.mesh.tangent(s)
    u, du, w, dw = space.displacement(states.x[i], s)
    columns = [space.evaluate(states.dx[i, :, k], s) for k in range(states.dx.shape[2])]
    derivatives = np.stack([np.stack([c[0] for c in columns], axis=-1), np.stack([c[2] for c in columns], axis=-1)])
    for k, sides in enumerate(states.moved):
        if sides is not None and any(beside.space is not space for _, beside in sides):
            for weight, beside in sides:
                v = beside.space.displacement(states.x[i], s)
                derivatives[0, :, k] += weight * (v[0] - u)
                derivatives[1, :, k] += weight * (v[2] - w)
    return np.stack([R + u, Z + w]), derivatives, np.stack([dR + du, dZ + dw])


def pole_stretch(states: States, i: int) -> tuple[float, Array]:
    """Meridional stretch at the first end of the meridian, and its derivatives."""
    space = states.potential.space
    s = space.mesh.breakpoints()[:1]
    dR, dZ = (float(v[0]) for v in space.mesh.tangent(s))
    _, du, _, dw = (float(v[0]) for v in space.displacement(states.x[i], s))
    columns = [space.evaluate(states.dx[i, :, k], s) for k in range(states.dx.shape[2])]
    slopes = np.array([[float(c[1][0]), float(c[3][0])] for c in columns])
    for k, sides in enumerate(states.moved):
        if sides is not None and any(beside.space is not space for _, beside in sides):
            for weight, beside in sides:
                v = beside.space.displacement(states.x[i], s)
                slopes[k] += weight * np.array([float(v[1][0]) - du, float(v[3][0]) - dw])
    along = np.array([dR + du, dZ + dw])
    size, rest = math.hypot(*along), math.hypot(dR, dZ)
    return size / rest, slopes @ along / (size * rest)
