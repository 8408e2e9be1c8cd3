"""Where a membrane snaps, tips over and has several shapes: maps over the strength and the height of a dipole.

A three-term Ogden disc (susceptibility 2.5) near a dipole of strength M = 50 to 1000, below it (height h = -6 to -3) or above it (4 to 8).
Sweeps of each side answer: how many limit points does the branch have, and at which pressures; how many equilibria are there at P = 1.8,
and how many of them are stable (under pressure, and against one wave around the axis); at which height of its pole does the membrane, let
down from V = 3, tip over sideways (below only).

    python demos/sweep.py                       maps of 12 x 10 scenes a side in out/sweep, minutes
    python demos/sweep.py --counts 40 40        finer ones
    python demos/sweep.py --time                scenes per second on one core and two, and what a sweep costs beside a plain loop
    python demos/sweep.py --scheduler tcp://... on a Dask cluster

Finished scenes are kept in the folder, so that a second call only draws. At the end a line of scenes at h = -3.5 is checked against the
cusps of the fold curve: two limit points are born at M = 471.86, and two merge at M = 875.91.

Sources: material from Saxena, Reddy & Pradhan, Int. J. Non-Linear Mech. 116 (2019), table 1; the cusps come from `fm.fold_curve`.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

import femmembrane as fm

STRENGTH, HEIGHT = "source.0.strength", "source.0.height"
#: strengths at which two limit points are born and merge at h = -3.5, by fm.fold_curve with 64 quadratic elements
BORN, MERGED = 471.8615, 875.9078
LOAD = 1.8


def scene(title: str, run: fm.Run | None, elements: int = 12, azimuthal_modes: tuple[int, ...] = ()) -> fm.Scene:
    """The paper's membrane with a dipole that each scene of a sweep moves and strengthens."""
    return fm.Scene(
        title=title,
        material=fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
        sources=[fm.Dipole(strength=200.0, height=-3.5)],
        susceptibility=2.5,
        mesh=fm.disc(elements=elements),
        degree=4,
        run=run,
        analysis=fm.Analysis(azimuthal_modes=azimuthal_modes),
    )


def trace_run(start: float, quantity: str, end: float) -> fm.Run:
    return fm.Run(control="arc-length", start=start, until={quantity: end}, max_steps=200)


def maps(side: str, counts: tuple[int, int], elements: int, **how: Any) -> dict[str, fm.Sweep]:
    """The sweeps of one side, by their names."""
    low, high = {"below": (-6.0, -3.0), "above": (4.0, 8.0)}[side]
    over = {STRENGTH: np.linspace(50.0, 1000.0, counts[0]), HEIGHT: np.linspace(low, high, counts[1])}
    where = f"dipole {side} the membrane"
    # below, from the far end: a strong dipole leaves no state at a small volume to start from
    run, direction = (trace_run(30.0, "center_height", 0.15), -1) if side == "below" else (trace_run(0.5, "pressure", -1.0), 1)
    found = {"limits": fm.sweep(scene(f"Limit points, {where}", run, elements), over, direction=direction, **how)}
    modes = scene(f"Equilibria at P = {LOAD:g}, {where}", None, elements, azimuthal_modes=(1,))
    found["equilibria"] = fm.sweep(modes, over, quantity="equilibria", pressure=LOAD, **how)
    if side == "below":
        down = scene(f"Tipping over (n = 1), {where}", trace_run(3.0, "center_height", -0.2), elements)
        found["tipping"] = fm.sweep(down, over, quantity="tipping", direction=-1, **how)
    return found


