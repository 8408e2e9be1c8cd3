"""Branches on disk: NetCDF files that hold a computation whole.

A file is one data set with the dimensions ``step`` (equilibria), ``node`` (points along the meridian), ``coefficient`` (the state) and,
when the branch was searched for them, ``special_point`` and ``zone``. The state is kept to the last bit, so that a loaded equilibrium is
the one that was saved; everything else in the file can be read without this package.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from os import PathLike
from os.path import exists, isdir, join
from typing import TYPE_CHECKING, Any

import numpy as np

from ..discretization.meridian import side
from ..errors import InputError, Status
from ..origin import package_version
from ..scene import Scene
from ..scene.own import MissingPartError
from .analyses import asked, known_quantity, typed_column
from .analyses.base import Variable
from .branch import Branch
from .netcdf import read_dataset, reason, write_dataset
from .ragged import stacked
from .stored_points import (
    LIMIT,
    ON_BRANCH,
    SPECIAL,
    equilibria_of,
    equilibrium_variables,
    jump_variables,
    jumps_of,
    memory_attributes,
    memory_of,
    memory_variables,
    mesh_variables,
    special_points_of,
    special_variables,
)
from .table import columns, rows
from .tipped_store import WAVES, tipped_attributes, tipped_of, tipped_variables

if TYPE_CHECKING:
    import xarray

    from .tipped import TippedBranch

FORMAT = 1
#: attribute of files that count the volume that a membrane encloses as positive wherever it is; before, one with its inside above did not
_INSIDE = ("inside", "where the membrane encloses a volume, below where it is flat")


def tipped_to_xarray(branch: TippedBranch) -> xarray.Dataset:
    """A branch with waves around the axis as one data set: the columns of the table, the states and the special points."""
    import xarray

    described = {name: (dims, data, _describe(name)) for name, (dims, data) in tipped_variables(branch).items()}
    step = described.pop("step")
    about = {**_common_attributes(branch, "Equilibria of a membrane with waves around the axis"), **tipped_attributes(branch)}
    return xarray.Dataset(described, coords={"step": step}, attrs=about)


def to_xarray(branch: Branch) -> xarray.Dataset:
    """The branch as one data set: the columns of the table, the profiles at the nodes, the states and the special points.

    Every variable has ``long_name`` and ``units``; the scene is in the attributes as TOML text.
    """
    import xarray

    points = [*(branch.special_points or ()), *(jump.limit for jump in branch.jumps if jump.limit is not None)]
    changes, special = branch.mesh_changes, [point.equilibrium for point in points]
    width = max((equilibrium.state.size for equilibrium in (*branch[:1], *(branch if changes else ()), *special)), default=0)
    changes = changes or any(equilibrium.state.size != width for equilibrium in (*branch[:1], *special))
    variables = {**_table_variables(branch), **equilibrium_variables(list(branch), width, "step"), **_profile_variables(branch)}
    for analysis in asked(branch.scene):
        variables |= analysis.variables(branch)
    if branch.special_points is not None:
        variables |= special_variables(branch.special_points, width, SPECIAL, branch.over, changes)
    if changes:
        variables |= mesh_variables(list(branch), "step")
    variables |= jump_variables(branch.jumps, width, branch.over, changes)
    variables |= memory_variables(branch.memory, changes)
    described = {name: (dims, data, _describe(name)) for name, (dims, data) in variables.items()}
    coordinates = {name: described.pop(name) for name in [*described] if name in ("r", "s") or described[name][0] == (name,)}
    return xarray.Dataset(described, coords=coordinates, attrs=_attributes(branch))


def save(branch: Branch, path: str | PathLike[str], facts: Mapping[str, str] | None = None) -> None:
    """Write a branch to a NetCDF file, from which :func:`load` brings it back to the last bit; ``facts`` are further attributes of it."""
    _write(to_xarray(branch).assign_attrs(facts or {}), path)


def save_tipped(branch: TippedBranch, path: str | PathLike[str]) -> None:
    """Write a branch with waves around the axis to a NetCDF file, from which :func:`load` brings it back to the last bit."""
    if not len(branch):
        raise InputError("branch", "no equilibria", "a branch with one or more equilibria is needed")
    _write(tipped_to_xarray(branch), path)


def _write(dataset: xarray.Dataset, path: str | PathLike[str]) -> None:
    encoding = {
        str(name): {"_FillValue": None, **({"zlib": True, "complevel": 1, "shuffle": True} if variable.ndim == 2 and variable.size else {})}
        for name, variable in dataset.variables.items()
        if variable.dtype.kind == "f"
    }
    write_dataset(dataset, path, encoding)


def load(path: str | PathLike[str], *, scene: Scene | None = None) -> Any:
    """Bring a saved branch back, without solving anything.

    Parameters
    ----------
    path : path
        A file that :meth:`Branch.save`, :meth:`TippedBranch.save` or a run wrote, or the folder of a run.
    scene : Scene, optional
        For a scene with materials, sources, shapes or functions of your own: where these come from. A data file imports nothing.

    Returns
    -------
    Branch or TippedBranch
        Equal to the saved one to the last bit.

    Raises
    ------
    InputError
        When the file cannot be read, was not written by this package, or has a newer format.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import femmembrane as fm
    >>> branch = fm.inflate(fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16)), volumes=[0.5, 1.0])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     branch.save(Path(folder) / "branch.nc")
    ...     again = fm.load(Path(folder) / "branch.nc")
    >>> bool((again.column("pressure") == branch.column("pressure")).all())
    True
    """
    if isdir(path):
        path = join(path, "branch.nc")
        if not exists(path):
            raise InputError("path", str(path), "there is no branch.nc in this folder: the folder of a run is allowed")
    dataset = read_branch_file(path)
    return (tipped_branch_of if WAVES in dataset.attrs else branch_of)(dataset, path, scene)


def tipped_branch_of(dataset: xarray.Dataset, path: str | PathLike[str], own: Scene | None = None) -> TippedBranch:
    """The branch with waves of the data set that :func:`read_branch_file` read.

    Raises
    ------
    InputError
        When it is not complete.
    """
    try:
        return tipped_of(dataset, scene_from_text(dataset.attrs["scene"], own))
    except MissingPartError:
        raise
    except Exception as error:  # there is nothing that a file nobody wrote in this way could not lead to
        raise InputError("path", str(path), f"a complete file written by femmembrane is needed ({reason(error)})") from error


def branch_of(dataset: xarray.Dataset, path: str | PathLike[str], own: Scene | None = None) -> Branch:
    """The branch of the data set that :func:`read_branch_file` read.

    Raises
    ------
    InputError
        When it is none of ours, or not complete.
    """
    try:
        scene = scene_from_text(dataset.attrs["scene"], own)
        branch = _branch(dataset, scene)
    except MissingPartError:
        raise
    except Exception as error:  # there is nothing that a file nobody wrote in this way could not lead to
        raise InputError("path", str(path), f"a complete file written by femmembrane is needed ({reason(error)})") from error
    if not scene.open and _INSIDE[0] not in dataset.attrs and side(scene.mesh) < 0:
        what = "it is of a version that counted V and P of a membrane whose inside is above it as negative; compute it again"
        raise InputError("path", str(path), what)
    return branch


def scene_text(scene: Scene) -> str:
    """The scene as the text of a TOML file."""
    import tomli_w

    return tomli_w.dumps(scene.record())


def scene_from_text(text: str, own: Scene | None = None) -> Scene:
    """The scene of a TOML text; parts that are no part of the package are those of a scene that is given."""
    return Scene.from_dict(tomllib.loads(text), own=False if own is None else own)


def _table_variables(branch: Branch) -> dict[str, Variable]:
    names, table = columns(branch), list(rows(branch))
    cells = zip(*table, strict=True) if table else ([] for _ in names)
    return {name: (("step",), typed_column(name, column)) for name, column in zip(names, cells, strict=True)}


def _profile_variables(branch: Branch) -> dict[str, Variable]:
    profiles = [e.profile() for e in branch]
    if not profiles:
        return {}
    places = [key for key in ("r", "s") if key in profiles[0]]
    table = columns(branch)  # the largest electric field has the name of the field, of which there is a value at each node as well
    names = {key: f"{key}_profile" if key in table else key for key in profiles[0] if key not in places}
    values = {name: (("step", "node"), stacked(p[key] for p in profiles)) for key, name in names.items()}
    if branch.mesh_changes or any(e.scene.borders for e in branch):  # each equilibrium has its own nodes
        return {**{key: (("step", "node"), stacked(p[key] for p in profiles)) for key in places}, **values}
    return {**{key: (("node",), np.array(profiles[0][key])) for key in places}, **values}


def _describe(name: str) -> dict[str, str]:
    prefix = next((p for p in (SPECIAL, LIMIT) if name.startswith(p)), "")
    own = name.removeprefix(prefix).removeprefix("equilibrium_")
    base = own.removeprefix(ON_BRANCH)
    known = known_quantity(base)
    where = ("" if own == name else ", at the special point") + ("" if base == own else ", on the mesh of the branch")
    return {"long_name": known.meaning + where, "units": known.unit}


def _common_attributes(branch: Branch | TippedBranch, title: str) -> dict[str, Any]:
    return {
        "title": branch.scene.title or title,
        "femmembrane_version": package_version(),
        "format": FORMAT,
        _INSIDE[0]: _INSIDE[1],
        "status": branch.status.value,
        "message": branch.message,
        "timings": json.dumps(dict(branch.timings)),
        "scene": scene_text(branch.scene),
    }


def _attributes(branch: Branch) -> dict[str, Any]:
    return {
        **_common_attributes(branch, "Equilibria of an inflated membrane"),
        **({"solver": branch.solver} if branch.solver else {}),
        **({"remarks": json.dumps(branch.remarks)} if branch.remarks else {}),
        **({"over": branch.over, "hold": json.dumps(dict(branch.hold))} if branch.over else {}),
        **memory_attributes(branch.memory),
    }


def read_branch_file(path: str | PathLike[str]) -> xarray.Dataset:
    """The data set of a branch file; whether it is a complete branch is seen in :func:`branch_of`.

    Raises
    ------
    InputError
        When the file cannot be read, is damaged, is not one of ours, or has a newer format.
    """
    dataset = read_dataset(path, "a NetCDF file written by femmembrane")
    if not {"format", "femmembrane_version", "scene"} <= set(dataset.attrs):
        raise InputError("path", str(path), "a NetCDF file written by femmembrane is needed; this one comes from elsewhere")
    found = dataset.attrs["format"]
    if not isinstance(found, (int, np.integer)) or found != FORMAT:
        raise InputError("path", str(path), f"format {FORMAT} is needed; this file has format {found}: use the version that wrote it")
    return dataset


def _branch(dataset: xarray.Dataset, scene: Scene) -> Branch:
    over = str(dataset.attrs.get("over", ""))
    equilibria = tuple(equilibria_of(dataset, scene, over))
    branch = Branch(
        scene=scene,
        equilibria=equilibria,
        special_points=special_points_of(dataset, scene, over, SPECIAL),
        status=Status(dataset.attrs["status"]),
        message=str(dataset.attrs["message"]),
        timings={str(stage): float(seconds) for stage, seconds in json.loads(dataset.attrs["timings"]).items()},
        memory=memory_of(dataset),
        jumps=jumps_of(dataset, scene, over, equilibria),
        # younger than the format
        solver=str(dataset.attrs.get("solver", "")),
        remarks=tuple(map(str, json.loads(dataset.attrs.get("remarks", "[]")))),
        over=over,
        hold={str(name): float(value) for name, value in json.loads(dataset.attrs.get("hold", "{}")).items()},
    )
    for analysis in asked(scene):
        analysis.restore(dataset, branch)
    return branch
