"""Whole numbers of fixed width, as controllers log them: signed ones that were logged without sign, and counters that wrap.

A number of b bits is known up to multiples of 2^b.  Values that jump by about as much from one sample to the next are continued past the jump.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ksl.mechanism.states import Array

SIGNED = (16, 32)
"""Bits of the signed numbers of CiA 402 and of most programs."""
COUNTERS = (10, 32)
"""Bits of the shortest and longest encoders and counters."""
NEAR = 16
"""Signed numbers logged without sign change by less than a 1/NEAR of their range from sample to sample, and small negative ones are in the last 1/NEAR of it."""
USUAL = 4.0
"""A counter that wraps goes on by at most so many times its largest other step, which is less than its range by such a factor."""
MOST = 2.0**53
"""Whole numbers up to here are exact as doubles."""


class Read(NamedTuple):
    """Numbers of a column as they are meant, a note on what was done, and what is doubtful; both texts are empty where nothing is."""

    numbers: Array
    note: str = ""
    doubt: str = ""


def continued_times(name: str, x: Array) -> Read:
    """Times of a clock that wraps, at 2^16 or 2^32 of its unit: differences alone count, so that they may be counted from the first sample."""
    if not _are_whole(x):
        return Read(x)
    steps = np.diff(x)
    for bits in SIGNED:
        wraps = steps < -(2.0 ** (bits - 1))
        if not wraps.any() or wraps.all():
            continue
        usual = float(np.median(steps[~wraps]))
        onward = steps[wraps] + 2.0**bits
        if usual > 0 and np.mean(steps[~wraps] >= 0) > 0.9 and (onward > 0).all() and (onward <= 10 * usual).all():
            note = f"times in column {name!r} wrap at 2^{bits}{_often(int(wraps.sum()))}, and are continued past it"
            return Read(_continued(x, np.where(wraps, 1, 0), bits), note)
    return Read(x)


def continued_positions(name: str, x: Array, possible: Callable[[Array], bool] | None) -> Read:
    """Positions of a counter that wraps, or of signed numbers that were logged without sign.

    possible: whether the joint can be at positions that such numbers mean; None where it has no limits.  It says which multiple of 2^b is meant.
    """
    if not _are_whole(x):
        return Read(x)
    bits = max(math.ceil(math.log2(np.ptp(x) + 1)), COUNTERS[0])
    steps = np.diff(x)
    turns = -np.round(steps / 2.0**bits)
    wraps = turns != 0
    inside = (x.min() >= 0 and x.max() < 2.0**bits) or (x.min() >= -(2.0 ** (bits - 1)) and x.max() < 2.0 ** (bits - 1))
    if bits > COUNTERS[1] or not inside or not wraps.any() or wraps.all():
        return _without_sign(name, x, possible)
    usual, onward = float(np.abs(steps[~wraps]).max()), np.abs(steps + turns * 2.0**bits)[wraps]
    if usual >= 2.0**bits / USUAL or (onward > max(USUAL * usual, 2.0**bits / 256)).any():
        return Read(x)
    read = _continued(x, turns, bits)
    if bits in SIGNED:
        read = read - 2.0**bits * np.round(np.median(read) / 2.0**bits)  # signed numbers, unless the joint can't be there
    read, moved = _within(read, bits, possible)
    what = f"{name!r} wraps at 2^{bits}{_often(int(wraps.sum()))}, and is continued past it: it is taken to go from {read[0]:.0f}, logged as {x[0]:.0f}"
    return Read(read, f"{what}, to {read[-1]:.0f}" + moved)


def with_sign(name: str, x: Array, always: bool = False) -> Read:
    """Numbers that are no positions: signed where they were logged without sign.

    always: the column is one of signed numbers, whatever its values are, as efforts of CiA 402 in ‰ are.
    """
    if not _are_whole(x):
        return Read(x)
    for bits in SIGNED:
        half = 2.0 ** (bits - 1)
        if x.min() < 0 or not half <= x.max() < 2 * half:
            continue
        read = np.where(x >= half, x - 2 * half, x)
        crosses = len(x) > 1 and np.abs(np.diff(x)).max() > half and np.abs(np.diff(read)).max() < 2 * half / NEAR
        if always or crosses:
            return Read(read, f"{name!r} holds signed numbers of {bits} bits that were logged without sign: {x.max():.0f} is taken as {x.max() - 2 * half:.0f}")
        if x.min() >= 2 * half * (1 - 1 / NEAR):
            return Read(x, doubt=_doubt(name, x, bits))
        break
    return Read(x)


def _without_sign(name: str, x: Array, possible: Callable[[Array], bool] | None) -> Read:
    """Positions that are all negative, and were logged without sign."""
    for bits in SIGNED:
        if x.min() < 2.0 ** (bits - 1) or x.max() >= 2.0**bits:
            continue
        if possible is None:
            return Read(x, doubt=_doubt(name, x, bits)) if x.min() >= 2.0**bits * (1 - 1 / NEAR) else Read(x)
        read, moved = _within(x, bits, possible)
        return Read(read, f"{name!r} holds signed numbers of {bits} bits that were logged without sign{moved}") if moved else Read(x)
    return Read(x)


def _are_whole(x: Array) -> bool:
    return len(x) > 0 and bool(np.isfinite(x).all()) and float(np.abs(x).max()) < MOST and bool((x == np.round(x)).all())


def _continued(x: Array, turns: Array, bits: int) -> Array:
    return np.asarray(x + 2.0**bits * np.concatenate([[0.0], np.cumsum(turns)]))


def _within(x: Array, bits: int, possible: Callable[[Array], bool] | None) -> tuple[Array, str]:
    """The numbers less a multiple of 2^bits by which the joint can be there, if one alone does it, and what was done."""
    if possible is None or possible(x):
        return x, ""
    able = [k for k in (-1, 1) if possible(x + k * 2.0**bits)]
    if len(able) != 1:
        return x, ""
    return x + able[0] * 2.0**bits, f": the joint's limits allow {x[0] + able[0] * 2.0**bits:.0f}, and not {x[0]:.0f}"


def _often(times: int) -> str:
    return "" if times == 1 else f" ({times} times)"


def _doubt(name: str, x: Array, bits: int) -> str:
    return (
        f"{name!r} holds whole numbers from {x.min():.0f} to {x.max():.0f}, a little less than 2^{bits}: negative numbers that were logged without sign?  "
        f"Then subtract {2**bits} by a map (offset, in the unit of the result)"
    )
