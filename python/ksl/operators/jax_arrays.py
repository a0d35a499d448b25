"""Operators for JAX: primitives, which compiled programs run in the extension on XLA's own arrays.

Each stage is a primitive.  JVP is linear in the changes of inputs, and its transpose is VJP; JVP of JVP is SECOND_JVP, and so on.  All rules follow
from these few, so that no operator has one of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir

from ksl import _core
from ksl.base.real_arrays import real_array
from ksl.operators import jax_card
from ksl.operators.calls import Calls
from ksl.operators.operator import NEXT, Operator, Stage, arranged, mapped, of_all_links, of_own_links

TARGET = "ksl_operator"
CARD = "gpu"
"""What JAX calls the platform of devices with CUDA.  Programs for other makers' have no rule below."""

jax.ffi.register_ffi_target(TARGET, _core.xla_handler, platform="cpu")

PRIMITIVES = {stage: Primitive(f"ksl_{stage.name.lower()}") for stage in Stage}
for _primitive in PRIMITIVES.values():
    _primitive.multiple_results = True


class JaxCalls(Calls[jax.Array]):
    """Calls of a model on JAX arrays: `jit`, `grad`, `jvp`, `vmap` and their combinations."""

    def _apply(self, operator: Operator, arguments: Sequence[Any]) -> jax.Array:
        arrays = _of_one_type(operator.name, operator.inputs, arguments)
        rows, found = arranged(operator, arrays, jnp.broadcast_to)
        (result,) = bind(Stage.VALUE, operator, rows)
        return result.reshape(*found.leading, *operator.shape)

    def _array(self, x: Any, what: str) -> Any:
        return jnp.asarray(x) if _is_array(x) else _numbers(x, what)

    def _joined(self, name: str, wrenches: Mapping[str, Any]) -> Any:
        if not any(map(_is_array, wrenches.values())):  # they go where the other arguments are
            return np.concatenate(np.broadcast_arrays(*wrenches.values()), axis=-1)
        return jnp.concatenate(jnp.broadcast_arrays(*_of_one_type(name, list(wrenches), list(wrenches.values()))), axis=-1)

    def _is_differentiated(self, x: object) -> bool:
        return isinstance(x, jax.core.Tracer) or _holds_arrays(x)


def bind(stage: Stage, operator: Operator, arguments: Sequence[Any]) -> list[Any]:
    return list(PRIMITIVES[stage].bind(*_varying_alike(arguments), operator=operator))


def _varying(x: Any) -> frozenset[Any]:
    """Axes of a mesh along which devices have numbers of their own, within `jax.shard_map`; x: an array, or its type."""
    of = getattr(x, "aval", x)
    own = getattr(of, "mat", None)  # since JAX 0.10, before that `vma`
    return frozenset(own.varying if own is not None else getattr(of, "vma", ()))


def _varying_alike(arguments: Sequence[Any]) -> Sequence[Any]:
    """Arguments that vary along the same axes: what all devices share is a copy on each, whose gradients JAX adds."""
    of_each = [_varying(x) for x in arguments]
    axes = frozenset[Any]().union(*of_each)
    if not axes:
        return arguments
    copies = partial(jax.lax.pcast, to="varying") if hasattr(jax.lax, "pcast") else jax.lax.pvary
    return [x if own == axes else copies(x, tuple(sorted(axes - own))) for x, own in zip(arguments, of_each)]


def _of_one_type(call: str, inputs: Sequence[str], arguments: Sequence[Any]) -> list[jax.Array]:
    """JAX arrays of one precision on devices that can be reached; numbers and weakly typed arrays take that of the others, and so do numbers their device."""
    there = _device_of(arguments)
    arrays = [_array(x, f"{call}: {name}", there) for name, x in zip(inputs, arguments)]
    strong = {name: x.dtype for name, x in zip(inputs, arrays) if not x.weak_type}
    types = set(strong.values()) or {jnp.result_type(float)}
    found = ", ".join(f"{name} {x.dtype}" for name, x in zip(inputs, arrays))
    if len(types) > 1:
        raise TypeError(f"{call}: arguments have different types: {found}; give all float32 or all float64, by x.astype")
    (dtype,) = types
    if dtype not in (np.float32, np.float64):
        raise TypeError(f"{call}: arguments are {found}; expected float32 or float64, by x.astype")
    for name, x in zip(inputs, arrays):
        _require_reached(call, name, x)
    return [x.astype(dtype) for x in arrays]


