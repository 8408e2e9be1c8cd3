"""Records as a notebook shows them."""

from __future__ import annotations

import base64
from html import escape
from itertools import cycle
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..quantities import PLACES, axis_label, title, words
from ..results.branch import Branch
from ..results.folds import FOLD_NAMES
from . import plots
from .explorer import framed
from .figures import COLORS, png
from .html import branch_rows, equilibrium_pairs, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..results.equilibria import Equilibria
    from ..results.equilibrium import Equilibrium
    from ..results.error_estimate import ErrorEstimate
    from ..results.folds import FoldCurve
    from ..results.tipped import TippedBranch
    from ..results.zones import Zones

_ROWS = 12
#: line styles that tell meridians apart in grey
DASHES = ("-", (0, (5, 2)), (0, (1, 1.4)), (0, (6, 1.5, 1, 1.5)))
_SIDE_BY_SIDE = "display:flex;flex-wrap:wrap;gap:24px;align-items:center"


def branch_html(branch: Branch) -> str:
    """The branch to explore; where scripts are not allowed, a still picture with a table."""
    if not len(branch):
        return f"<p>No equilibria: {escape(branch.message or str(branch.status))}</p>"
    return framed(branch, _still(branch))


def _still(branch: Branch) -> str:
    """Pressure against volume, a table of at most twelve equilibria, and how the branch ended."""
    header, rows = branch_rows(branch, _ROWS)
    count = f"{len(branch)} equilibria" + (f", {len(rows)} of them shown" if len(rows) < len(branch) else "")
    notes = "".join(f"<p>{escape(note)}</p>" for note in (branch.mesh_used, branch.message) if note)
    picture = _picture(plots.plot_pressure_volume(branch), "Pressure against volume")
    return f'{picture}<div style="overflow-x:auto">{table(header, rows, caption=count)}</div>{notes}'


def tipped_html(branch: TippedBranch) -> str:
    """The diagram of a branch with waves, a table of at most twelve equilibria, its folds, and how it ended."""
    if not len(branch):
        return f"<p>No equilibria: {escape(branch.message or str(branch.status))}</p>"
    controls = [f"verdict_{control}" for control in ("volume", "pressure") if control in branch.scene.analysis.stability]
    names = [*PLACES, "amplitude", "shift", "truncation", *controls]
    shown = sorted({round(k * (len(branch) - 1) / (_ROWS - 1)) for k in range(_ROWS)}) if len(branch) > _ROWS else list(range(len(branch)))
    columns = {name: branch.column(name) for name in names if not name.startswith("verdict_")}
    verdicts = {name: [branch[k].verdict(name.removeprefix("verdict_")).word for k in shown] for name in controls}
    rows = [[k, *(float(columns[n][k]) if n in columns else verdicts[n][row] for n in names)] for row, k in enumerate(shown)]
    count = f"{len(branch)} equilibria with waves around the axis" + (f", {len(rows)} of them shown" if len(rows) < len(branch) else "")
    known = table(["step", *(title(name) for name in names)], rows, caption=count)
    folds = [[p.kind.replace("_", " "), p.volume, p.pressure, p.center_height] for p in branch.special_points or ()]
    points = table(["", *map(title, PLACES)], folds) if folds else ""
    figure, axes = plots.new_figure((6.4, 4.6), title=branch.scene.title)
    branch.plot(ax=axes)
    axes.set(xlabel=axis_label("volume"), ylabel=axis_label("pressure"))
    message = f"<p>{escape(branch.message)}</p>" if branch.message else ""
    return f'{_picture(figure, "Pressure against volume")}<div style="overflow-x:auto">{known}</div>{points}{message}'


