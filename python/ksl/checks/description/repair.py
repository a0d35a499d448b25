"""Repairs of XML trees, of which findings are given one each, and the words that rules share."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from ksl.base.errors import close_names
from ksl.checks.description.findings import Repair

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
    same = _same(name, names)
    if same is not None:
        return same
    near = close_names(name, names, 1, 0.7)
    return near[0] if near else None


def _same(name: str, known: Iterable[str]) -> str | None:
    """The known name that differs only by capitals, or by spaces at the ends; the last one of several."""
    return {each.strip().lower(): each for each in known}.get(name.strip().lower())


def suggest(name: str, known: Iterable[str]) -> str | None:
    """ "Did you mean hand?", or None where nothing is near."""
    near = nearest(name, known)
    return f"Did you mean {near}?" if near else None


MISSPELT = 50
"""Unknown names of a file that are compared with all known ones.  Where there are more, the cause is not that each is misspelt."""


class Strangers:
    """Unknown elements, attributes or types in a file, and the known ones that were likely meant.  O(1) for each place where one stands: each is
    compared once with the same known names, and after the first `MISSPELT` only without regard to capitals."""

    def __init__(self) -> None:
        self._compared: set[str] = set()
        self._meant: dict[tuple[str, tuple[str, ...]], str | None] = {}

    def meant(self, name: str, known: tuple[str, ...]) -> str | None:
        """As :func:`nearest` finds it."""
        key = name, known
        if key not in self._meant:
            if len(self._compared) < MISSPELT:
                self._compared.add(name)
            self._meant[key] = nearest(name, known) if name in self._compared else _same(name, known)
        return self._meant[key]


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
