"""Branches with waves around the axis on disk: NetCDF files like those of other branches, and their tables.

The dimensions are ``step``, ``coefficient`` (the harmonics of a state, filled up with NaN where a state has fewer) and ``special_point``.
The attribute ``waves`` tells such a file from that of an axisymmetric branch.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .. import files
from ..errors import Status
from ..quantities import typed
from .analyses.base import Variable
from .tipped import TippedBranch, TippedEquilibrium, TippedPoint

if TYPE_CHECKING:
    import xarray

    from ..scene import Scene

Array = NDArray[np.float64]

#: attribute that only these files have
WAVES = "waves"
_NUMBERS = ("amplitude", "shift", "truncation", "elastic_energy", "magnetic_energy", "load_energy", "electric_energy", "residual")
_PLACES = ("pressure", "volume", "center_height")
_WHOLE = ("harmonics", "iterations")
_POINT = ("volume", "pressure", "center_height", "error")
_SPECIAL = "special_"
#: columns of the table of special points
POINT_COLUMNS = ("kind", *_POINT)


def tipped_variables(branch: TippedBranch) -> dict[str, Variable]:
    """All variables of the data set of a branch, with dimensions and values."""
    width = max((eq.state.size for eq in [*branch, *(p.equilibrium for p in branch.special_points or ())]), default=0)
    found = _states(list(branch), width, "step", "")
    found |= {name: (("step",), branch.column(name)) for name in branch.columns if name not in found}
    if branch.special_points is not None:
        points, dimension = branch.special_points, f"{_SPECIAL}point"
        found[f"{_SPECIAL}kind"] = (dimension,), typed("kind", (p.kind for p in points))
        found |= {_SPECIAL + name: ((dimension,), typed(name, (getattr(p, name) for p in points))) for name in _POINT}
        found |= _states([p.equilibrium for p in points], width, dimension, f"{_SPECIAL}equilibrium_")
    return found


def _states(equilibria: Sequence[TippedEquilibrium], width: int, dimension: str, prefix: str) -> dict[str, Variable]:
    states = np.full((len(equilibria), width), np.nan)
    for row, eq in zip(states, equilibria, strict=True):
        row[: eq.state.size] = eq.state
    return {
        **{prefix + name: ((dimension,), typed(name, (getattr(eq, name) for eq in equilibria))) for name in (*_PLACES, *_NUMBERS, *_WHOLE)},
        prefix + "status": ((dimension,), typed("status", (eq.status.value for eq in equilibria))),
        prefix + "state": ((dimension, "coefficient"), states),
    }


def tipped_of(dataset: xarray.Dataset, scene: Scene) -> TippedBranch:
    """The branch of a data set; raises anything for one that nobody wrote in this way."""
    waves = int(dataset.attrs[WAVES])
    equilibria = _equilibria(dataset, scene, waves, "")
    points: tuple[TippedPoint, ...] | None = None
    if f"{_SPECIAL}kind" in dataset:
        kinds = [str(kind) for kind in dataset[f"{_SPECIAL}kind"].values]
        numbers = zip(*(dataset[_SPECIAL + name].values.tolist() for name in _POINT), strict=True)
        states = _equilibria(dataset, scene, waves, f"{_SPECIAL}equilibrium_")
        named = [dict(zip(_POINT, map(float, row), strict=True)) for row in numbers]
        points = tuple(TippedPoint(kind=k, equilibrium=eq, **n) for k, n, eq in zip(kinds, named, states, strict=True))
    timings = {str(stage): float(seconds) for stage, seconds in json.loads(dataset.attrs["timings"]).items()}
    return TippedBranch(scene, equilibria, Status(dataset.attrs["status"]), str(dataset.attrs["message"]), points, timings)


def _equilibria(dataset: xarray.Dataset, scene: Scene, waves: int, prefix: str) -> tuple[TippedEquilibrium, ...]:
    from ..discretization.harmonics import harmonics_of
    from ..discretization.space import space_of_scene

    space, found = space_of_scene(scene), []
    states = np.array(dataset[prefix + "state"].values, dtype=np.float64)
    for k, row in enumerate(states):
        numbers: dict[str, Any] = {name: float(dataset[prefix + name].values[k]) for name in (*_PLACES, *_NUMBERS)}
        wholes: dict[str, Any] = {name: int(dataset[prefix + name].values[k]) for name in _WHOLE}
        state = row[: harmonics_of(space, waves, wholes["harmonics"]).n_free].copy()
        if not (np.isfinite(state).all() and np.isfinite(list(numbers.values())).all() and np.isnan(row[state.size :]).all()):
            raise ValueError(f"{prefix}state {k} is not complete")
        state.flags.writeable = False
        status = Status(str(dataset[prefix + "status"].values[k]))
        found.append(TippedEquilibrium(waves=waves, status=status, scene=scene, state=state, **numbers, **wholes))
    return tuple(found)


def write_points_csv(branch: TippedBranch, path: str | PathLike[str]) -> None:
    """Write the special points, a row each."""
    files.write_csv(path, POINT_COLUMNS, ([getattr(p, name) for name in POINT_COLUMNS] for p in branch.special_points or ()))


def tipped_attributes(branch: TippedBranch) -> dict[str, Any]:
    """What the attributes of the data set say of these branches alone."""
    return {WAVES: branch[0].waves}
