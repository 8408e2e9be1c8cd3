"""An annular dielectric film whose inner part slackens under a rising voltage, until the voltage pulls it in.

A neo-Hookean film between a rigid hub and a rim, stretched more or less and inflated to a held pressure, is a tension field. The voltage is
raised along its branch. At a voltage of about a half the film has no tension left around the axis at the hub: radial wrinkles begin
there, and the wrinkled zone grows outwards. Without pre-stretch another one begins at the rim. A wrinkled strip has a natural width
that depends on the field; at the hub, where the stretch along the meridian is largest, the strip loses its stiffness first. There each
branch ends, pulled in, with most of the film still taut; the more it is stretched, the sooner. Until then the states that were tried are
stable under their pressure among axisymmetric shapes.

    python demos/dielectric_annulus.py             table and picture in out/dielectric_annulus, 10 seconds

Source: P. Greaney, M. Meere and G. Zurlo, J. Mech. Phys. Solids 122 (2019), for annular films that wrinkle under a voltage; the numbers
here are our own.
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
    mesh=fm.annulus(0.3, elements=24),
    degree=4,
    tension_field=True,
    electric=fm.Electric(voltage=0.0),
    title="Where an annular film is wrinkled under a voltage, P = 0.3",
)
PRESSURE, PRESTRETCHES = 0.3, (1.0, 1.1, 1.2)


def wrinkled(eq: fm.Equilibrium) -> tuple[float, float]:
    """Reference radii up to which the film is wrinkled from the hub on, and from which on up to the rim."""
    inner, outer = 0.3, 1.0
    for zone in eq.zones("mechanical"):
        if zone.kind == "radial" and zone.r[0] < 0.31:
            inner = zone.r[1]
        elif zone.kind == "radial" and zone.r[1] > 0.99:
            outer = zone.r[0]
    return inner, outer


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/dielectric_annulus"), help="folder for picture and table")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    figure, axes = plots.new_figure((7.2, 4.8), title=SCENE.title)
    names = ("pre-stretch", "wrinkles from", "pulled in at", "hub zone to", "rim zone from")
    rows = []
    for prestretch, color, dashes in zip(PRESTRETCHES, ("#0072b2", "#d55e00", "#222222"), ("-", "--", ":"), strict=True):
        way = {"over": "electric.voltage", "hold": {"pressure": PRESSURE}, "until": {"electric.voltage": 1.0}}
        branch = fm.trace(SCENE.replace(prestretch=prestretch), **way, steps=fm.StepControl(largest=0.06), max_steps=200, throw=False)
        known = branch[:-1]  # the last state is pulled in already
        assert branch.status is fm.Status.PULLED_IN
        assert all(eq.verdict("pressure").stable for eq in [*known[::8], known[-1]])
        zones = np.array([wrinkled(eq) for eq in known])
        voltage = np.array([eq.voltage for eq in known])
        begins = int(np.argmax(zones[:, 0] > 0.3))
        rows.append((prestretch, voltage[begins], branch[-1].voltage, *zones[-1]))
        assert (np.diff(zones[begins:, 0]) > 0).all()  # it grows
        axes.plot(voltage[begins:], zones[begins:, 0], dashes, color=color, label=f"pre-stretch {prestretch:g}")
        if zones[-1, 1] < 1:
            at = zones[:, 1] < 1
            axes.plot(voltage[at], zones[at, 1], dashes, color=color)
            axes.fill_between(voltage[at], zones[at, 1], 1.0, color=color, alpha=0.12, linewidth=0)
        axes.fill_between(voltage[begins:], 0.3, zones[begins:, 0], color=color, alpha=0.12, linewidth=0)
        axes.plot(voltage[-1], zones[-1, 0], "X", color=color, markersize=9, label=None if prestretch > 1 else "pulled in at the hub")
    axes.fill_between([], [], color="0.85", label="wrinkled: next to the hub, and to the rim")
    axes.set(xlabel="voltage φ", ylabel="reference radius r/R₀", ylim=(0.3, 1.0))
    axes.legend(frameon=False)
    plots.save_figure(figure, out / "dielectric_annulus.png")
    write_csv(out / "zones.csv", names, rows)
    print(" ".join(f"{name:>14}" for name in names))
    for row in rows:
        print(" ".join(f"{value:>14.4g}" for value in row))

    assert (np.diff([row[2] for row in rows]) < 0).all()  # a stretched film is pulled in sooner
    assert all(0.45 < row[1] < row[2] for row in rows)
    assert rows[0][4] < 1
    assert all(row[4] == 1 for row in rows[1:])
    assert all(row[3] < 0.45 for row in rows)


if __name__ == "__main__":
    main(sys.argv[1:])
