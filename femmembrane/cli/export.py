"""``femmembrane export``: a finished run in the formats of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from .folders import OwnScene, finished_any, own_of
from .outcome import succeed

if TYPE_CHECKING:
    from ..results.tipped import TippedBranch


def export(folder: Path, /, *, to: str, step: int | None = None, out: Path | None = None, own: OwnScene = None) -> int:
    """Write a finished run for other programs: pvd, xdmf (all equilibria), vtu, stl, obj (one), or csv (meridians).

    Exit codes: 0 done, 2 bad input.

    Parameters
    ----------
    folder
        Folder of a run, or a branch that was saved (.nc).
    to
        pvd, xdmf, vtu, stl, obj or csv.
    step
        Number of the equilibrium; negative ones count from the end. Default: the last, for csv all.
    out
        File to write; export.vtu and so on in the folder by default.
    """
    from ..results.tipped import TippedBranch
    from ..views.export import check_format
    from ..views.export import export as write

    suffix = "." + to.lower().lstrip(".")
    check_format(suffix)
    if out is not None and out.suffix.lower() != suffix:
        raise InputError("--out", str(out), f"a name that ends in {suffix} is allowed")
    file = out or (folder if folder.is_dir() else folder.parent) / f"export{suffix}"
    branch = finished_any(folder, own=own_of(own))
    if isinstance(branch, TippedBranch):
        return succeed("", [_write_tipped(branch, file, step)])
    return succeed("", [write(branch, file, step=step)[-1]])


def _write_tipped(branch: TippedBranch, file: Path, step: int | None) -> Path:
    """Surfaces or the table of a branch with waves around the axis."""
    if step is not None or file.suffix not in (".pvd", ".csv"):
        raise InputError("--to", file.suffix, "of states with waves around the axis pvd and csv are allowed, with all equilibria")
    (branch.to_vtk if file.suffix == ".pvd" else branch.to_csv)(file)
    return file
