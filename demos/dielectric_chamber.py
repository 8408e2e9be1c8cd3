"""A stretched dielectric disc on a chamber of air: jumps while a voltage rises and falls, and what stays when it is gone.

A disc of Gent's material (J_m = 270) is stretched, clamped over a chamber of the volume H and inflated to a first pressure P_0. The chamber
is closed, with the amount of air (P_0 + P_a)(V_0 + H), the voltage raised, and lowered to 0 again. The branch over the voltage at this
amount of air is followed through its turning points: there the membrane jumps. A small chamber holds it, as its air thins while the
membrane grows.

Stretched threefold, the disc jumps in some of the larger chambers, at high first pressures, and comes back by a jump at a voltage a little
lower. Nothing stays, whatever the chamber: without voltage the pressure of this disc rises all along its branch. In others the same large
area is reached without any jump. Stretched by half only, the disc has a limit point without voltage, and loops are wide. In large chambers
and at first pressures close below that limit point the large state is still one when the voltage is gone: with an area up to 120 times as
large, it stays, stable with its gas.

    python demos/dielectric_chamber.py             table and picture in out/dielectric_chamber, 15 seconds

The experiment with acrylic on chambers is that of C. Keplinger, T. Li, R. Baumgartner, Z. Suo and S. Bauer, Soft Matter 8 (2012); the
numbers here are those of the model. Areas are capacitances: Int (l1 l2)^2 dA over its value before the voltage.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.views import plots

SCENE = fm.Scene(material=fm.Gent(270.0), mesh=fm.disc(12), degree=4, title="A dielectric disc on a chamber of air")
#: volumes of chambers over R0^3, and pressure of the atmosphere over mu T/R0
CHAMBERS, ATMOSPHERE = (1e2, 1e3, 1e4, 1e5), 10.0
#: by pre-stretch: largest voltage, and first pressures over mu T/R0
EXPERIMENTS = {3.0: (0.16, (0.4, 0.5, 0.6)), 1.5: (0.20, (1.25, 1.3, 1.35))}
#: the loops of the picture: pre-stretch and first pressure
SHOWN = ((3.0, 0.5), (1.5, 1.35))


@dataclass(frozen=True)
class Loop:
    """What a chamber at a first pressure does.

    Attributes
    ----------
    first : Equilibrium
        Before the voltage.
    branch : Branch
        Over the voltage, with the gas held; its ``number_fold`` points are where the membrane jumps.
    large : Branch or None
        The branch of the large states where that does not hang together with the first: it begins without voltage.
    """

    first: fm.Equilibrium
    branch: fm.Branch
    large: fm.Branch | None

    def jump(self, way: int) -> float:
        """The voltage of the jump while the voltage rises (1) or falls (-1); NaN where there is none."""
        turns = [point.equilibrium.voltage for point in self.branch.special_points or () if point.kind == "number_fold"]
        if not turns or (way < 0 and self.large is not None):
            return np.nan
        return max(turns) if way > 0 else min(turns)

    @property
    def last(self) -> fm.Equilibrium:
        """At the largest voltage."""
        return (self.branch if self.large is None else self.large)[-1]

    @property
    def stays(self) -> fm.Equilibrium:
        """When the voltage is gone."""
        return self.first if self.large is None else self.large[0]

    def area(self, eq: fm.Equilibrium) -> float:
        return eq.capacitance / self.first.capacitance


def inflated(prestretch: float) -> fm.Branch:
    """The branch over the volume without voltage."""
    scene = SCENE.replace(prestretch=prestretch, electric=fm.Electric(voltage=0.0))
    steps = fm.StepControl(largest=4.0, turn=0.3)
    return fm.trace(scene, start=prestretch, until={"volume": 450.0}, steps=steps, max_steps=200, throw=False)


def loop(bare: fm.Branch, first: float, chamber: float, largest: float) -> Loop:
    """The loop of a chamber that is closed at a first pressure."""
    scene = SCENE.replace(prestretch=bare.scene.prestretch, electric=fm.Electric(voltage=0.0))
    start = fm.equilibrium(scene, pressure=first)
    scene = scene.replace(chamber=fm.Chamber(volume=chamber, atmosphere=ATMOSPHERE))
    amount = scene.chamber.amount(start.pressure, start.volume)
    way = {"over": "electric.voltage", "hold": {"gas": amount}, "until": {"electric.voltage": largest}, "max_steps": 300, "throw": False}
    branch = fm.trace(scene, start=start, **way)
    if branch[-1].voltage > largest / 2:
        return Loop(start, branch, None)
    # it came back to no voltage at a state between: the large one there is the next equilibrium of the same gas
    gas = fm.Gas(amount=amount, chamber=chamber, atmosphere=ATMOSPHERE)
    beyond = [eq for eq in bare if eq.volume > branch[-1].volume]
    near = next(eq for eq in beyond[1:] if eq.pressure > gas.pressure(eq.volume))
    return Loop(start, branch, fm.trace(scene, start=fm.equilibrium(scene, gas=gas, start=near), **way))


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/dielectric_chamber"), help="folder for picture and tables")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    names = ("pre-stretch", "first pressure", "chamber", "jump up at", "largest area", "jump down at", "what stays")
    print(" ".join(f"{name:>14}" for name in names))
    rows, loops = [], {}
    for prestretch, (largest, pressures) in EXPERIMENTS.items():
        bare = inflated(prestretch)
        for first in pressures:
            for chamber in CHAMBERS:
                found = loops[prestretch, first, chamber] = loop(bare, first, chamber, largest)
                row = prestretch, first, chamber, found.jump(1), found.area(found.last), found.jump(-1), found.area(found.stays)
                rows.append(row)
                print(" ".join(f"{value:>14.4g}" for value in row))
    write_csv(out / "map.csv", names, rows)
    _draw(loops, out / "dielectric_chamber.png")
    _check(loops)


def _check(loops: dict[tuple[float, float, float], Loop]) -> None:
    assert all(found.stays is found.first for (prestretch, _, _), found in loops.items() if prestretch == 3)
    pressure = inflated(3.0).column("pressure")
    assert (np.diff(pressure) > 0).all()
    loop_of = loops[3.0, 0.5, 1e4]
    assert 0.145 < loop_of.jump(1) < 0.146
    assert 0.137 < loop_of.jump(-1) < 0.138
    assert np.isnan(loops[3.0, 0.5, 1e2].jump(1))
    kept = {key for key, found in loops.items() if found.large is not None}
    assert kept == {(1.5, 1.25, 1e5), (1.5, 1.3, 1e4), (1.5, 1.3, 1e5), (1.5, 1.35, 1e4), (1.5, 1.35, 1e5)}
    for key in kept:
        assert loops[key].area(loops[key].stays) > 60
        assert loops[key].stays.verdict("gas").stable
        assert loops[key].last.verdict("gas").stable
        assert loops[key].last.verdict("gas", electric="charge").stable


def _draw(loops: dict[tuple[float, float, float], Loop], path: Path) -> None:
    figure, axes = plots.new_figure((10.6, 4.6), title=SCENE.title, widths=(1.0, 1.0))
    for axis, (prestretch, first) in zip(axes, SHOWN, strict=True):
        for chamber, color, dashes in zip(CHAMBERS, ("#56b4e9", "#0072b2", "#d55e00", "#222222"), ("-", "--", "-.", ":"), strict=True):
            shown, name = loops[prestretch, first, chamber], f"chamber {chamber:g} R₀³"
            for branch in (shown.branch, shown.large):
                if branch is not None:
                    axis.plot([eq.voltage for eq in branch], [shown.area(eq) for eq in branch], dashes, color=color, label=name)
                    name = None
        axis.set(xlabel="voltage φ", yscale="log", title=f"pre-stretch {prestretch:g}, first pressure {first:g}")
        axis.grid(color="0.9", linewidth=0.6)
    axes[0].set_ylabel("capacitance over its first value")
    axes[0].legend(frameon=False, fontsize=9, loc="upper left")
    plots.save_figure(figure, path)


if __name__ == "__main__":
    main(sys.argv[1:])
