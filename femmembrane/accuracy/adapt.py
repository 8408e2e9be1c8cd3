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
from ..results.equilibrium import Equilibrium, recorded
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
    from ..results.contact import Contact

#: from a scene with a mesh to the equilibria that are wanted, or a part of them
Follow = Callable[[Scene], "Branch"]

#: a run with no more states keeps one mesh
_FEW_STATES = 2
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
#: the same for a mesh that changes along the run
_FEWEST_ALONG = 5
#: most elements of one mesh for a run on which the mesh may change, and most of a mesh that it changes to
_MOST_OF_ONE, _MOST_ALONG = 64, 500
#: estimates are off by some tens of per cent, and may use this part of the accuracy
_SHARE = 0.6
#: the part that it may use where the mesh changes, so that it serves for a while; less is round-off
_SHARE_AHEAD, _ROUND_OFF = 0.05, 1e-12
#: the part beyond which it changes, and the size over that of the mesh that would do, at which a smaller one is taken
_CHANGED, _TOO_FINE = 0.5, 3.0
#: share and inner radius of the elements that go to the pole when its height is held: the response to a force on the pole, which decides
#: how a height converges, is logarithmic there
_POLE_SHARE, _POLE_RADIUS = 0.3, 0.005
#: smallest density of elements in a zone of contact over that beyond its borders
_IN_CONTACT = 0.5
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
class Along:
    """Meshes that change along a run, where one for all of it would be large, or would not keep the accuracy.

    Every state is judged. Where its estimated error comes near to the accuracy, a mesh is chosen for it that leaves room for the next ones.

    Attributes
    ----------
    controls : tuple of str
        What is held while errors are estimated.
    yardstick : Yardstick
    """

    controls: tuple[str, ...]
    yardstick: Yardstick

    @classmethod
    def of(cls, scene: Scene, control: str, sizes: tuple[float, float]) -> Along:
        """That of a run which went on with the sizes below which its errors are not relative."""
        return cls(_controls(control), Yardstick(by_quantity(_accuracy(scene)), *sizes))

    @property
    def sizes(self) -> tuple[float, float]:
        """The sizes of pressure and eigenvalues below which errors are not relative."""
        return self.yardstick.pressure, self.yardstick.eigenvalues

    def share(self, potential: Potential, state: State) -> float:
        """The estimated error of a state over the accuracy; infinite without an estimate, and 0 where no mesh has a say."""
        if ill_posed(potential, state.evaluation) is not None:
            return 0.0
        error = relative_error(potential, state.x, state.pressure, self.controls, self.yardstick)
        if np.isnan(error):
            error = _across(potential, state, self.yardstick.pressure)
        return error / self.yardstick.asked.tightest if np.isfinite(error) else np.inf

    def mesh_for(self, scene: Scene, potential: Potential, state: State, share: float) -> Scene:
        """The scene on a mesh for a state and the next ones; ``share`` is that of the state on the mesh that the scene has.

        Raises
        ------
        SolveError
            With status ACCURACY_NOT_MET when no mesh is good enough.
        """
        accuracy = _accuracy(scene)
        for ends in (scene.mesh, scene.mesh.refined()):
            on = _on(scene, ends.on_ends(ends.breakpoints()))
            graded_by = _found_again(on, potential, state)
            if graded_by is None:
                continue
            trial = _estimated([graded_by], self.controls, on.mesh.elements, self.yardstick.asked, self.yardstick)
            if len(trial.errors):
                target = max(_SHARE_AHEAD, min(_ROUND_OFF / self.yardstick.asked.tightest, _SHARE))
                return _Choice(scene, trial, accuracy, target, _MOST_ALONG).near(scene, share)
        message = f"mesh.accuracy = {in_words(accuracy)}: no error can be estimated at V = {state.volume:.6g}, P = {state.pressure:.6g}"
        raise SolveError(message, status=Status.ACCURACY_NOT_MET)

    def smaller(self, scene: Scene, potential: Potential, state: State, share: float) -> Scene | None:
        """The scene on a much smaller mesh that would do, None where there is none."""
        if share > _SHARE_AHEAD * _TOO_FINE ** (-2.0 * scene.degree) or scene.mesh.elements < _FEWEST_ALONG * _TOO_FINE:
            return None
        found = self.mesh_for(scene, potential, state, share)
        return found if _TOO_FINE * found.mesh.elements <= scene.mesh.elements else None

    def full(self, share: float) -> bool:
        """Whether the error of a state has come near to the accuracy."""
        return share > _CHANGED


