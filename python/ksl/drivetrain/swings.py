"""How far rods swing in balls at their ends, and limits of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ksl.drivetrain.equations import Equations
from ksl.mechanism import given
from ksl.mechanism.states import Array


@dataclass(frozen=True)
class Swing:
    """A ball at the end of a rod.  Turning about the rod's line is no swing."""

    ball: str
    rod: str
    carrier: str
    """The link on the other side of the ball."""
    along: Array
    """The rod's line (3) in its own axes, a unit vector."""
    middle: Array
    """The rod's line (3) in the carrier's axes at the start, in the middle of the swing."""
    most: float
    """rad."""

    def beyond(self, equations: Equations, Q: Array) -> Array:
        """Numbers (n) that are positive where the rod swings further at positions Q (n, nq)."""
        R, C = (equations.tree.frame_pose(Q, link)[:, :3, :3] for link in (self.rod, self.carrier))
        return np.asarray(np.cos(self.most) - np.einsum("nij,j,nik,k->n", R, self.along, C, self.middle))


def swings_of(equations: Equations, start: Array, limits: Mapping[str, float] | None) -> list[Swing]:
    """For each ball that has a limit, {joint: rad}.  Raises ValueError for what is no ball at the end of a rod of the part."""
    found = []
    for name, value in given.mapping(limits or {}, "ball_limits", "{joint: angle}"):
        most = given.number(value, f"ball_limits: {name}")
        if not 0 < most < np.pi:
            raise ValueError(f"ball_limits: {name} is {most}; expected an angle between 0 and π, rad")
        ends = _ends(equations).get(name)
        if ends is None:
            balls = ", ".join(_ends(equations)) or "of which it has none"
            raise ValueError(f"ball_limits: {name!r} is no ball at the end of a rod of this mechanism: {balls}")
        rod, carrier, line = ends
        along = line / np.linalg.norm(line)
        R, C = (np.asarray(equations.tree.frame_pose(start, link))[:3, :3] for link in (rod, carrier))
        found.append(Swing(name, rod, carrier, along, C.T @ R @ along, most))
    return found


def _ends(equations: Equations) -> dict[str, tuple[str, str, Array]]:
    """{ball: rod, the link on its other side, the rod's line from its joint of the tree to the one that closes its loop}; a rod carries nothing and closes one loop."""
    tree, found, loops = equations.tree, {}, equations.part.loops
    carrying = {tree.parent(link.name) for link in tree.links}
    for loop in loops:
        ends = ((loop.predecessor, loop.predecessor_pose, loop.successor), (loop.successor, loop.successor_pose, loop.predecessor))
        for rod, pose, other in ends:
            point, above = np.reshape(pose, (4, 4))[:3, 3], tree.joint_above(rod)
            if rod in carrying or sum(rod in (x.predecessor, x.successor) for x in loops) != 1 or above.v_index not in equations.part.all or not point.any():
                continue
            if loop.kind == "spherical":
                found[loop.name] = (rod, other, point)
            if above.kind == "spherical" and above.parent is not None:
                found[above.name] = (rod, above.parent, point)
    return found
