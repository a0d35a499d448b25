"""Excel workbooks: sheets, cells, titles, units, dates."""

from guided import guide

guide("ksl.motions")

import ksl
from motion_files import MEMORY, read_content, taken
from mutate_workbooks import of_xlsx
from target import run

if __name__ == "__main__":
    run(taken("xlsx", read_content), of_xlsx, ksl.MotionError, memory=MEMORY)
