"""The witness: inverse dynamics from the textbook, in world coordinates, with dense 6 × 6 matrices in plain NumPy.

Everything that KSL does to be fast is absent: no body is lumped, no frame is turned, nothing is expressed in a body, and
there is one coordinate system, the world.  Six-vectors are angular first, about the world's origin, which KSL's never are.
Featherstone, RBDA (2008): twists and wrenches (2.19)–(2.30), rigid-body inertia (2.63), Newton–Euler (5.7)–(5.12).
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np


@dataclass
class Link:
    name: str
    mass: float = 0.0
    centroid: np.ndarray = field(default_factory=lambda: np.zeros(3))
    about_centroid: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    """Inertia about the centroid in the link's axes."""


@dataclass
class Joint:
    name: str
    kind: str
    parent: str
    child: str
    placement: np.ndarray
    axis: np.ndarray
    pitch: float = 0.0
    """m/rad"""
    axis2: np.ndarray | None = None
    """Of universal joints."""


@dataclass
class Tree:
    """Links and joints of a URDF file; joints sorted so that parents come first."""

    links: dict[str, Link]
    joints: list[Joint]
    root: str


def read_tree(text: str) -> Tree:
    robot = ET.fromstring(text)
    links = {e.get("name"): read_link(e) for e in robot.findall("link")}
    joints = [
        Joint(
            e.get("name"),
            e.get("type"),
            e.find("parent").get("link"),
            e.find("child").get("link"),
            read_origin(e),
            read_axis(e),
            read_pitch(e),
            read_axis(e, "axis2"),
        )
        for e in robot.findall("joint")
    ]
    (root,) = set(links) - {j.child for j in joints}
    sorted_joints, pending = [], [root]
    while pending:
        parent = pending.pop()
        for joint in joints:
            if joint.parent == parent:
                sorted_joints.append(joint)
                pending.append(joint.child)
    return Tree(links, sorted_joints, root)


def numbers(element, tag: str, attribute: str, default: str) -> np.ndarray:
    found = element.find(tag)
    return np.array([float(x) for x in (default if found is None else found.get(attribute, default)).split()])


def read_axis(element, tag: str = "axis") -> np.ndarray:
    axis = numbers(element, tag, "xyz", "1 0 0")
    return axis / np.linalg.norm(axis)


def read_pitch(element) -> float:
    return float(numbers(element, "screw_thread_pitch", "value", "0")[0]) / (2 * np.pi)


def read_origin(element) -> np.ndarray:
    roll, pitch, yaw = numbers(element, "origin", "rpy", "0 0 0")
    T = turn([0, 0, 1], yaw) @ turn([0, 1, 0], pitch) @ turn([1, 0, 0], roll)
    T[:3, 3] = numbers(element, "origin", "xyz", "0 0 0")
    return T


def read_link(element) -> Link:
    inertial = element.find("inertial")
    if inertial is None:
        return Link(element.get("name"))
    T = read_origin(inertial)
    xx, yy, zz, xy, xz, yz = (float(inertial.find("inertia").get(k)) for k in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return Link(element.get("name"), float(inertial.find("mass").get("value")), T[:3, 3].copy(), T[:3, :3] @ tensor @ T[:3, :3].T)


def skew(x) -> np.ndarray:
    """(…, 3) → (…, 3, 3): skew(x) y = x × y."""
    x = np.asarray(x, dtype=float)
    S = np.zeros((*x.shape, 3))
    S[..., 0, 1], S[..., 0, 2], S[..., 1, 2] = -x[..., 2], x[..., 1], -x[..., 0]
    return S - np.swapaxes(S, -1, -2)


def turn(axis, angle) -> np.ndarray:
    """Pose (…, 4, 4) of a rotation by angle (…) about an axis through the origin: Rodrigues' formula."""
    K, angle = skew(axis), np.asarray(angle, dtype=float)[..., None, None]
    T = np.zeros((*angle.shape[:-2], 4, 4))
    T[..., :3, :3] = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)
    T[..., 3, 3] = 1
    return T


def shift(x) -> np.ndarray:
    x = np.asarray(x, dtype=float)
    T = np.broadcast_to(np.eye(4), (*x.shape[:-1], 4, 4)).copy()
    T[..., :3, 3] = x
    return T


def quaternion_turn(q) -> np.ndarray:
    """Pose (…, 4, 4) of the rotation of unit quaternions (…, 4), xyzw: exp of twice the half angle."""
    q = np.asarray(q, dtype=float)
    K = skew(q[..., :3])
    T = np.zeros((*q.shape[:-1], 4, 4))
    T[..., :3, :3] = np.eye(3) + 2 * q[..., 3, None, None] * K + 2 * (K @ K)
    T[..., 3, 3] = 1
    return T


