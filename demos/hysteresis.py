"""A balloon that snaps: pressure raised past one limit point and lowered past the other.

The three-term Ogden disc without magnets. Raised under pressure control it creeps up to the limit point at P = 1.899085 and snaps to a
thirty times larger volume; lowered, it stays large down to the limit point at P = 1.490989 and snaps back. Between the two pressures the
state depends on the past. The thin line is the whole branch, followed by arc length, with the unstable part that no sweep shows.

    python demos/hysteresis.py                  picture and tables in out/hysteresis, 3 seconds

Sources: material from Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), table 1; the limit points from an independent
spectral Ritz solver (P = 1.899084863 and 1.490989189). A snap ends at the next load of the sweep.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import femmembrane as fm
from femmembrane.results.table import write_csv
from femmembrane.views import plots

SCENE = fm.Scene(
    material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
    mesh=fm.disc(elements=64),
    analysis=fm.Analysis(stability=("pressure", "volume")),
    title="Pressure raised and lowered again: three-term Ogden disc, no magnets",
)
#: even steps, and one just before each limit point
RISING = np.sort([*np.linspace(1.0, 2.0, 101), 1.4911, 1.899])
BEHIND = plots.Style("all equilibria, by arc length", "-", "0.6", 1.0)


def draw(sweep: fm.Branch, branch: fm.Branch, path: Path) -> None:
    figure, axes = plots.new_figure((7.2, 4.8), title=SCENE.title)
    plots.draw_branch(axes, branch, style=BEHIND, dots=False)
    plots.draw_branch(axes, sweep, dots=False)
    for k in (60, -66):  # which way the sweep goes
        arrow(axes, sweep[k], sweep[k + 1])
    axes.set(xlim=(0, 95), ylim=(0.95, 2.1))
    plots.draw_legend(axes, loc="lower right")
    plots.save_figure(figure, path)


def arrow(axes: Any, a: fm.Equilibrium, b: fm.Equilibrium) -> None:
    look = {"arrowstyle": "-|>", "color": plots.BOTH.color, "mutation_scale": 16}
    axes.annotate("", xy=(b.volume, b.pressure), xytext=(a.volume, a.pressure), arrowprops=look, zorder=4)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/hysteresis"), help="folder for picture and tables")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    pressures = np.concatenate([RISING, RISING[-2::-1]])
    sweep = fm.pressurize(SCENE, pressures=pressures, at_limit="jump", solver="newton")
    branch = fm.trace(SCENE, start=0.3, until={"pressure": 2.05}, steps=fm.StepControl(largest=0.1, turn=0.1))
    write_csv(sweep, out / "sweep.csv")
    write_csv(branch, out / "branch.csv")
    draw(sweep, branch, out / "hysteresis.png")

    print(f"{len(sweep)} pressures, {len(sweep.jumps)} snaps")
    print(f"{'':<9} {'limit point P':>14} {'V':>9} {'lands at P':>11} {'V':>9}")
    for name, jump in zip(("rising", "falling"), sweep.jumps, strict=True):
        limit, landing = jump.limit, jump.landing
        assert limit is not None
        print(f"{name:<9} {limit.pressure:>14.9f} {limit.volume:>9.5f} {landing.pressure:>11.4f} {landing.volume:>9.4f}")

    np.testing.assert_allclose([j.limit.pressure for j in sweep.jumps if j.limit], [1.899084863, 1.490989189], atol=1e-7)
    assert [p.kind for p in branch.special_points or ()] == ["limit_point"] * 2
    assert all(eq.verdict("pressure").stable for eq in sweep)
    assert abs(sweep[0].volume / sweep[-1].volume - 1) < 1e-9  # the loop closes
    assert 30 < sweep.jumps[0].landing.volume / sweep.jumps[0].limit.volume < 32  # type: ignore[union-attr]


if __name__ == "__main__":
    main(sys.argv[1:])
