"""The total potential of a membrane that is no longer one of revolution, by harmonics around the axis.

The integrand at a point is that of :mod:`.surface`, with exact gradient and Hessian in the position and the two tangents. W enters through
the material's own stresses and tangents: with h and y as there and D = e_1 - e_2,

    F_h = s_1 + s_2,      F_y = (s_1 - s_2)/(2 sinh 2D),      F_yy = ((d_11 - 2 d_12 + d_22)/4 - 2 cosh 2D F_y)/sinh^2 2D

For D below a small number these are taken at that number, and led to D by the series in y, which is regular through D = 0.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from ..discretization.harmonics import AROUND, LOCAL_PAIRS, N_LOCAL, Harmonics, harmonics_of
from ..kernels.interface import Array
from ..physics.loads import over_projection, over_reference
from ..physics.magnetisation import position_energy_density
from ..physics.response import response_of, squared
from ..threads import cached_property
from .expressions import BUILDING, casadi_answers_numpy, response_expressions
from .nearby import Nearby
from .replay import Replay
from .surface import invariants

if TYPE_CHECKING:
    from .potential import Potential

#: difference of the logarithmic strains below which W is led there by its series in y. Forces then err by round-off over it, or by its
#: fourth power; second derivatives by its square times about 1e-3
_LEAST = 3e-4
#: energies of strain, electrodes, sources and loads, then the volume; two gradients follow
_VALUES = 5
_ROWS = _VALUES + 2 * N_LOCAL


class TippedEvaluation:
    """Value, gradient and Hessian of E and V at one state.

    Attributes
    ----------
    elastic_energy, electric_energy, magnetic_energy, load_energy, volume : float
        With the 2 pi.
    gradient, volume_gradient : ndarray, shape (n_free,)
    finite : bool
    """

    __slots__ = (
        *("potential", "x", "elastic_energy", "electric_energy", "magnetic_energy", "load_energy", "volume"),
        *("gradient", "volume_gradient", "finite", "_band", "_second"),
    )

    def __init__(self, potential: TippedPotential, x: Array, rows: Array, lids: tuple[float, float]) -> None:
        self.potential, self.x = potential, x
        harmonics = potential.harmonics
        shape = (-1, harmonics.angles.size, *harmonics.space.R.shape)
        n = harmonics.angles.size
        self.elastic_energy, self.electric_energy, self.magnetic_energy, load, enclosed = rows[:_VALUES].sum(axis=1) / n
        self.load_energy, self.volume = float(load) + lids[0], float(enclosed) + lids[1]
        middle = _VALUES + N_LOCAL
        self.gradient = harmonics.vector(rows[_VALUES:middle].reshape(shape)) + potential.end_forces[0]
        self.volume_gradient = harmonics.vector(rows[middle:_ROWS].reshape(shape)) + potential.end_forces[1]
        self._second = rows[_ROWS:].reshape(shape)
        self._band: Array | None = None
        self.finite = bool(np.isfinite(self.gradient).all() and np.isfinite(self.volume))

    @property
    def energy(self) -> float:
        return float(self.elastic_energy + self.electric_energy + self.magnetic_energy + self.load_energy)

    @property
    def band(self) -> Array:
        """E'' - P V'' in LAPACK band storage."""
        if self._band is None:
            self._band = self.potential.harmonics.band(self._second)
        return self._band

    def odd_band(self, odd: Harmonics) -> Array:
        """The same for the perturbations that are odd in the mirror of the state."""
        return odd.band(self._second)


class TippedPotential:
    """The potential of a scene in displacements with harmonics 0, n, ... K n around the axis.

    Parameters
    ----------
    potential : Potential
        Of the scene, one that :func:`.surface.refusal` has nothing against.
    waves, order : int
        n and K.
    """

    def __init__(self, potential: Potential, waves: int, order: int) -> None:
        self.axisymmetric, self.waves, self.order = potential, waves, order
        self.space = potential.space
        self.harmonics: Harmonics = harmonics_of(potential.space, waves, order)
        self.end_forces: tuple[Array, Array] = (np.zeros(self.harmonics.n_free), np.zeros(self.harmonics.n_free))
        self._end_values = (0.0, 0.0)
        self._correct_ends()

    def _correct_ends(self) -> None:
        """Energies of hubs and volumes under lids depend on the heights of the ends, linearly: what the surface lacks is found once."""
        space = self.space
        if not (space.lids or self.axisymmetric.loads):
            return
        x = np.zeros(space.n_free)
        own, known = self.evaluate(self.harmonics.lifted(x), 0.0), self.axisymmetric.evaluate(x, 0.0)
        forces = (known.gradient, known.volume_gradient)
        found = (own.gradient, own.volume_gradient)
        left = [self.harmonics.lifted(f - g[self.harmonics.without_waves]) for f, g in zip(forces, found, strict=True)]
        self.end_forces, self._end_values = (left[0], left[1]), (known.energy - own.energy, known.volume - own.volume)

    @cached_property
    def mass(self) -> Array:
        return self.harmonics.mass(self.axisymmetric.bulk)

    @cached_property
    def _base(self) -> Array:
        """The local variables while all unknowns are zero, shape (9, 1, n_quadrature, n_elements)."""
        rho, rho_x, eta, eta_x = self.space.displacement_at_quadrature(np.zeros(self.space.n_free))[[0, 1, 2, 3]] + np.stack(
            [self.space.R, self.space.R_x, self.space.Z, self.space.Z_x]
        )
        zero = np.zeros_like(rho)
        return np.stack([rho, zero, eta, rho_x, zero, eta_x, zero, rho, zero])[:, None]

    @cached_property
    @BUILDING
    def _points(self) -> Replay:
        potential, space = self.axisymmetric, self.space
        sheet = potential.sheet
        ones = np.ones_like(space.R)
        thickness, modulus = (ones, ones) if sheet is None else sheet.factors(space.R, space.Z, space.s)
        J = np.hypot(space.R_x, space.Z_x)
        electrode = ones if potential.electrode is None else potential.electrode
        columns = (space.R, J, space.weights * space.R * J * thickness, space.weights * space.side, modulus * ones, electrode)
        data = np.stack([np.broadcast_to(column, (self.harmonics.angles.size, *space.R.shape)).ravel() for column in columns])
        return Replay(point_function(potential), np.ascontiguousarray(data))

    def least_stress(self, x: Array) -> tuple[float, tuple[float, float]]:
        """Smallest principal stress at the points, over the local modulus, and where it is: reference radius (of other meridians than a
        disc the arc length) and angle."""
        space, harmonics, potential = self.space, self.harmonics, self.axisymmetric
        y = self._base + harmonics.at_points(x)
        A, B = y[3:6] / np.hypot(space.R_x, space.Z_x), y[6:9] / space.R
        C11, C12, C22 = (A * A).sum(axis=0), (A * B).sum(axis=0), (B * B).sum(axis=0)
        middle, half = (C11 + C22) / 2, np.hypot((C11 - C22) / 2, C12)
        larger = middle + half
        e1, e2 = np.log(larger) / 2, np.log((C11 * C22 - C12**2) / larger) / 2
        square = None if potential.electric is None else squared(potential.electric) * np.ones_like(e1)
        if square is not None and potential.electrode is not None:
            square = square * potential.electrode
        stress = potential.response(e1, e2, square)[:2].min(axis=0).reshape(e1.shape)
        angle, point, element = np.unravel_index(int(stress.argmin()), stress.shape)
        return float(stress.min()), (float(space.s[point, element]), float(harmonics.angles[angle] / self.waves))

    def shape(self, x: Array, angles: Array) -> tuple[Array, Array]:
        """Displacements (radial, around, vertical) at the nodes of the meridian and at angles, shape (3, n_nodes, n_angles), and the places
        (radius, height) of the nodes while all unknowns are zero, shape (2, n_nodes)."""
        space, harmonics = self.space, self.harmonics
        values = space.shape_functions((space.interpolation_points()[:, 0] - space.ends[0]) / space.sizes[0])[0]
        local = values @ harmonics.local(x)
        at = np.concatenate([local[:, :-1].transpose(0, 2, 1).reshape(len(local), -1), local[:, -1, -1:]], axis=1)
        found = np.zeros((3, at.shape[1], angles.size))
        for (j, field), row in zip(harmonics.fields, at, strict=True):
            wave = j * self.waves * angles
            found[field] += row[:, None] * (np.sin(wave) if field == AROUND else np.cos(wave))
        s = space.node_parameters()
        places = np.stack(space.mesh.position(s))
        if space.lift is not None:
            places = places + space.lift.at(space.mesh, s)[::2]
        return found, places

    def evaluate(self, x: Array, pressure: float) -> TippedEvaluation:
        """Value, gradient and Hessian of E - P V."""
        y = self._base + self.harmonics.at_points(x)
        rows = self._points(y.reshape(N_LOCAL, -1), np.array([pressure]))
        lids = (self._end_values[0] + float(self.end_forces[0] @ x), self._end_values[1] + float(self.end_forces[1] @ x))
        return TippedEvaluation(self, x, rows, lids)


@lru_cache(maxsize=16)
@BUILDING
def point_function(potential: Potential) -> ca.Function:
    """(data, local variables, P) -> energies, volume, both gradients, and second derivatives of E - P V at one point."""
    scene = potential.scene
    data, y, parameters = ca.SX.sym("data", 6), ca.SX.sym("y", N_LOCAL), ca.SX.sym("parameters", 1)
    R, J, area, inside, modulus, electrode = (data[i] for i in range(6))
    bulk = area * modulus
    with casadi_answers_numpy():
        h, square = invariants(y, R, J)
        both = ca.vertcat(h, square)
        D = ca.fmax(ca.asinh(ca.sqrt(square)), _LEAST)
        e = ca.vertcat(h + D / 2, h - D / 2)
        electric = None if scene.electricity is None else squared(scene.electricity) * electrode
        response: Any = response_of(scene, electric)
        stress, tangent = response_expressions(response, e)
        away = square - ca.sinh(D) ** 2
        twice = ca.sinh(2 * D)
        F_D, F_hD, F_DD = (
            (stress[0] - stress[1]) / 2,
            (tangent[0, 0] - tangent[1, 1]) / 2,
            (tangent[0, 0] - 2 * tangent[0, 1] + tangent[1, 1]) / 4,
        )
        F_y, F_hy = F_D / twice, F_hD / twice
        F_yy = (F_DD - 2 * ca.cosh(2 * D) * F_y) / twice**2
        F_h, F_hh = stress[0] + stress[1] + F_hy * away, tangent[0, 0] + 2 * tangent[0, 1] + tangent[1, 1]
        strain = response.energy(e[0], e[1]) + F_y * away
        field = ca.SX(0) if scene.electricity is None else response.electric_energy(e[0], e[1])
        F_y = F_y + F_yy * away
        slopes = ca.jacobian(both, y)
        second = ca.vertcat(ca.horzcat(F_hh, F_hy), ca.horzcat(F_hy, F_yy))
        hessian = bulk * (ca.mtimes([slopes.T, second, slopes]) + F_h * ca.hessian(h, y)[0] + F_y * ca.hessian(square, y)[0])
        gradient = bulk * (F_h * slopes[0, :].T + F_y * slopes[1, :].T)
        r = ca.sqrt(y[0] ** 2 + y[1] ** 2)
        projected = y[3] * y[7] - y[4] * y[6]
        volume = inside * y[2] * projected
        load = area * over_reference(potential.loads, r, y[2]) + inside * over_projection(potential.loads, y[2])[0] * projected + ca.SX(0)
        near, magnetic = Nearby(potential.sources, r, y[2]), ca.SX(0)
        if potential.sources:
            magnetic = area * position_energy_density(near.sources, scene.susceptibility or 0.0, scene.saturation, r, y[2])
        outer_second, outer_first = ca.hessian(magnetic + load, y)
        magnetic, outer_first, outer_second = near.placed(magnetic, outer_first, outer_second)
        volume_second, volume_first = ca.hessian(volume, y)
        hessian = hessian + outer_second - parameters[0] * volume_second
        gradient = gradient + outer_first
    rows = [bulk * strain, bulk * field, magnetic, load, volume, gradient, volume_first, *(hessian[i, j] for i, j in LOCAL_PAIRS)]
    return ca.Function("tipped", [data, y, parameters], [ca.densify(ca.vertcat(*rows))], {"cse": True})


@lru_cache(maxsize=16)
def tipped_potential(potential: Potential, waves: int, order: int) -> TippedPotential:
    """Built once."""
    return TippedPotential(potential, waves, order)
