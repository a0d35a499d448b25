"""The mass and forward groups, on random trees: identities between independent algorithms."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ksl
from dynamics_test import heavy_tree
from random_tree import load_text, random_external, random_states, random_tree

U = np.finfo(float).eps / 2
seeds, bases = st.integers(0, 2**32 - 1), st.booleans()


def dense(m: ksl.Model, elements: np.ndarray) -> np.ndarray:
    """The lower triangle (…, nv, nv) of elements in compressed sparse rows."""
    out = np.zeros((*elements.shape[:-1], m.nv, m.nv))
    rows = np.repeat(np.arange(m.nv), np.diff(m.tree_rows))
    out[..., rows, m.tree_columns] = elements
    return out


@given(seeds, st.integers(1, 64), bases)
def test_forms_factors_and_inverse_of_the_mass_matrix(seed, bodies, floating):
    """M M⁻¹ = 1 to C n u cond(M)."""
    m, rng = heavy_tree(seed, bodies, floating)
    if m.nv == 0:
        return
    q, v, tau = random_states(m, rng, 3)
    M = m.mass_matrix(q)
    diagonal = np.arange(m.nv)
    assert np.array_equal(np.triu(m.mass_matrix_upper(q)), np.triu(M))
    assert np.array_equal(dense(m, m.mass_matrix_tree(q)), np.tril(M))
    LD = dense(m, m.mass_matrix_factor(q))
    D = LD[:, diagonal, diagonal].copy()
    LD[:, diagonal, diagonal] = 1
    assert (D > 0).all()
    assert np.abs(np.einsum("ski,sk,skj->sij", LD, D, LD) - M).max() <= 1e-13 * np.abs(M).max()
    W, x = m.mass_matrix_inverse(q), m.solve_mass_matrix(q, tau)
    assert np.array_equal(W, np.swapaxes(W, -1, -2))
    for k in range(len(q)):
        bound = 8 * len(m.links) * U * np.linalg.cond(M[k])
        assert np.abs(M[k] @ W[k] - np.eye(m.nv)).max() <= bound
        assert np.abs(W[k] @ tau[k] - x[k]).max() <= bound * np.abs(x[k]).max()


@given(seeds, st.integers(1, 30), bases)
def test_coriolis_matrix_gives_the_bias(seed, bodies, floating):
    m, rng = heavy_tree(seed, bodies, floating)
    q, v, _ = random_states(m, rng, 3)
    C, gravity = m.coriolis_matrix(q, v), m.gravity_torque(q)
    scale = max(1.0, np.abs(gravity).max(initial=0), np.abs(C).max(initial=0))
    assert np.abs(np.einsum("sij,sj->si", C, v) + gravity - m.bias(q, v)).max(initial=0) <= 1e-12 * scale
    assert np.abs(m.coriolis_matrix(q, -2 * v) + 2 * C).max(initial=0) <= 1e-12 * scale, "linear in v"


@given(seeds, st.integers(2, 30), bases)
def test_hybrid_dynamics_lies_between_forward_and_inverse(seed, bodies, floating):
    m, rng = heavy_tree(seed, bodies, floating)
    q, v, tau = random_states(m, rng, 2)
    a, external = rng.normal(size=v.shape), random_external(m, rng, 2)
    forward = m.forward_dynamics(q, v, tau, external=external)
    moving = [j for j in m.joints if j.nv]
    assert np.array_equal(m.hybrid_dynamics(q, v, a, tau, names=[], external=external)[0], forward)
    by_mass_matrix = m.forward_dynamics_by_mass_matrix(q, v, tau, external=external)
    assert np.abs(by_mass_matrix - forward).max(initial=0) <= 1e-7 * max(1.0, np.abs(forward).max(initial=0))
    chosen = [j for j in moving if rng.random() < 0.5]
    known = np.zeros(m.nv, dtype=bool)
    for j in chosen:
        known[j.v_index : j.v_index + j.nv] = True
    all_a, all_tau = m.hybrid_dynamics(q, v, np.where(known, a, np.nan_to_num(a)), tau, names=[j.name for j in chosen], external=external)
    assert np.array_equal(all_a[:, known], a[:, known]) and np.array_equal(all_tau[:, ~known], tau[:, ~known])
    scale = max(1.0, np.abs(all_tau).max(initial=0))
    assert np.abs(m.inverse_dynamics(q, v, all_a, external=external) - all_tau).max(initial=0) <= 1e-7 * scale


@given(seeds, st.integers(1, 30), bases)
def test_velocity_jump_is_that_of_external_wrenches_of_short_duration(seed, bodies, floating):
    m, rng = heavy_tree(seed, bodies, floating)
    q, _, _ = random_states(m, rng, 2)
    impulse = random_external(m, rng, 2)
    momentum = np.einsum("sij,sj->si", m.mass_matrix(q), m.velocity_jump(q, impulse))
    transmitted = m.gravity_torque(q) - m.gravity_torque(q, external=impulse)
    assert np.abs(momentum - transmitted).max(initial=0) <= 1e-8 * max(1.0, np.abs(transmitted).max(initial=0))


def test_a_joint_that_moves_no_mass_is_refused_by_name():
    rng = np.random.default_rng(1)
    text = random_tree(rng, 6, ("revolute",)).replace("</robot>", '<link name="tip"/><joint name="last" type="revolute"><parent link="link5"/>'
                                                      '<child link="tip"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint></robot>')  # fmt: skip
    text = re.sub(r'(<link name="link\d">)(</link>)', r'\1<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>\2', text)
    m = load_text(text)
    q, v, tau = random_states(m, rng, 1)
    assert np.isfinite(m.inverse_dynamics(q, v, tau)).all()
    for call in (m.forward_dynamics, m.forward_dynamics_by_mass_matrix, m.forward_dynamics_derivatives):
        with pytest.raises(ValueError, match="joint last can move without moving any mass.*link tip"):
            call(q, v, tau)
    for call in (m.mass_matrix_inverse, m.mass_matrix_factor):
        with pytest.raises(ValueError, match="joint last"):
            call(q)
