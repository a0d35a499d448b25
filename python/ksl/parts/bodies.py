"""Bodies of a mechanism, and what acts on each along a motion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ksl.mechanism.calls import Calls
from ksl.mechanism.lengths import ROUND_OFF
from ksl.mechanism.mechanism import Joint, Link, Loop
from ksl.mechanism.payload import Payload
from ksl.mechanism.states import Array
from ksl.parts.free_body import FreeBody, PartWrench

Welded = Literal["together", "apart"]
OPEN = 1e-9
"""What a pattern of undetermined reactions has to reach in a component, in the body's axes, to leave it open."""


@dataclass(frozen=True)
class Entry:
    """Something that acts on a body, over all samples."""

    name: str
    kind: str
    point: Array
    """(n, 3)."""
    wrench: Array
    """(n, 6)."""
    joint: str = ""
    """The joint whose reaction it is, or "" for others."""
    turn: Array | None = None
    """(n, 3, 3): from the axes of that joint to those of the body."""


@dataclass(frozen=True)
class BodyOverTime:
    """A body with what acts on it, over all samples, in its axes."""

    link: str
    links: tuple[str, ...]
    entries: tuple[Entry, ...]
    gravity: Array
    """(n, 6)."""
    inertia: Array
    motion: tuple[Array, Array, Array]
    """Acceleration of the origin, angular velocity and angular acceleration, each (n, 3)."""
    field: Array
    """(n, 3): the acceleration of free fall."""
    mass: float
    center: Array

    def vectors(self) -> Array:
        """(n, 6 entries): all wrenches beside each other."""
        return np.concatenate([entry.wrench for entry in self.entries], axis=1) if self.entries else np.zeros((len(self.gravity), 0))

    def at(self, k: int, patterns: Mapping[str, Array]) -> FreeBody:
        """The free body of sample k.  patterns: {joint: (redundant, 6)}, those of joints that rigid bodies leave open there."""
        wrenches = tuple(PartWrench(e.name, e.kind, e.point[k], e.wrench[k], _open(e, k, patterns.get(e.joint))) for e in self.entries)
        acceleration, spin, turn = (x[k] for x in self.motion)
        return FreeBody(self.link, self.links, wrenches, self.gravity[k], self.inertia[k], acceleration, spin, turn, self.field[k], self.mass, self.center)


def _open(entry: Entry, k: int, patterns: Array | None) -> NDArray[np.bool_]:
    if patterns is None or entry.turn is None or not len(patterns):
        return np.zeros(6, dtype=bool)
    R = entry.turn[k]
    turned = np.concatenate([patterns[:, part] @ R.T for part in (slice(0, 3), slice(3, 6))], axis=1)
    return np.asarray((np.abs(turned) > OPEN).any(axis=0))


def welded_links(model: Calls, welded: Welded) -> dict[str, tuple[str, ...]]:
    """{topmost link: the links of its body}, parents first."""
    top: dict[str, str] = {}
    for link in model.link_names:
        joint = model.joint_above(link)
        is_on_parent = welded == "together" and joint.kind == "fixed" and joint.parent is not None
        top[link] = top[joint.parent] if is_on_parent and joint.parent is not None else link
    return {name: tuple(link for link, of in top.items() if of == name) for name in dict.fromkeys(top.values())}


