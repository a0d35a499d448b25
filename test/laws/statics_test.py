"""Poses at rest: efforts that hold them, reactions, and how the efforts change with the pose."""

import numpy as np

from random_tree import load_text, random_external, random_states, random_tree

KINDS = ("revolute", "continuous", "prismatic", "helical", "fixed")


def test_stiffness_is_the_derivative_of_the_holding_efforts():
    rng = np.random.default_rng(1)
    m = load_text(random_tree(rng, 12, KINDS))
    q, _, _ = random_states(m, rng, 5)
    external = random_external(m, rng, 5)
    found, h = m.stiffness(q, external), 1e-4
    for k in range(m.nv):
        e = np.zeros(m.nq)
        e[k] = h
        near, far = ((m.gravity_torque(q + s * e, external) - m.gravity_torque(q - s * e, external)) / (2 * s) for s in (1, 2))
        expected = (4 * near - far) / (3 * h)
        assert np.abs(found[..., k] - expected).max() < 1e-8 * max(1.0, np.abs(expected).max())
    free = m.stiffness(q)
    assert np.abs(free - np.swapaxes(free, -1, -2)).max() < 1e-12 * max(1.0, np.abs(free).max())


def test_reactions_at_rest_hold_the_pose():
    rng = np.random.default_rng(2)
    m = load_text(random_tree(rng, 10, KINDS))
    q, _, _ = random_states(m, rng, 4)
    external, rest = random_external(m, rng, 4), np.zeros(m.nv)
    actuation = m.reactions(q, rest, rest, external, part="actuation")
    tau = m.gravity_torque(q, external)
    for i, name in enumerate(m.joint_names):
        j = m.joint(name)
        axis = np.array(j.axis)
        effort = actuation[:, i, 3:] @ axis if j.kind != "prismatic" else actuation[:, i, :3] @ axis
        assert np.abs(effort - tau[:, j.v_index]).max() < 1e-12 * max(1.0, np.abs(tau).max())
