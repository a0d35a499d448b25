"""Depth: chains far longer than a robot, which recursion would not survive."""

import numpy as np
import pytest

from newton_euler import read_tree
from random_tree import load_text, random_states, witness


def chain(bodies: int, kind: str = "revolute") -> str:
    tensor = 'ixx="0.002" iyy="0.003" izz="0.004" ixy="0.0001" ixz="0.0002" iyz="0.0003"'
    inertial = f'<inertial><origin xyz="0.05 0.01 0.02"/><mass value="0.5"/><inertia {tensor}/></inertial>'
    joints = "".join(
        f'<joint name="j{i}" type="{kind}"><parent link="l{i}"/><child link="l{i + 1}"/><origin xyz="0.1 0.02 0.03" rpy="0.3 0.2 {i % 7}"/>'
        f'<axis xyz="{i % 3} 1 {i % 2}"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint>'
        for i in range(bodies - 1)
    )
    return '<robot name="chain">' + "".join(f'<link name="l{i}">{inertial}</link>' for i in range(bodies)) + joints + "</robot>"


@pytest.mark.parametrize("kind", ["revolute", "fixed"])
def test_chain_of_a_thousand_links_against_the_witness(kind):
    text = chain(1000, kind)
    m = load_text(text)
    assert len(m.link_names) == 1000 and m.nv == (999 if kind == "revolute" else 0)
    q, v, a = random_states(m, np.random.default_rng(1), 2)
    v, a = 0.1 * v, 0.1 * a
    w = witness(m, read_tree(text), q, v, a)
    names = [j.name for j in m.joints]
    found = m.reactions(q, v, a, joints=names)
    expected = np.stack([w.in_joint_frame(j.child) for j in m.joints], axis=1)
    scale = np.abs(expected).max(axis=(0, 2), keepdims=True)
    assert np.abs((found - expected) / np.maximum(scale, 1e-3 * scale.max())).max() < 1e-10
    if m.nv:
        tau, effort = m.inverse_dynamics(q, v, a), np.concatenate([w.effort[j.child] for j in m.joints if j.nv], axis=1)
        assert np.abs(tau - effort).max() < 1e-11 * np.abs(effort).max()


def test_a_very_long_chain_neither_overflows_the_stack_nor_takes_long():
    bodies = 20_000
    m = load_text(chain(bodies))
    zero = np.zeros(m.nv)
    base = m.reactions(zero, zero, zero, joints=["base"])
    assert base[0, 2] == pytest.approx(0.5 * 9.81 * bodies, rel=1e-10)


def test_a_wide_tree():
    """Ten thousand children of one link, in file order."""
    n = 10_000
    joints = "".join(f'<joint name="j{i}" type="continuous"><parent link="root"/><child link="l{i}"/><axis xyz="0 0 1"/></joint>' for i in range(n))
    m = load_text('<robot name="star"><link name="root"/>' + "".join(f'<link name="l{i}"/>' for i in range(n)) + joints + "</robot>")
    assert m.joint_names == [f"j{i}" for i in range(n)]
