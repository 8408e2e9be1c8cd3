"""A mesh chosen for an accuracy, and what became of it.

The three-term Ogden disc below a dipole (M = 200, h = 6.5), inflated from V = 0.5 to 82 until the pole is drawn out towards the dipole. For
each accuracy that is asked for: the mesh that was chosen, its unknowns (elements times degree), the largest relative error of P over
the run, estimated at every state and found against 48 elements of degree 8, the seconds that the choice and the run took, and the number
(a power of 2) of equal quadratic elements that would do. Then the error estimate of the last state on the last mesh.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

import femmembrane as fm

VOLUMES = np.linspace(0.5, 82.0, 30)
SCENE = fm.Scene(
    material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
    sources=[fm.Dipole(strength=200, height=6.5)],
    susceptibility=2.5,
)


def inflated(mesh: fm.Disc, degree: int | None = None) -> fm.Branch:
    return fm.inflate(SCENE.replace(mesh=mesh, degree=degree), volumes=VOLUMES, solver="newton")


def largest_error(branch: fm.Branch, exact: fm.Branch) -> float:
    return float(np.abs(branch.column("pressure") / exact.column("pressure") - 1).max())


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", help="not used: this demo only prints")
    parser.parse_args(arguments)
    exact = inflated(fm.disc(48), 8)
    print("asked for  mesh chosen                unknowns  estimated   true error   choice s  run s   equal quadratic")
    rows = {}
    for accuracy in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10):
        branch = inflated(fm.disc(accuracy=accuracy))
        mesh, degree = branch.scene.mesh, branch.scene.degree
        estimated = max(eq.error_estimate().pressure.relative for eq in branch)
        error = largest_error(branch, exact)
        equal = next((n for n in (4, 8, 16, 32, 64, 128, 256, 512) if largest_error(inflated(fm.disc(n), 2), exact) < accuracy), None)
        seconds = branch.timings["mesh"], branch.timings["solve"]
        what, quadratic = f"{mesh.elements} elements of degree {degree}", f"{equal or '> 512'} elements"
        numbers = f"{mesh.elements * degree:>8}  {estimated:>9.1e}  {error:>11.1e}   {seconds[0]:>8.2f}  {seconds[1]:>5.2f}"
        print(f"{accuracy:<9.0e}  {what:<25}  {numbers}   {quadratic}")
        rows[accuracy] = error, estimated, mesh.elements * degree
    print(f"\nends of the elements for 1e-10: {', '.join(f'{r:.2f}' for r in mesh.breakpoints())}")
    print(branch[-1].error_estimate())
    for accuracy, (error, estimated, _) in rows.items():
        assert error < accuracy, (accuracy, error)
        assert 0.5 < estimated / error < 2, (accuracy, estimated, error)
    assert rows[1e-10][2] < 10 * rows[1e-2][2], rows


if __name__ == "__main__":
    main()
