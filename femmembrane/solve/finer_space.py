"""The same equilibrium in another finite-element space of its scene: carried over by interpolation and solved again.

An answer that moves far when the space grows is far from the answer of the continuum.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from ..discretization.space import transferred
from ..errors import Status
from ..potential import Array, Evaluation, Family, Potential, potential_of
from ..scene import MAX_DEGREE, Scene
from .branch import BranchProblem, first_point
from .continuation import BranchPoint
from .controls import ArcLengthControl, Control, PressureControl, VolumeControl
from .newton import NewtonResult, correct, relative_residual
from .state import State, displacement, distance, joined

#: change of the membrane, relative to its size, beyond which the state found in the finer space is not taken for the same equilibrium
FAR = 0.2
#: number of spaces, each finer than the last, in which a doubtful answer is checked
LEVELS = (1, 2)
#: relative residual above which a state is no equilibrium, so that no state of another space stands for it
_BALANCED = 1e-6
#: most iterations of a damped solve: ordinary ones take one to three
_MAX_ITERATIONS = 30


def finer_scene(scene: Scene) -> Scene:
    """The scene on elements of one degree more, or of half the size where there is no higher degree."""
    return scene.replace(degree=scene.degree + 1) if scene.degree < MAX_DEGREE else scene.replace(mesh=scene.mesh.refined())


def solved_in(
    onto: Potential, control: Control, potential: Potential, x: Array, pressure: float, *, magnetic: float = 1.0, damped: bool = False
) -> NewtonResult:
    """The equilibrium of another potential under a control, by Newton's method from a state carried over."""
    start = transferred(potential.space, x, onto.space)
    if damped:
        return correct(onto, control, start, pressure, magnetic=magnetic, damped=True, max_iterations=_MAX_ITERATIONS)
    return correct(onto, control, start, pressure, magnetic=magnetic)


def met_across(onto: Potential, potential: Potential, point: BranchPoint) -> NewtonResult:
    """Where the branch of another space crosses the plane through a point of a branch, across its tangent; regular at every fold."""
    state = point.state
    start, tangent = (transferred(potential.space, y, onto.space) for y in (state.x, point.tangent[:-1]))
    row = BranchProblem(onto).dual(joined(tangent, float(point.tangent[-1])))
    across = ArcLengthControl(row[:-1], float(row[-1]), start, state.pressure)
    factor = state.evaluation.factor
    return correct(onto, across, start, state.pressure, magnetic=factor, damped=True, max_iterations=_MAX_ITERATIONS)


def solved_past_folds(onto: Potential, control: Control, potential: Potential, state: State) -> NewtonResult:
    """As :func:`solved_in`, for a state next to a fold of the control. The branch is :func:`met_across` first, and then followed to the
    state.
    """
    result = met_across(onto, potential, first_point(potential, state, 1))
    if result.status is not Status.CONVERGED:
        return result
    return correct(onto, control, result.x, result.pressure, damped=True, max_iterations=_MAX_ITERATIONS)


def counterpart(
    potential: Potential, evaluation: Evaluation, pressure: float | None = None, held: str = "volume", level: int = 1
) -> NewtonResult | None:
    """The state of an evaluation in a finer space, with the potential ``result.evaluation.potential``; None where it was not found.

    Parameters
    ----------
    potential, evaluation : Potential, Evaluation
    pressure : float, optional
        Default that which balances the forces best.
    held : {"volume", "pressure"}
        What is the same in both; where that leads to no state near by, as next to a fold of it, the branch is met as in :func:`met_across`.
    level : {1, 2}
        1 for the space of :func:`finer_scene`, 2 for one of one degree more again, on elements of half the size: what is of the size of an
        element changes with it.
    """
    if isinstance(potential, Family):  # of many scenes at once
        return None
    if pressure is None:
        across = evaluation.volume_gradient
        pressure = float(evaluation.gradient @ across / (across @ across or 1.0))
    found = _counterpart(potential, evaluation.x.tobytes(), float(pressure), evaluation.factor, held, False)
    if found is None or level == 1:
        return found
    return _counterpart(found.evaluation.potential, found.x.tobytes(), found.pressure, evaluation.factor, held, True)


@lru_cache(maxsize=16)
def _counterpart(potential: Potential, state: bytes, pressure: float, factor: float, held: str, halved: bool) -> NewtonResult | None:
    """Remembered for the other questions about the same state."""
    scene = finer_scene(potential.scene)
    finer, x = potential_of(scene.replace(mesh=scene.mesh.refined()) if halved else scene), np.frombuffer(state)
    evaluation = potential.evaluate(x, pressure, factor)
    if relative_residual(potential, evaluation.gradient - pressure * evaluation.volume_gradient, evaluation, pressure) > _BALANCED:
        return None
    control = PressureControl(pressure) if held == "pressure" else VolumeControl(evaluation.volume)
    tries: tuple[Callable[[], NewtonResult], ...] = (
        lambda: solved_in(finer, control, potential, x, pressure, magnetic=factor),
        lambda: solved_in(finer, control, potential, x, pressure, magnetic=factor, damped=True),
        lambda: met_across(finer, potential, first_point(potential, State(x, pressure, evaluation, 0, 0.0, 0.0, 0.0), 1)),
    )
    start = transferred(potential.space, x, finer.space)
    for attempt in tries:
        with np.errstate(all="ignore"):  # a state of another space may be out of reach; it then does not converge
            result = attempt()
        if result.status is Status.CONVERGED and moved(finer, result.x, start) <= FAR:
            return result
    return None


def confirmed(
    holds: Callable[[NewtonResult], bool], potential: Potential, evaluation: Evaluation, pressure: float | None = None
) -> bool | None:
    """Whether what a mesh shows of an equilibrium holds in finer spaces too; None where the state was not found in one of them."""
    for level in LEVELS:
        found = counterpart(potential, evaluation, pressure, level=level)
        if found is None:
            return None
        if not holds(found):
            return False
    return True


def moved(onto: Potential, x: Array, before: Array) -> float:
    """Change of a state of a space relative to its size: root mean squares over the reference area."""
    size, change = displacement(onto, x), distance(onto, x, before)
    return change / size if size else 0.0
