"""The total potential of a membrane before rigid bodies: gap_i(x) >= 0 at the nodes.

Why at nodes: the nodal forces of a uniform pressure are all positive there (1/6, 4/6, 1/6 of an element of degree 2), so that the sign
of the force that holds a node is the sign of the pressure beside it. Each constraint then takes the normal displacement of one node and no
more: with (u, w) = a t + b n at a held node, b = 0 is eliminated, and matrices keep their bands. Conditions at Gauss points, or weighed
ones (mortar), couple the nodes of an element. The one exception is a pole. Its nodal force of a uniform pressure is zero from degree 2 on,
as the weight R vanishes there. It is judged together with its neighbour.

A node is *held* where the force on it exceeds its stiffness times its gap (the primal-dual active set of Hintermüller, Ito and Kunisch,
SIAM J. Optim. 13 (2002)); at an equilibrium a held node has no gap and is pushed away from the body. On a fixed set of held nodes the
potential is a smooth one, :class:`Held`, with ::

    K = T^T (E'' - P V'' - sum force_i curvature_i t t^T) T,        force_i = n . (E' - P V')

where T leaves the tangential displacements of the held nodes. All that is asked of a potential, Newton steps, inertia, eigenvalues, is
asked of that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self, cast

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..kernels import kernels
from ..kernels.bordered import BorderedFactor, SpringFactor
from ..kernels.interface import Array, Border, Factor, Step
from ..physics.loads import over_projection
from ..physics.obstacles import ROUND_OFF, Straight
from ..threads import cached_property
from .evaluation import Evaluation
from .following import FollowingPotential, Mask
from .potential import Potential

if TYPE_CHECKING:
    from ..physics.obstacles import Obstacle
    from ..scene import Scene

#: force that holds a node, over the largest forces that meet at a node, that is round-off
NO_FORCE = 1e-11
#: and that is too little to say whether a perturbation would lift the node off
_WEAK = 1e-8
#: gap over the size of the membrane that a located touch may leave
_TOUCH = 1e-12
#: part of its neighbour's normal by which a node must be able to move for a body to hold it
ACROSS = 1e-6

#: keeps the distance from a centre differentiable
_TINY = 1e-300


@dataclass(frozen=True, eq=False, slots=True)
class Gaps:
    """Gaps at the nodes along the meridian that a body can hold, each of shape (n,).

    Attributes
    ----------
    gap : how far the node can move along its normal, negative inside a body
    n_rho, n_eta : unit normal in the motions that the node has
    curvature, circle : second derivatives of the gap along the tangent and, over the radius, around the axis
    close : whether the gap is round-off
    body : number of the nearest body
    """

    gap: Array
    n_rho: Array
    n_eta: Array
    curvature: Array
    circle: Array
    close: Mask
    body: NDArray[np.int64]


class Reduction:
    """Vectors and band matrices without the normal displacements of held nodes.

    Parameters
    ----------
    iu, iw : ndarray of int, shape (k,)
        Unknowns of the held nodes; n stands for none.
    n_rho, n_eta : ndarray, shape (k,)
        Their normals.
    size : int
        n, the number of unknowns.
    """

    def __init__(self, iu: NDArray[np.int64], iw: NDArray[np.int64], n_rho: Array, n_eta: Array, size: int) -> None:
        both = (iu < size) & (iw < size)
        self.size = size
        self.out = np.where(both, iw, np.minimum(iu, iw))  # the place that the normal displacement leaves empty
        self.iu, self.iw, self.n_rho, self.n_eta = iu[both], iw[both], n_rho[both], n_eta[both]

    def projected(self, v: Array) -> Array:
        """Rows of vectors, shape (..., n), without their normal parts at the held nodes."""
        v = v.copy()
        along = -v[..., self.iu] * self.n_eta + v[..., self.iw] * self.n_rho
        v[..., self.out] = 0.0
        v[..., self.iu], v[..., self.iw] = -along * self.n_eta, along * self.n_rho
        return v

    def reduced(self, v: Array) -> Array:
        """A vector, or columns of shape (n, k), in the unknowns that are left: the tangential one in the place of u, 0 in that of w."""
        v = v.copy()
        shape = (-1,) + (1,) * (v.ndim - 1)
        n_rho, n_eta = self.n_rho.reshape(shape), self.n_eta.reshape(shape)
        along = -v[self.iu] * n_eta + v[self.iw] * n_rho
        v[self.out] = 0.0
        v[self.iu] = along
        return v

    def expanded(self, v: Array) -> Array:
        """The displacement of what :meth:`reduced` answers."""
        v = v.copy()
        shape = (-1,) + (1,) * (v.ndim - 1)
        along = v[self.iu]
        v[self.out] = 0.0
        v[self.iu], v[self.iw] = -along * self.n_eta.reshape(shape), along * self.n_rho.reshape(shape)
        return v

    def band(self, band: Array, kd: int, diagonal: Array | None = None) -> Array:
        """A symmetric band matrix in the unknowns that are left; in the empty places a diagonal, left out: the largest one.

        The normal stiffness of a held node would not do: it vanishes where a stress does, and would stand among the eigenvalues.
        """
        n, depth = self.size, band.shape[0]
        flat = band.T.ravel().copy()  # A[i, j] at j depth + 2 kd + i - j

        def at(i: NDArray[np.int64], j: NDArray[np.int64]) -> NDArray[np.int64]:
            inside = (j >= 0) & (j < n) & (np.abs(i - j) <= kd)
            return np.where(inside, j * depth + 2 * kd + i - j, -1)

        near = np.arange(-kd - 1, kd + 2)
        flat = np.append(flat, 0.0)  # what lies outside of the band
        own = np.full(self.out.shape, np.abs(band[2 * kd]).max(initial=0.0)) if diagonal is None else diagonal
        if self.iu.size:
            others = self.iu[:, None] + near
            for order in (1, -1):  # rows, then columns
                u, w = ((at(k[:, None], others) if order > 0 else at(others, k[:, None])) for k in (self.iu, self.iw))
                mixed = -flat[u] * self.n_eta[:, None] + flat[w] * self.n_rho[:, None]
                flat[u] = mixed
                flat[-1] = 0.0
        others = self.out[:, None] + near
        flat[at(self.out[:, None], others)] = 0.0
        flat[at(others, self.out[:, None])] = 0.0
        flat[at(self.out, self.out)] = np.where(own > 0, own, 1.0)
        return flat[:-1].reshape(n, depth).T


class ReducedFactor:
    """Solver in the displacements that held nodes leave, from factors in the reduced unknowns."""

    def __init__(self, factor: Factor, reduction: Reduction) -> None:
        self._factor, self._reduction = factor, reduction

    def solve(self, right: Array) -> Array:
        """Solution for one or several right-hand sides, shape (n,) or (n, k)."""
        reduced = self._reduction.reduced(right)
        return self._reduction.expanded(self._factor.solve(np.asfortranarray(reduced) if reduced.ndim > 1 else reduced))

    def determinant_sign(self) -> int:
        return self._factor.determinant_sign()


class ContactEvaluation(Evaluation):
    """Value, gradient and Hessian on a set of held nodes, without what the bodies take.

    Attributes
    ----------
    held : ndarray of bool, shape (n_nodes,)
        Which nodes along the meridian are held.
    forces : ndarray, shape (n_nodes,)
        By which the bodies hold them, along the normals; 0 at the others.
    gaps : Gaps
    reduction : Reduction
    """

    __slots__ = ("_raw", "forces", "gaps", "held", "reduction")

    def __init__(self, raw: Evaluation, potential: ContactPotential, gaps: Gaps, held: Mask) -> None:
        space = potential.space
        iu, iw = potential.place
        self.reduction = Reduction(iu[held], iw[held], gaps.n_rho[held], gaps.n_eta[held], space.n_free)
        forces = self.reduction.projected(raw._forces)
        answer = raw.elastic_energy, raw.magnetic_energy, raw.volume, raw.finite, forces, raw._densities
        spring = None if raw.spring is None else self.reduction.projected(raw.spring)
        super().__init__(raw.x, answer, potential, raw.elements, raw.factor, spring)
        self.held, self.gaps, self._raw = held, gaps, raw
        self.forces = np.where(held, potential.normal_forces(raw, gaps), 0.0)

    @property
    def raw(self) -> Evaluation:
        return self._raw

    @property
    def band(self) -> Array:
        if self._band is None:
            kd = self.potential.space.half_bandwidth
            band = self._raw.band.copy(order="F")
            potential = cast(ContactPotential, self.potential)
            iu, iw = (k[self.held] for k in potential.place)
            both = (iu < band.shape[1]) & (iw < band.shape[1])
            if both.any():
                work = (self.forces * self.gaps.curvature)[self.held][both]
                u, w, a, b = iu[both], iw[both], -self.gaps.n_eta[self.held][both], self.gaps.n_rho[self.held][both]
                for i, j, product in ((u, u, a * a), (w, w, b * b), (u, w, a * b), (w, u, a * b)):
                    band[2 * kd + i - j, j] -= work * product
            self._band = self.reduction.band(band, kd)
        return self._band

    def brought(self, v: Array) -> Array:
        n, own = self.potential.space.n_free, self.potential.brought(v)
        return np.concatenate([self.reduction.projected(own[:n]), own[n:]])

    def pressed_flat(self) -> Mask | None:
        potential = cast(ContactPotential, self.potential)
        degree, n_elements = potential.space.degree, potential.space.n_elements
        on: Mask = np.ones(degree * n_elements + 1, dtype=bool)  # a node that cannot move at all takes part
        on[potential.nodes] = self.held
        on[-1] &= on[0] or not potential.space.closed
        inner = cast("Mask", np.stack([on[j : j + degree * n_elements : degree] for j in range(degree + 1)]).all(axis=0))
        return inner if self.held.any() and inner.any() else None

    def touched(self) -> tuple[ContactEvaluation, ContactEvaluation] | None:
        potential, gaps = cast(ContactPotential, self.potential), self.gaps
        u, w = self._raw.force_scale(0.0)
        least = _WEAK * (np.abs(gaps.n_rho) * u + np.abs(gaps.n_eta) * w)
        forces = potential.with_poles(potential.normal_forces(self._raw, gaps))
        weak = (np.abs(gaps.gap) <= _TOUCH * potential.space.unit) & (np.abs(forces) <= least) | (self.held & (forces <= least))
        if not weak.any():
            return None
        free, held = (ContactEvaluation(self._raw, potential, gaps, kept) for kept in (self.held & ~weak, self.held | weak))
        return free, held

    def holds(self, unknown: int) -> bool:
        return bool((self.reduction.out == unknown).any())

    def reduced(self, v: Array) -> Array:
        return self.reduction.reduced(v)

    def expanded(self, v: Array) -> Array:
        return self.reduction.expanded(v)

    def reduced_mass(self, mass: Array) -> Array:
        kd = self.potential.space.half_bandwidth
        lightest = np.abs(mass[2 * kd]).min()
        return self.reduction.band(mass, kd, np.full(self.reduction.out.shape, lightest))

    def reduced_form(self, band: Array, half_bandwidth: int) -> Array:
        return self.reduction.band(band, half_bandwidth)

    def factors(self) -> Factor:
        factor: Factor = kernels().factor(self.band)
        if self.spring is not None:
            factor = SpringFactor(factor, self.reduced(self.spring))
        return ReducedFactor(factor, self.reduction)

    def inner(self, x: Array, y: Array) -> float:
        own = kernels().inner(self.band, self.potential.space.half_bandwidth, self.reduced(x), self.reduced(y))
        return own if self.spring is None else own + float(self.spring @ x) * float(self.spring @ y)

    def border(self, row: Array, corner: float) -> Border:
        return BorderedFactor(self.factors(), -self.volume_gradient, row, corner)

    def step(self, row: Array, corner: float, gap: float) -> Step:
        border, largest = self.border(row, corner), self.elements.largest
        dx, dp = border.solve(self.unbalanced, -gap)
        return border, dx, dp, largest(dx), largest(self.x)


class ContactPotential(FollowingPotential):
    """The potential of a scene with obstacles. Which nodes are held in a state follows from the state itself."""

    def __init__(self, scene: Scene, quadrature: int | None = None, root: Self | None = None) -> None:
        super().__init__(scene, quadrature, root)
        self.obstacles = scene.bodies

    @cached_property
    def without_bodies(self) -> Potential:
        """The potential of the same membrane with nothing in its way."""
        bare: Potential = object.__new__(Potential)
        bare.__dict__.update(self.root.__dict__, obstacles=())
        return bare

    def bodies_at(self, factor: float) -> tuple[Obstacle, ...]:
        """The bodies. ``factor`` as in :meth:`evaluate`: in a family of scenes it may be a number of theirs."""
        return self.obstacles

    def edge_load(self, evaluation: Evaluation, eta: float) -> float:
        """What loads over the projected area have, per area, at a height."""
        return evaluation.factor * float(over_projection(self.loads, np.array(eta))[0]) if self.loads else 0.0

    @cached_property
    def nodes(self) -> NDArray[np.int64]:
        """The nodes along the meridian, in its order, that can move."""
        space = self.space
        numbers = space.numbers[space.nodes]
        if space.closed:
            numbers = numbers[:-1]
        found: NDArray[np.int64] = np.flatnonzero((numbers < space.n_free).any(axis=1))
        return found

    @cached_property
    def place(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Unknowns u and w of :attr:`nodes`; n_free stands for what is held."""
        numbers = self.space.numbers[self.space.nodes][self.nodes]
        return numbers[:, 0].copy(), numbers[:, 1].copy()

    @cached_property
    def parameters(self) -> Array:
        """Parameters of :attr:`nodes` along the meridian."""
        found: Array = self.space.node_parameters()[self.nodes]
        return found

    @cached_property
    def _rest(self) -> tuple[Array, Array]:
        """Where the nodes are while all unknowns are zero."""
        s = self.parameters
        R, Z = self.space.mesh.position(s)
        if self.space.lift is not None:
            u, _, w, _ = self.space.lift.at(self.space.mesh, s)
            R, Z = R + u, Z + w
        R = np.where(self._on_axis, 0.0, R)
        return R, np.broadcast_to(Z, R.shape).copy()

    @cached_property
    def _on_axis(self) -> Mask:
        """Which of the nodes are poles."""
        axis = [0 if k == 0 else self.space.nodes.size - 1 for k in self.space.axis_nodes]
        return np.isin(self.nodes, axis)

    @cached_property
    def poles(self) -> list[tuple[int, int]]:
        """Places among :attr:`nodes` of poles on the axis, and of their neighbours."""
        last = self.nodes.size - 1
        return [(int(k), 1 if k == 0 else last - 1) for k in np.flatnonzero(self._on_axis) if last > 0]

    def rest_at(self, factor: float) -> tuple[Array, Array]:
        """Where the nodes are while all unknowns are zero. ``factor`` as in :meth:`evaluate`."""
        return self._rest

    def positions(self, x: Array, factor: float = 1.0) -> tuple[Array, Array]:
        """(rho, eta) of :attr:`nodes`. ``factor`` as in :meth:`evaluate`."""
        extended, (iu, iw), (R, Z) = self.space.extend(x), self.place, self.rest_at(factor)
        return R + extended[iu], Z + extended[iw]

    def gaps(self, x: Array, factor: float = 1.0) -> Gaps:
        """Gaps at the nodes in a state. ``factor`` as in :meth:`evaluate`."""
        rho, eta = self.positions(x, factor)
        found = [body.touch(rho, eta) for body in self.bodies_at(factor)]
        body = np.argmin([touch.gap for touch in found], axis=0)
        gap, n_rho, n_eta, curvature, size = (
            np.choose(body, [getattr(touch, name) for touch in found]) for name in ("gap", "n_rho", "n_eta", "curvature", "size")
        )
        circle = np.divide(n_rho, rho, out=np.zeros_like(rho), where=rho > 0)
        close = np.abs(gap) <= ROUND_OFF * size
        (iu, iw), n = self.place, self.space.n_free
        for first, second, across, other in ((iu, iw, n_rho, n_eta), (iw, iu, n_eta, n_rho)):
            alone = (first < n) & (second == n)  # the one motion that the node has
            if alone.any():
                gap = np.where(alone, gap / np.maximum(np.abs(across), ACROSS), gap)
                across[:] = np.where(alone, np.where(across < 0, -1.0, 1.0), across)
                other[:] = np.where(alone, 0.0, other)
                curvature = np.where(alone, 0.0, curvature)
        return Gaps(gap, n_rho, n_eta, curvature, circle, close, body)

    def normal_forces(self, raw: Evaluation, gaps: Gaps) -> Array:
        """n . (E' - P V') at the nodes: by what bodies would have to push to hold them in balance."""
        unbalanced, (iu, iw) = np.append(raw._forces[2], 0.0), self.place
        return -(unbalanced[iu] * gaps.n_rho + unbalanced[iw] * gaps.n_eta)

    def with_poles(self, forces: Array) -> Array:
        """Forces by which nodes are judged: a pole, which has no area, together with its neighbour."""
        judged = forces.copy()
        for pole, neighbour in self.poles:
            judged[pole] += forces[neighbour]
        return judged

    def evaluate(self, x: Array, pressure: float, magnetic: float = 1.0, slot: float | None = None) -> Evaluation:
        """As :meth:`.Potential.evaluate`, with the nodes held that lie on a body and are pushed away from it."""
        raw = super().evaluate(x, pressure, magnetic)
        gaps = self.gaps(raw.x, magnetic)
        forces = self.with_poles(self.normal_forces(raw, gaps))
        return ContactEvaluation(raw, self, gaps, gaps.close & (forces >= -self._round_off(raw, gaps, pressure)))

    def beside(self, x: Array, pressure: float) -> tuple[ContactEvaluation, ContactEvaluation]:
        """A state in which a body is touched without a force, without the nodes that are held by none, and with all that lie on a body."""
        raw = super().evaluate(x, pressure)
        gaps = self.gaps(raw.x)
        held = ContactEvaluation(raw, self, gaps, gaps.close)
        return held.touched() or (held, held)

    def _round_off(self, raw: Evaluation, gaps: Gaps, pressure: float) -> Array:
        """Normal forces at the nodes that are round-off: on a nearly flat membrane those along the axis are much smaller than others."""
        u, w = raw.force_scale(pressure)
        if not (math.isfinite(u) and math.isfinite(w)):  # outside the domain of the energy no force is known
            return np.full(gaps.gap.shape, np.inf)
        found: Array = NO_FORCE * (np.abs(gaps.n_rho) * u + np.abs(gaps.n_eta) * w)
        return found

    def pressed(self, x: Array, pressure: float, magnetic: float) -> Mask:
        """Which nodes a solve from a state sets out to hold: those inside a body, and those that are pushed more than they are away."""
        raw = super().evaluate(x, pressure, magnetic)
        return self.judged(raw, self.gaps(raw.x, magnetic), pressure)

    def judged(self, raw: Evaluation, gaps: Gaps, pressure: float) -> Mask:
        """The next set of held nodes: where the force exceeds the stiffness times the gap."""
        forces = self.with_poles(self.normal_forces(raw, gaps))
        kd, (iu, iw) = self.space.half_bandwidth, self.place
        diagonal = np.append(np.abs(raw.band[2 * kd]), 0.0)
        stiffness = diagonal[iu] * gaps.n_rho**2 + diagonal[iw] * gaps.n_eta**2
        gap = np.where(gaps.close, 0.0, gaps.gap)
        least = self._round_off(raw, gaps, pressure)
        found: Mask = np.where(gaps.close, forces >= -least, (forces > stiffness * gap) & ((gap < 0) | (forces > least)))
        return found & np.isfinite(forces)

    def holding(self, held: Mask) -> Held:
        """The smooth potential on a set of held nodes."""
        return Held(self, held)

    @property
    def given(self) -> float:
        """The third argument of :meth:`evaluate` for the scene itself."""
        return 1.0

    def touching(self, x: Array) -> float:
        """The least gap of a state of the scene at its nodes."""
        return float(self.gaps(x, self.given).gap.min(initial=np.inf))


