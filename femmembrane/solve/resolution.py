"""Whether the mesh resolves a state, or makes it.

Equations of a mesh can be solved to round-off by a shape that no membrane has: a needle at the pole, as wide as the elements there, or a
layer at the rim. Such a state is told by what happens to it on finer meshes. The meridian of a membrane is smooth where elements meet, and
at a pole it is level; the kinks that a mesh leaves there are errors of its slopes. They are small on ordinary meshes, and looking at them
costs next to nothing. Where one is large the state is looked for on meshes that are finer and finer. One that is an approximation of
something loses its kinks there, or at least keeps its stretches (the tip below a dipole takes many halvings to become round). A needle is
not found again, or grows.
"""

from __future__ import annotations

import numpy as np

from ..errors import SolveError, Status
from ..potential import Array, Potential, potential_of
from ..scene import MAX_DEGREE, Scene
from .continuation import first_point
from .finer import met_across
from .state import State
from .wellposed import ill_posed, unresolved_source

#: relative kink that is looked into; straight elements have one of the angle between them
_KINK, _KINK_STRAIGHT = 0.1, 0.4
#: relative kink at which a finer mesh is good enough to believe the state
_SMOOTH = 0.2
#: change of the largest logarithmic stretch from mesh to mesh at which the state is the same one
_STEADY = 0.1
#: most halvings, and elements beyond which none is halved
_HALVINGS, _MOST_ELEMENTS = 3, 4096


def unresolved(potential: Potential, state: State, scene: Scene | None = None) -> str:
    """Why a state is one of its mesh only, in words; empty where nothing speaks against it.

    Parameters
    ----------
    potential, state : Potential, State
    scene : Scene, optional
        The scene of the state, where it is not that of the potential.
    """
    scene = potential.scene if scene is None else scene
    kinks = potential.space.kinks(state.x)
    worst = float(kinks.max(initial=0.0))
    if worst <= (_KINK_STRAIGHT if scene.degree == 1 else _KINK):
        return ""
    # states with a verdict of their own: compressed or slack, or too close to a source
    if ill_posed(potential, state.evaluation) is not None or unresolved_source(potential, state.x):
        return ""
    reason = _lost_on_finer_meshes(potential if scene is potential.scene else potential_of(scene), state, worst)
    if not reason:
        return ""
    radius = float(potential.space.kink_radii[int(kinks.argmax())])
    return f"the mesh does not resolve the membrane at r = {radius:.3g}, where its slope jumps by {worst:.0%}: {reason}"


def refuse_unresolved(potential: Potential, state: State, scene: Scene | None = None) -> None:
    """Raise SolveError with status NOT_RESOLVED for a state of its mesh only."""
    if reason := unresolved(potential, state, scene):
        raise SolveError(f"{reason} (V = {state.volume:.6g}, P = {state.pressure:.6g})", status=Status.NOT_RESOLVED)


def _lost_on_finer_meshes(potential: Potential, state: State, kink: float) -> str:
    """What becomes of the state as elements are halved; empty where it is found again."""
    first, largest, reason = kink, _largest_stretch(potential, state.x), ""
    for halving in range(_HALVINGS):
        scene = potential.scene
        if halving and 2 * scene.mesh.elements > _MOST_ELEMENTS:
            break
        degree = min(scene.degree + (halving == 0), MAX_DEGREE)
        onto = potential_of(scene.replace(mesh=scene.mesh.refined(), degree=degree))
        met = met_across(onto, potential, first_point(potential, state, 1))
        if met.status is not Status.CONVERGED:
            return f"on {onto.space.n_elements} elements of degree {degree} no such state was found"
        potential, state, before = onto, State.of(met), largest
        kink, largest = float(onto.space.kinks(met.x).max(initial=0.0)), _largest_stretch(onto, met.x)
        if kink <= _SMOOTH or abs(largest - before) <= _STEADY:
            return ""
        reason = (
            f"on {onto.space.n_elements} elements of degree {degree} the largest stretch is {np.exp(largest - before):.2g} times as large, "
            f"and the slope jumps by {kink:.0%}"
        )
    return reason if kink > first / 2 else ""


def _largest_stretch(potential: Potential, x: Array) -> float:
    """Logarithm of the largest principal stretch at the quadrature points."""
    space = potential.space
    u, u_x, _, w_x = space.at_quadrature(x).reshape(4, *space.R.shape)
    along = np.hypot(space.R_x + u_x, space.Z_x + w_x) / np.hypot(space.R_x, space.Z_x)
    return float(np.log(max(along.max(), (1 + u / space.R).max())))
