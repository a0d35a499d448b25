"""What lists and trees of pages call things whose names come from files."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from ksl.base.printable import one_line

LONGEST = 60
"""Longer names are cut in the middle."""


def labels(names: Iterable[str], what: str, taken: Collection[str] = ()) -> list[str]:
    """A text for each name: the name itself where a reader can tell it from the others, in the order given.

    what: link or joint, which stands before names that are `taken` by words of ours.  Names that are equal as they are shown get a number: a list with
    two equal entries makes a page of viser stay blank.  O(names).
    """
    used = set(taken)
    counts: dict[str, int] = {}
    found = []
    for name in names:
        line = one_line(name)
        line = line if len(line) <= LONGEST else f"{line[: LONGEST - 16]}…{line[-15:]}"
        text = line if line.strip() else f"{what} without a name"
        text = f"{what} {text}" if text in taken else text
        shown = text
        while shown in used:
            counts[text] = counts.get(text, 1) + 1
            shown = f"{text} ({counts[text]})"
        used.add(shown)
        found.append(shown)
    return found
