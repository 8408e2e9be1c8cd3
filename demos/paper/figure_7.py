"""Figure 7: where a membrane is wrinkled below a dipole at h = 4 with M = 100 and 200, by its total stress.

A dipole above compresses the sheet near the pole by its Maxwell stress, although both stretches exceed 1: both principal stresses are
negative around the pole (double wrinkling), the circumferential one also a little further out. The wrinkled part shrinks while the
membrane is inflated and grows with the strength of the dipole, as the paper says. It gives neither pressures nor heights of the pole;
those here, 0.2 to 0.8, are chosen.

By the mechanical stress, which alone the strain energy feels, none of these states is wrinkled (see demos/tension_field.py): the force of
the field depends on the position only, and is in the equilibrium already.

    python demos/paper/figure_7.py                 picture and table in out/figure-7, 3 seconds
"""

from __future__ import annotations

from pathlib import Path

import paper
from paper import Result, Row

import femmembrane as fm
from femmembrane.views import plots

HEIGHT = 4.0
POLES = (0.2, 0.4, 0.6, 0.8)
STRENGTHS = (100.0, 200.0)


def radius(eq: fm.Equilibrium, *kinds: str) -> float:
    """Reference radius up to which the membrane is wrinkled in one of these ways, from the pole."""
    return max((zone.r[1] for zone in eq.zones() if zone.kind in kinds), default=0.0)


def draw(states: dict[float, list[fm.Equilibrium]], path: Path) -> None:
    figure, panels = plots.new_figure((10.0, 5.6), widths=(1, 1))
    for axes, (strength, shown) in zip(panels, states.items(), strict=True):
        paper.draw_halves(axes, shown, [plots.verdict_style(eq) for eq in shown])
        axes.set(ylim=(-0.03, 0.9), xlim=(0, 1.12), title=f"M = {strength:g}, h = 4 (above the picture)")
    paper.shared_legend(figure, panels, 2)
    plots.save_figure(figure, path)


def make(out: Path) -> Result:
    states = {m: paper.at_heights(paper.scene(m, HEIGHT, wrinkling="total"), POLES) for m in STRENGTHS}
    draw(states, out / "figure-7.png")
    double = {m: [radius(eq, "double") for eq in shown] for m, shown in states.items()}
    any_kind = {m: [radius(eq, "double", "radial") for eq in shown] for m, shown in states.items()}
    weak, strong = any_kind.values()
    inside = [(double[m][k], any_kind[m][k]) for m in STRENGTHS for k in range(len(POLES)) if any_kind[m][k] > 0 and double[m][k] < 1]
    words = {
        "double wrinkles around the pole": all(double[m][k] > 0 for m in STRENGTHS for k in (0, 1)),
        "single (radial) wrinkles further out": all(inner < outer for inner, outer in inside),
        "wrinkled part shrinks as V rises": all(r == sorted(r, reverse=True) and r[-1] < r[0] for r in any_kind.values()),
        "wrinkled part grows with M": all(a <= b for a, b in zip(weak, strong, strict=True)) and weak[1] < strong[1],
    }
    rows = [Row("7", what, "yes", "yes" if holds else "no", shown="shrinks" in what) for what, holds in words.items()]
    paper.write_rows(rows, out / "figure-7.csv")

    for m, shown in states.items():
        for k, eq in enumerate(shown):
            zones = f"doubly wrinkled to r = {double[m][k]:.3f}, wrinkled to r = {any_kind[m][k]:.3f}"
            print(f"M = {m:g}, η(0) = {eq.center_height:g}: P = {eq.pressure:.4f}, {zones}")
    assert all(words.values()), words
    assert all(eq.zones("mechanical").kinds == ("taut",) for shown in states.values() for eq in shown)
    return Result((out / "figure-7.png",), tuple(rows))


if __name__ == "__main__":
    paper.main("figure-7", __doc__, make)
