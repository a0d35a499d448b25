"""Times that are written as text: dates, clock times, and numbers with their unit."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ksl.base.errors import MotionError
from ksl.model.states import Array

if TYPE_CHECKING:
    import pyarrow as pa

_CLOCK = re.compile(r"-?(\d+):(\d\d)(?::(\d\d?(?:[.,]\d*)?))?")
_DATE = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d([.,]\d+)?)?(Z|[-+]\d\d:?\d\d)?")
_WITH_UNIT = re.compile(r"[-+\d.,eE]+ ?(s|sec|ms|min|hr)")


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
            return _of_clock(column), f"times in column {name!r} are clock times, converted to s"
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
    import pyarrow as pa
    import pyarrow.compute as pc

    parts = pc.split_pattern(column, ":")
    lengths = np.unique(pc.list_value_length(parts).to_numpy())
    if len(lengths) != 1:
        raise pa.ArrowInvalid("clock times of different forms")
    seconds = np.zeros(len(column))
    for i, weight in zip(range(int(lengths[0])), (3600.0, 60.0, 1.0)):
        seconds += weight * pc.list_element(parts, i).cast(pa.float64()).to_numpy()
    return seconds
