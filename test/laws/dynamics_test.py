"""Forward dynamics, mass matrix and bias, on random trees: identities between independent algorithms."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from random_tree import load_text, random_external, random_states, random_tree

U = np.finfo(float).eps / 2
BRICK = '<inertial><mass value="0.5"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>'

seeds = st.integers(0, 2**32 - 1)
bases = st.booleans()


def heavy_tree(seed, bodies, floating):
    """A random robot whose links all have mass, so that every effort accelerates something."""
    rng = np.random.default_rng(seed)
    text = re.sub(r'(<link name="\w+">)(</link>)', rf"\1{BRICK}\2", random_tree(rng, bodies))
    return load_text(text, floating_base=floating), rng


@given(seeds, st.integers(1, 64), bases)
def test_three_algorithms_agree(seed, bodies, floating):
    """ID∘FD = 1 and ABA = solve with CRBA, to C n u cond(M), n links; C = 2.8 was the largest of 1200 states, 8 is allowed."""
    m, rng = heavy_tree(seed, bodies, floating)
    if m.nv == 0:
        return
    q, v, tau = random_states(m, rng, 3)
    a = m.forward_dynamics(q, v, tau)
    M, bias = m.mass_matrix(q), m.bias(q, v)
    assert np.array_equal(M, np.swapaxes(M, -1, -2))
    for k in range(len(q)):
        eigenvalues = np.linalg.eigvalsh(M[k])
        assert eigenvalues[0] > 0
        bound = 8 * len(m.links) * U * eigenvalues[-1] / eigenvalues[0]
        solved = np.linalg.solve(M[k], tau[k] - bias[k])
        scale = np.abs(solved).max()
        assert np.abs(a[k] - solved).max() <= bound * scale
        assert np.abs(m.inverse_dynamics(q[k], v[k], a[k]) - tau[k]).max() <= bound * max(1.0, np.abs(tau[k]).max(), np.abs(bias[k]).max())


@given(seeds, st.integers(1, 30), bases)
def test_mass_matrix_is_twice_the_kinetic_energy(seed, bodies, floating):
    m, rng = heavy_tree(seed, bodies, floating)
    q, v, _ = random_states(m, rng, 4)
    kinetic, _ = m.energy(q, v)
    assert np.einsum("si,sij,sj->s", v, m.mass_matrix(q), v) / 2 == pytest.approx(kinetic, rel=1e-11, abs=1e-12)


@given(seeds, st.integers(1, 30), bases)
def test_external_wrenches_enter_all_alike(seed, bodies, floating):
    m, rng = heavy_tree(seed, bodies, floating)
    q, v, a = random_states(m, rng, 2)
    external = random_external(m, rng, 2)
    tau = m.inverse_dynamics(q, v, a, external=external)
    scale = max(1.0, np.abs(tau).max(initial=0))
    assert np.abs(m.bias(q, v, external=external) + np.einsum("sij,sj->si", m.mass_matrix(q), a) - tau).max(initial=0) < 1e-11 * scale
    assert np.abs(m.gravity_torque(q, external=external) - m.inverse_dynamics(q, 0 * v, 0 * a, external=external)).max(initial=0) == 0
    forward = m.forward_dynamics(q, v, tau, external=external)
    assert np.abs(m.inverse_dynamics(q, v, forward, external=external) - tau).max(initial=0) < 1e-7 * scale
