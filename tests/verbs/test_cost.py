"""``fm.cost``: errors, orders, medians from clocks that are given, tables and pictures. No test depends on how long anything takes."""

from __future__ import annotations

import csv
import itertools

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.accuracy.cost import Job, Outcome, in_turns, measure, relative_error, with_front
from femmembrane.cli import main
from femmembrane.results.cost import COLUMNS, Measurement
from femmembrane.verbs.cost import asked_load
from tests.cases import POINTS, disc_scene

SCENE = disc_scene(dipole=(200, 6.5), elements=8)
LISTED = next(p.expected for p in POINTS if p.name == "dipole_above-1")
VOLUME = LISTED["volume"]


def study(scene=SCENE, **given):
    usual = {"degrees": (1, 2), "elements": (8, 16), "methods": (), "repeat": 1, "reference_elements": 16, "parts": False}
    clock = itertools.count()  # every reading is a second later
    return fm.cost(scene, **(usual | given), clock=lambda: float(next(clock)))


@pytest.fixture(scope="module")
def whole():
    """Everything that is measured, of the scene of the README at the height of a listed point."""
    tolerances = {"shooting": (1e-6, 1e-9), "collocation": (1e-3, 1e-6), "published": (1e-3,)}
    return study(volume=VOLUME, degrees=(1, 2, 6), methods=("shooting", "collocation", "published"), tolerances=tolerances, parts=True)


# --- clocks


class Clock:
    """Work that moves the clock by given amounts, one after the other."""

    def __init__(self):
        self.now, self.done = 0.0, []

    def __call__(self):
        return self.now

    def work(self, name, *amounts):
        given = itertools.chain(amounts, itertools.repeat(amounts[-1]))

        def do():
            self.now += next(given)
            self.done.append(name)
            return Outcome(value=1.5, iterations=3)

        return do


def test_turns_are_paired():
    """Each piece once, then each again; the first calls, with what they build, do not count."""
    clock = Clock()
    results, seconds = in_turns([clock.work("a", 9, 1, 5, 3), clock.work("b", 7, 2)], 3, 100.0, clock)
    assert clock.done == ["a", "b"] * 4
    assert [r.iterations for r in results] == [3, 3]
    assert seconds == [[1, 5, 3], [2, 2, 2]]


def test_a_budget_ends_the_turns():
    """Work of 30 s is not repeated (its only call counts), work of 4 s until 10 s are spent, and work of 1 s always."""
    clock = Clock()
    _, seconds = in_turns([clock.work("slow", 30), clock.work("middle", 4), clock.work("quick", 1)], 5, 10.0, clock)
    assert seconds == [[30], [4, 4, 4], [1, 1, 1, 1, 1]]


def test_quick_work_is_done_several_times_a_turn():
    """Work of a quarter of a turn (10 ms) is done four times in each, and the mean of a turn is what counts."""
    clock = Clock()
    _, seconds = in_turns([clock.work("a", 0.0025)], 2, 1.0, clock)
    assert len(clock.done) == 1 + 2 * 4
    assert seconds[0] == pytest.approx([0.0025, 0.0025], rel=1e-12)


def test_medians_and_set_up():
    """Times of 1, 5 and 3 s have the median 3 s; a fresh problem that takes 10 s more than that has a set-up of 10 s."""
    clock = Clock()
    line = Measurement("solve", "newton", "warm", 2, 8, 31)
    job = Job(line, clock.work("solve", 8, 9, 1, 5, 3), clock.work("fresh", 20, 13))
    stage = Job(Measurement("stage", "evaluation"), clock.work("stage", 2))
    measured, other = measure([job, stage], 1.2, 3, 1000.0, clock)
    assert (measured.milliseconds, measured.setup_milliseconds, measured.repeats) == (3000, 10_000, 3)
    assert measured.error == pytest.approx(0.25)
    assert (other.milliseconds, other.repeats) == (2000, 3)
    assert np.isnan(other.error)


def test_what_fails_or_is_something_else_has_no_place():
    clock = Clock()
    failed = Job(Measurement("solve", "newton", "warm"), lambda: Outcome(converged=False, message="step underflow"))
    another = Job(Measurement("solve", "newton", "warm"), clock.work("another", 1))
    first, second = measure([failed, another], 5.0, 1, 10.0, clock)
    assert not first.converged
    assert first.message == "step underflow"
    assert np.isnan(first.milliseconds)
    assert not second.converged
    assert "another equilibrium" in second.message
    assert not any(line.front for line in with_front([first, second], 1e-14))


