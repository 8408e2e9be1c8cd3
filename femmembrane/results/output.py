"""The folder that a run leaves behind."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from .store import package_version, replace_file, save
from .table import write_csv, write_special_points_csv, write_zones_csv

if TYPE_CHECKING:
    from .records import Branch

#: distributions whose versions are noted in run.json
NOTED_VERSIONS = ("femmembrane", "numpy", "scipy", "scikit-fem", "casadi")


def write_run(branch: Branch, directory: str | os.PathLike[str], *, command: str | Sequence[str] | None = None) -> list[Path]:
    """Write everything that is known of a branch to a folder.

    ``branch.csv``, ``special_points.csv`` (when the branch was searched for them), ``zones.csv`` and ``zones.png`` (when the scene asks for
    wrinkling), ``run.json``, ``branch.nc``, ``pressure-volume.png`` and, last, ``membrane.pvd`` with one VTU file an equilibrium in
    ``membrane/``. Every file is written whole or not at all. A branch without equilibria leaves ``run.json`` and tables without rows. Files
    of an earlier run in the same folder that this run does not write are removed, so that the folder speaks of one run only.

    Parameters
    ----------
    directory : path
        Made when it does not exist.
    command : str or sequence of str, optional
        The command that asked for the run, for ``run.json``.

    Returns
    -------
    list of Path
        The files written, VTU files not listed one by one.

    Raises
    ------
    InputError
        When the folder cannot be made or written to.
    """
    folder = _writable(Path(directory))
    files = {name: folder / name for name in _names(branch)}
    for stale in set(_ALL) - set(files):
        (folder / stale).unlink(missing_ok=True)
    write_csv(branch, files["branch.csv"])
    if "special_points.csv" in files:
        write_special_points_csv(branch, files["special_points.csv"])
    if "zones.csv" in files:
        write_zones_csv(branch, files["zones.csv"])
    _write_json(_facts(branch, command), files["run.json"])
    from ..views.plots import plot_pressure_volume, plot_zones
    from ..views.vtk import remove_surfaces, write_vtk

    if len(branch):
        save(branch, files["branch.nc"])
        plot_pressure_volume(branch, files["pressure-volume.png"])
        if "zones.png" in files:
            plot_zones(branch, files["zones.png"])
        write_vtk(branch, files["membrane.pvd"])
    else:
        remove_surfaces(folder / "membrane.pvd")
    return list(files.values())


_ALL = (
    *("branch.csv", "special_points.csv", "zones.csv", "run.json"),
    *("branch.nc", "pressure-volume.png", "zones.png", "membrane.pvd"),
)


def _names(branch: Branch) -> list[str]:
    """The files that this branch gets, in the order of writing."""
    absent = set() if len(branch) else {"branch.nc", "pressure-volume.png", "zones.png", "membrane.pvd"}
    if not branch.scene.analysis.wrinkling:
        absent |= {"zones.csv", "zones.png"}
    if branch.special_points is None:
        absent.add("special_points.csv")
    return [name for name in _ALL if name not in absent]


def _writable(folder: Path) -> Path:
    """Make the folder and try it, before anything is computed from the branch."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with replace_file(folder / ".writable") as probe:
            probe.touch()
        (folder / ".writable").unlink()
    except (OSError, InputError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it cannot be written to"
        raise InputError("--out", str(folder), f"a folder that can be made and written to is needed ({reason})") from error
    return folder


def _facts(branch: Branch, command: str | Sequence[str] | None) -> dict[str, Any]:
    """What was asked, what it ran on, and how it went."""
    return {
        "scene": branch.scene.to_dict(),
        "command": command if command is None or isinstance(command, str) else list(command),
        **({"mesh": branch.mesh_used} if branch.mesh_used else {}),
        **({"notes": list(branch.notes)} if branch.notes else {}),
        "status": branch.status.value,
        "message": branch.message,
        "equilibria": len(branch),
        "special_points": None if branch.special_points is None else len(branch.special_points),
        "timings": {stage: float(seconds) for stage, seconds in branch.timings.items()},
        "versions": {"python": platform.python_version(), **{name: package_version(name) for name in NOTED_VERSIONS}},
        "platform": platform.platform(),
        "processors": os.cpu_count(),
        "written": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _write_json(facts: dict[str, Any], path: Path) -> None:
    text = json.dumps(facts, indent=2, ensure_ascii=False)
    with replace_file(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")
