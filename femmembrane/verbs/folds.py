"""Folds followed while a number of the scene changes: where limit points and volume folds move, appear and vanish."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from ..checks import sign
from ..errors import InputError, SolveError, Status
from ..potential import Array, Evaluation, Family, Potential, potential_of
from ..results.folds import Cusp, FoldCurve
from ..results.records import Equilibrium, SpecialPoint
from ..scene import Scene
from ..scene.variation import Parameter
from ..solve import state_resolution, wellposed
from ..solve.branch import FOLDS
from ..solve.continuation import StepControl, Tracer, trace_points
from ..solve.fold_curve import KINDS, FoldProblem, first_fold
from ..solve.number_curve import NUMBER, TURN, NumberPoint
from ..solve.segment import Located, Segment
from ..solve.start import CONTACT
from ..solve.state import Predictor
from ..threads import one_thread
from .arguments import check_ill_posed, check_max_steps, check_scene
from .state_records import record

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
        Of kind limit_point or volume_fold, from :func:`femmembrane.trace`.
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
        A SolveError carries the curve up to the failure as ``result``.

    Examples
    --------
    The limit point of a Mooney-Rivlin disc, as the material becomes neo-Hookean:

    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.MooneyRivlin(0.05), mesh=fm.disc(8))
    >>> limit = fm.trace(scene, until={"volume": 10.0}).special_points[0]
    >>> curve = fm.fold_curve(scene, start=limit, parameter="material.ratio", bounds=(0.0, 0.06), direction=-1)
    >>> print(f"P = {curve.pressure[0]:.4f} at {curve.values[0]:.2f}, P = {curve.pressure[-1]:.4f} at {curve.values[-1]:.2f}")
    P = 2.1605 at 0.05, P = 1.8792 at 0.00
    """
    check_scene(scene)
    named = Parameter(scene, parameter)
    low, high = _bounds(named, bounds, direction)
    check_ill_posed(ill_posed)
    check_max_steps(max_steps)
    clock = time.perf_counter()
    family = Family(scene, named.vary)
    _check_start(start, family)
    problem = FoldProblem(family, start.kind, high - low, (low, high))
    point = first_fold(problem, start.equilibrium.state, start.pressure, named.value, direction)
    following = _Following(problem, named, (low, high), [], [], {"setup": time.perf_counter() - clock, "solve": 0.0, "cusps": 0.0})
    following.add(point)
    status, message, closed = following.follow(point, steps or _STEPS, int(max_steps), ill_posed)
    curve = following.curve(status, message, closed)
    if throw and message:
        raise SolveError(message, status=status, result=curve)
    return curve


