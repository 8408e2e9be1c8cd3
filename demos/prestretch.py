"""Stretched over its rim before it is inflated: how pre-stretch takes away the limit point.

A disc of the paper's rubber (table 1) bears a largest pressure, and beyond it the pressure falls to a minimum before it rises again.
Here it is first drawn out to a rim of p times its radius, and then inflated. The maximum and the minimum come closer as p grows, meet in a
cusp and vanish: beyond that pre-stretch every pressure holds one state, and nothing snaps. A neo-Hookean disc keeps its maximum. Far
stretched it is a soap film, which bears most as a half sphere: P p = 2.

    python demos/prestretch.py --out out/prestretch

prints the limit points over p and writes prestretch.csv and prestretch.png.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import colormaps

import femmembrane as fm
from femmembrane.accuracy.shooting import shoot
from femmembrane.accuracy.strong_form import Guess
from femmembrane.views.plots import new_figure, save_figure

RUBBER = fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0))
STRETCHES = (1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8)


def scene(material: object, stretch: float) -> fm.Scene:
    return fm.Scene(material=material, mesh=fm.disc(16), degree=4, prestretch=stretch)  # type: ignore[arg-type]


def inflated(material: object, stretch: float) -> fm.Branch:
    """From the flat membrane, which tension keeps stiff, to 40 times the volume of a moderate dome."""
    start = 0.0 if stretch > 1 else 0.05
    return fm.trace(scene(material, stretch), start=start, until={"volume": 40 * stretch**3})


def limits(branch: fm.Branch) -> list[fm.Equilibrium]:
    return [point.equilibrium for point in branch.special_points if point.kind == "limit_point"]


def vanishing(stretch: float, step: float) -> float:
    """The pre-stretch at which both limit points meet, from one at which there are two.

    Next to a cusp the square of their distance in log V falls linearly; each straight line through two such squares leads nearer.
    """
    known: list[tuple[float, float]] = []
    while abs(step) > 1e-6:
        found = limits(inflated(RUBBER, stretch))
        assert len(found) == 2
        known.append((stretch, np.log(found[1].volume / found[0].volume) ** 2))
        if len(known) > 1:
            (p0, square0), (p1, square1) = known[-2:]
            end = p1 + square1 * (p1 - p0) / (square0 - square1)
            step = 0.8 * (end - stretch)
            if square1 < 2e-3:
                return end
        stretch += step
    return stretch


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/prestretch"), help="folder for table and picture")
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)

    figure, axes = new_figure((8.0, 5.0), title="A disc stretched over its rim, then inflated")
    colors = iter(colormaps["viridis"](np.linspace(0.0, 0.85, len(STRETCHES))))  # from dark to light
    rows = []
    print(f"{'pre-stretch':>11}{'P max':>11}{'at V':>10}{'P min':>11}{'at V':>10}{'neo-Hookean: P max':>20}{'P max p':>10}")
    for p in STRETCHES:
        branch = inflated(RUBBER, p)
        found = limits(branch)
        soft = limits(inflated(fm.NeoHookean(), p))[0]
        numbers = [value for eq in found for value in (eq.pressure, eq.volume)] or [np.nan] * 4
        rows.append([p, *numbers, soft.pressure])
        shown = "".join(f"{value:{width}.{digits}f}" for value, width, digits in zip(numbers, (11, 10) * 2, (6, 3) * 2, strict=True))
        print(f"{p:11.2f}{shown.replace('nan', '  -')}{soft.pressure:20.6f}{soft.pressure * p:10.6f}")
        volume, pressure = branch.column("volume"), branch.column("pressure")
        (line,) = axes.plot(volume, pressure, color=next(colors), label=f"p = {p:g}")
        axes.plot([eq.volume for eq in found], [eq.pressure for eq in found], "o", color=line.get_color(), ms=4)
    with (asked.out / "prestretch.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([["prestretch", "P_max", "V_max", "P_min", "V_min", "P_max_neo_hookean"], *rows])
    axes.set(xlabel="volume V/R₀³", ylabel="pressure P = p R₀/(μT)", xlim=(0, 40), ylim=(0, 2.1))
    axes.legend(fontsize=8, frameon=False)
    save_figure(figure, asked.out / "prestretch.png")

    end = vanishing(1.4, 0.05)
    print(f"\nthe limit points meet, and vanish beyond, at the pre-stretch {end:.5f}")

    # shooting, which shares nothing with the elements, finds no limit point just beyond, and two just before
    for p, count in ((end - 0.005, 2), (end + 0.005, 0)):
        pressure = []
        for volume in np.linspace(9.0, 16.0, 15):
            near = fm.equilibrium(scene(RUBBER, p), volume=float(volume))
            found = shoot(scene(RUBBER, p), guess=Guess.of(near), volume=float(volume))
            assert found.converged
            pressure.append(found.pressure)
        turns = int((np.diff(np.sign(np.diff(pressure))) != 0).sum())
        assert turns == count, (p, turns)
    table = np.array(rows)
    assert (np.diff(table[:, 1][~np.isnan(table[:, 1])]) < 0).all()
    assert (np.diff(table[:, 5] * table[:, 0]) > 0).all()
    assert abs(limits(inflated(fm.NeoHookean(), 30.0))[0].pressure * 30 - 2) < 1e-8


if __name__ == "__main__":
    main(sys.argv[1:])
