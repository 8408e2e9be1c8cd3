"""Are wrinkled dielectric films stable? A map over voltage and pressure of the waves that they do not bear.

Two claims stand in the literature: that wrinkled states below pull-in are always stable, and that relaxed states under pressure are
unstable to perturbations around the axis. Here a neo-Hookean disc, clamped without pre-stretch, is a tension field under a voltage. Its
branch is followed down in volume from a taut dome until a part of it has no tension around the axis. Of each state the table has the
pressure, the wrinkled share of the area, the verdict under a held pressure, and the smallest number of waves around the axis, of 1, 2, 4,
... 512, against which it is unstable.

Both claims hold, for different perturbations. Below pull-in every wrinkled state of the table is a minimum among axisymmetric shapes, and
against few waves around the axis. Under pressure a film of which much is wrinkled is unstable against many waves, 256 or 512 here:
nothing is carried across the wrinkles, and the pressure bulges the film between them. The number of waves at which this begins falls as
the wrinkled zone grows. In a real film so many waves meet what a membrane leaves out, the stiffness in bending.

    python demos/dielectric_wrinkles.py            table and picture in out/dielectric_wrinkles, 20 seconds

Sources: the relaxation by A. C. Pipkin, IMA J. Appl. Math. 36 (1986); wrinkles under a voltage by P. Greaney, M. Meere and G. Zurlo, J.
Mech. Phys. Solids 122 (2019).
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

SCENE = fm.Scene(
    material=fm.NeoHookean(),
    mesh=fm.disc(12),
    degree=4,
    tension_field=True,
    title="Waves around the axis that a wrinkled film does not bear",
)
VOLTAGES = (0.2, 0.35, 0.5)
#: numbers of waves that are tried
WAVES = tuple(2**k for k in range(10))
#: states of each branch
STATES = 5


def states(phi: float) -> list[fm.Equilibrium]:
    """Wrinkled states at a voltage, evenly spaced along the branch, and a taut one before them."""
    scene = SCENE.replace(electric=fm.Electric(voltage=phi))
    branch = fm.trace(scene, start=0.9, until={"volume": 0.05}, direction=-1, max_steps=25, throw=False)
    wrinkled = [eq for eq in branch if "radial" in eq.zones("mechanical").kinds]
    chosen = np.unique(np.linspace(0, len(wrinkled) - 1, STATES).astype(int))
    return [*(eq for eq in branch[:1] if eq not in wrinkled), *(wrinkled[k] for k in chosen)]


def first_wave(eq: fm.Equilibrium) -> int:
    """The first number of waves against which a state is unstable; 0 where it is stable against all that are tried."""
    return next((n for n in WAVES if eq.verdict(azimuthal=n).stable is False), 0)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/dielectric_wrinkles"), help="folder for picture and table")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    rows = []
    for phi in VOLTAGES:
        for eq in states(phi):
            share = sum(zone.area_fraction for zone in eq.zones("mechanical") if zone.kind != "taut")
            rows.append((phi**2, eq.pressure, eq.volume, share, str(eq.verdict("pressure").stable), first_wave(eq)))
    names = ("phi^2", "P", "V", "wrinkled", "held pressure", "waves")
    write_csv(out / "map.csv", names, rows)
    print(" ".join(f"{name:>14}" for name in names))
    for *numbers, held, waves in rows:
        print(" ".join(f"{value:>14.5f}" for value in numbers), f"{held:>14} {waves or '-':>14}")

    figure, axes = plots.new_figure((7.2, 4.8), title=SCENE.title)
    points = axes.scatter(
        [row[0] for row in rows], [row[1] for row in rows], c=[np.log2(row[5] or 2 * WAVES[-1]) for row in rows], s=60, cmap="viridis"
    )
    figure.colorbar(points, label="log2 of the first unstable number of waves (10: none to 512)")
    axes.set(xlabel="phi^2", ylabel="pressure P", yscale="log")
    plots.save_figure(figure, out / "dielectric_wrinkles.png")

    wrinkled = [row for row in rows if row[3] > 0]
    assert len(wrinkled) >= 8
    assert all(row[4] == "True" for row in rows)  # axisymmetric shapes
    assert all(row[5] == 0 or row[5] > 16 for row in rows)  # few waves
    assert all(row[5] == 0 for row in rows if not row[3])  # taut states
    assert any(row[5] for row in wrinkled if row[0] == VOLTAGES[-1] ** 2)  # many waves


if __name__ == "__main__":
    main(sys.argv[1:])