def test_front():
    """By hand: of (time, error) the first beats the second and third, the fourth the fifth; errors below 1e-9 are equal."""
    numbers = [(1, 1e-3), (2, 1e-3), (3, 1e-2), (4, 1e-6), (5, 2e-6), (6, 1e-10), (7, 1e-12)]
    lines = [Measurement("solve", "newton", "warm", error=e, milliseconds=t) for t, e in numbers]
    lines += [Measurement("solve", "ipopt", "cold", error=1.0, milliseconds=9.0), Measurement("stage", "a", milliseconds=0.1)]
    assert [k for k, line in enumerate(with_front(lines, 1e-9)) if line.front] == [0, 3, 5, 7]


def test_relative_error():
    assert relative_error(1.1, 1.0) == pytest.approx(0.1)
    assert relative_error(-2.0, -4.0) == 0.5
    assert relative_error(0.25, 0.0) == 0.25


# --- what is measured


def test_every_mesh_solver_and_start_has_a_line(whole):
    lines = whole.select(what="solve")
    elements = [line for line in lines if line.degree]
    assert len(elements) == 3 * 2 * 2 * 2
    assert len({(e.degree, e.elements, e.method, e.start) for e in elements}) == len(elements)
    assert {e.unknowns for e in elements if (e.degree, e.elements) == (2, 8)} == {31}  # 17 nodes with 2, less pole u, rim u and w
    assert all(line.converged for line in lines), [line.message for line in lines if not line.converged]
    assert all(line.milliseconds > 0 and line.repeats == 1 for line in lines)
    assert all(np.isnan(line.setup_milliseconds) == (line.degree is None or line.start == "cold") for line in lines)


def test_reference(whole):
    """The finest mesh has the tabulated pressure, and its own error says so."""
    assert whole.reference.value == pytest.approx(LISTED["pressure"], rel=1e-12)
    assert 1e-14 <= whole.reference.error < 1e-12
    assert whole.quantity == "pressure"


def test_errors_are_of_the_mesh(whole):
    """The same by every solver and start, of order 2 for degree 1 and order 4 for degree 2, and 1e-9 for eight elements of degree 6."""
    for degree, order in ((1, 2), (2, 4)):
        errors = {}
        for n in (8, 16):
            own = [line.error for line in whole.select(what="solve", degree=degree, elements=n)]
            assert own == pytest.approx([own[0]] * 4, rel=1e-4)
            errors[n] = own[0]
        assert np.log2(errors[8] / errors[16]) == pytest.approx(order, abs=0.3)
    assert all(line.error < 1e-9 for line in whole.select(degree=6, what="solve"))


def test_methods_meet_their_tolerances(whole):
    """A rim that is met within some tolerance, or a residual below it, means a pressure within about ten times as much."""
    lines = [line for line in whole.select(what="solve") if line.degree is None]
    assert [(line.method, line.tolerance) for line in lines] == [
        *(("shooting", t) for t in (1e-6, 1e-9)),
        *(("collocation", t) for t in (1e-3, 1e-6)),
        ("published", 1e-3),
    ]
    assert all(line.error < 10 * line.tolerance for line in lines)
    assert all(line.evaluations > 100 and line.iterations >= 0 and line.start == "warm" for line in lines)


def test_parts(whole):
    stages = [line.method for line in whole.select(what="stage")]
    assert stages[:2] == ["evaluation and assembly", "factorisation and solution"]
    assert {"verdict, pressure control", "verdict, volume control", "verdict, n = 1", "zones of wrinkles"} < set(stages)
    assert stages[-4:] == ["output, table", "output, NetCDF", "output, VTU", "output, picture"]
    effects = whole.select(what="effect")
    assert [(line.method, line.start) for line in effects] == [
        (name, on) for name in ("sources", "azimuthal modes", "zones of wrinkles", "tension field") for on in ("off", "on")
    ]
    assert all(line.converged and line.iterations >= 1 for line in effects)


def test_parts_are_those_the_scene_asks_for():
    scene = disc_scene(elements=4).replace(analysis=fm.Analysis(stability=("volume",), azimuthal_modes=(2, 3), wrinkling="mechanical"))
    found = study(scene, volume=1.0, degrees=(2,), elements=(4,), parts=True)
    stages = [line.method for line in found.select(what="stage")]
    assert [name for name in stages if "verdict" in name] == ["verdict, volume control", "verdict, n = 2", "verdict, n = 3"]
    assert "sources" not in {line.method for line in found.lines}


