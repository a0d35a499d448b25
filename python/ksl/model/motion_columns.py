"""Names and units of a motion's columns, joint by joint."""

from __future__ import annotations

from ksl.model.joint_columns import endings_of
from ksl.model.joint_kinds import KINDS
from ksl.model.mechanism import Joint

_ENDINGS = {name: endings_of(kind)[:3] for name, kind in KINDS.items()}
_UNITS = {name: (kind.position_unit, kind.velocity_unit, kind.velocity_unit) for name, kind in KINDS.items()}


def columns_of(joint: Joint) -> tuple[list[str], list[str], list[str]]:
    """Names of a joint's columns: positions, velocities, accelerations."""
    return _named(joint.name, joint.kind)


def units_of(joint: Joint) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Units of the numbers in these columns, "m" or "rad" without the time in rates; "" for those of a quaternion."""
    return _UNITS[joint.kind]


def columns_of_one_coordinate(joint: Joint) -> tuple[list[str], list[str], list[str]]:
    """Those that it would have if it had one coordinate."""
    return _named(joint.name, "revolute")


def _named(joint: str, kind: str) -> tuple[list[str], list[str], list[str]]:
    position, velocity, acceleration = ([joint + ending for ending in group] for group in _ENDINGS[kind])
    return position, velocity, acceleration