def check_cusps(strengths: tuple[float, ...], elements: int, **how: Any) -> None:
    """At h = -3.5 the number of limit points changes where the fold curve has its cusps."""
    line = scene("", trace_run(30.0, "center_height", 0.15), elements)
    data = fm.sweep(line, {HEIGHT: [-3.5], STRENGTH: strengths}, direction=-1, **how).to_xarray().isel({HEIGHT: 0})
    print(f"\n{'M at h = -3.5':>14}  limit points  pressures")
    for strength in strengths:
        cell = data.sel({STRENGTH: strength})
        pressures = cell["limit_pressure"].values
        print(f"{strength:>14g}  {int(cell['limit_points']):>12}  {' '.join(f'{p:.5f}' for p in pressures[np.isfinite(pressures)])}")
    counts = dict(zip(strengths, data["limit_points"].values.tolist(), strict=True))
    for cusp, change in ((BORN, 2), (MERGED, -2)):
        before, after = max(m for m in strengths if m < cusp), min(m for m in strengths if m > cusp)
        assert counts[after] - counts[before] == change, counts


def report_time(counts: tuple[int, int], elements: int) -> None:
    """Scenes per second, and the share of the time that is not spent on the scenes."""
    run = trace_run(30.0, "center_height", 0.15)
    over = {STRENGTH: np.linspace(50.0, 500.0, counts[0]), HEIGHT: np.linspace(-6.0, -4.0, counts[1])}
    scenes = [scene("", run, elements).replace(sources=[fm.Dipole(float(m), float(h))]) for m in over[STRENGTH] for h in over[HEIGHT]]
    fm.sweep(scene("", run, elements), {STRENGTH: [40.0]}, direction=-1, workers=1)  # what is done once is done
    print(f"\n{len(scenes)} branches below the membrane   scenes/s  processor ms a scene  not in the scenes: wall ms  share")
    clock = time.perf_counter(), processor()
    for one in scenes:
        fm.trace(one.replace(title="loop"), start=30.0, until={"center_height": 0.15}, direction=-1, max_steps=200)
    print(f"{'plain loop of fm.trace':<29}{len(scenes) / (time.perf_counter() - clock[0]):>10.2f}", end="")
    print(f"{1e3 * (processor() - clock[1]) / len(scenes):>22.1f}")
    for workers in (1, 2):
        clock = time.perf_counter(), processor()
        found = fm.sweep(scene("", run, elements), over, direction=-1, workers=workers)
        wall, used = time.perf_counter() - clock[0], processor() - clock[1]
        print(f"{f'fm.sweep, workers={workers}':<29}{len(scenes) / wall:>10.2f}{1e3 * used / len(scenes):>22.1f}", end="")
        inside = float(found.to_xarray()["seconds"].sum()) / workers
        print(f"{1e3 * (wall - inside) / len(scenes):>28.2f}{(wall - inside) / inside:>7.1%}")


def processor() -> float:
    """Processor seconds of this process and of its children that have ended."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/sweep"), help="folder for maps, data sets and finished scenes")
    parser.add_argument("--counts", type=int, nargs=2, default=(12, 10), help="how many strengths and heights a side")
    parser.add_argument("--quick", action="store_true", help="few scenes on a coarse mesh: seconds")
    parser.add_argument("--time", action="store_true", help="only measure what a sweep costs")
    parser.add_argument("--scheduler", help="address of a Dask scheduler")
    given = parser.parse_args()
    counts, elements = ((2, 2), 6) if given.quick else (tuple(given.counts), 12)
    if given.time:
        return report_time(counts, elements)
    given.out.mkdir(parents=True, exist_ok=True)
    how: dict[str, Any] = {"out": given.out, "scheduler": given.scheduler, "workers": 1 if given.quick else None}
    for side in ("below",) if given.quick else ("below", "above"):
        for name, found in maps(side, counts, elements, **how).items():
            print(found)
            found.save(given.out / f"{side}-{name}.nc")
            numbered = [f"limit_pressure#{k}" for k in (2, 3) if name == "limits" and (found.to_xarray()["limit_identity"] == k).any()]
            show = {
                "limits": ["limit_points", *numbered],
                "tipping": ["onset_center_height", "onset_pressure"],
            }
            found.plot(given.out / f"{side}-{name}.png", show=show.get(name))
            again = fm.Sweep.load(given.out / f"{side}-{name}.nc").to_xarray()
            assert again.identical(found.to_xarray())
    check_cusps((466.0, 478.0, 870.0, 881.0), elements, **how)
    return None


if __name__ == "__main__":
    main()