def _device_of(arguments: Sequence[Any]) -> Any:
    """Where numbers are put that no device has yet: beside the first array of JAX, and to the processor where there is none.  None: JAX puts them where the others are."""
    for x in arguments:
        if isinstance(x, jax.Array) and not isinstance(x, jax.core.Tracer):
            return next(iter(x.devices())) if len(x.devices()) == 1 else None
    return None if any(isinstance(x, jax.core.Tracer) for x in arguments) else jax.local_devices(backend="cpu")[0]


def _array(x: Any, what: str, there: Any) -> jax.Array:
    """An array of JAX, of any numbers.  NumPy's may have any byte order."""
    if _is_array(x):
        return jnp.asarray(x)
    return _placed(x if isinstance(x, (int, float)) else _numbers(x, what), there)


def _numbers(x: Any, what: str) -> Any:
    array = real_array(x, what)
    has_type = hasattr(x, "dtype") or array.dtype.kind == "f"  # whole numbers in a list have none
    return array.astype(array.dtype.newbyteorder("=") if has_type else float, copy=False)


def _placed(x: Any, there: Any) -> Any:
    """Numbers that no device has yet: JAX would put them on the first accelerator, if there is one."""
    if there is None or jax.default_backend() == "cpu":
        return jnp.asarray(x)
    with jax.ensure_compile_time_eval():
        return jax.device_put(x, there)


def _is_array(x: object) -> bool:
    return isinstance(x, jax.Array) or _holds_arrays(x)


def _holds_arrays(x: object) -> bool:
    return isinstance(x, (list, tuple)) and any(isinstance(each, jax.Array) for each in x)


def _require_reached(call: str, name: str, x: jax.Array) -> None:
    if isinstance(x, jax.core.Tracer):
        return  # where it will be is known when the program is compiled
    for device in x.devices():
        if device.platform not in ("cpu", CARD):
            raise ValueError(f"{call}: {name} is on {device}, which KSL can't reach; move it by jax.device_put(x, jax.devices('cpu')[0])")


def _shapes(stage: Stage, operator: Operator, first: Any) -> list[tuple[int, ...]]:
    return operator.result_shapes(stage, *first.shape[:2])


def _abstract(stage: Stage, *arguments: Any, operator: Operator) -> list[Any]:
    first = arguments[0]
    shapes = _shapes(stage, operator, first)
    return [first.update(shape=shape) for shape in shapes] if _varying(first) else [jax.core.ShapedArray(shape, first.dtype) for shape in shapes]


def _run(stage: Stage, *arguments: Any, operator: Operator) -> Any:
    """Outside of any program: as a program of its own, compiled once for each shape."""
    if stage not in operator.programs:
        operator.programs[stage] = jax.jit(partial(PRIMITIVES[stage].bind, operator=operator))
    return operator.programs[stage](*arguments)


def _lower_on_card(stage: Stage, context: Any, *arguments: Any, operator: Operator) -> Any:
    _refuse_export(context, operator)
    return jax_card.lower(stage, context, *arguments, operator=operator)


def _refuse_export(context: Any, operator: Operator) -> None:
    if context.module_context.lowering_parameters.for_export:
        raise NotImplementedError(
            f"{operator.name}: jax.export writes programs for other processes, and this one holds a model of this process; pickle what ksl.jax.differentiable returns, and compile the function there"
        )


def _lower(stage: Stage, context: Any, *arguments: Any, operator: Operator) -> Any:
    _refuse_export(context, operator)
    context.module_context.add_keepalive(operator)
    if operator.more.links:
        return mlir.lower_fun(partial(_of_some_links, stage, operator), multiple_results=True)(context, *arguments)
    rule = jax.ffi.ffi_lowering(TARGET)
    return rule(context, *arguments, operator=np.int64(operator.number), stage=np.int64(stage), threads=np.int64(operator.threads))


def _of_some_links(stage: Stage, operator: Operator, *arguments: Any) -> list[Any]:
    whole, like = of_all_links(jnp, operator, stage, arguments), arguments[0]
    shapes = [jax.ShapeDtypeStruct(shape, like.dtype) for shape in operator.result_shapes(stage, like.shape[0], like.shape[1], of_all=True)]
    found = jax.ffi.ffi_call(TARGET, shapes)(*whole, operator=np.int64(operator.number), stage=np.int64(stage), threads=np.int64(operator.threads))
    return of_own_links(operator, stage, found)


