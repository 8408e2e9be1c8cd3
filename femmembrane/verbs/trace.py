"""Whole branches by arc length, with their special points."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from ..checks import choice, is_number, number, sign
from ..errors import InputError, SolveError, Status
from ..potential import Array, Potential, potential_of
from ..quantities import PLACES
from ..results.records import Branch, Equilibrium, SoFar, SpecialPoint, TraceMemory
from ..scene import Scene
from ..solve import state_resolution, wellposed
from ..solve.continuation import BranchPoint, StepControl, Tracer, first_point, oriented_point, trace_points
from ..solve.special_points import FOLDS, Located, Segment, branch_points, branches_crossing
from ..solve.start import CONTACT, moderate, start_at_volume
from ..solve.state import Predictor, at_rest
from ..solve.switching import Crossing, crossing_at, points_beyond, same_crossing
from ..stability.azimuthal import azimuthal_eigenvalue
from ..threads import one_thread
from .arguments import check_height, check_ill_posed, check_max_steps
from .meshing import on_chosen_mesh
from .state_records import OnCheckpoint, OnStep, predictor_of, record, remembered, restore, resume, special_point

if TYPE_CHECKING:
    from ..accuracy.adapt import Shortfall


@one_thread
def trace(
    scene: Scene,
    *,
    start: float | Equilibrium | SpecialPoint | Branch | None = None,
    until: Mapping[str, float] | None = None,
    direction: int = 1,
    max_steps: int = 400,
    steps: StepControl | None = None,
    special_points: bool = True,
    ill_posed: str = "stop",
    throw: bool = False,
    on_step: OnStep | None = None,
    on_checkpoint: OnCheckpoint | None = None,
) -> Branch:
    """Follow a branch by arc length, stable or not, through limit points and folds.

    Parameters
    ----------
    scene : Scene
    start : float, Equilibrium, SpecialPoint or Branch, optional
        A volume (default that of the moderately inflated membrane: that at rest and 0.5, or an eighth of it), an equilibrium of this scene,
        or a traced branch to be continued (its points are part of the result, and the new ones are those of an uninterrupted trace to
        the last bit; it keeps its own direction, step and search for special points). From a branch point (of the ``special_points`` of
        a branch of this scene) the *other* branch that crosses there is traced, one half of it: ``fm.trace(scene, start=point)``. From
        another special point that is an equilibrium of this branch the trace sets out as from that equilibrium.
    until : mapping, optional
        Where to end: values of any of volume, pressure, center_height, whichever is met first; the last point lies exactly on it. The
        start itself does not count, and what lies behind it is met, if at all, on a distant part of the branch: see ``direction``.
    direction : {1, -1}
        1 sets out towards larger volume. From a branch point it names the half of the other branch: 1 that on which the volume grows,
        or where it is stationary, as on both halves of a pitchfork, that on which the pole rises (with the pole held, the membrane).
    max_steps : int
    steps : StepControl, optional
        Lengths and accuracy of the steps.
    special_points : bool
        Locate limit points, volume folds, height folds and branch points.
    ill_posed : {"stop", "mark"}
        What to do where the meridional stress is compressive, so that the Legendre-Hadamard condition fails and the plain membrane
        has no mesh-independent equilibria, or where a tension field is slack: end there, or go on with that status on every such state.
    throw : bool
        Raise when the branch ends before ``until`` is met. A branch that ends is a result, so by default it is returned, with the
        reason in its status and message.
    on_step : callable, optional
        Called with (index, total, equilibrium) after each step.
    on_checkpoint : callable, optional
        Called after each step with the branch so far, which may be saved and later given as ``start``.

    Returns
    -------
    Branch

    Raises
    ------
    InputError, SolveError
        The former also for an azimuthal onset as start: the states beyond it are not axisymmetric, and are not computed. The latter when
        the start cannot be reached or no mesh meets the accuracy that the scene asks for, and for ``throw``: then it
        carries the branch as ``result``.
    """
    targets = _targets(until)
    scene, start, timings, shortfall = _on_mesh(scene, start, until, direction, max_steps, steps, ill_posed)
    tracing = _begin(scene, start, direction, steps, special_points, on_step, max_steps, ill_posed)
    if "center_height" in targets:
        check_height("until.center_height", tracing.potential)
    tracing.timings |= timings
    if shortfall is not None:
        tracing.max_steps, targets = shortfall.kept - 1, {}
    status, message = tracing.follow(targets, ill_posed, on_checkpoint)
    if shortfall is not None:
        status, message = Status.ACCURACY_NOT_MET, str(shortfall)
    branch = tracing.branch(status, message)
    if throw and message and (until is not None or status is not Status.STEP_LIMIT):
        raise SolveError(message, status=status, result=branch)
    return branch


@one_thread
def resume_trace(
    scene: Scene,
    kept: Branch,
    *,
    until: Mapping[str, float] | None,
    max_steps: int,
    on_step: OnStep | None,
    on_checkpoint: OnCheckpoint | None,
) -> Branch:
    """Finish the trace of this scene that was interrupted: the branch, status and message of one that was not."""
    tracing = _begin(scene, kept, 1, None, True, on_step, max_steps, "stop")
    tracing.made = tracing.regular - 1
    tracing.timings |= kept.timings
    return tracing.branch(*tracing.follow(_targets(until), "stop", on_checkpoint))


def _on_mesh(
    scene: Scene,
    start: float | Equilibrium | SpecialPoint | Branch | None,
    until: Mapping[str, float] | None,
    direction: int,
    max_steps: int,
    steps: StepControl | None,
    ill_posed: str,
) -> tuple[Scene, float | Equilibrium | SpecialPoint | Branch | None, dict[str, float], Shortfall | None]:
    """The scene with a mesh, the start on it, the seconds that took and where the accuracy ends.

    A branch that is continued keeps the mesh chosen for it.
    """
    kept = start.equilibrium.scene if isinstance(start, SpecialPoint) else start.scene if isinstance(start, Branch) else None
    if kept is not None and scene.open and getattr(kept.mesh, "accuracy", None) == getattr(scene.mesh, "accuracy", None):
        return scene.replace(mesh=kept.mesh, degree=kept.degree), start, {}, None

    def follow(trial: Scene, begin: Equilibrium | None) -> Branch:
        first = start if begin is None else begin
        return trace(
            trial,
            start=first,
            until=until,
            direction=direction,
            max_steps=max_steps,
            steps=steps,
            special_points=False,
            ill_posed=ill_posed,
        )

    if isinstance(start, SpecialPoint) and scene.open:
        raise InputError("start", start.kind, "a special point of a branch of this scene, on the mesh chosen for it, is allowed")
    begin = start if isinstance(start, Equilibrium) else None
    chosen, begin, timings, shortfall = on_chosen_mesh(scene, begin, follow, "arc-length")
    return chosen, start if begin is None else begin, timings, shortfall


def trace_iter(
    scene: Scene,
    *,
    start: float | Equilibrium | SpecialPoint | None = None,
    direction: int = 1,
    max_steps: int = 400,
    steps: StepControl | None = None,
    ill_posed: str = "stop",
) -> Iterator[Equilibrium]:
    """The equilibria of :func:`trace` one by one, as they are found: a loop may look at each and stop when it likes.

    The iterator ends where the branch does, or after ``max_steps``; special points are not located.
    """
    tracing = _begin(scene, start, direction, steps, False, None, max_steps, ill_posed)
    yield tracing.found[0]
    advance, known = one_thread(tracing.advance), 1
    end = None
    while end is None:
        end = advance({}, ill_posed)
        if len(tracing.found) > known:
            known = len(tracing.found)
            yield tracing.found[-1]


@one_thread
def _begin(
    scene: Scene,
    start: float | Equilibrium | SpecialPoint | Branch | None,
    direction: int,
    steps: StepControl | None,
    special_points: bool,
    on_step: OnStep | None,
    max_steps: int,
    ill_posed: str,
) -> _Tracing:
    direction = sign("direction", direction, "1 (towards larger volume) or -1 is allowed")
    check_ill_posed(ill_posed)
    check_max_steps(max_steps)
    return _Tracing.begin(scene, start, direction, steps or StepControl(), special_points, on_step, int(max_steps))


def _targets(until: Mapping[str, float] | None) -> dict[str, float]:
    if until is not None and not isinstance(until, Mapping):
        raise InputError("until", until, "a mapping is allowed, such as {'center_height': 5.0}")
    targets = dict(until or {})
    for quantity, value in targets.items():
        choice("until", quantity, PLACES)
        targets[quantity] = number(f"until.{quantity}", value)
    return targets


@dataclass
class _Tracing:
    """A trace under way."""

    scene: Scene
    potential: Potential
    point: BranchPoint
    tracer: Tracer
    found: list[Equilibrium]
    special: list[SpecialPoint] | None
    on_step: OnStep | None
    max_steps: int
    regular: int = 0
    made: int = 0
    points: Iterator[BranchPoint] | None = None
    crossing: Crossing | None = None
    unexplained: list[str] = field(default_factory=list)
    timings: dict[str, float] = field(default_factory=lambda: {"setup": 0.0, "solve": 0.0, "special_points": 0.0, "verdicts": 0.0})

    @classmethod
    def begin(
        cls,
        scene: Scene,
        start: float | Equilibrium | SpecialPoint | Branch | None,
        direction: int,
        steps: StepControl,
        special_points: bool,
        on_step: OnStep | None,
        max_steps: int,
    ) -> _Tracing:
        clock = time.perf_counter()
        potential = potential_of(scene)
        tracer = Tracer(Predictor(), steps.first, steps)
        special: list[SpecialPoint] | None = [] if special_points else None
        if isinstance(start, Branch):
            if direction != 1 or potential_of(start.scene) is not potential:
                raise InputError(
                    "start", "a Branch", "a branch of this scene is allowed, to be continued the way it was going (direction=1)"
                )
            return cls._continued(scene, potential, start, tracer, on_step, max_steps)
        if isinstance(start, SpecialPoint):
            if start.kind == "azimuthal_onset":
                message = (
                    f"the states that set in there have {start.azimuthal} wave(s) around the axis and are not computed; branch points, "
                    "folds and equilibria are allowed"
                )
                raise InputError("start", "azimuthal_onset", message)
            if start.kind == "branch_point":
                return cls._switched(scene, potential, start, direction, tracer, special, on_step, max_steps)
            start = start.equilibrium
        if isinstance(start, Equilibrium):
            state = resume(potential, start)
        elif start is None:
            state = start_at_volume(potential, potential.space.reference_volume + moderate(potential))
        elif is_number(start):
            volume = number("start", start, "a volume is allowed")
            if at_rest(potential, "volume", volume):
                raise InputError(
                    "start", start, "the flat unloaded membrane has no stiffness to start from; a small volume is allowed, such as 1e-3"
                )
            state = start_at_volume(potential, volume)
        else:
            raise InputError("start", start, "a volume, an Equilibrium, a SpecialPoint or a traced Branch is allowed")
        state_resolution.refuse_unresolved(potential, state)
        tracing = cls(scene, potential, first_point(potential, state, direction), tracer, [], special, on_step, max_steps)
        return tracing._begun(clock)

    def _begun(self, clock: float) -> _Tracing:
        self.timings["setup"] = time.perf_counter() - clock
        self.add(self.point, clock)
        self.regular = 1
        return self

    @classmethod
    def _switched(
        cls,
        scene: Scene,
        potential: Potential,
        start: SpecialPoint,
        direction: int,
        tracer: Tracer,
        special: list[SpecialPoint] | None,
        on_step: OnStep | None,
        max_steps: int,
    ) -> _Tracing:
        """On half of the branch that crosses at a branch point."""
        clock = time.perf_counter()
        if start.tangent is None or start.tangent.shape != (potential.space.n_free + 1,):
            raise InputError("start", "branch_point", "one of the special_points of a branch of this scene is allowed")
        state = restore(potential, start.equilibrium)
        known = oriented_point(potential, state, 0.0, start.tangent[:-1], float(start.tangent[-1]))
        crossing = crossing_at(potential, known)
        tracing = cls(scene, potential, crossing.half(direction), tracer, [], special, on_step, max_steps, crossing=crossing)
        tracing.points = points_beyond(potential, crossing, direction, tracer)
        return tracing._begun(clock)

    @classmethod
    def _continued(
        cls, scene: Scene, potential: Potential, start: Branch, tracer: Tracer, on_step: OnStep | None, max_steps: int
    ) -> _Tracing:
        memory = start.memory
        if not isinstance(memory, TraceMemory):
            raise InputError(
                "start", "a Branch without memory", "a whole Branch from fm.trace is allowed; give start=branch[-1] for others"
            )
        tracer.path, tracer.step = predictor_of(memory), memory.step
        state = restore(potential, start[memory.regular - 1])
        point = oriented_point(potential, state, memory.sigma[-1], memory.slopes[-1][:-1], float(memory.slopes[-1][-1]))
        # the scene of the start may differ in what changes no equilibrium, and all rows of a branch must have the same columns
        found = [eq.in_scene(scene) for eq in start[: memory.regular]]
        special = None
        if start.special_points is not None:
            special = [replace(p, equilibrium=p.equilibrium.in_scene(scene)) for p in start.special_points]
        unexplained = list(memory.unexplained)
        return cls(scene, potential, point, tracer, found, special, on_step, max_steps, memory.regular, unexplained=unexplained)

    def follow(self, targets: Mapping[str, float], ill_posed: str, on_checkpoint: OnCheckpoint | None = None) -> tuple[Status, str]:
        """Step until a target is met or the branch ends; the status, and a message unless a target was met."""
        while (end := self.advance(targets, ill_posed)) is None:
            if on_checkpoint is not None:
                on_checkpoint(self.branch(Status.INTERRUPTED, "interrupted", SoFar(self.found)))
        return end

    def advance(self, targets: Mapping[str, float], ill_posed: str) -> tuple[Status, str] | None:
        """One step: None to go on, else how the trace ended. What was found before a failure is kept."""
        if self.made == self.max_steps:
            if self.unexplained:
                return Status.UNEXPLAINED_INERTIA, "; ".join(self.unexplained)
            return Status.STEP_LIMIT, f"{self.max_steps} steps were made without meeting {dict(targets) or 'an end'}"
        self.made += 1
        try:
            return self._step(targets, ill_posed)
        except SolveError as error:
            return self._ended(error)

    def _step(self, targets: Mapping[str, float], ill_posed: str) -> tuple[Status, str] | None:
        clock = time.perf_counter()
        if self.points is None:
            if ill_posed == "stop" and (end := self._ill_posed(self.point)) is not None:  # continued from where it had ended
                return end
            self.points = trace_points(self.potential, self.point, self.tracer)
        new = next(self.points)
        self.timings["solve"] += time.perf_counter() - clock
        segment = Segment(self.potential, self.point, new, leaving=self.crossing is not None and len(self.found) == 1)
        met = [point for q, v in targets.items() for point in segment.crossings(q, v)]
        last = min(met, key=lambda p: p.sigma) if met else None
        if unresolved := state_resolution.unresolved(self.potential, (last or new).state):
            return Status.NOT_RESOLVED, f"at {self._place(last or new)} {unresolved}"
        closing = self._look_for_special_points(segment, last) if self.special is not None else None
        last = closing or last
        self.add(last or new, clock)
        if self.special is not None:
            self._look_for_onsets(segment, last or new)
        if closing is not None:
            return Status.CLOSED, f"the branch came back to the branch point V = {closing.state.volume:.6g} at which it set out"
        if last is not None and not wellposed.unresolved_source(self.potential, last.state.x):
            return (Status.CONVERGED, "") if not self.unexplained else (Status.UNEXPLAINED_INERTIA, "; ".join(self.unexplained))
        self.point, self.regular = new, len(self.found)
        if ill_posed == "stop" and (end := self._ill_posed(new)) is not None:
            return end
        if unresolved := wellposed.unresolved_source(self.potential, new.state.x):
            return Status.DIPOLE_CONTACT, f"{unresolved} (V = {new.state.volume:.6g})"
        if self._contact(new):
            return (
                Status.DIPOLE_CONTACT,
                f"the membrane came within {CONTACT * self.potential.space.unit:g} of a source at V = {new.state.volume:.6g}",
            )
        return None

    def _ill_posed(self, point: BranchPoint) -> tuple[Status, str] | None:
        bad = wellposed.ill_posed(self.potential, point.state.evaluation)
        if bad is None:
            return None
        return bad.status, f"at {self._place(point)} {bad}, and what a mesh finds beyond depends on the mesh"

    def _place(self, point: BranchPoint) -> str:
        height = self.potential.space.center_height(point.state.x)
        return f"pole height {height:.4g} (V = {point.state.volume:.6g}, P = {point.state.pressure:.6g})"

    def add(self, point: BranchPoint, clock: float) -> None:
        solved = time.perf_counter()
        new = record(self.scene, self.potential, point.state, self.found[-1] if self.found else None, clock)
        self.timings["verdicts"] += time.perf_counter() - solved
        self.found.append(new)
        if self.on_step is not None:
            self.on_step(len(self.found) - 1, self.max_steps + 1, new)

    def _look_for_special_points(self, segment: Segment, last: BranchPoint | None) -> BranchPoint | None:
        """Keep the special points before the end of the trace; the branch point at which it set out, if it comes back to that."""
        clock, closing = time.perf_counter(), None
        located = [fold for kind in FOLDS for fold in segment.folds(kind)]
        if number := branches_crossing(segment):
            crossed = branch_points(segment)
            if len(crossed) < number:
                a, b = segment.a.state, segment.b.state
                self.unexplained.append(f"the inertia changes between V = {a.volume:.6g} and {b.volume:.6g} without a located point")
            located += crossed
            closing = next((found.point for found in crossed if self._back(found.point, last)), None)
        for fold in sorted(located, key=lambda f: f.point.sigma):
            if last is None or fold.point.sigma <= last.sigma:
                self.special.append(self._special(fold))  # type: ignore[union-attr]
        self.timings["special_points"] += time.perf_counter() - clock
        return closing

    def _back(self, point: BranchPoint, last: BranchPoint | None) -> bool:
        """Whether a branch point before the end of the trace is the one at which it set out."""
        if len(self.found) < 3 or (last is not None and last.sigma < point.sigma):
            return False
        return same_crossing(self.potential, self.found[0].state, point.state.x)

    def _look_for_onsets(self, segment: Segment, end: BranchPoint) -> None:
        """Where the smallest eigenvalue for n waves, known at both ends, passes zero."""
        before, after = self.found[-2:]
        top = (end.sigma - segment.a.sigma) / segment.length
        for n in self.scene.analysis.azimuthal_modes:
            verdict = before.verdict(azimuthal=n)
            if verdict.smallest_eigenvalue * after.verdict(azimuthal=n).smallest_eigenvalue < 0:  # False where either is NaN (short-wave)

                def eigenvalue(point: BranchPoint, n: int = n, guess: Array | None = verdict.coefficients) -> float:
                    return azimuthal_eigenvalue(self.potential, point.state.x, point.state.pressure, n, guess).value

                clock = time.perf_counter()
                self.special.append(self._special(segment.root("azimuthal_onset", eigenvalue, 0.0, top), n))  # type: ignore[union-attr]
                self.timings["special_points"] += time.perf_counter() - clock

    def _special(self, fold: Located, azimuthal: int = 0) -> SpecialPoint:
        return special_point(self.scene, self.potential, fold, azimuthal)

    def _contact(self, point: BranchPoint) -> bool:
        return self.potential.distance_to_sources(point.state.x) < CONTACT * self.potential.space.unit

    def _ended(self, error: SolveError) -> tuple[Status, str]:
        near = self.potential.distance_to_sources(self.point.state.x)
        if near < 50 * CONTACT * self.potential.space.unit:
            return Status.DIPOLE_CONTACT, f"{error}; the membrane is within {near:.2g} of a source"
        return error.status, str(error)

    def branch(self, status: Status, message: str, found: Sequence[Equilibrium] | None = None) -> Branch:
        path = remembered(self.tracer.path, self.potential.space.n_free)
        memory = TraceMemory(path.sigma, path.points, path.slopes, self.tracer.step, self.regular, tuple(self.unexplained))
        special = None if self.special is None else tuple(self.special)
        found = tuple(self.found) if found is None else found
        return Branch(self.scene, found, status, message, dict(self.timings), special, memory, solver="newton")
