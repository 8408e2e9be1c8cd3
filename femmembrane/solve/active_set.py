"""Which nodes rigid bodies hold, and where contact begins and ends.

On a set of held nodes equilibrium is a smooth problem, solved as any other. The next set follows from its solution
(:meth:`.ContactPotential.judged`): a node that has come into a body is held, one that the body would have to pull is let go. This is a
semismooth Newton method, which ends after a few sets. Where sets would repeat, one node at a time changes, the worst one first.

The border of contact then lies between two nodes. The curvature of the membrane jumps there, so that a mesh with the border inside an
element has no more than second order. So the nearest end of an element is moved to the border. A border is in its place where the membrane
leaves the body along the tangent: the forces of the element beyond it have no part along the normal. That is one scalar equation for each
border, solved by Broyden's method. Its forces converge at twice the order of the elements, as those of a support do.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from ..errors import Status
from ..potential import Array, Potential
from .controls import ArcLengthControl, CarriedArcLength, Control

if TYPE_CHECKING:
    from ..potential.contact import ContactEvaluation, ContactPotential
    from ..potential.following import FollowingPotential, Mask
    from .continuation import BranchPoint
    from .newton import NewtonResult
    from .segment import Located, Segment

#: sets of held nodes that are tried
MOST_SETS = 60
#: times that borders are moved
_MOST_MOVES = 25
#: distance of a border from its place, over the size of an element, at which it has arrived
_ARRIVED = 1e-9
#: force across a border, over the largest that meet at a node, that is round-off
_BALANCED = 1e-13
#: least share of an element that a border leaves of it
_LEAST = 0.1
#: elements in a zone of contact from which on its borders are followed
_FEWEST = 2
#: times that borders are given to other ends of elements, and that zones of a few nodes change; elements beside a followed zone that
#: belong to it
_MOST_PASSES, _NEXT = 8, 2
#: how far beyond the middle between two ends a border may be, over the size of an element, before the other one follows it
_BEYOND = 0.02
#: relative difference of curvatures that are the same
_SAME_CURVATURE = 1e-6
#: forces that pull, over the largest, and gaps inside a body, over the size of the membrane, that a border in its place may leave
_PULL, _INSIDE = 1e-3, 1e-6


#: share of a segment on either side of a corner at which its smooth parts end
_BESIDE = 1e-6


class Once(Protocol):
    """A corrector on a smooth potential; ``damped`` for a guess that is not next to a solution."""

    def __call__(self, potential: Potential, *, control: Control, x: Array, pressure: float, damped: bool = ...) -> NewtonResult: ...


def settled(once: Once, control: Control, potential: Potential, x: Array, pressure: float, magnetic: float) -> NewtonResult:
    """Where a corrector ends with the nodes held that are held there, and with ends of elements at the borders of contact.

    Parameters
    ----------
    once : callable
        The corrector on a fixed set.
    control : Control
        Of coefficients on the mesh of the scene.
    potential : Potential
        With bodies.
    x, pressure : ndarray, float
        Guess.
    magnetic : float
        Factor on the magnetic energy.
    """
    given = cast("ContactPotential", potential)
    x = np.ascontiguousarray(x, dtype=float)
    root, x = given.root, given.carried(x)
    result = _on_mesh(once, control, root, x, pressure, magnetic)
    follow = result.status is Status.CONVERGED and root.scene.follow_borders is not False
    followed = _with_borders(once, control, root, result) if follow else None
    if followed is None:
        return result
    followed.x = followed.evaluation.carried(followed.x)
    return followed


def _on_mesh(once: Once, control: Control, root: ContactPotential, x: Array, pressure: float, magnetic: float) -> NewtonResult:
    """The equilibrium on the mesh of the scene."""
    with np.errstate(over="ignore", invalid="ignore"):
        held = root.pressed(x, pressure, magnetic)
    tried: set[bytes] = set()
    spent, closing_in = 0, _ClosingIn(root)
    while True:
        tried.add(held.tobytes())
        result = once(root.holding(held), control=control, x=x, pressure=pressure)
        spent += result.iterations
        result.iterations = spent
        if result.status is not Status.CONVERGED and len(tried) > 1:  # the solution on the set before need not be next to this one
            result = once(root.holding(held), control=control, x=x, pressure=pressure, damped=True)
            result.iterations = spent = spent + result.iterations
        if result.status is not Status.CONVERGED:
            smoother = [s for s in (_smoothed(root, held, True), _smoothed(root, held, False)) if s.tobytes() not in tried]
            if not smoother or len(tried) == MOST_SETS:
                return result
            held = smoother[0]
            continue
        evaluation = cast("ContactEvaluation", result.evaluation)
        following = root.judged(evaluation._raw, evaluation.gaps, result.pressure)
        if (following == held).all():
            return result
        if (further := closing_in.next(held, following)).tobytes() not in tried:
            following = further
        elif following.tobytes() in tried:
            following = _one_changed(evaluation, held, following)
        if len(tried) == MOST_SETS or following.tobytes() in tried:
            result.status = Status.NOT_CONVERGED
            return result
        x, pressure, held = result.x, result.pressure, following


class _ClosingIn:
    """How far borders of contact move from one set of held nodes to the next.

    A border that lies too far out pulls at its last node alone. Plain sets would let one node go after the other, as many as the mesh has
    there. So a border that lets go again lets go twice as many nodes as the time before. Where these were too many, the membrane comes into
    the body, and the border is looked for half-way between the places that were too far out and too far in. A set is an answer only if the
    next one is the same, however it was found.
    """

    def __init__(self, root: ContactPotential) -> None:
        self.root = root
        self.inner = self.outer = self.stride = np.zeros(0, dtype=np.int64)

    def next(self, held: Mask, following: Mask) -> Mask:
        """The next set, from a set and the plain one that follows from its solution."""
        plain = _smoothed(self.root, following, True)
        now, then = self._borders(held), self._borders(plain)
        far = 2 * held.size  # farther out than any border
        if now.size != then.size:
            self.inner = np.zeros(0, dtype=np.int64)
            return following
        if self.inner.size != now.size:
            self.inner, self.outer, self.stride = np.full(now.size, -far), np.full(now.size, far), np.zeros(now.size, dtype=np.int64)
        out, back = then > now, then < now
        # other borders have moved since: what was too far in or out need not be so any more
        self.inner = np.where(out, now, np.where(now <= self.inner, -far, self.inner))
        self.outer = np.where(back, now, np.where(now >= self.outer, far, self.outer))
        middle = (self.inner + self.outer) // 2
        closed = (self.inner > -far) & (self.outer < far)
        least = then - np.repeat((then[::2] + then[1::2] - 1) // 2, 2)  # half of a zone stays
        nearer = np.where(closed, np.minimum(then, middle), np.where(back, np.maximum(then - 2 * self.stride, least), then))
        new = np.where(out | back, nearer, now)
        self.stride = np.where(back, now - new, 0)
        found = np.zeros_like(held)
        for first, last in zip(-new[::2], new[1::2], strict=True):
            found[first:last] = True
        return found

    def _borders(self, nodes: Mask) -> NDArray[np.int64]:
        """Where zones begin, with a minus, and behind where they end: both grow outwards."""
        at = np.flatnonzero(nodes)
        breaks = np.flatnonzero((np.diff(at) > 1) | (np.diff(self.root.nodes[at]) > 1))
        first, last = at[np.append(0, breaks + 1)[: at.size]], at[np.append(breaks, at.size - 1)[: at.size]]
        return np.stack([-first, last + 1], axis=1).ravel()


def _smoothed(root: ContactPotential, held: Mask, fill: bool) -> Mask:
    """A set without holes shorter than an element, or without zones as short: a guess next to a border may have them from round-off."""
    new, at = held.copy(), np.flatnonzero(held == fill)
    for one, other in pairwise(at):
        if 1 < other - one <= root.space.degree and root.nodes[other] - root.nodes[one] == other - one:
            new[one + 1 : other] = fill
    return new


def _one_changed(evaluation: ContactEvaluation, held: Mask, following: Mask) -> Mask:
    """A set with one node changed: that which is deepest in a body, or else that which a body pulls most."""
    changed = np.flatnonzero(following != held)
    entering = changed[~held[changed]]
    worst = entering[evaluation.gaps.gap[entering].argmin()] if entering.size else changed[evaluation.forces[changed].argmin()]
    new = held.copy()
    new[worst] = not held[worst]
    return new


@dataclass(frozen=True)
class Border:
    """A place where contact begins or ends: the number of the end of elements that follows it, and whether contact is before or behind."""

    end: int
    before: bool


def _with_borders(once: Once, control: Control, root: ContactPotential, result: NewtonResult) -> NewtonResult | None:
    """The equilibrium with ends of elements at the borders of contact; None where there are none that ends could follow."""
    evaluation = cast("ContactEvaluation", result.evaluation)
    zones = [(zone, np.array(_estimates(root, evaluation, zone))) for zone in zones_of(root, evaluation.held)]
    zones = [(zone, places) for zone, places in zones if places.size and not _ends_at_seam(root, evaluation.held, zone)]
    zones = [(zone, places) for zone, places in zones if _smooth_about(root, evaluation, zone)]
    followed = [(zone, places) for zone, places in zones if _assigned(root, [zone], places) is not None]
    if not followed or _assigned(root, [z for z, _ in followed], np.concatenate([s for _, s in followed])) is None:
        return None
    own, places = [zone for zone, _ in followed], np.concatenate([s for _, s in followed])
    # other zones, of a node or two, stay as sets of nodes
    loose = evaluation.held & ~_within(root, own)
    spent, x, pressure = result.iterations, result.x, result.pressure
    tried: list[list[Border]] = []
    for _ in range(_MOST_PASSES):
        borders = _assigned(root, own, places)
        if borders is None:
            return None
        found = _moved(once, control, root, loose, own, borders, places, x, pressure)
        if found is None:
            return None
        result, places = found
        spent += result.iterations
        result.iterations = spent
        evaluation = cast("ContactEvaluation", result.evaluation)
        potential = cast("ContactPotential", evaluation.potential)
        following = potential.judged(evaluation._raw, evaluation.gaps, result.pressure) & ~_within(root, own, _NEXT * root.space.degree)
        again = _assigned(root, own, places)
        same = again is None or all(a == b or _between(root, a, b, s) for a, b, s in zip(again, borders, places, strict=True))
        # on a coarse mesh each of two ends may say that the border belongs to the other one
        if (same or again in tried) and (following == loose).all():
            return result if _in_place(evaluation) else None
        tried.append(borders)
        x, pressure, loose = evaluation.carried(result.x), result.pressure, following
    return None


def _within(root: ContactPotential, zones: list[tuple[int, int]], margin: int = 0) -> Mask:
    """The nodes in zones, and so many beside them."""
    found = np.zeros(root.nodes.size, dtype=bool)
    for first, last in zones:
        found |= (root.nodes >= first - margin) & (root.nodes <= last + margin)
    return found


def zones_of(root: ContactPotential, held: Mask) -> list[tuple[int, int]]:
    """First and last nodes along the meridian of each zone of contact."""
    at = root.nodes[held]
    if not at.size:
        return []
    breaks = np.flatnonzero(np.diff(at) > 1)
    return list(zip(at[np.append(0, breaks + 1)].tolist(), at[np.append(breaks, at.size - 1)].tolist(), strict=True))


def _sides(root: ContactPotential, zone: tuple[int, int]) -> list[bool]:
    """The borders of a zone: False for that at its beginning, True for that at its end; an end of the meridian is none."""
    known = set(root.nodes.tolist())
    return [side for side, beyond in ((False, zone[0] - 1), (True, zone[1] + 1)) if beyond in known]


def _ends_at_seam(root: ContactPotential, held: Mask, zone: tuple[int, int]) -> bool:
    """Whether contact ends at the seam of a closed meridian, where no end of an element follows it."""
    first, last = int(root.nodes[0]), int(root.nodes[-1])
    return root.space.closed and ((zone[0] == first and not held[-1]) or (zone[1] == last and not held[0]))


def _smooth_about(root: ContactPotential, evaluation: ContactEvaluation, zone: tuple[int, int]) -> bool:
    """Whether bodies have one curvature about each border of a zone. Where it jumps inside an element, as at the end of a rounded edge, the
    error of the mesh depends on where the ends are: a border that they follow would follow that error.
    """
    gaps, reach = evaluation.gaps, root.space.degree
    for side in _sides(root, zone):
        edge = zone[1] if side else zone[0]
        near = np.abs(root.nodes - edge) <= reach
        curvature = gaps.curvature[near] / (1 - gaps.gap[near] * gaps.curvature[near])  # that of the body itself
        size = float(np.abs(curvature).max())
        if float(np.ptp(curvature)) > _SAME_CURVATURE * size:
            return False
    return True


def _estimates(root: ContactPotential, evaluation: ContactEvaluation, zone: tuple[int, int]) -> list[float]:
    """Where the gap, which grows as a square beyond a border, would be zero."""
    place = {int(node): k for k, node in enumerate(root.nodes)}
    found = []
    for side in _sides(root, zone):
        edge, step = (zone[1], 1) if side else (zone[0], -1)
        s0, s1 = (root.parameters[place[edge + j * step]] for j in (0, 1))
        s = (s0 + s1) / 2
        if edge + 2 * step in place:
            one, two = (place[edge + j * step] for j in (1, 2))
            g1, g2 = (np.sqrt(max(float(evaluation.gaps.gap[k]), 0.0)) for k in (one, two))
            if g2 > g1:
                s2 = root.parameters[two]
                s = float(np.clip(s1 - (s2 - s1) * g1 / (g2 - g1), *sorted((s0 - 0.5 * (s1 - s0), s1))))
        found.append(float(s))
    return found


def _assigned(root: ContactPotential, zones: list[tuple[int, int]], places: Array) -> list[Border] | None:
    """The ends of elements that follow borders at places; None where one of them has no end of its own."""
    ends = root.space.ends
    borders: list[Border] = []
    k = 0
    for zone in zones:
        sides = _sides(root, zone)
        own = places[k : k + len(sides)]
        k += len(sides)
        if len(sides) == 2 and not own[0] < own[1]:
            return None
        numbers = [int(np.abs(ends - s).argmin()) for s in own]
        first = numbers[0] if sides[0] is False else 0
        last = numbers[-1] if sides[-1] else ends.size - 1
        if last - first < _FEWEST:  # the membrane about so small a zone is not resolved, wherever the ends are
            return None
        borders += [Border(number, side) for number, side in zip(numbers, sides, strict=True)]
    taken = [border.end for border in borders]
    if len(set(taken)) < len(taken) or not all(0 < number < ends.size - 1 and root.space.movable[number] for number in taken):
        return None
    moved = ends.copy()
    moved[taken] = places
    return borders if (np.diff(moved) >= _LEAST * np.diff(ends)).all() else None


def _between(root: ContactPotential, one: Border, other: Border, place: float) -> bool:
    """Whether a place is next to the middle between two ends, so that either may follow it."""
    ends = root.space.ends
    a, b = ends[one.end], ends[other.end]
    return bool(abs(abs(place - a) - abs(place - b)) <= 2 * _BEYOND * abs(a - b))


def _moved(
    once: Once,
    control: Control,
    root: ContactPotential,
    loose: Mask,
    zones: list[tuple[int, int]],
    borders: list[Border],
    places: Array,
    x: Array,
    pressure: float,
) -> tuple[NewtonResult, Array] | None:
    """The equilibrium with the borders in their places, and these; None where that was not found."""
    ends, degree = root.space.ends, root.space.degree
    sizes = np.array([min(ends[b.end] - ends[b.end - 1], ends[b.end + 1] - ends[b.end]) for b in borders])
    low = np.array([ends[b.end - 1] for b in borders]) + _LEAST * sizes
    high = np.array([ends[b.end + 1] for b in borders]) - _LEAST * sizes
    inside = _held_nodes(root, zones, borders, degree) | loose
    spent = 0

    def solved(at: Array) -> tuple[NewtonResult, Array] | None:
        nonlocal spent, x, pressure
        there = root.bordered(tuple((b.end, float(s)) for b, s in zip(borders, at, strict=True)))
        result = once(there.holding(inside), control=on_borders(control, there), x=there.from_root @ x, pressure=pressure)
        spent += result.iterations
        if result.status is not Status.CONVERGED:
            return None
        x, pressure = result.evaluation.carried(result.x), result.pressure
        return result, _across(cast("ContactEvaluation", result.evaluation), result.pressure, borders)

    places = np.clip(places, low, high)
    found = solved(places)
    if found is None:
        return None
    result, force = found
    step = np.where(places + 0.01 * sizes < high, 0.01, -0.01) * sizes
    jacobian: Array | None = None
    for _ in range(_MOST_MOVES):
        if (np.abs(force) <= _BALANCED).all():
            break
        if jacobian is not None:
            step = -np.linalg.solve(jacobian, force)
            step = np.clip(step, -0.5 * sizes, 0.5 * sizes)
        following = np.clip(places + step, low, high)
        step = following - places
        if (np.abs(step) <= _ARRIVED * sizes).all():
            break
        found = solved(following)
        if found is None:
            return None
        result, change, force = found[0], found[1] - force, found[1]
        places = following
        if jacobian is None:
            jacobian = np.diag(change / step)
        elif (step @ step) > 0:
            jacobian = jacobian + np.outer(change - jacobian @ step, step / sizes**2) / (step / sizes**2 @ step)
        if not np.isfinite(jacobian).all() or np.linalg.matrix_rank(jacobian) < len(places):
            return None
    else:
        return None
    result.iterations = spent
    return result, places


def _held_nodes(root: ContactPotential, zones: list[tuple[int, int]], borders: list[Border], degree: int) -> Mask:
    """The nodes that are held when ends of elements are at the borders of zones."""
    held = np.zeros(root.nodes.size, dtype=bool)
    left = list(borders)
    for first, last in zones:
        for side in _sides(root, (first, last)):
            border = left.pop(0)
            first, last = (first, border.end * degree) if side else (border.end * degree, last)
        held |= (root.nodes >= first) & (root.nodes <= last)
    return held


def _across(evaluation: ContactEvaluation, pressure: float, borders: list[Border]) -> Array:
    """Forces along the normal of the elements beyond the borders, over the largest forces that meet at a node."""
    potential, space = cast("ContactPotential", evaluation.potential), evaluation.potential.space
    scales = evaluation.force_scale(pressure)
    found = []
    for border in borders:
        node = int(np.flatnonzero(potential.nodes == border.end * space.degree)[0])
        n_rho, n_eta = evaluation.gaps.n_rho[node], evaluation.gaps.n_eta[node]
        along, across = _end_force(evaluation, pressure, border)
        scale = abs(n_rho) * scales[0] + abs(n_eta) * scales[1]
        found.append((along * n_rho + across * n_eta) / scale)
    return np.array(found)


def border_forces(evaluation: ContactEvaluation, pressure: float) -> Array:
    """What vanishes at each border that an end of elements follows, shape (k,): see :func:`_across`."""
    potential = cast("ContactPotential", evaluation.potential)
    place, degree = {int(node): k for k, node in enumerate(potential.nodes)}, potential.space.degree
    return _across(evaluation, pressure, [Border(end, not evaluation.held[place[end * degree + 1]]) for end, _ in potential.borders])


@dataclass(frozen=True, eq=False)
class FreeSide:
    """The element beyond a border of contact, seen from the border.

    Attributes
    ----------
    nodes : ndarray of int
        Places of its nodes among those that bodies can hold.
    slope : ndarray
        What makes the derivative at the border, along the meridian, of values at these nodes.
    bend : float
        Second derivative of the gap there.
    tension : float
        Force across the circle over the deformed length for each unit of the parameter, positive where contact is before the border.
    """

    nodes: NDArray[np.int64]
    slope: Array
    bend: float
    tension: float

    def motion(self, gaps: Array) -> float:
        """How far the border moves with a change of the gaps at all nodes: where the gap and its slope are zero."""
        return -float(self.slope @ gaps[self.nodes]) / self.bend


def free_sides(evaluation: ContactEvaluation, pressure: float) -> list[FreeSide]:
    """The elements beyond the borders that ends of elements follow."""
    potential = cast("ContactPotential", evaluation.potential)
    degree, found = potential.space.degree, []
    rho, eta = potential.positions(evaluation.x, evaluation.factor)
    place = {int(node): k for k, node in enumerate(potential.nodes)}
    for end, s in potential.borders:
        before = not evaluation.held[place[end * degree + 1]]
        step = 1 if before else -1
        if degree == 1 or any(end * degree + j * step not in place for j in range(degree + 1)):
            continue
        nodes = np.array([place[end * degree + j * step] for j in range(degree + 1)])
        h = potential.parameters[nodes[-1]] - s
        powers = np.linalg.inv(np.vander((potential.parameters[nodes] - s) / h, increasing=True))
        slope, bend = powers[1] / h, 2 * float(powers[2] @ evaluation.gaps.gap[nodes]) / h**2
        pull = _end_force(evaluation, pressure, Border(end, before))
        if bend > 0:
            speed = np.hypot(slope @ rho[nodes], slope @ eta[nodes])
            found.append(FreeSide(nodes, slope, bend, step * float(np.hypot(*pull) / speed)))
    return found


def _end_force(evaluation: ContactEvaluation, pressure: float, border: Border) -> tuple[float, float]:
    """Force along rho and along z at the end of the element beyond a border."""
    potential = cast("ContactPotential", evaluation.potential)
    space = potential.space
    density = evaluation.force_density.reshape(2, 4 * space.n_quadrature, space.n_elements)
    element, local = (border.end, 0) if border.before else (border.end - 1, space.degree)
    forces = space.table.T @ (density[0][:, element] - pressure * density[1][:, element])
    along, across = _at_end(potential, evaluation, pressure, border)
    return float(forces[local] - along), float(forces[space.degree + 1 + local] - across)


def _at_end(potential: ContactPotential, evaluation: ContactEvaluation, pressure: float, border: Border) -> tuple[float, float]:
    """What the forms of the volume, and of loads over the projected area, have at the end of an element beside the force over it.

    They count the volume below an element, or beside it, so that its variation has a part at its ends. Two neighbours' parts cancel.
    """
    space = potential.space
    node = int(np.flatnonzero(potential.nodes == border.end * space.degree)[0])
    rho, eta = (float(part[node]) for part in potential.positions(evaluation.x, evaluation.factor))
    turn = 2 * np.pi * space.side * (-1.0 if border.before else 1.0)  # the element beyond the border begins, or ends, there
    load = potential.edge_load(evaluation, eta)
    if space.lids:
        return turn * load * rho, turn * pressure * rho**2 / 2
    return turn * (load - pressure * eta) * rho, 0.0


def _in_place(evaluation: ContactEvaluation) -> bool:
    """Whether bodies push at all held nodes, and no other is inside one."""
    potential = cast("ContactPotential", evaluation.potential)
    forces = potential.with_poles(evaluation.forces)[evaluation.held]
    free = evaluation.gaps.gap[~evaluation.held]
    inside = -_INSIDE * potential.space.unit
    return bool(forces.min(initial=0.0) >= -_PULL * forces.max(initial=0.0) and free.min(initial=0.0) >= inside)


def on_borders(control: Control, potential: FollowingPotential) -> Control:
    """A control of coefficients on the mesh of the scene as one of those on a mesh that follows borders."""
    if not isinstance(control, ArcLengthControl) or not potential.borders:
        return control
    offset = float(control.dual @ control.prediction)
    return CarriedArcLength(
        np.asarray(control.dual @ potential.to_root), control.dual_pressure, control.prediction, control.predicted_pressure, offset
    )


def contact_events(segment: Segment[Any]) -> list[Located[Any]]:
    """The points of a segment where a body is touched first, or let go last.

    There the force on the body is zero, and the least gap before: one function, negative before the touch and positive after it, has its
    root there.
    """
    potential = segment.problem.potential
    if segment.leaving or not potential.obstacles:
        return []
    found = []
    for k in range(len(potential.obstacles)):

        def pressed(point: BranchPoint, k: int = k) -> float:
            return _pressed(point.state.evaluation, k)

        before, after = pressed(segment.a), pressed(segment.b)
        if before * after < 0 or (after == 0 and before != 0):
            found.append(segment.root("touch" if after > before else "release", pressed, 0.0, 1.0))
    return found


def folds_beside(segment: Segment[Any], kind: str, events: list[Located[Any]]) -> list[Located[Any]]:
    """The folds of a kind on a segment whose branch has corners: those of its smooth parts, and a corner on whose sides a rate has other
    signs.

    A cubic through both ends knows nothing of a fold just before a corner, beyond which the quantity turns again.
    """
    if not events:
        return segment.folds(kind)
    shares = sorted({(event.point.sigma - segment.a.sigma) / segment.length for event in events})
    ends = [0.0, *(share + side * _BESIDE for share in shares for side in (-1, 1)), 1.0]
    if not all(low < high for low, high in pairwise(ends)):
        return segment.folds(kind)
    points = [segment.at(share) for share in ends]
    found: list[Located[Any]] = []
    for low, high in zip(points[::2], points[1::2], strict=True):
        found += type(segment)(segment.problem, low, high).folds(kind)
    quantity = segment.problem.folds[kind]
    for before, after, event in zip(points[1::2], points[2::2], sorted(events, key=lambda e: e.point.sigma), strict=False):
        if before.rate(quantity) * after.rate(quantity) < 0:
            found.append(type(event)(kind, event.point, event.error))
    return found


def _pressed(evaluation: Any, body: int) -> float:
    """The force on a body, or less its least gap where it is not touched."""
    own = evaluation.gaps.body == body
    held = evaluation.held & own
    if held.any():
        return float(np.abs(evaluation.forces[held]).sum())
    potential, factor = evaluation.potential, evaluation.factor
    return -float(potential.bodies_at(factor)[body].gap(*potential.positions(evaluation.x, factor)).min())
