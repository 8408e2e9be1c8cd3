"""The line on the terminal while equilibria are computed; none in a pipe."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Protocol, Self

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from ..results.records import Equilibrium
    from ..scene import Scene


class _Observer(Protocol):
    def step(self, count: int, total: int, equilibrium: Equilibrium) -> None: ...


class _Quiet:
    def step(self, count: int, total: int, equilibrium: Equilibrium) -> None:
        pass


class _Bar:
    """A line on the terminal: bar, step, load, pressure, verdicts, remaining time."""

    def __init__(self, scene: Scene) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        columns = (BarColumn(bar_width=20), MofNCompleteColumn(), TextColumn("{task.description}", markup=False), TimeRemainingColumn())
        self._scene = scene
        self._progress: Progress = Progress(*columns, console=Console(stderr=True), transient=True)
        self._task: TaskID = self._progress.add_task("", total=None)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._progress.stop()

    def step(self, count: int, total: int, equilibrium: Equilibrium) -> None:
        self._progress.update(self._task, completed=count, total=total, description=_line(self._scene, equilibrium))


def observer(scene: Scene) -> AbstractContextManager[_Observer]:
    return _Bar(scene) if sys.stderr.isatty() else nullcontext(_Quiet())


def _line(scene: Scene, equilibrium: Equilibrium) -> str:
    verdicts = [f"{control}: {equilibrium.verdict(control).word}" for control in scene.analysis.stability]
    verdicts += [f"n = {n}: {equilibrium.verdict(azimuthal=n).word}" for n in scene.analysis.azimuthal_modes]
    return "  ".join([f"V = {equilibrium.volume:.4g}", f"P = {equilibrium.pressure:.4g}", *verdicts])
