"""Bare membranes at a volume, without sources and loads, which at rest nothing holds: the first part of a cold start."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from typing import TYPE_CHECKING, cast

import numpy as np

from ..errors import SolveError, Status
from ..potential import Potential, potential_of
from .controls import CONTROLS, Control, PressureControl, VolumeControl
from .homotopy import Held, follow_homotopy
from .newton import correct
from .state import State, flat_state
from .stepping import march
from .ways import CORRECTIONS, along, caught, from_guess, sound, well_posed
from .wellposed import is_slack

if TYPE_CHECKING:
    from ..potential.contact import ContactPotential

#: a moderately inflated membrane holds this much more than at rest, in units of its own size, or that part of it. Below, one with sources
#: is reached from there: turning sources on at the flat state starts from a singular Hessian
START_VOLUME, START_SHARE = 0.5, 0.12
#: from this many times that volume a membrane is inflated further if a guess at the wanted volume is too far from its equilibrium
SAFE = 20.0
#: times that a volume is divided by four until the membrane touches no body
_QUARTERS = 60


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
            if all(potential.touching(inflated(bare, rest + side * size).x) > 0 for side in (1.0, -1.0)):
                break
        size /= 4
    return size


def unloaded(potential: Potential) -> State | None:
    """The membrane without pressure, sources and loads, drawn out to where its ends are held.

    None where they are held where they rest, where that state was not found, and where it is compressed: it is no place to start from.
    """
    state = without_load(potential)
    return state if state is not None and state.evaluation.stress[0].min() > 0 and sound(state) else None


def without_load(potential: Potential) -> State | None:
    """As :func:`unloaded`, whether it is compressed or not."""
    if not potential.strained or potential.space.loose:
        return None
    control, x = PressureControl(0.0), np.zeros(potential.space.n_free)
    result = correct(potential, control, x, 0.0, magnetic=0.0, damped=True, max_iterations=CORRECTIONS)
    if result.status is Status.CONVERGED:
        return State.of(result)
    return follow_homotopy(Held(potential, control, x, 0.0, magnetic=0.0), x, 0.0)


def usual_volume(potential: Potential) -> float:
    """The volume from which a branch is followed when no other is asked for.

    It is that under tension without load, where the places of the ends stretch the membrane, else that of the moderately inflated one.
    """
    drawn = unloaded(potential)
    return potential.space.reference_volume + moderate(potential) if drawn is None else drawn.volume


def inflated(potential: Potential, volume: float) -> State:
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
        return _mirrored(potential, inflated(potential, -volume), volume)
    failure = spare = None
    for share in _shares(potential, abs(volume - rest)):
        first = rest + share * (volume - rest)
        state = from_guess(potential, VolumeControl(first), first, magnetic=0.0)
        if state is not None and not (sound if first == volume else well_posed)(state):
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
                found = along(bare, there, CONTROLS["volume"], volume)
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
            state = inflated(bare, first)
        if state is not None and potential.scene.tension_field:
            state = _off_bodies(potential, state)
            first = first if state is None else state.volume
        if state is not None and potential.touching(state.x) > 0:
            break
        if first == rest:
            if state is None:
                raise SolveError("the membrane without load was not found", status=Status.NOT_CONVERGED)
            raise SolveError("the membrane without load touches a body", status=Status.NO_EQUILIBRIUM)
        first = rest + (first - rest) / 4
    else:
        raise SolveError("no inflated membrane was found that touches no body", status=Status.NO_EQUILIBRIUM)
    control = VolumeControl(first)
    result = correct(potential, control, state.x, state.pressure, magnetic=0.0)
    if result.status is not Status.CONVERGED:
        raise SolveError(f"the membrane that touches no body at V = {first:.6g} was not found again", status=result.status)
    found = State.of(result, state.iterations)
    if first == volume:
        return found
    try:
        return march(potential, found, VolumeControl, first, volume, magnetic=0.0)[-1]
    except SolveError as error:
        landed = caught(potential, VolumeControl(volume), ((error.result or [found])[-1],), magnetic=0.0)
        if landed is None:
            raise
        return landed


def stopped(potential: Potential, control: Control, left: State) -> State | None:
    """Where bodies stop a membrane that snaps from a state: downhill from there, or from a bare membrane on either side of rest."""

    def states() -> Iterator[State]:
        yield left
        for side in (1.0, -1.0):
            with suppress(SolveError):
                yield inflated(potential, potential.space.reference_volume + side * moderate(potential))

    found = caught(potential, control, states())
    return found if found is not None and sound(found) else None


def _off_bodies(potential: ContactPotential, state: State) -> State | None:
    """The largest volume, by tenths, to which a tension field can be let down from a state so that it touches no body; None where it is
    slack before. From rest it could not be found: at small volumes a tension field is slack.
    """
    rest, bare = potential.space.reference_volume, potential.without_bodies
    tenth = (state.volume - rest) / 10
    for _ in range(9):
        if is_slack(bare, state):
            return None
        if potential.touching(state.x) > 0:
            break
        try:
            state = march(bare, state, VolumeControl, state.volume, state.volume - tenth, magnetic=0.0)[-1]
        except SolveError:
            return None
    return state


def _drawn_to(potential: Potential, drawn: State, volume: float) -> State | None:
    """A bare membrane under tension led from no load to a volume; None where that leads to no sound state."""
    if volume == drawn.volume:
        return drawn
    try:
        state = march(potential, drawn, VolumeControl, drawn.volume, volume, magnetic=0.0)[-1]
    except SolveError:
        return None
    return state if sound(state) else None


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
