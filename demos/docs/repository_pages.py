"""What is shown as it stands in the repository: pages in Markdown, scene files, and the public names."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import demo_pages
import drawings
import notebook_pages
from demo_pages import DEMOS, ROOT
from notebook_pages import NOTEBOOKS
from sphinx.application import Sphinx
from sphinx.config import Config

HERE = Path(__file__).parent
#: a page that stands elsewhere in the repository, in the words of MyST; options are read here
INCLUDE = re.compile(r"```\{include\} (\S+)\n((?::.*\n)*)```\n?")
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")


def write(path: Path, text: str) -> None:
    """Leaves a file alone that is the same, so that its page need not be read again."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def generate(app: Sphinx, config: Config) -> None:
    here = Path(app.srcdir)
    demo_pages.stage(here, config.sphinx_gallery_conf["filename_pattern"])
    drawings.draw(here / "generated" / "drawings")
    write(here / "generated" / "scenes.rst", scenes(here))
    write(here / "generated" / "notebooks.rst", notebook_pages.page(here))
    for name, text in reference():
        write(here / "generated" / "reference" / f"{name}.rst", text)


# --- scene files


def scenes(here: Path) -> str:
    parts = ["Scene files", "===========", "", "Each is computed by ``femmembrane run``, as :doc:`/demos` says.", ""]
    for path in sorted(DEMOS.glob("*.toml")):
        title = tomllib.loads(path.read_text(encoding="utf-8"))["title"]
        parts += ["", f".. _scene-{path.stem}:", "", path.name, "-" * len(path.name), "", title.replace("*", r"\*") + ".", ""]
        if (DEMOS / "pictures" / f"{path.stem}.png").exists():
            parts += [f".. image:: {relative(DEMOS / 'pictures' / f'{path.stem}.png', here / 'generated')}", "   :alt: " + title, ""]
        parts += [f".. literalinclude:: {relative(path, here / 'generated')}", "   :language: toml", ""]
    return "\n".join(parts)


# --- public names

#: page, title, and the modules whose names it has; what no line claims stands on the last page
GROUPS = (
    ("verbs", "Verbs", r"verbs(?!\.fit)\b|results\.store"),
    ("scene", "Scenes, runs and controls", r"scene\b|solve\b|physics\.(chamber|electric|scales)"),
    ("shapes", "Shapes and mesh files", r"discretization\b"),
    ("materials", "Materials", r"physics\.(hooke|invariants?|materials|named|elastic\w*)\b|potential\b"),
    ("sources", "Magnetic sources", r"physics\.(magnetics|magnets|mixture|sources|tabulated)\b"),
    ("loads", "Loads and obstacles", r"physics\.(loads|obstacles)\b"),
    ("fits", "Fits to measurements", r"calibration\b|(verbs|results)\.fit\b"),
    ("results", "Results", r"results\b"),
    ("stability", "Tests of stability", r"stability\b"),
    ("views", "Pictures and files", r"views\b"),
    ("errors", "Errors", r"errors\b"),
)
OTHER = ("other", "Further names")


def public_names() -> Iterator[tuple[str, str]]:
    """Module and name of each line of the list of public names."""
    text = (ROOT / "femmembrane" / "__init__.pyi").read_text(encoding="utf-8")
    yield from re.findall(r"^from \.([\w.]+) import (\w+) as \2$", text, re.MULTILINE)


def reference() -> Iterator[tuple[str, str]]:
    import femmembrane

    groups: dict[str, list[str]] = {}
    for module, name in public_names():
        group = next((page for page, _, modules in GROUPS if re.match(modules, module)), OTHER[0])
        groups.setdefault(group, []).append(name)
    titles = {page: title for page, title, _ in GROUPS} | dict([OTHER])
    pages = [page for page in titles if page in groups]
    for page in pages:
        title = titles[page]
        parts = [title, "=" * len(title), "", ".. currentmodule:: femmembrane", ""]
        classes = [name for name in groups[page] if isinstance(getattr(femmembrane, name), type)]
        functions = [name for name in groups[page] if name not in classes]
        for name in functions:
            parts += [f".. autofunction:: {name}", ""]
        for name in classes:
            parts += [f".. autoclass:: {name}", "   :members:", ""]
        yield page, "\n".join(parts)
    title = "Public names"
    words = "Every name of ``import femmembrane as fm``, with its arguments, its errors and examples, which the tests run."
    parts = [title, "=" * len(title), "", words, "", ".. toctree::", "   :maxdepth: 1", "", *(f"   {page}" for page in pages), ""]
    parts += [".. py:module:: femmembrane", "", ".. py:data:: __version__", "", "   The version of the package.", ""]
    yield "index", "\n".join(parts)


