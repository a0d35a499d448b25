"""A motion: samples of every joint's position over time, with velocities and accelerations given or differentiated."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ksl._core import QUATERNION_ROUNDING, QUATERNION_TOLERANCE
from ksl.errors import MotionError
from ksl.mechanism import Joint, Mechanism
from ksl.states import Array

if TYPE_CHECKING:
    import pyarrow as pa

SPLINE_SAMPLES = 6
"""A quintic needs six samples."""

CONTRADICTION = 0.05
"""Given rates contradict the samples if they differ from the derivative by more than this share of the largest rate."""

COLUMNS = {
    "floating": ("x y z qx qy qz qw", "vx vy vz wx wy wz", "ax ay az bx by bz"),
    "spherical": ("qx qy qz qw", "wx wy wz", "bx by bz"),
    "planar": ("x y angle", "vx vy wz", "ax ay bz"),
    "translation": ("x y z", "vx vy vz", "ax ay az"),
    "cylindrical": ("angle travel", "angle.v travel.v", "angle.a travel.a"),
    "universal": ("angle1 angle2", "angle1.v angle2.v", "angle1.a angle2.a"),
}
"""Columns of joints with several coordinates: position in the joint's frame; velocity, of floating, spherical and planar joints the
twist in the child's axes, linear then angular; its componentwise derivative."""
METRES = ("x", "y", "z", "vx", "vy", "vz", "ax", "ay", "az", "travel", "travel.v", "travel.a")
"""The columns that are in m, m/s and m/s²; the others are in rad or are quaternions."""


@dataclass(frozen=True)
class Motion:
    """Samples of a motion: time (n), q (n, nq), v (n, nv), a (n, nv)."""

    time: Array
    q: Array
    v: Array
    a: Array
    differentiated: list[str] = field(default_factory=list)
    """What was not given, a line each."""
    contradictions: list[str] = field(default_factory=list)
    """Given rates that are not the derivatives of what is given, and quaternions that are not of unit length, a line each."""


def columns_of(joint: Joint) -> tuple[list[str], list[str], list[str]]:
    """Names of a joint's columns: positions, velocities, accelerations."""
    if joint.kind not in COLUMNS:
        return _columns_of_one_coordinate(joint)
    position, velocity, acceleration = ([f"{joint.name}.{c}" for c in group.split()] for group in COLUMNS[joint.kind])
    return position, velocity, acceleration


def _columns_of_one_coordinate(joint: Joint) -> tuple[list[str], list[str], list[str]]:
    return [joint.name], [f"{joint.name}.v"], [f"{joint.name}.a"]


def read_motion(model: Mechanism, path: str | os.PathLike[str]) -> Motion:
    """Reads a CSV table with `time` and a column for each moving joint (rad or m); `NAME.v` and `NAME.a` if known.

    A floating joint has the columns NAME.x .y .z .qx .qy .qz .qw, and for its rates NAME.vx .vy .vz .wx .wy .wz and
    NAME.ax .ay .az .bx .by .bz: twist in the body's frame and its componentwise derivative.  `COLUMNS` has those of
    other joints with several coordinates.
    What is missing is differentiated from a quintic spline; what is given is compared with it.  Raises MotionError with file, line or column, fault and mend.
    """
    file = os.fspath(path)
    table = _read_table(file)
    _check_columns(model, file, table)
    time = _check_time(file, table["time"])
    _check_finite(file, table)
    joints = model.joints[: len(model.joint_names)]
    q = np.column_stack([table[c] for j in joints for c in columns_of(j)[0]]) if joints else np.empty((len(time), 0))
    given = [[np.column_stack([table[c] for c in group]) if group[0] in table else None for group in columns_of(j)[1:]] for j in joints]
    return complete(model, time, q, given, file, 2)


