"""One pose at rest: efforts and every wrench; and the pose within limits that is worst for a joint."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ksl.base.errors import MotionError, unknown_name
from ksl.base.extras import require
from ksl.base.files_read import being_read
from ksl.base.input_files import STANDARD_INPUT
from ksl.base.real_arrays import real_array
from ksl.load_cases.closed_poses import reach_of
from ksl.load_cases.joint_limits import limits_of
from ksl.load_cases.load_case import Placement
from ksl.load_cases.poses import pose_of
from ksl.load_cases.quantities import joint_loads
from ksl.load_cases.reaction_joints import has_drive, joint_named
from ksl.mechanism.mechanism import Joint
from ksl.model.model import Model
from ksl.mechanism.states import Array
from ksl.motions.reading import read_motion

COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")
TRIED = 4096
"""Random poses that are tried, of which the best are refined."""
REFINED = 12
SEARCH = {"maxiter": 1000}
"""Options of each refinement, for scipy."""
AGREE = 1e-3
"""Searches whose values differ by less, as a share, came to the same."""
STEP = 1e-4
"""The step of central differences, as a share of the range of each joint."""

Pose = Mapping[str, Any] | Sequence[float]


@dataclass(frozen=True)
class WorstPose:
    """What a search for the worst pose found, and how far it came."""

    q: Array
    """(nq)."""
    value: float
    """The largest magnitude that was found, N or N m."""
    tried: int
    """Random poses."""
    refined: int
    """Searches from the best of them."""
    ended: int
    """How many of these ended at a maximum: no step within limits makes more of it."""
    agree: int
    """How many of these came to the value within 0.1 %.  One alone may have missed a larger one."""

    skipped: int = 0
    """Random poses that were not looked at: no closed position was found there within the limits of all joints, or one that drives don't hold."""

    @property
    def converged(self) -> bool:
        """Whether the search that found the value ended at a maximum, and another came to the same."""
        return self.refined == 0 or self.agree > 1

    def __str__(self) -> str:
        if self.skipped and self.skipped == self.tried:
            return f"no closed position within the limits was found from {self.tried} random poses: this is the pose that was given; give limits of position that fit"
        if not self.refined:
            return "no joint can move: there was nothing to search"
        said = f"{self.agree} of {self.refined} searches, from the best of {self.tried} random poses, came to this value"
        doubt = "" if self.converged else "; there may be a worse pose: try other seeds"
        unfinished = f", {self.refined - self.ended} ended before a maximum" if self.ended < self.refined else ""
        barred = (
            f"; from {self.skipped} of the {self.tried} no closed position was found within the limits, or none that the drives hold" if self.skipped else ""
        )
        return said + unfinished + barred + doubt


def worst_pose(model: Model, joint: str, quantity: str, placement: Placement, q: Array, fixed: set[str], seed: int = 0) -> WorstPose:
    """The pose at rest with the largest magnitude of a quantity of a joint; joints that are not searched are as in `q` (nq)."""
    require("a search of the worst pose", "scipy")
    from scipy.optimize import minimize

    size = _size(model, joint_named(model, joint), quantity, placement)
    reach = reach_of(model, q, fixed)
    moving = reach.searched(model.joints[: len(model.joint_names)])
    searched = [(j, bounds) for j in moving if j.name not in fixed and (bounds := _range(j))]
    if not searched:
        return WorstPose(q, float(size(q[None])[0]), 0, 0, 0, 0)
    columns = [j.q_index for j, _ in searched]
    lower, upper = (np.array([bounds[k] for _, bounds in searched]) for k in (0, 1))

    def largest(x: Array, near: Array | None = None) -> Array:
        """Sizes (n) of poses x (n, searched), each from 0 to 1 of its range; near (nq): a closed pose beside them."""
        poses = np.repeat(q[None], len(x), axis=0)
        poses[:, columns] = lower + x * (upper - lower)
        return reach.sizes(size, poses, near)

    def descent(x: Array, near: Array) -> tuple[float, Array]:
        """Minus the square, which is smooth where the magnitude is zero, and its gradient by central differences, in one batch."""
        steps = STEP * np.eye(len(x))
        values = largest(np.vstack([x, x + steps, x - steps]), near) ** 2 / scale
        return -float(values[0]), -(values[1 : len(x) + 1] - values[len(x) + 1 :]) / (2 * STEP)

    tried = reach.nearer(np.random.default_rng(seed).random((TRIED, len(columns))), (q[columns] - lower) / (upper - lower))
    sizes = largest(tried)
    skipped = reach.skipped
    if skipped == TRIED:
        return WorstPose(q, float(size(q[None])[0]), TRIED, 0, 0, 0, skipped)
    scale = float(sizes.max()) ** 2 or 1.0
    best, found = tried[int(sizes.argmax())], float(sizes.max())
    ends: list[tuple[float, bool]] = []
    for k in np.argsort(-sizes, kind="stable")[:REFINED]:
        if sizes[k] == 0 and skipped:  # no closed position was found there
            break
        near = _at(q, columns, lower + tried[k] * (upper - lower))
        near = reach.closed(near[None])[0][0]
        end = minimize(descent, tried[k], args=(near,), jac=True, method="L-BFGS-B", bounds=[(0.0, 1.0)] * len(columns), options=SEARCH)
        x = np.clip(end.x, 0, 1)
        value = float(largest(x[None], near)[0])
        ends.append((value, bool(end.success)))
        if value > found:
            best, found = x, value
    pose = _at(q, columns, lower + best * (upper - lower))
    agree = sum(done and value >= (1 - AGREE) * found for value, done in ends)
    pose = _nearest(pose, q, searched, lambda poses: reach.sizes(size, poses))
    return WorstPose(reach.closed(pose[None])[0][0], found, TRIED, len(ends), sum(done for _, done in ends), agree, skipped)


