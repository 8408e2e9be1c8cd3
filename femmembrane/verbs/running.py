"""The way of a verb: what is asked, the mesh, and a run that is stepped until it ends.

A verb checks its arguments into a frozen :class:`Request`. Where the scene leaves its mesh open, :func:`.meshing.on_chosen_mesh` chooses
one for the request. :func:`carry_out` then begins a :class:`Run` and steps it to its end. A trial on another mesh, and a run that goes on
where it was interrupted, are the same object with the same steps.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Generic, Self, TypeAlias, TypeVar

from ..errors import Status
from ..potential import Potential
from ..results.branch import Branch, SoFar
from ..results.equilibrium import Equilibrium
from ..scene import Scene
from ..solve.state import State
from .state_records import OnCheckpoint, OnStep

if TYPE_CHECKING:
    from ..accuracy.along import Along, Shortfall
    from .meshing import Chosen

#: the record of a run
R = TypeVar("R")
#: status of a run that ends, and a message unless it ends where it was to
End: TypeAlias = tuple[Status, str]


class Request(ABC):
    """What is asked of a scene, on whichever mesh."""

    @property
    @abstractmethod
    def errors_at(self) -> str:
        """What is held while errors are estimated: volume, center_height, or arc-length."""

    @property
    def mesh_changes(self) -> bool:
        """Whether the mesh may change along the run."""
        return False

    @property
    def start_scene(self) -> Scene | None:
        """The scene whose mesh the request is tied to; None where it starts on any."""
        return None

    @abstractmethod
    def on(self, scene: Scene) -> Self:
        """The request with its start carried over to the mesh of a scene."""

    @abstractmethod
    def trial(self) -> Self:
        """What stands for the request when a mesh is tried."""

    def covers(self, whole: Request) -> bool:
        """Whether this request, which stands for another one in trials, has all of its equilibria."""
        return True

    @abstractmethod
    def up_to(self, count: int) -> Self:
        """The part of the request that ends with one of the equilibria of its trial, counted from 1."""

    @abstractmethod
    def begin(self, scene: Scene, on_step: OnStep | None = None) -> Run[Branch]:
        """The run at its start."""

    @abstractmethod
    def go_on(self, scene: Scene, unfinished: Branch, on_step: OnStep | None = None) -> Run[Branch]:
        """The run where it was interrupted."""


class Run(ABC, Generic[R]):
    """A verb under way. It owns what was found, and is stepped until it ends.

    Attributes
    ----------
    scene, potential : Scene, Potential
    found : list of Equilibrium
    timings : dict of str to float
        Seconds by stage.
    shortfall : Shortfall or None
        Where the accuracy ends that the mesh was chosen for; the run was asked to go no further.
    along : Along or None
        What changes the mesh along the run; None for a run on one mesh.
    here : Scene
        The scene on the mesh that the run stands on. ``scene`` has the first mesh.
    """

    def __init__(self, scene: Scene, potential: Potential, stages: tuple[str, ...]) -> None:
        self.scene, self.potential, self.here = scene, potential, scene
        self.found: list[Equilibrium] = []
        self.timings = dict.fromkeys(stages, 0.0)
        self.shortfall: Shortfall | None = None
        self.along: Along | None = None

    @property
    def over(self) -> str:
        """Name of the number of the scene that changes; empty where none does."""
        return ""

    def own(self, state: State) -> State:
        """A state of the solver as one of its own scene."""
        return state

    def scene_of(self, state: State) -> Scene:
        """The scene of a state."""
        own = state.evaluation.potential
        return self.scene.bordered(own.scene.borders) if own.follows else self.here

    @abstractmethod
    def step(self) -> End | None:
        """One step: None to go on, else how the run ended. What was found before a failure is kept."""

    @abstractmethod
    def result(self, status: Status, message: str, found: Sequence[Equilibrium] | None = None) -> R:
        """The record of the run with all equilibria, or with some while it is under way."""

    def follow(self, on_checkpoint: Callable[[R], None] | None = None) -> R:
        """Step to the end; the record of the run."""
        while (end := self.step()) is None:
            if on_checkpoint is not None:
                on_checkpoint(self.result(Status.INTERRUPTED, "interrupted", SoFar(self.found)))
        return self.result(*end)

    def timed(self, stage: str) -> Timed:
        """Add the seconds of a block to a stage."""
        return Timed(self.timings, stage)


class Timed:
    """A block of which the seconds are added to those of a stage."""

    __slots__ = ("_clock", "_stage", "_timings")

    def __init__(self, timings: dict[str, float], stage: str) -> None:
        self._timings, self._stage = timings, stage

    def __enter__(self) -> None:
        self._clock = time.perf_counter()

    def __exit__(self, *error: object) -> None:
        self._timings[self._stage] = self._timings.get(self._stage, 0.0) + time.perf_counter() - self._clock


def carry_out(
    chosen: Chosen, *, on_step: OnStep | None = None, on_checkpoint: OnCheckpoint | None = None, unfinished: Branch | None = None
) -> Branch:
    """Begin the run that is asked for and step it to its end.

    Parameters
    ----------
    chosen : Chosen
        The scene on its mesh, and what is asked of it.
    on_step : callable, optional
        Called with (index, total, equilibrium) after each equilibrium.
    on_checkpoint : callable, optional
        Called after each step with the branch so far.
    unfinished : Branch, optional
        The run where it was interrupted: it goes on from there.

    Raises
    ------
    InputError, SolveError
        The latter for a start that is no equilibrium. Later failures end the run, and the branch carries their status and message.
    """
    scene, request = chosen.scene, chosen.request
    run = request.begin(scene, on_step) if unfinished is None else request.go_on(scene, unfinished, on_step)
    run.timings, run.shortfall = {**chosen.timings, **run.timings}, chosen.shortfall
    run.along = chosen.along or run.along
    return run.follow(on_checkpoint)
