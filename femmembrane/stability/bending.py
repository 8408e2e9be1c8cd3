"""Bending in the second variation: what keeps short waves from costing ever less where the membrane is compressed.

A membrane has no bending stiffness, so that under a compressive stress ever shorter waves have ever lower eigenvalues. The sheet of finite
thickness has a small one. It is added to the second variation about a state, and leaves the state alone: base states stay those of the
membrane. With k the change of the second fundamental form of the deformed surface, in the frame of its lines of curvature, the energy per
reference area and over mu T is half of ::

    (T/R0)^2/12 l3^2 [ D_11 k_11^2 + 2 D_12 k_11 k_22 + D_22 k_22^2 + D_66 k_12^2 ]
    D_11 = l1^2 W_11,   D_12 = l1 l2 W_12,   D_22 = l2^2 W_22,   D_66 = 2 (l1^2 + l2^2) A - (s_1 + s_2)

Normals stay straight and normal (Kirchhoff), and a layer at the height zeta of the deformed sheet, of thickness l3 T, meets the strains
-zeta k with the moduli of the stretched material. The stresses themselves add terms of the order (l3 T k)^2 beside what they do in the
membrane, which are left out. At small strains this is the plate with B = mu T^3/3 and nu = 1/2::

    B/2 [ (k_11 + k_22)^2 - 2 (1 - nu) (k_11 k_22 - k_12^2) ]

For the displacement u of :mod:`.second_variation`, with the unit normal nu and the arc length s of the deformed meridian::

    k_11 = nu.u_ss,    k_22 = nu.u_thth/rho^2 + rho_s/rho nu.u_s,    k_12 = (nu.u_sth - rho_s/rho nu.u_th)/rho

which vanish for all rigid motions (Koiter 1966). The moment that the base state's own curvature would have is left out: it is of the order
of the thickness over the radius of curvature beside what stands here.

Elements are continuous and their slopes are not, so that the second derivatives are those of an interior penalty method (Brenner and Sung
2005): with the turn phi = nu.u_s of the meridian and its moment m = D_11 k_11 + D_12 k_22, every end of elements adds {m} [phi] twice and a
penalty on [phi]^2. The same terms hold the turn where an end does not allow one: at all supports but a free edge, and at a pole for n != 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..discretization.elements import lagrange
from ..discretization.space import Space
from ..physics.kinematics import hencky_strains
from ..potential import Array, Potential
from ..solve.banded import band_product
from ..solve.pull_in import moduli
from .second_variation import response_at_quadrature
from .wave_unknowns import WaveUnknowns, wave_unknowns

#: the penalty over its least value for which the form stays positive on any mesh is PENALTY/2 for inner ends, PENALTY/4 for held ones
PENALTY = 5.0

#: what stands at a side of a joint where the membrane ends
_NOTHING = -1


@dataclass(frozen=True, eq=False)
class Geometry:
    """A deformed meridian and the moduli of bending at points, all but the moduli of shape (..., n_elements).

    Attributes
    ----------
    rho, speed, turning : radius, length of the tangent, and derivative of that length along the reference element
    t_rho, t_z : unit tangent
    stiffness : ndarray, shape (4, ..., n_elements)
        D_11, D_12, D_22, D_66 times (T/R0)^2/12 l3^2 and the density of the reference area along the reference element.
    """

    rho: Array
    speed: Array
    turning: Array
    t_rho: Array
    t_z: Array
    stiffness: Array


@dataclass(frozen=True, eq=False)
class Bending:
    """The quadratic form of bending at n waves around the axis.

    Attributes
    ----------
    half_bandwidth : int
        Joints couple the unknowns of two elements, so that it is about twice that of the membrane.
    band : ndarray, shape (3 half_bandwidth + 1, n_free)
    positive : bool
        Whether every change of curvature costs energy: with a strain energy that is convex in the stretches.
    """

    half_bandwidth: int
    band: Array
    positive: bool
    _curvatures: Array
    _stiffness: Array
    _jumps: Array
    _moments: Array
    _penalties: Array
    _layout: WaveUnknowns
    _joints: NDArray[np.int64]

    def added_to(self, band: Array, half_bandwidth: int) -> Array:
        """A band matrix of another half bandwidth plus this one."""
        return widened(band, half_bandwidth, self.half_bandwidth) + self.band

    def energy(self, mode: Array) -> float:
        """Twice the energy of a mode."""
        return float(mode @ band_product(self.band, self.half_bandwidth, mode))

    def densities(self, mode: Array) -> tuple[Array, float]:
        """The energy of a mode at the quadrature points, times the weights and twice, and the sum of the sizes of what joints add."""
        local = np.append(mode, 0.0)[self._layout.gather]  # the signs of flips are in the rows
        k11, k22, k12 = np.einsum("iqae,ae->iqe", self._curvatures, local)
        d11, d12, d22, d66 = self._stiffness
        inside = d11 * k11**2 + 2 * d12 * k11 * k22 + d22 * k22**2 + d66 * k12**2
        both = np.concatenate([local[:, self._joints[:, 0]], local[:, self._joints[:, 1]]])
        jump, moment = np.einsum("aj,aj->j", self._jumps, both), np.einsum("aj,aj->j", self._moments, both)
        return inside, float(np.abs(2 * jump * moment).sum() + (self._penalties * jump**2).sum())


def widened(band: Array, half_bandwidth: int, to: int) -> Array:
    """A band matrix in the storage of a larger half bandwidth."""
    wide = np.zeros((3 * to + 1, band.shape[1]), order="F")
    wide[2 * to - half_bandwidth : 2 * to + half_bandwidth + 1] = band[half_bandwidth:]
    return wide


class BendingForm:
    """What the bending of a state has in common for all n."""

    def __init__(self, potential: Potential, x: Array) -> None:
        space = potential.space
        self.space = space
        self._inside = _geometry(potential, x)
        self._ends = _at_ends(space, self._inside)
        value, slope = space.shape_functions(space.points)
        self._at_points = value, slope, space.second_derivatives(space.points)
        corners = np.array([0.0, 1.0])
        self._at_corners = *space.shape_functions(corners), space.second_derivatives(corners)

    @property
    def positive(self) -> bool:
        """See :class:`Bending`."""
        d11, d12, d22, d66 = self._inside.stiffness
        return bool(((d11 > 0) & (d66 > 0) & (d11 * d22 > d12**2)).all())

    @property
    def moduli(self) -> Array:
        """D_11, D_12, D_22 and D_66 times (T/R0)^2/12 l3^2, per reference area."""
        space = self.space
        return self._inside.stiffness / (2 * np.pi * space.R * np.hypot(space.R_x, space.Z_x))

    @property
    def curvatures(self) -> tuple[Array, Array]:
        """The principal curvatures of the state, along the meridian and around the axis, without their signs."""
        inside = self._inside
        turn = _derivative(tuple(self.space.points.tolist())) @ np.stack([inside.t_rho, inside.t_z])
        return np.hypot(*turn) / inside.speed, np.abs(inside.t_z) / inside.rho

    def at(self, n: int) -> Bending:
        """The form at n waves."""
        kind = min(n, 2)
        layout = wave_unknowns(self.space, kind)
        pattern = _pattern(self.space, kind)
        curvatures = _curvatures(self._inside, self._at_points, n)
        at_ends, phi = _curvatures(self._ends, self._at_corners, n), _turns(self._ends, self._at_corners)
        moment = self._ends.stiffness[0][:, None] * at_ends[0] + self._ends.stiffness[1][:, None] * at_ends[1]
        moment /= self._ends.speed[:, None]  # of the turn as a function of the reference element
        for rows in (curvatures, phi, moment):
            for row, element in layout.flips:
                rows[..., row, element] *= -1
        stiffness = self._inside.stiffness * (self.space.weights[:, :1] / (2 * np.pi))
        local = _products(curvatures, stiffness)
        jumps, moments, penalties = self._joints(pattern.joints, phi, moment)
        outer = jumps[:, None] * (moments + penalties / 2 * jumps)
        joint = outer + outer.transpose(1, 0, 2)
        entries = np.concatenate([local.ravel(), joint.ravel()])
        total: Array = np.bincount(pattern.index, entries, pattern.size + 1)  # type: ignore[assignment]  # weighted: floats
        kd = pattern.half_bandwidth
        band = np.asfortranarray(total[:-1].reshape(layout.n_free, 3 * kd + 1).T)
        return Bending(kd, band, self.positive, curvatures, stiffness, jumps, moments, penalties, layout, pattern.joints)

    def _joints(self, joints: NDArray[np.int64], phi: Array, moment: Array) -> tuple[Array, Array, Array]:
        """[phi] and {m} as rows over the unknowns of the elements on both sides, and the penalty, of each joint."""
        left, right = joints.T
        before, after = left != _NOTHING, right != _NOTHING
        share = np.where(before & after, 0.5, 1.0)
        jump = np.concatenate([-phi[1][:, left] * before, phi[0][:, right] * after])
        mean = np.concatenate([moment[1][:, left] * before, moment[0][:, right] * after]) * share
        stiffness = (self._inside.stiffness[0] / self._inside.speed**2).max(axis=0)
        largest = np.maximum(stiffness[left] * before, stiffness[right] * after)
        return jump, mean, PENALTY / share * self.space.degree**2 * largest


@lru_cache(maxsize=4)
def _form_of(potential: Potential, state: bytes) -> BendingForm:
    return BendingForm(potential, np.frombuffer(state))


def bending_form(potential: Potential, x: Array) -> BendingForm | None:
    """The bending of a state, remembered for other n; None where the scene has none."""
    return _form_of(potential, np.asarray(x, dtype=float).tobytes()) if potential.scene.bending else None


def _geometry(potential: Potential, x: Array) -> Geometry:
    space, scene = potential.space, potential.scene
    u, u_x, _, w_x = space.displacement_at_quadrature(x)
    e1, e2 = hencky_strains(space.R, space.R_x, space.Z_x, u, u_x, w_x)
    square = None if potential.electric is None else np.zeros_like(e1)  # the moduli of the material alone
    s1, s2, *_ = potential.response(e1, e2, square).reshape(5, *e1.shape)
    d11, d22, mixed, shear = moduli(potential, e1, e2, square)
    shear = np.cosh(e1 - e2) * shear
    ratio = getattr(scene.material, "volume_ratio", None)
    through = np.exp(-e1 - e2) * (1.0 if ratio is None else ratio(e1, e2))
    thickness, modulus = (1.0, 1.0) if potential.sheet is None else potential.sheet.factors(space.R, space.Z, space.s)
    factor = 2 * np.pi * space.R * np.hypot(space.R_x, space.Z_x) * thickness**3 * modulus
    factor = factor * through**2 / (12 * scene.radius_to_thickness**2)
    stiffness = np.stack([d11, mixed - shear + (s1 + s2) / 2, d22, 4 * shear - (s1 + s2)]) * factor
    response = response_at_quadrature(potential, np.asarray(x, dtype=float).tobytes())
    return _with_turning(space, response.rho, response.rho_x, response.eta_x, stiffness)


def _with_turning(space: Space, rho: Array, rho_x: Array, eta_x: Array, stiffness: Array) -> Geometry:
    """Derivatives of the tangent are those of the polynomial through the points of an element."""
    speed = np.hypot(rho_x, eta_x)
    derive = _derivative(tuple(space.points.tolist()))
    t_rho, t_z = rho_x / speed, eta_x / speed
    return Geometry(rho, speed, t_rho * (derive @ rho_x) + t_z * (derive @ eta_x), t_rho, t_z, stiffness)


def _at_ends(space: Space, inside: Geometry) -> Geometry:
    """Both ends of each element, by polynomials through its points; the stiffness vanishes where the meridian meets the axis."""
    ends = np.array([0.0, 1.0])
    to_ends = lagrange(np.repeat(space.points[:, None], 2, axis=1), ends).T
    derive = _derivative(tuple(space.points.tolist()))
    slopes = inside.speed * inside.t_rho, inside.speed * inside.t_z
    (rho_x, rho_xx), (eta_x, eta_xx) = ((to_ends @ part, to_ends @ derive @ part) for part in slopes)
    rho, stiffness = to_ends @ inside.rho, np.stack([to_ends @ part for part in inside.stiffness])
    speed = np.hypot(rho_x, eta_x)
    for k in (0, -1):
        if space.on_axis[k] and not space.closed:
            rho[k, k], stiffness[:, k, k] = 1.0, 0.0
    return Geometry(rho, speed, (rho_x * rho_xx + eta_x * eta_xx) / speed, rho_x / speed, eta_x / speed, stiffness)


@lru_cache(maxsize=8)
def _derivative(points: tuple[float, ...]) -> Array:
    """Derivatives at points of the polynomial through its values there."""
    x, most = 2 * np.array(points) - 1, len(points) - 1
    series = np.linalg.inv(np.polynomial.legendre.legvander(x, most))
    return np.asarray(np.polynomial.legendre.legval(x, 2 * np.polynomial.legendre.legder(series)).T)


def _curvatures(g: Geometry, tables: tuple[Array, Array, Array], n: int) -> Array:
    """k_11, k_22 and k_12 as rows over the coefficients of (a, c, b), shape (3, n_points, 3 (degree + 1), n_elements)."""
    value, slope, second = (table[:, :, None] for table in tables)
    rho, speed = g.rho[:, None], g.speed[:, None]
    t, turning = g.t_rho[:, None], g.turning[:, None]
    zero = np.zeros(np.broadcast_shapes(value.shape, rho.shape))
    along, per_length = (second - turning / speed * slope) / speed**2, slope / speed
    rows = []
    for field, normal in enumerate((-g.t_z[:, None], -g.t_z[:, None], t)):  # nu_rho acts on a and on c
        if field == 1:
            k11, k22 = zero, -2 * n * normal * value / rho**2
            k12 = normal * (t / rho * value - per_length) / rho
        else:
            k11 = normal * along
            k22 = normal * (t / rho * per_length - (n**2 + (field == 0)) * value / rho**2)
            k12 = n * normal * (t / rho * value - per_length) / rho
        rows.append(np.stack([k11, k22, k12]))
    return np.concatenate(rows, axis=2)


def _products(curvatures: Array, stiffness: Array) -> Array:
    """The matrices of the elements, shape (n_local, n_local, n_elements)."""
    k11, k22, k12 = curvatures
    d11, d12, d22, d66 = stiffness[:, :, None]
    moments = np.stack([d11 * k11 + d12 * k22, d12 * k11 + d22 * k22, d66 * k12])
    first, second = (part.transpose(3, 2, 0, 1).reshape(part.shape[3], part.shape[2], -1) for part in (curvatures, moments))
    return np.asarray((first @ second.transpose(0, 2, 1)).transpose(1, 2, 0))


def _turns(g: Geometry, tables: tuple[Array, Array, Array]) -> Array:
    """phi = nu.u_s as rows, shape (n_points, 3 (degree + 1), n_elements)."""
    per_length = tables[1][:, :, None] / g.speed[:, None]
    return np.concatenate([-g.t_z[:, None] * per_length, 0 * per_length, g.t_rho[:, None] * per_length], axis=1)


@dataclass(frozen=True, eq=False)
class _Pattern:
    """Joints (elements before and after) and where the entries of local matrices stand in the band."""

    joints: NDArray[np.int64]
    half_bandwidth: int
    index: NDArray[np.int64]
    size: int


@lru_cache(maxsize=32)
def _pattern(space: Space, kind: int) -> _Pattern:
    layout, count = wave_unknowns(space, kind), space.n_elements
    joints = [(k - 1, k) for k in range(1, count)]
    if space.closed:
        joints.append((count - 1, 0))
    else:
        held = [kind != 1 if pole else bool(end.held) for pole, end in zip(space.on_axis, space.supports, strict=True)]
        joints += [(_NOTHING, 0)] * held[0] + [(count - 1, _NOTHING)] * held[1]
    pairs = np.array(joints, dtype=np.int64).reshape(-1, 2)
    gather, spare = layout.gather, layout.n_free
    both = np.concatenate([np.where(side != _NOTHING, gather[:, side], spare) for side in pairs.T])
    blocks = [np.broadcast_arrays(numbers[:, None, :], numbers[None, :, :]) for numbers in (gather, both)]
    free = [(row < spare) & (column < spare) for row, column in blocks]
    kd = max(int(np.abs(row - column)[inside].max(initial=0)) for (row, column), inside in zip(blocks, free, strict=True))
    kd = max(kd, layout.half_bandwidth)
    depth = 3 * kd + 1
    places = [
        np.where(inside, column * depth + 2 * kd + row - column, spare * depth).ravel()
        for (row, column), inside in zip(blocks, free, strict=True)
    ]
    return _Pattern(pairs, kd, np.concatenate(places), spare * depth)
