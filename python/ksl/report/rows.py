"""Rows of the summary with what stands beside them: the limits of the file, and the range of the positions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ksl.mechanism import Joint
from ksl.states import Array

Row = Mapping[str, float | str | None]

LIMIT_OF = {"effort_peak": "effort_limit", "speed_peak": "speed_limit", "position_lowest": "position_lower", "position_highest": "position_upper"}
"""The limit beside a number of a row."""


def joint_range(joint: Joint) -> tuple[float | None, float | None]:
    """Limits of the position.  Two equal ones are none: files say 0 and 0 where they mean that none are given."""
    return (None, None) if joint.lower == joint.upper else (joint.lower, joint.upper)


def with_limits(row: Row, joint: Joint, time: Array, position: Array | None) -> dict[str, float | str | None]:
    """A row of the summary, and for joints with one coordinate also effort_limit, speed_limit, position_lower, position_upper.

    With positions (n), rad or m, at `time` (n), also position_lowest and position_highest, and …_time of both.  A limit of 0 in
    the file means that none is given.
    """
    whole = dict(row)
    if not joint.one_coordinate:
        return whole
    whole["position_lower"], whole["position_upper"] = joint_range(joint)
    whole |= {"effort_limit": joint.effort or None, "speed_limit": joint.velocity or None}
    if position is not None:
        for name, k in (("position_lowest", int(np.argmin(position))), ("position_highest", int(np.argmax(position)))):
            whole |= {name: float(position[k]), f"{name}_time": float(time[k])}
    return whole


def exceeds(row: Row, key: str) -> bool:
    """Whether this number of a row is beyond its limit."""
    value, limit = row.get(key), row.get(LIMIT_OF.get(key, ""))
    if not isinstance(value, (int, float)) or not isinstance(limit, (int, float)):
        return False
    return value < limit if key == "position_lowest" else value > limit
