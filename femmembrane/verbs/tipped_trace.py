"""A trace that sets out at an azimuthal onset: what is asked, and how it is stepped."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from ..checks import sign, whole
from ..discretization.harmonics import Harmonics
from ..errors import InputError, SolveError, Status
from ..potential import Array, Potential, potential_of
from ..potential.surface import refusal
from ..potential.tipped import tipped_potential
from ..results.special_point import SpecialPoint
from ..results.tipped import TippedBranch, TippedEquilibrium
from ..results.tipped import TippedPoint as Fold
from ..scene import Scene
from ..scene.run import GAS
from ..solve.continuation import StepControl, Tracer, trace_points
from ..solve.controls import check_height
from ..solve.segment import Segment
from ..solve.state import Predictor
from ..solve.tipped import TippedPoint, TippedProblem, compressed
from ..stability.azimuthal import onset_mode
from .arguments import check_max_steps
from .targets import in_words, turned_back
from .trace_run import checked_targets

#: harmonics to begin with, how many are added at a time, and the most
_FIRST, _MORE, MOST = 4, 2, 24
#: size of the harmonics left out, over that of the membrane, from which on more are taken; and from which on they are missed
_TOLERANCE, _MISSED = 5e-5, 1e-3

OnStep = Callable[[int, int, TippedEquilibrium], None]


@dataclass(frozen=True, eq=False)
class TippedRequest:
    """A branch with waves around the axis, followed by arc length from an azimuthal onset.

    Attributes
    ----------
    start : SpecialPoint
    targets : mapping of str to float
        Values of volume, pressure or center_height at which it ends.
    direction : {1, -1}
        Which of the two halves; they are turned by half a wave against each other.
    max_steps : int
    steps : StepControl
    special_points : bool
    harmonics : int or None
        K; None chooses it along the way.
    """

    start: SpecialPoint
    targets: Mapping[str, float] = field(default_factory=dict)
    direction: int = 1
    max_steps: int = 400
    steps: StepControl = field(default_factory=StepControl)
    special_points: bool = True
    harmonics: int | None = None

    @classmethod
    def checked(
        cls,
        start: SpecialPoint,
        until: Mapping[str, float] | None,
        *,
        direction: int,
        max_steps: int,
        steps: StepControl | None,
        special_points: bool,
        harmonics: int | None,
    ) -> TippedRequest:
        """The request that the arguments of :func:`femmembrane.trace` make, or InputError."""
        targets = checked_targets(until)
        if GAS in targets:
            raise InputError("until.gas", targets[GAS], "volume, pressure and center_height are allowed of states with waves")
        direction = sign("direction", direction)
        check_max_steps(max_steps)
        if harmonics is not None:
            harmonics = whole("harmonics", harmonics, least=1, most=MOST)
        return cls(start, targets, direction, int(max_steps), steps or StepControl(), special_points, harmonics)


class TippedRun:
    """A trace with waves under way."""

    def __init__(self, scene: Scene, request: TippedRequest, on_step: OnStep | None = None) -> None:
        onset = request.start.equilibrium
        if scene.open:
            scene = onset.scene
        self.scene, self.request, self.on_step = scene, request, on_step
        self.potential: Potential = potential_of(scene)
        if potential_of(onset.scene).root is not self.potential.root:  # a state in contact has its own mesh
            raise InputError("start", "azimuthal_onset", "one of the special_points of a branch of this scene is allowed")
        if reason := refusal(self.potential):
            raise InputError("start", "azimuthal_onset", f"the states beyond it are not computed: {reason}")
        self.waves = request.start.azimuthal
        if self.waves == 1 and self.potential.space.spins:
            advice = (
                "a sphere may be turned under its shape at no cost; beyond n = 1 its shape is one of revolution: start at the branch_point"
            )
            raise InputError("start", "azimuthal_onset", advice)
        if "center_height" in request.targets:
            check_height("until.center_height", self.potential)
        self.found: list[TippedEquilibrium] = []
        self.folds: list[Fold] = []
        self.timings = {"solve": 0.0, "special_points": 0.0, "verdicts": 0.0}
        self.short = 0.0
        self.problem = self._problem(request.harmonics or _FIRST)

    def _problem(self, order: int) -> TippedProblem:
        return TippedProblem(tipped_potential(self.potential, self.waves, order))

    def follow(self) -> TippedBranch:
        """Step to the end."""
        request, eq = self.request, self.request.start.equilibrium
        numbers, mode = onset_mode(self.potential, eq.state, eq.pressure, self.waves)
        harmonics: Harmonics = self.problem.tipped.harmonics
        onset = self.problem.onset(eq.state, eq.pressure, request.direction * harmonics.of_mode(1, numbers, mode))
        self._add(onset)
        point, leaving = onset, True
        tracer = Tracer(Predictor(), request.steps.first, request.steps)
        for _ in range(request.max_steps):
            clock = time.perf_counter()
            try:
                new = self._next(point, tracer, leaving)
            except SolveError as error:
                return self._result(error.status, str(error))
            self.timings["solve"] += time.perf_counter() - clock
            segment = Segment(self.problem, point, new, leaving=leaving)
            if not leaving and self.problem.part(point.z, new.z) < 0:
                place = f"between V = {point.state.volume:.6g} and {new.state.volume:.6g}"
                return self._result(Status.CLOSED, f"the waves vanish {place}: the branch meets the axisymmetric one there")
            met = [p for q, v in request.targets.items() for p in segment.crossings(q, v)]
            last = min(met, key=lambda p: p.sigma, default=None)
            self._look_for_folds(segment, last)
            self._add(last or new)
            if last is not None:
                return self._result(Status.CONVERGED, "")
            refined = self._refined(new, tracer)
            if refined is None:
                return self._result(Status.NOT_RESOLVED, self._unresolved())
            point, leaving = refined, False
        message = f"{request.max_steps} steps were made without meeting {in_words(self.scene, request.targets)}"
        back = turned_back(self.scene, self.found, self.folds, request.targets)
        return self._result(Status.STEP_LIMIT, "; ".join(filter(None, [message, back])))

    def _next(self, point: TippedPoint, tracer: Tracer, leaving: bool) -> TippedPoint:
        if not leaving:
            return next(trace_points(self.problem, point, tracer))
        new = self.problem.leave(point, tracer.step)
        for each in (point, new):
            tracer.path.append(each.sigma, each.z, each.tangent)
        tracer.known = new.state.correction
        return new

    def _refined(self, point: TippedPoint, tracer: Tracer) -> TippedPoint | None:
        """The point with as many harmonics as it takes; None where the most are too few, or a state is lost with more of them."""
        if self.request.harmonics is not None:
            return point
        while self._truncation(point) > _TOLERANCE * self.potential.space.unit:
            order = self.problem.tipped.order
            if order >= MOST:
                return point if self._truncation(point) <= _MISSED * self.potential.space.unit else None
            finer = self._problem(min(order + _MORE, MOST))
            try:
                new = self.problem.carried(point, finer)
            except SolveError:
                return None
            own, other = self.problem.tipped.harmonics, finer.tipped.harmonics
            path = Predictor()
            for sigma, z, slope in zip(tracer.path.sigma[:-1], tracer.path.point, tracer.path.slope, strict=False):
                path.append(sigma, *(_carried(own, other, part) for part in (z, slope)))
            path.append(new.sigma, new.z, new.tangent)
            tracer.path, self.problem, point = path, finer, new
            self.found[-1] = self._record(point)
        return point

    def _unresolved(self) -> str:
        """Why harmonics do not resolve the last state."""
        last, order = self.found[-1], self.problem.tipped.order
        message = f"at V = {last.volume:.6g} {order} harmonics leave out about {last.truncation:.1e} R0 of the displacement"
        if order < MOST:
            message = f"the state at V = {last.volume:.6g} with {order} harmonics is lost with more of them"
        where = compressed(self.problem.tipped, last.state)
        return message if where is None else f"{message}; {where}, where the membrane wrinkles"

    def _truncation(self, point: TippedPoint) -> float:
        return truncation(self.problem.tipped.harmonics.sizes(point.state.x))

    def _look_for_folds(self, segment: Segment[TippedPoint], last: TippedPoint | None) -> None:
        if not self.request.special_points:
            return
        clock = time.perf_counter()
        try:
            located = [fold for kind in self.problem.folds for fold in segment.folds(kind)]
        except SolveError:
            located = []
        for fold in sorted(located, key=lambda f: f.point.sigma):
            if last is None or fold.point.sigma <= last.sigma:
                eq = self._record(fold.point)
                self.folds.append(Fold(fold.kind, eq.volume, eq.pressure, eq.center_height, fold.error, eq))
        self.timings["special_points"] += time.perf_counter() - clock

    def _add(self, point: TippedPoint) -> None:
        self.found.append(self._record(point))
        if self.on_step is not None:
            self.on_step(len(self.found) - 1, self.request.max_steps + 1, self.found[-1])

    def _record(self, point: TippedPoint) -> TippedEquilibrium:
        state, tipped = point.state, self.problem.tipped
        harmonics, evaluation = tipped.harmonics, state.evaluation
        sizes = harmonics.sizes(state.x)
        left = truncation(sizes)
        x = state.x.copy()
        x.flags.writeable = False
        shift = tipped.shape(x, np.zeros(1))[0][0, 0, 0] if self.waves == 1 and self.potential.space.on_axis[0] else 0.0
        return TippedEquilibrium(
            pressure=state.pressure,
            volume=state.volume,
            center_height=point.value("center_height"),
            waves=self.waves,
            harmonics=tipped.order,
            amplitude=float(np.sqrt((sizes[1:] ** 2).sum())),
            shift=float(shift),
            truncation=left,
            elastic_energy=float(evaluation.elastic_energy),
            magnetic_energy=float(evaluation.magnetic_energy),
            load_energy=float(evaluation.load_energy),
            electric_energy=float(evaluation.electric_energy),
            residual=state.residual,
            iterations=state.iterations,
            status=self._status(x, left),
            scene=self.scene,
            state=x,
        )

    def _status(self, x: Array, left: float) -> Status:
        if left > _MISSED * self.potential.space.unit:
            return Status.NOT_RESOLVED
        return Status.CONVERGED if compressed(self.problem.tipped, x) is None else Status.LEGENDRE_FAILURE

    def _result(self, status: Status, message: str) -> TippedBranch:
        missed = max((eq for eq in self.found if eq.status is Status.NOT_RESOLVED), key=lambda eq: eq.truncation, default=None)
        if missed is not None and status in (Status.CONVERGED, Status.STEP_LIMIT):
            status = Status.NOT_RESOLVED
            few = f"harmonics = {missed.harmonics} are too few"
            message = f"{few}: about {missed.truncation:.1e} R0 of the displacement is left out; raise harmonics"
        folds = tuple(self.folds) if self.request.special_points else None
        return TippedBranch(self.scene, tuple(self.found), status, message, folds, dict(self.timings))


def truncation(sizes: Array) -> float:
    """Estimated size of the harmonics beyond the last one: the last one itself, or what a geometric series through the two before expects
    of it where that is more."""
    last = float(sizes[-1])
    return max(last, float(sizes[-2] ** 2 / sizes[-3])) if len(sizes) > 3 and sizes[-3] > 0 else last


def _carried(own: Harmonics, other: Harmonics, z: Array) -> Array:
    return np.append(own.carried(z[:-1], other), z[-1])


def trace_tipped(scene: Scene, request: TippedRequest, on_step: OnStep | None = None) -> TippedBranch:
    """Follow the branch that sets out at an azimuthal onset.

    Raises
    ------
    InputError
        Where the states beyond the onset are not computed, with the reason.
    """
    return TippedRun(scene, request, on_step).follow()
