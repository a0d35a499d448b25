"""MJCF files, read and written, and states in MuJoCo's layout: what :mod:`ksl.robot_files` has for users."""

from ksl.robot_files.load_mjcf import model_of
from ksl.robot_files.mjcf_states import MujocoState, from_mujoco, to_mujoco
from ksl.robot_files.mjcf_text import mjcf_text as text
from ksl.robot_files.mjcf_text import write_mjcf as write

__all__ = ["MujocoState", "from_mujoco", "model_of", "text", "to_mujoco", "write"]
