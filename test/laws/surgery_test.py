"""Models made from models: the dynamics of what was changed follow from those of what was there."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ksl
from frames import coadjoint
from newton_euler import quaternion_turn
from random_tree import KINDS, load_text, random_states, random_tree

seeds = st.integers(0, 2**32 - 1)
sizes = st.integers(2, 20)
GRAVITY = (1.5, -0.7, -9.81)
REVERSIBLE = ("revolute", "continuous", "prismatic", "helical", "cylindrical", "fixed")


def tree(seed: int, bodies: int, kinds: tuple[str, ...] = KINDS, **options):
    rng = np.random.default_rng(seed)
    text = random_tree(rng, bodies, kinds)
    return rng, text, load_text(text, gravity=GRAVITY, **options)


def columns(m: ksl.Model, names, start: str = "v_index", size: str = "nv") -> np.ndarray:
    """Where the numbers of these joints are."""
    joints = [m.joint(name) for name in names]
    return np.concatenate([np.arange(getattr(j, start), getattr(j, start) + getattr(j, size)) for j in joints] + [np.zeros(0, int)])


def moved(m: ksl.Model, other: ksl.Model, x: np.ndarray, start: str = "v_index", size: str = "nv") -> np.ndarray:
    """The numbers of a state of m in the order of the other model, which has the same moving joints, or some of them."""
    names = [name for name in other.joint_names if name in m.joint_names]
    out = np.zeros((*x.shape[:-1], other.nq if size == "nq" else other.nv))
    out[..., columns(other, names, start, size)] = x[..., columns(m, names, start, size)]
    return out


def close(x, y, scale: float = 1.0, limit: float = 1e-12) -> None:
    assert np.abs(x - y).max(initial=0.0) <= limit * max(1.0, scale, np.abs(y).max(initial=0.0))


def quaternion_of(R: np.ndarray) -> np.ndarray:
    """xyzw: the eigenvector to the largest eigenvalue of Bar-Itzhack's matrix (2000)."""
    K = np.empty((4, 4))
    K[:3, :3] = R + R.T - np.trace(R) * np.eye(3)
    K[3, :3] = K[:3, 3] = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    K[3, 3] = np.trace(R)
    return np.linalg.eigh(K)[1][:, -1]


def same_results(a: ksl.Model, b: ksl.Model, rng) -> None:
    """Bit for bit; b may have further links."""
    q, v, x = random_states(a, rng, 3)
    assert a.joint_names == b.joint_names
    assert (a.inverse_dynamics(q, v, x) == b.inverse_dynamics(q, v, x)).all()
    assert (a.mass_matrix(q) == b.mass_matrix(q)).all()
    assert (a.frame_poses(q) == b.frame_poses(q, a.link_names)).all()
    names = [j.name for j in a.joints]
    assert (a.reactions(q, v, x, joints=names) == b.reactions(q, v, x, joints=names)).all()


@given(seeds, sizes)
def test_another_root(seed, bodies):
    """A floating robot is the same robot whichever of its links is the root: with T the velocity of the new root and of the other
    joints for unit velocities, M = Tᵀ M' T; poses are the same; reactions at joints are the same, or opposite where they were reversed."""
    rng, _, m = tree(seed, bodies, tuple(k for k in KINDS if k in REVERSIBLE), floating_base=True)
    link = str(rng.choice(m.link_names))
    r = m.with_root(link)
    assert r.root == link and sorted(r.joint_names) == sorted(m.joint_names) and r.mass == pytest.approx(m.mass, rel=1e-15)
    q, _, a = random_states(m, rng, 1)
    there = m.frame_pose(q, link)
    q_new = moved(m, r, q, "q_index", "nq")
    q_new[:, :3], q_new[0, 3:7] = there[:, :3, 3], quaternion_of(there[0, :3, :3])
    poses, poses_new = m.frame_poses(q), r.frame_poses(q_new, m.link_names)
    reach = max(1.0, np.abs(poses[..., :3, 3]).max())
    close(poses_new, poses, reach)

    T = np.eye(m.nv)[columns(m, r.joint_names)]
    T[:6] = m.jacobian(q, link)[0]
    M, M_new = m.mass_matrix(q)[0], r.mass_matrix(q_new)[0]
    close(T.T @ M_new @ T, M, np.abs(T).max() ** 2 * np.abs(M_new).max())
    close(r.gravity_torque(q_new) @ T, m.gravity_torque(q), np.abs(T).max() * np.abs(r.gravity_torque(q_new)).max())

    still = np.zeros((1, m.nv))
    names = [j.name for j in m.joints if j.parent is not None]
    push = {m.root: m.inverse_dynamics(q, still, a)[:, :6]}  # what moves the robot is on a link, not on the joint of the base
    held = m.reactions(q, still, a, push, joints=names, axes="world", at="world")[0]
    held_new = r.reactions(q_new, still, a @ T.T, push, joints=names, axes="world", at="world")[0]
    close(r.inverse_dynamics(q_new, still, a @ T.T, push)[:, :6], np.zeros((1, 6)), reach * np.abs(push[m.root]).max())
    on_the_way = m.support(link)
    signs = np.array([-1.0 if name in on_the_way else 1.0 for name in names])
    close(signs[:, None] * held_new, held, reach * (np.abs(held).max(initial=0.0) + np.abs(push[m.root]).max()))


