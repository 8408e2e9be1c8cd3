"""At which distance does a membrane snap onto a magnet?

A neo-Hookean disc with a point dipole above it, at several held pressures. As the magnet comes nearer, the membrane rises towards it, up to
the distance at which the branch over the distance turns back (a limit point in the distance): there the membrane snaps onto the magnet. The
same holds for a magnet at rest whose strength grows (Barham's magnetic limit point). States on the dotted parts are unstable at a held
pressure.

The second picture shows a balloon of three-term Ogden rubber that a magnet below holds back at P = 2. The magnet is withdrawn, and the
balloon snaps to a forty times larger volume. When the magnet returns it stays large: what it does depends on the past.

    python demos/magnet-snap.py                 pictures and table in out/magnet-snap, 10 seconds

Sources: M. Barham, D. J. Steigmann, M. McElfresh & R. E. Rudd, Acta Mech. 191 (2007), for the magnetic limit point; the rubber from
Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), table 1. Every snap is checked against the limit point of the pressure in the
scene with that number, found without it.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.views import plots

SCENE = fm.Scene(
    material=fm.NeoHookean(),
    mesh=fm.disc(elements=32),
    sources=[fm.Dipole(strength=20.0, height=4.5)],
    susceptibility=1.0,
    analysis=fm.Analysis(stability=("pressure",)),
    title="A membrane that snaps onto a magnet, at held pressures",
)
BALLOON = fm.Scene(
    material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
    mesh=fm.disc(elements=32),
    sources=[fm.Dipole(strength=600.0, height=-3.5)],
    susceptibility=2.5,
    title="A balloon at P = 2, held back by a magnet below that leaves and returns",
)
PRESSURES = (0.0, 0.2, 0.4, 0.6)
#: what is varied, with which magnet it sets out, how far it goes, and where the branch is followed to if it turns back
WAYS = {"source.0.height": (fm.Dipole(strength=20.0, height=4.5), 1.5), "source.0.strength": (fm.Dipole(strength=5.0, height=3.0), 400.0)}
RISEN = 1.1


def snaps(over: str) -> list[tuple[float, fm.Branch, fm.SpecialPoint]]:
    """For each pressure the branch over a number, and the point at which it turns."""
    found, (magnet, end) = [], WAYS[over]
    for pressure in PRESSURES:
        scene = SCENE.replace(sources=[magnet])
        branch = fm.trace(scene, over=over, hold={"pressure": pressure}, until={over: end, "center_height": RISEN})
        turn = next(p for p in branch.special_points or () if p.kind == "number_fold")
        found.append((pressure, branch, turn))
    return found


def draw(found: dict[str, list[tuple[float, fm.Branch, fm.SpecialPoint]]], path: Path) -> None:
    figure, row = plots.new_figure((11.0, 4.6), title=SCENE.title, widths=(1, 1))
    for axes, (over, branches) in zip(row, found.items(), strict=True):
        for pressure, branch, _ in branches:
            plots.draw_branch(axes, branch, across=over, up="center_height", dots=False)
            first = (branch[0].number(over), branch[0].center_height)
            inward = -1 if over.endswith("height") else 1
            plots.add_label(axes, f"P = {pressure:g}", first, way=(-inward, 0))
        axes.margins(x=0.17)  # room for the labels before the lines
    plots.draw_legend(row[0], loc="upper right")
    plots.save_figure(figure, path)


def hysteresis() -> fm.Branch:
    """The balloon while the magnet is withdrawn and comes back."""
    small = fm.equilibrium(BALLOON, volume=1.2)
    away = np.linspace(-3.5, -6.0, 26)
    heights = [*away, *away[-2::-1]]
    return fm.vary(BALLOON, "source.0.height", heights, hold={"pressure": 2.0}, start=small, at_limit="jump")


def check(turn: fm.SpecialPoint, pressure: float) -> None:
    """In the scene of the snap the pressure has a limit point at the held pressure."""
    own = fm.trace(turn.equilibrium.scene, start=turn.equilibrium, direction=-1, until={"volume": 0.8 * turn.volume}).special_points or ()
    own = (*own, *(fm.trace(turn.equilibrium.scene, start=turn.equilibrium, until={"volume": 1.2 * turn.volume}).special_points or ()))
    assert min(abs(p.pressure - pressure) for p in own if p.kind == "limit_point") < 1e-9


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/magnet-snap"), help="folder for pictures and table")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    found = {over: snaps(over) for over in WAYS}
    rows: list[list[Any]] = []
    for over, branches in found.items():
        for pressure, _, turn in branches:
            check(turn, pressure)
            rows.append([over, pressure, turn.equilibrium.number(over), turn.center_height, turn.volume])
    write_csv(out / "snaps.csv", ["number", "pressure", "value", "center_height", "volume"], rows)
    draw(found, out / "magnet-snap.png")
    loop = hysteresis()
    loop.plot(out / "magnet-hysteresis.png")
    loop.save(out / "magnet-hysteresis.nc")

    distances = [row[2] for row in rows if row[0] == "source.0.height"]
    strengths = [row[2] for row in rows if row[0] == "source.0.strength"]
    assert (np.diff(distances) > 0).all()  # the more pressure, the sooner
    assert (np.diff(strengths) < 0).all()
    (jump,) = loop.jumps
    assert jump.limit is not None
    assert loop[0].volume < 2 < 80 < loop[-1].volume
    lines = [
        f"P = {p:.1f}: a magnet of strength 20 at {h:.4f}, or one at 3 of strength {m:.2f}"
        for p, h, m in zip(PRESSURES, distances, strengths, strict=True)
    ]
    print("The membrane snaps onto", *lines, sep="\n")
    print(f"The balloon snaps when the magnet is at {jump.limit.equilibrium.number('source.0.height'):.5f}")


if __name__ == "__main__":
    main(sys.argv[1:])
