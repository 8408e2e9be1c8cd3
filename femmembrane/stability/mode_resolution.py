"""How far the mode of an eigenvalue is resolved by the mesh, read off the integrand of its Rayleigh quotient.

Per element the integrand phi . K phi is known at the Gauss points. The highest polynomial that p + 1 points tell apart is P_p. The part of
the integrand along P_p is what elements of degree p cannot be trusted with. Where state and mode are smooth it is of order h^p, beside
errors of order h^(2 p) of the eigenvalue. In an element that hides a needle or a layer it is as large as the integrand itself. The same
part of the stresses says how far the state is from the state of the continuum, where the mode itself is small as well. An eigenvalue that
exceeds twice the sum has the sign of the continuum's in all cases measured. It is an indicator and no bound. On meshes that resolve the
state, errors are far below the sum. On meshes that miss a needle an eigenvalue may be off by many times the sum; in all cases measured the
error was to the side of its own sign.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..discretization.space import HESSIAN_PAIRS, Space
from ..potential import Array, Evaluation
from .bending import Bending

#: an eigenvalue is small below this part of a typical one: about the eigenvalue of a membrane of the same area under a tension of one shear
#: modulus
_SMALL = 1e-2


def small_eigenvalue(space: Space) -> float:
    """Size below which the discretisation error of an eigenvalue is always estimated: 0.01 for a disc of unit radius."""
    return _SMALL * np.pi / space.reference_area


def unresolved(space: Space, density: Array, pairs: tuple[tuple[int, int], ...], local: Array, of_state: float) -> float:
    """Part of a Rayleigh quotient that the mesh does not resolve.

    Parameters
    ----------
    space : Space
    density : ndarray, shape (len(pairs), n_quadrature, n_elements)
        Second derivatives with respect to pairs of local variables, times the weights.
    pairs : tuple of (int, int)
    local : ndarray, shape (n_variables, n_quadrature, n_elements)
        Local variables of the mode, normalised in the mass.
    of_state : float
        :func:`unresolved_stress` of the state.
    """
    first, second, times = _indices(pairs)
    products = local.take(first, axis=0)
    products *= local.take(second, axis=0)
    products *= density
    products = products.reshape(len(times), -1)
    mode = _size(space.highest @ (times @ products).reshape(space.R.shape))
    return float(mode + of_state * _size(times @ np.abs(products, out=products)))


def unresolved_bending(space: Space, inside: Array, joints: float, of_state: float) -> float:
    """The same of the bending of a mode, from its energies at the points and at the joints: a mode that is resolved does not jump."""
    return _size(space.highest @ inside) + joints + of_state * _size(inside)


def unresolved_stress(space: Space, stress: Array) -> float:
    """Relative part of the stresses of a state that the mesh does not resolve. Errors of the pressure and of moduli are smaller."""
    integrand = (stress[0] + stress[1]).reshape(space.R.shape)
    integrand *= space.area_weights
    size = _size(integrand)
    return _size(space.highest @ integrand) / size if size else 0.0


def _size(values: Array) -> float:
    """Sum of absolute values."""
    return float(np.add.reduce(np.abs(values), axis=None))


def unresolved_axisymmetric(space: Space, evaluation: Evaluation, mode: Array, bending: Bending | None = None) -> float:
    """:func:`unresolved` for an axisymmetric mode."""
    shape = (space.n_quadrature, space.n_elements)
    local = evaluation.elements.at_quadrature(np.ascontiguousarray(mode)).reshape(4, *shape)
    of_state = evaluation.once("unresolved stress", lambda state: unresolved_stress(space, state.stress))
    part = unresolved(space, evaluation.stiffness_density.reshape(-1, *shape), HESSIAN_PAIRS, local, of_state)
    return part if bending is None else part + unresolved_bending(space, *bending.densities(mode), of_state)


@lru_cache(maxsize=8)
def _indices(pairs: tuple[tuple[int, int], ...]) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """First and second of each pair, and how often it counts in a quadratic form."""
    first, second = np.array(pairs).T
    return first, second, np.where(first == second, 1.0, 2.0)
