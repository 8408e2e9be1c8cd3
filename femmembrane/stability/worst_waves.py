"""Which number of waves around the axis has the lowest eigenvalue: all that can are looked at, up to a limit that follows from the state.

Waves with the wave numbers k_1 and k_2 = n/rho, short beside all else, cost per reference area and over w^2/2 ::

    f = s_1 k_1^2 + s_2 k_2^2 + d_11 k_1^4 + (2 d_12 + d_66) k_1^2 k_2^2 + d_22 k_2^4 - g

with the stresses s_i that support the sheet, the stiffness d_ij of :mod:`.bending`, and g, which bounds what the position alone can gain:
the curvature of the field's energy, the pressure on a curved surface, |P| l1 l2 (|kappa_1| + |kappa_2|), and the waves in the plane that
the pressure drives, (P l1 l2)^2/(4 A). The term of k_1^4 at its worst is worth s_1^2/(4 d_11) where s_1 < 0, so that f > L, an eigenvalue
over the mass t, wherever ::

    d_22 k_2^4 - max(-s_2, 0) k_2^2 > g + L t + s_1^2/(4 d_11),        or without bending    s_2 k_2^2 > g + L t

So no n beyond the largest rho k_2 over the membrane has an eigenvalue below L. The numbers up to there are searched: the first ones all,
others in steps of a few per cent, between which eigenvalues change little, and around the lowest every one. By inertia it is counted at
each whether an eigenvalue lies below the lowest that was found; if so it becomes the lowest.
"""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING, cast

import numpy as np

from ..physics.loads import over_projection
from ..potential import Array, Evaluation, Potential
from ..results.contact import contact_of
from ..scene import MAX_WAVES
from .acoustic import supporting_all
from .azimuthal_operator import azimuthal_operator
from .bending import BendingForm, bending_form
from .second_variation import response_at_quadrature
from .spectrum import Pencil, SmallestEigenvalue, smallest_of

if TYPE_CHECKING:
    from ..potential.contact import ContactEvaluation

#: numbers of waves that are all looked at, and the steps beyond them: of the first search, and of the count
_FIRST, _COARSE, _FINE = 8, 1.25, 1.04
#: relative difference of two eigenvalues below which they count as one
_EQUAL = 1e-9


def worst_waves(potential: Potential, x: Array, pressure: float, evaluation: Evaluation) -> tuple[int, int]:
    """The n >= 1 whose smallest eigenvalue is the lowest found, and the limit up to which n can matter."""
    search = _Search(potential, x, pressure)
    least, limit = 0.0, _limit(potential, x, pressure, evaluation, 0.0)
    while True:  # a positive eigenvalue may be undercut by waves that are shorter than any unstable ones
        best = search.lowest(limit)
        raised = max(best.value, 0.0)
        if raised <= least:
            return search.waves_of(best), limit
        least, limit = raised, max(limit, _limit(potential, x, pressure, evaluation, raised))


