"""From load to load under one control: along the branch, through the flat membrane, and off a branch that turns back before a load."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..errors import SolveError, Status
from ..potential import Array, Potential
from .bare import moderate, stopped
from .continuation import BranchPoint
from .controls import CONTROLS, Controlled
from .minimize import is_minimum, minimize_and_verify
from .newton import TOLERANCE, correct
from .search import Limit, beyond_crossing, beyond_limit, loss_before
from .segment import ON_FOLD, Located
from .start import cold_start, start_at_volume
from .state import Predictor, State, at_rest, distance, flat_state, rests_flat
from .state_resolution import refuse_unresolved
from .stepping import Corrector, march
from .ways import DOWNHILL
from .wellposed import ill_posed, slackness, unresolved_source

#: who solves, by the public name
SOLVERS: dict[str, Corrector] = {"ipopt": minimize_and_verify, "newton": correct}
#: share of a load at which a path to the flat membrane at rest, or through it, is close enough to leave out the rest
NEAR_ZERO = 1e-3
#: by how much the displacement shrinks on that way, at least (the cube root of it without stiffness): else the branch does not lead to rest
NEAR_REST = 0.5


@dataclass(frozen=True)
class Turn:
    """The branch turned back before a load, or became unstable, and where a stable state is met again."""

    limit: Limit

    @property
    def fold(self) -> Located[BranchPoint] | None:
        """The fold or branch point at which it did; None where that was not found."""
        return self.limit.fold

    @property
    def status(self) -> Status | None:
        """Why the load was not reached; None where that was not found out."""
        if self.fold is None:
            return None
        return Status.NOT_A_MINIMUM if self.fold.kind == "branch_point" else Status.NO_EQUILIBRIUM

    def place(self, state: State) -> str:
        """Where the fold is, in words."""
        return f"P = {state.pressure + 0.0:.9g}, V = {state.volume:.9g}"

    @property
    def kind(self) -> str:
        """What the fold is, in words."""
        return self.fold.kind.replace("_", " ") if self.fold else ""

    def __str__(self) -> str:
        fold, landing = self.fold, self.limit.landing
        if fold is None:
            return "steps in the load did not converge there, and along the branch no fold in it was met"
        at = fold.point.state
        if fold.kind == "branch_point":
            where = f"the branch lost stability at the branch point {self.place(at)}, where another one crosses it"
            if landing is None:
                return f"{where}, on which no stable state was met at this load"
            return f"{where}, on which the membrane would go to V = {landing.volume:.6g}, P = {landing.pressure:.6g}"
        where = f"the branch turns back: the {self.kind} is {self.place(at)}"
        if landing is None:
            last = self.limit.last
            far = "" if last is None else f", as far as V = {last.volume:.6g}, P = {last.pressure:.6g}"
            return f"{where}; it was followed on{far}, without meeting a stable state at this load"
        return f"{where}, from which the membrane would jump to V = {landing.volume:.6g}, P = {landing.pressure:.6g}"


@dataclass(frozen=True)
class NumberTurn(Turn):
    """The same over a number of the scene, with its name."""

    number: str

    def place(self, state: State) -> str:
        return f"{self.number} = {state.evaluation.factor:.9g} ({super().place(state)})"

    @property
    def kind(self) -> str:
        return "last value"


class LoadPath:
    """The way of a membrane from load to load under one control, with the memory that predicts the next state.

    Parameters
    ----------
    potential : Potential
    held : Controlled
        What is prescribed.
    solver : {"ipopt", "newton"}
        Who solves where a minimiser can hold it; every other control takes Newton's method.

    Attributes
    ----------
    state : State or None
        Where it stands; None before the first load.
    load : float
        The load there.
    memory : Predictor
        The last points of the branch, which predict the next one.
    """

    def __init__(self, potential: Potential, held: Controlled, solver: str) -> None:
        self.potential, self.held = potential, held
        self.solver = solver if held.minimised else "newton"
        self.corrector = SOLVERS[self.solver]
        self.state: State | None = None
        self.load = 0.0
        self.memory = Predictor()

    def set_out(self, state: State, load: float) -> None:
        """Stand at a state that was found elsewhere.

        Raises
        ------
        SolveError
            When no load of the control holds it, or it is no minimum where minima are followed.
        """
        if refusal := self.held.refusal(state.pressure, state.volume):
            raise SolveError(refusal, status=Status.NO_EQUILIBRIUM)
        self.go_on(state, load, Predictor())
        if self._minima and not is_minimum(self.potential, self.held.at(load), state.evaluation):
            message = f"the start (V = {state.volume:.6g}, P = {state.pressure:.6g}) is no minimum under {self.held.name} control"
            raise SolveError(message, status=Status.NOT_A_MINIMUM)

    def go_on(self, state: State, load: float, memory: Predictor) -> None:
        """Stand where an interrupted run stood."""
        self.state, self.load, self.memory = state, load, memory

    def to(self, load: float, jump: bool) -> tuple[State, Turn | None]:
        """Go to a load.

        Parameters
        ----------
        load : float
        jump : bool
            Whether to go to the next stable state at the load where the branch turns back before it.

        Returns
        -------
        state : State
        turn : Turn or None
            Where the branch turned back, if it had to be left.

        Raises
        ------
        SolveError
            When the load is not reached.
        """
        if self.state is None or self._flat(self.state.x):
            return self._from_nowhere(load, jump)
        if load == self.load:
            return self._arrived(self.state, load, None)
        rest = self.held.rest(self.potential.space)
        if self.held.odd and self.potential.flat and (self.load - rest) * (load - rest) <= 0 and rests_flat(self.potential):
            return self._through_flat(self.state, load, jump)
        if at_rest(self.potential, self.held, load):
            self.memory = Predictor()
            return self._arrived(flat_state(self.potential), load, None)
        return self._along(self.state, load, jump)

    @property
    def _minima(self) -> bool:
        return self.corrector is minimize_and_verify

    def _flat(self, x: Array) -> bool:
        """Whether this is the flat unloaded membrane, which has no stiffness that a path could leave it by."""
        return not x.any() and rests_flat(self.potential)

    def _arrived(self, state: State, load: float, turn: Turn | None) -> tuple[State, Turn | None]:
        self.state, self.load = state, load
        if unresolved := unresolved_source(self.potential, state.x):
            raise SolveError(unresolved, status=Status.DIPOLE_CONTACT)
        refuse_unresolved(self.potential, state)
        return state, turn

    # --- the first load

    def _from_nowhere(self, load: float, jump: bool) -> tuple[State, Turn | None]:
        try:
            state, turn = self._first(load, jump)
        except SolveError as failure:
            self._begin_before(load, failure)
            return self.to(load, jump)
        self.memory = Predictor()
        return self._arrived(state, load, turn)

    def _begin_before(self, load: float, failure: SolveError) -> None:
        """Stand at the moderately inflated membrane on the way to a volume at which sources could not be turned on, or to a pressure at
        which nothing was found: steps from there reach it, or meet the fold that is the reason."""
        rest, size = self.potential.space.reference_volume, moderate(self.potential)
        if self.held is CONTROLS["pressure"] and failure.status is Status.NO_EQUILIBRIUM and self._minima:
            self._begin_below(rest + float(np.copysign(size, load)), load, failure)
            return
        by_volume = self.held is CONTROLS["volume"]
        if not by_volume or failure.status.ill_posed or abs(load - rest) <= size or not self.potential.surrounded:
            raise failure
        self.load = rest + float(np.copysign(size, load - rest))
        try:
            self.state, _ = self._first(self.load, False)
            self.memory = Predictor()
        except SolveError:
            raise failure from None

    def _begin_below(self, volume: float, load: float, failure: SolveError) -> None:
        """Stand at the stable membrane at a volume, if its pressure is on the way to the one that was asked for."""
        try:
            state = start_at_volume(self.potential, volume)
        except SolveError:
            raise failure from None
        if not (abs(state.pressure) < abs(load) and self._stable(state.pressure)(state)):
            raise failure
        self.go_on(state, state.pressure, Predictor())

    def _first(self, load: float, jump: bool) -> tuple[State, Turn | None]:
        """The state of a cold start, and where its branch became unstable if it is one of another branch."""
        guess = cold_start(self.potential, self.held, load, stable=self._minima)
        result = self.corrector(self.potential, self.held.at(load), guess.x, guess.pressure)
        if (
            result.status in (Status.NOT_CONVERGED, Status.NOT_A_MINIMUM)
            and self.held is CONTROLS["pressure"]
            and abs(guess.pressure - load) <= ON_FOLD * (self.potential.space.units["pressure"] + abs(load))
        ):
            return guess, None  # a limit point at this very pressure, which no corrector finds under pressure control
        if result.status is Status.NOT_A_MINIMUM:
            if self.potential.strained and (bad := ill_posed(self.potential, guess.evaluation)) is not None:
                where = f"in the state found there (V = {guess.volume:.6g}, P = {guess.pressure:.6g}) {bad}"
                raise SolveError(where, status=bad.status)
            turn = self._lost(guess, load)
            if jump and turn.limit.landing is not None:
                return turn.limit.landing, turn
            where = f"the state found there (V = {guess.volume:.6g}, P = {guess.pressure:.6g}) is no minimum under {self.held.name} control"
            raise SolveError(f"{where}; {turn}" if turn.fold else where, status=result.status)
        if result.status is not Status.CONVERGED:
            raise SolveError(f"the state found there has V = {guess.volume:.6g} and P = {guess.pressure:.6g}", status=result.status)
        return State.of(result, guess.iterations), None

    def _lost(self, state: State, load: float) -> Turn:
        """Where the branch of an unstable state was stable last, and the stable state at the load on the branch that crosses there."""
        lost = loss_before(self.potential, state, self.held.name, self._stable(load))
        if lost is None or lost.kind != "branch_point":
            return Turn(Limit(None, None))
        return Turn(Limit(lost, beyond_crossing(self.potential, lost, self.held.name, load, self._stable(load))))

    # --- the loads after it

    def _along(self, state: State, load: float, jump: bool) -> tuple[State, Turn | None]:
        """Along the branch from the state at hand, and off it where it turns back before the load."""
        if load == self.load:
            return self._arrived(state, load, None)
        try:
            states = march(self.potential, state, self.held.at, self.load, load, path=self.memory, corrector=self.corrector)
        except SolveError as error:
            if error.status.ill_posed or not self.held.minimised:
                raise
            return self._landed(error, load, jump)
        states[-1].iterations = sum(s.iterations for s in states)
        return self._arrived(states[-1], load, None)

    def _landed(self, error: SolveError, load: float, jump: bool) -> tuple[State, Turn | None]:
        """At the next stable state at a load that steps in the load did not reach, where it may be gone to."""
        limit = self._beyond(error, load)
        snapped = None
        left = limit.fold.point.state if limit.fold else self.state
        if jump and limit.landing is None and left is not None and self.potential.obstacles and self.held in DOWNHILL:
            snapped = stopped(self.potential, self.held.at(load), left)
            limit = replace(limit, landing=snapped)
        turn = Turn(limit)
        if limit.fold is None and limit.ill_posed is not None and limit.landing is None:
            raise slackness(self.potential, limit.ill_posed) from error
        # a landing without a fold is a state of the branch itself, which has not been left
        if limit.landing is None or not (jump or limit.fold is None):
            raise SolveError(str(turn), status=turn.status or error.status) from error
        self.memory = Predictor()
        return self._arrived(limit.landing, load, turn if limit.fold or snapped else None)

    def _beyond(self, error: SolveError, load: float) -> Limit:
        # next to a crossing of branches round-off lies along the other one; the last state that it did not touch has a tangent of its own
        last = next((s for s in reversed(error.result or []) if s.correction <= TOLERANCE), self.state)
        if last is None:
            return Limit(None, None)
        return beyond_limit(self.potential, last, self.held.name, load, self._stable(load), any_before=not self._minima)

    def _stable(self, load: float) -> Callable[[State], bool]:
        control = self.held.at(load)
        return lambda state: is_minimum(self.potential, control, state.evaluation)

    def _through_flat(self, before: State, load: float, jump: bool) -> tuple[State, Turn | None]:
        """To the flat membrane at rest, or to the other side of it, where the mirror image of every state is one at the opposite load.

        Where loads or sources hold another state in equilibrium at no load, the branch passes there, and is followed as any other.
        """
        flat = self.held.rest(self.potential.space)
        state, turn = self._along(before, flat + NEAR_ZERO * (self.load - flat), jump)
        rest = np.zeros_like(state.x)
        if distance(self.potential, state.x, rest) > NEAR_REST * distance(self.potential, before.x, rest):
            state, later = self._along(state, load, jump)
            return state, later or turn
        self.memory = Predictor()
        if load == flat:
            self.state, self.load = flat_state(self.potential), load
            return self.state, turn
        state, later = self._along(self._mirrored(state), load, jump)
        return state, later or turn

    def _mirrored(self, state: State) -> State:
        """The mirror image of a state at hand, at the opposite load."""
        mirrored = state.x.copy()
        mirrored[self.potential.space.fields[1]] *= -1
        self.load = 2 * self.held.rest(self.potential.space) - self.load
        result = self.corrector(self.potential, self.held.at(self.load), mirrored, -state.pressure)
        if result.status is not Status.CONVERGED:
            raise SolveError(f"the state on the other side of the flat membrane was not found at {self.load:.3g}", status=result.status)
        return State.of(result)
