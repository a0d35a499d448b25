"""Poses as MuJoCo has them: quaternions [w x y z] and positions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def matrix(wxyz: Array) -> Array:
    """The rotation (3, 3) of a quaternion of any length."""
    w, x, y, z = np.asarray(wxyz, dtype=float) / np.linalg.norm(wxyz)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def pose(wxyz: Array, position: Array) -> Array:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = matrix(wxyz), position
    return made


def moved(by: Array) -> Array:
    made = np.eye(4)
    made[:3, 3] = by
    return made
