"""What must not matter: free fall, where and how the robot is placed, how rigid pieces are divided into links."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from newton_euler import Link, Tree, quaternion_turn
from random_tree import EXACT_AXES, Case, load_text, random_external, random_states, random_tree, words

seeds = st.integers(0, 2**32 - 1)
sizes = st.integers(2, 40)

GRAVITY = np.array([1.5, -0.7, -9.81])


@given(seeds, sizes)
def test_free_fall_loads_no_joint(seed, bodies):
    """A robot with locked joints that falls without spin carries nothing, however fast it falls."""
    rng = np.random.default_rng(seed)
    m = load_text(random_tree(rng, bodies), floating_base=True, gravity=tuple(GRAVITY))
    q, v, a = random_states(m, rng, 3)
    v[:, 3:], a[:] = 0, 0
    R = quaternion_turn(q[:, 3:7])[:, :3, :3]
    a[:, :3] = np.einsum("nij,i->nj", R, GRAVITY)  # into the body's axes; the body doesn't turn
    names = [j.name for j in m.joints]
    weight = max(1.0, sum(link.mass for link in m.links)) * np.linalg.norm(GRAVITY)
    reactions = m.reactions(q, v, a, joints=names)
    assert np.abs(reactions[..., :3]).max() < 1e-12 * weight, "a force in free fall"
    arm = max(1.0, *(np.abs(m.frame_pose(q, name)[:, :3, 3]).max() for name in m.link_names))
    assert np.abs(reactions[..., 3:]).max() < 1e-12 * weight * arm, "a moment in free fall"


@given(seeds, sizes)
def test_without_gravity_the_pose_of_the_base_does_not_matter(seed, bodies):
    rng = np.random.default_rng(seed)
    m = load_text(random_tree(rng, bodies), floating_base=True, gravity=(0, 0, 0))
    q, v, a = random_states(m, rng, 3)
    external = random_external(m, rng, 3)
    elsewhere = q.copy()
    elsewhere[:, :7] = random_states(m, rng, 3)[0][:, :7]
    names = [j.name for j in m.joints]
    tau, moved_tau = (m.inverse_dynamics(x, v, a, external) for x in (q, elsewhere))
    held, moved_held = (m.reactions(x, v, a, external, joints=names) for x in (q, elsewhere))
    scale = max(1.0, np.abs(held).max())
    assert np.abs(tau - moved_tau).max() < 1e-12 * scale
    assert np.abs(held - moved_held).max() < 1e-12 * scale
    assert np.abs(m.energy(q, v)[0] - m.energy(elsewhere, v)[0]).max() < 1e-12 * max(1.0, np.abs(m.energy(q, v)[0]).max())


@given(seeds, sizes)
def test_turning_robot_and_gravity_together_changes_nothing(seed, bodies):
    rng = np.random.default_rng(seed)
    text = random_tree(rng, bodies)
    m = load_text(text, floating_base=True, gravity=tuple(GRAVITY))
    q, v, a = random_states(m, rng, 1)
    turn_by = rng.normal(size=4)
    turn_by /= np.linalg.norm(turn_by)
    R = quaternion_turn(turn_by)[:3, :3]
    turned = load_text(text, floating_base=True, gravity=tuple(R @ GRAVITY))
    x, y, z, w = turn_by
    left = np.array([[w, -z, y, x], [z, w, -x, y], [-y, x, w, z], [-x, -y, -z, w]])  # product of quaternions
    q2 = q.copy()
    q2[:, :3], q2[:, 3:7] = q[:, :3] @ R.T, q[:, 3:7] @ left.T
    names = [j.name for j in m.joints]
    held, turned_held = m.reactions(q, v, a, joints=names), turned.reactions(q2, v, a, joints=names)
    assert np.abs(held - turned_held).max() < 1e-12 * max(1.0, np.abs(held).max())
    assert np.allclose(np.sum(m.energy(q, v)), np.sum(turned.energy(q2, v)), rtol=1e-12, atol=1e-10)


@given(seeds, sizes)
def test_an_accelerating_frame_is_gravity(seed, bodies):
    """Einstein's lift: a base that accelerates upwards at g without gravity loads the joints as one at rest does with it."""
    c = Case(seed, bodies, states=1, kinds=("revolute", "prismatic", "continuous", "fixed"))
    lift = load_text(c.text, floating_base=True, gravity=(0, 0, 0))
    none = np.zeros((1, 6))
    q = np.hstack([[[0, 0, 0, 0, 0, 0, 1.0]], c.q])
    v, a = np.hstack([none, c.v]), np.hstack([[[0, 0, 9.81, 0, 0, 0]], c.a])
    names = [n for n in c.names if n != "base"]
    here, there = c.m.reactions(*c.state, c.external, joints=names), lift.reactions(q, v, a, c.external, joints=names)
    assert np.abs(here - there).max(initial=0.0) < 1e-12 * c.load


def weld(tree: Tree) -> tuple[str, dict[str, str]]:
    """URDF text of the same robot with its fixed joints gone and their links merged; moving joints keep their names."""
    into, pose = {tree.root: tree.root}, {tree.root: np.eye(4)}  # in which link each link ends up, and where
    bodies: dict[str, list[tuple[np.ndarray, Link]]] = {tree.root: [(np.eye(4), tree.links[tree.root])]}
    joints = []
    for j in tree.joints:
        placement = pose[j.parent] @ j.placement
        if j.kind == "fixed":
            into[j.child], pose[j.child] = into[j.parent], placement
        else:
            into[j.child], pose[j.child] = j.child, np.eye(4)
            bodies[j.child] = []
            joints.append(joint_text(j, into[j.parent], placement))
        bodies[into[j.child]].append((pose[j.child], tree.links[j.child]))
    return "\n".join(['<robot name="welded">', *(link_text(name, parts) for name, parts in bodies.items()), *joints, "</robot>"]), into