def test_pressure_control_measures_the_volume():
    found = study(pressure=1.0, solvers=("newton",), degrees=(2,))
    assert found.quantity == "volume"
    fine = fm.equilibrium(SCENE.replace(mesh=fm.disc(elements=32), degree=6), pressure=1.0)
    assert found.reference.value == pytest.approx(fine.volume, rel=1e-12)
    errors = [line.error for line in found.select(start="warm")]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.4)


def test_a_height_has_no_minimiser():
    found = study(center_height=LISTED["center_height"], degrees=(6,))
    assert {line.method for line in found.lines} == {"newton"}
    assert found.reference.value == pytest.approx(LISTED["pressure"], rel=1e-12)


def test_meshes_are_graded_like_the_scene_s():
    """Elements ten times smaller at the rim: the same equilibrium with other errors, and the same number of unknowns."""
    graded, even = (study(SCENE.replace(mesh=mesh), volume=1.0, degrees=(2,)) for mesh in (fm.disc(8, ratio=0.1), fm.disc(8)))
    assert graded.reference.value == pytest.approx(even.reference.value, rel=1e-12)
    assert [line.unknowns for line in graded.lines] == [line.unknowns for line in even.lines]
    assert all(abs(a.error / b.error - 1) > 0.1 for a, b in zip(graded.lines, even.lines, strict=True))


def test_tension_field_has_no_independent_methods():
    scene = SCENE.replace(tension_field=True)
    assert {line.method for line in study(scene, volume=1.0, methods=None).lines} == {"newton", "ipopt"}
    with pytest.raises(fm.InputError, match=r"effects\.tension_field = True"):
        study(scene, volume=1.0, methods=("shooting",))


def test_a_mesh_that_fails_says_why():
    """One linear element has no state under this load near the fine one: its lines are there, without a time, and off the front."""
    found = study(volume=60.0, degrees=(1,), elements=(1, 64), solvers=("newton",), starts=("warm",))
    coarse, fine = found.lines
    assert not coarse.converged
    assert coarse.message
    assert np.isnan(coarse.milliseconds)
    assert fine.front
    assert not coarse.front


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "exactly one of volume, pressure and center_height"),
        ({"volume": 1.0, "pressure": 1.0}, "exactly one of volume, pressure and center_height"),
        ({"volume": 1.0, "degrees": 2}, "degrees = 2: whole numbers from 1 to 8"),
        ({"volume": 1.0, "solvers": 3}, "solvers = '3'"),
        ({"volume": 1.0, "degrees": (9,)}, "degrees = 9: whole numbers from 1 to 8"),
        ({"volume": 1.0, "elements": (8, 0)}, "elements = 0: whole numbers >= 1"),
        ({"volume": 1.0, "elements": ()}, r"elements = \(\): whole numbers >= 1"),
        ({"volume": 1.0, "repeat": 0}, "repeat = 0"),
        ({"volume": 1.0, "solvers": ("newtn",)}, "did you mean 'newton'"),
        ({"volume": 1.0, "solvers": "newton"}, "solvers = 'newton'"),
        ({"volume": 1.0, "starts": ("tepid",)}, "starts = 'tepid'"),
        ({"volume": 1.0, "methods": ("colocation",)}, "did you mean 'collocation'"),
        ({"volume": 1.0, "methods": ("shooting",), "tolerances": {}}, "tolerances = 'shooting'"),
        ({"volume": 1.0, "budget": -1.0}, "budget = -1.0: a finite number >= 0"),
        ({"volume": 1.0, "step": 0.0}, "step = 0.0: a finite number > 0"),
        ({"volume": 1.0, "degrees": range(1, 9), "elements": range(1, 9)}, "no more than 30 meshes"),
    ],
)
def test_arguments(given, message):
    with pytest.raises(fm.InputError, match=message):
        study(**given)


def test_the_flat_membrane_has_no_step_before_it():
    with pytest.raises(fm.InputError, match=r"pressure = 0\.0: a load other than 0"):
        fm.cost(fm.Scene(material=fm.NeoHookean()), pressure=0.0)


