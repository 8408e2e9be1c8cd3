"""In which cones the limit point of an inflated disc is lost, and whether a pre-stretch brings it back.

A disc is clamped at the base of a rigid cone and inflated into it. Its meridian is convex, so that it comes to the wall at the rim first:
when its tangent there has turned to the wall. Up to then it is the free disc. So the free limit point is that of the disc in the cone as
long as the rim at the limit point leans more to the axis than the wall. One angle for each pre-stretch says this, and a fold curve over
the pre-stretch of the free disc gives it (angles from the axis, positive for cones that narrow). In narrower cones the wall comes first.
It puts the limit point off to a higher pressure, and in still narrower ones it is lost. Widening cones only put it off.

A limit point that a cone has taken away does come back with pre-stretch, in materials that stiffen less than as the square of the
stretch: Ogden's material of one term with a < 2. With a = 1.8 in a cone of 3 or of 7 degrees there is none without pre-stretch, and at 3
there is one. With a neo-Hookean disc (a = 2) none comes back in any cone that narrows. At a large pre-stretch its tension is that of the
square of the stretch alone, for which rho and eta obey linear equations. Their solution at the limit point is half a sphere, P = 2/p and
V = 2 pi/3 p^3, with an upright rim. With less pre-stretch the disc bulges farther. The angle is never positive, and that of Mooney-Rivlin
and Gent is lower still.

    python demos/cone_limit.py             table and picture in out/cone_limit, 15 seconds
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.views import plots

MATERIALS: dict[str, fm.Material] = {
    "Ogden, a = 1.6": fm.Ogden(mu=(2 / 1.6,), alpha=(1.6,)),
    "Ogden, a = 1.8": fm.Ogden(mu=(2 / 1.8,), alpha=(1.8,)),
    "neo-Hookean": fm.NeoHookean(),
    "Mooney-Rivlin, 0.02": fm.MooneyRivlin(0.02),
    "Gent, J = 100": fm.Gent(100.0),
}
LARGEST = 4.0
#: material, angle of the cone in degrees, pre-stretch: discs in contact that show the limit point, or do not
CHECKED = (
    ("Ogden, a = 1.8", 3.0, 1.0),
    ("Ogden, a = 1.8", 3.0, 1.5),
    ("Ogden, a = 1.8", 7.0, 1.0),
    ("Ogden, a = 1.8", 7.0, 3.0),
    ("Ogden, a = 1.8", 12.0, 3.0),
    ("Ogden, a = 1.6", 10.0, 1.0),
    ("neo-Hookean", 5.0, 1.0),
    ("neo-Hookean", 5.0, 3.0),
)
COLUMNS = ("material", "prestretch", "pressure", "volume", "angle")


def rim_angle(equilibrium: fm.Equilibrium) -> float:
    """Angle of the meridian at the rim from the axis, in degrees, positive where it leans towards the axis."""
    step = 1e-5
    at = equilibrium.profile([1.0 - step, 1.0])
    return math.degrees(math.atan2(at["rho"][1] - at["rho"][0], at["eta"][0] - at["eta"][1]))


def followed(material: fm.Material) -> fm.FoldCurve:
    """The first limit point of the free disc over the pre-stretch, up to the largest one or back to none."""
    scene = fm.Scene(material=material, mesh=fm.disc(24), degree=4)
    branch = fm.trace(scene, start=0.5, until={"volume": 6.0})
    limit = next(point for point in branch.special_points if point.kind == "limit_point")
    return fm.fold_curve(scene, start=limit, parameter="membrane.prestretch", bounds=(1.0, LARGEST))


def in_cone(material: fm.Material, angle: float, prestretch: float) -> fm.Branch:
    """A disc inflated into a cone, up to where the free one would be far beyond its limit point, or the wall has it."""
    lean = -math.tan(math.radians(angle))
    wall = fm.Mould(points=((prestretch, 0.0), (prestretch * (1 + 0.5 * lean), 0.5 * prestretch)))
    scene = fm.Scene(material=material, mesh=fm.disc(24), degree=3, prestretch=prestretch, obstacles=[wall])
    return fm.trace(scene, start=0.1 * prestretch**3, until={"volume": 2.6 * prestretch**3}, max_steps=200)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/cone_limit"), help="folder for picture and table")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    curves = {name: followed(material) for name, material in MATERIALS.items()}
    angles = {name: np.array([rim_angle(equilibrium) for equilibrium in curve.equilibria]) for name, curve in curves.items()}
    rows = [
        (name, p, pressure, volume, angle)
        for name, curve in curves.items()
        for p, pressure, volume, angle in zip(curve.values, curve.pressure, curve.volume, angles[name], strict=True)
    ]
    write_csv(out / "cone_limit.csv", COLUMNS, rows)
    print("steepest cone with the limit point of the free disc, degrees from the axis")
    print(f"{'material':<20} {'p = 1':>7} {'most':>7} {'at p':>6}   limit point ends at p")
    for name, curve in curves.items():
        k, cusp = int(angles[name].argmax()), next((c.value for c in curve.cusps), None)
        print(f"{name:<20} {angles[name][0]:>7.2f} {angles[name][k]:>7.2f} {curve.values[k]:>6.2f}   {cusp and round(cusp, 3)}")
    print("\nin cones, by contact          angle  pre-stretch  limit point")
    found = {case: _limit(in_cone(MATERIALS[case[0]], *case[1:])) for case in CHECKED}
    for (name, angle, p), limit in found.items():
        print(f"{name:<28} {angle:>6.1f} {p:>12.2f}  {'none' if limit is None else f'P = {limit:.4f}'}")
    _draw(curves, angles, out / "cone_limit.png")
    _check(curves, angles, found)


def _limit(branch: fm.Branch) -> float | None:
    return next((point.pressure for point in branch.special_points if point.kind == "limit_point"), None)


def _check(curves: dict[str, fm.FoldCurve], angles: dict[str, np.ndarray], found: dict[tuple[str, float, float], float | None]) -> None:
    for name in ("neo-Hookean", "Mooney-Rivlin, 0.02", "Gent, J = 100"):
        assert angles[name].max() < 0
    assert abs(angles["neo-Hookean"][-1]) < 0.02
    assert abs(curves["neo-Hookean"].volume[-1] / LARGEST**3 / (2 * math.pi / 3) - 1) < 1e-3
    assert abs(curves["neo-Hookean"].pressure[-1] * LARGEST / 2 - 1) < 2e-2
    for (name, angle, p), limit in found.items():
        free, known = (float(np.interp(p, curves[name].values, column)) for column in (angles[name], curves[name].pressure))
        if free > angle:
            assert limit is not None
            assert abs(limit / known - 1) < 1e-2
        else:
            assert limit is None or limit > known
    lost = [case for case, limit in found.items() if limit is None]
    assert lost == [CHECKED[k] for k in (0, 2, 4, 6, 7)]


def _draw(curves: dict[str, fm.FoldCurve], angles: dict[str, np.ndarray], path: Path) -> None:
    figure, axes = plots.new_figure((7.6, 4.8), title="Cones that leave a disc its limit point")
    for (name, curve), color in zip(curves.items(), ("#d55e00", "#e69f00", "#222222", "#0072b2", "#56b4e9"), strict=True):
        axes.plot(curve.values, angles[name], color=color, label=name)
    axes.axhline(0.0, color="0.6", linewidth=0.8)
    axes.text(LARGEST, 0.8, "a cylinder", ha="right", va="bottom", fontsize=9, color="0.4")
    axes.set(xlabel="pre-stretch", ylabel="angle of the steepest cone, degrees from the axis", xlim=(1, LARGEST), ylim=(-60, 45))
    plots.draw_legend(axes, loc="lower right", fontsize=9)
    plots.save_figure(figure, path)


if __name__ == "__main__":
    main(sys.argv[1:])
