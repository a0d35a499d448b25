"""How work grows with the size of an input: counted, never timed, so that a test says the same on every machine.

`assert_linear` takes any count.  `work` counts lines and calls of Python.  A `Name` makes searches count that Python's own lists and
dictionaries do.  regex_steps.py counts what a pattern tries.  Times are measured by bench/growth.py."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

TIMES = 4
"""How many times as large the second input is."""
MOST = 1.25
"""Work for it, over its share.  Quadratic work is 4 times its share; sorting adds a fifth at most."""


def assert_linear(count: Callable[[int], int], n: int) -> None:
    """Fails unless count(4 n) is about 4 count(n) or less.  count(n) is called once before: imports and caches are no part of the work."""
    count(n)
    few, many = count(n), count(TIMES * n)
    assert few > 0 and many <= MOST * TIMES * few, f"{few:,} for {n:,}, and {many:,} for {TIMES * n:,}: {many / max(few, 1):.1f} times as many for {TIMES} times as much"


def work(run: Callable[[], object]) -> int:
    """Lines of Python that run() executes, each time that it does, and calls of functions, those written in C included."""
    count = 0

    def line(frame: FrameType, event: str, arg: Any) -> Any:
        nonlocal count
        count += event == "line"
        return line

    def call(frame: FrameType, event: str, arg: Any) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    before = sys.gettrace(), sys.getprofile()
    sys.settrace(line)
    sys.setprofile(call)
    try:
        run()
    finally:
        sys.settrace(before[0])
        sys.setprofile(before[1])
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
