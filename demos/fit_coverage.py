"""Do 95 % intervals hold the truth 95 times in 100? And what does a usual bulge test say about usual materials?

The test has 20 heights of the pole, in the middles of as many parts up to the height at which the pole is stretched by 2, and pressures
with a scatter of 1 %. For each material data sets are drawn from the truth and fitted, and the intervals that hold the truth are counted.

    python demos/fit_coverage.py --out out/fit_coverage

draws a thousand data sets for each of five materials on all processors, which takes minutes (--quick: a few), and writes fit_coverage.csv
and fit_coverage.png.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

import femmembrane as fm
from femmembrane.calibration.bulge import Bulge, pole_stretch
from femmembrane.calibration.laws import Law
from femmembrane.calibration.least_squares import Problem
from femmembrane.calibration.measured import measured_tests
from femmembrane.calibration.resampling import inside, refits
from femmembrane.calibration.statistics import spread_of
from femmembrane.views.plots import new_figure, save_figure

MATERIALS: dict[str, tuple[object, list[str]]] = {
    "neo-Hookean": (fm.NeoHookean(), ["material.mu"]),
    "Mooney-Rivlin": (fm.MooneyRivlin(0.1), ["material.c10", "material.c01"]),
    "Gent": (fm.Gent(30.0), ["material.mu", "material.jm"]),
    "Ogden, 1 term": (fm.Ogden((1.25,), (1.6,)), ["material.mu.0", "material.alpha.0"]),
    "Yeoh": (fm.Yeoh(-0.005, 0.0003), ["material.c1", "material.c2", "material.c3"]),
}
PAPER = fm.Ogden((1.4910, 0.0029, -0.0236), (1.3, 5.0, -2.0))


def usual_test(material: object, names: list[str]) -> Problem:
    """Twenty exact rows, whose pressures are said to scatter by 1 %."""
    law = Law(fm.Scene(material=material, mesh=fm.disc(8), degree=4), names)  # type: ignore[arg-type]
    bulge = Bulge(law, law.scene, "center_height")

    def states(heights: np.ndarray):  # type: ignore[no-untyped-def]
        found = bulge.states(law.start, heights)
        assert found is not None, bulge.why
        return found

    top = brentq(lambda height: pole_stretch(states(np.array([height])), 0)[0] - 2, 0.7, 1.4, xtol=1e-6)
    heights = (np.arange(20) + 0.5) / 20 * top
    return Problem(law, measured_tests(law, {"center_height": heights, "pressure": states(heights).pressure}, "1 %", None))


def covered(name: str, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, int]:
    """Relative standard errors, scatter, part of the profile and linearised intervals that hold the truth, and fits on a bound."""
    material, names = MATERIALS[name]
    problem = usual_test(material, names)
    truth = problem.law.start
    point = problem.at(truth)
    assert point is not None
    errors = spread_of(point.jacobian, truth).errors / np.abs(truth)
    values, by_profile, linear, on_bound = [], [], [], 0
    for refit in refits(problem, truth, count, seed=7):
        assert refit is not None
        values.append(refit.estimate.point.values)
        linear.append((refit.intervals[:, 0] <= truth) & (truth <= refit.intervals[:, 1]))
        by_profile.append(inside(problem, refit, truth))
        on_bound += bool(refit.estimate.on_bound)
    return errors, np.std(values, axis=0) / np.abs(truth), np.mean(by_profile, axis=0), np.mean(linear, axis=0), on_bound


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/fit_coverage"), help="folder for table and picture")
    parser.add_argument("--samples", type=int, default=1000, help="data sets for each material")
    parser.add_argument("--quick", action="store_true", help="twelve data sets, in this process")
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)
    count = 12 if asked.quick else asked.samples

    if asked.quick:
        results = [covered(name, count) for name in MATERIALS]
    else:
        with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
            results = list(pool.map(covered, MATERIALS, [count] * len(MATERIALS)))
    rows = []
    print(f"{'material':<15}{'number':<10}{'standard error':>15}{'scatter':>10}{'covered':>10}{'linearised':>12}{'on a bound':>12}")
    for name, (errors, scatter, held, linear, on_bound) in zip(MATERIALS, results, strict=True):
        for k, number in enumerate(MATERIALS[name][1]):
            short = number.removeprefix("material.")
            rows.append([name, short, 100 * errors[k], 100 * scatter[k], 100 * held[k], 100 * linear[k], on_bound])
            cells = f"{100 * errors[k]:>13.2f} %{100 * scatter[k]:>8.2f} %{100 * held[k]:>8.1f} %{100 * linear[k]:>10.1f} %"
            print(f"{name:<15}{short:<10}{cells}{on_bound:>12}")
    with (asked.out / "fit_coverage.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(
            [["material", "number", "standard_error_%", "scatter_%", "covered_%", "covered_linearised_%", "on_bound"], *rows]
        )

    three = usual_test(PAPER, [f"material.{key}.{k}" for key in ("mu", "alpha") for k in range(3)])
    point = three.at(three.law.start)
    assert point is not None
    worst = 100 * (spread_of(point.jacobian, three.law.start).errors / np.abs(three.law.start)).min()
    print(f"\nthree terms of Ogden's: the best known of six numbers has a standard error of {worst:.0f} %: they are not determined")

    figure, axes = new_figure((7.5, 4.2), title=f"Intervals that hold the truth, of {count} data sets")
    labels = [f"{row[0]}: {row[1]}" for row in rows]
    places = np.arange(len(rows))[::-1]
    axes.axvspan(93, 97, color="0.9", zorder=0, linewidth=0)
    axes.plot([row[4] for row in rows], places, "o", color="#0072b2")
    axes.set_yticks(places, labels)
    axes.set_xlabel("covered, in %")
    axes.set_xlim(min(90.0, *(row[4] - 1 for row in rows)), 100.5)
    save_figure(figure, asked.out / "fit_coverage.png")

    # standard errors of an independent code, whose heights are spread a little differently
    independent = [0.22, 0.80, 4.8, 0.30, 6.5, 6.9, 7.1, 0.33, 42.0, 157.0]
    assert np.allclose([row[2] for row in rows], independent, rtol=0.07)
    assert worst > 1000
    if not asked.quick and count >= 1000:
        assert all(93 <= row[4] <= 97 for row in rows)


if __name__ == "__main__":
    main(sys.argv[1:])
