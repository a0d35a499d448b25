"""Rows of the summary, with the limits of the file beside them."""

from __future__ import annotations

from collections.abc import Mapping

from ksl.load_cases.quantities import unit
from ksl.mechanism import Joint

Row = Mapping[str, float | str | None]

LIMIT_OF = {"effort_peak": "effort_limit", "speed_peak": "speed_limit", "position_lowest": "position_lower", "position_highest": "position_upper"}
"""The limit beside a number of a row."""


def joint_range(joint: Joint) -> tuple[float | None, float | None]:
    """Limits of the position.  Two equal ones are none: files say 0 and 0 where they mean that none are given."""
    return (None, None) if joint.lower == joint.upper else (joint.lower, joint.upper)


def with_limits(row: Row, joint: Joint) -> dict[str, float | str | None]:
    """A row of the summary, and for joints with one coordinate also effort_limit, speed_limit, position_lower, position_upper.

    They are None where the file gives no limit, or 0.
    """
    if not joint.one_coordinate:
        return dict(row)
    lower, upper = joint_range(joint)
    limits = {"effort_limit": joint.effort or None, "speed_limit": joint.velocity or None}
    return {**row, **limits, "position_lower": lower, "position_upper": upper}


def exceeds(row: Row, key: str) -> bool:
    """Whether this number of a row is beyond its limit."""
    value, limit = row.get(key), row.get(LIMIT_OF.get(key, ""))
    if not isinstance(value, (int, float)) or not isinstance(limit, (int, float)):
        return False
    return value < limit if key == "position_lowest" else value > limit


def joint_units(joint: Joint) -> dict[str, str]:
    """The units of a joint's quantities in a row: {position: rad, …}."""
    if not joint.one_coordinate:
        return {name: unit(name, joint) for name in ("force", "moment")}
    names = ("axial_force", "radial_force", "bending_moment", "axial_moment", "position", "speed", "acceleration", "effort", "power")
    return {**{name: unit(name, joint) for name in names}, "work": "J"}
