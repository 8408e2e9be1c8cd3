"""What a potential answers at one state: energies, forces, second derivatives, and Newton steps from them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..kernels import kernels
from ..kernels.bordered import BorderedFactor, SpringFactor
from ..kernels.interface import N_FORCE, N_STIFFNESS, Answer, Array, Border, Elements, Factor, Step

if TYPE_CHECKING:
    from .potential import Potential


class Evaluation:
    """Value, gradient and Hessian of E and V at one state x; energies and volume with the 2 pi.

    Attributes
    ----------
    elastic_energy, magnetic_energy, volume : float
    gradient, volume_gradient, unbalanced : ndarray, shape (n_free,)
        E', V' and P V' - E' at the pressure of the evaluation.
    finite : bool
        Whether all derivatives are numbers: outside the domain of the energy they are not.
    elements : Elements
        The kernels that answered.
    spring : ndarray, shape (n_free,), or None
        a, where the second derivatives are the band plus a a^T: with a total charge, which couples all points.
    """

    _band: Array | None = None
    _negative: int | None = None

    def __init__(
        self,
        x: Array,
        answer: Answer,
        potential: Potential,
        elements: Elements,
        factor: float,
        spring: Array | None = None,
    ) -> None:
        self.x, self.potential, self.elements, self.factor, self.spring = x, potential, elements, factor, spring
        self.elastic_energy, self.magnetic_energy, self.volume, self.finite, self._forces, self._densities = answer
        self._known: dict[str, float] = {}

    @property
    def force_density(self) -> Array:
        """The integrands of the two gradients, shape (8, n_points), by which a residual is judged."""
        return self._densities[:N_FORCE]

    @property
    def stiffness_density(self) -> Array:
        """What :attr:`band` integrates, shape (10 n_quadrature, n_elements)."""
        return self._densities[N_FORCE : N_FORCE + N_STIFFNESS].reshape(-1, self.potential.space.n_elements)

    @property
    def stress(self) -> Array:
        """Principal mechanical stresses at the quadrature points, shape (2, n_points)."""
        return self._densities[N_FORCE + N_STIFFNESS :]

    @property
    def gradient(self) -> Array:
        return self._forces[0]

    @property
    def volume_gradient(self) -> Array:
        return self._forces[1]

    @property
    def unbalanced(self) -> Array:
        return self._forces[2]

    def once(self, name: str, compute: Callable[[Evaluation], float]) -> float:
        """A number that belongs to this state, computed when first asked for under its name."""
        known = self._known
        if name not in known:
            known[name] = compute(self)
        return known[name]

    @property
    def band(self) -> Array:
        """E'' - P V'' in LAPACK band storage, shape (3 kd + 1, n_free), less what the :attr:`spring` adds: assembled when first asked for,
        as not every state needs it.
        """
        if self._band is None:
            self._band = self.elements.assemble(self._densities)
        return self._band

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues of E'' - P V'': counted once, as two neighbouring steps of a branch ask for it."""
        if self._negative is None:
            spring = None if self.spring is None else self.reduced(self.spring)
            self._negative = kernels().inertia(self.band, self.potential.space.half_bandwidth, spring, 1.0)
        return self._negative

    def factors(self) -> Factor:
        """Factors of E'' - P V''."""
        factor = kernels().factor(self.band)
        return factor if self.spring is None else SpringFactor(factor, self.spring)

    @property
    def raw(self) -> Evaluation:
        """The same state with what bodies take: this one, unless they hold nodes."""
        return self

    def carried(self, v: Array) -> Array:
        """See :meth:`.Potential.carried`."""
        return self.potential.carried(v)

    def brought(self, v: Array) -> Array:
        """See :meth:`.Potential.brought`; without what bodies keep from moving."""
        return self.potential.brought(v)

    def row(self, row: Array) -> Array:
        """See :meth:`.Potential.row`."""
        return self.potential.row(row)

    def pressed_flat(self) -> NDArray[np.bool_] | None:
        """Which elements lie on a body all over, shape (n_elements,), so that no short wave lifts them; None where none does."""
        return None

    def touched(self) -> tuple[Evaluation, Evaluation] | None:
        """The same state without the nodes that bodies touch with no force, and with these held; None where there are none."""
        return None

    def holds(self, unknown: int) -> bool:
        """Whether a body keeps an unknown from changing."""
        return False

    def reduced(self, v: Array) -> Array:
        """A vector, or columns, in the unknowns of :attr:`band`: the same one, unless bodies hold nodes."""
        return v

    def expanded(self, v: Array) -> Array:
        """The displacement of a vector in the unknowns of :attr:`band`."""
        return v

    def reduced_form(self, band: Array, half_bandwidth: int) -> Array:
        """Another symmetric band matrix in the unknowns of :attr:`band`."""
        return band

    def reduced_mass(self, mass: Array) -> Array:
        """A mass matrix in the unknowns of :attr:`band`."""
        return mass

    def inner(self, x: Array, y: Array) -> float:
        """x . (E'' - P V'') y."""
        own = kernels().inner(self.band, self.potential.space.half_bandwidth, x, y)
        return own if self.spring is None else own + float(self.spring @ x) * float(self.spring @ y)

    def border(self, row: Array, corner: float) -> Border:
        """Factors of :attr:`band` with the column -V' and the row of a control."""
        if self.spring is not None:
            return BorderedFactor(self.factors(), -self.volume_gradient, row, corner)
        return self.elements.border(self._densities, self.volume_gradient, row, corner)

    def step(self, row: Array, corner: float, gap: float) -> Step:
        """The bordered Newton step at x and its factors, see :meth:`.Elements.step`."""
        if self.spring is not None:
            border, largest = self.border(row, corner), self.elements.largest
            dx, dp = border.solve(self.unbalanced, -gap)
            return border, dx, dp, largest(dx), largest(self.x)
        return self.elements.step(self._densities, self._forces, row, corner, gap, self.x)

    def force_scale(self, pressure: float) -> tuple[float, float]:
        """Sum of the absolute forces that meet at the nodes, largest for u and for w."""
        return self.elements.force_scale(self._densities, pressure)

    def form_parts(self, mode: Array) -> tuple[float, float]:
        """Of the integrand of mode . (E'' - P V'') mode, less what the :attr:`spring` adds: see :meth:`.Elements.form_parts`. The weights
        are those of the highest polynomial that the quadrature points of an element tell apart.
        """
        return self.elements.form_parts(self._densities, np.ascontiguousarray(mode), self.potential.space.highest)

    @property
    def load_energy(self) -> float:
        """Energy of the loads at x: computed only when asked for, as no solver needs it."""
        return self.potential.load_energy(self.x, self.factor)

    @property
    def electric_energy(self) -> float:
        """Energy of voltage or charge at x, with the 2 pi; computed when asked for."""
        return self.potential.electric_energy(self.x, self.factor)

    @property
    def energy(self) -> float:
        return self.elastic_energy + self.magnetic_energy + self.load_energy + self.electric_energy

    @property
    def energy_size(self) -> float:
        """Sum of the sizes of all energies: what an error of their sum is compared with."""
        return abs(self.elastic_energy) + abs(self.magnetic_energy) + abs(self.load_energy) + abs(self.electric_energy)
