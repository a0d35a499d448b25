"""Batches of the maps by code that is compiled for one mechanism: recorded functions, computed in lanes."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from ksl import _core
from ksl.base.errors import near_names
from ksl.drivetrain.elimination import PivotOrder, above, solved
from ksl.drivetrain.motion import COMPILED, MotionMap
from ksl.drivetrain.recorded_maps import RecordedMaps, only_where
from ksl.generation.arguments import Arguments
from ksl.generation.batches import INCLUDED, Batch, definitions, instruction_bytes
from ksl.generation.compiled import load
from ksl.generation.compiler import find_compiler
from ksl.generation.expressions import Graph, Objects
from ksl.generation.lanes_files import call_of
from ksl.generation.requests import Function
from ksl.mechanism import given
from ksl.mechanism.states import Array

PREFIX = "k_"
CURVATURE = 10.0
"""One of Newton's steps leaves its square times the curvature of the equations, 1/rad or 1/m, which is less than this but near dead centres."""
SHARE = 8192
"""So many states at least are computed by one thread."""


class CompiledCall:
    """One of the calls: rows of its inputs, and of its result."""

    def __init__(self, function: Callable[..., None]) -> None:
        self._function = function

    def __call__(self, rows: Sequence[Array], found: Array, threads: int | None) -> Array:
        """Writes results (n, …), C-contiguous, for rows (n, numbers) of each input.  Returns errors (n), rad or m; NaN where results mean nothing."""
        n, error = len(found), np.empty(len(found))
        arrays = [np.ascontiguousarray(x, dtype=float) for x in (*rows, found, error)]
        workers = min(given.threads(threads) or _cores(), n // SHARE) or 1
        ends = np.linspace(0, n, workers + 1).astype(int).tolist()

        def compute(first: int, end: int) -> None:
            self._function(end - first, *(ctypes.c_void_p(x.ctypes.data + first * x.strides[0]) for x in arrays))

        if workers == 1:
            compute(0, n)
        else:
            with ThreadPoolExecutor(workers) as pool:
                list(pool.map(compute, ends[:-1], ends[1:]))
        return error


def compiled_calls(a: MotionMap, q: Array, calls: str | Sequence[str], compiler: str | None) -> dict[str, CompiledCall]:
    """Code of these calls, fitted over positions q (n, joints).  Raises ValueError for a call that is none, and CompilerError."""
    named = list(dict.fromkeys(calls.split(",") if isinstance(calls, str) else calls))
    for call in named:
        if call not in COMPILED:
            raise ValueError(f"calls: {call!r} isn't compiled; {near_names(call, COMPILED)}there are {', '.join(COMPILED)}")
    found = find_compiler(compiler)
    maps, lanes = RecordedMaps(a, q), instruction_bytes(_core.instruction_set()) // 8
    batches = [Batch(_function(maps, call), number, PREFIX, "double", lanes, of_library=False) for number, call in enumerate(named)]
    text = "\n".join([INCLUDED, definitions(batches, judged=False), *(batch.text() + "\n" + call_of(batch, "double", lanes) for batch in batches)])
    library = load(text, found)
    code = {}
    for batch in batches:
        function = getattr(library, f"{PREFIX}lanes_{batch.function.name}")
        function.argtypes, function.restype = [ctypes.c_size_t, *[ctypes.c_void_p] * (len(batch.inputs) + 2)], None
        code[batch.function.name] = CompiledCall(function)
    return code


def _function(maps: RecordedMaps, call: str) -> Function:
    """The whole of one call, recorded."""
    graph, d = Graph(), maps.directions["joints_of" if call == "joints_of" else "motors_of"]
    first = graph.inputs(d.given, len(d.held))
    is_position = call in ("motors_of", "joints_of")
    positions, W, last = maps.position(graph, d, first, d.steps + (not is_position))
    error = CURVATURE * last * last if is_position else last  # Jacobians are those of the position before the last step
    if is_position:
        result: Any = positions
    elif call == "motor_jacobian":
        result = W
    else:
        x = np.eye(len(d.held), dtype=object) if call == "jacobian" else graph.inputs("x", len(d.held))
        result, error = _mapped(graph, maps.rates_order, call, W, x, error)
    return Function(call, "", (), {}, None, graph.recording(call, {"found": result, "error": error}), Arguments(), "")


def _mapped(graph: Graph, order: PivotOrder, call: str, W: Objects, x: Any, error: Any) -> tuple[Any, Any]:
    """What motors' rates W (motors, joints) make of numbers x, and the error: NaN where they hold little or nothing."""
    if call in ("motor_velocities", "static_joint_efforts"):
        return (W if call == "motor_velocities" else W.T) @ x, error
    if call == "static_motor_efforts":
        W, order = W.T, PivotOrder(tuple((column, row) for row, column in order.places), order.least)
    result, pivots = solved(W, x if x.ndim == 2 else x[:, None], order)
    return result if x.ndim == 2 else result[:, 0], only_where(graph, above(pivots, order), error)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
