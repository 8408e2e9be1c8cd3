"""Single ways to an equilibrium at a load: from a guess, and along a branch until it meets the load; and whether a state is sound."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from ..errors import SolveError, Status
from ..potential import Potential
from .branch import BranchProblem, first_point
from .contact import touches_source
from .continuation import BranchPoint, StepControl, Tracer, trace_points
from .controls import CONTROLS, Control, ControlKind, Gas
from .guess import guess_at_volume
from .homotopy import Held, follow_homotopy
from .minimize import is_minimum, minimize
from .newton import correct
from .segment import Segment
from .state import Predictor, State
from .state_resolution import unresolved
from .wellposed import ill_posed, is_slack, slackness, unresolved_source

#: size of displacement and pressure, in units of the membrane, at which a branch is left: nothing there comes back
HUGE = 1e12
#: what can be held while the membrane goes downhill
DOWNHILL = (CONTROLS["volume"], CONTROLS["pressure"])
#: most corrections of a guess
CORRECTIONS = 40
#: most steps along a branch in each direction
_STEPS = 300


def from_guess(
    potential: Potential,
    control: Control,
    volume: float,
    *,
    pressure: float = 0.0,
    magnetic: float = 1.0,
    accept: Callable[[State], bool] | None = None,
) -> State | None:
    """An equilibrium under a control from the guess at a volume: by Newton's method, or held by dead forces that fade out.

    Without sources and loads (``magnetic=0.0``) the way downhill is tried between the two; with them it may end in a singularity.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # a guess may be too large or small for its energy to be a number: not converged
        guess = guess_at_volume(potential, volume)
        if not np.isfinite(potential.evaluate(guess, pressure, magnetic).gradient).all():
            return None
        result = correct(potential, control, guess, pressure, magnetic=magnetic, damped=True, max_iterations=CORRECTIONS)
        if result.status is not Status.CONVERGED and not magnetic:
            found, p, _, _ = minimize(potential, control, guess, pressure, magnetic=magnetic)
            if np.isfinite(found).all() and np.isfinite(p):
                result = correct(potential, control, found, p, magnetic=magnetic)
        if result.status is Status.CONVERGED and (accept is None or accept(State.of(result))):
            return State.of(result)
        return follow_homotopy(Held(potential, control, guess, pressure, magnetic=magnetic), guess, pressure, accept=accept)


def along(
    potential: Potential, state: State, held: ControlKind | Gas, load: float, accept: Callable[[State], bool] | None = None
) -> State | None:
    """The first state at a load, that will do, on the branch through a state; None if there is none within the bounds."""
    point = first_point(potential, state, 1)
    rises = (load - state.value_of(held)) * point.rate_of(held) >= 0
    failure = None
    for direction in (1, -1) if rises else (-1, 1):
        try:
            found = _first_met(potential, first_point(potential, state, direction), held, load, accept)
        except SolveError as error:
            failure = failure or error
            continue
        if found is not None:
            return found
    if failure is not None:
        raise failure
    return None


def caught(potential: Potential, control: Control, states: Iterable[State], magnetic: float = 1.0) -> State | None:
    """A state in which bodies stop the membrane: downhill from where it cannot stay.

    Beyond pull-in no equilibrium is near. A body that keeps the membrane away from the singular field bounds the energy from below, so that
    there is a minimum in contact with it.

    Parameters
    ----------
    potential : Potential
        With bodies.
    control : VolumeControl or PressureControl
    states : iterable of State
        From which it goes downhill, until one arrives at a sound state.
    magnetic : float
        Factor on sources and loads.

    Returns
    -------
    State or None
        A minimum; one that is not sound where no other was met.
    """
    spare = None
    for state in states:
        with np.errstate(all="ignore"):  # a trial may be absurd: it is refused by its result
            found, pressure, _, _ = minimize(potential, control, state.x, state.pressure, magnetic=magnetic)
            if not (np.isfinite(found).all() and np.isfinite(pressure)):
                continue
            result = correct(potential, control, found, pressure, magnetic=magnetic)
        if result.status is Status.CONVERGED and is_minimum(potential, control, result.evaluation):
            landed = State.of(result)
            if sound(landed):
                return landed
            spare = spare or landed
    return spare


def _first_met(
    potential: Potential, point: BranchPoint, held: ControlKind | Gas, load: float, accept: Callable[[State], bool] | None
) -> State | None:
    if point.state.value_of(held) == load and (accept is None or accept(point.state)):
        return point.state
    space = potential.space
    away = np.inf if potential.strained else abs(point.state.volume - space.reference_volume) / space.units["volume"]
    control = StepControl(largest=np.inf)  # as long as the deviation allows: nobody draws this branch
    tracer = Tracer(Predictor(), control.first * min(1.0, np.sqrt(away)), control)
    problem, spare = BranchProblem(potential), None
    for _, new in zip(range(_STEPS), trace_points(problem, point, tracer), strict=False):
        for state in _met(Segment(problem, point, new), held, load, accept):
            if well_posed(state):
                return state
            spare = spare or state
        if is_slack(potential, new.state):
            raise slackness(potential, new.state)
        touching = touches_source(potential.distance_to_sources(new.state.x), potential.space.unit)
        if touching or unresolved_source(potential, new.state.x):
            raise SolveError(f"the branch runs into a source at V = {new.state.volume:.6g}", status=Status.DIPOLE_CONTACT)
        point = new
        size = problem.norm(new.z)
        if size > HUGE:
            return spare
        tracer.step = min(tracer.step, StepControl.largest * (1 + size))  # in proportion to the membrane
    return spare


def _met(segment: Segment[BranchPoint], held: ControlKind | Gas, load: float, accept: Callable[[State], bool] | None) -> Iterator[State]:
    """States at the load on a segment that will do."""
    if isinstance(held, Gas):
        yield from _gas_met(segment, held)
        return
    for met in segment.crossings(held.name, load):
        # at the limit point itself round-off has the sign of the smallest eigenvalue: there the side that is stable says it
        at_limit = held is CONTROLS["pressure"] and any(met is fold.point for fold in segment.folds("limit_point"))
        judged = (segment.a, segment.b) if at_limit else (met,)
        if accept is None or any(accept(p.state) for p in judged):
            yield met.state


def _gas_met(segment: Segment[BranchPoint], gas: Gas) -> Iterator[State]:
    """The state at the amount of a gas between two points of a branch, both of which compress it."""
    ends = (segment.a, segment.b)
    missing = [point.state.value_of(gas) - gas.amount for point in ends]
    if missing[0] * missing[1] > 0 or any(point.state.volume <= -gas.chamber for point in ends):
        return
    share = missing[0] / (missing[0] - missing[1])
    near = segment.at(share) if 0 < share < 1 else segment.b
    result = correct(segment.problem.potential, gas, near.state.x, near.state.pressure, damped=True)
    if result.status is Status.CONVERGED:
        yield State.of(result)


def well_posed(state: State) -> bool:
    return ill_posed(state.evaluation.potential, state.evaluation) is None


def sound(state: State) -> bool:
    """Whether a state is that of a membrane: well-posed, and not one of its mesh only."""
    return well_posed(state) and not unresolved(state.evaluation.potential.root, state)
