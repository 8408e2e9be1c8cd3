"""The line on the terminal while equilibria are computed; none in a pipe."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TYPE_CHECKING, Protocol, Self

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from ..results.equilibrium import Equilibrium
    from ..scene import Scene


class _Observer(Protocol):
    def step(self, count: int, total: int, equilibrium: Equilibrium) -> None: ...


class _Quiet:
    def step(self, count: int, total: int, equilibrium: Equilibrium) -> None:
        pass


class _Bar:
    """A line on the terminal: bar, step, load, pressure, verdicts, remaining time.

    By arc length the number of steps is not known. The line then shows how far the branch has come towards its end, and the time that has
    passed.
    """

    def __init__(self, scene: Scene) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

        words = TextColumn("{task.description}", markup=False)
        known = scene.run is None or scene.run.until is None
        columns = (BarColumn(bar_width=20), MofNCompleteColumn(), words, TimeRemainingColumn()) if known else (words, TimeElapsedColumn())
        self._scene, self._known = scene, known
        self._progress: Progress = Progress(*columns, console=Console(stderr=True), transient=True)
        self._task: TaskID = self._progress.add_task("", total=None)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._progress.stop()

    def step(self, count: int, total: int, equilibrium: Equilibrium) -> None:
        line = _line(equilibrium)
        line = line if self._known else f"step {count}, {_way(self._scene, equilibrium)}  {line}"
        self._progress.update(self._task, completed=count, total=total, description=line)


def observer(scene: Scene) -> AbstractContextManager[_Observer]:
    """The observer of a run: a line on a terminal, none in a pipe."""
    return _Bar(scene) if sys.stderr.isatty() else nullcontext(_Quiet())


@contextmanager
def counter(things: str) -> Iterator[Callable[[int, int], None]]:
    """Who counts things as they come: a bar on a terminal from the first one on, nothing in a pipe."""
    if not sys.stderr.isatty():
        yield lambda number, total: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (BarColumn(bar_width=20), MofNCompleteColumn(), TextColumn(things), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("", total=None, visible=False)
        yield lambda number, total: progress.update(task, completed=number, total=total, visible=True)


def _way(scene: Scene, equilibrium: Equilibrium) -> str:
    """How far an arc-length run has come."""
    from ..quantities import words

    until = scene.run.until if scene.run is not None and scene.run.until else {}
    return ", ".join(f"{words(name)} {_value(equilibrium, name):.4g} until {end:.4g}" for name, end in until.items())


def _value(equilibrium: Equilibrium, name: str) -> float:
    if "." in name:
        return equilibrium.number(name)
    return equilibrium.gas_amount if name == "gas" else float(getattr(equilibrium, name))


def _line(equilibrium: Equilibrium) -> str:
    from ..quantities import caption
    from ..results.analyses import remarks

    answers = [remark.terminal for remark in remarks(equilibrium) if remark.terminal]
    return "  ".join([caption(equilibrium.volume, equilibrium.pressure), *answers])