def complete(model: Mechanism, time: Array, q: Array, given: list[list[Array | None]], name: str = "motion", first_line: int | None = None) -> Motion:
    """Computes missing velocities and accelerations.  `given` has [v, a] for each moving joint, each (n, nv) or None.

    name, first_line: what errors call the motion, and the line of its first sample where it is a file.
    """
    where = lambda k: f"{name}: sample {k + 1}" if first_line is None else f"{name}:{k + first_line}"
    contradictions: list[str] = []
    said: dict[str, list[str]] = {}
    v, a = np.empty((len(time), model.nv)), np.empty((len(time), model.nv))
    joints = model.joints[: len(model.joint_names)]
    missing = [j for j, g in zip(joints, given, strict=True) if g[0] is None or g[1] is None]
    if missing and len(time) < SPLINE_SAMPLES:
        rates = " and ".join(" ".join(group) for group in columns_of(missing[0])[1:])
        raise MotionError(
            f"{name}: {_count(len(time), 'sample')}, but differentiating {', '.join(j.name for j in missing)} needs at least {SPLINE_SAMPLES}; "
            f"add samples, or give the columns {rates}"
        )
    if len(time) < 2:
        raise MotionError(f"{name}: {len(time)} sample, but means over time need at least 2; add samples")
    q = q.copy()
    for joint, (joint_v, joint_a) in zip(joints, given, strict=True):
        rows, cols = slice(joint.q_index, joint.q_index + joint.nq), slice(joint.v_index, joint.v_index + joint.nv)
        if joint.quaternion is not None:
            off = np.abs(np.linalg.norm(q[:, rows][:, -4:], axis=1) - 1)
            q[:, rows] = _continuous_unit(where, joint, q[:, rows])
            if (off > QUATERNION_ROUNDING).any():
                contradictions.append(f"quaternions of {joint.name} differ from unit length by up to {off.max():.2g}, and were normalised")
        with np.errstate(over="ignore", invalid="ignore"):  # numbers that are not finite are refused later
            v[:, cols], a[:, cols] = _finite_rates(where, joint, time, q[:, rows], joint_v, joint_a)
            contradictions += _contradictions(joint, time, q[:, rows], v[:, cols], joint_v, joint_a)
        how = "accelerations" if joint_v is not None else "velocities" if joint_a is not None else "velocities and accelerations"
        if joint_v is None or joint_a is None:
            said.setdefault(how, []).append(joint.name)
    whose = {how: "all joints" if len(names) == len(joints) else ", ".join(names) for how, names in said.items()}
    differentiated = [f"{how} of {names} differentiated from a quintic spline through the samples" for how, names in whose.items()]
    return Motion(time, q, v, a, differentiated, contradictions)


def derivative(time: Array, x: Array, order: int = 1) -> Array:
    """Derivative at the samples of the quintic not-a-knot spline through x (n, …)."""
    from scipy.interpolate import make_interp_spline

    rates: Array = make_interp_spline(time, x, k=5, check_finite=False)(time, nu=order)
    return rates


def _rates(joint: Joint, time: Array, q: Array, v: Array | None, a: Array | None) -> tuple[Array, Array]:
    if v is not None and a is not None:
        return v, a
    if v is not None:
        return v, derivative(time, v)
    if joint.quaternion is not None:
        found_v, found_a = _rates_of_poses(time, q)
        return found_v, found_a if a is None else a
    if joint.kind == "planar":
        found_v, found_a = _rates_in_plane(time, q)
        return found_v, found_a if a is None else a
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(time, q, k=5, check_finite=False)
    return spline(time, nu=1), spline(time, nu=2) if a is None else a


def _finite_rates(where: Callable[[int], str], joint: Joint, time: Array, q: Array, given_v: Array | None, given_a: Array | None) -> tuple[Array, Array]:
    """Rates, given or differentiated; refuses positions or times that can't be differentiated in floating point."""
    mend = "positions or rates are too large, or times too close: check their units (rad, m, s)"
    try:
        v, a = _rates(joint, time, q, given_v, given_a)
    except ValueError:  # a singular system of equations
        raise MotionError(f"{where(0)}: {joint.name} can't be differentiated from this sample on; {mend}") from None
    for rate, x in (("velocity", v), ("acceleration", a)):
        bad = np.flatnonzero(~np.isfinite(x).all(axis=1))
        if len(bad):
            raise MotionError(f"{where(bad[0])}: the {rate} of {joint.name}, differentiated, is not finite; {mend}")
    return v, a


