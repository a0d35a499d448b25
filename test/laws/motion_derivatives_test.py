"""Derivatives of motions, energies and momentum on random trees, against differences of the algorithms themselves; derivatives by
external wrenches and by parameters; wrenches that are given, and held, in the world's axes."""

import numpy as np
import pytest

from derivatives_test import STEP, case, close, differences

TREES = range(16)


def expressed(rng) -> dict[str, str]:
    return {"axes": str(rng.choice(["frame", "world"])), "at": str(rng.choice(["frame", "world"])), "order": str(rng.choice(["lin_ang", "ang_lin"]))}


def without_third(found) -> tuple:
    """The same with zeros: derivatives by what the result doesn't depend on."""
    return (*found, np.zeros_like(found[0]))


@pytest.mark.parametrize("seed", TREES)
def test_frames(seed):
    """In every axes and of every kind; by a, and by v of the velocity, they are the Jacobian."""
    m, rng, q, v, a, _ = case(seed)
    names = [str(name) for name in rng.choice(m.link_names, 3)]
    if not m.nv:
        return
    for kind in ("spatial", "classical", "rate"):
        options = expressed(rng)
        found = m.frame_velocities_derivatives(q, v, names, **options)
        close(without_third(found), differences(m, lambda q, v, _: m.frame_velocities(q, v, names, **options), q, v, a), 1e-9)
        J = np.stack([m.jacobian(q, name, **options) for name in names])
        assert np.abs(found[1] - J).max() <= 1e-13 * max(1, np.abs(J).max())
        found = m.frame_accelerations_derivatives(q, v, a, names, kind=kind, **options)
        close(found, differences(m, lambda *at: m.frame_accelerations(*at, names, kind=kind, **options), q, v, a), 1e-9)
        options["offset"] = rng.normal(size=3)
        close(
            without_third(m.frame_velocity_derivatives(q, v, names[0], **options)),
            differences(m, lambda q, v, _: m.frame_velocity(q, v, names[0], **options), q, v, a),
            1e-9,
        )
        close(
            m.frame_acceleration_derivatives(q, v, a, names[0], kind=kind, **options),
            differences(m, lambda *at: m.frame_acceleration(*at, names[0], kind=kind, **options), q, v, a),
            1e-9,
        )


@pytest.mark.parametrize("seed", TREES)
def test_momentum_and_energy(seed):
    m, _, q, v, a, _ = case(seed)
    if not m.nv:
        return
    found = m.centroidal_momentum_derivatives(q, v)
    close(without_third(found), differences(m, lambda q, v, _: m.centroidal_momentum(q, v), q, v, a), 1e-9)
    A = m.centroidal_momentum_matrix(q)
    assert np.abs(found[1] - A).max() <= 1e-13 * max(1, np.abs(A).max())
    close(m.centroidal_momentum_rate_derivatives(q, v, a), differences(m, m.centroidal_momentum_rate, q, v, a), 1e-9)
    by_q, by_v, potential = m.energy_derivatives(q, v)
    energies = differences(m, lambda q, v, _: np.stack(m.energy(q, v), axis=-1), q, v, a)
    close(without_third([np.stack([by_q, potential]), np.stack([by_v, 0 * by_v])]), energies, 1e-9)
    scale = max(1, np.abs(by_v).max(), np.abs(potential).max())
    assert np.abs(by_v - m.mass_matrix(q) @ v).max() <= 1e-13 * scale * m.nv
    assert np.abs(potential - m.gravity_torque(q)).max() <= 1e-13 * scale * m.nv


def test_poses():
    """In the axes and about the points that docs/derivatives.md names."""
    m, rng, q, *_ = case(4)
    name = m.link_names[-1]
    D, step = m.frame_pose(q, name), 1e-5
    for k in range(m.nv):
        dq = step * np.eye(m.nv)[k]
        change = (m.frame_pose(m.integrate(q, dq), name) - m.frame_pose(m.integrate(q, -dq), name)) / (2 * step)
        for X, axes, at in ((np.linalg.inv(D) @ change, "frame", "frame"), (change @ np.linalg.inv(D), "world", "world")):
            twist = np.array([*X[:3, 3], X[2, 1], X[0, 2], X[1, 0]])
            assert np.abs(twist - m.jacobian(q, name, axes=axes, at=at)[:, k]).max() < 1e-8
        assert np.abs(change[:3, 3] - m.jacobian(q, name, axes="world", at="frame")[:3, k]).max() < 1e-8


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


@pytest.mark.parametrize("seed", [2, 6])
def test_single_precision(seed):
    m, _, q, v, a, external = case(seed)
    names = m.link_names[-2:]
    calls = [
        lambda q, v, a: m.frame_velocities_derivatives(q, v, names),
        lambda q, v, a: m.frame_accelerations_derivatives(q, v, a, names, axes="world"),
        lambda q, v, a: m.centroidal_momentum_derivatives(q, v),
        lambda q, v, a: m.centroidal_momentum_rate_derivatives(q, v, a),
        lambda q, v, a: m.energy_derivatives(q, v),
        lambda q, v, a: (m.reactions_external_derivatives(q),),
    ]
    q, v, a = (x.astype(np.float32) for x in (q, v, a))
    for call in calls:
        for found, expected in zip(call(q, v, a), call(*(x.astype(float) for x in (q, v, a)))):
            assert found.dtype == np.float32
            assert np.abs(found - expected).max() <= 1e-5 * max(1, np.abs(expected).max())
