"""What a model has of code for graphics cards.  `ksl.generation.card` makes it, and operators of torch and JAX call it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol


class FunctionOnCard(Protocol):
    """A compiled function (`ksl.generation.card.functions.CardFunction`)."""

    asked: str
    """The word of `Model.compile` for it."""
    row: str
    derivative: str
    """"", or "jvp" or "vjp" of the row."""
    request: Any
    external: tuple[str, ...]
    parameters: tuple[str, ...]
    """Links whose inertial parameters are an input, ten numbers each."""
    scalar: str
    inputs: tuple[tuple[str, int], ...]
    """Names, and how many numbers a state has of each."""
    results: tuple[tuple[str, tuple[int, ...]], ...]
    """Names, and their shapes for one state."""

    @property
    def for_programs(self) -> Any:
        """What programs of JAX name by its `number`."""

    def launch(self, card: int, stream: int, states: int, rows: Sequence[int]) -> None:
        """Starts it on a stream of a card.  rows: a pointer and a stride for each input, and then for each result."""


@dataclass(frozen=True)
class CodeOnCard:
    """All of a model's functions, and what makes a model's call of those of a row: call_of(model, row, functions)."""

    functions: tuple[FunctionOnCard, ...] = ()
    call_of: Callable[[Any, str, Sequence[Any]], Callable[..., Any]] | None = None

    @property
    def rows(self) -> tuple[str, ...]:
        """The calls that take arrays on a card, too."""
        return tuple(dict.fromkeys(function.row for function in self.functions if not function.derivative))

    def calls(self, model: Any) -> dict[str, Callable[..., Any]]:
        """These, of a model."""
        if self.call_of is None:
            return {}
        return {row: self.call_of(model, row, [f for f in self.functions if f.row == row and not f.derivative]) for row in self.rows}


NO_CODE = CodeOnCard()
