"""Names of a motion's columns, joint by joint."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ksl.mechanism import Joint

if TYPE_CHECKING:
    pass

COLUMNS = {
    "floating": ("x y z qx qy qz qw", "vx vy vz wx wy wz", "ax ay az bx by bz"),
    "spherical": ("qx qy qz qw", "wx wy wz", "bx by bz"),
    "planar": ("x y angle", "vx vy wz", "ax ay bz"),
    "translation": ("x y z", "vx vy vz", "ax ay az"),
    "cylindrical": ("angle travel", "angle.v travel.v", "angle.a travel.a"),
    "universal": ("angle1 angle2", "angle1.v angle2.v", "angle1.a angle2.a"),
}
"""Columns of joints with several coordinates: position in the joint's frame; velocity, of floating, spherical and planar joints the
twist in the child's axes, linear then angular; its componentwise derivative."""
METRES = ("x", "y", "z", "vx", "vy", "vz", "ax", "ay", "az", "travel", "travel.v", "travel.a")
"""The columns that are in m, m/s and m/s²; the others are in rad or are quaternions."""


def columns_of(joint: Joint) -> tuple[list[str], list[str], list[str]]:
    """Names of a joint's columns: positions, velocities, accelerations."""
    if joint.kind not in COLUMNS:
        return columns_of_one_coordinate(joint)
    position, velocity, acceleration = ([f"{joint.name}.{c}" for c in group.split()] for group in COLUMNS[joint.kind])
    return position, velocity, acceleration


def columns_of_one_coordinate(joint: Joint) -> tuple[list[str], list[str], list[str]]:
    return [joint.name], [f"{joint.name}.v"], [f"{joint.name}.a"]
