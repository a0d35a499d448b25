"""Mechanisms as graphs of bodies and joints: frames anywhere on both bodies, joints in both directions, frames of single precision."""

import numpy as np
import pytest
from growth import assert_linear, work

import ksl
from ksl.robot_files.assembly import SINGLE, Body, Connection, _Directions, assembled, gap, in_double
from ksl.mechanism.joint_kinds import KINDS
from ksl.robot_files.mjcf_frames import pose

OF_KINDS = ["fixed", "revolute", "continuous", "prismatic", "cylindrical", "spherical", "translation"]


def random_pose(rng):
    X = pose(rng.normal(size=4), np.zeros(3))
    X[:3, 3] = rng.normal(size=3)
    return X


def random_axis(rng, kind):
    a = rng.normal(size=3)
    return a / np.linalg.norm(a) if KINDS[kind].has_axis else None


def motion(kind, axis, q):
    """The pose of a joint's frame on its second body in that on the first one."""
    b = ksl.Builder("one").add_link("w").add_link("c", 1.0, (0, 0, 0), np.eye(3))
    b.add_joint("j", kind, "w", "c", axis=axis)
    return b.build(masses="optional").frame_pose(q, "link:c")


def body(name, X):
    return Body(name, X, 2.0, np.array([0.1, 0.2, 0.3]), np.diag([0.3, 0.4, 0.5]))


def joined(rng, kind, at_second=None):
    """Two bodies, the first one floating, and a joint between frames anywhere on them."""
    c = Connection("j", kind, 0, 1, random_pose(rng), random_pose(rng) if at_second is None else at_second, random_axis(rng, kind))
    return [body("a", random_pose(rng)), body("b", random_pose(rng))], c


@pytest.mark.parametrize("kind", OF_KINDS)
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("place", ["anywhere", "at the body's origin", "the body's frame"])
def test_the_second_body_stands_where_the_joint_has_it(kind, turned, place):
    rng = np.random.default_rng(OF_KINDS.index(kind))
    at_second = {"anywhere": random_pose(rng), "at the body's origin": pose(rng.normal(size=4), np.zeros(3)), "the body's frame": np.eye(4)}[place]
    bodies, c = joined(rng, kind, at_second)
    if turned:  # the first body is on the ground's side of the tree, and is the joint's second
        c = Connection("j", kind, 1, 0, c.at_first, c.at_second, c.axis)
        bodies.append(body("held", np.eye(4)))
        c2 = Connection("base", "fixed", None, 0, np.eye(4), np.eye(4))
        made = ksl.Builder("two")
        found = assembled(made, bodies[:2], [c2, c], cut=False)
        assert found.turned == ["j"] and found.floating == []
    else:
        made = ksl.Builder("two")
        found = assembled(made, bodies, [c], cut=False)
        assert found.turned == [] and found.floating == ["floating_base"]
    m = made.build(masses="optional")
    q = m.neutral()
    if kind != "fixed":
        j = m.joint("j")
        own = rng.normal(size=j.nq)
        q[j.q_index : j.q_index + j.nq] = own / np.linalg.norm(own) if j.quaternion is not None else own
        given = q[j.q_index : j.q_index + j.nq].copy()
    else:
        given = np.zeros(0)
    if turned and kind == "spherical":
        given[:3] *= -1  # the inverse, as the reader says
    if turned and kind == "translation":
        given *= -1
    first, second = ("b", "a") if turned else ("a", "b")
    poses = m.frame_poses(q, [f"link:{first}", f"link:{second}"])
    expected = c.at_first @ motion(kind, c.axis, given) @ np.linalg.inv(c.at_second)
    np.testing.assert_allclose(np.linalg.solve(poses[0], poses[1]), expected, atol=1e-12)
    bodies[0 if first == "a" else 1].pose, bodies[1 if second == "b" else 0].pose = poses
    assert max(gap(c, bodies)) < 1e-12


def test_a_gap_is_what_the_joint_does_not_allow():
    rng = np.random.default_rng(3)
    for kind in OF_KINDS:
        bodies, c = joined(rng, kind)
        q = rng.normal(size=KINDS[kind].nq)
        q = q / np.linalg.norm(q) if kind == "spherical" else q
        bodies[1].pose = bodies[0].pose @ c.at_first @ motion(kind, c.axis, q) @ np.linalg.inv(c.at_second)
        assert max(gap(c, bodies)) < 1e-12, kind
        here = bodies[0].pose @ c.at_first
        across = np.cross(c.axis, [0.3, 0.5, 0.7]) if c.axis is not None else np.array([1.0, 0, 0])
        across *= 0.01 / np.linalg.norm(across)
        moved = np.eye(4)
        moved[:3, 3] = here[:3, :3] @ across
        whole = bodies[1].pose
        bodies[1].pose = moved @ whole
        shift, turn = gap(c, bodies)
        assert shift == pytest.approx(0.0 if kind == "translation" else 0.01, abs=1e-12) and turn < 1e-12, kind
        tilt = pose(np.array([np.cos(0.005), *(np.sin(0.005) * (here[:3, :3] @ (across / 0.01)))]), np.zeros(3))
        at = np.eye(4)
        at[:3, 3] = (whole @ c.at_second)[:3, 3]
        bodies[1].pose = at @ tilt @ np.linalg.inv(at) @ whole
        shift, turn = gap(c, bodies)
        assert turn == pytest.approx(0.0 if kind == "spherical" else 0.01, rel=1e-3, abs=1e-12) and shift < 1e-12, kind


