"""The command ``femmembrane``: a scene file in, a folder of results out.

Exit codes: 0 done, 2 bad input, 3 not converged (what was computed is written), 130 interrupted (what was computed is written).
In a pipe nothing is printed but errors, one line each on stderr. Whatever is slow to import is imported inside the functions: ``--help``
should answer at once.
"""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Any, Protocol, Self

from cyclopts import App, CycloptsError

from . import __version__
from .errors import InputError, SolveError, Status

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from .results.records import Branch, Equilibrium
    from .scene import Scene

DONE, BAD_INPUT, NOT_CONVERGED, INTERRUPTED = 0, 2, 3, 130


app = App(
    name="femmembrane",
    help="Equilibria and stability of inflated magnetoelastic membranes.",
    version=__version__,
    help_format="plaintext",  # the import of a markdown parser is a quarter of the time to the first line
    version_format="plaintext",
    suppress_keyboard_interrupt=False,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        The words after ``femmembrane``; those of the process by default.
    """
    try:
        code = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
    except CycloptsError as error:
        return _fail(BAD_INPUT, f"{error} Try femmembrane --help.")
    except (InputError, OSError) as error:
        return _fail(BAD_INPUT, str(error))
    except KeyboardInterrupt:
        return _fail(INTERRUPTED, "interrupted; nothing was written")
    return code or DONE


@app.command
def run(scene: Path, /, *, out: Path) -> int:
    """Compute the equilibria that a scene file asks for and write them to a folder.

    Exit codes: 0 done, 2 bad input, 3 not converged, 130 interrupted; with the last two, what was computed is written all the same.

    Parameters
    ----------
    scene
        Scene file (TOML).
    out
        Folder for the results, made when there is none; earlier results in it are replaced.
    """
    asked = _read(scene)
    _prepare(out)
    with _Interrupts() as interrupts:
        branch, code, message = _compute(asked, interrupts)
        if code == INTERRUPTED and not len(branch):  # whatever an earlier run left in the folder is worth more
            raise KeyboardInterrupt
        interrupts.hold = True
        written = _write(branch, out, scene)
    if interrupts.caught:
        code, message = INTERRUPTED, message if code == INTERRUPTED else "interrupted"
    if code != DONE:
        return _fail(code, f"{message.rstrip('.')}. Computed before and kept: {_count(len(branch))}, in {out}")
    if sys.stdout.isatty():
        sys.stdout.write(_summary(branch, written))
    return DONE


@app.command
def convergence(scene: Path, /, *, out: Path, degrees: str = "1,2,3,4", elements: str = "8,16,32,64") -> int:
    """Solve the last equilibrium that a scene file asks for on many meshes, and write convergence.csv and convergence.png to a folder.

    Exit codes: 0 done, 2 bad input, 3 not converged (on some meshes: they are left out; on its own: nothing is written), 130 interrupted.

    Parameters
    ----------
    scene
        Scene file (TOML).
    out
        Folder for the results, made when there is none.
    degrees
        Degrees of the elements, 1 to 8, separated by commas.
    elements
        Numbers of elements, increasing, separated by commas.
    """
    from .scene import MAX_DEGREE

    asked = _read(scene)
    meshes = {"degrees": _numbers("--degrees", degrees, MAX_DEGREE), "elements": _numbers("--elements", elements)}
    _prepare(out)
    from .verbs.convergence import convergence_of_run

    with _Interrupts() as interrupts:
        try:
            study = convergence_of_run(asked, **meshes)
        except SolveError as error:
            return _fail(NOT_CONVERGED, _explain(error.status, str(error)))
        interrupts.check()
        interrupts.hold = True
        written = [out / "convergence.csv", out / "convergence.png"]
        try:
            study.write_csv(written[0])
            study.plot(written[1])
        except OSError as error:
            raise InputError("--out", str(out), f"the results could not be written ({error.strerror or error})") from None
    if study.messages:
        return _fail(NOT_CONVERGED, f"{'; '.join(study.messages)}. The other meshes are in {out}")
    if sys.stdout.isatty():
        sys.stdout.write("\n".join([str(study), "written:", *(f"  {path}" for path in written)]) + "\n")
    return DONE


@app.command
def cost(scene: Path, /, *, out: Path, quick: bool = False) -> int:
    """Measure error against time of the last equilibrium that a scene file asks for, by every method on every mesh.

    Writes cost.csv and cost.png. Exit codes: 0 done, 2 bad input, 3 not converged, 130 interrupted; with the last two nothing is written.

    Parameters
    ----------
    scene
        Scene file (TOML).
    out
        Folder for the results, made when there is none.
    quick
        Few meshes, each measured once: seconds in place of minutes.
    """
    asked = _read(scene)
    _prepare(out)
    from .verbs.cost import QUICK, asked_load
    from .verbs.cost import cost as measure

    with _Interrupts() as interrupts:
        try:
            study = measure(asked, **asked_load(asked) | (dict(QUICK) if quick else {}))
        except SolveError as error:
            return _fail(NOT_CONVERGED, _explain(error.status, str(error)))
        interrupts.check()
        interrupts.hold = True
        study.write_csv(out / "cost.csv")
        study.plot(out / "cost.png")
    if sys.stdout.isatty():
        sys.stdout.write(f"{study}\n")
    return DONE


@app.command
def sweep(
    scene: Path,
    /,
    *,
    over: list[str],
    out: Path,
    quantity: str = "branch",
    pressure: float | None = None,
    volume: float | None = None,
    direction: int = 1,
    workers: int | None = None,
    scheduler: str | None = None,
    dry_run: bool = False,
) -> int:
    """Compute one quantity of every scene of a grid, and write sweep.nc and a map, sweep.png, to a folder.

    Finished scenes are kept in the folder: after an interrupt the same command goes on where it was. A scene that fails is a row with its
    reason. Exit codes: 0 done, 2 bad input, 3 not one scene has a result, 130 interrupted.

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
    """
    from .scene import Scene
    from .verbs.keys import values_of
    from .verbs.sweep import plan_sweep
    from .verbs.sweep import sweep as compute

    asked = Scene.from_toml(scene)
    grid: dict[str, Any] = {}
    for text in over:
        key, values = values_of("--over", text)
        if key in grid:
            raise InputError("--over", text, "each key once is allowed")
        grid[key] = values
    what: dict[str, Any] = {"quantity": quantity, "pressure": pressure, "volume": volume, "direction": direction, "workers": workers}
    if dry_run:
        sys.stdout.write(f"{plan_sweep(asked, grid, out=out, **what)}\n")
        return DONE
    _prepare(out)
    done = [0, 0]
    with _Interrupts() as interrupts, _scenes() as progress:

        def on_scene(count: int, total: int, failed: int) -> None:
            done[:] = count, total
            progress.scene(count, total, failed)
            interrupts.check()

        try:
            found = compute(asked, grid, scheduler=scheduler, out=out, on_scene=on_scene, **what)
            interrupts.check()
        except KeyboardInterrupt:
            return _fail(INTERRUPTED, f"interrupted. {done[0]} of {done[1]} scenes are kept in {out}: the same command goes on from there")
        interrupts.hold = True
        written = [out / "sweep.nc"]
        found.save(written[0])
        if found.failed == len(found):
            return _fail(NOT_CONVERGED, f"no scene has a result; the reasons are in {written[0]}")
        if len(grid) <= 2:
            written.append(out / "sweep.png")
            found.plot(written[-1])
    if sys.stdout.isatty():
        sys.stdout.write("\n".join([str(found), "written:", *(f"  {path}" for path in written)]) + "\n")
    return DONE


def _numbers(option: str, text: str, most: int | None = None) -> tuple[int, ...]:
    from .verbs.arguments import check_increasing

    try:
        numbers = [int(word) for word in text.split(",")]
    except ValueError:
        raise InputError(option, text, "whole numbers separated by commas are allowed, such as 1,2,4") from None
    return check_increasing(option, numbers, most)


def _read(path: Path) -> Scene:
    from .scene import Scene

    scene = Scene.from_toml(path)
    if scene.run is None:
        raise InputError("run", None, 'missing; say what to compute: [run] with control = "volume", start, stop and steps')
    return scene


def _prepare(out: Path) -> None:
    """Make the folder and write to it once, before hours are spent on what could not be kept."""
    import tempfile

    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out) as probe:
            probe.write(b"femmembrane")
    except (OSError, ValueError) as error:  # ValueError: a null character in the path
        reason = (error.strerror or str(error)) if isinstance(error, OSError) else str(error)
        raise InputError("--out", str(out), f"cannot be written ({reason}); a folder, there already or to be made, is allowed") from None


def _compute(scene: Scene, interrupts: _Interrupts) -> tuple[Branch, int, str]:
    """The branch as far as it could be followed, the exit code, and what happened if it is not 0."""
    from .verbs import run as run_scene

    found: list[Equilibrium] = []
    with _progress(scene) as progress:

        def on_step(index: int, total: int, equilibrium: Equilibrium) -> None:
            found.append(equilibrium)
            interrupts.check()
            progress.step(len(found), total, equilibrium)

        try:
            branch = run_scene(scene, on_step=on_step)
            interrupts.check()
        except (KeyboardInterrupt, SolveError) as error:
            if interrupts.caught or not isinstance(error, SolveError):
                return partial_branch(scene, found, Status.INTERRUPTED, "interrupted"), INTERRUPTED, "interrupted"
            return partial_branch(scene, found, error.status, str(error)), NOT_CONVERGED, _explain(error.status, str(error))
    if branch.status == Status.CONVERGED:
        return branch, DONE, ""
    return branch, NOT_CONVERGED, _explain(branch.status, branch.message)


def partial_branch(scene: Scene, equilibria: Sequence[Equilibrium], status: Status, message: str) -> Branch:
    """The branch of what was found before the computation ended early; special points are not searched for."""
    from .results.records import Branch

    used = equilibria[0].scene if equilibria else scene  # its mesh may have been chosen on the way
    return Branch(scene=used, equilibria=tuple(equilibria), status=status, message=message)


def _write(branch: Branch, out: Path, scene: Path) -> list[Path]:
    import shlex

    from .results.output import write_run

    try:
        return write_run(branch, out, command=shlex.join(["femmembrane", "run", str(scene), "--out", str(out)]))
    except OSError as error:
        raise InputError("--out", str(out), f"the results could not be written ({error.strerror or error})") from None


def _explain(status: Status, message: str) -> str:
    what = message or str(status)
    return what if status.advice.lower() in what.lower() else f"{what.rstrip('.')}; {status.advice}"


def _count(number: int) -> str:
    return f"{number} equilibrium" if number == 1 else f"{number} equilibria"


def _summary(branch: Branch, written: Sequence[Path]) -> str:
    lines = [f"{_count(len(branch))}, written:", *(f"  {path}" for path in written)]
    return "\n".join(lines) + "\n"


def _fail(code: int, message: str) -> int:
    line = " ".join(message.split())
    sys.stderr.write(f"femmembrane: {line}\n")
    return code


class _Interrupts:
    """Ctrl-C that is never lost, and spares the files.

    Compiled solvers may swallow the exception that an interrupt raises, so it is also noted, and raised again at the next :meth:`check`.
    While ``hold`` is set the first interrupt is noted only: the results are written to the end; a second one gets through.
    """

    def __init__(self) -> None:
        self.caught = False
        self.hold = False
        self._previous: Any = None

    def __enter__(self) -> Self:
        # elsewhere than in the main thread, or where the caller handles (or ignores) interrupts, they are not ours
        if threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            self._previous = signal.signal(signal.SIGINT, self._handle)
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        if self._previous is not None:
            signal.signal(signal.SIGINT, self._previous)

    def check(self) -> None:
        if self.caught:
            raise KeyboardInterrupt

    def _handle(self, number: int, frame: FrameType | None) -> None:
        first, self.caught = not self.caught, True
        if not (first and self.hold):
            raise KeyboardInterrupt


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


def _progress(scene: Scene) -> AbstractContextManager[_Observer]:
    return _Bar(scene) if sys.stderr.isatty() else nullcontext(_Quiet())


class _NoScenes:
    def scene(self, count: int, total: int, failed: int) -> None:
        pass


class _SceneBar:
    """A line on the terminal for a sweep: bar, scenes, rate, remaining time, failures."""

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
        if self._first is None:  # those that were kept say nothing about the rate
            self._first = count, now
        made, seconds = count - self._first[0], now - self._first[1]
        rate = f"{made / seconds:.3g} scenes/s" if made and seconds > 0 else ""
        text = "  ".join(filter(None, [rate, f"{failed} without result" if failed else ""]))
        self._progress.update(self._task, completed=count, total=total, description=text)


def _scenes() -> AbstractContextManager[_SceneBar | _NoScenes]:
    return _SceneBar() if sys.stderr.isatty() else nullcontext(_NoScenes())


def _line(scene: Scene, equilibrium: Equilibrium) -> str:
    verdicts = [f"{control}: {equilibrium.verdict(control).word}" for control in scene.analysis.stability]
    verdicts += [f"n = {n}: {equilibrium.verdict(azimuthal=n).word}" for n in scene.analysis.azimuthal_modes]
    return "  ".join([f"V = {equilibrium.volume:.4g}", f"P = {equilibrium.pressure:.4g}", *verdicts])
