"""Branches on disk: NetCDF files that hold a computation whole.

A file is one data set with the dimensions ``step`` (equilibria), ``node`` (points along the meridian), ``coefficient`` (the state) and,
when the branch was searched for them, ``special_point`` and ``zone``. The state is kept to the last bit, so that a loaded equilibrium is
the one that was saved; everything else in the file can be read without this package.
"""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .. import files
from ..discretization.meridian import side
from ..errors import InputError, Status
from ..origin import package_version
from ..quantities import quantity, typed
from .error_estimate import ESTIMATED, ErrorEstimate, from_numbers
from .verdict import Verdict

if TYPE_CHECKING:
    import xarray

    from ..scene import Scene
    from .records import Branch, Equilibrium, Jump, PathMemory, SpecialPoint

FORMAT = 1
#: attribute of files that count the volume that a membrane encloses as positive wherever it is; before, one with its inside above did not
_INSIDE = ("inside", "where the membrane encloses a volume, below where it is flat")

Array = NDArray[np.float64]
#: a variable of a data set: dimensions and values
_Variable = tuple[tuple[str, ...], Any]

_SCALARS = ("pressure", "volume", "center_height", "elastic_energy", "magnetic_energy", "load_energy", "residual", "seconds")
_SPECIAL_NUMBERS = ("volume", "pressure", "center_height", "error", "azimuthal")
#: prefix of the variables of special points and of the folds before snaps, which is also the name of their dimension
_SPECIAL, _LIMIT = "special_", "limit_"
_STABLE = {"stable": True, "unstable": False, "marginal": None}
#: in place of a number of negative directions that was not determined
_UNCOUNTED = -1
#: seconds after which another process is thought not to come back from a file
_PATIENCE = 60.0
#: bytes of values that one byte of a file may hold at most: what its compression reaches
_UNFOLDED = 1100


def to_xarray(branch: Branch) -> xarray.Dataset:
    """The branch as one data set: the columns of the table, the profiles at the nodes, the states and the special points.

    Every variable has ``long_name`` and ``units``; the scene is in the attributes as TOML text.
    """
    import xarray

    width = branch[0].state.size if len(branch) else 0
    variables = {**_table_variables(branch), **_equilibrium_variables(list(branch), width, "step"), **_profile_variables(branch)}
    for tag, control, azimuthal in _asked(branch.scene):
        variables |= _verdict_variables(tag, [e.verdict(control, azimuthal=azimuthal) for e in branch])
    if branch.scene.analysis.wrinkling:
        variables |= _zone_variables(branch)
    if branch.scene.analysis.error_estimates:
        variables |= _estimate_variables(branch)
    if branch.special_points is not None:
        variables |= _special_variables(branch.special_points, width, _SPECIAL)
    if branch.jumps:
        limits = [jump.limit for jump in branch.jumps if jump.limit is not None]
        variables["jump_index"] = ("jump",), typed("jump_index", (jump.index for jump in branch.jumps))
        variables["jump_limit"] = ("jump",), typed("jump_limit", (jump.limit is not None for jump in branch.jumps))
        variables |= _special_variables(limits, width, _LIMIT)
    if branch.memory is not None:
        variables["trace_sigma"] = ("trace",), np.array(branch.memory.sigma)
        variables["trace_point"] = ("trace", "unknown"), branch.memory.points
        variables["trace_slope"] = ("trace", "unknown"), branch.memory.slopes
    described = {name: (dims, data, _describe(name)) for name, (dims, data) in variables.items()}
    coordinates = {name: described.pop(name) for name in ("step", "r", "s", "estimated") if name in described}
    return xarray.Dataset(described, coords=coordinates, attrs=_attributes(branch))


