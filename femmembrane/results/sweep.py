"""What a sweep over a grid of scenes found, and how long it will take."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..scene.own import MissingPartError
from . import door
from .grid import load_dataset, save_dataset
from .identities import numbered_in_words
from .store import scene_from_text

if TYPE_CHECKING:
    import xarray

    from ..physics.scales import Scales
    from ..scene import Scene


def common_scales(scene: Scene, over: Iterable[str]) -> Scales | None:
    """The scales of all scenes that differ in some keys; None where they have none, or where these differ."""
    return None if any(key.split(".")[0] == "scales" for key in over) else scene.scales


@dataclass(frozen=True, eq=False)
class Sweep:
    """What came of every scene of a grid.

    Attributes
    ----------
    scene : Scene
        The scene whose keys were changed.
    over : mapping of str to tuple
        The values of each key.
    quantity : str
        What was computed of every scene.
    """

    scene: Scene
    over: Mapping[str, tuple[Any, ...]]
    quantity: str
    _dataset: xarray.Dataset = field(repr=False)

    def __len__(self) -> int:
        return math.prod(len(values) for values in self.over.values())

    def _repr_html_(self) -> str:
        """The maps and a summary, for notebooks."""
        return door.study_html(self, "Maps over the keys of the sweep")

    def __str__(self) -> str:
        keys = ", ".join(f"{key} ({len(values)} values)" for key, values in self.over.items())
        statuses, counts = np.unique(self._dataset["status"].values, return_counts=True)
        lines = [f"{len(self)} scenes over {keys}: {self.quantity}"]
        lines += [f"{count:>8} {status}" for status, count in zip(statuses, counts, strict=True)]
        return "\n".join([*lines, *numbered_in_words(self._dataset)])

    @property
    def summary(self) -> str:
        """How many scenes there are and how they ended, in a line."""
        statuses, counts = np.unique(self._dataset["status"].values, return_counts=True)
        ended = ", ".join(f"{count} {status}" for status, count in zip(statuses, counts, strict=True))
        return f"{len(self)} scene{'s' if len(self) > 1 else ''} ({ended})"

    @property
    def failed(self) -> int:
        """Number of scenes without a result; the reasons are in ``status`` and ``message``."""
        return int((~self._dataset["has_result"].values).sum())

    def to_xarray(self) -> xarray.Dataset:
        """Everything as one data set, whose dimensions are the keys; ``status`` and ``message`` say how each scene ended."""
        return self._dataset.copy()

    def save(self, path: str | PathLike[str]) -> None:
        """Write the data set to a NetCDF file, whole or not at all; :meth:`load` reads it back.

        Parameters
        ----------
        path : path
        """
        save_dataset(self._dataset, path)

    @classmethod
    def load(cls, path: str | PathLike[str], *, scene: Scene | None = None) -> Sweep:
        """Bring a saved sweep back.

        Parameters
        ----------
        path : path
        scene : Scene, optional
            For a scene with materials, sources, shapes or functions of your own: where these come from. A data file imports nothing.

        Raises
        ------
        InputError
            When the file is no sweep.
        """
        dataset = load_dataset(path)
        over = {key: tuple(dataset[key].values.tolist()) for key in json.loads(dataset.attrs["over"])}
        try:
            asked = scene_from_text(dataset.attrs["scene"], scene)
        except MissingPartError:
            raise
        except (ValueError, RecursionError) as error:
            raise InputError("path", str(path), f"a sweep written by femmembrane is needed ({error})") from None
        return cls(asked, over, dataset.attrs["quantity"], dataset)

    @property
    def scales(self) -> Scales | None:
        """The scales that all scenes have; None where they have none, or where these differ."""
        return common_scales(self.scene, self.over)

    def plot(
        self, path: str | PathLike[str] | None = None, *, ax: Any = None, show: Sequence[str] | None = None, units: str = "scaled"
    ) -> Any:
        """Maps over two keys, or curves over one, as a Matplotlib figure.

        Parameters
        ----------
        path : path, optional
            Where the figure is also written.
        ax : matplotlib Axes, optional
            Where to draw one variable, the first of ``show``; the answer is then these axes.
        show : sequence of str, optional
            Variables of the data set. Of special points ``limit_pressure#2`` is the one with this number in all scenes, and
            ``limit_pressure.1`` the second of each branch; over one key ``limit_pressure`` shows all. Other variables with several values
            a scene are named with a place, as ``pressure.0``. Default: the most telling variables of the quantity.
        units : {"scaled", "si"}
            Of volumes, pressures and heights: those of the package, or SI units by the scales.

        Raises
        ------
        InputError
            For an unknown variable, for three keys or more, or a file that cannot be written.
        """
        return door.plot_grid(self, path, show, units, ax)


@dataclass(frozen=True)
class Plan:
    """How long a sweep will take.

    Attributes
    ----------
    scenes, kept : int
        Number of different scenes of the grid, and how many of them are finished already.
    seconds_each : float
        Mean wall time of the scenes that were timed; 0 if none is left.
    timed, workers : int
        How many were timed, and how many processes share the work.
    """

    scenes: int
    kept: int
    seconds_each: float
    timed: int
    workers: int

    @property
    def seconds(self) -> float:
        """Expected wall time of what is left."""
        return (self.scenes - self.kept) * self.seconds_each / self.workers

    def __str__(self) -> str:
        left = self.scenes - self.kept
        text = f"{self.scenes} scenes, {self.kept} of them finished"
        if not left:
            return f"{text}: nothing to compute"
        each = f"{1e3 * self.seconds_each:.3g} ms a scene (mean of {self.timed})"
        return f"{text}; {each}: about {self.seconds:.3g} s for the other {left} on {self.workers} process(es)"