def _lower_elsewhere(context: Any, *_: Any, operator: Operator) -> Any:
    platforms = ", ".join(context.module_context.platforms)
    raise ValueError(f"{operator.name}: the program is for {platforms}, which KSL can't reach; give jax.jit arrays on jax.devices('cpu')[0]")


def _changes(of: Sequence[Any], changes: Sequence[Any]) -> list[Any]:
    """Changes as arrays, where JAX says that they are zero."""
    return [jnp.zeros_like(x) if type(d) is ad.Zero else d for x, d in zip(of, changes)]


def _all_zero(changes: Sequence[Any]) -> bool:
    return all(type(d) is ad.Zero for d in changes)


def _sum(parts: list[list[Any]]) -> list[Any]:
    return [sum(each[1:], each[0]) for each in zip(*parts)]


def _jvp(stage: Stage, primals: Sequence[Any], tangents: Sequence[Any], *, operator: Operator) -> tuple[list[Any], list[Any]]:
    x, *linear = operator.split(stage, primals)
    dx, *others = operator.split(stage, tangents)
    result = bind(stage, operator, primals)
    parts = []
    if not _all_zero(dx):
        if stage not in NEXT:
            raise NotImplementedError(f"{operator.name}: there are no third derivatives of it")
        if stage is not Stage.VALUE:
            operator.require_twice()
        parts.append(bind(NEXT[stage], operator, [*primals, *_changes(x, dx)]))
    for i, change in enumerate(others):  # in which the stage is linear
        if not _all_zero(change):
            given = [*linear[:i], _changes(linear[i], change), *linear[i + 1 :]]
            parts.append(bind(stage, operator, [*x, *(each for group in given for each in group)]))
    return result, _sum(parts) if parts else [jnp.zeros_like(y) for y in result]


def _transpose(stage: Stage, cotangents: Sequence[Any], *arguments: Any, operator: Operator) -> list[Any]:
    """JVP and VJP are each other's transposes; so are the second ones by their cotangent, and each its own by its changes."""
    x, *linear = operator.split(stage, arguments)
    groups, states = x[0].shape[:2]
    shapes = operator.result_shapes(stage, groups, states)
    given = [jnp.zeros(shape, x[0].dtype) if type(c) is ad.Zero else c for shape, c in zip(shapes, cotangents)]
    which = next(i for i, part in enumerate(linear) if any(map(ad.is_undefined_primal, part)))
    if stage is Stage.JVP:
        found = bind(Stage.VJP, operator, [*x, *given])
    elif stage is Stage.VJP:
        found = bind(Stage.JVP, operator, [*x, *given])
    elif stage is Stage.SECOND_JVP:
        found = bind(Stage.SECOND_VJP, operator, [*x, *given, *linear[1 - which]])
    elif which == 0:
        found = bind(Stage.SECOND_JVP, operator, [*x, *given, *linear[1]])
    else:
        found = bind(Stage.SECOND_VJP, operator, [*x, *linear[0], *given])
    parts: list[list[Any]] = [[None] * len(x), *([None] * len(part) for part in linear)]
    parts[1 + which] = [f if ad.is_undefined_primal(old) else None for f, old in zip(found, linear[which])]
    return [each for part in parts for each in part]


def _batch(stage: Stage, arguments: Sequence[Any], axes: Sequence[Any], *, operator: Operator) -> tuple[list[Any], list[int]]:
    size = next(x.shape[axis] for x, axis in zip(arguments, axes) if axis is not None)
    results, axis = mapped(jnp, operator, stage, size, axes, arguments, partial(bind, stage, operator))
    return results, [axis] * len(results)


for _stage, _primitive in PRIMITIVES.items():
    _primitive.def_impl(partial(_run, _stage))
    _primitive.def_abstract_eval(partial(_abstract, _stage))
    ad.primitive_jvps[_primitive] = partial(_jvp, _stage)
    if _stage is not Stage.VALUE:
        ad.primitive_transposes[_primitive] = partial(_transpose, _stage)
    batching.primitive_batchers[_primitive] = partial(_batch, _stage)
    mlir.register_lowering(_primitive, partial(_lower, _stage), platform="cpu")
    mlir.register_lowering(_primitive, partial(_lower_on_card, _stage), platform="cuda")
    mlir.register_lowering(_primitive, _lower_elsewhere)
