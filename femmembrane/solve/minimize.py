"""Energy minimisation by IPOPT under volume or pressure control.

IPOPT's word is not taken: the caller recomputes residual, constraint and inertia (:mod:`.newton`, :mod:`..stability`). The unknowns are
scaled by the size of u and w in the guess. A nearly flat membrane has w of order V, u of order V^2 and E of order V^4; the scaling makes it
the same problem to IPOPT as a well inflated one.

A total charge Q couples all points, and the second derivatives of its energy Q^2/(2 C) are full. Here the voltage is one more unknown phi,
with the charge as its equation::

    minimise W(x) - phi^2 C(x)/2 + Q phi - P V(x)      where      phi C(x) = Q

The derivative of the first with respect to phi is what the second says, so that the multiplier of the second vanishes, and second
derivatives are those of the first: sparse, with one full row.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, cast

import casadi as ca
import numpy as np

from ..discretization.space import HESSIAN_PAIRS
from ..errors import Status
from ..potential import Array, Evaluation, Potential
from ..potential.contact import gap_rows
from ..potential.expressions import BUILDING
from ..potential.replay import vectorise
from ..threads import Guard
from .banded import negative_among
from .controls import Control, PressureControl, VolumeControl
from .newton import NewtonResult, correct, displaced
from .state import displacement, distance

if TYPE_CHECKING:
    from ..potential.contact import ContactPotential
from .wellposed import stress_free

#: two states closer than this are the same, relative to the size of the displacement
SAME = 1e-6
#: square of a voltage, over that of its scale, that is none and may be divided by
_NO_SQUARE = 1e-40

_OPTIONS: dict[str, Any] = {
    "print_time": False,
    "show_eval_warnings": False,  # points outside the domain of the energy are answered with NaN and a shorter step
    "calc_lam_p": False,
    "calc_lam_x": False,
    "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-9, "acceptable_iter": 0},
}


@dataclass(frozen=True)
class NlpFunctions:
    """E - P V under a scaling of the unknowns, x = scale_u y_u and x = scale_w y_w, as CasADi functions for ``nlpsol``.

    Parameters ``p`` of all: (P, magnetic factor, scale of u, of w, of the objective, of the volume). With a total charge the last unknown
    is the voltage over its scale, (Q, scale of the voltage, of the charge) are parameters as well, and ``charge`` answers phi C and its
    derivatives.
    """

    value: ca.Function
    gradient: ca.Function
    hessian: ca.Function
    volume: ca.Function
    volume_gradient: ca.Function
    charge: ca.Function | None = None


def minimize(
    potential: Potential,
    control: Control,
    x: Array,
    pressure: float,
    *,
    magnetic: float = 1.0,
    max_iterations: int = 200,
    evaluation: Evaluation | None = None,
) -> tuple[Array, float, int, str]:
    """Minimise E at a volume, or E - P V at a pressure, from a guess, at which the ``evaluation`` may be known already.

    Returns
    -------
    x : ndarray, shape (n_free,)
    pressure : float
        Under volume control the multiplier of the constraint.
    iterations : int
    status : str
        IPOPT's own return status, kept for the record.
    """
    alone, factor = potential.by_itself(magnetic)
    if alone is not potential:
        potential, magnetic, evaluation = alone, factor, None
    evaluation = evaluation or potential.evaluate(x, pressure, magnetic)
    scale_u, scale_w = (float(np.abs(x[index]).max(initial=0.0)) or 1.0 for index in potential.space.fields)
    if potential.strained:  # stiff in both directions, so that one length measures both
        scale_u = scale_w = max(displaced(potential, x))
    scales = np.empty_like(x)
    scales[potential.space.fields[0]], scales[potential.space.fields[1]] = scale_u, scale_w
    objective = float(np.abs(scales * evaluation.gradient).max(initial=0.0)) or 1.0
    volume = float(np.abs(scales * evaluation.volume_gradient).max(initial=0.0)) or 1.0
    targets, multipliers, start = [], [], x / scales
    if isinstance(control, VolumeControl):
        solver, held = _solver(potential, True, max_iterations), 0.0
        targets, multipliers = [control.volume / volume], [-pressure * volume / objective]
    elif isinstance(control, PressureControl):
        solver, held = _solver(potential, False, max_iterations), control.pressure
    else:
        raise TypeError(f"IPOPT minimises under volume or pressure control, not {type(control).__name__}")
    parameters = [held, magnetic, scale_u, scale_w, objective, volume]
    if potential.charged is not None:
        charge, square = math.sqrt(potential.charge_squared(magnetic)), potential.square(x, magnetic) or 0.0
        voltage = math.sqrt(square) if 0 < square < math.inf else 0.0
        parameters += [charge, voltage or 1.0, charge or 1.0]
        targets, multipliers = [*targets, 1.0 if charge else 0.0], [*multipliers, 0.0]
        start = np.append(start, 1.0 if voltage else 0.0)
    found, multiplier, iterations, status = solver(start, parameters, targets, multipliers)
    p = -float(multiplier[0]) * objective / volume if isinstance(control, VolumeControl) else held
    return found[: x.size] * scales, p, iterations, status


class _Solver:
    """IPOPT on one problem, called through arrays: turning them into CasADi's matrices and back takes as long as two iterations.

    Threads may share one: calls are answered one at a time.
    """

    def __init__(self, function: ca.Function, gaps: int = 0) -> None:
        n, m = function.numel_in(0), function.numel_out(2)
        self._lock = Guard()
        self._x, self._parameters = np.zeros(n), np.zeros(function.numel_in(1))
        self._target, self._multiplier = np.zeros(m), np.zeros(m)
        free = np.full(n, np.inf)
        most = self._target
        if gaps:  # the last rows, at least 0
            self._most = np.full(m, np.inf)
            most = self._most
        self._gaps = gaps
        self._inputs = (self._x, self._parameters, -free, free, self._target, most, np.zeros(n), self._multiplier)
        self._outputs = [np.zeros(function.numel_out(k)) for k in range(function.n_out())]
        self._buffer, self._call = function.buffer()
        for k, array in enumerate(self._inputs):
            self._buffer.set_arg(k, memoryview(array))  # type: ignore[arg-type, call-arg]
        for k, array in enumerate(self._outputs):
            self._buffer.set_res(k, memoryview(array))  # type: ignore[arg-type, call-arg]

    def __call__(
        self, x: Array, parameters: Sequence[float], targets: Sequence[float], multipliers: Sequence[float]
    ) -> tuple[Array, Array, int, str]:
        """Minimiser, multipliers of the constraints, iterations and IPOPT's return status, from a guess with guesses of the multipliers."""
        with self._lock:
            self._x[:], self._parameters[:] = x, parameters
            rows = len(self._target) - self._gaps
            self._target[:rows], self._multiplier[:rows] = targets, multipliers
            if self._gaps:
                self._most[:rows] = targets
            self._call()
            stats = self._buffer.stats()
            found, multiplier = self._outputs[0].copy(), self._outputs[4][: len(self._target) - self._gaps].copy()
        return found, multiplier, int(stats.get("iter_count", 0)), str(stats["return_status"])


