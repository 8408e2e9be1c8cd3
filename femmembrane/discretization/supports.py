"""How the ends of a meridian are held.

======== ================== ===================================================================================================
word     held               what it is; what closes the enclosed volume there
======== ================== ===================================================================================================
clamped  u = w = 0          glued to a ring that does not move; a flat lid across it
axial    u = 0              a ring that slides along the axis in a tube of its radius; a lid where the ring was at first
radial   w = 0              slides on a plate across the axis, which closes the volume
mirror   w = 0              the membrane goes on as its mirror image: this is one half of it, and V one half of the volume
free     nothing            an edge; a weightless lid across it hands the pressure on it to the edge, along the axis
hub      u = 0, rigid       glued to a flat, rigid, weightless disc that moves along the axis alone and is pushed by the pressure
pole     u = 0 on the axis  no end at all
======== ================== ===================================================================================================

Perturbations with n >= 1 waves around the axis: what holds u holds both in-plane displacements, a hub moves in none of them, and those
of a mirror image are the mirror images of the membrane's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, unknown_name

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Support:
    """How one end of a meridian is held.

    Attributes
    ----------
    held : frozenset of {"u", "w"}
        Displacements that are zero.
    rigid : bool
        Whether the end is that of a rigid disc, which perturbations around the axis leave where it is.
    wall : bool
        Whether the end slides along a wall, so that what closes the volume stays where it was.
    """

    held: frozenset[str]
    rigid: bool = False
    wall: bool = False


POLE = Support(frozenset("u"))
#: by their names in scene files
SUPPORTS = {
    "clamped": Support(frozenset("uw")),
    "axial": Support(frozenset("u"), wall=True),
    "radial": Support(frozenset("w")),
    "mirror": Support(frozenset("w")),
    "free": Support(frozenset()),
    "hub": Support(frozenset("u"), rigid=True),
}


def check_support(key: str, name: str) -> None:
    """Raise InputError unless a support has this name."""
    if not isinstance(name, str):
        raise InputError(key, name, "one of these words is allowed: " + ", ".join(sorted(SUPPORTS)))
    if name not in SUPPORTS:
        raise unknown_name(key, name, SUPPORTS)


def as_support(held: Support | frozenset[str]) -> Support:
    """A support, from a support or from the displacements that it holds."""
    return held if isinstance(held, Support) else Support(held)


def floats(ends: Sequence[Support]) -> bool:
    """Whether no end is held along the axis, so that the membrane can move along it as a whole."""
    return not any("w" in end.held for end in ends)


def free_rotations(ends: Sequence[Support], radii: Array, heights: Array) -> tuple[bool, bool]:
    """Rigid motions across the axis that the supports leave: whether a pure shift is left, and whether a tilt is left.

    A shift by A and a tilt by B displace the points of a meridian by (a, c, b) = (A + B eta, -A - B eta, -B rho) cos or sin theta.
    """
    rows = []
    for end, R, Z in zip(ends, radii, heights, strict=False):
        if R > 0 and ("u" in end.held or end.rigid):
            rows.append((1.0, Z))
        if R > 0 and ("w" in end.held or end.rigid):
            rows.append((0.0, 1.0))
    if not rows:
        return True, True
    rank = int(np.linalg.matrix_rank(np.array(rows)))
    if rank == 2:
        return False, False
    tilts = any(row[0] for row in rows)  # held in its plane at one height only: it turns about a diameter there
    return not tilts, tilts
