"""Mimic joints in models that are written, copied, built, and made from others; and their inverse kinematics."""

import pickle

import numpy as np
import pytest
from projection import close, random_projection
from random_tree import load_text, random_states

import ksl

LINK = '<link name="{}"><inertial><origin xyz="0.1 0.2 0.3"/><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
JOINT = '<joint name="{}" type="{}"><origin xyz="0.3 0 0.1"/><parent link="{}"/><child link="{}"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>{}</joint>'
CHAIN = '<robot name="chain">{}</robot>'.format(
    "".join(LINK.format(name) for name in "abcde")
    + JOINT.format("first", "revolute", "a", "b", "")
    + JOINT.format("second", "prismatic", "b", "c", '<mimic joint="first" multiplier="-0.5" offset="0.1"/>')
    + JOINT.format("third", "revolute", "c", "d", '<mimic joint="second" multiplier="2" offset="0.25"/>')
    + JOINT.format("fourth", "revolute", "d", "e", "")
)


def couplings(m: ksl.Model) -> dict[str, tuple]:
    return {name: (m.joint(name).leader, m.joint(name).multiplier, m.joint(name).offset) for name in m.follower_names}


def same_results(m: ksl.Model, other: ksl.Model, rng: np.random.Generator) -> None:
    q, v, a = random_states(m, rng, 3)
    assert np.array_equal(m.inverse_dynamics(q, v, a), other.inverse_dynamics(q, v, a))
    assert np.array_equal(m.frame_poses(q), other.frame_poses(q, m.link_names))


@pytest.mark.parametrize("seed", range(12))
def test_couplings_are_written_and_copied(seed):
    p, rng = random_projection(seed)
    made = pickle.loads(pickle.dumps(p.m.with_frame("mark", p.m.link_names[0])))  # no file that could be read again
    for other in (made, load_text(p.m.to_urdf(), floating_base=bool(seed % 2))):
        assert couplings(other) == couplings(p.m)
        same_results(p.m, other, rng)


def test_the_builder_couples_joints():
    b = ksl.Builder("pair").add_link("a")
    for name in "bc":
        b.add_link(name, 1.0, (0.1, 0, 0), np.eye(3) * 0.01)
    b.add_joint("j", "revolute", "a", "b", axis=(0, 0, 1), mimic=("k", -2.0, 0.5))
    b.add_joint("k", "prismatic", "b", "c", axis=(1, 0, 0))
    m = b.build()
    assert couplings(m) == {"j": ("k", -2, 0.5)} and m.joint_names == ["k"]
    with pytest.raises(ValueError, match="joint l: its mimic is 'k'; expected"):
        b.add_joint("l", "revolute", "a", "b", axis=(0, 0, 1), mimic="k")
    wrong = ksl.Builder("one").add_link("a").add_link("b", 1.0).add_joint("j", "revolute", "a", "b", axis=(0, 0, 1), mimic=("jj", 1.0, 0.0))
    with pytest.raises(ksl.DescriptionError, match='joint j: it mimics joint "jj", which does not exist.*"j"') as refusal:
        wrong.build()
    assert "independent" not in str(refusal.value)  # there is no file to load in another way


def test_followers_are_frozen_with_their_leader():
    m, rng = load_text(CHAIN), np.random.default_rng(0)
    frozen = m.with_frozen_joints({"first": 0.4})
    assert frozen.joint_names == ["fourth"] and frozen.follower_names == []
    q = rng.uniform(-1, 1, (3, 1))
    close(frozen.frame_poses(q), m.frame_poses(np.column_stack([np.full(3, 0.4), q])))
    assert m.with_frozen_joints({"first": 0.4, "second": -0.1}).joint_names == ["fourth"]  # −0.5 × 0.4 + 0.1
    assert couplings(m.with_frozen_joints({"fourth": 1.0})) == couplings(m)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda m: m.with_frozen_joints({"second": 0.1}), ["joint second follows joint first", "can't be frozen alone", "freeze first"]),
        (lambda m: m.with_frozen_joints({"third": 0.1}), ["joint third follows joint first", "freeze first"]),
        (lambda m: m.with_frozen_joints({"first": 0.4, "third": 0.1}), ["joint third: frozen at 0.1", "first", "holds it at", "leave it out"]),
        (lambda m: m.subtree("b"), ["joint second follows joint first", 'link "b"', "doesn't carry", "independent"]),
        (lambda m: m.subtree("c"), ["joint third follows joint first", 'link "c"']),
    ],
)
def test_what_would_leave_a_follower_without_its_leader_is_refused(make, words):
    with pytest.raises(ksl.DescriptionError) as refusal:
        make(load_text(CHAIN))
    for word in words:
        assert word in str(refusal.value)