@lru_cache(maxsize=32)
@BUILDING
def _solver(potential: Potential, constrained: bool, max_iterations: int) -> _Solver:
    functions = nlp_functions(potential)
    y, p = ca.MX.sym("y", functions.value.numel_in(0)), ca.MX.sym("p", functions.value.numel_in(1))
    problem = {"x": y, "p": p, "f": functions.value(y, p)}
    options = _OPTIONS | {"grad_f": functions.gradient, "ipopt": _OPTIONS["ipopt"] | {"max_iter": max_iterations}}
    if potential.obstacles:
        return _solver_with_bodies(cast("ContactPotential", potential), functions, problem, options, constrained)
    charged = functions.charge is not None
    constraints = [functions.volume_gradient] if constrained else []
    if functions.charge is not None:
        constraints.append(functions.charge)
    if constraints:
        values, rows = zip(*(constraint(y, p) for constraint in constraints), strict=True)
        problem["g"] = ca.vertcat(*values)
        options["jac_g"] = ca.Function("nlp_jac_g", [y, p], [problem["g"], ca.vertcat(*rows)]) if charged else functions.volume_gradient
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", len(constraints))
    second = functions.hessian(y, p, lam_f, lam_g[0] if constrained else 0.0)
    options["hess_lag"] = ca.Function("nlp_hess_l", [y, p, lam_f, lam_g], [second]) if charged or not constrained else functions.hessian
    return _Solver(ca.nlpsol("ipopt", "ipopt", problem, options))


