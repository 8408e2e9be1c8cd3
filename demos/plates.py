"""A balloon between two plates that close: where it is compressed first, and whether it wrinkles there.

Half a neo-Hookean ball that was inflated to a stretch, with a mirror at its equator, below a frictionless plate that comes down. Held is
the enclosed volume, or the amount of gas in it. It is said that such a balloon wrinkles from the border of contact on. In this model it
does not. Along the plate, where the pressure of contact is P, the tensions per length obey

    d(rho T_1)/drho = T_2,        beyond its border    d(rho T_1 cos phi)/ds = T_2 - P rho sin phi,    phi the slope of the meridian.

Contact ends tangentially, phi = 0, so that the tensions and their slopes are continuous there: only the curvature P/T_1 sets in.
Flattening takes a cap with the circumference sin(b) to a disc with b: the rim is stretched against the pole, the pole compressed against
the rim. So the smallest tension is that of the pole, and compression begins where the stretch at the pole falls to 1, in all directions
at once, in balloons of a stretch below 1.024 alone. There the plate holds the membrane flat. No number of waves loses stability, and
outside of contact no stress is ever compressive. A chamber of gas that gives way, under an atmosphere, changes numbers and not the place.

    python demos/plates.py             table and picture in out/plates, 15 seconds
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.views import plots

STRETCHES = (1.01, 1.02, 1.03, 1.05, 1.1, 1.3)
SHOWN = (1.02, 1.05, 1.1)
WAVES = (1, 2, 3, 4, 6, 8)
#: heights of the plate over that of the free balloon
HEIGHTS = np.array([1.005, *np.linspace(0.98, 0.4, 30)])
#: dead volume of the gas in the balloon: next to none
DEAD = 1e-6
#: pressure of the air around it
ATMOSPHERE = 10.0
COLUMNS = (
    "held",
    "stretch",
    "height",
    "pressure",
    "contact_radius",
    "pole_stress",
    "border_stress",
    "least_outside",
    "eigenvalue",
    "waves",
)


def balloon(stretch: float) -> fm.Scene:
    return fm.Scene(
        material=fm.NeoHookean(),
        mesh=fm.cap(height=1.0, elements=16, rim="mirror"),
        degree=4,
        obstacles=[fm.Plane(HEIGHTS[0] * stretch)],
        chamber=fm.Chamber(volume=DEAD, atmosphere=ATMOSPHERE),
        analysis=fm.Analysis(azimuthal_modes=WAVES),
        title="A balloon between plates",
    )


@dataclass(frozen=True)
class State:
    """One state: the height of the plate over that of the free balloon, and the smallest hoop stresses at pole, border, and outside."""

    height: float
    equilibrium: fm.Equilibrium
    pole: float
    border: float
    outside: float
    least: float
    waves: int

    @classmethod
    def of(cls, equilibrium: fm.Equilibrium, stretch: float) -> State:
        border = equilibrium.contact.reference_radius if equilibrium.contact.touching else 0.0
        profile = equilibrium.profile()
        outside = profile["r"] >= border
        least = min(float(profile[f"mechanical_stress_{k}"][outside].min()) for k in (1, 2))
        pole, edge = equilibrium.profile([0.0, border])["mechanical_stress_2"]
        value, waves = min((equilibrium.verdict(azimuthal=n).smallest_eigenvalue, n) for n in WAVES)
        return cls(equilibrium.number("obstacle.0.height") / stretch, equilibrium, float(pole), float(edge), least, float(value), waves)


def closed(stretch: float, held: str) -> list[State]:
    """The states while the plate comes down."""
    scene, volume = balloon(stretch), 2 * np.pi / 3 * stretch**3
    free = fm.equilibrium(scene, volume=volume)
    gas = (free.pressure + ATMOSPHERE) * (volume + DEAD)
    hold = {"volume": volume} if held == "volume" else {"gas": gas}
    branch = fm.vary(scene, over="obstacle.0.height", values=HEIGHTS * stretch, hold=hold, start=free, solver="newton")
    return [State.of(equilibrium, stretch) for equilibrium in branch]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/plates"), help="folder for picture and table")
    parser.add_argument("--quick", action="store_true", help="three balloons at a fixed volume alone")
    options = parser.parse_args(arguments)
    out = options.out
    out.mkdir(parents=True, exist_ok=True)

    runs = {("volume", stretch): closed(stretch, "volume") for stretch in (SHOWN if options.quick else STRETCHES)}
    if not options.quick:
        runs |= {("gas", stretch): closed(stretch, "gas") for stretch in (1.02, 1.3)}
    rows = [
        (held, stretch, s.height, s.equilibrium.pressure, s.equilibrium.contact.radius, s.pole, s.border, s.outside, s.least, s.waves)
        for (held, stretch), states in runs.items()
        for s in states
    ]
    write_csv(out / "plates.csv", COLUMNS, rows)
    print("held    stretch  compressed between  least stress: pole   border  outside   least eigenvalue, waves")
    for (held, stretch), states in runs.items():
        print(_line(held, stretch, states))
    _draw(runs, out / "plates.png")
    _check(runs)


def _line(held: str, stretch: float, states: Sequence[State]) -> str:
    slack = [s.height for s in states if s.pole < 0]
    between = f"{max(slack):.3f} and {min(slack):.3f}" if slack else "never"
    pole, border, outside = (min(getattr(s, name) for s in states) for name in ("pole", "border", "outside"))
    worst = min(states, key=lambda s: s.least)
    return f"{held:<7} {stretch:>7.2f}  {between:>18}  {pole:>18.4f} {border:>8.4f} {outside:>8.4f}   {worst.least:>16.4f}, {worst.waves}"


def _check(runs: dict[tuple[str, float], list[State]]) -> None:
    for (_, stretch), states in runs.items():
        assert len(states) == len(HEIGHTS)
        assert (min(s.pole for s in states) < 0) == (stretch < 1.025)
        for s in states:
            assert s.outside > 0  # the claim would have a compressive stress here, or at the border
            assert s.border > 0
            assert s.least > 0
            assert s.pole <= s.border + 1e-9


def _draw(runs: dict[tuple[str, float], list[State]], path: Path) -> None:
    figure, (left, right) = plots.new_figure((11.0, 4.6), title="A balloon between plates at a fixed volume", widths=(1, 1))
    states = runs["volume", 1.02]
    for s, color in zip((states[0], states[9], states[-1]), ("#999999", "#0072b2", "#d55e00"), strict=True):
        profile = s.equilibrium.profile()
        left.plot(profile["rho"], profile["eta"], color=color, label=f"plate at {s.height:.2f}")
    left.set(xlabel="rho", ylabel="z", aspect="equal")
    plots.draw_legend(left, loc="lower left", fontsize=9)
    for stretch, color in zip(SHOWN, ("#d55e00", "#0072b2", "#222222"), strict=True):
        known = runs["volume", stretch]
        heights = [s.height for s in known]
        right.plot(heights, [s.pole for s in known], color=color, label=f"pole, stretch {stretch}")
        right.plot(heights, [s.border for s in known], "--", color=color, label=f"border, stretch {stretch}")
    right.axhline(0.0, color="0.6", linewidth=0.8)
    right.set(xlabel="height of the plate over that of the free balloon", ylabel="hoop stress over mu", ylim=(-0.1, 0.9))
    right.invert_xaxis()
    plots.draw_legend(right, loc="upper left", fontsize=9)
    plots.save_figure(figure, path)


if __name__ == "__main__":
    main(sys.argv[1:])
