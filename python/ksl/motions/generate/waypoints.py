"""Waypoints: positions of joints, in a small table or between the limits of the file."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from ksl.base.errors import MotionError, unknown_name
from ksl.mechanism.mechanism import Mechanism
from ksl.mechanism.joint_kinds import columns_of
from ksl.mechanism.states import Array
from ksl.motions.columns.recorded import check_finite
from ksl.motions.files.recognise import open_table
from ksl.motions.generate.generated import ROUND_OFF, Limits

BETWEEN = 0.8
"""Share of the range between the limits that is used where no waypoints are given."""


@dataclass(frozen=True)
class Waypoints:
    """Positions (k, m) of the joints that move, and when they are reached, (k), if that was given."""

    positions: Array
    times: Array | None = None
    notes: tuple[str, ...] = ()
    are_given: bool = True
    """Whether somebody named them; otherwise they are between limits."""


def between_limits(limits: Limits) -> Waypoints:
    """From the middle of the range of every joint to its lower part, its upper part, and back."""
    part = BETWEEN * limits.half * np.array([[0.0], [-1.0], [1.0], [0.0]])
    return Waypoints(limits.middle + part, None, (f"no waypoints were given: all joints move over {100 * BETWEEN:.0f} % of their range",), False)


def read_waypoints(model: Mechanism, limits: Limits, path: str | os.PathLike[str]) -> Waypoints:
    """A table with a column for each joint, rad or m, and a line for each waypoint; `time`, s, if they are to be reached then.

    Joints without a column stay where they are in the neutral position.  Raises MotionError.
    """
    file = os.fspath(path)
    opened = open_table(file)
    if opened.is_recording:
        raise MotionError(f"{file}: is a bag; give waypoints as CSV, Parquet or NPZ, a column for each joint")
    table = opened.read(list(opened.names))
    check_finite(opened, table)
    names = [j.name for j in limits.joints]
    others = [c for j in model.joints[: len(model.joint_names)] if j.nv > 1 for c in columns_of(j)[0]]
    for column in table:
        if column != "time" and column not in names and column not in others:
            follows = column in (*model.joint_names, *model.loop_names) and model.loops
            known = f"joint {column} follows the drives; give positions of {', '.join(names)}"
            raise MotionError(f"{file}: " + (known if follows else unknown_name(f"column of {model.name}", "joint", column, names)))
    count = len(next(iter(table.values()), np.empty(0)))
    if count < 2:
        raise MotionError(f"{file}: {count} waypoint{'' if count == 1 else 's'}; a motion needs at least two, a line for each")
    neutral = model.neutral()[limits.q_index]
    positions = np.column_stack([table.get(name, np.full(count, neutral[k])) for k, name in enumerate(names)])
    _check_within(file, limits, positions)
    absent = [name for name in names if name not in table]
    notes = (*([f"no column for {', '.join(absent)}: at rest"] if absent else []), *opened.doubts)
    times = table.get("time")
    if times is not None and not (np.diff(times) > 0).any():
        times = None  # a template that was filled in: all times are zero
    if times is not None and not (np.diff(times) > 0).all():
        k = int(np.flatnonzero(np.diff(times) <= 0)[0]) + 1
        raise MotionError(f"{file}: waypoint {k + 1}: time {times[k]:.9g} after {times[k - 1]:.9g}; times must increase, or leave out the column `time`")
    return Waypoints(positions, None if times is None else times - times[0], notes)


def _check_within(file: str, limits: Limits, positions: Array) -> None:
    for k, joint in enumerate(limits.joints):
        if not joint.has_limits:
            continue
        slack = ROUND_OFF * max(1.0, float(limits.half[k]))
        for what, bound, beyond in (
            ("lower", limits.lower[k], positions[:, k] < limits.lower[k] - slack),
            ("upper", limits.upper[k], positions[:, k] > limits.upper[k] + slack),
        ):
            if beyond.any():
                i = int(np.flatnonzero(beyond)[0])
                raise MotionError(
                    f"{file}: waypoint {i + 1}: {joint.name} {positions[i, k]:.6g} {joint.unit} is beyond its {what} limit {bound:.6g} {joint.unit}"
                )
