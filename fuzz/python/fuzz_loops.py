"""Files of joints that close loops, and of drives, beside a robot of two arms."""

from guided import guide

guide("ksl.robot_files.loops_file", "ksl.base.toml_files", "ksl.base.toml_lines")

import atexit
import os
import tempfile
from pathlib import Path

import ksl
from ksl.robot_files.loading import with_loops
from mutate import of_text
from target import BrokenPromise, check_message, run

LINK = '<link name="{0}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
JOINT = '<joint name="{0}" type="continuous"><parent link="{1}"/><child link="{2}"/><origin xyz="0.3 0 {3}"/><axis xyz="0 1 0"/></joint>'
ROBOT = ksl.load_string(
    '<robot name="fourbar"><link name="ground"/>'
    + "".join(map(LINK.format, ("crank", "coupler", "rocker")))
    + "".join(JOINT.format(*each) for each in (("A", "ground", "crank", 0), ("B", "crank", "coupler", 0), ("D", "ground", "rocker", 0.1)))
    + "</robot>"
)
FILE = Path(tempfile.gettempdir()) / f"ksl_fuzz_{os.getpid()}"
atexit.register(lambda: FILE.unlink(missing_ok=True))


def read(data: bytes) -> None:
    FILE.write_bytes(data)
    model = with_loops(ROBOT, FILE)
    for line in model.warnings:
        check_message(line)
    names = [*model.joint_names, *model.loop_names]
    if not model.loops or len(set(names)) < len(names) or not all(names):
        raise BrokenPromise(f"broken promise: {len(model.loops)} loops, or names of joints that are not unique")


if __name__ == "__main__":
    run(read, of_text, ksl.DescriptionError)
