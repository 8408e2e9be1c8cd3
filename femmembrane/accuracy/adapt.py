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

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..discretization.curve import Curve
from ..discretization.meridian import Accuracy, Asked, Meridian, by_quantity, in_words
from ..discretization.space import Space, space_of, transferred
from ..errors import SolveError, Status
from ..potential import Array, potential_of
from ..results.equilibrium import Equilibrium
from ..results.other_mesh import found_on, state_of
from ..scene import MAX_DEGREE, Scene
from ..solve.controls import CONTROLS
from ..solve.finer_space import solved_in
from .yardstick import Yardstick, accuracy_of, can_hold, controls_of, error_across, relative_error, spread, yardstick_of

if TYPE_CHECKING:
    from ..results.branch import Branch
    from ..results.contact import Contact

#: from a scene with a mesh to the equilibria that are wanted, or a part of them
Follow = Callable[[Scene], "Branch"]

#: number of these equilibria, the hardest ones, that are tried on every mesh
TRIED = 4
#: elements of the trial meshes, tried in turn until errors can be estimated
TRIAL_MESHES, _TRIAL_DEGREE = (12, 24, 48), 6
#: relative error above which a trial mesh says too little about the states
_BLIND = 1e-2
#: degree of the elements whose misses grade the mesh
_GRADING_DEGREE = 4
#: highest degree where zones are wrinkled and not followed: higher degrees gain nothing with borders inside elements
_WRINKLED_DEGREE = 4
#: fewer elements would do for some accuracies, but may let a run lose its branch
_FEWEST, MOST = 3, 2000
#: the same for a mesh that changes along the run
FEWEST_ALONG = 5
#: estimates are off by some tens of per cent, and may use this part of the accuracy
SHARE = 0.6
#: share and inner radius of the elements that go to the pole when its height is held: the response to a force on the pole, which decides
#: how a height converges, is logarithmic there
_POLE_SHARE, _POLE_RADIUS = 0.3, 0.005
#: smallest density of elements in a zone of contact over that beyond its borders
_IN_CONTACT = 0.5
#: smallest density of elements over the mean
_LEAST_DENSITY = 0.1


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


class Choice:
    """The search for the number of elements and the degree."""

    def __init__(self, scene: Scene, trial: Trial, accuracy: Asked, share: float = SHARE, most: int | None = None) -> None:
        self.scene, self.trial, self.accuracy, self.most = scene, trial, accuracy, MOST if most is None else most
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
        return self.trial.error_on(self.candidate(elements, degree), self.hardest[:TRIED])

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

    def near(self, scene: Scene, share: float, last_share: float) -> Scene:
        """A mesh that is good enough for all states, looked for where the error that another one leaves says that it is.

        ``share`` is the error on the mesh of a scene over the accuracy. The number of elements is good to some tens of per cent. The
        largest mesh may use the part ``last_share`` of the accuracy.
        """
        asked, order = by_quantity(self.accuracy).tightest, 2.0 * self.degree
        known = share * asked if np.isfinite(share) else 2.0**order * self.target
        n = scene.mesh.elements * scene.degree / self.degree * (known / self.target) ** (1 / order)
        best = np.inf
        while True:
            elements = int(np.clip(ceil(n), FEWEST_ALONG, self.most))
            found = self.candidate(elements, self.degree)
            estimated = self.trial.error_on(found, self.hardest)
            last = elements >= self.most
            if estimated <= (last_share * asked if last else self.target):
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
        close = ", too close to it for an estimate" if best <= by_quantity(self.accuracy).tightest else ""
        message = f"{asked} is not met by {self.most} elements of degree {self.degree}; the best estimate is {best:.1e}{close}"
        return SolveError(message, status=Status.ACCURACY_NOT_MET)


@dataclass
class Trial:
    """A few states of a run on a trial mesh, with their relative errors."""

    space: Space
    states: Sequence[Equilibrium]
    controls: tuple[str, ...]
    errors: Array
    elements: int
    wrinkled: bool
    yardstick: Yardstick

    def before_the_hardest(self) -> Trial | None:
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
        for kind in (CONTROLS[name] for name in reversed(can_hold(self.controls, potential))):
            held = kind.at(kind.value(eq.potential.space, eq.state, eq.pressure, eq.volume))
            result = solved_in(potential, held, eq.potential, eq.state, eq.pressure, damped=True)
            if result.status is Status.CONVERGED:
                own = result.evaluation
                error = relative_error(own.potential, own.x, result.pressure, self.controls, self.yardstick)
                return error if np.isfinite(error) else np.inf
        return self._met(here, eq) if len(self.controls) > 1 else np.inf

    def _met(self, scene: Scene, eq: Equilibrium) -> float:
        """The same next to folds of all that can be held."""
        met = found_on(scene, eq.potential, state_of(eq))
        error = np.nan if met is None else error_across(met.potential, state_of(met), self.yardstick.pressure)
        return error if np.isfinite(error) else np.inf


def trial_of(scene: Scene, follow: Follow, control: str) -> Trial:
    """The run on the coarsest trial mesh on which its errors can be estimated."""
    controls, trial, asked = controls_of(control), None, by_quantity(accuracy_of(scene))
    for elements in TRIAL_MESHES:
        branch = follow(on_trial_mesh(scene, trial_mesh(scene.mesh, elements)))
        if not len(branch):
            failure = SolveError(branch.message, status=branch.status)
            continue
        trial = estimated_trial([branch[k] for k in spread([eq.volume for eq in branch])], controls, elements, asked)
        if len(trial.errors) and trial.errors.max() < _BLIND:
            return trial
    if trial is None:
        raise failure
    if not len(trial.errors):
        message = (
            f"mesh.accuracy = {in_words(accuracy_of(scene))}: no error can be estimated, since all states of the run depend on the mesh"
        )
        raise SolveError(message, status=Status.ACCURACY_NOT_MET)
    return trial


def on_trial_mesh(scene: Scene, mesh: Meridian) -> Scene:
    """The scene of a trial."""
    return scene.replace(mesh=mesh, degree=_TRIAL_DEGREE, run=None, analysis=type(scene.analysis)())


def estimated_trial(
    equilibria: Sequence[Equilibrium], controls: tuple[str, ...], elements: int, asked: Accuracy, yardstick: Yardstick | None = None
) -> Trial:
    yardstick = yardstick or yardstick_of(equilibria, asked)
    errors = np.array([relative_error(eq.potential, eq.state, eq.pressure, controls, yardstick) for eq in equilibria])
    known = np.isfinite(errors)
    states = [eq for eq, k in zip(equilibria, known, strict=True) if k]
    wrinkled = any(eq.scene.tension_field and (eq.potential.evaluate(eq.state, eq.pressure).stress <= 0).any() for eq in states)
    return Trial(equilibria[0].of_branch.potential.root.space, states, controls, errors[known], elements, wrinkled, yardstick)


def trial_mesh(mesh: Meridian, elements: int) -> Meridian:
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
