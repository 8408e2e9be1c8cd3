"""The mesh of a scene that names an accuracy instead: chosen before anything is computed."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from ..errors import SolveError, Status
from ..potential import potential_of
from ..results.records import Branch, Equilibrium
from ..scene import Scene
from ..solve.finer_space import transferred
from .arguments import check_scene

if TYPE_CHECKING:
    from ..accuracy.adapt import Shortfall

#: what is wanted, or a part of it, from a scene with a mesh and a start on it
FollowFrom = Callable[[Scene, Equilibrium | None], Branch]


def on_chosen_mesh(
    scene: Scene, start: Equilibrium | None, follow: FollowFrom, control: str
) -> tuple[Scene, Equilibrium | None, dict[str, float], Shortfall | None]:
    """The scene with a mesh, the start on that mesh, the seconds that the choice took, and where ``follow`` leaves the accuracy on it.

    All is as it is unless the mesh is still to be chosen.

    Raises
    ------
    InputError
        For what is no scene.
    SolveError
        When no mesh meets the accuracy, or the run yields nothing on a trial mesh.
    """
    check_scene(scene)
    if not scene.open:
        return scene, start, {}, None
    clock = time.perf_counter()
    from ..accuracy.adapt import choose_and_check

    chosen, shortfall = choose_and_check(scene, lambda trial: follow(trial, _carried(start, trial)), control)
    if shortfall is not None and not shortfall.kept:
        raise SolveError(str(shortfall), status=Status.ACCURACY_NOT_MET)
    return chosen, _carried(start, chosen), {"mesh": time.perf_counter() - clock}, shortfall


def _carried(start: Equilibrium | None, scene: Scene) -> Equilibrium | None:
    """A start on another mesh, as a guess: whoever resumes it solves again."""
    if not isinstance(start, Equilibrium):
        return start
    state = transferred(start.potential.space, start.state, potential_of(scene).space)
    return replace(start, scene=scene, state=state, _answers={})
