"""Reads motions and external wrenches from files, and says in words what can't be used."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import MotionError
from ksl.base.files_read import being_read
from ksl.base.input_files import path_given
from ksl.base.words import count, listed
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.joint_kinds import columns_of
from ksl.mechanism.states import Array
from ksl.motions.closed_motion import completed
from ksl.motions.columns.column_map import ColumnMap
from ksl.motions.columns.columns_used import Choice, Used, choose_columns, with_unused_together
from ksl.motions.columns.recorded import Recorded, check_finite
from ksl.motions.columns.time_column import TIME, find_time, in_seconds, with_nanoseconds, with_unit
from ksl.motions.columns.whole_numbers import Read, continued_positions, with_sign
from ksl.motions.files import kuka, rtde
from ksl.motions.files.csv_form import NoTable
from ksl.motions.files.map_file import read_map
from ksl.motions.files.npz_table import NpzTable, with_matrices
from ksl.motions.files.recognise import open_table
from ksl.motions.motion import TOO_LARGE, Motion, Source
from ksl.motions.reading_options import check_options
from ksl.motions.signal.ordered import check_restart, not_increasing, ordered
from ksl.motions.signal.quality import Samples
from ksl.motions.signal.resampling import resampled

Place = Callable[[int], str]
BEYOND = 0.1
"""Positions that go beyond the limits of a joint by less than this share of their range may be meant."""
IMPOSSIBLE_ANGLE, IMPOSSIBLE_SHARE = 1000.0, 100.0
"""An angle of a joint with limits that is larger than this, rad, and than this many times the limit, is refused."""


def read_motion(
    model: Mechanism,
    path: str | os.PathLike[str],
    *,
    map: str | os.PathLike[str] | Mapping[str, object] | None = None,
    degrees: bool = False,
    time_unit: str | None = None,
    resample: float | None = None,
    start: float | None = None,
    stop: float | None = None,
    ignore_extra: bool = False,
    topic: str | None = None,
    positions_only: bool = False,
    smooth: float | None = None,
) -> Motion:
    """Reads a motion of the model: `time` and a column for each moving joint (rad or m); `NAME.v` and `NAME.a` if known.

    Of a mechanism with loops the columns of its drives are enough: the other joints follow, and columns that they have are compared.

    path: a CSV, Parquet or NPZ file, an Excel workbook (.xlsx), an MCAP file, a ROS 1 bag, or the folder of a ROS 2 bag; the content decides, not the name.
    "-" is standard input.  docs/motions.md lists the columns of all kinds of joints, and what each format may hold.

    map: which column of the file is which joint's, and how it is converted: a file, or {column: joint}.
    degrees: angles and their rates are in degrees, unless the file or the map gives their unit.
    time_unit: of the times, "s", "ms", "us", "ns" or "min", unless the file gives it.
    resample: samples at equal steps, this many a second, on quintic splines through those of the file.
    start, stop: the part of the motion that is used, s, in times of the file.
    ignore_extra: columns that belong to no joint are left out; otherwise they are refused.
    topic: which one of the topics of a bag, or of the sheets of a workbook; needed where several hold something.
    positions_only: velocities and accelerations in the file are not used.
    smooth: Hz, at which positions and given rates are low-passed without delay, after resampling; see docs/motions.md.

    What is missing is differentiated from a quintic spline; what is given is compared with it.  `Motion.source` says what was done.
    Raises MotionError with file, line or column, fault and mend; ValueError for what is no model.  100,000 samples of 7 joints take about 50 ms, and half a second to differentiate.

        motion = ksl.read_motion(m, "motion.csv", smooth=20)
        tau = m.inverse_dynamics(motion.q, motion.v, motion.a)              # (samples, 6)
    """
    numbers = {"resample": resample, "start": start, "stop": stop, "smooth": smooth}
    flags = {"degrees": degrees, "ignore_extra": ignore_extra, "positions_only": positions_only}
    check_options(path_given(path, "a motion"), {"map": map, "time_unit": time_unit, "topic": topic, **flags, **numbers})
    if not isinstance(model, Mechanism):
        raise ValueError(f"model is {type(model).__name__}; expected a model, which ksl.load(file) makes")
    with being_read("motion", _whole(path), MotionError):
        table, columns = _opened(path, model, map, topic, positions_only)
        choice = choose_columns(table, model, columns, degrees, ignore_extra, positions_only)
        recorded = _numbers_used(table, choice, model, time_unit, start, stop)
    found = _sampled(table, model, columns, recorded)
    _check_plausible(model, found.q, found.place)
    notes = [*table.notes, *recorded.time_notes, *choice.notes, *recorded.notes, *found.notes]
    measured = Samples(found.time, found.q, found.given)
    if resample is not None:
        found = _resampled(table, model, found, resample)
        notes += found.notes
    if not np.isfinite(found.q).all():
        raise MotionError(f"{found.place(int(np.argmin(np.isfinite(found.q).all(axis=1))))}: a position, interpolated, is not finite; {TOO_LARGE}")
    motion = completed(model, found.time, found.q, found.given, found.known, table.file, found.place, smooth, measured)
    source = Source(table.file, table.format, len(found.time), float(np.median(np.diff(found.time))), with_unused_together(notes))
    return replace(motion, source=source, doubts=[*table.doubts, *columns.doubts, *recorded.doubts, *found.doubts, *motion.doubts])


@dataclass(frozen=True)
class _Numbers:
    """Columns of the motion in SI units, in all rows of the file; the rows that are used; what was done, and what is doubtful."""

    time: Array
    values: dict[str, Array]
    rows: NDArray[np.intp]
    is_part: bool
    """Are these rows between times that were asked for?"""
    time_notes: list[str]
    notes: list[str]
    """What was done to whole numbers: signs, and wraps that were undone."""
    doubts: list[str]


@dataclass(frozen=True)
class _Sampled:
    """Coordinates at times that increase, and what was done."""

    time: Array
    q: Array
    """(n, nq), with the neutral position where the file has none."""
    known: NDArray[np.bool_]
    """(nq) which of them the file has: all but those of joints that follow by loops."""
    given: list[list[Array | None]]
    """[v, a] of each moving joint, (n, nv) or None."""
    place: Place
    notes: list[str]
    doubts: list[str]


def _opened(
    path: str | os.PathLike[str], model: Mechanism, map: str | os.PathLike[str] | Mapping[str, object] | None, topic: str | None, positions_only: bool
) -> tuple[Recorded, ColumnMap]:
    """The file as a table whose names are those of joints, where it is one of a maker's recorder; and what is said of its columns."""
    table = open_table(path, topic, positions_only)
    if map is None:
        table = _of_maker(table, model, positions_only)
    columns = read_map(map).of(model.joint_names) if map is not None else ColumnMap("")
    return with_matrices(table, model, columns.ignored) if isinstance(table, NpzTable) else table, columns


