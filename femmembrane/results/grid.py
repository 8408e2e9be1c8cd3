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
from ..quantities import PLACES, Converter, in_si, quantity
from .identities import FAMILIES, with_identities
from .netcdf import read_dataset, reason, write_dataset

if TYPE_CHECKING:
    import xarray

#: dimension along which a scene has several values, what lies there, and which of them
_FAMILIES = {
    "": ("step", "step", "along the branch"),
    "limit_": ("limit_point", "limit point", "of the limit points along the branch (dP = 0)"),
    "fold_": ("fold", "volume fold", "of the volume folds along the branch (dV = 0)"),
    "onset_": ("onset", "onset", "where an azimuthal instability sets in or ends"),
    "state_": ("state", "equilibrium", "of the equilibria at the load, by increasing energy"),
}
#: dimension of every variable of which a scene has several values, empty for one
DIMENSIONS: Mapping[str, str] = {
    **{f"{tag}{name}": dim for tag, (dim, _, _) in _FAMILIES.items() for name in PLACES},
    **dict.fromkeys(("steps", "limit_points", "volume_folds", "azimuthal_onsets"), ""),
    "onset_waves": "onset",
    **{f"{tag}{what}": _FAMILIES[tag][0] for tag in FAMILIES for what in ("identity", "cut")},
    "wrinkled_fraction": "step",
    **dict.fromkeys(("largest_wrinkled_fraction", "equilibria", "stable_equilibria"), ""),
    "state_energy": "state",
    "state_stable": "state",
    "upright_at_start": "",
    "outcome": "",
}


def place_of_variable(name: str) -> tuple[str, str]:
    """Of a variable that holds where equilibria or special points lie: its quantity, and what lies there; empty for others."""
    for tag, (_, what, _) in _FAMILIES.items():
        if name.removeprefix(tag) in PLACES and name.startswith(tag):
            return name.removeprefix(tag), what
    return "", ""


def _meaning(name: str) -> str:
    """What a variable holds: a place with whose it is, or a quantity of its own."""
    for tag, (_, _, where) in _FAMILIES.items():
        if name.startswith(tag) and name.removeprefix(tag) in PLACES:
            return f"{quantity(name.removeprefix(tag)).meaning} {where}"
    return quantity(name).meaning


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


def dataset_of(
    over: Mapping[str, tuple[Any, ...]], rows: Sequence[Row], facts: Mapping[str, str], scales: Converter | None = None
) -> xarray.Dataset:
    """The rows of a grid, the last key fastest, in the shape of the grid.

    Numbers that a scene does not have are NaN, texts empty; series of different lengths are filled up with NaN.
    With scales that all scenes share, places have their values in SI units as well.
    """
    import xarray

    shape, dims = tuple(len(values) for values in over.values()), tuple(over)
    names = sorted({name for row in rows for name in row.values}, key=list(DIMENSIONS).index)
    variables: dict[str, Any] = {}
    for name in names:
        values, dim = [row.values.get(name) for row in rows], DIMENSIONS[name]
        series = any(isinstance(v, np.ndarray) for v in values)
        data = (
            _stacked(values)
            if series
            else _text(values)
            if name == "outcome"
            else np.array([np.nan if v is None else v for v in values], float)
        )
        about = {"long_name": _meaning(name), "units": "1"}
        variables[name] = (*dims, dim) if series else dims, data.reshape(shape + data.shape[1:]), about
        if scales is not None and (of := place_of_variable(name)[0]):
            tag, kind, (along, values, _) = name.removesuffix(of), quantity(of).si, variables[name]
            known = quantity(in_si(of))
            about = {"long_name": f"{known.meaning} {_FAMILIES[tag][2]}", "units": known.unit}
            variables[f"{tag}{in_si(of)}"] = along, scales.to_si(kind, values), about
    variables["status"] = dims, _text([r.status for r in rows]).reshape(shape), {"long_name": "how the computation of the scene ended"}
    variables["message"] = dims, _text([r.message for r in rows]).reshape(shape), {"long_name": "the reason, or what was done"}
    has = np.array([bool(r.values) for r in rows]).reshape(shape)
    variables["has_result"] = dims, has, {"long_name": "whether anything was computed of the scene"}
    variables["seconds"] = dims, np.array([r.seconds for r in rows]).reshape(shape), {"long_name": "wall time of the scene", "units": "s"}
    about = {"title": "femmembrane sweep", "femmembrane_version": package_version(), **facts}
    coordinates = {key: _labels(values) for key, values in over.items()}
    return with_identities(xarray.Dataset(variables, coords=coordinates, attrs=about), dims)


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
