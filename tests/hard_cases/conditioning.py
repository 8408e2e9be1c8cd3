"""Digits that are there on every mesh, and work that does not grow with it."""

from __future__ import annotations

import numpy as np

import femmembrane as fm

from ..cases import OGDEN, POINTS, disc_scene
from .registry import Family, Number, reached, settled

FAMILY = Family(9, "conditioning")

#: equilibrium of tests/data/disc.json under a dipole, known to twelve digits
POINT = next(p for p in POINTS if p.scene_name == "dipole_above" and p.is_minimum("pressure"))


def on(elements: int, degree: int) -> fm.Equilibrium:
    scene = POINT.scene.replace(mesh=fm.disc(elements=elements), degree=degree)
    return settled(fm.equilibrium(scene, volume=POINT.expected["volume"], solver="newton"))


FLOOR = "condition numbers grow as elements^2 degree^4"


@FAMILY.case("P, 1024 elements of degree 2", FLOOR, Number(0.0, abs=1e-10), 1024, 2)
@FAMILY.case("P, 4096 elements of degree 1", FLOOR, Number(0.0, abs=1e-6), 4096, 1)
@FAMILY.case("P, 256 elements of degree 5", FLOOR, Number(0.0, abs=1e-11), 256, 5)
@FAMILY.case("P, 256 elements of degree 8", FLOOR, Number(0.0, abs=1e-11), 256, 8)
@FAMILY.case("P, 16 elements of degree 8", FLOOR, Number(0.0, abs=1e-11), 16, 8)
def pressure_floor(elements: int, degree: int) -> float:
    """Relative error of P against the reference tables, which are good to 1e-12."""
    return on(elements, degree).pressure / POINT.expected["pressure"] - 1


@FAMILY.case("eigenvalues, 512 elements of degree 2", FLOOR, Number((0.0, 0.0), abs=1e-8), 512, 2)
@FAMILY.case("eigenvalues, 64 elements of degree 8", FLOOR, Number((0.0, 0.0), abs=1e-8), 64, 8)
def eigenvalue_floor(elements: int, degree: int) -> tuple[float, ...]:
    eq = on(elements, degree)
    return tuple(eq.verdict(c).smallest_eigenvalue / POINT.expected[f"lambda_{c}"] - 1 for c in ("pressure", "volume"))


STEADY = "iterations that grow with the mesh"


@FAMILY.case("iterations, 2 to 4096 elements", STEADY, Number(0.0, abs=3), tuple((2**k, 2) for k in range(1, 13)))
@FAMILY.case("iterations, degrees 1 to 8", STEADY, Number(0.0, abs=2), tuple((16, p) for p in range(1, 9)))
def iterations(meshes: tuple[tuple[int, int], ...]) -> float:
    """Largest less smallest count of Newton iterations over a run of ten volumes, per load."""
    counts = []
    for elements, degree in meshes:
        run = reached(fm.inflate(disc_scene(OGDEN, None, elements, degree), volumes=np.linspace(0.5, 5.0, 10), solver="newton"))
        counts.append(sum(eq.iterations for eq in run) / len(run))
    return max(counts) - min(counts)


@FAMILY.case("steps of a trace, 8 to 512 elements", "arc length that feels the mesh", Number(0.0, abs=2))
def steps_of_a_trace() -> float:
    counts = [len(reached(fm.trace(disc_scene(OGDEN, elements=n), start=0.5, until={"volume": 5.0}))) for n in (8, 64, 512)]
    return float(max(counts) - min(counts))


@FAMILY.case("IPOPT at V = 1e-9", "unscaled it would stop at its tolerance at once", Number(0.0, abs=1e-9), 1e-9)
@FAMILY.case("IPOPT at V = 1e5", "forces of 1e6", Number(0.0, abs=1e-9), 1e5)
def scaled_minimiser(volume: float) -> float:
    """P by the minimiser over P by the corrector, less one."""
    by = [settled(fm.equilibrium(disc_scene(OGDEN, elements=32), volume=volume, solver=s)).pressure for s in ("ipopt", "newton")]
    return by[0] / by[1] - 1
