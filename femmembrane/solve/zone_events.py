"""Where zones of wrinkles, or of taut membrane between them, appear and vanish along a branch of a tension field.

Zones are the parts of the meridian where the strains beyond natural width (g_1, g_2) have given signs. Along a branch their borders move
continuously, and their number changes only where g_1 or g_2 is zero at one of its extrema along the meridian, or at an end of it: there a
zone of no width opens or closes. That extreme value is a smooth function along the branch, negative on one side of the event and positive
on the other one, and its root is found as any other (:meth:`.Segment.root`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..discretization.strains import strained_at
from ..errors import SolveError
from ..potential import Array
from .segment import Located, Segment
from .state import State
from .wellposed import apparent
from .zone_strains import BITS, Runs, Strains

#: part of the change between neighbouring points by which an extremum may lie beyond the parabola through three of them
_BEYOND = 0.5
#: most points of a segment that are looked at to tell its events apart
_MOST_LOOKS = 24
#: how much smaller than those of all other zones the extreme strain of one must be for it to be the one that vanishes
_SINGLE = 0.25


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

    Where a state is slack, what a mesh shows depends on the mesh, and nothing is looked for.

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
    for component in (0, 1):
        if _alike(ends[0].screened[component], ends[1].screened[component]):
            continue
        if any(apparent(strains.potential, strains.evaluation) is not None for strains in ends):
            return []
        events += _Search(segment, own, component).events(ends)
    return _merged(events)


def _alike(a: Array, b: Array) -> bool:
    """Whether the strains at quadrature points show that no zone appears or vanishes between two states."""
    return bool(np.array_equal(_signs(a), _signs(b)) and not _doubtful(a) and not _doubtful(b))


def _signs(g: Array) -> Array:
    """Signs of the strains of the zones, one after the other."""
    negative = g < 0
    return negative[np.append(True, negative[1:] != negative[:-1])]


def _doubtful(g: Array) -> bool:
    """Whether an extremum between the points, or a value at an end, may have another sign than the points beside it."""
    steps = np.diff(g)
    sign = np.where(g < 0, -1.0, 1.0)
    rising, falling = steps[1:] * sign[1:-1], -steps[:-1] * sign[1:-1]  # both positive where |g| is least
    slack = _BEYOND * np.maximum(np.abs(rising), np.abs(falling))
    curved = np.maximum(rising + falling, 1e-300)
    beyond = (rising - falling) ** 2 / (8 * curved)
    inner = (rising >= 0) & (falling >= 0) & (np.abs(g[1:-1]) <= beyond + slack)
    outer = [abs(g[0]) <= (1 + _BEYOND) * abs(steps[0]), abs(g[-1]) <= (1 + _BEYOND) * abs(steps[-1])]
    return bool(inner.any() or any(outer))


class _Search:
    """The search for the events of one of the strains on a segment."""

    def __init__(self, segment: Segment[Any], own: Own, component: int) -> None:
        self.segment, self.own, self.component = segment, own, component
        self.looks = 0

    def strains(self, share: float) -> Strains:
        return self.of(self.segment.at(share))

    def of(self, point: Any) -> Strains:
        return Strains(self.own(point.state).evaluation)

    def events(self, ends: list[Strains]) -> list[ZoneEvent]:
        return self._between(0.0, ends[0].runs(self.component), 1.0, ends[1].runs(self.component))

    def _between(self, low: float, a: Runs, high: float, b: Runs) -> list[ZoneEvent]:
        """The events between two shares, in order."""
        if a.signs == b.signs:
            return []
        try:
            if (found := self._single(low, a, high, b)) is not None:
                return [found]
            self.looks += 1
            if self.looks > _MOST_LOOKS:
                return []
            middle = (low + high) / 2
            between = self.strains(middle).runs(self.component)
        except SolveError:  # the curve is not resolved there, as next to a crossing
            return []
        return self._between(low, a, middle, between) + self._between(middle, between, high, b)

    def _single(self, low: float, a: Runs, high: float, b: Runs) -> ZoneEvent | None:
        """The event, where one zone alone appears or vanishes between two shares and it is clear which; None where that is not so."""
        opens = len(b.signs) > len(a.signs)
        more, fewer = (b, a) if opens else (a, b)
        number = len(more.signs) - len(fewer.signs)
        if number == 1:
            first = more.signs[1:] == fewer.signs
            return self._at_end(low, high, opens, more.signs[0 if first else -1], first)
        if number != 2 or more.signs[0] != fewer.signs[0]:
            return None
        size = np.abs(more.peaks[1, 1:-1])
        k = 1 + int(np.argmin(size))
        if size.size > 1 and size[k - 1] > _SINGLE * np.partition(size, 1)[1]:
            return None
        return self._inside(low, high, opens, more.signs[k], float(more.peaks[0, k - 1]), float(more.peaks[0, k + 1]))

    def _at_end(self, low: float, high: float, opens: bool, negative: bool, first: bool) -> ZoneEvent | None:
        def value(point: Any) -> float:
            strains = self.of(point)
            return float(strains.at(np.array([strains.first if first else strains.last]))[self.component, 0])

        located = self._located(value, low, high, opens, negative)
        if located is None:
            return None
        strains = self.of(located.point)
        on_axis = strains.space.on_axis[0 if first else -1]
        return self._event(located, negative, strains, strains.first if first else strains.last, "pole" if on_axis else "rim")

    def _inside(self, low: float, high: float, opens: bool, negative: bool, left: float, right: float) -> ZoneEvent | None:
        def value(point: Any) -> float:
            return self.of(point).extreme(self.component, left, right, negative)[1]

        located = self._located(value, low, high, opens, negative)
        if located is None:
            return None
        strains = self.of(located.point)
        return self._event(located, negative, strains, strains.extreme(self.component, left, right, negative)[0], "inside")

    def _located(self, value: Callable[[Any], float], low: float, high: float, opens: bool, negative: bool) -> Located[Any] | None:
        """The root of the strain of a zone, or None where it does not change its sign as it should."""
        before, after = value(self.segment.at(low)), value(self.segment.at(high))
        if before * after >= 0 or (after < 0) != (opens == negative):
            return None
        return self.segment.root("zone_opens" if opens else "zone_closes", value, low, high)

    def _event(self, located: Located[Any], negative: bool, strains: Strains, s: float, place: str) -> ZoneEvent:
        at = strained_at(strains.space, strains.evaluation.x, np.array([s]))
        other = float(strains.at(np.array([s]))[1 - self.component, 0])
        zone = BITS[self.component] * negative + BITS[1 - self.component] * (other < 0)
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
