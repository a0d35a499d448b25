"""Recorded algorithms: steps on earlier steps, as arrays."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ksl import _core
from ksl.base.errors import ArgumentError
from ksl.generation.arguments import Arguments

if TYPE_CHECKING:
    from ksl.model.model import Model


class Operation(IntEnum):
    """What a step does, in the order of the compiled module.  SELECT: the second operand where the first, a condition, holds, otherwise the third."""

    CONSTANT = 0
    INPUT = 1
    ADD = 2
    SUBTRACT = 3
    MULTIPLY = 4
    DIVIDE = 5
    NEGATE = 6
    LESS = 7
    AT_MOST = 8
    EQUAL = 9
    SELECT = 10
    ROOT = 11
    ABSOLUTE = 12
    SINE = 13
    COSINE = 14
    ARCTANGENT = 15


DERIVATIVES = {
    "jvp": "Rates of results (NAME_dot) for rates of the inputs (NAME_dot): the derivative times a vector, forward.",
    "vjp": "Weights of the inputs (NAME_bar) for weights of the results (NAME_bar): the sum of weights times derivatives, backward.",
}
"""What headers say of each kind of derivative."""
CONDITIONS = (Operation.LESS, Operation.AT_MOST, Operation.EQUAL)


COMPUTED: dict[int, Callable[..., Any]] = {
    Operation.ADD: operator.add, Operation.SUBTRACT: operator.sub, Operation.MULTIPLY: operator.mul, Operation.DIVIDE: operator.truediv, Operation.NEGATE: operator.neg,
    Operation.LESS: operator.lt, Operation.AT_MOST: operator.le, Operation.EQUAL: operator.eq, Operation.SELECT: lambda a, b, c: b if a else c,
    Operation.ROOT: np.sqrt, Operation.ABSOLUTE: abs, Operation.SINE: np.sin, Operation.COSINE: np.cos, Operation.ARCTANGENT: np.arctan2,
}  # fmt: skip


@dataclass(frozen=True)
class Recording:
    """One function: an algorithm on one mechanism, for one request."""

    row: str
    inputs: tuple[tuple[str, int], ...]
    """Names, and how many numbers each has; the steps INPUT count through all of them."""
    results: tuple[tuple[str, tuple[int, ...]], ...]
    """Names and shapes; () is one number."""
    operations: NDArray[np.uint8]
    """(steps)"""
    operands: NDArray[np.int32]
    """(steps, 3) earlier steps; −1 where an operation has fewer."""
    numbers: NDArray[np.float64]
    """(steps) of constants, and which input it is."""
    outputs: NDArray[np.int32]
    """The step of each number of the results, one result after the other, row-major; −1: it isn't written."""
    single: bool

    @property
    def arithmetic(self) -> int:
        """How many sums, differences, products and quotients it has."""
        return int(np.count_nonzero((self.operations >= Operation.ADD) & (self.operations <= Operation.DIVIDE)))

    def count(self, operation: Operation) -> int:
        return int(np.count_nonzero(self.operations == operation))

    @property
    def angles(self) -> int:
        """How many angles it computes sine or cosine of, or both."""
        trigonometric = (self.operations == Operation.SINE) | (self.operations == Operation.COSINE)
        return len(np.unique(self.operands[trigonometric, 0]))

    def reads(self, name: str) -> bool:
        """Does a result depend on a number of this input?"""
        names = [other for other, numbers in self.inputs for _ in range(numbers)]
        return any(names[int(k)] == name for k in self.numbers[self.operations == Operation.INPUT])

    def play(self, inputs: Sequence[NDArray[np.floating[Any]]]) -> list[NDArray[np.floating[Any]]]:
        """The results for the numbers of each input, step by step in the recording's precision.  Sines are NumPy's."""
        scalar = np.float32 if self.single else np.float64
        given = np.concatenate([np.ravel(x) for x in inputs]).astype(scalar)
        value: list[Any] = []
        with np.errstate(all="ignore"):
            for what, (a, b, c), number in zip(self.operations.tolist(), self.operands.tolist(), self.numbers.tolist()):
                if what == Operation.CONSTANT:
                    value.append(scalar(number))
                elif what == Operation.INPUT:
                    value.append(given[int(number)])
                else:
                    value.append(COMPUTED[what](*(value[x] for x in (a, b, c) if x >= 0)))
        flat = np.array([np.nan if step < 0 else value[step] for step in self.outputs.tolist()], scalar)
        return np.split(flat, np.cumsum(self.sizes())[:-1])

    def needed(self) -> Recording:
        """The recording without the steps that no result needs."""
        used = np.zeros(len(self.operations), bool)
        used[self.outputs[self.outputs >= 0]] = True
        operands = self.operands.tolist()
        for step in range(len(used) - 1, -1, -1):
            if used[step]:
                used[[x for x in operands[step] if x >= 0]] = True
        place = np.append(np.cumsum(used) - 1, -1).astype(np.int32)  # −1, of no step, stays −1
        return replace(self, operations=self.operations[used], operands=place[self.operands[used]], numbers=self.numbers[used], outputs=place[self.outputs])

    def sizes(self) -> list[int]:
        """How many numbers each result has."""
        return [prod(shape) for _, shape in self.results]


class _Intercepted(Exception):
    """Ends a call of a model where its compiled part would begin."""


class _RequestOf:
    """Stands for the compiled model in a call of an algorithm, and keeps what the call asks for."""

    def __init__(self, core: _core.Model, row: str) -> None:
        self._core, self._row = core, row
        self.request: Any = None

    def __getattr__(self, name: str) -> Any:
        if name != self._row:
            return getattr(self._core, name)

        def call(q: object, x: object, y: object, z: object, external: object, request: object, out: object, threads: object) -> None:
            self.request = request
            raise _Intercepted

        return call


def request_of(model: Model, row: str, arguments: dict[str, Any], inputs: int) -> Any:
    """The compiled request of a call `model.ROW(…, **arguments)`, made and checked as that of the engine."""
    twin = model.__class__.__new__(model.__class__)
    twin.__dict__.update(model.__dict__)
    stand_in = _RequestOf(model._core, row)
    twin.__dict__["_core"] = stand_in
    try:
        getattr(type(twin), row)(twin, *([0.0] * inputs), **arguments)  # not that of a model with code for a card, which a twin has, too
    except _Intercepted:
        return stand_in.request
    raise ArgumentError(f"algorithms: {row} of this mechanism is computed in several steps, and no code is made of it; cut the loops, or call the library")


def record(model: Model, row: str, request: Any, arguments: Arguments, single: bool, derivative: str) -> Recording:
    """derivative: "", "jvp" or "vjp" (:data:`DERIVATIVES`).  Raises ValueError where the algorithm can't be recorded for the model."""
    external, payload, parameters = (
        [model.link_names.index(link) for link in links] for links in (arguments.external, arguments.payload, arguments.parameters)
    )
    core: _core.Recording = model._core.record(row, request, external, arguments.gravity, payload, parameters, arguments.pivots, single, derivative)
    return Recording(
        row,
        tuple((name, numbers) for name, numbers in core.inputs),
        tuple((name, tuple(shape)) for name, shape in core.results),
        np.frombuffer(core.operations, np.uint8),
        np.frombuffer(core.operands, np.int32).reshape(-1, 3),
        np.frombuffer(core.numbers, np.float64),
        np.frombuffer(core.outputs, np.int32),
        single,
    )
