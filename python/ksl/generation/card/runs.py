"""`m.simulate` with arrays on a card: a kernel that takes each run through all steps between two times (../cuda/simulation.py)."""

from __future__ import annotations

import functools
import inspect
import math
import struct
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np

from ksl.base.errors import ArgumentError
from ksl.base.real_arrays import real_array
from ksl.generation.card.arrays import CardArray, array_of, empty, filled, is_on_card, is_tensor, stream_of
from ksl.generation.card.calls import arrays_of_links, joined, of_links, of_one_type, place_of, rows_of
from ksl.generation.card.functions import CardFunction
from ksl.generation.cuda.simulation import METHODS

if TYPE_CHECKING:
    from ksl.model.model import Model

TAKEN = ("q", "v", "times", "efforts", "method", "step", "most_steps", "threads")
"""What a call on a card may be given."""


@dataclass(frozen=True)
class CardRuns:
    """Motions on a card, of the library of the first argument: what `ksl.simulation.Simulation` has of them there."""

    times: np.ndarray
    """(times) s."""
    q: Any
    """(…, times, nq)"""
    v: Any
    """(…, times, nv)"""


class SimulateCall:
    """The call of a model.  With arrays on a card it is a kernel, otherwise the model's own."""

    def __init__(self, model: Model, row: str, compiled: Sequence[CardFunction]) -> None:
        self._own = getattr(type(model), row).__get__(model)
        functools.update_wrapper(self, self._own)
        self._row, self._compiled, self._signature = row, compiled, inspect.signature(self._own)
        self._by_method = {str(f.keywords["method"]): [other for other in compiled if other.keywords == f.keywords] for f in compiled}

    def __call__(self, *given: Any, **keywords: Any) -> Any:
        if not any(map(is_on_card, (*given, *keywords.values()))):
            if "parameters" in keywords:
                raise ArgumentError("simulate: parameters= is for arrays on a card, and all are the processor's; with_parameters makes a model that has them")
            return self._own(*given, **keywords)
        asked = self._asked(given, keywords)
        times, steps = _steps(asked["times"], asked["step"], asked["most_steps"])
        driver = self._compiled[0].driver
        named = [(name, array_of(asked[name], name, driver)) for name in ("q", "v")]
        if asked["efforts"] is not None:
            named.append(("efforts", _of_each_run(array_of(asked["efforts"], "efforts", driver))))
        besides = {"parameters": asked["parameters"]}
        functions = of_links(self._row, self._by_method[asked["method"]], besides)
        of_each = arrays_of_links(besides, driver)
        named += of_each.items()
        function = of_one_type(self._row, functions, named)
        card, leading = place_of(self._row, function, named)
        like, runs, size = named[0][1], prod(leading), 4 if function.scalar == "float" else 8
        of_runs = dict(named)
        efforts = of_runs.get("efforts") or filled(0.0, function.inputs[2][1], like)
        arrays = [of_runs["q"], of_runs["v"], efforts, *joined(function, of_each)]
        rows = [rows_of(array, leading, width, name) for array, (name, width) in zip(arrays, function.inputs)]
        made = [empty((*leading, len(times), width), like, self._row) for _, (width,) in function.results]
        results = [(array_of(x, name, driver), width) for x, (name, (width,)) in zip(made, function.results)]
        stream = stream_of(named, self._row)
        state = [(array.pointer, stride) for array, stride in rows[:2]]
        for k, (count, h) in enumerate(steps):
            end = [(x.pointer + size * k * width, len(times) * width) for x, width in results]
            effort, *others = [(array.pointer, stride) for array, stride in rows[2:]]
            said = [count, _bits(h, function.scalar), *state[0], *state[1], *effort, 0, *(x for each in others for x in each), *end[0], *end[1]]
            function.launch(card, stream, runs, said)
            state = end
        return CardRuns(times, *made)

    def _asked(self, given: Sequence[Any], keywords: dict[str, Any]) -> dict[str, Any]:
        """Arguments by their names.  Raises ArgumentError for those that a card doesn't serve."""
        parameters = keywords.pop("parameters", None)  # which runs on the processor don't have
        bound = self._signature.bind(*given, **keywords)
        bound.apply_defaults()
        for name, x in bound.arguments.items():
            default = self._signature.parameters[name].default
            if name not in TAKEN and x is not default and (is_on_card(x) or x != default):
                raise ArgumentError(f"simulate: runs on a card have no {name}=; leave it out, or move the arrays to the processor")
        if (method := bound.arguments["method"]) not in self._by_method:
            other = f"compile 'simulate:{method}'" if method in METHODS else "ask for it, with a step"
            raise ArgumentError(
                f"simulate: method={method!r}: runs on a card go by {' or '.join(self._by_method)}; {other}, or move the arrays to the processor"
            )
        return bound.arguments | {"parameters": parameters}


def _steps(times: Any, step: Any, most: Any) -> tuple[np.ndarray, list[tuple[int, float]]]:
    """Times, and for each how many steps of which length lead there, as m.simulate cuts the time between two (src/simulate/methods/methods.cpp)."""
    at = np.array(real_array(times, "times"), float)
    if at.ndim != 1 or not len(at) or not np.isfinite(at).all() or (np.diff(at) <= 0).any():
        raise ArgumentError("simulate: times: expected (n) finite times that increase, the first that of the start")
    if isinstance(step, bool) or not isinstance(step, (int, float)) or not 0 < step < math.inf:
        raise ArgumentError(f"simulate: step={step!r}: expected the longest step, a finite time above zero, s")
    found = [(0, 0.0)]
    for begin, end in zip(at.tolist(), at[1:].tolist()):
        rounding = 2 * sys.float_info.epsilon * max(abs(begin), abs(end))
        exact = (end - begin - rounding) / step * (1 - 1e-12)
        count = max(1, math.ceil(exact))
        found.append((count, (end - begin) / count))
    if (whole := sum(count for count, _ in found)) > most:
        raise ArgumentError(f"simulate: a run takes {whole:,} steps, more than most_steps, {most:,}; take longer steps, or an earlier end")
    return at, found


def _of_each_run(efforts: CardArray) -> CardArray:
    """Efforts of each run (…, 1, nv) as rows (…, nv); efforts (nv) are those of all runs."""
    if len(efforts.shape) == 1:
        return efforts
    if efforts.shape[-2] != 1:
        raise ArgumentError(
            f"efforts has shape {efforts.shape}; runs on a card have constant ones, (nv) of all runs or (…, 1, nv) of each; efforts that change need a call for each interval"
        )
    of = efforts.of.squeeze(-2) if is_tensor(efforts.of) else efforts.of
    return replace(efforts, shape=(*efforts.shape[:-2], efforts.shape[-1]), strides=(*efforts.strides[:-2], efforts.strides[-1]), of=of)


def _bits(h: float, scalar: str) -> int:
    """A number as the bytes of a whole one of 64 bits, which is how launches are given all arguments."""
    found: int = struct.unpack("<q", struct.pack("<d", h) if scalar == "double" else struct.pack("<f4x", h))[0]
    return found
