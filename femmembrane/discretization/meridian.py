"""Reference meridians: the curve s -> (R, Z) that is revolved, and how its ends are held.

A meridian is divided into elements at :meth:`Meridian.breakpoints`. Everything else (kinematics, energies, mass) is written for a general
curve, so a new shape is a new class here and nothing more.

Inside
------
The pressure pushes from inside. Which side is inside follows from the reference shape by one rule (:func:`side`). The direction in which
the meridian runs plays no part, and neither does the end that is up:

* A shape may enclose a volume, by itself or with flat lids across its ends. Its inside is there: V > 0 at rest, and P > 0 inflates it.
* A flat shape, and a shape that encloses nothing, have their inside below: P > 0 lifts them, and V counts what is below the membrane.

So a dome is filled from below and a bowl from above. A liquid with gamma > 0 (:class:`~femmembrane.Hydrostatic`) is heavy in both.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise
from typing import Any, Protocol, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..checks import FINITE, between, is_number, whole
from ..errors import InputError, unknown_name
from .supports import CLAMPED, POLE, Held, Support, checked_end, support_of

Array = NDArray[np.float64]

#: number of elements unless something else is said
ELEMENTS = 64
#: relative accuracies that a mesh may be chosen for: round-off ends what is below
LEAST_ACCURACY, MOST_ACCURACY = 0.1, 1e-12
#: a hundred times more than a large machine has room for
MAX_ELEMENTS = 10**8
#: a length or a volume below this part of the size of the meridian may be round-off of single precision
ROUND_OFF = 1e-6
#: a length below this part of the size of the meridian is round-off of double precision
LEAST_LENGTH = 1e-12
#: ratios of sizes reach from one over this to this: beyond, the smallest elements drown in round-off
MAX_RATIO = 1e6


@dataclass(frozen=True)
class Accuracy(Mapping[str, float]):
    """Relative accuracies by what they are asked of: ``accuracy = {pressure = 1e-8, eigenvalues = 1e-4, profile = 1e-6}``.

    Parameters
    ----------
    pressure : float, optional
        Of P and of the total energy at the same volume.
    eigenvalues : float, optional
        Of the smallest axisymmetric eigenvalues under pressure and volume control, over their size; where they pass through zero over a
        hundredth of the largest size along the run.
    profile : float, optional
        Of the displacement, root mean square over the membrane, over its own root mean square.
    """

    pressure: float | None = None
    eigenvalues: float | None = None
    profile: float | None = None

    def __getitem__(self, key: str) -> float:
        value = getattr(self, key) if key in ACCURATE else None
        if value is None:
            raise KeyError(key)
        return float(value)

    def __iter__(self) -> Iterator[str]:
        return (key for key in ACCURATE if getattr(self, key) is not None)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    @property
    def tightest(self) -> float:
        """The smallest of them."""
        return min(self.values())

    def __str__(self) -> str:
        return "{" + ", ".join(f"{key} = {value:g}" for key, value in self.items()) + "}"


#: an accuracy as a user names it: of P and the energy, or by what it is asked of
Asked: TypeAlias = float | Mapping[str, float]
#: what an accuracy may be asked of
ACCURATE = ("pressure", "eigenvalues", "profile")


def by_quantity(accuracy: Asked) -> Accuracy:
    """Accuracies by what they are asked of; a number is asked of P and the energy."""
    return accuracy if isinstance(accuracy, Accuracy) else Accuracy(**accuracy) if isinstance(accuracy, Mapping) else Accuracy(accuracy)


def in_words(accuracy: Asked) -> str:
    """An accuracy for messages."""
    return str(by_quantity(accuracy)) if isinstance(accuracy, Mapping) else f"{accuracy:g}"


class Meridian(Hashable, Protocol):
    """What the discretisation asks of a reference shape."""

    @property
    def elements(self) -> int:
        """Number of elements."""

    @property
    def shape(self) -> str:
        """Name in scene files."""

    def breakpoints(self) -> Array:
        """Element ends along s, increasing, shape (elements + 1,)."""

    def position(self, s: Array) -> tuple[Array, Array]:
        """(R, Z) at s, in units of R0.

        Parameters
        ----------
        s : ndarray
            Parameters of the meridian, between the first and the last of :meth:`breakpoints`.
        """

    def tangent(self, s: Array) -> tuple[Array, Array]:
        """(dR/ds, dZ/ds) at s.

        Parameters
        ----------
        s : ndarray
            Parameters of the meridian, between the first and the last of :meth:`breakpoints`.
        """

    def refined(self) -> Self:
        """The same shape with every element divided in two."""

    def with_elements(self, elements: int) -> Self:
        """The same shape, graded alike, with another number of elements.

        Parameters
        ----------
        elements : int
        """

    def on_ends(self, ends: Sequence[float] | Array, accuracy: Asked | None = None, estimated: float | None = None) -> Self:
        """The same shape on elements that end at given places.

        Parameters
        ----------
        ends : sequence of float
            Parameters s, from the first end of the meridian to its last.
        accuracy, estimated : float, optional
            The relative accuracy that these elements were chosen for, and the error that was estimated.
        """

    def supports(self) -> tuple[Support | frozenset[str], Support | frozenset[str]] | tuple[()]:
        """How the first and the last point are held; nothing for a closed curve.

        A plain subset of {"u", "w"} in place of a :class:`Support` names the displacements that are 0.
        """


@dataclass(frozen=True)
class Disc:
    """Flat disc of unit radius, pole on the axis and clamped rim: R = s, Z = 0, 0 <= s <= 1.

    ::

        z |
          |  pole: u = 0, w free          rim: u = w = 0
          o===================================o---> r
          s = 0                             s = 1

    Parameters
    ----------
    elements : int
        Number of elements along the radius; 64, or as many as ``radii`` says.
    ratio : float
        Size of the element at the rim over the size of the element at the pole, 1e-6 to 1e6. Sizes follow a geometric progression.
    radii : sequence of float, optional
        Ends of the elements, over R0, strictly increasing from 0 to 1. They give any other grading, in place of ``elements`` and ``ratio``.
    accuracy : float, optional
        Relative accuracy, 1e-12 to 0.1, for which a verb is to choose elements and degree; in place of all of the above. A number is asked
        of P and of the energy, a mapping of what it names (:class:`Accuracy`). Until they are chosen the mesh is open: it has no elements,
        and nothing can be computed on it.
    rim : str or mapping
        How the rim is held, "clamped", and where if not at radius 1 and height 0: ``{"kind": "clamped", "radius": 1.2, "height": 0.3}``.
    estimated : float, optional
        The relative error that was estimated when the mesh was chosen. Such a mesh has ``accuracy`` and ``radii`` as well.

    Raises
    ------
    InputError
        For a value outside these sets, and for values that contradict each other.
    """

    elements: int = None  # type: ignore[assignment]  # an int as soon as the mesh is made
    ratio: float = 1.0
    radii: tuple[float, ...] | None = None
    accuracy: Asked | None = None
    estimated: float | None = None
    rim: Held = field(default=CLAMPED, metadata={"quiet": True})

    def __post_init__(self) -> None:
        object.__setattr__(self, "rim", checked_end("mesh.rim", self.rim))
        if (self.rim if isinstance(self.rim, str) else self.rim["kind"]) != CLAMPED:
            raise InputError("mesh.rim", self.rim, "the rim of a disc is clamped; a cap of height 0 is flat too and takes every support")
        check_accuracy(self, "radii", given=self.elements is not None or self.ratio != 1)
        if self.open:
            return
        ratio = check_ratio(self.ratio, "size at the rim over size at the pole")
        radii = None if self.radii is None else checked_ends("mesh.radii", self.radii, 0.0, 1.0, ("the pole", "the rim"))
        follows = ELEMENTS if radii is None else len(radii) - 1
        elements = check_elements(follows if self.elements is None else self.elements)
        if radii is not None and elements != follows:
            raise InputError("mesh.elements", elements, f"it contradicts mesh.radii, the ends of {follows}; leave elements out")
        if radii is not None and ratio != 1:
            raise InputError("mesh.ratio", ratio, "not allowed together with mesh.radii, which say all about the sizes; leave one out")
        for name, value in (("elements", elements), ("ratio", ratio), ("radii", radii)):
            object.__setattr__(self, name, value)

    @property
    def shape(self) -> str:
        return "disc"

    @property
    def open(self) -> bool:
        """Whether the elements are still to be chosen."""
        return is_open(self)

    def breakpoints(self) -> Array:
        if self.open:
            return np.array([0.0, 1.0])
        if self.radii is not None:
            return np.array(self.radii)
        return geometric_ends(self.elements, self.ratio)

    def position(self, s: Array) -> tuple[Array, Array]:
        return s, np.zeros_like(s)

    def tangent(self, s: Array) -> tuple[Array, Array]:
        return np.ones_like(s), np.zeros_like(s)

    def refined(self) -> Self:
        """The same shape with every element divided in two.

        Raises
        ------
        InputError
            For a mesh whose elements are still to be chosen.
        """
        refuse_open(self)
        if self.ratio == 1 and self.radii is None:
            return replace(self, elements=2 * self.elements)
        return self.on_ends(halved(self.breakpoints()))

    def with_elements(self, elements: int) -> Self:
        """Another number of elements whose ends are the same function of k/elements.

        So the ends of n elements are among the ends of 2 n elements. Between given ``radii`` the function is linear.

        Parameters
        ----------
        elements : int
        """
        if elements == self.elements:
            return self
        if self.radii is not None:
            return self.on_ends(like(self.radii, elements))
        return replace(self, elements=elements, ratio=graded_alike(self.elements, self.ratio, elements))

    def on_ends(self, ends: Sequence[float] | Array, accuracy: Asked | None = None, estimated: float | None = None) -> Self:
        radii = tuple(float(r) for r in ends)
        return type(self)(radii=radii, accuracy=accuracy, estimated=estimated, rim=self.rim)

    def supports(self) -> tuple[Support, Support]:
        return POLE, support_of(self.rim)


def disc(
    elements: int | None = None,
    ratio: float = 1.0,
    radii: Sequence[float] | None = None,
    accuracy: Asked | None = None,
    rim: Held = CLAMPED,
) -> Disc:
    """Mesh of the flat, clamped disc.

    Parameters
    ----------
    elements : int, optional
        Number of elements along the radius; 64, or as many as ``radii`` says.
    ratio : float
        Size of the element at the rim over the size of the element at the pole. Sizes follow a geometric progression.
    radii : sequence of float, optional
        Ends of the elements, increasing from 0 to 1; in place of ``elements`` and ``ratio``.
    accuracy : float, optional
        Relative accuracy for which elements and degree are to be chosen; in place of all of the above.
    rim : str or mapping
        How the rim is held: "clamped", and where if not at radius 1 and height 0, ``{"kind": "clamped", "radius": 1.2}``.

    Returns
    -------
    Disc

    Raises
    ------
    InputError
        As for :class:`Disc`.

    Examples
    --------
    >>> import femmembrane as fm
    >>> [round(float(r), 4) for r in fm.disc(3, ratio=4.0).breakpoints()]
    [0.0, 0.1429, 0.4286, 1.0]
    >>> fm.disc(radii=(0.0, 0.5, 0.8, 1.0)).elements
    3
    """
    return Disc(elements=elements, ratio=ratio, radii=radii, accuracy=accuracy, rim=rim)  # type: ignore[arg-type]  # checked there


def is_open(mesh: Any) -> bool:
    """Whether the elements of a mesh are still to be chosen for its accuracy."""
    return mesh.accuracy is not None and mesh.estimated is None


def refuse_open(mesh: Any) -> None:
    """Raise InputError for a mesh whose elements are still to be chosen."""
    if mesh.open:
        raise InputError("mesh.accuracy", mesh.accuracy, "its elements are still to be chosen; refine the mesh of a branch's scene")


def halved(ends: Array) -> Array:
    """Ends of elements, and the middles between them."""
    found = np.empty(2 * ends.size - 1)
    found[::2], found[1::2] = ends, ends[:-1] + np.diff(ends) / 2
    return found


def like(ends: Sequence[float], elements: int) -> Array:
    """Ends of another number of elements that are the same function of k/elements, linear between the given ones."""
    n = len(ends) - 1
    return np.interp(np.linspace(0, n, elements + 1), np.arange(n + 1), ends)


def on_own_ends(mesh: Any, ends: Array) -> Any:
    """A mesh with other ends, chosen for the accuracy that it was chosen for itself.

    Parameters
    ----------
    mesh : Meridian
    ends : ndarray
    """
    return mesh.on_ends(ends, getattr(mesh, "accuracy", None), getattr(mesh, "estimated", None))


def assigned_ends(ends: Array, places: Array, stay: Sequence[int] = ()) -> tuple[tuple[int, float], ...]:
    """Ends of elements, by number, for places between them: those that lie nearest, counted in elements.

    Parameters
    ----------
    ends, places : ndarray
        Increasing.
    stay : sequence of int
        Ends that have to stay, beside the first and the last.

    Raises
    ------
    InputError
        For more places than there are ends to move.
    """
    pairs: list[tuple[int, float]] = []
    for first, last in pairwise(sorted({0, ends.size - 1, *stay})):
        between = [float(s) for s in places if ends[first] < s < ends[last]]
        if len(between) > last - first - 1:
            allowed = f"more are needed: the membrane has {len(between) + 1} zones where this mesh has {last - first} elements"
            raise InputError("mesh.elements", ends.size - 1, allowed)
        if between:
            count = np.interp(between, ends, np.arange(ends.size))
            pairs += zip(_nearest(count, first + 1, last - 1), between, strict=True)
    return tuple(pairs)


def _nearest(count: Array, first: int, last: int) -> list[int]:
    """Whole numbers from ``first`` to ``last``, strictly increasing, next to given increasing ones by the sum of squares."""
    offers = np.arange(first, last + 1)
    rows = (count[:, None] - offers) ** 2
    best, choices = np.zeros(offers.size + 1), []
    for row in rows[::-1]:  # the least that the places from here on cost, if only offers from each one on are left
        total = row + best[1:]
        least = np.minimum.accumulate(total[::-1])[::-1]
        choices.append(total)
        best = np.append(least, np.inf)
    found, at = [], 0
    for total in choices[::-1]:
        at += int(np.argmin(total[at:]))
        found.append(int(offers[at]))
        at += 1
    return found


def check_accuracy(mesh: Any, places: str, *, given: bool) -> None:
    """Raise InputError unless the elements of a mesh are given, open, or chosen for an accuracy.

    Parameters
    ----------
    mesh : Meridian
        With the attributes accuracy and estimated, and one named ``places`` for the ends of its elements.
    places : str
    given : bool
        Whether there is anything else that says how long its elements are.
    """
    if mesh.accuracy is None:
        if mesh.estimated is not None:
            raise InputError("mesh.estimated", mesh.estimated, "it belongs to a mesh that was chosen for mesh.accuracy; leave it out")
        return
    object.__setattr__(mesh, "accuracy", _checked_accuracy(mesh.accuracy))
    if mesh.estimated is not None:
        _positive("mesh.estimated", mesh.estimated, 0.0, math.inf, "")
    chosen = "not allowed together with mesh.accuracy, for which the mesh is chosen; leave one out"
    if (mesh.estimated is None) != (getattr(mesh, places) is None):
        key = places if mesh.estimated is None else "estimated"
        raise InputError(f"mesh.{key}", getattr(mesh, key), chosen)
    if mesh.open and given:
        key = next(key for key in ("divisions", "elements", "ratio") if getattr(mesh, key, None) not in (None, 1))
        raise InputError(f"mesh.{key}", getattr(mesh, key), chosen)
    if mesh.estimated is not None:
        object.__setattr__(mesh, "estimated", float(mesh.estimated))


def _checked_accuracy(given: Any) -> float | Accuracy:
    if not isinstance(given, Mapping):
        _positive("mesh.accuracy", given, MOST_ACCURACY, LEAST_ACCURACY, " (relative error of the pressure and the energy), or a table")
        return float(given)
    for name, value in given.items():
        if name not in ACCURATE:
            raise unknown_name(f"mesh.accuracy.{name}", value, ACCURATE)
        _positive(f"mesh.accuracy.{name}", value, MOST_ACCURACY, LEAST_ACCURACY, " (relative error)")
    if not given:
        raise InputError("mesh.accuracy", {}, "a number, or a table with one or more of these is allowed: " + ", ".join(ACCURATE))
    return Accuracy(**{name: float(value) for name, value in given.items()})


def _positive(key: str, value: Any, least: float, most: float, what: str) -> None:
    between(key, value, least, most, f"a number from {least:g} to {most:g} is allowed{what}")


@lru_cache(maxsize=64)
def side(mesh: Meridian) -> int:
    """1 where the inside of a meridian is on its right as it runs, so that the pressure pushes to its left; -1 where it is on its left.

    The rule stands at the top of this module. The volume between the meridian and flat lids across its ends decides.
    """
    ends = mesh.breakpoints()
    s = ends[:-1] + (_GAUSS[0][:, None] + 1) / 2 * np.diff(ends)
    R, Z = mesh.position(s)
    _, Z_s = mesh.tangent(s)
    enclosed = -float((_GAUSS[1][:, None] / 2 * np.diff(ends) * R**2 * Z_s).sum())  # over pi
    size = extent(R, Z)
    return -1 if enclosed < -ROUND_OFF * size**3 else 1


#: points and weights that integrate the volume of a parabolic cell exactly
_GAUSS = np.polynomial.legendre.leggauss(6)


def extent(R: Array, Z: Array) -> float:
    """Size of a meridian: its largest radius, or its height if that is larger."""
    return float(max(np.max(np.abs(R)), np.ptp(Z)))


def check_elements(value: Any, least: int = 1) -> int:
    """A number of elements, or InputError."""
    return whole("mesh.elements", value, f"a whole number >= {least} (and <= {MAX_ELEMENTS}) is allowed", least=least, most=MAX_ELEMENTS)


def check_ratio(value: Any, meaning: str) -> float:
    """A ratio of sizes, or InputError."""
    allowed = f"a number from {1 / MAX_RATIO:g} to {MAX_RATIO:g} is allowed ({meaning})"
    return between("mesh.ratio", value, 1 / MAX_RATIO, MAX_RATIO, allowed)


def geometric_ends(elements: int, ratio: float) -> Array:
    """Ends of elements on [0, 1] whose sizes follow a geometric progression, the last one ``ratio`` times the first."""
    if ratio == 1 or elements == 1:
        return np.linspace(0.0, 1.0, elements + 1)
    # (q^k - 1)/(q^n - 1) with the quotient q of neighbouring sizes; expm1 keeps the digits of the first, smallest ends
    share = np.expm1(np.arange(elements + 1) * (math.log(ratio) / (elements - 1)))
    ends = share / share[-1]
    ends[0], ends[-1] = 0.0, 1.0
    return ends


def graded_alike(elements: int, ratio: float, other: int) -> float:
    """The ratio for another number of elements whose ends are the same function of k/elements."""
    if ratio == 1 or elements == 1:
        return 1.0
    growth = math.log(ratio) * elements / (elements - 1)
    return min(max(math.exp(growth * (other - 1) / other), 1 / MAX_RATIO), MAX_RATIO)


def checked_ends(key: str, values: Any, first: float, last: float, words: tuple[str, str]) -> tuple[float, ...]:
    """Ends of elements from one place to another, or InputError.

    Parameters
    ----------
    key : str
    values : object
    first, last : float
    words : (str, str)
        What is at the first and the last place.
    """
    allowed = f"a list of numbers that increase strictly from {first:.9g} ({words[0]}) to {last:.9g} ({words[1]}) is allowed"
    if isinstance(values, (str, bytes)):
        raise InputError(key, values, allowed)
    try:
        ends = tuple(values)
    except TypeError:
        raise InputError(key, values, allowed) from None
    for k, end in enumerate(ends):
        if not is_number(end):
            raise InputError(f"{key}[{k}]", end, FINITE)
    near = LEAST_LENGTH * max(abs(first), abs(last))
    if len(ends) < 2 or not abs(ends[0] - first) <= near or not abs(ends[-1] - last) <= near:
        raise InputError(key, ends, allowed)
    ends = (first, *ends[1:-1], last)  # computed ends are exact to round-off only
    for k in range(1, len(ends)):
        if not ends[k - 1] < ends[k]:
            raise InputError(f"{key}[{k}]", ends[k], f"a number above the one before ({ends[k - 1]:.9g}) is allowed")
    return tuple(float(end) for end in ends)
