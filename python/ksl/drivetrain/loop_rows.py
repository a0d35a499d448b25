"""Equations of loops as sums over poses and Jacobians of their links, in numbers and as steps of a recording: what compiled and generated maps solve.

A row is along a direction w of the loop joint's frame on its successor b; a is the predecessor, x the point of the joint on each link, n the joint's axis there,
and ω = ω_a − ω_b.

    length     e = w · (p_a − p_b)        de = w · (v_a − v_b), both of the point p_a
    tilt       e = w · (n_b × n_a)        de = w · ω
    turn       e = w · vee(R_bᵀ R_a)      de = w · ω
    cross      e = n_a · m_b − n · m      de = (n_a × m_b) · ω                               m: the second axis of a universal joint
    screw      e = p sin(θ − s / p)       de = w · (v_a − v_b) − p w · ω                     θ, s: how far b is turned and moved along n = w; p: the pitch
    distance   e = (|d|² − l²) / 2        de = d · (v_a − v_b)                               d = p_a − p_b

The last stands for a rod with balls at both ends: its three equations, its coordinates and its spin are left out.
Terms of de that vanish where the loop is closed are left out: Newton's steps stay quadratic.  The sine makes turns of a screw count as one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ksl.drivetrain.equations import Equations
from ksl.drivetrain.idle import IdleRod
from ksl.generation.expressions import Objects, cosine, sine
from ksl.mechanism.joint_kinds import KINDS, own_axes, places_in_twist, slides
from ksl.mechanism.mechanism import Loop
from ksl.mechanism.states import Array

Side = tuple[str, Array]
"""A link, and the pose (4, 4) of the loop joint's frame in it."""


@dataclass(frozen=True)
class LoopRow:
    """One equation of a loop."""

    what: str
    """"length", "tilt", "turn", "cross", "screw" or "distance"."""
    sides: tuple[Side, Side]
    """Predecessor, successor."""
    direction: Array
    """(3) in the axes of the loop joint's frame; of no meaning for distances and crosses."""
    axis: Array
    """(3) the joint's."""
    axis2: Array
    """(3) the second one of a universal joint."""
    length: float = 0.0
    """The distance, m, or the pitch of a screw, m/rad."""
    slides: bool = False
    """Whether points on both sides move apart while it is closed."""

    def numbers(self, poses: dict[str, Any], jacobians: dict[str, Any]) -> tuple[Any, Any]:
        """The error, and its Jacobian (nv), of links' poses (4, 4) and Jacobians (6, nv) in their own axes; numbers or steps."""
        a, b = (poses[link] @ pose for link, pose in self.sides)
        d = a[:3, 3] - b[:3, 3]
        error, w = self._error(a, b, d)
        row: Any = 0.0
        for sign, (link, pose) in zip((1.0, -1.0), self.sides):
            R = poses[link][:3, :3].T
            own = R @ w
            if self.what in ("length", "distance", "screw"):
                at = pose[:3, 3] + R @ d if self.slides and sign < 0 else pose[:3, 3]
                about = np.cross(at, own) - (self.length * own if self.what == "screw" else 0.0)
                row = row + sign * (own @ jacobians[link][:3] + about @ jacobians[link][3:])
            else:
                row = row + sign * (own @ jacobians[link][3:])
        return error, row

    def _error(self, a: Any, b: Any, d: Any) -> tuple[Any, Objects | Array]:
        """The error and w, in the world."""
        if self.what == "distance":
            return (d @ d - self.length**2) / 2, d
        n_a, n_b, w = a[:3, :3] @ self.axis, b[:3, :3] @ self.axis, b[:3, :3] @ self.direction
        if self.what == "cross":
            m_b = b[:3, :3] @ self.axis2
            return n_a @ m_b - float(self.axis @ self.axis2), np.cross(n_a, m_b)
        if self.what == "length":
            return w @ d, w
        if self.what == "tilt":
            return w @ np.cross(n_b, n_a), w
        if self.what == "screw":
            u = np.linalg.svd(self.axis[None])[2][1]
            u_a, u_b, v_a, phase = a[:3, :3] @ u, b[:3, :3] @ u, a[:3, :3] @ np.cross(self.axis, u), -(w @ d) / self.length
            return self.length * ((v_a @ u_b) * cosine(phase) - (u_a @ u_b) * sine(phase)), w
        R = b[:3, :3].T @ a[:3, :3]
        return self.direction @ np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2, w