def save(branch: Branch, path: str | PathLike[str], facts: Mapping[str, str] | None = None) -> None:
    """Write a branch to a NetCDF file, from which :func:`load` brings it back to the last bit; ``facts`` are further attributes of it."""
    dataset = to_xarray(branch).assign_attrs(facts or {})
    encoding = {
        str(name): {"_FillValue": None, **({"zlib": True, "complevel": 1, "shuffle": True} if variable.ndim == 2 and variable.size else {})}
        for name, variable in dataset.variables.items()
        if variable.dtype.kind == "f"
    }
    write_dataset(dataset, path, encoding)


def write_dataset(dataset: xarray.Dataset, path: str | PathLike[str], encoding: Mapping[str, Any]) -> None:
    """Write a data set to a sealed NetCDF file, whole or not at all."""
    image = io.BytesIO()  # HDF5 itself does not survive a full disk: it is met here, by one plain write
    marked = dataset.assign_attrs(seal=f"{files.SEAL} its digest is the last line of the file, and of all before that line")
    marked.to_netcdf(image, engine="h5netcdf", encoding=encoding)
    content = files.sealed(image.getvalue())
    with files.replace_file(path) as temporary:
        temporary.write_bytes(content)


def load(path: str | PathLike[str]) -> Branch:
    """Bring a saved branch back, without solving anything.

    Raises
    ------
    InputError
        When the file cannot be read, is not one of ours, or has a newer format.
    """
    return branch_of(read_branch_file(path), path)


def branch_of(dataset: xarray.Dataset, path: str | PathLike[str]) -> Branch:
    """The branch of the data set that :func:`read_branch_file` read.

    Raises
    ------
    InputError
        When it is none of ours, or not complete.
    """
    try:
        scene = scene_from_text(dataset.attrs["scene"])
        branch = _branch(dataset, scene)
    except Exception as error:  # there is nothing that a file nobody wrote in this way could not lead to
        raise InputError("path", str(path), f"a complete file written by femmembrane is needed ({reason(error)})") from error
    if not scene.open and _INSIDE[0] not in dataset.attrs and side(scene.mesh) < 0:
        what = "it is of a version that counted V and P of a membrane whose inside is above it as negative; compute it again"
        raise InputError("path", str(path), what)
    return branch


def scene_text(scene: Scene) -> str:
    """The scene as the text of a TOML file."""
    import tomli_w

    return tomli_w.dumps(scene.to_dict())


def scene_from_text(text: str) -> Scene:
    """The scene of a TOML text."""
    from ..scene import Scene

    return Scene.from_dict(tomllib.loads(text))


def _table_variables(branch: Branch) -> dict[str, _Variable]:
    from .table import columns, rows

    names, table = columns(branch), list(rows(branch))
    cells = zip(*table, strict=True) if table else ([] for _ in names)
    return {name: (("step",), typed(name, column)) for name, column in zip(names, cells, strict=True)}


def _equilibrium_variables(equilibria: Sequence[Equilibrium], width: int, dimension: str, prefix: str = "") -> dict[str, _Variable]:
    """What :func:`_equilibria` needs to build the records again; ``width`` is the length of their states."""
    absent = {
        name
        for name, kind in (("magnetic_energy", "sources"), ("load_energy", "loads"))
        if not any(getattr(e.scene, kind) for e in equilibria)
    }
    scalars = [name for name in _SCALARS if name not in absent]
    return {
        **{prefix + name: ((dimension,), typed(name, (getattr(e, name) for e in equilibria))) for name in scalars},
        prefix + "iterations": ((dimension,), typed("iterations", (e.iterations for e in equilibria))),
        prefix + "status": ((dimension,), typed("status", (e.status.value for e in equilibria))),
        prefix + "state": ((dimension, "coefficient"), np.array([e.state for e in equilibria]).reshape(len(equilibria), width)),
    }


def _profile_variables(branch: Branch) -> dict[str, _Variable]:
    profiles = [e.profile() for e in branch]
    if not profiles:
        return {}
    places = [key for key in ("r", "s") if key in profiles[0]]
    values = {key: (("step", "node"), np.array([p[key] for p in profiles])) for key in profiles[0] if key not in places}
    return {**{key: (("node",), np.array(profiles[0][key])) for key in places}, **values}


