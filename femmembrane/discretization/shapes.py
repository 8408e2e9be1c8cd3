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
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Self

import numpy as np

from ..checks import between, store
from ..errors import InputError
from .meridian import (
    ELEMENTS,
    Array,
    Asked,
    check_accuracy,
    check_elements,
    check_ratio,
    checked_ends,
    geometric_ends,
    graded_alike,
    halved,
    is_open,
    like,
    refuse_open,
)
from .supports import POLE, Held, Support, checked_end, support_of


@dataclass(frozen=True, kw_only=True)
class _Divided:
    """A smooth curve from s = ``start`` to ``stop``, divided into elements: equal ones, those that end at ``ends``, or none yet where an
    accuracy is asked for.
    """

    elements: int = None  # type: ignore[assignment]  # an int as soon as the mesh is made
    ends: tuple[float, ...] | None = None
    accuracy: Asked | None = None
    estimated: float | None = None

    def __post_init__(self) -> None:
        self._numbers()
        ratio = getattr(self, "ratio", 1.0)
        check_accuracy(self, "ends", given=self.elements is not None or ratio != 1)
        if self.open:
            return
        ends = None
        if self.ends is not None:
            ends = checked_ends("mesh.ends", self.ends, self.start, self.stop, ("the first end", "the last end"))
            if ratio != 1:
                raise InputError("mesh.ratio", ratio, "not allowed together with mesh.ends, which say all about the sizes; leave one out")
        follows = ELEMENTS if ends is None else len(ends) - 1
        elements = check_elements(follows if self.elements is None else self.elements, self._least)
        if ends is not None and elements != follows:
            raise InputError("mesh.elements", elements, f"it contradicts mesh.ends, the ends of {follows}; leave elements out")
        object.__setattr__(self, "ends", ends)
        object.__setattr__(self, "elements", elements)

    def _numbers(self) -> None:
        """Convert and check what the shape has besides."""

    #: fewest elements
    _least: ClassVar[int] = 1

    @property
    def start(self) -> float:
        return 0.0

    @property
    def stop(self) -> float:
        raise NotImplementedError

    @property
    def open(self) -> bool:
        """Whether the elements are still to be chosen."""
        return is_open(self)

    def _shares(self) -> Array:
        """Ends of the elements, unless they are given, as parts of the whole from 0 to 1."""
        return np.linspace(0.0, 1.0, self.elements + 1)

    def breakpoints(self) -> Array:
        if self.open:
            return np.array([self.start, self.stop])
        if self.ends is not None:
            return np.array(self.ends)
        ends = self.start + (self.stop - self.start) * self._shares()
        ends[-1] = self.stop
        return ends

    def on_ends(self, ends: Sequence[float] | Array, accuracy: Asked | None = None, estimated: float | None = None) -> Self:
        plain = {"ratio": 1.0} if hasattr(self, "ratio") else {}
        places = tuple(float(s) for s in ends)
        return replace(self, elements=None, ends=places, accuracy=accuracy, estimated=estimated, **plain)  # type: ignore[arg-type]

    def with_elements(self, elements: int) -> Self:
        """Another number of elements whose ends are the same function of k/elements. Between given ``ends`` the function is linear.

        Parameters
        ----------
        elements : int
        """
        if self.ends is not None:
            return self if elements == self.elements else self.on_ends(like(self.ends, elements))
        return replace(self, elements=elements, accuracy=None)

    def refined(self) -> Self:
        """The same shape with every element divided in two.

        Raises
        ------
        InputError
            For a mesh whose elements are still to be chosen.
        """
        refuse_open(self)
        return self.with_elements(2 * self.elements) if self.ends is None else self.on_ends(halved(self.breakpoints()))


