"""A run from load to load: what is asked, and how it is stepped."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..accuracy.along import Along
from ..accuracy.borders import holding
from ..accuracy.yardstick import spread
from ..checks import LARGEST, choice
from ..errors import InputError, SolveError, Status
from ..potential import Array, Potential, potential_of
from ..quantities import readable_kind
from ..results.branch import Branch
from ..results.equilibrium import Equilibrium
from ..results.path_memory import PathMemory
from ..results.special_point import Jump, SpecialPoint
from ..scene import MAX_STEPS, Scene
from ..scene.run import AT_LIMIT
from ..solve.controls import CONTROLS, Control, ControlKind, Controlled, Gas, check_height
from ..solve.load_path import SOLVERS, LoadPath, Turn
from ..solve.number_path import NumberPath
from ..solve.state import State
from ..solve.wellposed import slackness
from .arguments import kind_of, plain
from .changed_mesh import carried_path, state_there
from .meshing import carried
from .running import End, Request, Run
from .state_records import OnStep, predictor_of, record_on_borders, remembered, restore, resume, special_point


@dataclass(frozen=True, eq=False)
class LoadRequest(Request):
    """Equilibria at loads of one control, in the order given.

    Attributes
    ----------
    held : Controlled
        What is prescribed.
    loads : ndarray, shape (number of equilibria,)
    start : Equilibrium or None
        A neighbour to start from.
    solver : {"ipopt", "newton"}
        Who solves where a minimiser can hold what is prescribed.
    at_limit : {"stop", "jump"}
        What to do where the branch turns back before a load.
    throw : bool
        Whether the caller raises when a load is not reached. A last state that is slack is then what was asked for.
    """

    held: Controlled
    loads: Array
    start: Equilibrium | None = None
    solver: str = "ipopt"
    at_limit: str = "stop"
    throw: bool = False

    def __post_init__(self) -> None:
        choice("solver", self.solver, SOLVERS)
        choice("at_limit", self.at_limit, AT_LIMIT)

    @property
    def errors_at(self) -> str:
        return self.held.name if self.held.name in CONTROLS else "volume"

    @property
    def mesh_changes(self) -> bool:
        return True

    def on(self, scene: Scene) -> Self:
        return replace(self, start=carried(self.start, scene))

    def trial(self) -> Self:
        return replace(self, loads=self.loads[spread(self.loads)], throw=False)

    def covers(self, whole: Request) -> bool:
        return isinstance(whole, LoadRequest) and len(self.loads) == len(whole.loads)

    def up_to(self, count: int) -> Self:
        return replace(self, loads=self.loads[: spread(self.loads)[count - 1] + 1])

    def prepared(self, scene: Scene, on_step: OnStep | None) -> LoadRun:
        """The run before it has a start."""
        return LoadRun(scene, self, on_step)

    def begin(self, scene: Scene, on_step: OnStep | None = None) -> LoadRun:
        run = self.prepared(scene, on_step)
        if self.start is not None:
            run.set_out(self.start)
        return run

    def go_on(self, scene: Scene, unfinished: Branch, on_step: OnStep | None = None) -> LoadRun:
        run = self.prepared(scene, on_step)
        run.go_on(unfinished)
        return run


def checked_loads(key: str, values: ArrayLike, scene: Any = None, name: str = "") -> Array:
    """The loads of an argument, one after the other, or InputError; texts have a unit of the quantity or number ``name`` of the scene."""
    items: Any = values
    if isinstance(values, str):
        items = [values]
    elif isinstance(values, np.ndarray) and values.dtype.kind == "U":
        items = values.tolist()
    if isinstance(items, (list, tuple)):
        items = [plain(key, item, scene, name) for item in items]
        if any(isinstance(item, str) for item in items):
            raise InputError(key, values, "numbers are allowed")
    try:
        loads = np.atleast_1d(np.asarray(items, dtype=float))
    except (TypeError, ValueError, OverflowError):
        raise InputError(key, values, "numbers are allowed") from None
    if loads.ndim != 1 or not loads.size or not np.isfinite(loads).all():
        raise InputError(key, values, "one or more finite numbers are allowed")
    if not (np.abs(loads) <= LARGEST).all():
        raise InputError(key, values, f"finite numbers are allowed, of a size up to {LARGEST:g}")
    if loads.size > MAX_STEPS:
        raise InputError(key, f"{loads.size} numbers", f"up to {MAX_STEPS} are allowed")
    return loads


class LoadRun(Run[Branch]):
    """A run from load to load under way.

    Attributes
    ----------
    jumps : list of Jump
        Where it snapped to another state.
    path : LoadPath or NumberPath
        Where the membrane stands.
    """

    def __init__(self, scene: Scene, request: LoadRequest, on_step: OnStep | None = None, potential: Potential | None = None) -> None:
        clock, potential = time.perf_counter(), potential or potential_of(scene)
        if request.held is CONTROLS["center_height"]:
            check_height("center_height", potential)
        super().__init__(scene, potential, ("setup", "solve", "verdicts"))
        self.timings["setup"] = time.perf_counter() - clock
        self.request, self.on_step = request, on_step
        self.jumps: list[Jump] = []
        self.path = self.new_path()

    def new_path(self) -> LoadPath | NumberPath:
        """The path before its first load."""
        return LoadPath(self.potential, self.request.held, self.request.solver)

    def set_out(self, start: Equilibrium) -> None:
        """Stand at a start, which is solved again: it may be of another scene, or of another mesh."""
        state = resume(self.potential, start)
        self.path.set_out(state, self._load_of(start, state))

    def go_on(self, unfinished: Branch) -> None:
        """Stand where a run through these loads was interrupted."""
        memory, count = unfinished.memory, len(unfinished)
        if type(memory) is not PathMemory or not 0 < count <= len(self.request.loads):
            raise InputError("unfinished", unfinished, "a branch that on_checkpoint was called with is allowed")
        self.found, self.jumps = list(unfinished), list(unfinished.jumps)
        self.timings |= unfinished.timings
        load = float(self.request.loads[count - 1])
        if memory.sizes is not None:
            self.along = Along.of(self.scene, self.request.errors_at, memory.sizes)
            self._stand_on(unfinished[-1].scene)
        self.path.go_on(self.restored(unfinished[-1], load), load, predictor_of(memory))

    def restored(self, last: Equilibrium, load: float) -> State:
        """The state of the last equilibrium, at its load."""
        return restore(self.potential, last)

    def step(self) -> End | None:
        index, loads = len(self.found), self.request.loads
        if index == len(loads):
            return (Status.CONVERGED, "") if self.shortfall is None else (Status.ACCURACY_NOT_MET, str(self.shortfall))
        clock = time.perf_counter()
        try:
            with self.timed("solve"):
                state, turn = self.path.to(float(loads[index]), self.request.at_limit == "jump")
                if self.along is not None:
                    state = self._on_mesh_for(self.along, state)
            with self.timed("verdicts"):
                own, scene = self.own(state), self.scene_of(state)
                before = self.found[-1] if self.found and self.found[-1].state.size == own.x.size else None
                new = record_on_borders(scene, own, holding(self.control), before, clock, self.gas)
        except SolveError as error:
            return error.status, self._not_reached(index, str(error))
        if turn is not None:
            held = self.request.held.name
            self.jumps.append(Jump(index, self._limit(turn), new, held if held in CONTROLS else ""))
        self.found.append(new)
        if self.on_step is not None:
            self.on_step(index, len(loads), new)
        return self._slack(own) if new.status is Status.SLACK else None

    def _on_mesh_for(self, along: Along, state: State) -> State:
        """The state on another mesh where this one is nearly used up for it, or much too fine. The path goes on from there.

        Raises
        ------
        SolveError
            Where no mesh is good enough, or the state is lost on the way.
        """
        if not state.x.any():
            return state
        along = along.reached(self.found, state)
        scene = along.next_mesh(self.here, self.potential, state, along.share(self.potential, state), len(self.found))
        if scene is None:
            return state
        before, memory, load = self.potential, self.path.memory, self.path.load
        there = state_there(holding(self.control)(potential_of(scene), state))
        there.iterations += state.iterations
        self._stand_on(scene)
        self.path.go_on(there, load, carried_path(memory, before.space, self.potential.space))
        return there

    def _stand_on(self, scene: Scene) -> None:
        """Have the mesh of a scene from here on."""
        self.here, self.potential = scene, potential_of(scene)
        self.path = self.new_path()

    @property
    def control(self) -> Control:
        """What holds the state at hand, at its load."""
        return self.request.held.at(self.path.load)

    @property
    def gas(self) -> Gas | None:
        """The gas that holds the state at hand."""
        return self.request.held.at(self.path.load) if isinstance(self.request.held, Gas) else None

    def _slack(self, state: State) -> End | None:
        """The end at a slack membrane, which is no start for another load; a last one may be what was asked for."""
        index, message = len(self.found), str(slackness(state.evaluation.potential, state))
        if index < len(self.request.loads):
            return Status.SLACK, self._not_reached(index, message)
        return None if self.request.throw else (Status.SLACK, message)

    @property
    def words(self) -> str:
        """What the loads are, in words."""
        return self.request.held.words

    def _not_reached(self, index: int, why: str) -> str:
        load = float(self.request.loads[index])
        return f"{self.words} {load + 0.0:.9g}{self._in_si(load)} was not reached: {why}"

    def _in_si(self, load: float) -> str:
        """A load in SI units, in brackets; empty where the scene has no scales."""
        scales, kind = self.scene.scales, self.kind
        return f" ({readable_kind(kind, load, scales)})" if kind and scales is not None else ""

    @property
    def kind(self) -> str:
        """Kind of the loads, of those that have SI units."""
        return kind_of(self.request.held.name)

    def _limit(self, turn: Turn) -> SpecialPoint | None:
        if turn.fold is None:
            return None
        return special_point(self, self.scene_of(turn.fold.point.state).replace(analysis=type(self.scene.analysis)()), turn.fold)

    def _load_of(self, start: Equilibrium, state: State) -> float:
        """The load of a start as it was given; that of the state it was corrected to where the two differ, as in another scene."""
        held = self.request.held
        found = float(state.value_of(held))
        if not isinstance(held, ControlKind):
            return found
        given = float(getattr(start, held.name))
        return given if abs(found - given) <= 1e-9 * max(abs(given), self.potential.space.units[held.name]) else found

    def result(self, status: Status, message: str, found: Sequence[Equilibrium] | None = None) -> Branch:
        memory = None if found is None else remembered(self.path.memory, self.potential.space.n_free + 1)
        if memory is not None and self.along is not None:
            memory = replace(memory, sizes=self.along.sizes)
        known = tuple(self.found) if found is None else found
        return Branch(self.scene, known, status, message, dict(self.timings), None, memory, tuple(self.jumps), self.path.solver)
