"""Parquet files: what their footer says, types of columns, lists, dates, times that are text.  pyarrow reads them, and is not instrumented."""

from guided import guide

guide("ksl.motions")

import ksl
from motion_files import MEMORY, read_content, taken
from mutate_tables import of_parquet
from target import run


def read(data: bytes) -> None:
    """Lists are read by a map, which says what their elements are."""
    read_content(data, {"state[0]": "slide"} if b"state" in data else None)


if __name__ == "__main__":
    run(taken("parquet", read), of_parquet, ksl.MotionError, memory=MEMORY)