@dataclass(frozen=True, kw_only=True)
class _Graded(_Divided):
    """An open curve, with elements in geometric progression unless their ends are given."""

    ratio: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "ratio", check_ratio(self.ratio, "size of the last element over size of the first"))
        for f in fields(self):
            if f.name in _ENDS:
                store(self, **{f.name: checked_end(f"mesh.{f.name}", getattr(self, f.name))})
        super().__post_init__()

    def _shares(self) -> Array:
        return geometric_ends(self.elements, self.ratio)

    def with_elements(self, elements: int) -> Self:
        """Another number of elements whose ends are the same function of k/elements. Between given ``ends`` the function is linear.

        Parameters
        ----------
        elements : int
        """
        if self.ends is not None or self.open:
            return super().with_elements(elements)
        return replace(self, elements=elements, ratio=graded_alike(self.elements, self.ratio, elements))


#: fields that name supports
_ENDS = ("inner", "outer", "rim", "top", "bottom")


@dataclass(frozen=True, kw_only=True)
class Annulus(_Graded):
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
        _convert(self, "inner_radius", above=0, below=1)

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
class Cap(_Graded):
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
        _convert(self, "height", above=-1e3, below=1e3)
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
class Sphere(_Graded):
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
class Tube(_Graded):
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
        _convert(self, "length", above=1e-9, below=1e6)

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
class Torus(_Divided):
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
        _convert(self, "aspect", above=1, below=1e9)

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


def annulus(
    inner_radius: float,
    elements: int | None = None,
    ratio: float = 1.0,
    inner: Held = "hub",
    outer: Held = "clamped",
    *,
    ends: Sequence[float] | None = None,
    accuracy: Asked | None = None,
) -> Annulus:
    """Mesh of a flat ring.

    Parameters
    ----------
    inner_radius : float
        Over R0, the outer radius; between 0 and 1.
    elements : int
    ratio : float
        Size of the outermost element over the size of the innermost.
    inner, outer : str or mapping
        How the edges are held, see :mod:`.supports`; a ``hub`` is a rigid disc of the inner radius.
    ends : sequence of float, optional
        Ends of the elements along the meridian, over R0; in place of ``elements`` and sizes.
    accuracy : float, optional
        Relative accuracy for which elements and degree are to be chosen; in place of all that says how long elements are.

    Returns
    -------
    Annulus

    Raises
    ------
    InputError
        As for :class:`Annulus`.

    Examples
    --------
    A force of 1 lifts the hub in the middle of the ring:

    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.annulus(0.3, elements=16), loads=[fm.HubForce(1.0)])
    >>> round(fm.equilibrium(scene, pressure=0.0).center_height, 4)
    0.4152
    """
    return Annulus(inner_radius=inner_radius, elements=elements, ratio=ratio, inner=inner, outer=outer, ends=ends, accuracy=accuracy)  # type: ignore[arg-type]  # checked there


def cap(
    height: float,
    elements: int | None = None,
    ratio: float = 1.0,
    rim: Held = "clamped",
    *,
    ends: Sequence[float] | None = None,
    accuracy: Asked | None = None,
) -> Cap:
    """Mesh of a spherical cap over a rim of unit radius.

    Parameters
    ----------
    height : float
        Height of the apex over the plane of the rim, in R0; a negative height makes a bowl.
    elements : int
    ratio : float
        Size of the element at the rim over the size of the element at the apex.
    rim : str or mapping
        How the rim is held, see :mod:`.supports`.
    ends : sequence of float, optional
        Ends of the elements along the meridian, over R0; in place of ``elements`` and sizes.
    accuracy : float, optional
        Relative accuracy for which elements and degree are to be chosen; in place of all that says how long elements are.

    Returns
    -------
    Cap

    Raises
    ------
    InputError
        As for :class:`Cap`.

    Examples
    --------
    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.cap(height=0.5, elements=16))
    >>> eq = fm.equilibrium(scene, volume=1.5)
    >>> print(f"P = {eq.pressure:.4f}, apex at {eq.center_height:.4f}")
    P = 1.1348, apex at 0.7625
    """
    return Cap(height=height, elements=elements, ratio=ratio, rim=rim, ends=ends, accuracy=accuracy)  # type: ignore[arg-type]  # checked there


