"""Efforts of more drives than freedoms, by weights; and forward dynamics that corrects errors of loops."""

import pickle
from functools import partial

import ksl
import numpy as np
import pytest
from closed_mechanisms import KINDS
from closed_test import Motion, close_to, determined_case
from linkages import FOURBAR, link


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(2))
def test_efforts_with_the_least_weighted_sum_of_squares(kind, seed):
    """Of all efforts that balance: the solution of the dense equations by a pseudo-inverse."""
    x = Motion(kind, seed, determined_case)
    c, m = x.case, x.case.model
    rng = np.random.default_rng(seed)
    names = [j.name for j in m.joints if j.nv == 1]
    weights = dict(zip(names, 10 ** rng.uniform(-3, 3, len(names)), strict=True))
    weighted = m.with_drives(weights)
    assert weighted.drives == tuple(names) and weighted.drive_weights == tuple(weights.values())
    J = m.loop_jacobian(c.q)
    rank = m.mobility(c.q).rank
    G = np.linalg.svd(J)[2][rank:].T
    columns = [m.joint(name).v_index for name in names]
    if np.linalg.matrix_rank(G[columns], tol=1e-6) < G.shape[1]:
        pytest.skip("these joints don't move all")
    wanted = G.T @ m.without_loops().inverse_dynamics(c.q, x.v, x.a, x.external)
    for model, w in ((weighted, np.array(list(weights.values()))), (m.with_drives(names), np.ones(len(names)))):
        tau = model.inverse_dynamics(c.q, x.v, x.a, x.external)
        expected = np.linalg.pinv(G[columns].T / np.sqrt(w)) @ wanted / np.sqrt(w)
        close_to(tau[columns], expected, 1e-6)
        close_to(G.T @ tau, wanted, 1e-9)
        assert not np.delete(tau, columns).any()


def spinning_rod(seed, drives, slender=False, upper="spherical", beside=0.0):
    """Crank, rod between two balls, rocker; a plate on a second hinge of the crank.  The rod spins about itself, whatever the others do.  And a closed position.

    upper: the joint at the crank's end.  beside: how far the rod's mass is off its line.
    """
    rng = np.random.default_rng(seed)
    axis, ball = rng.normal(size=3), rng.normal(size=3)
    b = ksl.Builder("spinning rod").add_link("ground")
    for name in ("crank", "rocker", "plate"):
        b.add_link(name, mass=1.0, center_of_mass=rng.normal(size=3), inertia=np.eye(3))
    along = np.outer(ball, ball) / (ball @ ball)
    b.add_link("rod", mass=1.0, center_of_mass=ball / 2 + beside * np.cross(axis, ball), inertia=0.1 * (np.eye(3) - along if slender else np.eye(3)))
    axes = {"axis": np.cross(axis, ball), "axis2": np.cross(np.cross(axis, ball), ball)} if upper == "universal" else {}
    b.add_joint("A", "revolute", "ground", "crank", axis=axis).add_joint("B", upper, "crank", "rod", xyz=rng.normal(size=3), **axes)
    b.add_joint("D", "revolute", "ground", "rocker", axis=rng.normal(size=3), xyz=(3, 0, 0)).add_joint("F", "revolute", "ground", "plate", axis=axis)
    m = b.add_loop("weld", "fixed", "crank", "plate").build()
    q = m.neutral()
    for name, x in zip("AD", rng.uniform(-1, 1, 2), strict=True):
        q[m.joint(name).q_index] = x
    q[m.joint("F").q_index] = q[m.joint("A").q_index]
    on_rod, on_rocker = np.eye(4), np.eye(4)
    on_rod[:3, 3], on_rocker[:3, 3] = ball, (np.linalg.inv(m.frame_pose(q, "rocker")) @ m.frame_pose(q, "rod") @ [*ball, 1])[:3]
    m = b.add_loop("C", "spherical", "rod", "rocker", on_rod, on_rocker).build(drives=drives)
    assert m.mobility(q).mobility == 2 - (upper == "universal") and np.abs(m.loop_error(q)).max() < 1e-12
    return m, q


def refused(call, states, match):
    """One state, and three."""
    for given, where in ((states, ""), ([np.tile(x, (3, 1)) for x in states], "state 0: ")):
        with pytest.raises(ksl.ResultError, match=where + match):
            call(*given)


