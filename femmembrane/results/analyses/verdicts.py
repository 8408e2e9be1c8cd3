"""Verdicts on stability: the keys ``stability`` and ``azimuthal_modes`` of [analysis]."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from ...quantities import axis_label, heading, typed
from ...scene import ALL, VERDICTS, Perturbations
from .. import door
from ..ragged import row_of, stacked
from ..verdict import Verdict
from .base import Array, Cell, Curves, EquilibriumAnalysis, PrintedColumn, Remark, Section, Table, Variable

if TYPE_CHECKING:
    import xarray

    from ...potential import Evaluation
    from ...scene import Scene
    from ..branch import Branch
    from ..equilibrium import Equilibrium
    from ..special_point import SpecialPoint

#: controls whose verdicts are printed of a scene that asks for none
_PRINTED = ("pressure", "volume")
_COLUMN = re.compile(rf"(lambda|verdict)_(?:({'|'.join(VERDICTS)})|n([1-9]\d*)|(all))|waves_all")
_STABLE = {"stable": True, "unstable": False, "marginal": None}
#: in place of a number of negative directions that was not determined
_UNCOUNTED = -1


class Verdicts(EquilibriumAnalysis):
    """The verdicts in ``scene.analysis.verdicts``, with smallest eigenvalues and modes."""

    def asked(self, scene: Scene) -> bool:
        return bool(scene.analysis.verdicts)

    def compute(self, equilibrium: Equilibrium, before: Equilibrium | None, evaluation: Evaluation) -> None:
        """Started from the modes of the equilibrium before, with the factors that the evaluation has."""
        potential, state = evaluation.potential, (equilibrium.state, equilibrium.pressure, evaluation)
        for p in equilibrium.scene.analysis.verdicts:
            guess = None if before is None or p.azimuthal == ALL else before.verdict(p.control, azimuthal=p.azimuthal).coefficients
            enclosed = equilibrium.enclosed if p.control == "gas" else None
            compliance = enclosed.compliance(equilibrium.volume) if enclosed else None
            verdict = door.checked_verdict()(potential, *state, p.control, p.azimuthal, guess=guess, compliance=compliance)
            equilibrium.remember(("verdict", p.control, p.azimuthal), verdict)

    # --- tables

    def columns(self, scene: Scene) -> Sequence[str]:
        controls = [control for control in VERDICTS if control in scene.analysis.stability]
        waves = [f"lambda_{p.tag}" for p in scene.analysis.verdicts if p.azimuthal]
        waves += ["waves_all"] if ALL in scene.analysis.azimuthal_modes else []
        return (*(f"lambda_{c}" for c in controls), *(f"verdict_{c}" for c in controls), *waves)

    def more_columns(self) -> Sequence[str]:
        """Those against perturbations of any number of waves are not listed."""
        return tuple(f"{kind}_{control}" for kind in ("lambda", "verdict") for control in VERDICTS)

    def knows(self, column: str) -> bool:
        return _COLUMN.fullmatch(column) is not None

    def value(self, equilibrium: Equilibrium, column: str) -> Cell:
        kind, control, waves, worst = _COLUMN.fullmatch(column).groups()  # type: ignore[union-attr]
        if kind is None:
            return _verdict(equilibrium, Perturbations(None, ALL)).azimuthal
        verdict = _verdict(equilibrium, Perturbations(control, worst or int(waves or 0)))
        return verdict.word if kind == "verdict" else float(verdict.smallest_eigenvalue)

    def point_columns(self, scene: Scene) -> Sequence[str]:
        return ("azimuthal",) if scene.analysis.azimuthal_modes else ()

    def found_columns(self, points: Sequence[SpecialPoint]) -> Sequence[str]:
        return ("postbuckling", "postbuckling_coefficient") if any(point.azimuthal for point in points) else ()

    def point_value(self, point: SpecialPoint, column: str) -> Cell:
        """Of other points than azimuthal onsets there is nothing after."""
        if column == "azimuthal":
            return point.azimuthal
        after = point.postbuckling if point.azimuthal else None
        if column == "postbuckling":
            return after.kind if after else ""
        return after.coefficient if after else np.nan

    # --- files

    def variables(self, branch: Branch) -> Mapping[str, Variable]:
        found: dict[str, Variable] = {}
        nodes = max(e.potential.space.node_parameters().size for e in branch) if branch.mesh_changes else None
        for p in branch.scene.analysis.verdicts:
            found |= _variables(p.tag, [_verdict(equilibrium, p) for equilibrium in branch], branch.scene.bending, nodes)
        return found

    def restore(self, dataset: xarray.Dataset, branch: Branch) -> None:
        """Modes included, to the last bit: eigenvalues found again from other guesses would differ in their last digits."""
        for p in branch.scene.analysis.verdicts:
            for equilibrium, verdict in zip(branch, _stored(dataset, p), strict=True):
                equilibrium.remember(("verdict", p.control, p.azimuthal), verdict)

    # --- words and pages

    def remarks(self, equilibrium: Equilibrium) -> Iterator[Remark]:
        """A caption has all verdicts. That perturbations are axisymmetric is said where no others were looked at."""
        asked = equilibrium.scene.analysis
        for k, p in enumerate(asked.verdicts):
            verdict = _verdict(equilibrium, p)
            about = p.against if asked.azimuthal_modes else ("" if k else "against axisymmetric perturbations ") + f"({p.held})"
            yield Remark(p.against, verdict.reason, f"{p.brief}: {verdict.word}", f"{verdict.word} {about}")

    def printed(self, scene: Scene) -> Sequence[PrintedColumn]:
        """Of the controls that the scene asks for; of both where it asks for none."""

        def word(control: str, equilibrium: Equilibrium) -> str:
            return equilibrium.verdict(control).word

        return [PrintedColumn(f"under {c}", partial(word, c), 14) for c in scene.analysis.stability or _PRINTED]

    def section(self, branch: Branch) -> Section:
        rows, last, curves = [], [], {}
        for p in branch.scene.analysis.verdicts:
            verdicts = [_verdict(equilibrium, p) for equilibrium in branch]
            for word, steps in stretches([v.word for v in verdicts]):
                span = str(steps[0]) if len(steps) == 1 else f"{steps[0]} to {steps[-1]}"
                rows.append([p.words, word, span, *(_span(branch.column(c)[steps]) for c in ("volume", "pressure"))])
            last.append(Remark(p.words, verdicts[-1].reason))
            name = f"lambda_{p.tag}"
            curves[axis_label(name)] = branch.column(name)
        figure = Curves("Smallest eigenvalues along the branch", axis_label("lambda"), curves)
        return Section("Verdicts", figure, Table(["against", "verdict", "steps", heading("volume"), heading("pressure")], rows), last)


def stretches(words: Sequence[str]) -> Iterator[tuple[str, list[int]]]:
    """Stretches of steps with the same word."""
    for word, steps in groupby(range(len(words)), key=words.__getitem__):
        yield word, list(steps)


def _span(values: Array) -> str:
    low, high = f"{values.min():.5g}", f"{values.max():.5g}"
    return (low if low == high else f"{low} … {high}").replace("-", "−")  # noqa: RUF001


def _verdict(equilibrium: Equilibrium, against: Perturbations) -> Verdict:
    return equilibrium.verdict(against.control, azimuthal=against.azimuthal)


def _variables(tag: str, verdicts: Sequence[Verdict], bending: bool, nodes: int | None) -> dict[str, Variable]:
    """All of the verdicts of one class that the columns leave out, and :func:`_stored` needs to build them again. The modes of the worst
    numbers of waves, which differ, are left out. ``nodes`` is how many a mesh has at most, where it changes along the branch.
    """
    numbers: dict[str, Sequence[Any]] = {
        f"verdict_{tag}": [v.word for v in verdicts],
        f"lambda_error_{tag}": [v.error for v in verdicts],
        f"negative_directions_{tag}": [_UNCOUNTED if v.negative_directions is None else v.negative_directions for v in verdicts],
        f"reason_{tag}": [v.reason for v in verdicts],
    }
    if bending:
        numbers[f"wavelength_{tag}"] = [v.wavelength for v in verdicts]
    variables: dict[str, Variable] = {name: (("step",), typed(name, values)) for name, values in numbers.items()}
    shapes = [] if tag == ALL else [_shape(v) for v in verdicts]
    for key, known in next((s for s in shapes if s), {}).items():
        dimension = f"coefficient_{tag}" if key == "coefficients" else "node"
        width = nodes if dimension == "node" else None
        variables[f"mode_{tag}_{key}"] = (("step", dimension), stacked((s.get(key, known[:0]) for s in shapes), width))
    return variables


def _shape(verdict: Verdict) -> dict[str, Array]:
    """The mode of a verdict by component, empty without a mode; its radii are those of the profile's nodes."""
    mode = verdict.mode
    if mode is None or verdict.coefficients is None:
        return {}
    return {**{key: values for key, values in mode.items() if key != "r"}, "coefficients": verdict.coefficients}


