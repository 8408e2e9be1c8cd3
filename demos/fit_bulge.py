"""From a bulge test to the numbers of a rubber: what the data say, what they do not, and where to measure before anyone measures.

The sheet is that of demos/bulge-test.toml, 25 mm in radius and 0.3 mm thick, sagging under its own weight. The measurements are synthetic:
computed with the moduli below, with 1 % of scatter in the pressures and 0.1 mm in the heights. A first test stops early; the fit says which
combination of the moduli it knows, and up to which height to go on. demos/bulge-test.csv holds the longer test, for the command

    femmembrane fit demos/bulge-test.toml demos/bulge-test.csv --parameters material.c10 material.c01 --out out

and this script

    python demos/fit_bulge.py --out out/fit_bulge

writes fit.png, report.html, fit.csv and residuals.csv (--write: demos/bulge-test.csv anew).
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import femmembrane as fm

HERE = Path(__file__).parent
NAMES = ["material.c10", "material.c01"]
TRUTH = {"c10": "160 kPa", "c01": "12 kPa"}
NOISE = {"pressure": "1 %", "center_height": "0.1 mm"}


def measured(scene: fm.Scene, heights: np.ndarray, seed: int) -> dict[str, np.ndarray]:
    """A synthetic test of a sheet with the moduli above, at heights in mm."""
    material, modulus = fm.measured("mooney-rivlin", **TRUTH)
    scales = fm.Scales(radius=scene.scales.radius, thickness=scene.scales.thickness, shear_modulus=modulus)  # type: ignore[union-attr]
    weight = scene.scales.to_si("weight", scene.loads[0].weight)  # type: ignore[union-attr, attr-defined]
    sheet = scene.replace(material=material, scales=scales, loads=[fm.Weight(scales.from_si("weight", weight))], run=None)
    rng = np.random.default_rng(seed)
    pressure = np.array([fm.equilibrium(sheet, center_height=h / 25).pressure for h in heights])
    scattered = scales.to_si("pressure", pressure) / 1e3 * (1 + 0.01 * rng.normal(size=len(heights)))
    return {"pole_height_mm": np.round(heights + 0.1 * rng.normal(size=len(heights)), 2), "pressure_kPa": np.round(scattered, 4)}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/fit_bulge"), help="folder for tables, pictures and the page")
    parser.add_argument("--write", action="store_true", help="write demos/bulge-test.csv anew")
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)
    scene = fm.Scene.from_toml(HERE / "bulge-test.toml").replace(mesh=fm.disc(16), degree=4, run=None)

    early = fm.fit(scene, measured(scene, np.linspace(4, 12, 9), 1), NAMES, noise=NOISE)
    print(f"A test up to 12 mm:\n{early}\n")

    heights = np.linspace(4, 34, 16)
    table = measured(scene, heights, 7)
    if asked.write:
        with (HERE / "bulge-test.csv").open("w", newline="", encoding="utf-8") as file:
            file.write("# synthetic: 160 kPa and 12 kPa, 1 % and 0.1 mm of scatter; made by demos/fit_bulge.py\n")
            csv.writer(file, lineterminator="\n").writerows([list(table), *zip(*table.values(), strict=True)])
    found = fm.fit(scene, table, NAMES, noise=NOISE)
    print(f"A test up to 34 mm:\n{found}\n")
    held = fm.fit(scene, table, NAMES, noise={"pressure": "1 %"})
    ratio = found.standard_errors["material.c01"] / held.standard_errors["material.c01"]
    print(
        f"Heights taken as exact would give a chi^2 of {held.chi_square:.0f} in place of {found.chi_square:.0f} for {found.freedom} degrees"
    )
    print(f"of freedom, and a standard error of c01 that is {ratio:.2f} times too small.\n")

    strip = ("uniaxial", np.linspace(1.1, 3.0, 20))
    plan = fm.plan_fit(found.scene, NAMES, heights=np.linspace(0.1, 1.4, 27), points=16, tests={"strip": strip})
    print(f"Where 16 measurements of 1 % would say most:\n{plan}")

    found.plot(asked.out / "fit.png")
    found.report(asked.out / "report.html")
    found.write_csv(asked.out / "fit.csv")
    found.write_residuals(asked.out / "residuals.csv")

    assert not early.determined
    assert early.verdict.startswith("only ")
    assert "add heights above 12" in early.verdict
    assert found.determined
    for name, truth in zip(NAMES, (160e3, 12e3), strict=True):
        low, high = found.intervals[name]
        assert low < truth < high, name
    assert ratio > 1.2
    assert plan.determined


if __name__ == "__main__":
    main(sys.argv[1:])
