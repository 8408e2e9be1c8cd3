"""Cold starts: an equilibrium at a volume without a neighbour to start from.

The order of loading is fixed, so that the answer is one state and not an accident of the optimiser: the membrane is inflated without
its sources and loads first, then their energy is turned on at constant volume.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np

from ..errors import SolveError, Status
from ..potential import Array, Potential
from .banded import negative_directions
from .continuation import BranchPoint, StepControl, Tracer, first_point, trace_points
from .controls import CenterHeightControl, VolumeControl
from .newton import correct
from .special_points import Segment
from .state import Path, State, flat_state, rests_flat
from .stepping import march
from .wellposed import ill_posed, is_slack

#: below this volume a membrane with sources is reached from here: turning sources on at the flat state starts from a singular Hessian
START_VOLUME = 0.5
#: volume below which an equilibrium is looked for from the nearly flat side
NEARLY_FLAT = 0.05
#: distance to a source, over R0, below which a start that fails has run into it
NEAR = 0.2
#: from this volume a membrane is inflated further if a dome of the wanted volume is too far from its equilibrium
SAFE_VOLUME = 10.0
#: up to this volume every membrane is a dome to which linear elasticity applies: a dome that fails there is not tried smaller
SMALL_VOLUME = 0.05


def spherical_dome(potential: Potential, volume: float) -> Array:
    """Coefficients of a spherical cap over the rim that encloses a volume, material points at equal angles.

    The height H solves pi H (H^2 + 3)/6 = V: with H = 2 sinh t this is sinh 3t = 3 V/pi, exact down to the smallest volumes.
    """
    space = potential.space
    s = space.interpolation_points()
    height = 2 * np.sinh(np.arcsinh(volume * (3 / np.pi)) / 3)
    if height == 0:
        return np.zeros(space.n_free)
    radius = (1 + height**2) / (2 * height)
    angle = 2 * np.arctan(height)
    u = radius * (_sine_excess(angle * s) - s * _sine_excess(np.asarray(angle)))  # radius sin(angle s) - s, for radius sin(angle) = 1
    eta = 2 * radius * np.sin(angle * (1 + s) / 2) * np.sin(angle * (1 - s) / 2)
    return space.interpolate(u, eta)


def _sine_excess(x: Array) -> Array:
    """sin x - x without cancellation: the radial displacement of a nearly flat dome is far below round-off of its radius."""
    square = x**2
    series = -x * square / 6 * (1 - square / 20 * (1 - square / 42 * (1 - square / 72)))
    return np.where(square < 0.1, series, np.sin(x) - x)


def start_at_volume(potential: Potential, volume: float) -> State:
    """The equilibrium at a volume that is reached by inflating first and turning the sources on afterwards.

    Raises
    ------
    SolveError
        When the path ends before the full strength of the sources, or a dome cannot be inflated to the volume.
    """
    magnetic = potential.surrounded
    if volume == 0 and rests_flat(potential):
        return flat_state(potential)
    failure = None
    if magnetic and abs(volume) < START_VOLUME:
        try:
            return _from_either_side(volume, lambda first, state: march(potential, state, VolumeControl, first, volume)[-1], potential)
        except SolveError as error:
            if volume == 0:  # nowhere to turn the sources on but at the flat state itself
                raise
            failure = error
    state = _inflated(potential, volume)
    if not magnetic:
        return state
    try:
        return march(potential, state, lambda t: VolumeControl(volume), 0.0, 1.0, parameter="magnetic")[-1]
    except SolveError as error:
        if failure is not None and failure.status.ill_posed:  # the better reason
            raise failure from None
        touching = potential.distance_to_sources((error.result or [state])[-1].x) < NEAR
        raise SolveError(
            f"the sources could not be turned on to their full strength at V = {volume:.6g}; "
            f"try another volume or a lower strength ({error})",
            status=Status.DIPOLE_CONTACT if touching else Status.NO_EQUILIBRIUM,
        ) from error


def _inflated(potential: Potential, volume: float) -> State:
    """Equilibrium without sources."""
    with np.errstate(over="ignore", invalid="ignore"):  # a dome may be too large or small for its energy to be a number: not converged
        dome = spherical_dome(potential, volume)
        result = correct(potential, VolumeControl(volume), dome, 0.0, magnetic=0.0, damped=True, max_iterations=40)
    if result.status is Status.CONVERGED:
        return State.of(result)
    bad = ill_posed(potential, result.evaluation)
    if bad is not None and bad.slack:
        raise SolveError(f"no tension holds a dome of volume {volume:.6g}: {bad}", status=Status.SLACK)
    if abs(volume) <= SMALL_VOLUME:
        raise SolveError(f"no dome of volume {volume:.6g} could be inflated; {result.status.advice}", status=result.status)
    # a dome may be far from the equilibrium, or, where a material locks, outside the domain of its energy
    first = np.copysign(SAFE_VOLUME if abs(volume) > SAFE_VOLUME else abs(volume) / 4, volume)
    return march(potential, _inflated(potential, first), VolumeControl, first, volume, magnetic=0.0)[-1]


def start_at_pressure(potential: Potential, pressure: float) -> State:
    """The first stable equilibrium at a pressure on the branch through the moderately inflated membrane.

    The branch is followed by arc length from a small volume in the direction in which the pressure approaches the wanted one, then in
    the other; the first crossing that is a minimum under pressure control is returned. Where sources or loads act the branch may end
    before it comes to the flat membrane, and another one begins on the other side of it: that one is tried last.

    Raises
    ------
    SolveError
        With status NO_EQUILIBRIUM when neither direction crosses the pressure in a minimum.
    """
    if pressure == 0 and rests_flat(potential):
        return flat_state(potential)
    # a nearly flat membrane obeys P = 3.34 V^3 without sources, and its mirror image carries the opposite pressure; weak sources add to it
    load = pressure + _pull(potential)
    size = (abs(load) / 4) ** (1 / 3)
    if potential.surrounded and size > NEARLY_FLAT:
        size, load = START_VOLUME, pressure
    volume = float(np.copysign(min(size, START_VOLUME), load))
    found = _through(potential, start_at_volume(potential, volume), pressure)
    if found is None and potential.surrounded:
        with suppress(SolveError):  # the failure on this side of the flat membrane is the one to report
            found = _through(potential, start_at_volume(potential, -volume), pressure)
    if found is not None:
        return found
    raise SolveError(
        f"no stable equilibrium at P = {pressure:.9g} was met on the branch through V = {volume:.6g}", status=Status.NO_EQUILIBRIUM
    )


def _through(potential: Potential, state: State, pressure: float) -> State | None:
    """The first minimum at a pressure on the branch through a state, None if there is none."""
    up = 1 if (state.pressure < pressure) == (first_point(potential, state, 1).rate("pressure", potential) > 0) else -1
    for direction in (up, -up):
        found = _first_minimum(potential, first_point(potential, state, direction), pressure)
        if found is not None:
            return found
    return None


def start_at_height(potential: Potential, height: float) -> State:
    """The equilibrium with a height of the pole, followed from the moderately inflated membrane."""
    if height == 0 and rests_flat(potential):
        return flat_state(potential)

    def follow(_: float, state: State) -> State:
        here = potential.space.center_height(state.x)
        return march(potential, state, CenterHeightControl, here, height)[-1] if height != here else state

    return _from_either_side(height, follow, potential)


def _from_either_side(load: float, follow: Callable[[float, State], State], potential: Potential) -> State:
    """The state that is reached from the membrane moderately inflated to the side of a load, or else to the other side.

    The side of the load comes first, so that a mirrored scene takes the mirrored path.
    """
    side = float(np.copysign(START_VOLUME, load))
    try:
        return follow(side, start_at_volume(potential, side))
    except SolveError as failure:
        try:
            return follow(-side, start_at_volume(potential, -side))
        except SolveError:
            raise failure from None


def _pull(potential: Potential) -> float:
    """Pressure that lifts the flat membrane as its sources and loads do, to first order: on a shallow dome it does the same work."""
    if not potential.surrounded:
        return 0.0
    flat, across = np.zeros(potential.space.n_free), potential.space.fields[1]
    evaluation, dome = potential.evaluate(flat, 0.0), spherical_dome(potential, 1e-6)
    return float(-(evaluation.gradient[across] @ dome[across]) / (evaluation.volume_gradient[across] @ dome[across]))


def _first_minimum(potential: Potential, point: BranchPoint, pressure: float, steps: int = 300) -> State | None:
    # long inflated or singular tails carry no further crossing of interest: bounded by the number of steps
    kd = potential.space.half_bandwidth
    if point.state.pressure == pressure and negative_directions(point.state.evaluation.band, kd) == 0:
        return point.state
    tracer = Tracer(Path(), StepControl().first * min(1.0, np.sqrt(abs(point.state.volume))))
    try:
        for _, new in zip(range(steps), trace_points(potential, point, tracer), strict=False):
            segment = Segment(potential, point, new)
            for met in segment.crossings("pressure", pressure):
                # at the limit point itself round-off has the sign of the smallest eigenvalue: there the side that is stable says it
                at_limit = any(met is fold.point for fold in segment.folds("limit_point"))
                judged = (point, new) if at_limit else (met,)
                if any(negative_directions(p.state.evaluation.band, kd) == 0 for p in judged):
                    return met.state
            if is_slack(potential, new.state):
                return None
            point = new
    except SolveError:
        return None
    return None
