"""Write the meridians of this folder: closed forms, sampled at the nodes of parabolic or straight cells."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import femmembrane as fm


def bellows(cells: int = 48, length: float = 6.0, waves: int = 4, depth: float = 0.08) -> fm.Curve:
    """A corrugated tube, R = 1 - depth sin^2(pi waves z/length), from its top at length/2 down, in parabolic cells."""
    z = length / 2 - length * np.arange(2 * cells + 1) / (2 * cells)
    R = 1 - depth * np.sin(np.pi * waves * z / length) ** 2
    return fm.Curve(points=np.stack([R, z], axis=1), curved=True)


def egg(cells: int = 32, length: float = 1.4, taper: float = 0.2) -> fm.Curve:
    """A closed egg, (R, Z) = ((1 - taper cos t) sin t, length cos t) for t from 0 to pi, pointed end up, in parabolic cells."""
    t = np.pi * np.arange(2 * cells + 1) / (2 * cells)
    points = np.stack([(1 - taper * np.cos(t)) * np.sin(t), length * np.cos(t)], axis=1)
    points[[0, -1], 0] = 0.0  # sin(pi) is not quite 0, and the poles are on the axis
    return fm.Curve(points=points, curved=True)


def cone(cells: int = 16, inner: float = 0.3, height: float = 0.4) -> fm.Curve:
    """A truncated cone from a hub of radius ``inner``, at ``height``, to the rim, in straight cells."""
    R = np.linspace(inner, 1.0, cells + 1)
    return fm.Curve(points=np.stack([R, height * (1 - R) / (1 - inner)], axis=1), first="hub")


#: names of the files and what they hold
MERIDIANS = {"torus.vtu": fm.torus(3.0, 48), "bellows.msh": bellows(), "egg.vtk": egg(), "cone.vtu": cone()}


def main(folder: Path) -> None:
    for name, meridian in MERIDIANS.items():
        fm.write_meridian(meridian, folder / name)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    main(parser.parse_args().out)
