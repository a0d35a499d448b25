"""ROS 1 bags: records, chunks, the index, messages."""

from guided import guide

guide("ksl.motions", "rosbags.rosbag1")

import ksl
from bag_files import read_bag
from motion_files import MEMORY, taken
from mutate_bags import of_ros1
from target import run

if __name__ == "__main__":
    run(taken("ros1", read_bag), of_ros1, ksl.MotionError, memory=MEMORY)
