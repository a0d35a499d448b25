"""The Jacobian of a frame: J v is the frame's twist, found from its poses along a motion by differences."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from power_test import STENCIL, SmoothMotion
from random_tree import load_text, random_tree


def twist_in_frame(m, motion, t: np.ndarray, name: str, h: float = 2e-3) -> tuple[np.ndarray, np.ndarray]:
    """(n, 6), linear first, about the frame's origin and in its axes, from T⁻¹ dT/dt; and the poses T."""
    T = m.frame_pose(motion(t)[0], name)
    poses = lambda s: m.frame_pose(motion(s)[0], name)
    rate = sum(c * (poses(t + (k + 1) * h) - poses(t - (k + 1) * h)) for k, c in enumerate(STENCIL)) / h
    X = np.linalg.inv(T) @ rate
    return np.concatenate([X[:, :3, 3], np.stack([X[:, 2, 1], X[:, 0, 2], X[:, 1, 0]], axis=1)], axis=1), T


def expressed(twist: np.ndarray, T: np.ndarray, axes: str, at: str) -> np.ndarray:
    """The twist of a frame with the pose T, elsewhere and in other axes."""
    R, p = T[:, :3, :3], T[:, :3, 3]
    v, w = (np.einsum("nij,nj->ni", R, x) for x in (twist[:, :3], twist[:, 3:]))
    if at == "world":
        v = v - np.cross(w, p)
    if axes == "frame":
        v, w = (np.einsum("nji,nj->ni", R, x) for x in (v, w))
    return np.concatenate([v, w], axis=1)


@given(st.integers(0, 2**32 - 1), st.integers(2, 25), st.booleans())
def test_the_jacobian_gives_the_twist_of_a_frame(seed, bodies, floating):
    rng = np.random.default_rng(seed)
    m = load_text(random_tree(rng, bodies), floating_base=floating)
    motion, t = SmoothMotion(m, rng), np.linspace(0, 2, 5)
    q, v, _ = motion(t)
    name = str(rng.choice(m.link_names))
    twist, T = twist_in_frame(m, motion, t, name)
    for axes in ("frame", "world"):
        for at in ("frame", "world"):
            J, expected = m.jacobian(q, name, axes=axes, at=at), expressed(twist, T, axes, at)
            assert np.abs(np.einsum("nij,nj->ni", J, v) - expected).max() < 1e-8 * max(1.0, np.abs(expected).max()), (axes, at)
            turned = m.jacobian(q, name, axes=axes, at=at, order="ang_lin")
            assert np.array_equal(turned, J[:, [3, 4, 5, 0, 1, 2]])


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
