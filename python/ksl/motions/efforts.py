"""Efforts that drives measured, beside a motion: `NAME.effort`, in N m or N, or in ‰ of a rated value, as drives of CiA 402 give them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ksl.base.errors import MotionError, close_names
from ksl.base.files_read import being_read
from ksl.base.input_files import path_given
from ksl.base.words import listed
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.states import Array
from ksl.motions.columns.column_map import ColumnMap, ColumnRule, absent
from ksl.motions.columns.columns_used import EFFORT, by_columns
from ksl.motions.columns.recorded import Recorded, check_finite
from ksl.motions.columns.time_column import TIME, TimeColumn, find_time, in_seconds, with_nanoseconds, with_unit
from ksl.motions.columns.units import bare
from ksl.motions.columns.whole_numbers import with_sign
from ksl.motions.files.map_file import read_map
from ksl.motions.files.recognise import open_table
from ksl.motions.reading_options import check_options
from ksl.motions.signal.ordered import not_increasing

PER_MILLE = ("‰", "permille", "promille", "per mille")
_UNITS = {
    "rad": {"": 1.0, "Nm": 1.0, "N m": 1.0, "N·m": 1.0, "N*m": 1.0, "mNm": 1e-3, "mN m": 1e-3, "kNm": 1e3, "kN m": 1e3},
    "m": {"": 1.0, "N": 1.0, "mN": 1e-3, "kN": 1e3},
}
"""By the unit of the joint's position: how many N m or N each is."""


class Efforts(NamedTuple):
    """What drives measured."""

    time: Array
    """(n), s, increasing: the file's own times."""
    tau: Array
    """(n, nv), N m and N; NaN for coordinates that the file has no effort of."""
    notes: list[str]
    """What was converted."""
    doubts: list[str]
    """Why numbers may be wrong."""


def read_efforts(
    model: Mechanism,
    path: str | os.PathLike[str],
    *,
    map: str | os.PathLike[str] | Mapping[str, object] | None = None,
    time_unit: str | None = None,
    topic: str | None = None,
) -> Efforts:
    """Reads joint efforts that were measured: `time` and `NAME.effort` for some joints with one coordinate, N m or N; other columns are left out.

    path, time_unit, topic: as in :func:`ksl.read_motion`.
    map: which column is which joint's, `{"0x6077": {"to": "elbow.effort", "unit": "permille", "scale": 101}}`, and `rated`, the N m or N at the motor
    that are 1000 ‰; the scale is then the gear.  The file of a motion's map may hold these lines, too: docs/motions.md shows one.
    Signs are those of the file times those of the map: efforts drive the child of a joint along its positive axis.
    Raises MotionError with file, column, fault and mend.

        motion, efforts = ksl.read_motion(m, "log.csv", map="axes.toml"), ksl.read_efforts(m, "log.csv", map="axes.toml")
        error = m.inverse_dynamics(motion.q, motion.v, motion.a)[:, 2] - numpy.interp(motion.time, efforts.time, efforts.tau[:, 2])
    """
    check_options(path_given(path, "a file with efforts"), {"map": map, "time_unit": time_unit, "topic": topic})
    if not isinstance(model, Mechanism):
        raise ValueError(f"model is {type(model).__name__}; expected a model, which ksl.load(file) makes")
    with being_read("motion", path, MotionError):
        table = open_table(path, topic, positions_only=True)
        columns = read_map(map).of(model.joint_names) if map is not None else ColumnMap("")
        joints = {f"{joint.name}{EFFORT}": joint for joint in model.joints[: len(model.joint_names)] if joint.one_coordinate}
        columns = by_columns(table, model, {}, columns)
        rules = _rules(table, columns, joints)
        column = _time(table, columns)
        values = table.read(list(dict.fromkeys([column.name] + [column.nanoseconds] * bool(column.nanoseconds) + list(rules))), column.name)
    whole = with_nanoseconds(table, column, values) if column.nanoseconds else values[column.name]
    time, notes = in_seconds(table, with_unit(table, column, time_unit), whole)
    check_finite(table, {column.name: time} | {name: values[name] for name in rules})
    back = np.flatnonzero(np.diff(time) <= 0)
    if len(back):
        raise not_increasing(table.place, time, int(back[0]) + 1)
    tau, doubts = np.full((len(time), model.nv), np.nan), [*table.doubts, *columns.doubts]
    for name, rule in rules.items():
        joint = joints[rule.to]
        factor, note = _factor(table, columns, name, rule, joint)
        read = with_sign(name, values[name], always=_is_per_mille(table, name, rule))
        tau[:, joint.v_index] = factor * (rule.factor * read.numbers + rule.offset)
        notes += [said for said in (note, read.note) if said]
        doubts += [read.doubt] if read.doubt else []
    return Efforts(time, tau, [*table.notes, *notes], doubts)


