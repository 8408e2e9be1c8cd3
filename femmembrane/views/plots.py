"""Plots of a branch: pressure against volume with its verdicts, deformed meridians, and wrinkling zones.

``plot_...`` make a whole figure; ``draw_...`` draw onto given axes, for figures of one's own. Figures are made without pyplot, so that
nothing global changes and no window opens. Line style and marker shape carry all that colour does: the figures read the same in grey.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, Status, unknown_name
from ..files import replace_file
from ..results.quantities import PLACES, QUANTITIES
from .backend import drawing, load, title_text
from .surroundings import Box, clamped_ends, surroundings
from .vtk import smooth_profile
from .zones import BRANCH_WIDTH, PATTERNS, draw_along, draw_meridian_zones, fill_zones, new_label, shown_kinds, zone_label, zone_order

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..results.records import Branch, Equilibrium, SpecialPoint

Array = NDArray[np.float64]

VOLUME_LABEL, PRESSURE_LABEL, HEIGHT_LABEL, RADIUS_LABEL = (QUANTITIES[name].label for name in (*PLACES, "rho"))
_DPI = 160
#: branches of up to so many equilibria show them as dots
_DOTS = 40
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
#: compressed or slack along the meridian: what a mesh finds there depends on the mesh, stable or not
ILL_POSED = Style("ill-posed (compressed or slack)", _DOTTED, "#888888", 1.2)
#: when one control alone was asked for
STABLE_UNDER = {c: Style(f"stable under {c} control", _SOLID, _BLUE) for c in ("pressure", "volume")}
UNSTABLE_UNDER = {c: Style(f"unstable under {c} control", _DOTTED, _BLACK, 2.2) for c in ("pressure", "volume")}

#: the order of the lines in a legend
_ORDER = [s.label for s in (BOTH, *STABLE_UNDER.values(), VOLUME_ONLY, *UNSTABLE_UNDER.values(), UNSTABLE, MARGINAL, ILL_POSED)]
_ILL_POSED = "ill-posed"

#: marker and name of each kind of special point
MARKERS = {
    "limit_point": ("o", "limit point (dP = 0)"),
    "volume_fold": ("s", "volume fold (dV = 0)"),
    "height_fold": ("^", "height fold"),
    "number_fold": ("h", "limit point in the number"),
    "branch_point": ("D", "branch point"),
    "azimuthal_onset": ("v", "azimuthal onset"),
}


def plot_pressure_volume(branch: Branch, path: str | PathLike[str] | None = None) -> Figure:
    """Pressure against volume, or over a number what answers to it.

    Line styles tell the verdicts that the scene asked for, markers the special points found.

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
    figure, axes = new_figure((6.4, 4.6), title=branch.scene.title)
    draw_branch(axes, branch, across=branch.over or "volume", up=answer(branch))
    draw_legend(axes, "among axisymmetric shapes:" if branch.scene.analysis.stability else None)
    return save_figure(figure, path)


def plot_profiles(branch: Branch, path: str | PathLike[str] | None = None, count: int = 6, *, zones: bool | None = None) -> Figure:
    """Deformed meridians of some equilibria, evenly spread along the branch, with the magnetic sources.

    Parameters
    ----------
    branch : Branch
        With one or more equilibria.
    path : path, optional
        Picture to write; the suffix chooses the format.
    count : int
        Number of meridians, first and last equilibrium included.
    zones : bool, optional
        Mark the wrinkled parts; by default when the scene asks for wrinkling.

    Raises
    ------
    InputError
        For an empty branch, a count below 1, or a file that cannot be written.
    """
    _require_equilibria(branch)
    if count < 1:
        raise InputError("count", count, "a whole number >= 1 is allowed")
    shown = [branch[int(k)] for k in np.unique(np.linspace(len(branch) - 1, 0, min(count, len(branch))).round().astype(int))]
    figure, axes = new_figure((6.4, 5.6), title=branch.scene.title)
    from matplotlib import colormaps

    # lightness falls along the map, so that neighbours differ in grey as well
    colors = colormaps["viridis"](np.linspace(0.85, 0.0, max(len(shown), 2)))
    for equilibrium, color in zip(shown, colors, strict=False):
        label = f"V = {equilibrium.volume:.4g},  P = {equilibrium.pressure:.4g}"
        draw_profile(axes, equilibrium, Style(label, _SOLID, color), zones=zones)
    draw_surroundings(axes, shown)
    axes.set_anchor("W")  # the legend stands on the right
    handles, labels = legend_entries(axes)
    look: dict[str, Any] = {"bbox_to_anchor": (1.01, 0.5), "frameon": False, "fontsize": 9, "handlelength": 3.2}
    axes.legend(handles[::-1], labels[::-1], loc="center left", **look)
    return save_figure(figure, path)


