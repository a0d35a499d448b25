"""An operator of one model: what libraries of arrays differentiate, whatever they are."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, TypeVar

import numpy as np

from ksl import _core
from ksl.model.model import Model
from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.requests import core_of, request_of_links
from ksl.operators.table import COMPLETIONS, ROWS


T = TypeVar("T")
Placed = tuple[tuple[str, int, int], ...]
"""Joints whose velocity isn't the rate of their numbers: kind, and where the numbers begin in q and in v."""


class Stage(IntEnum):
    """What is computed, as in the extension.  x are the inputs, λ a cotangent of the result y."""

    VALUE = 0
    """x → y"""
    JVP = 1
    """x, dx → dy"""
    VJP = 2
    """x, λ → one cotangent for each x"""
    SECOND_JVP = 3
    """x, dx, dx₂ → the change of JVP along dx₂"""
    SECOND_VJP = 4
    """x, λ, dx₂ → the change of VJP along dx₂"""


NEXT = {Stage.VALUE: Stage.JVP, Stage.JVP: Stage.SECOND_JVP, Stage.VJP: Stage.SECOND_VJP}
"""What the change of a stage along a change of the inputs is."""


@dataclass(frozen=True)
class More:
    """Inputs behind those of the row."""

    external: tuple[str, ...] = ()
    """Links on which external wrenches act."""
    in_world: bool = False
    """Whether the wrenches are in the world's axes."""
    parameters: bool = False
    """Whether parameters of links are arguments."""
    links: tuple[str, ...] = ()
    """Whose, if not those of all links; others have the model's."""
    given: tuple[int, ...] = ()
    """Coordinates from which the others of a closed mechanism follow; no input, since their numbers are those of others."""
    nan_where_open: bool = False
    """Derivatives of reactions that rigid bodies don't determine: NaN, or an error."""


