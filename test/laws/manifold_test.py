"""Positions as a manifold, from Python: neutral and random positions, and that velocities are rates of positions."""

import numpy as np
import pytest
from random_tree import load_text, random_states, random_tree

LIMITED = """<robot name="limited"><link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="e"/><link name="f"/><link name="g"/>
<joint name="turn" type="revolute"><parent link="a"/><child link="b"/><limit effort="1" velocity="1" lower="-0.5" upper="2"/></joint>
<joint name="wheel" type="continuous"><parent link="b"/><child link="c"/></joint>
<joint name="slide" type="prismatic"><parent link="c"/><child link="d"/><limit effort="1" velocity="1" upper="0.25"/></joint>
<joint name="free" type="floating"><parent link="d"/><child link="e"/></joint>
<joint name="ball" type="spherical"><parent link="e"/><child link="f"/></joint>
<joint name="finger" type="revolute"><parent link="f"/><child link="g"/><limit effort="1" velocity="1" lower="-1" upper="1"/>
<mimic joint="turn" multiplier="-2" offset="0.5"/></joint></robot>"""


def test_neutral_is_zero_and_no_rotation():
    m = load_text(LIMITED)
    q = m.neutral()
    assert q.shape == (m.nq,) and sorted(q) == [0.0] * (m.nq - 2) + [1.0, 1.0]
    pose = m.frame_pose(q, "f")
    assert np.array_equal(pose, np.eye(4))


def test_random_positions_are_uniform_within_limits():
    m = load_text(LIMITED)
    rng = np.random.default_rng(0)
    q = m.random(rng, size=40000)
    assert q.shape == (40000, m.nq) and m.random(rng).shape == (m.nq,) and m.random(rng, (2, 3)).shape == (2, 3, m.nq)
    assert np.array_equal(m.random(5), m.random(np.random.default_rng(5))) and not np.array_equal(m.random(), m.random())
    # turn is limited by finger as well: −1 ≤ −2 q + 0.5 ≤ 1
    ranges = {"turn": (-0.25, 0.75), "wheel": (-np.pi, np.pi), "slide": (-1.75, 0.25)}
    numbers = {name: q[:, m.joint(name).q_index] for name in ranges}
    start = m.joint("free").q_index
    for i, axis in enumerate("xyz"):
        ranges[axis], numbers[axis] = (-1, 1), q[:, start + i]
    for name, (lower, upper) in ranges.items():
        x = (numbers[name] - lower) / (upper - lower)
        assert x.min() > 0 and x.max() <= 1, name
        assert np.abs(np.histogram(x, 10, (0, 1))[0] / len(x) - 0.1).max() < 0.01, name
    for name, at in (("free", 3), ("ball", 0)):
        quaternion = q[:, m.joint(name).q_index + at :][:, :4]
        assert np.abs(np.linalg.norm(quaternion, axis=1) - 1).max() < 1e-15
        assert np.abs(quaternion.T @ quaternion / len(q) - np.eye(4) / 4).max() < 0.01  # of a uniform direction
        assert abs(np.mean(quaternion[:, 3] ** 4) - 1 / 8) < 0.01


@pytest.mark.parametrize("seed", range(10))
def test_velocity_is_the_rate_of_positions(seed):
    """Poses of links move along q ⊕ s v as their twists J v say."""
    rng = np.random.default_rng(seed)
    m = load_text(random_tree(rng, 8))
    (q,), (v,), _ = random_states(m, rng, 1)
    link, h = m.link_names[-1], 1e-5
    before, after = (m.frame_pose(m.integrate(q, s * v), link) for s in (-h, h))
    rate, twist = (after - before) / (2 * h), m.jacobian(q, link, axes="world") @ v
    assert np.abs(rate[:3, 3] - twist[:3]).max() < 1e-7 * max(1, np.abs(twist).max() ** 3)
    spin = rate[:3, :3] @ m.frame_pose(q, link)[:3, :3].T
    assert np.abs(np.array([spin[2, 1], spin[0, 2], spin[1, 0]]) - twist[3:]).max() < 1e-7 * max(1, np.abs(twist).max() ** 3)
