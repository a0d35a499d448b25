"""All directions in which the joints of a mechanism give way about a pose, and what they do to its links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ksl.mechanism.calls import Calls
from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.states import Array
from ksl.mechanism.stiffness import Flexibility
from ksl.small_motions.giving_way import GivingWay, coefficients, giving_way, motion_at


def floats(joint: Joint) -> bool:
    """Whether a joint holds nothing: the base of a robot that floats."""
    return joint.kind == "floating"


def has_motor(model: Calls, joint: Joint) -> bool:
    """Whether something holds a joint: all of a tree have motors, of other mechanisms the drives."""
    if model.drives is not None:
        return joint.name in model.drives
    return not model.loops and not floats(joint)


@dataclass(frozen=True)
class Directions:
    """Directions of joints, `d` of them: those in which they give way, and those in which mimic joints follow.  World axes."""

    pose: Array
    """(links, 4, 4)."""
    joint: NDArray[np.intp]
    """(d) Indices of their joints."""
    column: Array
    """(6, d): displacements of the joints, in the axes of their frames."""
    linear: Array
    """(d, 3): of the child's origin."""
    angular: Array
    """(d, 3)."""
    origin: Array
    """(d, 3): the children's origins."""
    moves: NDArray[np.bool_]
    """(links, d), whether a direction moves a link."""
    before: NDArray[np.bool_]
    """(d, d), whether the first's joint carries the second's."""
    beside: NDArray[np.bool_]
    """(d, d), whether both are of one joint."""
    first_axis: NDArray[np.bool_]
    """(d), whether it turns about the first axis of a universal joint, and another one about the second."""
    factors: Array
    """(d, n): of the directions, from the independent displacements."""
    own_stiffness: Array
    """(n, n), that the joints are given, for their own displacements among the independent ones."""
    springs: dict[str, Array]
    """{joint: (1, n)}, roots of the springs of the physics; those of mimic joints are stretched by what the leaders do, too."""
    pull: Array
    """(n), gradient of the energy of these springs at the pose: their rest is known, and so is their load."""
    owner: NDArray[np.intp]
    """(n) Indices of the joints that give way."""
    along: NDArray[np.bool_]
    """(n), whether that is along the joint's motion."""
    driven: NDArray[np.bool_]
    """(n), whether a motor holds it."""
    coordinate_rows: dict[str, Array]
    """{joint: (nv of the joint, d)}, its own coordinates."""

    @cached_property
    def stiffness(self) -> Array:
        """(n, n), of the joints, for the independent displacements."""
        return self.own_stiffness + sum((row.T @ row for row in self.springs.values()), np.zeros_like(self.own_stiffness))

    def of_point(self, link: int, point: Array) -> Array:
        """(d, 3): velocities of a point (3) of a link."""
        out: Array = self.moves[link][:, None] * (self.linear + np.cross(self.angular, point - self.origin))
        return out

    @cached_property
    def twists(self) -> Array:
        """(links, 6, d): of links at their origins in their axes, linear first."""
        R, p = self.pose[:, :3, :3], self.pose[:, :3, 3]
        moved = self.linear + np.cross(self.angular, p[:, None] - self.origin)
        both = np.concatenate([np.einsum("lji,ldj->lid", R, moved), np.einsum("lji,dj->lid", R, self.angular)], axis=1)
        out: Array = both * self.moves[:, None]
        return out


def directions_of(model: Calls, q: Array, flexible: Mapping[str, Flexibility]) -> Directions:
    """The directions about the pose q (nq)."""
    pose = np.asarray(model.frame_poses(q, [f"link:{name}" for name in model.link_names]))
    index = {name: i for i, name in enumerate(model.link_names)}
    carriers = {joint.child: i for i, joint in enumerate(model.joints)}
    ways: list[GivingWay] = []
    motions: list[Array] = []
    for joint in model.joints:
        first_axis = np.asarray(model.jacobian(q, f"link:{joint.child}"))[3:, joint.v_index] if KINDS[joint.kind].has_axis2 else np.zeros(3)
        motions.append(motion_at(joint, first_axis))
        free = joint.leader is None and not has_motor(model, joint)
        ways.append(giving_way(joint, motions[-1], flexible.get(joint.name), free))
    return _assembled(model, q, pose, index, carriers, ways, motions)


