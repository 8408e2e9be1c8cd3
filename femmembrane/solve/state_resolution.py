"""Whether the mesh resolves a state, or makes it.

Equations of a mesh can be solved to round-off by a shape that no membrane has: a needle at the pole, as wide as the elements there, or a
layer at the rim. Such a state is told by what happens to it on finer meshes. The meridian of a membrane is smooth where elements meet, and
at a pole it is level; the kinks that a mesh leaves there are errors of its slopes. They are small on ordinary meshes, and looking at them
costs next to nothing. Where one is large the state is looked for on meshes that are finer and finer. One that is an approximation of
something loses its kinks there, or at least keeps its stretches (the tip below a dipole takes many halvings to become round). A needle is
not found again, or grows. The cone at the pole of a sheet that is magnetised along its meridians is real, and no kink in this sense. A
stress that a mesh leaves at an edge which is free to move in its plane is an error of the same kind.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from ..discretization.space import transferred
from ..errors import SolveError, Status
from ..physics.kinematics import hencky_strains
from ..potential import Array, Evaluation, Potential, potential_of
from ..scene import MAX_DEGREE, Scene
from .banded import negative_among
from .branch import first_point
from .contact import coarse_at_edge
from .controls import VolumeControl
from .finer_space import counterpart, met_across, moved, solved_in
from .state import State
from .stepping import march
from .wellposed import apparent, ill_posed, poles_by_sources

#: relative kink that is looked into; straight elements have one of the angle between them
_KINK, _KINK_STRAIGHT = 0.1, 0.4
#: relative kink at which a finer mesh is good enough to believe the state
_SMOOTH = 0.2
#: change of the largest logarithmic stretch from mesh to mesh at which the state is the same one
_STEADY = 0.1
#: meridional stress beside a kink, over the median one of the membrane, below which it is the stress that fails and not the mesh
_WEAK = 0.1
#: change of the membrane, relative to its size, up to which a state is the same one: for a state at the same volume (few elements let all
#: of a thin pole be wrong), and for a state at about this volume
_NEAR, _CLOSE = 1.0, 0.05
#: relative change of the pressure in a finer space that a layer of compression may make which is the mesh's alone
_LAYER = 0.02
#: radial stress at an edge that is free to move in its plane, relative to the largest stress, that is looked into
_PULL = 0.2
#: logarithm of stretches that leave no digits to the finest meshes
_NO_DIGITS = np.log(1e5)
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
    space = potential.space
    if reason := _compressed_on_this_mesh(potential, state):
        return reason
    if reason := _pulled_at_an_edge(potential, state, scene):
        return reason
    kinks = _kinks(potential, state.x)
    worst = float(np.maximum.reduce(kinks, initial=0.0))
    if worst <= (_KINK_STRAIGHT if scene.degree == 1 else _KINK) or not space.n_elements > 1:  # one element is no mesh to judge
        return ""
    where = int(kinks.argmax())
    if _judged_otherwise(potential, state, where):
        return ""
    reason = _lost_on_finer_meshes(potential if scene is potential.scene else potential_of(scene), state, where)
    if not reason:
        return ""
    radius = float(space.kink_radii[where])
    reason = coarse_at_edge(state.evaluation) or reason
    return f"the mesh does not resolve the membrane at r = {radius:.3g}, where its slope jumps by {worst:.0%}: {reason}"


def _compressed_on_this_mesh(potential: Potential, state: State) -> str:
    """Why a state is not resolved that is compressed on this mesh alone, in a layer that changes its pressure; empty for others."""
    bad = apparent(potential, state.evaluation)
    if bad is None or ill_posed(potential, state.evaluation) is not None:
        return ""
    found = counterpart(potential, state.evaluation, state.pressure)
    if found is None:
        return ""
    change = abs(found.pressure - state.pressure)
    if change <= _LAYER * max(abs(found.pressure), abs(state.pressure)):
        return ""
    on = found.evaluation.potential.space
    return (
        f"the mesh does not resolve the membrane at {bad.where}, where its stress is compressive on this mesh alone: P is "
        f"{found.pressure:.6g} on {on.n_elements} elements of degree {on.degree}"
    )


def _pulled_at_an_edge(potential: Potential, state: State, scene: Scene) -> str:
    """Why a state is not resolved whose edge is pulled where nothing pulls, and that a finer mesh does not find; empty for others."""
    left = _pull_at_edges(potential, state)
    if not left or max(left.values()) <= _PULL:
        return ""
    coarse = potential if scene is potential.scene else potential_of(scene)
    finer = scene.replace(mesh=scene.mesh.refined())
    degrees = [scene.degree] if scene.degree == MAX_DEGREE else [scene.degree + 1, scene.degree]
    if any(_found_again(potential_of(finer.replace(degree=degree)), coarse, state) is not None for degree in degrees):
        return ""
    radius, share = max(left.items(), key=lambda item: item[1])
    return (
        f"the mesh does not resolve the membrane at r = {radius:.3g}, where it leaves {share:.0%} of the largest stress at an edge that "
        f"nothing pulls: no such state was found on {finer.mesh.elements} elements"
    )


def _pull_at_edges(potential: Potential, state: State) -> dict[float, float]:
    """Radial part of the meridional stress at ends that nothing holds in their plane, over the largest stress: zero for a membrane.

    Where the stress hardly varies in the element of an end, nothing is computed for it: a pull that the mesh makes is a spike in there.
    """
    space = potential.space
    left: dict[float, float] = {}
    if potential.sources:
        return left
    loose = [k for k, end in enumerate(space.supports) if not (space.on_axis[k] or "u" in end.held)]
    if not loose:
        return left
    stress = state.evaluation.stress.reshape(2, *space.R.shape)
    scale = float(max(stress.max(), -stress.min()))
    for k in loose:
        beside = stress[:, :, -k]
        if not max(beside.max(axis=1) - beside.min(axis=1)) > _PULL * scale:
            continue
        end = space.ends[[-k]]
        (R, Z), (R_s, Z_s) = space.mesh.position(end), space.mesh.tangent(end)
        u, u_s, _, w_s = space.displacement(state.x, end)
        response = potential.response_at(state.x, R, Z, end, state.evaluation.factor)
        pull, _ = response.stress(*hencky_strains(R, R_s, Z_s, u, u_s, w_s))
        level = float((np.abs(R_s + u_s) / np.hypot(R_s + u_s, Z_s + w_s))[0])
        left[float(R[0])] = abs(float(pull[0])) * level / scale
    return left


def refuse_unresolved(potential: Potential, state: State, scene: Scene | None = None) -> None:
    """Raise SolveError with status NOT_RESOLVED for a state of its mesh only."""
    if reason := unresolved(potential, state, scene):
        raise SolveError(f"{reason} (V = {state.volume:.6g}, P = {state.pressure:.6g})", status=Status.NOT_RESOLVED)


def _judged_otherwise(potential: Potential, state: State, where: int) -> bool:
    """Whether a kink belongs to a state with a verdict of its own: compressed or slack, or almost so there, or too close to a source."""
    space, stress = potential.space, state.evaluation.stress
    inner = space.n_elements - 1
    beside = [where, where + 1] if where < inner else [0 if where == inner and space.on_axis[0] else inner]
    weakest = stress[0].reshape(space.R.shape)[:, beside].min()
    if weakest < _WEAK * np.median(np.abs(stress)) or ill_posed(potential, state.evaluation) is not None:
        return True
    return any(near < length for near, length in poles_by_sources(potential, state.x))


def _lost_on_finer_meshes(potential: Potential, state: State, where: int) -> str:
    """What becomes of the state as elements are halved; empty where it is found again and loses its kinks."""
    first = largest_kink(potential, state.x)
    # the tip that a source draws out becomes round on very small elements alone, but its stretches are right long before; the stretches of
    # a layer at a rim are right early as well, and it is as thin as the membrane makes it
    tip = bool(potential.sources) or where < potential.space.n_elements - 1
    kink, largest = first, _largest_stretch(potential, state.x)
    for halving in range(_HALVINGS):
        scene, before = potential.scene, largest
        if halving and 2 * scene.mesh.elements > _MOST_ELEMENTS:
            break
        finer = scene.replace(mesh=scene.mesh.refined())
        degrees = [scene.degree] if halving or scene.degree == MAX_DEGREE else [scene.degree + 1, scene.degree]
        for onto in (potential_of(finer.replace(degree=degree)) for degree in degrees):
            if (met := _found_again(onto, potential, state)) is not None:
                break
        else:
            fading = halving > 0 and kink <= first / 2 and largest > _NO_DIGITS
            return "" if fading else f"no such state was found on {onto.space.n_elements} elements"
        potential, state = onto, met
        kink, largest = largest_kink(potential, state.x), _largest_stretch(potential, state.x)
        if kink <= min(_SMOOTH, first / 2) or (tip and kink <= 1.01 * first and abs(largest - before) <= _STEADY):
            return ""
    change = f"the largest stretch is {np.exp(largest - before):.2g} times as large as on half as many, and the slope jumps by {kink:.0%}"
    return f"on {potential.space.n_elements} elements {change}"


def largest_kink(potential: Potential, x: Array) -> float:
    """The largest of :meth:`.Space.kinks`."""
    return float(_kinks(potential, x).max(initial=0.0))


def _kinks(potential: Potential, x: Array) -> Array:
    """:meth:`.Space.kinks`, without those at poles of a sheet magnetised along its meridians: its cone is that of the membrane."""
    kinks = potential.elements.kinks(potential.space, x)
    if potential.magnetisation is not None and potential.magnetisation.meridional:
        kinks[potential.space.n_elements - 1 :] = 0.0
    return kinks


def _found_again(onto: Potential, potential: Potential, state: State) -> State | None:
    """The state in a finer space: at the same volume and on the same side of its folds, or near it across the branch."""
    start = transferred(potential.space, state.x, onto.space)

    def near(found: State, most: float) -> bool:
        return moved(onto, found.x, start) <= most

    result = solved_in(onto, VolumeControl(state.volume), potential, state.x, state.pressure, damped=True)
    converged = result.status is Status.CONVERGED
    if converged and _side(onto, result.evaluation) == _side(potential, state.evaluation) and near(found := State.of(result), _NEAR):
        return found
    result = met_across(onto, potential, first_point(potential, state, 1))
    if result.status is not Status.CONVERGED:
        return None
    if near(found := State.of(result), _CLOSE):
        return found
    with suppress(SolveError):  # where the pole is thin the plane across the branch is met far off
        found = march(onto, found, VolumeControl, found.volume, state.volume)[-1]
    return found if near(found, _NEAR) else None


def _side(potential: Potential, evaluation: Evaluation) -> int:
    """Number of negative directions at constant volume: changes at every fold in the volume."""
    return negative_among(evaluation, evaluation.volume_gradient)


def _largest_stretch(potential: Potential, x: Array) -> float:
    """Logarithm of the largest principal stretch at the quadrature points."""
    space = potential.space
    u, u_x, _, w_x = space.displacement_at_quadrature(x)
    along = np.hypot(space.R_x + u_x, space.Z_x + w_x) / np.hypot(space.R_x, space.Z_x)
    return float(np.log(max(along.max(), (1 + u / space.R).max())))
