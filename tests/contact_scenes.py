"""Random membranes that are inflated against rigid bodies: shapes, strain energies, bodies, and volumes at which they are touched."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

import femmembrane as fm


def contact_scene(seed: int) -> tuple[fm.Scene, float]:
    """A scene with the mesh left to be given (12 elements), and a volume at which the membrane lies on its body."""
    rng = np.random.default_rng([2026, seed])
    material = (fm.NeoHookean(), fm.MooneyRivlin(ratio=float(rng.uniform(0.1, 0.9))), fm.Gent(jm=float(rng.uniform(20, 80))))[seed % 3]
    apex = 0.0 if seed % 2 else float(rng.uniform(0.1, 0.6))
    mesh = fm.cap(apex, 12) if apex else fm.disc(12)
    gap = float(rng.uniform(0.15, 0.6))
    body = (
        fm.Plane(apex + gap),
        fm.Ball(height=apex + gap + (radius := float(rng.uniform(0.3, 1.5))), radius=radius),
        fm.Cylinder(height=apex + gap + 0.3, radius=float(rng.uniform(0.5, 1.2)), length=0.6, rounding=float(rng.uniform(0.1, 0.25))),
        fm.Mould([(1.3, -0.2), (1.3, apex + gap / 2), (0.3, apex + gap), (0.0, apex + gap)], rounding=0.25),
    )[seed % 4]
    height = apex + gap
    volume = float(rng.uniform(1.2, 2.0)) * math.pi * height * (3 + height**2) / 6
    return fm.Scene(material=material, mesh=mesh, obstacles=[body]), volume


def asking(scene: fm.Scene, accuracy: float) -> fm.Scene:
    """The scene with the mesh left to be chosen for an accuracy."""
    return scene.replace(mesh=replace(scene.mesh, elements=None, accuracy=accuracy), degree=None)
