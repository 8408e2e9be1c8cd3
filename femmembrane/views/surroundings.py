"""Surroundings of the membrane in a picture, before anything is drawn: bodies of sources, and where the membrane is held.

Sources are asked for their :class:`~femmembrane.physics.outline.Outline`, and the mesh for its supports. The kinds of sources and shapes
are not known here. Pictures in the plane and in space show the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..checks import whole
from ..physics.outline import Outline
from ..quantities import Units

if TYPE_CHECKING:
    from ..results.equilibrium import Equilibrium
    from ..scene import Scene

Array = NDArray[np.float64]

#: a source further from the membrane than this many times its size would leave the membrane a speck in the picture
FAR = 1.5
#: how far lines of bodies without an end are looked at, in sizes of the membrane, and in how many points each piece
_REACH, _FINE = 3.0, 241
#: how far a body without an end reaches beyond the membrane, in sizes of the membrane
_BEYOND = 0.3


@dataclass(frozen=True)
class Box:
    """The region of the half-plane that drawn membranes fill.

    Attributes
    ----------
    radius, low, high : float
        Largest radius, lowest and highest point, over R0.
    """

    radius: float
    low: float
    high: float

    @classmethod
    def of(cls, profiles: Sequence[dict[str, Array]]) -> Box:
        """The smallest one around some profiles."""
        rho, eta = (np.concatenate([profile[name] for profile in profiles]) for name in ("rho", "eta"))
        return cls(float(rho.max()), float(eta.min()), float(eta.max()))

    @property
    def size(self) -> float:
        """The larger side of the box, with both halves of the membrane."""
        return max(2 * self.radius, self.high - self.low)


@dataclass(frozen=True)
class Surroundings:
    """The sources of a scene in a picture of membranes in a box.

    Attributes
    ----------
    near : tuple of Outline
        Drawn; ends at infinity are cut off.
    absent : tuple of str
        Names of those that are not: too far away, or of a kind that does not say how it looks.
    """

    near: tuple[Outline, ...]
    absent: tuple[str, ...]


def surroundings(scene: Scene, box: Box) -> Surroundings:
    """Which sources of a scene are drawn beside membranes in a box."""
    near, absent = [], []
    for source in scene.sources:
        outline = getattr(source, "outline", None)
        if outline is None:
            absent.append(type(source).__name__.lower())
            continue
        body = _cut(outline(), box)
        if _distance(body, box) > FAR * box.size:
            absent.append(body.label)
        else:
            near.append(body)
    for obstacle in getattr(scene, "obstacles", ()):
        parts = [part for part in (_clipped(line, box) for line in obstacle.profile(_REACH * box.size)) if part is not None]
        if not parts:
            absent.append(obstacle.label())
        near += [Outline("" if k else obstacle.label(), part, rigid=True) for k, part in enumerate(parts)]
    return Surroundings(tuple(near), tuple(absent))


def named(label: str, units: Units) -> str:
    """The label of a body; a height at its end is given in the units of the picture."""
    what, at, height = label.rpartition(" at height ")
    unit = units.unit("eta")
    return f"{what}{at}{units.factor('eta') * float(height):.4g} {unit}" if at and unit else label


def clamped_ends(equilibrium: Equilibrium, nodes: int = 2) -> list[tuple[int, float, float]]:
    """The ends of the meridian off the axis that are held in every direction: place among ``nodes``, radius, height."""
    space, profile = equilibrium.potential.space, equilibrium.profile()
    return [
        (end % nodes, float(profile["rho"][end]), float(profile["eta"][end]))
        for end in space.edges
        if {"u", "w"} <= space.supports[end].held
    ]


def place_of(step: int | None, count: int) -> int:
    """Place of a step among ``count``. Negative steps count from the end; without a step it is the last.

    Raises
    ------
    InputError
        For a step that is not there.
    """
    if step is None:
        return count - 1
    allowed = f"a whole number from {-count} to {count - 1} is allowed: negative ones count from the end"
    return whole("step", step, allowed, least=-count, most=count - 1) % count


def _clipped(line: Array, box: Box) -> tuple[tuple[float, float], ...] | None:
    """The part of a profile next to a box; None where there is none."""
    margin = _BEYOND * box.size
    fine = np.concatenate([np.linspace(line[:, k], line[:, k + 1], _FINE, axis=1) for k in range(line.shape[1] - 1)], axis=1)
    rho, z = fine
    inside = (rho >= 0) & (rho <= box.radius + margin) & (z >= box.low - margin) & (z <= box.high + margin)
    kept = np.flatnonzero(inside)
    if kept.size < 2:
        return None
    found = fine[:, kept[0] : kept[-1] + 1]
    if line.shape[1] == 2:
        found = found[:, [0, -1]]
    return tuple((float(r), float(h)) for r, h in found.T)


def _cut(body: Outline, box: Box) -> Outline:
    low, high = box.low - _BEYOND * box.size, box.high + _BEYOND * box.size
    ends = {-np.inf: low, np.inf: high}
    return replace(body, points=tuple((float(rho), float(ends.get(z, z))) for rho, z in body.points))


def _distance(body: Outline, box: Box) -> float:
    """Distance from the nearest corner of the body to the box."""
    rho, z = np.array(body.points).T
    return float(np.min(np.hypot(np.maximum(rho - box.radius, 0), np.maximum(np.maximum(box.low - z, z - box.high), 0))))
