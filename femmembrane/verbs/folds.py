"""Folds followed while a number of the scene changes: where limit points and volume folds move, appear and vanish."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..checks import sign
from ..errors import InputError, SolveError, Status
from ..potential import Array, Evaluation, Family, Potential, potential_of
from ..results.folds import Cusp, FoldCurve
from ..results.records import Equilibrium, SpecialPoint
from ..scene import Scene
from ..scene.variation import Parameter
from ..solve import state_resolution, wellposed
from ..solve.continuation import StepControl
from ..solve.fold_curve import KINDS, FoldPoint, FoldSegment, FoldSystem, first_fold, fold_points
from ..solve.start import CONTACT
from ..solve.state import State
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

    The curve is followed by arc length in displacement, pressure and number (the number in units of the width of ``bounds``), so that it
    passes the points where two folds merge and comes back on the other one.

    Parameters
    ----------
    scene : Scene
        The scene of ``start``.
    start : SpecialPoint
        Of kind limit_point or volume_fold, from :func:`femmembrane.trace`.
    parameter : str
        ``source.K.strength``, ``source.K.height`` (K from 0), ``membrane.susceptibility``, or a number of the material. For Ogden's:
        ``material.mu.K``, where the other moduli are scaled by one factor, and ``material.alpha.K``, where mu_K alpha_K stays, so that
        the sum of mu alpha stays 2.
    bounds : (float, float)
        Smallest and largest value; the last point lies exactly on the bound that is met.
    direction : {1, -1}
        1 sets out towards larger values.
    max_steps : int
    steps : StepControl, optional
        Lengths and accuracy of the steps; default those of a trace, but none longer than 0.1.
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
        The latter carries the curve up to the failure as ``result``.
    """
    check_scene(scene)
    named = Parameter(scene, parameter)
    low, high = _bounds(named, bounds, direction)
    check_ill_posed(ill_posed)
    check_max_steps(max_steps)
    clock = time.perf_counter()
    family = Family(scene, named.vary)
    _check_start(start, family)
    system = FoldSystem(family, start.kind, high - low)
    point = first_fold(system, start.equilibrium.state, start.pressure, named.value, direction)
    following = _Following(system, named, (low, high), [], [], {"setup": time.perf_counter() - clock, "solve": 0.0, "cusps": 0.0})
    following.add(point)
    status, message, closed = following.follow(point, steps or _STEPS, int(max_steps), ill_posed)
    curve = following.curve(status, message, closed)
    if throw and message:
        raise SolveError(message, status=status, result=curve)
    return curve


