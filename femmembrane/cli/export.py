"""``femmembrane export``: a finished run in the formats of other programs."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from .folders import OwnScene, finished, own_of
from .outcome import succeed


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
    from ..views.export import check_format
    from ..views.export import export as write

    suffix = "." + to.lower().lstrip(".")
    check_format(suffix)
    if out is not None and out.suffix.lower() != suffix:
        raise InputError("--out", str(out), f"a name that ends in {suffix} is allowed")
    file = out or (folder if folder.is_dir() else folder.parent) / f"export{suffix}"
    files = write(finished(folder, own=own_of(own)), file, step=step)
    return succeed("", [files[-1]])
