"""Samples as recorders leave them: numbers that are missing, stamps that are repeated or out of order, joints at times of their own.

Files of all formats are treated as recordings are (`files.joint_states`), with the same notes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import MotionError
from ksl.base.words import count, listed
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.joint_kinds import columns_of, units_of
from ksl.mechanism.states import Array
from ksl.motions.signal.gaps import gaps_of
from ksl.motions.signal.resampling import on_spline

RESTART = 0.5
"""Samples that overtake each other are sorted by their times; times that jump back by more than this, s, have another reason."""
FEW = 3
"""Samples that a recording has at least, where it is one of several in a file."""
CLOSE = 0.01
"""Share of the median step below which two samples are one: differentiated, the difference of their times would be a jerk."""
FILLED_IN = 1e-3
"""Velocities that are all zero, while positions change by more than this (rad or m), were not measured."""

Values = dict[str, Array]
Rows = NDArray[np.intp]


@dataclass
class Ordered:
    """Times that increase, all columns at each of them, the row of the file of each, and what was done."""

    time: Array
    values: Values
    rows: Rows
    notes: list[str] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)
    """Gaps of single joints, beside samples of others."""


@dataclass
class _Series:
    """Joints whose numbers are in the same rows."""

    joints: list[str]
    columns: list[str]
    rows: Rows
    is_differentiated: bool


def ordered(file: str, joints: Sequence[Joint], time: Array, values: Values, rows: Rows) -> Ordered:
    """Samples of all joints at times that increase.  NaN is a number that is missing; times are finite.  Raises MotionError.

    values: the columns of the motion that the file has.  O(n log n) where something is to be done, O(n) otherwise.
    """
    notes: list[str] = []
    values = _without_unusable_rates(joints, values, notes)
    steps = np.diff(time)
    complete = not any(np.isnan(x).any() for x in values.values())
    if not len(time) or (complete and (not len(steps) or (steps > CLOSE * np.median(steps)).all())):  # then the median is positive, too
        return Ordered(time, values, rows, notes)
    series = _series(joints, values, len(time))
    for s in series:
        if not len(s.rows):
            raise MotionError(
                f"{file}: the positions of {listed(s.joints)} are not numbers in any sample; give them, or say where the joint rests by a map ([constants])"
            )
    if len(series) == 1 and len(series[0].rows) < len(time):
        notes.append(f"{count(len(time) - len(series[0].rows), 'sample')} of {listed(series[0].joints)} left out, since positions are not numbers")
    unsorted = int((steps < 0).sum())
    if unsorted:
        notes.append(f"{count(unsorted, 'sample')} older than the one before: sorted by time")
    repeated = close = 0
    for s in series:
        s.rows = s.rows[np.argsort(time[s.rows], kind="stable")]
        last = np.append(np.diff(time[s.rows]) > 0, True)  # of samples with the same time, the last
        repeated, s.rows = repeated + int((~last).sum()), s.rows[last]
        if s.is_differentiated and len(s.rows) > 2:
            between = np.diff(time[s.rows])
            apart = np.append(between > CLOSE * np.median(between), True)
            close, s.rows = close + int((~apart).sum()), s.rows[apart]
    if repeated:
        notes.append(f"{count(repeated, 'sample')} with the time of another left out: the last one of each time is used")
    if close:
        notes.append(f"{count(close, 'sample')} less than {CLOSE:.0%} of the median step before the next left out: stamps that close are those of one sample")
    units = {c: f" {unit}" if j.nv == 1 or unit == "m" else "" for j in joints for c, unit in zip(columns_of(j)[0], units_of(j)[0], strict=True)}
    return _merged(file, series, time, values, rows, notes, units)


def recordings(times: Array) -> Rows:
    """Where each of several recordings begins that follow one another: times go back to the first one, and on from there.  [0] where there is one alone."""
    steps = np.diff(times)
    back = np.flatnonzero(steps < 0) + 1
    starts = np.append(0, back)
    if len(back) and (steps > 0).any() and np.diff(np.append(starts, len(times))).min() >= FEW:
        usual = float(np.median(steps[steps > 0]))
        if (np.abs(times[back] - times[0]) <= usual).all() and (steps[back] <= 2 * usual).all():
            return starts
    return starts[:1]


def not_increasing(place: Callable[[int], str], times: Array, k: int) -> MotionError:
    """What to say of times that don't increase at sample k."""
    starts = recordings(times)
    mend = "sort the samples and remove repeated ones"
    if len(starts) > 1:
        mend = f"{len(starts):,} recordings follow one another, the first in {count(int(starts[1]), 'sample')}: give the one that is meant alone"
    return MotionError(f"{place(k)}: time {times[k]:.9g} after {times[k - 1]:.9g}; times must increase: {mend}")