def _found_again(scene: Scene, potential: Potential, state: State) -> Equilibrium | None:
    """The record of a state on another mesh, where the branch meets the plane across it; None where it does not."""
    onto = potential_of(scene)
    found = met_across(onto, potential, first_point(potential, state, 1))
    if found.status is not Status.CONVERGED:
        return None
    return recorded(scene, onto, found.x, found.pressure, found.evaluation, Status.CONVERGED)


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


def choose_and_check(scene: Scene, follow: Follow, control: str, changes: bool = False) -> tuple[Scene, Shortfall | None, Along | None]:
    """As :func:`choose_mesh`, with the errors of the run on the chosen mesh estimated and, where they are too large, the mesh chosen again.

    A few states of a trial do not stand for a whole run: a run that ends in a spike below a source becomes harder without end. Where the
    mesh may change along the run, and one of moderate size does not keep the accuracy, the mesh is that of the first state, with what is to
    change it.
    """
    controls = _controls(control)
    first, found = _trial(scene, follow, control), None
    trial = first
    changes = changes and not trial.wrinkled and len(trial.states) > _FEW_STATES
    most = _MOST_OF_ONE if changes else _MOST
    for _ in range(_ROUNDS):
        try:
            chosen = _Choice(scene, trial, _accuracy(scene), most=most).chosen()
        except SolveError:
            if found is not None or changes:
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
    if changes and (found is None or found[1] is not None):
        return _first_of_many(scene, first), None, Along(controls, first.yardstick)
    branch, shortfall = cast("tuple[Branch, Shortfall | None]", found)
    return branch.scene, shortfall, None


def _first_of_many(scene: Scene, trial: _Trial) -> Scene:
    """The scene on a mesh for the first state of a run."""
    first = replace(trial, states=trial.states[:1], errors=trial.errors[:1])
    return _Choice(scene, first, _accuracy(scene), most=_MOST_ALONG).chosen()


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
        return _across(eq.potential, _state_of(eq), yardstick.pressure) if np.isnan(found) and len(controls) > 1 else found

    good = -1
    for k in _checked(branch):
        if not error(k) <= yardstick.asked.tightest:
            first = next(i for i in range(good + 1, k + 1) if not error(i) <= yardstick.asked.tightest)
            last = f"V = {branch[first - 1].volume:.6g}, P = {branch[first - 1].pressure:.6g}" if first else ""
            return Shortfall(first, accuracy, error(first), last)
        good = k
    return None


def _state_of(eq: Equilibrium) -> State:
    """The solver's state of a record."""
    return State(eq.state, eq.pressure, eq.potential.evaluate(eq.state, eq.pressure), 0, 0.0, 0.0, 0.0)