def _numbers_used(table: Recorded, choice: Choice, model: Mechanism, time_unit: str | None, start: float | None, stop: float | None) -> _Numbers:
    """The columns that are used, those of whole numbers with their signs and without wraps.  Raises MotionError for what is no number."""
    values, said = _values(table, choice, model)
    time, notes = in_seconds(table, with_unit(table, choice.time, time_unit), values.pop(TIME))
    rows = _checked_rows(table, time, start, stop)
    check_finite(table, {choice.used[n].source: x[rows] for n, x in values.items()}, rows, missing=True)
    is_part = len(rows) < len(time) or stop is not None
    return _Numbers(time, values, rows, is_part, notes, [read.note for read in said if read.note], [read.doubt for read in said if read.doubt])


def _sampled(table: Recorded, model: Mechanism, columns: ColumnMap, found: _Numbers) -> _Sampled:
    """Samples in the order of their times, and q, v and a of all joints, those that the map holds at rest among them."""
    joints = model.joints[: len(model.joint_names)]
    samples = ordered(table.file, joints, found.time[found.rows], {n: x[found.rows] for n, x in found.values.items()}, found.rows)
    time, values, rows = samples.time, samples.values, samples.rows
    values |= {n: np.full(len(time), x) for n, x in columns.constants.items()}

    columns_of_q = [c for j in joints for c in columns_of(j)[0]]
    known = np.array([c in values for c in columns_of_q], dtype=bool)
    values |= {c: np.full(len(time), x) for c, x, there in zip(columns_of_q, model.neutral(), known, strict=True) if not there}
    q = np.column_stack([values[c] for c in columns_of_q]) if joints else np.empty((len(time), 0))

    at_rest = {c: np.zeros(len(time)) for j in joints if j.one_coordinate and j.name in columns.constants for group in columns_of(j)[1:] for c in group}
    rates = at_rest | values
    given = [[np.column_stack([rates[c] for c in group]) if group[0] in rates else None for group in columns_of(j)[1:]] for j in joints]
    notes = [*samples.notes, *([f"used is the part from {time[0]:.9g} s to {time[-1]:.9g} s"] if found.is_part else [])]
    return _Sampled(time, q, known, given, lambda k: table.place(int(rows[k])), notes, samples.doubts)