def joint_text(j, parent: str, T: np.ndarray) -> str:
    R = T[:3, :3]
    rpy = (np.arctan2(R[2, 1], R[2, 2]), np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0])), np.arctan2(R[1, 0], R[0, 0]))
    if np.hypot(R[0, 0], R[1, 0]) < 1e-9:  # pitch of ± π/2: only one of the other two is defined
        rpy = (0.0, rpy[1], np.arctan2(-R[0, 1], R[1, 1]))
    axis = "" if j.kind == "floating" else f'<axis xyz="{words(j.axis)}"/><limit lower="-9" upper="9" effort="1000" velocity="100"/>'
    frame = f'<origin xyz="{words(T[:3, 3])}" rpy="{words(rpy)}"/>'
    return f'<joint name="{j.name}" type="{j.kind}">{frame}<parent link="{parent}"/><child link="{j.child}"/>{axis}</joint>'


def link_text(name: str, parts: list[tuple[np.ndarray, Link]]) -> str:
    mass = sum(link.mass for _, link in parts)
    if mass == 0:
        return f'<link name="{name}"/>'
    centroids = [T[:3, :3] @ link.centroid + T[:3, 3] for T, link in parts]
    centroid = sum(link.mass * c for (_, link), c in zip(parts, centroids)) / mass
    I = np.zeros((3, 3))
    for (T, link), c in zip(parts, centroids):
        r = c - centroid
        I += T[:3, :3] @ link.about_centroid @ T[:3, :3].T + link.mass * (r @ r * np.eye(3) - np.outer(r, r))
    tensor = " ".join(f'i{"xyz"[i]}{"xyz"[k]}="{float(I[i, k])!r}"' for i in range(3) for k in range(i, 3))
    return f'<link name="{name}"><inertial><origin xyz="{words(centroid)}"/><mass value="{float(mass)!r}"/><inertia {tensor}/></inertial></link>'


@given(seeds, sizes, st.booleans())
def test_welding_by_hand_changes_nothing(seed, bodies, floating):
    """Links that fixed joints join, merged into one link by the parallel-axis theorem: moving joints see no difference."""
    c = Case(seed, bodies, floating_base=floating, kinds=("revolute", "prismatic", "fixed", "fixed", "floating"))
    text, into = weld(c.tree)
    merged = load_text(text, floating_base=floating)
    assert len(merged.link_names) == len(set(into.values()))
    q, v, a = np.empty((4, merged.nq)), np.empty((4, merged.nv)), np.empty((4, merged.nv))
    for name in merged.joint_names:  # the order of children may differ
        j, k = c.m.joint(name), merged.joint(name)
        q[:, k.q_index : k.q_index + k.nq] = c.q[:, j.q_index : j.q_index + j.nq]
        v[:, k.v_index : k.v_index + k.nv] = c.v[:, j.v_index : j.v_index + j.nv]
        a[:, k.v_index : k.v_index + k.nv] = c.a[:, j.v_index : j.v_index + j.nv]
    names = c.m.joint_names
    assert set(names) == set(merged.joint_names)
    before = c.m.reactions(*c.state, joints=[*names] + ([] if floating else ["base"]))
    after = merged.reactions(q, v, a, joints=[*names] + ([] if floating else ["base"]))
    assert np.abs(before - after).max(initial=0.0) < 1e-11 * c.load
    assert np.allclose(c.m.energy(c.q, c.v), merged.energy(q, v), rtol=1e-11, atol=1e-9)


@given(seeds)
def test_direction_of_the_axis(seed):
    """Turning an axis round and changing the sign of its coordinate is the same robot; exact axes and arbitrary ones."""
    rng = np.random.default_rng(seed)
    axes = [EXACT_AXES[rng.integers(6)], rng.normal(size=3)]

    def robot(signs, kinds):
        joints = "".join(
            f'<joint name="j{i}" type="{kind}"><parent link="l{i}"/><child link="l{i + 1}"/><origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 {i}"/>'
            f'<axis xyz="{words(sign * axis)}"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint>'
            for i, (axis, sign, kind) in enumerate(zip(axes, signs, kinds))
        )
        inertial = '<inertial><origin xyz="0.1 0 0.2"/><mass value="2"/><inertia ixx="0.2" iyy="0.3" izz="0.4" ixy="0.01" ixz="0.02" iyz="0.03"/></inertial>'
        return load_text('<robot name="r">' + "".join(f'<link name="l{i}">{inertial}</link>' for i in range(3)) + joints + "</robot>")

    kinds = [str(rng.choice(["revolute", "prismatic"])) for _ in axes]
    q, v, a = rng.normal(size=(3, 2))
    signs = rng.choice([-1.0, 1.0], 2)
    plain, turned = robot((1, 1), kinds), robot(signs, kinds)
    assert np.allclose(turned.inverse_dynamics(signs * q, signs * v, signs * a), signs * plain.inverse_dynamics(q, v, a), rtol=1e-12, atol=1e-12)
    assert np.allclose(turned.reactions(signs * q, signs * v, signs * a), plain.reactions(q, v, a), rtol=1e-12, atol=1e-12)
