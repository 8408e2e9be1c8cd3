"""One disc of many rubbers: how the strain energy decides whether inflation has a limit point.

Every material has the shear modulus 1, so that all curves begin alike, with P = 3.34 V^3. Neo-Hookean, Varga and Ogden's membranes soften
and lose their grip at a pressure maximum; Gent's, Arruda and Boyce's and Fung's stiffen in time to have none. Varga's winds in a spiral
of limit points and volume folds while its pole is drawn out ever thinner. Mooney-Rivlin's loses its limit point when C_2/C_1 exceeds
0.0554, where the maximum meets the minimum beyond it: a cusp of the fold curve.

    python demos/materials.py --out out/materials
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import femmembrane as fm
from femmembrane.views.plots import new_figure, save_figure, tell_apart

MATERIALS = {
    "neo-Hookean": fm.NeoHookean(),
    "Varga": fm.Varga(),
    "Ogden (Treloar's rubber)": fm.Ogden.treloar(),
    "Mooney-Rivlin, C2/C1 = 0.05": fm.MooneyRivlin(0.05),
    "Mooney-Rivlin, C2/C1 = 0.1": fm.MooneyRivlin(0.1),
    "Gent, Jm = 30": fm.Gent(30.0),
    "Arruda-Boyce, N = 10": fm.ArrudaBoyce(10.0),
    "Yeoh, c2 = -0.01, c3 = 0.0005": fm.Yeoh(-0.01, 0.0005),
    "Fung, b = 0.05": fm.Fung(0.05),
}
LARGEST = 12.0


def scene(material: object) -> fm.Scene:
    return fm.Scene(material=material, mesh=fm.disc(16), degree=4)  # type: ignore[arg-type]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/materials"), help="folder for the picture")
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)

    figure, axes = new_figure((8.0, 5.0), title="A clamped disc inflated, by material")
    tell_apart(axes)
    limits: dict[str, list[float]] = {}
    print(f"{'material':32}{'P at V = 2':>12}{'last V':>9}{'last P':>9}   limit points")
    for name, material in MATERIALS.items():
        branch = fm.trace(scene(material), start=0.05, until={"volume": LARGEST}, max_steps=120, throw=False)
        limits[name] = [point.pressure for point in branch.special_points if point.kind == "limit_point"]
        middle = fm.equilibrium(scene(material), volume=2.0, solver="newton").pressure
        last = branch[-1]
        print(f"{name:32}{middle:12.6f}{last.volume:9.3f}{last.pressure:9.4f}   " + ", ".join(f"P = {p:.5f}" for p in limits[name]))
        axes.plot(branch.column("volume"), branch.column("pressure"), label=name)
    axes.set(xlabel="volume V/R₀³", ylabel="pressure P = p R₀/(μT)", xlim=(0, LARGEST), ylim=(0, 4))
    axes.legend(fontsize=8, frameon=False)
    save_figure(figure, asked.out / "materials.png")

    branch = fm.trace(scene(fm.MooneyRivlin(0.05)), start=0.5, until={"volume": LARGEST})
    start = next(point for point in branch.special_points if point.kind == "limit_point")
    curve = fm.fold_curve(scene(fm.MooneyRivlin(0.05)), start=start, parameter="material.ratio", bounds=(0.05, 0.1))
    (cusp,) = curve.cusps
    print(f"\nMooney-Rivlin's limit point is lost at C2/C1 = {cusp.value:.6f} (V = {cusp.volume:.4f}, P = {cusp.pressure:.5f})")

    assert abs(cusp.value - 0.05544) < 2e-5  # recorded on 2026-11-24
    assert abs(limits["neo-Hookean"][0] - 1.9) < 0.05  # see hysteresis.py
    for name in ("neo-Hookean", "Varga", "Ogden (Treloar's rubber)", "Mooney-Rivlin, C2/C1 = 0.05"):
        assert limits[name], name
    for name in ("Mooney-Rivlin, C2/C1 = 0.1", "Gent, Jm = 30", "Fung, b = 0.05"):
        assert not limits[name], name


if __name__ == "__main__":
    main(sys.argv[1:])
