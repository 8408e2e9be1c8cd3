"""Shooting: the equations are integrated from a pole or another end, and what is unknown there is chosen so that the far end is met.

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

from ..discretization.meridian import Disc
from ..errors import InputError
from ..scene import Scene
from .ends import Ends
from .legs import Leg
from .strong_form import Array, Guess, Solution, StrongForm, check_tolerance, on_leg, prescribed, states_of

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
    """Shots of one scene under one control.

    The unknowns are those at the beginning of each leg (height and stretch at a pole, the whole state at another end), the pressure, and
    the force that holds a floating membrane; less those that are prescribed.
    """

    form: StrongForm
    ends: Ends
    integrator: str
    rtol: float
    start: float
    full: Array

    @classmethod
    def of(cls, form: StrongForm, control: str, load: float, guess: Guess, integrator: str, rtol: float, start: float) -> _Shooter:
        """A shooter that sets out from a guess."""
        ends = Ends(form, control, load, guess)
        parts = []
        for leg in form.legs:
            if leg is form.legs[0] and leg.pole:
                parts += [guess.center_height, guess.stretch]
            else:
                _, y = on_leg(leg, *states_of(guess, form))
                parts += [y[1, 0], np.exp(y[0, 0])] if leg.pole else list(y[:, 0])
        parts += [load if control == "pressure" else guess.pressure] + [0.0] * ends.floats
        full = np.array(parts)
        if ends.known_height is not None:
            full[0 if form.legs[0].pole else 1] = ends.known_height
        return cls(form, ends, integrator, rtol, start, full)

    @property
    def unknown(self) -> list[int]:
        """Positions of the unknowns among all numbers that a shot begins with."""
        known = {self._pressure} if self.ends.control == "pressure" else set()
        if self.ends.known_height is not None:
            known.add(0 if self.form.legs[0].pole else 1)
        return [k for k in range(self.full.size) if k not in known]

    @property
    def _pressure(self) -> int:
        return self.full.size - 1 - self.ends.floats

    def all_numbers(self, u: Array) -> Array:
        """All numbers that n shots begin with, from the unknowns, shape (number of unknowns, n)."""
        full = np.repeat(self.full[:, None], u.shape[1], axis=1)
        full[self.unknown] = u
        return full

    def shot(self, u: Array, energies: bool = False) -> tuple[Array, list[Any]]:
        """What n shots at once miss, with the same steps of the integrator, shape (number of conditions, n); and the whole solutions.

        Each solution has the volume as a fifth row when it is prescribed, with ``energies`` volume and energies. A shot that does not
        arrive misses by NaN.
        """
        full, n = self.all_numbers(u), u.shape[1]
        pressure, pull_up = full[self._pressure], full[-1] if self.ends.floats else np.zeros(n)
        failed = np.full((u.shape[0], n), np.nan)
        begins, ends, found, at = [], [], [], 0
        with np.errstate(all="ignore"):  # a wild guess may leave the domain of the energy: the caller sees NaN
            for leg in self.form.legs:
                size = 2 if leg.pole else 4
                one = self._leg(leg, full[at : at + size], pressure, pull_up, energies)
                at += size
                if one is None:
                    return failed, []
                found.append(one)
                begins.append(one.y[:, 0].reshape(-1, n)[:4])
                ends.append(one.y[:, -1].reshape(-1, n))
            volume = sum(end[4] for end in ends) if self.ends.control == "volume" else None
            return self.ends.conditions(begins, [end[:4] for end in ends], pressure, volume), found

    def _leg(self, leg: Leg, numbers: Array, pressure: Array, pull_up: Array, energies: bool) -> Any:
        """The equations integrated along one leg, or None."""
        n, extra = numbers.shape[1], 3 if energies else int(self.ends.control == "volume")
        # plain numbers are faster than arrays of one
        shape, p, up = ((-1,), pressure[0], pull_up[0]) if n == 1 else ((-1, n), pressure, pull_up)
        before = self.form.evaluations

        def rates(x: float, flat: Array) -> Array:
            if self.form.evaluations - before > _MOST:
                raise _TooLongError
            y = flat.reshape(shape)[:4]
            dy = self.form.rates(x, y, p, leg, up)
            return dy.ravel() if not extra else np.concatenate([dy, self.form.densities(x, y, leg)[:extra]]).ravel()

        start, first = (self.start, self._first(leg, numbers, pressure, pull_up)) if leg.pole else (0.0, numbers)
        if not leg.pole:
            first = np.concatenate([first, np.zeros((3, n))])
        first = first[: 4 + extra]
        if not np.isfinite(first).all():
            return None
        tolerances = {"rtol": self.rtol, "atol": self.rtol * 1e-2}
        try:
            found = solve_ivp(rates, (start, leg.length), first.ravel(), self.integrator, dense_output=energies, **tolerances)
        except _TooLongError:
            return None
        return found if found.success else None

    def miss(self, u: Array) -> Array:
        """By how much the conditions are missed, shape (number of conditions, n)."""
        return self.shot(u)[0]

    def _first(self, leg: Leg, numbers: Array, pressure: Array, pull_up: Array) -> Array:
        """The state where the shot leaves the pole, with the integrals up to there."""
        x, (height, stretch) = self.start, numbers
        if not (stretch > 0).all():
            return np.full((7, height.size), np.nan)
        if x == _PUBLISHED_START:
            y = np.array([np.log(stretch), height, np.zeros_like(height), np.zeros_like(height)])
        else:
            y = self.form.pole(x, height, stretch, pressure, leg, pull_up)
        # the densities of energies are linear in x there, that of the volume is cubic
        return np.concatenate([y, self.form.densities(x, y, leg) * x * np.array([[0.25], [0.5], [0.5]])])

    def solution(self, method: str, u: Array, iterations: int, tolerance: float) -> Solution:
        """The record of the shot at u, fired once more with the energies."""
        miss, found = self.shot(u[:, None], energies=True)
        full = self.all_numbers(u[:, None])[:, 0]
        residual = float(np.abs(miss).max()) if found and np.isfinite(miss).all() else np.inf
        converged = bool(residual <= tolerance)
        integrals = np.full(3, np.nan)
        if found:
            integrals = sum(one.y[4:, -1] for one in found)
            integrals[0] += self.ends.moved_lids([found[0].y[:4, 0]], [found[0].y[:4, -1]])
        return Solution(
            method,
            pressure=float(full[self._pressure]),
            volume=float(integrals[0]),
            center_height=float(full[0 if self.form.legs[0].pole else 1]),
            elastic_energy=float(integrals[1]),
            magnetic_energy=float(integrals[2]),
            converged=converged,
            residual=residual,
            evaluations=self.form.evaluations,
            iterations=iterations,
            message="" if converged else f"the rim is missed by {residual:.2g}; a guess nearer by may help",
            mesh=self.form.scene.mesh,
            _at=self._dense(found, full) if found else None,
        )

    def _dense(self, found: list[Any], full: Array) -> Callable[[Array], Array]:
        pressure, pull_up = full[self._pressure], full[-1] if self.ends.floats else 0.0

        def at(s: Array) -> Array:
            y, begun = np.empty((4, s.size)), 0
            for leg, one in zip(self.form.legs, found, strict=True):
                x, mine = leg.own(s)
                least = self.start if leg.pole else 0.0
                y[:, mine] = one.sol(np.maximum(x[mine], least))[:4]
                near = mine & (x < least)
                if near.any():
                    height, stretch = full[begun : begun + 2, None]
                    y[:, near] = self.form.pole(np.maximum(x[near], 1e-9), height, stretch, pressure, leg, pull_up)
                begun += 2 if leg.pole else 4
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
    shooter = _Shooter.of(StrongForm(scene), control, load, guess, "DOP853", rtol, _START)
    u = shooter.full[shooter.unknown]
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
    if not isinstance(scene.mesh, Disc):
        raise InputError("mesh.shape", scene.mesh.shape, "the disc is allowed: it is the paper's")
    shooter = _Shooter.of(StrongForm(scene), control, load, guess, "RK45", rtol, _PUBLISHED_START)

    def distance(u: Array) -> float:
        size = float(np.linalg.norm(shooter.miss(u[:, None])))
        return size if np.isfinite(size) else 1e3  # a simplex compares, and must be able to

    def enough(intermediate_result: Any) -> None:
        if intermediate_result.fun <= aim:
            raise StopIteration

    found = minimize(
        distance,
        shooter.full[shooter.unknown],
        method="Nelder-Mead",
        callback=enough,
        options={"maxiter": max_iterations, "maxfev": 2 * max_iterations, "xatol": 1e-15, "fatol": 1e-16},
    )
    return shooter.solution("shooting as published", found.x, int(found.nit), aim)
