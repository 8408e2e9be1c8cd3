"""A mesh that keeps a run as accurate as asked, at about the least cost.

The run is made once on a trial mesh, at a few of its loads. Its states show where the membrane is hard to describe: in each element, by the
difference between the state and its best approximation of a lower degree. Elements of degree p share that evenly if their sizes follow the
density of the misses to the power 1/(2 p + 1). There is one density for all states, in which each has the weight of its own estimated
error. The number of elements is then found by estimating the errors of the hardest states on meshes with that grading.

The degree grows by half with every digit asked for, and falls again where the fewest elements give more. Unknowns are then within a small
factor of the least possible. With equal elements the hardest of the reference scenes (recorded on 2026-11-24) need for 1e-4, 1e-6, 1e-8
and 1e-10 with degree 2: 32, 110, 326, 988; degree 4: 20, 32, 56, 104; degree 6: 18, 24, 36, 60; degree 8: 16, 24, 40, 56.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from ..discretization.curve import Curve
from ..discretization.meridian import Accuracy, Asked, Meridian, by_quantity, in_words
from ..discretization.space import Space, space_of, transferred
from ..errors import SolveError, Status
from ..potential import Array, Evaluation, Potential, potential_of
from ..scene import MAX_DEGREE, Scene
from ..solve.branch import first_point
from ..solve.controls import CONTROLS
from ..solve.finer_space import met_across, moved, solved_in
from ..solve.newton import NewtonResult
from ..solve.state import State
from ..solve.state_resolution import largest_kink
from ..solve.wellposed import ill_posed, stress_scale
from ..stability.spectrum import SpectrumError
from ..stability.verdict import axisymmetric_verdict
from .error_estimate import finer_space, same_state

if TYPE_CHECKING:
    from ..results.branch import Branch
    from ..results.equilibrium import Equilibrium

#: from a scene with a mesh to the equilibria that are wanted, or a part of them
Follow = Callable[[Scene], "Branch"]

#: states of the trial run whose errors are estimated
STATES = 12
#: most meshes that are chosen until a run is accurate enough all along
_ROUNDS = 2
#: number of these equilibria, the hardest ones, that are tried on every mesh
_TRIED = 4
#: elements of the trial meshes, tried in turn until errors can be estimated
_TRIAL_MESHES, _TRIAL_DEGREE = (12, 24, 48), 6
#: relative error above which a trial mesh says too little about the states
_BLIND = 1e-2
#: degree of the elements whose misses grade the mesh
_GRADING_DEGREE = 4
#: highest degree where zones are wrinkled and not followed: higher degrees gain nothing with borders inside elements
_WRINKLED_DEGREE = 4
#: fewer elements would do for some accuracies, but may let a run lose its branch
_FEWEST, _MOST = 3, 2000
#: estimates are off by some tens of per cent, and may use this part of the accuracy
_SHARE = 0.6
#: share and inner radius of the elements that go to the pole when its height is held: the response to a force on the pole, which decides
#: how a height converges, is logarithmic there
_POLE_SHARE, _POLE_RADIUS = 0.3, 0.005
#: smallest density of elements over the mean, and smallest pressure over the largest one that still counts by itself
_LEAST_DENSITY, _LEAST_PRESSURE = 0.1, 0.01


def choose_mesh(scene: Scene, follow: Follow, control: str) -> Scene:
    """The scene on a mesh with errors of P and of the total energy below the accuracy that its open mesh asks for.

    Errors are compared at the same volume, and in a run by heights at the same pole height. With arc length the smaller of both counts,
    since it is regular at volume folds. Relative means over the pressure, but not over less than a hundredth of the largest one of the run,
    and over the sum of the sizes of all energies. States without an estimate (compressed, slack) do not count.

    Parameters
    ----------
    scene : Scene
        Open: its mesh has an accuracy and no elements.
    follow : callable
        What is wanted, or a part of it that shows how hard it is, on a scene with a mesh; it returns what it reached.
    control : {"volume", "pressure", "center_height", "arc-length"}
        How it is wanted.

    Raises
    ------
    SolveError
        With status ACCURACY_NOT_MET when no mesh is good enough, with that of the run when it yields nothing on a trial mesh.
    """
    trial = _trial(scene, follow, control)
    return _Choice(scene, trial, _accuracy(scene)).chosen()


@dataclass(frozen=True)
class Shortfall:
    """Where a run leaves the accuracy that its mesh was chosen for. ``kept`` equilibria are as accurate as asked; ``error`` is the estimate
    for the next one, or NaN without an estimate.
    """

    kept: int
    accuracy: Asked
    error: float
    last: str

    def __str__(self) -> str:
        beyond = "no error can be estimated" if np.isnan(self.error) else f"the error is about {self.error:.1e}"
        where = f"it is kept up to {self.last}; at the next equilibrium {beyond}" if self.kept else f"at the first equilibrium {beyond}"
        return f"mesh.accuracy = {in_words(self.accuracy)} is not met all along: {where}"


def choose_and_check(scene: Scene, follow: Follow, control: str) -> tuple[Scene, Shortfall | None]:
    """As :func:`choose_mesh`, with the errors of the run on the chosen mesh estimated and, where they are too large, the mesh chosen again.

    A few states of a trial do not stand for a whole run: a run that ends in a spike below a source becomes harder without end.
    """
    controls = _controls(control)
    trial, found = _trial(scene, follow, control), None
    for _ in range(_ROUNDS):
        try:
            chosen = _Choice(scene, trial, _accuracy(scene)).chosen()
        except SolveError:
            if found is not None:
                break
            easier = trial.before_the_hardest()
            if easier is None:
                raise
            chosen = _Choice(scene, easier, _accuracy(scene)).chosen()
        branch = follow(chosen)
        shortfall = _shortfall(branch, controls, _accuracy(scene))
        if found is None or shortfall is None or (shortfall.kept > 0 and _farther(branch, shortfall, *found)):
            found = (branch, shortfall)
        if shortfall is None:
            break
        finer = follow(_on(scene, chosen.mesh.on_ends(chosen.mesh.breakpoints())))
        if not len(finer):
            break
        trial = _estimated([finer[k] for k in _checked(finer)], controls, chosen.mesh.elements, by_quantity(_accuracy(scene)))
        if not len(trial.errors):
            break
    branch, shortfall = cast("tuple[Branch, Shortfall | None]", found)
    return branch.scene, shortfall


def _farther(branch: Branch, shortfall: Shortfall, other: Branch, others: Shortfall | None) -> bool:
    """Whether this run keeps its accuracy longer than another run."""
    return others is not None and _way(branch, shortfall.kept) > _way(other, others.kept)


def _way(branch: Branch, kept: int) -> float:
    """Length of a run up to an equilibrium, in the pole's height and the volume."""
    heights, volumes = (np.array([getattr(eq, name) for eq in branch[:kept]]) for name in ("center_height", "volume"))
    return float(np.hypot(np.diff(heights), np.diff(volumes)).sum())


