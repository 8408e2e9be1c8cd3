"""Equilibria, special points, snaps and the memory of a path as variables of a data set, and back.

Functions that end in ``_variables`` answer the variables by their names, with dimensions and values; those that end in ``_of`` build the
records again.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import repeat
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..discretization.meridian import on_own_ends
from ..errors import Status
from ..quantities import typed
from ..scene.variation import Parameter
from .analyses.base import Variable
from .equilibrium import Equilibrium
from .path_memory import PathMemory, TraceMemory
from .ragged import row_of, stacked
from .special_point import Jump, SpecialPoint
from .zones import ZONE_CHANGES, ZoneChange

if TYPE_CHECKING:
    import xarray

    from ..scene import Scene

Array = NDArray[np.float64]

_SCALARS = (
    "pressure",
    "volume",
    "center_height",
    "elastic_energy",
    "magnetic_energy",
    "load_energy",
    "electric_energy",
    "residual",
    "seconds",
)
_SPECIAL_NUMBERS = ("volume", "pressure", "center_height", "error", "azimuthal")
#: prefix of the variables of special points and of the folds before snaps, which is also the name of their dimension
SPECIAL, LIMIT = "special_", "limit_"
#: prefix of the variables of the states on the mesh of the branch, where elements follow zones
ON_BRANCH = "branch_"


def equilibrium_variables(equilibria: Sequence[Equilibrium], width: int, dimension: str, prefix: str = "") -> dict[str, Variable]:
    """What :func:`equilibria_of` needs to build the records again; ``width`` is the length of their states."""
    absent = {
        name
        for name, kind in (("magnetic_energy", "sources"), ("load_energy", "loads"), ("electric_energy", "electric"))
        if not any(getattr(e.scene, kind) for e in equilibria)
    }
    scalars = [name for name in _SCALARS if name not in absent]
    return {
        **_border_variables(equilibria, dimension, prefix),
        **{prefix + name: ((dimension,), typed(name, (getattr(e, name) for e in equilibria))) for name in scalars},
        prefix + "iterations": ((dimension,), typed("iterations", (e.iterations for e in equilibria))),
        prefix + "status": ((dimension,), typed("status", (e.status.value for e in equilibria))),
        prefix + "state": ((dimension, "coefficient"), stacked([e.state for e in equilibria], width)),
        **_on_branches(equilibria, width, dimension, prefix),
    }


def _on_branches(equilibria: Sequence[Equilibrium], width: int, dimension: str, prefix: str) -> dict[str, Variable]:
    """The states on the mesh of the branch, of those that were put on borders after it, with their own ends of elements beside bodies."""
    if all(e.on_branch is None for e in equilibria):
        return {}
    states = equilibrium_variables([e.of_branch for e in equilibria], width, dimension, prefix + ON_BRANCH)
    if all(e.scene.mesh == e.of_branch.scene.mesh for e in equilibria):
        return states
    return {prefix + "element_ends": ((dimension, "element_end"), np.array([e.scene.mesh.breakpoints() for e in equilibria])), **states}


def mesh_variables(equilibria: Sequence[Equilibrium], dimension: str, prefix: str = "") -> dict[str, Variable]:
    """Where the mesh changes along the branch: the ends of the elements of each equilibrium, their degree, the error estimated there."""
    estimated = [getattr(e.scene.mesh, "estimated", None) for e in equilibria]
    return {
        prefix + "mesh_ends": ((dimension, prefix + "mesh_end"), stacked(e.scene.mesh.breakpoints() for e in equilibria)),
        prefix + "mesh_degree": ((dimension,), typed("mesh_degree", (e.scene.degree for e in equilibria))),
        prefix + "mesh_estimated": ((dimension,), typed("mesh_estimated", (np.nan if e is None else e for e in estimated))),
    }


def _meshed(dataset: xarray.Dataset, scene: Scene, prefix: str) -> list[Scene]:
    """The scene on the mesh of each equilibrium."""
    known: dict[tuple[bytes, int, float], Scene] = {}
    found = []
    columns = (dataset[prefix + name].values for name in ("mesh_ends", "mesh_degree", "mesh_estimated"))
    for row, degree, estimated in zip(*columns, strict=True):
        ends = row_of(np.asarray(row, dtype=float))
        key = ends.tobytes(), int(degree), float(estimated)
        if key not in known:
            accuracy = getattr(scene.mesh, "accuracy", None)
            mesh = scene.mesh.on_ends(ends, accuracy, None if np.isnan(estimated) else float(estimated))
            same = mesh == scene.mesh and int(degree) == scene.degree
            known[key] = scene if same else scene.replace(mesh=mesh, degree=int(degree))
        found.append(known[key])
    return found


def _border_variables(equilibria: Sequence[Equilibrium], dimension: str, prefix: str) -> dict[str, Variable]:
    """Ends of elements at borders, with their places: as many columns as an equilibrium has most."""
    most = max((len(e.scene.borders) for e in equilibria), default=0)
    if not most:
        return {}
    ends, places = np.full((len(equilibria), most), -1), np.full((len(equilibria), most), np.nan)
    for k, equilibrium in enumerate(equilibria):
        for j, (end, place) in enumerate(equilibrium.scene.borders):
            ends[k, j], places[k, j] = end, place
    shape = dimension, prefix + "border"
    return {prefix + "border_end": (shape, ends), prefix + "border_place": (shape, places)}


def _borders_of(dataset: xarray.Dataset, prefix: str) -> list[tuple[tuple[int, float], ...]]:
    ends, places = dataset[prefix + "border_end"].values.tolist(), dataset[prefix + "border_place"].values.tolist()
    return [tuple((int(k), float(s)) for k, s in zip(*row, strict=True) if k >= 0) for row in zip(ends, places, strict=True)]


def equilibria_of(dataset: xarray.Dataset, scene: Scene, over: str, prefix: str = "") -> list[Equilibrium]:
    """The equilibria of a scene, or of scenes that differ in the number ``over``; ``prefix`` is that of their variables."""
    count = len(dataset[prefix + "status"])
    scenes = _meshed(dataset, scene, prefix) if prefix + "mesh_ends" in dataset else [scene] * count
    states = _states(dataset, prefix + "state", scenes)
    present = {"magnetic_energy": bool(scene.sources), "load_energy": bool(scene.loads), "electric_energy": scene.electric is not None}
    needed = [name for name in _SCALARS if (count and present.get(name, True)) or prefix + name in dataset]
    scalars = {name: _finite(dataset, prefix + name, count).tolist() for name in needed}
    scalars.setdefault("magnetic_energy", [0.0] * count)
    if over:
        scenes = [Parameter(scene, over).scene_at(value) for value in _finite(dataset, prefix + over, count).tolist()]
    on_branch: list[Equilibrium | None] = [None] * count
    borders = _borders_of(dataset, prefix) if prefix + "border_end" in dataset else [()] * count
    if prefix + ON_BRANCH + "state" in dataset:
        there = equilibria_of(dataset, scene, over, prefix + ON_BRANCH)
        own_ends = [each.mesh.breakpoints() for each in scenes]
        if prefix + "element_ends" in dataset:
            own_ends = list(_finite(dataset, prefix + "element_ends", count, scene.mesh.elements + 1))
        for k, ends in enumerate(own_ends):
            if not np.array_equal(ends, scenes[k].mesh.breakpoints()):
                scenes[k] = scenes[k].replace(mesh=on_own_ends(scenes[k].mesh, ends))
            if scenes[k].mesh != there[k].scene.mesh or borders[k] != there[k].scene.borders:
                on_branch[k] = there[k]
    scenes = [each.bordered(own) for each, own in zip(scenes, borders, strict=True)]
    return [
        Equilibrium(
            **{name: values[k] for name, values in scalars.items()},
            iterations=int(dataset[prefix + "iterations"].values[k]),
            status=Status(str(dataset[prefix + "status"].values[k])),
            scene=scenes[k],
            state=states[k],
            on_branch=on_branch[k],
        )
        for k in range(count)
    ]


def _states(dataset: xarray.Dataset, name: str, scenes: Sequence[Scene]) -> list[Array]:
    """States of scenes, each as long as its mesh says."""
    widths = [_unknowns(scene) for scene in scenes]
    if len(set(widths)) < 2 and (not widths or dataset.sizes["coefficient"] == widths[0]):
        rows = _finite(dataset, name, len(scenes), widths[0] if widths else dataset.sizes["coefficient"])
        rows.flags.writeable = False
        return list(rows)
    states = [np.array(row_of(row)) for row in dataset[name].values]
    for state, width in zip(states, widths, strict=True):
        if state.shape != (width,) or not np.isfinite(state).all():
            raise ValueError(f"{name} are no finite numbers, as many as the meshes have unknowns")
        state.flags.writeable = False
    return states


def special_variables(points: Sequence[SpecialPoint], width: int, prefix: str, over: str, changes: bool = False) -> dict[str, Variable]:
    """What :func:`special_points_of` needs to build the records again, their equilibria included, over a number or none; ``changes`` says
    that their meshes may differ.
    """
    dimension = prefix + "point"
    numbers = {prefix + name: ((dimension,), typed(name, (getattr(p, name) for p in points))) for name in _SPECIAL_NUMBERS}
    kinds: dict[str, Variable] = {prefix + "kind": ((dimension,), typed("kind", (str(p.kind) for p in points)))}
    tangents: dict[str, Variable] = {}
    if any(p.tangent is not None for p in points):
        none = np.full(0, np.nan)
        rows = stacked([none if p.tangent is None else p.tangent for p in points], width + 1)
        tangents[prefix + "tangent"] = (dimension, "unknown"), rows
    states = equilibrium_variables([p.equilibrium for p in points], width, dimension, prefix + "equilibrium_")
    own: dict[str, Variable] = {}
    if over:
        own[f"{prefix}equilibrium_{over}"] = (dimension,), typed(over, (p.equilibrium.number(over) for p in points))
    if changes:
        own |= mesh_variables([p.equilibrium for p in points], dimension, prefix + "equilibrium_")
    return {**kinds, **own, **numbers, **tangents, **_zone_variables(points, dimension, prefix), **states}


def _zone_variables(points: Sequence[SpecialPoint], dimension: str, prefix: str) -> dict[str, Variable]:
    """Where zones of a tension field open and close."""
    if not any(p.zone for p in points):
        return {}
    zones = [p.zone or ZoneChange("", "", float("nan"), float("nan")) for p in points]
    return {
        f"{prefix}changing_zone_{name}": ((dimension,), typed(f"changing_zone_{name}", (getattr(zone, name) for zone in zones)))
        for name in ZONE_CHANGES
    }


def _zones_of(dataset: xarray.Dataset, prefix: str, count: int) -> list[ZoneChange | None]:
    if f"{prefix}changing_zone_kind" not in dataset:
        return [None] * count
    kinds, places = (map(str, dataset[f"{prefix}changing_zone_{name}"].values) for name in ZONE_CHANGES[:2])
    radii = (dataset[f"{prefix}changing_zone_{name}"].values.tolist() for name in ZONE_CHANGES[2:])
    return [ZoneChange(*each) if each[0] else None for each in zip(kinds, places, *radii, strict=True)]


def special_points_of(dataset: xarray.Dataset, scene: Scene, over: str, prefix: str) -> tuple[SpecialPoint, ...] | None:
    """The special points, None where none were looked for."""
    if prefix + "kind" not in dataset:
        return None
    kinds = [str(k) for k in dataset[prefix + "kind"].values]
    numbers = zip(*(dataset[prefix + name].values.tolist() for name in _SPECIAL_NUMBERS), strict=True)
    states = equilibria_of(dataset, scene, over, prefix + "equilibrium_")
    # younger than the format, and only where there are branch points
    tangents: list[Array | None] = [None] * len(kinds)
    if prefix + "tangent" in dataset:
        rows = [np.array(row_of(row)) for row in dataset[prefix + "tangent"].values]
        tangents = [row if row.size == e.state.size + 1 and np.isfinite(row).all() else None for row, e in zip(rows, states, strict=True)]
    return tuple(
        SpecialPoint(kind=k, **dict(zip(_SPECIAL_NUMBERS, n, strict=True)), equilibrium=e, over=over, tangent=t, zone=z)
        for k, n, e, t, z in zip(kinds, numbers, states, tangents, _zones_of(dataset, prefix, len(kinds)), strict=True)
    )


def memory_variables(memory: PathMemory | None, changes: bool = False) -> dict[str, Variable]:
    """The path that predicts the next equilibrium. Where the mesh changes it is one of the last mesh."""
    if memory is None:
        return {}
    border = memory.border if isinstance(memory, TraceMemory) else None
    return {
        **({} if border is None else {"trace_border": (("coefficient",), border)}),
        "trace_sigma": (("trace",), np.array(memory.sigma)),
        "trace_point": (("trace", "trace_unknown" if changes else "unknown"), memory.points),
        "trace_slope": (("trace", "trace_unknown" if changes else "unknown"), memory.slopes),
    }


def memory_of(dataset: xarray.Dataset) -> PathMemory | None:
    """The path that predicts the next equilibrium, None where none was kept."""
    if "trace_sigma" not in dataset:
        return None
    sigma = _finite(dataset, "trace_sigma", dataset.sizes["trace"])
    shape = len(sigma), dataset.sizes["coefficient"] + (2 if "trace_border" in dataset else 1)
    if "trace_unknown" in dataset.sizes:
        shape = len(sigma), dataset.sizes["trace_unknown"]
    points, slopes = (_finite(dataset, name, *shape) for name in ("trace_point", "trace_slope"))
    sizes = None
    if "mesh_sizes" in dataset.attrs:
        pressure, eigenvalues = map(float, json.loads(str(dataset.attrs["mesh_sizes"])))
        sizes = pressure, eigenvalues
    if "trace_step" not in dataset.attrs:
        return PathMemory(tuple(sigma.tolist()), points, slopes, sizes=sizes)
    unexplained = tuple(map(str, json.loads(dataset.attrs.get("trace_unexplained", "[]"))))
    step, regular = float(dataset.attrs["trace_step"]), int(dataset.attrs["trace_regular"])
    if not (len(sigma) and 0 < step < np.inf and 1 <= regular <= dataset.sizes["step"]):
        raise ValueError("the memory of the trace does not belong to it")
    known = float(dataset.attrs.get("trace_known", 0.0))
    border = _finite(dataset, "trace_border", dataset.sizes["coefficient"]) if "trace_border" in dataset else None
    return TraceMemory(tuple(sigma.tolist()), points, slopes, step, regular, unexplained, known, border, sizes=sizes)


def memory_attributes(memory: PathMemory | None) -> dict[str, Any]:
    """What a trace remembers beside the points of its path."""
    sizes = {} if memory is None or memory.sizes is None else {"mesh_sizes": json.dumps(memory.sizes)}
    if not isinstance(memory, TraceMemory):
        return sizes
    unexplained = {"trace_unexplained": json.dumps(memory.unexplained)} if memory.unexplained else {}
    return {"trace_step": memory.step, "trace_regular": memory.regular, "trace_known": memory.known, **unexplained, **sizes}


def jump_variables(jumps: Sequence[Jump], width: int, over: str, changes: bool = False) -> dict[str, Variable]:
    """Where a run snapped, and the folds before."""
    if not jumps:
        return {}
    limits = [jump.limit for jump in jumps if jump.limit is not None]
    return {
        "jump_index": (("jump",), typed("jump_index", (jump.index for jump in jumps))),
        "jump_limit": (("jump",), typed("jump_limit", (jump.limit is not None for jump in jumps))),
        "jump_held": (("jump",), typed("jump_held", (jump.held for jump in jumps))),
        **special_variables(limits, width, LIMIT, over, changes),
    }


def jumps_of(dataset: xarray.Dataset, scene: Scene, over: str, equilibria: tuple[Equilibrium, ...]) -> tuple[Jump, ...]:
    """Where a run snapped."""
    if "jump_index" not in dataset:
        return ()
    limits = iter(special_points_of(dataset, scene, over, LIMIT) or ())
    located = list(zip(dataset["jump_index"].values.tolist(), dataset["jump_limit"].values.tolist(), strict=True))
    if not all(0 <= index < len(equilibria) for index, _ in located):
        raise ValueError("a snap lands on no equilibrium")
    held = map(str, dataset["jump_held"].values) if "jump_held" in dataset else repeat("")  # younger than the format
    return tuple(Jump(index, next(limits) if known else None, equilibria[index], word) for (index, known), word in zip(located, held))  # noqa: B905


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
