"""Which special points of the scenes of a sweep are the same: followed from scene to scene over the grid.

The places of special points along a branch say little. When two of them are born between the first and the second, the second becomes the
fourth. What does not change is their order: on a branch that moves with a number of its scene, two special points cannot pass each other.
They come and go in neighbouring pairs, a maximum with a minimum, or through an end of the branch. So the points of two neighbouring scenes
are aligned like two words: matches keep the order and join maxima with maxima, a pair or an end takes what is left, and the alignment that
costs least is taken. A match costs the distance between its points, and whatever comes or goes costs how far it is from its partner, or
from the end, beside a constant.

A match that another alignment nearly as cheap lacks is not sure, and joins nothing. The others join points in the order of their distances.
A point that comes back on a way round a swallowtail as another one of the same scene is not joined to itself: there the numbers are cut.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..quantities import PLACES, quantity

Array = NDArray[np.float64]

#: cost of a point that comes or goes, beside how far it is from its partner or the end: in ranges of the points over the sweep
_EVENT = 0.5
#: an alignment without a match has to cost this part of the distance of the match more, or the match is not sure
_SURE = 0.3
#: families of special points, and the place that is stationary there
FAMILIES: Mapping[str, str] = {"limit_": "pressure", "fold_": "volume", "onset_": ""}
_WORDS = {"limit_": "limit points", "fold_": "volume folds", "onset_": "onsets"}
#: numbers that a summary names
_SAID = 4
#: what a number says that is none
NOT_SURE = 0.0

_Point = tuple[int, int]


@dataclass(frozen=True)
class Followed:
    """Special points of one kind, followed over the grid of a sweep.

    Attributes
    ----------
    identity : ndarray, shape of the grid and the points of a scene
        A number from 1 on, which scenes share; 0 of a point that no scene beside surely has, NaN where there is no point.
    cut : ndarray of bool, the same shape
        Whether the point has another number in a neighbouring scene, as it comes back as another one on a way round.
    """

    identity: Array
    cut: NDArray[np.bool_]

    @property
    def count(self) -> int:
        """How many numbers there are."""
        known = self.identity[np.isfinite(self.identity)]
        return int(known.max()) if known.size else 0


def followed(data: Any, dims: Sequence[str], tag: str) -> Followed:
    """Follow the points of a family over the data set of a sweep.

    Parameters
    ----------
    data : xarray.Dataset
    dims : sequence of str
        The keys of the sweep.
    tag : str
        One of :data:`FAMILIES`.
    """
    grid = tuple(data[name].size for name in dims)
    places = np.stack([data[f"{tag}{name}"].values for name in PLACES], axis=-1)
    shape = places.shape[:-1]
    scenes = _scenes(data, tag, places.reshape(-1, *places.shape[-2:]), len(grid))
    joined = _joined(scenes, _neighbours(data, dims, grid, [scene is not None for scene in scenes]))
    identity, cut = np.full((len(scenes), shape[-1]), np.nan), np.zeros((len(scenes), shape[-1]), dtype=bool)
    for (scene, point), number in joined.numbers(scenes).items():
        identity[scene, point] = number
    for scene, point in joined.cut:
        cut[scene, point] = True
    return Followed(identity.reshape(shape), cut.reshape(shape))


def with_identities(data: Any, dims: Sequence[str]) -> Any:
    """The data set of a sweep with the numbers of its special points, ``limit_identity`` and so on, as far as it has such points.

    Parameters
    ----------
    data : xarray.Dataset
    dims : sequence of str
        The keys of the sweep.
    """
    found = {}
    for tag in FAMILIES:
        name = f"{tag}{PLACES[0]}"
        if (
            f"{tag}identity" in data
            or name not in data
            or not data[name].size
            or data[name].ndim == len(dims)
            or any(place not in data for place in PLACES)
        ):
            continue
        points = followed(data, dims, tag)
        for what, values in (("identity", points.identity), ("cut", np.where(np.isnan(points.identity), np.nan, points.cut))):
            about = {"long_name": quantity(f"{tag}{what}").meaning, "units": "1"}
            found[f"{tag}{what}"] = (data[name].dims, values, about)
    return data.assign(found)


def numbered_in_words(data: Any) -> Iterator[str]:
    """A line for each family of special points: in how many scenes the first numbers are, and what is not sure."""
    for tag, words in _WORDS.items():
        if f"{tag}identity" not in data:
            continue
        identity, cut = data[f"{tag}identity"].values, int(np.nansum(data[f"{tag}cut"].values))
        numbers, counts = np.unique(identity[identity > NOT_SURE], return_counts=True)
        shown = ", ".join(f"#{int(n)} in {c}" for n, c in list(zip(numbers, counts, strict=True))[:_SAID])
        further = f", {len(numbers) - _SAID} more" if len(numbers) > _SAID else ""
        unsure = int((identity == NOT_SURE).sum())
        doubts = [f"{unsure} not followed from a neighbour"] if unsure else []
        doubts += [f"{cut} with another number in a neighbouring scene"] if cut else []
        yield f"{words} followed from scene to scene: {'; '.join(filter(None, [f'{shown}{further}', *doubts]))}"


@dataclass(frozen=True)
class _Scene:
    """The points of a scene in the order of its branch.

    Attributes
    ----------
    places : ndarray, shape (n, 3)
        Where they are, in ranges of all points of the sweep.
    along : ndarray, shape (n,)
        Arc length of the branch up to them, in the same ranges.
    length : float
        That of the whole branch.
    kinds : ndarray, shape (n,)
        1 for a maximum, -1 for a minimum, 0 where that is not known. Of an onset the number of waves.
    finished : bool
        Whether the branch was followed to its end.
    """

    places: Array
    along: Array
    length: float
    kinds: Array
    finished: bool

    def __len__(self) -> int:
        return len(self.along)


def _scenes(data: Any, tag: str, places: Array, dimensions: int) -> list[_Scene | None]:
    """The points of each scene; None of a scene without a branch."""
    steps = np.stack([data[name].values for name in PLACES], axis=-1)
    steps = steps.reshape(-1, *steps.shape[dimensions:])
    finished = data["status"].values.ravel() == "converged"
    waves = data["onset_waves"].values.reshape(len(places), -1) if tag == "onset_" else None
    scale = _ranges(places, steps)
    found: list[_Scene | None] = []
    for k in range(len(places)):
        branch = steps[k][np.isfinite(steps[k]).all(axis=1)]
        if not len(branch):
            found.append(None)
            continue
        points = places[k][np.isfinite(places[k]).all(axis=1)]
        scene = _scene(points / scale, branch / scale, FAMILIES[tag], bool(finished[k]))
        found.append(scene if waves is None else _Scene(scene.places, scene.along, scene.length, waves[k, : len(points)], scene.finished))
    return found


def _ranges(places: Array, steps: Array) -> Array:
    """How far the points lie apart in each place over the sweep, without the tenth that lies furthest out."""
    points = places.reshape(-1, len(PLACES))
    points = points[np.isfinite(points).all(axis=1)]
    branches = steps.reshape(-1, len(PLACES))
    branches = branches[np.isfinite(branches).all(axis=1)]
    whole = np.ptp(branches, axis=0) if len(branches) else np.ones(len(PLACES))
    spread = np.subtract(*np.quantile(points, [0.95, 0.05], axis=0)) if len(points) else whole
    found = np.maximum(spread, 0.02 * whole)
    return np.where(found > 0, found, 1.0)


def _scene(points: Array, branch: Array, stationary: str, finished: bool) -> _Scene:
    """Points that are in the order of a branch, each between the steps for which the way over it is the smallest detour."""
    chords = np.linalg.norm(np.diff(branch, axis=0), axis=1)
    start = np.concatenate([[0.0], np.cumsum(chords)])
    along, gaps = np.zeros(len(points)), np.zeros(len(points), dtype=int)
    first = 0
    for k, point in enumerate(points):
        if not len(chords):
            break
        ways = np.linalg.norm(branch[first:] - point, axis=1)
        first += int(np.argmin(ways[:-1] + ways[1:] - chords[first:]))
        before, after = np.linalg.norm(branch[[first, first + 1]] - point, axis=1)
        gaps[k], along[k] = first, start[first] + chords[first] * before / max(before + after, 1e-300)
    along = np.maximum.accumulate(along)
    kinds = np.zeros(len(points))
    if stationary and len(chords):
        place = PLACES.index(stationary)
        kinds = _extrema(points[:, place], branch[:, place], gaps)
    return _Scene(points, along, float(start[-1]), kinds, finished)


def _extrema(values: Array, steps: Array, gaps: NDArray[np.int64]) -> Array:
    """Whether a place is largest (1) or smallest (-1) at the points, among the steps and points beside them; 0 where it is neither."""
    kinds = np.zeros(len(values))
    for k, value in enumerate(values):
        before = values[k - 1] if k and gaps[k - 1] == gaps[k] else steps[gaps[k]]
        after = values[k + 1] if k + 1 < len(values) and gaps[k + 1] == gaps[k] else steps[gaps[k] + 1]
        slopes = np.sign([value - before, value - after])
        kinds[k] = slopes[0] if slopes[0] == slopes[1] else slopes.sum() if 0 in slopes else 0.0
    return kinds


def _neighbours(data: Any, dims: Sequence[str], grid: tuple[int, ...], known: Sequence[bool]) -> Iterator[tuple[int, int]]:
    """Pairs of scenes beside each other along a key, over scenes without a branch. Texts are beside each other as they were given."""
    places = np.arange(int(np.prod(grid))).reshape(grid)
    for axis, name in enumerate(dims):
        values = data[name].values
        order = np.argsort(values) if values.dtype.kind in "if" else np.arange(len(values))
        for line in np.moveaxis(places, axis, -1).reshape(-1, len(values))[:, order]:
            kept = [int(k) for k in line if known[k]]
            yield from pairwise(kept)


# --- two scenes


@dataclass(frozen=True)
class _Match:
    """Point i of one scene is point j of the other."""

    i: int
    j: int
    distance: float
    sure: bool


def aligned(a: _Scene, b: _Scene) -> list[_Match]:
    """The matches of the cheapest alignment of two scenes."""
    if (near := _each_near(a, b)) is not None:
        return near
    distances = np.linalg.norm(a.places[:, None] - b.places[None], axis=2) if len(a) and len(b) else np.zeros((len(a), len(b)))
    allowed = (a.kinds[:, None] == b.kinds[None]) | (a.kinds[:, None] == 0) | (b.kinds[None] == 0)
    ways = _Ways(np.where(allowed, distances, np.inf), _leaving(a, b), _leaving(b, a))
    cost, pairs = ways.cheapest()
    found = []
    for i, j in pairs:
        other = ways.without(i, j).cheapest()[0]
        found.append(_Match(i, j, float(distances[i, j]), other - cost > _SURE * distances[i, j]))
    return found


def _each_near(a: _Scene, b: _Scene) -> list[_Match] | None:
    """The matches of scenes with as many points, of the same kinds, each so near to its match that no other alignment can be as cheap: one
    that lacks a match has a point of each scene that comes or goes.
    """
    if len(a) != len(b) or not (a.finished and b.finished) or not np.array_equal(a.kinds, b.kinds):
        return None
    distances = np.linalg.norm(a.places - b.places, axis=1)
    if distances.sum() + _SURE * distances.max() >= 2 * _EVENT:
        return None
    return [_Match(k, k, float(distance), True) for k, distance in enumerate(distances)]


@dataclass(frozen=True)
class _Leaving:
    """What it costs that points of a scene have no match in another one.

    Attributes
    ----------
    start, end : ndarray, shape (n + 1,)
        That the first k go through the start of the branch; that those from k on go through its end.
    pair : ndarray, shape (n + 1,)
        That k - 2 and k - 1 go together.
    """

    start: Array
    end: Array
    pair: Array


def _leaving(scene: _Scene, other: _Scene) -> _Leaving:
    n = len(scene)
    beyond = np.zeros(n, dtype=bool) if other.finished else scene.along > 0.9 * other.length  # the other branch ended before it came there
    start, end = _EVENT + scene.along, np.where(beyond, 0.0, _EVENT + np.maximum(scene.length - scene.along, 0.0))
    pair = np.full(n + 1, np.inf)
    if n > 1:
        opposed = (scene.kinds[:-1] * scene.kinds[1:] <= 0) | (np.abs(scene.kinds[:-1]) > 1) | (np.abs(scene.kinds[1:]) > 1)
        pair[2:] = np.where(opposed, _EVENT + np.diff(scene.along), np.inf)
    return _Leaving(np.concatenate([[0.0], np.cumsum(start)]), np.concatenate([np.cumsum(end[::-1])[::-1], [0.0]]), pair)


@dataclass(frozen=True)
class _Ways:
    """All alignments of two sequences of points."""

    match: Array
    a: _Leaving
    b: _Leaving

    def without(self, i: int, j: int) -> _Ways:
        match = self.match.copy()
        match[i, j] = np.inf
        return _Ways(match, self.a, self.b)

    def cheapest(self) -> tuple[float, list[_Point]]:
        """The cost of the cheapest alignment, and its matches."""
        m, n = self.match.shape
        cost = (self.a.start[:, None] + self.b.start[None]).tolist()
        step: list[list[_Point]] = [[(0, 0)] * (n + 1) for _ in range(m + 1)]
        match, pair_a, pair_b = self.match.tolist(), self.a.pair.tolist(), self.b.pair.tolist()
        for i in range(m + 1):
            for j in range(n + 1):
                best, way = cost[i][j], (0, 0)
                if i and j and cost[i - 1][j - 1] + match[i - 1][j - 1] < best:
                    best, way = cost[i - 1][j - 1] + match[i - 1][j - 1], (1, 1)
                if i > 1 and cost[i - 2][j] + pair_a[i] < best:
                    best, way = cost[i - 2][j] + pair_a[i], (2, 0)
                if j > 1 and cost[i][j - 2] + pair_b[j] < best:
                    best, way = cost[i][j - 2] + pair_b[j], (0, 2)
                cost[i][j], step[i][j] = best, way
        whole = np.array(cost) + self.a.end[:, None] + self.b.end[None]
        i, j = (int(k) for k in np.unravel_index(int(np.argmin(whole)), whole.shape))
        least, matches = float(whole[i, j]), []
        while (way := step[i][j]) != (0, 0):
            if way == (1, 1):
                matches.append((i - 1, j - 1))
            i, j = i - way[0], j - way[1]
        return least, matches[::-1]


# --- the grid


@dataclass
class _Joined:
    """Points that are the same, as a forest in which each leads to another of its tree."""

    above: dict[_Point, _Point] = field(default_factory=dict)
    scenes: dict[_Point, set[int]] = field(default_factory=dict)
    members: dict[_Point, list[_Point]] = field(default_factory=dict)
    cut: set[_Point] = field(default_factory=set)
    unsure: list[tuple[_Point, _Point]] = field(default_factory=list)

    def add(self, point: _Point) -> None:
        self.above[point], self.scenes[point], self.members[point] = point, {point[0]}, [point]

    def root(self, point: _Point) -> _Point:
        while self.above[point] != point:
            self.above[point] = self.above[self.above[point]]
            point = self.above[point]
        return point

    def join(self, a: _Point, b: _Point) -> None:
        """Make two points one, unless both are already there in one scene as two."""
        p, q = self.root(a), self.root(b)
        if p == q:
            return
        if len(self.members[p]) < len(self.members[q]):
            p, q = q, p
        if not self.scenes[p].isdisjoint(self.scenes[q]):
            self.cut |= {a, b}
            return
        self.above[q] = p
        self.scenes[p] |= self.scenes.pop(q)
        self.members[p] += self.members.pop(q)

    def numbers(self, scenes: Sequence[_Scene | None]) -> dict[_Point, float]:
        """The number of each point: 1 for what most scenes have, of equals what comes first along the branch.

        What only a match that is not sure joins to a larger one has none, and what one scene of several has alone.
        """
        alone = sum(scene is not None for scene in scenes) > 1
        lost = {root for root, members in self.members.items() if alone and len(members) == 1}
        for a, b in self.unsure:
            p, q = self.root(a), self.root(b)
            if p != q:
                lost.add(min(p, q, key=lambda root: (len(self.members[root]), root)))
        order = sorted(self.members, key=lambda root: (root in lost, -len(self.members[root]), self._place(root)))
        return {point: NOT_SURE if root in lost else float(number) for number, root in enumerate(order, 1) for point in self.members[root]}

    def _place(self, root: _Point) -> float:
        return float(np.mean([point for _, point in self.members[root]]))


def _joined(scenes: Sequence[_Scene | None], neighbours: Iterator[tuple[int, int]]) -> _Joined:
    joined = _Joined()
    for k, scene in enumerate(scenes):
        for point in range(0 if scene is None else len(scene)):
            joined.add((k, point))
    found = []
    for k, other in neighbours:
        a, b = scenes[k], scenes[other]
        if a is not None and b is not None and len(a) and len(b):
            found += [(match, (k, match.i), (other, match.j)) for match in aligned(a, b)]
    for _, a_point, b_point in sorted((f for f in found if f[0].sure), key=lambda f: (f[0].distance, f[1], f[2])):
        joined.join(a_point, b_point)
    joined.unsure = [(a_point, b_point) for match, a_point, b_point in found if not match.sure]
    return joined
