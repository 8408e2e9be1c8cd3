"""The total potential of a scene on its finite-element space, with exact derivatives.

Only the terms that the scene has are written down, as one CasADi expression at a point in the local variables (u, u_x, w, w_x)::

    E = Int W(e_1, e_2) R dS + [Int -chi/2 |h|^2 R dS] + [loads],       V = Int rho rho_x eta dx,       both with the 2 pi

(where an end is not held in the plane z = 0, V is closed by flat lids, :mod:`.physics.loads`.)

CasADi differentiates it twice, and the instructions of the result are replayed on whole vectors of points, which costs a small part of
mapping the scalar function over them. Assembly is a constant linear map of the values at the points (:mod:`.discretization.space`), the
same for the Newton corrector (NumPy arrays, banded) and for IPOPT (CasADi functions, sparse).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from .discretization.space import HESSIAN_PAIRS, Space, anchored, space_of
from .errors import InputError
from .native import native
from .physics.kinematics import hencky_strains
from .physics.loads import Load, hub_density, lidded_volume_density, on_hubs, over_projection, over_reference, volume_density, wall_density
from .physics.magnetics import Source, acting_sources, magnetic_energy_density, swept
from .physics.tension_field import strain_energy
from .threads import Guard, cached_property

if TYPE_CHECKING:
    from ._native import Elements
    from .physics.materials import Material
    from .scene import Scene

Array = NDArray[np.float64]

#: points evaluated in one go; larger vectors leave the processor's cache
_BLOCK = 1024


#: held while expressions are built: CasADi has one mode for all threads that says what a product of symbols is
BUILDING = Guard()


@dataclass(slots=True)
class Evaluation:
    """Value, gradient and Hessian of E and V at one state x; energies and volume with the 2 pi.

    ``stress`` are the principal mechanical stresses at the quadrature points, shape (2, n_points); ``force_density`` is what was
    integrated to the two gradients, for judging a residual; ``stiffness_density`` is what :attr:`band` integrates.
    """

    x: Array
    elastic_energy: float
    magnetic_energy: float
    volume: float
    gradient: Array
    volume_gradient: Array
    stress: Array
    force_density: Array
    stiffness_density: Array
    potential: Potential
    factor: float = 1.0
    _band: Array | None = None

    @property
    def band(self) -> Array:
        """E'' - P V'' in LAPACK band storage, shape (3 kd + 1, n_free): assembled when first asked for, as not every state needs it."""
        if self._band is None:
            self._band = self.potential.assemble_band(self.stiffness_density)
        return self._band

    @property
    def load_energy(self) -> float:
        """Energy of the loads at x: computed only when asked for, as no solver needs it."""
        return self.potential.load_energy(self.x, self.factor)

    @property
    def energy(self) -> float:
        return self.elastic_energy + self.magnetic_energy + self.load_energy


class Potential:
    """Discrete potential of a scene.

    Parameters
    ----------
    scene : Scene
    quadrature : int, optional
        Polynomial degree integrated exactly; default 2 degree + 1.
    """

    @BUILDING
    def __init__(self, scene: Scene, quadrature: int | None = None) -> None:
        self.scene = scene
        fixed = anchored(scene)
        self.space = space_of(scene.mesh, scene.degree, fixed) if quadrature is None else Space(scene.mesh, scene.degree, quadrature, fixed)
        space = self.space
        if not space.n_free:
            advice = f"of degree {scene.degree}, between these ends, nothing can move; more elements or a higher degree are allowed"
            raise InputError("mesh.elements", space.n_elements, advice)
        self.sources = acting_sources(scene.sources, scene.susceptibility)  # nothing is built of others
        self.loads = tuple(load for load in scene.loads if load.acts)
        if space.lids and any(type(load).over_projection is not Load.over_projection for load in self.loads):
            advice = (
                "a liquid fills shapes that are closed by the plane z = 0 or by poles; leave it out, or choose such a shape and supports"
            )
            raise InputError("load", self.loads, advice)
        pulled = any(type(load).on_hubs is not Load.on_hubs for load in self.loads)
        forces = on_hubs(self.loads, [end.rigid for end in space.supports]) if pulled else None
        self.flat = not (space.Z.any() or space.Z_x.any())
        columns = {"R": space.R, "R_x": space.R_x, "weight": space.weights}
        if not self.flat:
            columns |= {"Z": space.Z, "Z_x": space.Z_x}
        if space.wall is not None:
            columns |= {"wall": space.wall[0], "wall_x": space.wall[1]}
        if forces is not None:
            columns |= dict(zip(("hub", "hub_x"), space.between([-1.0, 0.0]), strict=True))
        self.point_data: Array = np.stack([c.ravel() for c in columns.values()])
        with _casadi_answers_numpy():
            self.symbols, self.terms = _point_expressions(scene, self.sources, self.loads, tuple(columns), space, forces)
        self.n_points = self.point_data.shape[1]
        self._force_shape = (2, 4 * space.n_quadrature, space.n_elements)

    @property
    def surrounded(self) -> bool:
        """Whether anything but the pressure acts on the membrane: without, the flat unloaded state is an equilibrium of no stiffness."""
        return bool(self.sources or self.loads)

    @property
    def material(self) -> Material:
        """The strain energy of the membrane: the scene's material, or its tension field."""
        return strain_energy(self.scene.material, self.scene.tension_field)

    @cached_property
    def mass(self) -> Array:
        """Mass matrix of the reference area in band storage, shape (3 kd + 1, n_free)."""
        return self.space.mass_band()

    @property
    def area(self) -> float:
        """Reference area of the membrane."""
        return self.space.reference_area

    @cached_property
    def rigid(self) -> Array | None:
        """Where the membrane can move along the axis as a whole: the mass times that motion, of mass one, shape (n_free, 1)."""
        space = self.space
        if space.pin is None:
            return None
        density = np.zeros((4, *space.R.shape))
        density[2] = space.weights * space.R * np.hypot(space.R_x, space.Z_x)
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

    @cached_property
    def _kernel(self) -> _Kernel:
        return _Kernel(self.point_function, self.point_data)

    @property
    def elements(self) -> Elements | None:
        """The compiled elements of this potential; None where the compiled half is missing, or lacks an operation of the point function."""
        return None if native() is None else self._elements

    @cached_property
    def _elements(self) -> Elements | None:
        module = native()
        tape = None if module is None else record_tape(self.point_function, module.OPERATIONS)
        if module is None or tape is None:
            return None
        space = self.space
        field = np.zeros(space.n_free, dtype=np.int64)
        field[space.fields[1]] = 1
        n_local = space.gather.shape[0] // 2
        table, gather = np.ascontiguousarray(space.table), np.ascontiguousarray(space.gather)
        return module.Elements(tape, self.point_data, gather, table, field, space.n_quadrature, n_local, space.half_bandwidth)

    def evaluate(self, x: Array, pressure: float, magnetic: float = 1.0) -> Evaluation:
        """Value, gradient and Hessian of E - P V at the free coefficients x; ``magnetic`` scales sources and loads."""
        elements = self.elements
        if elements is None:
            return self._evaluate(x, pressure, magnetic)
        gradients, densities = self.results()
        values = elements.evaluate(np.ascontiguousarray(x), np.array([pressure, magnetic], dtype=float), gradients, densities)
        return self.evaluation(x, values, gradients, densities, magnetic)

    def results(self) -> tuple[Array, Array]:
        """Room for the gradients (2, n_free) and the densities (20, n_points) that the compiled elements answer with."""
        return np.empty((2, self.space.n_free)), np.empty((20, self.n_points))

    def evaluation(
        self, x: Array, values: tuple[float, float, float], gradients: Array, densities: Array, factor: float = 1.0
    ) -> Evaluation:
        """What the compiled elements answer, by names."""
        stiffness = densities[8:18].reshape(-1, self.space.n_elements)
        return Evaluation(x, *values, gradients[0], gradients[1], densities[18:], densities[:8], stiffness, self, factor)

    def assemble_band(self, stiffness_density: Array) -> Array:
        """:meth:`.Space.assemble_band`, compiled where possible."""
        elements = self.elements
        if elements is None:
            with np.errstate(invalid="ignore"):
                return self.space.assemble_band(stiffness_density)
        band = np.zeros((self.space.n_free, 3 * self.space.half_bandwidth + 1))
        elements.assemble(stiffness_density, band)
        return band.T

    def _evaluate(self, x: Array, pressure: float, magnetic: float) -> Evaluation:
        space, shape = self.space, self._force_shape
        out = self._kernel(space.at_quadrature(x), np.array([pressure, magnetic]))
        with np.errstate(invalid="ignore", over="ignore"):  # outside the domain of the energy NaN is the answer, and the caller's to judge
            e, m, v = out[:3].sum(axis=1).tolist()
            force_density = out[3:11].copy()
            gradient, volume_gradient = space.assemble_vectors(force_density.reshape(shape))
        stiffness_density = out[11:21].reshape(-1, space.n_elements).copy()
        return Evaluation(x, e, m, v, gradient, volume_gradient, out[21:23].copy(), force_density, stiffness_density, self, magnetic)

    def load_energy(self, x: Array, factor: float = 1.0) -> float:
        """Energy of the loads at the free coefficients x, with the 2 pi; 0 without loads. ``factor`` as in :meth:`evaluate`."""
        if not self.loads:
            return 0.0
        return float(self._load_kernel(self.space.at_quadrature(x), np.array([0.0, factor])).sum())

    @cached_property
    @BUILDING
    def _load_kernel(self) -> _Kernel:
        return _Kernel(ca.Function("load", list(self.symbols), [self.terms["load"]], {"cse": True}), self.point_data)

    def distance_to_sources(self, x: Array) -> float:
        """Smallest distance of poles, hubs and quadrature points from a source; infinite without sources."""
        if not self.sources:
            return np.inf
        space, elements = self.space, self.elements
        local = np.empty((4, *space.R.shape))
        if elements is None:
            local[...] = space.at_quadrature(x).reshape(local.shape)
        else:
            elements.at_quadrature(np.ascontiguousarray(x), local)
        u, _, w, _ = local
        rho, eta, poles = space.R + u, space.Z + w, space.axis_heights(x)
        square = [s.distance_squared(rho, eta).min() for s in self.sources]
        # a source all along the axis runs through hubs, and through a pole nowhere (a scene refuses it)
        square += [s.distance_squared(0.0, pole) for s in self.sources if "along" in s.sees for pole in poles]
        return math.sqrt(min(square))

    def passed_source(self, before: Array, after: Array) -> bool:
        """Whether the membrane went through a source between two states: no branch does, but a step of a coarse mesh may jump across."""
        if not self.sources:
            return False
        heights = zip(self.space.axis_heights(before), self.space.axis_heights(after), strict=True)
        if any(source.passed(*pair) for pair in heights for source in self.sources):
            return True
        circles = [circle for source in self.sources for circle in source.circles]
        if not circles:
            return False
        meridians = [self._meridian(x) for x in (before, after)]
        return any(swept(meridians[0], meridians[1], circle) for circle in circles)

    def _meridian(self, x: Array) -> Array:
        """Positions (rho, eta) of the nodes, shape (2, n)."""
        s = self.space.node_parameters()
        (R, Z), (u, _, w, _) = self.space.mesh.position(s), self.space.evaluate(x, s)
        return np.stack([R + u, Z + w])

    def largest(self, x: Array) -> tuple[float, float]:
        """Largest sizes of a vector of unknowns among u and among w; infinite where there is no number."""
        if (elements := self.elements) is not None:
            return elements.largest(np.ascontiguousarray(x))
        u, w = (float(np.abs(x[index]).max(initial=0.0)) for index in self.space.fields)
        return u if u < np.inf else np.inf, w if w < np.inf else np.inf

    def force_scale(self, evaluation: Evaluation, pressure: float) -> tuple[float, float]:
        """Sum of the absolute forces that meet at the nodes, largest for u and for w: what a residual is to be compared with."""
        if (elements := self.elements) is not None:
            return elements.force_scale(np.ascontiguousarray(evaluation.force_density), pressure)
        density = np.abs(evaluation.force_density).reshape(self._force_shape)
        return self.largest(self.space.assemble_magnitude(density[0] + abs(pressure) * density[1]))

    def response(self, e1: Array, e2: Array) -> Array:
        """Principal mechanical stresses and their derivatives with respect to the Hencky strains.

        Returns
        -------
        ndarray, shape (5, n)
            s_1, s_2, ds_1/de_1, ds_1/de_2, ds_2/de_2 in units of mu.
        """
        return _at_points(self._response_function, e1, e2)

    @cached_property
    @BUILDING
    def _response_function(self) -> ca.Function:
        e = ca.SX.sym("e", 2)
        with _casadi_answers_numpy():
            stress, tangent = _response(self.material, e)
        return _point_rows([e], [stress, tangent[0, 0], tangent[0, 1], tangent[1, 1]])

    def field_energy(self, rho: Array, eta: Array) -> Array:
        """Energy density of sources and loads per reference area and its derivatives with respect to the position.

        Returns
        -------
        ndarray, shape (6, n)
            m, m_rho, m_eta, m_rho_rho, m_rho_eta, m_eta_eta in units of mu T; zeros without sources and loads.
        """
        if not self.surrounded:
            return np.zeros((6, np.size(rho)))
        return _at_points(self._field_energy_function, rho, eta)

    @cached_property
    @BUILDING
    def _field_energy_function(self) -> ca.Function:
        y = ca.SX.sym("y", 2)
        with _casadi_answers_numpy():
            density = over_reference(self.loads, y[0], y[1]) + ca.SX(0)
            if self.sources:
                density += magnetic_energy_density(self.sources, self.scene.susceptibility or 0.0, y[0], y[1])
        hessian, gradient = ca.hessian(density, y)
        return _point_rows([y], [density, gradient, hessian[0, 0], hessian[0, 1], hessian[1, 1]])


