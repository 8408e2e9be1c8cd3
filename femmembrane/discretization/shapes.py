"""Reference meridians beyond the disc: annulus, spherical cap, sphere, tube, torus.

The parameter s is the arc length of the reference meridian over R0, from its first end to its last; of an annulus it is the radius. These
meridians run so that the pressure pushes to their left: outwards where the shape closes a space, up where it is flat. A cap that hangs
below its rim is the exception: it also runs from its apex (:func:`.meridian.side`)::

    annulus  z |        hub              cap  z |  .--.          sphere   .-s=0.       cylinder   |    s = 0      torus       s = 0
               |======o--------o rim            |      '.        z |    .'      '.      z |       |                 z |      .--.
               +------a--------1--> r           +---------o--> r   +---|----------|     --+-------|--> r            --+-----(----)--> r
                    s = a    s = 1            s = 0    rim         |    '.      .'        |       |                   |      '--'
                                                                          '-s=pi'              s = length                aspect

======== =================================================================== ========================================================
shape    R0 is                                                               reference curve
======== =================================================================== ========================================================
annulus  the outer radius                                                    R = s, Z = 0
cap      the radius of the rim                                               an arc of a circle from the apex, at ``height``, to Z = 0
sphere   its radius                                                          R = sin s, Z = cos s
cylinder its radius                                                          R = 1, Z = length/2 - s
torus    the radius of the tube                                              R = aspect + sin s, Z = cos s
======== =================================================================== ========================================================
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .divided import Divided, Graded, convert
from .meridian import Array
from .supports import POLE, Held, Support, support_of


@dataclass(frozen=True, kw_only=True)
class Annulus(Graded):
    """Flat ring between two radii: R = s, Z = 0, inner_radius <= s <= 1.

    Parameters
    ----------
    inner_radius : float
        Over R0, the outer radius; between 0 and 1.
    elements, ratio : int, float
        Number of elements, and the size of the outermost over the size of the innermost.
    ends : sequence of float, optional
        Ends of the elements along the meridian, over R0; in place of ``elements`` and ``ratio``.
    accuracy : float, optional
        Relative accuracy, 1e-12 to 0.1, for which a verb is to choose elements and degree; in place of all that says how long they are.
        A number is asked of P and of the energy, a mapping of what it names (:class:`~.meridian.Accuracy`).
    estimated : float, optional
        The relative error that was estimated when the mesh was chosen. Such a mesh has ``accuracy`` and ``ends`` as well.
    inner, outer : str or mapping
        How the edges are held and, if not where they rest, where (``{"kind": "clamped", "radius": 1.2}``), see :mod:`.supports`; a
        ``hub`` is a rigid disc of the inner radius.

    Raises
    ------
    InputError
    """

    inner_radius: float
    inner: Held = "hub"
    outer: Held = "clamped"

    def _numbers(self) -> None:
        convert(self, "inner_radius", above=0, below=1)

    @property
    def shape(self) -> str:
        return "annulus"

    @property
    def start(self) -> float:
        return self.inner_radius

    @property
    def stop(self) -> float:
        return 1.0

    def position(self, s: Array) -> tuple[Array, Array]:
        return s, np.zeros_like(s)

    def tangent(self, s: Array) -> tuple[Array, Array]:
        return np.ones_like(s), np.zeros_like(s)

    def supports(self) -> tuple[Support, Support]:
        return support_of(self.inner), support_of(self.outer)


@dataclass(frozen=True, kw_only=True)
class Cap(Graded):
    """Spherical cap over a rim of unit radius in the plane Z = 0, from its apex on the axis.

    With H = ``height`` the sphere has the radius a = (1 + H^2)/(2 |H|), and R = a sin(s/a).

    Parameters
    ----------
    height : float
        Height of the apex over the plane of the rim, in R0. A negative height makes a bowl, whose inside is above; 0 makes a flat disc.
    elements, ratio : int, float
        Number of elements, and the size of the element at the rim over the size of the element at the apex.
    ends, accuracy, estimated
        As for :class:`Annulus`.
    rim : str or mapping
        How the rim is held and, if not where it rests, where (``{"kind": "clamped", "radius": 1.2}``), see :mod:`.supports`.

    Raises
    ------
    InputError
    """

    height: float
    rim: Held = "clamped"

    def _numbers(self) -> None:
        convert(self, "height", above=-1e3, below=1e3)
        if abs(self.height) < 1e-150:  # its radius of curvature has no number
            object.__setattr__(self, "height", 0.0)

    @property
    def shape(self) -> str:
        return "cap"

    @property
    def _radius(self) -> float:
        return (1 + self.height**2) / (2 * abs(self.height)) if self.height else math.inf

    @property
    def stop(self) -> float:
        return 2 * math.atan(abs(self.height)) * self._radius if self.height else 1.0

    def position(self, s: Array) -> tuple[Array, Array]:
        if not self.height:
            return s, np.zeros_like(s)
        a = self._radius
        # cos(s/a) - cos(stop/a) as a product: the height of a shallow cap is far below round-off of its radius of curvature
        Z = 2 * a * np.sin((self.stop + s) / (2 * a)) * np.sin((self.stop - s) / (2 * a))
        return a * np.sin(s / a), math.copysign(1.0, self.height) * Z

    def tangent(self, s: Array) -> tuple[Array, Array]:
        if not self.height:
            return np.ones_like(s), np.zeros_like(s)
        return np.cos(s / self._radius), -math.copysign(1.0, self.height) * np.sin(s / self._radius)

    def supports(self) -> tuple[Support, Support]:
        return POLE, support_of(self.rim)


@dataclass(frozen=True, kw_only=True)
class Sphere(Graded):
    """Sphere of unit radius, from the upper pole to the lower: R = sin s, Z = cos s, 0 <= s <= pi.

    Parameters
    ----------
    elements, ratio : int, float
        Number of elements, and the size of the element at the lower pole over the size of the element at the upper pole.
    ends, accuracy, estimated
        As for :class:`Annulus`.

    Raises
    ------
    InputError
    """

    @property
    def shape(self) -> str:
        return "sphere"

    @property
    def stop(self) -> float:
        return math.pi

    def position(self, s: Array) -> tuple[Array, Array]:
        return np.sin(np.minimum(s, math.pi - s)), np.cos(s)  # exactly 0 at both poles

    def tangent(self, s: Array) -> tuple[Array, Array]:
        return np.cos(s), -np.sin(np.minimum(s, math.pi - s))

    def supports(self) -> tuple[Support, Support]:
        return POLE, POLE


@dataclass(frozen=True, kw_only=True)
class Tube(Graded):
    """Tube of unit radius about the axis, from the top down: R = 1, Z = length/2 - s, 0 <= s <= length.

    Parameters
    ----------
    length : float
        Over R0, the radius.
    elements, ratio : int, float
        Number of elements, and the size of the lowest over the size of the topmost.
    ends, accuracy, estimated
        As for :class:`Annulus`.
    top, bottom : str or mapping
        How the ends are held and, if not where they rest, where, see :mod:`.supports`; a ``hub`` is a rigid lid that moves along the axis.

    Raises
    ------
    InputError
    """

    length: float
    top: Held = "clamped"
    bottom: Held = "clamped"

    def _numbers(self) -> None:
        convert(self, "length", above=1e-9, below=1e6)

    @property
    def shape(self) -> str:
        return "cylinder"

    @property
    def stop(self) -> float:
        return self.length

    def position(self, s: Array) -> tuple[Array, Array]:
        return np.ones_like(s), self.length / 2 - s

    def tangent(self, s: Array) -> tuple[Array, Array]:
        return np.zeros_like(s), -np.ones_like(s)

    def supports(self) -> tuple[Support, Support]:
        return support_of(self.top), support_of(self.bottom)


@dataclass(frozen=True, kw_only=True)
class Torus(Divided):
    """Torus with a round tube of unit radius: R = aspect + sin s, Z = cos s, 0 <= s <= 2 pi, closed, from the top of the tube outwards.

    Parameters
    ----------
    aspect : float
        Radius of the circle through the middle of the tube, over the radius R0 of the tube; > 1.
    elements : int
        Number of elements around the tube, at least 3.
    ends, accuracy, estimated
        As for :class:`Annulus`.

    Raises
    ------
    InputError
    """

    aspect: float

    _least: ClassVar[int] = 3

    def _numbers(self) -> None:
        convert(self, "aspect", above=1, below=1e9)

    @property
    def shape(self) -> str:
        return "torus"

    @property
    def stop(self) -> float:
        return 2 * math.pi

    def position(self, s: Array) -> tuple[Array, Array]:
        return self.aspect + np.sin(s), np.cos(s)

    def tangent(self, s: Array) -> tuple[Array, Array]:
        return np.cos(s), -np.sin(s)

    def supports(self) -> tuple[()]:
        return ()
