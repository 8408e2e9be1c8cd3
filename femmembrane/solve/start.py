"""Cold starts: an equilibrium at a load without a neighbour to start from.

One way for every shape, support, material, source, load and control. Its parts are three, each with bounded work:

1. *A bare membrane at a volume*, without sources and loads, which at rest nothing holds (:mod:`.bare`): a guess that encloses the volume,
   solved by Newton's method, by going downhill, or held in its place by dead forces that fade out, whichever arrives first (:mod:`.ways`).
2. *Sources and loads turned on* there, at constant volume, along the path even where it turns back. Where they pull the membrane onto a
   body, it lands there: downhill to the minimum in contact.
3. *The branch through that state* to the load that is asked for, by arc length in both directions.

The order of loading is fixed, so that the answer is one state and not an accident of the optimiser. Where a part does not arrive, or at a
state that is compressed or that only its mesh has, the next starting volume is tried, from near the load outwards, then the mirror side,
then the guess with all sources and loads at once. An error says what was tried; that there is no equilibrium it never claims.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..discretization.space import transferred
from ..errors import SolveError, Status
from ..potential import Potential
from .banded import negative_among
from .bare import inflated, moderate, unloaded, usual_volume, without_load
from .contact import coarse_at_edge
from .controls import CONTROLS, ControlKind, Controlled, Gas, PressureControl, VolumeControl
from .guess import guess_at_volume
from .homotopy import Fields, Held, follow_homotopy
from .newton import NEGLIGIBLE, correct
from .state import State, at_rest, displacement, distance, flat_state
from .stepping import march
from .ways import CORRECTIONS, along, caught, from_guess, sound, well_posed

#: volume, in units of the membrane's own size, below which an equilibrium is looked for from the nearly flat side
NEARLY_FLAT = 0.05
#: distance to a source, over the size of the membrane, below which a start that fails has run into it
NEAR = 0.2
#: different states that the mesh does not resolve, after which no further way is tried; and how near they are if they are the same
_COARSE, _SAME = 2, 1e-6


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
    if not potential.surrounded and (state := without_load(potential)) is not None and state.value_of(held) == load:
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
        return inflated(potential, volume)
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
        if sound(state):
            return state
        spare = spare or state
        # where bodies stop the membrane every way ends there
        lost += [state] * (well_posed(state) or bool(state.evaluation.potential.obstacles))
    if spare is not None:
        return spare
    order = [Status.NOT_RESOLVED, Status.SLACK, Status.LEGENDRE_FAILURE, Status.DIPOLE_CONTACT]
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
                lambda first=first: along(potential, _with_fields(potential, first), CONTROLS["volume"], volume),  # type: ignore[misc]
            )
    yield f"{_GUESS} there", lambda: from_guess(potential, VolumeControl(volume), volume)


def _sides(load: float) -> tuple[float, float]:
    """That of the load comes first, so that a mirrored scene takes the mirrored path; of no load the upper one."""
    return (1.0, -1.0) if load >= 0 else (-1.0, 1.0)


def _along_volume(potential: Potential, first: float, volume: float) -> State:
    state = _with_fields(potential, first)
    return march(potential, state, VolumeControl, first, volume)[-1]


def _with_fields(potential: Potential, volume: float) -> State:
    """The bare membrane at a volume, and its sources and loads turned on there."""
    bare = inflated(potential, volume)
    control = VolumeControl(volume)
    if potential.space.loose:  # nothing else holds it along the axis: they cannot be turned on slowly
        x = bare.x if bare.evaluation.potential is potential else transferred(bare.evaluation.potential.space, bare.x, potential.space)
        result = correct(potential, control, x, bare.pressure, damped=True, max_iterations=CORRECTIONS)
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
        last = (error.result or [bare])[-1]
        state = caught(potential, control, (last, bare)) if potential.obstacles else None
        if state is None:
            state = follow_homotopy(Fields(potential, control), bare.x, bare.pressure)
        if state is not None:
            return state
        touching = potential.distance_to_sources(last.x) < NEAR * potential.space.unit
        coarse = coarse_at_edge(last.evaluation, edges="all")
        raise SolveError(
            f"{_acting(potential)} could not be turned on to their full strength at V = {volume:.6g}; "
            f"try another volume or a lower strength{f'; {coarse}' if coarse else ''}",
            status=Status.DIPOLE_CONTACT if touching else Status.NO_EQUILIBRIUM,
        ) from error


def _acting(potential: Potential) -> str:
    """What was to be turned on, in words."""
    if potential.electric is None:
        return "the sources"
    word = "voltage" if potential.electric.load == "voltage" else "charge"
    return f"the sources and the {word}" if potential.sources else f"the {word}"


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
        if stable or sound(spare):
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
    return spare if spare is not None and not sound(found) else found


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
        yield f"the branch through V = {nearest:.6g}", lambda: along(potential, start_at_volume(potential, nearest), held, load, accept)
    for share in (1.0, 10.0, 100.0):  # further out where the first branch ends, or takes too many steps
        if share == 10.0 and potential.obstacles and held is CONTROLS["pressure"]:
            for side in sides:
                yield (
                    f"downhill onto a body from V = {rest + side * size:.6g}",
                    lambda side=side: _downhill(potential, load, rest + side * size, accept),  # type: ignore[misc]
                )
        for side in sides:
            first = rest + side * share * size
            yield (
                f"the branch through V = {first:.6g}",
                lambda first=first: along(potential, start_at_volume(potential, first), held, load, accept),  # type: ignore[misc]
            )
    pressure = load if held is CONTROLS["pressure"] else 0.0
    for side in sides:
        for share in (1.0, 4.0, 16.0):
            guess = rest + side * share * size
            yield (
                f"{_GUESS} with V = {guess:.6g}",
                lambda guess=guess: from_guess(potential, held.at(load), guess, pressure=pressure, accept=accept),  # type: ignore[misc]
            )


def _same(a: State, b: State) -> bool:
    potential = a.evaluation.potential
    return a.x.shape == b.x.shape and distance(potential, a.x, b.x) <= _SAME * displacement(potential, a.x)


def _is_minimum(state: State) -> bool:
    """Whether a state is a minimum under pressure control."""
    return negative_among(state.evaluation) == 0


def _downhill(potential: Potential, pressure: float, volume: float, accept: Callable[[State], bool] | None) -> State | None:
    """Where bodies stop the membrane at a pressure, from the bare one at a volume."""
    state = caught(potential, PressureControl(pressure), (inflated(potential, volume),))
    return state if state is not None and (accept is None or accept(state)) else None


def _pull(potential: Potential) -> float:
    """Pressure that lifts the flat membrane as its sources and loads do, to first order: on a shallow dome it does the same work."""
    if not potential.surrounded:
        return 0.0
    flat, across = np.zeros(potential.space.n_free), potential.space.fields[1]
    shallow = 1e-6 * potential.space.units["volume"]
    evaluation, dome = potential.evaluate(flat, 0.0), guess_at_volume(potential, shallow)
    return float(-(evaluation.gradient[across] @ dome[across]) / (evaluation.volume_gradient[across] @ dome[across]))