class BodiesOverTime:
    """All bodies of a mechanism along samples q (n, nq), v and a (n, nv), with external wrenches {link: (n, 6)}, at links' origins in their axes.

    O(samples × links): reactions, poses and motions are computed once for all.
    """

    def __init__(self, model: Calls, q: Array, v: Array, a: Array, external: Mapping[str, Array], welded: Welded = "together") -> None:
        self.model, self.q, self.v = model, q, v
        self.external = external
        self.links_of = welded_links(model, welded)
        self._joints: list[Joint | Loop] = [*model.joints, *model.loops]
        self._index = {joint.name: i for i, joint in enumerate(self._joints)}
        self.reactions = model.reactions(q, v, a, dict(external) or None, joints=list(self._index))
        """(n, joints, 6): on the child, at the joint, in its axes; joints that close loops last."""
        names = [f"link:{name}" for name in model.link_names]
        self._at = {name: i for i, name in enumerate(model.link_names)}
        self._poses = model.frame_poses(q, names)
        self._twists = model.frame_velocities(q, v, names)
        self._accelerations = model.frame_accelerations(q, v, a, names, kind="classical")
        self._elements = _element_forces(model, q, v, self._poses, self._at)

    @property
    def joint_names(self) -> list[str]:
        return list(self._index)

    def body(self, top: str) -> BodyOverTime:
        """What acts on the body of a topmost link."""
        links, i = self.links_of[top], self._at[top]
        acceleration, spin, turn = self._accelerations[:, i, :3], self._twists[:, i, 3:], self._accelerations[:, i, 3:]
        field = np.einsum("nba,b->na", self._poses[:, i, :3, :3], self.model.gravity)
        entries = [*self._of_joints(top, links), *self._of_payloads(top, links, acceleration, spin, turn, field), *self._of_others(top, links)]
        parts = [_without_payloads(self.model.link(name), self.model.payloads).in_frame(self._relative(top, name)[0]) for name in links]
        m = sum(part.mass for part in parts)
        h, I = np.sum([part.first_moment for part in parts], axis=0), np.sum([part.about_origin for part in parts], axis=0)
        whole = sum(self.model.link(name).mass for name in links)
        force = m * acceleration + np.cross(turn, h) + np.cross(spin, np.cross(spin, h))
        moment = np.cross(h, acceleration) + turn @ I + np.cross(spin, spin @ I)
        weight = np.concatenate([m * field, np.cross(h, field)], axis=1)
        inertia = -np.concatenate([force, moment], axis=1)
        center = h / m if m > ROUND_OFF * whole else np.zeros(3)
        return BodyOverTime(top, links, tuple(_renamed(entries)), weight, inertia, (acceleration, spin, turn), field, m, center)

    def free_bodies(self, k: int, links: Iterable[str]) -> dict[str, FreeBody]:
        """The free bodies of sample k."""
        found = {top: self.body(top) for top in links}
        patterns: dict[str, Array] = {}
        if self.model.loops:
            of_joints = self.model.reactions_null_basis(self.q[k], self.joint_names)
            patterns = {name: of_joints[:, i] for name, i in self._index.items()}
        return {top: body.at(k, patterns) for top, body in found.items()}

    def _relative(self, top: str, link: str) -> Array:
        """(n, 4, 4): a link's frame in that of another."""
        own, other = self._poses[:, self._at[top]], self._poses[:, self._at[link]]
        if top == link:
            return np.broadcast_to(np.eye(4), own.shape)
        found = np.broadcast_to(np.eye(4), own.shape).copy()
        found[:, :3, :3] = np.einsum("nba,nbc->nac", own[:, :3, :3], other[:, :3, :3])
        found[:, :3, 3] = np.einsum("nba,nb->na", own[:, :3, :3], other[:, :3, 3] - own[:, :3, 3])
        return found

    def _of_joints(self, top: str, links: tuple[str, ...]) -> list[Entry]:
        """Reactions, at the child's frame on both sides; those between two links of the body are inside it."""
        entries = []
        for joint in self._joints:
            loop = isinstance(joint, Loop)
            child, parent = (joint.successor, joint.predecessor) if isinstance(joint, Loop) else (joint.child, joint.parent)
            if (child in links) == (parent in links):
                continue
            frame = self._relative(top, child)
            if isinstance(joint, Loop):
                frame = frame @ np.reshape(joint.successor_pose, (4, 4))
            sign = 1.0 if child in links else -1.0
            wrench = sign * turned(frame[:, :3, :3], self.reactions[:, self._index[joint.name]])
            entries.append(Entry(joint.name, "loop" if loop else "joint", frame[:, :3, 3], wrench, joint.name, frame[:, :3, :3]))
        return entries

    def _of_payloads(self, top: str, links: tuple[str, ...], acceleration: Array, spin: Array, turn: Array, field: Array) -> list[Entry]:
        """Weight and inertia of each payload, at its centre of mass."""
        entries = []
        for payload in self.model.payloads:
            if payload.link not in links:
                continue
            relative = self._relative(top, payload.link)[0]  # of one body: it doesn't move
            center = relative[:3, :3] @ payload.center + relative[:3, 3]
            at_center = acceleration + np.cross(turn, center) + np.cross(spin, np.cross(spin, center))
            tensor = relative[:3, :3] @ tensor_of(payload) @ relative[:3, :3].T
            moment = -(turn @ tensor + np.cross(spin, spin @ tensor))
            wrench = np.concatenate([payload.mass * (field - at_center), moment], axis=1)
            entries.append(Entry(payload.link, "payload", np.broadcast_to(center, field.shape), wrench))
        return entries

    def _of_others(self, top: str, links: tuple[str, ...]) -> list[Entry]:
        """External wrenches at links' origins, and force elements at their points."""
        entries = []
        for link, wrench in self.external.items():
            if link in links:
                frame = self._relative(top, link)
                entries.append(Entry(link, "external", frame[:, :3, 3], turned(frame[:, :3, :3], wrench)))
        for name, link, point, force in self._elements:
            if link in links:
                frame = self._relative(top, link)
                on_body = np.einsum("nab,nb->na", np.swapaxes(self._poses[:, self._at[top], :3, :3], 1, 2), force)
                entries.append(
                    Entry(name, "force element", frame[:, :3, :3] @ point + frame[:, :3, 3], np.concatenate([on_body, np.zeros_like(on_body)], axis=1))
                )
        return entries


