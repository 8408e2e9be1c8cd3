"""A stretched dielectric disc on a chamber of air: the jump under a rising voltage, over the size of the chamber and its first pressure.

A disc of Gent's material (J_m = 270) is stretched threefold, clamped over a chamber and inflated to a first pressure. The chamber is
closed and the voltage raised. One branch over the volume for each voltage serves all chambers: an equilibrium is where the pressure of
the membrane is that of the air, P(V, phi) = (P_0 + P_a)(V_0 + H)/(V + H) - P_a. While the voltage rises the membrane creeps along until
that equilibrium ends, and jumps to one with an area ten times as large; with a small chamber the air, which thins as the membrane grows,
holds it, and there is no jump. Nothing stays: without voltage the pressure of this disc rises all along its branch, and it comes back.

    python demos/dielectric_chamber.py             table and picture in out/dielectric_chamber, 9 seconds

The experiment with acrylic on chambers is that of C. Keplinger, T. Li, R. Baumgartner, Z. Suo and S. Bauer, Soft Matter 8 (2012); the
numbers here are those of the model. Areas are capacitances: Int (l1 l2)^2 dA over its value before the voltage.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.views import plots

SCENE = fm.Scene(material=fm.Gent(270.0), mesh=fm.disc(12), degree=4, prestretch=3.0, title="A dielectric disc on a chamber of air")
VOLTAGES = np.linspace(0.0, 0.16, 33)
#: volumes of chambers over R0^3, and first pressures over mu T/R0; pressure of the atmosphere in the same unit
CHAMBERS, PRESSURES, ATMOSPHERE = (1e2, 1e3, 1e4, 1e5), (0.3, 0.4, 0.5, 0.6), 10.0
Array = NDArray[np.float64]


def curve(phi: float) -> tuple[Array, Array, Array]:
    """Volumes, pressures and capacitances along the branch at a voltage."""
    branch = fm.trace(
        SCENE.replace(electric=fm.Electric(voltage=float(phi))),
        start=3.0,
        until={"volume": 300.0},
        steps=fm.StepControl(largest=4.0, turn=0.3),
        max_steps=150,
        throw=False,
    )
    return branch.column("volume"), branch.column("pressure"), np.array([eq.capacitance for eq in branch])


def equilibria(known: tuple[Array, Array, Array], gas: fm.Gas) -> Array:
    """Volumes and capacitances on a branch at which its pressure is that of the gas, shape (n, 2), in order along the branch."""
    volume, pressure, capacitance = known
    excess = pressure - np.array([gas.pressure(float(v)) for v in volume])
    at = np.flatnonzero(excess[1:] * excess[:-1] <= 0)
    share = excess[at] / (excess[at] - excess[at + 1])
    return np.stack([values[at] + share * (values[at + 1] - values[at]) for values in (volume, capacitance)], axis=1)


def raised(curves: Sequence[tuple[Array, Array, Array]], gas: fm.Gas) -> list[tuple[float, float]]:
    """Volume and capacitance while the voltage rises: at each voltage the equilibrium next to the one before."""
    path: list[tuple[float, float]] = []
    for known in curves:
        found = equilibria(known, gas)
        if not len(found):
            break
        nearest = found[0] if not path else found[np.argmin(np.abs(np.log(found[:, 1] / path[-1][1])))]
        path.append((float(nearest[0]), float(nearest[1])))
    return path


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/dielectric_chamber"), help="folder for picture and table")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    curves = [curve(phi) for phi in VOLTAGES]
    volume, pressure, _ = curves[0]
    rows = []
    figure, axes = plots.new_figure((7.2, 4.8), title=SCENE.title)
    for first in PRESSURES:
        start = float(np.interp(first, pressure, volume))
        for chamber in CHAMBERS:
            gas = fm.Gas(amount=(first + ATMOSPHERE) * (start + chamber), chamber=chamber, atmosphere=ATMOSPHERE)
            path = raised(curves, gas)
            area = np.array([c for _, c in path]) / path[0][1]
            steps = area[1:] / area[:-1]
            k = int(steps.argmax())
            jump = steps[k] > 1.5
            rows.append(
                (
                    first,
                    chamber,
                    float(VOLTAGES[k + 1]) if jump else np.nan,
                    float(steps[k]),
                    float(area[-1]),
                    float(VOLTAGES[len(path) - 1]),
                )
            )
            if first == PRESSURES[2]:
                axes.plot(VOLTAGES[: len(path)], area, label=f"chamber {chamber:g} R0^3")
    axes.set(xlabel="voltage phi", ylabel="capacitance over its first value", yscale="log")
    axes.legend()
    plots.save_figure(figure, out / "dielectric_chamber.png")
    names = ("first pressure", "chamber", "jump at", "step of area", "area at the end", "last voltage")
    write_csv(out / "map.csv", names, rows)
    print(" ".join(f"{name:>16}" for name in names))
    for row in rows:
        print(" ".join(f"{value:>16.3f}" for value in row))

    sizes = {row[:2]: row[3] for row in rows}
    assert 10 < sizes[0.5, 1e4] < 11  # how finely the voltage is stepped decides about more digits
    assert 16 < sizes[0.5, 1e5] < 18
    assert all(step < 1.1 for (_, chamber), step in sizes.items() if chamber == CHAMBERS[0])
    assert (np.diff(pressure) > 0).all()

    # one state again as an equilibrium of the gas, with its verdicts
    start = float(np.interp(PRESSURES[2], pressure, volume))
    gas = fm.Gas(amount=(PRESSURES[2] + ATMOSPHERE) * (start + 1e4), chamber=1e4, atmosphere=ATMOSPHERE)
    at = raised(curves, gas)[16]
    eq = fm.equilibrium(SCENE.replace(electric=fm.Electric(voltage=float(VOLTAGES[16]))), volume=at[0], solver="newton")
    assert abs(eq.pressure / gas.pressure(eq.volume) - 1) < 0.02
    assert eq.verdict("gas", gas=gas).stable
    assert eq.verdict("gas", gas=gas, electric="charge").stable


if __name__ == "__main__":
    main(sys.argv[1:])
