"""Equilibria and runs under volume, pressure or height control."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from ..accuracy.adapt import spread
from ..checks import LARGEST, choice, number, only
from ..errors import InputError, SolveError, Status
from ..potential import Array, Potential, potential_of
from ..results.checkpoint import same_scene
from ..results.records import Branch, Equilibrium, Jump, PathMemory, SoFar, SpecialPoint
from ..scene import MAX_STEPS, Scene
from ..solve.controls import CONTROLS, Gas, control_kind
from ..solve.minimize import is_minimum, minimize_and_verify
from ..solve.newton import TOLERANCE, correct
from ..solve.search import Limit, beyond_crossing, beyond_limit, loss_before
from ..solve.special_points import ON_FOLD
from ..solve.start import cold_start, moderate, start_in_gas
from ..solve.state import Predictor, State, at_rest, distance, flat_state, rests_flat
from ..solve.state_resolution import refuse_unresolved
from ..solve.stepping import Corrector, march
from ..solve.wellposed import slackness, unresolved_source
from ..threads import one_thread
from .arguments import check_height, check_scene
from .meshing import on_chosen_mesh
from .state_records import OnCheckpoint, OnStep, predictor_of, record, remembered, restore, resume, special_point
from .trace import resume_trace, trace

_SOLVERS: dict[str, Corrector] = {"ipopt": minimize_and_verify, "newton": correct}
AT_LIMIT = ("stop", "jump")
#: share of a load at which a path to the flat membrane at rest, or through it, is close enough to leave out the rest
NEAR_ZERO = 1e-3
#: by how much the displacement shrinks on that way, at least (the cube root of it without stiffness): else the branch does not lead to rest
NEAR_REST = 0.5


@one_thread
def inflate(
    scene: Scene,
    *,
    volumes: ArrayLike,
    start: Equilibrium | None = None,
    solver: str = "ipopt",
    at_limit: str = "stop",
    throw: bool = True,
    on_step: OnStep | None = None,
) -> Branch:
    """Follow the membrane through given volumes, in the order given.

    Parameters
    ----------
    scene : Scene
    volumes : array_like
        Enclosed volumes over R0^3 (with the 2 pi), signed.
    start : Equilibrium, optional
        A neighbour to start from; default: inflated without sources, which are then turned on at the first volume.
    solver : {"ipopt", "newton"}
        Minimiser, or the bordered corrector (which also follows saddle points).
    at_limit : {"stop", "jump"}
        Where the branch turns back before a load, or becomes unstable at a branch point (``solver="ipopt"``): end there, saying where the
        membrane would go, or go to the next stable state at that load, of this branch or of the one that crosses it, and on from there.
    throw : bool
        Raise when a volume cannot be reached; otherwise return what was reached, with its status and message.
    on_step : callable, optional
        Called with (index, total, equilibrium) after each equilibrium.

    Returns
    -------
    Branch

    Raises
    ------
    InputError, SolveError
        The latter carries the branch up to the failure as ``result``.
    """
    return _follow(scene, "volume", _loads("volumes", volumes), start, solver, throw, on_step, at_limit)


@one_thread
def pressurize(
    scene: Scene,
    *,
    pressures: ArrayLike,
    start: Equilibrium | None = None,
    solver: str = "ipopt",
    at_limit: str = "stop",
    throw: bool = True,
    on_step: OnStep | None = None,
) -> Branch:
    """Follow the membrane through given pressures P = p R0/(mu T), in the order given; otherwise as :func:`inflate`.

    Without ``start`` the first state is the first stable equilibrium met on the branch through the moderately inflated membrane.

    Parameters
    ----------
    scene : Scene
    pressures : array_like
        Pressures P = p R0/(mu T), signed.
    start, solver, at_limit, throw, on_step
        As in :func:`inflate`.

    Returns
    -------
    Branch

    Raises
    ------
    InputError, SolveError
        The latter carries the branch up to the failure as ``result``.
    """
    return _follow(scene, "pressure", _loads("pressures", pressures), start, solver, throw, on_step, at_limit)


@one_thread
def equilibrium(
    scene: Scene,
    *,
    volume: float | None = None,
    pressure: float | None = None,
    center_height: float | None = None,
    gas: Gas | None = None,
    start: Equilibrium | None = None,
    solver: str = "ipopt",
) -> Equilibrium:
    """One equilibrium at a volume, a pressure, a height of the pole, or with a fixed amount of gas.

    Exactly one of ``volume``, ``pressure``, ``center_height`` and ``gas`` is given. Under volume and pressure control the state is a
    minimum (``solver="ipopt"``), or any solution of the equations (``"newton"``). The other two always take the Newton corrector:
    a height is held by no potential, and with a gas the branch is followed as the gas is let in.

    Parameters
    ----------
    scene : Scene
    volume : float, optional
        Enclosed volume over R0^3 (with the 2 pi), signed.
    pressure : float, optional
        P = p R0/(mu T).
    center_height : float, optional
        Height over R0 of the pole, or of the first point of a meridian without a pole.
    gas : Gas, optional
        Amount of gas behind the membrane.
    start : Equilibrium, optional
        A neighbour to start from; default: a cold start from the moderately inflated membrane.
    solver : {"ipopt", "newton"}
        Minimiser, or the bordered corrector (which also finds saddle points).

    Returns
    -------
    Equilibrium

    Raises
    ------
    InputError, SolveError
    """
    given = {"volume": volume, "pressure": pressure, "center_height": center_height, "gas": gas}
    control, load = only("equilibrium", given, "exactly one of volume, pressure, center_height and gas is allowed")
    if gas is not None:
        return _in_gas(scene, gas, start)
    value = np.array([number(control, load, "one finite number is allowed")])
    return _follow(scene, control, value, start, solver, True, None)[0]


@one_thread
def run(
    scene: Scene, on_step: OnStep | None = None, *, on_checkpoint: OnCheckpoint | None = None, unfinished: Branch | None = None
) -> Branch:
    """Do what the scene's [run] says; never raises for a solve that fails: the branch carries its status and message.

    Parameters
    ----------
    scene : Scene
    on_step : callable, optional
        Called with (index, total, equilibrium) after each equilibrium.
    on_checkpoint : callable, optional
        Called after each equilibrium with the branch so far, which may be saved.
    unfinished : Branch, optional
        The last branch that ``on_checkpoint`` was called with, when a run of this scene was interrupted: it is finished, and the result is
        that of an uninterrupted run to the last bit.

    Raises
    ------
    InputError
        When the scene has no [run], or ``unfinished`` belongs to another scene.
    """
    check_scene(scene)
    if scene.run is None:
        raise InputError("run", None, 'a [run] table is required, for instance control = "volume", start = 0.5, stop = 75.0, steps = 60')
    asked = scene.run
    if unfinished is not None:
        scene = same_scene(scene, unfinished, "unfinished")
    if asked.control == "arc-length":
        observers: dict[str, Any] = {"on_step": on_step, "on_checkpoint": on_checkpoint}
        if unfinished is not None:
            return resume_trace(scene, unfinished, until=asked.until, max_steps=asked.max_steps, **observers)
        ways: dict[str, Any] = {"until": asked.until, "direction": asked.direction, "max_steps": asked.max_steps}
        return trace(scene, start=cast(float, asked.start), throw=False, **ways, **observers)
    return _follow(
        scene,
        control_kind(asked.control).name,
        asked.loads(),
        None,
        asked.solver,
        False,
        on_step,
        asked.at_limit,
        on_checkpoint=on_checkpoint,
        kept=unfinished,
    )


def _loads(key: str, values: ArrayLike) -> Array:
    try:
        loads = np.atleast_1d(np.asarray(values, dtype=float))
    except (TypeError, ValueError, OverflowError):
        raise InputError(key, values, "numbers are allowed") from None
    if loads.ndim != 1 or not loads.size or not np.isfinite(loads).all():
        raise InputError(key, values, "one or more finite numbers are allowed")
    if not (np.abs(loads) <= LARGEST).all():
        raise InputError(key, values, f"finite numbers are allowed, of a size up to {LARGEST:g}")
    if loads.size > MAX_STEPS:
        raise InputError(key, f"{loads.size} numbers", f"up to {MAX_STEPS} are allowed")
    return loads


def _follow(
    scene: Scene,
    control: str,
    loads: Array,
    start: Equilibrium | None,
    solver: str,
    throw: bool,
    on_step: OnStep | None,
    at_limit: str = "stop",
    *,
    on_checkpoint: OnCheckpoint | None = None,
    kept: Branch | None = None,
) -> Branch:
    choice("solver", solver, _SOLVERS)
    choice("at_limit", at_limit, AT_LIMIT)

    def trial(on_mesh: Scene, begin: Equilibrium | None) -> Branch:
        return _follow(on_mesh, control, loads[spread(loads)], begin, solver, False, None, at_limit)

    try:
        scene, start, timings, shortfall = on_chosen_mesh(scene, start, trial, control)
    except SolveError as error:
        if throw:
            raise
        return Branch(scene, (), error.status, str(error))
    clock, potential = time.perf_counter(), potential_of(scene)
    if control == "center_height":
        check_height("center_height", potential)
    timings |= {"setup": time.perf_counter() - clock, "solve": 0.0, "verdicts": 0.0}
    found: list[Equilibrium] = []
    jumps: list[Jump] = []
    status, message = Status.CONVERGED, ""
    if shortfall is not None:
        status, message = Status.ACCURACY_NOT_MET, str(shortfall)
        loads = loads[: spread(loads)[shortfall.kept - 1] + 1]
    used = solver if CONTROLS[control].minimised else "newton"
    walk = _Walk(potential, control, _SOLVERS[solver], start)
    if kept is not None:
        found, jumps, timings = list(kept), list(kept.jumps), {**timings, **kept.timings}
        walk.go_on(kept, loads)
    for index, load in enumerate(loads[len(found) :], len(found)):
        clock = time.perf_counter()
        try:
            state, limit = walk.to(float(load), at_limit == "jump")
        except SolveError as error:
            status, message = error.status, f"{CONTROLS[control].words} {load:.9g} was not reached: {error}"
            timings["solve"] += time.perf_counter() - clock
            break
        solved = time.perf_counter()
        new = record(scene, potential, state, found[-1] if found else None, clock)
        timings["solve"] += solved - clock
        timings["verdicts"] += time.perf_counter() - solved
        if limit is not None:
            jumps.append(Jump(index, limit.point(scene, potential), new))
        found.append(new)
        if on_step is not None:
            on_step(index, len(loads), new)
        more = index + 1 < len(loads)
        if new.status is Status.SLACK and (more or not throw):  # with nothing after it, it is what was asked for
            status, message = Status.SLACK, str(slackness(potential, state))
            if more:
                message = f"{CONTROLS[control].words} {loads[index + 1]:.9g} was not reached: {message}"
            break
        if on_checkpoint is not None:
            memory = remembered(walk.path, potential.space.n_free)
            so_far = Branch(scene, SoFar(found), Status.INTERRUPTED, "interrupted", dict(timings), memory=memory, jumps=tuple(jumps))
            on_checkpoint(replace(so_far, solver=used))
    branch = Branch(scene, tuple(found), status, message, timings, jumps=tuple(jumps), solver=used)
    if throw and message:
        raise SolveError(f"{message}; {status.advice}", status=status, result=branch)
    return branch


@dataclass(frozen=True)
class _Turn:
    """The branch turned back before a load, or became unstable, and where a stable state is met again."""

    limit: Limit

    def point(self, scene: Scene, potential: Potential) -> SpecialPoint | None:
        fold = self.limit.fold
        if fold is None:
            return None
        return special_point(scene.replace(analysis=type(scene.analysis)()), potential, fold)

    @property
    def status(self) -> Status | None:
        """Why the load was not reached; None where that was not found out."""
        fold = self.limit.fold
        return None if fold is None else Status.NOT_A_MINIMUM if fold.kind == "branch_point" else Status.NO_EQUILIBRIUM

    def __str__(self) -> str:
        fold, landing = self.limit.fold, self.limit.landing
        if fold is None:
            return "steps in the load did not converge there, and along the branch no fold in it was met"
        at = fold.point.state
        if fold.kind == "branch_point":
            where = (
                f"the branch lost stability at the branch point P = {at.pressure:.9g}, V = {at.volume:.9g}, where another one crosses it"
            )
            if landing is None:
                return f"{where}, on which no stable state was met at this load"
            return f"{where}, on which the membrane would go to V = {landing.volume:.6g}, P = {landing.pressure:.6g}"
        what = fold.kind.replace("_", " ")
        where = f"the branch turns back: the {what} is P = {at.pressure:.9g}, V = {at.volume:.9g}"
        if landing is None:
            last = self.limit.last
            far = "" if last is None else f", as far as V = {last.volume:.6g}, P = {last.pressure:.6g}"
            return f"{where}; it was followed on{far}, without meeting a stable state at this load"
        return f"{where}, from which the membrane would jump to V = {landing.volume:.6g}, P = {landing.pressure:.6g}"


def _load_of(start: Equilibrium, control: str, potential: Potential, state: State) -> float:
    """The load of a start; that of the state it was corrected to where this is another one, as in another scene."""
    given, found, unit = float(getattr(start, control)), state.value_of(CONTROLS[control]), potential.space.units[control]
    return given if abs(found - given) <= 1e-9 * max(abs(given), unit) else float(found)


class _Walk:
    """From load to load under one control, with the memory that predicts the next state."""

    def __init__(self, potential: Potential, control: str, corrector: Corrector, start: Equilibrium | None) -> None:
        self.potential, self.control_at = potential, CONTROLS[control].at
        self.quantity, self.corrector = control, corrector if CONTROLS[control].minimised else correct
        self.path = Predictor()
        self.state: State | None = None
        self.load = 0.0
        if start is not None:
            self.state = resume(potential, start)
            self.load = _load_of(start, control, potential, self.state)
            if self.corrector is minimize_and_verify and not is_minimum(potential, self.control_at(self.load), self.state.evaluation):
                message = f"the start (V = {start.volume:.6g}, P = {start.pressure:.6g}) is no minimum under {control} control"
                raise SolveError(message, status=Status.NOT_A_MINIMUM)

    def _begin_before(self, load: float, failure: SolveError) -> None:
        """Stand at the moderately inflated membrane on the way to a volume at which sources could not be turned on: steps from there reach
        it, or meet the fold that is the reason."""
        rest, size = self.potential.space.reference_volume, moderate(self.potential)
        if self.quantity != "volume" or failure.status.ill_posed or abs(load - rest) <= size or not self.potential.surrounded:
            raise failure
        self.load = rest + float(np.copysign(size, load - rest))
        try:
            self.state, _ = self._first(self.load, False)
            self.path = Predictor()
        except SolveError:
            raise failure from None

    def go_on(self, kept: Branch, loads: Array) -> None:
        """Stand where a run through these loads was interrupted."""
        memory = kept.memory
        if type(memory) is not PathMemory or not 0 < len(kept) <= len(loads):
            raise InputError("unfinished", kept, "a branch that on_checkpoint was called with is allowed")
        self.state, self.path, self.load = restore(self.potential, kept[-1]), predictor_of(memory), float(loads[len(kept) - 1])

    def to(self, load: float, jump: bool) -> tuple[State, _Turn | None]:
        """The state at a load, and where the branch turned back if it had to be left for it."""
        if self.state is None or self._flat(self.state.x):
            # the flat unloaded membrane has no stiffness that a path could leave it by
            try:
                self.state, turn = self._first(load, jump)
                self.path = Predictor()
            except SolveError as failure:
                self._begin_before(load, failure)
                return self.to(load, jump)
        elif load != self.load and self.potential.flat and self.load * load <= 0 and rests_flat(self.potential):
            return self._through_flat(self.state, load, jump)
        elif load != self.load and at_rest(self.potential, self.quantity, load):
            self.state, self.path, turn = flat_state(self.potential), Predictor(), None
        else:
            return self._along(self.state, load, jump)
        return self._arrived(self.state, load, turn)

    def _along(self, state: State, load: float, jump: bool) -> tuple[State, _Turn | None]:
        """Along the branch from the state at hand, and off it where it turns back before the load."""
        if load == self.load:
            return self._arrived(state, load, None)
        try:
            states = march(self.potential, state, self.control_at, self.load, load, path=self.path, corrector=self.corrector)
        except SolveError as error:
            if error.status.ill_posed:
                raise
            turn = self._turn(error, load)
            if turn.limit.fold is None and turn.limit.landing is not None:
                self.path = Predictor()
                return self._arrived(turn.limit.landing, load, None)
            if turn.limit.fold is None and turn.limit.ill_posed is not None:
                raise slackness(self.potential, turn.limit.ill_posed) from error
            if not jump or turn.limit.landing is None:
                raise SolveError(str(turn), status=turn.status or error.status) from error
            self.path = Predictor()
            return self._arrived(turn.limit.landing, load, turn)
        states[-1].iterations = sum(s.iterations for s in states)
        return self._arrived(states[-1], load, None)

    def _arrived(self, state: State, load: float, turn: _Turn | None) -> tuple[State, _Turn | None]:
        self.state, self.load = state, load
        if unresolved := unresolved_source(self.potential, self.state.x):
            raise SolveError(unresolved, status=Status.DIPOLE_CONTACT)
        refuse_unresolved(self.potential, state)
        return self.state, turn

    def _through_flat(self, before: State, load: float, jump: bool) -> tuple[State, _Turn | None]:
        """To the flat membrane at rest, or to the other side of it, where the mirror image of every state is one at the opposite load.

        Where loads or sources hold another state in equilibrium at no load, the branch passes there, and is followed as any other.
        """
        state, turn = self._along(before, NEAR_ZERO * self.load, jump)
        rest = np.zeros_like(state.x)
        if distance(self.potential, state.x, rest) > NEAR_REST * distance(self.potential, before.x, rest):
            state, later = self._along(state, load, jump)
            return state, later or turn
        self.path = Predictor()
        if load == 0:
            self.state, self.load = flat_state(self.potential), load
            return self.state, turn
        mirrored = state.x.copy()
        mirrored[self.potential.space.fields[1]] *= -1
        self.load *= -1
        result = self.corrector(self.potential, self.control_at(self.load), mirrored, -state.pressure)
        if result.status is not Status.CONVERGED:
            raise SolveError(f"the state on the other side of the flat membrane was not found at {self.load:.3g}", status=result.status)
        state, later = self._along(State.of(result), load, jump)
        return state, later or turn

    def _flat(self, x: Array) -> bool:
        return not x.any() and rests_flat(self.potential)

    def _first(self, load: float, jump: bool) -> tuple[State, _Turn | None]:
        """The state of a cold start, and where its branch became unstable if it is one of another branch."""
        guess = cold_start(self.potential, self.quantity, load, stable=self.corrector is not correct)
        result = self.corrector(self.potential, self.control_at(load), guess.x, guess.pressure)
        if (
            result.status in (Status.NOT_CONVERGED, Status.NOT_A_MINIMUM)
            and self.quantity == "pressure"
            and abs(guess.pressure - load) <= ON_FOLD * (self.potential.space.units["pressure"] + abs(load))
        ):
            return guess, None  # a limit point at this very pressure, which no corrector finds under pressure control
        if result.status is Status.NOT_A_MINIMUM:
            turn = self._lost(guess, load)
            if jump and turn.limit.landing is not None:
                return turn.limit.landing, turn
            where = f"the state found there (V = {guess.volume:.6g}, P = {guess.pressure:.6g}) is no minimum under {self.quantity} control"
            raise SolveError(f"{where}; {turn}" if turn.limit.fold else where, status=result.status)
        if result.status is not Status.CONVERGED:
            raise SolveError(f"the state found there has V = {guess.volume:.6g} and P = {guess.pressure:.6g}", status=result.status)
        return State.of(result, guess.iterations), None

    def _lost(self, state: State, load: float) -> _Turn:
        """Where the branch of an unstable state was stable last, and the stable state at the load on the branch that crosses there."""
        lost = loss_before(self.potential, state, self.quantity, self._stable(load))
        if lost is None or lost.kind != "branch_point":
            return _Turn(Limit(None, None))
        return _Turn(Limit(lost, beyond_crossing(self.potential, lost, self.quantity, load, self._stable(load))))

    def _stable(self, load: float) -> Callable[[State], bool]:
        control = self.control_at(load)
        return lambda state: is_minimum(self.potential, control, state.evaluation)

    def _turn(self, error: SolveError, load: float) -> _Turn:
        # next to a crossing of branches round-off lies along the other one; the last state that it did not touch has a tangent of its own
        last = next((s for s in reversed(error.result or []) if s.correction <= TOLERANCE), self.state)
        if not CONTROLS[self.quantity].minimised or last is None:
            return _Turn(Limit(None, None))
        return _Turn(beyond_limit(self.potential, last, self.quantity, load, self._stable(load), any_before=self.corrector is correct))


def _in_gas(scene: Scene, gas: Gas, start: Equilibrium | None) -> Equilibrium:
    """Let the gas in: from the start, or the moderately inflated membrane, along the branch to the gas's own pressure at its volume."""
    clock = time.perf_counter()
    if not isinstance(gas, Gas):
        raise InputError("gas", gas, "a Gas is allowed, such as Gas(amount=3.0, chamber=1.0)")
    scene, start, _, _ = on_chosen_mesh(scene, start, lambda trial, begin: Branch(trial, (_in_gas(trial, gas, begin),)), "volume")
    potential = potential_of(scene)
    if rests_flat(potential) and gas.pressure(potential.space.reference_volume) == 0:
        return record(scene, potential, flat_state(potential), clock=clock, gas=gas)
    if start is None:
        state = start_in_gas(potential, gas)
        refuse_unresolved(potential, state)
        return record(scene, potential, state, clock=clock, gas=gas)
    state = resume(potential, start)
    # the amount that holds the state at hand is known: march from it to the wanted one
    held = state.value_of(gas)
    if held <= 0 or state.volume <= -gas.chamber:
        raise SolveError(
            "the start does not compress the gas (P + atmosphere <= 0); start at a larger volume", status=Status.NO_EQUILIBRIUM
        )
    if held != gas.amount:
        state = march(potential, state, gas.at, held, gas.amount)[-1]
    refuse_unresolved(potential, state)
    return record(scene, potential, state, clock=clock, gas=gas)
