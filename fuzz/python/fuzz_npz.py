"""NPZ files: the archive, headers of arrays, numbers, lists of names."""

from guided import guide

guide("ksl.motions")

import ksl
from motion_files import MEMORY, read_content, taken
from mutate_tables import of_npz
from target import run

if __name__ == "__main__":
    run(taken("npz", read_content), of_npz, ksl.MotionError, memory=MEMORY)
