"""What a notebook shows: pictures and tables, and no names of objects; figures with text that stays text."""

from __future__ import annotations

import dataclasses
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from matplotlib import rc_context

import femmembrane as fm
from femmembrane.views import plots
from femmembrane.views.tex import in_tex

SCENE = fm.Scene(
    material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)), mesh=fm.disc(8), analysis=fm.Analysis(("pressure", "volume"))
)


@pytest.fixture(scope="module")
def branch() -> fm.Branch:
    return fm.inflate(SCENE, volumes=[0.5, 1.5, 4.0, 9.0], solver="newton")


def is_page(text: str) -> bool:
    return "<table>" in text and "object at 0x" not in text


def test_tables(branch: fm.Branch) -> None:
    zones = branch[-1].zones()
    assert is_page(zones._repr_html_())
    assert all(zone.kind in zones._repr_html_() for zone in zones)
    estimate = branch[-1].error_estimate()
    assert is_page(estimate._repr_html_())
    assert "lambda" in estimate._repr_html_()
    found = fm.equilibria(SCENE, pressure=1.8)
    page = found._repr_html_()
    assert is_page(page)
    assert "<img" in page
    assert page.count("<tr>") == len(found) + 1
    assert f"{found[0].volume:.6g}" in page


def test_pictures(branch: fm.Branch) -> None:
    limit = fm.trace(SCENE, start=2.0, until={"volume": 4.0}).special_points[0]
    curve = fm.fold_curve(SCENE, start=limit, parameter="material.mu.1", bounds=(0.002, 0.004), max_steps=3, throw=False)
    assert "<img" in curve._repr_html_()
    study = fm.convergence(SCENE, volume=1.0, elements=[2, 4, 8])
    assert "<img" in study._repr_html_()
    assert "<pre>" in study._repr_html_()
    sweep = fm.sweep(SCENE, {"membrane.prestretch": [1.0, 1.1]}, quantity="equilibria", pressure=1.0, workers=1)
    assert "<img" in sweep._repr_html_()


def test_axes_are_pictures(branch: fm.Branch) -> None:
    """Neither <Figure ...> nor <Axes ...>: the last value of a cell is a picture."""
    axes = branch.plot()
    for shown in (axes, axes.figure, branch.plot(x="center_height")):
        assert shown._repr_png_().startswith(b"\x89PNG")


# --- figures for papers


def test_any_quantity_against_any_other(branch: fm.Branch) -> None:
    axes = branch.plot(x="center_height", y="lambda_pressure")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("pole height η(0)/R₀", "λ, pressure held")
    corners = np.concatenate([line.get_xydata() for line in axes.lines if line.get_label().startswith("stable")]).tolist()
    values = np.stack([branch.center_height, branch.column("lambda_pressure")], axis=1).tolist()
    assert all(value in corners for value in values)
    assert len(corners) > 2 * len(values)  # no polygon through the equilibria
    assert branch.plot(x="step").get_xlabel() == "step"
    for name in ("center_heigth", "verdict_pressure", "status"):
        with pytest.raises(fm.InputError, match="column"):
            branch.plot(x=name)


def test_several_branches_on_given_axes(branch: fm.Branch) -> None:
    from matplotlib.figure import Figure

    untested = fm.inflate(SCENE.replace(analysis=fm.Analysis(), material=fm.NeoHookean()), volumes=[0.5, 1.5, 4.0], solver="newton")
    ax = Figure().subplots()
    assert branch.plot(ax=ax, label="Ogden") is ax
    untested.plot(ax=ax, label="neo-Hookean")
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels == [
        "Ogden",
        "neo-Hookean",
        "among axisymmetric shapes:",
        "stable under both controls",
        "stable under volume control only",
        "stability not tested",
    ]
    colors = {line.get_color() for line in ax.lines if line.get_label() in ("Ogden", "neo-Hookean")}
    assert len(colors) == 2