def test_a_reference_that_is_not_found():
    """A neo-Hookean membrane holds no pressure above its limit point, 1.9 or so: nothing could be measured."""
    with pytest.raises(fm.SolveError, match=r"no equilibrium was found at P = .* that is stable"):
        study(disc_scene(fm.NeoHookean(), elements=4), pressure=9.0)


def test_select(whole):
    assert whole.select(what="solve", method="collocation", tolerance=1e-6)[0].tolerance == 1e-6
    with pytest.raises(fm.InputError, match="did you mean 'elements'"):
        whole.select(element=8)
    assert whole.front == tuple(line for line in whole.front if line.front)
    assert {line.start for line in whole.front} == {"warm", "cold"}


# --- tables and pictures


def test_text(whole):
    text = str(whole)
    assert f"One equilibrium at V = {VOLUME:.9g}: relative error in P" in text
    assert "16 elements of degree 8" in text
    assert f"numpy {np.__version__}" in text
    assert sum(line.strip().startswith(("1 ", "2 ", "6 ")) for line in text.splitlines()) == 6
    for name in ("shooting, Newton", "collocation", "shooting as published", "evaluation and assembly", "tension field"):
        assert name in text


def test_table_reads_back(whole, tmp_path):
    path = tmp_path / "cost.csv"
    whole.write_csv(path)
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS
    assert len(rows) == len(whole.lines) == len(whole.to_dataframe())
    for row, line in zip(rows, whole.lines, strict=True):
        assert (row["what"], row["method"], row["start"]) == (line.what, line.method, line.start)
        assert float(row["milliseconds"]) == line.milliseconds
        assert row["error"] == ("" if np.isnan(line.error) else repr(line.error))
        assert f"scipy {__import__('scipy').__version__}" in row["machine"]
    assert list(tmp_path.iterdir()) == [path]


def test_picture(whole, tmp_path):
    """Two panels on logarithmic axes; every curve differs from every other one in more than its colour."""
    figure = whole.plot(tmp_path / "cost.png")
    assert (tmp_path / "cost.png").stat().st_size > 20_000
    warm, cold = figure.axes
    assert {axes.get_xscale() for axes in figure.axes} == {axes.get_yscale() for axes in figure.axes} == {"log"}
    looks = [(line.get_marker(), str(line.get_linestyle()), line.get_markerfacecolor() == "white") for line in warm.lines]
    assert len(set(looks)) == len(looks) == 1 + 3 * 2 + 3  # front, degrees by solvers, methods
    assert len(cold.lines) == 1 + 3 * 2
    front = next(line for line in warm.lines if line.get_label() == "nothing is better in both")
    assert front.get_linewidth() > 5
    assert len(front.get_xdata()) == sum(line.start == "warm" for line in whole.front)


def test_picture_needs_something():
    found = study(volume=60.0, degrees=(1,), elements=(1,), starts=("warm",))
    with pytest.raises(fm.InputError, match="no solves"):
        found.plot()


# --- the command


HEAD = '[material]\nmodel = "neo-hookean"\n[mesh]\nelements = 8\n'


@pytest.mark.parametrize(
    ("run", "load"),
    [
        ("start = 0.5\nstop = 2.0\nsteps = 4", {"volume": 2.0}),
        ('control = "pressure"\nvalues = [1.0, 0.8]', {"pressure": 0.8}),
        ('control = "height"\nvalues = [0.5]', {"center_height": 0.5}),
        ('control = "arc-length"\nstart = 0.5\nuntil = {pressure = 1.5}', {"pressure": 1.5}),
    ],
)
def test_the_load_is_the_last_of_the_run(tmp_path, run, load):
    path = tmp_path / "scene.toml"
    path.write_text(f"{HEAD}[run]\n{run}\n", encoding="utf-8")
    assert asked_load(fm.Scene.from_toml(path)) == load


def test_load_without_a_run():
    with pytest.raises(fm.InputError, match=r"run = None: missing"):
        asked_load(SCENE)