def _checked(branch: Branch) -> list[int]:
    """Equilibria of a run whose errors say most: some all along, the extreme ones, and the ones with the largest kinks."""
    kinks = [largest_kink(eq.potential, eq.state) for eq in branch]
    return sorted({*spread([eq.volume for eq in branch]), *np.argsort(kinks)[-_TRIED:].tolist()})


def _shortfall(branch: Branch, controls: tuple[str, ...], accuracy: Asked) -> Shortfall | None:
    """Where the accuracy ends; None when it is kept at all equilibria that were looked at."""
    if not len(branch):
        return None
    yardstick = _yardstick(branch, by_quantity(accuracy))

    def error(k: int) -> float:
        eq = branch[k]
        if eq.status.ill_posed:
            return 0.0
        found = relative_error(eq.potential, eq.state, eq.pressure, controls, yardstick)
        return _across(eq.potential, eq, yardstick.pressure) if np.isnan(found) and len(controls) > 1 else found

    good = -1
    for k in _checked(branch):
        if not error(k) <= yardstick.asked.tightest:
            first = next(i for i in range(good + 1, k + 1) if not error(i) <= yardstick.asked.tightest)
            last = f"V = {branch[first - 1].volume:.6g}, P = {branch[first - 1].pressure:.6g}" if first else ""
            return Shortfall(first, accuracy, error(first), last)
        good = k
    return None


