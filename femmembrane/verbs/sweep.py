"""One question asked of a grid of scenes."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import asdict, dataclass, fields
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import whole
from ..discretization.meridian import side
from ..errors import InputError
from ..memory import require
from ..results.finished_scenes import FinishedScenes
from ..results.grid import DIMENSIONS, dataset_of
from ..results.store import scene_text
from ..results.sweep import Plan, Sweep, common_scales
from ..scene import Scene
from ..scene.keys import MAX_SCENES, set_key
from ..scene.own import own_identity
from . import parallel
from .sweep_rows import COMPUTED, UNEXPECTED, Options, Row, check, compute

if TYPE_CHECKING:
    pass

#: called with the number of scenes that are done, the number of all scenes, and the number of done scenes without a result
OnScene = Callable[[int, int, int], None]
#: name of the file with the finished scenes, in the folder of a sweep
KEPT = "scenes.sqlite"
#: seconds for which a sweep works in one process, about as long as it takes to start others
_ALONE = 2.0
#: scenes that are timed for an estimate
_SAMPLE = 4


def sweep(
    scene: Scene,
    over: Mapping[str, Iterable[Any]],
    *,
    quantity: str = "branch",
    pressure: float | None = None,
    volume: float | None = None,
    direction: int = 1,
    workers: int | None = None,
    scheduler: str | None = None,
    out: str | PathLike[str] | None = None,
    on_scene: OnScene | None = None,
) -> Sweep:
    """Compute one quantity of every scene of a grid.

    All scenes are checked before the first is computed. Each is computed on its own, from a cold start: its row is the same to the last bit
    in any process. A scene that fails is a row with its reason.

    Parameters
    ----------
    scene : Scene
    over : mapping of str to values
        Keys as in a scene file, such as ``source.0.strength`` or ``mesh.elements``, and the values each takes: numbers, booleans or texts.
    quantity : {"branch", "run", "equilibria", "tipping", "wrinkling"}
        "branch": a branch by arc length with its special points. "run": what [run] says. "equilibria": all equilibria at a pressure or
        volume. "tipping": where along the branch stability against one wave around the axis is first lost or regained. "wrinkling": where
        the stresses first become compressive (``analysis.wrinkling`` says which; default the mechanical ones). All but "equilibria" follow
        the scene's [run].
    pressure, volume : float, optional
        For "equilibria": exactly one of them.
    direction : {1, -1}
        For "branch", "tipping" and "wrinkling": whether to set out to larger or smaller volumes.
    workers : int, optional
        Processes on this machine; 1 stays in this process. Default: one a core, started only for what is left after the first two seconds.
        With more than one, a script must call this below ``if __name__ == "__main__":``.
    scheduler : str, optional
        Address of a running Dask scheduler (``tcp://...``) whose workers compute, in place of this machine.
    out : path, optional
        Folder in which finished scenes are kept. No sweep with this folder computes them again, so that an interrupted sweep goes on where
        it was.
    on_scene : callable, optional
        Called with (done, all, failed) after each scene.

    Returns
    -------
    Sweep

    Raises
    ------
    InputError
        For a key that the scenes do not have, for a value that a scene refuses, and for any other argument that cannot be used.

    Examples
    --------
    The pressure at the limit point of two Mooney-Rivlin discs:

    >>> import femmembrane as fm
    >>> run = fm.Run(control="arc-length", start=0.5, until={"volume": 10.0})
    >>> scene = fm.Scene(material=fm.MooneyRivlin(0.01), mesh=fm.disc(8), run=run)
    >>> found = fm.sweep(scene, {"material.ratio": [0.01, 0.05]}, workers=1)
    >>> [round(float(p), 4) for p in found.to_xarray()["limit_pressure"][:, 0]]
    [1.9265, 2.1605]
    """
    grid = _Grid.of(scene, over, quantity, Options(pressure, volume, direction))
    workers = _workers(workers, scheduler)
    with ExitStack() as stack:
        kept = None if out is None else stack.enter_context(FinishedScenes(Path(out) / KEPT))
        rows = _known(grid, kept)
        failed = sum(not row.values for row in rows.values())
        if on_scene is not None:
            on_scene(len(rows), len(grid.distinct), failed)
        tasks = grid.tasks(set(rows))
        missing = len(grid.distinct) - len(rows)
        for key, row in _computed(tasks, workers, scheduler, parallel.sendable(scene)) if missing else ():
            rows[key] = row
            failed += not row.values
            _keep(kept, key, row)
            if on_scene is not None:
                on_scene(len(rows), len(grid.distinct), failed)
    facts = {
        "quantity": quantity,
        "scene": scene_text(scene),
        "over": json.dumps(list(grid.over)),
        "options": json.dumps(asdict(grid.options)),
    }
    return Sweep(
        scene, grid.over, quantity, dataset_of(grid.over, [rows[key] for key in grid.keys], facts, common_scales(scene, grid.over))
    )


def plan_sweep(
    scene: Scene,
    over: Mapping[str, Iterable[Any]],
    *,
    quantity: str = "branch",
    pressure: float | None = None,
    volume: float | None = None,
    direction: int = 1,
    workers: int | None = None,
    out: str | PathLike[str] | None = None,
) -> Plan:
    """Count the scenes of a :func:`sweep` and time a few of them, spread over the grid, in this process.

    Parameters
    ----------
    scene : Scene
    over : mapping of str to values
        As in :func:`sweep`.
    quantity, pressure, volume, direction, workers, out
        As in :func:`sweep`.

    Returns
    -------
    Plan
        Counts and expected seconds; ``print`` shows them.

    Raises
    ------
    InputError
        As :func:`sweep`.
    """
    processes = _workers(workers, None) or parallel.cores()
    grid = _Grid.of(scene, over, quantity, Options(pressure, volume, direction))
    with ExitStack() as stack:
        kept = stack.enter_context(FinishedScenes(Path(out) / KEPT)) if out is not None and (Path(out) / KEPT).exists() else None
        known = set(_known(grid, kept))
        left = [key for key in grid.distinct if key not in known]
        # scenes in the middle of equal parts of the grid: its corners are its least typical scenes
        chosen = {left[(2 * k + 1) * len(left) // (2 * _SAMPLE)] for k in range(_SAMPLE)} if left else set()
        seconds = 0.0
        for key, changed, _, options in grid.tasks(set(grid.distinct) - chosen):
            row = compute(changed, quantity, options)
            seconds += row.seconds
            _keep(kept, key, row)
    return Plan(len(grid.distinct), len(known), seconds / max(len(chosen), 1), len(chosen), processes)


@dataclass(frozen=True, eq=False)
class _Grid:
    """All scenes of a sweep. It holds their keys alone: a scene is made when its turn comes."""

    scene: Scene
    tables: Mapping[str, Any]
    over: Mapping[str, tuple[Any, ...]]
    quantity: str
    options: Options
    keys: tuple[str, ...]
    distinct: Mapping[str, int]

    @classmethod
    def of(cls, scene: Scene, over: Mapping[str, Iterable[Any]], quantity: str, options: Options) -> _Grid:
        if not isinstance(scene, Scene):
            raise InputError("scene", scene, "a Scene is allowed")
        values = _checked(over)
        tables = scene.record()
        if quantity not in COMPUTED or not values:  # the rest is asked of each scene below
            check(scene, quantity, options)
        keys = []
        for changed in _scenes(scene, tables, values):
            check(changed, quantity, options)
            keys.append(_key(changed, quantity, options))
        first = {key: place for place, key in reversed(list(enumerate(keys)))}
        return cls(scene, tables, values, quantity, options, tuple(keys), dict(sorted(first.items(), key=lambda item: item[1])))

    def tasks(self, known: set[str]) -> Iterator[parallel.Task]:
        """What is to be computed, each scene once."""
        for place, (key, scene) in enumerate(zip(self.keys, _scenes(self.scene, self.tables, self.over), strict=True)):
            if key not in known and self.distinct[key] == place:
                yield key, scene, self.quantity, self.options


def _scenes(scene: Scene, tables: Mapping[str, Any], over: Mapping[str, tuple[Any, ...]]) -> Iterator[Scene]:
    """The scenes of a grid, the last key fastest."""
    for values in itertools.product(*over.values()):
        changed: Mapping[str, Any] = tables
        for key, value in zip(over, values, strict=True):
            changed = set_key(changed, key, value)
        yield Scene.from_dict(changed, own=scene)


def _checked(over: Any) -> dict[str, tuple[Any, ...]]:
    if not isinstance(over, Mapping) or not over:
        raise InputError("over", over, 'a mapping of keys to values is allowed, such as {"source.0.strength": [100, 200, 400]}')
    checked = {}
    for key, values in over.items():
        allowed = "one or more different numbers, booleans or texts of one kind are allowed"
        if isinstance(values, (str, bytes, Mapping)) or not isinstance(values, Iterable):
            raise InputError(f"over[{key!r}]", values, allowed)
        plain = tuple(v.item() if isinstance(v, np.generic) else v for v in itertools.islice(values, MAX_SCENES + 1))
        if len(plain) > MAX_SCENES:
            raise InputError(f"over[{key!r}]", f"more than {MAX_SCENES} values", f"a sweep of up to {MAX_SCENES} scenes is allowed")
        kinds = {float if type(v) is int else type(v) for v in plain}
        if len(kinds) != 1 or not kinds <= {float, bool, str} or len(set(plain)) < len(plain):
            raise InputError(f"over[{key!r}]", list(plain), allowed)
        checked[key] = plain
    count = math.prod(len(values) for values in checked.values())
    if count > MAX_SCENES:
        sizes = " x ".join(str(len(values)) for values in checked.values())
        raise InputError("over", list(checked), f"{sizes} values are {count} scenes; up to {MAX_SCENES} are allowed")
    return checked


def _key(scene: Scene, quantity: str, options: Options) -> str:
    """The hash of everything that a row depends on. Neither the title nor the files of a run play a part."""
    from .. import __version__

    tables = {name: table for name, table in scene.record().items() if name not in ("title", "output")}
    # earlier versions kept rows of membranes with their inside above with other signs
    signs = ["inside above"] if side(scene.mesh) < 0 else []
    text = json.dumps(
        [_canonical(tables), quantity, _canonical(asdict(options)), __version__, *signs, *own_identity(scene)], sort_keys=True
    )
    return hashlib.sha256(text.encode()).hexdigest()


def _canonical(value: Any) -> Any:
    """The same text for the same numbers: 200 is 200.0."""
    if isinstance(value, dict):
        return {key: _canonical(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_canonical(item) for item in value]
    return float(value) if isinstance(value, (int, np.number)) and not isinstance(value, bool) else value


def _workers(workers: Any, scheduler: Any) -> int | None:
    if scheduler is not None and not isinstance(scheduler, str):
        raise InputError("scheduler", scheduler, "the address of a Dask scheduler is allowed, such as tcp://host:8786")
    if workers is None:
        return None
    if scheduler is not None:
        raise InputError("workers", workers, "not together with scheduler: a cluster has its own")
    allowed = f"a whole number from 1 to {parallel.MAX_WORKERS} is allowed; this process may use {parallel.cores()} cores"
    number = whole("workers", workers, allowed, most=parallel.MAX_WORKERS)
    require("workers", number - 1, parallel.WORKER_BYTES, "more processes")
    return number


def _computed(tasks: Iterator[parallel.Task], workers: int | None, scheduler: str | None, sendable: bool) -> Iterator[tuple[str, Row]]:
    """The rows of tasks, from a cluster, from processes or from this process.

    Without orders this process begins, and processes are started for what is left after ``_ALONE`` seconds.
    """
    if not sendable and ((workers or 1) > 1 or scheduler is not None):
        advice = "define its functions and classes in a module, or leave workers and scheduler out"
        raise InputError("scene", "a function or class of a script", f"it cannot be sent to other processes: {advice}")
    if scheduler is not None:
        yield from parallel.on_cluster(tasks, scheduler)
    elif workers is None and parallel.cores() > 1 and sendable:
        end = time.monotonic() + _ALONE
        for row in parallel.here(tasks):
            yield row
            if time.monotonic() > end:
                break
        for task in tasks:  # one at least is left
            yield from parallel.on_cores(itertools.chain([task], tasks), parallel.cores())
    elif workers is not None and workers > 1:
        yield from parallel.on_cores(tasks, workers)
    else:
        yield from parallel.here(tasks)


def _known(grid: _Grid, kept: FinishedScenes | None) -> dict[str, Row]:
    """The rows that are kept. An incomplete row does not count, and its scene is computed again."""
    found = {} if kept is None else {key: _row(kept.get(key)) for key in grid.distinct}
    return {key: row for key, row in found.items() if row is not None}


def _row(kept: Mapping[str, Any] | None) -> Row | None:
    if kept is None or kept.keys() != {f.name for f in fields(Row)} or not kept["values"].keys() <= DIMENSIONS.keys():
        return None
    return _compact(Row(**kept))


def _keep(kept: FinishedScenes | None, key: str, row: Row) -> None:
    if kept is not None and row.status != UNEXPECTED:  # a scene that failed unexpectedly may succeed another time
        kept.put(key, asdict(row))


def _compact(row: Row) -> Row:
    """Lists as arrays: a quarter of the memory."""
    return Row(row.status, row.message, {k: np.array(v, float) if isinstance(v, list) else v for k, v in row.values.items()}, row.seconds)
