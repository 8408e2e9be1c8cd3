"""Smooth curves divided into elements: equal ones, graded ones, or between given ends."""

from __future__ import annotations

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
from .supports import checked_end

#: fields that name supports
_ENDS = ("inner", "outer", "rim", "top", "bottom")


@dataclass(frozen=True, kw_only=True)
class Divided:
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
class Graded(Divided):
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


def convert(mesh: Any, name: str, *, above: float, below: float) -> None:
    """Turn an argument into a float between two bounds, or raise InputError."""
    allowed = f"a number between {above:g} and {below:g} is allowed (in units of R0)"
    store(mesh, **{name: between(f"mesh.{name}", getattr(mesh, name), above, below, allowed, ends=False)})
