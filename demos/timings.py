"""What a run costs: the 60-step inflation under a dipole, its set-up, and how both grow with the mesh.

Prints one table. Times are medians of repeated runs in one process, after imports, in seconds of its processor: what others do on a shared
machine is left out, but not what they do to its caches, so that times scatter by tens of per cent. Compare rows with each other.

    python demos/timings.py            all tables, about a minute
    python demos/timings.py --quick    one repetition on small meshes
"""

from __future__ import annotations

import argparse
import platform
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext

import numpy as np

import femmembrane as fm
from femmembrane.kernels import in_numpy, kernels
from femmembrane.potential import Potential
from femmembrane.solve.controls import VolumeControl
from femmembrane.solve.guess import spherical_dome
from femmembrane.solve.newton import NewtonResult, correct
from femmembrane.stability.zones import find_zones

OGDEN = fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0))
BOTH = ("pressure", "volume")


def scene(elements: int, degree: int = 2, stability: Sequence[str] = ()) -> fm.Scene:
    """The three-term Ogden membrane under a dipole of strength 200 at height 6.5."""
    return fm.Scene(
        material=OGDEN,
        sources=[fm.Dipole(strength=200, height=6.5)],
        susceptibility=2.5,
        mesh=fm.disc(elements=elements),
        degree=degree,
        analysis=fm.Analysis(stability=tuple(stability)),
    )


def seconds(work: Callable[[], object], repeat: int) -> float:
    """Median processor time of repeated calls."""
    times = []
    for _ in range(repeat):
        clock = time.process_time()
        work()
        times.append(time.process_time() - clock)
    return statistics.median(times)


def run_table(repeat: int) -> dict[str, float]:
    """60 volumes from 0.5 to 75 on 64 quadratic elements."""
    volumes = np.linspace(0.5, 75, 60)
    rows = {
        "IPOPT, both verdicts": seconds(lambda: fm.inflate(scene(64, stability=BOTH), volumes=volumes), repeat),
        "IPOPT, no verdict": seconds(lambda: fm.inflate(scene(64), volumes=volumes), repeat),
        "Newton, both verdicts": seconds(lambda: fm.inflate(scene(64, stability=BOTH), volumes=volumes, solver="newton"), repeat),
        "Newton, no verdict": seconds(lambda: fm.inflate(scene(64), volumes=volumes, solver="newton"), repeat),
    }
    print(f"\n60 equilibria, V = 0.5 to 75, 64 quadratic elements        {'s':>8} {'ms each':>8}")
    for name, t in rows.items():
        print(f"  {name:<54} {t:>10.3f} {t / 60 * 1e3:>8.2f}")
    return rows


def trace_table(repeat: int) -> dict[tuple[int, int], float]:
    """The same branch by arc length, compiled and in NumPy, and its error in P against a finer mesh at the same volume."""
    exact = fm.equilibrium(scene(64, 6), volume=75.4, solver="newton").pressure
    halves = {kernels().name: nullcontext, "NumPy": in_numpy}
    print(f"\nTraced by arc length, V = 0.35 to 75.4                {'points':>8} {'ms each':>8} {'+verdicts':>9} {'error in P':>11}")
    errors = {}
    for elements, degree in ((32, 2), (64, 2), (8, 6), (5, 6), (16, 4)):
        for name, half in halves.items():
            plain, judged = scene(elements, degree), scene(elements, degree, BOTH)
            with half():
                branch = fm.trace(plain, start=0.35, until={"volume": 75.4}, special_points=False)
                t = seconds(lambda s=plain: fm.trace(s, start=0.35, until={"volume": 75.4}, special_points=False), repeat)
                v = seconds(lambda s=judged: fm.trace(s, start=0.35, until={"volume": 75.4}, special_points=False), repeat)
            n = len(branch)
            error = errors[elements, degree] = abs(branch[-1].pressure / exact - 1)
            label = f"{elements:>4} elements of degree {degree}, {name}"
            print(f"  {label:<52} {n:>8} {t / n * 1e3:>8.2f} {v / n * 1e3:>9.2f} {error:>11.1e}")
    return errors


def effects_table(repeat: int) -> None:
    """What an effect costs when it is on: operations at a point, and one evaluation of value, gradient and Hessian; and wrinkling zones."""
    dipole = scene(64)
    scenes = {
        "no dipole": dipole.replace(sources=(), susceptibility=None),
        "dipole": dipole,
        "dipole, tension field": dipole.replace(tension_field=True),
    }
    states = {name: fm.equilibrium(s, volume=2.0, solver="newton") for name, s in scenes.items()}
    times: dict[str, list[float]] = {name: [] for name in states}
    for _ in range(3 * repeat):  # in turns, so that all see the same neighbours on the machine
        for name, eq in states.items():
            clock = time.process_time()
            for _ in range(100):
                eq.potential.evaluate(eq.state, eq.pressure)
            times[name].append((time.process_time() - clock) / 100)
    print(f"\nEffects, 64 quadratic elements                             {'operations':>10} {'ms each':>8}")
    for name, eq in states.items():
        print(f"  {name:<54} {eq.potential.operations:>12} {statistics.median(times[name]) * 1e3:>8.3f}")
    total = seconds(lambda: find_zones(dipole, states["dipole"].state, states["dipole"].pressure, "total"), 3 * repeat)
    print(f"  {'wrinkling zones of one equilibrium':<54} {'':>12} {total * 1e3:>8.3f}")


def growth_table(sizes: Sequence[int], repeat: int) -> None:
    """Set-up and one equilibrium, the next load step of a branch, against the number of quadratic elements."""
    print(f"\nGrowth with the mesh (quadratic elements)              {'set-up s':>10} {'next step s':>12} {'in NumPy':>10}")
    for elements in sizes:
        asked = scene(elements)
        clock = time.process_time()
        potential = Potential(asked)
        potential.evaluate(np.zeros(potential.space.n_free), 0.0)
        setup = time.process_time() - clock
        dome = spherical_dome(potential, 2.0)
        last = correct(potential, VolumeControl(2.0), dome, 1.9, damped=True, max_iterations=30)

        def step(p: Potential = potential, state: NewtonResult = last) -> NewtonResult:
            return correct(p, VolumeControl(2.05), state.x, state.pressure)

        times = [seconds(step, repeat)]
        with in_numpy():
            times.append(seconds(step, repeat))
        print(f"  {elements:>8} elements {setup:>44.3f} {times[0]:>12.4f} {times[1]:>10.4f}")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one repetition on small meshes")
    parser.add_argument("--out", help="not used: this demo only prints")
    quick = parser.parse_args(arguments).quick
    repeat = 1 if quick else 5
    half = f"{kernels().name} kernels"
    print(f"{platform.processor() or platform.machine()}, {half}, Python {platform.python_version()}, NumPy {np.__version__}")
    fm.inflate(scene(16, stability=BOTH), volumes=[0.5, 1.0])  # imports and first-call costs are not counted
    run_table(repeat)
    errors = trace_table(repeat)
    effects_table(repeat)
    growth_table((100, 1_000) if quick else (1_000, 10_000, 100_000), repeat if quick else 1)
    assert errors[32, 2] < 1e-6, errors
    assert errors[8, 6] < 1e-9, errors


if __name__ == "__main__":
    main(sys.argv[1:])
