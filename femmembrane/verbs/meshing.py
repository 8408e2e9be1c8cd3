"""The mesh of a scene that names an accuracy instead: chosen before anything is computed."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, TypeVar

from ..discretization.space import transferred
from ..errors import SolveError, Status
from ..potential import potential_of
from ..results.equilibrium import Equilibrium
from ..scene import Scene
from .arguments import check_scene

if TYPE_CHECKING:
    from ..accuracy.along import Along, Shortfall
    from .running import Request

S = TypeVar("S")


@dataclass(frozen=True)
class Chosen:
    """A scene with a mesh, and what is asked of it there.

    Attributes
    ----------
    scene : Scene
    request : Request
        Its start lies on the mesh, and it ends where the accuracy does.
    timings : mapping of str to float
        Seconds that the choice took; empty where there was none to make.
    shortfall : Shortfall or None
        Where the accuracy ends; None where it is kept all along.
    along : Along or None
        What changes the mesh along the run; None for a run on one mesh.
    """

    scene: Scene
    request: Request
    timings: Mapping[str, float] = field(default_factory=dict)
    shortfall: Shortfall | None = None
    along: Along | None = None


def on_chosen_mesh(scene: Scene, request: Request) -> Chosen:
    """Choose the mesh of a scene that names an accuracy, by trial runs of the request; another scene keeps its own.

    Parameters
    ----------
    scene : Scene
    request : Request

    Raises
    ------
    InputError
        For what is no scene.
    SolveError
        When no mesh meets the accuracy, or the run yields nothing on a trial mesh.
    """
    check_scene(scene)
    if not scene.open:
        return Chosen(scene, request)
    kept = request.start_scene
    if kept is not None and getattr(kept.mesh, "accuracy", None) == getattr(scene.mesh, "accuracy", None):
        return Chosen(scene.replace(mesh=kept.mesh, degree=kept.degree), request)
    clock = time.perf_counter()
    from ..accuracy.along import choose_and_check

    trial = request.trial()
    changes = request.mesh_changes and not (scene.bodies or scene.follows_zones)
    every = trial.covers(request)
    chosen, shortfall, along = choose_and_check(scene, lambda on: trial.on(on).begin(on).follow(), request.errors_at, changes, every)
    if shortfall is not None and not shortfall.kept:
        raise SolveError(str(shortfall), status=Status.ACCURACY_NOT_MET)
    request = (request if shortfall is None else request.up_to(shortfall.kept)).on(chosen)
    return Chosen(chosen, request, {"mesh": time.perf_counter() - clock}, shortfall, along)


def carried(start: S, scene: Scene) -> S | Equilibrium:
    """A start on the mesh of a scene. An equilibrium of another mesh is a guess there: whoever resumes it solves again."""
    if not isinstance(start, Equilibrium):
        return start
    state = transferred(start.potential.space, start.state, potential_of(scene).space)
    return replace(start, scene=scene, state=state, _answers={})
