"""The page of a run: well formed, on its own, with what the run has and nothing else; and in a real browser, on a phone's width too."""

from __future__ import annotations

import dataclasses
import json
import re
import shutil
import subprocess
from collections.abc import Callable
from functools import cache
from html import escape
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.cli import main
from femmembrane.views import svg
from femmembrane.views.report import _smooth, report
from tests.cases import disc_scene

BROWSER = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None)
EVERYTHING = fm.Analysis(("pressure", "volume"), (1,), "total", True)


@cache
def plain() -> fm.Branch:
    return fm.inflate(disc_scene(elements=8), volumes=[1.0, 2.0])


@cache
def full() -> fm.Branch:
    """Verdicts, special points, zones, error estimates, a source, and a title that has to be escaped."""
    scene = disc_scene(dipole=(150, 4.5), elements=8).replace(analysis=EVERYTHING, title="P < 2 & <b>V</b> \"'")
    return fm.trace(scene, start=0.5, until={"center_height": 2.5})


@cache
def page_of(branch: Callable[[], fm.Branch]) -> str:
    return report(branch(), {"command": "femmembrane " + 30 * "x/", "versions": {"numpy": "2.0"}} if branch is full else None)


class Page(HTMLParser):
    """What is in a page; raises where a tag is not closed, or closed that was not open."""

    ALONE = ("meta", "link", "br", "img", "input", "hr")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.references: list[str] = []
        self.count: dict[str, int] = {}
        self.text = ""
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_startendtag(tag, attrs)
        if tag not in self.ALONE:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert len(dict(attrs)) == len(attrs), f"an attribute of {tag} is given twice"
        self.count[tag] = self.count.get(tag, 0) + 1
        given = dict(attrs)
        self.ids += [given["id"]] if given.get("id") else []
        self.references += [given[name] or "" for name in ("href", "src") if name in given]
        self.references += re.findall(r"url\(([^)]*)\)", given.get("style") or "")
        self.references += re.findall(r"url\(([^)]*)\)", given.get("clip-path") or "")

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"{tag} closed, not open"
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data if self.open[-1:] != ["style"] else ""


@pytest.mark.parametrize("branch", [plain, full])
def test_page_is_well_formed_and_alone(branch) -> None:
    text = page_of(branch)
    page = Page(text)
    assert len(set(page.ids)) == len(page.ids)
    for reference in page.references:
        assert reference.startswith("data:") or reference[1:] in page.ids, reference
    assert not re.search(r"https?:|@import|<script|\bon\w+=", text)
    assert page.count["figure"] == page.count["svg"] >= 5


def test_only_what_the_run_has() -> None:
    bare, whole = Page(page_of(plain)), Page(page_of(full))
    shared = {"branch", "shape", "equilibria", "scene", "timings", "how-to-cite"}
    sections = ("verdicts", "zones", "error-estimates", "versions")
    assert shared <= set(bare.ids)
    assert not set(sections) & set(bare.ids)
    assert shared | set(sections) <= set(whole.ids)
    assert "limit point (dP = 0)" in whole.text
    assert "special point" not in bare.text
    assert "total stress" not in bare.text
    assert "P < 2 & <b>V</b> \"'" in whole.text


def test_verdicts_are_those_of_the_branch() -> None:
    """Each stretch of the table is one of the branch: its limit point parts the stable steps from the unstable ones."""
    text = page_of(full)
    words = [e.verdict("pressure").word for e in full()]
    lost = words.index("unstable")
    assert f'<td class="stable">stable</td><td>0 to {lost - 1}</td>' in text
    assert f'<td class="unstable">unstable</td><td>{lost} to ' in text
    assert full()[-1].verdict("volume").reason in Page(text).text


def test_the_same_page_again() -> None:
    assert report(plain()) == page_of(plain)


def test_early_end_says_what_helps() -> None:
    ended = dataclasses.replace(plain(), status=fm.Status.STEP_UNDERFLOW, message="volume 3 was not reached")
    text = Page(report(ended)).text
    assert "volume 3 was not reached" in text
    assert fm.Status.STEP_UNDERFLOW.advice in text
    empty = Page(report(dataclasses.replace(ended, equilibria=())))
    assert "volume 3 was not reached" in empty.text
    assert empty.count.get("figure", 0) == 0
    assert "scene" in empty.ids


