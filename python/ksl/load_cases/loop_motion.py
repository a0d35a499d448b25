"""Positions and rates of joints with one coordinate, those that close loops included."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ksl.load_cases.reaction_joints import LoopJoint, frame_on_predecessor, frame_on_successor
from ksl.mechanism.calls import Calls
from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.mechanism import Joint, Loop, Mechanism
from ksl.mechanism.states import Array


class OfJoint(NamedTuple):
    """Position, speed and acceleration of a joint, each (n); rad or m."""

    position: Array
    speed: Array
    acceleration: Array


@dataclass(frozen=True)
class JointMotions:
    """The motion of each joint with one coordinate, from samples q (n, nq), v and a (n, nv) of the mechanism."""

    model: Mechanism
    q: Array
    v: Array
    a: Array
    of_loops: dict[str, OfJoint]

    def of(self, joint: Joint) -> OfJoint:
        if isinstance(joint, LoopJoint):
            return self.of_loops[joint.name]
        m = self.model
        return OfJoint(m.position_of(joint, self.q), m.velocity_of(joint, self.v), m.velocity_of(joint, self.a))

    def part(self, rows: slice) -> JointMotions:
        """Some of the samples."""
        loops = {name: OfJoint(*(x[rows] for x in of)) for name, of in self.of_loops.items()}
        return JointMotions(self.model, self.q[rows], self.v[rows], self.a[rows], loops)


def joint_motions(model: Calls, q: Array, v: Array, a: Array) -> JointMotions:
    """Angles of loop joints are continuous over the samples, and begin within half a turn."""
    loops = {loop.name: _of_loop(model, loop, q, v, a) for loop in model.loops if loop.axis is not None and loop.equations == 5}
    return JointMotions(model, q, v, a, loops)


def _of_loop(model: Calls, loop: Loop, q: Array, v: Array, a: Array) -> OfJoint:
    """The motion of the successor against the predecessor, along or about the axis."""
    links = (f"link:{loop.predecessor}", f"link:{loop.successor}")
    poses = model.frame_poses(q, links) @ np.array([frame_on_predecessor(loop), frame_on_successor(loop)])
    twist = model.frame_velocities(q, v, links, axes="world", at="world")
    change = model.frame_accelerations(q, v, a, links, "spatial", axes="world", at="world")
    R, axis = poses[:, 0, :3, :3], np.array(loop.axis)
    u, origin = R @ axis, poses[:, 1, :3, 3]
    relative, rate = twist[:, 1] - twist[:, 0], change[:, 1] - change[:, 0]
    if loop.kind == "prismatic":
        apart = origin - poses[:, 0, :3, 3]
        # both sides turn alike, so that all points of the successor move in the same way against those of the predecessor
        return OfJoint(_dot(u, apart), _dot(u, relative[:, :3]), _dot(u, rate[:, :3]))
    turn = np.swapaxes(R, 1, 2) @ poses[:, 1, :3, :3]
    sine = np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], axis=1) @ axis / 2
    angle = np.unwrap(np.arctan2(sine, (np.trace(turn, axis1=1, axis2=2) - 1) / 2))
    if KINDS[loop.kind].has_pitch and loop.pitch:  # which turn it is follows from the travel
        travel = _dot(u, origin - poses[:, 0, :3, 3]) / loop.pitch
        angle = angle + 2 * np.pi * np.round((travel[:1] - angle[:1]) / (2 * np.pi))
    return OfJoint(angle, _dot(u, relative[:, 3:]), _dot(u, rate[:, 3:]))


def _dot(x: Array, y: Array) -> Array:
    return np.asarray(np.einsum("ni,ni->n", x, y))
