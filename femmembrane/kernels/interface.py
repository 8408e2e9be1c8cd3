"""What the solvers may ask of an implementation, and what they hand to it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..discretization.space import Space

Array = NDArray[np.float64]
#: instructions of a point function: scalar and vector ones, constants, and five sizes
Tape = tuple[NDArray[np.int64], NDArray[np.int64], Array, int, int, int, int, int]

#: rows of the point function of a potential: values to be summed, derivatives of E and of V, second derivatives of E - P V, stresses
N_SUMS, N_FORCE, N_STIFFNESS, N_STRESS = 3, 8, 10, 2
N_DENSITIES = N_FORCE + N_STIFFNESS + N_STRESS


class PointFunction(Protocol):
    """The densities of a potential at a point as a function of (data, local variables, (P, factor on sources and loads))."""

    data: Array

    def replay(self, local: Array, parameters: Array) -> Array:
        """Values at all points, shape (rows, n_points)."""

    def tape(self, operations: Sequence[str]) -> Tape | None:
        """The instructions in the codes of a list of operations; None when one of them is not in the list."""


class Factor(Protocol):
    """Factors of a symmetric band matrix."""

    def solve(self, right: Array) -> Array:
        """Solution for one or several right-hand sides, shape (n,) or (n, k)."""

    def determinant_sign(self) -> int: ...


class Border(Protocol):
    """Factors of a symmetric band matrix with one row and one column beside it."""

    def solve(self, f: Array, g: float) -> tuple[Array, float]: ...


#: elastic and magnetic energy, volume, whether all derivatives are numbers, forces and densities: see :meth:`Elements.evaluate`
Answer = tuple[float, float, float, bool, Array, Array]
#: factors, corrections of x and of P, sizes of the former and of x
Step = tuple[Border, Array, float, tuple[float, float], tuple[float, float]]


class Elements(Protocol):
    """The elements of one space with one point function; vectors are contiguous."""

    #: the implementation that these elements are of
    name: str

    def at_quadrature(self, x: Array) -> Array:
        """(u, u_x, w, w_x) at the quadrature points, shape (4 n_quadrature, n_elements)."""

    def evaluate(self, x: Array, pressure: float, factor: float, *more: float) -> Answer:
        """Elastic and magnetic energy, volume, whether all derivatives are numbers, the forces, and the densities. ``more`` are further
        parameters of the point function, if it has any.

        Returns
        -------
        elastic, magnetic, volume : float
        finite : bool
        forces : ndarray, shape (3, n_free)
            E', V' and what is out of balance, P V' - E'.
        densities : ndarray, shape (N_DENSITIES, n_points)
        """

    def assemble(self, densities: Array) -> Array:
        """Band of the second derivatives among the densities of an evaluation.

        In LAPACK general storage, shape (3 kd + 1, n_free), Fortran order.
        """

    def border(self, densities: Array, volume_gradient: Array, row: Array, corner: float) -> Border:
        """Factors of [K, -V'; row, corner] with K assembled as by :meth:`assemble`."""

    def step(self, densities: Array, forces: Array, row: Array, corner: float, gap: float, x: Array) -> Step:
        """What a bordered Newton step at x takes, in one call: :meth:`border`, its solution for (P V' - E', -gap), and sizes.

        Returns
        -------
        border : Border
        dx : ndarray, shape (n_free,)
        dp : float
        change, size : tuple of float
            :meth:`largest` of dx and of x.
        """

    def largest(self, x: Array) -> tuple[float, float]:
        """Largest sizes of a vector of unknowns among u and among w; infinite where there is no number."""

    def force_scale(self, densities: Array, pressure: float) -> tuple[float, float]:
        """Sum of the absolute forces that meet at the nodes, largest for u and for w, from the densities of an evaluation."""

    def kinks(self, space: Space, x: Array) -> Array:
        """:meth:`.Space.kinks` of a space with these elements, whose ends may be held elsewhere."""

    def form_parts(self, densities: Array, x: Array, weights: Array) -> tuple[float, float]:
        """Of the integrand of x . K x, K as assembled by :meth:`assemble`, at the quadrature points.

        Returns
        -------
        weighed : float
            Sum over the elements of the size of its sum with ``weights``, one for each quadrature point of an element.
        terms : float
            Sum of the sizes of all of its terms.
        """


class Rayleigh(NamedTuple):
    """Tolerances of Rayleigh quotient iterations.

    Attributes
    ----------
    iterations : int
        Most of them.
    converged : float
        Residual, relative to the eigenvalue, that ends them.
    shrinking : float
        Factor by which a residual shrinks as long as it is more than round-off.
    rounding : float
        Residual that is round-off, relative to the forces that cancel in it.
    gap, noise, floor : float
        How far below an eigenvalue inertia looks for others: the largest of these parts of the eigenvalue, of what cancels in it, and of
        the eigenvalue of waves as short as an element.
    """

    iterations: int = 8
    converged: float = 1e-7
    shrinking: float = 0.5
    rounding: float = 1e-14
    gap: float = 1e-4
    noise: float = 1e-12
    floor: float = 1e-24


class Pencil(Protocol):
    """K - lambda M with a constraint, as :mod:`..stability.spectrum` hands it to :meth:`Kernels.rayleigh`."""

    #: whether K and M are band matrices
    banded: bool
    band: Array
    mass: Array
    constraint: Array | None
    kd: int
    compliance: float

    def below(self, value: float, mode: Array) -> int:
        """Number of eigenvalues clearly below the eigenvalue of a mode."""

    def rayleigh(self, mode: Array) -> tuple[float, Array, float] | None:
        """Eigenvalue, mode and error that the iterations lead to."""


class Kernels(Protocol):
    """One implementation."""

    #: as records note it
    name: str

    def elements(self, space: Space, point: PointFunction) -> Elements: ...

    def factor(self, band: Array) -> Factor:
        """Factors of a symmetric band matrix in LAPACK general storage, shape (3 kd + 1, n); a zero pivot is perturbed at round-off."""

    def product(self, band: Array, half_bandwidth: int, x: Array) -> Array:
        """Symmetric band matrix in LAPACK general storage times a vector."""

    def inner(self, band: Array, half_bandwidth: int, x: Array, y: Array) -> float:
        """x . A y with a symmetric band matrix in LAPACK general storage and contiguous vectors."""

    def inertia(self, band: Array, half_bandwidth: int, constraint: Array | None, compliance: float) -> int:
        """See :func:`..solve.banded.negative_directions`."""

    def rayleigh(self, pencil: Any, guess: Array, tolerances: Rayleigh) -> tuple[float, Array, float] | None:
        """Eigenvalue, mode and error that Rayleigh quotient iterations from a guess lead to, if nothing lies below."""
