"""The same equilibrium on the mesh of another one, of a branch along which the mesh changes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import Status
from ..potential import Potential, potential_of
from ..solve.branch import first_point
from ..solve.finer_space import met_across
from ..solve.state import State
from .equilibrium import Equilibrium, recorded

if TYPE_CHECKING:
    from ..scene import Scene


def state_of(equilibrium: Equilibrium) -> State:
    """The solver's state of a record.

    Parameters
    ----------
    equilibrium : Equilibrium
    """
    evaluation = equilibrium.potential.evaluate(equilibrium.state, equilibrium.pressure)
    return State(equilibrium.state, equilibrium.pressure, evaluation, 0, 0.0, 0.0, 0.0)


def found_on(scene: Scene, potential: Potential, state: State) -> Equilibrium | None:
    """The record of a state on another mesh, where its branch meets the plane across it; None where it does not.

    Parameters
    ----------
    scene : Scene
        With the other mesh.
    potential, state : Potential, State
    """
    onto = potential_of(scene)
    found = met_across(onto, potential, first_point(potential, state, 1))
    if found.status is not Status.CONVERGED:
        return None
    return recorded(scene, onto, found.x, found.pressure, found.evaluation, Status.CONVERGED)


def on_mesh_of(equilibrium: Equilibrium, other: Equilibrium) -> Equilibrium | None:
    """An equilibrium of a branch on the mesh of another one; None where it is not found there.

    Parameters
    ----------
    equilibrium, other : Equilibrium
    """
    if equilibrium.state.size == other.state.size and equilibrium.potential is other.potential:
        return equilibrium
    return found_on(other.scene, equilibrium.potential, state_of(equilibrium))
