"""``femmembrane switch``: the other branch at a special point of a finished run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from ..errors import InputError, SolveError, Status
from .folders import OwnScene, finished, own_of, working
from .interrupts import Interrupts
from .outcome import BAD_INPUT, NOT_CONVERGED, NOT_WRITTEN, count, explain, fail, not_written, refused, succeed

if TYPE_CHECKING:
    from ..results.branch import Branch
    from ..results.special_point import SpecialPoint

#: kinds of special points at which another branch sets out
_KINDS = ("azimuthal_onset", "branch_point")


def switch(
    folder: Path,
    /,
    *,
    out: Path,
    until: Annotated[list[str] | None, Parameter(negative=())] = None,
    point: int | None = None,
    direction: int = 1,
    max_steps: int = 400,
    harmonics: int | None = None,
    own: OwnScene = None,
) -> int:
    """Follow the other branch that sets out at a special point of a finished run, and write it to a folder.

    From an azimuthal onset it has the states with waves around the axis: the membrane leans over, or is no longer round. They are written
    as a run writes its own, and femmembrane view shows them and makes movies. From a branch point it has the axisymmetric states of the
    crossing branch. Exit codes: 0 done, 2 bad input, 3 not converged (what was computed is written), 4 results could not be written, 130
    interrupted (nothing is written).

    Parameters
    ----------
    folder
        Folder of a run by arc length, or a branch that was saved (.nc).
    out
        Folder for the results, made when there is none; earlier results in it are replaced.
    until
        Where to end, such as volume=0.42, pressure=1.8 or center_height="3 mm"; may be given again.
    point
        Which of the special points, by its row in special_points.csv from 0 on. Left out: the first onset or branch point.
    direction
        1 or -1: which half of the other branch.
    max_steps
        Most steps along the branch.
    harmonics
        From an onset: how many harmonics the waves have. Left out: as many as the states need.
    """
    branch: Branch = finished(folder, own=own_of(own))
    start = _point(branch, point, folder)
    ends: dict[str, float] = {}
    for text in until or []:
        name, value = _end(branch, text)
        if name in ends:
            raise InputError("--until", text, f"each quantity is allowed once; {name} was given before")
        ends[name] = value
    ways: dict[str, Any] = {"until": ends or None, "direction": direction, "max_steps": max_steps}
    if harmonics is not None:
        ways["harmonics"] = harmonics
    from ..results.output import SURFACES_FOLDER, run_files, write_run, write_tipped_run
    from ..results.tipped import TippedBranch
    from ..verbs.trace import trace

    with working(out, run_files(), (SURFACES_FOLDER,)), Interrupts() as interrupts:
        try:
            found = trace(branch.scene, start=start, **ways)
        except SolveError as error:
            return fail(NOT_CONVERGED, explain(error.status, str(error)))
        interrupts.check()
        interrupts.hold = True
        command = f"femmembrane switch {folder} --out {out}"
        try:
            written = write_tipped_run(found, out, command) if isinstance(found, TippedBranch) else write_run(found, out, command=command)
        except (InputError, OSError) as error:
            return fail(NOT_WRITTEN if refused(error) else BAD_INPUT, not_written(error, out))
    if found.status is not Status.CONVERGED and (ends or found.status is not Status.STEP_LIMIT):
        # Where harmonics are too few, the message has its own advice: that of the status is about meshes.
        too_few = isinstance(found, TippedBranch) and found.status is Status.NOT_RESOLVED
        message = (found.message if too_few else explain(found.status, found.message)).rstrip(".")
        return fail(NOT_CONVERGED, f"{message}. Computed before and kept: {count(len(found))}, in {out}")
    return succeed(count(len(found)), written)


def _point(branch: Branch, asked: int | None, folder: Path) -> SpecialPoint:
    """The special point that is meant, or InputError."""
    points = branch.special_points or ()
    places = [k for k, p in enumerate(points) if p.kind in _KINDS]
    known = ", ".join(f"{k} ({str(points[k].kind).replace('_', ' ')} at V = {points[k].volume:.6g})" for k in places)
    if not places:
        advice = "this run has none: onsets are looked for by arc length where [analysis] names azimuthal_modes"
        raise InputError("folder", str(folder), f"a run with an azimuthal onset or a branch point is allowed; {advice}")
    if asked is not None and asked not in places:
        raise InputError("--point", asked, f"a row of special_points.csv at which another branch sets out is allowed: {known}")
    return points[places[0] if asked is None else asked]


def _end(branch: Branch, text: str) -> tuple[str, float]:
    """Quantity and value of QUANTITY=VALUE."""
    from ..physics.units import has_unit, in_unit
    from ..quantities import PLACES, SI_UNITS, quantity

    name, mark, value = (part.strip() for part in text.partition("="))
    allowed = "QUANTITY=VALUE is allowed, with volume, pressure or center_height, such as volume=0.42"
    if not mark or name not in PLACES:
        raise InputError("--until", text, allowed)
    if has_unit(value):
        kind = quantity(name).si
        if branch.scene.scales is None:
            raise InputError("--until", text, "the scene of this run has no [scales] for a value with a unit")
        return name, float(branch.scene.scales.from_si(kind, in_unit("--until", value, SI_UNITS[kind])[0]))
    try:
        return name, float(value)
    except ValueError:
        raise InputError("--until", value, f"a number, or one with its unit, is allowed: {allowed}") from None