def test_joints_of_several_axes_are_not_reversed():
    m = load_text('<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="spherical"><parent link="a"/><child link="b"/></joint></robot>')
    with pytest.raises(ksl.DescriptionError, match="joint j is spherical.*link b the root"):
        m.with_root("b")
    assert m.with_root("a").link_names == m.link_names


@given(seeds, sizes)
def test_frozen_joints(seed, bodies):
    """M without rows and columns, gravity torques without rows; poses and reactions at rest as before."""
    rng, _, m = tree(seed, bodies, floating_base=bool(seed % 2))
    frozen = [name for name in m.joint_names if rng.random() < 0.4]
    q, v, a = random_states(m, rng, 2)
    q[1] = q[0]
    f = m.with_frozen_joints({name: q[0, columns(m, [name], "q_index", "nq")] for name in frozen})
    kept = columns(m, [name for name in m.joint_names if name not in frozen])
    assert f.nv == len(kept)
    a[:, columns(m, frozen)] = v[:] = 0
    q_new, a_new, v_new = moved(m, f, q, "q_index", "nq"), moved(m, f, a), np.zeros((2, f.nv))
    order = columns(m, f.joint_names)
    poses = m.frame_poses(q)
    reach = max(1.0, np.abs(poses[..., :3, 3]).max())
    close(f.frame_poses(q_new, m.link_names), poses, reach)
    M = m.mass_matrix(q)
    close(f.mass_matrix(q_new), M[:, order][:, :, order], np.abs(M).max(initial=0.0))
    tau = m.inverse_dynamics(q, v, a)
    close(f.inverse_dynamics(q_new, v_new, a_new), tau[:, order], np.abs(tau).max(initial=0.0) + reach * m.mass * 10)
    names = [j.name for j in m.joints if j.parent is not None]
    held = m.reactions(q, v, a, joints=names)
    close(f.reactions(q_new, v_new, a_new, joints=names), held, np.abs(held).max(initial=0.0) + reach * m.mass * 10)


@given(seeds, sizes)
def test_merged_robots_are_the_robot_of_both_files(seed, bodies):
    rng, text, m = tree(seed, bodies)
    other_text = random_tree(rng, 5)
    other = load_text(other_text, gravity=GRAVITY)
    parent = str(rng.choice(m.link_names))
    pose = quaternion_turn((lambda x: x / np.linalg.norm(x))(rng.normal(size=4)))
    pose[:3, 3] = rng.normal(size=3)
    both = m.merged(other, parent, pose, prefix="b_")
    renamed = re.sub(r'(name|link)="(link|joint)', r'\1="b_\2', other_text)
    inside = re.search(r'<robot name="random">(.*)</robot>', renamed, re.S).group(1)
    mount = f'<joint name="b_mount" type="fixed"><parent link="{parent}"/><child link="b_link0"/></joint>'
    written = load_text(text.replace("</robot>", mount + inside + "</robot>"), gravity=GRAVITY)
    same_results(m.merged(other, parent, prefix="b_"), written, rng)

    q = random_states(both, rng, 2)[0]
    mine, its = ([name for name in both.joint_names if name.startswith("b_") == of_other] for of_other in (False, True))
    q_other = q[:, columns(both, its, "q_index", "nq")]
    hung = both.frame_pose(q, parent) @ pose
    close(both.frame_pose(q, "b_link0"), hung, np.abs(hung).max())
    rows = columns(both, its)
    M = both.mass_matrix(q)
    close(M[:, rows][:, :, rows], other.mass_matrix(q_other), np.abs(M).max(initial=0.0))
    assert both.mass == pytest.approx(m.mass + other.mass, rel=1e-14)


