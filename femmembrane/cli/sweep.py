"""``femmembrane sweep``: one quantity of a grid of scenes."""

from __future__ import annotations

import sys
import time
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

from cyclopts import Parameter

from ..errors import InputError
from .folders import Changes, System, read, tables_of, units_of, working
from .interrupts import Interrupts
from .outcome import BAD_INPUT, DONE, INTERRUPTED, NOT_CONVERGED, NOT_WRITTEN, Table, fail, not_written, refused, say, succeed

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


def sweep(
    scene: Path,
    /,
    *,
    over: Annotated[list[str], Parameter(negative=())],
    out: Path,
    changes: Changes = None,
    quantity: str = "branch",
    pressure: float | None = None,
    volume: float | None = None,
    direction: int = 1,
    workers: int | None = None,
    scheduler: str | None = None,
    dry_run: bool = False,
    units: System | None = None,
    table: Table = False,
) -> int:
    """Compute one quantity of every scene of a grid, and write sweep.nc and a map, sweep.png, to a folder.

    Finished scenes are kept in the folder: after an interrupt the same command goes on where it was. A scene that fails is a row with its
    reason. Exit codes: 0 done, 2 bad input, 3 not one scene has a result, 4 results could not be written,
    130 interrupted.

    Parameters
    ----------
    scene
        Scene file (TOML).
    over
        A key and its values, START:STOP:COUNT or V1,V2,..., such as source.0.strength=50:1000:40; may be given several times.
    out
        Folder for the results, made when there is none.
    quantity
        branch (traced, with special points), run (what [run] says), equilibria (all at --pressure or --volume), tipping (first onset of
        one wave around the axis), wrinkling (first compressive stress).
    pressure
        Pressure at which equilibria are looked for.
    volume
        Volume at which equilibria are looked for.
    direction
        1 or -1: branch, tipping and wrinkling set out to larger or smaller volumes.
    workers
        Processes on this machine; one a core unless given.
    scheduler
        Address of a running Dask scheduler, tcp://HOST:PORT, whose workers compute.
    dry_run
        Only say how many scenes there are and how long they will take, from a few that are timed.
    units
        Of the map: those of the package, or SI units by the [scales] of the scene; those of the scene file unless given. Values of --over,
        --pressure and --volume are meant as in the scene file.
    """
    from ..quantities import Units
    from ..scene.given import shown_as_given
    from ..scene.keys import values_of
    from ..scene.laboratory import values_in_file
    from ..verbs.sweep import plan_sweep
    from ..verbs.sweep import sweep as compute

    asked = read(scene, changes, needs_run=quantity != "equilibria")
    system = units_of(scene, changes, units)
    Units.of(system, asked.scales)
    tables, _ = tables_of(scene, changes)
    if asked.scales is not None and tables.get("units") == "si":
        pressure, volume = (
            None if load is None else asked.scales.from_si(name, load) for name, load in (("pressure", pressure), ("volume", volume))
        )
    grid: dict[str, Any] = {}
    given: list[tuple[str, Any, Any]] = []
    for text in over:
        key, values = values_of("--over", text)
        if key in grid:
            raise InputError("--over", text, "each key once is allowed")
        grid[key] = values_in_file(tables, key, values)
        given += ((key, one, value) for one, value in zip(values, grid[key], strict=True))
    what: dict[str, Any] = {"quantity": quantity, "pressure": pressure, "volume": volume, "direction": direction, "workers": workers}
    if dry_run:
        with shown_as_given(tables, given):
            say(f"{plan_sweep(asked, grid, out=out, **what)}\n")
        return DONE
    done = [0, 0]
    with working(out, ("sweep.nc", "sweep.png", "scenes.sqlite")), Interrupts() as interrupts, _observer() as progress:

        def on_scene(count: int, total: int, failed: int) -> None:
            done[:] = count, total
            progress.scene(count, total, failed)
            interrupts.check()

        try:
            with shown_as_given(tables, given):
                found = compute(asked, grid, scheduler=scheduler, out=out, on_scene=on_scene, **what)
            interrupts.check()
        except InputError as error:
            if error.key == "out" and done[0]:
                return fail(NOT_WRITTEN, f"{not_written(error, out)}. {done[0]} of {done[1]} scenes were done")
            raise
        except KeyboardInterrupt:
            interrupts.over = True
            return fail(INTERRUPTED, f"interrupted. {done[0]} of {done[1]} scenes are kept in {out}: the same command goes on from there")
        interrupts.hold = True
        results = found.failed < len(found)
        written = [out / "sweep.nc", *([out / "sweep.png"] if results and len(grid) <= 2 else [])]
        try:
            found.save(written[0])
            if len(written) > 1:
                found.plot(written[1], units=system)
        except (InputError, OSError) as error:
            return fail(NOT_WRITTEN if refused(error) else BAD_INPUT, not_written(error, out))
    if not results:
        return fail(NOT_CONVERGED, f"no scene has a result; the reasons are in {written[0]}")
    return succeed(found.summary, written, table=str(found), asked=table)


class _NoScenes:
    def scene(self, count: int, total: int, failed: int) -> None:
        pass


class _SceneBar:
    """A line on the terminal: bar, scenes, rate, remaining time, failures."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        columns = (BarColumn(bar_width=20), MofNCompleteColumn(), TextColumn("{task.description}", markup=False), TimeRemainingColumn())
        self._progress: Progress = Progress(*columns, console=Console(stderr=True), transient=True)
        self._task: TaskID = self._progress.add_task("", total=None)
        self._first: tuple[int, float] | None = None

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._progress.stop()

    def scene(self, count: int, total: int, failed: int) -> None:
        now = time.monotonic()
        if self._first is None:  # scenes that were kept say nothing about the rate
            self._first = count, now
        made, seconds = count - self._first[0], now - self._first[1]
        rate = f"{made / seconds:.3g} scenes/s" if made and seconds > 0 else ""
        text = "  ".join(filter(None, [rate, f"{failed} without result" if failed else ""]))
        self._progress.update(self._task, completed=count, total=total, description=text)


def _observer() -> AbstractContextManager[_SceneBar | _NoScenes]:
    return _SceneBar() if sys.stderr.isatty() else nullcontext(_NoScenes())
