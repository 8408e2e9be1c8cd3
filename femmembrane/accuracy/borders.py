"""An equilibrium on elements that end at borders, where the branch that it is of was followed on others."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, cast

import numpy as np

from ..discretization.meridian import assigned_ends, on_own_ends
from ..discretization.space import space_of_scene
from ..errors import InputError, SolveError, Status
from ..potential import Potential, potential_of
from ..results.equilibrium import Equilibrium, recorded
from ..scene import Scene
from ..solve.controls import Control
from ..solve.finer_space import solved_in
from ..solve.newton import NewtonResult
from ..solve.state import State
from ..solve.wellposed import ill_posed
from ..solve.zone_borders import FRESH, ROUNDS, ZoneBorders
from ..solve.zone_strains import HOOP, Strains

if TYPE_CHECKING:
    from ..potential.following import WrinklingPotential

#: from a potential and a state in another space to the equilibrium that it stands for
Solve = Callable[[Potential, State], NewtonResult]


def holding(held: Control) -> Solve:
    """What is solved for while a control holds its load."""
    return lambda onto, state: solved_in(onto, held, state.evaluation.potential, state.x, state.pressure, damped=True)


def put_on_borders(scene: Scene, state: State, solve: Solve) -> tuple[Scene, State]:
    """The equilibrium that a state stands for, at the same load, on elements that end at the borders of its zones, and its scene.

    Parameters
    ----------
    scene : Scene
        Of a tension field, with the mesh whose ends are moved; they follow its zones.
    state : State
        On that mesh.
    solve : callable
        Finds the equilibrium in another space from the state in one, with the same load: see :func:`holding`.

    Raises
    ------
    InputError
        Where the mesh has fewer elements than the membrane has zones.
    SolveError
        Where the equilibrium is lost on the way, or the borders do not come to rest.
    """
    if scene.bodies:
        return _beside_bodies(scene, state, solve)
    onto = cast("WrinklingPotential", potential_of(scene))
    found = solve(onto, state)
    if found.status is not Status.CONVERGED:
        raise SolveError("the equilibrium was not found on elements that end at the borders of its zones", status=found.status)
    own = cast("WrinklingPotential", found.evaluation.potential)
    if not own.borders:
        _check_borders(own, found)
    return scene.bordered(own.borders), State.of(found, state.iterations)


def _beside_bodies(base: Scene, state: State, solve: Solve) -> tuple[Scene, State]:
    """The same where ends of elements follow borders of contact as well: on a mesh that has ends at the borders of the zones."""
    scene, places = base, base.mesh.breakpoints()
    for _ in range(FRESH):
        borders = ZoneBorders.of(Strains(state.evaluation))
        if borders is None or np.isin(borders.places, state.evaluation.potential.space.ends).all():
            break
        while True:
            space = space_of_scene(base.bordered(()))
            moved = space.with_moved(assigned_ends(space.ends, borders.ends, np.flatnonzero(~space.movable).tolist())).ends
            scene = base.replace(mesh=on_own_ends(base.mesh, moved[np.isin(space.ends, places)]))
            found = solve(potential_of(scene), state)
            if found.status is not Status.CONVERGED:
                raise SolveError("the equilibrium was not found on elements that end at the borders of its zones", status=found.status)
            state = State.of(found, state.iterations)
            if borders.at_rest:
                break
            if borders.rounds == ROUNDS or not borders.move(found):
                raise SolveError("the borders of its zones do not come to rest; more elements may help", status=Status.NOT_CONVERGED)
        if borders.explain(found):
            break
    return scene.bordered(state.evaluation.potential.borders), state


def _check_borders(potential: WrinklingPotential, found: NewtonResult) -> None:
    """Raise an error for a state that has borders which elements did not follow."""
    space = potential.space
    places = Strains(found.evaluation).runs(HOOP).edges
    if places.size:
        assigned_ends(space.ends, places, np.flatnonzero(~space.movable).tolist())
        raise SolveError("the borders of its zones do not come to rest; more elements may help", status=Status.NOT_CONVERGED)


def equilibrium_on_borders(eq: Equilibrium, held: Control) -> Equilibrium:
    """See :meth:`.Equilibrium.on_borders`."""
    scene = eq.scene
    if not scene.tension_field:
        allowed = "true is needed: without it the energy feels no border of a zone"
        raise InputError("effects.tension_field", False, allowed)
    if eq.status.ill_posed:
        raise SolveError(f"the equilibrium is {eq.status.value}, and what a mesh finds depends on the mesh", status=eq.status)
    if (scene.borders and not scene.bodies) or not eq.zones("mechanical").borders:
        return eq
    state = State(eq.state, eq.pressure, eq.potential.evaluate(eq.state, eq.pressure), eq.iterations, 0.0, eq.residual, 0.0)
    scene, state = put_on_borders(scene.replace(follow_borders=True), state, holding(held))
    bad = ill_posed(state.evaluation.potential, state.evaluation)
    status = Status.CONVERGED if bad is None else bad.status
    own = state.evaluation
    return recorded(scene, own.potential, own.x, state.pressure, own, status, state.residual, state.iterations, eq.gas)