@pytest.mark.parametrize("seed", range(8))
def test_drives_that_are_many_and_leave_a_freedom(seed):
    """What they move of the spin is rounding.  Of a rod whose mass is to one side of its line it is a freedom like others; that of an even rod needs no effort unless something turns it."""
    m, q = spinning_rod(seed, ["A", "D", "F"], beside=0.1)
    for call in (m.inverse_dynamics, m.reactions, m.effort_parts):
        refused(
            call,
            (q, np.zeros(m.nv), np.zeros(m.nv)),
            "the drives leave a freedom, that of joint .*; link rod turns alone about a line of its own, and needs no drive if its mass is the same all round it",
        )
    m, q = spinning_rod(seed, ["A", "D", "F"])
    v = m.consistent_velocity(q, np.ones(m.nv), given=["A"])
    for call in (m.inverse_dynamics, m.reactions, m.effort_parts):
        refused(lambda *x: call(*x, {"rod": np.broadcast_to([0, 0, 0, 0.1, 0.2, 0.3], (*x[0].shape[:-1], 6))}), (q, v, m.forward_dynamics(q, v, 0 * v)),
                "the drives leave a freedom: link rod turns idly about its own line, by joint B, and this motion needs .* N m there")  # fmt: skip
    tau = m.joint("A").v_index == np.arange(m.nv)
    a, single = m.forward_dynamics(q, v, tau), m.with_drives(["A"])
    close_to(single.inverse_dynamics(q, v, a), tau, 1e-9)
    for call, state in (
        (m.gravity_torque_regressor, (q,)),
        (single.inverse_dynamics_derivatives, (q, v, a)),
        (partial(single.reactions_derivatives, joints=["C"]), (q, v, a)),
    ):
        with pytest.raises(ksl.ResultError, match="link rod turns idly about its own line, by joint B; a universal joint"):
            call(*state)


