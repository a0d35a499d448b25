"""Mechanisms as a graph: bodies that stand somewhere, and joints between any two of them.  Formats that know no parents and children are read so.

A joint has a frame on each of its bodies.  The tree is the one that is found from the ground on, breadth first, joints in the order of the file; a joint
between two bodies that are in it already closes a loop.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import product
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from ksl.model.builder import Builder, PlainBuilder
from ksl.mechanism.joint_kinds import KINDS, Kind, slides, turns

Array = NDArray[np.float64]
GROUND = None
AT_REST = np.eye(4)
_REST: list[list[float]] = AT_REST.tolist()
SINGLE = 3e-6
"""m, and elements of rotations: what single precision leaves of frames of robots of some metres, with room for products of some of them."""
CLOSE = 1e-9
"""Lengths in m, and elements of rotations, of frames that are the same: single precision of a file is 1e-7 of them."""


@dataclass
class Body:
    """A body, with mass, centroid (3) and tensor (3, 3) about it in its axes; kg, m."""

    name: str
    pose: Array
    """(4, 4), in the world, as the file has it; where the body floats its position counts from there."""
    mass: float = 0.0
    centroid: Array = field(default_factory=lambda: np.zeros(3))
    tensor: Array = field(default_factory=lambda: np.zeros((3, 3)))


@dataclass
class Connection:
    """A joint between two bodies, by their numbers; GROUND is the world."""

    name: str
    kind: str
    first: int | None
    second: int | None
    at_first: Array
    """The pose of its frame (4, 4) in the first body's; in the world where that is the ground."""
    at_second: Array
    axis: Array | None = None
    """In its frame, for kinds that have one: the second body moves along or about it against the first."""
    numbers: dict[str, Any] = field(default_factory=dict)
    """limits, effort, velocity and so on, as :meth:`Builder.add_joint` takes them."""
    closes: bool = False
    """The file says that it closes a loop."""


class Assembled(NamedTuple):
    loops: list[str]
    """Names of the joints that close loops."""
    floating: list[str]
    """Names of the joints of bodies that nothing carries."""
    turned: list[str]
    """Names of joints whose second body is on the ground's side."""


def assembled(builder: Builder, bodies: list[Body], connections: list[Connection], cut: bool) -> Assembled:
    """Adds everything to a builder.  cut: joints that close loops are left out.  O(bodies + joints)."""
    plain = PlainBuilder(builder)
    ground = unused("world", {body.name for body in bodies})
    plain.add_link(ground)
    for body in bodies:
        plain.add_link(body.name, body.mass, body.centroid, body.tensor)
    names = [body.name for body in bodies]
    tree, closing = _tree(bodies, connections)
    free = [step for step in tree if step.connection is None]
    result = Assembled([c.name for c in closing], [], [])
    used = {c.name for c in connections}
    for step in tree:
        parent = ground if step.parent is None else names[step.parent]
        if step.connection is None:
            name = unused("floating_base" if len(free) == 1 else f"{names[step.child]}_floating", used)
            result.floating.append(name)
            plain.add_joint(name, "floating", ground, names[step.child], bodies[step.child].pose)
        else:
            if step.turned:
                result.turned.append(step.connection.name)
            _add(plain, step.connection, step.turned, parent, names[step.child])
    for c in [] if cut else closing:
        first, second = (ground if i is None else names[i] for i in (c.first, c.second))
        builder.add_loop(c.name, cast("Kind", c.kind), first, second, c.at_first, c.at_second, axis=c.axis)
    return result


class _Step(NamedTuple):
    parent: int | None
    child: int
    connection: Connection | None
    turned: bool


def _tree(bodies: list[Body], connections: list[Connection]) -> tuple[list[_Step], list[Connection]]:
    """The joints of the tree, each body carried once, and those that close loops."""
    at: dict[int | None, list[Connection]] = {None: [], **{i: [] for i in range(len(bodies))}}
    for c in connections:
        if not c.closes:
            at[c.first].append(c)
            at[c.second].append(c)
    reached: set[int | None] = {None}
    steps: list[_Step] = []
    used: set[int] = set()
    starts = sorted(range(len(bodies)), key=lambda i: any(c.second == i for c in at[i]))  # bodies that no joint has as its second one float first
    for start in [None, *starts]:
        if start is not None:
            if start in reached:
                continue
            steps.append(_Step(None, start, None, False))
            reached.add(start)
        pending = deque([start])
        while pending:
            here = pending.popleft()
            for c in at[here]:
                there = c.second if c.first == here else c.first
                if there not in reached and there is not None:
                    reached.add(there)
                    used.add(id(c))
                    steps.append(_Step(here, there, c, c.first != here))
                    pending.append(there)
    return steps, [c for c in connections if id(c) not in used]


