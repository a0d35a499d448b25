"""Recordings of Universal Robots by RTDE, as the recorder of UR's client library writes them: a column for each number of each output.

Vectors have a number at the end of their names, `actual_q_0` to `actual_q_5`, base to wrist 3: rad, rad/s.  `timestamp` is in s since the controller was started.
"""

from __future__ import annotations

import re
from ksl.base.words import listed
from ksl.mechanism.mechanism import Mechanism
from ksl.motions.columns.recorded import Recorded
from ksl.motions.files.renamed import RenamedTable, joints_of, note_of_others

TIME = "timestamp"
JOINTS = 6
UR_NAMES = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
"""As Universal Robots' own description calls them, perhaps with a prefix, and with _joint at the end."""


def is_rtde(table: Recorded) -> bool:
    names = set(table.names)
    return TIME in names and any({f"{which}_q_{i}" for i in range(JOINTS)} <= names for which in ("actual", "target"))


def of_robot(table: Recorded, model: Mechanism, positions_only: bool) -> RenamedTable:
    """The columns that a recording has of the robot's joints.  Measured ones are used where both are there.

    Raises MotionError where it can't be told which joints of the robot the six are.
    """
    which = "actual" if all(f"actual_q_{i}" in table.names for i in range(JOINTS)) else "target"
    joints = joints_of(table, model, "RTDE", [UR_NAMES], "actual_q_0")
    columns: dict[str, str] = {"time": TIME}
    rates = not positions_only and all(f"{which}_qd_{i}" in table.names for i in range(JOINTS))
    accelerated = rates and which == "target" and all(f"target_qdd_{i}" in table.names for i in range(JOINTS))
    for end, suffix, there in (("", "q", True), (".v", "qd", rates), (".a", "qdd", accelerated)):
        columns |= {f"{joint.name}{end}": f"{which}_{suffix}_{i}" for i, joint in enumerate(joints) if there}
    used = f"{which}_q" + (f", {which}_qd" if rates else "") + (f", {which}_qdd" if accelerated else "")
    notes = [f"{used} of RTDE, {'measured' if which == 'actual' else 'commanded'}, are those of {listed([joint.name for joint in joints])}"]
    notes += note_of_others(table, "RTDE", [re.sub(r"_\d+$", "", name) for name in table.names if name not in columns.values()])
    return RenamedTable(table, "RTDE", columns, {}, notes)
