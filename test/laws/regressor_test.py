"""Regressors: times the links' parameters they are what they stand for, for any parameters, and column by column."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from newton_euler import apply, coadjoint, inertia_matrix, transpose
from random_tree import Case

REQUESTS = ({}, {"axes": "world", "at": "world"}, {"part": "constraint", "order": "ang_lin"}, {"part": "actuation", "on": "parent", "at": (0.3, -0.2, 0.5)})


def close(found, expected, scale: float = 1.0, limit: float = 1e-12) -> None:
    scale = max(scale, float(np.abs(expected).max(initial=0.0)))
    assert np.abs(found - expected).max(initial=0.0) < limit * scale * 10, np.abs(found - expected).max() / scale


@given(st.integers(0, 2**32 - 1), st.integers(2, 25), st.booleans())
def test_times_the_parameters(seed, bodies, floating):
    case = Case(seed, bodies, floating_base=floating)
    m, (q, v, a), phi = case.m, case.state, case.m.parameters
    close(np.einsum("sjlp,lp->sj", m.inverse_dynamics_regressor(q, v, a), phi), m.inverse_dynamics(q, v, a), case.load)
    close(np.einsum("sjlp,lp->sj", m.gravity_torque_regressor(q), phi), m.gravity_torque(q), case.load)
    for found, energy in zip(m.energy_regressor(q, v), m.energy(q, v)):
        close(np.einsum("slp,lp->s", found, phi), energy, case.load)
    everything = [j.name for j in m.joints]
    there = {"axes": m.link_names[-1], "at": m.link_names[len(m.link_names) // 2], "part": "constraint"}
    for options in (*REQUESTS, there):
        Y = m.reactions_regressor(q, v, a, joints=everything, **options)
        close(np.einsum("sjclp,lp->sjc", Y, phi), m.reactions(q, v, a, joints=everything, **options), case.load)


@given(st.integers(0, 2**32 - 1), st.integers(2, 15), st.booleans())
def test_momentum(seed, bodies, floating):
    """About the world's origin, of each link by itself."""
    case = Case(seed, bodies, floating_base=floating)
    m, w = case.m, case.witness
    P = np.einsum("sclp,lp->slc", m.momentum_regressor(case.q, case.v), m.parameters)
    for i, name in enumerate(m.link_names):
        X = coadjoint(w.pose[name])
        expected = apply(X @ inertia_matrix(case.tree.links[name]) @ transpose(X), w.twist[name])
        close(P[:, i], np.concatenate([expected[:, 3:], expected[:, :3]], axis=1), case.load)


@given(st.integers(0, 2**32 - 1), st.integers(2, 15))
def test_links_that_are_asked_for(seed, bodies):
    case = Case(seed, bodies)
    m, (q, v, a) = case.m, case.state
    names = [str(x) for x in case.rng.choice(m.link_names, 3)]
    where = [m.link_names.index(n) for n in names]
    assert np.array_equal(m.inverse_dynamics_regressor(q, v, a, links=names), m.inverse_dynamics_regressor(q, v, a)[:, :, where])
    assert np.array_equal(m.momentum_regressor(q, v, links=names), m.momentum_regressor(q, v)[:, :, where])
    for few, all_links in zip(m.energy_regressor(q, v, links=names), m.energy_regressor(q, v)):
        assert np.array_equal(few, all_links[:, where])
    assert (m.gravity_torque_regressor(q)[..., 4:] == 0).all()


def test_the_reactions_of_what_a_joint_carries_give_its_effort(seed=4):
    """Sᵀ times the reaction's regressor is the row of the joint's effort."""
    case = Case(seed, 12, kinds=("revolute", "prismatic", "fixed"))
    m, (q, v, a) = case.m, case.state
    Y, R = m.inverse_dynamics_regressor(q, v, a), m.reactions_regressor(q, v, a)
    for i, name in enumerate(m.joint_names):
        j = m.joint(name)
        part = R[:, i, 3:] if j.has_angle else R[:, i, :3]
        close(np.einsum("c,sclp->slp", np.array(j.axis), part), Y[:, j.v_index], case.load)
