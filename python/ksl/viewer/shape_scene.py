"""Shapes of modes, as scenes: links sway about a pose for one period."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ksl.base.rotations import rotation_of_quaternion
from ksl.mechanism.states import Array
from ksl.model.poses_at_rest import Modes
from ksl.viewer.scene import Scene, make_scene

if TYPE_CHECKING:
    from ksl.mechanism.calls import Calls

MOST = 24
"""Modes that a page has, from the lowest."""
STATES, PERIOD = 60, 2.0
"""How many states are shown, and in how many seconds, whatever the frequency."""
SWAY = 0.1
"""The largest displacement of a link's origin, as a share of the size of the scene; or its turn, rad, where that is larger than the displacement at the size."""


def scenes_of_modes(model: Calls, q: Array, modes: Modes, package_paths: Sequence[str | os.PathLike[str]] = ()) -> dict[str, Scene]:
    """{"mode 1, 12.3 Hz": scene}, of the lowest modes at the pose q (nq), of which there is one at least.  Raises ValueError where there is none."""
    if not isinstance(modes, Modes):
        raise ValueError(f"modes is {type(modes).__name__}; expected what m.modes(q) returns")
    if not len(modes.frequencies):
        raise ValueError("modes: there is none, whose shape could be shown; give a joint a stiffness")
    if modes.shapes.shape[1:] != (len(model.link_names), 6):
        raise ValueError(f"modes: have shapes of {modes.shapes.shape[1]} links, and {model.name} has {len(model.link_names)}; give m.modes(q) of this model")
    still = _still(model, q, package_paths)
    return {title: _swaying(still, shape, title) for title, shape in zip(map(title_of, range(1, MOST + 1), modes.frequencies), modes.shapes)}


def title_of(mode: int, frequency: float) -> str:
    """What a mode, from 1 on, is called."""
    return f"mode {mode}, {frequency:.4g} Hz"


def scene_of_shape(model: Calls, q: Array, shape: Array, title: str, package_paths: Sequence[str | os.PathLike[str]] = ()) -> Scene:
    """The pose q (nq), about which each link sways along its twist of a shape (links, 6), at its origin in its axes, linear first; there are no wrenches."""
    return _swaying(_still(model, q, package_paths), shape, title)


def _still(model: Calls, q: Array, package_paths: Sequence[str | os.PathLike[str]]) -> Scene:
    time = np.linspace(0, PERIOD, STATES + 1)
    return make_scene(model, np.repeat(q[None], len(time), axis=0), time=time, package_paths=package_paths)


def _swaying(still: Scene, shape: Array, title: str) -> Scene:
    time = still.time
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
