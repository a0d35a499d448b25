"""Derivatives along joint velocities as derivatives by the numbers of q, for joints whose velocity isn't the rate of these: floating, spherical and planar ones.

Kernels differentiate along velocities, as the engine does.  A quaternion [u w] of unit length has the rate ½ [w ω + u × ω, −u · ω] at the angular velocity ω in the body's
axes (docs/conventions.md).  `xp` is torch or jax.numpy, whose functions are called so that both know them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ksl.mechanism.joint_kinds import KINDS
from ksl.operators.operator import Placed


def of_unit_length(xp: Any, joints: Placed, q: Any) -> Any:
    """q with quaternions divided by their length."""
    places = [at + first for kind, at, _ in joints if (first := KINDS[kind].quaternion) is not None]
    if not places:
        return q
    parts, end = [], 0
    for at in places:
        part = q[..., at : at + 4]
        parts += [q[..., end:at], part / xp.sqrt((part * part).sum(-1))[..., None]]
        end = at + 4
    return xp.concatenate([*parts, q[..., end:]], -1)


def as_velocity(xp: Any, joints: Placed, q: Any, dq: Any) -> Any:
    """The joint velocity (…, nv) whose rate of q (…, nq) is dq (…, nq)."""
    return _converted(xp, joints, q, dq, to_velocity=True)


def as_numbers(xp: Any, joints: Placed, q: Any, by: Any) -> Any:
    """The gradient (…, nq) by the numbers of q of what has the gradient `by` (…, nv) along joint velocities."""
    return _converted(xp, joints, q, by, to_velocity=False)


def _converted(xp: Any, joints: Placed, q: Any, x: Any, to_velocity: bool) -> Any:
    """x is given where the first index counts, and returned where the other one does."""
    parts, end = [], 0
    for kind, at_q, at_v in joints:
        nq, nv = KINDS[kind].nq, KINDS[kind].nv
        at, size = (at_q, nq) if to_velocity else (at_v, nv)
        parts += [x[..., end:at], _OF_KIND[kind](xp, q[..., at_q : at_q + nq], x[..., at : at + size], to_velocity)]
        end = at + size
    return xp.concatenate([*parts, x[..., end:]], -1)


def _spherical(xp: Any, q: Any, x: Any, to_velocity: bool) -> Any:
    u, w = q[..., :3], q[..., 3:]
    if to_velocity:
        d, rate = x[..., :3], x[..., 3:]
        return 2 * (w * d - xp.linalg.cross(u, d) - rate * u)
    return 2 * xp.concatenate([w * x + xp.linalg.cross(u, x), -(u * x).sum(-1)[..., None]], -1)


def _floating(xp: Any, q: Any, x: Any, to_velocity: bool) -> Any:
    """The linear velocity is in the body's axes."""
    u, w = q[..., 3:6] * (-1 if to_velocity else 1), q[..., 6:]
    t = 2 * xp.linalg.cross(u, x[..., :3])
    return xp.concatenate([x[..., :3] + w * t + xp.linalg.cross(u, t), _spherical(xp, q[..., 3:], x[..., 3:], to_velocity)], -1)


def _planar(xp: Any, q: Any, x: Any, to_velocity: bool) -> Any:
    """The velocity is in the axes of what moves."""
    s, c = xp.sin(q[..., 2:]) * (-1 if to_velocity else 1), xp.cos(q[..., 2:])
    a, b = x[..., :1], x[..., 1:2]
    return xp.concatenate([c * a - s * b, s * a + c * b, x[..., 2:]], -1)


_OF_KIND: dict[str, Callable[[Any, Any, Any, bool], Any]] = {"floating": _floating, "spherical": _spherical, "planar": _planar}