@dataclass
class _Following:
    """A fold curve under way."""

    problem: FoldProblem
    parameter: Parameter
    bounds: tuple[float, float]
    found: list[Equilibrium]
    cusps: list[Cusp]
    timings: dict[str, float]

    def follow(self, first: NumberPoint, steps: StepControl, max_steps: int, ill_posed: str) -> tuple[Status, str, bool]:
        """Step until a bound is met or the curve closes: status, message (empty if all went well), and whether it closed."""
        point, points = first, trace_points(self.problem, first, Tracer(Predictor(), steps.first, steps))
        for _ in range(max_steps):
            clock = time.perf_counter()
            try:
                new = next(points)
                self.timings["solve"] += time.perf_counter() - clock
                clock, segment = time.perf_counter(), Segment(self.problem, point, new)
                turns = segment.folds(TURN)
                self.timings["cusps"] += time.perf_counter() - clock
            except SolveError as error:
                return *self._ended(error, point), False
            if segment.passes(first):
                self._add_cusps(t for t in turns if t.point.sigma <= segment.b.sigma)
                self.found.append(self.found[0])
                return Status.CONVERGED, "", True
            beyond = [t.point.number for t in turns if not self.bounds[0] <= t.point.number <= self.bounds[1]]
            if beyond:
                new = segment.crossings(NUMBER, self.bounds[0] if beyond[0] < self.bounds[0] else self.bounds[1])[0]
            scene = self.parameter.scene_at(new.number)
            unresolved = ill_posed == "stop" and state_resolution.unresolved(self.problem.family, new.state, scene)
            if unresolved:
                return Status.NOT_RESOLVED, f"at {self._place(new)} {unresolved}", False
            self._add_cusps(t for t in turns if t.point.sigma <= new.sigma)
            self.add(new)
            if new.number in self.bounds:
                return Status.CONVERGED, "", False
            bad = wellposed.ill_posed(*self._own(new))
            if bad is not None and ill_posed == "stop":
                return bad.status, f"at {self._place(new)} {bad}, and what a mesh finds beyond depends on the mesh", False
            if self._clearance(new) < (least := CONTACT * self.problem.family.space.unit):
                return Status.DIPOLE_CONTACT, f"the membrane came within {least:g} of a source at {self._place(new)}", False
            point = new
        return Status.STEP_LIMIT, f"{max_steps} steps were made without meeting a bound of {self.parameter.name}", False

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
        return record(self.parameter.scene_at(point.number), potential, replace(point.state, evaluation=evaluation))

    def _own(self, point: NumberPoint) -> tuple[Potential, Evaluation]:
        """Potential and evaluation of a point: those of its own scene where a finer space must be asked whether a compression is real."""
        if wellposed.apparent(self.problem.family, point.state.evaluation) is None:
            return self.problem.family, point.state.evaluation
        potential = potential_of(self.parameter.scene_at(point.number))
        return potential, potential.evaluate(point.state.x, point.state.pressure)

    def _clearance(self, point: NumberPoint) -> float:
        """Smallest distance between a node and a source."""
        space, sources = self.problem.family.space, self.parameter.scene_at(point.number).sources
        s = space.node_parameters()
        (R, Z), (u, _, w, _) = space.mesh.position(s), space.evaluate(point.state.x, s)
        return min((float(np.sqrt(source.distance_squared(R + u, Z + w).min())) for source in sources), default=np.inf)

    def _ended(self, error: SolveError, point: NumberPoint) -> tuple[Status, str]:
        near = self._clearance(point)
        if near < 50 * CONTACT * self.problem.family.space.unit:
            return Status.DIPOLE_CONTACT, f"{error}; the membrane is within {near:.2g} of a source"
        wrinkled = self.problem.family.scene.tension_field and not point.state.evaluation.stress.all()
        hint = "; where zones of wrinkles end a tension field has no third derivatives, which this needs: trace at each value instead"
        return error.status, f"{error}{hint if wrinkled else ''}"

    def _place(self, point: NumberPoint) -> str:
        return f"{self.parameter.name} = {point.number:.6g} (V = {point.state.volume:.6g}, P = {point.state.pressure:.6g})"

    def curve(self, status: Status, message: str, closed: bool) -> FoldCurve:
        values = _frozen([Parameter(eq.scene, self.parameter.name).value for eq in self.found])
        pressure, volume, height = (_frozen([getattr(eq, q) for eq in self.found]) for q in ("pressure", "volume", "center_height"))
        return FoldCurve(
            kind=self.problem.kind,
            parameter=self.parameter.name,
            values=values,
            pressure=pressure,
            volume=volume,
            center_height=height,
            cusps=tuple(self.cusps),
            equilibria=tuple(self.found),
            closed=closed,
            status=status,
            message=message,
            timings=self.timings,
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
        raise InputError("start", start, "a special point is allowed, such as fm.trace(scene, ...).special_points[0]")
    if start.kind not in KINDS:
        raise InputError("start", start.kind, "a special point of kind " + " or ".join(KINDS) + " is allowed")
    if start.equilibrium.state.shape != (family.space.n_free,):
        raise InputError("start", start, f"a point with {family.space.n_free} unknowns (the same mesh and degree) is allowed")
