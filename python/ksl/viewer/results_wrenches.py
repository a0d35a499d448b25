"""Wrenches of a table of `ksl loads` in a scene: those that the results hold, whatever the robot at hand would give."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ksl.base.errors import MotionError
from ksl.load_cases.case_files.results_model import DIFFERENT
from ksl.load_cases.results_table import JointWrench
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.requests import WORLD
from ksl.mechanism.states import Array, offset_in

if TYPE_CHECKING:
    from ksl.viewer.scene import Scene


def with_wrenches(scene: Scene, wrenches: dict[str, JointWrench], effort: dict[str, Array], compare: bool) -> tuple[Scene, list[str]]:
    """The scene with the wrenches and efforts of the table at its joints, and a note where the robot at hand gives others.

    wrenches, effort: of the scene's samples.  compare: False where the external wrenches are not known.  Raises MotionError where wrenches
    that the table doesn't hold would be those of another robot.
    """
    constraint, actuation, efforts = scene.constraint.copy(), scene.actuation.copy(), scene.effort.copy()
    largest = {"N": 0.0, "N m": 0.0}
    differ: list[tuple[float, str, str]] = []
    for i, joint in enumerate(scene.joints):
        if joint.name not in wrenches:
            continue
        given = wrenches[joint.name]
        total, carried = (_in_world(scene, i, x, given) for x in (given.total, given.constraint))
        for unit, part in (("N", slice(0, 3)), ("N m", slice(3, 6))):
            largest[unit] = max(largest[unit], float(np.abs(total[:, part]).max()))
            differ.append((float(np.abs(total[:, part] - (constraint + actuation)[:, i, part]).max()), unit, joint.name))
        constraint[:, i], actuation[:, i] = carried, total - carried
        if joint.name in effort and np.isfinite(effort[joint.name]).all():
            unit = "N m" if isinstance(joint, Joint) and joint.has_angle else "N"
            largest[unit] = max(largest[unit], float(np.abs(effort[joint.name]).max()))
            if np.isfinite(efforts[:, i]).all():
                differ.append((float(np.abs(efforts[:, i] - effort[joint.name]).max()), unit, joint.name))
            efforts[:, i] = effort[joint.name]
    shown = replace(scene, constraint=constraint, actuation=actuation, effort=efforts)
    missing = [joint.name for joint in scene.joints if joint.name not in wrenches]
    wrong = [(x / max(largest[unit], 1e-9), x, unit, name) for x, unit, name in differ if not x <= DIFFERENT * max(1e-9, largest[unit])]
    if not wrong or scene.unloaded or not (compare or missing):
        return shown, []
    _, x, unit, name = max(wrong)
    said = f"by up to {x:.3g} {unit} at {name}: robot file, payloads, stiffnesses or external wrenches have changed since"
    if missing:
        raise MotionError(
            f"the results hold no wrenches of {missing[0]}, and those of others differ from what this robot gives, {said}; run `ksl loads` again, with all joints"
        )
    return shown, [f"wrenches of the results, which are shown, differ from those that this robot would have, {said}"]


def _in_world(scene: Scene, i: int, wrench: Array, given: JointWrench) -> Array:
    """(n, 6): on the child, about the joint's origin, in world axes."""
    own = scene.frames[:, i]
    turn = _frame(scene, own, given.axes)[:, :3, :3]
    force, moment = (np.einsum("nab,nb->na", turn, wrench[:, part]) for part in (slice(0, 3), slice(3, 6)))
    moment = moment + np.cross(_point(scene, own, given.at) - own[:, :3, 3], force)
    both: Array = np.concatenate([force, moment], axis=1)
    return -both if given.on == "parent" else both


def _frame(scene: Scene, own: Array, name: str) -> Array:
    """(n, 4, 4): the frame whose axes a wrench is in, or at whose origin the point of its moment is."""
    if name == "joint":
        return own
    return np.broadcast_to(np.eye(4), own.shape) if name in ("world", WORLD) else np.asarray(scene.model.frame_poses(scene.q, [name])[:, 0])


def _point(scene: Scene, own: Array, at: str) -> Array:
    """(n, 3): the point that moments are about, in the world, m."""
    offset = offset_in(at)
    return np.asarray(_frame(scene, own, at)[:, :3, 3] if offset is None else own[:, :3, 3] + own[:, :3, :3] @ np.array(offset))