def test_command(tmp_path, capfd):
    """Two files, and in a pipe the study."""
    path = tmp_path / "scene.toml"
    path.write_text(f"{HEAD}[run]\nvalues = [1.0, 2.0]\n", encoding="utf-8")
    assert main(["cost", str(path), "--out", str(tmp_path / "out"), "--quick"]) == 0
    said = capfd.readouterr()
    assert said.out.strip()
    assert said.err == ""
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"cost.csv", "cost.png"}
    with (tmp_path / "out" / "cost.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["method"] for row in rows if row["what"] == "solve"} == {"newton", "ipopt", "shooting", "collocation", "published"}


@pytest.mark.parametrize(
    ("rest", "code", "message"), [("", 2, "run = None: missing"), ("[run]\ncontrol = 'pressure'\nvalues = [9.0]\n", 3, "P = ")]
)
def test_command_fails(tmp_path, capfd, rest, code, message):
    path = tmp_path / "scene.toml"
    path.write_text(HEAD + rest, encoding="utf-8")
    assert main(["cost", str(path), "--out", str(tmp_path / "out"), "--quick"]) == code
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith("femmembrane: ")
    assert err.count("\n") == 1
    assert message in err
    assert not (tmp_path / "out" / "cost.csv").exists()


def test_another_meridian_is_measured_in_silence():
    """The independent methods but the paper's own, which is for the disc; none where there are kinks (warnings are errors here)."""
    few = {"degrees": (1,), "elements": (4, 8), "solvers": ("newton",), "reference_elements": 8, "repeat": 1, "parts": False}
    study = fm.cost(
        fm.Scene(fm.NeoHookean(), fm.annulus(0.3, elements=8)), volume=0.5, tolerances={"shooting": (1e-8,), "collocation": (1e-6,)}, **few
    )
    found = {line.method: line for line in study.lines if line.what == "solve"}
    assert set(found) == {"newton", "shooting", "collocation"}
    assert found["shooting"].error < 1e-6
    kinked = fm.Scene(fm.NeoHookean(), fm.meridian_from_points([(0.3, 0.0), (0.6, 0.1), (1.0, 0.0)], divisions=4))
    study = fm.cost(kinked, volume=0.9, **few | {"elements": (4, 8)})
    assert {line.method for line in study.lines if line.what == "solve"} == {"newton"}


# --- the sentence


def solve(degree, elements, error, milliseconds, **more):
    return Measurement("solve", "newton", "warm", degree, elements, error=error, milliseconds=milliseconds, **more)


def effect(name, off, on):
    return [Measurement("effect", name, start, 2, 8, milliseconds=ms) for start, ms in (("off", off), ("on", on))]


@pytest.fixture
def sentence(whole):
    from dataclasses import replace

    from femmembrane.results.cost import Reference

    def say(*lines, scene=SCENE, floor=1e-13):
        return replace(whole, scene=scene, lines=tuple(lines), reference=Reference(1.0, floor, 64, 8)).sentence

    return say


def test_the_sentence_names_the_cheapest_mesh_and_what_digits_cost(sentence):
    solves = [solve(2, 64, 5e-7, 0.5), solve(4, 8, 9e-7, 0.2), solve(4, 16, 4e-9, 0.3), solve(8, 16, 1e-12, 0.5), solve(8, 99, 1e-12, 0.9)]
    assert sentence(*solves) == (
        "P to 1e-06 costs 0.2 ms a state with 8 elements of degree 4; each further digit costs 0.05 ms, down to 1e-12 with 16 elements of "
        "degree 8."
    )
    asked = SCENE.replace(mesh=fm.disc(ratio=1.0, radii=None, elements=None, accuracy=1e-8), degree=None)
    assert sentence(*solves, scene=asked).startswith("P to 1e-08 costs 0.3 ms a state with 16 elements of degree 4; each further digit")


def test_the_sentence_says_what_effects_add(sentence):
    lines = [solve(4, 8, 9e-7, 0.2), *effect("azimuthal modes", 0.25, 1.25), *effect("zones of wrinkles", 0.25, 0.251)]
    assert sentence(*lines).endswith(
        "On 8 elements of degree 2, where a state costs 0.25 ms, the verdict against n = 1 adds 1 ms and looking for zones of wrinkles "
        "adds next to nothing."
    )


def test_the_sentence_where_no_mesh_will_do(sentence):
    assert sentence(solve(1, 8, 1e-3, 0.1)) == "P to 1e-06 takes more elements than were measured; the best error is 1e-03."
    assert sentence() == ""


def test_a_scene_that_asks_for_an_accuracy():
    """Its mesh is chosen first; the sentence speaks of that accuracy."""
    found = study(SCENE.replace(mesh=fm.disc(accuracy=1e-4), degree=None), volume=VOLUME, degrees=(2, 4))
    assert found.scene.mesh.accuracy == 1e-4
    assert found.sentence.startswith("P to 1e-04 ")
    assert found.sentence in str(found)
