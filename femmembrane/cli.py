"""The command ``femmembrane``: a scene file in, a folder of results out.

Exit codes: 0 done, 2 bad input (nothing was computed), 3 not converged (what was computed is written), 4 results could not be written (a
full disk), 130 interrupted (what was computed is written, and ``--resume`` goes on).
In a pipe nothing is printed but errors, one line each on stderr. Whatever is slow to import is imported inside the functions: ``--help``
should answer at once.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from pathlib import Path
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Any, Protocol, Self

from cyclopts import App, CycloptsError

from . import __version__
from .errors import InputError, SolveError, Status

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from .results.checkpoint import Checkpoints
    from .results.records import Branch, Equilibrium
    from .scene import Scene

DONE, BAD_INPUT, NOT_CONVERGED, NOT_WRITTEN, INTERRUPTED = 0, 2, 3, 4, 130


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
def run(scene: Path, /, *, out: Path, resume: bool = False) -> int:
    """Compute the equilibria that a scene file asks for and write them to a folder.

    Now and then the branch so far is saved as checkpoint.nc: --resume goes on from there after an interrupt, a kill or a full disk. One run
    at a time may write to a folder.

    Exit codes: 0 done, 2 bad input or a folder in use, 3 not converged, 4 results could not be written, 130
    interrupted; with 3 and 130 what was computed is written all the same, with 4 as much of it as there is room for.

    Parameters
    ----------
    scene
        Scene file (TOML).
    out
        Folder for the results, made when there is none; earlier results in it are replaced.
    resume
        Go on where a run of the same scene in this folder was interrupted; without one, start.
    """
    asked = _read(scene)
    _prepare(out)
    from .results.checkpoint import Checkpoints, same_scene, unfinished
    from .results.lock import locked
    from .results.output import clean

    with locked(out), _Interrupts() as interrupts:
        clean(out)
        kept = unfinished(out) if resume else None
        if kept is not None:
            same_scene(asked, kept, "--resume")
        elif resume and (ended := _ended(asked, out)) is not None:
            return ended
        checkpoints = Checkpoints(out, kept)
        interrupts.hold = True  # until the next equilibrium: raised inside a compiled solver it is swallowed, with a warning from there
        branch, code, message = _compute(asked, interrupts, checkpoints)
        if code == INTERRUPTED and not len(branch):  # whatever an earlier run left in the folder is worth more
            raise KeyboardInterrupt
        try:
            if code == INTERRUPTED:
                checkpoints.save()
            written = _write(branch, out, scene)
        except (InputError, OSError) as error:
            return _fail(NOT_WRITTEN, _not_written(error, checkpoints, out))
        if code != INTERRUPTED:
            checkpoints.remove()
    if interrupts.caught:
        code, message = INTERRUPTED, message if code == INTERRUPTED else "interrupted"
    if code != DONE:
        further = "; --resume goes on" if checkpoints.path.exists() else ""
        return _fail(code, f"{message.rstrip('.')}. Computed before and kept: {_count(len(branch))}, in {out}{further}")
    if sys.stdout.isatty():
        sys.stdout.write(_summary(branch, written))
    return DONE


@app.command
def convergence(scene: Path, /, *, out: Path, degrees: str = "1,2,3,4", elements: str = "8,16,32,64") -> int:
    """Solve the last equilibrium that a scene file asks for on many meshes, and write convergence.csv and convergence.png to a folder.

    Exit codes: 0 done, 2 bad input, 3 not converged (on some meshes: they are left out; on its own: nothing is written), 4 results
    could not be written, 130 interrupted.

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
    from .results.lock import locked
    from .verbs.convergence import convergence_of_run

    with locked(out), _Interrupts() as interrupts:
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
        except (InputError, OSError) as error:
            return _fail(NOT_WRITTEN, _reason(error, out))
    if study.messages:
        return _fail(NOT_CONVERGED, f"{'; '.join(study.messages)}. The other meshes are in {out}")
    if sys.stdout.isatty():
        sys.stdout.write("\n".join([str(study), "written:", *(f"  {path}" for path in written)]) + "\n")
    return DONE


