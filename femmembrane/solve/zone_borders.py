"""An equilibrium of a tension field with elements that end where zones of wrinkles begin and end.

The relaxed energy is smooth on both sides of the border of a zone, and its second derivative jumps there. A border inside an element costs
digits at any degree; where it is an end of elements, errors fall as for a smooth problem. So the ends are moved to the borders, and the
equilibrium is corrected there under the same control, until neither moves. An end that misses its border by d adds an error of order d^3 to
what the energy decides: the strains are off by d along a length of d.

Where a border is, the strain across beyond natural width is zero. That strain follows from the forces at the end
(:mod:`.end_strains`), so that borders are exact to the same order as energies. Its zero is found by secants. Errors of borders reach each
other through the equilibrium alone, as squares, so that each border has secants of its own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from ..discretization.meridian import assigned_ends
from ..discretization.space import transferred
from ..errors import InputError, Status
from ..potential import Array, Potential
from .active_set import Once, on_borders
from .controls import Control
from .end_strains import strains_at_ends
from .zone_strains import HOOP, MERIDIAN, Strains

if TYPE_CHECKING:
    from ..potential.following import Mark, WrinklingPotential
    from .newton import NewtonResult

#: a move after which borders are at rest, over the length of the meridian: the next one would be smaller by some orders
_ARRIVED = 1e-8
#: most rounds of moving the ends, and most times that the zones themselves are looked for anew
ROUNDS, FRESH = 8, 3
#: zones narrower than this part of the meridian are left out, which changes the energy by its third power
_NARROW = 1e-5
#: distance of a border from an end that stays, over the length of the meridian, that is none
_THERE = 1e-9


def settled_zones(once: Once, patient: Once, control: Control, potential: Potential, x: Array, pressure: float) -> NewtonResult:
    """Where a corrector ends with ends of elements at the borders of zones.

    Where there are none, or more than the elements can follow, it is the equilibrium on the mesh of the scene.

    Parameters
    ----------
    once, patient : callable
        The corrector on a given mesh, and one for worse guesses.
    control : Control
        Of coefficients on the mesh of the scene.
    potential : Potential
    x, pressure : ndarray, float
        Guess.
    """
    given = cast("WrinklingPotential", potential)
    root, x = given.root, given.carried(np.ascontiguousarray(x, dtype=float))
    result = once(root, control=control, x=x, pressure=pressure)
    if result.status is not Status.CONVERGED:  # the guess was interpolated from elements whose kinks are elsewhere
        result = patient(root, control=control, x=x, pressure=pressure)
    if result.status is not Status.CONVERGED:
        return result
    followed = _with_borders(once, control, result, given.mark)
    if followed is None:
        return result
    followed.x = followed.evaluation.carried(followed.x)
    return followed


def _with_borders(once: Once, control: Control, result: NewtonResult, mark: Mark | None) -> NewtonResult | None:
    """The equilibrium with ends of elements at the borders of its zones; None where it has none, or they are not found."""
    spent = result.iterations
    for _ in range(FRESH):
        borders = ZoneBorders.of(Strains(result.evaluation), mark)
        if borders is None:
            return None
        while True:
            found = _solved(once, control, result, borders)
            if found is None:
                return None
            spent, result = spent + found.iterations, found
            if borders.at_rest:
                break
            if borders.rounds == ROUNDS or not borders.move(result):
                return None
        if mark is not None or borders.explain(result):
            result.iterations = spent
            return result
    return None


def _solved(once: Once, control: Control, result: NewtonResult, borders: ZoneBorders) -> NewtonResult | None:
    """The equilibrium on elements that end at borders; None where the mesh has too few, or none is found."""
    before = cast("WrinklingPotential", result.evaluation.potential)
    space = before.root.space
    try:
        pairs = assigned_ends(space.ends, borders.ends, np.flatnonzero(~space.movable).tolist())
    except InputError:
        return None
    there = before.bordered(pairs)
    x = transferred(before.space, result.evaluation.x, there.space)
    with np.errstate(all="ignore"):  # a state may be out of reach; it then does not converge
        found = once(there, control=on_borders(control, there), x=x, pressure=result.pressure)
    return found if found.status is Status.CONVERGED else None


class ZoneBorders:
    """The borders of the zones of a state while they are moved to where its hoop strain beyond natural width is zero.

    Attributes
    ----------
    places : ndarray
        Where they are along the meridian.
    free : ndarray of bool
        Which of them are not at an end of elements that stays, as at a jump of the thickness.
    wrinkled : bool
        Whether the first zone is wrinkled; then they are so in turn.
    length : float
        Of the meridian.
    rounds : int
        How often they were moved.
    at_rest : bool
    mark : Mark or None
        Where elements end besides.
    """

    def __init__(self, places: Array, free: NDArray[np.bool_], wrinkled: bool, length: float, mark: Mark | None = None) -> None:
        self.places, self.free, self.wrinkled, self.length, self.mark = places, free, wrinkled, length, mark
        self.rounds, self.at_rest = 0, not free.any()
        self._before: tuple[Array, Array] | None = None

    @classmethod
    def of(cls, strains: Strains, mark: Mark | None = None) -> ZoneBorders | None:
        """Those of a state, without zones that are too narrow to count; None without borders, and where the membrane is slack.

        A zone that is marked is as good as none.
        """
        screened = strains.screened
        if (screened[MERIDIAN] < 0).any():
            return None
        runs, length = strains.runs(HOOP), strains.last - strains.first
        edges, first = runs.edges, 0
        if mark is not None:
            within = (edges > mark.low) & (edges < mark.high)
            first = int(within.sum()) if mark.low <= strains.first else 0
            edges = edges[~within]
        starts, signs = [strains.first], [runs.signs[first]]
        for k, place in enumerate(edges.tolist()):
            sign = signs[0] ^ (k % 2 == 0)
            if place - starts[-1] <= _NARROW * length:  # the zone before is too narrow
                signs[-1] = sign
            else:
                starts.append(place)
                signs.append(sign)
        if len(starts) > 1 and strains.last - starts[-1] <= _NARROW * length:
            starts.pop()
            signs.pop()
        kept = [k for k in range(1, len(starts)) if signs[k] != signs[k - 1]]
        if not kept and mark is None:
            return None
        places, stay = np.array(starts)[kept], strains.space.ends[~strains.space.movable]
        free = np.abs(places[:, None] - stay).min(axis=1) > _THERE * length
        return cls(places, free, signs[0], length, mark)

    @property
    def ends(self) -> Array:
        """The places to which ends of elements are moved."""
        own = self.places[self.free]
        return own if self.mark is None else np.sort(np.append(own, self.mark.place))

    def move(self, result: NewtonResult) -> bool:
        """Move the free ones towards where their strains are zero; whether that could be done."""
        self.rounds += 1
        evaluation, free = result.evaluation, np.flatnonzero(self.free)
        space, places = evaluation.potential.space, self.places[free]
        at = np.array([int(np.abs(space.ends - place).argmin()) for place in places])
        beyond = strains_at_ends(evaluation.potential, evaluation, result.pressure)[HOOP]
        values = (beyond[1, at - 1] + beyond[0, at]) / 2  # they agree to the order of the forces
        slopes = self._slopes(Strains(evaluation), at, values, beyond)
        if self._before is not None:
            old_places, old = self._before
            moved = np.abs(places - old_places) > 0
            secant = np.divide(values - old, places - old_places, out=slopes.copy(), where=moved)
            slopes = np.where(secant * slopes > 0, secant, slopes)  # one of the wrong sign is round-off
        self._before = places, values
        nearest = np.minimum(space.sizes[at - 1], space.sizes[at])
        with np.errstate(all="ignore"):
            step = np.clip(-values / slopes, -nearest / 2, nearest / 2)
        self.places = self.places.copy()
        self.places[free] = places + step
        largest = float(np.abs(step).max())
        self.at_rest = largest <= _ARRIVED * self.length
        return bool(np.isfinite(largest) and (np.diff(self.places) > 0).all())

    def _slopes(self, strains: Strains, at: NDArray[np.int64], values: Array, beyond: Array) -> Array:
        """Of the strains at the free borders, each on the side on which its zone still goes on: by a parabola over the element there."""
        space = strains.space
        wrinkled_before = self.wrinkled ^ (np.flatnonzero(self.free) % 2 == 1)
        back = wrinkled_before == (values < 0)
        element = np.where(back, at - 1, at)
        size = np.where(back, -1.0, 1.0) * space.sizes[element]  # the way from the border to the other end of that element
        middle = strains.at(space.ends[at] + size / 2)[HOOP]
        other = beyond[np.where(back, 0, 1), element]
        straight = (middle - values) / (size / 2)
        curved = (4 * middle - 3 * values - other) / size
        return np.where(curved * straight > 0, curved, straight)  # on the axis the strain is no number

    def explain(self, result: NewtonResult) -> bool:
        """Whether in the middle of each element the membrane is what the zones say."""
        strains = Strains(result.evaluation)
        middles = (strains.space.ends[1:] + strains.space.ends[:-1]) / 2
        wrinkled = self.wrinkled ^ (np.searchsorted(self.places, middles) % 2 == 1)
        return bool(((strains.at(middles)[HOOP] < 0) == wrinkled).all())
