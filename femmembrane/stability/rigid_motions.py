"""Eigenvalues of a membrane that can move as a whole. They belong to the motions that are left when rigid motions are taken out.

With T the rigid motions, K T = 0, the others are orthogonal to T in the mass M. The unknowns hold one node, so that K is regular. A motion
y in these unknowns stands for y without its rigid part, y - T (T^T M T)^-1 T^T M y. It has the same K and the mass::

    M' = M - U U^T,        U = M T (T^T M T)^(-1/2)

so that K phi = lambda M' phi has all of the free membrane's eigenvalues but the zeros. K - lambda M' is a band matrix plus lambda U U^T.
"""

from __future__ import annotations

import numpy as np

from ..kernels.bordered import SpringFactor
from ..potential import Array
from ..solve.banded import BandFactor, BorderedFactor, band_product, bordered_count, negative_directions
from .spectrum import Pencil


class FloatingPencil(Pencil):
    """K - lambda (M - U U^T), with a constraint if given.

    Parameters
    ----------
    band, mass, kd, constraint, compliance
        As for :class:`.spectrum.Pencil`.
    rigid : ndarray, shape (n, k)
        U, see :func:`rigid_part`.
    """

    banded = False

    def __init__(self, band: Array, mass: Array, kd: int, constraint: Array | None, compliance: float, rigid: Array) -> None:
        super().__init__(band, mass, kd, constraint, compliance)
        self.rigid = rigid

    def times_mass(self, mode: Array) -> Array:
        return band_product(self.mass, self.kd, mode) - self.rigid @ (self.rigid.T @ mode)

    def shifted_solver(self, shift: float) -> BandFactor | BorderedFactor:
        if not shift:
            return super().shifted_solver(shift)
        factor = _RankFactor(BandFactor(self.band - shift * self.mass), self.rigid, shift)
        return factor if self.constraint is None else BorderedFactor(factor, self.constraint, self.constraint, -self.compliance)

    def count(self, shift: float) -> int:
        """Number of eigenvalues below a shift: the inertia of the band matrix and, by Haynsworth's additivity, of its borders."""
        if not shift:
            return super().count(shift)
        band = self.band - shift * self.mass
        borders, corners = self.rigid, np.full(self.rigid.shape[1], -1 / shift)
        if self.constraint is not None:
            borders, corners = np.column_stack([borders, self.constraint]), np.append(corners, -self.compliance)
        schur = np.diag(corners) - borders.T @ BandFactor(band).solve(np.asfortranarray(borders))
        own = int((corners < 0).sum()) + int(self.constraint is not None and self.compliance == 0)
        return negative_directions(band, self.kd) + int((np.linalg.eigvalsh((schur + schur.T) / 2) < 0).sum()) - own


class _RankFactor(BandFactor):
    """Solver for A + shift U U^T from factors of A (Woodbury)."""

    def __init__(self, factor: BandFactor, rigid: Array, shift: float) -> None:
        self._factor, self._rigid = factor, rigid
        self._columns = factor.solve(np.asfortranarray(rigid))
        self._inner = np.linalg.inv(np.eye(rigid.shape[1]) / shift + rigid.T @ self._columns)

    def solve(self, right: Array) -> Array:
        solution = self._factor.solve(right)
        return solution - self._columns @ (self._inner @ (self._rigid.T @ solution))


def rigid_part(product: Array, gram: Array) -> Array:
    """U of rigid motions, from M T at the unknowns, shape (n, k), and T^T M T."""
    return np.linalg.solve(np.linalg.cholesky(gram), product.T).T


class SpringPencil(FloatingPencil):
    """K + a a^T - lambda (M - U U^T), with a constraint if given: a total charge couples all points by a spring a.

    Parameters
    ----------
    band, mass, kd, constraint, compliance, rigid
        As for :class:`FloatingPencil`; without rigid motions of shape (n, 0).
    spring : ndarray, shape (n,)
    """

    def __init__(self, band: Array, mass: Array, kd: int, constraint: Array | None, compliance: float, rigid: Array, spring: Array) -> None:
        super().__init__(band, mass, kd, constraint, compliance, rigid)
        self.spring = spring

    def stiffness(self, mode: Array) -> Array:
        return super().stiffness(mode) + self.spring * (self.spring @ mode)

    def shifted_solver(self, shift: float) -> BandFactor | BorderedFactor:
        factor = BandFactor(self.band - shift * self.mass)
        if shift and self.rigid.shape[1]:
            factor = _RankFactor(factor, self.rigid, shift)
        sprung = _Sprung(factor, self.spring)
        return sprung if self.constraint is None else BorderedFactor(sprung, self.constraint, self.constraint, -self.compliance)

    def count(self, shift: float) -> int:
        borders, corners = [self.spring], [-1.0]
        if shift:
            borders, corners = [*borders, *self.rigid.T], [*corners, *[-1 / shift] * self.rigid.shape[1]]
        if self.constraint is not None:
            borders, corners = [*borders, self.constraint], [*corners, -self.compliance]
        band = self.band - shift * self.mass if shift else self.band
        return bordered_count(band, self.kd, np.stack(borders, axis=1), np.array(corners))


class _Sprung(BandFactor):
    """Solver for A + a a^T from factors of A."""

    def __init__(self, factor: BandFactor, spring: Array) -> None:
        self._factor = SpringFactor(factor, spring)


def pencil_of(
    band: Array, mass: Array, kd: int, constraint: Array | None, compliance: float, rigid: Array | None, spring: Array | None = None
) -> Pencil:
    """The pencil of a membrane that is held, or with ``rigid`` motions taken out; with the ``spring`` of a total charge if given."""
    if spring is not None:
        return SpringPencil(band, mass, kd, constraint, compliance, np.zeros((len(spring), 0)) if rigid is None else rigid, spring)
    if rigid is None:
        return Pencil(band, mass, kd, constraint, compliance)
    return FloatingPencil(band, mass, kd, constraint, compliance, rigid)
