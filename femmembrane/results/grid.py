"""The rows of a sweep as one labelled data set, on disk as NetCDF."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ..errors import InputError
from ..origin import package_version
from .netcdf import read_dataset, reason, write_dataset

if TYPE_CHECKING:
    import xarray

_PLACES = {"volume": "enclosed volume V/R0^3", "pressure": "pressure P = p R0/(mu T)", "center_height": "height of the pole over R0"}
#: dimensions along which a scene has several values, and what each counts
_FAMILIES = {
    "": ("step", "equilibrium", "along the branch"),
    "limit_": ("limit_point", "limit point", "of the limit points along the branch (dP = 0)"),
    "fold_": ("fold", "volume fold", "of the volume folds along the branch (dV = 0)"),
    "onset_": ("onset", "azimuthal onset", "where an azimuthal instability sets in or ends"),
    "state_": ("state", "state", "of the equilibria at the load, by increasing energy"),
}
#: dimension (if a scene has several values) and long name of every variable; all of them are non-dimensional
MEANING: Mapping[str, tuple[str, str]] = {
    **{f"{tag}{name}": (dim, f"{what} {where}") for tag, (dim, _, where) in _FAMILIES.items() for name, what in _PLACES.items()},
    "steps": ("", "number of equilibria along the branch"),
    "limit_points": ("", "number of limit points"),
    "volume_folds": ("", "number of volume folds"),
    "azimuthal_onsets": ("", "number of azimuthal onsets"),
    "onset_waves": ("onset", "number of waves around the axis of the onsets"),
    "wrinkled_fraction": ("step", "part of the reference area that is wrinkled, along the branch"),
    "largest_wrinkled_fraction": ("", "largest part of the reference area that is wrinkled on the branch"),
    "equilibria": ("", "number of equilibria at the load that were found"),
    "stable_equilibria": ("", "number of them that are stable under the load's control and against the waves asked for"),
    "state_energy": ("state", "energy that orders the equilibria, over mu T R0^2"),
    "state_stable": ("state", "whether each equilibrium is stable (1 or 0)"),
    "upright_at_start": ("", "whether the branch starts stable against one wave around the axis (1 or 0)"),
    "outcome": ("", "whether and where the onset was met"),
}


class Row(Protocol):
    """What came of one scene."""

    @property
    def status(self) -> str: ...
    @property
    def message(self) -> str: ...
    @property
    def values(self) -> Mapping[str, Any]: ...
    @property
    def seconds(self) -> float: ...


def dataset_of(over: Mapping[str, tuple[Any, ...]], rows: Sequence[Row], facts: Mapping[str, str]) -> xarray.Dataset:
    """The rows of a grid, the last key fastest, in the shape of the grid.

    Numbers that a scene does not have are NaN, texts empty; series of different lengths are filled up with NaN.
    """
    import xarray

    shape, dims = tuple(len(values) for values in over.values()), tuple(over)
    names = sorted({name for row in rows for name in row.values}, key=list(MEANING).index)
    variables: dict[str, Any] = {}
    for name in names:
        values, (dim, meaning) = [row.values.get(name) for row in rows], MEANING[name]
        series = any(isinstance(v, np.ndarray) for v in values)
        data = (
            _stacked(values)
            if series
            else _text(values)
            if name == "outcome"
            else np.array([np.nan if v is None else v for v in values], float)
        )
        about = {"long_name": meaning, "units": "1"}
        variables[name] = (*dims, dim) if series else dims, data.reshape(shape + data.shape[1:]), about
    variables["status"] = dims, _text([r.status for r in rows]).reshape(shape), {"long_name": "how the computation of the scene ended"}
    variables["message"] = dims, _text([r.message for r in rows]).reshape(shape), {"long_name": "the reason, or what was done"}
    has = np.array([bool(r.values) for r in rows]).reshape(shape)
    variables["has_result"] = dims, has, {"long_name": "whether anything was computed of the scene"}
    variables["seconds"] = dims, np.array([r.seconds for r in rows]).reshape(shape), {"long_name": "wall time of the scene", "units": "s"}
    about = {"title": "femmembrane sweep", "femmembrane_version": package_version(), **facts}
    coordinates = {key: _labels(values) for key, values in over.items()}
    return xarray.Dataset(variables, coords=coordinates, attrs=about)


def save_dataset(dataset: xarray.Dataset, path: str | PathLike[str]) -> None:
    """Write a data set to a NetCDF file, whole or not at all; series are compressed."""
    encoding = {
        str(name): {
            "_FillValue": None,
            **({"zlib": True, "complevel": 1, "shuffle": True} if variable.size > math.prod(variable.shape[:1]) else {}),
        }
        for name, variable in dataset.variables.items()
        if variable.dtype.kind == "f"
    }
    write_dataset(dataset, path, encoding)


def load_dataset(path: str | PathLike[str]) -> xarray.Dataset:
    """Read the data set of a sweep.

    Raises
    ------
    InputError
        When the file cannot be read or holds something else.
    """
    what = "a sweep written by femmembrane"
    dataset = read_dataset(path, what)
    try:
        keys = json.loads(dataset.attrs["over"])
        shape = tuple(dataset[key].size for key in keys if dataset[key].dims == (key,))
        words = all(isinstance(dataset.attrs[name], str) for name in ("quantity", "scene"))
        whole = all(dataset[name].shape == shape for name in ("status", "message", "has_result", "seconds"))
        whole = whole and dataset["has_result"].dtype == bool
    except Exception as error:  # a file that was not written here can raise anything
        raise InputError("path", str(path), f"{what} is needed ({reason(error)})") from None
    if not (len(shape) == len(keys) > 0 and words and whole):
        raise InputError("path", str(path), f"{what} is needed")
    return dataset


def _stacked(values: Sequence[Any]) -> Any:
    """Series of different lengths, filled up with NaN, shape (scenes, longest)."""
    series = [np.zeros(0) if v is None else np.atleast_1d(v) for v in values]
    data = np.full((len(series), max(s.size for s in series)), np.nan)
    for place, s in enumerate(series):
        data[place, : s.size] = s
    return data


def _text(values: Sequence[str | None]) -> Any:
    return np.array([v or "" for v in values], dtype=object)


def _labels(values: tuple[Any, ...]) -> Any:
    return np.array(values, dtype=object) if isinstance(values[0], str) else np.array(values)
