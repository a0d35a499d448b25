"""Equations of loops as sums over poses and Jacobians of their links, in numbers and in C: what generated maps solve.

A row is along a direction w of the loop joint's frame on its successor b; a is the predecessor, x the point of the joint on each link.

    length     e = w · (p_a − p_b)        de = w_a · v_a + (x_a × w_a) · ω_a − (the same of b)
    tilt       e = w · (n_b × n_a)        de = w_a · ω_a − w_b · ω_b          n: the joint's axis on each side
    turn       e = w · vee(R_bᵀ R_a)      de as of tilt
    distance   e = (|d|² − l²) / 2        de = d_a · v_a + (x_a × d_a) · ω_a − (the same of b)          d = p_a − p_b

The last stands for a rod with balls at both ends: its three equations, its coordinates and its spin are left out.
w_a and w_b are w in the links' axes.  Terms of de that vanish where the loop is closed are left out: Newton's steps stay quadratic.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ksl.drivetrain.equations import Equations
from ksl.drivetrain.idle import IdleRod
from ksl.mechanism.states import Array

KINDS = ("spherical", "revolute", "continuous", "prismatic", "fixed")


Side = tuple[str, Array]
"""A link, and the pose (4, 4) of the loop joint's frame in it."""


@dataclass(frozen=True)
class LoopRow:
    """One equation of a loop."""

    what: str
    """"length", "tilt", "turn" or "distance"."""
    sides: tuple[Side, Side]
    """Predecessor, successor."""
    direction: Array
    """(3) in the axes of the loop joint's frame; of no meaning for distances."""
    axis: Array
    """(3) the joint's, for tilts."""
    length: float = 0.0

    def numbers(self, poses: dict[str, Array], jacobians: dict[str, Array]) -> tuple[float, Array]:
        """The error, and its Jacobian (nv), of links' poses (4, 4) and Jacobians (6, nv) in their own axes."""
        a, b = (poses[link] @ pose for link, pose in self.sides)
        d = a[:3, 3] - b[:3, 3]
        w = d if self.what == "distance" else b[:3, :3] @ self.direction
        if self.what == "distance":
            error = (d @ d - self.length**2) / 2
        elif self.what == "length":
            error = w @ d
        elif self.what == "tilt":
            error = w @ np.cross(b[:3, :3] @ self.axis, a[:3, :3] @ self.axis)
        else:
            R = b[:3, :3].T @ a[:3, :3]
            error = self.direction @ np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
        row = np.zeros(next(iter(jacobians.values())).shape[1])
        for sign, (link, pose) in zip((1.0, -1.0), self.sides):
            own = poses[link][:3, :3].T @ w
            along = own @ jacobians[link][:3] + np.cross(pose[:3, 3], own) @ jacobians[link][3:] if self.at_points else own @ jacobians[link][3:]
            row += sign * along
        return float(error), row

    @property
    def at_points(self) -> bool:
        return self.what in ("length", "distance")


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
        found.append(LoopRow("distance", ((joint.parent, carried), other), np.zeros(3), np.zeros(3), float(np.linalg.norm(own[:3, 3]))))
        joints.append(joint.name)
    return found, joints, left


def rows_of_loops(equations: Equations, q: Array, without: Sequence[str]) -> list[LoopRow]:
    """As many independent rows as the loops of a part have, at a position q (nq).  Raises ValueError for kinds of loop joints that have none here.

    without: links at which loops have their rows already.
    """
    candidates: list[LoopRow] = []
    loops = [loop for loop in equations.part.loops if loop.predecessor not in without and loop.successor not in without]
    for loop in loops:
        if loop.kind not in KINDS:
            raise ValueError(f"loop joint {loop.name} is {loop.kind}, and C of maps is made of loops that are {', '.join(KINDS)}; the Python map has them all")
        axis = np.array(loop.axis) if loop.axis is not None else np.zeros(3)
        across = np.linalg.svd(axis[None])[2][1:] if axis.any() else np.eye(3)
        lengths = across if loop.kind == "prismatic" else np.eye(3)
        turns = {"spherical": np.zeros((0, 3)), "prismatic": np.eye(3), "fixed": np.eye(3)}.get(loop.kind, across)
        what = "tilt" if loop.kind in ("revolute", "continuous") else "turn"
        sides = (loop.predecessor, np.reshape(loop.predecessor_pose, (4, 4))), (loop.successor, np.reshape(loop.successor_pose, (4, 4)))
        candidates += [LoopRow("length", sides, w, axis) for w in lengths] + [LoopRow(what, sides, w, axis) for w in turns]
    tree, count = equations.tree, len(equations.rows) - sum(loop.equations for loop in equations.part.loops if loop not in loops)
    links = {link for row in candidates for link, _ in row.sides}
    poses, jacobians = ({link: f(q, link) for link in links} for f in (tree.frame_pose, tree.jacobian))
    scale = {"length": 1.0 / equations.length}
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
