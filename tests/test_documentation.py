"""The documentation: its examples print what they say, it builds without a warning, nothing is missing in it, and browsers show it.

Where sphinx is not installed (``pip install -e ".[docs]"``) only the examples are tested. ``FEMMEMBRANE_DOCS`` names a folder that is built
already.
"""

from __future__ import annotations

import doctest
import functools
import http.server
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import threading
import zlib
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest

import femmembrane as fm

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "demos" / "docs"
EXAMPLES = sorted((DOCS / "howto").glob("*.md"))
SCRIPTS = {"demos": sorted((ROOT / "demos").glob("*.py")), "paper": sorted((ROOT / "demos" / "paper").glob("*.py"))}
BROWSER = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None)
MISSING = [name for name in ("sphinx", "sphinx_gallery", "myst_parser", "furo") if importlib.util.find_spec(name) is None]


@pytest.mark.parametrize("page", EXAMPLES, ids=lambda path: path.stem)
def test_examples(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the order of the page, beside its scene file; each page computes something."""
    text = page.read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    for scene in re.findall(r"```toml\n(.*?)```", text, re.DOTALL):
        Path(f"{page.stem}.toml").write_text(scene, encoding="utf-8")
    code = "\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL))
    examples = doctest.DocTestParser().get_doctest(code, {}, page.stem, str(page), 0)
    report: list[str] = []
    found = doctest.DocTestRunner(verbose=False).run(examples, out=report.append)
    assert found.failed == 0, "".join(report)
    assert found.attempted >= 4
    assert code.count(">>> ") >= found.attempted  # no line of code escapes


class Page(HTMLParser):
    """The places that a page has, where its links lead, and what it loads."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.places: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        for name, value in attributes:
            if name == "id" and value:
                self.places.add(value)
            elif name == "href" and value and tag == "a":
                self.links.append(value)
            elif name in ("href", "src") and value:
                self.loaded.append(value)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if MISSING:
        pytest.skip(f"not installed: {', '.join(MISSING)}")
    if "FEMMEMBRANE_DOCS" in os.environ:
        return ROOT / os.environ["FEMMEMBRANE_DOCS"]
    folder = tmp_path_factory.mktemp("documentation") / "html"
    command = (sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-t", "quick", "-b", "html", str(DOCS), str(folder))
    done = subprocess.run(command, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-5000:]
    return folder


@pytest.fixture(scope="module")
def pages(built: Path) -> dict[Path, Page]:
    return {path.resolve(): Page(path.read_text(encoding="utf-8")) for path in built.rglob("*.html") if "_static" not in path.parts}


def test_every_public_name_has_its_place(built: Path) -> None:
    head, _, packed = (built / "objects.inv").read_bytes().partition(b"zlib.\n")
    assert b"femmembrane" in head
    entries = [line.split(" ") for line in zlib.decompress(packed).decode().splitlines()]
    described = {name for name, kind, *_ in entries if kind in ("py:class", "py:function", "py:exception", "py:data")}
    assert {f"femmembrane.{name}" for name in fm.__all__} - described == set()


@pytest.mark.parametrize(("folder", "script"), [(folder, path) for folder, paths in SCRIPTS.items() for path in paths], ids=str)
def test_every_demo_has_its_page(built: Path, folder: str, script: Path) -> None:
    """With its code, and the picture that is stored of it; of those that a quick build runs, with what they print."""
    text = (built / "generated" / folder / f"{script.stem}.html").read_text(encoding="utf-8")
    assert text.count('<div class="highlight-Python') == 1
    stored = [ROOT / "demos" / "pictures" / f"{name}.png" for name in (script.stem, script.stem.replace("_", "-"))]
    if any(path.exists() for path in stored):
        assert re.search(r'<img [^>]*src="[^"]*_images/[^"]*\.png"', text)
    if script.name in ("convergence.py", "materials.py", "figure_7.py"):
        assert "sphx-glr-script-out" in text


def test_every_scene_file_is_shown(built: Path) -> None:
    text = (built / "generated" / "scenes.html").read_text(encoding="utf-8")
    assert [path.name for path in (ROOT / "demos").glob("*.toml") if f'id="scene-{path.stem}"' not in text] == []


def test_every_notebook_is_shown(built: Path) -> None:
    text = (built / "generated" / "notebooks.html").read_text(encoding="utf-8")
    assert [path.name for path in (ROOT / "demos" / "notebooks").glob("*.ipynb") if f">{path.name}<" not in text] == []
    outputs = text.split('<div class="output">')[1:]  # each has run for this page
    assert len(outputs) >= 6
    assert sum("<img" in output for output in outputs) >= 3
    assert sum("<table" in output for output in outputs) >= 3


def test_every_page_of_the_repository_is_shown() -> None:
    """Whoever writes a page in Markdown gives it a place in the documentation."""
    shown = [
        (page.parent / target).resolve()
        for page in DOCS.rglob("*.md")
        for target in re.findall(r"```\{include\} (\S+)", page.read_text(encoding="utf-8"))
    ]
    written = [ROOT / "README.md", *(page for top in ("femmembrane", "demos", "meshes", "tests") for page in (ROOT / top).rglob("*.md"))]
    assert [page for page in written if page not in shown and DOCS not in page.parents] == []


def test_links_lead_somewhere(pages: dict[Path, Page]) -> None:
    """To a file that is there, and to a place in it; nothing is loaded from a network."""
    assert len(pages) > 50
    for path, page in pages.items():
        for target in (*page.links, *page.loaded):
            if target.startswith("data:"):  # pictures in the page itself
                continue
            if "://" in target or target.startswith("mailto:"):
                assert target not in page.loaded, (path, target)
                continue
            place, _, anchor = unquote(target).partition("#")
            found = (path.parent / place.partition("?")[0]).resolve() if place else path
            found = found / "index.html" if found.is_dir() else found
            assert found.exists(), (path, target)
            assert not anchor or found not in pages or anchor in pages[found].places, (path, target)


def test_equations_need_no_script(built: Path) -> None:
    text = (built / "theory.html").read_text(encoding="utf-8")
    assert text.count("<math") > 40
    assert text.count('display="block"') >= 7
    assert "$" not in re.sub(r"<(script|style).*?</\1>", "", text, flags=re.DOTALL)


@pytest.fixture
def address(built: Path) -> Iterator[str]:
    """The documentation as a site on this machine."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_: object) -> None:
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(built))) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


#: opens page after page in one frame, and writes down what each shows
PROBE = """<!DOCTYPE html><html><head><meta charset="utf-8"><link rel="icon" href="data:,"></head><body><pre id="found"></pre>
<iframe style="width: 1200px; height: 800px"></iframe><script>
const pages = %s, frame = document.querySelector("iframe"), found = [];
function next() {
  if (found.length === pages.length) { document.getElementById("found").textContent = "done " + found.join(" "); return; }
  frame.onload = () => {
    const shown = frame.contentDocument, broken = [...shown.images].filter(image => image.complete && !image.naturalWidth).length;
    found.push(shown.querySelector("h1") || shown.querySelector("#search-results") ? broken : "empty");
    next();
  };
  frame.src = pages[found.length];
}
next();
</script></body></html>"""


@pytest.mark.skipif(BROWSER is None, reason="no browser here (Debian: apt-get install chromium): how the pages look is not tested")
def test_every_page_opens_in_a_browser(built: Path, pages: dict[Path, Page], address: str, tmp_path: Path) -> None:
    """With a title, with all its pictures, and without a word in the console."""
    names = sorted(path.relative_to(built.resolve()).as_posix() for path in pages)
    probe = built / "probe.html"
    probe.write_text(PROBE % names, encoding="utf-8")
    quiet = ("--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-quic")
    options = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", *quiet, f"--user-data-dir={tmp_path / 'profile'}")
    options += ("--enable-logging=stderr", "--virtual-time-budget=600000", "--dump-dom")
    try:
        done = subprocess.run([str(BROWSER), *options, f"{address}/probe.html"], capture_output=True, text=True, timeout=240, check=True)
    finally:
        probe.unlink()
    assert [line for line in done.stderr.splitlines() if ":CONSOLE" in line] == []
    found = re.search(r'<pre id="found">done ([^<]*)</pre>', done.stdout)
    assert found, done.stdout[:2000]
    assert dict(zip(names, found[1].split(), strict=True)) == dict.fromkeys(names, "0")