@app.command
def cost(scene: Path, /, *, out: Path, quick: bool = False) -> int:
    """Measure error against time of the last equilibrium that a scene file asks for, by every method on every mesh.

    Writes cost.csv and cost.png. Exit codes: 0 done, 2 bad input, 3 not converged, 4 results could not be written, 130 interrupted;
    with all but the first nothing is written.

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
    from .results.lock import locked
    from .verbs.cost import QUICK, asked_load
    from .verbs.cost import cost as measure

    with locked(out), _Interrupts() as interrupts:
        try:
            study = measure(asked, **asked_load(asked) | (dict(QUICK) if quick else {}))
        except SolveError as error:
            return _fail(NOT_CONVERGED, _explain(error.status, str(error)))
        interrupts.check()
        interrupts.hold = True
        try:
            study.write_csv(out / "cost.csv")
            study.plot(out / "cost.png")
        except (InputError, OSError) as error:
            return _fail(NOT_WRITTEN, _reason(error, out))
    if sys.stdout.isatty():
        sys.stdout.write(f"{study}\n")
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


def _ended(scene: Scene, out: Path) -> int | None:
    """The exit code of the run of this scene that has completed the folder, None if there is none and something is to be computed."""
    from .results.checkpoint import refuse_others
    from .results.output import read_record

    facts = read_record(out)
    if facts is None:
        return None
    refuse_others(scene, facts["scene"], "--resume")
    if facts["status"] == Status.INTERRUPTED:
        return None
    message = f"nothing to resume: the run in {out} has ended, with {_count(facts['equilibria'])}"
    if facts["status"] == Status.CONVERGED:
        return _fail(DONE, message)
    return _fail(NOT_CONVERGED, f"{message}. {facts['message']}")


def _compute(scene: Scene, interrupts: _Interrupts, checkpoints: Checkpoints) -> tuple[Branch, int, str]:
    """The branch as far as it could be followed, the exit code, and what happened if it is not 0."""
    from .verbs import run as run_scene

    kept = checkpoints.latest
    found: list[Equilibrium] = [] if kept is None else list(kept)
    with _progress(scene) as progress:

        def on_step(index: int, total: int, equilibrium: Equilibrium) -> None:
            interrupts.check()  # what a solver found after it swallowed an interrupt is not what it would have found
            found.append(equilibrium)
            progress.step(len(found), total, equilibrium)

        try:
            branch = run_scene(scene, on_step=on_step, on_checkpoint=checkpoints, unfinished=kept)
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

    return write_run(branch, out, command=shlex.join(["femmembrane", "run", str(scene), "--out", str(out)]))


def _not_written(error: Exception, checkpoints: Checkpoints, out: Path) -> str:
    """What is lost and what is not; the branch is saved for --resume, if a file of that size can be written now."""
    with suppress(InputError, OSError):
        checkpoints.save()
    saved = checkpoints.path.exists()
    advice = f"the computation is kept in {checkpoints.path.name}: make room, and --resume writes the rest" if saved else "make room"
    return f"{_reason(error, out)}; {advice}"


def _reason(error: Exception, out: Path) -> str:
    text = error.allowed if isinstance(error, InputError) else getattr(error, "strerror", None) or str(error)
    return f"results could not be written to {out} ({text})"


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
    While ``hold`` is set the first interrupt is noted only, so that a step or the results are finished; a second one gets through.
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


def _line(scene: Scene, equilibrium: Equilibrium) -> str:
    verdicts = [f"{control}: {equilibrium.verdict(control).word}" for control in scene.analysis.stability]
    verdicts += [f"n = {n}: {equilibrium.verdict(azimuthal=n).word}" for n in scene.analysis.azimuthal_modes]
    return "  ".join([f"V = {equilibrium.volume:.4g}", f"P = {equilibrium.pressure:.4g}", *verdicts])
