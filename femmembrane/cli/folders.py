"""What a command reads and where it writes, checked before anything is computed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from cyclopts import Parameter

from ..errors import InputError, unknown_name
from .scenes import bundled

if TYPE_CHECKING:
    from ..results.branch import Branch
    from ..results.tipped import TippedBranch
    from ..scene import Scene

#: --units of the commands that draw
System: TypeAlias = Literal["scaled", "si"]
#: --set of the commands that read a scene
Changes = Annotated[
    list[str] | None,
    Parameter(
        name="--set",
        negative=(),
        help="KEY=VALUE in place of what the scene file has, such as mesh.elements=128 or 'run.until={volume=10}'; may be given again.",
    ),
]


#: of a finished run with parts of one's own
OwnScene = Annotated[
    Path | None,
    Parameter(name="--scene", help="Scene file of the run, needed for materials, sources or shapes of your own: they are imported."),
]


def read(path: Path, changes: Sequence[str] | None = None, *, needs_run: bool = True) -> Scene:
    """The scene of a file, or a scene that comes with the package, by its name. Values of ``--set`` go before the values of the file."""
    from ..memory import require_libraries

    require_libraries()
    from ..scene import Scene

    tables, folder = tables_of(path, changes)
    scene = Scene.from_dict(tables, folder, own=True)
    if needs_run and scene.run is None:
        raise InputError("run", None, 'missing; say what to compute: [run] with control = "volume", start, stop and steps')
    return scene


def tables_of(path: Path, changes: Sequence[str] | None = None) -> tuple[dict[str, Any], Path]:
    """The tables of a scene file with the values of ``--set``, and the folder of the file."""
    from ..scene import read_tables

    if not path.suffix and not path.exists():
        path = _bundled(str(path))
    tables = read_tables(path)
    if changes:
        from ..scene.keys import set_all

        tables = set_all("--set", tables, changes)
    return tables, path.parent


def own_of(scene: Path | None) -> Scene | None:
    """The scene that has the parts of one's own which a finished run lacks."""
    return None if scene is None else read(scene, needs_run=False)


def units_of(path: Path, changes: Sequence[str] | None, asked: str | None) -> str:
    """The units of pictures and pages: those asked for, else those of the scene file."""
    if asked is None:
        return str(tables_of(path, changes)[0].get("units", "scaled"))
    return asked


def _bundled(name: str) -> Path:
    known = bundled()
    if name not in known:
        error = unknown_name("scene", name, known)
        raise InputError("scene", name, f"no such file, and no scene that comes along by this name: {error.allowed}")
    return known[name]


@contextmanager
def working(out: Path, names: Iterable[str] = (), folders: Iterable[str] = ()) -> Iterator[None]:
    """Hold a folder for results. It is made if it does not exist, and tried before hours are spent on results that could not be kept.

    Unfinished files of a killed command are removed. A folder that was made here goes again if nothing is written to it.

    Parameters
    ----------
    out
        The folder.
    names, folders
        Of the files and folders that will be written to it.

    Raises
    ------
    InputError
        When the folder cannot be written to, when something that is not to be replaced stands in the way, or when it is in use.
    """
    made = _make(out)
    from ..files import refuse_obstacles, remove_leftovers
    from ..lock import locked

    try:
        refuse_obstacles(out, names, folders)
        with locked(out):
            for folder in (out, *(out / name for name in folders)):
                remove_leftovers(folder)
            yield
    finally:
        _remove_empty(made)


def _make(out: Path) -> list[Path]:
    """Make the folder, and write to it once. Answers the folders that were made, the innermost first."""
    import tempfile

    made: list[Path] = []
    try:
        made += [folder for folder in (out, *out.parents) if not folder.exists()]
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out) as probe:
            probe.write(b"femmembrane")
    except (OSError, ValueError) as error:  # ValueError: a null character in the path
        _remove_empty(made)
        reason = (error.strerror or str(error)) if isinstance(error, OSError) else str(error)
        raise InputError("--out", str(out), f"cannot be written ({reason}); a folder, there already or to be made, is allowed") from None
    return made


def _remove_empty(folders: Iterable[Path]) -> None:
    for folder in folders:
        with suppress(OSError, ValueError):
            folder.rmdir()


def finished(folder: Path, facts: Mapping[str, Any] | None = None, own: Scene | None = None) -> Branch:
    """The axisymmetric branch that a run left in a folder, or that was saved to a file; arguments are those of :func:`finished_any`.

    Raises
    ------
    InputError
        Also for a branch of states with waves around the axis.
    """
    from ..results.tipped import TippedBranch

    branch = finished_any(folder, facts, own)
    if not isinstance(branch, TippedBranch):
        return branch
    allowed = "an axisymmetric branch is allowed here; of states with waves there are femmembrane view and export --to pvd or csv"
    raise InputError("folder", str(folder), allowed)


def finished_any(folder: Path, facts: Mapping[str, Any] | None = None, own: Scene | None = None) -> Branch | TippedBranch:
    """The branch that a run left in a folder, or that was saved to a file.

    Parameters
    ----------
    folder
        The folder of the run, or the file.
    facts
        The record of the run, if the branch has to be that of this run.

    Raises
    ------
    InputError
        When there is no branch, when it cannot be read, and when it is not that of the run.
    """
    from ..memory import require_libraries

    require_libraries()
    from ..results.output import refuse_other_branch
    from ..results.store import load
    from ..results.tipped import TippedBranch

    file = folder / "branch.nc" if folder.is_dir() else folder
    if not file.is_file():
        raise InputError("folder", str(folder), "the folder of a run (with its branch.nc) or a saved branch (.nc) is allowed")
    branch: Branch | TippedBranch = load(file, scene=own)
    if facts and not isinstance(branch, TippedBranch):
        refuse_other_branch(branch, facts, folder)
    return branch
