"""Figures for papers: the styles of two journal widths, several results in one figure, and text that stays text."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import matplotlib.style
import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

import femmembrane as fm
from femmembrane.views import figures, plots

INCH = 25.4
WIDTHS = {"column": 88.0, "page": 180.0}
SCENE = fm.Scene(
    title="A disc",
    material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
    mesh=fm.disc(8),
    analysis=fm.Analysis(("pressure", "volume"), wrinkling="total"),
)


@pytest.fixture(scope="module")
def branch() -> fm.Branch:
    return fm.trace(SCENE, start=0.5, until={"volume": 30.0})


@pytest.fixture(scope="module")
def study() -> fm.Convergence:
    return fm.convergence(SCENE, volume=1.0, elements=[2, 4, 8], degrees=[1, 2])


@pytest.mark.parametrize("name", WIDTHS)
def test_width_and_sizes_of_a_style(branch: fm.Branch, study: fm.Convergence, name: str, tmp_path: Path) -> None:
    """Nothing is smaller than 6.5 points where it is printed, and nothing is wider than the column or the page."""
    with matplotlib.style.context(f"femmembrane.views.{name}"):
        drawn = [branch.plot(tmp_path / "a.svg").figure, plots.plot_profiles(branch), plots.plot_zones(branch), study.plot()]
        for figure in drawn:
            assert figure.get_size_inches()[0] * INCH == pytest.approx(WIDTHS[name], abs=0.5)
            figure.canvas.draw()
            words = [text for text in figure.findobj(lambda a: hasattr(a, "get_fontsize")) if text.get_text() and text.get_visible()]
            assert words
            assert all(6.5 <= text.get_fontsize() <= 9 for text in words)
            assert all(line.get_linewidth() < 1.8 for axes in figure.axes for line in axes.lines if axes.lines and line.get_zorder() == 3)
    svg = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert "limit point (dP = 0)" in svg  # text, not outlines
    width = float(re.search(r'width="([\d.]+)pt"', svg)[1])
    assert width / 72 * INCH == pytest.approx(WIDTHS[name], abs=0.5)


def test_usual_figures_do_not_change(branch: fm.Branch) -> None:
    axes = branch.plot()
    assert tuple(axes.figure.get_size_inches()) == (6.4, 4.6)
    assert {text.get_fontsize() for text in axes.get_legend().get_texts()} == {9.0}
    assert 1.8 in {line.get_linewidth() for line in axes.lines}


def test_drawing_again_fits_again_what_is_new_alone(branch: fm.Branch) -> None:
    """Several branches in one picture have lines of one width."""
    with matplotlib.style.context("femmembrane.views.column"):
        axes = branch.plot(label="first")
        once = [line.get_linewidth() for line in axes.lines]
        branch.plot(ax=axes, x="volume", y="pressure", label="second")
        again = [line.get_linewidth() for line in axes.lines]
    assert again[: len(once)] == once
    assert set(again[len(once) :]) <= set(once)


def test_one_figure_of_a_paper(branch: fm.Branch, study: fm.Convergence, tmp_path: Path) -> None:
    """A branch, zones, a convergence study and a sweep on axes of one's own, with live text in the PDF."""
    sweep = fm.sweep(SCENE, {"membrane.prestretch": [1.0, 1.1, 1.2]}, quantity="equilibria", pressure=1.0, workers=1)
    curve = fm.fold_curve(SCENE, start=branch.special_points[0], parameter="material.mu.1", bounds=(0.002, 0.004), max_steps=3, throw=False)
    with matplotlib.style.context("femmembrane.views.page"):
        figure = Figure(layout="constrained")
        (a, b), (c, d) = figure.subplots(2, 2)
        assert branch.plot(ax=a, label="Ogden") is a
        assert study.plot(ax=b, quantities=["pressure"]) is b
        assert sweep.plot(ax=c, show=["equilibria"]) is c
        assert curve.plot(tmp_path / "figure.pdf", ax=d, y="volume") is d
    assert b.get_xscale() == b.get_yscale() == "log"
    assert c.get_xlabel()
    assert d.get_ylabel().startswith("at the fold: volume")
    assert (tmp_path / "figure.pdf").read_bytes().count(b"/Type /Font") > 0
    with pytest.raises(fm.InputError, match="y"):
        curve.plot(y="strength")


