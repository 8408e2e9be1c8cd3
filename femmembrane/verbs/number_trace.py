"""A trace by arc length over a number of the scene, while a quantity is held."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from ..accuracy.borders import Solve, holding
from ..checks import choice, number, sign
from ..errors import InputError, Status
from ..potential import potential_of
from ..results.branch import Branch
from ..results.equilibrium import Equilibrium
from ..results.path_memory import TraceMemory
from ..results.special_point import SpecialPoint
from ..scene import Scene
from ..scene.run import GAS
from ..solve import state_resolution
from ..solve.continuation import BranchPoint, Followed, StepControl
from ..solve.controls import CONTROLS, check_height, is_held
from ..solve.load_path import LoadPath
from ..solve.number_curve import NUMBER, Borders, ControlledProblem, NumberPoint, first_controlled
from ..solve.segment import Located, Segment
from ..solve.special_points import branch_point
from ..solve.state import State
from .arguments import check_ill_posed, check_max_steps
from .over_number import AT_REST, Hold, OverNumber, checked_number, family_of, gas_of
from .running import End
from .state_records import OnStep, restore
from .trace_run import Start, TraceRequest, TraceRun, first_state

#: movement per change of the number by its scale, in units of the membrane, below which the number has lost its influence; the stiffness of
#: a flat membrane vanishes with its displacements, and not far beyond their rates are round-off
_IDLE = 1e-6


@dataclass(frozen=True, eq=False)
class NumberTraceRequest(TraceRequest):
    """A branch over a number, followed by arc length.

    Attributes
    ----------
    over : str
        Name of the number.
    hold : Hold
        What is held.
    """

    over: str = ""
    hold: Hold = AT_REST

    @classmethod
    def over_number(
        cls,
        scene: Scene,
        start: Start,
        until: Mapping[str, float] | None,
        *,
        over: Any,
        hold: Any,
        direction: int | None = None,
        max_steps: int = 400,
        steps: StepControl | None = None,
        ill_posed: str = "stop",
        special_points: bool = True,
    ) -> Self:
        """The request that the arguments of :func:`femmembrane.trace` make, or InputError."""
        parameter = checked_number("over", scene, over)
        held = Hold.checked(hold, parameter.name)
        targets = _checked_targets(until, parameter.name, held)
        aim = targets.get(parameter.name, parameter.value)
        if direction is None:
            direction = -1 if aim < parameter.value and not isinstance(start, Branch) else 1
        direction = sign("direction", direction, f"1 (towards larger {parameter.name}) or -1 is allowed")
        check_ill_posed(ill_posed)
        check_max_steps(max_steps)
        if aim == parameter.value == 0:
            raise InputError("until", until, f"{parameter.name} is 0 at the start, and nothing says how far it goes; give a value of it")
        control = steps or StepControl()
        return cls(start, targets, direction, int(max_steps), control, special_points, ill_posed, over=parameter.name, hold=held)

    @property
    def mesh_changes(self) -> bool:
        return False

    @property
    def start_scene(self) -> Scene | None:
        """That of whatever start: its mesh may have been chosen already."""
        return self.start.scene if isinstance(self.start, Equilibrium) else super().start_scene

    def prepared(self, scene: Scene, on_step: OnStep | None) -> TraceRun:
        return NumberTraceRun(scene, self, on_step)


def _checked_targets(until: Mapping[str, float] | None, over: str, hold: Hold) -> dict[str, float]:
    if until is not None and not isinstance(until, Mapping):
        raise InputError("until", until, f"a mapping is allowed, such as {{'{over}': 5.0}}")
    targets = dict(until or {})
    for quantity, value in targets.items():
        if quantity == hold.name:
            raise InputError("until", quantity, "it is held, and never changes")
        choice("until", quantity, [over, *(name for name in (*CONTROLS, GAS) if name != hold.name)])
        targets[quantity] = number(f"until.{quantity}", value)
    return targets


class NumberTraceRun(OverNumber, TraceRun):
    """A trace over a number under way."""

    problem: ControlledProblem
    request: NumberTraceRequest

    def __init__(self, scene: Scene, request: NumberTraceRequest, on_step: OnStep | None = None) -> None:
        self.parameter = checked_number("over", scene, request.over)
        self.family = family_of(self.parameter)
        super().__init__(scene, request, on_step, self.family)
        if request.hold.name == "center_height":
            check_height("hold.center_height", self.potential)
        value = self.parameter.value
        aim = request.targets.get(request.over, value)
        # the number in units of the way that it is to go, or of its own size
        self.problem = ControlledProblem(self.family, request.hold.control(scene), abs(aim - value) or abs(value))

    # --- where it sets out

    def first(self, start: Start) -> BranchPoint:
        state, value = self._held(start), self.parameter.value
        state_resolution.refuse_unresolved(state.evaluation.potential, state)
        point = first_controlled(self.problem, state.x, state.pressure, value, self.request.direction)
        self.refuse_idle(point.state)
        return point

    def _held(self, start: Start) -> State:
        """The state of the scene at the start of the number, under the held control."""
        potential, hold = potential_of(self.scene), self.request.hold
        if start is None:
            return LoadPath(potential, hold.controlled(self.scene), "ipopt").to(hold.value, False)[0]
        if isinstance(start, SpecialPoint):
            start = start.equilibrium
        state = first_state(potential, start)
        path = LoadPath(potential, hold.controlled(self.scene), "newton")
        if is_held(path.held, state.value_of(path.held), hold.value, potential.space):
            return state
        path.set_out(state, state.value_of(path.held))
        return path.to(hold.value, False)[0]

    def continues(self, start: Branch) -> bool:
        hold = {self.request.hold.name: self.request.hold.value}
        return start.over == self.request.over and start.hold == hold and potential_of(start.scene) is potential_of(self.scene)

    def restored(self, last: Equilibrium, memory: TraceMemory) -> BranchPoint:
        if memory.border is None:
            raise InputError(
                "start", "a Branch without memory", "a whole Branch from fm.trace is allowed; give start=branch[-1] for others"
            )
        z, tangent = memory.points[-1], memory.slopes[-1]
        state = restore(self.family, last, float(z[-1]))
        borders = Borders(memory.border, memory.border, 0.0)
        point = NumberPoint(state, z, tangent, self.problem.dual(tangent), memory.sigma[-1], borders)
        self._moved = self._movement(point)
        return point

    def same(self, scene: Scene) -> Scene:
        return scene.replace(analysis=self.scene.analysis, run=self.scene.run, title=self.scene.title)

    # --- how it is stepped

    def quantity(self, name: str) -> Followed:
        if name == GAS:
            return replace(self.request.hold, name=GAS).controlled(self.scene)
        return NUMBER if name == self.request.over else name

    def solve(self, point: BranchPoint) -> Solve:
        scene = self.scene_of(point.state)  # whose chamber may be what changes
        hold = self.request.hold
        return holding(CONTROLS[hold.name].at(hold.value) if hold.name in CONTROLS else gas_of(scene, "hold").at(hold.value))

    def place(self, point: BranchPoint) -> str:
        state = point.state
        return f"{self.request.over} = {state.evaluation.factor:.6g} (V = {state.volume:.6g}, P = {state.pressure + 0.0:.6g})"

    def origin(self, point: BranchPoint) -> str:
        return f"{self.request.over} = {self.parameter.value:.6g}"

    def at_bound(self, point: BranchPoint) -> End | None:
        if point.z[-1] not in self.problem.bounds:
            return self._idle(point)
        return Status.NO_EQUILIBRIUM, f"{self.request.over} = {point.z[-1]:.9g} is the last value that this scene can take"

    def _idle(self, point: BranchPoint) -> End | None:
        """The end where two steps one after the other have hardly moved the membrane, and none that are left lead to what is asked for."""
        before, self._moved = self._moved, self._movement(point)
        if NUMBER in map(self.quantity, self.request.targets) or not self._moved < before < _IDLE or self._ahead(point):
            return None
        back = -1 if point.tangent[-1] > 0 else 1
        message = f"at {self.place(point)} the number has no influence any more: the membrane comes to rest; try direction={back}"
        return Status.NO_EQUILIBRIUM, message

    def _ahead(self, point: BranchPoint) -> bool:
        """Whether a target is met by the steps that are left if the membrane goes on as it does."""
        way = (self.request.max_steps - self.made) * self.tracer.step
        for name, target in self.request.targets.items():
            quantity = self.quantity(name)
            rate = point.rate(quantity)
            if 0 < (target - point.value(quantity)) * rate < rate * rate * way:
                return True
        return False

    def _movement(self, point: BranchPoint) -> float:
        """How far the membrane and its pressure move with arc length."""
        moved = point.tangent.copy()
        moved[-1] = 0.0
        return self.problem.norm(moved)

    #: the movement at the last point
    _moved: float = np.inf

    # --- what it looks for on the way

    def crossed(self, segment: Segment[Any]) -> list[Located[Any]]:
        found = branch_point(segment)
        return [] if found is None else [found]

    def closing(self, segment: Segment[Any], crossed: Sequence[Located[Any]], last: BranchPoint | None) -> BranchPoint | None:
        """Where the branch closes on itself, as an island of equilibria does."""
        return segment.b if last is None and self._first is not None and segment.passes(self._first) else None

    def set_out(self, point: BranchPoint, clock: float) -> None:
        self._first, self._moved = point, self._movement(point)
        super().set_out(point, clock)

    _first: BranchPoint | None = None

    # --- the record

    def result(self, status: Status, message: str, found: Sequence[Equilibrium] | None = None) -> Branch:
        branch, hold = super().result(status, message, found), self.request.hold
        memory = branch.memory
        if isinstance(memory, TraceMemory) and isinstance(self.point, NumberPoint):
            memory = replace(memory, border=self.point.borders.deflation)
        return replace(branch, over=self.request.over, hold={hold.name: hold.value}, memory=memory)
