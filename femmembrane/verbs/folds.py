"""Folds followed while a number of the scene changes: where limit points and volume folds move, appear and vanish."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..checks import sign
from ..discretization.space import transferred
from ..errors import InputError, SolveError, Status
from ..potential import Array, Evaluation, Family, Potential, potential_of
from ..results.branch import Branch
from ..results.equilibrium import Equilibrium
from ..results.folds import Cusp, FoldCurve
from ..results.special_point import SpecialPoint
from ..scene import Scene
from ..scene.variation import Parameter
from ..solve import state_resolution, wellposed
from ..solve.branch import FOLDS
from ..solve.contact import stopped_by_source, touches_source
from ..solve.continuation import StepControl, Tracer, trace_points
from ..solve.fold_curve import KINDS, FoldProblem, first_fold
from ..solve.number_curve import NUMBER, TURN, NumberPoint
from ..solve.segment import Located, Segment
from ..solve.state import Predictor
from ..threads import one_thread
from .arguments import check_ill_posed, check_max_steps, check_scene
from .over_number import family_of
from .running import End, Run
from .state_records import record

if TYPE_CHECKING:
    from ..accuracy.along import Shortfall

#: rate of the fold's own quantity along the curve below which it counts as stationary too: two folds of this kind merge there
_STATIONARY = 1e-6
#: shorter steps than the corrector needs, so that a line through the points is a fair picture of the curve
_STEPS = StepControl(largest=0.1)


@one_thread
def fold_curve(
    scene: Scene,
    *,
    start: SpecialPoint,
    parameter: str,
    bounds: tuple[float, float],
    direction: int = 1,
    max_steps: int = 400,
    steps: StepControl | None = None,
    ill_posed: str = "stop",
    throw: bool = True,
) -> FoldCurve:
    """Follow a limit point or a volume fold while a number of the scene changes.

    The curve is followed by arc length in displacement, pressure and number, the number in units of the width of ``bounds``. So it passes
    the points where two folds merge: it arrives along one fold and leaves along the other.

    Parameters
    ----------
    scene : Scene
        The scene of ``start``.
    start : SpecialPoint
        Of kind limit_point or volume_fold, from :func:`femmembrane.trace`. Where the scene asks for an accuracy it may be one on any mesh:
        it is located again on the mesh that is chosen for the curve.
    parameter : str
        ``source.K.strength``, ``source.K.height`` (K from 0), ``membrane.susceptibility``, or a number of the material. Ogden's material
        has ``material.mu.K`` and ``material.alpha.K``, and the sum of mu alpha stays 2: with ``mu`` the other moduli are scaled by one
        factor, with ``alpha`` the product mu_K alpha_K stays.
    bounds : (float, float)
        Smallest and largest value; the last point lies exactly on the bound that is met.
    direction : {1, -1}
        1 sets out towards larger values.
    max_steps : int
        Most steps along the curve.
    steps : StepControl, optional
        Lengths and accuracy of the steps. Default: as for a trace, but no step is longer than 0.1.
    ill_posed : {"stop", "mark"}
        What to do where the meridional stress is compressive, as for :func:`femmembrane.trace`.
    throw : bool
        Raise when the curve ends before a bound is met; otherwise return it with its status and message.

    Returns
    -------
    FoldCurve

    Raises
    ------
    InputError, SolveError
        A SolveError carries the curve up to the failure as ``result``; without one when no mesh meets the accuracy.

    Examples
    --------
    The limit point of a Mooney-Rivlin disc, as the material becomes neo-Hookean:

    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.MooneyRivlin(0.05), mesh=fm.disc(8))
    >>> branch = fm.trace(scene, until={"volume": 10.0})
    >>> limit = next(point for point in branch.special_points if point.kind == "limit_point")
    >>> curve = fm.fold_curve(scene, start=limit, parameter="material.ratio", bounds=(0.0, 0.06), direction=-1)
    >>> print(f"P = {curve.pressure[0]:.4f} at {curve.values[0]:.2f}, P = {curve.pressure[-1]:.4f} at {curve.values[-1]:.2f}")
    P = 2.1605 at 0.05, P = 1.8792 at 0.00
    """
    check_scene(scene)
    named = Parameter(scene, parameter)
    low, high = _bounds(named, bounds, direction)
    check_ill_posed(ill_posed)
    check_max_steps(max_steps)
    request = FoldRequest(start, named, (low, high), direction, int(max_steps), steps or _STEPS, ill_posed)
    clock, shortfall, spent = time.perf_counter(), None, {}
    if scene.open:
        scene, request, shortfall = _on_chosen_mesh(scene, request)
        spent = {"mesh": time.perf_counter() - clock}
    run = FoldRun(scene, request)
    run.timings, run.shortfall = spent | run.timings, shortfall
    curve = run.follow()
    if throw and curve.message:
        raise SolveError(curve.message, status=curve.status, result=curve)
    return curve


@dataclass(frozen=True, eq=False)
class FoldRequest:
    """A fold, or a part of its curve, followed while a number of the scene changes.

    Attributes
    ----------
    start : SpecialPoint
    parameter : Parameter
        The number that changes.
    bounds : (float, float)
        Its smallest and largest value.
    direction : {1, -1}
    max_steps : int
        Most steps.
    steps : StepControl
        Lengths and accuracy of the steps.
    ill_posed : {"stop", "mark"}
        What to do where the membrane is compressed or slack.
    """

    start: SpecialPoint
    parameter: Parameter
    bounds: tuple[float, float]
    direction: int
    max_steps: int
    steps: StepControl
    ill_posed: str

    def on(self, scene: Scene) -> FoldRequest:
        """The request on the mesh of a scene, with its start carried over."""
        named = Parameter(scene, self.parameter.name)
        eq = self.start.equilibrium.of_branch if isinstance(self.start, SpecialPoint) else None
        if eq is None or eq.scene.mesh.shape != scene.mesh.shape:
            return replace(self, parameter=named)
        there = replace(eq, scene=scene, state=transferred(eq.potential.space, eq.state, potential_of(scene).space), _answers={})
        return replace(self, parameter=named, start=replace(self.start, equilibrium=there))


def _on_chosen_mesh(scene: Scene, request: FoldRequest) -> tuple[Scene, FoldRequest, Shortfall | None]:
    """The scene on a mesh that keeps its accuracy along the curve, the request there, and where the accuracy ends.

    Raises
    ------
    SolveError
        When no mesh meets the accuracy, or the curve yields nothing on a trial mesh.
    """
    from ..accuracy.along import choose_and_check

    def follow(on: Scene) -> Branch:
        curve = FoldRun(on, request.on(on)).follow()
        return Branch(on, curve.equilibria, curve.status, curve.message)

    chosen, shortfall, _ = choose_and_check(scene, follow, "arc-length")
    request = request.on(chosen)
    if shortfall is None:
        return chosen, request, None
    if shortfall.kept < 2:
        raise SolveError(str(shortfall), status=Status.ACCURACY_NOT_MET)
    return chosen, replace(request, max_steps=shortfall.kept - 1), shortfall


class FoldRun(Run[FoldCurve]):
    """A fold curve under way.

    Attributes
    ----------
    problem : FoldProblem
        The equations of the fold.
    point : NumberPoint
        The last point.
    cusps : list of Cusp
        Where two folds merge, so far.
    closed : bool
        Whether the curve came back to where it set out.
    """

    def __init__(self, scene: Scene, request: FoldRequest) -> None:
        clock, start = time.perf_counter(), request.start
        family = family_of(request.parameter)
        super().__init__(scene, family, ("setup", "solve", "cusps"))
        _check_start(start, family)
        self.request, self.parameter, self.bounds = request, request.parameter, request.bounds
        self.problem = FoldProblem(family, start.kind, self.bounds[1] - self.bounds[0], self.bounds)
        eq = start.equilibrium
        x = eq.potential.evaluate(eq.state, eq.pressure).carried(eq.state) if eq.scene.borders else eq.state
        self.point = first_fold(self.problem, x, start.pressure, self.parameter.value, request.direction)
        self.cusps: list[Cusp] = []
        self.closed, self.made = False, 0
        self.timings["setup"] = time.perf_counter() - clock
        self._first, self._points = (
            self.point,
            trace_points(self.problem, self.point, Tracer(Predictor(), request.steps.first, request.steps)),
        )
        self.add(self.point)

    def step(self) -> End | None:
        if self.made == self.request.max_steps and self.shortfall is not None:
            return Status.ACCURACY_NOT_MET, str(self.shortfall)
        if self.made == self.request.max_steps:
            return Status.STEP_LIMIT, f"{self.made} steps were made without meeting a bound of {self.parameter.name}"
        self.made += 1
        try:
            with self.timed("solve"):
                new = next(self._points)
            with self.timed("cusps"):
                segment = Segment(self.problem, self.point, new)
                turns = segment.folds(TURN)
        except SolveError as error:
            return self._ended(error)
        if segment.passes(self._first):
            self._add_cusps(t for t in turns if t.point.sigma <= segment.b.sigma)
            self.found.append(self.found[0])
            self.closed = True
            return Status.CONVERGED, ""
        beyond = [t.point.number for t in turns if not self.bounds[0] <= t.point.number <= self.bounds[1]]
        if beyond:
            new = segment.crossings(NUMBER, self.bounds[0] if beyond[0] < self.bounds[0] else self.bounds[1])[0]
        return self._unresolved(new) or self._arrived(new, turns)

    def _unresolved(self, new: NumberPoint) -> End | None:
        if self.request.ill_posed != "stop":
            return None
        unresolved = state_resolution.unresolved(self.problem.family, new.state, self.parameter.scene_at(new.number))
        return (Status.NOT_RESOLVED, f"at {self._place(new)} {unresolved}") if unresolved else None

    def _arrived(self, new: NumberPoint, turns: Sequence[Located[NumberPoint]]) -> End | None:
        """Keep a point and what was met on the way to it; the end, if the curve ends there."""
        self._add_cusps(t for t in turns if t.point.sigma <= new.sigma)
        self.add(new)
        if new.number in self.bounds:
            return Status.CONVERGED, ""
        bad = wellposed.ill_posed(*self._own(new)) if self.request.ill_posed == "stop" else None
        if bad is not None:
            return bad.status, f"at {self._place(new)} {bad}, and what a mesh finds beyond depends on the mesh"
        if touching := touches_source(self._clearance(new), self.potential.space.unit):
            return Status.DIPOLE_CONTACT, f"{touching} at {self._place(new)}"
        self.point = new
        return None

    def add(self, point: NumberPoint) -> None:
        self.found.append(self._record(point))

    def _add_cusps(self, turns: Iterable[Located[NumberPoint]]) -> None:
        for turn in turns:
            own = turn.point.rate(FOLDS[self.problem.kind])
            kind = "cusp" if abs(own) < _STATIONARY else "branch_point"
            eq = self._record(turn.point)
            self.cusps.append(Cusp(kind, eq.volume, eq.pressure, eq.center_height, turn.error, eq, value=turn.point.number))

    def _record(self, point: NumberPoint) -> Equilibrium:
        potential, evaluation = self._own(point)
        scene = self.parameter.scene_at(point.number).bordered(potential.borders)
        return record(scene, potential, replace(point.state, evaluation=evaluation))

    def _own(self, point: NumberPoint) -> tuple[Potential, Evaluation]:
        """Potential and evaluation of a point as one of its own scene."""
        evaluation = self.problem.family.home(point.state.evaluation, point.state.pressure)
        return evaluation.potential, evaluation

    def _clearance(self, point: NumberPoint) -> float:
        """Smallest distance between a node and a source."""
        space, sources = self.problem.family.space, self.parameter.scene_at(point.number).sources
        s = space.node_parameters()
        (R, Z), (u, _, w, _) = space.mesh.position(s), space.displacement(point.state.x, s)
        return min((float(np.sqrt(source.distance_squared(R + u, Z + w).min())) for source in sources), default=np.inf)

    def _ended(self, error: SolveError) -> End:
        if touching := stopped_by_source(error, self._clearance(self.point), self.potential.space.unit):
            return touching
        wrinkled = self.scene.tension_field and not self.point.state.evaluation.stress.all()
        hint = "; where zones of wrinkles end a tension field has no third derivatives, which this needs: trace at each value instead"
        return error.status, f"{error}{hint if wrinkled else ''}"

    def _place(self, point: NumberPoint) -> str:
        return f"{self.parameter.name} = {point.number:.6g} (V = {point.state.volume:.6g}, P = {point.state.pressure:.6g})"

    def result(self, status: Status, message: str, found: Sequence[Equilibrium] | None = None) -> FoldCurve:
        known = tuple(self.found if found is None else found)
        values = _frozen([Parameter(eq.scene, self.parameter.name).value for eq in known])
        pressure, volume, height = (_frozen([getattr(eq, q) for eq in known]) for q in ("pressure", "volume", "center_height"))
        return FoldCurve(
            kind=self.problem.kind,
            parameter=self.parameter.name,
            values=values,
            pressure=pressure,
            volume=volume,
            center_height=height,
            cusps=tuple(self.cusps),
            equilibria=known,
            closed=self.closed,
            status=status,
            message=message,
            timings=dict(self.timings),
        )


def _frozen(column: list[float]) -> Array:
    array = np.array(column)
    array.flags.writeable = False
    return array


def _bounds(parameter: Parameter, bounds: tuple[float, float], direction: int) -> tuple[float, float]:
    direction = sign("direction", direction, "1 (towards larger values) or -1 is allowed")
    try:
        low, high = (float(b) for b in bounds)
    except (TypeError, ValueError, OverflowError):
        raise InputError("bounds", bounds, "two finite numbers, smallest and largest, are allowed") from None
    if not (np.isfinite([low, high]).all() and low < high):
        raise InputError("bounds", bounds, "two finite numbers, smallest and largest, are allowed")
    value = parameter.value
    if not low <= value <= high or value == (high if direction == 1 else low):
        raise InputError("bounds", bounds, f"bounds around {value:.9g} with room in direction {direction:+d} are allowed")
    for bound in (low, high):
        parameter.scene_at(bound)
    return low, high


def _check_start(start: SpecialPoint, family: Family) -> None:
    if not isinstance(start, SpecialPoint):
        raise InputError("start", start, "a special point is allowed: one of fm.trace(scene, ...).special_points, picked by its kind")
    if start.kind not in KINDS:
        raise InputError("start", start.kind, "a special point of kind " + " or ".join(KINDS) + " is allowed")
    if start.equilibrium.state.shape != (family.space.n_free,):
        raise InputError("start", start, f"a point with {family.space.n_free} unknowns (the same mesh and degree) is allowed")