def _contradictions(joint: Joint, time: Array, q: Array, v: Array, given_v: Array | None, given_a: Array | None) -> list[str]:
    """Lines for given velocities that are not the derivatives of the positions, and for accelerations and velocities likewise."""
    if len(time) < SPLINE_SAMPLES:
        return []
    try:
        checks = [
            ("position", given_v, None if given_v is None else _rates(joint, time, q, None, None)[0]),
            ("velocity", given_a, None if given_a is None else derivative(time, v)),
        ]
    except ValueError:  # times too close for a spline: nothing to compare with
        return []
    lines = []
    for (of, given, found), columns, floor in zip(checks, columns_of(joint)[1:], (np.abs(q).max(), np.abs(v).max()), strict=True):
        in_metres = np.array([c.removeprefix(f"{joint.name}.") in METRES for c in columns])
        at = None if given is None or found is None else _largest_contradiction(time, given, found, in_metres, 1e-5 * max(1.0, float(floor)))
        if at is None or given is None or found is None:
            continue
        k, c = at
        of_column = "m" if in_metres[c] else "rad"
        unit = (joint.unit if joint.one_coordinate else of_column) + ("/s" if of == "position" else "/s²")
        changes = f"the {of} of {joint.name} changes at {found[k, c]:.4g} {unit}"
        lines.append(f"{columns[c]} at {time[k]:.6g} s is {given[k, c]:.4g} {unit}, but {changes}; check the column")
    return lines


