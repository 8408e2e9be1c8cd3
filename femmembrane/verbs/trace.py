"""Whole branches by arc length, with their special points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..errors import SolveError, Status
from ..results.records import Branch, Equilibrium, SpecialPoint
from ..scene import Scene
from ..solve.continuation import StepControl
from ..threads import one_thread
from .arguments import check_scene
from .meshing import on_chosen_mesh
from .number_trace import NumberTraceRequest
from .running import carry_out
from .state_records import OnCheckpoint, OnStep
from .trace_run import TraceRequest


@one_thread
def trace(
    scene: Scene,
    *,
    start: float | Equilibrium | SpecialPoint | Branch | None = None,
    until: Mapping[str, float] | None = None,
    over: str | None = None,
    hold: Mapping[str, float] | None = None,
    direction: int | None = None,
    max_steps: int = 400,
    steps: StepControl | None = None,
    special_points: bool = True,
    ill_posed: str = "stop",
    throw: bool = False,
    on_step: OnStep | None = None,
    on_checkpoint: OnCheckpoint | None = None,
) -> Branch:
    """Follow a branch by arc length, stable or not, through limit points and folds.

    Parameters
    ----------
    scene : Scene
    start : float, Equilibrium, SpecialPoint or Branch, optional
        A volume (default that of the moderately inflated membrane: that at rest and 0.5, or an eighth of it), an equilibrium of this scene,
        or a traced branch to be continued (its points are part of the result, and the new ones are those of an uninterrupted trace to
        the last bit; it keeps its own direction, step and search for special points). From a branch point (of the ``special_points`` of
        a branch of this scene) the *other* branch that crosses there is traced, one half of it: ``fm.trace(scene, start=point)``. From
        another special point that is an equilibrium of this branch the trace sets out as from that equilibrium.
    until : mapping, optional
        Where to end: values of any of volume, pressure, center_height, and over a number of the number by its name, whichever is met
        first; the last point lies exactly on it. The start itself does not count, and what lies behind it is met, if at all, on a distant
        part of the branch: see ``direction``.
    over : str, optional
        A number of the scene that changes along the branch in place of the load, such as ``source.0.height``: see
        :mod:`femmembrane.scene.variation`. It sets out from its value in ``scene``, and every equilibrium has its own scene.
    hold : mapping, optional
        What is held meanwhile: a value of one of volume, pressure, center_height. The membrane is first brought there from ``start``;
        without a start, as :func:`equilibrium` finds it.
    direction : {1, -1}, optional
        1 (default) sets out towards larger volume; over a number to larger numbers, and by default towards the value of it in ``until``.
        From a branch point it names the half of the other branch: 1 that on which the volume grows,
        or where it is stationary, as on both halves of a pitchfork, that on which the pole rises (with the pole held, the membrane).
    max_steps : int
        Most steps.
    steps : StepControl, optional
        Lengths and accuracy of the steps.
    special_points : bool
        Whether limit points, volume folds, height folds and branch points are located.
    ill_posed : {"stop", "mark"}
        What to do where the meridional stress is compressive, so that the Legendre-Hadamard condition fails and the plain membrane
        has no mesh-independent equilibria, or where a tension field is slack: end there, or go on with that status on every such state.
    throw : bool
        Raise when the branch ends before ``until`` is met. A branch that ends is a result, so by default it is returned, with the
        reason in its status and message.
    on_step : callable, optional
        Called with (index, total, equilibrium) after each step.
    on_checkpoint : callable, optional
        Called after each step with the branch so far, which may be saved and later given as ``start``.

    Returns
    -------
    Branch

    Raises
    ------
    InputError, SolveError
        The former also for an azimuthal onset as start: the states beyond it are not axisymmetric, and are not computed. The latter when
        the start cannot be reached or no mesh meets the accuracy that the scene asks for, and for ``throw``: then it
        carries the branch as ``result``.
    """
    check_scene(scene)
    common: dict[str, Any] = {"max_steps": max_steps, "steps": steps, "ill_posed": ill_posed, "special_points": special_points}
    if over is None and hold is None:
        request = TraceRequest.checked(start, until, direction=1 if direction is None else direction, **common)
    else:
        request = NumberTraceRequest.over_number(scene, start, until, over=over, hold=hold, direction=direction, **common)
    branch = carry_out(on_chosen_mesh(scene, request), on_step=on_step, on_checkpoint=on_checkpoint)
    if throw and branch.message and (until is not None or branch.status is not Status.STEP_LIMIT):
        raise SolveError(branch.message, status=branch.status, result=branch)
    return branch


def trace_iter(
    scene: Scene,
    *,
    start: float | Equilibrium | SpecialPoint | None = None,
    direction: int = 1,
    max_steps: int = 400,
    steps: StepControl | None = None,
    ill_posed: str = "stop",
) -> Iterator[Equilibrium]:
    """The equilibria of :func:`trace` one by one, as they are found: a loop may look at each and stop when it likes.

    The iterator ends where the branch does, or after ``max_steps``. It locates no special points, and chooses no mesh for an accuracy.

    Parameters
    ----------
    scene : Scene
        With a mesh.
    start : float, Equilibrium or SpecialPoint, optional
        A volume, an equilibrium, or a branch point whose other branch is meant, as in :func:`trace`.
    direction : {1, -1}
        1 sets out towards larger volume.
    max_steps : int
        Most steps.
    steps : StepControl, optional
        Lengths and accuracy of the steps.
    ill_posed : {"stop", "mark"}
        What to do where the membrane is compressed or slack, as in :func:`trace`.

    Yields
    ------
    Equilibrium

    Raises
    ------
    InputError, SolveError
        When the first equilibrium is asked for: for an argument that is not allowed, and for a start that cannot be reached.
    """
    check_scene(scene)
    request = TraceRequest.checked(start, None, direction=direction, max_steps=max_steps, steps=steps, ill_posed=ill_posed)
    tracing = one_thread(request.begin)(scene)
    yield tracing.found[0]
    step, known, end = one_thread(tracing.step), 1, None
    while end is None:
        end = step()
        if len(tracing.found) > known:
            known = len(tracing.found)
            yield tracing.found[-1]
