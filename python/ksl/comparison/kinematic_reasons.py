"""Why poses and Jacobians differ: the joints where they part, and other frames."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from ksl.comparison.coordinates import Array
from ksl.comparison.differences import JACOBIANS, ORIENTATIONS, POSITIONS, close, largest
from ksl.comparison.other_robot import Numbers, OtherRobot, States, numbers_of_ksl
from ksl.comparison.results import Note
from ksl.model.model import Model

QUATERNION = "the numbers are those of a quaternion that is read w x y z and given x y z w"
SHOWN = 5
"""Names that a sentence has at most."""


def kinematic_reasons(other: OtherRobot, states: States, ksl: Numbers, numbers: Numbers, differing: list[str]) -> list[Note]:
    """One note for each way in which frames differ.  Where poses differ, what follows from them is not looked into."""
    of_poses = tuple(name for name in (POSITIONS, ORIENTATIONS) if name in differing)
    if of_poses:
        return list(_of_poses(other.model, states, ksl, numbers, of_poses))
    return _of_jacobians(ksl, numbers) if JACOBIANS in differing else []


def _of_poses(model: Model, states: States, ksl: Numbers, numbers: Numbers, names: tuple[str, ...]) -> Iterator[Note]:
    turned = numbers_of_ksl(model, with_other_quaternions(model, states), list(numbers.poses)).poses
    if all(close(numbers.poses[link], pose, _lengths(ksl)) for link, pose in turned.items()):
        yield Note("quaternion", QUATERNION, names)
        return
    transposed = {link: _with(pose, R=np.swapaxes(pose[:, :3, :3], 1, 2)) for link, pose in numbers.poses.items()}
    if names == (ORIENTATIONS,) and all(close(transposed[link], pose, 1.0) for link, pose in ksl.poses.items()):
        yield Note("frame", "its rotation matrices lead from the world to the link: they are the transposes", names)
        return
    groups: dict[tuple[str, bool], list[str]] = {}
    for link, ours, theirs in _across_joints(model, ksl, numbers):
        if not close(theirs, ours, _lengths(ksl)):
            groups.setdefault(_in_words(model, states, link, ours, theirs), []).append(f"{model.joint_above(link).name} (link {link})")
    for (text, explains), places in groups.items():
        shown = f"{', '.join(places[:SHOWN])}{f' and {len(places) - SHOWN} more' if len(places) > SHOWN else ''}"
        yield Note("joint placement", f"{text}: {shown}", names if explains else ())


def with_other_quaternions(model: Model, states: States) -> States:
    """Positions whose quaternions are read as w x y z."""
    q = states.q.copy()
    for name in model.joint_names:
        joint = model.joint(name)
        if joint.quaternion is not None:
            i = joint.q_index + joint.quaternion
            q[:, i : i + 4] = q[:, [i + 1, i + 2, i + 3, i]]
    return states._replace(q=q)


def _with(pose: Array, R: Array) -> Array:
    changed = pose.copy()
    changed[:, :3, :3] = R
    return changed


def _lengths(ksl: Numbers) -> Array:
    """What poses (4, 4) are compared with: lengths with the reach of the robot."""
    scale = np.ones((4, 4))
    scale[:, 3] = max(largest(pose[:, :3, 3]) for pose in ksl.poses.values()) or 1.0
    return scale


def _across_joints(model: Model, ksl: Numbers, numbers: Numbers) -> Iterator[tuple[str, Array, Array]]:
    """Poses of each link in the next one towards the root that both have: only where these differ do the libraries part.  O(links)."""
    above: dict[str, str | None] = {}
    parent = {joint.child: joint.parent for joint in model.joints}
    for link in ksl.poses:
        chain, at = [], parent[link]
        while at is not None and at not in ksl.poses and at not in above:
            chain.append(at)
            at = parent[at]
        found = above[at] if at is not None and at in above else at
        above.update(dict.fromkeys(chain, found))
        if found is None:
            yield link, ksl.poses[link], numbers.poses[link]
        else:
            ours, theirs = (np.linalg.solve(x.poses[found], x.poses[link]) for x in (ksl, numbers))
            yield link, ours, theirs


def _in_words(model: Model, states: States, link: str, ours: Array, theirs: Array) -> tuple[str, bool]:
    """What an offset of a link is, in the same words where several have the same; and whether that explains all that differs."""
    joint, scale = model.joint_above(link), 1.0
    after, before = np.linalg.solve(ours, theirs), theirs @ np.linalg.inv(ours)
    for offset, where in ((after, "in the link's axes"), (before, "in the parent's axes")):
        if close(offset, np.broadcast_to(offset[0], offset.shape), scale):
            return f"frames are apart by {_motion(offset[0])} {where}, at every position", True
    if joint.nv == 1:
        q = states.q.copy()
        q[:, joint.q_index] *= -1.0
        poses = model.frame_poses(q, [f"link:{joint.parent}", f"link:{link}"]) if joint.parent else None
        if poses is not None and close(np.linalg.solve(poses[:, 0], poses[:, 1]), theirs, scale):
            return "the axis points the other way", True
    return "frames are apart by what is not constant: another axis, or another number of the joint", False


def _motion(X: Array) -> str:
    """A rigid motion in words."""
    R = X[:3, :3]
    sine = np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])  # by the cosine alone rounding would be an angle of 1e-8
    angle = float(np.arctan2(sine, np.trace(R) - 1.0))
    words = [f"{angle:.4g} rad"] if angle > 1e-9 else []
    if largest(X[:3, 3]) > 1e-9:
        words.append(f"({', '.join(f'{np.round(x, 12) + 0.0:.4g}' for x in X[:3, 3])}) m")
    return " and ".join(words) or "nothing"


def _of_jacobians(ksl: Numbers, numbers: Numbers) -> list[Note]:
    """Which other frame or order gives the other library's Jacobians of all links."""
    scale = max(largest(J) for J in ksl.jacobians.values()) or 1.0
    for swapped, world_axes, world_point in product((False, True), repeat=3):
        if (swapped or world_axes or world_point) and all(
            close(numbers.jacobians[link], _seen(J, ksl.poses[link], swapped, world_axes, world_point), scale) for link, J in ksl.jacobians.items()
        ):
            notes = [Note("order", "its Jacobians are angular first", (JACOBIANS,))] if swapped else []
            where = [text for text, is_so in (("in world axes", world_axes), ("about the world's origin", world_point)) if is_so]
            return (
                [*notes, Note("frame", f"its Jacobians are {' and '.join(where)}; KSL's in the link's axes, about its origin", (JACOBIANS,))]
                if where
                else notes
            )
    return []


def _seen(J: Array, pose: Array, swapped: bool, world_axes: bool, world_point: bool) -> Array:
    """A Jacobian (n, 6, nv) of a link in its own axes, about another point, in other axes, in the other order."""
    R, t = pose[:, :3, :3], pose[:, None, :3, 3]
    linear, angular = R @ J[:, :3], R @ J[:, 3:]
    if world_point:
        linear = linear - np.swapaxes(np.cross(np.swapaxes(angular, 1, 2), t), 1, 2)
    if not world_axes:
        linear, angular = np.swapaxes(R, 1, 2) @ linear, np.swapaxes(R, 1, 2) @ angular
    return np.concatenate([angular, linear] if swapped else [linear, angular], axis=1)
