"""A branch as a line: its verdicts as line styles, special points as markers, snaps as arrows, bands for waves and wrinkles."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import Status, unknown_name
from ..quantities import PLACES, Units, axis_label, key_label
from ..results.special_point import SpecialPoint
from .figures import ILL_POSED_WORD, PLAIN, RED, Style, style_of
from .zones import BRANCH_WIDTH, PATTERNS, draw_along, new_label, shown_kinds, zone_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results.branch import Branch
    from ..results.equilibrium import Equilibrium

Array = NDArray[np.float64]

#: branches of up to so many equilibria show them as dots
_DOTS = 40
#: marker and name of each kind of special point
MARKERS = {
    "limit_point": ("o", "limit point (dP = 0)"),
    "volume_fold": ("s", "volume fold (dV = 0)"),
    "height_fold": ("^", "height fold"),
    "number_fold": ("h", "limit point in the number"),
    "branch_point": ("D", "branch point"),
    "azimuthal_onset": ("v", "azimuthal onset"),
}


def draw_branch(
    axes: Axes,
    branch: Branch,
    *,
    across: str = "volume",
    up: str = "pressure",
    units: str = "scaled",
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
    units : {"scaled", "si"}
        In units of the package, or in SI units such as ml and kPa, by the scales of the scene; numbers on the axes are those of the label.
    style : Style, optional
        One style for the whole line, in place of the verdicts'.
    dots : bool, optional
        Show each equilibrium as a dot; by default when there are few.
    special_points : bool
        Mark the special points.

    Raises
    ------
    InputError
        For an unknown quantity or word, and for SI units of a scene without scales.
    """
    for key, name in (("across", across), ("up", up)):
        if name not in (*PLACES, branch.over):
            raise unknown_name(key, name, [*PLACES, *([branch.over] if branch.over else [])])
    of_scene = Units.of(units, branch.scene.scales)
    axes.set_xlabel(_label(across, of_scene))
    axes.set_ylabel(_label(up, of_scene))
    shown = _Shown((across, up), np.array([_factor(across, of_scene), _factor(up, of_scene)]))
    axes.grid(color="0.9", linewidth=0.6)
    points = shown.at(branch)
    gaps = _gaps(branch, shown)
    controls = () if style else branch.scene.analysis.stability
    words = _words(branch, controls)
    drawn = style or PLAIN
    _draw_lines(axes, _segments(points, words, gaps), (lambda w: drawn) if style else style_of)
    if dots or (dots is None and len(points) <= _DOTS):
        for point, word in zip(points, words, strict=True):
            axes.plot(*point, ".", color=(style or style_of(word)).color, markersize=6 if len(points) < 3 else 4, zorder=3)
    if not style:
        _draw_azimuthal(axes, branch, points, gaps)
        if branch.scene.analysis.wrinkling:
            _draw_wrinkling(axes, branch, points, gaps)
    _draw_jumps(axes, branch, shown)
    if special_points:
        _draw_special_points(axes, branch, shown)
    if branch.status is not Status.CONVERGED and len(points):
        axes.plot(*points[-1], "X", color=RED, markeredgecolor="white", markersize=10, zorder=5, label=f"ends here: {branch.status}")


@dataclass(frozen=True, eq=False)
class _Shown:
    """What the axes show: two quantities, each times a factor."""

    quantities: tuple[str, str]
    factors: Array

    def at(self, items: Sequence[Equilibrium | SpecialPoint]) -> Array:
        """Places in the picture."""
        return _coordinates(items, self.quantities) * self.factors


def _words(branch: Branch, controls: Sequence[str]) -> list[dict[Any, str]]:
    """The verdicts of each equilibrium under the controls asked for."""
    words: list[dict[Any, str]] = [{c: ILL_POSED_WORD if e.status.ill_posed else e.verdict(c).word for c in controls} for e in branch]
    if branch.status.ill_posed:  # a cross marks that one
        words[-1] = words[max(len(words) - 2, 0)]
    return words


def answer(branch: Branch) -> str:
    """The quantity that a branch is drawn by: the pressure, or the height of the pole where a pressure is held."""
    return "center_height" if "pressure" in branch.hold else "pressure"