@dataclass(slots=True)
class FoldDerivatives:
    """Derivatives that a fold followed in a number of the scene needs, for a mode (v, q) of displacement and pressure.

    ``cubic``, ``cubic_pressure`` and ``cubic_number`` are those of the quadratic form v.(E'' - P V'') v - 2 q V'.v with respect to x (shape
    (n_free,)), P and the number; ``force_number`` is that of E' - P V' with respect to the number, shape (n_free,).
    """

    cubic: Array
    cubic_pressure: float
    cubic_number: float
    force_number: Array


class Family(Potential):
    """The potential of scenes that differ in one number, built once for all its values.

    It is a :class:`Potential` whose factor, third argument of :meth:`evaluate`, is the number.

    Parameters
    ----------
    scene : Scene
        Any member of the family.
    vary : callable
        The parts of the member at a value of the number, a CasADi symbol here: an object with the attributes of a scene.
    """

    @BUILDING
    def __init__(self, scene: Scene, vary: Callable[[Any], Any], quadrature: int | None = None) -> None:
        _require_elements(scene)
        number = ca.SX.sym("number")
        with _casadi_answers_numpy():
            super().__init__(vary(number), quadrature)
        self.scene, self.sources, self.loads = scene, scene.sources, scene.loads
        slot = self.symbols[2][1]
        names = list(self.terms)
        old, new = ca.vertcat(slot, number), ca.vertcat(1.0, slot)
        self.terms = {name: ca.substitute(self.terms[name], old, new) for name in names}

    @cached_property
    @BUILDING
    def _fold_kernel(self) -> _Kernel:
        t, (data, local, parameters) = self.terms, self.symbols
        mode, q = ca.SX.sym("mode", 4), ca.SX.sym("q")
        force = t["gradient"] - parameters[0] * t["volume_gradient"]
        form = ca.dot(mode, ca.jtimes(force, local, mode)) - 2 * q * ca.dot(t["volume_gradient"], mode)
        rows = [ca.gradient(form, local), ca.gradient(form, parameters), ca.jacobian(force, parameters[1])]
        symbols = [data, ca.vertcat(local, mode), ca.vertcat(parameters, q)]
        return _Kernel(ca.Function("fold", symbols, [ca.densify(ca.vertcat(*rows))], {"cse": True}), self.point_data)

    def fold_derivatives(self, x: Array, pressure: float, number: float, mode: Array, q: float) -> FoldDerivatives:
        """Third derivatives contracted twice with a mode (v, q), and derivatives with respect to the number."""
        space, ne = self.space, self.space.n_elements
        local = np.concatenate([space.at_quadrature(x), space.at_quadrature(mode)])
        out = self._fold_kernel(local, np.array([pressure, number, q]))
        cubic, force = (space.assemble_vector(rows.reshape(-1, ne)) for rows in (out[:4], out[6:]))
        return FoldDerivatives(cubic, float(out[4].sum()), float(out[5].sum()), force)