def _solver_with_bodies(
    potential: ContactPotential, functions: NlpFunctions, problem: dict[str, Any], options: dict[str, Any], constrained: bool
) -> _Solver:
    """IPOPT with a gap >= 0 at every node, over the size of the membrane; the nodes of a guess are moved out of the bodies."""
    y, p = problem["x"], problem["p"]
    gaps = gap_rows(potential, y, p)
    count = gaps.numel()
    held = [(functions.volume(y, p), functions.volume_gradient(y, p)[1])] if constrained else []
    if functions.charge is not None:
        held.append(functions.charge(y, p))
    values, rows = [value for value, _ in held], [row for _, row in held]
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", count + len(held))
    first = lam_g[0] if constrained else 0.0
    second, _ = ca.hessian(ca.dot(lam_g[len(held) :], gaps), y)
    hessian = functions.hessian(y, p, lam_f, first) + ca.triu(second)
    problem["g"] = ca.vertcat(*values, gaps)
    options["ipopt"] = options["ipopt"] | {"bound_relax_factor": 0.0, "tol": 1e-11, "compl_inf_tol": 1e-11}
    options["jac_g"] = ca.Function("nlp_jac_g", [y, p], [problem["g"], ca.vertcat(*rows, ca.jacobian(gaps, y))])
    options["hess_lag"] = ca.Function("nlp_hess_l", [y, p, lam_f, lam_g], [hessian])
    return _Solver(ca.nlpsol("ipopt", "ipopt", problem, options), count)


def minimize_and_verify(
    potential: Potential, control: Control, x: Array, pressure: float, *, magnetic: float = 1.0, max_iterations: int = 30
) -> NewtonResult:
    """IPOPT, then our own check: residual and constraint by the bordered corrector, inertia for a minimum.

    Returns
    -------
    NewtonResult
        Status NOT_A_MINIMUM when forces balance but the second variation has a negative direction under this control.
    """
    evaluation = potential.evaluate(x, pressure, magnetic)
    if not np.isfinite(evaluation.energy):  # outside the domain of the energy: nothing to scale by
        return correct(potential, control, x, pressure, magnetic=magnetic)
    found, p, iterations, _ = minimize(
        potential, control, x, pressure, magnetic=magnetic, max_iterations=max_iterations, evaluation=evaluation
    )
    if not (np.isfinite(found).all() and np.isfinite(p)):
        found, p = x, pressure
    result = correct(potential, control, found, p, magnetic=magnetic)
    if result.status is Status.CONVERGED:
        result = _on_branch_of_guess(potential, control, x, pressure, magnetic, result)
    result.iterations += iterations
    if result.status is Status.CONVERGED and not is_minimum(potential, control, result.evaluation):
        result.status = Status.NOT_A_MINIMUM
    return result


def _on_branch_of_guess(
    potential: Potential, control: Control, x: Array, pressure: float, magnetic: float, found: NewtonResult
) -> NewtonResult:
    """The minimiser's state, or the state that Newton's method finds from the guess if this is another one and nearer.

    Where the branch is unstable a minimiser may stay on it, or go downhill to another branch: round-off and the mesh decide.
    """
    own = correct(potential, control, x, pressure, magnetic=magnetic)
    if own.status is not Status.CONVERGED or distance(potential, own.x, found.x) <= SAME * displacement(potential, found.x):
        return found
    return own if distance(potential, own.x, x) < distance(potential, found.x, x) else found


def is_minimum(potential: Potential, control: Control, evaluation: Evaluation) -> bool:
    """Whether the second variation has no negative direction under volume or pressure control.

    Without stress nothing but round-off resists a deflection, which may have either sign; the energy is least there.
    """
    constraint = evaluation.volume_gradient if isinstance(control, VolumeControl) else None
    return negative_among(evaluation, constraint) == 0 or stress_free(evaluation)


