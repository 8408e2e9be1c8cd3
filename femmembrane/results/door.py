"""The one door from records up into the rooms that judge and draw them.

Records stand below these rooms. They go up here alone, when one of their methods is called.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..potential import Array, Evaluation, Potential
    from ..scene import Scene
    from ..solve.controls import Control, Gas
    from ..solve.sensitivity import Rates, Sensitive
    from ..stability.profile import Profile
    from .branch import Branch
    from .convergence import Convergence
    from .cost import Cost
    from .equilibria import Equilibria
    from .equilibrium import Equilibrium
    from .error_estimate import ErrorEstimate, PlaceEstimate
    from .fit import Fit
    from .folds import FoldCurve
    from .postbuckling import Postbuckling
    from .special_point import SpecialPoint
    from .sweep import Sweep
    from .tipped import TippedBranch, TippedEquilibrium
    from .verdict import Verdict
    from .vibration import Vibration
    from .zones import Zones, ZonesAlong


# --- questions


def gas(amount: float, chamber: float, atmosphere: float) -> Gas:
    """See :class:`femmembrane.Gas`."""
    from ..solve.controls import Gas

    return Gas(amount, chamber, atmosphere)


def profile_at(scene: Scene, x: Array, pressure: float, s: Array) -> Profile:
    """See :func:`femmembrane.stability.profile.profile_at`."""
    from ..stability.profile import profile_at

    return profile_at(scene, x, pressure, s)


@cache
def checked_verdict() -> Callable[..., Verdict]:
    """:func:`femmembrane.stability.checked_verdict.checked_verdict`, looked up once, as a branch asks at every step."""
    from ..stability.checked_verdict import checked_verdict

    return checked_verdict


def natural_frequencies(potential: Potential, x: Array, pressure: float, n: int, count: int, control: str) -> tuple[Vibration, ...]:
    """See :func:`femmembrane.stability.frequencies.natural_frequencies`."""
    from ..stability.frequencies import natural_frequencies

    return natural_frequencies(potential, x, pressure, n, count, control)


def postbuckling(onset: Equilibrium, azimuthal: int) -> Postbuckling:
    """See :func:`femmembrane.stability.postbuckling.postbuckling`."""
    from ..stability.postbuckling import postbuckling

    return postbuckling(onset.potential, onset.state, onset.pressure, azimuthal, onset.enclosed)


def tipped_verdict(equilibrium: TippedEquilibrium, control: str) -> Verdict:
    """See :func:`femmembrane.stability.tipped.tipped_verdict`."""
    from ..stability.tipped import tipped_verdict

    return tipped_verdict(equilibrium, control)


def find_zones(scene: Scene, x: Array, pressure: float, criterion: str) -> Zones:
    """See :func:`femmembrane.stability.zones.find_zones`."""
    from ..stability.zones import find_zones

    return find_zones(scene, x, pressure, criterion)


def zones_along(branch: Branch) -> ZonesAlong:
    """See :func:`femmembrane.stability.zones.zones_along`."""
    from ..stability.zones import zones_along

    return zones_along(branch)


def estimate_errors(potential: Potential, x: Array, pressure: float, control: str, verdicts: Mapping[str, Verdict]) -> ErrorEstimate:
    """See :func:`femmembrane.accuracy.error_estimate.estimate_errors`."""
    from ..accuracy.error_estimate import estimate_errors

    return estimate_errors(potential, x, pressure, control, verdicts)


def on_borders(eq: Equilibrium, held: Control) -> Equilibrium:
    """See :meth:`.Equilibrium.on_borders`."""
    from ..accuracy.borders import equilibrium_on_borders

    return equilibrium_on_borders(eq, held)


def estimate_place(point: SpecialPoint) -> PlaceEstimate:
    """See :func:`femmembrane.accuracy.place_estimate.estimate_place`."""
    from ..accuracy.place_estimate import estimate_place

    eq = point.equilibrium
    return estimate_place(eq.potential, eq.state, eq.pressure, point.kind, point.azimuthal)


def eigenvalue_rates(
    eq: Equilibrium,
    known: Sensitive,
    rates: Rates,
    control: str | None,
    azimuthal: int,
    moved: Callable[[int, float], tuple[Scene, Array, float]],
    step: Callable[[int], float],
    at: Callable[[tuple[Scene, Array, float]], tuple[Potential, Evaluation]],
) -> Array:
    """See :func:`femmembrane.stability.eigenvalue_rates.eigenvalue_rates`."""
    from ..stability.eigenvalue_rates import eigenvalue_rates

    return eigenvalue_rates(eq, known, rates, control, azimuthal, moved, step, at)


def holding(scene: Scene, evaluation: Evaluation) -> Potential:
    """The potential of a scene with the nodes held that bodies hold in an evaluation."""
    from ..potential import potential_of
    from ..stability.azimuthal_operator import on_set

    return on_set(potential_of(scene), evaluation) if scene.bodies else potential_of(scene)


# --- pictures and pages


def tipped_surface(equilibrium: TippedEquilibrium, angles: Array) -> dict[str, Array]:
    """See :func:`femmembrane.views.tipped.surface_at`."""
    from ..views.tipped import surface_at

    return surface_at(equilibrium, angles)


def write_tipped_vtk(branch: TippedBranch, path: str | PathLike[str]) -> list[Path]:
    """See :func:`femmembrane.views.tipped.write_tipped_vtk`."""
    from ..views.tipped import write_tipped_vtk

    return write_tipped_vtk(branch, path)


def plot_tipped(branch: TippedBranch, path: str | PathLike[str] | None, ax: Any, x: str, y: str, label: str) -> Any:
    """See :func:`femmembrane.views.tipped.plot_tipped`."""
    from ..views.tipped import plot_tipped

    return plot_tipped(branch, path, ax, x, y, label)


def plot_pressure_volume(branch: Branch, path: str | PathLike[str] | None = None, units: str = "scaled") -> Any:
    """See :func:`femmembrane.views.plots.plot_pressure_volume`."""
    from ..views.plots import plot_pressure_volume

    return plot_pressure_volume(branch, path, units=units)


def plot_branch(
    branch: Branch, path: str | PathLike[str] | None, ax: Any, x: str | None, y: str | None, label: str | None, units: str
) -> Any:
    """See :func:`femmembrane.views.plots.plot_branch`."""
    from ..views.plots import plot_branch

    return plot_branch(branch, path, ax=ax, x=x, y=y, label=label, units=units)


def plot_zones(branch: Branch, path: str | PathLike[str] | None = None) -> Any:
    """See :func:`femmembrane.views.plots.plot_zones`."""
    from ..views.plots import plot_zones

    return plot_zones(branch, path)


def draw_zones(axes: Any, branch: Branch) -> Sequence[Any]:
    """See :func:`femmembrane.views.plots.draw_zones`."""
    from ..views.plots import draw_zones

    return draw_zones(axes, branch)


def plot_fold_curve(curve: FoldCurve, path: str | PathLike[str] | None = None, ax: Any = None, y: str = "pressure") -> Any:
    """See :func:`femmembrane.views.folds.plot_fold_curve`."""
    from ..views.folds import plot_fold_curve

    return plot_fold_curve(curve, path, ax=ax, y=y)


def plot_convergence(study: Convergence, path: str | PathLike[str] | None, ax: Any, quantities: Sequence[str] | None, against: str) -> Any:
    """See :func:`femmembrane.views.convergence.plot_convergence`."""
    from ..views.convergence import plot_convergence

    return plot_convergence(study, path, ax=ax, quantities=quantities, against=against)


def plot_cost(study: Cost, path: str | PathLike[str] | None = None, ax: Any = None, start: str | None = None) -> Any:
    """See :func:`femmembrane.views.cost.plot_cost`."""
    from ..views.cost import plot_cost

    return plot_cost(study, path, ax=ax, start=start)


def plot_fit(fit: Fit, path: str | PathLike[str] | None = None) -> Any:
    """See :func:`femmembrane.views.fit.plot_fit`."""
    from ..views.fit import plot_fit

    return plot_fit(fit, path)


def write_fit_report(fit: Fit, path: str | PathLike[str]) -> None:
    """See :func:`femmembrane.views.fit.write_fit_report`."""
    from ..views.fit import write_fit_report

    write_fit_report(fit, path)


def plot_grid(
    sweep: Sweep,
    path: str | PathLike[str] | None = None,
    show: Sequence[str] | None = None,
    units: str = "scaled",
    ax: Any = None,
) -> Any:
    """See :func:`femmembrane.views.grid.plot_grid`."""
    from ..views.grid import plot_grid

    return plot_grid(sweep, path, show, units, ax)


def write_vtk(branch: Sequence[Equilibrium], path: str | PathLike[str]) -> list[Path]:
    """See :func:`femmembrane.views.vtk.write_vtk`."""
    from ..views.vtk import write_vtk

    return write_vtk(branch, path)


def remove_surfaces(path: Path) -> None:
    """See :func:`femmembrane.views.vtk.remove_surfaces`."""
    from ..views.vtk import remove_surfaces

    remove_surfaces(path)


def write_report(branch: Branch, path: str | PathLike[str], units: str = "scaled") -> None:
    """See :func:`femmembrane.views.report.write_report`."""
    from ..views.report import write_report

    write_report(branch, path, units=units)


def write_explorer(branch: Branch, path: str | PathLike[str], units: str = "scaled") -> None:
    """See :func:`femmembrane.views.explorer.write_explorer`."""
    from ..views.explorer import write_explorer

    write_explorer(branch, path, units=units)


def branch_html(branch: Branch) -> str:
    """See :func:`femmembrane.views.notebook.branch_html`."""
    from ..views.notebook import branch_html

    return branch_html(branch)


def tipped_html(branch: TippedBranch) -> str:
    """See :func:`femmembrane.views.notebook.tipped_html`."""
    from ..views.notebook import tipped_html

    return tipped_html(branch)


def equilibrium_html(equilibrium: Equilibrium) -> str:
    """See :func:`femmembrane.views.notebook.equilibrium_html`."""
    from ..views.notebook import equilibrium_html

    return equilibrium_html(equilibrium)


def zones_html(zones: Zones) -> str:
    """See :func:`femmembrane.views.notebook.zones_html`."""
    from ..views.notebook import zones_html

    return zones_html(zones)


def equilibria_html(found: Equilibria) -> str:
    """See :func:`femmembrane.views.notebook.equilibria_html`."""
    from ..views.notebook import equilibria_html

    return equilibria_html(found)


def fold_curve_html(curve: FoldCurve) -> str:
    """See :func:`femmembrane.views.notebook.fold_curve_html`."""
    from ..views.notebook import fold_curve_html

    return fold_curve_html(curve)


def error_estimate_html(estimate: ErrorEstimate) -> str:
    """See :func:`femmembrane.views.notebook.error_estimate_html`."""
    from ..views.notebook import error_estimate_html

    return error_estimate_html(estimate)


def study_html(study: Convergence | Cost | Sweep | Fit, label: str) -> str:
    """See :func:`femmembrane.views.notebook.study_html`."""
    from ..views.notebook import study_html

    return study_html(study, label)
