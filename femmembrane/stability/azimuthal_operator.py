"""The operator of perturbations with n waves around the axis: K and M as band matrices, and the motions that cost nothing.

Rigid motions that the supports leave are taken out, and of a sphere the motion of its material in itself under the deformed shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from ..checks import whole
from ..discretization.harmonics import AROUND, RADIAL, VERTICAL
from ..discretization.space import Space
from ..potential import Array, Evaluation, Potential
from ..potential.contact import Reduction
from .bending import Bending, bending_form, widened
from .mode_resolution import small_eigenvalue
from .rigid_motions import pencil_of, rigid_part
from .second_variation import LocalResponse, response_at_quadrature, second_variation
from .spectrum import Pencil
from .wave_unknowns import WaveUnknowns, azimuthal_shape, wave_unknowns

if TYPE_CHECKING:
    from ..potential.contact import ContactEvaluation, ContactPotential

#: departure from a rigid motion, relative to its size, below which the turned material of a sphere has only turned as a whole
_ROUND = 1e-6
#: iterations that lead from there to the eigenvector of the mesh, and the least part of its square that this must have in common with it
_INVERSE_ITERATIONS, _ALIKE = 3, 0.9


@dataclass(frozen=True, eq=False)
class AzimuthalOperator:
    """K and M of the perturbations with n waves around the axis.

    Attributes
    ----------
    band, mass : ndarray, shape (3 kd + 1, n_free)
        In LAPACK general band storage.
    half_bandwidth : int
        kd = 3 degree + 2 (2 degree + 1 for n = 0), and about twice that with bending.
    numbering : ndarray of int, shape (n_nodes, 3)
        Unknown of (a, c, b) at each node along the meridian; n_free stands for what is held. On the axis at n = 1, c = -a share one.
    n : int
    response : LocalResponse
        At the quadrature points, shape (n_quadrature, n_elements).
    density : ndarray, shape (18 or 19, n_quadrature, n_elements)
        What ``band`` integrates beside bending: second derivatives of the quadratic form at the points, times the weights, in the order of
        :func:`.second_variation.pairs_of`.
    rigid : ndarray, shape (n_free, k), or None
        Motions of the membrane as a whole that nothing resists, see :mod:`.rigid_motions`.
    spin : ndarray, shape (n_free,), or None
        The mass times the motion of the material in itself that costs nothing, see :func:`_spin`: perturbations are orthogonal to it.
    spring : ndarray, shape (n_free,), or None
        Of a total charge at n = 0, see :class:`.Evaluation`; waves do not change the capacitance to first order.
    bending : Bending or None
        What the bending of the sheet adds, where the scene has it.
    reduction : Reduction or None
        Where bodies hold nodes: ``band``, ``mass``, ``rigid`` and ``spin`` are without the normal displacements of these.
    """

    band: Array
    mass: Array
    half_bandwidth: int
    numbering: NDArray[np.int64]
    n: int
    response: LocalResponse
    space: Space
    density: Array
    rigid: Array | None = None
    spin: Array | None = None
    spring: Array | None = None
    bending: Bending | None = None
    reduction: Reduction | None = None

    def reduced(self, v: Array) -> Array:
        """A vector in the unknowns of :attr:`band`: the same one, unless bodies hold nodes."""
        return v if self.reduction is None else self.reduction.reduced(v)

    def expanded(self, v: Array) -> Array:
        """The coefficients of (a, c, b) of a vector in the unknowns of :attr:`band`."""
        return v if self.reduction is None else self.reduction.expanded(v)

    def pencil(self, constraint: Array | None = None) -> Pencil:
        """K - lambda M, motions that cost nothing taken out."""
        held = self.spin if constraint is None else constraint
        return pencil_of(self.band, self.mass, self.half_bandwidth, held, 0.0, self.rigid, self.spring)

    def shape(self, mode: Array) -> dict[str, Array]:
        """A mode at the nodes, see :func:`azimuthal_shape`."""
        return azimuthal_shape(self.space, self.n, self.expanded(mode))


def azimuthal_operator(potential: Potential, x: Array, pressure: float, n: int) -> AzimuthalOperator:
    """Second variation against n waves around the axis at an equilibrium (x, P).

    Parameters
    ----------
    potential : Potential
    x : ndarray, shape (n_free,)
        Displacement coefficients of the axisymmetric state.
    pressure : float
    n : int
        0 gives the axisymmetric operator under pressure control.

    Raises
    ------
    InputError
        For n that is no whole number >= 0.
    """
    check_waves(n, 0)
    space = potential.space
    layout = wave_unknowns(space, min(n, 2))
    response = response_at_quadrature(potential, np.asarray(x, dtype=float).tobytes())
    density = np.stack(second_variation(space, response, potential.loads, pressure, n))
    band = layout.assemble(density)
    for end in space.free_ends if n else ():
        rho = space.mesh.position(space.ends[[end]])[0] + space.displacement(x, space.ends[[end]])[0]
        i, j = layout.numbers[space.nodes[end], [RADIAL, VERTICAL]]
        work = np.pi * n * pressure * float(rho[0]) * (space.side if end == 0 else -space.side)  # of the film across a free edge
        for row, column in ((i, j), (j, i)) if j < layout.n_free else ():  # b may be held there against a tilt of the whole
            band[2 * layout.half_bandwidth + row - column, column] += work
    spring = potential.evaluate(np.asarray(x, dtype=float), pressure).spring if n == 0 and potential.charged is not None else None
    rigid, spin, mass = None, None, layout.mass(potential.bulk)
    motions = _rigid_motions(space, response, int(n))
    if len(motions):
        area = potential.bulk
        rigid = rigid_part(np.stack([layout.integrate(motion * area) for motion in motions], axis=1), _products(motions, motions, area))
    turns = potential.magnetisation is None or potential.magnetisation.turns
    uniform = potential.sheet is None and potential.electrode is None
    if n == 1 and space.spins and uniform and turns:
        spin = _spin(space, layout, response, motions, pencil_of(band, mass, layout.half_bandwidth, None, 0.0, rigid))
    kd, form = layout.half_bandwidth, bending_form(potential, x)
    bending = None if form is None else form.at(int(n))
    if bending is not None:
        band, mass, kd = bending.added_to(band, kd), widened(mass, kd, bending.half_bandwidth), bending.half_bandwidth
    reduction = None
    if potential.obstacles:
        band, reduction = _against_bodies(potential, x, pressure, layout, band, kd)
    if reduction is not None:
        lightest = np.full(reduction.out.shape, np.abs(mass[2 * kd]).min())
        mass = reduction.band(mass, kd, lightest)
        rigid, spin, spring = (None if part is None else reduction.reduced(part) for part in (rigid, spin, spring))
    return AzimuthalOperator(
        band, mass, kd, layout.numbers, int(n), response, space, density, rigid, spin, spring, bending=bending, reduction=reduction
    )


def on_set(potential: Potential, evaluation: Evaluation) -> Potential:
    """The potential with the nodes held that bodies hold in an evaluation."""
    return cast("ContactPotential", potential).holding(cast("ContactEvaluation", evaluation).held)


def _against_bodies(
    potential: Potential, x: Array, pressure: float, layout: WaveUnknowns, band: Array, kd: int
) -> tuple[Array, Reduction | None]:
    """The matrix with what bodies add and take, and who takes vectors there; unchanged and None where none is touched.

    A body of which a node keeps the distance 0 leaves it the tangential displacement and the one around the axis. The force that it pushes
    with works on their squares, by the curvatures of the body.
    """
    evaluation = cast("ContactEvaluation", potential.evaluate(np.asarray(x, dtype=float), pressure))
    held, gaps, n = evaluation.held, evaluation.gaps, layout.n_free
    if not held.any():
        return band, None
    own = cast("ContactPotential", potential)
    numbers = layout.numbers[potential.space.nodes[own.nodes[held]]]
    a, c, b = (numbers[:, k] for k in (RADIAL, AROUND, VERTICAL))
    n_rho, n_eta, force = gaps.n_rho[held], gaps.n_eta[held], evaluation.forces[held]
    band = band.copy(order="F")
    for i, j, work in (
        (a, a, gaps.curvature[held] * n_eta**2),
        (b, b, gaps.curvature[held] * n_rho**2),
        (a, b, -gaps.curvature[held] * n_rho * n_eta),
        (b, a, -gaps.curvature[held] * n_rho * n_eta),
        (c, c, gaps.circle[held]),
    ):
        both = (i < n) & (j < n)
        np.add.at(band, (2 * kd + (i - j)[both], j[both]), -(force * work)[both])
    able = (np.where(a < n, np.abs(n_rho), 0.0) > 1e-6) | (np.where(b < n, np.abs(n_eta), 0.0) > 1e-6)
    a, b, n_rho, n_eta = a[able], b[able], n_rho[able], n_eta[able]
    reduction = Reduction(a, b, n_rho, n_eta, n)
    return reduction.band(band, kd), reduction


def _products(first: Array, second: Array, area: Array) -> Array:
    """Inner products of fields (a, c, b) over the reference area."""
    return np.einsum("ifqe,jfqe,qe->ij", first, second, area)


def _rigid_motions(space: Space, r: LocalResponse, n: int) -> Array:
    """Motions as a whole, shape (k, 3, n_quadrature, n_elements): along the axis at n = 0; a shift and a tilt, if free, at n = 1."""
    if n > 1 or (n == 1 and not any(space.rotations)) or (n == 0 and space.pin is None):
        return np.zeros((0, 3, *r.rho.shape))
    one, zero = np.ones_like(r.rho), np.zeros_like(r.rho)
    shift, tilt = (one, -one, zero), (r.eta, -r.eta, -r.rho)
    if n == 0:
        motions = [(zero, zero, one)]
    else:
        free = space.rotations
        motions = [motion for motion, is_free in zip((shift, tilt), free, strict=True) if is_free]
        if free == (False, True):  # about the circle that is held in its plane
            place = next(k for k, support in enumerate(space.supports) if "u" in support.held and not space.on_axis[k])
            height = (r.eta[0, 0], r.eta[-1, -1])[place]
            motions = [(r.eta - height, height - r.eta, -r.rho)]
    return np.array(motions)


def _spin(space: Space, layout: WaveUnknowns, r: LocalResponse, rigid: Array, pencil: Pencil) -> Array | None:
    """The mass times the motion of a sphere's material in itself under its deformed shape; None where it is a rigid one.

    A uniform sphere that is turned about an axis through its equator is the same sphere. So integrals over its reference area do not change
    when the material moves in this way, energies of sources and loads included. With v = (v_S, v_theta) the velocities of that rotation
    along the reference sphere the motion is x_S v_S + x_theta v_theta/R. Of a round shape it is a tilt of the whole.
    """
    J = np.hypot(space.R_x, space.Z_x)
    height = space.Z - space.center
    along = (height * space.R_x - space.R * space.Z_x) / J**2
    field = np.stack([along * r.rho_x, -r.rho / space.R * height, along * r.eta_x])[None]
    area = space.area_weights
    size = float(_products(field, field, area)[0, 0])
    if len(rigid):
        shares = np.linalg.solve(_products(rigid, rigid, area), _products(rigid, field, area))
        field = field - np.einsum("ij,ifqe->jfqe", shares, rigid)
        if _products(field, field, area)[0, 0] <= _ROUND**2 * size:
            return None
    product = layout.integrate(field[0] * area)
    # slopes of the shape jump where elements meet: of the motion the mesh holds that eigenvector which is next to it, and next to zero
    solver, kept = pencil.shifted_solver(0.0), product
    for _ in range(_INVERSE_ITERATIONS):
        mode, kept = pencil.normalised(pencil.solve(solver, kept))
    alike = float(mode @ product) ** 2 >= _ALIKE * float(_products(field, field, area)[0, 0])
    return kept if alike and abs(mode @ pencil.stiffness(mode)) <= small_eigenvalue(space) else None


def check_waves(n: int, least: int) -> None:
    whole("azimuthal", n, least=least)
