"""All equilibria at one load that can be found: crossings of traced branches, and deflation for branches that are not connected to them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import SolveError, Status
from ..potential import Array, Potential
from .bare import moderate
from .branch import FOLDS, BranchProblem, first_point
from .continuation import BranchPoint, StepControl, Tracer, trace_points
from .controls import CONTROLS, Control, VolumeControl
from .guess import guess_at_volume
from .newton import TOLERANCE, Equations, correct, displaced, relative_size
from .segment import Located, Segment
from .special_points import branch_points, branches_crossing
from .start import start_at_volume
from .state import Predictor, State, at_rest, displacement, distance, flat_state
from .state_resolution import unresolved
from .switching import SAME_CROSSING, Crossing, crossing_at, points_beyond, same_crossing, softest
from .wellposed import ill_posed, is_slack

#: volumes from which branches and deflated iterations set out: less the volume at rest, in units of what a moderately inflated membrane
#: holds more than at rest
STARTS = (1.0, -1.0, 10.0, -10.0, 100.0, -100.0)
#: two states closer than this are the same, relative to the size of the displacement
SAME = 1e-6
#: a branch is no longer followed beyond this many times what a moderately inflated membrane holds more than at rest
FAR = 2e4
#: states are looked for along a displacement whose stiffness over the stiffness of all others is below this; and how far, relative to the
#: size
SOFT, KICKS = 0.2, (-0.3, 0.3)
#: most branch points at which the other branch is followed
MOST_CROSSINGS = 16


@dataclass
class Search:
    """States found at a load, each once, and what was done to find them."""

    potential: Potential
    quantity: str
    load: float
    max_steps: int
    states: list[State] = field(default_factory=list)
    traced: list[tuple[float, float]] = field(default_factory=list)
    beyond: list[tuple[float, float]] = field(default_factory=list)
    iterations: int = 0
    deflations: int = 0
    ill_posed: list[State] = field(default_factory=list)
    crossings: list[Crossing] = field(default_factory=list)
    unresolved: list[State] = field(default_factory=list)
    _points: list[BranchPoint] = field(default_factory=list)
    _halves: list[tuple[Crossing, int]] = field(default_factory=list)

    @property
    def followed(self) -> int:
        """Number of branch points whose other branch was followed: the first ones."""
        return min(len(self.crossings), MOST_CROSSINGS)

    @property
    def starts(self) -> list[float]:
        """Volumes of the starts."""
        return [self.potential.space.reference_volume + v * moderate(self.potential) for v in STARTS]

    def run(self) -> None:
        """Trace the branches through the starts, then deflate until nothing new appears."""
        if at_rest(self.potential, CONTROLS[self.quantity], self.load):
            self._add(flat_state(self.potential))
        for volume in self.starts:
            try:
                state = start_at_volume(self.potential, volume)
            except SolveError:
                continue
            if not self._on_traced_branch(state):
                self._trace_both_ways(state)
        while new := self._deflated():
            if self._add(new):
                self._trace_both_ways(new)

    def _trace_both_ways(self, state: State) -> None:
        volumes = [state.volume]
        for direction in (1, -1):
            volumes += self._walk(follow(self.potential, first_point(self.potential, state, direction), self.max_steps))
        self.traced.append((min(volumes), max(volumes)))
        while self._halves:
            crossing, direction = self._halves.pop(0)
            volumes = self._walk(follow_beyond(self.potential, crossing, direction, self.max_steps))
            if volumes:
                self.beyond.append((min(volumes), max(volumes)))

    def _walk(self, segments: Iterator[Segment[BranchPoint]]) -> list[float]:
        """Keep what a branch meets, as far as it is new; the volumes of its points."""
        volumes = []
        for segment in segments:
            self._points.append(segment.b)
            volumes.append(segment.b.state.volume)
            with suppress(SolveError):  # through the flat unloaded state there is no path
                for point in segment.crossings(self.quantity, self.load):
                    self._add(point.state)
            if self._meets_known_branch(segment) or abs(volumes[-1]) > FAR * moderate(self.potential):
                break
        return volumes

    def _meets_known_branch(self, segment: Segment[BranchPoint]) -> bool:
        """Note the branch points on a segment. Whether the branch arrives there on a half of the crossing branch, which is then known."""
        for located in crossings_on(self.potential, segment):
            for crossing in self.crossings:
                if same_crossing(self.potential, crossing.known.state.x, located.point.state.x):
                    side = crossing.side(self.potential, segment.a)
                    self._halves = [(c, d) for c, d in self._halves if c is not crossing or d != side]
                    if side:
                        return True
                    break
            else:
                self._remember(located)
        return False

    def _remember(self, located: Located[BranchPoint]) -> None:
        """Keep a branch point; both halves of the other branch are to be followed."""
        with suppress(SolveError):
            crossing = crossing_at(self.potential, located.point)
            self.crossings.append(crossing)
            if len(self.crossings) <= MOST_CROSSINGS:
                self._halves += [(crossing, 1), (crossing, -1)]

    def _on_traced_branch(self, state: State) -> bool:
        """Whether a state lies between two traced points of nearly the same shape. A start on a known branch is not traced again."""
        reach = 0.5 * (self.potential.space.units["volume"] + abs(state.volume))
        near = [p for p in self._points if abs(p.state.volume - state.volume) < reach]
        scale = displacement(self.potential, state.x)
        for p in near:
            result = correct(self.potential, VolumeControl(state.volume), p.state.x, p.state.pressure)
            if result.status is Status.CONVERGED and distance(self.potential, result.x, state.x) <= SAME * scale:
                return True
        return False

    def _add(self, state: State) -> bool:
        """Keep a state unless it is known. An ill-posed or unresolved state depends on the mesh: it is remembered only to be avoided."""
        if self._known(state.x):
            return False
        kept = self.states
        if ill_posed(self.potential, state.evaluation) is not None:
            kept = self.ill_posed
        elif unresolved(self.potential, state):
            kept = self.unresolved
        kept.append(state)
        return kept is self.states

    @property
    def _avoided(self) -> list[State]:
        return self.states + self.ill_posed + self.unresolved

    def _known(self, x: Array) -> bool:
        return any(distance(self.potential, x, s.x) <= SAME * displacement(self.potential, s.x) for s in self._avoided)

    def _deflated(self) -> State | None:
        """A state not found yet, by Newton's method with the known ones deflated (Farrell, Birkisson and Funke, 2015)."""
        control = CONTROLS[self.quantity].at(self.load)
        guesses = [(guess_at_volume(self.potential, v), 0.0 if self.quantity == "volume" else self.load) for v in self.starts]
        guesses += [(scale * s.x, s.pressure) for s in self.states for scale in (0.7, 1.3, -1.0)]
        guesses += [(x, s.pressure) for s in self.states for x in self._partners(s)]
        for x, pressure in guesses:
            self.deflations += 1
            state = self._deflated_newton(control, x, pressure)
            if state is not None and not self._known(state.x):
                return state
        return None

    def _partners(self, state: State) -> list[Array]:
        """Guesses for states that a symmetry would connect to a known state if the scene had it. A small asymmetry breaks a pitchfork: no
        branch crosses there, and one half of the other branch is on its own. They are its mirror image and, where one displacement lowers
        the energy or meets far less resistance than all others, the shapes on both sides along it.
        """
        shapes = self.potential.space.mirrored(state.x)
        with suppress(SolveError):
            phi, stiffness = softest(self.potential, state)
            if stiffness < SOFT:
                size = max(displaced(self.potential, state.x))
                shapes += [state.x + k * size * phi for k in KICKS]
        return shapes

    def _deflated_newton(self, control: Control, x: Array, pressure: float, iterations: int = 40) -> State | None:
        potential = self.potential
        for _ in range(iterations):
            equations = Equations(potential, control, x, pressure)
            if not equations.finite:
                return None
            dx, dp, _ = equations.newton_step()
            self.iterations += 1
            if relative_size(potential, dx, x) <= TOLERANCE**0.5:
                result = correct(potential, control, x, pressure)
                return State.of(result) if result.status is Status.CONVERGED else None
            # the deflated step is the Newton step times 1/(1 - d log(deflation) . dx)
            slope = sum(-2 * self._cosine(x - s.x, dx) for s in self._avoided)
            length = 1 / (1 - slope) if abs(1 - slope) > 1e-12 else 1.0
            size = distance(potential, x + dx, x) / max(displacement(potential, x), 1e-12)
            length = float(np.clip(length, -1.0, 1.0)) * min(1.0, 1.0 / size if size > 0 else 1.0)
            x, pressure = x + length * dx, pressure + length * dp
        return None

    def _cosine(self, away: Array, dx: Array) -> float:
        """d log(1/|x - x_i|^2 + 1) . dx / (-2), in the mean-square norm."""
        square = max(distance(self.potential, away, 0 * away) ** 2, 1e-300)
        along = (distance(self.potential, away + dx, 0 * away) ** 2 - distance(self.potential, away - dx, 0 * away) ** 2) / 4
        return along / (square * (1 + square))


