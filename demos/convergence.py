"""How accurate is an answer, and what does it take to know one digit more?

The three-term Ogden disc below a dipole (M = 200, h = 6.5) at V = 50, on meshes of 8 to 64 elements of degree 1 to 4. Theory asks for
errors that fall like

    h^(2p)      pressure, energies and eigenvalues
    h^(p+1)     profile (rho, eta) in the L2 norm
    h^p         profile in the H1 norm

and an error is believed only where it stands ten times clear of what the reference itself does not know. The extrapolated values below
the table use no reference at all.

    python demos/convergence.py --out out/convergence

Source of the scene: Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), table 1 and figure 4.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import femmembrane as fm

SCENE = fm.Scene(
    title="Dipole above the membrane, V = 50",
    material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
    sources=[fm.Dipole(strength=200, height=6.5)],
    susceptibility=2.5,
)
RATIOS = (0.1, 0.5, 1.0, 2.0, 10.0)


def error_of_pressure(ratio: float) -> float:
    scene = SCENE.replace(mesh=fm.disc(64, ratio=ratio))
    return float(fm.convergence(scene, volume=50.0, degrees=(2,), elements=(64,)).errors["pressure"][0, 0])


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/convergence"), help="folder for table and picture")
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)

    study = fm.convergence(SCENE, volume=50.0)
    study.write_csv(asked.out / "convergence.csv")
    study.plot(asked.out / "convergence.png")
    print(study)

    # the profile is smooth from pole to rim, so that grading the mesh gains nothing here
    graded = {ratio: error_of_pressure(ratio) for ratio in RATIOS}
    print("\n64 quadratic elements, size at the rim over size at the pole -> error of P:")
    print(*(f"{ratio:>6g}: {error:.1e}" for ratio, error in graded.items()))

    for degree, row in zip(study.degrees, study.orders("pressure"), strict=True):
        known = row[np.isfinite(row)]
        assert abs(known[-1] - 2 * degree) < 0.5, (degree, row)
    for norm, more in (("profile_l2", 1), ("profile_h1", 0)):
        found = study.orders(norm)[:3, -1]
        assert np.allclose(found, np.array(study.degrees[:3]) + more, atol=0.2), (norm, found)
    values, errors = study.extrapolated("pressure")
    off = np.abs(values - study.reference["pressure"])
    assert (off[:3] <= 2 * errors[:3]).all(), (off, errors)
    assert study.floors["pressure"] < 1e-13
    assert min(graded.values()) > 0.8 * graded[1.0]
    assert max(graded.values()) > 5 * graded[1.0]


if __name__ == "__main__":
    main(sys.argv[1:])
