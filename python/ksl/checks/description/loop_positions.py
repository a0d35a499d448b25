"""Where the loops of a file close, near its zero position and elsewhere: computed once for all rules of loops."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.loops import TOLERANCES, Mobility, length_of
from ksl.mechanism.mechanism import Joint, Loop
from ksl.model.model import Model
from ksl.mechanism.joint_kinds import slides, units_of
from ksl.mechanism.states import Array

MOST = 150
"""Equations of loops, and coordinates, up to which a mechanism is looked at.  The cost of a position grows with their cube."""
NEAR, AROUND, ANYWHERE = 0.3, 8, 8
"""How far from the zero position searches start, in rad and as a share of the mechanism's length, and how many; and how many start anywhere."""
SEED = 1
UNSURE = TOLERANCES["unsure"]
"""The smallest singular value that counts, relative to the largest term, below which a rank may be due to the error of the position."""


@dataclass(frozen=True)
class Ending:
    """Where a search for closed positions ended, without one."""

    reason: str
    left: Array
    """(loops): the error of each loop there, m; angles times the mechanism's length."""


class LoopPositions:
    """The mechanism of a file at its zero position, at the closed position that was found nearest to it, and at an ordinary one."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.zero = model.neutral()
        self.length = length_of(model)
        """m."""
        self.open_by = self._errors(self.zero)
        """(loops): as of an :class:`Ending`, at the zero position."""
        self.failed: Ending | None = None
        """The search that came nearest, where none found a closed position."""
        self.near: Array | None = None
        """(nq) the closed position nearest to zero that the searches found."""
        self.is_beside = False
        """Whether a search found it from the zero position itself or from around it."""
        self._find()

    def _find(self) -> None:
        model = self.model
        found = model.close(self.zero, starts=1)
        if not found.converged:
            starts = np.vstack([self._around(self.zero, AROUND), model.random(SEED, size=ANYWHERE)])
            more = model.close(starts, starts=1)
            if not more.converged.any():
                best = int(np.argmin(more.error))
                ends, reason = (found.q, str(found.reason)) if found.error <= more.error[best] else (more.q[best], str(more.reason[best]))
                self.failed = Ending(reason, self._errors(ends))
                return
            self.is_beside = bool(more.converged[:AROUND].any())
            closed = more.q[:AROUND][more.converged[:AROUND]] if self.is_beside else more.q[more.converged]
            self.near = min(closed, key=lambda q: float(np.linalg.norm(self.moved(q))))
        else:
            self.near, self.is_beside = found.q, True

    def moved(self, q: Array) -> Array:
        """(nv) how far the coordinates are from zero, rad and m; turns of joints without limits are left out."""
        distance = np.array(self.model.difference(self.zero, q))
        for joint in self.model.joints:
            if joint.nv == 1 and joint.has_angle and not joint.pitch:
                distance[joint.v_index] = np.remainder(distance[joint.v_index] + np.pi, 2 * np.pi) - np.pi
        return distance

    @cached_property
    def ordinary(self) -> Array:
        """(nq) the one of `positions` at which the equations have most rank and are furthest from losing it.

        Near a singular position, where errors of 1e-12 are positions off by the root of that, a rank is none.
        """
        found = [(self.model.mobility(q), q) for q in self.positions]
        return max(found, key=lambda item: (item[0].smallest > UNSURE, item[0].rank, item[0].smallest))[1]

    @cached_property
    def positions(self) -> list[Array]:
        """Closed positions (nq): the one nearest to zero, and some around it."""
        assert self.near is not None
        around = self.model.close(self._around(self.near, AROUND), starts=1)
        return [self.near, *around.q[around.converged]]

    @cached_property
    def freedoms(self) -> Mobility:
        """At the ordinary position."""
        return self.model.mobility(self.ordinary)

    @cached_property
    def near_freedoms(self) -> Mobility:
        """At the closed position nearest to zero."""
        assert self.near is not None
        return self.model.mobility(self.near)

    def motions(self, q: Array) -> Array:
        """(nv, mobility) an orthonormal basis of the velocities that keep the loops closed at q; of coordinates that slide in lengths."""
        directions: Array = np.linalg.svd(self.model.loop_jacobian(q) * self._lengths())[2]
        return directions[self.model.mobility(q).rank :].T

    def axes(self, joint: Joint | Loop, q: Array) -> Array:
        """(3, 3) the axes in the world in which a joint's reactions are given: those of its frame on the side called child."""
        link, own = (joint.successor, np.reshape(joint.successor_pose, (4, 4))[:3, :3]) if isinstance(joint, Loop) else (joint.child, np.eye(3))
        turned: Array = self.model.frame_poses(q)[self.model.link_names.index(link), :3, :3] @ own
        return turned

    def frames_apart(self, loop: Loop) -> float | None:
        """The angle between the joint's axis on both sides at the zero position, rad; None for kinds without an axis, and universal joints."""
        if loop.axis is None or loop.kind == "universal" or not KINDS[loop.kind].has_axis:
            return None
        poses = self.model.frame_poses(self.zero)
        links = self.model.link_names
        axes = []
        for link, own in ((loop.predecessor, loop.predecessor_pose), (loop.successor, loop.successor_pose)):
            axes.append(poses[links.index(link), :3, :3] @ np.reshape(own, (4, 4))[:3, :3] @ np.array(loop.axis))
        return float(np.arctan2(np.linalg.norm(np.cross(*axes)), axes[0] @ axes[1]))

    def _errors(self, q: Array) -> Array:
        """(loops): the size of the error of each loop, m."""
        error = self.model.loop_error(q)
        sizes, row = [], 0
        for loop in self.model.loops:
            of_loop = error[row : row + loop.equations].copy()
            of_loop[forces_of(loop) :] *= self.length
            sizes.append(float(np.linalg.norm(of_loop)))
            row += loop.equations
        return np.array(sizes)

    def _around(self, q: Array, count: int) -> Array:
        """(count, nq) random positions around one."""
        step = np.random.default_rng(SEED).uniform(-NEAR, NEAR, (count, self.model.nv)) * self._lengths()
        return np.array([self.model.integrate(q, dv) for dv in step])

    def _lengths(self) -> Array:
        """(nv): the mechanism's length for coordinates that slide, 1 for those that turn."""
        scale = np.ones(self.model.nv)
        for joint in self.model.joints:
            if joint.nv:
                scale[joint.v_index : joint.v_index + joint.nv] = [self.length if unit == "m" else 1.0 for unit in units_of(joint)[1]]
        return scale


def forces_of(loop: Loop) -> int:
    """How many of a loop joint's equations are those of forces, which come first; that of a screw's travel is one of them."""
    return 3 - slides(loop.kind)


def moving(joints: Sequence[Joint]) -> list[Joint]:
    """The joints that a motor can move: with coordinates of their own, but no free ones."""
    return [joint for joint in joints if joint.nv and not KINDS[joint.kind].is_free]
