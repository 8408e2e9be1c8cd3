"""``femmembrane report``: one page about a finished run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError, Status
from .folders import OwnScene, System, finished, own_of
from .outcome import succeed

if TYPE_CHECKING:
    from ..results.branch import Branch
    from ..scene import Scene


def report(folder: Path, /, *, out: Path | None = None, units: System = "scaled", own: OwnScene = None) -> int:
    """Write one HTML page about a finished run: figures, verdicts, special points, zones, error estimates, scene, timings, versions.

    The page needs no network, and has what the run has. Exit codes: 0 done, 2 bad input.

    Parameters
    ----------
    folder
        Folder of a run, or a branch that was saved (.nc).
    out
        HTML file to write; report.html in the folder by default.
    units
        Of figures and ranges: those of the package, or SI units by the [scales] of the scene.
    """
    return succeed("", [write(folder, out, units, own_of(own))])


def write(folder: Path, out: Path | None = None, units: str = "scaled", own: Scene | None = None) -> Path:
    """Write the page of a run's folder, or of a saved branch, and return its path."""
    from ..files import remove_leftovers
    from ..results.output import read_record
    from ..views.report import write_report

    inside = folder if folder.is_dir() else folder.parent
    facts = (read_record(folder) or {}) if folder.is_dir() else {}
    alone = facts.get("equilibria") == 0 and not (folder / "branch.nc").exists()
    branch = _without_equilibria(facts, own) if alone else finished(folder, facts, own)
    page = inside / "report.html" if out is None else out
    remove_leftovers(page.parent)
    write_report(branch, page, facts, units=units)
    return page


def _without_equilibria(facts: dict[str, Any], own: Scene | None) -> Branch:
    """The branch of a run that found nothing and so left no other file."""
    from ..results.branch import Branch
    from ..scene import Scene

    try:
        return Branch(
            Scene.from_dict(facts["scene"], own=False if own is None else own),
            (),
            Status(facts["status"]),
            facts["message"],
            facts["timings"],
        )
    except (KeyError, ValueError, RecursionError) as error:
        raise InputError("folder", "run.json", f"the run.json of a run is needed ({error})") from None