def _resampled(table: Recorded, model: Mechanism, found: _Sampled, rate: float) -> _Sampled:
    joints = model.joints[: len(model.joint_names)]
    time, q, given, note = resampled(table.file, joints, found.time, found.q, found.given, rate, found.place)
    return _Sampled(time, q, found.known, given, lambda k: f"{table.file}: sample {k + 1} after resampling", [note], found.doubts)


def _whole(path: str | os.PathLike[str]) -> str | os.PathLike[str]:
    """The folder of a bag whose description is given."""
    return os.path.dirname(path) or os.getcwd() if os.path.basename(path) == "metadata.yaml" else path


def _of_maker(table: Recorded, model: Mechanism, positions_only: bool) -> Recorded:
    """The table with names of the robot's joints, where it is one of a maker's recorder."""
    if rtde.is_rtde(table):
        return rtde.of_robot(table, model, positions_only)
    axes = kuka.axes_of(table)
    return table if axes is None else kuka.of_robot(table, model, *axes)


def _values(table: Recorded, choice: Choice, model: Mechanism) -> tuple[dict[str, Array], list[Read]]:
    """Numbers of the columns that are used, and `time` as the file has it; and what was done to whole numbers."""
    found = table.read(choice.sources, choice.time.name)
    values = {TIME: found[choice.time.name]}
    if choice.time.nanoseconds:
        values[TIME] = with_nanoseconds(table, choice.time, found)
    joints = {joint.name: joint for joint in model.joints[: len(model.joint_names)] if joint.one_coordinate}
    said: list[Read] = []
    for column, used in choice.used.items():
        x, joint = found[used.source], joints.get(column)
        read = with_sign(used.source, x) if joint is None else continued_positions(used.source, x, _possible(joint, used))
        said.append(read)
        values[column] = read.numbers if (used.factor, used.offset) == (1, 0) else used.factor * read.numbers + used.offset
    return values, said


def _possible(joint: Joint, used: Used) -> Callable[[Array], bool] | None:
    """Whether the joint can be at positions that a column's numbers mean; None where it has no limits."""
    lower, upper = joint.lower, joint.upper
    if not joint.has_limits or lower is None or upper is None or not lower < upper:
        return None
    slack = BEYOND * (upper - lower)

    def possible(x: Array) -> bool:
        q = used.factor * x + used.offset
        return bool(q.min() >= lower - slack and q.max() <= upper + slack)

    return possible


def _checked_rows(table: Recorded, time: Array, start: float | None, stop: float | None) -> NDArray[np.intp]:
    """The rows between two times.  Raises MotionError for times of several motions."""
    check_finite(table, {"time": time})
    k = check_restart(time)
    if k is not None and time[k] == time[k - 1]:
        raise MotionError(
            f"{table.place(k)}: {len(time) - len(np.unique(time)):,} of {count(len(time), 'sample')} have the time of another: the times have too few digits, or aren't those of the samples"
        )
    if k is not None:
        raise not_increasing(table.place, time, k)
    for name, value in (("--from (start=)", start), ("--to (stop=)", stop)):
        if value is not None and not np.isfinite(value):
            raise MotionError(f"{table.file}: {name} is {value}; expected a time in s")
    inside = (time >= (-np.inf if start is None else start - 1e-9)) & (time <= (np.inf if stop is None else stop + 1e-9))
    if (start is not None or stop is not None) and len(time) and not inside.any():
        part = " to ".join(f"{x:g} s" for x in (start, stop) if x is not None)
        which = f"from {part}" if stop is None else f"up to {part}" if start is None else f"between {start:g} s and {stop:g} s"
        raise MotionError(f"{table.file}: no samples {which}; its times are {time.min():.9g} s to {time.max():.9g} s: check --from and --to (start=, stop=)")
    return np.flatnonzero(inside)


