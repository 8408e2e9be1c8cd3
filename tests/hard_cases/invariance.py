"""What may not change an answer: units, a mirror, sources that add up to the same field, meshes, paths, threads, repetition.

The numbers returned are the largest deviations from the invariance, relative to the size of what is compared.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import femmembrane as fm

from ..cases import disc_scene
from .registry import Family, Number, settled

FAMILY = Family(6, "invariance")
ROOT = Path(__file__).parents[2]
ABOVE, BELOW = (200.0, 6.5), (600.0, -3.5)


def deviation(one: fm.Equilibrium, other: fm.Equilibrium, sign: int = 1) -> float:
    """Largest relative difference of loads, heights, energies and profiles; ``sign`` is -1 for the mirror image."""
    settled(one)
    settled(other)
    pairs = [(getattr(one, name), sign * getattr(other, name)) for name in ("pressure", "volume", "center_height")]
    pairs += [(one.elastic_energy, other.elastic_energy), (one.magnetic_energy, other.magnetic_energy)]
    here, there = one.profile(), other.profile()
    pairs += [(here["rho"], there["rho"]), (here["eta"], sign * there["eta"])]
    scale = [max(float(np.max(np.abs(a))), 1e-300) for a, _ in pairs]
    return max(float(np.max(np.abs(np.subtract(a, b)))) / s for (a, b), s in zip(pairs, scale, strict=True))


@FAMILY.case("scales of a film and of a stadium roof", "units leak into tolerances", Number(0.0), (1e-6, 1e-9, 1e3), (50.0, 1e-3, 1e9))
def units(*sizes: tuple[float, float, float]) -> float:
    """Scales change no bit of an equilibrium."""
    plain = disc_scene(dipole=ABOVE, elements=8)
    one = fm.equilibrium(plain, volume=20.0)
    others = [fm.equilibrium(plain.replace(scales=fm.Scales(*size)), volume=20.0) for size in sizes]
    return max(deviation(one, other) for other in others)


@FAMILY.case("mirror image, dipole below", "a sign is forgotten", Number(0.0, abs=1e-9), BELOW, 1.0)
@FAMILY.case("mirror image, dipole above", "a sign is forgotten", Number(0.0, abs=1e-9), ABOVE, 20.0)
def mirror(dipole: tuple[float, float], volume: float) -> float:
    strength, height = dipole
    here, there = disc_scene(dipole=dipole, elements=8), disc_scene(dipole=(strength, -height), elements=8)
    return deviation(fm.equilibrium(here, volume=volume), fm.equilibrium(there, volume=-volume), -1)


@FAMILY.case("a dipole in ten parts", "energies add where fields should", Number(0.0, abs=1e-9), 10)
def split(parts: int) -> float:
    strength, height = ABOVE
    whole = disc_scene(dipole=ABOVE, elements=8)
    pieces = whole.replace(sources=[fm.Dipole(strength / parts**2, height)] * parts)
    return deviation(fm.equilibrium(whole, volume=20.0), fm.equilibrium(pieces, volume=20.0))


@FAMILY.case("energy of six nested meshes", "quadrature may undo what a larger space gains", Number(0.0, abs=1e-12))
def nested() -> float:
    """By how much bisection ever raised the minimum of the energy at a volume, relative to the energy: not beyond the quadrature."""
    energies = [settled(fm.equilibrium(disc_scene(elements=2**k, degree=2), volume=2.0)).energy for k in range(1, 7)]
    return max(0.0, max(np.diff(energies)) / energies[-1])


@FAMILY.case("out and back past the dipole's pull", "the way back is another branch", Number(0.0, abs=1e-9))
def there_and_back() -> float:
    """Up to a volume and down again, in unlike steps."""
    loads = [*np.linspace(2.0, 60.0, 7), *np.linspace(60.0, 2.0, 11)[1:]]
    run = fm.inflate(disc_scene(dipole=ABOVE, elements=8), volumes=loads)
    return deviation(run[0], run[-1])


@FAMILY.case("a mesh file, its nodes in another order", "cells are met in the order of a mesher", Number(0.0), "order")
@FAMILY.case("a mesh file, cells the other way round", "cells point as a mesher likes", Number(0.0), "cells")
@FAMILY.case("a mesh file, the curve backwards", "inside and outside are swapped", Number(0.0), "curve")
def mesh_file(change: str) -> float:
    """A cap and a torus from a file: the same equilibrium to the last bit."""
    return max(
        from_files(mesh, volume, change, seed) for mesh, volume in ((fm.cap(0.5, 8), 1.5), (fm.torus(3.0, 8), 90.0)) for seed in (0, 1)
    )


def from_files(mesh: Any, volume: float, change: str, seed: int) -> float:
    """Deviation of the equilibrium on a mesh file from that on the file with the same curve in another order."""
    import meshio

    with tempfile.TemporaryDirectory() as folder:
        one, other = Path(folder, "one.vtu"), Path(folder, "other.vtu")
        fm.write_meridian(mesh, one)
        read = meshio.read(one)
        points, cells, rng = read.points, read.cells_dict["line3"], np.random.default_rng(seed)
        if change == "order":
            new = rng.permutation(len(points))
            points = points[np.argsort(new)]
            cells = rng.permutation(new[cells])
        elif change == "cells":
            cells[1::2] = cells[1::2][:, [1, 0, 2]]
        else:
            cells = cells[::-1, [1, 0, 2]]
        meshio.Mesh(points, [("line3", cells)]).write(other)
        scenes = [fm.Scene(material=fm.NeoHookean(), mesh=fm.read_meridian(path)) for path in (one, other)]
    return deviation(*(fm.equilibrium(scene, volume=volume, solver="newton") for scene in scenes))


PROGRAM = """
import sys
import numpy as np
import femmembrane as fm
from tests.cases import disc_scene
scene = disc_scene(dipole=(600.0, -3.5), elements=200)
scene = scene.replace(analysis=fm.Analysis(stability=("pressure",), azimuthal_modes=(1,)))
run = fm.trace(scene, start=5.0, max_steps=6)
numbers = [x for eq in run for x in (eq.pressure, eq.energy, *eq.state, eq.verdict("pressure").smallest_eigenvalue)]
numbers += [eq.verdict(azimuthal=1).smallest_eigenvalue for eq in run]
sys.stdout.write(np.array(numbers).tobytes().hex())
"""


@FAMILY.case("1, 2 and 4 threads, each twice", "sums in another order", Number(1))
def threads() -> int:
    """How many different results there are, to the last bit, in processes that may use so many threads."""

    def result(number: str) -> str:
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
        environment = {**os.environ, **dict.fromkeys(names, number), "PYTHONPATH": str(ROOT)}
        words = [sys.executable, "-c", PROGRAM]
        return subprocess.run(words, capture_output=True, text=True, check=True, env=environment).stdout

    return len({result(number) for number in ("1", "2", "4", "1", "2")})
