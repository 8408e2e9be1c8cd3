"""All figures of the paper on one page, its numbers beside ours.

Runs figure_3.py to figure_10.py, whose checks stop it if a number is not what they say, and writes one self-contained HTML page with all
pictures and tables, to be opened in any browser. With --readme the short table between the markers of a Markdown file is rewritten.

    python demos/paper/gallery.py --out out/gallery         index.html, and the pictures and tables of each figure; 40 seconds
"""

from __future__ import annotations

import argparse
import base64
import sys
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from types import ModuleType

import figure_3
import figure_4
import figure_5
import figure_6
import figure_7
import figure_8
import figure_9
import figure_10
import paper
from paper import HEADER, Result, Row

from femmembrane.files import replace_file

FIGURES = {3: figure_3, 4: figure_4, 5: figure_5, 6: figure_6, 7: figure_7, 8: figure_8, 9: figure_9, 10: figure_10}
#: what the short table stands between
MARKERS = ("<!-- gallery: python demos/paper/gallery.py --readme demos/paper/README.md -->", "<!-- end of gallery -->")
STYLE = """
body { font: 16px/1.5 sans-serif; max-width: 62em; margin: 2em auto; padding: 0 1em; color: #222 }
img { max-width: 100%; display: block; margin: 1em 0 }
h2 { border-top: 1px solid #bbb; padding-top: 1em; margin-top: 2em }
table { border-collapse: collapse; font-size: 14px; margin: 1em 0 }
td, th { padding: 0.15em 0.8em; border-bottom: 1px solid #ddd; text-align: right }
td:nth-child(1), td:nth-child(2), th:nth-child(1), th:nth-child(2) { text-align: left }
pre { background: #f4f4f4; padding: 0.2em 0.5em; overflow-x: auto }
"""
INTRODUCTION = """
<p>Figures 3 to 10 of P. Saxena, N. H. Reddy and S. P. Pradhan, <i>Magnetoelastic deformation of a circular membrane: wrinkling and limit
point instabilities</i>, Int. J. Non-Linear Mech. 116 (2019), computed with femmembrane. The tables have the numbers that the paper prints
and its statements beside ours, and, in the last column, what its equations (60) give when they are taken as they are printed (figure 6
explains). In words on stability, "at held V only" is stable among axisymmetric shapes if the volume is held and not if the pressure is;
"tips" is unstable to 1, 2 or 3 waves around the axis; "decided" is what the paper leaves open.</p>
"""


def short(rows: Iterable[Row]) -> str:
    """The rows of demos/paper/README.md as a Markdown table."""
    lines = [f"| {' | '.join(HEADER)} |", "|---|---|---:|---:|---:|---:|"]
    return "\n".join([*lines, *(f"| {' | '.join(row.cells())} |" for row in rows if row.shown)])


def rewrite(path: Path, table: str) -> None:
    """Put the table between the markers of a file."""
    text = path.read_text(encoding="utf-8")
    before, rest = text.split(MARKERS[0])
    after = rest.split(MARKERS[1])[1]
    with replace_file(path) as temporary:
        temporary.write_text(f"{before}{MARKERS[0]}\n{table}\n{MARKERS[1]}{after}", encoding="utf-8")


def html_table(rows: Iterable[Row]) -> str:
    def line(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    return "<table>" + "\n".join([line(HEADER, "th"), *(line(row.cells(), "td") for row in rows)]) + "</table>"


def section(number: int, module: ModuleType, result: Result) -> str:
    """The text of a script, its pictures and its table."""
    title, *paragraphs = (module.__doc__ or "").strip().split("\n\n")
    parts = [f'<h2 id="figure-{number}">{escape(title)}</h2>']
    for text in paragraphs:
        parts.append(f"<pre>{escape(text.strip())}</pre>" if text.startswith("    ") else f"<p>{escape(text)}</p>")
    for picture in result.pictures:
        data = base64.b64encode(picture.read_bytes()).decode()
        parts.append(f'<img alt="{escape(picture.stem)}" src="data:image/png;base64,{data}">')
    return "\n".join([*parts, html_table(result.rows)])


def page(results: dict[int, Result]) -> str:
    links = " ".join(f'<a href="#figure-{n}">{n}</a>' for n in results)
    rows = [row for result in results.values() for row in result.rows]
    head = f"<head><meta charset='utf-8'><title>The paper's figures</title><style>{STYLE}</style></head>"
    top = f"<h1>The paper's figures</h1>{INTRODUCTION}<p>Figures {links}</p>{html_table(row for row in rows if row.shown)}"
    sections = "\n".join(section(n, FIGURES[n], result) for n, result in results.items())
    return f"<!DOCTYPE html><html lang='en'>{head}<body>{top}\n{sections}</body></html>\n"


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/gallery"), help="folder for the page, pictures and tables")
    parser.add_argument("--readme", type=Path, help="a Markdown file whose short table is to be rewritten")
    asked = parser.parse_args(arguments)
    results = {}
    for number, module in FIGURES.items():
        folder = asked.out / f"figure-{number}"
        folder.mkdir(parents=True, exist_ok=True)
        results[number] = module.make(folder)
    rows = [row for result in results.values() for row in result.rows]
    with replace_file(asked.out / "index.html") as temporary:
        temporary.write_text(page(results), encoding="utf-8")
    if asked.readme:
        rewrite(asked.readme, short(rows))
    paper.show(rows)


if __name__ == "__main__":
    main(sys.argv[1:])
