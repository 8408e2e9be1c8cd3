"""Three tests of stability under pressure control, side by side: the second variation, and the tests of Legendre and Jacobi.

For states on both sides of limit points of four scenes, with and without a dipole, the table holds

* the smallest eigenvalue of the second variation and the number of directions in which the energy falls (by inertia, exact);
* the conjugate points of Jacobi's equation in its corrected form: as many as falling directions, in every row;
* the answer of Jacobi's test as printed, twice: integrated from r = 1e-4 and from r = 1e-2. With conjugate points it is called "unclear".

    python demos/jacobi_table.py                table in out/jacobi_table, 10 seconds

Sources: the tests are equations 40 and 42 to 45 of Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), the three-term Ogden
material its table 1. The eigenvalues asserted at the end come from an independent spectral Ritz solver.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import femmembrane as fm
from femmembrane.files import write_csv

OGDEN = fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0))
#: material, dipole (strength and height), pole heights in the order in which they are solved; | marks the limit points between them
SCENES = {
    "neo-Hookean": (fm.NeoHookean(), None, (0.5, 1.0, 1.5, 3.0)),  # 1 | 1.5
    "Ogden": (OGDEN, None, (1.0, 1.07, 1.085, 2.0, 3.0)),  # 1.07 | 1.085, 2 | 3
    "dipole above": (OGDEN, (200, 6.5), (4.7, 4.78, 4.9, 5.0)),  # 4.7 | 4.78
    "dipole below": (OGDEN, (600, -3.5), (0.3, 0.37, 0.376, 0.5, 1.0)),  # 0.37 | 0.376, 0.5 | 1
}
#: smallest eigenvalues under pressure control of a spectral Ritz solver with 72 modes
EXACT = {
    ("neo-Hookean", 0.5): 5.7951893406352255,
    ("neo-Hookean", 1.5): -3.362802758737201,
    ("Ogden", 2.0): -2.8519212674467798,
    ("Ogden", 3.0): 0.7586593453552801,
    ("dipole above", 4.7): 3.22123850032085,
    ("dipole below", 0.3): -1.7962924401141378,
    ("dipole below", 1.0): -1.8742886051402818,
}

CLOSING = """
Where the printed form fails, and why. It answers "stable" for {wrong} of the {unstable} unstable states: on the unstable side of every
limit point here. It finds conjugate points, and then says no more than "unclear", close to a strong dipole only; there they depend on
the radius from which one integrates, and in {unsure} of {rows} rows the answer does. It has two defects; each by itself loses conjugate
points:

1. The mixed derivative F_y'y of the integrand is not symmetric (the pressure enters it as P rho), and the printed equation has its
   transpose in its place. With this alone, the pole left free, no conjugate point is found on the falling branch of a balloon.
2. U = 0 holds the pole, which is free to rise. A membrane cannot be held at a point: held is the circle from which one integrates, and
   that hold fades only as the logarithm of its radius. Next to a limit point, where the energy barely falls, it hides the fall.

With the right derivative and a free pole, the conjugate points are as many as the falling directions, and enter through the rim exactly
at a limit point.
"""


@dataclass(frozen=True)
class Row:
    scene: str
    pole: float
    eigenvalue: float
    falling: int | None
    legendre: bool
    conjugate: str
    corrected: str
    printed: str
    printed_far: str

    @property
    def printed_is(self) -> str:
        """right, wrong, or unclear."""
        if self.printed == "unclear":
            return "unclear"
        return "right" if (self.printed == "stable") == (self.falling == 0) else "wrong"


def states(name: str) -> list[fm.Equilibrium]:
    """The equilibria of a scene, each found from the one before."""
    material, dipole, heights = SCENES[name]
    sources = [fm.Dipole(*dipole)] if dipole else []
    scene = fm.Scene(material=material, sources=sources, susceptibility=2.5, mesh=fm.disc(elements=64))
    found: list[fm.Equilibrium] = []
    for height in heights:
        found.append(fm.equilibrium(scene, center_height=height, start=found[-1] if found else None))
    return found


def judge(name: str, eq: fm.Equilibrium) -> Row:
    verdict, corrected = eq.verdict("pressure"), fm.jacobi_test(eq)
    return Row(
        scene=name,
        pole=round(eq.center_height, 6),
        eigenvalue=verdict.smallest_eigenvalue,
        falling=verdict.negative_directions,
        legendre=fm.legendre_test(eq).satisfied,
        conjugate=" ".join(f"{r:.4f}" for r in corrected.conjugate_points),
        corrected=corrected.conclusion,
        printed=fm.jacobi_test(eq, "printed", start=1e-4).conclusion,
        printed_far=fm.jacobi_test(eq, "printed", start=1e-2).conclusion,
    )


def show(rows: Sequence[Row]) -> None:
    print(f"{'':<13} {'pole':>6} {'smallest':>11} {'falling':>8} {'conjugate':>10} {'corrected':>10}   printed from 1e-4, from 1e-2    is")
    for r in rows:
        numbers = f"{r.scene:<13} {r.pole:>6g} {r.eigenvalue:>11.5g} {r.falling:>8} {r.conjugate or '-':>10} {r.corrected:>10}"
        print(f"{numbers}   {r.printed:>17}, {r.printed_far:>9}    {r.printed_is}")


def write(rows: Sequence[Row], path: Path) -> None:
    write_csv(path, [*(f.name for f in fields(Row)), "printed_is"], ([*asdict(row).values(), row.printed_is] for row in rows))


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/jacobi_table"), help="folder for the table")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    rows = [judge(name, eq) for name in SCENES for eq in states(name)]
    write(rows, out / "jacobi.csv")
    show(rows)
    unstable = [row for row in rows if row.falling]
    wrong = sum(row.printed_is == "wrong" for row in rows)
    unsure = sum(row.printed != row.printed_far for row in rows)
    print(CLOSING.format(wrong=wrong, unstable=len(unstable), unsure=unsure, rows=len(rows)).rstrip())

    assert all(row.legendre for row in rows)
    assert all(len(row.conjugate.split()) == row.falling for row in rows)
    assert all(row.corrected == ("unstable" if row.falling else "stable") for row in rows)
    found = {(row.scene, row.pole): row.eigenvalue for row in rows}
    assert all(abs(found[key] / value - 1) < 1e-4 for key, value in EXACT.items())
    # the printed form never raises a false alarm here, and misses most of what is unstable
    assert all(row.printed_is == "right" for row in rows if not row.falling)
    assert [(row.scene, row.pole) for row in unstable if row.printed_is == "unclear"] == [
        ("dipole above", 4.9),
        ("dipole above", 5.0),
        ("dipole below", 0.3),
    ]
    assert [row.pole for row in rows if row.printed != row.printed_far] == [4.9]


if __name__ == "__main__":
    main(sys.argv[1:])
