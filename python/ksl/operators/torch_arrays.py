"""Operators for torch: functions of autograd, and an operator of torch, of which `torch.compile` makes nodes of its graph.

autograd differentiates JVP and VJP again, by the rules in `_Stage`.  Compiled graphs know reverse mode alone, which torch's operator has.  It is registered
directly, which takes a third of the time of `torch.library.custom_op`, and serves tensors on cards outside of graphs, too.
"""

from __future__ import annotations

import weakref
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, cast

import numpy as np
import torch
from torch import Tensor

from ksl.base.real_arrays import real_array
from ksl.operators.calls import Calls
from ksl.operators.operator import NEXT, Operator, Stage, arranged, mapped
from ksl.operators.on_card import POSITIONS
from ksl.operators.placed_joints import of_unit_length
from ksl.operators.torch_card import card_of, compute_on_card, require_compiled


class TorchCalls(Calls[Tensor]):
    """Calls of a model on tensors: `backward`, `torch.func`, forward mode, `torch.compile`."""

    def _apply(self, operator: Operator, arguments: Sequence[Any]) -> Tensor:
        tensors = _of_one_type(operator.name, operator.inputs, arguments)
        on_card = card_of(tensors[0]) is not None
        if on_card:
            if not torch.compiler.is_compiling():
                require_compiled(operator, Stage.VALUE, tensors[0].dtype)
            if operator.placed:
                tensors = [of_unit_length(torch, operator.placed, x) if name in POSITIONS else x for name, x in zip(operator.inputs, tensors)]
        rows, found = arranged(operator, tensors, torch.broadcast_to)
        if torch.compiler.is_compiling() or (on_card and not _is_transformed()):
            result = torch.ops.ksl.compute(rows, operator.number, int(Stage.VALUE))[0]
        else:
            result = _apply_stage(Stage.VALUE, operator, rows)[0]
        return result.reshape((*found.leading, *operator.shape))  # () for energies of one state

    def _array(self, x: Any, what: str) -> Any:
        return x if isinstance(x, Tensor) else np.asarray(x) if torch.compiler.is_compiling() else _numbers(x, what)

    def _joined(self, name: str, wrenches: Mapping[str, Any]) -> Any:
        arrays = list(wrenches.values())
        if not any(isinstance(x, Tensor) for x in arrays):  # they take the type of the other arguments
            return np.concatenate(np.broadcast_arrays(*arrays), axis=-1)
        return torch.cat(torch.broadcast_tensors(*_of_one_type(name, list(wrenches), arrays)), dim=-1)

    def _is_differentiated(self, x: object) -> bool:
        return isinstance(x, Tensor) or _holds_tensors(x)

    @torch.compiler.assume_constant_result
    def _operator(self, *arguments: Any) -> Operator:
        operator = super()._operator(*arguments)
        _BY_NUMBER[operator.number] = operator
        return operator


_BY_NUMBER: weakref.WeakValueDictionary[int, Operator] = weakref.WeakValueDictionary()
"""Operators of compiled graphs, which name them by number."""


def _operator_of(number: int) -> Operator:
    found = _BY_NUMBER.get(number)
    if found is None:
        raise RuntimeError(
            "the model of this compiled graph is of another process, or is gone; keep what ksl.torch.differentiable returns as long as the graph, and compile it again"
        )
    return found


def _of_one_type(call: str, inputs: Sequence[str], arguments: Sequence[Any]) -> list[Tensor]:
    """Tensors of one precision on the CPU, or on one card; numbers and other arrays, which don't differentiate, take the type of the tensors, or else of NumPy's arrays."""
    given = [x for x in arguments if isinstance(x, Tensor)]
    doubles = any(isinstance(x, np.ndarray) and x.dtype.kind == "f" and x.dtype.itemsize > 4 for x in arguments)
    types = {x.dtype for x in given} or {torch.float64 if doubles else torch.get_default_dtype()}
    found = ", ".join(f"{name} {x.dtype}" for name, x in zip(inputs, arguments) if isinstance(x, Tensor))
    if len(types) > 1:
        raise TypeError(f"{call}: arguments have different types: {found}; give all float32 or all float64, by x.to")
    (dtype,) = types
    if dtype not in (torch.float32, torch.float64):
        raise TypeError(f"{call}: arguments are {found}; expected torch.float32 or torch.float64, by x.to")
    for name, x in zip(inputs, arguments):
        if not isinstance(x, Tensor):
            continue
        if x.device.type not in ("cpu", "cuda"):
            raise ValueError(f"{call}: {name} is on {x.device}, which KSL can't reach; move it by {name}.cpu()")
        if x.is_nested:
            raise ValueError(
                f"{call}: {name} is a nested tensor; expected one of one shape, by torch.nested.to_padded_tensor({name}, 0.0), or call with each of {name}.unbind()"
            )
        if x.layout is not torch.strided:
            raise ValueError(f"{call}: {name} is a tensor of {x.layout}; expected a dense one, by {name}.to_dense()")
    device = given[0].device if given else torch.device("cpu")
    for name, x in zip(inputs, arguments):
        if isinstance(x, Tensor) and x.device != device:
            raise ValueError(f"{call}: {name} is on {x.device}, and an argument before it on {device}; move all to one device, by x.to")
    return [x if isinstance(x, Tensor) else _tensor(x, f"{call}: {name}", dtype, device) for name, x in zip(inputs, arguments)]


