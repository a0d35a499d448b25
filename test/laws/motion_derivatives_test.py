"""Derivatives of motions, energies and momentum on random trees, against differences of the algorithms themselves; derivatives by
external wrenches and by parameters; wrenches that are given, and held, in the world's axes."""

import numpy as np
import pytest

from differences import STEP, case, close, differences

TREES = range(16)


def turned(m, q, external):
    """External wrenches in the world's axes, in those of their links."""
    out = {}
    for name, w in external.items():
        R = m.frame_pose(q, name)[..., :3, :3]
        out[name] = np.concatenate([np.einsum("...ji,...j->...i", R, w[..., k : k + 3]) for k in (0, 3)], axis=-1)
    return out


@pytest.mark.parametrize("seed", TREES)
def test_wrenches_in_world_axes(seed):
    """Every algorithm that takes external wrenches finds the same as with the wrenches turned to their links' axes."""
    m, rng, q, v, a, external = case(seed, heavy=True)
    joints, name = [j.name for j in m.joints], str(rng.choice(m.link_names))
    own = turned(m, q, external)
    calls = [
        lambda w, **k: m.inverse_dynamics(q, v, a, w, **k),
        lambda w, **k: m.bias(q, v, w, **k),
        lambda w, **k: m.gravity_torque(q, w, **k),
        lambda w, **k: m.effort_parts(q, v, a, w, **k),
        lambda w, **k: m.effort_part(q, v, a, external=w, **k),
        lambda w, **k: m.reactions(q, v, a, w, joints=joints, **k),
        lambda w, **k: m.external_power(q, v, w, **k),
    ]
    condition = np.linalg.cond(m.mass_matrix(q)) if m.nv else np.inf
    if condition < 1e6:
        calls += [
            lambda w, **k: m.forward_dynamics(q, v, a, w, **k),
            lambda w, **k: m.forward_dynamics_by_mass_matrix(q, v, a, w, **k),
            lambda w, **k: m.hybrid_dynamics(q, v, a, a, w, m.joint_names[:1], **k)[1],
            lambda w, **k: m.velocity_jump(q, w, **k),
            lambda w, **k: m.operational_space(q, v, w, [name], **k)[1],
        ]
    for call in calls:
        expected = call(own)
        found = call(external, external_axes="world")
        assert np.abs(found - expected).max(initial=0) <= 1e-13 * min(condition, 1e6) * max(1, np.abs(expected).max(initial=0))
        assert np.array_equal(call(own, external_axes="link"), expected)


@pytest.mark.parametrize("seed", TREES)
def test_derivatives_with_wrenches_held_in_the_world(seed):
    m, rng, q, v, a, external = case(seed, heavy=True)
    if not m.nv:
        return
    held = {"external_axes": "world"}
    close(m.inverse_dynamics_derivatives(q, v, a, external, **held), differences(m, lambda *at: m.inverse_dynamics(*at, external, **held), q, v, a), 1e-9)
    assert np.array_equal(m.stiffness(q, external, **held), m.inverse_dynamics_derivatives(q, 0 * v, 0 * v, external, **held)[0])
    joints = [str(name) for name in rng.choice([j.name for j in m.joints], 3)]
    for part in ("total", "constraint", "actuation"):
        options = {"joints": joints, "part": part, "axes": str(rng.choice(["joint", "world"])), **held}
        close(m.reactions_derivatives(q, v, a, external, **options), differences(m, lambda *at: m.reactions(*at, external, **options), q, v, a), 1e-9)
    if (condition := np.linalg.cond(m.mass_matrix(q))) < 1e6:
        found = m.forward_dynamics_derivatives(q, v, a, external, **held)
        close(found, differences(m, lambda *at: m.forward_dynamics(*at, external, **held), q, v, a), 1e-10 * max(condition, 10))
    many = np.arange(19)[:, None] * 1e-2
    batch = m.inverse_dynamics_derivatives(q, v + many, a, external, **held)
    for k in (0, 7, 18):  # one state has the same bits as many
        for one, all_states in zip(m.inverse_dynamics_derivatives(q, v + many[k], a, external, **held), batch):
            assert np.array_equal(one, all_states[k])


@pytest.mark.parametrize("seed", TREES)
def test_derivatives_by_external_wrenches(seed):
    """Products of Jacobians, and of reactions the matrices of which wrenches are multiplied."""
    m, rng, q, v, a, external = case(seed, heavy=True)
    name, push = str(rng.choice(m.link_names)), rng.normal(size=6)
    for axes, how in (("link", {}), ("world", {"axes": "world", "at": "frame"})):
        J = m.jacobian(q, name, **how)
        change = m.inverse_dynamics(q, v, a, {name: push}, external_axes=axes) - m.inverse_dynamics(q, v, a)
        scale = max(1, np.abs(m.inverse_dynamics(q, v, a)).max(initial=0), np.abs(J).max(initial=0))
        assert np.abs(change + J.T @ push).max(initial=0) <= 1e-12 * scale
        if m.nv and (condition := np.linalg.cond(m.mass_matrix(q))) < 1e6:
            change = m.forward_dynamics(q, v, a, {name: push}, external_axes=axes) - m.forward_dynamics(q, v, a)
            assert np.abs(change - m.mass_matrix_inverse(q) @ J.T @ push).max() <= 1e-13 * condition * scale * m.nv**2 * 10
    joints = [j.name for j in m.joints]
    for part in ("total", "constraint", "actuation", "coupling"):
        options = {"joints": joints, "part": part, "at": "world", "axes": str(rng.choice(["joint", "world"]))}
        wrenches = np.stack([external.get(link, np.zeros(6)) for link in m.link_names])
        change = m.reactions(q, v, a, external, **options) - m.reactions(q, v, a, **options)
        found = np.einsum("jclk,lk->jc", m.reactions_external_derivatives(q, **options), wrenches)
        scale = max(1, np.abs(m.reactions(q, v, a, **options)).max(), np.abs(found).max())
        assert np.abs(change - found).max() <= 1e-12 * scale


@pytest.mark.parametrize("seed", [1, 3, 4])
def test_derivatives_of_forward_dynamics_by_parameters(seed):
    """−M⁻¹ Y, Y being the regressor at the accelerations found; with mimic joints, too."""
    m, rng, q, v, tau, _ = case(seed, heavy=True)
    condition = np.linalg.cond(m.mass_matrix(q))
    assert condition < 1e6
    Y = m.inverse_dynamics_regressor(q, v, m.forward_dynamics(q, v, tau))
    by_parameters = -np.einsum("ij,jlp->ilp", m.mass_matrix_inverse(q), Y)
    change = m.parameters * rng.uniform(-1, 1, (len(m.link_names), 1))  # which a body can have, too
    at = lambda s: m.with_parameters(dict(zip(m.link_names, m.parameters + s * change))).forward_dynamics(q, v, tau)
    difference = (at(STEP) - at(-STEP)) / (2 * STEP)
    assert np.abs(difference - np.einsum("ilp,lp->i", by_parameters, change)).max() <= 1e-5 * max(1, np.abs(difference).max())


def test_other_axes_are_refused():
    m, _, q, v, a, external = case(1)
    with pytest.raises(ValueError, match="external_axes='joint'; expected one of 'link', 'world'"):
        m.inverse_dynamics(q, v, a, external, external_axes="joint")
