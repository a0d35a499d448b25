"""CSV motions: the form of a file, its columns by the names of joints, its numbers."""

from guided import guide

guide("ksl.motions", "ksl.base.csv_cells")

import ksl
from ksl.motions import reading
from ksl.motions.columns import columns_used, time_column
from ksl.motions.columns.column_map import ColumnMap
from ksl.motions.columns.recorded import check_finite
from ksl.motions.files import clock_times, csv_table  # noqa: F401  clock_times is imported late
from mutate import of_text
from target import finite, run

ROBOT = ksl.load_string(
    '<robot name="leg"><link name="a"/><link name="b"/><link name="c"/>'
    '<joint name="hip" type="revolute"><parent link="a"/><child link="b"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint>'
    '<joint name=" slide" type="prismatic"><parent link="b"/><child link="c"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint></robot>',
    masses="optional",
)


def read(data: bytes) -> None:
    table = csv_table.CsvTable("motion.csv", data)
    choice = columns_used.choose_columns(table, ROBOT, ColumnMap(""), ignore_extra=True)
    values = reading._values(table, choice)
    time, _ = time_column.in_seconds(table, time_column.with_unit(table, choice.time, None), values.pop("time"))
    reading._checked_rows(table, time, None, None)
    check_finite(table, values)
    finite(list(values.values()), "positions")


if __name__ == "__main__":
    run(read, of_text, ksl.MotionError)
