"""The live explorer: the branch follows the sliders, in the server's answers and in a browser."""

from __future__ import annotations

import json
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from http.server import ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import femmembrane as fm
from femmembrane import cli
from femmembrane.cli.live import Session, address, make_server
from femmembrane.scene import Run
from femmembrane.verbs.live import LiveScene
from tests.browser import browser, needs_browser

SCENE = fm.Scene(
    material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
    sources=[fm.Dipole(strength=200, height=6.5)],
    susceptibility=2.5,
    mesh=fm.disc(8),
    degree=4,
    run=Run(control="volume", start=0.5, stop=30.0, steps=20),
)


def values(data: dict[str, Any], name: str) -> np.ndarray:
    place = [quantity["name"] for quantity in data["quantities"]].index(name)
    return np.array([state["values"][place] for state in data["states"]])


# --- without a server


def test_sliders_of_bodies_go_as_far_as_the_membrane_at_rest_lets_them() -> None:
    bodies = [fm.Ball(0.8, 0.45), fm.Plane(1.5)]
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(4), obstacles=bodies, run=fm.Run(control="volume", values=(0.3,)))
    sliders = {slider.name: slider for slider in LiveScene(scene).sliders()}
    assert {"obstacle.0.height", "obstacle.0.radius", "obstacle.1.height"} <= set(sliders)
    assert 0.45 < sliders["obstacle.0.height"].low < 0.8  # the ball may not come to the disc
    assert 0.45 < sliders["obstacle.0.radius"].high < 0.8  # nor to the plate, 1.25 - 0.8
    for name in ("obstacle.0.height", "obstacle.0.radius", "obstacle.1.height"):
        for value in (sliders[name].low, sliders[name].high):
            LiveScene(scene).scene_at({name: value})


def test_a_slider_for_every_number() -> None:
    sliders = {slider.name: slider for slider in LiveScene(SCENE).sliders()}
    assert {"source.0.strength", "source.0.height", "membrane.susceptibility", "material.mu.1", "material.alpha.2"} <= set(sliders)
    assert (sliders["source.0.strength"].low, sliders["source.0.strength"].high) == (100, 400)
    assert (sliders["material.mu.2"].low, sliders["material.mu.2"].high) == (-0.0472, -0.0118)
    moved = SCENE.replace(run=Run(control="source.0.height", values=(6.0, 5.5), hold={"pressure": 0.5}))
    assert "source.0.height" not in {slider.name for slider in LiveScene(moved).sliders()}
    with pytest.raises(fm.InputError, match="run"):
        LiveScene(SCENE.replace(run=None))


def test_the_branch_of_moved_numbers_is_that_of_the_scene() -> None:
    answer = LiveScene(SCENE).answer({"source.0.strength": 300.0, "source.0.height": 6.0})
    scene = SCENE.replace(sources=[fm.Dipole(strength=300, height=6.0)])
    assert answer.scene.sources == scene.sources
    expected = fm.equilibrium(scene, volume=30.0, solver="newton").pressure
    assert answer.branch[-1].pressure == pytest.approx(expected, rel=1e-10)
    assert {p.kind for p in answer.branch.special_points} == {"limit_point"}  # traced, so that folds are seen
    assert answer.branch[0].verdict("volume").stable
    assert answer.branch.scene.analysis.stability == ("pressure", "volume")
    assert answer.milliseconds > 0


def test_errors_fall_with_the_elements() -> None:
    live = LiveScene(SCENE)
    errors = [live.answer({}, elements).error for elements in (4, 8, 16)]
    assert errors[0] > 30 * errors[1] > 900 * errors[2] > 0


@pytest.mark.parametrize(
    "run",
    [
        Run(control="pressure", values=(0.5, 1.0, 1.5)),
        Run(control="height", values=(0.2, 0.6)),
        Run(control="arc-length", start=0.5, until={"volume": 4.0}),
        Run(control="source.0.height", values=(6.5, 6.0), hold={"pressure": 0.5}),
    ],
)
def test_other_runs(run: Run) -> None:
    branch = LiveScene(SCENE.replace(run=run)).answer({"source.0.strength": 150.0}).branch
    assert branch.status is fm.Status.CONVERGED
    assert all(equilibrium.scene.sources[0].strength == 150.0 for equilibrium in branch)


# --- the server


@pytest.fixture(scope="module")
def server() -> Iterator[ThreadingHTTPServer]:
    with make_server(Session(SCENE)) as found:
        thread = threading.Thread(target=found.serve_forever, daemon=True)
        thread.start()
        yield found
        found.shutdown()
        thread.join()


def ask(url: str, question: Any = None, **headers: str) -> Any:
    body = None if question is None else json.dumps(question).encode()
    with urllib.request.urlopen(urllib.request.Request(url, body, headers)) as answer:
        text = answer.read().decode()
    return text if question is None else json.loads(text)


def test_questions(server: ThreadingHTTPServer) -> None:
    question = {"values": {"source.0.strength": 350.0}, "elements": 6}
    data = ask(address(server) + "branch", question)
    scene = SCENE.replace(sources=[fm.Dipole(strength=350, height=6.5)], mesh=fm.disc(6))
    assert values(data, "pressure")[-1] == pytest.approx(fm.equilibrium(scene, volume=30.0, solver="newton").pressure, rel=1e-8)
    assert data["mesh"] == "6 elements of degree 4"
    assert 0 < data["error"] < 1e-3
    last = len(data["states"]) - 1
    shape = ask(address(server) + "shape", {"state": last, "version": data["version"]})
    assert shape["eta"][0] == pytest.approx(values(data, "center_height")[-1], rel=1e-4)
    text = ask(address(server) + "file", {**question, "name": "scene.toml"})["text"]
    assert "strength = 350" in text
    assert ask(address(server) + "file", {**question, "name": "branch.csv"})["text"].startswith("step,volume,pressure")


