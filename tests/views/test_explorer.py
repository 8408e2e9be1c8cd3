"""The page on which a branch is explored: its data without a browser, its pictures and clicks in one."""

from __future__ import annotations

import base64
import gzip
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import femmembrane as fm
from femmembrane import cli
from femmembrane.views import explorer as pages
from femmembrane.views.explorer_data import page_data, shape_of
from tests.browser import browser, needs_browser

OGDEN = fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0))
SCENE = fm.Scene(
    title="A disc </script> under a dipole",
    material=OGDEN,
    sources=[fm.Dipole(strength=200, height=6.5)],
    susceptibility=2.5,
    mesh=fm.disc(16),
    analysis=fm.Analysis(("pressure", "volume"), azimuthal_modes=(1,)),
)


@pytest.fixture(scope="module")
def branch() -> fm.Branch:
    return fm.trace(SCENE, start=0.5, until={"volume": 30.0})


@pytest.fixture(scope="module")
def data(branch: fm.Branch) -> dict[str, Any]:
    return page_data(branch)


def columns(data: dict[str, Any]) -> dict[str, int]:
    return {quantity["name"]: k for k, quantity in enumerate(data["quantities"])}


def values(data: dict[str, Any], name: str) -> np.ndarray:
    return np.array([state["values"][columns(data)[name]] for state in data["states"]])


# --- data


def test_states_are_steps_and_special_points_in_order(branch: fm.Branch, data: dict[str, Any]) -> None:
    steps = [state["step"] for state in data["states"] if state["kind"] is None]
    assert steps == list(range(len(branch)))
    kinds = [state["kind"] for state in data["states"] if state["kind"]]
    assert sorted(kinds) == sorted(str(p.kind) for p in branch.special_points)
    assert (np.diff(values(data, "volume")) > 0).all()  # up to V = 30 the branch does not turn back in it
    limit = next(state for state in data["states"] if state["kind"] == "limit_point")
    assert limit["values"][columns(data)["pressure"]] == pytest.approx(branch.special_points[0].pressure, rel=1e-8)


def test_numbers_and_verdicts_are_those_of_the_equilibria(branch: fm.Branch, data: dict[str, Any]) -> None:
    steps = [state for state in data["states"] if state["kind"] is None]
    for name in ("volume", "pressure", "center_height", "elastic_energy", "lambda_pressure"):
        shown = [state["values"][columns(data)[name]] for state in steps]
        np.testing.assert_allclose(shown, branch.column(name), rtol=1e-8)
    for state, equilibrium in zip(steps, branch, strict=True):
        told = {v["against"]: (v["word"], v["reason"]) for v in state["verdicts"]}
        for against, verdict in (
            ("axisymmetric, pressure held", equilibrium.verdict("pressure")),
            ("axisymmetric, volume held", equilibrium.verdict("volume")),
            ("n = 1 waves around the axis", equilibrium.verdict(azimuthal=1)),
        ):
            assert told[against] == (verdict.word, verdict.reason)


def test_lines_pass_through_the_steps_and_change_at_the_limit_points(branch: fm.Branch, data: dict[str, Any]) -> None:
    at = columns(data)
    lines = [np.array(line["values"], dtype=float) for line in data["lines"]]
    whole = np.concatenate(lines, axis=1)[[at["volume"], at["pressure"]]]
    for equilibrium in branch:
        apart = np.abs(whole - [[equilibrium.volume], [equilibrium.pressure]]).max(axis=0)
        assert apart.min() < 1e-4
    assert [line["label"].split()[0] for line in data["lines"]] == ["stable", "stable", "stable"]
    first = next(p for p in branch.special_points if p.kind == "limit_point")
    assert lines[0][at["volume"], -1] == pytest.approx(first.volume, rel=1e-5)


def test_shapes_are_the_membrane(branch: fm.Branch, data: dict[str, Any]) -> None:
    last, shape = branch[-1], data["shapes"][-1]
    assert shape["eta"][0] == pytest.approx(last.center_height, rel=1e-4)
    assert shape["rho"][-1] == pytest.approx(1.0, rel=1e-4)
    assert shape["fields"]["stretch_2"][0] == pytest.approx(last.profile([0.0])["stretch_2"][0], rel=1e-4)
    # the volume of the drawn surface is that of the state: integral of pi rho^2 deta
    rho, eta = np.array(shape["rho"]), np.array(shape["eta"])
    volume = -np.pi * np.sum(np.diff(eta) * (rho[1:] ** 2 + rho[1:] * rho[:-1] + rho[:-1] ** 2) / 3)
    assert volume == pytest.approx(last.volume, rel=1e-3)
    assert len(shape["zone"]) == len(rho) - 1


