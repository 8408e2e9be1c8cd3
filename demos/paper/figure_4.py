"""Figure 4: pressure against volume with a dipole of strength 200 (a) and 600 (b), below and above the membrane, and without one.

Above (h > 0) a dipole draws the well inflated membrane to itself: the pressure has a third limit point, closely followed by a fold of the
volume; beyond both the membrane is unstable even at a held volume. With M = 600 at h = 6 the pressure never rises a second time, and
the second limit point has met the third one and gone. Below (h < 0) the dipole holds the membrane down: pressures of a slightly inflated
membrane rise, with M = 600 so much that at h = -3.25 the pressure falls with the volume until deep into the inflation.

The paper prints no numbers here, and marks states as stable or unclear. Line styles show what each state is stable against among
axisymmetric shapes; on grey bands 1, 2 or 3 waves around the axis make it unstable, which the paper does not look at.

    python demos/paper/figure_4.py                 picture, curves and special points in out/figure-4, 8 seconds
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import paper
from paper import Result, Row

import femmembrane as fm
from femmembrane.results.table import write_csv, write_special_points_csv
from femmembrane.views import plots

#: strength: heights of the dipole, each with the volume of a start and where the curve ends
CURVES: dict[float, dict[float, tuple[float, dict[str, float]]]] = {
    0.0: {0.0: (0.1, {"volume": 110.0})},
    200.0: {-3.5: (0.3, {"volume": 110.0}), 6.5: (0.1, {"center_height": 5.4})},
    600.0: {
        -3.25: (1.2, {"volume": 110.0}),
        -3.5: (0.7, {"volume": 110.0}),
        6.0: (0.1, {"center_height": 4.45}),
        6.5: (0.1, {"center_height": 5.05}),
    },
}
#: where the names of the curves stand: volume and pressure
NAMES = {
    200.0: {-3.5: (74, 2.08), 6.5: (62, 1.56)},
    600.0: {-3.25: (3.0, 2.36), -3.5: (3.6, 2.13), 6.0: (2.2, 1.22), 6.5: (59, 1.6)},
}


def trace(strength: float, height: float) -> fm.Branch:
    start, until = CURVES[strength][height]
    return fm.trace(paper.scene(strength, height), start=start, until=until, steps=paper.STEPS)


def draw(branches: dict[tuple[float, float], fm.Branch], path: Path) -> None:
    figure, panels = plots.new_figure((12.0, 5.6), widths=(1, 1))
    for axes, strength in zip(panels, (200, 600), strict=True):
        paper.draw_plain(axes, branches[0.0, 0.0])
        for (m, h), branch in branches.items():
            if m == strength:
                paper.draw_curve(axes, branch)
                axes.annotate(f"h = {h:g}", NAMES[m][h], fontsize=11)
        axes.set(xlim=(0, 112), ylim=(0.55, 2.5), title=f"({'a' if strength == 200 else 'b'}) M = {strength}")
    paper.shared_legend(figure, panels, 3)
    plots.save_figure(figure, path)


def make(out: Path) -> Result:
    branches = {(m, h): trace(m, h) for m, heights in CURVES.items() for h in heights}
    for (m, h), branch in branches.items():
        write_csv(branch, out / f"M{m:g}-h{h:g}.csv")
        write_special_points_csv(branch, out / f"M{m:g}-h{h:g}-special-points.csv")
    draw(branches, out / "figure-4.png")
    below = [p.kind for p in branches[600.0, -3.25].special_points or ()]
    rows = [
        Row("4", "limit points, no dipole", "2", f"{len(branches[0.0, 0.0].special_points or ())}"),
        Row("4a", "a limit point more, dipole above, h = 6.5", "yes", "yes" if limits(branches[200.0, 6.5]) == 3 else "no", shown=True),
        Row("4b", "P falls to one minimum as V rises, h = -3.25", "yes", "yes" if below == ["limit_point"] else "no", shown=True),
    ]
    paper.write_rows(rows, out / "figure-4.csv")
    check(branches)
    return Result((out / "figure-4.png",), tuple(rows))


def limits(branch: fm.Branch) -> int:
    return sum(p.kind == "limit_point" for p in branch.special_points or ())


def check(branches: dict[tuple[float, float], fm.Branch]) -> None:
    above = branches[200.0, 6.5].special_points or ()
    assert [p.kind for p in above] == ["limit_point"] * 3 + ["volume_fold"]
    # by an independent spectral Ritz solver
    np.testing.assert_allclose([p.pressure for p in above], [1.894595, 1.485627, 1.933883, 1.930891], atol=2e-6)
    np.testing.assert_allclose([p.volume for p in above], [2.42233, 22.28724, 82.46971, 82.74808], rtol=2e-6)
    # recorded on 2026-11-24
    assert [limits(branches[600.0, h]) for h in (-3.25, -3.5, 6.0, 6.5)] == [1, 2, 1, 3]
    assert abs((branches[600.0, -3.25].special_points or ())[0].pressure - 1.529729) < 2e-6
    assert branches[200.0, 6.5][-1].verdict("volume").stable is False
    assert branches[200.0, -3.5][-1].verdict("pressure").stable


if __name__ == "__main__":
    paper.main("figure-4", __doc__, make)
