"""A membrane blown into a bottle: where it touches, and how thin it becomes.

A disc of Gent's material is inflated by arc length into a mould, a bottle with a shoulder. It touches the wall next to its rim first and
lies on more and more of it. Without friction the membrane slides along the wall as it grows. It passes the shoulder, and meets the bottom
of the bottle at last, where it is thinnest. The thickness 1/(l1 l2) over the wall is the map that a designer asks for.

A cone takes the limit point away: with the apex of a cone in its way the pressure of a neo-Hookean disc, which has a limit point at
P = 1.879, rises all along the branch.

    python demos/bottle.py             table and picture in out/bottle (--movie: a movie as well), 15 seconds
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
from femmembrane.views.viewer import view

BOTTLE = fm.Mould([(1.0, 0.0), (1.0, 0.8), (0.5, 1.4), (0.5, 1.9), (0.0, 1.9)], rounding=0.3)
SCENE = fm.Scene(material=fm.Gent(30.0), mesh=fm.disc(64), obstacles=[BOTTLE], title="A membrane blown into a bottle")
CONE = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(48), obstacles=[fm.Mould([(1.0, 0.0), (0.0, 2.0)])])
#: pressures of the stages in the picture
STAGES = (1.0, 1.85, 2.5, 9.0)


def thickness(eq: fm.Equilibrium) -> np.ndarray:
    """Thickness over that at rest, at the nodes."""
    profile = eq.profile()
    return 1 / (profile["stretch_1"] * profile["stretch_2"])


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/bottle"), help="folder for picture and table")
    parser.add_argument("--movie", action="store_true", help="write a movie as well")
    options = parser.parse_args(arguments)
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)

    branch = fm.trace(SCENE, start=0.4, until={"pressure": 9.0})
    touch = next(point for point in branch.special_points if point.kind == "touch")
    print(f"the wall is touched first at P = {touch.pressure:.4f}, V = {touch.volume:.4f}")
    for pressure in STAGES[1:]:
        eq = next(eq for eq in branch if eq.pressure >= pressure)
        contact = eq.contact
        print(f"P = {eq.pressure:6.3f}  area in contact {contact.area:6.3f}  least thickness {thickness(eq).min():.4f} T")
    last = branch[-1].profile()
    names = ("r", "rho", "eta", "stretch_1", "stretch_2", "gap", "contact_pressure")
    write_csv(out / "thickness.csv", (*names, "thickness"), zip(*(last[name] for name in names), thickness(branch[-1]), strict=True))
    cone = fm.trace(CONE, start=0.3, until={"pressure": 4.0})
    print(f"in a cone: P rises up to {cone[-1].pressure:.3f}, special points: {', '.join(p.kind for p in cone.special_points)}")
    _draw(branch, out / "bottle.png")
    if options.movie:
        view(branch, movie=out / "bottle.gif")
    _check(branch, cone)


def _check(branch: fm.Branch, cone: fm.Branch) -> None:
    last = branch[-1]
    assert branch.status is fm.Status.CONVERGED
    assert last.contact.gap().min() >= -1e-9
    assert last.contact.pressure().min() >= 0
    assert last.center_height > 1.9 - 1e-9
    assert 0.09 < thickness(last).min() < 0.11
    assert next(point.kind for point in branch.special_points) == "touch"
    assert (np.diff(cone.column("pressure")) > 0).all()
    assert not [point for point in cone.special_points if point.kind == "limit_point"]


def _draw(branch: fm.Branch, path: Path) -> None:
    figure, (shape, wall) = plots.new_figure((9.6, 4.8), title=SCENE.title, widths=(1.0, 1.3))
    for line in BOTTLE.profile(0.3):
        for side in (1, -1):
            shape.plot(side * line[0], line[1], color="0.45", linewidth=2.5)
    for pressure, color in zip(STAGES, ("#56b4e9", "#0072b2", "#d55e00", "#222222"), strict=True):
        eq = next(eq for eq in branch if eq.pressure >= pressure)
        profile = eq.profile()
        rho, eta = profile["rho"], profile["eta"]
        shape.plot(np.append(-rho[::-1], rho), np.append(eta[::-1], eta), color=color, label=f"P = {eq.pressure:.3g}")
        wall.plot(profile["r"], thickness(eq), color=color)
    shape.set(xlabel="rho/R0", ylabel="eta/R0", aspect="equal", ylim=(-0.3, 2.0))
    shape.legend(frameon=False, fontsize=9, loc="lower center", ncols=2)
    wall.set(xlabel="reference radius r/R0", ylabel="thickness over T", yscale="log")
    wall.grid(color="0.9", linewidth=0.6)
    plots.save_figure(figure, path)


if __name__ == "__main__":
    main(sys.argv[1:])
