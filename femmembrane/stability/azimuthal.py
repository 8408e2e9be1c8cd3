"""Second variation against perturbations with n waves around the axis: wobbling, tipping sideways, wrinkling.

::

    u = (a cos n theta, c sin n theta, b cos n theta)        in (e_rho, e_theta, e_z),   a, c, b functions of the meridian

Each n decouples from all others, so three functions on the meridian and one banded matrix describe a perturbation of the whole surface.
With t the unit tangent of the deformed meridian, nu its normal, ' = d/dS along the reference meridian, and
e = -(n a + c)/R, f = -n b/R, q = (a + n c)/R, the displacement gradient has the components (t, theta, nu)::

    g1 = (t.(a', b'), c', nu.(a', b')),        g2 = (t.(e, f), q, nu.(e, f))

and the quadratic form is, per reference area,

    W_11 g1t^2 + 2 W_12 g1t g2th + W_22 g2th^2 + A (g1th^2 + g2t^2) + 2 B g1th g2t + W_1/l1 g1nu^2 + W_2/l2 g2nu^2
    + m_rr a^2 + 2 m_rz a b + m_zz b^2 + m_r/rho c^2                                  (m: energy density of sources, loads)

with A = (l1 W_1 - l2 W_2)/(l1^2 - l2^2), B = (l2 W_1 - l1 W_2)/(l1^2 - l2^2), minus P times the second variation of the enclosed volume,
2 Int eta (a a_x + c c_x + n (a c)_x) + rho_x (a b + n b c) + rho a_x b dx. Where an end moves in its plane, the lid that closes the volume
there counts too: by parts -Int eta_x (a^2 + 2 n a c + c^2) + rho (2 a b_x + n c b_x + n b c_x) - n rho_x b c dx, and at a free edge, whose
lid is a film that its edge makes harmonic, b (r/rho)^n cos n theta to first order, further [n rho a b] of the two ends. A load g(eta) over
the projected area adds the first form with g for eta in its first term and g' before the others, and g'' rho rho_x b^2.

Integrals over theta are normalised as for n = 0, 2 pi instead of pi, so that n = 0 is the axisymmetric operator entry by entry; eigenvalues
do not depend on it. c plays no part at n = 0.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from ..discretization.space import Space, band_of
from ..errors import InputError, unknown_name
from ..physics.kinematics import hencky_strains
from ..physics.loads import Load, over_projection
from ..physics.tension_field import natural_strains
from ..potential import Array, Evaluation, Potential
from ..results.verdict import Verdict
from ..solve.banded import band_product
from ..solve.wellposed import compressed, ill_posed, interval, least_stress
from ..threads import one_thread
from .floating import pencil_of, rigid_part
from .resolution import small_eigenvalue, unresolved
from .spectrum import Pencil, SmallestEigenvalue, SpectrumError, smallest_of
from .verdict import against, verdict_from

#: difference of the logarithmic stretches below which (s_1 - s_2)/(e_1 - e_2) is integrated rather than divided out; both ways are
#: accurate to about 1e-12 there (round-off/d for the quotient, (5 d/2)^4/270 for two Gauss points and the exponent 5)
EQUAL_STRETCH = 1e-3

#: departure from a rigid motion, relative to its size, below which the turned material of a sphere has only turned as a whole
_ROUND = 1e-6
#: iterations that lead from there to the eigenvector of the mesh, and the least part of its square that this must have in common with it
_INVERSE_ITERATIONS, _ALIKE = 3, 0.9

#: local variables (a, a_x, c, c_x, b, b_x); pairs (c_x, b_x), (a_x, c_x) and (b, b_x) never meet
_A, _AX, _C, _CX, _B, _BX = range(6)
_PAIRS = (
    (_A, _A),
    (_A, _AX),
    (_A, _C),
    (_A, _CX),
    (_A, _B),
    (_A, _BX),
    (_AX, _AX),
    (_AX, _C),
    (_AX, _B),
    (_AX, _BX),
    (_C, _C),
    (_C, _CX),
    (_C, _B),
    (_C, _BX),
    (_CX, _CX),
    (_CX, _B),
    (_B, _B),
    (_BX, _BX),
)


@dataclass(frozen=True, eq=False)
class LocalResponse:
    """Stretches, stresses, tangent moduli and magnetic derivatives at points of a deformed meridian.

    Attributes
    ----------
    rho, eta, rho_x, eta_x : deformed position and slopes
    t_rho, t_z : unit tangent
    s1, s2 : principal mechanical stresses l_i W_i
    W11, W12, W22 : second derivatives of the strain energy with respect to the stretches
    N1, N2 : W_1/l1 and W_2/l2, the stiffness of rotation out of the surface
    A, B : in-plane shear moduli, continuous through l1 = l2
    field : ndarray, shape (6, ...)
        m, m_rho, m_eta, m_rho_rho, m_rho_eta, m_eta_eta of the energy density of sources and loads.
    """

    rho: Array
    eta: Array
    rho_x: Array
    eta_x: Array
    t_rho: Array
    t_z: Array
    s1: Array
    s2: Array
    W11: Array
    W12: Array
    W22: Array
    N1: Array
    N2: Array
    A: Array
    B: Array
    field: Array


def local_response(potential: Potential, meridian: tuple[Array, ...], displacement: tuple[Array, ...]) -> LocalResponse:
    """Response at points (R, R_x, Z, Z_x) of the reference meridian displaced by (u, u_x, w, w_x); R > 0 and any shape."""
    R, R_x, Z, Z_x = meridian
    u, u_x, w, w_x = displacement
    shape = R.shape
    rho, eta, rho_x, eta_x = R + u, Z + w, R_x + u_x, Z_x + w_x
    e1, e2 = hencky_strains(R, R_x, Z_x, u, u_x, w_x)
    s1, s2, d11, d12, d22 = potential.response(e1, e2).reshape(5, *shape)
    l1, l2 = np.exp(e1), np.exp(e2)
    slope = np.hypot(rho_x, eta_x)
    # l1^2 - l2^2 = 2 l1 l2 sinh d for d = e1 - e2
    d = e1 - e2
    A = _stress_quotient(potential, e1, e2, s1 - s2, d) * _over_sinh(d) / (2 * l1 * l2)
    B = ((l1**2 + l2**2) / 2 * A - (s1 + s2) / 2) / (l1 * l2)
    return LocalResponse(
        rho=rho,
        eta=eta,
        rho_x=rho_x,
        eta_x=eta_x,
        t_rho=rho_x / slope,
        t_z=eta_x / slope,
        s1=s1,
        s2=s2,
        W11=(d11 - s1) / l1**2,
        W12=d12 / (l1 * l2),
        W22=(d22 - s2) / l2**2,
        N1=s1 / l1**2,
        N2=s2 / l2**2,
        A=A,
        B=B,
        field=potential.field_energy(rho, eta).reshape(6, *shape),
    )


def _over_sinh(d: Array) -> Array:
    """d/sinh d."""
    safe = np.where(d == 0, 1.0, d)
    return np.where(d == 0, 1.0, safe / np.sinh(safe))


def _stress_quotient(potential: Potential, e1: Array, e2: Array, difference: Array, d: Array) -> Array:
    """(s_1 - s_2)/(e_1 - e_2), continuous through equal stretches.

    For an isotropic material the difference g is odd in d at fixed mean strain, so g/d = Int_0^1 g'(t d) dt has an even integrand, and
    one evaluation at t = 1/sqrt 3 is a Gauss rule of two points.
    """
    close = np.abs(d) < EQUAL_STRETCH
    if potential.scene.tension_field:  # where one stress is gone, the difference is odd but not smooth, and has no digits to lose
        _, _, taut1, taut2 = natural_strains(e1, e2)
        close &= taut1 == taut2
    quotient: Array = difference / np.where(close, 1.0, d)
    if close.any():
        mean, half = (e1 + e2)[close] / 2, d[close] / np.sqrt(12)
        _, _, d11, d12, d22 = potential.response(mean + half, mean - half)
        quotient[close] = (d11 - 2 * d12 + d22) / 2
    return quotient


@dataclass(frozen=True, eq=False)
class AzimuthalOperator:
    """K and M of the perturbations with n waves around the axis.

    Attributes
    ----------
    band, mass : ndarray, shape (3 kd + 1, n_free)
        In LAPACK general band storage.
    half_bandwidth : int
        kd = 3 degree + 2 (2 degree + 1 for n = 0).
    numbering : ndarray of int, shape (n_nodes, 3)
        Unknown of (a, c, b) at each node along the meridian; n_free stands for what is held. On the axis at n = 1, c = -a share one.
    n : int
    response : LocalResponse
        At the quadrature points, shape (n_quadrature, n_elements).
    density : ndarray, shape (18, n_quadrature, n_elements)
        What ``band`` integrates: second derivatives of the quadratic form at the points in the order of _PAIRS, times the weights.
    rigid : ndarray, shape (n_free, k), or None
        Motions of the membrane as a whole that nothing resists, see :mod:`.floating`.
    spin : ndarray, shape (n_free,), or None
        The mass times the motion of the material in itself that costs nothing, see :func:`_spin`: perturbations are orthogonal to it.
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

    def pencil(self, constraint: Array | None = None) -> Pencil:
        """K - lambda M, motions that cost nothing taken out."""
        return pencil_of(self.band, self.mass, self.half_bandwidth, self.spin if constraint is None else constraint, 0.0, self.rigid)

    def shape(self, mode: Array) -> dict[str, Array]:
        """A mode at the nodes, see :func:`azimuthal_shape`."""
        return azimuthal_shape(self.space, self.n, mode)


