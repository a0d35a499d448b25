"""Times that are written as text: dates, clock times, and numbers with their unit."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ksl.base.errors import MotionError
from ksl.mechanism.states import Array

if TYPE_CHECKING:
    import pyarrow as pa

_CLOCK = re.compile(r"(?P<sign>-?)(?P<hours>\d+):(?P<minutes>[0-5]\d)(?::(?P<seconds>[0-5]?\d(?:[.,]\d*)?))?")
_DATE = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d([.,]\d+)?)?(Z|[-+]\d\d:?\d\d)?")
_WITH_UNIT = re.compile(r"[-+\d.,eE]+ ?(s|sec|ms|min|hr)")
DAY = 86_400


def seconds_of_text(texts: pa.ChunkedArray, name: str, place: Callable[[int], str]) -> tuple[Array, str]:
    """Seconds from times as text, since the first sample where they are dates, and what was done.

    Known are ISO dates (2026-03-01 12:00:00.25), clock times (0:01:02.5) and numbers with a unit (0.25 sec, as MATLAB writes
    them).  Raises MotionError with the place of the first text that is none of these.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    if not len(texts):
        return np.zeros(0), "no times"
    column = pc.replace_substring(pc.utf8_trim_whitespace(texts), ",", ".")
    first = str(column[0])
    try:
        if _DATE.fullmatch(first):
            plain = pc.replace_substring(column, "T", " ")
            zoned = bool(re.search(r"(Z|[-+]\d\d:?\d\d)$", first[10:]))
            stamps = plain.cast(pa.timestamp("ns", "UTC" if zoned else None)).cast(pa.int64()).to_numpy()
            return (stamps - stamps[0]) * 1e-9, f"times in column {name!r} are dates; time 0 is {first}"
        if _CLOCK.fullmatch(first):
            seconds, midnight = through_midnight(_of_clock(column))
            return seconds, f"times in column {name!r} are clock times, converted to s{midnight}"
        if found := _WITH_UNIT.fullmatch(first):
            factor = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "min": 60.0, "hr": 3600.0}[found[1]]
            numbers = pc.utf8_trim_whitespace(pc.replace_substring(column, found[1], "")).cast(pa.float64())
            return numbers.to_numpy() * factor, f"times in column {name!r} are in {found[1]}" + (", converted to s" if factor != 1 else "")
    except pa.ArrowInvalid:
        pass
    known = _DATE, _CLOCK, _WITH_UNIT
    kind = next((k for k in known if k.fullmatch(first)), None)
    bad = next((k for k in range(len(column)) if kind is None or not kind.fullmatch(str(column[k]))), 0)
    text = column[bad].as_py()
    raise MotionError(
        f"{place(bad)}: column {name!r} holds {'no time' if text is None else repr(text)}; "
        "expected a number with a decimal point, a clock time (0:01:02.5) or a date (2026-03-01 12:00:00.25)"
    )


def _of_clock(column: pa.ChunkedArray) -> Array:
    """Raises pyarrow.ArrowInvalid where a text is no clock time, or has seconds where others have none."""
    import pyarrow as pa
    import pyarrow.compute as pc

    found: pa.ChunkedArray = pc.extract_regex(column, f"^{_CLOCK.pattern}$")
    sign, *parts = found.flatten()
    without = pc.equal(parts[2], "").to_numpy()
    if found.null_count or without.any() != without.all():
        raise pa.ArrowInvalid("no clock time, or clock times of different forms")
    hours, minutes, seconds = (pc.replace_substring_regex(part, "^$", "0").cast(pa.float64()).to_numpy() for part in parts)
    size: Array = 3600 * hours + 60 * minutes + seconds
    return np.where(pc.equal(sign, "-").to_numpy(), -size, size)


def through_midnight(seconds: Array) -> tuple[Array, str]:
    """Times of a clock, which are those of the next day where they go back by more than half a day; and the end of a note about it."""
    days = np.cumsum(np.diff(seconds, prepend=seconds[:1]) < -DAY / 2)
    if not days.any() or seconds.min() < 0 or seconds.max() >= DAY:  # or no clock shows them
        return seconds, ""
    return seconds + DAY * days, ", and go on through midnight"
