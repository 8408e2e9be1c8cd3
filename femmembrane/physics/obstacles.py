"""Rigid, axisymmetric, frictionless bodies that the membrane cannot enter.

The profile of a body in the half-plane (rho, z) is a chain of straight pieces and arcs. The *gap* of a point is its signed distance
from the nearest of them, positive where the membrane may be. Its gradient is the unit normal n, away from the body. Its second derivative
along the tangent is the curvature of the line of equal distance: 0 beside a straight piece, 1/d at the distance d from the centre of an
arc, positive where the body is convex. So the nearest point of the body is exactly x - gap n.
Gap functions and one-sided conditions of contact: P. Wriggers, Computational Contact Mechanics, 2nd ed. (2006), chapter 4.

A body is a class here that answers :meth:`Obstacle.pieces`, and a line in the registry of scenes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ..checks import choice, convert, is_number, number, store
from ..errors import InputError
from ..threads import cached_property
from .magnetics import Array

#: round-off of a gap over the sizes of the positions in it
ROUND_OFF = 16 * float(np.finfo(float).eps)
#: points along an arc in pictures and checks, for each radian
_PER_RADIAN = 24
#: length, over that of the body, below which a piece is none
_LEAST = 1e-12
#: half the cone of directions that round-off may leave beside an arc
_WIDE = 1e-12
#: most corners of a mould
MAX_POINTS = 2000


class Straight(NamedTuple):
    """A piece from ``start`` along the unit vector ``along``, between two arc lengths; the membrane is on the side of the unit normal."""

    start: tuple[float, float]
    along: tuple[float, float]
    normal: tuple[float, float]
    low: float
    high: float


class Arc(NamedTuple):
    """An arc of directions within an angle of the unit vector ``middle``; ``side`` is 1 for a membrane outside the circle, -1 inside."""

    center: tuple[float, float]
    radius: float
    middle: tuple[float, float]
    cosine: float
    side: int


Piece = Straight | Arc


class Touch(NamedTuple):
    """Gap, unit normal, curvature of the line of equal distance, and the size of what was subtracted: each of the shape of the points."""

    gap: Array
    n_rho: Array
    n_eta: Array
    curvature: Array
    size: Array


class Obstacle:
    """A rigid body around the axis. A body of your own derives from this class and answers :meth:`pieces`."""

    #: whether it ends everywhere, so that nothing else can be in its place
    bounded = False

    def pieces(self) -> tuple[Piece, ...]:
        """The profile, in any order."""
        raise NotImplementedError

    def label(self) -> str:
        """For legends and messages."""
        return type(self).__name__.lower()

    def facing(self, rho: Array, eta: Array) -> Self:
        """The same body with the membrane on the side where it is at rest; most bodies know their side.

        Parameters
        ----------
        rho, eta : ndarray
            Points of the membrane at rest.
        """
        return self

    @cached_property
    def table(self) -> tuple[Array, Array]:
        """The numbers of the straight pieces, shape (m, 8), and of the arcs, shape (k, 7), as :func:`rows_of` lists them."""
        return rows_of(self.pieces())

    def touch(self, rho: Any, eta: Any) -> Touch:
        """Gap and its derivatives at points.

        Parameters
        ----------
        rho, eta : ndarray
            Positions over R0.
        """
        return self._touch(*_points(rho, eta))[0]

    def drift(self, rho: Any, eta: Any, rates: tuple[Array, Array]) -> Array:
        """How gap and normal at points change while the body does.

        Parameters
        ----------
        rho, eta : ndarray
            Positions over R0, which stay.
        rates : (ndarray, ndarray)
            Rates of change of :attr:`table`.

        Returns
        -------
        ndarray, shape (3, n)
            Rates of the gap, and of the normal along rho and along z.
        """
        rho, eta = _points(rho, eta)
        (straight, arcs), m = self.table, len(self.table[0])
        nearest = self._touch(rho, eta)[1]
        found, flat = np.empty((3, rho.size)), nearest < m
        at = nearest[flat]
        (a, v), (a_rate, v_rate) = ((rows[at, 0:2], rows[at, 4:6]) for rows in (straight, rates[0]))
        x = np.stack([rho[flat], eta[flat]], axis=1) - a
        found[0, flat] = (v_rate * x).sum(axis=1) - (v * a_rate).sum(axis=1)
        found[1:, flat] = v_rate.T
        at = nearest[~flat] - m
        center_rate, radius_rate, side = rates[1][at, 0:2], rates[1][at, 2], arcs[at, 6]
        x = np.stack([rho[~flat], eta[~flat]], axis=1) - arcs[at, 0:2]
        distance = np.hypot(*x.T)
        away = np.divide(x, distance[:, None], out=np.zeros_like(x), where=distance[:, None] > 0)
        along = (away * center_rate).sum(axis=1)
        found[0, ~flat] = -side * (along + radius_rate)
        found[1:, ~flat] = (side * np.divide(1.0, distance, out=np.zeros_like(distance), where=distance > 0)) * (
            away * along[:, None] - center_rate
        ).T
        return found

    def _touch(self, rho: Array, eta: Array) -> tuple[Touch, NDArray[np.int64]]:
        """:meth:`touch`, and which piece is the nearest."""
        straight, arcs = self.table
        n, m, k = rho.size, len(straight), len(arcs)
        gap, far = np.empty((m + k, n)), np.empty((m + k, n))
        normal, curvature, size = np.empty((2, m + k, n)), np.zeros((m + k, n)), np.empty((m + k, n))
        if m:
            a, d, v, low, high = straight[:, 0:2], straight[:, 2:4], straight[:, 4:6], straight[:, 6:7], straight[:, 7:8]
            offset = (a * v).sum(axis=1, keepdims=True)
            gap[:m] = v[:, 0:1] * rho + v[:, 1:2] * eta - offset
            place = d[:, 0:1] * rho + d[:, 1:2] * eta - (a * d).sum(axis=1, keepdims=True)
            slack = _WIDE * (np.abs(place) + 1e-300)
            far[:m] = np.where((place >= low - slack) & (place <= high + slack), np.abs(gap[:m]), np.inf)
            normal[:, :m] = v.T[:, :, None]
            size[:m] = np.abs(v[:, 0:1] * rho) + np.abs(v[:, 1:2] * eta) + np.abs(offset)
        if k:
            x, y = rho - arcs[:, 0:1], eta - arcs[:, 1:2]
            radius, middle, cosine, side = arcs[:, 2:3], arcs[:, 3:5], arcs[:, 5:6], arcs[:, 6:7]
            distance = np.hypot(x, y)
            safe = np.where(distance > 0, distance, 1.0)
            gap[m:] = side * (distance - radius)
            inside = (middle[:, 0:1] * x + middle[:, 1:2] * y) >= (cosine - _WIDE) * distance
            far[m:] = np.where(inside, np.abs(gap[m:]), np.inf)
            normal[0, m:] = side * np.where(distance > 0, x / safe, middle[:, 0:1])
            normal[1, m:] = side * np.where(distance > 0, y / safe, middle[:, 1:2])
            curvature[m:] = side / safe
            size[m:] = np.abs(rho) + np.abs(eta) + np.abs(arcs[:, 0:1]) + np.abs(arcs[:, 1:2]) + radius
        best = far.argmin(axis=0), np.arange(n)
        return Touch(gap[best], normal[0][best], normal[1][best], curvature[best], size[best]), best[0]

    def gap(self, rho: Any, eta: Any) -> Array:
        """Signed distance of points from the body, negative inside it.

        Parameters
        ----------
        rho, eta : ndarray
            Positions over R0.
        """
        return self.touch(rho, eta).gap

    def profile(self, reach: float = 1.0) -> list[Array]:
        """Lines that draw the profile, each of shape (2, n); what is infinite ends at a distance.

        Parameters
        ----------
        reach : float
            That distance, over R0.
        """
        lines = []
        for piece in self.pieces():
            if isinstance(piece, Straight):
                ends = np.array([-reach if math.isinf(piece.low) else piece.low, reach if math.isinf(piece.high) else piece.high])
                lines.append(np.array([[p + d * t for t in ends] for p, d in zip(piece.start, piece.along, strict=True)]))
            elif piece.radius > 0:
                half, middle = math.acos(max(-1.0, piece.cosine)), math.atan2(piece.middle[1], piece.middle[0])
                angle = middle + half * np.linspace(-1, 1, max(3, int(2 * half * _PER_RADIAN) + 1))
                lines.append(np.array([piece.center[0] + piece.radius * np.cos(angle), piece.center[1] + piece.radius * np.sin(angle)]))
        return [line for line in lines if np.isfinite(line).all()]


def rows_of(pieces: Iterable[Piece]) -> tuple[Array, Array]:
    """The numbers of straight pieces (start, along, normal, low, high) and of arcs (center, radius, middle, cosine, side), one a row.

    Parameters
    ----------
    pieces : iterable of Straight or Arc
    """
    known = list(pieces)
    straight = [[*p.start, *p.along, *p.normal, p.low, p.high] for p in known if isinstance(p, Straight)]
    arcs = [[*p.center, p.radius, *p.middle, p.cosine, p.side] for p in known if isinstance(p, Arc)]
    return np.array(straight, dtype=float).reshape(-1, 8), np.array(arcs, dtype=float).reshape(-1, 7)


def _points(rho: Any, eta: Any) -> tuple[Array, Array]:
    return np.atleast_1d(np.asarray(rho, dtype=float)), np.atleast_1d(np.asarray(eta, dtype=float))


@dataclass(frozen=True)
class Plane(Obstacle):
    """A rigid plate across the axis, without an end.

    Parameters
    ----------
    height : float
        Height of its face, in units of R0.
    side : {"below", "above"}
        Where the membrane is.

    Raises
    ------
    InputError
        For another side, or a height that is no finite number.

    Examples
    --------
    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), obstacles=[fm.Plane(height=0.5)])
    >>> contact = fm.equilibrium(scene, volume=1.1).contact
    >>> print(f"{contact.radius:.3f} {contact.force:.3f}")
    0.352 0.566
    """

    height: float
    side: str = "below"

    def __post_init__(self) -> None:
        convert(self, "obstacle.height", "a finite number is allowed")
        choice("obstacle.side", self.side, ("below", "above"))

    def pieces(self) -> tuple[Piece, ...]:
        normal = (0.0, -1.0 if self.side == "below" else 1.0)
        return (Straight((0.0, self.height), (1.0, 0.0), normal, -math.inf, math.inf),)

    def label(self) -> str:
        return f"plane at height {self.height:g}"


@dataclass(frozen=True)
class Ball(Obstacle):
    """A rigid ball on the axis.

    Parameters
    ----------
    height : float
        Height of its centre, in units of R0.
    radius : float
        > 0, in units of R0.

    Raises
    ------
    InputError
        For numbers that are not of this kind.
    """

    bounded = True

    height: float
    radius: float

    def __post_init__(self) -> None:
        convert(self, "obstacle.height", "a finite number is allowed")
        convert(self, "obstacle.radius", "a finite number > 0 is allowed: a body has a thickness", above=0)

    def pieces(self) -> tuple[Piece, ...]:
        return (Arc((0.0, self.height), self.radius, (1.0, 0.0), -2.0, 1),)

    def label(self) -> str:
        return f"ball at height {self.height:g}"


@dataclass(frozen=True)
class Cylinder(Obstacle):
    """A rigid cylinder around the axis with rounded edges; ``cylinder`` in scene files.

    Parameters
    ----------
    height : float
        Height of its middle, in units of R0.
    radius, length : float
        > 0, in units of R0.
    rounding : float, optional
        Radius of its edges, > 0 and at most the radius and half the length. Left out: a tenth of the smaller of the two.

    Raises
    ------
    InputError
        For numbers that are not of this kind.
    """

    bounded = True

    height: float
    radius: float
    length: float
    rounding: float = None  # type: ignore[assignment]  # a float as soon as it is made

    def __post_init__(self) -> None:
        convert(self, "obstacle.height", "a finite number is allowed")
        for name in ("radius", "length"):
            convert(self, f"obstacle.{name}", "a finite number > 0 is allowed: a body has a thickness", above=0)
        most = min(self.radius, self.length / 2)
        given = 0.1 * most if self.rounding is None else self.rounding
        allowed = f"a number > 0 and at most {most:g}, the smaller of the radius and half the length, is allowed"
        rounding = number("obstacle.rounding", given, allowed, above=0)
        if rounding > most:
            raise InputError("obstacle.rounding", given, allowed)
        store(self, rounding=rounding)

    def pieces(self) -> tuple[Piece, ...]:
        R, h, L, r = self.radius, self.height, self.length / 2, self.rounding
        half = math.sqrt(0.5)
        flat, wall = R - r, L - r
        found: list[Piece] = []
        for up in (1.0, -1.0):
            if flat > 0:
                found.append(Straight((0.0, h + up * L), (1.0, 0.0), (0.0, up), -flat, flat))
            found.append(Arc((flat, h + up * wall), r, (half, up * half), half, 1))
        if wall > 0:
            found.append(Straight((R, h), (0.0, 1.0), (1.0, 0.0), -wall, wall))
        return tuple(found)

    def label(self) -> str:
        return f"cylinder at height {self.height:g}"


@dataclass(frozen=True)
class Mould(Obstacle):
    """A rigid surface around the axis, given by the polyline of its meridian: a mould, a bottle, a cone.

    Beyond an end that is off the axis it goes on straight.

    Parameters
    ----------
    points : sequence of (rho, z)
        Two or more corners with rho >= 0, in units of R0, in order.
    rounding : float
        Radius to which corners are rounded, >= 0; less where the pieces beside a corner are too short for it. A corner that points at the
        membrane may be sharp.
    side : {"left", "right"}, optional
        Where the membrane is for one who walks along the points with rho to the right and z upwards. Left out: where it is at rest.

    Raises
    ------
    InputError
        For points of another kind, fewer than two, or two in the same place.
    """

    points: tuple[tuple[float, float], ...]
    rounding: float = 0.0
    side: str | None = None

    def __post_init__(self) -> None:
        allowed = f"two to {MAX_POINTS} points (rho, z) with rho >= 0 are allowed, none at the place of the one before"
        try:
            points = tuple((float(rho) + 0.0, float(z) + 0.0) for rho, z in self.points)
        except (TypeError, ValueError):
            raise InputError("obstacle.points", self.points, allowed) from None
        if not 2 <= len(points) <= MAX_POINTS or not all(is_number(v) for p in points for v in p) or min(p[0] for p in points) < 0:
            raise InputError("obstacle.points", self.points, allowed)
        size = max(math.dist(points[0], p) for p in points)
        if min(math.dist(p, q) for p, q in pairwise(points)) <= _LEAST * size:
            raise InputError("obstacle.points", self.points, allowed)
        store(self, points=points, rounding=number("obstacle.rounding", self.rounding, "a number >= 0 is allowed", least=0))
        if self.side is not None:
            choice("obstacle.side", self.side, ("left", "right"))

    @classmethod
    def from_file(cls, path: str | PathLike[str], rounding: float = 0.0, side: str | None = None) -> Self:
        """A mould from a text file with two numbers a line, rho and z, apart by spaces, a comma or a semicolon.

        Parameters
        ----------
        path : path
        rounding, side
            As for :class:`Mould`.

        Raises
        ------
        InputError
            When the file cannot be read, or does not hold such lines.
        """
        try:
            lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
        except (OSError, ValueError) as error:
            raise InputError("obstacle.file", str(path), f"cannot be read ({error}); a text file is allowed") from None
        points = []
        for k, line in enumerate(lines):
            words = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
            if not words:
                continue
            try:
                rho, z = (float(word) for word in words)
            except ValueError:
                allowed = f"two numbers a line are allowed, rho and z; line {k + 1}: {line[:60]}"
                raise InputError("obstacle.file", str(path), allowed) from None
            points.append((rho, z))
        return cls(tuple(points), rounding, side)

    def facing(self, rho: Array, eta: Array) -> Self:
        if self.side is not None:
            return self
        left = replace(self, side="left")
        gap = left.gap(rho, eta)
        return left if gap[np.abs(gap).argmax()] > 0 else replace(self, side="right")

    def pieces(self) -> tuple[Piece, ...]:
        turn = -1.0 if self.side == "right" else 1.0
        p = [np.array(point) for point in self.points]
        along = [(b - a) / np.linalg.norm(b - a) for a, b in pairwise(p)]
        lengths = [float(np.linalg.norm(b - a)) for a, b in pairwise(p)]
        cut = [0.0] * len(p)  # how much of both pieces a rounded corner takes
        arcs: list[Piece] = []
        for k in range(1, len(p) - 1):
            d, e = along[k - 1], along[k]
            cross, dot = float(d[0] * e[1] - d[1] * e[0]), float(d @ e)
            if abs(cross) < 1e-14 and dot > 0:
                continue
            tangent = math.tan(math.atan2(abs(cross), dot) / 2)
            room = lengths[k - 1] / (1 if k == 1 else 2), lengths[k] / (1 if k == len(p) - 2 else 2)  # two corners share a piece
            cut[k] = min(self.rounding * tangent, *room)
            radius = cut[k] / tangent if tangent > 0 else 0.0
            toward = 1.0 if cross > 0 else -1.0  # the centre is to the left of the walk where it turns left
            center = p[k] - cut[k] * d + radius * toward * np.array([-d[1], d[0]])
            middle = e - d
            middle = -middle / np.linalg.norm(middle)  # from the centre to the corner
            side = -1 if toward * turn > 0 else 1  # a membrane on the side of the centre is inside the circle
            half = math.cos(math.atan2(abs(cross), dot) / 2)
            if radius == 0:
                center = p[k]
            arcs.append(Arc(tuple(center.tolist()), radius, tuple(middle.tolist()), half, side))
        found: list[Piece] = []
        for k, (d, length) in enumerate(zip(along, lengths, strict=True)):
            low, high = cut[k], length - cut[k + 1]
            if k == 0 and p[0][0] > 0:
                low = -math.inf
            if k == len(along) - 1 and p[-1][0] > 0:
                high = math.inf
            normal = (-turn * d[1], turn * d[0])
            found.append(Straight(tuple(p[k].tolist()), tuple(d.tolist()), (float(normal[0]), float(normal[1])), low, high))
        return (*found, *arcs)

    def label(self) -> str:
        return f"mould of {len(self.points)} points"
