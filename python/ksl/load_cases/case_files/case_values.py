"""Values in files of load cases: tables, lists and numbers, each refused with the place where it stands; rotations; tables of wrenches."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from ksl.base.errors import CaseError, near_names
from ksl.mechanism.states import Array
from ksl.motions.reading import WRENCH_COLUMNS
from ksl.motions.signal.ordered import not_increasing

OF_MOUNTING = ("rpy", "rpy_degrees", "quaternion")


def check_keys(where: str, given: Mapping[str, Any], known: Collection[str]) -> None:
    for key in given:
        if key not in known:
            raise CaseError(f"{where}: unknown key {key!r}; {near_names(key, known)}known: {', '.join(known)}")


def table_of(where: str, x: Any, shape: str = "") -> dict[str, Any]:
    if not isinstance(x, dict):
        listed = isinstance(x, list) and all(isinstance(one, dict) for one in x)
        raise CaseError(f"{where} is {'a list of tables, [[…]]' if listed else repr(x)}; expected a table{shape}")
    return x


def list_of(where: str, x: Any) -> list[Any]:
    if not isinstance(x, list):
        raise CaseError(f"{where} is {x!r}; expected a list")
    return x


def number_of(where: str, x: Any) -> float:
    if isinstance(x, bool) or not isinstance(x, (int, float)) or not math.isfinite(x):
        raise CaseError(f"{where} is {'missing' if x is None else repr(x)}; expected a number")
    return float(x)


def numbers_of(where: str, x: Any, count: int) -> list[float]:
    if not isinstance(x, list) or len(x) != count:
        raise CaseError(f"{where} is {x!r}; expected {count} numbers")
    return [number_of(where, each) for each in x]


def rotation_of(where: str, given: Any) -> Array:
    """(3, 3): axes of the mounted base in the world."""
    check_keys(where, table_of(where, given), OF_MOUNTING)
    if len(given) != 1:
        raise CaseError(f"{where}: give one of {', '.join(OF_MOUNTING)}")
    ((key, numbers),) = given.items()
    if key == "quaternion":
        x, y, z, w = numbers_of(f"{where}: quaternion (x, y, z, w)", numbers, 4)
        length = math.hypot(x, y, z, w)
        if abs(length - 1) > 1e-2:
            raise CaseError(f"{where}: the quaternion has length {length:.4g}; expected a unit quaternion x, y, z, w")
        x, y, z, w = (c / length for c in (x, y, z, w))
        return np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
    angles = numbers_of(f"{where}: {key}", numbers, 3)
    (cr, cp, cy), (sr, sp, sy) = ([f(math.radians(x) if key == "rpy_degrees" else x) for x in angles] for f in (math.cos, math.sin))
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    rotation: Array = about_z @ about_y @ about_x  # as URDF's rpy
    return rotation


def read_wrench(file: str) -> tuple[Array, Array, list[str]]:
    """Times (n) and wrenches (n, 6) of a table with `time` and some of fx … tz, where missing components are zero; and why they may be wrong."""
    from ksl.motions.columns.recorded import check_finite
    from ksl.motions.columns.time_column import find_time, in_seconds
    from ksl.motions.files.recognise import open_table

    table = open_table(file)
    if table.is_recording:
        raise CaseError(f"{file}: is a bag; give wrenches as CSV, Parquet or NPZ, with the columns time and some of {' '.join(WRENCH_COLUMNS)}")
    column = find_time(table, frozenset())
    for name in table.names:
        if name != column.name and name not in WRENCH_COLUMNS:
            near = near_names(name, WRENCH_COLUMNS)
            raise CaseError(f"{table.head}: unknown column {name!r}; {near}expected {column.name} and some of {' '.join(WRENCH_COLUMNS)}")
    values = table.read(list(table.names), column.name)
    time, _ = in_seconds(table, column, values.pop(column.name))
    check_finite(table, {"time": time} | values)
    if not len(time):
        raise CaseError(f"{file}: has no samples")
    back = np.flatnonzero(np.diff(time) <= 0)
    if len(back):
        raise CaseError(str(not_increasing(table.place, time, int(back[0]) + 1)))
    return time, np.column_stack([values.get(c, np.zeros(len(time))) for c in WRENCH_COLUMNS]), table.doubts
