"""A branch as a line: its verdicts as line styles, special points as markers, snaps as arrows, bands for waves and wrinkles."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import Status
from ..quantities import PLACES, Units, axis_label
from ..results.curve import half_way, turning
from ..results.postbuckling import SUBCRITICAL, UNKNOWN
from ..results.special_point import SpecialPoint
from ..scene import ALL
from ..scene.number_units import shown_number
from .figures import AMONG, COLORS, ILL_POSED_WORD, RED, UNRESOLVED, UNTESTED, Style, style_of
from .labels import add_label
from .zones import BRANCH_WIDTH, PATTERNS, draw_along, new_label, shown_kinds, zone_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results.branch import Branch
    from ..results.curve import Piece, Snap
    from ..results.equilibrium import Equilibrium

Array = NDArray[np.float64]

#: branches of up to so many equilibria show them as dots
_DOTS = 40
#: what tells the entry of a branch in a legend from other lines
_BRANCH = "femmembrane branch"
#: marker and name of each kind of special point
MARKERS = {
    "limit_point": ("o", "limit point (dP = 0)"),
    "volume_fold": ("s", "volume fold (dV = 0)"),
    "height_fold": ("^", "height fold"),
    "number_fold": ("h", "limit point in the number"),
    "branch_point": ("D", "branch point"),
    "azimuthal_onset": ("v", "azimuthal onset"),
    "touch": (">", "first touch of a body"),
    "release": ("<", "last touch of a body"),
    "zone_opens": ("P", "a zone opens"),
    "zone_closes": ("X", "a zone closes"),
}


def draw_branch(
    axes: Axes,
    branch: Branch,
    *,
    across: str = "volume",
    up: str = "pressure",
    units: str = "scaled",
    style: Style | None = None,
    label: str | None = None,
    dots: bool | None = None,
    special_points: bool = True,
) -> None:
    """One quantity of a branch against another: verdicts as line styles, special points as markers, snaps as arrows.

    The line goes through all equilibria and special points along the :attr:`.Branch.curve`. A style changes at the special point where the
    verdict does, or half-way between two equilibria. A branch whose scene asks for no verdicts is one grey line, named not tested.
    Stretches that are unstable to an azimuthal mode have a grey band behind them; if the scene asks for wrinkling, bands with patterned
    edges say which wrinkles the membrane has anywhere. A cross marks the end of a branch that could not be followed as far as was asked.

    Parameters
    ----------
    axes : matplotlib Axes
    branch : Branch
    across, up : str
        What the axes show: volume, pressure, center_height, any column of the branch that is a number, or a number of the scene by its
        name.
    units : {"scaled", "si"}
        In units of the package, or in SI units such as ml and kPa, by the scales of the scene; numbers on the axes are those of the label.
    style : Style, optional
        One style for the whole line, in place of the verdicts'.
    label : str, optional
        Name of the branch among several. It then has the next of :data:`.figures.COLORS`, and dashes tell the verdicts.
    dots : bool, optional
        Show each equilibrium as a dot; by default when there are few.
    special_points : bool
        Mark the special points.

    Raises
    ------
    InputError
        For an unknown quantity or word, and for SI units of a scene without scales.
    """
    of_scene = Units.of(units, branch.scene.converter)
    shown = _Shown(branch, (across, up), of_scene)
    axes.set_xlabel(_label(branch, across, of_scene))
    axes.set_ylabel(_label(branch, up, of_scene))
    axes.grid(color="0.9", linewidth=0.6)
    points = shown.at(branch)
    controls = () if style else branch.scene.analysis.stability
    words = _words(branch, controls)
    color = None if label is None else _named(axes, label, AMONG if controls else None)
    _draw_lines(axes, _segments(shown, words), (lambda w: style) if style else style_of, color)
    if dots or (dots is None and len(points) <= _DOTS):
        for point, word in zip(points, words, strict=True):
            axes.plot(*point, ".", color=color or (style or style_of(word)).color, markersize=6 if len(points) < 3 else 4, zorder=3)
    if not style:
        _draw_azimuthal(axes, branch, shown)
        if branch.scene.analysis.wrinkling:
            _draw_wrinkling(axes, branch, shown)
    _draw_jumps(axes, shown)
    if special_points:
        _draw_special_points(axes, branch, shown)
    if branch.status is not Status.CONVERGED and len(points):
        axes.plot(*points[-1], "X", color=RED, markeredgecolor="white", markersize=10, zorder=5, label=f"ends here: {branch.status}")


@dataclass(frozen=True, eq=False)
class Strands:
    """All that a picture shows of a branch in several quantities at once, of which a reader chooses two.

    Attributes
    ----------
    lines : list of (Style, ndarray of shape (n, number of quantities))
        The curve with the styles of its verdicts.
    bands : list of (tuple of int, ndarray)
        Stretches that are unstable to azimuthal modes, with their numbers of waves.
    snaps : list of ndarray of shape (2, number of quantities)
    steps, points : ndarray
        Places of the equilibria, and of the special points.
    """

    lines: list[tuple[Style, Array]]
    bands: list[tuple[tuple[int | str, ...], Array]]
    snaps: list[Array]
    steps: Array
    points: Array

    @classmethod
    def of(cls, branch: Branch, quantities: Sequence[str], units: Units) -> Strands:
        """The strands of a branch in these quantities, in these units."""
        shown = _Shown(branch, quantities, units)
        segments = _segments(shown, _words(branch, branch.scene.analysis.stability))
        return cls(
            list(_lines(segments, lambda piece: style_of(piece.words) if piece.known else UNRESOLVED)),
            [band for band in _azimuthal(branch, shown) if band[0]],
            [shown.ends(gap.snap) for gap in shown.curve.gaps if gap.snap is not None],
            shown.at(branch),
            shown.at(branch.special_points or ()),
        )


class _Shown:
    """What the axes show of a branch: quantities, each times a factor."""

    def __init__(self, branch: Branch, quantities: Sequence[str], units: Units) -> None:
        self.quantities, self.curve = quantities, branch.curve
        for name in quantities:
            if name not in PLACES:
                self.curve.reader(name)  # refuses what cannot be shown
        self._into = [_into(branch, name, units) for name in quantities]
        self._lines = {key: self._in_units(line) for key, line in self.curve.lines(quantities).items()}

    def _in_units(self, values: Array) -> Array:
        """Values of the quantities, in columns, in the units of the axes."""
        return np.stack([into(column) for into, column in zip(self._into, values.T, strict=True)], axis=1)

    def at(self, items: Sequence[Equilibrium | SpecialPoint]) -> Array:
        """Places in the picture of the steps of the branch, or of special points."""
        values = [[self._value(k, item, q) for q in self.quantities] for k, item in enumerate(items)]
        return self._in_units(np.array(values, dtype=float).reshape(-1, len(self.quantities)))

    def _value(self, number: int, item: Equilibrium | SpecialPoint, quantity: str) -> float:
        if quantity in PLACES:
            return float(getattr(item, quantity))
        step, equilibrium = (self._between(item), item.equilibrium) if isinstance(item, SpecialPoint) else (number, item)
        return step if quantity == "step" else float(self.curve.reader(quantity)(number, equilibrium))

    def _between(self, point: SpecialPoint) -> float:
        """The number that a special point has among the steps."""
        for k, gap in enumerate(self.curve.gaps):
            if any(piece.b.special is point for stretch in gap.stretches for piece in stretch):
                return k + 0.5
        return float("nan")

    def ends(self, snap: Snap) -> Array:
        """Both ends of the arrow of a snap."""
        return self._in_units(np.array([[self.curve.value(point, q) for q in self.quantities] for point in (snap.tail, snap.tip)]))

    def line(self, pieces: Sequence[Piece]) -> Array:
        """Pieces of the curve as one polygon."""
        lines = [self._lines[id(piece)] for piece in pieces]
        return np.concatenate([lines[0], *(line[1:] for line in lines[1:])])

    def parameters(self, pieces: Sequence[Piece]) -> Array:
        """Where the corners of this polygon lie: number of the piece plus share of it."""
        counts = [len(self._lines[id(piece)]) - 1 for piece in pieces]
        return np.concatenate([[0.0], *(k + np.arange(1, count + 1) / count for k, count in enumerate(counts))])


def _words(branch: Branch, controls: Sequence[str]) -> list[dict[Any, str]]:
    """The verdicts of each equilibrium under the controls asked for."""
    words: list[dict[Any, str]] = [{c: ILL_POSED_WORD if e.status.ill_posed else e.verdict(c).word for c in controls} for e in branch]
    if branch.status.ill_posed:  # a cross marks that one
        words[-1] = words[max(len(words) - 2, 0)]
    return words


def answer(branch: Branch) -> str:
    """The quantity that a branch is drawn by: the pressure, or the height of the pole where a pressure is held."""
    return "center_height" if "pressure" in branch.hold else "pressure"


def _label(branch: Branch, name: str, units: Units) -> str:
    """The text at an axis that shows a quantity, or a number of the scene."""
    return shown_number(branch.scene, name, units).label if "." in name else axis_label(name, units)


def _into(branch: Branch, name: str, units: Units) -> Callable[[Array], Array]:
    """What turns a quantity, or a number of the scene, into what the axes show."""
    if "." in name:
        return shown_number(branch.scene, name, units).into
    factor = units.factor(name)
    return lambda values: values * factor


def _changes(branch: Branch, point: SpecialPoint) -> tuple[Any, ...] | None:
    """The verdicts that can change at a special point, by control or number of waves; None for any. Over a number what is held decides."""
    of_kind: dict[str, tuple[Any, ...]] = {
        "limit_point": () if branch.over else ("pressure",),
        "volume_fold": () if branch.over else ("volume",),
        "height_fold": (),
        "number_fold": tuple(branch.hold),
        "azimuthal_onset": (point.azimuthal,),
        "zone_opens": (),
        "zone_closes": (),
    }
    return of_kind.get(str(point.kind))


@dataclass(frozen=True, eq=False)
class _Segment:
    """A piece of the drawn line, the verdicts along it, and whether the branch is known there."""

    line: Array
    words: dict[Any, str]
    known: bool = True


def _segments(shown: _Shown, words: Sequence[dict[Any, str]]) -> list[_Segment | None]:
    """The pieces of the line, cut at special points; None where the membrane snaps."""
    pieces: list[_Segment | None] = []
    for k, gap in enumerate(shown.curve.gaps):
        now, after = words[k], words[k + 1]
        *passed, last = gap.stretches
        for stretch in passed:
            pieces += _pieces(shown, stretch, now)
            point = stretch[-1].b.special
            changes = None if point is None else _changes(shown.curve.branch, point)
            now = {c: after[c] if changes is None or c in changes else word for c, word in now.items()}
        if gap.snap is not None:
            pieces += [*_pieces(shown, last, now), None, *_pieces(shown, gap.beyond, after)]
        else:
            pieces += _pieces(shown, last, now) if now == after else _changing(shown, last, now, after)
    return pieces


def _pieces(shown: _Shown, part: Sequence[Piece], words: dict[Any, str]) -> list[_Segment | None]:
    """A stretch of the curve with the same verdicts."""
    return [_Segment(shown.line(list(group)), words, known) for known, group in groupby(part, lambda piece: piece.resolved)]


def _changing(shown: _Shown, part: Sequence[Piece], now: dict[Any, str], after: dict[Any, str]) -> list[_Segment | None]:
    """A stretch of the curve on which verdicts change.

    Where the branch is not known they change there. Else the verdict at a held pressure or volume changes where the curve turns back in
    it. Any other one changes half-way, and so does every one over a number, where what turns back is the number.
    """
    if not part:
        return []
    lost = next((k for k, piece in enumerate(part) if not piece.resolved), None)
    if lost is not None and len(part) > 1:
        inner = _changing(shown, part[lost : lost + 1], now, after)
        return [*_pieces(shown, part[:lost], now), *inner, *_pieces(shown, part[lost + 1 :], after)]
    places: dict[float, dict[Any, str]] = {}
    for c in now:
        if now[c] != after[c]:
            turn = turning(part, c) if c in PLACES and not shown.curve.branch.over else None
            places.setdefault(half_way(part) if turn is None else turn, {})[c] = after[c]
    at, line = shown.parameters(part), shown.line(part)
    found: list[_Segment | None] = []
    for place in sorted(places):
        cut = np.array([[np.interp(place, at, coordinate) for coordinate in line.T]])
        before = at < place
        found.append(_Segment(np.concatenate([line[before], cut]), now, lost is None))
        now = now | places[place]
        at, line = np.concatenate([[place], at[at > place]]), np.concatenate([cut, line[at > place]])
    return [*found, _Segment(line, now, lost is None)]


def _lines(pieces: Sequence[_Segment | None], classify: Callable[[_Segment], Any]) -> Iterator[tuple[Any, Array]]:
    """The pieces of one class that follow each other, as lines: no gap, no overlap."""
    kind: Any = None
    line: list[Array] = []
    for piece in [*pieces, None]:
        new = None if piece is None else classify(piece)
        if line and (piece is None or new != kind):
            yield kind, np.concatenate([line[0], *(part[1:] for part in line[1:])])
            line = []
        if piece is not None:
            line.append(piece.line)
        kind = new


def _named(axes: Axes, label: str, heading: str | None) -> str:
    """The colour of the next branch among several, which the legend then has under its name, and a heading for verdicts below."""
    before = [line for line in axes.lines if line.get_gid() == _BRANCH]
    color = COLORS[len(before) % len(COLORS)]
    axes.plot([], [], color=color, linewidth=3.0, label=label, gid=_BRANCH)
    if heading is not None:
        axes.plot([], [], " ", label=new_label(axes, heading))
    return color


def _draw_lines(
    axes: Axes, pieces: Sequence[_Segment | None], classify: Callable[[dict[Any, str]], Style], color: str | None = None
) -> None:
    for style, line in _lines(pieces, lambda piece: classify(piece.words) if piece.known else UNRESOLVED):
        # the caps of neighbouring dashes may not run into each other
        look: dict[str, Any] = {"linestyle": style.dashes, "color": style.color, "linewidth": style.width, "dash_capstyle": "butt"}
        if color is None:
            axes.plot(*line.T, label=new_label(axes, style.label), zorder=3, **look)
        else:  # the colour tells the branch: the verdicts of all branches are named once, in black
            faint = {"alpha": 0.5} if style is UNTESTED else {}
            axes.plot([], [], label=new_label(axes, style.label), **(look | {"color": "black"} | faint))
            axes.plot(*line.T, zorder=3, **(look | {"color": color} | faint))


def _draw_azimuthal(axes: Axes, branch: Branch, shown: _Shown) -> None:
    """A grey band behind the stretches that lose stability to azimuthal modes, darker for more of them, and for shorter waves."""
    lines = list(_azimuthal(branch, shown))
    order = sorted({lost for lost, _ in lines if lost}, key=lambda lost: (len(lost), [n if isinstance(n, int) else 0 for n in lost]))
    for lost, line in lines:
        if lost:
            named = new_label(axes, "unstable to azimuthal n = " + ", ".join("any" if n == ALL else str(n) for n in lost))
            grey = str(max(0.84 - 0.14 * order.index(lost), 0.4))
            axes.plot(*line.T, color=grey, linewidth=8, solid_capstyle="butt", zorder=1, label=named)


def _azimuthal(branch: Branch, shown: _Shown) -> Iterator[tuple[tuple[int | str, ...], Array]]:
    """The stretches of the line by the azimuthal modes to which they are unstable."""
    if not branch.scene.analysis.azimuthal_modes:
        return iter(())
    words: list[dict[Any, str]] = [{n: e.verdict(azimuthal=n).word for n in branch.scene.analysis.azimuthal_modes} for e in branch]
    return _lines(_segments(shown, words), lambda piece: tuple(n for n, word in piece.words.items() if word == "unstable"))


def _draw_wrinkling(axes: Axes, branch: Branch, shown: _Shown) -> None:
    """Patterns behind the stretches on which the membrane is wrinkled somewhere."""
    words: list[dict[Any, str]] = [{kind: kind * (kind in shown_kinds(e.zones())) for kind in PATTERNS} for e in branch]
    for kinds, line in _lines(_segments(shown, words), lambda p: tuple(filter(None, p.words.values()))):
        for kind in kinds:
            draw_along(axes, line, kind, zone_label(branch.scene, kind), BRANCH_WIDTH)


def _draw_jumps(axes: Axes, shown: _Shown) -> None:
    """An arrow for each snap at the load where it happens."""
    arrow = {"arrowstyle": "-|>", "color": RED, "linewidth": 1.6, "mutation_scale": 15, "shrinkA": 0, "shrinkB": 0}
    for gap in shown.curve.gaps:
        if gap.snap is not None:
            tail, tip = shown.ends(gap.snap)
            axes.annotate("", xy=tip, xytext=tail, arrowprops=arrow, zorder=4)
            axes.plot([], [], color=RED, linewidth=1.6, label=new_label(axes, "snap"))


def after(point: SpecialPoint) -> str:
    """Of an azimuthal onset: subcritical or supercritical at a held volume; empty where that is not known, and of other points."""
    kind = point.postbuckling.kind if point.azimuthal else UNKNOWN
    return "" if kind == UNKNOWN else kind


def _draw_special_points(axes: Axes, branch: Branch, shown: _Shown) -> None:
    points = [*(branch.special_points or ()), *(jump.limit for jump in branch.jumps if jump.limit)]
    looks = [(str(p.kind), after(p)) for p in points]
    for kind, word in dict.fromkeys(looks):
        marker, named = MARKERS.get(kind, ("*", kind.replace("_", " ")))
        named = f"{named}, {word}" if word else named
        places = shown.at([p for p, look in zip(points, looks, strict=True) if look == (kind, word)])
        face = "black" if word == SUBCRITICAL else "white"
        look: dict[str, Any] = {"markersize": 7, "markerfacecolor": face, "markeredgecolor": "black", "markeredgewidth": 1.2}
        axes.plot(*places.T, marker, label=new_label(axes, named), zorder=4, **look)
    for point, place in zip(points, shown.at(points), strict=True):
        if point.azimuthal:
            add_label(axes, f"n = {point.azimuthal}", place, size=8)
