"""The wrench through a section: that through a fixed joint between two links, of which the cut link is welded."""

import ksl
import numpy as np
import pytest

from random_tree import load_text, random_states

JOINT = '<joint name="{0}" type="{1}"><origin xyz="{2}" rpy="{3}"/><parent link="{4}"/><child link="{5}"/><axis xyz="0.2 0.9 -0.4"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint>'
INERTIAL = '<inertial><origin xyz="{0}"/><mass value="{1}"/><inertia ixx="{2}" iyy="{3}" izz="{4}" ixy="0.01" ixz="-0.02" iyz="0.015"/></inertial>'
NEAR, FAR = ((0.05, 0.02, 0.1), 2.0, (0.3, 0.4, 0.5)), ((-0.03, 0.04, 0.5), 1.5, (0.2, 0.25, 0.1))
COUPLING = np.array([[0, 0.01, -0.02], [0.01, 0, 0.015], [-0.02, 0.015, 0]])


def inertial(part) -> str:
    c, m, I = part
    return INERTIAL.format(" ".join(map(str, c)), m, *I)


def about_origin(part, shift=(0.0, 0.0, 0.0)):
    """Mass, first moment and inertia about the origin of the cut link."""
    c, m, I = np.add(part[0], shift), part[1], np.diag(part[2]) + COUPLING
    return m, m * c, I + m * (c @ c * np.eye(3) - np.outer(c, c))


def tree(cut: bool) -> str:
    """An arm whose second link is one piece, or two that are welded at z = 0.3."""
    near, far, shift = NEAR, FAR, (0.0, 0.0, 0.3)
    if cut:
        middle = f'<link name="middle">{inertial(near)}</link><link name="far">{inertial(far)}</link>' + JOINT.format(
            "weld", "fixed", "0 0 0.3", "0 0 0", "middle", "far"
        )
        last = JOINT.format("j3", "revolute", "0.1 0 0.4", "0.3 0 0", "far", "tip")
    else:
        (m1, h1, I1), (m2, h2, I2) = about_origin(near), about_origin(far, shift)
        m, c = m1 + m2, (h1 + h2) / (m1 + m2)
        I = I1 + I2 - m * (c @ c * np.eye(3) - np.outer(c, c))
        text = f'<inertial><origin xyz="{" ".join(map(repr, map(float, c)))}"/><mass value="{m}"/><inertia '
        text += " ".join(f'i{"xyz"[i]}{"xyz"[j]}="{float(I[i, j])!r}"' for i in range(3) for j in range(i, 3)) + "/></inertial>"
        middle, last = f'<link name="middle">{text}</link>', JOINT.format("j3", "revolute", "0.1 0 0.7", "0.3 0 0", "middle", "tip")
    ends = f'<link name="base"/><link name="first">{inertial(FAR)}</link><link name="tip">{inertial(NEAR)}</link><link name="branch">{inertial(FAR)}</link>'
    joints = JOINT.format("j1", "revolute", "0 0 0.2", "0 0.4 0", "base", "first") + JOINT.format("j2", "revolute", "0 0.1 0.3", "1 0 0", "first", "middle")
    joints += JOINT.format("j4", "prismatic", "0.2 0 0.1", "0 0 1", "middle", "branch") + last
    return f'<?xml version="1.0"?><robot name="cut">{ends}{middle}{joints}</robot>'


