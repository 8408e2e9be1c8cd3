"""A sheet magnetised along its meridians has a cone at its pole in an axial field: what accuracy costs there, and how to grade for it.

At the pole all directions of magnetisation meet. In an axial field h the disc hangs from its rim with a constant transverse force,
(W_1/lambda_1) eta' = m_0 h at every radius, so that the slope does not vanish at the pole. This kink is real: stretches grow towards it,
though as slowly as the eighth root of a logarithm. On even elements the error of the height of the pole falls like their size, at any
degree. On elements that shrink geometrically towards the pole it falls with the size of the smallest one, and the degree counts again.

    python demos/cone.py                        picture and table in out/cone, 3 seconds

The exact numbers are those of the boundary-value problem in the logarithm of the radius, cut at exp(-16) and exp(-32) alike.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.quantities import axis_label
from femmembrane.views import plots

SCENE = fm.Scene(
    material=fm.NeoHookean(),
    mesh=fm.disc(elements=16),
    sources=[fm.Uniform(strength=0.25)],
    remanence=0.4,
    remanence_direction="meridional",
    title="A meridionally magnetised disc in an axial field",
)
HEIGHT, VOLUME, ENERGY = -0.4993885841, -0.5906595279103, -0.2421562812697
ELEMENTS, DEGREES = (8, 16, 32, 64, 128), (1, 2, 4, 6)
#: size of the smallest element of a geometric mesh, for each number of elements
SMALLEST = 1e-9
COLUMNS = ("mesh", "degree", "elements", "error_center_height", "error_volume", "error_energy")


def geometric(elements: int) -> fm.Disc:
    return fm.disc(radii=(0.0, *np.geomspace(SMALLEST, 1.0, elements).tolist()))


def errors(mesh: fm.Disc, degree: int) -> tuple[float, float, float]:
    eq = fm.equilibrium(SCENE.replace(mesh=mesh, degree=degree), pressure=0.0)
    return abs(eq.center_height / HEIGHT - 1), abs(eq.volume / VOLUME - 1), abs(eq.energy / ENERGY - 1)


def draw(rows: list[tuple[str, int, int, float, float, float]], path: Path) -> None:
    figure, (left, right) = plots.new_figure((10.5, 4.8), title=SCENE.title, widths=(1, 1.3))
    plots.draw_profile(left, fm.equilibrium(SCENE.replace(mesh=geometric(64), degree=4), pressure=0.0), plots.BOTH)
    left.set(xlabel=axis_label("rho"), ylabel=axis_label("eta"))
    for degree, color in zip(DEGREES, ("#999999", "#0072b2", "#d55e00", "#222222"), strict=True):
        for mesh, line in (("even", "-"), ("geometric", "--")):
            points = [(n, e) for kind, d, n, e, _, _ in rows if kind == mesh and d == degree]
            right.loglog(*np.array(points).T, "o", linestyle=line, ms=4, color=color, label=f"{mesh}, degree {degree}")
    right.set(xlabel="elements", ylabel="relative error of the height of the pole")
    right.grid(color="0.9", linewidth=0.6)
    plots.draw_legend(right, loc="lower left", fontsize=9)
    plots.save_figure(figure, path)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/cone"), help="folder for picture and table")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    meshes = {"even": fm.disc, "geometric": geometric}
    rows = [(name, d, n, *errors(of(n), d)) for name, of in meshes.items() for d in DEGREES for n in ELEMENTS]
    write_csv(out / "cone.csv", COLUMNS, rows)
    draw(rows, out / "cone.png")

    print(f"{'mesh':<10} {'degree':>6} {'elements':>8} {'pole height':>12} {'V':>9} {'E':>9}")
    for row in rows:
        print(f"{row[0]:<10} {row[1]:>6} {row[2]:>8} {row[3]:>12.1e} {row[4]:>9.1e} {row[5]:>9.1e}")

    found = {(name, d, n): (height, volume) for name, d, n, height, volume, _ in rows}
    for degree in DEGREES:  # of first order in the height of the pole at any degree
        assert 1.8 < found["even", degree, 32][0] / found["even", degree, 64][0] < 2.4
    assert found["geometric", 4, 64][0] < 1e-7
    assert found["geometric", 4, 64][1] < 1e-9


if __name__ == "__main__":
    main(sys.argv[1:])