def _asked(scene: Scene) -> list[tuple[str, str | None, int]]:
    """(name in columns, control, azimuthal) of the verdicts that a scene asks for."""
    return [*((c, c, 0) for c in scene.analysis.stability), *((f"n{n}", None, n) for n in scene.analysis.azimuthal_modes)]


def _verdict_variables(tag: str, verdicts: Sequence[Verdict]) -> dict[str, _Variable]:
    """All of the verdicts of one class that the columns of the table leave out, and :func:`_verdicts` needs to build them again."""
    counts = (_UNCOUNTED if v.negative_directions is None else v.negative_directions for v in verdicts)
    variables: dict[str, _Variable] = {
        f"verdict_{tag}": (("step",), typed("verdict_", (v.word for v in verdicts))),
        f"lambda_error_{tag}": (("step",), typed("error", (v.error for v in verdicts))),
        f"negative_directions_{tag}": (("step",), typed("negative_directions", counts)),
        f"reason_{tag}": (("step",), typed("reason", (v.reason for v in verdicts))),
    }
    shapes = [_shape(v) for v in verdicts]
    for key, known in next((s for s in shapes if s), {}).items():
        dimension = f"coefficient_{tag}" if key == "coefficients" else "node"
        variables[f"mode_{tag}_{key}"] = (("step", dimension), np.array([s.get(key, np.full_like(known, np.nan)) for s in shapes]))
    return variables


def _shape(verdict: Verdict) -> dict[str, Array]:
    """The mode of a verdict by component, empty without a mode; its radii are those of the profile's nodes."""
    mode = verdict.mode
    if mode is None or verdict.coefficients is None:
        return {}
    return {**{key: values for key, values in mode.items() if key != "r"}, "coefficients": verdict.coefficients}


def _zone_variables(branch: Branch) -> dict[str, _Variable]:
    """The zones one after the other, for readers of the file: a loaded branch finds them again from its states."""
    from .table import ZONE_COLUMNS, zone_rows

    table = list(zone_rows(branch))
    columns = zip(*table, strict=True) if table else ([] for _ in ZONE_COLUMNS)
    return {f"zone_{name}": (("zone",), typed(name, column)) for name, column in zip(ZONE_COLUMNS, columns, strict=True)}


def _estimate_variables(branch: Branch) -> dict[str, _Variable]:
    """All of the error estimates, which :func:`_estimates` needs to build them again."""
    from .table import estimated

    found = [eq.error_estimate(estimated(branch.scene)[0]) for eq in branch]
    parts = {"error_value": "value", "error_estimate": "error"}
    words = {"error_control": "control", "error_method": "method", "error_reason": "reason"}
    numbers = {
        variable: np.array([[getattr(getattr(e, q), part) for q in ESTIMATED] for e in found]).reshape(len(found), len(ESTIMATED))
        for variable, part in parts.items()
    }
    return {
        "estimated": (("estimated",), np.array(ESTIMATED, dtype=str)),
        **{variable: (("step", "estimated"), values) for variable, values in numbers.items()},
        **{variable: (("step",), np.array([getattr(e, word) for e in found], dtype=str)) for variable, word in words.items()},
    }


def _special_variables(points: Sequence[SpecialPoint], width: int, prefix: str) -> dict[str, _Variable]:
    dimension = prefix + "point"
    numbers = {prefix + name: ((dimension,), typed(name, (getattr(p, name) for p in points))) for name in _SPECIAL_NUMBERS}
    kinds: dict[str, _Variable] = {prefix + "kind": ((dimension,), typed("kind", (str(p.kind) for p in points)))}
    tangents: dict[str, _Variable] = {}
    if any(p.tangent is not None for p in points):
        none = np.full(width + 1, np.nan)
        tangents[prefix + "tangent"] = (dimension, "unknown"), np.array([none if p.tangent is None else p.tangent for p in points])
    states = _equilibrium_variables([p.equilibrium for p in points], width, dimension, prefix + "equilibrium_")
    return {**kinds, **numbers, **tangents, **states}


