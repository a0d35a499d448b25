"""The wrench of one joint in numbers, in the axes, about the point, on the side and of the part that the reader chooses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ksl.mechanism.mechanism import Joint, Loop
from ksl.mechanism.states import Array, Part, Side
from ksl.viewer.scene import Scene, sizes


@dataclass(frozen=True)
class OfLink:
    """The frame of a link, which may be called `world` or `joint`."""

    index: int
    """In `model.links`."""


@dataclass(frozen=True)
class Choice:
    """How a wrench is expressed; as in `Model.reactions`.  A point (3) is from the joint's origin, in its axes, m."""

    on: Side = "child"
    at: Literal["joint", "world"] | OfLink | tuple[float, float, float] = "joint"
    axes: Literal["joint", "world"] | OfLink = "joint"
    part: Part = "total"


def wrench_at(scene: Scene, sample: int, joint: str, choice: Choice) -> Array:
    """The wrench (6) through a joint in one state, force first; N, N m."""
    i = scene.joint_index(joint)
    constraint, actuation = scene.constraint[sample, i], scene.actuation[sample, i]
    follows, nothing = isinstance(of := scene.joints[i], Joint) and of.leader is not None, np.zeros(6)
    parts = {
        "total": constraint + actuation,
        "constraint": constraint,
        "actuation": nothing if follows else actuation,
        "coupling": actuation if follows else nothing,
    }
    wrench = parts[choice.part] * (-1 if choice.on == "parent" else 1)
    own = scene.frames[sample, i]
    force, moment = wrench[:3], wrench[3:]
    moment = moment + np.cross(own[:3, 3] - _point(scene, sample, own, choice), force)
    axes = own if choice.axes == "joint" else np.eye(4) if choice.axes == "world" else scene.poses[sample, choice.axes.index]
    both: Array = (np.stack([force, moment]) @ axes[:3, :3]).reshape(6)  # rows times R are Rᵀ times columns
    return both


def _point(scene: Scene, sample: int, own: Array, choice: Choice) -> Array:
    """The point (3) that moments are about, in the world; own: the joint's pose there."""
    if isinstance(choice.at, OfLink):
        return np.asarray(scene.poses[sample, choice.at.index, :3, 3])
    if isinstance(choice.at, tuple):
        return np.asarray(own[:3, 3] + own[:3, :3] @ np.array(choice.at))
    return np.asarray(own[:3, 3] if choice.at == "joint" else np.zeros(3))


def readout(scene: Scene, sample: int, joint: str, choice: Choice) -> str:
    """The wrench, and effort, speed, power and utilisation of the drive, as a table in Markdown."""
    if scene.unloaded:
        return "\n".join(["no wrenches in this state  ", *drive_lines(scene, sample, joint)])
    wrench = wrench_at(scene, sample, joint, choice)
    lines = ["| | x | y | z | size |", "|---|---:|---:|---:|---:|", _row("force, N", wrench[:3]), _row("moment, N m", wrench[3:])]
    return "\n".join(lines) + "\n\n" + "  \n".join([*_undetermined(scene, sample, joint), *drive_lines(scene, sample, joint)])


def _undetermined(scene: Scene, sample: int, joint: str) -> list[str]:
    """A line about components of the wrench that rigid bodies don't determine; nothing where they determine all."""
    if not scene.model.loops:
        return []
    unique = scene.model.reactions_unique(scene.q[sample], [joint])[0].reshape(2, 3)
    open_ones = [f"{what} {', '.join(c for c, known in zip('xyz', part) if not known)}" for what, part in zip(("force", "moment"), unique) if not part.all()]
    return [f"not determined by rigid bodies, in the joint's axes: {' and '.join(open_ones)}; of these the least norm is shown"] if open_ones else []


def drive_lines(scene: Scene, sample: int, name: str) -> list[str]:
    """Position, speed, effort, power and utilisation of a joint with one coordinate, a line each; nothing for others."""
    i = scene.joint_index(name)
    joint = scene.joints[i]
    if isinstance(joint, Loop) or not joint.one_coordinate:
        return []
    position, speed = float(scene.model.position_of(joint, scene.q[sample])), float(scene.model.velocity_of(joint, scene.v[sample]))
    lines = [f"position {position:.5g} {joint.unit}, speed {speed:.4g} {joint.unit}/s"]
    effort, limit, unit = scene.effort[sample, i], scene.limits[i], "N m" if joint.has_angle else "N"
    if np.isfinite(effort):
        lines.append(f"**effort {effort:.5g} {unit}**, power {effort * speed:.4g} W")
        share = f"{scene.utilisation[sample, i]:.1%} of the limit {limit:.5g} {unit}" if np.isfinite(limit) else "the file gives no limit of the effort"
        lines.append(f"utilisation: {share}")
    return lines


def _row(name: str, x: Sequence[float] | Array) -> str:
    return f"| {name} | " + " | ".join(f"{value:.4g}" for value in (*x, float(sizes(np.asarray(x))))) + " |"
