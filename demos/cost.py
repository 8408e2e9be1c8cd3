"""What accuracy costs: error in the pressure against time, by finite elements of every degree and by methods that share nothing with them.

The three-term Ogden disc below a dipole (M = 200, h = 6.5), well inflated: V = 75.4. Prints every measurement, writes cost.csv and
cost.png. With --growth also time, memory and the round-off of the pressure on 10 to 1,000,000 elements, and growth.csv.

    python demos/cost.py                     about a minute
    python demos/cost.py --growth            about four minutes, and 7 GB of memory
    python demos/cost.py --quick             few meshes, each measured once; --growth then ends at 10,000 elements
    python demos/cost.py --picture FILE      the picture alone to a file of that name as well

Times are medians in one process, taken in turns. On a shared machine they scatter by tens of per cent: compare rows with each other.
Source of the scene and of "shooting as published": Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), table 1 and section 3.
"""

from __future__ import annotations

import argparse
import gc
import sys
import time
import tracemalloc
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.potential import Potential
from femmembrane.solve.controls import VolumeControl
from femmembrane.solve.newton import correct
from femmembrane.threads import one_thread
from femmembrane.verbs.cost import QUICK

VOLUME = 75.4
SCENE = fm.Scene(
    material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
    sources=[fm.Dipole(strength=200, height=6.5)],
    susceptibility=2.5,
    mesh=fm.disc(elements=64),
    title="Ogden membrane below a dipole",
)
GROWTH = ("elements", "set_up_s", "solve_s", "iterations", "peak_bytes", "error", "round_off", "residual")


def check(study: fm.Cost) -> None:
    """On errors alone: how long anything takes is the machine's."""

    def error(degree: int, elements: int) -> float:
        return study.select(method="newton", start="warm", degree=degree, elements=elements)[0].error

    assert study.reference.error < 1e-12, study.reference
    assert 3.5 < np.log2(error(2, 8) / error(2, 16)) < 4.5
    assert error(6, 16) < 1e-12, error(6, 16)
    independent = [line for line in study.select(what="solve") if line.degree is None]
    assert independent
    for line in independent:
        assert line.converged, line
        # leaving the pole on a straight line limits the published method to some 1e-8, whatever its tolerance
        assert line.error < max(10 * line.tolerance, 1e-7 if line.method == "published" else 0.0), line


def solve(potential: Potential, volume: float, fine: fm.Equilibrium) -> tuple[object, float]:
    """The equilibrium at V = 75.4 from a finely resolved one at another volume, by Newton's method, and the seconds it took."""
    points = potential.space.interpolation_points()
    u, _, w, _ = fine.potential.space.evaluate(fine.state, points.ravel())
    guess = potential.space.interpolate(u.reshape(points.shape), w.reshape(points.shape))
    del u, w, points
    clock = time.perf_counter()
    result = correct(potential, VolumeControl(volume), guess, fine.pressure)
    return result, time.perf_counter() - clock


def build(elements: int) -> Potential:
    """Quadratic elements, their quadrature asked for by its number so that nothing built before is used."""
    potential = Potential(SCENE.replace(mesh=fm.disc(elements=elements)), quadrature=5)
    potential.evaluate(np.zeros(potential.space.n_free), 0.0)
    return potential


@one_thread  # as every verb of the package
def growth(sizes: Sequence[int]) -> list[dict[str, float]]:
    """One row a mesh: a timed pass, then one that counts the memory of all arrays and comes from the other side."""
    fine = SCENE.replace(degree=8)
    below, exact, above = fm.inflate(fine, volumes=[VOLUME - 1.2, VOLUME, VOLUME + 1.2], solver="newton")
    rows = []
    for elements in sizes:
        clock = time.perf_counter()
        potential = build(elements)
        set_up = time.perf_counter() - clock
        first, seconds = solve(potential, VOLUME, below)
        numbers = first.pressure, first.iterations, first.residual
        del potential, first
        gc.collect()
        tracemalloc.start()
        second, _ = solve(build(elements), VOLUME, above)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        error, round_off = (abs(numbers[0] / p - 1) for p in (exact.pressure, second.pressure))
        rows.append(dict(zip(GROWTH, (elements, set_up, seconds, numbers[1], peak, error, round_off, numbers[2]), strict=True)))
        del second
        gc.collect()
    return rows


def show_growth(rows: Sequence[dict[str, float]]) -> None:
    print("\nquadratic elements   set-up s    solve s  us an element  peak MB  kB an element  error in P  round-off of P  residual")
    for row in rows:
        n, each = int(row["elements"]), 1e6 * row["solve_s"] / row["elements"]
        print(
            f"{n:>18} {row['set_up_s']:>10.3f} {row['solve_s']:>10.4f} {each:>14.1f} {row['peak_bytes'] / 1e6:>8.1f} "
            f"{row['peak_bytes'] / 1e3 / n:>14.2f} {row['error']:>11.1e} {row['round_off']:>15.1e} {row['residual']:>9.1e}"
        )
    print(
        "Round-off: how far apart P is when the same mesh is solved from smaller and from larger volumes. A displacement rounded to\n"
        "16 digits moves a strain by 1e-16 over the size of an element, so the forces at a node balance to a residual that grows with\n"
        "the number of elements; the pressure is a mean over all of them, in which most of that cancels."
    )


def write(rows: Sequence[dict[str, float]], path: Path) -> None:
    write_csv(path, GROWTH, ([row[name] for name in GROWTH] for row in rows))


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="few meshes, each measured once")
    parser.add_argument("--growth", action="store_true", help="time and memory on up to 1,000,000 elements (10,000 with --quick)")
    parser.add_argument("--out", type=Path, default=Path("out/cost"), help="folder for tables and picture")
    parser.add_argument("--picture", type=Path, help="another name for the picture")
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)

    study = fm.cost(SCENE, volume=VOLUME, **(QUICK if asked.quick else {}))
    print(study)
    study.write_csv(asked.out / "cost.csv")
    study.plot(asked.out / "cost.png")
    if asked.picture:
        study.plot(asked.picture)
    check(study)

    if asked.growth:
        sizes = [10**k for k in range(1, 5 if asked.quick else 7)]
        rows = growth(sizes)
        show_growth(rows)
        write(rows, asked.out / "growth.csv")
        bytes_each = [row["peak_bytes"] / row["elements"] for row in rows if row["elements"] >= 1000]
        assert max(bytes_each) < 1.5 * min(bytes_each), bytes_each  # memory grows in proportion to the elements
        assert all(row["round_off"] < 1e-11 for row in rows), rows


if __name__ == "__main__":
    main(sys.argv[1:])
