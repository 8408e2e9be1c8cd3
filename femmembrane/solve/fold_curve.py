"""Curves of folds: a limit point or a volume fold followed while one number of the scene changes.

With z = (x, P), R = E' - P V' and a number m, a fold is a root of the minimally extended system (Govaerts, 2000)::

    R(x, P, m) = 0,    g(x, P, m) = 0,        [ A   c ] [ v ]   [ 0 ]        limit point:  A = K = E'' - P V''
                                              [ c^T 0 ] [ g ] = [ 1 ]        volume fold:  A = [ K  -V' ; -V'^T  0 ]

g vanishes where A is singular. A is symmetric, so g_z = -(v.A v)_z, an exact third derivative. The system stays regular where two folds
merge (the curve turns in m: a cusp) and where a limit point meets a volume fold, so that pseudo-arc length in (x, P, m) passes both.
The border c is the mass times a mode close to the null vector, renewed at every point.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np

from ..errors import SolveError, Status
from ..potential import Array, Family
from .active_set import free_sides
from .banded import BandFactor, BorderedFactor, WideBorder
from .number_curve import Borders, Equations, NumberPoint, NumberProblem

if TYPE_CHECKING:
    from ..potential import ContactFamily
    from ..potential.contact import ContactEvaluation

#: kinds of folds that can be followed
KINDS = ("limit_point", "volume_fold")


class FoldProblem(NumberProblem):
    """Folds of one kind of a family of scenes; further parameters as for :class:`.NumberProblem`."""

    def __init__(self, family: Family, kind: str, scale: float, bounds: tuple[float, float]) -> None:
        super().__init__(family, scale, bounds)
        self.kind = kind

    def at(self, z: Array, borders: Borders, family: Family | None = None) -> Equations:
        return (_LimitPoint if self.kind == "limit_point" else _VolumeFold)(self, z, borders, family)

    def first_borders(self, z: Array, sweeps: int = 6) -> Borders:
        """Modes of K and of the singular matrix closest to zero, by inverse iteration from the shape of the volume gradient."""
        borders = super().first_borders(z, sweeps)
        if self.kind == "limit_point":
            return borders
        evaluation = self._at_start(z).evaluation
        gradient = evaluation.volume_gradient
        bordered, mode, q = BorderedFactor(BandFactor.of(evaluation), -gradient, -gradient, 0.0), gradient, 0.0
        for _ in range(sweeps):
            mode, q = bordered.solve(*self.unit_mode(mode, q))
        return Borders(borders.deflation, *self.unit_mode(mode, q))


class _Fold(Equations):
    """g and its derivatives from the null vector (mode, q) of the bordered singular matrix."""

    mode: Array
    q: float

    def linearise(self) -> None:
        self.find_mode()
        t, self.shift = self.family.fold_rates(self.evaluation, self.pressure, self.mode, self.q)
        self.force_number = t.force_number
        self.gap_row = -np.concatenate([t.cubic, [t.cubic_pressure, t.cubic_number]])

    def let_go(self) -> None:
        if self.evaluation.potential.borders:
            self.gap_row = self.gap_row - self._by_borders()

    def _by_borders(self) -> Array:
        """Derivatives of the form by the borders of contact, which move with the state.

        Where contact ends the normal part v_n of the mode sets in with a slope, and the form gains T v_n'^2 for each unit of length that
        contact does (Hadamard); T is the force across the circle over the deformed length.
        """
        evaluation, family = cast("ContactEvaluation", self.evaluation), cast("ContactFamily", self.family)
        gaps, (iu, iw), n = evaluation.gaps, family.place, family.space.n_free
        mode = np.append(self.mode, 0.0)
        across = mode[iu] * gaps.n_rho + mode[iw] * gaps.n_eta
        row, number, drift = np.zeros(n + 1), 0.0, np.where(evaluation.held, 0.0, family.drift(evaluation)[0])
        for side in free_sides(evaluation, self.pressure):
            lost = side.tension * float(side.slope @ across[side.nodes]) ** 2
            weights = -lost * side.slope / side.bend
            np.add.at(row, iu[side.nodes], weights * gaps.n_rho[side.nodes])
            np.add.at(row, iw[side.nodes], weights * gaps.n_eta[side.nodes])
            number += lost * side.motion(drift)
        row[:-1] = evaluation.reduction.projected(row[:-1])
        return np.append(row[:-1], [0.0, number])

    def find_mode(self) -> None:
        raise NotImplementedError


class _LimitPoint(_Fold):
    def find_mode(self) -> None:
        self.mode, self.q, self.gap = self.null, 0.0, self.null_gap


class _VolumeFold(_Fold):
    def find_mode(self) -> None:
        borders = self.borders
        edges = [-self.evaluation.volume_gradient, self.evaluation.row(borders.mode)]
        corner = np.array([[0.0, borders.mode_pressure], [borders.mode_pressure, 0.0]])
        self.mode, rest = WideBorder(self.deflated, edges, edges, corner).solve(None, [0.0, 1.0])
        self.q, self.gap = (float(r) for r in rest)

    def renewed(self) -> Borders:
        return Borders(super().renewed().deflation, *self.problem.unit_mode(self.evaluation.carried(self.mode), self.q))


def first_fold(problem: FoldProblem, x: Array, pressure: float, number: float, direction: int) -> NumberPoint:
    """The fold next to a guess at the same value of the number, oriented towards larger ones for direction +1.

    Raises
    ------
    SolveError
        When the guess is no fold of this kind, or one where the curve turns.
    """
    z = np.concatenate([x, [pressure, number]])
    point = problem.first(x, pressure, number, direction)
    if point is None or problem.norm(point.z - z) > 0.1 * (1 + problem.norm(z)):
        raise SolveError(f"the start is not near a {problem.kind} of this scene", status=Status.NOT_CONVERGED)
    return point
