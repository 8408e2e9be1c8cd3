"""Stable as long as it stays round: a membrane below whose pole a strong dipole sits tips over sideways.

A three-term Ogden disc (susceptibility 2.5) is inflated against the pull of a dipole of strength M = 600 at height h = -3.5. With the
pole at a height of 0.3 the energy rises in every axisymmetric perturbation of constant volume, so that an axisymmetric analysis calls
the state stable under volume control; but against perturbations with one wave around the axis it falls, and the membrane leans over to
one side. The demo draws that mode and animates it, lists the natural frequencies of 0 to 3 waves, and finds the height of the pole from
which on the membrane stands upright.

    python demos/tipping.py                table, picture and animation (for ParaView) in out/tipping, 10 seconds

Frequencies are in units of sqrt(mu/(rho_m R0^2)), with the volume held for 0 waves; directions that depart have a growth rate instead.

Sources: material from Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), table 1. The eigenvalues asserted at the end come from
an independent spectral Ritz solver; the height of the onset was recorded here, and agrees between two meshes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

import femmembrane as fm
from femmembrane.files import write_csv

SCENE = fm.Scene(
    material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
    sources=[fm.Dipole(strength=600, height=-3.5)],
    susceptibility=2.5,
    mesh=fm.disc(elements=64),
)
#: heights of the pole, the lower one tipping and the upper one upright
BRACKET = (0.3, 0.35)


def onset(scene: fm.Scene) -> tuple[float, fm.Equilibrium]:
    """Height of the pole at which the smallest eigenvalue for one wave is zero, and the equilibrium there."""
    near = fm.equilibrium(scene, center_height=BRACKET[0])

    def at(height: float) -> fm.Equilibrium:
        return fm.equilibrium(scene, center_height=height, start=near)

    height = float(brentq(lambda z: at(z).verdict(azimuthal=1).smallest_eigenvalue, *BRACKET, xtol=1e-12))
    return height, at(height)


def table(eq: fm.Equilibrium) -> list[dict[str, float]]:
    """The two lowest modes with 0 to 3 waves."""
    rows = []
    for n in range(4):
        for k, mode in enumerate(eq.frequencies(azimuthal=n, count=2, control="volume")):
            rows.append({"n": n, "mode": k + 1, "eigenvalue": mode.eigenvalue, "omega": mode.omega, "growth_rate": mode.growth_rate})
    return rows


def show(rows: Sequence[dict[str, float]]) -> None:
    print(f"{'waves':>5} {'mode':>5} {'eigenvalue':>12} {'frequency':>10} {'growth':>8}")
    for row in rows:
        motion = f"{row['omega']:>10.5f} {'-':>8}" if row["eigenvalue"] > 0 else f"{'-':>10} {row['growth_rate']:>8.5f}"
        print(f"{row['n']:>5} {row['mode']:>5} {row['eigenvalue']:>12.6f} {motion}")


def write(rows: Sequence[dict[str, float]], path: Path) -> None:
    write_csv(path, list(rows[0]), (list(row.values()) for row in rows))


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/tipping"), help="folder for table, picture and animation")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    eq = fm.equilibrium(SCENE, center_height=0.3)
    tipping = eq.frequencies(azimuthal=1, count=1)[0]
    rows = table(eq)
    write(rows, out / "frequencies.csv")
    fm.render_mode(eq, tipping, out / "tipping.png")
    fm.write_mode_vtk(eq, tipping, out / "tipping.pvd")
    print(f"pole height {eq.center_height:g}, V = {eq.volume:.6g}, P = {eq.pressure:.7g}")
    for verdict in (eq.verdict("volume"), eq.verdict(azimuthal=1)):
        print(f"  {verdict.reason}")
    show(rows)
    height, upright = onset(SCENE)
    print(f"upright from pole height {height:.6f} on (V = {upright.volume:.6f}, P = {upright.pressure:.6f})")

    smallest = [next(row["eigenvalue"] for row in rows if row["n"] == n) for n in range(4)]
    np.testing.assert_allclose(smallest, [3.9921275733491197, -0.4922455649823345, 1.1647418668436682, 3.059572153310816], rtol=1e-5)
    assert (eq.verdict("volume").word, eq.verdict(azimuthal=1).word) == ("stable", "unstable")
    assert tipping.omega == 0
    assert abs(tipping.growth_rate**2 - 0.4922455649823345) < 1e-5
    # between the bracket's ends, where the verdict turns, and the same on elements of another size and degree
    assert abs(upright.verdict(azimuthal=1).smallest_eigenvalue) < 1e-8
    finer, _ = onset(SCENE.replace(mesh=fm.disc(elements=16), degree=5))
    assert abs(height - finer) < 1e-7, (height, finer)
    above = fm.equilibrium(SCENE, center_height=height + 0.002, start=upright)
    assert all(above.verdict(azimuthal=n).stable for n in (1, 2, 3))
    assert above.verdict("volume").stable


if __name__ == "__main__":
    main(sys.argv[1:])