class _Search:
    """The smallest eigenvalues of one state by their number of waves."""

    def __init__(self, potential: Potential, x: Array, pressure: float) -> None:
        self._state = potential, x, pressure
        self._found: dict[int, SmallestEigenvalue] = {}

    def waves_of(self, found: SmallestEigenvalue) -> int:
        return next(n for n, each in self._found.items() if each is found)

    def lowest(self, limit: int) -> SmallestEigenvalue:
        for n in _steps(limit, _COARSE):
            self.at(n)
        self._descend(limit)
        for n in _steps(limit, _FINE):
            best = self._best()
            if n not in self._found and self._pencil(n).count(best.value - _EQUAL * abs(best.value)):
                self.at(n)
                self._descend(limit)
        return self._best()

    def at(self, n: int) -> SmallestEigenvalue:
        if n not in self._found:
            near = min(self._found, key=lambda m: abs(m - n), default=0)
            pencil = self._pencil(n)
            guess = self._found[near].mode if near >= 2 and n >= 2 else pencil.block_iterations()
            self._found[n] = smallest_of(pencil, guess)
        return self._found[n]

    def _pencil(self, n: int) -> Pencil:
        return azimuthal_operator(*self._state, n).pencil()

    def _best(self) -> SmallestEigenvalue:
        return min(self._found.values(), key=lambda found: found.value)

    def _descend(self, limit: int) -> None:
        """From the lowest that is known down to a number that its neighbours on both sides do not undercut."""
        while True:
            n = self.waves_of(self._best())
            known = sorted({*self._found, 0, limit + 1})
            place = known.index(n)
            gaps = ((known[place - 1], n), (n, known[place + 1]))
            tries = [(low + high) // 2 for low, high in gaps if high - low > 1]
            if not tries:
                return
            for m in tries:
                self.at(m)


def _steps(limit: int, ratio: float) -> list[int]:
    numbers, n = list(range(1, min(_FIRST, limit) + 1)), _FIRST
    while n < limit:
        n = min(max(n + 1, ceil(n * ratio)), limit)
        numbers.append(n)
    return numbers


def _limit(potential: Potential, x: Array, pressure: float, evaluation: Evaluation, above: float) -> int:
    """The number of waves beyond which no eigenvalue is below ``above`` >= 0."""
    space = potential.space
    r = response_at_quadrature(potential, np.asarray(x, dtype=float).tobytes())
    thickness = potential.bulk / space.area_weights
    s1, s2 = (stress.reshape(space.R.shape) * thickness for stress in supporting_all(evaluation))
    form = bending_form(potential, x) or BendingForm(potential, np.asarray(x, dtype=float))
    kappa_1, kappa_2 = form.curvatures
    area = r.rho / space.R * np.hypot(r.rho_x, r.eta_x) / np.hypot(space.R_x, space.Z_x)
    _, m_r, _, m_rr, m_rz, m_zz = r.field
    mean, half = (m_rr + m_zz) / 2, np.hypot((m_rr - m_zz) / 2, m_rz)
    gain = np.maximum(0.0, -np.minimum(mean - half, m_r / r.rho))
    _, slope, curvature = (np.abs(part) for part in over_projection(potential.loads, r.eta))
    push = (abs(pressure) + slope) * area
    gain = gain + push * (np.abs(kappa_1) + np.abs(kappa_2)) + push**2 / (4 * np.maximum(r.A, np.finfo(float).tiny))
    gain = gain + curvature * area + above * thickness
    if potential.obstacles:
        gain = gain + _along_bodies(cast("ContactEvaluation", evaluation), area)
    if potential.scene.bending:
        d11, _, d22, _ = form.moduli
        gain = gain + np.minimum(s1, 0.0) ** 2 / (4 * d11)
        down = np.maximum(-s2, 0.0)
        square = (down + np.sqrt(down**2 + 4 * d22 * gain)) / (2 * d22)
    else:
        nothing = np.where(s2 < 0, np.inf, 0.0)  # where nothing is gained, only a compression lets short waves grow
        with np.errstate(divide="ignore", over="ignore"):
            square = np.divide(gain, np.maximum(s2, 0.0), out=nothing, where=gain > 0)
    largest = float((r.rho * np.sqrt(square)).max())
    return int(min(max(largest, _FIRST), MAX_WAVES)) if np.isfinite(largest) else MAX_WAVES


def _along_bodies(evaluation: ContactEvaluation, area: Array) -> Array:
    """What motions along bodies can gain per reference area: the pressure of contact times the largest curvature under them."""
    gaps, space = evaluation.gaps, evaluation.potential.space
    curvature = np.maximum(gaps.curvature, gaps.circle)[evaluation.held].max(initial=0.0)
    pressure = contact_of(evaluation).pressure(space.s.ravel()).reshape(space.R.shape) if curvature else np.zeros_like(space.R)
    return pressure * curvature * area