@pytest.mark.parametrize("drives", [["A"], ["A", "D", "F"]])
@pytest.mark.parametrize("seed", range(3))
def test_an_idle_rod_is_that_of_a_universal_joint(seed, drives):
    """Of a rod without inertia about its line it makes no difference which turns it: efforts, forces and accelerations are those of a universal joint in place of a ball."""
    rng, results = np.random.default_rng(seed), []
    motion = rng.normal(size=2)
    for upper in ("spherical", "universal"):
        m, q = spinning_rod(seed, drives, slender=True, upper=upper)
        v, a = np.zeros((2, m.nv))
        v[m.joint("A").v_index], a[m.joint("A").v_index] = motion
        v = m.consistent_velocity(q, v, given=["A"])
        a = m.consistent_acceleration(q, v, a, given=["A"])
        tau = m.inverse_dynamics(q, v, a)
        columns = [m.joint(name).v_index for name in "ADF"]
        assert np.array_equal(m.inverse_dynamics(*(np.stack([x] * 3) for x in (q, v, a))), np.stack([tau] * 3)) and not np.delete(tau, columns).any()
        close_to(tau @ v, m.without_loops().inverse_dynamics(q, v, a) @ v, 1e-9)
        moved = m.forward_dynamics(q, v, tau)
        jump = m.velocity_jump(q, {"crank": np.array([1.0, 2.0, 3.0, 0.3, 0.2, 0.1])})
        forces = m.reactions(q, v, a, joints=["C"])[0, :3]
        single = m.inverse_dynamics(*(x.astype(np.float32) for x in (q, v, a)))
        close_to(single, tau, 1e-3)
        results.append(
            np.concatenate(
                [tau[columns], moved[columns], jump[columns], forces, m.gravity_torque(q)[columns], m.bias(q, v)[columns] if len(drives) == 1 else []]
            )
        )
        close_to(moved, a, 1e-9)  # which had no spin
    close_to(results[0], results[1], 1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_a_mechanism_that_floats(seed):
    """Its floating joint has no motor.  Named among the drives it carries what the motion needs from outside: the efforts of the open tree there, and
    nothing where forward dynamics makes the motion, whatever the motors do."""
    c = determined_case("revolute", seed)
    rng = np.random.default_rng(seed)
    inside = list(c.drives)
    m = (
        ksl.Builder("space")
        .add_link("world")
        .add_link("craft", mass=3.0, inertia=np.eye(3))
        .add_joint("free", "floating", "world", "craft")
        .build()
        .with_gravity(c.model.gravity)
    )
    m = m.merged(c.model, "craft", prefix="").with_drives(inside)
    free = m.joint("free")
    q, v = m.random(rng), rng.normal(size=m.nv)
    for joint in c.model.joints:
        if joint.nv:
            q[m.joint(joint.name).q_index :][: joint.nq] = c.q[joint.q_index :][: joint.nq]
    given = ["free", *inside]
    v = m.consistent_velocity(q, v, given=given)
    a = m.consistent_acceleration(q, v, rng.normal(size=m.nv), given=given)
    for call in (m.inverse_dynamics, m.reactions):
        refused(call, (q, v, a), "the drives leave a freedom, that of joint free: .*, free among them, which then carries what the motion needs from outside")
    m = m.with_drives(given)
    columns = slice(free.v_index, free.v_index + 6)
    tau = m.inverse_dynamics(q, v, a)
    close_to(tau[columns], m.without_loops().inverse_dynamics(q, v, a)[columns], 1e-9)
    close_to(m.forward_dynamics(q, v, tau), a, 1e-8)
    tau[columns] = 0
    moved = m.forward_dynamics(q, v, tau)
    close_to(m.inverse_dynamics(q, v, moved), tau, 1e-8)
    close_to(m.reactions(q, v, moved, joints=["free"]), np.zeros((1, 6)), 1e-7)


def test_a_root_that_floats_among_drives():
    """The joint that the option adds can be named, and is the same as one of the file; a file that is written names the joints that it has."""
    text = FOURBAR.replace('<link name="frame"/>', link("frame", 2.0, 0.1))
    floating, names = ksl.load_string(text, floating_base=True), ["floating_base", "A"]
    m = ksl.load_string(text, floating_base=True, drives=names)
    assert m.drives == floating.with_drives(names).drives == pickle.loads(pickle.dumps(m)).drives == tuple(names)
    rng = np.random.default_rng(1)
    q = m.close(m.integrate(m.neutral(), rng.normal(size=m.nv)), hold=names).q
    v = m.consistent_velocity(q, rng.normal(size=m.nv), given=names)
    a = m.consistent_acceleration(q, v, rng.normal(size=m.nv), given=names)
    tau = m.inverse_dynamics(q, v, a)
    close_to(tau[:6], m.without_loops().inverse_dynamics(q, v, a)[:6], 1e-10)
    close_to(m.forward_dynamics(q, v, tau), a, 1e-9)
    refused(floating.with_drives(["A"]).inverse_dynamics, (q, v, a), "the drives leave a freedom, that of joint floating_base: .*, floating_base among them")
    assert ksl.load_string(m.to_urdf(), floating_base=True).drives == ("A",)
    assert m.with_frozen_joints({"floating_base": q[:7]}).drives == ("A",)
    with pytest.raises(ksl.DescriptionError, match="floating_base.: there is no such joint"):
        ksl.load_string(text, drives=names)


@pytest.mark.parametrize("kind", ["f4", "f8"])
@pytest.mark.parametrize("seed", range(8))
def test_a_freedom_whose_inertia_is_rounding_moves_no_mass(seed, kind):
    m, q = spinning_rod(seed, None, slender=True)  # without drives no rod is known to be idle
    zero = np.zeros(m.nv, kind)
    for call in (m.forward_dynamics, lambda q, *_: m.velocity_jump(q, {"rod": np.ones(6, kind)})):
        refused(call, (q.astype(kind), zero, zero), "joint . moves no mass in the closed mechanism at this position")
    thick, _ = spinning_rod(seed, ["A"])
    assert np.isfinite(thick.forward_dynamics(q.astype(kind), zero, zero)).all()


def test_weights_stay_with_their_drives():
    c = determined_case("revolute", 1)
    names = [j.name for j in c.model.joints if j.nv == 1]
    m = c.model.with_drives({name: k + 1.0 for k, name in enumerate(names)})
    assert pickle.loads(pickle.dumps(m)).drive_weights == m.drive_weights
    assert m.without_loops().drive_weights == () and m.with_gravity((0, 0, 0)).drive_weights == m.drive_weights
    frozen = m.with_frozen_joints({names[1]: float(c.q[m.joint(names[1]).q_index])})
    assert frozen.drives == (names[0], *names[2:]) and frozen.drive_weights == (1.0, *[k + 3.0 for k in range(len(names) - 2)])
    pair = m.merged(c.model, m.link_names[-1], prefix="x_")
    assert (
        len(pair.drive_weights) == len(pair.drives) and pair.drive_weights[: len(names)] == m.drive_weights and set(pair.drive_weights[len(names) :]) == {1.0}
    )
    for bad in (0.0, -1.0, np.inf):
        with pytest.raises(ksl.DescriptionError, match=f"drive .{names[0]}.: its weight is .*; a weight is positive and finite"):
            c.model.with_drives({names[0]: bad})
    with pytest.raises(ValueError, match="its weight"):
        c.model.with_drives({names[0]: "much"})


@pytest.mark.parametrize("kind", KINDS)
def test_errors_are_corrected_at_the_rate_that_is_asked_for(kind):
    """Of a slightly open state ë + 2 α ė + β² e = 0, with e the errors of the loops; of a closed one it changes nothing."""
    x = Motion(kind, 1, determined_case)
    c, m = x.case, x.case.model
    close_to(m.forward_dynamics(c.q, x.v, x.tau, x.external, stabilise=10.0), m.forward_dynamics(c.q, x.v, x.tau, x.external), 1e-8)
    if m.mobility(c.q).redundant:
        return  # errors of redundant equations can't be corrected each for itself
    rng = np.random.default_rng(1)
    q, v = m.integrate(c.q, 1e-4 * rng.normal(size=m.nv)), x.v + 1e-4 * rng.normal(size=m.nv)
    with pytest.raises(ksl.ResultError, match="loop joint L is open"):
        m.forward_dynamics(q, v, x.tau, x.external)
    for gains in (5.0, (3.0, 7.0)):
        alpha, beta = np.broadcast_to(gains, 2)
        a = m.forward_dynamics(q, v, x.tau, x.external, stabilise=gains)
        left = m.loop_acceleration(q, v, a) + 2 * alpha * m.loop_jacobian(q) @ v + beta**2 * m.loop_error(q)
        close_to(left, np.zeros(len(left)), 1e-9)
    held = m.forward_dynamics(np.stack([q, c.q]), np.stack([v, x.v]), x.tau, x.external, stabilise=5.0)
    close_to(held[0], m.forward_dynamics(q, v, x.tau, x.external, stabilise=5.0), 1e-12)


def test_errors_decay():
    """A mechanism that begins slightly open, integrated with small steps."""
    x = Motion("spherical", 1, determined_case)
    c, m = x.case, x.case.model
    q, v, step = m.integrate(c.q, 1e-4 * np.random.default_rng(2).normal(size=m.nv)), np.zeros(m.nv), 1e-3
    began, rest = np.linalg.norm(m.loop_error(q)), np.zeros(m.nv)
    for _ in range(300):  # the midpoint method
        half = v + step / 2 * m.forward_dynamics(q, v, rest, stabilise=30.0)
        a = m.forward_dynamics(m.integrate(q, step / 2 * v), half, rest, stabilise=30.0)
        q, v = m.integrate(q, step * half), v + step * a
    assert np.linalg.norm(m.loop_error(q)) < 0.02 * began


def test_bad_gains_and_large_errors_are_refused():
    x = Motion("spherical", 1, determined_case)
    c, m = x.case, x.case.model
    for gains in (-1.0, (1.0, np.nan), (1.0, 2.0, 3.0)):
        with pytest.raises(ValueError, match="stabilise=.*expected .α, β. in 1/s"):
            m.forward_dynamics(c.q, x.v, x.tau, stabilise=gains)
    with pytest.raises(ksl.ResultError, match="loop joint L is open .*close"):
        m.forward_dynamics(m.integrate(c.q, np.full(m.nv, 0.3)), x.v, x.tau, stabilise=1.0)
    with pytest.raises(ValueError, match="out= is for calls without stabilise="):
        m.forward_dynamics(c.q, x.v, x.tau, out=np.zeros(m.nv), stabilise=1.0)
    tree = m.without_loops()
    assert np.array_equal(tree.forward_dynamics(c.q, x.v, x.tau, stabilise=1.0), tree.forward_dynamics(c.q, x.v, x.tau))
