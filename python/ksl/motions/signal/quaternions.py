"""Quaternions of a motion: of unit length, and without jumps of sign."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ksl._core import QUATERNION_TOLERANCE
from ksl.base.errors import MotionError
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.states import Array


def continuous_unit(where: Callable[[int], str], joint: Joint, q: Array) -> Array:
    """Quaternions of unit length and without jumps between q and −q."""
    position, quaternion = np.hsplit(q, [-4])
    length = np.linalg.norm(quaternion, axis=1)
    bad = np.flatnonzero(np.abs(length - 1) > QUATERNION_TOLERANCE)
    if len(bad):
        raise MotionError(
            f"{where(bad[0])}: the quaternion of {joint.name} has length {length[bad[0]]:.6g}; expected a unit quaternion in the columns {joint.name}.qx … .qw"
        )
    unit = quaternion / length[:, None]
    turn = np.where(np.sum(unit[1:] * unit[:-1], axis=1) < 0, -1.0, 1.0)
    return np.hstack([position, unit * np.concatenate([[1.0], np.cumprod(turn)])[:, None]])
