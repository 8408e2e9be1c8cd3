"""Smallest eigenvalue of the second variation, K phi = lambda M phi, with M the mass of the reference area.

lambda is a squared natural frequency: it converges under refinement, as raw Hessian eigenvalues do not. Under volume control only
perturbations with V' . phi = 0 compete.

Rayleigh quotient iteration on banded factors costs a few factorisations; it starts from the mode of a neighbouring state if there is one.
Its answer is accepted only with a proof by inertia that nothing lies below. Without that proof Lanczos iterations from a certified lower
bound decide.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from ..kernels import kernels
from ..kernels.interface import Rayleigh
from ..potential import Array
from ..solve.banded import BandFactor, BorderedFactor, band_product, negative_directions
from ..threads import cached_property

#: of Rayleigh quotient iterations, before Lanczos iterations are tried
_TOLERANCES = Rayleigh()


@dataclass(slots=True)
class SmallestEigenvalue:
    """Smallest eigenvalue with its mode (M-normalised), the number of negative directions, and a bound on the algebraic error."""

    value: float
    mode: Array
    negative: int
    error: float


class SpectrumError(ArithmeticError):
    """No eigenvalue could be proved to be the smallest."""


def smallest_eigenvalue(
    band: Array,
    mass: Array,
    half_bandwidth: int,
    constraint: Array | None = None,
    guess: Array | None = None,
    compliance: float = 0.0,
) -> SmallestEigenvalue:
    """Smallest lambda of K phi = lambda M phi, with constraint . phi = 0 or with the spring of a soft constraint.

    Parameters
    ----------
    band, mass : ndarray, shape (3 kd + 1, n)
        K (symmetric, any inertia) and M (positive definite) in LAPACK general band storage.
    half_bandwidth : int
    constraint : ndarray, shape (n,), optional
    guess : ndarray, shape (n,), optional
        A mode expected to be near.
    compliance : float
        Of the constraint: 0 for a rigid one, else K is stiffened by constraint constraint^T/compliance.

    Raises
    ------
    SpectrumError
        When neither method yields an eigenvalue with a proof by inertia.
    """
    return smallest_of(Pencil(band, mass, half_bandwidth, constraint, compliance), guess)


def smallest_of(pencil: Pencil, guess: Array | None = None) -> SmallestEigenvalue:
    """As :func:`smallest_eigenvalue`, of a pencil."""
    if pencil.constraint is not None and pencil.compliance == 0 and pencil.n < 2:
        raise SpectrumError("one unknown under one constraint leaves nothing to perturb")
    start = pencil.inverse_iterations(pencil.lower_bound()) if guess is None else guess
    found = pencil.proved(start)
    if found is None:
        found = pencil.lanczos()[0]
        if pencil.below(*found[:2]) > 0:
            raise SpectrumError("the eigenvalue found could not be proved to be the smallest")
    value, mode, error = found
    # nothing lies below a positive eigenvalue, so there is nothing negative to count
    negative = 0 if value > error else pencil.count(0.0)
    if (negative > 0) != (value < 0) and abs(value) > 10 * error:
        raise SpectrumError(f"smallest eigenvalue {value:.6g} contradicts {negative} negative directions")
    return SmallestEigenvalue(value, mode, negative, error)


def lowest_of(pencil: Pencil, count: int) -> list[tuple[float, Array, float]]:
    """The lowest eigenvalues of a pencil, each counted with its multiplicity, with modes and errors; proved complete by inertia.

    Raises
    ------
    SpectrumError
        When those found cannot be proved to be the lowest.
    """
    for width in (max(2 * count + 1, 20), max(4 * count + 1, 60)):
        found = pencil.lanczos(count, min(width, pencil.n))
        # all eigenvalues clearly below the last one must have been found
        shift = found[-1][0] - max(1e-6 * abs(found[-1][0]), 1e-12 * pencil.scale)
        if pencil.count(shift) == sum(value < shift for value, _, _ in found):
            return found
    raise SpectrumError(f"the {count} eigenvalues found could not be proved to be the lowest")


class Pencil:
    """K - lambda M with its constraint: factors, inertia and iterations at any shift."""

    #: whether K and M are band matrices, which the compiled half knows
    banded = True

    def __init__(self, band: Array, mass: Array, kd: int, constraint: Array | None, compliance: float) -> None:
        self.band, self.mass, self.kd, self.constraint, self.compliance = band, mass, kd, constraint, compliance
        self.n = int(band.shape[1])

    @cached_property
    def scale(self) -> float:
        """Eigenvalue of waves as short as an element, in size."""
        return float(np.abs(self.band[2 * self.kd] / self.mass[2 * self.kd]).max())

    def noise(self, mode: Array) -> tuple[float, float]:
        """Sizes of the terms that cancel in the Rayleigh quotient of a normalised mode and in its residual. Times round-off they are the
        noise of both.

        On a strongly graded mesh both are many decades below the scale, which belongs to waves as short as the smallest element.
        """
        forces = band_product(np.abs(self.band), self.kd, np.abs(mode))
        return float(np.abs(mode) @ forces), float(np.sqrt(np.sum(forces**2 / self.mass[2 * self.kd])))

    def times_mass(self, mode: Array) -> Array:
        return band_product(self.mass, self.kd, mode)

    def shifted_solver(self, shift: float) -> BandFactor | BorderedFactor:
        factor = BandFactor(self.band - shift * self.mass)
        return factor if self.constraint is None else BorderedFactor(factor, self.constraint, self.constraint, -self.compliance)

    def solve(self, solver: BandFactor | BorderedFactor, right: Array) -> Array:
        if isinstance(solver, BandFactor):
            return solver.solve(right)
        if right.ndim == 2:
            return np.stack([solver.solve(column, 0.0)[0] for column in right.T], axis=1)
        return solver.solve(right, 0.0)[0]

    def normalised(self, mode: Array) -> tuple[Array, Array]:
        """Mode and M mode with mode . M mode = 1, the largest entry of the mode positive."""
        mode = mode / np.abs(mode).max()  # a solve with a singular matrix may leave numbers whose squares overflow
        product = self.times_mass(mode)
        size = np.sqrt(mode @ product) * np.sign(mode[np.argmax(np.abs(mode))])
        return mode / size, product / size

    def lower_bound(self) -> float:
        """A shift below the spectrum: 0 if nothing is negative, else farther and farther down from the scale of ordinary modes."""
        if self.count(0.0) == 0:
            return 0.0
        shift = -1.0
        while self.count(shift) > 0:
            shift *= 4
            if shift < -1e3 * self.scale:
                raise SpectrumError("the second variation has no lower bound within reach")
        return shift

    def inverse_iterations(self, shift: float, count: int = 4) -> Array:
        solver = self.shifted_solver(shift)
        right = np.random.default_rng(0).standard_normal(self.n)  # fixed seed: a generic start, the same in every run
        mode = right
        for _ in range(count):
            mode, right = self.normalised(self.solve(solver, right))
        return mode

    def block_iterations(self, width: int = 6, iterations: int = 3) -> Array:
        """Best vector of a block of inverse iterations: the lowest azimuthal eigenvalues are too close together for a single vector."""
        solver = self.shifted_solver(self.lower_bound())
        block = np.random.default_rng(0).standard_normal((self.n, min(width, self.n)))

        def times(product: Callable[[Array], Array]) -> Array:
            return np.stack([product(column) for column in block.T], axis=1)

        for _ in range(iterations):
            block = np.linalg.qr(self.solve(solver, times(self.times_mass)))[0]
        return np.asarray(block @ eigh(block.T @ times(self.stiffness), block.T @ times(self.times_mass))[1][:, 0])

    def proved(self, guess: Array) -> tuple[float, Array, float] | None:
        """What :meth:`rayleigh` finds from a guess, if nothing lies below."""
        return kernels().rayleigh(self, guess, _TOLERANCES)

    def rayleigh(self, mode: Array, tolerances: Rayleigh = _TOLERANCES) -> tuple[float, Array, float] | None:
        best = np.inf
        for _ in range(tolerances.iterations):
            mode = self.projected(mode)
            if not mode.any():  # a guess along the constraint says nothing
                return None
            mode, right = self.normalised(mode)
            value, error = self.quotient(mode, right)
            # an absolute floor alone would stop too early on a nearly flat membrane, whose modes are decades softer than the scale
            # the error of the value is of second order in the error of the mode
            if error <= tolerances.converged * abs(value) or (
                error > tolerances.shrinking * best and error <= tolerances.rounding * self.noise(mode)[1]
            ):
                return value, mode, error
            best = min(best, error)
            mode = self.solve(self.shifted_solver(value), right)
            if not np.isfinite(mode).all():
                return None
        return None

    def projected(self, mode: Array) -> Array:
        """Without its component along a rigid constraint."""
        if self.constraint is None or self.compliance > 0:
            return mode
        c = self.constraint
        return mode - c * ((c @ mode) / (c @ c))

    def stiffness(self, mode: Array) -> Array:
        force = band_product(self.band, self.kd, mode)
        if self.constraint is not None and self.compliance > 0:
            force = force + self.constraint * ((self.constraint @ mode) / self.compliance)
        return force

    def quotient(self, mode: Array, right: Array) -> tuple[float, float]:
        """Rayleigh quotient and the size of the residual in the norm of M with its diagonal as a stand-in for M."""
        force = self.stiffness(mode)
        value = float(mode @ force)
        residual = self.projected(force - value * right)
        return value, float(np.sqrt(np.sum(residual**2 / self.mass[2 * self.kd])))

    def below(self, value: float, mode: Array) -> int:
        """Number of eigenvalues clearly below the eigenvalue of a mode, by inertia."""
        # the flat unloaded disc has no stiffness that could cancel: any shift tells its zeros from negative eigenvalues
        t = _TOLERANCES
        shift = value - max(t.gap * abs(value), t.noise * self.noise(mode)[0], t.floor * self.scale)
        return self.count(shift)

    def count(self, shift: float) -> int:
        """Number of eigenvalues below a shift, by inertia."""
        band = self.band - shift * self.mass if shift else self.band
        return negative_directions(band, self.kd, self.constraint, self.compliance)

    def lanczos(self, count: int = 1, width: int | None = None) -> list[tuple[float, Array, float]]:
        """The eigenvalues that shift-invert Lanczos iterations find next to a certified lower bound, in order, with modes and errors.

        ``width`` is the number of Lanczos vectors.
        """
        shift = self.lower_bound()
        solver = self.shifted_solver(shift)

        def operator(product: Callable[[Array], Array]) -> LinearOperator:
            return LinearOperator((self.n, self.n), matvec=lambda x: product(x.ravel()), dtype=float)

        def inverse(right: Array) -> Array:
            return self.solve(solver, right)

        start = inverse(np.random.default_rng(0).standard_normal(self.n))
        mass = operator(self.times_mass)
        try:
            values, modes = eigsh(
                operator(self.stiffness), k=count, M=mass, sigma=shift, OPinv=operator(inverse), v0=start, ncv=width, tol=1e-12
            )
        except (ArpackNoConvergence, ValueError, TypeError) as error:
            raise SpectrumError(f"Lanczos iterations did not converge: {error}") from error
        found = []
        for k in np.argsort(values):
            mode, right = self.normalised(modes[:, k])
            value, size = self.quotient(mode, right)
            found.append((value, mode, size))
        return found
