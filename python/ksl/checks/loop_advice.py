"""Which joints of other kinds would make a mechanism with redundant constraints one without, and move as before.

The patterns of wrenches that nothing determines say it.  A joint that lets go of some components of its wrench leaves the patterns without
these.  As many patterns vanish as the components have rank in them, and each other component that it lets go of is a new freedom.  Thus the
advice doesn't depend on which joint closes the loop.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.mechanism import Joint, Loop
from ksl.model.model import Model
from ksl.mechanism.states import Array

TOLERANCE = 1e-7
"""Components of patterns, which have the norm 1, that are smaller are zero."""


@dataclass(frozen=True)
class Change:
    """A joint that becomes one of another kind."""

    joint: str
    kind: str
    fewer: int
    """So many constraints fewer, all of them redundant ones."""
    second_axis: tuple[float, float, float] | None = None
    """The second axis of a universal joint, in the joint's frame."""


@dataclass(frozen=True)
class Advice:
    changes: tuple[Change, ...]
    left: int
    """How many constraints stay redundant."""


@dataclass(frozen=True)
class Group:
    """Joints that share patterns, which others don't."""

    joints: list[Joint | Loop]
    patterns: Array
    """(redundant, joints, 6): orthonormal."""


def groups(patterns: Array, joints: list[Joint | Loop]) -> list[Group]:
    """The joints that have patterns, in groups of those whose wrenches depend on each other: one for each loop that shares no joint with others.

    patterns (redundant, joints, 6): orthonormal.
    """
    sizes = np.linalg.norm(np.einsum("rjc,rkd->jkcd", patterns, patterns), axis=(2, 3))  # of the projector, whose blocks no choice of a basis mixes
    waiting = {i for i in range(len(joints)) if sizes[i, i] > TOLERANCE**2}
    found = []
    while waiting:
        group, new = set[int](), {min(waiting)}
        while new:
            group |= new
            waiting -= new
            new = {j for j in waiting if any(sizes[i, j] > TOLERANCE for i in new)}
        members = sorted(group)
        part = patterns[:, members].reshape(len(patterns), -1)
        _, weights, basis = np.linalg.svd(part, full_matrices=False)
        kept = basis[: int(np.count_nonzero(weights > 0.5))]  # each is 0 or 1, since no pattern of theirs reaches other joints
        found.append(Group([joints[i] for i in members], kept.reshape(len(kept), len(members), 6)))
    return found


def is_across_a_plane(patterns: Array, axes: list[Array]) -> bool:
    """Whether patterns (redundant, joints, 6) are nothing but forces along one direction of the world and moments across it.

    Those of a planar linkage are, and need parallel axes alone.  Patterns in the plane need lengths that agree, too.
    axes: of each joint (3, 3) in the world.
    """
    in_world = np.array([[R @ wrench.reshape(2, 3).T for R, wrench in zip(axes, pattern, strict=True)] for pattern in patterns])
    forces, moments = in_world[..., 0].reshape(-1, 3), in_world[..., 1].reshape(-1, 3)
    _, sizes, directions = np.linalg.svd(forces)
    normal = directions[0]
    if sizes[0] < TOLERANCE:
        _, sizes, directions = np.linalg.svd(moments)
        normal = directions[2]
    return bool(max(np.abs(_across(forces, normal)).max(), np.abs(moments @ normal).max()) < TOLERANCE)


def turn_about_one_direction(joints: list[Joint | Loop], axes: list[Array]) -> bool:
    """Whether the axes of joints that turn about one are parallel.  A loop with one pattern has one force in all its joints, planar or not.

    axes: of each joint (3, 3) in the world.
    """
    turning = np.array([R @ np.asarray(joint.axis) for joint, R in zip(joints, axes, strict=True) if KINDS[joint.kind].has_axis and joint.kind != "prismatic"])
    return len(turning) == 0 or bool(np.abs(np.cross(turning, turning[0])).max() < TOLERANCE)


def advice(model: Model, patterns: Array, joints: list[Joint | Loop]) -> Advice:
    """Changes of kind one after the other, each the one that removes most; where several do, loop joints first, and those of the ground last.

    One joint of each loop becomes spherical at most if that is enough, since a linkage is built with one spherical and one cylindrical joint in each.
    patterns (redundant, joints, 6): of :meth:`Model.reactions_null_basis`, of these joints.  Joints with a motor stay as they are.
    """
    loops = sum(isinstance(joint, Loop) for joint in joints)
    found = _advice(model, patterns, joints, loops)
    return found if not found.left else min(found, _advice(model, patterns, joints, len(joints)), key=lambda a: a.left)


