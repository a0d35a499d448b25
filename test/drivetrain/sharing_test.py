"""Motors that are more than the joints: efforts of least squares, and polytopes, against linear algebra, linear programmes and the engine's own weights."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import linprog

import ksl
from ksl.drivetrain.boxes import crossings, sides

EFFORT, SPEED = np.array([36.0, 20.0, 30.0]), np.array([10.0, 11.0, 12.0])
MOTORS = ["motor_a", "motor_b", "motor_c"]


@cache
def three_rods():
    """Pitch and roll hinges that cross, and three cranks with rods between balls."""
    at = lambda *x: np.vstack([np.column_stack([np.eye(3), x]), [0, 0, 0, 1]])
    b = ksl.Builder("three rods").add_link("ground").add_link("cross", mass=0.06, inertia=np.eye(3) * 1e-5)
    b.add_link("foot", mass=0.9, center_of_mass=(0.03, 0, -0.03), inertia=np.diag([1e-3, 3e-3, 4e-3]))
    b.add_joint("pitch", "revolute", "ground", "cross", xyz=(0, 0, -0.3), axis=(0, 1, 0), limits=(-0.5, 0.5)).add_joint(
        "roll", "revolute", "cross", "foot", axis=(1, 0, 0), limits=(-0.4, 0.4)
    )
    for motor, x, y, long, effort, velocity in zip(MOTORS, (-0.05, -0.05, 0.06), (0.04, -0.04, 0.01), (0.2, 0.17, 0.14), EFFORT, SPEED):
        crank, rod, out = f"{motor}_crank", f"{motor}_rod", 0.05 * np.sign(x)
        b.add_link(crank, mass=0.08, center_of_mass=(out / 2, 0, 0), inertia=np.eye(3) * 3e-5).add_link(
            rod, mass=0.06, center_of_mass=(0, 0, -long / 2), inertia=np.diag([3e-4, 3e-4, 4e-6])
        )
        b.add_joint(motor, "revolute", "ground", crank, xyz=(x - out, y, long - 0.3), axis=(0, 1, 0), limits=(-1.2, 1.2), effort=effort, velocity=velocity)
        b.add_joint(f"{motor}_top", "spherical", crank, rod, xyz=(out, 0, 0)).add_loop(f"{motor}_foot", "spherical", rod, "foot", at(0, 0, -long), at(x, y, 0))
    return b.build(drives=MOTORS)


@cache
def shared():
    return three_rods().actuation(["pitch", "roll"], sharing="limits")


def test_efforts_of_least_squares():
    """Of all efforts that hold, by a pseudo-inverse; in motion those of the engine, with these weights; and what is dual to them."""
    m, a, rng = three_rods(), shared(), np.random.default_rng(0)
    q = rng.uniform(-0.3, 0.3, (4, 2))
    v, acc, tau = rng.normal(size=(3, 4, 2))
    W, J, motors = a.motor_jacobian(q), a.jacobian(q), a.static_motor_efforts(q, tau)
    assert_allclose(motors, [np.linalg.pinv(w.T * EFFORT) @ x * EFFORT for w, x in zip(W, tau)], rtol=1e-9)
    assert_allclose(a.static_joint_efforts(q, motors), tau, rtol=1e-10)
    assert_allclose(J @ W, np.broadcast_to(np.eye(2), (4, 2, 2)), atol=1e-12)
    h = 1e-6
    assert_allclose(a.jacobian_rate(q, v), (a.jacobian(q + h * v) - a.jacobian(q - h * v)) / (2 * h), atol=1e-7)
    assert_allclose(a.joint_velocities(q, a.motor_velocities(q, v)), v, rtol=1e-10)
    assert_allclose(a.joint_accelerations(q, v, a.motor_accelerations(q, v, acc)), acc, rtol=1e-9)
    weighted = m.with_drives(dict(zip(MOTORS, EFFORT**-2.0)))
    Q, V, A = a.state(q, v, acc)
    wanted = weighted.inverse_dynamics(Q, V, A)[:, [m.joint(name).v_index for name in MOTORS]]
    assert_allclose(a.motor_efforts(q, v, acc), wanted, rtol=1e-9, atol=1e-12)
    assert_allclose(weighted.actuation(["pitch", "roll"], sharing="weights").motor_efforts(q, v, acc), wanted, rtol=1e-9, atol=1e-12)
    forces = weighted.reactions(Q, V, A, joints=list(a.loops))[..., :3]
    assert_allclose(np.linalg.norm(forces, axis=2), a.loop_forces(q, v, acc), rtol=1e-9)


def test_positions_of_motors_that_contradict_each_other():
    a = shared()
    q = np.random.default_rng(1).uniform(-0.3, 0.3, (12, 2))
    theta = a.motors_of(q)
    assert_allclose(a.joints_of(theta), q, atol=1e-10)
    theta[3, 2] += 1e-4
    with pytest.raises(ValueError, match="q_motors of state 3: motor_a, motor_b, motor_c = .* contradict each other"):
        a.joints_of(theta)
    assert np.isnan(a.joints_of(theta, unreachable="nan")).any(axis=1).tolist() == [k == 3 for k in range(12)]


def largest(G, limits, direction):
    """How far along a direction joints get by motors within ± limits, whose columns are G (joints, motors)."""
    n = len(limits)
    best = linprog([0.0] * n + [-1.0], A_eq=np.column_stack([G, -direction]), b_eq=np.zeros(len(G)), bounds=[(-x, x) for x in limits] + [(None, None)])
    return -best.fun


@pytest.mark.parametrize(("joints", "motors"), [(1, 3), (2, 4), (3, 5)])
def test_polytopes_are_what_linear_programmes_reach(joints, motors):
    rng = np.random.default_rng(motors)
    G, limits = rng.normal(size=(1, joints, motors)), rng.uniform(1, 3, motors)
    rows, ones = sides(G, limits)
    points = crossings(G.swapaxes(1, 2), limits)[0]
    for u in rng.normal(size=(4, joints)):
        assert_allclose((ones / np.abs(rows[0] @ u)).min(), largest(G[0], limits, u), rtol=1e-9)
        best = linprog(-u, A_ub=np.vstack([G[0].T, -G[0].T]), b_ub=np.tile(limits, 2), bounds=(None, None))
        assert_allclose((points @ u).max(), -best.fun, rtol=1e-9)


def test_boxes_and_what_is_left_for_one_joint():
    """Corners of the box of efforts are reached by some sharing, and a larger box's aren't."""
    a = shared()
    for q in ([0.2, -0.1], [-0.3, 0.2]):
        W, half, alone = a.motor_jacobian(q), a.effort_box(q)[:, 1], a.effort_alone(q)
        reach = [largest(W.T, EFFORT, half * s) for s in ([1, 1], [1, -1])]
        assert_allclose(min(reach), 1, rtol=1e-9)
        assert_allclose(alone, [largest(W.T, EFFORT, e) for e in np.eye(2)], rtol=1e-9)
        assert_allclose(a.velocity_alone(q), (SPEED[:, None] / np.abs(W)).min(axis=0))
        vertices = a.effort_polytope(q)
        assert_allclose(vertices[:, 0].max(), np.abs(W[:, 0]) @ EFFORT)
    assert a.range("pitch").upper_by == "limit"


def test_positions_that_are_used_hold_as_at_the_start():
    """The root of the determinant of Wᵀ W, to a tenth of that at the start, and ten times as much."""
    a = shared()
    W, start = a.motor_jacobian(a.usable(40, seed=2)), a.motor_jacobian([0, 0])
    sizes = np.sqrt(np.linalg.det(W.swapaxes(1, 2) @ W) / np.linalg.det(start.T @ start))
    assert_allclose(a.holding(W) / a.holding(start), sizes, rtol=1e-12)
    assert len(W) > 20 and (0.1 < sizes).all() and (sizes < 10).all()


def test_a_third_motor_holds_where_two_hold_nothing():
    two = three_rods().with_drives(MOTORS[:2]).actuation(["pitch", "roll"]).range("roll", limits=False)
    three = shared().range("roll", limits=False)
    assert (two.lower_by, three.lower_by) == ("hold", "reach") and three.lower < two.lower - 0.1


def test_sharing_among_as_many_motors_as_joints_is_none():
    m = three_rods().with_drives(MOTORS[:2])
    a, b = m.actuation(["pitch", "roll"], sharing="limits"), m.actuation(["pitch", "roll"])
    q, v, acc = np.random.default_rng(5).uniform(-0.2, 0.2, (3, 4, 2))
    for call in (lambda x: x.motor_efforts(q, v, acc), lambda x: x.jacobian(q), lambda x: x.jacobian_rate(q, v), lambda x: x.joints_of(x.motors_of(q))):
        assert_allclose(call(a), call(b), rtol=1e-9, atol=1e-11)


def test_sharing_that_is_none():
    m = three_rods()
    for sharing, said in ((None, "3 motors of 2 freedoms.*, or with sharing= how"), ("equal", "sharing='equal'; expected one of 'limits', 'weights'")):
        with pytest.raises(ValueError, match=said):
            m.actuation(["pitch", "roll"], sharing=sharing)
    for call in (shared().c_code, shared().compile):
        with pytest.raises(ValueError, match="are more motors than joints, which code doesn't have"):
            call()
