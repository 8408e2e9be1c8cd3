"""From one value of a number of the scene to the next, while a quantity is held."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..errors import SolveError, Status
from ..potential import Family, Potential, potential_of
from .bare import moderate, stopped
from .branch import BranchProblem, first_point
from .controls import ArcLengthControl, Control, Controlled, GasOver, at_number, is_held
from .load_path import SOLVERS, LoadPath, NumberTurn, Turn
from .minimize import is_minimum, minimize_and_verify
from .newton import correct
from .number_curve import ControlledProblem, NumberPoint, beyond_turn, first_controlled
from .search import FAR, follow
from .segment import Located
from .state import Predictor, State
from .state_resolution import refuse_unresolved
from .stepping import march
from .ways import DOWNHILL
from .wellposed import ill_posed, slackness, unresolved_source

#: most steps along the branch of one scene on which a stable state is looked for
_MAX_STEPS = 300


class NumberPath:
    """The way of a membrane from value to value of a number, with the memory that predicts the next state.

    It is walked as a :class:`.LoadPath` is.

    Parameters
    ----------
    family : Family
    name : str
        Of the number.
    held : Controlled
        What is held.
    value : float
        At which value.
    solver : {"ipopt", "newton"}
        Who solves where a minimiser can hold it.
    scale : float
        Unit of the number where the branch is followed by arc length.
    """

    def __init__(self, family: Family, name: str, held: Controlled, value: float, solver: str, scale: float) -> None:
        self.family, self.name, self.held, self.value, self.scale = family, name, held, value, scale
        self.solver = solver if held.minimised else "newton"
        self.corrector = SOLVERS[self.solver]
        self.state: State | None = None
        self.load = 0.0
        self.memory = Predictor()

    def control(self, number: float) -> Control:
        """What holds the quantity at a value of the number."""
        return at_number(self.held.at(self.value), number)

    def go_on(self, state: State, load: float, memory: Predictor) -> None:
        """Stand where an interrupted run stood."""
        self.state, self.load, self.memory = state, load, memory

    def set_out(self, state: State, load: float) -> None:
        """Stand at a state of the scene with a value of the number, which is brought under the control.

        Raises
        ------
        SolveError
            When it cannot be, or when it is no minimum where minima are followed.
        """
        self.go_on(self._brought(self._own_path(load), state, load), load, Predictor())

    def to(self, load: float, jump: bool) -> tuple[State, Turn | None]:
        """Go to a value; see :meth:`.LoadPath.to`."""
        if self.state is None:
            state, turn = self._own_path(load).to(self.value, jump)
            self.go_on(self._here(state, load), load, Predictor())
            return self._arrived(self._here(state, load), load, turn)
        if load == self.load:
            return self._arrived(self.state, load, None)
        try:
            states = march(
                self.family,
                self.state,
                self.control,
                self.load,
                load,
                path=self.memory,
                corrector=self.corrector,
                parameter="number",
            )
        except SolveError as error:
            if error.status.ill_posed or error.status is Status.DIPOLE_CONTACT or not self.held.minimised:
                raise
            return self._landed(error, load, jump)
        states[-1].iterations = sum(s.iterations for s in states)
        return self._arrived(states[-1], load, None)

    # --- the first value

    def _own_path(self, load: float) -> LoadPath:
        """The path of the scene with a value of the number, on which the held quantity is reached."""
        held = self.held.over(load) if isinstance(self.held, GasOver) else self.held
        return LoadPath(self._member(load, built=True), held, self.solver)

    def _member(self, load: float, *, built: bool = False) -> Potential:
        member = self.family.member(load)
        return potential_of(member.scene) if built else member

    def _brought(self, path: LoadPath, state: State, load: float) -> State:
        if is_held(path.held, state.value_of(path.held), self.value, state.evaluation.potential.space):
            return self._here(state, load)
        path.set_out(state, state.value_of(path.held))
        return self._here(path.to(self.value, False)[0], load)

    def _here(self, state: State, load: float) -> State:
        """A state of one scene as one of the family."""
        result = correct(self.family, self.control(load), state.x, state.pressure, magnetic=load)
        if result.status is Status.CONVERGED:
            return State.of(result, state.iterations)
        # at a fold no corrector finds it under the control; it is known as well as it was
        evaluation = self.family.evaluate(state.x, state.pressure, load)
        return State(state.x, state.pressure, evaluation, state.iterations, state.correction, state.residual, state.gap)

    # --- the values after it

    def _arrived(self, state: State, load: float, turn: Turn | None) -> tuple[State, Turn | None]:
        self.state, self.load = state, load
        member = self._member(load)
        if unresolved := unresolved_source(member, state.x):
            raise SolveError(unresolved, status=Status.DIPOLE_CONTACT)
        refuse_unresolved(member, state)
        return state, turn

    def _landed(self, error: SolveError, load: float, jump: bool) -> tuple[State, Turn | None]:
        """At the next stable state at a value that steps in the number did not reach, where it may be gone to."""
        last = error.result[-1] if error.result else self.state
        if last is None:
            raise error
        number, control = last.evaluation.factor, self.control(load)
        problem = ControlledProblem(self.family, self.held.at(self.value), self.scale)
        start = first_controlled(problem, last.x, last.pressure, number, 1 if load > number else -1)
        minima = self.corrector is minimize_and_verify

        def stable(state: State) -> bool:
            return is_minimum(self.family, control, state.evaluation)

        def beside(fold: Located[NumberPoint]) -> State | None:
            return self._beside(fold.point, load, stable)

        limit = beyond_turn(problem, start, load, stable, any_before=not minima, beside=beside)
        snapped = None
        if jump and limit.landing is None and self.family.obstacles and self.held in DOWNHILL:
            left = limit.fold.point.state if limit.fold else last
            snapped = stopped(self._member(load, built=True), self.held.at(self.value), left)
            limit = limit if snapped is None else replace(limit, landing=self._here(snapped, load))
        turn = NumberTurn(limit, self.name)
        if limit.fold is None and limit.ill_posed is not None and limit.landing is None:
            raise slackness(self._member(limit.ill_posed.evaluation.factor), limit.ill_posed) from error
        if limit.landing is None or not (jump or limit.fold is None):
            raise SolveError(str(turn), status=turn.status or error.status) from error
        self.memory = Predictor()
        return self._arrived(limit.landing, load, turn if limit.fold or snapped else None)

    def _beside(self, fold: NumberPoint, load: float, stable: Callable[[State], bool]) -> State | None:
        """The first stable state on the branch of the scene with a value of the number, beyond the place where the branch over it turned.

        There the held quantity is stationary along the branch of one scene too, and both have one tangent. In the plane across it the way
        leads from the scene of the turn to the scene that is asked for.
        """
        member, row = self._member(load), BranchProblem(self.family).dual(fold.tangent[:-1])
        across = ArcLengthControl(row[:-1], float(row[-1]), fold.state.x, fold.state.pressure)
        try:
            states = march(self.family, fold.state, lambda number: across, fold.number, load, parameter="number")
            state = replace(states[-1], evaluation=member.evaluate(states[-1].x, states[-1].pressure))
            start = first_point(member, state, 1)
            if row @ start.tangent < 0:
                start = first_point(member, state, -1)
            for segment in follow(member, start, _MAX_STEPS):
                if ill_posed(member, segment.b.state.evaluation) is not None or abs(segment.b.state.volume) > FAR * moderate(member):
                    return None
                for met in segment.crossings(self.held.name, self.value):
                    here = self._here(met.state, load)
                    if stable(here):
                        return here
        except SolveError:  # of this side nothing is known; the branch over the number goes on
            return None
        return None
