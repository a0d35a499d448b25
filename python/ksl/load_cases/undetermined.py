"""Which components of reactions rigid bodies leave open along a motion of a closed mechanism.

A pattern of wrenches that balances itself may be added to the reactions without a change that can be observed.  A component in which a
pattern has a share is not determined: its value is the one of least norm, or by stiffnesses where the model has some that decide.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from ksl.load_cases.placement import Placement
from ksl.load_cases.quantities import UNDETERMINED
from ksl.load_cases.reaction_joints import LoopJoint, frame_on_successor, reaction_joints
from ksl.mechanism.joint_kinds import has_one_coordinate
from ksl.mechanism.calls import Calls
from ksl.mechanism.loops import least_open
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.requests import WORLD
from ksl.mechanism.stiffness import compliances_of, rigid_beside
from ksl.mechanism.states import Array

SAMPLES = 200
"""So many samples of a motion are looked at, at most, in equal steps: which components are open changes at singular positions alone."""
NAMES = ("fx", "fy", "fz", "tx", "ty", "tz")
MARK = "*"
"""Behind numbers that use a component that is not determined."""
FOOTNOTE = f"{MARK} not determined by rigid bodies: the value of least norm"
WAY_OUT = "Stiffnesses of joints decide it: --stiffness, Model.with_stiffness; a spherical joint in place of one that turns leaves less open"
NOT_JUDGED = "not judged: needs stiffnesses of joints"


def footnote(model: Mechanism) -> str:
    """What a marked number is: of least norm, or with some stiffnesses one that these leave open, too."""
    return f"{MARK} not determined by rigid bodies and the stiffnesses that are given: one of the possible values" if compliances_of(model) else FOOTNOTE


def way_out(model: Mechanism) -> str:
    """What would determine such numbers."""
    if not compliances_of(model):
        return WAY_OUT
    rigid = rigid_beside(model)
    return f"Stiffnesses of {', '.join(rigid)} are missing" if rigid else "Finite stiffnesses decide it where infinite ones are given"


def stiffness_note(model: Mechanism) -> list[str]:
    """Says that joints are taken to be rigid beside others that give way."""
    rigid = rigid_beside(model)
    return [f"{', '.join(rigid)}: without stiffness, and therefore rigid; they take what the other joints of the loops would share"] if rigid else []


def is_open(row: Mapping[str, object], quantity: str) -> bool:
    """Whether a number of a row of the summary uses a component that is not determined."""
    return quantity in str(row.get(UNDETERMINED, "")).split()


@dataclass(frozen=True)
class Undetermined:
    """By joint, what is not determined at some sample.  Joints of which all is determined are not there."""

    components: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Among fx … tz, as the placement expresses them."""
    quantities: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Among axial_force, radial_force, bending_moment, axial_moment, force and moment."""

    def of(self, joint: str) -> tuple[str, ...]:
        return self.quantities.get(joint, ())


def undetermined(model: Calls, q: Array, placement: Placement) -> Undetermined:
    """Along positions q (n, nq) of a closed mechanism."""
    joints = reaction_joints(model)
    open_components = np.zeros((len(joints), 6), dtype=bool)
    open_quantities: dict[str, set[str]] = {}
    least = least_open(model)
    for position in q[np.unique(np.linspace(0, len(q) - 1, min(len(q), SAMPLES)).astype(int))]:
        patterns = model.reactions_null_basis(position, [j.name for j in joints])
        if not len(patterns):
            continue
        for i, (joint, turned) in enumerate(zip(joints, _placed(model, position, joints, patterns, placement), strict=True)):
            in_joint_axes, expressed = turned
            open_components[i] |= (np.abs(expressed) > least).any(axis=0)
            open_quantities.setdefault(joint.name, set()).update(_quantities(joint, in_joint_axes, least))
    components = {j.name: tuple(n for n, is_open in zip(NAMES, row, strict=True) if is_open) for j, row in zip(joints, open_components, strict=True)}
    return Undetermined({j: names for j, names in components.items() if names}, {j: tuple(sorted(names)) for j, names in open_quantities.items() if names})


def _placed(model: Calls, q: Array, joints: tuple[Joint, ...], patterns: Array, p: Placement) -> list[tuple[Array, Array]]:
    """For each joint its patterns (k, 6) about the placement's point: in the joint's axes, and in those of the placement."""
    poses = model.frame_poses(q, [f"link:{j.child}" for j in joints])
    found = []
    for i, joint in enumerate(joints):
        own = poses[i] @ frame_on_successor(joint.loop) if isinstance(joint, LoopJoint) and joint.loop else poses[i]
        R, at = own[:3, :3], p.points.get(joint.name, p.at)
        point = np.zeros(3) if isinstance(at, str) and at == "joint" else _point(model, q, at, own)
        force = patterns[:, i, :3]
        moment = patterns[:, i, 3:] - np.cross(point, force)
        turn = np.eye(3) if p.axes == "joint" else _axes(model, q, p.axes).T @ R
        found.append((np.hstack([force, moment]), np.hstack([force @ turn.T, moment @ turn.T])))
    return found


def _point(model: Calls, q: Array, at: object, own: Array) -> Array:
    """The point in the joint's axes, from its origin, m."""
    if not isinstance(at, str):
        return np.asarray(at, dtype=float)
    origin = np.zeros(3) if at in ("world", WORLD) else model.frame_pose(q, at)[:3, 3]
    return np.asarray(own[:3, :3].T @ (origin - own[:3, 3]))


def _axes(model: Calls, q: Array, axes: str) -> Array:
    return np.eye(3) if axes in ("world", WORLD) else model.frame_pose(q, axes)[:3, :3]


def _quantities(joint: Joint, patterns: Array, least: float) -> Collection[str]:
    force, moment = patterns[:, :3], patterns[:, 3:]

    def share(x: Array) -> bool:
        return bool((np.abs(x) > least).any())

    if not has_one_coordinate(joint.kind):
        found = {"force": share(force), "moment": share(moment)}
    else:
        axis = np.array(joint.axis)
        along, about = force @ axis, moment @ axis
        found = {"axial_force": share(along), "radial_force": share(force - along[:, None] * axis)}
        found |= {"axial_moment": share(about), "bending_moment": share(moment - about[:, None] * axis)}
    return [name for name, is_open in found.items() if is_open]
