"""Equilibria and branches as a notebook shows them."""

from __future__ import annotations

import base64
from html import escape
from typing import TYPE_CHECKING

from . import plots
from .figures import png
from .html import branch_rows, equilibrium_pairs, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..results.branch import Branch
    from ..results.equilibrium import Equilibrium

_ROWS = 12
_SIDE_BY_SIDE = "display:flex;flex-wrap:wrap;gap:24px;align-items:center"


def branch_html(branch: Branch) -> str:
    """Pressure against volume, a table of at most twelve equilibria, and how the branch ended."""
    if not len(branch):
        return f"<p>No equilibria: {escape(branch.message or str(branch.status))}</p>"
    header, rows = branch_rows(branch, _ROWS)
    count = f"{len(branch)} equilibria" + (f", {len(rows)} of them shown" if len(rows) < len(branch) else "")
    notes = "".join(f"<p>{escape(note)}</p>" for note in (branch.mesh_used, branch.message) if note)
    picture = _picture(plots.plot_pressure_volume(branch), "Pressure against volume")
    return f'{picture}<div style="overflow-x:auto">{table(header, rows, caption=count)}</div>{notes}'


def equilibrium_html(equilibrium: Equilibrium) -> str:
    """Numbers and verdicts beside the deformed meridian."""
    figure, axes = plots.new_figure((4.6, 4.4))
    plots.draw_profile(axes, equilibrium, plots.PLAIN)
    plots.draw_surroundings(axes, [equilibrium])
    handles, labels = plots.legend_entries(axes)
    figure.legend(handles, labels, loc="outside lower left", frameon=False, fontsize=9)
    known = table(["", ""], equilibrium_pairs(equilibrium))
    return f'<div style="{_SIDE_BY_SIDE}">{_picture(figure, "Deformed meridian")}{known}</div>'


def _picture(figure: Figure, label: str) -> str:
    """A PNG in the page: notebooks put many pages into one, where the ids of SVGs would meet."""
    data = base64.b64encode(png(figure)).decode()
    return f'<img alt="{escape(label)}" style="max-width:min(100%, 560px)" src="data:image/png;base64,{data}"/>'