class _Layout:
    """What depends on the space and on min(n, 2) alone: supports, numbering, tables, mass."""

    def __init__(self, space: Space, kind: int) -> None:
        degree, n_elements = space.degree, space.n_elements
        n_local = degree + 1
        nodes = space.nodes[degree * np.arange(n_elements) + np.arange(n_local)[:, None]]
        free, opposite = _supports(space, kind)
        self.n_free = int(free.sum())
        self.numbers: NDArray[np.int64] = np.full((space.n_nodes, 3), self.n_free, dtype=np.int64)
        self.numbers[free] = np.arange(self.n_free)
        self.numbers[opposite, _C // 2] = self.numbers[opposite, _A // 2]
        #: local row of c and element where c = -a on the axis
        self.flips = [(n_local, 0) if node == 0 else (2 * n_local - 1, n_elements - 1) for node in opposite]
        self.gather = np.concatenate([self.numbers[nodes, k] for k in range(3)])
        open_curve = min((3 if kind else 2) * degree + (2 if kind else 1), max(self.n_free - 1, 0))
        self.half_bandwidth = band_of(self.gather, self.n_free) if space.closed else open_curve
        self._tabulate(space)
        area = space.weights * space.R * np.hypot(space.R_x, space.Z_x)
        zero = np.zeros_like(area)
        self.mass = self.assemble(np.stack([area if i == j and i in (_A, _C, _B) else zero for i, j in _PAIRS]))
        self.mass.flags.writeable = False
        points = (space.interpolation_points()[:, 0] - space.mesh.breakpoints()[0]) / np.diff(space.mesh.breakpoints())[0]
        self.node_values = space.shape_functions(points)[0]

    def _tabulate(self, space: Space) -> None:
        n_local = space.degree + 1
        rows = np.zeros((6, space.n_quadrature, 3 * n_local))
        for field in range(3):
            columns = slice(field * n_local, (field + 1) * n_local)
            rows[2 * field, :, columns] = space.table[: space.n_quadrature, :n_local]
            rows[2 * field + 1, :, columns] = space.table[space.n_quadrature : 2 * space.n_quadrature, :n_local]
        self._values = space.table[: space.n_quadrature, :n_local]
        outer = []
        for i, j in _PAIRS:
            product = np.einsum("qa,qb->abq", rows[i], rows[j])
            outer.append(product if i == j else product + product.transpose(1, 0, 2))
        self._table = np.ascontiguousarray(np.stack(outer, axis=2).reshape((3 * n_local) ** 2, -1))
        kd, depth = self.half_bandwidth, 3 * self.half_bandwidth + 1
        row, column = np.broadcast_arrays(self.gather[:, None, :], self.gather[None, :, :])
        inside = (row < self.n_free) & (column < self.n_free)
        self._band_index = np.where(inside, column * depth + 2 * kd + row - column, self.n_free * depth).ravel()

    def assemble(self, density: Array) -> Array:
        """Integrate second derivatives in the order of _PAIRS, shape (18, n_quadrature, n_elements), to a band matrix."""
        n_elements, n_local = density.shape[-1], self.gather.shape[0]
        local = (self._table @ density.reshape(-1, n_elements)).reshape(n_local, n_local, n_elements)
        for row, element in self.flips:
            local[row, :, element] *= -1
            local[:, row, element] *= -1
        depth = 3 * self.half_bandwidth + 1
        flat: Array = np.bincount(self._band_index, local.ravel(), self.n_free * depth + 1)  # type: ignore[assignment]  # weighted: floats
        return flat[:-1].reshape(self.n_free, depth).T

    def integrate(self, density: Array) -> Array:
        """Integrate densities of (a, c, b), shape (3, n_quadrature, n_elements), against the shape functions."""
        local = np.concatenate([self._values.T @ part for part in density])
        for row, element in self.flips:
            local[row, element] *= -1
        total: Array = np.bincount(self.gather.ravel(), local.ravel(), self.n_free + 1)  # type: ignore[assignment]  # weighted: floats
        return total[: self.n_free]

    def local(self, mode: Array) -> Array:
        """Coefficients of (a, c, b) in each element, shape (3 (degree + 1), n_elements)."""
        local = np.append(mode, 0.0)[self.gather]
        for row, element in self.flips:
            local[row, element] *= -1
        return local


@lru_cache(maxsize=32)
def _layout(space: Space, kind: int) -> _Layout:
    return _Layout(space, kind)


def _supports(space: Space, kind: int) -> tuple[NDArray[np.bool_], list[int]]:
    """Free fields (a, c, b) of each node, and the nodes on the axis at which c = -a.

    What a clamp holds of u it holds of both in-plane displacements. On the axis a smooth vector field has no in-plane part at n = 0, a
    constant in-plane part at n = 1, and vanishes for larger n. Rigid motions that the supports leave cost nothing and are no
    perturbations: one node is held against them, which takes none of the others away.
    """
    free = np.ones((space.n_nodes, 3), dtype=bool)
    opposite = []
    for node, support, on_axis in zip(space.nodes[[0, -1]].tolist(), space.supports, space.on_axis.tolist(), strict=False):
        in_plane, vertical = "u" not in support.held, "w" not in support.held
        if on_axis:
            rigid = kind == 1 and vertical  # a pole that is held vertically is a fixed point
            free[node] = [rigid, False, kind == 0 and vertical]
            opposite += [node] if rigid else []
        else:
            free[node] = [in_plane, in_plane, vertical] if kind == 0 or not support.rigid else False
    pinned = space.nodes[space.widest]
    if kind == 0:
        free[:, _C // 2] = False
        if space.pin is not None:
            free[pinned, _B // 2] = False
    if kind == 1:  # at this radius a shift is seen in c, a tilt in b
        shift, tilt = space.rotations
        free[pinned, _C // 2] &= not shift
        free[pinned, _B // 2] &= not tilt
    return free, opposite


def azimuthal_shape(space: Space, n: int, mode: Array) -> dict[str, Array]:
    """A mode at the nodes along the meridian: r (reference radius), u (radial), c (circumferential), w (vertical)."""
    layout = _layout(space, min(n, 2))
    nodes = layout.node_values @ layout.local(mode).reshape(3, space.degree + 1, -1)
    a, c, b = np.concatenate([nodes[:, :-1].transpose(0, 2, 1).reshape(3, -1), nodes[:, -1, -1:]], axis=1)
    return {"r": space.mesh.position(space.node_parameters())[0], "u": a, "c": c, "w": b}


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
    _check_waves(n, 0)
    space = potential.space
    layout = _layout(space, min(n, 2))
    response = _response_at_quadrature(potential, np.asarray(x, dtype=float).tobytes())
    density = np.stack(_density(space, response, potential.loads, pressure, n))
    band = layout.assemble(density)
    for end in space.free_ends if n else ():
        rho = space.mesh.position(space.ends[[end]])[0] + space.evaluate(x, space.ends[[end]])[0]
        i, j = layout.numbers[space.nodes[end], [_A // 2, _B // 2]]
        work = np.pi * n * pressure * float(rho[0]) * (space.side if end == 0 else -space.side)  # of the film across a free edge
        for row, column in ((i, j), (j, i)) if j < layout.n_free else ():  # b may be held there against a tilt of the whole
            band[2 * layout.half_bandwidth + row - column, column] += work
    rigid, spin = None, None
    motions = _rigid_motions(space, response, int(n))
    if len(motions):
        area = space.area_weights
        rigid = rigid_part(np.stack([layout.integrate(motion * area) for motion in motions], axis=1), _products(motions, motions, area))
    if n == 1 and space.spins:
        spin = _spin(space, layout, response, motions, pencil_of(band, layout.mass, layout.half_bandwidth, None, 0.0, rigid))
    return AzimuthalOperator(band, layout.mass, layout.half_bandwidth, layout.numbers, int(n), response, space, density, rigid, spin)


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


def _spin(space: Space, layout: _Layout, r: LocalResponse, rigid: Array, pencil: Pencil) -> Array | None:
    """The mass times the motion of a sphere's material in itself under its deformed shape; None where it is a rigid one.

    Turned about an axis through its equator, a uniform sphere is the same sphere: whatever is integrated over its reference area, energies
    of sources and loads included, stays as it is when the material moves along so. With v = (v_S, v_theta) the velocities of that rotation
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


@lru_cache(maxsize=4)
def _response_at_quadrature(potential: Potential, state: bytes) -> LocalResponse:
    """Remembered for the other n of the same state."""
    space = potential.space
    displacement = space.at_quadrature(np.frombuffer(state)).reshape(4, space.n_quadrature, -1)
    return local_response(potential, (space.R, space.R_x, space.Z, space.Z_x), tuple(displacement))


def _check_waves(n: int, least: int) -> None:
    if isinstance(n, bool) or not isinstance(n, (int, np.integer)) or n < least:
        raise InputError("azimuthal", n, f"a whole number >= {least} is allowed")


def _density(space: Space, r: LocalResponse, loads: Sequence[Load], pressure: float, n: int) -> list[Array]:
    """Second derivatives of the quadratic form at the points, times the weights, in the order of _PAIRS."""
    J = np.hypot(space.R_x, space.Z_x)
    area = space.weights * space.R * J
    xx, xo, oo = area / J**2, area / (J * space.R), area / space.R**2  # of two slopes, a slope and a value, two values
    inside = space.weights * space.side
    g, g_z, g_zz = (part * inside for part in over_projection(loads, r.eta))
    t, z = r.t_rho, r.t_z
    A, B, N1, N2 = r.A, r.B, r.N1, r.N2
    along, out, across = A * t**2 + N2 * z**2, A * z**2 + N2 * t**2, (A - N2) * t * z  # of e, of f, mixed
    _, m_r, _, m_rr, m_rz, m_zz = r.field
    entries = {
        (_A, _A): (r.W22 + n**2 * along) * oo + m_rr * area,
        (_A, _AX): r.W12 * t * xo,
        (_A, _C): n * (r.W22 + along) * oo,
        (_A, _CX): -n * B * t * xo,
        (_A, _B): n**2 * across * oo + m_rz * area,
        (_A, _BX): r.W12 * z * xo,
        (_AX, _AX): (r.W11 * t**2 + N1 * z**2) * xx,
        (_AX, _C): n * r.W12 * t * xo,
        (_AX, _BX): (r.W11 - N1) * t * z * xx,
        (_C, _C): (n**2 * r.W22 + along) * oo + m_r / r.rho * area,
        (_C, _CX): -B * t * xo,
        (_C, _B): n * across * oo,
        (_C, _BX): n * r.W12 * z * xo,
        (_CX, _CX): A * xx,
        (_CX, _B): -n * B * z * xo,
        (_B, _B): n**2 * out * oo + m_zz * area + g_zz * r.rho * r.rho_x,
        (_BX, _BX): (r.W11 * z**2 + N1 * t**2) * xx,
    }
    parts = [_volume_density(space, r, -pressure * inside, n)]
    if loads:
        parts.append(_projected_density(r, g, g_z, n))
    for pair, part in (item for added in parts for item in added.items()):
        entries[pair] = entries[pair] + part if pair in entries else part
    return [entries.get(pair, np.zeros_like(area)) for pair in _PAIRS]


def _volume_density(space: Space, r: LocalResponse, work: Array, n: int) -> dict[tuple[int, int], Array]:
    """Second derivatives of the enclosed volume over 2 pi, times ``work``."""
    if space.lids and (n == 0 or space.spreads):
        return {
            (_A, _A): -work * r.eta_x,
            (_A, _C): -n * work * r.eta_x,
            (_A, _BX): -work * r.rho,
            (_C, _C): -work * r.eta_x,
            (_C, _B): n / 2 * work * r.rho_x,
            (_C, _BX): -n / 2 * work * r.rho,
            (_CX, _B): -n / 2 * work * r.rho,
        }
    return _projected_density(r, work * r.eta, work, n)


def _projected_density(r: LocalResponse, g: Array, g_z: Array, n: int) -> dict[tuple[int, int], Array]:
    """Second derivatives of an energy g(eta) over the projected area, but for those of g', from weighted g and g' at the points."""
    return {
        (_A, _AX): g,
        (_A, _CX): n * g,
        (_A, _B): g_z * r.rho_x,
        (_AX, _C): n * g,
        (_AX, _B): g_z * r.rho,
        (_C, _CX): g,
        (_C, _B): n * g_z * r.rho_x,
    }


@one_thread
def azimuthal_eigenvalue(potential: Potential, x: Array, pressure: float, n: int, guess: Array | None = None) -> SmallestEigenvalue:
    """Smallest eigenvalue against n waves around the axis, proved by inertia to be the smallest.

    ``guess`` is the ``mode`` of a neighbouring state at the same n. See :func:`azimuthal_verdict` for states with a compressive stress,
    where no eigenvalue has a meaning.

    Raises
    ------
    InputError, SpectrumError
    """
    return _smallest(azimuthal_operator(potential, x, pressure, n), guess)


def _smallest(operator: AzimuthalOperator, guess: Array | None) -> SmallestEigenvalue:
    if not operator.band.shape[1]:
        raise InputError("mesh.elements", 1, "one linear element has no unknowns with waves around the axis; two, or degree 2, are allowed")
    start = _Spectrum(operator, None).first_guess() if guess is None else guess
    return smallest_of(operator.pencil(), start)


class _Spectrum:
    """The pencil (K, M), with constraint . phi = 0 if given."""

    def __init__(self, operator: AzimuthalOperator, constraint: Array | None) -> None:
        self.pencil = operator.pencil(constraint)
        self.band, self.kd, self.constraint = operator.band, operator.half_bandwidth, constraint
        self.n = int(operator.band.shape[1])
        self.scale = self.pencil.scale

    def count(self, shift: float) -> int:
        """Number of eigenvalues below a shift, by inertia."""
        return self.pencil.count(shift)

    def lower_bound(self) -> float:
        """A shift below the spectrum."""
        shift = 0.0
        while self.count(shift) > 0:
            shift = min(4 * shift, -1.0)
            if shift < -1e3 * self.scale:
                raise SpectrumError("the second variation has no lower bound within reach")
        return shift

    def first_guess(self, width: int = 6, iterations: int = 3) -> Array:
        """Best vector of a block of inverse iterations: the lowest azimuthal eigenvalues are too close together for a single vector."""
        solver = self.pencil.shifted_solver(self.lower_bound())  # only without a constraint
        block = np.random.default_rng(0).standard_normal((self.n, min(width, self.n)))

        def times(product: Callable[[Array], Array]) -> Array:
            return np.stack([product(column) for column in block.T], axis=1)

        for _ in range(iterations):
            block = np.linalg.qr(self.pencil.solve(solver, times(self.pencil.times_mass)))[0]
        return np.asarray(block @ eigh(block.T @ times(self._stiffness), block.T @ times(self.pencil.times_mass))[1][:, 0])

    def _stiffness(self, x: Array) -> Array:
        return band_product(self.band, self.kd, x)

    def lanczos(self, count: int, width: int) -> list[tuple[float, Array]]:
        """Shift-invert Lanczos iterations from a certified lower bound."""
        shift = self.lower_bound()
        solver = self.pencil.shifted_solver(shift)

        def inverse(right: Array) -> Array:
            return self.pencil.solve(solver, right.ravel())

        def operator(matvec: Callable[[Array], Array]) -> LinearOperator:
            return LinearOperator((self.n, self.n), matvec=matvec, dtype=float)

        stiffness, mass = (operator(partial(_flat, product)) for product in (self._stiffness, self.pencil.times_mass))
        start = inverse(np.random.default_rng(0).standard_normal(self.n))
        try:
            values, modes = eigsh(stiffness, k=count, M=mass, sigma=shift, OPinv=operator(inverse), v0=start, ncv=width, tol=1e-12)
        except ArpackNoConvergence as error:
            raise SpectrumError(f"Lanczos iterations did not converge: {error}") from error
        return [(float(values[k]), self.normalised(modes[:, k])) for k in np.argsort(values)]

    def normalised(self, mode: Array) -> Array:
        """With mode . M mode = 1, the largest entry positive."""
        size = np.sqrt(mode @ self.pencil.times_mass(mode))
        return mode / (size * np.sign(mode[np.argmax(np.abs(mode))]))


def _flat(product: Callable[[Array], Array], x: Array) -> Array:
    return product(x.ravel())


@one_thread
def lowest_eigenvalues(
    potential: Potential, x: Array, pressure: float, n: int, count: int = 4, control: str = "pressure"
) -> list[tuple[float, Array]]:
    """The lowest eigenvalues and modes against n waves around the axis, proved complete by inertia.

    An eigenvalue is a squared natural frequency, omega = sqrt(lambda), in units of sqrt(mu/rho_m)/R0 with rho_m the mass density.

    Parameters
    ----------
    potential, x, pressure, n : as in :func:`azimuthal_operator`
    count : int
        How many, each counted with its multiplicity.
    control : {"pressure", "volume"}
        Makes a difference for n = 0 only: other perturbations leave the volume unchanged to first order.

    Returns
    -------
    list of (float, ndarray of shape (n_free,))
        In increasing order; modes are normalised in M, and :meth:`AzimuthalOperator.shape` gives them at the nodes.

    Raises
    ------
    InputError
    SpectrumError
        When the eigenvalues found cannot be proved to be the lowest.
    """
    if control not in ("pressure", "volume"):
        raise unknown_name("control", control, ("pressure", "volume"))
    operator = azimuthal_operator(potential, x, pressure, n)
    size = operator.band.shape[1]
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or not 1 <= count < size - 1:
        raise InputError("count", count, f"a whole number from 1 to {size - 2} is allowed")
    constraint = potential.evaluate(x, pressure).volume_gradient if n == 0 and control == "volume" else None
    spectrum = _Spectrum(operator, constraint)
    for width in (max(2 * count + 1, 20), max(4 * count + 1, 60)):
        found = spectrum.lanczos(int(count), min(width, size))
        # all that lies clearly below the last one must have been found
        shift = found[-1][0] - max(1e-6 * abs(found[-1][0]), 1e-12 * spectrum.scale)
        if spectrum.count(shift) == sum(value < shift for value, _ in found):
            return found
    raise SpectrumError(f"the {count} eigenvalues found could not be proved to be the lowest")


@one_thread
def azimuthal_verdict(potential: Potential, x: Array, pressure: float, n: int, guess: Array | None = None) -> Verdict:
    """Verdict against n >= 1 waves around the axis; the same under pressure and volume control.

    Parameters
    ----------
    potential, x, pressure, n : as in :func:`azimuthal_operator`
    guess : ndarray, optional
        ``coefficients`` of the verdict of a neighbouring state at the same n.

    Raises
    ------
    InputError
        For n that is no whole number >= 1.
    SpectrumError
    """
    _check_waves(n, 1)
    operator = azimuthal_operator(potential, x, pressure, n)
    evaluation = potential.evaluate(np.asarray(x, dtype=float), pressure)
    wrinkles = short_waves(potential, operator, evaluation)
    if wrinkles:
        return Verdict(False, np.nan, np.nan, None, operator.n, None, f"short-wave unstable (wrinkling): {wrinkles}")
    found = _smallest(operator, guess)
    shape = partial(azimuthal_shape, potential.space, operator.n)
    # compression that is the mesh's alone says that the mesh is not to be trusted
    false = not potential.scene.tension_field and any(least_stress(evaluation, component) for component in (0, 1))
    part = np.inf if false else _unresolved(potential.space, operator, found.mode)
    return verdict_from(found, against(None, operator.n), None, operator.n, shape, part)


def _unresolved(space: Space, operator: AzimuthalOperator, mode: Array) -> float:
    """:func:`.resolution.unresolved` of a mode."""
    layout = _layout(space, min(operator.n, 2))
    local = space.table[: 2 * space.n_quadrature, : space.degree + 1] @ layout.local(mode).reshape(3, space.degree + 1, -1)
    local = local.reshape(6, *space.R.shape)
    stress = np.stack([operator.response.s1, operator.response.s2])
    return unresolved(space, operator.density, _PAIRS, local, stress)


def mode_in(space: Space, n: int, mode: Array, onto: Space) -> Array:
    """Coefficients in another space of the interpolant of a mode."""
    kind = min(n, 2)
    source, target = _layout(space, kind), _layout(onto, kind)
    points = onto.interpolation_points()
    element, xi = space.locate(points.ravel())
    fields = source.local(mode).reshape(3, space.degree + 1, -1)[:, :, element]
    values = np.einsum("qa,faq->fq", space.shape_functions(xi)[0], fields).reshape(3, *points.shape)
    local = np.concatenate(onto.from_values @ values)
    for row, at in target.flips:
        local[row, at] *= -1
    coefficients = np.zeros(target.n_free + 1)
    coefficients[target.gather] = local
    return coefficients[:-1]


def short_waves(potential: Potential, operator: AzimuthalOperator, evaluation: Evaluation) -> str:
    """Where ever shorter waves have ever lower eigenvalues at this n; empty if nowhere.

    A principal mechanical stress is compressive, so that the Legendre-Hadamard condition fails. In a tension field no stress is; there the
    meridional one may vanish, while without hoop stress the operator of one n is as good as any.
    """
    if potential.scene.tension_field:
        return str(ill_posed(potential, evaluation) or "")
    found = []
    for component, (name, lines) in enumerate((("meridional", "circles"), ("hoop", "meridians"))):
        zone = compressed(potential, evaluation, component)
        if zone is not None:
            found.append(f"{name} stress compressive at {interval(*zone)}: wrinkles along {lines}")
    return "; ".join(found)