def _describe(name: str) -> dict[str, str]:
    prefix = next((p for p in (_SPECIAL, _LIMIT) if name.startswith(p)), "")
    base = name.removeprefix(prefix).removeprefix("equilibrium_")
    known = quantity(base)
    return {"long_name": known.meaning if base == name else f"{known.meaning}, at the special point", "units": known.unit}


def _attributes(branch: Branch) -> dict[str, Any]:
    return {
        "title": branch.scene.title or "Equilibria of an inflated membrane",
        "femmembrane_version": package_version(),
        "format": FORMAT,
        _INSIDE[0]: _INSIDE[1],
        "status": branch.status.value,
        "message": branch.message,
        **({"solver": branch.solver} if branch.solver else {}),
        **({"remarks": json.dumps(branch.remarks)} if branch.remarks else {}),
        "timings": json.dumps(branch.timings),
        "scene": scene_text(branch.scene),
        **_trace_attributes(branch.memory),
    }


def _trace_attributes(memory: PathMemory | None) -> dict[str, Any]:
    from .records import TraceMemory

    if not isinstance(memory, TraceMemory):
        return {}
    unexplained = {"trace_unexplained": json.dumps(memory.unexplained)} if memory.unexplained else {}
    return {"trace_step": memory.step, "trace_regular": memory.regular, **unexplained}


def read_dataset(path: str | PathLike[str], what: str) -> xarray.Dataset:
    """All of a NetCDF file, after its digest was checked; nothing that it refers to outside of itself is read.

    Files of earlier versions have no digest; neither has what another program wrote.

    Raises
    ------
    InputError
        When it cannot be read or was damaged; ``what`` is needed in its place.
    """
    try:
        content, whole = files.unsealed(files.read_bytes(path))
        if not whole:
            _try_out(content)
        return parsed(content)
    except Exception as error:  # there is nothing that libraries do not raise when they meet bytes that nobody wrote
        raise InputError("path", str(path), f"{what} is needed ({reason(error)})") from error


def parsed(content: bytes) -> xarray.Dataset:
    """The data set in the bytes of a NetCDF file; raises anything for bytes that nobody wrote."""
    import xarray

    _refuse_elsewhere(content)
    # the values as they stand: no times, masks or scales are in our files
    dataset = xarray.load_dataset(io.BytesIO(content), engine="h5netcdf", decode_times=False, mask_and_scale=False)
    dataset.attrs.pop("seal", None)
    return dataset


def _try_out(content: bytes) -> None:
    """Let another process read bytes that no digest vouches for: of damaged ones HDF5 may never come back, or end the process."""
    code = "import sys; from femmembrane.results.store import parsed; parsed(sys.stdin.buffer.read())"
    places = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    try:
        done = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", code], input=content, capture_output=True, env=places, timeout=_PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        raise ValueError("it is damaged: to read it would take for ever") from None
    if done.returncode not in (0, 1):  # 1: an exception, which is met here as well
        raise ValueError("it is damaged: to read it would end the process")


def reason(error: Exception) -> str:
    """What went wrong while a file was read, in one line that is not too long."""
    text = (error.strerror if isinstance(error, OSError) else None) or str(error)
    if not isinstance(error, (OSError, ValueError)):
        text = f"{type(error).__name__}: {text}"
    line = " ".join(text.split())
    return line if len(line) <= 200 else line[:197] + "..."


def _refuse_elsewhere(content: bytes) -> None:
    """Refuse a file of which a part is in another one, or that unfolds to much more than it can have held."""
    import h5py

    with h5py.File(io.BytesIO(content), "r") as file:
        room = _UNFOLDED * len(content)
        for name in file:
            if not isinstance(file.get(name, getlink=True), h5py.HardLink):
                raise ValueError(f"{name!r} is a link")
            part = file[name]
            if not isinstance(part, h5py.Dataset):
                raise ValueError(f"{name!r} is no variable")
            if part.external or part.is_virtual:
                raise ValueError(f"the values of {name!r} are in another file")
            if not _only_a_dimension(part):
                room -= part.size * part.dtype.itemsize
            if room < 0:
                raise ValueError("its variables are larger than it can hold")


