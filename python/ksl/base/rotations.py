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
