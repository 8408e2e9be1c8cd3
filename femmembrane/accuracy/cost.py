"""Work against precision: the cost and the error of one equilibrium, on every mesh and by every method.

Everything runs in one process and in turns (:func:`in_turns`): every piece of work once, then every piece again. So other work of the
machine falls on all pieces alike. Medians are compared.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import SolveError, Status
from ..potential import Array, Potential, potential_of
from ..results.cost import STARTS, Measurement, Reference
from ..scene import MAX_DEGREE, Scene
from ..solve.controls import CONTROLS
from ..solve.minimize import minimize_and_verify, nlp_functions
from ..solve.newton import correct
from ..solve.start import cold_start
from ..solve.state import Predictor, State
from ..solve.stepping import Corrector, march
from ..stability.profile import profile_at
from .collocation import collocate
from .shooting import shoot, shoot_as_published
from .strong_form import Guess, Solution

Clock = Callable[[], float]

SOLVERS: Mapping[str, Corrector] = {"newton": correct, "ipopt": minimize_and_verify}
#: the independent methods and the tolerances at which each is measured; shooting as published is slow
METHODS: Mapping[str, Callable[..., Solution]] = {"shooting": shoot, "collocation": collocate, "published": shoot_as_published}
TOLERANCES: Mapping[str, tuple[float, ...]] = {
    "shooting": (1e-4, 1e-6, 1e-8, 1e-10, 1e-12),
    "collocation": (1e-2, 1e-4, 1e-6, 1e-8, 1e-10),
    "published": (1e-3, 1e-5, 1e-7),
}

#: places of the profile that collocation sets out from, as parts of the meridian
_SHARES = np.linspace(0, 1, 33)
#: a state with a relative error above this is another equilibrium, not an inaccurate one
_ANOTHER = 0.5
#: shortest turn in seconds, most calls in one, and most times a problem is built
_TURN, _MOST_CALLS, _BUILDS = 0.01, 50, 3
#: errors of a reference below this are not claimed
_ROUND_OFF = 1e-14


@dataclass(frozen=True)
class Outcome:
    """What a piece of work found: the measured quantity and counts."""

    value: float = np.nan
    iterations: int | None = None
    evaluations: int | None = None
    converged: bool = True
    message: str = ""


@dataclass(frozen=True)
class Job:
    """A piece of work and the line that its time belongs to; ``setup`` is the same work on a problem yet to be built."""

    line: Measurement
    work: Callable[[], Outcome]
    setup: Callable[[], Outcome] | None = None


def in_turns(works: Sequence[Callable[[], Any]], repeat: int, budget: float, clock: Clock) -> tuple[list[Any], list[list[float]]]:
    """Do every piece of work ``repeat`` times, in turns.

    The first call of a piece, which may build things once, is not counted, unless it alone takes more than the ``budget`` in seconds. A
    piece is not repeated once its calls have taken that long. Quick work is done several times in a turn, so that it finds its data in the
    processor's cache as it would in a run; the turn's mean counts.

    Returns
    -------
    results : list
        Of the first calls.
    seconds : list of list of float
        One for each turn that counts, one or more for each piece.
    """
    results, seconds, calls = [], [], []
    for work in works:
        begin = clock()
        results.append(work())
        first = clock() - begin
        seconds.append([first] if first > budget else [])
        calls.append(int(min(max(_TURN / max(first, 1e-6), 1), _MOST_CALLS)))
    for _ in range(repeat):
        for work, times, n in zip(works, seconds, calls, strict=True):
            if sum(times) * n <= budget:
                begin = clock()
                for _ in range(n):
                    work()
                times.append((clock() - begin) / n)
    return results, seconds


def measure(jobs: Sequence[Job], reference: float, repeat: int, budget: float, clock: Clock) -> list[Measurement]:
    """The lines of all jobs with their times and errors."""
    setups = [(k, job.setup) for k, job in enumerate(jobs) if job.setup is not None]
    # apart from the rest: the problems that they build would push the problems of the others out of the caches
    _, building = in_turns([setup for _, setup in setups], min(repeat, _BUILDS), budget, clock)
    for k, _ in setups:
        jobs[k].work()  # this call builds what is kept: the very first call counts only for work without a set-up
    results, seconds = in_turns([job.work for job in jobs], repeat, budget, clock)
    medians = [1e3 * statistics.median(times) for times in seconds]
    # the extra of a first solve; on a noisy machine a difference of medians may fall below zero
    extra = {k: max(1e3 * statistics.median(times) - medians[k], 0.0) for (k, _), times in zip(setups, building, strict=True)}
    lines = []
    for k, (job, outcome) in enumerate(zip(jobs, results, strict=True)):
        line = replace(
            job.line,
            milliseconds=medians[k],
            setup_milliseconds=extra.get(k, np.nan),
            iterations=outcome.iterations,
            evaluations=outcome.evaluations,
            repeats=len(seconds[k]),
            converged=outcome.converged,
            message=outcome.message,
        )
        lines.append(_judged(line, outcome.value, reference))
    return lines


def _judged(line: Measurement, value: float, reference: float) -> Measurement:
    if line.what != "solve":
        return line
    error = relative_error(value, reference)
    if line.converged and error <= _ANOTHER:
        return replace(line, error=error)
    message = line.message or f"another equilibrium, or far too coarse: {value:.6g}"
    return replace(line, converged=False, message=message, milliseconds=np.nan, setup_milliseconds=np.nan)


def relative_error(value: float, exact: float) -> float:
    """|value - exact| over |exact|, or itself where that is zero."""
    return abs(value - exact) / (abs(exact) or 1.0)


def with_front(lines: Sequence[Measurement], floor: float) -> tuple[Measurement, ...]:
    """The lines, with a mark at every solve that no other solve with the same start beats in both time and error.

    Errors below ``floor``, the error of the reference, count as equal.
    """
    marked = list(lines)
    for start in STARTS:
        best = np.inf
        own = [k for k, line in enumerate(lines) if line.what == "solve" and line.start == start and line.converged]
        for k in sorted(own, key=lambda k: (lines[k].milliseconds, lines[k].error)):
            error = max(lines[k].error, floor)
            if error < best:
                marked[k], best = replace(lines[k], front=True), error
    return tuple(marked)


class Course:
    """Three neighbouring loads, the last one the load that is measured, and their states on a fine mesh.

    Parameters
    ----------
    scene : Scene
    control : {"volume", "pressure", "center_height"}
    load : float
    step : float, optional
        Between the loads; default a sixtieth of the load (0.02 at zero).
    elements : int
        Of degree 8, for the reference.

    Raises
    ------
    SolveError
        When the reference cannot be found.
    """

    def __init__(self, scene: Scene, control: str, load: float, step: float | None, elements: int) -> None:
        self.scene, self.control, self.load = scene, control, load
        step = (abs(load) / 60 or 0.02) if step is None else step
        direction = -1.0 if load < 0 else 1.0
        self.loads = [load - 2 * direction * step, load - direction * step, load]
        self.control_at = CONTROLS[control].at
        self.potential = potential_of(self.on_mesh(elements, MAX_DEGREE))
        self.states = self.follow(self.potential, cold_start(self.potential, CONTROLS[control], self.loads[0]))
        coarser = potential_of(self.on_mesh(max(elements // 2, 1), MAX_DEGREE))
        result = correct(coarser, self.control_at(load), self.interpolate(2, coarser), self.states[2].pressure)
        value = self.quantity(self.states[2])
        error = max(relative_error(self.quantity(result), value), _ROUND_OFF)
        self.reference = Reference(value, error, elements, MAX_DEGREE)

    def on_mesh(self, elements: int, degree: int) -> Scene:
        """The scene on another mesh of the same shape, graded alike, without a run and analyses."""
        mesh = self.scene.mesh.with_elements(elements)
        return self.scene.replace(mesh=mesh, degree=degree, run=None, analysis=type(self.scene.analysis)())

    def quantity(self, state: Any) -> float:
        """What is compared: the pressure, or the volume where the pressure is given."""
        return float(state.evaluation.volume if self.control == "pressure" else state.pressure)

    def interpolate(self, index: int, potential: Potential) -> Array:
        """The fine state at one of the loads on another mesh."""
        points = potential.space.interpolation_points()
        u, _, w, _ = self.potential.space.displacement(self.states[index].x, points.ravel())
        return potential.space.interpolate(u.reshape(points.shape), w.reshape(points.shape))

    def follow(self, potential: Potential, first: State) -> list[State]:
        """States at the three loads from one at the first."""
        states, path = [first], Predictor()
        for here, there in zip(self.loads[:-1], self.loads[1:], strict=True):
            states.append(march(potential, states[-1], self.control_at, here, there, path=path)[-1])
        return states

    def step(self, potential: Potential, first: State | None = None) -> Callable[[str, Potential], State]:
        """The last load step on a mesh, ready to be done any number of times: solver and potential -> state.

        The states before are found beforehand, from the fine ones unless a first state is given.
        """
        if first is None:
            result = correct(
                potential, self.control_at(self.loads[0]), self.interpolate(0, potential), self.states[0].pressure, damped=True
            )
            if result.status is not Status.CONVERGED:
                raise SolveError("no equilibrium near the fine one was found on this mesh", status=result.status)
            first = State.of(result)
        path = Predictor()
        here = march(potential, first, self.control_at, self.loads[0], self.loads[1], path=path)[-1]

        def again(solver: str, problem: Potential) -> State:
            memory = Predictor(list(path.sigma), list(path.point), list(path.slope))
            states = march(problem, here, self.control_at, self.loads[1], self.load, path=memory, corrector=SOLVERS[solver])
            states[-1].iterations = sum(s.iterations for s in states)
            return states[-1]

        return again

    def cold(self, solver: str, problem: Potential) -> State:
        """The equilibrium without a neighbour, as :func:`femmembrane.equilibrium` finds it."""
        start = cold_start(problem, CONTROLS[self.control], self.load)
        result = SOLVERS[solver](problem, self.control_at(self.load), start.x, start.pressure)
        if result.status is not Status.CONVERGED:
            raise SolveError("the cold start was not confirmed", status=result.status)
        return State.of(result, start.iterations)

    def guess(self) -> Guess:
        """Where the independent methods set out: the two states before the last on a straight line to the load."""
        first, last = self.potential.space.ends[[0, -1]]
        places, known = first + (last - first) * _SHARES, []
        places[-1] = last
        for state in self.states[:2]:
            profile = profile_at(self.potential.scene, state.x, state.pressure, places).columns(None)
            height = self.potential.space.center_height(state.x)
            known.append(Guess(float(state.pressure), height, float(profile["stretch_1"][0]), profile))
        return known[1].beyond(known[0])


def most_meshes() -> int:
    """Number of meshes on which IPOPT can be measured in turns: as many problems as are kept built. More would be built again in every
    turn.
    """
    kept = nlp_functions.cache_info().maxsize
    return 10_000 if kept is None else max(kept - 2, 1)


def element_jobs(
    course: Course, degrees: Sequence[int], elements: Sequence[int], solvers: Sequence[str], starts: Sequence[str]
) -> list[Job]:
    """Jobs of the finite elements; a mesh on which the branch cannot be followed to the last step has no warm one."""
    jobs = []
    for degree in degrees:
        for n in elements:
            scene = course.on_mesh(n, degree)
            potential = potential_of(scene)
            line = Measurement("solve", "", "", degree, n, potential.space.n_free)
            warm: Callable[[str, Potential], State]
            try:
                warm = course.step(potential)
            except SolveError as error:
                warm = _raising(error)
            for solver in solvers:
                for start, solve in (("warm", warm), ("cold", course.cold)):
                    if start in starts:
                        own = replace(line, method=solver, start=start)
                        build = _built(course, scene, solve, solver) if start == starts[0] else None
                        jobs.append(Job(own, _solved(course, solve, solver, potential), build))
    return jobs


def _solved(course: Course, solve: Callable[[str, Potential], State], solver: str, potential: Potential) -> Callable[[], Outcome]:
    def work() -> Outcome:
        try:
            state = solve(solver, potential)
        except SolveError as error:
            return Outcome(converged=False, message=str(error))
        return Outcome(course.quantity(state), state.iterations)

    return work


def _built(course: Course, scene: Scene, solve: Callable[[str, Potential], State], solver: str) -> Callable[[], Outcome]:
    def work() -> Outcome:
        fresh = Potential(scene, quadrature=2 * scene.degree + 1)  # the usual one, asked for by number: nothing kept from before is used
        return _solved(course, solve, solver, fresh)()

    return work


def _raising(error: SolveError) -> Callable[[str, Potential], State]:
    def solve(solver: str, potential: Potential) -> State:
        raise error

    return solve


def method_jobs(course: Course, methods: Sequence[str], tolerances: Mapping[str, Sequence[float]]) -> list[Job]:
    """Jobs of the independent methods, all warm; none for a scene without a strong form, which they do not solve."""
    if not methods:
        return []
    jobs, guess = [], course.guess()
    for method in methods:
        for tolerance in tolerances[method]:
            line = Measurement("solve", method, "warm", tolerance=tolerance)
            jobs.append(Job(line, _shot(course, METHODS[method], guess, tolerance)))
    return jobs


def _shot(course: Course, solve: Callable[..., Solution], guess: Guess, tolerance: float) -> Callable[[], Outcome]:
    def work() -> Outcome:
        found = solve(course.scene, guess=guess, tolerance=tolerance, **{course.control: course.load})
        value = found.volume if course.control == "pressure" else found.pressure
        return Outcome(value, found.iterations, found.evaluations, found.converged, found.message)

    return work
