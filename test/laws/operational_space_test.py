"""Dynamics at frames: against J, M and bias as dense matrices, and against forward dynamics under the wrenches."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from random_tree import load_text, random_external, random_states, random_tree

OPTIONS = [
    dict(axes=a, at=p, order=o)
    for a, p, o in (("frame", "frame", "lin_ang"), ("world", "frame", "ang_lin"), ("world", "world", "lin_ang"), ("frame", "world", "ang_lin"))
]


def stacked(call, names, **how):
    return np.concatenate([call(name, **how) for name in names], axis=-2)


def transpose(A):
    return np.swapaxes(A, -1, -2)


def near(found, expected, limit):
    assert np.abs(found - expected).max() <= limit * max(1.0, np.abs(expected).max())


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(2, 14), st.booleans())
def test_inertia_bias_and_pseudo_inverse_are_those_of_the_dense_matrices(seed, bodies, floating):
    rng = np.random.default_rng(seed)
    m = load_text(random_tree(rng, bodies), floating_base=floating)
    assume(m.nv)
    q, v, _ = random_states(m, rng, 3)
    M = m.mass_matrix(q)
    condition = np.linalg.cond(M)
    assume(np.isfinite(condition).all() and condition.max() < 1e6)
    names = [str(n) for n in rng.choice(m.link_names, min(len(m.link_names), int(rng.integers(1, 4))))]
    external = random_external(m, rng, 3)
    for how in OPTIONS:
        J = stacked(lambda n, **how: m.jacobian(q, n, **how), names, **how)
        rate = stacked(lambda n, **how: m.jacobian_rate(q, v, n, **how), names, **how)
        dense = J @ np.linalg.solve(M, transpose(J))
        inverse = m.operational_space_inertia_inverse(q, names, **how)
        near(inverse, dense, 1e-13 * condition.max())
        assert np.array_equal(inverse, transpose(inverse))
        inertia, rank = m.operational_space_inertia(q, names, **how)
        found, bias, pseudo_inverse, same_rank = m.operational_space(q, v, external, names, **how)
        assert inertia.shape == dense.shape and np.array_equal(rank, same_rank)
        singular = np.linalg.svd(dense, compute_uv=False)
        clear = ((singular > 1e-7 * singular[:, :1]) | (singular < 1e-13 * singular[:, :1])).all(axis=1)
        assert (rank == np.linalg.matrix_rank(dense, tol=1e-9 * singular[:, 0], hermitian=True))[clear].all()
        for s in np.flatnonzero(clear & (rank == dense.shape[-1])):
            worst = condition[s] * np.linalg.cond(dense[s]) * 1e-13
            if worst > 1e-5:
                continue
            expected = np.linalg.inv(dense[s])
            near(inertia[s], expected, worst)
            near(found[s], expected, worst)
            near(pseudo_inverse[s], np.linalg.solve(M[s], J[s].T) @ expected, worst)
            near(J[s] @ pseudo_inverse[s], np.eye(len(expected)), worst)
            b = m.bias(q[s], v[s], {k: x[s] for k, x in external.items()})
            near(bias[s], expected @ (J[s] @ np.linalg.solve(M[s], b) - rate[s] @ v[s]), worst)


def test_wrenches_of_the_law_give_the_rates_it_says(examples):
    """F = inertia x'' + bias, by forward dynamics with the wrench F on the frame, and frame_acceleration."""
    import ksl

    m = ksl.load(examples / "robots/ur5.urdf", floating_base=True)
    rng = np.random.default_rng(1)
    q, v, _ = random_states(m, rng, 20)
    inertia, bias, pseudo_inverse, rank = m.operational_space(q, v, names=["tool0"])
    assert (rank == 6).all()
    x = rng.normal(size=(20, 6))
    F = np.einsum("sij,sj->si", inertia, x) + bias
    a = m.forward_dynamics(q, v, np.zeros((20, m.nv)), {"tool0": F})
    near(m.frame_acceleration(q, v, a, "tool0", kind="rate"), x, 1e-9)
    free = m.forward_dynamics(q, v, np.zeros((20, m.nv)))
    drift = m.frame_acceleration(q, v, free, "tool0", kind="rate")
    near(a - free, np.einsum("sij,sj->si", pseudo_inverse, x - drift), 1e-9)


def test_a_frame_that_cannot_move_in_every_direction(examples):
    import ksl

    m = ksl.load(examples / "robots/ur5.urdf")
    q = np.random.default_rng(2).uniform(-1, 1, (10, 6)) + 1.5
    inertia, rank = m.operational_space_inertia(q, ["forearm_link"])
    inverse = m.operational_space_inertia_inverse(q, ["forearm_link"])
    assert (rank == 3).all() and np.abs(inverse @ inertia @ inverse - inverse).max() < 1e-9 * np.abs(inverse).max()
    inertia, rank = m.operational_space_inertia(q, ["tool0", "tool0"])
    assert (rank == 6).all() and ((inertia != 0).any(axis=2).sum(axis=1) == 6).all()
    both = inertia.reshape(10, 2, 6, 2, 6).sum(axis=(1, 3))  # the frames move together
    near(both, m.operational_space_inertia(q, ["tool0"])[0], 1e-9)
    inertia, rank = m.operational_space_inertia(q, ["base_link"])
    assert (rank == 0).all() and (inertia == 0).all()


def test_too_many_frames_are_refused(examples):
    import ksl

    m = ksl.load(examples / "robots/ur5.urdf")
    with pytest.raises(ValueError, match="frames; expected at most as many as the model has links"):
        m.operational_space_inertia_inverse(np.zeros(6), ["tool0"] * 20)
