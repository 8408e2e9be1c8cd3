"""``femmembrane run``: the equilibria of a scene file to a folder."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError, SolveError, Status
from .explore import check_explorer
from .explore import write as write_explorer
from .folders import Changes, System, finished, read, units_of, working
from .interrupts import Interrupts
from .outcome import (
    BAD_INPUT,
    DONE,
    INTERRUPTED,
    NOT_CONVERGED,
    NOT_WRITTEN,
    count,
    explain,
    fail,
    not_written,
    refused,
    succeed,
)
from .progress import observer
from .report import write as write_report

if TYPE_CHECKING:
    from ..quantities import Units
    from ..results.branch import Branch
    from ..results.checkpoint import Checkpoints
    from ..results.equilibrium import Equilibrium
    from ..scene import Scene


def run(
    scene: Path,
    /,
    *,
    out: Path,
    changes: Changes = None,
    resume: bool = False,
    report: bool = False,
    explore: bool = False,
    units: System | None = None,
) -> int:
    """Compute the equilibria that a scene file asks for and write them to a folder.

    Now and then the branch so far is saved as checkpoint.nc: --resume goes on from there after an interrupt, a kill or a full disk. One run
    at a time may write to a folder.

    Exit codes: 0 done, 2 bad input or a folder in use, 3 not converged, 4 results could not be written, 130 interrupted. With 3 and 130
    everything that was computed is written, with 4 as much of it as there is room for.

    Parameters
    ----------
    scene
        Scene file (TOML).
    out
        Folder for the results, made when there is none; earlier results in it are replaced.
    resume
        Go on where a run of the same scene in this folder was interrupted; without one, start.
    report
        Write report.html as well, one page about the run.
    explore
        Write explore.html as well, a page on which the branch is explored.
    units
        Of pictures and pages: those of the package, or SI units by the [scales] of the scene; those of the scene file unless given.
    """
    asked = read(scene, changes)
    from ..quantities import Units
    from ..results.checkpoint import NAME, Checkpoints, same_scene, unfinished
    from ..results.output import SURFACES_FOLDER, run_files
    from ..scene.absurd_loads import remarks_on_direction, remarks_on_loads, remarks_on_scales

    system = units_of(scene, changes, units)
    Units.of(system, asked.converter)
    if explore:
        check_explorer()
    for remark in (*remarks_on_scales(asked.scales), *remarks_on_loads(asked), *remarks_on_direction(asked)):
        fail(DONE, remark)

    with working(out, (*run_files(), NAME), (SURFACES_FOLDER,)), Interrupts() as interrupts:
        kept = unfinished(out, asked) if resume else None
        if kept is not None:
            same_scene(asked, kept, "--resume")
        elif resume and (ended := _ended(asked, out)) is not None:
            return ended
        checkpoints = Checkpoints(out, kept)
        interrupts.hold = True  # held until the next equilibrium: inside a compiled solver the exception would be swallowed, with a warning
        for remark in checkpoints.remarks:
            fail(DONE, remark)
        branch, code, message = _compute(asked, interrupts, checkpoints)
        branch = replace(branch, remarks=checkpoints.remarks) if checkpoints.remarks else branch
        if code == INTERRUPTED and not len(branch):  # the files of an earlier run in the folder are worth more
            raise KeyboardInterrupt
        try:
            if code == INTERRUPTED:
                checkpoints.save()
            written = _write(branch, out, scene, changes or (), system)
            if report:
                written.append(write_report(out, units=system, own=asked))
            if explore and len(branch):
                written.append(write_explorer(out, units=system, own=asked))
        except KeyboardInterrupt:  # the second one
            interrupts.over = True
            checkpoints.save()
            return fail(INTERRUPTED, f"interrupted while results were written to {out}: some are missing; --resume writes them")
        except (InputError, OSError) as error:
            return fail(NOT_WRITTEN if refused(error) else BAD_INPUT, _kept(error, checkpoints, out))
        if code != INTERRUPTED:
            checkpoints.remove()
    if interrupts.caught:
        code, message = INTERRUPTED, message if code == INTERRUPTED else "interrupted"
    if code != DONE:
        further = "; --resume goes on" if checkpoints.path.exists() else ""
        return fail(code, f"{message.rstrip('.')}. Computed before and kept: {count(len(branch))}, in {out}{further}")
    return succeed(", ".join([count(len(branch)), *_special_points(branch, Units.of(system, asked.converter))]), written)


def _special_points(branch: Branch, units: Units) -> list[str]:
    """How many special points were found, and the pressure at the first limit point, or the first extreme value of the number."""
    from ..quantities import equated
    from ..scene.number_units import shown_number

    points = branch.special_points
    if not points:
        return []
    found, kind = count(len(points), "special point", "special points"), "number_fold" if branch.over else "limit_point"
    first = next((point for point in points if point.kind == kind), None)
    if first is None:
        return [found]
    if not branch.over:
        return [f"{found} (first limit point at {equated('pressure', first.pressure, units)})"]
    shown = shown_number(branch.scene, branch.over, units)
    value = f"{float(shown.into(first.equilibrium.number(branch.over))):.4g}"
    return [f"{found} ({branch.over} turns at {f'{value} {shown.unit}'.rstrip()})"]


def _ended(scene: Scene, out: Path) -> int | None:
    """The exit code of the run of this scene that completed the folder; None if something is still to be computed."""
    from ..results.checkpoint import refuse_others
    from ..results.output import read_record

    facts = read_record(out)
    if facts is None:
        return None
    refuse_others(scene, facts["scene"], "--resume")
    if facts["status"] == Status.INTERRUPTED:
        return None
    if facts["equilibria"]:
        finished(out, facts, scene)  # results that are damaged, or of another run, are refused here, and not reported as done
    message = f"nothing to resume: the run in {out} has ended, with {count(facts['equilibria'])}"
    if facts["status"] == Status.CONVERGED:
        return fail(DONE, message)
    return fail(NOT_CONVERGED, f"{message}. {facts['message']}")


def _compute(scene: Scene, interrupts: Interrupts, checkpoints: Checkpoints) -> tuple[Branch, int, str]:
    """The branch as far as it could be followed, the exit code, and what happened if it is not 0."""
    from ..verbs import run as run_scene

    kept = checkpoints.latest
    found: list[Equilibrium] = [] if kept is None else list(kept)
    with observer(scene) as progress:

        def on_step(index: int, total: int, equilibrium: Equilibrium) -> None:
            interrupts.check()  # after a swallowed interrupt a solver may answer something else than without it
            found.append(equilibrium)
            progress.step(len(found), total, equilibrium)

        try:
            branch = run_scene(scene, on_step=on_step, on_checkpoint=checkpoints, unfinished=kept)
            interrupts.check()
        except (KeyboardInterrupt, SolveError) as error:
            if interrupts.caught or not isinstance(error, SolveError):
                return partial_branch(scene, found, Status.INTERRUPTED, "interrupted"), INTERRUPTED, "interrupted"
            return partial_branch(scene, found, error.status, str(error)), NOT_CONVERGED, explain(error.status, str(error))
    if branch.status == Status.CONVERGED:
        return branch, DONE, ""
    return branch, NOT_CONVERGED, explain(branch.status, branch.message)


def partial_branch(scene: Scene, equilibria: Sequence[Equilibrium], status: Status, message: str) -> Branch:
    """The branch of the equilibria found before the computation ended early. Special points are not searched for."""
    from ..results.branch import Branch

    asked = scene.run
    over, hold = (asked.number or "", dict(asked.hold or {})) if asked is not None else ("", {})
    used = scene
    if equilibria:  # the mesh may have been chosen on the way; over a number each has a scene of its own
        first = equilibria[0].scene
        used = scene.replace(mesh=first.mesh, degree=first.degree) if over else first
        asked = used.run
    solver = asked.solver if asked is not None and asked.minimised else "newton"
    return Branch(scene=used, equilibria=tuple(equilibria), status=status, message=message, solver=solver, over=over, hold=hold)


def _write(branch: Branch, out: Path, scene: Path, changes: Sequence[str], units: str) -> list[Path]:
    import shlex

    from ..results.output import write_run

    words = ["femmembrane", "run", str(scene), *(word for change in changes for word in ("--set", change)), "--out", str(out)]
    return write_run(branch, out, command=shlex.join(words), units=units)


def _kept(error: Exception, checkpoints: Checkpoints, out: Path) -> str:
    """A message on what is lost and what is not. The branch is saved for --resume, if a file of that size can be written now."""
    with suppress(InputError, OSError):
        checkpoints.save()
    saved = checkpoints.path.exists()
    kept = f"the computation is kept in {checkpoints.path.name}"
    if not refused(error):
        return f"{not_written(error, out)}" + (f"; {kept}" if saved else "")
    return f"{not_written(error, out)}; " + (f"{kept}: make room, and --resume writes the rest" if saved else "make room")
