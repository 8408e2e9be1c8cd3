"""All equilibria at one load that can be found: crossings of traced branches, and deflation for branches that are not connected to them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from ..errors import SolveError, Status
from ..potential import Array, Potential
from .continuation import BranchPoint, StepControl, Tracer, first_point, trace_points
from .controls import Control, PressureControl, VolumeControl
from .newton import TOLERANCE, Equations, correct, relative_size
from .resolution import unresolved
from .special_points import FOLDS, Located, Segment
from .start import START_VOLUME, guess_at_volume, moderate, start_at_volume
from .state import Path, State, at_rest, distance, flat_state
from .wellposed import ill_posed, is_slack

#: volumes of the domes from which branches and deflated iterations set out; from other shapes than flat ones: beyond that at rest, in
#: proportion to that of a moderately inflated membrane
STARTS = (0.5, -0.5, 5.0, -5.0, 50.0, -50.0)
#: two states closer than this are the same, relative to the size of the displacement
SAME = 1e-6
#: volume beyond which a branch is no longer followed
FAR = 1e4

CONTROLS: dict[str, Callable[[float], Control]] = {"volume": VolumeControl, "pressure": PressureControl}


@dataclass
class Search:
    """States found at a load, each once, and what was done to find them."""

    potential: Potential
    quantity: str
    load: float
    max_steps: int
    states: list[State] = field(default_factory=list)
    traced: list[tuple[float, float]] = field(default_factory=list)
    iterations: int = 0
    deflations: int = 0
    ill_posed: list[State] = field(default_factory=list)
    unresolved: list[State] = field(default_factory=list)
    _points: list[BranchPoint] = field(default_factory=list)

    @property
    def starts(self) -> list[float]:
        """Volumes of the starts."""
        return [self.potential.space.reference_volume + v * moderate(self.potential) / START_VOLUME for v in STARTS]

    def run(self) -> None:
        """Trace the branches through the starts, then deflate until nothing new appears."""
        if at_rest(self.potential, self.quantity, self.load):
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
            for segment in follow(self.potential, first_point(self.potential, state, direction), self.max_steps):
                self._points.append(segment.b)
                volumes.append(segment.b.state.volume)
                with suppress(SolveError):  # through the flat unloaded state there is no path
                    for point in segment.crossings(self.quantity, self.load):
                        self._add(point.state)
                if abs(volumes[-1]) > FAR:
                    break
        self.traced.append((min(volumes), max(volumes)))

    def _on_traced_branch(self, state: State) -> bool:
        """Whether a state lies between two traced points of nearly the same shape: a start on a known branch is not traced again."""
        near = [p for p in self._points if abs(p.state.volume - state.volume) < 0.5 * (1 + abs(state.volume))]
        scale = distance(self.potential, state.x, np.zeros_like(state.x))
        for p in near:
            result = correct(self.potential, VolumeControl(state.volume), p.state.x, p.state.pressure)
            if result.status is Status.CONVERGED and distance(self.potential, result.x, state.x) <= SAME * scale:
                return True
        return False

    def _add(self, state: State) -> bool:
        """Keep a state unless it is known; one that is ill-posed or not resolved is a shape of this mesh, remembered only to be avoided."""
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
        return any(distance(self.potential, x, s.x) <= SAME * distance(self.potential, s.x, 0 * s.x) for s in self._avoided)

    def _deflated(self) -> State | None:
        """A state not found yet, by Newton's method with the known ones deflated (Farrell, Birkisson and Funke, 2015)."""
        control = CONTROLS[self.quantity](self.load)
        guesses = [(guess_at_volume(self.potential, v), 0.0 if self.quantity == "volume" else self.load) for v in self.starts]
        guesses += [(scale * s.x, s.pressure) for s in self.states for scale in (0.7, 1.3, -1.0)]
        for x, pressure in guesses:
            self.deflations += 1
            state = self._deflated_newton(control, x, pressure)
            if state is not None and not self._known(state.x):
                return state
        return None

    def _deflated_newton(self, control: Control, x: Array, pressure: float, iterations: int = 40) -> State | None:
        potential = self.potential
        for _ in range(iterations):
            equations = Equations(potential, control, x, pressure, potential.evaluate(x, pressure))
            if not equations.finite:
                return None
            dx, dp = equations.newton_step()
            self.iterations += 1
            if relative_size(potential, dx, x) <= TOLERANCE**0.5:
                result = correct(potential, control, x, pressure)
                return State.of(result) if result.status is Status.CONVERGED else None
            # the deflated step is the Newton step times 1/(1 - d log(deflation) . dx)
            slope = sum(-2 * self._cosine(x - s.x, dx) for s in self._avoided)
            length = 1 / (1 - slope) if abs(1 - slope) > 1e-12 else 1.0
            size = distance(potential, x + dx, x) / max(distance(potential, x, 0 * x), 1e-12)
            length = float(np.clip(length, -1.0, 1.0)) * min(1.0, 1.0 / size if size > 0 else 1.0)
            x, pressure = x + length * dx, pressure + length * dp
        return None

    def _cosine(self, away: Array, dx: Array) -> float:
        """d log(1/|x - x_i|^2 + 1) . dx / (-2), in the mean-square norm."""
        square = max(distance(self.potential, away, 0 * away) ** 2, 1e-300)
        along = (distance(self.potential, away + dx, 0 * away) ** 2 - distance(self.potential, away - dx, 0 * away) ** 2) / 4
        return along / (square * (1 + square))


def follow(potential: Potential, point: BranchPoint, max_steps: int) -> Iterator[Segment]:
    """Segments of a branch until a step fails, the limit is reached, or a tension field is slack and what follows is the mesh's."""
    tracer = Tracer(Path(), StepControl().first, StepControl())
    points = trace_points(potential, point, tracer)
    for _ in range(max_steps):
        try:
            new = next(points)
        except SolveError:
            return
        yield Segment(potential, point, new)
        if is_slack(potential, new.state):
            return
        point = new


@dataclass(slots=True)
class Limit:
    """Why a load cannot be reached: the fold where the branch turns back, and the next stable state at the load, if there is one.

    ``ill_posed`` is the state at which the branch became so, slack or compressed, before either was met: what follows is the mesh's.
    """

    fold: Located | None
    landing: State | None
    ill_posed: State | None = None


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
    """Follow the branch from the last state before a load that was not reached by steps in the load itself.

    So close to a fold such steps can fail on this side of it: then there is a landing and no fold.

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
    if start.rate(quantity, potential) * (load - here) < 0:
        start = first_point(potential, state, -1)
    kind = next(k for k, q in FOLDS.items() if q == quantity)
    fold: Located | None = None
    for segment in follow(potential, start, max_steps):
        if ill_posed(potential, segment.b.state.evaluation) is not None:
            return Limit(fold, None, segment.b.state)
        if fold is None:
            fold = next(iter(segment.folds(kind)), None)
        for met in segment.crossings(quantity, load):
            before = fold is None or met.sigma < fold.point.sigma
            if met is not (fold and fold.point) and ((before and any_before) or stable(met.state)):
                return Limit(None if before else fold, met.state)
        if abs(segment.b.state.volume) > FAR:
            break
    return Limit(fold, None)
