"""Whole branches by arc length, with their special points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, overload

from ..errors import InputError, SolveError, Status
from ..results.branch import Branch
from ..results.equilibrium import Equilibrium
from ..results.special_point import SpecialPoint
from ..results.tipped import TippedBranch
from ..scene import Scene
from ..solve.continuation import StepControl
from ..threads import one_thread
from .arguments import check_scene
from .meshing import on_chosen_mesh
from .number_trace import NumberTraceRequest
from .running import carry_out
from .state_records import OnCheckpoint, OnStep
from .tipped_trace import TippedRequest, trace_tipped
from .trace_run import TraceRequest


@overload
def trace(
    scene: Scene,
    *,
    start: float | Equilibrium | Branch | None = None,
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
) -> Branch: ...


@overload
def trace(
    scene: Scene,
    *,
    start: SpecialPoint,
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
    harmonics: int | None = None,
) -> Any: ...


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
    harmonics: int | None = None,
) -> Branch | TippedBranch:
    """Follow a branch by arc length, stable or not, through limit points and folds.

    Parameters
    ----------
    scene : Scene
    start : float, Equilibrium, SpecialPoint or Branch, optional
        Where to set out from:

        * a volume; the default is the moderately inflated membrane, whose volume exceeds the volume at rest by an eighth of it, or by 0.5;
        * an equilibrium of this scene, or a special point of a branch, which counts as the equilibrium there;
        * a branch point of a branch of this scene: one half of the *crossing* branch is traced, ``fm.trace(scene, start=point)``;
        * an azimuthal onset of a branch of this scene: the branch of states with waves around the axis that sets in there is traced. The
          result is a :class:`TippedBranch`;
        * a traced branch, which is continued. Its points are part of the result. It keeps its own direction, step and search for special
          points, and the new points are the same to the last bit as without the interruption.
    until : mapping, optional
        Where to end: values of any of volume, pressure, center_height and, with a chamber, gas. The first value that is met ends the
        trace, and the last point lies exactly on it. The start itself does not count. A value behind the start is met on a distant part of
        the branch, if at all: see ``direction``. Over a number it may be a value of that, by its name.
    over : str, optional
        A number of the scene that changes along the branch in place of the load, such as ``source.0.height``: see
        :mod:`femmembrane.scene.variation`. It sets out from its value in ``scene``, and every equilibrium has its own scene.
    hold : mapping, optional
        What is held meanwhile: a value of one of volume, pressure, center_height and, with a chamber, gas (its amount). The membrane
        is first brought there from ``start``; without a start, as :func:`equilibrium` finds it.
    direction : {1, -1}, optional
        1 (default) sets out towards larger volume. Over a number it sets out towards larger numbers; the default is then the way to the
        number in ``until``. From a branch point it names a half of the crossing branch: on half 1 the volume grows. Where the
        volume is stationary, as on both halves of a pitchfork, the pole rises on half 1 (or the membrane, if the pole is held).
    max_steps : int
        Most steps along the branch.
    steps : StepControl, optional
        Lengths and accuracy of the steps.
    special_points : bool
        Whether limit points, volume folds, height folds and branch points are located; with bodies in the way where they are touched and
        let go, in a tension field where zones open and close.
    ill_posed : {"stop", "mark"}
        What to do where the states depend on the mesh: "stop" ends there, "mark" goes on and gives every such state its status. The states
        of a plain membrane depend on the mesh where the meridional stress is compressive, since the Legendre-Hadamard condition fails
        there. The states of a tension field do where it is slack. Beyond an azimuthal onset a trace goes on as long as the harmonics
        resolve the states; where a stress is compressive, status and verdict of a state say so.
    throw : bool
        Raise when the branch ends before ``until`` is met. By default such a branch is returned, with the reason in its status and message.
    on_step : callable, optional
        Called with (index, total, equilibrium) after each step.
    on_checkpoint : callable, optional
        Called after each step with the branch so far, which may be saved and later given as ``start``; not from an azimuthal onset.
    harmonics : int, optional
        From an azimuthal onset: how many harmonics of its waves the displacement has around the axis. Default: as many as leave out less
        than 5e-5 of the membrane's size, at most 24. Each state estimates what is left out, and says so where it is too much.

    Returns
    -------
    Branch or TippedBranch

    Raises
    ------
    InputError, SolveError
        InputError also for an azimuthal onset as start where the states beyond it are not computed, with the reason. SolveError when the
        start cannot be reached, when no mesh meets the accuracy that the scene asks for, and for ``throw``; then it carries the branch as
        ``result``.

    Examples
    --------
    The pressure of a neo-Hookean disc has a maximum, which the branch passes:

    >>> import femmembrane as fm
    >>> branch = fm.trace(fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16)), until={"volume": 10.0})
    >>> for point in branch.special_points:
    ...     print(f"{point.kind}: P = {point.pressure:.4f}, V = {point.volume:.3f}")
    limit_point: P = 1.8792, V = 2.797
    >>> branch[-1].verdict("pressure").word, branch[-1].verdict("volume").word
    ('unstable', 'stable')
    """
    check_scene(scene)
    if isinstance(start, SpecialPoint) and start.kind == "azimuthal_onset" and over is None and hold is None:
        asked = TippedRequest.checked(
            start,
            until,
            direction=1 if direction is None else direction,
            max_steps=max_steps,
            steps=steps,
            special_points=special_points,
            harmonics=harmonics,
        )
        tipped = trace_tipped(scene, asked, on_step)  # type: ignore[arg-type]  # it takes the states of this branch
        if throw and tipped.message and (until is not None or tipped.status is not Status.STEP_LIMIT):
            raise SolveError(tipped.message, status=tipped.status, result=tipped)
        return tipped
    if harmonics is not None:
        raise InputError("harmonics", harmonics, "allowed with an azimuthal onset as start only")
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
    """The equilibria of :func:`trace` one by one, as they are found. A loop may look at each and stop when it likes.

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