def _at(q: Array, columns: Sequence[int], x: Array) -> Array:
    """q (nq) with other numbers in some columns."""
    pose = q.copy()
    pose[columns] = x
    return pose


def _nearest(pose: Array, q: Array, searched: Sequence[tuple[Joint, tuple[float, float]]], size: Callable[[Array], Array]) -> Array:
    """A pose with the same quantity, whose joints that don't matter are as in `q`, and angles without needless turns."""
    least = float(size(pose[None])[0]) * (1 - 1e-9)
    for joint, (lower, upper) in searched:
        k = joint.q_index
        others = [q[k], *(pose[k] + turns * math.tau for turns in (-2, -1, 1, 2) if joint.has_angle), pose[k]]
        for x in sorted((x for x in others if lower <= x <= upper), key=lambda x: abs(x - q[k])):
            tried = pose.copy()
            tried[k] = x
            if float(size(tried[None])[0]) >= least:
                pose = tried
                break
    return pose


def _size(model: Model, joint: Joint, quantity: str, placement: Placement) -> Callable[[Array], Array]:
    """The magnitude (n) of a quantity of a joint at poses (n, nq) at rest."""
    own = quantity in COMPONENTS
    p = placement
    request = model.reaction_request(p.on, p.at, p.axes if own else "joint", "lin_ang", "total", [joint.name])
    known = ["effort"] if joint.nv == 1 and has_drive(model, joint) else []
    known += [*COMPONENTS, "force", "moment", *([n for n in joint_loads(joint, np.zeros((1, 6)), None, None).wrench if "_" in n])]
    if quantity == "effort" and quantity not in known:
        raise ValueError(f"joint {joint.name} has no motor, and so no effort; say what is largest, --of (quantity= in Python): {', '.join(known)}")
    if quantity not in known:
        raise ValueError(unknown_name(f"joint {joint.name}", "quantity", quantity, known))

    def size(poses: Array) -> Array:
        still = np.zeros((len(poses), model.nv))
        tau, reactions = model.inverse_dynamics_with_reactions(poses, still, still, (request,))
        if quantity == "effort":
            found = tau[:, joint.v_index]
        elif own:
            found = reactions[:, 0, COMPONENTS.index(quantity)]
        elif quantity in ("force", "moment"):
            found = np.linalg.norm(reactions[:, 0, :3] if quantity == "force" else reactions[:, 0, 3:], axis=1)
        else:
            found = joint_loads(joint, reactions[:, 0], None, None).wrench[quantity]
        magnitude: Array = np.abs(found)
        return magnitude

    return size


def _range(joint: Joint) -> tuple[float, float] | None:
    """Bounds of the search; None for joints that stay where they are."""
    if joint.nv != 1:
        return None
    limits = limits_of(joint)
    if limits.lower is not None and limits.upper is not None:
        return limits.lower, limits.upper
    if not joint.has_angle:
        return None
    lower = limits.lower if limits.lower is not None else limits.upper - 2 * math.pi if limits.upper is not None else -math.pi
    return lower, limits.upper if limits.upper is not None else lower + 2 * math.pi


def given_pose(model: Model, pose: Any) -> Array:
    """q (nq) of a pose that is given as numbers.  Raises MotionError."""
    q = np.asarray(real_array(pose, "pose"), dtype=float)
    if q.shape != (model.nq,) or not np.isfinite(q).all():
        raise MotionError(f"pose has shape {q.shape}; expected ({model.nq}) finite numbers, or a mapping {{joint: position}}")
    return q


def read_pose(model: Model, path: str | os.PathLike[str], time: float | None = None) -> dict[str, float]:
    """A pose from a file: a TOML file of positions by names, or a sample of a motion, the first or the one nearest to a time, s."""
    with being_read("pose", path, MotionError):
        return _pose_of_file(model, os.fspath(path), time)


def _pose_of_file(model: Model, file: str, time: float | None) -> dict[str, float]:
    from ksl.mechanism.joint_kinds import columns_of

    if file.endswith(".toml"):
        from ksl.base.toml_files import read_toml

        table = read_toml(file, MotionError, "a pose: JOINT = POSITION, rad or m")
        pose_of(model, table)
        return table
    if file != STANDARD_INPUT and not os.path.exists(file):
        raise MotionError(f"{file}: there is no such file; give a TOML file of positions by names, or a motion")
    motion = read_motion(model, file)
    if time is not None and not motion.time[0] <= time <= motion.time[-1]:
        raise MotionError(f"{file}: no sample at {time:g} s; its times are {motion.time[0]:g} s to {motion.time[-1]:g} s")
    k = 0 if time is None else int(np.argmin(np.abs(motion.time - time)))
    names = [(c, j.q_index + i) for j in model.joints[: len(model.joint_names)] for i, c in enumerate(columns_of(j)[0])]
    return {name: float(motion.q[k, i]) for name, i in names}