def test_axes_for_a_cost() -> None:
    look = {
        "degrees": (2,),
        "elements": (2, 4),
        "methods": (),
        "solvers": ("newton",),
        "repeat": 1,
        "parts": False,
        "reference_elements": 8,
    }
    study = fm.cost(SCENE, volume=1.0, **look)
    axes = Figure().subplots()
    assert study.plot(ax=axes, start="warm") is axes
    assert "ms" in axes.get_xlabel()
    with pytest.raises(fm.InputError, match="start"):
        study.plot(start="lukewarm")


def test_dots_of_print(branch: fm.Branch, tmp_path: Path) -> None:
    with rc_context({"savefig.dpi": 50}):
        branch.plot(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size[0] == pytest.approx(6.4 * 50, abs=1)


def test_a_legend_never_covers_a_line(branch: fm.Branch) -> None:
    """Where there is no room in the axes it stands below them, and the figure has room for it."""
    with matplotlib.style.context("femmembrane.views.column"):
        axes = branch.plot(x="center_height")
        assert not figures.covers(axes.get_legend(), axes)
        for level in np.linspace(*axes.get_ylim(), 8):  # now there is no room in the axes
            axes.plot(axes.get_xlim(), [level, level], color="0.8")
        figures.draw_legend(axes)
        plain = axes.figure.get_size_inches()[1]
        figures.draw_legend(axes)
        again = axes.figure.get_size_inches()[1]
    assert again == pytest.approx(plain)  # it grows once, however often the legend is drawn
    figure, legend = axes.figure, axes.get_legend()
    assert not figures.covers(legend, axes)
    assert not legend.get_window_extent().overlaps(axes.get_window_extent())
    assert figure.bbox.contains(*legend.get_window_extent().p0)
    assert figure.bbox.contains(*legend.get_window_extent().p1)
    free = Figure().subplots()
    free.plot([0, 1], [0, 1], label="a line")
    figures.draw_legend(free)
    assert not figures.covers(free.get_legend(), free)
    free.plot([0, 1], [1, 0])
    free.legend(loc="upper right")
    assert figures.covers(free.get_legend(), free)


def test_many_curves_are_told_apart_in_grey_as_well() -> None:
    """Of 28 curves no two have the same look, and next to each other neither lightness nor dashes are the same."""
    axes = Figure().subplots()
    plots.tell_apart(axes)
    lines = [axes.plot([0, k])[0] for k in range(28)]
    assert len({(line.get_color(), str(line._dash_pattern)) for line in lines}) == 28
    for a, b in itertools.pairwise(lines):
        assert a._dash_pattern != b._dash_pattern
        assert abs(lightness(a.get_color()) - lightness(b.get_color())) > 0.06


def lightness(color: str) -> float:
    return float(np.dot((0.2126, 0.7152, 0.0722), to_rgb(color)))


def test_a_legend_takes_the_corner_that_is_free() -> None:
    """Matplotlib's choice, the corner above the steep part of a curve, is nearer to the curve than it may be: another one is free."""
    _, axes = plots.new_figure((6.4, 4.6), title="a curve that levels off")
    x = np.linspace(0.0, 10.0, 201)
    axes.plot(x, np.tanh(x / 2.5), label="a name that is as long as a verdict")
    plots.draw_legend(axes)
    inside, box = axes.get_window_extent(), axes.get_legend().get_window_extent()
    assert inside.contains(*box.min)
    assert inside.contains(*box.max)
    assert not figures.covers(axes.get_legend(), axes)
