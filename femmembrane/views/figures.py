"""Frames of pictures: a figure, its legend, its file, and the styles that tell verdicts apart.

Figures are made without pyplot, so that nothing global changes and no window opens. Line style and marker shape carry all that colour does:
the figures read the same in grey.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..files import replace_file
from .backend import drawing, load, title_text
from .journal import fit, layout
from .labels import covered, settle
from .tex import tex_texts
from .zones import zone_order

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..results.equilibrium import Equilibrium

_DPI = 160
#: points that lines and markers keep from a legend
_CLEAR = 4.0
#: inches below which a figure has its legend in one column below
_NARROW = 5.0
#: inches of a column of a legend
_COLUMN = 1.6
_LIVE_TEXT: Any = {"svg.fonttype": "none", "pdf.fonttype": 42}


@dataclass(frozen=True)
class Style:
    """How a class of equilibria is drawn and named."""

    label: str
    dashes: Any
    color: str
    width: float = 1.8


SOLID, DASHED, DOTTED = "-", (0, (5, 2)), (0, (1, 1.4))
BLUE, ORANGE, BLACK, RED = "#0072b2", "#d55e00", "#222222", "#a01040"
PLAIN = Style("", SOLID, BLUE)
#: a branch whose stability nobody asked for
UNTESTED = Style("stability not tested", SOLID, "0.62", 1.8)
#: between two equilibria that no curve was found for
UNRESOLVED = Style("not resolved between steps", (0, (1, 3)), "0.5", 1.2)
MARGINAL = Style("marginal (an eigenvalue is zero)", (0, (6, 1.5, 1, 1.5)), BLACK)
BOTH = Style("stable under both controls", SOLID, BLUE)
VOLUME_ONLY = Style("stable under volume control only", DASHED, ORANGE)
UNSTABLE = Style("unstable under both controls", DOTTED, BLACK, 2.2)
#: compressed or slack along the meridian: what a mesh finds there depends on the mesh, stable or not
ILL_POSED = Style("ill-posed (compressed or slack)", DOTTED, "#888888", 1.2)
#: when one control alone was asked for
STABLE_UNDER = {c: Style(f"stable under {c} control", SOLID, BLUE) for c in ("pressure", "volume", "gas")}
UNSTABLE_UNDER = {c: Style(f"unstable under {c} control", DOTTED, BLACK, 2.2) for c in ("pressure", "volume", "gas")}
#: when three were asked for
_ALL, _NONE = replace(BOTH, label="stable under all three controls"), replace(UNSTABLE, label="unstable under all three controls")
_TWO_OF_THREE = (0, (5, 2, 1, 2, 1, 2))

#: what verdicts under a control are about, above them in a legend
AMONG = "among axisymmetric shapes:"
#: in place of a verdict
ILL_POSED_WORD = "ill-posed"


def verdict_style(equilibrium: Equilibrium, controls: Sequence[str] = ("pressure", "volume")) -> Style:
    """How an equilibrium is drawn for its verdicts under some controls."""
    return style_of({c: equilibrium.verdict(c).word for c in controls})


def style_of(words: Mapping[str, str]) -> Style:
    """The style of a class of equilibria: the verdict under each control asked for."""
    if not words:
        return UNTESTED
    if ILL_POSED_WORD in words.values():
        return ILL_POSED
    if "marginal" in words.values():
        return MARGINAL
    stable = tuple(control for control in STABLE_UNDER if words.get(control) == "stable")
    if len(words) == 1:
        (control,) = words
        return (STABLE_UNDER if stable else UNSTABLE_UNDER)[control]
    if len(words) == len(STABLE_UNDER):
        return _NONE if not stable else _ALL if len(stable) == len(words) else _stable_under_some(stable)
    if 0 < len(stable) < len(words):
        return _stable_under_some(stable)
    if words.keys() == {"pressure", "volume"}:
        return BOTH if stable else UNSTABLE
    both = tuple(control for control in STABLE_UNDER if control in words)
    return _under_pair(BOTH, both) if stable else _under_pair(UNSTABLE, both)


def _under_pair(style: Style, controls: Sequence[str]) -> Style:
    """The style of one word under two controls, of which one is the gas."""
    return replace(style, label=f"{style.label.split()[0]} under {' and '.join(controls)} control")


def _stable_under_some(controls: Sequence[str]) -> Style:
    """The style of equilibria that are stable under these controls, and not under others that were asked for."""
    label = f"stable under {' and '.join(controls)} control only"
    return replace(VOLUME_ONLY, label=label, dashes=DASHED if len(controls) == 1 else _TWO_OF_THREE)


_PAIRS = tuple(combinations(STABLE_UNDER, 2))
#: the order of the lines in a legend
_ORDER = [
    AMONG,
    *(
        style.label
        for style in (
            *(BOTH, _ALL, *(_under_pair(BOTH, pair) for pair in _PAIRS), *STABLE_UNDER.values()),
            *(_stable_under_some(some) for some in (*_PAIRS, *combinations(STABLE_UNDER, 1))),
            *(
                *UNSTABLE_UNDER.values(),
                *(_under_pair(UNSTABLE, pair) for pair in _PAIRS),
                UNSTABLE,
                _NONE,
                MARGINAL,
                ILL_POSED,
                UNTESTED,
                UNRESOLVED,
            ),
        )
    ),
]


def shown_figure(size: tuple[float, float]) -> Figure:
    """An empty figure of a size in inches, which a notebook shows as a picture wherever it is the last value of a cell."""
    load()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    show_in_notebooks(figure, figure)
    return figure


def show_in_notebooks(shown: Any, figure: Figure) -> None:
    """Let a notebook show a figure, or axes of it, as a picture: without pyplot it would print their names."""
    shown._repr_png_ = partial(png, figure)


def png(figure: Figure) -> bytes:
    """A figure as the content of a PNG file for a screen."""
    file = io.BytesIO()
    with drawing():
        figure.savefig(file, format="png", dpi=110)
    return file.getvalue()


def new_figure(size: tuple[float, float], *, title: str = "", widths: Sequence[float] = (1.0,)) -> tuple[Figure, Any]:
    """A figure of a size in inches with one axes, or a row of several of the given relative widths.

    Returns
    -------
    figure : Figure
    axes : Axes, or array of Axes
    """
    load()
    fitted, across = layout(size, len(widths))
    figure = shown_figure(fitted)
    setattr(figure, _HEIGHTS, {None: fitted[1]})
    if across == len(widths):
        row = figure.subplots(1, len(widths), width_ratios=list(widths), squeeze=False)[0]
    else:  # a narrow style
        whole = figure.subplots(-(-len(widths) // across), across, squeeze=False).ravel()
        row = whole[: len(widths)]
        for spare in whole[len(widths) :]:
            spare.remove()
    for axes in row:
        axes.spines[["top", "right"]].set_visible(False)
    look: dict[str, Any] = {"fontsize": 11, "wrap": True, "parse_math": False}
    if len(widths) > 1:
        figure.suptitle(title_text(title) or title, **look)  # a blank one leaves room
        return figure, row
    row[0].set_title(title_text(title), **look)
    return figure, row[0]


def save_figure(figure: Figure, path: str | PathLike[str] | None) -> Figure:
    """Fit a figure to Matplotlib's style, write it (nothing for None) whole or not at all, and return it.

    The suffix must be a format that Matplotlib writes.

    Text in SVG and PDF files stays text, which programs for drawing can edit. In PGF files it is set by the document that reads them.
    """
    fit(figure)
    settle(figure)
    if path is not None:
        formats = figure.canvas.get_supported_filetypes()
        if Path(path).suffix[1:].lower() not in formats:
            raise InputError(
                "path", str(path), "a name that ends in one of these is needed: " + ", ".join(f".{f}" for f in sorted(formats))
            )
        from matplotlib import rc_context, rcParams

        for_tex = Path(path).suffix.lower() == ".pgf"
        with replace_file(path) as temporary, drawing(), rc_context(_LIVE_TEXT), tex_texts(figure) if for_tex else nullcontext():
            try:
                figure.savefig(temporary, dpi=_DPI if rcParams["savefig.dpi"] == "figure" else rcParams["savefig.dpi"])
            except (RuntimeError, FileNotFoundError) as error:
                if not for_tex:
                    raise
                program = rcParams["pgf.texsystem"]
                raise InputError("path", str(path), f"LaTeX is needed for PGF ({program} on the search path)") from error
            except ValueError as error:
                said = re.search(r"^! (.*)", str(error), re.MULTILINE)
                if not for_tex or said is None:
                    raise
                raise InputError("path", str(path), f"PGF is written with the help of LaTeX, which says: {said[1]}") from error
    return figure


#: colours of several curves or branches in one picture: for the colour-blind too, and of different lightness
COLORS = ("#0072b2", "#d55e00", "#222222", "#56b4e9", "#a01040", "#e69f00", "#009e73")
#: dashes that go with them, so many that no two curves of 28 look the same
DASHES: tuple[Any, ...] = ("solid", (0, (6, 2)), (0, (2, 1.2)), (0, (7, 1.5, 1.5, 1.5)))


def tell_apart(axes: Axes) -> None:
    """Let the curves that are drawn next differ in colour, in lightness and in dashes, so that they do in grey as well."""
    from cycler import cycler

    looks = [(COLORS[k % len(COLORS)], DASHES[k % len(DASHES)]) for k in range(len(COLORS) * len(DASHES))]
    axes.set_prop_cycle(cycler(color=[color for color, _ in looks], linestyle=[dashes for _, dashes in looks]))


def save_axes(axes: Axes, path: str | PathLike[str] | None) -> Axes:
    """Fit and write the figure of axes that somebody gave, as :func:`save_figure`, and return the axes."""
    whole = axes.get_figure(root=True)
    if whole is not None:
        save_figure(whole, path)
    return axes


def draw_legend(axes: Axes, heading: str | None = None, **look: Any) -> None:
    """A legend of what is named, if anything is; ``look`` goes to Matplotlib's ``legend``.

    It stands in the axes. In a figure of this package, where it would cover a line, it stands below them, and the figure grows.
    """
    from matplotlib.transforms import ScaledTranslation

    handles, labels = legend_entries(axes)
    if not handles:
        return
    usual: dict[str, Any] = {"fontsize": 9, "title_fontsize": 9, "framealpha": 0.9, "edgecolor": "none", "handlelength": 3.2}
    figure = axes.get_figure(root=True)

    def draw(**more: Any) -> Any:
        legend = axes.legend(handles, labels, title=heading, **(usual | look | more))
        legend.set_alignment("left")
        if figure is not None:
            fit(figure)
        return legend

    _grow(axes, 0.0)
    legend = draw()
    if figure is None or not hasattr(figure, _HEIGHTS) or "loc" in look or not covers(legend, axes):
        return  # in figures of others there may be no room below
    for corner in _CORNERS:  # Matplotlib's own choice looks at corners of lines, and not as far from them
        legend.set_loc(corner)
        if not _over(legend, axes):
            return
    legend.remove()
    low = axes.get_window_extent().y0 - axes.xaxis.get_tightbbox().y0  # type: ignore[union-attr]  # the axes are shown
    place = axes.transAxes + ScaledTranslation(0.0, -low / figure.dpi - 0.05, figure.dpi_scale_trans)
    legend = draw(loc="upper left", bbox_to_anchor=(0.0, 0.0), bbox_transform=place, borderaxespad=0.0, framealpha=0.0)
    _grow(axes, legend.get_window_extent().height / figure.dpi)


def covers(legend: Any, axes: Axes) -> bool:
    """Whether a legend lies over a line, a marker or words in its axes."""
    figure = legend.get_figure(root=True)
    figure.draw_without_rendering()
    return _over(legend, axes)


def _over(legend: Any, axes: Axes) -> bool:
    """The same, in a figure that is laid out."""
    figure = legend.get_figure(root=True)
    box = legend.get_window_extent().padded(_CLEAR * figure.dpi / 72)
    return covered(axes, box) > 0 or any(box.overlaps(text.get_window_extent()) for text in axes.texts if text.get_text())


#: where a legend may stand in its axes
_CORNERS = ("upper right", "upper left", "lower right", "lower left", "center right", "center left")
#: height in inches that a figure of this package had before a legend stood below its axes, and the heights of these legends
_HEIGHTS = "_femmembrane_heights"


def _grow(axes: Axes, height: float) -> None:
    """Give a figure of this package the height of its own and of the highest legend below its axes."""
    figure = axes.get_figure(root=True)
    heights = getattr(figure, _HEIGHTS, None)
    if figure is not None and heights is not None:
        heights[axes] = height
        figure.set_size_inches(figure.get_size_inches()[0], heights[None] + max(heights[a] for a in heights if a is not None))


def fitting_columns(figure: Figure) -> int:
    """Columns of a legend for which a figure is wide enough."""
    return max(int(figure.get_size_inches()[0] / _COLUMN), 1)


def legend_below(figure: Figure, handles: Sequence[Any], labels: Sequence[str], columns: int = 1, **look: Any) -> None:
    """A legend below all axes of a figure, in one column where the figure is narrow."""
    narrow = figure.get_size_inches()[0] < _NARROW
    usual: dict[str, Any] = {"frameon": False, "fontsize": 9, "handlelength": 3.2, "ncols": 1 if narrow else columns}
    figure.legend(handles, labels, loc="outside lower left", **(usual | look))
    if narrow:
        width, height = figure.get_size_inches()
        figure.set_size_inches(width, height + 0.16 * len(handles))


def legend_entries(axes: Axes) -> tuple[list[Any], list[str]]:
    """Handles and labels of what is named: branches, verdicts, wrinkles, and whatever else, always in the same order."""
    named = list(zip(*axes.get_legend_handles_labels(), strict=True))

    def place(item: tuple[Any, str]) -> int:
        if item[0].get_gid() is not None:
            return -1
        return _ORDER.index(item[1]) if item[1] in _ORDER else len(_ORDER) + zone_order(item[1])

    named.sort(key=place)
    return [handle for handle, _ in named], [label for _, label in named]
