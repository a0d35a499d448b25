"""Names of the numbers of q, v, a and tau, and tables whose columns have these names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import near_names

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
EFFORTS = {
    "floating": "fx fy fz tx ty tz",
    "spherical": "tx ty tz",
    "planar": "fx fy tz",
    "translation": "fx fy fz",
    "cylindrical": "angle travel",
    "universal": "angle1 angle2",
}
"""The same of efforts."""
TIME = ("time", "t")
"""Columns that tables of motions have besides."""
ROLES = {"q": 0, "q0": 0, "q1": 0, "v": 1, "a": 2, "tau": 3}
"""Arguments of calls, and which of the names of a joint's numbers theirs are."""
LISTED = 12
"""Names in a message; of more it says how many there are."""

Names = tuple[list[str], list[str], list[str], list[str]]


def names_of(joint: str, kind: str) -> Names:
    """Names of a joint's positions, velocities, accelerations and efforts: `elbow`, `elbow.v`, `elbow.a`, `elbow` with one coordinate."""
    if kind not in COLUMNS:
        return [joint], [f"{joint}.v"], [f"{joint}.a"], [joint]
    position, velocity, acceleration, effort = ([f"{joint}.{c}" for c in group.split()] for group in (*COLUMNS[kind], EFFORTS[kind]))
    return position, velocity, acceleration, effort


def column_names(x: Any) -> list[str] | None:
    """Names of the columns of a table: pandas, polars, pyarrow, a structured array, a mapping; of the numbers of a pandas.Series.

    None for whatever has no names, and where they are numbers, as those of pandas are by default: such tables are arrays.
    """
    found: Any
    if type(x) is np.ndarray or isinstance(x, (list, tuple, str, bytes)):
        found = x.dtype.names if isinstance(x, np.ndarray) else None
    elif isinstance(x, Mapping):
        found = x.keys()
    else:
        found = next((names for names in (getattr(x, each, None) for each in ("column_names", "columns", "index")) if names is not None), None)
    if not isinstance(found, Iterable):
        return None
    names = list(found)
    return names if any(isinstance(name, str) for name in names) else None


def by_name(x: Any, names: Sequence[str], what: str, joints: Sequence[tuple[str, str]]) -> NDArray[Any]:
    """The numbers (…, n) of an argument `what`, from a table with these column names; joints: (name, kind) in the order of q.

    Positions have the names of joints with one coordinate, and JOINT.x … as in the columns of motions; velocities and accelerations
    JOINT.v, JOINT.a, or else the names of the joints.  A table of a whole motion serves for q, v and a.
    """
    of_joints = [names_of(*joint) for joint in joints]
    role = ROLES.get(what, 3)
    wanted = [name for each in of_joints for name in each[role]]
    if not set(wanted) & set(names):  # plain names of joints, also for their rates
        plain = [name for each in of_joints for name in (each[0] if len(each[0]) == len(each[role]) else each[role])]
        wanted = plain if set(plain) & set(names) else wanted
    place = f"{what}: columns are taken by name"
    times, taken = Counter(names), set(wanted)
    missing = [name for name in wanted if name not in times]
    if missing:
        others = [name for name in names if name not in taken]
        near = next(filter(None, (near_names(name, others) for name in missing[:LISTED])), "")
        raise ValueError(f"{place}, and there is none for {_listed(missing)}; {near}columns: {_listed(names)}; .to_numpy() takes them by place")
    known = {name for each in of_joints for group in each for name in group}.union(TIME)
    for name in names:
        if name not in known and str(name).lower() not in TIME:
            near = near_names(name, known)
            raise ValueError(f"{place}, and {name!r} is that of no joint; {near}leave it out: table[{_listed(wanted, quoted=True)}]")
        if times[name] > 1 and name in taken:
            raise ValueError(f"{place}, and {name!r} is that of {times[name]} columns; keep one of them")
    if not wanted:
        return np.zeros(0)
    return np.stack(np.broadcast_arrays(*(_column(x, name, what) for name in wanted)), axis=-1)


def _column(x: Any, name: str, what: str) -> NDArray[Any]:
    try:
        column = np.asarray(x[name])
    except (TypeError, KeyError) as error:  # polars.LazyFrame has names, but no numbers yet
        raise ValueError(f"{what}: column {name!r} of a {type(x).__name__} can't be read ({error}); collect it into a table or an array first") from None
    if column.dtype.kind == "O":  # numbers of Python, or of pandas with a place for absent ones
        try:
            column = column.astype(float)
        except (TypeError, ValueError):
            pass
    if column.dtype.kind not in "fiub":
        raise ValueError(f"{what}: column {name!r} has no numbers, but {column.dtype}; expected numbers in every row")
    return column


def _listed(names: Sequence[str], quoted: bool = False) -> str:
    shown = ", ".join(map(repr if quoted else str, names[:LISTED]))
    more = len(names) - LISTED
    return f"[{shown}]" if quoted and more <= 0 else f"[…{len(names)} names]" if quoted else shown + (f" and {more} more" if more > 0 else "")
