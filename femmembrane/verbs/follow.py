"""Equilibria and runs under volume, pressure or height control."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import is_number, number, only
from ..errors import InputError, SolveError
from ..results.branch import Branch
from ..results.checkpoint import same_scene
from ..results.equilibrium import Equilibrium
from ..scene import Scene
from ..scene.run import GAS
from ..solve.controls import CONTROLS, Controlled, Gas, control_kind
from ..threads import one_thread
from .arguments import check_scene, plain
from .load_run import LoadRequest, checked_loads
from .meshing import on_chosen_mesh
from .number_run import NumberRequest
from .number_trace import NumberTraceRequest
from .over_number import gas_of
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
        A neighbour to start from. Default: the membrane is inflated without sources, and these are turned on at the first volume.
    solver : {"ipopt", "newton"}
        Minimiser, or the bordered corrector (which also follows saddle points).
    at_limit : {"stop", "jump"}
        What to do where the branch turns back before a load, or becomes unstable at a branch point (``solver="ipopt"``). "stop" ends there
        and says where the membrane would go. "jump" goes on from the next stable state at this load, on this branch or on the crossing one.
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
        A SolveError carries the branch up to the failure as ``result``.

    Examples
    --------
    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16))
    >>> for eq in fm.inflate(scene, volumes=[0.5, 1.0, 2.0]):
    ...     print(f"V = {eq.volume:.1f}  P = {eq.pressure:.4f}")
    V = 0.5  P = 0.2905
    V = 1.0  P = 1.0669
    V = 2.0  P = 1.8025
    """
    request = LoadRequest(CONTROLS["volume"], checked_loads("volumes", volumes, scene, "volume"), start, solver, at_limit, throw)
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

    Without ``start`` the first state is the first stable equilibrium on the branch through the moderately inflated membrane.

    Parameters
    ----------
    scene : Scene
    pressures : array_like
        Pressures P = p R0/(mu T), signed. With scales a text may have a unit: "1 kPa".
    start, solver, at_limit, throw, on_step
        As in :func:`inflate`.

    Returns
    -------
    Branch

    Raises
    ------
    InputError, SolveError
        A SolveError carries the branch up to the failure as ``result``.

    Examples
    --------
    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16))
    >>> for eq in fm.pressurize(scene, pressures=[0.5, 1.0, 1.5]):
    ...     print(f"P = {eq.pressure:.1f}  V = {eq.volume:.4f}")
    P = 0.5  V = 0.6398
    P = 1.0  V = 0.9537
    P = 1.5  V = 1.3881
    """
    request = LoadRequest(CONTROLS["pressure"], checked_loads("pressures", pressures, scene, "pressure"), start, solver, at_limit, throw)
    return _follow(scene, request, on_step=on_step)


@one_thread
def vary(
    scene: Scene,
    over: str,
    values: ArrayLike,
    *,
    hold: Mapping[str, float],
    start: Equilibrium | None = None,
    solver: str = "ipopt",
    at_limit: str = "stop",
    throw: bool = True,
    on_step: OnStep | None = None,
) -> Branch:
    """Follow the membrane through given values of a number of the scene, in the order given, while a quantity is held.

    Every equilibrium has the scene with its own value, and the branch has the number as a column.

    Parameters
    ----------
    scene : Scene
    over : str
        Name of the number, such as ``source.0.height``: see :mod:`femmembrane.scene.variation`.
    values : array_like
        Its values.
    hold : mapping
        What is held: a value of one of volume, pressure, center_height and, with a chamber, gas (its amount).
    start : Equilibrium, optional
        An equilibrium of the scene with any value of the number; default: as :func:`equilibrium` finds one at the first value.
    solver, at_limit, throw, on_step
        As in :func:`inflate`. With ``at_limit="jump"`` the membrane snaps where the branch turns back in the number.

    Returns
    -------
    Branch

    Raises
    ------
    InputError, SolveError
        The latter carries the branch up to the failure as ``result``.

    Examples
    --------
    A magnet comes nearer, and the membrane rises towards it:

    >>> import femmembrane as fm
    >>> magnet = fm.Dipole(strength=20.0, height=4.0)
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), sources=[magnet], susceptibility=1.0)
    >>> branch = fm.vary(scene, "source.0.height", [4.0, 3.0, 2.5], hold={"pressure": 0.0})
    >>> [round(float(height), 4) for height in branch.column("center_height")]
    [0.1065, 0.2384, 0.5635]
    """
    check_scene(scene)
    common: dict[str, Any] = {"start": start, "solver": solver, "at_limit": at_limit, "throw": throw}
    return _follow(scene, NumberRequest.checked(scene, values, over=over, hold=hold, **common), on_step=on_step)


@one_thread
def equilibrium(
    scene: Scene,
    *,
    volume: float | None = None,
    pressure: float | None = None,
    center_height: float | None = None,
    gas: Gas | float | None = None,
    start: Equilibrium | None = None,
    solver: str = "ipopt",
) -> Equilibrium:
    """One equilibrium at a volume, a pressure, a height of the pole, or with a fixed amount of gas.

    Exactly one of ``volume``, ``pressure``, ``center_height`` and ``gas`` is given. Under volume and pressure control the state is a
    minimum (``solver="ipopt"``), or any solution of the equations (``"newton"``). Heights and gases always take the Newton corrector: no
    potential holds a height, and the branch is followed while the gas is let in.

    Parameters
    ----------
    scene : Scene
    volume : float, optional
        Enclosed volume over R0^3 (with the 2 pi), signed.
    pressure : float, optional
        P = p R0/(mu T).
    center_height : float, optional
        Height over R0 of the pole, or of the first point of a meridian without a pole.
    gas : Gas or float, optional
        A fixed amount of gas behind the membrane. A number is an amount in the chamber of the scene.
    start : Equilibrium, optional
        A neighbour to start from. Default: a cold start from the moderately inflated membrane.
    solver : {"ipopt", "newton"}
        Minimiser, or the bordered corrector (which also finds saddle points).

    Returns
    -------
    Equilibrium

    Raises
    ------
    InputError, SolveError
        SolveError when no equilibrium was found; its message says what was tried.

    Examples
    --------
    >>> import femmembrane as fm
    >>> eq = fm.equilibrium(fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16)), volume=1.0)
    >>> print(f"P = {eq.pressure:.4f}, pole at {eq.center_height:.4f}")
    P = 1.0669, pole at 0.5528
    >>> eq.verdict("pressure").word
    'stable'

    A disc that is stretched over its rim is stiff without any load; it bulges in proportion to a small pressure.

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
        load = plain(control, load, scene, control)
        held, load = CONTROLS[control], number(control, load, "one finite number is allowed")
    elif isinstance(gas, Gas):
        held, load = gas, gas.amount
    elif is_number(gas):
        check_scene(scene)
        held = gas_of(scene, "gas").at(number("gas", gas, "an amount > 0 is allowed", above=0.0))
        load = held.amount
    else:
        raise InputError("gas", gas, "an amount in the chamber of the scene is allowed, or a Gas such as Gas(amount=3.0, chamber=1.0)")
    return _follow(scene, LoadRequest(held, np.array([load]), start, solver, throw=True))[0]


