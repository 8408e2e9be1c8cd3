"""``femmembrane explore``: one page on which a finished run is explored."""

from __future__ import annotations

import sys
from pathlib import Path

from .folders import System, finished
from .outcome import DONE, say


def explore(folder: Path, /, *, out: Path | None = None, units: System = "scaled") -> int:
    """Write one HTML page on which a finished run is explored: click a state to see it in space with its verdicts, modes and zones.

    The page needs no network. Exit codes: 0 done, 2 bad input.

    Parameters
    ----------
    folder
        Folder of a run, or a branch that was saved (.nc).
    out
        HTML file to write; explore.html in the folder by default.
    units
        Of axes, shapes and numbers: those of the package, or SI units by the [scales] of the scene.
    """
    page = write(folder, out, units)
    if sys.stdout.isatty():
        say(f"written:\n  {page}\n")
    return DONE


def write(folder: Path, out: Path | None = None, units: str = "scaled") -> Path:
    """Write the page of a run's folder, or of a saved branch, and return its path."""
    from ..files import remove_leftovers
    from ..views.explorer import write_explorer

    check_explorer()
    inside = folder if folder.is_dir() else folder.parent
    page = inside / "explore.html" if out is None else out
    branch = finished(folder)
    remove_leftovers(page.parent)
    write_explorer(branch, page, units=units)
    return page


def check_explorer() -> None:
    """Refuse a page that could not be drawn before anything is computed."""
    from ..views.explorer import check_explorer

    check_explorer()
