"""How far the mode of an eigenvalue is resolved by the mesh, read off the integrand of its Rayleigh quotient.

Per element the integrand phi . K phi is known at the Gauss points. Its part along the highest polynomial that these points tell apart,
P_p for p + 1 points, is what elements of degree p cannot be trusted with: of order h^p where state and mode are smooth, beside errors of
order h^(2 p) of the eigenvalue, and as large as the integrand itself in an element in which a needle or a layer is hidden. An eigenvalue
that exceeds the sum of these parts has the sign of the continuum's (measured: errors are below a tenth of it); the price is a small part
of the eigenvalue's own.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..discretization.space import HESSIAN_PAIRS, Space
from ..potential import Array, Evaluation

#: an eigenvalue is small below this part of that of a membrane of the same area under a tension of one shear modulus, or so
_SMALL = 1e-2


def small_eigenvalue(space: Space) -> float:
    """Size below which the discretisation error of an eigenvalue is always estimated: 0.01 for a disc of unit radius."""
    return _SMALL * np.pi / space.reference_area


def unresolved(space: Space, density: Array, pairs: tuple[tuple[int, int], ...], local: Array) -> float:
    """Part of a Rayleigh quotient that the Gauss points resolve no longer.

    Parameters
    ----------
    space : Space
    density : ndarray, shape (len(pairs), n_quadrature, n_elements)
        Second derivatives with respect to pairs of local variables, times the weights.
    pairs : tuple of (int, int)
    local : ndarray, shape (n_variables, n_quadrature, n_elements)
        Local variables of the mode, normalised in the mass.
    """
    first, second, times = _indices(pairs)
    products = local[first]
    products *= local[second]
    products *= density
    return float(np.abs(space.highest @ np.tensordot(times, products, 1)).sum())


@lru_cache(maxsize=8)
def _indices(pairs: tuple[tuple[int, int], ...]) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """First and second of each pair, and how often it counts in a quadratic form."""
    first, second = np.array(pairs).T
    return first, second, np.where(first == second, 1.0, 2.0)


def unresolved_axisymmetric(space: Space, evaluation: Evaluation, mode: Array) -> float:
    """:func:`unresolved` for an axisymmetric mode."""
    shape = (space.n_quadrature, space.n_elements)
    local = space.at_quadrature(mode).reshape(4, *shape)
    return unresolved(space, evaluation.stiffness_density.reshape(-1, *shape), HESSIAN_PAIRS, local)
