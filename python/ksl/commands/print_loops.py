"""What `ksl info` prints of the loops of a closed mechanism."""

from __future__ import annotations

from collections.abc import Iterator
from typing import cast

from rich.console import Console
from rich.text import Text

from ksl.commands.app import say
from ksl.load_cases.closed_mechanism import loop_lines, mobility_at_home, redundant_lines
from ksl.mechanism.calls import Calls
from ksl.mechanism.mechanism import Mechanism


def print_loops(model: Mechanism, console: Console) -> None:
    """Loops, freedoms, drives, and which equations follow from others."""
    console.print(Text("\nloops", style="bold"))
    for line in _lines(model):
        say(console, f"  {line}")


def _lines(model: Mechanism) -> Iterator[str]:
    yield from loop_lines(model)
    found, why = mobility_at_home(cast("Calls", model))
    if found is None:
        yield f"not closed: {why}"
    else:
        freedoms = f"{found.mobility} freedom{'' if found.mobility == 1 else 's'}"
        at = "at the closed position nearest to the neutral one"
        yield f"mobility: {freedoms} {at}" if found.mobility else f"mobility: none {at}: the structure is rigid"
        redundant = redundant_lines(model, found)
        if redundant:
            yield f"redundant equations: {', '.join(redundant)}"
            yield "rigid bodies leave components of reactions open; ksl loads marks them"
    yield f"drives: {', '.join(model.drives) or 'none'}" if model.drives is not None else _candidates(model)


def _candidates(model: Mechanism) -> str:
    names = [joint.name for joint in model.joints[: len(model.joint_names)] if joint.kind != "floating"]
    return f"drives: not known; name them with --drives, candidates: {', '.join(names)}"
