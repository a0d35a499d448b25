"""Words of messages: numbers of things, and lists of names that are cut."""

from __future__ import annotations

from collections.abc import Iterable


def listed(names: Iterable[str], most: int = 12) -> str:
    """Names, separated by commas, and how many more there are."""
    all_names = list(names)
    more = len(all_names) - most
    return ", ".join(all_names[:most]) + (f" and {more:,} more" if more > 0 else "")


def count(n: int, what: str) -> str:
    """`1 sample`, `2 samples`."""
    return f"{n} {what}" if n == 1 else f"{n} {what}s"


def of_cases(lines: Iterable[tuple[str, str]], cases: int) -> list[str]:
    """Each line once, behind the names of the cases that say it, if not all of them do.  lines: (case, line); cases: how many there are."""
    by_line: dict[str, list[str]] = {}
    for name, line in lines:
        by_line.setdefault(line, []).append(name)
    return [line if len(names) == cases else f"{listed(names, 4)}: {line}" for line, names in by_line.items()]
