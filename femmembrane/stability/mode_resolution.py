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

import numpy as np
from scipy.linalg import blas

from ..discretization.space import Space
from ..kernels.numpy_kernels import form_parts
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
    along, terms = form_parts(density, pairs, local, space.highest)
    return along + of_state * terms


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
    return float(blas.dasum(values.ravel()))


def unresolved_axisymmetric(evaluation: Evaluation, mode: Array, bending: Bending | None = None) -> float:
    """:func:`unresolved` for an axisymmetric mode."""
    along, terms = evaluation.form_parts(mode)
    of_state = evaluation.once("unresolved stress", _of_state)
    part = along + of_state * terms
    return part if bending is None else part + unresolved_bending(evaluation.potential.space, *bending.densities(mode), of_state)


def _of_state(evaluation: Evaluation) -> float:
    return unresolved_stress(evaluation.potential.space, evaluation.stress)
