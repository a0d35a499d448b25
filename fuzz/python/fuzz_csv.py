"""CSV motions: the form of a file, its columns by the names of joints, its numbers, samples that are repeated, missing or out of order."""

from guided import guide

guide("ksl.motions", "ksl.base.csv_cells")

import ksl
import numpy as np
import scipy.interpolate  # noqa: F401  is imported late, too
from ksl.motions import reading
from ksl.motions.columns import columns_used, time_column
from ksl.motions.columns.column_map import ColumnMap
from ksl.motions.columns.recorded import check_finite
from ksl.motions.files import clock_times, csv_table, rostopic  # noqa: F401  clock_times is imported late
from ksl.motions.signal.ordered import ordered
from mutate import of_text
from target import BrokenPromise, finite, run

ROBOT = ksl.load_string(
    '<robot name="leg"><link name="a"/><link name="b"/><link name="c"/>'
    '<joint name="hip" type="revolute"><parent link="a"/><child link="b"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint>'
    '<joint name=" slide" type="prismatic"><parent link="b"/><child link="c"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint></robot>',
    masses="optional",
)


JOINTS = ROBOT.joints[: len(ROBOT.joint_names)]


def read(data: bytes) -> None:
    """As `read_motion` does, up to the samples that it differentiates."""
    table = csv_table.CsvTable("motion.csv", data)
    recorded = rostopic.joint_states(table, False) if rostopic.is_joint_states(table) else table
    choice = columns_used.choose_columns(recorded, ROBOT, ColumnMap(""), ignore_extra=True)
    values, _ = reading._values(recorded, choice, ROBOT)
    time, _ = time_column.in_seconds(recorded, time_column.with_unit(recorded, choice.time, None), values.pop("time"))
    rows = reading._checked_rows(recorded, time, None, None)
    check_finite(recorded, values, rows, missing=True)
    samples = ordered(recorded.file, JOINTS, time, values, rows)
    if any(len(x) != len(samples.time) for x in (*samples.values.values(), samples.rows)) or not (np.diff(samples.time) > 0).all():
        raise BrokenPromise("broken promise: columns of different lengths, or times that do not increase")
    finite([samples.time], "times")  # positions that overflowed between samples are refused by read_motion, which the targets of packed files run


if __name__ == "__main__":
    run(read, of_text, ksl.MotionError)