def sphere(
    elements: int | None = None,
    ratio: float = 1.0,
    *,
    ends: Sequence[float] | None = None,
    accuracy: Asked | None = None,
) -> Sphere:
    """Mesh of a closed sphere of unit radius.

    Parameters
    ----------
    elements : int
    ratio : float
        Size of the element at the lower pole over the size of the element at the upper pole.
    ends : sequence of float, optional
        Ends of the elements along the meridian, over R0; in place of ``elements`` and sizes.
    accuracy : float, optional
        Relative accuracy for which elements and degree are to be chosen; in place of all that says how long elements are.

    Returns
    -------
    Sphere

    Raises
    ------
    InputError
        As for :class:`Sphere`.

    Examples
    --------
    A neo-Hookean balloon of radius l has the pressure 2 (1/l - 1/l^7):

    >>> from math import pi
    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.sphere(elements=8), degree=4)
    >>> print(f"{fm.equilibrium(scene, volume=4 / 3 * pi * 1.2**3).pressure:.5f}, exact {2 * (1 / 1.2 - 1 / 1.2**7):.5f}")
    1.10850, exact 1.10850
    """
    return Sphere(elements=elements, ratio=ratio, ends=ends, accuracy=accuracy)  # type: ignore[arg-type]  # checked there


def cylinder(
    length: float,
    elements: int | None = None,
    ratio: float = 1.0,
    top: Held = "clamped",
    bottom: Held = "clamped",
    *,
    ends: Sequence[float] | None = None,
    accuracy: Asked | None = None,
) -> Tube:
    """Mesh of a tube of unit radius about the axis.

    Parameters
    ----------
    length : float
        Over R0, the radius.
    elements : int
    ratio : float
        Size of the lowest element over the size of the topmost.
    top, bottom : str
        How the ends are held, see :mod:`.supports`; a ``hub`` is a rigid lid that moves along the axis.
    ends : sequence of float, optional
        Ends of the elements along the meridian, over R0; in place of ``elements`` and sizes.
    accuracy : float, optional
        Relative accuracy for which elements and degree are to be chosen; in place of all that says how long elements are.

    Returns
    -------
    Tube

    Raises
    ------
    InputError
        As for :class:`Tube`.

    Examples
    --------
    A tube with a rigid lid at its top, which the pressure lifts from the height 1:

    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.cylinder(length=2.0, elements=16, top="hub"))
    >>> eq = fm.equilibrium(scene, volume=8.0)
    >>> print(f"P = {eq.pressure:.4f}, lid at {eq.center_height:.4f}")
    P = 0.5121, lid at 1.0387
    """
    return Tube(length=length, elements=elements, ratio=ratio, top=top, bottom=bottom, ends=ends, accuracy=accuracy)  # type: ignore[arg-type]  # checked there


def torus(aspect: float, elements: int | None = None, *, ends: Sequence[float] | None = None, accuracy: Asked | None = None) -> Torus:
    """Mesh of a torus with a round tube of unit radius.

    Parameters
    ----------
    aspect : float
        Radius of the circle through the middle of the tube, over the radius R0 of the tube; > 1.
    elements : int
        Number of elements around the tube, at least 3; equal ones unless ``ends`` says otherwise.
    ends : sequence of float, optional
        Ends of the elements along the meridian, over R0; in place of ``elements`` and sizes.
    accuracy : float, optional
        Relative accuracy for which elements and degree are to be chosen; in place of all that says how long elements are.

    Returns
    -------
    Torus

    Raises
    ------
    InputError
        As for :class:`Torus`.

    Examples
    --------
    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.torus(aspect=3.0, elements=16))
    >>> print(f"{fm.equilibrium(scene, pressure=0.3).volume:.3f}")
    70.871
    """
    return Torus(aspect=aspect, elements=elements, ends=ends, accuracy=accuracy)  # type: ignore[arg-type]  # checked there


def _convert(mesh: Any, name: str, *, above: float, below: float) -> None:
    """Turn an argument into a float between two bounds, or raise InputError."""
    allowed = f"a number between {above:g} and {below:g} is allowed (in units of R0)"
    store(mesh, **{name: between(f"mesh.{name}", getattr(mesh, name), above, below, allowed, ends=False)})
