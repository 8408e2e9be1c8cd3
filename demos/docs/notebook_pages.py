"""Notebooks as a page: words, code, and what each cell shows when it is run, which happens anew at every build."""

from __future__ import annotations

import ast
import base64
import io
import json
import os
import re
import tempfile
from contextlib import chdir, redirect_stdout
from pathlib import Path
from typing import Any

import demo_pages
from demo_pages import DEMOS

NOTEBOOKS = DEMOS / "notebooks"
#: what takes the place of a still picture in Jupyter: several megabytes each
FRAME = re.compile(r"<iframe .*?</iframe>", re.DOTALL)


def page(here: Path) -> str:
    """The text of the page that shows all notebooks, each with the file to open."""
    parts = [
        "Notebooks",
        "=========",
        "",
        "Here they are as they have run; in Jupyter a view to click through takes the place of a branch's picture.",
        "",
    ]
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        file = os.path.relpath(path, here / "generated").replace(os.sep, "/")
        parts += [path.name, "-" * len(path.name), "", f":download:`{path.name} <{file}>`", "", *shown(path)]
    return "\n".join(parts)


def shown(path: Path) -> list[str]:
    """The cells of a notebook, in reStructuredText."""
    parts: list[str] = []
    names: dict[str, Any] = {"__name__": "__main__"}
    with tempfile.TemporaryDirectory() as folder, chdir(folder):  # some cells write files
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
            text = "".join(cell["source"])
            if cell["cell_type"] != "code":
                parts += [demo_pages.restructured(re.sub(r"^#+ ", "", text, flags=re.MULTILINE)), ""]
                continue
            printed, value = run(text, names)
            parts += [*block("code-block:: python", text), *(block("code-block:: text", printed) if printed.strip() else [])]
            if value is not None:
                parts += output(value)
    return parts


def run(source: str, names: dict[str, Any]) -> tuple[str, Any]:
    """Run a cell: what it prints, and the value of its last line, if that is an expression."""
    tree, printed, value = ast.parse(source), io.StringIO(), None
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    with redirect_stdout(printed):
        exec(compile(tree, "cell", "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    return printed.getvalue(), value


def output(value: Any) -> list[str]:
    """What a notebook shows of a value: a page, a picture, or text."""
    for way in ("_repr_html_", "_repr_png_"):
        found = getattr(value, way, lambda: None)()
        if isinstance(found, str):
            found = FRAME.sub("", found)
        if isinstance(found, bytes):
            found = f'<img alt="what the cell draws" src="data:image/png;base64,{base64.b64encode(found).decode()}"/>'
        if found:
            return block("raw:: html", f'<div class="output">\n{found}\n</div>')
    return block("code-block:: text", repr(value))


def block(directive: str, text: str) -> list[str]:
    return [f".. {directive}", "", *(f"    {line}" for line in text.splitlines()), ""]
