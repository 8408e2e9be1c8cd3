"""Estimated discretisation errors: the key ``error_estimates`` of [analysis]."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...quantities import PLACES
from ..error_estimate import ESTIMATED, ErrorEstimate, from_numbers
from .base import Array, Cell, Curves, EquilibriumAnalysis, Section, Table, Variable

if TYPE_CHECKING:
    import xarray

    from ...scene import Scene
    from ..branch import Branch
    from ..equilibrium import Equilibrium


def held_by(scene: Scene) -> str:
    """What is held while errors are estimated: what the scene's [run] prescribes; the volume with arc length and without a run."""
    if scene.run is None:
        return "volume"
    held = scene.run.quantity if scene.run.hold is None else next(iter(scene.run.hold))
    return held if held in PLACES else "volume"


class ErrorEstimates(EquilibriumAnalysis):
    """Relative errors of what is not held, from the same load in a finer space."""

    def asked(self, scene: Scene) -> bool:
        return scene.analysis.error_estimates

    def columns(self, scene: Scene) -> Sequence[str]:
        return tuple(f"error_{name}" for name in (*(n for n in ("pressure", "volume") if n != held_by(scene)), "energy"))

    def value(self, equilibrium: Equilibrium, column: str) -> Cell:
        return float(getattr(_estimate(equilibrium, held_by(equilibrium.scene)), column.removeprefix("error_")).relative)

    def variables(self, branch: Branch) -> Mapping[str, Variable]:
        held = held_by(branch.scene)
        found = [_estimate(equilibrium, held) for equilibrium in branch]
        parts = {"error_value": "value", "error_estimate": "error"}
        words = {"error_control": "control", "error_method": "method", "error_reason": "reason"}
        numbers = {
            variable: np.array([[getattr(getattr(e, q), part) for q in ESTIMATED] for e in found]).reshape(len(found), len(ESTIMATED))
            for variable, part in parts.items()
        }
        return {
            "estimated": (("estimated",), np.array(ESTIMATED, dtype=str)),
            **{variable: (("step", "estimated"), values) for variable, values in numbers.items()},
            **{variable: (("step",), np.array([getattr(e, word) for e in found], dtype=str)) for variable, word in words.items()},
        }

    def restore(self, dataset: xarray.Dataset, branch: Branch) -> None:
        for equilibrium, estimate in zip(branch, _stored(dataset), strict=False):
            equilibrium.remember(("errors", estimate.control), estimate)

    def section(self, branch: Branch) -> Section:
        found = {column.removeprefix("error_"): branch.column(column) for column in self.columns(branch.scene)}
        held = held_by(branch.scene).replace("_", " ")
        note = f"Relative errors of the discretisation, at the same {held}, from the same load in a finer space"
        rows = [[name, *_largest(errors)] for name, errors in found.items()]
        figure = Curves("Estimated relative errors along the branch", "estimated relative error", found, logarithmic=True, columns=3)
        return Section("Error estimates", figure, Table(["of", "median", "largest", "there", "without an estimate"], rows, note))


def _estimate(equilibrium: Equilibrium, held: str) -> ErrorEstimate:
    return equilibrium.error_estimate(held)


def _largest(errors: Array) -> list[Any]:
    """Median and largest size of the errors that are known, the step of the largest, and how many are not known."""
    known = np.flatnonzero(np.isfinite(errors))
    if not known.size:
        return [np.nan, np.nan, "", errors.size]
    sizes = np.abs(errors[known])
    middle, largest = (float(f"{size:.1e}") for size in (np.median(sizes), sizes.max()))
    return [middle, largest, f"step {known[np.argmax(sizes)]}", errors.size - known.size]


def _stored(dataset: xarray.Dataset) -> Iterator[ErrorEstimate]:
    if "error_estimate" not in dataset:  # younger than the format
        return
    names = [str(name) for name in dataset["estimated"].values]
    for k in range(dataset.sizes["step"]):
        values, errors = (dict(zip(names, dataset[v].values[k].tolist(), strict=True)) for v in ("error_value", "error_estimate"))
        control, method, reason = (str(dataset[f"error_{word}"].values[k]) for word in ("control", "method", "reason"))
        yield from_numbers(control, values, errors, method, reason)
