"""Messages of joint states as a table: by name, sorted, and merged where several publishers share a topic."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from operator import index
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ksl.base import limits
from ksl.base.errors import MotionError
from ksl.base.words import count, listed
from ksl.mechanism.states import Array
from ksl.motions.columns.recorded import Recorded
from ksl.motions.columns.time_column import TIME
from ksl.motions.signal.gaps import GAP, gaps_of
from ksl.motions.signal.ordered import FILLED_IN, RESTART
from ksl.motions.signal.resampling import on_spline

Nanoseconds = NDArray[np.int64]
SECOND = 1_000_000_000
LAST = 1 << 62
"""ns, of the year 2116: times up to here have differences that 64 bits hold."""


class JointStates:
    """Messages of one topic, as they are in the file, grouped by the joints that they name: one group for each publisher."""

    def __init__(self, file: str, topic: str, messages: Iterable[tuple[int, Any]]) -> None:
        """messages: time of the log in ns, and message.  Raises MotionError; what is no message of joint states raises errors of many kinds."""
        self.file, self.topic = file, topic
        self.groups: dict[tuple[str, ...], list[tuple[int, int, Any, Any]]] = {}
        """For each list of joints its messages: log time, header stamp, positions, velocities of its messages."""
        self.has_efforts = False
        self.without_positions = 0
        numbers = 0
        for log, m in messages:
            if not len(m.position):
                self.without_positions += 1
                continue
            numbers += len(m.position) + len(m.velocity)
            if numbers > limits.MOTION_NUMBERS:
                raise MotionError(f"{file}: more than {limits.MOTION_NUMBERS:,} numbers in {topic}; give a part of the recording")
            names = tuple(m.name)
            if len(names) != len(m.position):
                both = f"names {count(len(names), 'joint')}, but has {count(len(m.position), 'position')}"
                raise MotionError(f"{file}: a message of {topic} {both}; record it again")
            stamp = int(m.header.stamp.sec) * SECOND + int(m.header.stamp.nanosec)
            for time in (index(log), stamp):
                if not -LAST < time < LAST:
                    raise MotionError(f"{file}: a message of {topic} has the time {time} ns, after the year 2116; record it again")
            self.groups.setdefault(names, []).append((log, stamp, m.position, m.velocity))
            self.has_efforts |= len(m.effort) > 0
        if not self.groups:
            what = f"{count(self.without_positions, 'message')}, none with positions" if self.without_positions else "no messages"
            raise MotionError(f"{file}: topic {topic} has {what}; give a recording of the joints' positions")


@dataclass
class Series:
    """Joints that are always recorded together: times of the samples, increasing, and positions and velocities (n, joints)."""

    joints: list[str]
    time: Nanoseconds
    position: Array
    velocity: Array | None


class JointStateTable(Recorded):
    """Joint states, with `time` in s since the first sample, and the columns NAME and NAME.v."""

    def __init__(self, states: JointStates, format: str, positions_only: bool) -> None:
        self._clock, notes = _clock(states)
        self._series, said = _all_series(states, self._clock)
        names = [TIME]
        for s in self._series:
            names += s.joints
            if s.velocity is not None and not positions_only:
                names += [f"{joint}.v" for joint in s.joints]
        if len(names) > limits.COLUMNS:
            raise MotionError(f"{states.file}: {len(names):,} columns of joints in {states.topic}; at most {limits.COLUMNS:,} are read")
        super().__init__(states.file, f"{format}, topic {states.topic}", names, notes=notes + said, is_recording=True)
        if positions_only and any(s.velocity is not None for s in self._series):
            self.notes.append("velocities in the messages are not used, as wished")
        if states.has_efforts:
            self.notes.append("efforts in the messages are not used")
        if states.without_positions:
            self.notes.append(f"{count(states.without_positions, 'message')} without positions left out")

    def read(self, names: Sequence[str], time: str | None = None) -> dict[str, Array]:
        """The columns at the samples of the joints that are recorded most often; others are interpolated onto these."""
        wanted = set(names)
        used = [s for s in self._series if any(j in wanted or f"{j}.v" in wanted for j in s.joints)] or self._series[:1]
        used = [self._without_gaps_of_numbers(s, wanted) for s in used]
        base = max(used, key=lambda s: len(s.time))
        first, last = max(int(s.time[0]) for s in used), min(int(s.time[-1]) for s in used)
        if first > last:
            one, other = max(used, key=lambda s: s.time[0]), min(used, key=lambda s: s.time[-1])
            raise MotionError(f"{self.file}: {listed(other.joints)} and {listed(one.joints)} are never recorded at the same time; record them together")
        at = base.time[(base.time >= first) & (base.time <= last)]
        if not len(at):
            raise MotionError(f"{self.file}: {listed(base.joints)} have no sample while all other joints are recorded; record them together")
        columns: dict[str, Array] = {}
        for s in used:
            self._say_gaps(s)
            positions, velocities = self._at(s, at)
            for i, joint in enumerate(s.joints):
                columns[joint] = positions[:, i]
                if velocities is not None:
                    columns[f"{joint}.v"] = velocities[:, i]
        if len(at) < len(base.time):
            self.notes.append(f"{count(len(base.time) - len(at), 'sample')} before or after the time that all joints are recorded left out")
        columns[TIME] = (at - at[0]) * 1e-9
        self._say_start(int(at[0]))
        return {n: columns[n] for n in names}

    def _at(self, s: Series, at: Nanoseconds) -> tuple[Array, Array | None]:
        if np.array_equal(s.time, at):
            return s.position, s.velocity
        inside = np.isin(at, s.time, assume_unique=True)
        if inside.all():
            rows = np.searchsorted(s.time, at)
            return s.position[rows], None if s.velocity is None else s.velocity[rows]
        own = f"{count(len(s.time), 'sample')} of {listed(s.joints)}"
        self.notes.append(f"{own} are at other times than those of the joints recorded most often: interpolated by splines onto these {len(at):,}")
        seconds, wanted = (s.time - s.time[0]) * 1e-9, (at - s.time[0]) * 1e-9
        self.doubts += gaps_of((s.time - at[0]) * 1e-9, s.position, [(joint, "") for joint in s.joints], (at - at[0]) * 1e-9)
        return on_spline(seconds, s.position, wanted), None if s.velocity is None else on_spline(seconds, s.velocity, wanted)

    def _without_gaps_of_numbers(self, s: Series, wanted: set[str]) -> Series:
        """Without samples at which a position that is wanted is no number.  Infinite ones are refused, as in tables."""
        columns = [i for i, joint in enumerate(s.joints) if joint in wanted]
        infinite = np.argwhere(np.isinf(s.position[:, columns]))
        if len(infinite):
            row, column = infinite[0]
            at = f"{(s.time[row] - s.time[0]) * 1e-9:.6g} s after its start"
            raise MotionError(f"{self.file}: the position of {s.joints[columns[column]]} is infinite {at}; every sample needs a finite number")
        finite = np.isfinite(s.position[:, columns]).all(axis=1)
        if finite.all():
            return s
        if not finite.any():
            raise MotionError(f"{self.file}: the positions of {listed(s.joints)} are not numbers in any message")
        self.notes.append(f"{count(int((~finite).sum()), 'sample')} of {listed(s.joints)} left out, since positions are not numbers")
        return Series(s.joints, s.time[finite], s.position[finite], None if s.velocity is None else s.velocity[finite])

    def _say_gaps(self, s: Series) -> None:
        steps = np.diff(s.time)
        if len(steps) < 3:
            return
        longest = int(np.argmax(steps))
        if steps[longest] > GAP * np.median(steps):
            at = (s.time[longest] - s.time[0]) * 1e-9
            gaps = int((steps > GAP * np.median(steps)).sum())
            self.notes.append(
                f"joint states of {listed(s.joints, 4)} have {count(gaps, 'gap')}, the longest of {steps[longest] * 1e-9:.4g} s, {at:.6g} s after their start: "
                "the motion in it is a spline's"
            )

    def _say_start(self, start: int) -> None:
        when = f"{np.datetime64(start // 1_000_000, 'ms')} UTC" if start > 10**8 * SECOND else f"{start * 1e-9:.9g} s"
        self.notes.append(f"time 0 is {when} of the {self._clock}")


def _clock(states: JointStates) -> tuple[str, list[str]]:
    """Which times are used: header stamps, or those of the log where stamps are missing or stand still."""
    log = "log, since header stamps "
    stamps = np.array([m[1] for group in states.groups.values() for m in group])
    zero = int((stamps == 0).sum())
    if zero and not all(_begins_at_zero([m[1] for m in group]) for group in states.groups.values()):
        missing = "are zero" if zero == len(stamps) else f"of {zero} of {len(stamps)} messages are zero"
        return "log", [f"times are those of the {log}{missing}"]
    for names, group in states.groups.items():
        back = -int(np.diff([m[1] for m in group]).min(initial=0))
        if back > RESTART * SECOND:  # a simulation that was started again, or a clock that was set: sorting would mix two motions
            return "log", [f"times are those of the {log}of {listed(names, 4)} jump back by {back / SECOND:.4g} s"]
        if len(group) > 2 and len({m[1] for m in group}) <= len(group) / 2:
            return "log", [f"times are those of the {log}of {listed(names, 4)} stand still"]
    return "header stamps", []


def _begins_at_zero(stamps: list[int]) -> bool:
    """Whether no stamp is zero but that of the first message, and the next ones go on from there, as those of a simulation do."""
    later = stamps[1:]
    if 0 in later:
        return False
    return stamps[0] != 0 or (len(later) > 1 and later[0] <= GAP * float(np.median(np.abs(np.diff(later)))))


def _all_series(states: JointStates, clock: str) -> tuple[list[Series], list[str]]:
    """Series of joints, and notes about messages that were out of order or repeated."""
    which = 0 if clock == "log" else 1
    groups = list(states.groups.items())
    of_joint: dict[str, list[int]] = {}
    places = [{name: i for i, name in enumerate(names)} for names, _ in groups]
    for k, (names, _) in enumerate(groups):
        if len(places[k]) < len(names):
            twice = next(n for n, times in Counter(names).items() if times > 1)
            raise MotionError(f"{states.file}: messages of {states.topic} name the joint {twice!r} twice; record it again")
        for joint in names:
            of_joint.setdefault(joint, []).append(k)
    together: dict[tuple[int, ...], list[str]] = {}
    for joint, ks in of_joint.items():
        together.setdefault(tuple(ks), []).append(joint)
    arrays = [_arrays(messages, which, len(names)) for names, messages in groups]
    unsorted = sum(int((np.diff(time) < 0).sum()) for time, _, _ in arrays)
    series, repeated = [], 0
    ignored: list[str] = []
    partial: list[str] = []
    for members, joints in together.items():
        ks = list(members)
        columns = [[places[k][joint] for joint in joints] for k in ks]
        time = np.concatenate([arrays[k][0] for k in ks])
        position = np.concatenate([arrays[k][1][:, c] for k, c in zip(ks, columns)])
        parts = [v[:, c] for (_, _, v), c in zip((arrays[k] for k in ks), columns) if v is not None]
        velocity = np.concatenate(parts) if len(parts) == len(ks) else None
        order = np.argsort(time, kind="stable")
        last = np.append(np.diff(time[order]) > 0, True)  # of messages with the same time, the last
        repeated += int((~last).sum())
        order = order[last]
        time, position, velocity = time[order], position[order], None if velocity is None else velocity[order]
        if velocity is None:
            partial += joints if any(len(m[3]) for k in ks for m in groups[k][1]) else []
            series.append(Series(joints, time, position, None))
            continue
        moved = np.ptp(position, axis=0) > FILLED_IN
        filled_in = ~velocity.any(axis=0) & (moved if velocity.any() else moved.any())  # of one joint, or of all that a driver says nothing of
        usable = np.isfinite(velocity).all(axis=0) & ~filled_in
        ignored += [j for j, good in zip(joints, usable) if not good]
        for good in (True, False):
            if (usable == good).any():
                mine = [j for j, u in zip(joints, usable) if u == good]
                series.append(Series(mine, time, position[:, usable == good], velocity[:, usable] if good else None))
    notes = [f"{count(unsorted, 'message')} of {states.topic} older than the one before: sorted by time"] if unsorted else []
    notes += [f"{count(repeated, 'sample')} with the time of another left out: the last one of each time is used"] if repeated else []
    notes += [f"velocities of {listed(ignored)} are not used: they are zero in every message, or not numbers"] if ignored else []
    notes += [f"velocities of {listed(partial)} are not used: not all messages have them"] if partial else []
    return series, notes


def _arrays(messages: list[tuple[int, int, Any, Any]], which: int, joints: int) -> tuple[Nanoseconds, Array, Array | None]:
    """Times, positions and velocities of messages that name the same joints."""
    time = np.array([m[which] for m in messages], dtype=np.int64)
    position = np.array([m[2] for m in messages], dtype=float).reshape(len(messages), joints)
    has_velocity = all(len(m[3]) == joints for m in messages)
    return time, position, np.array([m[3] for m in messages], dtype=float).reshape(len(messages), joints) if has_velocity else None