def plot_zones(branch: Branch, path: str | PathLike[str] | None = None) -> Figure:
    """Taut and wrinkled zones: reference radius (of a curved meridian: arc length) against volume, or the step where that is not monotone.

    Parameters
    ----------
    branch : Branch
        With one or more equilibria; the criterion is its scene's ("total" if that asks for none).
    path : path, optional
        Picture to write; the suffix chooses the format.

    Raises
    ------
    InputError
        For an empty branch or a file that cannot be written.
    """
    _require_equilibria(branch)
    figure, axes = new_figure((6.4, 4.2), title=branch.scene.title)
    handles = draw_zones(axes, branch)
    figure.legend(handles=handles, loc="outside lower left", ncols=2, frameon=False, fontsize=9, handlelength=3.0, handleheight=1.8)
    return save_figure(figure, path)


def draw_zones(axes: Axes, branch: Branch) -> list[Any]:
    """The zones of a branch on labelled axes, as in :func:`plot_zones`; handles for a legend."""
    volume = np.array([equilibrium.volume for equilibrium in branch])
    steps = np.diff(volume)
    monotone = steps.size > 0 and bool((steps > 0).all() or (steps < 0).all())
    handles = fill_zones(axes, branch, volume if monotone else np.arange(volume.size, dtype=float))
    axes.set_xlabel(VOLUME_LABEL if monotone else "step")
    flat = "s" not in branch[0].profile()
    axes.set_ylabel("reference radius r/R₀" if flat else "arc length of the reference meridian s/R₀")
    axes.margins(0)
    return list(handles)


# --- frames


def new_figure(size: tuple[float, float], *, title: str = "", widths: Sequence[float] = (1.0,)) -> tuple[Figure, Any]:
    """A figure of a size in inches with one axes, or a row of several of the given relative widths.

    Returns
    -------
    figure : Figure
    axes : Axes, or array of Axes
    """
    load()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    row = figure.subplots(1, len(widths), width_ratios=list(widths), squeeze=False)[0]
    for axes in row:
        axes.spines[["top", "right"]].set_visible(False)
    look: dict[str, Any] = {"fontsize": 11, "wrap": True, "parse_math": False}
    if len(widths) > 1:
        figure.suptitle(title_text(title) or title, **look)  # a blank one leaves room
        return figure, row
    row[0].set_title(title_text(title), **look)
    return figure, row[0]


def save_figure(figure: Figure, path: str | PathLike[str] | None) -> Figure:
    """Write a figure (nothing for None) whole or not at all, and return it; the suffix must be a format that Matplotlib writes."""
    if path is not None:
        formats = figure.canvas.get_supported_filetypes()
        if Path(path).suffix[1:].lower() not in formats:
            raise InputError(
                "path", str(path), "a name that ends in one of these is needed: " + ", ".join(f".{f}" for f in sorted(formats))
            )
        with replace_file(path) as temporary, drawing():
            figure.savefig(temporary, dpi=_DPI)
    return figure


def draw_legend(axes: Axes, heading: str | None = None, **look: Any) -> None:
    """A legend of what is named, if anything is; ``look`` goes to Matplotlib's ``legend``."""
    handles, labels = legend_entries(axes)
    if handles:
        usual: dict[str, Any] = {"fontsize": 9, "title_fontsize": 9, "framealpha": 0.9, "edgecolor": "none", "handlelength": 3.2}
        legend = axes.legend(handles, labels, title=heading, **(usual | look))
        legend.set_alignment("left")