def _tensor(x: Any, what: str, dtype: torch.dtype, device: torch.device) -> Tensor:
    """A tensor where the others are, whichever device torch.set_default_device names, of numbers, or of an array with any strides, byte order and rights, which is copied."""
    if isinstance(x, (int, float)):
        return torch.full((), x, dtype=dtype, device=device)
    if device.type != "cpu":
        raise ValueError(
            f"{what} is in the processor's memory, and others are on {device}; move it by torch.as_tensor({what.rpartition(' ')[2]}, device='{device}')"
        )
    if torch.compiler.is_compiling():
        return torch.as_tensor(x, dtype=dtype, device="cpu")
    return torch.as_tensor(np.array(_numbers(x, what), np.float32 if dtype == torch.float32 else np.float64), dtype=dtype, device="cpu")


def _numbers(x: Any, what: str) -> Any:
    if _holds_tensors(x):
        raise TypeError(f"{what} is a {type(x).__name__} of tensors, whose gradients would be lost; give one tensor, by torch.stack")
    return real_array(x, what)


def _holds_tensors(x: object) -> bool:
    return isinstance(x, (list, tuple)) and any(isinstance(each, Tensor) or _holds_tensors(each) for each in x)


def _compute(operator: Operator, stage: Stage, arguments: Sequence[Tensor]) -> list[Tensor]:
    """Runs a stage.  The extension reads and writes the memory of the tensors."""
    if not torch.compiler.is_compiling() and any(torch._C._functorch.is_legacy_batchedtensor(x) for x in arguments):
        raise NotImplementedError(
            f"{operator.name}: is_grads_batched= and vectorize= of torch.autograd map where libraries have no part; take torch.func.jacrev, jacfwd, hessian or vmap"
        )
    plain = [x.detach().resolve_neg().contiguous() for x in arguments]
    if (card := card_of(plain[0])) is not None:
        return compute_on_card(operator, stage, plain, card)
    groups, states = plain[0].shape[:2]
    results = [torch.empty(shape, dtype=plain[0].dtype, device="cpu") for shape in operator.result_shapes(stage, groups, states)]
    operator.compute(stage, plain, results)
    return results


def _is_transformed() -> bool:
    """Is something mapped, or differentiated in the forward direction, which takes the rules of `_Stage`?"""
    return bool(torch.autograd.forward_ad._current_level >= 0) or torch._C._functorch.peek_interpreter_stack() is not None


def _filled(given: Sequence[Tensor | None], like: Sequence[Tensor]) -> list[Tensor]:
    return [torch.zeros_like(x) if d is None else d for d, x in zip(given, like)]


def _apply_stage(stage: Stage, operator: Operator, arguments: Sequence[Tensor]) -> tuple[Tensor, ...]:
    return cast("tuple[Tensor, ...]", _StageFunction.apply(stage, operator, *arguments))


class _StageFunction(torch.autograd.Function):
    """A stage of an operator.  Arguments and results are tensors with three axes (:class:`ksl.operators.operator.Operator`)."""

    @staticmethod
    def forward(stage: Stage, operator: Operator, *arguments: Tensor) -> tuple[Tensor, ...]:
        return tuple(_compute(operator, stage, arguments))

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Any) -> None:
        ctx.stage, ctx.operator, *arguments = inputs
        ctx.save_for_backward(*arguments)
        ctx.save_for_forward(*arguments)
        ctx.set_materialize_grads(False)

    @staticmethod
    def backward(ctx: Any, *cotangents: Tensor | None) -> tuple[Tensor | None, ...]:
        gradients = _backward(ctx.stage, ctx.operator, ctx.saved_tensors, cotangents, ctx.needs_input_grad[2:])
        return None, None, *gradients

    @staticmethod
    def jvp(ctx: Any, *changes: Tensor | None) -> tuple[Tensor, ...]:
        return _forward(ctx.stage, ctx.operator, ctx.saved_tensors, changes[2:])

    @staticmethod
    def vmap(info: Any, axes: tuple[Any, ...], stage: Stage, operator: Operator, *arguments: Tensor) -> tuple[tuple[Tensor, ...], tuple[int, ...]]:
        return _mapped(info.batch_size, axes[2:], stage, operator, arguments)


def _backward(
    stage: Stage, operator: Operator, arguments: Sequence[Tensor], cotangents: Sequence[Tensor | None], needed: Sequence[bool]
) -> list[Tensor | None]:
    """The cotangents of the arguments of a stage: JVP and VJP are each other's transposes in what they are linear in."""
    x, *linear = operator.split(stage, arguments)
    if all(c is None for c in cotangents):
        return [None] * len(arguments)
    groups, states = x[0].shape[:2]
    shapes = operator.result_shapes(stage, groups, states)
    given = [x[0].new_zeros(shape) if c is None else c for shape, c in zip(shapes, cotangents)]
    wanted = operator.split(stage, needed)
    found: list[list[Tensor | None]] = [[None] * len(part) for part in (x, *linear)]
    if any(wanted[0]):
        found[0] = list(_of_inputs(stage, operator, x, linear, given))
    for i in range(len(linear)):
        if any(wanted[1 + i]):
            found[1 + i] = list(_transposed(stage, operator, x, linear, given, i))
    return [each if need else None for each, need in zip((each for part in found for each in part), needed)]


