"""Where to measure: D-optimal choices among candidates.

A measurement at a candidate adds j^T j to the information matrix of the numbers, where j is the derivative of its prediction over its
deviation. A D-optimal design has the largest determinant of the sum, the smallest volume of the ellipsoid of confidence, whatever the scale
of the numbers (Fedorov 1972). Points are added one by one where they gain most, and exchanged until no exchange gains.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: information that stands for none, relative to the largest of one candidate: the first points have a determinant with it
_PRIOR = 1e-10


def log_determinant(information: Array) -> float:
    sign, value = np.linalg.slogdet(information)
    return float(value) if sign > 0 else -math.inf


def choose(rows: Array, count: int, known: Array | None = None, most: int | None = None) -> list[int]:
    """Candidates that together determine the numbers best.

    Parameters
    ----------
    rows : ndarray, shape (candidates, p)
        Relative derivatives over deviations.
    count : int
        Number of measurements.
    known : ndarray, shape (p, p), optional
        Information that is there already.
    most : int, optional
        How often one candidate may be measured.
    """
    p = rows.shape[1]
    size = float((rows * rows).sum(axis=1).max(initial=0.0)) or 1.0
    matrix: Array = (np.zeros((p, p)) if known is None else known.copy()) + _PRIOR * size * np.eye(p)
    limit = count if most is None else most
    chosen: list[int] = []

    def gains(information: Array) -> Array:
        found: Array = np.einsum("ip,pq,iq->i", rows, np.linalg.inv(information), rows)
        return found

    for _ in range(count):
        gain = gains(matrix)
        for k in set(chosen):
            if chosen.count(k) >= limit:
                gain[k] = -math.inf
        best = int(np.argmax(gain))
        chosen.append(best)
        matrix += np.outer(rows[best], rows[best])
    for _ in range(10):
        moved = False
        for place, old in enumerate(chosen):
            without = matrix - np.outer(rows[old], rows[old])
            gain = gains(without)
            for k in set(chosen):
                if k != old and chosen.count(k) >= limit:
                    gain[k] = -math.inf
            best = int(np.argmax(gain))
            if gain[best] > gain[old] * (1 + 1e-9):
                chosen[place], moved = best, True
                matrix = without + np.outer(rows[best], rows[best])
        if not moved:
            break
    return chosen


def errors_of(information: Array) -> Array:
    """Standard errors that belong to an information matrix."""
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))
    s, v = np.linalg.eigh(information / np.outer(size, size))
    with np.errstate(all="ignore"):
        inverse = np.where(s > 1e-14, 1 / s, np.inf)
        errors = np.sqrt(((v * v) * inverse).sum(axis=1)) / size
    found: Array = np.where(np.isfinite(errors), errors, np.inf)
    return found


def geometric_mean(information: Array) -> float:
    """Geometric mean of the half axes of the ellipsoid of one standard error."""
    value = log_determinant(information)
    return math.inf if value == -math.inf else math.exp(-value / (2 * len(information)))
