"""Functions of a mechanism, and their Jacobians, as CasADi has them: sparse matrices, column by column.

An element is there where the recording has a step for it that isn't the constant zero.  The Jacobian of a function has a block (numbers of a result,
numbers of an input) for each pair.  Its blocks are those of an analytic row where this takes fewer operations, and otherwise made of the recorded steps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import ArgumentError
from ksl.generation.arguments import Arguments
from ksl.generation.open_reactions import Undetermined
from ksl.generation.recording import Operation, Recording, record
from ksl.generation.requests import Function, functions_of

if TYPE_CHECKING:
    from ksl.model.model import Model

Steps = NDArray[np.int32]
ANALYTIC = {
    "inverse_dynamics": "inverse_dynamics_derivatives", "forward_dynamics": "forward_dynamics_derivatives", "forward_dynamics_by_mass_matrix": "forward_dynamics_derivatives",
    "gravity_torque": "stiffness", "reactions": "reactions_derivatives", "energy": "energy_derivatives",
    "frame_velocity": "frame_velocity_derivatives", "frame_velocities": "frame_velocities_derivatives",
    "frame_acceleration": "frame_acceleration_derivatives", "frame_accelerations": "frame_accelerations_derivatives",
    "centroidal_momentum": "centroidal_momentum_derivatives", "centroidal_momentum_rate": "centroidal_momentum_rate_derivatives",
}  # fmt: skip
"""The row with the derivatives of a row: of its one result by each of its inputs, in their order."""
OF_ENERGY = [("kinetic", "q"), ("kinetic", "v"), ("potential", "q")]
"""Whose derivatives `energy_derivatives` has."""
COLUMN_OF = {"external": 6, "payload": 10, "parameters": 10}
"""Inputs with a column for each link, and its length."""


@dataclass(frozen=True)
class Matrix:
    """A result.  steps (rows, columns): those of a recording; −1 for zero."""

    name: str
    steps: Steps

    @property
    def nonzero(self) -> Steps:
        """Steps of the elements that are there, column by column."""
        return self.steps.T[self.steps.T >= 0]

    def sparsity(self) -> list[int]:
        """Rows, columns and 1 where it is dense; otherwise the first element of each column, and the row of each element."""
        (rows, columns), there = self.steps.shape, self.steps.T >= 0
        if there.all():
            return dense(rows, columns)
        return [rows, columns, 0, *np.cumsum(there.sum(axis=1)).tolist(), *np.nonzero(there)[1].tolist()]


def dense(rows: int, columns: int) -> list[int]:
    return [rows, columns, 1]


def empty(rows: int, columns: int) -> list[int]:
    return [rows, columns, *[0] * (columns + 1)]


@dataclass(frozen=True)
class Part:
    """Results of one recording, which has those with elements alone."""

    recording: Recording
    results: tuple[Matrix, ...]


@dataclass(frozen=True)
class CasadiFunction:
    """name: of the function; inputs, results: their names and sparsities; parts: what computes the results."""

    name: str
    inputs: tuple[tuple[str, list[int]], ...]
    results: tuple[tuple[str, list[int]], ...]
    parts: tuple[Part, ...]


def functions_for_casadi(model: Model, of: Function, derivatives: int, undetermined: Undetermined) -> list[CasadiFunction]:
    """The function itself; its Jacobian, jac_NAME; and for second derivatives its adjoint, adj1_NAME, and jac_adj1_NAME.  Derivatives take results of
    what they are of, too, as CasADi has it, and need none.
    Raises ArgumentError, and ValueError for closed mechanisms and for exact dry friction, whose derivatives aren't generated."""
    if of.derivative:
        raise ArgumentError(f"algorithms: {of.derivative}.{of.row}: CasADi differentiates functions itself; ask for {of.row}")
    recording, layouts = of.recording, _layouts(of.recording)
    values = _values(recording, layouts)
    inputs = tuple((name, dense(*layouts[name].shape)) for name, _ in recording.inputs)
    found = [CasadiFunction(of.name, inputs, _sparsities(values), (values,))]
    inputs += tuple((f"out_{y.name}", empty(*y.steps.shape)) for y in values.results)
    found.append(_jacobian(found[0], inputs, layouts, _jacobian_ways(model, of, layouts, undetermined)))
    if derivatives > 1:
        weights = {f"adj_{y.name}": y for y in values.results}
        kept = {name: layouts[name].order[y.steps.T.ravel() >= 0] for name, y in weights.items()}
        backward = _with_inputs(_recorded(model, of, "adjoint"), kept)
        steps = zip((name for name, _ in backward.results), np.split(backward.outputs, np.cumsum(backward.sizes())[:-1]))  # CasADi wants zeros of these, too
        adjoint = _part(backward, [_matrix(name, x, layouts[name]) for name, x in steps])
        inputs += tuple((name, y.sparsity()) for name, y in weights.items())
        found.append(CasadiFunction(f"adj1_{of.name}", inputs, _sparsities(adjoint), (adjoint,)))
        second = _recorded(model, of, "adjoint's jacobian")
        blocks = _part(_with_inputs(second, kept), _blocks(second, layouts))
        inputs += tuple((f"out_{x.name}", empty(*x.steps.shape)) for x in adjoint.results)
        found.append(_jacobian(found[-1], inputs, layouts, [[blocks]]))
    return found


