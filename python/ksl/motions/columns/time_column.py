"""Which column holds the times, and in which unit."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Set
from dataclasses import dataclass, replace

import numpy as np

from ksl.base.errors import MotionError
from ksl.base.notes import NoteKind, Note, not_of_kind
from ksl.base.words import listed
from ksl.mechanism.states import Array
from ksl.motions.columns.recorded import Recorded
from ksl.motions.columns.units import bare, factor, unit_of
from ksl.motions.columns.whole_numbers import continued_times
from ksl.motions.columns.even_times import even_again, spacing_of

TIME = "time"
_NAMES = re.compile(
    r"(?:t|time|times|timestamp|timestamps|time[ _]?stamp|elapsed|elapsed[ _]?time|zeit|temps|tiempo|tempo|seconds|secs?|__time)"
    r"(?:[ _]?[\[(]?(s|sec|secs|seconds|ms|us|µs|ns)[\])]?|[ _]?[\[(](min|h)[\])])?",
    re.IGNORECASE,
)
_SECONDS = re.compile(r"((?:.*[._/ ])?)(?:sec|secs|seconds)")
_NANOSECONDS = ("nanosec", "nanosecs", "nsec", "nsecs", "nanoseconds")
_DATES = (9.4e8, 4.2e9)
"""s since 1970, of the years 2000 to 2100: times in this range are dates."""


@dataclass(frozen=True)
class TimeColumn:
    name: str
    unit: str
    """The unit as the file says it; empty where it says nothing."""
    scale: float = 1.0
    """The scale that a map gives; the result is in the unit."""
    nanoseconds: str = ""
    """The column that holds what is less than a second, as stamps of ROS have it."""


def find_time(table: Recorded, of_joints: Set[str]) -> TimeColumn:
    """The column `time`; or else the only ones that are seconds and nanoseconds of a stamp, or the only one that is called t, Time,
    timestamp, or so.  Raises MotionError.

    of_joints: columns that joints have, which are not times even if a joint is called t.
    """
    if TIME in table.names:
        return TimeColumn(TIME, table.units.get(TIME, ""))
    stamps = [(n, m[1] + e) for n in table.names if (m := _SECONDS.fullmatch(n)) for e in _NANOSECONDS if m[1] + e in table.names]
    stamps = [pair for pair in stamps if not of_joints & set(pair)]
    if len(stamps) == 1:
        return TimeColumn(stamps[0][0], "s", nanoseconds=stamps[0][1])
    found = {n: m for n in table.names if n not in of_joints and (m := _NAMES.fullmatch(n.strip().lstrip("%#").strip()))}
    if not found:
        raise MotionError(f"{table.head}: no column `time`; found {listed(table.names)}")
    if len(found) > 1:
        raise MotionError(
            f"{table.head}: columns {' and '.join(map(repr, found))} could all be the time; rename one to `time`, or say which by a map "
            f'(--map FILE with the line {next(iter(found))!r} = "time") and leave out the others (--ignore-extra)'
        )
    name, match = next(iter(found.items()))
    return TimeColumn(name, table.units.get(name) or match[1] or match[2] or "")


def with_unit(table: Recorded, column: TimeColumn, wished: str | None) -> TimeColumn:
    """The column with the unit that the user says, where the file says none.  Raises MotionError if both do, and differ."""
    if table.times_are_seconds:
        return replace(column, unit="s", scale=1.0)
    if wished is None:
        return column
    unit = unit_of(wished)
    if unit is None or unit.quantity != "time":
        raise MotionError(f"{table.file}: --time-unit (time_unit=) is {wished!r}; expected s, ms, us, ns or min")
    if table.is_recording:
        raise MotionError(f"{table.file}: --time-unit (time_unit=) is {wished!r}, but the stamps of a bag have a unit; leave it out")
    if column.unit and unit_of(column.unit) != unit:
        both = f"is in {bare(column.unit)}, but --time-unit (time_unit=) is {wished!r}"
        raise MotionError(f"{table.head}: column {column.name!r} {both}; leave it out, or mend the file")
    return replace(column, unit=wished)


def with_nanoseconds(table: Recorded, column: TimeColumn, values: Mapping[str, Array]) -> Array:
    """Times in s of two columns.  Dates are counted from the second of the first sample, so that no digit is lost."""
    seconds, nanoseconds = values[column.name], values[column.nanoseconds]
    start = next((float(x) for x in seconds[:1] if _DATES[0] <= x < _DATES[1]), 0.0)
    if start:
        table.notes.append(f"times are s since 1970; time 0 is {np.datetime64(round(start * 1000), 'ms')} UTC")
    return (seconds - start) + nanoseconds * 1e-9


def in_seconds(table: Recorded, column: TimeColumn, time: Array) -> tuple[Array, list[str]]:
    """Times in s, and what was done to them: their unit was converted, or dates were counted from the first sample."""
    both = f"columns {column.name!r} and {column.nanoseconds!r} are taken as seconds and nanoseconds of the time"
    time, wrapped, _ = continued_times(column.name, time)
    spacing = spacing_of(time)
    notes: list[str] = [] if column.name == TIME else [both] if column.nanoseconds else [_taken_as_time(column)]
    scale = column.scale * (factor(table.head, column.name, column.unit, "time", 0) if column.unit else 1.0)
    if scale != 1.0:
        converted = Note(NoteKind.TIME_UNIT, f"times were converted from {bare(column.unit)} to s")
        notes.append(f"times were multiplied by {scale:g}" if column.scale != 1.0 else converted)
    notes += [wrapped] * bool(wrapped)
    first = float(time[0]) if len(time) else math.nan
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)):
        if _DATES[0] <= first * size < _DATES[1] and column.scale == 1.0 and (not column.unit or unit_of(column.unit) == unit_of(unit)):
            scale = size
            notes = [*not_of_kind(notes, NoteKind.TIME_UNIT), f"times are {unit} since 1970; time 0 is {np.datetime64(round(first * scale * 1000), 'ms')} UTC"]
            time = time - first
            break
    time, rounded = even_again(time * scale, spacing * scale)
    return time, notes + [rounded] * bool(rounded)


def _taken_as_time(column: TimeColumn) -> str:
    said = f"column {column.name!r} is taken as the time"
    return said if column.unit else Note(NoteKind.TIME_UNIT, f"{said}, in s")
