"""Recordings that Python makes: numbers whose arithmetic is noted, so that a function is written once, with NumPy's arrays of objects.

A `Graph` has each step once.  What is constant is a float, and is computed at once; zeros and ones leave no steps.  `Graph.replayed` puts a recording of the engine,
or another one, in place, `Graph.recording` makes one, and `played` computes it for many states at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ksl.generation.recording import COMPUTED, Operation, Recording

Objects = NDArray[np.object_]
COMMUTE = (Operation.ADD, Operation.MULTIPLY)


def _operator(what: Operation, is_reflected: bool = False) -> Callable[[Number, Any], Any]:
    """A method of numbers; arrays take them one by one."""

    def method(self: Number, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        return self.graph.put(what, *((other, self) if is_reflected else (self, other)))

    return method


class Number:
    """A step of a graph."""

    __slots__ = ("graph", "step")
    __add__ = __radd__ = _operator(Operation.ADD)
    __mul__ = __rmul__ = _operator(Operation.MULTIPLY)
    __sub__, __rsub__ = _operator(Operation.SUBTRACT), _operator(Operation.SUBTRACT, is_reflected=True)
    __truediv__, __rtruediv__ = _operator(Operation.DIVIDE), _operator(Operation.DIVIDE, is_reflected=True)

    def __init__(self, graph: Graph, step: int) -> None:
        self.graph, self.step = graph, step

    def __neg__(self) -> Any:
        return self.graph.put(Operation.NEGATE, self)


class Graph:
    """Steps in the order in which they were noted."""

    def __init__(self) -> None:
        self._steps: list[tuple[int, tuple[int, ...], float]] = []
        self._known: dict[tuple[int, tuple[int, ...], float], int] = {}
        self._inputs: list[tuple[str, int]] = []

    def inputs(self, name: str, numbers: int) -> Objects:
        """So many numbers of a new input."""
        first = sum(size for _, size in self._inputs)
        self._inputs.append((name, numbers))
        return np.array([Number(self, self._step(Operation.INPUT, (), float(first + k))) for k in range(numbers)], object)

    def put(self, what: Operation, *operands: Any) -> Any:
        """A step of numbers and floats; a float if its value is known."""
        numbers: list[Any] = [x if isinstance(x, Number) else float(x) for x in operands]
        if not any(isinstance(x, Number) for x in numbers):
            with np.errstate(all="ignore"):
                return float(COMPUTED[what](*map(np.float64, numbers)))
        simple = self._simple(what, numbers)
        if simple is not None:
            return simple
        steps = [x.step if isinstance(x, Number) else self._step(Operation.CONSTANT, (), x) for x in numbers]
        return Number(self, self._step(what, tuple(sorted(steps) if what in COMMUTE else steps), 0.0))

    def _simple(self, what: Operation, x: list[Any]) -> Any:
        """What a step of zeros and ones is, or None."""
        zero, one, minus = ([not isinstance(value, Number) and value == constant for value in x] for constant in (0.0, 1.0, -1.0))
        if what == Operation.ADD and any(zero):
            return x[zero.index(False)]
        if what == Operation.SUBTRACT and any(zero):
            return x[0] if zero[1] else self.put(Operation.NEGATE, x[1])
        if what == Operation.MULTIPLY and any(zero):
            return 0.0
        if what == Operation.MULTIPLY and any(one):
            return x[one.index(False)]
        if what == Operation.MULTIPLY and any(minus):
            return self.put(Operation.NEGATE, x[minus.index(False)])
        if what == Operation.DIVIDE and (zero[0] or one[1]):
            return x[0]
        if what == Operation.NEGATE and self._steps[x[0].step][0] == Operation.NEGATE:
            return Number(self, self._steps[x[0].step][1][0])
        if what == Operation.SELECT and not isinstance(x[0], Number):
            return x[1] if x[0] else x[2]
        return None

    def _step(self, what: Operation, operands: tuple[int, ...], number: float) -> int:
        key = (int(what), operands, number)
        if key not in self._known:
            self._known[key] = len(self._steps)
            self._steps.append(key)
        return self._known[key]

    def replayed(self, of: Recording, *inputs: Sequence[Any] | Objects) -> list[Objects]:
        """The results of a recording for these numbers, each in its shape."""
        given = [x for numbers in inputs for x in np.ravel(np.asarray(numbers, object))]
        value: list[Any] = []
        for what, operands, number in zip(of.operations.tolist(), of.operands.tolist(), of.numbers.tolist()):
            if what == Operation.CONSTANT:
                value.append(number)
            else:
                value.append(given[int(number)] if what == Operation.INPUT else self.put(Operation(what), *(value[k] for k in operands if k >= 0)))
        flat = np.array([np.nan if step < 0 else value[step] for step in of.outputs.tolist()], object)
        return [part.reshape(shape) for part, (_, shape) in zip(np.split(flat, np.cumsum(of.sizes())[:-1]), of.results)]

    def recording(self, name: str, results: Mapping[str, Any]) -> Recording:
        """The function of all inputs with these results, arrays of numbers and floats: the steps that they need."""
        wanted = [
            x.step if isinstance(x, Number) else self._step(Operation.CONSTANT, (), float(x))
            for value in results.values()
            for x in np.ravel(np.asarray(value, object))
        ]
        whole = Recording(
            name,
            tuple(self._inputs),
            tuple((key, np.shape(value)) for key, value in results.items()),
            np.array([what for what, _, _ in self._steps], np.uint8),
            np.array([(*operands, -1, -1, -1)[:3] for _, operands, _ in self._steps], np.int32).reshape(-1, 3),
            np.array([number for _, _, number in self._steps], float),
            np.array(wanted, np.int32),
            False,
        )
        return whole.needed()


def played(of: Recording, *inputs: NDArray[np.floating]) -> list[NDArray[np.floating]]:
    """The results (n, …) of a recording for numbers (n, …) of each input."""
    n = len(inputs[0])
    given = np.concatenate([np.reshape(x, (n, -1)) for x in inputs], axis=1).T
    value: list[Any] = []
    with np.errstate(all="ignore"):
        for what, operands, number in zip(of.operations.tolist(), of.operands.tolist(), of.numbers.tolist()):
            if what == Operation.CONSTANT:
                value.append(np.full(n, number))
            elif what == Operation.INPUT:
                value.append(given[int(number)])
            else:
                value.append((np.where if what == Operation.SELECT else COMPUTED[what])(*(value[k] for k in operands if k >= 0)))
    flat = np.array([value[step] for step in of.outputs.tolist()], float).reshape(-1, n).T
    return [part.reshape(n, *shape) for part, (_, shape) in zip(np.split(flat, np.cumsum(of.sizes())[:-1], axis=1), of.results)]


def is_zero(x: Any) -> bool:
    """Is it known to be zero?"""
    return not isinstance(x, Number) and x == 0


def sine(x: Any) -> Any:
    """The sine of a number of a graph, or of a float, rad."""
    return x.graph.put(Operation.SINE, x) if isinstance(x, Number) else np.sin(x)


def cosine(x: Any) -> Any:
    """The cosine of a number of a graph, or of a float, rad."""
    return x.graph.put(Operation.COSINE, x) if isinstance(x, Number) else np.cos(x)
