"""Treloar's rubber in equibiaxial tension: seven strain energies, what sixteen points say of their numbers, and published sets.

The points are those of L. R. G. Treloar, Trans. Faraday Soc. 40 (1944): stretches and nominal stresses in MPa. Beside the fits stand two
sets that were published for this rubber and were fitted to simple tension and shear as well: Ogden's three terms (1972) and the modulus of
the statistical theory (Treloar 1944: 4 kg/cm^2).

    python demos/fit_treloar.py --out out/fit_treloar

compares the models and writes models.csv, fit.csv, treloar.png, and fit.png of the best model.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import femmembrane as fm
from femmembrane.views.plots import new_figure, save_figure, tell_apart

STRETCH = np.array([1.027, 1.065, 1.115, 1.14, 1.2, 1.31, 1.42, 1.68, 1.94, 2.49, 3.03, 3.43, 3.75, 4.07, 4.26, 4.45])
STRESS = np.array(
    [0.0925, 0.157, 0.2387, 0.257, 0.3282, 0.4364, 0.5146, 0.6557, 0.7652, 0.9617, 1.2386, 1.4401, 1.7096, 1.9845, 2.2065, 2.4426]
)
KILOGRAM_PER_CM2 = 0.0980665  # MPa


def nominal(material: fm.Ogden | fm.NeoHookean, modulus: float, stretch: np.ndarray) -> np.ndarray:
    """Nominal stress of equal stretches in both directions, in the unit of the modulus."""
    strain = np.log(stretch)
    return modulus * np.asarray(material.stress(strain, strain)[0]) / stretch


def scatter(stress: np.ndarray) -> float:
    return float(np.sqrt(np.mean((stress - STRESS) ** 2)))


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/fit_treloar"), help="folder for tables and pictures")
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)

    sheet = fm.Scene(
        material=fm.NeoHookean(),
        mesh=fm.disc(8),
        scales=fm.Scales(radius=0.025, thickness=1e-3, shear_modulus=4e5),
        title="Treloar's rubber",
    )
    table = {"stretch": STRETCH, "equibiaxial_stress_MPa": STRESS}
    models = fm.compare_models(sheet, table)
    print(models)
    models.write_csv(asked.out / "models.csv")
    for model in models:
        assert model.fit is not None, model.message
        print(f"\n{model.name}: {model.fit.verdict}")
        for name, value in model.fit.values.items():
            error = model.fit.standard_errors[name] / abs(value) if value else np.inf
            unit = f"{value / 1e6:.5g} MPa" if model.fit.units[name] else f"{value:.4g}"
            print(f"    {name.removeprefix('material.'):<8} {unit:<14}" + (f" +- {100 * error:.2g} %" if error < 10 else ""))
    models.best.write_csv(asked.out / "fit.csv")
    models.best.plot(asked.out / "fit.png")

    published = {
        "Ogden (1972), three terms": (fm.material("treloar-ogden"), 4.225 * KILOGRAM_PER_CM2),
        "statistical theory, Treloar (1944)": (fm.NeoHookean(), 4 * KILOGRAM_PER_CM2),
    }
    figure, axes = new_figure((7.0, 4.8), title="Treloar's rubber in equibiaxial tension")
    tell_apart(axes)
    axes.plot(STRETCH, STRESS, "o", color="#222222", ms=5, label="measured, Treloar (1944)", zorder=3)
    print(f"\n{'root mean square deviation from the points':<46}MPa")
    stretch = np.linspace(1.0, 4.5, 200)
    for name, (material, modulus) in published.items():
        left = scatter(nominal(material, modulus, STRETCH))  # type: ignore[arg-type]
        print(f"{name:<46}{left:.4f}")
        axes.plot(stretch, nominal(material, modulus, stretch), label=name)  # type: ignore[arg-type]
    for key in ("yeoh", "ogden-2", "gent", "neo-hookean"):
        fit = models[key].fit
        left = scatter(fit.columns[0].predicted)
        print(f"{key + ', fitted':<46}{left:.4f}")
        own = fit.scene
        axes.plot(stretch, nominal(own.material, own.scales.shear_modulus / 1e6, stretch), label=f"{key}, fitted")
    axes.set(xlabel="stretch", ylabel="nominal stress in MPa", xlim=(1, 4.5), ylim=(0, 2.6))
    axes.legend(fontsize=8, frameon=False)
    save_figure(figure, asked.out / "treloar.png")

    errors = {model.name: scatter(model.fit.columns[0].predicted) for model in models if model.fit is not None}
    assert models[0].name in ("yeoh", "ogden-2")
    assert errors["ogden-2"] < 0.02 < scatter(nominal(fm.material("treloar-ogden"), 4.225 * KILOGRAM_PER_CM2, STRETCH)) < 0.2  # type: ignore[arg-type]
    assert not models["ogden-3"].fit.determined  # a third term is no number of these points
    assert models.weights()["neo-hookean"] < 1e-6


if __name__ == "__main__":
    main(sys.argv[1:])