def follow(potential: Potential, point: BranchPoint, max_steps: int) -> Iterator[Segment[BranchPoint]]:
    """Segments of a branch until a step fails, the limit is reached, or a tension field is slack and depends on the mesh."""
    problem, tracer = BranchProblem(potential), Tracer(Predictor(), StepControl().first, StepControl())
    points = trace_points(problem, point, tracer)
    for _ in range(max_steps):
        try:
            new = next(points)
        except SolveError:
            return
        yield Segment(problem, point, new)
        if is_slack(potential, new.state):
            return
        point = new


def follow_beyond(potential: Potential, crossing: Crossing, direction: int, max_steps: int) -> Iterator[Segment[BranchPoint]]:
    """As :func:`follow`, on a half of the branch that crosses at a branch point."""
    tracer = Tracer(Predictor(), StepControl().first, StepControl())
    problem, points, point = BranchProblem(potential), points_beyond(potential, crossing, direction, tracer), crossing.half(direction)
    for k in range(max_steps):
        try:
            new = next(points)
        except SolveError:
            return
        yield Segment(problem, point, new, leaving=k == 0)
        if is_slack(potential, new.state):
            return
        point = new


def crossings_on(potential: Potential, segment: Segment[BranchPoint]) -> list[Located[BranchPoint]]:
    """The branch points on a segment that can be located. Branch points of folded shapes, which depend on the mesh, are left out."""
    try:
        if not branches_crossing(segment) or all(ill_posed(potential, point.state.evaluation) for point in (segment.a, segment.b)):
            return []
        located = branch_points(segment)
    except SolveError:  # of a limit point on the segment
        return []
    return [found for found in located if ill_posed(potential, found.point.state.evaluation) is None]


