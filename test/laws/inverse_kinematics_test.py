"""Inverse kinematics: forward kinematics of what was found, for an arm and for random trees."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from random_tree import load_text, random_states, random_tree


def errors(found: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """(…, 2): distance of positions, and the angle between orientations."""
    R = np.swapaxes(found[..., :3, :3], -1, -2) @ wanted[..., :3, :3]
    cosine = np.clip((np.trace(R, axis1=-2, axis2=-1) - 1) / 2, -1, 1)
    sine = np.linalg.norm(R - np.swapaxes(R, -1, -2), axis=(-2, -1)) / np.sqrt(8)
    angle = np.arctan2(sine, cosine)
    return np.stack([np.linalg.norm(found[..., :3, 3] - wanted[..., :3, 3], axis=-1), angle], axis=-1)


@pytest.fixture(scope="module")
def arm(examples):
    import ksl

    return ksl.load(examples / "robots/ur5.urdf")


def reachable(m, name: str, n: int, seed: int = 1):
    q = np.random.default_rng(seed).uniform(-np.pi, np.pi, (n, m.nq))
    return q, m.frame_pose(q, name)


def test_an_arm_reaches_random_poses(arm):
    _, target = reachable(arm, "tool0", 10_000)
    r = arm.inverse_kinematics("tool0", target)
    assert r.converged.mean() >= 0.995 and r.starts.max() <= 5
    found = errors(arm.frame_pose(r.q, "tool0"), target)
    assert (found[r.converged] < 1.01e-6).all() and np.abs(found - r.error).max() < 1e-9
    assert (np.abs(r.q) <= 2 * np.pi).all() and set(r.reason[r.converged]) == {"converged"}
    assert set(r.reason[~r.converged]) <= {"iterations", "limits", "stuck"}


def test_results_depend_on_nothing_but_the_target_its_index_and_the_seed(arm):
    q, target = reachable(arm, "tool0", 700)
    whole = arm.inverse_kinematics("tool0", target)
    for threads in (1, 3):
        assert np.array_equal(arm.inverse_kinematics("tool0", target, threads=threads).q, whole.q)
    for n in (0, 1, 5, 33):
        assert np.array_equal(arm.inverse_kinematics("tool0", target[:n]).q, whole.q[:n])
    others = target[::-1].copy()
    others[350] = target[350]
    assert np.array_equal(arm.inverse_kinematics("tool0", others).q[350], whole.q[350])
    several = arm.inverse_kinematics("tool0", np.broadcast_to(target[0], (50, 4, 4)))
    assert len(np.unique(several.q[several.converged].round(3), axis=0)) > 10
    grid = arm.inverse_kinematics("tool0", target.reshape(70, 10, 4, 4))
    assert np.array_equal(grid.q, whole.q.reshape(70, 10, 6)) and grid.converged.shape == (70, 10) and grid.error.shape == (70, 10, 2)
    other = arm.inverse_kinematics("tool0", target, seed=1)
    assert not np.array_equal(other.q, whole.q) and other.converged.mean() > 0.99
    assert not np.array_equal(arm.inverse_kinematics("tool0", target, q0=q).q, whole.q)


@pytest.mark.parametrize("scale", [2.0**-1000, 1e-8, 8.0, 1e160])
def test_ratios_of_weights_count_alone(arm, scale):
    _, target = reachable(arm, "tool0", 200)
    for dtype, tolerance in ((np.float64, 1e-6), (np.float32, 1e-4)):
        as_they_are, scaled = (arm.inverse_kinematics("tool0", target.astype(dtype), weights=w, tolerance=tolerance) for w in ((1.0, 0.5), (scale, scale / 2)))
        assert as_they_are.converged.mean() > 0.95 and abs(scaled.converged.mean() - as_they_are.converged.mean()) < 0.03
        if np.frexp(scale)[0] == 0.5:  # a power of two
            assert np.array_equal(scaled.q, as_they_are.q)


def test_a_warm_start_stays_near(arm):
    q, target = reachable(arm, "tool0", 300)
    near = q + np.random.default_rng(2).normal(size=q.shape) * 1e-3
    r = arm.inverse_kinematics("tool0", target, q0=near)
    smallest = np.linalg.svd(arm.jacobian(q, "tool0"), compute_uv=False)[:, -1]
    regular = smallest > 0.05
    assert r.converged.all() and (r.iterations[regular] <= 4).all() and np.abs(r.q - q)[regular].max() < 0.01
    assert (arm.inverse_kinematics("tool0", target, q0=q).iterations == 0).all()
    starts = arm.inverse_kinematics("tool0", target[0], q0=near[:20])  # one target from several starts
    assert starts.q.shape == (20, 6)


def test_limits_hold_and_are_said(examples):
    import ksl

    m = ksl.load(examples / "robots/panda.urdf")
    lower, upper = (np.array([getattr(m.joint(n), side) for n in m.joint_names]) for side in ("lower", "upper"))
    q = np.random.default_rng(3).uniform(lower, upper, (300, m.nq))
    r = m.inverse_kinematics("panda_flange", m.frame_pose(q, "panda_flange"), starts=10)
    assert r.converged.mean() > 0.98 and (r.q[:, :7] >= lower[:7]).all() and (r.q[:, :7] <= upper[:7]).all()
    beyond = q.copy()
    beyond[:, 3] = 0.8  # the elbow bends the other way: its upper limit is below zero
    target = m.frame_pose(beyond, "panda_flange")
    free = m.inverse_kinematics("panda_flange", target, q0=beyond, limits=False)
    assert free.converged.all() and (free.q[:, 3] > upper[3]).any()


def test_what_is_out_of_reach_is_said(arm):
    far = np.eye(4)
    far[:3, 3] = 5.0, 0.0, 0.0
    r = arm.inverse_kinematics("tool0", far)
    assert not r.converged and r.reason in ("stuck", "limits") and r.starts == 5 and 3.5 < r.error[0] < 5
    few = arm.inverse_kinematics("tool0", reachable(arm, "tool0", 1)[1][0], iterations=2, starts=1)
    assert few.reason == "iterations" and few.iterations == 2


def test_weights_leave_what_does_not_count(arm):
    _, target = reachable(arm, "tool0", 200)
    position = arm.inverse_kinematics("tool0", target, weights=(1, 0))
    assert position.converged.all() and np.abs(arm.frame_pose(position.q, "tool0") - target)[..., :3, 3].max() < 1e-6
    orientation = arm.inverse_kinematics("tool0", target, weights=(0, 1))
    assert orientation.converged.all() and errors(arm.frame_pose(orientation.q, "tool0"), target)[:, 1].max() < 1.01e-6
    assert errors(arm.frame_pose(orientation.q, "tool0"), target)[:, 0].min() > 1e-3


def test_float_reaches_its_own_tolerance(arm):
    _, target = reachable(arm, "tool0", 500)
    r = arm.inverse_kinematics("tool0", target.astype(np.float32), tolerance=(2e-5, 5e-5))
    assert r.q.dtype == np.float32 and r.converged.mean() > 0.97
    assert errors(arm.frame_pose(r.q.astype(float), "tool0"), target)[r.converged].max() < 1e-4


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(3, 12), st.booleans())
def test_several_frames_of_trees_with_every_kind_of_joint(seed, bodies, floating):
    rng = np.random.default_rng(seed)
    m = load_text(random_tree(rng, bodies), floating_base=floating)
    names = [str(n) for n in rng.choice(m.link_names, 2, replace=False)]
    q, _, _ = random_states(m, rng, 3)
    target = m.frame_poses(q, names)
    near = q.copy()
    for j in m.joints:
        if j.nv and j.quaternion is None:
            near[:, j.q_index : j.q_index + j.nq] += rng.normal(size=(3, j.nq)) * 1e-3
    r = m.inverse_kinematics(names, target, q0=near)
    assert r.converged.all(), (r.reason, r.error)
    assert errors(m.frame_poses(r.q, names), target).max() < 1.01e-6


def test_bad_input_is_said(arm):
    target = np.eye(4)
    for arguments, sentence in (
        ((("absent",), target[None]), "absent"),
        ((("tool0"), np.eye(3)), r"target has shape \(3, 3\); expected \(…, 4, 4\)"),
        ((("tool0"), 2 * target), "target 0 is not a pose"),
        ((("tool0"), np.full((4, 4), np.nan)), "target 0 is not a pose"),
        (((), target), "names is empty"),
        ((("tool0"), target, np.zeros(5)), r"q0 has shape \(5,\); expected \(…, 6\)"),
        ((("tool0"), target, np.full(6, np.inf)), "q0 has numbers that are not finite"),
        ((("tool0"), target, None, -1), "weight of tool0: -1"),
    ):
        with pytest.raises(ValueError, match=sentence):
            arm.inverse_kinematics(*arguments)
    with pytest.raises(ValueError, match="tolerance=0"):
        arm.inverse_kinematics("tool0", target, tolerance=0)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0, 0.8), (1, -2, 3)])
def test_a_start_half_a_turn_away(axis, dtype):
    """Where R − Rᵀ of the error is zero."""
    import ksl

    m = (
        ksl.Builder("wheel")
        .add_link("ground")
        .add_link("disc", 1.0, (0, 0, 0), np.eye(3))
        .add_joint("hinge", "continuous", "ground", "disc", axis=axis)
        .build()
    )
    q0 = np.array([0.3], dtype)
    target = m.frame_pose(np.array([0.3 + np.pi]), "disc").astype(dtype)
    for start in (q0, q0 + dtype(1e-3), q0 - dtype(1e-6)):
        found = m.inverse_kinematics("disc", target, start, starts=1, tolerance=1e-6 if dtype is np.float64 else 1e-4)
        assert found.converged and np.abs(m.frame_pose(found.q, "disc") - target).max() < (2e-6 if dtype is np.float64 else 2e-4)
