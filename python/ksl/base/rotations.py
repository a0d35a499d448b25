"""Rotation matrices of angles and quaternions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

UNIT_TOLERANCE = 1e-2
"""How far the length of a quaternion may be from 1; it is normalised."""


def rotation_of_rpy(rpy: Floats) -> Floats:
    """R (…, 3, 3) = Rz(yaw) Ry(pitch) Rx(roll) of angles (…, 3) roll, pitch, yaw, rad: turns about the fixed axes x, y, z in this order, as URDF's `rpy`."""
    (sr, sp, sy), (cr, cp, cy) = np.moveaxis(np.sin(rpy), -1, 0), np.moveaxis(np.cos(rpy), -1, 0)
    rows = [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], [-sp, cp * sr, cp * cr]]
    return _stacked(rows)


def rotation_of_quaternion(quaternion: Floats) -> Floats:
    """R (…, 3, 3) of quaternions (…, 4) x, y, z, w, which are normalised.  Raises ValueError where the length is not 1 within 1e-2."""
    length = np.linalg.norm(quaternion, axis=-1)
    off = np.abs(length - 1)
    if not (off <= UNIT_TOLERANCE).all():
        worst = float(np.ravel(length)[int(np.argmax(np.where(np.isnan(off), np.inf, off)))])
        raise ValueError(f"a quaternion has length {worst:.4g}; expected unit quaternions x, y, z, w")
    x, y, z, w = np.moveaxis(quaternion / length[..., None], -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return _stacked(rows)


def _stacked(rows: list[list[Floats]]) -> Floats:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_of(R: Floats) -> NDArray[np.float64]:
    """[x y z w] (4) of a rotation matrix (3, 3) (Shepperd, Quaternion from rotation matrix, 1978)."""
    K = np.array([R[0, 0], R[1, 1], R[2, 2], np.trace(R)])
    i = int(np.argmax(K))
    if i == 3:
        q = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], 1 + K[3]])
    else:
        j, k = (i + 1) % 3, (i + 2) % 3
        q = np.empty(4)
        q[i], q[j], q[k], q[3] = 1 + 2 * R[i, i] - K[3], R[i, j] + R[j, i], R[i, k] + R[k, i], R[k, j] - R[j, k]
    return np.asarray(q / np.linalg.norm(q))


def quaternion_product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """The product a b of quaternions (…, 4), [x y z w]: the rotation of b, then that of a, about axes that stand."""
    u, v, s, t = a[..., :3], b[..., :3], a[..., 3:], b[..., 3:]
    return np.concatenate([s * v + t * u + np.cross(u, v), s * t - (u * v).sum(axis=-1, keepdims=True)], axis=-1)
