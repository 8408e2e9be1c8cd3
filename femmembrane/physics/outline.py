"""What a source looks like, for pictures of a scene: a body in the half-plane (rho, z), and the sense of its moment."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Outline:
    """The body of a source, which pictures turn about the axis.

    One point on the axis is a small ball, one point off it a ring; more points are a line along the axis or, turned about it, a surface::

        z |  x     x one point on the axis        Outline("dipole ...", ((0.0, 6.5),), moment=1)
          |     o  o one point off the axis       Outline("loop ...", ((0.5, 2.0),))
          |     |
          |     |  | two points                   Outline("coil ...", ((0.5, -1.0), (0.5, -2.0)))

    A source whose class has a method ``outline()`` is drawn as it says, and named only if it has none.

    Parameters
    ----------
    label : str
        For a legend.
    points : sequence of (rho, z)
        Over R0; a z that is infinite ends where the picture ends.
    moment : {1, -1, 0}
        Sense of an arrow along the axis through the middle of the body; 0: no arrow.
    rigid : bool
        Whether it is an obstacle, which is drawn in grey and lets through what is behind it.
    """

    label: str
    points: tuple[tuple[float, float], ...]
    moment: int = 0
    rigid: bool = False
