"""Poses of closed mechanisms: some joints are where they are said to be, and the others follow."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import MotionError, ResultError
from ksl.mechanism.calls import Calls
from ksl.mechanism.freedoms import freedoms_to_drive
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.joint_kinds import columns_of
from ksl.mechanism.states import Array
from ksl.motions.closed_motion import held_by, moving_joints
from ksl.motions.closing import STEP, Closing, Held, NotClosed, closed_side_by_side, determining, first_closed, home

SAME = 1e-3
"""A position that is given for a joint that follows may differ by this much from where it is, rad or m: that of numbers with some digits."""


def named_joints(model: Mechanism, pose: Mapping[str, Any] | Sequence[float] | None) -> list[str]:
    """The joints that a pose names, by their names or those of their numbers; all of one that is given as numbers."""
    joints = moving_joints(model)
    if not isinstance(pose, Mapping):
        return [] if pose is None else [j.name for j in joints]
    return [j.name for j in joints if j.name in pose or any(column in pose for column in columns_of(j)[0])]


def closed_pose(model: Calls, q: Array, named: Collection[str]) -> tuple[Array, Closing]:
    """The closed position (nq) with the joints that are named as in q (nq), and how it was found.  Raises MotionError.

    Where more are named than the mechanism has freedoms, drives come first, and positions of others must be those that follow.
    """
    drives = model.drives or ()
    joints = sorted((j for j in moving_joints(model) if j.name in named), key=lambda j: j.name not in drives)
    try:
        free = freedoms_to_drive(model)
        held = Held(model, tuple(joints))
        if sum(j.nv for j in joints) > free:
            held = Held(model, determining(model, home(model, [j.name for j in joints if j.name in drives]), joints))
        whole = len(joints) == len(moving_joints(model))
        found = first_closed(held, q, q if whole else None) if joints else home(model, drives)
    except NotClosed as e:
        raise MotionError(f"pose: {e.why}") from None
    for joint in joints:
        if joint not in held.joints:
            _check_follows(model, joint, q, found, held)
    error = float(model.close(found).error)
    return found, Closing(tuple(held.names), error, 0.0, (), free)


def _check_follows(model: Calls, joint: Joint, q: Array, found: Array, held: Held) -> None:
    mixed = found.copy()
    part = slice(joint.q_index, joint.q_index + joint.nq)
    mixed[part] = q[part]
    if np.abs(model.difference(found, mixed)).max() > SAME:
        at = f" at {found[joint.q_index]:.6g} {joint.unit}" if joint.one_coordinate else ""
        said = f" {q[joint.q_index]:.6g} {joint.unit}" if joint.one_coordinate else " elsewhere"
        raise MotionError(f"pose: {joint.name} is given{said}, but with {held.said(found)} the loops put it{at}; leave it out, or correct one of them")


@dataclass
class Reach:
    """Closes many poses of a mechanism, from one that is closed; of a tree every pose is what it is."""

    model: Calls
    start: Array
    """(nq), closed."""
    held: Held | None
    skipped: int = field(default=0)
    """Poses from which no closed position was found within the limits of all joints, or none that drives hold."""

    def searched(self, joints: Collection[Joint]) -> list[Joint]:
        """The joints that may be searched: those that others follow."""
        return [j for j in joints if self.held is None or j in self.held.joints]

    def nearer(self, tried: Array, start: Array) -> Array:
        """Random shares of the ranges (n, searched); of a closed mechanism every second one is drawn nearer to where it starts.

        The ranges of a file may be far beyond what the mechanism can reach.
        """
        if self.held is not None:
            near, shrink = np.clip(start, 0, 1), np.linspace(0, 1, len(tried[::2]))[:, None] ** 4
            tried[::2] = near + (tried[::2] - near) * shrink
        return tried

    def closed(self, poses: Array, start: Array | None = None) -> tuple[Array, NDArray[np.bool_]]:
        """Closed poses (n, nq) with the held joints as in `poses`, and which were found; start: a closed pose nearby."""
        if self.held is None:
            return poses, np.ones(len(poses), dtype=bool)
        begin = self.start if start is None else start
        aims = self.held.put(begin, poses)
        way = np.abs(self.model.difference(np.broadcast_to(begin, aims.shape), aims)).max(initial=0.0)
        steps = int(max(1, np.ceil(way / (2 * STEP))))
        between = self.model.interpolate(
            np.broadcast_to(begin, (len(aims), steps, len(begin))), np.repeat(aims[:, None], steps, axis=1), np.arange(1, steps + 1) / steps
        )
        q, found = closed_side_by_side(self.held, between, np.broadcast_to(begin, aims.shape))
        last, ok = q[:, -1], found[:, -1]
        return last, ok & ((last >= self.model.lower - 1e-9) & (last <= self.model.upper + 1e-9)).all(axis=1)

    def sizes(self, size: Callable[[Array], Array], poses: Array, start: Array | None = None) -> Array:
        """Sizes (n) of poses, zero where no closed position was found, or where drives don't hold it."""
        closed, found = self.closed(poses, start)
        values = np.zeros(len(poses))
        rows = np.flatnonzero(found)
        while len(rows):
            try:
                values[rows] = size(closed[rows])
                break
            except ResultError as e:  # a singular pose
                if self.held is None:
                    raise
                rows = np.delete(rows, e.state)
        self.skipped = len(poses) - len(rows)
        return values


def reach_of(model: Calls, q: Array, fixed: Collection[str]) -> Reach:
    """q (nq): closed.  fixed: joints that stay; the drives that are left are searched."""
    if not model.loops:
        return Reach(model, q, None)
    held = held_by(model, "pose")
    stay = [j for j in moving_joints(model) if j.name in fixed and j not in held.joints]
    if stay:  # joints that follow are kept, and so fewer drives are free
        held = Held(model, determining(model, q, (*stay, *held.joints)))
    return Reach(model, q, held)
