"""MJCF files, and states in MuJoCo's layout: what :mod:`ksl.model.mjcf` has for users."""

from ksl.model.mjcf import MujocoState, from_mujoco, model_of, to_mujoco

__all__ = ["MujocoState", "from_mujoco", "model_of", "to_mujoco"]