def single(X):
    """Rounded as a file of single precision has it: a translation and a quaternion."""
    from ksl.base.rotations import quaternion_of

    x, y, z, w = quaternion_of(X[:3, :3]).astype(np.float32).astype(float)
    made = pose(np.array([w, x, y, z]), np.zeros(3))
    made[:3, 3] = X[:3, 3].astype(np.float32)
    return made


@pytest.mark.parametrize("kind", OF_KINDS)
def test_frames_of_single_precision_are_completed(kind):
    rng = np.random.default_rng(11)
    bodies, c = joined(rng, kind)
    q = rng.normal(size=KINDS[kind].nq)
    q = q / np.linalg.norm(q) if kind == "spherical" else q
    bodies[1].pose = bodies[0].pose @ c.at_first @ motion(kind, c.axis, q) @ np.linalg.inv(c.at_second)
    c.at_first, c.at_second = single(c.at_first), single(c.at_second)
    exact = c.at_first.copy(), c.at_second.copy()
    assert max(gap(c, bodies)) > 1e-9
    in_double(bodies, [c])
    assert max(gap(c, bodies)) < 1e-14
    for at, was in zip((c.at_first, c.at_second), exact):
        assert np.abs(at - was).max() < 1e-6 and np.abs(at[:3, :3] @ at[:3, :3].T - np.eye(3)).max() < 1e-14


def test_axes_that_are_parallel_become_so_exactly_and_others_stay():
    rng = np.random.default_rng(2)
    up = np.array([0.3, 0.5, 0.8]) / np.linalg.norm([0.3, 0.5, 0.8])
    bodies = [body(f"b{k}", random_pose(rng)) for k in range(4)]
    connections = []
    for k, sign in enumerate((1.0, -1.0, 1.0)):
        at = random_pose(rng)
        connections.append(
            Connection(
                f"j{k}",
                "revolute",
                k,
                k + 1,
                single(np.linalg.inv(bodies[k].pose) @ at),
                single(np.linalg.inv(bodies[k + 1].pose) @ at),
                sign * at[:3, :3].T @ up,
            )
        )
    other = connections[1]
    other.axis = other.axis + np.array([0.0, 1e-4, 0.0])
    other.axis /= np.linalg.norm(other.axis)
    in_double(bodies, connections)
    axes = [bodies[i].pose[:3, :3] @ at[:3, :3] @ c.axis for c in connections for i, at in ((c.first, c.at_first), (c.second, c.at_second))]
    for k in (1, 4, 5):
        assert np.abs(axes[k] - axes[0]).max() < 1e-15
    assert np.abs(axes[2] - axes[3]).max() < 1e-15 and 1e-5 < np.abs(axes[2] + axes[0]).max() < 1e-3


def test_frames_that_contradict_the_bodies_stay():
    rng = np.random.default_rng(5)
    bodies, c = joined(rng, "revolute")
    before = c.at_first.copy(), c.at_second.copy()
    in_double(bodies, [c])
    assert np.array_equal(c.at_first, before[0]) and np.array_equal(c.at_second, before[1])


def test_directions_are_found_as_a_search_through_all_finds_them():
    """Directions that come again, turned round or off by less than single precision leaves, are the first that was met; the work is linear."""
    rng = np.random.default_rng(0)
    axes = np.vstack([np.eye(3), rng.normal(size=(40, 3))])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    met, found = [], _Directions()
    for _ in range(300):
        u = rng.choice([-1.0, 1.0]) * axes[rng.integers(len(axes))] + rng.uniform(-0.7, 0.7, size=3) * SINGLE
        first = next((s * d for d in met for s in (1.0, -1.0) if np.abs(u - s * d).max() <= SINGLE), None)
        met += [u / np.linalg.norm(u)] if first is None else []
        assert np.array_equal(found.parallel_to(u), met[-1] if first is None else first)

    def search(n):
        many = _Directions()
        return work(lambda: [many.parallel_to(u / np.linalg.norm(u)) for u in np.random.default_rng(1).normal(size=(n, 3))])

    assert_linear(search, 200)