def _only_a_dimension(part: Any) -> bool:
    """Whether a variable only gives a dimension its length: it has no values."""
    return bytes(part.attrs.get("NAME", b"")).startswith(b"This is a netCDF dimension but not a netCDF variable")


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
    from .records import Branch

    equilibria = tuple(_equilibria(dataset, scene))
    for tag, control, azimuthal in _asked(scene):
        for equilibrium, verdict in zip(equilibria, _verdicts(dataset, tag, control, azimuthal), strict=True):
            equilibrium._verdicts[control, azimuthal] = verdict
    for equilibrium, estimate in zip(equilibria, _estimates(dataset), strict=False):
        equilibrium._errors[estimate.control] = estimate
    return Branch(
        scene=scene,
        equilibria=equilibria,
        special_points=_special_points(dataset, scene, _SPECIAL),
        status=Status(dataset.attrs["status"]),
        message=str(dataset.attrs["message"]),
        timings={str(stage): float(seconds) for stage, seconds in json.loads(dataset.attrs["timings"]).items()},
        memory=_memory(dataset),
        jumps=_jumps(dataset, scene, equilibria),
        # younger than the format
        solver=str(dataset.attrs.get("solver", "")),
        remarks=tuple(map(str, json.loads(dataset.attrs.get("remarks", "[]")))),
    )


def _special_points(dataset: xarray.Dataset, scene: Scene, prefix: str) -> tuple[SpecialPoint, ...] | None:
    from .records import SpecialPoint

    if prefix + "kind" not in dataset:
        return None
    kinds = [str(k) for k in dataset[prefix + "kind"].values]
    numbers = zip(*(dataset[prefix + name].values.tolist() for name in _SPECIAL_NUMBERS), strict=True)
    states = _equilibria(dataset, scene, prefix + "equilibrium_")
    # younger than the format, and only where there are branch points
    tangents: list[Array | None] = [None] * len(kinds)
    if prefix + "tangent" in dataset:
        rows = np.array(dataset[prefix + "tangent"].values, dtype=np.float64)
        tangents = [row if np.isfinite(row).all() else None for row in rows]
    return tuple(
        SpecialPoint(kind=k, **dict(zip(_SPECIAL_NUMBERS, n, strict=True)), equilibrium=e, tangent=t)
        for k, n, e, t in zip(kinds, numbers, states, tangents, strict=True)
    )


def _memory(dataset: xarray.Dataset) -> PathMemory | None:
    from .records import PathMemory, TraceMemory

    if "trace_sigma" not in dataset:
        return None
    sigma = _finite(dataset, "trace_sigma", dataset.sizes["trace"])
    shape = len(sigma), dataset.sizes["coefficient"] + 1
    points, slopes = (_finite(dataset, name, *shape) for name in ("trace_point", "trace_slope"))
    if "trace_step" not in dataset.attrs:
        return PathMemory(tuple(sigma.tolist()), points, slopes)
    unexplained = tuple(map(str, json.loads(dataset.attrs.get("trace_unexplained", "[]"))))
    step, regular = float(dataset.attrs["trace_step"]), int(dataset.attrs["trace_regular"])
    if not (len(sigma) and 0 < step < np.inf and 1 <= regular <= dataset.sizes["step"]):
        raise ValueError("the memory of the trace does not belong to it")
    return TraceMemory(tuple(sigma.tolist()), points, slopes, step, regular, unexplained)


