"""Strains beyond natural width along the meridian of a tension field, and the parts of it where they keep their signs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..discretization.strains import strained_at
from ..physics.kinematics import hencky_strains
from ..potential import Array, Evaluation

#: the strains along the meridian and around the axis
MERIDIAN, HOOP = 0, 1
#: bits that negative strains along the meridian and around the axis add to the number of a kind of zones
BITS = (2, 1)
#: points of each element at which strains are looked at; parts of an interval in which an extremum is closed in, and how often that is done
_SAMPLES, _PARTS, _ZOOMS = 9, 24, 2
#: part of an element next to a border that ends of elements follow, in which the sign of a strain is not looked at
_BESIDE = 0.3
#: strain over the largest one that is round-off
_ROUND_OFF = 1e-11


class Strains:
    """Strains beyond natural width in a state, along its meridian."""

    def __init__(self, evaluation: Evaluation) -> None:
        self.evaluation, self.potential = evaluation, evaluation.potential
        self.space = self.potential.space
        self.first, self.last = float(self.space.ends[0]), float(self.space.ends[-1])

    @property
    def screened(self) -> Array:
        """At the quadrature points in their order, shape (2, n)."""
        space = self.space
        u, u_x, _, w_x = space.displacement_at_quadrature(self.evaluation.x)
        with np.errstate(all="ignore"):
            e = hencky_strains(space.R, space.R_x, space.Z_x, u, u_x, w_x)
        return self._beyond(space.R, space.Z, space.s, *e).transpose(0, 2, 1).reshape(2, -1)

    def at(self, s: Array) -> Array:
        """At parameters s, shape (2, n)."""
        found = strained_at(self.space, self.evaluation.x, s)
        return self._beyond(found.R, found.Z, s, *found.strains)

    def _beyond(self, R: Array, Z: Array, s: Array, e1: Array, e2: Array) -> Array:
        response = self.potential.response_at(self.evaluation.x, R, Z, s, self.evaluation.factor)
        return np.stack(response.beyond(e1, e2))  # type: ignore[attr-defined]  # that of a tension field

    def runs(self, component: int) -> Runs:
        """The parts of the meridian where one of the strains keeps its sign, by its extrema to round-off."""
        ends = self.space.ends
        s = np.linspace(ends[:-1], np.append(np.nextafter(ends[1:-1], -np.inf), ends[-1]), _SAMPLES, axis=1).ravel()
        s = s[~self._beside_borders(s)]
        g = self.at(s)[component]
        least = _ROUND_OFF * float(np.abs(g).max(initial=0.0))
        away = np.where(g < 0, -g, g)
        negative = g < 0
        inner = (negative[1:-1] == negative[:-2]) & (negative[1:-1] == negative[2:])
        dips = np.flatnonzero(inner & (away[1:-1] <= away[:-2]) & (away[1:-1] <= away[2:])) + 1
        near = np.maximum(np.abs(np.diff(g))[dips - 1], np.abs(np.diff(g))[dips])
        extra = [self.extreme(component, float(s[k - 1]), float(s[k + 1]), g[k] >= 0) for k in dips[away[dips] <= near]]
        if extra:
            place, value = np.array(extra).T
            order = np.argsort(np.append(s, place), kind="stable")
            s, g = np.append(s, place)[order], np.append(g, value)[order]
        return Runs.of(s, np.where(np.abs(g) <= least, 0.0, g))

    def _beside_borders(self, s: Array) -> NDArray[np.bool_]:
        """Which places are so near to a border that ends of elements follow that the strain there has the sign that it has at them: it
        jumps at these ends, where its error is largest."""
        found, sizes = np.zeros(s.shape, dtype=bool), self.space.sizes
        for k, _ in self.potential.scene.borders:
            place = float(self.space.ends[k])
            found |= (s > place - _BESIDE * sizes[k - 1]) & (s < place + _BESIDE * sizes[k])
        return found

    def extreme(self, component: int, low: float, high: float, least: bool) -> tuple[float, float]:
        """Where one of the strains is least, or largest, between two places, and its value there."""
        ends = self.space.ends
        inner = ends[(ends > low) & (ends < high)]
        s = np.unique(np.concatenate([np.linspace(low, high, _PARTS + 1), inner, np.nextafter(inner, -np.inf)]))
        if inner.size > 2:  # a long way: as many points in each element
            s = np.unique(np.append(s, np.linspace(ends[:-1], ends[1:], _SAMPLES, axis=1).ravel()))
            s = s[(s >= low) & (s <= high)]
        for k in range(_ZOOMS + 1):
            g = self.at(s)[component] * (1.0 if least else -1.0)
            j = int(np.argmin(g))
            if k < _ZOOMS:
                s = np.linspace(s[max(j - 1, 0)], s[min(j + 1, s.size - 1)], _PARTS + 1)
        place, value = float(s[j]), float(g[j])
        if 0 < j < s.size - 1 and (curved := float(g[j + 1] - 2 * g[j] + g[j - 1])) > 0:
            shift = float(g[j - 1] - g[j + 1]) / (2 * curved)
            place, value = place + shift * float(s[j + 1] - s[j]), value - shift**2 * curved / 2
        return place, value if least else -value


@dataclass(frozen=True, eq=False)
class Runs:
    """Parts of the meridian where a strain keeps its sign.

    Attributes
    ----------
    signs : tuple of bool
        Whether it is negative in each.
    peaks : ndarray, shape (2, n)
        Where it is farthest from zero in each, and its value there.
    edges : ndarray, shape (n - 1,)
        Where one ends and the next begins, about.
    """

    signs: tuple[bool, ...]
    peaks: Array
    edges: Array

    @classmethod
    def of(cls, s: Array, g: Array) -> Runs:
        negative = g < 0
        starts = np.flatnonzero(np.append(True, negative[1:] != negative[:-1]))
        parts = zip(starts, np.append(starts[1:], g.size), strict=True)
        top = [a + int(np.argmax(np.abs(g[a:b]))) for a, b in parts]
        k = starts[1:]
        edges = s[k - 1] + (s[k] - s[k - 1]) * np.abs(g[k - 1]) / np.maximum(np.abs(g[k - 1]) + np.abs(g[k]), 1e-300)
        return cls(tuple(negative[starts].tolist()), np.array([s[top], g[top]]), edges)
