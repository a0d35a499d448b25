"""A comparison with other libraries as text."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from ksl.commands.app import say
from ksl.commands.print_info import table_lines
from ksl.comparison.results import Comparison, Note, OneLibrary

STYLES = ("bold green", "bold yellow", "bold red")
"""Styles of the three values of a status."""
SAID = 3
"""Warnings of a library that are printed."""


def print_comparison(found: Comparison, out: Console, asked: bool) -> None:
    """Everything of a comparison.  asked: whether the libraries were named, and those that are missing belong to the answer."""
    states = "1 random state" if found.states == 1 else f"{found.states} random states"
    say(out, f"{found.robot} ({found.file}): {found.coordinates} coordinates, {states}, seed {found.seed}")
    for library in found.libraries:
        out.print()
        _print_library(library, out)
    if found.missing:
        out.print()
    for name, command in found.missing.items():
        say(out, Text(f"{name}: not installed; {command}", style=STYLES[2] if asked or not found.libraries else "dim"))


def _print_library(library: OneLibrary, out: Console) -> None:
    say(out, Text(f"{library.name} {library.version}".rstrip() + f": {verdict(library)}", style=STYLES[library.status]))
    if library.quantities:
        rows = [(q.name, f"{q.difference:.2g} {q.unit}".rstrip(), f"{q.relative:.1e}", "agree" if q.agrees else "differ", q.where) for q in library.quantities]
        out.out(
            "\n".join(f"  {line}" for line in table_lines([["quantity", "largest difference", "share", "numbers", "where"]], rows, out.width - 2)),
            highlight=False,
        )
    for title, notes in (("why they differ", library.reasons), ("converted, or left out on one side", library.conventions)):
        if notes:
            out.print(f"  {title}:")
        for note in notes:
            say(out, f"    {_line(note)}")
    for line in library.not_compared:
        say(out, f"  not compared: {line}")
    for line in library.said[:SAID]:
        say(out, f"  {library.name} says: {line}")
    if len(library.said) > SAID:
        say(out, f"  {library.name} says {len(library.said) - SAID} lines more; --json has them")


def verdict(library: OneLibrary) -> str:
    """One sentence about one library."""
    if library.failed:
        return f"not compared: {library.failed}"
    if not library.differing:
        return "all numbers agree"
    unknown = f"; not explained: {', '.join(library.unexplained)}" if library.unexplained else ", and each difference is explained"
    return f"{', '.join(library.differing)} differ{unknown}"


def _line(note: Note) -> str:
    of = f" ({', '.join(note.explains)})" if note.explains else ""
    return f"{note.topic}{of}: {note.text}"
