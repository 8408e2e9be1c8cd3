"""Where zones of wrinkles, or of taut membrane between them, appear and vanish along a branch of a tension field.

Zones are the parts of the meridian where the strains beyond natural width (g_1, g_2) have given signs. Along a branch their borders move
continuously, and their number changes only where g_1 or g_2 is zero at one of its extrema along the meridian, or at an end of it: there a
zone of no width opens or closes. That extreme value is a smooth function along the branch, negative on one side of the event and positive
on the other one, and its root is found as any other (:meth:`.Segment.root`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..discretization.space import transferred
from ..discretization.strains import strained_at
from ..errors import SolveError, Status
from ..potential import Array, Potential, potential_of
from ..potential.following import Mark
from .branch import BranchProblem
from .end_strains import strains_at_ends
from .finer_space import counterpart
from .segment import Located, Segment
from .state import State
from .wellposed import apparent
from .zone_strains import BITS, HOOP, MERIDIAN, Runs, Strains

if TYPE_CHECKING:
    from ..potential.following import WrinklingPotential

#: part of the change between neighbouring points by which an extremum may lie beyond the parabola through three of them
_BEYOND = 0.5
#: error of strains at quadrature points, over the largest, for elements of first degree; its powers for others
_ROUGH = 0.2
#: most points of a segment that are looked at to tell its events apart
_MOST_LOOKS = 24
#: how much smaller than those of all other zones the extreme strain of one must be for it to be the one that vanishes
_SINGLE = 0.25
#: share of a segment over which the slope of a strain is measured
_AHEAD = 1e-4
#: segments, and length of arc, on both sides within which an event of a finer space is the same one
_FAR, _NEAR = 2.0, 1e-3


@dataclass(slots=True)
class ZoneEvent(Located[Any]):
    """A point of a curve where a zone opens or closes.

    Attributes
    ----------
    kind : {"zone_opens", "zone_closes"}
    zone : int
        Number of the kind of the zone: the sum of the :data:`BITS` of the strains that are negative in it.
    s : float
        Parameter of the meridian at which it is.
    place : {"pole", "rim", "inside"}
    radii : (float, float)
        Reference and deformed radius there.
    """

    zone: int
    s: float
    place: str
    radii: tuple[float, float]


#: from the state of a point to that of its own scene
Own = Callable[[State], State]


def zone_events(segment: Segment[Any], own: Own) -> list[ZoneEvent]:
    """The points of a segment where zones of a tension field open or close.

    Where a state is slack, what a mesh shows depends on the mesh, and nothing is looked for. An event that a finer space does not
    have as well, or whose state is not found there, is left out: it may be the mesh's.

    Parameters
    ----------
    segment : Segment
    own : callable
        From the state of a point to that of its own scene.
    """
    if segment.leaving:
        return []
    ends = [Strains(own(point.state).evaluation) for point in (segment.a, segment.b)]
    events: list[ZoneEvent] = []
    for component in (MERIDIAN, HOOP) if ends[0].potential.tilts else (HOOP,):  # without tension along the meridian it is slack
        if _alike(ends[0].screened[component], ends[1].screened[component], _ROUGH ** ends[0].space.degree):
            continue
        if any(apparent(strains.potential, strains.evaluation) is not None for strains in ends):
            return []
        events += _Search(segment, own, component).events(ends)
    return _merged(events)


def _alike(a: Array, b: Array, rough: float) -> bool:
    """Whether the strains at quadrature points, known but roughly, show that no zone appears or vanishes between two states."""
    return bool(np.array_equal(_signs(a), _signs(b)) and not _doubtful(a, rough) and not _doubtful(b, rough))


def _signs(g: Array) -> Array:
    """Signs of the strains of the zones, one after the other."""
    negative = g < 0
    return negative[np.append(True, negative[1:] != negative[:-1])]


def _doubtful(g: Array, rough: float) -> bool:
    """Whether an extremum between the points, or a value at an end, may have another sign than the points beside it, or than it seems."""
    steps, negative = np.diff(g), g < 0
    starts = np.flatnonzero(np.append(True, negative[1:] != negative[:-1]))
    little = rough * float(np.abs(g).max())
    if (np.maximum.reduceat(np.abs(g), starts) <= little).any():
        return True
    sign = np.where(negative, -1.0, 1.0)
    rising, falling = steps[1:] * sign[1:-1], -steps[:-1] * sign[1:-1]  # both positive where |g| is least
    slack = _BEYOND * np.maximum(np.abs(rising), np.abs(falling)) + little
    curved = np.maximum(rising + falling, 1e-300)
    beyond = (rising - falling) ** 2 / (8 * curved)
    inner = (rising >= 0) & (falling >= 0) & (np.abs(g[1:-1]) <= beyond + slack)
    outer = [abs(g[0]) <= (1 + _BEYOND) * abs(steps[0]), abs(g[-1]) <= (1 + _BEYOND) * abs(steps[-1])]
    return bool(inner.any() or any(outer))


@dataclass(frozen=True)
class _Found:
    """What is known of an event from the states on both sides of it.

    Attributes
    ----------
    low, high : float
        Shares of the segment on both sides.
    opens : bool
    negative : bool
        Sign of the strain in the zone.
    end : {0, -1} or None
        The end of the meridian at which it is; None inside.
    left, right : float
        The part of the meridian in which no other zone begins or ends.
    """

    low: float
    high: float
    opens: bool
    negative: bool
    end: int | None
    left: float
    right: float

    @property
    def kind(self) -> str:
        return "zone_opens" if self.opens else "zone_closes"


class _Search:
    """The search for the events of one of the strains on a segment.

    Where elements follow borders, states on the mesh of the scene tell the events apart, as they are found faster. Each event is then
    located on elements that follow the other borders, one of which ends at its place: there the strain by the forces is as exact as an
    energy.
    """

    def __init__(self, segment: Segment[Any], own: Own, component: int) -> None:
        self.segment, self.own, self.component = segment, own, component
        self.looks = 0
        potential = segment.problem.potential
        self.follows = potential.follows
        self.plain = self._on(cast("WrinklingPotential", potential).still) if self.follows else segment

    def _on(self, potential: Potential) -> Segment[Any]:
        return Segment(BranchProblem(potential), self.segment.a, self.segment.b)

    def of(self, point: Any) -> Strains:
        return Strains(self.own(point.state).evaluation)

    def events(self, ends: list[Strains]) -> list[ZoneEvent]:
        return self._between(0.0, ends[0].runs(self.component), 1.0, ends[1].runs(self.component))

    def _between(self, low: float, a: Runs, high: float, b: Runs) -> list[ZoneEvent]:
        """The events between two shares, in order."""
        if a.signs == b.signs:
            return []
        try:
            found = self._single(low, a, high, b)
            if found is not None and (event := self._located(found)) is not None:
                return [event] if self._holds(found, event) else []
            self.looks += 1
            if self.looks > _MOST_LOOKS:
                return []
            middle = (low + high) / 2
            between = self.of(self.plain.at(middle)).runs(self.component)
        except SolveError:  # the curve is not resolved there, as next to a crossing
            return []
        return self._between(low, a, middle, between) + self._between(middle, between, high, b)

    def _single(self, low: float, a: Runs, high: float, b: Runs) -> _Found | None:
        """The event, where one zone alone appears or vanishes between two shares and it is clear which; None where that is not so."""
        opens = len(b.signs) > len(a.signs)
        more, fewer = (b, a) if opens else (a, b)
        places, number = more.peaks[0], len(more.signs) - len(fewer.signs)
        if number == 1:
            first = more.signs[1:] == fewer.signs
            k, end = (0, 0) if first else (-1, -1)
            window = (-np.inf, places[1]) if first else (places[-2], np.inf)
        elif number == 2 and more.signs[0] == fewer.signs[0]:
            size = np.abs(more.peaks[1, 1:-1])
            k, end = 1 + int(np.argmin(size)), None
            if size.size > 1 and size[k - 1] > _SINGLE * np.partition(size, 1)[1]:
                return None
            window = places[k - 1], places[k + 1]
        else:
            return None
        return _Found(low, high, opens, more.signs[k], end, float(window[0]), float(window[1]))

    def _located(self, found: _Found) -> ZoneEvent | None:
        """The event where the strain of its zone is zero; None where that does not change its sign as it should."""

        def value(point: Any) -> float:
            return self._extreme(self.of(point), found)[1]

        sides = [self.plain.at(share) for share in (found.low, found.high)]
        before, after = (value(point) for point in sides)
        if before * after >= 0 or (after < 0) != (found.opens == found.negative):
            return None
        if found.end is not None and self.of(sides[0]).space.on_axis[found.end] and not self._both(found, sides[found.opens]):
            return None
        located = self.plain.root(found.kind, value, found.low, found.high)
        strains = self.of(located.point)
        place = self._extreme(strains, found)[0]
        if self.follows and (exact := self._followed(found, located.point, place)) is not None:
            located, place = exact
        return self._event(located, found, self.of(located.point), place)

    def _holds(self, found: _Found, event: ZoneEvent) -> bool:
        """Whether the zone appears or vanishes in a finer space as well, next to where it does on this mesh.

        Slopes of elements err most at their ends, where a coarse mesh may show a zone that the membrane does not have. In the finer space
        the strain of the zone has to have the right signs on both sides of the event, as far from it as that strain itself says.
        """
        share = (event.point.sigma - self.segment.a.sigma) / self.segment.length
        try:
            here, near = (self.of(self.plain.at(s)) for s in (share, share + (_AHEAD if share < 0.5 else -_AHEAD)))
            slope = abs(self._extreme(near, found)[1] - self._extreme(here, found)[1]) / _AHEAD
            off = abs(self._extreme(self._finer(share), found)[1])
            if not (slope and 2 * off <= max(_FAR, _NEAR / self.segment.length) * slope):
                return False
            reach = 2 * off / slope + _AHEAD
            without, with_zone = (self._finer(share + side * reach) for side in ((-1, 1) if found.opens else (1, -1)))
        except SolveError:  # not found in a finer space, or slack there
            return False
        absent, present = ((self._extreme(strains, found)[1] < 0) == found.negative for strains in (without, with_zone))
        return present and not absent and (found.end is not None or self._apart(with_zone, found))

    def _apart(self, strains: Strains, found: _Found) -> bool:
        """Whether a zone ends within its part of the meridian: else it may be a neighbour whose border has come there."""
        beside = strains.at(np.array([found.left, found.right]))[self.component] < 0
        return not (beside == found.negative).any()

    def _finer(self, share: float) -> Strains:
        """Strains at a share of the segment in a finer space, whose elements follow no borders."""
        point = self.plain.at(share)
        state = self.own(point.state)
        own, evaluation = state.evaluation.potential, state.evaluation
        if own.follows:
            plain = potential_of(own.scene.replace(follow_borders=False, borders=()))
            x = transferred(own.space, evaluation.x, plain.space)
            own, evaluation = plain, plain.evaluate(x, state.pressure, evaluation.factor)
        found = counterpart(own, evaluation, state.pressure, level=2)
        if found is None:
            raise SolveError("the equilibrium was not found in a finer space", status=Status.NOT_CONVERGED)
        if apparent(found.evaluation.potential, found.evaluation) is not None:
            raise SolveError("the membrane is slack in a finer space", status=Status.SLACK)
        return Strains(found.evaluation)

    def _extreme(self, strains: Strains, found: _Found) -> tuple[float, float]:
        """Where the strain of a zone is farthest on the side that the zone is on, and its value there."""
        if found.end is None:
            return strains.extreme(self.component, found.left, found.right, found.negative)
        place = strains.first if found.end == 0 else strains.last
        return place, float(strains.at(np.array([place]))[self.component, 0])

    def _both(self, found: _Found, point: Any) -> bool:
        """Whether at a pole, where all directions are alike, both strains have the sign of the zone: else it is an error of the mesh."""
        strains = self.of(point)
        place = strains.first if found.end == 0 else strains.last
        return bool(((strains.at(np.array([place]))[:, 0] < 0) == found.negative).all())

    def _followed(self, found: _Found, near: Any, place: float) -> tuple[Located[Any], float] | None:
        """The event and its place on elements that follow borders, one of which ends there; None where it is not found."""
        share = (near.sigma - self.segment.a.sigma) / self.segment.length
        try:
            if found.end is None:
                place = self._vertex(found, share, place)
            at_mark, value = self._marked(found, place)
            ahead = _AHEAD if share < 0.5 else -_AHEAD
            here, there = value(at_mark.at(share)), value(at_mark.at(share + ahead))
            slope = (there - here) / ahead
            if not (np.isfinite(slope) and slope):
                return None
            reach = 2 * abs(here / slope) + _AHEAD
            return at_mark.root(found.kind, value, share - reach, share + reach, (share - here / slope, slope)), place
        except (SolveError, ValueError):
            return None

    def _marked(self, found: _Found, place: float) -> tuple[Segment[Any], Callable[[Any], float]]:
        """The segment on elements one of which ends at a place, and the strain there by the forces."""
        mark = Mark(place, found.left, found.right)

        def value(point: Any) -> float:
            evaluation = point.state.evaluation
            beyond = strains_at_ends(evaluation.potential, evaluation, point.state.pressure)[self.component]
            k = int(np.abs(evaluation.potential.space.ends - place).argmin())
            sides = [*beyond[1, max(k - 1, 0) : k], *beyond[0, k : k + 1]]
            own = float(np.mean(sides))
            return own if np.isfinite(own) else self._extreme(self.of(point), found)[1]  # forces say nothing on the axis

        return self._on(cast("WrinklingPotential", self.segment.problem.potential).marking(mark)), value

    def _vertex(self, found: _Found, share: float, place: float) -> float:
        """Where the strain by the forces is extreme, next to where that of the elements is: by a parabola through three places."""
        space = self.segment.problem.potential.space
        size = float(space.sizes[space.locate(np.array([place]))[0][0]])
        d = min(size / 2 ** (space.degree + 3), (place - found.left) / 2, (found.right - place) / 2)
        values = []
        for s in (place - d, place, place + d):
            at_mark, value = self._marked(found, s)
            values.append(value(at_mark.at(share)))
        low, middle, high = values
        curved = high - 2 * middle + low
        if not curved * (1 if found.negative else -1) > 0:
            return place
        shift = d * (low - high) / (2 * curved)
        return place + shift if abs(shift) < size / 2 else place

    def _event(self, located: Located[Any], found: _Found, strains: Strains, s: float) -> ZoneEvent:
        place = "inside" if found.end is None else "pole" if strains.space.on_axis[found.end] else "rim"
        at = strained_at(strains.space, strains.evaluation.x, np.array([s]))
        other = float(strains.at(np.array([s]))[1 - self.component, 0])
        zone = BITS[self.component] * found.negative + BITS[1 - self.component] * (other < 0)
        radii = 0.0 if place == "pole" else float(at.R[0]), 0.0 if place == "pole" else float(at.rho[0])
        return ZoneEvent(located.kind, located.point, located.error, int(zone), s, place, radii)


def _merged(events: list[ZoneEvent]) -> list[ZoneEvent]:
    """Events where both strains vanish at one point of the meridian and of the curve, as at a pole, as one."""
    kept: list[ZoneEvent] = []
    for event in sorted(events, key=lambda e: e.point.sigma):
        for k, known in enumerate(kept):
            here = known.kind == event.kind and abs(known.s - event.s) <= 1e-6 and abs(known.point.sigma - event.point.sigma) <= 1e-9
            if here:
                kept[k].zone |= event.zone
                break
        else:
            kept.append(event)
    return kept