def legend_entries(axes: Axes) -> tuple[list[Any], list[str]]:
    """Handles and labels of what is named, the verdicts first, then wrinkles, and these always in the same order."""
    named = list(zip(*axes.get_legend_handles_labels(), strict=True))
    named.sort(key=lambda item: _ORDER.index(item[1]) if item[1] in _ORDER else len(_ORDER) + zone_order(item[1]))
    return [handle for handle, _ in named], [label for _, label in named]


def _require_equilibria(branch: Branch) -> None:
    if not len(branch):
        raise InputError("branch", "no equilibria", "a branch with one or more equilibria is needed")


# --- a branch


def draw_branch(
    axes: Axes,
    branch: Branch,
    *,
    across: str = "volume",
    up: str = "pressure",
    style: Style | None = None,
    dots: bool | None = None,
    special_points: bool = True,
) -> None:
    """One quantity of a branch against another: verdicts as line styles, special points as markers, snaps as arrows.

    A style changes at the special point where the verdict does, or half-way between two equilibria. A branch whose scene asks for no
    verdicts is one plain line. Stretches that are unstable to an azimuthal mode have a grey band behind them; if the scene asks for
    wrinkling, bands with patterned edges say which wrinkles the membrane has anywhere. A cross marks the end of a branch that
    could not be followed as far as was asked.

    Parameters
    ----------
    axes : matplotlib Axes
    branch : Branch
    across, up : {"volume", "pressure", "center_height"}
        What the axes show; of a branch over a number also that, by its name.
    style : Style, optional
        One style for the whole line, in place of the verdicts'.
    dots : bool, optional
        Show each equilibrium as a dot; by default when there are few.
    special_points : bool
        Mark the special points.

    Raises
    ------
    InputError
        For an unknown quantity.
    """
    for key, name in (("across", across), ("up", up)):
        if name not in (*PLACES, branch.over):
            raise unknown_name(key, name, [*PLACES, *([branch.over] if branch.over else [])])
    axes.set_xlabel(axis_label(across))
    axes.set_ylabel(axis_label(up))
    axes.grid(color="0.9", linewidth=0.6)
    points = _coordinates(branch, (across, up))
    gaps = _gaps(branch, (across, up))
    controls = () if style else branch.scene.analysis.stability
    words = _words(branch, controls)
    drawn = style or PLAIN
    _draw_lines(axes, _segments(points, words, gaps), (lambda w: drawn) if style else _style)
    if dots or (dots is None and len(points) <= _DOTS):
        for point, word in zip(points, words, strict=True):
            axes.plot(*point, ".", color=(style or _style(word)).color, markersize=6 if len(points) < 3 else 4, zorder=3)
    if not style:
        _draw_azimuthal(axes, branch, points, gaps)
        if branch.scene.analysis.wrinkling:
            _draw_wrinkling(axes, branch, points, gaps)
    _draw_jumps(axes, branch, (across, up))
    if special_points:
        _draw_special_points(axes, branch, (across, up))
    if branch.status is not Status.CONVERGED and len(points):
        axes.plot(*points[-1], "X", color=_RED, markeredgecolor="white", markersize=10, zorder=5, label=f"ends here: {branch.status}")


def _words(branch: Branch, controls: Sequence[str]) -> list[dict[Any, str]]:
    """The verdicts of each equilibrium under the controls asked for."""
    words: list[dict[Any, str]] = [{c: _ILL_POSED if e.status.ill_posed else e.verdict(c).word for c in controls} for e in branch]
    if branch.status.ill_posed:  # a cross marks that one
        words[-1] = words[max(len(words) - 2, 0)]
    return words


def verdict_style(equilibrium: Equilibrium, controls: Sequence[str] = ("pressure", "volume")) -> Style:
    """How an equilibrium is drawn for its verdicts under some controls."""
    return _style({c: equilibrium.verdict(c).word for c in controls})