def distances(equations: Equations) -> tuple[list[LoopRow], list[str], list[IdleRod]]:
    """A row for each idle rod that a ball carries and a ball ends; the joints that carry these; the idle rods that are described otherwise."""
    tree, found, joints, left = equations.tree, [], [], []
    neutral = tree.neutral()
    for rod in equations.rods:
        joint, loops = tree.joint_above(rod.link), [loop for loop in equations.part.loops if rod.link in (loop.predecessor, loop.successor)]
        if joint.kind != "spherical" or joint.parent is None or len(loops) != 1 or loops[0].kind != "spherical":
            left.append(rod)
            continue
        ends = [(loops[0].predecessor, np.reshape(loops[0].predecessor_pose, (4, 4))), (loops[0].successor, np.reshape(loops[0].successor_pose, (4, 4)))]
        own = next(pose for link, pose in ends if link == rod.link)
        other = next((end for end in ends if end[0] != rod.link), None)
        if other is None:
            left.append(rod)
            continue
        carried = np.linalg.inv(tree.frame_pose(neutral, joint.parent)) @ tree.frame_pose(neutral, rod.link)
        nothing = np.zeros(3)
        found.append(LoopRow("distance", ((joint.parent, carried), other), nothing, nothing, nothing, float(np.linalg.norm(own[:3, 3]))))
        joints.append(joint.name)
    return found, joints, left


def rows_of_loops(equations: Equations, q: Array, without: Sequence[str]) -> list[LoopRow]:
    """As many independent rows as the loops of a part have, at a position q (nq).

    without: links at which loops have their rows already.
    """
    loops = [loop for loop in equations.part.loops if loop.predecessor not in without and loop.successor not in without]
    candidates = [row for loop in loops for row in _rows_of(loop)]
    tree, count = equations.tree, len(equations.rows) - sum(loop.equations for loop in equations.part.loops if loop not in loops)
    links = {link for row in candidates for link, _ in row.sides}
    poses, jacobians = ({link: f(q, link) for link in links} for f in (tree.frame_pose, tree.jacobian))
    scale = {"length": 1.0 / equations.length, "screw": 1.0 / equations.length}
    G = np.array([scale.get(row.what, 1.0) * row.numbers(poses, jacobians)[1][equations.part.all] for row in candidates]).reshape(
        len(candidates), len(equations.part.all)
    )
    chosen: list[int] = []
    for _ in range(count):  # the one that is farthest from those that are chosen
        sizes = np.linalg.norm(G, axis=1)
        chosen.append(int(np.argmax(sizes * (1.0 - 1e-9 * np.arange(len(sizes))))))
        unit = G[chosen[-1]] / sizes[chosen[-1]]
        G = G - np.outer(G @ unit, unit)
    return [candidates[k] for k in sorted(chosen)]


def _rows_of(loop: Loop) -> list[LoopRow]:
    """The rows of a loop: what its joint resists."""
    axis, axis2 = (np.zeros(3) if x is None else np.array(x) for x in (loop.axis, loop.axis2))
    kind, axes = KINDS[loop.kind], own_axes(loop.kind, loop.axis)
    is_screw = kind.has_pitch and loop.pitch != 0
    free = {*(() if kind.has_axis2 else places_in_twist(loop.kind)), *([2] if is_screw else [])}
    lengths, turns = (axes[[k for k in range(3) if k + at not in free]] if free & {at, at + 1, at + 2} else np.eye(3) for at in (0, 3))
    if kind.has_axis2:
        turns = turns[:0]
    words = [("length", w) for w in lengths] + [("turn" if len(turns) == 3 else "tilt", w) for w in turns]
    words += [("screw", axis)] * is_screw + [("cross", axis)] * kind.has_axis2
    sides = (loop.predecessor, np.reshape(loop.predecessor_pose, (4, 4))), (loop.successor, np.reshape(loop.successor_pose, (4, 4)))
    return [LoopRow(what, sides, w, axis, axis2, loop.pitch, slides(loop.kind) > 0 or kind.has_pitch) for what, w in words]
