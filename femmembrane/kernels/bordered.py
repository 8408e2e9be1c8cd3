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

    def solve(self, f: Array, g: float) -> tuple[Array, float]:
        first = (g - self._v @ f) / self._delta_v
        rest = self._factor.solve(f - first * self._column)
        second = (g - self._corner * first - self._row @ rest) / self._delta_w
        return rest - second * self._w, float(first + second)
