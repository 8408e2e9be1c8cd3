"""The folder that a run leaves behind."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import platform
import tempfile
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError, NotWrittenError, Status
from ..files import read_bytes, refuse_obstacles, replace_file
from ..kernels import kernels
from ..origin import NOTED_VERSIONS, package_version
from . import door
from .analyses import asked, registered
from .branch import Branch
from .checkpoint import scene_difference
from .netcdf import reason
from .store import save
from .table import write_csv, write_special_points_csv
from .tipped_store import write_points_csv

if TYPE_CHECKING:
    from .tipped import TippedBranch

#: the record of a run, which makes its folder complete
RECORD = "run.json"
#: the diagram of a run, and of one over a number of the scene
DIAGRAMS = ("pressure-volume.png", "response.png")
#: the folder of the surfaces of a run
SURFACES_FOLDER = "membrane"


def run_files() -> tuple[str, ...]:
    """All files that a run may leave behind, in the order in which they are listed."""
    tables, pictures = ([name for a in registered() for name in getattr(a, kind)] for kind in ("tables", "pictures"))
    pages = ("report.html", "explore.html")  # written from the rest, by whom they are asked for
    return ("branch.csv", "special_points.csv", *tables, RECORD, "branch.nc", *DIAGRAMS, *pictures, SURFACES, *pages)


def write_run(
    branch: Branch, directory: str | os.PathLike[str], *, command: str | Sequence[str] | None = None, units: str = "scaled"
) -> list[Path]:
    """Write everything that is known of a branch to a folder.

    ``branch.nc``, ``branch.csv``, ``special_points.csv`` (when the branch was searched for them), the files of the analyses that the scene
    asks for (of wrinkling ``zones.csv`` and ``zones.png``), ``pressure-volume.png`` (over a number
    ``response.png``), ``membrane.pvd`` with one VTU file an equilibrium in
    ``membrane/`` (not with ``vtu=False`` in the scene)
    and, last, ``run.json``: a folder with this file is complete. Every file is written whole or not at all. A branch without
    equilibria leaves ``run.json`` and tables without rows. Files of an earlier run in the same folder that this run does not write are
    removed, so that the folder speaks of one run only.

    Parameters
    ----------
    directory : path
        Made when it does not exist.
    command : str or sequence of str, optional
        The command that asked for the run, for ``run.json``.
    units : {"scaled", "si"}
        Of ``pressure-volume.png``.

    Returns
    -------
    list of Path
        The files written, VTU files not listed one by one.

    Raises
    ------
    InputError
        When the folder cannot be made or written to, or a folder or a link in it stands in the way.
    NotWrittenError
        When some files could not be written (a full disk); all others were.
    """
    return _write_folder(Path(directory), _writers(branch, command, units))


def _write_folder(directory: Path, writers: Mapping[str, Callable[[Path], object]]) -> list[Path]:
    """Write files to a folder, the record last and only if all others were, and remove those of an earlier run that are not among them."""
    folder = _writable(directory)
    names = run_files()
    refuse_obstacles(folder, names, (SURFACES_FOLDER,))
    for stale in {*names} - (writers.keys() - {RECORD}):
        (folder / stale).unlink(missing_ok=True)
    if SURFACES not in writers:
        door.remove_surfaces(folder / SURFACES)
    failed: dict[str, OSError] = {}
    for name in sorted(writers, key=lambda name: (name == RECORD, name != _FIRST, names.index(name))):
        if name == RECORD and failed:
            break
        try:
            writers[name](folder / name)
        except OSError as error:
            failed[name] = error
            _drop(folder / name)
    if failed:
        first = next(iter(failed.values()))
        raise NotWrittenError(first.strerror or str(first), failed) from first
    return [folder / name for name in names if name in writers]


def write_tipped_run(branch: TippedBranch, directory: str | os.PathLike[str], command: str | None = None) -> list[Path]:
    """Write everything that is known of a branch with waves around the axis to a folder, with the names that a run has.

    Files of an earlier run in the folder are removed.

    Parameters
    ----------
    branch : TippedBranch
    directory : path
        Made when it does not exist.
    command : str, optional
        The command that asked for it, for ``run.json``.

    Returns
    -------
    list of Path
        The files written, VTU files not listed one by one.

    Raises
    ------
    InputError
        When the folder cannot be made or written to, or a folder or a link in it stands in the way.
    NotWrittenError
        When some files could not be written (a full disk); all others were.
    """
    writers: dict[str, Callable[[Path], object]] = {"branch.nc": branch.save, "branch.csv": branch.to_csv, DIAGRAMS[0]: branch.plot}
    if branch.special_points is not None:
        writers["special_points.csv"] = partial(write_points_csv, branch)
    if branch.scene.vtu:
        writers[SURFACES] = branch.to_vtk
    writers[RECORD] = lambda path: _write_json(_facts(branch, command), path)
    return _write_folder(Path(directory), writers)


def read_record(folder: Path) -> dict[str, Any] | None:
    """``run.json`` of a folder that a run has completed, None without one.

    Raises
    ------
    InputError
        When it is not what a run has written.
    """
    path = folder / RECORD
    try:
        facts = json.loads(read_bytes(path).decode("utf-8"))
        _check_record(facts)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InputError("folder", str(path), f"the run.json of a run is needed ({reason(error)})") from None
    facts.pop("digest", None)
    return dict(facts)


def refuse_other_branch(branch: Branch, facts: Mapping[str, Any], folder: Path) -> None:
    """Refuse the branch of a folder whose record is of another run.

    Parameters
    ----------
    branch : Branch
        As ``branch.nc`` has it.
    facts : mapping
        As ``run.json`` has them.

    Raises
    ------
    InputError
        Naming all that differs in the scene; where the scene is the same, that it is another run of it.
    """
    differing = scene_difference(branch.scene.record(), facts["scene"])
    # wall times are those of one run alone
    own = {"status": branch.status.value, "message": branch.message, "equilibria": len(branch), "timings": dict(branch.timings)}
    if not differing and all(facts.get(name, value) == value for name, value in own.items()):
        return
    what = f"its branch.nc has another scene than its run.json: {differing}" if differing else "its branch.nc and run.json are of two runs"
    raise InputError("folder", str(folder), f"{what}; the files of one run are allowed, or branch.nc alone")


def _check_record(facts: dict[str, Any]) -> None:
    """Raise ValueError, or another error for values of a wrong type, unless this is a record that nobody changed. Old records have no
    digest.
    """
    digest = facts.pop("digest", None)
    # the name of the digest itself may be damaged
    if digest != _digest(facts) if digest is not None else not facts.keys() <= _FACTS:
        raise ValueError("it was damaged or changed after it was written")
    Status(facts["status"])
    texts = [
        facts["message"],
        *(facts[name] for name in ("mesh", "platform", "written") if name in facts),
        *facts.get("versions", {}).values(),
    ]
    numbers = [facts["equilibria"], facts.get("processors") or 1, *facts.get("timings", {}).values()]
    command = facts.get("command")
    if not (
        isinstance(facts["scene"], dict)
        and all(isinstance(text, str) for text in [*texts, *(command if isinstance(command, list) else [command or ""])])
        and all(isinstance(number, (int, float)) and number >= 0 for number in numbers)
        and isinstance(facts["equilibria"], int)
    ):
        raise ValueError("a value of another type stands in it")


def _digest(facts: dict[str, Any]) -> str:
    return hashlib.blake2b(json.dumps(facts, sort_keys=True).encode(), digest_size=16).hexdigest()


SURFACES = "membrane.pvd"
#: all that a record may hold beside its digest
_FACTS = {
    *("scene", "command", "mesh", "notes", "status", "message", "equilibria", "special_points", "timings", "compiled"),
    *("versions", "platform", "processors", "written"),
}
#: what holds most in the least room is written first; the record, which makes the folder complete, last
_FIRST = "branch.nc"


def _writers(branch: Branch, command: str | Sequence[str] | None, units: str) -> dict[str, Callable[[Path], object]]:
    """How each file that this branch gets is written."""
    writers: dict[str, Callable[[Path], object]] = {"branch.csv": partial(write_csv, branch)}
    if branch.special_points is not None:
        writers["special_points.csv"] = partial(write_special_points_csv, branch)
    analyses = asked(branch.scene)
    writers |= {name: partial(write, branch) for analysis in analyses for name, write in analysis.tables.items()}
    if len(branch):
        diagram = DIAGRAMS[bool(branch.over)]
        writers |= {"branch.nc": partial(save, branch), diagram: partial(door.plot_pressure_volume, branch, units=units)}
        if branch.scene.vtu:
            writers[SURFACES] = partial(door.write_vtk, branch)
        writers |= {name: partial(draw, branch) for analysis in analyses for name, draw in analysis.pictures.items()}
    writers[RECORD] = lambda path: _write_json(_facts(branch, command), path)
    return writers


def _drop(path: Path) -> None:
    """Remove a file of an earlier run that this run could not replace."""
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)
        if path.name == SURFACES:
            door.remove_surfaces(path)


def _writable(folder: Path) -> Path:
    """Make the folder and try it, before anything is computed from the branch."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        allowed = f"a folder that can be made and written to is needed ({error.strerror})"
        raise InputError("--out", str(folder), allowed) from error
    return folder