def _check_plausible(model: Mechanism, q: Array, place: Place) -> None:
    """Refuses angles that no joint with such limits can have: degrees or counts that are taken as radians."""
    for joint in model.joints[: len(model.joint_names)]:
        limit = max((abs(x) for x in (joint.lower, joint.upper) if x is not None), default=0)
        if not (joint.one_coordinate and joint.has_limits and joint.unit == "rad" and limit > 0):
            continue
        angle = np.abs(q[:, joint.q_index])
        bad = np.flatnonzero(angle > max(IMPOSSIBLE_ANGLE, IMPOSSIBLE_SHARE * limit))
        if len(bad):
            raise MotionError(
                f"{place(int(bad[0]))}: joint {joint.name} is at {q[bad[0], joint.q_index]:.6g} rad, where its limit is {limit:.4g} rad; "
                "did you mean --degrees (degrees=True)? Otherwise check their units (rad), or convert the column by a map (--map FILE)"
            )


WRENCH_COLUMNS = ("fx", "fy", "fz", "tx", "ty", "tz")


def read_external(model: Mechanism, path: str | os.PathLike[str], time: Array) -> dict[str, Array]:
    """Reads wrenches that the environment exerts on links: {link: (n, 6)}, force first.

    The table, in any format but a bag, has `time`, with the samples of the motion, and LINK.fx … LINK.tz (missing components
    are zero): at the link's origin, in the link's axes.  Raises MotionError.
    """
    return read_wrenches(model, path, time)[0]


def read_wrenches(model: Mechanism, path: str | os.PathLike[str], time: Array) -> tuple[dict[str, Array], list[str]]:
    """The external wrenches of :func:`read_external`, and why they may be wrong, as `Motion.doubts` says it."""
    with being_read("external", path, MotionError):
        return _wrenches_of(model, path, time)


def _wrenches_of(model: Mechanism, path: str | os.PathLike[str], time: Array) -> tuple[dict[str, Array], list[str]]:
    try:
        table = open_table(path)
    except NoTable as e:
        raise MotionError(f"{e.what}; give a table with `time` and LINK.fx … LINK.tz{e.more}") from None
    if table.is_recording:
        raise MotionError(f"{table.file}: is a bag; give external wrenches as CSV, Parquet or NPZ, with the columns LINK.fx … LINK.tz")
    column = find_time(table, frozenset())
    links = set(model.link_names)
    for name in table.names:
        link, _, component = name.rpartition(".")
        if name not in (column.name, column.nanoseconds) and (link not in links or component not in WRENCH_COLUMNS):
            raise MotionError(f"{table.head}: unknown column {name!r}; expected LINK.fx … LINK.tz with a link of {listed(model.link_names)}")
    values = table.read(list(table.names), column.name)
    whole = values.pop(column.name)
    if column.nanoseconds:
        whole = with_nanoseconds(table, column, {column.name: whole, column.nanoseconds: values.pop(column.nanoseconds)})
    times, _ = in_seconds(table, with_unit(table, column, None), whole)
    check_finite(table, {"time": times} | values)
    if times.shape != time.shape or np.abs(times - time).max(initial=0.0) > 1e-9 * np.abs(time).max(initial=1.0):
        raise MotionError(
            f"{table.file}: its times are not those of the motion; give one line for each sample that is used, or wrenches over time of a load case, which are interpolated (--cases, docs/cases.md)"
        )
    wrenches: dict[str, Array] = {}
    for name, x in values.items():
        link, _, component = name.rpartition(".")
        wrenches.setdefault(link, np.zeros((len(time), 6)))[:, WRENCH_COLUMNS.index(component)] = x
    return wrenches, table.doubts
