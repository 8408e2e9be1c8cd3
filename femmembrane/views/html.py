"""Pieces of a page: text that is escaped, and tables that scroll on their own where a page is narrow."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from ..quantities import PLACES, title
from ..results.analyses import column_heading, remarks
from .style import STYLE
from .svg import dark, variable

if TYPE_CHECKING:
    from ..results.branch import Branch
    from ..results.equilibrium import Equilibrium

#: most rows of a table of equilibria
MOST_ROWS = 60


def text(value: Any) -> str:
    """A value as a person reads it, escaped."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (float, np.floating)):
        return "–" if np.isnan(value) else f"{value:.6g}".replace("-", "−")  # noqa: RUF001
    if isinstance(value, (list, tuple)):
        return ", ".join(text(item) for item in value)
    return escape(str(value))


def page_of(title: str, head: str, body: str, colors: Iterable[str]) -> str:
    """A whole page without links to a network: a title with what stands below it, and sections.

    Parameters
    ----------
    title : str
        Plain text.
    head, body : str
        Markup below the title, and of the sections.
    colors : iterable of str
        Of the pictures, which are darkened where the reader's screen is dark.
    """
    night = "".join(f"{variable(color)}:{dark(color)};" for color in sorted(colors))
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8"/>
<meta name="viewport" content="width=device-width, initial-scale=1"/>
<meta name="color-scheme" content="light dark"/>
<link rel="icon" href="data:,"/>
<title>{escape(title)}</title>
<style>
{STYLE}
@media (prefers-color-scheme: dark) {{ :root {{ {night} }} }}
</style>
</head>
<body>
<header>
<h1>{escape(title)}</h1>
{head}
</header>
<main>
{body}
</main>
</body>
</html>
"""


def table(header: Sequence[str], rows: Iterable[Sequence[Any]], *, caption: str = "") -> str:
    """A table whose numbers stand at the right."""
    cells = [list(row) for row in rows]
    numbers = [all(not isinstance(row[k], str) for row in cells) for k in range(len(header))]
    kinds = [' class="number"' if number else "" for number in numbers]
    head = "".join(f'<th scope="col"{kind}>{escape(name)}</th>' for name, kind in zip(header, kinds, strict=True))
    body = "\n".join("<tr>" + "".join(_cell(value) for value in row) + "</tr>" for row in cells)
    about = f"<caption>{escape(caption)}</caption>" if caption else ""
    return f'<div class="scroll"><table>{about}<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>'


def pairs(items: Iterable[tuple[str, Any]]) -> str:
    """Names and values, one a line."""
    lines = (f"<dt>{escape(name)}</dt><dd>{text(value)}</dd>" for name, value in items)
    return f"<dl>{''.join(lines)}</dl>"


def branch_rows(branch: Branch, most: int = MOST_ROWS) -> tuple[list[str], list[list[Any]]]:
    """Headings and cells of the equilibria of a branch: all of them, or ``most`` of them, evenly spread."""
    from ..results.table import columns, reader

    names = [name for name in columns(branch) if name not in ("iterations", "seconds")]
    readers = [reader(branch.scene, name) for name in names]
    shown = {round(step) for step in np.linspace(0, len(branch) - 1, min(most, len(branch)))}
    cells = [[read(step, branch[step]) for read in readers] for step in sorted(shown)]
    return [column_heading(name) for name in names], cells


def equilibrium_pairs(equilibrium: Equilibrium) -> list[tuple[str, Any]]:
    """The numbers of an equilibrium, with the verdicts that its scene asks for."""
    scene = equilibrium.scene
    parts = {"magnetic_energy": scene.sources, "load_energy": scene.loads, "electric_energy": scene.electric}
    energies = ["elastic_energy", *(name for name, part in parts.items() if part)]
    return [
        *((title(name), getattr(equilibrium, name)) for name in (*PLACES, *energies, "residual", "status")),
        *((remark.subject, remark.text) for remark in remarks(equilibrium)),
    ]


def _cell(value: Any) -> str:
    if isinstance(value, str):
        kind = f' class="{value}"' if value in ("stable", "unstable", "marginal") else ""
        return f"<td{kind}>{text(value)}</td>"
    return f'<td class="number">{text(value)}</td>'