def adjoint(T) -> np.ndarray:
    """(…, 6, 6), angular first: takes twists from the frame whose pose is T into the frame that T is seen from."""
    R, p = T[..., :3, :3], T[..., :3, 3]
    X = np.zeros((*T.shape[:-2], 6, 6))
    X[..., :3, :3] = X[..., 3:, 3:] = R
    X[..., 3:, :3] = skew(p) @ R
    return X


def coadjoint(T) -> np.ndarray:
    """The same for wrenches: inverse transpose of the adjoint."""
    R, p = T[..., :3, :3], T[..., :3, 3]
    X = np.zeros((*T.shape[:-2], 6, 6))
    X[..., :3, :3] = X[..., 3:, 3:] = R
    X[..., :3, 3:] = skew(p) @ R
    return X


def motion_cross(v) -> np.ndarray:
    """v ×, on twists; its negative transpose is v ×*, on wrenches."""
    X = np.zeros((*v.shape[:-1], 6, 6))
    X[..., :3, :3] = X[..., 3:, 3:] = skew(v[..., :3])
    X[..., 3:, :3] = skew(v[..., 3:])
    return X


def transpose(A) -> np.ndarray:
    return np.swapaxes(A, -1, -2)


def apply(A, x) -> np.ndarray:
    return (A @ x[..., None])[..., 0]


def inertia_matrix(link: Link) -> np.ndarray:
    """6 × 6 about the link's origin."""
    c = skew(link.centroid)
    return np.block([[link.about_centroid + link.mass * c @ c.T, link.mass * c], [link.mass * c.T, link.mass * np.eye(3)]])


@dataclass
class Motion:
    """What a joint does: pose of its child in its frame (…, 4, 4), twist subspace in the child's frame (…, 6, n)."""

    pose: np.ndarray
    subspace: np.ndarray
    drift: Callable[[np.ndarray], np.ndarray] | None = None
    """The rate of the subspace in the child's frame times the velocity (…, n): (…, 6); None where the subspace is constant."""


