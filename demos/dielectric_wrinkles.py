"""Are wrinkled dielectric films stable? A map over voltage and pressure of the waves that they do not bear.

Two claims stand in the literature: that wrinkled states below pull-in are always stable, and that relaxed states under pressure are
unstable to perturbations around the axis. Here a neo-Hookean disc, clamped without pre-stretch, is a tension field under a voltage, from
phi^2 = 0.02 to 0.38; a slack film has no state beyond 0.4725. At each voltage the map has states between the limit point, above which the
pressure pulls the film in, and a tenth of its pressure. Of each state the table has the wrinkled share of the area, the verdict under the
held pressure, and the smallest number of waves around the axis, of 1, 2, 8, 32, 128 and 512, against which it is unstable.

Each claim holds in a part of the map. Every state of it, wrinkled or not, is a minimum among axisymmetric shapes at its pressure, and bears
1, 2, 8 and 32 waves: against these the first claim is right. Against 128 and 512 waves all taut states are stable, and so are wrinkled ones
with up to a seventh of the area wrinkled. All that have a fifth or more wrinkled are unstable, most of them from 512 waves on, and from 128
on where nearly half of the area or more is wrinkled at a high voltage: there the second claim is right. Nothing is carried across the
wrinkles, and the pressure bulges the film between them. A real film would meet so many waves with its stiffness in bending, which a
membrane leaves out.

    python demos/dielectric_wrinkles.py            table and picture in out/dielectric_wrinkles, 10 seconds

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
#: phi^2
SQUARES = (0.02, 0.08, 0.14, 0.2, 0.26, 0.32, 0.38)
#: numbers of waves that are tried
WAVES = (1, 2, 8, 32, 128, 512)
#: pressures of the map for each voltage, as shares of the limit pressure
SHARES = (0.97, 0.8, 0.6, 0.4, 0.2, 0.1)


def states(square: float) -> tuple[fm.SpecialPoint, list[fm.Equilibrium]]:
    """The limit point at a voltage, and states on the way to it at shares of its pressure, as far down as there are any."""
    scene = SCENE.replace(electric=fm.Electric(voltage=float(np.sqrt(square))))
    rising = fm.trace(scene, start=0.9, until={"volume": 2.6}, max_steps=30, throw=False)
    limit = next(point for point in rising.special_points or () if point.kind == "limit_point")
    loads = np.array(SHARES) * limit.pressure
    found = fm.pressurize(scene, pressures=loads, start=rising[0], throw=False)
    return limit, list(found)


def first_wave(eq: fm.Equilibrium) -> int:
    """The first number of waves against which a state is unstable; 0 where it is stable against all that are tried."""
    return next((n for n in WAVES if eq.verdict(azimuthal=n).stable is False), 0)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/dielectric_wrinkles"), help="folder for picture and table")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    names = ("phi^2", "P", "V", "wrinkled", "held pressure", "waves")
    print(" ".join(f"{name:>14}" for name in names))
    rows, limits = [], []
    for square in SQUARES:
        limit, found = states(square)
        limits.append(limit.pressure)
        for eq in found:
            share = sum(zone.area_fraction for zone in eq.zones("mechanical") if zone.kind != "taut")
            *numbers, held, waves = row = square, eq.pressure, eq.volume, share, str(eq.verdict("pressure").stable), first_wave(eq)
            rows.append(row)
            print(" ".join(f"{value:>14.5f}" for value in numbers), f"{held:>14} {waves or '-':>14}")
    write_csv(out / "map.csv", names, rows)
    _draw(rows, limits, out / "dielectric_wrinkles.png")

    wrinkled = [row for row in rows if row[3] > 0]
    assert len(wrinkled) >= 12
    assert all(row[4] == "True" for row in rows)  # axisymmetric shapes
    assert all(row[5] == 0 or row[5] >= 32 for row in rows)  # few waves
    assert all(row[5] == 0 for row in rows if not row[3])  # taut states
    assert all(row[5] == 0 for row in rows if row[3] < 0.145)  # little wrinkled
    assert all(row[5] in (128, 512) for row in rows if row[3] > 0.2)  # much wrinkled, many waves
    assert any(row[5] == 128 for row in wrinkled)


def _draw(rows: list[tuple[float, float, float, float, str, int]], limits: list[float], path: Path) -> None:
    figure, axes = plots.new_figure((7.6, 4.8), title=SCENE.title)
    kinds = {"taut, stable": ("o", "#0072b2"), "wrinkled, stable against all n tried": ("s", "#56b4e9")}
    kinds |= {
        f"wrinkled, unstable from n = {n} on": (marker, color)
        for n, marker, color in zip(WAVES[:2:-1], "^vD", ("#e69f00", "#d55e00", "#a01040"), strict=False)
    }
    for name, (marker, color) in kinds.items():
        last = name.removesuffix(" on").rpartition(" ")[2]
        chosen = [
            row
            for row in rows
            if (not row[3] if name.startswith("taut") else row[3] > 0 and row[5] == (int(last) if last.isdigit() else 0))
        ]
        if chosen:
            axes.plot([row[0] for row in chosen], [row[1] for row in chosen], marker, color=color, markersize=8, label=name)
    axes.plot(SQUARES, limits, "-", color="0.3", label="limit point of the branch")
    axes.set(xlabel="φ²", ylabel="pressure P = p R₀/(μT)", yscale="log")
    axes.legend(frameon=False, fontsize=9, loc="lower left")
    plots.save_figure(figure, path)


if __name__ == "__main__":
    main(sys.argv[1:])
