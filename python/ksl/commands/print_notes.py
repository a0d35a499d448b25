"""What commands print of a robot's file and of a run besides results: doubts, warnings, and content that is not used."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from rich.console import Console

from ksl.base.notes import NoteKind, not_used
from ksl.commands.app import say
from ksl.mechanism.mechanism import Mechanism


def print_notes(console: Console, notes: Iterable[str], printed: Collection[str] = ()) -> None:
    """A line for each note that has not been printed."""
    for line in notes:
        if line not in printed:
            say(console, f"note: {line}")


def print_unused(console: Console, model: Mechanism, drawn: bool = False) -> None:
    """A line for each kind of content of the robot's file that is not used.  drawn: whether its visuals are."""
    print_notes(console, [not_used(content) for content in model.unused if not (drawn and content.kind is NoteKind.VISUALS)])
