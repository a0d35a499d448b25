"""Processor time as a usual machine would take it: measured beside a piece of work that is always the same.

A machine may be several times as slow as another one, and as itself an hour ago.  Bounds of time hold on all of them that way; what grows with the
square takes a hundred times as long."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

Result = TypeVar("Result")

USUAL = 0.0057
"""Seconds that `_reference` takes on the machines for which bounds are given."""
TRIES = 3


def takes_less_than(bound: float, work: Callable[[], object]) -> bool:
    """Does work() take less than `bound` seconds on a usual machine?  It is tried again where it took longer, since other programs disturb it."""
    return any(usual_seconds(work) < bound for _ in range(TRIES))


def usual_seconds(work: Callable[[], object]) -> float:
    """Seconds that work() takes on a usual machine."""
    return timed(work)[0]


def timed(work: Callable[[], Result]) -> tuple[float, Result]:
    """The same, and the result of work()."""
    before = _measured(_reference)[0]
    seconds, result = _measured(work)
    slowness = max(before, _measured(_reference)[0]) / USUAL
    return seconds / max(1.0, slowness), result


def _measured(work: Callable[[], Result]) -> tuple[float, Result]:
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


def _reference() -> None:
    total = 0
    for i in range(100_000):
        total += i * i