def _style(words: Mapping[str, str]) -> Style:
    """The style of a class of equilibria: the verdict under each control asked for."""
    if not words:
        return PLAIN
    if _ILL_POSED in words.values():
        return ILL_POSED
    if "marginal" in words.values():
        return MARGINAL
    if len(words) == 1:
        ((control, word),) = words.items()
        return (STABLE_UNDER if word == "stable" else UNSTABLE_UNDER)[control]
    return UNSTABLE if words["volume"] == "unstable" else BOTH if words["pressure"] == "stable" else VOLUME_ONLY


def answer(branch: Branch) -> str:
    """The quantity that a branch is drawn by: the pressure, or the height of the pole where a pressure is held."""
    return "center_height" if "pressure" in branch.hold else "pressure"


def axis_label(name: str) -> str:
    """The text at an axis that shows a quantity, or a number of the scene."""
    return QUANTITIES[name].label if name in QUANTITIES else name


def _coordinates(items: Sequence[Equilibrium | SpecialPoint], quantities: Sequence[str]) -> Array:
    return np.array([[_value(item, q) for q in quantities] for item in items], dtype=float).reshape(-1, len(quantities))


def _value(item: Equilibrium | SpecialPoint, quantity: str) -> float:
    if "." in quantity:
        equilibrium: Equilibrium = getattr(item, "equilibrium", item)
        return equilibrium.number(quantity)
    return float(getattr(item, quantity))


#: the special points between two neighbouring equilibria, in order: the verdicts that can change there (None: any) and their places in
#: the picture; a snap is the last
_Gap = list[tuple[tuple[Any, ...] | None, Array]]
_SNAP = ("snap",)


def _changes(branch: Branch, point: SpecialPoint) -> tuple[Any, ...] | None:
    """The verdicts that can change at a special point, by control or number of waves. Over a number what is held decides."""
    of_kind: dict[str, tuple[Any, ...]] = {
        "limit_point": () if branch.over else ("pressure",),
        "volume_fold": () if branch.over else ("volume",),
        "height_fold": (),
        "number_fold": tuple(branch.hold),
        "azimuthal_onset": (point.azimuthal,),
    }
    return of_kind.get(str(point.kind))


def _gaps(branch: Branch, quantities: Sequence[str]) -> list[_Gap]:
    """What lies between each pair of neighbours.

    A special point lies between the two neighbours for which the way over it is the smallest detour, in volume, pressure and pole height
    together (in a picture of two of them the branch may cross itself); one that is far from the points shown lies between none.
    """
    known = (*PLACES, branch.over) if branch.over else PLACES
    points, special = _coordinates(branch, known), list(branch.special_points or ())
    scale = np.maximum(np.ptp(points, axis=0), 1e-300) if len(points) else 1.0
    a, b = points[:-1] / scale, points[1:] / scale
    direct = np.linalg.norm(b - a, axis=1)
    inside: list[list[tuple[float, SpecialPoint, Array]]] = [[] for _ in direct]
    places, pictured = _coordinates(special, known) / scale, _coordinates(special, quantities)
    for item, place, drawn in zip(special, places, pictured, strict=True):
        detour = np.linalg.norm(place - a, axis=1) + np.linalg.norm(place - b, axis=1) - direct
        if detour.size and detour[k := int(np.argmin(detour))] < direct[k]:
            inside[k].append((float((place - a[k]) @ (b[k] - a[k])), item, drawn))
    ordered: list[_Gap] = [[(_changes(branch, item), drawn) for _, item, drawn in sorted(gap, key=lambda g: g[0])] for gap in inside]
    for jump in branch.jumps:
        for k, (before, landing) in enumerate(pairwise(branch)):
            if landing is jump.landing:  # by way of the fold where the branch turned back
                ordered[k] = [(_SNAP, _coordinates([jump.limit or before], quantities)[0])]
    return ordered


@dataclass(frozen=True, eq=False)
class _Segment:
    """A straight piece of the drawn line, and the verdicts along it."""

    a: Array
    b: Array
    words: dict[Any, str]


