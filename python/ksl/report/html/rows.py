"""Rows of the summary, with the limits of the file beside them."""

from __future__ import annotations

from collections.abc import Mapping

from ksl.load_cases.joint_limits import limits_of
from ksl.load_cases.quantities import unit
from ksl.load_cases.verdict import ROUND_OFF
from ksl.mechanism.mechanism import Joint

Row = Mapping[str, float | str | None]

LIMIT_OF = {"effort_peak": "effort_limit", "speed_peak": "speed_limit", "position_lowest": "position_lower", "position_highest": "position_upper"}
"""The limit beside a number of a row."""


def with_limits(row: Row, joint: Joint) -> dict[str, float | str | None]:
    """A row of the summary, and for joints with one coordinate also effort_limit, speed_limit, position_lower, position_upper.

    They are None where the file gives no limit, or 0.
    """
    if not joint.one_coordinate:
        return dict(row)
    given = limits_of(joint)
    return {**row, "effort_limit": given.effort, "speed_limit": given.velocity, "position_lower": given.lower, "position_upper": given.upper}


def exceeds(row: Row, key: str) -> bool:
    """Whether this number of a row is beyond its limit."""
    value, limit = row.get(key), row.get(LIMIT_OF.get(key, ""))
    if not isinstance(value, (int, float)) or not isinstance(limit, (int, float)):
        return False
    beyond = limit - value if key == "position_lowest" else value - limit
    return beyond > ROUND_OFF * (max(1.0, abs(limit)) if key.startswith("position") else abs(limit))


def joint_units(joint: Joint) -> dict[str, str]:
    """The units of a joint's quantities in a row: {position: rad, …}."""
    if not joint.one_coordinate:
        return {name: unit(name, joint) for name in ("force", "moment")}
    names = ("axial_force", "radial_force", "bending_moment", "axial_moment", "position", "speed", "acceleration", "effort", "power")
    return {**{name: unit(name, joint) for name in names}, "work": "J"}