def spring_load(model: Calls, joint: Joint, q: Array) -> float:
    """What the spring of the physics at a joint takes of a motor's effort, N m or N."""
    spring = _spring(model, joint)
    return spring * (float(model.position_of(joint, q)) - joint.spring_rest) if spring else 0.0


def _spring(model: Calls, joint: Joint) -> float:
    return joint.spring_stiffness if "spring" in model.physics and joint.one_coordinate else 0.0


def _assembled(
    model: Calls, q: Array, pose: Array, index: Mapping[str, int], carriers: Mapping[str, int], ways: list[GivingWay], motions: list[Array]
) -> Directions:
    n = [way.directions.shape[1] for way in ways]
    start = np.concatenate([[0], np.cumsum(n)]).astype(int)
    columns, owners, factors = [way.directions for way in ways], [np.full(size, i) for i, size in enumerate(n)], [np.eye(start[-1])]
    springs: dict[str, Array] = {}
    pull = np.zeros(start[-1])
    by_name = {joint.name: i for i, joint in enumerate(model.joints)}
    for i, joint in enumerate(model.joints):
        row = np.zeros((1, start[-1]))
        if joint.leader is not None:
            leader = by_name[joint.leader]
            row[:, start[leader] : start[leader + 1]] = joint.multiplier * coefficients(model.joints[leader], motions[leader]) @ ways[leader].directions
            if row.any():
                columns.append(motions[i])
                owners.append(np.array([i]))
                factors.append(row.copy())
        spring = _spring(model, joint)
        if spring and (row.any() or ways[i].along.any()):
            row[:, start[i] : start[i + 1]] += coefficients(joint, motions[i]) @ ways[i].directions
            springs[joint.name] = np.sqrt(spring) * row
            pull += spring_load(model, joint, q) * row[0]
    column, joint_of = np.hstack(columns), np.concatenate(owners).astype(int)
    child = [index[model.joints[i].child] for i in joint_of]
    R = pose[child, :3, :3].reshape(-1, 3, 3)
    carried = _carried(model, index, carriers)
    return Directions(
        pose, joint_of, column,
        linear=np.einsum("dij,jd->di", R, column[:3]),
        angular=np.einsum("dij,jd->di", R, column[3:]),
        origin=pose[child, :3, 3].reshape(-1, 3),
        moves=carried[:, joint_of],
        before=carried[child][:, joint_of].T & (joint_of[:, None] != joint_of[None]),
        beside=joint_of[:, None] == joint_of[None],
        first_axis=_first_axes(model, column, joint_of, motions),
        factors=np.vstack(factors),
        own_stiffness=_stiffness(ways, start),
        springs=springs,
        pull=pull,
        owner=np.concatenate(owners[: len(ways)]).astype(int),
        along=np.concatenate([way.along for way in ways]).astype(bool),
        driven=np.concatenate([way.along if has_motor(model, joint) else np.zeros_like(way.along) for way, joint in zip(ways, model.joints)]).astype(bool),
        coordinate_rows={joint.name: coefficients(joint, motions[i]) @ column * (joint_of == i) for i, joint in enumerate(model.joints) if motions[i].shape[1]},
    )  # fmt: skip


def _carried(model: Calls, index: Mapping[str, int], carriers: Mapping[str, int]) -> NDArray[np.bool_]:
    """(links, joints), whether a joint carries a link."""
    carried = np.zeros((len(index), len(model.joints)), dtype=bool)
    for name, i in index.items():  # parents first
        joint = carriers[name]
        parent = model.joints[joint].parent
        if parent is not None:
            carried[i] = carried[index[parent]]
        carried[i, joint] = True
    return carried


def _stiffness(ways: list[GivingWay], start: Array) -> Array:
    K = np.zeros((start[-1], start[-1]))
    for way, begin, end in zip(ways, start[:-1], start[1:]):
        K[begin:end, begin:end] = way.stiffness
    return K


def _first_axes(model: Calls, column: Array, joint_of: Array, motions: list[Array]) -> NDArray[np.bool_]:
    """A universal joint turns about its first axis before the second; other turns of a joint add up."""
    found = np.zeros(len(joint_of), dtype=bool)
    for i, joint in enumerate(model.joints):
        own = np.flatnonzero(joint_of == i)
        if KINDS[joint.kind].has_axis2 and np.array_equal(column[:, own[:2]], motions[i]):
            found[own[0]] = True
    return found


def cross(v: Array) -> Array:
    """(3, 3): the matrix of v ×."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
