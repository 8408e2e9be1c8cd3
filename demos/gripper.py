"""A soft pad on a ball: the force that an inflated membrane presses with, and where.

A stretched neo-Hookean membrane below a rigid ball is inflated. It touches the ball at its pole, wraps it, and presses with a force that
grows with the pressure. The pressure of contact is larger than that of the gas in front of a ball, by the tension along and across its
curvature: p = P + (T_1 + T_2)/R at the pole. Under pressure control all states are stable, against waves around the axis too.

    python demos/gripper.py             table and picture in out/gripper (--movie: a movie as well), 10 seconds
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

BALL = fm.Ball(height=0.8, radius=0.5)
SCENE = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(48), prestretch=1.2, obstacles=[BALL], title="A soft pad on a ball")
PRESSURES = (0.5, 1.0, 2.0)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/gripper"), help="folder for picture and table")
    parser.add_argument("--movie", action="store_true", help="write a movie as well")
    options = parser.parse_args(arguments)
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)

    branch = fm.trace(SCENE, start=0.1, until={"pressure": 2.0})
    print("       P        V   radius    force   contact pressure at the pole")
    rows = []
    for eq in branch:
        contact = eq.contact
        row = (eq.pressure, eq.volume, contact.radius if contact.touching else 0.0, contact.force, float(contact.pressure([0.0])[0]))
        rows.append(row)
        print(" ".join(f"{value:8.4f}" for value in row))
    write_csv(out / "force.csv", ("pressure", "volume", "contact_radius", "contact_force", "pole_pressure"), rows)
    stages = [fm.equilibrium(SCENE, pressure=pressure) for pressure in PRESSURES]
    _draw(branch, stages, out / "gripper.png")
    if options.movie:
        view(branch, movie=out / "gripper.gif")
    _check(branch, stages)


def _check(branch: fm.Branch, stages: Sequence[fm.Equilibrium]) -> None:
    touch = next(point for point in branch.special_points if point.kind == "touch")
    assert abs(touch.center_height - 0.3) < 1e-9
    force = branch.column("contact_force")
    assert (np.diff(force[force > 0]) > 0).all()
    for eq in stages:
        assert eq.verdict("pressure").stable
        assert eq.verdict(azimuthal=1).stable
        if eq.contact.touching:
            pole = eq.profile([0.0])
            # forces per length are stresses over the square of the stretch, as the membrane thins
            tension = 2 * pole["mechanical_stress_1"][0] / pole["stretch_1"][0] ** 2
            assert abs(eq.contact.pressure([0.0])[0] - (eq.pressure + tension / BALL.radius)) < 0.02 * eq.pressure


def _draw(branch: fm.Branch, stages: Sequence[fm.Equilibrium], path: Path) -> None:
    figure, (shape, line, along) = plots.new_figure((12.0, 4.2), title=SCENE.title, widths=(1.2, 1.0, 1.0))
    ball = BALL.profile()[0]
    shape.fill(ball[0], ball[1], color="0.85")
    for eq, color in zip(stages, ("#56b4e9", "#0072b2", "#d55e00"), strict=True):
        profile = eq.profile()
        rho, eta = profile["rho"], profile["eta"]
        shape.plot(np.append(-rho[::-1], rho), np.append(eta[::-1], eta), color=color, label=f"P = {eq.pressure:.3g}")
        along.plot(*_pressure_over_radius(eq), color=color)
    shape.set(xlabel="rho/R0", ylabel="eta/R0", aspect="equal")
    shape.legend(frameon=False, fontsize=9)
    plots.draw_branch(line, branch, across="pressure", up="contact_force", style=plots.PLAIN)
    line.legend(*plots.legend_entries(line), frameon=False, fontsize=9)
    along.set(xlabel="reference radius r/R0", ylabel="pressure of contact over mu T/R0")
    along.grid(color="0.9", linewidth=0.6)
    plots.save_figure(figure, path)


def _pressure_over_radius(eq: fm.Equilibrium) -> tuple[np.ndarray, np.ndarray]:
    """The pressure of contact, which jumps to zero at the border of contact."""
    r, pressure = np.zeros(0), np.zeros(0)
    for zone in eq.contact.zones:
        inside = np.linspace(zone.start, zone.stop, 60)
        r, pressure = np.append(r, inside), np.append(pressure, eq.contact.pressure(inside))
    border = r[-1] if r.size else 0.0
    return np.concatenate([r, [border, 1.0]]), np.concatenate([pressure, [0.0, 0.0]])


if __name__ == "__main__":
    main(sys.argv[1:])
