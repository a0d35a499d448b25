"""The joints that have reactions: those of the tree and, of a closed mechanism, those that close its loops."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ksl.mechanism.joint_kinds import KINDS, has_one_coordinate
from ksl.mechanism.mechanism import Joint, Loop, Mechanism


@dataclass(frozen=True)
class LoopJoint(Joint):
    """A joint that closes a loop, among others.  Its position is no number of q: :func:`ksl.load_cases.loop_motion.joint_motions` computes it."""

    loop: Loop | None = field(default=None, kw_only=True)

    @property
    def one_coordinate(self) -> bool:
        return has_one_coordinate(self.kind)


def reaction_joints(model: Mechanism) -> tuple[Joint, ...]:
    """All joints with reactions: those of `Model.joints`, then those that close loops."""
    return (*model.joints, *map(_of, model.loops)) if model.loops else model.joints


def joint_named(model: Mechanism, name: str) -> Joint:
    """One of them by its name."""
    return next((joint for joint in map(_of, model.loops) if joint.name == name), None) or model.joint(name)


def has_drive(model: Mechanism, joint: Joint) -> bool:
    """Whether a joint with one coordinate has a motor: of a closed mechanism those that are named as drives, of a tree all but mimic joints."""
    if not joint.one_coordinate or joint.leader is not None or isinstance(joint, LoopJoint):
        return False
    return not model.loops or model.drives is None or joint.name in model.drives


def without_limits(joint: Joint) -> bool:
    """Whether no file can give limits of a joint: loop joints have none."""
    return isinstance(joint, LoopJoint)


def _of(loop: Loop) -> LoopJoint:
    kind = KINDS[loop.kind]
    none = (0.0, 0.0, 0.0)
    return LoopJoint(
        loop.name, loop.kind, loop.predecessor, loop.successor, 0, 0, -1, -1, loop.axis or none, loop.pitch, loop.axis2,
        has_axis=loop.axis is not None, has_angle=kind.angle is not None, loop=loop,
    )  # fmt: skip


def frame_on_successor(loop: Loop) -> np.ndarray:
    """(4, 4): the joint's frame on the side called child, in that link's frame."""
    return np.array(loop.successor_pose).reshape(4, 4)


def frame_on_predecessor(loop: Loop) -> np.ndarray:
    """(4, 4): on the other side."""
    return np.array(loop.predecessor_pose).reshape(4, 4)