@pytest.mark.parametrize("floating", [False, True])
def test_a_section_carries_what_a_weld_in_its_place_does(floating):
    cut, whole = (load_text(tree(x), floating_base=floating) for x in (True, False))
    assert set(cut.joint_names) == set(whole.joint_names)
    rng = np.random.default_rng(1)
    q, v, a = random_states(cut, rng, 6)
    order = list(whole.joint_names)
    columns = lambda m, size, start: np.concatenate(
        [np.arange(getattr(m.joint(n), start), getattr(m.joint(n), start) + getattr(m.joint(n), size)) for n in order]
    )
    to_q, to_v = np.empty_like(q), [np.empty_like(v), np.empty_like(a)]
    to_q[:, columns(whole, "nq", "q_index")] = q[:, columns(cut, "nq", "q_index")]
    for x, y in zip(to_v, (v, a)):
        x[:, columns(whole, "nv", "v_index")] = y[:, columns(cut, "nv", "v_index")]
    external = {"tip": rng.normal(size=(6, 6)), "first": rng.normal(size=(6, 6)), "middle": rng.normal(size=(6, 6))}
    expected = cut.reactions(q, v, a, external, joints=["weld"])[:, 0]
    state, plane = (to_q, *to_v), dict(point=(0, 0, 0.3), normal=(0, 0, 2.0))
    share = about_origin(FAR, (0, 0, 0.3))
    found = whole.section_wrench(*state, "middle", **plane, share=share, external=external)
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()
    named = whole.section_wrench(*state, "middle", **plane, share=share, beyond=["j3"], external=external, axes="world", order="ang_lin")
    R = whole.frame_pose(to_q, "middle")[:, :3, :3]
    world = [np.einsum("sij,sj->si", R, expected[:, k]) for k in (slice(3, 6), slice(3))]
    assert np.abs(named - np.concatenate(world, axis=1)).max() < 1e-12 * np.abs(expected).max()
    back = whole.section_wrench(*state, "middle", point=(0, 0, 0.3), normal=(0, 0, -1), share=about_origin(NEAR), external=external)
    assert np.abs(back + expected).max() < 1e-12 * np.abs(expected).max()


def test_wrenches_in_world_axes_are_those_in_the_links():
    m, rng = load_text(tree(False)), np.random.default_rng(3)
    q, v, a = random_states(m, rng, 4)
    world = {name: rng.normal(size=(4, 6)) for name in ("tip", "middle", "first")}
    R = {name: m.frame_pose(q, name)[:, :3, :3] for name in world}
    link = {name: np.concatenate([np.einsum("sji,sj->si", R[name], w[:, k]) for k in (slice(3), slice(3, 6))], axis=1) for name, w in world.items()}
    for normal in ((0, 0, 1), (0, 0, -1)):
        found = m.section_wrench(q, v, a, "middle", (0, 0, 0.3), normal, external=world, external_axes="world")
        expected = m.section_wrench(q, v, a, "middle", (0, 0, 0.3), normal, external=link)
        assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


def test_shares_and_bad_input():
    m = load_text(tree(False))
    q, v, a = random_states(m, np.random.default_rng(2), 3)
    plane = dict(point=(0, 0, 0.3), normal=(0, 0, 1))
    near = m.section_wrench(q, v, a, "middle", point=(0, 0, 0), normal=(0, 0, 1))  # all of it: what the joint transmits
    assert np.abs(near - m.reactions(q, v, a, joints=["j2"])[:, 0]).max() < 1e-12 * np.abs(near).max()
    none, half, all_ = (m.section_wrench(q, v, a, "middle", **plane, share=x) for x in (0, 0.5, 1.0))
    assert np.abs(half - (none + all_) / 2).max() < 1e-12 * np.abs(near).max()
    for keywords, sentence in (
        (dict(share=2), "share=2; expected a fraction"),
        (dict(share=(1.0, 2.0)), "expected mass, first moment"),
        (dict(normal=(0, 0, 0)), "expected a direction"),
        (dict(beyond=["j1"]), "no joint of middle"),
    ):
        with pytest.raises(ValueError, match=sentence):
            m.section_wrench(q, v, a, "middle", **(plane | keywords))