@dataclass(frozen=True)
class _Layout:
    """How the numbers of an input or a result lie.  order: of the matrix of this shape, column by column, those of the recording."""

    shape: tuple[int, int]
    order: NDArray[np.intp]


def _layouts(of: Recording) -> dict[str, _Layout]:
    """By names of inputs and results, and of their weights.  Of results with three axes the first two are rows, and with four the last two columns."""
    found = {}
    for name, numbers in of.inputs:
        rows = COLUMN_OF.get(name, numbers)
        found[name] = _Layout((rows, numbers // rows), np.arange(numbers))
    for (name, shape), numbers in zip(of.results, of.sizes()):
        columns = prod(shape[-2:] if len(shape) > 3 else shape[-1:]) if len(shape) > 1 else 1
        found[name] = _Layout((numbers // columns, columns), np.arange(numbers).reshape(-1, columns).T.ravel())
    return found | {f"adj_{name}": layout for name, layout in found.items()}


def _recorded(model: Model, of: Function, derivative: str) -> Recording:
    return record(model, of.row, of.request, of.arguments, of.recording.single, derivative)


def _nonzero_results(of: Recording) -> list[tuple[str, Steps]]:
    """The steps of each result, −1 for those that are zero."""
    is_zero = (of.operations[of.outputs] == Operation.CONSTANT) & (of.numbers[of.outputs] == 0)
    steps = np.where(is_zero, -1, of.outputs).astype(np.int32)
    return list(zip((name for name, _ in of.results), np.split(steps, np.cumsum(of.sizes())[:-1])))


def _values(of: Recording, layouts: Mapping[str, _Layout]) -> Part:
    """All results."""
    return _part(of, [_matrix(name, steps, layouts[name]) for name, steps in _nonzero_results(of)])


def _matrix(name: str, steps: Steps, layout: _Layout) -> Matrix:
    return Matrix(name, steps[layout.order].reshape(layout.shape[::-1]).T)


def _sparsities(of: Part) -> tuple[tuple[str, list[int]], ...]:
    return tuple((matrix.name, matrix.sparsity()) for matrix in of.results)


def _blocks(of: Recording, layouts: Mapping[str, _Layout], pairs: Sequence[tuple[str, str]] = ()) -> list[Matrix]:
    """The blocks of a recording of derivatives.  pairs: of which results by which inputs they are, if names don't say it; none of those of an empty name."""
    named = {f"jac_{y}_{x}": (y, x) for y in layouts for x in layouts}
    found = []
    for (_, steps), (y, x) in zip(_nonzero_results(of), pairs or [named[name] for name, _ in of.results]):
        if x:
            rows, columns = layouts[y].order, layouts[x].order
            found.append(Matrix(f"jac_{y}_{x}", steps.reshape(len(rows), len(columns))[rows][:, columns]))
    return found


def _jacobian(of: CasadiFunction, inputs: tuple[tuple[str, list[int]], ...], layouts: Mapping[str, _Layout], ways: Sequence[Sequence[Part]]) -> CasadiFunction:
    """The Jacobian of a function, computed the way that has fewest operations."""
    parts = min(ways, key=lambda parts: sum(part.recording.arithmetic for part in parts))
    blocks = {matrix.name: matrix.sparsity() for part in parts for matrix in part.results}
    results = []
    for y, _ in of.results:
        for x, (rows, columns, *_) in of.inputs:  # those that are results of what this is the derivative of have no block in a recording
            name = f"jac_{y}_{x}"
            results.append((name, blocks[name] if name in blocks else empty(prod(layouts[y].shape), rows * columns)))
    return CasadiFunction(f"jac_{of.name}", inputs, tuple(results), tuple(parts))


def _jacobian_ways(model: Model, of: Function, layouts: Mapping[str, _Layout], undetermined: Undetermined) -> list[list[Part]]:
    """All blocks by the recorded steps; and some of them by the analytic row."""
    graph = _recorded(model, of, "jacobian")
    blocks = _blocks(graph, layouts)
    ways = [[_part(graph, blocks)]]
    if of.row in ANALYTIC:
        asked = ":".join(x for x in (ANALYTIC[of.row], "+".join(of.names)) if x)
        (row,) = functions_of(model, [asked], of.arguments, of.recording.single, undetermined)
        pairs = OF_ENERGY if of.row == "energy" else [(of.recording.results[0][0], x) for x, _ in of.recording.inputs]
        by_sums = _moves_by_sums(model)
        own = _blocks(row.recording, layouts, [(y, x if by_sums or x != "q" else "") for y, x in pairs])
        rest = {block.name for block in blocks} - {block.name for block in own}
        ways.append([_part(row.recording, own), _part(graph, [block for block in blocks if block.name in rest])])
    return ways


def _moves_by_sums(model: Model) -> bool:
    """Is q ⊕ dv = q + dv?  Then derivatives along joint velocities are those by the numbers of q."""
    (integrate,) = functions_of(model, ["integrate"], Arguments(), False, "refuse")
    of = _recorded(model, integrate, "jacobian")
    steps = dict(_nonzero_results(of))["jac_q1_dv"]
    constant = np.where(steps < 0, Operation.CONSTANT, of.operations[steps]) == Operation.CONSTANT
    return model.nq == model.nv and bool(constant.all()) and np.array_equal(np.where(steps < 0, 0, of.numbers[steps]), np.eye(model.nv).ravel())


def _with_inputs(of: Recording, kept: Mapping[str, NDArray[np.intp]]) -> Recording:
    """The recording that has these numbers of some inputs alone, in this order; no step reads the others."""
    sizes = [numbers for _, numbers in of.inputs]
    taken = [kept.get(name, np.arange(numbers)) for name, numbers in of.inputs]
    place, begin, first = np.full(sum(sizes), -1), 0, 0
    for chosen, size in zip(taken, sizes):
        place[first + chosen] = begin + np.arange(len(chosen))
        begin, first = begin + len(chosen), first + size
    is_input = of.operations == Operation.INPUT
    numbers = of.numbers.copy()
    numbers[is_input] = place[of.numbers[is_input].astype(int)]
    return replace(of, inputs=tuple((name, len(x)) for (name, _), x in zip(of.inputs, taken)), numbers=numbers)


def _part(of: Recording, results: Sequence[Matrix]) -> Part:
    """The steps that these results need."""
    outputs = np.concatenate([np.empty(0, np.int32), *(matrix.nonzero for matrix in results)])
    sizes = tuple((matrix.name, (len(matrix.nonzero),)) for matrix in results if len(matrix.nonzero))
    return Part(replace(of, results=sizes, outputs=outputs).needed(), tuple(results))