@pytest.mark.parametrize("suffix", [".svg", ".pdf"])
def test_text_stays_text(branch: fm.Branch, tmp_path: Path, suffix: str) -> None:
    branch.plot(tmp_path / f"figure{suffix}")
    content = (tmp_path / f"figure{suffix}").read_bytes()
    assert (b">stable under both controls<" if suffix == ".svg" else b"/Subtype /Type0") in content


def test_pgf_says_what_it_needs(branch: fm.Branch, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(fm.InputError, match="LaTeX is needed"):
        branch.plot(tmp_path / "figure.pgf")


@pytest.mark.parametrize(
    ("words", "math", "tex"),
    [
        ("volume V/R₀³", True, "volume V/R$_{0}$$^{3}$"),
        ("μ λ Λ Ω Α ο", True, r"$\mu$ $\lambda$ $\Lambda$ $\Omega$ Α ο"),  # noqa: RUF001  # TeX has no Alpha
        ("−0.5 ± 1 … µT", True, r"$-$0.5 $\pm$ 1 \dots{} $\mu$T"),  # noqa: RUF001
        ("$10^{-3}$ & ü", True, "$10^{-3}$ & ü"),
        (r"5 $ & #1 {x} ~ \z", False, r"5 \$ \& \#1 \{x\} \textasciitilde{} \textbackslash{}z"),
    ],
)
def test_texts_for_tex(words: str, math: bool, tex: str) -> None:
    assert in_tex(words, math) == tex


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="no LaTeX is installed")
def test_a_document_reads_pgf(branch: fm.Branch, tmp_path: Path) -> None:
    """Its words are set by the document, whose LaTeX need not know Greek letters; and the figure has its own words again afterwards."""
    scene = branch.scene.replace(title="50 % & $")
    axes = dataclasses.replace(branch, scene=scene).plot()
    with rc_context({"pgf.texsystem": "pdflatex"}):
        plots.save_figure(axes.figure, tmp_path / "a.pgf")
    assert axes.get_xlabel() == "volume V/R₀³"
    words = (tmp_path / "a.pgf").read_text(encoding="utf-8")
    assert "stable under both controls" in words
    assert "R$_{0}$$^{3}$" in words
    head = r"\documentclass{article}\usepackage{pgf}\def\mathdefault#1{#1}"
    (tmp_path / "paper.tex").write_text(head + r"\begin{document}\input{a.pgf}\end{document}", encoding="utf-8")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "paper.tex"]
    assert subprocess.run(command, cwd=tmp_path, capture_output=True, check=False).returncode == 0
    assert (tmp_path / "paper.pdf").stat().st_size > 1000


def test_a_uniform_stretch_is_level() -> None:
    """A sphere is stretched evenly: what differs by 1e-4 of it is no zig-zag over the whole figure."""
    from femmembrane.quantities import SCALED
    from femmembrane.views.report import _along

    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.sphere(4), degree=1)
    eq = fm.equilibrium(scene, volume=1.5 * scene_volume(scene))
    (axes,) = _along(eq, ("stretch_1", "stretch_2"), SCALED).axes
    low, high = axes.get_ylim()
    assert high - low >= 0.0099 * low


def scene_volume(scene: fm.Scene) -> float:
    return float(fm.equilibrium(scene, pressure=1e-6, solver="newton").volume)


# --- what is said


def test_captions_have_all_verdicts() -> None:
    from femmembrane.views.viewer import _caption

    def said(analysis: fm.Analysis) -> str:
        eq = fm.inflate(SCENE.replace(analysis=analysis), volumes=[1.0], solver="newton")[0]
        return " ".join(_caption(eq, 0, 1).split("\n")[1:])

    assert said(fm.Analysis(("pressure",))) == "stable against axisymmetric perturbations (pressure held)"
    assert said(fm.Analysis(("pressure", "volume"))) == "stable against axisymmetric perturbations (pressure held), stable (volume held)"
    assert said(fm.Analysis(("volume",), azimuthal_modes=(1,))) == "stable under volume control, stable against n = 1"