def _add(plain: PlainBuilder, c: Connection, turned: bool, parent: str, child: str) -> None:
    """A joint of the tree.  Its child's frame is its own, or else a massless link is at it, to which the child is welded."""
    at_parent, at_child = (c.at_second, c.at_first) if turned else (c.at_first, c.at_second)
    axis = None if c.axis is None else -c.axis if turned else c.axis
    if at_child.tolist() == _REST:  # as most are
        plain.add_joint(c.name, c.kind, parent, child, at_parent, axis, **c.numbers)
        return
    offset, R = at_child[:3, 3], at_child[:3, :3]
    across = offset if axis is None else offset - axis * (axis @ offset) / (axis @ axis)
    if turns(c.kind) == 0 or np.abs(across).max() <= CLOSE:
        has_own_axes = KINDS[c.kind].nv > 1 and not KINDS[c.kind].has_axis  # coordinates are along those of the frame
        keeps = not has_own_axes or np.abs(R - np.eye(3)).max() <= CLOSE
        if keeps:
            plain.add_joint(c.name, c.kind, parent, child, at_parent @ inverse(at_child), None if axis is None else R @ axis, **c.numbers)
            return
    frame = f"{c.name}_frame"
    plain.add_link(frame)
    plain.add_joint(c.name, c.kind, parent, frame, at_parent, axis, **c.numbers)
    plain.add_joint(f"{c.name}_weld", "fixed", frame, child, inverse(at_child))


class _Sides(NamedTuple):
    """The sides of n connections: the poses of both bodies in the world, and of the joint's frames in them, (n, 4, 4) each."""

    first: Array
    at_first: Array
    second: Array
    at_second: Array

    @classmethod
    def of(cls, connections: list[Connection], bodies: list[Body]) -> _Sides:
        first, second = ([AT_REST if i is None else bodies[i].pose for i in of] for of in ([c.first for c in connections], [c.second for c in connections]))
        frames = first, [c.at_first for c in connections], second, [c.at_second for c in connections]
        return cls(*(np.array(each).reshape(-1, 4, 4) for each in frames))

    def are_unturned(self) -> list[bool]:
        """Whether all four have the world's axes, as most do in files that programs write."""
        turned: list[bool] = np.any([(X[:, :3, :3] != np.eye(3)).any(axis=(1, 2)) for X in self], axis=0).tolist()
        return [not x for x in turned]

    def gaps(self, connections: list[Connection]) -> list[tuple[float, float]]:
        """How far the bodies of a file stand from what each joint allows: m, and the sine of an angle; 0 where its frames coincide but for its motion."""
        apart = _inverses(self.first @ self.at_first) @ self.second @ self.at_second
        axis = np.array([np.zeros(3) if c.axis is None else c.axis for c in connections]).reshape(-1, 3)
        has_axis = np.array([c.axis is not None for c in connections], dtype=bool)
        ways, turning = (np.array([of(c.kind) for c in connections], dtype=int) for of in (slides, turns))
        about_axis = has_axis & np.array([KINDS[c.kind].angle is not None for c in connections], dtype=bool)
        shift = apart[:, :3, 3]
        along = axis * (axis * shift).sum(axis=1)[:, None]
        left = np.where((ways == 0)[:, None], shift, np.where((ways == 1)[:, None], shift - along, along))
        left[(ways == 3) | ((ways > 0) & ~has_axis)] = 0.0
        R = apart[:, :3, :3]
        off_axis = np.linalg.norm((R @ axis[:, :, None])[:, :, 0] - axis, axis=1)
        off = np.linalg.norm(R - np.eye(3), axis=(1, 2)) / math.sqrt(2.0)  # 2 sin(angle / 2) of a rotation: of the singular values two are this and one is 0
        turn = np.where(turning == 3, 0.0, np.where(about_axis, off_axis, off))
        return list(zip(np.linalg.norm(left, axis=1).tolist(), turn.tolist(), strict=True))


def gap(c: Connection, bodies: list[Body]) -> tuple[float, float]:
    """:meth:`_Sides.gaps` of one connection."""
    return _Sides.of([c], bodies).gaps([c])[0]


def _left(shift: Array, kind: str, axis: Array | None) -> Array:
    """A distance (3) without what a joint slides by, along its axis, across it, or anywhere."""
    ways = slides(kind)
    if ways == 3 or (ways and axis is None):
        return np.zeros(3)
    if not ways:
        return shift
    assert axis is not None
    along = axis * (axis @ shift)
    return shift - along if ways == 1 else np.asarray(along)


