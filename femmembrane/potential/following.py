"""Ends of elements that follow borders.

Where contact begins or ends, and where the wrinkles of a tension field do, the curvature of the membrane jumps. A mesh with the border
inside an element has no more than second order. So some ends of its elements are moved to the borders of a state, and the others are
carried along.

A corrector finds the borders together with the state (:func:`~femmembrane.solve.newton.correct`). The state then belongs to a potential of
its own, :meth:`FollowingPotential.bordered`. A branch goes from state to state in the coefficients on the mesh of the scene, the *root*:
steps, arc length and predictions are measured there.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self, cast

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..kernels.interface import Array
from ..threads import cached_property
from .of_scene import potential_of
from .potential import Potential

if TYPE_CHECKING:
    from ..discretization.space import Space
    from ..scene import Scene

#: potentials on moved meshes that are kept
_KEPT = 8

Mask = NDArray[np.bool_]
#: ends of elements that stand at borders, by their numbers, and their places along the meridian
Borders = tuple[tuple[int, float], ...]


class FollowingPotential(Potential):
    """The potential of a scene whose elements end at the borders of its states.

    Parameters
    ----------
    scene : Scene
        With the borders of one state, or without any: then it is the root.
    quadrature : int, optional
        As for :class:`.Space`.
    root : FollowingPotential, optional
        That of the same scene without borders, whose expressions it shares.
    """

    follows = True

    def __init__(self, scene: Scene, quadrature: int | None = None, root: Self | None = None) -> None:
        self._root = root
        if scene.borders:
            self._root = self._like = root or cast("Self", potential_of(scene.bordered(())))
        super().__init__(scene, quadrature)
        self._moved: dict[Borders, Self] = {}

    @property
    def root(self) -> Self:
        return self._root or self

    @property
    def unsettled(self) -> bool:  # type: ignore[override]  # read only here, and there
        """Whether the borders of a state are still to be found by a corrector."""
        return True

    @property
    def borders(self) -> Borders:  # type: ignore[override]  # read only here, and there
        """Ends of elements that stand at borders, and their places."""
        return self.scene.borders

    def bordered(self, borders: Borders) -> Self:
        """The potential on the mesh that has ends of elements at borders. The last ones are kept."""
        root = self.root
        if not borders:
            return root
        known = root._moved.pop(borders, None)
        if known is None:
            known = root._on(borders)
        root._moved[borders] = known
        if len(root._moved) > _KEPT:
            root._moved.pop(next(iter(root._moved)), None)
        return known

    def _on(self, borders: Borders) -> Self:
        return type(self)(self.scene.bordered(borders), root=self)

    @cached_property
    def to_root(self) -> sparse.csr_matrix:
        """The map from coefficients here to those on the mesh of the scene, by interpolation."""
        return interpolation(self.space, self.root.space)

    @cached_property
    def from_root(self) -> sparse.csr_matrix:
        """The map from coefficients on the mesh of the scene to those here, by interpolation."""
        return interpolation(self.root.space, self.space)

    def carried(self, v: Array) -> Array:
        return np.asarray(self.to_root @ v) if self.borders else v

    def brought(self, v: Array) -> Array:
        if not self.borders:
            return v
        n = self.space.n_free
        return np.concatenate([self.from_root @ v[:n], v[n:]])

    def row(self, row: Array) -> Array:
        return np.asarray(row @ self.to_root) if self.borders else row


@dataclass(frozen=True)
class Mark:
    """A place of the meridian where elements end although no border is there: a zone of no width opens or closes in it.

    Attributes
    ----------
    place : float
    low, high : float
        The part of the meridian about it in which there is no other border.
    """

    place: float
    low: float
    high: float


class WrinklingPotential(FollowingPotential):
    """The potential of a tension field whose elements end at the borders of its zones, and at a mark if it has one."""

    mark: Mark | None = None
    _still = False

    @property
    def unsettled(self) -> bool:  # type: ignore[override]
        return not self._still

    @cached_property
    def still(self) -> Self:
        """The same potential, whose elements follow nothing."""
        return self._copy(_still=True)

    def marking(self, mark: Mark) -> Self:
        """The same potential with a mark."""
        return self._copy(mark=mark)

    def _copy(self, **changes: object) -> Self:
        made = copy.copy(self.root)
        made.__dict__.update(changes, _moved={})
        return made


def interpolation(space: Space, onto: Space) -> sparse.csr_matrix:
    """The map between coefficients of two spaces with the same numbering, whose coefficients are values at their nodes."""
    n, s = space.n_free, onto.node_parameters()
    element, xi = space.locate(s)
    value = space.shape_functions(xi)[0]
    n_local = space.degree + 1
    target = onto.numbers[onto.nodes]
    if onto.closed:
        s, element, value, target = s[:-1], element[:-1], value[:-1], target[:-1]
    rows, columns, entries = [], [], []
    for field in (0, 1):
        source = space.gather[field * n_local : (field + 1) * n_local, element].T
        row = np.broadcast_to(target[: len(source), field][:, None], source.shape)
        keep = (row < n) & (source < n) & (value != 0)
        rows.append(row[keep])
        columns.append(source[keep])
        entries.append(value[keep])
    shape = n, n
    return sparse.csr_matrix((np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))), shape=shape)