def test_modes_of_verdicts_and_natural_ones_where_there_are_none(branch: fm.Branch, data: dict[str, Any]) -> None:
    modes = data["shapes"][0]["modes"]
    assert [mode["n"] for mode in modes] == [0, 0, 1]
    assert all(max(map(abs, [*mode["u"], *mode["w"]])) <= 1 for mode in modes)
    plain = fm.equilibrium(fm.Scene(material=OGDEN, mesh=fm.disc(8)), volume=1.0)
    natural = shape_of(plain, pages_units())["modes"]
    assert [mode["n"] for mode in natural] == [0, 1, 2]
    first = plain.frequencies(azimuthal=1, count=1)[0].eigenvalue
    assert natural[1]["label"].endswith(f"{first:.4g}")
    assert page_data(fm.inflate(plain.scene, volumes=[1.0]))["lines"] == []


def pages_units() -> Any:
    from femmembrane.quantities import SCALED

    return SCALED


def test_untested_branches_are_named_so() -> None:
    branch = fm.inflate(fm.Scene(material=OGDEN, mesh=fm.disc(8)), volumes=[0.5, 1.0, 1.5], solver="newton")
    data = page_data(branch)
    assert [line["label"] for line in data["lines"]] == ["stability not tested"]
    assert not any(state["verdicts"] for state in data["states"])


@pytest.mark.parametrize(
    "mesh", [fm.sphere(elements=8), fm.torus(aspect=3.0, elements=12), fm.annulus(0.3, elements=8), fm.cylinder(length=2.0, elements=8)]
)
def test_other_shapes(mesh: Any) -> None:
    equilibrium = fm.equilibrium(fm.Scene(material=fm.MooneyRivlin(ratio=0.1), mesh=mesh), pressure=0.2)
    shape = page_data(fm.inflate(equilibrium.scene, volumes=[equilibrium.volume], solver="newton"))["shapes"][0]
    assert None not in [*shape["rho"], *shape["eta"], *shape["fields"]["stretch_1"], *shape["fields"]["stretch_2"]]
    assert max(shape["rho"]) == pytest.approx(equilibrium.profile()["rho"].max(), rel=1e-3)


def test_si_units() -> None:
    scales = fm.Scales(radius=0.02, thickness=1e-4, shear_modulus=1e5)
    branch = fm.inflate(fm.Scene(material=OGDEN, mesh=fm.disc(8), scales=scales), volumes=[0.5, 1.0], solver="newton")
    data = page_data(branch, "si")
    label = next(q["label"] for q in data["quantities"] if q["name"] == "pressure")
    assert label == "pressure p in Pa"
    assert values(data, "pressure")[-1] == pytest.approx(scales.to_si("pressure", branch[-1].pressure), rel=1e-8)
    assert data["length"] == "mm"
    assert data["shapes"][-1]["rho"][-1] == pytest.approx(20.0)


def test_long_branches_are_thinned_and_say_so() -> None:
    branch = fm.inflate(fm.Scene(material=OGDEN, mesh=fm.disc(4)), volumes=np.linspace(0.1, 2.0, 300), solver="newton")
    data = page_data(branch, shapes=False)
    assert len(data["states"]) == 240
    assert {data["states"][0]["step"], data["states"][-1]["step"]} == {0, 299}
    assert any("60 equilibria" in note for note in data["notes"])


# --- the page


