"""A magnetised valve membrane that snaps open when a magnet turns.

The sheet is magnetised along its normal (a remanence of 71 mT on a rubber of 45 kPa, carried by the deformation). A magnet below, with its
moment along the axis, holds the valve closed at a pressure at which the membrane alone would have snapped open. As the magnet turns, its
hold weakens. At 65 degrees the closed state meets its limit point, and the membrane snaps to 33 times the volume; turned back, it stays
open.

Only the axial part cos(angle) of the moment counts here. The energy of a hard sheet is linear in the field. So the part across the axis
pulls at a round membrane with one wave around the axis and, to first order, not at its pressure and volume; and the closed states are
stable against such a pull.

    python demos/valve.py                       picture and table in out/valve, 3 seconds

Sources: material from Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), table 1; the limit point without a magnet from an
independent spectral Ritz solver (P = 1.899084863).
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

import femmembrane as fm
from femmembrane.files import write_csv
from femmembrane.views import plots

STRENGTH, HEIGHT, PRESSURE = 20.0, -2.5, 1.92
SCENE = fm.Scene(
    material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
    mesh=fm.disc(elements=24),
    degree=4,
    sources=[fm.Dipole(STRENGTH, HEIGHT)],
    remanence=0.3,
    remanence_direction="normal",
    analysis=fm.Analysis(stability=("pressure", "volume")),
    title="A magnet that turns below a magnetised valve membrane",
)
ANGLES = np.arange(0.0, 181.0, 5.0)


def at(angle: float) -> fm.Scene:
    """The valve above the axial part of the moment of a magnet at an angle in degrees."""
    part = math.cos(math.radians(angle))
    return SCENE.replace(sources=[fm.Dipole(STRENGTH * part**2, HEIGHT, 1 if part > 0 else -1)])


def limit_angle() -> float:
    """The angle at which the limit point of the closed valve has come down to the pressure."""
    first = (fm.trace(SCENE, start=0.3, until={"volume": 5.0}).special_points or ())[0]
    curve = fm.fold_curve(SCENE, start=first, parameter="source.0.strength", bounds=(0.01, STRENGTH), direction=-1)
    assert curve.status is fm.Status.CONVERGED
    part = np.sqrt(curve.values / STRENGTH)
    spline = CubicSpline(part[::-1], curve.pressure[::-1] - PRESSURE)
    (found,) = [root for root in spline.roots(extrapolate=False) if 0 < root < 1]
    return math.degrees(math.acos(float(found)))


def turned(angles: Sequence[float], start: fm.Equilibrium) -> list[fm.Equilibrium]:
    """The valve at these angles, from state to state; where its state is gone, the stable one of the largest volume."""
    found = [start]
    for angle in angles:
        scene = at(angle)
        try:
            state = fm.equilibrium(scene, pressure=PRESSURE, start=found[-1], solver="newton")
            kept = bool(state.verdict("pressure").stable) and state.volume < 2 * found[-1].volume
        except fm.SolveError:
            kept = False
        if not kept:
            state = max((eq for eq in fm.equilibria(scene, pressure=PRESSURE) if eq.verdict("pressure").stable), key=lambda eq: eq.volume)
        found.append(state)
    return found[1:]


def draw(angles: Sequence[float], there: list[fm.Equilibrium], back: list[fm.Equilibrium], limit: float, path: Path) -> None:
    figure, (left, right) = plots.new_figure((10.5, 4.8), title=SCENE.title, widths=(1.4, 1))
    last = next(k for k, eq in enumerate(there) if eq.volume > 10)
    volumes, label = [eq.volume for eq in there], "turned"
    for part in (slice(0, last), slice(last, None)):
        left.plot(angles[part], volumes[part], "o-", ms=4, color=plots.BOTH.color, label=label)
        label = None
    left.plot([limit, angles[last]], [volumes[last]] * 2, color=plots.BOTH.color)
    snap = {"arrowstyle": "-|>", "color": "#a01040", "linewidth": 1.6, "mutation_scale": 15, "shrinkA": 0, "shrinkB": 0}
    left.annotate("", (limit, volumes[last]), (limit, volumes[last - 1]), arrowprops=snap)
    left.plot([], [], color=snap["color"], label="snap")
    left.plot(angles, [eq.volume for eq in back], "--", color=plots.VOLUME_ONLY.color, label="turned back")
    left.set(
        xlabel="angle of the magnet in degrees",
        ylabel="volume V/R₀³",
        yscale="log",
        yticks=(ticks := (2, 5, 10, 20, 50)),
        yticklabels=ticks,
    )
    left.minorticks_off()
    left.grid(color="0.9", linewidth=0.6)
    plots.draw_legend(left, loc="center left")
    for eq, style in ((there[last - 1], plots.BOTH), (there[last], plots.VOLUME_ONLY)):
        plots.draw_profile(right, eq, style)
    plots.draw_surroundings(right, [there[last]])
    right.set_title("before and after")
    plots.save_figure(figure, path)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/valve"), help="folder for picture and table")
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)

    limit = limit_angle()
    angles = ANGLES[ANGLES < 89]  # beyond, the part along the axis grows again, with the other sign
    closed = fm.equilibrium(at(0.0), pressure=PRESSURE)
    there = turned(angles.tolist(), closed)
    back = turned(angles[::-1].tolist(), there[-1])[::-1]
    columns = ("angle", "volume_turned", "volume_turned_back")
    write_csv(out / "valve.csv", columns, ((a, s.volume, t.volume) for a, s, t in zip(angles, there, back, strict=True)))
    draw(angles.tolist(), there, back, limit, out / "valve.png")

    opened = [k for k, eq in enumerate(there) if eq.volume > 10]
    print(f"P = {PRESSURE}: the limit point of the closed valve is passed at {limit:.2f} degrees")
    print(f"closed at {angles[opened[0] - 1]:g} degrees: V = {there[opened[0] - 1].volume:.4f}")
    print(f"open at {angles[opened[0]]:g} degrees: V = {there[opened[0]].volume:.4f}; turned back to 0 degrees V = {back[0].volume:.4f}")

    assert angles[opened[0] - 1] < limit < angles[opened[0]]
    assert all(eq.volume > 60 for eq in back)
    assert all(eq.verdict("pressure").stable for eq in (*there, *back))
    assert all(eq.verdict(azimuthal=1).stable for eq in there[: opened[0]])
    # without a magnet the limit point is below the pressure, known from an independent solver
    bare = fm.trace(SCENE.replace(sources=[]), start=0.3, until={"volume": 5.0}).special_points or ()
    assert abs(bare[0].pressure - 1.899084863) < 1e-6


if __name__ == "__main__":
    main(sys.argv[1:])
