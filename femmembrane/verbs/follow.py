"""Equilibria and runs under volume, pressure or height control."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import number, only
from ..errors import InputError, SolveError
from ..results.checkpoint import same_scene
from ..results.records import Branch, Equilibrium
from ..scene import Scene
from ..solve.controls import CONTROLS, Controlled, Gas, control_kind
from ..threads import one_thread
from .arguments import check_scene
from .load_run import LoadRequest, checked_loads
from .meshing import on_chosen_mesh
from .running import carry_out
from .state_records import OnCheckpoint, OnStep
from .trace_run import TraceRequest, checked_targets


@one_thread
def inflate(
    scene: Scene,
    *,
    volumes: ArrayLike,
    start: Equilibrium | None = None,
    solver: str = "ipopt",
    at_limit: str = "stop",
    throw: bool = True,
    on_step: OnStep | None = None,
) -> Branch:
    """Follow the membrane through given volumes, in the order given.

    Parameters
    ----------
    scene : Scene
    volumes : array_like
        Enclosed volumes over R0^3 (with the 2 pi), signed.
    start : Equilibrium, optional
        A neighbour to start from; default: inflated without sources, which are then turned on at the first volume.
    solver : {"ipopt", "newton"}
        Minimiser, or the bordered corrector (which also follows saddle points).
    at_limit : {"stop", "jump"}
        Where the branch turns back before a load, or becomes unstable at a branch point (``solver="ipopt"``): end there, saying where the
        membrane would go, or go to the next stable state at that load, of this branch or of the one that crosses it, and on from there.
    throw : bool
        Raise when a volume cannot be reached; otherwise return what was reached, with its status and message.
    on_step : callable, optional
        Called with (index, total, equilibrium) after each equilibrium.

    Returns
    -------
    Branch

    Raises
    ------
    InputError, SolveError
        The latter carries the branch up to the failure as ``result``.
    """
    request = LoadRequest(CONTROLS["volume"], checked_loads("volumes", volumes), start, solver, at_limit, throw)
    return _follow(scene, request, on_step=on_step)


@one_thread
def pressurize(
    scene: Scene,
    *,
    pressures: ArrayLike,
    start: Equilibrium | None = None,
    solver: str = "ipopt",
    at_limit: str = "stop",
    throw: bool = True,
    on_step: OnStep | None = None,
) -> Branch:
    """Follow the membrane through given pressures P = p R0/(mu T), in the order given; otherwise as :func:`inflate`.

    Without ``start`` the first state is the first stable equilibrium met on the branch through the moderately inflated membrane.

    Parameters
    ----------
    scene : Scene
    pressures : array_like
        Pressures P = p R0/(mu T), signed.
    start, solver, at_limit, throw, on_step
        As in :func:`inflate`.

    Returns
    -------
    Branch

    Raises
    ------
    InputError, SolveError
        The latter carries the branch up to the failure as ``result``.
    """
    request = LoadRequest(CONTROLS["pressure"], checked_loads("pressures", pressures), start, solver, at_limit, throw)
    return _follow(scene, request, on_step=on_step)


@one_thread
def equilibrium(
    scene: Scene,
    *,
    volume: float | None = None,
    pressure: float | None = None,
    center_height: float | None = None,
    gas: Gas | None = None,
    start: Equilibrium | None = None,
    solver: str = "ipopt",
) -> Equilibrium:
    """One equilibrium at a volume, a pressure, a height of the pole, or with a fixed amount of gas.

    Exactly one of ``volume``, ``pressure``, ``center_height`` and ``gas`` is given. Under volume and pressure control the state is a
    minimum (``solver="ipopt"``), or any solution of the equations (``"newton"``). The other two always take the Newton corrector:
    a height is held by no potential, and with a gas the branch is followed as the gas is let in.

    Parameters
    ----------
    scene : Scene
    volume : float, optional
        Enclosed volume over R0^3 (with the 2 pi), signed.
    pressure : float, optional
        P = p R0/(mu T).
    center_height : float, optional
        Height over R0 of the pole, or of the first point of a meridian without a pole.
    gas : Gas, optional
        Amount of gas behind the membrane.
    start : Equilibrium, optional
        A neighbour to start from; default: a cold start from the moderately inflated membrane.
    solver : {"ipopt", "newton"}
        Minimiser, or the bordered corrector (which also finds saddle points).

    Returns
    -------
    Equilibrium

    Raises
    ------
    InputError, SolveError

    Examples
    --------
    A disc that is stretched over its rim is stiff without any load; it bulges in proportion to a small pressure.

    >>> import femmembrane as fm
    >>> drum = fm.Scene(material=fm.NeoHookean(), prestretch=1.5)
    >>> flat = fm.equilibrium(drum, pressure=0.0)
    >>> print(f"{flat.volume:.3f} {flat.frequencies(count=1)[0].omega:.4f}")
    0.000 2.2968
    >>> print(f"{fm.equilibrium(drum, volume=0.3).pressure:.5f}")
    0.13723
    """
    given = {"volume": volume, "pressure": pressure, "center_height": center_height, "gas": gas}
    control, load = only("equilibrium", given, "exactly one of volume, pressure, center_height and gas is allowed")
    held: Controlled
    if gas is None:
        held, load = CONTROLS[control], number(control, load, "one finite number is allowed")
    elif isinstance(gas, Gas):
        held, load = gas, gas.amount
    else:
        raise InputError("gas", gas, "a Gas is allowed, such as Gas(amount=3.0, chamber=1.0)")
    return _follow(scene, LoadRequest(held, np.array([load]), start, solver, throw=True))[0]


@one_thread
def run(
    scene: Scene, on_step: OnStep | None = None, *, on_checkpoint: OnCheckpoint | None = None, unfinished: Branch | None = None
) -> Branch:
    """Do what the scene's [run] says; never raises for a solve that fails: the branch carries its status and message.

    Parameters
    ----------
    scene : Scene
    on_step : callable, optional
        Called with (index, total, equilibrium) after each equilibrium.
    on_checkpoint : callable, optional
        Called after each equilibrium with the branch so far, which may be saved.
    unfinished : Branch, optional
        The last branch that ``on_checkpoint`` was called with, when a run of this scene was interrupted: it is finished, and the result is
        that of an uninterrupted run to the last bit.

    Returns
    -------
    Branch

    Raises
    ------
    InputError
        When the scene has no [run], or ``unfinished`` belongs to another scene.
    """
    check_scene(scene)
    if scene.run is None:
        raise InputError("run", None, 'a [run] table is required, for instance control = "volume", start = 0.5, stop = 75.0, steps = 60')
    asked = scene.run
    if unfinished is not None:
        scene = same_scene(scene, unfinished, "unfinished")
    observed: dict[str, Any] = {"on_step": on_step, "on_checkpoint": on_checkpoint, "unfinished": unfinished}
    if asked.control == "arc-length":
        targets = checked_targets(asked.until)
        request = TraceRequest(asked.start, targets, direction=asked.direction, max_steps=asked.max_steps)
        return carry_out(on_chosen_mesh(scene, request), **observed)
    loads = LoadRequest(control_kind(asked.control), asked.loads(), solver=asked.solver, at_limit=asked.at_limit)
    return _follow(scene, loads, **observed)


def _follow(
    scene: Scene,
    request: LoadRequest,
    *,
    on_step: OnStep | None = None,
    on_checkpoint: OnCheckpoint | None = None,
    unfinished: Branch | None = None,
) -> Branch:
    """The run that is asked for; a branch that ends early is raised or returned, as asked."""
    try:
        chosen = on_chosen_mesh(scene, request)
    except SolveError as error:
        if request.throw:
            raise
        return Branch(scene, (), error.status, str(error))
    branch = carry_out(chosen, on_step=on_step, on_checkpoint=on_checkpoint, unfinished=unfinished)
    if request.throw and branch.message:
        raise SolveError(f"{branch.message}; {branch.status.advice}", status=branch.status, result=branch)
    return branch
