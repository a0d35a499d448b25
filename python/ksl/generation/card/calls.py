"""Calls of a model whose arrays may be on a card: those of compiled functions, and otherwise the model's own."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np

from ksl.base.errors import ArgumentError
from ksl.generation.card.arrays import (
    NUMPY,
    CardArray,
    array_of,
    concatenated,
    copied,
    empty,
    filled,
    is_contiguous,
    is_on_card,
    is_read_only,
    key_of_tensors,
    row_stride,
    stream_of,
    stream_of_torch,
)
from ksl.generation.card.driver import Driver
from ksl.generation.card.functions import CardFunction
from ksl.generation.rows import ROWS
from ksl.mechanism.given import OF_LINKS

if TYPE_CHECKING:
    from ksl.model.model import Model

OWN = ("out", "threads", "external")
"""Keywords of calls that ask for nothing else."""
LISTS = ("joints", "names", "links")
"""Keywords for which one name stands for itself."""
KEPT = 256
"""So many ways to ask are remembered."""


@dataclass(slots=True)
class Plan:
    """A call with tensors of torch of the same shapes, strides and type as an earlier one, whose checks hold for it: a call of a few states is as long as its checks."""

    function: CardFunction
    card: int
    states: int
    strides: list[int]
    shapes: list[tuple[int, ...]]

    def __call__(self, given: Sequence[Any]) -> Any:
        first = given[0]
        results = [first.new_empty(shape) for shape in self.shapes]
        rows: list[int] = []
        for x, stride in zip(given, self.strides):
            rows += (x.data_ptr(), stride)
        for x, (_, shape) in zip(results, self.function.results):
            rows += (x.data_ptr(), prod(shape))
        self.function.launch(self.card, stream_of_torch(self.card), self.states, rows)
        return tuple(results) if len(results) > 1 else results[0]


class CardCall:
    """A call of a model.  With arrays on a card it is a compiled function, otherwise the model's own."""

    def __init__(self, model: Model, row: str, compiled: Sequence[CardFunction]) -> None:
        self._own = getattr(type(model), row).__get__(model)
        functools.update_wrapper(self, self._own)
        self._row, self._names, self._compiled = row, ROWS[row].inputs, compiled
        self._signature = inspect.signature(self._own)
        blank = [None] * len(self._names) + [None] * (ROWS[row].external == "required")
        self._asked = [self._asked_for(blank, f.keywords)[0] for f in compiled]
        self._known: dict[Any, tuple[CardFunction, ...]] = {}
        self._plans: dict[Any, Plan] = {}

    def __call__(self, *given: Any, **keywords: Any) -> Any:
        key = None if keywords else key_of_tensors(given)
        if key is not None and (plan := self._plans.get(key)) is not None:
            return plan(given)
        if not any(map(is_on_card, given)) and not any(map(is_on_card, keywords.values())):
            if "parameters" in keywords:
                raise ArgumentError(
                    f"{self._row}: parameters= is for arrays on a card, and all are the processor's; with_parameters makes a model that has them"
                )
            return self._own(*given, **keywords)
        functions, inputs, besides, out = self._chosen(given, keywords)
        driver = functions[0].driver
        arrays = [None if isinstance(x, (int, float)) else array_of(x, name, driver) for name, x in zip(self._names, inputs)]
        named = [(name, array) for name, array in zip(self._names, arrays) if array is not None]
        answering = of_links(self._row, functions, besides)
        of_each = arrays_of_links(besides, driver)
        named += of_each.items()
        function = of_one_type(self._row, answering, named)
        if not named:
            raise ArgumentError(f"{self._row}: out is on a card, and all arguments are numbers; give one of them as an array on the card")
        card, leading = place_of(self._row, function, named)
        like, states = named[0][1], prod(leading)
        whole = [filled(x, size, like) if array is None else array for x, array, (_, size) in zip(inputs, arrays, function.inputs)]
        whole += joined(function, of_each)
        rows = [rows_of(array, leading, size, name) for array, (name, size) in zip(whole, function.inputs)]
        shapes = [(*leading, *shape) for _, shape in function.results]
        results = [empty(shape, like, self._row) for shape in shapes] if out is None else self._given_results(out, shapes, function)
        written = [array_of(x, "out", driver) for x in results]
        for array, shape in zip(written, shapes):
            self._require_result(array, shape, function, card, [(*row, size) for row, (_, size) in zip(rows, function.inputs)], states)
        _require_apart(written)
        said = [x for array, stride in rows for x in (array.pointer, stride)]
        said += [x for array, (_, shape) in zip(written, function.results) for x in (array.pointer, prod(shape))]
        function.launch(card, stream_of([*named, *(("out", array) for array in written)], self._row), states, said)
        if key is not None and out is None and all(array is row for array, (row, _) in zip(arrays, rows)) and not of_each:
            if len(self._plans) >= KEPT:
                self._plans.clear()
            self._plans[key] = Plan(function, card, states, [stride for _, stride in rows], shapes)
        return tuple(results) if len(results) > 1 else results[0]

    def _chosen(self, given: Sequence[Any], keywords: dict[str, Any]) -> tuple[tuple[CardFunction, ...], list[Any], dict[str, Any], Any]:
        """The functions that answer what is asked for, of any precision; inputs, what links are given, and `out`."""
        key: tuple[tuple[str, Any], ...] = ()
        if not keywords and len(given) == len(self._names):
            inputs, besides, out = list(given), dict.fromkeys(OF_LINKS), None
        else:
            key, inputs, besides, out = self._asked_for(given, keywords)
        if key not in self._known:
            asked = key or self._asked_for(given, keywords)[0]
            if len(self._known) >= KEPT:
                self._known.clear()
            self._known[key] = tuple(f for f, own in zip(self._compiled, self._asked) if own == asked)
        if not (functions := self._known[key]):
            raise ArgumentError(
                f"{self._row}: the card's code answers {', '.join(f.asked for f in self._compiled)}, and the call asks for something else; compile that, too, or move the arrays to the processor"
            )
        return functions, inputs, besides, out

    def _asked_for(self, given: Sequence[Any], keywords: dict[str, Any]) -> tuple[tuple[tuple[str, Any], ...], list[Any], dict[str, Any], Any]:
        """What a call asks for besides its inputs, as a key; inputs, what links are given, `out`.  Raises TypeError as the call does."""
        keywords = dict(keywords)
        parameters = keywords.pop("parameters", None)  # which calls on the processor don't have
        try:
            bound = self._signature.bind(*given, **keywords)
        except TypeError:
            self._own(*given, **keywords)  # whose words these are
            raise
        bound.apply_defaults()
        found = bound.arguments
        inputs = [found.pop(name) for name in self._names]
        own = [found.pop(name, None) for name in OWN]
        asked = tuple((name, _plain((x,) if name in LISTS and isinstance(x, str) else x)) for name, x in found.items())
        return asked, inputs, {"external": own[2], "parameters": parameters}, own[0]

    def _given_results(self, out: Any, shapes: Sequence[tuple[int, ...]], function: CardFunction) -> list[Any]:
        given = list(out) if isinstance(out, (tuple, list)) else [out]
        if len(given) != len(shapes):
            raise ArgumentError(f"out is {type(out).__name__}; expected {len(shapes)} arrays, ({', '.join(name for name, _ in function.results)})")
        if any(map(is_read_only, given)):
            raise ArgumentError("out is read-only; give an array that may be written to")
        return given

    def _require_result(
        self, array: CardArray, shape: tuple[int, ...], function: CardFunction, card: int, inputs: Sequence[tuple[CardArray, int, int]], states: int
    ) -> None:
        """Raises ArgumentError for memory that can't take a result, or that an input is partly in."""
        width = prod(shape) // max(states, 1)
        if array.shape != shape or array.scalar != function.scalar or not is_contiguous(array):
            raise ArgumentError(f"out is {NUMPY[array.scalar]} {array.shape}; expected a C-contiguous {NUMPY[function.scalar]} array of shape {shape}")
        if array.card != card and states:  # arrays without numbers are on none
            raise ArgumentError(
                f"out is on cuda:{array.card}, and arguments are on cuda:{card}; move it there, or make cuda:{card} the current card of the library that makes it"
            )
        size = 4 if function.scalar == "float" else 8
        first, last = array.pointer, array.pointer + size * prod(shape)
        for x, stride, columns in inputs if states else ():
            begin = x.pointer + min(0, size * stride * (states - 1))
            end = x.pointer + size * (max(0, stride * (states - 1)) + columns)
            if states == 1:
                stride = columns  # a row alone has none
            if begin < last and first < end and (x.pointer, stride, columns) != (first, width, width):
                raise ArgumentError("out overlaps an argument; it may be one of the arguments, and otherwise has memory of its own")


