"""The notebooks of the demos run from their first cell to their last, and every value that a cell ends in is shown."""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).parent.parent / "demos" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def run_cell(source: str, names: dict[str, Any]) -> Any:
    """Run a cell as a notebook does: its value is that of its last line, if that is an expression."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names) if isinstance(last, ast.Expr) else None


def shown(value: Any) -> str | bytes:
    """What a notebook shows of a value."""
    for way in ("_repr_html_", "_repr_png_"):
        if hasattr(value, way):
            return getattr(value, way)()
    return repr(value)


def test_there_are_three() -> None:
    assert [notebook.stem for notebook in NOTEBOOKS] == ["bulge-test", "first-run", "magnet"]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda notebook: notebook.stem)
def test_notebook(notebook: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    content = json.loads(notebook.read_text(encoding="utf-8"))
    assert content["nbformat"] == 4
    names: dict[str, Any] = {"__name__": "__main__"}
    for cell in content["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []  # stored without outputs: they are made by whoever runs it
            value = run_cell("".join(cell["source"]), names)
            if value is not None:
                seen = shown(value)
                assert seen.startswith(b"\x89PNG") if isinstance(seen, bytes) else "object at 0x" not in seen[:2000]
                assert not isinstance(seen, str) or "<" in seen
