"""Folds followed while a number of the scene changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import Status
from ..quantities import heading, words
from . import door
from .equilibrium import Equilibrium
from .special_point import SpecialPoint

Array = NDArray[np.float64]


_COLUMNS = ("pressure", "volume", "center_height")
FOLD_NAMES = {"limit_point": "limit point (dP = 0)", "volume_fold": "volume fold (dV = 0)"}


@dataclass(frozen=True, eq=False)
class Cusp(SpecialPoint):
    """A point of a fold curve where the number of the scene is stationary along the curve; it is solved as an equation.

    It has the attributes of a :class:`SpecialPoint`, and one more.

    Attributes
    ----------
    kind : str
        ``cusp``: two folds of the kind followed merge. Both exist on one side of ``value``, and none on the other. ``branch_point``: a
        limit point meets a volume fold, and branches of equilibria meet or separate.
    value : float
        The number of the scene there; its error is of second order in ``error``.
    """

    value: float = field(kw_only=True)


@dataclass(frozen=True, eq=False)
class FoldCurve:
    """A fold followed in one number of the scene.

    Attributes
    ----------
    kind : str
        limit_point (dP = 0) or volume_fold (dV = 0).
    parameter : str
        Name of the number, as given.
    values, pressure, volume, center_height : ndarray, shape (len(curve),)
        The number, and the fold at this number, in the order of the curve.
    cusps : tuple of Cusp
        Points where the curve turns back in the number.
    equilibria : tuple of Equilibrium
        The folds as equilibria, each of its own scene.
    closed : bool
        Whether the curve came back to its first point, which is then also the last.
    status : Status
        How the curve ended.
    message : str
        Why it ended; empty when a bound was met or the curve closed.
    timings : mapping of str to float
        Seconds by stage.
    """

    kind: str
    parameter: str
    values: Array
    pressure: Array
    volume: Array
    center_height: Array
    cusps: tuple[Cusp, ...]
    equilibria: tuple[Equilibrium, ...] = field(repr=False)
    closed: bool = False
    status: Status = Status.CONVERGED
    message: str = ""
    timings: Mapping[str, float] = field(default_factory=dict, repr=False)

    def __len__(self) -> int:
        return len(self.equilibria)

    def _repr_html_(self) -> str:
        """The picture and the cusps, for notebooks."""
        return door.fold_curve_html(self)

    def __str__(self) -> str:
        width = max(14, len(self.parameter))
        lines = [FOLD_NAMES[self.kind], f"{self.parameter:>{width}} " + " ".join(f"{words(name):>14}" for name in _COLUMNS)]
        rows = zip(self.values, *(getattr(self, name) for name in _COLUMNS), strict=True)
        lines += [f"{m:>{width}.8g} " + " ".join(f"{place:>14.9g}" for place in places) for m, *places in rows]
        for c in self.cusps:
            where = ", ".join(f"{heading(name)} = {getattr(c, name):.9g}" for name in ("pressure", "volume"))
            lines.append(f"{c.kind.replace('_', ' ')} at {self.parameter} = {c.value:.10g}: {where}")
        return "\n".join(lines + ([self.message] if self.message else []))

    def to_dataframe(self) -> Any:
        """The curve as a pandas DataFrame: a column named like the parameter, then pressure, volume and center_height."""
        import pandas

        return pandas.DataFrame({self.parameter: self.values, **{name: getattr(self, name) for name in _COLUMNS}})

    def plot(self, path: str | PathLike[str] | None = None, *, ax: Any = None, y: str = "pressure") -> Any:
        """Pressure and volume of the fold against the number as a Matplotlib figure.

        Parameters
        ----------
        path : path, optional
            Where the figure is also written.
        ax : matplotlib Axes, optional
            Where to draw one quantity of the fold; the answer is then these axes.
        y : {"pressure", "volume", "center_height"}
            This quantity.

        Raises
        ------
        InputError
            For an unknown quantity, and for a file that cannot be written.
        """
        return door.plot_fold_curve(self, path, ax, y)
