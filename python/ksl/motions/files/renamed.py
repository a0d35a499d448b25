"""Tables of makers' recorders, whose columns have other names than a robot's joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ksl.base.errors import MotionError
from ksl.base.words import listed
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.states import Array
from ksl.motions.columns.recorded import Recorded


class RenamedTable(Recorded):
    """Positions and velocities by the names of a robot's joints; numbers are read from the table of the file."""

    def __init__(self, table: Recorded, maker: str, columns: Mapping[str, str], units: Mapping[str, str], notes: list[str], from_first: bool = False) -> None:
        """columns: of the file, by those of the motion.  from_first: times are those of a clock that runs on, and are counted from the first sample."""
        self._table, self._columns, self._from_first = table, columns, from_first
        super().__init__(table.file, f"{table.format} of {maker}", list(columns), {}, units, [*table.notes, *notes], list(table.doubts))

    @property
    def head(self) -> str:
        return self._table.head

    def place(self, row: int) -> str:
        return self._table.place(row)

    def text_in(self, name: str) -> str | None:
        return self._table.text_in(self._columns[name])

    def read(self, names: Sequence[str], time: str | None = None) -> dict[str, Array]:
        found = self._table.read([self._columns[name] for name in names], None if time is None else self._columns[time])
        self.times_are_seconds = self._table.times_are_seconds
        values = {name: found[self._columns[name]] for name in names}
        if self._from_first and time is not None and np.isfinite(values[time][:1]).any():
            self.notes.append(f"times are counted from the first sample, where {self._columns[time]} is {values[time][0]:.15g}")
            values[time] = values[time] - values[time][0]
        return values


def joints_of(table: Recorded, model: Mechanism, maker: str, endings: Sequence[Sequence[str]], example: str) -> list[Joint]:
    """The joints whose names end as one of the lists of endings says, in its order; or all that the robot has if these turn and are as many.

    Raises MotionError where it can't be told which joints of the robot the recorded ones are.  example: a column of the file.
    """
    moving = [joint for joint in model.joints[: len(model.joint_names)] if joint.has_angle and joint.one_coordinate]
    for names in endings:
        named = [[joint for joint in moving if joint.name.lower().removesuffix("_joint").endswith(name)] for name in names]
        if all(len(found) == 1 for found in named):
            return [found[0] for found in named]
    count = len(endings[0])
    if len(moving) == count == len(model.joint_names):
        return moving
    raise MotionError(
        f"{table.head}: is a recording of {maker} with {count} joints, and {model.name} has {len(model.joint_names)}: {listed(model.joint_names)}. Say which is which by a map (--map FILE): "
        f'"{example}" = "JOINT" and so on'
    )


def note_of_others(table: Recorded, maker: str, others: Sequence[str]) -> list[str]:
    return [f"columns of {maker} that are not used: {listed(list(dict.fromkeys(others)))}"] if others else []
