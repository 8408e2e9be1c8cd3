"""What the obstacles of a scene must agree on with its membrane, and with each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..checks import store
from ..discretization.lift import Lift
from ..discretization.meridian import LEAST_LENGTH
from ..errors import InputError

if TYPE_CHECKING:
    from ..physics.magnetics import Array
    from ..physics.obstacles import Obstacle
    from .value import Scene

#: points along each element at which a membrane at rest is looked at
_EACH = 4
#: how far planes are looked at beyond the membrane, in its own sizes
_REACH = 100.0


def check_obstacles(scene: Scene, lift: Lift | None) -> None:
    """Turn moulds to the side of the membrane, and refuse obstacles that cannot be.

    Raises
    ------
    InputError
        For an obstacle that cuts or touches the membrane at rest, and for two that overlap.
    """
    from .toml import item_path

    ends = scene.mesh.breakpoints()
    s = np.interp(np.arange(_EACH * (len(ends) - 1) + 1) / _EACH, np.arange(len(ends)), ends)
    R, Z = (np.array(part, dtype=float) for part in scene.mesh.position(s))
    if lift is not None:
        u, _, w, _ = lift.at(scene.mesh, s)
        R, Z = R + u, Z + w
    size = float(max(np.ptp(R), np.ptp(Z), R.max()))
    inner = np.ones(s.size, dtype=bool)
    if scene.mesh.supports():  # an end that is held may be where a mould begins
        inner[[k for k in (0, -1) if R[k] > LEAST_LENGTH * size]] = False
    store(scene, obstacles=tuple(body.facing(R[inner], Z[inner]) for body in scene.obstacles))
    paths = [item_path("obstacle", k, len(scene.obstacles)) for k in range(len(scene.obstacles))]
    paths += ["source.body"] * (len(scene.bodies) - len(paths))
    for path, body in zip(paths, scene.bodies, strict=True):
        gap = body.gap(R, Z)
        if scene.squeezed:  # the ends that are held alone stay where they are
            inner, gap = np.zeros(s.size, dtype=bool), np.where(inner, np.abs(gap), gap)
        if not (gap[inner].min(initial=np.inf) > 0 and gap.min() >= -LEAST_LENGTH * size):
            raise InputError(path, body.label(), _in_the_way(body, gap, R, Z))
    for k, one in enumerate(scene.bodies):
        for j, other in enumerate(scene.bodies):
            if j != k and one.bounded and _enters(one, other, size):
                raise InputError(paths[k], one.label(), f"it overlaps the {other.label()}; obstacles apart from each other are allowed")


def _in_the_way(body: Obstacle, gap: Array, R: Array, Z: Array) -> str:
    """What is wrong with a body that the membrane at rest is not clear of."""
    if gap.max() < 0:
        return "the membrane at rest lies inside it; move it off" + (", or take its other side" if hasattr(body, "side") else "")
    where = int(gap.argmin())
    return f"it cuts the membrane at rest (at r = {R[where]:.4g}, z = {Z[where]:.4g}, over R0); move it off"


def _enters(one: Obstacle, other: Obstacle, size: float) -> bool:
    """Whether the outline of a body enters another one."""
    lines: list[Array] = one.profile(_REACH * size)
    points = np.concatenate([np.linspace(line[:, :-1], line[:, 1:], 9).transpose(1, 0, 2).reshape(2, -1) for line in lines], axis=1)
    points = points[:, points[0] >= 0]
    return bool(points.size) and float(other.gap(*points).min()) < -1e-9 * size
