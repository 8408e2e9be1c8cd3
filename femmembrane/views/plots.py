"""Plots of a branch: pressure against volume with its verdicts, and deformed meridians.

Figures are made without pyplot, so that nothing global changes and no window opens. Line style and marker shape carry all that colour
does: the figures read the same in grey.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..results.store import replace_file
from ..results.table import verdict_text
from .vtk import smooth_profile

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..results.records import Branch, Equilibrium

Array = NDArray[np.float64]

PRESSURE_LABEL = "pressure P = pR₀/(μT)"
VOLUME_LABEL = "volume V/R₀³"
_DPI = 160
#: branches of up to so many equilibria show them as dots
_DOTS = 80
#: points of a drawn meridian
_CURVE = 201


@dataclass(frozen=True)
class Style:
    """How a class of equilibria is drawn and named."""

    label: str
    dashes: Any
    color: str
    width: float = 1.8


_SOLID, _DASHED, _DOTTED = "-", (0, (5, 2)), (0, (1, 1.4))
_BLUE, _ORANGE, _BLACK, _RED = "#0072b2", "#d55e00", "#222222", "#a01040"
PLAIN = Style("", _SOLID, _BLUE)
MARGINAL = Style("marginal (an eigenvalue is zero)", (0, (6, 1.5, 1, 1.5)), _BLACK)
BOTH = Style("stable under both controls", _SOLID, _BLUE)
VOLUME_ONLY = Style("stable under volume control only", _DASHED, _ORANGE)
UNSTABLE = Style("unstable under both controls", _DOTTED, _BLACK, 2.2)
#: when one control alone was asked for
STABLE_UNDER = {c: Style(f"stable under {c} control", _SOLID, _BLUE) for c in ("pressure", "volume")}
UNSTABLE_UNDER = {c: Style(f"unstable under {c} control", _DOTTED, _BLACK, 2.2) for c in ("pressure", "volume")}

#: marker and name of each kind of special point
MARKERS = {
    "limit_point": ("o", "limit point (dP = 0)"),
    "volume_fold": ("s", "volume fold (dV = 0)"),
    "height_fold": ("^", "height fold"),
    "branch_point": ("D", "branch point"),
    "azimuthal_onset": ("v", "azimuthal onset"),
}


def plot_pressure_volume(branch: Branch, path: str | PathLike[str] | None = None) -> Figure:
    """Pressure against volume; line styles tell the verdicts that the scene asked for, markers the special points found.

    Where two neighbouring equilibria differ, the style changes at the special point between them, or half-way. A branch whose scene asks
    for no verdicts is one plain line.

    Parameters
    ----------
    branch : Branch
        With one or more equilibria.
    path : path, optional
        Picture to write; the suffix chooses the format.

    Raises
    ------
    InputError
        For an empty branch or a file that cannot be written.
    """
    _require_equilibria(branch)
    figure, axes = _figure((6.4, 4.6), branch.scene.title)
    axes.set_xlabel(VOLUME_LABEL)
    axes.set_ylabel(PRESSURE_LABEL)
    axes.grid(color="0.9", linewidth=0.6)
    points = np.array([[e.volume, e.pressure] for e in branch])
    special = np.array([[p.volume, p.pressure] for p in branch.special_points or ()]).reshape(-1, 2)
    breaks = _breaks(points, special)
    _draw_runs(axes, points, [_style(e) for e in branch], breaks)
    _draw_azimuthal(axes, branch, points, breaks)
    _draw_special_points(axes, branch)
    _legend(axes, branch)
    return _finish(figure, path)


def plot_profiles(branch: Branch, path: str | PathLike[str] | None = None, count: int = 6) -> Figure:
    """Deformed meridians of some equilibria, evenly spread along the branch, with the magnetic sources.

    Parameters
    ----------
    branch : Branch
        With one or more equilibria.
    path : path, optional
        Picture to write; the suffix chooses the format.
    count : int
        Number of meridians, first and last equilibrium included.

    Raises
    ------
    InputError
        For an empty branch, a count below 1, or a file that cannot be written.
    """
    _require_equilibria(branch)
    if count < 1:
        raise InputError("count", count, "a whole number >= 1 is allowed")
    shown = [branch[int(k)] for k in np.unique(np.linspace(len(branch) - 1, 0, count).round().astype(int))]
    figure, axes = _figure((6.4, 5.6), branch.scene.title)
    axes.set_xlabel("radius ρ/R₀")  # noqa: RUF001
    axes.set_ylabel("height η/R₀")
    axes.set_aspect("equal", adjustable="box")
    axes.locator_params(nbins=6)
    axes.axhline(0, color="0.8", linewidth=0.8, zorder=0)
    _draw_meridians(axes, shown)
    _draw_sources(axes, branch, shown)
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(handles[::-1], labels[::-1], loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False, fontsize=9)
    return _finish(figure, path)


# --- frames


def _require_equilibria(branch: Branch) -> None:
    if not len(branch):
        raise InputError("branch", "no equilibria", "a branch with one or more equilibria is needed")


def _figure(size: tuple[float, float], title: str) -> tuple[Figure, Axes]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set_title(title.replace("$", r"\$"), fontsize=11, wrap=True)
    axes.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _finish(figure: Figure, path: str | PathLike[str] | None) -> Figure:
    if path is not None:
        with replace_file(path) as temporary:
            figure.savefig(temporary, dpi=_DPI)
    return figure


def _legend(axes: Axes, branch: Branch) -> None:
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        heading = "among axisymmetric shapes:" if branch.scene.analysis.stability else None
        look: dict[str, Any] = {"fontsize": 9, "title_fontsize": 9, "framealpha": 0.9, "edgecolor": "none", "handlelength": 3.2}
        legend = axes.legend(handles, labels, title=heading, **look)
        legend.set_alignment("left")


# --- pressure against volume


def _style(equilibrium: Equilibrium) -> Style:
    """The class of an equilibrium under the controls that its scene asks for."""
    controls = equilibrium.scene.analysis.stability
    words = {c: verdict_text(equilibrium.verdict(c)) for c in controls}
    if not controls:
        return PLAIN
    if "marginal" in words.values():
        return MARGINAL
    if len(controls) == 1:
        return (STABLE_UNDER if words[controls[0]] == "stable" else UNSTABLE_UNDER)[controls[0]]
    return UNSTABLE if words["volume"] == "unstable" else BOTH if words["pressure"] == "stable" else VOLUME_ONLY


def _breaks(points: Array, special: Array) -> Array:
    """For each pair of neighbouring points the place between them where a style changes: a special point, or half-way.

    A special point lies between the two neighbours for which the way over it is the smallest detour, lengths taken in the picture; one
    that is far from the points shown (of another part of the branch) lies between none.
    """
    between = (points[1:] + points[:-1]) / 2
    if len(points) < 2:
        return between
    scale = np.maximum(np.ptp(points, axis=0), 1e-300)
    for place in special:
        a, b, p = points[:-1] / scale, points[1:] / scale, place / scale
        direct = np.linalg.norm(b - a, axis=1)
        detour = np.linalg.norm(p - a, axis=1) + np.linalg.norm(p - b, axis=1) - direct
        nearest = int(np.argmin(detour))
        if detour[nearest] < direct[nearest]:
            between[nearest] = place
    return between


def _runs(classes: Sequence[Any]) -> Iterator[tuple[int, int]]:
    """First and last index of each run of equal neighbours."""
    first = 0
    for k in range(1, len(classes) + 1):
        if k == len(classes) or classes[k] != classes[first]:
            yield first, k - 1
            first = k


def _stretch(points: Array, breaks: Array, first: int, last: int) -> Array:
    """The line through points first to last, prolonged to the places where its neighbours begin: no gap, no overlap."""
    before = breaks[first - 1 : first] if first > 0 else breaks[:0]
    after = breaks[last : last + 1]
    return np.concatenate([before, points[first : last + 1], after])


def _draw_runs(axes: Axes, points: Array, styles: Sequence[Style], breaks: Array) -> None:
    named: set[str] = set()
    for first, last in _runs(styles):
        style, line = styles[first], _stretch(points, breaks, first, last)
        label = style.label if style.label not in named else ""
        named.add(style.label)
        # the caps of neighbouring dashes may not run into each other
        look = {"linestyle": style.dashes, "color": style.color, "linewidth": style.width, "dash_capstyle": "butt"}
        axes.plot(*line.T, label=label or None, zorder=3, **look)
        # what was computed, as against the straight lines between
        computed = points[first : last + 1]
        if len(points) <= _DOTS:
            axes.plot(*computed.T, ".", color=style.color, markersize=6 if len(points) < 3 else 4, zorder=3)


def _draw_azimuthal(axes: Axes, branch: Branch, points: Array, breaks: Array) -> None:
    """A grey band behind the stretches that lose stability to an azimuthal mode."""
    modes = branch.scene.analysis.azimuthal_modes
    if not modes:
        return
    unstable = [tuple(n for n in modes if verdict_text(e.verdict(azimuthal=n)) == "unstable") for e in branch]
    named: set[tuple[int, ...]] = set()
    for first, last in _runs(unstable):
        lost = unstable[first]
        if lost:
            label = "unstable to azimuthal n = " + ", ".join(map(str, lost)) if lost not in named else None
            named.add(lost)
            axes.plot(*_stretch(points, breaks, first, last).T, color="0.82", linewidth=8, solid_capstyle="butt", zorder=1, label=label)


def _draw_special_points(axes: Axes, branch: Branch) -> None:
    points = branch.special_points or ()
    for kind in dict.fromkeys(str(p.kind) for p in points):
        marker, label = MARKERS.get(kind, ("X", kind.replace("_", " ")))
        places = np.array([[p.volume, p.pressure] for p in points if str(p.kind) == kind])
        look: dict[str, Any] = {"markersize": 7, "markerfacecolor": "white", "markeredgecolor": "black", "markeredgewidth": 1.2}
        axes.plot(*places.T, marker, label=label, zorder=4, **look)


# --- meridians


def _draw_meridians(axes: Axes, shown: Sequence[Equilibrium]) -> None:
    from matplotlib import colormaps

    # lightness falls along the map, so that neighbours differ in grey as well
    colors = colormaps["viridis"](np.linspace(0.85, 0.0, max(len(shown), 2)))
    for equilibrium, color in zip(shown, colors, strict=False):
        profile = smooth_profile(equilibrium, points=_CURVE)
        rho, eta = profile["rho"], profile["eta"]
        label = f"V = {equilibrium.volume:.4g},  P = {equilibrium.pressure:.4g}"
        axes.plot(np.concatenate([-rho[::-1], rho]), np.concatenate([eta[::-1], eta]), color=color, linewidth=1.8, label=label)
    axes.plot([-1, 1], [0, 0], "s", color="black", markersize=5, zorder=5)


def _draw_sources(axes: Axes, branch: Branch, shown: Sequence[Equilibrium]) -> None:
    """Sources on the axis as arrows along their moments; one further away than the picture is wide is named, not drawn."""
    eta = np.concatenate([e.profile()["eta"] for e in shown])
    rho = max(float(np.max(e.profile()["rho"])) for e in shown)
    extent = max(float(np.ptp(eta)), 2 * rho)
    for source in branch.scene.sources:
        height = getattr(source, "height", None)
        if height is None:
            continue
        name, up = type(source).__name__.lower(), getattr(source, "orientation", 1)
        if min(abs(height - eta.min()), abs(height - eta.max())) > 1.5 * extent:
            axes.plot([], [], " ", label=f"({name} at height {height:g})")
            continue
        tail, tip = height - 0.08 * up * extent, height + 0.08 * up * extent
        arrow = {"arrowstyle": "-|>", "color": _RED, "linewidth": 2.0, "mutation_scale": 14}
        axes.annotate("", xy=(0, tip), xytext=(0, tail), arrowprops=arrow)
        axes.plot([0], [height], "o", color=_RED, markersize=6, label=f"{name} at height {height:g}")
        axes.update_datalim([(0, tail), (0, tip)])
