from typing import final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: names of the operations of a tape, by their code
OPERATIONS: tuple[str, ...]
INTERFACE: int

@final
class Factor:
    def __new__(cls, band: Array, size: int, half_bandwidth: int) -> Factor: ...
    def solve(self, x: Array) -> None: ...
    def determinant_sign(self) -> int: ...

@final
class Border:
    def solve(self, f: Array, g: float, x: Array) -> float: ...

@final
class Elements:
    def __new__(
        cls,
        tape: tuple[Indices, Indices, Array, int, int, int, int, int],
        data: Array,
        gather: Indices,
        table: Array,
        field: Indices,
        n_quadrature: int,
        n_local: int,
        half_bandwidth: int,
    ) -> Elements: ...
    def at_quadrature(self, x: Array, out: Array) -> None: ...
    def evaluate(self, x: Array, pressure: float, factor: float, forces: Array, densities: Array) -> tuple[float, float, float, bool]: ...
    def assemble(self, densities: Array, band: Array) -> None: ...
    def largest(self, x: Array) -> tuple[float, float]: ...
    def force_scale(self, densities: Array, pressure: float) -> tuple[float, float]: ...
    def form_parts(self, densities: Array, x: Array, weights: Array) -> tuple[float, float]: ...
    def kinks(self, x: Array, at_rest: Array, slopes: Array, per_length: Array, poles: int, jumps: Array) -> None: ...
    def step(
        self, densities: Array, forces: Array, row: Array, corner: float, gap: float, x: Array, dx: Array
    ) -> tuple[Border, float, tuple[float, float], tuple[float, float]]: ...
    def border(self, densities: Array, volume_gradient: Array, row: Array, corner: float) -> Border: ...

def inertia(
    band: Array, mass: Array | None, constraint: Array | None, size: int, half_bandwidth: int, compliance: float, shift: float
) -> int: ...
def inner(band: Array, size: int, half_bandwidth: int, x: Array, y: Array) -> float: ...
def product(band: Array, size: int, half_bandwidth: int, x: Array, y: Array) -> None: ...
def rayleigh(
    band: Array,
    mass: Array,
    constraint: Array | None,
    size: int,
    half_bandwidth: int,
    compliance: float,
    mode: Array,
    iterations: int,
    converged: float,
    shrinking: float,
    rounding: float,
    gap: float,
    noise: float,
    floor: float,
) -> tuple[float, float, int] | None: ...
