"""The part of a mechanism that moves some joints: the coordinates that loops connect, and the motors among them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ksl.base.words import listed
from ksl.mechanism.calls import Calls
from ksl.mechanism.given import names as names_given
from ksl.mechanism.mechanism import Joint, Loop, Mechanism
from ksl.mechanism.stiffness import ways_of


@dataclass(frozen=True)
class Part:
    """Coordinates of v, as indices, of a mechanism or of several side by side."""

    joints: tuple[str, ...]
    """The joints that were asked for, in this order."""
    motors: tuple[str, ...]
    """The drives that move them, in the order of the model's drives."""
    followers: tuple[str, ...]
    """The other joints of the mechanism."""
    loops: tuple[Loop, ...]
    of_joints: list[int]
    of_motors: list[int]
    all: list[int]
    """Ascending."""

    def without(self, some: Sequence[int]) -> list[int]:
        return [i for i in self.all if i not in some]


def part_of(m: Calls, joints: Iterable[str]) -> Part:
    """The part that moves these joints.  Raises ValueError for what is no joint, and for joints that no motor moves."""
    named = [_joint(m, name) for name in names_given(joints, "joints")]
    if not named:
        raise ValueError("joints=[]; expected the names of the joints that motors move, as ['ankle_pitch', 'ankle_roll']")
    if twice := next((joint.name for i, joint in enumerate(named) if joint in named[:i]), None):
        raise ValueError(f"joints: {twice!r} is named twice; name each joint once")
    groups = _connected(m)
    chosen = {group: None for joint in named for group in [groups[joint.v_index]]}
    coordinates = [i for i in range(m.nv) if groups[i] in chosen]
    within = [joint for joint in m.joints if joint.nv and joint.v_index in coordinates]
    drives = [joint.name for joint in named if not _in_loop(m, joint)] if m.drives is None else m.drives
    if m.drives is None and any(_in_loop(m, joint) for joint in named):
        raise ValueError(f"joints: no motors of {m.name or m.file} are known; name them, as drives= of ksl.load or by m.with_drives([…])")
    for joint in named:
        if not any(other.name in drives and groups[other.v_index] == groups[joint.v_index] for other in within):
            where = "that lie in its loops" if _in_loop(m, joint) else "and it lies in no loop, so that it would have to be its own"
            raise ValueError(
                f"joint {joint.name!r}: no motor moves it: none of the drives, {listed(drives) or 'of which there are none'}, is among the joints {where}; add the drive"
            )
    motors = [m.joint(name) for name in drives if m.joint(name) in within]
    others = [joint.name for joint in within if joint not in named and joint not in motors]
    ways = {loop.name: ways_of(m, loop) for loop in m.loops}
    loops = tuple(loop for loop in m.loops if {i for name in (*ways[loop.name][0], *ways[loop.name][1]) for i in _coordinates(m, name)} & set(coordinates))
    return Part(
        tuple(joint.name for joint in named), tuple(joint.name for joint in motors), tuple(others), loops,
        [i for joint in named for i in _coordinates(m, joint.name)], [i for joint in motors for i in _coordinates(m, joint.name)], coordinates,
    )  # fmt: skip


def require_enough(m: Calls, part: Part, freedoms: int, shared: bool) -> None:
    """Refuses joints and motors that are not as many as the freedoms of the mechanism, and names those that are missing."""
    named, moving = len(part.of_joints), len(part.of_motors)
    if moving < freedoms:
        raise ValueError(
            f"the motors, {listed(part.motors)}, leave a freedom of the mechanism, which has {freedoms}; name the drives that it has, by m.with_drives([…])"
        )
    if named > min(moving, freedoms):
        if moving > freedoms:
            raise ValueError(f"joints: {listed(part.joints)} have {named} coordinates, and the mechanism has {freedoms} freedoms; name {freedoms}")
        said = f"{listed(part.joints)} have {named} coordinates, and the motors that move them, {listed(part.motors)}, are {moving}"
        raise ValueError(f"joints: more joints than motors: {said}; name {moving}")
    if named < freedoms:
        missing = [name for name in outputs(m, part) if name not in part.joints] or list(part.followers)
        raise ValueError(
            f"joints: {listed(part.motors)} move {listed(missing)} as well as {listed(part.joints)}; name them, too: [{', '.join(map(repr, (*part.joints, *missing)))}]"
        )
    if moving > freedoms and not shared:
        said = f"{listed(part.motors)} are {moving} motors of {freedoms} freedoms, so that many efforts give the same motion"
        raise ValueError(f"joints: {said}; say with m.with_drives([…]) which of them move it, or with sharing= how all of them share the efforts")


def outputs(m: Mechanism, part: Part) -> list[str]:
    """The joints that motors move by rods: of the ways of loops those without a motor; all that have no motor where each way has one."""
    found: dict[str, None] = {}
    for loop in part.loops:
        for way in ways_of(m, loop):
            if not set(way) & set(part.motors):
                found.update(dict.fromkeys(name for name in way if m.joint(name).nv))
    return list(found)


def driven_outputs(m: Mechanism) -> list[list[str]]:
    """For each mechanism of loops with drives the joints that these move by rods, where they are as many as the drives and have one coordinate each."""
    groups, found = _connected(m), []
    for group in dict.fromkeys(groups):
        loops = tuple(loop for loop in m.loops if any(groups[i] == group for name in ways_of(m, loop)[0] + ways_of(m, loop)[1] for i in _coordinates(m, name)))
        motors = tuple(name for name in m.drives or () if m.joint(name).nv and groups[m.joint(name).v_index] == group)
        part = Part((), motors, (), loops, [], [], [])
        joints = outputs(m, part)
        if loops and motors and len(joints) == len(motors) and all(m.joint(name).one_coordinate for name in joints):
            found.append(joints)
    return found


def _joint(m: Calls, name: str) -> Joint:
    joint = m.joint(name)
    if joint.nv == 0:
        said = f"follows {joint.leader!r}; name that one" if joint.leader else "is fixed, and nothing moves it; name joints that move"
        raise ValueError(f"joints: {name!r} {said}")
    if joint.quaternion is not None:
        raise ValueError(
            f"joints: {name!r} is {joint.kind}, and its position is a quaternion; describe it by hinges about crossing axes, whose positions are numbers"
        )
    return joint


def _coordinates(m: Mechanism, name: str) -> list[int]:
    """The coordinates by which a joint of the tree moves: its leader's if it follows one."""
    joint = m.joint(name)
    of = m.joint(joint.leader) if joint.leader else joint
    return list(range(of.v_index, of.v_index + of.nv))


def _in_loop(m: Mechanism, joint: Joint) -> bool:
    return any(joint.v_index in _coordinates(m, name) for loop in m.loops for way in ways_of(m, loop) for name in way)


def _connected(m: Mechanism) -> list[int]:
    """For each coordinate the number of its group: coordinates of one joint, and those that a loop has in common, are in one."""
    group = np.arange(m.nv)
    sets = [_coordinates(m, joint.name) for joint in m.joints if joint.nv]
    sets += [[i for way in ways_of(m, loop) for name in way for i in _coordinates(m, name)] for loop in m.loops]
    for together in sets:
        for i in together[1:]:
            group[group == group[i]] = group[together[0]]
    return [int(i) for i in group]
