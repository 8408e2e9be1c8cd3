"""How many wrinkles: the bending stiffness of the sheet chooses the number of waves in the wrinkled scenes of the paper.

Without bending a compressed membrane is unstable against waves shorter than any, and nothing says how many wrinkles there are. With
``bending=True`` the second variation about the same states has the bending stiffness mu T^3/3 of the sheet, with its deformed thickness.
Every number n of waves around the axis then has an eigenvalue, and one n has the lowest.

1. The states of figures 7 to 9, for a sheet with R0/T = 1000: the worst n, the wavelength of its waves, and the part of the area in which
   the hoop stress is compressive. The states of figure 7, and those of figure 9 at large volumes, do not wrinkle: the worst is n = 1.
2. The pole falls, and the first of all numbers n >= 3 becomes unstable: where, and which, for three thicknesses. (The membrane may tip
   over or turn oval before, with n = 1 or 2: that hardly depends on its thickness.) The thinner the sheet, the sooner it wrinkles, and in
   figure 8a n grows about like (R0/T)^(2/3), as the compressed zone has just opened. In figure 8b the thinnest sheet has three lobes
   before it has short wrinkles. Deep in the wrinkled states n grows like R0/T, and eigenvalues like its square.

    python demos/wrinkle_numbers.py                tables and picture in out/wrinkle_numbers, 30 seconds
    python demos/wrinkle_numbers.py --quick        fewer states and thicknesses

Sources: material and scenes from Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), table 1 and figures 7 to 9.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.views import plots

#: figure, strength and height of the dipole, heights of the pole
CASES = (
    ("7b", 200.0, 4.0, (0.4,)),
    ("8a", 400.0, -3.25, (0.1, -0.1, -0.2, -0.3, -0.4, -0.5)),
    ("8b", 400.0, -3.75, (0.1, -0.1, -0.2, -0.3, -0.4, -0.5)),
    ("9", 600.0, -3.25, (2.0, 0.6, 0.36)),
)
#: heights of the pole between which the first wrinkles set in, of the figures in which they do
SOUGHT = {"8a": (0.0, -0.2), "8b": (0.0, -0.3)}
THICKNESSES = (100.0, 1000.0, 10000.0)
COLUMNS = ("figure", "strength", "height", "center_height", "pressure", "compressed", "waves", "wavelength", "lambda")
ONSETS = ("figure", "radius_to_thickness", "center_height", "pressure", "waves", "wavelength")
LOOKS = (("#56b4e9", "^"), ("#0072b2", "o"), ("#d55e00", "s"))


def scene(strength: float, height: float, ratio: float = 1000.0) -> fm.Scene:
    return fm.Scene(
        material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
        sources=[fm.Dipole(strength=strength, height=height)],
        susceptibility=2.5,
        mesh=fm.disc(elements=32),
        degree=4,
        radius_to_thickness=ratio,
        bending=True,
    )


def states(quick: bool) -> list[list[object]]:
    """The worst number of waves of each state, R0/T = 1000."""
    rows: list[list[object]] = []
    for figure, strength, height, poles in CASES:
        for pole in poles if not quick else [pole for pole in poles if pole in (0.4, -0.3)]:
            eq = fm.equilibrium(scene(strength, height), center_height=pole)
            worst = eq.verdict(azimuthal="all")
            compressed = 1 - eq.zones("mechanical").fraction("taut")
            numbers = (compressed, worst.azimuthal, worst.wavelength, worst.smallest_eigenvalue)
            rows.append([figure, strength, height, pole, eq.pressure, *numbers])
    return rows


def worst_wrinkles(eq: fm.Equilibrium, numbers: Sequence[int]) -> fm.Verdict:
    return min((eq.verdict(azimuthal=n) for n in numbers), key=lambda verdict: verdict.smallest_eigenvalue)


def onset(of: fm.Scene, heights: tuple[float, float], accuracy: float = 1e-3) -> tuple[fm.Equilibrium, fm.Verdict]:
    """The first state of a falling pole that is unstable against some n >= 3, by bisection, and the verdict against that n."""
    above, below = heights
    numbers = sorted({round(n) for n in np.geomspace(3, of.radius_to_thickness / 8, 25)})
    while True:
        eq = fm.equilibrium(of, center_height=(above + below) / 2)
        found = worst_wrinkles(eq, numbers)
        if above - below < accuracy:
            near = range(max(3, round(0.93 * found.azimuthal)), round(1.07 * found.azimuthal) + 1)
            return eq, worst_wrinkles(eq, near)
        above, below = (above, eq.center_height) if found.smallest_eigenvalue < 0 else (eq.center_height, below)
        if found.smallest_eigenvalue < 0:
            numbers = [n for n in numbers if n < 1.3 * found.azimuthal]


def draw(path: Path, ratios: Sequence[float], count: int) -> None:
    """Eigenvalues over n for some thicknesses, and the worst number over the height of the pole."""
    figure, (left, right) = plots.new_figure((10.5, 4.4), widths=(1.0, 1.0))
    for ratio, (colour, marker) in zip(ratios, LOOKS, strict=False):
        eq = fm.equilibrium(scene(400.0, -3.25, ratio), center_height=-0.3)
        numbers = sorted({round(n) for n in np.linspace(1, 0.25 * ratio, count)})
        values = [eq.verdict(azimuthal=n).smallest_eigenvalue / ratio**2 for n in numbers]
        left.plot(np.array(numbers) / ratio, values, marker, color=colour, markersize=3, label=f"R₀/T = {ratio:g}")
    left.axhline(0, color="black", linewidth=0.8)
    left.set(xlabel="n T/R₀", ylabel="smallest eigenvalue λ (T/R₀)²", title="M = 400, h = -3.25, pole at -0.3", ylim=(-0.05, 0.02))
    plots.draw_legend(left)
    for ratio, (colour, marker) in zip(ratios, LOOKS, strict=False):
        heights = np.linspace(-0.1, -0.5, max(3, count // 6))
        worst = [fm.equilibrium(scene(400.0, -3.25, ratio), center_height=height).verdict(azimuthal="all").azimuthal for height in heights]
        right.semilogy(heights, worst, marker, color=colour, markersize=4, label=f"R₀/T = {ratio:g}")
    right.set(xlabel="pole height η(0)/R₀", ylabel="worst number of waves", title="M = 400, h = -3.25")
    plots.draw_legend(right)
    plots.save_figure(figure, path)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/wrinkle_numbers"), help="folder for tables and picture")
    parser.add_argument("--quick", action="store_true", help="fewer states and thicknesses")
    given = parser.parse_args(arguments)
    out, ratios = given.out, THICKNESSES[: 2 if given.quick else None]
    out.mkdir(parents=True, exist_ok=True)

    rows = states(given.quick)
    print(f"R0/T = 1000{'M':>6}{'h':>8}{'pole':>7}{'P':>9}{'compressed':>12}{'worst n':>9}{'wavelength':>12}{'eigenvalue':>12}")
    for figure, strength, height, pole, pressure, compressed, waves, length, value in rows:
        print(f"{figure:<11}{strength:>6g}{height:>8g}{pole:>7g}{pressure:>9.4f}{compressed:>12.1%}{waves:>9}{length:>12.4f}{value:>12.4g}")
    write_csv(out / "states.csv", COLUMNS, rows)

    sources = {figure: (strength, height) for figure, strength, height, _ in CASES}
    found = {}
    print(f"\nfirst wrinkles{'R0/T':>8}{'pole':>9}{'P':>9}{'n':>6}{'wavelength':>12}")
    for figure, heights in list(SOUGHT.items())[: 1 if given.quick else None]:
        for ratio in ratios:
            eq, verdict = onset(scene(*sources[figure], ratio), heights)
            found[figure, ratio] = (eq.center_height, eq.pressure, verdict.azimuthal, verdict.wavelength)
            print("{:<14}{:>8g}{:>9.4f}{:>9.4f}{:>6}{:>12.5f}".format(figure, ratio, *found[figure, ratio]))
    write_csv(out / "onsets.csv", ONSETS, ([*key, *values] for key, values in found.items()))
    draw(out / "wrinkle_numbers.png", ratios, 12 if given.quick else 90)

    by_state = {(row[0], row[3]): row for row in rows}
    assert by_state["7b", 0.4][5:7] == [0.0, 1]
    assert [by_state[figure, -0.3][6] for figure in ("8a", "8b")] == [148, 110]  # recorded on 2026-11-28
    poles, waves = np.array([(found["8a", ratio][0], found["8a", ratio][2]) for ratio in ratios]).T
    assert (np.diff(poles) > 0).all()
    assert (np.diff(np.log(waves)) > 0.5 * np.diff(np.log(ratios))).all()
    np.testing.assert_allclose(poles[:2], (-0.071, -0.025), atol=2e-3)


if __name__ == "__main__":
    main(sys.argv[1:])
