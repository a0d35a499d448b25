"""Recordings of Universal Robots by RTDE, as the recorder of UR's client library writes them: a column for each number of each output.

Vectors have a number at the end of their names, `actual_q_0` to `actual_q_5`, base to wrist 3: rad, rad/s.  `timestamp` is in s since the controller was started.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from ksl.base.errors import MotionError
from ksl.base.words import listed
from ksl.model.mechanism import Joint, Mechanism
from ksl.model.states import Array
from ksl.motions.columns.recorded import Recorded

TIME = "timestamp"
JOINTS = 6
UR_NAMES = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
"""As Universal Robots' own description calls them, perhaps with a prefix, and with _joint at the end."""


def is_rtde(table: Recorded) -> bool:
    names = set(table.names)
    return TIME in names and any({f"{which}_q_{i}" for i in range(JOINTS)} <= names for which in ("actual", "target"))


class RtdeTable(Recorded):
    """Positions and velocities by the names of a robot's joints; numbers are read from the table of the file."""

    def __init__(self, table: Recorded, columns: dict[str, str], notes: list[str]) -> None:
        self._table, self._columns = table, columns
        super().__init__(table.file, f"{table.format} of RTDE", list(columns), {}, {}, [*table.notes, *notes], list(table.doubts))

    @property
    def head(self) -> str:
        return self._table.head

    def place(self, row: int) -> str:
        return self._table.place(row)

    def text_in(self, name: str) -> str | None:
        return self._table.text_in(self._columns[name])

    def read(self, names: Sequence[str], time: str | None = None) -> dict[str, Array]:
        found = self._table.read([self._columns[name] for name in names], None if time is None else self._columns[time])
        return {name: found[self._columns[name]] for name in names}


def of_robot(table: Recorded, model: Mechanism, positions_only: bool) -> RtdeTable:
    """The columns that a recording has of the robot's joints.  Measured ones are used where both are there.

    Raises MotionError where it can't be told which joints of the robot the six are.
    """
    which = "actual" if all(f"actual_q_{i}" in table.names for i in range(JOINTS)) else "target"
    joints = _joints(table, model)
    columns: dict[str, str] = {"time": TIME}
    rates = not positions_only and all(f"{which}_qd_{i}" in table.names for i in range(JOINTS))
    accelerated = rates and which == "target" and all(f"target_qdd_{i}" in table.names for i in range(JOINTS))
    for end, suffix, there in (("", "q", True), (".v", "qd", rates), (".a", "qdd", accelerated)):
        columns |= {f"{joint.name}{end}": f"{which}_{suffix}_{i}" for i, joint in enumerate(joints) if there}
    used = f"{which}_q" + (f", {which}_qd" if rates else "") + (f", {which}_qdd" if accelerated else "")
    notes = [f"{used} of RTDE, {'measured' if which == 'actual' else 'commanded'}, are those of {listed([joint.name for joint in joints])}"]
    left = list(dict.fromkeys(re.sub(r"_\d+$", "", name) for name in table.names if name not in columns.values()))
    if left:
        notes.append(f"outputs of RTDE that are not used: {listed(left)}")
    return RtdeTable(table, columns, notes)


def _joints(table: Recorded, model: Mechanism) -> list[Joint]:
    """The six joints: those with UR's names, or all that the robot has if these are six that turn."""
    moving = [joint for joint in model.joints[: len(model.joint_names)] if joint.has_angle and joint.one_coordinate]
    named = [[joint for joint in moving if joint.name.removesuffix("_joint").endswith(name)] for name in UR_NAMES]
    if all(len(found) == 1 for found in named):
        return [found[0] for found in named]
    if len(moving) == JOINTS == len(model.joint_names):
        return moving
    raise MotionError(
        f"{table.head}: is a recording of RTDE with six joints, and {model.name} has {len(model.joint_names)}: {listed(model.joint_names)}. Say which is which by a map (--map FILE): "
        '"actual_q_0" = "JOINT" and so on'
    )
