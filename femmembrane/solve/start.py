"""Cold starts: an equilibrium at a volume without a neighbour to start from.

The order of loading is fixed, so that the answer is one state and not an accident of the optimiser: the membrane is inflated without
its sources and loads first, then their energy is turned on at constant volume. A membrane has no bending stiffness, so that at rest nothing
holds its shape: it is inflated at once, from a guess that encloses the volume, a dome over a disc, the reference shape shifted along its
normal else.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np

from ..discretization.meridian import Disc
from ..discretization.space import Space
from ..errors import SolveError, Status
from ..potential import Array, Potential, potential_of
from .banded import negative_directions
from .continuation import BranchPoint, StepControl, Tracer, first_point, trace_points
from .controls import CenterHeightControl, VolumeControl
from .finer import transferred
from .minimize import minimize
from .newton import correct
from .special_points import Segment
from .state import Path, State, at_rest, flat_state
from .stepping import march
from .wellposed import apparent, is_slack

#: a moderately inflated membrane holds this much more than at rest, or that part of it. Below, one with sources is reached from there:
#: turning sources on at the flat state starts from a singular Hessian
START_VOLUME, START_SHARE = 0.5, 0.12
#: volume below which an equilibrium is looked for from the nearly flat side
NEARLY_FLAT = 0.05
#: distance to a source, over R0, below which a start that fails has run into it
NEAR = 0.2
#: from this many times that volume a membrane is inflated further if a dome of the wanted volume is too far from its equilibrium
SAFE = 20.0
#: up to this part of it every membrane is one to which linear elasticity applies: a guess that fails there is not tried smaller
SMALL = 0.1
#: the guess falls off to a support within this arc length
_EDGE = 1.5


def moderate(potential: Potential) -> float:
    """By how much the volume of a moderately inflated membrane differs from that at rest."""
    return max(START_VOLUME, START_SHARE * abs(potential.space.reference_volume))


def guess_at_volume(potential: Potential, volume: float) -> Array:
    """Coefficients of a smooth shape that respects the supports and encloses a volume."""
    if isinstance(potential.space.mesh, Disc):
        return spherical_dome(potential, volume)
    direction = _normal(potential.space)
    amplitudes = np.array([-1.0, 0.0, 1.0, 2.0])
    # the volume is a cubic in the amplitude: so through four values exactly
    volumes = np.array([potential.evaluate(a * direction, 0.0).volume for a in amplitudes])
    cubic = np.linalg.solve(np.vander(amplitudes), volumes)
    cubic[np.abs(cubic) < 1e-14 * np.abs(cubic).max()] = 0.0
    cubic[-1] = potential.space.reference_volume - volume
    roots = np.roots(cubic)
    real = roots[np.abs(roots.imag) < 1e-9 * (1 + np.abs(roots))].real
    return float(real[np.argmin(np.abs(real))]) * direction if real.size else direction


def _normal(space: Space) -> Array:
    """Coefficients of the unit normal of the reference meridian, falling off to ends that hold a component of it."""
    s = space.interpolation_points()
    R_s, Z_s = space.mesh.tangent(s)
    J = np.hypot(R_s, Z_s)
    n_u, n_w = -Z_s / J, R_s / J
    length = np.concatenate([[0.0], np.cumsum(space.lengths)])
    along = length[:-1] + (s - space.ends[:-1]) / space.sizes * space.lengths
    held = [
        ("u" in support.held and abs(n_u[place]) > 1e-9) or ("w" in support.held and abs(n_w[place]) > 1e-9)
        for support, place in zip(space.supports, ((0, 0), (-1, -1)), strict=False)
    ]
    edge = min(_EDGE, length[-1] / max(sum(held), 1))
    factor = np.ones_like(s)
    for is_held, distance_ in zip(held, (along, length[-1] - along), strict=False):
        if is_held:
            factor = factor * (1 - (1 - np.minimum(1.0, distance_ / edge)) ** 2)
    return space.interpolate(factor * n_u, factor * n_w)


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
    surrounded, rest = potential.surrounded, potential.space.reference_volume
    if at_rest(potential, "volume", volume):
        return flat_state(potential)
    if surrounded and potential.space.loose:
        return _from_unanchored(potential, volume)
    failure = None
    # less a margin: rest + moderate - rest, what is inflated to from here, may be rounded down
    if surrounded and abs(volume - rest) < moderate(potential) * (1 - 1e-12):
        try:
            return _from_either_side(volume, lambda first, state: march(potential, state, VolumeControl, first, volume)[-1], potential)
        except SolveError as error:
            if volume == rest:  # nowhere to turn the sources on but at the flat state itself
                raise
            failure = error
    state = _inflated(potential, volume)
    if not surrounded:
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


def _from_unanchored(potential: Potential, volume: float) -> State:
    """As :func:`start_at_volume` where nothing but the sources holds the membrane in its place: these are turned on at once."""
    bare = potential_of(potential.scene.replace(sources=(), loads=(), scales=None))
    state = _inflated(bare, volume)
    guess = transferred(bare.space, state.x, potential.space)
    result = correct(potential, VolumeControl(volume), guess, state.pressure, damped=True, max_iterations=40)
    if result.status is not Status.CONVERGED:
        raise SolveError(
            f"no place was found in which the sources hold the membrane at V = {volume:.6g}; nothing else holds it along the axis",
            status=Status.NO_EQUILIBRIUM,
        )
    return State.of(result)


def _inflated(potential: Potential, volume: float) -> State:
    """Equilibrium without sources."""
    with np.errstate(over="ignore", invalid="ignore"):  # a guess may be too large or small for its energy to be a number: not converged
        guess = guess_at_volume(potential, volume)
        result = correct(potential, VolumeControl(volume), guess, 0.0, magnetic=0.0, damped=True, max_iterations=40)
    if result.status is not Status.CONVERGED and not isinstance(potential.space.mesh, Disc):  # a minimiser goes downhill from farther away
        found, p, _, _ = minimize(potential, VolumeControl(volume), guess, 0.0, magnetic=0.0)
        if np.isfinite(found).all() and np.isfinite(p):
            result = correct(potential, VolumeControl(volume), found, p, magnetic=0.0)
    if result.status is Status.CONVERGED:
        return State.of(result)
    bad = apparent(potential, result.evaluation)
    if bad is not None and bad.slack:
        raise SolveError(f"no tension holds a dome of volume {volume:.6g}: {bad}", status=Status.SLACK)
    rest, size = potential.space.reference_volume, moderate(potential)
    excess = abs(volume - rest)
    if excess <= SMALL * size:
        raise SolveError(f"no dome of volume {volume:.6g} could be inflated; {result.status.advice}", status=result.status)
    # a guess may be far from the equilibrium, or, where a material locks, outside the domain of its energy
    first = rest + np.copysign(SAFE * size if excess > SAFE * size else excess / 4, volume - rest)
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
    if at_rest(potential, "pressure", pressure):
        flat = flat_state(potential)
        if not potential.surrounded or negative_directions(flat.evaluation.band, potential.space.half_bandwidth) == 0:
            return flat
    size, rest, load = moderate(potential), potential.space.reference_volume, pressure
    if potential.flat:
        # a nearly flat membrane obeys P = 3.34 V^3 without sources, and its mirror image carries the opposite pressure; weak ones add to it
        lifted = pressure + _pull(potential)
        nearly = (abs(lifted) / 4) ** (1 / 3)
        if not potential.surrounded or 0 < nearly <= NEARLY_FLAT:
            size, load = min(size, nearly), lifted
    volume, other = (rest + float(np.copysign(size, side * load)) for side in (1, -1))
    found = _through(potential, start_at_volume(potential, volume), pressure)
    if found is None and potential.surrounded:
        with suppress(SolveError):  # the failure on this side of the flat membrane is the one to report
            found = _through(potential, start_at_volume(potential, other), pressure)
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
    if at_rest(potential, "height", height):
        return flat_state(potential)

    def follow(_: float, state: State) -> State:
        here = potential.space.center_height(state.x)
        return march(potential, state, CenterHeightControl, here, height)[-1] if height != here else state

    return _from_either_side(height, follow, potential)


def _from_either_side(load: float, follow: Callable[[float, State], State], potential: Potential) -> State:
    """The state that is reached from the membrane moderately inflated to the side of a load, or else to the other side.

    The side of the load comes first, so that a mirrored scene takes the mirrored path.
    """
    rest, side = potential.space.reference_volume, float(np.copysign(moderate(potential), load))
    try:
        return follow(rest + side, start_at_volume(potential, rest + side))
    except SolveError as failure:
        try:
            return follow(rest - side, start_at_volume(potential, rest - side))
        except SolveError:
            raise failure from None


def _pull(potential: Potential) -> float:
    """Pressure that lifts the flat membrane as its sources and loads do, to first order: on a shallow dome it does the same work."""
    if not potential.surrounded:
        return 0.0
    flat, across = np.zeros(potential.space.n_free), potential.space.fields[1]
    evaluation, dome = potential.evaluate(flat, 0.0), guess_at_volume(potential, 1e-6)
    return float(-(evaluation.gradient[across] @ dome[across]) / (evaluation.volume_gradient[across] @ dome[across]))


def _first_minimum(potential: Potential, point: BranchPoint, pressure: float, steps: int = 300) -> State | None:
    # long inflated or singular tails carry no further crossing of interest: bounded by the number of steps
    kd = potential.space.half_bandwidth
    if point.state.pressure == pressure and negative_directions(point.state.evaluation.band, kd) == 0:
        return point.state
    tracer = Tracer(Path(), StepControl().first * min(1.0, np.sqrt(abs(point.state.volume - potential.space.reference_volume))))
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
