"""Logs of KUKA's controllers as text: the axes A1, A2 and so on in degrees, by the names of KRL's variables or of the sensor interface (RSI).

Traces of KRC 4 are binary; their tool, or a program that reads the variables, writes such tables.
"""

from __future__ import annotations

import re

from ksl.mechanism.mechanism import Mechanism
from ksl.motions.columns.recorded import Recorded
from ksl.motions.columns.time_column import find_time
from ksl.motions.files.renamed import RenamedTable, joints_of, note_of_others

VARIABLES = {"axis_act_meas": "measured", "aipos": "measured", "axis_act": "commanded", "aspos": "commanded"}
"""Positions of axes, those that are taken first: of KRL with a $ before them, and of RSI."""
_AXIS = re.compile(r"\$?(axis_act_meas|axis_act|aipos|aspos)[._ ]?a([1-9])", re.IGNORECASE)
CLOCK = "IPOC"
"""RSI's time stamp, ms."""
LEAST = 4
"""Axes of the smallest robots."""


def axes_of(table: Recorded) -> tuple[str, list[str]] | None:
    """The variable that is used, and its columns, A1 first; None if the table is none of KUKA."""
    found: dict[str, dict[int, str]] = {}
    for name in table.names:
        if match := _AXIS.fullmatch(name.strip()):
            found.setdefault(match[1].lower(), {})[int(match[2])] = name
    for variable in VARIABLES:
        axes = found.get(variable, {})
        if len(axes) >= LEAST and sorted(axes) == list(range(1, len(axes) + 1)):
            return variable, [axes[i + 1] for i in range(len(axes))]
    return None


def of_robot(table: Recorded, model: Mechanism, variable: str, axes: list[str]) -> RenamedTable:
    """The axes as positions of the robot's joints: those whose names end in a1, a2 and so on, or in joint_1, or all in their order.

    Raises MotionError where it can't be told which joints these are, and where no column holds the times.
    """
    numbers = range(1, len(axes) + 1)
    joints = joints_of(table, model, "a KUKA", [[f"{before}{i}" for i in numbers] for before in ("a", "joint_", "joint")], axes[0])
    time, unit = (CLOCK, "ms") if CLOCK in table.names else _time(table)
    columns = {"time": time} | {joint.name: axis for joint, axis in zip(joints, axes)}
    units = {"time": unit} | {joint.name: table.units.get(axis, "deg") for joint, axis in zip(joints, axes)}
    notes = [
        f"{axes[0]} to {axes[-1]} of KUKA, {VARIABLES[variable]}, are those of {', '.join(joint.name for joint in joints)}, in degrees; "
        "zero positions and directions are taken to be those of the robot's file"
    ]
    notes += note_of_others(table, "KUKA", [name for name in table.names if name not in columns.values()])
    return RenamedTable(table, "KUKA", columns, {name: unit for name, unit in units.items() if unit}, notes, from_first=time == CLOCK)


def _time(table: Recorded) -> tuple[str, str]:
    """The first column if its name is the unit that traces have, or the one that holds times in any table."""
    if table.names[0].strip("[]() ").lower() in ("ms", "msec"):
        return table.names[0], "ms"
    column = find_time(table, frozenset())
    return column.name, column.unit
