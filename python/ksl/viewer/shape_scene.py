"""The shape of a mode, as a scene: links sway about a pose for one period."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ksl.base.rotations import rotation_of_quaternion
from ksl.mechanism.states import Array
from ksl.viewer.scene import Scene, make_scene

if TYPE_CHECKING:
    from ksl.mechanism.calls import Calls

STATES, PERIOD = 60, 2.0
"""How many states are shown, and in how many seconds, whatever the frequency."""
SWAY = 0.1
"""The largest displacement of a link's origin, as a share of the size of the scene; or its turn, rad, where that is larger than the displacement at the size."""


def scene_of_shape(model: Calls, q: Array, shape: Array, title: str, package_paths: Sequence[str | os.PathLike[str]] = ()) -> Scene:
    """The pose q (nq), about which each link sways along its twist of a shape (links, 6), at its origin in its axes, linear first; there are no wrenches."""
    time = np.linspace(0, PERIOD, STATES + 1)
    still = make_scene(model, np.repeat(q[None], len(time), axis=0), time=time, package_paths=package_paths)
    most = max(float(np.linalg.norm(shape[:, :3], axis=1).max()), float(np.linalg.norm(shape[:, 3:], axis=1).max()) * still.size)
    twist = shape * (SWAY * still.size / most if most > 0 else 0.0)
    swayed = np.sin(2 * np.pi * time / PERIOD)[:, None, None] * twist
    poses, half = np.array(still.poses), swayed[..., 3:] / 2
    angle = np.linalg.norm(half, axis=-1, keepdims=True)
    R = poses[..., :3, :3].copy()
    poses[..., :3, 3] += np.einsum("nlij,nlj->nli", R, swayed[..., :3])
    poses[..., :3, :3] = R @ rotation_of_quaternion(np.concatenate([half * np.sinc(angle / np.pi), np.cos(angle)], axis=-1))
    nothing = np.zeros_like(still.constraint)
    return replace(still, poses=poses, constraint=nothing, actuation=nothing, effort=np.full_like(still.effort, np.nan), unloaded=title)