def _across(potential: Potential, state: State, scale: float) -> float:
    """Estimated relative error of P next to folds of volume and height: the distance to the branch of a finer space there."""
    finer = potential_of(finer_space(potential, state.evaluation, state.pressure)[0])
    met = met_across(finer, potential, first_point(potential, state, 1))
    return abs(met.pressure - state.pressure) / max(abs(state.pressure), scale) if met.status is Status.CONVERGED else np.nan


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

    def __init__(self, scene: Scene, trial: _Trial, accuracy: Asked, share: float = _SHARE, most: int = _MOST) -> None:
        self.scene, self.trial, self.accuracy, self.most = scene, trial, accuracy, most
        tightest = by_quantity(accuracy).tightest
        self.target = share * tightest
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
            if elements >= self.most:
                raise self.not_met(estimated)
            elements = min(elements + 1 + elements // 8, self.most)

    def near(self, scene: Scene, share: float) -> Scene:
        """A mesh that is good enough for all states, looked for where the error that another one leaves says that it is.

        ``share`` is the error on the mesh of a scene over the accuracy. The number of elements is good to some tens of per cent.
        """
        asked, order = by_quantity(self.accuracy).tightest, 2.0 * self.degree
        known = share * asked if np.isfinite(share) else 2.0**order * self.target
        n = scene.mesh.elements * scene.degree / self.degree * (known / self.target) ** (1 / order)
        best = np.inf
        while True:
            elements = int(np.clip(ceil(n), _FEWEST_ALONG, self.most))
            found = self.candidate(elements, self.degree)
            estimated = self.trial.error_on(found, self.hardest)
            last = elements >= self.most
            if estimated <= (_CHANGED * asked if last else self.target):
                return found.replace(mesh=found.mesh.on_ends(found.mesh.breakpoints(), self.accuracy, estimated))
            best = min(best, estimated)
            if last:
                raise self.not_met(best)
            n = elements * max(1.1, min(2.0, (estimated / self.target) ** (1 / order)))

    def fewest(self) -> int:
        """The number of elements, to a tenth or so, from which the hardest states are as good as wanted: a secant search in logarithms."""
        order = 2.0 * self.degree
        n = int(np.clip(ceil(self.trial.elements / 2 * (self.trial.errors.max() / self.target) ** (1 / order)), _FEWEST, self.most))
        low, high, best = _FEWEST - 1, self.most + 1, np.inf
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
        if high > self.most:
            raise self.not_met(best)
        return high

    def not_met(self, best: float) -> SolveError:
        asked = f"mesh.accuracy = {in_words(self.accuracy)}"
        message = f"{asked} is not met by {self.most} elements of degree {self.degree}; the best estimate is {best:.1e}"
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
        first, last = self.space.ends[[0, -1]]
        s = np.linspace(first, last, 40 * self.elements + 1)
        total = np.zeros_like(s)
        weights = np.maximum(self.errors, 1e-14) ** (1 / (2 * _TRIAL_DEGREE))
        for eq, weight in zip(self.states, weights, strict=True):
            own = eq.of_branch.potential
            state, space = own.carried(eq.of_branch.state), own.root.space
            centres = (space.ends[1:] + space.ends[:-1]) / 2
            density = np.maximum(_misses(space, state) / space.sizes, 1e-300) ** (1 / (2 * _GRADING_DEGREE + 1))
            if (contact := eq.of_branch.contact) is not None:
                density = _with_contact(density, space, contact)
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
                own = result.evaluation
                error = relative_error(own.potential, own.x, result.pressure, self.controls, self.yardstick)
                return error if np.isfinite(error) else np.inf
        return self._met(here, eq) if len(self.controls) > 1 else np.inf

    def _met(self, scene: Scene, eq: Equilibrium) -> float:
        """The same next to folds of all that can be held."""
        met = _found_again(scene, eq.potential, _state_of(eq))
        error = np.nan if met is None else _across(met.potential, _state_of(met), self.yardstick.pressure)
        return error if np.isfinite(error) else np.inf


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


def _estimated(
    equilibria: Sequence[Equilibrium], controls: tuple[str, ...], elements: int, asked: Accuracy, yardstick: Yardstick | None = None
) -> _Trial:
    yardstick = yardstick or _yardstick(equilibria, asked)
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


def _with_contact(density: Array, space: Space, contact: Contact) -> Array:
    """A density of elements that does not fall to nothing in zones of contact, where little is to be described: borders take ends there."""
    centres, density = (space.ends[1:] + space.ends[:-1]) / 2, density.copy()
    for zone in contact.zones:
        inside = (centres > zone.start) & (centres < zone.stop)
        beyond = np.flatnonzero(inside[1:] != inside[:-1])
        beyond = np.where(inside[beyond], beyond + 1, beyond)
        density[inside] = np.maximum(density[inside], _IN_CONTACT * density[beyond].max(initial=0.0))
    return density


def _misses(space: Space, x: Array) -> Array:
    """The part of a state that elements of the grading degree miss, for each element: the integral of the squared slopes of the difference,
    over the sum of all.
    """
    low = space_of(space.mesh.on_ends(tuple(space.ends.tolist())), _GRADING_DEGREE)
    missed = x - transferred(low, transferred(space, x, low), space)

    def slopes(y: Array) -> Array:
        _, u_x, _, w_x = space.at_quadrature(y).reshape(4, *space.R.shape)
        return (space.weights * space.R * (u_x**2 + w_x**2) / space.sizes).sum(axis=0)

    return slopes(missed) / max(float(slopes(x).sum()), 1e-300)
