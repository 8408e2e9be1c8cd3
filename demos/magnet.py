"""Magnets from a catalogue below a membrane of 25 mm: their strengths M, and how near they may come before the membrane snaps onto them.

A catalogue gives the size of a magnet and the remanence of its material. The table says what strength M that makes beside a membrane with a
radius of 12.5 mm: from 7e-5 to 0.5, where papers draw branches for 200 to 600. M grows with the square of the magnet's volume. For M = 200
beside the softer membrane it would have to be as large as a sphere of twice the membrane's radius.

A magnet need not be strong if it comes near. It draws the unloaded membrane down, until at some distance the membrane snaps onto it. There
the least pressure on the branch of equilibria is zero. A dipole of the same strength in the middle of the magnet is asked for the same. It
is too strong nearby, since it has its whole moment in one point.

    python demos/magnet.py                table and picture in out/magnet, 10 seconds

The rubber has 30 per cent of iron by volume, whose susceptibility follows from Maxwell Garnett's rule.

Sources: remanences of neodymium N42 (1.28 to 1.32 T) and of ferrite Y30 (0.37 to 0.40 T) as catalogues give them; moduli of a soft silicone
(Ecoflex 00-30) and of natural rubber by their order of magnitude. The moments asserted at the end are B_r/mu0 times the volume.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.constants import mu_0
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.views import plots

#: radius and thickness of the membrane in m
RADIUS, THICKNESS = 12.5e-3, 0.5e-3
RUBBERS = {"silicone, 45 kPa": 45e3, "rubber, 0.4 MPa": 0.4e6}
#: outer and inner diameter and length in mm, remanence in T
CATALOGUE = {
    "N42 disc, 10 x 5": (10, 0, 5, 1.30),
    "N42 disc, 20 x 10": (20, 0, 10, 1.30),
    "N42 ring, 20/10 x 5": (20, 10, 5, 1.30),
    "ferrite disc, 10 x 5": (10, 0, 5, 0.38),
}
IRON = 30.0


def scales(modulus: float) -> fm.Scales:
    return fm.Scales(radius=RADIUS, thickness=THICKNESS, shear_modulus=modulus)


def magnet(name: str, modulus: float, gap: float = 1.0) -> fm.Magnet:
    """One of the catalogue, below the membrane: its upper face at ``gap`` (over R0) from the plane of the rim."""
    outer, inner, length, remanence = CATALOGUE[name]
    unit = 1e3 * RADIUS
    size = {"radius": outer / 2 / unit, "inner_radius": inner / 2 / unit, "length": length / unit}
    return fm.Magnet(height=-gap - size["length"] / 2, **size, remanence=remanence, scales=scales(modulus))


def scene(source: fm.Source) -> fm.Scene:
    chi = fm.maxwell_garnett(IRON)
    return fm.Scene(material=fm.Ogden.treloar(), mesh=fm.disc(elements=24), degree=3, sources=[source], susceptibility=chi)


def beside(name: str, modulus: float, gap: float, as_dipole: bool) -> fm.Scene:
    found = magnet(name, modulus, gap)
    return scene(fm.Dipole(found.strength, found.height) if as_dipole else found)


def snap(name: str, modulus: float, as_dipole: bool, bracket: tuple[float, float]) -> tuple[float, float]:
    """Gap at which an unloaded membrane snaps onto a magnet, and the height of its pole there."""
    found: dict[float, tuple[float, float]] = {}

    def least_pressure(gap: float) -> float:
        branch = fm.trace(
            beside(name, modulus, gap, as_dipole), start=-0.05, direction=-1, until={"center_height": -0.95 * gap}, throw=False
        )
        limits = [point for point in branch.special_points or () if point.kind == "limit_point"]
        least = min(limits, key=lambda point: point.pressure)
        found[gap] = least.pressure, least.center_height
        return least.pressure

    gap = float(brentq(least_pressure, *bracket, xtol=1e-4))
    return gap, found[gap][1]


def sinking(name: str, modulus: float, gaps: Sequence[float]) -> list[float]:
    """Height of the pole of the unloaded membrane at each gap."""
    return [fm.equilibrium(beside(name, modulus, gap, False), pressure=0.0).center_height for gap in gaps]


def draw(curves: dict[str, tuple[np.ndarray, list[float]]], path: Path) -> None:
    figure, axes = plots.new_figure((7.2, 4.8), title="An unloaded membrane above a magnet of 10 mm x 5 mm")
    plots.tell_apart(axes)
    for label, (gaps, heights) in curves.items():
        points = 1e3 * RADIUS * np.stack([gaps, heights], axis=1)
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        curve = CubicSpline(along, points)(np.linspace(0, along[-1], 200))
        (line,) = axes.plot(*curve.T, label=label)
        axes.plot(*points[-1], "o", color=line.get_color())
    axes.plot([0, 16], [0, -16], "--", color="0.5", label="face of the magnet")
    axes.set(xlabel="distance of the face below the rim, mm", ylabel="height of the pole, mm", xlim=(3, 16), ylim=(-6, 0.5))
    plots.draw_legend(axes, loc="lower right")
    plots.save_figure(figure, path)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/magnet"), help="folder for tables and picture")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    print(f"membrane of {2e3 * RADIUS:g} mm, {IRON:g} vol% of iron: susceptibility {fm.maxwell_garnett(IRON):.3f}")
    print(f"{'magnet, mm':<22} {'moment, A m^2':>14}" + "".join(f"{'M beside ' + rubber:>26}" for rubber in RUBBERS))
    rows = []
    for name in CATALOGUE:
        strengths = [magnet(name, modulus).strength for modulus in RUBBERS.values()]
        moment = scales(45e3).to_si("dipole_strength", strengths[0])
        print(f"{name:<22} {moment:>14.4f}" + "".join(f"{strength:>26.3g}" for strength in strengths))
        rows.append([name, moment, *strengths])
    write_csv(out / "strengths.csv", ["magnet", "moment", *RUBBERS], rows)

    name = next(iter(CATALOGUE))
    brackets = {45e3: ((0.735, 0.76), (0.825, 0.86)), 0.4e6: ((0.45, 0.5), (0.6, 0.63))}
    snaps, curves = [], {}
    for rubber, modulus in RUBBERS.items():
        (near, height), (far, _) = (snap(name, modulus, as_dipole, brackets[modulus][as_dipole]) for as_dipole in (False, True))
        print(f"{name}, {rubber}: snaps from {near * 1e3 * RADIUS:.2f} mm, the pole {-height * 1e3 * RADIUS:.2f} mm down; "
              f"as a dipole it would from {far * 1e3 * RADIUS:.2f} mm")  # fmt: skip
        gaps = near + (1.28 - near) * np.linspace(1, 0.06, 8) ** 2
        curves[rubber] = np.append(gaps, near), [*sinking(name, modulus, gaps.tolist()), height]
        snaps.append((near, height, far))
    draw(curves, out / "magnet.png")

    disc, ring = (magnet(name, 45e3) for name in ("N42 disc, 20 x 10", "N42 ring, 20/10 x 5"))
    for found, volume in ((disc, math.pi * 1e-2**2 * 1e-2), (ring, math.pi * (1e-2**2 - 5e-3**2) * 5e-3)):
        assert abs(scales(45e3).to_si("dipole_strength", found.strength) / (1.3 / mu_0 * volume) - 1) < 1e-12
    # a dipole is too strong nearby; the pole has sunk by more than half of the way
    for near, height, far in snaps:
        assert near < far
        assert 0.5 < -height / near < 0.9
    assert snaps[0][0] > snaps[1][0]  # onto the softer one from further away
    for _, heights in curves.values():
        assert (np.diff(heights) < 0).all()


if __name__ == "__main__":
    main(sys.argv[1:])
