"""What a user asks for: equilibria, runs under volume or pressure control."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from .errors import InputError, SolveError, Status, unknown_name
from .potential import Potential, potential_of
from .results.records import Branch, Equilibrium
from .scene import Scene
from .solve.controls import CenterHeightControl, Control, PressureControl, VolumeControl
from .solve.minimize import minimize_and_verify
from .solve.newton import correct
from .solve.start import START_VOLUME, start_at_pressure, start_at_volume
from .solve.state import Path, State
from .solve.stepping import Corrector, march
from .stability.verdict import Verdict, axisymmetric_verdict
from .threads import one_thread

OnStep = Callable[[int, int, Equilibrium], None]

_SOLVERS: dict[str, Corrector] = {"ipopt": minimize_and_verify, "newton": correct}
_CONTROLS: dict[str, Callable[[float], Control]] = {"volume": VolumeControl, "pressure": PressureControl}
_STARTS: dict[str, Callable[[Potential, float], State]] = {"volume": start_at_volume, "pressure": start_at_pressure}


@one_thread
def inflate(
    scene: Scene,
    *,
    volumes: ArrayLike,
    start: Equilibrium | None = None,
    solver: str = "ipopt",
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
    return _follow(scene, "volume", _loads("volumes", volumes), start, solver, throw, on_step)


@one_thread
def pressurize(
    scene: Scene,
    *,
    pressures: ArrayLike,
    start: Equilibrium | None = None,
    solver: str = "ipopt",
    throw: bool = True,
    on_step: OnStep | None = None,
) -> Branch:
    """Follow the membrane through given pressures P = p R0/(mu T), in the order given; otherwise as :func:`inflate`.

    Without ``start`` the first state is the first stable equilibrium met on the branch through the moderately inflated membrane.
    """
    return _follow(scene, "pressure", _loads("pressures", pressures), start, solver, throw, on_step)


@one_thread
def equilibrium(
    scene: Scene,
    *,
    volume: float | None = None,
    pressure: float | None = None,
    center_height: float | None = None,
    start: Equilibrium | None = None,
    solver: str | None = None,
) -> Equilibrium:
    """One equilibrium at a volume, a pressure, or a height of the pole.

    Exactly one of ``volume``, ``pressure`` and ``center_height`` is given. Under volume and pressure control the state is a minimum
    (``solver="ipopt"``, the default); ``solver="newton"`` accepts saddle points, and a center height, which is no minimiser's control,
    always uses it.

    Raises
    ------
    InputError, SolveError
    """
    given = {k: v for k, v in (("volume", volume), ("pressure", pressure), ("center_height", center_height)) if v is not None}
    if len(given) != 1:
        raise InputError("equilibrium", sorted(given), "exactly one of volume, pressure and center_height is allowed")
    ((control, load),) = given.items()
    value = _loads(control, load)
    if len(value) != 1:
        raise InputError(control, load, "one number is allowed")
    if control == "center_height":
        if solver not in (None, "newton"):
            raise InputError("solver", solver, 'a center height is no minimiser\'s control; "newton" is allowed')
        return _at_height(scene, float(value[0]), start)
    return _follow(scene, control, value, start, solver or "ipopt", True, None)[0]


@one_thread
def run(scene: Scene, on_step: OnStep | None = None) -> Branch:
    """Do what the scene's [run] says; never raises for a solve that fails: the branch carries its status and message.

    Raises
    ------
    InputError
        When the scene has no [run].
    """
    if scene.run is None:
        raise InputError("run", None, 'a [run] table is required, for instance control = "volume", start = 0.5, stop = 75.0, steps = 60')
    return _follow(scene, scene.run.control, scene.run.loads(), None, scene.run.solver, False, on_step)


def _loads(key: str, values: ArrayLike) -> np.ndarray:
    try:
        loads = np.atleast_1d(np.asarray(values, dtype=float))
    except (TypeError, ValueError):
        raise InputError(key, values, "numbers are allowed") from None
    if loads.ndim != 1 or not loads.size or not np.isfinite(loads).all():
        raise InputError(key, values, "one or more finite numbers are allowed")
    return loads


def _follow(
    scene: Scene, control: str, loads: np.ndarray, start: Equilibrium | None, solver: str, throw: bool, on_step: OnStep | None
) -> Branch:
    if solver not in _SOLVERS:
        raise unknown_name("solver", solver, _SOLVERS)
    clock = time.perf_counter()
    potential = potential_of(scene)
    timings = {"setup": time.perf_counter() - clock, "solve": 0.0, "verdicts": 0.0}
    found: list[Equilibrium] = []
    walk = _Walk(potential, control, _SOLVERS[solver], start)
    status, message = Status.CONVERGED, ""
    for index, load in enumerate(loads):
        clock = time.perf_counter()
        try:
            state = walk.to(float(load))
        except SolveError as error:
            status = error.status
            message = f"{control} {load:.9g} was not reached: {error}. {status.advice[0].upper()}{status.advice[1:]}."
            timings["solve"] += time.perf_counter() - clock
            break
        solved = time.perf_counter()
        new = record(scene, potential, state, found[-1] if found else None, clock)
        timings["solve"] += solved - clock
        timings["verdicts"] += time.perf_counter() - solved
        found.append(new)
        if on_step is not None:
            on_step(index, len(loads), new)
    branch = Branch(scene, tuple(found), status, message, timings)
    if throw and message:
        raise SolveError(message, status=status, result=branch)
    return branch


class _Walk:
    """From load to load under one control, with the memory that predicts the next state."""

    def __init__(self, potential: Potential, control: str, corrector: Corrector, start: Equilibrium | None) -> None:
        self.potential, self.control_at, self.cold = potential, _CONTROLS[control], _STARTS[control]
        self.quantity, self.corrector = control, corrector
        self.path = Path()
        self.state: State | None = None
        self.load = 0.0
        if start is not None:
            self.state = resume(potential, start)
            self.load = getattr(start, control)

    def to(self, load: float) -> State:
        if self.state is None:
            guess = self.cold(self.potential, load)
            result = self.corrector(self.potential, self.control_at(load), guess.x, guess.pressure)
            if result.status is not Status.CONVERGED:
                raise SolveError(f"the state found there has V = {guess.volume:.6g} and P = {guess.pressure:.6g}", status=result.status)
            self.state = State.of(result, guess.iterations)
        elif load != self.load:
            states = march(self.potential, self.state, self.control_at, self.load, load, path=self.path, corrector=self.corrector)
            self.state = states[-1]
            self.state.iterations = sum(s.iterations for s in states)
        self.load = load
        return self.state


def resume(potential: Potential, start: Equilibrium) -> State:
    """The solver's state of a recorded equilibrium, of this scene or of one with the same mesh and degree."""
    if start.state.shape != (potential.space.n_free,):
        raise InputError("start", start, f"an equilibrium with {potential.space.n_free} unknowns (the same mesh and degree) is allowed")
    result = correct(potential, VolumeControl(start.volume), start.state, start.pressure)
    if result.status is not Status.CONVERGED:
        result = correct(potential, PressureControl(start.pressure), start.state, start.pressure)
    if result.status is not Status.CONVERGED:
        raise SolveError("the start is no equilibrium of this scene", status=result.status)
    return State.of(result)


