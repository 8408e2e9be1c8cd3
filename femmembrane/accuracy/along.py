"""The accuracy of a whole run: on one mesh where one of moderate size keeps it, and else on meshes that change along the run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, cast

import numpy as np

from ..discretization.meridian import Asked, by_quantity, in_words
from ..errors import SolveError, Status
from ..potential import Potential
from ..results.other_mesh import found_on, state_of
from ..scene import Scene
from ..solve.state import State
from ..solve.state_resolution import largest_kink
from ..solve.wellposed import ill_posed, stress_scale
from .adapt import FEWEST_ALONG, SHARE, TRIAL_MESHES, TRIED, Choice, Follow, Trial, estimated_trial, on_trial_mesh, trial_mesh, trial_of
from .yardstick import Yardstick, accuracy_of, controls_of, error_across, least_pressure, relative_error, spread, yardstick_of

if TYPE_CHECKING:
    from ..results.branch import Branch
    from ..results.equilibrium import Equilibrium

#: a run with no more states keeps one mesh
_FEW_STATES = 2
#: most meshes that are chosen until a run is accurate enough all along
_ROUNDS = 2
#: most elements of one mesh for a run on which the mesh may change, and most of a mesh that it changes to
_MOST_OF_ONE, _MOST_ALONG = 64, 400
#: the part of the accuracy that a mesh may use which is changed to, so that it serves for a while; less is round-off
_SHARE_AHEAD, _ROUND_OFF = 0.05, 1e-12
#: the part beyond which it changes, and the size over that of the mesh that would do, at which a smaller one is taken
_CHANGED, _TOO_FINE = 0.4, 3.0
#: how often a mesh is graded again by itself, and its size over that of the mesh that graded it from which on it is
_REGRADED, _MUCH_LARGER = 2, 1.6
#: states after which a much smaller mesh is looked for
_OFTEN = 8


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

    #: the part of the accuracy that the estimated error of a state may use
    most: ClassVar[float] = SHARE

    @classmethod
    def of(cls, scene: Scene, control: str, sizes: tuple[float, float]) -> Along:
        """That of a run which went on with the sizes below which its errors are not relative."""
        return cls(controls_of(control), Yardstick(by_quantity(accuracy_of(scene)), *sizes))

    def reached(self, found: Sequence[Equilibrium], state: State) -> Along:
        """With the pressures that were reached so far, where those of the trial were much larger: a run may end before them."""
        largest = max((abs(eq.pressure) for eq in found), default=abs(state.pressure))
        least = least_pressure(max(largest, abs(state.pressure)), stress_scale(state.evaluation))
        return replace(self, yardstick=replace(self.yardstick, pressure=min(least, self.yardstick.pressure)))

    @property
    def sizes(self) -> tuple[float, float]:
        """The sizes of pressure and eigenvalues below which errors are not relative."""
        return self.yardstick.pressure, self.yardstick.eigenvalues

    def share(self, potential: Potential, state: State) -> float:
        """The estimated error of a state over the accuracy; infinite without an estimate, and 0 where no mesh has a say.

        Estimates are off by some tens of per cent, so that an error over the part :attr:`most` is none to keep.
        """
        if ill_posed(potential, state.evaluation) is not None:
            return 0.0
        error = relative_error(potential, state.x, state.pressure, self.controls, self.yardstick)
        if np.isnan(error):
            error = error_across(potential, state, self.yardstick.pressure)
        return error / self.yardstick.asked.tightest if np.isfinite(error) else np.inf

    def mesh_for(self, scene: Scene, potential: Potential, state: State, share: float) -> Scene:
        """The scene on a mesh for a state and the next ones; ``share`` is that of the state on the mesh that the scene has.

        Raises
        ------
        SolveError
            With status ACCURACY_NOT_MET when no mesh is good enough.
        """
        found = self._graded(scene, scene, potential, state, share)
        for _ in range(_REGRADED):
            if found.mesh.elements < _MUCH_LARGER * scene.mesh.elements:
                break
            # elements of this mesh say little about smaller ones: those of the larger one grade it again
            better = self._graded(scene, found, potential, state, getattr(found.mesh, "estimated", np.inf) / self.yardstick.asked.tightest)
            if better.mesh.elements >= found.mesh.elements:
                break
            found = better
        return found

    def _graded(self, scene: Scene, by: Scene, potential: Potential, state: State, share: float) -> Scene:
        """A mesh that is graded by the misses of the state on the elements of another one, which has a share of the accuracy."""
        for ends in (by.mesh, by.mesh.refined()):
            on = on_trial_mesh(scene, ends.on_ends(ends.breakpoints()))
            graded_by = found_on(on, potential, state)
            if graded_by is None:
                continue
            trial = estimated_trial([graded_by], self.controls, on.mesh.elements, self.yardstick.asked, self.yardstick)
            if len(trial.errors):
                target = max(_SHARE_AHEAD, min(_ROUND_OFF / self.yardstick.asked.tightest, SHARE))
                return Choice(scene, trial, accuracy_of(scene), target, _MOST_ALONG).near(by, share, _CHANGED)
        message = (
            f"mesh.accuracy = {in_words(accuracy_of(scene))}: no error can be estimated at V = {state.volume:.6g}, P = {state.pressure:.6g}"
        )
        raise SolveError(message, status=Status.ACCURACY_NOT_MET)

    def next_mesh(self, scene: Scene, potential: Potential, state: State, share: float, done: int) -> Scene | None:
        """The scene on another mesh for a state and the next ones, where this one is nearly used up for it, or much too fine.

        Parameters
        ----------
        scene : Scene
            With the mesh of the state.
        potential : Potential
        state : State
        share : float
            See :meth:`share`.
        done : int
            How many states came before: a much smaller mesh is looked for at times only.

        Returns
        -------
        Scene or None
            None where the mesh at hand will do, or does as well as any.

        Raises
        ------
        SolveError
            With status ACCURACY_NOT_MET when no mesh is good enough, this one included.
        """
        try:
            if self._full(scene, share):
                return self.mesh_for(scene, potential, state, share)
            return self._smaller(scene, potential, state, share) if done % _OFTEN == 0 else None
        except SolveError:
            if share > self.most:
                raise
            return None

    def _smaller(self, scene: Scene, potential: Potential, state: State, share: float) -> Scene | None:
        """The scene on a much smaller mesh that would do, None where there is none."""
        if share > _SHARE_AHEAD * _TOO_FINE ** (-2.0 * scene.degree) or scene.mesh.elements < FEWEST_ALONG * _TOO_FINE:
            return None
        found = self.mesh_for(scene, potential, state, share)
        return found if _TOO_FINE * found.mesh.elements <= scene.mesh.elements else None

    def _full(self, scene: Scene, share: float) -> bool:
        """Whether the error of a state has come near to the accuracy, and a larger mesh than that of the scene is allowed."""
        return share > (_CHANGED if scene.mesh.elements < _MOST_ALONG else self.most)


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


def choose_and_check(
    scene: Scene, follow: Follow, control: str, changes: bool = False, every: bool = True
) -> tuple[Scene, Shortfall | None, Along | None]:
    """The scene on a mesh with errors of P and of the total energy below the accuracy that its open mesh asks for, all along a run.

    Errors are compared at the same volume, and in a run by heights at the same pole height. With arc length the smaller of both counts,
    since it is regular at volume folds. Relative means over the pressure, but not over less than a hundredth of the largest one of the run,
    and over the sum of the sizes of all energies. States without an estimate (compressed, slack) do not count.

    The mesh is chosen by a trial run. The errors of the run on it are estimated and, where they are too large, the mesh is chosen again. A
    few states of a trial do not stand for a whole run: a run that ends in a spike below a source becomes harder without end. Where the
    mesh may change along the run, and one of moderate size does not keep the accuracy, the mesh is that of the first state, with what is to
    change it. So it is where what was followed is not ``every`` state of the run, and ended early: states beyond it were never seen.

    Parameters
    ----------
    scene : Scene
        Open: its mesh has an accuracy and no elements.
    follow : callable
        What is wanted, or a part of it that shows how hard it is, on a scene with a mesh; it returns what it reached.
    control : {"volume", "pressure", "center_height", "arc-length"}
        How it is wanted.
    changes : bool
        Whether the mesh may change along the run.
    every : bool
        Whether ``follow`` has all states of the run.

    Returns
    -------
    scene : Scene
    shortfall : Shortfall or None
        Where the accuracy ends; None where it is kept all along.
    along : Along or None
        What changes the mesh along the run; None for a run on one mesh.

    Raises
    ------
    SolveError
        With status ACCURACY_NOT_MET when no mesh is good enough, with that of the run when it yields nothing on a trial mesh.
    """
    controls = controls_of(control)
    first, found = trial_of(scene, follow, control), None
    trial = first
    changes = changes and not trial.wrinkled and len(trial.states) > _FEW_STATES
    most = _MOST_OF_ONE if changes else None
    for _ in range(_ROUNDS):
        try:
            chosen = Choice(scene, trial, accuracy_of(scene), most=most).chosen()
        except SolveError:
            if found is not None or changes:
                break
            easier = trial.before_the_hardest()
            if easier is None:
                raise
            chosen = Choice(scene, easier, accuracy_of(scene)).chosen()
        branch = follow(chosen)
        shortfall = _shortfall(branch, controls, accuracy_of(scene))
        if found is None or shortfall is None or (shortfall.kept > 0 and _farther(branch, shortfall, *found)):
            found = (branch, shortfall)
        if shortfall is None:
            break
        finer = follow(on_trial_mesh(scene, chosen.mesh.on_ends(chosen.mesh.breakpoints())))
        if not len(finer):
            break
        trial = estimated_trial([finer[k] for k in _checked(finer)], controls, chosen.mesh.elements, by_quantity(accuracy_of(scene)))
        if not len(trial.errors):
            break
    if changes and (found is None or found[1] is not None):
        return _first_of_many(scene, first), None, Along(controls, first.yardstick)
    branch, shortfall = cast("tuple[Branch, Shortfall | None]", found)
    if changes and branch.message and not every:
        return branch.scene, None, Along(controls, first.yardstick)
    return branch.scene, shortfall, None


def trial_scenes(scene: Scene) -> Iterator[Scene]:
    """The scene on trial meshes, from coarse to fine."""
    for elements in TRIAL_MESHES:
        yield on_trial_mesh(scene, trial_mesh(scene.mesh, elements))


def meshes_for(scene: Scene, states: Sequence[Equilibrium]) -> list[Scene]:
    """The scene on a mesh for each of some states at a load: on one for all if one of moderate size keeps the accuracy.

    A state without an estimate has the mesh of the others; if none has one, it stays where it is.

    Raises
    ------
    SolveError
        With status ACCURACY_NOT_MET when no mesh is good enough.
    """
    if not states:
        return []
    controls = controls_of("arc-length")
    elements = states[0].scene.mesh.elements
    trial = estimated_trial(states, controls, elements, by_quantity(accuracy_of(scene)))
    if not len(trial.errors):
        return [eq.of_branch.scene for eq in states]
    many = len(trial.states) > 1 and not (trial.wrinkled or scene.follows_zones)
    try:
        return [Choice(scene, trial, accuracy_of(scene), most=_MOST_OF_ONE if many else None).chosen()] * len(states)
    except SolveError:
        if not many:
            raise
    chosen = {}
    for eq, error in zip(trial.states, trial.errors, strict=True):
        own = replace(trial, states=[eq], errors=np.array([error]))
        chosen[id(eq)] = Choice(scene, own, accuracy_of(scene), most=_MOST_ALONG).chosen()
    largest = max(chosen.values(), key=lambda found: found.mesh.elements)
    return [chosen.get(id(eq), largest) for eq in states]


def _first_of_many(scene: Scene, trial: Trial) -> Scene:
    """The scene on a mesh for the first state of a run."""
    first = replace(trial, states=trial.states[:1], errors=trial.errors[:1])
    return Choice(scene, first, accuracy_of(scene), most=_MOST_ALONG).chosen()


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
    return sorted({*spread([eq.volume for eq in branch]), *np.argsort(kinks)[-TRIED:].tolist()})


def _shortfall(branch: Branch, controls: tuple[str, ...], accuracy: Asked) -> Shortfall | None:
    """Where the accuracy ends; None when it is kept at all equilibria that were looked at."""
    if not len(branch):
        return None
    yardstick = yardstick_of(branch, by_quantity(accuracy))

    def error(k: int) -> float:
        eq = branch[k]
        if eq.status.ill_posed:
            return 0.0
        found = relative_error(eq.potential, eq.state, eq.pressure, controls, yardstick)
        return error_across(eq.potential, state_of(eq), yardstick.pressure) if np.isnan(found) and len(controls) > 1 else found

    good = -1
    for k in _checked(branch):
        if not error(k) <= yardstick.asked.tightest:
            first = next(i for i in range(good + 1, k + 1) if not error(i) <= yardstick.asked.tightest)
            last = f"V = {branch[first - 1].volume:.6g}, P = {branch[first - 1].pressure:.6g}" if first else ""
            return Shortfall(first, accuracy, error(first), last)
        good = k
    return None
