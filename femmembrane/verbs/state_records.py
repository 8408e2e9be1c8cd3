"""Between the solvers' states and the public records."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..accuracy.borders import Solve, put_on_borders
from ..checks import store
from ..discretization.space import transferred
from ..errors import InputError, SolveError, Status
from ..potential import ContactFamily, Potential
from ..results.analyses import answer_at_once
from ..results.branch import Branch
from ..results.equilibrium import Equilibrium, recorded
from ..results.path_memory import PathMemory
from ..results.special_point import SpecialPoint
from ..results.zones import KINDS, ZoneChange
from ..scene import Scene
from ..solve.continuation import BranchPoint
from ..solve.controls import Gas, PressureControl, VolumeControl
from ..solve.newton import RESIDUAL, correct, relative_residual
from ..solve.segment import Located
from ..solve.state import Predictor, State
from ..solve.wellposed import ill_posed
from ..solve.zone_events import ZoneEvent

if TYPE_CHECKING:
    from .running import Run

OnStep = Callable[[int, int, Equilibrium], None]
#: called after each step with the branch so far, from which the run can be resumed
OnCheckpoint = Callable[[Branch], None]


def resume(potential: Potential, start: Equilibrium) -> State:
    """The solver's state of a recorded equilibrium, of this scene or of another scene with the same mesh and degree."""
    if not isinstance(start, Equilibrium):
        raise InputError("start", start, "an Equilibrium is allowed")
    start = start.of_branch
    if start.state.shape != (potential.space.n_free,):
        raise InputError("start", start, f"an equilibrium with {potential.space.n_free} unknowns (the same mesh and degree) is allowed")
    x = start.state
    if start.scene.borders:
        x = transferred(start.potential.space, x, potential.space)
    result = correct(potential, VolumeControl(start.volume), x, start.pressure)
    if result.status is not Status.CONVERGED:
        result = correct(potential, PressureControl(start.pressure), x, start.pressure)
    if result.status is not Status.CONVERGED:
        raise SolveError("the start is no equilibrium of this scene", status=result.status)
    return State.of(result)


def restore(potential: Potential, kept: Equilibrium, number: float = 1.0) -> State:
    """The solver's state of an equilibrium of this very scene, to the last bit: it is looked at, not solved again.

    In a family of scenes it is one of the scene with a value of the number. Where elements follow zones it is the state on the mesh of the
    branch.

    Raises
    ------
    InputError
        When it is no equilibrium of the scene.
    """
    kept = kept.of_branch
    if kept.state.shape != (potential.space.n_free,):
        raise InputError("start", kept, f"an equilibrium with {potential.space.n_free} unknowns (the same mesh and degree) is allowed")
    if potential.follows:
        borders = kept.scene.borders
        potential = potential.bordered(borders) if isinstance(potential, ContactFamily) else kept.potential
    evaluation = potential.evaluate(kept.state, kept.pressure, number)
    force = evaluation.gradient - kept.pressure * evaluation.volume_gradient
    residual = relative_residual(potential, force, evaluation, kept.pressure)
    if not residual <= max(RESIDUAL, 10 * kept.residual):
        raise InputError("start", kept, f"an equilibrium of this scene is allowed; forces are out of balance by {residual:.1e}")
    return State(evaluation.carried(kept.state), kept.pressure, evaluation, kept.iterations, 0.0, residual, 0.0)


def remembered(path: Predictor, unknowns: int) -> PathMemory:
    """A copy of a path in so many unknowns, for the record."""
    shape = (len(path.sigma), unknowns)
    return PathMemory(tuple(path.sigma), np.array(path.point).reshape(shape), np.array(path.slope).reshape(shape))


def predictor_of(memory: PathMemory) -> Predictor:
    """The path that was remembered."""
    return Predictor(list(memory.sigma), list(memory.points), list(memory.slopes))


def record(
    scene: Scene,
    potential: Potential,
    state: State,
    previous: Equilibrium | None = None,
    clock: float | None = None,
    gas: Gas | None = None,
) -> Equilibrium:
    """The public record of a solver's state, with what the scene asks of it at once.

    ``previous`` lends its modes as starting guesses; ``clock`` is the time at which work on this state began.
    """
    bad = ill_posed(potential, state.evaluation)
    status = state.status if bad is None else bad.status
    own = state.evaluation
    equilibrium = recorded(scene, potential, own.x, state.pressure, own, status, state.residual, state.iterations, gas)
    answer_at_once(equilibrium, previous, own)
    if clock is not None:  # written last, for answers take time
        store(equilibrium, seconds=time.perf_counter() - clock)
    return equilibrium


def record_on_borders(
    scene: Scene, state: State, solve: Solve, previous: Equilibrium | None = None, clock: float | None = None, gas: Gas | None = None
) -> Equilibrium:
    """The record of a state, put on elements that end at the borders of its zones where the scene wants that.

    An ill-posed state depends on the mesh, and stays on its own.

    Raises
    ------
    SolveError
        Where it is lost on the way.
    """
    potential = state.evaluation.potential
    if potential.follows:
        scene = scene.bordered(potential.scene.borders)
    followed = potential.follows and not potential.obstacles
    if followed or not scene.follows_zones or ill_posed(potential, state.evaluation) is not None:
        return record(scene, potential, state, previous, clock, gas)
    own, there = put_on_borders(scene, state, solve)
    if own is scene or own == scene:
        return record(scene, potential, state, previous, clock, gas)
    new = record(own, there.evaluation.potential, there, previous, clock, gas)
    on_branch = state.evaluation.x, state.pressure, state.evaluation, state.status, state.residual, state.iterations, gas
    store(new, on_branch=recorded(scene, potential, *on_branch))
    return new


def special_point(run: Run[Branch], scene: Scene, located: Located[BranchPoint], azimuthal: int = 0) -> SpecialPoint:
    """The public record of a located point. A branch point has the direction of its branch, which tells it from the crossing branch."""
    point, state = located.point, run.own(located.point.state)
    eq = record(scene, state.evaluation.potential, state)
    # over a number the direction is none of the branch of one scene
    tangent = point.tangent.copy() if located.kind == "branch_point" and len(point.tangent) == len(state.x) + 1 else None
    place = (eq.volume, eq.pressure, eq.center_height)
    zone = ZoneChange(KINDS[located.zone], located.place, *located.radii) if isinstance(located, ZoneEvent) else None
    return SpecialPoint(located.kind, *place, located.error, eq, azimuthal=azimuthal, over=run.over, tangent=tangent, zone=zone)
