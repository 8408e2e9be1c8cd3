"""``femmembrane explore``: one page on which a finished run is explored, or a scene while its numbers are moved."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from .folders import Changes, OwnScene, System, finished, own_of, read, units_of
from .outcome import succeed

if TYPE_CHECKING:
    from ..scene import Scene


def explore(
    source: Path,
    /,
    *,
    out: Path | None = None,
    live: bool = False,
    host: str = "127.0.0.1",
    port: int = 0,
    changes: Changes = None,
    units: System | None = None,
    own: OwnScene = None,
) -> int:
    """Explore a finished run on one HTML page; or, live, a scene whose numbers are moved while its branch is computed.

    On the page a click on a state shows it in space with its verdicts, modes and zones. A saved page needs no network. A live page is
    shown by a browser on this machine, at the address that is printed, until Ctrl-C. Exit codes: 0 done, 2 bad input.

    Parameters
    ----------
    source
        Folder of a run, or a branch that was saved (.nc); with --live a scene file (TOML).
    out
        HTML file to write; explore.html in the folder by default.
    live
        Serve a page with a slider for every number of the scene.
    host, port
        Where a live page is served: this machine alone, and any free port, unless given.
    units
        Of axes, shapes and numbers: those of the package, or SI units by the [scales] of the scene.
    """
    if live:
        from .live import serve

        return serve(read(source, changes), host=host, port=port, units=units_of(source, changes, units))
    if changes:
        raise InputError("--set", changes[0], "allowed with --live only: a finished run has its scene")
    return succeed("", [write(source, out, units or "scaled", own_of(own))])


def write(folder: Path, out: Path | None = None, units: str = "scaled", own: Scene | None = None) -> Path:
    """Write the page of a run's folder, or of a saved branch, and return its path."""
    from ..files import remove_leftovers
    from ..views.explorer import write_explorer

    check_explorer()
    inside = folder if folder.is_dir() else folder.parent
    page = inside / "explore.html" if out is None else out
    branch = finished(folder, own=own)
    remove_leftovers(page.parent)
    write_explorer(branch, page, units=units)
    return page


def check_explorer() -> None:
    """Refuse a page that could not be drawn before anything is computed."""
    from ..views.explorer import check_explorer

    check_explorer()