class Elements(HTMLParser):
    """The ids of a page, its addresses, and the text in its scripts."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.addresses: list[str] = []
        self.scripts: dict[str, str] = {}
        self._open: str | None = None
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        known = dict(attrs)
        if known.get("id"):
            self.ids.append(str(known["id"]))
        self.addresses += [str(known[key]) for key in ("src", "href") if known.get(key)]
        self._open = str(known.get("id", "script")) if tag == "script" else None

    def handle_data(self, data: str) -> None:
        if self._open is not None:
            self.scripts[self._open] = self.scripts.get(self._open, "") + data

    def handle_endtag(self, tag: str) -> None:
        self._open = None


def test_one_file_that_needs_no_network(branch: fm.Branch, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    branch.explore(page)
    assert page.stat().st_size < 6e6
    found = Elements(page.read_text(encoding="utf-8"))
    assert [address for address in found.addresses if not address.startswith("data:")] == []
    assert len(found.ids) == len(set(found.ids))
    assert json.loads(found.scripts["data"])["title"] == SCENE.title  # what looks like the end of a script is none
    library = gzip.decompress(base64.b64decode(found.scripts["library"]))
    assert b"plotly.js" in library[:200]
    wanted = set(re.findall(r'byId\("(\w+)"\)', found.scripts["script"]))
    assert wanted <= set(found.ids)


def test_size_of_eighty_states(tmp_path: Path) -> None:
    volumes = np.linspace(0.5, 75.0, 80)
    branch = fm.inflate(SCENE.replace(mesh=fm.disc(64), title=""), volumes=volumes, solver="newton")
    branch.explore(tmp_path / "page.html")
    assert (tmp_path / "page.html").stat().st_size < 6e6


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text('[material]\nmodel = "neo-hookean"\n[mesh]\nelements = 8\n[run]\ncontrol = "volume"\nvalues = [0.5, 1.0]\n')
    out = tmp_path / "out"
    assert cli.main(["run", str(scene), "--out", str(out), "--explore"]) == cli.DONE
    first = (out / "explore.html").read_text(encoding="utf-8")
    assert cli.main(["explore", str(out)]) == cli.DONE
    assert (out / "explore.html").read_text(encoding="utf-8") == first  # from the file as from the run
    assert cli.main(["run", str(scene), "--out", str(out)]) == cli.DONE
    assert not (out / "explore.html").exists()  # the folder speaks of one run
    assert cli.main(["explore", str(tmp_path)]) == cli.BAD_INPUT
    assert "branch.nc" in capsys.readouterr().err


def test_refused_before_anything_is_computed_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pages, "find_spec", lambda name: None)
    branch = fm.inflate(fm.Scene(material=OGDEN, mesh=fm.disc(4)), volumes=[0.5], solver="newton")
    with pytest.raises(fm.InputError, match=r"femmembrane\[explore\]"):
        branch.explore(tmp_path / "page.html")
    scene = tmp_path / "scene.toml"
    scene.write_text('[material]\nmodel = "neo-hookean"\n[run]\ncontrol = "volume"\nvalues = [0.5]\n')
    assert cli.main(["run", str(scene), "--out", str(tmp_path / "out"), "--explore"]) == cli.BAD_INPUT
    assert not (tmp_path / "out").exists()


def test_empty_branch(branch: fm.Branch, tmp_path: Path) -> None:
    with pytest.raises(fm.InputError, match="no equilibria"):
        branch[:0].explore(tmp_path / "page.html")


# --- in a browser


@needs_browser
def test_clicks_and_keys_in_a_browser(branch: fm.Branch, data: dict[str, Any], tmp_path: Path) -> None:
    """A click at the place of a step shows its numbers; keys and buttons go on from there; nothing is said on the console."""
    branch.explore(tmp_path / "page.html")
    steps = [k for k, state in enumerate(data["states"]) if state["kind"] is None]
    wanted = steps[np.argmin([abs(data["states"][k]["values"][columns(data)["volume"]] - 15.0) for k in steps])]
    volume, pressure = (data["states"][wanted]["values"][columns(data)[name]] for name in ("volume", "pressure"))
    with browser() as page:
        page.open((tmp_path / "page.html").as_uri())
        assert page.ask("byId('name').textContent") == f"step {len(branch) - 1}"
        x, y = page.ask(
            "(() => { const plot = byId('diagram'), box = plot.getBoundingClientRect(), of = plot._fullLayout;"
            f" return [box.left + of.xaxis._offset + of.xaxis.l2p({volume}), box.top + of.yaxis._offset + of.yaxis.l2p({pressure})]; }})()"
        )
        page.click(x, y, seen="(byId('diagram')._hoverdata || []).length > 0")
        page.wait(f"window.explorer.drawn === {wanted}")
        assert page.ask("byId('name').textContent") == data["states"][wanted]["name"]
        numbers = page.ask("[...byId('numbers').querySelectorAll('dd')].map((e) => e.textContent)")
        shown = [float(number.replace("−", "-")) for number in numbers]  # noqa: RUF001
        expected = [v for q, v in zip(data["quantities"], data["states"][wanted]["values"], strict=True) if q["name"] != "step"]
        np.testing.assert_allclose(shown, expected)
        assert "under" in page.ask("byId('verdicts').textContent") or "stable" in page.ask("byId('verdicts').textContent")
        page.press("ArrowRight")
        page.wait(f"window.explorer.drawn === {wanted + 1}")
        height = data["shapes"][wanted + 1]["eta"]
        assert max(page.ask("Array.from(byId('space').data[0].z)")) == pytest.approx(max(height), rel=1e-6)
        limit = next(k for k, state in enumerate(data["states"]) if state["kind"] == "limit_point")
        page.ask("byId('points').querySelector('button').click()")
        page.wait(f"window.explorer.drawn === {limit}")
        page.ask("byId('motion').click()")
        page.wait("byId('mode').value === '0' && phase < 0.9")
        moved = page.ask("Array.from(byId('space').data[0].z)")
        assert len(moved) == 48 * len(data["shapes"][limit]["rho"])
        page.ask("byId('motion').click()")
        page.ask("byId('across').value = 'center_height'; byId('across').onchange()")
        assert page.ask("byId('diagram').layout.xaxis.title.text").startswith("pole height")
        assert page.ask("document.documentElement.scrollWidth <= innerWidth")
        assert page.errors == []
        assert [url for url in page.requests if not url.startswith(("file:", "data:", "blob:"))] == []


@needs_browser
def test_readable_on_a_phone(branch: fm.Branch, tmp_path: Path) -> None:
    branch.explore(tmp_path / "page.html")
    with browser() as page:
        page.open((tmp_path / "page.html").as_uri(), width=390, height=844)
        assert page.ask("document.documentElement.scrollWidth") <= 390
        assert page.ask("parseFloat(getComputedStyle(byId('numbers')).fontSize)") >= 13
        assert page.errors == []


@pytest.fixture(scope="module")
def below() -> fm.Branch:
    """Above a strong dipole, which tips the membrane over: b = -43.18, so that it jumps (two independent codes)."""
    asked = fm.Analysis(("volume",), azimuthal_modes=(1,))
    dipole = fm.Dipole(strength=600, height=-3.5)
    scene = fm.Scene(material=OGDEN, sources=[dipole], susceptibility=2.5, mesh=fm.disc(8), degree=6, analysis=asked)
    return fm.trace(scene, start=0.5, direction=-1, until={"center_height": 0.3})


def test_an_onset_says_whether_the_membrane_jumps_there(below: fm.Branch) -> None:
    data = page_data(below, shapes=False)
    onset = next(state for state in data["states"] if state["kind"] == "azimuthal_onset")
    assert onset["after"] == "subcritical"
    assert onset["word"] == "azimuthal onset, subcritical"
    assert "b = -43.18" in dict(onset["answers"])["beyond it"]
    others = [state for state in data["states"] if state["kind"] not in (None, "azimuthal_onset")]
    assert all(state["after"] == "" and "beyond it" not in dict(state["answers"]) for state in others)


@needs_browser
def test_the_key_and_waves_in_motion(below: fm.Branch, tmp_path: Path) -> None:
    """The key names the onset with a filled marker; short waves are drawn with enough sectors to be round, and low enough to be waves."""
    below.explore(tmp_path / "page.html")
    with browser() as page:
        page.open((tmp_path / "page.html").as_uri())
        assert "azimuthal onset, subcritical" in page.ask("byId('key').textContent")
        assert page.ask("byId('key').querySelector('polygon').getAttribute('fill') === css('--ink')")
        assert "b = " in page.ask("(() => { byId('points').querySelector('button').click(); return byId('answers').textContent; })()")
        page.wait("window.explorer.drawn === shown")
        page.ask("(() => { const m = drawn.modes.find((m) => m.n === 1); m.n = 40; byId('mode').value = drawn.modes.indexOf(m); })()")
        page.ask("space()")
        assert page.ask("byId('space').data[0].x.length / drawn.rho.length") == 8 * 40
        assert page.ask("amplitude(chosenMode(drawn)) < 2 * Math.PI * data.box[0] / 40 / 2")
        page.ask("byId('motion').click()")
        page.wait("phase < 0.9")
        assert page.errors == []


# --- in a notebook


def test_frame_of_a_notebook(branch: fm.Branch, monkeypatch: pytest.MonkeyPatch) -> None:
    """The frame comes after a still picture, which is all that there is without Plotly."""
    for shown in (branch, branch[-1]):
        html = shown._repr_html_()
        still, _, frame = html.partition("<iframe")
        assert "<img" in still
        assert "<table>" in still
        assert 'srcdoc="&lt;!DOCTYPE' in frame
    monkeypatch.setattr(pages, "find_spec", lambda name: None)
    assert "<iframe" not in branch._repr_html_()
    assert "<table>" in branch._repr_html_()


@needs_browser
def test_frame_takes_the_place_of_the_still_picture(branch: fm.Branch, tmp_path: Path) -> None:
    page = tmp_path / "notebook.html"
    page.write_text(f"<!DOCTYPE html><meta charset='utf-8'><link rel='icon' href='data:,'>{branch[-1]._repr_html_()}", encoding="utf-8")
    with browser() as shown:
        shown.open(page.as_uri(), ready="document.querySelector('div').hidden")
        assert shown.ask("document.querySelector('iframe').clientHeight") > 400
        number = shown.ask("document.querySelector('iframe').contentDocument.getElementById('numbers').textContent")
        assert f"{branch[-1].pressure:.9g}" in number
        assert shown.errors == []
