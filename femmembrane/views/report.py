"""A run as one page that needs no network: what was asked, what came out, and how far it can be trusted.

The page has sections for what the run has, and for nothing else. It is read on a phone as on a screen, in light and
dark, and is the same for the same run: figures carry no date.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from html import escape
from itertools import pairwise
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import Status
from ..files import replace_file
from ..quantities import PLACES, Units, axis_label, caption, heading_in, words
from ..results.analyses import asked
from ..results.analyses.base import Curves, Drawing, Section
from ..results.curve import slopes_of
from ..scene.number_units import shown_number
from . import plots
from .backend import load
from .html import branch_rows, page_of, pairs, table, text
from .surroundings import Box
from .svg import inline_svg
from .vtk import Array, smooth_profile
from .zones import new_label

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..results.branch import Branch
    from ..results.equilibrium import Equilibrium

#: inches: text is of a readable size in a column of a screen and on a phone
_WIDTH, _HEIGHT = 4.7, 3.9
_CURVES = 6
#: least range of an axis relative to the values on it
_LEAST_RANGE = 0.01
#: columns of a table that stands beside a figure, equilibria that are shown as dots, and corners of a curve between two of them
_MOST_BESIDE, _DOTS, _FINE = 3, 20, 8
_DASHES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1, 1.4)), (0, (6, 1.5, 1, 1.5)))
_COLORS = ("#0072b2", "#d55e00", "#222222", "#a01040")


def write_report(branch: Branch, path: str | PathLike[str], facts: Mapping[str, Any] | None = None, *, units: str = "scaled") -> None:
    """Write the page of a branch.

    Parameters
    ----------
    branch : Branch
        Without equilibria, too: the page then says what was asked and why there are none.
    path : path
        HTML file to write.
    facts : mapping, optional
        Of the run, as in its ``run.json``: ``command``, ``versions``, ``platform``, ``processors``, ``written``.
    units : {"scaled", "si"}
        Of figures, ranges and special points: those of the package, or SI units by the scales of the scene.

    Raises
    ------
    InputError
        For a file that cannot be written, and for SI units of a scene without scales.
    """
    page = report(branch, facts, units)
    with replace_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8", errors="backslashreplace")  # the command may hold names that are no UTF-8


def report(branch: Branch, facts: Mapping[str, Any] | None = None, units: str = "scaled") -> str:
    """The page as text; see :func:`write_report`."""
    page = _Page(branch, facts or {}, units, Units.of(units, branch.scene.converter))
    sections = [(name, body) for name, body in page.sections() if body]
    title = branch.scene.title or "Inflated membrane"
    links = "".join(f'<a href="#{_anchor(name)}">{escape(name)}</a>' for name, _ in sections)
    bodies = "\n".join(f'<section id="{_anchor(name)}">\n<h2>{escape(name)}</h2>\n{body}\n</section>' for name, body in sections)
    return page_of(title, f"{page.summary()}\n<nav>{links}</nav>", bodies, page.colors)


def _anchor(name: str) -> str:
    return name.lower().replace(" ", "-")


@dataclass(eq=False)
class _Page:
    branch: Branch
    facts: Mapping[str, Any]
    system: str
    units: Units
    colors: set[str] = field(default_factory=set)
    figures: int = 0

    def sections(self) -> Iterator[tuple[str, str]]:
        """Name and content of every section; one without content is left out."""
        if len(self.branch):
            yield "Branch", self._branch()
            yield "Shape", self._shape()
            sections = (analysis.section(self.branch) for analysis in asked(self.branch.scene))
            yield from ((section.title, self._analysis(section)) for section in sections if section is not None)
            yield "Equilibria", self._equilibria()
        yield "Scene", self._scene()
        yield "Timings", self._timings()
        yield "Versions", self._versions()
        yield "How to cite", f"<pre>{escape(self.branch.cite())}</pre>"

    def summary(self) -> str:
        """How the run ended, and the ranges of the main quantities."""
        branch = self.branch
        good = branch.status is Status.CONVERGED
        message = "" if good else f"<p>{escape(branch.message)}</p><p>What helps: {escape(branch.status.advice)}.</p>"
        state = f'<p class="badge {"good" if good else "bad"}">{escape(str(branch.status))}</p>'
        tiles = [("equilibria", str(len(branch)))]
        if len(branch):
            for name in PLACES:
                values = self.units.factor(name) * branch.column(name)
                tiles.append((axis_label(name, self.units), f"{text(float(f'{values.min():.4g}'))} … {text(float(f'{values.max():.4g}'))}"))
            tiles.append(("largest residual", f"{branch.column('residual').max():.1e}".replace("-", "−")))  # noqa: RUF001
        shown = "".join(f'<div class="tile"><b>{value}</b><span>{escape(name)}</span></div>' for name, value in tiles)
        return f'{state}{message}<div class="tiles">{shown}</div>'

    def _figure(self, figure: Figure, label: str, caption: str = "") -> str:
        self.figures += 1
        svg, colors = inline_svg(figure, label, f"f{self.figures}")
        self.colors |= colors
        about = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
        return f"<figure>\n{svg}{about}</figure>"

    def _branch(self) -> str:
        up = plots.answer(self.branch)
        figures, drawn = [], [(name, "pressure") for name in ("volume", "center_height")]
        if self.branch.over:
            drawn = [(self.branch.over, up), ("volume", "pressure" if up != "pressure" else "center_height")]
        for across, up in drawn:
            figure, axes = plots.new_figure((_WIDTH, _HEIGHT + 0.6))
            plots.draw_branch(axes, self.branch, across=across, up=up, units=self.system)
            _legend_below(figure, axes)
            figures.append(self._figure(figure, f"{words(up).capitalize()} against {words(across)}"))
        return _beside(*figures) + self._between() + self._special_points() + self._jumps()

    def _between(self) -> str:
        """What the curves show between the equilibria."""
        curve = self.branch.curve
        lost = sum(not piece.resolved for run in curve.runs for piece in run)
        parts = ["Curves go through the equilibria along the tangents of the branch"]
        if self.branch.over:
            parts = ["Curves go smoothly through the equilibria; what lies between was not computed"]
        if curve.added:
            parts.append(f"and through {curve.added} more equilibria that were computed for the drawing alone")
        said = " ".join(parts) + "."
        if lost:
            said += f" Steps are too long in {lost} place(s): what lies between is not known, and drawn as a straight line."
        return f"<p>{escape(said)}</p>" if len(self.branch) > 1 else ""

    def _special_points(self) -> str:
        points = self.branch.special_points
        if points is None:
            return ""
        if not points:
            return "<p>Searched for special points: there are none.</p>"
        names = {kind: name for kind, (_, name) in plots.MARKERS.items()}
        over = [(self.branch.over, shown_number(self.branch.scene, self.branch.over, self.units))] if self.branch.over else []
        rows = [
            [
                names.get(str(p.kind), str(p.kind))
                + (f", n = {p.azimuthal}" if p.azimuthal else "")
                + (f", {word}" if (word := plots.after(p)) else "")
                + (f": {p.zone}" if p.zone else ""),
                *(float(shown.into(p.equilibrium.number(name))) for name, shown in over),
                *(self.units.factor(name) * getattr(p, name) for name in PLACES),
                float(f"{p.error:.1e}"),
            ]
            for p in points
        ]
        said = "".join(f"<p>{escape(p.postbuckling.words[:1].upper() + p.postbuckling.words[1:])}.</p>" for p in points if p.azimuthal)
        return (
            table(
                [
                    "special point",
                    *(shown.heading for _, shown in over),
                    *(heading_in(name, self.units) for name in PLACES),
                    "relative error",
                ],
                rows,
            )
            + said
        )

    def _jumps(self) -> str:
        names, rows = ("volume", "pressure"), []
        for jump in self.branch.jumps:
            ends = [[self.units.factor(q) * getattr(end, q, np.nan) for q in names] for end in (jump.limit, jump.landing)]
            rows.append([jump.index, *ends[0], *ends[1]])
        header = [f"{way} {heading_in(name, self.units)}" for way in ("from", "to") for name in names]
        return table(["snap to step", *header], rows) if rows else ""

    def _shape(self) -> str:
        last, at = self.branch[-1], f"at step {len(self.branch) - 1}, the last"
        stresses = ("mechanical_stress_1", "mechanical_stress_2", *_totals(self.branch))
        meridians = self._figure(_profiles(self.branch, self.units), "Deformed meridians of some equilibria with the sources")
        along = self._figure(_along(last, ("stretch_1", "stretch_2"), self.units), "Stretches", f"Stretches {at}")
        unit = self.units.unit(stresses[0])
        named = f"Cauchy stresses in {unit}" if unit else "Cauchy stresses over μ"
        along += self._figure(_along(last, stresses, self.units), "Stresses", f"{named} {at}")
        return _beside(meridians, f"<div>{along}</div>")

    def _analysis(self, section: Section) -> str:
        """The figure of an analysis beside its table, and what it says of the last equilibrium."""
        parts = []
        if section.figure is not None:
            parts.append(self._figure(_figure_of(section.figure, self.branch), section.figure.label))
        if section.table is not None:
            shown = table(section.table.header, section.table.rows, caption=section.table.caption)
            parts.append(f'<div class="wide">{shown}</div>' if len(section.table.header) > _MOST_BESIDE else shown)
        last = pairs((remark.subject, remark.text) for remark in section.last)
        return _beside(*parts) + (f"<h3>The last equilibrium</h3>{last}" if section.last else "")

    def _equilibria(self) -> str:
        header, rows = branch_rows(self.branch)
        how = f"{len(rows)} of {len(self.branch)}, evenly spread" if len(rows) < len(self.branch) else f"all {len(rows)}"
        return f"<details><summary>Table ({how})</summary>{table(header, rows)}</details>"

    def _scene(self) -> str:
        parts = []
        for name, content in self.branch.scene.record().items():
            if name == "title":
                continue
            for number, part in enumerate(content if isinstance(content, list) else [content]):
                many = isinstance(content, list) and len(content) > 1
                parts.append(f"<div><h3>{escape(name)}{f' {number + 1}' if many else ''}</h3>{pairs(_shortened(part))}</div>")
        used = f"<p>{escape(self.branch.mesh_used)}</p>" if self.branch.mesh_used else ""
        return f'{used}<div class="scene columns">{"".join(parts)}</div>'

    def _timings(self) -> str:
        timings = self.branch.timings
        total = sum(timings.values())
        if not total:
            return ""
        rows = "".join(
            f'<tr><td>{escape(stage.replace("_", " "))}</td><td class="number">{seconds:.3f} s</td>'
            f'<td class="bar"><i style="width:{100 * seconds / total:.1f}%"></i></td></tr>'
            for stage, seconds in timings.items()
        )
        each = f", {1000 * total / len(self.branch):.2f} ms an equilibrium" if len(self.branch) else ""
        return f'<div class="scroll"><table><tbody>{rows}</tbody></table></div><p>Together {total:.3f} s{each}.</p>'

    def _versions(self) -> str:
        facts = self.facts
        known = [(name, facts[name]) for name in ("command", "written", "platform", "processors") if facts.get(name) is not None]
        versions = dict(facts.get("versions", {}))
        return f'<div class="scene">{pairs([*known, *versions.items()])}</div>' if known or versions else ""


def _beside(*parts: str) -> str:
    """Beside each other where there is room, else below each other."""
    return f'<div class="figures">{"".join(parts)}</div>'


def _shortened(part: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """The keys of a table; a long list is shown by its ends."""
    for name, value in part.items():
        if isinstance(value, list) and len(value) > 12:
            yield name, f"{text(value[:3])}, …, {text(value[-1])} ({len(value)} values)"
        elif isinstance(value, Mapping):
            yield name, ", ".join(f"{key} = {text(item)}" for key, item in value.items())
        else:
            yield name, value


def _legend_below(figure: Figure, axes: Any, columns: int = 1) -> None:
    handles, labels = plots.legend_entries(axes)
    if handles:
        look: dict[str, Any] = {"frameon": False, "fontsize": 9, "handlelength": 3.2, "ncols": columns}
        figure.legend(handles, labels, loc="outside lower left", **look)


def _profiles(branch: Branch, units: Units) -> Figure:
    load()
    from matplotlib import colormaps

    shown = [branch[int(k)] for k in np.unique(np.linspace(len(branch) - 1, 0, _CURVES).round().astype(int))]
    box = Box.of([equilibrium.profile() for equilibrium in shown])
    figure, axes = plots.new_figure((_WIDTH, 1.9 + _HEIGHT * min(0.85, (box.high - box.low) / (2 * box.radius))))  # round stays round
    for equilibrium, color in zip(shown, colormaps["viridis"](np.linspace(0.85, 0.0, max(len(shown), 2))), strict=False):
        named = caption(equilibrium.volume, equilibrium.pressure, ",  ", units)
        plots.draw_profile(axes, equilibrium, plots.Style(named, "-", color), units=units)
    plots.draw_surroundings(axes, shown, units)
    _legend_below(figure, axes)
    return figure


def _totals(branch: Branch) -> tuple[str, ...]:
    """The total stresses differ from the mechanical ones by what a field and the thickness add."""
    return ("total_stress_1", "total_stress_2") if branch.scene.sources else ()


def _along(equilibrium: Equilibrium, names: tuple[str, ...], units: Units) -> Figure:
    """Quantities of the profile along the arc of the reference meridian."""
    profile = smooth_profile(equilibrium, points=201)
    figure, axes = plots.new_figure((_WIDTH, _HEIGHT))
    for name, dashes, color in zip(names, _DASHES, _COLORS, strict=False):
        way = {"1": "along the meridian", "2": "around the axis"}[name[-1]]
        kind = name[:-2].replace("_", " ")
        place, value = units.factor("s") * profile.get("s", profile["r"]), units.factor(name) * profile[name]
        axes.plot(place, value, linestyle=dashes, color=color, linewidth=1.8, label=f"{kind} {way}")
    axes.set_xlabel(axis_label("s" if "s" in profile else "r", units))
    axes.grid(color="0.9", linewidth=0.6)
    if profile[names[0]].min() < 0 or min(profile[name].min() for name in names) < 0:
        axes.axhline(0, color="0.6", linewidth=0.8, zorder=0)
    _show_even_as_even(axes)
    _legend_below(figure, axes)
    return figure


def _show_even_as_even(axes: Any) -> None:
    """A scale of at least one hundredth of the values, in which what is uniform but for errors of the mesh is level."""
    low, high = axes.get_ylim()
    half = _LEAST_RANGE / 2 * max(abs(low), abs(high))
    if high - low < 2 * half:
        axes.set_ylim((low + high) / 2 - half, (low + high) / 2 + half)


def _figure_of(figure: Curves | Drawing, branch: Branch) -> Figure:
    if isinstance(figure, Curves):
        return _curves(figure, branch)
    drawn, axes = plots.new_figure((_WIDTH, _HEIGHT + 0.6))
    handles = figure.draw(axes, branch)
    drawn.legend(handles=handles, loc="outside lower left", frameon=False, fontsize=9, handlelength=3.0, handleheight=1.8)
    return drawn


def _curves(shown: Curves, branch: Branch) -> Figure:
    figure, axes = plots.new_figure((_WIDTH, _HEIGHT))
    for k, (label, value) in enumerate(shown.values.items()):
        _draw_steps(axes, branch, np.where(np.abs(value) > 0, np.abs(value), np.nan) if shown.logarithmic else value, k, label)
    if shown.logarithmic:
        axes.set_yscale("log")
    else:
        _scale_around_zero(axes, np.concatenate([v[np.isfinite(v)] for v in shown.values.values()]))
    axes.set_ylabel(shown.axis)
    axes.grid(color="0.9", linewidth=0.6)
    _legend_below(figure, axes, shown.columns)
    return figure


def _scale_around_zero(axes: Any, known: Array) -> None:
    """A line at zero, and a scale that is linear around it where few values are far larger than the usual ones."""
    axes.axhline(0, color="0.4", linewidth=0.8, zorder=0)
    usual = float(np.median(np.abs(known))) if known.size else 0.0
    if usual and np.abs(known).max() > 30 * usual:
        axes.set_yscale("symlog", linthresh=10 ** np.ceil(np.log10(usual)))


def _draw_steps(axes: Any, branch: Branch, values: Array, kind: int, named: str) -> None:
    """A quantity against the step, with a gap where the membrane snaps."""
    breaks = [0, *(jump.index for jump in branch.jumps), len(branch)]
    look: dict[str, Any] = {"linestyle": _DASHES[kind % 4], "color": _COLORS[kind % 4], "linewidth": 1.8}
    for first, last in pairwise(breaks):
        steps = np.arange(first, last)
        axes.plot(*_smooth(steps, values[steps]), label=new_label(axes, named), **look)
        if len(branch) <= _DOTS:
            axes.plot(steps, values[steps], ".", color=look["color"])
    axes.set_xlabel(axis_label("step"))
    axes.xaxis.get_major_locator().set_params(integer=True)


def _smooth(steps: NDArray[np.int64], values: Array) -> tuple[Array, Array]:
    """A curve through values at steps, with the slopes of parabolas through neighbours; values with gaps as they are.

    What is positive is drawn by its logarithm, so that the curve is positive too.
    """
    from scipy.interpolate import CubicHermiteSpline

    if len(steps) < 3 or not np.isfinite(values).all():
        return steps.astype(float), values
    positive = bool((values > 0).all())
    drawn = np.log(values) if positive else values
    fine = np.linspace(steps[0], steps[-1], _FINE * (len(steps) - 1) + 1)
    curve = CubicHermiteSpline(steps, drawn, slopes_of(drawn, np.ones(len(steps) - 1)))(fine)
    return fine, np.exp(curve) if positive else curve