@dataclass(frozen=True)
class StrainEnergy:
    """A strain energy of one's own; it has no name in scene files.

    Stress and tangent are the exact derivatives by CasADi. They keep the digits that the function keeps: a difference of numbers of order
    one leaves round-off of 1e-16 mu in the stress, too coarse for a nearly flat membrane (strains below 1e-8), not for any other.

    Parameters
    ----------
    function : callable
        W(lambda_1, lambda_2) of an isotropic incompressible membrane in units of the shear modulus: arithmetic and NumPy's ufuncs, which
        act on arrays and CasADi symbols alike (``np.where`` does not).

    Raises
    ------
    InputError
        For a function that does not accept symbols, is not 0 and free of stress at rest, is not symmetric in the two stretches, or whose
        shear modulus is not 1.
    """

    function: Callable[[Any, Any], Any]

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise InputError("material.function", self.function, "a function of the stretches (lambda_1, lambda_2) is allowed")
        try:
            rest, there, mirrored = _at_points(_derivatives(self.function), np.array([0, 0.2, 0.1]), np.array([0, 0.1, 0.2])).T
        except Exception as error:  # whatever a stranger's function raises
            what = f"it must accept symbols ({type(error).__name__}: {error}); use arithmetic and NumPy's ufuncs"
            raise InputError("material.function", self.function, what) from error
        if not np.allclose(rest[:3], 0, atol=1e-10):
            found = ", ".join(f"{v:.6g}" for v in rest[:3])
            raise InputError("material.function", self.function, f"W and both stresses must be 0 at rest, not {found}")
        if not np.allclose(there, mirrored[[0, 2, 1, 5, 4, 3]], rtol=1e-8):
            raise InputError("material.function", self.function, "it must be symmetric in the two stretches (isotropic)")
        if not np.allclose(rest[3:], [4, 2, 4], rtol=1e-6):
            what = f"the shear modulus must be 1, not {rest[4] / 2:.9g}; divide W by it (W = 2 (e1^2 + e1 e2 + e2^2) at small log strains)"
            raise InputError("material.function", self.function, what)

    def energy(self, e1: Any, e2: Any) -> Any:
        return self.function(np.exp(e1), np.exp(e2))

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        s1, s2 = self._rows(e1, e2)[1:3]
        return s1, s2

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        s11, s12, s22 = self._rows(e1, e2)[3:]
        return s11, s12, s22

    def _rows(self, e1: Any, e2: Any) -> list[Any]:
        function = _derivatives(self.function)
        if isinstance(e1, ca.SX) or isinstance(e2, ca.SX):
            return list(ca.vertsplit(function(ca.vertcat(e1, e2))))
        e1, e2 = np.broadcast_arrays(np.asarray(e1, dtype=float), np.asarray(e2, dtype=float))
        return [row.reshape(e1.shape) for row in _at_points(function, e1, e2)]


