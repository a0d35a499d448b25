"""Velocities and accelerations of frames and points: those of the witness, in world coordinates, and differences between two."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from newton_euler import adjoint, motion_cross
from random_tree import Case

WHERE = [dict(axes=a, at=p) for a in ("frame", "world") for p in ("frame", "world")]


def linear_first(x: np.ndarray) -> np.ndarray:
    return np.concatenate([x[..., 3:], x[..., :3]], axis=-1)


def carried(T: np.ndarray, x: np.ndarray) -> np.ndarray:
    """A twist in world coordinates, angular first, as seen in the frame whose pose is T."""
    return (np.linalg.inv(adjoint(T)) @ x[..., None])[..., 0]


def target(T: np.ndarray, axes: str, at: str) -> np.ndarray:
    """The pose of the frame that a motion is expressed in."""
    out = np.broadcast_to(np.eye(4), T.shape).copy()
    if axes == "frame":
        out[..., :3, :3] = T[..., :3, :3]
    if at == "frame":
        out[..., :3, 3] = T[..., :3, 3]
    return out


def near(found, expected):
    assert np.abs(found - expected).max() <= 1e-12 * max(1.0, np.abs(expected).max())


def accelerations(case: Case) -> dict[str, np.ndarray]:
    """Spatial accelerations of links in world coordinates, angular first: sums of S a + v × S v (RBDA, eq. (5.15))."""
    m, w, out = case.m, case.witness, {}
    for link in m.link_names:
        joint = next(j for j in m.joints if j.child == link)
        before = out.get(joint.parent, np.zeros((len(case.q), 6)))
        part = lambda x: x[:, joint.v_index : joint.v_index + joint.nv] if joint.nv else np.zeros((len(x), 0))
        S = np.broadcast_to(w.subspace[link], (len(case.q), 6, joint.nv))
        own, rate = ((S @ part(x)[..., None])[..., 0] for x in (case.v, case.a))
        out[link] = before + rate + (motion_cross(np.broadcast_to(w.twist[link], own.shape)) @ own[..., None])[..., 0]
    return out


@given(st.integers(0, 2**32 - 1), st.integers(2, 25), st.booleans())
def test_frames_and_points_move_as_the_witness_says(seed, bodies, floating):
    case = Case(seed, bodies, floating_base=floating, kinds=("revolute", "continuous", "prismatic", "helical", "spherical", "fixed", "floating"))
    m, (q, v, a) = case.m, case.state
    spatial = accelerations(case)
    names = [str(n) for n in case.rng.choice(m.link_names, 3)]
    for name in names:
        T = np.broadcast_to(case.witness.pose[name], (len(q), 4, 4))
        V, A = (np.broadcast_to(x, (len(q), 6)) for x in (case.witness.twist[name], spatial[name]))
        for where in WHERE:
            D = target(T, **where)
            twist, acceleration = linear_first(carried(D, V)), linear_first(carried(D, A))
            near(m.frame_velocity(q, v, name, **where), twist)
            near(m.frame_velocity(q, v, name, order="ang_lin", **where), np.roll(twist, 3, axis=-1))
            near(m.frame_acceleration(q, v, a, name, **where), acceleration)
            acceleration[:, :3] += np.cross(twist[:, 3:], twist[:, :3])
            near(m.frame_acceleration(q, v, a, name, kind="classical", **where), acceleration)
            near(np.einsum("sij,sj->si", m.jacobian(q, name, **where), v), twist)
        point = case.rng.normal(size=3)
        at = np.broadcast_to(np.eye(4), T.shape).copy()
        at[:, :3, 3] = T[:, :3, 3] + T[:, :3, :3] @ point
        twist, acceleration = linear_first(carried(at, V)), linear_first(carried(at, A))
        near(m.point_velocity(q, v, name, point, axes="world"), twist[:, :3])
        near(m.point_acceleration(q, v, a, name, point, axes="world"), acceleration[:, :3] + np.cross(twist[:, 3:], twist[:, :3]))
        near(m.frame_velocity(q, v, name, axes="world", offset=point), twist)
    assert np.array_equal(m.frame_velocities(q, v, names), np.stack([m.frame_velocity(q, v, n) for n in names], axis=1))
    found = m.frame_accelerations(q, v, a, names, kind="classical", axes="world")
    assert np.array_equal(found, np.stack([m.frame_acceleration(q, v, a, n, kind="classical", axes="world") for n in names], axis=1))


@given(st.integers(0, 2**32 - 1), st.integers(2, 25), st.booleans())
def test_a_frame_as_seen_from_another(seed, bodies, floating):
    case = Case(seed, bodies, floating_base=floating, kinds=("revolute", "prismatic", "helical", "spherical", "floating"))
    m, (q, v, _) = case.m, case.state
    name, other = (str(n) for n in case.rng.choice(m.link_names, 2))
    T, other_T = m.frame_pose(q, name), m.frame_pose(q, other)
    near(m.relative_pose(q, name, other), np.linalg.inv(other_T) @ T)
    relative = np.broadcast_to(case.witness.twist[name] - case.witness.twist[other], (len(q), 6))  # of the one seen from the other
    for where in WHERE:
        D = target(np.linalg.inv(other_T) @ T, **where)  # the other frame in the place of the world
        twist = linear_first(carried(other_T @ D, relative))
        near(m.relative_velocity(q, v, name, other, **where), twist)
        J = m.relative_jacobian(q, name, other, **where)
        near(np.einsum("sij,sj->si", J, v), twist)
        near(m.relative_jacobian(q, name, other, order="ang_lin", **where), J[:, [3, 4, 5, 0, 1, 2]])


def test_columns_of_joints_that_carry_something_else_are_zero(examples):
    import ksl

    m = ksl.load(examples / "robots/panda.urdf")
    q = np.linspace(-1, 1, m.nq)
    J = m.jacobian(q, "panda_link3")
    assert (J[:, 3:] == 0).all() and (np.abs(J[:, :3]).max(axis=0) > 0.1).all()
    assert np.array_equal(m.jacobian(q, "panda_joint3"), J)


def test_unknown_words_are_said(examples):
    import ksl

    m = ksl.load(examples / "robots/panda.urdf")
    q = np.zeros(m.nq)
    for keywords, sentence in (
        ({"axes": "joint"}, "axes='joint'; expected one of 'frame', 'world'"),
        ({"at": ["frame"]}, "at=\\['frame'\\]; expected one of 'frame', 'world'"),
        ({"order": "lin"}, "order='lin'; expected one of 'lin_ang', 'ang_lin'"),
    ):
        with pytest.raises(ValueError, match=sentence):
            m.jacobian(q, "panda_link3", **keywords)
    with pytest.raises(ValueError, match="no link or joint named 'absent'"):
        m.jacobian(q, "absent")
    with pytest.raises(ValueError, match="kind='body'; expected one of 'spatial', 'classical', 'rate'"):
        m.frame_acceleration(q, q, q, "panda_link3", kind="body")
    with pytest.raises(ValueError, match="needs three finite numbers"):
        m.point_velocity(q, q, "panda_link3", (0, 1))
    with pytest.raises(ValueError, match="no link or joint named 'absent'"):
        m.relative_pose(q, "panda_link3", "absent")