def _across(potential: Potential, eq: Equilibrium, scale: float) -> float:
    """Estimated relative error of P next to folds of volume and height: the distance to the branch of a finer space there."""
    evaluation = potential.evaluate(eq.state, eq.pressure)
    state = State(eq.state, eq.pressure, evaluation, 0, 0.0, 0.0, 0.0)
    met = met_across(potential_of(finer_space(potential, evaluation, eq.pressure)[0]), potential, first_point(potential, state, 1))
    return abs(met.pressure - eq.pressure) / max(abs(eq.pressure), scale) if met.status is Status.CONVERGED else np.nan


def graded(s: Array, density: Array, elements: int, corners: ArrayLike = ()) -> tuple[float, ...]:
    """Ends of elements that share a density, given at points s along the meridian, evenly; with an end at every corner."""
    mass = np.append(0.0, np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(s)))
    fixed = np.unique([s[0], *np.asarray(corners, dtype=float), s[-1]])
    found = [s[:1]]
    for left, right in pairwise(fixed):
        begin, end = np.interp([left, right], s, mass)
        n = max(1, ceil(elements * (end - begin) / mass[-1] - 1e-9))
        ends = np.interp(np.linspace(begin, end, n + 1)[1:], mass, s)
        ends[-1] = right
        found.append(ends)
    return tuple(np.concatenate(found).tolist())


