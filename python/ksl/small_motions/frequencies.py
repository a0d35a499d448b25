"""`ksl.frequencies`: the lowest frequencies of a robot in a pose, along a motion, or over a grid of poses."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.csv_cells import csv_text
from ksl.base.errors import MotionError
from ksl.load_cases.closed_poses import closed_pose, named_joints
from ksl.load_cases.case_files.motion_given import motion_given
from ksl.load_cases.poses import neutral, pose_of
from ksl.mechanism.joint_kinds import columns_of
from ksl.mechanism.states import Array
from ksl.mechanism.stiffness import Stiffness, Stiffnesses, table_of
from ksl.model.model import Model
from ksl.model.poses_at_rest import Modes
from ksl.motions.reading import read_motion
from ksl.motions.signal.suspicions import suspicions_of_pose
from ksl.output import whole_file
from ksl.robot_files.loading import load
from ksl.small_motions.modes import modes

SAMPLES = 200
"""So many samples of a motion are taken, at most."""
MOST = 100_000
"""Poses of a grid."""


@dataclass(frozen=True, repr=False)
class Frequencies:
    """What :func:`ksl.frequencies` found."""

    model: Model
    q: Array
    """(n, nq): the poses."""
    time: Array | None
    """(n) s, of a motion."""
    frequencies: Array
    """(n, count) Hz, rising; NaN where there are fewer."""
    lowest: int
    """The pose whose first frequency is the lowest."""
    modes: Modes
    """All modes of that pose."""
    doubts: tuple[str, ...] = ()
    """What is suspicious about the poses: numbers that are likely in other units."""

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes a CSV: `time` of a motion, the columns of the joints' positions, and f1, f2 … in Hz.  Raises OutputError."""
        columns = [column for joint in self.model.joints[: len(self.model.joint_names)] for column in columns_of(joint)[0]]
        head = [*(["time"] if self.time is not None else []), *map(csv_text, columns), *(f"f{k + 1}" for k in range(self.frequencies.shape[1]))]
        rows = np.hstack([*([self.time[:, None]] if self.time is not None else []), self.q, self.frequencies])
        with whole_file(Path(path)) as part, open(part, "w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(head)
            table.writerows([["" if x != x else repr(x) for x in row] for row in rows.tolist()])

    def __repr__(self) -> str:
        """One line; the arrays are in the fields."""
        first = self.frequencies[:, 0] if self.frequencies.size else np.array([np.nan])
        return f"<ksl frequencies of {self.model.name}: {len(self.q)} poses, the first from {first.min():.4g} to {first.max():.4g} Hz>"


def frequencies(
    model: Model | str | os.PathLike[str],
    motion: Any = None,
    *,
    pose: Mapping[str, Any] | ArrayLike | None = None,
    grid: Mapping[str, Sequence[float]] | None = None,
    stiffness: Stiffnesses | None = None,
    gravity: bool = True,
    count: int = 6,
    samples: int = SAMPLES,
    reading: Mapping[str, Any] | None = None,
) -> Frequencies:
    """The lowest natural frequencies in a pose, along a motion, or over a grid of poses: what `ksl modes` does.

    model: a model, or the robot's file.  motion: a file, or as of :func:`ksl.compute_loads`; `samples` of it at most, evenly spaced, are taken.
    pose: {joint: position}, rad or m, or q (nq); joints that are not named are at zero, or follow where loops close.
    grid: {joint: positions}, rad or m: every combination of them, with the other joints as `pose` says.
    stiffness: as of :meth:`Model.modes`; by default that of the model.  gravity: as there.
    count: so many frequencies of each pose.  reading: arguments of :func:`ksl.read_motion`.

    Raises MotionError, DescriptionError or ValueError.  Each pose costs what :meth:`Model.modes` does.

        found = ksl.frequencies("robot.urdf", "motion.csv", stiffness={"elbow": 1.2e4})
        found.frequencies[found.lowest, 0]                                  # Hz
    """
    robot = model if isinstance(model, Model) else load(model)
    for name, x in (("count", count), ("samples", samples)):
        if isinstance(x, bool) or not isinstance(x, (int, np.integer)) or x < 1:
            raise ValueError(f"{name}={x!r}; expected a number, 1 or more")
    poses = _poses(robot, motion, pose, grid, samples, reading or {})
    return _found(robot, poses, table_of(robot, stiffness), gravity, count)


def _found(model: Model, poses: _Poses, stiffness: Mapping[str, Stiffness] | None, gravity: bool, count: int) -> Frequencies:
    rows, lowest, best = [], 0, None
    for k, at in enumerate(poses.q):
        found = modes(model, at, stiffness, gravity)
        rows.append(found.frequencies[:count])
        if best is None or (len(rows[k]) and rows[k][0] < rows[lowest][0]):
            lowest, best = k, found
    assert best is not None  # there is one pose at least
    width = max(len(row) for row in rows)
    table = np.array([[*row, *[np.nan] * (width - len(row))] for row in rows]).reshape(len(rows), width)
    return Frequencies(model, poses.q, poses.time, table, lowest, best, poses.doubts)


class _Poses(NamedTuple):
    """Where frequencies are asked for."""

    q: Array
    time: Array | None
    doubts: tuple[str, ...]


def _poses(
    model: Model, motion: Any, pose: Mapping[str, Any] | ArrayLike | None, grid: Mapping[str, Sequence[float]] | None, samples: int, reading: Mapping[str, Any]
) -> _Poses:
    if motion is not None:
        if pose is not None or grid is not None:
            raise MotionError("motion with pose or grid: the motion says where all joints are; give one of them")
        read = read_motion(model, motion, **reading) if isinstance(motion, (str, os.PathLike)) else motion_given(model, motion)
        taken = np.unique(np.linspace(0, len(read.time) - 1, min(samples, len(read.time))).round().astype(int))
        return _Poses(read.q[taken], read.time[taken], tuple(read.doubts))
    start = pose_of(model, pose) if isinstance(pose, Mapping) else neutral(model) if pose is None else np.asarray(model.as_array(pose, "q"), dtype=float)
    named = set(named_joints(model, pose if isinstance(pose, Mapping) or pose is None else list(start)))
    if not grid:
        return _at_rest(model, (closed_pose(model, start, named)[0] if model.loops else start)[None])
    values = {name: [float(x) for x in np.atleast_1d(np.asarray(of, dtype=float))] for name, of in grid.items()}
    total = int(np.prod([len(of) for of in values.values()]))
    if not 0 < total <= MOST:
        raise MotionError(f"grid: {total} poses; expected between 1 and {MOST}")
    where = [model.joint(name) for name in values]
    for joint in where:
        if joint.nq != 1:
            raise MotionError(f"grid: joint {joint.name} has {joint.nq} numbers in q; expected one with one")
    q = np.repeat(start[None], total, axis=0)
    q[:, [joint.q_index for joint in where]] = list(product(*values.values()))
    if model.loops:
        q = np.array([closed_pose(model, each, {*values, *named})[0] for each in q])
    return _at_rest(model, q)


def _at_rest(model: Model, q: Array) -> _Poses:
    """Poses (n, nq) of which the first and the last are the ends of a grid."""
    return _Poses(q, None, tuple(dict.fromkeys(line for at in (q[0], q[-1]) for line in suspicions_of_pose(model, at))))
