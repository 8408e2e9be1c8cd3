"""``femmembrane fit``: numbers of a scene from measured tests."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from ..errors import InputError, SolveError, Status
from .folders import Changes, read, working
from .interrupts import Interrupts
from .outcome import BAD_INPUT, DONE, NOT_CONVERGED, NOT_WRITTEN, Table, explain, fail, not_written, refused, succeed

_FILES = ("fitted.toml", "fit.csv", "residuals.csv", "fit.png", "report.html")


def fit(
    scene: Path,
    /,
    *data: str,
    parameters: Annotated[list[str], Parameter(consume_multiple=True, negative=())],
    out: Path,
    noise: Annotated[list[str] | None, Parameter(consume_multiple=True, negative=())] = None,
    units: Literal["scaled", "si"] | None = None,
    starts: int | None = None,
    intervals: Literal["auto", "linear", "profile"] = "auto",
    compare: bool = False,
    changes: Changes = None,
    table: Table = False,
) -> int:
    """Fit numbers of a scene file to measured tests, and write them with their intervals, a scene file, a figure and a page.

    Writes fitted.toml, fit.csv, residuals.csv, fit.png and report.html, and with --compare models.csv. Exit codes: 0 done, 2 bad input, 3
    not converged, 4 results could not be written, 130 interrupted.

    Parameters
    ----------
    scene
        Scene file (TOML); its numbers are where the fit starts.
    data
        CSV files with units in their headers, such as pole_height_mm,pressure_kPa. OTHER.toml=OTHER.csv is a test of another scene.
    parameters
        Numbers to fit, such as material.mu material.jm.
    out
        Folder for the results, made when there is none.
    noise
        COLUMN=DEVIATION, such as "pressure=1 %" or "center_height=0.1 mm"; what nothing is said about is told by residuals.
    units
        What columns without a unit are.
    starts
        Starts of the solver.
    intervals
        Profile likelihood where it differs from the linearised intervals (auto), nowhere, or wherever it can be followed.
    compare
        Also compare the usual strain energies on these data.
    """
    asked = read(scene, changes, needs_run=False)
    if not data:
        raise InputError("DATA", "", "one CSV file or more are allowed")
    from ..calibration.measured import LabTest
    from ..verbs.fit import compare_models
    from ..verbs.fit import fit as fitted

    deviations = _noise(noise or [])
    tests = []
    for entry in data:
        own, mark, path = entry.partition("=")
        tests.append(LabTest(path, scene=read(Path(own), needs_run=False)) if mark else LabTest(entry))
    names = (*_FILES, "models.csv") if compare else _FILES
    with working(out, names), Interrupts() as interrupts:
        try:
            found = fitted(asked, tests, parameters, noise=deviations, units=units, starts=starts, intervals=intervals)
            models = compare_models(asked, tests, noise=deviations, units=units, starts=starts or 3) if compare else None
        except SolveError as error:
            return fail(NOT_CONVERGED, explain(error.status, str(error)))
        interrupts.check()
        interrupts.hold = True
        try:
            found.scene.to_toml(out / "fitted.toml")
            found.write_csv(out / "fit.csv")
            found.write_residuals(out / "residuals.csv")
            found.plot(out / "fit.png")
            found.report(out / "report.html")
            if models is not None:
                models.write_csv(out / "models.csv")
        except (InputError, OSError) as error:
            return fail(NOT_WRITTEN if refused(error) else BAD_INPUT, not_written(error, out))
    tables = "\n".join([str(found), *([str(models)] if models is not None else [])])
    succeed(found.summary, [out / name for name in names], table=tables, asked=table)
    if found.status is not Status.CONVERGED:
        return fail(NOT_CONVERGED, f"{'; '.join(found.notes)}. What suits the data best so far is in {out}")
    for note in () if sys.stdout.isatty() else found.notes:  # on a terminal the table ends with them
        fail(DONE, note)
    return DONE


def _noise(entries: list[str]) -> dict[str, str | float] | str | float | None:
    """The argument ``noise`` of the verb out of COLUMN=DEVIATION, or DEVIATION alone for the pressure or stress."""
    found: dict[str, str | float] = {}
    for entry in entries:
        name, mark, value = entry.partition("=")
        if not mark:
            if len(entries) > 1:
                raise InputError("--noise", entry, 'COLUMN=DEVIATION such as "pressure=1 %" is allowed')
            return _number(entry)
        found[name.strip()] = _number(value.strip())
    return found or None


def _number(text: str) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text
