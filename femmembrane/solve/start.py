"""Cold starts: an equilibrium at a volume without a neighbour to start from.

The order of loading is fixed, so that the answer is one state and not an accident of the optimiser: the membrane is inflated without
its sources first, then their energy is turned on at constant volume.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import SolveError, Status
from ..potential import Array, Potential
from .banded import negative_directions
from .continuation import BranchPoint, StepControl, Tracer, first_point, trace_points
from .controls import CenterHeightControl, PressureControl, VolumeControl
from .newton import correct
from .state import Path, State
from .stepping import march
from .wellposed import ill_posed, is_slack

#: below this volume a membrane with sources is reached from here: turning sources on at the flat state starts from a singular Hessian
START_VOLUME = 0.5
#: distance to a source, over R0, below which a start that fails has run into it
NEAR = 0.2
#: from this volume a membrane is inflated further if a dome of the wanted volume is too far from its equilibrium
SAFE_VOLUME = 10.0


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
    magnetic = bool(potential.sources)
    if magnetic and abs(volume) < START_VOLUME:
        try:
            return _from_either_side(volume, lambda first, state: march(potential, state, VolumeControl, first, volume)[-1], potential)
        except SolveError:
            if volume == 0:  # nowhere to turn the sources on but at the flat state itself
                raise
    state = _inflated(potential, volume)
    if not magnetic:
        return state
    try:
        return march(potential, state, lambda t: VolumeControl(volume), 0.0, 1.0, parameter="magnetic")[-1]
    except SolveError as error:
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
    if abs(volume) <= SAFE_VOLUME:
        raise SolveError(f"no dome of volume {volume:.6g} could be inflated; {result.status.advice}", status=result.status)
    first = np.copysign(SAFE_VOLUME, volume)
    return march(potential, _inflated(potential, first), VolumeControl, first, volume, magnetic=0.0)[-1]


def start_at_pressure(potential: Potential, pressure: float) -> State:
    """The first stable equilibrium at a pressure on the branch through the moderately inflated membrane.

    The branch is followed by arc length from a small volume in the direction in which the pressure approaches the wanted one, then in
    the other; the first crossing that is a minimum under pressure control is returned.

    Raises
    ------
    SolveError
        With status NO_EQUILIBRIUM when neither direction crosses the pressure in a minimum.
    """
    flat = not potential.sources
    if pressure == 0 and flat:
        return flat_state(potential)
    # without sources a nearly flat membrane obeys P = 3.34 V^3, and its mirror image carries the opposite pressure
    size = min(START_VOLUME, (abs(pressure) / 4) ** (1 / 3)) if flat else START_VOLUME
    volume = float(np.copysign(size, pressure))
    state = start_at_volume(potential, volume)
    up = 1 if (state.pressure < pressure) == (first_point(potential, state, 1).rate("pressure", potential) > 0) else -1
    for direction in (up, -up):
        found = _first_minimum(potential, first_point(potential, state, direction), pressure)
        if found is not None:
            return found
    raise SolveError(
        f"no stable equilibrium at P = {pressure:.9g} was met on the branch through V = {volume:.6g}", status=Status.NO_EQUILIBRIUM
    )


def flat_state(potential: Potential) -> State:
    """The flat, unloaded membrane: an equilibrium without sources, and one without stiffness, which no path leaves or passes."""
    return State.of(correct(potential, PressureControl(0.0), np.zeros(potential.space.n_free), 0.0))


def start_at_height(potential: Potential, height: float) -> State:
    """The equilibrium with a height of the pole, followed from the moderately inflated membrane."""
    if height == 0 and not potential.sources:
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


def _first_minimum(potential: Potential, point: BranchPoint, pressure: float, steps: int = 300) -> State | None:
    # long inflated or singular tails carry no further crossing of interest: bounded by the number of steps
    kd = potential.space.half_bandwidth
    tracer = Tracer(Path(), StepControl().first * min(1.0, np.sqrt(abs(point.state.volume))))
    try:
        for _, new in zip(range(steps), trace_points(potential, point, tracer), strict=False):
            low, high = sorted((point.state.pressure, new.state.pressure))
            if low <= pressure <= high:
                share = (pressure - point.state.pressure) / (new.state.pressure - point.state.pressure)
                guess = point.state.x + share * (new.state.x - point.state.x)
                result = correct(potential, PressureControl(pressure), guess, pressure)
                if result.status is Status.CONVERGED and negative_directions(result.evaluation.band, kd) == 0:
                    return State.of(result)
            if is_slack(potential, new.state):
                return None
            point = new
    except SolveError:
        return None
    return None
