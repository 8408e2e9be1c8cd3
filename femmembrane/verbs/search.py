"""All equilibria at one load."""

from __future__ import annotations

import numpy as np

from ..accuracy.borders import holding
from ..checks import number, only
from ..errors import SolveError, Status
from ..potential import potential_of
from ..results.equilibria import Equilibria
from ..results.equilibrium import Equilibrium
from ..results.other_mesh import state_of
from ..scene import Scene
from ..solve.controls import CONTROLS, Control
from ..solve.search import Search
from ..solve.state import State
from ..threads import one_thread
from .arguments import check_max_steps, check_scene
from .state_records import record_on_borders


@one_thread
def equilibria(scene: Scene, *, pressure: float | None = None, volume: float | None = None, max_steps: int = 400) -> Equilibria:
    """All equilibria at a pressure or at a volume that can be found, stable or not.

    Where the scene asks for an accuracy they are looked for on a trial mesh, and each is then corrected at the same load on a mesh that
    keeps the accuracy: one mesh for all if one of moderate size does, else one for each.

    Branches through several inflated and deflated starts are traced both ways and cut at the load. At every branch point on the way the
    crossing branch is traced too, each once. Newton's method with deflation of the states found then looks for branches that are not
    connected to these.

    Parameters
    ----------
    scene : Scene
    pressure, volume : float
        Exactly one of them.
    max_steps : int
        Most steps in each direction along a branch.

    Returns
    -------
    Equilibria

    Raises
    ------
    InputError
    SolveError
        When no mesh keeps the accuracy that the scene asks for.
    """
    check_scene(scene)
    control, load = only("equilibria", {"pressure": pressure, "volume": volume}, "exactly one of pressure and volume is allowed")
    load = number(control, load)
    check_max_steps(max_steps)
    if scene.open:
        found, search = _on_chosen_meshes(scene, control, load, max_steps)
    else:
        found, search = _found(scene, control, load, max_steps)
    energies = [eq.energy - eq.pressure * eq.volume * (control == "pressure") for eq in found]
    order = np.argsort(energies, kind="stable")
    return Equilibria(control, float(load), tuple(found[k] for k in order), tuple(float(energies[k]) for k in order), _searched(search))


def _found(scene: Scene, control: str, load: float, max_steps: int) -> tuple[list[Equilibrium], Search]:
    """The equilibria of a scene with a mesh, and what was done to find them."""
    # many states are looked at, of which few are kept
    potential = potential_of(scene.replace(follow_borders=None) if scene.follows_zones else scene)
    search = Search(potential, control, load, max_steps)
    search.run()
    return [record_on_borders(scene, state, holding(CONTROLS[control].at(load))) for state in search.states], search


def _on_chosen_meshes(scene: Scene, control: str, load: float, max_steps: int) -> tuple[list[Equilibrium], Search]:
    """The equilibria that are found on a trial mesh, on meshes that keep the accuracy."""
    from ..accuracy.along import meshes_for, trial_scenes

    for trial in trial_scenes(scene):
        found, search = _found(trial, control, load, max_steps)
        if not search.unresolved:
            break
    held = CONTROLS[control].at(load)
    return [_corrected(eq, there, held) for eq, there in zip(found, meshes_for(scene, found), strict=True)], search


def _corrected(eq: Equilibrium, scene: Scene, held: Control) -> Equilibrium:
    """An equilibrium at the same load on another mesh."""
    found = holding(held)(potential_of(scene), state_of(eq.of_branch))
    if found.status is not Status.CONVERGED:
        message = f"the equilibrium at V = {eq.volume:.6g}, P = {eq.pressure:.6g} was not found on the mesh that was chosen for it"
        raise SolveError(message, status=found.status)
    return record_on_borders(scene, State.of(found), holding(held))


def _searched(search: Search) -> str:
    """What was done, in words."""
    spans = ", ".join(f"V = {low:.4g} to {high:.4g}" for low, high in search.traced)
    parts = [f"{len(search.traced)} traced stretch(es) ({spans})", f"starts at V = {', '.join(f'{v:g}' for v in search.starts)}"]
    if search.followed:
        reach = [f(span) for f, span in ((min, [low for low, _ in search.beyond]), (max, [high for _, high in search.beyond])) if span]
        where = " (V = {:.4g} to {:.4g})".format(*reach) if reach else ""
        parts.append(f"{search.followed} branch point(s) at which the other branch was followed{where}")
    if left := len(search.crossings) - search.followed:
        parts.append(f"{left} more at which it was not")
    parts.append(f"{search.deflations} deflated solves ({search.iterations} iterations)")
    ill = f"; {len(search.ill_posed)} ill-posed state(s) left out, whose shape depends on the mesh" if search.ill_posed else ""
    lost = f"; {len(search.unresolved)} state(s) left out that the mesh does not resolve" if search.unresolved else ""
    return f"searched: {', '.join(parts)}{ill}{lost}"
