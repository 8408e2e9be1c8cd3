"""It does not lean over, it jumps: what comes after the height at which a membrane above a strong dipole ceases to stand upright.

A three-term Ogden disc (susceptibility 2.5) is let down towards a dipole of strength M = 600 at height h = -3.5. At a pole height of 0.312
perturbations with one wave around the axis cost no energy any more. Koiter's coefficient of that onset says what follows, from third and
fourth derivatives there alone: negative at a held volume, so that the membrane jumps. The branch of leaning states proves it. It leads back
to larger volumes, turns at a fold of its own, and its stable part has less energy than the upright states long before these are unstable.

    python demos/tipped.py                 table, picture and surfaces (for ParaView) in out/tipped, 5 seconds

Sources: material from Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), table 1; W. T. Koiter, thesis, Delft 1945. The fold and
the fall of the energy asserted at the end were found by an independent code in three dimensions as well, to 1 part in 1000 and in 40.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.views import plots

SCENE = fm.Scene(
    material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
    sources=[fm.Dipole(strength=600, height=-3.5)],
    susceptibility=2.5,
    mesh=fm.disc(elements=8),
    degree=6,
    analysis=fm.Analysis(stability=("volume",), azimuthal_modes=(1,)),
)
#: height of the pole down to which the upright membrane is let down
LOWEST = 0.3
UPRIGHT, LEANING = "#777777", "#d55e00"


def falls(tipped: fm.TippedBranch) -> list[dict[str, float]]:
    """The leaning states beyond the fold, and how much less energy each has than the upright state at the same volume."""
    rows, near = [], fm.equilibrium(SCENE, center_height=LOWEST)
    for eq in tipped:
        if eq.verdict("volume").smallest_eigenvalue > 1e-6 or eq.pressure > 1.9:
            near = fm.equilibrium(SCENE, volume=eq.volume, start=near)
            numbers = {name: float(getattr(eq, name)) for name in ("volume", "pressure", "shift", "amplitude", "truncation")}
            rows.append({**numbers, "fall": near.energy - eq.energy})
    return rows


def draw(upright: fm.Branch, tipped: fm.TippedBranch, path: Path) -> None:
    figure, (left, right) = plots.new_figure((11, 4.4), widths=(3.0, 2.0))
    upright.plot(ax=left, label="upright")
    tipped.plot(ax=left, label="leaning")
    left.set(xlim=(0.41, 0.49), ylim=(1.83, 2.04))
    plots.draw_legend(left, fontsize=8, ncols=2)
    shape = fm.equilibrium(SCENE, center_height=LOWEST).profile(np.linspace(0, 1, 60))
    both = [np.concatenate([-shape["rho"][::-1], shape["rho"]]), np.concatenate([shape["eta"][::-1], shape["eta"]])]
    right.plot(*both, color=UPRIGHT, label="upright")
    cut = tipped[-1].surface(48)
    right.plot(*(np.concatenate([cut[name][::-1, 24], cut[name][:, 0]]) for name in ("x", "z")), color=LEANING, label="leaning")
    title = f"in the plane of symmetry at V = {tipped[-1].volume:.4f}"
    right.set(aspect="equal", xticks=(-1, -0.5, 0, 0.5, 1), xlabel="x", ylabel="z", title=title)
    plots.draw_legend(right, loc="upper center", bbox_to_anchor=(0.5, -0.5), ncols=2)
    plots.save_figure(figure, path)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/tipped"), help="folder for table, picture and surfaces")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    upright = fm.trace(SCENE, start=0.5, direction=-1, until={"center_height": LOWEST})
    onset = next(point for point in upright.special_points or () if point.kind == "azimuthal_onset")
    print(f"upright down to pole height {onset.center_height:.6f} (V = {onset.volume:.6f}, P = {onset.pressure:.6f})")
    for control in ("volume", "pressure"):
        print(f"  {onset.postbuckling.held(control).words}")
    tipped = fm.trace(SCENE, start=onset, until={"volume": upright[-1].volume}, harmonics=10)
    fold = next(point for point in tipped.special_points or () if point.kind == "volume_fold")
    print(f"leaning states up to V = {fold.volume:.5f}, P = {fold.pressure:.5f}, the fold of their branch")
    rows = falls(tipped)
    write_csv(out / "leaning.csv", list(rows[0]), (list(row.values()) for row in rows))
    gaps, volumes = [row["fall"] for row in rows], [row["volume"] for row in rows]
    equal = float(np.interp(0.0, gaps, volumes))
    print(f"less energy than upright below V = {equal:.4f}; at V = {volumes[-1]:.4f} by {gaps[-1]:.5f} mu T R0^2")
    last = tipped[-1]
    print(f"  there the pole is {abs(last.shift):.4f} R0 off the axis, and P is {last.pressure:.4f} after {upright[-1].pressure:.4f}")
    print(f"  {last.verdict('volume').reason}")
    draw(upright, tipped, out / "tipped.png")
    tipped.to_vtk(out / "leaning.pvd")

    assert onset.postbuckling.kind == "subcritical"
    assert abs(fold.volume - 0.4628) < 4e-4
    assert abs(equal - 0.4594) < 1e-3
    assert abs(gaps[-1] - 4.5e-3) < 1.2e-4
    assert abs(last.pressure - 2.02) < 5e-3
    assert abs(abs(last.shift) - 0.04) < 1e-3


if __name__ == "__main__":
    main(sys.argv[1:])
