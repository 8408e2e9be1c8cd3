"""Elements on an interval from scikit-fem, their nodes in the order of the meridian, and polynomials through points."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import skfem
from numpy.typing import NDArray
from skfem.element import ElementLineP1, ElementLineP2, ElementLinePp

from .meridian import Array

#: most points at which shape functions are remembered
_FEW = 32


def line_element(degree: int) -> skfem.Element:
    """The element of a degree on [0, 1]."""
    special = {1: ElementLineP1, 2: ElementLineP2}
    return special[degree]() if degree in special else ElementLinePp(degree)


def _local_order(degree: int) -> list[int]:
    """scikit-fem numbers the two ends first; along the meridian the second end comes last."""
    return [0, *range(2, degree + 1), 1]


def meridian_order(line: skfem.MeshLine, element: skfem.Element) -> tuple[NDArray[np.int64], int]:
    """Scalar node numbers of each element, increasing along the meridian, shape (degree + 1, n_elements), and their number."""
    dofs = skfem.Dofs(line, element).element_dofs
    flat = dofs[_local_order(dofs.shape[0] - 1)].T.ravel()
    _, first = np.unique(flat, return_index=True)
    rank = np.empty(first.size, dtype=np.int64)
    rank[flat[np.sort(first)]] = np.arange(first.size)
    return rank[flat].reshape(line.nelements, -1).T, first.size


def shape_functions(degree: int, xi: Array) -> tuple[Array, Array]:
    """Values and slopes of the shape functions at points xi of the reference element, each of shape (len(xi), degree + 1)."""
    xi = np.ascontiguousarray(xi, dtype=float)
    return _shape_functions(degree, xi.tobytes()) if xi.size <= _FEW else _summed(degree, xi)


@lru_cache(maxsize=64)
def _shape_functions(degree: int, xi: bytes) -> tuple[Array, Array]:
    """The same, remembered: every space of a degree asks at the same points."""
    value, slope = _tabulated(degree, np.frombuffer(xi))
    value.flags.writeable = slope.flags.writeable = False
    return value, slope


def _tabulated(degree: int, xi: Array) -> tuple[Array, Array]:
    element = line_element(degree)  # a new one: ElementLinePp remembers its values by the number of points alone
    table = [element.lbasis(np.asarray(xi)[None, :], k) for k in _local_order(degree)]
    value = np.stack([t[0] for t in table], axis=1)
    slope = np.stack([t[1][0] for t in table], axis=1)
    return value, slope


def _summed(degree: int, xi: Array) -> tuple[Array, Array]:
    """The same at many points, as sums of Legendre polynomials."""
    legendre = np.polynomial.legendre.legvander(2 * xi - 1, degree)
    value, slope = (legendre @ series for series in _series(degree))
    for end, own in ((0.0, 0), (1.0, -1)):  # an end is where its own node is, to the bit: a pole lies on the axis
        value[xi == end] = np.eye(degree + 1)[own]
    return value, slope


@lru_cache(maxsize=64)
def _series(degree: int) -> tuple[Array, Array]:
    """Shape functions and their slopes in Legendre polynomials, a column each."""
    points = lobatto(degree)
    inverse = np.linalg.inv(np.polynomial.legendre.legvander(2 * points - 1, degree))
    value, slope = shape_functions(degree, points)
    return inverse @ value, inverse @ slope


def second_derivatives(degree: int, xi: Array) -> Array:
    """Second derivatives of the shape functions at points xi of the reference element, shape (len(xi), degree + 1)."""
    points = lobatto(degree)
    slope = shape_functions(degree, points)[1]
    series = np.linalg.solve(np.polynomial.legendre.legvander(2 * points - 1, degree), slope)  # of the slopes in Legendre polynomials
    return np.asarray(np.polynomial.legendre.legval(2 * np.asarray(xi) - 1, 2 * np.polynomial.legendre.legder(series)).T)


@lru_cache(maxsize=32)
def gauss_points(count: int) -> Array:
    """Gauss points on [0, 1]; read-only."""
    points: Array = (np.polynomial.legendre.leggauss(count)[0] + 1) / 2
    points.setflags(write=False)
    return points


def lobatto(degree: int) -> Array:
    """Chebyshev-Lobatto points on [0, 1], ends included."""
    return (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2


def lagrange(points: Array, at: Array) -> Array:
    """Lagrange polynomials through points (m, n), each column at its own place (n,), shape (m, n)."""
    result = np.ones_like(points)
    for i in range(len(points)):
        for j in range(len(points)):
            if j != i:
                result[i] *= (at - points[j]) / (points[i] - points[j])
    return result
