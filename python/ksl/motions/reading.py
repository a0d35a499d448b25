"""Reads motions and external wrenches from files, and says in words what can't be used."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from ksl.errors import MotionError
from ksl.mechanism import Joint, Mechanism
from ksl.motions.columns import columns_of, columns_of_one_coordinate
from ksl.motions.csv_table import check_finite, read_table
from ksl.motions.motion import Motion, complete
from ksl.states import Array

if TYPE_CHECKING:
    pass


def read_motion(model: Mechanism, path: str | os.PathLike[str], smooth: float | None = None) -> Motion:
    """Reads a CSV table with `time` and a column for each moving joint (rad or m); `NAME.v` and `NAME.a` if known.

    A floating joint has the columns NAME.x .y .z .qx .qy .qz .qw, and for its rates NAME.vx .vy .vz .wx .wy .wz and
    NAME.ax .ay .az .bx .by .bz: twist in the body's frame and its componentwise derivative.  `COLUMNS` has those of
    other joints with several coordinates.
    What is missing is differentiated from a quintic spline; what is given is compared with it.  smooth: Hz, see `complete`.  Raises MotionError with file, line or column, fault and mend.
    """
    file = os.fspath(path)
    table = read_table(file)
    _check_columns(model, file, table)
    time = _check_time(file, table["time"])
    check_finite(file, table)
    joints = model.joints[: len(model.joint_names)]
    q = np.column_stack([table[c] for j in joints for c in columns_of(j)[0]]) if joints else np.empty((len(time), 0))
    given = [[np.column_stack([table[c] for c in group]) if group[0] in table else None for group in columns_of(j)[1:]] for j in joints]
    return complete(model, time, q, given, file, 2, smooth)


def _check_columns(model: Mechanism, file: str, table: dict[str, Array]) -> None:
    from difflib import get_close_matches

    joints = model.joints[: len(model.joint_names)]
    if "time" in model.joint_names:
        raise MotionError(f"{file}:1: column `time` holds the times, and {model.name} has a joint 'time' too; rename that joint in the robot's file")
    if "time" not in table:
        raise MotionError(f"{file}:1: no column `time`; found {', '.join(table)}")
    known: dict[str, str] = {}
    for joint in joints:
        for what, group in zip(("position", "velocity", "acceleration"), columns_of(joint), strict=True):
            for c in group:
                use = f"the {what} of joint {joint.name}"
                if c in known and c in table:
                    raise MotionError(f"{file}:1: column {c!r} could be {known[c]} or {use}; rename one of these joints in the robot's file")
                known[c] = use
    for name in table:
        if name != "time" and name not in known:
            near = get_close_matches(name, known, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"the moving joints of {model.name} are {', '.join(model.joint_names)}"
            hint = _several_columns_of(joints, name) or _column_of_follower(model, name) or hint
            if name.startswith("floating_base.") and not (joints and joints[0].parent is None):
                hint = "if the root link floats, load the robot with --floating-base (in Python floating_base=True)"
            raise MotionError(f"{file}:1: unknown column {name!r}; {hint}")
    for joint in joints:
        position, *rates = columns_of(joint)
        for c in position:
            if c not in table:
                pose = "its pose (position in m, unit quaternion)" if joint.quaternion else "its orientation (a unit quaternion)"
                what = "its positions (rad or m)" if joint.quaternion is None else pose
                raise MotionError(f"{file}:1: no column {c!r} for joint {joint.name}; add {what} at every sample")
        for group in rates:
            if any(c in table for c in group) and not all(c in table for c in group):
                absent = next(c for c in group if c not in table)
                raise MotionError(f"{file}:1: no column {absent!r}, though others of its group are there; give all of {', '.join(group)} or none")


def _column_of_follower(model: Mechanism, name: str) -> str | None:
    """What to do about a column of a mimic joint; None where it is none."""
    for follower in map(model.joint, model.follower_names):
        if any(name in group for group in columns_of_one_coordinate(follower)):
            return (
                f"joint {follower.name} mimics {follower.leader}, whose column says where both are: remove this column, "
                'or load the robot with --mimic independent (in Python mimic="independent")'
            )
    return None


def _several_columns_of(joints: tuple[Joint, ...], name: str) -> str | None:
    """What to give instead of a column that a joint would have if it had one coordinate; None where no joint would."""
    for joint in joints:
        for one, group in zip(columns_of_one_coordinate(joint), columns_of(joint), strict=True):
            if name in one and name not in group:
                return f"joint {joint.name} is {joint.kind}: give {' '.join(group)}"
    return None


def _check_time(file: str, time: Array) -> Array:
    check_finite(file, {"time": time})
    bad = np.flatnonzero(np.diff(time) <= 0)
    if len(bad):
        k = int(bad[0]) + 1
        raise MotionError(f"{file}:{k + 2}: time {time[k]:.9g} after {time[k - 1]:.9g}; times must increase: sort the samples and remove repeated ones")
    return time


WRENCH_COLUMNS = ("fx", "fy", "fz", "tx", "ty", "tz")


def read_external(model: Mechanism, path: str | os.PathLike[str], time: Array) -> dict[str, Array]:
    """Reads wrenches that the environment exerts on links: {link: (n, 6)}, force first.

    The table has `time`, with the samples of the motion, and LINK.fx … LINK.tz (missing components are zero): at the
    link's origin, in the link's axes.  Raises MotionError.
    """
    file = os.fspath(path)
    table = read_table(file)
    check_finite(file, table)
    if "time" not in table:
        raise MotionError(f"{file}:1: no column `time`; found {', '.join(table)}")
    if table["time"].shape != time.shape or np.abs(table["time"] - time).max(initial=0.0) > 1e-9 * max(1.0, np.abs(time).max(initial=0.0)):
        raise MotionError(f"{file}: its times are not those of the motion; give one line for each sample of the motion")
    wrenches: dict[str, Array] = {}
    for name, x in table.items():
        link, _, component = name.rpartition(".")
        if name == "time":
            continue
        if link not in model.link_names or component not in WRENCH_COLUMNS:
            raise MotionError(f"{file}:1: unknown column {name!r}; expected LINK.fx … LINK.tz with a link of {', '.join(model.link_names)}")
        wrenches.setdefault(link, np.zeros((len(time), 6)))[:, WRENCH_COLUMNS.index(component)] = x
    return wrenches