def in_double(bodies: list[Body], connections: list[Connection]) -> list[tuple[float, float]]:
    """Completes frames of single precision by the poses in which the bodies stand, where these agree with the joints within SINGLE.  Returns how far they agreed before.

    Loops need it: axes that are parallel to 1e-7 alone lock a mechanism that moves if they are parallel.  Frames on the two sides of a joint are made to coincide
    but for its motion, and axes that are parallel are made parallel exactly.  O(joints).
    """
    directions, sides = _Directions(), _Sides.of(connections, bodies)
    gaps = sides.gaps(connections)
    for c, far, is_plain, first, second in zip(connections, gaps, sides.are_unturned(), sides.first, sides.second, strict=True):
        if max(far) > SINGLE:
            continue
        if c.axis is not None:
            for body, at in ((first, c.at_first), (second, c.at_second)):
                u = c.axis if is_plain else body[:3, :3] @ at[:3, :3] @ c.axis
                wanted = directions.parallel_to(u)
                if not is_plain or (u != wanted).any():
                    at[:3, :3] = body[:3, :3].T @ _turn(u, wanted) @ body[:3, :3] @ at[:3, :3]
                    is_plain = False
        if is_plain:  # the same as below, without products by ones and zeros
            apart = (second[:3, 3] + c.at_second[:3, 3]) - (first[:3, 3] + c.at_first[:3, 3])
            c.at_second[:3, 3] = (second[:3, 3] + c.at_second[:3, 3] - _left(apart, c.kind, c.axis)) - second[:3, 3] + 0.0
            continue
        here, there = first @ c.at_first, second @ c.at_second
        if turns(c.kind) == 0:
            there[:3, :3] = here[:3, :3]
        apart = there[:3, 3] - here[:3, 3]
        there[:3, 3] -= _left(apart, c.kind, None if c.axis is None else here[:3, :3] @ c.axis)
        c.at_second[:] = inverse(second) @ there
    return gaps


class _Directions:
    """Directions of axes, found by the cell of a grid that they are in: a robot has few, and a file of many robots thousands."""

    CELL = 1e-3

    def __init__(self) -> None:
        self.all: list[Array] = []
        self.cells: dict[tuple[int, ...], list[int]] = {}
        self.known: dict[tuple[float, ...], Array] = {}

    def parallel_to(self, u: Array) -> Array:
        """The first direction, or its opposite, that is parallel to a unit vector; the vector itself, which is added, if none is."""
        numbers = tuple(u.tolist())
        if numbers not in self.known:
            self.known[numbers] = self._found(u)
        return self.known[numbers]

    def _found(self, u: Array) -> Array:
        near = [(k, d) for sign in (1.0, -1.0) for k in self._near(sign * u) if np.abs(u - (d := sign * self.all[k])).max() <= SINGLE]
        if near:
            return min(near, key=lambda one: one[0])[1]
        self.cells.setdefault(tuple(math.floor(x / self.CELL) for x in u.tolist()), []).append(len(self.all))
        self.all.append(u / np.linalg.norm(u))
        return self.all[-1]

    def _near(self, u: Array) -> list[int]:
        """Indices of directions in the cells that reach to within SINGLE of a vector; rounding of a direction's own cell is far less."""
        room = 1.01 * SINGLE
        sides = [{math.floor((x - room) / self.CELL), math.floor((x + room) / self.CELL)} for x in u.tolist()]
        return [k for cell in product(*sides) for k in self.cells.get(cell, ())]


def _turn(u: Array, v: Array) -> Array:
    """The smallest rotation (3, 3) from one unit vector to another that is near, to second order in their distance, orthogonal to double precision."""
    (a, b, c), (d, e, f) = u.tolist(), v.tolist()
    x, y, z = b * f - c * e, c * d - a * f, a * e - b * d
    W = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + W + 0.5 * W @ W)


def inverse(X: Array) -> Array:
    """The inverse of a pose (4, 4)."""
    made, back = AT_REST.copy(), AT_REST.copy()
    made[:3, :3], back[:3, 3] = X[:3, :3].T, -X[:3, 3]
    return made @ back


def _inverses(X: Array) -> Array:
    """The inverses of n poses, (n, 4, 4)."""
    made = np.zeros_like(X)
    made[:, :3, :3], made[:, 3, 3] = X[:, :3, :3].transpose(0, 2, 1), 1.0
    made[:, :3, 3] = -(made[:, :3, :3] @ X[:, :3, 3:])[:, :, 0]
    return made


def unused(name: str, names: Iterable[str]) -> str:
    taken = names if isinstance(names, (set, frozenset)) else set(names)
    while name in taken:
        name += "_"
    return name