def _stored(dataset: xarray.Dataset, against: Perturbations) -> Iterator[Verdict]:
    prefix, tag = f"mode_{against.tag}_", against.tag
    parts = {str(name).removeprefix(prefix): v.values for name, v in dataset.items() if str(name).startswith(prefix)}
    if not dataset.sizes["step"]:
        return
    radii = dataset["r"].values
    for k in range(dataset.sizes["step"]):
        mode = {"r": radii if radii.ndim == 1 else row_of(radii[k]), **{key: np.array(row_of(values[k])) for key, values in parts.items()}}
        coefficients = mode.pop("coefficients", None)
        known = coefficients is not None and coefficients.size > 0 and not np.isnan(coefficients).any()
        count = int(dataset[f"negative_directions_{tag}"].values[k])
        yield Verdict(
            stable=_STABLE[str(dataset[f"verdict_{tag}"].values[k])],
            smallest_eigenvalue=float(dataset[f"lambda_{tag}"].values[k]),
            error=float(dataset[f"lambda_error_{tag}"].values[k]),
            control=against.control,
            azimuthal=int(dataset["waves_all"].values[k]) if against.azimuthal == ALL else int(against.azimuthal),
            negative_directions=None if count == _UNCOUNTED else count,
            reason=str(dataset[f"reason_{tag}"].values[k]),
            coefficients=coefficients if known else None,
            _shape=partial(_stored_shape, mode) if known else None,
            wavelength=float(dataset[f"wavelength_{tag}"].values[k]) if f"wavelength_{tag}" in dataset else np.nan,
        )


def _stored_shape(mode: Mapping[str, Array], _: Array) -> Mapping[str, Array]:
    """In place of the function that finds the shape of a mode from its coefficients: the shape that was found."""
    return mode