def of_links(call: str, functions: Sequence[CardFunction], besides: dict[str, Any]) -> list[CardFunction]:
    """The functions that take wrenches on the links that a call names, and their parameters."""
    for kind, given in besides.items():
        if given is not None and not isinstance(given, Mapping):
            raise ArgumentError(f"{call}: {kind} is {type(given).__name__}; expected {{link: (…, {OF_LINKS[kind][0]})}}, arrays on the card")
    found = [f for f in functions if all(set(given or ()) == set(getattr(f, kind)) for kind, given in besides.items())]
    if found:
        return found
    links = {kind: list(dict.fromkeys(", ".join(getattr(f, kind)) or "no link" for f in functions)) for kind in besides}
    kind = next((kind for kind, given in besides.items() if ", ".join(given or ()) not in links[kind] and (given or links[kind] != ["no link"])), "parameters")
    given = list(besides[kind] or ())
    mend = (
        f"leave it out, unless results depend on it: then compile with {kind}={sorted(given)}"
        if links[kind] == ["no link"]
        else f"compile with {kind}={sorted(given)}, or give these"
    )
    raise ArgumentError(f"{call}: {kind} names {', '.join(map(repr, given)) or 'no link'}, and the card's code is of {' or of '.join(links[kind])}; {mend}")


