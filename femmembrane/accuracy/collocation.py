"""Collocation: the boundary-value problem as such, from the pole to the rim, by SciPy's ``solve_bvp`` (order 4, on a mesh of its own)."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_bvp
from scipy.interpolate import CubicSpline

from ..discretization.meridian import LEAST_LENGTH
from ..errors import InputError
from ..scene import Scene
from .strong_form import SINGULAR, Array, Guess, Solution, StrongForm, check_tolerance, prescribed

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

    The singular terms at the pole are linear in the unknowns of :mod:`.strong_form` and are handed over as the matrix S, so the interval
    begins at r = 0 itself. The pressure is an unknown parameter unless it is prescribed; the volume is a fifth equation.

    Parameters
    ----------
    scene : Scene
        See :class:`.strong_form.StrongForm`.
    guess : Guess
        With a profile; its radii are the first mesh.
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
    scale = max(abs(load), 1.0) if control == "volume" else 0.0  # a large volume would hide the round-off of the rest
    r, first = _first(form, guess, scale)
    stretch, height = form.rim
    n = len(first)
    singular = np.zeros((n, n))
    singular[:4, :4] = SINGULAR

    def equations(r: Array, y: Array, p: Array | None = None) -> Array:
        f = form.regular(r, y[:4], load if p is None else p[0])
        return f if n == 4 else np.vstack([f, form.densities(r, y[:4])[:1] / scale])

    def conditions(pole: Array, rim: Array, p: Array | None = None) -> Array:
        ends = [pole[2], pole[3], rim[0] - np.log(stretch), rim[1] - height]
        if control == "volume":
            ends += [pole[4], rim[4] - load / scale]
        elif control == "center_height":
            ends.append(pole[1] - load)
        return np.array(ends)

    parameters = None if control == "pressure" else np.array([guess.pressure])
    with np.errstate(all="ignore"):  # a wild iterate may leave the domain of the energy: the solver then gives up
        found = solve_bvp(equations, conditions, r, first, p=parameters, S=singular, tol=aim, bc_tol=aim, max_nodes=max_nodes)
    return _solution(form, found, conditions, load if control == "pressure" else None, aim)


def _first(form: StrongForm, guess: Guess, scale: float) -> tuple[Array, Array]:
    """Mesh and unknowns from the profile of a guess. With a scale the volume over this scale is an unknown."""
    if guess.profile is None:
        raise InputError("guess.profile", None, "missing; collocation sets out from a profile with columns r, rho and eta")
    r, rho, eta = (np.asarray(guess.profile[name], dtype=float) for name in ("r", "rho", "eta"))
    if r.ndim == 1 and r.size > 2 and abs(r[0]) <= LEAST_LENGTH and abs(r[-1] - 1) <= LEAST_LENGTH:
        r = np.array([0.0, *r[1:-1], 1.0])  # computed ends are exact to round-off only
    if r.ndim != 1 or r.size < 3 or r[0] != 0 or r[-1] != 1 or not (np.diff(r) > 0).all() or not (r.shape == rho.shape == eta.shape):
        raise InputError(
            "guess.profile", f"{r.size} radii", "three or more increasing radii from 0 to 1 are allowed, with rho and eta at each"
        )
    rho_r, eta_r = CubicSpline(r, rho)(r, 1), CubicSpline(r, eta)(r, 1)
    l2 = np.concatenate([[guess.stretch], rho[1:] / r[1:]])
    if not (l2 > 0).all():
        raise InputError("guess.profile", float(l2.min()), "radii rho > 0 away from the pole are allowed")
    phi = np.unwrap(np.arctan2(eta_r, rho_r))
    d = np.log(np.hypot(rho_r, eta_r) / l2)
    d[0] = phi[0] = 0.0
    y = np.array([np.log(l2), eta, d, phi])
    if not scale:
        return r, y
    density = CubicSpline(r, form.densities(r, y)[0] / scale)
    return r, np.vstack([y, density.antiderivative()(r)])


def _solution(form: StrongForm, found: Any, conditions: Any, pressure: float | None, aim: float) -> Solution:
    """The record, with integrals over the profile that was found."""
    left, size = found.x[:-1], np.diff(found.x)
    points = left + size * (_POINTS[:, None] + 1) / 2
    with np.errstate(all="ignore"):  # the numbers of a failed solve may be anything
        density = form.densities(points.ravel(), found.sol(points.ravel())[:4]).reshape(3, *points.shape)
        volume, elastic, magnetic = (float(v) for v in np.einsum("q,kqe,e->k", _WEIGHTS, density, size / 2))
        ends = np.abs(conditions(found.y[:, 0], found.y[:, -1])).max()
    residual = float(max(np.max(found.rms_residuals), ends))
    converged = bool(found.status == 0 and residual <= 10 * aim)
    return Solution(
        "collocation",
        float(found.p[0]) if pressure is None else pressure,
        volume,
        float(found.y[1, 0]),
        elastic,
        magnetic,
        converged,
        residual if np.isfinite(residual) else np.inf,
        form.evaluations,
        int(found.niter),
        "" if converged else str(found.message),
        lambda r: found.sol(r)[:4],
    )
