"""Figures inside a page: SVG without a date, the same for the same figure, whose colours turn with the page from light to dark."""

from __future__ import annotations

import colorsys
import io
import re
from html import escape
from typing import TYPE_CHECKING

from .backend import drawing, load

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOR = re.compile(r"#[0-9a-fA-F]{6}\b")
#: lightness that white and black have on a dark page
_DARKEST, _LIGHTEST = 0.1, 0.92


def inline_svg(figure: Figure, label: str, key: str) -> tuple[str, set[str]]:
    """A figure as an ``<svg>`` element as wide as there is room, and the colours in it.

    Parameters
    ----------
    label : str
        What it shows, for those who cannot see it.
    key : str
        Put before the ids in it, which must differ from those of the other figures of a page.
    """
    load()
    from matplotlib import rc_context

    text = io.StringIO()
    nothing = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    with rc_context({"svg.hashsalt": "femmembrane", "svg.fonttype": "path", "svg.id": None}), drawing():
        figure.savefig(text, format="svg", metadata=nothing, transparent=True)
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    view = re.search(r'viewBox="[^"]*"', svg)
    body = svg[svg.index(">") + 1 :]
    body = re.sub(r"<!--.*?-->|<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r'\bid="([^"]+)"', rf'id="{key}-\1"', body)
    body = re.sub(r'href="#', f'href="#{key}-', body).replace("url(#", f"url(#{key}-").replace("xlink:href", "href")
    body = re.sub(r'\b(fill|stroke)="(#[0-9a-fA-F]{6})"', r'style="\1: \2"', body)  # attributes know no variables
    colors = {found.lower() for found in _COLOR.findall(body)}
    body = _COLOR.sub(lambda found: f"var({variable(found[0].lower())}, {found[0].lower()})", body)
    body = "\n".join(line.strip() for line in body.splitlines() if line.strip())
    return f'<svg {view[0] if view else ""} role="img" aria-label="{escape(label)}">\n{body}', colors


def variable(color: str) -> str:
    """Name of the CSS variable that holds a colour of the light page on the dark one."""
    return f"--c{color[1:]}"


def dark(color: str) -> str:
    """The colour on a dark page: of the same hue, with its lightness turned over."""
    red, green, blue = (int(color[k : k + 2], 16) / 255 for k in (1, 3, 5))
    hue, lightness, saturation = colorsys.rgb_to_hls(red, green, blue)
    turned = colorsys.hls_to_rgb(hue, _LIGHTEST - (_LIGHTEST - _DARKEST) * lightness, saturation)
    return "#" + "".join(f"{round(255 * part):02x}" for part in turned)