def arrays_of_links(besides: dict[str, Any], driver: Driver) -> dict[str, CardArray]:
    """What links are given, by the names that messages have for it."""
    return {(what := f"{kind}[{link!r}]"): array_of(x, what, driver) for kind, given in besides.items() for link, x in (given or {}).items()}


def of_one_type(call: str, functions: Sequence[CardFunction], arrays: Sequence[tuple[str, CardArray]]) -> CardFunction:
    """The function of the arrays' precision."""
    found = {array.scalar: name for name, array in arrays}
    if len(found) > 1:
        raise ArgumentError(f"{call}: {found['double']} holds numbers of float64 and {found['float']} of float32; give one type")
    for function in functions:
        if function.scalar in found or not found:
            return function
    (scalar,) = found
    raise ArgumentError(f"{call}: arrays are of {NUMPY[scalar]}, and the card's code isn't; compile with scalar={scalar!r}, too")


def place_of(call: str, function: CardFunction, named: Sequence[tuple[str, CardArray]]) -> tuple[int, tuple[int, ...]]:
    """The card that all are on, and the leading shape that they have in common."""
    cards, types = {array.card: name for name, array in reversed(named)}, {array.scalar: name for name, array in named}
    if len(cards) > 1:
        said = " and ".join(f"{name} on cuda:{card}" for card, name in cards.items())
        raise ArgumentError(f"{call}: {said}; move all to one card")
    if len(types) > 1:
        raise ArgumentError(f"{call}: {' and '.join(types.values())} hold numbers of different types; give one type")
    widths = dict(function.inputs)
    for name, array in named:
        of_link = OF_LINKS.get(name.partition("[")[0])
        width, of = of_link or (widths[name], f"{'nq' if name in ('q', 'q0', 'q1') else 'nv'} numbers for each state")
        if array.shape[-1:] != (width,):
            raise ArgumentError(f"{name} has shape {array.shape}; expected (…, {width}): {of}")
    try:
        leading = np.broadcast_shapes(*(array.shape[:-1] for _, array in named))
    except ValueError:
        raise ArgumentError(f"leading shapes don't broadcast: {', '.join(f'{name} {array.shape}' for name, array in named)}") from None
    (card,) = cards
    return card, leading


def _require_apart(results: Sequence[CardArray]) -> None:
    """Raises ArgumentError for results that share memory."""
    places = sorted((x.pointer, x.pointer + (4 if x.scalar == "float" else 8) * prod(x.shape)) for x in results if prod(x.shape))
    if any(begin < end for (_, end), (begin, _) in pairwise(places)):
        raise ArgumentError("out: two results share memory; each needs its own")


def rows_of(array: CardArray, leading: tuple[int, ...], size: int, name: str) -> tuple[CardArray, int]:
    """An array whose rows are at equal distances, and this distance; a copy where they aren't."""
    if (stride := row_stride(array, leading, size)) is not None:
        return array, stride
    return copied(array, leading, size, name), size


def _plain(x: Any) -> Any:
    """A keyword's value, so that it can be compared and kept: names in order, and numbers."""
    if isinstance(x, np.ndarray):
        return tuple(x.ravel().tolist())
    return tuple(map(_plain, x)) if isinstance(x, Iterable) and not isinstance(x, (str, dict)) else x


def joined(function: CardFunction, arrays: Mapping[str, CardArray]) -> list[CardArray]:
    """What links are given as kernels take it: for each kind a row, those of several links behind each other, which their library copies."""
    found = []
    for kind in OF_LINKS:
        of_kind = [arrays[f"{kind}[{link!r}]"] for link in getattr(function, kind)]
        if len(of_kind) > 1:
            own: tuple[int, ...] = np.broadcast_shapes(*(array.shape[:-1] for array in of_kind))  # one row for all states stays one
            of_kind = [concatenated(of_kind, own, kind)]
        found += of_kind
    return found