def record(
    scene: Scene, potential: Potential, state: State, previous: Equilibrium | None = None, clock: float | None = None
) -> Equilibrium:
    """The public record of a solver's state, with the verdicts that the scene asks for.

    ``previous`` lends its modes as starting guesses; ``clock`` is the time at which work on this state began.
    """
    verdicts: dict[tuple[str | None, int], Verdict] = {}
    for control in scene.analysis.stability:
        guess = previous.verdict(control).coefficients if previous is not None else None
        verdicts[control, 0] = axisymmetric_verdict(potential, state.evaluation, control, guess)
    coefficients = state.x.copy()
    coefficients.flags.writeable = False
    return Equilibrium(
        pressure=float(state.pressure),
        volume=state.evaluation.volume,
        center_height=potential.space.center_height(state.x),
        elastic_energy=state.evaluation.elastic_energy,
        magnetic_energy=state.evaluation.magnetic_energy,
        residual=float(state.residual),
        iterations=state.iterations,
        status=state.status,
        scene=scene,
        state=coefficients,
        seconds=0.0 if clock is None else time.perf_counter() - clock,
        _verdicts=verdicts,
    )


def _at_height(scene: Scene, height: float, start: Equilibrium | None) -> Equilibrium:
    """Follow the pole from the start, or from the moderately inflated membrane, to a height."""
    clock = time.perf_counter()
    potential = potential_of(scene)
    state = start_at_volume(potential, float(np.copysign(START_VOLUME, height))) if start is None else resume(potential, start)
    here = potential.space.center_height(state.x)
    states = march(potential, state, CenterHeightControl, here, height) if height != here else [state]
    return record(scene, potential, states[-1], clock=clock)