class Operator:
    """A row of the table for a model and a request.

    Its arrays have three axes: inputs (groups, states, numbers), wrenches among them; parameters (groups, links, 10), of all links or of those of `More`: one set for the
    states of a group; the result (groups, states, numbers).  It is itself, and hashed by identity: traced programs and caches hold it.
    """

    def __init__(self, model: Model, name: str, request: _core.Links | _core.Request | None, more: More, threads: int) -> None:
        row = ROWS.get(name) or COMPLETIONS[name]
        self.name, self.row, self.threads, self.parameters, self.external = name, row, threads, more.parameters, bool(more.external)
        self.closed, self.model, self.request, self.more = bool(model.loops), model, request, more
        self.core = _core.Operator(
            core_of(model), row.value, row.result, row.lift, row.first, list(row.by), row.gradient, row.second, list(row.by_two),
            row.regressor if more.parameters else "", row.by_parameters, row.solved, request,
            request_of_links(model, more.external) if more.external else None, more.in_world, list(more.given), more.nan_where_open,
        )  # fmt: skip
        self.placed: Placed = tuple((joint.kind, joint.q_index, joint.v_index) for joint in model.joints if not KINDS[joint.kind].velocity_is_rate and joint.nv)
        self.number: int = self.core.number
        """By which compiled programs name it."""
        self.inputs: tuple[str, ...] = (*row.inputs, *["external"] * self.external, *["parameters"] * more.parameters)
        self.links: tuple[str, ...] = (more.links or tuple(model.link_names)) if more.parameters else ()
        """The links whose parameters are an input, in its order."""
        self.widths: tuple[int, ...] = tuple(10 * len(self.links) if name == "parameters" else n for name, n in zip(self.inputs, self.core.widths))
        self.shape: tuple[int, ...] = tuple(self.core.shape)
        """The shape of the result of a state."""
        self.numbers: int = math.prod(self.shape)
        self.programs: dict[object, Any] = {}
        """What a library has compiled for it."""

    @property
    def twice(self) -> bool:
        """Has it second derivatives?"""
        return bool(self.row.second) and not self.parameters and not self.external and not self.closed

    def require_twice(self) -> None:
        """Raises NotImplementedError where it has no second derivatives."""
        if not self.row.second:
            raise NotImplementedError(
                f"{self.name}: there are no second derivatives of it; those that have some are {', '.join(n for n in ROWS if ROWS[n].second)}"
            )
        if self.closed:
            raise NotImplementedError(f"{self.name}: there are no second derivatives of it for mechanisms with loops")
        if self.parameters or self.external:
            raise NotImplementedError(
                f"{self.name}: there are no second derivatives of it with {'parameters' if self.parameters else 'external'}=; without them there are"
            )

    def result_shapes(self, stage: Stage, groups: int, states: int, *, of_all: bool = False) -> list[tuple[int, ...]]:
        """The shapes of what a stage returns; of_all: with parameters of all links."""
        if stage in (Stage.VJP, Stage.SECOND_VJP):
            shapes = [self.input_shape(x, groups, states) for x in range(len(self.inputs))]
            return [(groups, len(self.model.link_names), 10) if of_all and own == "parameters" else shape for own, shape in zip(self.inputs, shapes)]
        return [(groups, states, self.numbers)]

    def input_shape(self, x: int, groups: int, states: int) -> tuple[int, ...]:
        return (groups, self.widths[x] // 10, 10) if self.inputs[x] == "parameters" else (groups, states, self.widths[x])

    def split(self, stage: Stage, arguments: Sequence[Any]) -> list[list[Any]]:
        """What a stage is given: inputs, and for each of the rest, in which it is linear, a list."""
        parts, begin = [], 0
        for count in self._by_stage(stage, len(self.inputs), 1):
            parts.append(list(arguments[begin : begin + count]))
            begin += count
        return parts

    def of_groups(self, stage: Stage) -> list[bool]:
        """For each argument of a stage, whether it has a row for each group: parameters, and their changes."""
        own = [name == "parameters" for name in self.inputs]
        return [each for part in self._by_stage(stage, own, [False]) for each in part]

    @staticmethod
    def _by_stage(stage: Stage, inputs: T, result: T) -> list[T]:
        """One of the two for each group of arguments: what there is for inputs and their changes, or for a cotangent of the result."""
        rest = {Stage.VALUE: [], Stage.JVP: [inputs], Stage.VJP: [result], Stage.SECOND_JVP: [inputs, inputs], Stage.SECOND_VJP: [result, inputs]}
        return [inputs, *rest[stage]]

    def compute(self, stage: Stage, inputs: Sequence[Any], outputs: Sequence[Any]) -> None:
        """Computes a stage on arrays of the CPU that are contiguous and of one precision, into others."""
        if not self.more.links:
            self.core.compute(int(stage), list(inputs), list(outputs), self.threads)
            return
        given, results = of_all_links(np, self, stage, [np.asarray(x) for x in inputs]), [np.asarray(x) for x in outputs]
        whole = [np.empty(shape, x.dtype) for x, shape in zip(results, self.result_shapes(stage, given[0].shape[0], given[0].shape[1], of_all=True))]
        self.core.compute(int(stage), [np.ascontiguousarray(x) for x in given], whole, self.threads)
        for x, y in zip(results, of_own_links(self, stage, whole)):
            x[...] = y


def of_all_links(library: Any, operator: Operator, stage: Stage, arguments: Sequence[Any]) -> list[Any]:
    """Arguments of a stage with parameters of all links in place of those of the operator's: others have the model's, and don't change.

    library: numpy or jax.numpy."""
    place, own = {link: k for k, link in enumerate(operator.links)}, operator.model.parameters

    def whole(x: Any, is_value: bool) -> Any:
        rows = [
            x[:, place[link]] if link in place else library.broadcast_to(library.asarray(own[k] if is_value else 0.0 * own[k], x.dtype), x[:, 0].shape)
            for k, link in enumerate(operator.model.link_names)
        ]
        return library.stack(rows, 1)

    return [whole(x, k < len(operator.inputs)) if of_group else x for k, (x, of_group) in enumerate(zip(arguments, operator.of_groups(stage)))]


def of_own_links(operator: Operator, stage: Stage, results: Sequence[Any]) -> list[Any]:
    """Results of a stage with those by parameters of the operator's links alone."""
    if stage is not Stage.VJP:
        return list(results)
    places = np.array([operator.model.link_names.index(link) for link in operator.links])
    return [y[:, places] if name == "parameters" else y for name, y in zip(operator.inputs, results)]


@dataclass(frozen=True)
class Layout:
    """How arguments of any leading shapes become arrays of three axes."""

    leading: tuple[int, ...]
    """Leading axes of the result."""
    groups: int
    """How many of its axes distinguish sets of parameters."""

    def split(self) -> tuple[int, int]:
        return math.prod(self.leading[: self.groups]), math.prod(self.leading[self.groups :])


def layout(operator: Operator, shapes: Sequence[tuple[int, ...]]) -> Layout:
    """The layout for arguments of these shapes.  Raises ValueError, which names the argument, for shapes that don't fit."""
    leading: tuple[int, ...] = ()
    groups = 0
    for name, width, shape in zip(operator.inputs, operator.widths, shapes):
        last = (width // 10, 10) if name == "parameters" else (width,)
        if shape == () and name not in ("q", "q0", "q1", "external", "parameters"):
            continue  # one number stands for each coordinate
        own = shape[: -len(last)]
        if shape[len(own) :] != last or len(shape) < len(last):
            numbers = {"parameters": "ten for each link", "q": "nq numbers for each state"}.get(
                name, "nq numbers for each state" if name in ("q0", "q1") else "nv numbers for each state"
            )
            raise ValueError(f"{operator.name}: {name} has shape {shape}; expected (…, {', '.join(map(str, last))}): {numbers}")
        leading = broadcast(leading, own, operator.name, operator.inputs, shapes)
        if name == "parameters" and any(n != 1 for n in own):  # the last input, so that `leading` is that of all
            groups = len(leading) - next(i for i, n in enumerate(reversed(own)) if n != 1)
    return Layout(leading, groups)


def broadcast(a: tuple[int, ...], b: tuple[int, ...], call: str, inputs: Sequence[str], shapes: Sequence[tuple[int, ...]]) -> tuple[int, ...]:
    """The leading shape of both.  Raises ValueError, which names the call, its inputs and their shapes."""
    n = max(len(a), len(b))
    pairs = list(zip((1,) * (n - len(a)) + a, (1,) * (n - len(b)) + b))
    if any(x != y and 1 not in (x, y) for x, y in pairs):
        found = ", ".join(f"{name} {shape}" for name, shape in zip(inputs, shapes))
        raise ValueError(f"{call}: leading shapes don't broadcast: {found}")
    return tuple(y if x == 1 else x for x, y in pairs)


def arranged(operator: Operator, arrays: Sequence[Any], broadcast_to: Any) -> tuple[list[Any], Layout]:
    """Arguments as arrays of three axes, by the library's own functions, which it differentiates; and how the result gets its shape again."""
    found = layout(operator, [tuple(x.shape) for x in arrays])
    groups, states = found.split()
    rows = []
    for name, width, x in zip(operator.inputs, operator.widths, arrays):
        if name == "parameters":
            own = max(0, len(x.shape) - 2 - len(found.leading) + found.groups)  # of its axes, those that distinguish sets; behind them all are 1
            sets, ten = x.reshape(*x.shape[:own], width // 10, 10), (width // 10, 10)
            rows.append(broadcast_to(sets, (*found.leading[: found.groups], *ten)).reshape(groups, *ten))
        else:
            rows.append(broadcast_to(x, (*found.leading, width)).reshape(groups, states, width))
    return rows, found


def mapped(
    library: Any,
    operator: Operator,
    stage: Stage,
    size: int,
    axes: Sequence[int | None],
    arguments: Sequence[Any],
    compute: Callable[[Sequence[Any]], Sequence[Any]],
) -> tuple[list[Any], int]:
    """A stage along a new axis of the arguments, and which axis of each result it is.  library: torch or jax.numpy; compute: of arguments of three axes.

    The new axis joins that of states, or that of groups where parameters differ along it, or are differentiated.
    """
    of_groups = operator.of_groups(stage)
    apart = operator.parameters and (stage is Stage.VJP or any(own and axis is not None for own, axis in zip(of_groups, axes)))
    groups, states = (n for k, n in enumerate(arguments[0].shape[: 2 + (axes[0] is not None)]) if k != axes[0])
    rows = []
    for x, axis, of_group in zip(arguments, axes, of_groups):
        if of_group and not apart:
            rows.append(x)
            continue
        whole = library.broadcast_to(x, (size, *x.shape)) if axis is None else library.moveaxis(x, (axis,), (0,))  # by tuples, which torch maps again
        rows.append(
            whole.reshape(size * groups, *whole.shape[2:]) if apart else library.swapaxes(whole, 0, 1).reshape(groups, size * whole.shape[2], *whole.shape[3:])
        )
    results = compute(rows)
    if apart:
        return [y.reshape(size, groups, *y.shape[1:]) for y in results], 0
    return [y.reshape(groups, size, states, *y.shape[2:]) for y in results], 1
