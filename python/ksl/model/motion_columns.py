"""Names and units of a motion's columns, joint by joint."""

from __future__ import annotations

from ksl.model.joint_columns import named
from ksl.model.joint_kinds import KINDS
from ksl.model.mechanism import Joint


def columns_of(joint: Joint) -> tuple[list[str], list[str], list[str]]:
    """Names of a joint's columns: positions, velocities, accelerations."""
    kind = KINDS[joint.kind]
    return named(joint.name, kind.position), named(joint.name, kind.velocity), named(joint.name, kind.acceleration)


def units_of(joint: Joint) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Units of the numbers in these columns, "m" or "rad" without the time in rates; "" for those of a quaternion."""
    kind = KINDS[joint.kind]
    return kind.position_unit, kind.velocity_unit, kind.velocity_unit


def columns_of_one_coordinate(joint: Joint) -> tuple[list[str], list[str], list[str]]:
    """Those that it would have if it had one coordinate."""
    kind = KINDS["revolute"]
    return named(joint.name, kind.position), named(joint.name, kind.velocity), named(joint.name, kind.acceleration)
