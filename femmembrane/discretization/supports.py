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

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..checks import number
from ..errors import InputError, unknown_name

Array = NDArray[np.float64]
#: what says how an end is held: a name, or one with its place
Held: TypeAlias = str | Mapping[str, Any]


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
    radius, height : float or None
        Where it is held, over R0; None: where it rests.
    """

    held: frozenset[str]
    rigid: bool = False
    wall: bool = False
    radius: float | None = None
    height: float | None = None

    @property
    def placed(self) -> bool:
        """Whether it has a place of its own."""
        return self.radius is not None or self.height is not None

    def at(self, radius: float | None = None, height: float | None = None) -> Support:
        """The same support at another place."""
        return replace(self, radius=radius, height=height)


@dataclass(frozen=True)
class End(Mapping[str, Any]):
    """A support with a place of its own, as a scene file has it: ``{kind = "clamped", radius = 1.2, height = 0.3}``.

    Parameters
    ----------
    kind : str
        A name of :data:`SUPPORTS`.
    radius, height : float, optional
        Where the end is held, over R0; only in a direction in which it is held. Left out: where it rests.
    """

    kind: str
    radius: float | None = None
    height: float | None = None

    def __getitem__(self, key: str) -> Any:
        value = getattr(self, key) if key in ("kind", "radius", "height") else None
        if value is None:
            raise KeyError(key)
        return value

    def __iter__(self) -> Iterator[str]:
        return (key for key in ("kind", "radius", "height") if getattr(self, key) is not None)

    def __len__(self) -> int:
        return sum(1 for _ in self)


#: names of the ends of meridians, of every shape
ENDS = ("inner", "outer", "rim", "top", "bottom", "first", "last")
POLE = Support(frozenset("u"))
CLAMPED = "clamped"
#: by their names in scene files
SUPPORTS = {
    "clamped": Support(frozenset("uw")),
    "axial": Support(frozenset("u"), wall=True),
    "radial": Support(frozenset("w")),
    "mirror": Support(frozenset("w")),
    "free": Support(frozenset()),
    "hub": Support(frozenset("u"), rigid=True),
}


def checked_end(key: str, given: object) -> Held:
    """The name of a support, or one with its place.

    Raises
    ------
    InputError
        For another name or key, and for a place in a direction in which the support does not hold.
    """
    if isinstance(given, str):
        if given not in SUPPORTS:
            raise unknown_name(key, given, SUPPORTS)
        return given
    words = ", ".join(sorted(SUPPORTS))
    if not isinstance(given, Mapping):
        raise InputError(key, given, f'one of these words is allowed: {words}; or one with its place, {{kind = "clamped", radius = 1.2}}')
    for name in given:
        if name not in ("kind", "radius", "height"):
            raise unknown_name(f"{key}.{name}", given[name], ("kind", "radius", "height"))
    if "kind" not in given:
        raise InputError(f"{key}.kind", None, f"missing; one of these words is allowed: {words}")
    kind = given["kind"]
    if not isinstance(kind, str) or kind not in SUPPORTS:
        raise unknown_name(f"{key}.kind", kind, SUPPORTS)
    place = {}
    for name, held in (("radius", "u"), ("height", "w")):
        if given.get(name) is None:
            continue
        if held not in SUPPORTS[kind].held or SUPPORTS[kind].rigid:
            raise InputError(f"{key}.{name}", given[name], f"an end that is {kind} is not held there; leave it out, or hold it: clamped")
        bounds = {"above": 0.0} if name == "radius" else {}
        allowed = "a number > 0 is allowed (over R0)" if name == "radius" else "a finite number is allowed (over R0)"
        place[name] = number(f"{key}.{name}", given[name], allowed, **bounds)
    return End(kind, **place) if place else kind


def support_of(end: Held) -> Support:
    """The support that an end names, at its place."""
    if isinstance(end, str):
        return SUPPORTS[end]
    return SUPPORTS[end["kind"]].at(end.get("radius"), end.get("height"))


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
