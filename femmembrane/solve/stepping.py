"""From one equilibrium to the next under a prescribed load: predictor, corrector, and steps halved until the path is followed.

A converged solve is not yet a step along the branch. A step is accepted only if the corrector moved the prediction by a small part of
the step itself; otherwise the solver may have jumped, and the step is halved. The answer then does not depend on the mesh or on the
load steps asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

import numpy as np

from ..errors import SolveError, Status
from ..potential import Array, Evaluation, Family, Potential
from .contact import coarse_at_edge
from .controls import CenterHeightControl, Control, Gas, GasOver, VolumeControl
from .newton import NewtonResult, correct
from .state import Predictor, State, distance, joined
from .wellposed import apparent, is_slack, slackness

#: largest change that the corrector may make, relative to the step
MAX_DEVIATION = 0.2
#: a step this much shorter than the way, and than the load itself, means that the branch turns or ends
MIN_STEP = 1e-4
#: and so does one that is this small a part of the whole way
ROUND_OFF = 1e-15
#: displacement in units of the membrane's own size that is none: a flat sheet that is stretched stays where it is
_NO_MOTION = 1e-16

Corrector = Callable[..., NewtonResult]


def march(
    potential: Potential,
    state: State,
    control_at: Callable[[float], Control],
    start: float,
    stop: float,
    *,
    path: Predictor | None = None,
    corrector: Corrector = correct,
    parameter: str = "load",
    magnetic: float = 1.0,
) -> list[State]:
    """Follow a branch from a load to another one.

    Parameters
    ----------
    potential, state : Potential, State
        Where to start.
    control_at : callable
        The control at a value of the parameter.
    start, stop : float
        Values of the parameter at ``state`` and at the end.
    path : Predictor, optional
        Memory of the steps before, extended in place.
    corrector : callable
        :func:`.newton.correct` or a minimiser with its signature.
    parameter : {"load", "magnetic", "number"}
        Whether the parameter is the control's own value, the factor on the magnetic energy, or the number of a :class:`.Family`.

    Returns
    -------
    list of State
        All accepted states in order, the last one at ``stop``.

    Raises
    ------
    SolveError
        With status STEP_UNDERFLOW when steps become tiny, SLACK when a tension field becomes slack before the end, DIPOLE_CONTACT;
        ``result`` holds the states accepted before.
    """
    path = Predictor() if path is None else path
    if not path.sigma:
        path.append(start, joined(state.x, state.pressure), _carried_slope(potential, state, control_at(start), parameter, start))
    accepted = [state]
    here, step = start, stop - start
    spent = 0
    while here != stop:
        there = stop if abs(stop - here) <= abs(step) * (1 + 1e-12) else here + step
        guess, control = path.predict(there), control_at(there)
        x, pressure = guess[:-1], float(guess[-1])
        result = corrector(potential, control, x, pressure, magnetic=magnetic if parameter == "load" else there)
        spent += result.iterations
        reach = distance(potential, x, accepted[-1].x)
        if potential.unsettled and parameter == "number":  # a body that comes on moves a membrane that nothing has moved before
            reach = max(reach, abs(there - here) * cast("Family", potential).advance(accepted[-1].evaluation))
        if (
            result.status is Status.CONVERGED
            and distance(potential, result.x, x)
            <= MAX_DEVIATION * reach + 1e-9 * max(potential.largest(x)) / potential.space.unit + _NO_MOTION
        ):
            new = State.of(result, spent - result.iterations)
            if _through_source(potential, accepted[-1], new, parameter):
                message = f"the pole would have to pass through a source between {here:.9g} and {there:.9g}"
                raise SolveError(message, status=Status.DIPOLE_CONTACT, result=accepted)
            path.append(there, joined(new.x, new.pressure), _carried_slope(potential, new, control, parameter, there))
            accepted.append(new)
            here, spent = there, 0
            step *= 2
            if parameter != "magnetic" and here != stop and is_slack(potential, new):
                raise slackness(potential, new, accepted)
        else:
            step = (there - here) / 2
            # sources at full strength may lie next to a fold, and nobody else looks for a state there: the way to go counts, not the whole
            way = abs(stop - here) if parameter == "magnetic" else min(abs(stop - start), abs(here) or np.inf)
            if abs(step) < max(MIN_STEP * way, ROUND_OFF * abs(stop - start)):
                message = f"the branch could not be followed beyond {here:.9g} on the way to {stop:.9g}"
                bad = None if parameter == "magnetic" else apparent(potential, accepted[-1].evaluation)
                if bad is not None:
                    raise SolveError(f"{message}: {bad}", status=bad.status, result=accepted)
                if reason := coarse_at_edge(accepted[-1].evaluation):
                    raise SolveError(f"{message}: {reason}", status=Status.NOT_RESOLVED, result=accepted)
                near = coarse_at_edge(accepted[-1].evaluation, edges="near")
                raise SolveError(f"{message}; {near}" if near else message, status=Status.STEP_UNDERFLOW, result=accepted)
    return accepted[1:]


def _through_source(potential: Potential, before: State, after: State, parameter: str) -> bool:
    """Whether the membrane went through a source on a step; while sources are turned on nobody asks."""
    if parameter == "number" and isinstance(potential, Family):
        return potential.came_through_source(after.evaluation.factor, after.x, before.evaluation.factor, before.x)
    return parameter == "load" and bool(after.evaluation.factor) and potential.passed_source(before.x, after.x)


def control_rate(family: Family, control: Control, x: Array, pressure: float, evaluation: Evaluation) -> float:
    """Derivative of the equation of a control with respect to the number of a family, at a fixed (x, P)."""
    rate = control.number_rate(pressure, evaluation.volume) if isinstance(control, GasOver) else 0.0
    if isinstance(control, CenterHeightControl):
        rate += family.pole_rate
    elif isinstance(control, VolumeControl):
        rate += family.volume_derivative(x, evaluation.factor)
    elif isinstance(control, Gas):
        rate += (pressure + control.atmosphere) * family.volume_derivative(x, evaluation.factor)
    return rate


def _carried_slope(potential: Potential, state: State, control: Control, parameter: str, value: float) -> Array:
    """:func:`_slope` on the mesh of the scene, as one vector."""
    dx, dp = _slope(potential, state, control, parameter, value)
    return joined(state.evaluation.carried(dx), dp)


def _slope(potential: Potential, state: State, control: Control, parameter: str, value: float) -> tuple[Array, float]:
    """Derivative of (x, P) with respect to the parameter."""
    space, evaluation = potential.space, state.evaluation
    _, row, corner = control.equation(space, evaluation.x, state.pressure, evaluation)
    bordered = evaluation.border(row, corner)
    if parameter == "load":
        return bordered.solve(np.zeros(len(state.x)), 1.0)  # N = (quantity - load)
    if parameter == "number" and isinstance(potential, Family):
        rate = control_rate(potential, control, evaluation.x, state.pressure, evaluation)
        force, shift = potential.number_rates(evaluation, state.pressure)
        if shift is None:
            return bordered.solve(-force, -rate)
        row = control.equation(space, evaluation.x, state.pressure, evaluation.raw)[1]
        dx, dp = bordered.solve(-force, -rate - float(row @ shift))
        return dx + shift, dp
    return bordered.solve(-evaluation.potential.factor_derivative(evaluation, state.pressure, value), 0.0)