def equilibrium_html(equilibrium: Equilibrium) -> str:
    """The equilibrium in space with its verdicts; where scripts are not allowed, numbers and verdicts beside the deformed meridian."""
    figure, axes = plots.new_figure((4.6, 4.4))
    plots.draw_profile(axes, equilibrium, plots.PLAIN)
    plots.draw_surroundings(axes, [equilibrium])
    handles, labels = plots.legend_entries(axes)
    figure.legend(handles, labels, loc="outside lower left", frameon=False, fontsize=9)
    known = table(["", ""], equilibrium_pairs(equilibrium))
    still = f'<div style="{_SIDE_BY_SIDE}">{_picture(figure, "Deformed meridian")}{known}</div>'
    return framed(Branch(equilibrium.scene, (equilibrium,)), still)


def zones_html(zones: Zones) -> str:
    """A table with a row for each zone."""
    header = ["zone", "r from", "r to", "ρ from", "ρ to", "part of the area", "of the deformed area"]  # noqa: RUF001
    rows = [[z.kind, *z.r, *z.rho, z.area_fraction, z.deformed_area_fraction] for z in zones]
    return table(header, rows, caption=f"Zones by the signs of the {zones.criterion} stresses, from the pole to the rim")


def equilibria_html(found: Equilibria) -> str:
    """The meridians of the equilibria beside a table of them."""
    if not len(found):
        return f"<p>{escape(str(found).splitlines()[0])}</p>"
    figure, axes = plots.new_figure((4.6, 4.4))
    for k, (equilibrium, color) in enumerate(zip(found, cycle(COLORS), strict=False)):
        plots.draw_profile(axes, equilibrium, plots.Style(str(k), DASHES[k % len(DASHES)], color))
    plots.draw_surroundings(axes, list(found))
    handles, labels = plots.legend_entries(axes)
    figure.legend(handles, labels, loc="outside lower left", frameon=False, fontsize=9, ncols=2, handlelength=3.2)
    header = ["", title("energy"), *map(title, PLACES), "pressure held", "volume held"]
    rows = [
        [k, energy, *(getattr(e, name) for name in PLACES), e.verdict("pressure").word, e.verdict("volume").word]
        for k, (energy, e) in enumerate(zip(found.energies, found, strict=True))
    ]
    known = table(header, rows, caption=f"{len(found)} equilibria at {found.control} {found.load:.9g}")
    return f'<div style="{_SIDE_BY_SIDE}">{_picture(figure, "Deformed meridians")}{known}</div><p>{escape(found.searched)}</p>'


def fold_curve_html(curve: FoldCurve) -> str:
    """Pressure and volume of the fold over the number, and how the curve ended."""
    if not len(curve):
        return f"<p>{escape(curve.message or str(curve.status))}</p>"
    rows = [[c.kind.replace("_", " "), c.value, c.pressure, c.volume] for c in curve.cusps]
    cusps = table(["", curve.parameter, title("pressure"), title("volume")], rows) if rows else ""
    message = f"<p>{escape(curve.message)}</p>" if curve.message else ""
    return _picture(curve.plot(), f"{FOLD_NAMES[curve.kind]} over {curve.parameter}") + cusps + message


def error_estimate_html(estimate: ErrorEstimate) -> str:
    """A table of values and their errors."""
    rows = [[words(name), d.value, d.error, d.relative] for name in estimate.shown for d in [getattr(estimate, name)]]
    caption = f"Errors at the same {words(estimate.control)}; {estimate.method}"
    reason = f"<p>{escape(estimate.reason)}</p>" if estimate.reason else ""
    return table(["", "value", "error", "relative"], rows, caption=caption) + reason


def study_html(study: Any, label: str) -> str:
    """The picture of a study above the text that is printed of it, or the text alone where there is nothing to draw."""
    try:
        picture = _picture(study.plot(), label)
    except InputError:
        picture = ""
    return f"{picture}<pre>{escape(str(study))}</pre>"


def _picture(figure: Figure, label: str) -> str:
    """A PNG in the page: notebooks put many pages into one, where the ids of SVGs would meet."""
    data = base64.b64encode(png(figure)).decode()
    return f'<img alt="{escape(label)}" style="max-width:min(100%, 560px)" src="data:image/png;base64,{data}"/>'
