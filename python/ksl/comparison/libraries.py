"""The libraries that a robot can be compared with, and how each is found."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from typing import NamedTuple

from ksl.comparison.other_robot import File, OtherRobot


class Library(NamedTuple):
    """A library that may be installed."""

    package: str
    """As Python imports it."""
    command: str
    """What installs it."""
    load: Callable[[File], OtherRobot]


def _loader(module: str, name: str) -> Callable[[File], OtherRobot]:
    def load(file: File) -> OtherRobot:
        made: OtherRobot = getattr(import_module(module), name)(file)
        return made

    return load


LIBRARIES: dict[str, Library] = {
    "pinocchio": Library("pinocchio", "pip install pin", _loader("ksl.comparison.with_pinocchio", "RobotInPinocchio")),
    "mujoco": Library("mujoco", "pip install mujoco", _loader("ksl.comparison.with_mujoco", "RobotInMujoco")),
    "drake": Library("pydrake", "pip install drake", _loader("ksl.comparison.with_drake", "RobotInDrake")),
}
"""By the names that `--with` takes."""


def is_installed(library: Library) -> bool:
    """Whether Python finds it; nothing is imported."""
    return find_spec(library.package) is not None
