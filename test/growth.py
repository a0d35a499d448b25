"""How work grows with the size of an input: counted, never timed, so that a test says the same on every machine.

`assert_linear` takes any count.  `work` counts lines and calls of Python.  A `Name` makes searches count that Python's own lists and
dictionaries do.  regex_steps.py counts what a pattern tries.  Times are measured by bench/growth.py."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

MOST = 0.15
"""The part of the work that may grow with the square.  Sorting makes up to 0.1 of it."""


def assert_linear(count: Callable[[int], int], n: int) -> None:
    """Fails where count(n), count(2 n) and count(4 n) grow faster than a + b n.

    For a + b n + c n² it finds the part c (4 n)² of count(4 n).  count(n) is called once before: imports are no part of the work."""
    count(n)
    one, two, four = (count(k * n) for k in (1, 2, 4))
    square = 16 / 6 * (four - 3 * two + 2 * one)
    assert 0 < one and (square <= MOST * four or four <= one), (
        f"{one:,}, {two:,} and {four:,} for {n:,}, {2 * n:,} and {4 * n:,}: {square / four:.2f} of it grows with the square"
    )


def work(run: Callable[[], object]) -> int:
    """Lines of Python that run() executes, each time that it does, and calls of functions, those written in C included.

    Garbage isn't collected meanwhile: what other modules do then would be counted where it happens to come."""
    count = 0

    def line(frame: FrameType, event: str, arg: Any) -> Any:
        nonlocal count
        count += event == "line"
        return line

    def call(frame: FrameType, event: str, arg: Any) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    before = sys.gettrace(), sys.getprofile(), gc.isenabled()
    gc.disable()
    sys.settrace(line)
    sys.setprofile(call)
    try:
        run()
    finally:
        sys.settrace(before[0])
        sys.setprofile(before[1])
        if before[2]:
            gc.enable()
    return count


class Name(str):
    """A text whose comparisons are calls of Python, which `work` counts: `name in names` is one line, however many names it looks at."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        return str.__eq__(self, other)

    def __ne__(self, other: object) -> bool:
        return str.__ne__(self, other)

    def __hash__(self) -> int:
        return str.__hash__(self)
