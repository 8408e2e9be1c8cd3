"""Wrinkling zones: where along the meridian the principal stresses are compressive (paper eqs. 46-56, figure 7).

::

    kind               s_11    s_22     wrinkles run
    taut               >= 0    >= 0     nowhere
    radial             >= 0    <  0     along meridians, as spokes
    circumferential    <  0    >= 0     along circles
    double             <  0    <  0     both ways; in a tension field: slack

The criterion says which stresses decide: "total" ones (the paper's) or the "mechanical" ones that the strain energy feels. In a tension
field the mechanical stress across wrinkles is exactly zero; there the strain beyond natural width has the sign that decides::

    g_1 = e_1 + max(e_2, 0)/2,      g_2 = e_2 + max(e_1, 0)/2

It vanishes where the membrane stops being taut, as the stress of the plain material does. (A compressible material has its own
natural width in place of -e/2.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..checks import choice
from ..discretization.space import Space, space_of_scene
from ..potential import potential_of
from ..results.branch import Branch
from ..results.equilibrium import Equilibrium
from ..results.other_mesh import on_mesh_of
from ..results.zones import KINDS, Zone, Zones, ZonesAlong
from ..scene import WRINKLING, Scene
from ..solve.end_strains import strains_at_ends
from ..solve.finer_space import confirmed
from ..solve.newton import NewtonResult
from .profile import profile_at

Array = NDArray[np.float64]

#: numbers that a compressive s_11 and a compressive s_22 add to the number of a kind
_BITS = (2, 1)
#: points at which the signs are looked at in each element, both ends included
_SAMPLES = 13
#: rounds of dividing an interval with a root, and parts each time; what is left is shorter than _SLIVER
_ROUNDS, _PARTS = 5, 32
#: number of ends of elements within a zone from which on it is believed without a finer mesh
_WIDE = 4
#: zones shorter than this part of the meridian are round-off of a border
_SLIVER = 1e-10

#: distance of a border from an end of elements, over the smaller element there, within which it may be at that end; and the distance that
#: is none, over the length of the meridian: what the energy decides changes by its third power
_BESIDE, _ON_END = 0.3, 1e-6

#: how often the line between two equilibria is halved to find where the kinds of zones change
_HALVINGS = 10

#: parameters of the meridian to the two stresses whose signs decide
_Stresses = Callable[[Array], tuple[Array, Array]]


def find_zones(scene: Scene, x: Array, pressure: float, criterion: str) -> Zones:
    """The zones of the state x under a pressure, with borders located inside the elements.

    Signs are looked at in 13 points of each element and borders found between them as roots: a zone thinner than about a tenth of an
    element may be missed. From degree 4 on stresses jump at the ends of elements, where they may then also change sign. Where a meridian
    bends sharply within an element its slopes overshoot: a zone of a few elements counts only if its stress is compressive in a finer
    space as well. The cost grows with the number of elements.

    Parameters
    ----------
    scene : Scene
    x : ndarray, shape (n_free,)
        Displacement coefficients.
    pressure : float
        P = p R0/(mu T); enters total stresses only.
    criterion : {"total", "mechanical"}

    Raises
    ------
    InputError
        For an unknown criterion.
    """
    choice("criterion", criterion, WRINKLING)

    deciding = _deciding(scene, x, pressure, criterion)
    codes, edges = _tiles(space_of_scene(scene), deciding)
    if any(codes):
        if scene.tension_field and criterion == "mechanical":
            codes, edges = _snapped(codes, edges, scene, x, pressure)
        codes, edges = _Check(scene, x, pressure, criterion).kept(codes, edges)
    area, deformed = _areas(scene, x, pressure, edges)
    ends = profile_at(scene, x, pressure, edges)
    r, rho, s = (list(zip(v[:-1].tolist(), v[1:].tolist(), strict=True)) for v in (ends.r, ends.rho, edges))
    parts = zip(codes, r, rho, area.tolist(), deformed.tolist(), s, strict=True)
    return Zones(criterion, tuple(Zone(KINDS[code], *rest) for code, *rest in parts))


def zones_along(branch: Branch) -> ZonesAlong:
    """The zones of all equilibria of a branch and, where their kinds change, of states between two of them."""
    landings = {id(jump.landing) for jump in branch.jumps}
    steps, zones, snaps = [0.0], [branch[0].zones()], set()
    for k, (a, b) in enumerate(pairwise(branch)):
        if id(b) in landings:
            snaps.add(len(zones))
        else:
            first = on_mesh_of(a.of_branch, b.of_branch) if a.of_branch.state.size != b.of_branch.state.size else a.of_branch
            for t, between in _changing(first or b.of_branch, b.of_branch, (0.0, a.zones()), (1.0, b.zones()), _HALVINGS):
                steps.append(k + t)
                zones.append(between)
        steps.append(k + 1.0)
        zones.append(b.zones())
    return ZonesAlong(np.array(steps), tuple(zones), frozenset(snaps))


def _changing(
    a: Equilibrium, b: Equilibrium, first: tuple[float, Zones], last: tuple[float, Zones], halvings: int
) -> list[tuple[float, Zones]]:
    """Zones of states on the straight line from a to b, closer and closer to where the kinds change; each with its place on the line, from
    0 to 1.
    """
    if first[1].kinds == last[1].kinds or not halvings:
        return []
    t = (first[0] + last[0]) / 2
    state, pressure = (1 - t) * a.state + t * b.state, (1 - t) * a.pressure + t * b.pressure
    middle = t, find_zones(a.scene, state, pressure, first[1].criterion)
    return [*_changing(a, b, first, middle, halvings - 1), middle, *_changing(a, b, middle, last, halvings - 1)]


def _deciding(scene: Scene, x: Array, pressure: float, criterion: str) -> _Stresses:
    def deciding(s: Array) -> tuple[Array, Array]:
        profile = profile_at(scene, x, pressure, s)
        return profile.total if criterion == "total" else profile.beyond or profile.effective

    return deciding


class _Check:
    """Which zones are the membrane's and which the mesh's."""

    def __init__(self, scene: Scene, x: Array, pressure: float, criterion: str) -> None:
        self.scene, self.x, self.pressure, self.criterion = scene, x, pressure, criterion
        self.ends = space_of_scene(scene).ends

    def kept(self, codes: list[int], edges: Array) -> tuple[list[int], Array]:
        """The zones without compressions that end within a few elements and are gone in a finer space."""
        codes = list(codes)
        for bit in _BITS:
            for first, last in _runs([bool(code & bit) for code in codes]):
                a, b = edges[first], edges[last + 1]
                if np.searchsorted(self.ends, b, "right") - np.searchsorted(self.ends, a, "left") > _WIDE:
                    continue  # as many elements do not err alike
                if not self._survives(_BITS.index(bit), a, b):
                    codes[first : last + 1] = [code & ~bit for code in codes[first : last + 1]]
        new = [k for k in range(len(codes)) if k == 0 or codes[k] != codes[k - 1]]
        return [codes[k] for k in new], np.append(edges[new], edges[-1])

    def _survives(self, component: int, a: float, b: float) -> bool:
        s = np.linspace(a, b, _SAMPLES + 2)
        s[-1] = np.nextafter(b, a)  # at the end of an element its own slopes

        def compressive(found: NewtonResult) -> bool:
            finer = found.evaluation.potential.scene
            return bool((_deciding(finer, found.evaluation.x, found.pressure, self.criterion)(s)[component] < 0).any())

        potential = potential_of(self.scene)
        return confirmed(compressive, potential, potential.evaluate(self.x, self.pressure), self.pressure) is not False


def _runs(flags: Sequence[bool]) -> list[tuple[int, int]]:
    """First and last place of each run of True."""
    starts = [k for k, flag in enumerate(flags) if flag and (k == 0 or not flags[k - 1])]
    stops = [k for k, flag in enumerate(flags) if flag and (k + 1 == len(flags) or not flags[k + 1])]
    return list(zip(starts, stops, strict=True))


def _tiles(space: Space, deciding: _Stresses) -> tuple[list[int], Array]:
    """Number of the kind of each zone, and the parameters at their ends, one more."""
    s = _samples(space)
    compressive = np.stack(deciding(s)) < 0
    start, end = s[[0, -1]].tolist()
    codes, starts = [int(np.dot(_BITS, compressive[:, 0]))], [start]
    for place, bit in _changes(s, compressive, deciding):
        code = codes[-1] ^ bit
        if place - starts[-1] <= _SLIVER * (end - start):
            codes[-1] = code
        elif end - place > _SLIVER * (end - start):
            codes.append(code)
            starts.append(place)
    new = [k for k in range(len(codes)) if k == 0 or codes[k] != codes[k - 1]]
    return [codes[k] for k in new], np.array([*(starts[k] for k in new), end])


def _snapped(codes: list[int], edges: Array, scene: Scene, x: Array, pressure: float) -> tuple[list[int], Array]:
    """Zones of a tension field with those borders put at ends of elements that are there by the forces.

    Strains, which are less exact than forces and jump at these ends, have their zeros beside them.
    """
    space = space_of_scene(scene)
    at = [int(np.abs(space.ends - edge).argmin()) for edge in edges[1:-1]]
    inner = list(zip(at, edges[1:-1], strict=True))
    near = [0 < k < space.n_elements and abs(space.ends[k] - edge) < _BESIDE * _smaller(space, k) for k, edge in inner]
    if not any(near):
        return codes, edges
    there = ends_on_borders(scene, x, pressure)
    places = [float(space.ends[k] if close and k in there else edge) for (k, edge), close in zip(inner, near, strict=True)]
    kept: list[tuple[int, float]] = [(codes[0], float(edges[0]))]
    for code, place in zip(codes[1:], places, strict=True):
        if place <= kept[-1][1]:
            kept.pop()
        if not kept or kept[-1][0] != code:
            kept.append((code, place))
    return [code for code, _ in kept], np.array([*(place for _, place in kept), edges[-1]])


def on_its_borders(scene: Scene, x: Array, pressure: float) -> bool:
    """Whether every border of a zone of a tension field is an end of elements."""
    zones = find_zones(scene, x, pressure, "mechanical")
    return bool(np.isin([zone.s[1] for zone in zones[:-1]], space_of_scene(scene).ends).all())


def ends_on_borders(scene: Scene, x: Array, pressure: float) -> frozenset[int]:
    """The inner ends of elements, by number, at which a zone of a tension field begins or ends by the forces there."""
    potential = potential_of(scene)
    space = potential.space
    strains = strains_at_ends(potential, potential.evaluate(x, pressure), pressure)
    middle = np.stack(profile_at(scene, x, pressure, (space.ends[1:] + space.ends[:-1]) / 2).beyond or ())
    with np.errstate(all="ignore"):
        value = (strains[:, 1, :-1] + strains[:, 0, 1:]) / 2
        slope = np.maximum(np.abs(middle[:, :-1] - value) / space.sizes[:-1], np.abs(middle[:, 1:] - value) / space.sizes[1:]) * 2
        found = np.abs(value) <= _ON_END * (space.ends[-1] - space.ends[0]) * slope
    return frozenset((np.flatnonzero(found.any(axis=0)) + 1).tolist())


def _smaller(space: Space, k: int) -> float:
    """Size of the smaller of the elements that meet at an inner end."""
    return float(min(space.sizes[k - 1], space.sizes[k]))


def _changes(s: Array, compressive: NDArray[np.bool_], deciding: _Stresses) -> list[tuple[float, int]]:
    """Where a stress changes sign between samples, in order, with the bit of that stress."""
    which, left = np.nonzero(compressive[:, 1:] != compressive[:, :-1])
    if not which.size:
        return []
    places = s[left + 1]  # where two elements meet nothing lies between the samples
    inside = (left + 1) % _SAMPLES != 0
    negative = compressive[which, left]
    if inside.any():
        places[inside] = _roots(deciding, which[inside], s[left][inside], s[left + 1][inside], negative[inside])
    return sorted(zip(places.tolist(), np.take(_BITS, which).tolist(), strict=True))


def _roots(deciding: _Stresses, which: NDArray[np.int64], a: Array, b: Array, negative: NDArray[np.bool_]) -> Array:
    """Roots of the stresses ``which`` between a and b, ``negative`` telling their signs at a.

    A single point costs as much as hundreds at once. So all intervals are narrowed together, and the last step is a secant.
    """
    column = np.arange(a.size)
    for _ in range(_ROUNDS):
        s = np.linspace(a, b, _PARTS + 1)
        values = np.stack(deciding(s.ravel())).reshape(2, *s.shape)[which, :, column].T
        # the signs at a and b are known: evaluated again, a zero there may come out with the opposite sign
        other = (values[1:] < 0) != negative
        other[-1] = True
        k = np.argmax(other, axis=0)
        a, b, at_a, at_b = s[k, column], s[k + 1, column], values[k, column], values[k + 1, column]
    share = np.divide(at_a, at_a - at_b, out=np.zeros_like(a), where=at_a != at_b)
    return a + np.clip(share, 0, 1) * (b - a)


def _samples(space: Space) -> Array:
    """Increasing parameters, the same number in each element; the last one of an element is the last number before its end."""
    last = np.append(np.nextafter(space.ends[1:-1], -np.inf), space.ends[-1])
    return np.linspace(space.ends[:-1], last, _SAMPLES, axis=1).ravel()


def _areas(scene: Scene, x: Array, pressure: float, edges: Array) -> tuple[Array, Array]:
    """Parts of the reference and of the deformed area between neighbouring edges, each of shape (len(edges) - 1,)."""
    space = space_of_scene(scene)
    ends = np.union1d(space.ends, edges)
    points, weights = np.polynomial.legendre.leggauss(space.degree + 3)
    s = ends[:-1, None] + np.diff(ends)[:, None] * (points + 1) / 2
    profile = profile_at(scene, x, pressure, s.ravel())
    area = profile.r * np.hypot(*space.mesh.tangent(s.ravel())) * (np.diff(ends)[:, None] * weights).ravel()
    zone = np.searchsorted(edges[1:-1], s.ravel())
    fractions = []
    for density in (area, area * np.exp(profile.strain[0] + profile.strain[1])):
        parts = np.bincount(zone, density, edges.size - 1)
        fractions.append(parts / parts.sum())
    return fractions[0], fractions[1]
