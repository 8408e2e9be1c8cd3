"""Figure 6: profiles below a dipole at h = 6.5 with M = 200, 400 and 600, and why the paper's largest pressures are 2 to 4 % higher.

The paper gives eight pressures for each strength, for falling height of the pole, and not the heights. Near the dipole the pressure rises
to a limit point and falls behind it. The largest printed pressures are 2.01, 1.81 and 1.688; the limit points of the equations of
equilibrium (39) are at 1.934, 1.754 and 1.648, by finite elements, by collocation and by shooting alike.

The printed pressures follow from the equations (60) as printed, which the paper integrates. There the derivative of the meridional stress
has the circumferential stretch in place of the meridional one (see printed_equations.py). Their largest pressures are 2.011, 1.810 and
1.688; and with the poles of the eight profiles at equal distances, two numbers for a list that are fitted, all 24 printed pressures are met
within 0.007. With the equations (39) the best fit misses by up to 0.09.

What else was tried and does not explain them: the integrator's tolerances (with MATLAB's defaults P changes by 2e-5 at most), the start at
r = 1e-5, and one other value of chi M, of mu, of h, or of one of the material's moduli or first two exponents. The three strengths would
need three of each: chi M times 0.74, 0.81 and 0.86; h = 6.594, 6.576 and 6.560; closest to each other, alpha_2 = 5.032, 5.030 and 5.026.

    python demos/paper/figure_6.py                 pictures and table in out/figure-6, 8 seconds
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import paper
from paper import Result, Row
from printed_equations import as_printed, integrate
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

import femmembrane as fm
from femmembrane import quantities
from femmembrane.accuracy.collocation import collocate
from femmembrane.accuracy.shooting import shoot
from femmembrane.accuracy.strong_form import Guess
from femmembrane.views import plots

HEIGHT = 6.5
#: the printed pressures by strength, for falling height of the pole
PRINTED = {
    200: (1.27, 1.71, 1.91, 1.99, 2.01, 2.00, 1.98, 1.94),
    400: (1.09, 1.33, 1.61, 1.73, 1.79, 1.81, 1.80, 1.79),
    600: (1.04, 1.18, 1.42, 1.57, 1.65, 1.679, 1.688, 1.683),
}
#: heights of the pole between which the curves are drawn
SPANS = {200: (4.2, 5.25), 400: (4.0, 5.05), 600: (3.85, 4.9)}
LOOKS = {200: ("#0072b2", "o"), 400: ("#d55e00", "s"), 600: ("#222222", "^")}


@dataclass(frozen=True)
class Curve:
    """Pressure against height of the pole for one strength, by both sets of equations."""

    strength: int
    here: CubicSpline
    printed: CubicSpline

    def fit(self, spline: CubicSpline) -> tuple[np.ndarray, float]:
        """Eight heights at equal distances whose pressures are closest to the printed ones, and the largest miss."""
        low, high = SPANS[self.strength]

        def heights(x: Any) -> np.ndarray:
            return np.clip(x[0] - x[1] * np.arange(8), low, high)

        fits = [
            least_squares(lambda x: spline(heights(x)) - PRINTED[self.strength], (first, 0.1)) for first in np.arange(high - 0.3, high, 0.1)
        ]
        best = heights(min(fits, key=lambda f: f.cost).x)
        return best, float(np.abs(spline(best) - PRINTED[self.strength]).max())


def curve(strength: int) -> Curve:
    of = paper.scene(strength, HEIGHT)
    low, high = SPANS[strength]
    heights = np.linspace(low, high, round((high - low) / 0.05) + 1)
    states = paper.at_heights(of, heights)
    printed = as_printed(of, heights, states)
    return Curve(strength, CubicSpline(heights, [s.pressure for s in states]), CubicSpline(heights, [s.pressure for s in printed]))


def largest(spline: CubicSpline) -> float:
    roots = spline.derivative().roots(extrapolate=False)
    return float(spline(roots).max())


def draw_pressures(curves: list[Curve], path: Path) -> None:
    figure, axes = plots.new_figure((7.6, 5.0))
    for c in curves:
        color, marker = LOOKS[c.strength]
        z = np.linspace(*SPANS[c.strength], 300)
        label = c.strength == 200
        axes.plot(z, c.here(z), "-", color=color, label="equilibrium, eqs. (39)" if label else None)
        axes.plot(z, c.printed(z), linestyle=(0, (5, 2)), color=color, label="eqs. (60) as printed" if label else None)
        heights, _ = c.fit(c.printed)
        axes.plot(heights, PRINTED[c.strength], marker, color=color, mfc="white", ms=6.5, label=f"paper's pressures, M = {c.strength}")
    axes.set(xlabel=quantities.axis_label("center_height"), ylabel=quantities.axis_label("pressure"), xlim=(3.85, 5.3), ylim=(0.95, 2.08))
    axes.grid(color="0.9", linewidth=0.6)
    plots.draw_legend(axes, loc="lower left", fontsize=10)
    plots.save_figure(figure, path)


def draw_profiles(states: dict[int, list[fm.Equilibrium]], path: Path) -> None:
    figure, panels = plots.new_figure((10.0, 6.0), widths=(1, 1, 1))
    for axes, (strength, shown) in zip(panels, states.items(), strict=True):
        paper.draw_halves(axes, shown, [plots.verdict_style(eq) for eq in shown])
        axes.set(xlim=(0, 3.1), ylim=(-0.2, 7.1))
        axes.set_title(f"M = {strength}, η(0) = {shown[0].center_height:.2f} to {shown[-1].center_height:.2f}", fontsize=10)
    paper.shared_legend(figure, panels, 2, dipole=True)
    plots.save_figure(figure, path)


def make(out: Path) -> Result:
    curves = [curve(strength) for strength in PRINTED]
    draw_pressures(curves, out / "figure-6-pressures.png")
    rows, states, misses = [], {}, {}
    for c, letter in zip(curves, "abc", strict=True):
        of = paper.scene(c.strength, HEIGHT)
        heights, miss = c.fit(c.printed)
        misses[c.strength] = miss, c.fit(c.here)[1]
        states[c.strength] = paper.at_heights(of, heights)
        top = max(PRINTED[c.strength])
        rows.append(Row(f"6{letter}", f"largest P, M = {c.strength}, h = 6.5", top, largest(c.here), largest(c.printed), shown=True))
        for height, printed, eq in zip(heights, PRINTED[c.strength], states[c.strength], strict=True):
            rows.append(Row(f"6{letter}", f"P at η(0) = {height:.3f} (fitted)", printed, eq.pressure, float(c.printed(height))))
    draw_profiles(states, out / "figure-6.png")
    paper.write_rows(rows, out / "figure-6.csv")
    check(curves, misses)
    return Result((out / "figure-6-pressures.png", out / "figure-6.png"), tuple(rows))


def check(curves: list[Curve], misses: dict[int, tuple[float, float]]) -> None:
    # limit points by an independent spectral Ritz solver (M = 200), and recorded on 2026-11-24
    np.testing.assert_allclose([largest(c.here) for c in curves], [1.933883, 1.754302, 1.648438], atol=2e-5)
    # what the paper prints, to its own digits
    np.testing.assert_allclose([largest(c.printed) for c in curves], [max(p) for p in PRINTED.values()], atol=1.5e-3)
    assert all(printed < 0.008 and here > 0.05 for printed, here in misses.values()), misses
    # the same by two methods that share nothing with the elements, and the printed equations written out
    of = paper.scene(200, HEIGHT).replace(mesh=fm.disc(elements=32))
    eq = fm.equilibrium(of, center_height=4.75)
    alone = collocate(of, guess=Guess.of(eq), center_height=4.75, tolerance=1e-9)
    shot = shoot(of, guess=Guess.of(eq), center_height=4.75)
    assert alone.converged
    assert shot.converged
    np.testing.assert_allclose([alone.pressure, shot.pressure], eq.pressure, rtol=1e-8)
    _, pressure = integrate(of, 4.75, Guess.of(eq))
    assert abs(pressure - float(curves[0].printed(4.75))) < 2e-5


if __name__ == "__main__":
    paper.main("figure-6", __doc__, make)