def turned(R: Array, wrench: Array) -> Array:
    """Wrenches (n, 6) in other axes, about the same points."""
    return np.concatenate([np.einsum("nij,nj->ni", R, wrench[:, k : k + 3]) for k in (0, 3)], axis=1)


def _element_forces(model: Calls, q: Array, v: Array, poses: Array, at: Mapping[str, int]) -> list[tuple[str, str, Array, Array]]:
    """Each end of each force element that acts: its name, the link, the point in the link's frame and the force (n, 3) on it in world axes."""
    if "force elements" not in model.physics or not model.force_elements:
        return []
    states = model.force_element_states(q, v)
    found = []
    for k, element in enumerate(model.force_elements):
        ends = [(link, np.array(point)) for link, point in ((element.link1, element.point1), (element.link2, element.point2))]
        one, other = (poses[:, at[link], :3, :3] @ point + poses[:, at[link], :3, 3] for link, point in ends)
        length = states.length[..., k, None]
        pull = states.tension[..., k, None] * (other - one) / np.where(length > 0, length, 1)
        found += [(element.name, link, point, sign * pull) for (link, point), sign in zip(ends, (1.0, -1.0), strict=True)]
    return found


def _renamed(entries: list[Entry]) -> list[Entry]:
    """Entries of one kind and name are told apart: "tool0", "tool0 (2)"."""
    seen: dict[tuple[str, str], int] = {}
    named = []
    for e in entries:
        n = seen[e.kind, e.name] = seen.get((e.kind, e.name), 0) + 1
        named.append(e if n == 1 else Entry(f"{e.name} ({n})", e.kind, e.point, e.wrench, e.joint, e.turn))
    return named


class OwnInertia(NamedTuple):
    """Mass, first moment and inertia (3, 3) about a frame's origin, in its axes."""

    mass: float
    first_moment: Array
    about_origin: Array

    def in_frame(self, pose: Array) -> OwnInertia:
        """In the frame in which this one has the pose (4, 4)."""
        R, p, m, h = pose[:3, :3], pose[:3, 3], self.mass, pose[:3, :3] @ self.first_moment
        about = R @ self.about_origin @ R.T + 2 * (h @ p) * np.eye(3) - np.outer(h, p) - np.outer(p, h) + m * _of_point(p)
        return OwnInertia(m, h + m * p, about)


def _without_payloads(link: Link, payloads: Iterable[Payload]) -> OwnInertia:
    """The inertia of a link, as its file gives it."""
    xx, yy, zz, xy, yz, zx = link.inertia
    m, h, I = link.mass, np.array(link.first_moment), np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])
    for p in payloads:
        if p.link == link.name:
            c = np.array(p.center)
            m, h, I = m - p.mass, h - p.mass * c, I - tensor_of(p) - p.mass * _of_point(c)
    return OwnInertia(m, h, I)


def tensor_of(payload: Payload) -> Array:
    """(3, 3): about its centre of mass, in the link's axes."""
    return np.reshape(payload.inertia or [0.0] * 9, (3, 3))


def _of_point(p: Array) -> Array:
    """(3, 3): the inertia of a unit mass at a point."""
    return np.asarray(p @ p * np.eye(3) - np.outer(p, p))
