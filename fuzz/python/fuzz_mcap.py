"""MCAP files: records, chunks, the index, messages."""

from guided import guide

guide("ksl.motions", "mcap", "mcap_ros2")

import ksl
from motion_files import MEMORY, read_content, taken
from mutate_bags import of_mcap
from target import run

if __name__ == "__main__":
    run(taken("mcap", read_content), of_mcap, ksl.MotionError, memory=MEMORY)