@lru_cache(maxsize=64)
@BUILDING
def _derivatives(function: Callable[[Any, Any], Any]) -> ca.Function:
    """(e_1, e_2) -> W, s_1, s_2, and the second derivatives with respect to the Hencky strains."""
    e = ca.SX.sym("e", 2)
    with _casadi_answers_numpy():
        energy = function(np.exp(e[0]), np.exp(e[1]))
    hessian, gradient = ca.hessian(energy, e)
    return _point_rows([e], [energy, gradient, hessian[0, 0], hessian[0, 1], hessian[1, 1]])


class _Kernel:
    """A point function replayed on vectors of points, called through preallocated buffers."""

    @BUILDING
    def __init__(self, function: ca.Function, data: Array) -> None:
        n = data.shape[1]
        self.block = min(n, _BLOCK)
        self.n_blocks = -(-n // self.block)
        self.n, self.rows = n, function.numel_out(0)
        vector = vectorise(function, self.block)
        if self.n_blocks > 1:
            vector = vector.map("blocks", "serial", self.n_blocks, [2], [])
        self._data = self._split(data)
        self._local = np.ones((self.n_blocks, function.numel_in(1), self.block))
        self._parameters = np.zeros(function.numel_in(2))
        self._out = np.zeros((self.n_blocks, self.rows, self.block))
        self._lock = Guard()
        self._buffer, self._call = vector.buffer()
        for k, array in enumerate((self._data, self._local, self._parameters)):
            self._buffer.set_arg(k, memoryview(array))  # type: ignore[arg-type, call-arg]
        self._buffer.set_res(0, memoryview(self._out))  # type: ignore[arg-type, call-arg]

    def _split(self, rows: Array) -> Array:
        """(rows, n) -> (n_blocks, rows, block), the last block filled up with its own last point."""
        padded = np.pad(rows, ((0, 0), (0, self.n_blocks * self.block - self.n)), mode="edge")
        return np.ascontiguousarray(padded.reshape(len(rows), self.n_blocks, self.block).transpose(1, 0, 2))

    def __call__(self, local: Array, parameters: Array) -> Array:
        """Values at all points, shape (rows, n)."""
        with self._lock:  # threads that work on one scene share the buffers
            return self._answer(local.reshape(-1, self.n), parameters).copy()

    def _answer(self, local: Array, parameters: Array) -> Array:
        self._local[...] = local if self.n_blocks == 1 else self._split(local)
        self._parameters[:] = parameters
        self._call()
        if self.n_blocks == 1:
            return self._out[0]
        return self._out.transpose(1, 0, 2).reshape(self.rows, -1)[:, : self.n]


def vectorise(function: ca.Function, n: int) -> ca.Function:
    """Replay the instructions of a scalar function on vectors of n points.

    Parameters
    ----------
    function : casadi.Function
        Expanded to scalars; its last input is shared by all points, its one output is a dense column.

    Returns
    -------
    casadi.Function
        Inputs of shape (n, rows) (the last one unchanged), output of shape (n, rows): row by row contiguous in memory.
    """
    last = function.n_in() - 1
    arguments = [ca.MX.sym(function.name_in(k), n if k < last else 1, function.numel_in(k)) for k in range(last + 1)]
    work: dict[int, ca.MX] = {}
    outputs: dict[int, ca.MX] = {}
    for k in range(function.n_instructions()):
        operation, source, target = function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_CONST:
            work[target[0]] = ca.MX(function.instruction_constant(k))
        elif operation == ca.OP_INPUT:
            work[target[0]] = arguments[source[0]][:, source[1]]
        elif operation == ca.OP_OUTPUT:
            outputs[target[1]] = work[source[0]]
        elif len(source) == 1:
            work[target[0]] = ca.MX.unary(operation, work[source[0]])
        else:
            work[target[0]] = ca.MX.binary(operation, work[source[0]], work[source[1]])
    columns = [c if c.numel() == n else ca.repmat(c, n, 1) for c in (outputs[k] for k in range(function.numel_out(0)))]
    return ca.Function(function.name() + "_vector", arguments, [ca.densify(ca.horzcat(*columns))])


def record_tape(
    function: ca.Function, operations: Sequence[str]
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, int, int, int, int, int] | None:
    """The instructions of a scalar function for the compiled half; None when one of them is none of its operations.

    Inputs and output are those of :func:`vectorise`. What depends on constants and on the last input alone is a scalar, numbered -1, -2,
    ... (constants, the last input, results); the rest are registers with a value for each point, numbered 0, 1, ... (inputs, outputs,
    CasADi's own work space). An instruction is (operation, target, left, right).

    Returns
    -------
    scalar, vector : ndarray of int, shape (n, 4)
    constants : ndarray
    n_parameters, n_scalars, n_inputs, n_registers, n_outputs : int
    """
    codes = {getattr(ca, f"OP_{name}"): code for code, name in enumerate(operations)}
    instructions = [
        (function.instruction_id(k), function.instruction_input(k), function.instruction_output(k))
        for k in range(function.n_instructions())
    ]
    last = function.n_in() - 1
    first_input = np.cumsum([0, *(function.numel_in(k) for k in range(last))])
    constants = [function.instruction_constant(k) for k, (operation, _, _) in enumerate(instructions) if operation == ca.OP_CONST]
    n_scalars, n_inputs = len(constants) + function.numel_in(last), int(first_input[-1])
    first_work = n_inputs + function.numel_out(0)
    lists: tuple[list[list[int]], list[list[int]]] = ([], [])
    work: dict[int, int] = {}
    known = 0
    for operation, source, target in instructions:
        if operation == ca.OP_CONST:
            known += 1
            work[target[0]] = -known
        elif operation == ca.OP_INPUT:
            work[target[0]] = int(first_input[source[0]]) + source[1] if source[0] < last else -1 - len(constants) - source[1]
        elif operation == ca.OP_OUTPUT:
            lists[1].append([operations.index("ASSIGN"), n_inputs + target[1], work[source[0]], work[source[0]]])
        elif operation in codes:
            operands = [work[k] for k in source]
            is_vector = max(operands) >= 0
            n_scalars += not is_vector
            work[target[0]] = first_work + target[0] if is_vector else -n_scalars
            lists[is_vector].append([codes[operation], work[target[0]], operands[0], operands[-1]])
        else:
            return None
    scalar, vector = (np.array(entries, dtype=np.int64).reshape(-1, 4) for entries in lists)
    sizes = function.numel_in(last), n_scalars, n_inputs, first_work + function.sz_w(), function.numel_out(0)
    return scalar, vector, np.array(constants), *sizes


def potential_of(scene: Scene) -> Potential:
    """The potential of a scene, built once: scenes that differ only in what is done with it share one.

    Raises
    ------
    InputError
        While the mesh of the scene is still to be chosen.
    """
    _require_elements(scene)
    return _potential_of(scene.replace(title="", run=None, analysis=type(scene.analysis)(), radius_to_thickness=1.0, scales=None))


def _require_elements(scene: Scene) -> None:
    if scene.open:
        accuracy = getattr(scene.mesh, "accuracy", None)
        advice = "no mesh is chosen for it here; give elements and degree, or the scene of a branch from inflate, pressurize, trace or run"
        raise InputError("mesh.accuracy", accuracy, advice)


@lru_cache(maxsize=64)
def _potential_of(scene: Scene) -> Potential:
    return Potential(scene)


def _point_expressions(
    scene: Scene,
    sources: Sequence[Source],
    loads: Sequence[Load],
    columns: Sequence[str],
    space: Space,
    forces: tuple[Any, Any] | None,
) -> tuple[tuple[ca.SX, ca.SX, ca.SX], dict[str, ca.SX]]:
    """Symbols (data, local, parameters) and the weighted densities with their gradients at one point; what is no column of data is 0."""
    data = ca.SX.sym("data", len(columns))
    local = ca.SX.sym("local", 4)
    parameters = ca.SX.sym("parameters", 2)
    flat = "Z" not in columns
    R, R_x, weight, Z, Z_x = (data[columns.index(c)] if c in columns else ca.SX(0) for c in ("R", "R_x", "weight", "Z", "Z_x"))
    u, u_x, w, w_x = (local[k] for k in range(4))
    e1, e2 = hencky_strains(R, R_x, Z_x, u, u_x, w_x)
    area = weight * R * (R_x if flat else np.sqrt(R_x**2 + Z_x**2))
    material = strain_energy(scene.material, scene.tension_field)
    stress, tangent = _response(material, ca.vertcat(e1, e2))
    # the chain rule through closed-form stresses keeps the digits that differentiating the energy would lose at small strain, and
    # written out it takes half the operations of differentiating the composition
    slopes = ca.jacobian(ca.vertcat(e1, e2), local)
    gradient = area * ca.mtimes(slopes.T, stress)
    bending = sum((stress[k] * ca.jacobian(slopes[k, :].T, local) for k in range(2)), ca.SX(4, 4))
    hessian = area * (ca.mtimes([slopes.T, tangent, slopes]) + bending)
    enclosed = lidded_volume_density(R + u, Z_x + w_x) if space.lids else volume_density(R + u, R_x + u_x, Z + w)
    if "wall" in columns:
        enclosed = enclosed + wall_density(data[columns.index("wall")], data[columns.index("wall_x")], w, w_x)
    inside = weight if space.side > 0 else -weight
    volume = inside * enclosed
    magnetic = ca.SX(0)
    if sources and scene.susceptibility:
        magnetic = area * magnetic_energy_density(sources, scene.susceptibility, R + u, Z + w)
        magnetic = parameters[1] * magnetic
        second, first = ca.hessian(magnetic, local)
        gradient, hessian = gradient + first, hessian + second
    load = ca.SX(0)
    if loads:
        load = area * over_reference(loads, R + u, Z + w) + inside * (R + u) * (R_x + u_x) * over_projection(loads, Z + w)[0]
        if forces is not None:
            hub, hub_x = (data[columns.index(c)] for c in ("hub", "hub_x"))
            load += weight / (2 * math.pi) * hub_density(forces, hub, hub_x, Z + w, Z_x + w_x)
        load = parameters[1] * load
        second, first = ca.hessian(load, local)
        gradient, hessian = gradient + first, hessian + second
    return (data, local, parameters), {
        "elastic": area * material.energy(e1, e2),
        "magnetic": magnetic,
        "load": load,
        "volume": volume,
        "gradient": gradient,
        "hessian": hessian,
        "volume_gradient": ca.gradient(volume, local),
        "stress": stress,
    }


def _response(material: Material, strains: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Principal stresses, shape (2, 1), and their derivative with respect to the Hencky strains, shape (2, 2)."""
    e1, e2 = strains[0], strains[1]
    s11, s12, s22 = material.tangent(e1, e2)
    return ca.vertcat(*material.stress(e1, e2)), ca.vertcat(ca.horzcat(s11, s12), ca.horzcat(s12, s22))


def _point_rows(symbols: list[ca.SX], rows: list[ca.SX]) -> ca.Function:
    return ca.Function("point_rows", symbols, [ca.densify(ca.vertcat(*rows))], {"cse": True})


def _at_points(function: ca.Function, *columns: Array) -> Array:
    values = np.stack([np.ravel(c) for c in columns])
    if values.shape[1] == 0:
        return np.zeros((function.numel_out(0), 0))
    return _kernel_at(function, values.shape[1])(values, np.zeros(0)).copy()


@lru_cache(maxsize=64)
@BUILDING
def _kernel_at(function: ca.Function, n: int) -> _Kernel:
    """A function of the local variables alone as a kernel at n points."""
    symbols = [ca.SX.sym("data", 0), function.sx_in(0), ca.SX.sym("parameters", 0)]
    return _Kernel(ca.Function("at_points", symbols, [function(symbols[1])]), np.zeros((0, n)))


@contextmanager
def _casadi_answers_numpy() -> Iterator[None]:
    """Let NumPy's ufuncs act on CasADi symbols here without changing the caller's setting; to be used under :data:`BUILDING`."""
    before = ca.GlobalOptions.getNumpyMode()
    ca.GlobalOptions.setNumpyMode(1)
    try:
        yield
    finally:
        ca.GlobalOptions.setNumpyMode(before)
