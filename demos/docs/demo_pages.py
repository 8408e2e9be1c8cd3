"""Demos as pages: copies of the scripts whose docstrings are reStructuredText with a title, and the pictures that they leave."""

from __future__ import annotations

import ast
import os
import re
import shutil
from collections.abc import Collection
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
DEMOS = ROOT / "demos"
OUT = ROOT / "out" / "docs-demos"
FOLDERS = {"demos": DEMOS, "paper": DEMOS / "paper"}
#: what is run for a quick build
QUICK = ("convergence.py", "materials.py", "figure_7.py")
#: studies of ten minutes that start processes of their own: no build runs them
STUDIES = ("fit_coverage.py",)
HEADERS = {"demos": ("Scripts", "Each script prints a table and leaves pictures."), "paper": ("Figures of the paper", "Scripts for each.")}
#: the number of pictures of one page
MOST = 12


def scripts(folder: str) -> list[Path]:
    return sorted(FOLDERS[folder].glob("*.py"))


def pattern(names: Collection[str] | None) -> str:
    """What sphinx-gallery finds in the paths of scripts that it runs: those of these names, or all but the studies."""
    if names is None:
        return rf"^(?!.*({'|'.join(map(re.escape, STUDIES))})$).*\.py$"
    return "|".join(rf"[\\/]{re.escape(name)}$" for name in names)


def title_of(docstring: str) -> str:
    """The first sentence, up to a colon."""
    text = " ".join(docstring.strip().split("\n\n")[0].split())
    return re.split(r"(?<=\?)|:\s|\.\s|\.$", text)[0]


def restructured(text: str) -> str:
    """Plain text with indented lines as they stand, in reStructuredText."""
    parts = []
    for part in text.strip("\n").split("\n\n"):
        indented = part.startswith("    ")
        parts.append(".. code-block:: text\n\n" + part if indented else re.sub(r"([*`|_\\])", r"\\\1", part))
    return "\n\n".join(parts)


def stored_picture(script: Path) -> Path | None:
    names = (script.stem, script.stem.replace("_", "-"))
    return next((path for name in names if (path := DEMOS / "pictures" / f"{name}.png").exists()), None)


def stage(here: Path, running: str) -> None:
    """Copies of all scripts for sphinx-gallery; of those that are not run, with their stored pictures."""
    for folder in FOLDERS:
        copies = here / "generated" / "scripts" / folder
        shutil.rmtree(copies, ignore_errors=True)
        copies.mkdir(parents=True)
        heading, words = HEADERS[folder]
        (copies / "GALLERY_HEADER.rst").write_text(f"{heading}\n{'=' * len(heading)}\n\n{words}\n", encoding="utf-8")
        for beside in FOLDERS[folder].iterdir():  # what a script reads
            if beside.suffix in (".toml", ".csv"):
                shutil.copyfile(beside, copies / beside.name)
        for script in scripts(folder):
            run = re.search(running, str(copies / script.name)) is not None
            pages = here / "generated" / folder
            (copies / script.name).write_text(staged(script, pages, run), encoding="utf-8")


def staged(script: Path, pages: Path, run: bool) -> str:
    text = script.read_text(encoding="utf-8")
    tree = ast.parse(text)
    docstring = ast.get_docstring(tree)
    if docstring is None:
        raise ValueError(f"{script}: a demo says in its docstring what it shows")
    title = title_of(docstring)
    text_below = docstring.removeprefix(title).lstrip(".")  # a first line that is the title is not said twice
    parts = [title, "=" * len(title), "", restructured(docstring if text_below[:1] not in ("", "\n") else text_below)]
    picture, end = stored_picture(script), ""
    if picture is not None:
        path = os.path.relpath(picture, pages.parents[1]).replace(os.sep, "/")
        end = f"\n# sphinx_gallery_thumbnail_path = {path!r}\n"
        if not run:
            shown = os.path.relpath(picture, pages).replace(os.sep, "/")
            parts += [
                "",
                f".. figure:: {shown}",
                "   :alt: what the script draws",
                "",
                "   A stored picture: this build did not run the script.",
            ]
    lines = text.splitlines(keepends=True)[tree.body[0].end_lineno :]
    return 'r"""\n' + "\n".join(parts) + '\n"""\n' + "".join(lines) + end


def folder_of(script: str) -> Path:
    path = Path(script)
    return OUT / path.parent.name / path.stem


def arguments(gallery_conf: dict[str, Any], script_vars: dict[str, Any]) -> list[str]:
    """Every demo writes into a folder of its own. sphinx-gallery asks before it runs a script, which is to know its own name and words."""
    script = Path(script_vars["src_file"])
    docstring = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8")))
    script_vars["example_globals"].update(__file__=str(script), __doc__=docstring)
    out = folder_of(script_vars["src_file"])
    shutil.rmtree(out, ignore_errors=True)
    return ["--out", str(out)]


def pictures(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """The PNG and GIF files that a demo has left, as sphinx-gallery shows them."""
    from sphinx_gallery.scrapers import figure_rst

    shown = []
    found = sorted(path for path in folder_of(block_vars["src_file"]).rglob("*") if path.suffix in (".png", ".gif"))
    for path, place in zip(found[:MOST], block_vars["image_path_iterator"], strict=False):
        name = Path(place).with_suffix(path.suffix)
        shutil.copyfile(path, name)
        shown.append((str(name), path.stem.replace("_", " ").replace("-", " ")))
    return "".join(figure_rst([name], gallery_conf["src_dir"], words) for name, words in shown)
