"""The total potential of a scene on its finite-element space.

CasADi differentiates the densities at a point twice. Assembly is a constant linear map of the values at the points
(:mod:`..discretization.space`), the same for the Newton corrector (NumPy arrays, banded) and for IPOPT (CasADi functions, sparse).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, cast

import casadi as ca
import numpy as np

from ..discretization.lift import Moving
from ..discretization.space import HESSIAN_PAIRS, Space, anchored, looked_at, space_of
from ..errors import InputError
from ..kernels import kernels
from ..kernels.interface import Array, Elements
from ..physics.along import Along
from ..physics.kinematics import hencky_strains
from ..physics.loads import Load, on_hubs
from ..physics.magnetics import swept
from ..physics.magnetisation import Magnetisation, remanence_column, sources_that_act
from ..physics.response import ELECTRODE, local_square, response_columns, response_of, squared
from ..physics.sheet import Sheet
from ..threads import cached_property
from .charge import Charged
from .evaluation import Evaluation
from .expressions import BUILDING, LIFT, MOVE, casadi_answers_numpy, point_expressions
from .point_terms import PointTerms
from .replay import PointProgram, Replay
from .template import expressions_of

if TYPE_CHECKING:
    from ..physics.electric import Electric
    from ..physics.materials import Material
    from ..physics.obstacles import Obstacle
    from ..scene import Scene


#: change of the factor on a voltage or a charge from which a derivative is taken
_LITTLE_AHEAD = 1e-5


class Potential(PointTerms):
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
    #: ends of elements that stand at borders, and their places
    borders: tuple[tuple[int, float], ...] = ()
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
            else looked_at(scene.mesh, scene.degree, fixed, ends, stretch, nodal)
            if quadrature == 0
            else Space(scene.mesh, scene.degree, quadrature, fixed, ends, stretch, nodal)
        )
        if borders := getattr(scene, "borders", ()):
            self.space = self.space.with_moved(borders, alone=bool(scene.bodies))
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

    def placed(self, x: Array, factor: float = 1.0) -> Array:
        """A state with the nodes that bodies hold moved onto them. ``factor`` as in :meth:`evaluate`."""
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

    def by_itself(self, factor: float) -> tuple[Potential, float]:
        """The potential that a minimiser takes, and its factor: this one, but for a family whose constraints change with its number."""
        return self, factor

    def pole_rise(self, factor: float) -> float:
        """How far the pole stands above its place in the space while all unknowns are zero: only a number that moves an end lifts it."""
        return 0.0

    @property
    def root(self) -> Potential:
        """The potential on the mesh of the scene: this one, unless ends of elements follow borders."""
        return self

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

    def evaluate(self, x: Array, pressure: float, magnetic: float = 1.0, slot: float | None = None) -> Evaluation:
        """Value, gradient and Hessian of E - P V at the free coefficients x; ``magnetic`` scales sources and loads. ``slot`` is what the
        point function takes for it, where that is another number.
        """
        elements, x = self.elements, np.ascontiguousarray(x, dtype=float)
        factor = magnetic if slot is None else slot
        if self.charged is None:
            return Evaluation(x, elements.evaluate(x, pressure, factor), self, elements, magnetic)
        square, spring = self.charged.at(x, factor)
        return Evaluation(x, elements.evaluate(x, pressure, factor, square), self, elements, magnetic, spring)

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
