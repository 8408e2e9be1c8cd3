"""A trace by arc length: what is asked, and how it is stepped."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Self, TypeAlias, cast

import numpy as np

from ..accuracy.along import Along
from ..accuracy.borders import Solve, holding
from ..checks import choice, is_number, number, sign, store
from ..discretization.meridian import in_words as accuracy_in_words
from ..discretization.space import transferred
from ..errors import InputError, SolveError, Status
from ..potential import Array, Potential, potential_of
from ..results.branch import Branch
from ..results.equilibrium import Equilibrium
from ..results.path_memory import TraceMemory
from ..results.special_point import SpecialPoint
from ..scene import ALL, Scene
from ..scene.run import GAS, HELD
from ..solve import state_resolution, wellposed
from ..solve.active_set import contact_events, folds_beside
from ..solve.bare import usual_volume
from ..solve.branch import BranchProblem, first_point, oriented_point
from ..solve.contact import Watch, stopped_by_source
from ..solve.continuation import BranchPoint, CurveProblem, Followed, StepControl, Tracer, trace_points
from ..solve.controls import CONTROLS, check_height
from ..solve.finer_space import met_across
from ..solve.segment import Located, Segment
from ..solve.special_points import branch_points, branches_crossing
from ..solve.start import start_at_volume
from ..solve.state import Predictor, State, at_rest
from ..solve.switching import Crossing, crossing_at, points_beyond, same_crossing
from ..solve.zone_events import ZoneEvent, zone_events
from ..stability.azimuthal import azimuthal_eigenvalue
from .arguments import check_ill_posed, check_max_steps
from .changed_mesh import carried_path, carried_point, goes_alike, state_there
from .meshing import carried
from .over_number import gas_of
from .running import End, Request, Run
from .state_records import OnStep, predictor_of, record, record_on_borders, remembered, restore, resume, special_point
from .targets import in_words, place_of, turned_back, value_in_words

#: distance from a value at which a trace ends, in units of the membrane, that is none
_AT_TARGET = 1e-9

#: most numbers of waves that are tried one after the other for the first onset of all
_MOST_WAVES = 20
if TYPE_CHECKING:
    from ..potential.contact import ContactPotential

#: first and smallest steps are shorter where a body is nearer to the membrane at rest than its size over this
_ROOM = 10.0

Start: TypeAlias = float | Equilibrium | SpecialPoint | Branch | None


@dataclass(frozen=True, eq=False)
class TraceRequest(Request):
    """A branch, or a part of it, followed by arc length.

    Attributes
    ----------
    start : float, Equilibrium, SpecialPoint, Branch or None
        Where it sets out: a volume, a state, a branch point whose other branch is meant, or a trace that is continued.
    targets : mapping of str to float
        Values at which it ends, whichever is met first.
    direction : {1, -1}
    max_steps : int
        Most steps.
    steps : StepControl
        Lengths and accuracy of the steps.
    special_points : bool
        Whether special points are located.
    ill_posed : {"stop", "mark"}
        What to do where the membrane is compressed or slack.
    """

    start: Start = None
    targets: Mapping[str, float] = field(default_factory=dict)
    direction: int = 1
    max_steps: int = 400
    steps: StepControl = field(default_factory=StepControl)
    special_points: bool = True
    ill_posed: str = "stop"

    @classmethod
    def checked(
        cls,
        start: Start,
        until: Mapping[str, float] | None,
        *,
        direction: int,
        max_steps: int,
        steps: StepControl | None,
        ill_posed: str,
        special_points: bool = False,
    ) -> Self:
        """The request that the arguments of :func:`femmembrane.trace` make, or InputError."""
        targets = checked_targets(until)
        direction = sign("direction", direction, "1 (towards larger volume) or -1 is allowed")
        check_ill_posed(ill_posed)
        check_max_steps(max_steps)
        return cls(start, targets, direction, int(max_steps), steps or StepControl(), special_points, ill_posed)

    @property
    def errors_at(self) -> str:
        return "arc-length"

    @property
    def mesh_changes(self) -> bool:
        return True

    @property
    def start_scene(self) -> Scene | None:
        if isinstance(self.start, SpecialPoint):
            return self.start.equilibrium.scene
        return self.start.scene if isinstance(self.start, Branch) else None

    def on(self, scene: Scene) -> Self:
        return replace(self, start=carried(self.start, scene))

    def trial(self) -> Self:
        if isinstance(self.start, SpecialPoint):
            raise InputError("start", self.start.kind, "a special point of a branch of this scene, on the mesh chosen for it, is allowed")
        return replace(self, special_points=False)

    def up_to(self, count: int) -> Self:
        return replace(self, max_steps=count - 1, targets={})

    def begin(self, scene: Scene, on_step: OnStep | None = None) -> TraceRun:
        clock, run = time.perf_counter(), self.prepared(scene, on_step)
        if isinstance(self.start, Branch):
            run.go_on(self.start)
            return run
        point = run.first(self.start)
        run.timings["setup"] = time.perf_counter() - clock
        run.set_out(point, clock)
        return run

    def prepared(self, scene: Scene, on_step: OnStep | None) -> TraceRun:
        """The run before it has a start."""
        return TraceRun(scene, self, on_step)

    def go_on(self, scene: Scene, unfinished: Branch, on_step: OnStep | None = None) -> TraceRun:
        run = replace(self, start=unfinished, direction=1).prepared(scene, on_step)
        run.go_on(unfinished)
        run.made = run.regular - 1
        run.timings |= unfinished.timings
        return run


def checked_targets(until: Mapping[str, float] | None) -> dict[str, float]:
    """The values at which a branch ends, by the names of their quantities, or InputError."""
    if until is not None and not isinstance(until, Mapping):
        raise InputError("until", until, "a mapping is allowed, such as {'center_height': 5.0}")
    targets = dict(until or {})
    for quantity, value in targets.items():
        choice("until", quantity, HELD)
        targets[quantity] = number(f"until.{quantity}", value)
    return targets


def _of_this_branch(point: SpecialPoint) -> Equilibrium:
    if point.kind == "azimuthal_onset":
        message = (
            f"the states that set in there have {point.azimuthal} wave(s) around the axis and are not computed here; fm.trace follows them "
            "without a number or a quantity held; branch points, folds and equilibria are allowed"
        )
        raise InputError("start", "azimuthal_onset", message)
    return point.equilibrium


def first_state(potential: Potential, start: Start) -> State:
    """The state at a volume, or of an equilibrium, from which a trace sets out."""
    if isinstance(start, SpecialPoint):
        start = _of_this_branch(start)
    if isinstance(start, Equilibrium):
        return resume(potential, start)
    if start is None:
        return start_at_volume(potential, usual_volume(potential))
    if not is_number(start):
        raise InputError("start", start, "a volume, an Equilibrium, a SpecialPoint or a traced Branch is allowed")
    volume = number("start", start, "a volume is allowed")
    if at_rest(potential, CONTROLS["volume"], volume):
        raise InputError(
            "start", start, "the flat unloaded membrane has no stiffness to start from; a small volume is allowed, such as 1e-3"
        )
    return start_at_volume(potential, volume)


class TraceRun(Run[Branch]):
    """A trace under way.

    Attributes
    ----------
    problem : CurveProblem
        The equations of the branch.
    tracer : Tracer
        The length of the next step, and the memory that predicts it.
    point : BranchPoint
        The last regular step.
    special : list of SpecialPoint or None
        The special points so far; None when none are looked for.
    regular : int
        Number of equilibria that are steps of the trace; one more may be the end point that was asked for.
    made : int
        Number of steps that were made.
    unexplained : list of str
        Changes of inertia at which no special point was located.
    """

    problem: CurveProblem[Any]
    point: BranchPoint

    def __init__(self, scene: Scene, request: TraceRequest, on_step: OnStep | None = None, potential: Potential | None = None) -> None:
        super().__init__(scene, potential or potential_of(scene), ("setup", "solve", "special_points", "verdicts"))
        if "center_height" in request.targets:
            check_height("until.center_height", self.potential)
        if GAS in request.targets:
            gas_of(scene, "until")
        self.request, self.on_step, self.problem = request, on_step, BranchProblem(self.potential)
        steps = request.steps
        if self.potential.obstacles:  # a body next to the membrane at rest leaves it that much room
            space, rest = self.potential.space, np.zeros(self.potential.space.n_free)
            room = min(1.0, _ROOM * cast("ContactPotential", self.potential).touching(rest) / space.unit)
            steps = replace(steps, first=steps.first * room, smallest=steps.smallest * room)
        self.tracer = Tracer(Predictor(), steps.first, steps)
        self.special: list[SpecialPoint] | None = [] if request.special_points else None
        self.regular = self.made = 0
        self.unexplained: list[str] = []
        self._points: Iterator[BranchPoint] | None = None
        self._crossing: Crossing | None = None
        self._sources = Watch()
        self._again = False
        self._known = {(scene.mesh, scene.degree): scene}

    # --- where it sets out

    def first(self, start: Start) -> BranchPoint:
        """The first point, of whatever start but a branch."""
        if isinstance(start, SpecialPoint) and start.kind == "branch_point":
            return self.switched(start)
        state = first_state(self.potential, start)
        state_resolution.refuse_unresolved(self.potential, state)
        return first_point(self.potential, state, self.request.direction)

    def set_out(self, point: BranchPoint, clock: float) -> None:
        """Stand at the first point of a branch, on which work began at a time."""
        self.point, self.regular = point, 1
        self._add(point, clock)

    def switched(self, start: SpecialPoint) -> BranchPoint:
        """The first point on half of the branch that crosses at a branch point."""
        if start.equilibrium.contact is not None and start.equilibrium.contact.touching:
            raise InputError("start", "branch_point", "branches are not switched in contact; an equilibrium or a volume is allowed")
        if start.tangent is None or start.tangent.shape != (self.potential.space.n_free + 1,):
            raise InputError("start", "branch_point", "one of the special_points of a branch of this scene is allowed")
        state = restore(self.potential, start.equilibrium)
        known = oriented_point(self.potential, state, 0.0, start.tangent)
        self._crossing = crossing_at(self.potential, known)
        self._points = points_beyond(self.potential, self._crossing, self.request.direction, self.tracer)
        return self._crossing.half(self.request.direction)

    def go_on(self, start: Branch) -> None:
        """Stand at the last regular step of a trace of this scene."""
        if self.request.direction != 1 or not self.continues(start):
            raise InputError("start", "a Branch", "a branch of this scene is allowed, to be continued the way it was going (direction=1)")
        memory = start.memory
        if not isinstance(memory, TraceMemory):
            raise InputError(
                "start", "a Branch without memory", "a whole Branch from fm.trace is allowed; give start=branch[-1] for others"
            )
        if memory.sizes is not None:
            self.along = Along.of(self.scene, self.request.errors_at, memory.sizes)
            self._stand_on(self.same(start[memory.regular - 1].scene))
        self.tracer.path, self.tracer.step, self.tracer.known = predictor_of(memory), memory.step, memory.known
        self.point = self.restored(start[memory.regular - 1], memory)
        # the scene of the start may differ in what changes no equilibrium, and all rows of a branch must have the same columns
        self.found = [eq.in_scene(self.same(eq.scene)) for eq in start[: memory.regular]]
        self.special = None
        if start.special_points is not None:
            self.special = [replace(p, equilibrium=p.equilibrium.in_scene(self.same(p.equilibrium.scene))) for p in start.special_points]
        self.regular, self.unexplained = memory.regular, list(memory.unexplained)

    def continues(self, start: Branch) -> bool:
        """Whether a branch may be continued: it is one of this scene."""
        return not start.over and potential_of(start.scene) is self.potential

    def restored(self, last: Equilibrium, memory: TraceMemory) -> BranchPoint:
        """The point of the last step."""
        return oriented_point(self.potential, restore(self.potential, last), memory.sigma[-1], memory.slopes[-1])

    def same(self, scene: Scene) -> Scene:
        """A scene of the branch that is continued, with the analyses of this one."""
        key = scene.mesh, scene.degree
        if key not in self._known:
            self._known[key] = self.scene.replace(mesh=scene.mesh, degree=scene.degree)
        return self._known[key]

    # --- how it is stepped

    def step(self) -> End | None:
        if self.made == self.request.max_steps:
            return self._all_made()
        self.made += 1
        try:
            return self._step()
        except SolveError as error:
            if error.status is Status.NOT_RESOLVED:
                return error.status, str(error)
            near = self.potential_at(self.point).distance_to_sources(self.point.state.x)
            return stopped_by_source(error, near, self.potential.space.unit) or (error.status, str(error))

    def _all_made(self) -> End:
        if self.shortfall is not None:
            return Status.ACCURACY_NOT_MET, str(self.shortfall)
        targets = self.request.targets
        message = f"{self.request.max_steps} steps were made without meeting {in_words(self.scene, targets)}"
        if away := self._went_away() or turned_back(self.scene, self.found, self.special or (), targets):
            message = f"{message}; {away}"
        return self._explained(Status.STEP_LIMIT, message)

    def _went_away(self) -> str:
        """Advice for a branch that left all values behind at which it was to end; empty where it did not."""
        request, known = self.request, not isinstance(self.request.start, Branch)
        ways = [(abs(place_of(eq, q) - v) for eq in (self.found[0], self.found[1], self.found[-1])) for q, v in request.targets.items()]
        if not (known and ways and all(first < second < last for first, second, last in ways)):
            return ""
        quantity, value = next(iter(request.targets.items()))
        words = CONTROLS[quantity].words if quantity in CONTROLS else quantity
        first = value_in_words(self.scene, quantity, place_of(self.found[0], quantity))
        begun = f"it set out from {words} {first}, away from {value_in_words(self.scene, quantity, value)}"
        return f"{begun}: direction = {-request.direction} sets out the other way"

    def _explained(self, status: Status, message: str) -> End:
        """An end, unless a special point that must have been passed was not located."""
        return (Status.UNEXPLAINED_INERTIA, "; ".join(self.unexplained)) if self.unexplained else (status, message)

    def _step(self) -> End | None:
        clock = time.perf_counter()
        if self._points is None:
            if (end := self._ill_posed(self.point)) is not None:  # continued from where it had ended
                return end
            self._points = trace_points(self.problem, self.point, self.tracer)
        before = None if self.along is None or self._again else replace(self.tracer, path=replace(self.tracer.path))
        with self.timed("solve"):
            new = next(self._points)
        segment = Segment(self.problem, self.point, new, leaving=self._crossing is not None and len(self.found) == 1)
        met = [point for q, v in self.request.targets.items() for point in segment.crossings(self.quantity(q), v)]
        last = min(met, key=lambda p: p.sigma, default=None)
        unresolved = state_resolution.unresolved(self.potential_at(last or new), self.own((last or new).state))
        share = self._share(last or new, bool(unresolved))
        if self.along is not None and before is not None and share > self.along.most:
            return self._step_again(self.along, before, last or new, share)
        if unresolved:
            return Status.NOT_RESOLVED, f"at {self.place(last or new)} {unresolved}"
        if self.along is not None and share > self.along.most:
            return self._not_met(f"the error is {share:.1f} times as large, on the mesh that was chosen for it")
        self._again = False
        closing = self._look_for_special_points(segment, last)
        last = closing or last
        self._add(last or new, clock)
        self._look_for_onsets(segment, last or new)
        if closing is not None:
            return Status.CLOSED, f"the branch came back to {self.origin(closing)} at which it set out"
        if last is not None and not wellposed.unresolved_source(self.potential_at(last), last.state.x):
            return self._explained(Status.CONVERGED, "")
        self.point, self.regular = new, len(self.found)
        if (end := self._ill_posed(new) or self._at_source(new) or self.at_bound(new)) is None and self.along is not None:
            self._change_mesh(self.along, share)
        return end

    # --- on which mesh

    def _share(self, point: BranchPoint, unresolved: bool) -> float:
        """The estimated error of a point over the accuracy that is asked for, where the mesh may change for it."""
        if self.along is None:
            return 0.0
        with self.timed("mesh"):
            return np.inf if unresolved else self.along.reached(self.found, point.state).share(self.potential, point.state)

    def _step_again(self, along: Along, before: Tracer, beyond: BranchPoint, share: float) -> End | None:
        """Stand where the step set out, on a mesh for the point that it led to; the end where there is none."""
        try:
            scene = along.reached(self.found, beyond.state).mesh_for(self.here, self.potential, beyond.state, share)
            self.tracer, self._again = before, True
            self._go_over(scene)
        except SolveError as error:
            return self._not_met(str(error))
        self.made -= 1
        return None

    def _not_met(self, why: str) -> End:
        """The end where no mesh keeps the accuracy."""
        state = self.point.state
        asked = accuracy_in_words(getattr(self.here.mesh, "accuracy", None) or 0.0)
        kept = f"it is kept up to V = {state.volume:.6g}, P = {state.pressure:.6g}; at the next equilibrium {why}"
        return Status.ACCURACY_NOT_MET, f"mesh.accuracy = {asked} is not met all along: {kept}"

    def _change_mesh(self, along: Along, share: float) -> None:
        """Another mesh for the steps to come, where this one is nearly used up or much too fine; the same one where there is none."""
        along = along.reached(self.found, self.point.state)
        with self.timed("mesh"), contextlib.suppress(SolveError):
            scene = along.next_mesh(self.here, self.potential, self.point.state, share, self.regular)
            if scene is not None:
                self._go_over(scene, alike=True)

    def _go_over(self, scene: Scene, *, alike: bool = False) -> None:
        """Stand at the last point on another mesh, whose record takes the place of the one before; where a fold lies between the two and
        they are to be alike, on the same mesh as before."""
        onto = potential_of(scene)
        state = state_there(self.solve(self.point)(onto, self.point.state))
        point = carried_point(self.point, state, self.potential, onto)
        if alike and not goes_alike(self.point, point, list(self.problem.folds.values())):
            return
        path = carried_path(self.tracer.path, self.potential.space, onto.space)
        path.point[-1:], path.slope[-1:] = [point.z], [point.tangent]
        self.tracer.path, self.tracer.known = path, point.state.correction
        self._stand_on(scene)
        self.point, self._points = point, None
        state.iterations += self.found[-1].iterations
        new = record(scene, onto, state)
        store(new, seconds=self.found[-1].seconds)
        self.found = [*self.found[:-1], new]  # another list: a checkpoint that was taken keeps the one before

    def _stand_on(self, scene: Scene) -> None:
        """Have the mesh of a scene from here on."""
        self.here, self.potential = scene, potential_of(scene)
        self._known.setdefault((scene.mesh, scene.degree), scene)
        self.problem = BranchProblem(self.potential)

    def quantity(self, name: str) -> Followed:
        """The quantity of the curve that a target names."""
        return gas_of(self.scene, "until") if name == GAS else name

    def potential_at(self, point: BranchPoint) -> Potential:
        """The potential of the scene of a point."""
        return self.potential

    def origin(self, point: BranchPoint) -> str:
        """Where a closed branch set out, in words."""
        return f"the branch point V = {point.state.volume:.6g}"

    def at_bound(self, point: BranchPoint) -> End | None:
        """The end at a point beyond which there is no scene."""
        return None

    def _ill_posed(self, point: BranchPoint) -> End | None:
        if self.request.ill_posed != "stop":
            return None
        bad = wellposed.ill_posed(self.potential_at(point), self.own(point.state).evaluation)
        if bad is None:
            return None
        return bad.status, f"at {self.place(point)} {bad}, and what a mesh finds beyond depends on the mesh"

    def _at_source(self, point: BranchPoint) -> End | None:
        state, potential = point.state, self.potential_at(point)
        if unresolved := wellposed.unresolved_source(potential, state.x):
            return Status.DIPOLE_CONTACT, f"{unresolved} (V = {state.volume:.6g})"
        if touching := self._sources.touches(potential, state.x):
            return Status.DIPOLE_CONTACT, f"{touching} at V = {state.volume:.6g}"
        return None

    def place(self, point: BranchPoint) -> str:
        """Where a point is, for messages."""
        height = self.potential.space.center_height(point.state.x)
        return f"pole height {height:.4g} (V = {point.state.volume:.6g}, P = {point.state.pressure + 0.0:.6g})"

    def solve(self, point: BranchPoint) -> Solve:
        """What finds a point on other elements: the plane across the branch, or the value at which the branch is to end."""
        for name, value in self.request.targets.items():
            unit = self.potential.space.units.get(name, 0.0)
            if name in CONTROLS and abs(float(point.state.value_of(CONTROLS[name])) - value) <= _AT_TARGET * unit:
                return holding(CONTROLS[name].at(value))
        potential = self.potential_at(point)
        return lambda onto, _: met_across(onto, potential, point)

    def _add(self, point: BranchPoint, clock: float) -> None:
        with self.timed("verdicts"):
            scene, state = self.scene_of(point.state), self.own(point.state)
            solve: Solve = lambda onto, found: self.solve(point)(onto, found)  # noqa: E731  # hardly ever asked for
            new = record_on_borders(scene, state, solve, self.found[-1] if self.found else None, clock)
        self.found.append(new)
        if self.on_step is not None:
            self.on_step(len(self.found) - 1, self.request.max_steps + 1, new)

    # --- what it looks for on the way

    def _look_for_special_points(self, segment: Segment[BranchPoint], last: BranchPoint | None) -> BranchPoint | None:
        """Keep the special points before the end of the trace; the branch point at which it set out, if it comes back to that."""
        if self.special is None:
            return None
        with self.timed("special_points"):
            events = contact_events(segment)
            located = [fold for kind in self.problem.folds for fold in folds_beside(segment, kind, events)]
            crossed = self.crossed(segment)
            located += [*crossed, *events, *self._zone_events(segment)]
            for fold in sorted(located, key=lambda f: f.point.sigma):
                if last is None or fold.point.sigma <= last.sigma:
                    self.special.append(self._special(fold))
            return self.closing(segment, crossed, last)

    def _zone_events(self, segment: Segment[BranchPoint]) -> list[ZoneEvent]:
        """Where zones of a tension field open or close."""
        return zone_events(segment, self.own) if self.scene.tension_field else []

    def closing(self, segment: Segment[Any], crossed: Sequence[Located[Any]], last: BranchPoint | None) -> BranchPoint | None:
        """The point at which the branch comes back to where it set out, if it does so before the end of the trace."""
        return next((found.point for found in crossed if self._back(found.point, last)), None)

    def crossed(self, segment: Segment[BranchPoint]) -> list[Located[BranchPoint]]:
        """The branch points on a segment; that one is missing is noted."""
        number = branches_crossing(segment)
        crossed = branch_points(segment) if number else []
        if len(crossed) < number:
            a, b = segment.a.state, segment.b.state
            self.unexplained.append(f"the inertia changes between V = {a.volume:.6g} and {b.volume:.6g} without a located point")
        return crossed

    def _back(self, point: BranchPoint, last: BranchPoint | None) -> bool:
        """Whether a branch point before the end of the trace is the one at which it set out."""
        if len(self.found) < 3 or (last is not None and last.sigma < point.sigma):
            return False
        first = self.found[0]
        at_first = first.state if first.scene is self.here else transferred(first.potential.space, first.state, self.potential.space)
        return same_crossing(self.potential, at_first, point.state.x)

    def _look_for_onsets(self, segment: Segment[BranchPoint], end: BranchPoint) -> None:
        """Where the smallest eigenvalue for n waves, known at both ends, passes zero."""
        if self.special is None:
            return
        before, after = self.found[-2:]
        top = (end.sigma - segment.a.sigma) / segment.length
        for n in self.scene.analysis.azimuthal_modes:
            if n == ALL:
                self.special += self._worst_onset(segment, top)
                continue
            verdict = before.verdict(azimuthal=n)
            if verdict.smallest_eigenvalue * after.verdict(azimuthal=n).smallest_eigenvalue < 0:  # False where either is NaN (short-wave)
                with self.timed("special_points"):
                    self.special.append(self._onset(segment, int(n), 0.0, top, verdict.coefficients))

    def _onset(self, segment: Segment[BranchPoint], n: int, low: float, top: float, guess: Array | None = None) -> SpecialPoint:
        def eigenvalue(point: BranchPoint) -> float:
            potential, own = self.potential_at(point), point.state.evaluation
            if potential.follows:
                potential = own.potential
            return azimuthal_eigenvalue(potential, own.x, point.state.pressure, n, guess).value

        return self._special(segment.root("azimuthal_onset", eigenvalue, low, top), n)

    def _worst_onset(self, segment: Segment[BranchPoint], top: float) -> list[SpecialPoint]:
        """The point, if any, where the first of all numbers of waves loses stability, or the last regains it.

        The number that is the worst at the unstable end has an onset. Where another number is unstable at that onset, its own lies nearer
        to the stable end, and takes its place.
        """
        ends = [equilibrium.verdict(azimuthal=ALL) for equilibrium in self.found[-2:]]
        if not ends[0].smallest_eigenvalue * ends[1].smallest_eigenvalue < 0:  # False where either is NaN
            return []
        n = next(verdict.azimuthal for verdict in ends if verdict.smallest_eigenvalue < 0)
        with self.timed("special_points"):
            point = self._onset(segment, n, 0.0, top)
            for _ in range(_MOST_WAVES):
                worst = point.equilibrium.verdict(azimuthal=ALL)
                if worst.azimuthal == n or not worst.smallest_eigenvalue < 0 or worst.stable is None:
                    break
                n = worst.azimuthal
                point = self._onset(segment, n, 0.0, top)
        return [point]

    def _special(self, fold: Located[BranchPoint], azimuthal: int = 0) -> SpecialPoint:
        return special_point(self, self.scene_of(fold.point.state), fold, azimuthal)

    def result(self, status: Status, message: str, found: Sequence[Equilibrium] | None = None) -> Branch:
        path = remembered(self.tracer.path, len(self.point.z))
        memory = TraceMemory(
            path.sigma,
            path.points,
            path.slopes,
            self.tracer.step,
            self.regular,
            tuple(self.unexplained),
            self.tracer.known,
            sizes=None if self.along is None else self.along.sizes,
        )
        special = None if self.special is None else tuple(self.special)
        known = tuple(self.found) if found is None else found
        return Branch(self.scene, known, status, message, dict(self.timings), special, memory, solver="newton")