def test_robots_on_the_same_ground_do_not_know_each_other(examples):
    m = ksl.load(examples / "robots/ur5.urdf")
    beside = np.eye(4)
    beside[0, 3] = 2.0
    both = m.merged(m, "base_link", beside, prefix="b_")
    q = np.random.default_rng(0).normal(size=12)
    M = both.mass_matrix(q)
    assert (M[:6, 6:] == 0).all()
    close(M[:6, :6], m.mass_matrix(q[:6]))
    close(M[6:, 6:], m.mass_matrix(q[6:]))


@given(seeds, sizes)
def test_a_point_payload_is_that_of_load(seed, bodies):
    rng, text, m = tree(seed, bodies)
    link, mass, point = str(rng.choice(m.link_names)), 1.7, tuple(rng.normal(size=3))
    same_results(m.with_payload(link, mass, point), load_text(text, gravity=GRAVITY, payloads={link: (mass, point)}), rng)


@given(seeds, sizes)
def test_a_payload_with_inertia_is_a_welded_link(seed, bodies):
    rng, _, m = tree(seed, bodies)
    link, center, B = str(rng.choice(m.link_names)), rng.normal(size=3), rng.normal(size=(3, 3))
    inertia = B @ B.T
    inertia = np.trace(inertia) * np.eye(3) - inertia
    heavy = m.with_payload(link, 2.0, center, inertia)
    stone = ksl.Builder("stone", GRAVITY).add_link("stone", 2.0, center, inertia).build()
    welded = m.merged(stone, link)
    q, v, a = random_states(m, rng, 2)
    tau = welded.inverse_dynamics(q, v, a)
    close(heavy.inverse_dynamics(q, v, a), tau, np.abs(welded.reactions(q, v, a, joints=[j.name for j in m.joints])).max())


@given(seeds, sizes)
def test_frames_are_used_as_links_and_change_nothing(seed, bodies):
    rng, _, m = tree(seed, bodies, floating_base=bool(seed % 2))
    link = str(rng.choice(m.link_names))
    pose = quaternion_turn((lambda x: x / np.linalg.norm(x))(rng.normal(size=4)))
    pose[:3, 3] = rng.normal(size=3)
    f = m.with_frame("tip", link, pose)
    same_results(m, f, rng)
    q, v, a = random_states(m, rng, 2)
    expected = m.frame_pose(q, link) @ pose
    close(f.frame_pose(q, "tip"), expected, np.abs(expected).max())
    w = rng.normal(size=(2, 6))
    on_link = (coadjoint(pose[:3, :3], pose[:3, 3]) @ w[..., None])[..., 0]
    tau = m.inverse_dynamics(q, v, a, {link: on_link})
    close(f.inverse_dynamics(q, v, a, {"tip": w}), tau, np.abs(tau).max(initial=0.0) + np.abs(expected).max() * (np.abs(w).max() + 10 * m.mass))


@given(seeds, sizes)
def test_subtrees(seed, bodies):
    """The mass matrix of a subtree is a block of the whole one."""
    rng, _, m = tree(seed, bodies)
    link = str(rng.choice(m.link_names))
    s = m.subtree(link)
    assert set(s.link_names) == set(m.subtree_links(link)) and s.mass == pytest.approx(m.subtree_mass(link), rel=1e-14)
    q = random_states(m, rng, 2)[0]
    rows = columns(m, s.joint_names)
    M = m.mass_matrix(q)
    close(s.mass_matrix(q[:, columns(m, s.joint_names, "q_index", "nq")]), M[:, rows][:, :, rows], np.abs(M).max(initial=0.0))


@given(seeds, sizes)
def test_other_parameters_are_those_of_another_file(seed, bodies):
    rng, text, m = tree(seed, bodies)
    bare = load_text(re.sub(r"<inertial>.*?</inertial>", "", text), gravity=GRAVITY)
    ten = {l.name: [l.mass, *l.first_moment, *(l.inertia[i] for i in (0, 3, 1, 5, 4, 2))] for l in m.links}
    same_results(bare.with_parameters(ten), m, rng)
    assert bare.with_parameters(ten).links == m.links
    assert bare.mass == 0


@given(seeds, sizes)
def test_what_is_written_is_what_was_read(seed, bodies):
    rng, _, m = tree(seed, bodies)
    text = m.to_urdf()
    again = load_text(text, gravity=GRAVITY)
    same_results(m, again, rng)
    assert again.links == m.links and again.joints == m.joints
