"""`m.compile(…, device="cuda")`: calls of a model by kernels that are compiled for it alone."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Literal

from ksl.base.errors import ArgumentError
from ksl.generation.arguments import Arguments
from ksl.generation.card.calls import CardCall
from ksl.generation.card.driver import Driver, system_driver
from ksl.generation.card.functions import CardFunction, Code
from ksl.generation.card.runs import SimulateCall
from ksl.generation.cuda.device import definitions, device_functions
from ksl.generation.cuda.kernels import PREFIX, Kernel, kernels, kernels_text, signatures
from ksl.generation.cuda.simulation import METHODS, motion_of, simulated, simulation
from ksl.generation.fmus.fmu_variables import moving_joints
from ksl.generation.requests import functions_of, refuse_unwritten
from ksl.model.model import code_on_card, with_card
from ksl.model.on_card import CodeOnCard

if TYPE_CHECKING:
    from ksl.model.model import Model

RUNS = "simulate"
"""The word for runs of many steps."""


def compiled_for_card(model: Model, algorithms: Sequence[str], scalar: Literal["double", "float"], arguments: Arguments, device: str) -> Model:
    """See `ksl.Model.compile`; arguments: links with wrenches, and those whose parameters are given.  The kernels are loaded on this card at once, on others when they are first called there."""
    driver = system_driver()
    card = _card(device, driver)
    text, made = _kernels(model, [asked.strip() for asked in algorithms], scalar, arguments)
    code = Code(text, driver)
    functions = [CardFunction(asked.strip(), kernel, code) for asked, kernel in zip(algorithms, made, strict=True)]
    for function in functions:
        function.on(card)
    return with_card(model, CodeOnCard((*code_on_card(model).functions, *functions), _call))


def _kernels(model: Model, algorithms: Sequence[str], scalar: Literal["double", "float"], arguments: Arguments) -> tuple[str, list[Kernel]]:
    """The text of all kernels, of rows and of runs, and what the kernel of each algorithm takes."""
    methods = {asked: _method(asked) for asked in algorithms if asked.partition(":")[0] == RUNS}
    if not methods:
        return kernels(model, algorithms, scalar, arguments)
    if arguments.external:
        raise ArgumentError(f"algorithms: {RUNS} has no external wrenches on a card; compile it apart")
    rows = [asked for asked in algorithms if asked not in methods]
    flat = all(joint.one_coordinate for joint in moving_joints(model))
    calls = [row for row in ("forward_dynamics", "integrate") if row not in rows and not (flat and row == "integrate")]
    functions = functions_of(model, rows + calls, arguments, scalar == "float", "least-norm")
    own, motion = functions[: len(rows)], motion_of(model, functions)
    assert motion is not None
    refuse_unwritten(own, "has no kernel; the whole matrix has one")
    of = dict(zip(rows, signatures(own, PREFIX, scalar, ("rows",)))) | {asked: simulated(motion, scalar, method) for asked, method in methods.items()}
    if len(of) < len(algorithms) or len(set(methods.values())) < len(methods):
        raise ArgumentError(f"algorithms: {RUNS} comes twice")
    parts = [
        definitions(functions, PREFIX, scalar),
        device_functions(functions, PREFIX),
        kernels_text(own, PREFIX, scalar, ("rows",)),
        simulation(motion, PREFIX, scalar, tuple(methods.values())),
    ]
    return "\n".join(parts), [of[asked] for asked in algorithms]


def _method(asked: str) -> str:
    """The method of runs that is asked for.  Raises ArgumentError for one that kernels don't have."""
    method = asked.partition(":")[2] or METHODS[0]
    if method not in METHODS:
        raise ArgumentError(f"algorithms: {asked}: runs on a card go by {' or '.join(METHODS)}: {RUNS}, or {RUNS}:{METHODS[1]}")
    return method


def _call(model: Model, row: str, functions: Sequence[CardFunction]) -> Callable[..., Any]:
    return SimulateCall(model, row, functions) if row == RUNS else CardCall(model, row, functions)


def _card(device: str, driver: Driver) -> int:
    """The number of a card: that of torch where none is named, if torch uses one already."""
    found = re.fullmatch(r"cuda(?::(\d{1,4}))?", device) if isinstance(device, str) else None
    if found is None:
        raise ArgumentError(f"device={device!r}: expected cpu, cuda, or a card by its number, cuda:1")
    if found[1] is None:
        torch = sys.modules.get("torch")
        return int(torch.cuda.current_device()) if torch is not None and torch.cuda.is_initialized() else 0
    if (card := int(found[1])) >= driver.cards:
        raise ArgumentError(f"device={device!r}: there {'is one card, cuda:0' if driver.cards == 1 else f'are cards cuda:0 to cuda:{driver.cards - 1}'}")
    return card
