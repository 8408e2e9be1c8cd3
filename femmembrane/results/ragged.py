"""Rows of different lengths in one array: states and nodes of equilibria whose meshes differ."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def stacked(rows: Iterable[Array], width: int | None = None) -> Array:
    """The rows as one array, each followed by NaN up to the longest, or to a width.

    Parameters
    ----------
    rows : iterable of ndarray
    width : int, optional
    """
    known = [np.asarray(row, dtype=float) for row in rows]
    found = np.full((len(known), max((row.size for row in known), default=0) if width is None else width), np.nan)
    for k, row in enumerate(known):
        found[k, : row.size] = row
    return found


def row_of(values: Array) -> Array:
    """A row without the NaN that follow it.

    Parameters
    ----------
    values : ndarray
    """
    known = np.flatnonzero(~np.isnan(values))
    return values[: known[-1] + 1] if known.size else values[:0]