def in_plane(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The axes x and y of a planar joint.  x is the coordinate axis that follows, in the order x y z x, the one nearest to the
    normal, made orthogonal to it; z goes before x, and x before y, where two are as near."""
    nearest = max((2, 0, 1), key=lambda i: abs(normal[i]))
    x = np.eye(3)[(nearest + 1) % 3]
    x = x - (x @ normal) * normal
    x /= np.linalg.norm(x)
    return x, np.cross(normal, x)


def universal_motion(joint: Joint, q: np.ndarray) -> Motion:
    """The first axis moves in the child; the second is fixed there."""
    first, second = joint.axis, joint.axis2
    seen = (np.swapaxes(turn(second, q[..., 1])[..., :3, :3], -1, -2) @ first[:, None])[..., 0]
    subspace = np.zeros((*q.shape[:-1], 6, 2))
    subspace[..., :3, 0], subspace[..., :3, 1] = seen, second

    def drift(v):
        rate = np.zeros((*v.shape[:-1], 6))
        rate[..., :3] = -np.cross(second, seen) * (v[..., 0] * v[..., 1])[..., None]
        return rate

    return Motion(turn(first, q[..., 0]) @ turn(second, q[..., 1]), subspace, drift)


def joint_motion(joint: Joint, q: np.ndarray) -> Motion:
    axis, zero = joint.axis, np.zeros(3)
    if joint.kind in ("revolute", "continuous"):
        return Motion(turn(axis, q[..., 0]), np.concatenate([axis, zero])[:, None])
    if joint.kind == "prismatic":
        return Motion(shift(q[..., :1] * axis), np.concatenate([zero, axis])[:, None])
    if joint.kind == "helical":
        return Motion(turn(axis, q[..., 0]) @ shift(joint.pitch * q[..., :1] * axis), np.concatenate([axis, joint.pitch * axis])[:, None])
    if joint.kind == "cylindrical":
        return Motion(turn(axis, q[..., 0]) @ shift(q[..., 1:] * axis), np.array([[*axis, *zero], [*zero, *axis]]).T)
    if joint.kind == "universal":
        return universal_motion(joint, q)
    if joint.kind == "planar":  # v = [linear, angular] in the child's axes
        x, y = in_plane(axis)
        return Motion(shift(q[..., :1] * x + q[..., 1:2] * y) @ turn(axis, q[..., 2]), np.array([[*zero, *x], [*zero, *y], [*axis, *zero]]).T)
    if joint.kind == "translation":
        return Motion(shift(q), np.eye(6)[:, 3:])
    if joint.kind == "spherical":
        return Motion(quaternion_turn(q), np.eye(6)[:, :3])
    if joint.kind == "floating":  # v = [linear, angular]
        return Motion(shift(q[..., :3]) @ quaternion_turn(q[..., 3:]), np.eye(6)[:, [3, 4, 5, 0, 1, 2]])
    return Motion(np.broadcast_to(np.eye(4), (*q.shape[:-1], 4, 4)), np.zeros((6, 0)))


@dataclass
class Result:
    """Per link name: pose; in world coordinates twist, rate of momentum, weight and wrench of the joint that carries it."""

    pose: dict[str, np.ndarray]
    twist: dict[str, np.ndarray]
    subspace: dict[str, np.ndarray]
    """Of the joint that carries the link, in world coordinates (…, 6, n)."""
    momentum_rate: dict[str, np.ndarray]
    weight: dict[str, np.ndarray]
    external: dict[str, np.ndarray]
    wrench: dict[str, np.ndarray]
    effort: dict[str, np.ndarray]
    """Per link name: that of the joint which carries the link."""
    kinetic: np.ndarray
    potential: np.ndarray

    def in_joint_frame(self, link: str) -> np.ndarray:
        """The wrench (…, 6) through the joint that carries a link: at its origin, in the link's axes, force first."""
        w = apply(np.linalg.inv(coadjoint(self.pose[link])), self.wrench[link])
        return np.concatenate([w[..., 3:], w[..., :3]], axis=-1)


def newton_euler(tree: Tree, q: dict, v: dict, a: dict, external: dict | None = None, gravity=(0.0, 0.0, -9.81), floating_base: bool = False) -> Result:
    """q, v, a: {joint name: (…, n)}; external: {link: (…, 6)}, force first, at the link's origin, in its axes.

    With a floating base the first joint is `floating_base`, between the world and the root.
    """
    ground = Joint("floating_base" if floating_base else "base", "floating" if floating_base else "fixed", "", tree.root, np.eye(4), np.zeros(3))
    joints = [ground, *tree.joints]
    leading = next(iter(q.values())).shape[:-1] if q else ()
    nothing = np.zeros((*leading, 0))
    pose, twist, acceleration = {"": np.eye(4)}, {"": np.zeros((*leading, 6))}, {"": np.zeros((*leading, 6))}
    r = Result(pose, twist, {}, {}, {}, {}, {}, {}, np.zeros(leading), np.zeros(leading))
    g = np.asarray(gravity, dtype=float)
    for j in joints:
        motion = joint_motion(j, q.get(j.name, nothing))
        pose[j.child] = pose[j.parent] @ j.placement @ motion.pose
        S = adjoint(pose[j.child]) @ motion.subspace
        own = apply(S, v.get(j.name, nothing))
        r.subspace[j.child] = S
        twist[j.child] = twist[j.parent] + own
        # where S is constant in the child, its rate is twist × S
        acceleration[j.child] = acceleration[j.parent] + apply(S, a.get(j.name, nothing)) + apply(motion_cross(twist[j.child]), own)
        if motion.drift is not None:
            acceleration[j.child] = acceleration[j.child] + apply(adjoint(pose[j.child]), motion.drift(v[j.name]))
        link = tree.links[j.child]
        X = coadjoint(pose[j.child])
        inertia = X @ inertia_matrix(link) @ transpose(X)
        momentum = apply(inertia, twist[j.child])
        r.momentum_rate[j.child] = apply(inertia, acceleration[j.child]) - apply(transpose(motion_cross(twist[j.child])), momentum)
        centroid = apply(pose[j.child], np.append(link.centroid, 1.0))[..., :3]
        r.weight[j.child] = np.concatenate([np.cross(centroid, link.mass * g), np.broadcast_to(link.mass * g, centroid.shape)], axis=-1)
        given = (external or {}).get(j.child, np.zeros((*leading, 6)))
        r.external[j.child] = apply(X, np.concatenate([given[..., 3:], given[..., :3]], axis=-1))
        r.kinetic = r.kinetic + 0.5 * np.sum(momentum * twist[j.child], axis=-1)
        r.potential = r.potential - link.mass * (centroid @ g)
    for j in reversed(joints):
        held = r.momentum_rate[j.child] - r.weight[j.child] - r.external[j.child]
        for child in joints:
            if child.parent == j.child:
                held = held + r.wrench[child.child]
        r.wrench[j.child] = held
        r.effort[j.child] = apply(transpose(r.subspace[j.child]), held)
    return r