def _coordinates(items: Sequence[Equilibrium | SpecialPoint], quantities: Sequence[str]) -> Array:
    return np.array([[_value(item, q) for q in quantities] for item in items], dtype=float).reshape(-1, len(quantities))


def _value(item: Equilibrium | SpecialPoint, quantity: str) -> float:
    if "." not in quantity:
        return float(getattr(item, quantity))
    return (item.equilibrium if isinstance(item, SpecialPoint) else item).number(quantity)


def _label(name: str, units: Units) -> str:
    """The text at an axis that shows a quantity, or a number of the scene, which is shown as the scene has it."""
    return key_label(name) if "." in name else axis_label(name, units)


def _factor(name: str, units: Units) -> float:
    """What a quantity is multiplied by in these units; a number of the scene stays as it is."""
    return 1.0 if "." in name else units.factor(name)


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


def _gaps(branch: Branch, shown: _Shown) -> list[_Gap]:
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
    places, pictured = _coordinates(special, known) / scale, shown.at(special)
    for item, place, drawn in zip(special, places, pictured, strict=True):
        detour = np.linalg.norm(place - a, axis=1) + np.linalg.norm(place - b, axis=1) - direct
        if detour.size and detour[k := int(np.argmin(detour))] < direct[k]:
            inside[k].append((float((place - a[k]) @ (b[k] - a[k])), item, drawn))
    ordered: list[_Gap] = [[(_changes(branch, item), drawn) for _, item, drawn in sorted(gap, key=lambda g: g[0])] for gap in inside]
    for jump in branch.jumps:
        for k, (before, landing) in enumerate(pairwise(branch)):
            if landing is jump.landing:  # by way of the fold where the branch turned back
                ordered[k] = [(_SNAP, shown.at([jump.limit or before])[0])]
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
            named = new_label(axes, "unstable to azimuthal n = " + ", ".join(map(str, lost)))
            grey = str(max(0.84 - 0.14 * order.index(lost), 0.4))
            axes.plot(*line.T, color=grey, linewidth=8, solid_capstyle="butt", zorder=1, label=named)


def _draw_wrinkling(axes: Axes, branch: Branch, points: Array, gaps: Sequence[_Gap]) -> None:
    """Patterns behind the stretches on which the membrane is wrinkled somewhere."""
    words: list[dict[Any, str]] = [{kind: kind * (kind in shown_kinds(e.zones())) for kind in PATTERNS} for e in branch]
    for kinds, line in _lines(_segments(points, words, gaps), lambda w: tuple(filter(None, w.values()))):
        for kind in kinds:
            draw_along(axes, line, kind, zone_label(branch.scene, kind), BRANCH_WIDTH)


def _draw_jumps(axes: Axes, branch: Branch, shown: _Shown) -> None:
    """An arrow for each snap, from the fold where the branch turned back, or from the equilibrium before."""
    before = {id(landing): previous for previous, landing in pairwise(branch)}
    arrow = {"arrowstyle": "-|>", "color": RED, "linewidth": 1.6, "mutation_scale": 15, "shrinkA": 0, "shrinkB": 0}
    for jump in branch.jumps:
        if id(jump.landing) in before:
            tail, tip = shown.at([jump.limit or before[id(jump.landing)], jump.landing])
            axes.annotate("", xy=tip, xytext=tail, arrowprops=arrow, zorder=4)
            axes.plot([], [], color=RED, linewidth=1.6, label=new_label(axes, "snap"))


def _draw_special_points(axes: Axes, branch: Branch, shown: _Shown) -> None:
    points = [*(branch.special_points or ()), *(jump.limit for jump in branch.jumps if jump.limit)]
    for kind in dict.fromkeys(str(p.kind) for p in points):
        marker, named = MARKERS.get(kind, ("X", kind.replace("_", " ")))
        places = shown.at([p for p in points if str(p.kind) == kind])
        look: dict[str, Any] = {"markersize": 7, "markerfacecolor": "white", "markeredgecolor": "black", "markeredgewidth": 1.2}
        axes.plot(*places.T, marker, label=new_label(axes, named), zorder=4, **look)
    for point, place in zip(points, shown.at(points), strict=True):
        if point.azimuthal:
            axes.annotate(f"n = {point.azimuthal}", place, xytext=(5, 4), textcoords="offset points", fontsize=8, zorder=5)
