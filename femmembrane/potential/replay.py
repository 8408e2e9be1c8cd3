"""The instructions of a point function, replayed on whole vectors of points: a small part of mapping the scalar function over them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ..kernels.interface import Array, Tape
from ..threads import Guard, cached_property
from .expressions import BUILDING

#: points evaluated in one go; larger vectors leave the processor's cache
_BLOCK = 1024


class PointProgram:
    """A scalar function of (data, local variables, parameters) with its data at the points, as :mod:`..kernels` take it.

    Parameters
    ----------
    function : casadi.Function
    data : ndarray
    like : PointProgram, optional
        One of the same function, whose instructions it shares.
    """

    def __init__(self, function: ca.Function, data: Array, like: PointProgram | None = None) -> None:
        self.function, self.data, self._like = function, data, like
        self._tapes: dict[tuple[str, ...], Tape | None] = {}
        self._vectors: dict[tuple[int, int], ca.Function] = {} if like is None else like._vectors

    @cached_property
    def _replay(self) -> Replay:
        return Replay(self.function, self.data, self._vectors)

    def replay(self, local: Array, parameters: Array) -> Array:
        """Values at all points, shape (rows, n)."""
        return self._replay(local, parameters)

    def tape(self, operations: Sequence[str]) -> Tape | None:
        """See :func:`record_tape`."""
        if self._like is not None:
            return self._like.tape(operations)
        key = tuple(operations)
        if key not in self._tapes:
            self._tapes[key] = record_tape(self.function, operations)
        return self._tapes[key]


class Replay:
    """A point function replayed on vectors of points, called through preallocated buffers.

    ``vectors`` are the instructions of the same function, by the numbers of points in a block and of blocks: those that others have built
    are shared, and new ones are put there.
    """

    @BUILDING
    def __init__(self, function: ca.Function, data: Array, vectors: dict[tuple[int, int], ca.Function] | None = None) -> None:
        n, self.function = data.shape[1], function
        self.block = min(n, _BLOCK)
        self.n_blocks = -(-n // self.block)
        self.n, self.rows = n, function.numel_out(0)
        self.vectors, key = {} if vectors is None else vectors, (self.block, self.n_blocks)
        if key not in self.vectors:
            self.vectors[key] = self._vectorised()
        vector: Any = self.vectors[key]
        self._data = self._split(data)
        self._local = np.ones((self.n_blocks, function.numel_in(1), self.block))
        self._parameters = np.zeros(function.numel_in(2))
        self._out = np.zeros((self.n_blocks, self.rows, self.block))
        self._lock = Guard()
        self._buffer, self._call = vector.buffer()
        for k, array in enumerate((self._data, self._local, self._parameters)):
            self._buffer.set_arg(k, memoryview(array))  # type: ignore[arg-type, call-arg]
        self._buffer.set_res(0, memoryview(self._out))  # type: ignore[arg-type, call-arg]

    def _vectorised(self) -> ca.Function:
        vector = vectorise(self.function, self.block)
        return vector if self.n_blocks == 1 else vector.map("blocks", "serial", self.n_blocks, [2], [])

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


def record_tape(function: ca.Function, operations: Sequence[str]) -> Tape | None:
    """The instructions of a scalar function for the compiled half; None if it lacks one of the operations.

    Inputs and output: see :func:`vectorise`. A quantity that depends on constants and on the last input alone is a scalar. Scalars are
    numbered -1, -2, ... (constants, the last input, results). All others are registers with a value for each point, numbered 0, 1, ...
    (inputs, outputs, CasADi's own work space). An instruction is (operation, target, left, right).

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


def at_points(function: ca.Function, *columns: Array) -> Array:
    values = np.stack([np.ravel(c) for c in columns])
    if values.shape[1] == 0:
        return np.zeros((function.numel_out(0), 0))
    return _replay_at(function, values.shape[1])(values, np.zeros(0)).copy()


@lru_cache(maxsize=64)
@BUILDING
def _replay_at(function: ca.Function, n: int) -> Replay:
    """A function of the local variables alone as a kernel at n points."""
    symbols = [ca.SX.sym("data", 0), function.sx_in(0), ca.SX.sym("parameters", 0)]
    return Replay(ca.Function("at_points", symbols, [function(symbols[1])]), np.zeros((0, n)))
