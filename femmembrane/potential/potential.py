"""The total potential of a scene on its finite-element space.

CasADi differentiates the densities at a point twice. Assembly is a constant linear map of the values at the points
(:mod:`..discretization.space`), the same for the Newton corrector (NumPy arrays, banded) and for IPOPT (CasADi functions, sparse).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any, cast

import casadi as ca
import numpy as np

from ..discretization.lift import Moving
from ..discretization.space import HESSIAN_PAIRS, Space, anchored, space_of
from ..errors import InputError
from ..kernels import kernels
from ..kernels.bordered import BorderedFactor, SpringFactor
from ..kernels.interface import N_FORCE, N_STIFFNESS, Array, Border, Elements, Factor, Step
from ..physics.along import Along
from ..physics.kinematics import hencky_strains
from ..physics.loads import Load, on_hubs, over_reference
from ..physics.magnetics import swept
from ..physics.magnetisation import Magnetisation, position_energy_density, remanence_column, sources_that_act
from ..physics.response import ELECTRODE, local_square, response_columns, response_of, squared
from ..physics.sheet import Sheet
from ..threads import cached_property
from .charge import Charged
from .expressions import BUILDING, LIFT, MOVE, casadi_answers_numpy, point_expressions, point_rows, response_expressions
from .magnetic import wave_function
from .nearby import Nearby
from .replay import PointProgram, Replay, at_points
from .template import expressions_of

if TYPE_CHECKING:
    from ..physics.electric import Electric
    from ..physics.materials import Material
    from ..physics.obstacles import Obstacle
    from ..scene import Scene


#: change of the factor on a voltage or a charge from which a derivative is taken
_LITTLE_AHEAD = 1e-5


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

    __slots__ = (
        *("x", "elastic_energy", "magnetic_energy", "volume", "finite"),
        *("potential", "elements", "factor", "spring", "_forces", "_densities", "_band", "_negative", "_known"),
    )

    def __init__(
        self,
        x: Array,
        elastic_energy: float,
        magnetic_energy: float,
        volume: float,
        finite: bool,
        forces: Array,
        densities: Array,
        potential: Potential,
        elements: Elements,
        factor: float,
        spring: Array | None = None,
    ) -> None:
        self.x, self.elastic_energy, self.magnetic_energy, self.volume, self.finite = x, elastic_energy, magnetic_energy, volume, finite
        self.potential, self.elements, self.factor, self._forces, self._densities = potential, elements, factor, forces, densities
        self.spring = spring
        self._band: Array | None = None
        self._negative: int | None = None
        self._known: dict[str, float] | None = None

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
        if known is None:
            known = self._known = {}
        value = known.get(name)
        if value is None:
            value = known[name] = compute(self)
        return value

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
            self._negative = kernels().inertia(self.band, self.potential.space.half_bandwidth, self.spring, 1.0)
        return self._negative

    def factors(self) -> Factor:
        """Factors of E'' - P V''."""
        factor = kernels().factor(self.band)
        return factor if self.spring is None else SpringFactor(factor, self.spring)

    def carried(self, v: Array) -> Array:
        """See :meth:`Potential.carried`."""
        return self.potential.carried(v)

    def brought(self, v: Array) -> Array:
        """See :meth:`Potential.brought`; without what bodies keep from moving."""
        return self.potential.brought(v)

    def row(self, row: Array) -> Array:
        """See :meth:`Potential.row`."""
        return self.potential.row(row)

    def released(self) -> Evaluation | None:
        """The same state without the nodes that bodies hold by no force; None where there are none."""
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


class Potential:
    """Discrete potential of a scene.

    Parameters
    ----------
    scene : Scene
    quadrature : int, optional
        As for :class:`.Space`.

    Attributes
    ----------
    flat : bool
        Whether the membrane without load is flat and without stress, so that nothing but a load gives it stiffness across its plane.
    """

    #: rigid bodies that the membrane may touch
    obstacles: tuple[Obstacle, ...] = ()
    #: whether ends of elements follow the borders of a state, and whether a corrector has still to find these, and which nodes are held
    follows = unsettled = False
    #: a potential with the same expressions on other points
    _like: Potential | None = None
    symbols: tuple[ca.SX, ca.SX, ca.SX]
    terms: dict[str, ca.SX]

    @BUILDING
    def __init__(self, scene: Scene, quadrature: int | None = None) -> None:
        self.scene = scene
        fixed = anchored(scene)
        ends, stretch, nodal = scene.element_ends, scene.prestretch, bool(getattr(scene, "follows", False))
        self.space = (
            space_of(scene.mesh, scene.degree, fixed, ends, stretch, nodal)
            if quadrature is None
            else Space(scene.mesh, scene.degree, quadrature, fixed, ends, stretch, nodal)
        )
        if borders := getattr(scene, "borders", ()):
            self.space = self.space.with_moved(borders)
        space = self.space
        self.sheet = Sheet.of(scene)
        if not space.n_free:
            advice = f"of degree {scene.degree}, between these ends, nothing can move; more elements or a higher degree are allowed"
            raise InputError("mesh.elements", space.n_elements, advice)
        self.sources = sources_that_act(scene)  # nothing is built of others
        self.magnetisation = Magnetisation.of(scene) if self.sources else None
        self.loads = tuple(load for load in scene.loads if load.acts)
        if space.lids and any(type(load).over_projection is not Load.over_projection for load in self.loads):
            advice = (
                "a liquid fills shapes that are closed by the plane z = 0 or by poles; leave it out, or choose such a shape and supports"
            )
            raise InputError("load", self.loads, advice)
        pulled = any(type(load).on_hubs is not Load.on_hubs for load in self.loads)
        forces = on_hubs(self.loads, [end.rigid for end in space.supports]) if pulled else None
        self.level = not (space.Z.any() or space.Z_x.any())
        self.strained = space.strained or self.prestressed
        self.flat = self.level and not self.strained
        way: Moving | None = getattr(scene, "lifted", None)
        columns = {"R": space.R, "R_x": space.R_x, "weight": space.weights}
        if not self.level:
            columns |= {"Z": space.Z, "Z_x": space.Z_x}
        if space.wall is not None:
            columns |= {"wall": space.wall[0], "wall_x": space.wall[1]}
        if way is not None and any(way.sliding):
            columns |= dict(zip(("move_wall", "move_wall_x"), space.between(list(way.sliding)), strict=True))
        if forces is not None:
            columns |= dict(zip(("hub", "hub_x"), space.between([-1.0, 0.0]), strict=True))
        if self.sheet is not None:
            columns |= self.sheet.columns(space.R, space.Z, space.s)
        if self.magnetisation is not None and isinstance(self.magnetisation.remanence, Along):
            columns["remanence"] = remanence_column(self.magnetisation, space.R, space.Z, space.s, space.side)
        columns |= response_columns(scene, space.R, space.Z, space.s)
        for names, lift in ((LIFT, space.lift), (MOVE, None)) if way is None else ((LIFT, way.rest), (MOVE, way.unit)):
            if lift is not None:
                columns |= {name: part for name, part in zip(names, space.lifting_of(lift), strict=True) if part.any()}
        self.point_data: Array = np.stack([c.ravel() for c in columns.values()])
        if (like := self._like) is not None:
            self.symbols, self.terms = like.symbols, like.terms
            self.__dict__["point_function"] = like.point_function
        else:
            with casadi_answers_numpy():
                given = scene, self.sources, self.loads, tuple(columns), space, forces
                self.symbols, self.terms = expressions_of(point_expressions, *given)
        self.n_points = self.point_data.shape[1]
        self._elements: dict[str, Elements] = {}  # of each implementation that was asked

    def placed(self, x: Array) -> Array:
        """A state with the nodes that bodies hold moved onto them."""
        return x

    def carried(self, v: Array) -> Array:
        """A displacement in the coefficients on the mesh of the scene: the same one, unless ends of elements follow borders."""
        return v

    def brought(self, v: Array) -> Array:
        """A displacement on the mesh of the scene here, with what may stand behind it."""
        return v

    def row(self, row: Array) -> Array:
        """A linear form of :meth:`carried` displacements as one of displacements here."""
        return row

    def pole_rise(self, factor: float) -> float:
        """How far the pole stands above its place in the space while all unknowns are zero: only a number that moves an end lifts it."""
        return 0.0

    @property
    def root(self) -> Potential:
        """The potential on the mesh of the scene: this one, unless ends of elements follow borders."""
        return self

    @property
    def surrounded(self) -> bool:
        """Whether anything but the pressure acts on the membrane. Otherwise the flat unloaded state is an equilibrium without stiffness."""
        return bool(self.sources or self.loads or self.electric)

    @property
    def prestressed(self) -> bool:
        """Whether the material has stress at rest, which holds no equilibrium in a curved membrane."""
        return bool(getattr(self.scene.material, "prestressed", False))

    @cached_property
    def linear(self) -> bool:
        """Whether forces at a state are linear in the factor on sources and loads: those of a charge on electrodes are not, nor where the
        field changes the width of wrinkles or the thickness."""
        return self.electric is None or not (self.charged or self.scene.tension_field or hasattr(self.scene.material, "electrified"))

    def factor_derivative(self, evaluation: Evaluation, pressure: float, factor: float) -> Array:
        """Derivative of the gradient at a state with respect to the factor on sources and loads."""
        ahead = 1.0 if self.linear else _LITTLE_AHEAD  # where it is linear that is exact
        difference: Array = self.evaluate(evaluation.x, pressure, factor + ahead).gradient - evaluation.gradient
        return difference / ahead

    @cached_property
    def electric(self) -> Electric | None:
        """Voltage or charge of the scene without units; None without."""
        return self.scene.electricity

    def square(self, x: Array, factor: float = 1.0) -> float | None:
        """phi^2, or the frozen q^2, of a state; None without voltage and charge. ``factor`` as in :meth:`evaluate`."""
        if self.electric is None:
            return None
        return self.charged.square(x, factor) if self.charged is not None else factor * float(squared(self.electric))

    def charge_squared(self, factor: float) -> float:
        """Q^2 of a total charge. ``factor`` as in :meth:`evaluate`."""
        return factor * float(cast("Electric", self.scene.electricity).total_charge or 0.0) ** 2

    @cached_property
    def charged(self) -> Charged | None:
        """The electrodes with a total charge; None without."""
        return None if self.electric is None or self.electric.total_charge is None else Charged(self)

    def local_square(self, x: Array, R: Array, Z: Array, s: Array, factor: float = 1.0) -> Array | None:
        """See :func:`.response.local_square`; of the state x."""
        found: Array | None = local_square(self.scene, R, Z, s, self.square(x, factor))
        return found

    def response_at(self, x: Array, R: Array, Z: Array, s: Array, factor: float = 1.0) -> Material:
        """How the membrane answers strains at points of the meridian in the state x: per thickness, in units of the local modulus."""
        return response_of(self.scene, self.local_square(x, R, Z, s, factor))

    @cached_property
    def electrode(self) -> Array | None:
        """The column of that name of :func:`.response_columns` at the quadrature points; None where all points are alike."""
        space = self.space
        return response_columns(self.scene, space.R, space.Z, space.s).get(ELECTRODE)

    @cached_property
    def bulk(self) -> Array:
        """Weights of the integral of the thickness over the reference area, with the 2 pi, shape (n_quadrature, n_elements)."""
        space = self.space
        thickness = 1.0 if self.sheet is None else self.sheet.factors(space.R, space.Z, space.s)[0]
        return space.area_weights if np.isscalar(thickness) else space.area_weights * thickness

    @cached_property
    def mass(self) -> Array:
        """Mass matrix of the membrane, over that of its reference area, in band storage, shape (3 kd + 1, n_free)."""
        return self.space.mass_band(self.bulk)

    @cached_property
    def area(self) -> float:
        """Reference area of the membrane, of an uneven one times its thickness."""
        return float(self.bulk.sum())

    @cached_property
    def arc_band(self) -> Array:
        """The inner product of (x, P), which is the same on every mesh: mean over the reference area of the displacements plus P Q, both in
        units of the membrane's own size. In band storage, shape (3 kd + 1, n_free + 1).
        """
        square = self.space.unit**2
        band = np.zeros((self.space.n_free + 1, len(self.mass)))
        band[:-1] = self.mass.T / (self.area * square)
        band[-1, 2 * self.space.half_bandwidth] = square
        return band.T

    @cached_property
    def rigid(self) -> Array | None:
        """Where the membrane can move along the axis as a whole: the mass times that motion, of mass one, shape (n_free, 1)."""
        space = self.space
        if space.pin is None:
            return None
        density = np.zeros((4, *space.R.shape))
        density[2] = self.bulk
        return space.assemble_vector(density.reshape(-1, space.n_elements))[:, None] / np.sqrt(self.area)

    @cached_property
    @BUILDING
    def point_function(self) -> ca.Function:
        """(data, local variables, (P, factor on sources and loads)) -> values, gradients and the Hessian at one point."""
        t, (data, local, parameters) = self.terms, self.symbols
        hessian = t["hessian"] - parameters[0] * ca.jacobian(t["volume_gradient"], local)
        rows = [
            t["elastic"],
            t["magnetic"],
            t["volume"],
            t["gradient"],
            t["volume_gradient"],
            *(hessian[i, j] for i, j in HESSIAN_PAIRS),
            t["stress"],
        ]
        return ca.Function("point", [data, local, parameters], [ca.densify(ca.vertcat(*rows))], {"cse": True})

    @property
    def operations(self) -> int:
        """Number of elementary operations that one point costs: terms that the scene lacks do not appear."""
        return int(self.point_function.n_instructions())

    @property
    def elements(self) -> Elements:
        """The elements of this potential in the kernels in use."""
        in_use = kernels()
        return self._elements.get(in_use.name) or self._elements.setdefault(in_use.name, in_use.elements(self.space, self._point))

    @cached_property
    def _point(self) -> PointProgram:
        return PointProgram(self.point_function, self.point_data, None if self._like is None else self._like._point)

    def evaluate(self, x: Array, pressure: float, magnetic: float = 1.0) -> Evaluation:
        """Value, gradient and Hessian of E - P V at the free coefficients x; ``magnetic`` scales sources and loads."""
        return self._evaluated(x, pressure, magnetic, magnetic)

    def _evaluated(self, x: Array, pressure: float, slot: float, magnetic: float) -> Evaluation:
        """:meth:`evaluate` with what the point function takes for the factor on sources and loads."""
        elements, x = self.elements, np.ascontiguousarray(x, dtype=float)
        if self.charged is None:
            return Evaluation(x, *elements.evaluate(x, pressure, slot), self, elements, magnetic)
        square, spring = self.charged.at(x, slot)
        return Evaluation(x, *elements.evaluate(x, pressure, slot, square), self, elements, magnetic, spring)

    def load_energy(self, x: Array, factor: float = 1.0) -> float:
        """Energy of the loads at the free coefficients x, with the 2 pi; 0 without loads. ``factor`` as in :meth:`evaluate`."""
        if not self.loads:
            return 0.0
        parameters = np.array([0.0, factor] if self.charged is None else [0.0, factor, 0.0])  # a voltage is no load
        return float(self._load_kernel(self.space.at_quadrature(x), parameters).sum())

    @cached_property
    @BUILDING
    def _load_kernel(self) -> Replay:
        return Replay(ca.Function("load", list(self.symbols), [self.terms["load"]], {"cse": True}), self.point_data)

    def electric_energy(self, x: Array, factor: float = 1.0) -> float:
        """Energy of voltage or charge at the free coefficients x, with the 2 pi; 0 without. ``factor`` as in :meth:`evaluate`."""
        if self.electric is None:
            return 0.0
        if self.charged is not None:
            return self.charged.energy(x, factor)
        return float(self._electric_kernel(self.space.at_quadrature(x), np.array([0.0, factor])).sum())

    def _field_squared(self, x: Array, factor: float = 1.0) -> Array:
        """Square of the true field at the quadrature points."""
        space, sheet = self.space, self.sheet
        u, u_x, _, w_x = space.displacement_at_quadrature(x)
        strains = hencky_strains(space.R, space.R_x, space.Z_x, u, u_x, w_x)
        response: Any = self.response_at(x, space.R, space.Z, space.s, factor)
        modulus = 1.0 if sheet is None else sheet.factors(space.R, space.Z, space.s)[1]
        square: Array = response.field_squared(*strains) * modulus
        return square

    def largest_field(self, x: Array, factor: float = 1.0) -> float:
        """Largest true field at the quadrature points."""
        return math.sqrt(float(self._field_squared(x, factor).max()))

    def electric_quantities(self, x: Array) -> dict[str, float]:
        """Voltage, charge, capacitance and the largest true field of a state; zeros without voltage and charge, and NaN for what a frozen
        charge does not have.
        """
        names = ("voltage", "charge", "capacitance", "electric_field")
        if self.electric is None:
            return dict.fromkeys(names, 0.0)
        space, largest = self.space, self.largest_field(x)
        if self.electric.frozen_charge is not None:
            covered = float((space.area_weights * self.electric.covers(space.s)).sum())
            return dict(zip(names, (np.nan, self.electric.frozen_charge * covered, np.nan, largest), strict=True))
        phi = math.sqrt(self.square(x) or 0.0)
        capacitance = 2 * abs(self.electric_energy(x)) / phi**2
        return dict(zip(names, (phi, phi * capacitance, capacitance, largest), strict=True))

    @cached_property
    @BUILDING
    def _electric_kernel(self) -> Replay:
        return Replay(ca.Function("electric", list(self.symbols), [self.terms["electric"]], {"cse": True}), self.point_data)

    @cached_property
    def _circles(self) -> tuple[Any, ...]:
        return tuple(circle for source in self.sources for circle in source.circles)

    def distance_to_sources(self, x: Array) -> float:
        """Smallest distance of poles, hubs and quadrature points from a source; infinite without sources."""
        if not self.sources:
            return np.inf
        space = self.space
        u, _, w, _ = self.elements.at_quadrature(np.ascontiguousarray(x)).reshape(4, *space.R.shape)
        rho, eta, poles = space.lifted[0] + u, space.lifted[2] + w, space.axis_heights(x)
        square = [s.distance_squared(rho, eta).min() for s in self.sources]
        # a source all along the axis may run through hubs; a scene with a pole refuses it
        square += [s.distance_squared(0.0, pole) for s in self.sources if "along" in s.sees for pole in poles]
        return math.sqrt(min(square))

    def passed_source(self, before: Array, after: Array) -> bool:
        """Whether the membrane went through a source between two states. No branch does, but a step on a coarse mesh may jump across."""
        if not self.sources:
            return False
        for heights in zip(self.space.axis_heights(before), self.space.axis_heights(after), strict=True):
            for source in self.sources:
                if source.passed(*heights):
                    return True
        if not self._circles:
            return False
        meridians = [self._meridian(x) for x in (before, after)]
        return any(swept(meridians[0], meridians[1], circle) for circle in self._circles)

    def _meridian(self, x: Array) -> Array:
        """Positions (rho, eta) of the nodes, shape (2, n)."""
        s = self.space.node_parameters()
        (R, Z), (u, _, w, _) = self.space.mesh.position(s), self.space.displacement(x, s)
        return np.stack([R + u, Z + w])

    def largest(self, x: Array) -> tuple[float, float]:
        """Largest sizes of a vector of unknowns among u and among w; infinite where there is no number."""
        return self.elements.largest(np.ascontiguousarray(x))

    def force_scale(self, evaluation: Evaluation, pressure: float) -> tuple[float, float]:
        """Sum of the absolute forces that meet at the nodes, largest for u and for w: what a residual is to be compared with."""
        return evaluation.force_scale(pressure)

    def response(self, e1: Array, e2: Array, square: Array | None = None) -> Array:
        """Principal stresses that the energy feels and their derivatives with respect to the Hencky strains, where the modulus is 1.

        Parameters
        ----------
        e1, e2 : ndarray
        square : ndarray, optional
            :meth:`local_square` at the points, with voltage or charge.

        Returns
        -------
        ndarray, shape (5, n)
            s_1, s_2, ds_1/de_1, ds_1/de_2, ds_2/de_2 in units of mu.
        """
        return at_points(self._response_function, e1, e2, *([] if square is None else [square]))

    @cached_property
    @BUILDING
    def _response_function(self) -> ca.Function:
        e = ca.SX.sym("e", 2 if self.electric is None else 3)
        with casadi_answers_numpy():
            response = response_of(self.scene, None if self.electric is None else e[2])
            stress, tangent = response_expressions(response, e)
        return point_rows([e], [stress, tangent[0, 0], tangent[0, 1], tangent[1, 1]])

    def field_energy(self, rho: Array, eta: Array) -> Array:
        """Energy density of sources and loads per reference area and its derivatives with respect to the position.

        Returns
        -------
        ndarray, shape (6, n)
            m, m_rho, m_eta, m_rho_rho, m_rho_eta, m_eta_eta in units of mu T, where the thickness is 1; zeros without sources and loads.
            A magnetic energy that depends on the slope is not part of it, see :meth:`wave_energy`.
        """
        if not self.surrounded:
            return np.zeros((6, np.size(rho)))
        return at_points(self._field_energy_function, rho, eta)

    @cached_property
    @BUILDING
    def _field_energy_function(self) -> ca.Function:
        y = ca.SX.sym("y", 2)
        with casadi_answers_numpy():
            density = over_reference(self.loads, y[0], y[1]) + ca.SX(0)
            near, scene = Nearby(self.sources, y[0], y[1]), self.scene
            if self.sources and not self.tilts:
                density += position_energy_density(near.sources, scene.susceptibility or 0.0, scene.saturation, y[0], y[1])
            hessian, gradient = ca.hessian(density, y)
            density, gradient, hessian = near.placed(density, gradient, hessian)
        return point_rows([y], [density, gradient, hessian[0, 0], hessian[0, 1], hessian[1, 1]])

    @property
    def field_operations(self) -> int:
        """Number of elementary operations of :meth:`field_energy` at one point."""
        return int(self._field_energy_function.n_instructions())

    @property
    def tilts(self) -> bool:
        """Whether the magnetic energy depends on the slope of the meridian."""
        return self.magnetisation is not None and self.magnetisation.tilts

    def wave_energy(self, rho: Array, eta: Array, slopes: tuple[Array, Array], R: Array, Z: Array, s: Array) -> Array | None:
        """Second derivatives of a magnetic energy that depends on the slope, see :func:`.magnetic.wave_function`; None without one.

        Parameters
        ----------
        rho, eta, slopes : ndarray
            Position and its derivatives with respect to the arc length of the reference meridian.
        R, Z, s : ndarray
            Reference meridian.

        Returns
        -------
        ndarray, shape (25, n)
            In units of mu T, where the thickness is 1.
        """
        if not self.tilts:
            return None
        remanence = remanence_column(self.magnetisation, R, Z, s, self.space.side)
        return at_points(self._wave_function, rho, eta, *slopes, R, np.zeros_like(rho) if remanence is None else remanence)

    @cached_property
    @BUILDING
    def _wave_function(self) -> ca.Function:
        with casadi_answers_numpy():
            return wave_function(cast(Magnetisation, self.magnetisation), self.sources)


def potential_of(scene: Scene) -> Potential:
    """The potential of a scene, built once: scenes that differ only in what is done with it share one.

    Raises
    ------
    InputError
        While the mesh of the scene is still to be chosen.
    """
    require_elements(scene)
    return _potential_of(_plain(scene))


@lru_cache(maxsize=256)
def _plain(scene: Scene) -> Scene:
    """The scene without what makes no difference to its potential."""
    electric = scene.electricity
    if electric is None and scene.electric is not None and scene.electric.ends:  # elements end there
        electric = scene.electric.plain(scene.scales)
    ratio = scene.radius_to_thickness if scene.bending else 1.0  # no equilibrium knows it
    plain = {"radius_to_thickness": ratio, "scales": None, "electric": electric}
    return scene.replace(title="", follow_zones=scene.follows_zones, run=None, analysis=type(scene.analysis)(), **plain)


def require_elements(scene: Scene) -> None:
    if scene.open:
        accuracy = getattr(scene.mesh, "accuracy", None)
        advice = "no mesh is chosen for it here; give elements and degree, or the scene of a branch from inflate, pressurize, trace or run"
        raise InputError("mesh.accuracy", accuracy, advice)


@lru_cache(maxsize=64)
def _potential_of(scene: Scene) -> Potential:
    if not scene.follows:
        return Potential(scene)
    from .contact import ContactPotential
    from .following import WrinklingPotential

    return ContactPotential(scene) if scene.bodies else WrinklingPotential(scene)