def _facts(branch: Branch | TippedBranch, command: str | Sequence[str] | None) -> dict[str, Any]:
    """The record of a run: what was asked, on which machine, and how it ended."""
    return {
        "scene": branch.scene.record(),
        "command": command if command is None or isinstance(command, str) else list(command),
        **({"mesh": branch.mesh_used} if isinstance(branch, Branch) and branch.mesh_used else {}),
        **({"notes": list(branch.notes)} if isinstance(branch, Branch) and branch.notes else {}),
        "status": branch.status.value,
        "message": branch.message,
        "equilibria": len(branch),
        "special_points": None if branch.special_points is None else len(branch.special_points),
        "timings": {stage: float(seconds) for stage, seconds in branch.timings.items()},
        "compiled": (branch[0].potential.elements if len(branch) else kernels()).name == "compiled",
        "versions": {"python": platform.python_version(), **{name: package_version(name) for name in NOTED_VERSIONS}},
        "platform": platform.platform(),
        "processors": os.cpu_count(),
        "written": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _write_json(facts: dict[str, Any], path: Path) -> None:
    text = json.dumps({**facts, "digest": _digest(json.loads(json.dumps(facts)))}, indent=2, ensure_ascii=False)
    with replace_file(path) as temporary:
        # a name in the command that is no UTF-8 becomes the escape that JSON has for it
        temporary.write_text(text + "\n", encoding="utf-8", errors="backslashreplace")
