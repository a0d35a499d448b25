"""A motion that a program gives: arrays, or a table whose columns are named like those of a file."""

from __future__ import annotations

from typing import Any

import numpy as np

from ksl.base.errors import MotionError, near_names
from ksl.base.real_arrays import real_array
from ksl.load_cases.wrench_table import motion_of_arrays
from ksl.model.model import Model
from ksl.mechanism.joint_kinds import columns_of
from ksl.mechanism.states import Array
from ksl.motions.closed_motion import follow_by_loops
from ksl.motions.motion import Motion

EXPECTED = "expected a file, a table with the column `time`, or time (n), q (n, nq) and, if known, v and a (n, nv)"


def motion_given(model: Model, motion: Any) -> Motion:
    """The motion of a table (pandas, polars, pyarrow), or of arrays; a motion is left as it is.  Raises MotionError."""
    if isinstance(motion, Motion):
        return motion
    names = getattr(motion, "column_names", getattr(motion, "columns", None))
    if names is not None:
        return _of_table(model, motion, [str(name) for name in names])
    if not isinstance(motion, (tuple, list)) or not 2 <= len(motion) <= 4:
        raise MotionError(f"motion is {type(motion).__name__}; {EXPECTED}")
    return motion_of_arrays(model, *motion)


def _of_table(model: Model, table: Any, names: list[str]) -> Motion:
    """Columns are taken by name.  Rates are used if those of all joints are there."""
    joints = model.joints[: len(model.joint_names)]
    groups = [[column for j in joints for column in columns_of(j)[k]] for k in range(3)]
    there, following = set(names), follow_by_loops(model, names)
    for column in ("time", *(c for k, c in enumerate(groups[0]) if k not in following)):
        if column not in there:
            raise MotionError(f"motion: the table has no column {column!r}; {near_names(column, names)}its columns are {', '.join(names)}")
    known = {"time", *(column for group in groups for column in group)}
    unknown = [name for name in names if name not in known]
    if unknown:
        raise MotionError(f"motion: unknown column {unknown[0]!r}; {near_names(unknown[0], known)}leave out what belongs to no joint")

    def numbers(group: list[str], may_follow: bool = False) -> Array | None:
        if may_follow and len(following):  # columns that are not there follow from the others
            lacking = np.full(len(table["time"]), np.nan)
            return np.column_stack([real_array(table[c], f"motion: column {c!r}") if c in there else lacking for c in group])
        if not all(column in there for column in group):
            return None
        return np.column_stack([real_array(table[column], f"motion: column {column!r}") for column in group]) if group else np.empty((len(table["time"]), 0))

    q, v, a = numbers(groups[0], may_follow=True), numbers(groups[1]), numbers(groups[2])
    assert q is not None  # its columns are there
    return motion_of_arrays(model, real_array(table["time"], "motion: column 'time'"), q, v, a)