def escape(app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Bars in the text of a docstring are absolute values."""
    lines[:] = [line if line.lstrip().startswith((">>>", "...")) else bars(line) for line in lines]


def bars(line: str) -> str:
    parts = line.split("``")
    return "``".join(part if k % 2 else part.replace("|", r"\|") for k, part in enumerate(parts))


# --- pages in Markdown


def relative(path: Path, folder: Path) -> str:
    return os.path.relpath(path, folder).replace(os.sep, "/")


def included() -> dict[Path, Path]:
    """Pages elsewhere in the repository, by the page here that shows the whole of each."""
    found = {}
    for page in HERE.rglob("*.md"):
        for target, options in INCLUDE.findall(page.read_text(encoding="utf-8")):
            if not options:
                found[(page.parent / target).resolve()] = page
    return found


def include(app: Sphinx, docname: str, source: list[str]) -> None:
    """Puts the text of an included page in its place, and has links lead to where the documentation shows what they name."""
    page = Path(app.env.doc2path(docname))
    if page.suffix != ".md":
        return
    pages = included()

    def text_of(match: re.Match[str]) -> str:
        path = (page.parent / match[1]).resolve()
        app.env.note_dependency(str(path))
        text = path.read_text(encoding="utf-8")
        options = dict(re.findall(r":([\w-]+): (.*)", match[2]))
        if "start-after" in options:
            text = text.split(options["start-after"] + "\n", 1)[1]
        if "end-before" in options:
            text = text.split("\n" + options["end-before"], 1)[0]
        return adapted(text, path, page.parent, pages)

    # links of the pages here lead to the pages of the repository, as whoever reads them there needs it
    source[0] = INCLUDE.sub(text_of, adapted(source[0], page, page.parent, pages))


def adapted(text: str, page: Path, folder: Path, pages: dict[Path, Path]) -> str:
    """The text of a page of the repository, as a page in a folder of the documentation. Code stays as it is."""
    parts = re.split(r"(^```.*?^```$)", text, flags=re.MULTILINE | re.DOTALL)
    return "".join(part if k % 2 else linked(part, page, folder, pages) for k, part in enumerate(parts))


def linked(text: str, page: Path, folder: Path, pages: dict[Path, Path]) -> str:
    def link(match: re.Match[str]) -> str:
        picture, words, target = match.groups()
        if "://" in target or target.startswith("#"):
            return match[0]
        path, _, anchor = target.partition("#")
        found = (page.parent / path).resolve()
        place = relative(pages.get(found) or demo_page(found) or found, folder)
        return f"{picture}[{words}]({place}{'#' + anchor if anchor else ''})"

    text = LINK.sub(link, text)
    text = re.sub(r"(?<!\[)`((?:[\w-]+/)*[\w-]+\.(?:py|toml))`", named(lambda name: f"`{name}`", page, folder), text)
    return re.sub(r"(?<=\| )((?:paper/)?[\w-]+\.(?:py|toml))(?= \|)", named(str, page, folder), text)


def named(words: Callable[[str], str], page: Path, folder: Path) -> Callable[[re.Match[str]], str]:
    """A demo or a scene that a text names, as a link to its page."""

    def link(match: re.Match[str]) -> str:
        found = next((path for top in (ROOT, page.parent, DEMOS) if (path := (top / match[1]).resolve()).exists()), None)
        if found is not None and found.parent == DEMOS and found.suffix == ".toml":
            return f"[{words(match[1])}](#scene-{found.stem})"
        place = found and demo_page(found)
        return f"[{words(match[1])}]({relative(place, folder)})" if place else match[0]

    return link


def demo_page(path: Path) -> Path | None:
    """The page of a script, or of the folder of notebooks."""
    if path == NOTEBOOKS:
        return HERE / "generated" / "notebooks.rst"
    folder = next((name for name, top in demo_pages.FOLDERS.items() if path.parent == top and path.suffix == ".py"), None)
    return HERE / "generated" / folder / f"{path.stem}.rst" if folder else None
