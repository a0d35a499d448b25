"""Mimic joints against the dense projection of the same robot with independent joints: q̂ = G q + c, τ = Gᵀ τ̂, M = Gᵀ M̂ G."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest

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


@pytest.mark.parametrize("seed", range(40))
def test_results_are_the_projection_of_those_of_independent_joints(seed):
    check_projection(*random_projection(seed))


@pytest.mark.parametrize("seed", range(40))
def test_forward_dynamics_is_the_inverse_of_inverse_dynamics(seed):
    p, rng = random_projection(seed)
    q, v, a = random_states(p.m, rng, 5)
    external = random_external(p.m, rng, 5)
    M = p.m.mass_matrix(q)
    if p.m.nv == 0 or np.linalg.cond(M).max() > 1e8:
        return  # an end without mass
    tau = p.m.inverse_dynamics(q, v, a, external)
    found = p.m.forward_dynamics(q, v, tau, external)
    scale = np.linalg.cond(M).max() * max(1.0, np.abs(tau).max() / np.abs(M).max())
    close(found, a, 1e-14, scale)
    assert np.array_equal(p.m.forward_dynamics(q[1], v[1], tau[1], {link: w[1] for link, w in external.items()}), found[1])
    bound = 1e-5 * scale / np.linalg.cond(M).max() * np.linalg.cond(M).max()
    single = p.m.forward_dynamics(*(x.astype(np.float32) for x in (q, v, tau)), {link: w.astype(np.float32) for link, w in external.items()})
    assert single.dtype == np.float32 and np.abs(single - a).max() <= max(bound, 1e-4)


@pytest.mark.parametrize("seed", range(20))
def test_the_efforts_of_leaders_are_those_of_actuations_and_couplings(seed):
    """τ = Σ kᵢ Sᵢᵀ fᵢ over a leader and its followers."""
    p, rng = random_projection(seed)
    m = p.m
    q, v, a = random_states(m, rng, 2)
    tau = m.inverse_dynamics(q, v, a)
    scale = np.abs(m.reactions(q, v, a, joints=[j.name for j in m.joints])).max(initial=1) * 10

    def along(joint, part):
        w = m.reactions(q, v, a, joints=[joint.name], part=part)[:, 0]
        return (w[:, 3:] if joint.has_angle else w[:, :3]) @ np.array(joint.axis)

    for leader in m.joints:
        if leader.has_axis and leader.leader is None:
            total = along(leader, "actuation")
            for follower in m.joints:
                if follower.leader == leader.name:
                    total = total + follower.multiplier * along(follower, "coupling")
            close(tau[:, leader.v_index], total, scale=scale)


@pytest.mark.parametrize("seed", range(20))
def test_positions_of_coupled_joints_are_a_manifold(seed):
    p, rng = random_projection(seed)
    q, v, _ = random_states(p.m, rng, 4)
    dv = v / 3
    close(p.position(p.m.integrate(q, dv)), p.free.integrate(p.position(q), p.motion(dv)))
    close(p.m.difference(q, p.m.integrate(q, dv)), dv, 1e-11)
    close(p.m.interpolate(q, p.m.integrate(q, dv), 0.5), p.m.integrate(q, dv / 2), 1e-11)
    by_q, by_dv = p.m.integrate_jacobians(q, dv)
    free_q, free_dv = p.free.integrate_jacobians(p.position(q), p.motion(dv))
    close(p.G @ by_q, free_q @ p.G)
    close(p.G @ by_dv, free_dv @ p.G)


CHAIN = """<robot name="chain"><link name="a"/>
<link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="c"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="d"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><limit effort="1" velocity="1" lower="-1" upper="1"/>{}</joint>
<joint name="k" type="{}"><parent link="b"/><child link="c"/><limit effort="1" velocity="1" lower="-1" upper="1"/>{}</joint>
<joint name="l" type="revolute"><parent link="c"/><child link="d"/><limit effort="1" velocity="1" lower="-1" upper="1"/>{}</joint></robot>"""


def test_a_chain_of_followers_has_one_leader():
    m = load_text(CHAIN.format('<mimic joint="k" multiplier="2" offset="1"/>', "prismatic", "", '<mimic joint="j" multiplier="-3" offset="0.5"/>'))
    assert m.joint_names == ["k"] and m.follower_names == ["j", "l"] and m.fixed_joint_names == ["base"] and m.nq == m.nv == 1
    j, l = m.joint("j"), m.joint("l")
    assert (j.leader, j.multiplier, j.offset) == ("k", 2, 1)
    assert (l.leader, l.multiplier, l.offset) == ("k", -6, -2.5)  # −3 (2 k + 1) + 0.5
    assert j.nq == j.nv == 0 and j.q_index == -1
    for name, angle in (("b", 2 * 0.25 + 1), ("d", 2 * 0.25 + 1 - 6 * 0.25 - 2.5)):
        close(m.frame_pose([0.25], name)[1:3, 1:3], [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


@pytest.mark.parametrize(
    "mimics, kind, words",
    [
        (('<mimic joint="l"/>', "", '<mimic joint="j"/>'), "prismatic", ["joint j", '"l"', "back to itself"]),
        (('<mimic joint="j"/>', "", ""), "prismatic", ["joint j", '"j"', "back to itself"]),
        (('<mimic joint="kk"/>', "", ""), "prismatic", ["joint j", '"kk"', "does not exist", 'did you mean "k"', "independent"]),
        (('<mimic joint="k"/>', "", ""), "fixed", ["joint j", '"k"', "is fixed"]),
        (('<mimic joint="k"/>', "", ""), "spherical", ["joint j", '"k"', "spherical", "3 coordinates", "independent"]),
        (("", '<mimic joint="j"/>', ""), "floating", ["joint k", "floating", "6 coordinates"]),
        (('<mimic/>', "", ""), "prismatic", ["joint j", "names no joint"]),
    ],
)
def test_mimics_that_can_not_be_coupled_are_refused(mimics, kind, words):
    with pytest.raises(ksl.DescriptionError) as refusal:
        load_text(CHAIN.format(mimics[0], kind, mimics[1], mimics[2]))
    for word in words:
        assert word in str(refusal.value)
    assert "\n" not in str(refusal.value)
    load_text(CHAIN.format(mimics[0], kind, mimics[1], mimics[2]), mimic="independent")


def test_results_may_be_written_over_arguments():
    p, rng = random_projection(7)
    q, v, a = random_states(p.m, rng, 100)
    expected = p.m.inverse_dynamics(q, v, a)
    assert p.m.inverse_dynamics(q, v, a, out=a) is a and np.array_equal(a, expected)
    expected = p.m.forward_dynamics(q, v, expected)
    assert np.array_equal(p.m.forward_dynamics(q, v, a, out=v), expected)
