"""Names of a motion's columns, joint by joint."""

from __future__ import annotations

from ksl.model.joint_columns import COLUMNS, METRES
from ksl.model.mechanism import Joint

__all__ = ["COLUMNS", "METRES", "columns_of", "columns_of_one_coordinate"]


def columns_of(joint: Joint) -> tuple[list[str], list[str], list[str]]:
    """Names of a joint's columns: positions, velocities, accelerations."""
    if joint.kind not in COLUMNS:
        return columns_of_one_coordinate(joint)
    position, velocity, acceleration = ([f"{joint.name}.{c}" for c in group.split()] for group in COLUMNS[joint.kind])
    return position, velocity, acceleration


def columns_of_one_coordinate(joint: Joint) -> tuple[list[str], list[str], list[str]]:
    return [joint.name], [f"{joint.name}.v"], [f"{joint.name}.a"]