def _segments(points: Array, words: Sequence[dict[Any, str]], gaps: Sequence[_Gap]) -> list[_Segment | None]:
    """The pieces of the line, through the special points; None where the membrane snaps."""
    pieces: list[_Segment | None] = []
    for k, gap in enumerate(gaps):
        at, now, after, end = points[k], words[k], words[k + 1], points[k + 1]
        for changes, place in gap:
            pieces.append(_Segment(at, place, now))
            at, now = place, {c: after[c] if changes is None or c in changes else word for c, word in now.items()}
        if gap and gap[-1][0] is _SNAP:
            pieces.append(None)
            continue
        if now != after:  # somewhere here
            pieces.append(_Segment(at, (at + end) / 2, now))
            at = (at + end) / 2
        pieces.append(_Segment(at, end, after))
    return pieces


def _lines(pieces: Sequence[_Segment | None], classify: Callable[[dict[Any, str]], Any]) -> Iterator[tuple[Any, Array]]:
    """The pieces of one class that follow each other, as lines: no gap, no overlap."""
    kind: Any = None
    line: list[Array] = []
    for piece in [*pieces, None]:
        new = None if piece is None else classify(piece.words)
        if line and (piece is None or new != kind):
            yield kind, np.array(line)
            line = []
        if piece is not None:
            line = [*(line or [piece.a]), piece.b]
        kind = new


def _draw_lines(axes: Axes, pieces: Sequence[_Segment | None], classify: Callable[[dict[Any, str]], Style]) -> None:
    for style, line in _lines(pieces, classify):
        # the caps of neighbouring dashes may not run into each other
        look = {"linestyle": style.dashes, "color": style.color, "linewidth": style.width, "dash_capstyle": "butt"}
        axes.plot(*line.T, label=new_label(axes, style.label), zorder=3, **look)


def _draw_azimuthal(axes: Axes, branch: Branch, points: Array, gaps: Sequence[_Gap]) -> None:
    """A grey band behind the stretches that lose stability to azimuthal modes, darker for more of them, and for shorter waves."""
    words: list[dict[Any, str]] = [{n: e.verdict(azimuthal=n).word for n in branch.scene.analysis.azimuthal_modes} for e in branch]
    lines = list(_lines(_segments(points, words, gaps), lambda w: tuple(n for n, word in w.items() if word == "unstable")))
    order = sorted({lost for lost, _ in lines if lost}, key=lambda lost: (len(lost), lost))
    for lost, line in lines:
        if lost:
            label = new_label(axes, "unstable to azimuthal n = " + ", ".join(map(str, lost)))
            grey = str(max(0.84 - 0.14 * order.index(lost), 0.4))
            axes.plot(*line.T, color=grey, linewidth=8, solid_capstyle="butt", zorder=1, label=label)


def _draw_wrinkling(axes: Axes, branch: Branch, points: Array, gaps: Sequence[_Gap]) -> None:
    """Patterns behind the stretches on which the membrane is wrinkled somewhere."""
    words: list[dict[Any, str]] = [{kind: kind * (kind in shown_kinds(e.zones())) for kind in PATTERNS} for e in branch]
    for kinds, line in _lines(_segments(points, words, gaps), lambda w: tuple(filter(None, w.values()))):
        for kind in kinds:
            draw_along(axes, line, kind, zone_label(branch.scene, kind), BRANCH_WIDTH)


def _draw_jumps(axes: Axes, branch: Branch, quantities: Sequence[str]) -> None:
    """An arrow for each snap, from the fold where the branch turned back, or from the equilibrium before."""
    before = {id(landing): previous for previous, landing in pairwise(branch)}
    arrow = {"arrowstyle": "-|>", "color": _RED, "linewidth": 1.6, "mutation_scale": 15, "shrinkA": 0, "shrinkB": 0}
    for jump in branch.jumps:
        if id(jump.landing) in before:
            tail, tip = _coordinates([jump.limit or before[id(jump.landing)], jump.landing], quantities)
            axes.annotate("", xy=tip, xytext=tail, arrowprops=arrow, zorder=4)
            axes.plot([], [], color=_RED, linewidth=1.6, label=new_label(axes, "snap"))