def _rules(table: Recorded, columns: ColumnMap, joints: Mapping[str, Joint]) -> dict[str, ColumnRule]:
    """Rules for columns that hold efforts: what the map says, or their own names."""
    for name, rule in columns.rules.items():
        if name not in table.names:
            raise absent(columns, name, list(table.names), table.file)
        if rule.to.endswith(EFFORT) and rule.to not in joints:
            near = close_names(rule.to, list(joints), 1)
            hint = f"did you mean {near[0]!r}?" if near else f"efforts are those of {listed(list(joints))}"
            raise MotionError(f"{columns.file}: column {name!r} is to be {rule.to!r}, the effort of no joint with one coordinate; {hint}")
    rules = {name: columns.rules.get(name, ColumnRule(name)) for name in table.names if name not in columns.ignored}
    found = {name: rule for name, rule in rules.items() if rule.to in joints}
    if not found:
        raise MotionError(
            f'{table.head}: holds no efforts; name columns JOINT{EFFORT}, or say by a map (map=) which they are: "COLUMN" = {{ to = "JOINT{EFFORT}", … }}; its columns are {listed(list(table.names))}'
        )
    for joint in columns.rated:
        if joint + EFFORT not in {rule.to for rule in found.values()}:
            raise MotionError(f"{columns.file}: [rated] names {joint!r}, and no column is {joint + EFFORT!r}; correct the name, or remove the line")
    return found


def _time(table: Recorded, columns: ColumnMap) -> TimeColumn:
    given = [(name, rule) for name, rule in columns.rules.items() if rule.to == TIME]
    return TimeColumn(given[0][0], given[0][1].unit, given[0][1].scale) if given else find_time(table, frozenset())


def _unit(table: Recorded, name: str, rule: ColumnRule) -> str:
    return bare(rule.unit or table.units.get(name, ""))


def _is_per_mille(table: Recorded, name: str, rule: ColumnRule) -> bool:
    return _unit(table, name, rule).lower() in PER_MILLE


def _factor(table: Recorded, columns: ColumnMap, name: str, rule: ColumnRule, joint: Joint) -> tuple[float, str]:
    """What the numbers of a column are multiplied by, and the note about it."""
    unit = _unit(table, name, rule)
    newtons = "N m" if joint.unit == "rad" else "N"
    rated = columns.rated.get(joint.name)
    if _is_per_mille(table, name, rule):
        if rated is None:
            raise MotionError(
                f"{columns.file or table.head}: column {name!r} is in ‰ of a rated value, which isn't given; add it to the map: [rated] with {joint.name} = …, {newtons}"
            )
        return rated / 1000.0, f"{name!r} is {rule.words()}: ‰ of {rated:g} {newtons}"
    if rated is not None:
        raise MotionError(f'{columns.file}: [rated] names {joint.name!r}, whose column {name!r} is no ‰; give it unit = "permille", or remove the line')
    if unit not in _UNITS[joint.unit]:
        raise MotionError(
            f"{columns.file or table.head}: column {name!r} is in {unit!r}, which is no unit of an effort; expected {newtons}, m{newtons}, k{newtons} or permille"
        )
    factor = _UNITS[joint.unit][unit]
    return factor, f"{name!r} is converted from {unit} to {newtons}" if factor != 1.0 else ""
