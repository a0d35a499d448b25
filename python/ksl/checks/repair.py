"""Repairs of XML trees, of which findings are given one each, and the words that rules share."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from ksl.checks.findings import Repair
from ksl.errors import close_names

if TYPE_CHECKING:
    from lxml.etree import _Element


def digits(x: float) -> str:
    """A number as it is written into a file: 12 digits, without zeros at the end."""
    return f"{x:.12g}"


def shown(x: float) -> str:
    """A number as it is told to a reader."""
    return f"{x:.4g}"


def set_attribute(element: _Element | None, name: str, value: str) -> Repair | None:
    """The repair that gives an attribute this value."""
    if element is None:
        return None

    def change() -> str:
        old = element.get(name)
        element.set(name, value)
        return f'<{element.tag}> {name}: "{old}" is now "{value}"'

    return change


def remove(element: _Element) -> None:
    """Takes an element out of the tree, with the white space before it, so that no empty line stays."""
    parent, before = element.getparent(), element.getprevious()
    if before is not None:
        before.tail = element.tail
    else:
        parent.text = element.tail
    element.tail = None
    parent.remove(element)


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name that was likely meant: the same in other capitals, or one that differs by a few letters.  None
    if there is none."""
    names = list(known)
    folded = {each.strip().lower(): each for each in names}
    if name.strip().lower() in folded:
        return folded[name.strip().lower()]
    near = close_names(name, names, 1, 0.7)
    return near[0] if near else None


def suggest(name: str, known: Iterable[str]) -> str | None:
    """ "Did you mean hand?", or None where nothing is near."""
    near = nearest(name, known)
    return f"Did you mean {near}?" if near else None


MISSPELT = 50
"""Unknown names of a file that are compared with all known ones.  Where there are more, the cause is not that each is misspelt."""


class Names:
    """The known names of a file, in which unknown ones are looked up.  O(names) for each of the first `MISSPELT`, then O(1)."""

    def __init__(self, known: Iterable[str]) -> None:
        self._known = list(known)
        self._folded: dict[str, list[str]] = {}
        for name in self._known:
            self._folded.setdefault(name.strip().lower(), []).append(name)
        self._left = MISSPELT

    def same(self, name: str) -> list[str]:
        """Known names that differ from this one only by capitals, or by spaces at their ends."""
        return self._folded.get(name.strip().lower(), [])

    def suggest(self, name: str) -> str | None:
        """ "Did you mean hand?", or None where nothing is near."""
        if self.same(name):
            return f"Did you mean {self.same(name)[-1]}?"
        self._left -= 1
        return suggest(name, self._known) if self._left >= 0 else None