def _of_inputs(stage: Stage, operator: Operator, x: list[Tensor], linear: list[list[Tensor]], given: list[Tensor]) -> Sequence[Tensor]:
    """By the inputs, in which a stage isn't linear."""
    if stage is Stage.VALUE:
        return _apply_stage(Stage.VJP, operator, [*x, *given])
    if stage not in (Stage.JVP, Stage.VJP):
        raise NotImplementedError(f"{operator.name}: there are no third derivatives of it")
    operator.require_twice()
    if stage is Stage.JVP:  # of λ · (second derivative along dx and dx₂) along dx₂
        return _apply_stage(Stage.SECOND_VJP, operator, [*x, *given, *linear[0]])
    return _apply_stage(Stage.SECOND_VJP, operator, [*x, *linear[0], *given])


def _transposed(stage: Stage, operator: Operator, x: list[Tensor], linear: list[list[Tensor]], given: list[Tensor], which: int) -> Sequence[Tensor]:
    if stage is Stage.JVP:
        return _apply_stage(Stage.VJP, operator, [*x, *given])
    if stage is Stage.VJP:
        return _apply_stage(Stage.JVP, operator, [*x, *given])
    if stage is Stage.SECOND_JVP:
        return _apply_stage(Stage.SECOND_VJP, operator, [*x, *given, *linear[1 - which]])
    if which == 0:
        return _apply_stage(Stage.SECOND_JVP, operator, [*x, *given, *linear[1]])
    return _apply_stage(Stage.SECOND_VJP, operator, [*x, *linear[0], *given])


def _forward(stage: Stage, operator: Operator, arguments: Sequence[Tensor], changes: Sequence[Tensor | None]) -> tuple[Tensor, ...]:
    """The change of a stage along changes of its arguments."""
    x, *linear = operator.split(stage, arguments)
    dx, *others = operator.split(stage, changes)
    parts = []
    if any(d is not None for d in dx):
        if stage not in NEXT:
            raise NotImplementedError(f"{operator.name}: there are no third derivatives of it")
        if stage is not Stage.VALUE:
            operator.require_twice()
        parts.append(_apply_stage(NEXT[stage], operator, [*arguments, *_filled(dx, x)]))
    for i, change in enumerate(others):
        if any(d is not None for d in change):
            given = [*linear[:i], _filled(change, linear[i]), *linear[i + 1 :]]
            parts.append(_apply_stage(stage, operator, [*x, *(each for group in given for each in group)]))
    return tuple(sum(each[1:], each[0]) for each in zip(*parts))


def _mapped(size: int, axes: Sequence[int | None], stage: Stage, operator: Operator, arguments: Sequence[Tensor]) -> tuple[tuple[Tensor, ...], tuple[int, ...]]:
    results, axis = mapped(torch, operator, stage, size, axes, arguments, partial(_apply_stage, stage, operator))
    return tuple(results), (axis,) * len(results)


_LIBRARY = torch.library.Library("ksl", "FRAGMENT")
_LIBRARY.define("compute(Tensor[] arguments, int number, int stage) -> Tensor[]", tags=torch.Tag.pt2_compliant_tag)


def _graph_node(arguments: list[Tensor], number: int, stage: int) -> list[Tensor]:
    return _compute(_operator_of(number), Stage(stage), arguments)


for _key in ("CPU", "CUDA"):
    _LIBRARY.impl("compute", _graph_node, _key)


def _node_shapes(arguments: list[Tensor], number: int, stage: int) -> list[Tensor]:
    groups, states = arguments[0].shape[:2]
    return [arguments[0].new_empty(shape) for shape in _operator_of(number).result_shapes(Stage(stage), groups, states)]


def _node_context(ctx: Any, inputs: tuple[Any, ...], output: Any) -> None:
    arguments, ctx.number, ctx.stage = inputs
    ctx.kept = _BY_NUMBER.get(ctx.number)  # for the backward pass, when the calls that made it may be gone
    ctx.save_for_backward(*arguments)


def _node_backward(ctx: Any, cotangents: list[Tensor]) -> tuple[Any, ...]:
    if ctx.stage != Stage.VALUE:
        raise NotImplementedError(
            "compiled graphs and cards have first derivatives alone; take second ones outside of torch.compile, of tensors on the processor"
        )
    return torch.ops.ksl.compute([*ctx.saved_tensors, *cotangents], ctx.number, int(Stage.VJP)), None, None


torch.library.register_fake("ksl::compute", _node_shapes, lib=_LIBRARY)
torch.library.register_autograd("ksl::compute", _node_backward, setup_context=_node_context, lib=_LIBRARY)