def test_a_chain_of_followers_may_lose_what_is_between():
    text = CHAIN.replace('<parent link="b"/><child link="c"/>', '<parent link="a"/><child link="c"/>').replace(
        '<parent link="c"/><child link="d"/>', '<parent link="b"/><child link="d"/>'
    )
    m = load_text(text)
    part = m.subtree("a")
    assert couplings(part) == couplings(m)
    text = text.replace(
        'name="first" type="revolute"><origin xyz="0.3 0 0.1"/><parent link="a"/>', 'name="first" type="revolute"><origin xyz="0.3 0 0.1"/><parent link="f"/>'
    )
    text = text.replace("</robot>", LINK.format("f") + JOINT.format("zeroth", "fixed", "a", "f", "") + "</robot>")
    m = load_text(text)
    assert couplings(m.subtree("f")) == {"third": ("first", -1, 0.45)} and m.subtree("f").link_names == ["f", "b", "d", "e"]
    assert m.subtree("d").follower_names == []


def test_merged_robots_keep_their_couplings():
    m = load_text(CHAIN)
    both = m.merged(m, "e", prefix="other_")
    assert couplings(both) == couplings(m) | {f"other_{name}": (f"other_{leader}", k, c) for name, (leader, k, c) in couplings(m).items()}
    q = np.array([0.3, -0.2, 0.5, 0.1])
    close(both.frame_pose(q, "e") @ m.frame_pose(q[2:], "e"), both.frame_pose(q, "other_e"))
    close(both.mass_matrix(q), both.mass_matrix(q).T)


def test_another_root_keeps_the_couplings():
    m, rng = load_text(CHAIN), np.random.default_rng(2)
    other = m.with_root("d")
    assert couplings(other) == couplings(m)
    q = rng.uniform(-1, 1, (4, 2))
    order = [m.joint_names.index(name) for name in other.joint_names]
    a, e = (m.frame_poses(q, ["a", "e"])[:, i] for i in range(2))
    found = other.frame_poses(q[:, order], ["a", "e"])
    close(np.linalg.inv(found[:, 0]) @ found[:, 1], np.linalg.inv(a) @ e)
    energy = m.energy(q, np.ones((4, 2)))[0]
    back = other.with_root("a")
    close(back.frame_poses(q, ["e"]), m.frame_poses(q, ["e"]))
    close(back.energy(q, np.ones((4, 2)))[0], energy)


@pytest.mark.parametrize("seed", range(12))
def test_inverse_kinematics_moves_leaders(seed):
    p, rng = random_projection(seed)
    m = p.m
    if not m.nv:
        return
    link = m.link_names[-1]
    q = m.random(rng, size=20)
    target = m.frame_poses(q, [link])[:, 0]
    near = m.integrate(q, rng.normal(size=(20, m.nv)) * 0.02)
    for start in (near, None):
        found = m.inverse_kinematics(link, target, q0=start, starts=10, iterations=60)
        reached = m.frame_poses(found.q, [link])[:, 0]
        assert found.converged.mean() > (0.8 if start is not None else 0.3)
        assert np.abs(reached - target)[found.converged].max(initial=0) < 1e-5
    one = m.inverse_kinematics(link, target[3], q0=near[3], starts=10, iterations=60)
    assert one.q.shape == (m.nq,) and one.starts == 1


def test_inverse_kinematics_keeps_the_limits_of_followers():
    m = load_text(CHAIN.replace('multiplier="2"', 'multiplier="-4"'))  # third = 2 first − 0.15, within −1 … 1
    rng = np.random.default_rng(3)
    q = np.column_stack([rng.uniform(-1, 1, 200), rng.uniform(-1, 1, 200)])
    found = m.inverse_kinematics("e", m.frame_poses(q, ["e"])[:, 0])
    third = 2 * found.q[:, 0] - 0.15
    assert np.abs(third).max() <= 1 + 1e-12 and np.abs(found.q).max() <= 1
    inside = np.abs(2 * q[:, 0] - 0.15) < 0.999
    assert found.converged[inside].mean() > 0.98 and (found.reason[~inside] == "limits").mean() > 0.5
    free = m.inverse_kinematics("e", m.frame_poses(q, ["e"])[:, 0], limits=False)
    assert free.converged.mean() > 0.95
