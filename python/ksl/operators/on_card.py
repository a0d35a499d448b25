"""What operators of torch and JAX compute on a graphics card, by what `m.compile(…, device="cuda")` made: values, and products with first derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ksl.model.model import code_on_card
from ksl.model.on_card import FunctionOnCard
from ksl.operators.operator import Operator, Stage

DERIVATIVES = {Stage.VALUE: "", Stage.JVP: "jvp", Stage.VJP: "vjp"}
POSITIONS = ("q", "q0", "q1")


@dataclass(frozen=True)
class Words:
    """The words of a library for what is done with its arrays."""

    arrays: str
    move: str
    """How they come to the processor."""


def require_compiled(operator: Operator, stage: Stage, scalar: str, words: Words) -> FunctionOnCard:
    """The function of a stage.  Raises ValueError or NotImplementedError that says what to compile."""
    key = (stage, scalar)
    if key not in operator.programs:
        operator.programs[key] = _function(operator, stage, scalar, words)
    found: FunctionOnCard = operator.programs[key]
    return found


def _function(operator: Operator, stage: Stage, scalar: str, words: Words) -> FunctionOnCard:
    name, row, more = operator.name, operator.row.value, operator.more
    if stage not in DERIVATIVES:
        raise NotImplementedError(f"{name}: there are no second derivatives on a card; move the {words.arrays} {words.move}")
    if more.given or (more.in_world and operator.external):
        said = "wrenches in the world's axes" if more.in_world else "mechanisms that are closed by it"
        raise NotImplementedError(f"{name}: it isn't computed on a card with {said}; move the {words.arrays} {words.move}")
    derivative = DERIVATIVES[stage]
    if derivative and operator.closed:
        raise NotImplementedError(f"{name}: there are no derivatives on a card along mechanisms with loops; move the {words.arrays} {words.move}")
    if derivative and operator.row.lift == "position" and operator.placed:
        raise NotImplementedError(f"{name}: there are no derivatives of it on a card for robots whose q has quaternions; move the {words.arrays} {words.move}")
    for function in code_on_card(operator.model).functions:
        own = function.row, function.derivative, function.scalar, function.external, function.parameters
        if own == (row, derivative, scalar, more.external, operator.links) and function.request is operator.request:
            return function
    asked = f"{derivative}.{row}" if derivative else row
    more_said = ", scalar='float'" * (scalar == "float") + f", external={list(more.external)}" * bool(more.external)
    more_said += f", parameters={list(more.links) if more.links else 'm.link_names'}" * operator.parameters
    of = (
        ""
        if operator.request is None
        else ", with the links or joints that the call names behind a colon (again where it has been asked for: a model remembers 64 ways to ask),"
    )
    raise ValueError(
        f"{name}: {words.arrays} are on a card, and code for it is missing: m.compile([…, '{asked}'], device='cuda'{more_said}){of} makes it; or move the {words.arrays} {words.move}"
    )


def rows_of_states(library: Any, x: Any, states: int) -> Any:
    """Parameters (groups, links, 10) as kernels take them: (groups, states, 10 links), or one row where there is one group.  library: torch or jax.numpy."""
    row = x.reshape(x.shape[0], 1, x.shape[1] * 10)
    return row if x.shape[0] == 1 or states == 1 else library.broadcast_to(row, (x.shape[0], states, row.shape[-1]))
