"""A branch as one page to explore: the diagram, and for the state under the pointer its meridian, surface, modes, verdicts and zones.

The page needs no network. Plotly, which draws it, is part of the page, packed. What is shown comes from :mod:`.explorer_data`, how it looks
from ``explorer.html``, and what moves from ``explorer.js``.
"""

from __future__ import annotations

import base64
import gzip
import json
import re
from collections.abc import Mapping
from functools import cache
from html import escape
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..files import replace_file
from .explorer_data import page_data
from .style import STYLE

if TYPE_CHECKING:
    from ..results.branch import Branch

_HERE = Path(__file__).parent
_MARK = re.compile(r"\{\{(\w+)\}\}")


def write_explorer(branch: Branch, path: str | PathLike[str], *, units: str = "scaled") -> None:
    """Write the page of a branch; see :meth:`.Branch.explore`.

    Raises
    ------
    InputError
        For an empty branch, a file that cannot be written, SI units of a scene without scales, and where Plotly is not installed.
    """
    page = explorer(branch, units)
    with replace_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8", errors="backslashreplace")


def explorer(branch: Branch, units: str = "scaled") -> str:
    """The page as text; see :func:`write_explorer`."""
    check_explorer()
    if not len(branch):
        raise InputError("branch", "no equilibria", "a branch with one or more equilibria is needed")
    return page_of(page_data(branch, units))


def page_of(data: Mapping[str, Any], *, live: str = "", script: str = "") -> str:
    """The page that shows what :func:`~femmembrane.views.explorer_data.page_data` answers, with further controls and their script."""
    parts = {
        "title": escape(str(data["title"])),
        "style": STYLE,
        "live": live,
        "data": as_json(data),
        "library": _library(),
        "script": _text("explorer.js") + script,
    }
    return _MARK.sub(lambda mark: parts[mark[1]], _text("explorer.html"))


def live_page(data: Mapping[str, Any]) -> str:
    """The page whose branch is computed anew while its sliders are moved; ``data["live"]`` has the sliders, a server the answers."""
    return page_of(
        data, live='<section class="live" id="live" aria-label="numbers of the scene"></section>', script=_text("explorer_live.js")
    )


def as_json(data: Any) -> str:
    """JSON that may stand inside an element of a page, whatever texts are in it."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def framed(branch: Branch, still: str) -> str:
    """The page in a frame of a notebook, behind a still picture that it replaces where scripts run; without Plotly the picture alone."""
    if find_spec("plotly") is None:
        return still
    look = "width:100%;height:0;border:0"
    return f'<div>{still}</div><iframe data-femmembrane="explorer" style="{look}" srcdoc="{escape(explorer(branch))}"></iframe>'


def check_explorer() -> Path:
    """The script of the library that draws the page. Raise InputError where it is not installed: before anything is computed."""
    found = find_spec("plotly")
    if found is None or found.origin is None:
        raise InputError("explore", "a page", 'Plotly draws it, which is not installed: pip install "femmembrane[explore]"')
    return Path(found.origin).parent / "package_data" / "plotly.min.js"


def _text(name: str) -> str:
    return (_HERE / name).read_text(encoding="utf-8")


@cache
def _library() -> str:
    """Plotly's script, packed, as text."""
    return base64.b64encode(gzip.compress(check_explorer().read_bytes(), 9, mtime=0)).decode("ascii")
