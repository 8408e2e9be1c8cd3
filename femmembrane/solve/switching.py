"""From one branch to another at the point where they cross.

At a simple crossing the matrix of the equations F(x, P) = E' - P V' = 0, [K, -V'], has two null vectors. One is (phi, 0) with K phi = 0 and
V' . phi = 0; let g be the one across it. A combination alpha g + beta (phi, 0) is the direction of a branch if it solves Keller's algebraic
bifurcation equation, with the exact second derivatives of F::

    a alpha^2 + 2 b alpha beta + c beta^2 = 0,        a = phi . F''[g, g],    b = phi . F''[g, phi],    c = phi . F''[phi, phi]

Its two solutions are the tangents of the two branches. The points of the known branch on both sides tell which tangent is its own. Where c
vanishes, as a symmetry demands, one of the branches runs along phi itself, with stationary pressure and volume: a pitchfork. Else the
crossing is transcritical.

The first state off the known branch is looked for at a prescribed distance across it. No state of the known branch is there, so that
Newton's method cannot fall back to it.

Source: H. B. Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, 1977.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..discretization.space import HESSIAN_PAIRS
from ..errors import SolveError, Status
from ..potential import Array, Evaluation, Potential
from .banded import BorderedFactor, band_inner, band_product
from .branch import BranchProblem, corrected, tangent_at, unit_point
from .continuation import BranchPoint, Tracer, trace_points
from .newton import TOLERANCE
from .state import Predictor, State, displacement, distance, joined

#: a cubic coefficient this small beside the terms that cancel in it vanishes by symmetry
SYMMETRIC = 1e-4
#: difference of the states for derivatives, relative to the size of the membrane: the cube root of round-off
_DIFFERENCE = 6e-6
#: inverse iterations for the softest displacement: at a crossing the first one finds it
_ITERATIONS = 6
#: how often the first step off the known branch is halved
_HALVINGS = 12
#: a rate of the volume this small beside the terms that cancel in it counts as zero
_STATIONARY = 1e-5
#: two located crossings closer than this, relative to the size of the displacement, are one
SAME_CROSSING = 1e-3


@dataclass(frozen=True)
class Crossing:
    """A point at which two branches cross.

    Attributes
    ----------
    known : BranchPoint
        The point with the tangent of the branch on which it was found.
    across : BranchPoint
        The same point with the vector across that branch, w.
    other : BranchPoint
        The same point with the tangent of the other branch.
    pitchfork : bool
        Whether one of the branches has stationary volume and pressure there, by a symmetry; else the crossing is transcritical.
    """

    known: BranchPoint
    across: BranchPoint
    other: BranchPoint
    pitchfork: bool

    def half(self, direction: int) -> BranchPoint:
        """The start of one half of the other branch."""
        return _oriented(self.other, direction)

    def side(self, potential: Potential, point: BranchPoint) -> int:
        """Which half of the other branch a nearby point lies on; 0 for one that is nearer to the known branch."""
        away = point.z - self.known.z
        own, other = float(self.across.dual @ away), float(self.across.dual @ self.other.tangent)
        return 0 if abs(own) < 0.5 * abs(other) * BranchProblem(potential).norm(away) else int(math.copysign(1, own * other))


def crossing_at(potential: Potential, known: BranchPoint) -> Crossing:
    """The branches at a located branch point of a known branch.

    Raises
    ------
    SolveError
        When the second derivatives do not single out another branch: more than two cross, or the two touch.
    """
    state = known.state
    null = unit_point(potential, state, known.sigma, joined(softest(potential, state)[0], 0.0))
    rest = _across_null(potential, null)
    (a, size_a), (b, size_b), (c, size_c) = (_second(potential, null, *pair) for pair in ((rest, rest), (rest, null), (null, null)))
    pitchfork = abs(c) <= SYMMETRIC * size_c
    c = 0.0 if pitchfork else c
    square = b * b - a * c
    if not square > SYMMETRIC**2 * (size_b * size_b + size_a * size_c):
        raise SolveError("the branches that meet there could not be told apart", status=Status.NOT_CONVERGED)
    larger = -(b + math.copysign(math.sqrt(square), b))  # the root without cancellation; the second root follows from their product
    tangents = [_combined(rest, null, alpha, beta) for alpha, beta in ((c, larger), (larger, a))]
    cosines = [float(tangent.dual @ known.tangent) for tangent in tangents]
    mine = int(abs(cosines[1]) > abs(cosines[0]))
    own, other = _oriented(tangents[mine], cosines[mine]), tangents[1 - mine]
    cosine = float(own.dual @ other.tangent)
    return Crossing(own, _combined(other, own, 1.0, -cosine), _oriented(other, _upwards(potential, other)), pitchfork)


def leave(potential: Potential, crossing: Crossing, direction: int, step: float) -> BranchPoint:
    """The first point of a half of the other branch, at most a step away, with its tangent.

    Raises
    ------
    SolveError
        When no step leads to a state off the known branch.
    """
    start, border = crossing.half(direction), crossing.across
    for _ in range(_HALVINGS):
        guess = start.z + step * start.tangent
        result = corrected(potential, guess, border.dual)
        if result.status is Status.CONVERGED:
            z = joined(result.x, result.pressure)
            if BranchProblem(potential).norm(z - guess) <= 0.5 * step and not _on_known(potential, crossing, z):
                new = tangent_at(potential, State.of(result), start)
                new.sigma = start.sigma + step
                return new
        step /= 2
    at = start.state
    message = f"no step off the known branch converges at the branch point V = {at.volume:.9g}, P = {at.pressure:.9g}"
    raise SolveError(message, status=Status.STEP_UNDERFLOW)


def points_beyond(potential: Potential, crossing: Crossing, direction: int, tracer: Tracer) -> Iterator[BranchPoint]:
    """Points of a half of the other branch, one a step, for as long as the caller asks.

    Raises
    ------
    SolveError
        When the half cannot be entered, or no step of the smallest length converges.
    """
    start = crossing.half(direction)
    new = leave(potential, crossing, direction, tracer.step)
    tracer.path = Predictor()
    for point in (start, new):
        tracer.path.append(point.sigma, point.z, point.tangent)
    tracer.known = new.state.correction
    yield new
    yield from trace_points(BranchProblem(potential), new, tracer)


def same_crossing(potential: Potential, a: Array, b: Array) -> bool:
    """Whether two located branch points, by their displacements, are one."""
    return distance(potential, a, b) <= SAME_CROSSING * displacement(potential, a)


def softest(potential: Potential, state: State) -> tuple[Array, float]:
    """The softest displacement at constant volume, and its signed stiffness over the size of the next stiffness.

    At a branch point it is phi, with K phi = 0 and V' . phi = 0, and the stiffness 0. Inverse iteration on two vectors.

    Raises
    ------
    SolveError
        Where the membrane has no stiffness at all.
    """
    border, kd, mass = state.evaluation.volume_gradient, potential.space.half_bandwidth, potential.mass
    pair = list(np.random.default_rng(0).standard_normal((2, state.x.size)))
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # nothing resists in the flat membrane at rest
        bordered = BorderedFactor(state.factor, border, border, 0.0)
        for _ in range(_ITERATIONS):
            pair = [bordered.solve(band_product(mass, kd, v), 0.0)[0] for v in pair]
            pair[0] = pair[0] / np.sqrt(band_inner(mass, kd, pair[0], pair[0]))
            pair[1] = pair[1] - band_inner(mass, kd, pair[0], pair[1]) * pair[0]
            pair[1] = pair[1] / np.sqrt(band_inner(mass, kd, pair[1], pair[1]))
        projected = np.array([[state.evaluation.inner(u, v) for v in pair] for u in pair])
    if not np.isfinite(projected).all():
        raise SolveError("no displacement is the softest one there", status=Status.NOT_CONVERGED)
    stiffness, combinations = np.linalg.eigh(projected)
    first = int(np.argmin(np.abs(stiffness)))
    phi = combinations[0, first] * pair[0] + combinations[1, first] * pair[1]
    return phi / np.abs(phi).max(), float(stiffness[first] / (np.abs(stiffness).max() or 1.0))


def _across_null(potential: Potential, null: BranchPoint) -> BranchPoint:
    """The other null vector, with a rate of the pressure: K x = V' P', made regular by a border across phi."""
    border = null.dual[:-1]
    x, _ = BorderedFactor(null.state.factor, border, border, 0.0).solve(null.state.evaluation.volume_gradient, 0.0)
    return unit_point(potential, null.state, null.sigma, joined(x, 1.0))


def _combined(u: BranchPoint, v: BranchPoint, alpha: float, beta: float) -> BranchPoint:
    """The unit vector along alpha u + beta v, both of one point."""
    return unit_point(u.state.evaluation.potential, u.state, u.sigma, alpha * u.tangent + beta * v.tangent)


def _oriented(point: BranchPoint, sign: float) -> BranchPoint:
    """A point with its tangent, or the opposite one where the sign is negative."""
    s = -1.0 if sign < 0 else 1.0
    return replace(point, tangent=s * point.tangent, dual=s * point.dual)


def _second(potential: Potential, left: BranchPoint, u: BranchPoint, v: BranchPoint) -> tuple[float, float]:
    """phi . F''[u, v], with phi the tangent of ``left``, and the sum of the absolute contributions of the points of the membrane.

    By the central difference along u of the exact derivative F'[v] = K v - V' v_P.
    """
    space, state = potential.space, left.state
    (ux, up), (vx, vp) = ((p.tangent[:-1], float(p.tangent[-1])) for p in (u, v))
    u_size, size = float(np.abs(ux).max()), float(max(np.ptp(space.Z), np.ptp(space.R), np.abs(state.x).max()))
    e = _DIFFERENCE * size / u_size
    phi, direction = (space.at_quadrature(y).reshape(4, -1) for y in (left.tangent[:-1], vx))
    forward, backward = (_first(potential.evaluate(state.x + k * ux, state.pressure + k * up), phi, direction, vp) for k in (e, -e))
    terms = (forward - backward) / (2 * e)
    springs = (
        [potential.evaluate(state.x + k * ux, state.pressure + k * up).spring for k in (e, -e)]
        if state.evaluation.spring is not None
        else []
    )
    coupled = [float(spring @ left.tangent[:-1]) * float(spring @ vx) for spring in springs if spring is not None]
    more = (coupled[0] - coupled[1]) / (2 * e) if coupled else 0.0
    return float(terms.sum()) + more, float(np.abs(terms).sum()) + abs(more)


def _first(evaluation: Evaluation, phi: Array, v: Array, v_pressure: float) -> Array:
    """phi . (K v - V' v_P) at each quadrature point, from the local variables of phi and v."""
    stiffness = evaluation.stiffness_density.reshape(len(HESSIAN_PAIRS), -1)
    total = -v_pressure * (phi * evaluation.force_density.reshape(8, -1)[4:]).sum(axis=0)
    for density, (i, j) in zip(stiffness, HESSIAN_PAIRS, strict=True):
        total = total + density * (phi[i] * v[j] + (phi[j] * v[i] if i != j else 0.0))
    return total


def _upwards(potential: Potential, point: BranchPoint) -> float:
    """What grows on the first half of a branch: the volume; if it is stationary, the height of the pole; if the pole is held, the height of
    the membrane.
    """
    border, space, along = point.state.evaluation.volume_gradient, potential.space, point.tangent[:-1]
    rate = border @ along
    if abs(rate) > _STATIONARY * (np.abs(border) @ np.abs(along)):
        return float(rate)
    largest = np.abs(along).max()
    lift = point.rate("center_height")
    if abs(lift) > _STATIONARY * largest:
        return lift
    across = space.fields[1]
    mean = float(point.dual[across].sum())
    if abs(mean) > _STATIONARY * float(np.abs(point.dual[across]).sum()):
        return mean
    return float(along[np.argmax(np.abs(along))])


def _on_known(potential: Potential, crossing: Crossing, z: Array) -> bool:
    """Whether a state near the crossing is the state of the known branch at the same distance."""
    known = crossing.known
    here, x = known.state.x, z[:-1]
    share = float(known.dual @ (z - known.z))
    result = corrected(potential, known.z + share * known.tangent, known.dual, math.sqrt(TOLERANCE))
    return result.status is Status.CONVERGED and distance(potential, result.x, x) < 0.25 * distance(potential, x, here)
