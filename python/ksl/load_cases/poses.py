"""Poses: positions of all joints by their names."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ksl.base.errors import MotionError, name_among, near_names
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.joint_kinds import columns_of
from ksl.mechanism.states import Array
from ksl.motions.closing import Closing
from ksl.motions.motion import Motion
from ksl.motions.signal.suspicions import suspicions_of_pose


def pose_of(model: Mechanism, positions: Mapping[str, Any]) -> Array:
    """q (nq) of positions by the names of columns: {joint: rad or m}, {"joint.qx": …}.

    Joints that are not named are at zero, those with limits at the nearest position to it within them; quaternions at the identity.
    A joint with several coordinates may also be given as a list, all its numbers.  Raises MotionError.
    """
    q, index = neutral(model), {}
    for joint in _moving(model):
        for k, column in enumerate(columns_of(joint)[0]):
            index[column] = joint.q_index + k
    for given, value in positions.items():
        name = name_among(index, name_among(model.joint_names, given, "joint"), "joint")
        whole = next((j for j in _moving(model) if j.name == name and j.nq > 1), None)
        if whole is not None and isinstance(value, (list, tuple)) and len(value) == whole.nq:
            q[whole.q_index : whole.q_index + whole.nq] = [_number(name, x) for x in value]
        elif name in index:
            q[index[name]] = _number(name, value)
        elif name in model.follower_names:
            raise MotionError(f"pose: joint {name} mimics {model.joint(name).leader}, whose position says where both are; give that")
        elif name in model.loop_names:
            raise MotionError(f"pose: joint {name} closes a loop, and its position follows from those of other joints; give some of {', '.join(index)}")
        else:
            raise MotionError(f"pose: no joint or column {name!r}; {near_names(name, index)}known: {', '.join(index)}")
    for joint in _moving(model):
        if joint.quaternion is not None:
            part = slice(joint.q_index + joint.quaternion, joint.q_index + joint.quaternion + 4)
            length = float(np.linalg.norm(q[part]))
            if abs(length - 1) > 1e-2:
                raise MotionError(f"pose: the quaternion of {joint.name} has length {length:.4g}; expected a unit quaternion")
            q[part] /= length
    return q


def held_still(model: Mechanism, q: Array, closing: Closing | None = None) -> Motion:
    """The pose q (nq) at rest, as a motion of one sample."""
    still = np.zeros((1, model.nv))
    return Motion(np.zeros(1), q[None], still, still, doubts=suspicions_of_pose(model, q), closing=closing)


def neutral(model: Mechanism) -> Array:
    """q (nq) of joints at zero, or at the nearest position to it within their limits; quaternions at the identity."""
    q = np.zeros(model.nq)
    for joint in _moving(model):
        for k, (lower, upper) in enumerate(joint.limits):
            if not (lower is not None and lower == upper):  # such limits mean none
                q[joint.q_index + k] = min(max(0.0, -math.inf if lower is None else lower), math.inf if upper is None else upper)
        if joint.quaternion is not None:
            q[joint.q_index + joint.quaternion + 3] = 1.0
    return q


def _moving(model: Mechanism) -> tuple[Joint, ...]:
    return model.joints[: len(model.joint_names)]


def _number(name: str, x: Any) -> float:
    if isinstance(x, bool) or not isinstance(x, (int, float)) or not math.isfinite(x):
        raise MotionError(f"pose: {name} is {x!r}; expected a number, rad or m")
    return float(x)