@one_thread
def run(
    scene: Scene, on_step: OnStep | None = None, *, on_checkpoint: OnCheckpoint | None = None, unfinished: Branch | None = None
) -> Branch:
    """Do what the scene's [run] says. A solve that fails raises nothing: the branch carries its status and message.

    Parameters
    ----------
    scene : Scene
    on_step : callable, optional
        Called with (index, total, equilibrium) after each equilibrium.
    on_checkpoint : callable, optional
        Called after each equilibrium with the branch so far, which may be saved.
    unfinished : Branch, optional
        The last branch that ``on_checkpoint`` was called with, when a run of this scene was interrupted. It is finished, and the result is
        the same to the last bit as without the interrupt.

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
    number = asked.number
    solved: dict[str, Any] = {"solver": asked.solver, "at_limit": asked.at_limit}
    observed: dict[str, Any] = {"on_step": on_step, "on_checkpoint": on_checkpoint, "unfinished": unfinished}
    if asked.control == "arc-length":
        request = TraceRequest(asked.start, checked_targets(asked.until) if number is None else {}, asked.direction or 1, asked.max_steps)
        if number is not None:
            more: dict[str, Any] = {"direction": asked.direction, "max_steps": asked.max_steps}
            request = NumberTraceRequest.over_number(scene, asked.start, asked.until, over=number, hold=asked.hold, **more)
        return carry_out(on_chosen_mesh(scene, request), **observed)
    if number is not None:
        values_key = "run.values" if asked.values is not None else "run.start"
        over = NumberRequest.checked(scene, asked.loads(), over=number, hold=asked.hold, key="run.control", values_key=values_key, **solved)
        return _follow(scene, over, **observed)
    held = gas_of(scene, "run.control") if asked.control == GAS else control_kind(asked.control)
    return _follow(scene, LoadRequest(held, asked.loads(), **solved), **observed)


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
