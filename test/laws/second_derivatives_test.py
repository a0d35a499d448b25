"""Second derivatives against central differences of the first, with mimic joints and the physics of joints, from Python."""

import numpy as np
import pytest
from projection import random_projection
from random_tree import load_text, random_external, random_states, random_tree

STEP = 1e-6
PHYSICS = """<robot name="arm"><link name="a"/>
<link name="b"><inertial><origin xyz="0.1 0.2 0.3"/><mass value="2"/><inertia ixx="1" iyy="1.2" izz="0.9" ixy="0" iyz="0" ixz="0"/></inertial></link>
<link name="c"><inertial><origin xyz="0.3 0 0.1"/><mass value="1"/><inertia ixx="1" iyy="1.2" izz="0.9" ixy="0" iyz="0" ixz="0"/></inertial></link>
<joint name="turn" type="continuous"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/><dynamics damping="0.3" friction="2"/></joint>
<joint name="slide" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 1 0"/><dynamics friction="0.7"/></joint></robot>"""


def check(m, first, second, q, v, x, external, tolerance):
    """first(q, v, x): three derivatives; second: by q q, v v, q v, and (q, x) or (x, q)."""
    qq, vv, qv, last = second(q, v, x, external)
    scale = 1 + max(np.abs(D).max() for D in (qq, vv, qv, last))
    for l, e in enumerate(STEP * np.eye(m.nv)):
        by_q = [(a - b) / (2 * STEP) for a, b in zip(first(m.integrate(q, e), v, x, external), first(m.integrate(q, -e), v, x, external))]
        by_v = [(a - b) / (2 * STEP) for a, b in zip(first(q, v + e, x, external), first(q, v - e, x, external))]
        expected = [(qq, by_q[0]), (vv, by_v[1]), (qv, by_v[0])]
        for D, found in expected:
            assert np.abs(D[:, :, l] - found).max() < tolerance * scale
        assert np.abs(qv[:, l] - by_q[1]).max() < tolerance * scale
        of_last = last[:, :, l] if first == m.inverse_dynamics_derivatives else last[:, l]
        assert np.abs(of_last - by_q[2]).max() < tolerance * scale


def check_efforts(m, q, v, a, external):
    check(m, m.inverse_dynamics_derivatives, m.inverse_dynamics_second_derivatives, q, v, a, external, 1e-7)


@pytest.mark.parametrize("seed", range(6))
def test_random_trees(seed):
    rng = np.random.default_rng(seed)
    m = load_text(random_tree(rng, 4))
    q, v, a = (x[0] for x in random_states(m, rng, 1))
    external = {link: w[0] for link, w in random_external(m, rng, 1).items()}
    check_efforts(m, q, v, a, external)
    if m.nv and np.linalg.cond(m.mass_matrix(q)) < 1e4:
        tau = m.inverse_dynamics(q, v, a, external)
        check(m, m.forward_dynamics_derivatives, m.forward_dynamics_second_derivatives, q, v, tau, external, 1e-5)


@pytest.mark.parametrize("seed", range(6))
def test_mimic_joints(seed):
    p, rng = random_projection(seed)
    q, v, a = (x[0] for x in random_states(p.m, rng, 1))
    external = {link: w[0] for link, w in random_external(p.m, rng, 1).items()}
    check_efforts(p.m, q, v, a, external)


def test_physics_of_joints():
    m = load_text(PHYSICS, physics=["damping", "friction"], friction_width=0.5)
    q, v, a = np.array([[0.3, -1.2], [0.2, -0.4], [1.0, 2.0]])
    check_efforts(m, q, v, a, None)
    check(m, m.forward_dynamics_derivatives, m.forward_dynamics_second_derivatives, q, v, a, None, 1e-6)


def test_a_batch_is_its_states_to_the_bit():
    rng = np.random.default_rng(3)
    m = load_text(random_tree(rng, 9))
    q, v, x = random_states(m, rng, 7)
    for call in (m.inverse_dynamics_second_derivatives, m.forward_dynamics_second_derivatives):
        whole = call(q, v, x)
        for k in range(len(q)):
            for D, one in zip(whole, call(q[k], v[k], x[k])):
                assert D.shape == (7, m.nv, m.nv, m.nv) and np.array_equal(D[k], one)