@lru_cache(maxsize=32)
@BUILDING
def nlp_functions(potential: Potential) -> NlpFunctions:
    """Assemble the point functions of a potential into functions of all unknowns; built once."""
    space, n, charged = potential.space, potential.n_points, potential.charged is not None
    unknowns, p = ca.MX.sym("y", space.n_free + charged), ca.MX.sym("p", 9 if charged else 6)
    y, voltage = (unknowns[: space.n_free], unknowns[space.n_free] * p[7]) if charged else (unknowns, ca.MX(0))
    square = [voltage**2 + _NO_SQUARE * p[7] ** 2] if charged else []
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g")
    is_u = np.zeros(space.n_free)
    is_u[space.fields[0]] = 1.0
    scale = is_u * p[2] + (1 - is_u) * p[3]
    local = ca.reshape(ca.mtimes(ca.DM(space.evaluation_matrix()), scale * y), n, 4)
    data = ca.DM(potential.point_data.T)

    t, (_, local_symbol, parameters) = potential.terms, potential.symbols
    total = t["elastic"] + t["magnetic"] + t["load"] + t.get("electric", 0.0) - parameters[0] * t["volume"]
    force = t["gradient"] - parameters[0] * t["volume_gradient"]
    curvature = t["hessian"] - parameters[0] * ca.jacobian(t["volume_gradient"], local_symbol)

    def at_points(expressions: list[ca.SX], pressure: ca.MX) -> ca.MX:
        """Expressions at all points, one column each: every function below computes what it returns and nothing else."""
        function = ca.Function("rows", list(potential.symbols), [ca.densify(ca.vertcat(*expressions))], {"cse": True})
        return vectorise(function, n)(data, local, ca.vertcat(pressure, p[1], *square))

    integrate = ca.DM(space.evaluation_matrix().T)
    both = at_points([total, force], p[0])
    gradient: Any = scale * ca.mtimes(integrate, ca.vec(both[:, 1:]))
    volume = ca.sum1(at_points([t["volume"]], p[0])) / p[5]
    volume_gradient: Any = scale * ca.mtimes(integrate, ca.vec(at_points([t["volume_gradient"]], p[0]))) / p[5]
    rows, columns, integrator = space.hessian_matrix()
    # the Lagrangian lam_f (E - P V)/objective + lam_g V/volume has the Hessian of E - q V with this q
    multiplier = p[0] - lam_g / lam_f * p[4] / p[5]
    second = at_points([curvature[a, b] for a, b in HESSIAN_PAIRS], multiplier)
    entries = ca.mtimes(ca.DM(integrator), ca.vec(second)) * (scale[rows] * scale[columns]) * (lam_f / p[4])
    hessian = ca.MX(ca.Sparsity.triplet(space.n_free, space.n_free, rows, columns), entries)
    extra, given, charge = ca.MX(0), [unknowns, p], None
    if potential.charged is not None:
        at = at_points(list(potential.charged.expressions), p[0])
        capacitance = ca.sum1(at[:, 0])
        stiffness = capacitance + 2 * square[0] * ca.sum1(at[:, 1])
        mixed = voltage * scale * ca.mtimes(integrate, ca.vec(at[:, 2:]))
        extra, gradient = p[6] * voltage, ca.vertcat(gradient, (p[6] - voltage * capacitance) * p[7])
        volume_gradient = ca.vertcat(volume_gradient, 0.0)
        last = ca.vertcat(mixed * p[7], stiffness * p[7] ** 2) * (lam_f / p[4])
        hessian = ca.horzcat(ca.vertcat(hessian, ca.MX(1, space.n_free)), -last)
        charge = ca.Function("nlp_charge", given, [voltage * capacitance / p[8], ca.vertcat(mixed, stiffness * p[7]).T / p[8]])
    return NlpFunctions(
        value=ca.Function("nlp_f", given, [(ca.sum1(at_points([total], p[0])) + extra) / p[4]]),
        gradient=ca.Function("nlp_grad_f", given, [(ca.sum1(both[:, 0]) + extra) / p[4], gradient / p[4]]),
        hessian=ca.Function("nlp_hess_l", [unknowns, p, lam_f, lam_g], [hessian]),
        volume=ca.Function("nlp_g", given, [volume]),
        volume_gradient=ca.Function("nlp_jac_g", given, [volume, volume_gradient.T]),
        charge=charge,
    )