def _jumps(dataset: xarray.Dataset, scene: Scene, equilibria: tuple[Equilibrium, ...]) -> tuple[Jump, ...]:
    from .records import Jump

    if "jump_index" not in dataset:
        return ()
    limits = iter(_special_points(dataset, scene, _LIMIT) or ())
    located = list(zip(dataset["jump_index"].values.tolist(), dataset["jump_limit"].values.tolist(), strict=True))
    if not all(0 <= index < len(equilibria) for index, _ in located):
        raise ValueError("a snap lands on no equilibrium")
    return tuple(Jump(index, next(limits) if known else None, equilibria[index]) for index, known in located)


def _equilibria(dataset: xarray.Dataset, scene: Scene, prefix: str = "") -> list[Equilibrium]:
    from .records import Equilibrium

    count = len(dataset[prefix + "status"])
    states = _finite(dataset, prefix + "state", count, _unknowns(scene) if count else dataset.sizes["coefficient"])
    states.flags.writeable = False
    present = {"magnetic_energy": bool(scene.sources), "load_energy": bool(scene.loads)}
    needed = [name for name in _SCALARS if (count and present.get(name, True)) or prefix + name in dataset]
    scalars = {name: _finite(dataset, prefix + name, count).tolist() for name in needed}
    scalars.setdefault("magnetic_energy", [0.0] * count)
    return [
        Equilibrium(
            **{name: values[k] for name, values in scalars.items()},
            iterations=int(dataset[prefix + "iterations"].values[k]),
            status=Status(str(dataset[prefix + "status"].values[k])),
            scene=scene,
            state=states[k],
        )
        for k in range(count)
    ]


def _finite(dataset: xarray.Dataset, name: str, *shape: int) -> Array:
    """The values of a variable, which must be numbers in this shape."""
    values = dataset[name].values
    if values.shape != shape or values.dtype.kind != "f" or not np.isfinite(values).all():
        raise ValueError(f"{name} are no {' x '.join(map(str, shape))} finite numbers")
    return np.array(values, dtype=np.float64)


def _unknowns(scene: Scene) -> int:
    """The number of unknowns of the states of a scene."""
    from ..discretization.space import space_of_scene

    return int(space_of_scene(scene).n_free)


def _verdicts(dataset: xarray.Dataset, tag: str, control: str | None, azimuthal: int) -> Iterator[Verdict]:

    parts = {str(name).removeprefix(f"mode_{tag}_"): v.values for name, v in dataset.items() if str(name).startswith(f"mode_{tag}_")}
    for k in range(dataset.sizes["step"]):
        mode = {"r": dataset["r"].values, **{key: values[k] for key, values in parts.items()}}
        coefficients = mode.pop("coefficients", None)
        known = coefficients is not None and not np.isnan(coefficients).any()
        count = int(dataset[f"negative_directions_{tag}"].values[k])
        yield Verdict(
            stable=_STABLE[str(dataset[f"verdict_{tag}"].values[k])],
            smallest_eigenvalue=float(dataset[f"lambda_{tag}"].values[k]),
            error=float(dataset[f"lambda_error_{tag}"].values[k]),
            control=control,
            azimuthal=azimuthal,
            negative_directions=None if count == _UNCOUNTED else count,
            reason=str(dataset[f"reason_{tag}"].values[k]),
            coefficients=coefficients if known else None,
            _shape=partial(_stored_shape, mode) if known else None,
        )


def _estimates(dataset: xarray.Dataset) -> Iterator[ErrorEstimate]:

    if "error_estimate" not in dataset:
        return
    names = [str(name) for name in dataset["estimated"].values]
    for k in range(dataset.sizes["step"]):
        values, errors = (dict(zip(names, dataset[v].values[k].tolist(), strict=True)) for v in ("error_value", "error_estimate"))
        control, method, reason = (str(dataset[f"error_{word}"].values[k]) for word in ("control", "method", "reason"))
        yield from_numbers(control, values, errors, method, reason)


def _stored_shape(mode: Mapping[str, Array], _: Array) -> Mapping[str, Array]:
    """In place of the function that finds the shape of a mode from its coefficients: the shape that was found."""
    return mode
