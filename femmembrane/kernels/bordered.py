"""One border beside a factored symmetric matrix."""

from __future__ import annotations

import numpy as np

from .interface import Array, Factor


class BorderedFactor:
    """Solver for a symmetric band matrix K with one border::

        [ K   column ] [ x ]   [ f ]
        [ row^T   d  ] [ y ] = [ g ]

    Mixed block elimination (Govaerts and Pryce, 1993): backward stable even where K itself is singular, as it is at a limit point, at
    the price of one further solve with the factors of K.
    """

    def __init__(self, factor: Factor, column: Array, row: Array, corner: float) -> None:
        self._factor, self._column, self._row, self._corner = factor, column, row, corner
        borders = np.empty((len(row), 2), order="F")
        borders[:, 0], borders[:, 1] = row, column
        borders = factor.solve(borders)
        self._v, self._w = borders[:, 0], borders[:, 1]
        self._delta_v = corner - self._v @ column
        self._delta_w = corner - row @ self._w

    def perturb(self) -> None:
        """Make an exactly singular matrix one that is singular to round-off, as inverse iteration does."""
        least = float(np.finfo(float).eps) * max(1.0, abs(self._corner))
        if self._delta_v == 0:
            self._delta_v = self._delta_v - least
        if self._delta_w == 0:
            self._delta_w = self._delta_w - least

    @property
    def schur(self) -> float:
        """d - row . K^-1 column."""
        return float(self._delta_v)

    def solve(self, f: Array, g: float) -> tuple[Array, float]:
        with np.errstate(all="ignore"):  # where the bordered matrix is singular too the answer is NaN, which the caller judges
            first = (g - self._v @ f) / self._delta_v
            rest = self._factor.solve(f - first * self._column)
            second = (g - self._corner * first - self._row @ rest) / self._delta_w
            return rest - second * self._w, float(first + second)


class SpringFactor:
    """Solver for K + a a^T from factors of K, regular where the sum is, even where K itself is singular.

    Parameters
    ----------
    factor : Factor
        Of K.
    spring : ndarray, shape (n,)
        a.
    """

    def __init__(self, factor: Factor, spring: Array) -> None:
        self._own, self._spring = factor, spring
        self._border = BorderedFactor(factor, spring, spring, -1.0)
        self._border.perturb()

    def solve(self, right: Array) -> Array:
        """Solution for one or several right-hand sides, shape (n,) or (n, k)."""
        if right.ndim == 1:
            return self._border.solve(right, 0.0)[0]
        return np.asfortranarray(np.stack([self._border.solve(column, 0.0)[0] for column in right.T], axis=1))

    def determinant_sign(self) -> int:
        """Sign of det K (1 + a . K^-1 a)."""
        return self._own.determinant_sign() * (1 if self._border.schur < 0 else -1)