def _advice(model: Model, patterns: Array, joints: list[Joint | Loop], spherical: int) -> Advice:
    """spherical: so many joints may become it."""
    driven = set(model.drives or ())
    free = [(i, joint) for i, joint in enumerate(joints) if joint.name not in driven]
    ground = model.link_names[0]  # its joints are those of cranks, which motors turn
    free.sort(key=lambda item: 0 if isinstance(item[1], Loop) else 2 if item[1].parent == ground else 1)  # stable
    changes: list[Change] = []
    while len(patterns) and (best := _best(patterns, free, {change.joint for change in changes}, spherical > 0)):
        change, released = best
        changes.append(change)
        spherical -= change.kind == "spherical"
        patterns = _without(patterns, released)
    return Advice(tuple(changes), len(patterns))


def _best(patterns: Array, joints: list[tuple[int, Joint | Loop]], changed: set[str], spherical: bool) -> tuple[Change, Array] | None:
    found: tuple[Change, Array] | None = None
    for i, joint in joints:
        for kind, components, axis2 in () if joint.name in changed else _other_kinds(joint, patterns[:, i]):
            if kind == "spherical" and not spherical:
                continue
            fewer = KINDS[kind].nv - KINDS[joint.kind].nv
            released = patterns[:, i] @ components.T
            if np.linalg.matrix_rank(released, tol=TOLERANCE) == fewer and (found is None or fewer > found[0].fewer):
                found = Change(joint.name, kind, fewer, axis2), released
    return found


def _other_kinds(joint: Joint | Loop, wrenches: Array) -> Iterator[tuple[str, Array, tuple[float, float, float] | None]]:
    """Kinds that let a joint move as it does and besides, with components (n, 6) that contain those which they then let go of."""
    forces, moments = np.eye(6)[:3], np.eye(6)[3:]
    if joint.kind in ("revolute", "continuous", "universal", "fixed"):
        yield "spherical", moments, None
    if joint.kind in ("prismatic", "fixed"):
        yield "translation", forces, None
    if joint.kind in ("revolute", "continuous", "prismatic", "helical") and joint.axis is not None:
        along = np.array(joint.axis)
        yield "cylindrical", np.concatenate([along @ forces, along @ moments]).reshape(2, 6), None
    if joint.kind in ("revolute", "continuous") and joint.axis is not None and len(wrenches):
        _, sizes, directions = np.linalg.svd(_across(wrenches[:, 3:], joint.axis))
        if sizes[0] > TOLERANCE:
            yield "universal", (directions[0] @ moments)[None], _rounded(directions[0])


def _across(vectors: Array, axis: Array | Sequence[float]) -> Array:
    return vectors - np.outer(vectors @ np.array(axis), axis)


def _rounded(direction: Array) -> tuple[float, float, float]:
    sign = -1.0 if direction[np.argmax(abs(direction))] < 0 else 1.0
    x, y, z = (float(c) + 0.0 for c in np.round(sign * direction, 6))
    return x, y, z


def _without(patterns: Array, released: Array) -> Array:
    """An orthonormal basis of the patterns that are left where the released components are zero."""
    left, sizes, _ = np.linalg.svd(released)
    rank = int(np.count_nonzero(sizes > TOLERANCE))
    kept: Array = np.einsum("rk,rjc->kjc", left[:, rank:], patterns)
    return kept


def components(joint: Joint | Loop, wrenches: Array) -> str:
    """Which components of a joint's wrench are not zero in patterns (n, 6): `force along the axis, moment across it`."""
    words = []
    for what, part in (("force", wrenches[:, :3]), ("moment", wrenches[:, 3:])):
        if joint.axis is not None and KINDS[joint.kind].has_axis:
            along, across = part @ np.array(joint.axis), _across(part, joint.axis)
            sides = [side for side, x in (("along", along), ("across", across)) if np.abs(x).max(initial=0.0) > TOLERANCE]
            words += [f"{what} {' and '.join(sides)} the axis"] if sides else []
        else:
            axes = [c for c, x in zip("xyz", part.T) if np.abs(x).max(initial=0.0) > TOLERANCE]
            words += [f"{what} {', '.join(axes)}"] if axes else []
    return ", ".join(words)