def test_command_and_option(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """With the run or after it, the page is the same but for nothing; a run without the option leaves no old page behind."""
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text('[material]\nmodel = "neo-hookean"\n[mesh]\nelements = 8\n[run]\nvalues = [1.0]\n', encoding="utf-8")
    assert main(["run", str(scene), "--out", str(out), "--report"]) == 0
    first = (out / "report.html").read_text(encoding="utf-8")
    assert f"femmembrane run {scene} --out {out}" in Page(first).text
    assert main(["report", str(out), "--out", str(tmp_path / "again.html")]) == 0
    assert (tmp_path / "again.html").read_text(encoding="utf-8") == first
    assert main(["run", str(scene), "--out", str(out)]) == 0
    assert not (out / "report.html").exists()
    assert main(["report", str(out / "branch.nc")]) == 0
    assert "versions" not in Page((out / "report.html").read_text(encoding="utf-8")).ids
    said = capfd.readouterr()
    assert "written:" in said.out
    assert said.err == ""
    assert main(["report", str(scene)]) == 2
    assert main(["report", str(tmp_path)]) == 2


@pytest.mark.parametrize("change", ["mesh.elements=4", "run.values=[1.0, 1.5]", "title='the same'"])
def test_a_branch_of_another_run_is_refused(change: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """The page of a folder tells of one run: its branch.nc and run.json may not be of two, and ``--resume`` does not call them done."""
    scene, out, other = tmp_path / "scene.toml", tmp_path / "out", tmp_path / "other"
    scene.write_text(
        'title = "the same"\n[material]\nmodel = "neo-hookean"\n[mesh]\nelements = 8\n[run]\nvalues = [1.0]\n', encoding="utf-8"
    )
    assert main(["run", str(scene), "--out", str(out)]) == 0
    assert main(["run", str(scene), "--set", change, "--out", str(other)]) == 0
    shutil.copy(other / "branch.nc", out / "branch.nc")
    for words in (["report", str(out)], ["run", str(scene), "--out", str(out), "--resume"]):
        assert main(words) == 2
        said = capfd.readouterr().err
        key = change.partition("=")[0]
        assert (f"{key} is" if key != "title" else "of two runs") in said
    assert not (out / "report.html").exists()
    assert main(["report", str(other)]) == 0
    assert main(["report", str(out / "branch.nc")]) == 0


def test_a_run_without_equilibria_has_a_page(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(
        '[material]\nmodel = "neo-hookean"\n[mesh]\nelements = 8\n[run]\ncontrol = "pressure"\nvalues = [9.0]\n', encoding="utf-8"
    )
    assert main(["run", str(scene), "--out", str(out), "--report"]) == 3
    assert "was not reached" in Page((out / "report.html").read_text(encoding="utf-8")).text
    capfd.readouterr()


def test_dark_colours() -> None:
    """Black and white change places, hue and order stay: blue is blue, and of two greys the darker one becomes the lighter."""
    black, white, blue = (svg.dark(color) for color in ("#000000", "#ffffff", "#0072b2"))
    assert int(black[1:3], 16) > 220
    assert int(white[1:3], 16) < 40
    assert int(blue[5:], 16) > int(blue[1:3], 16) + 80
    assert svg.dark("#404040") > svg.dark("#c0c0c0")


def test_notebook_shows_branch_and_equilibrium() -> None:
    for shown in (plain(), full(), full()[-1], dataclasses.replace(plain(), equilibria=(), message="nothing was reached")):
        page = Page(shown._repr_html_())
        assert all(reference.startswith("data:image/png;base64,") for reference in page.references)
    assert full()[-1].verdict("volume").reason in Page(full()[-1]._repr_html_()).text
    assert "nothing was reached" in page.text


def test_citations(tmp_path: Path) -> None:
    """Only what was used; who solved is kept in the file."""
    keys = {name: set(re.findall(r"@\w+\{(\w+),", text)) for name, text in (("any", fm.cite()), ("minimised", plain().cite()))}
    assert keys["any"] == {"femmembrane", "saxena2019", "skfem2020", "casadi2019"}
    assert keys["minimised"] == keys["any"] | {"ipopt2006"}
    assert "ipopt" not in full().cite()
    assert "ipopt" not in fm.inflate(plain().scene, volumes=[1.0], solver="newton").cite()
    relaxed = fm.inflate(plain().scene.replace(tension_field=True), volumes=[1.0])
    assert "pipkin1986" in relaxed.cite()
    relaxed.save(tmp_path / "b.nc")
    assert fm.load(tmp_path / "b.nc").cite() == relaxed.cite()
    for text in (relaxed.cite(), full().cite()):
        assert text.count("{") == text.count("}")


PROBE = """<!DOCTYPE html><html><head><link rel="icon" href="data:,"></head><body>
<iframe style="width:390px;height:800px;border:0" srcdoc="{page}"></iframe>
<iframe style="width:1200px;height:800px;border:0" srcdoc="{page}"></iframe>
<pre id="found"></pre><script>
addEventListener("load", () => {{
  const look = frame => {{
    const page = frame.contentDocument, root = page.documentElement;
    const inside = part => part.closest(".scroll, pre") !== null;
    page.querySelectorAll("details").forEach(part => part.open = true);
    return {{
      width: root.clientWidth, scroll: Math.max(root.scrollWidth, page.body.scrollWidth),
      wide: [...page.querySelectorAll("body *")].filter(part => !inside(part) && !part.closest("svg"))
        .filter(part => part.getBoundingClientRect().right > root.clientWidth + 1)
        .map(p => p.tagName + "." + p.className),
      figures: [...page.querySelectorAll("figure svg")].map(p => [p.clientWidth, p.clientHeight, p.getBBox().width, p.getBBox().height]),
      ink: frame.contentWindow.getComputedStyle(page.querySelector("figure svg")).fill,
    }};
  }};
  document.getElementById("found").textContent = JSON.stringify([...document.querySelectorAll("iframe")].map(look));
}});
</script></body></html>"""


@pytest.mark.skipif(BROWSER is None, reason="no browser here (Debian: apt-get install chromium): how the page looks is not tested")
def test_in_a_browser(tmp_path: Path) -> None:
    """No errors in the console; on a phone and on a screen figures are drawn and nothing hangs over the edge."""
    page = tmp_path / "probe.html"
    page.write_text(PROBE.format(page=escape(page_of(full))), encoding="utf-8")
    quiet = ("--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync")
    options = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", *quiet, f"--user-data-dir={tmp_path / 'profile'}")
    options += ("--enable-logging=stderr", "--dump-dom")
    done = subprocess.run([str(BROWSER), *options, page.as_uri()], capture_output=True, text=True, timeout=120, check=True)
    assert [line for line in done.stderr.splitlines() if ":CONSOLE" in line] == []
    found = re.search(r'<pre id="found">(.+?)</pre>', done.stdout)
    assert found, done.stdout[-2000:]
    for width, seen in zip((390, 1200), json.loads(found[1].replace("&lt;", "<").replace("&amp;", "&")), strict=True):
        assert width - 20 <= seen["width"] <= width
        assert (seen["scroll"], seen["wide"]) == (seen["width"], [])
        assert len(seen["figures"]) >= 7
        assert all(w > 300 and h > 200 and min(drawn) > 100 for w, h, *drawn in seen["figures"])
        assert all(w <= width for w, *_ in seen["figures"])


def test_curves_over_steps_go_through_the_values_without_corners() -> None:
    """A parabola through four of its values is the parabola; what is positive stays positive; gaps stay gaps."""
    steps = np.arange(5, 9)
    fine, curve = _smooth(steps, (steps - 6.2) ** 2 - 1.0)
    np.testing.assert_allclose(curve, (fine - 6.2) ** 2 - 1.0, atol=1e-12)
    assert len(fine) == 25
    _, steep = _smooth(steps, np.array([1.0, 1e-6, 1e-6, 1.0]))
    assert steep.min() > 0
    gaps = np.array([1.0, np.nan, 2.0, 3.0])
    np.testing.assert_array_equal(_smooth(steps, gaps)[1], gaps)