def check_restart(times: Array) -> int | None:
    """The first sample at which times go back so far that sorting would mix two motions, or stand still; None where they don't."""
    steps = np.diff(times)
    back, starts = np.flatnonzero(steps < -RESTART), recordings(times)
    if len(back) or len(starts) > 1:
        return int(starts[1]) if len(starts) > 1 else int(back[0]) + 1
    still = np.flatnonzero(steps == 0)
    return int(still[0]) + 1 if len(still) and len(still) >= len(times) / 2 else None


def _moves(positions: Sequence[Array]) -> bool:
    """Whether a joint's positions change by more than its zero velocities allow."""
    return any(np.nanmax(x) - np.nanmin(x) > FILLED_IN for x in positions if np.isfinite(x).any())


def _without_unusable_rates(joints: Sequence[Joint], values: Values, notes: list[str]) -> Values:
    """Without rates that aren't numbers where the joint's positions are, and without velocities that nobody has measured."""
    left_out: list[str] = []
    given = [(j, [c for c in columns_of(j)[1] if c in values]) for j in joints]
    given = [(j, velocities) for j, velocities in given if velocities]
    still = [(j, velocities) for j, velocities in given if not any(np.nan_to_num(values[c]).any() for c in velocities)]
    moving = [(j, velocities) for j, velocities in still if _moves([values[c] for c in columns_of(j)[0] if c in values])]
    if moving:  # of one joint, or of all that a driver says nothing of
        left_out += [c for _, velocities in (still if len(still) == len(given) else moving) for c in velocities]
    for joint in joints:
        position, *rates = columns_of(joint)
        there = np.ones(len(next(iter(values.values()), np.empty(0))), dtype=bool)
        for c in position:
            if c in values:
                there &= ~np.isnan(values[c])
        for group in rates:
            if group[0] in values and any(np.isnan(values[c][there]).any() for c in group if c in values):
                left_out += [c for c in group if c not in left_out]
    if not left_out:
        return values
    names = [c.removesuffix(".v") for c in left_out]
    notes.append(f"velocities of {listed(names)} are not used: they are zero in every sample, or not numbers")
    return {c: x for c, x in values.items() if c not in left_out}


def _series(joints: Sequence[Joint], values: Values, n: int) -> list[_Series]:
    found: dict[bytes, _Series] = {}
    for joint in joints:
        groups = columns_of(joint)
        columns = [c for group in groups for c in group if c in values]
        if not columns:
            continue
        there = np.ones(n, dtype=bool)
        for c in columns:
            there &= ~np.isnan(values[c])
        s = found.setdefault(np.packbits(there).tobytes(), _Series([], [], np.flatnonzero(there), False))
        s.joints.append(joint.name)
        s.columns += columns
        s.is_differentiated |= not all(group[0] in values for group in groups)
    return list(found.values())


def _merged(file: str, series: list[_Series], time: Array, values: Values, rows: Rows, notes: list[str], units: dict[str, str]) -> Ordered:
    """All series at the times of the one with the most samples.  units: of columns of positions."""
    base = max(series, key=lambda s: len(s.rows))
    first, last = max(time[s.rows[0]] for s in series), min(time[s.rows[-1]] for s in series)
    if first > last:
        one, other = max(series, key=lambda s: time[s.rows[0]]), min(series, key=lambda s: time[s.rows[-1]])
        raise MotionError(f"{file}: {listed(other.joints)} and {listed(one.joints)} are never recorded at the same time; record them together")
    kept = base.rows[(time[base.rows] >= first) & (time[base.rows] <= last)]
    at = time[kept]
    if not len(at):
        raise MotionError(f"{file}: {listed(base.joints)} have no sample while all other joints are recorded; record them together")
    if len(kept) < len(base.rows):
        notes.append(f"{count(len(base.rows) - len(kept), 'sample')} before or after the time that all joints are recorded left out")
    out: Values = {}
    doubts: list[str] = []
    for s in series:
        own = time[s.rows]
        if np.array_equal(own, at):
            out |= {c: values[c][s.rows] for c in s.columns}
            continue
        inside = np.searchsorted(own, at)
        if (inside < len(own)).all() and np.array_equal(own[inside], at):
            out |= {c: values[c][s.rows[inside]] for c in s.columns}
            continue
        those = f"{count(len(own), 'sample')} of {listed(s.joints)}"
        notes.append(f"{those} are at other times than those of the joints recorded most often: interpolated by splines onto these {len(at):,}")
        positions = [(c, unit) for c, unit in units.items() if c in s.columns]
        doubts += gaps_of(own, np.column_stack([values[c][s.rows] for c, _ in positions]), positions, at) if positions else []
        try:
            x = on_spline(own - own[0], np.column_stack([values[c][s.rows] for c in s.columns]), at - own[0])
        except MotionError as e:
            raise MotionError(f"{file}: {listed(s.joints)}: {e}") from None
        out |= {c: x[:, i] for i, c in enumerate(s.columns)}
    return Ordered(at, {c: out[c] for c in values}, rows[kept], notes, doubts)
