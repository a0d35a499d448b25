"""MJCF files, and states in MuJoCo's layout: what :mod:`ksl.robot_files.load_mjcf` has for users."""

from ksl.robot_files.load_mjcf import MujocoState, from_mujoco, model_of, to_mujoco

__all__ = ["MujocoState", "from_mujoco", "model_of", "to_mujoco"]