class Held(ContactPotential):
    """The potential on a fixed set of held nodes, whose places are on the bodies: smooth, as any other.

    Parameters
    ----------
    base : ContactPotential
    held : ndarray of bool, shape (n_nodes,)
    """

    def __init__(self, base: ContactPotential, held: Mask) -> None:
        self.__dict__.update(base.__dict__, _root=base.root)
        self.base, self.held = base, held
        self._looked_at: tuple[Array, float, Gaps] | None = None

    @property
    def unsettled(self) -> bool:  # type: ignore[override]
        return False

    def placed(self, x: Array, factor: float = 1.0) -> Array:
        """A state with its held nodes moved onto the bodies. ``factor`` as in :meth:`evaluate`."""
        if not self.held.any():
            return x
        x, (iu, iw), n = np.array(x, dtype=float), self.place, self.space.n_free
        for _ in range(3):
            gaps = self.gaps(x, factor)
            moved = self.held & ~gaps.close
            if not moved.any():
                self._looked_at = x, factor, gaps
                break
            for index, normal in ((iu, gaps.n_rho), (iw, gaps.n_eta)):
                own = moved & (index < n)
                x[index[own]] -= (gaps.gap * normal)[own]
        return x

    def evaluate(self, x: Array, pressure: float, magnetic: float = 1.0, slot: float | None = None) -> Evaluation:
        raw, known = Potential.evaluate(self, x, pressure, magnetic), self._looked_at
        same = known is not None and known[0] is raw.x and known[1] == magnetic
        return ContactEvaluation(raw, self, known[2] if known is not None and same else self.gaps(raw.x, magnetic), self.held)


