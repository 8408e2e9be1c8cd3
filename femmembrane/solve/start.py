"""Cold starts: an equilibrium at a load without a neighbour to start from.

One way for every shape, support, material, source, load and control. Its parts are three, each with bounded work:

1. *A bare membrane at a volume*, without sources and loads, which at rest nothing holds: a guess that encloses the volume, solved by
   Newton's method, by going downhill, or held in its place by dead forces that fade out (:mod:`.homotopy`), whichever arrives first.
2. *Sources and loads turned on* there, at constant volume, along the path even where it turns back.
3. *The branch through that state* to the load that is asked for, by arc length in both directions.

The order of loading is fixed, so that the answer is one state and not an accident of the optimiser. Where a part does not arrive, or at a
state that is compressed or that only its mesh has, the next starting volume is tried, from near the load outwards, then the mirror side,
then the guess with all sources and loads at once. An error says what was tried; that there is no equilibrium it never claims.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import lru_cache
from typing import TYPE_CHECKING, cast

import numpy as np

from ..discretization.space import transferred
from ..errors import SolveError, Status
from ..potential import Potential, potential_of
from .banded import negative_among
from .branch import BranchProblem, first_point
from .contact import touches_source
from .continuation import BranchPoint, StepControl, Tracer, trace_points
from .controls import CONTROLS, Control, ControlKind, Controlled, Gas, PressureControl, VolumeControl
from .guess import guess_at_volume
from .homotopy import Fields, Held, follow_homotopy
from .minimize import minimize
from .newton import NEGLIGIBLE, correct
from .segment import Segment
from .state import Predictor, State, at_rest, displacement, distance, flat_state
from .state_resolution import unresolved
from .stepping import march
from .wellposed import ill_posed, is_slack, slackness, unresolved_source

#: a moderately inflated membrane holds this much more than at rest, in units of its own size, or that part of it. Below, one with sources
#: is reached from there: turning sources on at the flat state starts from a singular Hessian
START_VOLUME, START_SHARE = 0.5, 0.12
#: volume, in units of the membrane's own size, below which an equilibrium is looked for from the nearly flat side
NEARLY_FLAT = 0.05
#: distance to a source, over the size of the membrane, below which a start that fails has run into it
NEAR = 0.2
#: from this many times that volume a membrane is inflated further if a guess at the wanted volume is too far from its equilibrium
SAFE = 20.0
#: size of displacement and pressure, in units of the membrane, at which a branch is left: nothing there comes back
HUGE = 1e12
#: different states that the mesh does not resolve, after which no further way is tried; and how near they are if they are the same
_COARSE, _SAME = 2, 1e-6
#: times that a volume is divided by four until the membrane touches no body
_QUARTERS = 60
#: most steps along a branch in each direction, and corrections of a guess
_STEPS, _CORRECTIONS = 300, 40


if TYPE_CHECKING:
    from ..potential.contact import ContactPotential


def moderate(potential: Potential) -> float:
    """By how much the volume of a moderately inflated membrane differs from that at rest; less where it would come to a body."""
    space = potential.space
    size = max(START_VOLUME * space.units["volume"], START_SHARE * abs(space.reference_volume))
    return free_volume(cast("ContactPotential", potential), size) if potential.obstacles else size


@lru_cache(maxsize=16)
def free_volume(potential: ContactPotential, size: float) -> float:
    """The largest of a volume, a quarter of it and so on that a membrane without sources holds on either side of rest without touching a
    body; at last the smallest."""
    bare, rest = potential.without_bodies, potential.space.reference_volume
    for _ in range(_QUARTERS):
        with suppress(SolveError):
            if all(potential.touching(_inflated(bare, rest + side * size).x) > 0 for side in (1.0, -1.0)):
                break
        size /= 4
    return size


def unloaded(potential: Potential) -> State | None:
    """The membrane without pressure, sources and loads, drawn out to where its ends are held.

    None where they are held where they rest, where that state was not found, and where it is compressed: it is no place to start from.
    """
    state = _without_load(potential)
    return state if state is not None and state.evaluation.stress[0].min() > 0 and _sound(state) else None


def _without_load(potential: Potential) -> State | None:
    """As :func:`unloaded`, whether it is compressed or not."""
    if not potential.strained or potential.space.loose:
        return None
    control, x = PressureControl(0.0), np.zeros(potential.space.n_free)
    result = correct(potential, control, x, 0.0, magnetic=0.0, damped=True, max_iterations=_CORRECTIONS)
    if result.status is Status.CONVERGED:
        return State.of(result)
    return follow_homotopy(Held(potential, control, x, 0.0, magnetic=0.0), x, 0.0)


def usual_volume(potential: Potential) -> float:
    """The volume from which a branch is followed when no other is asked for.

    It is that under tension without load, where the places of the ends stretch the membrane, else that of the moderately inflated one.
    """
    drawn = unloaded(potential)
    return potential.space.reference_volume + moderate(potential) if drawn is None else drawn.volume


def cold_start(potential: Potential, held: Controlled, load: float, *, stable: bool = True) -> State:
    """The equilibrium at a load of any control in :data:`.CONTROLS`, or with an amount of gas.

    Parameters
    ----------
    potential : Potential
    held : Controlled
        What is prescribed.
    load : float
    stable : bool
        Whether only a stable state will do where a pressure is prescribed.

    Raises
    ------
    SolveError
        When none of the ways arrives.
    """
    if not potential.surrounded and (state := _without_load(potential)) is not None and state.value_of(held) == load:
        return state  # under tension as any other; one that is compressed is what there is without load
    if isinstance(held, Gas):
        return start_in_gas(potential, held.at(load))
    if held is CONTROLS["pressure"]:
        return start_at_pressure(potential, load, stable=stable)
    return (start_at_volume if held is CONTROLS["volume"] else start_at_height)(potential, load)


def start_at_volume(potential: Potential, volume: float) -> State:
    """The equilibrium at a volume that is reached by inflating first and turning sources and loads on afterwards.

    Raises
    ------
    SolveError
        When none of the ways arrives.
    """
    if at_rest(potential, CONTROLS["volume"], volume):
        return flat_state(potential)
    if not potential.surrounded:
        return _inflated(potential, volume)
    return _first_of(_ways_to_volume(potential, volume), f"V = {volume:.6g}")


Way = Callable[[], State | None]
_GUESS = "a guess"


def _first_of(ways: Iterator[tuple[str, Way]], wanted: str) -> State:
    """The state of the first way that arrives at a sound one; else the first that is none, of which it is then said what is wrong with it;
    else an error with what each way said, that of the best reason first."""
    failures: list[SolveError] = []
    tried: list[str] = []
    spare, lost = None, list[State]()
    for name, way in ways:
        if name.startswith(_GUESS) and any(f.status.ill_posed for f in failures):
            break  # the branch ends there; a guess would land beyond its end, on what the mesh makes of it
        if len(lost) == _COARSE:
            break  # all that is there is finer than this mesh
        tried.append(name)
        try:
            state = way()
        except SolveError as error:
            failures.append(error)
            continue
        if state is not None and _adrift(state):
            failures.append(SolveError("it drifts off to where sources and loads no longer hold it", status=Status.NO_EQUILIBRIUM))
            continue
        if state is None or any(_same(state, other) for other in lost):
            continue
        if _sound(state):
            return state
        spare = spare or state
        lost += [state] * _well_posed(state)
    if spare is not None:
        return spare
    order = [Status.SLACK, Status.LEGENDRE_FAILURE, Status.DIPOLE_CONTACT]
    failures.sort(key=lambda f: order.index(f.status) if f.status in order else len(order))
    said = f" (first: {failures[0]})" if failures else ""
    status = failures[0].status if failures else Status.NO_EQUILIBRIUM
    raise SolveError(f"no equilibrium was found at {wanted}; tried: {_in_few_words(tried)}{said}", status=status)


def _in_few_words(tried: list[str]) -> str:
    """The ways that were tried; of several of a kind the number, and the first."""
    kinds: dict[str, list[str]] = {}
    for name in tried:
        kinds.setdefault(name.split(" = ")[0], []).append(name)
    return ", ".join(f"{names[0]} and {len(names) - 1} more" if len(names) > 1 else names[0] for names in kinds.values())


def _adrift(state: State) -> bool:
    """Whether a membrane that sources and loads alone could hold along the axis is so far from them that what they pull is round-off."""
    potential, evaluation = state.evaluation.potential, state.evaluation
    if not potential.space.loose:
        return False
    bare = potential.evaluate(state.x, state.pressure, 0.0)
    pull = max(potential.largest(evaluation.gradient - bare.gradient))
    return pull <= NEGLIGIBLE * max(potential.force_scale(evaluation, state.pressure))


def _ways_to_volume(potential: Potential, volume: float) -> Iterator[tuple[str, Way]]:
    rest, size = potential.space.reference_volume, moderate(potential)
    # less a margin: rest + moderate - rest, what is inflated to from here, may be rounded down
    near = abs(volume - rest) < size * (1 - 1e-12) and unloaded(potential) is None
    if near and not potential.space.loose:
        for side in _sides(volume):
            first = rest + side * size
            yield f"the branch from V = {first:.6g}", lambda first=first: _along_volume(potential, first, volume)  # type: ignore[misc]
    if volume != rest or not potential.flat:
        yield "sources and loads turned on there", lambda: _with_fields(potential, volume)
    if not near and not potential.space.loose:
        # less than at rest a bare membrane holds compressed, and one that loads stretch need not: it is met from the other side
        for first in (rest + side * size for side in _sides(volume - rest)):
            yield (
                f"the branch from V = {first:.6g}",
                lambda first=first: _along(potential, _with_fields(potential, first), CONTROLS["volume"], volume),  # type: ignore[misc]
            )
    yield f"{_GUESS} there", lambda: _from_guess(potential, VolumeControl(volume), volume)


def _sides(load: float) -> tuple[float, float]:
    """That of the load comes first, so that a mirrored scene takes the mirrored path; of no load the upper one."""
    return (1.0, -1.0) if load >= 0 else (-1.0, 1.0)


def _along_volume(potential: Potential, first: float, volume: float) -> State:
    state = _with_fields(potential, first)
    return march(potential, state, VolumeControl, first, volume)[-1]


def _with_fields(potential: Potential, volume: float) -> State:
    """The bare membrane at a volume, and its sources and loads turned on there."""
    bare = _inflated(potential, volume)
    control = VolumeControl(volume)
    if potential.space.loose:  # nothing else holds it along the axis: they cannot be turned on slowly
        x = bare.x if bare.evaluation.potential is potential else transferred(bare.evaluation.potential.space, bare.x, potential.space)
        result = correct(potential, control, x, bare.pressure, damped=True, max_iterations=_CORRECTIONS)
        state = State.of(result) if result.status is Status.CONVERGED else None
        if state is None:
            state = follow_homotopy(Held(potential, control, x, bare.pressure), x, bare.pressure)
        if state is None:
            raise SolveError(
                f"no place was found in which sources and loads hold the membrane at V = {volume:.6g}; nothing else does along the axis",
                status=Status.NO_EQUILIBRIUM,
            )
        return state
    try:
        return march(potential, bare, lambda t: control, 0.0, 1.0, parameter="magnetic")[-1]
    except SolveError as error:
        state = follow_homotopy(Fields(potential, control), bare.x, bare.pressure)
        if state is not None:
            return state
        last = (error.result or [bare])[-1]
        touching = potential.distance_to_sources(last.x) < NEAR * potential.space.unit
        raise SolveError(
            f"{_acting(potential)} could not be turned on to their full strength at V = {volume:.6g}; "
            "try another volume or a lower strength",
            status=Status.DIPOLE_CONTACT if touching else Status.NO_EQUILIBRIUM,
        ) from error


def _acting(potential: Potential) -> str:
    """What was to be turned on, in words."""
    if potential.electric is None:
        return "the sources"
    word = "voltage" if potential.electric.load == "voltage" else "charge"
    return f"the sources and the {word}" if potential.sources else f"the {word}"


def _inflated(potential: Potential, volume: float) -> State:
    """Equilibrium without sources and loads; of a potential without them where only they would hold the membrane along the axis."""
    if potential.space.loose:
        potential = potential_of(potential.scene.replace(sources=(), loads=(), scales=None))
    rest = potential.space.reference_volume
    if potential.obstacles:
        return _inflated_to_bodies(cast("ContactPotential", potential), volume)
    if volume == rest and not (potential.flat or potential.strained):
        return flat_state(potential, magnetic=0.0)
    if (drawn := unloaded(potential)) is not None and (state := _drawn_to(potential, drawn, volume)) is not None:
        return state
    if not (potential.flat or potential.space.lids) and volume * rest < 0:
        return _mirrored(potential, _inflated(potential, -volume), volume)
    failure = spare = None
    for share in _shares(potential, abs(volume - rest)):
        first = rest + share * (volume - rest)
        state = _from_guess(potential, VolumeControl(first), first, magnetic=0.0)
        if state is not None and not (_sound if first == volume else _well_posed)(state):
            spare, state = (spare or state) if first == volume else spare, None
        if state is None:
            continue
        if first == volume:
            return state
        try:
            return march(potential, state, VolumeControl, first, volume, magnetic=0.0)[-1]
        except SolveError as error:
            failure = failure or error
        bare = potential if not potential.surrounded else potential_of(potential.scene.replace(sources=(), loads=(), scales=None))
        there = state if bare is potential else _moved(bare, state, first)
        found = None
        if there is not None:
            with suppress(SolveError):
                found = _along(bare, there, CONTROLS["volume"], volume)
        if found is not None:
            back = correct(potential, VolumeControl(volume), found.x, found.pressure, magnetic=0.0, damped=True)
            if back.status is Status.CONVERGED:
                return State.of(back)
    if spare is not None:
        return spare
    why = failure or "no guess led to an equilibrium"
    status = failure.status if failure else Status.NOT_CONVERGED
    raise SolveError(f"the membrane could not be inflated to V = {volume:.6g} without sources and loads: {why}", status=status)


def _inflated_to_bodies(potential: ContactPotential, volume: float) -> State:
    """A membrane without sources and loads that came to a volume from where it touched no body."""
    rest, bare = potential.space.reference_volume, potential.without_bodies
    first = volume
    for _ in range(_QUARTERS):
        state = None
        with suppress(SolveError):
            state = _inflated(bare, first)
        if state is not None and potential.touching(state.x) > 0:
            break
        if first == rest:
            raise SolveError("the membrane without load touches a body", status=Status.NO_EQUILIBRIUM)
        first = rest + (first - rest) / 4
    else:
        raise SolveError("no inflated membrane was found that touches no body", status=Status.NO_EQUILIBRIUM)
    control = VolumeControl(first)
    result = correct(potential, control, state.x, state.pressure, magnetic=0.0)
    if result.status is not Status.CONVERGED:
        raise SolveError(f"the membrane that touches no body at V = {first:.6g} was not found again", status=result.status)
    found = State.of(result, state.iterations)
    return found if first == volume else march(potential, found, VolumeControl, first, volume, magnetic=0.0)[-1]


def _drawn_to(potential: Potential, drawn: State, volume: float) -> State | None:
    """A bare membrane under tension led from no load to a volume; None where that leads to no sound state."""
    if volume == drawn.volume:
        return drawn
    try:
        state = march(potential, drawn, VolumeControl, drawn.volume, volume, magnetic=0.0)[-1]
    except SolveError:
        return None
    return state if _sound(state) else None


def _mirrored(potential: Potential, state: State, volume: float) -> State:
    """A bare membrane whose ends are in the plane z = 0 turned inside out: no stretch changes when its shape is mirrored in that plane."""
    space, w = potential.space, potential.space.fields[1]
    _, Z = space.mesh.position(space.interpolation_points())
    height = space.interpolate(np.zeros_like(Z), Z)
    x = state.x.copy()
    x[w] = -x[w] - 2 * height[w]
    result = correct(potential, VolumeControl(volume), x, -state.pressure, magnetic=0.0, damped=True)
    if result.status is not Status.CONVERGED:
        raise SolveError(f"the membrane could not be turned inside out to V = {volume:.6g}", status=result.status)
    return State.of(result)


def _moved(onto: Potential, state: State, volume: float) -> State | None:
    result = correct(onto, VolumeControl(volume), state.x, state.pressure, damped=True)
    return State.of(result) if result.status is Status.CONVERGED else None


def _shares(potential: Potential, excess: float) -> Iterator[float]:
    """Shares of the way from rest at which a guess is tried: the whole, then from that to a safely inflated membrane down, then beyond."""
    yield 1.0
    safe = min(1.0, SAFE * moderate(potential) / excess) if excess else 1.0
    if safe < 1:
        yield safe
    yield from (safe / 4**k for k in range(1, 6))
    yield from (4.0, 16.0)  # where a tension field is taut


def _from_guess(
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
        result = correct(potential, control, guess, pressure, magnetic=magnetic, damped=True, max_iterations=_CORRECTIONS)
        if result.status is not Status.CONVERGED and not magnetic:
            found, p, _, _ = minimize(potential, control, guess, pressure, magnetic=magnetic)
            if np.isfinite(found).all() and np.isfinite(p):
                result = correct(potential, control, found, p, magnetic=magnetic)
        if result.status is Status.CONVERGED and (accept is None or accept(State.of(result))):
            return State.of(result)
        return follow_homotopy(Held(potential, control, guess, pressure, magnetic=magnetic), guess, pressure, accept=accept)


# --- other loads than a volume: the branch through a state at a volume leads there


def start_at_pressure(potential: Potential, pressure: float, *, stable: bool = True) -> State:
    """The first stable equilibrium at a pressure on the branch through the moderately inflated membrane; where none is met and ``stable``
    is False, the first.

    The branch is followed by arc length from a small volume in the direction in which the pressure approaches the wanted one, then in
    the other; the first crossing that is a minimum under pressure control is returned. Where sources or loads act the branch may end
    before it comes to the flat membrane, and another one begins on the other side of it: that one is tried last, and then guesses.

    Raises
    ------
    SolveError
        When none of the ways arrives.
    """
    if at_rest(potential, CONTROLS["pressure"], pressure):
        flat = flat_state(potential)
        if not potential.surrounded or _is_minimum(flat):
            return flat
    size, load = moderate(potential), pressure
    units = potential.space.units
    if potential.flat:
        # a nearly flat membrane obeys P = 3.34 V^3 without sources, and its mirror image carries the opposite pressure; weak ones add to it
        load = pressure + _pull(potential)
        nearly = (abs(load) / units["pressure"] / 4) ** (1 / 3)
        if not potential.surrounded or 0 < nearly <= NEARLY_FLAT:
            size = min(size, nearly * units["volume"])
    held, sides = CONTROLS["pressure"], _sides(load)
    spare = None
    try:
        spare = _first_of(_ways_from(potential, held, pressure, size, sides, _is_minimum), f"P = {pressure:.9g} that is stable")
        if stable or _sound(spare):
            return spare
    except SolveError:
        if stable:
            raise
    try:
        found = _first_of(_ways_from(potential, held, pressure, size, sides), f"P = {pressure:.9g}")
    except SolveError:
        if spare is None:
            raise
        return spare
    return spare if spare is not None and not _sound(found) else found


def start_at_height(potential: Potential, height: float) -> State:
    """The equilibrium with a height of the pole, followed from the moderately inflated membrane."""
    if at_rest(potential, CONTROLS["center_height"], height):
        return flat_state(potential)
    if potential.space.on_axis[0] and any(float(body.gap(0.0, height)[0]) < 0 for body in potential.obstacles):
        raise SolveError(f"a pole at the height {height:.6g} would be inside a body", status=Status.NO_EQUILIBRIUM)
    sides = _sides(height - potential.space.first_height * (not potential.flat))
    size = moderate(potential)
    if potential.flat and not potential.surrounded:  # a branch leads past the flat membrane, which has no stiffness, nowhere near it
        size = min(size, 2 * abs(height) * potential.space.unit**2)
    ways = _ways_from(potential, CONTROLS["center_height"], height, size, sides)
    return _first_of(ways, f"a pole height of {height:.6g}")


def start_in_gas(potential: Potential, gas: Gas) -> State:
    """The equilibrium with an amount of gas behind the membrane, on the branch through the moderately inflated one."""
    if at_rest(potential, gas, gas.amount):
        return flat_state(potential)
    sides = _sides(gas.pressure(potential.space.reference_volume))
    ways = _ways_from(potential, gas, gas.amount, moderate(potential), sides)
    return _first_of(ways, f"an amount of gas of {gas.amount:.6g}")


def _ways_from(
    potential: Potential,
    held: ControlKind | Gas,
    load: float,
    size: float,
    sides: tuple[float, float],
    accept: Callable[[State], bool] | None = None,
) -> Iterator[tuple[str, Way]]:
    """Ways to a load that is no volume."""
    rest = potential.space.reference_volume
    if potential.strained:
        nearest = usual_volume(potential)
        yield f"the branch through V = {nearest:.6g}", lambda: _along(potential, start_at_volume(potential, nearest), held, load, accept)
    for share in (1.0, 10.0, 100.0):  # further out where the first branch ends, or takes too many steps
        for side in sides:
            first = rest + side * share * size
            yield (
                f"the branch through V = {first:.6g}",
                lambda first=first: _along(potential, start_at_volume(potential, first), held, load, accept),  # type: ignore[misc]
            )
    pressure = load if held is CONTROLS["pressure"] else 0.0
    for side in sides:
        for share in (1.0, 4.0, 16.0):
            guess = rest + side * share * size
            yield (
                f"{_GUESS} with V = {guess:.6g}",
                lambda guess=guess: _from_guess(potential, held.at(load), guess, pressure=pressure, accept=accept),  # type: ignore[misc]
            )


def _along(
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
            if _well_posed(state):
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


def _well_posed(state: State) -> bool:
    return ill_posed(state.evaluation.potential, state.evaluation) is None


def _same(a: State, b: State) -> bool:
    potential = a.evaluation.potential
    return a.x.shape == b.x.shape and distance(potential, a.x, b.x) <= _SAME * displacement(potential, a.x)


def _sound(state: State) -> bool:
    """Whether a state is that of a membrane: well-posed, and not one of its mesh only."""
    return _well_posed(state) and not unresolved(state.evaluation.potential.root, state)


def _is_minimum(state: State) -> bool:
    """Whether a state is a minimum under pressure control."""
    return negative_among(state.evaluation) == 0


def _pull(potential: Potential) -> float:
    """Pressure that lifts the flat membrane as its sources and loads do, to first order: on a shallow dome it does the same work."""
    if not potential.surrounded:
        return 0.0
    flat, across = np.zeros(potential.space.n_free), potential.space.fields[1]
    shallow = 1e-6 * potential.space.units["volume"]
    evaluation, dome = potential.evaluate(flat, 0.0), guess_at_volume(potential, shallow)
    return float(-(evaluation.gradient[across] @ dome[across]) / (evaluation.volume_gradient[across] @ dome[across]))