def test_what_is_not_answered(server: ThreadingHTTPServer) -> None:
    """Guesses of the address, pages of other hosts, and questions that make no sense; the last ones in words."""
    home = address(server).rsplit("/", 2)[0]
    for url, question, headers, code in (
        (home + "/", None, {}, 404),
        (home + "/guess/branch", {"values": {}, "elements": None}, {}, 404),
        (address(server), None, {"Host": "elsewhere.example"}, 404),
        (address(server) + "branch", {"values": {"source.0.weight": 1.0}, "elements": None}, {}, 400),
        (address(server) + "branch", {"values": {"source.0.height": 0.0}, "elements": 10**9}, {}, 400),
        (address(server) + "branch", [], {}, 400),
        (address(server) + "shape", {"state": 10**6, "version": 1}, {}, 400),
        (address(server) + "file", {"values": {}, "elements": None, "name": "../scene"}, {}, 400),
    ):
        with pytest.raises(urllib.error.HTTPError) as error:
            ask(url, question, **headers)
        with error.value:
            assert error.value.code == code
            assert json.loads(error.value.read())["message"]


def test_the_command_refuses_before_it_serves(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.toml"
    SCENE.to_toml(scene)
    assert cli.main(["explore", str(scene), "--live", "--port", "999999"]) == cli.BAD_INPUT
    assert "--port" in capsys.readouterr().err
    assert cli.main(["explore", str(tmp_path), "--set", "mesh.elements=4"]) == cli.BAD_INPUT
    assert "--live" in capsys.readouterr().err


# --- in a browser


@needs_browser
def test_a_slider_moves_the_curve(server: ThreadingHTTPServer) -> None:
    """Dragged with the mouse: the curve drawn at the end is the branch at the value that the slider shows."""
    with browser() as page:
        page.open(address(server))
        x, y, width = page.ask(
            "(() => { const box = document.querySelector('[name=\"source.0.strength\"]').getBoundingClientRect();"
            " return [box.left, box.top + box.height / 2, box.width]; })()"
        )
        start = page.ask("data.version")
        middle = x + width / 3  # 200 between 100 and 400
        page.call("Input.dispatchMouseEvent", type="mousePressed", x=middle, y=y, button="left", clickCount=1)
        for k in range(1, 11):
            page.call("Input.dispatchMouseEvent", type="mouseMoved", x=middle + k * width / 25, y=y, button="left")
        page.call("Input.dispatchMouseEvent", type="mouseReleased", x=middle + 10 * width / 25, y=y, button="left")
        page.wait(f"data.version > {start} && live.settled === data.version")
        strength = page.ask("live.values['source.0.strength']")
        assert 250 < strength < 350
        scene = SCENE.replace(sources=[fm.Dipole(strength=strength, height=6.5)])
        expected = fm.equilibrium(scene, volume=30.0, solver="newton").pressure
        drawn = page.ask("(() => { const t = byId('diagram').data.filter((t) => t.mode === 'lines'); return t[0].y.concat(t[1].y); })()")
        assert min(abs(y - expected) for y in drawn if y is not None) < 1e-4
        page.wait("window.explorer.drawn === shown && data.shapes && data.shapes[shown]")
        assert max(page.ask("Array.from(byId('space').data[0].z)")) == pytest.approx(
            fm.equilibrium(scene, volume=30.0, solver="newton").center_height, rel=1e-3
        )
        assert " ms, error " in page.ask("byId('cost').textContent")
        assert not page.ask("byId('diagram').parentElement.classList.contains('sketched')")
        page.ask("[...document.querySelectorAll('button')].find((b) => b.textContent === 'Add to comparison').click()")
        assert page.ask("compared.length") == 1
        page.ask("(() => { const s = document.querySelector('[name=accuracy]'); s.value = 0; s.oninput(); })()")
        page.wait("byId('cost').textContent.startsWith('4 elements')")
        assert page.errors == []


@needs_browser
def test_the_curve_that_is_sketched_while_a_hand_moves_is_that_of_the_diagram(server: ThreadingHTTPServer) -> None:
    """Its last corner, in pixels, is the last equilibrium on the axes of the diagram; a curve that leaves them has new axes."""
    with browser() as page:
        page.open(address(server))
        page.ask("ask()")
        page.wait("!live.busy")
        found = page.ask(
            "(() => { clearTimeout(live.idle); sketch(); const of = byId('diagram')._fullLayout, last = data.lines[data.lines.length - 1],"
            " [x, y] = ['across', 'up'].map((id) => column(byId(id).value)), paths = [...byId('sketch').querySelectorAll('path')];"
            " const drawn = paths[paths.length - 1].getAttribute('d').split('L').pop().split(' ').map(Number);"
            " return [drawn, [of.xaxis.l2p(last.values[x].at(-1)), of.yaxis.l2p(last.values[y].at(-1))], of.xaxis.range]; })()"
        )
        assert found[0] == pytest.approx(found[1], abs=0.06)
        assert found[2][1] < 60  # the branch ends at V = 30
        assert page.ask(
            "(() => { Plotly.relayout('diagram', { 'xaxis.range': [0, 100] }); return sketch(); })()"
        )  # axes that a hand has set
        assert page.ask("(() => { Plotly.relayout('diagram', { 'xaxis.autorange': true }); return sketch(); })()")
        assert not page.ask("(() => { data.lines[0].values = data.lines[0].values.map((c) => c.map((v) => 4 * v)); return sketch(); })()")
        assert page.errors == []
