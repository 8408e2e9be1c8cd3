"""``femmembrane convergence``: the last equilibrium of a scene file on many meshes."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError, SolveError
from .folders import Changes, read, working
from .interrupts import Interrupts
from .outcome import BAD_INPUT, NOT_CONVERGED, NOT_WRITTEN, Table, count, explain, fail, not_written, refused, succeed


def convergence(
    scene: Path,
    /,
    *,
    out: Path,
    changes: Changes = None,
    degrees: str = "1,2,3,4",
    elements: str = "8,16,32,64",
    table: Table = False,
) -> int:
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
    from ..scene import MAX_DEGREE

    asked = read(scene, changes)
    meshes = {"degrees": _numbers("--degrees", degrees, MAX_DEGREE), "elements": _numbers("--elements", elements)}
    from ..verbs.convergence import convergence_of_run

    with working(out, ("convergence.csv", "convergence.png")), Interrupts() as interrupts:
        try:
            study = convergence_of_run(asked, **meshes)
        except SolveError as error:
            return fail(NOT_CONVERGED, explain(error.status, str(error)))
        interrupts.check()
        interrupts.hold = True
        written = [out / "convergence.csv", out / "convergence.png"]
        try:
            study.write_csv(written[0])
            study.plot(written[1])
        except (InputError, OSError) as error:
            return fail(NOT_WRITTEN if refused(error) else BAD_INPUT, not_written(error, out))
    if study.messages:
        return fail(NOT_CONVERGED, f"{'; '.join(study.messages)}. The other meshes are in {out}")
    return succeed(count(study.unknowns.size, "mesh", "meshes"), written, table=str(study), asked=table)


def _numbers(option: str, text: str, most: int | None = None) -> tuple[int, ...]:
    from ..verbs.arguments import check_increasing

    try:
        numbers = [int(word) for word in text.split(",")]
    except ValueError:
        raise InputError(option, text, "whole numbers separated by commas are allowed, such as 1,2,4") from None
    return check_increasing(option, numbers, most)