class _Choice:
    """The search for the number of elements and the degree."""

    def __init__(self, scene: Scene, trial: _Trial, accuracy: Asked) -> None:
        self.scene, self.trial, self.accuracy = scene, trial, accuracy
        tightest = by_quantity(accuracy).tightest
        self.target = _SHARE * tightest
        self.hardest = np.argsort(trial.errors)[::-1]
        self.density = trial.density()
        most = _WRINKLED_DEGREE if trial.wrinkled and not scene.follow_borders else MAX_DEGREE
        self.degree = int(np.clip(round(1 - np.log10(tightest) / 2), 2, most))

    def candidate(self, elements: int, degree: int) -> Scene:
        mesh = self.scene.mesh
        ends = graded(*self.density, elements, mesh.corners() if isinstance(mesh, Curve) else ())
        return self.scene.replace(mesh=mesh.on_ends(ends), degree=degree)

    def error(self, elements: int, degree: int) -> float:
        return self.trial.error_on(self.candidate(elements, degree), self.hardest[:_TRIED])

    def chosen(self) -> Scene:
        """The scene on the smallest mesh found whose errors are below their share of the accuracy at all states."""
        elements = self.fewest()
        while elements == _FEWEST and self.degree > 2 and self.error(elements, self.degree - 1) <= self.target:
            self.degree -= 1
        while True:
            found = self.candidate(elements, self.degree)
            estimated = self.trial.error_on(found, self.hardest)
            if estimated <= self.target:
                return found.replace(mesh=found.mesh.on_ends(found.mesh.breakpoints(), self.accuracy, estimated))
            if elements >= _MOST:
                raise self.not_met(estimated)
            elements = min(elements + 1 + elements // 8, _MOST)

    def fewest(self) -> int:
        """The number of elements, to a tenth or so, from which the hardest states are as good as wanted: a secant search in logarithms."""
        order = 2.0 * self.degree
        n = int(np.clip(ceil(self.trial.elements / 2 * (self.trial.errors.max() / self.target) ** (1 / order)), _FEWEST, _MOST))
        low, high, best = _FEWEST - 1, _MOST + 1, np.inf
        last: tuple[int, float] | None = None
        while high - low > 1 + low // 10:
            e = self.error(n, self.degree)
            best = min(best, e)
            low, high = (low, n) if e <= self.target else (n, high)
            if last is not None and 0 < e < np.inf and 0 < last[1] < np.inf:
                order = float(np.clip(np.log(last[1] / e) / np.log(n / last[0]), 1.0, 2.0 * self.degree))
            last = (n, e)
            wanted = n * (e / self.target) ** (1 / order) if e < np.inf else 2.0 * n
            n = int(np.clip(ceil(min(wanted, 4.0 * n)), low + 1, high - 1))
        if high > _MOST:
            raise self.not_met(best)
        return high

    def not_met(self, best: float) -> SolveError:
        asked = f"mesh.accuracy = {in_words(self.accuracy)}"
        message = f"{asked} is not met by {_MOST} elements of degree {self.degree}; the best estimate is {best:.1e}"
        return SolveError(message, status=Status.ACCURACY_NOT_MET)


@dataclass
class _Trial:
    """A few states of a run on a trial mesh, with their relative errors."""

    space: Space
    states: Sequence[Equilibrium]
    controls: tuple[str, ...]
    errors: Array
    elements: int
    wrinkled: bool
    yardstick: Yardstick

    def before_the_hardest(self) -> _Trial | None:
        """The trial up to its hardest state; None if this is among the first states."""
        end = int(self.errors.argmax())
        return replace(self, states=self.states[:end], errors=self.errors[:end]) if end > 1 else None

    def density(self) -> tuple[Array, Array]:
        """Points s and the density of elements there that suits all states."""
        space = self.space
        first, last = space.ends[[0, -1]]
        centres, s = (space.ends[1:] + space.ends[:-1]) / 2, np.linspace(first, last, 40 * self.elements + 1)
        total = np.zeros_like(s)
        weights = np.maximum(self.errors, 1e-14) ** (1 / (2 * _TRIAL_DEGREE))
        for eq, weight in zip(self.states, weights, strict=True):
            density = np.maximum(_misses(space, eq.potential.carried(eq.state)) / space.sizes, 1e-300) ** (1 / (2 * _GRADING_DEGREE + 1))
            smooth = np.exp(np.interp(s, centres, np.log(density)))
            total = np.maximum(total, weight * smooth / smooth.mean())
        total = np.maximum(total / total.mean(), _LEAST_DENSITY)
        if self.controls == ("center_height",):
            toward = 1 / ((s - first) / (last - first) + _POLE_RADIUS)
            total += _POLE_SHARE * toward / toward.mean()
        return s, total

    def error_on(self, scene: Scene, which: Any) -> float:
        """Largest estimated error of the states on another mesh; infinite when one of them is not found there."""
        return max(self._moved(scene, self.states[k]) for k in which)

    def _moved(self, scene: Scene, eq: Equilibrium) -> float:
        # a run over a number of the scene has a scene for every state
        here = eq.scene.replace(mesh=scene.mesh, degree=scene.degree)
        potential = potential_of(here)
        for kind in (CONTROLS[name] for name in reversed(_can_hold(self.controls, potential))):
            held = kind.at(kind.value(eq.potential.space, eq.state, eq.pressure, eq.volume))
            result = solved_in(potential, held, eq.potential, eq.state, eq.pressure, damped=True)
            if result.status is Status.CONVERGED:
                state = State.of(result)
                error = relative_error(state.evaluation.potential, state.evaluation.x, state.pressure, self.controls, self.yardstick)
                return error if np.isfinite(error) else np.inf
        return np.inf


@dataclass(frozen=True)
class Yardstick:
    """What errors are compared with: the accuracies asked for, and the sizes below which errors are no longer relative.

    Errors of a quantity for which less is asked count less: all are scaled to the tightest accuracy.
    """

    asked: Accuracy
    pressure: float = 0.0
    eigenvalues: float = 0.0

    def worst(self, errors: Mapping[str, float]) -> float:
        """The largest of the errors of what is asked, scaled."""
        return max(error * self.asked.tightest / self.asked[name] for name, error in errors.items())


def relative_error(potential: Potential, x: Array, pressure: float, controls: Sequence[str], yardstick: Yardstick) -> float:
    """The largest of the estimated relative errors of what is asked, under the control for which it is smallest; NaN without one."""
    evaluation = potential.evaluate(x, pressure)
    if ill_posed(potential, evaluation) is not None:
        return np.nan
    finer = potential_of(finer_space(potential, evaluation, pressure)[0])
    errors = []
    for control in _can_hold(controls, potential):
        better = same_state(finer, potential, x, pressure, evaluation, control)[0]
        if better is not None:
            errors.append(yardstick.worst(_errors(potential, x, pressure, evaluation, finer, better, yardstick)))
    return min(errors, default=np.nan)


def _errors(
    potential: Potential, x: Array, pressure: float, evaluation: Evaluation, finer: Potential, better: NewtonResult, yardstick: Yardstick
) -> dict[str, float]:
    """Relative errors of what is asked."""
    errors = {}
    if "pressure" in yardstick.asked:
        sizes = max(abs(pressure), yardstick.pressure), evaluation.energy_size
        changes = abs(pressure - better.pressure), abs(evaluation.energy - better.evaluation.energy)
        errors["pressure"] = max(c / size if size else 0.0 for c, size in zip(changes, sizes, strict=True))
    if "profile" in yardstick.asked:
        errors["profile"] = moved(finer, better.x, transferred(potential.space, x, finer.space))
    if "eigenvalues" in yardstick.asked:
        try:
            pairs = [_eigenvalues(potential, evaluation), _eigenvalues(better.evaluation.potential, better.evaluation)]
        except SpectrumError:
            return {**errors, "eigenvalues": np.inf}
        values = np.maximum(np.abs(pairs[1]), yardstick.eigenvalues)
        errors["eigenvalues"] = float(np.max(np.abs(pairs[0] - pairs[1]) / np.where(values > 0, values, 1.0)))
    return errors


def _eigenvalues(potential: Potential, evaluation: Evaluation) -> Array:
    """The smallest axisymmetric eigenvalues under pressure and volume control."""
    verdicts = [axisymmetric_verdict(potential, evaluation, control) for control in ("pressure", "volume")]
    return np.array([verdict.smallest_eigenvalue for verdict in verdicts])


def _trial(scene: Scene, follow: Follow, control: str) -> _Trial:
    """The run on the coarsest trial mesh on which its errors can be estimated."""
    controls, trial, asked = _controls(control), None, by_quantity(_accuracy(scene))
    for elements in _TRIAL_MESHES:
        branch = follow(_on(scene, _trial_mesh(scene.mesh, elements)))
        if not len(branch):
            failure = SolveError(branch.message, status=branch.status)
            continue
        trial = _estimated([branch[k] for k in spread([eq.volume for eq in branch])], controls, elements, asked)
        if len(trial.errors) and trial.errors.max() < _BLIND:
            return trial
    if trial is None:
        raise failure
    if not len(trial.errors):
        message = f"mesh.accuracy = {in_words(_accuracy(scene))}: no error can be estimated, since all states of the run depend on the mesh"
        raise SolveError(message, status=Status.ACCURACY_NOT_MET)
    return trial


def _controls(control: str) -> tuple[str, ...]:
    """What is held while errors are estimated, for a kind of run."""
    return {"center_height": ("center_height",), "arc-length": ("volume", "center_height")}.get(control, ("volume",))


def _can_hold(controls: Sequence[str], potential: Potential) -> tuple[str, ...]:
    """Those that can be held: no control moves a first end that is held along the axis."""
    return tuple(name for name in controls if name != "center_height" or potential.space.pole < potential.space.n_free)


def _on(scene: Scene, mesh: Meridian) -> Scene:
    """The scene of a trial."""
    return scene.replace(mesh=mesh, degree=_TRIAL_DEGREE, run=None, analysis=type(scene.analysis)())


def _estimated(equilibria: Sequence[Equilibrium], controls: tuple[str, ...], elements: int, asked: Accuracy) -> _Trial:
    yardstick = _yardstick(equilibria, asked)
    errors = np.array([relative_error(eq.potential, eq.state, eq.pressure, controls, yardstick) for eq in equilibria])
    known = np.isfinite(errors)
    states = [eq for eq, k in zip(equilibria, known, strict=True) if k]
    wrinkled = any(eq.scene.tension_field and (eq.potential.evaluate(eq.state, eq.pressure).stress <= 0).any() for eq in states)
    return _Trial(equilibria[0].of_branch.potential.root.space, states, controls, errors[known], elements, wrinkled, yardstick)


def _yardstick(equilibria: Sequence[Equilibrium], asked: Accuracy) -> Yardstick:
    """What the errors of a run are compared with."""
    largest = 0.0
    if "eigenvalues" in asked:
        found = [_eigenvalues_of(eq) for eq in (equilibria[k] for k in spread([eq.volume for eq in equilibria]))]
        largest = max((float(np.abs(pair).max()) for pair in found if pair is not None), default=0.0)
    return Yardstick(asked, _least_pressure(equilibria), _LEAST_PRESSURE * largest)


def _eigenvalues_of(eq: Equilibrium) -> Array | None:
    try:
        return _eigenvalues(eq.potential, eq.potential.evaluate(eq.state, eq.pressure))
    except SpectrumError:
        return None


def _least_pressure(equilibria: Iterable[Equilibrium]) -> float:
    """The pressure below which errors are relative to this one. Where a run holds little pressure against other loads, the stress that
    they make stands in place of its largest one.
    """
    largest = max(abs(eq.pressure) for eq in equilibria)
    stress = max(stress_scale(eq.potential.evaluate(eq.state, eq.pressure)) for eq in equilibria)
    return _LEAST_PRESSURE * max(largest, _LEAST_PRESSURE * stress)


def _accuracy(scene: Scene) -> Asked:
    return cast(Asked, scene.mesh.accuracy)  # type: ignore[attr-defined]  # an open mesh has one


def spread(loads: ArrayLike) -> list[int]:
    """Positions of some of a list of loads: the first, the last, the extreme ones and a few between."""
    loads = np.asarray(loads, dtype=float)
    n = loads.size
    if not n:
        return []
    even = np.linspace(0, n - 1, min(n, STATES)).round().astype(int).tolist()
    return sorted({*even, int(np.argmin(loads)), int(np.argmax(loads))})


def _trial_mesh(mesh: Meridian, elements: int) -> Meridian:
    """A shape on about so many elements, all alike but for the cells of a file."""
    first, last = (float(s) for s in mesh.breakpoints()[[0, -1]])
    corners = mesh.corners() if isinstance(mesh, Curve) else ()
    return mesh.on_ends(graded(np.array([first, last]), np.ones(2), elements, corners))


def _misses(space: Space, x: Array) -> Array:
    """The part of a state that elements of the grading degree miss, for each element: the integral of the squared slopes of the difference,
    over the sum of all.
    """
    low = space_of(space.mesh, _GRADING_DEGREE, ends=tuple(space.ends))
    missed = x - transferred(low, transferred(space, x, low), space)

    def slopes(y: Array) -> Array:
        _, u_x, _, w_x = space.at_quadrature(y).reshape(4, *space.R.shape)
        return (space.weights * space.R * (u_x**2 + w_x**2) / space.sizes).sum(axis=0)

    return slopes(missed) / max(float(slopes(x).sum()), 1e-300)
