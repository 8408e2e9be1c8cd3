"""Energy minimisation by IPOPT under volume or pressure control.

IPOPT's word is not taken: the caller recomputes residual, constraint and inertia (:mod:`.newton`, :mod:`..stability`). The unknowns
are scaled by the size of u and w in the guess, so that a nearly flat membrane (w of order V, u of order V^2, E of order V^4) is the same
problem to IPOPT as a well inflated one.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ..errors import Status
from ..potential import Array, Evaluation, Potential
from .banded import negative_directions
from .controls import Control, PressureControl, VolumeControl
from .newton import NewtonResult, correct

_OPTIONS: dict[str, Any] = {
    "print_time": False,
    "show_eval_warnings": False,  # points outside the domain of the energy are answered with NaN and a shorter step
    "calc_lam_p": False,
    "calc_lam_x": False,
    "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-9, "acceptable_iter": 0},
}


def minimize(
    potential: Potential, control: Control, x: Array, pressure: float, *, magnetic: float = 1.0, max_iterations: int = 200
) -> tuple[Array, float, int, str]:
    """Minimise E at a volume, or E - P V at a pressure, from a guess.

    Returns
    -------
    x : ndarray, shape (n_free,)
    pressure : float
        Under volume control the multiplier of the constraint.
    iterations : int
    status : str
        IPOPT's own return status, kept for the record.
    """
    evaluation = potential.evaluate(x, pressure, magnetic)
    scale_u, scale_w = (float(np.abs(x[index]).max(initial=0.0)) or 1.0 for index in potential.space.fields)
    scales = np.empty_like(x)
    scales[potential.space.fields[0]], scales[potential.space.fields[1]] = scale_u, scale_w
    objective = float(np.abs(scales * evaluation.gradient).max(initial=0.0)) or 1.0
    volume = float(np.abs(scales * evaluation.volume_gradient).max(initial=0.0)) or 1.0
    solver = _solver(potential, isinstance(control, VolumeControl), max_iterations)
    start: dict[str, Any] = {"x0": x / scales}
    if isinstance(control, VolumeControl):
        target = control.volume / volume
        start |= {
            "p": [0.0, magnetic, scale_u, scale_w, objective, volume],
            "lbg": target,
            "ubg": target,
            "lam_g0": -pressure * volume / objective,
        }
    elif isinstance(control, PressureControl):
        start |= {"p": [control.pressure, magnetic, scale_u, scale_w, objective, volume]}
    else:
        raise TypeError(f"IPOPT minimises under volume or pressure control, not {type(control).__name__}")
    solution = solver(**start)
    stats = solver.stats()
    found = np.asarray(solution["x"]).ravel() * scales
    p = -float(solution["lam_g"]) * objective / volume if isinstance(control, VolumeControl) else control.pressure
    return found, p, int(stats.get("iter_count", 0)), str(stats["return_status"])


@lru_cache(maxsize=32)
def _solver(potential: Potential, constrained: bool, max_iterations: int) -> ca.Function:
    functions = potential.nlp
    y, p = ca.MX.sym("y", potential.space.n_free), ca.MX.sym("p", 6)
    problem = {"x": y, "p": p, "f": functions.value(y, p)}
    options = _OPTIONS | {"grad_f": functions.gradient, "ipopt": _OPTIONS["ipopt"] | {"max_iter": max_iterations}}
    if constrained:
        problem["g"] = functions.volume(y, p)
        options |= {"jac_g": functions.volume_gradient, "hess_lag": functions.hessian}
    else:
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", 0)
        options["hess_lag"] = ca.Function("nlp_hess_l", [y, p, lam_f, lam_g], [functions.hessian(y, p, lam_f, 0.0)])
    return ca.nlpsol("ipopt", "ipopt", problem, options)


def minimize_and_verify(
    potential: Potential, control: Control, x: Array, pressure: float, *, magnetic: float = 1.0, max_iterations: int = 60
) -> NewtonResult:
    """IPOPT, then our own check: residual and constraint by the bordered corrector, inertia for a minimum.

    Returns
    -------
    NewtonResult
        Status NOT_A_MINIMUM when forces balance but the second variation has a negative direction under this control.
    """
    found, p, iterations, _ = minimize(potential, control, x, pressure, magnetic=magnetic, max_iterations=max_iterations)
    if not (np.isfinite(found).all() and np.isfinite(p)):
        found, p = x, pressure
    result = correct(potential, control, found, p, magnetic=magnetic)
    result.iterations += iterations
    if result.status is Status.CONVERGED and not is_minimum(potential, control, result.evaluation):
        result.status = Status.NOT_A_MINIMUM
    return result


def is_minimum(potential: Potential, control: Control, evaluation: Evaluation) -> bool:
    """Whether the second variation has no negative direction under volume or pressure control."""
    constraint = evaluation.volume_gradient if isinstance(control, VolumeControl) else None
    return negative_directions(evaluation.band, potential.space.half_bandwidth, constraint) == 0
