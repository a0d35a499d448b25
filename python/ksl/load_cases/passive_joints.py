"""Joints of closed mechanisms that transmit nothing along their motion, by definition: those without a motor.  What is computed there is rounding."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ksl.load_cases.placement import Placement
from ksl.load_cases.reaction_joints import LoopJoint, reaction_joints
from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.mechanism import Joint, Mechanism


def passive(model: Mechanism) -> NDArray[np.bool_]:
    """Which of :func:`reaction_joints` transmit nothing along their motion, so that their wrenches are those of the structure alone.

    None of a tree, nor where joints have damping, friction, rotors or springs.  Joints that are coupled to others transmit the coupling.
    """
    joints = reaction_joints(model)
    if not model.loops or model.drives is None or model.physics:
        return np.zeros(len(joints), dtype=bool)
    coupled = {name for j in joints if j.leader is not None for name in (j.name, j.leader)}
    moves = [isinstance(j, LoopJoint) or j.nv > 0 for j in joints]
    return np.array([move and j.name not in model.drives and j.name not in coupled for j, move in zip(joints, moves, strict=True)])


def without_axial_effort(model: Mechanism, placement: Placement) -> NDArray[np.bool_]:
    """Which of them have, with one coordinate, no moment about the line through the placement's point along the axis, or no force along it."""
    return np.array([
        free and joint.one_coordinate and not KINDS[joint.kind].has_pitch and (not joint.has_angle or _is_on_axis(placement, joint))
        for joint, free in zip(reaction_joints(model), passive(model), strict=True)
    ])  # fmt: skip


def _is_on_axis(placement: Placement, joint: Joint) -> bool:
    point: str | Sequence[float] = placement.points.get(joint.name, placement.at)
    if isinstance(point, str):
        return point == "joint"
    return not np.cross(point, joint.axis).any()
