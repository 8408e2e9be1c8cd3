"""What a run remembers of its path, so that it goes on after an interrupt as if there had been none."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PathMemory:
    """What the next equilibrium of a run depends on besides the last one. With it an interrupted run goes on as if it had not stopped.

    Attributes
    ----------
    sigma : tuple of float
        Load (in a trace: arc length) at the last points that predict the next one, two at most.
    points, slopes : ndarray, shape (len(sigma), n_free + 1)
        (x, P) and its derivative with respect to sigma there; of a trace over a number the number as well.
    sizes : (float, float) or None
        Where the mesh changes along the run: the sizes of pressure and eigenvalues below which errors are not relative.
    """

    sigma: tuple[float, ...]
    points: Array
    slopes: Array
    sizes: tuple[float, float] | None = field(default=None, kw_only=True)


@dataclass(frozen=True, eq=False)
class TraceMemory(PathMemory):
    """The same for a trace by arc length.

    Attributes
    ----------
    step : float
        Length of the next step.
    regular : int
        Number of equilibria that are steps of the trace; one more may be the end point that was asked for.
    unexplained : tuple of str
        Changes of inertia met so far at which no special point was located.
    known : float
        Relative size of the last correction of the point from which the next step sets out.
    border : ndarray, shape (n_free,), or None
        Over a number: the softest displacement at that point, by which its equations are solved.
    """

    step: float
    regular: int
    unexplained: tuple[str, ...] = ()
    known: float = 0.0
    border: Array | None = None
