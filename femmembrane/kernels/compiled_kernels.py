"""Kernels in C: the extension module ``femmembrane._native``."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

import numpy as np

from ..discretization.space import Space
from .interface import N_DENSITIES, Answer, Array, Elements, Pencil, PointFunction, Rayleigh, Step, Tape
from .numpy_kernels import NumpyKernels

if TYPE_CHECKING:
    from .. import _native

#: version of the interface, as the sources in ``compiled/`` state it; raised there and here when arguments or answers change
INTERFACE = 6


class CompiledKernels:
    """The implementation where the extension module was built.

    Bands are factored as L D L^T, which takes a third of the time of L U, wherever its pivots grow little, and as L U elsewhere. What C
    leaves open (a sign that rounding decides, a point function with an operation that C does not have) the NumPy kernels answer.
    """

    name = "compiled"

    def __init__(self, module: Any, otherwise: NumpyKernels) -> None:
        self.module, self._otherwise = module, otherwise

    @classmethod
    def load(cls, otherwise: NumpyKernels) -> CompiledKernels | None:
        """The kernels of the extension module. A module that was built from earlier sources is not used."""
        try:
            module = importlib.import_module("femmembrane._native")
        except ImportError:
            return None
        return cls(module, otherwise) if getattr(module, "INTERFACE", 0) == INTERFACE else None

    def elements(self, space: Space, point: PointFunction) -> Elements:
        tape = point.tape(self.module.OPERATIONS)
        # the sources know two parameters
        return (
            self._otherwise.elements(space, point)
            if tape is None or tape[3] != 2
            else CompiledElements(self.module, space, point.data, tape)
        )

    def factor(self, band: Array) -> CompiledFactor:
        return CompiledFactor(self.module.Factor(np.ascontiguousarray(band.T), band.shape[1], (band.shape[0] - 1) // 3))

    def product(self, band: Array, half_bandwidth: int, x: Array) -> Array:
        y = np.empty(len(x))
        self.module.product(np.ascontiguousarray(band.T), len(x), half_bandwidth, np.ascontiguousarray(x), y)
        return y

    def inner(self, band: Array, half_bandwidth: int, x: Array, y: Array) -> float:
        x, y = np.ascontiguousarray(x), np.ascontiguousarray(y)
        own: float = self.module.inner(np.ascontiguousarray(band.T), len(x), half_bandwidth, x, y)
        return own

    def inertia(self, band: Array, half_bandwidth: int, constraint: Array | None, compliance: float) -> int:
        """The pivots of an L D L^T without pivoting are counted where their signs are beyond doubt."""
        counted = self.module.inertia(np.ascontiguousarray(band.T), None, constraint, band.shape[1], half_bandwidth, compliance, 0.0)
        return int(counted) if counted >= 0 else self._otherwise.inertia(band, half_bandwidth, constraint, compliance)

    def rayleigh(self, pencil: Pencil, guess: Array, tolerances: Rayleigh) -> tuple[float, Array, float] | None:
        if not pencil.banded:
            return self._otherwise.rayleigh(pencil, guess, tolerances)
        mode = np.array(guess, dtype=float)
        band, mass = np.ascontiguousarray(pencil.band.T), np.ascontiguousarray(pencil.mass.T)
        answer = self.module.rayleigh(band, mass, pencil.constraint, len(mode), pencil.kd, pencil.compliance, mode, *tolerances)
        if answer is None:
            return None
        value, error, below = answer  # below is negative where the signs of pivots are in doubt
        return None if below > 0 or (below < 0 and pencil.below(value, mode) > 0) else (value, mode, error)


class CompiledElements:
    """Elements four at a time, one a lane."""

    name = CompiledKernels.name

    def __init__(self, module: Any, space: Space, data: Array, tape: Tape) -> None:
        field = np.zeros(space.n_free, dtype=np.int64)
        field[space.fields[1]] = 1
        n_local = space.gather.shape[0] // 2
        table, gather = np.ascontiguousarray(space.table), np.ascontiguousarray(space.gather)
        own = module.Elements(tape, data, gather, table, field, space.n_quadrature, n_local, space.half_bandwidth)
        self.native: _native.Elements = own
        self._n_free, self._depth = space.n_free, 3 * space.half_bandwidth + 1
        self._forces, self._densities = (3, space.n_free), (N_DENSITIES, data.shape[1])
        self._shape = 4 * space.n_quadrature, space.n_elements
        self.largest, self.force_scale, self.form_parts = own.largest, own.force_scale, own.form_parts

    def at_quadrature(self, x: Array) -> Array:
        local = np.empty(self._shape)
        self.native.at_quadrature(x, local)
        return local

    def evaluate(self, x: Array, pressure: float, factor: float, *more: float) -> Answer:
        forces, densities = np.empty(self._forces), np.empty(self._densities)
        elastic, magnetic, volume, finite = self.native.evaluate(x, pressure, factor, forces, densities)
        return elastic, magnetic, volume, finite, forces, densities

    def kinks(self, space: Space, x: Array) -> Array:
        if space.breaks:
            return space.kinks(x)
        at_rest, slopes, per_length, rest_kinks, poles = space.ends_of_elements
        jumps = np.empty(rest_kinks.size)
        self.native.kinks(x, at_rest, slopes, per_length, sum(1 << k for k, _ in poles), jumps)
        jumps -= rest_kinks
        return jumps

    def assemble(self, densities: Array) -> Array:
        band = np.zeros((self._n_free, self._depth))
        self.native.assemble(densities, band)
        return band.T

    def border(self, densities: Array, volume_gradient: Array, row: Array, corner: float) -> CompiledBorder:
        return CompiledBorder(self.native.border(densities, volume_gradient, row, corner))

    def step(self, densities: Array, forces: Array, row: Array, corner: float, gap: float, x: Array) -> Step:
        dx = np.empty(self._n_free)
        border, dp, change, size = self.native.step(densities, forces, row, corner, gap, x, dx)
        return CompiledBorder(border), dx, dp, change, size


class CompiledFactor:
    """L D L^T or L U in C."""

    __slots__ = ("_own", "determinant_sign")

    def __init__(self, own: _native.Factor) -> None:
        self._own, self.determinant_sign = own, own.determinant_sign

    def solve(self, right: Array) -> Array:
        x: Array = np.array(right, dtype=float, order="F")
        self._own.solve(x.T)
        return x


class CompiledBorder:
    """Mixed block elimination in C, see :class:`.bordered.BorderedFactor`."""

    __slots__ = ("_own",)

    def __init__(self, own: _native.Border) -> None:
        self._own = own

    def solve(self, f: Array, g: float) -> tuple[Array, float]:
        x = np.empty(len(f))
        return x, self._own.solve(f, g, x)
