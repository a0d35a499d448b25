"""Random mechanisms with a loop that a joint of a given kind closes, and the same ones closed in another way."""

from __future__ import annotations

from dataclasses import dataclass

import ksl
import numpy as np

KINDS = ("fixed", "revolute", "continuous", "prismatic", "helical", "cylindrical", "universal", "spherical", "planar", "translation")
IN_TREES = (*KINDS[1:], "spherical", "cylindrical")


def unit(rng):
    u = rng.normal(size=3)
    return u / np.linalg.norm(u)


def rotation(rng):
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q if np.linalg.det(Q) > 0 else -Q


def pose(rng):
    D = np.eye(4)
    D[:3, :3], D[:3, 3] = rotation(rng), rng.uniform(-0.4, 0.4, 3)
    return D


def options(kind, rng):
    given = {}
    if kind in ("revolute", "continuous", "prismatic", "helical", "cylindrical", "universal", "planar"):
        given["axis"] = unit(rng)
    if kind == "universal":
        given["axis2"] = unit(rng)
    if kind == "helical":
        given["pitch"] = rng.uniform(0.1, 0.5)
    return given


def body(rng):
    R = rotation(rng)
    return {"mass": rng.uniform(0.3, 3), "center_of_mass": rng.uniform(-0.2, 0.2, 3), "inertia": R @ np.diag(rng.uniform(0.02, 0.03, 3)) @ R.T}


@dataclass
class Case:
    """A closed mechanism at a position, and the same one with the loop's joint in the tree and a weld that closes it."""

    model: ksl.Model
    q: np.ndarray
    welded: ksl.Model
    q_welded: np.ndarray
    drives: list[str]

    def in_welded(self, x, numbers="v"):
        """Coordinates of the model in the order of the other; those of the loop's joint are zero."""
        out = np.zeros(self.welded.nv)
        for name in self.model.joint_names:
            a, b = self.model.joint(name), self.welded.joint(name)
            out[b.v_index : b.v_index + b.nv] = x[a.v_index : a.v_index + a.nv]
        return out


def joint_position(kind, given, rng):
    """A random position of a joint, and the pose of its child there."""
    b = ksl.Builder("joint").add_link("a").add_link("b", mass=1.0, inertia=np.eye(3))
    b.add_joint("j", kind, "a", "b", **given)
    m = b.build()
    q = m.random(rng) if m.nq else np.zeros(0)
    return q, m.frame_pose(q, "b")


def random_case(kind, seed, lengths=None, gravity=(1.0, -2.0, 9.0)):
    """Two branches of random joints from the ground, closed by a joint of this kind."""
    rng = np.random.default_rng(seed)
    links, joints = [], []
    for branch in range(2):
        parent = "ground"
        for k in range(lengths[branch] if lengths else int(rng.integers(2, 5))):
            name = f"{'ab'[branch]}{k}"
            links.append((name, body(rng)))
            joint_kind = str(rng.choice(IN_TREES))
            joints.append((f"J{name}", joint_kind, parent, name, pose(rng), options(joint_kind, rng)))
            parent = name
    ends = [links[-1][0] if branch else [n for n, _ in links if n[0] == "a"][-1] for branch in range(2)]
    given = options(kind, rng)

    def builder():
        b = ksl.Builder("closed", gravity=gravity).add_link("ground")
        for name, mass in links:
            b.add_link(name, **mass)
        for name, joint_kind, parent, child, D, more in joints:
            b.add_joint(name, joint_kind, parent, child, pose=D, **more)
        return b

    tree = builder().build()
    q = tree.random(rng)
    on_a = pose(rng)
    q_loop, across = joint_position(kind, given, rng)
    on_b = np.linalg.inv(tree.frame_pose(q, ends[1])) @ tree.frame_pose(q, ends[0]) @ on_a @ across
    on_b[:3, :3] = np.linalg.svd(on_b[:3, :3])[0] @ np.linalg.svd(on_b[:3, :3])[2]
    model = builder().add_loop("L", kind, ends[0], ends[1], on_a, on_b, **given).build()
    drives = sorted({j.name for i in model.independent(q) for j in model.joints if j.v_index <= i < j.v_index + j.nv})
    model = model.with_drives(drives)
    # the same mechanism: the joint carries a massless link, which a weld closes to the other end
    b = builder().add_link("extra").add_joint("L", kind, ends[0], "extra", pose=on_a, **given)
    welded = b.add_loop("weld", "fixed", "extra", ends[1], np.eye(4), on_b).build(drives=drives)
    q_welded = np.zeros(welded.nq)
    for name in tree.joint_names:
        x, y = tree.joint(name), welded.joint(name)
        q_welded[y.q_index : y.q_index + y.nq] = q[x.q_index : x.q_index + x.nq]
    if len(q_loop):
        start = welded.joint("L").q_index
        q_welded[start : start + len(q_loop)] = q_loop
    return Case(model, q, welded, q_welded, drives)