def _draw_special_points(axes: Axes, branch: Branch, quantities: Sequence[str]) -> None:
    points = [*(branch.special_points or ()), *(jump.limit for jump in branch.jumps if jump.limit)]
    for kind in dict.fromkeys(str(p.kind) for p in points):
        marker, label = MARKERS.get(kind, ("X", kind.replace("_", " ")))
        places = _coordinates([p for p in points if str(p.kind) == kind], quantities)
        look: dict[str, Any] = {"markersize": 7, "markerfacecolor": "white", "markeredgecolor": "black", "markeredgewidth": 1.2}
        axes.plot(*places.T, marker, label=new_label(axes, label), zorder=4, **look)
    for point, place in zip(points, _coordinates(points, quantities), strict=True):
        if point.azimuthal:
            axes.annotate(f"n = {point.azimuthal}", place, xytext=(5, 4), textcoords="offset points", fontsize=8, zorder=5)


# --- meridians


def draw_profile(axes: Axes, equilibrium: Equilibrium, style: Style, *, zones: bool | None = None) -> None:
    """The deformed meridian, both halves, and rigid hubs, under the style's label.

    With the wrinkled zones, by default when the scene asks for them.
    """
    if equilibrium.scene.analysis.wrinkling if zones is None else zones:
        draw_meridian_zones(axes, equilibrium)
    profile = smooth_profile(equilibrium, points=_CURVE)
    rho, eta = profile["rho"], profile["eta"]
    look = {"linestyle": style.dashes, "color": style.color, "linewidth": style.width, "dash_capstyle": "butt"}
    cut = [np.nan] if rho[0] > 0 else []  # the halves meet on the axis only
    axes.plot(np.concatenate([-rho[::-1], cut, rho]), np.concatenate([eta[::-1], cut, eta]), label=style.label or None, **look)
    for k in equilibrium.potential.space.hubs:
        axes.plot([-rho[k], rho[k]], [eta[k], eta[k]], color=style.color, linewidth=3 * style.width, solid_capstyle="butt", alpha=0.5)


def draw_surroundings(axes: Axes, shown: Sequence[Equilibrium]) -> None:
    """What drawn meridians stand in: labelled axes of equal scale, the clamped ends, and the magnetic sources of their scene."""
    axes.set_xlabel(RADIUS_LABEL)
    axes.set_ylabel("height η/R₀")
    axes.set_aspect("equal", adjustable="box")
    axes.locator_params(nbins=6)
    for _, rho, eta in clamped_ends(shown[0]):
        axes.axhline(eta, color="0.8", linewidth=0.8, zorder=0)
        axes.plot([-rho, rho], [eta, eta], "s", color="black", markersize=5, zorder=5)
    _draw_sources(axes, shown)


def _draw_sources(axes: Axes, shown: Sequence[Equilibrium]) -> None:
    """Bodies of sources, with an arrow along the moment; one that is not drawn is named."""
    box = Box.of([e.profile() for e in shown])
    around = surroundings(shown[0].scene, box)
    for body in around.near:
        rho, z = np.array(body.points).T
        middle = float(z.mean())
        if body.moment:
            tail, tip = (middle + sign * 0.11 * body.moment * box.size for sign in (-1, 1))
            arrow = {"arrowstyle": "-|>", "color": _RED, "linewidth": 2.0, "mutation_scale": 14}
            axes.annotate("", xy=(0, tip), xytext=(0, tail), arrowprops=arrow)
            axes.update_datalim([(0, tail), (0, tip)])
        look: dict[str, Any] = {"color": _RED, "linewidth": 2.5, **({"marker": "o", "markersize": 6} if rho.size == 1 else {})}
        for side in (1, -1) if rho.any() else (1,):
            axes.plot(side * rho, z, label=body.label if side > 0 else None, **look)
    for name in around.absent:
        axes.plot([], [], " ", label=f"({name})")
