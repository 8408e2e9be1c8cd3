"""``femmembrane run``: the equilibria of a scene file to a folder."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError, SolveError, Status
from .folders import prepare, read
from .interrupts import Interrupts
from .outcome import DONE, INTERRUPTED, NOT_CONVERGED, count, explain, fail
from .progress import observer
from .report import write as write_report

if TYPE_CHECKING:
    from ..results.records import Branch, Equilibrium
    from ..scene import Scene


def run(scene: Path, /, *, out: Path, report: bool = False) -> int:
    """Compute the equilibria that a scene file asks for and write them to a folder.

    Exit codes: 0 done, 2 bad input, 3 not converged, 130 interrupted; with the last two, what was computed is written all the same.

    Parameters
    ----------
    scene
        Scene file (TOML).
    out
        Folder for the results, made when there is none; earlier results in it are replaced.
    report
        Write report.html as well, one page about the run.
    """
    asked = read(scene)
    prepare(out)
    with Interrupts() as interrupts:
        branch, code, message = _compute(asked, interrupts)
        if code == INTERRUPTED and not len(branch):  # whatever an earlier run left in the folder is worth more
            raise KeyboardInterrupt
        interrupts.hold = True
        written = _write(branch, out, scene)
        if report:
            written.append(write_report(out))
    if interrupts.caught:
        code, message = INTERRUPTED, message if code == INTERRUPTED else "interrupted"
    if code != DONE:
        return fail(code, f"{message.rstrip('.')}. Computed before and kept: {count(len(branch))}, in {out}")
    if sys.stdout.isatty():
        sys.stdout.write(_summary(branch, written))
    return DONE


def _compute(scene: Scene, interrupts: Interrupts) -> tuple[Branch, int, str]:
    """The branch as far as it could be followed, the exit code, and what happened if it is not 0."""
    from ..verbs import run as run_scene

    found: list[Equilibrium] = []
    with observer(scene) as progress:

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
            return partial_branch(scene, found, error.status, str(error)), NOT_CONVERGED, explain(error.status, str(error))
    if branch.status == Status.CONVERGED:
        return branch, DONE, ""
    return branch, NOT_CONVERGED, explain(branch.status, branch.message)


def partial_branch(scene: Scene, equilibria: Sequence[Equilibrium], status: Status, message: str) -> Branch:
    """The branch of what was found before the computation ended early; special points are not searched for."""
    from ..results.records import Branch

    used = equilibria[0].scene if equilibria else scene  # its mesh may have been chosen on the way
    asked = used.run
    solver = asked.solver if asked is not None and asked.control in ("volume", "pressure") else "newton"
    return Branch(scene=used, equilibria=tuple(equilibria), status=status, message=message, solver=solver)


def _write(branch: Branch, out: Path, scene: Path) -> list[Path]:
    import shlex

    from ..results.output import write_run

    try:
        return write_run(branch, out, command=shlex.join(["femmembrane", "run", str(scene), "--out", str(out)]))
    except OSError as error:
        raise InputError("--out", str(out), f"the results could not be written ({error.strerror or error})") from None


def _summary(branch: Branch, written: Sequence[Path]) -> str:
    lines = [f"{count(len(branch))}, written:", *(f"  {path}" for path in written)]
    return "\n".join(lines) + "\n"
