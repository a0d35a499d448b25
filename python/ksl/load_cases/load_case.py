"""A load case: a motion of a model, and its wrenches, block by block."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ksl import _core
from ksl.base.errors import MotionError, ResultError
from ksl.base.finite_results import CHECK_UNITS
from ksl.load_cases.loop_motion import JointMotions, joint_motions
from ksl.load_cases.passive_joints import passive, without_axial_effort
from ksl.load_cases.placement import Placement as Placement
from ksl.load_cases.reaction_joints import reaction_joints
from ksl.load_cases.undetermined import Undetermined, undetermined
from ksl.mechanism.calls import Calls
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.payload import Payload as Payload
from ksl.mechanism.states import Array
from ksl.motions.closed_motion import check_drives
from ksl.motions.motion import Motion

ALWAYS, NEVER = -math.inf, math.inf
"""Times from which on brakes supply efforts."""
BLOCK_ROWS = 1 << 17
"""Rows of the table that are computed and written at a time."""


@dataclass(frozen=True)
class LoadCase:
    """A motion of a model, with the wrenches that the environment exerts on its links: {link: (n, 6)}."""

    model: Calls
    motion: Motion
    placement: Placement = Placement()
    external: Mapping[str, Array] = field(default_factory=dict)
    name: str = "motion"
    motion_file: str = ""
    """Empty for a motion that is no file's."""
    payloads: Sequence[Payload] = ()
    """What `model` carries besides its links, for the record."""
    brakes_from: float = NEVER
    """From this time on, s, brakes supply the efforts; those of the drives are then zero."""
    kind: str = "motion"
    """What the samples are, in words: motion, held at rest, emergency stop …"""
    static: bool = False
    """Whether samples are positions at rest, one after the other, and no motion: power balances don't apply."""
    known_undetermined: Undetermined | None = None
    """`undetermined`, where it is known from another load case with the same positions."""

    @property
    def joints(self) -> tuple[Joint, ...]:
        """All joints with reactions, those that close loops last."""
        return reaction_joints(self.model)

    @cached_property
    def braked(self) -> NDArray[np.bool_]:
        """(n): whether brakes supply the efforts, and not the drives."""
        return np.asarray(self.motion.time >= self.brakes_from)

    @property
    def brake(self) -> bool:
        """Whether they do so throughout."""
        return bool(self.braked.all())

    @cached_property
    def joint_motions(self) -> JointMotions:
        """Positions and rates of joints with one coordinate."""
        return joint_motions(self.model, self.motion.q, self.motion.resolved_v, self.motion.resolved_a)

    @cached_property
    def undetermined(self) -> Undetermined:
        """Which components of reactions rigid bodies leave open, of a closed mechanism."""
        if self.known_undetermined is not None:
            return self.known_undetermined
        return undetermined(self.model, self.motion.q, self.placement) if self.model.loops and isinstance(self.model, Calls) else Undetermined()

    @cached_property
    def passive(self) -> NDArray[np.bool_]:
        """(joints) those that transmit nothing along their motion, of a closed mechanism."""
        return passive(self.model)

    @cached_property
    def without_axial_effort(self) -> NDArray[np.bool_]:
        """(joints) those of them whose wrench at the chosen point has no component along the motion."""
        return without_axial_effort(self.model, self.placement)

    def blocks(self) -> Iterator[Block]:
        """All samples in order, in blocks of about BLOCK_ROWS rows of the table."""
        samples = max(1, BLOCK_ROWS // len(self.joints))
        for start in range(0, len(self.motion.time), samples):
            yield self.block(slice(start, start + samples))

    def block(self, rows: slice, threads: int | None = None) -> Block:
        """These samples.  threads: at most so many; None: all cores."""
        p = self.placement
        external = {link: w[rows] for link, w in self.external.items()}
        m, v, a, in_joint_axes = self.motion, self.motion.resolved_v, self.motion.resolved_a, p.axes == "joint" and p.order == "lin_ang"
        wanted = self._requests("total", p.axes, p.order) + self._requests("constraint", p.axes, p.order)
        wanted += [] if in_joint_axes else self._requests("total", "joint", "lin_ang")
        passive = self.passive
        if not in_joint_axes and passive.any():
            wanted += self._requests("constraint", "joint", "lin_ang")
        if self.model.follower_names:
            wanted.append(self.model.reaction_request("child", "joint", "joint", "lin_ang", "coupling", self.model.follower_names))
        try:
            tau, *found = self.model.inverse_dynamics_with_reactions(m.q[rows], v[rows], a[rows], wanted, external, threads)
        except ResultError as e:
            check_drives(self.model, self.motion_file or self.name)
            sample = (rows.start or 0) + e.state
            about = "" if self.model.loops else f"; {CHECK_UNITS}"
            raise MotionError(f"{self.motion_file or self.name}: sample {sample + 1} (time {m.time[sample]:.9g}): {e}{about}") from None
        coupling = self._coupling(found.pop()) if self.model.follower_names else np.empty((len(m.time[rows]), 0))
        each = 1 + len(p.points)
        total, constraint, *others = [self._merged(found[i : i + each]) for i in range(0, len(found), each)]
        of_structure = [constraint, *others[1:]]  # of joints without a motor, whose efforts are zero
        for whole, part in zip([total, *others[:1]], of_structure, strict=True) if passive.any() else ():
            whole[:, passive] = part[:, passive]
        parts = self.model.effort_parts(m.q[rows], v[rows], a[rows], external, threads=threads) if self.model.physics and not self.brake else None
        return Block(
            rows, m.time[rows], m.q[rows], v[rows], a[rows], tau, total, constraint, others[0] if others else total, coupling,
            self.joint_motions.part(rows), parts, self.braked[rows], self.undetermined, self.without_axial_effort,
        )  # fmt: skip

    def _requests(self, part: str, axes: str, order: str) -> list[_core.Request]:
        """Requests for all joints at the common point, and for each joint that has a point of its own."""
        p, names = self.placement, [j.name for j in self.joints]
        own = [self.model.reaction_request(p.on, point, axes, order, part, [joint]) for joint, point in p.points.items()]
        return [self.model.reaction_request(p.on, p.at, axes, order, part, names), *own]

    def _merged(self, found: list[Array]) -> Array:
        """Wrenches (n, joints, 6), each about its own point."""
        wrenches, *own = found
        for joint, wrench in zip(self.placement.points, own, strict=True):
            wrenches[:, [j.name for j in self.joints].index(joint)] = wrench[:, 0]
        return wrenches

    def _coupling(self, wrenches: Array) -> Array:
        """Efforts (n, followers) from the coupling part (n, followers, 6) of their wrenches, which is h* Sᵀ f."""
        followers = [self.model.joint(name) for name in self.model.follower_names]
        along = [wrenches[:, i, 3:] if j.has_angle else wrenches[:, i, :3] for i, j in enumerate(followers)]
        return np.column_stack([x @ np.array(j.axis) for x, j in zip(along, followers, strict=True)])


@dataclass(frozen=True)
class Block:
    """Results for some samples, with joints in the order of `LoadCase.joints`."""

    rows: slice
    time: Array
    q: Array
    v: Array
    """Zero where joints stand: see `Motion.resolved_v`, also for accelerations."""
    a: Array
    tau: Array
    total: Array
    """(n, joints, 6), expressed as the placement says."""
    constraint: Array
    in_joint_axes: Array
    """The total at the placement's point and side, but in the joint's axes, linear first."""
    coupling: Array
    """(n, followers): the effort of the coupling of each mimic joint, N m or N, in the order of `Model.follower_names`."""
    motions: JointMotions
    """Positions and rates of joints with one coordinate."""
    parts: Array | None
    """(n, 5, nv): what `tau` consists of, in the order of `EFFORT_PARTS`; None for models without physics of joints, and with brakes throughout."""
    braked: NDArray[np.bool_]
    """(n): whether brakes supply `tau`, and not the drives."""
    undetermined: Undetermined = Undetermined()
    """Components that rigid bodies leave open, along the whole motion."""
    without_axial_effort: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))
    """(joints) those without a motor, of a closed mechanism, in whose wrench the component along the motion is zero by definition."""

    def of_drives(self, x: Array) -> Array:
        """Values (n, …) of the drives, which have none where brakes hold."""
        return self._where(~self.braked, x)

    def of_brakes(self, x: Array) -> Array:
        return self._where(self.braked, x)

    def _where(self, rows: NDArray[np.bool_], x: Array) -> Array:
        return x if rows.all() else np.where(rows.reshape(-1, *[1] * (x.ndim - 1)), x, 0.0)
