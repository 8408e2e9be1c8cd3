"""A branch as a curve: what lies between its equilibria.

The curve goes through all equilibria and special points, and between them along the cubics with the tangents there. Where a cubic is not
as close to the branch as a picture shows, equilibria between are computed for it. They are no steps of the branch.

Along a branch over a number every equilibrium has a scene of its own, whose tangents lead off the branch. The curve then has the slopes
of parabolas through neighbours.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from ..errors import SolveError, Status, unknown_name
from ..quantities import PLACES, quantity
from ..solve.between import (
    Arc,
    Direction,
    Node,
    across,
    arc_between,
    bend,
    chord_between,
    cubic,
    direction_at,
    directions_beside,
    followed,
    rates_along,
    rounded,
)
from ..solve.branch import BranchProblem
from ..solve.controls import CONTROLS
from ..solve.state import State, joined
from ..solve.stepping import march
from ..threads import one_thread
from .equilibrium import Equilibrium, recorded
from .other_mesh import on_mesh_of
from .special_point import Jump, SpecialPoint

if TYPE_CHECKING:
    from ..potential import Potential
    from ..potential.contact import ContactPotential
    from ..scene import Scene
    from .branch import Branch

Array = NDArray[np.float64]

#: distance from the branch that a picture does not show, as a share of the range of each quantity
CLOSE = 5e-5
#: distance of a drawn polygon from the curve, in the same measure, and most points of it on an arc
_FINE, _MOST = 2e-5, 64
#: how often an arc is halved, at most
_HALVED = 6
#: slope over that of a chord from which on a cubic may swing beyond its ends (Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980))
_STEEPEST = 3.0
#: shares of an arc at which values are looked for
_GRID = np.linspace(0.0, 1.0, 17)
#: the same where a place is looked for that turns back
_TURNS = np.linspace(0.0, 1.0, 65)
#: special points at which a branch has a corner
CORNERS = ("touch", "release")
#: what is held where the membrane snaps at a fold
HELD_AT = {"limit_point": "pressure", "volume_fold": "volume", "height_fold": "center_height"}

#: the number of a gap, and whether a part of it is beyond its snap
_Place = tuple[int, bool]
#: values of a quantity at both ends of an arc, and its slopes there
_Ends = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class CurvePoint:
    """A point that the curve goes through.

    Attributes
    ----------
    equilibrium : Equilibrium
    step : int or None
        Its number along the branch; None where it is no step.
    special : SpecialPoint or None
        The special point that it is; None at others, and at states that were computed for the curve alone.
    node : Node
    """

    equilibrium: Equilibrium
    step: int | None
    special: SpecialPoint | None
    node: Node


@dataclass(frozen=True, eq=False)
class Piece:
    """The curve between two neighbouring points of it."""

    a: CurvePoint
    b: CurvePoint
    arc: Arc

    @property
    def resolved(self) -> bool:
        """Whether the branch is known to be as close as a picture shows, or nothing speaks against it."""
        return self.arc.resolved


@dataclass(frozen=True, eq=False)
class Snap:
    """A snap at the load where it happens.

    Attributes
    ----------
    tail : CurvePoint
        The fold or branch point before it, or the equilibrium.
    tip : CurvePoint
        The state at this load on the branch that the membrane lands on; the landing where that is not known.
    """

    tail: CurvePoint
    tip: CurvePoint


@dataclass(frozen=True, eq=False)
class Gap:
    """What lies between an equilibrium of a branch and the next one.

    Attributes
    ----------
    stretches : list of list of Piece
        The curve, cut at special points.
    snap : Snap or None
        Where the membrane snapped.
    beyond : list of Piece
        What comes after the snap.
    """

    stretches: list[list[Piece]]
    snap: Snap | None = None
    beyond: list[Piece] = field(default_factory=list)


class BranchCurve:
    """The curve of a branch.

    Attributes
    ----------
    runs : list of list of Piece
        The curve in order, cut where the membrane snaps.
    gaps : list of Gap
        The same pieces by the equilibria between which they lie, one for each pair of neighbours.
    added : int
        Number of equilibria that were computed for it.
    """

    @one_thread
    def __init__(self, branch: Branch) -> None:
        self.branch = branch
        self._problems: dict[int, BranchProblem] = {}
        self._readers: dict[str, Callable[[int, Equilibrium], Any]] = {}
        self.scale = _ranges(self._places(branch))
        self.added, self.changes = 0, branch.mesh_changes
        self.gaps = [Gap([[]]) for _ in range(max(len(branch) - 1, 0))]
        self.runs = [self._run(chain) for chain in self._chains()]

    # --- its points

    def _chains(self) -> list[list[tuple[_Place, CurvePoint]]]:
        """The points that are known, cut where the membrane snaps, each with what lies before it."""
        branch, inside = self.branch, specials_between(self.branch)
        snaps = {jump.index: jump for jump in branch.jumps if 0 < jump.index < len(branch)}
        known = [equilibrium.of_branch for equilibrium in branch]  # all in one space
        steps = [CurvePoint(equilibrium, k, None, self._node(equilibrium)) for k, equilibrium in enumerate(known)]
        chains: list[list[tuple[_Place, CurvePoint]]] = [[((-1, False), point) for point in steps[:1]]]
        for k, (before, after) in enumerate(pairwise(steps)):
            chains[-1] += [((k, False), self._special(point)) for point in inside[k]]
            jump = snaps.get(k + 1)
            if jump is not None:
                tail = self._special(jump.limit) if jump.limit else before
                chains[-1] += [((k, False), tail)] if jump.limit else []
                foot = self._foot(jump)
                self.gaps[k] = Gap([[]], Snap(tail, foot or after))
                chains.append([((k, True), foot)] if foot else [])
            chains[-1].append(((k, jump is not None), after))
        return [_apart(chain) for chain in chains]

    def _special(self, point: SpecialPoint) -> CurvePoint:
        return CurvePoint(point.equilibrium, None, point, self._special_node(point))

    def _foot(self, jump: Jump) -> CurvePoint | None:
        """The state at the load of a snap on the branch that it landed on: followed back from the landing."""
        limit, landing = jump.limit, jump.landing.of_branch
        held = jump.held or (HELD_AT.get(str(limit.kind), "") if limit else "")
        if self.branch.over or limit is None or held not in CONTROLS or not self._same(landing, limit.equilibrium):
            return None
        potential, load = self._problem(landing).potential, float(getattr(limit, held))
        state = State(landing.state, landing.pressure, potential.evaluate(landing.state, landing.pressure), 0, 0.0, landing.residual, 0.0)
        try:
            last = march(potential, state, CONTROLS[held].at, float(getattr(landing, held)), load)[-1]
        except SolveError:
            return None
        return self._computed(landing.scene, potential, last)

    def _computed(self, scene: Scene, potential: Potential, state: State) -> CurvePoint:
        own, x = state.evaluation, state.x
        if potential.obstacles:
            scene, potential, x = scene.bordered(own.potential.scene.borders), own.potential, own.x
        equilibrium = recorded(scene, potential, x, state.pressure, own, Status.CONVERGED, state.residual)
        return CurvePoint(equilibrium, None, None, self._node(equilibrium))

    # --- their nodes

    def _problem(self, equilibrium: Equilibrium) -> BranchProblem:
        """The equations of the scene of an equilibrium, on the mesh of the scene; scenes are told apart by their objects, which are few."""
        key = id(equilibrium.scene)
        if key not in self._problems:
            potential = equilibrium.potential.root
            known = (problem for problem in self._problems.values() if problem.potential is potential)
            self._problems[key] = next(known, None) or BranchProblem(potential)
        return self._problems[key]

    def _same(self, a: Equilibrium, b: Equilibrium) -> bool:
        return self._problem(a).potential is self._problem(b).potential

    def _node(self, equilibrium: Equilibrium) -> Node:
        return Node(self._unknowns(equilibrium), self._places([equilibrium])[0], self._direction(equilibrium))

    def _unknowns(self, equilibrium: Equilibrium) -> Array:
        """(x, P) on the mesh of the scene, wherever ends of elements follow borders of contact."""
        x = equilibrium.state
        if equilibrium.scene.borders:
            x = cast("ContactPotential", equilibrium.potential).carried(x)
        return joined(x, equilibrium.pressure)

    def _places(self, items: Sequence[Equilibrium | SpecialPoint]) -> Array:
        return places_of(items, self.branch.over)

    def _direction(self, equilibrium: Equilibrium) -> Direction | None:
        """The direction of the branch at an equilibrium, found once; None over a number, which a tangent of one scene does not move."""
        if self.branch.over or equilibrium.status.ill_posed:
            return None
        potential = equilibrium.potential if self.branch.scene.bodies else self._problem(equilibrium).potential
        return equilibrium.remembered(("tangent",), lambda: direction_at(potential, equilibrium.state, equilibrium.pressure))

    def _special_node(self, point: SpecialPoint) -> Node:
        """A branch point has two directions, of which the one of this branch is known; a point apart from its state has none."""
        equilibrium, places = point.equilibrium, self._places([point])[0]
        z = self._unknowns(equilibrium)
        corner = str(point.kind) in CORNERS
        if self.branch.over or not np.array_equal(places, self._places([equilibrium])[0]):
            return Node(z, places, None, corner=corner)
        if corner:
            free, held = equilibrium.remembered(("tangents",), lambda: self._beside(equilibrium))
            return Node(z, places, free, held, corner) if point.kind == "touch" else Node(z, places, held, free, corner)
        if str(point.kind) != "branch_point":
            return self._node(equilibrium)
        if point.tangent is None:
            return Node(z, places, None)
        potential = self._problem(equilibrium).potential
        evaluation = potential.evaluate(equilibrium.state, equilibrium.pressure)
        return Node(z, places, Direction(point.tangent, rates_along(potential, equilibrium.pressure, evaluation, point.tangent)))

    def _beside(self, equilibrium: Equilibrium) -> tuple[Direction | None, Direction | None]:
        potential = cast("ContactPotential", equilibrium.potential)
        return directions_beside(potential, equilibrium.state, equilibrium.pressure)

    # --- its pieces

    def _run(self, chain: list[tuple[_Place, CurvePoint]]) -> list[Piece]:
        """The pieces between the points of a chain, which also go to the gaps that they lie in."""
        hops = [(place, piece) for (_, a), (place, b) in pairwise(chain) for piece in self._joined(a, b)]
        arcs = rounded([piece.arc for _, piece in hops])
        run = [Piece(piece.a, piece.b, arc) for (_, piece), arc in zip(hops, arcs, strict=True)]
        for ((gap, beyond), _), piece in zip(hops, run, strict=True):
            stretches = self.gaps[gap].stretches
            (self.gaps[gap].beyond if beyond else stretches[-1]).append(piece)
            if piece.b.special is not None and not beyond:
                stretches.append([])
        return run

    def _joined(self, a: CurvePoint, b: CurvePoint) -> list[Piece]:
        """The curve between two points, on the mesh of the second where it changes between them."""
        if a.node.z.size == b.node.z.size and (self.branch.over or not self.changes or self._same(a.equilibrium, b.equilibrium)):
            return self._between(a, b, _HALVED)
        crossing = a.special is not None and str(a.special.kind) == "branch_point"  # with another direction on each mesh
        there = None if crossing else on_mesh_of(a.equilibrium, b.equilibrium)
        if there is None:
            return [Piece(a, b, chord_between(Node(b.node.z, a.node.places, None), b.node, self.scale))]
        return self._between(replace(a, equilibrium=there, node=self._node(there)), b, _HALVED)

    def _between(self, a: CurvePoint, b: CurvePoint, halvings: int) -> list[Piece]:
        """The curve between two points: their arc, or the arcs through states between them where that is not close to the branch."""
        if self.branch.over:
            return [Piece(a, b, chord_between(a.node, b.node, self.scale))]
        problem = self._problem(a.equilibrium)
        arc = arc_between(problem, a.node, b.node)
        if not self._can_be_checked(a, b) or bend(arc, self.scale) < CLOSE:
            return [Piece(a, b, arc)]
        state = across(problem, arc, 0.5)
        if state is None:
            return [Piece(a, b, arc.straightened())] if halvings < _HALVED else self._followed(a, b, arc)
        found = np.array([state.volume, state.pressure, problem.potential.space.center_height(state.x)])
        if float((np.abs(found - arc.places(np.array([0.5]))[0]) / self.scale).max()) <= CLOSE:
            return [Piece(a, b, arc)]
        if halvings == 0:
            return [Piece(a, b, arc)]
        middle = self._computed(a.equilibrium.scene, problem.potential, state)
        self.added += 1
        return [*self._between(a, middle, halvings - 1), *self._between(middle, b, halvings - 1)]

    def _followed(self, a: CurvePoint, b: CurvePoint, arc: Arc) -> list[Piece]:
        """The curve through states that the branch was followed over; a straight line, known as one, where it was not."""
        problem = self._problem(a.equilibrium)
        states = followed(problem, arc)
        between = [self._computed(a.equilibrium.scene, problem.potential, state) for state in states]
        self.added += len(between)
        if not between:
            return [Piece(a, b, arc.straightened())]
        return [piece for c, d in pairwise([a, *between, b]) for piece in self._between(c, d, 2)]

    def _can_be_checked(self, a: CurvePoint, b: CurvePoint) -> bool:
        return a.node.onward is not None and b.node.direction is not None and self._same(a.equilibrium, b.equilibrium)

    # --- quantities along it

    def value(self, point: CurvePoint, name: str) -> float:
        """A quantity at a point: a place, or any column of the branch that is a number.

        Raises
        ------
        InputError
            For an unknown quantity, and one that is a word.
        """
        if name in PLACES:
            return float(getattr(point.special or point.equilibrium, name))
        return float(self.reader(name)(-1 if point.step is None else point.step, point.equilibrium))

    def reader(self, name: str) -> Callable[[int, Equilibrium], Any]:
        """Who reads a quantity off a step and its equilibrium.

        Raises
        ------
        InputError
            For an unknown quantity, and one that is a word.
        """
        from .table import column, known_columns, reader

        if name not in self._readers:
            column(self.branch[:0], name)
            if quantity(name).type is str:
                raise unknown_name("column", name, [known for known in known_columns(self.branch) if quantity(known).type is not str])
            self._readers[name] = reader(self.branch.scene, name)
        return self._readers[name]

    def lines(self, names: Sequence[str]) -> dict[int, Array]:
        """Each piece as a polygon in some quantities, shape (n, len(names)), by the id of the piece.

        Volume, pressure and height go along the cubics; any other quantity along cubics through its values, with the slopes of parabolas,
        and so does every quantity over a number.
        """
        along = [[self._along(run, name) for name in names] for run in self.runs if run]
        if not along:
            return {}
        whole = [np.array([end[:2] for curves in along for end in curves[n]]) for n in range(len(names))]
        scale = np.array([_range(values) for values in whole])
        return {
            id(piece): _polygon([curve[k] for curve in curves], scale, piece.arc.length)
            for run, curves in zip(filter(None, self.runs), along, strict=True)
            for k, piece in enumerate(run)
        }

    def _along(self, run: Sequence[Piece], name: str) -> list[_Ends]:
        """A quantity at both ends of each piece of a run."""
        if name in PLACES and not self.branch.over:
            p = PLACES.index(name)
            return [(x.arc.a.places[p], x.arc.b.places[p], x.arc.rates[0][p], x.arc.rates[1][p]) for x in run]
        lengths = np.array([piece.arc.length for piece in run])
        points = [run[0].a, *(piece.b for piece in run)]
        values = _steps(points, lengths) if name == "step" else np.array([self.value(point, name) for point in points])
        corners = [k for k in range(1, len(run)) if points[k].node.corner]
        if not corners:
            slopes = slopes_of(values, lengths)
            return list(zip(values[:-1], values[1:], slopes[:-1], slopes[1:], strict=True))
        parts = [_between_corners(values[a : b + 1], lengths[a:b]) for a, b in pairwise([0, *corners, len(run)])]
        return [piece for part in parts for piece in part]

    # --- where it takes a value

    def crossings(self, name: str, value: float) -> Iterator[tuple[Piece, float]]:
        """The pieces on which a place has a value, with the shares of them, in the order of the branch."""
        place = PLACES.index(name)
        for run in self.runs:
            for k, piece in enumerate(run):
                offsets = piece.arc.places(_GRID)[:, place] - value
                for j, (first, last) in enumerate(pairwise(offsets)):
                    if first == 0 and (j > 0 or k == 0):
                        yield piece, float(_GRID[j])
                    elif first * last < 0:
                        yield piece, _root(piece.arc, place, value, float(_GRID[j]), float(_GRID[j + 1]))
                if offsets[-1] == 0:
                    yield piece, 1.0

    def span(self, name: str) -> tuple[float, float]:
        """Smallest and largest value of a place on the curve."""
        place = PLACES.index(name)
        values = [piece.arc.places(_GRID)[:, place] for run in self.runs for piece in run] or [places_of(self.branch)[:, place]]
        every = np.concatenate(values)
        return float(every.min()), float(every.max())


def turning(part: Sequence[Piece], name: str) -> float | None:
    """Where a place first turns back on pieces that follow each other: number of the piece plus share of it; None where it does not."""
    place, way = PLACES.index(name), 0.0
    for k, piece in enumerate(part):
        values = piece.arc.places(_TURNS)[:, place]
        for share, step in zip(_TURNS[:-1], np.diff(values), strict=True):
            if step * way < 0:
                return float(k + share)
            way = step or way
    return None


def half_way(part: Sequence[Piece]) -> float:
    """The middle of pieces that follow each other, in arc length: number of the piece plus share of it."""
    at = np.concatenate([[0.0], np.cumsum([piece.arc.length for piece in part])])
    return float(np.interp(at[-1] / 2, at, np.arange(len(at))))


def places_of(items: Sequence[Equilibrium | SpecialPoint], over: str = "") -> Array:
    """Volume, pressure and height, shape (n, 3); where a number of the scene changes along the branch, it is the fourth."""
    places = np.array([[getattr(item, name) for name in PLACES] for item in items], dtype=float).reshape(-1, len(PLACES))
    if not over:
        return places
    own = [(item.equilibrium if isinstance(item, SpecialPoint) else item).number(over) for item in items]
    return np.column_stack([places, np.array(own, dtype=float)])


def specials_between(branch: Branch) -> list[list[SpecialPoint]]:
    """The special points between each pair of neighbours, in order.

    A special point lies between the two neighbours for which the way over it is the smallest detour, in volume, pressure, pole height and
    the number that changes together (in a picture of two of them the branch may cross itself). One that is far from the branch lies between
    none.
    """
    points, special = places_of(branch, branch.over), list(branch.special_points or ())
    scale = np.maximum(np.ptp(points, axis=0), 1e-300) if len(points) else np.ones(points.shape[1])
    a, b = points[:-1] / scale, points[1:] / scale
    direct = np.linalg.norm(b - a, axis=1)
    inside: list[list[tuple[float, SpecialPoint]]] = [[] for _ in direct]
    for item, place in zip(special, places_of(special, branch.over) / scale, strict=True):
        detour = np.linalg.norm(place - a, axis=1) + np.linalg.norm(place - b, axis=1) - direct
        if detour.size and detour[k := int(np.argmin(detour))] < direct[k]:
            inside[k].append((float((place - a[k]) @ (b[k] - a[k])), item))
    return [[item for _, item in sorted(gap, key=lambda g: g[0])] for gap in inside]


def _apart(chain: Sequence[tuple[_Place, CurvePoint]]) -> list[tuple[_Place, CurvePoint]]:
    """Points without those that are the point before, such as a special point at which the branch ends."""
    kept: list[tuple[_Place, CurvePoint]] = []
    for place, point in chain:
        before = kept[-1][1] if kept else None
        if before is not None and np.array_equal(before.node.z, point.node.z) and np.array_equal(before.node.places, point.node.places):
            if point.step is None or before.step is not None:
                continue
            kept.pop()
        kept.append((place, point))
    return kept


def _ranges(places: Array) -> Array:
    """How far each place goes along the branch: what is constant but for round-off goes as far as its size."""
    if not len(places):
        return np.ones(places.shape[1])
    size = np.abs(places).max(axis=0)
    found = np.maximum(np.ptp(places, axis=0), 1e-6 * size)
    return np.where(found > 0, found, 1.0)


def _range(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.ptp(known)) or 1.0 if known.size else 1.0


def _polygon(ends: Sequence[_Ends], scale: Array, length: float) -> Array:
    """A polygon as fine as a picture shows along the cubics of some quantities."""
    a, b, slope_a, slope_b = (np.array(values, dtype=float) for values in zip(*ends, strict=True))
    shares = np.array([0.25, 0.5, 0.75])
    bent = np.abs(cubic(a, slope_a, b, slope_b, shares, length) - (a + shares[:, None] * (b - a))) / scale
    most = float(bent.max()) if np.isfinite(bent).all() else 0.0
    count = min(max(int(np.ceil(np.sqrt(most / _FINE))), 1), _MOST)
    line = cubic(a, slope_a, b, slope_b, np.linspace(0.0, 1.0, count + 1), length)
    line[0], line[-1] = a, b  # to the last bit
    return line


def slopes_of(values: Array, lengths: Array) -> Array:
    """Slopes of parabolas through three neighbours each; at the ends of those through the first three and the last three."""
    chords = np.diff(values) / lengths
    if len(lengths) == 1:
        return np.array([chords[0], chords[0]])
    share = lengths[:-1] / (lengths[:-1] + lengths[1:])
    inner = (1 - share) * chords[:-1] + share * chords[1:]
    return np.concatenate([[2 * chords[0] - inner[0]], inner, [2 * chords[-1] - inner[-1]]])


def _between_corners(values: Array, lengths: Array) -> list[_Ends]:
    """A quantity at both ends of each piece of a part that begins or ends at a corner.

    From there it may go as a root, as a radius of contact does: slopes are small enough for cubics not to swing beyond their ends.
    """
    slopes, chords = slopes_of(values, lengths), np.diff(values) / lengths
    for k, own in enumerate(slopes):
        beside = chords[max(k - 1, 0) : k + 1]
        most = _STEEPEST * np.abs(beside).min()
        if (beside * beside[0] >= 0).all() and abs(own) > most:
            slopes[k] = np.copysign(most, beside[0])
    return list(zip(values[:-1], values[1:], slopes[:-1], slopes[1:], strict=True))


def _steps(points: Sequence[CurvePoint], lengths: Array) -> Array:
    """Numbers of steps, which grow with the arc length between two of them."""
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    known = [k for k, point in enumerate(points) if point.step is not None]
    found: Array = np.interp(at, at[known], [float(points[k].step or 0) for k in known])
    return found


def _root(arc: Arc, place: int, value: float, low: float, high: float) -> float:
    from scipy.optimize import brentq

    return float(brentq(lambda t: float(arc.places(np.array([t]))[0, place]) - value, low, high, xtol=1e-14))
