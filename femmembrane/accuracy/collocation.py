"""Collocation: the boundary-value problem as such, from end to end, by SciPy's ``solve_bvp`` (order 4, on a mesh of its own)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_bvp
from scipy.interpolate import CubicSpline

from ..scene import Scene
from .ends import Ends
from .strong_form import SINGULAR, Array, Guess, Solution, StrongForm, check_tolerance, on_leg, prescribed, states_of

#: points and weights of a rule exact to degree 7, for the energies on each interval
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def collocate(
    scene: Scene,
    *,
    guess: Guess,
    volume: float | None = None,
    pressure: float | None = None,
    center_height: float | None = None,
    tolerance: float = 1e-8,
    max_nodes: int = 20_000,
) -> Solution:
    """One equilibrium by collocation with adapted mesh.

    The singular terms at a pole are linear in the unknowns of :mod:`.strong_form` and are handed over as the matrix S, so the interval
    begins at the pole itself. The pressure is an unknown parameter unless it is prescribed; the volume is one more equation. A meridian
    from pole to pole is folded in its middle.

    Parameters
    ----------
    scene : Scene
        See :class:`.strong_form.StrongForm`.
    guess : Guess
        With a profile; its places are the first mesh.
    volume, pressure, center_height : float
        Exactly one of them.
    tolerance : float
        Of the relative residual of the equations on every interval (root mean square), and of the boundary conditions.
    max_nodes : int

    Raises
    ------
    InputError
        For a scene, control, guess or tolerance that is not allowed. A solve that fails does not raise: see ``converged``.
    """
    control, load = prescribed(volume, pressure, center_height)
    aim = check_tolerance("tolerance", tolerance, 1e-13)
    form = StrongForm(scene)
    problem = _Problem(form, Ends(form, control, load, guess), max(abs(load), 1.0) if control == "volume" else 0.0)
    x, first = problem.first(guess)
    parameters = ([] if control == "pressure" else [guess.pressure]) + [0.0] * problem.ends.floats
    with np.errstate(all="ignore"):  # a wild iterate may leave the domain of the energy: the solver then gives up
        found = solve_bvp(
            problem.equations,
            problem.conditions,
            x,
            first,
            p=np.array(parameters) if parameters else None,
            S=problem.singular(),
            tol=aim,
            bc_tol=aim,
            max_nodes=max_nodes,
        )
        return problem.solution(found, aim)


@dataclass
class _Problem:
    """The boundary-value problem of one scene: the unknowns of all legs side by side, and with a ``scale`` the volume over it."""

    form: StrongForm
    ends: Ends
    scale: float  # a large volume would hide the round-off of the rest

    def split(self, p: Any) -> tuple[Any, Any]:
        """(pressure, force that holds a floating membrane) from the parameters."""
        known = self.ends.control == "pressure"
        pressure = self.ends.load if known else p[0]
        return pressure, p[-1] if self.ends.floats else 0.0

    def first(self, guess: Guess) -> tuple[Array, Array]:
        """Mesh and unknowns from the profile of a guess."""
        s, y = states_of(guess, self.form)
        x, rows = np.array([]), []
        for leg in self.form.legs:
            at, states = on_leg(leg, s, y)
            x = at if x.size == 0 else x
            rows += [np.interp(x, at, row) if at is not x else row for row in states]
        first = np.array(rows)
        if not self.scale:
            return x, first
        density = CubicSpline(x, self.volume_rate(x, first))
        return x, np.vstack([first, density.antiderivative()(x)])

    def legs(self, y: Array) -> list[Array]:
        """The unknowns of each leg."""
        return [y[4 * k : 4 * k + 4] for k in range(len(self.form.legs))]

    def volume_rate(self, x: Array, y: Array) -> Array:
        parts = [self.form.densities(x, part, leg)[0] for leg, part in zip(self.form.legs, self.legs(y), strict=True)]
        rate: Array = np.sum(parts, axis=0) / self.scale
        return rate

    def singular(self) -> Array | None:
        """The matrix S of all unknowns, where a leg begins at a pole."""
        n = 4 * len(self.form.legs)
        matrix = np.zeros((n + bool(self.scale), n + bool(self.scale)))
        for k, leg in enumerate(self.form.legs):
            if leg.pole:
                matrix[4 * k : 4 * k + 4, 4 * k : 4 * k + 4] = SINGULAR
        return matrix if matrix.any() else None

    def equations(self, x: Array, y: Array, p: Any = None) -> Array:
        pressure, pull_up = self.split(p)
        rows = []
        for leg, part in zip(self.form.legs, self.legs(y), strict=True):
            rows.append(
                self.form.regular(x, part, pressure, leg, pull_up) if leg.pole else self.form.rates(x, part, pressure, leg, pull_up)
            )
        return np.vstack([*rows, self.volume_rate(x, y)]) if self.scale else np.vstack(rows)

    def conditions(self, begin: Array, end: Array, p: Any = None) -> Array:
        begins, ends = self.legs(begin), self.legs(end)
        rows = [value for leg, y in zip(self.form.legs, begins, strict=True) if leg.pole for value in y[2:]]
        volume = None
        if self.scale:
            rows.append(begin[-1])
            volume = end[-1] * self.scale
        if self.ends.known_height is not None:
            rows.append(begin[1] - self.ends.known_height)
        return np.array([*rows, *self.ends.conditions(begins, ends, self.split(p)[0], volume)])

    def solution(self, found: Any, aim: float) -> Solution:
        """The record, with integrals over the profile that was found."""
        left, size = found.x[:-1], np.diff(found.x)
        points = (left + size * (_POINTS[:, None] + 1) / 2).ravel()
        states = self.legs(found.sol(points))
        parts = [self.form.densities(points, part, leg) for leg, part in zip(self.form.legs, states, strict=True)]
        density = np.sum(parts, axis=0).reshape(3, _WEIGHTS.size, size.size)
        volume, elastic, magnetic = (float(v) for v in np.einsum("q,kqe,e->k", _WEIGHTS, density, size / 2))
        begin, end = found.y[:, 0], found.y[:, -1]
        volume += float(self.ends.moved_lids(self.legs(begin), self.legs(end)))
        residual = float(max(np.max(found.rms_residuals), np.abs(self.conditions(begin, end, found.p)).max()))
        converged = bool(found.status == 0 and residual <= 10 * aim)
        return Solution(
            "collocation",
            float(self.split(found.p)[0]),
            volume,
            float(begin[1]),
            elastic,
            magnetic,
            converged,
            residual if np.isfinite(residual) else np.inf,
            self.form.evaluations,
            int(found.niter),
            "" if converged else str(found.message),
            self.form.scene.mesh,
            lambda s: self._at(found, s),
        )

    def _at(self, found: Any, s: Array) -> Array:
        """The state at places along the meridian."""
        y = np.empty((4, s.size))
        for k, leg in enumerate(self.form.legs):
            x, mine = leg.own(s)
            y[:, mine] = found.sol(x[mine])[4 * k : 4 * k + 4]
        return y
