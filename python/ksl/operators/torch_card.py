"""Stages of operators for tensors on a graphics card, by what `m.compile(…, device="cuda")` made: values, and products with first derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod

import torch
from torch import Tensor

from ksl.model.on_card import FunctionOnCard
from ksl.operators import on_card
from ksl.operators.on_card import POSITIONS, Words
from ksl.operators.operator import Operator, Stage
from ksl.operators.placed_joints import as_numbers, as_velocity

WORDS = Words("tensors", "by .cpu()")


def card_of(x: Tensor) -> int | None:
    """The card that a tensor is on."""
    return x.get_device() if x.is_cuda else None


def stream_of(card: int) -> int:
    """The stream that torch works on now, as the driver has it."""
    return int(torch.cuda.current_stream(card).cuda_stream)


def require_compiled(operator: Operator, stage: Stage, scalar: torch.dtype) -> FunctionOnCard:
    """The function of a stage.  Raises ValueError or NotImplementedError that says what to compile."""
    return on_card.require_compiled(operator, stage, "float" if scalar is torch.float32 else "double", WORDS)


def compute_on_card(operator: Operator, stage: Stage, arguments: Sequence[Tensor], card: int) -> list[Tensor]:
    """The results of a stage; its arguments are contiguous, and quaternions have unit length."""
    function = require_compiled(operator, stage, arguments[0].dtype)
    x, *linear = operator.split(stage, arguments)
    joints = operator.placed
    given = dict(zip(operator.inputs, x))
    result = operator.row.result
    if stage is Stage.JVP:
        rates = [as_velocity(torch, joints, q, dq) if joints and name in POSITIONS else dq for name, q, dq in zip(operator.inputs, x, linear[0])]
        given |= {f"{name}_dot": dx for name, dx in zip(operator.inputs, rates)}
    if stage is Stage.VJP:
        weights = [name for name, _ in function.inputs if name.endswith("_bar")]
        given[weights[result]] = linear[0][0]
    groups, states = x[0].shape[:2]
    given |= {name: on_card.rows_of_states(torch, given[name], states) for name in ("parameters", "parameters_dot") if name in given}
    wanted = [f"{name}_bar" for name in operator.inputs] if stage is Stage.VJP else [function.results[result][0]]
    made = {name: x[0].new_empty((groups, states, prod(shape))) for name, shape in function.results}
    rows: list[int] = []
    kept = []
    for name, numbers in function.inputs:
        tensor = given[name].contiguous() if name in given else x[0].new_zeros(numbers)
        kept.append(tensor)
        rows += (tensor.data_ptr(), numbers if tensor.numel() == groups * states * numbers else 0)
    for name, shape in function.results:
        rows += (made[name].data_ptr(), prod(shape))
    function.launch(card, stream_of(card), groups * states, rows)
    found = [made.get(name) for name in wanted]
    if stage is Stage.VJP and operator.parameters and (by := found[-1]) is not None:
        found[-1] = by.reshape(groups, states, len(operator.links), 10).sum(1)
    whole = [x[k].new_zeros(x[k].shape) if y is None else y for k, y in enumerate(found)]
    if stage is Stage.VJP and joints:
        whole = [as_numbers(torch, joints, q, y) if name in POSITIONS else y for name, q, y in zip(operator.inputs, x, whole)]
    return whole
