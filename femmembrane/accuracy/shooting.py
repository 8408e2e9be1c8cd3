"""Shooting from the pole: the equations are integrated to the rim, and the unknowns at the pole are chosen so that the rim is met.

There are two methods. :func:`shoot` has a high-order integrator and Newton's method. :func:`shoot_as_published` is the method of Saxena,
Reddy & Pradhan (2019), section 3 and appendix: from r = 1e-5 with a Runge-Kutta pair of order 5(4) and the simplex of Nelder and Mead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

from ..scene import Scene
from .strong_form import POLE_UNKNOWN, Array, Guess, Solution, StrongForm, check_tolerance, prescribed

#: radius at which :func:`shoot` leaves the pole, by a series with an error of order r^4
_START = 1e-4
#: radius at which the published method leaves the pole, on a straight line (paper eq. 61)
_PUBLISHED_START = 1e-5
#: right-hand sides after which a shot that gets nowhere is given up
_MOST = 10_000
#: relative step of the differences in Newton's method; both shots share all steps of the integrator, so that its errors cancel
_DIFFERENCE = 1e-7


class _TooLongError(Exception):
    """A shot was given up."""


@dataclass
class _Shooter:
    """Shots of one scene under one control: u are the unknowns among (center height, stretch at the pole, pressure)."""

    form: StrongForm
    control: str
    load: float
    integrator: str
    rtol: float
    start: float

    @property
    def unknown(self) -> list[int]:
        return [k for k in range(3) if k != POLE_UNKNOWN[self.control]]

    def pole(self, u: Array) -> Array:
        """(center height, stretch, pressure), shape (3, n), from the unknowns, shape (number of unknowns, n)."""
        full = np.full((3, u.shape[1]), self.load)
        full[self.unknown] = u
        return full

    def shot(self, u: Array, energies: bool = False) -> tuple[Array, Any]:
        """State at the rim, shape (4 + integrals, n), of n shots at once with the same steps of the integrator; and the whole solution.

        The integrals are the volume when it is prescribed, or with ``energies`` volume and energies. A shot that does not arrive is NaN.
        """
        center, stretch, pressure = self.pole(u)
        n, extra = u.shape[1], 3 if energies else int(self.control == "volume")
        failed = np.full((4 + extra, n), np.nan), None
        shape, p = ((-1,), pressure[0]) if n == 1 else ((-1, n), pressure)  # plain numbers are faster than arrays of one
        if not (stretch > 0).all():
            return failed
        before = self.form.evaluations

        def rates(r: float, flat: Array) -> Array:
            if self.form.evaluations - before > _MOST:
                raise _TooLongError
            y = flat.reshape(shape)[:4]
            dy = self.form.rates(r, y, p)
            return dy.ravel() if not extra else np.concatenate([dy, self.form.densities(r, y)[:extra]]).ravel()

        with np.errstate(all="ignore"):  # a wild guess may leave the domain of the energy: the caller sees NaN
            first = self._first(center, stretch, pressure)[: 4 + extra]
            if not np.isfinite(first).all():
                return failed
            try:
                found = solve_ivp(
                    rates, (self.start, 1.0), first.ravel(), self.integrator, rtol=self.rtol, atol=self.rtol * 1e-2, dense_output=energies
                )
            except _TooLongError:
                return failed
        return (found.y[:, -1].reshape(-1, n), found) if found.success else failed

    def miss(self, u: Array) -> Array:
        """By how much radius and height of the rim, and the volume, are too large, shape (2 or 3, n)."""
        return self._miss(self.shot(u)[0])

    def _miss(self, rim: Array) -> Array:
        stretch, height = self.form.rim
        rows = [np.expm1(rim[0] - np.log(stretch)), rim[1] - height]
        if self.control == "volume":
            rows.append((rim[4] - self.load) / max(abs(self.load), 1.0))
        return np.array(rows)

    def _first(self, center: Array, stretch: Array, pressure: Array) -> Array:
        """The state where the shot leaves the pole, with the integrals up to there."""
        r = self.start
        if r == _PUBLISHED_START:
            y = np.array([np.log(stretch), center, np.zeros_like(center), np.zeros_like(center)])
        else:
            y = self.form.pole(r, center, stretch, pressure)
        return np.concatenate([y, self.form.densities(r, y) * r / 2])  # the densities are linear in r there

    def solution(self, method: str, u: Array, iterations: int, tolerance: float) -> Solution:
        """The record of the shot at u, fired once more with the energies."""
        rim, found = self.shot(u[:, None], energies=True)
        center, _, pressure = self.pole(u[:, None])[:, 0]
        residual = float(np.abs(self._miss(rim)).max()) if found is not None else np.inf
        converged = bool(residual <= tolerance)
        return Solution(
            method,
            pressure=float(pressure),
            volume=float(rim[4, 0]),
            center_height=float(center),
            elastic_energy=float(rim[5, 0]),
            magnetic_energy=float(rim[6, 0]),
            converged=converged,
            residual=residual,
            evaluations=self.form.evaluations,
            iterations=iterations,
            message="" if converged else f"the rim is missed by {residual:.2g}; a guess nearer by may help",
            _at=None if found is None else self._dense(found, u),
        )

    def _dense(self, found: Any, u: Array) -> Callable[[Array], Array]:
        center, stretch, pressure = self.pole(u[:, None])

        def at(r: Array) -> Array:
            y: Array = found.sol(np.maximum(r, self.start))[:4]
            near = r < self.start
            if near.any():
                y[:, near] = self.form.pole(np.maximum(r[near], 1e-9), center, stretch, pressure)
            return y

        return at


def shoot(
    scene: Scene,
    *,
    guess: Guess,
    volume: float | None = None,
    pressure: float | None = None,
    center_height: float | None = None,
    tolerance: float = 1e-12,
    max_iterations: int = 20,
) -> Solution:
    """One equilibrium by shooting with Newton's method and DOP853.

    Parameters
    ----------
    scene : Scene
        See :class:`.strong_form.StrongForm`.
    guess : Guess
        Pressure, center height and stretch at the pole; of these the prescribed one is not used.
    volume, pressure, center_height : float
        Exactly one of them.
    tolerance : float
        Relative tolerance of the integrator; the rim must be met within ten times as much.
    max_iterations : int
        Most Newton iterations.

    Raises
    ------
    InputError
        For a scene, control, guess or tolerance that is not allowed. A solve that fails does not raise: see ``converged``.
    """
    control, load = prescribed(volume, pressure, center_height)
    rtol = check_tolerance("tolerance", tolerance, 1e-13)
    shooter = _Shooter(StrongForm(scene), control, load, "DOP853", rtol, _START)
    u = np.array([guess.center_height, guess.stretch, guess.pressure])[shooter.unknown]
    aim, iterations, length = 10 * rtol, 0, 1.0
    columns = _columns(u)
    miss = shooter.miss(columns)
    while np.abs(miss[:, 0]).max() > aim and iterations < max_iterations and np.isfinite(miss).all():
        try:
            step = np.linalg.solve((miss[:, 1:] - miss[:, :1]) / np.diag(columns[:, 1:] - columns[:, :1]), -miss[:, 0])
        except np.linalg.LinAlgError:
            break
        iterations += 1
        size, length = np.abs(miss[:, 0]).max(), 1.0
        while length > 1e-3:
            columns = _columns(u + length * step)
            new = shooter.miss(columns)
            if np.abs(new[:, 0]).max() <= (1 - length / 2) * size:  # False for NaN
                break
            length /= 2
        else:  # round-off, or nowhere near
            break
        u, miss = u + length * step, new
    return shooter.solution("shooting", u, iterations, aim)


def _columns(u: Array) -> Array:
    """The unknowns, and the unknowns with each of them moved a little, shape (n, n + 1)."""
    return np.column_stack([u, u[:, None] + np.diag(_DIFFERENCE * np.maximum(np.abs(u), 0.1))])


def shoot_as_published(
    scene: Scene,
    *,
    guess: Guess,
    volume: float | None = None,
    pressure: float | None = None,
    center_height: float | None = None,
    tolerance: float = 1e-8,
    rtol: float | None = None,
    max_iterations: int = 600,
) -> Solution:
    """One equilibrium by the method of Saxena, Reddy & Pradhan (2019): a simplex on the distance by which the rim is missed.

    The paper prescribes the height of the pole and seeks (stretch at the pole, P); a pressure or a volume is prescribed in the same way.
    It integrates with MATLAB's ode45, here ``RK45`` (both Dormand and Prince's pair), and searches with fminsearch, here SciPy's
    Nelder-Mead from the same first simplex (5 per cent larger in each unknown). Leaving the pole at r = 1e-5 on a straight line costs some
    1e-9 in P, whatever the tolerances.

    Parameters
    ----------
    scene, guess, volume, pressure, center_height
        As for :func:`shoot`.
    tolerance : float
        Distance by which the rim may be missed, sqrt((rho - 1)^2 + eta^2) (the paper: of order 1e-13).
    rtol : float, optional
        Relative tolerance of the integrator, which the paper does not give; default a tenth of ``tolerance``.
    max_iterations : int
        Most steps of the simplex.

    Raises
    ------
    InputError
        As for :func:`shoot`.
    """
    control, load = prescribed(volume, pressure, center_height)
    aim = check_tolerance("tolerance", tolerance, 1e-15)
    rtol = max(aim / 10, 1e-13) if rtol is None else check_tolerance("rtol", rtol, 1e-13)
    shooter = _Shooter(StrongForm(scene), control, load, "RK45", rtol, _PUBLISHED_START)

    def distance(u: Array) -> float:
        size = float(np.linalg.norm(shooter.miss(u[:, None])))
        return size if np.isfinite(size) else 1e3  # a simplex compares, and must be able to

    def enough(intermediate_result: Any) -> None:
        if intermediate_result.fun <= aim:
            raise StopIteration

    found = minimize(
        distance,
        np.array([guess.center_height, guess.stretch, guess.pressure])[shooter.unknown],
        method="Nelder-Mead",
        callback=enough,
        options={"maxiter": max_iterations, "maxfev": 2 * max_iterations, "xatol": 1e-15, "fatol": 1e-16},
    )
    return shooter.solution("shooting as published", found.x, int(found.nit), aim)