@dataclass
class _Following:
    """A fold curve under way."""

    system: FoldSystem
    parameter: Parameter
    bounds: tuple[float, float]
    found: list[Equilibrium]
    cusps: list[Cusp]
    timings: dict[str, float]

    def follow(self, first: FoldPoint, steps: StepControl, max_steps: int, ill_posed: str) -> tuple[Status, str, bool]:
        """Step until a bound is met or the curve closes: status, message (empty if all went well), and whether it closed."""
        point, points = first, fold_points(self.system, first, self.bounds, steps)
        for _ in range(max_steps):
            clock = time.perf_counter()
            try:
                new = next(points)
                self.timings["solve"] += time.perf_counter() - clock
                clock, segment = time.perf_counter(), FoldSegment(self.system, point, new)
                turns = segment.turns()
                self.timings["cusps"] += time.perf_counter() - clock
            except SolveError as error:
                return *self._ended(error, point), False
            if segment.passes(first):
                self._add_cusps(t for t in turns if t[0].sigma <= segment.b.sigma)
                self.found.append(self.found[0])
                return Status.CONVERGED, "", True
            beyond = [t for t, _ in turns if not self.bounds[0] <= t.number <= self.bounds[1]]
            if beyond:
                bound = self.bounds[0] if beyond[0].number < self.bounds[0] else self.bounds[1]
                new = segment.crossing(bound, (beyond[0].sigma - point.sigma) / segment.length)
            scene = self.parameter.scene_at(new.number)
            unresolved = ill_posed == "stop" and state_resolution.unresolved(self.system.family, self._state(new), scene)
            if unresolved:
                return Status.NOT_RESOLVED, f"at {self._place(new)} {unresolved}", False
            self._add_cusps(t for t in turns if t[0].sigma <= new.sigma)
            self.add(new)
            if new.number in self.bounds:
                return Status.CONVERGED, "", False
            bad = wellposed.ill_posed(*self._own(new))
            if bad is not None and ill_posed == "stop":
                return bad.status, f"at {self._place(new)} {bad}, and what a mesh finds beyond depends on the mesh", False
            if self._clearance(new) < (least := CONTACT * self.system.family.space.unit):
                return Status.DIPOLE_CONTACT, f"the membrane came within {least:g} of a source at {self._place(new)}", False
            point = new
        return Status.STEP_LIMIT, f"{max_steps} steps were made without meeting a bound of {self.parameter.name}", False

    def add(self, point: FoldPoint) -> None:
        self.found.append(self._record(point))

    def _add_cusps(self, turns: Iterable[tuple[FoldPoint, float]]) -> None:
        for point, error in turns:
            own = point.tangent[-2] if self.system.kind == "limit_point" else point.evaluation.volume_gradient @ point.tangent[:-2]
            kind = "cusp" if abs(own) < _STATIONARY else "branch_point"
            eq = self._record(point)
            self.cusps.append(Cusp(kind, eq.volume, eq.pressure, eq.center_height, error, eq, value=point.number))

    def _record(self, point: FoldPoint) -> Equilibrium:
        potential, evaluation = self._own(point)
        return record(self.parameter.scene_at(point.number), potential, self._state(point, evaluation))

    def _state(self, point: FoldPoint, evaluation: Evaluation | None = None) -> State:
        known = point.evaluation if evaluation is None else evaluation
        return State(point.x, point.pressure, known, point.iterations, point.correction, point.residual, gap=0.0)

    def _own(self, point: FoldPoint) -> tuple[Potential, Evaluation]:
        """Potential and evaluation of a point: those of its own scene where a finer space must be asked whether a compression is real."""
        if wellposed.apparent(self.system.family, point.evaluation) is None:
            return self.system.family, point.evaluation
        potential = potential_of(self.parameter.scene_at(point.number))
        return potential, potential.evaluate(point.x, point.pressure)

    def _clearance(self, point: FoldPoint) -> float:
        """Smallest distance between a node and a source."""
        space, sources = self.system.family.space, self.parameter.scene_at(point.number).sources
        s = space.node_parameters()
        (R, Z), (u, _, w, _) = space.mesh.position(s), space.displacement(point.x, s)
        return min((float(np.sqrt(source.distance_squared(R + u, Z + w).min())) for source in sources), default=np.inf)

    def _ended(self, error: SolveError, point: FoldPoint) -> tuple[Status, str]:
        near = self._clearance(point)
        if near < 50 * CONTACT * self.system.family.space.unit:
            return Status.DIPOLE_CONTACT, f"{error}; the membrane is within {near:.2g} of a source"
        wrinkled = self.system.family.scene.tension_field and not point.evaluation.stress.all()
        hint = "; where zones of wrinkles end a tension field has no third derivatives, which this needs: trace at each value instead"
        return error.status, f"{error}{hint if wrinkled else ''}"

    def _place(self, point: FoldPoint) -> str:
        return f"{self.parameter.name} = {point.number:.6g} (V = {point.evaluation.volume:.6g}, P = {point.pressure:.6g})"

    def curve(self, status: Status, message: str, closed: bool) -> FoldCurve:
        values = _frozen([Parameter(eq.scene, self.parameter.name).value for eq in self.found])
        pressure, volume, height = (_frozen([getattr(eq, q) for eq in self.found]) for q in ("pressure", "volume", "center_height"))
        return FoldCurve(
            kind=self.system.kind,
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