def gap_rows(potential: ContactPotential, y: ca.MX, p: ca.MX) -> ca.MX:
    """Gaps at the nodes over the size of the membrane, as functions of scaled unknowns y (scales p[2], p[3])."""
    R, Z = potential._rest
    (iu, iw), n = potential.place, potential.space.n_free
    padded = ca.vertcat(y[:n], 0)  # a voltage may stand behind the displacements
    rho = ca.DM(R) + p[2] * padded[np.minimum(iu, n).tolist()]
    eta = ca.DM(Z) + p[3] * padded[np.minimum(iw, n).tolist()]
    one, other = ca.SX.sym("rho"), ca.SX.sym("eta")
    least = _gap_expression(potential, one, other)
    function = ca.Function("gap", [one, other], [least / potential.space.unit])
    return function.map(int(R.size))(rho.T, eta.T).T


def _gap_expression(potential: ContactPotential, rho: ca.SX, eta: ca.SX) -> ca.SX:
    """The least gap of a point from all bodies: that of the nearest piece of each."""
    gaps = []
    for body in potential.obstacles:
        best, far = ca.SX(ca.inf), ca.SX(ca.inf)
        for piece in body.pieces():
            if isinstance(piece, Straight):
                x, y = rho - piece.start[0], eta - piece.start[1]
                gap, place = x * piece.normal[0] + y * piece.normal[1], x * piece.along[0] + y * piece.along[1]
                inside = ca.logic_and(place >= piece.low, place <= piece.high)
                if math.isinf(piece.low) and math.isinf(piece.high):
                    inside = ca.SX(1)
            else:
                x, y = rho - piece.center[0], eta - piece.center[1]
                distance = ca.sqrt(x**2 + y**2 + _TINY)
                gap = piece.side * (distance - piece.radius)
                inside = ca.SX(1) if piece.cosine < -1 else x * piece.middle[0] + y * piece.middle[1] >= piece.cosine * distance
            nearer = ca.logic_and(inside, ca.fabs(gap) < far)
            best, far = ca.if_else(nearer, gap, best), ca.if_else(nearer, ca.fabs(gap), far)
        gaps.append(best)
    least = gaps[0]
    for gap in gaps[1:]:
        least = ca.fmin(least, gap)
    return least
