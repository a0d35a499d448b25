"""Robots with mimic joints, and the dense projection of the same robot with independent joints: q̂ = G q + c, τ = Gᵀ τ̂, M = Gᵀ M̂ G."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

import ksl
from random_tree import load_text, random_external, random_states, random_tree

COUPLED = ("revolute", "continuous", "prismatic", "helical")


def with_mimics(text: str, rng: np.random.Generator) -> str:
    """Makes about a third of the joints with one coordinate follow another, some through chains, in either direction of the tree."""
    robot = ET.fromstring(text)
    joints = [j for j in robot.findall("joint") if j.get("type") in COUPLED]
    rng.shuffle(joints)
    for i, joint in enumerate(joints[1:], 1):
        if rng.random() < 0.4:
            leader = joints[rng.integers(i)].get("name")  # earlier in this order, so that no cycle arises
            ET.SubElement(joint, "mimic", joint=leader, multiplier=repr(float(rng.normal())), offset=repr(float(rng.normal() * 0.3)))
    return ET.tostring(robot, encoding="unicode")


class Projection:
    """A coupled robot, the same with independent joints, and G and c between them."""

    def __init__(self, coupled: ksl.Model, independent: ksl.Model) -> None:
        self.m, self.free = coupled, independent
        self.G = np.zeros((independent.nv, coupled.nv))
        for joint in independent.joints:
            own = coupled.joint(joint.name)
            for k in range(own.nv):
                self.G[joint.v_index + k, own.v_index + k] = 1
            if own.leader:
                self.G[joint.v_index, coupled.joint(own.leader).v_index] = own.multiplier

    def position(self, q: np.ndarray) -> np.ndarray:
        out = np.empty((*q.shape[:-1], self.free.nq))
        for joint in self.free.joints:
            own = self.m.joint(joint.name)
            if own.leader:
                out[..., joint.q_index] = own.multiplier * q[..., self.m.joint(own.leader).q_index] + own.offset
            elif joint.nq:
                out[..., joint.q_index : joint.q_index + joint.nq] = q[..., own.q_index : own.q_index + own.nq]
        return out

    def motion(self, v: np.ndarray) -> np.ndarray:
        return v @ self.G.T


def random_projection(seed: int) -> tuple[Projection, np.random.Generator]:
    rng = np.random.default_rng(seed)
    text = with_mimics(random_tree(rng, int(rng.integers(2, 24))), rng)
    return Projection(load_text(text, floating_base=bool(seed % 2)), load_text(text, floating_base=bool(seed % 2), mimic="independent")), rng


def close(found, expected, tolerance: float = 1e-12, scale: float = 0.0) -> None:
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max(initial=0) <= tolerance * max(1.0, scale, np.abs(expected).max(initial=0))


def check_projection(p: Projection, rng: np.random.Generator, n: int = 3) -> None:
    m, free, G = p.m, p.free, p.G
    q, v, a = random_states(m, rng, n)
    external = random_external(m, rng, n)
    Q, V, A = p.position(q), p.motion(v), p.motion(a)
    forces = np.abs(free.reactions(Q, V, A, external, joints=[j.name for j in free.joints])).max(initial=1)
    scale = forces * max(1.0, np.abs(G).sum(axis=0).max(initial=0))
    close(m.inverse_dynamics(q, v, a, external), free.inverse_dynamics(Q, V, A, external) @ G, scale=scale)
    close(m.bias(q, v, external), free.bias(Q, V, external) @ G, scale=scale)
    close(m.gravity_torque(q), free.gravity_torque(Q) @ G, scale=scale)
    M = G.T @ free.mass_matrix(Q) @ G
    close(m.mass_matrix(q), M, scale=np.abs(M).max(initial=0))
    close(m.energy(q, v)[0], free.energy(Q, V)[0])
    close(m.frame_poses(q), free.frame_poses(Q))
    link = m.link_names[-1]
    close(m.jacobian(q, link), free.jacobian(Q, link) @ G)
    names = [j.name for j in m.joints]
    parts = {part: m.reactions(q, v, a, external, joints=names, part=part) for part in ("total", "constraint", "actuation", "coupling")}
    for part in ("total", "constraint"):
        close(parts[part], free.reactions(Q, V, A, external, joints=names, part=part), scale=scale)
    driven = free.reactions(Q, V, A, external, joints=names, part="actuation")
    follows = np.array([m.joint(name).leader is not None for name in names])
    close(parts["coupling"], np.where(follows[:, None], driven, 0), scale=scale)
    close(parts["actuation"], np.where(follows[:, None], 0, driven), scale=scale)
    for k in range(n):  # one state has the same bits as many
        assert np.array_equal(m.inverse_dynamics(q[k], v[k], a[k], {link: w[k] for link, w in external.items()}), m.inverse_dynamics(q, v, a, external)[k])
        assert np.array_equal(m.mass_matrix(q[k]), m.mass_matrix(q)[k])
