"""MATLAB files: variables, their classes and shapes, lists of names, what is compressed."""

from guided import guide

guide("ksl.motions")

import ksl
from motion_files import MEMORY, read_content, taken
from mutate_workbooks import of_mat
from target import run

if __name__ == "__main__":
    run(taken("mat", read_content), of_mat, ksl.MotionError, memory=MEMORY)
