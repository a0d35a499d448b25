"""Joints that close loops: how far they are displaced by those of the tree, to the second order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ksl.mechanism.calls import Calls
from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.mechanism import Loop
from ksl.mechanism.states import Array
from ksl.mechanism.stiffness import Flexibility
from ksl.small_motions.directions import Directions
from ksl.small_motions.giving_way import GivingWay, giving_way, motion_at
from ksl.small_motions.second_derivatives import point, rotation


@dataclass(frozen=True)
class Closure:
    """A joint that closes a loop, in the axes of its frame on the successor."""

    name: str
    way: GivingWay
    displacement: Array
    """(6, d): of the successor's frame against the predecessor's, by the directions of the tree."""
    resists: Array
    """(6, r): rows of wrenches, orthonormal, that it can have: they do no work in the directions in which nothing resists."""
    rigid: Array
    """(6, c): wrenches that do no work in any direction in which it gives way."""
    second: Array
    """(d, d, 6)."""


def closure(model: Calls, to: Directions, loop: Loop, flexibility: Flexibility | None) -> Closure:
    """The joint about the pose of the directions.  It has no motor."""
    one, other = (model.frame_link(f"link:{name}") for name in (loop.predecessor, loop.successor))
    P, S = (to.pose[i] @ np.reshape(frame, (4, 4)) for i, frame in ((one, loop.predecessor_pose), (other, loop.successor_pose)))
    R, d0 = S[:3, :3], S[:3, 3] - P[:3, 3]
    motion = motion_at(loop, R.T @ P[:3, :3] @ np.array(loop.axis or np.zeros(3)))
    way = giving_way(loop, motion, flexibility, True)
    (p, p2), (s, s2) = point(to, one, P[:3, 3]), point(to, other, S[:3, 3])
    (turn_p, turn_p2), (turn_s, turn_s2) = rotation(to, one), rotation(to, other)
    moved = s - p - np.cross(turn_p, d0)
    displacement = np.vstack([R.T @ moved.T, R.T @ (turn_s - turn_p).T])
    turned = np.cross(turn_p[:, None], (s - p)[None])  # the predecessor's turn takes the difference with it
    twice = np.cross(turn_p[:, None], np.cross(turn_p[None], d0))
    linear = s2 - p2 - turned - turned.transpose(1, 0, 2) - np.cross(turn_p2, d0) + (twice + twice.transpose(1, 0, 2)) / 2
    both = np.cross(turn_p[:, None], turn_s[None]) / 2
    angular = turn_s2 - turn_p2 - both - both.transpose(1, 0, 2)
    second = np.concatenate([linear @ R, angular @ R], axis=2)
    if KINDS[loop.kind].has_axis2:  # its first axis turns the second
        factor = np.linalg.pinv(motion) @ displacement
        second[..., 3:] -= (np.outer(factor[0], factor[1]) + np.outer(factor[1], factor[0]))[..., None] * np.cross(*motion[3:].T) / 2
    without = way.directions[:, ~way.stiffness.any(axis=0)]
    return Closure(loop.name, way, displacement, _at_right_angles(without), _at_right_angles(way.directions), second)


def _at_right_angles(directions: Array) -> Array:
    """Orthonormal columns (6, n) at right angles to directions."""
    length = np.linalg.norm(directions, axis=0)
    U, size, _ = np.linalg.svd(directions / np.where(length > 0, length, 1.0))
    rest: Array = U[:, int((size > 1e-9).sum()) :]
    return rest