def _largest_contradiction(time: Array, given: Array, found: Array, in_metres: NDArray[np.bool_], floor: float) -> tuple[int, int] | None:
    """Sample and column at which given rates differ most from the derivatives, or None if the difference is not significant.

    Means over windows are compared, not samples: noise of the positions and corners of the rates, both large in the
    found rates of a few samples, have a mean near zero.  Windows whose integrals differ by less than `floor` are at rest.
    """
    width = min(50, max(SPLINE_SAMPLES - 1, len(time) // 4))
    off = given - found
    integral = np.concatenate([np.zeros((1, off.shape[1])), np.cumsum((off[1:] + off[:-1]) / 2 * np.diff(time)[:, None], axis=0)])
    integral = np.abs(integral[width:] - integral[:-width])
    mean = np.where(integral > floor, integral / (time[width:] - time[:-width])[:, None], 0.0)
    largest = np.maximum(np.abs(given), np.abs(found)).max(axis=0)
    for vector in (in_metres, ~in_metres):  # components share the scale of their vector
        largest[vector] = largest[vector].max(initial=0.0)
    share = np.divide(mean, largest, out=np.zeros_like(mean), where=largest > 0)
    start, column = np.unravel_index(int(np.argmax(share)), share.shape)
    if not share[start, column] > CONTRADICTION:
        return None
    return int(start) + int(np.argmax(np.abs(off[start : start + width + 1, column]))), int(column)


def _rates_of_poses(time: Array, q: Array) -> tuple[Array, Array]:
    """Twist in the body's frame and its componentwise derivative, from splines through quaternion and position, if there is one.

    The spline is of unit length only at the samples: n′ = q · q′ corrects for that.
    """
    position, quaternion = np.hsplit(q, [-4])
    q1, q2 = derivative(time, quaternion), derivative(time, quaternion, 2)
    growth = np.sum(quaternion * q1, axis=1, keepdims=True)
    w = 2 * _vector_part(quaternion, q1)
    dw = 2 * _vector_part(quaternion, q2) - 2 * growth * w
    if not position.shape[1]:
        return w, dw
    p1, p2 = derivative(time, position), derivative(time, position, 2)
    v = _into_body(quaternion, p1)
    dv = _into_body(quaternion, p2) - np.cross(w, v)
    return np.hstack([v, w]), np.hstack([dv, dw])


def _rates_in_plane(time: Array, q: Array) -> tuple[Array, Array]:
    """Velocity of a planar joint in the child's axes and its componentwise derivative, from splines through its position."""
    q1, q2 = derivative(time, q), derivative(time, q, 2)
    sine, cosine, w = np.sin(q[:, 2]), np.cos(q[:, 2]), q1[:, 2]
    (vx, vy), (ax, ay) = ((cosine * x[:, 0] + sine * x[:, 1], cosine * x[:, 1] - sine * x[:, 0]) for x in (q1, q2))
    return np.column_stack([vx, vy, w]), np.column_stack([ax + w * vy, ay - w * vx, q2[:, 2]])


def _vector_part(q: Array, r: Array) -> Array:
    """Vector part of q* r."""
    return q[:, 3:] * r[:, :3] - r[:, 3:] * q[:, :3] - np.cross(q[:, :3], r[:, :3])


def _into_body(q: Array, x: Array) -> Array:
    """Rᵀ x of the unit quaternions q (n, 4), xyzw."""
    t = 2 * np.cross(x, q[:, :3])
    return x + q[:, 3:] * t + np.cross(t, q[:, :3])


def _continuous_unit(where: Callable[[int], str], joint: Joint, q: Array) -> Array:
    """Quaternions of unit length and without jumps between q and −q."""
    position, quaternion = np.hsplit(q, [-4])
    length = np.linalg.norm(quaternion, axis=1)
    bad = np.flatnonzero(np.abs(length - 1) > QUATERNION_TOLERANCE)
    if len(bad):
        raise MotionError(
            f"{where(bad[0])}: the quaternion of {joint.name} has length {length[bad[0]]:.6g}; "
            f"expected a unit quaternion in the columns {joint.name}.qx … .qw"
        )
    unit = quaternion / length[:, None]
    turn = np.where(np.sum(unit[1:] * unit[:-1], axis=1) < 0, -1.0, 1.0)
    return np.hstack([position, unit * np.concatenate([[1.0], np.cumprod(turn)])[:, None]])


def _read_table(file: str) -> dict[str, Array]:
    import pyarrow as pa
    from pyarrow import csv

    names = _read_header(file)
    numbered = [f"column {i}" for i in range(len(names))]  # spreadsheets leave columns without a name at the end
    types = {c: pa.float64() if n else pa.string() for c, n in zip(numbered, names, strict=True)}

    def read(threads: bool) -> pa.Table:
        return csv.read_csv(
            file,
            read_options=csv.ReadOptions(column_names=numbered, skip_rows=1, use_threads=threads),
            parse_options=csv.ParseOptions(ignore_empty_lines=False),
            convert_options=csv.ConvertOptions(column_types=types, null_values=["", "NaN", "nan", "NA"], strings_can_be_null=True),
        )

    try:
        try:
            table = read(threads=True)
        except pa.ArrowInvalid:
            table = read(threads=False)  # fails again, and then reports the row
    except pa.ArrowInvalid as e:
        raise MotionError(_what_arrow_says(file, names, str(e))) from None
    except OSError as e:
        what = os.strerror(e.errno) if e.errno else e
        raise MotionError(f"{file}: can't be read ({what}); give a CSV file with `time` and a column for each joint") from None
    columns = {}
    for i, n in enumerate(names):
        if n:
            columns[n] = table.column(i).to_numpy()
        else:
            _check_unnamed(file, i, table.column(i))
    rows = len(table)
    while rows and all(np.isnan(x[rows - 1]) for x in columns.values()):
        rows -= 1  # blank lines at the end
    return {n: x[:rows] for n, x in columns.items()}


def _read_header(file: str) -> list[str]:
    """Names of the columns; empty where a column has none."""
    mend = "give a CSV file with `time` and a column for each joint"
    try:
        mode = os.stat(file).st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):  # read twice, which a pipe can't be
            raise MotionError(f"{file}: is a pipe or a device, and can't be read more than once; write the table to a file, and give that")
        with open(file, "rb") as f:
            line = f.readline()
        header = line.decode("utf-8-sig").strip("\r\n")
    except OSError as e:
        raise MotionError(f"{file}: can't be read ({e.strerror}); {mend}") from None
    except UnicodeDecodeError:
        raise MotionError(f"{file}: line 1 is not text; {mend}") from None
    names = _split(header, ",")
    if line and not any(names):
        raise MotionError(f"{file}:1: no names of columns; {mend}, named in the first line")
    if "time" not in names:
        for separator, word in ((";", "semicolons"), ("\t", "tabs")):
            if "time" in _split(header, separator):
                raise MotionError(f"{file}:1: columns are separated by {word}; separate them by commas, and write numbers with a decimal point")
    repeated = [n for i, n in enumerate(names) if n and n in names[:i]]
    if repeated:
        raise MotionError(f"{file}:1: two columns are named {repeated[0]!r}; rename or remove one")
    return names


def _split(header: str, separator: str) -> list[str]:
    import csv

    return [n.strip() for n in next(csv.reader([header], delimiter=separator, skipinitialspace=True), [])] or [""]


def _check_unnamed(file: str, index: int, column: pa.ChunkedArray) -> None:
    if column.null_count < len(column):
        row = int(np.flatnonzero(~column.is_null().to_numpy())[0])
        raise MotionError(f"{file}:{row + 2}: {column[row].as_py()!r} in column {index + 1}, which has no name; name it in line 1, or remove what it holds")


def _count(n: int, what: str) -> str:
    return f"{n} {what}" if n == 1 else f"{n} {what}s"


def _what_arrow_says(file: str, names: list[str], text: str) -> str:
    found = re.search(r"In CSV column #(\d+): Row #(\d+): .*invalid value '(.*)'", text)
    if found:
        return f"{file}:{int(found[2])}: column {names[int(found[1])]!r} holds {found[3]!r}; expected a number with a decimal point"
    found = re.search(r"Row #(\d+): Expected (\d+) columns, got (\d+)", text)
    if found:
        values, columns = _count(int(found[3]), "value"), _count(int(found[2]), "column")
        return f"{file}:{int(found[1])}: {values} in a table of {columns}; separate values by commas, numbers with a decimal point"
    if "Empty CSV" in text or "Could not skip" in text:
        return f"{file}: holds no samples; give `time` and a column for each joint, a line for each sample"
    return f"{file}: can't be read as CSV ({text}); give `time` and a column for each joint, separated by commas"


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
        if any(name in group for group in _columns_of_one_coordinate(follower)):
            return (
                f"joint {follower.name} mimics {follower.leader}, whose column says where both are: remove this column, "
                'or load the robot with --mimic independent (in Python mimic="independent")'
            )
    return None


def _several_columns_of(joints: tuple[Joint, ...], name: str) -> str | None:
    """What to give instead of a column that a joint would have if it had one coordinate; None where no joint would."""
    for joint in joints:
        for one, group in zip(_columns_of_one_coordinate(joint), columns_of(joint), strict=True):
            if name in one and name not in group:
                return f"joint {joint.name} is {joint.kind}: give {' '.join(group)}"
    return None


def _check_time(file: str, time: Array) -> Array:
    _check_finite(file, {"time": time})
    bad = np.flatnonzero(np.diff(time) <= 0)
    if len(bad):
        k = int(bad[0]) + 1
        raise MotionError(f"{file}:{k + 2}: time {time[k]:.9g} after {time[k - 1]:.9g}; times must increase: sort the samples and remove repeated ones")
    return time


def _check_finite(file: str, table: dict[str, Array]) -> None:
    for name, x in table.items():
        bad = np.flatnonzero(~np.isfinite(x))
        if len(bad):
            what = "is not a number or missing" if np.isnan(x[bad[0]]) else "is infinite"
            raise MotionError(f"{file}:{bad[0] + 2}: column {name!r} {what}; every sample needs a finite number in every column")


WRENCH_COLUMNS = ("fx", "fy", "fz", "tx", "ty", "tz")


def read_external(model: Mechanism, path: str | os.PathLike[str], time: Array) -> dict[str, Array]:
    """Reads wrenches that the environment exerts on links: {link: (n, 6)}, force first.

    The table has `time`, with the samples of the motion, and LINK.fx … LINK.tz (missing components are zero): at the
    link's origin, in the link's axes.  Raises MotionError.
    """
    file = os.fspath(path)
    table = _read_table(file)
    _check_finite(file, table)
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
