"""Mimic joints against the dense projection of the same robot with independent joints."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from projection import close, random_projection
from random_tree import load_text, random_external, random_states

import ksl


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
        if leader.one_coordinate and leader.leader is None:
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
        (("<mimic/>", "", ""), "prismatic", ["joint j", "names no joint"]),
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
    m = load_text((Path(__file__).parents[1] / "engine/coupled.urdf").read_text())
    q, v, a = random_states(m, np.random.default_rng(0), 100)
    expected = m.inverse_dynamics(q, v, a)
    assert m.inverse_dynamics(q, v, a, out=a) is a and np.array_equal(a, expected)
    expected = m.forward_dynamics(q, v, expected)
    assert np.isfinite(expected).all() and np.array_equal(m.forward_dynamics(q, v, a, out=v), expected)


def test_a_pickle_of_a_changed_model_keeps_its_followers():
    m = load_text((Path(__file__).parents[1] / "engine/coupled.urdf").read_text())
    m = m.with_payload(m.link_names[-1], 0.5)
    again = pickle.loads(pickle.dumps(m))
    q, v, a = random_states(m, np.random.default_rng(0), 1)
    assert m.follower_names and again.joints == m.joints
    assert np.array_equal(again.inverse_dynamics(q, v, a), m.inverse_dynamics(q, v, a))
