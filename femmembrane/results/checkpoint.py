"""An unfinished run on disk: ``checkpoint.nc``, from which it is resumed, and a check that it belongs to the run.

A checkpoint is a branch file like any other (:mod:`.store`), so that the run can be looked at while it goes on. It also holds the memory
that predicts the next equilibrium.
"""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..origin import difference, origin
from .store import branch_of, read_branch_file, save
from .table import columns, reader

if TYPE_CHECKING:
    from ..scene import Scene
    from .branch import Branch

NAME = "checkpoint.nc"
#: seconds of work that may be lost, unless saving takes long
PAUSE = 2.0
#: part of the time of a run that saving may take
SHARE = 0.05


class Checkpoints:
    """Keeps the branch so far, and now and then saves it; made to be called after each equilibrium.

    Parameters
    ----------
    folder : Path
        Where the checkpoint is saved.
    latest : Branch, optional
        What the run was resumed from.
    """

    def __init__(self, folder: Path, latest: Branch | None = None) -> None:
        self.path, self.latest = folder / NAME, latest
        self.remarks = () if latest is None else latest.remarks
        self._analysed = 0
        self._due = time.perf_counter() + PAUSE

    def __call__(self, branch: Branch) -> None:
        self.latest = branch
        self._analyse(branch)
        clock = time.perf_counter()
        if clock >= self._due:
            with contextlib.suppress(
                OSError, InputError
            ):  # there may be room again before the end: a full disk does not stop hours of work
                self.save()
            now = time.perf_counter()
            self._due = now + max(PAUSE, (now - clock) / SHARE)

    def _analyse(self, branch: Branch) -> None:
        """Compute what the results will say about the new equilibria. They remember it, so that saving takes no longer than writing."""
        readers = [reader(branch.scene, name) for name in columns(branch)]
        for equilibrium in branch.equilibria[self._analysed :]:
            for read in readers:
                read(0, equilibrium)
        self._analysed = len(branch)

    def save(self) -> bool:
        """Save the branch so far; whether there is one.

        Raises
        ------
        InputError, OSError
            When it cannot be written; the checkpoint before stays.
        """
        if self.latest is None:
            return False
        save(replace(self.latest, remarks=self.remarks), self.path, {"origin": json.dumps(origin())})
        return True

    def remove(self) -> None:
        """Remove it: the run has come to its end."""
        self.path.unlink(missing_ok=True)


def unfinished(folder: Path, own: Scene | None = None) -> Branch | None:
    """The branch from which the run in a folder can go on, or None. If it was begun elsewhere, a remark says where.

    Parts that are no part of the package are those of a scene that is given.

    Raises
    ------
    InputError
        When there is a checkpoint that cannot be read.
    """
    path = folder / NAME
    try:
        if not path.exists():
            return None
        dataset = read_branch_file(path)
        branch = branch_of(dataset, path, own)
        began = json.loads(str(dataset.attrs.get("origin", "{}")))
        remark = difference(began if isinstance(began, dict) else {}, origin())
        return replace(branch, remarks=tuple(dict.fromkeys((*branch.remarks, *([remark] if remark else [])))))
    except (InputError, OSError, ValueError) as error:
        why = error.allowed if isinstance(error, InputError) else str(error)
        raise InputError("--resume", str(path), f"{why}; without --resume the run starts over") from error


def same_scene(asked: Scene, kept: Branch, key: str) -> Scene:
    """The scene of a kept branch; its mesh may have been chosen for the accuracy that is asked for.

    Raises
    ------
    InputError
        When it is not the scene asked for, naming all that differs.
    """
    refuse_others(asked, kept.scene.record(), key)
    return kept.scene


def refuse_others(asked: Scene, kept: Mapping[str, Any], key: str) -> None:
    """Refuse to go on with another scene, given by its tables.

    Raises
    ------
    InputError
        Naming all that differs.
    """
    here, there = (dict(_flat(tables)) for tables in (asked.record(), kept))
    if asked.open and here.get("mesh.accuracy") == there.get("mesh.accuracy"):  # the mesh that was chosen for it
        here, there = ({k: v for k, v in keys.items() if not k.startswith("mesh.")} for keys in (here, there))
    words = _difference(here, there)
    if words:
        advice = "go on with the scene it was begun with, choose another folder, or start over"
        raise InputError(key, asked.title or "this scene", f"the run to be resumed has another scene: {words}; {advice}")


def scene_difference(asked: Mapping[str, Any], kept: Mapping[str, Any]) -> str:
    """All that differs between two scenes, given by their tables; empty where nothing does."""
    return _difference(dict(_flat(asked)), dict(_flat(kept)))


def _difference(here: Mapping[str, Any], there: Mapping[str, Any]) -> str:
    differing = [name for name in sorted(here.keys() | there.keys()) if here.get(name) != there.get(name)]
    return "; ".join(f"{name} is {_word(here, name)}, was {_word(there, name)}" for name in differing)


def _flat(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _flat(item, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list) and value and all(isinstance(item, Mapping) for item in value):
        for k, item in enumerate(value):
            yield from _flat(item, path if len(value) == 1 else f"{path}[{k}]")
    else:
        yield path, value


def _word(keys: Mapping[str, Any], key: str) -> str:
    text = repr(keys[key]) if key in keys else "left out"
    return text if len(text) <= 40 else text[:37] + "..."
