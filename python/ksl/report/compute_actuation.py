"""`ksl.compute_actuation`: the maps between motors and joints over their range, limits of files beside the true ones, and a motion through them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.errors import MotionError
from ksl.drivetrain.actuation import Actuation
from ksl.drivetrain.judged_limits import judged_limits
from ksl.drivetrain.region import usable_ranges
from ksl.drivetrain.serial import Limits, place_of
from ksl.load_cases.closed_poses import closed_pose, named_joints
from ksl.load_cases.poses import held_still, pose_of
from ksl.mechanism.states import Array
from ksl.model.model import Model
from ksl.motions.motion import Motion
from ksl.motions.reading import read_motion
from ksl.report.actuation_files import write_actuation
from ksl.report.actuation_results import ActuationResults, JointCurves, MotionThrough
from ksl.robot_files.loading import load

POINTS = 161
"""Positions of a joint at which its curves are computed."""
RATE, SPEED, ARM = 30.0, 1.0, 0.1
"""Accelerations, rad/s², and speeds, rad/s, of the states for which the serial model is judged; times this, m, where joints slide."""


class ActuationRun(ActuationResults):
    """What :func:`ksl.compute_actuation` returns: results, and their files."""

    def write(self, directory: str | os.PathLike[str], force: bool = False) -> list[str]:
        """Writes report.html, maps and motion as Parquet and CSV, and the serial model as URDF and MJCF, completely or not at all; returns their names.

        closed.xml is the closed mechanism as MJCF, where MuJoCo has its joints; leg_maps.h and leg_maps.c are the maps in C.  Raises OutputError.  Needs the extra `ksl[loads]`.
        """
        return write_actuation(self, Path(directory), force)


def compute_actuation(
    model: Model | str | os.PathLike[str],
    joints: Iterable[str],
    motion: str | os.PathLike[str] | None = None,
    *,
    check: Sequence[str | os.PathLike[str]] = (),
    at: ArrayLike | None = None,
    limits: Limits = "safe",
    start: Mapping[str, Any] | ArrayLike | None = None,
    command: str = "",
) -> ActuationRun:
    """The map of :func:`ksl.actuation` over its range, limits of files beside those that motors give, the serial model, and a motion through the mechanism.

    model: a model, or the robot's file.  joints: as of :func:`ksl.actuation`.  motion: a file with a column for each joint of the serial model, those
    that carry the mechanism included, as :func:`ksl.read_motion` reads it.  check: other files of the robot, serial ones in whatever format, whose limits are judged.
    at (joints): the place that curves go through, by default the start.  limits: of the serial model, "safe" or "mean".
    start: as of :func:`ksl.actuation`, (nq); or {joint: position}, rad or m, of which other joints follow.
    command: the command line, for the report.

    Raises ValueError, MotionError and DescriptionError with a sentence.  Some seconds for three joints.

        run = ksl.compute_actuation("leg.urdf", ["ankle_pitch", "ankle_roll"], "walk.csv")
        run.write("ankle")
    """
    robot = model if isinstance(model, Model) else load(model)
    a = robot.actuation(joints, _closed(robot, start) if isinstance(start, Mapping) else start)
    place = place_of(a, at)
    serial = a.serial_model(place, limits)
    judged = judged_limits(a, file=_name(robot))
    others = [load(path, loops="cut") for path in check]
    for other, path in zip(others, check):
        found = {name: other.joint(name) for name in a.joints if name in other.joint_names}
        if not found:
            raise ValueError(f"check: {os.fspath(path)} has none of the joints {', '.join(a.joints)}; give a file of the same robot")
        judged += judged_limits(a, found, os.path.basename(os.fspath(path)))
    through = None if motion is None else _through(a, serial, read_motion(serial, motion))
    q = a.usable(seed=7)
    rng, scale = np.random.default_rng(3), np.array([ARM if a.model.joint(name).unit == "m" else 1.0 for name in a.joints])
    errors = a.serial_errors(serial, q, SPEED * scale * rng.normal(size=q.shape), RATE * scale * rng.normal(size=q.shape))
    inputs = [*robot.inputs, *(one for other in others for one in other.inputs)]
    return ActuationRun(a, place, [_curves(a, place, k) for k in range(len(a.joints))], judged, serial, errors, through, inputs, command)


def _closed(m: Model, positions: Mapping[str, Any]) -> Array:
    """The position (nq) with these joints where they are said to be."""
    try:
        q = pose_of(m, positions)
        for doubt in held_still(m, q).doubts:  # degrees for radians, millimetres for metres
            raise MotionError(doubt)
        return closed_pose(m, q, named_joints(m, positions))[0] if m.loops else q
    except MotionError as e:
        raise MotionError(f"start: {e}") from None


def _name(m: Model) -> str:
    return os.path.basename(m.file) if m.file else m.name


def _curves(a: Actuation, at: Array, k: int) -> JointCurves:
    low, high = usable_ranges(a, at)[k]
    q = np.repeat(at[None], POINTS, axis=0)
    q[:, k] = np.linspace(low, high, POINTS)
    motors = a.motors_of(q, unreachable="nan")
    q, motors = q[~np.isnan(motors).any(axis=1)], motors[~np.isnan(motors).any(axis=1)]
    W = a.motor_jacobian(q)
    effort, effort_box = (a.effort_alone(q)[:, k], a.effort_box(q)[:, k, 1]) if a.has_limits("effort") else (None, None)
    velocity, velocity_box = (a.velocity_alone(q)[:, k], a.velocity_box(q)[:, k, 1]) if a.has_limits("velocity") else (None, None)
    distance = a.holding(W) / a.holding(a.motor_jacobian(at))
    inertia = [a.reflected_inertia(q, of=share)[:, k, k] for share in ("rotors", "rods")]
    return JointCurves(
        a.joints[k], a.model.joint(a.joints[k]).unit, q, motors, W[:, :, k], effort, effort_box, velocity, velocity_box, inertia[0], inertia[1], distance
    )


def _through(a: Actuation, serial: Model, motion: Motion) -> MotionThrough:
    states = [np.asarray(x) for x in (motion.q, motion.v, motion.a)]
    m, n = a.model, len(states[0])
    Q, V, A = (np.repeat(x[None], n, axis=0) for x in (m.neutral(), np.zeros(m.nv), np.zeros(m.nv)))
    for joint in serial.joints:
        if joint.nv and joint.name not in a.joints:
            of = m.joint(joint.name)
            Q[:, of.q_index : of.q_index + of.nq] = states[0][:, joint.q_index : joint.q_index + joint.nq]
            for to, x in zip((V, A), states[1:]):
                to[:, of.v_index : of.v_index + of.nv] = x[:, joint.v_index : joint.v_index + joint.nv]
    own = [serial.joint(name) for name in a.joints]
    q, v, acceleration = states[0][:, [j.q_index for j in own]], states[1][:, [j.v_index for j in own]], states[2][:, [j.v_index for j in own]]
    whole, carrier = a.with_rotors, (Q, V, A)
    efforts = whole.motor_efforts(q, v, acceleration, carrier)
    return MotionThrough(
        np.asarray(motion.time), a.motors_of(q), a.motor_velocities(q, v), efforts, efforts - whole.lost_efforts(q, v, acceleration, carrier),
        whole.loop_forces(q, v, acceleration, carrier), a.serial_errors(serial, q, v, acceleration, carrier), tuple(motion.doubts),
    )  # fmt: skip
