"""What there is to see: links, joints and wrenches of a model in given states, computed once for all of them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl.base.errors import MotionError
from ksl.base.real_arrays import real_array
from ksl.mechanism.core_sentences import as_call
from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.mechanism import Joint, Loop
from ksl.mechanism.requests import core_of
from ksl.mechanism.states import Array, External, argument_rows, items_of
from ksl.viewer.closing import closed_near, open_loops
from ksl.viewer.visuals import Appearance, appearance

if TYPE_CHECKING:
    from ksl.mechanism.calls import Calls

SAMPLES = 1500
"""Longer motions are shown at about so many samples, at those of the largest efforts among them."""

CONSTRAINT, ACTUATION, EXTERNAL, SCREW, CENTRE = (31, 95, 191), (230, 115, 0), (34, 139, 87), (150, 60, 180), (200, 30, 60)
"""Colours, red, green and blue from 0 to 255: what the structure carries, what drives exert, what the environment exerts, the screw
axis, and the centre of mass."""

LOOP = (0, 128, 128)
"""The colour of joints that close loops, and of the gap between their sides."""

ELEMENT = (120, 95, 40)
"""The colour of springs, dampers and cylinders between points of two links."""

LOOKED_AT = 24
"""States, evenly spread, in which a camera is to see all links."""

LONGEST = 0.4
"""Length of the longest arrow of the default scale, as a share of the size of the scene."""


@dataclass(frozen=True)
class Scale:
    """Lengths of arrows."""

    force: float
    """m for each N."""
    moment: float
    """m for each N m."""


@dataclass(frozen=True)
class Scene:
    """A model in n states, with all that outlets draw.  World axes; wrenches act on the child side, about the joint's origin, force first."""

    model: Calls
    look: Appearance
    time: Array
    """(n), s; zeros for a single pose."""
    q: Array
    """(n, nq)."""
    v: Array
    """(n, nv)."""
    a: Array
    """(n, nv)."""
    external: Mapping[str, Array]
    """{link: (n, 6)}: wrenches of the environment at the link's origin, in its axes."""
    poses: Array
    """(n, links, 4, 4), in the order of `model.links`."""
    twists: Array
    """(n, links, 6): about the link's origin; m/s, rad/s."""
    constraint: Array
    """(n, joints, 6), in the order of `joints`: what the structure carries; N, N m."""
    actuation: Array
    """(n, joints, 6): the rest, along the joint's motion: of drives, and of couplings of mimic joints."""
    effort: Array
    """(n, joints): of the drive, N m or N; NaN where there is none."""
    centre_of_mass: Array
    """(n, 3), m."""
    samples: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    """(n): which samples of a longer motion these are."""
    placed: Mapping[str, Array] = field(default_factory=dict)
    """`external` in world axes, about the link's origin."""
    unloaded: str = ""
    """Why there are no wrenches, and efforts are NaN: a mechanism with loops that is open in its only state, or whose drives are not known."""

    @cached_property
    def joints(self) -> tuple[Joint | Loop, ...]:
        """The joints of the tree, and then the joints that close loops."""
        return *self.model.joints, *self.model.loops

    @cached_property
    def children(self) -> NDArray[np.intp]:
        """(joints): for each joint the index of the link that it carries; of one that closes a loop the successor."""
        index = {name: i for i, name in enumerate(self.model.link_names)}
        return np.array([index[child_of(j)] for j in self.joints], dtype=np.intp)

    @cached_property
    def frames(self) -> Array:
        """(n, joints, 4, 4): of the joints, on the child side."""
        frames = np.array(self.poses[:, self.children])
        for i, loop in enumerate(self.model.loops, len(self.model.joints)):
            frames[:, i] = frames[:, i] @ np.reshape(loop.successor_pose, (4, 4))
        return frames

    @cached_property
    def predecessors(self) -> Array:
        """(n, loops, 3): origins of the loop joints on the predecessors, m."""
        index = {name: i for i, name in enumerate(self.model.link_names)}
        frames = [self.poses[:, index[loop.predecessor]] @ np.reshape(loop.predecessor_pose, (4, 4)) for loop in self.model.loops]
        return np.stack(frames, axis=1)[..., :3, 3] if frames else np.zeros((len(self.time), 0, 3))

    @cached_property
    def limits(self) -> Array:
        """(joints): limits of efforts, N m or N; NaN where the file gives none, or 0."""
        return np.array([(isinstance(j, Joint) and j.effort) or np.nan for j in self.joints], dtype=float)

    @property
    def utilisation(self) -> Array:
        """(n, joints): the size of the effort as a share of its limit; NaN without drive or limit."""
        share: Array = np.abs(self.effort) / self.limits
        return share

    @property
    def origins(self) -> Array:
        """(n, joints, 3): origins of the joints, m."""
        origins: Array = self.frames[..., :3, 3]
        return origins

    @cached_property
    def size(self) -> float:
        """Diagonal of the box about the links in the first state, m."""
        low, high = self.bounds(0)
        return max(float(np.linalg.norm(high - low)), 1e-3)

    def bounds(self, sample: int) -> tuple[Array, Array]:
        """Corners (3) of the box about all links in one state, m."""
        parts = [self.poses[sample, :, :3, 3], self.force_elements(sample).reshape(-1, 3)]
        for i, name in enumerate(self.model.link_names):
            pose = self.poses[sample, i]
            parts += [s.vertices[:: max(1, len(s.vertices) // 500)] @ pose[:3, :3].T + pose[:3, 3] for s in self.look.shapes.get(name, [])]
        points = np.concatenate(parts)
        return points.min(axis=0), points.max(axis=0)

    @cached_property
    def reach(self) -> tuple[Array, Array]:
        """Corners (3) of the box about all links in all states, of which some are looked at, m."""
        boxes = [self.bounds(int(k)) for k in np.unique(np.linspace(0, len(self.time) - 1, LOOKED_AT).astype(int))]
        return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)

    @cached_property
    def scale(self) -> Scale:
        """The scale in which the largest wrench of all joints and states is an arrow of LONGEST times the size."""
        return scale_of(np.concatenate([self.constraint, self.actuation, *(w[:, None] for w in self.placed.values())], axis=1), self.size)

    def bones(self, sample: int) -> Array:
        """Segments (k, 2, 3) from the origin of a link to the joints at it, for links without a surface of their own."""
        index = {name: i for i, name in enumerate(self.model.link_names)}
        pairs = [(index[j.parent], index[j.child]) for j in self.model.joints if j.parent is not None and self._bare(j.parent)]
        segments: Array = self.poses[sample][np.array(pairs, dtype=np.intp).reshape(-1, 2)][..., :3, 3]
        ends = zip(self.model.loops, self.predecessors[sample], self.origins[sample, len(self.model.joints) :])
        of_loops = [
            (self.poses[sample, index[link], :3, 3], end)
            for loop, *both in ends
            for link, end in zip((loop.predecessor, loop.successor), both)
            if self._bare(link)
        ]
        return np.concatenate([segments, np.array(of_loops).reshape(-1, 2, 3)]) if of_loops else segments

    def axes(self, sample: int) -> Array:
        """Segments (k, 2, 3) along the axes of moving joints at such links, and at links that such links carry."""
        shown = [i for i, j in enumerate(self.model.joints) if j.has_axis and (self._bare(j.child) or j.parent is None or self._bare(j.parent))]
        directions = np.array([self.model.joints[i].axis for i in shown]).reshape(-1, 3)
        pose = self.poses[sample, self.children[shown]]
        half = 0.04 * self.size * np.einsum("kij,kj->ki", pose[:, :3, :3], directions)
        return np.stack([pose[:, :3, 3] - half, pose[:, :3, 3] + half], axis=1)

    def loop_marks(self, sample: int) -> Array:
        """Segments (k, 2, 3) at the joints that close loops: along their axes, or along those of their frames where they have none."""
        marks = []
        for loop, frame in zip(self.model.loops, self.frames[sample, len(self.model.joints) :]):
            along = np.array([loop.axis]) if has_axis(loop) else 0.5 * np.eye(3)
            half = 0.06 * self.size * along @ frame[:3, :3].T
            marks += [(frame[:3, 3] - x, frame[:3, 3] + x) for x in half]
        return np.array(marks).reshape(-1, 2, 3)

    def loop_gaps(self, sample: int) -> Array:
        """Segments (loops, 2, 3) from one side of a loop joint to the other where it is open; of no length where it is closed."""
        start, end = self.predecessors[sample], self.origins[sample, len(self.model.joints) :]
        is_open = open_loops(self.model, self.q[sample]) if self.unloaded else np.zeros(len(start), dtype=bool)
        return np.stack([np.where(is_open[:, None], start, end), end], axis=1)

    def force_elements(self, sample: int) -> Array:
        """Segments (elements, 2, 3) from one point of a spring, damper or cylinder to the other."""
        index = {name: i for i, name in enumerate(self.model.link_names)}
        ends = [
            [self.poses[sample, index[link]] @ [*point, 1.0] for link, point in ((of.link1, of.point1), (of.link2, of.point2))]
            for of in self.model.force_elements
        ]
        return np.array(ends).reshape(-1, 2, 4)[..., :3] if ends else np.zeros((0, 2, 3))

    def _bare(self, link: str) -> bool:
        return link not in self.look.shapes or link in self.look.ellipsoids

    def joint_index(self, name: str) -> int:
        """Where a joint is in `joints`.  ValueError names near ones."""
        loops = self.model.loop_names
        return len(self.model.joints) + loops.index(name) if name in loops else self.model.joint_index(name)

    def screw_axis(self, sample: int, joint: str) -> tuple[Array, Array, float] | None:
        """The twist of the link that a joint carries as a screw: its axis' point (3) nearest to the link's origin, ω (3), and the pitch, m/rad.

        None where the link doesn't turn.  point = x + ω × v / ω², pitch = ω · v / ω² (Featherstone, RBDA 2008, section 2.2).
        """
        link = self.children[self.joint_index(joint)]
        linear, angular = self.twists[sample, link, :3], self.twists[sample, link, 3:]
        squared = float(angular @ angular)
        if squared < 1e-12:
            return None
        point = self.poses[sample, link, :3, 3] + np.cross(angular, linear) / squared
        return point, angular, float(angular @ linear) / squared

    def worst_joint(self) -> str:
        """The joint whose drive comes nearest to its limit, or exceeds it most; without limits the first that moves, or the first."""
        share = self.utilisation
        if np.isfinite(share).any():
            return self.model.joints[int(np.nanargmax(np.nanmax(np.where(np.isfinite(share), share, -1.0), axis=0)))].name
        return next((j.name for j in self.model.joints if j.nv), self.model.joints[0].name)

    def worst_sample(self, joint: str) -> int:
        """The state in which the drive of a joint exerts most; of joints without a drive, in which the wrench's moment is largest, or its force."""
        i = self.joint_index(joint)
        if np.isfinite(self.effort[:, i]).any():
            return int(np.nanargmax(np.abs(self.effort[:, i])))
        wrench = self.constraint[:, i] + self.actuation[:, i]
        moment = sizes(wrench[:, 3:])
        return int(np.argmax(moment if moment.max() > 0 else sizes(wrench[:, :3])))


def make_scene(
    model: Calls,
    q: ArrayLike | None = None,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    time: ArrayLike | None = None,
    external: External | None = None,
    *,
    package_paths: Sequence[str | os.PathLike[str]] = (),
    triangles: int = 20_000,
    look: Appearance | None = None,
) -> Scene:
    """The scene of one state, or of the states of a motion.

    q (nq) or (n, nq), by default a pose within the limits; v and a (nv) or (n, nv), zero where they are missing: at rest.  time (n), s.
    external: {link: (6) or (n, 6)}, at the link's origin, in its axes.
    package_paths, triangles: as in `visuals.appearance`.  look: appearance of an earlier scene of the same robot, which is not read again.
    Of a mechanism with loops the default pose is closed.  One whose drives are not known has no wrenches in its scene, nor has a single state that is
    open: `unloaded` says why.
    Raises ValueError for shapes that don't fit, and for motions that don't keep loops closed.  O(n · (bodies + links)), besides reading meshes.
    """
    core = core_of(model)
    positions = np.atleast_2d(resting_position(model) if q is None else argument_rows(q, "q", model.nq, core))
    n = len(positions)
    if positions.ndim != 2 or n == 0:
        raise MotionError(f"q has shape {positions.shape}; expected one position, ({model.nq},), or (n, {model.nq}) with one or more")
    rates = (np.zeros(model.nv) if x is None else argument_rows(x, name, model.nv, core) for x, name in ((v, "v"), (a, "a")))
    velocity, acceleration = (of_all(x, name, n) for x, name in zip(rates, "va"))
    times = np.zeros(n) if time is None else np.atleast_1d(np.asarray(real_array(time, "time"), dtype=float))
    if times.shape != (n,) or not np.isfinite(times).all():
        raise MotionError(f"time has shape {times.shape}, and q {positions.shape}; expected a finite time for each position")
    wrenches = {name: of_all(argument_rows(w, what, 6, core), what, n) for name, w in items_of(external) for what in (f"external[{name!r}]",)}
    tau, total, constraint, unloaded = _loads(model, positions, velocity, acceleration, wrenches)
    poses = model.frame_poses(positions)
    index = {name: i for i, name in enumerate(model.link_names)}
    scene = Scene(
        model, look or appearance(model, package_paths, triangles), times, positions, velocity, acceleration, wrenches, poses,
        model.frame_velocities(positions, velocity, axes="world", at="frame"), constraint, total, _efforts(model, tau), model.center_of_mass(positions), np.arange(n),
        {name: _in_world(w, poses[:, index[name], :3, :3]) for name, w in wrenches.items()}, unloaded,
    )  # fmt: skip
    of_joints = scene.frames[..., :3, :3]  # a link may be called `world`
    total, constraint = (np.einsum("njab,njwb->njwa", of_joints, x.reshape(n, -1, 2, 3)).reshape(n, -1, 6) for x in (total, constraint))
    return replace(scene, constraint=constraint, actuation=total - constraint)


def _loads(model: Calls, q: Array, v: Array, a: Array, wrenches: Mapping[str, Array]) -> tuple[Array, Array, Array, str]:
    """Efforts (n, nv), wrenches (n, joints, 6) and their constraint parts in the axes of the joints; or none of them, and why."""
    names = [*(j.name for j in model.joints), *model.loop_names]
    requests = tuple(model.reaction_request("child", "joint", "joint", "lin_ang", part, names) for part in ("total", "constraint"))
    try:
        tau, total, constraint = model.inverse_dynamics_with_reactions(q, v, a, requests, wrenches)
        return tau, total, constraint, ""
    except ValueError as refused:
        if not model.loops or (len(q) > 1 and model.drives is not None):
            raise
        for link in wrenches:
            model.link(link)  # refuses unknown ones
        nothing = np.zeros((len(q), len(names), 6))
        return np.full((len(q), model.nv), np.nan), nothing, nothing, as_call(refused, "inverse_dynamics_with_reactions")


def child_of(joint: Joint | Loop) -> str:
    """The link on the child side of a joint."""
    return joint.child if isinstance(joint, Joint) else joint.successor


def has_axis(joint: Joint | Loop) -> bool:
    return KINDS[joint.kind].has_axis


def moves(joint: Joint | Loop) -> bool:
    """Whether both sides of a joint move against each other: mimic joints, too."""
    return KINDS[joint.kind].nv > 0


def sizes(vectors: Array) -> Array:
    """Lengths (…) of vectors (…, 3), whose squares may be too large for a number."""
    found: Array = np.hypot(np.hypot(vectors[..., 0], vectors[..., 1]), vectors[..., 2])
    return found


def scale_of(wrenches: Array, size: float) -> Scale:
    """The scale for wrenches (…, 6): 1 m stands for 1, 2 or 5 · 10ⁿ N and N m, the longest arrow for at most LONGEST times the size, m."""
    force, moment = (float(sizes(wrenches[..., part]).max(initial=0.0)) for part in (slice(0, 3), slice(3, 6)))
    return Scale(*(1 / _round_up(largest / (LONGEST * size)) for largest in (force, moment)))


def thinned(values: Array, most: int = SAMPLES) -> NDArray[np.intp]:
    """At most about `most` indices of samples, evenly spread, and of each column of `values` (n, …) that of its largest size."""
    n = len(values)
    if n <= most:
        return np.arange(n)
    peaks = np.argmax(np.abs(values.reshape(n, -1)), axis=0)
    return np.unique(np.concatenate([np.linspace(0, n - 1, most).round().astype(np.intp), peaks]))


def of_all(x: Array, name: str, n: int) -> Array:
    """Numbers of each of n samples; those of one stand for all."""
    if x.shape[:-1] not in ((), (1,), (n,)):
        raise MotionError(f"{name} has shape {x.shape}; expected ({x.shape[-1]},) for all positions, or ({n}, {x.shape[-1]})")
    return np.broadcast_to(x, (n, x.shape[-1]))


def resting_position(model: Calls) -> Array:
    """The neutral position, moved into the limits of joints; of a mechanism with loops a closed one near to it, if one is found."""
    q = model.neutral()
    for joint in model.joints:
        for k, (lower, upper) in enumerate(joint.limits if joint.nq else ()):
            low, high = -np.inf if lower is None else lower, np.inf if upper is None else upper
            if low <= high and not low <= q[joint.q_index + k] <= high:  # in the middle rather than at an end
                q[joint.q_index + k] = (low + high) / 2 if np.isfinite(low + high) else min(max(0.0, low), high)
    return closed_near(model, q) if model.loops else q


def _efforts(model: Calls, tau: Array) -> Array:
    """Efforts of joints with one coordinate that have a drive; in a tree each has one."""
    effort = np.full((len(tau), len(model.joints) + len(model.loops)), np.nan)
    for i, joint in enumerate(model.joints):
        if joint.one_coordinate and joint.leader is None and (not model.loops or joint.name in (model.drives or ())):
            effort[:, i] = tau[:, joint.v_index]
    return effort


def _in_world(wrench: Array, rotation: Array) -> Array:
    """Force and moment (n, 6) from a link's axes to the world's."""
    both: Array = np.einsum("nij,nkj->nki", rotation, wrench.reshape(-1, 2, 3)).reshape(-1, 6)
    return both


def _round_up(x: float) -> float:
    """The least of 1, 2 and 5 · 10ⁿ that is not below x; 1 for zero."""
    if x <= 1e-9:
        return 1.0
    power = 10.0 ** np.floor(np.log10(x))
    return float(power * next(step for step in (1, 2, 5, 10) if step * power >= x * (1 - 1e-12)))