@dataclass(slots=True)
class Limit:
    """Why a load cannot be reached: the fold where the branch turns back, or the branch point where it becomes unstable. With it comes the
    next stable state at the load, if there is one.

    ``last`` is the last state on the way along the branch. ``ill_posed`` is the state at which the branch became slack or compressed before
    either was met. What follows depends on the mesh.
    """

    fold: Located[Any] | None
    landing: State | None
    ill_posed: State | None = None
    last: State | None = None


def beyond_limit(
    potential: Potential,
    state: State,
    quantity: str,
    load: float,
    stable: Callable[[State], bool],
    *,
    any_before: bool = False,
    max_steps: int = 300,
) -> Limit:
    """Follow the branch from the last state before a load that was not reached by steps in the load itself. Close to a fold such steps can
    fail on this side of it: then there is a landing and no fold.

    Parameters
    ----------
    potential, state : Potential, State
    quantity : {"volume", "pressure"}
    load : float
    stable : callable
        Whether a state is a minimum under the control.
    any_before : bool
        Whether a state before the fold will do that is none.
    """
    start = first_point(potential, state, 1)
    here = state.volume if quantity == "volume" else state.pressure
    if start.rate(quantity) * (load - here) < 0:
        start = first_point(potential, state, -1)
    kind = next(k for k, q in FOLDS.items() if q == quantity)
    fold: Located[BranchPoint] | None = None
    last = state
    for segment in follow(potential, start, max_steps):
        if ill_posed(potential, segment.b.state.evaluation) is not None:
            return Limit(fold, None, segment.b.state, last)
        last = segment.b.state
        crossing = None if any_before else next(iter(crossings_on(potential, segment)), None)
        if fold is None:
            fold = next(iter(segment.folds(kind)), None)
            # a branch that ends on another branch turns back there: what is met is the other branch
            if crossing is not None and (fold is None or crossing.point.sigma - fold.point.sigma <= SAME_CROSSING * segment.length):
                for met in segment.crossings(quantity, load):
                    if met.sigma < crossing.point.sigma and stable(met.state):
                        return Limit(None, met.state)
                fold = crossing
                if (landing := beyond_crossing(potential, crossing, quantity, load, stable, max_steps)) is not None:
                    return Limit(crossing, landing)
        for met in segment.crossings(quantity, load):
            before = fold is None or met.sigma < fold.point.sigma
            if met is not (fold and fold.point) and ((before and any_before) or stable(met.state)):
                return Limit(None if before else fold, met.state, last=met.state)
        if abs(segment.b.state.volume) > FAR * moderate(potential):
            break
    return Limit(fold, None, last=last)


def beyond_crossing(
    potential: Potential, located: Located[BranchPoint], quantity: str, load: float, stable: Callable[[State], bool], max_steps: int = 300
) -> State | None:
    """The first stable state at a load on the branch that crosses at a branch point; None if neither half has one."""
    try:
        crossing = crossing_at(potential, located.point)
    except SolveError:
        return None
    for direction in (1, -1):
        for segment in follow_beyond(potential, crossing, direction, max_steps):
            if ill_posed(potential, segment.b.state.evaluation) is not None:
                break
            with suppress(SolveError):
                for met in segment.crossings(quantity, load):
                    if stable(met.state):
                        return met.state
            if abs(segment.b.state.volume) > FAR * moderate(potential):
                break
    return None


def loss_before(
    potential: Potential, state: State, quantity: str, stable: Callable[[State], bool], *, max_steps: int = 300
) -> Located[BranchPoint] | None:
    """The branch point or fold at which the branch through an unstable state was stable last; None if the way back has none."""
    kind = next(k for k, q in FOLDS.items() if q == quantity)
    here = state.volume - potential.space.reference_volume
    for direction in (-1, 1) if here > 0 else (1, -1):
        for segment in follow(potential, first_point(potential, state, direction), max_steps):
            if ill_posed(potential, segment.b.state.evaluation) is not None or abs(segment.b.state.volume) > FAR * moderate(potential):
                break
            if stable(segment.b.state):
                return next(iter([*crossings_on(potential, segment)[-1:], *segment.folds(kind)]), None)
    return None
