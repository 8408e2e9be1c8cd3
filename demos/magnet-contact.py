"""A membrane that snaps onto a magnet, and lets go farther away: hysteresis in the distance.

A stretched neo-Hookean disc at no pressure, and a cylinder magnet with a body above it that comes nearer and withdraws. As it comes, the
membrane bulges towards it, up to the distance at which the branch over the distance turns back: there the membrane snaps onto the face of
the magnet. On the face it is where the field is strong, so that it stays there when the magnet withdraws, up to a second turn, in contact,
at a larger distance. Between the two distances the membrane is free or held, by what happened before.

The branch by arc length goes through both turns, through the touch in between, and through states that are unstable.

    python demos/magnet-contact.py             table, picture and movie in out/magnet-contact, 40 seconds
    python demos/magnet-contact.py --no-movie  without the movie
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.views import plots
from femmembrane.views.viewer import view

OVER = "source.0.height"
MAGNET = fm.Magnet(height=1.0, radius=0.5, length=0.5, strength=(3.0 * 0.5**2 * 0.5 / 4) ** 2, body=True)
SCENE = fm.Scene(
    material=fm.NeoHookean(),
    mesh=fm.disc(elements=96),
    prestretch=1.35,
    sources=[MAGNET],
    susceptibility=1.0,
    analysis=fm.Analysis(stability=("pressure",)),
    title="A membrane that snaps onto a magnet and lets go",
)
#: heights of the middle of the magnet: down, and up again
DOWN, UP = np.linspace(1.0, 0.58, 22), np.linspace(0.59, 1.0, 22)
SNAP = "#9a1150"
#: from the middle of the magnet to its face, with the coating of the body
FACE = MAGNET.obstacle.length / 2


def turns(scene: fm.Scene, max_steps: int) -> tuple[fm.Branch, list[fm.SpecialPoint]]:
    """The branch over the distance, and the points at which it turns: where the membrane snaps on, and where it lets go."""
    branch = fm.trace(scene, over=OVER, hold={"pressure": 0.0}, until={OVER: DOWN[-1]}, direction=-1, max_steps=max_steps)
    found = [point for point in branch.special_points or () if point.kind == "number_fold"]
    return branch, found[:2]


def loop(scene: fm.Scene) -> fm.Branch:
    """The membrane while the magnet comes and goes."""
    return fm.vary(scene, OVER, [*DOWN, *UP], hold={"pressure": 0.0}, at_limit="jump")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/magnet-contact"), help="folder for table, picture and movie")
    parser.add_argument("--no-movie", dest="movie", action="store_false", help="leave the movie out")
    parser.add_argument("--quick", action="store_true", help="half as many elements, on which the branch is lost at the edge of the magnet")
    options = parser.parse_args(arguments)
    scene = SCENE.replace(mesh=fm.disc(elements=48)) if options.quick else SCENE
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)

    branch, (on, off) = turns(scene, 50 if options.quick else 200)
    path = loop(scene)
    print("distance     pole    force   radius")
    rows = [(eq.number(OVER) - FACE, eq.center_height, eq.contact.force, eq.contact.radius if eq.contact.touching else 0.0) for eq in path]
    for row in rows:
        print(" ".join(f"{value:8.4f}" for value in row))
    write_csv(out / "loop.csv", ("distance", "center_height", "contact_force", "contact_radius"), rows)
    path.save(out / "loop.nc")
    _draw(branch, path, (on, off), out / "magnet-contact.png")
    _check(branch, path, on, off)
    if options.movie:
        view(path, movie=out / "magnet-contact.gif")
    print(f"The face of the magnet comes to {on.number - FACE:.4f} R0 before the membrane snaps onto it,")
    print(f"and withdraws to {off.number - FACE:.4f} R0 before the membrane lets go.")


def _check(branch: fm.Branch, path: fm.Branch, on: fm.SpecialPoint, off: fm.SpecialPoint) -> None:
    assert on.number < off.number
    assert not on.equilibrium.contact.touching
    assert off.equilibrium.contact.touching
    touch = next(point for point in branch.special_points if point.kind == "touch")
    assert abs(touch.center_height - (touch.number - FACE)) < 1e-9
    assert [bool(eq.contact.touching) for eq in path[: len(DOWN) - 1]] == [bool(h < on.number) for h in DOWN[:-1]]
    assert [bool(eq.contact.touching) for eq in path[len(DOWN) :]] == [bool(h < off.number) for h in UP]
    assert len(path.jumps) == 2
    for eq in path:  # taut everywhere, and stable at this pressure
        assert eq.profile()["mechanical_stress_1"].min() > 0
        assert eq.verdict("pressure").stable


def _draw(branch: fm.Branch, path: fm.Branch, turns: Sequence[fm.SpecialPoint], out: Path) -> None:
    figure, (line, shape) = plots.new_figure((11.0, 4.6), title=SCENE.title, widths=(1.1, 1.0))
    plots.draw_branch(line, branch, across=OVER, up="center_height", dots=False)
    on, off = turns
    landed = on.number - FACE, fm.equilibrium(SCENE.replace(sources=[replace(MAGNET, height=off.number)]), pressure=0.0).center_height
    for point, there in zip(turns, landed, strict=True):  # at the distance at which it happens
        look = {"arrowstyle": "-|>", "color": SNAP, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 16}
        line.annotate("", (point.number, there), (point.number, point.center_height), arrowprops=look)
    line.plot([], [], color=SNAP, label="snap")
    line.margins(0.06)
    plots.draw_legend(line)
    before = path.jumps[0].index
    for eq, color, name in ((path[before - 1], "#0072b2", "before it snaps"), (path[before], "#d55e00", "after")):
        profile = eq.profile(np.linspace(0.0, 1.0, 301))
        rho, eta = profile["rho"], profile["eta"]
        shape.plot(np.append(-rho[::-1], rho), np.append(eta[::-1], eta), color=color, label=name)
        r, z = (np.array(part) for part in zip(*eq.scene.sources[0].outline().points, strict=True))
        shape.plot(np.append(r, -r[::-1]), np.append(z, z[::-1]), color=color, linewidth=1.0, linestyle="--")
    shape.set(xlabel="rho/R0", ylabel="eta/R0", aspect="equal", ylim=(-0.1, 1.3))
    shape.legend(frameon=False, fontsize=9, loc="upper right")
    plots.save_figure(figure, out)


if __name__ == "__main__":
    main(sys.argv[1:])
