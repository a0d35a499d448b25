"""Numbers of one joint in the layout of another library.

Each form takes positions (n, nq) and velocities (n, nv) of KSL, and returns the other positions (n, …), the matrices T (n, m, nv) of
v' = T v, and Ṫ v (n, m), so that a' = T a + Ṫ v, τ = Tᵀ τ', M = Tᵀ M' T, J = J' T.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ksl.base.rotations import quaternion_of, quaternion_product, rotation_of_quaternion

Array = NDArray[np.floating[Any]]


class Mapped(NamedTuple):
    q: Array
    T: Array
    rate: Array
    """Ṫ v."""


Form = Callable[[Array, Array], Mapped]


def same(q: Array, v: Array) -> Mapped:
    return Mapped(q, np.broadcast_to(np.eye(v.shape[1]), (*v.shape, v.shape[1])), np.zeros_like(v))


def cosine_and_sine(q: Array, v: Array) -> Mapped:
    """The last number, an angle, as its cosine and sine."""
    return same(q, v)._replace(q=np.concatenate([q[:, :-1], np.cos(q[:, -1:]), np.sin(q[:, -1:])], axis=1))


def planar_in_parent(q: Array, v: Array) -> Mapped:
    """A planar joint whose linear velocity is in the parent's axes."""
    c, s = np.cos(q[:, 2]), np.sin(q[:, 2])
    T = np.zeros((len(q), 3, 3))
    T[:, 0, 0], T[:, 0, 1], T[:, 1, 0], T[:, 1, 1], T[:, 2, 2] = c, -s, s, c, 1.0
    return Mapped(q, T, _turned(T, np.stack([-v[:, 2] * v[:, 1], v[:, 2] * v[:, 0], 0 * v[:, 2]], axis=1)))


def free(placement: Array) -> Form:
    """The pose in the world, and rates in the body's axes, linear first, as KSL's: Pinocchio.  placement (4, 4): of the joint in the world."""

    def form(q: Array, v: Array) -> Mapped:
        position, quaternion, _ = _in_world(placement, q)
        return same(q, v)._replace(q=np.concatenate([position, quaternion], axis=1))

    return form


def free_in_world(placement: Array) -> Form:
    """w x y z before the position; angular velocity before linear, both in world axes: Drake."""

    def form(q: Array, v: Array) -> Mapped:
        position, quaternion, R = _in_world(placement, q)
        T, rate = np.zeros((len(q), 6, 6)), np.zeros((len(q), 6))
        T[:, :3, 3:], T[:, 3:, :3] = R, R
        rate[:, 3:] = _turned(R, np.cross(v[:, 3:], v[:, :3]))
        return Mapped(np.concatenate([quaternion[:, [3, 0, 1, 2]], position], axis=1), T, rate)

    return form


def free_linear_in_world(placement: Array) -> Form:
    """w x y z after the position; linear velocity in world axes, angular in the body's: MuJoCo."""

    def form(q: Array, v: Array) -> Mapped:
        position, quaternion, R = _in_world(placement, q)
        T, rate = np.zeros((len(q), 6, 6)), np.zeros((len(q), 6))
        T[:, :3, :3], T[:, 3:, 3:] = R, np.eye(3)
        rate[:, :3] = _turned(R, np.cross(v[:, 3:], v[:, :3]))
        return Mapped(np.concatenate([position, quaternion[:, [3, 0, 1, 2]]], axis=1), T, rate)

    return form


def _in_world(placement: Array, q: Array) -> tuple[Array, Array, Array]:
    """Position, quaternion x y z w and rotation in the world, of poses (n, 7) in a joint's frame."""
    turn = placement[:3, :3]
    quaternion = quaternion_product(quaternion_of(turn), q[:, 3:] / np.linalg.norm(q[:, 3:], axis=1, keepdims=True))
    return q[:, :3] @ turn.T + placement[:3, 3], quaternion, np.asarray(rotation_of_quaternion(quaternion), dtype=np.float64)


def _turned(R: Array, x: Array) -> Array:
    return np.asarray(np.einsum("nij,nj->ni", R, x))
