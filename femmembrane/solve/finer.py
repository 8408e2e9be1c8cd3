"""The same equilibrium in another finite-element space of its scene: carried over by interpolation and solved again.

How far an answer moves when the space grows says how far it is from that of the continuum.
"""

from __future__ import annotations

import numpy as np

from ..discretization.space import Space
from ..errors import Status
from ..potential import Array, Potential, potential_of
from ..scene import MAX_DEGREE, Scene
from .banded import band_product
from .continuation import BranchPoint, first_point
from .controls import ArcLengthControl, Control
from .newton import NewtonResult, correct
from .state import State, distance

#: most iterations of a damped solve: ordinary ones take one to three
_MAX_ITERATIONS = 30


def finer_scene(scene: Scene) -> Scene:
    """The scene on elements of one degree more, or of half the size where there is no higher degree."""
    return scene.replace(degree=scene.degree + 1) if scene.degree < MAX_DEGREE else scene.replace(mesh=scene.mesh.refined())


def transferred(space: Space, x: Array, onto: Space) -> Array:
    """Free coefficients in another space of the interpolant of the displacement with free coefficients x."""
    points = onto.interpolation_points()
    u, _, w, _ = space.evaluate(x, points.ravel())
    return onto.interpolate(u.reshape(points.shape), w.reshape(points.shape))


def solved_in(onto: Potential, control: Control, potential: Potential, x: Array, pressure: float, *, damped: bool = False) -> NewtonResult:
    """The equilibrium of another potential under a control, by Newton's method from a state carried over."""
    start = transferred(potential.space, x, onto.space)
    if damped:
        return correct(onto, control, start, pressure, damped=True, max_iterations=_MAX_ITERATIONS)
    return correct(onto, control, start, pressure)


def solved_finer(control: Control, potential: Potential, x: Array, pressure: float) -> tuple[Potential, NewtonResult]:
    """The equilibrium in the space of :func:`finer_scene` with its potential."""
    finer = potential_of(finer_scene(potential.scene))
    return finer, solved_in(finer, control, potential, x, pressure)


def met_across(onto: Potential, potential: Potential, point: BranchPoint) -> NewtonResult:
    """Where the branch of another space crosses the plane through a point of a branch, across its tangent: regular at every fold."""
    state = point.state
    start, tangent = (transferred(potential.space, y, onto.space) for y in (state.x, point.tangent))
    dual = band_product(onto.mass, onto.space.half_bandwidth, tangent) / onto.area
    across = ArcLengthControl(dual, point.tangent_pressure, start, state.pressure)
    return correct(onto, across, start, state.pressure, damped=True, max_iterations=_MAX_ITERATIONS)


def solved_past_folds(onto: Potential, control: Control, potential: Potential, state: State) -> NewtonResult:
    """As :func:`solved_in`, for a state next to a fold of the control.

    The branch of the other space is met first where it crosses the plane through the state across its tangent, which is regular at folds
    of every quantity, and then followed to the control.
    """
    met = met_across(onto, potential, first_point(potential, state, 1))
    if met.status is not Status.CONVERGED:
        return met
    return correct(onto, control, met.x, met.pressure, damped=True, max_iterations=_MAX_ITERATIONS)


def moved(onto: Potential, x: Array, before: Array) -> float:
    """Change of a state of a space relative to its size: root mean squares over the reference area."""
    size, change = distance(onto, x, np.zeros_like(x)), distance(onto, x, before)
    return change / size if size else 0.0
