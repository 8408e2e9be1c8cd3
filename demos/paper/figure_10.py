"""Figure 10: several equilibria at one pressure, all that can be found, with what each is stable against.

(a) P = 1.85, M = 600, h = -3.5 (dipole below): four.
(b) P = 1.8, M = 200, h = 6.5 (dipole above): four, as in the paper.

A search traces branches through several starts and deflates what it has found; it never proves that there are no more. The paper calls all
states of (a) stable, and three of (b), that with the highest pole uncertain. Where a pressure is held, two of the four are unstable in
each, those on the falling parts of the curve of pressure against volume: two unstable ones, at least, must separate three stable ones. Held
at their volumes they are stable, except the highest one of (b). The flattest state but one of (a) tips sideways besides.

    python demos/paper/figure_10.py                pictures and tables in out/figure-10, 6 seconds

Volumes and verdicts were recorded with this package on 2026-11-22.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import paper
from paper import Result, Row

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.views import plots

LOADS = {"a": (600.0, -3.5, 1.85), "b": (200.0, 6.5, 1.8)}
COLUMNS = ("energy", "volume", "pressure", "center_height", "verdict_pressure", "verdict_volume", "verdict_n1")


def words(eq: fm.Equilibrium) -> tuple[str, str, str]:
    """Verdicts under pressure control, under volume control, and against n = 1."""
    return eq.verdict("pressure").word, eq.verdict("volume").word, eq.verdict(azimuthal=1).word


def save(found: fm.Equilibria, path: Path) -> None:
    rows = [(e, eq.volume, eq.pressure, eq.center_height, *words(eq)) for e, eq in zip(found.energies, found, strict=True)]
    write_csv(path, COLUMNS, rows)


def draw(found: dict[str, fm.Equilibria], path: Path) -> None:
    """All profiles with their zones by total stress, and the flat ones again on their own scale."""
    figure, panels = plots.new_figure((14.0, 5.4), widths=(1, 1, 1, 1))
    for axes, (name, flat) in zip(panels, [(name, flat) for name in found for flat in (False, True)], strict=True):
        strength, height, load = LOADS[name]
        shown = [eq for eq in found[name] if eq.volume < 5 or not flat]
        paper.draw_halves(axes, shown, [plots.verdict_style(eq) for eq in shown])
        for eq in shown:
            if flat or eq.volume > 5:
                below = (name == "b" and 4 < eq.center_height < 5) or eq.center_height < 0.4  # what is above is in the way
                place = {"xytext": (4, -18 if below else 6), "va": "top" if below else "bottom"}
                text = f"V = {eq.volume:.4g}" + (", tips" if paper.tips(eq) else "")
                axes.annotate(text, (0, eq.center_height), textcoords="offset points", fontsize=10, **place)
        axes.set_title(
            f"({name}) the flat ones, enlarged" if flat else f"({name}) P = {load:g}, M = {strength:g}, h = {height:g}", fontsize=11
        )
        axes.set(xlim=(0, 1.25), ylim=(-0.05, 1.6)) if flat else axes.set(xlim=(0, 3.1), ylim=(-0.2, 4.6 if name == "a" else 7.1))
    paper.shared_legend(figure, panels, 3, dipole=True)
    plots.save_figure(figure, path)


def make(out: Path) -> Result:
    found = {
        name: fm.equilibria(paper.scene(strength, height, wrinkling="total"), pressure=load)
        for name, (strength, height, load) in LOADS.items()
    }
    for name, states in found.items():
        save(states, out / f"figure-10{name}.csv")
    draw(found, out / "figure-10.png")
    rows = [Row("10b", "equilibria at P = 1.8, M = 200, h = 6.5", "4", f"{len(found['b'])}", shown=True)]
    for name, states in found.items():
        top = max(states, key=lambda eq: eq.center_height)
        for k, eq in enumerate(sorted(states, key=lambda eq: -eq.center_height)):
            word = "uncertain" if name == "b" and eq is top else "stable"
            rows.append(Row(f"10{name}", f"state {k + 1}, V = {eq.volume:.4g}: stability", word, paper.verdict_words(eq)))
    paper.write_rows(rows, out / "figure-10.csv")

    for states, volumes in zip(
        found.values(), ((69.17923, 0.75036, 0.43732, 3.87710), (66.16485, 73.78814, 1.79181, 3.72868)), strict=True
    ):
        np.testing.assert_allclose([eq.volume for eq in states], volumes, atol=2e-5)
        np.testing.assert_allclose([eq.pressure for eq in states], states.load, rtol=1e-12)
    s, u = "stable", "unstable"
    assert [words(eq) for eq in found["a"]] == [(s, s, s), (s, s, s), (u, s, u), (u, s, s)]
    assert [words(eq) for eq in found["b"]] == [(s, s, s), (u, u, s), (s, s, s), (u, s, s)]
    return Result((out / "figure-10.png",), tuple(rows))


if __name__ == "__main__":
    paper.main("figure-10", __doc__, make)
