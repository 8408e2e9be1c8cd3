"""Several equilibria at one pressure: all that can be found, with their energies and what each is stable against.

(a) P = 1.8, M = 200, h = 6.5 (dipole above): four.
(b) P = 1.85, M = 600, h = -3.5 (dipole below): four.

A search traces branches through several starts and deflates what it has found; it never proves that there are no more. The energy is
E - P V, which orders states held at one pressure. A state can be stable among axisymmetric shapes and still tip sideways (n = 1), as the
flattest but one in (b) does.

    python demos/all_equilibria.py              pictures and tables in out/all_equilibria, 6 seconds

Sources: material and scenes from Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), table 1 and figure 10. Volumes and
verdicts were recorded with this package on 2026-11-22.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import femmembrane as fm
from femmembrane.views import plots

COLUMNS = ("energy", "volume", "pressure", "center_height", "verdict_pressure", "verdict_volume", "verdict_n1")


def scene(strength: float, height: float) -> fm.Scene:
    return fm.Scene(
        material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
        sources=[fm.Dipole(strength=strength, height=height)],
        susceptibility=2.5,
        mesh=fm.disc(elements=64),
    )


def words(eq: fm.Equilibrium) -> tuple[str, str, str]:
    """Verdicts under pressure control, under volume control, and against n = 1."""
    return eq.verdict("pressure").word, eq.verdict("volume").word, eq.verdict(azimuthal=1).word


def show(title: str, found: fm.Equilibria) -> None:
    print(f"\n{title}: {len(found)} found\n  {found.searched}")
    print(f"  {'energy':>11} {'volume':>9} {'pole':>8}  {'pressure':<9} {'volume':<9} n = 1")
    for energy, eq in zip(found.energies, found, strict=True):
        pressure, volume, tipping = words(eq)
        print(f"  {energy:>11.6f} {eq.volume:>9.5f} {eq.center_height:>8.5f}  {pressure:<9} {volume:<9} {tipping}")


def save(found: fm.Equilibria, path: Path) -> None:
    rows = [(e, eq.volume, eq.pressure, eq.center_height, *words(eq)) for e, eq in zip(found.energies, found, strict=True)]
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([COLUMNS, *rows])


def draw(title: str, found: fm.Equilibria, path: Path) -> None:
    """All profiles, and the flat ones again on their own scale."""
    figure, (left, right) = plots.new_figure((10.0, 5.4), title=title, widths=(1, 1))
    styles = {eq: plots.verdict_style(eq) for eq in found}
    flat = [eq for eq in found if eq.volume < 5]
    for axes, shown, named in ((left, list(found), [eq for eq in found if eq not in flat]), (right, flat, flat)):
        for eq in shown:
            plots.draw_profile(axes, eq, plots.Style("", styles[eq].dashes, styles[eq].color, styles[eq].width))
        for eq in named:
            name = f"V = {eq.volume:.4g}" + ("\ntips sideways (n = 1)" if words(eq)[2] == "unstable" else "")
            place = {"va": "top", "xytext": (0, -4)} if axes is right else {"va": "bottom", "xytext": (0, 4)}
            axes.annotate(name, (0, eq.center_height), textcoords="offset points", ha="center", fontsize=9, **place)
        plots.draw_surroundings(axes, shown)
    right.set_title("the flat ones, enlarged", fontsize=10)
    for style in dict.fromkeys(styles.values()):
        left.plot([], [], linestyle=style.dashes, color=style.color, linewidth=style.width, label=style.label)
    handles, labels = plots.legend_entries(left)
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False, fontsize=9, handlelength=3.2)
    plots.save_figure(figure, path)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/all_equilibria"), help="folder for pictures and tables")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)
    loads = {"above": (200, 6.5, 1.8), "below": (600, -3.5, 1.85)}
    results = {name: fm.equilibria(scene(strength, height), pressure=load) for name, (strength, height, load) in loads.items()}
    for name, found in results.items():
        title = "M = {}, h = {}, P = {}".format(*loads[name])
        show(title, found)
        save(found, out / f"{name}.csv")
        draw(f"All equilibria found at {title}", found, out / f"{name}.png")

    for found, volumes in zip(
        results.values(), ((66.16485, 73.78814, 1.79181, 3.72868), (69.17923, 0.75036, 0.43732, 3.87710)), strict=True
    ):
        np.testing.assert_allclose([eq.volume for eq in found], volumes, atol=2e-5)
        np.testing.assert_allclose([eq.pressure for eq in found], found.load, rtol=1e-12)
    s, u = "stable", "unstable"
    assert [words(eq) for eq in results["above"]] == [(s, s, s), (u, u, s), (s, s, s), (u, s, s)]
    assert [words(eq) for eq in results["below"]] == [(s, s, s), (s, s, s), (u, s, u), (u, s, s)]


if __name__ == "__main__":
    main(sys.argv[1:])
