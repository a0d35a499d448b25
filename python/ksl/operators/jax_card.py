"""Stages of operators in programs of JAX for a graphics card, by what `m.compile(…, device="cuda")` made: a custom call that starts a kernel in XLA's stream.

The call may be part of a command buffer, which XLA records once and launches again.  Kernels differentiate along joint velocities; what that is by the numbers of
quaternions, and of their length, JAX computes around them.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import prod
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.interpreters import mlir

from ksl import _core
from ksl.operators.on_card import POSITIONS, Words, require_compiled, rows_of_states
from ksl.operators.operator import Operator, Stage
from ksl.operators.placed_joints import as_numbers, as_velocity, of_unit_length

TARGET = "ksl_card"
WORDS = Words("arrays", "by jax.device_put(x, jax.devices('cpu')[0])")

jax.ffi.register_ffi_target(TARGET, _core.xla_handler_on_card, platform="CUDA")


def lower(stage: Stage, context: Any, *arguments: Any, operator: Operator) -> Any:
    """The program of a stage for cards.  Raises what `require_compiled` does."""
    function = require_compiled(operator, stage, "float" if context.avals_in[0].dtype == np.float32 else "double", WORDS)
    context.module_context.add_keepalive(function.for_programs)
    return mlir.lower_fun(partial(_computed, stage, operator, function), multiple_results=True)(context, *arguments)


def _computed(stage: Stage, operator: Operator, function: Any, *arguments: Any) -> list[Any]:
    x, *linear = operator.split(stage, arguments)
    joints, result = operator.placed, operator.row.result
    unit = partial(of_unit_length, jnp, joints)
    at = [unit(q) if name in POSITIONS else q for name, q in zip(operator.inputs, x)]
    given = dict(zip(operator.inputs, at))
    if stage is Stage.JVP:
        rates = [
            as_velocity(jnp, joints, q, jax.jvp(unit, (p,), (dp,))[1]) if joints and name in POSITIONS else dp
            for name, p, q, dp in zip(operator.inputs, x, at, linear[0])
        ]
        given |= {f"{name}_dot": dx for name, dx in zip(operator.inputs, rates)}
    if stage is Stage.VJP:
        weights = [name for name, _ in function.inputs if name.endswith("_bar")]
        given[weights[result]] = linear[0][0]
    groups, states = x[0].shape[:2]
    given |= {name: rows_of_states(jnp, given[name], states) for name in ("parameters", "parameters_dot") if name in given}
    made = _called(function, given, x[0])
    if stage is not Stage.VJP:
        return [made[function.results[result][0]]]
    by = [made.get(f"{name}_bar") for name in operator.inputs]
    if operator.parameters and by[-1] is not None:
        by[-1] = by[-1].reshape(groups, states, len(operator.links), 10).sum(1)
    whole = [jnp.zeros_like(p) if y is None else y for p, y in zip(x, by)]
    if not joints:
        return whole
    return [jax.vjp(unit, p)[1](as_numbers(jnp, joints, q, y))[0] if name in POSITIONS else y for name, p, q, y in zip(operator.inputs, x, at, whole)]


def _called(function: Any, given: dict[str, Any], like: Any) -> dict[str, Any]:
    """The kernel's results by their names; inputs that aren't given are a row of zeros for all states."""
    inputs: Sequence[Any] = [given[name] if name in given else jnp.zeros((1, 1, numbers), like.dtype) for name, numbers in function.inputs]
    shapes = [jax.ShapeDtypeStruct((*like.shape[:2], prod(shape)), like.dtype) for _, shape in function.results]
    found = jax.ffi.ffi_call(TARGET, shapes)(*inputs, kernel=np.int64(function.for_programs.number))
    return {name: y for (name, _), y in zip(function.results, found)}
