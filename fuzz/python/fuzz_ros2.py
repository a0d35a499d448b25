"""ROS 2 bags: a database by itself, or the files of a folder, which stand in a zip archive here."""

from guided import guide

guide("ksl.motions", "rosbags.rosbag2")

import ksl
from bag_files import read_bag
from motion_files import MEMORY, taken
from mutate_bags import of_ros2
from target import run

if __name__ == "__main__":
    run(taken("ros2", read_bag), of_ros2, ksl.MotionError, memory=MEMORY)
