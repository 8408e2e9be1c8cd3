"""Strains at the ends of elements by the forces there: exact to twice the order of strains.

Strains of elements of degree p are exact to order p. But positions of ends of elements, and forces across them, are exact to order 2 p. The
force F that acts on an end is the residual of the one element beside it. With the slopes q of the element there, the slopes that carry this
force are, to the square of their error::

    q + (d2 psi/dq2)^-1 (F - d psi/dq)

in which psi is the density of the potential at the end.
"""

from __future__ import annotations

import numpy as np

from ..discretization.elements import lobatto
from ..discretization.space import HESSIAN_PAIRS
from ..physics.kinematics import hencky_strains
from ..potential import Array, Evaluation, Potential


class _AtEnds(Potential):
    """A potential with its densities at both ends of each element, with the expressions of another one."""

    def __init__(self, like: Potential) -> None:
        self._like = like
        super().__init__(like.scene, 0)


def strains_at_ends(potential: Potential, evaluation: Evaluation, pressure: float) -> Array:
    """Strains beyond natural width at both ends of each element, by the forces there, shape (2 directions, 2 ends, n_elements).

    They are NaN on the axis.
    """
    x, factor = evaluation.x, evaluation.factor
    there = _AtEnds(potential)
    own = there.space
    forces = _forces(potential, evaluation, pressure)
    with np.errstate(all="ignore"):  # on the axis a hoop strain is no number
        found = there.evaluate(x, pressure, factor)
        weights = own.weights / (2 * np.pi)
        density = found.force_density
        missing = forces - (density[1:4:2] - pressure * density[5::2]).reshape(2, *own.s.shape) / weights
        stiffness = dict(zip(HESSIAN_PAIRS, found.stiffness_density.reshape(-1, *own.s.shape) / weights, strict=True))
        k11, k12, k22 = (stiffness[pair] for pair in ((1, 1), (1, 3), (3, 3)))
        determinant = k11 * k22 - k12**2
        more = np.array([k22 * missing[0] - k12 * missing[1], k11 * missing[1] - k12 * missing[0]]) / determinant
        u, u_x, _, w_x = own.displacement_at_quadrature(x)
        strains = hencky_strains(own.R, own.R_x, own.Z_x, u, u_x + more[0], w_x + more[1])
        response = potential.response_at(x, own.R, own.Z, own.s, factor)
        return np.stack(response.beyond(*strains))  # type: ignore[attr-defined]  # that of a tension field


def _forces(potential: Potential, evaluation: Evaluation, pressure: float) -> Array:
    """Forces in the directions of u and w at both ends of each element, with the 2 pi, shape (2 directions, 2 ends, n_elements)."""
    space, density = potential.space, evaluation.force_density
    local = space.table.T @ (density[:4] - pressure * density[4:]).reshape(-1, space.n_elements)
    rising = space.from_values @ lobatto(space.degree)  # the function that is 0 at the first end of an element and 1 at the last
    falling = space.from_values @ np.ones(space.degree + 1) - rising
    return np.array([[-falling @ part, rising @ part] for part in np.split(local, 2)])
