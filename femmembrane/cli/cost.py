"""``femmembrane cost``: error against time of the last equilibrium of a scene file."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError, SolveError
from .folders import Changes, read, working
from .interrupts import Interrupts
from .outcome import BAD_INPUT, NOT_CONVERGED, NOT_WRITTEN, Table, count, explain, fail, not_written, refused, succeed


def cost(scene: Path, /, *, out: Path, changes: Changes = None, quick: bool = False, table: Table = False) -> int:
    """Measure error against time of the last equilibrium that a scene file asks for, by every method on every mesh.

    Writes cost.csv and cost.png. Exit codes: 0 done, 2 bad input, 3 not converged, 4 results could not be written, 130 interrupted. Only
    with 0 anything is written.

    Parameters
    ----------
    scene
        Scene file (TOML).
    out
        Folder for the results, made when there is none.
    quick
        Few meshes, each measured once: seconds in place of minutes.
    """
    asked = read(scene, changes)
    from ..verbs.cost import QUICK, asked_load
    from ..verbs.cost import cost as measure

    with working(out, ("cost.csv", "cost.png")), Interrupts() as interrupts:
        try:
            study = measure(asked, **asked_load(asked) | (dict(QUICK) if quick else {}))
        except SolveError as error:
            return fail(NOT_CONVERGED, explain(error.status, str(error)))
        interrupts.check()
        interrupts.hold = True
        try:
            study.write_csv(out / "cost.csv")
            study.plot(out / "cost.png")
        except (InputError, OSError) as error:
            return fail(NOT_WRITTEN if refused(error) else BAD_INPUT, not_written(error, out))
    return succeed(
        count(len(study.select(what="solve")), "timed solve", "timed solves"),
        [out / "cost.csv", out / "cost.png"],
        table=str(study),
        asked=table,
    )