def linkage(sawn: bool, rod_is_successor: bool, spring_first: bool) -> ksl.Model:
    """Crank, rod and rocker in space, with springs on both halves of the rod, which is one piece, or two that are welded at x = 0.2.  No reaction is left open."""
    at = lambda x=0.0, y=0.0, z=0.0: np.block([[np.eye(3), np.array([[x], [y], [z]])], [np.zeros((1, 3)), 1]])
    cut = np.array([0.2, 0.0, 0.0])
    mass, h, I = (x + y for x, y in zip(about_origin(NEAR), about_origin(FAR, cut)))
    c = h / mass
    whole = {"mass": mass, "center_of_mass": c, "inertia": I - mass * (c @ c * np.eye(3) - np.outer(c, c))}
    half = lambda part: {"mass": part[1], "center_of_mass": part[0], "inertia": np.diag(part[2]) + COUPLING}
    b = (
        ksl.Builder("linkage")
        .add_link("ground")
        .add_link("crank", **half(FAR))
        .add_link("rod", **(half(NEAR) if sawn else whole))
        .add_link("rocker", **half(FAR))
    )
    b.add_joint("A", "continuous", "ground", "crank", axis=(0, 0, 1)).add_joint("E", "continuous", "ground", "rocker", pose=at(0.3, 0.1, 0), axis=(1, 0.2, 0))
    b.add_joint("U", "universal", "crank", "rod", pose=at(0.1), axis=(0, 0, 1), axis2=(0, 1, 0))
    end = "rod"
    if sawn:
        end = "half"
        b.add_link(end, **half(FAR)).add_joint("weld", "fixed", "rod", end, pose=at(*cut))
    head = np.array([0.4, 0.05, 0.0]) - (cut if sawn else 0)
    ends = [(end, at(*head)), ("rocker", at(0, 0, 0.3))]
    (p, at_p), (s, at_s) = ends[:: -1 if rod_is_successor else 1]
    b.add_loop("L", "spherical", p, s, at_p, at_s)
    springs = {"stiffness": 300.0, "free_length": 0.1, "damping": 20.0, "preload": 4.0}
    beyond, near = (end, np.array([0.3, 0, 0.1]) - (cut if sawn else 0)), ("rod", (0.1, 0.05, 0))
    for name, on in (("far spring", beyond), ("near spring", near)):
        one, other = [on, ("ground", (0.2, -0.3, 0.4))][:: 1 if spring_first else -1]
        b.add_force_element(name, *one, *other, **springs)
    return b.build(drives=["A"], physics="force elements")


@pytest.mark.parametrize("rod_is_successor", [False, True])
@pytest.mark.parametrize("spring_first", [False, True])
def test_sections_of_a_closed_mechanism_with_springs(rod_is_successor, spring_first):
    cut, whole = (linkage(x, rod_is_successor, spring_first) for x in (True, False))
    rng = np.random.default_rng(3)
    start = whole.neutral()
    start[whole.joint("E").q_index] = 0.2
    q = whole.close(start).q
    assert whole.mobility(q).mobility == 1 and whole.mobility(q).redundant == 0 and [j.name for j in cut.joints[:3]] == [j.name for j in whole.joints[:3]]
    v = whole.consistent_velocity(q, 2 * rng.normal(size=4), given=["A"])
    a = whole.consistent_acceleration(q, v, 3 * rng.normal(size=4), given=["A"])
    external = {"rod": rng.normal(size=6), "rocker": rng.normal(size=6)}
    expected = cut.reactions(q, v, a, external, joints=["weld"])[0]
    assert (
        np.abs(
            expected - whole.with_physics([]).section_wrench(q, v, a, "rod", (0.2, 0, 0), (1, 0, 0), share=about_origin(FAR, (0.2, 0, 0)), external=external)
        ).max()
        > 1
    )
    for beyond in (None, ["L"]):
        found = whole.section_wrench(q, v, a, "rod", (0.2, 0, 0), (1, 0, 0), share=about_origin(FAR, (0.2, 0, 0)), beyond=beyond, external=external)
        assert np.abs(found - expected).max() < 1e-11 * np.abs(expected).max()
    back = whole.section_wrench(np.stack([q, q]), v, a, "rod", (0.2, 0, 0), (-1, 0, 0), share=about_origin(NEAR), external=external)
    assert np.abs(back + expected).max() < 1e-11 * np.abs(expected).max()
